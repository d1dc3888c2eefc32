"""Evaluate files of cases without a server: Parquet and tables as text, in constant memory.  It
needs pyarrow.

``answer`` evaluates one Arrow record batch and is all that other tools need; ``evaluate_files``
evaluates files.
"""

from mumacro.files.record_batch import ANSWERS, REJECTS, FilesError, answer
from mumacro.files.run import Summary, evaluate_files

__all__ = ["ANSWERS", "REJECTS", "FilesError", "Summary", "answer", "evaluate_files"]

"""Files of cases, evaluated without a server: Parquet and tables as text, in constant memory.
Needs pyarrow.

``answer`` takes one Arrow record batch and is all that other tools need; ``evaluate_files`` takes
files.
"""

from mumacro.files.record_batch import ANSWERS, REJECTS, FilesError, answer
from mumacro.files.run import Summary, evaluate_files

__all__ = ["ANSWERS", "REJECTS", "FilesError", "Summary", "answer", "evaluate_files"]

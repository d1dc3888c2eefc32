"""Friction of a contact that oscillates across its sliding direction: a surrogate of the full
stick-slip model."""

import sys as _sys

try:
    from mumacro import closed_forms
    from mumacro.analysis import validity
    from mumacro.analysis.fit import fit
    from mumacro.analysis.fit_result import Fit
    from mumacro.answer import Answer
    from mumacro.contacts import stiffness
    from mumacro.contacts.element import Element
    from mumacro.errors import InputError, MumacroError, TableError
    from mumacro.surrogate import Surrogate
    from mumacro.table.atlas import REGIMES, SOURCES
    from mumacro.version import __version__
except ImportError as _error:
    # "python -m mumacro", "-m builder" and "-m service" report in one line what is missing; argv[0]
    # is "-m" meanwhile.
    if _sys.argv[:1] != ["-m"]:
        raise
    from mumacro.extras import missing as _missing

    raise SystemExit(_missing("", _error)) from None

open = Surrogate.open  # noqa: A001 (mumacro.open(), as users of other data libraries expect)

__all__ = [
    "REGIMES",
    "SOURCES",
    "Answer",
    "Element",
    "Fit",
    "InputError",
    "MumacroError",
    "Surrogate",
    "TableError",
    "__version__",
    "closed_forms",
    "fit",
    "open",
    "stiffness",
    "validity",
]

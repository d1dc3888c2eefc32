"""Friction of a contact that oscillates across its sliding direction: a surrogate of the full
stick-slip model."""

import sys as _sys
from typing import TYPE_CHECKING as _TYPE_CHECKING

from mumacro.errors import InputError, MumacroError, TableError
from mumacro.errors import missing as _missing

try:
    from mumacro import closed_forms, plotting
    from mumacro import moved as _moved
    from mumacro.analysis import validity
    from mumacro.analysis.fit import fit
    from mumacro.analysis.fitted import Fit
    from mumacro.analysis.law import law
    from mumacro.analysis.motion import Motion, motion
    from mumacro.analysis.settling import settling
    from mumacro.analysis.solve_for import solve_for
    from mumacro.answer import Answer
    from mumacro.contacts import stiffness
    from mumacro.contacts.element import Element
    from mumacro.surrogate import Surrogate
    from mumacro.table.atlas import REGIMES, SOURCES
    from mumacro.version import __version__
except ImportError as _error:
    # "python -m mumacro", "-m builder" and "-m service" report in one line what is missing; argv[0]
    # is "-m" meanwhile.
    if _sys.argv[:1] != ["-m"]:
        raise
    raise SystemExit(_missing("", _error)) from None

open = Surrogate.open  # noqa: A001 (mumacro.open(), as users of other data libraries expect)

__all__ = [
    "REGIMES",
    "SOURCES",
    "Answer",
    "Element",
    "Fit",
    "InputError",
    "Motion",
    "MumacroError",
    "Surrogate",
    "TableError",
    "__version__",
    "closed_forms",
    "fit",
    "law",
    "motion",
    "open",
    "plotting",
    "settling",
    "solve_for",
    "stiffness",
    "validity",
]

# the modules of the face can be imported by its names, wherever they stand
_sys.modules |= {f"{__name__}.stiffness": stiffness, f"{__name__}.validity": validity}
_sys.meta_path.append(_moved.Signposts)


if not _TYPE_CHECKING:  # with it a type checker would accept any name

    def __getattr__(name: str) -> object:
        """AttributeError; for a method of a surrogate it says how to call it."""
        public = not name.startswith("_") and callable(getattr(Surrogate, name, None))
        advice = f": use mumacro.open().{name}(...)" if public else ""
        raise AttributeError(
            f"module 'mumacro' has no attribute {name!r}{advice}",
            name=name,
            obj=_sys.modules[__name__],
        )


def __dir__() -> list[str]:
    """The public names; folders and modules behind them are left out."""
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})

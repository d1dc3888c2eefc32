"""Compute the friction of a contact that oscillates across its sliding direction, with a surrogate
of the full stick-slip model.

A name is imported when it is first used (PEP 562), so that a program loads only what it needs.  To
add a name, add a line under ``TYPE_CHECKING``, which type checkers and editors read, one in
``_PLACES``, and one in ``__all__``.
"""

import sys as _sys
from importlib import import_module as _import_module
from typing import TYPE_CHECKING as _TYPE_CHECKING

from mumacro.errors import InputError, MumacroError, TableError
from mumacro.errors import missing as _missing

#: the wheel, the tables and the service read it here
__version__ = "0.1.0"

if _TYPE_CHECKING:
    from mumacro import closed_forms, plotting, stiffness, validity
    from mumacro.fits.fit import fit
    from mumacro.fits.fitted import Fit
    from mumacro.fits.loop import fit_loop
    from mumacro.fits.loop_fitted import LoopFit
    from mumacro.motions.element import Element
    from mumacro.motions.harmonics import Harmonics, harmonics
    from mumacro.motions.motion import Motion, motion
    from mumacro.motions.solve_motion import MotionSolution, solve_motion
    from mumacro.outputs.answer import Answer
    from mumacro.questions.law import law
    from mumacro.questions.solve_for import solve_for
    from mumacro.surrogate import Surrogate
    from mumacro.table.atlas import REGIMES, SOURCES

    open = Surrogate.open  # noqa: A001 (mumacro.open(), as users of other data libraries expect)

#: public name -> its module
_PLACES = {
    "closed_forms": "closed_forms",
    "plotting": "plotting",
    "stiffness": "stiffness",
    "validity": "validity",
    "Fit": "fits.fitted",
    "fit": "fits.fit",
    "Harmonics": "motions.harmonics",
    "harmonics": "motions.harmonics",
    "law": "questions.law",
    "LoopFit": "fits.loop_fitted",
    "fit_loop": "fits.loop",
    "Motion": "motions.motion",
    "motion": "motions.motion",
    "solve_for": "questions.solve_for",
    "MotionSolution": "motions.solve_motion",
    "solve_motion": "motions.solve_motion",
    "Answer": "outputs.answer",
    "Element": "motions.element",
    "Surrogate": "surrogate",
    "open": "surrogate",
    "REGIMES": "table.atlas",
    "SOURCES": "table.atlas",
}

__all__ = [
    "REGIMES",
    "SOURCES",
    "Answer",
    "Element",
    "Fit",
    "Harmonics",
    "InputError",
    "LoopFit",
    "Motion",
    "MotionSolution",
    "MumacroError",
    "Surrogate",
    "TableError",
    "__version__",
    "closed_forms",
    "fit",
    "fit_loop",
    "harmonics",
    "law",
    "motion",
    "open",
    "plotting",
    "solve_for",
    "solve_motion",
    "stiffness",
    "validity",
]

if _sys.argv[:1] == ["-m"]:
    # "python -m mumacro", "-m builder" and "-m service" report a missing package in one line
    try:
        _import_module("mumacro.surrogate")
    except ImportError as _error:
        raise SystemExit(_missing("", _error)) from None

if not _TYPE_CHECKING:  # a type checker would otherwise accept any name

    def __getattr__(name: str) -> object:
        """Import a public name and keep it in the module.

        Raise AttributeError for any other name; for a method of a surrogate the message says how to
        call it.
        """
        if name in _PLACES:
            module = _import_module(f"mumacro.{_PLACES[name]}")
            place = module.Surrogate if name == "open" else module
            value = module if _PLACES[name] == name else getattr(place, name)
            globals()[name] = value
            return value
        advice = ""
        if not name.startswith("_"):
            from mumacro.surrogate import Surrogate

            if callable(getattr(Surrogate, name, None)):
                advice = f": use mumacro.open().{name}(...)"
        raise AttributeError(
            f"module 'mumacro' has no attribute {name!r}{advice}",
            name=name,
            obj=_sys.modules[__name__],
        )


def __dir__() -> list[str]:
    """Return the public names, without the folders and modules that hold them."""
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})

"""The range of the solver: v~ and y~ for which it is right to rounding.

Below it products underflow.  Above y~ = 1e14 the section's root is lost in rounding, and at v~ = 1e12 some points need
too many steps.  The limits of the model hold to rounding there, so a table answers for every v~ and y~.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mumacro.errors import InputError

__all__ = ["V_RANGE", "Y_RANGE", "check_range"]

V_RANGE, Y_RANGE = (1e-60, 1e10), (1e-15, 1e14)  # of v~ and y~, dimensionless


def check_range(v: ArrayLike, y: ArrayLike, eta: ArrayLike) -> None:
    """Refuse v~, y~ or eta = y~ - 1 [-], arrays of one shape, that the solver is not made for.

    Raises
    ------
    InputError
        A value out of range or NaN; an ``eta`` that is not y~ - 1 to rounding.
    """
    v, y, eta = (np.asarray(values, dtype=np.float64) for values in (v, y, eta))
    for field, values, (low, high) in (("v_tilde", v, V_RANGE), ("y_tilde", y, Y_RANGE)):
        bound = f"from {low:g} to {high:g}, the range of the solver (Surrogate.mu_ratio of a table answers beyond it)"
        _refuse(field, values, (low <= values) & (values <= high), bound)
    _refuse("eta", eta, np.abs(eta - (y - 1.0)) <= 4e-16 * np.maximum(1.0, y), "y_tilde - 1 to rounding")


def _refuse(field: str, values: NDArray[np.float64], right: NDArray[np.bool_], bound: str) -> None:
    """Raise for the first of ``values`` that is not ``right``."""
    if not right.all():
        at = int(np.argmin(right))
        raise InputError(field, values.flat[at].item(), bound, at if values.ndim else None)

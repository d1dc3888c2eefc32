"""The border of continuous sliding, v~crit(y~): the stored curve inside, its limits at both ends."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mumacro import charts
from mumacro.cells import border_cells
from mumacro.kernel_cache import kernel
from mumacro.table import BorderPiece

__all__ = ["Border"]

Array = NDArray[np.float64]


@kernel
def _curve(y: Array, coef: Array, pieces: Array, out: Array) -> None:
    for i in range(y.size):
        if 0.0 < y[i] < math.inf:
            out[i], _, _ = charts.border(y[i], coef, pieces)
        else:
            out[i] = y[i] if y[i] >= 0.0 else math.nan


class Border:
    """v~crit as a function of y~.

    Attributes
    ----------
    arrays : tuple of ndarray
        What the kernels read: coefficients (cells, 8) and pieces (3, PIECE_COLUMNS).
    max_rel_error : float
        Verified bound of the stored curve's relative error.
    """

    def __init__(self, pieces: Sequence[BorderPiece]) -> None:
        self.arrays: tuple[Array, Array] = border_cells(pieces)
        self.max_rel_error = max(piece.max_rel_error for piece in pieces)

    def __call__(self, y: Array) -> Array:
        """v~crit [-] at ``y`` (n,) [-]: 0 at 0, infinite at infinity, NaN for what is no amplitude."""
        out = np.empty(y.shape)
        _curve(np.ascontiguousarray(y).reshape(-1), *self.arrays, out.reshape(-1))
        return out

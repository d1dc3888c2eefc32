"""The border of continuous sliding, v~crit(y~): the stored curve inside, its limits at both ends."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mumacro import charts
from mumacro.cells import border_cells
from mumacro.kernel_cache import kernel, part
from mumacro.table import BorderPiece

__all__ = ["Border", "border_at"]

Array = NDArray[np.float64]


@part
def border_at(y: float, coef: Array, pieces: Array) -> float:
    """v~crit [-] at the amplitude ``y`` [-]: 0 at 0, infinite at infinity, NaN for what is no amplitude."""
    if 0.0 < y < math.inf:
        crit, _, _ = charts.border(y, coef, pieces)
        return crit
    return y if y >= 0.0 else math.nan


@kernel
def _curve(y: Array, coef: Array, pieces: Array, out: Array) -> None:
    for i in range(y.size):
        out[i] = border_at(y[i], coef, pieces)


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

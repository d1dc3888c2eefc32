"""The border of continuous sliding, v~crit(y~): stored curve inside, its limits at both ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from friction.errors import InputError
from friction.kernels import border_scaled
from friction.patches import cells_1d, pace_of
from friction.regions import BORDER_PIECES
from friction.table import BorderPiece

__all__ = ["Border"]

Array = NDArray[np.float64]


@njit(cache=True, error_model="numpy", nogil=True)
def _curve(y: Array, bcoef: Array, bmeta: Array, out: Array) -> None:
    for i in range(y.size):
        value, scale = border_scaled(y[i], bcoef, bmeta)
        out[i] = value * scale


class Border:
    """v~crit as a function of y~; callable on scalars and arrays.

    Attributes
    ----------
    arrays : tuple of ndarray
        What the kernels read: coefficients (cells, 8) and piece table (3, 4).
    max_rel_error : float
        Verified relative error of the stored curve.
    """

    def __init__(self, pieces: Sequence[BorderPiece]) -> None:
        coefficients, rows, first = [], [], 0
        for (_, name, span, _), piece in zip(BORDER_PIECES, pieces, strict=True):
            coefficients.append(cells_1d(name, span, piece.values, piece.cells))
            rows.append([first, piece.cells, *pace_of(name, *span, piece.cells)])
            first += piece.cells
        self.arrays: tuple[Array, Array] = (np.concatenate(coefficients), np.array(rows))
        self.max_rel_error = max(piece.max_rel_error for piece in pieces)

    def __call__(self, y_tilde: ArrayLike) -> Any:
        """v~crit [-] at ``y_tilde`` [-] >= 0 (infinite for infinite amplitude).

        Raises
        ------
        InputError
            For a negative amplitude or NaN.
        """
        y = np.asarray(y_tilde, dtype=np.float64)
        legal = y >= 0.0
        if not legal.all():
            i = int(np.flatnonzero(~legal.ravel())[0])
            raise InputError("y_tilde", float(y.ravel()[i]), ">= 0", i if y.ndim else None)
        out = np.empty(y.size)
        _curve(np.ascontiguousarray(y).ravel(), *self.arrays, out)
        return out.reshape(y.shape) if y.ndim else (math.inf if y == math.inf else float(out[0]))

"""The border of continuous sliding, v~crit(y~): the stored curve inside, its limits at both ends."""

from collections.abc import Sequence

import numpy as np

from mumacro.arrays import Array
from mumacro.cells import border_cells, outer_cells
from mumacro.charts import SOURCES
from mumacro.library import BLOCK_COLUMNS, Data, kernels
from mumacro.table import BorderPiece


class Border:
    """v~crit as a function of y~.

    Attributes
    ----------
    arrays : tuple of ndarray
        What the kernel reads: coefficients (cells, 8) and pieces (3, PIECE_COLUMNS).
    max_rel_error : float
        Verified bound of the stored curve's relative error.
    """

    def __init__(self, pieces: Sequence[BorderPiece]) -> None:
        self.arrays: tuple[Array, Array] = border_cells(pieces)
        self.max_rel_error = max(piece.max_rel_error for piece in pieces)
        self._data = Data(*self.arrays, np.zeros((len(SOURCES) + 1, BLOCK_COLUMNS)), outer_cells())

    def __call__(self, y: Array) -> Array:
        """v~crit [-] at ``y`` (n,) [-]: 0 at 0, infinite at infinity, NaN for what is no amplitude."""
        return kernels[-1].border(self._data, np.ascontiguousarray(y).reshape(-1)).reshape(y.shape)

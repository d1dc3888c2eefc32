"""Where the kernel places a point: read off tables whose cells hold their own coordinates."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mumacro import charts
from mumacro.border import Border
from mumacro.bundled import bundled_tables
from mumacro.cells import WIDTH, block_rows, outer_cells
from mumacro.charts import CHARTS
from mumacro.library import Data, Kernel, kernels
from mumacro.table import Block, read_table

Array = NDArray[np.float64]
POWER = charts.QUANTITY_NAMES.index("power")  # its range has no upper end, and every block tabulates it


class Places:
    """The places of points where every block has the same numbers of cells along its coordinates."""

    def __init__(self, cells: tuple[int, int], border: Border | None = None) -> None:
        self.cells, self.border = cells, border or Border(read_table(bundled_tables()[0]).border)
        none = np.empty(0)
        self.data = Data(*self.border.arrays, block_rows([Block(none, none, cells)] * len(CHARTS)), outer_cells())

    def points(self, index: int, a: Any, b: Any) -> tuple[Array, Array]:
        """v~ and y~ at shares ``a``, ``b`` of the axes of a block, as evaluation counts them."""
        axes = CHARTS[index].a, CHARTS[index].b
        at = []
        for axis, share in zip(axes, (a, b), strict=True):
            low, high = axis.span
            at.append(axis.to_file(low + (high - low) * np.atleast_1d(np.asarray(share, dtype=np.float64))))
        v, y, _ = CHARTS[index].point(at[0], at[1], self.border)
        return np.ascontiguousarray(v), np.ascontiguousarray(y)

    def source(self, v: Array, y: Array) -> NDArray[np.int8]:
        """The sources of the answers at points (n,)."""
        source = np.empty(v.size, np.int8)
        self._put(np.zeros((1, WIDTH, WIDTH)))
        kernels[-1].values(self.data, POWER, v, y, np.empty(v.size), None, source)
        return source

    def values(self, polynomials: Array, v: Array, y: Array, kernel: Kernel = kernels[-1]) -> Array:
        """The power at points (n,) where the cells of all blocks hold ``polynomials``."""
        self._put(polynomials)
        value = np.empty(v.size)
        kernel.values(self.data, POWER, v, y, value, None, None)
        return value

    def tabulated(self, index: int, polynomials: Array, v: Array, y: Array, kernel: Kernel = kernels[-1]) -> Array:
        """What is tabulated at points (n,) of a block."""
        base, factor = kernel.forms(POWER, index, v, y, y - 1.0)
        return np.asarray((self.values(polynomials, v, y, kernel) - base) / factor)

    def local(self, index: int, v: Array, y: Array) -> tuple[Array, Array]:
        """Coordinates of points (n,) of a block in its only cell, -1 to 1."""
        assert self.cells == (1, 1)
        found = []
        for place in ((-1, -2), (-2, -1)):  # u, then w
            cell = np.zeros((len(CHARTS), WIDTH, WIDTH))
            cell[:, place[0], place[1]], cell[:, -1, -1] = 1.0, 2.0
            found.append(self.tabulated(index, cell, v, y) - 2.0)
        return found[0], found[1]

    def coordinates(self, index: int, v: Array, y: Array) -> tuple[Array, Array]:
        """Evaluation's coordinates of points (n,) of a block."""
        (low_a, high_a), (low_b, high_b) = CHARTS[index].a.span, CHARTS[index].b.span
        u, w = self.local(index, v, y)
        return low_a + 0.5 * (high_a - low_a) * (1.0 + u), low_b + 0.5 * (high_b - low_b) * (1.0 + w)

    def _put(self, polynomials: Array) -> None:
        self.data.put(POWER, polynomials, np.zeros((len(charts.SOURCES) + 1, 2)), np.zeros((polynomials.shape[0], 3)))

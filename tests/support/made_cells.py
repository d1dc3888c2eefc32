"""Tables whose cells hold anything, on the border of a real one."""

from typing import Any

import numpy as np

from mumacro.kernel.binding import Data, Kernel, kernels
from mumacro.table import atlas
from mumacro.table.atlas import CHARTS
from mumacro.table.blocks import Block, TabulatedContact
from mumacro.table.bundled import bundled_tables
from mumacro.table.netcdf import read_table
from mumacro.table.polynomials import Border, block_rows, outer_cells
from tests.support.cases import Array

SPRING_CHARTS = CHARTS["spring"]
# its range has no upper end, and every block tabulates it
POWER = atlas.QUANTITY_NAMES.index("power")


class Cells:
    """Every block has the same numbers of cells along its coordinates."""

    def __init__(self, cells: tuple[int, int], border: Border | None = None) -> None:
        self.cells, self.border = cells, border or Border(read_table(bundled_tables()[0]).border)
        none = np.empty(0)
        blocks = [Block(none, none, cells)] * len(SPRING_CHARTS)
        self.data = Data(
            *self.border.arrays, block_rows(TabulatedContact("spring", blocks)), outer_cells()
        )

    def points(self, index: int, a: Any, b: Any) -> tuple[Array, Array]:
        """v~ and y~ at shares ``a``, ``b`` of the axes of a block, as evaluation counts them."""
        axes = SPRING_CHARTS[index].a, SPRING_CHARTS[index].b
        at = []
        for axis, share in zip(axes, (a, b), strict=True):
            low, high = axis.span
            at.append(
                axis.to_file(
                    low + (high - low) * np.atleast_1d(np.asarray(share, dtype=np.float64))
                )
            )
        v, y, _ = SPRING_CHARTS[index].point(at[0], at[1], self.border)
        return np.ascontiguousarray(v), np.ascontiguousarray(y)

    def values(self, polynomials: Array, v: Array, y: Array, kernel: Kernel = kernels[-1]) -> Array:
        """The power at points (n,) where the cells of all blocks hold ``polynomials``."""
        none = np.zeros((len(atlas.SOURCES) + 1, 2)), np.zeros((polynomials.shape[0], 3))
        self.data.add_quantity(POWER, polynomials, *none)
        value = np.empty(v.size)
        kernel.values(self.data, POWER, v, y, value, None, None)
        return value

    def tabulated(
        self, index: int, polynomials: Array, v: Array, y: Array, kernel: Kernel = kernels[-1]
    ) -> Array:
        """What is tabulated at points (n,) of a block."""
        base, factor = kernel.forms(POWER, index, v, y, y - 1.0)
        return np.asarray((self.values(polynomials, v, y, kernel) - base) / factor)

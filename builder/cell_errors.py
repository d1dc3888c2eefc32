"""How far the cells of a block are off the model: q and its derivatives along both coordinates, cell by cell.

The truth is a second interpolant of the model, through more nodes, none of which is a node of the table, and which are
not rounded.  What it misses itself is far below what the table misses, or as small as the solver's rounding, which
both have.  The difference is a smooth function in every cell; it is taken at the Chebyshev points of a cell, edges
included, where a derivative errs most.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from mumacro.cells import WIDTH, cells_2d, chebyshev_coefficients, interpolation_matrix
from mumacro.charts import CHARTS, CONTINUOUS, QUANTITIES, SQRT2, Axis, Chart
from mumacro.library import kernels
from mumacro.table import Block

__all__ = ["cell_errors", "finer"]

Array = NDArray[np.float64]
POINTS = 17  # along either side of a cell: a polynomial of that degree is what an error of T_8 to T_16 is
_AT = -np.cos(np.arange(POINTS) * math.pi / (POINTS - 1))
_TO_COEFFICIENTS = np.linalg.inv(chebyshev.chebvander(_AT, POINTS - 1))
_TO_DERIVATIVE = chebyshev.chebvander(_AT, POINTS - 2) @ chebyshev.chebder(_TO_COEFFICIENTS)


def finer(shape: tuple[int, int]) -> tuple[int, int]:
    """Numbers of nodes along both coordinates of the interpolant that stands for the model."""
    a, b = (n + max(6, n // 2) for n in shape)
    return a, b


class _Along:
    """The points of all cells along one axis, (cells, POINTS); none below the low end of the block.

    ``wide``: the width that the points of a cell cover; zero where the block never reads it.
    """

    def __init__(self, axis: Axis, cells: int, nodes: int) -> None:
        start, stop = axis.span
        edges = start + (stop - start) * np.arange(cells + 1) / cells
        low = np.clip(edges[:-1], axis.to_evaluation(np.array([axis.low])), edges[1:])
        self.wide = edges[1:] - low
        self.x = low[:, None] + 0.5 * (1.0 + _AT) * self.wide[:, None]
        local = 2.0 * (self.x - edges[:-1, None]) * cells / (stop - start) - 1.0
        self.powers = local[..., None] ** np.arange(WIDTH - 1, -1, -1)
        self.shares, at_border = (x.reshape(local.shape) for x in kernels[-1].cell_shares(local.ravel()))
        self.share_at_border = at_border[-1]
        at = np.clip(axis.to_file(self.x.ravel()), axis.low, axis.high)
        self.follow = interpolation_matrix(nodes, (2.0 * at - axis.low - axis.high) / (axis.high - axis.low))
        scale = np.divide(2.0, self.wide, out=np.zeros(cells), where=self.wide > 0.0)
        self.to_derivative = scale[:, None, None] * _TO_DERIVATIVE


def _difference(chart: Chart, block: Block, values: Array, exact: Array) -> tuple[Array, _Along, _Along]:
    """Cells through node ``values`` minus the interpolant through ``exact``, (cells a, POINTS, cells b, POINTS)."""
    a, b = (_Along(axis, n, m) for axis, n, m in zip((chart.a, chart.b), block.cells, exact.shape, strict=True))
    own = cells_2d(chart.a, chart.b, values, block.cells).reshape(*block.cells, WIDTH, WIDTH)
    found = np.einsum("ipx,ijzx,jqz->ipjq", a.powers, own, b.powers, optimize=True)
    return found - (a.follow @ _without_noise(exact) @ b.follow.T).reshape(found.shape), a, b


def _without_noise(exact: Array) -> Array:
    """Chebyshev coefficients of the interpolant through ``exact``, those at the level of the last ones left out.

    These are the solver's rounding.  At an edge a second derivative multiplies them by the fourth power of their
    number, which would hide what the table errs by.
    """
    c = chebyshev_coefficients(exact)
    c[np.abs(c) <= max(np.abs(c[-2:]).max(), np.abs(c[:, -2:]).max())] = 0.0
    return c


def _without_edge(off: Array, b: _Along, cells: int) -> None:
    """Errors along b of the last cells below the border as evaluation has them, see ``mumacro/kernel/points.c``.

    It takes the derivative at the border out of them.  What is left is linear in the distance to the border, by which
    the chain rule divides; the bound counts it at most half the number of cells per unit of b times.
    """
    root = SQRT2 - b.x[-1, :-1]
    weight = np.maximum(1.0, (1.0 - root * root) / root / (cells / SQRT2))
    b.shares[-1] = b.share_at_border
    off[:, :, -1, :-1] = (off[:, :, -1, :-1] - off[:, :, -1, -1:]) * weight
    off[:, :, -1, -1] = off[:, :, -1, -2]


def cell_errors(index: int, block: Block, exact: dict[str, Array]) -> dict[str, Array]:
    """Largest errors over every cell, (cells, 3) by quantity: of q, of its derivatives along a and along b.

    ``exact`` holds the node values of a second interpolant by quantity, see :func:`finer`.
    """
    chart, found = CHARTS[index], {}
    for quantity in QUANTITIES:
        if quantity.name in block.nodes:
            off, a, b = _difference(chart, block, block.nodes[quantity.name], exact[quantity.name])
            along_a = np.einsum("irp,ipjq->irjq", a.to_derivative, off)
            along_b = np.einsum("jrq,ipjq->ipjr", b.to_derivative, off)
            if quantity.smooth_at_border and chart.regime != CONTINUOUS and chart.b.name == "s":
                _without_edge(along_b, b, block.cells[1])
            along_a /= a.shares[:, :, None, None]
            along_b /= b.shares
            largest = np.stack([np.abs(x).max(axis=(1, 3)) for x in (off, along_a, along_b)], axis=-1)
            found[quantity.name] = largest.reshape(-1, 3)
    return found

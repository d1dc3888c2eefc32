"""Compute cells for the evaluation from the Chebyshev nodes of the file, and the value of one cell.

The file holds the values at tensor-product Chebyshev points of the first kind.  No node is on an
edge, where a solve would be ill conditioned, and the interpolant is the near-best polynomial on the
closed rectangle.  Every block is cut into cells.  Each cell holds a polynomial of degree 7 in both
local coordinates u, w in [-1, 1], as power-basis coefficients.
"""

import functools
import math
from collections.abc import Sequence

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from mumacro.kernel.arrays import Array
from mumacro.kernel.binding import BLOCK_ROW, PIECE_ROW, Data, kernels
from mumacro.table import atlas
from mumacro.table.atlas import Axis
from mumacro.table.blocks import BorderPiece, TabulatedContact

WIDTH = 8  # coefficients of a cell along each coordinate: one vector

# Chebyshev points of one cell, and the matrix from values at these points to power-basis
# coefficients, highest power first
LOCAL = -np.cos((np.arange(WIDTH) + 0.5) * np.pi / WIDTH)
_TO_POWERS: Array = np.linalg.inv(np.vander(LOCAL, WIDTH))


def nodes(n: int, low: float, high: float) -> Array:
    """Return Chebyshev points of the first kind on [low, high], ascending, shape (n,)."""
    x = -np.cos((np.arange(n) + 0.5) * np.pi / n)
    return np.asarray(0.5 * (low + high) + 0.5 * (high - low) * x, dtype=np.float64)


def coefficient_matrix(n: int) -> Array:
    """Return the matrix (n, n) from values at ``n`` :func:`nodes` to the Chebyshev coefficients of
    the interpolant."""
    # the angle as a fraction of a turn in whole numbers: its rounding error would be visible in
    # second derivatives at the edges
    parts = np.outer(np.arange(n), 2 * np.arange(n, 0, -1) - 1) % (4 * n)
    matrix = 2.0 / n * np.cos(np.pi * parts / (2 * n))
    matrix[0] *= 0.5
    return np.asarray(matrix, dtype=np.float64)


def chebyshev_coefficients(values: Array) -> Array:
    """Return the Chebyshev coefficients of the interpolant through ``values`` at :func:`nodes`,
    along every axis."""
    out = np.asarray(values, dtype=np.float64)
    for axis in range(out.ndim):
        matrix = coefficient_matrix(out.shape[axis])
        rows = matrix[:, None] @ np.moveaxis(out, axis, 0).reshape(
            len(matrix), -1
        )  # as in cells_2d
        out = np.moveaxis(rows.reshape(np.moveaxis(out, axis, 0).shape), 0, axis)
    return out


def interpolation_matrix(n: int, t: Array) -> Array:
    """Return the matrix (len(t), n) from Chebyshev coefficients to values at ``t`` in [-1, 1]."""
    return np.asarray(chebyshev.chebvander(t, n - 1), dtype=np.float64)


def _count(axis: Axis, cells: int) -> tuple[float, float]:
    """Return (offset, step): step * coordinate + offset counts cells from 0, and its whole part is
    the index of the cell.

    The far end is slightly below ``cells``, so that it belongs to the last cell.
    """
    start, stop = axis.span
    step = cells / (stop - start) * (1.0 - 2.0**-51)
    return -step * start, step


def cells_1d(piece: int, values: Array, cells: int) -> Array:
    """Return the power-basis coefficients (cells, WIDTH), highest power first, of a piece of v~crit
    with node ``values`` (n,)."""
    x, positions = atlas.BORDER_PIECES[piece][1].cell_positions(cells, LOCAL)
    local = (
        interpolation_matrix(values.size, positions)
        @ chebyshev_coefficients(values)
        * cell_scale(piece, x)
    )
    return _to_powers(local.reshape(cells, WIDTH))


def cell_scale(piece: int, x: Array) -> Array:
    """Return the factor from node values to cell values of a piece of v~crit, at its coordinate
    ``x`` (n,)."""
    with np.errstate(divide="ignore", invalid="ignore"):  # both are infinite at y~ = infinity
        of_nodes, of_cells = kernels[-1].border_scales(
            piece, atlas.BORDER_PIECES[piece][1].amplitude(x)
        )
        return np.where(of_nodes == of_cells, 1.0, of_nodes / of_cells)


def _to_powers(local: Array) -> Array:
    """Return the power-basis coefficients, highest power first, of values (cells, WIDTH) at the
    points of each cell."""
    # without the mean, because the change of basis multiplies rounding errors by a hundred
    mean = local.mean(axis=1)
    out: Array = np.ascontiguousarray((local - mean[:, None]) @ _TO_POWERS.T)
    out[:, -1] += mean
    return out


def cells_2d(a: Axis, b: Axis, values: Array, cells: tuple[int, int]) -> Array:
    """Return the power-basis coefficients (cells along a * cells along b, WIDTH, WIDTH) of node
    ``values`` (n_a, n_b).

    Axis 1 counts powers of the b coordinate, axis 2 powers of the a coordinate, both from 7 down to
    0.
    """
    (_, on_a), (_, on_b) = a.cell_positions(cells[0], LOCAL), b.cell_positions(cells[1], LOCAL)
    return _patches(on_a, on_b, values)


def _patches(on_a: Array, on_b: Array, values: Array) -> Array:
    """Return :func:`cells_2d` from the positions of the cells' points on both axes of nodes."""
    # Cell by cell, because for larger products BLAS starts threads, which take more time than they
    # save.
    along_a, along_b = (
        interpolation_matrix(n, positions).reshape(-1, WIDTH, n)
        for positions, n in zip((on_a, on_b), values.shape, strict=True)
    )
    local = (along_a @ chebyshev_coefficients(values))[:, None] @ along_b.transpose(0, 2, 1)
    mean = local.mean(axis=(2, 3))
    power = _TO_POWERS @ (local - mean[:, :, None, None]) @ _TO_POWERS.T
    power[:, :, -1, -1] += mean
    return np.asarray(power).reshape(-1, WIDTH, WIDTH).transpose(0, 2, 1)


def _join_patches(patches: Sequence[Array]) -> Array:
    """Return the patches (.., WIDTH, WIDTH) of all blocks as one array that starts on a cache line,
    so that a row lies in one cache line."""
    shape = (sum(p.shape[0] for p in patches), WIDTH, WIDTH)
    raw = np.empty(math.prod(shape) + WIDTH)
    skip = (-raw.ctypes.data % 64) // 8
    return np.concatenate(patches, out=raw[skip : skip + math.prod(shape)].reshape(shape))


def border_cells(pieces: Sequence[BorderPiece]) -> tuple[Array, Array]:
    """Return the stored border for the evaluation: coefficients (cells, WIDTH), and a row for each
    piece."""
    coefficients, rows, first = [], np.zeros(len(pieces), PIECE_ROW), 0
    rows["error"] = max(piece.max_rel_error for piece in pieces)
    for index, (row, piece) in enumerate(zip(rows, pieces, strict=True)):
        coefficients.append(cells_1d(index, piece.values, piece.cells))
        row["first"] = first
        row["offset"], row["step"] = _count(atlas.BORDER_PIECES[index][1], piece.cells)
        first += piece.cells
    return np.concatenate(coefficients), _as_numbers(rows)


def block_rows(contact: TabulatedContact) -> Array:
    """Return the geometry of the blocks for the evaluation: a row for each source, and a last row
    for no source."""
    rows, first = np.zeros(len(atlas.SOURCES) + 1, BLOCK_ROW), 0
    for row, chart, block in zip(rows, contact.charts, contact.blocks, strict=False):
        na, nb = block.cells
        row["first"], row["cells_b"] = first, nb
        row["offset_a"], row["step_a"] = _count(chart.a, na)
        row["offset_b"], row["step_b"] = _count(chart.b, nb)
        first += na * nb
    return _as_numbers(rows)


def _as_numbers(rows: NDArray[np.void]) -> Array:
    """Return rows with names as rows of doubles, for the kernel."""
    return rows.view(np.float64).reshape(len(rows), -1)


def quantity_cells(contact: TabulatedContact, code: int) -> tuple[Array, Array, Array]:
    """Return a quantity for :meth:`mumacro.kernel.binding.Data.add_quantity`: polynomials, errors,
    errors in every cell."""
    name, errors = atlas.QUANTITY_NAMES[code], np.zeros((len(atlas.SOURCES) + 1, 2))
    positions = [
        (
            chart.a.cell_positions(block.cells[0], LOCAL)[1],
            chart.b.cell_positions(block.cells[1], LOCAL)[1],
        )
        for chart, block in zip(contact.charts, contact.blocks, strict=True)
    ]
    patches, in_cells = [], []
    for error, chart, block, on_axes in zip(
        errors, contact.charts, contact.blocks, positions, strict=False
    ):
        cells = block.cells[0] * block.cells[1]
        nodes = block.nodes.get(name)
        # zero if the block does not tabulate the quantity
        patches.append(
            np.zeros((cells, WIDTH, WIDTH)) if nodes is None else _patches(*on_axes, nodes)
        )
        error[0] = block.errors[name][0]
        if code == atlas.MU:
            error += chart.rounding, chart.floor
        in_cells.append(block.cell_errors.get(name, np.zeros((cells, 3))))
    return _join_patches(patches), errors, np.concatenate(in_cells)


@functools.cache
def outer_cells() -> Array:
    """Return the coefficients (cells, 2, WIDTH) of f and g + r f'/2 of the limit of large speed, in
    cells of ln (1 + r^2)."""
    kernel = kernels[-1]
    cells, top = kernel.atlas.outer_cells, kernel.atlas.outer_log_max
    r = np.sqrt(np.expm1((np.arange(cells)[:, None] + 0.5 + 0.5 * LOCAL) * top / cells))
    f, g, slope, _, _ = kernel.outer_expansion(r.ravel()).T
    return np.stack([_to_powers(x.reshape(cells, WIDTH)) for x in (f, g + 0.5 * slope)], axis=1)


class Border:
    """Evaluate the border of continuous sliding, v~crit(y~): the stored curve, and its limits at
    both ends.

    ``arrays`` are what the kernel reads, see :func:`border_cells`; ``max_rel_error`` bounds the
    error of the stored curve.
    """

    def __init__(self, pieces: Sequence[BorderPiece]) -> None:
        self.arrays: tuple[Array, Array] = border_cells(pieces)
        self.max_rel_error = max(piece.max_rel_error for piece in pieces)
        no_blocks = block_rows(TabulatedContact("spring", []))
        self._data = Data(*self.arrays, no_blocks, outer_cells())

    def __call__(self, y: Array) -> Array:
        """Return v~crit [-] at ``y`` (n,) [-]: 0 at 0, infinite at infinity, NaN below 0 and for
        NaN."""
        return kernels[-1].border(self._data, np.ascontiguousarray(y).reshape(-1)).reshape(y.shape)

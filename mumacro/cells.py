"""From the Chebyshev nodes of the file to the cells of the evaluation; and the value of one cell.

The file holds the values at tensor-product Chebyshev points of the first kind: no node is on an edge, where a solve
would be ill conditioned, and the interpolant is the near-best polynomial on the closed rectangle.  Every block is cut
into cells; each cell holds a polynomial of degree 7 in both local coordinates u, w in [-1, 1] as power-basis
coefficients.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from mumacro import charts
from mumacro.charts import Axis

if TYPE_CHECKING:
    from mumacro.table import Block, BorderPiece

__all__ = [
    "WIDTH",
    "block_rows",
    "border_cells",
    "cell_positions",
    "cells_1d",
    "cells_2d",
    "chebyshev_coefficients",
    "interpolation_matrix",
    "joined",
    "nodes",
    "patch_value",
]

Array = NDArray[np.float64]
WIDTH = 8  # coefficients of a cell along each coordinate: one vector

# Chebyshev points of one cell and the matrix that takes values there to power-basis coefficients, highest power first
LOCAL = -np.cos((np.arange(WIDTH) + 0.5) * np.pi / WIDTH)
_TO_POWERS: Array = np.linalg.inv(np.vander(LOCAL, WIDTH))


def nodes(n: int, low: float, high: float) -> Array:
    """Chebyshev points of the first kind on [low, high], ascending, shape (n,)."""
    x = -np.cos((np.arange(n) + 0.5) * np.pi / n)
    return np.asarray(0.5 * (low + high) + 0.5 * (high - low) * x, dtype=np.float64)


def chebyshev_coefficients(values: Array) -> Array:
    """Chebyshev coefficients of the interpolant through ``values`` at :func:`nodes`, along every axis."""
    out = np.asarray(values, dtype=np.float64)
    for axis in range(out.ndim):
        n = out.shape[axis]
        x = (np.arange(n) + 0.5) * np.pi / n
        k = np.arange(n)
        matrix = 2.0 / n * np.cos(np.outer(k, np.pi - x))
        matrix[0] *= 0.5
        out = np.moveaxis(np.tensordot(matrix, out, axes=(1, axis)), 0, axis)
    return out


def interpolation_matrix(n: int, t: Array) -> Array:
    """Matrix (len(t), n) from Chebyshev coefficients to values at ``t`` in [-1, 1]."""
    return np.asarray(chebyshev.chebvander(t, n - 1), dtype=np.float64)


def _count(axis: Axis, cells: int) -> tuple[float, float]:
    """(offset, step) with which step * coordinate + offset counts cells from 0; its whole part is the cell.

    The far end is slightly below ``cells``, so that it belongs to the last cell.
    """
    start, stop = axis.span
    step = cells / (stop - start) * (1.0 - 2.0**-51)
    return -step * start, step


def cell_positions(axis: Axis, cells: int) -> tuple[Array, Array]:
    """Points of all cells of one axis: as evaluation's coordinate and as positions in [-1, 1] on the axis of nodes.

    Along s, points below the block are never visited; cells that lie wholly below it repeat its edge.
    """
    start, stop = axis.span
    edge = np.arange(cells)[:, None]
    x = (start + (stop - start) * (0.5 * (2.0 * edge + 1.0 + LOCAL[None, :]) / cells)).ravel()
    at = axis.to_file(x)
    if axis.name == "s":
        dead = axis.to_file(charts.SQRT2 * (np.arange(cells) + 1.0) / cells) <= axis.low
        at.reshape(cells, WIDTH)[dead] = axis.low
    return x, (2.0 * at - axis.low - axis.high) / (axis.high - axis.low)


def cells_1d(axis: Axis, values: Array, cells: int) -> Array:
    """Power-basis coefficients (cells, WIDTH), highest power first, of a piece of v~crit with node ``values`` (n,).

    On the logarithmic piece they hold v~crit itself, on the others the tabulated quotient.
    """
    x, at = cell_positions(axis, cells)
    local = interpolation_matrix(values.size, at) @ chebyshev_coefficients(values)
    if axis.name == "ln_y":
        local = local * np.exp(0.5 * x)
    local = local.reshape(cells, WIDTH)
    # the mean apart: the change of basis multiplies rounding errors by a hundred
    mean = local.mean(axis=1)
    out: Array = np.ascontiguousarray((local - mean[:, None]) @ _TO_POWERS.T)
    out[:, -1] += mean
    return out


def cells_2d(a: Axis, b: Axis, values: Array, cells: tuple[int, int]) -> Array:
    """Power-basis coefficients (cells along a * cells along b, WIDTH, WIDTH) of node ``values`` (n_a, n_b).

    Axis 1 counts powers of the b coordinate, axis 2 powers of the a coordinate, both from 7 down to 0.
    """
    left = interpolation_matrix(values.shape[0], cell_positions(a, cells[0])[1])
    right = interpolation_matrix(values.shape[1], cell_positions(b, cells[1])[1])
    local = (left @ chebyshev_coefficients(values) @ right.T).reshape(cells[0], WIDTH, cells[1], WIDTH)
    mean = local.mean(axis=(1, 3))
    power = np.einsum("pi,aibj,qj->abqp", _TO_POWERS, local - mean[:, None, :, None], _TO_POWERS, optimize=True)
    power[:, :, -1, -1] += mean
    return np.asarray(power, dtype=np.float64).reshape(-1, WIDTH, WIDTH)


def joined(patches: Sequence[Array]) -> Array:
    """The patches (.., WIDTH, WIDTH) of all blocks as one array that starts on a cache line: a row lies in one."""
    shape = (sum(p.shape[0] for p in patches), WIDTH, WIDTH)
    raw = np.empty(math.prod(shape) + WIDTH)
    skip = (-raw.ctypes.data % 64) // 8
    return np.concatenate(patches, out=raw[skip : skip + math.prod(shape)].reshape(shape))


def border_cells(pieces: Sequence[BorderPiece]) -> tuple[Array, Array]:
    """The stored border for evaluation: coefficients (cells, WIDTH) and pieces (3, PIECE_COLUMNS)."""
    coefficients, rows, first = [], np.zeros((len(pieces), charts.PIECE_COLUMNS)), 0
    worst = max(piece.max_rel_error for piece in pieces)
    for row, (_, axis, _), piece in zip(rows, charts.BORDER_PIECES, pieces, strict=True):
        coefficients.append(cells_1d(axis, piece.values, piece.cells))
        row[charts.PIECE_FIRST], row[charts.PIECE_ERROR] = first, worst
        row[charts.PIECE_OFFSET], row[charts.PIECE_STEP] = _count(axis, piece.cells)
        first += piece.cells
    return np.concatenate(coefficients), rows


def block_rows(blocks: Sequence[Block]) -> Array:
    """The array of blocks for evaluation, (OTHER + 1, BLOCK_COLUMNS): geometry, errors, allowances for rounding."""
    rows, first = np.zeros((charts.OTHER + 1, charts.BLOCK_COLUMNS)), 0
    for index, (chart, block) in enumerate(zip(charts.CHARTS, blocks, strict=True)):
        row = rows[index]
        na, nb = block.cells
        row[charts.FIRST], row[charts.CELLS_B] = first, nb
        row[charts.OFFSET_A], row[charts.STEP_A] = _count(chart.a, na)
        row[charts.OFFSET_B], row[charts.STEP_B] = _count(chart.b, nb)
        row[charts.ERROR :] = block.errors.ravel()
        row[charts.ERROR] += charts.rounding_of(index)
        row[charts.FLOOR] = charts.floor_of(index)
        first += na * nb
    return rows


# --- the value of one cell ------------------------------------------------------------------------------
#
# LLVM does not turn eight scalar Horner chains into one vector chain by itself; written out, it is twice as fast
# (docs/decisions/0003-vector-patch.md).  LLVM splits the vectors where the hardware has shorter ones.

_I32 = ir.IntType(32)


def patch_value(coef: Any, p: int, u: float, w: float) -> float:
    """Value of patch ``p`` of ``coef`` (patches, 8, 8) at local coordinates u, w in [-1, 1].

    Rows hold falling powers of w, columns falling powers of u.
    """
    row = coef[p, 0]
    for k in range(1, WIDTH):
        row = row * w + coef[p, k]
    # the sum over powers of u by halves: u^4, u^2, u
    u2 = u * u
    four = row[:4] * (u2 * u2) + row[4:]
    two = four[:2] * u2 + four[2:]
    return two[0] * u + two[1]  # type: ignore[no-any-return]  # numpy's own float


def _vector(n: int) -> ir.VectorType:
    return ir.VectorType(ir.DoubleType(), n)


def _index(positions: list[int]) -> ir.Constant:
    return ir.Constant(ir.VectorType(_I32, len(positions)), positions)


def _splat(builder: Any, x: Any, n: int) -> Any:
    undefined = ir.Constant(_vector(n), ir.Undefined)
    return builder.shuffle_vector(
        builder.insert_element(undefined, x, ir.Constant(_I32, 0)), undefined, _index([0] * n)
    )


def _part(builder: Any, v: Any, start: int, n: int) -> Any:
    return builder.shuffle_vector(v, ir.Constant(v.type, ir.Undefined), _index(list(range(start, start + n))))


def _multiply_add(builder: Any, a: Any, b: Any, c: Any) -> Any:
    return builder.fadd(builder.fmul(a, b, flags=("contract",)), c, flags=("contract",))


@intrinsic
def _patch_vector(_typing: Any, coef: Any, _p: Any, _u: Any, _w: Any) -> Any:
    signature = types.float64(coef, types.int64, types.float64, types.float64)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        array, p, u, w = args
        data = context.make_array(sig.args[0])(context, builder, array).data
        base = builder.gep(data, [builder.mul(p, ir.Constant(ir.IntType(64), WIDTH * WIDTH))])
        rows = builder.bitcast(base, _vector(WIDTH).as_pointer())

        def row(k: int) -> Any:
            return builder.load(builder.gep(rows, [ir.Constant(_I32, k)]), align=8)

        wide = _splat(builder, w, WIDTH)
        acc = row(0)
        for k in range(1, WIDTH):
            acc = _multiply_add(builder, acc, wide, row(k))
        u2 = builder.fmul(u, u)
        u4 = builder.fmul(u2, u2)
        four = _multiply_add(builder, _part(builder, acc, 0, 4), _splat(builder, u4, 4), _part(builder, acc, 4, 4))
        two = _multiply_add(builder, _part(builder, four, 0, 2), _splat(builder, u2, 2), _part(builder, four, 2, 2))
        high = builder.extract_element(two, ir.Constant(_I32, 0))
        low = builder.extract_element(two, ir.Constant(_I32, 1))
        return _multiply_add(builder, high, u, low)

    return signature, codegen


@overload(patch_value, inline="always")
def _compiled_patch_value(coef: Any, p: Any, u: Any, w: Any) -> Any:  # noqa: ARG001 (numba reads the signature)
    if coef.layout != "C":  # patches are found by their place in memory
        return None

    def body(coef: Any, p: Any, u: Any, w: Any) -> Any:
        return _patch_vector(coef, p, u, w)  # type: ignore[call-arg]  # numba supplies the typing context

    return body

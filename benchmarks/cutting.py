"""Cells of any degree and in other coordinates than the kernel's: how many a table needs, and their coefficients.

What :mod:`builder.blocks` and :mod:`friction.patches` do for the kernel's degree alone, with the same criteria.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import NDArray

from builder.blocks import CELL_SHARE, LINES, NODE_FLOOR, SHARE, points_of, slope_of
from friction import Surrogate
from friction.kernels import WIDTH, rounding_of
from friction.patches import (
    aligned,
    chebyshev_coefficients,
    evaluation_span,
    file_coordinate,
    interpolation_matrix,
    pace_of,
)  # fmt: skip
from friction.regions import BLOCKS, BORDER_PIECES, BlockSpec
from friction.table import Block

__all__ = ["LOGARITHMS", "Cut", "Data", "cut", "cut_table", "local_points", "plain_counts"]

Array = NDArray[np.float64]
Weight = Callable[[Array], Array]
Data = tuple[Array, Array, Array, Array]
LOGARITHMS = ("ln_y", "ln_rho")
MOST = 640
FURTHER = 1.5  # how many times the cells that half of the error needs are tried for the other half's sake
CHECK = np.linspace(-1.0, 1.0, 25)


def absolute(truth: Array) -> Array:
    """Errors count as they are."""
    return np.ones_like(truth)


def relative(truth: Array) -> Array:
    """Errors count relative to the value."""
    return np.abs(truth)


def as_promised(truth: Array) -> Array:
    """Errors of mu~ count as a table promises: absolute, and a tenth of the relative one."""
    return np.minimum(1.0, 10.0 * truth)


def local_points(width: int) -> Array:
    """Chebyshev points of one cell."""
    out: Array = -np.cos((np.arange(width) + 0.5) * np.pi / width)
    return out


def bits(x: float) -> float:
    """Exponent + mantissa - 1 of ``x`` > 0: linear between powers of two."""
    mantissa, exponent = math.frexp(x)
    return exponent - 1 + 2.0 * mantissa - 1.0


def logarithm_at(t: Array) -> Array:
    """ln x where ``bits(x)`` = t."""
    whole = np.floor(t)
    out: Array = whole * math.log(2.0) + np.log1p(t - whole)
    return out


@dataclass(frozen=True)
class Cut:
    """One axis cut into cells: their edges in evaluation's coordinate, the part of each that points visit.

    ``place`` takes evaluation's coordinate to the table file's; ``offset`` and ``pace`` are those of the kernel.
    """

    low: Array
    high: Array
    from_: Array
    to: Array
    place: Callable[[Array], Array]
    offset: float
    pace: float

    def points(self, u: Array) -> Array:
        """Evaluation's coordinate at ``u`` in [-1, 1] of what is visited of each cell, shape (cells, u.size)."""
        return np.asarray(0.5 * (self.from_ + self.to)[:, None] + 0.5 * (self.to - self.from_)[:, None] * u)

    def local(self, u: Array) -> Array:
        """Local coordinate of :meth:`points` in the whole cell."""
        return np.asarray((2.0 * self.points(u) - (self.low + self.high)[:, None]) / (self.high - self.low)[:, None])


def cut(name: str, span: tuple[float, float], pieces: int, by_bits: bool) -> Cut:
    """``pieces`` cells over the axis; with ``by_bits``, over every power of two."""
    if not by_bits:
        edges = np.linspace(*evaluation_span(name, *span), pieces + 1)
        low, high = edges[:-1], edges[1:]
        return Cut(low, high, low, high, lambda x: file_coordinate(name, x), *pace_of(name, *span, pieces))
    # a hair, so that rounding of an exponential does not make a cell of its own
    start, stop = (bits(math.exp(end)) for end in span)
    first, last = math.floor(start * pieces + 1e-9), math.ceil(stop * pieces - 1e-9)
    edges = np.arange(first, last + 1) / pieces
    low, high = edges[:-1], edges[1:]
    pace = pieces * (1.0 - 2.0**-51)
    return Cut(low, high, np.maximum(low, start), np.minimum(high, stop), logarithm_at, -pace * edges[0], pace)


def _tries(
    name: str, span: tuple[float, float], exact: Callable[[Array], Array], width: int,
    weight: Weight = absolute, by_bits: bool = False,
) -> Iterator[tuple[Cut, float]]:  # fmt: skip
    """Finer and finer cuts, and how far polynomials of ``width`` coefficients are from ``exact`` (points, lines)."""
    step = 2 if name == "s" else 1  # the knot of sigma is an edge of cells
    points = local_points(width)
    follow = chebvander(CHECK, width - 1) @ np.linalg.inv(chebvander(points, width - 1))
    for pieces in range(step, MOST + 1, step):
        tried = cut(name, span, pieces, by_bits)
        at, check = tried.points(points), tried.points(CHECK)
        if name == "s":
            # cells below the block are never visited
            live = tried.place(check[:, -1]) > span[0]
            at, check = at[live], check[live]
        local = exact(tried.place(at.ravel())).reshape(*at.shape, -1)
        truth = exact(tried.place(check.ravel())).reshape(*check.shape, -1)
        off = np.abs(truth - np.einsum("ij,cjl->cil", follow, local)) / weight(truth)
        inside = tried.place(check.ravel()).reshape(check.shape) >= span[0] - 1e-12
        yield tried, float(off[inside].max())
    raise ArithmeticError(f"{MOST} cells along {name} are not enough")


def _fewest(tries: Iterator[tuple[Cut, float]], wanted: float) -> Cut:
    return next(tried for tried, off in tries if off <= wanted)


def _smallest(tries: tuple[Iterator[tuple[Cut, float]], Iterator[tuple[Cut, float]]], wanted: float) -> tuple[Cut, Cut]:
    """Cuts of both axes with the fewest cells in all whose errors add up to ``wanted`` at most."""
    found: list[list[tuple[Cut, float]]] = []
    for axis in tries:
        kept: list[tuple[Cut, float]] = []
        enough = math.inf
        for tried, off in axis:
            kept.append((tried, off))
            enough = min(enough, len(kept) * FURTHER + 2 if off <= 0.5 * wanted else math.inf)
            if len(kept) >= enough:
                break
        found.append(kept)
    pairs = ((a, b) for a, left in found[0] for b, right in found[1] if left + right <= wanted)
    return min(pairs, key=lambda pair: pair[0].low.size * pair[1].low.size)


def _positions(span: tuple[float, float], x: Array) -> Array:
    return np.asarray((2.0 * x - span[0] - span[1]) / (span[1] - span[0]))


def wanted_of(spec: BlockSpec, block: Block, target: float) -> tuple[float, float]:
    """What the builder lets the cells of a block miss along either axis."""
    c = np.abs(chebyshev_coefficients(block.values))
    left = (c[-2:].sum(axis=0).max(), c[:, -2:].sum(axis=1).max())
    out = [max(CELL_SHARE * target, NODE_FLOOR, min(float(rest), 1.0)) for rest in left]
    if spec.a_name == "inverse_y":
        out[0] = max(SHARE * target, NODE_FLOOR)
    return out[0], out[1]


def _targets(surrogate: Surrogate) -> list[float]:
    options: Any = surrogate.attributes["builder_options"]
    return [float(target) for target in options["block_targets"]]


def _block_tries(spec: BlockSpec, values: Array, axis: int, width: int, by_bits: bool) -> Iterator[tuple[Cut, float]]:
    c = chebyshev_coefficients(values)
    span, name = (spec.a, spec.b)[axis], (spec.a_name, spec.b_name)[axis]
    lines = np.cos(np.linspace(0.0, np.pi, LINES))
    across = np.moveaxis(c, axis, 0) @ interpolation_matrix(values.shape[1 - axis], lines).T

    def exact(x: Array) -> Array:
        return np.asarray(interpolation_matrix(values.shape[axis], _positions(span, x)) @ across)

    return _tries(name, span, exact, width, by_bits=by_bits and name in LOGARITHMS)


def _border_curve(name: str, span: tuple[float, float], values: Array) -> Callable[[Array], Array]:
    c = chebyshev_coefficients(values)[:, None]

    def exact(x: Array) -> Array:
        out: Array = interpolation_matrix(values.size, _positions(span, x)) @ c
        return out * np.exp(0.5 * x)[:, None] if name == "ln_y" else out

    return exact


def _border_cuts(surrogate: Surrogate, by_bits: bool) -> list[Cut]:
    wanted = max(1e-3 * surrogate.tolerance, 4e-15)
    out = []
    for (_, name, span, _), piece in zip(BORDER_PIECES, surrogate.table.border, strict=True):
        curve = _border_curve(name, span, piece.values)
        out.append(_fewest(_tries(name, span, curve, WIDTH, relative, by_bits and name in LOGARITHMS), wanted))
    return out


def _to_powers(axis: Cut, width: int) -> Array:
    """Matrices (cells, width, width) from values at :meth:`Cut.points` to falling powers of the local coordinate."""
    out: Array = np.linalg.inv(np.array([np.vander(u, width) for u in axis.local(local_points(width))]))
    return out


def _axis_matrix(axis: Cut, name: str, span: tuple[float, float], n: int, width: int) -> Array:
    at = axis.place(axis.points(local_points(width)))
    if name == "s":
        at[axis.place(axis.high) <= span[0]] = span[0]
    return interpolation_matrix(n, _positions(span, at.ravel()))


def _patches(spec: BlockSpec, values: Array, a: Cut, b: Cut, shape: tuple[int, int], basis: str) -> Array:
    """Coefficients (cells, rows, columns) in falling powers, or in rising Chebyshev polynomials, of w and u."""
    rows, columns = shape
    left = _axis_matrix(a, spec.a_name, spec.a, values.shape[0], columns)
    right = _axis_matrix(b, spec.b_name, spec.b, values.shape[1], rows)
    local = (left @ chebyshev_coefficients(values) @ right.T).reshape(a.low.size, columns, b.low.size, rows)
    out = aligned(a.low.size * b.low.size, rows, columns)
    if basis == "chebyshev":
        turns = [np.linalg.inv(chebvander(local_points(width), width - 1)) for width in (columns, rows)]
        out[...] = np.einsum("pi,aibj,qj->abqp", turns[0], local, turns[1], optimize=True).reshape(out.shape)
        return out
    # the mean apart: the change of basis multiplies rounding errors by a hundred
    mean = local.mean(axis=(1, 3))
    turned = np.einsum("api,aibj->apbj", _to_powers(a, columns), local - mean[:, None, :, None])
    power = np.einsum("apbj,bqj->abqp", turned, _to_powers(b, rows))
    power[:, :, -1, -1] += mean
    out[...] = power.reshape(out.shape)
    return out


def cut_table(
    surrogate: Surrogate, shape: tuple[int, int] = (WIDTH, WIDTH), *,
    basis: str = "power", by_bits: bool = False, together: bool = False,
) -> tuple[Data, list[tuple[int, int]], list[int]]:  # fmt: skip
    """What a kernel with ``shape`` coefficients along b and a would read, as ``Surrogate`` prepares it for its own.

    The builder's way is to choose the cells along each axis alone; with ``together``, their errors may share what
    both are allowed.  The border keeps the kernel's degree.  Returns coefficients (cells, *shape), block table, border
    coefficients (cells, WIDTH) and border table, then the cells of every block and of every piece of the border.
    """
    patches, rows, shapes, first = [], [], [], 0
    for spec, block, target in zip(BLOCKS, surrogate.table.blocks, _targets(surrogate), strict=True):
        wanted = wanted_of(spec, block, target)
        along = (
            _block_tries(spec, block.values, 0, shape[1], by_bits),
            _block_tries(spec, block.values, 1, shape[0], by_bits),
        )
        a, b = _smallest(along, sum(wanted)) if together else map(_fewest, along, wanted)
        patches.append(_patches(spec, block.values, a, b, shape, basis))
        bound = block.quantity_error + rounding_of(spec)
        rows.append([first, a.low.size, b.low.size, a.offset, a.pace, b.offset, b.pace, bound])
        shapes.append((a.low.size, b.low.size))
        first += a.low.size * b.low.size
    coef = aligned(first, *shape)
    np.concatenate(patches, out=coef)
    lines, heads, first = [], [], 0
    cuts = _border_cuts(surrogate, by_bits)
    for (_, name, span, _), piece, axis in zip(BORDER_PIECES, surrogate.table.border, cuts, strict=True):
        local = _border_curve(name, span, piece.values)(axis.place(axis.points(local_points(WIDTH)).ravel()))
        local = local.reshape(-1, WIDTH)
        mean = local.mean(axis=1)
        power = np.einsum("api,ai->ap", _to_powers(axis, WIDTH), local - mean[:, None])
        power[:, -1] += mean
        lines.append(power)
        heads.append([first, axis.low.size, axis.offset, axis.pace])
        first += axis.low.size
    data = (coef, np.array(rows), np.concatenate(lines), np.array(heads))
    return data, shapes, [axis.low.size for axis in cuts]


def plain_counts(surrogate: Surrogate, spec: BlockSpec, block: Block) -> tuple[int, int]:
    """Cells of a continuous block if they held mu~ itself, to what a table promises."""
    wanted = CELL_SHARE * _targets(surrogate)[BLOCKS.index(spec)]
    c = chebyshev_coefficients(block.values)
    lines = np.cos(np.linspace(0.0, np.pi, LINES))
    out = []
    for axis in (0, 1):
        span, other = (spec.a, spec.b)[axis], (spec.a, spec.b)[1 - axis]
        across = np.moveaxis(c, axis, 0) @ interpolation_matrix(block.values.shape[1 - axis], lines).T
        fixed = 0.5 * (other[0] + other[1]) + 0.5 * (other[1] - other[0]) * lines

        def exact(
            x: Array, axis: int = axis, span: tuple[float, float] = span, fixed: Array = fixed, across: Array = across
        ) -> Array:
            pair = (x[:, None], fixed[None, :]) if axis == 0 else (fixed[None, :], x[:, None])
            quantity = interpolation_matrix(block.values.shape[axis], _positions(span, x)) @ across
            return np.asarray(quantity * slope_of(spec, points_of(spec, *pair, surrogate.border)))

        name = (spec.a_name, spec.b_name)[axis]
        out.append(_fewest(_tries(name, span, exact, WIDTH, as_promised), wanted).low.size)
    return out[0], out[1]

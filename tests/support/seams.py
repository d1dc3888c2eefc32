"""Points beside the seams of a table: where two of its cells meet, and where two blocks do.

What an answer errs by jumps there, so a fault that needs two cells is found beside a seam and
nowhere else.  Three ways to draw cover it: beside a seam along one coordinate, with the other
anywhere; beside a seam along both; and beside a crossing of two seams at distances of the same
size, which is where a strip along one seam ends at another.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from builder.tables.contacts import SolvedContact, scale_of
from builder.tables.verify import BESIDE_BORDER, Neighbours
from mumacro import Surrogate
from mumacro.inputs.fields import BALL, CONTACTS, Kind
from mumacro.kernel.binding import BLOCK_ROW, PIECE_ROW, kernels
from mumacro.table.atlas import (
    BORDER_PIECES,
    MIDDLE,
    QUANTITIES,
    QUANTITY_NAMES,
    STEEPEST,
    Y_CONT,
    Y_TAIL,
    Axis,
    Chart,
    TabulatedQuantity,
)
from mumacro.table.blocks import Block, BorderPiece
from mumacro.table.polynomials import Border, block_rows

Array = NDArray[np.float64]
#: decades of the distance to a seam, in cells
DECADES = 8.0
#: groups that are drawn: all of a ball's and of one spring's blocks but for their limits
V_RANGE, Y_RANGE = (1e-13, 1e8), (1e-8, 1e10)


def _in_file(axis: Axis, x: Array) -> Array:
    """The table file's coordinate at evaluation's, within the block."""
    at = axis.to_file(np.clip(x, *axis.span))
    return np.asarray(np.clip(at, axis.low, axis.high), dtype=np.float64)


def _beside(rng: np.random.Generator, axis: Axis, cells: int, distance: Array) -> Array:
    """At ``distance`` in cells from any of the seams along an axis, on either side; its ends are
    as likely as all seams between them."""
    n = distance.size
    at = np.where(rng.random(n) < 0.5, rng.integers(0, cells + 1, n), rng.choice([0, cells], n))
    start, stop = axis.span
    return _in_file(axis, start + (stop - start) * (at + rng.choice([-1, 1], n) * distance) / cells)


def beside_seams(
    rng: np.random.Generator, chart: Chart, block: Block, border: Border, n: int
) -> tuple[Array, Array]:
    """v~ and y~ of about ``n`` points beside the seams of a block's cells, of a ball those of its
    middle spring."""
    axes, cells = (chart.a, chart.b), block.cells

    def distance(count: int) -> Array:
        return np.asarray(0.4 * 10.0 ** -rng.uniform(0.0, DECADES, count))

    def anywhere(axis: Axis, count: int) -> Array:
        start, stop = axis.span
        return _in_file(axis, start + (stop - start) * rng.random(count))

    part = n // 4
    drawn = [
        [
            _beside(rng, axis, count, distance(part)) if i in seams else anywhere(axis, part)
            for i, (axis, count) in enumerate(zip(axes, cells, strict=True))
        ]
        for seams in ((0,), (1,), (0, 1))
    ]
    common = distance(part)
    drawn.append(
        [
            _beside(rng, axis, count, common * 10.0 ** rng.uniform(-1.5, 0.0, part))
            for axis, count in zip(axes, cells, strict=True)
        ]
    )
    a, b = (np.concatenate(x) for x in zip(*drawn, strict=True))
    with np.errstate(all="ignore"):
        v, y, _ = chart.point(a, b, border)
    inside = [(low <= x) & (x <= high) for x, (low, high) in ((v, V_RANGE), (y, Y_RANGE))]
    return v[inside[0] & inside[1]], y[inside[0] & inside[1]]


def beside_border_seams(
    rng: np.random.Generator, pieces: list[BorderPiece], border: Border, n: int
) -> tuple[Array, Array]:
    """The same of about ``n`` points whose y~ is beside a seam of the border's cells, which are not
    those of the blocks: there the coordinates of stick-slip bend."""
    amplitudes = []
    for (_, axis, _), piece in zip(BORDER_PIECES, pieces, strict=True):
        distance = 0.4 * 10.0 ** -rng.uniform(0.0, DECADES, n // len(pieces))
        x = _beside(rng, axis, piece.cells, distance)
        amplitudes.append(axis.amplitude(x[x > 0.0]))
    y = np.concatenate(amplitudes)
    y = y[(Y_RANGE[0] <= y) & (y <= Y_RANGE[1])]
    s = rng.random(y.size)
    edge = 10.0 ** -rng.uniform(0.0, DECADES, y.size)
    ratio = np.select([s < 0.5, s < 0.7, s < 0.9], [np.sin(np.pi * s) ** 2, edge, 1.0 - edge], s)
    return np.where(s > 0.95, 1.0 / ratio, ratio) * border(y), y


# --- slopes beside the steepest ray ---------------------------------------------------------------

WAY = 0.12  # in root = sqrt(1 - t), from the steepest ray t = 1 on
NODES = 0.5 - 0.5 * np.cos((np.arange(14) + 0.5) * np.pi / 14)  # of WAY
DEGREE = 8


def slopes_across_rays(
    contact: SolvedContact, v: Array, y: Array, crit: Array
) -> tuple[Array, Array]:
    """Slopes of mu~ along ln v~ and ln y~ in the ring of a ball, (2, n), and what they may be wrong
    by; infinitely wrong far from the steepest ray.

    mu~ is smooth in root = sqrt(1 - t) without a linear term, at fixed v~ as at fixed y~.  A
    polynomial in root has that slope however small root is, where differences have no step.
    """
    root = np.sqrt(np.maximum(1.0 - v / (STEEPEST * y), 0.0))
    # not beyond the border, where it is smooth no longer
    way = np.minimum(WAY, 0.35 * np.sqrt(np.maximum(1.0 - crit / (STEEPEST * y), 0.0)))
    here = np.flatnonzero((root > 0.0) & (root < way) & (v > crit))
    slopes, noise = np.zeros((2, v.size)), np.full((2, v.size), np.inf)
    v, y, root, way = v[here], y[here], root[here], way[here]
    ray = STEEPEST * (1.0 - (way[:, None] * NODES) ** 2)
    lines = (ray * y[:, None], y[:, None]), (v[:, None], v[:, None] / ray)
    for row, (line_v, line_y) in enumerate(lines if here.size else ()):
        at_v, at_y = np.broadcast_arrays(line_v, line_y)
        solved = contact.solve(at_v, at_y)
        each = (
            contact.noise("mu_ratio", at_v, at_y, solved, False).max(axis=1) + 4e-16
        )  # of the sum
        level = solved["mu_ratio"][:, :1]  # which the weights cancel to their own digits only
        found = []
        for degree in (DEGREE, DEGREE - 1):
            powers = np.array([0, *range(2, degree + 1)])
            fit = np.linalg.pinv(NODES[:, None] ** powers)
            # d/d ln t = -t/(2 root) d/d root, over the way
            rise = powers * (root / way)[:, None] ** np.maximum(powers - 2, 0)
            share = (-0.5 * (1.0 - root * root) / way**2)[:, None] * (rise @ fit)
            found.append((share * (solved["mu_ratio"] - level)).sum(axis=1))
        slopes[row, here] = found[0] if row == 0 else -found[0]
        amplified = 2.0 * np.abs(share).sum(axis=1) * each
        noise[row, here] = amplified + np.abs(found[0] - found[1])
    return slopes, noise


# --- both sides of every seam of a table ----------------------------------------------------------

ON_LINE = 1e-9  # of v~: differences beside the border or the steepest ray have no step


def beside_every_seam(
    table: Surrogate, kind: Kind, n: int, seed: int = 0
) -> Iterator[tuple[str, Array, Array]]:
    """Name of the block, v~ and y~, about ``n`` for each block of a contact; then for the border.

    Of a ball v~ and y~ are those of its middle spring, to the last digit as evaluation has them.
    """
    entry = table.table.contacts[CONTACTS[kind.contact]]
    for index, (chart, block) in enumerate(zip(entry.charts, entry.blocks, strict=True)):
        rng = np.random.default_rng([seed, kind.contact, index])
        yield chart.name, *_asked(kind, *beside_seams(rng, chart, block, table.border, n))
    rng = np.random.default_rng([seed, kind.contact, len(entry.blocks)])
    drawn = beside_border_seams(rng, table.table.border, table.border, n)
    yield "border", *_asked(kind, *drawn)


def _asked(kind: Kind, v: Array, y: Array) -> tuple[Array, Array]:
    return (MIDDLE * v / MIDDLE, MIDDLE * y / MIDDLE) if kind == BALL else (v, y)


def with_slopes(
    table: Surrogate, quantity: TabulatedQuantity, v: Array, y: Array
) -> NDArray[np.bool_]:
    """Where slopes are compared: of what is not smooth at the border, away from it."""
    if quantity.smooth_at_border:
        return np.full(v.shape, True)
    return np.asarray(np.abs(v / table.v_tilde_crit(y) - 1.0) > BESIDE_BORDER)


def by_its_values(table: Surrogate, contact: SolvedContact) -> SolvedContact:
    """The contact as the values of a table have it, which may be wrong by their bounds."""

    def solve(
        v: Array, y: Array, eta: Array | None = None, *, continuous: bool = False
    ) -> dict[str, Array]:
        del eta, continuous
        v, y = np.broadcast_arrays(v, y)
        solved = {}
        for name in QUANTITY_NAMES:
            value, bound, _ = contact.quantity(table, name, v.ravel(), y.ravel())
            solved[name], solved[f"bound of {name}"] = (
                value.reshape(v.shape),
                bound.reshape(v.shape),
            )
        return solved

    def noise(
        name: str, v: Array, y: Array, solved: dict[str, Array], sliding: NDArray[np.bool_] | bool
    ) -> Array:
        del v, y, sliding
        return solved[f"bound of {name}"]

    return contact._replace(solve=solve, noise=noise)


def off_the_lines(table: Surrogate, v: Array, y: Array) -> NDArray[np.bool_]:
    """Where differences have a step: beside border and steepest ray, not on them."""
    lines = np.array([STEEPEST * y, table.v_tilde_crit(y)])
    return np.asarray((np.abs(v / lines - 1.0) > ON_LINE).all(axis=0))


def true_slopes(
    table: Surrogate, contact: SolvedContact, names: Sequence[str], v: Array, y: Array
) -> Iterator[tuple[str, Array, Array]]:
    """Name, slopes (2, n) and what they may be wrong by of some quantities, from solves around the
    points; beside the steepest ray of a ball by a polynomial in its root."""
    around = Neighbours(table, contact, v, y)
    for name in names:
        slopes, noise = around.slopes(name)
        if contact.kind == BALL:
            across, unsure = slopes_across_rays(contact, v, y, around.crit)
            better = unsure < noise
            slopes, noise = np.where(better, across, slopes), np.where(better, unsure, noise)
        yield name, slopes, noise


# --- the doubles beside a seam --------------------------------------------------------------------

BESIDE = 10  # doubles on either side of a seam
APART = 2.0**-36  # relative, from them to the points that they are compared with
Places = tuple[NDArray[np.intp], ...]


def _cells(table: Surrogate, kind: Kind, v: Array, y: Array) -> Places:
    """What tells points of two cells apart: block, cells along a and b, the border's cell."""
    entry, middle = table.table.contacts[CONTACTS[kind.contact]], scale_of(kind)
    v, y = v / middle, y / middle
    block, a, b = kernels[-1].places(table.tabulated.data("mu_ratio", kind), v, y, kind.contact)
    rows = block_rows(entry).view(BLOCK_ROW)[block, 0]
    piece = np.searchsorted([Y_CONT, Y_TAIL], y)
    pieces = table.border.arrays[1].view(PIECE_ROW)[piece, 0]
    x = np.choose(piece, [y * y, np.log(y), 1.0 / y])
    counts = (
        rows["step_a"] * a + rows["offset_a"],
        rows["step_b"] * b + rows["offset_b"],
        pieces["step"] * x + pieces["offset"],
    )
    return block.astype(np.intp), *(np.floor(count).astype(np.intp) for count in counts)


def doubles_at_every_seam(
    table: Surrogate, kind: Kind, lines: int, seed: int = 0, samples: int = 1500
) -> Iterator[tuple[Array, Array, Array, Array]]:
    """v~, y~ and a step along each, of the doubles beside all seams that random lines cross.

    A line runs along v~, or along y~.  Where two of its ``samples`` are in different cells, what is
    between them is halved until they are neighbouring doubles.  That finds the edges of cells and
    blocks, the knots of folded coordinates, the border and its cells, without a list of them.
    """
    rng, ends = np.random.default_rng([seed, kind.contact]), (V_RANGE, Y_RANGE)
    for along in (0, 1):
        lowest, highest = np.log(ends[1 - along])
        still = np.exp(rng.uniform(lowest, highest, lines))
        common = rng.random(lines) < 0.7  # where most blocks are
        still[common] = 10.0 ** rng.uniform(-3.0, 1.5, np.count_nonzero(common))
        grids = np.geomspace(*ends[along], samples), np.geomspace(1e-3, 30.0, samples)
        grid = np.sort(np.concatenate(grids)).view(np.int64)
        low, high = (np.tile(x, lines) for x in (grid[:-1], grid[1:]))
        still = np.repeat(still, grid.size - 1)

        def differ(
            one: NDArray[np.int64], other: NDArray[np.int64], still: Array, along: int = along
        ) -> NDArray[np.bool_]:
            first, second = (
                _cells(table, kind, *(x.view(np.float64), still)[:: 1 - 2 * along])
                for x in (one, other)
            )
            unequal = [a != b for a, b in zip(first, second, strict=True)]
            return np.asarray(np.any(unequal, axis=0))

        crossed = differ(low, high, still)
        low, high, still = low[crossed], high[crossed], still[crossed]
        while np.any(high - low > 1):
            between = low + (high - low) // 2
            first = differ(low, between, still)
            high, low = np.where(first, between, high), np.where(first, low, between)
        beside = (high[:, None] + np.arange(-BESIDE, BESIDE + 1)).view(np.float64).ravel()
        still = np.repeat(still, 2 * BESIDE + 1)
        step, none = APART * beside, np.zeros(beside.size)
        yield (beside, still, step, none) if along == 0 else (still, beside, none, step)


def beyond_both_sides(
    table: Surrogate, kind: Kind, points: Sequence[Array], names: Sequence[str] = QUANTITY_NAMES
) -> Iterator[tuple[str, Array]]:
    """How far answers at ``points`` (v~, y~ and a step along each) are outside of those one step to
    either side, over what their bounds allow, by quantity; and the same of its slopes.

    At a seam an answer is between these two, or misses them by no more than the bounds.  So what is
    wrong for a few doubles only is found, whatever the table's tolerance, without another solver.
    """

    def beyond(values: Sequence[Array], bounds: Sequence[Array]) -> Array:
        left, here, right = values
        off = np.maximum(here - np.maximum(left, right), np.minimum(left, right) - here)
        with np.errstate(all="ignore"):
            share = np.where(off > 0.0, off / (bounds[1] + np.maximum(bounds[0], bounds[2])), 0.0)
        return np.asarray(np.where(np.isnan(off), np.inf, share))

    v, y, step_v, step_y = points
    places = [(v + side * step_v, y + side * step_y) for side in (-1, 0, 1)]
    for name in names:
        answers = [table.quantity(name, *place, **kind.names) for place in places]
        yield name, beyond([x[0] for x in answers], [x[1] for x in answers])
        if kind == BALL and name != "mu_ratio":
            continue  # a table has no slopes of these
        keep = with_slopes(table, QUANTITIES[QUANTITY_NAMES.index(name)], v, y)
        slopes = [table.tabulated.slopes(name, v[keep], y[keep], kind) for v, y in places]
        for row in (1, 2):
            share = beyond([x[row] for x in slopes], [x[row + 2] for x in slopes])
            yield f"slopes of {name}", share

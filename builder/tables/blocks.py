"""Choose nodes of a block, and refine them until the interpolant meets the tolerance."""

import math
from collections.abc import Callable

import numpy as np

from mumacro.kernel.arrays import Array
from mumacro.kernel.binding import kernels
from mumacro.table.atlas import BORDER_PIECES, CONTINUOUS, QUANTITIES, Axis, Chart
from mumacro.table.blocks import Block, BorderPiece
from mumacro.table.polynomials import (
    LOCAL,
    WIDTH,
    Border,
    cell_scale,
    chebyshev_coefficients,
    interpolation_matrix,
    nodes,
)

from ..solver.sweep import Sweep
from .contacts import SolvedContact
from .quantities import SOLVED

MAX_NODES = 96
MAX_CELLS = 160
SHARE = 0.1  # part of the tolerance that the nodes' truncation in one direction may take
CELL_SHARE = 0.4  # the same for cells: fewer cells are faster, nodes cost nothing
NODE_FLOOR = 2e-14  # solver noise of the tabulated quantities, below which more nodes gain nothing


def solve_nodes(
    contact: SolvedContact, index: int, shape: tuple[int, int], border: Border
) -> tuple[Array, Array, dict[str, Array], dict[str, Array]]:
    """Return node coordinates of a block (m,), (n,), and from fresh solves the tabulated values at
    the nodes (m, n) by quantity.

    The last result is the solver's rounding error where a base is subtracted. 1 - mu~ and q without
    a base keep their digits, but the power of the tail loses those of p ~ y~, and all of them as
    1/y~ goes to 0.
    """
    chart, numbers, roundings = contact.charts[index], {}, {}
    a, b = nodes(shape[0], chart.a.low, chart.a.high), nodes(shape[1], chart.b.low, chart.b.high)
    v, y, eta = chart.point(a[:, None], b[None, :], border)
    solution = contact.solve(v, y, eta, continuous=chart.regime == CONTINUOUS)
    for code, quantity in enumerate(QUANTITIES):
        if chart.holds(quantity):
            base, factor = kernels[-1].forms(code, index, v, y, eta, contact.kind.contact)
            rest, complement = solution[quantity.name] - base, SOLVED[quantity.name].complement
            if complement:  # next to 1 the complement has the digits
                rest = np.where(base == 1.0, -solution[complement], rest)
            exact = (base == 0.0) | (base == 1.0)
            if chart.a.name in _LOGARITHMIC and quantity.name == "mu_ratio":
                rest, exact = _small_rest(chart, v, y, solution), np.full(v.shape, True)
            numbers[quantity.name] = rest / factor
            noise = contact.noise(quantity.name, v, y, solution, chart.regime == CONTINUOUS)
            roundings[quantity.name] = np.where(exact, 0.0, noise / np.abs(factor))
    return a, b, numbers, roundings


#: coordinates of blocks whose base is 1 and a logarithm
_LOGARITHMIC = ("y_root", "v_root", "ray_root")


def _small_rest(chart: Chart, v: Array, y: Array, solution: dict[str, Array]) -> Array:
    """Return mu~ less a base of 1 and a logarithm, computed from 1 - mu~, which keeps its digits
    where y~ is small."""
    level = 0.375 * np.log(y) if chart.a.name == "y_root" else 0.1875 * np.log(v)
    return np.asarray(-solution["deficit"] - y * y * level)


def _next(n: int) -> int:
    return n + max(2, n // 6)


def _tail(coefficients: Array, axis: int) -> float:
    """Return the remaining error of the interpolant along one axis: its last two Chebyshev
    coefficients, summed over the other axis."""
    c = np.abs(np.moveaxis(coefficients, axis, 0)).reshape(coefficients.shape[axis], -1)
    return float(c[-2:].sum(axis=1).max())


_CHECK = np.linspace(-1.0, 1.0, 25)
_FOLLOW = interpolation_matrix(WIDTH, _CHECK) @ np.linalg.inv(interpolation_matrix(WIDTH, LOCAL))
LINES = 33  # lines across an axis along which cells are tried


def _fewest(axis: Axis, exact: Callable[[Array], Array], bound: float, relative: bool) -> int:
    """Return the fewest cells along an axis for which polynomials of a cell's degree follow
    ``exact``.

    ``exact`` (points) -> (points, lines) takes the evaluation's coordinate; errors are compared
    with ``bound``.
    """
    low, high = axis.span
    step = 2 if axis.knotted else 1  # the knot of sigma is an edge of cells
    for cells in range(step, MAX_CELLS + 1, step):
        centre = 2.0 * np.arange(cells)[:, None] + 1.0
        places, check = (low + (high - low) * 0.5 * (centre + x) / cells for x in (LOCAL, _CHECK))
        live = axis.to_file(check[:, -1]) > axis.low  # cells below the block are never evaluated
        places, check = places[live], check[live]
        local = exact(places.ravel()).reshape(*places.shape, -1)
        truth = exact(check.ravel()).reshape(*check.shape, -1)
        off = np.abs(truth - np.einsum("ij,cjl->cil", _FOLLOW, local))
        if relative:
            off /= np.abs(truth)
        inside = axis.to_file(check.ravel()).reshape(check.shape) >= axis.low - 1e-12
        if off[inside].max() <= bound:
            return cells
    return MAX_CELLS


def _position(axis: Axis, x: Array) -> Array:
    """Return the position of the evaluation's ``x`` on the axis of nodes, [-1, 1]."""
    return (2.0 * axis.to_file(x) - axis.low - axis.high) / (axis.high - axis.low)


def _block_cells(chart: Chart, values: Array, axis: int, bound: float) -> int:
    """Return :func:`_fewest` along one axis of a block, on lines that cover the other."""
    along, lines = (chart.a, chart.b)[axis], np.cos(np.linspace(0.0, np.pi, LINES))
    c = np.moveaxis(chebyshev_coefficients(values), axis, 0)
    across = c @ interpolation_matrix(values.shape[1 - axis], lines).T
    return _fewest(
        along, lambda x: interpolation_matrix(len(c), _position(along, x)) @ across, bound, False
    )


def _border_cells(piece: int, values: Array, bound: float) -> int:
    axis, c = BORDER_PIECES[piece][1], chebyshev_coefficients(values)

    def exact(x: Array) -> Array:
        return (interpolation_matrix(c.size, _position(axis, x)) @ c * cell_scale(piece, x))[
            :, None
        ]

    return _fewest(axis, exact, bound, True)


def build_border(sweep: Sweep, tolerance: float) -> list[BorderPiece]:
    """Return the stored border.  Its own tolerance is tighter than the table's, because every
    stick-slip node is built on it."""
    bound = max(1e-3 * tolerance, 4e-15)
    pieces = []
    for piece, (_, axis, _) in enumerate(BORDER_PIECES):
        to_infinity = axis.name == "inverse_y"
        n = 4 if to_infinity else 12
        while True:
            x = nodes(n, axis.low, axis.high)
            y = axis.amplitude(x)
            values = (
                sweep.solve("border", np.ones_like(y), y)["deficit"]
                / kernels[-1].border_scales(piece, y)[0]
            )
            if _tail(chebyshev_coefficients(values), 0) <= bound or n >= MAX_NODES or to_infinity:
                break
            n = _next(n)
        pieces.append(BorderPiece(x, values, _border_cells(piece, values, bound)))
    return pieces


def build_block(
    contact: SolvedContact,
    index: int,
    border: Border,
    tolerance: float,
    progress: Callable[[str], None] = lambda _: None,
) -> Block:
    """Solve nodes until the Chebyshev tail in both directions is below SHARE * tolerance, then cut
    the cells."""
    chart = contact.charts[index]
    bound = max(SHARE * tolerance, NODE_FLOOR)
    tail_block = chart.a.name == "inverse_y"
    na, nb = 3 if tail_block else 8, 8
    best, stalls = [math.inf, math.inf], [0, 0]
    while True:
        progress(f"{chart.name} {na} x {nb}")
        a, b, numbers, _ = solve_nodes(contact, index, (na, nb), border)
        values = numbers["mu_ratio"]
        tails = [_tail(chebyshev_coefficients(values), axis) for axis in (0, 1)]
        for axis in (0, 1):
            # twice no improvement by a third: the rest is the solver's rounding, which more nodes
            # only increase
            stalls[axis] = 0 if tails[axis] < 0.67 * best[axis] else stalls[axis] + 1
            best[axis] = min(best[axis], tails[axis])
        grow = [
            tails[axis] > bound and (na, nb)[axis] < MAX_NODES and stalls[axis] < 3
            for axis in (0, 1)
        ]
        if tail_block:
            grow[0] = False
        if not any(grow):
            break
        na, nb = (_next(n) if grows else n for n, grows in zip((na, nb), grow, strict=True))
    follow = [max(CELL_SHARE * tolerance, NODE_FLOOR, min(best[axis], 1.0)) for axis in (0, 1)]
    if tail_block:
        follow[0] = bound
    cells = (_block_cells(chart, values, 0, follow[0]), _block_cells(chart, values, 1, follow[1]))
    return Block(a, b, cells, numbers)

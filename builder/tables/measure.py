"""Measure the errors of each block on fresh solves: the errors that a table states.

Values are compared with solves at points that crowd towards edges and seams.

The errors of q and its derivatives are measured cell by cell.  The reference is a second
interpolant of the model, through more nodes that are neither nodes of the table nor rounded.  Its
own error is far below that of the table, or as small as the solver's rounding, which both have.
The difference is a smooth function in every cell.  It is computed at the Chebyshev points of a
cell, edges included, where the error of a derivative is largest.
"""

import dataclasses
import math
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from mumacro import Surrogate
from mumacro.kernel.arrays import Array
from mumacro.kernel.binding import kernels
from mumacro.table.atlas import (
    CONTINUOUS,
    QUANTITIES,
    QUANTITY_NAMES,
    Axis,
    Chart,
)
from mumacro.table.blocks import Block
from mumacro.table.polynomials import (
    WIDTH,
    Border,
    cells_2d,
    chebyshev_coefficients,
    coefficient_matrix,
    interpolation_matrix,
)

from ..solver.sweep import Sweep
from .blocks import solve_nodes
from .contacts import SolvedContact
from .quantities import SOLVED


class BlockErrors(NamedTuple):
    """Hold the largest errors of a block.

    By quantity: ``values`` are errors of the tabulated function over the block; ``cells`` are as in
    :class:`mumacro.table.blocks.Block`.  ``absolute`` and ``relative`` are errors of mu~.
    """

    values: dict[str, float]
    absolute: float
    relative: float
    cells: dict[str, Array]


def border_errors(border: Border, sweep: Sweep, rng: np.random.Generator, n: int) -> Array:
    """Return the relative errors of v~crit on ``n`` fresh solves, (n,)."""
    y = 10.0 ** rng.uniform(-4.0, 6.0, n)
    exact = sweep.solve("border", np.ones_like(y), y)["deficit"]
    return np.asarray(np.abs(border(y) / exact - 1.0))


def _stating(
    surrogate: Surrogate, contact: SolvedContact, error: float, of_border: float
) -> Surrogate:
    """Return the same table with one error for all that it tabulates, and a fraction of the
    border's.

    With the error 1 a bound is the scale of its errors; with 0 it is the allowance in addition to
    the table's error.
    """
    table, entry, replace = surrogate.table, contact.of(surrogate), dataclasses.replace
    border = [
        replace(piece, max_rel_error=of_border * piece.max_rel_error) for piece in table.border
    ]
    one = np.array([error, 0.0, 0.0])
    blocks = [
        replace(
            block,
            errors=dict.fromkeys(table.quantities, one),
            cell_errors=dict.fromkeys(block.nodes, np.tile(one, (math.prod(block.cells), 1))),
        )
        for block in entry.blocks
    ]
    contacts = table.contacts | {entry.name: replace(entry, blocks=blocks)}
    measured = Surrogate(replace(table, border=border, contacts=contacts), surrogate.path)
    return measured.on_threads(surrogate.threads)


def block_errors(
    surrogate: Surrogate, contact: SolvedContact, n: int, seed: int
) -> list[BlockErrors]:
    """Return the largest errors of every block; those of values on ``n`` fresh solves, without the
    errors of a neighbour."""
    stating = tuple(
        _stating(surrogate, contact, error, of_border)
        for error, of_border in ((1.0, 0.0), (0.0, 0.5), (0.0, 0.0))
    )
    errors_of_blocks = []
    for index, block in enumerate(contact.of(surrogate).blocks):
        errors = _value_errors(
            surrogate, stating, contact, index, np.random.default_rng([seed, index]), n
        )
        _, _, *exact = solve_nodes(
            contact, index, finer((block.a.size, block.b.size)), surrogate.border
        )
        errors_of_blocks.append(BlockErrors(*errors, cell_errors(contact, index, block, *exact)))
    return errors_of_blocks


def _value_errors(
    surrogate: Surrogate,
    stating: tuple[Surrogate, ...],
    contact: SolvedContact,
    index: int,
    rng: np.random.Generator,
    n: int,
) -> tuple[dict[str, float], float, float]:
    """Return the errors of the tabulated function by quantity, and the absolute and relative errors
    of mu~."""
    chart = contact.charts[index]
    v, y, _ = chart.point(_crowded(rng, chart.a, n), _crowded(rng, chart.b, n), surrogate.border)
    v_seam, y_seam = contact.draws.near_seams(rng, 2 * n, surrogate)
    v, y = contact.as_asked(np.concatenate([v, v_seam]), np.concatenate([y, y_seam]))
    here = contact.places(surrogate, v, y) == index
    v, y = v[here], y[here]
    mu = contact.quantity(surrogate, "mu_ratio", v, y)[0]
    solution = contact.solve(v, y)
    error = np.abs(mu - solution["mu_ratio"])
    errors = {}
    for name in contact.of(surrogate).blocks[index].nodes:
        value, *_ = contact.quantity(surrogate, name, v, y)
        truth, complement = solution[name], SOLVED[name].complement
        if contact.quadrature and complement:
            truth = np.where(truth > 0.5, 1.0 - solution[complement], truth)
        scale, beside, rounding = (contact.quantity(table, name, v, y)[1] for table in stating)
        # what the bound contains anyway: half of rounding, and the effect of the border's error,
        # which it counts twice
        noise = (
            contact.noise_in_bounds(name, v, y, solution, chart.regime == CONTINUOUS)
            + beside
            - 0.5 * rounding
        )
        errors[name] = float((np.maximum(np.abs(value - truth) - noise, 0.0) / scale).max())
    return errors, float(error.max()), float((error / solution["mu_ratio"]).max())


def _crowded(rng: np.random.Generator, axis: Axis, n: int) -> Array:
    """Return file coordinates that crowd towards both ends."""
    low, high = axis.low, axis.high
    if axis.name == "radius":
        half = n // 2
        return np.concatenate(
            [10.0 ** rng.uniform(-5.0, math.log10(high), half), high * rng.beta(0.5, 0.5, n - half)]
        )
    t = rng.beta(0.5, 0.5, n)
    edge = 10.0 ** rng.uniform(-6.0, -1.0, n // 4)
    t[: edge.size] = np.where(rng.random(edge.size) < 0.5, edge, 1.0 - edge)
    return low + (high - low) * np.clip(t, 1e-7, 1.0 - 1e-7)


# --- cell by cell ---------------------------------------------------------------------------------

# along either side of a cell: an error of T_8 to T_16 is a polynomial of that degree
POINTS = 17
_AT = -np.cos(np.arange(POINTS) * math.pi / (POINTS - 1))
_TO_COEFFICIENTS = np.linalg.inv(chebyshev.chebvander(_AT, POINTS - 1))
_TO_DERIVATIVE = chebyshev.chebvander(_AT, POINTS - 2) @ chebyshev.chebder(_TO_COEFFICIENTS)


def finer(shape: tuple[int, int]) -> tuple[int, int]:
    """Return the numbers of nodes along both coordinates of the interpolant that represents the
    model."""
    a, b = (n + max(6, n // 2) for n in shape)
    return a, b


class _CellPoints:
    """Hold the points of all cells along one axis, (cells, POINTS); none is below the low end of
    the block.

    ``widths`` are the widths that the points of the cells cover; zero where the block never
    evaluates the cell.
    """

    def __init__(self, axis: Axis, cells: int, nodes: int) -> None:
        start, stop = axis.span
        edges = start + (stop - start) * np.arange(cells + 1) / cells
        low = np.clip(edges[:-1], axis.to_evaluation(np.array([axis.low])), edges[1:])
        self.widths = edges[1:] - low
        self.x = low[:, None] + 0.5 * (1.0 + _AT) * self.widths[:, None]
        local = 2.0 * (self.x - edges[:-1, None]) * cells / (stop - start) - 1.0
        self.powers = local[..., None] ** np.arange(WIDTH - 1, -1, -1)
        self.shares, at_border = (
            x.reshape(local.shape) for x in kernels[-1].cell_shares(local.ravel())
        )
        self.share_at_border = at_border[-1]
        points = np.clip(axis.to_file(self.x.ravel()), axis.low, axis.high)
        self.from_exact = interpolation_matrix(
            nodes, (2.0 * points - axis.low - axis.high) / (axis.high - axis.low)
        )
        scale = np.divide(2.0, self.widths, out=np.zeros(cells), where=self.widths > 0.0)
        self.to_derivative = scale[:, None, None] * _TO_DERIVATIVE


def _difference(
    chart: Chart, block: Block, values: Array, exact: Array
) -> tuple[Array, _CellPoints, _CellPoints]:
    """Return cells through node ``values`` minus the interpolant with coefficients ``exact``,
    (cells a, POINTS, cells b, POINTS)."""
    a, b = (
        _CellPoints(axis, n, m)
        for axis, n, m in zip((chart.a, chart.b), block.cells, exact.shape, strict=True)
    )
    cells = cells_2d(chart.a, chart.b, values, block.cells).reshape(*block.cells, WIDTH, WIDTH)
    interpolant = np.einsum("ipx,ijzx,jqz->ipjq", a.powers, cells, b.powers, optimize=True)
    return interpolant - (a.from_exact @ exact @ b.from_exact.T).reshape(interpolant.shape), a, b


#: coefficients below this number of standard deviations of their rounding are left out; the
#: solver's rounding was seen to reach 2.6 of them
DEVIATIONS = 4.0


def _without_noise(exact: Array, noise: Array) -> Array:
    """Return Chebyshev coefficients of the interpolant through ``exact``, without those that are
    only the solver's rounding.

    At an edge a second derivative multiplies them by the fourth power of their number, which would
    hide the error of the table.  They are the coefficients at the level of the last ones, and the
    ones that the ``noise`` of the nodes explains.

    The last ones do not show the second group, because a node next to an edge hardly contributes to
    them.
    """
    c = chebyshev_coefficients(exact)
    last = max(np.abs(c[-2:]).max(), np.abs(c[:, -2:]).max())
    along_a, along_b = (coefficient_matrix(n) ** 2 for n in noise.shape)
    deviation = np.sqrt(along_a @ noise**2 @ along_b.T)
    c[np.abs(c) <= np.maximum(last, DEVIATIONS * deviation)] = 0.0
    return c


def _without_edge(off: Array, b: _CellPoints, axis: Axis, cells: int) -> None:
    """Correct the errors along b of the last cells below the border in the way of the evaluation,
    see ``src/mumacro/kernel/points.c``.

    The evaluation removes the derivative at the border from them.  The rest is linear in the
    distance to the border, by which the chain rule divides; the bound counts it at most half the
    number of cells per unit of b times.
    """
    end, scale = axis.edge
    root = (end - b.x[-1, :-1]) / scale
    weight = np.maximum(1.0, scale * (1.0 - root * root) / root / (cells / end))
    b.shares[-1] = b.share_at_border
    off[:, :, -1, :-1] = (off[:, :, -1, :-1] - off[:, :, -1, -1:]) * weight
    off[:, :, -1, -1] = off[:, :, -1, -2]


def cell_errors(
    contact: SolvedContact,
    index: int,
    block: Block,
    exact: dict[str, Array],
    noise: dict[str, Array],
) -> dict[str, Array]:
    """Return the largest errors over every cell, (cells, 3) by quantity: of q, and of its
    derivatives along a and along b.  They are 0 for derivatives that a table does not give.

    ``exact`` holds the node values of a second interpolant by quantity, see :func:`finer`;
    ``noise`` their rounding.
    """
    errors: dict[str, Array] = {}
    for name in QUANTITY_NAMES:
        if name in block.nodes:
            for coefficients in _truths(contact, exact[name], noise[name]):
                largest = _largest(contact, index, block, name, coefficients)
                errors[name] = np.maximum(errors.get(name, 0.0), largest)
            if name not in contact.slope_names:
                errors[name][:, 1:] = 0.0
    return errors


def _truths(contact: SolvedContact, exact: Array, noise: Array) -> list[Array]:
    """Return Chebyshev coefficients of the model without what may be rounding; for a quadrature
    also with all of them, because its error is not a rounding error of the nodes."""
    clean = _without_noise(exact, noise)
    return [clean, chebyshev_coefficients(exact)] if contact.quadrature else [clean]


def _largest(contact: SolvedContact, index: int, block: Block, name: str, exact: Array) -> Array:
    """Return a quantity's largest errors over every cell, (cells, 3)."""
    chart, quantity = contact.charts[index], QUANTITIES[QUANTITY_NAMES.index(name)]
    off, a, b = _difference(chart, block, block.nodes[name], exact)
    along_a = np.einsum("irp,ipjq->irjq", a.to_derivative, off)
    along_b = np.einsum("jrq,ipjq->ipjr", b.to_derivative, off)
    if quantity.smooth_at_border and chart.regime != CONTINUOUS and chart.b.knotted:
        _without_edge(along_b, b, chart.b, block.cells[1])
    if chart.a.name == "ray_root":
        _without_edge(along_a.transpose(2, 3, 0, 1), a, chart.a, block.cells[0])
    along_a /= a.shares[:, :, None, None]
    along_b /= b.shares
    largest = np.stack([np.abs(x).max(axis=(1, 3)) for x in (off, along_a, along_b)], axis=-1)
    return largest.reshape(-1, 3)

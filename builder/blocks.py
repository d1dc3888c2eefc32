"""Where the nodes lie, and how a block refines until its interpolant holds the tolerance.

The inverse of the coordinate maps that :mod:`friction.kernels` evaluates; see :mod:`friction.regions` for the list.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from builder.sweep import Sweep
from friction import tails
from friction.border import Border
from friction.companions import fast_power, power_scale, stick_scale
from friction.kernels import WIDTH
from friction.patches import (
    chebyshev_coefficients,
    evaluation_span,
    file_coordinate,
    interpolation_matrix,
    nodes,
)  # fmt: skip
from friction.regions import BLOCK_INDEX, BORDER_PIECES, CONTINUOUS, BlockSpec
from friction.table import Block, BorderPiece

__all__ = ["Points", "build_block", "build_border", "points_of", "quantity_of", "slope_of"]

Array = NDArray[np.float64]
MAX_NODES = 96
MAX_CELLS = 160
SHARE = 0.1  # of the tolerance that the nodes' truncation in one direction may take
CELL_SHARE = (
    0.4  # of the tolerance that the cells may take in one direction: fewer cells are faster, nodes cost nothing
)
NODE_FLOOR = 2e-14  # of the tabulated quantities: solver noise below which more nodes gain nothing


@dataclass(frozen=True)
class Points:
    """Points of the quadrant: v~, y~ and eta = y~ - 1 kept apart; arrays of one shape."""

    v: Array
    y: Array
    eta: Array


def points_of(spec: BlockSpec, a: Array, b: Array, border: Border) -> Points:
    """The points with block coordinates ``a``, ``b`` (broadcast together)."""
    a, b = np.broadcast_arrays(a, b)
    eta: Array | None = None
    if spec.a_name == "radius":
        phi = a * np.sin(0.5 * math.pi * b) / math.sqrt(2.0)
        s0 = math.sqrt(2.0) * a * np.cos(0.5 * math.pi * b)
        eta = 0.25 * s0 * s0 - 0.5 * phi * phi
        return Points(phi * s0 * s0 / (2.0 * math.pi), 1.0 + eta, eta)
    if spec.a_name == "y_squared":
        y = np.sqrt(a)
    elif spec.a_name == "ln_y":
        y = np.exp(a)
    elif spec.a_name == "inverse_y":
        y = 1.0 / a
    else:
        y = a.copy()
    if spec.b_name == "v_squared_share":
        v = np.sqrt(b / (1.0 - b))
    elif spec.b_name == "ln_rho":
        v = np.exp(b) * border(y)
    elif spec.b_name == "ln_kappa":
        v = np.exp(b) * np.sqrt(y)
    else:
        v = border(y) * np.sin(0.5 * math.pi * b) ** 2
    return Points(v, y, y - 1.0)


def quantity_of(spec: BlockSpec, p: Points, mu: Array, deficit: Array) -> Array:
    """What the block tabulates, from mu~ and 1 - mu~."""
    if spec.quantity == "deficit_low":
        return deficit * 4.0 * (1.0 + p.v * p.v) / (p.y * p.y)
    if spec.quantity == "hypotenuse":
        return mu * np.hypot(1.0, p.y / p.v)
    if spec.quantity == "deficit":
        return deficit / (p.y * p.y)
    if spec.quantity == "mu_ratio":
        return mu
    if spec.quantity == "normal_form":
        corner: Array = mu / tails.corner_root(p.v, p.eta)
        return corner
    r = p.y / p.v
    if spec.quantity == "slope":
        return mu * r
    layer: Array = (mu - tails.outer(r)) * r
    return layer if spec.quantity == "layer" else layer - 2.0 / math.pi * np.log(p.v / np.sqrt(p.y))


def slope_of(spec: BlockSpec, p: Points) -> Array:
    """|d mu~ / d quantity|: turns errors of one into errors of the other."""
    if spec.quantity == "deficit_low":
        return p.y * p.y / (4.0 * (1.0 + p.v * p.v))
    if spec.quantity == "hypotenuse":
        return 1.0 / np.hypot(1.0, p.y / p.v)
    if spec.quantity == "deficit":
        return p.y * p.y
    if spec.quantity == "mu_ratio":
        return np.ones_like(p.v)
    if spec.quantity == "normal_form":
        out: Array = tails.corner_root(p.v, p.eta)
        return out
    return p.v / p.y


def _next(n: int) -> int:
    return n + max(2, n // 6)


def _tail(coefficients: Array, axis: int) -> float:
    """What the interpolant still misses along one axis: its last two Chebyshev coefficients, summed over the other."""
    c = np.abs(np.moveaxis(coefficients, axis, 0)).reshape(coefficients.shape[axis], -1)
    return float(c[-2:].sum(axis=1).max())


_LOCAL = -np.cos((np.arange(WIDTH) + 0.5) * np.pi / WIDTH)
_CHECK = np.linspace(-1.0, 1.0, 25)
_FOLLOW = np.polynomial.chebyshev.chebvander(_CHECK, WIDTH - 1) @ np.linalg.inv(
    np.polynomial.chebyshev.chebvander(_LOCAL, WIDTH - 1)
)
LINES = 33  # across an axis, along which cells are tried


def _fewest(
    name: str, span: tuple[float, float], exact: Callable[[Array], Array], wanted: float, relative: bool
) -> int:
    """Fewest cells along an axis for which polynomials of the kernel's degree follow ``exact``.

    ``exact`` (points) -> (points, lines) takes evaluation's coordinate; errors are compared with ``wanted``.
    """
    low, high = evaluation_span(name, *span)
    step = 2 if name == "s" else 1  # the knot of sigma is an edge of cells
    for cells in range(step, MAX_CELLS + 1, step):
        centre = 2.0 * np.arange(cells)[:, None] + 1.0
        at, check = (low + (high - low) * 0.5 * (centre + x) / cells for x in (_LOCAL, _CHECK))
        if name == "s":
            # cells below the block are never visited
            live = file_coordinate(name, check[:, -1]) > span[0]
            at, check = at[live], check[live]
        local = exact(at.ravel()).reshape(*at.shape, -1)
        truth = exact(check.ravel()).reshape(*check.shape, -1)
        off = np.abs(truth - np.einsum("ij,cjl->cil", _FOLLOW, local))
        if relative:
            off /= np.abs(truth)
        inside = file_coordinate(name, check.ravel()).reshape(check.shape) >= span[0] - 1e-12
        if off[inside].max() <= wanted:
            return cells
    return MAX_CELLS


def _block_cells(spec: BlockSpec, values: Array, axis: int, wanted: float) -> int:
    """:func:`_fewest` along one axis of a block, on lines that cover the other."""
    c = chebyshev_coefficients(values)
    spans, names = (spec.a, spec.b), (spec.a_name, spec.b_name)
    lines = np.cos(np.linspace(0.0, np.pi, LINES))
    across = np.moveaxis(c, axis, 0) @ interpolation_matrix(values.shape[1 - axis], lines).T

    def exact(x: Array) -> Array:
        low, high = spans[axis]
        out: Array = (
            interpolation_matrix(
                values.shape[axis], (2.0 * file_coordinate(names[axis], x) - low - high) / (high - low)
            )
            @ across
        )
        return out

    return _fewest(names[axis], spans[axis], exact, wanted, False)


def _border_cells(name: str, span: tuple[float, float], values: Array, wanted: float) -> int:
    c, (low, high) = chebyshev_coefficients(values)[:, None], span

    def exact(x: Array) -> Array:
        out: Array = interpolation_matrix(values.size, (2.0 * file_coordinate(name, x) - low - high) / (high - low)) @ c
        return out * np.exp(0.5 * x)[:, None] if name == "ln_y" else out

    return _fewest(name, span, exact, wanted, True)


def build_border(sweep: Sweep, tolerance: float) -> list[BorderPiece]:
    """The stored border; its own tolerance is tighter than the table's, since every stick-slip node is built on it."""
    wanted = max(1e-3 * tolerance, 4e-15)
    pieces = []
    for name, coordinate, (low, high), _ in BORDER_PIECES:
        n = 4 if name == "high" else 12
        while True:
            x = nodes(n, low, high)
            y = np.sqrt(x) if name == "low" else (np.exp(x) if name == "mid" else 1.0 / x)
            crit = sweep.solve("border", np.ones_like(y), y)["deficit"]
            values = 2.0 * crit / (y * y) if name == "low" else crit / np.sqrt(y)
            if _tail(chebyshev_coefficients(values), 0) <= wanted or n >= MAX_NODES or name == "high":
                break
            n = _next(n)
        pieces.append(BorderPiece(x, values, _border_cells(coordinate, (low, high), values, wanted)))
    return pieces


def build_block(
    spec: BlockSpec,
    border: Border,
    sweep: Sweep,
    tolerance: float,
    progress: Callable[[str], None] = lambda _: None,
) -> Block:
    """Solve nodes until the Chebyshev tail in both directions is below SHARE * tolerance, then cut the cells."""
    kind = "continuous" if spec.regime == CONTINUOUS else "full"
    wanted = max(SHARE * tolerance, NODE_FLOOR)
    na = 3 if spec.a_name == "inverse_y" else 8
    nb = 8
    best = [math.inf, math.inf]
    stuck = [0, 0]
    while True:
        progress(f"{spec.name} {na} x {nb}")
        a, b = nodes(na, *spec.a), nodes(nb, *spec.b)
        p = points_of(spec, a[:, None], b[None, :], border)
        solved = sweep.solve(kind, p.v, p.y, p.eta)
        values = quantity_of(spec, p, solved["mu_ratio"], solved["deficit"])
        c = chebyshev_coefficients(values)
        left = [_tail(c, 0), _tail(c, 1)]
        for axis in (0, 1):
            # twice no better by a third: what is left is the solver's rounding, which more nodes only gather
            stuck[axis] = 0 if left[axis] < 0.67 * best[axis] else stuck[axis] + 1
            best[axis] = min(best[axis], left[axis])
        grow_a = left[0] > wanted and na < MAX_NODES and stuck[0] < 3 and spec.a_name != "inverse_y"
        grow_b = left[1] > wanted and nb < MAX_NODES and stuck[1] < 3
        if not (grow_a or grow_b):
            break
        na, nb = (_next(na) if grow_a else na), (_next(nb) if grow_b else nb)
    scale = np.vectorize(power_scale, otypes=[np.float64])(BLOCK_INDEX[spec.name], p.v, p.y)
    lead = np.zeros_like(p.v)
    if spec.name == "continuous_tail":
        lead = np.vectorize(lambda v, y: fast_power(v, y)[0], otypes=[np.float64])(p.v, p.y)
    power = (solved["power"] - lead) / scale
    stick = np.empty(0)
    if spec.regime != CONTINUOUS:
        stick = solved["stick_fraction"] / np.vectorize(stick_scale, otypes=[np.float64])(BLOCK_INDEX[spec.name], p.y)
    follow = [max(CELL_SHARE * tolerance, NODE_FLOOR, min(best[axis], 1.0)) for axis in (0, 1)]
    if spec.a_name == "inverse_y":
        follow[0] = wanted
    cells = (_block_cells(spec, values, 0, follow[0]), _block_cells(spec, values, 1, follow[1]))
    return Block(a, b, values, cells, power=power, stick=stick)

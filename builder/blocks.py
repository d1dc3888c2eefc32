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
from friction.kernels import SQRT2, WIDTH
from friction.patches import chebyshev_coefficients, interpolation_matrix, nodes, s_of_sigma
from friction.regions import BLOCK_INDEX, BORDER_PIECES, CONTINUOUS, BlockSpec
from friction.table import Block, BorderPiece

__all__ = ["Points", "build_block", "build_border", "points_of", "quantity_of", "slope_of"]

Array = NDArray[np.float64]
MAX_NODES = 96
MAX_CELLS = 96
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


def _cells(values: Array, axis: int, tolerance: float, spec: BlockSpec | None = None) -> int:
    """Fewest cells along ``axis`` for which polynomials of the kernel's degree follow the interpolant."""
    c = np.moveaxis(chebyshev_coefficients(values), axis, 0)
    c = c.reshape(c.shape[0], -1)
    n = c.shape[0]
    along_s = spec is not None and (spec.a_name, spec.b_name)[axis] == "s"
    if n <= WIDTH and not along_s:
        return 1
    local = -np.cos((np.arange(WIDTH) + 0.5) * np.pi / WIDTH)
    check = np.linspace(-1.0, 1.0, 25)
    follow = np.polynomial.chebyshev.chebvander(check, WIDTH - 1) @ np.linalg.inv(
        np.polynomial.chebyshev.chebvander(local, WIDTH - 1)
    )
    for cells in range(2 if along_s else 1, MAX_CELLS + 1, 2 if along_s else 1):
        centre = (2.0 * np.arange(cells)[:, None] + 1.0) / cells - 1.0
        at, exact = centre + local / cells, centre + check / cells
        if along_s and spec is not None:
            low, high = spec.b
            at, exact = (s_of_sigma(0.5 * SQRT2 * (x + 1.0)) for x in (at, exact))
            live = exact[:, -1] > low
            at, exact = ((2.0 * x[live] - low - high) / (high - low) for x in (at, exact))
            inside = exact >= -1.0
        else:
            inside = np.ones(exact.shape, dtype=bool)
        rows = interpolation_matrix(n, at.ravel()).reshape(*at.shape, n)
        truth = interpolation_matrix(n, np.maximum(exact, -1.0).ravel()).reshape(*exact.shape, n)
        # the other axis enters through its Chebyshev coefficients, each of which multiplies a function <= 1
        off = np.abs((truth - follow @ rows) @ c).sum(axis=-1)
        if off[inside].max() <= tolerance:
            return cells
    return MAX_CELLS


def build_border(sweep: Sweep, tolerance: float) -> list[BorderPiece]:
    """The stored border; its own tolerance is tighter than the table's, since every stick-slip node is built on it."""
    wanted = max(1e-3 * tolerance, 4e-15)
    pieces = []
    for name, _, (low, high), _ in BORDER_PIECES:
        n = 4 if name == "high" else 12
        while True:
            x = nodes(n, low, high)
            y = np.sqrt(x) if name == "low" else (np.exp(x) if name == "mid" else 1.0 / x)
            crit = sweep.solve("border", np.ones_like(y), y)["deficit"]
            values = 2.0 * crit / (y * y) if name == "low" else crit / np.sqrt(y)
            if _tail(chebyshev_coefficients(values), 0) <= wanted or n >= MAX_NODES or name == "high":
                break
            n = _next(n)
        pieces.append(BorderPiece(x, values, _cells(values, 0, wanted)))
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
    cells = (_cells(values, 0, follow[0], spec), _cells(values, 1, follow[1], spec))
    return Block(a, b, values, cells, power=power, stick=stick)

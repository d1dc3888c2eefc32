"""How far each block is off: the errors that a table states, measured on fresh solves.

Values are compared with solves at points that crowd towards edges and seams.  Slopes are compared in two steps.  How
far cells are from the interpolant of the nodes is found on many points, most of them on edges of cells, where the
derivative of a piecewise polynomial errs most; cells cut four times finer stand for the interpolant.  How far that
is from the model is smooth, and found on fewer points, with differences of fresh solves.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from mumacro import Surrogate, batch, charts
from mumacro.charts import CHARTS, CONTINUOUS, ERROR, FLOOR, MU, PIECE_ERROR, POWER, QUANTITIES, STICK, Axis

from .sweep import Sweep

__all__ = ["BlockErrors", "block_errors", "differences", "near_seams", "power_noise", "solver_noise"]

Array = NDArray[np.float64]
#: what a fresh solve itself may be wrong by, relative to mu~: rounding, and the input's last digit next to the corner
SOLVER_NOISE = 2e-15
STICK_NOISE = 1e-15  # the same of the stick fraction, absolute, away from the border
FINER = 4
_STENCIL = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])
_SIXTH_ORDER = np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) / 60.0
_FOURTH_ORDER = np.array([0.0, 1.0, -8.0, 8.0, -1.0, 0.0]) / 12.0
_STEP = 0.003  # in ln v~ and ln y~: beside the corner 0.01 leaves out more than the finest table errs by


@dataclasses.dataclass
class BlockErrors:
    """Largest errors over a block: as :class:`mumacro.table.Block` states them, and of mu~ (absolute, relative)."""

    errors: Array
    absolute: float
    relative: float


def log_uniform(rng: np.random.Generator, low: float, high: float, n: int) -> Array:
    return 10.0 ** rng.uniform(math.log10(low), math.log10(high), n)


def fast_from(s: Surrogate, y: Array) -> Array:
    """v~ from which the closed form for large speed answers, y~ > Y_CONT."""
    crit = s.v_tilde_crit(y)
    return np.where(y <= charts.Y_TAIL, charts.RHO_MAX * crit, charts.FAST_KAPPA * np.sqrt(y))


SEAMS = (charts.Y_STICK_LO, charts.Y_CONT, charts.Y_MID, charts.Y_HIGH, charts.Y_TAIL)


def near_seams(rng: np.random.Generator, n: int, s: Surrogate) -> tuple[Array, Array]:
    """Points (v~, y~) beside the lines where two blocks or a block and a tail meet."""
    y, v = log_uniform(rng, 1e-3, 1e6, n), log_uniform(rng, 1e-6, 1e4, n)
    off = 1.0 + rng.choice([-1.0, 1.0], n) * log_uniform(rng, 1e-12, 1e-3, n)
    which = rng.integers(0, 4, n)
    y = np.where(which < 2, rng.choice(SEAMS, n) * off, y)
    cut = which == 2
    y[cut] = rng.uniform(charts.Y_STICK_LO, charts.Y_STICK_HI, int(cut.sum()))
    v[cut] = s.v_tilde_crit(y[cut]) * charts.SIGMA_CUT**2 * off[cut]
    fast = which == 3
    y[fast] = log_uniform(rng, charts.Y_CONT, 1e6, int(fast.sum()))
    v[fast] = fast_from(s, y[fast]) * off[fast]
    return v, y


def power_noise(v: Array, y: Array, power: Array, sliding: NDArray[np.bool_] | bool) -> Array:
    """What the power of a fresh solve itself may be wrong by.

    Where it is small it is the difference of larger numbers: in stick-slip what the drive puts in during stick, v~,
    is taken out; in continuous sliding the angle swings by y~, and only v~ of that is out of phase.
    """
    lost = np.where(sliding, 1e-15 * y * y, 4e-15 * v)
    noise: Array = SOLVER_NOISE * power + np.where((y < 1.0) & (v < 1.0), lost, 0.0)
    return noise


def solver_noise(which: int, v: Array, y: Array, solved: dict[str, Array], sliding: NDArray[np.bool_] | bool) -> Array:
    """What a solve may be wrong by, absolute."""
    if which == MU:
        return SOLVER_NOISE * solved["mu_ratio"]
    if which == POWER:
        return power_noise(v, y, solved["power"], sliding)
    return np.full(v.shape, STICK_NOISE)


def _with_errors(surrogate: Surrogate, which: int, error: float, border_share: float) -> batch.Data:
    """The table's arrays with one error for all blocks: bounds of values are then their scale, plus rounding."""
    coef, blocks, border, pieces = surrogate._of(which)
    blocks, pieces = blocks.copy(), pieces.copy()
    blocks[: len(CHARTS), ERROR:] = error
    blocks[:, FLOOR] = 0.0
    pieces[:, PIECE_ERROR] *= border_share
    return coef, blocks, border, pieces


def block_errors(surrogate: Surrogate, sweep: Sweep, n: int, seed: int) -> list[BlockErrors]:
    """Largest errors of every block on ``n`` fresh solves; those which belong to a neighbour are left out."""
    finer = dataclasses.replace(
        surrogate.table,
        blocks=[dataclasses.replace(b, cells=(FINER * b.cells[0], FINER * b.cells[1])) for b in surrogate.table.blocks],
    )
    fine = Surrogate(finer, surrogate.path, surrogate.threads)
    found = []
    for index in range(len(CHARTS)):
        rng = np.random.default_rng([seed, index])
        largest = _value_errors(surrogate, sweep, index, rng, n)
        largest.errors[:, 1:] = _slope_errors(surrogate, fine, sweep, index, rng, n)
        found.append(largest)
    return found


def _value_errors(surrogate: Surrogate, sweep: Sweep, index: int, rng: np.random.Generator, n: int) -> BlockErrors:
    chart = CHARTS[index]
    radial = chart.a.name == "radius"
    v, y, _ = charts.point(chart, _crowded(rng, chart.a, n, radial), _crowded(rng, chart.b, n), surrogate.border)
    v_seam, y_seam = near_seams(rng, 2 * n, surrogate)
    v, y = np.concatenate([v, v_seam]), np.concatenate([y, y_seam])
    mu, _, source = surrogate.ratio_with_bound(v, y)
    v, y, mu = v[source == index], y[source == index], mu[source == index]
    solved = sweep.solve("full", v, y)
    error = np.abs(mu - solved["mu_ratio"])
    errors = np.zeros((3, 3))
    for which in (MU, POWER, STICK) if chart.regime != CONTINUOUS else (MU, POWER):
        value = batch.quantity(which, surrogate._of(which), v, y, surrogate.threads)[0]
        _, scale, _ = batch.quantity(which, _with_errors(surrogate, which, 1.0, 0.0), v, y, surrogate.threads)
        # the bound's own allowances: half of rounding, and of what the border's error does to the stick fraction
        _, slack, _ = batch.quantity(which, _with_errors(surrogate, which, 0.0, 0.5), v, y, surrogate.threads)
        noise = solver_noise(which, v, y, solved, chart.regime == CONTINUOUS)
        if which != MU:
            noise = noise + (slack if which == STICK else 0.5 * slack)
        off = np.maximum(np.abs(value - solved[QUANTITIES[which]]) - noise, 0.0)
        errors[which, 0] = float((off / scale).max())
    return BlockErrors(errors, float(error.max()), float((error / solved["mu_ratio"]).max()))


def _slope_errors(
    surrogate: Surrogate, fine: Surrogate, sweep: Sweep, index: int, rng: np.random.Generator, n: int
) -> Array:
    """Largest errors of both logarithmic slopes over a block, per scale of their bound, shape (3, 2)."""
    chart, cells, threads = CHARTS[index], surrogate.table.blocks[index].cells, surrogate.threads

    def points(a: Array, b: Array) -> tuple[Array, Array]:
        v, y, _ = charts.point(chart, a, b, surrogate.border)
        _, _, source = surrogate.ratio_with_bound(v, y)
        return v[source == index], y[source == index]

    v, y = points(_at_cells(rng, chart.a, cells[0], 8 * n), _at_cells(rng, chart.b, cells[1], 8 * n))
    few = max(n // 6, 50)
    around = neighbours(
        surrogate, sweep, *points(_crowded(rng, chart.a, few, chart.a.name == "radius"), _crowded(rng, chart.b, few))
    )
    total = np.zeros((3, 2))
    for which in (MU, POWER, STICK) if chart.regime != CONTINUOUS else (MU, POWER):
        unit = _with_errors(surrogate, which, 1.0, 0.0)
        tables = surrogate._of(which), fine._of(which), unit
        ours, near, scale = (batch.slopes(which, data, v, y, threads) for data in tables)
        cut = (np.abs(ours[1:3] - near[1:3]) / scale[3:5]).max(axis=1)
        truth, noise = around.slopes(which)
        near, scale = (batch.slopes(which, data, around.v, around.y, threads) for data in tables[1:])
        off = np.maximum(np.abs(near[1:3] - truth) - noise, 0.0) / scale[3:5]
        if which == STICK:  # a square root of the distance: differences across the border mean nothing
            off = off[:, around.v < 0.999 * around.crit]
        total[which] = cut + off.max(axis=1)
    return total


@dataclasses.dataclass
class Neighbours:
    """Fresh solves around points (n,): three on either side along ln v~ and along ln y~, ``steps`` (2, n) apart."""

    v: Array
    y: Array
    crit: Array
    steps: Array
    solved: list[dict[str, Array]]

    def slopes(self, which: int) -> tuple[Array, Array]:
        """Slopes along ln v~ and ln y~, (2, n), by central differences, and what these may be wrong by."""
        slope, noise = np.empty_like(self.steps), np.empty_like(self.steps)
        for row, (step, solved) in enumerate(zip(self.steps, self.solved, strict=True)):
            values = solved[QUANTITIES[which]]
            slope[row] = values @ _SIXTH_ORDER / step
            # what the fourth order leaves out; the sixth leaves out up to a seventh of it
            left_out = np.abs(slope[row] - values @ _FOURTH_ORDER / step)
            sliding = (self.v > self.crit)[:, None]
            each = solver_noise(which, self.v[:, None], self.y[:, None], solved, sliding).max(axis=1)
            noise[row] = (2.0 * each + 4e-16 * np.abs(slope[row])) / step + 0.2 * left_out
        return slope, noise


def neighbours(surrogate: Surrogate, sweep: Sweep, v: Array, y: Array) -> Neighbours:
    """Solve around the points; a step is a share of the distance to what is not smooth: border and corner."""
    crit, (mu, *_) = surrogate.v_tilde_crit(y), surrogate.slopes(v, y)
    gap = np.abs(np.log(v / crit))
    stiff = np.maximum(mu * mu, np.abs(1.0 - y * y))
    steps = np.stack((np.minimum(_STEP, gap / 32.0), np.minimum(np.minimum(_STEP, gap / 64.0), _STEP * stiff)))
    solved = []
    for row, step in enumerate(steps):
        moved = ((v, y)[row])[:, None] * np.exp(_STENCIL * step[:, None])
        held = np.broadcast_to(((y, v)[row])[:, None], moved.shape)
        solved.append(sweep.solve("full", *((moved, held) if row == 0 else (held, moved))))
    return Neighbours(v, y, crit, steps, solved)


def differences(surrogate: Surrogate, sweep: Sweep, which: int, v: Array, y: Array) -> tuple[Array, Array]:
    """:meth:`Neighbours.slopes` of one quantity at points (n,)."""
    return neighbours(surrogate, sweep, v, y).slopes(which)


def _at_cells(rng: np.random.Generator, axis: Axis, cells: int, n: int) -> Array:
    """File coordinates: two thirds just inside an edge of a cell, the others anywhere."""
    low, high = axis.span
    inside = rng.choice([1e-7, 1.0 - 1e-7], n)
    t = np.where(rng.random(n) < 0.67, (rng.integers(0, cells, n) + inside) / cells, rng.random(n))
    at = axis.to_file(low + (high - low) * np.clip(t, 1e-6 / cells, 1.0 - 1e-6 / cells))
    return np.clip(at, axis.low + 1e-7 * (axis.high - axis.low), axis.high - 1e-7 * (axis.high - axis.low))


def _crowded(rng: np.random.Generator, axis: Axis, n: int, radial: bool = False) -> Array:
    """File coordinates that crowd towards both ends."""
    low, high = axis.low, axis.high
    if radial:
        half = n // 2
        return np.concatenate([10.0 ** rng.uniform(-5.0, math.log10(high), half), high * rng.beta(0.5, 0.5, n - half)])
    t = rng.beta(0.5, 0.5, n)
    edge = 10.0 ** rng.uniform(-6.0, -1.0, n // 4)
    t[: edge.size] = np.where(rng.random(edge.size) < 0.5, edge, 1.0 - edge)
    return low + (high - low) * np.clip(t, 1e-7, 1.0 - 1e-7)

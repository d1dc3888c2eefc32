"""How far each block is off: the errors that a table states, measured on fresh solves.

Values are compared with solves at points that crowd towards edges and seams; for slopes see :mod:`.cell_errors`.
"""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mumacro import Surrogate, charts
from mumacro.charts import CHARTS, CONTINUOUS, Axis

from .blocks import solve_nodes
from .cell_errors import cell_errors, finer
from .quantities import solver_noise
from .sweep import Sweep

__all__ = ["SEAMS", "BlockErrors", "block_errors", "fast_from", "log_uniform", "near_seams"]

Array = NDArray[np.float64]


class BlockErrors(NamedTuple):
    """Largest errors of a block.

    By quantity: ``values`` of what is tabulated, over the block; ``cells`` as in :class:`mumacro.table.Block`.
    ``absolute``, ``relative``: of mu~.
    """

    values: dict[str, float]
    absolute: float
    relative: float
    cells: dict[str, Array]


def log_uniform(rng: np.random.Generator, low: float, high: float, n: int) -> Array:
    return 10.0 ** rng.uniform(math.log10(low), math.log10(high), n)


def fast_from(s: Surrogate, y: Array) -> Array:
    """v~ from which the closed form for large speed answers, y~ > Y_CONT."""
    below = charts.RHO_MAX * s.v_tilde_crit(y)
    return np.asarray(np.where(y <= charts.Y_TAIL, below, charts.FAST_KAPPA * np.sqrt(y)))


SEAMS = (charts.Y_STICK_LO, charts.Y_CONT, charts.Y_MID, charts.Y_HIGH, charts.Y_TAIL)


def near_seams(rng: np.random.Generator, n: int, s: Surrogate) -> tuple[Array, Array]:
    """Points (v~, y~) beside the lines where two blocks or a block and a tail meet."""
    y, v = log_uniform(rng, 1e-3, 1e6, n), log_uniform(rng, 1e-6, 1e4, n)
    off = 1.0 + rng.choice([-1.0, 1.0], n) * log_uniform(rng, 1e-12, 1e-3, n)
    which = rng.integers(0, 4, n)
    y = np.where(which < 2, rng.choice(SEAMS, n) * off, y)
    cut, fast = which == 2, which == 3
    y[cut] = rng.uniform(charts.Y_STICK_LO, charts.Y_STICK_HI, int(cut.sum()))
    v[cut] = s.v_tilde_crit(y[cut]) * charts.SIGMA_CUT**2 * off[cut]
    y[fast] = log_uniform(rng, charts.Y_CONT, 1e6, int(fast.sum()))
    v[fast] = fast_from(s, y[fast]) * off[fast]
    return v, y


def _stating(surrogate: Surrogate, error: float, of_border: float) -> Surrogate:
    """The same table with one error for all that it tabulates, and a share of the border's.

    With the error 1 a bound is the scale of its errors; with 0 it is what it allows beside the table's error.
    """
    table, replace = surrogate.table, dataclasses.replace
    border = [replace(piece, max_rel_error=of_border * piece.max_rel_error) for piece in table.border]
    stated = {name: np.array([error, 0.0, 0.0]) for name in table.quantities}
    blocks = [replace(block, errors=stated) for block in table.blocks]
    return Surrogate(replace(table, border=border, blocks=blocks), surrogate.path, surrogate.threads)


def block_errors(surrogate: Surrogate, sweep: Sweep, n: int, seed: int) -> list[BlockErrors]:
    """Largest errors of every block, those of values on ``n`` fresh solves, without those of a neighbour."""
    stating = tuple(_stating(surrogate, *how) for how in ((1.0, 0.0), (0.0, 0.5), (0.0, 0.0)))
    found = []
    for index, block in enumerate(surrogate.table.blocks):
        errors = _value_errors(surrogate, stating, sweep, index, np.random.default_rng([seed, index]), n)
        _, _, exact = solve_nodes(index, finer((block.a.size, block.b.size)), surrogate.border, sweep)
        found.append(BlockErrors(*errors, cell_errors(index, block, exact)))
    return found


def _value_errors(
    surrogate: Surrogate, stating: tuple[Surrogate, ...], sweep: Sweep, index: int, rng: np.random.Generator, n: int
) -> tuple[dict[str, float], float, float]:
    """Of what is tabulated by quantity; absolute and relative of mu~."""
    chart = CHARTS[index]
    v, y, _ = chart.point(_crowded(rng, chart.a, n), _crowded(rng, chart.b, n), surrogate.border)
    v_seam, y_seam = near_seams(rng, 2 * n, surrogate)
    v, y = np.concatenate([v, v_seam]), np.concatenate([y, y_seam])
    mu, _, source = surrogate.ratio_with_bound(v, y)
    v, y, mu = v[source == index], y[source == index], mu[source == index]
    solved = sweep.solve("full", v, y)
    error = np.abs(mu - solved["mu_ratio"])
    errors = {}
    for name in surrogate.table.blocks[index].nodes:
        value, *_ = surrogate.quantity(name, v, y)
        scale, beside, rounding = (table.quantity(name, v, y)[1] for table in stating)
        # what the bound allows anyway: half of rounding, and what the border's error does, of which it states twice
        noise = solver_noise(name, v, y, solved, chart.regime == CONTINUOUS) + beside - 0.5 * rounding
        errors[name] = float((np.maximum(np.abs(value - solved[name]) - noise, 0.0) / scale).max())
    return errors, float(error.max()), float((error / solved["mu_ratio"]).max())


def _crowded(rng: np.random.Generator, axis: Axis, n: int) -> Array:
    """File coordinates that crowd towards both ends."""
    low, high = axis.low, axis.high
    if axis.name == "radius":
        half = n // 2
        return np.concatenate([10.0 ** rng.uniform(-5.0, math.log10(high), half), high * rng.beta(0.5, 0.5, n - half)])
    t = rng.beta(0.5, 0.5, n)
    edge = 10.0 ** rng.uniform(-6.0, -1.0, n // 4)
    t[: edge.size] = np.where(rng.random(edge.size) < 0.5, edge, 1.0 - edge)
    return low + (high - low) * np.clip(t, 1e-7, 1.0 - 1e-7)

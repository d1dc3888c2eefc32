"""How errors are distributed, by contact, direction, quantity and table; and bounds over errors.

    python benchmarks/error_distribution.py [--share 0.1] [--write]

Spring across: the attributes of the tables, found by their builder on fresh solves.  Ball across:
sums over springs that are solved afresh.  The others, which are the same in every table: a
reference with the 64 bits of ``numpy.longdouble``.
"""

# isort: split
from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.optimize import brentq

from builder.solver.steady import V_RANGE, Y_RANGE
from builder.solver.sweep import Sweep
from builder.tables.contacts import spring
from builder.tables.quantities import SOLVED
from builder.tables.verify import QUANTILES, Neighbours, bound_over_error, distribution
from mumacro import Surrogate
from mumacro.kernel.arrays import Array
from mumacro.table.atlas import QUANTITY_NAMES
from mumacro.table.blocks import RATIOS
from tests.support import extended
from tests.support.measuring import main, markdown, quantity

TOLERANCES = (1e-4, 1e-7, 1e-10, 1e-12)
SLOPES = ("slope_along_v", "slope_along_y")
NAMES = (*QUANTITY_NAMES, *SLOPES)  # in the order of extended.ROWS
#: points of a full run: ball across, its slopes, spring along and normal, ball along
POINTS = ACROSS, SLOPES_ACROSS, SPRINGS, BALLS = 200, 40, 20_000, 1_000
LAST_DIGIT = 2.0**-53
ROOM = 1e-8
Rows = dict[str, tuple[Array, Array]]  # values and bounds, or values and their own errors, by name
HEADER = (
    "contact",
    "quantity",
    "table",
    *(f"{100 * share:g} %" for share in QUANTILES[:-1]),
    "largest",
    *(f"bound/error, {word}" for word in RATIOS),
)


def part(full: int, share: float) -> int:
    return max(10, int(full * share))


def answers(s: Surrogate, v: Array, y: Array, contact: Any, direction: Any) -> Rows:
    """Values and bounds of every quantity of a contact."""
    rows, normal = {}, direction == "normal"
    for name in QUANTITY_NAMES:
        if not (normal and name == "power"):  # the force does no work along the contact
            value, bound, _ = s.quantity(name, v, y, contact=contact, direction=direction)
            rows[name] = value, bound
    amplitude = "Fz_amplitude" if normal else "y0"
    case: Any = {"mu0": 1.0, "Fz": 1.0, "k": 1.0, "omega": 1.0, "v0": v, amplitude: y}
    answer = s.evaluate(**case, contact=contact, direction=direction, gradient=True)
    for name, field in zip(SLOPES, ("v0", amplitude), strict=True):
        rows[name] = (
            answer.gradient[field] * case[field],
            answer.gradient_bound[field] * case[field],
        )
    return rows


def compared(rows: Rows, truth: Rows, ball: bool) -> Iterator[tuple[str, dict[str, list[float]]]]:
    """The distribution of the errors of every quantity; of the power of a spring relative to it, as
    tables have it."""
    for name, (exact, noise) in truth.items():
        value, bound = rows[name]
        difference = np.abs(value - exact).astype(float)
        least = np.maximum(noise, LAST_DIGIT * np.abs(exact).astype(float))
        relative = not ball and name in SOLVED and SOLVED[name].relative
        scale = np.where(exact == 0.0, 1.0, np.abs(exact)).astype(float) if relative else 1.0
        yield name, distribution(difference / scale, bound_over_error(bound, least, difference))


def line(contact: str, name: str, table: str, spread: dict[str, list[float]]) -> list[str]:
    errors = (f"{error:.1e}" if error else "0" for error in spread["error_quantiles"])
    if name == "border" or (name == "power" and "spring" in contact):
        name += ", relative"
    ratios = (quantity(ratio) for ratio in spread["bound_over_error"])
    return [contact, name.replace("_", " "), table, *errors, *ratios]


# --- a ball, across -------------------------------------------------------------------------------


def double_exponential(step: float = 1.0 / 14.0, most: float = 3.1) -> tuple[Array, Array]:
    """Nodes and weights over [0, 1] that follow any behaviour at its ends: the nodes by their
    distance to the nearer end are exact."""
    t = np.arange(-most, most + 0.5 * step, step)
    inner = 0.5 * np.pi * np.sinh(t)
    nodes = 1.0 / (1.0 + np.exp(-2.0 * inner))
    weights = step * 0.25 * np.pi * np.cosh(t) / np.cosh(inner) ** 2
    return nodes, weights


def springs(table: Surrogate, v: float, y: float) -> tuple[Array, Array]:
    """The loads s of springs and their weights d xi: split where a spring comes to the border and
    at its y~ = 1."""

    def beyond(xi: Any) -> Any:
        s = 1.5 * (1.0 - xi * xi)
        return v / s - table.v_tilde_crit(y / s)

    xi = 1.0 - np.geomspace(1.0, 1e-6, 1500)
    for _ in range(3):  # a narrow ring may stick between two of these
        least = int(np.argmin(beyond(xi) * (1.0 - xi * xi)))
        near = np.linspace(xi[max(least - 1, 0)], xi[min(least + 1, xi.size - 1)], 200)
        xi = np.unique(np.concatenate([xi, near]))
    signs = np.sign(beyond(xi))
    turns = np.flatnonzero(signs[1:] != signs[:-1])
    cuts = [brentq(beyond, xi[i], xi[i + 1], xtol=1e-16) for i in turns]
    if y < 1.5:
        cuts.append(float(np.sqrt(1.0 - y / 1.5)))
    ends = np.array([0.0, *sorted(cuts), 1.0])
    nodes, weights = double_exponential()
    wide = np.diff(ends)[:, None]
    rest = (1.0 - ends[1:, None]) + wide * nodes[::-1]  # 1 - xi
    return (rest * (2.0 - rest)).ravel(), (wide * weights[::-1]).ravel()


def ball_points(table: Surrogate, n: int, seed: int) -> tuple[Array, Array]:
    """Log-uniform from 1e-3 to 1e3; every fourth beside the border of the ball."""
    rng = np.random.default_rng(seed)
    v, y = 10.0 ** rng.uniform(-3.0, 3.0, (2, n))
    beside = 1.0 + rng.choice([-1.0, 1.0], n) * 10.0 ** rng.uniform(-6.0, -1.0, n)
    border = np.asarray(table.v_tilde_crit(y, contact="ball"))
    return np.where(np.arange(n) % 4 == 0, border * beside, v), y


def within(v: float, y: float, s: Array) -> tuple[Array, Array]:
    """v~ and y~ of springs in the range of the solver: those of less load, at the rim, carry less
    than rounding, and answer as if they had that load."""
    load = 1.5 * np.maximum(s, max(v / V_RANGE[1], y / Y_RANGE[1]))
    return v / load, y / load


def summed(sweep: Sweep, table: Surrogate, v: Array, y: Array) -> Rows:
    """Quantities of balls, with what the sums may be wrong by."""
    sums = np.empty((len(QUANTITY_NAMES), v.size))
    for i in range(v.size):
        s, weight = springs(table, float(v[i]), float(y[i]))
        solved = sweep.solve("full", *within(v[i], y[i], s))
        for row, name in enumerate(QUANTITY_NAMES):
            load = 1.5 * s * (1.5 * s if name == "power" else 1.0)
            sums[row, i] = np.sum(weight * load * solved[name])
    return {
        name: (row, 4e-15 * np.maximum(row, v if name == "power" else 1.0))
        for name, row in zip(QUANTITY_NAMES, sums, strict=True)
    }


def summed_slopes(sweep: Sweep, table: Surrogate, v: Array, y: Array) -> Rows:
    """Slopes of mu~ of balls: sums over differences of springs that are solved afresh."""
    sums, noise = np.empty((2, v.size)), np.empty((2, v.size))
    for i in range(v.size):
        s, weight = springs(table, float(v[i]), float(y[i]))
        x, amplitude = within(v[i], y[i], s)
        # differences need room: a spring beside its border stands for those that are nearer
        crit = table.v_tilde_crit(amplitude)
        x = np.where(np.abs(x / crit - 1.0) < ROOM, crit * (1.0 + ROOM * np.sign(x - crit)), x)
        heavy = (weight * s > 1e-18) & (x != crit)  # the others add nothing
        s, weight = s[heavy], weight[heavy]
        slopes, off = Neighbours(table, spring(sweep), x[heavy], amplitude[heavy]).slopes(
            "mu_ratio"
        )
        sums[:, i] = (1.5 * weight * s * slopes).sum(axis=1)
        noise[:, i] = (1.5 * weight * s * off).sum(axis=1)
    return {name: (sums[row], noise[row]) for row, name in enumerate(SLOPES)}


def ball_across(share: float) -> Iterator[list[str]]:
    table = Surrogate.open(TOLERANCES[-1])
    v, y = ball_points(table, part(ACROSS, share), 31)
    few = slice(0, part(SLOPES_ACROSS, share))
    with Sweep() as sweep:
        truth = summed(sweep, table, v, y)
        slopes = summed_slopes(sweep, table, v[few], y[few])
    for tolerance in TOLERANCES:
        rows = answers(Surrogate.open(tolerance), v, y, "ball", "across")
        some = {name: (row[0][few], row[1][few]) for name, row in rows.items()}
        for name, spread in (*compared(rows, truth, True), *compared(some, slopes, True)):
            yield line("ball across", name, f"{tolerance:.0e}", spread)


# --- along and normal -----------------------------------------------------------------------------


def driven_points(n: int, seed: int, normal: bool) -> tuple[Array, Array]:
    """Log-uniform points that stick, v~ from 1e-6 and y~ from 1e-4 to 1e4; every tenth close to the
    border, v~ = y~."""
    rng = np.random.default_rng(seed)
    y = 10.0 ** rng.uniform(-4.0, 0.0 if normal else 4.0, n)
    v = 10.0 ** rng.uniform(-6.0, np.log10(y))
    near = y * (1.0 - 10.0 ** rng.uniform(-12.0, 0.0, n))
    return np.where(np.arange(n) % 10 == 0, near, v), y


def driven(contact: str, direction: str, share: float) -> Iterator[list[str]]:
    normal, ball = direction == "normal", contact == "ball"
    v, y = driven_points(part(BALLS if ball else SPRINGS, share), 32, normal)
    exact = extended.ball(v, y, 48) if ball else extended.spring(v, y, not normal)
    rows = answers(Surrogate.open(TOLERANCES[0]), v, y, contact, direction)
    nothing = np.zeros(v.size)
    truth = {name: (row, nothing) for name, row in zip(NAMES, exact, strict=True) if name in rows}
    for name, spread in compared(rows, truth, ball):
        yield line(f"{contact} {direction}", name, "any", spread)


# --- all ------------------------------------------------------------------------------------------


def spring_across() -> Iterator[list[str]]:
    """What the tables state."""
    for tolerance in TOLERANCES:
        for name, spread in Surrogate.open(tolerance).error_distribution.items():
            errors = [spread[f"{share:g}"] for share in QUANTILES]
            ratios = [spread[word] for word in RATIOS]
            stated = {"error_quantiles": errors, "bound_over_error": ratios}
            yield line("spring across", name, f"{tolerance:.0e}", stated)


def errors(share: float) -> str:
    rows = [*spring_across(), *ball_across(share)]
    if extended.HAS_EXTENDED:
        for contact, direction in (("spring", "along"), ("spring", "normal"), ("ball", "along")):
            rows += driven(contact, direction, share)
    order = [*dict.fromkeys((row[0], row[1]) for row in rows)]
    rows.sort(key=lambda row: order.index((row[0], row[1])))
    points = int(Surrogate.open().table.contacts["spring"].attributes["verified_points"])
    across, slopes, single, balls = (f"{part(full, share):,}" for full in POINTS)
    points_drawn = (
        f"Points: spring across {points:,}; ball across {across}, of slopes {slopes}; spring along "
        f"and normal {single}, ball along {balls}. Seeds 2018, 31, 32."
    )
    return f"{points_drawn}\n\n{markdown(HEADER, rows, 3)}"


if __name__ == "__main__":
    main(__doc__, {"error_distribution": errors}, share=1.0)

"""The cost of one solve: the compiled solver by regime, and marching with scipy beside it.

    python benchmarks/solver.py [--points 20000] [--quick] [--write]

One thread.  Points are log-uniform over v~, y~ in [1e-3, 1e3].

Marching is the usual method: the equations of motion are integrated with scipy until two cycles
agree.  Stick and slip are phases of :func:`scipy.integrate.solve_ivp`, their ends are events, and
the average of u_x is an unknown.  A disturbance of the cycle decays with the slip path, by exp(-2
pi v~) a cycle in continuous sliding, so the cost grows as v~ falls; for the same reason two cycles
agree to 1e-9 while both are 1e-9 / (2 pi v~) off.
"""

from tests.support.measuring import best_of, main, markdown, quantity  # isort: split

import math
from dataclasses import dataclass
from functools import partial
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from builder.solver.sweep import solve_chunk
from mumacro import REGIMES

PEER_LOW = 0.01  # smallest v~ of the marched points, so that marching ends
RTOL, ATOL, AGREE = 1e-9, 1e-12, 1e-9
PERIOD = 2.0 * math.pi


@dataclass(frozen=True)
class Marched:
    """mu~ of the last cycle [-], cycles marched, and whether two successive averages agreed."""

    mu_ratio: float
    cycles: int
    agreed: bool


def march(v: float, y: float, max_step: float = math.inf) -> Marched:
    """Steady mu~ at v~ = ``v``, y~ = ``y`` by marching whole cycles from an unloaded spring (eqs.
    (9)-(12), (15)).

    Gives up after 20 + 6/v~ cycles, several times the number for the decay exp(-2 pi v~) a cycle.
    That happens beside the border, where steps of any length jump over short windows of stick;
    ``max_step`` = 0.1 rad avoids it for 2 to 4 times the cost.
    """

    def stick(tau: float, s: Any) -> list[float]:
        return [v, y * math.cos(tau), s[0]]

    def slip(tau: float, s: Any) -> list[float]:
        c, n = math.cos(s[0]), math.sin(s[0])
        return [-v * n + y * math.cos(tau) * c, c]

    def full(_tau: float, s: Any) -> float:
        return float(s[0] * s[0] + s[1] * s[1] - 1.0)

    def speed(tau: float, s: Any) -> float:
        return v * math.cos(s[0]) + y * math.cos(tau) * math.sin(s[0])

    full.terminal, full.direction = True, 1.0  # type: ignore[attr-defined]
    speed.terminal, speed.direction = True, -1.0  # type: ignore[attr-defined]
    max_cycles = 20 + math.ceil(6.0 / v)
    state: tuple[float, ...] = (0.0, 0.0)
    sticking, before = True, math.inf
    for cycle in range(1, max_cycles + 1):
        tau, total = 0.0, 0.0
        while tau < PERIOD:
            law, event, start = (
                (stick, full, [*state, total]) if sticking else (slip, speed, [*state, total])
            )
            options: Any = {"rtol": RTOL, "atol": ATOL, "max_step": max_step}
            run = solve_ivp(law, (tau, PERIOD), start, method="DOP853", events=event, **options)
            tau, total = float(run.t[-1]), float(run.y[-1, -1])
            if sticking:
                state = (float(run.y[0, -1]), float(run.y[1, -1]))
                if run.status == 1:
                    sticking, state = False, (math.atan2(state[1], state[0]),)
            else:
                state = (float(run.y[0, -1]),)
                if run.status == 1:
                    sticking, state = True, (math.cos(state[0]), math.sin(state[0]))
        average = total / PERIOD
        if abs(average - before) <= AGREE:
            return Marched(average, cycle, True)
        before = average
    return Marched(before, max_cycles, False)


def points(n: int, seed: int, low: float = 1e-3) -> NDArray[np.float64]:
    """Rows of v~, y~, y~ - 1, log-uniform over v~ in [low, 1e3], y~ in [1e-3, 1e3]."""
    v, y = np.exp(np.random.default_rng(seed).uniform(np.log([[low], [1e-3]]), np.log(1e3), (2, n)))
    return np.stack([v, y, y - 1.0], axis=1)


def by_regime(n: int, rounds: int) -> str:
    """Mean time a solve, all together and split by regime."""
    drawn = points(n, seed=1)
    slides = drawn[:, 0] >= solve_chunk("border", drawn)[:, 1]
    parts = {"all": drawn, REGIMES[0]: drawn[slides], REGIMES[1]: drawn[~slides]}
    best = best_of(
        rounds, {name: partial(solve_chunk, "full", part) for name, part in parts.items()}
    )
    mean = {name: quantity(best[name] / len(part) * 1e6) for name, part in parts.items()}
    rows = [[name.replace("_", "-"), f"{len(part):,}", mean[name]] for name, part in parts.items()]
    return markdown(("regime", "points", "mean, microseconds"), rows)


def against_marching(n: int) -> str:
    """The same points by both: time and error, split by whether two marched cycles agreed."""
    drawn = points(n, seed=2, low=PEER_LOW)
    mu = solve_chunk("full", drawn)[:, 0]
    direct = best_of(3, {"": partial(solve_chunk, "full", drawn)})[""] / n
    cycles = []
    for (v, y, _), exact in zip(drawn, mu, strict=True):
        start = process_time()
        marched = march(v, y)
        cycles.append((marched.agreed, process_time() - start, abs(marched.mu_ratio - exact)))
    rows = [["compiled solver", str(n), quantity(1e6 * direct), "reference"]]
    for agreed, name in (
        (True, "two cycles agree to 1e-9"),
        (False, "given up, beside the border"),
    ):
        chosen = [(seconds, error) for ended, seconds, error in cycles if ended == agreed]
        if chosen:
            seconds, error = np.array(chosen).T
            cells = quantity(1e6 * seconds.mean()), quantity(float(error.max()))
            rows.append([f"marched, {name}", str(len(chosen)), *cells])
    return markdown(("method", "points", "mean, microseconds", "max abs error"), rows)


def solver(points: int, rounds: int, quick: bool) -> str:
    n = min(points, 500) if quick else points
    regimes = by_regime(n, rounds)
    return (
        f"{n:,} points, one thread, best of {rounds} rounds, processor time.\n\n{regimes}\n\n"
        "Beside scipy's `solve_ivp` (DOP853, rtol 1e-9, atol 1e-12, events at the end of stick and "
        f"of slip), at points with v~ >= {PEER_LOW:g}:\n\n{against_marching(3 if quick else 40)}"
    )


if __name__ == "__main__":
    main(__doc__, {"solver": solver}, points=20_000, rounds=5, quick=False)

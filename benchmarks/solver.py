"""The cost of one solve: the compiled solver by regime, its error, and the cost of marching with scipy.

    python benchmarks/solver.py [--points 20000] [--quick] [--write]

One thread.  Points are log-uniform over v~, y~ in [1e-3, 1e3]; errors are against tests/data/points.csv, which was
solved in quadruple precision.
"""

from __future__ import annotations

from benchmarks.measuring import CLOCKS, ROOT, best_of, main, markdown, progress, quantity  # isort: split

import csv
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.marching import march
from builder.steady import REGIMES
from builder.sweep import COLUMNS, solve_chunk

Array = NDArray[np.float64]
SLOWING = (1.0, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001)  # v~ at which the cost of marching is shown
SLOWING_Y = 0.1
ALONE = 2000  # points a regime that are solved one by one, for the spread
PEER_LOW = 0.01  # smallest v~ of the marched points, so that marching ends


def points(n: int, seed: int, low: float = 1e-3) -> Array:
    """Rows of v~, y~, y~ - 1, log-uniform over v~ in [low, 1e3], y~ in [1e-3, 1e3]."""
    rng = np.random.default_rng(seed)
    v = np.exp(rng.uniform(np.log(low), np.log(1e3), n))
    y = np.exp(rng.uniform(np.log(1e-3), np.log(1e3), n))
    return np.stack([v, y, y - 1.0], axis=1)


def _alone(point: Array, now: Callable[[], float]) -> float:
    """Seconds of one solve by the clock ``now``, best of three."""
    best = np.inf
    for _ in range(3):
        start = now()
        solve_chunk("full", point)
        best = min(best, now() - start)
    return best


def by_regime(n: int, rounds: int, clock: str) -> tuple[str, str]:
    """Mean time a solve, all together and split by regime; and a sentence about other load."""
    drawn = points(n, seed=1)
    crit = solve_chunk("border", drawn)[:, 1]
    slipping = drawn[:, 0] >= crit
    parts = {"all": drawn, REGIMES[0]: drawn[slipping], REGIMES[1]: drawn[~slipping]}
    work = {name: partial(solve_chunk, "full", part) for name, part in parts.items()}
    timed = best_of(rounds, work, clock)
    rows = []
    for name, part in parts.items():
        alone = [_alone(part[i : i + 1], CLOCKS[clock]) for i in range(min(len(part), ALONE))]
        typical, slow = np.quantile(alone, (0.5, 0.99))
        mean = timed.best[name] / len(part)
        rows.append([name.replace("_", "-"), f"{len(part):,}", *(quantity(s * 1e6) for s in (mean, typical, slow))])
    header = ("regime", "points", "mean, microseconds", "median", "99 %")
    return markdown(header, rows), timed.note()


def accuracy() -> str:
    """Error of the compiled solver on the quadruple-precision points, by kind of point."""
    with open(ROOT / "tests" / "data" / "points.csv", newline="") as stream:
        cases = list(csv.DictReader(stream))
    v, y, truth = (np.array([float(c[name]) for c in cases]) for name in ("v", "y", "mu_ratio"))
    solved = dict(zip(COLUMNS, solve_chunk("full", np.stack([v, y, y - 1.0], axis=1)).T, strict=True))
    error = np.abs(solved["mu_ratio"] - truth)
    kind = np.array([c["case"] for c in cases])
    rows = []
    for name in (*sorted(set(kind)), "all"):
        at = (kind == name) | (name == "all")
        relative = (error[at] / truth[at]).max()
        failed = int(np.count_nonzero(solved["status"][at]))
        rows.append(
            [name, str(int(at.sum())), quantity(float(error[at].max())), quantity(float(relative)), str(failed)]
        )
    return markdown(("kind of point", "points", "max abs error", "max rel error", "failed"), rows)


def _pair(v: float, y: float, now: Callable[[], float]) -> tuple[float, float, float, float, int, bool]:
    """Seconds and error of marching, seconds of the direct solve, mu~, cycles, agreed."""
    start = now()
    marched = march(v, y)
    slow = now() - start
    point = np.array([[v, y, y - 1.0]])
    mu = float(solve_chunk("full", point)[0, 0])
    return slow, abs(marched.mu_ratio - mu), _alone(point, now), mu, marched.cycles, marched.agreed


def against_marching(n: int, now: Callable[[], float]) -> str:
    """The same points by both: time and error, split by whether two marched cycles agreed."""
    drawn = points(n, seed=2, low=PEER_LOW)
    found = [_pair(v, y, now) for v, y, _ in drawn]
    slow, error, quick, mu, _, agreed = (np.array(column) for column in zip(*found, strict=True))
    ok = agreed.astype(bool)
    rows = [
        [
            f"scipy solve_ivp, marched, {int(ok.sum())} of {n} points that converged",
            *(quantity(1e6 * x) for x in (slow[ok].mean(), slow[ok].max())),
            quantity(float(error[ok].max())), quantity(float((error[ok] / mu[ok]).max())),
        ],
        [
            "compiled solver, the same points",
            *(quantity(1e6 * x) for x in (quick[ok].mean(), quick[ok].max())), "reference", "reference",
        ],
    ]  # fmt: skip
    text = markdown(("method", "mean, microseconds", "slowest, microseconds", "max abs error", "max rel error"), rows)
    text += f"\n\nRatio of the mean times: {quantity(float(slow[ok].mean() / quick[ok].mean()))}."
    if not ok.all():
        text += (
            f" At {int((~ok).sum())} of {n} points no two cycles agreed to 1e-9 before marching was given up, after "
            f"{quantity(float(slow[~ok].mean() * 1e3))} ms on average and with an error of up to "
            f"{quantity(float(error[~ok].max()))}: beside the border its steps jump over short windows of stick."
        )
    return text


def slowing(speeds: tuple[float, ...], now: Callable[[], float]) -> str:
    """Cost of both at falling v~, y~ = :data:`SLOWING_Y`."""
    rows = []
    for v in speeds:
        progress(f"marching at v~ = {v:g}")
        slow, error, quick, _, cycles, agreed = _pair(v, SLOWING_Y, now)
        cells = [quantity(slow * 1e3), f"{cycles:,}" + ("" if agreed else " (no agreement)"), quantity(error)]
        rows.append([f"{v:g}", *cells, quantity(quick * 1e6)])
    header = ("v~", "marching, milliseconds", "cycles", "its error", "compiled solver, microseconds")
    return markdown(header, rows)


def solver(points: int, rounds: int, quick: bool, clock: str) -> str:
    """Time by regime, error, and marching beside it."""
    n = min(points, 500) if quick else points
    now = CLOCKS[clock]
    regimes, note = by_regime(n, rounds, clock)
    progress("marching")
    crit = solve_chunk("border", np.array([[1.0, SLOWING_Y, SLOWING_Y - 1.0]]))[0, 1]
    return "\n\n".join(
        [
            f"{n:,} log-uniform random points over v~, y~ in [1e-3, 1e3], one thread, best of {rounds} rounds; "
            f"median and 99 % are of solves called one by one. {note}",
            regimes,
            "Error against quadruple precision:",
            accuracy(),
            "Beside marching with scipy's `solve_ivp` (DOP853, rtol 1e-9, atol 1e-12, events at the end of stick and "
            f"of slip, until two cycles agree to 1e-9), at points with v~ >= {PEER_LOW:g}:",
            against_marching(3 if quick else 40, now),
            f"Marching costs more as v~ falls, and agreement of two cycles to 1e-9 means less; here "
            f"y~ = {SLOWING_Y:g}, where v~crit = {quantity(float(crit))}:",
            slowing(SLOWING[:2] if quick else SLOWING, now),
        ]
    )


if __name__ == "__main__":
    main(__doc__, {"solver": solver}, points=20_000, rounds=5, quick=False, clock="wall")

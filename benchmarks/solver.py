"""The cost of one solve: the compiled solver by regime, and marching with scipy beside it.

    python benchmarks/solver.py [--points 20000] [--quick] [--write]

One thread.  Points are log-uniform over v~, y~ in [1e-3, 1e3].
"""

from benchmarks.measuring import best_of, main, markdown, quantity  # isort: split

from functools import partial
from time import process_time

import numpy as np
from numpy.typing import NDArray

from benchmarks.marching import march
from builder.steady import REGIMES
from builder.sweep import solve_chunk

PEER_LOW = 0.01  # smallest v~ of the marched points, so that marching ends


def points(n: int, seed: int, low: float = 1e-3) -> NDArray[np.float64]:
    """Rows of v~, y~, y~ - 1, log-uniform over v~ in [low, 1e3], y~ in [1e-3, 1e3]."""
    v, y = np.exp(np.random.default_rng(seed).uniform(np.log([[low], [1e-3]]), np.log(1e3), (2, n)))
    return np.stack([v, y, y - 1.0], axis=1)


def by_regime(n: int, rounds: int) -> str:
    """Mean time a solve, all together and split by regime."""
    drawn = points(n, seed=1)
    slides = drawn[:, 0] >= solve_chunk("border", drawn)[:, 1]
    parts = {"all": drawn, REGIMES[0]: drawn[slides], REGIMES[1]: drawn[~slides]}
    best = best_of(rounds, {name: partial(solve_chunk, "full", part) for name, part in parts.items()})
    mean = {name: quantity(best[name] / len(part) * 1e6) for name, part in parts.items()}
    rows = [[name.replace("_", "-"), f"{len(part):,}", mean[name]] for name, part in parts.items()]
    return markdown(("regime", "points", "mean, microseconds"), rows)


def against_marching(n: int) -> str:
    """The same points by both: time and error, split by whether two marched cycles agreed."""
    drawn = points(n, seed=2, low=PEER_LOW)
    mu = solve_chunk("full", drawn)[:, 0]
    direct = best_of(3, {"": partial(solve_chunk, "full", drawn)})[""] / n
    found = []
    for (v, y, _), exact in zip(drawn, mu, strict=True):
        start = process_time()
        marched = march(v, y)
        found.append((marched.agreed, process_time() - start, abs(marched.mu_ratio - exact)))
    rows = [["compiled solver", str(n), quantity(1e6 * direct), "reference"]]
    for agreed, name in ((True, "two cycles agree to 1e-9"), (False, "given up, beside the border")):
        chosen = [(seconds, error) for ended, seconds, error in found if ended == agreed]
        if chosen:
            seconds, error = np.array(chosen).T
            told = quantity(1e6 * seconds.mean()), quantity(float(error.max()))
            rows.append([f"marched, {name}", str(len(chosen)), *told])
    return markdown(("method", "points", "mean, microseconds", "max abs error"), rows)


def solver(points: int, rounds: int, quick: bool) -> str:
    n = min(points, 500) if quick else points
    regimes = by_regime(n, rounds)
    return (
        f"{n:,} points, one thread, best of {rounds} rounds, processor time.\n\n{regimes}\n\n"
        "Beside scipy's `solve_ivp` (DOP853, rtol 1e-9, atol 1e-12, events at the end of stick and of slip), at points "
        f"with v~ >= {PEER_LOW:g}:\n\n{against_marching(3 if quick else 40)}"
    )


if __name__ == "__main__":
    main(__doc__, {"solver": solver}, points=20_000, rounds=5, quick=False)

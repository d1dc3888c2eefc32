"""Time of one call, and a point of large arrays; beside scipy's elliptic integral."""

from benchmarks.measuring import best_of, main, markdown, quantity  # isort: split

import timeit
from functools import partial

import numpy as np
from scipy.special import ellipk

import mumacro
from tests.serving import CASE

SCALARS = {
    "scipy.special.ellipk(m), for comparison": "ellipk(0.5)",
    "mu_ratio(v, y)": "s.mu_ratio(0.1, 0.5)",
    "evaluate, floats": "s.evaluate(**case)",
    "evaluate, gradient=True": "s.evaluate(**case, gradient=True)",
}
ARRAYS = {
    "scipy.special.ellipk(m), for comparison": "ellipk(m)",
    "mu_ratio(v, y)": "s.mu_ratio(v, y)",
    "evaluate, v0 and y0 arrays": "s.evaluate(**many)",
    "evaluate, gradient=True": "s.evaluate(**many, gradient=True)",
}


def calls(points: int, quick: bool) -> str:
    rng = np.random.default_rng(0)
    n = 10_000 if quick else points
    v, y = 10.0 ** rng.uniform(-3.0, 3.0, (2, n))
    names = {"s": mumacro.open(1e-10, threads=1), "ellipk": ellipk, "v": v, "y": y, "m": rng.uniform(0.0, 1.0, n),
             "case": CASE, "many": {**CASE, "v0": 0.4 * v, "y0": 3e-6 * y}}  # fmt: skip
    tables = []
    for kind, statements, number, scale, unit in (
        ("one call", SCALARS, 2000, 1e6, "us"), (f"{n:,} points, one thread", ARRAYS, 1, 1e9 / n, "ns a point"),
    ):  # fmt: skip
        work = {name: partial(timeit.timeit, text, globals=names, number=number) for name, text in statements.items()}
        best = best_of(2 if quick else 15, work)
        tables.append(markdown([kind, f"[{unit}]"], [[name, quantity(t / number * scale)] for name, t in best.items()]))
    return "\n\n".join([f"Table 1e-10, kernel of the level {mumacro.library.kernels[-1].level}.", *tables])


if __name__ == "__main__":
    main(__doc__, {"calls": calls}, points=1_000_000, quick=False)

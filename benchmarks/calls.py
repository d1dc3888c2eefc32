"""Time of one call: scalars of every type, small arrays, large arrays a point; beside scipy's elliptic integral."""

from __future__ import annotations

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
    "evaluate, an int and a np.float64": "s.evaluate(**{**case, 'Fz': 10, 'v0': number})",
    "evaluate, f in place of omega": "s.evaluate(mu0=0.3, Fz=10.0, k=1e6, y0=2e-6, f=2e4, v0=0.01)",
    "evaluate, k=None (rigid)": "s.evaluate(**{**case, 'k': None})",
    "evaluate, gradient=True": "s.evaluate(**case, gradient=True)",
    "mu_ratio, arrays of 1": "s.mu_ratio(v[:1], y[:1])",
    "mu_ratio, arrays of 100": "s.mu_ratio(v[:100], y[:100])",
    "evaluate, v0 an array of 1": "s.evaluate(**{**case, 'v0': v[:1]})",
    "evaluate, v0 an array of 100": "s.evaluate(**{**case, 'v0': v[:100]})",
}
ARRAYS = {
    "scipy.special.ellipk(m), for comparison": "ellipk(m)",
    "mu_ratio(v, y)": "s.mu_ratio(v, y)",
    "power(v, y)": "s.power(v, y)",
    "stick_fraction(v, y)": "s.stick_fraction(v, y)",
    "slopes(v, y)": "s.slopes(v, y)",
    "evaluate, v0 and y0 arrays": "s.evaluate(**many)",
    "evaluate, gradient=True": "s.evaluate(**many, gradient=True)",
}


def calls(points: int, quick: bool) -> str:
    """The two tables."""
    rng = np.random.default_rng(0)
    n = 10_000 if quick else points
    v, y = 10.0 ** rng.uniform(-3.0, 3.0, (2, n))
    names = {
        "s": mumacro.open(1e-10, threads=1), "np": np, "ellipk": ellipk, "v": v, "y": y, "m": rng.uniform(0.0, 1.0, n),
        "case": CASE, "number": np.float64(0.01), "many": {**CASE, "v0": 0.4 * v, "y0": 3e-6 * y},
    }  # fmt: skip
    tables = []
    for kind, statements, number, scale, unit in (
        ("one call", SCALARS, 2000, 1e6, "us"), (f"{n:,} points, one thread", ARRAYS, 1, 1e9 / n, "ns a point"),
    ):  # fmt: skip
        work = {name: partial(timeit.timeit, text, globals=names, number=number) for name, text in statements.items()}
        best = best_of(2 if quick else 15, work, "processor").best
        rows = [[name, quantity(time / number * scale)] for name, time in best.items()]
        tables.append(markdown([kind, f"[{unit}]"], rows))
    return "\n\n".join([f"Table 1e-10, kernel of the level {mumacro.library.kernels[-1].level}.", *tables])


if __name__ == "__main__":
    main(__doc__, {"calls": calls}, points=1_000_000, quick=False)

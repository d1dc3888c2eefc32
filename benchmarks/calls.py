"""Time of one call, a point of large arrays, and a new process; beside scipy's elliptic integral
and numpy."""

from benchmarks.measuring import ROOT, best_of, main, markdown, quantity  # isort: split

import statistics
import subprocess
import sys
import timeit
from functools import partial
from time import perf_counter

import numpy as np
from scipy.special import ellipk

import mumacro
from tests.serving import CASE

SCALARS = {
    "scipy.special.ellipk(m), for comparison": "ellipk(0.5)",
    "mu_ratio(v, y)": "s.mu_ratio(0.1, 0.5)",
    "evaluate, floats": "s.evaluate(**case)",
    "evaluate, gradient=True": "s.evaluate(**case, gradient=True)",
    "evaluate, k from a tenth to ten times": "s.evaluate(**soft, k_range=near)",
    "evaluate, k from 1e-300 to 1e300": "s.evaluate(**soft, k_range=(1e-300, 1e300))",
    "the same, a ball": "s.evaluate(**soft, k_range=(1e-300, 1e300), contact='ball')",
}
ARRAYS = {
    "scipy.special.ellipk(m), for comparison": "ellipk(m)",
    "mu_ratio(v, y)": "s.mu_ratio(v, y)",
    "evaluate, v0 and y0 arrays": "s.evaluate(**many)",
    "evaluate, gradient=True": "s.evaluate(**many, gradient=True)",
}
PROCESSES = {
    "`import numpy`, for comparison": "import numpy",
    "`import mumacro`": "import mumacro",
    "one case, `s.evaluate(...)`": f"import mumacro; mumacro.open().evaluate(**{CASE})",
}


def started(program: str) -> float:
    """Seconds from the start of a process to its end."""
    begun = perf_counter()
    subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=True)
    return perf_counter() - begun


def processes(quick: bool) -> str:
    rounds = range(1 if quick else 5)
    rows = [
        [name, quantity(statistics.median(started(text) for _ in rounds))]
        for name, text in PROCESSES.items()
    ]
    return markdown(["a new process, median of 5", "[s]"], rows)


def calls(points: int, quick: bool) -> str:
    rng = np.random.default_rng(0)
    n = 10_000 if quick else points
    v, y = 10.0 ** rng.uniform(-3.0, 3.0, (2, n))
    names = {
        "s": mumacro.open(1e-10, threads=1),
        "ellipk": ellipk,
        "v": v,
        "y": y,
        "m": rng.uniform(0.0, 1.0, n),
        "case": CASE,
        "soft": {name: x for name, x in CASE.items() if name != "k"},
        "near": (0.1 * CASE["k"], 10.0 * CASE["k"]),
        "many": {**CASE, "v0": 0.4 * v, "y0": 3e-6 * y},
    }
    tables = []
    for kind, statements, number, scale, unit in (
        ("one call", SCALARS, 2000, 1e6, "us"),
        (f"{n:,} points, one thread", ARRAYS, 1, 1e9 / n, "ns a point"),
    ):
        work = {
            name: partial(timeit.timeit, text, globals=names, number=number)
            for name, text in statements.items()
        }
        best = best_of(2 if quick else 15, work)
        tables.append(
            markdown(
                [kind, f"[{unit}]"],
                [[name, quantity(t / number * scale)] for name, t in best.items()],
            )
        )
    said = f"Table 1e-10, kernel of the level {mumacro.library.kernels[-1].level}."
    return "\n\n".join([said, *tables, processes(quick)])


if __name__ == "__main__":
    main(__doc__, {"calls": calls}, points=1_000_000, quick=False)

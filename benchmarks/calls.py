"""Time of one call, a point of large arrays, and a new process; beside scipy's elliptic integral
and numpy."""

from tests.support.measuring import best_of, main, markdown, quantity  # isort: split

import statistics
import subprocess
import sys
import timeit
from collections.abc import Callable
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
from scipy.special import ellipk

import mumacro
from mumacro.outputs import OUTPUTS
from tests.support.places import ROOT
from tests.support.serving import CASE

SCALARS = {
    "scipy.special.ellipk(m), for comparison": "ellipk(0.5)",
    "mu_ratio(v, y)": "s.mu_ratio(0.1, 0.5)",
    "evaluate, floats": "s.evaluate(**case)",
    "evaluate, gradient=True": "s.evaluate(**case, gradient=True)",
    "evaluate, k from a tenth to ten times": "s.evaluate(**soft, **near)",
    "evaluate, k from 1e-300 to 1e300": "s.evaluate(**soft, k_low=1e-300, k_high=1e300)",
    "the same, a ball": "s.evaluate(**soft, k_low=1e-300, k_high=1e300, contact='ball')",
}
EVALUATE = "s.evaluate(**case)"
WITH_F = {name: x for name, x in CASE.items() if name != "omega"} | {"f": 20e3}
SPEEDS = np.linspace(0.001, 0.1, 100)
AMPLITUDES = np.linspace(1e-6, 4e-6, 100)


def _all(case: dict[str, float], n: int) -> dict[str, object]:
    return {**{name: np.full(n, x) for name, x in case.items()}, "v0": SPEEDS[:n]}


#: by name: the call, and its inputs
SMALL: dict[str, tuple[str, dict[str, object]]] = {
    "`mu_ratio(v, y)`": ("s.mu_ratio(0.1, 0.5)", {}),
    "`evaluate` of floats": (EVALUATE, CASE),
    "of numpy's float64": (EVALUATE, {name: np.float64(x) for name, x in CASE.items()}),
    "of numpy's float32": (EVALUATE, {name: np.float32(x) for name, x in CASE.items()}),
    "of an array of one, `v0`": (EVALUATE, {**CASE, "v0": SPEEDS[:1]}),
    "of six arrays of one": (EVALUATE, _all(CASE, 1)),
    "the same, `f` for `omega`": (EVALUATE, _all(WITH_F, 1)),
    "of arrays of 100, `v0` and `y0`": (EVALUATE, {**CASE, "v0": SPEEDS, "y0": AMPLITUDES}),
    "of six arrays of 100": (EVALUATE, _all(CASE, 100)),
    "the same, `f` for `omega`, of 100": (EVALUATE, _all(WITH_F, 100)),
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
        "near": {"k_low": 0.1 * CASE["k"], "k_high": 10.0 * CASE["k"]},
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
    caption = f"Table 1e-10, kernel of the level {mumacro.kernel.binding.kernels[-1].level}."
    return "\n\n".join([caption, *tables, processes(quick)])


def small(points: int, quick: bool) -> str:  # noqa: ARG001
    """Small calls beside scipy's elliptic integral of one number, in turn with it; the least of
    many."""
    s = mumacro.open(1e-10, threads=1)
    statements = {"`scipy.special.ellipk(0.5)`": ("ellipk(0.5)", {}), **SMALL}
    timers = {
        name: timeit.Timer(call, globals={"s": s, "ellipk": ellipk, "case": case})
        for name, (call, case) in statements.items()
    }
    number = 100
    least = dict.fromkeys(timers, float("inf"))
    for _ in range(5 if quick else 400):
        for name, timer in timers.items():
            least[name] = min(least[name], timer.timeit(number) / number)
    reference = next(iter(least.values()))
    rows = [[name, quantity(1e6 * t), f"{t / reference:.1f}"] for name, t in least.items()]
    return markdown(["one call", "[us]", "times ellipk"], rows)


#: places that cost more than most: v~, y~
FAR = {
    "y~ = 1e3, v~ = 0.1": (0.1, 1e3),
    "y~ = 130,000, v~ = 0.1": (0.1, 1.3e5),
    "y~ = 132,000, v~ = 0.1": (0.1, 1.32e5),
    "y~ = 1e8, v~ = 1e3": (1e3, 1e8),
    "y~ = 1, v~ = 1e-2": (1e-2, 1.0),
    "y~ = 1, v~ = 1e-4": (1e-4, 1.0),
    "y~ = 1, v~ = 1e-6": (1e-6, 1.0),
    "y~ = 1, v~ = 1e-300": (1e-300, 1.0),
    "y~ = 1.1, v~ = 1e-6": (1e-6, 1.1),
}


def far_end(points: int, quick: bool) -> str:  # noqa: ARG001
    """`mu_ratio` of equal points, beside the median over places from 1e-3 to 1e3."""
    s, n = mumacro.open(1e-10, threads=1), 200 if quick else 2000
    rng = np.random.default_rng(0)
    places = {str(i): tuple(10.0 ** rng.uniform(-3.0, 3.0, 2)) for i in range(20 if quick else 200)}
    work = {
        name: partial(s.mu_ratio, np.full(n, v), np.full(n, y))
        for name, (v, y) in {**places, **FAR}.items()
    }
    best = best_of(2 if quick else 7, work)
    usual = statistics.median(best[name] for name in places)
    rows = [["median", quantity(1e9 * usual / n), "1"]]
    rows += [[name, quantity(1e9 * best[name] / n), f"{best[name] / usual:.1f}"] for name in FAR]
    return markdown(["place", "ns a point", "medians"], rows)


def outputs(points: int, quick: bool) -> str:
    """Every output of ``include`` beside the calls that it is made of, for one thread: the time of
    the answer with the output over that of its parts."""
    s = mumacro.open(1e-10, threads=1)
    rng = np.random.default_rng(0)
    n = 10_000 if quick else min(points, 200_000)
    v, y = 10.0 ** rng.uniform(-3.0, 3.0, (2, n))
    unit = CASE["mu0"] * CASE["Fz"] / CASE["k"]
    many = {**CASE, "v0": unit * CASE["omega"] * v, "y0": unit * y}
    spreads = {"std_k": 1e5, "std_v0": 1e-4}

    def crit() -> None:
        s.evaluate({**many, "v0": unit * CASE["omega"] * s.v_tilde_crit(y)})

    plain = partial(s.evaluate, many)
    at_rest = partial(s.evaluate, {**many, "v0": 0.0})
    with_groups = partial(s.evaluate, many, include="groups")
    gradient = partial(s.evaluate, many, gradient=True)
    parts: dict[str, list[Callable[[], object]]] = {
        "groups": [with_groups],
        "limits": [with_groups, at_rest, crit],
        "gradient": [gradient],
        "std": [
            gradient,
            lambda: [np.hypot(v, y) for _ in range(10)],
            lambda: [plain() for _ in range(2 * len(spreads))],
        ],
        "stick_fraction": [with_groups, partial(s.quantity, "stick_fraction", v, y)],
        "power": [with_groups, partial(s.quantity, "power", v, y)],
        "settling": [
            with_groups,
            partial(s.quantity, "mu_ratio", v, y),
            partial(s.quantity, "power", v, y),
            partial(s.quantity, "stick_fraction", v, y),
        ],
    }
    parts = {name: parts[name] for name in OUTPUTS}  # none is left out
    work = {f"{name} {i}": part for name, some in parts.items() for i, part in enumerate(some)}
    for name in parts:
        options: Any = spreads if name == "std" else {"include": (name,)}
        work[name] = partial(s.evaluate, many, **options)
    best = best_of(2 if quick else 9, {"plain": plain, **work})
    rows = []
    for name, some in parts.items():
        together = sum(best[f"{name} {i}"] for i in range(len(some)))
        ratios = best[name] / best["plain"], best[name] / together
        rows.append([name, quantity(1e9 * best[name] / n), *(f"{ratio:.2f}" for ratio in ratios)])
    return markdown(["answer with", "ns a case", "times mu_macro alone", "times its parts"], rows)


if __name__ == "__main__":
    sections = {"calls": calls, "small": small, "far_end": far_end, "outputs": outputs}
    main(__doc__, sections, points=1_000_000, quick=False)

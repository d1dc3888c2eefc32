"""Cost of the inverse problem:  python benchmarks/inverse.py [TABLE] [--rounds N] [--quick] [--write]

The same roots by four methods, all on the same surrogate, in processor time:

* ``solve_for``: sampled once, then bracketed Newton steps with the gradient, all targets at once; every root with the
  interval that follows from the error bound;
* bisection of the bits of the input, all targets at once: the earlier method of ``solve_for``, with its intervals;
* ``scipy.optimize.brentq``, target by target, within one decade on either side of the root; roots only;
* the same with ``scipy.optimize.newton`` and the gradient, starting one percent from the root.

``--write`` writes the table to docs/benchmarks.md.
"""

from __future__ import annotations

import argparse

from measuring import ROOT, best_of, machine, markdown, quantity, write_section  # isort: skip

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, newton

from mumacro import Surrogate
from mumacro.inverse import solve_for
from mumacro.inverse.rootfinding import Sweep, last_double

CASE: dict[str, float] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
COUNTS = (1, 100, 10_000)


def by_bits(surrogate: Surrogate, unknown: str, targets: NDArray[np.float64], rising: bool) -> NDArray[np.float64]:
    """Root, lower and upper end (3, n) by bisection of bits, the old method of ``solve_for`` for v0, y0 and omega."""
    sweep = Sweep(surrogate, {name: value for name, value in CASE.items() if name != unknown}, unknown)
    sign = 1.0 if rising else -1.0
    low, high = np.zeros(targets.size), np.full(targets.size, np.finfo(float).max)

    def reach(level: NDArray[np.float64]) -> NDArray[np.float64]:
        def below(x: NDArray[np.float64]) -> NDArray[np.bool_]:
            found: NDArray[np.bool_] = sign * sweep.mu(x) < sign * level[:, None]
            return found

        return last_double(below, low, high)[1]

    value = reach(targets)
    bound = sign * np.asarray(sweep.answer(value).error_bound)
    return np.array([value, reach(targets - bound), reach(targets + bound)])


def by_scipy(surrogate: Surrogate, unknown: str, targets: NDArray[np.float64], slope: bool) -> list[float]:
    """The roots, one after the other, by Brent's or Newton's method in the logarithm of the unknown."""
    start = math.log(CASE[unknown])

    def miss(t: float, target: float) -> float:
        return float(surrogate.evaluate(**{**CASE, unknown: math.exp(t)}).mu_macro) - target

    def rate(t: float, _target: float) -> float:
        gradient = surrogate.evaluate(**{**CASE, unknown: math.exp(t)}, gradient=True).gradient
        return math.exp(t) * float((gradient or {})[unknown])

    if slope:
        found = [newton(miss, start + 0.01, rate, args=(target,), tol=1e-15, rtol=1e-14) for target in targets.tolist()]
    else:
        decade = math.log(10.0)
        found = [
            brentq(miss, start - decade, start + decade, args=(target,), xtol=1e-15, rtol=1e-14)
            for target in targets.tolist()
        ]
    return [math.exp(t) for t in found]


def rows(surrogate: Surrogate, rounds: int, counts: tuple[int, ...]) -> tuple[list[list[str]], str]:
    """The rows of the table, and a note on the clock."""
    written, note = [], ""
    middle = float(surrogate.evaluate(**CASE).mu_macro)
    for unknown, rising in (("v0", True), ("y0", False), ("k", False)):
        known = {name: value for name, value in CASE.items() if name != unknown}
        for count in counts:
            targets = middle * np.linspace(0.99, 1.01, count) if count > 1 else np.array([middle])
            work = {"newton": lambda u=unknown, t=targets, c=known: solve_for(surrogate, u, t, c)}
            if unknown != "k":  # mu_macro may fold along k; the old method also sampled it; only the roots are compared
                work["bits"] = lambda u=unknown, t=targets, r=rising: by_bits(surrogate, u, t, r)
            if count < COUNTS[-1]:
                work["brentq"] = lambda u=unknown, t=targets: by_scipy(surrogate, u, t, slope=False)
                work["scipy newton"] = lambda u=unknown, t=targets: by_scipy(surrogate, u, t, slope=True)
            timed = best_of(rounds, work, "processor")
            note = timed.note()
            own = timed.best["newton"]
            others = []
            for name in ("bits", "brentq", "scipy newton"):
                seconds = timed.best.get(name)
                others += ["-", "-"] if seconds is None else [quantity(1e3 * seconds), f"{seconds / own:.1f}"]
            written.append([unknown, f"{count:,}", quantity(1e3 * own), *others])
    return written, note


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("table", nargs="?", type=Path, default=ROOT / "tables" / "mumacro-1e-10.nc")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--quick", action="store_true", help="leave out the many targets")
    parser.add_argument("--write", action="store_true")
    chosen = parser.parse_args()
    surrogate = Surrogate.open(chosen.table, threads=1)
    found, note = rows(surrogate, chosen.rounds, COUNTS[:2] if chosen.quick else COUNTS)
    header = [
        "unknown", "targets", "solve_for [ms]", "bits [ms]", "times", "brentq [ms]", "times", "scipy newton [ms]",
        "times",
    ]  # fmt: skip
    text = f"{markdown(header, found)}\n\n{note} {machine('scipy')}"
    print(text)
    if chosen.write:
        write_section("inverse", text)


if __name__ == "__main__":
    main()

"""Cost of the inverse problem:  python benchmarks/inverse.py [--rounds N] [--quick] [--write]

The same roots by three methods, all on the same surrogate, in processor time:

* ``solve_for``: sampled once, then bracketed Newton steps with the gradient, all targets at once; every root with the
  interval that follows from the error bound;
* ``scipy.optimize.brentq``, target by target, within one decade on either side of the root; roots only;
* the same with ``scipy.optimize.newton`` and the gradient, starting one percent from the root.
"""

from __future__ import annotations

from benchmarks.measuring import best_of, main, markdown, quantity  # isort: split

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, newton

from mumacro import Surrogate
from mumacro.inverse import solve_for
from tests.serving import CASE

COUNTS = (1, 100, 10_000)


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


def inverse(rounds: int, quick: bool) -> str:
    """Milliseconds of all targets at once, and of scipy one by one."""
    surrogate = Surrogate.open(1e-10, threads=1)
    written, note = [], ""
    middle = float(surrogate.evaluate(**CASE).mu_macro)
    for unknown in ("v0", "y0", "k"):
        known = {name: value for name, value in CASE.items() if name != unknown}
        for count in COUNTS[:2] if quick else COUNTS:
            targets = middle * np.linspace(0.99, 1.01, count) if count > 1 else np.array([middle])
            work: dict[str, Callable[[], object]] = {
                "solve_for": partial(solve_for, surrogate, unknown, targets, known)
            }
            if count < COUNTS[-1]:
                work["brentq"] = partial(by_scipy, surrogate, unknown, targets, slope=False)
                work["scipy newton"] = partial(by_scipy, surrogate, unknown, targets, slope=True)
            timed = best_of(rounds, work, "processor")
            note, own = timed.note(), timed.best["solve_for"]
            others = [
                text
                for name in ("brentq", "scipy newton")
                for text in (
                    [quantity(1e3 * timed.best[name]), f"{timed.best[name] / own:.1f}"] if name in work else "--"
                )
            ]
            written.append([unknown, f"{count:,}", quantity(1e3 * own), *others])
    header = ("unknown", "targets", "solve_for [ms]", "brentq [ms]", "times", "scipy newton [ms]", "times")
    return f"{markdown(header, written)}\n\n{note}"


if __name__ == "__main__":
    main(__doc__, {"inverse": inverse}, rounds=5, quick=False)

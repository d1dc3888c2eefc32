"""Range of each limit of the model.

python benchmarks/model_facts.py [--write]
"""

from tests.support.measuring import main, markdown, quantity, sections  # isort: split

import math
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from benchmarks.validation import interpolant, orbit
from builder.solver.steady import border, solve
from mumacro import closed_forms


def limits() -> str:
    """The border, and its constant at large amplitudes."""
    rows = []
    for y in (1e-3, 1e-2, 0.1, 0.3, 1.0, 10.0, 1e2, 1e3, 1e4, 1e5):
        crit, mu = border(y)
        rows.append(
            [f"{y:g}", f"{crit:.9e}", f"{mu:.9f}", f"{y / crit**2:.6f}" if y >= 1.0 else "-"]
        )
    return markdown(("y~", "v~crit", "mu~ there", "y~/v~crit^2"), rows, 0)


def _creep_factor(y: float) -> float:
    """C(y~) = lim mu~/v~ for y~ > 1, from X' = 1 in stick and X' = 1 - y~ sin(sigma) X in slip."""
    stick = math.acos(1.0 - 2.0 / y)

    def rates(sigma: float, x: Any) -> list[float]:
        """What is left of a value at the start of slip, what is driven since, and the integrals of
        both."""
        decay = y * math.sin(sigma)
        return [-decay * x[0], 1.0 - decay * x[1], x[0], x[1]]

    run = solve_ivp(
        rates, (stick, math.pi), [1.0, 0.0, 0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-14
    )
    memory, driven, of_start, of_drive = run.y[:, -1]
    start = (memory * stick + driven) / (1.0 - memory)
    return float((stick * (start + 0.5 * stick) + (start + stick) * of_start + of_drive) / math.pi)


def creep() -> str:
    """The slope of mu~ in v~ at v~ = 0."""
    rows = []
    for y in (0.1, 0.5, 0.9):
        slopes = [
            (solve(v, y).mu_ratio - float(closed_forms.static_limit(y))) / v for v in (4e-8, 1e-8)
        ]
        # without the next term, which is proportional to sqrt(v~)
        measured = 2.0 * slopes[1] - slopes[0]
        rows.append([f"{y:g}", f"{math.pi / (2.0 * (1.0 - y * y)):.6f}", f"{measured:.4f}"])
    rows += [
        [f"{y:g}", f"{_creep_factor(y):.6f}", f"{solve(1e-13, y).mu_ratio / 1e-13:.4f}"]
        for y in (1.1, 2.0, 10.0)
    ]
    return markdown(("y~", "slope derived", "slope solved"), rows, 0)


def contact() -> str:
    """How stick-slip approaches the continuous orbit, continued below the border."""
    y = 1.0
    crit = border(y)[0]
    rows = []
    for gap in (1e-2, 1e-3, 1e-4, 1e-5):
        v = crit * (1.0 - gap)
        tau, theta, lam = orbit(v, y)
        at, i = interpolant(lam), int(np.argmin(lam))
        low = float(brentq(at, tau[i] - 0.05, tau[i] + 0.05, args=(1,), xtol=1e-14))
        predicted = 3.0 * math.sqrt(-2.0 * at(low, 0) / at(low, 2)) / math.pi
        full = solve(v, y)
        more = (full.mu_ratio - float(np.cos(theta).mean())) / gap**2
        stick = full.stick_fraction
        rows.append([f"{gap:.0e}", f"{stick:.6f}", f"{stick / predicted:.5f}", f"{more:.3f}"])
    header = (
        "1 - v~/v~crit",
        "stick fraction",
        "over (3/pi) sqrt(2 e/lam'')",
        "(mu~ - continued)/(1 - v~/v~crit)^2",
    )
    return markdown(header, rows, 0)


def next_terms() -> str:
    """Eqs. (31) and (35) with one more term, and E."""
    fast, y = 100.0, 2.0
    first = float(closed_forms.outer(y / fast)) - solve(fast, y).mu_ratio
    both = first + float(closed_forms.second_order(y / fast)) / (fast * fast)
    off = f"{quantity(abs(first))}, with the second term by {quantity(abs(both))}"
    rows = []
    for v in (0.1, 0.5, 1.0, 3.0):
        y = 0.1
        deficit = solve(v, y).deficit
        first = y * y / (4.0 * (1.0 + v * v))
        second = (5.0 + 9.0 * v * v) / (64.0 * (1.0 + v * v) ** 3)
        blend = -(float(closed_forms.continuous(v, y)) - 1.0) - deficit
        cells = [f"{(first - deficit) / y**4:.6f}", f"{second:.6f}", f"{-blend / y**4:.6f}"]
        rows.append([f"{v:g}", *cells, f"{1.0 / (16.0 * (1.0 + v * v) ** 3):.6f}"])
    header = ("v~", "(mu~ - (31))/y~^4", "derived", "(E - mu~)/y~^4", "derived")
    text = (
        f"At v~ = {fast:g}, y~ = 2 (35) is off by {off}. At y~ = 0.1, solved; both differ from "
        "the derived terms by "
    )
    return f"{text}O(y~^2):\n\n{markdown(header, rows, 0)}"


SECTIONS = sections(limits, creep, contact, next_terms)

if __name__ == "__main__":
    main(__doc__, SECTIONS)

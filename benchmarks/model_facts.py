"""Range of each limit of the model.

python benchmarks/model_facts.py [--write]
"""

from benchmarks.measuring import FINEST, main, markdown, sections  # isort: split

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from benchmarks.hard_cases import g
from benchmarks.validation import orbit
from builder.steady import border, solve
from mumacro import Surrogate, closed_forms
from mumacro.charts import SOURCES

Array = NDArray[np.float64]


def limits() -> str:
    """The border, and its constant at large amplitudes."""
    rows = []
    for y in (1e-3, 1e-2, 0.1, 0.3, 1.0, 10.0, 1e2, 1e3, 1e4, 1e5):
        crit, mu = border(y)
        rows.append([f"{y:g}", f"{crit:.9e}", f"{mu:.9f}", f"{y / crit**2:.6f}" if y >= 1.0 else "-"])
    return markdown(("y~", "v~crit", "mu~ there", "y~/v~crit^2"), rows, 0)


def outer() -> str:
    """Eq. (35) alone, with the second term, and resummed, at large v~."""
    s = Surrogate.open(FINEST)
    rows = []
    for v, y in ((100.0, 0.1), (100.0, 2.0), (100.0, 3.0), (1000.0, 30.0), (1000.0, 300.0), (1e4, 1e4), (1e5, 1e6)):
        mu = solve(v, y).mu_ratio
        first = float(closed_forms.outer(y / v))
        both = first + float(closed_forms.second_order(y / v)) / (v * v)
        (here,), _, (source,) = s.ratio_with_bound(np.array([v]), np.array([y]))
        rows.append([f"{v:g}", f"{y:g}", SOURCES[int(source)], *(g(abs(x - mu)) for x in (first, both, float(here)))])
    header = ("v~", "y~", "source", "eq. (35)", "with the second term", "surrogate")
    return f"Absolute errors against the solver:\n\n{markdown(header, rows, 3)}"


def _turn(kappa: float) -> tuple[float, float]:
    """The turn of eq. (25) in s = (tau - pi/2) sqrt(y~): integral of u_x minus its slow value, smallest slip speed."""
    far = 60.0 + 30.0 * kappa

    def rates(s: float, state: Array) -> list[float]:
        theta = state[0]
        return [-kappa * math.sin(theta) - s * math.cos(theta), math.cos(theta) - kappa / math.hypot(kappa, s)]

    # the slow angle and its first correction, from a point where the start value decays at once
    start = math.atan2(far, kappa) + kappa / math.hypot(kappa, far) ** 3
    run = solve_ivp(rates, (-far, far), [start, 0.0], method="DOP853", rtol=1e-12, atol=1e-13, dense_output=True)
    s = np.linspace(0.0, 4.0, 40_001)
    theta = run.sol(s)[0]  # type: ignore[misc]
    return float(run.y[1, -1]), float((kappa * np.cos(theta) - s * np.sin(theta)).min())


def layer() -> str:
    """The remainder after the outer solution at large y~."""
    rows = []
    for kappa in (0.1, 0.3, 0.47, 1.0, 3.0, 10.0):
        v, r = 1e7 * kappa, 1e7 / kappa
        turn = f"{_turn(kappa)[0] / (math.pi * kappa):.4g}" if kappa > 0.4766 else "-"
        rows.append([f"{kappa:g}", f"{(solve(v, 1e14).mu_ratio - float(closed_forms.outer(r))) * r:.9f}", turn])
    header = ("v~/sqrt(y~)", "T at y~ = 1e14", "T by (25)")
    edge = float(brentq(lambda kappa: _turn(kappa)[1], 0.45, 0.5, xtol=1e-10))
    text = f"The turn alone slides all the time for v~/sqrt(y~) >= {edge:.6f}: y~/v~crit^2 = {1.0 / edge**2:.5f}."
    return f"{markdown(header, rows, 0)}\n\n{text}"


def _creep_factor(y: float) -> float:
    """C(y~) = lim mu~/v~ for y~ > 1, from X' = 1 in stick and X' = 1 - y~ sin(sigma) X in slip, by quadrature."""
    stick = math.acos(1.0 - 2.0 / y)

    def path(sigma: float) -> float:
        return y * (math.cos(stick) - math.cos(sigma))

    total = path(math.pi)
    pushed = quad(lambda s: math.exp(path(s) - total), stick, math.pi, epsabs=1e-13)[0]
    start = (math.exp(-total) * stick + pushed) / -math.expm1(-total)
    sliding = quad(lambda s: (start + stick) * math.exp(-path(s)), stick, math.pi, epsabs=1e-13)[0]

    # the part driven since slip began, with exchanged integrals
    def inner(s: float) -> float:
        return float(quad(lambda t: math.exp(path(s) - path(t)), s, math.pi, epsabs=1e-12)[0])

    driven = quad(inner, stick, math.pi, epsabs=1e-11)[0]
    return (stick * (start + 0.5 * stick) + sliding + driven) / math.pi


def creep() -> str:
    """The slope of mu~ in v~ at v~ = 0."""
    rows = []
    for y in (0.1, 0.5, 0.9):
        slopes = [(solve(v, y).mu_ratio - float(closed_forms.static_limit(y))) / v for v in (4e-8, 1e-8)]
        measured = 2.0 * slopes[1] - slopes[0]  # without the next term, which is proportional to sqrt(v~)
        rows.append([f"{y:g}", f"{math.pi / (2.0 * (1.0 - y * y)):.6f}", f"{measured:.4f}"])
    rows += [[f"{y:g}", f"{_creep_factor(y):.6f}", f"{solve(1e-13, y).mu_ratio / 1e-13:.4f}"] for y in (1.1, 2.0, 10.0)]
    return markdown(("y~", "slope derived", "slope solved"), rows, 0)


def contact() -> str:
    """How stick-slip approaches the continuous orbit, continued below the border."""
    y = 1.0
    crit = border(y)[0]
    rows = []
    for gap in (1e-2, 1e-3, 1e-4, 1e-5):
        v = crit * (1.0 - gap)
        tau, theta, lam = orbit(v, y)
        k = np.fft.fftfreq(tau.size, 1.0 / tau.size)
        waves = np.fft.fft(lam) / tau.size

        def at(t: float, order: int, k: Any = k, waves: Any = waves) -> float:
            return float((waves * (1j * k) ** order * np.exp(1j * k * t)).sum().real)

        i = int(np.argmin(lam))
        low = float(brentq(at, tau[i] - 0.05, tau[i] + 0.05, args=(1,), xtol=1e-14))
        predicted = 3.0 * math.sqrt(-2.0 * at(low, 0) / at(low, 2)) / math.pi
        full = solve(v, y)
        more = (full.mu_ratio - float(np.cos(theta).mean())) / gap**2
        stick = full.stick_fraction
        rows.append([f"{gap:.0e}", f"{stick:.6f}", f"{stick / predicted:.5f}", f"{more:.3f}"])
    header = ("1 - v~/v~crit", "stick fraction", "over (3/pi) sqrt(2 e/lam'')", "(mu~ - continued)/(1 - v~/v~crit)^2")
    return markdown(header, rows, 0)


def next_terms() -> str:
    """Eqs. (31) and (35) with one more term, and E."""
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
    return f"y~ = 0.1, solved; both differ from the derived terms by O(y~^2):\n\n{markdown(header, rows, 0)}"


SECTIONS = sections(limits, outer, layer, creep, contact, next_terms)

if __name__ == "__main__":
    main(__doc__, SECTIONS)

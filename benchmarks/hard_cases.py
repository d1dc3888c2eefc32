"""Errors of straightforward code where the function is singular, and of the methods used instead.

    python benchmarks/hard_cases.py [--write]

Each case computes the naive number too.
"""

from tests.support.measuring import main, markdown, progress, quantity, sections  # isort: split

import math
from collections.abc import Callable

import mpmath
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from benchmarks.solver import march
from benchmarks.validation import interpolant, orbit, reference
from builder.solver.sections import COS_0, DURATION, SIGMA_0, SIGMA_1, SIN_0, stick_slip
from builder.solver.slip import FALL, OK, SIGMA, STEPS, SUM_UX, slip
from builder.solver.steady import border, continuous, solve, workspace
from builder.solver.stick import stick_excess
from mumacro import closed_forms
from mumacro.table.polynomials import chebyshev_coefficients, interpolation_matrix, nodes

Array = NDArray[np.float64]
HALF = 0.5 * math.pi


def grazing() -> str:
    """Short windows of stick just below the border."""
    y = 1.0
    crit, _ = border(y)
    rows = []
    for gap in (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8):
        v = crit * (1.0 - gap)
        at, full = interpolant(orbit(v, y)[2]), solve(v, y)
        negative = sum(at(tau) < 0.0 for tau in np.linspace(0.0, math.pi, 101))
        rows.append(
            [
                f"{gap:.0e}",
                str(negative),
                f"{full.min_slip_speed:.1e}",
                f"{full.stick_fraction:.3e}",
            ]
        )
    header = ("1 - v~/v~crit", "of 101 samples below 0", "smallest lam", "stick fraction, solved")
    return f"y~ = 1, lam along the orbit that slides all the time:\n\n{markdown(header, rows)}"


def hinted(v: float, y: float, w: Array, out: Array, orbit: Array) -> None:
    """The cycle with stick, from the orbit that slides all the time where there is one."""
    hint = out[FALL] if continuous(v, y, w, out) == OK else math.nan
    stick_slip(v, y, y - 1.0, hint, w, out, orbit)


def surplus() -> str:
    """The error from the poorly known end of slip if the surplus is not removed."""
    w, out, orbit, _ = workspace()
    errors = []
    for v, y, mu in reference("border"):
        full = solve(v, y)
        if full.regime == "stick_slip":
            hinted(v, y, w, out, orbit)
            naive = (
                orbit[DURATION] * (orbit[COS_0] + 0.5 * v * orbit[DURATION]) + out[SUM_UX]
            ) / math.pi
            errors.append(
                (
                    abs(out[SIGMA] - orbit[SIGMA_0]),
                    abs(naive - mu) / mu,
                    abs(full.mu_ratio - mu) / mu,
                )
            )
    spread, lost, solved = map(max, zip(*errors, strict=True))
    head = (
        "points below the border",
        "slip and stick miss half a period by",
        "mu~ off by",
        "surplus taken out",
    )
    return markdown(head, [[str(len(errors)), quantity(spread), quantity(lost), quantity(solved)]])


def double_root() -> str:
    """|u|^2 - 1 shortly after slip has stopped."""
    v, y = 0.1, 0.5
    w, out, orbit, _ = workspace()
    stick_slip(v, y, y - 1.0, math.nan, w, out, orbit)
    x0 = math.atan2(orbit[SIN_0], orbit[COS_0])
    s0 = math.asin(v * math.cos(x0) / (y * math.sin(x0)))
    rows = []
    for d in (1e-1, 1e-3, 1e-5, 1e-7, 1e-8):
        ux = math.cos(x0) + v * d
        uy = math.sin(x0) + y * (math.cos(s0 + d) - math.cos(s0))
        naive = ux * ux + uy * uy - 1.0
        ours = stick_excess(v, y, y - 1.0, x0, 0, s0, s0 + d - math.pi, d) * d * d
        with mpmath.workdps(60):
            th, dd = mpmath.mpf(x0), mpmath.mpf(d)
            # at the onset lam = 0 determines sigma0 from th0
            at = mpmath.asin(mpmath.mpf(v) * mpmath.cos(th) / (mpmath.mpf(y) * mpmath.sin(th)))
            a = mpmath.cos(th) + v * dd
            b = mpmath.sin(th) + y * (mpmath.cos(at + dd) - mpmath.cos(at))
            exact = float(a * a + b * b - 1)
        off = (quantity(abs(one / exact - 1.0)) for one in (naive, ours))
        rows.append([f"{d:.0e}", f"{exact:.6e}", f"{naive:.6e}", *off])
    header = (
        "time since the onset",
        "exact",
        "naive",
        "its rel error",
        "rel error, root divided out",
    )
    return f"v~ = {v}, y~ = {y}:\n\n{markdown(header, rows)}"


def creep() -> str:
    """Cycles that marching needs as v~ falls, and the remaining error when two cycles agree."""
    rows = []
    for v, y in ((1.0, 0.1), (0.1, 0.1), (0.01, 0.1), (0.01, 0.5), (0.001, 0.5)):
        progress(f"marching at v~ = {v:g}, y~ = {y:g}")
        marched, full = march(v, y), solve(v, y)
        cycles = f"{marched.cycles}" + ("" if marched.agreed else " *")
        off = quantity(abs(marched.mu_ratio - full.mu_ratio))
        rows.append([f"{v:g}", f"{y:g}", full.regime.replace("_", "-"), cycles, off])
    text = markdown(("v~", "y~", "regime", "cycles", "error when it stops"), rows, 3)
    here = max(abs(solve(v, y).mu_ratio - mu) / mu for v, y, mu in reference("creep"))
    return (
        f"{text}\n\nThe solver here, at the reference points of creep: max rel error "
        f"{quantity(here)}."
    )


def _corner(radius: Array, psi: Array) -> tuple[Array, Array, Array]:
    """v~, eta = y~ - 1 and phi in polar coordinates of the normal form."""
    phi, s0 = radius * np.sin(psi) / math.sqrt(2.0), math.sqrt(2.0) * radius * np.cos(psi)
    return phi * s0 * s0 / (2.0 * math.pi), 0.25 * s0 * s0 - 0.5 * phi * phi, phi


def _solved(v: Array, eta: Array) -> Array:
    one = np.vectorize(
        lambda a, b: solve(float(a), 1.0 + float(b), float(b)).mu_ratio, otypes=[np.float64]
    )
    out: Array = one(v, eta)
    return out


def exact_eta() -> str:
    """y~ rounded next to 1."""
    rows = []
    for radius in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5):
        v, eta, _ = (float(x) for x in _corner(np.array(radius), np.array(0.25 * math.pi)))
        exact, rounded = solve(v, 1.0 + eta, eta).mu_ratio, solve(v, 1.0 + eta).mu_ratio
        rows.append([f"{radius:.0e}", f"{v:.1e}", f"{eta:.1e}", quantity(abs(rounded / exact - 1))])
    header = ("R", "v~", "y~ - 1", "rel change of mu~ by rounding y~")
    return f"psi = pi/4:\n\n{markdown(header, rows, 0)}"


def _fit_error(
    n: int,
    spans: tuple[tuple[float, float], tuple[float, float]],
    f: Callable[[Array, Array], Array],
    a: Array,
    b: Array,
    truth: Array,
) -> float:
    """Largest error at (a, b) of the n x n Chebyshev interpolant of ``f`` on the rectangle
    ``spans``."""
    grid = [nodes(n, *span) for span in spans]
    c = chebyshev_coefficients(f(grid[0][:, None], grid[1][None, :]))
    left, right = (
        interpolation_matrix(n, (2.0 * x - low - high) / (high - low))
        for x, (low, high) in zip((a, b), spans, strict=True)
    )
    return float(np.abs(np.einsum("pi,ij,pj->p", left, c, right) - truth).max())


def cusp() -> str:
    """The corner on three grids."""
    rng = np.random.default_rng(1)
    radius, psi = 0.8 * np.sqrt(rng.uniform(1e-4, 1.0, 2000)), rng.uniform(0.0, HALF, 2000)
    v, eta, phi = _corner(radius, psi)
    inside = _solved(v, eta)
    low, high = (math.log(1e-6), math.log(0.05)), (math.log(0.7), math.log(1.3))
    log_v, log_y = rng.uniform(*low, 2000), rng.uniform(*high, 2000)
    outside = _solved(np.exp(log_v), np.exp(log_y) - 1.0)

    def ratio(p: Array, s: Array) -> Array:
        return np.asarray(_solved(p * s * s / (2.0 * math.pi), 0.25 * s * s - 0.5 * p * p) / p)

    def polar(r: Array, t: Array) -> Array:
        speed, eta, root = _corner(r, t)
        return np.asarray(_solved(speed, eta) / root)

    def plain(a: Array, b: Array) -> Array:
        return _solved(np.exp(a), np.exp(b) - 1.0)

    spans, s0 = (
        ((0.0, 0.8 / math.sqrt(2.0)), (0.0, 0.8 * math.sqrt(2.0))),
        math.sqrt(2.0) * radius * np.cos(psi),
    )
    rows = []
    for n in (8, 16, 32, 64):
        progress(f"corner {n} x {n}")
        errors = (
            _fit_error(n, (low, high), plain, log_v, log_y, outside),
            _fit_error(n, spans, ratio, phi, s0, inside / phi),
            _fit_error(n, ((0.0, 0.8), (0.0, HALF)), polar, radius, psi, inside / phi),
        )
        rows.append([f"{n} x {n}", *map(quantity, errors)])
    header = (
        "Chebyshev nodes",
        "mu~ on (ln v~, ln y~)",
        "mu~/phi on (phi, s0)",
        "mu~/phi on (R, psi)",
    )
    return (
        "Largest absolute error at 2,000 random points; the two right columns over R <= 0.8, the "
        f"left one over v~ in [1e-6, 0.05], y~ in [0.7, 1.3]:\n\n{markdown(header, rows)}"
    )


def small_amplitude() -> str:
    """1 - mu~ where mu~ is almost 1."""
    v = 2.0
    rows = []
    for y in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10):
        full = solve(v, y)
        rows.append(
            [
                f"{y:.0e}",
                f"{full.deficit:.6e}",
                quantity(abs((1.0 - full.mu_ratio) / full.deficit - 1)),
            ]
        )
    header = ("y~", "1 - mu~, solved", "rel error of 1 - fl(mu~)")
    return f"v~ = {v:g}:\n\n{markdown(header, rows, 0)}"


def short_stick() -> str:
    """The time at which slip starts, measured from the far turn and from the near one."""
    w, out, orbit, _ = workspace()
    rows = []
    for y in (1e4, 1e6, 1e8, 1e10, 1e12):
        v = 0.9 * closed_forms.border_large_amplitude(y)
        hinted(v, y, w, out, orbit)
        d, cth, sth, s0, s1 = (orbit[i] for i in (DURATION, COS_0, SIN_0, SIGMA_0, SIGMA_1))
        ux, uy = cth + v * d, 2.0 * y * math.sin(s0 + 0.5 * d) * math.sin(0.5 * d) - sth
        x, chart = (-math.asin(min(ux, 1.0)), 1) if uy > 0.0 else (math.atan2(uy, ux), 0)
        slid = []
        # s1 = s0 + d - pi is measured from the far turn and rounded there
        for sigma in (s0 + d, s1 + math.pi):
            slip(v, y, sigma, -1, x, chart, HALF, True, w, out)
            slid.append(float(out[SUM_UX]))
        rows.append([f"{y:.0e}", f"{d:.2e}", quantity(abs(slid[1] / slid[0] - 1))])
    header = ("y~", "length of stick", "rel change of the slip's share of mu~, far turn")
    return f"v~ = 0.9 v~crit:\n\n{markdown(header, rows, 0)}"


def stiffness() -> str:
    """Steps in half a period at large v~."""
    rows = []
    w, out, _, _ = workspace()
    for v in (1e1, 1e2, 1e3, 1e4, 1e6):
        y = v

        def rate(sigma: float, th: Array, v: float = v, y: float = y) -> list[float]:
            return [-y * math.sin(sigma) * math.cos(th[0]) - v * math.sin(th[0])]

        explicit = "-"
        if v <= 1e4:
            run = solve_ivp(
                rate, (-HALF, HALF), [math.atan(v * y / (1 + v * v))], method="DOP853", rtol=1e-9
            )
            explicit = f"{run.t.size - 1:,}"
        continuous(v, y, w, out)
        rows.append([f"{v:.0e}", explicit, str(int(out[STEPS]))])
    return markdown(("v~ = y~", "explicit steps (DOP853, rtol 1e-9)", "steps here"), rows, 0)


SECTIONS = sections(
    grazing, surplus, double_root, creep, exact_eta, cusp, small_amplitude, short_stick, stiffness
)

if __name__ == "__main__":
    main(__doc__, SECTIONS)

"""Errors of straightforward code where the function is singular, and of the methods used instead.

    python benchmarks/hard_cases.py [--write]

Each case computes the naive number too.  The section gallery draws docs/img/hard-*.png: the true
curve, the finest table, and a cubic spline on a log grid.
"""

from tests.support.measuring import (  # isort: split
    FINEST,
    IMAGES,
    main,
    markdown,
    progress,
    quantity,
    sections,
)

import math
from collections.abc import Callable
from functools import cache, partial
from typing import Any, NamedTuple

import mpmath
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import RectBivariateSpline

from benchmarks.solver import march
from benchmarks.validation import interpolant, orbit, reference
from builder.solver.ball import Ball, Springs
from builder.solver.sections import COS_0, DURATION, SIGMA_0, SIGMA_1, SIN_0, stick_slip
from builder.solver.slip import FALL, OK, SIGMA, STEPS, SUM_UX, slip
from builder.solver.steady import border, continuous, solve, workspace
from builder.solver.stick import stick_excess
from builder.solver.sweep import Sweep
from mumacro import Surrogate, closed_forms
from mumacro.inputs.fields import BALL, SPRING, Kind
from mumacro.plotting import save
from mumacro.table import atlas
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


# --- the gallery ----------------------------------------------------------------------------------

NODES = 256  # of the log grid of the spline, along v~ and y~ from 1e-3 to 1e3


class Shown(NamedTuple):
    """One picture: points on a line through a hard place, and what is shown along it.

    ``values`` at (v~, y~): fresh solves, ours, its bound, and the spline.
    """

    title: str
    along: str  #: the axis of ``x``
    x: Array
    v: Array
    y: Array
    what: str  #: the axis of the values
    values: Callable[[Array, Array], tuple[Array, Array, Array, Array]]
    marks: tuple[float, ...] = ()  #: of ``x``, where blocks meet
    logarithmic: bool = True  #: ``x``
    many_decades: bool = False  #: the values


@cache
def _grid(ball: bool) -> RectBivariateSpline:
    """The cubic spline of scipy through solved nodes; those of a ball are of the finest table."""
    axis, x = np.geomspace(1e-3, 1e3, NODES), np.linspace(math.log(1e-3), math.log(1e3), NODES)
    if ball:
        values = _table().quantity("mu_ratio", axis[:, None], axis, **BALL.names)[0]
        return RectBivariateSpline(x, x, values)
    with Sweep(1) as sweep:
        return RectBivariateSpline(x, x, sweep.solve("full", axis[:, None], axis)["mu_ratio"])


@cache
def _table() -> Surrogate:
    return Surrogate.open(FINEST, threads=1)


def _ratio(v: Array, y: Array) -> tuple[Array, Array, Array, Array]:
    with Sweep(1) as sweep:
        truth = sweep.solve("full", v, y)["mu_ratio"]
    ours, bound, _ = _table().quantity("mu_ratio", v, y)
    return truth, ours, bound, np.asarray(_grid(ball=False).ev(np.log(v), np.log(y)))


def _deficit(v: Array, y: Array) -> tuple[Array, Array, Array, Array]:
    """1 - mu~; that of mu~ as a number of 64 bits has no digits left where y~ is small."""
    with Sweep(1) as sweep:
        truth = sweep.solve("full", v, y)["deficit"]
    ours, bound, _ = _table().quantity("mu_ratio", v, y)
    spline = _grid(ball=False).ev(np.log(v), np.log(y))
    return truth, 1.0 - ours, bound, np.asarray(1.0 - spline)


def _slope_of_ball(v: Array, y: Array) -> tuple[Array, Array, Array, Array]:
    """d mu~/d ln v~ of a ball: differences of fresh quadratures of sixth order beside ours."""
    step, weights = 2e-3, np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) / 60.0
    solved = Ball(Springs(_table()))
    truth = np.zeros_like(v)
    for k, weight in zip((-3, -2, -1, 1, 2, 3), weights, strict=True):
        at = v * math.exp(k * step) / atlas.MIDDLE
        truth += weight / step * solved.solve(at, y / atlas.MIDDLE)["mu_ratio"]
    _, ours, _, bound, _ = _table().tabulated.slopes("mu_ratio", v, y, BALL)
    return truth, ours, bound, np.asarray(_grid(ball=True).ev(np.log(v), np.log(y), dx=1))


def _shown() -> dict[str, Shown]:
    """The pictures by what is hard."""
    n, ratio = 400, r"$\tilde\mu$"
    s, one = _table(), np.ones(n)

    def on_border(y: float, rho: Array, kind: Kind = SPRING) -> Array:
        return rho * float(s.v_tilde_crit(y, **kind.names))

    around = np.linspace(0.9, 1.1, n)
    corner, creep = np.linspace(0.94, 1.1, n), np.geomspace(1e-12, 1.0, n)
    ends, small = np.geomspace(1e-9, 1e9, n), np.geomspace(1e-7, 1.0, n)
    across, far = np.geomspace(0.5, 50.0, n), np.geomspace(10.0, 1e9, n)
    fold = np.linspace(0.35, 0.65, n)
    speed, amplitude = r"$\tilde v$", r"$\tilde y$"
    to_border = r"$\tilde v/\tilde v_\mathrm{crit}$"
    return {
        "border": Shown(
            "Border: a window of stick opens",
            to_border,
            around,
            on_border(3.0, around),
            3.0 * one,
            ratio,
            _ratio,
            (1.0,),
            logarithmic=False,
        ),
        "corner": Shown(
            r"Corner: $\tilde v$ = 0.001 at $\tilde y$ = 1",
            amplitude,
            corner,
            1e-3 * one,
            corner,
            ratio,
            _ratio,
            logarithmic=False,
        ),
        "creep": Shown(
            r"Creep at $\tilde y$ = 0.5", speed, creep, creep, 0.5 * one, ratio, _ratio, (1e-3,)
        ),
        "ends": Shown(
            r"Both ends of the speed, $\tilde y$ = 2",
            speed,
            ends,
            ends,
            2.0 * one,
            ratio,
            _ratio,
            (1e-3, 1e3),
            many_decades=True,
        ),
        "small": Shown(
            r"Small amplitude, $\tilde v$ = 2",
            amplitude,
            small,
            2.0 * one,
            small,
            r"$1 - \tilde\mu$",
            _deficit,
            (1e-3,),
            many_decades=True,
        ),
        "seams": Shown(
            r"Seams of blocks along $\tilde y$, $\tilde v$ = 0.3",
            amplitude,
            across,
            0.3 * one,
            across,
            ratio,
            _ratio,
            (atlas.Y_STICK_LO, atlas.Y_CONT, atlas.Y_MID, atlas.Y_HIGH),
        ),
        "folds": Shown(
            r"A ball, where a coordinate is folded, $\tilde y$ = 0.6",
            f"{to_border} of the middle spring",
            fold,
            on_border(0.6 / atlas.MIDDLE, fold) * atlas.MIDDLE,
            0.6 * one,
            r"$\mathrm{d}\tilde\mu/\mathrm{d}\ln\tilde v$",
            _slope_of_ball,
            (0.5,),
            logarithmic=False,
        ),
        "tails": Shown(
            "Tails: half of the speed of the border",
            amplitude,
            far,
            0.5 * s.v_tilde_crit(far),
            far,
            ratio,
            _ratio,
            (1e3, atlas.Y_TAIL),
            many_decades=True,
        ),
    }


def gallery() -> str:
    """Each hard place as a picture: the true curve, the finest table, and a cubic spline on a log
    grid."""
    rows = []
    for name, shown in _shown().items():
        progress(name)
        values = shown.values(shown.v, shown.y)
        truth, ours, bound, spline = values
        draw = partial(_draw, shown, values)
        save(IMAGES / f"hard-{name}.png", draw, dpi=100, ncols=2, figsize=(9.0, 3.2))
        errors = [np.abs(x - truth).max() for x in (ours, spline)]
        numbers = (errors[0], bound.max(), errors[1])
        covered = f"{100.0 * np.mean(np.abs(ours - truth) <= bound + 4e-15 * np.abs(truth)):.0f}"
        rows.append([name, *(quantity(float(x)) for x in numbers), covered])
    header = ("picture", "largest error", "largest bound", "of the spline", "% within the bound")
    return (
        f"{_table().id} beside the cubic spline of scipy on {NODES} x {NODES} solved nodes, v~ and "
        f"y~ from 1e-3 to 1e3 in logarithms:\n\n{markdown(header, rows)}"
    )


def _draw(shown: Shown, values: tuple[Array, Array, Array, Array], panels: Any) -> None:
    truth, ours, bound, spline = values
    curve, errors = panels
    curve.plot(shown.x, truth, color="#9aa3ad", lw=5.0, label="solved anew")
    curve.plot(shown.x, spline, "--", color="#1f5fa8", lw=1.5, label="spline on a log grid")
    curve.plot(shown.x, ours, color="#c1272d", lw=1.2, label="this table")
    curve.set(title=shown.title, ylabel=shown.what)
    if shown.many_decades:
        curve.set_yscale("log")
    curve.legend(fontsize=8)
    for value, look, label in (
        (
            np.abs(spline - truth),
            {"color": "#1f5fa8", "ls": "--", "lw": 1.5},
            "error of the spline",
        ),
        (bound, {"color": "#222222", "ls": ":", "lw": 1.2}, "bound of this table"),
        (np.abs(ours - truth), {"color": "#c1272d", "lw": 1.0}, "error of this table"),
    ):
        errors.plot(shown.x, np.maximum(value, 1e-20), label=label, **look)
    errors.set(yscale="log", ylim=(1e-19, 1e6), ylabel="error")
    errors.legend(fontsize=8, loc="upper right")
    for axes in panels:
        axes.set(xlabel=shown.along, xscale="log" if shown.logarithmic else "linear")
        for mark in shown.marks:
            axes.axvline(mark, color="#555555", lw=0.8, ls=(0, (1, 3)))


SECTIONS = sections(
    grazing,
    surplus,
    double_root,
    creep,
    exact_eta,
    cusp,
    small_amplitude,
    short_stick,
    stiffness,
    gallery,
)

if __name__ == "__main__":
    main(__doc__, SECTIONS)

"""Every equation of the paper against the full model.

    python benchmarks/validation.py [--only SECTION] [--write]

A deviation is formula/exact - 1 unless the section states otherwise; exact is the solver, or the
1e-12 table where thousands of points are needed.
"""

from tests.support.measuring import FINEST, main, markdown, quantity, sections  # isort: split

import csv
import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.solver import march
from builder.solver.steady import border, solve
from mumacro import Surrogate, closed_forms
from tests.support.places import ROOT

Array = NDArray[np.float64]
Formula = Callable[[Array], Array]
LEVELS = (0.01, 0.05, 0.10)
WITHIN = ("within 1 %", "5 %", "10 %")
AMPLITUDES = np.geomspace(1e-3, 1e6, 18_001)


@cache
def table() -> Surrogate:
    return Surrogate.open(FINEST)


def percent(x: float) -> str:
    """A deviation with its sign, in percent."""
    return f"{'+' if x > 0 else '-'}{quantity(100.0 * abs(x), 3)}"


def intervals(x: Array, miss: Array, level: float) -> str:
    """Where ``miss`` <= ``level``, as text; ends are interpolated between the samples of ``x``
    (log-spaced)."""
    inside = miss <= level
    if inside.all():
        return "all"
    at = np.flatnonzero(np.diff(inside))
    share = (level - miss[at]) / (miss[at + 1] - miss[at])
    cuts = [quantity(float(cut), 3) for cut in x[at] * (x[at + 1] / x[at]) ** share]
    ends = [""] * bool(inside[0]) + cuts + [""] * bool(inside[-1])
    pairs = zip(ends[::2], ends[1::2], strict=True)
    return (
        ", ".join(f"{a} to {b}" if a and b else f"<= {b}" if b else f">= {a}" for a, b in pairs)
        or "none"
    )


def reference(case: str = "") -> list[tuple[float, float, float]]:
    """v~, y~, mu~ of the quadruple-precision points, or of those of one kind."""
    with (ROOT / "tests" / "data" / "points.csv").open(encoding="utf-8") as lines:
        rows = [row for row in csv.DictReader(lines) if case in ("", row["case"])]
    return [(float(row["v"]), float(row["y"]), float(row["mu_ratio"])) for row in rows]


def model() -> str:
    """Eqs. (5), (9)-(12), (15): the solver against quadruple precision and against plain
    marching."""
    points = reference()
    miss = max(abs(solve(v, y).mu_ratio - mu) for v, y, mu in points)
    rows = [["quadruple precision, another solver", str(len(points)), quantity(miss)]]
    marched = [(0.3, 0.2), (0.05, 0.4), (0.2, 0.9), (0.1, 1.5), (0.8, 1.0), (0.5, 6.0), (2.0, 6.0)]
    worst = max(abs(march(v, y, 0.1).mu_ratio - solve(v, y).mu_ratio) for v, y in marched)
    rows.append(["eqs. (9)-(12) marched by scipy, rtol 1e-9", str(len(marched)), quantity(worst)])
    return markdown(["reference", "points", "largest difference of mu~"], rows)


def interpolant(values: Array) -> Callable[..., float]:
    """The function f(tau, order=0) through equidistant values of a period, and its derivatives."""
    k, waves = np.fft.fftfreq(values.size, 1.0 / values.size), np.fft.fft(values) / values.size
    return lambda t, order=0: float((waves * (1j * k) ** order * np.exp(1j * k * t)).sum().real)


@cache
def orbit(v: float, y: float) -> tuple[Array, Array, Array]:
    """Periodic solution of eq. (11): tau, theta and the slip speed (12), by Newton's method on 256
    Fourier points."""
    n = 256
    tau = 2.0 * np.pi * np.arange(n) / n
    k = np.arange(n)[:, None] - np.arange(n)[None, :]
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.where(k == 0, 0.0, 0.5 * (-1.0) ** k / np.tan(np.pi * k / n))
    theta = y / math.hypot(1.0, v) * np.cos(tau - math.atan2(1.0, v))
    theta = np.arctan(np.tan(0.5 * theta)) * 2.0 if y < 3.0 else np.arctan(y / v * np.cos(tau))
    for _ in range(60):
        residual = slope @ theta + v * np.sin(theta) - y * np.cos(theta) * np.cos(tau)
        jacobian = slope + np.diag(v * np.cos(theta) + y * np.sin(theta) * np.cos(tau))
        step = np.linalg.solve(jacobian, residual)
        theta = theta - step * min(1.0, 0.5 / np.abs(step).max())
        if np.abs(step).max() < 1e-13:
            break
    return tau, theta, v * np.cos(theta) + y * np.sin(theta) * np.cos(tau)


def angles() -> str:
    """Eq. (18): the amplitude of the angle of continuous sliding, on the border."""
    rows = []
    for y in (0.1, 0.3, 0.5, 0.7, 1.0):
        v = border(y)[0]
        rows.append(
            [f"{y:g}", percent(y / math.hypot(1.0, v) / np.abs(orbit(v, y)[1]).max() - 1.0)]
        )
    return markdown(["y~", "amplitude (18) [%]"], rows)


def static() -> str:
    """Eq. (16) at the border, and the size of the slow change beyond it."""
    rows = []
    for y in (0.1, 0.3, 0.5, 0.7, 0.9):
        crit, low = float(table().v_tilde_crit(y)), float(closed_forms.static_limit(y))
        top = float(table().mu_ratio(crit, y))
        share = f"{100.0 * (top - low) / (1.0 - low):.0f}"
        rows.append([f"{y:g}", percent(low / top - 1.0), share, f"{1.0 / crit:.3g}"])
    return markdown(
        ["y~", "(16) at the border [%]", "of the rise to 1 [%]", "v~ = 1 in v~crit"], rows
    )


BORDERS: dict[str, Formula] = {
    "(23)": closed_forms.border_23,
    "(24), (39)": closed_forms.border_24,
    "(26) with 4.5": closed_forms.border_26,
    "(27)": closed_forms.border_27,
    "*two terms*": closed_forms.border_small_amplitude,
    "*4.402914*": closed_forms.border_large_amplitude,
    "*blend*": closed_forms.border_blend,
}


def deviations() -> str:
    """Eqs. (23), (24), (26), (27), (39) at some amplitudes."""
    at = np.array([0.1, 0.3, 0.5, 1.0, 2.0, 10.0, 100.0, 1e6])
    exact = np.array([border(float(y))[0] for y in at])
    rows = [["*exact v~crit*", *(f"{x:.7g}" for x in exact)]]
    for name, formula in BORDERS.items():
        miss = formula(at) / exact - 1.0
        rows.append([name, *(percent(float(x)) if abs(x) < 1.0 else "-" for x in miss)])
    return markdown(["deviation [%] at y~ =", *(f"{y:g}" for y in at)], rows)


def constants() -> str:
    """What the paper rounds."""
    far = 1e8
    ratio = far / border(far)[0] ** 2 * (1.0 + 2.0 * 0.0669 / far)
    small = 1e-2
    second = (1.0 - 2.0 * border(small)[0] / small**2) / small**2
    fourth = [(border(y)[1] - 1.0 + 0.25 * y * y) / y**4 for y in (0.1, 0.2)]
    quarter = (4.0 * fourth[0] - fourth[1]) / 3.0  # without the next term
    blend = np.abs(closed_forms.border_27(AMPLITUDES) / table().v_tilde_crit(AMPLITUDES) - 1.0)
    at = int(np.argmax(blend))
    slope = float(closed_forms.master_curve_limit(1e-20)) / 1e-20
    root = math.sqrt(ratio)
    rows = [
        ["y~/v~crit^2 for y~ -> infinity, (26)", "4.5", f"{ratio:.6f}", percent(4.5 / ratio - 1.0)],
        [
            "v~crit/sqrt(y~) for y~ -> infinity, (26)",
            "0.47",
            f"{1 / root:.6f}",
            percent(0.47 * root - 1),
        ],
        [
            "second coefficient of v~crit at small y~, (23), (24)",
            "1/2",
            f"{second:.5f}",
            percent(0.5 / second - 1.0),
        ],
        ["coefficient of y~^4 in mu~ at the border, (32)", "0", f"{quarter:.5f}", "-"],
        [
            "slope of the master curve at v~ = 0, (28)",
            "5/2",
            f"{slope:.6f}",
            percent(2.5 / slope - 1.0),
        ],
    ]
    text = markdown(["quantity", "paper", "exact", "deviation [%]"], rows)
    x = np.linspace(0.0, 1.0, 100_001)
    fit = float((closed_forms.master_curve(x) - closed_forms.master_curve_limit(x)).min())
    text += (
        f"\n\n(27) is farthest off, by {percent(-float(blend[at]))} %, at y~ = "
        f"{AMPLITUDES[at]:.3f}. "
    )
    return f"{text}(28) less N_0 is lowest, {fit:.5f}."


def master_curve() -> str:
    """Eq. (28) and its exact limit, by amplitude."""
    x = np.linspace(0.0, 1.0, 2001)
    rows = []
    for y in np.arange(1, 10) * 0.1:
        crit, low = float(table().v_tilde_crit(y)), float(closed_forms.static_limit(y))
        mu = table().mu_ratio(x * crit, float(y))
        top = float(mu[-1])
        exact = (mu - low) / (top - low)
        off = closed_forms.master_curve(x) - exact
        limit = np.abs(closed_forms.master_curve_limit(x) - exact).max()
        ends = np.abs((low + (top - low) * closed_forms.master_curve(x)) / mu - 1.0).max()
        v = np.linspace(0.0, 2.0, 2001) * crit
        law = low + (float(closed_forms.critical(y)) - low) * np.nan_to_num(
            closed_forms.master_curve(v / closed_forms.border_27(y)), nan=1.0
        )
        paper = np.abs(law / table().mu_ratio(v, float(y)) - 1.0).max()
        cells = [quantity(float(-off.min()), 3), f"{x[int(np.argmin(off))]:.2f}"]
        rows.append(
            [
                f"{y:.1f}",
                *cells,
                quantity(float(limit)),
                percent(float(ends))[1:],
                percent(float(paper))[1:],
            ]
        )
    header = [
        "y~",
        "(28) too low by",
        "at v~/v~crit",
        "N_0 off by",
        "mu~ [%]",
        "the paper's law [%]",
    ]
    return markdown(header, rows)


def continuous() -> str:
    """Eqs. (29), (31), (32), (40) over all of continuous sliding."""
    grid = np.geomspace(1e-3, 10.0, 801)
    crit = table().v_tilde_crit(grid)
    v = crit * np.geomspace(1.0, 1e4, 401)[:, None]
    exact = table().mu_ratio(v, grid)
    formulas: tuple[tuple[str, Any], ...] = (
        ("(29)", closed_forms.small_angle(v, grid)),
        ("(31)", closed_forms.small_amplitude(v, grid)),
        ("(32), (40), at the border", closed_forms.critical(grid)),
        ("*with (5/64) y~^4, at the border*", closed_forms.critical_next(grid)),
        ("*(2/pi) K(i y~/sqrt(1 + v~^2))*", closed_forms.continuous(v, grid)),
    )
    rows = []
    for name, values in formulas:  # the values at the border have one dimension
        worst = (
            np.abs(values / (exact[0] if values.ndim == 1 else exact) - 1.0)
            .reshape(-1, grid.size)
            .max(axis=0)
        )
        cells = [percent(float(np.interp(y, grid, worst)))[1:] for y in (0.1, 0.3, 0.5, 1.0)]
        rows.append([name, *cells, *(intervals(grid, worst, level) for level in LEVELS)])
    header = [
        "mu~ by",
        *(f"off by [%] at y~ = {y}" for y in (0.1, 0.3, 0.5, 1)),
        *(f"y~ {w}" for w in WITHIN),
    ]
    closed = np.abs(formulas[-1][1] - exact).max()
    wide = np.geomspace(1e-2, 1e5, 1401)
    speeds = table().v_tilde_crit(wide) * np.geomspace(1.0, 1e3, 301)[:, None]
    closed = max(
        closed, np.abs(closed_forms.continuous(speeds, wide) - table().mu_ratio(speeds, wide)).max()
    )
    return (
        f"{markdown(header, rows)}\n\nThe last formula is off by {closed:.4f} at the most, "
        "absolute, for every y~."
    )


def large_amplitudes() -> str:
    """Eqs. (35), (37) over all speeds."""
    rows = []
    for y in (1.6, 2.4, 4.0, 8.0, 16.0, 40.0, 80.0, 1e4, 1e8):
        v = math.sqrt(y) * np.geomspace(1e-9, 1e3 * max(1.0, math.sqrt(y)), 20_001)
        off = closed_forms.outer(y / v) - table().mu_ratio(v, y)
        rows.append([f"{y:g}", quantity(float(-off.min()), 3), quantity(float(off.max()))])
    header = ["y~", "(35) too low by", "too high by"]
    grid = np.geomspace(1.0, 1e6, 601)
    v = np.sqrt(grid) * np.geomspace(1e-4, 1e2, 1201)[:, None]
    worst = np.abs(closed_forms.outer(grid / v) - table().mu_ratio(v, grid)).max(axis=0)
    sure = ", ".join(
        f"{level:g} for y~ {intervals(grid, worst, level)}" for level in (0.05, 0.01, 0.005, 0.001)
    )
    return f"{markdown(header, rows)}\n\nAbsolute deviation at every speed at most {sure}."


def summary() -> str:
    """Sec. 7, the order of use: (38), (39), (40), (28) below y~ = 1, (37) above."""
    rows = []
    slowest = 1e-3
    for y in (0.1, 0.3, 0.5, 0.7, 0.9, 1.1, 2.0, 8.0, 80.0):
        crit = float(table().v_tilde_crit(y))
        v = np.concatenate(
            [[0.0], crit * np.geomspace(slowest, 1.0, 2001), crit * np.geomspace(1.0, 1e4, 801)]
        )
        mu = table().mu_ratio(v, y)
        low = float(closed_forms.static_limit(y))
        if y < 1.0:
            share = closed_forms.master_curve(v / closed_forms.border_24(y))
            law = low + (float(closed_forms.critical(y)) - low) * np.nan_to_num(share, nan=1.0)
        else:
            law = closed_forms.outer(y / np.maximum(v, 1e-300))
        slides = v > crit
        relative = (np.abs(law - mu)[slides] / mu[slides]).max()
        name = "(38), (39), (40), (28)" if y < 1.0 else "(37)"
        rows.append(
            [f"{y:g}", name, percent(float(relative))[1:], quantity(float(np.abs(law - mu).max()))]
        )
    header = ["y~", "law", "continuous, off by [%]", "absolute, all speeds"]
    return f"Stick-slip from {slowest:g} v~crit up:\n\n{markdown(header, rows, 2)}"


def normal_oscillation() -> str:
    """M. Popov, Front. Mech. Eng. 6 (2020) 69, eqs. (33) to (38): mu_macro = mu0 (1 - alpha
    Psi(beta)) where the normal force oscillates, with the fit Psi = (3/4)(1 - b)^2 + (1/4)(1 -
    b)^4."""

    def under(difference: float) -> str:
        """A difference, without digits of rounding."""
        return "< 1e-14" if difference < 1e-14 else quantity(difference)

    b = np.linspace(0.0, 1.0, 2001)
    fit = (1.0 - b) ** 2 * (0.75 + 0.25 * (1.0 - b) ** 2)
    limit = 1.0 - closed_forms.master_curve_limit(b)
    rows = []
    for alpha in (0.01, 0.1, 0.5, 0.9, 0.999):
        mu = table().quantity("mu_ratio", alpha * b, alpha + 0.0 * b, direction="normal")[0]
        off = 1.0 - alpha * fit - mu
        at = int(np.argmin(off))
        psi = (1.0 - mu) / alpha
        rows.append(
            [
                f"{alpha:g}",
                quantity(float(-off[at] / alpha), 3),
                f"{b[at]:.2f}",
                quantity(float(max(off.max() / alpha, 0.0))),
                under(float(np.abs(psi - limit).max())),
                under(float(max(abs(mu[0] - (1.0 - alpha)), abs(mu[-1] - 1.0)))),
            ]
        )
    header = [
        "alpha",
        "the fit too low by alpha times",
        "at b",
        "too high by",
        "Psi less 1 - N_0",
        "both ends off by",
    ]
    return markdown(header, rows)


SECTIONS = sections(
    model,
    static,
    angles,
    deviations,
    constants,
    master_curve,
    continuous,
    large_amplitudes,
    summary,
    normal_oscillation,
)

if __name__ == "__main__":
    main(__doc__, SECTIONS)

"""Every equation of the paper against the full model.

    python benchmarks/validation.py [--only SECTION] [--write]  A deviation is formula/exact - 1 unless the section
states otherwise; exact is the solver, or the 1e-12 table where thousands of points are needed.
"""

from __future__ import annotations

from benchmarks.measuring import FINEST, ROOT, main, markdown, quantity  # isort: split

import csv
import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.marching import march
from builder.steady import border, solve
from mumacro import Surrogate, closed_forms

Array = NDArray[np.float64]
Formula = Callable[[Array], Array]
LEVELS = (0.01, 0.05, 0.10)
WITHIN = ("within 1 %", "5 %", "10 %")
AMPLITUDES = np.geomspace(1e-3, 1e6, 18_001)


@cache
def table() -> Surrogate:
    """The tightest committed table."""
    return Surrogate.open(FINEST)


def percent(x: float) -> str:
    """A deviation with its sign, in percent."""
    return f"{'+' if x > 0 else '-'}{quantity(100.0 * abs(x), 3)}"


def intervals(x: Array, miss: Array, level: float, name: str = "") -> str:
    """Where ``miss`` <= ``level``, as text; ends are interpolated between the samples of ``x`` (log-spaced)."""
    inside = miss <= level
    if inside.all():
        return "all"
    if not inside.any():
        return "none"
    (edges,) = np.nonzero(inside[1:] != inside[:-1])
    cuts = []
    for i in edges:
        share = (level - miss[i]) / (miss[i + 1] - miss[i])
        cuts.append(quantity(float(x[i] * (x[i + 1] / x[i]) ** share), 3))
    parts = []
    if inside[0]:
        parts.append(f"{name}<= {cuts.pop(0)}")
    while len(cuts) >= 2:
        parts.append(f"{cuts.pop(0)} to {cuts.pop(0)}")
    if cuts:
        parts.append(f">= {cuts.pop(0)}")
    return ", ".join(parts)


# --- the model ---


def model() -> str:
    """Eqs. (5), (9)-(12), (15): the solver against quadruple precision and against plain marching."""
    with (ROOT / "tests" / "data" / "points.csv").open(encoding="utf-8") as lines:
        points = [row for row in csv.DictReader(lines) if row["v"] and float(row["v"]) > 0.0]
    miss = []
    for row in points:
        mu = float(row["mu_ratio"])
        eta = float(row["eta"]) if row.get("eta") else None
        miss.append(abs(solve(float(row["v"]), float(row["y"]), eta).mu_ratio - mu))
    rows = [["quadruple precision, another solver", str(len(points)), quantity(max(miss))]]
    marched = [(0.3, 0.2), (0.05, 0.4), (0.2, 0.9), (0.1, 1.5), (0.8, 1.0), (0.5, 6.0), (2.0, 6.0)]
    worst = max(abs(march(v, y, 0.1).mu_ratio - solve(v, y).mu_ratio) for v, y in marched)
    rows.append(["eqs. (9)-(12) marched by scipy, rtol 1e-9", str(len(marched)), quantity(worst)])
    return markdown(["reference", "points", "largest difference of mu~"], rows)


@cache
def orbit(v: float, y: float) -> tuple[Array, Array, Array]:
    """Periodic solution of eq. (11): tau, theta and the slip speed (12), by Newton's method on 256 Fourier points."""
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
    """Eqs. (18), (19), (21): the angle of continuous sliding and the slip speed made from it, on the border."""
    rows = []
    for y in (0.1, 0.3, 0.5, 0.7, 1.0):
        v = border(y)[0]
        tau, theta, _ = orbit(v, y)
        amplitude = y / math.hypot(1.0, v)
        phi = math.atan2(-1.0, v)
        off = np.abs(amplitude * np.cos(tau + phi) - theta).max() / np.abs(theta).max()
        smallest = (y * amplitude * np.cos(tau + phi) * np.cos(tau) + v).min() / v
        rows.append([f"{y:g}", percent(amplitude / np.abs(theta).max() - 1.0), percent(float(off)), percent(smallest)])
    return markdown(
        ["y~", "amplitude (18) [%]", "theta (18) off by [% of amplitude]", "least of (21) over v~ [%]"], rows
    )


# --- the static limit ---


def static() -> str:
    """Eq. (16): its range in v~/v~crit."""
    rows = []
    x = np.geomspace(1e-6, 1.0, 6001)
    for y in (0.1, 0.3, 0.5, 0.7, 0.9):
        mu = table().mu_ratio(x * table().v_tilde_crit(y), y)
        miss = 1.0 - float(closed_forms.static_limit(y)) / mu
        cells = [intervals(x, miss, level) for level in LEVELS]
        rows.append([f"{y:g}", f"{float(closed_forms.static_limit(y)):.6f}", *cells, percent(-float(miss[-1]))])
    return markdown(["y~", "(16)", *(f"v~/v~crit {w}" for w in WITHIN), "at the border [%]"], rows)


# --- the border ---

BORDERS: tuple[tuple[str, str, Formula], ...] = (
    ("y~^2/2", "y~ -> 0", lambda y: 0.5 * y * y),
    ("(23)", "y~ << 1", closed_forms.border_23),
    ("(24), (39)", "y~ << 1", closed_forms.border_24),
    ("(26) with 4.5", "y~ >> 1", closed_forms.border_26),
    ("(26) with 0.47", "y~ >> 1", lambda y: 0.47 * np.sqrt(y)),
    ("(27)", "all", closed_forms.border_27),
    ("*two terms*", "y~ -> 0", closed_forms.border_small_amplitude),
    ("*4.402914*", "y~ -> infinity", closed_forms.border_large_amplitude),
    ("*blend*", "all", closed_forms.border_blend),
)


def border_deviations() -> str:
    """Eqs. (23), (24), (26), (27), (39) at some amplitudes."""
    at = np.array([0.1, 0.3, 0.5, 1.0, 2.0, 10.0, 100.0, 1e6])
    exact = np.array([border(float(y))[0] for y in at])
    rows = [["*exact v~crit*", *(f"{x:.7g}" for x in exact)]]
    for name, _, formula in BORDERS:
        miss = formula(at) / exact - 1.0
        rows.append([name, *(percent(float(x)) if abs(x) < 1.0 else "-" for x in miss)])
    return markdown(["deviation [%] at y~ =", *(f"{y:g}" for y in at)], rows)


def border_ranges() -> str:
    """Ranges of y~ in which the border's formulas stay within 1, 5 and 10 %."""
    exact = table().v_tilde_crit(AMPLITUDES)
    rows = []
    for name, meant, formula in BORDERS:
        miss = np.abs(formula(AMPLITUDES) / exact - 1.0)
        rows.append([name, meant, *(intervals(AMPLITUDES, miss, level) for level in LEVELS)])
    return markdown(["v~crit by", "meant for", *(f"y~ {w}" for w in WITHIN)], rows, 5)


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
    x = np.linspace(0.0, 1.0, 100_001)
    fit = closed_forms.master_curve(x) - closed_forms.master_curve_limit(x)
    slope = float(closed_forms.master_curve_limit(1e-20)) / 1e-20
    rows = [
        ["y~/v~crit^2 for y~ -> infinity, (26)", "4.5", f"{ratio:.6f}", percent(4.5 / ratio - 1.0)],
        [
            "v~crit/sqrt(y~) for y~ -> infinity, (26)",
            "0.47",
            f"{1 / math.sqrt(ratio):.6f}",
            percent(0.47 * math.sqrt(ratio) - 1),
        ],
        ["second coefficient of v~crit at small y~, (23), (24)", "1/2", f"{second:.5f}", percent(0.5 / second - 1.0)],
        ["coefficient of y~^4 in mu~ at the border, (32)", "0", f"{quarter:.5f}", "-"],
        ["slope of the master curve at v~ = 0, (28)", "5/2", f"{slope:.6f}", percent(2.5 / slope - 1.0)],
    ]
    text = markdown(["quantity", "paper", "exact", "deviation [%]"], rows)
    return (
        f"{text}\n\n(27) is farthest off, by {percent(-float(blend[at]))} %, at y~ = {AMPLITUDES[at]:.3f}. "
        f"(28) less N_0 is lowest, {fit.min():.5f}, at v~/v~crit = {x[int(np.argmin(fit))]:.3f}."
    )


# --- small amplitudes ---


def rise(y: float, x: Array) -> Array:
    """(mu~ - static)/(critical - static) at v~ = x v~crit."""
    crit = float(table().v_tilde_crit(y))
    low, top = float(closed_forms.static_limit(y)), float(table().mu_ratio(crit, y))
    out: Array = (table().mu_ratio(x * crit, y) - low) / (top - low)
    return out


def master_curve() -> str:
    """Eq. (28) and its exact limit, by amplitude."""
    x = np.linspace(0.0, 1.0, 2001)
    rows = []
    for y in np.arange(1, 10) * 0.1:
        exact = rise(float(y), x)
        off = closed_forms.master_curve(x) - exact
        limit = np.abs(closed_forms.master_curve_limit(x) - exact).max()
        crit, top = float(table().v_tilde_crit(y)), float(table().mu_ratio(table().v_tilde_crit(y), y))
        mu = table().mu_ratio(x * crit, float(y))
        low = float(closed_forms.static_limit(y))
        ends = np.abs((low + (top - low) * closed_forms.master_curve(x)) / mu - 1.0).max()
        v = np.linspace(0.0, 2.0, 2001) * crit
        law = low + (float(closed_forms.critical(y)) - low) * np.nan_to_num(
            closed_forms.master_curve(v / closed_forms.border_27(y)), nan=1.0
        )
        paper = np.abs(law / table().mu_ratio(v, float(y)) - 1.0).max()
        cells = [quantity(float(-off.min()), 3), f"{x[int(np.argmin(off))]:.2f}", quantity(float(off.max()))]
        rows.append([f"{y:.1f}", *cells, quantity(float(limit)), percent(float(ends))[1:], percent(float(paper))[1:]])
    header = [
        "y~", "(28) too low by", "at v~/v~crit", "too high by", "N_0 off by", "mu~ [%]", "the paper's law [%]",
    ]  # fmt: skip
    return markdown(header, rows)


def plateau() -> str:
    """The size of the slow change beyond the border."""
    rows = []
    for y in (0.1, 0.3, 0.5, 0.7, 0.9):
        crit = float(table().v_tilde_crit(y))
        low, top = float(closed_forms.static_limit(y)), float(table().mu_ratio(crit, y))
        more = [f"{float(rise(y, np.array([x]))[0]):.3f}" for x in (2.0, 5.0, 20.0)]
        rows.append([f"{y:g}", f"{top:.6f}", f"{100.0 * (top - low) / (1.0 - low):.0f}", *more, f"{1.0 / crit:.3g}"])
    header = ["y~", "mu~ at the border", "of the rise to 1 [%]", "N at 2 v~crit", "at 5", "at 20", "v~ = 1 in v~crit"]
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
    for name, values in formulas:
        there = values - exact[0] if values.ndim == 1 else values - exact
        relative = np.abs(there / (exact[0] if values.ndim == 1 else exact))
        worst = relative if relative.ndim == 1 else relative.max(axis=0)
        cells = [percent(float(np.interp(y, grid, worst)))[1:] for y in (0.1, 0.3, 0.5, 1.0)]
        rows.append([name, *cells, *(intervals(grid, worst, level) for level in LEVELS)])
    header = ["mu~ by", *(f"off by [%] at y~ = {y}" for y in (0.1, 0.3, 0.5, 1)), *(f"y~ {w}" for w in WITHIN)]
    closed = np.abs(formulas[-1][1] - exact).max()
    wide = np.geomspace(1e-2, 1e5, 1401)
    speeds = table().v_tilde_crit(wide) * np.geomspace(1.0, 1e3, 301)[:, None]
    closed = max(closed, np.abs(closed_forms.continuous(speeds, wide) - table().mu_ratio(speeds, wide)).max())
    return f"{markdown(header, rows)}\n\nThe last formula is off by {closed:.4f} at the most, absolute, for every y~."


# --- large amplitudes ---

LARGE = (1.6, 2.4, 4.0, 8.0, 16.0, 40.0, 80.0, 1e4, 1e8)


def slow_angle() -> str:
    """Eq. (34): the largest error of the angle, at large y~."""
    rows = []
    y = 16.0
    for factor in (10.0, 5.0, 2.0, 1.0, 0.5):
        v = factor * math.sqrt(y)
        tau, theta, _ = orbit(v, y)
        off = np.abs(np.arctan(y / v * np.cos(tau)) - theta)
        rows.append([f"{factor:g}", quantity(float(off.max())), quantity(y / v**2)])
    table_ = markdown(["v~/sqrt(y~)", "theta of (34) off by [rad]", "y~/v~^2"], rows)
    return f"y~ = {y:g}:\n\n{table_}"


def large_amplitudes() -> str:
    """Eqs. (35), (37) over all speeds."""
    rows = []
    for y in LARGE:
        v = math.sqrt(y) * np.geomspace(1e-9, 1e3 * max(1.0, math.sqrt(y)), 20_001)
        exact = table().mu_ratio(v, y)
        off = closed_forms.outer(y / v) - exact
        relative = np.abs(off / exact)
        cells = []
        for level in LEVELS:
            (last,) = np.nonzero(relative > level)[0][-1:]
            share = (relative[last] - level) / (relative[last] - relative[last + 1])
            cells.append(quantity(float(v[last] + share * (v[last + 1] - v[last])) / math.sqrt(y), 3))
        creep = 1e-9 * y
        ratio = float(closed_forms.outer(y / creep)) / float(table().mu_ratio(creep, y))
        rows.append([f"{y:g}", quantity(float(-off.min()), 3), quantity(float(off.max())), quantity(ratio, 3), *cells])
    header = [
        "y~", "(35) too low by", "too high by", "ratio at v~ = 1e-9 y~", *(f"v~/sqrt(y~) {w} from" for w in WITHIN),
    ]  # fmt: skip
    grid = np.geomspace(1.0, 1e6, 601)
    v = np.sqrt(grid) * np.geomspace(1e-4, 1e2, 1201)[:, None]
    worst = np.abs(closed_forms.outer(grid / v) - table().mu_ratio(v, grid)).max(axis=0)
    sure = ", ".join(f"{level:g} from y~ = {_first(grid, worst, level)}" for level in (0.05, 0.01, 0.005, 0.001))
    return f"{markdown(header, rows)}\n\nAbsolute deviation at every speed below {sure} on."


def _first(x: Array, miss: Array, level: float) -> str:
    i = int(np.nonzero(miss > level)[0][-1])
    share = math.log(miss[i] / level) / math.log(miss[i] / miss[i + 1])
    return quantity(float(x[i] * (x[i + 1] / x[i]) ** share))


def summary() -> str:
    """Sec. 7, the order of use: (38), (39), (40), (28) below y~ = 1, (37) above."""
    rows = []
    slowest = 1e-3
    for y in (0.1, 0.3, 0.5, 0.7, 0.9, 1.1, 2.0, 8.0, 80.0):
        crit = float(table().v_tilde_crit(y))
        v = np.concatenate([[0.0], crit * np.geomspace(slowest, 1.0, 2001), crit * np.geomspace(1.0, 1e4, 801)])
        mu = table().mu_ratio(v, y)
        low = float(closed_forms.static_limit(y))
        if y < 1.0:
            share = closed_forms.master_curve(v / closed_forms.border_24(y))
            law = low + (float(closed_forms.critical(y)) - low) * np.nan_to_num(share, nan=1.0)
        else:
            law = closed_forms.outer(y / np.maximum(v, 1e-300))
        relative = np.abs(law - mu)[1:] / mu[1:]
        slips = v[1:] <= crit
        cells = [percent(float(relative[part].max()))[1:] for part in (slips, ~slips)]
        name = "(38), (39), (40), (28)" if y < 1.0 else "(37)"
        rows.append([f"{y:g}", name, *cells, quantity(float(np.abs(law - mu).max()))])
    header = ["y~", "law", "stick-slip, off by [%]", "continuous, off by [%]", "absolute, all speeds"]
    return f"Stick-slip from {slowest:g} v~crit up:\n\n{markdown(header, rows, 2)}"


SECTIONS: dict[str, Callable[[], str]] = {
    "model": model,
    "static": static,
    "angles": angles,
    "border": border_deviations,
    "border_ranges": border_ranges,
    "constants": constants,
    "master_curve": master_curve,
    "plateau": plateau,
    "continuous": continuous,
    "slow_angle": slow_angle,
    "large_amplitudes": large_amplitudes,
    "summary": summary,
}

if __name__ == "__main__":
    main(__doc__, SECTIONS)

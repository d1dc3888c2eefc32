"""The solver over all positive doubles: limits, scaling laws at both ends, and a second method for the same cycle."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from builder import sections, steady
from builder.model import OK
from builder.sections import ANGLE_SECTION, COS_0, SIGMA_1, SIN_0, TIME_SECTION, section, stick_slip
from builder.steady import (
    BELOW_LINEAR,
    LARGEST_Y,
    RELATIVE_ERROR,
    RIGID_V,
    RIGID_X,
    SMALLEST_V,
    SMALLEST_Y,
    rigid,
    solve,
    workspace,
)
from builder.sweep import Sweep
from comparing import close
from mumacro import Surrogate
from mumacro.closed_forms import outer, second_order

pytestmark = pytest.mark.slow

Array = NDArray[np.float64]
TINY = 2.3e-308  # below it doubles have fewer digits


def log_uniform(rng: np.random.Generator, low: float, high: float, n: int) -> Array:
    return 10.0 ** rng.uniform(math.log10(low), math.log10(high), n)


@pytest.mark.parametrize(
    ("v_range", "y_range"),
    [
        ((1e-307, 1e300), (1e-300, 1e300)),
        ((5e-324, 1e-130), (1e-3, 1e6)),
        ((1e-300, 1e-12), (1e-300, 1e8)),
        ((1e-8, 1e14), (1e8, 1e20)),
        ((1e-30, 1e-10), (1e-16, 1e-4)),
        ((1e6, 1e12), (1e-10, 1e16)),
    ],
)
def test_every_positive_double_is_solved(v_range: tuple[float, float], y_range: tuple[float, float]) -> None:
    rng = np.random.default_rng(3)
    for v, y in zip(log_uniform(rng, *v_range, 1000), log_uniform(rng, *y_range, 1000), strict=True):
        found = solve(v, y)
        assert found.ok, (v, y)
        assert 0.0 <= found.mu_ratio <= 1.0
        assert 0.0 <= found.deficit <= 1.0
        assert found.mu_ratio + found.deficit == close(1.0, abs=3e-16)
        assert found.mu_ratio > 0.0 or v / y < 1e-323
        assert 0.0 <= found.stick_fraction <= 1.0
        assert 0.0 <= found.power < math.inf
        assert abs(v * found.mu_ratio + found.power - found.slip_speed) <= 5e-15 * found.slip_speed + 1e-322
        assert found.error_estimate < 2e-15


@pytest.mark.parametrize(("v", "y"), [(5e-324, 5e-324), (5e-324, 1.7e308), (1.7e308, 5e-324), (1.7e308, 1e308)])
def test_the_corners_of_the_double_range(v: float, y: float) -> None:
    found = solve(v, y)
    assert found.ok
    assert 0.0 <= found.mu_ratio <= 1.0
    assert found.power >= 0.0


# --- creep --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("y", [1.0 + 2.3e-16, 1.001, 1.2, 2.0, 10.0, 1.4e5, 1e13, 1e20])
def test_mu_is_linear_in_creeping_speeds_above_one(y: float) -> None:
    # the secant step underflowed below v~ = 1e-147: mu~ was up to 11 % off, with status "success"
    expected = solve(1e-60, y)
    for v in (10.0**exponent for exponent in range(-62, -307, -7)):
        found = solve(v, y)
        if found.mu_ratio > TINY:
            assert found.mu_ratio / v == close(expected.mu_ratio / 1e-60, rel=1e-15)
        assert found.power == close(expected.power, rel=1e-14)
        # the limit v~ -> 0; below v~ = 1e-147 it is a difference of angles, each to the last digit of pi/2
        assert found.stick_fraction == close(2.0 / math.pi * math.atan2(1.0, math.sqrt(y - 1.0)), abs=1.5e-16)


@pytest.mark.parametrize("y", [1.05, 1.3, 2.0, 5.0, 30.0, 1e3])
def test_the_table_agrees_at_creep(y: float, tables_dir: Any) -> None:
    s = Surrogate.open(tables_dir / "mumacro-1e-12.nc")
    for v in (1e-60, 1e-147, 1e-220, 1e-304):
        found = solve(v, y).mu_ratio
        assert found > 0.0
        assert found == close(float(s.mu_ratio(v, y)), rel=1e-11, abs=5e-324)


def test_a_denormal_mu_is_not_zero() -> None:
    assert solve(1e-304, 1.4e5).mu_ratio == close(1e-304 * (solve(1e-60, 1.4e5).mu_ratio / 1e-60), rel=1e-14)


@pytest.mark.parametrize("y", [1e-12, 1e-9, 1e-5, 0.1, 0.5, 0.9, 1.0 - 1e-10])
def test_the_static_limit_at_creep(y: float) -> None:
    expected = solve(1e-60, y).power / 1e-60
    assert expected > 0.0
    for v in (10.0**exponent for exponent in range(-40, -307, -7)):
        found = solve(v, y)
        assert found.mu_ratio == close(math.sqrt((1.0 - y) * (1.0 + y)), rel=3e-16)
        if y <= 1e-9 and v < 1e-40:
            assert found.power == close(v * y * y, rel=1e-14, abs=1e-323)  # v~ (1/2 + 1/2) y~^2
        elif found.power > TINY:
            assert found.power / v == close(expected, rel=1e-12 if y > 0.99 else 1e-14)


def test_the_linear_term_below_one() -> None:
    for y in (0.3, 0.6, 0.9):
        v = 1e-9
        rise = solve(v, y).mu_ratio - math.sqrt((1.0 - y) * (1.0 + y))
        assert rise == close(math.pi / (2.0 * (1.0 - y * y)) * v, rel=1e-3)


@pytest.mark.parametrize("eta", [0.0, 1e-17, -1e-17, 3e-30, -3e-30, 1e-60, -1e-90])
def test_the_corner_at_any_speed_is_the_normal_form(eta: float) -> None:
    for v in (10.0**exponent for exponent in range(-30, -307, -9)):
        found = solve(v, 1.0, eta)
        mu = found.mu_ratio
        assert mu * mu * mu + 2.0 * eta * mu == close(math.pi * v, rel=1e-9, abs=1e-14 * (mu**3 + abs(eta * mu)))
        assert 0.0 <= found.stick_fraction <= 1.0
        assert found.power > 0.0
    assert solve(1e-300, 1.0).mu_ratio == close((math.pi * 1e-300) ** (1.0 / 3.0), rel=4e-15)


# --- the power ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [1e-6, 0.1, 0.9, 1.1, 10.0, 1e3])
def test_the_power_of_small_amplitudes_is_quadratic(share: float) -> None:
    # as a difference of works of the order of v~ it lost all digits at y~ = 1e-9, and the sign
    powers = [solve(share * 0.5 * y * y, y).power / y**4 for y in (1e-4, 1e-6, 1e-8, 1e-11)]
    assert powers[-1] > 0.0
    assert powers == close([powers[-1]] * 4, rel=3e-8)
    assert powers[1:] == close([powers[-1]] * 3, rel=1e-11)


def test_the_power_has_no_step_where_its_formula_changes() -> None:
    for v, y in ((0.02, 0.3), (1e-5, 0.3), (0.05, 0.2), (0.05, 1e-4)):
        below, above = solve(v * (1.0 - 1e-15), y * (1.0 - 1e-15)).power, solve(v, y).power
        assert below == close(above, rel=2e-13)


# --- large amplitudes and speeds ----------------------------------------------------------------------


@pytest.mark.parametrize("x", [1e-30, 1e-3, 0.1, 0.45, 0.5, 2.0, 50.0, 3e3])
def test_layers_at_the_turns_depend_on_one_number(x: float) -> None:
    """(mu~ - (2/pi) K(i y~/v~)) y~/v~ = G(x) + O(1/y~); truncation drifted with sqrt(y~) and lost 5e-12 at 1e14."""

    def layer(y: float) -> float:
        v = x * math.sqrt(y)
        return (solve(v, y).mu_ratio - rigid(v, y)[0]) * y / v

    expected = layer(1e20)
    for y in (1e12, 1e13, 9e13, 1.1e14, 1e16, 1e40):
        # y~/v~ multiplies the rounding error of mu~ y~/v~ = (2/pi) ln(4 y~/v~) + G
        rounding = 4e-15 * (math.log(4.0 * math.sqrt(y) / x) + abs(expected))
        assert layer(y) == close(expected, abs=1.0 / y + rounding)


@pytest.mark.parametrize("r", [1e-160, 1e-9, 1e-3, 1.0, 30.0, 1e6])
def test_rigid_contact_is_the_closed_form(r: float) -> None:
    mu, deficit, power = rigid(1e3, r * 1e3)
    assert mu == close(float(outer(r)), rel=1e-15)  # 4.4e-16 off at r = 30, where the other is right to the last digit
    assert deficit == close(0.25 * r * r if r < 1e-8 else 1.0 - float(outer(r)), rel=1e-8, abs=1e-15)
    if r > 1e3:
        assert power == close(r * 1e3 * 2.0 / math.pi, rel=1e-10)
    else:
        tau = (np.arange(4000) + 0.5) * (math.pi / 4000)
        mean = np.mean(np.cos(tau) ** 2 / np.sqrt(1.0 + (r * np.cos(tau)) ** 2))
        assert power == close(1e3 * r * mean * r, rel=1e-13, abs=5e-324)  # at r = 1e-160 it has six digits


def test_no_step_where_rigid_contact_takes_over() -> None:
    for y in (1e-8, 1.0, 1e7, 1e12, 1e17):
        v = max(RIGID_V, RIGID_X * math.sqrt(y))
        below, above = solve(v * (1.0 - 1e-12), y), solve(v * (1.0 + 1e-12), y)
        assert below.mu_ratio == close(above.mu_ratio, rel=4e-12)
        assert below.power == close(above.power, rel=4e-12)
        assert below.min_slip_speed == close(above.min_slip_speed, rel=1e-3)
        speed = v if y < 1e9 else 50.0 * math.sqrt(y)
        two_terms = float(outer(y / speed)) + float(second_order(y / speed)) / speed**2
        assert solve(speed, y).mu_ratio == close(two_terms, rel=1e-6)


def test_the_smallest_slip_speed_is_seen_in_stiff_steps() -> None:
    # stiff steps once missed the turn: 1e12 instead of 3e7
    for v, y in ((3e7, 1e12), (300.0, 200.0), (1e3, 1e5)):
        assert solve(v, y).min_slip_speed == close(v, rel=5e-3)


def test_too_fast_for_the_solver_is_the_closed_form() -> None:
    found = solve(1e15, 1e-3)
    assert found.ok
    assert found.deficit == close(0.25e-36, rel=1e-14)


@pytest.mark.parametrize("edge", ["v", "small y", "linear", "large y", "corner"])
def test_no_step_where_scaling_takes_over(edge: str) -> None:
    y = {"v": 0.5, "small y": SMALLEST_Y, "linear": 1e-12, "large y": LARGEST_Y, "corner": 1.0}[edge]
    v = {"v": SMALLEST_V, "small y": 3e-19, "linear": BELOW_LINEAR * 1e-6, "large y": 1e6, "corner": SMALLEST_V}[edge]
    below, above = solve(v * (1.0 - 1e-13), y * (1.0 - 1e-13)), solve(v * (1.0 + 1e-13), y * (1.0 + 1e-13))
    if edge == "corner":
        below, above = solve(v * (1.0 - 1e-13), 1.0), solve(v * (1.0 + 1e-13), 1.0)
    for name in ("mu_ratio", "deficit", "stick_fraction", "power", "slip_speed"):
        assert getattr(below, name) == close(getattr(above, name), rel=2e-12)


# --- monotony -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("y", [1e-200, 1e-12, 0.5, 1.0, 1.3, 1e5, 1e18, 1e200])
def test_mu_rises_with_speed_over_all_doubles(y: float, sweep: Sweep) -> None:
    v = np.geomspace(1e-307, 1e300, 3000)
    solved = sweep.solve("full", v, np.full_like(v, y))
    assert np.all(np.diff(solved["mu_ratio"]) >= -RELATIVE_ERROR * solved["mu_ratio"][1:])
    assert np.all(np.diff(solved["deficit"]) <= RELATIVE_ERROR * solved["deficit"][1:])


@pytest.mark.parametrize("v", [1e-300, 1e-100, 1e-18, 1e-3, 1.0, 1e5, 1e30, 1e200])
def test_mu_falls_with_amplitude_over_all_doubles(v: float, sweep: Sweep) -> None:
    y = np.geomspace(1e-300, 1e300, 3000)
    solved = sweep.solve("full", np.full_like(y, v), y)
    assert np.all(np.diff(solved["mu_ratio"]) <= RELATIVE_ERROR * solved["mu_ratio"][1:])
    assert np.all(np.diff(solved["deficit"]) >= -RELATIVE_ERROR * solved["deficit"][1:])


# --- the error estimate -------------------------------------------------------------------------------


def through_the_other_section(v: float, y: float, eta: float) -> tuple[float, float, float]:
    """mu~ by the section that the solver uses, mu~ by the other one, 1 - mu~; NaN if the other one has no root."""
    w, out, orbit, res = workspace()
    if stick_slip(v, y, eta, math.nan, w, out, orbit) != OK:
        return math.nan, math.nan, math.nan
    steady._sticking(v, y, out, orbit, res)
    mu = float(res[steady.MU_RATIO])
    kind, chart, _ = sections._choose(v, y, eta, math.nan)
    if kind == ANGLE_SECTION:
        other, z = TIME_SECTION, -orbit[SIGMA_1]
    else:
        other = ANGLE_SECTION
        z = math.atan2(orbit[SIN_0], orbit[COS_0]) if chart == 0 else math.atan2(orbit[COS_0], orbit[SIN_0])

    def residual(at: float) -> float:
        f, status = section(other, v, y, eta, at, chart, w, out, orbit)
        return f if status == OK else math.nan

    span = 1e-7 * z
    ends = residual(z - span), residual(z + span)
    if not ends[0] * ends[1] < 0.0:
        return mu, math.nan, math.nan
    residual(brentq(residual, z - span, z + span, xtol=1e-300, rtol=8.9e-16))
    steady._sticking(v, y, out, orbit, res)
    return mu, float(res[steady.MU_RATIO]), float(res[steady.DEFICIT])


def test_error_estimate_covers_the_other_section() -> None:
    rng = np.random.default_rng(5)
    both = 0
    for y in log_uniform(rng, 0.01, 1.0, 1000):  # above y~ = 1 the time section is ill conditioned
        v = steady.border_guess(y) * 10.0 ** rng.uniform(-3.0, -0.1)
        mu, other, deficit = through_the_other_section(v, y, y - 1.0)
        if math.isfinite(other):
            both += 1
            assert abs(mu - other) <= steady.error_estimate(mu, deficit), (v, y)
    assert both > 900


@pytest.mark.parametrize("limits", [(-3.0, 3.0), (-12.0, 8.0), (-60.0, -12.0), (-307.0, 300.0)])
def test_error_estimate_covers_neighbouring_doubles(limits: tuple[float, float], sweep: Sweep) -> None:
    rng = np.random.default_rng(8)
    v = 10.0 ** rng.uniform(*limits, 800)
    y = 10.0 ** rng.uniform(*(limits if limits[0] > -50.0 else (-3.0, 14.0)), 800)
    one = sweep.solve("full", v, y)
    assert np.all(one["error_estimate"] > 0.0)
    for ulps in (-3, -2, -1, 1, 2, 3):
        other = sweep.solve("full", v + ulps * np.spacing(v), y)
        assert np.all(np.abs(other["mu_ratio"] - one["mu_ratio"]) <= one["error_estimate"])

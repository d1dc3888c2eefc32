"""The solver over its whole range: limits, scaling laws at both ends, neighbouring doubles."""

import math

import numpy as np
import pytest

from builder.solver.steady import RELATIVE_ERROR, V_RANGE, Y_RANGE, solve
from builder.solver.sweep import Sweep
from mumacro.closed_forms import outer, second_order
from tests.support.cases import log_uniform, opened
from tests.support.comparing import close


@pytest.mark.parametrize(
    ("v_range", "y_range"),
    [
        (V_RANGE, Y_RANGE),
        ((1e-60, 1e-40), (1e-3, 1e6)),
        ((1e-60, 1e-12), (1e-15, 1e8)),
        ((1e-8, 1e10), (1e8, 1e14)),
        ((1e-30, 1e-10), (1e-15, 1e-4)),
        ((1e6, 1e10), (1e-10, 1e14)),
    ],
)
def test_the_whole_range_is_solved(
    v_range: tuple[float, float], y_range: tuple[float, float]
) -> None:
    rng = np.random.default_rng(3)
    for v, y in zip(
        log_uniform(rng, *v_range, 1000), log_uniform(rng, *y_range, 1000), strict=True
    ):
        solved = solve(v, y)
        assert solved.ok, (v, y)
        assert 0.0 < solved.mu_ratio <= 1.0
        assert 0.0 <= solved.deficit <= 1.0
        assert solved.mu_ratio + solved.deficit == close(1.0, abs=3e-16)
        assert 0.0 <= solved.stick_fraction <= 1.0
        assert 0.0 <= solved.power < math.inf
        assert (
            abs(v * solved.mu_ratio + solved.power - solved.slip_speed) <= 5e-15 * solved.slip_speed
        )
        assert solved.error_estimate < 2e-15


# --- creep ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("y", [1.001, 1.2, 2.0, 10.0, 1.4e5, 1e13])
def test_mu_is_linear_in_creeping_speeds_above_one(y: float) -> None:
    expected = solve(1e-60, y)
    for v in (10.0**exponent for exponent in range(-40, -60, -3)):
        solved = solve(v, y)
        assert solved.mu_ratio / v == close(expected.mu_ratio / 1e-60, rel=3e-15)
        assert solved.power == close(expected.power, rel=1e-14)
        assert solved.stick_fraction == close(expected.stick_fraction, rel=1e-13)


@pytest.mark.parametrize("y", [1.05, 1.3, 2.0, 5.0, 30.0, 1e3, 1.4e5])
def test_the_table_continues_the_solver_down_to_denormal_speeds(y: float) -> None:
    s = opened(1e-12)
    slope = solve(1e-60, y).mu_ratio / 1e-60
    for v in (1e-60, 1e-147, 1e-220, 1e-304):
        result, bound, _ = s.quantity("mu_ratio", v, y)
        assert result > 0.0
        assert result == close(slope * v, rel=1e-11, abs=5e-324)
        assert v > 1e-300 or bound < 1e-305


@pytest.mark.parametrize("y", [1e-12, 1e-9, 1e-5, 0.1, 0.5, 0.9, 1.0 - 1e-10])
def test_the_static_limit_at_creep(y: float) -> None:
    expected = solve(1e-60, y).power / 1e-60
    assert expected > 0.0
    for v in (10.0**exponent for exponent in range(-40, -60, -3)):
        solved = solve(v, y)
        assert solved.mu_ratio == close(math.sqrt((1.0 - y) * (1.0 + y)), rel=3e-16)
        if y <= 1e-9:
            assert solved.power == close(v * y * y, rel=1e-14)  # v~ (1/2 + 1/2) y~^2
        assert solved.power / v == close(expected, rel=1e-12 if y > 0.99 else 1e-14)


@pytest.mark.parametrize("eta", [0.0, 1e-17, -1e-17, 3e-30, -3e-30, 1e-60, -1e-90])
def test_the_corner_at_any_speed_is_the_normal_form(eta: float) -> None:
    for v in (10.0**exponent for exponent in range(-30, -61, -3)):
        solved = solve(v, 1.0, eta)
        mu = solved.mu_ratio
        assert mu * mu * mu + 2.0 * eta * mu == close(
            math.pi * v, rel=1e-9, abs=1e-14 * (mu**3 + abs(eta * mu))
        )
        assert 0.0 <= solved.stick_fraction <= 1.0
        assert solved.power > 0.0
    assert solve(1e-60, 1.0).mu_ratio == close((math.pi * 1e-60) ** (1.0 / 3.0), rel=4e-15)


# --- the power ------------------------------------------------------------------------------------


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


@pytest.mark.parametrize("share", [1e-6, 0.1, 0.9, 1.1, 10.0])
@pytest.mark.parametrize("y", [1e-15, 1e-30, 1e-70])
def test_the_table_continues_the_solver_down_to_any_amplitude(share: float, y: float) -> None:
    # everything depends on v~/y~^2 alone; the power is y~^4 times a function of it
    s = opened(1e-12)
    at = Y_RANGE[0]
    solved = solve(share * 0.5 * at * at, at)
    stick, stick_bound = s.quantity("stick_fraction", share * 0.5 * y * y, y)[:2]
    power, power_bound = s.quantity("power", share * 0.5 * y * y, y)[:2]
    assert abs(stick - solved.stick_fraction) <= stick_bound + 1e-14
    assert abs(power / y**4 - solved.power / at**4) <= power_bound / y**4 + 1e-13 * power / y**4


# --- large amplitudes and speeds ------------------------------------------------------------------


@pytest.mark.parametrize("x", [1e-30, 1e-3, 0.1, 0.45, 0.5, 2.0, 50.0, 900.0])
def test_layers_at_the_turns_depend_on_one_number(x: float) -> None:
    """(mu~ - (2/pi) K(i y~/v~)) y~/v~ = G(x) + O(1/y~)."""

    def layer(y: float) -> float:
        v = x * math.sqrt(y)
        return (solve(v, y).mu_ratio - float(outer(y / v))) * y / v

    expected = layer(1e14)
    for y in (1e11, 1e12, 1e13):
        # y~/v~ multiplies the rounding error of mu~ y~/v~ = (2/pi) ln(4 y~/v~) + G
        rounding = 4e-15 * (math.log(4.0 * math.sqrt(y) / x) + abs(expected))
        assert layer(y) == close(expected, abs=2.0 / y + rounding)


def test_fast_sliding_meets_the_two_terms_of_the_closed_form() -> None:
    for v, y in ((1e8, 1e-8), (1e8, 1.0), (1e8, 1e7), (5e7, 1e12), (1e10, 1e14), (1e10, 1e-15)):
        two_terms = float(outer(y / v)) + float(second_order(y / v)) / v**2
        assert solve(v, y).mu_ratio == close(two_terms, rel=1e-6)
    assert solve(1e10, 1e-3).deficit == close(0.25e-26, rel=1e-14)


def test_the_smallest_slip_speed_is_seen_in_stiff_steps() -> None:
    # stiff steps once missed the turn: 1e12 instead of 3e7
    for v, y in ((3e7, 1e12), (300.0, 200.0), (1e3, 1e5)):
        assert solve(v, y).min_slip_speed == close(v, rel=5e-3)


# --- monotony -------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("along", "fixed"),
    [
        *(("v", y) for y in (1e-15, 1e-12, 0.5, 1.0, 1.3, 1e5, 1e14)),
        *(("y", v) for v in (1e-60, 1e-40, 1e-18, 1e-3, 1.0, 1e5, 1e10)),
    ],
)
def test_mu_rises_with_speed_and_falls_with_amplitude_everywhere(
    along: str, fixed: float, sweep: Sweep
) -> None:
    moving, still = (
        np.geomspace(*(V_RANGE if along == "v" else Y_RANGE), 3000),
        np.full(3000, fixed),
    )
    solved = sweep.solve("full", *((moving, still) if along == "v" else (still, moving)))
    for name, sign in (("mu_ratio", 1.0), ("deficit", -1.0)):
        rise = (sign if along == "v" else -sign) * np.diff(solved[name])
        assert np.all(rise >= -RELATIVE_ERROR * solved[name][1:]), name


# --- the error estimate ---------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("limits", [(-3.0, 3.0), (-12.0, 8.0), (-59.9, -12.0), (-59.9, 9.9)])
def test_error_estimate_covers_neighbouring_doubles(
    limits: tuple[float, float], sweep: Sweep
) -> None:
    rng = np.random.default_rng(8)
    v = 10.0 ** rng.uniform(*limits, 800)
    y = 10.0 ** rng.uniform(*(limits if limits[0] > -50.0 else (-3.0, 14.0)), 800)
    one = sweep.solve("full", v, y)
    assert np.all(one["error_estimate"] > 0.0)
    for ulps in (-3, -2, -1, 1, 2, 3):
        other = sweep.solve("full", v + ulps * np.spacing(v), y)
        assert np.all(np.abs(other["mu_ratio"] - one["mu_ratio"]) <= one["error_estimate"])

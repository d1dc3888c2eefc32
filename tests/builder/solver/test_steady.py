"""The exact solver: an independent quadruple-precision solver, a naive one, the orbit, limits and
events.

Energy balance, monotony and error estimate over the whole range are in test_extremes.py.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import fixed_quad

from builder.solver import sections, steady
from builder.solver import slip as slip_phase
from builder.solver.slip import (
    ANGLE,
    CHART,
    MIN_SPEED,
    OK,
    PATH,
    SIGMA,
    SUM_UX,
    WORK,
    slip,
)
from builder.solver.steady import ADVICE, V_RANGE, Y_RANGE, border, solve, solve_raw, workspace
from builder.solver.sweep import Sweep
from mumacro import InputError
from mumacro.closed_forms import outer, second_order
from tests.support import naive
from tests.support.cases import log_uniform
from tests.support.comparing import close
from tests.support.refusals import refused

ORDINARY = [(0.1, 0.5), (2.0, 1.0), (0.05, 3.0), (0.3, 1.0), (0.6, 1.9), (0.02, 1.05), (1.5, 20.0)]
STICKING = [
    (0.1, 0.5),
    (0.05, 3.0),
    (0.3, 1.0),
    (0.6, 1.9),
    (1e-6, 0.7),
    (1e-6, 1.0),
    (1e-5, 5.0),
    (1.5, 20.0),
]
SLIDING = [(2.0, 1.0), (0.5, 0.3), (1.0, 3.0), (20.0, 0.01), (30.0, 400.0), (0.05, 0.3)]


# --- against the reference ------------------------------------------------------------------------


@pytest.mark.parametrize(
    "case", ["random", "creep", "tail_vinf", "tail_y0", "tail_yinf", "border", "corner"]
)
def test_reference_points_are_met_to_rounding(case: str, reference: Any, sweep: Sweep) -> None:
    at = reference.case == case
    assert at.sum() >= 12
    # raises unless every status is success
    solved = sweep.solve("full", reference.v[at], reference.y[at])
    error = np.abs(solved["mu_ratio"] - reference.mu_ratio[at])
    assert error.max() <= 3e-16
    assert (error / reference.mu_ratio[at]).max() <= 2e-15
    assert (error <= solved["error_estimate"]).all()
    # the end of slip is a grazing root next to the border, known to about 1e-16 / sqrt(1 -
    # v~/v~crit)
    stick = np.abs(solved["stick_fraction"] - reference.stick_fraction[at])
    assert stick.max() <= (2e-12 if case == "border" else 2e-15)
    for v, y, regime in zip(reference.v[at], reference.y[at], reference.regime[at], strict=True):
        assert (solve(v, y).ok, solve(v, y).regime) == (True, regime)


@pytest.mark.parametrize(("v", "y"), ORDINARY)
def test_a_naive_solver_that_does_not_use_the_symmetry_agrees(v: float, y: float) -> None:
    mu = solve(v, y).mu_ratio
    coarse, fine = (naive.mu_ratio(v, y, steps) - mu for steps in (8_000, 16_000))
    assert abs(fine) < 1e-4
    assert coarse / fine == close(2.0, abs=0.03)
    assert abs(2.0 * fine - coarse) < 2e-6  # error after extrapolation of the first-order term
    orbit = naive.march(v, y, 4_000, naive.periods_until_steady(v, y))  # whole periods
    assert np.abs(orbit[2_000:] - orbit[:2_000] * (1.0, -1.0)).max() < 1e-14


# --- the orbit itself -----------------------------------------------------------------------------


@pytest.mark.parametrize(("v", "y"), SLIDING)
def test_continuous_orbit_closes_over_a_whole_period(v: float, y: float) -> None:
    w, out, _, _ = workspace()
    assert steady.continuous(v, y, w, out) == OK
    start, chart = out[ANGLE], int(out[CHART])  # at sigma = pi/2 half a period has passed
    half_turn = chart * 0.5 * math.pi + start
    # the other half, with the shaker moving the other way, is the mirror image: start it from the
    # mirrored angle
    assert slip(v, y, -0.5 * math.pi, 0, -start, -chart, 0.5 * math.pi, False, w, out) == OK
    assert out[CHART] * 0.5 * math.pi + out[ANGLE] == close(half_turn, abs=4e-15)
    assert out[MIN_SPEED] > 0.0


@pytest.mark.parametrize(("v", "y"), STICKING)
def test_sticking_orbit_closes_and_its_stick_phase_works_as_computed_by_quadrature(
    v: float, y: float
) -> None:
    w, out, orbit, res = workspace()
    assert solve_raw(v, y, y - 1.0, w, out, orbit, res) == OK
    duration, ux0, _, uy0, start, end = orbit
    assert duration == close(math.pi - start + end, abs=1e-15)
    assert math.hypot(ux0, uy0) == close(1.0, abs=4e-16)

    def ux(s: Any) -> Any:
        return ux0 + v * (s - start)

    def uy(s: Any) -> Any:
        return uy0 - 2.0 * y * np.sin(0.5 * (s + start)) * np.sin(0.5 * (s - start))

    def effort(s: Any) -> Any:
        return -y * np.sin(s) * uy(s)

    # slip stops where lam = 0; stick ends where |u| = 1 again, and never passes it in between
    assert v * ux(start) - y * math.sin(start) * uy(start) == close(0.0, abs=1e-15 * (1.0 + y))
    stop = start + duration
    assert math.hypot(ux(stop), uy(stop)) == close(1.0, abs=4e-15)
    inside = np.linspace(start, stop, 20_001)[1:-1]
    assert np.hypot(ux(inside), uy(inside)).max() <= 1.0 + 4e-15

    stick_mean = fixed_quad(ux, start, stop, n=200)[0]
    shaker = fixed_quad(effort, start, stop, n=200)[0]
    # the spring stores no net energy
    assert v * stick_mean + shaker == close(0.0, abs=1e-13 * (1.0 + y))

    assert (stick_mean + out[SUM_UX]) / math.pi == close(res[steady.MU_RATIO], abs=1e-15)
    assert (shaker + out[WORK]) / math.pi == close(res[steady.POWER], abs=1e-13 * (1.0 + y))
    assert out[PATH] / math.pi == close(res[steady.SLIP_SPEED], rel=1e-15)
    # the work of drive and shaker during slip equals the dissipation: during stick they do none
    # together, see above
    assert (v * out[SUM_UX] + out[WORK]) / math.pi == close(res[steady.SLIP_SPEED], rel=2e-15)
    # and slip ends, mirrored, exactly where stick started
    assert out[SIGMA] == close(start, abs=1e-14)


# --- limits ---------------------------------------------------------------------------------------


def polar(radius: float, psi: float) -> float:
    """mu~/phi - 1 at polar coordinates of the corner, where mu~ = phi (1 + a(psi) R^2 + ...) at eta
    = y~ - 1 exact."""
    phi, s0 = radius * math.sin(psi) / math.sqrt(2.0), math.sqrt(2.0) * radius * math.cos(psi)
    eta = 0.25 * (s0 * s0 - 2.0 * phi * phi)
    return solve(phi * s0 * s0 / (2.0 * math.pi), 1.0 + eta, eta).mu_ratio / phi - 1.0


def static(v: float, y: float) -> float:
    return solve(v, y).mu_ratio - math.sqrt(1.0 - y * y) - math.pi / (2.0 * (1.0 - y * y)) * v


def fast(v: float, r: float) -> float:
    return solve(v, r * v).mu_ratio - float(outer(r))


#: error of a limit, the parameter at three places, each a share of the last; the order of the
#: error, and within what
LIMITS: list[tuple[Callable[..., float], tuple[float, float, float], float, float]] = [
    # eq. (16)
    *((lambda v, y=y: static(v, y), (1e-5, 1e-6, 1e-7), 1.5, 0.05) for y in (0.1, 0.5, 0.9)),
    *(
        (
            lambda y, v=v: solve(v, y).deficit / (y * y / (4.0 * (1.0 + v * v))) - 1.0,
            (0.08, 0.04, 0.02),
            2.0,
            0.05,
        )
        for v in (0.5, 3.0, 100.0)
    ),  # eq. (31)
    *((lambda x, r=r: fast(1.0 / x, r), (0.02, 0.01, 0.005), 2.0, 0.02) for r in (0.3, 1.0, 7.0)),
    *(
        (
            lambda x, r=r: (
                fast(max(1.0, 3.0 * r) / x, r)
                - float(second_order(r)) * (x / max(1.0, 3.0 * r)) ** 2
            ),
            (1 / 15, 1 / 30, 1 / 60),
            4.0,
            0.1,
        )
        for r in (0.3, 1.0, 7.0)
    ),
    (
        lambda v: solve(v, 1.0).mu_ratio / math.cbrt(math.pi * v) - 1.0,
        (1e-4, 1e-6, 1e-8),
        2.0 / 3.0,
        0.02,
    ),
    *(
        (lambda radius, psi=psi: polar(radius, psi), (0.02, 0.01, 0.005), 2.0, 0.05)
        for psi in (0.1, 0.7, 1.3)
    ),
]


@pytest.mark.parametrize(("error", "places", "order", "within"), LIMITS)
def test_a_limit_has_the_order_of_its_error(
    error: Callable[[float], float], places: tuple[float, ...], order: float, within: float
) -> None:
    first, one, two = (error(place) for place in places)
    assert abs(first) > abs(one)
    assert math.log(abs(one / two)) / math.log(places[1] / places[2]) == close(order, abs=within)


# --- events ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("y", [0.1, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("v", [1e-10, 1e-12, 1e-16])
def test_slip_shorter_than_any_scan_step_is_found(v: float, y: float) -> None:
    solved = solve(v, y)
    assert solved.ok
    assert solved.regime == "stick_slip"
    slip_share = 1.0 - solved.stick_fraction
    assert 0.0 < slip_share < 1.0 / 24.0  # the scan for the end of stick has 24 steps
    # next to the turn of the shaker slip lasts sqrt(2 pi v~ / (y~^2 phi)), phi from the normal form
    phi = math.sqrt(1.0 - y * y) if y < 1.0 else math.cbrt(math.pi * v)
    assert slip_share * math.pi == close(math.sqrt(2.0 * math.pi * v / (y * y * phi)), rel=0.05)


@pytest.mark.parametrize("y", [0.01, 0.3, 0.74, 1.0, 1.5, 4.69, 30.0, 1e3, 1e6, 4.4e7])
@pytest.mark.parametrize("distance", [1e-6, 1e-8, 1e-9, 1e-10, 1e-12])
def test_dip_of_the_slip_speed_between_two_samples_is_seen(
    y: float, distance: float, sweep: Sweep
) -> None:
    crit, mu_crit = steady.border(y)
    below, above = solve(crit * (1.0 - distance), y), solve(crit * (1.0 + distance), y)
    assert above.regime == "continuous"
    assert above.stick_fraction == 0.0
    assert above.min_slip_speed > 0.0
    assert below.regime == "stick_slip"
    assert 0.0 < below.stick_fraction < 10.0 * math.sqrt(distance)
    assert below.min_slip_speed < 0.0  # of the continuous orbit, which is therefore not admissible
    assert below.mu_ratio == close(mu_crit, abs=distance)
    if distance <= 1e-8:
        # stick changes mu~ by O(distance^2) only: the continuous orbit has all digits
        smooth = sweep.solve("continuous", np.array([crit * (1.0 - distance)]), np.array([y]))[
            "mu_ratio"
        ][0]
        assert below.mu_ratio == close(smooth, rel=2e-15)


def test_at_distances_down_to_the_last_digit_of_the_border_both_orbits_agree(sweep: Sweep) -> None:
    rng = np.random.default_rng(11)
    y = log_uniform(rng, 1e-6, 1e7, 3000)
    crit = sweep.solve("border", np.ones_like(y), y)["deficit"]
    digits = rng.integers(-9, 10, y.size) * 2.0**-53
    v = crit * (
        1.0 - np.where(rng.random(y.size) < 0.5, log_uniform(rng, 1e-15, 1e-8, y.size), digits)
    )
    full, smooth = sweep.solve("full", v, y), sweep.solve("continuous", v, y)
    assert np.abs(full["mu_ratio"] / smooth["mu_ratio"] - 1.0).max() <= 2e-14
    assert np.abs(full["mu_ratio"] - smooth["mu_ratio"]).max() <= 5e-15
    near = np.abs(v / crit - 1.0) < 1e-14
    assert np.abs(full["mu_ratio"] / smooth["mu_ratio"] - 1.0)[near].max() <= 4e-15
    assert np.all(full["stick_fraction"][near] < 1e-6)


@pytest.mark.parametrize(
    ("v", "y"),
    [
        (664.7124280390522, 1945395.0718579162),
        (16.1616495648675, 1150.1778879709827),
        (58.47308290852632, 15054.150365501297),
        (0.7272825042625067, 2.5476378745026613),
        (2.1166902828860522e-08, 0.0002057518077793017),
        (162.21066084094238, 115850.92347138077),
    ],
)
def test_orbit_lost_on_the_border_itself_is_no_answer(v: float, y: float) -> None:
    # mu~ was once -0.39 here, as "success", or the section failed: its root equals its edge to
    # rounding
    solved = solve(v, y)
    assert solved.ok
    assert solved.mu_ratio == close(steady.border(y)[1], rel=1e-14)


# --- inputs and failures --------------------------------------------------------------------------


@pytest.mark.parametrize("bad", [0.0, -1.0, -0.0, math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(("field", "bounds"), [("v_tilde", V_RANGE), ("y_tilde", Y_RANGE)])
def test_inputs_out_of_range_are_named(
    field: str, bounds: tuple[float, float], bad: float, sweep: Sweep
) -> None:
    low, high = bounds
    for value in (bad, np.nextafter(low, 0.0), np.nextafter(high, math.inf)):
        point = (value, 0.5) if field == "v_tilde" else (0.5, value)
        for ask in (lambda at=point: solve(*at), lambda at=point: sweep.solve("full", *at)):
            with refused(field) as caught:
                ask()
            assert repr(caught.value.value) == repr(float(value))
            assert f"from {low:g} to {high:g}" in caught.value.bound
            assert "a table answers" in caught.value.bound
        if field == "y_tilde":
            with refused("y_tilde"):
                border(value)


@pytest.mark.parametrize("eta", [math.nan, 0.1, -0.5 + 1e-15])
def test_an_excess_must_be_that_of_the_amplitude(eta: float, sweep: Sweep) -> None:
    for ask in (
        lambda: solve(0.1, 0.5, eta),
        lambda: sweep.solve("full", np.array([0.1]), np.array([0.5]), np.array([eta])),
    ):
        with pytest.raises(InputError, match=r"eta.* must be y_tilde - 1 to rounding"):
            ask()


def test_every_status_has_advice() -> None:
    codes = {
        slip_phase.OK,
        slip_phase.NO_SLIP,
        slip_phase.NO_STICK,
        slip_phase.TOO_MANY_STEPS,
        slip_phase.DIVERGED,
        sections.NOT_CONVERGED,
    }
    assert codes == set(ADVICE)
    assert all(ADVICE.values())

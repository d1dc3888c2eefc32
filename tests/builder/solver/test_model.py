"""The equations of motion: series, slip, stick and events, against general-purpose integrators and
exact structure."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from builder.solver.radau import RADAU_DIFF, RADAU_NODES, RADAU_WEIGHTS
from builder.solver.slip import (
    ANGLE,
    CHART,
    NO_STICK,
    OK,
    PATH,
    SIGMA,
    STEPS,
    SUM_UX,
    TURNED,
    WORK,
    slip,
)
from builder.solver.steady import workspace
from builder.solver.stick import stick_excess
from tests.support.cases import Array
from tests.support.comparing import close

HALF = 0.5 * math.pi


def follow(
    v: float, y: float, start: float, angle: float, end: float, chart: int = 0
) -> tuple[float, Array]:
    """Angle after slip from ``start`` to ``end`` in sigma, and all other outputs of slip."""
    w, out, _, _ = workspace()
    assert slip(v, y, start, 0, angle - chart * HALF, chart, end, False, w, out) == OK
    return out[CHART] * HALF + out[ANGLE], out.copy()


def witness(v: float, y: float, start: float, angle: float, end: float, **how: Any) -> Array:
    """Angle, integrals of u_x, 1 - u_x, lam and y~ cos tau u_y in the time sigma = tau - pi/2; eqs.
    (11), (12)."""

    def rate(sigma: float, state: Array) -> list[float]:
        c, th = -math.sin(sigma), state[0]
        lam = v * math.cos(th) + y * c * math.sin(th)
        return [
            y * c * math.cos(th) - v * math.sin(th),
            math.cos(th),
            1.0 - math.cos(th),
            lam,
            y * c * math.sin(th),
        ]

    def jacobian(sigma: float, state: Array) -> Array:
        c, out = -math.sin(sigma), np.zeros((5, 5))
        cos, sin = math.cos(state[0]), math.sin(state[0])
        out[:, 0] = [-v * cos - y * c * sin, -sin, sin, y * c * cos - v * sin, y * c * cos]
        return out

    implicit: Any = {"jac": jacobian} if how["method"] == "Radau" else {}
    return np.asarray(
        solve_ivp(rate, (start, end), [angle, 0, 0, 0, 0], **implicit, **how).y[:, -1]
    )


@pytest.mark.parametrize(
    ("v", "y"), [(0.5, 0.3), (2.0, 1.0), (0.01, 0.7), (3.0, 30.0), (40.0, 5.0)]
)
@pytest.mark.parametrize("angle", [-1.2, 0.0, 0.4, 1.5])
def test_slip_and_its_integrals_agree_with_a_general_integrator(
    v: float, y: float, angle: float
) -> None:
    start, end = -1.3, 1.1
    expected = witness(v, y, start, angle, end, method="DOP853", rtol=1e-13, atol=1e-14)
    th, out = follow(v, y, start, angle, end)
    assert th == close(expected[0], abs=3e-12)
    assert out[TURNED] == close(expected[0] - angle, abs=3e-12)
    assert out[SUM_UX : WORK + 1] == close(expected[1:], abs=3e-11 * (1.0 + y))
    assert out[SIGMA] == end


@pytest.mark.parametrize(("v", "y"), [(300.0, 200.0), (1000.0, 20.0), (100.0, 5000.0)])
def test_stiff_steps_agree_with_a_general_integrator(v: float, y: float) -> None:
    expected = witness(v, y, -HALF, 0.3, HALF, method="Radau", rtol=1e-10, atol=1e-12)
    th, out = follow(v, y, -HALF, 0.3, HALF)
    # a Taylor step is at most 0.33 ORDER = 7.9 lengths long
    assert out[STEPS] < 0.5 * (out[PATH] / 7.9)
    assert th == close(expected[0], abs=1e-7)
    assert out[SUM_UX : WORK + 1] == close(expected[1:], rel=1e-7, abs=1e-7)


@pytest.mark.parametrize(("v", "y"), [(0.5, 0.3), (0.05, 3.0), (1.2, 8.0), (0.0, 1.7), (3.0, 0.0)])
@pytest.mark.parametrize("span", [(-1.5, -0.2), (-0.4, 0.9), (0.1, 1.5)])
def test_slip_is_a_moebius_map_of_the_half_angle_tangent(
    v: float, y: float, span: tuple[float, float]
) -> None:
    """z = tan(th/2) solves a Riccati equation, so the cross ratio of four orbits never changes."""

    def cross_ratio(th: list[float]) -> float:
        a, b, c, d = (math.tan(0.5 * t) for t in th)
        return (a - c) * (b - d) / ((a - d) * (b - c))

    starts = [-1.3, -0.2, 0.5, 1.4]
    ends = [follow(v, y, span[0], th, span[1])[0] for th in starts]
    gap = min(abs(a - b) for i, a in enumerate(ends) for b in ends[:i])
    assert cross_ratio(ends) == close(cross_ratio(starts), rel=1e-14 / gap + 1e-13)


@pytest.mark.parametrize("chart", [-1, 0, 1])
def test_charts_describe_the_same_orbit(chart: int) -> None:
    plain, one = follow(0.4, 0.9, -1.0, 0.7, 0.5)
    other, two = follow(0.4, 0.9, -1.0, 0.7, 0.5, chart)
    assert other == close(plain, abs=2e-15)
    assert two[TURNED : WORK + 1] == close(one[TURNED : WORK + 1], abs=3e-15)


@pytest.mark.parametrize("turn", [0, -1])
@pytest.mark.parametrize("sigma", [1e-9, 0.3, 1.2])
def test_time_may_count_from_either_turn(turn: int, sigma: float) -> None:
    w, out, _, _ = workspace()
    start = sigma + turn * math.pi
    assert slip(0.7, 2.0, sigma, turn, 0.2, 0, 1.4, False, w, out) == OK
    counted = out.copy()
    assert slip(0.7, 2.0, start, 0, 0.2, 0, 1.4, False, w, out) == OK
    assert counted[: WORK + 1] == close(out[: WORK + 1], abs=2e-14)


# --- stick ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("chart", [0, 1])
@pytest.mark.parametrize("d", [0.0, 0.05, 0.5, 1.7, 3.0])
def test_stick_excess_is_the_deflated_stretch(chart: int, d: float) -> None:
    """At its double root d = 0 it is the fall of the slip speed: -y~ sin tau u_y + |w|^2 of u.w
    with u' = w."""
    v, y, sigma = 0.05, 0.8, 0.3
    th = math.atan2(v, y * math.sin(sigma))  # lam = 0 ties the angle to the instant
    ux = math.cos(th) + v * d
    uy = math.sin(th) + y * (math.cos(sigma + d) - math.cos(sigma))
    fall = -y * math.cos(sigma) * math.sin(th) + v * v + (y * math.sin(sigma)) ** 2
    expected = (ux * ux + uy * uy - 1.0) / (d * d) if d else fall
    excess = stick_excess(
        v, y, y - 1.0, HALF - th if chart else th, chart, sigma, sigma + d - math.pi, d
    )
    assert excess == close(expected, rel=1e-12, abs=1e-13 / (d * d) if d else 0.0)


# --- the end of slip ------------------------------------------------------------------------------


def slip_speed(v: float, y: float, sigma: float, th: float) -> float:
    return v * math.cos(th) - y * math.sin(sigma) * math.sin(th)


@pytest.mark.parametrize(("v", "y"), [(0.05, 0.5), (0.05, 3.0), (0.2, 1.0), (1e-4, 2.0)])
def test_slip_ends_where_the_slip_speed_vanishes_first(v: float, y: float) -> None:
    w, out, _, _ = workspace()
    start, angle = -1.2, 0.6
    assert slip_speed(v, y, start, angle) > 0.0
    assert slip(v, y, start, 0, angle, 0, HALF, True, w, out) == OK
    stop, th = out[SIGMA], out[CHART] * HALF + out[ANGLE]
    assert slip_speed(v, y, stop, th) == close(0.0, abs=3e-15 * (1.0 + y))
    dense = np.linspace(start, stop - 1e-6, 400)
    assert all(slip_speed(v, y, s, follow(v, y, start, angle, s)[0]) > 0.0 for s in dense[1:])


def test_slip_without_an_end_has_its_own_status() -> None:
    w, out, _, _ = workspace()
    assert slip(3.0, 0.5, -HALF, 0, 0.1, 0, HALF, True, w, out) == NO_STICK


# --- collocation ----------------------------------------------------------------------------------


def test_the_radau_rule_is_exact_for_polynomials() -> None:
    n = RADAU_NODES.size
    assert RADAU_NODES[-1] == 1.0
    assert np.all(np.diff(RADAU_NODES, prepend=0.0) > 0.0)
    assert np.all(RADAU_WEIGHTS > 0.0)
    for degree in range(2 * n - 1):
        assert RADAU_WEIGHTS @ RADAU_NODES**degree == close(1.0 / (degree + 1), rel=1e-13)
    full = np.concatenate(([0.0], RADAU_NODES))
    assert RADAU_DIFF.shape == (n, n + 1)
    for degree in range(n + 1):
        slope = degree * RADAU_NODES ** max(degree - 1, 0) if degree else np.zeros(n)
        assert RADAU_DIFF @ full**degree == close(slope, abs=2e-11 * n)

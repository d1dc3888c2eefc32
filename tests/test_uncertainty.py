"""Gradient and power compared with the full model, with closed forms, with a time integration."""

import math

import mpmath
import numpy as np
import pytest
from scipy.stats import norm, qmc

from builder.steady import solve
from comparing import close

CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
# stick-slip below and above y~ = 1, beside the border, continuous sliding, far above the border
PLACES = {
    "creep": {"v0": 1e-3}, "stick-slip": {}, "large amplitude": {"y0": 1e-5}, "continuous": {"v0": 0.3},
    "fast": {"v0": 5.0, "y0": 2e-5}, "beside the border": {"v0": 0.0714},
}  # fmt: skip


def full_model(columns):
    """mu_macro [-] of the full model for columns (n,) of the six inputs, without a table."""
    mu0, load, k, y0, omega, v0 = columns
    length = mu0 * load / k
    places = zip((v0 / (length * omega)).tolist(), (y0 / length).tolist(), strict=True)
    return mu0 * np.array([solve(v, y).mu_ratio for v, y in places])


@pytest.mark.parametrize("place", PLACES)
def test_first_order_uncertainty_agrees_with_the_full_model(surrogate, sweep, place):
    """The standard deviation of mu_macro to first order, compared with solves at random inputs."""
    case = {**CASE, **PLACES[place]}
    share = {"mu0": 0.004, "Fz": 0.003, "k": 0.004, "y0": 0.003, "omega": 0.002, "v0": 0.005}
    std = {name: share[name] * value for name, value in case.items()}
    answer = surrogate.evaluate(case, gradient=True)
    first_order = math.sqrt(sum((answer.gradient[name] * std[name]) ** 2 for name in case))
    points = norm.ppf(qmc.Sobol(6, rng=np.random.default_rng(11)).random(1024))
    columns = np.array(list(case.values())) + points * np.array(list(std.values()))
    mu0, load, k, y0, omega, v0 = columns.T
    length = mu0 * load / k
    sampled = mu0 * sweep.solve("full", v0 / (length * omega), y0 / length)["mu_ratio"]
    # second-order terms are of the size of the inputs' relative deviations
    assert first_order == close(sampled.std(), rel=0.01)
    assert sampled.mean() == close(answer.mu_macro, abs=0.02 * first_order)


@pytest.mark.parametrize("place", PLACES)
def test_the_gradient_is_that_of_the_full_model(surrogate, place):
    case = {**CASE, **PLACES[place]}
    gradient = surrogate.evaluate(case, gradient=True).gradient
    for i, (name, value) in enumerate(case.items()):
        step = np.zeros((6, 4))
        step[i] = 1e-4 * value * np.array([-2.0, -1.0, 1.0, 2.0])
        f = full_model(np.array(list(case.values()))[:, None] + step)
        slope = (8.0 * (f[2] - f[1]) - (f[3] - f[0])) / (12.0 * 1e-4)  # d mu_macro / d ln input, fourth order
        assert gradient[name] * value == close(slope, rel=1e-7, abs=3e-10), name


def closed_form(mu0, Fz, k, y0, omega, v0):
    """mu_macro in 40 digits: eq. (35) for rigid contact, creep to first order in v0 for an elastic one below y~ = 1."""
    if k == math.inf:
        return mu0 * 2 / mpmath.pi * mpmath.ellipk(-((y0 * omega / v0) ** 2))
    v, y = v0 * k / (mu0 * Fz * omega), y0 * k / (mu0 * Fz)
    return mu0 * (mpmath.sqrt(1 - y * y) + mpmath.pi * v / (2 * (1 - y * y)))


RIGID = [{"k": math.inf, "v0": CASE["y0"] * CASE["omega"] / ratio} for ratio in (1e-4, 0.1, 1.0, 30.0, 1e6)]
AT_REST = [{"v0": 0.0, "y0": 3e-6 * share} for share in (1e-4, 0.3, 0.99)]


@pytest.mark.parametrize("place", RIGID + AT_REST)
def test_the_gradient_is_that_of_the_closed_form(surrogate, place):
    case = {**CASE, **place}
    one, many = (surrogate.evaluate({**case, "mu0": mu0}, gradient=True) for mu0 in (0.3, np.full(3, 0.3)))
    for i, (name, value) in enumerate(case.items()):
        with mpmath.workdps(40):
            inputs = tuple(mpmath.mpf(x) for x in case.values())
            slope = (
                0.0 if value == math.inf else float(mpmath.diff(closed_form, inputs, tuple(np.eye(6, dtype=int)[i])))
            )
        # relative to the input, rounding may move it by a digit of mu_macro
        assert one.gradient[name] == close(slope, rel=1e-12, abs=3e-17 / value if value else 0.0), name
        assert abs(one.gradient[name] - slope) <= one.gradient_bound[name], name
        np.testing.assert_array_equal(many.gradient[name], one.gradient[name])
        np.testing.assert_array_equal(many.gradient_bound[name], one.gradient_bound[name])


@pytest.mark.slow
@pytest.mark.parametrize("place", PLACES)
def test_the_power_is_that_of_a_plain_time_integration(surrogate, naive, place):
    answer = surrogate.evaluate({**CASE, **PLACES[place]})
    v, y = answer.v_tilde, answer.y_tilde
    periods = 1 + naive.periods_until_steady(v, y)
    means = []
    for steps in (20_000, 40_000):
        orbit = naive.march(v, y, steps, periods)
        # midpoint rule: velocities at the middle of a step, elongations at both ends
        tau = 2.0 * math.pi * (np.arange(steps) + 0.5) / steps
        before = np.roll(orbit, 1, axis=0)
        middle = 0.5 * (orbit + before)
        means.append((np.mean(y * np.cos(tau) * middle[:, 1]), np.mean(middle[:, 0])))
    (p1, m1), (p2, m2) = means
    p, mu = 2.0 * p2 - p1, 2.0 * m2 - m1  # the error is proportional to the step
    assert mu == close(answer.mu_ratio, rel=2e-5)
    assert p == close(surrogate.power(v, y), rel=1e-4)

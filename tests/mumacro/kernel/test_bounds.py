"""Every bound covers its error in the hardest cases: exact inputs, corner, border; gradients and
power."""

import math
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from mpmath import mp, mpf, workdps

from builder.solver.sweep import Sweep
from mumacro import Surrogate
from mumacro.inputs.fields import FIELDS
from mumacro.table.atlas import CONTINUOUS, REGIME_OF_SOURCE
from mumacro.table.netcdf import read_table
from tests.support import naive
from tests.support.cases import CASE, UNIT, Case, log_uniform, tables
from tests.support.comparing import close
from tests.support.places import TABLES

table = tables()
fine = tables(1e-12)


# --- inputs with groups that are not doubles ------------------------------------------------------


def exact_groups(case: Case) -> tuple[Fraction, Fraction]:
    """(v~, y~ - 1) of the doubles, in rational arithmetic."""
    mu0, Fz, k, y0, omega, v0 = (Fraction(case[name]) for name in FIELDS)
    return v0 * k / (mu0 * Fz * omega), y0 * k / (mu0 * Fz) - 1


def corner_ratio(case: Case) -> float:
    """mu~ next to the corner from exact groups: the root of mu~^3 + 2 (y~ - 1) mu~ = pi v~, off by
    O(mu~^3)."""
    v, eta = exact_groups(case)
    with workdps(60):
        p, q = 2 * mpf(eta.numerator) / eta.denominator, mp.pi * v.numerator / v.denominator
        return float(
            mp.findroot(lambda phi: phi**3 + p * phi - q, mp.cbrt(q) + mp.sqrt(max(-p, mpf(0))))
        )


@pytest.mark.parametrize("still", [True, False])
def test_the_last_digit_of_the_inputs_next_to_the_corner_is_covered(
    table: Surrogate, still: bool
) -> None:
    """y~ is 1 but for rounding of a product of four doubles; v~ from 0 to where mu~ is 1e-5."""
    rng, worst = np.random.default_rng(31), 0.0
    for _ in range(400 if table.tolerance == 1e-12 else 40):
        mu0, Fz, k = (
            rng.uniform(0.1, 1.0),
            10.0 ** rng.uniform(-2.0, 3.0),
            10.0 ** rng.uniform(3.0, 8.0),
        )
        y0 = mu0 * Fz / k * (1.0 + int(rng.integers(-4, 5)) * 2.0**-52)
        omega = 10.0 ** rng.uniform(0.0, 5.0)
        v0 = 0.0 if still else 10.0 ** rng.uniform(-40.0, -16.0) * mu0 * Fz * omega / k
        case = dict(zip(FIELDS, (mu0, Fz, k, y0, omega, v0), strict=True))
        _, eta = exact_groups(case)
        truth = math.sqrt(max(float(-eta * (2 + eta)), 0.0)) if still else corner_ratio(case)
        answer = table.evaluate(case)
        bound = answer.error_bound / mu0
        assert abs(answer.mu_ratio - truth) <= bound + truth**3
        assert bound < 1e-5
        worst = max(worst, abs(answer.mu_ratio - truth) / bound if bound else 0.0)
    # such inputs exist, and the bound is not excessive
    assert worst > 0.2 or table.tolerance != 1e-12


def test_the_last_digit_of_the_inputs_beside_the_border_is_covered() -> None:
    """Also by a table whose border is exact."""
    path = TABLES / "mumacro-1e-12.nc"
    exact = read_table(path)
    for piece in exact.border:
        piece.max_rel_error = 0.0
    table, rng = Surrogate(exact, path), np.random.default_rng(3)
    y = 10.0 ** rng.uniform(-3.0, 5.0, 4000)
    v = table.v_tilde_crit(y) * (1.0 - rng.integers(0, 9, y.size) * 2.0**-53)
    stick, bound, _ = table.quantity("stick_fraction", v, y)
    for digits in (-2, -1, 1, 2):
        other, its_bound, _ = table.quantity("stick_fraction", v + digits * np.spacing(v), y)
        assert np.all(np.abs(other - stick) <= bound + its_bound)


@pytest.mark.parametrize("y0", [1e-6, 2.9e-6, 3.1e-6, 1e-5])
def test_the_slope_along_speed_is_not_lost_where_the_group_underflows(
    fine: Surrogate, y0: float
) -> None:
    case = {**CASE, "y0": y0, "omega": 1e300, "v0": 1e-30}
    still = fine.evaluate({**case, "v0": 0.0}, gradient=True)
    # there v~ is an ordinary number
    slower = fine.evaluate({**case, "omega": 1e250}, gradient=True)
    zero = fine.evaluate({**case, "v0": 5e-324}, gradient=True)
    answer = fine.evaluate(case, gradient=True)
    assert max(zero.v_tilde, answer.v_tilde) < 1e-320
    assert zero.error_bound > 0.0  # also where mu~ itself underflows
    assert zero.gradient["v0"] == still.gradient["v0"] > 0.0
    for other, factor in ((still, 1.0), (slower, 1e-50)):
        expected = factor * other.gradient["v0"]
        slack = answer.gradient_bound["v0"] + factor * other.gradient_bound["v0"]
        assert abs(answer.gradient["v0"] - expected) <= slack + 1e-9 * expected


def test_the_slope_from_rest_on_lies_within_its_bound(fine: Surrogate) -> None:
    """Above y~ = 1 it is read off the table; the finest one stands for the truth."""
    case = {**CASE, "y0": 3e-6 * np.geomspace(1.001, 1000.0, 20_000), "v0": 0.0}
    rough, exact = (s.evaluate(case, gradient=True) for s in (Surrogate.open(1e-4), fine))
    share = np.abs(rough.gradient["v0"] - exact.gradient["v0"]) / rough.gradient_bound["v0"]
    assert 0.4 < share.max() <= 1.0


# --- regime ---------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_regime_that_is_certain_is_that_of_a_fresh_solve(table: Surrogate, sweep: Sweep) -> None:
    rng, n = np.random.default_rng(1), 3000
    y, distance = 10.0 ** rng.uniform(-4.0, 6.0, n), 10.0 ** rng.uniform(-16.0, -2.0, n)
    crit = sweep.solve("border", np.ones_like(y), y)["deficit"]
    v = crit * (1.0 + rng.choice([-1.0, 1.0], n) * distance)
    answer = table.evaluate({**UNIT, "y0": y, "v0": v}, include="groups")
    np.testing.assert_array_equal(answer.v_tilde, v)
    right = (answer.regime_code == CONTINUOUS) == (v >= crit)
    assert np.all(right[answer.regime_certain])
    assert np.all(answer.regime_certain[distance > 2.0 * table.border.max_rel_error + 2e-14])
    np.testing.assert_array_equal(answer.regime_code, REGIME_OF_SOURCE[answer.source_code])
    assert not answer.regime_certain.all()  # next to the border it is reported as uncertain
    for extreme in (
        {"v0": 0.0},
        {"y0": 0.0},
        {"omega": 0.0},
        {"k": "rigid"},
        {"k": 1e308, "Fz": 1e-308},
    ):
        assert table.evaluate(**{**UNIT, "v0": 0.1, "y0": 0.5, **extreme}).regime_certain is True


# --- the gradient in the six inputs ---------------------------------------------------------------


def test_the_gradient_and_its_bound_follow_from_the_slopes(fine: Surrogate) -> None:
    rng, n = np.random.default_rng(17), 2000
    ranges = {
        "mu0": (0.1, 1.0),
        "Fz": (1e-2, 1e3),
        "k": (1e3, 1e8),
        "y0": (1e-8, 1e-4),
        "omega": (1, 1e6),
    }
    columns = {
        name: log_uniform(rng, *ends, n) for name, ends in {**ranges, "v0": (1e-7, 10.0)}.items()
    }
    answer = fine.evaluate(columns, gradient=True)
    mu, along_v, along_y, bound_v, bound_y = fine.slopes(
        answer.v_tilde, answer.y_tilde, bounds=True
    )
    mu0, both, errors = columns["mu0"], along_v + along_y, bound_v + bound_y
    # along mu0 the error of mu~ counts, too: that of the point's cell where it is the smaller one
    of_mu = answer.gradient_bound["mu0"] - errors
    assert np.all((of_mu >= 0.0) & (of_mu <= answer.error_bound / mu0 * (1.0 + 1e-9)))
    assert np.mean(of_mu < 0.5 * answer.error_bound / mu0) > 0.2
    logarithmic = {
        "mu0": (mu - both, of_mu + errors),
        "Fz": (-both, errors),
        "k": (both, errors),
        "y0": (along_y, bound_y),
        "omega": (-along_v, bound_v),
        "v0": (along_v, bound_v),
    }
    for name, (slope, bound) in logarithmic.items():
        scale = mu0 / columns[name]
        np.testing.assert_allclose(
            answer.gradient[name], scale * slope, rtol=1e-12, atol=1e-14 * np.abs(scale).max()
        )
        np.testing.assert_allclose(answer.gradient_bound[name], scale * bound, rtol=1e-9)


def test_the_slope_along_a_huge_amplitude_is_that_of_the_values(fine: Surrogate) -> None:
    """There the last piece of the border tells how a coordinate changes with y~."""
    y, steps = np.geomspace(1.4e5, 1e7, 40), 2.0**-7 * np.array([-3, -2, -1, 1, 2, 3])
    for share in (0.3, 0.8):
        v = share * fine.v_tilde_crit(y)
        values, _, _ = fine.quantity("mu_ratio", v[:, None], y[:, None] * np.exp(steps))
        slope = values @ np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) / 60.0 * 2.0**7
        rows = fine.slopes(v, y, bounds=True)
        assert np.all(np.abs(rows[2] - slope) <= rows[4] + 1e-15)


def closed_form(mu0: Any, Fz: Any, k: Any, y0: Any, omega: Any, v0: Any) -> Any:
    """mu_macro in 40 digits: eq. (35) for rigid contact, creep to first order in v0 for an elastic
    one below y~ = 1."""
    if k == math.inf:
        return mu0 * 2 / mpmath.pi * mpmath.ellipk(-((y0 * omega / v0) ** 2))
    v, y = v0 * k / (mu0 * Fz * omega), y0 * k / (mu0 * Fz)
    return mu0 * (mpmath.sqrt(1 - y * y) + mpmath.pi * v / (2 * (1 - y * y)))


RIGID = [
    {"k": math.inf, "v0": CASE["y0"] * CASE["omega"] / ratio}
    for ratio in (1e-4, 0.1, 1.0, 30.0, 1e6)
]
RIGID += [{"k": math.inf, "mu0": 30.0, "Fz": 0.1, "y0": 7.0, "omega": 0.02, "v0": 400.0}]
AT_REST = [{"v0": 0.0, "y0": 3e-6 * share} for share in (1e-4, 0.3, 0.99)]


@pytest.mark.parametrize(
    "place", RIGID + AT_REST, ids=["rigid"] * len(RIGID) + ["at rest"] * len(AT_REST)
)
def test_the_gradient_of_rigid_contact_and_at_rest_is_that_of_the_closed_form(
    fine: Surrogate, place: Any
) -> None:
    case = {**CASE, **place}
    one, many = (
        fine.evaluate({**case, "mu0": mu0}, gradient=True)
        for mu0 in (case["mu0"], np.full(3, case["mu0"]))
    )
    for i, (name, value) in enumerate(case.items()):
        with workdps(40):
            inputs, which = tuple(mpf(x) for x in case.values()), tuple(np.eye(6, dtype=int)[i])
            slope = 0.0 if value == math.inf else float(mpmath.diff(closed_form, inputs, which))
        # relative to the input, rounding may move it by a digit of mu_macro
        assert one.gradient[name] == close(
            slope, rel=1e-12, abs=3e-17 * case["mu0"] / value if value else 0.0
        ), name
        assert abs(one.gradient[name] - slope) <= one.gradient_bound[name], name
        assert (
            place["v0"] == 0.0
            or one.gradient_bound[name] * value <= 1e-13 * one.mu_macro
            or value == math.inf
        )
        np.testing.assert_array_equal(many.gradient[name], one.gradient[name])
        np.testing.assert_array_equal(many.gradient_bound[name], one.gradient_bound[name])


# stick-slip below and above y~ = 1, beside the border, continuous sliding, far above the border
PLACES = {
    "creep": {"v0": 1e-3},
    "stick-slip": {},
    "large amplitude": {"y0": 1e-5},
    "continuous": {"v0": 0.3},
    "fast": {"v0": 5.0, "y0": 2e-5},
    "beside the border": {"v0": 0.0714},
}


@pytest.mark.slow
@pytest.mark.parametrize("place", PLACES)
def test_the_power_is_that_of_a_plain_time_integration(fine: Surrogate, place: str) -> None:
    answer = fine.evaluate({**CASE, **PLACES[place]})
    v, y, means = float(answer.v_tilde), float(answer.y_tilde), []
    for steps in (20_000, 40_000):
        orbit = naive.march(v, y, steps, 1 + naive.periods_until_steady(v, y))
        # midpoint rule: velocities at the middle of a step, elongations at both ends
        middle = 0.5 * (orbit + np.roll(orbit, 1, axis=0))
        tau = 2.0 * math.pi * (np.arange(steps) + 0.5) / steps
        means.append(np.array([np.mean(y * np.cos(tau) * middle[:, 1]), np.mean(middle[:, 0])]))
    power, mu = 2.0 * means[1] - means[0]  # the error is proportional to the step
    assert mu == close(answer.mu_ratio, rel=2e-5)
    assert power == close(fine.power(v, y), rel=1e-4)

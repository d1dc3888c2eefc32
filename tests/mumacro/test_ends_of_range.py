"""At the ends of the range of doubles: a product leaves it only where the result does, and nothing
wrong has the bound 0."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from mumacro import Surrogate
from tests.support.cases import UNIT, Case
from tests.support.comparing import close

HUGE: Case = {"mu0": 1e200, "Fz": 1e200, "k": 1e300, "omega": 1e-200, "y0": 1e100, "v0": 1e-100}


def test_the_power_is_right_where_mu0_fz_is_beyond_doubles(surrogate: Surrogate) -> None:
    power = surrogate.evaluate(**HUGE, include="power")["power.oscillation"]
    number = surrogate.power(1.0, 1.0)
    assert power == close(1e300 * number, rel=1e-9)
    assert power == close(2.24e299, rel=1e-3)


@pytest.mark.parametrize("contact", ["spring", "ball"])
def test_power_is_within_its_bound_at_the_ends_of_the_range(
    surrogate: Surrogate, contact: str
) -> None:
    rng, n = np.random.default_rng(5), 4000
    names = ("mu0", "Fz", "k", "y0", "omega", "v0")
    cases = {name: 10.0 ** rng.uniform(-250.0, 250.0, n) for name in names}
    half = n // 2  # the groups of these are within double range
    v, y = (10.0 ** rng.uniform(-12.0, 12.0, half) for _ in range(2))
    mu0, Fz, omega = (10.0 ** rng.uniform(-200.0, 200.0, half) for _ in range(3))
    length = 10.0 ** rng.uniform(-80.0, 80.0, half)
    k = 10.0 ** np.clip(np.log10(mu0) + np.log10(Fz) - np.log10(length), -300.0, 300.0)
    speed = 10.0 ** np.clip(np.log10(v * length) + np.log10(omega), -300.0, 300.0)
    plain = (mu0, Fz, k, y * length, omega, speed)
    for name, values in zip(names, plain, strict=True):
        cases[name][:half] = values
    answer = surrogate.evaluate(cases, include="power", contact=contact)
    power, bound, saved, saved_bound = (
        np.asarray(answer[f"{part}.{name}"])
        for name in ("oscillation", "saved")
        for part in ("power", "power_bound")
    )
    tried = 0
    for i in range(n):
        mu0_, Fz_, k_, y0_, omega_, v0_ = (Fraction(float(cases[name][i])) for name in names)
        l0 = mu0_ * Fz_ / k_
        groups = v0_ / (l0 * omega_), y0_ / l0
        if not all(Fraction(1, 10**290) < group < 10**290 for group in groups):
            assert math.isnan(power[i]) or power[i] == math.inf or bound[i] > 0.0
            continue
        number, off, _ = surrogate.quantity("power", *map(float, groups), contact=contact)
        unit = mu0_ * Fz_ * l0 * omega_
        true, allowed = (Fraction(float(x)) * unit for x in (number, off))
        least = Fraction(2, 10**323)
        if true > Fraction(17, 10) * 10**308:
            assert power[i] == math.inf
        else:
            tried += 1
            # the groups of a case are rounded, those of these fractions are not
            error, slack = abs(Fraction(float(power[i])) - true), true / 10**13 + least
            assert error <= allowed + slack, i
            if math.isfinite(bound[i]):
                assert error <= Fraction(float(bound[i])) + slack
        assert bound[i] > 0.0
    assert tried > 500
    assert np.all((saved_bound > 0.0) | (saved == 0.0))


def test_a_slope_is_right_where_mu0_is_subnormal(surrogate: Surrogate) -> None:
    """The same groups in other units by powers of two: slopes change by these, digits do not."""
    case: dict[str, Any] = {"mu0": 0.5, "Fz": 2.0, "k": 1.0, "y0": 0.5, "omega": 1.0, "v0": 0.25}
    small: dict[str, Any] = {**case, "mu0": 2.0**-1060, "Fz": 2.0**1000, "k": 2.0**-60}
    small |= {"omega": 2.0**-1000, "v0": 0.25 * 2.0**-1000}
    for contact in ("spring", "ball"):
        usual, other = (
            surrogate.evaluate(**x, gradient=True, contact=contact) for x in (case, small)
        )
        scale = 2.0**-1059 / 2.0**-1000
        assert other.gradient["v0"] == usual.gradient["v0"] * scale
        assert other.gradient["omega"] == usual.gradient["omega"] * scale
        assert other.gradient_bound["v0"] == usual.gradient_bound["v0"] * scale
        assert other.gradient["mu0"] == usual.gradient["mu0"]
        arrays = surrogate.evaluate(
            {name: np.full(5, x) for name, x in small.items()}, gradient=True, contact=contact
        )
        assert np.all(arrays.gradient["v0"] == other.gradient["v0"])


def test_the_slope_at_rest_needs_no_product_within_range(surrogate: Surrogate) -> None:
    """d mu_macro / d v0 = k / (Fz omega) d mu~ / d v~ at v0 = 0."""
    case: dict[str, Any] = {
        "mu0": 1.0,
        "Fz": 1e-200,
        "k": 1e-100,
        "y0": 5e-101,
        "omega": 1e-250,
        "v0": 0.0,
    }
    usual = surrogate.evaluate(mu0=1.0, Fz=1.0, k=1.0, y0=0.5, omega=1.0, v0=0.0, gradient=True)
    other = surrogate.evaluate(**{**case, "omega": 1e200, "k": 1e100, "y0": 5e-301}, gradient=True)
    assert other.gradient["v0"] == close(1e100 * usual.gradient["v0"], rel=1e-12)


@pytest.mark.parametrize("contact", ["spring", "ball"])
@pytest.mark.parametrize("y", [1e-3, 0.5, 1.4, 20.0])
def test_slopes_at_any_speed_are_numbers(surrogate: Surrogate, contact: str, y: float) -> None:
    v = 10.0 ** np.arange(2.0, 300.0, 7.0)
    answer = surrogate.evaluate(**UNIT, y0=y, v0=v, contact=contact, gradient=True)
    for name in ("v0", "y0"):
        slope, bound = answer.gradient[name], answer.gradient_bound[name]
        assert np.isfinite(slope).all()
        assert np.isfinite(bound).all()
    assert np.all(np.abs(answer.gradient["v0"][1:]) <= answer.gradient["v0"][0])


def test_the_slope_along_speed_is_infinite_at_the_corner_and_its_bound_says_so(
    surrogate: Surrogate,
) -> None:
    """From rest on mu~ is a cube root of v~ at y~ = 1."""
    for v0 in (0.0, np.zeros(2)):
        answer: Any = surrogate.evaluate(**UNIT, y0=1.0, v0=v0, gradient=True)
        assert np.all(answer.gradient["v0"] == math.inf)
        assert np.all(answer.gradient_bound["v0"] == math.inf)


def test_the_bound_of_a_slope_that_jumps_reaches_to_both_sides(surrogate: Surrogate) -> None:
    """At rest mu~ of a ball falls to 0 at y~ = 1.5 and stays there: its slope jumps."""
    y = 1.5 * np.array([1.0 - 1e-9, 1.0, 1.0 + 1e-9])
    answer = surrogate.evaluate(**UNIT, y0=y, v0=0.0, contact="ball", gradient=True)
    slopes, bounds = answer.gradient["y0"], answer.gradient_bound["y0"]
    assert slopes[0] < -0.5 < slopes[2] == 0.0
    assert np.all(np.abs(slopes[[0, 2]] - slopes[1]) <= bounds[1])
    assert bounds[0] < 1e-9

"""Bracketed Newton steps: every shape of curve, and the number of evaluations for ordinary ones."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mumacro import Surrogate
from mumacro.inverse.rootfinding import TINY, Curve, Sweep, last_double
from tests.cases import CASE, without
from tests.comparing import close


class Known:
    """A sweep along a known function: f(x) and df / d ln x."""

    def __init__(self, function: Any, slope: Any) -> None:
        self.function, self.slope, self.calls = function, slope, 0

    def with_slope(self, x: Any) -> Any:
        self.calls += 1
        return SimpleNamespace(mu_macro=self.function(x)), self.slope(x)


def curve(sweep: Any, *ends: float) -> Curve:
    x = np.array(ends)
    return Curve(sweep, x, sweep.function(x))


def sweep_over(surrogate: Surrogate, name: str, **changed: Any) -> Any:
    return Sweep(surrogate, without({**CASE, **changed}, name), name)


def test_neighbouring_doubles_are_found_at_any_scale() -> None:
    wanted = np.array([5e-324, 1e-300, 0.1, 1.0, math.pi, 1e300])

    def below(x: Any) -> Any:
        return x < wanted[:, None]

    a, b = last_double(below, np.zeros(6), np.full(6, 1.7976931348623157e308))
    assert b.tolist() == wanted.tolist()
    assert a.tolist() == np.nextafter(wanted, 0.0).tolist()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_levels_are_met_to_rounding_in_a_few_steps(sign: Any) -> None:
    known = Known(lambda x: sign * np.arctan(x), lambda x: sign * x / (1.0 + x * x))
    piece = curve(known, 0.0, TINY, 1e-300, 1e-3, 1.0, 1e3, 1e300)
    level = sign * np.array([1e-290, 1e-12, 0.3, 0.78, 1.5, 1.57])
    found = piece.meet(level)
    assert found == close(np.tan(np.abs(level)), rel=1e-12)  # 1,250 times flatter at 1.57 than at 0.3
    assert np.all(np.abs(known.function(found) - level) <= 2.0 * 2.0**-52 * np.abs(level))
    known.calls = 0
    piece.meet(sign * np.array([0.3]))
    assert known.calls <= 8


def test_a_slope_that_vanishes_at_the_root_is_no_obstacle() -> None:
    known = Known(lambda x: 1.0 + np.log(x) ** 3, lambda x: 3.0 * np.log(x) ** 2)
    (found,) = curve(known, 1e-5, 1e4).meet(np.array([1.0]))
    assert found == close(1.0, abs=1e-5)  # closer to the root the cube is below rounding


@pytest.mark.parametrize("slope", [math.nan, math.inf, 0.0, -1.0, 1e-300, 1e300])
def test_a_wrong_slope_costs_steps_but_no_digits(slope: Any) -> None:
    known = Known(lambda x: np.where(x < math.pi, 0.25, 0.75), lambda x: np.full_like(x, slope))
    piece = curve(known, 0.0, 1e300)
    (found,) = piece.meet(np.array([0.5]))
    assert found in (math.pi, math.nextafter(math.pi, 0.0))
    assert known.calls < 200


def test_a_plateau_is_met_at_its_first_double_and_left_at_its_last() -> None:
    def stairs(x: Any) -> Any:
        return np.searchsorted([0.1, 10.0, 100.0], x, side="right") - 1.0

    known = Known(stairs, np.zeros_like)
    piece = curve(known, 1e-6, 1e-2, 1.0, 30.0, 1e6)
    assert piece.meet(np.array([1.0])).tolist() == [10.0]
    (left,) = piece.meet(np.array([1.0]), leave=True)
    assert left in (100.0, math.nextafter(100.0, 0.0))
    both = piece.meet(np.array([1.0, 1.0]), leave=np.array([False, True]))
    assert both.tolist() == [10.0, left]


def test_a_level_that_is_never_reached_gives_an_end() -> None:
    known = Known(np.arctan, lambda x: x / (1.0 + x * x))
    piece = curve(known, 0.5, 2.0)
    assert piece.meet(np.array([0.1, 1.5])).tolist() == [0.5, 2.0]
    assert known.calls == 0
    assert piece.holds(np.array([0.1, math.atan(0.5), 1.0, 1.5])).tolist() == [False, True, True, False]


@pytest.mark.parametrize("name", ["v0", "y0", "omega"])
def test_newton_agrees_with_bisection_of_the_bits(surrogate: Surrogate, name: str) -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        changed = {field: value * 10.0 ** rng.uniform(-2.0, 2.0) for field, value in CASE.items() if field != "mu0"}
        sweep = sweep_over(surrogate, name, **changed)
        x = np.geomspace(1e-12, 1e12, 49) * CASE[name]
        piece = Curve(sweep, x, sweep.mu(x))
        low, high = sorted((float(piece.mu[0]), float(piece.mu[-1])))
        level = low + (high - low) * np.array([0.01, 0.3, 0.5, 0.9])
        newton = piece.meet(level)
        off = np.abs(sweep.mu(newton) - level)
        # change of mu_macro for one unit in the last place of the input, where the curve is steep
        grain = np.abs(sweep.mu(np.nextafter(newton, 1e300)) - sweep.mu(np.nextafter(newton, 0.0)))
        assert np.all(off <= 4.0 * 2.0**-52 * level + grain)
        sign = piece.sign

        def below(at: Any, sweep: Any = sweep, level: Any = level, sign: Any = sign) -> Any:
            return sign * sweep.mu(at) < sign * level[:, None]

        cut, _ = last_double(below, np.full(4, x[0]), np.full(4, x[-1]))
        _, slope = sweep.with_slope(newton)
        noise = 64.0 * 2.0**-52 * level / np.abs(slope)
        assert np.all(np.abs(newton / cut - 1.0) <= noise + 4.0 * 2.0**-52)


def test_the_cusp_of_the_static_limit_is_met(surrogate: Surrogate) -> None:
    sweep = sweep_over(surrogate, "y0", v0=0.0)
    x = np.array([0.0, 1e-9, 1e-3])
    piece = Curve(sweep, x, sweep.mu(x))
    level = np.array([0.2, 1e-3, 1e-6])
    expected = 3e-6 * np.sqrt((1.0 - level / 0.3) * (1.0 + level / 0.3))
    assert piece.meet(level) == close(expected, rel=4e-16)
    assert piece.meet(np.array([0.0]))[0] == close(3e-6, rel=4e-16)

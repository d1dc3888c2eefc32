"""The search for roots: none is missed, ranges of roots are one, for cheap and costly functions."""

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mumacro import Surrogate, solve_for, solve_motion
from mumacro.kernel.arrays import Array, Places
from mumacro.questions.search import TINY, Search, last_double, samples
from mumacro.questions.solutions import Reach
from tests.support.cases import CASE, without
from tests.support.comparing import close

ERROR = 1e-9


class Curve:
    """A function whose values have one estimate of their errors."""

    def __init__(self, function: Callable[[Array], Array], costly: bool, error: float = ERROR):
        self.function, self.costly, self.error, self.calls = function, costly, error, 0

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        self.calls += np.size(x)
        return np.asarray(self.function(x)), np.full(np.shape(x), self.error)


def searched(curve: Curve, low: float, high: float, *targets: float) -> Any:
    return Search(curve, np.linspace(low, high, 49), low, high, np.array(targets)).roots()


both_costs = pytest.mark.parametrize("costly", [False, True], ids=["cheap", "costly"])


@both_costs
@pytest.mark.parametrize("seed", range(20))
def test_no_crossing_of_a_random_course_is_missed(costly: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    sizes, phases = rng.normal(size=6) / np.arange(1, 7), rng.uniform(0.0, 6.0, 6)

    terms = [*enumerate(zip(sizes, phases, strict=True), 1)]

    def course(x: Array) -> Array:
        sines = [size * np.sin(n * x + phase) for n, (size, phase) in terms]
        total: Array = np.sum(sines, axis=0)
        return total

    fine = np.linspace(-math.pi, math.pi, 20_001)
    value = course(fine)
    targets = np.quantile(value, [0.01, 0.2, 0.5, 0.8, 0.99])
    found = searched(Curve(course, costly), fine[0], fine[-1], *targets)
    for target, roots in zip(targets, found, strict=True):
        i = np.flatnonzero(np.diff(np.sign(value - target)) != 0.0)
        assert len(roots) <= i.size
        for a, b in zip(fine[i], fine[i + 1], strict=True):
            assert any(root.low <= b and root.high >= a for root in roots)
        for root in roots:
            assert abs(course(np.array(root.value)) - target) <= 1.01 * ERROR
            assert root.low <= root.value <= root.high


@both_costs
def test_two_roots_beside_a_turning_point_are_found_and_one_that_touches_is_one(
    costly: bool,
) -> None:
    def parabola(x: Array) -> Array:
        return (x - math.pi) ** 2

    apart, touching, below = searched(Curve(parabola, costly), 0.0, 7.0, 1e-6, 0.0, -1e-6)
    assert [root.value for root in apart] == close([math.pi - 1e-3, math.pi + 1e-3], abs=1e-5)
    (root,) = touching
    assert root.low <= math.pi <= root.high
    assert root.high - root.low == close(2.0 * math.sqrt(ERROR), rel=0.05)
    assert below == []


@both_costs
def test_a_plateau_is_one_root_from_its_first_place_to_its_last(costly: bool) -> None:
    def ramp(x: Array) -> Array:
        return np.clip(x, 1.0, 3.0)

    low, middle, high = searched(Curve(ramp, costly), 0.0, 5.0, 1.0, 2.0, 3.0)
    for (root,), value, ends in (
        (low, 0.0, (0.0, 1.0)),
        (middle, 2.0, (2.0, 2.0)),
        (high, 3.0, (3.0, 5.0)),
    ):
        beside = 0.02 if costly else 1e-8  # a cubic rounds the bend between two samples
        assert (root.value, root.low, root.high) == close((value, *ends), abs=beside)


@both_costs
def test_a_constant_is_one_root_over_the_whole_range(costly: bool) -> None:
    search = Search(
        Curve(lambda x: np.full(np.shape(x), 0.5), costly),
        np.linspace(1.0, 2.0, 49),
        1.0,
        2.0,
        np.array([0.5, 0.6]),
    )
    ((root,), none) = search.roots()
    assert (root.value, root.low, root.high, none) == (1.0, 1.0, 2.0, [])
    assert search.constant


@both_costs
def test_a_jump_over_a_target_is_no_root(costly: bool) -> None:
    def step(x: Array) -> Array:
        return np.where(x < math.pi, x, x + 10.0)

    jumped, before, after = searched(Curve(step, costly), 0.0, 7.0, 8.0, 3.0, 15.0)
    assert jumped == []
    assert [before[0].value, after[0].value] == close([3.0, 5.0], abs=1e-8)


def test_a_steep_step_without_a_jump_is_met_at_the_first_double_that_reaches_it() -> None:
    curve = Curve(lambda x: np.sign(x - 1.0) * np.sqrt(np.abs(x - 1.0)), costly=False, error=0.0)
    ((root,),) = searched(curve, 0.0, 3.0, 1e-9)
    assert root.value == 1.0 + 2.0**-52
    assert root.low == root.value == root.high


def test_targets_of_a_costly_function_share_its_samples() -> None:
    curve = Curve(np.tanh, costly=True)
    targets = np.linspace(-0.99, 0.99, 1000)
    roots = searched(curve, -4.0, 4.0, *targets)
    assert [root.value for (root,) in roots] == close(np.arctanh(targets), abs=1e-6)
    assert curve.calls < 2500


def test_neighbouring_doubles_are_found_at_any_scale_and_across_zero() -> None:
    expected = np.array([-1e300, -2.5, 5e-324, 1e-300, 0.1, math.pi, 1e300])

    def step(x: Array, i: Places) -> Array:
        return np.where(x < expected[i], -1.0, 1.0)

    def course(x: Array, i: Places) -> Array:
        return np.where(x < expected[i], -1.0, np.abs(np.cbrt(x) - np.cbrt(expected[i])))

    lows = np.full(7, -1.7e308), np.minimum(expected * 2.0, 0.0)
    for height, low in itertools.product((step, course), lows):
        a, b = last_double(height, low, np.full(7, 1.7976931348623157e308))
        assert b.tolist() == expected.tolist()
        assert a.tolist() == np.nextafter(expected, -np.inf).tolist()


def test_samples_reach_both_ends() -> None:
    for low, high in ((0.0, 1.7976931348623157e308), (1e-3, 1.0)):
        x = samples(low, high, 2)
        assert x[0] == close(max(low, TINY), rel=1e-12)
        assert x[-1] == close(high, rel=1e-12)


# --- what both inverse problems say ---------------------------------------------------------------

ALONG: Any = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3}


def test_the_table_and_the_motion_say_the_same_of_a_plateau(surrogate: Surrogate) -> None:
    """Along, from v0 = 0.1257 m/s on the contact slides all the time: mu_macro is mu0."""
    for within in ((1e-3, 1.0), (0.15, 1.0)):
        table = solve_for(
            surrogate, "v0", [0.3, 0.4], within=within, direction="along", y0=1e-6, **ALONG
        )
        motion = solve_motion("v0", [0.3, 0.4], within=within, x=1e-6, **ALONG)
        assert table.constant is motion.constant is (within[0] == 0.15)
        (of_table,), none = table.roots
        (of_motion,), nothing = motion.roots
        assert none == nothing == ()
        assert of_table.high == of_motion.high == 1.0
        assert of_table.low == close(of_motion.low, rel=0.02)
        assert table.reason(1).split(" is ")[0] == motion.reason(1).split(" is ")[0]
        for said in (table.reason(), motion.reason()):
            assert "to 1 m/s" in said
            assert ("no influence" in said) is table.constant


def test_a_target_just_out_of_reach_is_said_with_digits_that_show_it(surrogate: Surrogate) -> None:
    case = without(CASE, "k")
    lowest = solve_for(surrogate, "k", 0.9, **case).reach.mu_min
    for share in (1e-6, 1e-9):
        words = solve_for(surrogate, "k", lowest * (1.0 - share), **case).reason()
        target, least = (words.split(after)[1].split()[0] for after in ("mu_macro = ", "gives "))
        assert float(target) < float(least)
    assert "0.3 (not reached)" in solve_for(surrogate, "v0", 0.3, **without(CASE, "v0")).reason()


@pytest.mark.parametrize(
    ("most", "target", "words"),
    [
        (0.3, 0.4, ("0.4", "0.1 to 0.3")),
        (0.3, 0.3 * (1.0 + 1e-12), ("0.3000000000003", "0.1 to 0.3")),
        (0.3000004, 0.3000006, ("0.300001", "0.1 to 0.3")),
        (0.171722, 0.17172206, ("0.1717221", "0.1 to 0.171722")),
    ],
)
def test_the_reach_is_said_with_digits_that_do_not_contradict_the_target(
    most: float, target: float, words: tuple[str, str]
) -> None:
    assert Reach(0.0, 1.0, 0.1, most).beside(target) == words

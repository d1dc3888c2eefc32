"""Oscillation along and of the normal force: every bound covers its error, and none is much wider
than that.

The reference is evaluated with more digits, and for a ball with more springs
(``tests/support/extended.py``).
"""

from typing import Any

import numpy as np
import pytest

from mumacro import Surrogate
from mumacro.kernel.quadrature import DRIVEN_NODES, piece_rule
from tests.support import extended
from tests.support.cases import Array, opened, tables
from tests.support.driven import answered, hard, ordinary

table = tables(1e-7)
needs_digits = pytest.mark.skipif(
    not extended.HAS_EXTENDED, reason="numpy.longdouble has the digits of a double here"
)


def legendre(x: Array) -> tuple[Array, Array]:
    """Return the polynomial of Legendre of the degree DRIVEN_NODES, and its slope."""
    before, value = np.ones_like(x), x
    for k in range(2, DRIVEN_NODES + 1):
        before, value = value, ((2 * k - 1) * x * value - (k - 1) * before) / k
    return value, DRIVEN_NODES * (x * value - before) / (x * x - 1.0)


#: largest median of bound over error
WIDEST = 100.0
#: by row of extended.ROWS, beside the lines where the rule has much to miss
WIDEST_OF_RULE = (100.0, 100.0, 200.0, 200.0, 400.0)


def check(
    s: Surrogate, v: Array, y: Array, contact: str, direction: str, truth: Any, slack: float = 0.0
) -> Array:
    """No error is beyond its bound; returns the medians of bound over error, with the last digit as
    least error."""
    medians = []
    for name, (value, bound), true in zip(
        extended.ROWS, answered(s, v, y, contact, direction), truth, strict=True
    ):
        error = np.abs(value.astype(np.longdouble) - true).astype(float)
        legal = ~np.isnan(value)
        beyond = legal & (error > bound * (1.0 + slack) + 5e-324)
        assert not beyond.any(), (name, v[beyond][:3], y[beyond][:3], (error / bound)[beyond][:3])
        size = np.maximum(error, 5.5e-17 * np.abs(true).astype(float))[legal & (error > 0.0)]
        medians.append(float(np.median(bound[legal & (error > 0.0)] / size)) if size.size else 0.0)
    return np.array(medians)


@needs_digits
@pytest.mark.parametrize("direction", ["along", "normal"])
def test_the_bounds_of_a_spring_hold_and_are_not_wide(table: Surrogate, direction: str) -> None:
    normal = direction == "normal"
    v, y = ordinary(2500, 3, normal)
    assert np.all(
        check(table, v, y, "spring", direction, extended.spring(v, y, not normal)) < WIDEST
    )
    if not normal:
        v, y = hard(400, 4)
        check(table, v, y, "spring", direction, extended.spring(v, y))


@needs_digits
@pytest.mark.slow
def test_the_bounds_of_a_ball_along_hold_and_are_not_wide(table: Surrogate) -> None:
    v, y = ordinary(800, 5)
    assert np.all(check(table, v, y, "ball", "along", extended.ball(v, y, 40)) < WIDEST)
    v, y = hard(60, 6)
    check(table, v, y, "ball", "along", extended.ball(v, y, 40))


@needs_digits
@pytest.mark.slow
def test_the_bounds_of_the_rule_hold_where_coefficients_are_trusted_to_fall(
    table: Surrogate,
) -> None:
    """Both sides of the lines between which ``mu_missed`` reads the fall of the coefficients."""
    rng = np.random.default_rng(9)
    fast, x = 10.0 ** rng.uniform(-1.7, -0.001, 300), 10.0 ** rng.uniform(-10.0, -0.01, 300)
    x = np.concatenate([fast, x])
    last = np.concatenate([rng.uniform(0.3, 0.82, 300), rng.uniform(1.9, 6.0, 300)])
    y = 1.5 * last / (np.sqrt((1.0 - x) * (1.0 + x)) - x * np.arccos(x))
    widths = check(table, x * y, y, "ball", "along", extended.ball(x * y, y, 48))
    assert np.all(widths < WIDEST_OF_RULE)


@needs_digits
@pytest.mark.slow
def test_the_bounds_of_a_ball_along_hold_where_the_last_digits_decide_which_springs_turn_back(
    table: Surrogate,
) -> None:
    """The line from which the middle spring slips backwards, and three doubles on either side: the
    slopes jump by the root of a digit."""
    rng, n = np.random.default_rng(10), 1500
    x = np.where(
        rng.random(n) < 0.5,
        10.0 ** rng.uniform(-6.0, -0.01, n),
        1.0 - 10.0 ** rng.uniform(-8, -0.5, n),
    )
    exact = x.astype(np.longdouble)
    turned = np.sqrt((1.0 - exact) * (1.0 + exact)) - exact * np.arccos(exact)
    y = (1.5 / turned).astype(float)
    y += np.spacing(y) * rng.integers(-3, 4, n)
    check(table, x * y, y, "ball", "along", extended.ball(x * y, y, 48))


def test_the_weights_of_the_rule_are_right_to_their_bound() -> None:
    """``MU_RULE_ROUNDING`` of contact.c: a rule with more digits, by Newton's method."""
    x: Any = np.polynomial.legendre.leggauss(DRIVEN_NODES)[0].astype(np.longdouble)
    for _ in range(4):
        value, slope = legendre(x)
        x -= value / slope
    beyond, steep = 3.0 * ((1.0 - x) / 2.0) ** 2 - 2.0 * ((1.0 - x) / 2.0) ** 3, (1.0 - x * x) / 4.0
    weight = 6.0 * steep / ((1.0 - x * x) * legendre(x)[1] ** 2)
    rule = piece_rule(DRIVEN_NODES)
    assert float(np.abs(rule[:, 0] - beyond).max()) < 5e-16
    assert float(np.abs(rule[:, 1] - weight).sum()) < 5e-15 / 3.0


@needs_digits
@pytest.mark.slow
def test_the_bounds_of_a_ball_along_hold_beside_its_corner(table: Surrogate) -> None:
    """y~ = 1.5 at creeping speeds: mu~ falls within a part of the ball, and the reference needs
    many panels there."""
    rng = np.random.default_rng(7)
    y = 1.5 * (1.0 + rng.choice([-1.0, 1.0], 60) * 10.0 ** rng.uniform(-15.0, -1.0, 60))
    v = y * 10.0 ** rng.uniform(-20.0, -0.5, 60)
    check(table, v, y, "ball", "along", extended.ball(v, y, 24, panels=44), slack=1e-9)


# each of these was beyond its bound once: contact, direction, tolerance, quantity, v~, y~, true
# value
ONCE_MISSED = [
    (
        "ball",
        "across",
        1e-10,
        "mu_ratio",
        0.030345455605781824,
        1.879170896054554,
        0.0863453953187772,
    ),
    ("ball", "across", 1e-12, "power", 0.50276, 1.5, 0.3096576630510784),
    (
        "ball",
        "along",
        1e-12,
        "mu_ratio",
        1.0106571086749353e-06,
        1.5000030521278915,
        7.344914597412166e-07,
    ),
    ("spring", "along", 1e-4, "stick_fraction", 3.133015082036328e-09, 0.5, 0.9999553397339749),
]


@pytest.mark.parametrize("place", ONCE_MISSED, ids=lambda place: " ".join(map(str, place[:4])))
def test_bounds_that_were_once_exceeded_hold(place: Any) -> None:
    contact, direction, tolerance, name, v, y, true = place
    value, bound, _ = opened(tolerance).quantity(name, v, y, contact=contact, direction=direction)
    assert abs(value - true) <= bound + 1.2e-16 * abs(true)


@pytest.mark.parametrize("contact", ["spring", "ball"])
def test_next_to_the_border_the_bounds_reach_over_it(table: Surrogate, contact: str) -> None:
    """The last digits of v~ = y~ decide whether the contact sticks at all: on both sides of it, and
    where it is not known, neighbouring answers agree within their bounds.  Of stick and slopes,
    which begin steeply, a bound reaches two digits further: the groups may be off by as much."""
    y = 10.0 ** np.random.default_rng(8).uniform(-6.0, 40.0, 300)
    rows = [
        answered(table, y * (1.0 + digit * 2.0**-52), y, contact, "along")
        for digit in range(-9, 22)
    ]
    values, bounds = np.array(rows)[:, :, 0], np.array(rows)[:, :, 1]
    step = np.abs(np.diff(values, axis=0))
    assert np.all(step <= bounds[1:] + bounds[:-1])
    for near, far in ((slice(2, None), slice(-2)), (slice(-2), slice(2, None))):
        apart = np.abs(values[near] - values[far])[:, 2:]
        assert np.all(apart <= bounds[near][:, 2:])

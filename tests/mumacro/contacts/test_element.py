"""The contact in the time domain: the table's mean, its properties, bounds."""

import math
from copy import deepcopy
from typing import Any, cast

import mpmath
import numpy as np
import pytest

from mumacro import Element, Surrogate
from mumacro.closed_forms import master_curve_limit
from tests.support.cases import Case
from tests.support.comparing import close
from tests.support.refusals import refused

CASE: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6}


def means(
    v: Any,
    y: Any,
    steps: Any,
    periods: Any,
    contact: str = "spring",
    springs: Any = None,
    load: Any = None,
) -> Any:
    """Mean force along x over the last period, dimensionless, of many contacts at once."""
    contacts = Element(np.ones(v.shape), 1.0, 1.0, contact, springs)
    way = np.diff(np.sin(2.0 * math.pi * np.arange(steps + 1) / steps))
    # dragged, which is near the steady cycle of slow sliding at small amplitudes
    total = contacts.step(2.0, 0.0)[0]
    for step in range(periods * steps):
        i = step % steps
        force = None if load is None else load(2.0 * math.pi * (i + 1) / steps)
        total = total * (i > 0) + contacts.step(v * 2.0 * math.pi / steps, y * way[i], force)[0]
    return total / steps


def test_the_mean_is_the_tables_with_an_error_of_second_order(surrogate: Surrogate) -> None:
    """Border, corner, slow and fast, small and large amplitudes."""
    crit = surrogate.v_tilde_crit(np.array([0.1, 0.5, 1.0, 3.0]))
    v, y = (
        x.ravel()
        for x in np.meshgrid([0.05, 0.2, 1.0, 5.0], [0.1, 0.5, 0.999, 1.0, 1.001, 1.1, 3.0, 30.0])
    )
    v, y = np.append(v, crit * [1.0, 0.99, 1.01, 1.0]), np.append(y, [0.1, 0.5, 1.0, 3.0])
    errors = [means(v, y, n, 25) - surrogate.mu_ratio(v, y) for n in (400, 800)]
    assert np.abs(errors[0]).max() < 3e-5
    assert np.abs(errors[1]).max() < 1e-5
    # nothing breaks the steps of continuous sliding; each step of these is short
    smooth = (v > 1.1 * surrogate.v_tilde_crit(y)) & (v < 2.0) & (y > 0.2) & (y < 2.0)
    assert np.count_nonzero(smooth) == 6
    assert np.abs(errors[0] / errors[1] - 4.0)[smooth].max() < 0.06
    assert np.abs(4.0 * errors[1] - errors[0])[smooth].max() < 3e-8


def test_the_error_of_a_curved_motion_follows_the_rule_that_is_stated(surrogate: Surrogate) -> None:
    """It said 3e-5 for 400 steps, which large amplitudes exceed: 1.7e-4 at y~ = 93."""
    rng, n = np.random.default_rng(3), 400
    v, y = 10.0 ** rng.uniform(-1.5, 1.5, 200), 10.0 ** rng.uniform(-1.5, 4.0, 200)
    error = np.abs(means(v, y, n, 25) - surrogate.mu_ratio(v, y))
    assert (error <= np.maximum(6.0, 2.0 * np.sqrt(y)) / n**2).all()
    assert error.max() > 1e-4


@pytest.mark.parametrize("contact", ["spring", "ball"])
def test_a_straight_step_is_exact(contact: str) -> None:
    """One step, or the same in 512 parts, from any force."""
    rng = np.random.default_rng(11)
    limit, n = 10.0 ** rng.uniform(-3, 3, 400), 512
    way = limit * 10.0 ** rng.uniform(-3, 2, 400)
    angle = rng.uniform(0.0, 2.0 * math.pi, 400)
    one, many = (Element(1.0, limit, 1.0, contact) for _ in range(2))
    for element in (one, many):  # slips, and in a third of the cases against the next step
        element.step(*(2.0 * limit * f(angle) for f in (np.cos, np.sin)))
    angle[::3] += math.pi * (1.0 - 10.0 ** rng.uniform(-12, 0, angle[::3].size))
    dx, dy = way * np.cos(angle), way * np.sin(angle)
    expected = one.step(dx, dy)
    for _ in range(n):
        result = many.step(dx / n, dy / n)
    # opposite to the motion slip is unstable: the parts' rounding grows
    assert np.abs(np.array(result) - expected).max(axis=0) / limit == close(0.0, abs=2e-11)


def test_slip_turns_the_force_as_its_closed_form_in_30_digits() -> None:
    """Limits that stay, fall by up to 300 decades, or rise nearly as fast as the drive; drives from
    1e-6 to 300 limits."""
    rng, n = np.random.default_rng(14), 600
    first, angle = 10.0 ** rng.uniform(-3.0, 3.0, n), rng.uniform(-1.4, 1.4, n)
    way = first * 10.0 ** rng.uniform(-6.0, 2.5, n)
    last = first + 0.9 * way * np.cos(angle)
    last[::3] = first[::3]
    last[1::3] = first[1::3] * 10.0 ** -(10.0 ** rng.uniform(-9.0, 2.48, last[1::3].size))
    contacts = Element(1.0, first, 1.0)
    contacts.state = (first * [np.cos(angle), np.sin(angle)]).T[:, None]
    forces = np.array(contacts.step(way, 0.0, Fz=last))
    with mpmath.workdps(30):
        for force, before, after, start, path in zip(
            forces.T, first, last, angle, way, strict=True
        ):
            a, b = mpmath.mpf(float(before)), mpmath.mpf(float(after))
            inverse = 1 / a if a == b else mpmath.log(b / a) / (b - a)
            psi = 2 * mpmath.atan(mpmath.tan(start / 2) * mpmath.exp(-path * inverse))
            expected = [float(b * mpmath.cos(psi)), float(b * mpmath.sin(psi))]
            assert force == close(expected, rel=0.0, abs=2e-15 * after + 5e-324)


def test_a_force_nearly_against_the_motion_turns_as_its_closed_form() -> None:
    """The limit falls faster than the spring unloads, so that it slips at once."""
    rng, n = np.random.default_rng(15), 300
    angle = math.pi - 10.0 ** rng.uniform(-9.0, -0.5, n)
    last = 10.0 ** -rng.uniform(0.5, 10.0, n)
    way = (1.0 - last) / rng.uniform(1.05, 2.0, n)
    contacts = Element(1.0, np.ones(n), 1.0)
    contacts.state = np.stack([np.cos(angle), np.sin(angle)], -1)[:, None]
    forces = np.array(contacts.step(way, 0.0, Fz=last))
    with mpmath.workdps(30):
        for force, after, start, path in zip(forces.T, last, angle, way, strict=True):
            b = mpmath.mpf(float(after))
            left = mpmath.exp(-mpmath.mpf(float(path)) * mpmath.log(b) / (b - 1))
            psi = 2 * mpmath.atan(mpmath.tan(mpmath.mpf(float(start)) / 2) * left)
            expected = [float(b * mpmath.cos(psi)), float(b * mpmath.sin(psi))]
            assert force == close(expected, rel=0.0, abs=1e-12 * after)


def test_a_straight_step_is_exact_while_the_normal_force_changes() -> None:
    rng = np.random.default_rng(12)
    first, last = 10.0 ** rng.uniform(-1, 1, (2, 1000))
    last[:50] = 0.0
    way, n = 10.0 ** rng.uniform(-3, 2, 1000), 512
    ends = rng.uniform(-math.pi, math.pi, (2, 1000))
    one, many = (Element(1.0, first, 1.0) for _ in range(2))
    size = first * rng.choice([0.0, 0.3, 1.0], 1000)
    for element in (one, many):
        element.state = np.stack([size * np.cos(ends[0]), size * np.sin(ends[0])], -1)[:, None]
    dx, dy = way * np.cos(ends[1]), way * np.sin(ends[1])
    expected = one.step(dx, dy, Fz=last)
    for i in range(n):
        result = many.step(dx / n, dy / n, Fz=first + (last - first) * ((i + 1) / n))
    assert np.abs(np.array(result) - expected).max() < 1e-11
    assert np.hypot(*expected) == close(np.minimum(np.hypot(*expected), last), rel=1e-14)


def test_a_contact_that_closes_within_a_step_is_exact() -> None:
    """The limit starts at 0: it sticks where k times the way is below the last limit, else slips at
    once."""
    rng = np.random.default_rng(13)
    last, way, n = *10.0 ** rng.uniform((-1.0, -3.0), (1.0, 2.0), (400, 2)).T, 512
    angle = rng.uniform(-math.pi, math.pi, 400)
    one, many = (Element(1.0, np.ones(400), 1.0) for _ in range(2))
    for element in (one, many):
        element.step(1.0, 0.0)
        assert not np.any(element.step(0.5, 0.5, Fz=0.0))
    dx, dy = way * np.cos(angle), way * np.sin(angle)
    expected = np.minimum(way, last) * [np.cos(angle), np.sin(angle)]
    assert np.array(one.step(dx, dy, Fz=last)) == close(expected, rel=1e-14, abs=1e-15)
    for i in range(n):
        result = many.step(dx / n, dy / n, Fz=last * ((i + 1) / n))
    assert np.abs(np.array(result) - expected).max() < 1e-11


def test_a_force_against_the_motion_stays_on_its_line() -> None:
    """psi = pi: the spring unloads, and only then slips."""
    contact = Element(1.0, 1.0, 1.0)
    contact.step(-5.0, 0.0)
    assert contact.step(1e-9, 0.0) == (close(-1.0 + 1e-9, rel=1e-15), 0.0)
    assert contact.step(5.0, 0.0) == (1.0, 0.0)
    falling = Element(1.0, 1.0, 1.0)  # the limit falls faster than the spring unloads
    falling.step(-5.0, 0.0)
    assert falling.step(0.25, 0.0, Fz=0.5) == (-0.5, 0.0)
    assert falling.step(0.0, 0.0, Fz=0.25) == (-0.25, 0.0)


def shares(n: int) -> Any:
    """The limits of the springs of a ball, of which the sum is 1: integrals of 3/2 (1 - xi^2)."""
    edges = np.arange(n + 1) / n
    return np.diff(1.5 * (edges - edges**3 / 3.0))


def test_a_ball_is_its_springs(surrogate: Surrogate) -> None:
    v, y = (x.ravel() for x in np.meshgrid([0.05, 0.3, 2.0], [0.2, 0.4, 1.5, 6.0]))
    springs = shares(16)[:, None]
    expected = (springs * surrogate.mu_ratio(v / (16 * springs), y / (16 * springs))).sum(axis=0)
    one, two = (means(v, y, n, 25, "ball", 16) for n in (300, 600))
    assert np.abs(one - expected).max() < 3e-5
    assert np.abs(two - expected).max() < 8e-6


def test_a_ball_slips_from_the_rim_and_wholly_at_three_halves_of_l0() -> None:
    """Cattaneo and Mindlin: F = mu0 Fz (1 - (1 - 2 k x / (3 mu0 Fz))^(3/2))."""
    ball = Element(**CASE, contact="ball", springs=2000)
    for x in np.linspace(0.0, 6e-6, 61)[1:]:
        force, other = ball.step(1e-7, 0.0)
        assert force == close(3.0 * (1.0 - max(0.0, 1.0 - x / 4.5e-6) ** 1.5), abs=1e-5)
        assert other == 0.0
    assert force == close(3.0, rel=1e-12)


def test_a_varied_normal_force_gives_the_closed_form_of_normal_oscillation() -> None:
    z, v = 0.6, np.array([0.05, 0.1, 0.3, 0.9])
    load = lambda tau: 1.0 + z * math.cos(tau)  # noqa: E731
    expected = 1.0 - z * (1.0 - master_curve_limit(v / z))
    assert np.abs(means(v, np.zeros(4), 1000, 8, load=load) - expected).max() < 1e-6


def test_an_open_contact_has_no_force_and_forgets() -> None:
    contact = Element(**CASE)
    contact.step(1.0, 1.0)
    assert contact.step(0.0, 0.0, Fz=0.0) == (0.0, 0.0)
    assert contact.step(1e-6, 0.0, Fz=10.0) == (close(1.0, rel=1e-14), 0.0)
    assert contact.step(1.0, 0.0) == (3.0, 0.0)  # the last normal force holds


@pytest.mark.parametrize("contact", ["spring", "ball"])
def test_the_play_operator_has_its_properties(contact: str) -> None:
    """No force beyond the limit; friction dissipates; turned motion turns the force; two states
    only approach."""
    rng = np.random.default_rng(3)
    first, second, turned = (Element(1.0, 1.0, 1.0, contact) for _ in range(3))
    second.step(0.7, -0.2)
    work, apart = 0.0, math.inf
    for dx, dy in rng.normal(scale=0.3, size=(500, 2)):
        before = first.force
        x, y = first.step(dx, dy)
        assert math.hypot(x, y) <= 1.0 + 1e-14
        work += 0.5 * ((x + before[0]) * dx + (y + before[1]) * dy)
        assert turned.step(-dy, dx) == (close(-y, abs=1e-14), close(x, abs=1e-14))
        second.step(dx, dy)
        gap = np.abs(second.state - first.state).max()
        assert gap <= apart + 1e-14
        apart = np.sqrt(((second.state - first.state) ** 2).sum(axis=-1)).max()
    assert work > 0.0
    assert apart < 1e-6


def test_arrays_are_the_single_contacts() -> None:
    k = np.array([[1e6], [3e6]])
    many = Element(0.3, [10.0, 20.0, 30.0], k, contact="ball", springs=5)
    single = [
        [Element(0.3, Fz, float(one), contact="ball", springs=5) for Fz in (10.0, 20.0, 30.0)]
        for one in k[:, 0]
    ]
    for dx, dy in ((1e-6, 2e-6), (5e-6, 0.0), (-3e-6, 1e-6)):
        result = many.step(dx, [[dy], [2.0 * dy]])
        for i in range(2):
            for j in range(3):
                assert (result[0][i, j], result[1][i, j]) == single[i][j].step(dx, (i + 1) * dy)
    assert many.state.shape == (2, 3, 5, 2)
    assert many.force[0].shape == (2, 3)
    assert Element([0.3], [10.0], 1e6).step(0.0, 0.0)[0].shape == (1,)


def test_states_are_read_set_and_copied() -> None:
    contact = Element(**CASE, contact="ball")
    contact.step(2e-6, 1e-6)
    copy, state = deepcopy(contact), contact.state
    moved = contact.step(2e-6, 0.0)
    assert copy.force != moved
    assert copy.step(2e-6, 0.0) == moved
    contact.state = state
    assert contact.step(2e-6, 0.0) == moved
    state[...] = 0.0  # a copy
    assert contact.force == copy.force
    contact.state = state
    assert contact.force == (0.0, 0.0)


@pytest.mark.parametrize("way", [1e308, 1.7e308, 1e-320, 5e-324])
def test_extreme_steps_keep_the_limit(way: Any) -> None:
    for k in (1e-300, 1.0, 1e300):
        contact = Element(0.3, 10.0, k)
        for dx, dy in ((way, 0.0), (-way, way), (0.0, 0.0)):
            x, y = contact.step(dx, dy)
            assert math.isfinite(x)
            assert math.hypot(x, y) <= 3.0 * (1.0 + 1e-15)
    # the load after the step counts
    assert Element(0.3, 10.0, 1e300).step(1e300, 0.0, Fz=20.0) == (6.0, 0.0)
    # whose squares are below it, too
    assert Element(0.3, 10.0, 1.0).step(1e-310, 1e-310) == (1e-310, 1e-310)
    assert Element(1e-300, 1e-300, 1.0).step(1.0, 1.0) == (0.0, 0.0)  # mu0 Fz is below double range


@pytest.mark.parametrize(
    ("call", "place"),
    [
        (lambda: Element(0.3, 10.0, 1e6, contact="cube"), "contact"),
        (
            lambda: Element(0.3, 10.0, 1e6, springs=2),
            "springs",
        ),
        (
            lambda: Element(0.3, 10.0, 1e6, "ball", springs=0),
            "springs",
        ),
        (lambda: Element(0.0, 10.0, 1e6), "mu0"),
        (
            lambda: Element(0.3, [10.0, math.nan], 1e6),
            "Fz[1]",
        ),
        (lambda: Element(0.3, 10.0, math.inf), "k"),
        (lambda: Element(0.3, 10.0, "rigid"), "k"),
        (lambda: Element(0.3, 10.0, cast(Any, None)), "k"),
        (
            lambda: Element(1e200, 1e200, 1.0),
            "Fz[0]",
        ),
        (
            lambda: Element([0.3, 0.2], [1.0, 2.0, 3.0], 1.0),
            "inputs",
        ),
        (lambda: Element(0.3, 10.0, 1e6).step(math.nan, 0.0), "dx"),
        (lambda: Element(0.3, 10.0, 1e6).step(0.0, "1N"), "dy"),
        (
            lambda: Element(0.3, 10.0, 1e6).step([1.0, 2.0], 0.0),
            "dx",
        ),
        (
            lambda: Element(0.3, 10.0, 1e6, "ball").step(0.0, 0.0, Fz=1.0),
            "Fz",
        ),
        (
            lambda: Element(0.3, 10.0, 1e6).step(0.0, 0.0, Fz=-1.0),
            "Fz[0]",
        ),
        (
            lambda: setattr(Element(0.3, 10.0, 1e6), "state", [1.0, 2.0]),
            "state",
        ),
        (
            lambda: setattr(Element(0.3, 10.0, 1e6), "state", [[3.0001, 0.0]]),
            "state[0]",
        ),
        (
            lambda: setattr(Element(0.3, 10.0, 1e6), "state", [[math.inf, 0.0]]),
            "state",
        ),
    ],
)
def test_bad_input_is_named_and_moves_nothing(call: Any, place: str) -> None:
    with refused(place):
        call()

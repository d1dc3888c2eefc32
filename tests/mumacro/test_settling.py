"""How fast a disturbance decays: the multiplier and the bound against marching, limits, bad
input."""

import math
from typing import Any

import numpy as np
import pytest

from builder.solver.steady import solve, solve_raw, workspace
from mumacro import Surrogate, motion
from tests.support import naive
from tests.support.cases import CASE, UNIT, log_uniform, opened
from tests.support.comparing import close
from tests.support.refusals import refused
from tests.support.settling import settling

STEPS = 40_000
SLIDING = [(0.3, 0.3), (0.1, 0.2), (0.6, 1.0), (1.0, 0.5)]
STICKING = [(0.02, 0.3), (0.1, 0.6), (0.05, 1.2), (0.3, 1.0), (0.2, 2.0)]


def of(surrogate: Surrogate, v: Any, y: Any, **more: Any) -> Any:
    return settling(surrogate, **UNIT, y0=y, v0=v, **more)


def at_rest_angles(v: float, y: float) -> tuple[float, float]:
    """Cosine of the angle by which the spring turns during stick, and the stick fraction."""
    w, out, orbit, res = workspace()
    assert solve_raw(v, y, y - 1.0, w, out, orbit, res) == 0
    duration, start = orbit[0], orbit[4]
    # in stick the spring's end moves with the upper point; start and end are on the unit circle
    across = y * (math.cos(start + duration) - math.cos(start))
    return 1.0 - 0.5 * ((v * duration) ** 2 + across * across), res[3]


@pytest.mark.parametrize(("v", "y"), SLIDING + STICKING)
def test_the_slip_path_is_the_solvers(surrogate: Surrogate, v: Any, y: Any) -> None:
    decay = of(surrogate, v, y)
    exact = 2.0 * math.pi * solve(v, y).slip_speed
    assert decay.slip_path == close(exact, rel=1e-10)
    cosine = at_rest_angles(v, y)[0] if (v, y) in STICKING else 1.0
    periods = math.log(100.0) / (exact - 2.0 * math.log(abs(cosine)))
    assert abs(decay.periods - periods) <= decay.error_bound
    assert decay.periods_any == close(2.0 * math.log(100.0) / exact, rel=1e-10)
    assert decay.time == close(decay.periods * 2.0 * math.pi, rel=1e-14)
    assert of(surrogate, v, y, remaining=0.1).periods == close(0.5 * decay.periods, rel=1e-14)


@pytest.mark.parametrize(("v", "y"), SLIDING + STICKING)
def test_a_small_disturbance_decays_as_derived(surrogate: Surrogate, v: Any, y: Any) -> None:
    start = naive.march(v, y, STEPS, naive.periods_until_steady(v, y))[-1]
    size = 1e-5
    here = start / np.hypot(*start) if np.hypot(*start) > 1.0 - 1e-9 else start
    beside = here + size * np.array([-here[1], here[0]])
    beside *= min(1.0, 1.0 / np.hypot(*beside))
    apart = [
        float(
            np.hypot(
                *(
                    naive.march(v, y, STEPS, n, *beside)[-1]
                    - naive.march(v, y, STEPS, n, *start)[-1]
                )
            )
        )
        for n in (1, 2)
    ]
    cosine, share = at_rest_angles(v, y) if (v, y) in STICKING else (1.0, 0.0)
    assert (share > 0.0) == ((v, y) in STICKING)
    decay = of(surrogate, v, y)
    assert math.exp(-decay.slip_path) * cosine**2 == close(0.01 ** (1.0 / decay.periods), rel=1e-9)
    assert apart[1] / apart[0] == close(0.01 ** (1.0 / decay.periods), rel=5e-3)


@pytest.mark.parametrize(("v", "y"), [*SLIDING, *STICKING, (0.004, 0.5), (0.01, 0.95)])
def test_any_disturbance_is_gone_in_time(surrogate: Surrogate, v: Any, y: Any) -> None:
    decay = of(surrogate, v, y)
    steady = naive.march(v, y, 4000, naive.periods_until_steady(v, y))[-1]
    rng = np.random.default_rng(1)
    angle, radius = rng.uniform(0.0, 2.0 * math.pi, 12), np.sqrt(rng.uniform(0.0, 1.0, 12))
    starts = [
        (0.0, 0.0),
        (-1.0, 0.0),
        *zip(radius * np.cos(angle), radius * np.sin(angle), strict=True),
    ]
    for start in starts:
        first = float(np.hypot(*(np.array(start) - steady)))
        for n in (1, 3, math.ceil(decay.periods_any)):
            distance = float(np.hypot(*(naive.march(v, y, 4000, n, *start)[-1] - steady)))
            # error of the time steps
            assert distance <= first * math.exp(-0.5 * n * decay.slip_path) + 2e-3
            if n >= decay.periods_any:
                assert distance <= 0.01 * first + 2e-3


@pytest.mark.parametrize(
    ("changed", "periods"),
    [
        ({"v0": 0.0}, math.inf),
        ({"v0": 0.0, "y0": 0.0}, math.inf),
        ({"v0": 0.0, "omega": 0.0}, math.inf),
        ({"k": "rigid", "v0": 0.0, "y0": 0.0}, math.inf),
        ({"k": "rigid"}, 0.0),
        ({"k": math.inf}, 0.0),
    ],
)
def test_without_slip_nothing_settles_and_rigid_at_once(
    surrogate: Surrogate, changed: Any, periods: Any
) -> None:
    decay = settling(surrogate, **{**CASE, **changed})
    assert (decay.periods, decay.time, decay.slip_path) == (
        periods,
        periods,
        0.0 if periods else math.inf,
    )


def test_the_frequency_may_be_f(surrogate: Surrogate) -> None:
    rest = {name: value for name, value in CASE.items() if name != "omega"}
    expected = settling(surrogate, **rest, omega=2.0 * math.pi * 2e4)
    assert settling(surrogate, **rest, f=2e4) == expected
    wrong: list[Any] = [{}, {"f": 2e4, "omega": 1e5}]
    for frequency in wrong:
        with refused("omega"):
            settling(surrogate, **rest, **frequency)


def test_without_oscillation_the_drag_decides(surrogate: Surrogate) -> None:
    l0 = 3e-6
    for changed in ({"y0": 0.0}, {"omega": 0.0}):
        decay = settling(surrogate, **{**CASE, **changed})
        assert decay.time == close(l0 * math.log(100.0) / 0.01, rel=1e-14)
    dragged = settling(surrogate, **{**CASE, "y0": 0.0})
    assert dragged.slip_path == close(2.0 * math.pi * 0.01 / (l0 * 1.3e5), rel=1e-14)
    # the limit of small amplitudes is the same
    assert settling(surrogate, **{**CASE, "y0": 1e-12}).periods == close(dragged.periods, rel=1e-5)


def test_at_zero_speed_only_large_amplitudes_settle(surrogate: Surrogate) -> None:
    for y, slips in ((0.5, False), (1.0, False), (1.5, True)):
        decay = of(surrogate, 0.0, y)
        # slip in every half period is the stroke 2 y~ minus the diameter
        assert decay.slip_path == close(4.0 * (y - 1.0) if slips else 0.0, rel=1e-9)


def test_arrays_broadcast_and_extremes_give_no_warning(surrogate: Surrogate) -> None:
    decay = settling(
        surrogate,
        **{
            **CASE,
            "v0": np.array([[0.0], [1e-300], [0.01], [1e300]]),
            "y0": np.array([0.0, 2e-6, 1e300]),
        },
    )
    assert decay.periods.shape == decay.time.shape == decay.error_bound.shape == (4, 3)
    assert not np.isnan(decay.periods).any()
    assert not np.isnan(decay.time).any()
    assert decay.periods[2, 1] == settling(surrogate, **CASE).periods


def test_an_illegal_case_affects_only_itself(surrogate: Surrogate) -> None:
    decay = settling(
        surrogate, **{**CASE, "v0": np.array([0.01, -1.0, math.nan]), "mu0": np.full(3, 0.3)}
    )
    assert decay.periods[0] == settling(surrogate, **CASE).periods
    for column in (
        decay.periods,
        decay.periods_any,
        decay.time,
        decay.slip_path,
        decay.error_bound,
    ):
        assert np.isnan(column[1:]).all()


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7])
def test_settling_and_a_motion_agree_within_their_bounds_over_the_plane(tolerance: float) -> None:
    table, rng = opened(tolerance), np.random.default_rng(64)
    y, v = log_uniform(rng, 1e-2, 30.0, 500), log_uniform(rng, 1e-3, 30.0, 500)
    decay, cycle = of(table, v, y), motion(**UNIT, y=y, v0=v, tolerance=1e-9)
    # the share of the periods by which the steps of a motion may miss them: 50 times the tolerance
    allowed = decay.error_bound + 5e-8 * decay.periods
    assert np.all(np.abs(decay.periods - cycle.periods) <= allowed)
    assert np.median(decay.error_bound / decay.periods) < tolerance
    sticks = table.stick_fraction(v, y) > 0.0
    assert 100 < sticks.sum() < 400
    # without the turn in stick it would be up to 64 times as long
    assert np.max(math.log(100.0) / decay.slip_path / decay.periods) > 10.0


@pytest.mark.parametrize("v", [1e-300, 1e-12, 1e-3])
def test_at_creep_a_disturbance_is_lost_where_slip_begins(surrogate: Surrogate, v: float) -> None:
    """At half of the largest amplitude the force turns by 60 degrees in each stick."""
    assert of(surrogate, v, 0.5).periods == close(
        math.log(100.0) / -math.log(0.25), rel=0.6 * math.sqrt(v) + 1e-9
    )
    # 90 degrees at 1/sqrt 2
    assert of(surrogate, 1e-12, math.sqrt(0.5)).periods < 0.1


@pytest.mark.parametrize(("v", "y"), [*SLIDING, *STICKING, (1e-3, 30.0), (3.0, 0.1), (1e-6, 0.4)])
def test_a_ball_settles_as_its_slowest_spring(surrogate: Surrogate, v: Any, y: Any) -> None:
    decay = of(surrogate, v, y, contact="ball")
    # a spring with the share s of the middle one's load has l0 that is 1.5 s as long
    # many of them, and more where y~ = 1
    apart = np.outer([-1.0, 1.0], np.geomspace(1e-9, 0.3, 300)).ravel()
    shares = np.append(np.geomspace(1.0, 0.01, 400), y / 1.5 * (1.0 + apart))
    loads = 1.5 * UNIT["Fz"] * shares[shares <= 1.0]
    springs = settling(surrogate, **{**UNIT, "Fz": loads}, y0=y, v0=v)
    slowest = springs.periods.max()
    assert slowest <= (decay.periods + decay.error_bound) * (1.0 + 1e-12)
    assert slowest == close(decay.periods, rel=1e-2)
    assert decay.slip_path == close(springs.slip_path[0], rel=1e-12)
    assert decay.periods_any == close(2.0 * math.log(100.0) / springs.slip_path[0], rel=1e-12)
    cycle = motion(**UNIT, y=y, v0=v, contact="ball", tolerance=1e-5)
    # which sums 20 springs or more, not the slowest one
    assert decay.periods * 0.8 <= cycle.periods <= decay.periods * (1.0 + 1e-4)

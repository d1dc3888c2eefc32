"""The surrogate: its answers at edges and seams of tables; scalars, arrays, threads, xarray."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from builder.solver.sweep import Sweep
from builder.tables.draws import SEAMS
from builder.tables.quantities import ABS_TO_REL, SOLVER_NOISE
from mumacro import Surrogate
from mumacro.closed_forms import outer
from mumacro.table.atlas import SIGMA_CUT, SOURCES, Y_STICK_HI, Y_STICK_LO
from tests.support.cases import CASE, Array, Case, log_uniform, tables
from tests.support.comparing import close
from tests.support.refusals import refused

table, fine = tables(), tables(1e-7)


# --- answers at the edges -------------------------------------------------------------------------

N = 1500
Draw = Callable[..., Array]


def beside(low: float, high: float) -> Draw:
    """Factors next to 1, on both sides."""
    return lambda rng: 1.0 + rng.choice([-1.0, 1.0], N) * log_uniform(rng, low, high, N)


def between(low: float, high: float) -> Draw:
    return lambda rng: log_uniform(rng, low, high, N)


#: where -> amplitudes, and speeds from them and the border
EDGES: dict[str, tuple[Draw, Draw]] = {
    "beside the border": (
        between(1e-4, 1e7),
        lambda rng, _, crit: crit * beside(3e-16, 1e-12)(rng),
    ),
    "on the seams": (
        lambda rng: rng.choice(SEAMS, N) * (1.0 + rng.integers(-3, 4, N) * 2.0**-53),
        lambda rng, *_: between(1e-9, 1e5)(rng),
    ),
    "beside the cut of the corner": (
        lambda rng: rng.uniform(Y_STICK_LO, Y_STICK_HI, N),
        lambda rng, _, crit: crit * SIGMA_CUT**2 * beside(1e-16, 1e-2)(rng),
    ),
    "around the corner": (beside(1e-15, 0.25), lambda rng, *_: between(1e-14, 0.1)(rng)),
    "hardly moving": (between(1e-8, 1e8), lambda rng, *_: between(1e-60, 1e-12)(rng)),
    "hardly shaken": (between(1e-15, 1e-8), lambda rng, *_: between(1e-30, 1e3)(rng)),
    "shaken wildly": (between(1e3, 1e12), lambda rng, y, _: np.sqrt(y) * between(1e-3, 1e3)(rng)),
}


@pytest.mark.parametrize("where", EDGES)
def test_fresh_solves_at_the_edges_lie_within_tolerance_and_bound(
    table: Surrogate, where: str, sweep: Sweep
) -> None:
    rng = np.random.default_rng(5)
    amplitudes, speeds = EDGES[where]
    y = amplitudes(rng)
    v = speeds(rng, y, table.v_tilde_crit(y))
    truth = sweep.solve("full", v, y)["mu_ratio"]
    mu, bound, _ = table.quantity("mu_ratio", v, y)
    error = np.abs(mu - truth)
    assert error.max() <= table.tolerance
    assert (error / truth).max() <= ABS_TO_REL * table.tolerance + SOLVER_NOISE
    assert np.all(error <= bound + SOLVER_NOISE * truth)


def test_speeds_whose_square_overflows_still_follow_the_elliptic_integral(table: Surrogate) -> None:
    rng = np.random.default_rng(9)
    v = log_uniform(rng, 1e100, 1e300, 500)
    r = np.minimum(log_uniform(rng, 1e-6, 1e6, 500), 1e307 / v)
    mu, bound, source = table.quantity("mu_ratio", v, r * v)
    assert mu == close(outer(r), rel=2e-15)
    assert np.all(bound <= 1e-14 * mu)
    assert set(source) == {SOURCES.index("tail_fast")}


@pytest.mark.parametrize(
    ("name", "v", "y", "value", "bound"),
    [
        *(("power", v, y, 0.0, 0.0) for v, y in ((0.3, 0.0), (math.inf, 2.0), (0.0, 0.5))),
        *(
            ("stick_fraction", v, y, 0.0, 0.0)
            for v, y in ((0.3, 0.0), (50.0, 1.0), (math.inf, 2.0), (1e5, 1e3))
        ),
        ("stick_fraction", 0.0, 0.5, 1.0, 0.0),
        # y~ = 1 at v~ = 0 is a corner: the last digit of y~ moves both
        ("power", 0.0, 1.0, 0.0, 1e-14),
        ("stick_fraction", 0.0, 1.0, 1.0, 1e-6),
        ("power", 1.0, math.inf, math.inf, 0.0),
        ("mu_ratio", math.inf, 2.0, 1.0, 0.0),
    ],
)
def test_companions_at_the_ends(
    table: Surrogate, name: str, v: float, y: float, value: float, bound: float
) -> None:
    result, off, _ = table.quantity(name, v, y)
    assert result == value
    assert 0.0 < off < bound if bound else off == 0.0


def test_creep_at_large_amplitude_has_no_step_where_its_formula_changes(table: Surrogate) -> None:
    y = np.geomspace(1e6, 1e60, 20)
    below, above = (
        table.mu_ratio(1e-100 * y * side, y) / side for side in (1.0 - 1e-12, 1.0 + 1e-12)
    )
    assert np.all(below > 0.0)
    assert below == close(above, rel=1e-11)


def test_bounds_of_the_companions_are_finite_and_small_at_random_points(table: Surrogate) -> None:
    rng = np.random.default_rng(8)
    v, y = log_uniform(rng, 1e-100, 1e100, 50_000), log_uniform(rng, 1e-100, 1e100, 50_000)
    power, of_power = table.quantity("power", v, y)[:2]
    _, of_stick = table.quantity("stick_fraction", v, y)[:2]
    assert np.all(np.isfinite(of_power) & (of_power > 0.0))
    assert np.all(
        (of_stick >= 0.0)
        & (of_stick <= math.sqrt(table.border.max_rel_error) + 20.0 * table.tolerance)
    )
    # the bound is small relative to the power, except for denormal numbers
    assert np.all((of_power <= 1e-3 * power)[power > 1e-280])
    assert table.quantity("power", float(v[0]), float(y[0]))[:2] == (power[0], of_power[0])
    assert 0.0 < table.stick_fraction(0.0, 2.0) < 1.0 < 1.0 + table.power(0.0, 2.0)


@pytest.mark.parametrize("v", [1e4, 1e8, 1e50, 1e140, 1e160, 1e250])
def test_power_at_large_speed_is_that_of_the_shaker_against_friction(
    table: Surrogate, v: float
) -> None:
    """p = y~^2/(2 v~) for y~ << v~, where a closed form would lose digits."""
    for y in (y for y in (1.5, 2.0, 1e2, 1e5) if y <= 1e-3 * v):
        expected = 0.5 * y * (y / v)
        power, bound = table.quantity("power", v, y)[:2]
        assert (
            abs(power - expected)
            <= bound + expected * (1.0 / v**2 if v < 1e100 else 0.0) + expected * (y / v) ** 2
        )
        assert bound <= 2.0 * max(1e-13, table.tolerance) * expected


# --- scalars and arrays ---------------------------------------------------------------------------


@pytest.mark.parametrize("n", [1, 2, 300])
def test_a_value_for_all_cases_may_come_as_a_number_or_as_an_array_of_one(
    fine: Surrogate, n: int
) -> None:
    v0 = np.linspace(0.0, 0.02, n)
    shapes: list[Callable[[float], Any]] = [
        lambda x: np.full(n, x),
        float,
        np.array,
        lambda x: np.array([[x]]),
    ]
    shapes += [lambda x: np.array([x])]
    cases: list[Case] = [
        {**{name: shaped(x) for name, x in CASE.items()}, "v0": v0} for shaped in shapes
    ]
    expected, *others = (np.asarray(fine.evaluate(**case).mu_macro) for case in cases)
    assert all(np.array_equal(result.ravel(), expected) for result in others)


@pytest.mark.parametrize("options", [{}, {"include": "groups"}, {"gradient": True}], ids=str)
@pytest.mark.parametrize("shape", [(0,), (0, 3)])
def test_empty_arrays_give_empty_answers(
    fine: Surrogate, shape: tuple[int, ...], options: Case
) -> None:
    for mu0 in (0.3, -0.3):
        answer = fine.evaluate(**{**CASE, "mu0": mu0, "v0": np.empty(shape)}, **options)
        assert answer.mu_macro.shape == answer.error_bound.shape == answer.source.shape == shape
    with refused("mu0"):
        fine.evaluate(**{**CASE, "mu0": -0.3, "v0": np.empty(shape)}, illegal="raise", **options)


# --- threads and xarray ---------------------------------------------------------------------------


def test_a_copy_on_one_thread_leaves_the_original_its_threads(fine: Surrogate) -> None:
    several = Surrogate.open(fine.path, threads=3)
    assert several.on_threads(1).threads == 1
    assert several.threads == 3
    in_memory = Surrogate(fine.table, "this table")
    assert in_memory.on_threads(1).mu_ratio(0.1, 0.5) == fine.mu_ratio(0.1, 0.5)


def test_a_copy_without_a_number_of_threads_has_the_usual_number(fine: Surrogate) -> None:
    usual = Surrogate.open(fine.path).threads
    for threads in (usual + 1, usual + 2):
        several = Surrogate.open(fine.path, threads=threads)
        assert (several.threads, several.on_threads(None).threads) == (threads, usual)


def test_a_bundled_table_is_read_once() -> None:
    assert Surrogate.open() is Surrogate.open()
    assert Surrogate.open(1e-10, threads=1).table is Surrogate.open(1e-10).table
    path = Surrogate.open().path
    assert Surrogate.open(path).table is not Surrogate.open(path).table


@pytest.mark.parametrize(
    ("tolerance", "least"), [(1.0, "1e-4"), (1e-4, "1e-4"), (9.9e-5, "1e-7"), (1e-12, "1e-12")]
)
def test_a_tolerance_opens_the_smallest_table_that_meets_it(tolerance: float, least: str) -> None:
    assert Surrogate.open(tolerance).id == f"mumacro-{least}"


@pytest.mark.parametrize("tolerance", [True, 0.0, -1e-4, math.nan, 9e-13, b"1e-4"])
def test_a_tolerance_has_bounds(tolerance: Any) -> None:
    with refused("tolerance"):
        Surrogate.open(tolerance)


@pytest.mark.parametrize("threads", [0, -1, 1.0, True, "2", 100_000])
def test_threads_have_bounds(fine: Surrogate, threads: Any) -> None:
    with refused("threads"):
        Surrogate.open(fine.path, threads=threads)

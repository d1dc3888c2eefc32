"""The surrogate: shapes, types, threads, pickles, xarray, and its answers at edges and seams of tables."""

import json
import math
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from builder.assemble import ABS_TO_REL
from builder.measure import SEAMS
from builder.quantities import SOLVER_NOISE
from builder.sweep import Sweep
from comparing import close
from mumacro import Answer, InputError, Surrogate
from mumacro.charts import NAMES, SIGMA_CUT, SOURCES, Y_STICK_HI, Y_STICK_LO
from mumacro.closed_forms import outer

Array = NDArray[np.float64]
TABLES = sorted((Path(__file__).parent.parent / "tables").glob("*.nc"))
CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}


@pytest.fixture(scope="module", params=TABLES, ids=lambda path: path.stem)
def table(request: Any) -> Surrogate:
    return Surrogate.open(request.param)


@pytest.fixture(scope="module")
def fine() -> Surrogate:
    return Surrogate.open(TABLES[0])


def log_uniform(rng: np.random.Generator, low: float, high: float, n: int) -> Array:
    return 10.0 ** rng.uniform(math.log10(low), math.log10(high), n)


# --- answers at the edges -----------------------------------------------------------------------------

N = 1500


def beside_the_border(rng: np.random.Generator, table: Surrogate) -> tuple[Array, Array]:
    y = log_uniform(rng, 1e-4, 1e7, N)
    return table.v_tilde_crit(y) * (1.0 + rng.choice([-1.0, 1.0], N) * log_uniform(rng, 3e-16, 1e-12, N)), y


def on_the_seams(rng: np.random.Generator, _: Surrogate) -> tuple[Array, Array]:
    return log_uniform(rng, 1e-9, 1e5, N), rng.choice(SEAMS, N) * (1.0 + rng.integers(-3, 4, N) * 2.0**-53)


def beside_the_cut_of_the_corner(rng: np.random.Generator, table: Surrogate) -> tuple[Array, Array]:
    y = rng.uniform(Y_STICK_LO, Y_STICK_HI, N)
    off = 1.0 + rng.choice([-1.0, 1.0], N) * log_uniform(rng, 1e-16, 1e-2, N)
    return table.v_tilde_crit(y) * SIGMA_CUT**2 * off, y


def around_the_corner(rng: np.random.Generator, _: Surrogate) -> tuple[Array, Array]:
    return log_uniform(rng, 1e-14, 0.1, N), 1.0 + rng.choice([-1.0, 1.0], N) * log_uniform(rng, 1e-15, 0.25, N)


def hardly_moving(rng: np.random.Generator, _: Surrogate) -> tuple[Array, Array]:
    return log_uniform(rng, 1e-60, 1e-12, N), log_uniform(rng, 1e-8, 1e8, N)


def hardly_shaken(rng: np.random.Generator, _: Surrogate) -> tuple[Array, Array]:
    return log_uniform(rng, 1e-30, 1e3, N), log_uniform(rng, 1e-15, 1e-8, N)


def shaken_wildly(rng: np.random.Generator, _: Surrogate) -> tuple[Array, Array]:
    y = log_uniform(rng, 1e3, 1e12, N // 3)
    return np.sqrt(y) * log_uniform(rng, 1e-3, 1e3, N // 3), y


@pytest.mark.parametrize(
    "where",
    [
        beside_the_border,
        on_the_seams,
        beside_the_cut_of_the_corner,
        around_the_corner,
        hardly_moving,
        hardly_shaken,
        shaken_wildly,
    ],
)
def test_fresh_solves_at_the_edges_lie_within_tolerance_and_bound(table: Surrogate, where: Any, sweep: Sweep) -> None:
    v, y = where(np.random.default_rng(5), table)
    truth = sweep.solve("full", v, y)["mu_ratio"]
    mu, bound, _ = table.ratio_with_bound(v, y)
    error = np.abs(mu - truth)
    assert error.max() <= table.tolerance
    assert (error / truth).max() <= ABS_TO_REL * table.tolerance + SOLVER_NOISE
    assert np.all(error <= bound + SOLVER_NOISE * truth)


def test_speeds_whose_square_overflows_still_follow_the_elliptic_integral(table: Surrogate) -> None:
    rng = np.random.default_rng(9)
    v = log_uniform(rng, 1e100, 1e300, 500)
    r = np.minimum(log_uniform(rng, 1e-6, 1e6, 500), 1e307 / v)
    mu, bound, source = table.ratio_with_bound(v, r * v)
    assert mu == close(outer(r), rel=2e-15)
    assert np.all(bound <= 1e-14 * mu)
    assert set(source) == {SOURCES.index("tail_fast")}


def test_bound_next_to_the_corner_is_small(table: Surrogate) -> None:
    # one digit of y~ changes mu~ by at most the root of two digits, also at the cusp
    v = np.geomspace(1e-300, 1e-9, 400)
    _, bound, _ = table.ratio_with_bound(v, 1.0)
    assert bound.max() <= 1e-7 + table.tolerance


def test_mu_is_a_ratio_rising_with_speed_and_falling_with_amplitude_at_random_points(table: Surrogate) -> None:
    rng = np.random.default_rng(3)
    v, y = log_uniform(rng, 1e-12, 1e8, 200_000), log_uniform(rng, 1e-8, 1e8, 200_000)
    mu, bound, _ = table.ratio_with_bound(v, y)
    assert np.all((mu > 0.0) & (mu <= 1.0))
    assert np.all(np.isfinite(bound) & (bound >= 0.0))
    for faster in (1.0 + 1e-9, 1.01, 1.5):
        assert np.all(table.mu_ratio(v * faster, y) >= mu - 2.0 * bound)
        assert np.all(table.mu_ratio(v, y * faster) <= mu + 2.0 * bound)


def test_companions_at_the_ends_of_the_quadrant(table: Surrogate) -> None:
    assert table.power(0.3, 0.0) == table.power(math.inf, 2.0) == table.power(0.0, 0.5) == 0.0
    assert table.stick_fraction(0.3, 0.0) == table.stick_fraction(50.0, 1.0) == 0.0
    assert table.stick_fraction(0.0, 0.5) == 1.0
    assert 0.0 < table.stick_fraction(0.0, 2.0) < 1.0
    assert table.power(0.0, 2.0) > 0.0
    assert table.power(np.array([0.1, 0.2]), 0.5).shape == (2,)


def test_bounds_of_the_companions_at_the_ends_of_the_quadrant(table: Surrogate) -> None:
    for v, y in ((0.3, 0.0), (math.inf, 2.0), (0.0, 0.5)):
        assert table.power_with_bound(v, y)[1] == 0.0
    for v, y in ((0.3, 0.0), (50.0, 1.0), (0.0, 0.5), (math.inf, 2.0), (1e5, 1e3)):
        assert table.stick_fraction_with_bound(v, y)[1] == 0.0
    # y~ = 1 at v~ = 0 is a corner: the last digit of y~ moves both
    assert 0.0 < table.power_with_bound(0.0, 1.0)[1] < 1e-14
    assert 0.0 < table.stick_fraction_with_bound(0.0, 1.0)[1] < 1e-6
    assert table.power_with_bound(1.0, math.inf)[0] == math.inf


def test_bounds_of_the_companions_are_finite_and_small_at_random_points(table: Surrogate) -> None:
    rng = np.random.default_rng(8)
    v, y = log_uniform(rng, 1e-100, 1e100, 50_000), log_uniform(rng, 1e-100, 1e100, 50_000)
    power, of_power = table.power_with_bound(v, y)
    stick, of_stick = table.stick_fraction_with_bound(v, y)
    assert np.array_equal(power, table.power(v, y))
    assert np.array_equal(stick, table.stick_fraction(v, y))
    assert np.all(np.isfinite(of_power) & (of_power > 0.0))
    assert np.all((of_stick >= 0.0) & (of_stick <= math.sqrt(table.border.max_rel_error) + 20.0 * table.tolerance))
    # the bound is small relative to the power, except for denormal numbers
    ordinary = power > 1e-280
    assert np.all(of_power[ordinary] <= 1e-3 * power[ordinary])
    one = table.power_with_bound(float(v[0]), float(y[0]))
    assert one == (power[0], of_power[0])
    assert type(one[1]) is float
    assert table.stick_fraction_with_bound(v[:6].reshape(2, 3), 0.5)[1].shape == (2, 3)


@pytest.mark.parametrize("y", [1.5, 2.0, 1e2, 1e5])
@pytest.mark.parametrize("v", [1e4, 1e8, 1e50, 1e140, 1e160, 1e250])
def test_power_at_large_speed_is_that_of_the_shaker_against_friction(table: Surrogate, v: float, y: float) -> None:
    """p = y~^2/(2 v~) for y~ << v~, where a closed form would lose digits."""
    if y > 1e-3 * v:
        pytest.skip("the amplitude is not small compared with the speed")
    expected = 0.5 * y * (y / v)
    power, bound = table.power_with_bound(v, y)
    assert abs(power - expected) <= bound + expected * (1.0 / v**2 if v < 1e100 else 0.0) + expected * (y / v) ** 2
    assert bound <= 2.0 * max(1e-13, table.tolerance) * expected


def test_powers_and_friction_balance(fine: Surrogate, sweep: Sweep) -> None:
    # v~ mu~ + power is the slip path; in the exact solver it is at least v~ mu~ (the shaker gains no work)
    rng = np.random.default_rng(12)
    v, y = log_uniform(rng, 1e-6, 1e4, 2000), log_uniform(rng, 1e-3, 1e5, 2000)
    solved = sweep.solve("full", v, y)
    assert np.all(fine.power(v, y) >= 0.0)
    assert fine.power(v, y) == close(solved["power"], rel=1e-5)


# --- shapes, types, calls -----------------------------------------------------------------------------


def test_scalars_of_every_kind_agree(fine: Surrogate) -> None:
    expected = fine.mu_ratio(2.0, 1.0)
    assert isinstance(expected, float)
    for two, one in ((2, 1), (np.float64(2.0), np.float64(1.0)), (np.array(2.0), 1.0), (np.int64(2), 1)):
        found = fine.mu_ratio(two, one)
        assert isinstance(found, float)
        assert found == expected
    assert fine.mu_ratio(np.float32(2.0), 1.0) == expected


def test_arrays_of_every_layout_agree(fine: Surrogate) -> None:
    rng = np.random.default_rng(1)
    v, y = log_uniform(rng, 1e-3, 1e3, 60).reshape(6, 10), log_uniform(rng, 1e-3, 1e3, 60).reshape(6, 10)
    expected = np.array(
        [[fine.mu_ratio(a, b) for a, b in zip(p, q, strict=True)] for p, q in zip(v.tolist(), y.tolist(), strict=True)]
    )
    read_only = v.copy()
    read_only.flags.writeable = False
    spread = np.zeros((12, 30))
    spread[::2, ::3] = v
    for layout in (v, np.asfortranarray(v), read_only, spread[::2, ::3], v.tolist(), v.astype(">f8")):
        assert np.array_equal(fine.mu_ratio(layout, y), expected)
    assert np.array_equal(fine.mu_ratio(v.T, y.T), expected.T)
    assert np.array_equal(fine.mu_ratio(v[::-1], y[::-1]), expected[::-1])
    single = v.astype(np.float32)
    assert np.array_equal(fine.mu_ratio(single, y), fine.mu_ratio(single.astype(float), y))
    assert spread.sum() == close(v.sum(), rel=1e-14)  # inputs are not written to


def test_broadcasting(fine: Surrogate) -> None:
    v, y = np.geomspace(1e-3, 1e3, 7), np.geomspace(1e-2, 1e2, 5)
    plane = fine.mu_ratio(v[:, None], y)
    assert plane.shape == (7, 5)
    for i in range(7):
        assert np.array_equal(fine.mu_ratio(v[i], y), plane[i])
    assert fine.mu_ratio([], 1.0).shape == (0,)
    assert fine.mu_ratio(np.ones((0, 3)), np.ones(3)).shape == (0, 3)
    assert fine.mu_ratio([2.0], [[1.0]]).shape == (1, 1)
    with pytest.raises(ValueError, match="broadcast"):
        fine.mu_ratio(np.ones(3), np.ones(2))


def test_scalars_and_arrays_agree_bit_for_bit(table: Surrogate) -> None:
    rng = np.random.default_rng(6)
    n = 400
    columns = {
        "mu0": rng.uniform(0.1, 1.0, n),
        "Fz": log_uniform(rng, 1e-3, 1e4, n),
        "k": log_uniform(rng, 1e3, 1e9, n),
        "y0": log_uniform(rng, 1e-9, 1e-3, n),
        "omega": log_uniform(rng, 1.0, 1e6, n),
        "v0": log_uniform(rng, 1e-9, 10.0, n),
    }
    columns["v0"][::7] = 0.0
    columns["y0"][::11] = 0.0
    whole = table.evaluate(**columns, gradient=True)
    assert len(set(whole.source)) >= 6
    for i in range(n):
        one = table.evaluate(**{name: float(values[i]) for name, values in columns.items()}, gradient=True)
        for name in ("mu_macro", "mu_ratio", "error_bound", "v_tilde", "y_tilde", "length_scale", "regime", "source"):
            assert getattr(one, name) == getattr(whole, name)[i], name
        for name in columns:
            assert one.gradient[name] == whole.gradient[name][i]
            assert one.gradient_bound[name] == whole.gradient_bound[name][i]
        for name in ("regime_code", "regime_certain"):
            assert getattr(one, name) == getattr(whole, name)[i], name


def test_answer_shows_itself(fine: Surrogate) -> None:
    found = fine.evaluate(**CASE)
    assert isinstance(found, Answer)
    shown = repr(found)
    for part in ("mu_macro=", "regime='stick_slip'", "source='stick_slip_low'", "v_tilde="):
        assert part in shown
    assert "gradient" not in shown
    assert "gradient_bound={'mu0': " in repr(fine.evaluate(**CASE, gradient=True))
    assert not hasattr(found, "__dict__")


def test_one_bad_value_in_an_array_of_groups_affects_only_itself(fine: Surrogate) -> None:
    v = np.array([0.1, -1.0, math.nan, math.inf, math.inf, 0.1])
    y = np.array([0.5, 0.5, 0.5, 0.5, math.inf, math.inf])
    found = fine.mu_ratio(v, y)
    assert found[0] == fine.mu_ratio(0.1, 0.5)
    assert found[3] == 1.0
    assert np.isnan(found[[1, 2, 4, 5]]).all()


@pytest.mark.parametrize(
    ("v", "y", "field"),
    [
        (-1.0, 1.0, "v_tilde"),
        (math.nan, 1.0, "v_tilde"),
        (1.0, -1e-300, "y_tilde"),
        (1.0, math.nan, "y_tilde"),
        (1.0, math.inf, "y_tilde"),
    ],
)
def test_one_bad_scalar_is_refused_by_name(fine: Surrogate, v: float, y: float, field: str) -> None:
    with pytest.raises(InputError) as caught:
        fine.mu_ratio(v, y)
    assert caught.value.field == field


# --- description --------------------------------------------------------------------------------------


def test_description_is_plain_data(table: Surrogate) -> None:
    assert table.id == table.path.stem
    assert [block["name"] for block in table.blocks] == list(NAMES)
    again = json.loads(json.dumps({"blocks": table.blocks, "attributes": table.attributes}))
    assert again["attributes"]["content_sha256"] == table.checksum
    assert again["attributes"]["tolerance"] == table.tolerance
    assert again["attributes"]["builder_options"]["tolerance"] == table.tolerance
    assert 0.0 < table.max_abs_error <= table.tolerance
    assert 0.0 < table.max_rel_error <= ABS_TO_REL * table.tolerance
    assert table.memory > 10_000
    for block in table.blocks:
        assert block["verified_max_abs_error"] <= table.tolerance


def test_the_self_check_passes(table: Surrogate) -> None:
    table.self_check()


# --- sharing ------------------------------------------------------------------------------------------


def test_threads_may_evaluate_at_once(fine: Surrogate) -> None:
    rng = np.random.default_rng(4)
    v, y = log_uniform(rng, 1e-3, 1e3, 30_000), log_uniform(rng, 1e-3, 1e3, 30_000)
    inputs = {"mu0": 0.5, "Fz": 2.0, "k": 1.0, "y0": y, "omega": 1.0, "v0": v}
    expected = (fine.mu_ratio(v, y), fine.evaluate(**inputs, gradient=True).gradient["v0"], fine.power(v, y))
    wrong: list[object] = []

    def work() -> None:
        try:
            for _ in range(4):
                found = (fine.mu_ratio(v, y), fine.evaluate(**inputs, gradient=True).gradient["v0"], fine.power(v, y))
                if not all(np.array_equal(a, b) for a, b in zip(found, expected, strict=True)):
                    wrong.append("a thread got other numbers")
                assert fine.mu_ratio(0.1, 0.5) == fine.mu_ratio(0.1, 0.5)
        except Exception as error:
            wrong.append(error)

    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_xarray_applies_it(fine: Surrogate) -> None:
    v = xr.DataArray(np.geomspace(1e-3, 1e3, 40), dims="v_tilde", coords={"v_tilde": np.geomspace(1e-3, 1e3, 40)})
    y = xr.DataArray(np.geomspace(1e-3, 1e3, 30), dims="y_tilde", coords={"y_tilde": np.geomspace(1e-3, 1e3, 30)})
    plane = xr.apply_ufunc(fine.mu_ratio, v, y)
    assert plane.dims == ("v_tilde", "y_tilde")
    assert np.array_equal(plane.values, fine.mu_ratio(v.values[:, None], y.values))
    assert np.array_equal(plane.v_tilde, v)


def test_xarray_applies_it_on_dask_chunks(fine: Surrogate) -> None:
    dask_array = pytest.importorskip("dask.array", reason="dask is an optional way to spread the work")
    values = np.geomspace(1e-3, 1e3, 40)
    v = xr.DataArray(dask_array.from_array(values, chunks=7), dims="v_tilde")
    y = xr.DataArray(dask_array.from_array(values[:30], chunks=11), dims="y_tilde")
    plane = xr.apply_ufunc(fine.mu_ratio, v, y, dask="parallelized", output_dtypes=[float])
    assert plane.chunks is not None
    assert np.array_equal(plane.compute().values, fine.mu_ratio(values[:, None], values[:30]))


# --- threads ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("threads", [0, -1, 1.0, True, "2", 100_000])
def test_threads_out_of_bounds_are_refused(tables_dir: Path, threads: Any) -> None:
    with pytest.raises(InputError, match="threads"):
        Surrogate.open(tables_dir / "mumacro-1e-7.nc", threads=threads)


def test_groups_of_arrays_are_returned_if_requested(tables_dir: Path) -> None:
    table = Surrogate.open(tables_dir / "mumacro-1e-7.nc")
    columns = {**CASE, "v0": np.array([0.0, 1e-3, 0.01])}
    plain = table.evaluate(**columns)
    for name in ("v_tilde", "y_tilde", "length_scale"):
        with pytest.raises(AttributeError, match=f"{name} was not requested"):
            getattr(plain, name)
    assert "v_tilde" not in repr(plain)
    for asked in (table.evaluate(**columns, groups=True), table.evaluate(**columns, gradient=True)):
        np.testing.assert_array_equal(asked.mu_macro, plain.mu_macro)
        for i, v0 in enumerate(columns["v0"]):
            one = table.evaluate(**{**CASE, "v0": float(v0)})
            assert (asked.v_tilde[i], asked.y_tilde[i], asked.length_scale[i]) == (
                one.v_tilde, one.y_tilde, one.length_scale,
            )  # fmt: skip


@pytest.mark.parametrize("n", [1, 2, 300])
def test_a_value_for_all_cases_may_come_as_a_number_or_as_an_array_of_one(tables_dir: Path, n: int) -> None:
    table = Surrogate.open(tables_dir / "mumacro-1e-7.nc")
    v0 = np.linspace(0.0, 0.02, n)
    expected = table.evaluate(**{**{k: np.full(n, x) for k, x in CASE.items()}, "v0": v0}).mu_macro
    for shaped in (float, lambda x: np.array([x]), lambda x: np.array(x), lambda x: np.array([[x]])):
        found = table.evaluate(**{**{k: shaped(x) for k, x in CASE.items()}, "v0": v0}).mu_macro
        np.testing.assert_array_equal(found.ravel(), expected)


@pytest.mark.parametrize("asked", [{}, {"groups": True}, {"gradient": True}])
@pytest.mark.parametrize("shape", [(0,), (0, 3)])
def test_empty_arrays_give_empty_answers(tables_dir: Path, shape: tuple[int, ...], asked: dict[str, bool]) -> None:
    table = Surrogate.open(tables_dir / "mumacro-1e-7.nc")
    found = table.evaluate(**{**CASE, "v0": np.empty(shape)}, **asked)
    assert found.mu_macro.shape == found.error_bound.shape == found.source.shape == shape
    assert table.mu_ratio(np.empty(shape), 0.5).shape == shape
    nothing = table.evaluate(**{**CASE, "mu0": -0.3, "v0": np.empty(shape)}, **asked)
    assert nothing.mu_macro.shape == shape
    with pytest.raises(InputError, match="mu0"):
        table.evaluate(**{**CASE, "mu0": -0.3, "v0": np.empty(shape)}, illegal="raise", **asked)

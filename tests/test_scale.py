"""Designs made chunk by chunk and reductions of answers: right values, lazy, from any start counter."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from comparing import close
from mumacro import InputError, Surrogate
from mumacro.scale.sequence import DIMENSIONS, MOST_POINTS, shifts, sobol_points

dask = pytest.importorskip("dask")
da = pytest.importorskip("dask.array")
pytest.importorskip("distributed")
from mumacro.scale import best, grid, quantiles, sobol  # noqa: E402 (only where Dask is)

FIXED: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "omega": 1.3e5}


@pytest.fixture(scope="module")
def table() -> Surrogate:
    return Surrogate.open(1e-7)


def no_compute(*_: Any, **__: Any) -> None:
    raise AssertionError("something was computed")


# --- Sobol points ---------------------------------------------------------------------------------------


def test_the_sequence_is_scipys() -> None:
    from scipy.stats import qmc

    ours = np.stack([sobol_points(d, 0, 4096, 0) for d in range(DIMENSIONS)], axis=1)
    np.testing.assert_array_equal(ours - 2.0**-53, qmc.Sobol(DIMENSIONS, scramble=False).random(4096))


@pytest.mark.parametrize("first", [0, 1, 7, 2**20 - 3, 2**40 + 12345, MOST_POINTS - 100])
def test_a_chunk_may_start_at_any_counter(first: int) -> None:
    for d in range(DIMENSIONS):
        whole = sobol_points(d, first, 100, 3)
        np.testing.assert_array_equal(whole[37:], sobol_points(d, first + 37, 63, 3))
        assert np.all((whole > 0.0) & (whole < 1.0))


@pytest.mark.parametrize("first", [0, 5 * 2**10, 2**45])
def test_every_aligned_block_is_evenly_spread_in_each_dimension(first: int) -> None:
    for d, shift in enumerate(shifts(7)):
        counts = np.bincount((sobol_points(d, first, 1024, shift) * 1024).astype(int), minlength=1024)
        assert np.all(counts == 1)


def test_a_seed_shifts_and_others_shift_otherwise() -> None:
    np.testing.assert_array_equal(shifts(3), shifts(3))
    assert len({int(shifts(seed)[d]) for seed in range(4) for d in range(DIMENSIONS)}) == 4 * DIMENSIONS
    assert not shifts(None).any()


# --- designs --------------------------------------------------------------------------------------------


def test_designs_are_lazy_and_do_not_depend_on_chunks(table: Surrogate) -> None:
    inputs: dict[str, Any] = {**FIXED, "y0": lambda u: 1e-5 * u, "v0": lambda u: 10.0 ** (4.0 * u - 4.0)}
    with dask.config.set(scheduler=no_compute):
        huge = table.evaluate(sobol(2**50, chunk=2**44, **inputs))
        plane = grid(**FIXED, chunk=50, y0=np.linspace(0.0, 1e-5, 7), v0=np.geomspace(1e-4, 1.0, 40))
        answer = table.evaluate(plane)
        assert huge.mu_macro.size == 2**50
        assert answer.mu_macro.data.numblocks == (7, 1)
        finer = grid(**FIXED, chunk=15, y0=np.linspace(0.0, 1e-5, 7), v0=np.geomspace(1e-4, 1.0, 40))
        assert finer.v0.data.numblocks == (3,)
    y, v = np.meshgrid(np.linspace(0.0, 1e-5, 7), np.geomspace(1e-4, 1.0, 40), indexing="ij")
    expected = table.evaluate({**FIXED, "y0": y, "v0": v}).mu_macro
    for cases in (plane, finer):
        np.testing.assert_array_equal(table.evaluate(cases).mu_macro, expected)
    a, b = (sobol(1000, chunk=chunk, **inputs) for chunk in (1000, 77))
    for name in ("y0", "v0"):
        np.testing.assert_array_equal(a[name], b[name])
    np.testing.assert_array_equal(a.y0, 1e-5 * sobol_points(0, 0, 1000, int(shifts(0)[0])))


def test_distributions_constants_and_rigid_contact(table: Surrogate) -> None:
    from scipy import stats

    cases = sobol(4096, mu0=stats.norm(0.3, 0.01), Fz=10, k=None, f=stats.uniform(1e4, 1e4), y0=2e-6, v0=0.01)
    assert float(cases.mu0.mean()) == close(0.3, abs=3e-5)
    assert float(cases.f.min()) >= 1e4
    answer = table.evaluate(cases)
    assert set(answer.source.values) == {"rigid"}
    np.testing.assert_array_equal(grid(k=None, v0=[1.0]).k, math.inf)


def test_an_average_is_closer_than_by_random_points(table: Surrogate) -> None:
    inputs: dict[str, Any] = {**FIXED, "y0": lambda u: 4e-6 * u, "v0": lambda u: 0.1 * u}
    means = [float(table.evaluate(sobol(2**14, seed=i, **inputs)).mu_macro.mean()) for i in range(4)]
    one = table.evaluate(sobol(2**14, **inputs)).mu_macro
    assert np.std(means) < 0.05 * float(one.std()) / math.sqrt(2**14)


def test_inputs_may_be_coordinates(table: Surrogate) -> None:
    cases = xr.Dataset(
        dict.fromkeys(("mu0", "Fz"), 1.0), coords={"y0": [0.5, 2.0], "v0": [0.1], "k": 1.0, "omega": 1.0}
    )
    np.testing.assert_array_equal(table.evaluate(cases).mu_macro.squeeze("v0"), table.mu_ratio(0.1, [0.5, 2.0]))


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: sobol(0, v0=abs), "n"),
        (lambda: sobol(2**53, v0=abs), "n"),
        (lambda: sobol(8, v0=1.0), "inputs"),
        (lambda: sobol(8, chunk=0, v0=abs), "chunk"),
        (lambda: sobol(8, **dict.fromkeys("abcdefg", abs)), "inputs"),
        (lambda: sobol(8, v0=abs, y0=[1.0, 2.0]), "y0"),
        (lambda: sobol(8, v0=abs, y0="2um"), "y0"),
        (lambda: grid(v0=[]), "v0"),
        (lambda: grid(v0=[[1.0]]), "v0"),
        (lambda: grid(v0="fast"), "v0"),
        (lambda: grid(chunk=1.5, v0=[1.0]), "chunk"),
    ],
)
def test_bad_designs_are_refused(make: Any, field: str) -> None:
    with pytest.raises(InputError) as caught:
        make()
    assert caught.value.field == field


# --- reductions -----------------------------------------------------------------------------------------


def test_quantiles_enclose_the_exact_ones() -> None:
    rng = np.random.default_rng(3)
    values = rng.beta(0.5, 3.0, (40, 50))
    values[3, ::7] = math.nan
    q = [[0.0, 0.1], [0.5, 1.0]]
    exact = np.quantile(values[~np.isnan(values)], q, method="inverted_cdf")
    for given in (da.from_array(values, chunks=17), xr.DataArray(values, dims=("a", "b")).chunk(13)):
        below, above = quantiles(given, q, bins=1000)
        assert below.shape == (2, 2)
        assert np.all((below <= exact) & (exact <= above))
        np.testing.assert_allclose(above - below, 1e-3)


@pytest.mark.parametrize("n", [1, 2, 7])
def test_a_quantile_of_few_values_is_one_of_them(n: int) -> None:
    values, q = np.linspace(0.05, 0.95, n), np.linspace(0.0, 1.0, 41)
    below, above = quantiles(da.from_array(values, chunks=3), q, bins=1000)
    exact = np.quantile(values, q, method="inverted_cdf")
    assert np.all((below <= exact) & (exact <= above))


@pytest.mark.parametrize(
    ("values", "q", "field"),
    [([0.5, 1.5], 0.5, "values"), ([0.5, -0.1], 0.5, "values"), ([math.nan], 0.5, "values"), ([0.5], 1.1, "q")],
)
def test_quantiles_refuse_what_they_cannot_count(values: list[float], q: float, field: str) -> None:
    with pytest.raises(InputError) as caught:
        quantiles(da.from_array(np.array(values), chunks=1), q)
    assert caught.value.field == field


def test_the_best_case_is_found_among_those_allowed(table: Surrogate) -> None:
    cases = grid(**FIXED, chunk=33, y0=np.linspace(-1e-6, 1e-5, 23), v0=np.geomspace(1e-4, 1.0, 40))
    answer = table.evaluate(cases)
    found = best(cases, cases.y0 / cases.v0, answer.mu_macro <= 0.15)
    y, v = np.meshgrid(cases.y0.values, cases.v0.values, indexing="ij")
    mu = table.evaluate({**FIXED, "y0": y, "v0": v}).mu_macro
    with np.errstate(invalid="ignore"):
        ratio = np.where(mu <= 0.15, y / v, math.inf)
    at = np.unravel_index(np.argmin(ratio), ratio.shape)
    assert (float(found.y0), float(found.v0), float(found.objective)) == (y[at], v[at], ratio[at])
    assert float(found.mu0) == 0.3
    # illegal amplitudes give NaN and are never best
    lowest = best(cases, answer.mu_macro)
    assert float(lowest.objective) == np.nanmin(mu)
    with pytest.raises(InputError, match="at least one case"):
        best(cases, cases.y0, answer.mu_macro < 0.0)

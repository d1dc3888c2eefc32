"""Sobol designs made chunk by chunk: evenly spread, lazy, reproducible, and refused where they are wrong."""

import math
from typing import Any

import numpy as np
import pytest
import xarray as xr

from comparing import close
from mumacro import InputError, Surrogate

dask = pytest.importorskip("dask")
pytest.importorskip("distributed")
from mumacro.scale import CHUNK, MOST_CHUNKS, sobol  # noqa: E402 (only where Dask is)

FIXED: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "omega": 1.3e5}


@pytest.fixture(scope="module")
def table() -> Surrogate:
    return Surrogate.open(1e-7)


def no_compute(*_: Any, **__: Any) -> None:
    raise AssertionError("something was computed")


def uniform(n: int, **options: Any) -> Any:
    """Two coordinates as they come."""
    return sobol(n, mu0=lambda u: u, v0=lambda u: u, **options)


def test_every_chunk_is_evenly_spread_in_each_dimension_and_in_squares() -> None:
    points = uniform(5 * 1024, chunk=1024)
    for i in range(5):
        x, y = (points[name].values[1024 * i : 1024 * (i + 1)] for name in ("mu0", "v0"))
        assert x.min() > 0.0
        assert x.max() < 1.0
        for column in (x, y):
            assert np.all(np.bincount((column * 1024).astype(int), minlength=1024) == 1)
        assert np.all(np.histogram2d(x, y, bins=32, range=((0, 1), (0, 1)))[0] == 1)  # a (0, 10, 2)-net


def test_chunks_and_seeds_are_other_points_and_the_same_seed_the_same() -> None:
    one, again, other = (uniform(4096, chunk=1024, seed=seed).v0.values for seed in (3, 3, 4))
    np.testing.assert_array_equal(one, again)
    parts = [*one.reshape(4, 1024), *other.reshape(4, 1024)]
    assert np.unique(np.sort(parts, axis=1), axis=0).shape == (8, 1024)


@pytest.mark.parametrize(("n", "chunk", "sizes"), [(1, 7, (1,)), (20, 7, (7, 7, 6)), (14, 7, (7, 7))])
def test_chunks_add_up_to_the_cases(n: int, chunk: int, sizes: tuple[int, ...]) -> None:
    points = uniform(n, chunk=chunk)
    assert points.v0.data.chunks == (sizes,)
    assert np.unique(points.v0.values).size == n


# --- designs --------------------------------------------------------------------------------------------


def test_designs_are_lazy(table: Surrogate) -> None:
    inputs: dict[str, Any] = {**FIXED, "y0": lambda u: 1e-5 * u, "v0": lambda u: 10.0 ** (4.0 * u - 4.0)}
    with dask.config.set(scheduler=no_compute):
        huge = table.evaluate(sobol(2**40, chunk=2**30, **inputs))
        assert huge.mu_macro.size == 2**40
    with dask.config.set(scheduler="synchronous"):
        alone = sobol(50 * CHUNK, **inputs).v0[49 * CHUNK :].values
    assert alone.size == CHUNK


def test_distributions_constants_and_rigid_contact(table: Surrogate) -> None:
    from scipy import stats

    cases = sobol(4096, mu0=stats.norm(0.3, 0.01), Fz=10, k=None, f=stats.uniform(1e4, 1e4), y0=2e-6, v0=0.01)
    assert float(cases.mu0.mean()) == close(0.3, abs=3e-5)
    assert float(cases.f.min()) >= 1e4
    answer = table.evaluate(cases)
    assert set(answer.source.values) == {"rigid"}
    np.testing.assert_array_equal(cases.k, math.inf)


def test_an_average_is_closer_than_by_random_points(table: Surrogate) -> None:
    inputs: dict[str, Any] = {**FIXED, "y0": lambda u: 4e-6 * u, "v0": lambda u: 0.1 * u}
    means = [float(table.evaluate(sobol(2**14, seed=i, **inputs)).mu_macro.mean()) for i in range(4)]
    one = table.evaluate(sobol(2**14, **inputs)).mu_macro
    assert np.std(means) < 0.05 * float(one.std()) / math.sqrt(2**14)
    chunked = table.evaluate(sobol(2**14, chunk=2**12, **inputs)).mu_macro.values.reshape(4, -1).mean(axis=1)
    assert abs(chunked.mean() - np.mean(means)) < 4.0 * chunked.std(ddof=1) / 2.0


def test_inputs_may_be_coordinates(table: Surrogate) -> None:
    cases = xr.Dataset(
        dict.fromkeys(("mu0", "Fz"), 1.0), coords={"y0": [0.5, 2.0], "v0": [0.1], "k": 1.0, "omega": 1.0}
    )
    np.testing.assert_array_equal(table.evaluate(cases).mu_macro.squeeze("v0"), table.mu_ratio(0.1, [0.5, 2.0]))


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: sobol(0, v0=abs), "n"),
        (lambda: sobol(2.0, v0=abs), "n"),  # type: ignore[arg-type]
        (lambda: sobol(MOST_CHUNKS * CHUNK + 1, v0=abs), "n"),
        (lambda: sobol(8, v0=1.0), "inputs"),
        (lambda: sobol(8, chunk=0, v0=abs), "chunk"),
        (lambda: sobol(8, chunk=2**31, v0=abs), "chunk"),
        (lambda: sobol(8, seed=-1, v0=abs), "seed"),
        (lambda: sobol(8, seed=None, v0=abs), "seed"),  # type: ignore[arg-type]
        (lambda: sobol(8, v0=abs, y0=[1.0, 2.0]), "y0"),
        (lambda: sobol(8, v0=abs, y0="2um"), "y0"),
    ],
)
def test_bad_designs_are_refused(make: Any, field: str) -> None:
    with pytest.raises(InputError) as caught:
        make()
    assert caught.value.field == field

"""What comes in as pandas, Polars, Arrow, xarray or Dask goes out so; Dask stays lazy until
compute()."""

import json
import math
import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from mumacro import REGIMES, SOURCES, InputError, Surrogate
from mumacro.inputs.fields import FIELDS
from tests.support.cases import CASE, Case, tables
from tests.support.refusals import refused

N = 60
MORE = ("groups", "gradient")
table = tables(1e-7)


def columns(n: int = N) -> Case:
    """Cases of every regime, including rigid and illegal ones."""
    rng = np.random.default_rng(5)
    result = {name: np.full(n, value) for name, value in CASE.items()}
    result["v0"] = 10.0 ** rng.uniform(-4.0, 0.0, n)
    result["y0"] = 10.0 ** rng.uniform(-7.0, -5.0, n)
    result["k"][::7] = math.inf
    result["v0"][::11] = 0.0
    result["mu0"][3] = -0.3
    result["v0"][5] = math.nan
    return result


def same(answer: Any, expected: Any) -> None:
    """Two answers have the same outputs in their order, for any frame or array; the expected ones
    are plain arrays."""
    names = getattr(answer, "column_names", None) or getattr(answer, "columns", answer)
    assert [*names] == expected.paths
    for path in expected.paths:
        values = np.asarray(answer[path])
        if values.dtype == object:  # a text is missing where a case is illegal
            texts = [x if isinstance(x, str) else "" for x in values.ravel()]
            values = np.array(texts).reshape(values.shape)
        np.testing.assert_array_equal(values, expected[path], err_msg=path)


# --- pandas ---------------------------------------------------------------------------------------


def test_series_give_a_frame_with_their_index(table: Surrogate) -> None:
    index = pd.Index([f"case {i}" for i in range(N)], name="which")
    frame = pd.DataFrame(columns(), index=index)
    answer = table.evaluate(**{name: frame[name] for name in FIELDS}, include=MORE)
    same(answer, table.evaluate(columns(), include=MORE))
    assert isinstance(answer, pd.DataFrame)
    assert answer.index.equals(index)


def test_regime_and_source_of_pandas_are_categories_without_one_for_illegal_cases(
    table: Surrogate,
) -> None:
    answer = table.evaluate(pd.DataFrame(columns()))
    expected = table.evaluate(columns())
    assert list(answer.columns) == ["mu_macro", "mu_ratio", "regime", "error_bound", "source"]
    for name, kinds in (("regime", REGIMES), ("source", SOURCES)):
        assert isinstance(answer[name].dtype, pd.CategoricalDtype)
        assert list(answer[name].cat.categories) == list(kinds)
        assert answer[name].astype(object).fillna("").tolist() == getattr(expected, name).tolist()
        assert answer[name].isna().tolist() == (expected.source_code == -1).tolist()
    np.testing.assert_array_equal(answer["mu_macro"], expected.mu_macro)
    assert answer.groupby("regime", observed=True)["mu_ratio"].count().sum() == N - 2


@pytest.mark.parametrize("index", ["dates", "two levels", "repeated", "empty"])
def test_a_frame_gives_a_frame_with_its_index(table: Surrogate, index: str) -> None:
    n = 0 if index == "empty" else N
    at = {
        "dates": pd.date_range("2020-01-01", periods=N, freq="h"),
        "two levels": pd.MultiIndex.from_product(
            [range(N // 2), ["left", "right"]], names=["trial", "side"]
        ),
        "repeated": pd.Index([1] * N),
        "empty": pd.RangeIndex(0),
    }[index]
    frame = pd.DataFrame(
        {**{name: values[:n] for name, values in columns().items()}, "note": ["x"] * n}, index=at
    )
    answer = table.evaluate(frame)
    assert answer.index.equals(at)
    np.testing.assert_array_equal(answer["mu_ratio"], table.evaluate(columns()).mu_ratio[:n])
    assert "note" in frame  # ignored
    assert "note" not in answer


def test_numbers_and_arrays_go_beside_series(table: Surrogate) -> None:
    index = pd.Index(range(10, 10 + N))
    inputs = columns()
    v0 = pd.Series(inputs["v0"], index=index)
    expected = table.evaluate({**CASE, "v0": inputs["v0"], "k": inputs["k"], "mu0": 0.3})
    answer = table.evaluate(**{**CASE, "v0": v0, "k": inputs["k"]})
    np.testing.assert_array_equal(answer.mu_macro.to_numpy(), expected.mu_macro)
    assert answer.mu_macro.index.equals(index)
    rigid = table.evaluate(**{**CASE, "v0": v0, "k": "rigid"})
    np.testing.assert_array_equal(
        rigid.mu_macro, table.evaluate({**CASE, "v0": inputs["v0"], "k": "rigid"}).mu_macro
    )
    frequency = table.evaluate(pd.DataFrame({"v0": v0, "f": 2e4}), mu0=0.3, Fz=10.0, k=1e6, y0=2e-6)
    expected = table.evaluate(mu0=0.3, Fz=10.0, k=1e6, y0=2e-6, f=2e4, v0=inputs["v0"])
    np.testing.assert_array_equal(frequency["mu_macro"], expected.mu_macro)


def test_integers_and_missing_values_of_pandas(table: Surrogate) -> None:
    for v0 in (pd.Series([1, None, 3], dtype="Int64"), pd.Series([1.0, None, 3.0])):
        answer = table.evaluate(**{**CASE, "v0": v0})
        assert (
            answer.mu_macro.isna().tolist() == answer.source.isna().tolist() == [False, True, False]
        )
        assert answer.mu_macro[0] == table.evaluate(**{**CASE, "v0": 1.0}).mu_macro


@pytest.mark.parametrize("gap", [None, pd.NA, math.nan], ids=repr)
def test_a_gap_in_a_column_of_objects_rejects_its_row_alone(table: Surrogate, gap: Any) -> None:
    cases = pd.DataFrame({**CASE, "v0": [0.01, 0.02, 0.03, 0.04]})
    cases["k"] = pd.Series([1e6, gap, "rigid", 1e6], dtype=object)
    cases["mu0"] = pd.Series([0.3, 0.3, 0.3, gap], dtype=object)
    answer = table.evaluate(cases)
    assert answer["mu_macro"].isna().tolist() == [False, True, False, True]
    assert answer["source"].isna().tolist() == [False, True, False, True]
    case = {**CASE, "mu0": 0.3}
    assert answer["mu_macro"][0] == table.evaluate(**{**case, "k": 1e6, "v0": 0.01}).mu_macro
    assert answer["mu_macro"][2] == table.evaluate(**{**case, "k": "rigid", "v0": 0.03}).mu_macro


@pytest.mark.parametrize("dtype", [object, "str", "string"])
def test_a_gap_in_a_column_of_texts_rejects_its_row_alone(table: Surrogate, dtype: Any) -> None:
    words = pd.Series(["rigid", None, "rigid"], dtype=dtype)
    answer = table.evaluate(**{**CASE, "k": words})
    assert answer.mu_macro.isna().tolist() == [False, True, False]
    assert answer.mu_macro[2] == table.evaluate(**{**CASE, "k": "rigid"}).mu_macro


def test_indexes_that_differ_are_told(table: Surrogate) -> None:
    one, two = pd.Series([0.01, 0.02]), pd.Series([10.0, 10.0], index=[1, 2])
    with pytest.raises(InputError, match="indexed as the other inputs") as caught:
        table.evaluate(**{**CASE, "Fz": two, "v0": one})
    assert caught.value.field == "v0"
    with pytest.raises(InputError):
        table.evaluate(**{**CASE, "Fz": pd.Series([1.0, 2.0, 3.0]), "v0": one})
    with pytest.raises(InputError):
        table.evaluate(**{**CASE, "Fz": np.ones(3), "v0": one})


def test_policies_hold_for_labels_too(table: Surrogate) -> None:
    frame = pd.DataFrame(columns())
    with refused("mu0[3]"):
        table.evaluate(frame, illegal="raise")
    with refused("Fz"):
        table.evaluate(frame.drop(columns="Fz"))
    with refused("v0"):
        table.evaluate(frame, v0=1.0)
    with refused("v0"):
        table.evaluate(frame.assign(v0="fast"))
    with refused("inputs"):
        table.evaluate(**{**CASE, "v0": pd.Series([0.1]), "Fz": xr.DataArray([1.0])})


# --- xarray ---------------------------------------------------------------------------------------


def plane() -> dict[str, xr.DataArray]:
    inputs = columns()
    v0 = xr.DataArray(
        inputs["v0"],
        dims="speed",
        coords={"speed": np.arange(N), "hour": ("speed", np.arange(N) / 4)},
    )
    k = xr.DataArray([1e5, 1e6, math.inf, -1.0], dims="spring", coords={"spring": list("abcd")})
    return {"v0": v0, "k": k}


def test_data_arrays_broadcast_by_name_and_keep_their_coordinates(table: Surrogate) -> None:
    inputs = plane()
    answer = table.evaluate(**{**CASE, **inputs}, include=MORE)
    expected = table.evaluate(
        {**CASE, "v0": inputs["v0"].values[:, None], "k": inputs["k"].values[None, :]},
        include=MORE,
    )
    dims = answer.mu_macro.dims
    assert set(dims) == {"speed", "spring"}

    same(answer.transpose("speed", "spring"), expected)
    assert isinstance(answer, xr.Dataset)
    for array in answer.values():
        assert array.dims == dims
        assert array.spring.values.tolist() == list("abcd")
        assert "hour" in array.coords


def test_a_dataset_gives_a_dataset(table: Surrogate) -> None:
    data = xr.Dataset(
        {**{name: CASE[name] for name in ("mu0", "Fz", "y0", "omega")}, **plane(), "note": 1.0}
    )
    answer = table.evaluate(data)
    assert isinstance(answer, xr.Dataset)
    assert set(answer) == {"mu_macro", "mu_ratio", "regime", "error_bound", "source"}
    assert dict(answer.sizes) == {"speed": N, "spring": 4}
    one = answer.sel(speed=7, spring="b")
    expected = table.evaluate(**{**CASE, "v0": float(data.v0[7]), "k": 1e6})
    assert float(one.mu_macro) == expected.mu_macro
    assert str(one.source.values) == expected.source


def test_coordinates_and_chunks_that_do_not_fit_are_told(table: Surrogate) -> None:
    da = pytest.importorskip("dask.array")
    with pytest.raises(InputError, match="align them first"):
        table.evaluate(**{**CASE, "v0": da.ones(3), "Fz": da.ones(2)})
    one = xr.DataArray([0.01, 0.02, 0.03], dims="x", coords={"x": [0, 1, 2]})
    two = xr.DataArray([10.0, 20.0, 30.0], dims="x", coords={"x": [1, 2, 3]})
    with pytest.raises(InputError, match="align them first"):
        table.evaluate(**{**CASE, "v0": one, "Fz": two})


# --- Dask -----------------------------------------------------------------------------------------


def no_compute(*_: Any, **__: Any) -> Any:
    raise AssertionError("computed before it was asked to")


def test_dask_arrays_stay_lazy_and_keep_their_chunks(table: Surrogate) -> None:
    da = pytest.importorskip("dask.array")
    dask = pytest.importorskip("dask")
    inputs = columns()
    chunks = (17, 20, 23)
    lazy = {name: da.from_array(values, chunks=(chunks,)) for name, values in inputs.items()}
    expected = table.evaluate(inputs, include=MORE)
    with dask.config.set(scheduler=no_compute):
        answer = table.evaluate(**lazy, include=MORE)
        for path, array in answer.items():
            assert isinstance(array, da.Array), path
            assert array.chunks == (chunks,), path
            assert array.shape == (N,)
        with pytest.raises(AssertionError, match="computed before"):
            answer["mu_macro"].compute()
    with dask.config.set(scheduler="threads"):
        same(answer, expected)
        assert answer["mu_macro"].dtype == np.float64


def test_a_dask_dataset_stays_lazy(table: Surrogate) -> None:
    dask = pytest.importorskip("dask")
    data = xr.Dataset(
        {**{name: CASE[name] for name in ("mu0", "Fz", "y0", "omega")}, **plane()}
    ).chunk(speed=13)
    with dask.config.set(scheduler=no_compute):
        answer = table.evaluate(data)
        assert answer.mu_macro.chunks is not None
        assert answer.source.chunks is not None
    whole = table.evaluate(data.compute())
    assert whole.attrs.pop("remarks").startswith("k (60 cases): rigid")
    with dask.config.set(scheduler="threads"):
        xr.testing.assert_identical(answer.compute(), whole)


def test_an_illegal_value_of_a_chunk_is_reported_when_it_is_computed(table: Surrogate) -> None:
    da = pytest.importorskip("dask.array")
    v0 = da.from_array(np.array([0.01, -1.0, 0.02]), chunks=2)
    answer = table.evaluate(**{**CASE, "v0": v0}, illegal="raise")
    with refused("v0[1]"):
        answer["mu_macro"].compute(scheduler="threads")
    lazy = table.evaluate(**{**CASE, "v0": v0})["mu_macro"]
    assert np.isnan(lazy.compute()).tolist() == [False, True, False]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_cluster_that_loses_a_worker_gives_the_same_bits(table: Surrogate) -> None:
    dask, distributed = pytest.importorskip("dask"), pytest.importorskip("distributed")
    v0 = xr.DataArray(np.geomspace(1e-4, 1.0, 40_000), dims="case")
    whole = table.evaluate(**{**CASE, "v0": v0})
    lazy = table.evaluate(**{**CASE, "v0": v0.chunk(case=1000)}).mu_macro
    options = {
        "n_workers": 2,
        "threads_per_worker": 1,
        "dashboard_address": None,
        "host": "127.0.0.1",
    }
    # forked workers need not load everything again
    start = "fork" if hasattr(os, "fork") else "spawn"
    with (
        dask.config.set({"distributed.worker.multiprocessing-method": start}),
        distributed.LocalCluster(processes=True, **options) as cluster,
        distributed.Client(cluster) as client,
    ):
        numbers = client.run(os.getpid)
        chunks = distributed.futures_of(begun := client.persist(lazy))
        distributed.wait(chunks, timeout=300, return_when="FIRST_COMPLETED")
        (keeper, *_), *_ = (places for places in client.who_has(chunks).values() if places)
        assert not all(chunk.done() for chunk in chunks)
        os.kill(numbers[keeper], signal.SIGKILL)  # what it has computed so far is lost
        np.testing.assert_array_equal(begun.compute().values, whole.mu_macro.values)
        assert keeper not in client.run(os.getpid)


# --- names and units; other tables ----------------------------------------------------------------


def test_remarks_come_with_xarray_and_are_written_by_netcdf(
    table: Surrogate, tmp_path: Path
) -> None:
    speeds = xr.DataArray([0.01, 400.0, 500.0], dims="t")
    amplitudes = xr.DataArray([2e-6, 3e-6], dims="y")
    both = table.evaluate(**{**CASE, "v0": speeds, "y0": amplitudes})
    assert both.attrs["remarks"].startswith("v0 (4 cases): v0 = 400 m/s")
    data = table.evaluate(xr.Dataset({**CASE, "v0": speeds}))
    assert data.attrs["remarks"].startswith("v0 (2 cases): v0 = 400 m/s")
    data.drop_vars(["regime", "source"]).to_netcdf(tmp_path / "answer.nc")
    assert "remarks" not in table.evaluate(xr.Dataset({**CASE, "v0": speeds[:1]})).attrs
    assert "remarks" not in table.evaluate(**{**CASE, "v0": speeds.chunk({"t": 1})}).attrs


def test_results_of_xarray_have_names_and_units_of_their_own(table: Surrogate) -> None:
    v0 = xr.DataArray(
        [0.01, 0.02], dims="t", name="v0", attrs={"units": "m/s", "long_name": "sliding speed"}
    )
    answer = table.evaluate(**{**CASE, "v0": v0}, include=MORE)
    arrays = dict(answer.items())
    for name, array in arrays.items():
        assert array.name == name
        assert set(array.attrs) == {"units", "long_name"}
        assert array.attrs["long_name"] != "sliding speed"
    units = {
        name: array.attrs["units"] for name, array in arrays.items() if array.attrs["units"] != "1"
    }
    per = {"Fz": "1/N", "k": "m/N", "y0": "1/m", "omega": "s/rad", "v0": "s/m"}
    expected = {
        f"gradient{end}.{name}": unit for name, unit in per.items() for end in ("", "_bound")
    }
    assert units == {**expected, "groups.l0": "m"}
    data = table.evaluate(xr.Dataset({**CASE, "v0": v0}))
    assert data.mu_macro.attrs == answer.mu_macro.attrs
    assert v0.attrs["units"] == "m/s"  # the input is as it was


def test_a_dask_data_frame_gives_one_and_stays_lazy(table: Surrogate) -> None:
    frames = pytest.importorskip("dask.dataframe")
    frame = pd.DataFrame({**columns(), "note": "x"}).drop(columns="Fz")
    lazy = frames.from_pandas(frame, npartitions=3)
    answer = table.evaluate(lazy, Fz=10.0)
    assert isinstance(answer, frames.DataFrame)
    assert answer.npartitions == 3
    pd.testing.assert_frame_equal(
        answer.compute(scheduler="threads"), table.evaluate(frame, Fz=10.0)
    )
    with refused("v0"):
        table.evaluate(lazy, Fz=10.0, v0=0.01)
    with refused("Fz"):
        table.evaluate(lazy)
    with pytest.raises(InputError, match=r"^v0 must be a Dask array: .to_dask_array"):
        table.evaluate(**{**CASE, "v0": lazy["v0"]})


@pytest.mark.parametrize("name", ["table", "record_batch"])
def test_tables_of_arrow_give_tables_and_columns_arrays(table: Surrogate, name: str) -> None:
    pa = pytest.importorskip("pyarrow")
    make: Any = getattr(pa, name)
    inputs = {name: values.tolist() for name, values in columns().items()}
    inputs["v0"][7] = None
    inputs["omega"] = [130_000] * N
    expected = columns()
    expected["v0"][7] = math.nan
    want = table.evaluate(expected, include=MORE)
    answer = table.evaluate(make(inputs), include=MORE)
    assert type(answer) is type(make(inputs))
    same(pa.table(answer), want)
    by_name = table.evaluate(**{name: make(inputs)[name] for name in inputs}, include=MORE)
    np.testing.assert_array_equal(by_name.mu_macro, want.mu_macro)
    [*remarks] = json.loads(answer.schema.metadata[b"remarks"])
    assert remarks == want.remarks
    with_text = make({**inputs, "k": ["rigid"] * N})
    np.testing.assert_array_equal(
        table.evaluate(with_text)["mu_macro"].to_numpy(),
        table.evaluate({**expected, "k": math.inf}).mu_macro,
    )
    rigid = table.evaluate(**{**inputs, "k": with_text["k"], "v0": 0.01}).mu_macro
    np.testing.assert_array_equal(
        rigid, table.evaluate({**expected, "k": math.inf, "v0": 0.01}).mu_macro
    )
    gap = make({"k": [None, 1e6]})["k"]
    assert np.isnan(table.evaluate(**{**CASE, "k": gap}).mu_macro).tolist() == [True, False]


def test_a_stream_of_arrow_is_read_once(table: Surrogate) -> None:
    pa = pytest.importorskip("pyarrow")
    rows = pa.table(
        {**{name: [value] * 3 for name, value in CASE.items()}, "v0": [0.01, 0.02, None]}
    )
    answer = table.evaluate(rows.to_reader(max_chunksize=2))
    assert isinstance(answer, pa.Table)
    np.testing.assert_array_equal(
        answer["mu_macro"],
        table.evaluate({**CASE, "v0": np.array([0.01, 0.02, math.nan])}).mu_macro,
    )


@pytest.mark.peer
def test_a_frame_of_polars_gives_one_and_remarks_are_warnings(table: Surrogate) -> None:
    pl = pytest.importorskip("polars", reason="polars of requirements/peers.txt is not installed")
    frame = pl.DataFrame({**columns(), "note": ["x"] * N}).rename({"v0": "v0 [m/s]"})
    with pytest.warns(UserWarning, match=r"remark: k: rigid") as caught:
        answer = table.evaluate(frame, include=MORE)
    assert caught[0].filename == __file__
    assert isinstance(answer, pl.DataFrame)
    same(answer, table.evaluate(columns(), include=MORE))
    assert answer["source"].null_count() == 2
    with refused("cases"):
        table.evaluate(frame.lazy())

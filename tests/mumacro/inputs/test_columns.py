"""A column of a program becomes float64 in SI with the unit that belongs to it, or is refused."""

import decimal
import fractions
import io
import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest

from mumacro import InputError
from mumacro.inputs.columns import Column, is_column, read_column, to_si
from tests.support.cases import CASE, opened
from tests.support.refusals import refused

MISSING, NOT_TEXT = "is missing", "must be a number, not a text"
GAPS: dict[str, tuple[str, Any, dict[int, str]]] = {
    "None": ("y0", [1.0, None], {1: MISSING}),
    "an empty text": ("y0", ["", 1.0], {0: MISSING}),
    "k": ("k", [1.0, None], {1: "is missing; write rigid or a number"}),
    "a text": ("y0", [1.0, "2um"], {1: NOT_TEXT}),
    "a deviation": ("k", [1.0, "1 ± 0.1"], {1: NOT_TEXT}),
    "an interval": ("k", [1.0, "1..2 N/um"], {1: NOT_TEXT}),
    "rigid where it has no meaning": ("v0", [1.0, "rigid"], {1: NOT_TEXT}),
    "the deviation of k": ("std_k", [1.0, "rigid"], {1: NOT_TEXT}),
    "objects of NumPy": ("y0", np.array([1.0, None], object), {1: MISSING}),
    "objects of pandas": (
        "y0",
        pd.Series([1.0, pd.NA, "x"], dtype=object),
        {1: MISSING, 2: NOT_TEXT},
    ),
    "within rows": ("y0", [[1.0, 2.0], [None, 4.0]], {2: MISSING}),
    "gaps alone": ("y0", [None, None], {0: MISSING, 1: MISSING}),
}


@pytest.mark.parametrize("kind", GAPS)
def test_a_text_or_none_among_numbers_is_a_gap_with_its_reason(kind: str) -> None:
    name, values, reasons = GAPS[kind]
    column = read_column(name, values)
    assert {place: fault.reason for place, fault in column.faults.items()} == reasons
    assert np.flatnonzero(np.isnan(column.si)).tolist() == [*reasons]
    with pytest.raises(InputError) as first:
        to_si(name, values)
    assert (first.value.field, first.value.index) == (name, next(iter(reasons)))


@pytest.mark.parametrize("values", [["rigid"] * 2, ["Rigid", 1e6], pd.Series([1.0, " rigid "])])
def test_the_word_rigid_is_a_number_in_a_column_of_k(values: Any) -> None:
    column = read_column("k", values)
    assert np.isinf(column.si).any()
    assert not column.faults


NUMBERS: dict[str, Any] = {
    "list": [0.5, 2],
    "tuple": (0.5, 2),
    "range": range(2),
    "half": np.array([0.5, 2.0], np.float16),
    "long": np.array([0.5, 2.0], np.longdouble),
    "big endian": np.array([0.5, 2.0], ">f8"),
    "whole numbers": np.array([1, 2], np.uint8),
    "Decimals": [decimal.Decimal("0.5"), fractions.Fraction(2)],
    "objects": np.array([0.5, 2], object),
    "masked": np.ma.array([0.5, 2.0]),
    "memory": memoryview(np.array([0.5, 2.0]).data),
    "Series": pd.Series([0.5, 2.0]),
    "Index": pd.Index([0.5, 2.0]),
    "categories": pd.Series([0.5, 2.0]).astype("category"),
}


@pytest.mark.parametrize("kind", NUMBERS)
def test_numbers_of_every_container_are_doubles(kind: str) -> None:
    values = NUMBERS[kind]
    column = read_column("mu0", values)
    assert column.si.dtype == np.float64
    assert column.si.tolist() == [float(x) for x in values]
    assert (column.unit, dict(column.faults)) == (None, {})


def test_doubles_are_not_copied_and_gaps_of_arrays_are_nan() -> None:
    array = np.array([1.0, 2.0])
    assert read_column("y0", array).si is array
    for gap in (
        np.ma.array([1.0, 2.0], mask=[False, True]),
        np.ma.array([1, 2], mask=[False, True]),
        pd.Series([1, None], dtype="Int64"),
        pd.Series([1.0, None], dtype="Float64"),
    ):
        np.testing.assert_array_equal(read_column("y0", gap).si, [1.0, math.nan])


BAD: dict[str, tuple[Any, str]] = {
    "texts": (["1um", "2um"], "not of texts: write the unit into its header"),
    "texts of NumPy": (np.array(["1um", "2um"]), "convert the texts to numbers"),
    "texts of pandas": (pd.Series(["1um", "2um"], dtype="string"), "header"),
    "texts and gaps": (["1um", None], "header"),
    "truth values": (np.array([True]), "not truth values"),
    "truth values of pandas": (pd.Series([True, None], dtype="boolean"), "real number"),
    "a truth value": ([1.0, True], "at index 1"),
    "complex numbers": (np.array([1j, 2.0]), "not complex numbers"),
    "a complex number": ([1.0, 1j], "at index 1"),
    "times": (np.array(["2026-01-01"], "M8[s]"), "not times"),
    "times of pandas": (pd.Series(pd.date_range("2026", periods=2)), "not times"),
    "times with a zone": (pd.Series(pd.date_range("2026", periods=2, tz="UTC")), "real number"),
    "durations": (np.array([1], "m8[s]"), "not durations"),
    "bytes": ([b"1"], "at index 0"),
    "bytes of NumPy": (np.array([b"1"]), "real number"),
    "records": (np.zeros(1, [("a", float)]), "real number"),
    "objects": ([object()], "at index 0"),
    "a frame": (pd.DataFrame({"a": [1.0]}), "one column of it"),
    "lists of two lengths": ([[1.0], [1.0, 2.0]], "lists of one length"),
    "beyond doubles": ([1.0, 10**400], "at index 1"),
    "beyond doubles, long": (np.array([1.0, np.longdouble(1e300) * 1e300]), "at index 1"),
    "a mapping within": ([{}], "at index 0"),
}


@pytest.mark.parametrize("kind", BAD)
def test_what_is_no_column_of_numbers_has_one_fault_with_its_name(kind: str) -> None:
    values, words = BAD[kind]
    with refused("y0[*]") as refusal:
        read_column("y0", values)
    assert words in str(refusal.value)
    assert len(str(refusal.value)) < 400


@pytest.mark.parametrize("value", [1.0, "1", np.float32(1.0), np.array(1.0), None, b"1", {}, float])
def test_one_value_is_no_column(value: Any) -> None:
    assert not is_column(value)


# --- the unit belongs to the column ---------------------------------------------------------------


def xarray_units(attribute: str, unit: str) -> Any:
    return pytest.importorskip("xarray").DataArray([10.0, 20.0], attrs={attribute: unit})


def pandas_units(attribute: str, unit: str) -> Any:
    series = pd.Series([10.0, 20.0])
    series.attrs[attribute] = unit
    return series


def h5py_units(attribute: str, unit: str) -> Any:
    variable = (
        pytest.importorskip("h5py").File(io.BytesIO(), "w").create_dataset("v0", data=[10.0, 20.0])
    )
    variable.attrs[attribute] = unit
    return variable


FILES = itertools.count()


def netcdf_units(attribute: str, unit: str) -> Any:
    name = f"in memory {next(FILES)}"
    file = pytest.importorskip("netCDF4").Dataset(name, "w", diskless=True)
    file.createDimension("t", 2)
    variable = file.createVariable("v0", "f8", ("t",))
    variable[:] = [10.0, 20.0]
    variable.setncattr(attribute, unit)
    return variable


CONTAINERS: dict[str, Callable[[str, str], Any]] = {
    "xarray": xarray_units,
    "pandas": pandas_units,
    "h5py": h5py_units,
    "netCDF4": netcdf_units,
}


@pytest.mark.parametrize("attribute", ["units", "unit", "Units", "Unit"])
@pytest.mark.parametrize("container", CONTAINERS)
def test_the_unit_that_a_container_says_is_that_of_its_numbers(
    container: str, attribute: str
) -> None:
    make = CONTAINERS[container]
    column = read_column("v0", make(attribute, "mm s-1"))
    assert (column.si.tolist(), column.unit) == ([0.01, 0.02], "mm/s")
    assert read_column("v0", make(attribute, "mm/s"), unit="mm s^-1").si.tolist() == [0.01, 0.02]
    assert read_column("v0", make(attribute, " ")).si.tolist() == [10.0, 20.0]
    for unit, header in (("kg", ""), ("furlongs", ""), ("m/s", "mm/s"), ("mm/s", "kg")):
        with refused("v0"):
            read_column("v0", make(attribute, unit), unit=header)


def test_units_of_a_frame_and_of_the_fields_of_a_table_are_those_of_their_columns() -> None:
    surrogate = opened(1e-7)
    frame = pd.DataFrame({**CASE, "v0": [10.0, 20.0]})
    frame.attrs["units"] = {"v0": "mm/s", "note": "kg"}
    right = surrogate.evaluate({**CASE, "v0": np.array([0.01, 0.02])}).mu_macro
    assert surrogate.evaluate(frame)["mu_macro"].tolist() == right.tolist()
    pa = pytest.importorskip("pyarrow")
    table = pa.table({**{name: [x, x] for name, x in CASE.items()}, "v0": [10.0, 20.0]})
    for key in ("unit", "units"):
        units = {"v0": {key: "mm/s"}}
        fields = [
            pa.field(name, pa.float64(), metadata=units.get(name)) for name in table.schema.names
        ]
        said = pa.table(table.columns, schema=pa.schema(fields))
        assert surrogate.evaluate(said)["mu_macro"].to_pylist() == right.tolist()
    with refused("v0"):
        surrogate.evaluate(said.rename_columns([*list(table.schema.names)[:-1], "v0 [m/s]"]))


def test_a_header_and_a_typed_unit_count_once() -> None:
    surrogate, right = opened(1e-7), opened(1e-7).evaluate(**{**CASE, "v0": 0.01}).mu_macro
    rest = {name: x for name, x in CASE.items() if name != "v0"}
    for typed in (10.0, "10 mm/s", "10"):
        row = pd.Series({**rest, "v0 [mm/s]": typed}, dtype=object)
        assert surrogate.evaluate(row).mu_macro == right
    with refused("v0"):
        surrogate.evaluate(pd.Series({**rest, "v0 [mm/s]": "1 cm/s"}, dtype=object))


# --- columns within cases -------------------------------------------------------------------------


def test_a_gap_spoils_its_case_alone_and_the_case_knows_why() -> None:
    surrogate = opened(1e-7)
    answer = surrogate.evaluate(
        {**CASE, "k": [[1e6], ["soft"], [None]], "std_Fz": [0.1, "x"], "y0": [[2e-6, 3e-6]]}
    )
    assert (answer.source_code < 0).tolist() == [[False, True], [True, True], [True, True]]
    reasons = {i: (e.field, e.value, e.bound) for i in (1, 2, 4) if (e := answer.cases.reason(i))}
    assert reasons == {
        1: ("std_Fz", "x", "a number, not a text"),
        2: ("k", "soft", "a number, not a text"),
        4: ("k", None, "a real number: it is missing; write rigid or a number"),
    }
    part = answer.cases.part(slice(2, 5))
    assert [part.reason(i).value for i in (0, 2)] == ["soft", None]
    assert answer.cases.part(slice(1, 2)).reason(0).value == "x"
    with refused("k[2]"):
        surrogate.evaluate({**CASE, "k": [[1e6], ["soft"]], "y0": [[2e-6, 3e-6]]}, illegal="raise")


def test_a_stiffness_that_is_too_large_in_si_is_a_gap_and_not_rigid() -> None:
    pa, xr = pytest.importorskip("pyarrow"), pytest.importorskip("xarray")
    surrogate, unit = opened(1e-7), {"units": "N/um"}
    k = [1.0, 1e305]
    series = pd.Series(k)
    series.attrs.update(unit)
    fields = [pa.field(name, pa.float64(), metadata=unit if name == "k" else None) for name in CASE]
    columns = {name: [x, x] for name, x in CASE.items()} | {"k": k}
    frame = pd.DataFrame(columns).rename(columns={"k": "k [N/um]"})
    with np.errstate(all="raise"):
        answers = [
            surrogate.evaluate(**{**CASE, "k": series}).mu_macro,
            surrogate.evaluate(**{**CASE, "k": xr.DataArray(k, attrs=unit)}).mu_macro.values,
            surrogate.evaluate(frame)["mu_macro"].to_numpy(),
            surrogate.evaluate(pa.table(columns, schema=pa.schema(fields)))["mu_macro"].to_numpy(),
        ]
    for answer in answers:
        assert np.isnan(answer).tolist() == [False, True]
    column = read_column("k", k, unit="N/um")
    assert column.faults[1] == ("1e+305 N/um", "is too large, above 1.8e308")
    with refused("k"):
        surrogate.evaluate(pd.Series({**CASE, "k [N/um]": 1e305}, dtype=object).drop("k"))


def test_a_column_that_was_read_before_is_taken_as_it_is() -> None:
    column = Column(np.array([0.01, 0.02]), "mm/s")
    assert read_column("v0", column) is column
    answer = opened(1e-7).evaluate({**CASE, "v0": column})
    assert answer.cases.units == {"v0": "mm/s"}

"""One record batch: the bits of the surrogate, every type of column, units, and ambiguous names."""

import decimal
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pa = pytest.importorskip("pyarrow", reason="the extra files is not installed")

from mumacro import InputError, Surrogate  # noqa: E402 (after pyarrow was looked for)
from mumacro.files import ANSWERS, FilesError, answer  # noqa: E402
from mumacro.files.answering import find_columns  # noqa: E402

NAMES = ("mu0", "Fz", "k", "y0", "omega", "v0")
CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}


@pytest.fixture(scope="module")
def table():
    return Surrogate.open()


def batch_of(**columns):
    return pa.RecordBatch.from_pydict({**{name: [value] for name, value in CASE.items()}, **columns})


DOUBLES = st.one_of(
    st.floats(1e-9, 1e9), st.sampled_from([0.0, 1e-300, 5e-324, 1e300, -1.0, math.inf, math.nan, -0.0, 1.0])
)


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(st.lists(st.tuples(*[DOUBLES] * 6), min_size=1, max_size=40))
def test_every_row_has_the_bits_of_the_surrogate_or_is_in_the_rejects(rows):
    surrogate = Surrogate.open()
    batch = pa.RecordBatch.from_pydict(
        dict(zip(NAMES, (list(column) for column in zip(*rows, strict=True)), strict=True))
    )
    found, rejects = answer(batch, surrogate)
    assert found.num_rows == batch.num_rows
    bad = set(rejects.column("row").to_pylist())
    for i, (row, said) in enumerate(zip(rows, found.select(list(ANSWERS)).to_pylist(), strict=True)):
        case = dict(zip(NAMES, row, strict=True))
        case["k"] = None if case["k"] == math.inf else case["k"]
        if i in bad:
            assert set(said.values()) == {None}
            with pytest.raises(InputError) as caught:
                surrogate.evaluate(**case)
            assert caught.value.field == rejects.to_pylist()[sorted(bad).index(i)]["field"]
        else:
            expected = surrogate.evaluate(**case)
            assert said == {name: getattr(expected, name) for name in ANSWERS}


@pytest.mark.parametrize(
    "stiffness",
    [pa.array([1_000_000], pa.int64()), pa.array([1e6], pa.float32()), pa.array(["1e6"]), pa.array([" +1e6 "]),
     pa.array([decimal.Decimal("1000000.0")]), pa.array(["1e6"]).dictionary_encode(),
     pa.array(["1e6"], pa.large_string())],
)  # fmt: skip
def test_numbers_are_read_from_every_type_that_holds_them(table, stiffness):
    found, rejects = answer(batch_of(k=stiffness), table)
    assert rejects.num_rows == 0
    assert found.column("mu_macro")[0].as_py() == table.evaluate(**CASE).mu_macro


@pytest.mark.parametrize(
    "stiffness", [pa.array(["rigid"]), pa.array([" Rigid"]), pa.array([math.inf]), pa.array(["inf"])]
)
def test_the_word_rigid_and_infinity_are_rigid(table, stiffness):
    found, rejects = answer(batch_of(k=stiffness), table)
    assert rejects.num_rows == 0
    assert found.column("source")[0].as_py() == "rigid"
    assert found.column("mu_macro")[0].as_py() == table.evaluate(**{**CASE, "k": None}).mu_macro


@pytest.mark.parametrize(
    "stiffness", [pa.array([""]), pa.array([" "]), pa.array(["NaN"]), pa.array([None], pa.float64()), pa.nulls(1),
                  pa.array([None], pa.string()), pa.array([math.nan]), pa.array([math.nan], pa.float32())]
)  # fmt: skip
def test_a_gap_in_k_is_never_rigid(table, stiffness):
    found, rejects = answer(batch_of(k=stiffness), table)
    assert found.column("mu_macro").null_count == 1
    (reject,) = rejects.to_pylist()
    assert (reject["field"], reject["reason"]) == ("k", "is missing; write rigid or a number")


@pytest.mark.parametrize(
    ("column", "cell", "reason"),
    [("k", "1e400", "is beyond double range"), ("k", "1" + 400 * "0", "is beyond double range"),
     ("k", "stiff", "must be a number, or rigid"),
     ("k", "0", "must be finite and > 0, or rigid"), ("v0", "nan", "is missing"),
     ("k [N/mm]", "1e306", "is beyond double range"), ("f [MHz]", "1e303", "is beyond double range"),
     ("k", "-inf", "must be finite and > 0, or rigid"), ("v0", "", "is missing"), ("v0", "10mm/s", "must be a number: give metres per second, 0.01"),
     ("mu0", "0x1", "must be a number without a unit: give a plain number"), ("Fz", "inf", "must be finite and > 0"),
     ("omega", "-1", "must be finite and >= 0")],
)  # fmt: skip
def test_a_bad_cell_is_named_with_its_value_and_reason(table, column, cell, reason):
    name = column.partition(" ")[0]
    batch = batch_of(**{column: [cell]}).drop_columns([{"f": "omega"}.get(name, name)] if name != column else [])
    found, rejects = answer(batch, table)
    assert rejects.to_pylist() == [{"row": 0, "field": name, "value": cell, "reason": reason}]
    assert found.column("mu_macro").null_count == found.column("source").null_count == 1


def test_units_in_brackets_are_converted_exactly(table):
    columns = {
        "mu0": [0.3],
        "Fz [kN]": [0.01],
        "k [N/mm]": [1000.0],
        "y0 (um)": [2.0],
        "f [kHz]": [20.69],
        "v0 [mm/s]": [10.0],
    }
    found, rejects = answer(pa.RecordBatch.from_pydict(columns), table)
    assert rejects.num_rows == 0
    expected = table.evaluate(**{**CASE, "omega": math.tau * 20690.0})
    assert found.column("mu_macro")[0].as_py() == expected.mu_macro
    assert found.schema.names[: len(columns)] == list(columns)


@pytest.mark.parametrize(
    ("names", "parts"),
    [
        (["mu0", "Fz", "K", "y0", "omega", "v0"], ["no column k", "'K' is similar", "rename that column to k [N/m]"]),
        (["mu0", "Fz", "stiffness", "y0", "omega", "v0"], ["'stiffness' is similar"]),
        (["mu0", "Fz", "K [N/mm]", "y0", "omega", "v0"], ["'K [N/mm]' is similar"]),
        (["mu0", "Fz", "k [psi]", "y0", "omega", "v0"], ["unit that k cannot have", "N/mm"]),
        (["mu0", "Fz", "k", "y0", "omega [Hz]", "v0"], ["a frequency is f [Hz]"]),
        (["mu0", "Fz", "y0", "omega", "v0", "c"], ["no column k [N/m]", "'omega', 'v0', 'c'", "--rigid"]),
        (["mu0", "Fz", "k_N_per_mm", "y0", "f", "v0"], ["'k_N_per_mm' is similar", "rename that column to k [N/m]"]),
        (["mu0", "Fz", "k", "y0", "v0"], ["omega [rad/s] or f [Hz]"]),
        (["mu0", "Fz", "k", "y0", "frequency", "v0"], ["'frequency' is similar", "rename that column to f [Hz]"]),
        (["mu0", "Fz", "k", "y0", "omega", "f", "v0"], ["both f [Hz] and omega"]),
        (["mu0", "Fz", "k", "k [N/mm]", "y0", "omega", "v0"], ["k is there twice"]),
        (["mu0", "mu0", "Fz", "k", "y0", "omega", "v0"], ["mu0 is there twice"]),
        (["mu0", "Fz", "k", "y0", "omega", "v0", "source"], ["'source' would be written twice"]),
    ],
)  # fmt: skip
def test_a_misnamed_column_is_never_ignored(names, parts):
    with pytest.raises(FilesError) as caught:
        find_columns(names)
    for part in parts:
        assert part in str(caught.value)


@pytest.mark.parametrize("name", ["K", "k [N/mm]", "k", "Stiffness", "k_N_per_mm"])
def test_rigid_is_refused_with_a_column_of_stiffness(name):
    with pytest.raises(FilesError):
        find_columns(["mu0", "Fz", name, "y0", "omega", "v0"], rigid=True)


def test_rigid_can_be_given_for_a_batch_without_k(table):
    found, _ = answer(batch_of(speed=["slow"]).drop_columns("k"), table, rigid=True)
    assert found.column("speed").to_pylist() == ["slow"]
    assert found.column("source")[0].as_py() == "rigid"


def test_a_column_that_holds_no_numbers_is_refused_by_name(table):
    with pytest.raises(FilesError, match="the column v0 holds bool, not numbers"):
        answer(batch_of(v0=[True]), table)


def test_a_batch_without_rows_is_answered(table):
    batch = pa.RecordBatch.from_pydict({name: pa.array([], pa.float64()) for name in NAMES})
    found, rejects = answer(batch, table)
    assert found.num_rows == rejects.num_rows == 0
    assert tuple(found.schema.names[6:]) == ANSWERS


def test_the_gradient_comes_with_the_answer(table):
    rng = np.random.default_rng(0)
    columns = {name: value * rng.uniform(0.5, 2.0, 20) for name, value in CASE.items()}
    columns["k"][3], columns["v0"][5] = math.inf, -1.0
    found, _ = answer(pa.RecordBatch.from_pydict(columns), table, include=["gradient"])
    for i in (0, 3):
        case = {name: float(column[i]) for name, column in columns.items()}
        case["k"] = None if case["k"] == math.inf else case["k"]
        slopes = table.evaluate(**case, gradient=True).gradient
        for name in NAMES:
            expected = None if name == "k" and case["k"] is None else slopes[name]  # a rigid contact has no k
            assert found.column(f"d_mu_macro_d_{name}")[i].as_py() == expected
    assert found.column("d_mu_macro_d_mu0")[5].as_py() is None

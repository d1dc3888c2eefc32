"""One record batch: the bits of the surrogate, every type of column, units, and ambiguous names."""

import decimal
import math
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

pa = pytest.importorskip("pyarrow", reason="the extra files is not installed")

from mumacro import InputError, Surrogate  # noqa: E402 (after pyarrow was looked for)
from mumacro.files import ANSWERS, FilesError, answer  # noqa: E402
from mumacro.files.record_batch import find_columns  # noqa: E402
from tests.support.refusals import refused  # noqa: E402
from tests.support.serving import CASE  # noqa: E402

NAMES = (*CASE,)
GAP = "is missing; write rigid or a number"
BEYOND = "is too large, above 1.8e308"


def batch_of(**columns: Any) -> Any:
    return pa.RecordBatch.from_pydict(
        {**{name: [value] for name, value in CASE.items()}, **columns}
    )


ODD = [0.0, 1e-300, 5e-324, 1e300, -1.0, math.inf, math.nan, -0.0, 1.0]
DOUBLES = st.floats(1e-9, 1e9) | st.sampled_from(ODD)


@pytest.mark.slow
@settings(max_examples=30)
@given(st.lists(st.tuples(*[DOUBLES] * 6), min_size=1, max_size=40))
@example([(3.0, 0.5, 161792383.0, 1e300, 1e-300, 0.0)])
def test_every_row_has_the_bits_of_the_surrogate_or_is_in_the_rejects(rows: Any) -> None:
    surrogate = Surrogate.open()
    batch = pa.RecordBatch.from_pylist([dict(zip(NAMES, row, strict=True)) for row in rows])
    answers, rejects = answer(batch, surrogate, include=["gradient"])
    assert answers.num_rows == len(rows)
    slopes = {name: answers.column(f"gradient.{name}").to_pylist() for name in NAMES}
    bad = {reject["row"]: reject["field"] for reject in rejects.to_pylist()}
    for i, (row, row_answer) in enumerate(
        zip(rows, answers.select(list(ANSWERS)).to_pylist(), strict=True)
    ):
        case = dict(zip(NAMES, row, strict=True))
        case["k"] = "rigid" if case["k"] == math.inf else case["k"]
        if i in bad:
            assert {*row_answer.values(), *(slopes[name][i] for name in NAMES)} == {None}
            with refused(bad[i]):
                surrogate.evaluate(**case)
        else:
            expected = surrogate.evaluate(**case, gradient=True)
            assert row_answer == {name: getattr(expected, name) for name in ANSWERS}
            for name, slope in expected.gradient.items():
                # a rigid contact has no k; a slope beyond double range is no number
                none = (name == "k" and case["k"] == "rigid") or math.isnan(slope)
                assert slopes[name][i] == (None if none else slope), name


@pytest.mark.parametrize(
    ("cell", "k"),
    [
        *(
            (cell, 1e6)
            for cell in (
                pa.array([1_000_000], pa.int64()),
                pa.array([1e6], pa.float32()),
                pa.array(["1e6"]),
                pa.array([" +1e6 "]),
                pa.array([decimal.Decimal("1000000.0")]),
                pa.array(["1e6"]).dictionary_encode(),
                pa.array(["1e6"], pa.large_string()),
            )
        ),
        *(
            (cell, "rigid")
            for cell in (
                pa.array(["rigid"]),
                pa.array([" Rigid"]),
                pa.array([math.inf]),
                pa.array(["inf"]),
            )
        ),
        *(
            (cell, GAP)
            for cell in (  # a gap is never rigid
                pa.array([""]),
                pa.array([" "]),
                pa.array(["NaN"]),
                pa.array([None], pa.float64()),
                pa.nulls(1),
                pa.array([None], pa.string()),
                pa.array([math.nan]),
                pa.array([math.nan], pa.float32()),
            )
        ),
    ],
)
def test_numbers_rigid_contacts_and_gaps_are_read_from_every_type(
    surrogate: Surrogate, cell: Any, k: Any
) -> None:
    answers, rejects = answer(batch_of(k=cell), surrogate)
    if k == GAP:
        assert answers.column("mu_macro").null_count == 1
        assert [(reject["field"], reject["reason"]) for reject in rejects.to_pylist()] == [
            ("k", GAP)
        ]
    else:
        assert rejects.num_rows == 0
        assert (
            answers.column("mu_macro")[0].as_py() == surrogate.evaluate(**{**CASE, "k": k}).mu_macro
        )
        assert (answers.column("source")[0].as_py() == "rigid") == (k == "rigid")


@pytest.mark.parametrize(
    ("column", "cell", "reason"),
    [
        ("k", "1e400", BEYOND),
        ("k", "1" + 400 * "0", BEYOND),
        ("k [N/mm]", "1e306", BEYOND),
        ("f [MHz]", "1e303", BEYOND),
        ("f", "1e308", "must be finite and >= 0, and so must be omega = 2 pi f"),
        ("k", "stiff", None),
        ("k", "0", "must be finite and > 0, or rigid"),
        ("k", "-inf", "must be finite and > 0, or rigid"),
        ("v0", "nan", "is missing"),
        ("v0", "", "is missing"),
        ("v0", "10mm", None),
        ("mu0", "0x1", None),
        ("Fz", "inf", "must be finite and > 0"),
        ("omega", "-1", "must be finite and >= 0"),
    ],
)
def test_a_bad_cell_is_named_with_value_and_reason(
    surrogate: Surrogate, column: Any, cell: Any, reason: Any
) -> None:
    name = column.partition(" ")[0]
    batch = batch_of(**{column: [cell]})
    batch = batch.drop_columns(["omega"] if name == "f" else [name] if name != column else [])
    answers, rejects = answer(batch, surrogate)
    (reject,) = rejects.to_pylist()
    assert (reject["row"], reject["field"], reject["value"]) == (0, name, cell)
    assert reject["reason"] == reason or (reason is None and "must be" in reject["reason"])
    assert answers.column("mu_macro").null_count == answers.column("source").null_count == 1


ORDER, END = "must be at most k_high", "must be finite and > 0"
LIFTS = "must be >= 0 and below Fz: at Fz the contact lifts off"


@pytest.mark.parametrize(
    ("absent", "columns", "refused"),
    [
        *(
            ("k", {"k_low [N/um]": low, "k_high [N/um]": high}, refused)
            for low, high, refused in (
                ("0.8", "1.2", None),
                ("1", "1", None),
                ("", "1.2", ("k_low", "is missing")),
                ("0.8", "", ("k_high", "is missing")),
                ("1.2", "0.8", ("k_low", ORDER)),
                ("0", "1", ("k_low", END)),
                ("rigid", "2", ("k_low", END)),
                ("0.8", "inf", ("k_high", END)),
            )
        ),
        *(
            ("y0", {"Fz_amplitude": force}, refused)
            for force, refused in (
                ("0", None),
                ("9.99", None),
                ("10", ("Fz_amplitude", LIFTS)),
                ("-1", ("Fz_amplitude", LIFTS)),
                ("", ("Fz_amplitude", "is missing")),
                ("inf", ("Fz_amplitude", LIFTS)),
            )
        ),
    ],
)
def test_ends_of_k_and_amplitudes_have_their_bounds(
    surrogate: Surrogate, absent: Any, columns: Any, refused: Any
) -> None:
    batch = batch_of(**{name: [cell] for name, cell in columns.items()}).drop_columns(absent)
    answers, rejects = answer(batch, surrogate, direction="normal" if absent == "y0" else "across")
    assert [(reject["field"], reject["reason"]) for reject in rejects.to_pylist()] == (
        [refused] if refused else []
    )
    if not refused and absent == "k":
        low, middle, high = (
            answers.column(f"mu_macro{end}")[0].as_py() for end in ("_low", "", "_high")
        )
        assert low < middle < high or (low == middle == high and "1" in columns.values())


@pytest.mark.parametrize("cell", ["1,5", "1,234.5", "1,000", "1.000", "٣", "三", "1'000"])
def test_text_in_a_column_without_layout_is_read_as_by_keyword(
    surrogate: Surrogate, cell: str
) -> None:
    """No other cell tells what a comma is: 1,000 may be 1 or 1000."""
    answers, rejects = answer(batch_of(v0=[cell]), surrogate)
    try:
        expected = surrogate.evaluate(**{**CASE, "v0": cell}).mu_macro
    except InputError:
        expected = None
    assert answers.column("mu_macro").to_pylist() == [expected]
    assert [one["field"] for one in rejects.to_pylist()] == ["v0"] * (expected is None)


@pytest.mark.parametrize("cell", ["x", "2 um", "1e400", "3"])
def test_an_amplitude_of_another_direction_is_an_empty_cell(
    surrogate: Surrogate, cell: str
) -> None:
    """What cannot be read is no gap."""
    columns = {name: [value] * 2 for name, value in CASE.items()}
    _, rejects = answer(batch_of(**columns, Fz_amplitude=["", ""]), surrogate)
    assert rejects.num_rows == 0
    with pytest.raises(FilesError, match=r"Fz_amplitude.* must be left out for direction across"):
        answer(batch_of(**columns, Fz_amplitude=["", cell]), surrogate)


def test_units_in_brackets_are_converted_exactly(surrogate: Surrogate) -> None:
    columns = {
        "mu0": [0.3],
        "Fz [kN]": [0.01],
        "k [N/mm]": [1000.0],
        "y0 (um)": [2.0],
        "f [kHz]": [20.69],
        "v0 [mm/s]": [10.0],
    }
    answers, rejects = answer(pa.RecordBatch.from_pydict(columns), surrogate)
    assert rejects.num_rows == 0
    assert (
        answers.column("mu_macro")[0].as_py()
        == surrogate.evaluate(**{**CASE, "omega": math.tau * 20690.0}).mu_macro
    )
    assert answers.schema.names[: len(columns)] == list(columns)


SIMILAR = "{!r} is similar: rename that column to {}"


@pytest.mark.parametrize(
    ("names", "options", "parts"),
    [
        ("mu0,Fz,K,y0,omega,v0", {}, ["no column k", SIMILAR.format("K", "k [N/m]")]),
        *(
            (f"mu0,Fz,{name},y0,omega,v0", {}, [SIMILAR.format(name, "k")])
            for name in ("stiffness", "K [N/mm]")
        ),
        ("mu0,Fz,k_N_per_mm,y0,f,v0", {}, [SIMILAR.format("k_N_per_mm", "k [N/mm]")]),
        ("mu0,Fz,k,y0,frequency,v0", {}, [SIMILAR.format("frequency", "f [Hz]")]),
        *(
            (f"mu0,Fz,k,{name},f,v0", {}, [f"y0 [um], with {part} each value"])
            for part, of_part in (
                ("half of", ("y0 pp [um]", "Amplitude [um p-p]", "y0_SS {um}")),
                ("1.41421 times", ("y0_rms [um]", "amplitude RMS (um)", "y0 <um eff>")),
            )
            for name in of_part
        ),
        (
            "mu0,Fz,k [psi],y0,omega [Hz],v0",
            {},
            ["unit that k cannot have", "a force over a length", "; ", "a frequency is f [Hz]"],
        ),
        ("mu0,Fz,y0,omega,v0,c", {}, ["no column k [N/m]", "'omega', 'v0', 'c'", "--rigid"]),
        ("mu0,Fz,k,y0,v0", {}, ["omega [rad/s] or f [Hz]"]),
        (
            "mu,F,stuff,y0,f",
            {},
            [
                "no columns mu0 [-], Fz [N], k [N/m], v0 [m/s]; there are 'mu', 'F', 'stuff', ",
                "; similar: rename 'mu' to mu0 [-], 'F' to Fz [N]; rename the one that holds k",
            ],
        ),
        *(
            (f"mu0,Fz,{more},y0,omega,v0", {}, [message])
            for more, message in (
                ("k,f", "both f [Hz] and omega"),
                ("k,k [N/mm]", "k is there twice"),
                ("k,k_low", "both k and k_low"),
                ("k_low,k_high,std_mu0", "both std_mu0 and an interval of k"),
                ("k,note,note", "'note' is there twice"),
                ("k,source", "'source' would be written twice"),
                ("k_low", "no column k_high [N/m]"),
            )
        ),
        ("mu0,Fz,k_low,k_high [s],y0,omega,v0", {}, ["a unit that k_high cannot have"]),
        (
            "mu0,Fz,k_low,k_high,y0,omega,v0,mu_macro_low",
            {},
            ["'mu_macro_low' would be written twice"],
        ),
        (
            "mu0,Fz,k,Fz_amplitude,omega,v0",
            {},
            ["no column y0, but Fz_amplitude: give --direction normal"],
        ),
        *(
            (f"mu0,Fz,{name},y0,omega,v0", {"rigid": True}, ["--rigid is given, but"])
            for name in ("K", "k [N/mm]", "k", "Stiffness", "k_N_per_mm")
        ),
    ],
)
def test_a_misnamed_column_is_never_ignored(names: Any, options: Any, parts: Any) -> None:
    with pytest.raises(FilesError) as caught:
        find_columns(names.split(","), **options)
    assert all(part in str(caught.value) for part in parts), caught.value


def test_rigid_can_be_given_for_a_batch_without_k(surrogate: Surrogate) -> None:
    answers, _ = answer(batch_of(speed=["slow"]).drop_columns("k"), surrogate, rigid=True)
    assert answers.column("speed").to_pylist() == ["slow"]
    assert answers.column("source")[0].as_py() == "rigid"


def test_a_column_without_numbers_is_named_and_one_without_rows_answered(
    surrogate: Surrogate,
) -> None:
    with pytest.raises(FilesError, match="the column v0 holds bool, not numbers"):
        answer(batch_of(v0=[True]), surrogate)
    answers, rejects = answer(batch_of().slice(0, 0), surrogate)
    assert answers.num_rows == rejects.num_rows == 0
    assert tuple(answers.schema.names[6:]) == ANSWERS


def test_a_double_that_is_too_large_in_si_is_rejected_and_no_rigid_contact(
    surrogate: Surrogate,
) -> None:
    cases = {**CASE, "k": [1e301, 1e305]}
    names = {"k": "k [N/um]"}
    columns = {
        names.get(name, name): value if name == "k" else [value] * 2
        for name, value in cases.items()
    }
    _, rejects = answer(pa.RecordBatch.from_pydict(columns), surrogate)
    assert [(one["row"], one["reason"]) for one in rejects.to_pylist()] == [(1, BEYOND)]


def test_an_output_that_a_case_does_not_have_is_null() -> None:
    case = {"mu0": [0.3] * 3, "Fz": [10.0] * 3, "k": ["rigid", "1e6", "rigid"]}
    case |= {"y0": [2e-6] * 3, "f": [2e4] * 3, "v0": [0.01, 0.01, -1.0]}
    answered, _ = answer(pa.RecordBatch.from_pydict(case), include=["gradient"])
    by_k, by_v0 = (answered.column(f"gradient.{name}").to_pylist() for name in ("k", "v0"))
    assert [x is None for x in by_k] == [True, False, True]
    assert [x is None for x in by_v0] == [False, False, True]

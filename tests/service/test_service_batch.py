"""Batches over HTTP: bad cases among good ones, order, gaps, and what only rows have."""

import json
import math
from collections.abc import Callable
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mumacro import Surrogate
from mumacro.inputs.names import unknown_name
from service import rows as rows_of
from tests.support.cases import Case

BATCH = "/v1/mu-macro/batch"
VALUES = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")
GAP = "is missing; write rigid or a number"


def one(client: Any, case: Case) -> Any:
    return client.post("/v1/mu-macro", json=case).json()


UNKNOWN = ("speed", "", "mu\ud800", "}", "]")
BAD_ROWS: list[tuple[Any, str | None, str]] = [
    ({"mu0": 0}, "mu0", "must be finite and > 0"),
    *((entry, None, "must be an object") for entry in (17, None, "a:b", True, [1])),
    ({"mu0": {"a": 1}}, "mu0", "must be a number"),
    ({"Fz": ...}, "Fz", "is required"),
    *(({name: 1}, name.replace("\ud800", "?"), "unknown field") for name in UNKNOWN),
    ({"v0": True}, "v0", "must be a number"),
    ({"include": []}, "include", "unknown"),
    ({"k": ...}, "k", "rigid"),
]


def test_a_bad_case_affects_only_itself_in_rows(client: Any, case: Case) -> None:
    rows = [{**case, **row} if isinstance(row, dict) else row for row, _, _ in BAD_ROWS]
    rows = [
        {name: x for name, x in row.items() if x is not ...} if isinstance(row, dict) else row
        for row in rows
    ]
    answer = client.post(BATCH, content=json.dumps([case, *rows])).json()
    single = one(client, case)
    assert answer["results"] == [{name: single[name] for name in VALUES}, *[None] * len(rows)]
    for index, (error, (_, field, words)) in enumerate(
        zip(answer["errors"], BAD_ROWS, strict=True), 1
    ):
        assert (error["index"], error["field"]) == (index, field)
        assert words in error["reason"]


def test_the_list_of_errors_is_bounded_and_their_number_is_given(client: Any, case: Case) -> None:
    answer = client.post(
        BATCH, json={**case, "v0": [-1.0] * 9000 + [1.0], "include": ["groups"]}
    ).json()
    assert [error["index"] for error in answer["errors"]] == list(range(1000))
    assert answer["n_errors"] == 9000  # two slices
    assert [value is None for value in answer["mu_macro"]] == [True] * 9000 + [False]
    assert answer["groups"]["l0"][:9000] == answer["regime"][:9000] == [None] * 9000


@pytest.mark.parametrize("f", [-1.0, 2.9e307, 1e308])
def test_a_frequency_of_all_cases_is_refused_as_that_of_one(
    client: Any, problem: Any, case: Case, f: float
) -> None:
    """2 pi f must be a number, too."""
    rest = {name: x for name, x in case.items() if name != "omega"} | {"f": f}
    alone = problem(client.post("/v1/mu-macro", json=rest), 422)
    whole = problem(client.post(BATCH, json={**rest, "v0": [0.01, 0.02]}), 422)
    assert whole["errors"] == alone["errors"]
    assert [fault["pointer"] for fault in whole["errors"]] == ["#/f"]


TEXTS = ["10 cm/s", "0.1", "rigid", "", "0.1 ± 0.01", "0.1..0.2 m/s"]


@pytest.mark.parametrize("text", TEXTS)
@pytest.mark.parametrize("name", ["v0", "k", "k_low", "std_mu0"])
def test_a_text_among_numbers_is_a_gap_and_a_column_of_texts_one_fault(
    client: Any, problem: Any, case: Case, name: str, text: str
) -> None:
    """A person's text is for one case; a program sends numbers."""
    if name == "k" and text == "rigid":
        return
    if name == "k_low":
        case = {name: x for name, x in case.items() if name != "k"} | {"k_high": 2e6}
    numbers = [{**case, name: 0.1}, {**case, name: text}]
    for body in ({**case, name: [0.1, text]}, numbers):
        answer = client.post(BATCH, json=body).json()
        assert [(one["index"], one["field"]) for one in answer["errors"]] == [(1, name)]
        assert answer["errors"][0]["reason"].startswith("must be a number")
    for texts in ([text], [text, "1"]):
        (fault,) = problem(client.post(BATCH, json={**case, name: texts}), 422)["errors"]
        assert (fault["field"], fault["reason"].startswith("must be numbers")) == (name, True)
    (fault,) = problem(client.post(BATCH, json={**case, name: text}), 422)["errors"]
    assert fault["reason"].startswith("must be a number")


@pytest.mark.parametrize("gap", [None, "", "  ", float("nan")], ids=repr)
def test_a_gap_in_k_is_never_a_rigid_contact(client: Any, case: Case, gap: Any) -> None:
    """Null, an empty text, NaN: the case is refused, and the others are answered."""
    rows = [{**case, "k": value} for value in (case["k"], gap, "rigid")]
    k, long = [row["k"] for row in rows], [case["k"]] * 1000
    for body in ({**case, "k": k}, rows, {**case, "k": [*k, *long]}):
        (fault,) = client.post(BATCH, content=json.dumps(body)).json()["errors"]
        assert (fault["index"], fault["field"], "rigid" in fault["reason"]) == (1, "k", True)
        assert gap is not None or fault["reason"] == GAP


GOOD = '{"mu0": 0.3, "Fz": 10, "k": 1e6, "y0": 2e-6, "f": 2e4, "v0": 0.01}'


@pytest.mark.parametrize("before", [0, 1, 9000])
@pytest.mark.parametrize(
    ("odd", "field"),
    [
        ('{"v0": 0.01, "f": 2e4, "y0": 2e-6, "k": 1e6, "Fz": 10, "mu0": 0.3}', ...),
        (GOOD.replace("10", "10, "), 400),
        (GOOD + "}", 400),
        (GOOD.replace("{", "{{"), 400),
        (GOOD.replace("1e6", "1e999"), "k"),
        (GOOD.replace("1e6", "true"), "k"),
        (GOOD.replace("0.01", "false"), "v0"),
        (GOOD.replace("1e6", "NaN"), "k"),
        (GOOD.replace("1e6", "null"), "k"),
        (GOOD.replace("1e6", '"1 N/um"'), "k"),
        (GOOD.replace("0.01", '"0.01"'), "v0"),
        (GOOD.replace("1e6", '"rigid:"'), "k"),
        (GOOD.replace("1e6", '"Rigid"'), ...),
        (GOOD.replace("1e6", "[]"), "k"),
        (GOOD.replace("1e6", "{}"), "k"),
        (GOOD.replace("v0", "v1"), "v1"),
        (GOOD.replace("v0", "v\\u0030"), ...),
        (GOOD.replace('"v0": 0.01', '"k": 2e6'), "v0"),
        (GOOD.replace('"k": 1e6', '"k": 2, "k": 1e6'), ...),
        (GOOD.replace("}", ', "k": null}'), "k"),
        ('["mu0", "Fz", "k", "y0", "f", "v0"]', None),
        ('"mu0"', None),
    ],
)
def test_an_odd_row_is_seen_in_every_place(client: Any, odd: str, field: Any, before: int) -> None:
    """Many plain rows are read together: none of them may hide another one.  ``field`` is the one
    at fault, the status of a refusal, or ``...`` where the row is right."""
    body = "[" + ",".join([GOOD] * before + [odd, GOOD]) + "]"
    response = client.post(BATCH, content=body)
    if isinstance(field, int):
        assert response.status_code == field
        return
    answer = response.json()
    (expected,) = client.post(BATCH, content=f"[{GOOD}]").json()["results"]
    assert answer["results"][before + 1] == expected
    assert [row == expected for row in answer["results"][:before]] == [True] * before
    faults = [(fault["index"], fault["field"]) for fault in answer["errors"]]
    assert faults == ([] if field is ... else [(before, field)])
    if field is ... and "igid" not in odd:
        assert answer["results"][before] == expected


def test_rows_may_stand_far_apart(client: Any) -> None:
    answer = client.post(BATCH, content=f"[{GOOD},{' ' * 2_000_000}{GOOD}]").json()
    assert answer["n_errors"] == 0
    assert answer["results"][0] == answer["results"][1]


def test_explicit_nulls_are_read_like_absent_names(client: Any, case: Case) -> None:
    rows = [{**case, "f": None}, {**case, "k": "rigid"}, {**case, "omega": None, "f": 1e4}]
    answer = client.post(BATCH, json=rows).json()
    assert answer["n_errors"] == 0
    assert [row["mu_macro"] for row in answer["results"]] == [
        one(client, row)["mu_macro"] for row in rows
    ]
    hertz = [
        {**{name: x for name, x in case.items() if name != "omega"}, "f": f} for f in (1e4, 2e4)
    ]
    answer = client.post(BATCH, json=hertz).json()
    assert [row["mu_macro"] for row in answer["results"]] == [
        one(client, row)["mu_macro"] for row in hertz
    ]


def test_a_large_batch_keeps_its_order(client: Any, case: Case, surrogate: Surrogate) -> None:
    v0 = np.geomspace(1e-9, 1e9, 100_000)
    response = client.post(
        BATCH, json={**case, "v0": v0.tolist()}, params={"tolerance": surrogate.tolerance}
    )
    assert response.headers["x-table"] == response.json()["table"]["id"] == surrogate.id
    answer, expected = response.json(), surrogate.evaluate(**{**case, "v0": v0})
    for name in VALUES:
        assert answer[name] == getattr(expected, name).tolist()
    rows = client.post(BATCH, json=[{**case, "v0": value} for value in v0[::10].tolist()]).json()
    assert [result["mu_macro"] for result in rows["results"]] == answer["mu_macro"][::10]


def test_an_empty_batch_has_an_empty_answer_and_scalars_are_one_case(
    client: Any, case: Case
) -> None:
    rows = client.post(BATCH, json=[]).json()
    assert (rows["results"], rows["errors"], rows["n_errors"]) == ([], [], 0)
    columns = client.post(BATCH, json={**case, "v0": [], "k": [], "include": ["limits"]}).json()
    assert all(columns[name] == [] for name in VALUES)
    assert columns["limits"] == {"mu_static": [], "v0_crit": [], "mu_crit": []}
    assert len(client.post(BATCH, json=case).json()["mu_macro"]) == 1


def test_of_a_name_that_is_given_twice_the_last_counts(client: Any, case: Case) -> None:
    """In columns and rows, by either of the two readers; one case refuses it."""
    expected = one(client, {**case, "v0": 1.0})["mu_macro"]
    for first in ("0.5", "NaN", '"x"', "[3]"):
        row = f'{json.dumps({**case, "v0": "@"})[:-1]}, "\\u00760": 1.0}}'.replace('"@"', first)
        columns = client.post(BATCH, content=row).json()
        rows = client.post(BATCH, content=f"[{json.dumps(case)}, {row}]").json()
        assert columns["mu_macro"] == [expected]
        assert [columns["errors"], rows["errors"]] == [[], []]
        assert rows["results"][1]["mu_macro"] == expected


@pytest.mark.parametrize("word", [["ball"], [["ball"]], {"ball": 1}, "\ud800", 1], ids=ascii)
def test_a_list_is_no_word(client: Any, case: Case, word: Any) -> None:
    """Also where it holds one word, and is the only case."""
    for body in ([{**case, "contact": word}], {**case, "contact": [word]}):
        answer = client.post(BATCH, content=json.dumps(body)).json()
        assert [fault["field"] for fault in answer["errors"]] == ["contact"]


def of_one(client: Any, row: Case, **query: Any) -> Any:
    """What a case alone is answered: its values, or the faults of its problem document."""
    response = client.post("/v1/mu-macro", json={**row, **query})
    answer = response.json()
    if response.status_code != 200:
        return {(one["field"], one["reason"]) for one in answer["errors"]}
    return {name: answer[name] for name in (*VALUES, "mu_macro_low", "std") if name in answer}


SPRING: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "y0": 2e-6, "f": 2e4, "v0": 0.01}
LIFTED: dict[str, Any] = {**SPRING, "direction": "normal", "y0": None, "Fz_amplitude": 3.0}
STIFFNESSES = st.sampled_from(
    [
        {"k": "rigid"},
        {"k_low": 8e5, "k_high": 1.2e6},
        {"k_low": 2e6, "k_high": 1e6},
        {"k": None},
        {"k": 1e6},
    ]
)
OTHERS = st.sampled_from(
    [
        {"k": 1e6, **more}
        for more in (
            {},
            {"mu0": None},
            {"v0": -1.0},
            {"f": 10**400},
            {"Fz_amplitude": 3.0},
            {"omega": 1e5},
            {"y0": True},
            {"contact": "cube"},
            {"contact": "ball", "direction": "normal"},
        )
    ]
)
CASES: st.SearchStrategy[list[Any]] = st.sampled_from(
    [SPRING, LIFTED, {**SPRING, "contact": "ball"}]
).flatmap(
    lambda case: st.lists(
        (STIFFNESSES | OTHERS).map(lambda more: case | more), min_size=1, max_size=5
    )
)


def test_the_advice_for_an_unknown_name_is_looked_for_in_rows_that_are_listed(client: Any) -> None:
    """To find it takes longer than to find that a row is no case."""
    rows = [{**SPRING, f"name{i}": 1} for i in range(1500)]
    with patch.object(rows_of, "unknown_name", wraps=unknown_name) as looked:
        answer = client.post(BATCH, json=rows).json()
    assert (answer["n_errors"], len(answer["errors"])) == (1500, 1000)
    assert looked.call_count == 1000


BESIDE_AN_INTERVAL = ("k", "must be finite beside rows with an interval of k")


@settings(max_examples=60)
@given(rows=CASES)
@example(rows=[{**SPRING, "k": 1e6, "contact": name} for name in ("ball", "cube")])
@example(rows=[{**LIFTED, "k": 1e6, "y0": True}])
def test_rows_are_answered_or_told_their_fault_like_each_of_them_alone(
    client: Any, rows: Any
) -> None:
    answer = client.post(BATCH, json=rows).json()
    faults = {fault["index"]: (fault["field"], fault["reason"]) for fault in answer["errors"]}
    for i, (row, result) in enumerate(zip(rows, answer["results"], strict=True)):
        alone = of_one(client, row)
        if result is None and faults[i] == BESIDE_AN_INTERVAL:
            assert row["k"] == "rigid"
        elif isinstance(alone, set):
            assert result is None
            assert faults[i] in alone
        else:  # a number is an interval of itself beside others
            assert alone == {name: result[name] for name in alone}
            assert result.get("mu_macro_low", result["mu_macro"]) <= result["mu_macro"]


def test_a_number_is_an_interval_of_itself_beside_one_and_a_rigid_contact_is_not(
    client: Any,
) -> None:
    rows: list[Case] = [{"k_low": 8e5, "k_high": 1.2e6}, {"k": 1e6}, {"k": "rigid"}]
    answer = client.post(BATCH, json=[{**SPRING, **row} for row in rows]).json()
    band, number, rigid = answer["results"]
    assert band["mu_macro_low"] < band["mu_macro"] < band["mu_macro_high"]
    alone = of_one(client, {**SPRING, "k": 1e6})["mu_macro"]
    assert {number[name] for name in ("mu_macro", "mu_macro_low", "mu_macro_high")} == {alone}
    assert rigid is None
    assert [(one["index"], one["field"], one["reason"]) for one in answer["errors"]] == [
        (2, *BESIDE_AN_INTERVAL)
    ]


@pytest.mark.parametrize("number", [1e400, -1, math.nan, "x", "2 um", 3])
def test_an_amplitude_of_another_direction_is_left_out_or_null(client: Any, number: Any) -> None:
    """What cannot be read is no gap."""
    amplitudes = [None, number]
    columns = {**SPRING, "k": 1e6, "v0": [0.01, 0.01], "Fz_amplitude": amplitudes}
    rows = [{**SPRING, "k": 1e6, "Fz_amplitude": one} for one in amplitudes]
    (fault,) = client.post(BATCH, content=json.dumps(rows)).json()["errors"]
    assert (fault["index"], fault["field"]) == (1, "Fz_amplitude")
    answer = client.post(BATCH, content=json.dumps(columns))
    assert answer.status_code == 422
    assert [fault["field"] for fault in answer.json()["errors"]] == ["Fz_amplitude"]


def test_a_column_of_amplitudes_of_another_direction_is_refused(
    client: Any, problem: Callable[[Any, int], Any]
) -> None:
    columns = {**SPRING, "k": 1e6, "v0": [0.01, 0.01], "Fz_amplitude": [3.0, 3.0]}
    (fault,) = problem(client.post(BATCH, json=columns), 422)["errors"]
    assert (fault["field"], fault["value"]) == ("Fz_amplitude", "a list")


@pytest.mark.parametrize("name", ["contact", "direction"])
def test_a_request_has_one_contact_and_one_direction(client: Any, problem: Any, name: str) -> None:
    words = {"contact": ["ball", "spring"], "direction": ["along", "across"]}[name]
    case = {**SPRING, "k": 1e6}
    expected = of_one(client, {**case, name: words[0]})["mu_macro"]
    answer = client.post(BATCH, json={**case, name: words[:1] * 2, "v0": [0.01, 0.01]}).json()
    assert answer["mu_macro"] == [expected] * 2
    columns = {**case, name: words, "v0": [0.01, 0.02]}
    for body in (columns, [{**case, name: word} for word in words]):
        (fault,) = problem(client.post(BATCH, json=body), 422)["errors"]
        assert fault["field"] == name
        assert "split" in fault["reason"]


def test_a_query_holds_for_rows_in_whichever_way_they_are_read(client: Any) -> None:
    """A null, or a row of other members, makes a list of rows be read one by one."""
    normal = {**LIFTED, "k": 1e6}
    del normal["direction"], normal["y0"]
    for rows in ([normal, normal], [normal, {**normal, "y0": None}]):
        answer = client.post(BATCH, params={"direction": "normal"}, json=rows).json()
        alone = of_one(client, normal, direction="normal")
        assert [row["mu_macro"] for row in answer["results"]] == [alone["mu_macro"]] * 2
    plain = {**SPRING, "k": 1e6}
    of_mu0, of_k = {**plain, "std_mu0": 0.01}, {**plain, "std_k": 2e5}
    answer = client.post(BATCH, params={"std_k": 1e5}, json=[plain, of_mu0, of_k]).json()
    both = of_one(client, {**plain, "std_mu0": 0.01, "std_k": 1e5})
    alone = of_one(client, {**plain, "std_k": 1e5})
    assert [row and row["std"] for row in answer["results"]] == [alone["std"], both["std"], None]
    (fault,) = answer["errors"]
    assert (fault["field"], "given in the query" in fault["reason"]) == ("std_k", True)


@pytest.mark.parametrize("name", ["mu0", "Fz", "k", "v0"])
def test_a_null_has_the_same_reason_everywhere(client: Any, problem: Any, name: str) -> None:
    case = {**SPRING, "k": 1e6, name: None}
    words = of_one(client, case)
    assert [field for field, _ in words] == [name]
    (alone,) = problem(client.post(BATCH, json=case), 422)["errors"]
    faults = [alone]
    for body in ([case], {**case, name: [None, 0.1]}):
        faults += client.post(BATCH, json=body).json()["errors"]
    assert {(fault["field"], fault["reason"]) for fault in faults} == words

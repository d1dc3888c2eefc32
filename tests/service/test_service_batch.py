"""Batches over HTTP: bad cases among good ones, order, gaps, and what only rows have."""

import json
from typing import Any

import numpy as np
import pytest

from mumacro import Surrogate
from tests.support.cases import Case

BATCH = "/v1/mu-macro/batch"
VALUES = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")
GAP = "is missing; write rigid or a number"


def one(client: Any, case: Case) -> Any:
    return client.post("/v1/mu-macro", json=case).json()


BAD_ROWS = [
    ({"mu0": 0}, "mu0", "must be finite and > 0"),
    (17, None, "must be an object"),
    (None, None, "must be an object"),
    ({"Fz": ...}, "Fz", "is required"),
    ({"speed": 1}, "speed", "unknown"),
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
    answer = client.post(BATCH, json=[case, *rows]).json()
    single = one(client, case)
    assert answer["results"] == [{name: single[name] for name in VALUES}, *[None] * len(rows)]
    for index, (error, (_, field, words)) in enumerate(
        zip(answer["errors"], BAD_ROWS, strict=True), 1
    ):
        assert (error["index"], error["field"]) == (index, field)
        assert words in error["reason"]


def test_the_list_of_errors_is_bounded_and_their_number_is_given(client: Any, case: Case) -> None:
    answer = client.post(
        BATCH, json={**case, "v0": [-1.0] * 5000 + [1.0], "include": ["groups"]}
    ).json()
    assert [error["index"] for error in answer["errors"]] == list(range(1000))
    assert answer["n_errors"] == 5000
    assert [value is None for value in answer["mu_macro"]] == [True] * 5000 + [False]
    assert answer["groups"]["l0"][:5000] == answer["regime"][:5000] == [None] * 5000
    answer = client.post(BATCH, json={**case, "v0": [0.1, "10 cm/s", "0.1 N"]}).json()
    assert answer["mu_macro"][0] == answer["mu_macro"][1]
    assert [error["index"] for error in answer["errors"]] == [2]


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
        (GOOD.replace("1e6", '"1 N/um"'), ...),
        (GOOD.replace("1e6", '"1 um"'), "k"),
        (GOOD.replace("1e6", '"rigid:"'), "k"),
        (GOOD.replace("1e6", '"Rigid"'), ...),
        (GOOD.replace("1e6", "[]"), "k"),
        (GOOD.replace("1e6", "{}"), "k"),
        (GOOD.replace("v0", "v1"), "v1"),
        (GOOD.replace("v0", "v\\u0030"), ...),
        (GOOD.replace('"v0": 0.01', '"k": 2e6'), 422),
        (GOOD.replace('"k": 1e6', '"k": 1e6, "k": 1e6'), 422),
        (GOOD.replace("}", ', "k": null}'), 422),
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


@pytest.mark.parametrize("text", ["[", " [", "[\n", "[ ", "[,", "[{", "[[", "[]]", "[ ] ["])
def test_half_a_list_is_no_json(client: Any, problem: Any, text: str) -> None:
    assert problem(client.post(BATCH, content=text), 400)["type"].endswith("malformed-body")


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


@pytest.mark.parametrize("entry", [3, "a:b", None, True, [1], {}, {"mu0": {"a": 1}}], ids=repr)
def test_an_entry_that_is_no_case_is_bad_alone(client: Any, case: Case, entry: Any) -> None:
    reply = client.post("/v1/mu-macro/batch", json=[case, entry, case])
    assert reply.status_code == 200
    answer = reply.json()
    assert [row is None for row in answer["results"]] == [False, True, False]
    assert [error["index"] for error in answer["errors"]] == [1]


def test_a_name_that_is_given_twice_in_a_row_is_refused(client: Any, case: Case) -> None:
    row = json.dumps(case)
    text = f'[{row}, {row[:-1]}, "v0": 1.0}}]'
    reply = client.post(
        "/v1/mu-macro/batch", content=text, headers={"Content-Type": "application/json"}
    )
    assert reply.status_code == 422

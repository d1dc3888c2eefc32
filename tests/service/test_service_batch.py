"""Batches and streams over HTTP: bad cases among good ones, order, options, and what only one form
has."""

import json
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from benchmarks.support.forms import (
    BATCH,
    answered_rows,
    as_csv,
    as_ndjson,
    posted,
    read,
    stream_of,
)
from mumacro import Surrogate
from tests.support.cases import Case

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
    answer = client.post(BATCH, json={**case, "v0": [0.1, "0.1"]}).json()
    assert answer["errors"][0]["reason"] == "must be a number, not a text: leave out the quotes"


@pytest.mark.parametrize("gap", [None, "", "  ", float("nan")])
def test_a_gap_in_k_is_never_a_rigid_contact(client: Any, case: Case, gap: Any) -> None:
    """Null, an empty cell, NaN: in every form the case is refused, and the others are answered."""
    rows = [{**case, "k": value} for value in (case["k"], gap, "rigid")]
    k, long = [row["k"] for row in rows], [case["k"]] * 1000
    for body in ({**case, "k": k}, rows, {**case, "k": [*k, *long]}):
        (fault,) = client.post(BATCH, content=json.dumps(body)).json()["errors"]
        assert (fault["index"], fault["field"], "rigid" in fault["reason"]) == (1, "k", True)
        assert gap is not None or fault["reason"] == GAP
    first, second, third = answered_rows(client, "ndjson", rows)
    assert (first["source"], second["status"], third["source"]) == ("stick_slip_low", 422, "rigid")
    assert second["errors"][0]["field"] == "k"
    assert [row["error"] and row["error"][:2] for row in answered_rows(client, "csv", rows)] == [
        None,
        "k:",
        None,
    ]


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
        (GOOD.replace("1e6", '"1e6"'), "k"),
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
    half, good = read("ndjson", posted(client, "ndjson", text.strip() + "\n" + GOOD + "\n"))
    assert (half["status"], good["source"]) == (400, "stick_slip_low")


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
    response = posted(client, "ndjson", b"\n\n")
    assert (response.status_code, response.content) == (200, b"")


def test_a_line_is_answered_like_a_batch_or_a_case(client: Any, case: Case) -> None:
    columns: Case = {**case, "v0": [0.1, -1, 0.2]}
    rows: Any = [case, 17]
    first, second, third = read(
        "ndjson", posted(client, "ndjson", as_ndjson([columns, rows, case]))
    )
    assert first == client.post(BATCH, json=columns).json()
    assert second == client.post(BATCH, json=rows).json()
    assert third == one(client, case)
    more: Case = {**case, "include": ["model"]}
    assert read("ndjson", posted(client, "ndjson", as_ndjson([more]))) == [one(client, more)]


def test_options_of_a_stream_come_with_its_query_or_its_lines(
    client: Any, case: Case, problem: Any
) -> None:
    body = as_ndjson([case, {**case, "include": ["limits"]}])
    plain, extended = read("ndjson", posted(client, "ndjson", body))
    assert ("limits" in plain, "limits" in extended) == (False, True)
    first, second = read("ndjson", posted(client, "ndjson", body, include="groups"))
    assert "groups" in first
    assert second["status"] == 422  # given twice
    for bad in ({"tolerance": 1e-30}, {"nonsense": 1}):  # the stream as a whole
        problem(posted(client, "ndjson", body, **bad), 422)


@pytest.mark.parametrize(
    ("odd", "status"),
    [
        ('{"mu0":1', 400),
        ('"Fz":10}', 400),
        ('{"a":{}}', 422),
        ("{},{}", 400),
        ('{"v0":2}', 422),
        ("[]", None),
        ("{} {}", 400),
        ('{"include":["groups"]}', 422),
        ("", ...),
        ("17", 422),
        ('{"mu0": 1}', 422),
    ],
)
def test_an_odd_line_among_plain_ones_affects_only_itself(
    client: Any, case: Case, odd: Any, status: Any
) -> None:
    good = json.dumps(case)
    answers = read("ndjson", posted(client, "ndjson", "\n".join([good, "", odd, good])))
    (expected,) = answered_rows(client, "ndjson", [case])
    assert answers[0] == answers[-1] == expected
    assert [answer.get("status") for answer in answers[1:-1]] == ([] if status is ... else [status])
    if status not in (..., None):
        assert answers[1]["instance"] == f"{BATCH}#line=3"
        assert answers[1]["type"].endswith("malformed-body") == (status == 400)


def test_a_stream_may_be_longer_than_a_body_but_its_lines_may_not(started: Any, case: Case) -> None:
    with started(max_body_bytes=1024) as client:
        line = json.dumps(case) + "\n"
        assert len(read("ndjson", posted(client, "ndjson", iter([line.encode()] * 100)))) == 100
        refused = posted(client, "ndjson", line * 100)  # a client with a length may read late
        assert "without a Content-Length" in refused.json()["detail"]
        pieces = iter([line.encode(), *[b" " * 600] * 3])
        cut = posted(client, "ndjson", pieces)  # the response had begun: it is cut off
        assert len(cut.text.splitlines()) <= 1


def test_a_line_of_csv_with_too_many_cells_affects_only_itself(client: Any, case: Case) -> None:
    rows = read(
        "csv",
        posted(
            client, "csv", as_csv([case] * 2).replace("\r\n", ",7\r\n").replace("v0,7", "v0", 1)
        ),
    )
    assert [row["error"] for row in rows] == ["case: has 7 cells where the head has 6"] * 2
    good = read("csv", posted(client, "csv", "\ufeff" + as_csv([case])))
    assert good[0]["mu_macro"] == one(client, case)["mu_macro"]


def test_a_wrong_line_of_csv_keeps_its_place_beside_blank_lines(client: Any, case: Case) -> None:
    head, good = as_csv([case]).splitlines()
    text = "\r\n".join([head, good, "", "1,2", good, "", "", "3", good])
    rows = read("csv", posted(client, "csv", text))
    assert [row["error"] and row["error"][:16] for row in rows] == [
        None,
        "case: has 2 cell",
        None,
        "case: has 1 cell",
        None,
    ]
    # a wrong byte in a wrong line is a fault of the body, and nothing is printed
    assert posted(client, "csv", text.encode() + b"\xb1").status_code == 400


def test_a_number_of_csv_beyond_double_range_is_no_rigid_contact(client: Any, case: Case) -> None:
    rows = [{**case, "k": k} for k in ("1e999", "inf", "rigid", 1e6)]
    answers = read("csv", posted(client, "csv", as_csv(rows)))
    assert [row["error"] and row["error"][:2] for row in answers] == ["k:", "k:", None, None]


def test_arrow_keeps_order_over_batches_and_names_its_table(
    started: Any, case: Case, surrogate: Surrogate
) -> None:
    v0 = np.geomspace(1e-6, 1e3, 150_000)
    columns = {**{name: np.full(v0.size, value) for name, value in case.items()}, "v0": v0}
    whole = pa.record_batch(columns)
    pieces = pa.Table.from_batches([whole.slice(0, 10), whole.slice(10, 1), whole.slice(11)])
    with started(max_batch=200_000) as large:
        answer = pa.ipc.open_stream(posted(large, "arrow", stream_of(pieces)).content).read_all()
    assert (
        answer["mu_macro"].to_pylist() == surrogate.evaluate(**{**case, "v0": v0}).mu_macro.tolist()
    )
    assert answer["error"].null_count == v0.size
    assert json.loads(answer.schema.metadata[b"table"])["id"] == surrogate.id
    assert answer.schema.metadata[b"api_version"] == b"1"


def test_a_bad_arrow_case_affects_only_itself(client: Any, case: Case) -> None:
    columns = {name: pa.array([value] * 6) for name, value in case.items()}
    columns["v0"] = pa.array([0.1, -1.0, None, float("nan"), 0.1, 0.1])
    columns["k"] = pa.array([1e6, 1e6, 1e6, 1e6, float("inf"), None])
    rows = read("arrow", posted(client, "arrow", stream_of(pa.record_batch(columns))))
    bound, gap = "v0: must be finite and >= 0", f"k: {GAP}"
    assert [row["error"] for row in rows] == [None, bound, "v0: is required", bound, None, gap]
    assert [row["mu_macro"] is None for row in rows] == [row["error"] is not None for row in rows]
    assert rows[4]["mu_macro"] == one(client, {**case, "k": "rigid", "v0": 0.1})["mu_macro"]


@pytest.mark.parametrize("text", [pa.string(), pa.large_string()], ids=str)
def test_the_word_rigid_in_an_arrow_column_is_a_rigid_contact(
    client: Any, case: Case, text: Any
) -> None:
    words = ["rigid", None, "1e6", "Rigid"]
    columns = {name: pa.array([value] * len(words)) for name, value in case.items()}
    batch = pa.record_batch({**columns, "k": pa.array(words, text)})
    rows = read("arrow", posted(client, "arrow", stream_of(batch)))
    rigid = answered_rows(client, "ndjson", [{**case, "k": "rigid"}])[0]["mu_macro"]
    assert [row["mu_macro"] for row in rows] == [rigid, None, None, rigid]
    assert [row["error"] for row in rows] == [
        None,
        "k: is missing; write rigid or a number",
        "k: must be a number, not a text: leave out the quotes",
        None,
    ]


def test_arrow_texts_that_overlap_are_refused(client: Any, case: Case, problem: Any) -> None:
    """Such offsets would make many long texts of a short one."""
    n = 1000
    offsets = np.tile(np.array([0, 100_000], np.int32), n // 2 + 1)[: n + 1]
    offsets[0], offsets[-1] = 0, 100_000
    overlapping = pa.Array.from_buffers(
        pa.string(), n, [None, pa.py_buffer(offsets), pa.py_buffer(b"x" * 100_000)]
    )
    columns = {name: pa.array([value] * n) for name, value in case.items()}
    batch = pa.record_batch({**columns, "k": overlapping})
    problem(posted(client, "arrow", stream_of(batch)), 400)


def test_arrow_numbers_of_other_types_are_numbers(client: Any, case: Case) -> None:
    record_batch = pa.record_batch(
        {name: pa.array([value], type=pa.float32()) for name, value in case.items()}
    )
    record_batch = record_batch.set_column(1, "Fz", pa.array([10], type=pa.int16()))
    (row,) = read("arrow", posted(client, "arrow", stream_of(record_batch)))
    assert (
        row["mu_macro"]
        == one(client, {name: float(np.float32(x)) for name, x in case.items()})["mu_macro"]
    )
    answer = pa.ipc.open_stream(
        posted(client, "arrow", stream_of(record_batch.slice(1))).content
    ).read_all()
    assert (answer.num_rows, answer.schema.names[:5]) == (0, list(VALUES))


@pytest.mark.slow
def test_a_damaged_arrow_stream_is_answered_or_refused(client: Any, case: Case) -> None:
    columns = {**{name: [value] * 3 for name, value in case.items()}, "k": [1e6, None, 1e5]}
    whole = stream_of(pa.record_batch(columns))
    lies = (b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\x80", b"\0\0\0\0", b"\0\0\0\1")
    bodies = [
        whole[:i] + bytes([whole[i] ^ 1 << i % 8]) + whole[i + 1 :] for i in range(0, len(whole), 3)
    ]
    bodies += [
        whole[:i] + lie + whole[i + 4 :] for i in range(0, len(whole) - 4, 16) for lie in lies
    ]
    bodies += [whole[:i] for i in range(0, len(whole), 40)]
    # a record batch becomes a dictionary
    bodies += [whole[:i] + b"\2" + whole[i + 1 :] for i in range(len(whole))]
    statuses = {posted(client, "arrow", body).status_code for body in bodies}
    assert {200, 400} <= statuses <= {200, 400, 413, 422}

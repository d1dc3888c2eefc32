"""Batches over HTTP: columns and rows, broadcasting, bad cases among good ones, size limits."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from starlette.testclient import TestClient

from comparing import close
from service.app import create_app
from service.settings import Settings

PATH = "/v1/mu-macro/batch"
VALUES = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")
END = {"errors", "n_errors", "table", "api_version"}
FIELDS = ("mu0", "Fz", "k", "y0", "omega", "v0")

positive = st.floats(min_value=1e-30, max_value=1e30)
rows_of_cases = st.lists(
    st.fixed_dictionaries(
        {
            "mu0": positive,
            "Fz": positive,
            "y0": st.just(0.0) | positive,
            "k": positive | st.just("rigid"),
            "omega": positive,
            "v0": st.just(0.0) | positive,
        }
    ),
    max_size=12,
)


def columns_of(rows):
    return {name: [row.get(name) for row in rows] for name in FIELDS}


@settings(max_examples=100, deadline=None)
@given(rows=rows_of_cases)
def test_rows_and_columns_answer_like_the_surrogate(client, surrogate, rows):
    by_rows = client.post(PATH, json=rows).json()
    by_columns = client.post(PATH, json=columns_of(rows)).json()
    assert by_rows["n_errors"] == by_columns["n_errors"] == 0
    for name in VALUES:
        assert [result[name] for result in by_rows["results"]] == by_columns[name]
    for row, result in zip(rows, by_rows["results"], strict=True):
        expected = surrogate.evaluate(**row)
        assert result["mu_macro"] == close(expected.mu_macro, rel=1e-12)
        assert (result["regime"], result["source"]) == (expected.regime, expected.source)


def test_a_column_is_evaluated_at_once_and_scalars_hold_for_every_case(client, case, surrogate):
    v0 = np.geomspace(1e-6, 1e3, 1000)
    answer = client.post(PATH, json={**case, "v0": v0.tolist()}).json()
    assert answer.keys() == {*VALUES, *END}
    expected = surrogate.evaluate(**{**case, "v0": v0})
    for name in VALUES:
        assert answer[name] == getattr(expected, name).tolist()
    assert (answer["errors"], answer["n_errors"]) == ([], 0)
    assert answer["table"] == {"id": surrogate.id, "tolerance": surrogate.tolerance}


def test_a_batch_agrees_with_its_cases_one_by_one(client, case):
    rows = [{**case, "v0": v0, "k": k} for v0 in (0, 1e-3, 0.1, 10) for k in (1e5, 1e7, "rigid")]
    results = client.post(PATH, params={"include": "groups,limits"}, json=rows).json()["results"]
    for row, result in zip(rows, results, strict=True):
        single = client.post("/v1/mu-macro", json={**row, "include": ["groups", "limits"]}).json()
        for name in ("mu_macro", "mu_ratio", "error_bound"):
            assert result[name] == close(single[name], rel=1e-13)
        assert (result["groups"], result["regime"]) == (single["groups"], single["regime"])
        assert result["limits"] == close(single["limits"], rel=1e-13)


def test_a_bad_case_affects_only_itself_in_columns(client, case):
    body = {**case, "v0": [0.1, -1, 0.2, 0.3, None], "Fz": [10, 10, "10", 20, 10], "k": [1e6, 1e6, 1e6, "rigid", 1e6]}
    answer = client.post(PATH, json={**body, "include": ["groups", "limits"]}).json()
    for name in VALUES:
        assert [value is None for value in answer[name]] == [False, True, True, False, True]
    for name in ("groups", "limits"):
        for column in answer[name].values():
            assert [column[index] for index in (1, 2, 4)] == [None] * 3
    assert [(error["index"], error["field"]) for error in answer["errors"]] == [(1, "v0"), (2, "Fz"), (4, "v0")]
    assert answer["n_errors"] == 3
    assert all(error.keys() == {"index", "field", "reason"} for error in answer["errors"])
    rigid = client.post("/v1/mu-macro", json={**case, "Fz": 20, "v0": 0.3, "k": None}).json()
    assert answer["mu_macro"][3] == close(rigid["mu_macro"], rel=1e-13)


def test_a_bad_case_affects_only_itself_in_rows(client, case):
    rows = [
        case,
        {**case, "mu0": 0},
        17,
        {"mu0": 0.3},
        {**case, "speed": 1},
        {**case, "v0": True},
        None,
        {**case, "include": []},
        {name: value for name, value in case.items() if name != "k"},
    ]
    answer = client.post(PATH, json=rows).json()
    assert answer.keys() == {"results", *END}
    assert [result is None for result in answer["results"]] == [False, *[True] * 8]
    found = [(error["index"], error["field"]) for error in answer["errors"]]
    fields = [(1, "mu0"), (2, None), (3, "Fz"), (4, "speed"), (5, "v0"), (6, None), (7, "include"), (8, "k")]
    assert found == fields
    single = client.post("/v1/mu-macro", json=case).json()
    assert answer["results"][0]["mu_macro"] == close(single["mu_macro"], rel=1e-13)


@pytest.mark.parametrize("text", ["NaN", "Infinity", "-Infinity", "1e999", "-1e999", "1" + "0" * 400])
def test_numbers_beyond_double_range_are_bad_cases_and_bad_scalars(client, case, problem, text):
    body = json.dumps({**case, "v0": [0.1, "@", 0.2]}).replace('"@"', text)
    answer = client.post(PATH, content=body)
    assert answer.status_code == 200, answer.text
    assert [value is None for value in answer.json()["mu_macro"]] == [False, True, False]
    assert [(error["index"], error["field"]) for error in answer.json()["errors"]] == [(1, "v0")]
    answer = client.post(PATH, content=json.dumps([case, {**case, "k": "@"}]).replace('"@"', text)).json()
    assert (answer["results"][1], answer["n_errors"]) == (None, 1)
    body = json.dumps({**case, "v0": "@", "mu0": [0.3, 0.4]}).replace('"@"', text)
    (fault,) = problem(client.post(PATH, content=body), 422)["errors"]
    assert (fault["pointer"], fault["bound"]) == ("#/v0", "finite and >= 0")


def test_a_batch_of_bad_cases_only_is_answered(client, case):
    answer = client.post(PATH, json={**case, "v0": [-1, -2], "include": ["groups"]}).json()
    assert answer["mu_macro"] == [None, None]
    assert answer["groups"] == {"v_tilde": [None, None], "y_tilde": [None, None], "l0": [None, None]}
    assert answer["n_errors"] == 2


def test_the_list_of_errors_is_bounded_and_their_number_is_given(client, case):
    answer = client.post(PATH, json={**case, "v0": [-1.0] * 5000 + [1.0]}).json()
    assert [error["index"] for error in answer["errors"]] == list(range(1000))
    assert answer["n_errors"] == 5000
    assert [value is None for value in answer["mu_macro"]] == [True] * 5000 + [False]


def test_lists_of_different_lengths_are_refused(client, case, problem):
    faults = problem(client.post(PATH, json={**case, "v0": [0.1, 0.2, 0.3], "y0": [1e-6, 2e-6]}), 422)["errors"]
    assert "y0: 2, v0: 3" in faults[0]["reason"]
    problem(client.post(PATH, json={**case, "v0": [0.1, 0.2], "y0": [1e-6]}), 422)
    problem(client.post(PATH, json={**case, "v0": [0.1, 0.2], "y0": []}), 422)


def test_columns_that_no_case_can_do_without_or_with_are_refused(client, case, problem):
    del case["Fz"]
    faults = problem(client.post(PATH, json={**case, "speed": [1], "mu0": "0.3", "y0": {}}), 422)["errors"]
    assert {fault["field"] for fault in faults} == {"Fz", "speed", "mu0", "y0"}


@pytest.mark.parametrize("body", ["3", "null", '"text"', "true"])
def test_json_that_is_neither_columns_nor_rows_is_refused(client, problem, body):
    (fault,) = problem(client.post(PATH, content=body), 422)["errors"]
    assert fault["pointer"] == "#"


@pytest.mark.parametrize("body", [b"", b"[", b"{", b"[1,]", b"\xff" * 100_000])
def test_a_body_that_is_not_json_is_malformed(client, problem, body):
    problem(client.post(PATH, content=body), 400)


def test_other_media_types_are_refused(client, problem):
    problem(client.post(PATH, content="mu0,Fz", headers={"Content-Type": "text/html"}), 415)


def test_an_empty_batch_has_an_empty_answer(client, case):
    rows = client.post(PATH, json=[]).json()
    assert (rows["results"], rows["errors"], rows["n_errors"]) == ([], [], 0)
    columns = client.post(PATH, json={**case, "v0": [], "k": [], "include": ["limits"]}).json()
    assert all(columns[name] == [] for name in VALUES)
    assert columns["limits"] == {"mu_static": [], "v0_crit": [], "mu_crit": []}


def test_columns_of_scalars_only_are_one_case(client, case):
    assert len(client.post(PATH, json=case).json()["mu_macro"]) == 1


def test_options_come_with_the_query_or_with_the_columns_but_not_twice(client, case, problem, surrogate):
    body = {**case, "v0": [0.1, 0.2]}
    by_query = client.post(PATH, params={"include": "groups", "tolerance": 0.1}, json=body).json()
    by_body = client.post(PATH, json={**body, "include": ["groups"], "tolerance": 0.1}).json()
    assert by_query == by_body
    assert "groups" in by_query
    assert "limits" not in by_query
    problem(client.post(PATH, params={"include": "limits"}, json={**body, "include": ["groups"]}), 422)
    problem(client.post(PATH, params={"include": "std"}, json=[case]), 422)
    problem(client.post(PATH, params={"mu0": 1}, json=[case]), 422)
    problem(client.post(PATH, json={**body, "include": ["std"]}), 422)
    (fault,) = problem(client.post(PATH, params={"tolerance": 1e-30}, json=[case]), 422)["errors"]
    assert fault["parameter"] == "tolerance"
    document = problem(client.post(PATH, json={**body, "tolerance": 1e-30}), 422)
    assert document["errors"][0]["pointer"] == "#/tolerance"
    assert document["tightest_available"] == surrogate.tolerance


def test_a_large_batch_keeps_its_order(client, case, surrogate):
    v0 = np.geomspace(1e-9, 1e9, 100_000)
    answer = client.post(PATH, json={**case, "v0": v0.tolist()}).json()
    assert answer["mu_macro"] == surrogate.evaluate(**{**case, "v0": v0}).mu_macro.tolist()
    rows = client.post(PATH, json=[{**case, "v0": value} for value in v0[::10].tolist()]).json()
    assert [result["mu_macro"] for result in rows["results"]] == close(answer["mu_macro"][::10], rel=1e-13)


def test_a_batch_over_the_limit_is_refused(tables_dir, case, problem):
    with TestClient(create_app(Settings(tables=(tables_dir,), max_batch=3))) as client:
        assert client.post(PATH, json={**case, "v0": [0.1] * 3}).status_code == 200
        for body in ({**case, "v0": [0.1] * 4}, [case] * 4, [None] * 400):
            assert problem(client.post(PATH, json=body), 413)["max_batch"] == 3


@pytest.mark.parametrize("end", ["\n", "\r", "\r\n"])
def test_lines_of_csv_are_counted_however_they_end(tables_dir, case, problem, end):
    head, row = ",".join(case), ",".join(map(str, case.values()))
    with TestClient(create_app(Settings(tables=(tables_dir,), max_batch=10))) as client:
        for many, status in ((10, 200), (11, 413)):
            text = end.join([head, *[row] * many])
            answer = client.post(PATH, content=text, headers={"Content-Type": "text/csv"})
            assert answer.status_code == status
    assert problem(answer, 413)["max_batch"] == 10


def test_one_batch_too_many_is_refused_before_it_is_read(tables_dir, case, problem):
    app = create_app(Settings(tables=(tables_dir,), max_batches=2))
    with TestClient(app) as client:
        app.state.work.batches.used = 2

        def pieces():
            yield json.dumps({**case, "v0": [0.1] * 20_000}).encode()

        response = client.post(PATH, content=b" " * 70_000)
        problem(response, 503)
        assert response.headers["retry-after"] == "1"
        problem(client.post(PATH, content=pieces()), 503)
        assert client.post(PATH, json=[case]).status_code == 200  # a small one is not counted
        app.state.work.batches.used = 0
        assert client.post(PATH, json={**case, "v0": [0.1] * 20_000}).status_code == 200
        assert app.state.work.batches.used == 0


def test_a_small_text_that_asks_for_much_takes_a_place(tables_dir, case, problem):
    app = create_app(Settings(tables=(tables_dir,), max_batches=1))
    body = {**case, "v0": [1] * 25_000, "include": ["limits", "gradient", "stick_fraction", "power", "groups"]}
    with TestClient(app) as client:
        assert len(json.dumps(body, separators=(",", ":"))) < 64 * 1024
        app.state.work.batches.used = 1
        problem(client.post(PATH, content=json.dumps(body, separators=(",", ":"))), 503)


@pytest.mark.parametrize("n", [1, 7, 300, 4096, 4097])
def test_plain_columns_get_the_same_bytes_on_the_fast_path(client, case, n):
    columns = {**case, "v0": np.geomspace(1e-6, 1e2, n).tolist(), "k": [1e6] * n}
    text = json.dumps(columns)
    escaped = text.replace('"mu0"', '"\\u006du0"')  # an escaped name is read by the general parser
    headers = {"Content-Type": "application/json", "Accept-Encoding": "identity"}
    short, long = (client.post(PATH, content=body, headers=headers) for body in (text, escaped))
    assert short.content == long.content
    assert len(short.json()["mu_macro"]) == n
    spoilt = {**columns, "v0": [*columns["v0"][:-1], -1.0]}
    answer = client.post(PATH, json=spoilt).json()
    assert (answer["n_errors"], answer["errors"][0]["index"]) == (1, n - 1)
    assert answer["mu_macro"][:-1] == short.json()["mu_macro"][:-1]


def test_a_frequency_whose_omega_is_beyond_double_range_is_refused_by_its_own_name_in_every_form(client, case):
    del case["omega"]
    case["f"] = 1.7e308
    ordinary = {**case, "f": 1.0}
    single = client.post("/v1/mu-macro", json=case)
    assert single.status_code == 422
    assert single.json()["errors"][0]["field"] == "f"
    assert client.get("/v1/mu-macro", params=case).json()["errors"][0]["field"] == "f"
    for body in ([case, ordinary], {**case, "f": [1.7e308, 1.0]}):
        answer = client.post("/v1/mu-macro/batch", json=body).json()
        assert [(error["index"], error["field"]) for error in answer["errors"]] == [(0, "f")]
    scalars = client.post("/v1/mu-macro/batch", json={**case, "v0": [0.01, 0.1]})
    assert scalars.status_code == 422
    assert scalars.json()["errors"][0]["field"] == "f"
    line = client.post("/v1/mu-macro/batch", content=json.dumps(case), headers={"content-type": "application/x-ndjson"})
    assert json.loads(line.text)["errors"][0]["field"] == "f"
    table = ",".join(case) + "\n" + ",".join(map(repr, case.values())) + "\n"
    cells = client.post("/v1/mu-macro/batch", content=table, headers={"content-type": "text/csv"})
    assert "f: must be finite" in cells.text
    held = {name: value for name, value in case.items() if name != "v0"}
    for path, asked in (
        ("law", {"along": "v0", "start": 0.1, "stop": 1.0}),
        ("solve-for", {"unknown": "v0", "target": 0.1}),
    ):
        assert client.post(f"/v1/{path}", json={**held, **asked}).json()["errors"][0]["field"] == "f"


TWICE = (
    '{"mu0":0.3,"Fz":10,"k":1e6,"y0":2e-6,"omega":1e5,"v0":%s,"mu0":0.2}',
    '{"mu0":0.3,"Fz":10,"k":null,"y0":2e-6,"f":1e4,"v0":%s,"\\u006du0":0.2}',
    '{"mu0":0.3,"mu0":0.3,"Fz":10,"k":"rigid","y0":2e-6,"omega":1e5,"f":null,"v0":%s}',
    '{"mu0":-1,"mu0":0.3,"Fz":10,"k":1e6,"y0":2e-6,"omega":1e5,"v0":%s}',
)


@pytest.mark.parametrize("text", TWICE)
def test_a_name_given_twice_is_refused(client, problem, text):
    bodies = {"/v1/mu-macro": text % "0.1", PATH: text % "[0.1, 0.2]", "rows": f"[{text % '0.1'},{text % '1'}]"}
    for path, body in bodies.items():
        path = PATH if path == "rows" else path
        answer = client.post(path, content=body, headers={"Content-Type": "application/json"})
        found = problem(answer, 422)
        assert [(fault["field"], fault["reason"]) for fault in found["errors"]] == [("mu0", "is given more than once")]
    lines = client.post(PATH, content="\n".join(bodies.values()), headers={"Content-Type": "application/x-ndjson"})
    assert [json.loads(line)["status"] for line in lines.text.splitlines()] == [422] * 3


def test_options_with_a_name_given_twice_are_refused(client, problem, case):
    body = json.dumps({**case, "include": ["std"]})[:-1] + ',"std":{"mu0":0.1,"mu0":0.2}}'
    for path in ("/v1/mu-macro", PATH):
        answer = client.post(path, content=body, headers={"Content-Type": "application/json"})
        assert "more than once" in problem(answer, 422)["errors"][0]["reason"]


def test_explicit_nulls_are_read_like_absent_names(client, case):
    rows = [{**case, "f": None}, {**case, "k": "rigid"}, {**case, "omega": None, "f": 1e4}]
    answer = client.post(PATH, json=rows).json()
    assert answer["n_errors"] == 0
    assert [row["mu_macro"] for row in answer["results"]] == [
        client.post("/v1/mu-macro", json=row).json()["mu_macro"] for row in rows
    ]


@pytest.mark.parametrize("gap", [None, "", "  ", float("nan")])
def test_a_gap_in_k_is_never_a_rigid_contact(client, case, problem, gap):
    """Null, an empty cell, NaN: in every form the case is refused, and the others are answered."""
    k = [case["k"], gap, "rigid"]
    rows = [{**case, "k": value} for value in k]
    long = [case["k"]] * 1000
    answers = [
        client.post(PATH, content=json.dumps({**case, "k": k})).json(),
        client.post(PATH, content=json.dumps(rows)).json(),
        client.post(PATH, content=json.dumps({**case, "k": [long[0], gap, "rigid", *long]})).json(),
    ]
    lines = client.post(
        PATH, content="\n".join(map(json.dumps, rows)), headers={"Content-Type": "application/x-ndjson"}
    )
    first, second, third = map(json.loads, lines.text.splitlines())
    assert (first["source"], second["status"], third["source"]) == ("stick_slip_low", 422, "rigid")
    assert second["errors"][0]["field"] == "k"
    for answer in answers:
        (fault,) = answer["errors"]
        assert (fault["index"], fault["field"], "rigid" in fault["reason"]) == (1, "k", True)
    if gap is None:
        assert fault["reason"] == "is missing; write rigid or a number"
        problem(client.post(PATH, json={**case, "v0": [0.1, 0.2], "k": None}), 422)
    text = "\n".join([",".join(case), *(",".join(map(str, {**case, "k": value or ""}.values())) for value in k)])
    rejected = client.post(PATH, content=text, headers={"Content-Type": "text/csv"}).text.splitlines()
    assert [line.rpartition(",")[2][:2] for line in rejected[1:]] == ["", "k:", ""]


def test_a_head_of_csv_may_have_any_unit_of_its_column(client, case):
    text = (
        f"mu0 [%],Fz (kN),k [N/um],y0 [um],f [kHz],v0 [mm/s]\r\n30,0.01,1,2,{case['omega'] / (2e3 * math.pi)!r},10\r\n"
    )
    answer = client.post(PATH, content=text, headers={"Content-Type": "text/csv"}).text.splitlines()[1]
    expected = client.post("/v1/mu-macro", json=case).json()["mu_macro"]
    assert float(answer.split(",")[0]) == close(expected, rel=1e-13)
    wrong = client.post(PATH, content="k [N/s]\r\n1\r\n", headers={"Content-Type": "text/csv"})
    assert "unit that k cannot have" in wrong.text

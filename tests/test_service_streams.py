"""Lines in and out, Arrow in and out, compression: over HTTP, in this process."""

import json

import numpy as np
import pyarrow as pa
import pytest
from starlette.testclient import TestClient

from mumacro.inputs import FIELDS
from service.app import create_app
from service.settings import Settings
from service.wire import forms

PATH = "/v1/mu-macro/batch"
LINES = {"Content-Type": "application/x-ndjson"}
ARROW = "application/vnd.apache.arrow.stream"
VALUES = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")


def lines_of(response):
    assert response.status_code == 200, response.text
    assert response.headers["content-type"] == "application/x-ndjson"
    assert response.text.endswith("\n")
    return [json.loads(line) for line in response.text.splitlines()]


def test_a_line_is_answered_like_a_batch_or_a_case(client, case):
    columns, rows = {**case, "v0": [0.1, -1, 0.2]}, [case, 17]
    body = "\n".join(map(json.dumps, (columns, rows, case))) + "\n"
    first, second, third = lines_of(client.post(PATH, content=body, headers=LINES))
    assert first == client.post(PATH, json=columns).json()
    assert second == client.post(PATH, json=rows).json()
    assert third == client.post("/v1/mu-macro", json=case).json()


def test_a_bad_line_affects_only_itself(client, case, surrogate):
    good = json.dumps(case)
    body = "\n".join([good, "{", "", '{"mu0": 1}', json.dumps({**case, "v0": -1}), "17", good])
    answers = lines_of(client.post(PATH, content=body, headers=LINES))
    assert [answer.get("status") for answer in answers] == [None, 400, 422, 422, 422, None]
    assert answers[0] == answers[5]
    assert answers[1]["instance"] == f"{PATH}#line=2"
    assert answers[2]["instance"] == f"{PATH}#line=4"
    assert answers[1]["type"].endswith("malformed-body")
    listed = json.dumps({**case, "v0": [-1]})
    (answer,) = lines_of(client.post(PATH, content=listed, headers=LINES))
    assert (answer["errors"][0]["field"], answer["table"]["id"]) == ("v0", surrogate.id)


def test_lines_keep_their_order_however_they_arrive(client, case):
    text = "".join(json.dumps({**case, "v0": [0.001 * i, 0.002 * i]}) + "\r\n" for i in range(1, 200)).encode()
    whole = lines_of(client.post(PATH, content=text, headers=LINES))
    for size in (1, 7, 1000, 100_000):
        pieces = (text[start : start + size] for start in range(0, len(text), size))
        assert lines_of(client.post(PATH, content=pieces, headers=LINES)) == whole
    assert len(whole) == 199


def test_options_of_a_stream_come_with_its_query_or_its_lines(client, case):
    body = json.dumps(case) + "\n" + json.dumps({**case, "include": ["limits"]}) + "\n"
    plain, extended = lines_of(client.post(PATH, content=body, headers=LINES))
    assert ("limits" in plain, "limits" in extended) == (False, True)
    first, second = lines_of(client.post(PATH, params={"include": "groups"}, content=body, headers=LINES))
    assert "groups" in first
    assert second["status"] == 422  # given twice


def test_a_stream_with_bad_options_is_refused_as_a_whole(client, case, problem):
    body = json.dumps(case)
    problem(client.post(PATH, params={"tolerance": 1e-30}, content=body, headers=LINES), 422)
    problem(client.post(PATH, params={"nonsense": 1}, content=body, headers=LINES), 422)


def test_an_empty_stream_has_an_empty_answer(client):
    response = client.post(PATH, content=b"\n\n", headers=LINES)
    assert (response.status_code, response.content) == (200, b"")


def test_a_stream_may_be_longer_than_a_body_but_its_lines_may_not(tables_dir, case):
    with TestClient(create_app(Settings(tables=(tables_dir,), max_body_bytes=1024, max_batch=3))) as client:
        line = json.dumps(case) + "\n"
        assert len(lines_of(client.post(PATH, content=iter([line.encode()] * 100), headers=LINES))) == 100
        refused = client.post(PATH, content=line * 100, headers=LINES)  # a client with a length may read late
        assert "without a Content-Length" in refused.json()["detail"]
        over = json.dumps({**case, "v0": [0.1] * 4})
        (answer,) = lines_of(client.post(PATH, content=over, headers=LINES))
        assert (answer["status"], answer["max_batch"]) == (413, 3)
        pieces = iter([line.encode(), *[b" " * 600] * 3])
        cut = client.post(PATH, content=pieces, headers=LINES)  # the response had begun: it is cut off
        assert len(cut.text.splitlines()) <= 1


# --- Arrow --------------------------------------------------------------------------------------------


def stream_of(*batches):
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, batches[0].schema) as writer:
        for batch in batches:
            writer.write_batch(batch)
    return sink.getvalue().to_pybytes()


def ask_arrow(client, body, **options):
    response = client.post(PATH, content=body, headers={"Content-Type": ARROW}, params=options)
    assert response.status_code == 200, response.text
    assert response.headers["content-type"] == ARROW
    return pa.ipc.open_stream(response.content).read_all()


def columns_of(case, n):
    v0 = np.geomspace(1e-6, 1e3, n)
    return {**{name: np.full(n, value) for name, value in case.items()}, "v0": v0}


def test_arrow_columns_are_answered_like_json_columns(client, case, surrogate):
    columns = columns_of(case, 1000)
    table = ask_arrow(client, stream_of(pa.record_batch(columns)), include="groups,limits,gradient")
    body = {name: values.tolist() for name, values in columns.items()}
    expected = client.post(PATH, json={**body, "include": ["groups", "limits", "gradient"]}).json()
    for name in VALUES:
        assert table[name].to_pylist() == expected[name]
    for group in ("groups", "limits", "gradient"):
        for key, values in expected[group].items():
            assert table[f"{group}.{key}"].to_pylist() == values
    assert table["error"].null_count == 1000
    assert json.loads(table.schema.metadata[b"table"])["id"] == surrogate.id
    assert table.schema.metadata[b"api_version"] == b"1"


def test_arrow_keeps_order_over_record_batches_and_slices(client, case):
    columns = columns_of(case, 150_000)
    whole = pa.record_batch(columns)
    settings = Settings(tables=client.app.state.settings.tables, max_batch=200_000)
    with TestClient(create_app(settings)) as large:
        answered = ask_arrow(large, stream_of(whole.slice(0, 10), whole.slice(10, 1), whole.slice(11)))
        assert answered["mu_macro"].to_numpy().tolist() == sorted(answered["mu_macro"].to_numpy().tolist())
        first = client.post(PATH, json={**case, "v0": columns["v0"][:20].tolist()}).json()
    assert answered["mu_macro"].to_pylist()[:20] == first["mu_macro"]
    assert answered.num_rows == 150_000


def test_a_bad_arrow_case_affects_only_itself(client, case):
    n = 6
    columns = {name: pa.array([value] * n) for name, value in case.items()}
    columns["v0"] = pa.array([0.1, -1.0, None, float("nan"), 0.1, 0.1])
    columns["k"] = pa.array([1e6, 1e6, 1e6, 1e6, float("inf"), None])
    table = ask_arrow(client, stream_of(pa.record_batch(columns)))
    assert [value is None for value in table["mu_macro"].to_pylist()] == [False, True, True, True, False, True]
    assert table["error"].to_pylist() == [
        None,
        "v0: must be finite and >= 0",
        "v0: is required",
        "v0: must be finite and >= 0",
        None,
        "k: is missing; write rigid or a number",
    ]
    rigid = client.post("/v1/mu-macro", json={**case, "k": None, "v0": 0.1}).json()
    assert table["mu_macro"][4].as_py() == rigid["mu_macro"]


def test_arrow_numbers_of_other_types_are_numbers(client, case):
    columns = {name: pa.array([value], type=pa.float32()) for name, value in case.items()}
    columns["Fz"] = pa.array([10], type=pa.int16())
    table = ask_arrow(client, stream_of(pa.record_batch(columns)))
    body = {name: float(np.float32(value)) for name, value in case.items()}
    assert table["mu_macro"][0].as_py() == client.post("/v1/mu-macro", json={**body, "Fz": 10}).json()["mu_macro"]


def test_an_empty_arrow_stream_has_an_empty_answer(client):
    schema = pa.schema([(name, pa.float64()) for name in FIELDS])
    sink = pa.BufferOutputStream()
    pa.ipc.new_stream(sink, schema).close()
    table = ask_arrow(client, sink.getvalue().to_pybytes())
    assert (table.num_rows, table.schema.names[:5]) == (0, list(VALUES))


@pytest.mark.parametrize(
    ("change", "field"),
    [({"v0": None}, "v0"), ({"speed": [1.0]}, "speed"), ({"v0": ["0.1"]}, "v0"), ({"mu0": [True]}, "mu0")],
)
def test_arrow_columns_that_do_not_fit_are_refused(client, case, problem, change, field):
    columns = {**{name: [value] for name, value in case.items()}, **change}
    body = stream_of(
        pa.record_batch({name: pa.array(values) for name, values in columns.items() if values is not None})
    )
    response = client.post(PATH, content=body, headers={"Content-Type": ARROW})
    assert problem(response, 422)["errors"][0]["field"] == field


def test_a_body_that_is_not_an_arrow_stream_is_malformed(client, case, problem):
    good = stream_of(pa.record_batch({name: [value] for name, value in case.items()}))
    for body in (b"nonsense", b"\xff" * 100, good[:100], good[: len(good) // 2]):
        problem(client.post(PATH, content=body, headers={"Content-Type": ARROW}), 400)


def test_an_arrow_name_that_is_no_text_is_refused(client, case, problem):
    body = stream_of(pa.record_batch({**{name: [value] for name, value in case.items()}, "friction": [1.0]}))
    body = body.replace(b"friction", b"fric\xff\xfe\x00n")
    problem(client.post(PATH, content=body, headers={"Content-Type": ARROW}), 400)


@pytest.mark.slow
def test_a_damaged_arrow_stream_is_answered_or_refused(client, case):
    whole = stream_of(pa.record_batch({**{name: [value] * 3 for name, value in case.items()}, "k": [1e6, None, 1e5]}))
    lies = (b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\x80", b"\0\0\0\0", b"\0\0\0\1")
    bodies = [whole[:i] + bytes([whole[i] ^ 1 << i % 8]) + whole[i + 1 :] for i in range(0, len(whole), 3)]
    bodies += [whole[:i] + lie + whole[i + 4 :] for i in range(0, len(whole) - 4, 16) for lie in lies]
    bodies += [whole[:i] for i in range(0, len(whole), 40)]
    statuses = {client.post(PATH, content=body, headers={"Content-Type": ARROW}).status_code for body in bodies}
    assert {200, 400} <= statuses <= {200, 400, 413, 422}


def test_an_arrow_batch_over_the_limit_is_refused(tables_dir, case, problem):
    with TestClient(create_app(Settings(tables=(tables_dir,), max_batch=3))) as client:
        body = stream_of(pa.record_batch({name: [value] * 4 for name, value in case.items()}))
        assert problem(client.post(PATH, content=body, headers={"Content-Type": ARROW}), 413)["max_batch"] == 3


@pytest.mark.parametrize("codec", ["lz4", "zstd"])
def test_a_compressed_arrow_stream_is_refused_unread(client, case, problem, codec):
    """It states its unpacked size, so a small body could fill the memory."""
    batch, sink = pa.record_batch({name: [value] * 10_000 for name, value in case.items()}), pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, batch.schema, options=pa.ipc.IpcWriteOptions(compression=codec)) as writer:
        writer.write_batch(batch)
    response = client.post(PATH, content=sink.getvalue().to_pybytes(), headers={"Content-Type": ARROW})
    assert "compressed" in problem(response, 400)["detail"]


def test_arrow_is_refused_where_it_is_not_installed(tables_dir, case, problem, monkeypatch):
    left = {name: form for name, form in forms().items() if name != ARROW}
    monkeypatch.setattr("service.routes.batch.forms", lambda: left)
    with TestClient(create_app(Settings(tables=(tables_dir,)))) as client:
        body = stream_of(pa.record_batch({name: [value] for name, value in case.items()}))
        response = client.post(PATH, content=body, headers={"Content-Type": ARROW})
        assert ARROW not in problem(response, 415)["detail"].split("not ")[0]
        assert client.post(PATH, json=[case]).status_code == 200


# --- lines --------------------------------------------------------------------------------------------


def test_answers_are_the_same_bytes_whatever_coding_is_accepted(client, case):
    body = json.dumps({**case, "v0": [0.001 * i for i in range(20_000)]})
    answers = [client.post(PATH, content=body, headers={"Accept-Encoding": offer}) for offer in ("gzip", "identity")]
    assert "content-encoding" not in answers[0].headers
    assert answers[0].content == answers[1].content


def test_lines_of_one_case_have_the_same_answer_alone_and_together(client, case):
    rows = [{**case, "v0": 1e-3 * i} for i in range(1, 100)]
    lines = [json.dumps(row) for row in rows]
    together = lines_of(client.post(PATH, content="\n".join(lines), headers=LINES))
    alone = [lines_of(client.post(PATH, content=line, headers=LINES))[0] for line in lines]
    assert together == alone == [client.post("/v1/mu-macro", json=row).json() for row in rows]
    query = {"include": "groups,power"}
    extended = lines_of(client.post(PATH, params=query, content="\n".join(lines), headers=LINES))
    assert [answer["mu_macro"] for answer in extended] == [answer["mu_macro"] for answer in alone]
    assert all(answer.keys() >= {"groups", "power", "table", "api_version"} for answer in extended)


@pytest.mark.parametrize(
    "odd", ['{"mu0":1', '"Fz":10}', '{"a":{}}', "{},{}", '{"v0":2}', "[]", "{} {}", '{"include":["groups"]}', ""]
)
def test_an_odd_line_among_plain_ones_affects_only_itself(client, case, odd):
    good = json.dumps(case)
    (expected,) = lines_of(client.post(PATH, content=good, headers=LINES))
    answers = lines_of(client.post(PATH, content="\n".join([good, odd, good, good]), headers=LINES))
    kept = [answer for answer in answers if "status" not in answer and "results" not in answer]
    assert kept == [expected] * 3
    assert len(answers) == (4 if odd else 3)


def test_bad_lines_among_many_plain_ones_are_reported_by_their_number(client, case):
    n, bad = 3000, range(3, 3000, 7)
    lines = [{**case, "v0": 1e-4 * (i + 1)} for i in range(n)]
    for index in bad:
        lines[index] = {**case, "v0": -1.0} if index % 2 else {**case, "speed": 1.0}
    lines[1000] = {**case, "v0": [0.1, 0.2]}  # columns in a line that looks like the others
    answers = lines_of(client.post(PATH, content="\n".join(map(json.dumps, lines)), headers=LINES))
    v0 = [1e-4 * (i + 1) for i in range(n)]
    expected = client.post(PATH, json={**case, "v0": v0}).json()["mu_macro"]
    assert len(answers) == n
    for index, answer in enumerate(answers):
        if index == 1000:
            assert len(answer["mu_macro"]) == 2
        elif index in bad:
            assert (answer["status"], answer["instance"]) == (422, f"{PATH}#line={index + 1}")
            assert answer["errors"][0]["field"] == ("v0" if index % 2 else "speed")
        else:
            assert answer["mu_macro"] == expected[index]

"""A case has the same bits from every endpoint, in every format, and from the library."""

import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

pytestmark = pytest.mark.slow

SINGLE, BATCH = "/v1/mu-macro", "/v1/mu-macro/batch"
JSON = {"Content-Type": "application/json"}
NAMES = ("mu0", "Fz", "k", "y0", "omega", "v0")
MANY, FEW = 20_000, 300
ARROW, LINES = {"Content-Type": "application/vnd.apache.arrow.stream"}, {"Content-Type": "application/x-ndjson"}


@pytest.fixture(scope="module")
def columns():
    """Random cases over and beyond the table's range."""
    rng = np.random.default_rng(17)
    low, high = [-2, -1, 3, -9, 1, -7], [1, 4, 9, -2, 7, 3]
    return dict(zip(NAMES, 10.0 ** rng.uniform(low, high, (MANY, 6)).T, strict=True))


@pytest.fixture(scope="module")
def expected(surrogate, columns):
    """The library's answer for all cases at once."""
    return surrogate.evaluate(columns).mu_macro


def rows_of(columns, n=MANY):
    return [
        dict(zip(NAMES, row, strict=True)) for row in zip(*(columns[name][:n].tolist() for name in NAMES), strict=True)
    ]


def asked(response):
    assert response.status_code == 200, response.text[:500]
    return response


def as_library_alone(client, surrogate, columns):
    del client
    return [surrogate.evaluate(**row).mu_macro for row in rows_of(columns, FEW)]


def as_body(client, surrogate, columns):
    del surrogate
    return [asked(client.post(SINGLE, json=row)).json()["mu_macro"] for row in rows_of(columns, FEW)]


def as_query(client, surrogate, columns):
    del surrogate
    return [asked(client.get(SINGLE, params=row)).json()["mu_macro"] for row in rows_of(columns, FEW)]


def as_text(client, surrogate, columns):
    del surrogate
    return [float(asked(client.get(f"{SINGLE}.txt", params=row)).text) for row in rows_of(columns, FEW)]


def as_columns(client, surrogate, columns):
    del surrogate
    body = {name: column.tolist() for name, column in columns.items()}
    return asked(client.post(BATCH, json=body)).json()["mu_macro"]


def as_columns_with_more(client, surrogate, columns):
    del surrogate
    body = {name: column.tolist() for name, column in columns.items()}
    return asked(client.post(BATCH, json={**body, "include": ["groups"]})).json()["mu_macro"]


def as_small_columns(client, surrogate, columns):
    del surrogate
    found = []
    for i in range(0, FEW, 10):
        body = {name: column[i : i + 10].tolist() for name, column in columns.items()}
        found += asked(client.post(BATCH, json=body)).json()["mu_macro"]
    return found


def as_rows(client, surrogate, columns):
    del surrogate
    return [one["mu_macro"] for one in asked(client.post(BATCH, json=rows_of(columns))).json()["results"]]


def as_lines(client, surrogate, columns):
    del surrogate
    text = "".join(json.dumps(row) + "\n" for row in rows_of(columns))
    return [
        json.loads(line)["mu_macro"] for line in asked(client.post(BATCH, content=text, headers=LINES)).iter_lines()
    ]


def as_pieces_of_lines(client, surrogate, columns):
    del surrogate
    text = "".join(json.dumps(row) + "\n" for row in rows_of(columns)).encode()
    pieces = (text[i : i + 7777] for i in range(0, len(text), 7777))
    return [
        json.loads(line)["mu_macro"] for line in asked(client.post(BATCH, content=pieces, headers=LINES)).iter_lines()
    ]


def as_line_of_columns(client, surrogate, columns):
    del surrogate
    text = json.dumps({name: column.tolist() for name, column in columns.items()}) + "\n"
    return json.loads(asked(client.post(BATCH, content=text, headers=LINES)).text)["mu_macro"]


def as_csv(client, surrogate, columns):
    del surrogate
    text = "\n".join([",".join(NAMES), *(",".join(map(repr, row.values())) for row in rows_of(columns)), ""])
    answer = asked(client.post(BATCH, content=text, headers={"Content-Type": "text/csv"})).text
    return [float(line.split(",")[0]) for line in answer.splitlines()[1:]]


def as_arrow(client, surrogate, columns, size=MANY):
    del surrogate
    sink, whole = pa.BufferOutputStream(), pa.table(columns)
    with pa.ipc.new_stream(sink, whole.schema) as writer:
        writer.write_table(whole, max_chunksize=size)
    answer = asked(client.post(BATCH, content=sink.getvalue().to_pybytes(), headers=ARROW)).content
    return pa.ipc.open_stream(answer).read_all()["mu_macro"].to_pylist()


def as_arrow_batches(client, surrogate, columns):
    return as_arrow(client, surrogate, columns, 999)


def as_umbridge(client, surrogate, columns):
    del surrogate
    found = []
    for row in rows_of(columns, FEW):
        body = {"name": "mu_macro", "input": [list(row.values())], "config": {}}
        found.append(asked(client.post("/Evaluate", json=body)).json()["output"][0][0])
    return found


def as_file(client, surrogate, columns):
    del client, surrogate
    text = "\n".join([",".join(NAMES), *(",".join(map(repr, row.values())) for row in rows_of(columns)), ""])
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "cases.csv").write_text(text)
        words = [sys.executable, "-m", "mumacro", "eval", f"{folder}/cases.csv", "-o", f"{folder}/out.csv"]
        subprocess.run(words, capture_output=True, check=True)
        with (Path(folder) / "out.csv").open(newline="") as answered:
            return [float(row["mu_macro"]) for row in csv.DictReader(answered)]


WAYS = [
    as_library_alone, as_body, as_query, as_text, as_columns, as_columns_with_more, as_small_columns, as_rows, as_lines,
    as_pieces_of_lines, as_line_of_columns, as_csv, as_arrow, as_arrow_batches, as_umbridge, as_file,
]  # fmt: skip


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
def test_every_endpoint_and_format_gives_the_same_bits(client, surrogate, columns, expected, way):
    found = np.array(way(client, surrogate, columns), dtype=np.float64)
    assert found.size in (MANY, FEW)
    assert np.array_equal(found.view(np.int64), expected[: found.size].view(np.int64))


@pytest.mark.parametrize("name", NAMES)
def test_a_name_given_twice_is_refused_in_every_form(client, problem, case, name):
    def twice(end=""):
        members = [f"{json.dumps(key)}: {value}" for key, value in case.items()]
        return "{" + ", ".join([*members, f'"{name}": {1.5 * case[name]}']) + end + "}"

    for path, body in (
        (SINGLE, twice()), (SINGLE, twice(', "include": ["groups"]')), (BATCH, f"[{twice()}]"),
        (BATCH, twice(', "include": ["groups"], "tolerance": 1e-3')),
        (BATCH, twice().replace(f"{case['v0']}", "[1, 2]", 1)), (BATCH, twice(', "f": null')),
        ("/v1/law", twice(', "start": 1, "stop": 2')), ("/v1/solve-for", twice(', "unknown": "y0", "target": 0.1')),
    ):  # fmt: skip
        (fault,) = problem(client.post(path, content=body, headers=JSON), 422)["errors"]
        assert (fault["field"], fault["reason"]) == (name, "is given more than once")
    for lines in (1, 3):
        answer = client.post(BATCH, content=(twice() + "\n") * lines, headers=LINES)
        assert [json.loads(line)["status"] for line in answer.iter_lines()] == [422] * lines

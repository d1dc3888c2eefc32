"""One table of cases through every way of asking: values, names, order, units, gaps, rigid contact, f, reasons."""

import csv
import io
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pa = pytest.importorskip("pyarrow", reason="the extra files is not installed")
import pyarrow.parquet as pq  # noqa: E402

from comparing import close  # noqa: E402
from forms import BATCH, WRITERS, Row, as_arrow, as_csv, as_table, asked, number, posted, read  # noqa: E402
from mumacro import InputError, Surrogate  # noqa: E402
from mumacro.__main__ import main  # noqa: E402

NAMES = ("mu0", "Fz", "k", "y0", "omega", "v0")
COLUMNS = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")
CASE: Row = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
GOOD: tuple[Row, ...] = (
    CASE,
    {**CASE, "k": "rigid"},
    {**CASE, "v0": 1.0},  # continuous sliding
    {**CASE, "v0": 0.0},  # the static limit
    {**CASE, "y0": 0.0},
    {**CASE, "omega": 0.0},
    {**CASE, "y0": 3e-6, "v0": 1e-9},  # the corner
    {**CASE, "v0": 5e-324, "y0": 1e-300},
    {"mu0": 1e-5, "Fz": 1e5, "k": 123456789.0, "y0": 1e-3, "omega": 6.283185307179586, "v0": 0.1},
)
GAP = "is missing; write rigid or a number"
BAD: dict[str, tuple[str, str]] = {  # JSON of the value, and the reason
    "y0": ("-1.0", "must be finite and >= 0"), "mu0": ("0.0", "must be finite and > 0"), "k": ("null", GAP),
}  # fmt: skip
ROWS = (*GOOD[:4], *({**CASE, name: json.loads(value)} for name, (value, _) in BAD.items()), *GOOD[4:])
REASONS = [None] * 4 + [f"{name}: {reason}" for name, (_, reason) in BAD.items()] + [None] * (len(GOOD) - 4)


@pytest.fixture(scope="module")
def expected(surrogate: Surrogate) -> list[Row]:
    """The library, case by case; a bad one has empty columns and its reason."""
    found = []
    for row, reason in zip(ROWS, REASONS, strict=True):
        given = {name: number(value) for name, value in row.items()}
        if reason is None:
            answer = surrogate.evaluate(**given)
            found.append({**{name: getattr(answer, name) for name in COLUMNS}, "error": None})
        else:
            if not reason.endswith(GAP):  # None is rigid contact in Python
                with pytest.raises(InputError) as error:
                    surrogate.evaluate(**given)
                assert f"{error.value.field}: must be {error.value.bound}" == reason
            found.append({**dict.fromkeys(COLUMNS), "error": reason})
    return found


# --- what is read back ----------------------------------------------------------------------------------


def typed(row: Row) -> Row:
    """A row of CSV with numbers as floats and empty cells as None."""
    return {
        name: None if text == "" else text if name in ("regime", "source", "error", "k") else float(text)
        for name, text in row.items()
    }


def of_problem(document: Row) -> str:
    (error,) = document["errors"]
    assert document["detail"] == f"{error['field']}: {error['reason']}"
    return str(document["detail"])


def of_one(reply: Any) -> Row:
    """A response to one case."""
    document = reply.json()
    if reply.status_code == 422:
        return {**dict.fromkeys(COLUMNS), "error": of_problem(document)}
    assert tuple(document) == (*COLUMNS, "table", "api_version")
    return {**{name: document[name] for name in COLUMNS}, "error": None}


def with_errors(columns: Row, errors: list[Row]) -> list[Row]:
    reasons = {error["index"]: f"{error['field']}: {error['reason']}" for error in errors}
    rows = zip(*(columns[name] for name in COLUMNS), strict=True)
    return [{**dict(zip(COLUMNS, row, strict=True)), "error": reasons.get(i)} for i, row in enumerate(rows)]


# --- the service ----------------------------------------------------------------------------------------


def by_post(client: Any) -> list[Row]:
    return [of_one(client.post("/v1/mu-macro", json=row)) for row in ROWS]


def by_get(client: Any) -> list[Row]:
    def query(row: Row) -> str:
        return "&".join(f"{name}={'' if value is None else value}" for name, value in row.items())

    return [of_one(client.get(f"/v1/mu-macro?{query(row)}")) for row in ROWS]


def by_rows(client: Any) -> list[Row]:
    document = client.post(BATCH, json=list(ROWS)).json()
    assert tuple(document) == ("results", "errors", "n_errors", "table", "api_version")
    assert document["n_errors"] == len(BAD)
    assert all(row is None or tuple(row) == COLUMNS for row in document["results"])
    columns = {name: [row and row[name] for row in document["results"]] for name in COLUMNS}
    return with_errors(columns, document["errors"])


def by_columns(client: Any) -> list[Row]:
    document = client.post(BATCH, json={name: [row[name] for row in ROWS] for name in NAMES}).json()
    assert tuple(document) == (*COLUMNS, "errors", "n_errors", "table", "api_version")
    return with_errors(document, document["errors"])


def by_lines(client: Any) -> list[Row]:
    empty = dict.fromkeys(COLUMNS)
    return [
        {**empty, "error": of_problem(line)} if "errors" in line else {**{n: line[n] for n in COLUMNS}, "error": None}
        for line in asked(client, "ndjson", ROWS)
    ]


def by_csv(client: Any) -> list[Row]:
    found = asked(client, "csv", ROWS)
    assert tuple(found[0]) == (*COLUMNS, "error")
    return list(map(typed, found))


def by_arrow(client: Any) -> list[Row]:
    found = asked(client, "arrow", ROWS)
    assert tuple(found[0]) == (*COLUMNS, "error")
    return found


@pytest.mark.parametrize("way", [by_post, by_get, by_rows, by_columns, by_lines, by_csv, by_arrow])
def test_the_service_answers_in_every_format_what_the_library_does(
    client: Any, expected: list[Row], way: Callable[[Any], list[Row]]
) -> None:
    found = way(client)
    i = REASONS.index(f"k: {GAP}")
    if way is by_post:  # null is rigid contact in a single case, which has no gaps
        assert found[i] == expected[1]
    if way is by_get:  # an empty value is no number there
        assert found[i]["error"]
    if way in (by_post, by_get):
        found[i] = expected[i]
    assert found == expected


# --- the library and the command -----------------------------------------------------------------------


def test_arrays_hold_what_single_cases_do(surrogate: Surrogate, expected: list[Row]) -> None:
    answer = surrogate.evaluate({name: [number(row[name]) for row in GOOD] for name in NAMES})
    rows = zip(*(getattr(answer, name).tolist() for name in COLUMNS), strict=True)
    assert [dict(zip(COLUMNS, row, strict=True)) for row in rows] == [
        {name: row[name] for name in COLUMNS} for row in expected if row["error"] is None
    ]


@pytest.mark.parametrize("i", [0, 1, 3, 5, 8])
def test_the_command_answers_one_case(capsys: Any, expected: list[Row], i: int) -> None:
    good = [row for row in expected if row["error"] is None]
    assert main([" ".join(f"{name}={value}" for name, value in GOOD[i].items()), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert {name: document[name] for name in COLUMNS} == {name: good[i][name] for name in COLUMNS}
    assert document["inputs"] == {name: None if value == "rigid" else value for name, value in GOOD[i].items()}


@pytest.mark.parametrize("made", ["csv", "ndjson", "parquet"])
@pytest.mark.parametrize("given", ["csv", "ndjson", "parquet"])
def test_eval_answers_files_of_every_format(tmp_path: Path, expected: list[Row], given: str, made: str) -> None:
    source, out = tmp_path / f"cases.{given}", tmp_path / f"out.{made}"
    if given == "parquet":
        pq.write_table(as_table(ROWS), source)
    else:
        source.write_text(str(WRITERS[given](ROWS)), "utf-8")
    assert main(["eval", str(source), "-o", str(out)]) == 3  # some rows are rejected
    if made == "parquet":
        found = pq.read_table(out).to_pylist()
    else:
        text = out.read_text("utf-8")
        lines = text.splitlines()
        found = list(map(typed, csv.DictReader(io.StringIO(text)))) if made == "csv" else list(map(json.loads, lines))
    assert all(tuple(row) == (*NAMES, *COLUMNS) for row in found)
    good = [row for row in expected if row["error"] is None]
    assert [{name: row[name] for name in COLUMNS} for row in found] == [
        {name: row[name] for name in COLUMNS} for row in good
    ]
    assert [float(row["mu0"]) for row in found] == [row["mu0"] for row in GOOD]
    with (tmp_path / f"out.{made}.rejects.csv").open(encoding="utf-8") as stream:
        rejected = list(csv.DictReader(stream))
    assert [f"{row['field']}: {row['reason']}" for row in rejected] == [reason for reason in REASONS if reason]


# --- what include adds ----------------------------------------------------------------------------------

INCLUDED = ["groups", "limits", "gradient", "power", "stick_fraction", "settling", "regime_certain", "std"]


def flat(document: Any, path: str = "") -> Row:
    """Leaves of nested objects by their paths."""
    if not isinstance(document, dict):
        return {path: document}
    found: Row = {}
    for name, value in document.items():
        found.update(flat(value, f"{path}.{name}" if path else name))
    return found


def test_every_column_that_include_adds_is_the_same_in_every_format(client: Any) -> None:
    good, std = list(GOOD), {"v0": 1e-3, "mu0": 0.01}
    asked_for = {"include": INCLUDED, "std": std}
    single = [flat(client.post("/v1/mu-macro", json={**row, **asked_for}).json()) for row in good]
    names = [name for name in single[0] if not name.startswith(("table", "api"))]
    assert names[: len(COLUMNS)] == list(COLUMNS)
    assert len(names) > 30
    single = [{name: row[name] for name in names} for row in single]
    columns = client.post(BATCH, json={**{name: [row[name] for row in good] for name in NAMES}, **asked_for}).json()
    listed = {name: values for name, values in flat(columns).items() if name in names}
    assert [dict(zip(listed, row, strict=True)) for row in zip(*listed.values(), strict=True)] == single
    query = {"include": ",".join(INCLUDED), **{f"std_{name}": value for name, value in std.items()}}
    assert flat(client.get("/v1/mu-macro", params={**CASE, **query}).json()) == flat(
        client.post("/v1/mu-macro", json={**CASE, **asked_for}).json()
    )
    reply = client.post(BATCH, params=query, json=good).json()
    assert [{name: flat(row)[name] for name in names} for row in reply["results"]] == single
    rows = read("arrow", posted(client, "arrow", as_arrow(GOOD), **query))
    assert list(rows[0]) == [*names, "error"]
    assert [{name: finite(row[name]) for name in names} for row in rows] == single
    lines = read("ndjson", posted(client, "ndjson", WRITERS["ndjson"](GOOD), **query))
    assert [{name: flat(line)[name] for name in names} for line in lines] == single
    rows = read("csv", posted(client, "csv", as_csv(GOOD), **query))
    assert list(rows[0]) == [*names, "error"]
    for row, one in zip(rows, single, strict=True):
        assert {name: finite(value_of(row[name], one[name])) for name in names} == one


def finite(value: Any) -> Any:
    """JSON has no number that is not finite, and says null."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def value_of(cell: str, like: Any) -> Any:
    """A cell of CSV as the type of a value."""
    if cell == "" or isinstance(like, str):
        return cell or None
    return cell.lower() == "true" if isinstance(like, bool) else float(cell)


# --- units ----------------------------------------------------------------------------------------------


def test_units_in_heads_and_the_frequency_mean_the_same_everywhere(client: Any, tmp_path: Path) -> None:
    f = 20690.14
    plain = client.post("/v1/mu-macro", json={**{n: v for n, v in CASE.items() if n != "omega"}, "f": f}).json()
    assert (
        plain["mu_macro"] == client.post("/v1/mu-macro", json={**CASE, "omega": 2.0 * math.pi * f}).json()["mu_macro"]
    )
    heads = ("mu0", "Fz", "k [N/mm]", "y0 [um]", "f [kHz]", "v0 [mm/s]")
    text = f"{','.join(heads)}\n0.3,10,1000,2,{f / 1e3},10\n"
    (row,) = read("csv", posted(client, "csv", text))
    assert float(row["mu_macro"]) == close(plain["mu_macro"], rel=1e-14)
    (tmp_path / "cases.csv").write_text(text, "utf-8")
    assert main(["eval", str(tmp_path / "cases.csv"), "-o", str(tmp_path / "out.csv")]) == 0
    with (tmp_path / "out.csv").open() as stream:
        (row,) = csv.DictReader(stream)
    assert float(row["mu_macro"]) == close(plain["mu_macro"], rel=1e-14)

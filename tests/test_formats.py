"""One table of cases through every way of asking: values, names, order, units, gaps, rigid contact, f, reasons."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from mumacro import InputError, Surrogate
from mumacro.__main__ import main
from tests.comparing import close
from tests.forms import BATCH, WRITERS, Row, as_table, asked, number, posted, rows_of
from tests.serving import CASE

COLUMNS = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")
NAMES = tuple(CASE)
GOOD: tuple[Row, ...] = (
    CASE,
    {**CASE, "k": "rigid"},
    {**CASE, "v0": 1.0},  # continuous sliding
    {**CASE, "v0": 0.0},  # the static limit
    *({**CASE, **change} for change in ({"y0": 0.0}, {"omega": 0.0}, {"v0": 5e-324, "y0": 1e-300})),
    {**CASE, "y0": 3e-6, "v0": 1e-9},  # the corner
    {"mu0": 1e-5, "Fz": 1e5, "k": 123456789.0, "y0": 1e-3, "omega": 6.283185307179586, "v0": 0.1},
)
GAP = "is missing; write rigid or a number"
BAD: dict[str, tuple[str, str]] = {  # JSON of the value, and the reason
    "y0": ("-1.0", "must be finite and >= 0"), "mu0": ("0.0", "must be finite and > 0"), "k": ("null", GAP),
}  # fmt: skip
ROWS = (*GOOD[:4], *({**CASE, name: json.loads(value)} for name, (value, _) in BAD.items()), *GOOD[4:])
REASONS = [None] * 4 + [f"{name}: {reason}" for name, (_, reason) in BAD.items()] + [None] * (len(GOOD) - 4)


@pytest.fixture(scope="module")
def good(surrogate: Surrogate) -> list[Row]:
    """The library, case by case."""
    answers = [surrogate.evaluate({name: number(value) for name, value in row.items()}) for row in GOOD]
    return [{name: getattr(answer, name) for name in COLUMNS} for answer in answers]


@pytest.fixture(scope="module")
def expected(good: list[Row]) -> list[Row]:
    """The same for all rows; a bad one has empty columns and its reason."""
    empty, rest = dict.fromkeys(COLUMNS), iter(good)
    return [{**(empty if reason else next(rest)), "error": reason} for reason in REASONS]


# --- the service ----------------------------------------------------------------------------------------


def of_one(document: Row) -> Row:
    """An answer to one case, or its refusal."""
    if "errors" in document:
        (error,) = document["errors"]
        assert document["detail"] == f"{error['field']}: {error['reason']}"
        return {**dict.fromkeys(COLUMNS), "error": document["detail"]}
    assert tuple(document) == (*COLUMNS, "table", "api_version")
    return {**{name: document[name] for name in COLUMNS}, "error": None}


def with_errors(columns: Row, document: Row) -> list[Row]:
    assert tuple(document)[-4:] == ("errors", "n_errors", "table", "api_version")
    assert document["n_errors"] == len(BAD)
    reasons = {error["index"]: f"{error['field']}: {error['reason']}" for error in document["errors"]}
    rows = zip(*(columns[name] for name in COLUMNS), strict=True)
    return [{**dict(zip(COLUMNS, row, strict=True)), "error": reasons.get(i)} for i, row in enumerate(rows)]


def by_get(client: Any, row: Row) -> Row:
    query = "&".join(f"{name}={'' if value is None else value}" for name, value in row.items())
    return of_one(client.get(f"/v1/mu-macro?{query}").json())


def by_rows(client: Any) -> list[Row]:
    document = client.post(BATCH, json=list(ROWS)).json()
    assert all(row is None or tuple(row) == COLUMNS for row in document["results"])
    return with_errors({name: [row and row[name] for row in document["results"]] for name in COLUMNS}, document)


def by_columns(client: Any) -> list[Row]:
    document = client.post(BATCH, json={name: [row[name] for row in ROWS] for name in NAMES}).json()
    assert tuple(document)[:-4] == COLUMNS
    return with_errors(document, document)


WAYS: dict[str, Callable[[Any], list[Row]]] = {
    "POST": lambda client: [of_one(client.post("/v1/mu-macro", json=row).json()) for row in ROWS],
    "GET": lambda client: [by_get(client, row) for row in ROWS],
    "rows": by_rows,
    "columns": by_columns,
    "lines": lambda client: list(map(of_one, asked(client, "ndjson", ROWS))),
    "CSV": lambda client: asked(client, "csv", ROWS),
    "Arrow": lambda client: asked(client, "arrow", ROWS),
}


@pytest.mark.parametrize("way", WAYS)
def test_the_service_answers_in_every_format_what_the_library_does(client: Any, expected: list[Row], way: str) -> None:
    found = WAYS[way](client)
    i = REASONS.index(f"k: {GAP}")
    if way == "POST":  # null is rigid contact in a single case, which has no gaps
        assert found[i] == expected[1]
    if way == "GET":  # an empty value is no number there
        assert found[i]["error"]
    if way in ("POST", "GET"):
        found[i] = expected[i]
    assert found == expected
    assert {tuple(row) for row in found} == {(*COLUMNS, "error")}


# --- the library and the command -----------------------------------------------------------------------


def test_arrays_hold_what_single_cases_do(surrogate: Surrogate, good: list[Row]) -> None:
    answer = surrogate.evaluate({name: [number(row[name]) for row in GOOD] for name in NAMES})
    rows = zip(*(getattr(answer, name).tolist() for name in COLUMNS), strict=True)
    assert [dict(zip(COLUMNS, row, strict=True)) for row in rows] == good
    for name in ("y0", "mu0"):
        with pytest.raises(InputError, match=f"{name} {BAD[name][1]}"):
            surrogate.evaluate({**CASE, name: float(BAD[name][0])})


@pytest.mark.parametrize("i", [0, 1, 3, 5, 8])
def test_the_command_answers_one_case(capsys: Any, good: list[Row], i: int) -> None:
    assert main([" ".join(f"{name}={value}" for name, value in GOOD[i].items()), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert {name: document[name] for name in COLUMNS} == good[i]
    assert document["inputs"] == {name: None if value == "rigid" else value for name, value in GOOD[i].items()}


@pytest.mark.parametrize("made", ["csv", "ndjson", "parquet"])
@pytest.mark.parametrize("given", ["csv", "ndjson", "parquet"])
def test_eval_answers_files_of_every_format(tmp_path: Path, good: list[Row], given: str, made: str) -> None:
    source, out = tmp_path / f"cases.{given}", tmp_path / f"out.{made}"
    if given == "parquet":
        pq.write_table(as_table(ROWS), source)
    else:
        source.write_text(str(WRITERS[given](ROWS)), "utf-8")
    assert main(["eval", str(source), "-o", str(out)]) == 3  # some rows are rejected
    found = pq.read_table(out).to_pylist() if made == "parquet" else rows_of(made, out.read_text("utf-8"))
    assert all(tuple(row) == (*NAMES, *COLUMNS) for row in found)
    assert [{name: row[name] for name in COLUMNS} for row in found] == good
    assert [row["mu0"] for row in found] == [row["mu0"] for row in GOOD]
    rejected = rows_of("csv", (tmp_path / f"out.{made}.rejects.csv").read_text("utf-8"))
    assert [f"{row['field']}: {row['reason']}" for row in rejected] == [reason for reason in REASONS if reason]


# --- what include adds ----------------------------------------------------------------------------------

INCLUDED = ["groups", "limits", "gradient", "power", "stick_fraction", "settling", "std"]


def flat(document: Row, path: str = "") -> Row:
    """Leaves of nested objects by their paths; JSON has no number that is not finite, and says null."""
    found: Row = {}
    for name, value in document.items():
        if isinstance(value, dict):
            found |= flat(value, f"{path}{name}.")
        else:
            found[path + name] = None if isinstance(value, float) and not math.isfinite(value) else value
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
    of_query = flat(client.get("/v1/mu-macro", params={**CASE, **query}).json())
    assert {name: of_query[name] for name in names} == single[0]
    reply = client.post(BATCH, params=query, json=good).json()
    assert [{name: flat(row)[name] for name in names} for row in reply["results"]] == single
    for form in ("arrow", "csv", "ndjson"):
        rows = asked(client, form, GOOD, **query)
        assert form == "ndjson" or list(rows[0]) == [*names, "error"]
        assert [{name: row[name] for name in names} for row in map(flat, rows)] == single


# --- units ----------------------------------------------------------------------------------------------


def test_units_in_heads_and_the_frequency_mean_the_same_everywhere(client: Any, surrogate: Any, tmp_path: Path) -> None:
    f = 20690.14
    plain = surrogate.evaluate({**CASE, "omega": 2.0 * math.pi * f}).mu_macro
    given = {**{name: x for name, x in CASE.items() if name != "omega"}, "f": f}
    assert client.post("/v1/mu-macro", json=given).json()["mu_macro"] == plain
    text = f"mu0,Fz,k [N/mm],y0 [um],f [kHz],v0 [mm/s]\n0.3,10,1000,2,{f / 1e3},10\n"
    (tmp_path / "cases.csv").write_text(text, "utf-8")
    assert main(["eval", str(tmp_path / "cases.csv"), "-o", str(tmp_path / "out.csv")]) == 0
    for answer in (posted(client, "csv", text).text, (tmp_path / "out.csv").read_text("utf-8")):
        assert rows_of("csv", answer)[0]["mu_macro"] == close(plain, rel=1e-14)

"""One table of cases through every way of asking the service: values, names, order, gaps, rigid
contact, reasons."""

import json
import math
from collections.abc import Callable
from typing import Any

import pytest

from mumacro import Surrogate
from mumacro.outputs import OUTPUTS
from tests.support.cases import flat
from tests.support.serving import CASE

Row = dict[str, Any]
BATCH = "/v1/mu-macro/batch"
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
    "y0": ("-1.0", "must be finite and >= 0"),
    "mu0": ("0.0", "must be finite and > 0"),
    "k": ("null", GAP),
}
ROWS = (
    *GOOD[:4],
    *({**CASE, name: json.loads(value)} for name, (value, _) in BAD.items()),
    *GOOD[4:],
)
REASONS = (
    [None] * 4
    + [f"{name}: {reason}" for name, (_, reason) in BAD.items()]
    + [None] * (len(GOOD) - 4)
)


@pytest.fixture(scope="module")
def good(surrogate: Surrogate) -> list[Row]:
    """The library, case by case."""
    answers = [
        surrogate.evaluate({**row, "k": math.inf} if row["k"] == "rigid" else row) for row in GOOD
    ]
    return [{name: getattr(answer, name) for name in COLUMNS} for answer in answers]


@pytest.fixture(scope="module")
def expected(good: list[Row]) -> list[Row]:
    """The same for all rows; a bad one has empty columns and its reason."""
    empty, rest = dict.fromkeys(COLUMNS), iter(good)
    return [{**(empty if reason else next(rest)), "error": reason} for reason in REASONS]


def of_one(document: Row) -> Row:
    """An answer to one case, or its refusal."""
    if "errors" in document:
        (error,) = document["errors"]
        assert document["detail"] == f"{error['field']}: {error['reason']}"
        return {**dict.fromkeys(COLUMNS), "error": document["detail"]}
    assert tuple(document) == (*COLUMNS, *_remarked(document), "table", "api_version")
    return {**{name: document[name] for name in COLUMNS}, "error": None}


def _remarked(document: Row) -> tuple[str, ...]:
    """The member of remarks, which is there where something is doubtful."""
    return ("remarks",) if "remarks" in document else ()


END = ("errors", "n_errors", "remarks", "table", "api_version")


def with_errors(columns: Row, document: Row) -> list[Row]:
    assert tuple(document)[-5:] == END
    assert document["n_errors"] == len(BAD)
    reasons = {
        error["index"]: f"{error['field']}: {error['reason']}" for error in document["errors"]
    }
    rows = zip(*(columns[name] for name in COLUMNS), strict=True)
    return [
        {**dict(zip(COLUMNS, row, strict=True)), "error": reasons.get(i)}
        for i, row in enumerate(rows)
    ]


def by_get(client: Any, row: Row) -> Row:
    query = "&".join(f"{name}={'' if value is None else value}" for name, value in row.items())
    return of_one(client.get(f"/v1/mu-macro?{query}").json())


def by_rows(client: Any) -> list[Row]:
    document = client.post(BATCH, json=list(ROWS)).json()
    assert all(row is None or tuple(row) == COLUMNS for row in document["results"])
    return with_errors(
        {name: [row and row[name] for row in document["results"]] for name in COLUMNS}, document
    )


def by_columns(client: Any) -> list[Row]:
    document = client.post(BATCH, json={name: [row[name] for row in ROWS] for name in NAMES}).json()
    assert tuple(document)[:-5] == COLUMNS
    return with_errors(document, document)


WAYS: dict[str, Callable[[Any], list[Row]]] = {
    "POST": lambda client: [of_one(client.post("/v1/mu-macro", json=row).json()) for row in ROWS],
    "GET": lambda client: [by_get(client, row) for row in ROWS],
    "rows": by_rows,
    "columns": by_columns,
}


@pytest.mark.parametrize("way", WAYS)
def test_the_service_answers_in_every_format_what_the_library_does(
    client: Any, expected: list[Row], way: str
) -> None:
    rows = WAYS[way](client)
    i = REASONS.index(f"k: {GAP}")
    if way == "GET":  # an empty value is no number there
        assert rows[i]["error"]
    if way == "GET":
        rows[i] = expected[i]
    assert rows == expected
    assert {tuple(row) for row in rows} == {(*COLUMNS, "error")}


INCLUDED = [*OUTPUTS]


def leaves_of(document: Row, path: str = "") -> Row:
    """Leaves of nested objects by their paths; JSON has no number that is not finite, and says
    null."""
    leaves: Row = {}
    for name, value in document.items():
        if isinstance(value, dict):
            leaves |= leaves_of(value, f"{path}{name}.")
        else:
            leaves[path + name] = (
                None if isinstance(value, float) and not math.isfinite(value) else value
            )
    return leaves


def test_every_column_that_include_adds_is_the_librarys_in_every_format(
    client: Any, surrogate: Surrogate
) -> None:
    good, std = list(GOOD), {"v0": 1e-3, "mu0": 0.01}
    options = {"include": INCLUDED, **flat(std)}
    single = [
        leaves_of(client.post("/v1/mu-macro", json={**row, **options}).json()) for row in good
    ]
    names = [name for name in single[0] if not name.startswith(("table", "api", "remarks"))]
    assert names[: len(COLUMNS)] == list(COLUMNS)
    assert len(names) > 30
    single = [{name: row[name] for name in names} for row in single]
    for row, answer in zip(good, single, strict=True):
        own = leaves_of(surrogate.evaluate(**{**row, **options}).to_dict())
        assert {name: own[name] for name in names} == answer
    columns = client.post(
        BATCH, json={**{name: [row[name] for row in good] for name in NAMES}, **options}
    ).json()
    listed = {name: values for name, values in leaves_of(columns).items() if name in names}
    assert [
        dict(zip(listed, row, strict=True)) for row in zip(*listed.values(), strict=True)
    ] == single
    query = {"include": ",".join(INCLUDED), **{f"std_{name}": value for name, value in std.items()}}
    of_query = leaves_of(client.get("/v1/mu-macro", params={**CASE, **query}).json())
    assert {name: of_query[name] for name in names} == single[0]
    reply = client.post(BATCH, params=query, json=good).json()
    assert [{name: leaves_of(row)[name] for name in names} for row in reply["results"]] == single

"""Cases written in every form of a batch, and the answers read back."""

import csv
import io
import json
import math
from collections.abc import Sequence
from typing import Any

import pyarrow as pa

Row = dict[str, Any]
BATCH = "/v1/mu-macro/batch"
TYPES = {
    "json": "application/json",
    "csv": "text/csv",
    "ndjson": "application/x-ndjson",
    "arrow": "application/vnd.apache.arrow.stream",
}


def number(value: Any) -> Any:
    """A rigid contact is infinite where only numbers are."""
    return math.inf if value == "rigid" else value


def as_csv(rows: Sequence[Row]) -> str:
    """A head with the names of the first row, and the rows; None is an empty cell."""
    text = io.StringIO()
    csv.writer(text).writerows(
        [list(rows[0]), *(["" if x is None else x for x in row.values()] for row in rows)]
    )
    return text.getvalue()


def as_ndjson(rows: Sequence[Row]) -> str:
    return "".join(json.dumps(row) + "\n" for row in rows)


def as_table(rows: Sequence[Row]) -> Any:
    return pa.table(
        {name: pa.array([number(row[name]) for row in rows], pa.float64()) for name in rows[0]}
    )


def stream_of(table: Any, **options: Any) -> bytes:
    """A table or a record batch of pyarrow as a stream."""
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, table.schema, options=pa.ipc.IpcWriteOptions(**options)) as writer:
        writer.write(table)
    return bytes(sink.getvalue())


def as_arrow(rows: Sequence[Row]) -> bytes:
    return stream_of(as_table(rows))


WRITERS = {"csv": as_csv, "ndjson": as_ndjson, "arrow": as_arrow}


def posted(client: Any, form: str, body: Any, **params: Any) -> Any:
    return client.post(BATCH, content=body, params=params, headers={"Content-Type": TYPES[form]})


def answered_rows(client: Any, form: str, rows: Sequence[Row], **params: Any) -> list[Row]:
    response = posted(client, form, WRITERS[form](rows), **params)
    assert (response.status_code, response.headers["content-type"]) == (200, TYPES[form]), (
        response.text
    )
    return read(form, response)


def read(form: str, response: Any) -> list[Row]:
    if form == "arrow":
        return list(pa.ipc.open_stream(response.content).read_all().to_pylist())
    return rows_of(form, response.text)


def rows_of(form: str, text: str) -> list[Row]:
    """The rows of a text; a cell of CSV is a number or a truth value where it can be one, None
    where empty."""
    if form == "csv":
        rows = csv.DictReader(io.StringIO(text, newline=""))
        return [{name: _value(cell) for name, cell in row.items()} for row in rows]
    return list(map(json.loads, text.splitlines()))


def _value(cell: str) -> Any:
    try:
        return float(cell)
    except ValueError:
        return {"": None, "True": True, "False": False}.get(cell, cell)

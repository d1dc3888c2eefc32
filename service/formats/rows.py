"""JSON rows: a list of objects, each one case.  A bad row affects only itself.

msgspec reads ordinary rows, a quarter of a megabyte at a time, since it holds the interpreter's lock.  If it refuses a
body, :func:`read_values` reads it again, row by row, and gives the reasons.
"""

import math
from array import array
from collections.abc import Iterator, Mapping
from operator import attrgetter
from typing import Any, ClassVar, Literal

import msgspec
import numpy as np
import orjson
from msgspec import UNSET, UnsetType

from ..evaluation import MAX_ERRORS, Answers, Batch, Reason
from ..hints import ONE_FREQUENCY, STATE_K, STATE_OMEGA, TOO_FREQUENT, unknown_name
from ..kernel import FIELDS, INPUTS, MOST_HZ, RAD_PER_CYCLE, Array
from ..quantities import nested
from . import decode, limit_values, register, too_large
from .columns import REGIMES_OF, SOURCES_OF, dump, is_bool, read_entry

__all__ = ["decode_rows", "objects", "read_row", "read_values"]

_PIECE = 256 * 1024  # bytes that are decoded at a time
_SLICE = 8192  # cases that are written at a time


class _Row(msgspec.Struct, forbid_unknown_fields=True, gc=False):
    """The usual form of a row."""

    mu0: float
    Fz: float
    k: float | Literal["rigid"] | None
    y0: float
    v0: float
    omega: float | UnsetType | None = UNSET
    f: float | UnsetType | None = UNSET


_decoder = msgspec.json.Decoder(list[_Row])


class Rows:
    """The format."""

    name, media_type, streams = "rows", "application/json", False
    aliases: tuple[str, ...] = ()
    body: ClassVar[dict[str, Any]] = {
        "schema": {"type": "array", "items": {"$ref": "#/components/schemas/Case"}},
        "example": [{"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 20690.0, "v0": 0.01}],
    }
    answer: ClassVar[dict[str, Any]] = {"schema": {"$ref": "#/components/schemas/RowsAnswer"}}

    def matches(self, text: memoryview) -> bool:
        """Whether it is a list."""
        return bytes(text[:4096]).lstrip()[:1] == b"["

    def read(self, text: bytearray, max_batch: int) -> tuple[Batch, dict[str, Any]]:
        """See :class:`Format`."""
        limit_values(text, max_batch, len(INPUTS) + 1)
        batch = decode_rows(text)
        if batch is None:
            found = decode(text, list)
            batch = read_values(found) if len(found) <= max_batch else None
        if batch is None or batch.size > max_batch:
            raise too_large(max_batch)
        return batch, {}

    def write(self, answers: Answers, label: Mapping[str, Any]) -> Iterator[bytes]:
        """See :class:`Format`."""
        yield b'{"results":['
        for start in range(0, answers.size, _SLICE):
            text = orjson.dumps(objects(answers, start, start + _SLICE))
            yield text[1:-1] if start == 0 else b"," + text[1:-1]
        yield b"]," + dump({"errors": answers.errors, "n_errors": answers.n_bad, **label})[1:]


def decode_rows(text: bytearray) -> Batch | None:
    """Ordinary rows as columns; None for any other body.

    The text is cut at ``},``.  If every piece is a list of rows, the pieces together are one list of rows.  A cut
    within a string makes a piece that is not a list.
    """
    begin, last = text.find(b"["), text.rfind(b"]")
    if begin < 0 or last < begin or text[:begin].strip() or text[last + 1 :].strip():
        return None
    parts: list[list[Array]] = []
    start, members = begin + 1, 0
    try:
        while True:
            end = text.find(b"},", start + _PIECE, last) if last - start > _PIECE else -1
            stop = last if end < 0 else end + 1
            rows = _decoder.decode(b"[" + text[start:stop] + b"]")
            if not rows and parts:
                return None  # a comma with nothing after it
            found = _columns(rows)
            if found is None:
                return None
            parts.append(found[0])
            members += found[1]
            if end < 0:
                break
            start = end + 2
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return None
    if text.count(b":", begin, last) != members:
        return None  # a name is given twice
    columns = parts[0] if len(parts) == 1 else [np.concatenate(pieces) for pieces in zip(*parts, strict=True)]
    return Batch(columns[0].size, columns)


def _columns(rows: list[_Row]) -> tuple[list[Array], int] | None:
    """Rows as columns, and how many members they have; None where a frequency is missing, given twice or too large."""
    named: dict[str, Any] = {name: list(map(attrgetter(name), rows)) for name in INPUTS}
    unset = named["f"].count(UNSET)
    try:
        k = array("d", named["k"])
    except TypeError:
        k = array("d", [math.inf if type(value) is not float else value for value in named["k"]])
    try:
        omega = array("d", named["omega"])
        if any(type(value) is float for value in named["f"]):
            return None
    except TypeError:
        pairs = list(zip(named["omega"], named["f"], strict=True))
        if any(
            (type(omega) is float) == (type(f) is float) or (type(f) is float and f > MOST_HZ) for omega, f in pairs
        ):
            return None
        omega = array("d", [omega if type(omega) is float else RAD_PER_CYCLE * f for omega, f in pairs])
        unset += named["omega"].count(UNSET)
    columns = {name: array("d", named[name]) for name in FIELDS if name not in ("k", "omega")}
    columns.update(k=k, omega=omega)
    return [np.frombuffer(columns[name]) if rows else np.empty(0) for name in FIELDS], len(INPUTS) * len(rows) - unset


def read_values(found: list[Any]) -> Batch:
    """Rows from decoded JSON, one by one."""
    size = len(found)
    columns = np.full((6, size), np.nan)
    reasons: dict[int, Reason] = {}
    for i, row in enumerate(found):
        values, reason = read_row(row)
        if reason is None:
            columns[:, i] = values
        elif len(reasons) < MAX_ERRORS:
            reasons[i] = reason
    return Batch(size, list(columns), reasons)


def read_row(row: Any) -> tuple[list[float], Reason | None]:
    """The six inputs of a row, or the reason why it is not a case."""
    if not isinstance(row, dict):
        return [], (None, "must be an object")
    for name in row:
        if name not in INPUTS:
            return [], (str(name)[:80], unknown_name(str(name), INPUTS))
    values = {}
    for name in INPUTS:
        if name not in row or (name in ("omega", "f") and row[name] is None):
            if name == "k":
                return [], (name, STATE_K.format(rigid="null"))
            if name == "omega" and row.get("f") is None:
                return [], (name, STATE_OMEGA)
            if name not in ("omega", "f"):
                return [], (name, "is required")
            continue
        values[name], reason = read_entry(row[name], name)
        if reason is not None:
            return [], (name, reason)
    if "f" in values:
        if "omega" in values:
            return [], ("f", ONE_FREQUENCY)
        if values["f"] > MOST_HZ:
            return [], ("f", TOO_FREQUENT)
        values["omega"] = RAD_PER_CYCLE * values["f"]
    return [values[name] for name in FIELDS], None


def objects(answers: Answers, start: int, stop: int, label: Mapping[str, Any] | None = None) -> list[Any]:
    """Answers as objects, each with ``label``; None for a bad case."""
    part = slice(start, stop)
    extras = {
        name: [None if value != value else bool(value) for value in column[part].tolist()]
        if is_bool(name) else column[part].tolist()
        for name, column in answers.extras.items()
    }  # fmt: skip
    source = answers.source[part]
    lists = (
        answers.mu_macro[part].tolist(), answers.mu_ratio[part].tolist(), REGIMES_OF[source].tolist(),
        answers.error_bound[part].tolist(), SOURCES_OF[source].tolist(),
    )  # fmt: skip
    more = label or {}
    made: list[Any] = [
        None if name is None else {
            "mu_macro": mu, "mu_ratio": ratio, "regime": regime, "error_bound": bound, "source": name, **more
        }
        for mu, ratio, regime, bound, name in zip(*lists, strict=True)
    ]  # fmt: skip
    if extras:
        for i, entry in enumerate(made):
            if entry is not None:
                entry.update(nested({name: column[i] for name, column in extras.items()}))
    return made


register(Rows())

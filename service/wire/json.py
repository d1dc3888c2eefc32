"""JSON in and out: columns, rows, and lines of either (NDJSON).

simdjson reads long lists of numbers into arrays, and msgspec reads rows of numbers, both piece by
piece, so that other threads run meanwhile.  Everything else, and whatever they refuse, is read by
Python's ``json``, which gives the reasons.
"""

import json
import math
import re
import secrets
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from itertools import chain
from typing import Any, Literal

import msgspec
import numpy as np
import orjson
import simdjson
from msgspec.structs import astuple

from mumacro.inputs.fields import RAD_PER_CYCLE
from mumacro.inputs.kind import Kind as ContactKind

from ..answers import Part, nested
from ..case import MAX_ERRORS, Columns, Reason, asked_of, checked, columns_of, too_large
from ..options import OPTIONS, Options, example, kind_in, names_in, options_of
from ..problems import FieldFault, Kind, RequestError, refuse
from . import Batch, Form

_, NAMES = names_in(Options)
_READ = 256 * 1024  # bytes of rows that are read at a time
_TOKEN = secrets.token_hex(16).encode()  # stands in place of a list; nobody else knows it
_SHORT = 4096  # bytes of a list that json reads
_ROWS = 8192  # cases that are written at a time


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        refuse(
            [
                FieldFault.of(name, "is given more than once")
                for name in found
                if names.count(name) > 1
            ]
        )
    return found


# Numbers are read by functions of Python, so that other threads run meanwhile; int refuses 4300
# digits.
_DECODER = json.JSONDecoder(
    object_pairs_hook=_unique,
    parse_int=lambda digits: int(digits) if len(digits) < 4300 else float(digits),
    parse_float=lambda digits: float(digits),
)


def decode(text: bytes | bytearray, large: bool = False) -> Any:
    """A JSON text as Python objects.  NaN and Infinity are read; their fields are refused later."""
    if not text:
        raise RequestError(Kind.MALFORMED_BODY, "the body is empty")
    try:
        quick = None if large else orjson.loads(text)
        # One colon for each member: none is named twice, and none stands in an object within.
        if type(quick) is dict and text.count(b":") == len(quick):
            return quick
    except ValueError:
        pass  # _DECODER gives the reason
    try:
        return _DECODER.decode(text.decode())
    except RecursionError:
        raise RequestError(Kind.MALFORMED_BODY, "the body is nested too deeply") from None
    except ValueError as error:
        raise RequestError(Kind.MALFORMED_BODY, f"the body is not JSON: {error}") from None


def read(
    text: bytearray, max_batch: int, query: Mapping[str, Any]
) -> tuple[Columns, dict[str, Any]]:
    """The cases and the options of a body: columns or one case, or a list of rows."""
    _limit_values(text, max_batch)
    if _OPENS_LIST.match(text):
        kind = kind_in(query)
        return _quick_rows(text, max_batch, kind) or _rows(
            decode(text, large=True), max_batch, kind
        ), {}
    given = _columns(text)
    if not isinstance(given, dict):
        refuse([FieldFault((), "must be an object of columns or a list of rows", given)])
    _, rest, faults = options_of(Options, given)
    options = {name: given[name] for name in OPTIONS if given.get(name) is not None}
    return columns_of(rest, max_batch, NAMES, faults, kind_in({**query, **options})), options


def _limit_values(text: bytearray, max_batch: int) -> None:
    """Refuse a body that holds more values than a batch may have, before it is decoded.

    Every value but the first of its list or object has a comma before it, every list or object a
    bracket, every member of an object a colon.
    """
    room = max_batch + 64
    objects = text.count(b"{")
    if text.count(b",") > len(NAMES) * room or text.count(b"[") + objects > room:
        raise too_large(max_batch)
    if text.count(b":") > len(NAMES) * objects + 64:
        raise RequestError(
            Kind.INVALID_VALUE, "the body has objects with more members than there are fields"
        )


def _columns(text: bytearray) -> Any:
    """What ``json`` reads, with long lists of numbers as arrays: a text stands in place of each
    while it reads."""
    parser, kept, lists, at = simdjson.Parser(), list[bytes | bytearray](), list[Any](), 0
    while (start := text.find(b"[", at)) >= 0 and (end := text.find(b"]", start) + 1) > 0:
        found = _numbers(parser, text[start:end]) if end - start > _SHORT else None
        kept.append(
            text[at:end] if found is None else text[at:start] + b'"%b%d"' % (_TOKEN, len(lists))
        )
        lists += [] if found is None else [found]
        at = end
    given = decode(b"".join([*kept, text[at:]]), large=True)
    if isinstance(given, dict):
        token = _TOKEN.decode()
        for name, value in given.items():
            if isinstance(value, str) and value.startswith(token):
                given[name] = lists[int(value[len(token) :])]
    return given


def _numbers(parser: simdjson.Parser, text: bytearray) -> Any:
    """A list of numbers as an array; None for anything else, such as 1e400, which json reads."""
    with suppress(ValueError, TypeError, RuntimeError):
        found: Any = parser.parse(text)
        return np.frombuffer(found.as_buffer(of_type="d"))
    return None


_OPENS_LIST = re.compile(rb"\s*\[")
_BETWEEN = re.compile(rb"\}\s*,")


@cache
def _rows_of(names: tuple[str, ...]) -> Any:
    """What reads rows of numbers with these names."""
    kinds: Any = [(name, float | Literal["rigid"] if name == "k" else float) for name in names]
    row: Any = msgspec.defstruct("Row", kinds, forbid_unknown_fields=True, gc=False)
    return msgspec.json.Decoder(list[row])


def _quick_rows(text: bytearray, max_batch: int, kind: ContactKind) -> Columns | None:
    """Rows of numbers with the same names; None for any other text.

    The text is read piece by piece.  A piece that does not end between two rows is no JSON.
    """
    asked = asked_of((), kind)
    hertz = b'"f"' in text[:_SHORT]
    names = tuple("f" if hertz and name == "omega" else name for name in asked.fields)
    parts: list[Any] = []
    at = size = 0
    while at < len(text):
        cut = _BETWEEN.search(text, at + _READ)
        piece = (
            (b"[" if at else b"")
            + text[at : cut.start() + 1 if cut else None]
            + (b"]" if cut else b"")
        )
        try:
            rows = _rows_of(names).decode(piece)
        except (msgspec.MsgspecError, ValueError, RecursionError):
            return None
        if not rows or piece.count(b":") != len(names) * len(rows):  # a member twice
            return None
        size += len(rows)
        if size > max_batch:
            raise too_large(max_batch)
        values: Any = chain.from_iterable(map(astuple, rows))
        if b'"rigid"' in piece:
            values = (math.inf if value == "rigid" else value for value in values)
        parts.append(np.fromiter(values, np.float64).reshape(len(rows), -1).T)
        at = cut.end() if cut else len(text)
    six = np.concatenate(parts, axis=1)
    if hertz:
        with np.errstate(over="ignore"):  # infinite, which is refused
            six[names.index("f")] *= RAD_PER_CYCLE
    return Columns(size, list(six), hertz=hertz, rows=True, asked=asked)


def _rows(found: list[Any], max_batch: int, kind: ContactKind) -> Columns:
    """Rows one by one, all like the first; a bad row gets the first reason."""
    if len(found) > max_batch:
        raise too_large(max_batch)
    asked = asked_of(found[0] if found and isinstance(found[0], dict) else (), kind)
    fields, names = asked.fields, asked.names
    six = np.full((len(fields), len(found)), np.nan)
    reasons: dict[int, Reason] = {}
    for i, row in enumerate(found):
        if isinstance(row, dict):
            values, faults = checked(row, known=names, asked=asked)
            if not faults:
                six[:, i] = [values[name] for name in fields]
                continue
            fault = min(
                faults,
                key=lambda fault: names.index(fault.path[0]) if fault.path[0] in names else -1,
            )
            reason: Reason = str(fault.path[0])[:80], fault.reason
        else:
            reason = None, "must be an object"
        if len(reasons) < MAX_ERRORS:
            reasons[i] = reason
    return Columns(len(found), list(six), reasons, rows=True, asked=asked)


def dump(values: Any) -> bytes:
    """Write JSON; numbers that are not finite become null."""
    return orjson.dumps(values, option=orjson.OPT_SERIALIZE_NUMPY)


def write(batch: Batch) -> Iterator[bytes]:
    """An object of lists, or of the list of results, piece by piece."""
    return _write_rows(batch) if batch.columns.rows else _write_columns(batch)


def _write_columns(batch: Batch) -> Iterator[bytes]:
    slices = [found for found, _, _ in batch.slices(_ROWS)]
    form = _form(batch.wanted.parts, b"[\0]")
    for opening, part in zip(form, batch.wanted.parts, strict=False):
        for found in slices:
            yield opening + _values(part, found[part.path])
            opening = b","
    yield form[-1][:-1] + b"," + dump(batch.end)[1:]


def _write_rows(batch: Batch) -> Iterator[bytes]:
    row = b"%b".join(text.replace(b"%", b"%%") for text in _form(batch.wanted.parts, b"\0"))
    opening = b'{"results":['
    for found, source, _ in batch.slices(_ROWS):
        columns = [_values(part, found[part.path]).split(b",") for part in batch.wanted.parts]
        made = [row % cells for cells in zip(*columns, strict=True)] if source.size else []
        for i in np.flatnonzero(source < 0).tolist():
            made[i] = b"null"
        yield opening + b",".join(made)
        opening = b","
    yield b"]," + dump(batch.end)[1:]


def _form(parts: list[Part], place: bytes) -> list[bytes]:
    """What stands around the values of an answer; each ``place`` has a zero for a value."""
    text = dump(nested({part.path: "\0" for part in parts}))
    return text.replace(b'"\\u0000"', place).split(b"\0")


def _values(part: Part, column: Any) -> bytes:
    """The values of a column, separated by commas."""
    return dump(part.values(column) if part.names else column)[1:-1]


def _any_of(*names: str, **more: Any) -> dict[str, Any]:
    """The description of a text that is one of these models, or a list of one, whose name ends with
    ``[]``."""
    refs = [(name, {"$ref": f"#/components/schemas/{name.removesuffix('[]')}"}) for name in names]
    kinds = [{"type": "array", "items": ref} if name.endswith("[]") else ref for name, ref in refs]
    return {"schema": {"anyOf": kinds, **more}}


_MANY = {"example": {**example, "v0": [0.01, 0.1]}}
_LINE = "One of these per line, in the order of the lines"
FORMS = (
    Form(
        "application/json",
        (),
        read,
        write,
        body=_any_of("CaseColumns", "Case[]") | _MANY,
        answer=_any_of("ColumnsAnswer", "RowsAnswer"),
    ),
    Form(
        "application/x-ndjson",
        ("application/ndjson", "application/jsonl", "application/x-jsonlines"),
        read,
        write,
        body=_any_of("CaseColumns", "Case", "Case[]", description=_LINE) | _MANY,
        answer=_any_of("ColumnsAnswer", "RowsAnswer", "CaseAnswer", "Problem", description=_LINE),
        streams=True,
    ),
)

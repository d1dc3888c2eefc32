"""JSON in and out: columns, rows, and lines of either (NDJSON).

simdjson reads long lists of numbers into arrays, and msgspec reads rows of numbers, both piece by piece, so that
other threads run meanwhile.  Everything else, and whatever they refuse, is read by Python's ``json``, which gives
the reasons.
"""

import json
import math
import re
import secrets
from array import array
from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import chain
from operator import attrgetter
from typing import Any, Literal

import msgspec
import numpy as np
import orjson
import simdjson

from mumacro.contact import SPRING
from mumacro.contact import Kind as ContactKind
from mumacro.inputs import RAD_PER_CYCLE

from ..answers import Part, nested
from ..case import INPUTS, LIKE, MAX_ERRORS, Columns, Reason, asked_of, checked, columns_of, names_of, too_large
from ..options import OPTIONS, example, kind_in, options_of
from ..options import Options as OptionsModel
from ..problems import FieldFault, Kind, RequestError, refuse
from . import Batch, Form

__all__ = ["FORMS", "decode", "dump", "read"]

NAMES = (*INPUTS, *LIKE, "k_range", *OPTIONS)
_MEMBERS = 18  # of one object: the inputs and the options
_READ = 256 * 1024  # bytes of rows, or of a list, that are read at a time
_SHORT = 4096  # bytes of a list that json reads
_TOKEN = secrets.token_hex(16).encode()  # stands in place of a list; nobody else knows it
_ROWS, _CELLS = 8192, 65536  # rows, and entries of a column, that are written at a time


# --- reading ------------------------------------------------------------------------------------------


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        refuse([FieldFault.of(name, "is given more than once") for name in found if names.count(name) > 1])
    return found


def _whole(digits: str) -> int | float:
    return int(digits) if len(digits) < 4300 else float(digits)  # infinite, which is refused as a value


_DECODER = json.JSONDecoder(object_pairs_hook=_unique, parse_int=_whole)
# Numbers are read by functions of Python, so that other threads run meanwhile.
_PATIENT = json.JSONDecoder(object_pairs_hook=_unique, parse_int=_whole, parse_float=lambda digits: float(digits))


def decode(text: bytes | bytearray, large: bool = False) -> Any:
    """A JSON text as Python objects.  NaN and Infinity are read; their fields are refused later."""
    if not text:
        raise RequestError(Kind.MALFORMED_BODY, "the body is empty")
    if not large:
        with suppress(ValueError):
            quick = orjson.loads(text)
            # One colon for each member: none is named twice, and none stands in an object within.
            if type(quick) is dict and text.count(b":") == len(quick):
                return quick
    try:
        return (_PATIENT if large else _DECODER).decode(text.decode())
    except RecursionError:
        raise RequestError(Kind.MALFORMED_BODY, "the body is nested too deeply") from None
    except ValueError as error:
        raise RequestError(Kind.MALFORMED_BODY, f"the body is not JSON: {error}") from None


def read(text: bytearray, max_batch: int, query: Mapping[str, Any]) -> tuple[Columns, dict[str, Any]]:
    """The cases and the options of a body: columns or one case, or a list of rows."""
    _limit_values(text, max_batch)
    if bytes(text[:4096]).lstrip()[:1] == b"[":
        kind = kind_in(query)
        quick = None if kind.normal else _quick_rows(text, max_batch, kind)
        return quick or _rows(decode(text, large=True), max_batch, kind), {}
    given = _columns(text)
    if given is None:
        given = decode(text, large=True)
        if not isinstance(given, dict):
            refuse([FieldFault((), "must be an object of columns or a list of rows", given)])
    _, rest, faults = options_of(OptionsModel, given)
    options = {name: given[name] for name in OPTIONS if given.get(name) is not None}
    kind = kind_in({**query, **options}) if not faults else SPRING
    return columns_of(rest, max_batch, NAMES, faults, kind), options


def _limit_values(text: bytearray, max_batch: int) -> None:
    """Refuse a body that holds more values than a batch may have, before it is decoded.

    Every value but the first of its list or object has a comma before it, every list or object a bracket, every member
    of an object a colon.
    """
    room = max_batch + 64
    objects = text.count(b"{")
    if text.count(b",") > len(NAMES) * room or text.count(b"[") + objects > room:
        raise too_large(max_batch)
    if text.count(b":") > _MEMBERS * objects + 64:
        raise RequestError(Kind.INVALID_VALUE, "the body has objects with more members than there are fields")


def _columns(text: bytearray) -> dict[str, Any] | None:
    """An object whose long lists of numbers became arrays; None where a list holds a list, and where this is no JSON.

    Each long list is replaced by a text in what ``json`` reads, which finds names given twice and other faults.
    """
    kept, lists, at = list[bytes | bytearray](), list[Any](), 0
    while (start := text.find(b"[", at)) >= 0:
        end = text.find(b"]", start)
        if end - start > _SHORT:
            found = _numbers(text, start + 1, end)
            if found is None:
                return None
            kept += [text[at:start], b'"%b%d"' % (_TOKEN, len(lists))]
            lists.append(found)
            at = end + 1
        else:
            kept.append(text[at : start + 1])
            at = start + 1
    given = decode(b"".join([*kept, text[at:]]))
    if not isinstance(given, dict):
        return None
    token = _TOKEN.decode()
    for name, value in given.items():
        if isinstance(value, str) and value.startswith(token):
            given[name] = lists[int(value[len(token) :])]
    return given


def _numbers(text: bytearray, start: int, end: int) -> Any:
    """The list between two places, piece by piece: an array, or a list if it holds more than numbers; None: neither."""
    parser, parts, at = simdjson.Parser(), [], start
    while at <= end:
        cut = text.find(b",", at + _READ, end) if end - at > _READ else -1
        stop = end if cut < 0 else cut
        try:
            found: Any = parser.parse(b"[%b]" % bytes(text[at:stop]))
            parts.append(np.frombuffer(found.as_buffer(of_type="d")))
            del found
        except (ValueError, TypeError, RuntimeError):  # a word, a null, no number at all; 1e400, which json reads
            try:
                values = decode(b"[%b]" % bytes(text[start:end]), large=True)
            except RequestError:
                return None
            return None if any(isinstance(value, (list, dict)) for value in values) else values
        at = stop + 1
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


class _Row(msgspec.Struct, forbid_unknown_fields=True, gc=False):
    mu0: float
    Fz: float
    k: float | Literal["rigid"]
    y0: float
    v0: float
    omega: float | None = None
    f: float | None = None


_decode_rows = msgspec.json.Decoder(list[_Row]).decode
_BETWEEN = re.compile(rb"\}\s*,")


def _quick_rows(text: bytearray, max_batch: int, kind: ContactKind) -> Columns | None:
    """Rows of numbers with the same six names; None for any other text.

    The text is read piece by piece.  A piece that does not end between two objects is no JSON.
    """
    start, stop = text.find(b"[") + 1, text.rfind(b"]")
    parts: list[np.ndarray[Any, Any]] = []
    hertz: bool | None = None
    size = 0
    while start < stop:
        cut = _BETWEEN.search(text, start + _READ, stop)
        end = cut.start() + 1 if cut else stop
        try:
            rows = _decode_rows(b"[%b]" % bytes(text[start:end]))
        except (msgspec.MsgspecError, ValueError, RecursionError):
            return None
        colons = text.count(b":", start, end)
        start = cut.end() if cut else stop
        if not rows or colons != 6 * len(rows):  # a member twice, or null
            return None
        given_f = rows[0].f is not None
        if hertz is not None and hertz != given_f:
            return None
        hertz = given_f
        size += len(rows)
        if size > max_batch:
            raise too_large(max_batch)
        try:
            parts.append(_arrays(rows, "f" if given_f else "omega"))
        except TypeError:  # omega in one row, f in another
            return None
    if not text[: text.find(b"[")].strip() == b"" == text[stop + 1 :].strip() or not parts:
        return None
    six = np.concatenate(parts, axis=1)
    if hertz:
        with np.errstate(over="ignore"):
            six[4] *= RAD_PER_CYCLE
    return Columns(size, list(six), hertz=bool(hertz), rows=True, asked=asked_of((), kind))


def _arrays(rows: list[_Row], frequency: str) -> np.ndarray[Any, Any]:
    """The six columns of rows, (6, n)."""
    try:
        flat = array("d", chain.from_iterable(map(attrgetter("mu0", "Fz", "k", "y0", frequency, "v0"), rows)))
        return np.frombuffer(flat).reshape(len(rows), 6).T
    except TypeError:
        for row in rows:
            if row.k == "rigid":
                row.k = math.inf
        flat = array("d", chain.from_iterable(map(attrgetter("mu0", "Fz", "k", "y0", frequency, "v0"), rows)))
        return np.frombuffer(flat).reshape(len(rows), 6).T


def _rows(found: list[Any], max_batch: int, kind: ContactKind) -> Columns:
    """Rows one by one, all like the first; a bad row gets the first reason."""
    if len(found) > max_batch:
        raise too_large(max_batch)
    asked = asked_of(found[0] if found and isinstance(found[0], dict) else (), kind)
    fields, names = asked.fields, names_of(asked)
    six = np.full((len(fields), len(found)), np.nan)
    reasons: dict[int, Reason] = {}
    for i, row in enumerate(found):
        if isinstance(row, dict):
            values, faults = checked(row, null_is_rigid=False, known=names, asked=asked)
            if not faults:
                six[:, i] = [values[name] for name in fields]
                continue
            fault = min(faults, key=lambda fault: names.index(fault.path[0]) if fault.path[0] in names else -1)
            reason: Reason = str(fault.path[0])[:80], fault.reason
        else:
            reason = None, "must be an object"
        if len(reasons) < MAX_ERRORS:
            reasons[i] = reason
    return Columns(len(found), list(six), reasons, rows=True, asked=asked)


# --- writing ------------------------------------------------------------------------------------------


def dump(values: Any) -> bytes:
    """Write JSON; numbers that are not finite become null."""
    return orjson.dumps(values, option=orjson.OPT_SERIALIZE_NUMPY)


def write(batch: Batch) -> Iterator[bytes]:
    """An object of lists, or of the list of results, piece by piece."""
    return _write_rows(batch) if batch.columns.rows else _write_columns(batch)


def _write_columns(batch: Batch) -> Iterator[bytes]:
    size = batch.columns.size
    whole = {part: np.empty(size, np.int8 if part.names else np.float64) for part in batch.parts}
    for start, found, source in batch.slices(_ROWS):
        for part, column in whole.items():
            column[start : start + source.size] = found[part.path]
    form, parts = _form(batch, b"[\0]")
    for opening, part in zip(form, parts, strict=False):
        yield opening
        for start in range(0, size, _CELLS):
            text = _texts(part, whole[part][start : start + _CELLS])
            yield b"," + text if start else text
    yield form[-1][:-1] + b"," + dump(batch.end)[1:]


def _write_rows(batch: Batch) -> Iterator[bytes]:
    form, parts = _form(batch, b"\0")
    row = b"%b".join(text.replace(b"%", b"%%") for text in form)
    opening = b'{"results":['
    for _, found, source in batch.slices(_ROWS):
        columns = [_texts(part, found[part.path]).split(b",") for part in parts]
        made = [row % cells for cells in zip(*columns, strict=True)] if source.size else []
        for i in np.flatnonzero(source < 0).tolist():
            made[i] = b"null"
        yield opening + b",".join(made)
        opening = b","
    yield b"]," + dump(batch.end)[1:]


def _form(batch: Batch, place: bytes) -> tuple[list[bytes], list[Part]]:
    """What stands around the values of an answer, and their columns in order; each ``place`` has a zero for a value."""
    parts = {part.path: part for part in batch.parts}
    shape = nested({path: path for path in parts})
    order = [path for inner in shape.values() for path in (inner.values() if isinstance(inner, dict) else [inner])]
    text = dump(nested(dict.fromkeys(order, "\0"))).replace(b'"\\u0000"', place)
    return text.split(b"\0"), [parts[path] for path in order]


def _texts(part: Part, column: Any) -> bytes:
    """The values of a column, separated by commas."""
    if part.names:
        # numpy fills texts up with zeros to one width, and copies equal widths faster than objects
        texts = np.array([orjson.dumps(name) + b"," for name in (*part.names, None)])
        return bytes(texts.take(column).tobytes().translate(None, b"\0")[:-1])
    return dump(column)[1:-1]


def _refs(*names: str) -> list[dict[str, Any]]:
    return [{"$ref": f"#/components/schemas/{name}"} for name in names]


_LIST = {"type": "array", "items": _refs("Case")[0]}
FORMS = (
    Form(
        "application/json",
        (),
        read,
        write,
        body={"schema": {"oneOf": [*_refs("CaseColumns"), _LIST]}, "example": {**example, "v0": [0.01, 0.1]}},
        answer={"schema": {"oneOf": _refs("ColumnsAnswer", "RowsAnswer")}},
    ),
    Form(
        "application/x-ndjson",
        ("application/ndjson", "application/jsonl", "application/x-jsonlines"),
        read,
        write,
        body={
            "schema": {"anyOf": [*_refs("CaseColumns", "Case"), _LIST], "description": "One of these per line"},
            "example": {**example, "v0": [0.01, 0.1]},
        },
        answer={
            "schema": {
                "anyOf": _refs("ColumnsAnswer", "RowsAnswer", "CaseAnswer", "Problem"),
                "description": "One of these per line, in the order of the lines",
            }
        },
        streams=True,
    ),
)

"""JSON in and out: columns, rows, and lines of either (NDJSON).

Long lists of numbers and rows are read by orjson piece by piece, so that other threads run
meanwhile.  Everything else, and whatever it refuses, is read by Python's ``json``, which gives the
reasons.
"""

import math
import re
import secrets
from collections.abc import Iterator
from contextlib import suppress
from itertools import chain
from operator import itemgetter
from typing import Any

import numpy as np
import orjson
from pydantic import ValidationError

from mumacro.errors import InputError
from mumacro.inputs.cases import by_name, columns_of
from mumacro.inputs.fields import is_rigid
from mumacro.inputs.k_range import ENDS
from mumacro.inputs.kind import Kind

from ..batch import Batch, Body, Form, Reason, too_large
from ..included import REGIME_OF, SOURCES, Outputs, names_of, nested
from ..models.inputs import EXAMPLE, MAX_REASONS, Case
from ..models.options import BatchOptions, CaseColumns
from ..problems import FieldFault, ProblemKind, RequestError, faults_of, reason_of, refuse
from ..reading import decode, dump

_NAMES = (*CaseColumns.model_fields,)
_READ = 256 * 1024  # bytes of rows that are read at a time
_TOKEN = secrets.token_hex(16).encode()  # stands in place of a list; nobody else knows it
_SHORT = 4096  # bytes of a list that json reads
_ROWS = 8192  # cases that are written at a time
_OPENS_LIST = re.compile(rb"\s*\[")
_BETWEEN = re.compile(rb"\}\s*,")


def read(text: bytearray, max_batch: int, options: BatchOptions) -> Body:
    """The cases and the options of a body: columns or one case, or a list of rows."""
    if opening := _OPENS_LIST.match(text):
        if body := _quick_rows(text, opening.end(), max_batch, options.kind):
            return body
        _limit_values(text, max_batch)
        rows = decode(text, large=True)
        if len(rows) > max_batch:
            raise too_large(max_batch)
        return _one_by_one(rows, options.kind)
    _limit_values(text, max_batch)
    members = _members(text)
    if not isinstance(members, dict):
        refuse([FieldFault((), "must be an object of columns or a list of rows", members)])
    return Body(members)


def _limit_values(text: bytearray, max_batch: int) -> None:
    """Refuse a body that holds more values than a batch may have, before it is decoded.

    Every value but the first of its list or object has a comma before it, every list or object a
    bracket, every member of an object a colon.
    """
    room = max_batch + 64
    objects = _count(text, b"{")
    if _count(text, b",") > len(_NAMES) * room or _count(text, b"[") + objects > room:
        raise too_large(max_batch)
    if _count(text, b":") > len(_NAMES) * objects + 64:
        raise RequestError(
            ProblemKind.INVALID_VALUE,
            "the body has objects with more members than there are fields",
        )


def _count(text: bytes | bytearray, character: bytes) -> int:
    """How often a character stands in a text; ``text.count`` takes longer where it often does."""
    codes = np.frombuffer(text, np.uint8)
    parts = (codes[i : i + _READ] for i in range(0, codes.size, _READ))
    return sum(int(np.count_nonzero(part == character[0])) for part in parts)


# --- columns --------------------------------------------------------------------------------------


def _members(text: bytearray) -> Any:
    """What ``json`` reads, with long lists of numbers by orjson: a text stands in place of each
    while it reads."""
    pieces, lists, at = list[bytes | bytearray](), list[Any](), 0
    while (start := text.find(b"[", at)) >= 0 and (end := text.find(b"]", start) + 1) > 0:
        numbers = _list(text[start:end]) if end - start > _SHORT else None
        pieces.append(
            text[at:end] if numbers is None else text[at:start] + b'"%b%d"' % (_TOKEN, len(lists))
        )
        lists += [] if numbers is None else [numbers]
        at = end
    members = decode(b"".join([*pieces, text[at:]]), large=True)
    if isinstance(members, dict):
        token = _TOKEN.decode()
        for name, value in members.items():
            if isinstance(value, str) and value.startswith(token):
                members[name] = lists[int(value[len(token) :])]
    return members


def _list(text: bytearray) -> Any:
    """A list of finite numbers as an array; a list of anything else as it is; None for what orjson
    refuses, such as 1e400."""
    with suppress(ValueError):
        values = orjson.loads(text)
        if {*map(type, values)} <= {float, int}:
            with suppress(OverflowError):
                return np.array(values, np.float64)
    return None


# --- rows -----------------------------------------------------------------------------------------


def _quick_rows(text: bytearray, at: int, max_batch: int, kind: Kind) -> Body | None:
    """Rows of numbers with the same names as columns, from their first character on; None for any
    other text.

    The text is read piece by piece.  A piece that does not end between two rows is no JSON.
    """
    names: tuple[str, ...] = ()
    values_of: Any = None
    blocks: list[Any] = []
    size = 0
    while at < len(text):
        cut = _BETWEEN.search(text, at + _READ, at + 2 * _READ)
        end = cut.start() + 1 if cut else len(text)
        if end - at > 2 * _READ:
            return None
        piece = b"".join((b"[", memoryview(text)[at:end], b"]" if cut else b""))
        try:
            rows = orjson.loads(piece)
            if not names:
                names = _names_of(rows[0], kind)
                values_of = itemgetter(*names)
            members = len(names) * len(rows)
            # Every row has all names, or values_of fails.  Two quotes for each: no other member,
            # none twice, and no words.
            words = _count(piece, b'"') != 2 * members
            if words and _count(piece, b":") != members:
                return None
            values: Iterator[Any] = chain.from_iterable(map(values_of, rows))
            # true and false: no name has one of these letters
            if words or b"r" in piece or b"s" in piece:
                values = iter(_checked(list(values), names))
            blocks.append(np.fromiter(values, np.float64, members).reshape(len(rows), -1))
        except (ValueError, TypeError, LookupError, InputError):
            return None
        size += len(rows)
        if size > max_batch:
            raise too_large(max_batch)
        at = cut.end() if cut else len(text)
    if not blocks:
        return None
    columns = np.concatenate(blocks).T.copy()  # each as one piece of memory
    return Body(dict(zip(names, columns, strict=True)), rows=True)


def _names_of(row: dict[str, Any], kind: Kind) -> tuple[str, ...]:
    """The names of a row, if they make a case; else InputError."""
    columns_of(_with_k(by_name(None, dict.fromkeys(row, 1.0), kind)), kind)
    if unknown := {*row} - {*kind.columns, *ENDS}:
        raise InputError(min(unknown), None, "the name of an input")
    return tuple(row)


def _checked(values: list[Any], names: tuple[str, ...]) -> list[float]:
    """The values of rows, infinite where k is the word rigid; TypeError where one is no number."""
    if "k" in names:
        for i in range(names.index("k"), len(values), len(names)):
            if isinstance(values[i], str) and is_rigid(values[i]):
                values[i] = math.inf
    if not {*map(type, values)} <= {float, int}:
        raise TypeError(names)
    return values


def _with_k(inputs: dict[str, Any]) -> dict[str, Any]:
    return {**inputs, "k": 1.0} if "k_low" in inputs else inputs


def _one_by_one(rows: list[Any], kind: Kind) -> Body:
    """Rows one by one: each is checked as one case, and a bad one gets its first reason."""
    interval = any(isinstance(row, dict) and _interval_in(row) for row in rows)
    fields = [end for name in kind.fields for end in _ends(name, interval)]
    columns = {name: np.full(len(rows), np.nan) for name in fields}
    reasons: dict[int, Reason] = {}
    for i, row in enumerate(rows):
        try:
            inputs = _with_k(by_name(None, _case(row).inputs, kind))
            six = columns_of(inputs, kind) | {name: inputs[name] for name in ENDS if name in inputs}
            for name in fields:
                columns[name][i] = six[name] if name in six else six["k"]
        except (ValidationError, InputError) as error:
            if len(reasons) < MAX_REASONS:
                reasons[i] = _first(error)
    return Body(dict(columns), reasons, rows=True)


def _interval_in(row: dict[str, Any]) -> bool:
    return not row.keys().isdisjoint(("k_range", *ENDS))


def _ends(name: str, interval: bool) -> tuple[str, ...]:
    return ENDS if interval and name == "k" else (name,)


def _case(row: Any) -> Case:
    if not isinstance(row, dict):
        raise InputError("", row, "an object")
    return Case.model_validate(row)


def _first(error: ValidationError | InputError) -> Reason:
    """The first fault of a row, in the order of the inputs."""
    if isinstance(error, InputError):
        return (str(error.field) or None), reason_of(error)
    faults = faults_of(error.errors(include_url=False), Case.model_fields)
    order = list(Case.model_fields)
    fault = min(faults, key=lambda one: order.index(one.path[0]) if one.path[0] in order else -1)
    return str(fault.path[0])[:80], fault.reason


# --- answers --------------------------------------------------------------------------------------


def write(batch: Batch) -> Iterator[bytes]:
    """An object of lists, or of the list of results, piece by piece."""
    return _write_rows(batch) if batch.rows else _write_columns(batch)


def _write_columns(batch: Batch) -> Iterator[bytes]:
    slices = [outputs for outputs, _, _ in batch.slices(_ROWS)]
    frame = _around(slices[0])
    for opening, path in zip(frame, slices[0], strict=False):
        for outputs in slices:
            yield opening + _values(path, outputs[path])
            opening = b","
    yield frame[-1][:-1] + b"," + dump(batch.end)[1:]


def _write_rows(batch: Batch) -> Iterator[bytes]:
    opening, patterns = b'{"results":[', {-1: b"null"}  # by code
    for outputs, codes, _ in batch.slices(_ROWS):
        sources = codes.tolist()
        for code in {*sources} - patterns.keys():
            patterns[code] = _pattern(outputs, code)
        pattern = b",".join(map(patterns.__getitem__, sources))
        columns = [column for path, column in outputs.items() if path not in _WORDS]
        numbers = np.column_stack(columns)[codes >= 0].ravel()
        yield opening
        yield pattern % (*dump(numbers)[1:-1].split(b","),) if numbers.size else pattern
        opening = b","
    yield b"]," + dump(batch.end)[1:]


def _pattern(outputs: Outputs, code: int) -> bytes:
    """A row of this source, with a place for each number."""
    words = {path: _WORDS[path][code] if path in _WORDS else "\0" for path in outputs}
    return dump(nested(words)).replace(b"%", b"%%").replace(_PLACE, b"%b")


def _around(outputs: Outputs) -> list[bytes]:
    """What stands around the lists of an answer."""
    text = dump(nested(dict.fromkeys(outputs, "\0")))
    return text.replace(_PLACE, b"[\0]").split(b"\0")


_PLACE = dump("\0")
_WORDS = {"regime": REGIME_OF, "source": SOURCES}  # by code


def _values(path: str, column: Any) -> bytes:
    """The values of a column, separated by commas."""
    return dump(names_of(path, column) if path in _WORDS else column)[1:-1]


# --- forms ----------------------------------------------------------------------------------------


def _any_of(*names: str, **more: Any) -> dict[str, Any]:
    """The description of a text that is one of these models, or a list of one, whose name ends with
    ``[]``."""
    refs = [(name, {"$ref": f"#/components/schemas/{name.removesuffix('[]')}"}) for name in names]
    kinds = [{"type": "array", "items": ref} if name.endswith("[]") else ref for name, ref in refs]
    return {"schema": {"anyOf": kinds, **more}}


_MANY = {"example": {**EXAMPLE, "v0": [0.01, 0.1]}}
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
        body=_any_of("CaseColumns", "CaseRequest", "Case[]", description=_LINE) | _MANY,
        answer=_any_of("ColumnsAnswer", "RowsAnswer", "CaseAnswer", "Problem", description=_LINE),
        streams=True,
    ),
)

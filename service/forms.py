"""Convert the body of a batch, columns or rows, to columns, and the answers to JSON, piece by
piece.

The cost of a body is estimated before it is decoded: every value except the first of its list or
object follows a comma, and every list or object has a bracket.
"""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache, partial
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.cases import ALL_FIELDS, DEVIATIONS, KIND, Cases, named
from mumacro.inputs.fields import (
    AMPLITUDE,
    CONTACTS,
    DIRECTIONS,
    ENDS,
    FIELDS,
    SPRING,
    field_of,
    kind_of,
)
from mumacro.inputs.names import unknown_name
from mumacro.kernel.stopping import look
from mumacro.outputs.answer import TEXTS, Answer, nested

from .json_text import NotRead, count, decode_batch, decode_columns, decode_rows, dump
from .models.inputs import INPUTS, MAX_REASONS, entry
from .models.options import Case, CaseColumns
from .problems import FieldFault, ProblemKind, RequestError, reason_of, refuse

MORE_CASES = "send several requests, or give `mumacro eval` a file, or use Dask"
SLICE = 8192  # number of cases that are computed and written at a time
_NUMBERS = (*INPUTS, *DEVIATIONS)  # members that hold numbers
_WORDS = {"contact": CONTACTS, "direction": DIRECTIONS}  # members that hold words, and which words
_REST = tuple(name for name in CaseColumns.model_fields if name not in _NUMBERS)
_KNOWN = len(CaseColumns.model_fields)  # number of names that a case or its columns may have
_OPENS_LIST = re.compile(rb"[ \t\r\n]*\[")


class Reason(NamedTuple):
    """Say why a row is not a case."""

    field: str | None  #: the bad field; None if the whole case is bad
    text: str  #: empty for an unknown name that is not listed: its advice takes long to find


class Body(NamedTuple):
    """Hold the content of a body."""

    #: inputs by name (one value, a list, or an array of numbers) and options
    members: dict[str, Any]
    #: the reason for each case that could not be read, by its index; such a case has a NaN
    reasons: Mapping[int, Reason] = MappingProxyType({})
    rows: bool = False


def too_large(max_batch: int) -> RequestError:
    """Return the error for a batch with more cases than the settings allow."""
    return RequestError(
        ProblemKind.BATCH_TOO_LARGE,
        f"a batch may have up to {max_batch} cases, this one has more: {MORE_CASES}",
        max_batch=max_batch,
    )


def read(text: bytearray, max_batch: int, words: Mapping[str, Any]) -> Body:
    """Return the cases and the options of a body: an object of columns, or a list of rows.
    ``words`` are contact, direction and deviations, if the query gives them for all rows."""
    most, objects = max_batch + 64, count(text, b"{")
    brackets = count(text, b"[")
    if max(objects, brackets) > most or count(text, b",") > _KNOWN * most:
        raise too_large(max_batch)
    try:
        if not _OPENS_LIST.match(text):
            return Body(decode_columns(text, _NUMBERS, _REST))
        columns = decode_rows(text, _NUMBERS, _WORDS)
        kind = (columns[name][0] if name in columns else None for name in KIND)
        if not isinstance(_targets_of(words, (*columns,), *kind), Reason):
            return Body(columns, rows=True)
        values = decode_batch(text)  # each row gets the reason
    except NotRead:
        if count(text, b":") > _KNOWN * objects + 64:
            detail = "the body has objects with more members than there are fields"
            raise RequestError(ProblemKind.INVALID_VALUE, detail) from None
        values = decode_batch(text)
    if isinstance(values, list):
        if len(values) > max_batch:
            raise too_large(max_batch)
        return _one_by_one(values, words)
    if not isinstance(values, dict):
        refuse([FieldFault((), "must be an object of columns or a list of rows", values)])
    return Body(values)


def _one_by_one(rows: list[Any], words: Mapping[str, Any]) -> Body:
    """Read rows one by one; a bad row gets its first reason.

    The columns for its numbers, or the reason why it is not a case, are found once for all rows
    with the same names.  The library checks later whether the numbers are valid together.
    """
    columns: dict[str, Any] = {name: np.full(len(rows), np.nan) for name in (*ALL_FIELDS, *ENDS)}
    columns |= {name: np.zeros(len(rows)) for name in DEVIATIONS}
    usual = {name: words.get(name, word) for name, word in SPRING.names.items()}
    used = set[str]()
    words_of: dict[str, dict[str, None]] = {name: {} for name in KIND if name not in words}
    targets_of = lru_cache(maxsize=64)(partial(_targets_of, words))
    reasons: dict[int, Reason] = {}
    for i, row in enumerate(rows):
        look()
        numbers = _numbers_in(row, targets_of)
        if isinstance(numbers, Reason):
            if len(reasons) < MAX_REASONS:
                name, text = numbers
                reasons[i] = Reason(name, text or unknown_name(name or "", Case.model_fields))
            continue
        for name, number in numbers.items():
            columns[name][i] = number
        used |= numbers.keys()
        for name, found in words_of.items():
            found[row.get(name) or usual[name]] = None
    if {*ENDS} <= used:  # one number is an interval of itself
        alone = np.isnan(columns["k_low"])
        for name in ENDS:
            columns[name][alone] = columns["k"][alone]
        for i in np.flatnonzero(columns["k"] == math.inf).tolist():
            reasons.setdefault(i, Reason("k", "must be finite beside rows with an interval of k"))
    normal = AMPLITUDE in used or usual["direction"] == DIRECTIONS[-1]
    fields = kind_of(direction=DIRECTIONS[-1]).fields if normal else FIELDS
    names = [name for name in fields if name != "k"] + [*(ENDS if {*ENDS} <= used else ("k",))]
    members = {name: columns[name] for name in names}
    members |= {name: [*found] for name, found in words_of.items() if {*found} - {usual[name]}}
    members |= {name: columns[name] for name in DEVIATIONS if name in used}
    return Body(members, reasons, True)


#: by the name of a row's member: the column of its value, and the scale of its unit there
_Targets = dict[str, tuple[str, float]]


def _targets_of(
    words: Mapping[str, Any], names: tuple[str, ...], contact: str | None, direction: str | None
) -> _Targets | Reason:
    """Return the columns for the numbers of a row with these names, or the reason why the names do
    not form a case."""
    known = Case.model_fields
    for name in names:
        if name not in known:
            shown = name[:80].encode("utf-8", "replace").decode()  # half of a surrogate pair
            return Reason(shown, "")
    for name, about in known.items():
        if about.is_required() and name not in names:
            return Reason(name, "is required")
    numbers = [name for name in known if name in names and name not in KIND]
    case: dict[str, Any] = {name: 0.5 if name == AMPLITUDE else 1.0 for name in numbers}
    case |= {name: x for name, x in zip(KIND, (contact, direction), strict=True) if x is not None}
    targets = {}
    try:
        if twice := case.keys() & words.keys():
            raise InputError(min(twice), None, "left out: it is given in the query")
        Cases.of(named(None, {**words, **case}))
    except InputError as error:
        return Reason(error.field or None, reason_of(error))
    for name in numbers:
        field, unit = field_of(DEVIATIONS.get(name, name))
        targets[name] = (f"std_{field}" if name in DEVIATIONS else field), unit
    return targets


def _numbers_in(
    row: Any, targets_of: Callable[..., _Targets | Reason]
) -> dict[str, float] | Reason:
    """Return the numbers of a row by column, or the first fault of its names and numbers."""
    if not isinstance(row, dict):
        return Reason(None, "must be an object")
    if None in row.values():  # a null means left out, except in k, where it may mean rigid
        row = {name: x for name, x in row.items() if x is not None or name == "k"}
    kind = (x if x is None or isinstance(x, str) else "" for x in map(row.get, KIND))
    targets = targets_of(tuple(row), *kind)
    if isinstance(targets, Reason):
        if not targets.text:  # an unknown name
            return targets
        # as for one case, a bad value is told before a fault between names
        reasons = ((name, entry(name, x)[1]) for name, x in row.items() if name in _NUMBERS)
        return next((Reason(name, text) for name, text in reasons if text), targets)
    numbers = {}
    for name, (column, unit) in targets.items():
        number, reason = entry(name, row[name])
        if reason is not None:
            return Reason(name, reason)
        numbers[column] = unit * number
    return numbers


# --- answers --------------------------------------------------------------------------------------


def write_columns(answers: Iterable[Answer[Any]]) -> Iterator[bytes]:
    """Yield an object of lists, piece by piece, without its closing brace."""
    parts = [*answers]
    yield from _object(nested({path: [part[path] for part in parts] for path in parts[0].paths}))


def _object(tree: Mapping[str, Any]) -> Iterator[bytes]:
    opening = b"{"
    for name, value in tree.items():
        yield opening + dump(name) + b":"
        opening = b","
        if isinstance(value, dict):
            yield from _object(value)
            yield b"}"
        else:
            yield from _array(name, value)


def _array(name: str, parts: Iterable[Any]) -> Iterator[bytes]:
    opening = b"["
    for part in parts:
        yield opening + dump(listed(name, part) if name in TEXTS else part)[1:-1]
        opening = b","
    yield b"]"


def write_rows(answers: Iterable[Answer[Any]]) -> Iterator[bytes]:
    """Yield an object with the list ``results`` (null for a bad case), without its closing
    brace."""
    # by source code: a row with a place for each number
    opening, rows = b'{"results":[', {-1: b"null"}
    for answer in answers:
        codes = answer.source_code.tolist()
        if new := {*codes} - rows.keys():
            columns = {path: answer[path] if path in TEXTS else None for path in answer.paths}
            rows |= {code: _row_of(columns, codes.index(code)) for code in new}
        numbers = [answer[path] for path in answer.paths if path not in TEXTS]
        legal = np.column_stack(numbers)[answer.source_code >= 0].ravel()
        text = b",".join(map(rows.__getitem__, codes))
        yield opening + (text % (*dump(legal)[1:-1].split(b","),) if legal.size else text)
        opening = b","
    yield b"]"


def _row_of(columns: Mapping[str, Any], index: int) -> bytes:
    """Return the row of a case as text, with a place for each number.  The source determines the
    words."""
    words = {path: "\0" if column is None else column[index] for path, column in columns.items()}
    return dump(nested(words)).replace(b"%", b"%%").replace(dump("\0"), b"%b")


def listed(path: str, column: Any) -> list[Any]:
    """Return a column as JSON lists it: NaN and an empty text are written as null."""
    values: list[Any] = column.tolist()
    return [value or None for value in values] if path in TEXTS and "" in values else values

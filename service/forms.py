"""A batch: its body, columns or rows, becomes columns; the answers become JSON, piece by piece.

A body is weighed before it is decoded: every value but the first of its list or object has a comma
before it, every list or object a bracket.
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from mumacro.answer import TEXTS, Answer, nested
from mumacro.errors import InputError
from mumacro.inputs.cases import ALL_FIELDS, DEVIATIONS, KIND, Cases, named
from mumacro.inputs.fields import AMPLITUDE, DIRECTIONS, ENDS, FIELDS, SPRING, field_of, kind_of
from mumacro.stopping import look

from .json_text import NotRead, count, decode_batch, decode_columns, decode_rows, dump
from .models.inputs import INPUTS, MAX_REASONS
from .models.options import Case, CaseColumns
from .problems import FieldFault, ProblemKind, RequestError, faults_of, reason_of, refuse

#: the bad field, or None for the case as a whole, and why
Reason = tuple[str | None, str]

MORE_CASES = "send several requests, or give `mumacro eval` a file, or use Dask"
SLICE = 8192  # cases that are computed and written at a time
_NUMBERS = (*INPUTS, *DEVIATIONS)  # members that hold numbers
_REST = tuple(name for name in CaseColumns.model_fields if name not in _NUMBERS)
_KNOWN = len(CaseColumns.model_fields)  # number of names that a case or its columns may have
_OPENS_LIST = re.compile(rb"[ \t\r\n]*\[")


class Body(NamedTuple):
    """What a body holds."""

    #: inputs by name: one value, a list, or an array of numbers; and options
    members: dict[str, Any]
    #: why cases could not be read, by their index; they have a NaN
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
    """Return the cases and the options of a body: an object of columns, or a list of rows;
    ``words`` are contact, direction and deviations, where the query gives them for all rows."""
    most, objects = max_batch + 64, count(text, b"{")
    brackets = count(text, b"[")
    if max(objects, brackets) > most or count(text, b",") > _KNOWN * most:
        raise too_large(max_batch)
    try:
        if not _OPENS_LIST.match(text):
            return Body(decode_columns(text, _NUMBERS, _REST))
        columns = decode_rows(text, _NUMBERS, KIND)
        _check_names(columns, words)
        return Body(columns, rows=True)
    except (*NotRead, InputError):
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


def _check_names(columns: Mapping[str, Any], words: Mapping[str, Any]) -> None:
    """Raise InputError where the names of rows make no case."""
    ones = {name: column[:1] if name in KIND else np.ones(2) for name, column in columns.items()}
    Cases.of(named(None, {**ones, **words}))


def _one_by_one(rows: list[Any], words: Mapping[str, Any]) -> Body:
    """Return rows one by one: each is checked as one case, and a bad one gets its first reason."""
    columns: dict[str, Any] = {name: np.full(len(rows), np.nan) for name in (*ALL_FIELDS, *ENDS)}
    columns |= {name: np.zeros(len(rows)) for name in DEVIATIONS}
    usual = {name: words.get(name, word) for name, word in SPRING.names.items()}
    of_kind: dict[str, list[str]] = {name: [] for name in KIND if name not in words}
    in_query = {field_of(DEVIATIONS[name])[0] for name in words.keys() & DEVIATIONS.keys()}
    reasons: dict[int, Reason] = {}
    used = set[str]()
    for i, row in enumerate(rows):
        look()
        try:
            values = _row(row).values
            if twice := values.keys() & words.keys():
                raise InputError(min(twice), None, "left out: it is given in the query")
            one = Cases.of(named(None, {**words, **values}))
        except (ValidationError, InputError) as error:
            if len(reasons) < MAX_REASONS:
                reasons[i] = _first(error)
            continue
        k = one.columns["k"]
        ends: Any = one.ends or (k, k)  # a number is an interval of itself
        filled = {**dict(zip(ENDS, ends, strict=True)), **one.columns}
        filled |= {f"std_{name}": x for name, x in one.std.items() if name not in in_query}
        for name, column in of_kind.items():
            column.append(values.get(name, usual[name]))
        for name, value in filled.items():
            columns[name][i] = value
        used |= {name for name in filled if name not in ENDS} | ({*ENDS} if one.ends else set())
    normal = AMPLITUDE in used or usual["direction"] == DIRECTIONS[-1]
    fields = kind_of(direction=DIRECTIONS[-1]).fields if normal else FIELDS
    names = [name for name in fields if name != "k"] + [*(ENDS if {*ENDS} <= used else ("k",))]
    if {*ENDS} <= used:
        for i in np.flatnonzero(columns["k"] == math.inf).tolist():
            reasons.setdefault(i, ("k", "must be finite beside rows with an interval of k"))
    members = {name: columns[name] for name in names}
    members |= {name: each for name, each in of_kind.items() if {*each} - {usual[name]}}
    members |= {name: columns[name] for name in DEVIATIONS if name in used}
    return Body(members, reasons, True)


def _row(row: Any) -> Case:
    if not isinstance(row, dict):
        raise InputError("", row, "an object")
    return Case.model_validate(row)


def _first(error: ValidationError | InputError) -> Reason:
    """Return the first fault of a row, in the order of the inputs."""
    if isinstance(error, InputError):
        return (str(error.field) or None), reason_of(error)
    faults = faults_of(error.errors(include_url=False), Case.model_fields)
    order = list(Case.model_fields)
    places = [(one.path[0] if one.path else "", one.reason) for one in faults]
    name, reason = min(places, key=lambda one: order.index(one[0]) if one[0] in order else -1)
    return str(name)[:80] or None, reason


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
    """Yield an object with the list ``results``, null for a bad case, without its closing brace."""
    opening, rows = b'{"results":[', {-1: b"null"}  # by source code: a row with places for numbers
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
    """Return the row of a case as text, with a place for each number: the words follow from the
    source."""
    words = {path: "\0" if column is None else column[index] for path, column in columns.items()}
    return dump(nested(words)).replace(b"%", b"%%").replace(dump("\0"), b"%b")


def listed(path: str, column: Any) -> list[Any]:
    """Return a column as JSON lists it: NaN is written as null, and so is no text."""
    values: list[Any] = column.tolist()
    return [value or None for value in values] if path in TEXTS and "" in values else values

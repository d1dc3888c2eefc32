"""JSON of a batch: its body, columns or rows, becomes columns; the answers become JSON again.

orjson and msgspec read JSON fast, but no other thread runs meanwhile.  Long lists are therefore
read slice by slice, and written so.  What they refuse, or what is shaped in another way, is left to
Python's ``json``: that is slow, lets other threads run, and gives the reason.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sized
from contextlib import suppress
from functools import lru_cache
from itertools import chain
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

import msgspec
import numpy as np
import orjson
from pydantic import ValidationError

from mumacro.answer import TEXTS, Answer, nested
from mumacro.errors import InputError
from mumacro.inputs.cases import ALL_FIELDS, DEVIATIONS, KIND, Cases, named
from mumacro.inputs.fields import ENDS, FIELDS, field_of
from mumacro.inputs.kind import AMPLITUDE, DIRECTIONS, SPRING, kind_of
from mumacro.inputs.reading import Value
from mumacro.stopping import look

from .models.inputs import MAX_REASONS
from .models.options import Case, CaseColumns
from .problems import FieldFault, ProblemKind, RequestError, faults_of, reason_of, refuse
from .reading import decode, dump, loads

_Values = TypeVar("_Values", bound=Sized)
#: the bad field, or None for the case as a whole, and why
Reason = tuple[str | None, str]

MORE_CASES = "send several requests, or give `mumacro eval` a file, or use Dask"
SLICE = 8192  # cases that are computed and written at a time
_READ = 256 * 1024  # bytes of a list that are read at a time
_KNOWN = len(CaseColumns.model_fields)  # number of names that a case or its columns may have


class Body(NamedTuple):
    """What a body holds."""

    #: inputs by name: one value, a list, or an array of finite numbers; and options
    members: dict[str, Any]
    #: why cases could not be read, by their index; they have a NaN
    reasons: Mapping[int, Reason] = MappingProxyType({})
    rows: bool = False


def too_large(max_batch: int) -> RequestError:
    """The error for a batch with more cases than the settings allow."""
    return RequestError(
        ProblemKind.BATCH_TOO_LARGE,
        f"a batch may have up to {max_batch} cases, this one has more: {MORE_CASES}",
        max_batch=max_batch,
    )


def read(text: bytearray, max_batch: int, words: Mapping[str, Any]) -> Body:
    """The cases and the options of a body: an object of columns, or a list of rows; ``words`` are
    contact, direction and deviations, where the query gives them for all rows."""
    try:
        if _OPENS_LIST.match(text):
            return Body(_columns_of(text, max_batch, words), rows=True)
        return Body(dict(_members(text, max_batch)))
    except (ValueError, InputError):
        values = _slowly(text, max_batch)
    if isinstance(values, list):
        return _one_by_one(values, words)
    if not isinstance(values, dict):
        refuse([FieldFault((), "must be an object of columns or a list of rows", values)])
    return Body(values)


def _slowly(text: bytearray, max_batch: int) -> Any:
    """What Python's ``json`` reads, unless it holds more values than a batch may have.

    Every value but the first of its list or object has a comma before it, every list or object a
    bracket, every member of an object a colon.
    """
    most = max_batch + 64
    objects = _count(text, b"{")
    if _count(text, b",") > _KNOWN * most or _count(text, b"[") + objects > most:
        raise too_large(max_batch)
    if _count(text, b":") > _KNOWN * objects + 64:
        detail = "the body has objects with more members than there are fields"
        raise RequestError(ProblemKind.INVALID_VALUE, detail)
    values = decode(bytes(text), large=True)
    if isinstance(values, list) and len(values) > max_batch:
        raise too_large(max_batch)
    return values


def _count(text: bytes | bytearray, character: bytes) -> int:
    """How often a character stands in a text; ``text.count`` takes longer where it often does."""
    codes = np.frombuffer(text, np.uint8)
    parts = (codes[i : i + _READ] for i in range(0, codes.size, _READ))
    return sum(int(np.count_nonzero(part == character[0])) for part in parts)


# --- lists, slice by slice ------------------------------------------------------------------------

_OPENS_LIST = re.compile(rb"[ \t\r\n]*\[")
_AFTER_NUMBER = re.compile(rb",")
_AFTER_ROW = re.compile(rb"(?<=\})[ \t\r\n]*,")


def _list(
    text: bytes | bytearray,
    comma: re.Pattern[bytes],
    max_batch: int,
    read_list: Callable[[bytes], _Values],
) -> Iterator[_Values]:
    """The values of a list in slices; ValueError where it cannot be read so.

    A slice ends before a comma.  A comma within a text, or within a list in the list, leaves a
    slice that is no JSON.
    """
    size = start = 0
    while start < len(text):
        end = comma.search(text, start + _READ, start + 2 * _READ)
        if end is None and len(text) - start > 2 * _READ:
            raise ValueError("no comma for long")
        opening, stop, closing = b"[" if start else b"", len(text), b""
        if end:
            stop, closing = end.start(), b"]"
        with memoryview(text) as whole:
            values = read_list(b"".join((opening, whole[start:stop], closing)))
        if not len(values) and (start or end):
            raise ValueError("nothing beside a comma")
        size += len(values)
        if size > max_batch:
            raise too_large(max_batch)
        yield values
        del values  # before the next are read
        start = end.end() if end else len(text)


def _values(text: bytes) -> Any:
    """The values of a list: an array if all are finite numbers, else as they are."""
    values = orjson.loads(text)
    # A text has a quote, true an r, false and null an l, a number none of them.  To look for these
    # takes a tenth of what the types of the values take.
    if not any(letter in text for letter in (b'"', b"r", b"l")):
        with suppress(TypeError, ValueError):  # a list within
            array = np.fromiter(values, np.float64, len(values))
            if np.isfinite(array).all():
                return array
    return values


def _joined(parts: list[Any]) -> Any:
    """Arrays of numbers as one array, other lists as one list."""
    if all(isinstance(part, np.ndarray) and part.dtype == float for part in parts):
        return np.concatenate(parts)
    lists = (part if isinstance(part, list) else part.tolist() for part in parts)
    return list(chain.from_iterable(lists))


# --- columns --------------------------------------------------------------------------------------

# A longer one is left to Python's json, which reads 16 MB of it in a tenth of the time.
_TEXT = rb'"[^"\\]{0,4096}+(?:\\.[^"\\]{0,4096}+){0,256}+"'
_SPACE = rb"[ \t\r\n]*+"
_OPENS_OBJECT = re.compile(_SPACE + rb"\{")
_MEMBER = re.compile(
    _SPACE
    + rb"(?P<name>" + _TEXT + rb")" + _SPACE + rb":" + _SPACE
    + rb"(?P<value>\[[^\]]*+\]|\{[^{}]*+\}|" + _TEXT + rb'|[^ \t\r\n",\[\]{}]++)'
    + _SPACE + rb"(?P<then>[,}])" + _SPACE,
    re.DOTALL,
)  # fmt: skip


def _members(text: bytearray, max_batch: int) -> Iterator[tuple[str, Any]]:
    """The members of an object; ValueError where it cannot be read so.

    A bracket in a text, or a list in a list, ends a value too early: it is no JSON then.
    """
    opening = _OPENS_OBJECT.match(text)
    start, then = (opening.end() if opening else 0), b","
    names = set[str]()
    while then == b",":
        member = _MEMBER.match(text, start)
        if member is None or len(names) > _KNOWN:
            raise ValueError("no object of values and lists")
        name, value = loads(member["name"]), member["value"]
        start, then = member.end(), member["then"]
        if name in names:
            raise ValueError("a name is given twice")
        names.add(name)
        if len(value) > _READ and value.startswith(b"["):
            yield name, _joined([*_list(value, _AFTER_NUMBER, max_batch, _values)])
        else:
            yield name, loads(value)
    if opening is None or start < len(text):
        raise ValueError("not an object alone")


# --- rows -----------------------------------------------------------------------------------------


def _columns_of(text: bytearray, max_batch: int, words: Mapping[str, Any]) -> dict[str, Any]:
    """Rows as columns; ValueError unless all have the same names, those of a case, and no null,
    which says the same as no member."""
    rows = _Rows(words)
    tables = [*_list(text, _AFTER_ROW, max_batch, rows)]
    columns = ([_numbers(table[:, i]) for table in tables] for i in range(len(rows.names)))
    return dict(zip(rows.names, map(_joined, columns), strict=True))


def _numbers(column: np.ndarray) -> Any:
    """An array if all values of a column are finite numbers, else a list."""
    values = column if column.dtype == float else column.tolist()
    if values is column or {*map(type, values)} <= {float, int}:
        with suppress(OverflowError):
            array = np.asarray(values, float)
            if np.isfinite(array).all():
                return array
    return column.tolist()


class _Rows:
    """Reads slices of rows that have the names of the very first one, as tables: of finite
    numbers, or of objects."""

    def __init__(self, words: Mapping[str, Any]) -> None:
        self.names: tuple[str, ...] = ()
        self._words = words

    def __call__(self, text: bytes) -> Any:
        """ValueError where a row has other names, or these make no case."""
        if not self.names:
            self.names = _names_of_case(orjson.loads(text), self._words)
        try:
            rows = _decoder(self.names, float)(text)
        except msgspec.ValidationError:
            rows = _decoder(self.names, object)(text)
        size = len(self.names) * len(rows)
        if _count(text, b":") != size:
            raise ValueError("a name is given twice, or a text has a colon")
        values = chain.from_iterable(map(msgspec.structs.astuple, rows))
        table = np.fromiter(values, rows[0].kind if rows else float, size)
        if table.dtype == object and None in table:
            raise ValueError("a null")
        return table.reshape(len(rows), -1)


@lru_cache(maxsize=64)
def _decoder(names: tuple[str, ...], kind: type) -> Callable[[bytes], Any]:
    """What reads rows with these names, in any order, and with values of a kind: float or object.

    It takes half of the time of rows that are dictionaries."""
    row = msgspec.defstruct(
        "Row",
        [(name, kind) for name in names],
        namespace={"kind": kind},
        forbid_unknown_fields=True,
        gc=False,
    )
    return msgspec.json.Decoder(list[row]).decode  # type: ignore[valid-type]


def _names_of_case(rows: list[Any], words: Mapping[str, Any]) -> tuple[str, ...]:
    """The names of the first row; ValueError where they make no case."""
    if not rows or not isinstance(rows[0], dict):
        raise ValueError("no row")
    names = [*rows[0]]
    if not {*names} <= {*ALL_FIELDS, "f", *ENDS, *KIND, *DEVIATIONS}:
        raise ValueError("an unknown name")
    first = rows[0]
    ones = {name: np.ones(2) if name not in KIND else [first[name]] * 2 for name in names}
    Cases.of({**ones, **words})
    return tuple(names)


def _one_by_one(rows: list[Any], words: Mapping[str, Any]) -> Body:
    """Rows one by one: each is checked as one case, and a bad one gets its first reason."""
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
        ends: Any = one.ends or ((k,), (k,))  # a number, or rigid, is an interval of itself
        filled = {name: end[0] for name, end in zip(ENDS, ends, strict=True)} | one.columns
        filled |= {f"std_{name}": x for name, x in one.std.items() if name not in in_query}
        for name, column in of_kind.items():
            column.append(values.get(name, usual[name]))
        for name, value in filled.items():
            columns[name][i] = value
        used |= {name for name in filled if name not in ENDS} | ({*ENDS} if one.ends else set())
    if {*ENDS} <= used:
        columns["k"] = Value(columns["k"], None, *(columns[name] for name in ENDS))
    normal = AMPLITUDE in used or usual["direction"] == DIRECTIONS[-1]
    fields = kind_of(direction=DIRECTIONS[-1]).fields if normal else FIELDS
    members = {name: columns[name] for name in fields}
    members |= {name: each for name, each in of_kind.items() if {*each} - {usual[name]}}
    members |= {name: columns[name] for name in DEVIATIONS if name in used}
    return Body(members, reasons, True)


def _row(row: Any) -> Case:
    if not isinstance(row, dict):
        raise InputError("", row, "an object")
    return Case.model_validate(row)


def _first(error: ValidationError | InputError) -> Reason:
    """The first fault of a row, in the order of the inputs."""
    if isinstance(error, InputError):
        return (str(error.field) or None), reason_of(error)
    faults = faults_of(error.errors(include_url=False), Case.model_fields)
    order = list(Case.model_fields)
    places = [(one.path[0] if one.path else "", one.reason) for one in faults]
    name, reason = min(places, key=lambda one: order.index(one[0]) if one[0] in order else -1)
    return str(name)[:80] or None, reason


# --- answers --------------------------------------------------------------------------------------


def write_columns(answers: Iterable[Answer[Any]]) -> Iterator[bytes]:
    """An object of lists, piece by piece, without its closing brace."""
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
    """An object with the list ``results``, null for a bad case, without its closing brace."""
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
    """The row of a case as text, with a place for each number: the words follow from the source."""
    words = {path: "\0" if column is None else column[index] for path, column in columns.items()}
    return dump(nested(words)).replace(b"%", b"%%").replace(dump("\0"), b"%b")


def listed(path: str, column: Any) -> list[Any]:
    """A column as JSON lists it: NaN is written as null, and so is no text."""
    values: list[Any] = column.tolist()
    return [value or None for value in values] if path in TEXTS and "" in values else values

"""JSON batches in and out: columns (an object of lists and numbers) and rows (a list of objects).

Only what makes a batch unreadable refuses it as a whole: text that is not JSON, an unknown or missing column, lists of
different lengths, a bad plain number that would hold for every case.  A bad entry of a list spoils its own case.
Cases go from text to arrays and back in compiled loops; Python objects are made for names, options and faults only.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache, lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray
from pydantic_core import from_json

from friction.nondim import BOUNDS, FIELDS
from friction.regions import REGIMES, SOURCES
from friction.surrogate import REGIME_OF_SOURCE
from service.answers import Answers, Cases
from service.compiled.block import (
    BOUND_FLAW,
    MISSING_FLAW,
    NUMBER_FLAW,
    write_block,
    write_names,
    write_numbers,
    write_rows,
)
from service.compiled.digits import PADDING, TEXT_WIDTH, Bytes
from service.compiled.scan import (
    DEEP,
    FULL,
    HARD_ROOM,
    LONG,
    NO_OBJECT,
    OUT_OF_BOUNDS,
    PAUSE,
    SOUND,
    read_list,
    read_rows,
    skip_space,
    skip_value,
)
from service.errors import (
    BatchTooLargeError,
    FieldFault,
    InvalidFieldsError,
    MalformedBodyError,
    safe_value,
)
from service.intake import KNOWN_FIELDS

__all__ = [
    "MAX_ERRORS",
    "BlockWriter",
    "columns_text",
    "encode",
    "is_rows",
    "lines_text",
    "read_batch",
    "row_text",
    "rows_text",
    "terminated",
]

MAX_ERRORS = 1000
_REQUIRED = tuple(name for name in FIELDS if name != "k")
_NOT_A_NUMBER = "must be a number"
_SLICE = 8192  # cases that are written at a time: about half a millisecond
_MAX_OPTION = 64 * 1024  # bytes of a value that is neither a column nor a number
_NAME = re.compile(rb'"(?:[^"\\\x00-\x1f]|\\.)*"')


def encode(values: Mapping[str, Any]) -> bytes:
    """Write JSON; numbers that are not finite become null."""
    return orjson.dumps(values, option=orjson.OPT_SERIALIZE_NUMPY)


# --- reading ------------------------------------------------------------------------------------------


def terminated(body: bytes | bytearray) -> Bytes:
    """The text with the 0 bytes that stop every scan; without a copy of a bytearray."""
    text = body if isinstance(body, bytearray) else bytearray(body)
    text += bytes(PADDING)
    return np.frombuffer(text, dtype=np.uint8)


def is_rows(text: Bytes) -> bool:
    """Whether the text is a list."""
    return bool(text[skip_space(text, 0)] == ord("["))


def read_batch(text: Bytes, max_batch: int) -> tuple[Cases, dict[str, Any]]:
    """Read a batch in either form from a text that ends in 0 bytes.

    For columns, return ``include``, ``tolerance`` and ``std`` as they stand there.

    Raises
    ------
    MalformedBodyError, InvalidFieldsError, BatchTooLargeError
        See the module's docstring; too many cases.
    """
    i = skip_space(text, 0)
    first = text[i]
    if first == ord("["):
        cases, end = _read_rows(text, i + 1, max_batch)
        options: dict[str, Any] = {}
    elif first == ord("{"):
        columns, end = _read_columns(text, i, max_batch)
        _expect_end(text, end, len(text))
        cases, options = _columns(columns)
    else:
        end, state = skip_value(text, i)
        if state != SOUND:
            raise _unreadable(state, end)
        _expect_end(text, end, len(text))
        value = _small_value(text, i, end)
        fault = FieldFault("body", "must be an object of columns or a list of rows", value, path=())
        raise InvalidFieldsError("the body must be an object of columns or a list of rows", [fault])
    _expect_end(text, end, len(text))
    return cases, options


def _unreadable(state: int, where: int) -> MalformedBodyError:
    reason = "nested too deeply" if state == DEEP else "unexpected text"
    return MalformedBodyError(f"the body is not JSON: {reason} at byte {where}")


def _expect_end(text: Bytes, end: int, length: int) -> None:
    i = skip_space(text, end)
    if i != length - PADDING:
        raise _unreadable(SOUND, i)


def _too_large(max_batch: int) -> BatchTooLargeError:
    return BatchTooLargeError(f"a batch may have up to {max_batch} cases, this one has more", max_batch=max_batch)


def _read_rows(text: Bytes, i: int, max_batch: int) -> tuple[Cases, int]:
    capacity = min(max_batch, len(text) // 2 + 1)
    words = np.empty((6, capacity), dtype=np.uint64)
    flaws = np.empty(capacity, dtype=np.uint8)
    names = np.empty(capacity, dtype=np.int64)
    hard = np.empty((HARD_ROOM, 4), dtype=np.int64)
    count = waiting = 0
    while True:
        i, count, waiting, state = read_rows(text, i, words, flaws, names, count, hard, waiting)
        for case, field, start, end in hard[:waiting].tolist():
            if words[field, case] == LONG:
                words[field, case] = _long_number(text, start, end)
        waiting = 0
        if state != PAUSE:
            break
    if state == FULL:
        raise _too_large(max_batch)
    if state != SOUND:
        raise _unreadable(state, i)
    columns = [words[field, :count].view(np.float64) for field in range(6)]
    return Cases(count, columns, flaws[:count], names, text), i


def _read_list(text: Bytes, i: int, nullable: bool, max_batch: int) -> tuple[NDArray[np.float64], int]:
    column = np.empty(min(max_batch, (len(text) - i) // 2 + 1), dtype=np.uint64)
    hard = np.empty((HARD_ROOM, 4), dtype=np.int64)
    count = waiting = 0
    while True:
        i, count, waiting, state = read_list(text, i, column, count, nullable, hard, waiting)
        for case, _, start, end in hard[:waiting].tolist():
            column[case] = _long_number(text, start, end)
        waiting = 0
        if state != PAUSE:
            break
    if state == FULL:
        raise _too_large(max_batch)
    if state != SOUND:
        raise _unreadable(state, i)
    return column[:count].view(np.float64), i


def _long_number(text: Bytes, start: int, end: int) -> np.uint64:
    value = np.float64(text[start:end].tobytes().decode("ascii"))
    return value.view(np.uint64) if np.isfinite(value) else OUT_OF_BOUNDS


def _small_value(text: Bytes, start: int, end: int) -> Any:
    """The value of text[start:end], or one of its kind if it is long: it is wanted for a message, or is an option."""
    if end - start > _MAX_OPTION:
        return {ord("["): [], ord("{"): {}}.get(int(text[start]), "a long value")
    try:
        return from_json(text[start:end].tobytes())
    except ValueError as error:
        if str(error).startswith("number out of range"):
            return 10**400
        raise MalformedBodyError(f"the body is not JSON: {error}") from None


def _read_columns(text: Bytes, i: int, max_batch: int) -> tuple[dict[str, Any], int]:
    columns: dict[str, Any] = {}
    i = skip_space(text, i + 1)
    if text[i] == ord("}"):
        return columns, i + 1
    while True:
        name = _NAME.match(text.data, i)
        if name is None:
            raise _unreadable(SOUND, i)
        try:
            key = orjson.loads(name[0])
        except ValueError:
            raise _unreadable(SOUND, i) from None
        i = skip_space(text, name.end())
        if text[i] != ord(":"):
            raise _unreadable(SOUND, i)
        i = skip_space(text, i + 1)
        if text[i] == ord("[") and key in FIELDS:
            columns[key], i = _read_list(text, i + 1, key == "k", max_batch)
        else:
            end, state = skip_value(text, i)
            if state != SOUND:
                raise _unreadable(state, end)
            columns[key] = _small_value(text, i, end)
            i = end
        i = skip_space(text, i)
        if text[i] == ord("}"):
            return columns, i + 1
        if text[i] != ord(","):
            raise _unreadable(SOUND, i)
        i = skip_space(text, i + 1)


def _columns(body: dict[str, Any]) -> tuple[Cases, dict[str, Any]]:
    """Check what was read as columns."""
    faults = [
        FieldFault(name, f"unknown field; allowed: {', '.join(KNOWN_FIELDS)}", body[name])
        for name in body
        if name not in KNOWN_FIELDS
    ]
    faults += [FieldFault(name, "is required", bound=BOUNDS[name]) for name in _REQUIRED if name not in body]
    lengths = {name: body[name].size for name in FIELDS if isinstance(body.get(name), np.ndarray)}
    if len(set(lengths.values())) > 1:
        given = ", ".join(f"{name}: {length}" for name, length in lengths.items())
        faults += [
            FieldFault(name, f"lists must have one length; given {given}", [])
            for name, length in lengths.items()
            if length != next(iter(lengths.values()))
        ]
    columns: list[NDArray[np.float64]] = []
    for name in FIELDS:
        column: Any = body.get(name)
        if name not in lengths:
            if name in body:
                faults += _scalar_faults(name, column)
            number = np.inf if column is None else float(column) if _is_number(column) else np.nan
            column = np.array([number])
        columns.append(column)
    if faults:
        raise InvalidFieldsError(f"{safe_value(faults[0].field)}: {faults[0].reason}", faults)
    size = next(iter(lengths.values()), 1)
    options = {name: body[name] for name in body if name not in FIELDS}
    return Cases(size, columns, np.zeros(size, dtype=np.uint8), listed=bool(lengths)), options


def _is_number(value: object) -> bool:
    if type(value) is int:
        return -(10**308) <= value <= 10**308
    return type(value) is float


def _scalar_faults(name: str, value: Any) -> list[FieldFault]:
    if value is None and name == "k":
        return []
    if type(value) not in (int, float):
        return [FieldFault(name, "must be a number or a list of numbers", value, BOUNDS[name])]
    least = 5e-324 if name in ("mu0", "Fz", "k") else 0.0
    if _is_number(value) and least <= value <= np.finfo(np.float64).max:
        return []
    return [FieldFault(name, f"must be {BOUNDS[name]}", value, BOUNDS[name])]


# --- writing ------------------------------------------------------------------------------------------


@cache
def _words(names: tuple[str, ...]) -> tuple[Bytes, NDArray[np.int64]]:
    """The names as JSON strings."""
    return _joined(tuple(orjson.dumps(name) for name in names))


@lru_cache(maxsize=256)
def _joined(texts: tuple[bytes, ...]) -> tuple[Bytes, NDArray[np.int64]]:
    """The texts one behind the other, and where each begins."""
    ends = np.cumsum([0, *map(len, texts)]).astype(np.int64)
    return np.frombuffer(b"".join(texts) + bytes(PADDING), dtype=np.uint8).copy(), ends


_SOURCE_NAMES = tuple(SOURCES)
_REGIME_NAMES = tuple(REGIMES[code] for code in REGIME_OF_SOURCE)
_NAME_WIDTH = max(map(len, (*_SOURCE_NAMES, *_REGIME_NAMES))) + 3


def columns_text(answers: Answers, signature: Mapping[str, Any]) -> Iterator[bytes]:
    """Write the answers as an object of lists, piece by piece.  Lets go of the cases."""
    return _columns_pieces(answers, _closing(answers, signature))


def _closing(answers: Answers, signature: Mapping[str, Any]) -> bytes:
    """The end of an answer: faults and signature.  Nothing of the cases is needed after it."""
    text = encode({**errors_of(answers), **signature})[1:]
    answers.cases = None
    return text


def _columns_pieces(answers: Answers, closing: bytes) -> Iterator[bytes]:
    opening = b"{"
    room = np.empty(_SLICE * max(TEXT_WIDTH + 1, _NAME_WIDTH) + PADDING, dtype=np.uint8)
    for key, column in _default_columns(answers):
        yield opening + b'"' + key.encode() + b'":['
        yield from _list_text(room, column, key)
        opening = b"],"
    for name, group in answers.extras.items():
        if isinstance(group, Mapping):
            opening += orjson.dumps(name) + b":{"
            for key, column in group.items():
                yield opening + orjson.dumps(key) + b":["
                yield from _list_text(room, column, key)
                opening = b"],"
            opening = b"]},"
        else:
            yield opening + orjson.dumps(name) + b":["
            yield from _list_text(room, group, name)
            opening = b"],"
    yield opening + closing


def _default_columns(answers: Answers) -> list[tuple[str, NDArray[Any]]]:
    return [
        ("mu_macro", answers.mu_macro),
        ("mu_ratio", answers.mu_ratio),
        ("regime", answers.source),
        ("error_bound", answers.error_bound),
        ("source", answers.source),
    ]


def _list_text(room: Bytes, column: NDArray[Any], key: str) -> Iterator[bytes]:
    size = column.size
    for start in range(0, size, _SLICE):
        part = column[start : start + _SLICE]
        if part.dtype == np.int8:
            end = write_names(room, 0, part, *_words(_REGIME_NAMES if key == "regime" else _SOURCE_NAMES))
        else:
            end = write_numbers(room, 0, part)
        yield room[: end - (start + part.size == size)].tobytes()


class BlockWriter:
    """Writes what :func:`columns_text` writes for blocks of good cases without extras, each on a line."""

    def __init__(self, signature: Mapping[str, Any]) -> None:
        closing = encode({"errors": [], "n_errors": 0, **signature})[1:]
        pieces = [b'{"mu_macro":[', b'],"mu_ratio":[', b'],"regime":[', b'],"error_bound":[', b'],"source":[']
        self._pieces = _joined((*pieces, b"]," + closing + b"\n"))
        self._names = (*_words(_REGIME_NAMES), *_words(_SOURCE_NAMES))
        self._room = np.empty(0, dtype=np.uint8)

    def text(self, answers: Answers, edges: Sequence[int]) -> bytes:
        """The lines of some blocks; ``edges`` is where they begin among the cases, and where the last one ends."""
        width = 3 * (TEXT_WIDTH + 1) + 2 * _NAME_WIDTH
        need = answers.size * width + len(edges) * self._pieces[0].size + PADDING
        if self._room.size < need:
            self._room = np.empty(need, dtype=np.uint8)
        room, end = self._room, 0
        for start, stop in pairwise(edges):
            part = slice(start, stop)
            columns = answers.mu_macro[part], answers.mu_ratio[part], answers.error_bound[part], answers.source[part]
            end = write_block(room, end, *columns, *self._pieces, *self._names)
        return room[:end].tobytes()


def rows_text(answers: Answers, signature: Mapping[str, Any]) -> Iterator[bytes]:
    """Write the answers as a list of objects, piece by piece.  Lets go of the cases."""
    return _rows_pieces(answers, _closing(answers, signature))


def _rows_pieces(answers: Answers, closing: bytes) -> Iterator[bytes]:
    yield b'{"results":['
    for start, text in _objects(answers, b"}", b","):
        yield text[:-1] if start + _SLICE >= answers.size else text
    yield b"]," + closing


def lines_text(answers: Answers, signature: Mapping[str, Any]) -> Iterator[tuple[int, bytes]]:
    """Write the answers as objects, each on a line of its own, null for a bad case; with the index of each piece."""
    return _objects(answers, b"," + encode(signature)[1:], b"\n")


def row_text(answers: Answers, signature: Mapping[str, Any]) -> Iterator[bytes]:
    """Write the answer to one good case as an object: plain numbers that are bad refuse what they stand in."""
    for _, text in lines_text(answers, signature):
        yield text[:-1]


def _objects(answers: Answers, end: bytes, behind: bytes) -> Iterator[tuple[int, bytes]]:
    """Index of the first case, and objects with ``behind`` behind each of them."""
    numbers = [answers.mu_macro, answers.mu_ratio, answers.error_bound]
    pieces = [b'{"mu_macro":', b',"mu_ratio":', b',"regime":', b',"error_bound":', b',"source":']
    closing = b""
    for name, group in answers.extras.items():
        if isinstance(group, Mapping):
            opening = closing + b"," + orjson.dumps(name) + b":{"
            for key, column in group.items():
                pieces.append(opening + orjson.dumps(key) + b":")
                numbers.append(column)
                opening = b","
            closing = b"}"
        else:
            pieces.append(closing + b"," + orjson.dumps(name) + b":")
            numbers.append(group)
            closing = b""
    pieces.append(closing + end)
    text, ends = _joined(tuple(pieces))
    width = text.size + len(numbers) * TEXT_WIDTH + 2 * _NAME_WIDTH
    room = np.empty(min(_SLICE, answers.size) * width + PADDING, dtype=np.uint8)
    names = (*_words(_REGIME_NAMES), *_words(_SOURCE_NAMES))
    for start in range(0, answers.size, _SLICE):
        part = slice(start, start + _SLICE)
        table = np.stack([column[part] for column in numbers])
        last = write_rows(room, 0, answers.flaws[part], behind[0], text, ends, table, answers.source[part], *names)
        yield start, room[:last].tobytes()


def errors_of(answers: Answers) -> dict[str, Any]:
    """The bad cases, located: the first MAX_ERRORS of them, and their number."""
    if answers.n_bad == 0:
        return {"errors": [], "n_errors": 0}
    listed = np.flatnonzero(answers.flaws)[:MAX_ERRORS].tolist()
    return {"errors": [_error(answers, index) for index in listed], "n_errors": answers.n_bad}


def _error(answers: Answers, index: int) -> dict[str, Any]:
    code = int(answers.flaws[index])
    field: str | None = None
    if code >= BOUND_FLAW:
        field = FIELDS[code - BOUND_FLAW]
        reason = f"must be {BOUNDS[field]}"
    elif code >= NUMBER_FLAW:
        field, reason = FIELDS[code - NUMBER_FLAW], _NOT_A_NUMBER
    elif code >= MISSING_FLAW:
        field, reason = FIELDS[code - MISSING_FLAW], "is required"
    elif code == NO_OBJECT:
        reason = "must be an object"
    else:
        field, reason = _unknown_name(answers, index), f"unknown field; allowed: {', '.join(FIELDS)}"
    return {"index": index, "field": field, "reason": reason}


def _unknown_name(answers: Answers, index: int) -> str:
    cases = answers.cases
    assert cases is not None  # noqa: S101  (faults are located before the cases are let go)
    assert cases.names is not None  # noqa: S101  (only rows can have an unknown name)
    assert cases.text is not None  # noqa: S101
    name = _NAME.match(cases.text.data, int(cases.names[index]))
    try:
        return str(safe_value(orjson.loads(name[0] if name else b'""')))
    except ValueError:
        return "a name that is not UTF-8"

"""Convert JSON to Python objects, and answers to JSON, in this one place.

A question is one object in which no name occurs twice.  A batch is columns or rows. orjson and
msgspec read a batch fast, but meanwhile no other thread runs.  If they refuse it, Python's ``json``
reads it: it is slow but lets other threads run, and it gives the reason.  It also reads NaN,
Infinity and integers of any size, which are refused later with their fields.
"""

import json
import math
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import lru_cache, partial
from itertools import chain
from operator import attrgetter
from typing import Any, Literal

import msgspec
import numpy as np
import orjson
from starlette.responses import Response

from mumacro.inputs.fields import RIGID
from mumacro.kernel.arrays import Array
from mumacro.kernel.stopping import look

from .problems import FieldFault, ProblemKind, RequestError, refuse

_MOST_MEMBERS = 200  # largest number of members in an object of a question
#: exceptions of the fast readers for a text that is not JSON or has another type
NotRead = (msgspec.MsgspecError, ValueError)
_COUNTED = 2**18  # bytes of a text that are counted at a time, so that they stay in the cache
# Bytes of rows that are decoded at a time, about a millisecond: their objects stay in the cache,
# and other threads run between two pieces.
_PIECE = 2**17
_COMMA = re.compile(rb"(?<=\})[ \t\r\n]*,")  # between two rows


# --- a question -----------------------------------------------------------------------------------


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    members = dict(pairs)
    if len(members) < len(pairs):
        times = Counter(name for name, _ in pairs)
        repeats = [name for name in members if times[name] > 1]
        refuse([FieldFault.of(name, "is given more than once") for name in repeats])
    return members


# Functions of Python read the numbers, so that other threads run meanwhile; int refuses 4300
# digits.
_reader = partial(
    json.JSONDecoder,
    parse_int=lambda digits: int(digits) if len(digits) < 4300 else float(digits),
    parse_float=lambda digits: float(digits),
)
_OF_QUESTIONS, _OF_BATCHES = _reader(object_pairs_hook=_unique), _reader()


def _slowly(text: bytes | bytearray, reader: json.JSONDecoder) -> Any:
    if not text:
        raise RequestError(ProblemKind.MALFORMED_BODY, "the body is empty")
    try:
        return reader.decode(text.decode())
    except RecursionError:
        raise RequestError(ProblemKind.MALFORMED_BODY, "the body is nested too deeply") from None
    except ValueError as error:
        raise RequestError(ProblemKind.MALFORMED_BODY, f"the body is not JSON: {error}") from None


def decode(text: bytes) -> Any:
    """Return a question as Python objects.  Refuse it if a name occurs twice, or an object has far
    too many members."""
    try:
        value = orjson.loads(text)
        # a name occurs twice, or there is a colon in a text
        if b"{" in text and _members_in(value) != text.count(b":"):
            raise ValueError
    except ValueError:
        value = _slowly(text, _OF_QUESTIONS)
    if text.count(b":") > _MOST_MEMBERS:
        _few_members(value)
    return value


def _members_in(value: Any) -> int:
    """Return the number of members of all objects in a value."""
    number, values = 0, [value]
    while values:
        one = values.pop()
        if isinstance(one, dict):
            number += len(one)
            values.extend(one.values())
        elif isinstance(one, list):
            values.extend(one)
    return number


def _few_members(value: Any, path: tuple[str | int, ...] = ()) -> None:
    """Refuse an object that has far more members than there are fields, because finding a reason
    for each would take long."""
    if isinstance(value, dict):
        if len(value) > _MOST_MEMBERS:
            reason = f"has {len(value)} members; send only fields, of which no object has so many"
            refuse([FieldFault(path, reason, value)])
        for name, member in value.items():
            _few_members(member, (*path, name))
    elif isinstance(value, list):
        for i, one in enumerate(value):
            _few_members(one, (*path, i))


# --- a batch --------------------------------------------------------------------------------------

_NUMBERS = msgspec.json.Decoder(list[float])


def decode_batch(text: bytearray) -> Any:
    """Return any JSON as Python objects, slowly; if a name occurs twice, the last value counts."""
    return _slowly(text, _OF_BATCHES)


def decode_columns(text: bytearray, numbers: Collection[str], rest: Collection[str]) -> Any:
    """Return the members of an object: a list in ``numbers`` becomes an array if it holds only
    numbers.

    Raise one of :data:`NotRead` if a name is neither in ``numbers`` nor in ``rest``.
    """
    found = _members(tuple(numbers), tuple(rest))(text)
    members = {name: getattr(found, name) for name in found.__struct_fields__}
    return {
        name: _column(value) if isinstance(value, msgspec.Raw) else value
        for name, value in members.items()
        if value is not msgspec.UNSET
    }


def _column(value: msgspec.Raw) -> Any:
    try:
        return np.array(_NUMBERS.decode(value), np.float64)
    except msgspec.ValidationError:
        return orjson.loads(memoryview(value))


@lru_cache(maxsize=1)
def _members(numbers: tuple[str, ...], rest: tuple[str, ...]) -> Callable[[bytearray], Any]:
    """Return the function that splits an object into members and leaves the texts of ``numbers``
    unread."""
    kinds: list[tuple[str, Any, Any]] = [(name, msgspec.Raw, msgspec.UNSET) for name in numbers]
    kinds += [(name, Any, msgspec.UNSET) for name in rest]
    members = msgspec.defstruct("Members", kinds, forbid_unknown_fields=True)
    return msgspec.json.Decoder(members).decode


def decode_rows(
    text: bytearray, numbers: Collection[str], words: Mapping[str, tuple[str, ...]]
) -> dict[str, Any]:
    """Return rows as columns: arrays of numbers, with an infinite k for the word rigid, and lists
    of words.

    Raise one of :data:`NotRead` if a row has other names than the first one, if a name is in
    neither ``numbers`` nor ``words``, or if a value is neither a number nor a word that its name
    may have.
    """
    names = _first_names(text)
    if not {*names} <= {*numbers, *words}:
        raise ValueError("an unknown name")
    numbers = tuple(name for name in names if name in numbers)
    if len(numbers) < 2:  # attrgetter makes no tuple of one
        raise ValueError("no case has one number")
    listed = {name: list[str]() for name in names if name in words}
    decoded = _rows(names, numbers, tuple(words[name] for name in listed))
    values_of = attrgetter(*numbers) if listed else msgspec.structs.astuple
    parts = list[Array]()
    for piece in _pieces(text):
        look()
        rows = decoded(piece)
        if not rows:
            raise ValueError("no row behind a comma")
        parts.append(_table(rows, values_of, len(numbers)))
        for name, column in listed.items():
            column.extend(map(attrgetter(name), rows))
    columns = np.empty((len(numbers), sum(part.shape[1] for part in parts)))
    np.concatenate(parts, axis=1, out=columns)
    return dict(zip(numbers, columns, strict=True)) | listed


def _pieces(text: bytearray) -> Iterator[bytes]:
    """Yield a list of rows as lists of about ``_PIECE`` bytes.

    Names and words of a row have no brace.  If a text has one, the piece that ends there is not
    JSON, and is refused.
    """
    start = text.index(b"[") + 1
    while comma := _COMMA.match(text, text.find(b"}", start + _PIECE) + 1):
        yield b"[" + text[start : comma.start()] + b"]"
        start = comma.end()
    yield b"[" + text[start:]


def _table(rows: list[Any], values_of: Callable[[Any], Any], width: int) -> Array:
    """Return the numbers of rows, a column for each name."""
    size = len(rows) * width
    try:
        table = np.fromiter(chain.from_iterable(map(values_of, rows)), np.float64, size)
    except ValueError:  # the word rigid
        values = chain.from_iterable(map(values_of, rows))
        infinite = (math.inf if value == RIGID else value for value in values)
        table = np.fromiter(infinite, np.float64, size)
    return table.reshape(-1, width).T


def _first_names(text: bytearray) -> tuple[str, ...]:
    """Return the names of the first row."""
    first = orjson.loads(text[text.index(b"[") + 1 : text.index(b"}") + 1])
    if not isinstance(first, dict):
        raise ValueError("the first row is no case")
    return tuple(first)


@lru_cache(maxsize=64)
def _rows(
    names: tuple[str, ...], numbers: tuple[str, ...], allowed: tuple[tuple[str, ...], ...]
) -> Callable[[bytes], Any]:
    """Return the function that reads rows with these names in any order.  A name that is not in
    ``numbers`` has one of its words in ``allowed``.  This takes half of the time of rows that are
    dictionaries."""
    words = (Literal[one] for one in allowed)
    kinds: dict[str, Any] = {name: float if name in numbers else next(words) for name in names}
    if "k" in kinds:
        kinds["k"] = float | Literal["rigid"]
    row = msgspec.defstruct("Row", [*kinds.items()], forbid_unknown_fields=True, gc=False)
    return msgspec.json.Decoder(list[row]).decode  # type: ignore[valid-type]


def count(text: bytes | bytearray, character: bytes) -> int:
    """Return how often a character occurs in a text; ``text.count`` is slower if it occurs
    often."""
    codes, code = np.frombuffer(text, np.uint8), character[0]
    starts = range(0, codes.size, _COUNTED)
    return sum(int(np.count_nonzero(codes[i : i + _COUNTED] == code)) for i in starts)


# --- answers --------------------------------------------------------------------------------------

#: Write JSON as bytes; a number that is not finite becomes null.
dump = partial(orjson.dumps, option=orjson.OPT_SERIALIZE_NUMPY)


class Json(Response):
    """Send an answer as JSON. Starlette's own class completes the headers, which takes as long as a
    case."""

    def __init__(self, content: Any, headers: Mapping[str, str] | None = None) -> None:
        self.status_code, self.body, self.background = 200, dump(content), None
        self.raw_headers = [
            (b"content-length", b"%d" % len(self.body)),
            (b"content-type", b"application/json"),
            *((name.lower().encode(), value.encode()) for name, value in (headers or {}).items()),
        ]

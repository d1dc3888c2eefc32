"""JSON: the one place where texts become Python objects, and answers become texts.

A question is one object in which no name is given twice.  A batch is columns or rows: orjson and
msgspec read it fast, but no other thread runs meanwhile.  What they refuse is left to Python's
``json``: that is slow, lets other threads run, gives the reason, and reads NaN, Infinity and
integers of any size, which are refused by their fields later.
"""

import json
import math
from collections import Counter
from collections.abc import Callable, Collection, Mapping
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

from .problems import FieldFault, ProblemKind, RequestError, refuse

_MOST_MEMBERS = 200  # members of an object of a question, at most
#: what the fast readers raise where a text is no JSON, or has another type
NotRead = (msgspec.MsgspecError, ValueError)
_COUNTED = 2**18  # bytes of a text that are counted at a time, so that they stay in the cache


# --- a question -----------------------------------------------------------------------------------


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    members = dict(pairs)
    if len(members) < len(pairs):
        times = Counter(name for name, _ in pairs)
        repeats = [name for name in members if times[name] > 1]
        refuse([FieldFault.of(name, "is given more than once") for name in repeats])
    return members


# Numbers are read by functions of Python, so that other threads run meanwhile; int refuses 4300
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
    """Return a question as Python objects; refused where a name is given twice, or an object has
    far too many members."""
    try:
        value = orjson.loads(text)
        if b"{" in text and _members_in(value) != text.count(b":"):  # a name twice, a text
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
    """Refuse an object of far more members than there are fields: a reason for each would take
    long."""
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
    """Return any JSON as Python objects, slowly; of a name given twice the last counts."""
    return _slowly(text, _OF_BATCHES)


def decode_columns(text: bytearray, numbers: Collection[str], rest: Collection[str]) -> Any:
    """Return the members of an object: lists of ``numbers`` as arrays, where they hold nothing
    else.

    Raise one of :data:`NotRead` where a name is neither among ``numbers`` nor in ``rest``.
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
    """Return what takes an object apart, and leaves the texts of ``numbers`` as they are."""
    kinds: list[tuple[str, Any, Any]] = [(name, msgspec.Raw, msgspec.UNSET) for name in numbers]
    kinds += [(name, Any, msgspec.UNSET) for name in rest]
    members = msgspec.defstruct("Members", kinds, forbid_unknown_fields=True)
    return msgspec.json.Decoder(members).decode


def decode_rows(
    text: bytearray, numbers: Collection[str], words: Mapping[str, tuple[str, ...]]
) -> dict[str, Any]:
    """Return rows as columns: arrays of numbers, an infinite k where it is the word rigid, and
    lists of words.

    Raise one of :data:`NotRead` unless all rows have the names of the first one, which are among
    ``numbers`` and ``words``, and their values are numbers and the words that a name may have.
    """
    names = _first_names(text)
    if not {*names} <= {*numbers, *words}:
        raise ValueError("an unknown name")
    numbers = [name for name in names if name in numbers]
    allowed = tuple(words[name] for name in names if name in words)
    rows = _rows(names, tuple(numbers), allowed)(text)
    all_numbers = len(numbers) == len(names)
    values_of = msgspec.structs.astuple if all_numbers else attrgetter(*numbers)
    size = len(rows) * len(numbers)
    try:
        table = np.fromiter(chain.from_iterable(map(values_of, rows)), np.float64, size)
    except ValueError:  # the word rigid
        values = chain.from_iterable(map(values_of, rows))
        infinite = (math.inf if value == RIGID else value for value in values)
        table = np.fromiter(infinite, np.float64, size)
    listed = {name: [*map(attrgetter(name), rows)] for name in names if name in words}
    del rows  # before there is a second array: they take four times the memory of the first one
    columns: Array = np.ascontiguousarray(table.reshape(-1, len(numbers)).T)
    return dict(zip(numbers, columns, strict=True)) | listed


def _first_names(text: bytearray) -> tuple[str, ...]:
    """Return the names of the first row."""
    first = orjson.loads(text[text.index(b"[") + 1 : text.index(b"}") + 1])
    if not isinstance(first, dict) or len(first) < 2:
        raise ValueError("the first row is no case")
    return tuple(first)


@lru_cache(maxsize=64)
def _rows(
    names: tuple[str, ...], numbers: tuple[str, ...], allowed: tuple[tuple[str, ...], ...]
) -> Callable[[bytearray], Any]:
    """Return what reads rows with these names in any order, where the names that are not among
    ``numbers`` have one of the words ``allowed`` each; it takes half of the time of rows that are
    dictionaries."""
    words = (Literal[one] for one in allowed)
    kinds: dict[str, Any] = {name: float if name in numbers else next(words) for name in names}
    if "k" in kinds:
        kinds["k"] = float | Literal["rigid"]
    row = msgspec.defstruct("Row", [*kinds.items()], forbid_unknown_fields=True, gc=False)
    return msgspec.json.Decoder(list[row]).decode  # type: ignore[valid-type]


def count(text: bytes | bytearray, character: bytes) -> int:
    """Return how often a character stands in a text; ``text.count`` takes longer where it often
    does."""
    codes, code = np.frombuffer(text, np.uint8), character[0]
    starts = range(0, codes.size, _COUNTED)
    return sum(int(np.count_nonzero(codes[i : i + _COUNTED] == code)) for i in starts)


# --- answers --------------------------------------------------------------------------------------

#: Write JSON as bytes; numbers that are not finite become null.
dump = partial(orjson.dumps, option=orjson.OPT_SERIALIZE_NUMPY)


class Json(Response):
    """An answer as JSON; Starlette's own looks for what the headers may lack, which takes as long
    as a case."""

    def __init__(self, content: Any, headers: Mapping[str, str] | None = None) -> None:
        self.status_code, self.body, self.background = 200, dump(content), None
        self.raw_headers = [
            (b"content-length", b"%d" % len(self.body)),
            (b"content-type", b"application/json"),
            *((name.lower().encode(), value.encode()) for name, value in (headers or {}).items()),
        ]

"""Convert JSON to Python objects, and answers to JSON, in this one place.

A question is one object in which no name occurs twice.  A batch is columns or rows. orjson and
msgspec read a batch fast, but meanwhile no other thread runs.  If they refuse it, Python's ``json``
reads it: it is slow but lets other threads run, and it gives the reason.  It also reads NaN,
Infinity and integers of any size, which are refused later with their fields.
"""

import json
from collections import Counter
from collections.abc import Mapping
from functools import partial
from typing import Any

import msgspec
import orjson
from starlette.responses import Response

from .problems import FieldFault, ProblemKind, RequestError, refuse

_MOST_MEMBERS = 200  # largest number of members in an object of a question
#: exceptions of the fast readers for a text that is not JSON or has another type
NotRead = (msgspec.MsgspecError, ValueError)


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


def decode_batch(text: bytearray) -> Any:
    """Return any JSON as Python objects, slowly; if a name occurs twice, the last value counts."""
    return _slowly(text, _OF_BATCHES)


# --- answers --------------------------------------------------------------------------------------

#: Write JSON as bytes; a number that is not finite becomes null.
dump = partial(orjson.dumps, option=orjson.OPT_SERIALIZE_NUMPY)


def words(column: Any) -> list[str | None]:
    """Return an array of texts as JSON has it: an empty text is null."""
    return [word or None for word in column.tolist()]


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

"""Wire formats of batches, one file each: a reader, a writer, and their OpenAPI description.

A format is an object with the members of :class:`Format`, given to :func:`register`.  The endpoint, content
negotiation and the OpenAPI description use the registry.
"""

import json
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from .. import numbers
from ..errors import (
    BatchTooLargeError,
    FieldFault,
    InvalidFieldsError,
    MalformedBodyError,
    RequestError,
    refusal,
    repeated,
)
from ..evaluation import MAX_ERRORS, Answers, Batch, Reason
from ..hints import number_hint
from ..kernel import FIELDS

__all__ = [
    "FORMATS", "OPTIONS", "Format", "choose", "decode", "limit_values", "media_types", "read_plain", "register",
    "too_large", "unique_names",
]  # fmt: skip


class Format(Protocol):
    """One wire format.

    Attributes
    ----------
    name : str
        What it is called in OpenAPI.
    media_type : str
    aliases : tuple of str
        Other media types that mean the same.
    streams : bool
        Whether a body is answered line by line while it is received.
    body, answer : dict
        The media type objects of OpenAPI for request and response.
    """

    name: str
    media_type: str
    aliases: tuple[str, ...]
    streams: bool
    body: ClassVar[dict[str, Any]]
    answer: ClassVar[dict[str, Any]]

    def matches(self, text: memoryview) -> bool:
        """Whether a body of the media type is in this form; for forms that share one."""

    def read(self, text: bytearray, max_batch: int) -> tuple[Batch, dict[str, Any]]:
        """The cases of a body, and its options.  May append to ``text``.

        Raises
        ------
        MalformedBodyError, InvalidFieldsError, BatchTooLargeError
        """

    def write(self, answers: Answers, label: Mapping[str, Any]) -> Iterator[bytes]:
        """The answer, piece by piece."""


T = TypeVar("T")
FORMATS: list[Format] = []
#: members of an object of columns that are no inputs
OPTIONS = ("include", "tolerance", "std")
MOST_MEMBERS = 16  # of an object of columns: the inputs and the options


def register(made: Format) -> None:
    """Add a format."""
    FORMATS.append(made)


def media_types() -> tuple[str, ...]:
    """All media types, in the order of registration."""
    return tuple(dict.fromkeys(entry.media_type for entry in FORMATS))


def choose(media_type: str, text: memoryview) -> Format:
    """The format of a body of that media type."""
    fitting = [entry for entry in FORMATS if entry.media_type == media_type]
    return next((entry for entry in fitting if entry.matches(text)), fitting[0])


def too_large(max_batch: int) -> BatchTooLargeError:
    """The error for a batch with more cases than the settings allow."""
    return BatchTooLargeError(
        f"a batch may have up to {max_batch} cases, this one has more: split it, or stream it as NDJSON",
        max_batch=max_batch,
    )


def read_plain(text: bytearray, max_batch: int, form: int) -> tuple[Batch, dict[str, Any]] | None:
    """The cases and options of a body in the usual form, BLOCK or ROWS; None for any other body.

    Raises
    ------
    BatchTooLargeError
    """
    text.append(0)
    try:
        columns = np.empty((6, min(max_batch, len(text) // 2)))  # only written pages take memory
        size, found, spans = numbers.read(np.frombuffer(text, dtype=np.uint8), columns)
    finally:
        text.pop()
    if size == numbers.NO_ROOM:
        raise too_large(max_batch)
    if size == 0 or found != form:
        return None
    try:
        members = b",".join(text[start:stop] for start, stop in spans)
        options = decode(bytearray(b"{" + members + b"}"), dict) if spans else {}
    except RequestError:
        return None  # the whole body is read again and gives the reason
    if not options.keys() <= set(OPTIONS):
        return None
    given = {name: value for name, value in options.items() if value is not None}
    missing = np.isnan(columns[:, :size])
    reasons: dict[int, Reason] = {}
    for name, where in zip(FIELDS, missing, strict=True) if missing.any() else ():
        for index in np.flatnonzero(where)[:MAX_ERRORS].tolist():
            reasons.setdefault(index, (name, number_hint(None, name)))
    return Batch(size, list(columns[:, :size]), reasons), given


def limit_values(text: bytearray, max_batch: int, per_case: int) -> None:
    """Refuse a body that holds more values than a batch may have, before it is decoded.

    In JSON every value but the first of its list or object has a comma before it, and every list or object has a
    bracket.  Counting commas and brackets takes a millisecond per megabyte and bounds the memory of decoding.  Every
    member of an object has a colon, and no object has more members than there are fields.

    Raises
    ------
    BatchTooLargeError, InvalidFieldsError
    """
    room = max_batch + 64
    objects = text.count(b"{")
    if text.count(b",") > per_case * room or text.count(b"[") + objects > room:
        raise too_large(max_batch)
    if text.count(b":") > MOST_MEMBERS * objects + 64:
        raise InvalidFieldsError("the body has objects with more members than there are fields")


def unique_names(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object of JSON from its members.

    Raises
    ------
    InvalidFieldsError
        A name is given more than once.
    """
    found = dict(pairs)
    if len(found) < len(pairs):
        raise refusal(repeated(name for name, _ in pairs))
    return found


def decode(text: bytearray, kind: type[T]) -> T:
    """The object or list of a JSON text.  NaN and Infinity are accepted here; their fields are refused later.

    The numbers are read by functions of Python, so that other threads run meanwhile.

    Raises
    ------
    MalformedBodyError, InvalidFieldsError
        Not JSON; not of this kind, an integer with too many digits, or a name that is given more than once.
    """
    try:
        found = json.loads(
            text.decode(), object_pairs_hook=unique_names, parse_float=lambda digits: float(digits), parse_int=_integer
        )
    except RecursionError:
        raise MalformedBodyError("the body is nested too deeply") from None
    except ValueError as error:
        raise MalformedBodyError(f"the body is not JSON: {error}") from None
    if not isinstance(found, kind):
        reason = "must be an object of columns or a list of rows"
        raise InvalidFieldsError(f"the body {reason}", [FieldFault("body", reason, found, path=())])
    return found


def _integer(digits: str) -> int:
    try:
        return int(digits)
    except ValueError:  # Python reads at most 4,300 digits
        raise InvalidFieldsError("a number in the body is beyond double range") from None


def _load() -> None:
    from importlib.util import find_spec

    from . import columns, csv, lines, rows  # noqa: F401

    if find_spec("pyarrow"):
        from . import arrow  # noqa: F401


_load()

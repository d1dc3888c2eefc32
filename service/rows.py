"""Read rows, a list with one object for each case, as columns.

msgspec reads rows that have the same names.  It holds the lock of the interpreter meanwhile, so it
gets the text in pieces.  If it refuses a row, Python reads all rows one by one, and finds the
reason for each row that is not a case.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache, partial
from itertools import chain
from operator import attrgetter
from typing import Any, Literal, NamedTuple

import msgspec
import numpy as np
import orjson

from mumacro.errors import InputError
from mumacro.inputs.cases import ALL_FIELDS, DEVIATIONS, KIND, Cases
from mumacro.inputs.fields import (
    AMPLITUDE,
    CONTACTS,
    DIRECTIONS,
    ENDS,
    FIELDS,
    RIGID,
    SPRING,
    field_of,
    kind_of,
)
from mumacro.inputs.names import unknown_name
from mumacro.kernel.arrays import Array
from mumacro.kernel.threads import look

from .models.inputs import INPUTS, MAX_REASONS, entry
from .models.options import Case
from .problems import reason_of

NUMBERS = (*INPUTS, *DEVIATIONS)  # members that hold numbers
_WORDS = {"contact": CONTACTS, "direction": DIRECTIONS}  # members that hold words, and which words
# Bytes of rows that are decoded at a time, about a millisecond: their objects stay in the cache,
# and other threads run between two pieces.
_PIECE = 2**17
_COMMA = re.compile(rb"(?<=\})[ \t\r\n]*,")  # between two rows


class Reason(NamedTuple):
    """Say why a row is not a case."""

    field: str | None  #: the bad field; None if the whole case is bad
    text: str  #: empty for an unknown name that is not listed: its advice takes long to find


# --- rows of one form -----------------------------------------------------------------------------


def decode_rows(text: bytearray, query: Mapping[str, Any]) -> dict[str, Any]:
    """Return rows as columns: arrays of numbers, with an infinite k for the word rigid, and lists
    of words.

    Raise an error of msgspec or ValueError if a row has other names than the first one, if the
    names do not form a case together with the query, or if a value is neither a number nor a word
    that its name may have.
    """
    names = _first_names(text)
    if not {*names} <= {*NUMBERS, *_WORDS}:
        raise ValueError("an unknown name")
    numbers = tuple(name for name in names if name in NUMBERS)
    if len(numbers) < 2:  # attrgetter makes no tuple of one
        raise ValueError("no case has one number")
    words = {name: list[str]() for name in names if name in _WORDS}
    decoded = _decoder(names)
    values_of = attrgetter(*numbers) if words else msgspec.structs.astuple
    parts = list[Array]()
    for piece in _pieces(text):
        look()
        rows = decoded(piece)
        if not rows:
            raise ValueError("no row behind a comma")
        parts.append(_table(rows, values_of, len(numbers)))
        for name, column in words.items():
            column.extend(map(attrgetter(name), rows))
    kind = (words[name][0] if name in words else None for name in KIND)
    if isinstance(_numbers_of(query, names, *kind), Reason):
        raise ValueError("the names form no case")
    columns = np.empty((len(numbers), sum(part.shape[1] for part in parts)))
    np.concatenate(parts, axis=1, out=columns)
    return dict(zip(numbers, columns, strict=True)) | words


def _first_names(text: bytearray) -> tuple[str, ...]:
    """Return the names of the first row."""
    first = orjson.loads(text[text.index(b"[") + 1 : text.index(b"}") + 1])
    if not isinstance(first, dict):
        raise ValueError("the first row is no case")
    return tuple(first)


@lru_cache(maxsize=64)
def _decoder(names: tuple[str, ...]) -> Callable[[bytes], Any]:
    """Return the function that reads rows with these names in any order.  This takes half of the
    time of rows that are dictionaries."""
    kinds: dict[str, Any] = {
        name: Literal[_WORDS[name]] if name in _WORDS else float for name in names
    }
    if "k" in kinds:
        kinds["k"] = float | Literal["rigid"]
    row = msgspec.defstruct("Row", [*kinds.items()], forbid_unknown_fields=True, gc=False)
    return msgspec.json.Decoder(list[row]).decode  # type: ignore[valid-type]


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


# --- rows one by one ------------------------------------------------------------------------------


def read_one_by_one(
    rows: list[Any], query: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[int, Reason]]:
    """Return rows as columns, with NaN in a row that is not a case, and the first reason of such a
    row.

    The columns for its numbers, or the reason why it is not a case, are found once for all rows
    with the same names.  The library checks later whether the numbers are valid together.
    """
    columns: dict[str, Any] = {name: np.full(len(rows), np.nan) for name in (*ALL_FIELDS, *ENDS)}
    columns |= {name: np.zeros(len(rows)) for name in DEVIATIONS}
    usual = {name: query.get(name, word) for name, word in SPRING.names.items()}
    used = set[str]()
    words_of: dict[str, dict[str, None]] = {name: {} for name in KIND if name not in query}
    numbers_of = lru_cache(maxsize=64)(partial(_numbers_of, query))
    reasons: dict[int, Reason] = {}
    for i, row in enumerate(rows):
        look()
        numbers = _numbers_in(row, numbers_of)
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
    return members, reasons


def _numbers_of(
    query: Mapping[str, Any], names: tuple[str, ...], contact: str | None, direction: str | None
) -> list[str] | Reason:
    """Return the names of numbers in a row with these names, in the order of the description, or
    the reason why the names do not form a case."""
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
    try:
        if twice := case.keys() & query.keys():
            raise InputError(min(twice), None, "left out: it is given in the query")
        Cases.of({**query, **case})
    except InputError as error:
        return Reason(error.field or None, reason_of(error))
    return numbers


# the column of a number, and the scale of its unit there
_COLUMN_OF = {name: field_of(name) for name in INPUTS}
_COLUMN_OF |= {
    f"std_{name}": (f"std_{field}", unit)
    for name, (field, unit) in _COLUMN_OF.items()
    if f"std_{name}" in DEVIATIONS
}


def _numbers_in(
    row: Any, numbers_of: Callable[..., list[str] | Reason]
) -> dict[str, float] | Reason:
    """Return the numbers of a row by column, or the first fault of its names and numbers."""
    if not isinstance(row, dict):
        return Reason(None, "must be an object")
    if None in row.values():  # a null means left out, except in k, where it may mean rigid
        row = {name: x for name, x in row.items() if x is not None or name == "k"}
    kind = (x if x is None or isinstance(x, str) else "" for x in map(row.get, KIND))
    names = numbers_of(tuple(row), *kind)
    if isinstance(names, Reason):
        if not names.text:  # an unknown name
            return names
        # as for one case, a bad value is told before a fault between names
        reasons = ((name, entry(name, x)[1]) for name, x in row.items() if name in NUMBERS)
        return next((Reason(name, text) for name, text in reasons if text), names)
    numbers = {}
    for name in names:
        number, reason = entry(name, row[name])
        if reason is not None:
            return Reason(name, reason)
        column, unit = _COLUMN_OF[name]
        numbers[column] = unit * number
    return numbers

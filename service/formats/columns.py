"""JSON columns: an object of lists and plain numbers.

A batch is refused as a whole only if it cannot be read: text that is not JSON, an unknown or missing column, lists of
different lengths, a bad plain number that would hold for every case.  A bad entry of a list affects its own case only.

Compiled code (:mod:`service.numbers`) reads plain numbers into arrays; msgspec reads ordinary columns with options.  If
both refuse a body, :func:`read_values` reads it again, entry by entry, and gives the reasons.
"""

import math
from array import array
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Literal

import msgspec
import numpy as np
import orjson
from msgspec import UNSET, UnsetType

from .. import numbers
from ..errors import FieldFault, missing_inputs, refusal, safe_value
from ..evaluation import MAX_ERRORS, Answers, Batch, Reason, angular_frequency
from ..hints import TOO_FREQUENT, number_hint, unknown_name
from ..kernel import BOUNDS, FIELDS, INPUTS, MOST_HZ, POSITIVE, REGIME_NAMES, SOURCES, Array
from ..quantities import QUANTITIES, nested, parts_of
from ..schemas import BatchColumns
from . import decode, limit_values, register, too_large

__all__ = ["NAMES", "REGIMES_OF", "SOURCES_OF", "dump", "read_entry", "write_columns"]

OPTIONS = ("include", "tolerance", "std")
NAMES = (*INPUTS, *OPTIONS)
_SLICE = 65536  # values that are written at a time
REGIMES_OF = np.array([*REGIME_NAMES, None], dtype=object)  # by source code, -1 last
SOURCES_OF = np.array([*SOURCES, None], dtype=object)

Column = float | list[float]
Stiff = float | None | Literal["rigid"]


class _Plain(msgspec.Struct, forbid_unknown_fields=True, gc=False):
    """The usual form of columns; any other form is read again, entry by entry."""

    mu0: Column
    Fz: Column
    k: Stiff | list[Stiff]
    y0: Column
    v0: Column
    omega: Column | UnsetType | None = UNSET
    f: Column | UnsetType | None = UNSET
    include: list[str] | UnsetType | None = UNSET
    tolerance: float | UnsetType | None = UNSET
    std: dict[str, float] | UnsetType | None = UNSET


_decoder = msgspec.json.Decoder(_Plain)


def dump(values: Mapping[str, Any]) -> bytes:
    """Write JSON; numbers that are not finite become null."""
    return orjson.dumps(values, option=orjson.OPT_SERIALIZE_NUMPY)


def read_entry(value: Any, name: str) -> tuple[float, str | None]:
    """The number of an entry and None; or NaN and the reason why it is not a number."""
    if name == "k" and (value is None or value == "rigid"):
        return math.inf, None
    if type(value) is float or type(value) is int:
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        return (number, None) if math.isfinite(number) else (math.nan, f"must be {BOUNDS[name]}")
    return math.nan, number_hint(value, name)


class Columns:
    """The format."""

    name, media_type, streams = "columns", "application/json", False
    aliases: tuple[str, ...] = ()
    body: ClassVar[dict[str, Any]] = {
        "schema": {"$ref": "#/components/schemas/BatchColumns"},
        "example": BatchColumns.model_config["json_schema_extra"]["examples"][0],  # type: ignore[index]
    }
    answer: ClassVar[dict[str, Any]] = {"schema": {"$ref": "#/components/schemas/ColumnsAnswer"}}

    def matches(self, text: memoryview) -> bool:
        """Whether it is an object."""
        return bytes(text[:4096]).lstrip()[:1] != b"["

    def read(self, text: bytearray, max_batch: int) -> tuple[Batch, dict[str, Any]]:
        """See :class:`Format`."""
        batch = _read_numbers(text, max_batch)
        if batch is not None:
            return batch, {}
        limit_values(text, max_batch, len(NAMES))
        try:
            plain = _decoder.decode(text)
            given = {name: value for name in NAMES if (value := getattr(plain, name)) is not UNSET}
            stated = {name: value for name, value in given.items() if value is not None or name == "k"}
            columns = {name: _converted(stated[name]) for name in INPUTS if name in stated}
        except (msgspec.MsgspecError, ValueError, TypeError, OverflowError, RecursionError):
            return read_values(decode(text, dict), max_batch)
        # More colons than members: a name is given twice, or a string holds one.
        if text.count(b":") != len(given) + len(stated.get("std", ())):
            return read_values(decode(text, dict), max_batch)
        return _batch(columns, {}, [], max_batch), {name: stated[name] for name in OPTIONS if name in stated}

    def write(self, answers: Answers, label: Mapping[str, Any]) -> Iterator[bytes]:
        """See :class:`Format`."""
        return write_columns(answers, label)


def _converted(value: Any) -> Array | float:
    """A list as an array, a number as it is; None and "rigid" are infinite."""
    if isinstance(value, list):
        try:
            return np.frombuffer(array("d", value))
        except TypeError:
            numbers_only = [math.inf if entry is None or entry == "rigid" else entry for entry in value]
            return np.frombuffer(array("d", numbers_only))
    return math.inf if value is None or value == "rigid" else float(value)


def _read_numbers(text: bytearray, max_batch: int) -> Batch | None:
    """The batch from the compiled reader; None if that reader does not accept the text."""
    if not numbers_ready():
        return None
    stop = len(text)
    while stop and text[stop - 1] in b" \t\r\n":
        stop -= 1
    text.append(0)
    try:
        columns = np.empty((6, min(max_batch, len(text) // 2)))  # only written pages take memory
        size = numbers.read_columns(np.frombuffer(text, dtype=np.uint8), 0, stop, columns)
    finally:
        text.pop()
    return Batch(size, [column[:size] for column in columns]) if size > 0 else None


_ready = False


def numbers_ready(*, now: bool = False) -> bool:
    """Whether the compiled reader is loaded; with ``now`` it is marked as loaded."""
    global _ready
    _ready = _ready or now
    return _ready


def read_values(found: Mapping[str, Any], max_batch: int) -> tuple[Batch, dict[str, Any]]:
    """Columns from decoded JSON, entry by entry."""
    faults = []
    columns: dict[str, Array | float] = {}
    reasons: dict[int, Reason] = {}
    for name, value in found.items():
        if name not in NAMES:
            faults.append(FieldFault(name, unknown_name(name, NAMES), value))
            if len(faults) > 100:
                break
        elif name in INPUTS and isinstance(value, list):
            if len(value) <= max_batch:
                columns[name] = _entries(name, value, reasons)
            else:
                columns[name] = np.zeros(len(value))
        elif name in INPUTS and not (name in ("omega", "f") and value is None):
            number, reason = read_entry(value, name)
            if reason is None and not (number > 0.0 or (number == 0.0 and name not in POSITIVE)):
                reason = f"must be {BOUNDS[name]}"
            if reason is not None:
                faults.append(FieldFault(name, reason, value, BOUNDS[name]))
            columns[name] = number
    options = {name: found[name] for name in OPTIONS if found.get(name) is not None}
    return _batch(columns, reasons, faults, max_batch), options


def _entries(name: str, values: list[Any], reasons: dict[int, Reason]) -> Array:
    """A list as an array, with the reasons of entries that are not numbers."""
    column = np.empty(len(values))
    told = 0
    for i, value in enumerate(values):
        column[i], reason = read_entry(value, name)
        if reason is not None and told < MAX_ERRORS:
            told += 1
            if i not in reasons or INPUTS.index(name) < INPUTS.index(str(reasons[i][0])):
                reasons[i] = name, reason
    return column


def _batch(
    columns: dict[str, Array | float],
    reasons: dict[int, Reason],
    faults: list[FieldFault],
    max_batch: int,
) -> Batch:
    """Check the relations between columns.

    Raises
    ------
    InvalidFieldsError, BatchTooLargeError
    """
    lengths = {name: column.size for name, column in columns.items() if isinstance(column, np.ndarray)}
    if any(length > max_batch for length in lengths.values()):
        raise too_large(max_batch)
    bad = {fault.field for fault in faults}
    faults += missing_inputs(columns, "null")
    if len(set(lengths.values())) > 1:
        given = ", ".join(f"{name}: {lengths[name]}" for name in INPUTS if name in lengths)
        first = next(lengths[name] for name in INPUTS if name in lengths)
        reason = f"lists must have one length; given {given}"
        faults += [FieldFault(name, reason, []) for name in INPUTS if lengths.get(name, first) != first]
    for name, column in columns.items():
        if isinstance(column, float) and name not in bad:
            least = 5e-324 if name in POSITIVE else 0.0
            if not column >= least or (column == math.inf and name != "k"):
                faults.append(FieldFault(name, f"must be {BOUNDS[name]}", safe_value(column), BOUNDS[name]))
            elif name == "f" and column > MOST_HZ:
                faults.append(FieldFault(name, TOO_FREQUENT, column, BOUNDS[name]))
    if faults:
        raise refusal(faults)
    if "f" in columns:
        columns["omega"] = angular_frequency(columns["f"], reasons)
    ordered = [columns[name] for name in FIELDS]
    arrays = [column if isinstance(column, np.ndarray) else np.array([column]) for column in ordered]
    return Batch(next(iter(lengths.values()), 1), arrays, reasons, listed=bool(lengths))


# --- writing ------------------------------------------------------------------------------------------


def write_columns(answers: Answers, label: Mapping[str, Any]) -> Iterator[bytes]:
    """An object of lists, piece by piece."""
    opening = b"{"
    for key, column, names in (
        ("mu_macro", answers.mu_macro, None),
        ("mu_ratio", answers.mu_ratio, None),
        ("regime", answers.source, REGIMES_OF),
        ("error_bound", answers.error_bound, None),
        ("source", answers.source, SOURCES_OF),
    ):
        yield opening + dump_key(key)
        yield from _list_text(column, names)
        opening = b","
    for name, value in nested(answers.extras).items():
        if isinstance(value, dict):
            opening = b"," + dump_key(name) + b"{"
            for key, column in value.items():
                yield opening + dump_key(key)
                yield from _list_text(column, None, is_bool(f"{name}.{key}"))
                opening = b","
            yield b"}"
        else:
            yield b"," + dump_key(name)
            yield from _list_text(value, None, is_bool(name))
    end = {"errors": answers.errors, "n_errors": answers.n_bad, **label}
    yield b"," + dump(end)[1:]


def dump_key(key: str) -> bytes:
    """A name and its colon."""
    return orjson.dumps(key) + b":"


def is_bool(path: str) -> bool:
    """Whether a column of the registry holds truth values."""
    return any(part.kind is bool for part in parts_of(tuple(QUANTITIES)) if part.path == path)


def _list_text(column: Any, names: Any, truth: bool = False) -> Iterator[bytes]:
    yield b"["
    for start in range(0, column.size, _SLICE):
        part = column[start : start + _SLICE]
        if names is not None:
            text = orjson.dumps(names[part].tolist())
        elif truth:
            text = orjson.dumps([None if value != value else bool(value) for value in part.tolist()])
        else:
            text = orjson.dumps(part, option=orjson.OPT_SERIALIZE_NUMPY)
        yield text[1:-1] if start == 0 else b"," + text[1:-1]
    yield b"]"


register(Columns())

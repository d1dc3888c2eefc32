"""JSON columns: an object of lists and plain numbers.

A batch is refused as a whole only if it cannot be read: text that is not JSON, an unknown or missing column, lists of
different lengths, a bad plain number that would hold for every case.  A bad entry of a list affects its own case only.

Compiled code (:mod:`service.numbers`) reads the usual form into arrays.  Any other body is read again, entry by entry,
and gives the reasons.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np
import orjson

from .. import numbers
from ..errors import FieldFault, missing_inputs, refusal, safe_value
from ..evaluation import MAX_ERRORS, Answers, Batch, Reason, angular_frequency
from ..hints import TOO_FREQUENT, number_hint, unknown_name
from ..kernel import BOUNDS, FIELDS, INPUTS, MOST_HZ, POSITIVE, REGIME_NAMES, SOURCES, Array
from ..quantities import QUANTITIES, nested, parts_of
from ..schemas import BatchColumns
from . import OPTIONS, decode, limit_values, read_plain, register, too_large

__all__ = ["NAMES", "REGIMES_OF", "SOURCES_OF", "dump", "read_entry", "write_columns"]

NAMES = (*INPUTS, *OPTIONS)
_SLICE = 65536  # values that are written at a time
REGIMES_OF = np.array([*REGIME_NAMES, None], dtype=object)  # by source code, -1 last
SOURCES_OF = np.array([*SOURCES, None], dtype=object)
# Their JSON texts with a comma.  numpy fills them up with zeros, and copies equal widths faster than objects.
_REGIME_TEXTS, _SOURCE_TEXTS = (
    np.array([orjson.dumps(name) + b"," for name in names.tolist()]) for names in (REGIMES_OF, SOURCES_OF)
)


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
        plain = read_plain(text, max_batch, numbers.BLOCK)
        if plain is not None:
            return plain
        limit_values(text, max_batch, len(NAMES))
        return read_values(decode(text, dict), max_batch)

    def write(self, answers: Answers, label: Mapping[str, Any]) -> Iterator[bytes]:
        """See :class:`Format`."""
        return write_columns(answers, label)


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
        ("regime", answers.source, _REGIME_TEXTS),
        ("error_bound", answers.error_bound, None),
        ("source", answers.source, _SOURCE_TEXTS),
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


def _list_text(column: Any, texts: Any, truth: bool = False) -> Iterator[bytes]:
    yield b"["
    for start in range(0, column.size, _SLICE):
        if start:
            yield b","
        part = column[start : start + _SLICE]
        if texts is not None:
            yield texts.take(part).tobytes().translate(None, b"\0")[:-1]
        elif truth:
            yield orjson.dumps([None if value != value else bool(value) for value in part.tolist()])[1:-1]
        else:
            yield orjson.dumps(part, option=orjson.OPT_SERIALIZE_NUMPY)[1:-1]
    yield b"]"


register(Columns())

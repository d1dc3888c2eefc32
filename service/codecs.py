"""JSON batches in and out: columns (an object of lists and numbers) and rows (a list of objects).

Only what makes a batch unreadable refuses it as a whole: an unknown or missing column, lists of different lengths,
a bad plain number that would hold for every case.  A bad entry of a list spoils its own case.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic_core import to_json

from friction.nondim import BOUNDS, FIELDS, find_faults
from service.answers import DEFAULT_KEYS, Batch, CaseFault
from service.errors import BatchTooLargeError, FieldFault, InvalidFieldsError, safe_value
from service.intake import KNOWN_FIELDS

__all__ = [
    "MAX_ERRORS",
    "columns_from_json",
    "encode",
    "encode_case",
    "encode_columns",
    "encode_rows",
    "rows_from_json",
]

MAX_ERRORS = 1000
_REQUIRED = tuple(name for name in FIELDS if name != "k")
_NOT_A_NUMBER = "must be a number"
# The encoder holds the interpreter; between slices other requests get their turn.
_SLICE = 8192


def columns_from_json(body: Mapping[str, Any], max_batch: int) -> Batch:
    """Read columns.  ``include`` and ``tolerance`` are the caller's to read.

    Raises
    ------
    InvalidFieldsError, BatchTooLargeError
        See the module's docstring; too many cases.
    """
    faults = [
        FieldFault(name, f"unknown field; allowed: {', '.join(KNOWN_FIELDS)}", body[name])
        for name in body
        if name not in KNOWN_FIELDS
    ]
    faults += [FieldFault(name, "is required", bound=BOUNDS[name]) for name in _REQUIRED if name not in body]
    lengths = {name: len(body[name]) for name in FIELDS if isinstance(body.get(name), list)}
    if len(set(lengths.values())) > 1:
        given = ", ".join(f"{name}: {length}" for name, length in lengths.items())
        faults += [
            FieldFault(name, f"lists must have one length; given {given}", body[name])
            for name, length in lengths.items()
            if length != next(iter(lengths.values()))
        ]
    for name in FIELDS:
        if name in body and name not in lengths:
            faults += _scalar_faults(name, body[name])
    if faults:
        raise InvalidFieldsError(f"{safe_value(faults[0].field)}: {faults[0].reason}", faults)
    size = next(iter(lengths.values()), 1)
    _check_size(size, max_batch)
    return _batch({name: body.get(name) for name in FIELDS}, size, {})


def rows_from_json(rows: Sequence[Any], max_batch: int) -> Batch:
    """Read rows.  A row that is no object, lacks a field or has an unknown one is a bad case.

    Raises
    ------
    BatchTooLargeError
        Too many cases.
    """
    _check_size(len(rows), max_batch)
    faults: dict[int, CaseFault] = {}
    checked: list[Mapping[str, Any]] = []
    sound: set[tuple[str, ...]] = set()  # most rows have the fields of the row before, in the same order
    for index, row in enumerate(rows):
        if isinstance(row, dict):
            names = tuple(row)
            if names not in sound:
                fault = _shape_fault(row)
                if fault is None:
                    sound.add(names)
                else:
                    faults[index] = fault
            checked.append(row)
        else:
            faults[index] = CaseFault(None, "must be an object")
            checked.append({})
    columns = {name: [row.get(name) for row in checked] for name in FIELDS}
    return _batch(columns, len(rows), faults)


def encode_columns(answers: Mapping[str, Any], batch: Batch, signature: Mapping[str, Any]) -> bytes:
    """Write the answers as an object of lists."""
    return encode({**answers, **_errors(batch), **signature})


def encode_rows(answers: Mapping[str, Any], batch: Batch, signature: Mapping[str, Any]) -> bytes:
    """Write the answers as a list of objects."""
    columns: dict[str, list[Any]] = {key: answers[key] for key in DEFAULT_KEYS}
    for name, group in answers.items():
        if name not in columns:
            keys = tuple(group)
            columns[name] = [dict(zip(keys, values, strict=True)) for values in zip(*group.values(), strict=True)]
    names = tuple(columns)
    results: list[Any] = [dict(zip(names, values, strict=True)) for values in zip(*columns.values(), strict=True)]
    for index in batch.faults:
        results[index] = None
    return encode({"results": results, **_errors(batch), **signature})


def encode_case(values: Mapping[str, Any]) -> bytes:
    """Write one short answer; numbers that are not finite become null."""
    return to_json(values, inf_nan_mode="null")


def encode(values: Mapping[str, Any]) -> bytes:
    """Write JSON; numbers that are not finite become null.  Long lists are written in slices."""
    members = (to_json(name) + b":" + _encode_value(value) for name, value in values.items())
    return b"{" + b",".join(members) + b"}"


def _encode_value(value: Any) -> bytes:
    if isinstance(value, list) and len(value) > _SLICE:
        slices = (value[start : start + _SLICE] for start in range(0, len(value), _SLICE))
        return b"[" + b",".join(to_json(part, inf_nan_mode="null")[1:-1] for part in slices) + b"]"
    if isinstance(value, dict):
        return encode(value)
    return to_json(value, inf_nan_mode="null")


def _errors(batch: Batch) -> dict[str, Any]:
    listed = sorted(batch.faults.items())[:MAX_ERRORS]
    entries = [{"index": index, "field": fault.field, "reason": fault.reason} for index, fault in listed]
    return {"errors": entries, "n_errors": len(batch.faults)}


def _check_size(size: int, max_batch: int) -> None:
    if size > max_batch:
        raise BatchTooLargeError(f"a batch may have up to {max_batch} cases, this one has {size}", max_batch=max_batch)


def _scalar_faults(name: str, value: Any) -> list[FieldFault]:
    if value is None and name == "k":
        return []
    if type(value) not in (int, float):
        return [FieldFault(name, "must be a number or a list of numbers", value, BOUNDS[name])]
    number, _, bad = _numbers([value], name)
    found = find_faults({name: float(number[0])})
    reason = bad.get(0) or (found[0].reason if found else None)
    return [] if reason is None else [FieldFault(name, reason, value, BOUNDS[name])]


def _shape_fault(row: Mapping[str, Any]) -> CaseFault | None:
    for name in _REQUIRED:
        if name not in row:
            return CaseFault(name, "is required")
    for name in row:
        if name not in FIELDS:
            return CaseFault(str(safe_value(name)), f"unknown field; allowed: {', '.join(FIELDS)}")
    return None


def _batch(raw: Mapping[str, Any], size: int, faults: dict[int, CaseFault]) -> Batch:
    columns: dict[str, Any] = {}
    rigid: NDArray[np.bool_] | None = None
    for name, column in raw.items():
        if not isinstance(column, list):
            columns[name] = None if column is None else float(column)
            continue
        values, missing, bad = _numbers(column, name)
        for index, reason in bad.items():
            faults.setdefault(index, CaseFault(name, reason))
        columns[name] = values
        if name == "k" and missing is not None:
            rigid = missing
            values[missing] = 1.0
    return Batch(size, columns, rigid, faults)


def _numbers(column: list[Any], name: str) -> tuple[NDArray[np.float64], NDArray[np.bool_] | None, dict[int, str]]:
    """Return the column as float64, the places of null where null is allowed, and the entries that are no numbers."""
    if set(map(type, column)) <= {float, int}:  # exact types: bool is an int to isinstance
        try:
            return np.array(column, dtype=np.float64), None, {}
        except OverflowError:
            pass  # an integer beyond double range: find out which
    values = np.full(len(column), np.nan)
    missing = np.zeros(len(column), dtype=np.bool_)
    bad: dict[int, str] = {}
    for index, entry in enumerate(column):
        if type(entry) in (float, int):
            try:
                values[index] = entry
            except OverflowError:
                bad[index] = f"must be {BOUNDS[name]}"
        elif entry is None and name == "k":
            missing[index] = True
        else:
            bad[index] = _NOT_A_NUMBER
    return values, missing if missing.any() else None, bad

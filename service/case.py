"""A case, many cases, and the options of a request: the only place where they are checked.

Every form of asking decodes to ``{name: number | list | array}``.  :func:`checked` checks one case and
:func:`columns_of` many, both entry by entry with :func:`number`; names, bounds and reasons are those of
:mod:`mumacro.inputs`.  The models of cases describe the same in OpenAPI.
"""

import math
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mumacro.inputs import (
    FIELDS,
    GAP,
    MOST_HZ,
    POSITIVE,
    RAD_PER_CYCLE,
    RIGID,
    is_rigid,
    number_hint,
    refusal,
    unknown_name,
)
from mumacro.inputs import NAMES as INPUTS

from .problems import FieldFault, Kind, RequestError, refuse

__all__ = [
    "INPUTS", "MAX_ERRORS", "Columns", "Reason", "checked", "columns_of", "faults_in", "joined", "number", "too_large",
]  # fmt: skip

Array = NDArray[np.float64]
#: the bad field, or None for the case as a whole, and why
Reason = tuple[str | None, str]
MAX_ERRORS = 1000  # bad cases of a batch that are listed
STATE_OMEGA = "is required: omega [rad/s], or f [Hz] in its place"
ONE_FREQUENCY = "omega is given, too: give exactly one of omega [rad/s] and f [Hz]"
STATE_K = f"is required: the tangential stiffness [N/m], or {RIGID}"
LEFT_OUT = "must be left out: it is the unknown or swept input"
_LEAST = {name: 5e-324 if name in POSITIVE else 0.0 for name in INPUTS}
_MOST = {name: MOST_HZ if name == "f" else sys.float_info.max for name in INPUTS}


# --- one value, one case ------------------------------------------------------------------------------


def number(name: str, value: object, null_is_rigid: bool = True) -> tuple[float, str | None]:
    """The value of an input and None; or NaN and the reason why it is none.  A rigid contact is infinite."""
    if type(value) is float or type(value) is int:
        try:
            found = float(value)
        except OverflowError:
            found = math.inf
        if _LEAST[name] <= found <= _MOST[name]:
            return found, None
        return math.nan, refusal(name, found)
    if name == "k" and ((isinstance(value, str) and is_rigid(value)) or (value is None and null_is_rigid)):
        return math.inf, None
    if value is None:
        return math.nan, GAP if name == "k" else "is required"
    return math.nan, number_hint(name, value)


def faults_in(given: Iterable[str], left_out: Iterable[str] = ()) -> list[FieldFault]:
    """Faults between the names of the inputs that are given: missing ones, omega and f, or one that is asked for."""
    names, out = set(given), set(left_out)
    if out & {"omega", "f"}:
        out |= {"omega", "f"}
    faults = [FieldFault.of(name, LEFT_OUT) for name in INPUTS if name in names & out]
    for name in FIELDS:
        if name in names or name in out:
            continue
        if name == "omega":
            if "f" not in names:
                faults.append(FieldFault.of(name, STATE_OMEGA))
        else:
            faults.append(FieldFault.of(name, STATE_K if name == "k" else "is required"))
    if {"omega", "f"} <= names - out:
        faults.append(FieldFault.of("f", ONE_FREQUENCY))
    return faults


def checked(
    given: Mapping[str, Any], left_out: Iterable[str] = (), null_is_rigid: bool = True, known: Iterable[str] = INPUTS
) -> tuple[dict[str, float], list[FieldFault]]:
    """The inputs of one case by field, with ``omega`` for ``f``, and all of its faults.

    ``left_out`` are the inputs that the request asks for, which must not be given.  A k of null is a rigid contact in a
    single case; in a batch it is a gap.  ``known`` are all names that the request may have, for the advice on others.
    """
    values: dict[str, float] = {}
    faults: list[FieldFault] = []
    for name, value in given.items():
        if name not in _LEAST:
            faults.append(FieldFault.of(name, unknown_name(name, known) if len(faults) < 100 else "unknown", value))
        elif value is not None or name not in ("omega", "f"):
            values[name], reason = number(name, value, null_is_rigid)
            if reason is not None:
                faults.append(FieldFault.of(name, reason, value))
    if left_out or len(values) != 6 or not ("omega" in values) ^ ("f" in values):
        faults += faults_in(values, left_out)
    if "f" in values and not faults:
        values["omega"] = RAD_PER_CYCLE * values.pop("f")
    return values, faults


# --- many cases ---------------------------------------------------------------------------------------


@dataclass
class Columns:
    """The six inputs of ``size`` cases."""

    size: int
    #: in the order of FIELDS, (size,) or (1,) where one value holds for all; a value that is no number is NaN
    six: list[Array]
    #: why a case could not be read, for the first MAX_ERRORS of each column; such a case has a NaN
    reasons: dict[int, Reason] = field(default_factory=dict)
    hertz: bool = False  # whether the frequency was given as f
    listed: bool = True  # whether any input came as a list
    rows: bool = False  # whether the cases came one by one

    def part(self, start: int, stop: int) -> list[Array]:
        """The six columns of the cases from ``start`` to ``stop``."""
        return [column[start:stop] if column.size > 1 else column for column in self.six]

    def reason(self, index: int) -> Reason:
        """Why a case is bad."""
        if index in self.reasons:
            return self.reasons[index]
        for name, column in zip(FIELDS, self.six, strict=True):
            value = column[index if column.size > 1 else 0].item()
            if not _LEAST[name] <= value <= (math.inf if name == "k" else _MOST[name]):
                shown = "f" if name == "omega" and self.hertz else name
                return shown, refusal(shown, value)
        return None, "is no legal case"


def too_large(max_batch: int) -> RequestError:
    """The error for a batch with more cases than the settings allow."""
    return RequestError(
        Kind.BATCH_TOO_LARGE,
        f"a batch may have up to {max_batch} cases, this one has more: split it, or stream it as NDJSON",
        max_batch=max_batch,
    )


def columns_of(
    given: Mapping[str, Any], max_batch: int, known: Iterable[str] = INPUTS, faults: Iterable[FieldFault] = ()
) -> Columns:
    """Columns from numbers, lists and arrays of float64 by name.

    A bad entry of a list spoils its own case; a bad name or a bad number that holds for every case refuses the batch,
    together with the ``faults`` that were found before.
    """
    lists = {name: value for name, value in given.items() if isinstance(value, (list, np.ndarray)) and name in _LEAST}
    if any(len(value) > max_batch for value in lists.values()):
        raise too_large(max_batch)
    plain, more = checked(
        {name: 1.0 if name in lists else value for name, value in given.items()}, null_is_rigid=False, known=known
    )
    faults = [*faults, *more]
    lengths = {name: len(value) for name, value in lists.items()}
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"{name}: {lengths[name]}" for name in INPUTS if name in lengths)
        first = next(lengths[name] for name in INPUTS if name in lengths)
        faults += [
            FieldFault.of(name, f"lists must have one length; given {told}")
            for name in INPUTS
            if lengths.get(name, first) != first
        ]
    if faults:
        refuse(faults)
    reasons: dict[int, Reason] = {}
    columns = {name: np.array([value]) for name, value in plain.items()}
    for name in INPUTS:  # in their order, so that the first bad field of a case is told
        if name in lists:
            columns[name] = _column(name, lists[name], reasons)
    if "f" in lists:
        with np.errstate(over="ignore"):  # infinite, which is refused
            columns["omega"] = columns["f"] * RAD_PER_CYCLE
    size = next(iter(lengths.values()), 1)
    return Columns(size, [columns[name] for name in FIELDS], reasons, "f" in lists, bool(lists))


def joined(name: str, parts: list[Any]) -> list[Any] | Array:
    """The parts of a column, arrays and lists, as one array, or as a list if one is a list."""
    if any(isinstance(part, list) for part in parts):
        lists = (part if isinstance(part, list) else _listed(name, part) for part in parts)
        return list(chain.from_iterable(lists))
    return parts[1] if len(parts) == 2 else np.concatenate(parts)


def _listed(name: str, part: Array) -> list[Any]:
    return [RIGID if name == "k" and value == math.inf else value for value in part.tolist()]


def _column(name: str, values: list[Any] | Array, reasons: dict[int, Reason]) -> Array:
    if isinstance(values, np.ndarray):
        return values
    column = np.empty(len(values))
    told = 0
    for i, value in enumerate(values):
        column[i], reason = number(name, value, null_is_rigid=False)
        if reason is not None and told < MAX_ERRORS:
            told += 1
            reasons.setdefault(i, (name, reason))
    return column

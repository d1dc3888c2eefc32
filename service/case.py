"""A case, many cases, and the options of a request: the only place where they are checked.

Every form of asking decodes to ``{name: number | list | array}``.  :func:`checked` checks one case
and :func:`columns_of` many, both entry by entry with :func:`number`; names, bounds and reasons are
those of :mod:`mumacro.inputs.fields`.  The models of cases describe the same in OpenAPI.
"""

import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from mumacro.inputs.fields import (
    BOUNDS,
    GAP,
    MOST_HZ,
    POSITIVE,
    RAD_PER_CYCLE,
    RIGID,
    is_rigid,
    refusal,
)
from mumacro.inputs.fields import NAMES as INPUTS
from mumacro.inputs.k_range import BOUND, ENDS
from mumacro.inputs.kind import AMPLITUDE, SPRING
from mumacro.inputs.kind import Kind as ContactKind
from mumacro.inputs.units import number_hint, unknown_name
from mumacro.kernel.arrays import Array

from .problems import FieldFault, Kind, RequestError, refuse

#: the bad field, or None for the case as a whole, and why
Reason = tuple[str | None, str]
MAX_ERRORS = 1000  # bad cases of a batch that are listed
_STATE = {
    "omega": "is required: omega [rad/s], or f [Hz] in its place",
    "k": f"is required: the tangential stiffness [N/m], or {RIGID}",
}
LEFT_OUT = "must be left out: it is the unknown or swept input"
_INTERVAL = frozenset(("k_range", *ENDS))
_NAMES, _FREQUENCIES = frozenset(INPUTS), {"omega", "f"}
#: smallest and largest value of each input
LEAST = {name: 5e-324 if name in POSITIVE else 0.0 for name in BOUNDS}
_MOST = dict.fromkeys(LEAST, sys.float_info.max) | {"f": MOST_HZ}


class Asked(NamedTuple):
    """What the cases of a request are: their contact and direction, and whether k is an
    interval."""

    kind: ContactKind = SPRING
    interval: bool = False

    @property
    def fields(self) -> tuple[str, ...]:
        """The inputs of a case, by name and in order."""
        found = self.kind.fields
        return (
            tuple(end for name in found for end in (ENDS if name == "k" else (name,)))
            if self.interval
            else found
        )

    @property
    def names(self) -> tuple[str, ...]:
        """All names that a case may have."""
        return (*self.fields[:-1], "f", self.fields[-1])


PLAIN = Asked()


def asked_of(given: Iterable[str], kind: ContactKind = SPRING) -> Asked:
    """What cases with these names are."""
    interval = not _INTERVAL.isdisjoint(given)
    return Asked(kind, interval) if interval or kind != SPRING else PLAIN


# --- one value, one case --------------------------------------------------------------------------


def number(name: str, value: object) -> tuple[float, str | None]:
    """The value of an input and None; or NaN and the reason why it is none.  A rigid contact is
    infinite."""
    if type(value) is float or type(value) is int:
        try:
            found = float(value)
        except OverflowError:
            found = math.inf
        if LEAST[name] <= found <= _MOST[name]:
            return found, None
        return math.nan, refusal(name, found)
    if name == "k" and isinstance(value, str) and is_rigid(value):
        return math.inf, None
    if value is None:
        return math.nan, GAP if name == "k" else "is required"
    return math.nan, number_hint(name, value)


def not_finite(name: str, value: Any, *place: int) -> FieldFault | None:
    """The fault of a value, or of an entry of a list, that is no finite number; None: it is one."""
    kind = type(value) in (int, float)
    if kind and abs(value) <= sys.float_info.max:
        return None
    return FieldFault((name, *place), "must be finite" if kind else number_hint(name, value), value)


def faults_in(
    given: Iterable[str], left_out: Iterable[str] = (), asked: Asked = PLAIN
) -> list[FieldFault]:
    """Faults between the names of the inputs that are given: missing ones, omega and f, or one that
    is asked for."""
    names, out = set(given), set(left_out)
    if out & _FREQUENCIES:
        out |= _FREQUENCIES
    faults = [FieldFault.of(name, LEFT_OUT) for name in asked.names if name in names & out]
    there = names | out | ({"omega"} if "f" in names else set())
    faults += [
        FieldFault.of(name, _STATE.get(name, "is required"))
        for name in asked.fields
        if name not in there
    ]
    if names - out >= _FREQUENCIES:
        faults.append(
            FieldFault.of("f", "omega is given, too: give exactly one of omega [rad/s] and f [Hz]")
        )
    return faults


def checked(
    given: Mapping[str, Any],
    left_out: Iterable[str] = (),
    known: Iterable[str] = INPUTS,
    asked: Asked = PLAIN,
) -> tuple[dict[str, Any], list[FieldFault]]:
    """The inputs of one case by field, with ``omega`` for ``f``, and all of its faults.

    ``left_out`` are the inputs that the request asks for, which must not be given.  ``known`` are
    all names that the request may have, for the advice on others.
    """
    values: dict[str, float] = {}
    faults: list[FieldFault] = []
    names = _NAMES
    if asked is not PLAIN:
        names, (given, faults) = frozenset(asked.names), _with_ends(given)
    for name, value in given.items():
        if name not in names:
            told = stranger(name, asked, known) if len(faults) < 100 else "unknown"
            faults.append(FieldFault.of(name, told, value))
        elif value is not None or name not in ("omega", "f"):
            values[name], reason = number(name, value)
            if reason is not None:
                faults.append(FieldFault.of(name, reason, value))
    if (
        asked is not PLAIN
        or left_out
        or len(values) != 6
        or not ("omega" in values) ^ ("f" in values)
    ):
        faults += faults_in(values, left_out, asked)
    if "f" in values and not faults:
        values["omega"] = RAD_PER_CYCLE * values.pop("f")
    return values, faults


def stranger(name: str, asked: Asked, known: Iterable[str]) -> str:
    """Why such cases have no input of this name."""
    if name in ("y0", AMPLITUDE):
        amplitude = asked.kind.fields[3]
        return (
            f"must be left out for direction {asked.kind.names['direction']}, whose amplitude "
            f"is {amplitude}"
        )
    return "must be left out beside an interval of it" if name == "k" else unknown_name(name, known)


def _with_ends(given: Mapping[str, Any]) -> tuple[Mapping[str, Any], list[FieldFault]]:
    """The inputs with both ends of an interval for ``k_range``, and faults."""
    if "k_range" not in given:
        return given, []
    rest = {name: value for name, value in given.items() if name not in _INTERVAL}
    faults = [
        FieldFault.of(end, "must be left out beside k_range")
        for end in ENDS
        if given.get(end) is not None
    ]
    pair = given["k_range"]
    if isinstance(pair, (list, tuple)) and len(pair) == 2:
        return {**rest, **dict(zip(ENDS, pair, strict=True))}, faults
    return {**rest, **dict.fromkeys(ENDS, 1.0)}, [
        *faults,
        FieldFault.of("k_range", f"must be {BOUND}", pair),
    ]


# --- many cases -----------------------------------------------------------------------------------


@dataclass
class Columns:
    """The inputs of ``size`` cases."""

    size: int
    #: in the order of the fields, (size,) or (1,) where one value holds for all; a value that is no
    #: number is NaN
    six: list[Array]
    #: why a case could not be read, for the first MAX_ERRORS of each column; such a case has a NaN
    reasons: dict[int, Reason] = field(default_factory=dict)
    hertz: bool = False  # whether the frequency was given as f
    listed: bool = True  # whether any input came as a list
    rows: bool = False  # whether the cases came one by one
    asked: Asked = PLAIN

    def part(self, start: int, stop: int) -> list[Array]:
        """The columns of the cases from ``start`` to ``stop``."""
        return [column[start:stop] if column.size > 1 else column for column in self.six]

    def reason(self, index: int) -> Reason:
        """Why a case is bad."""
        if index in self.reasons:
            return self.reasons[index]
        case = {}
        for name, column in zip(self.asked.fields, self.six, strict=True):
            case[name] = value = column[index if column.size > 1 else 0].item()
            if not LEAST[name] <= value <= (math.inf if name == "k" else _MOST[name]):
                shown = "f" if name == "omega" and self.hertz else name
                return shown, refusal(shown, value)
        if self.asked.interval and case["k_low"] > case["k_high"]:
            return "k_low", f"must be <= k_high, which is {case['k_high']!r}"
        if AMPLITUDE in case and not case[AMPLITUDE] < case["Fz"]:
            return (
                AMPLITUDE,
                f"must be below Fz, which is {case['Fz']!r}: at Fz the contact lifts off",
            )
        return None, "is no legal case"


def too_large(max_batch: int) -> RequestError:
    """The error for a batch with more cases than the settings allow."""
    told = (
        f"a batch may have up to {max_batch} cases, this one has more: split it, or stream it "
        "as NDJSON"
    )
    return RequestError(Kind.BATCH_TOO_LARGE, told, max_batch=max_batch)


def columns_of(
    given: Mapping[str, Any],
    max_batch: int,
    known: Iterable[str] = INPUTS,
    faults: Iterable[FieldFault] = (),
    kind: ContactKind = SPRING,
) -> Columns:
    """Columns from numbers, lists and arrays of float64 by name.

    A bad entry of a list spoils its own case; a bad name or a bad number that holds for every case
    refuses the batch, together with the ``faults`` that were found before.
    """
    asked = asked_of(given, kind)
    names = asked.names
    lists = {name: given[name] for name in names if isinstance(given.get(name), (list, np.ndarray))}
    if any(len(value) > max_batch for value in lists.values()):
        raise too_large(max_batch)
    alone = {name: 1.0 if name in lists else value for name, value in given.items()}
    plain, of_values = checked(alone, known=known, asked=asked)
    size = len(next(iter(lists.values()), "1"))
    told = "lists must have one length; given " + ", ".join(
        f"{name}: {len(value)}" for name, value in lists.items()
    )
    of_lengths = [FieldFault.of(name, told) for name, value in lists.items() if len(value) != size]
    if found := [*faults, *of_values, *of_lengths]:
        refuse(found)
    reasons: dict[int, Reason] = {}
    columns = {name: np.array([value]) for name, value in plain.items()}
    # in the order of the names, so that the first bad field of a case is told
    for name, value in lists.items():
        columns[name] = value if isinstance(value, np.ndarray) else numbers(name, value, reasons)
    if "f" in lists:
        with np.errstate(over="ignore"):  # infinite, which is refused
            columns["omega"] = columns["f"] * RAD_PER_CYCLE
    return Columns(
        size,
        [columns[name] for name in asked.fields],
        reasons,
        "f" in lists,
        bool(lists),
        asked=asked,
    )


def numbers(name: str, values: Sequence[Any], reasons: dict[int, Reason], first: int = 0) -> Array:
    """A column, NaN where there is no number; why, for the first MAX_ERRORS of them, by its place
    from ``first`` on."""
    column, told = np.empty(len(values)), 0
    for i, value in enumerate(values):
        column[i], reason = number(name, value)
        if reason is not None and told < MAX_ERRORS:
            told += 1
            reasons.setdefault(first + i, (name, reason))
    return column

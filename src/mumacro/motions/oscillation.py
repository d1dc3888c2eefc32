"""Read one oscillation of a motion as harmonics: a number, a text such as ``2um@90deg``, a pair,
mappings, or a list of harmonics."""

import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.columns import to_si
from mumacro.inputs.fields import QUANTITY_OF
from mumacro.inputs.names import unknown_name
from mumacro.inputs.numbers import read_number, tidy

MOST_HARMONIC = 1000
WHOLE = (
    f"a whole number from 1 to {MOST_HARMONIC}: other ratios have no period 2 pi/omega; give the "
    "frequency of which all are multiples"
)
_FORM = (
    'an amplitude, a text such as "2um@90deg" or "2um, 3:0.4um@90deg", a pair (amplitude, phase '
    "in degrees), or a list of triples (harmonic, amplitude, phase in degrees)"
)
_SAMPLES = (
    ">= 0: an array has one amplitude for each case, and a tuple of two is (amplitude, phase in "
    "degrees); samples of a motion over its period are turned into harmonics by "
    "mumacro.harmonics(samples).terms"
)
MEMBERS = ("harmonic", "amplitude", "phase")
#: harmonic, amplitude in SI, phase in degrees; the last two are numbers or arrays
Harmonic = tuple[int, Any, Any]


def read_oscillation(name: str, value: Any) -> list[Harmonic]:
    """Return the harmonics of x, y [m] or of the normal force [N].

    InputError names the part: ``x``, or ``x, harmonic``, ``x, amplitude``, ``x, phase``.  An array
    with a negative amplitude is refused, because it may hold samples of a motion.

    >>> read_oscillation("y", "2um, 3:0.5um@90deg")
    [(1, 2e-06, 0.0), (3, 5e-07, 90.0)]
    >>> read_oscillation("x", (1e-6, 90.0))
    [(1, 1e-06, 90.0)]
    >>> read_oscillation("x", {"amplitude": "1um", "phase": "1.5707963267948966 rad"})
    [(1, 1e-06, 90.0)]
    """
    return [
        (_harmonic(name, one[0]), _amplitude(name, one[1]), _phase(name, one[2]))
        for one in _parts(name, value)
    ]


def _parts(name: str, value: Any) -> list[tuple[Any, Any, Any]]:
    """Return harmonic, amplitude and phase of each part, as the caller wrote them."""
    if isinstance(value, str):
        return _of_text(name, value)
    if isinstance(value, Mapping):
        return [_of_mapping(name, value)]
    triples = isinstance(value, tuple) and all(map(_is_term, value))
    if isinstance(value, tuple) and not triples:
        if len(value) != 2:
            _refuse_samples(name, value)
            raise InputError(name, value, f"{_FORM}; amplitudes of several cases are an array")
        return [(1, *value)]
    if isinstance(value, (list, tuple)) and all(
        isinstance(one, (list, tuple, Mapping)) for one in value
    ):
        parts = [_of_mapping(name, one) if isinstance(one, Mapping) else one for one in value]
        if any(len(one) != 3 for one in parts):
            raise InputError(name, value, _FORM)
        return [(one[0], one[1], one[2]) for one in parts]
    return [(1, value, 0.0)]


def _is_term(part: Any) -> bool:
    """Return whether a part of a tuple is a harmonic, and not an amplitude or a phase."""
    return isinstance(part, Mapping) or (isinstance(part, tuple) and len(part) == 3)


def _of_text(name: str, text: str) -> list[tuple[Any, Any, Any]]:
    """Return the parts of ``harmonic:amplitude@phase``; several harmonics are separated by commas.

    A comma without a harmonic after it is a decimal separator.
    """
    pieces: list[str] = []
    for piece in tidy(text).split(","):
        if pieces and ":" not in piece:
            pieces[-1] += f",{piece}"
        else:
            pieces.append(piece)
    parts = []
    for piece in pieces:
        before, colon, rest = piece.rpartition(":")
        amplitude, separator, phase = rest.partition("@")
        if (
            ":" in before
            or "@" in phase
            or not amplitude.strip()
            or (separator and not phase.strip())
        ):
            raise InputError(name, text, _FORM)
        if not separator and (meant := _with_phase(name, amplitude)):
            bound = f"an amplitude, and its phase behind @: did you mean {meant}?"
            raise InputError(name, text, bound)
        parts.append((before.strip() if colon else 1, amplitude, phase if separator else 0.0))
    return parts


# a comma between digits is a decimal separator, any other comma separates harmonics
_BETWEEN = (re.compile(r"[\s;∠]+|,(?!\d)|(?<!\d),"), re.compile(r"[\s;∠,]+"))
_WORDS = ("phase", "at", "and", "with")


def _with_phase(name: str, text: str) -> str | None:
    """Return what an amplitude and a phase without @ between them may mean, or None if the text has
    no such pair.

    >>> _with_phase("x", "0.5 um, phase 90 deg"), _with_phase("x", "0.5 um")
    ('0.5um@90deg', None)
    """
    if _reads(_amplitude, name, text):  # also with a decimal comma
        return None
    for between in _BETWEEN:
        words = [word for word in between.split(text) if word and word not in _WORDS]
        for number in (1, 2):  # words of the phase
            amplitude, phase = "".join(words[:-number]), "".join(words[-number:])
            if amplitude and _reads(_amplitude, name, amplitude) and _reads(_phase, name, phase):
                return f"{amplitude}@{phase}{'deg' if phase[-1].isdigit() else ''}"
    return None


def _reads(read_part: Callable[[str, Any], Any], name: str, text: str) -> bool:
    try:
        read_part(name, text)
    except InputError:
        return False
    return True


def _of_mapping(name: str, value: Mapping[str, Any]) -> tuple[Any, Any, Any]:
    if unknown := [member for member in value if member not in MEMBERS]:
        raise InputError(
            f"{name}, {unknown[0]}", value[unknown[0]], unknown_name(str(unknown[0]), MEMBERS)
        )
    if value.get("amplitude") is None:
        raise InputError(f"{name}, amplitude", None, "given")
    return value.get("harmonic", 1), value["amplitude"], value.get("phase", 0.0)


def _harmonic(name: str, value: Any) -> int:
    try:
        order = read_number(value) if isinstance(value, str) else float(value)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}, harmonic", value, WHOLE) from error
    if isinstance(value, bool) or not (order.is_integer() and 1.0 <= order <= MOST_HARMONIC):
        raise InputError(f"{name}, harmonic", value, WHOLE)
    return int(order)


def _amplitude(name: str, value: Any) -> Any:
    size = to_si(f"{name}, amplitude", value, QUANTITY_OF[name])
    if np.ndim(size):
        _refuse_samples(name, size)
    return size


def _refuse_samples(name: str, values: Any) -> None:
    """Raise InputError if one of several amplitudes is negative, as samples of a motion are."""
    try:
        numbers = np.asarray(values, np.float64).ravel()
    except (TypeError, ValueError):
        return
    negative = np.flatnonzero(numbers < 0.0)
    if negative.size:
        index = int(negative[0])
        raise InputError(f"{name}, amplitude", float(numbers[index]), _SAMPLES, index)


def _phase(name: str, value: Any) -> Any:
    return to_si(f"{name}, phase", value, "angle")

"""Read one case as a person gives it: convert the value of one input to a number in SI.

A value is a number, a text as a person types it, or a value with a unit or a deviation.  Keywords,
mappings, command, query, page and JSON of one case are read here; arrays are columns
(:mod:`mumacro.inputs.columns`).  A value that is refused is named, with the remedy.
"""

import functools
import math
import re
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.carried import carried_unit, numbers_in, read_unit, uncertain, without_mask
from mumacro.inputs.fields import GAP, STIFFNESS, is_rigid
from mumacro.inputs.numbers import split_number, tidy
from mumacro.inputs.units import (
    QUANTITIES,
    Scale,
    Unit,
    canonical,
    explain_unit,
    parse_unit,
    quantity_of,
)

#: types of one real number, without truth values
NUMBERS: Final = frozenset((float, int, *(np.dtype(code).type for code in "efdbhilqBHILQ")))
A_NUMBER = "a real number or an array of them"
LONGEST = 200  # limit of the characters of a value
#: characters between a value and its deviation
_DEVIATIONS = ("±", "+/-", "+-")
#: quantities that may be the word rigid, or an interval
OR_RIGID = ("stiffness", "pressure")
_INTERVAL = "two stiffnesses [N/m] with 0 < low <= high, both finite"
_IN_RANGE = "at most 1.8e308 in SI, the largest number there is"
_GAPS = ("NAType", "NaTType")  # types of pandas, by name
_ONE_NUMBER = "one number: k alone may be an interval; ask for both ends, one after the other"
#: commands whose answer has no deviation
NO_DEVIATION = "without a deviation, which only an answer to given cases has"
_NOT_BOTH = "an interval or a deviation, not both; rigid has neither"
# a deviation in units of the last digits: 1.00(10) N/um
_LAST_DIGITS = re.compile(
    r"(?P<number>[+-]?\d{1,15}(?:[.,](?P<part>\d{1,15}))?)\((?P<std>\d{1,9})\)(?P<unit> ?\D{0,40})",
    re.ASCII,
)
_NOT_FINITE = re.compile("[+-]?(inf|infinity|nan)", re.IGNORECASE | re.ASCII)
# if a ratio before a deviation in per cent is larger, it may be in per cent, too
_SURE_RATIO = 1.5


class Value(NamedTuple):
    """Hold one input as it was understood, in SI."""

    #: the value; for an interval its geometric middle; infinite if rigid
    si: Any
    std: Any = None  #: one standard deviation
    low: Any = None  #: ends of an interval
    high: Any = None
    text: str | None = None  #: the text, if the value was a text
    unit: str | None = None  #: the unit that was understood; None if the number is in SI

    def scaled(self, name: str, unit: Unit) -> "Value":
        """Return the same numbers of an input, read in a unit."""
        si, std, low, high = (
            None if part is None else _in_si(name, f"{part!r} {unit.symbol}", part, unit.scale)
            for part in self[:4]
        )
        return Value(si, std, low, high, self.text, unit.symbol)


def read(name: str, value: Any, quantity: str = "") -> Value:
    """Return one value of an input, or of another argument, in SI.

    Parameters
    ----------
    name : str
        Name of the input, for messages; :data:`mumacro.inputs.fields.QUANTITY_OF` has its quantity.
    value : number, str, quantity
        A number is in SI, a phase in degrees.  A :class:`Value` has been read before.
    quantity : str
        Its quantity, for a name that is not in the list.

    Raises
    ------
    InputError
        If there is no value or more than one, a unit that the input cannot have, or a text that may
        mean two numbers.  Bounds are not checked here.

    Examples
    --------
    >>> read("y0", 2e-6), read("y0", "2 um").si, read("k", "rigid").si
    (Value(si=2e-06, std=None, low=None, high=None, text=None, unit=None), 2e-06, inf)
    >>> read("k", "1 ± 0.1 N/um").std, read("k", "0.8..1.2 N/um")[2:4]
    (100000.0, (800000.0, 1200000.0))
    """
    of_type = type(value)
    if of_type is float:
        return Value(value)
    if of_type in NUMBERS:
        return Value(as_double(name, value))
    if of_type is Value:  # read before
        return value  # type: ignore[no-any-return]
    if of_type is str:
        return _of_text(name, quantity, value)
    quantity = quantity or quantity_of(name)
    if is_gap(value):
        raise InputError(name, None, STIFFNESS if name == "k" else A_NUMBER)
    if isinstance(value, str):
        return _of_text(name, quantity, str(value))
    unit = carried_unit(value)
    if unit is not None:
        of_value = read_unit(name, unit, quantity, value)
        number = numbers_in(value)
        if isinstance(number, np.ndarray) and number.dtype == object and not number.ndim:
            raise InputError(name, value, A_NUMBER)  # nothing that its library calls a number
        return read(name, number, quantity).scaled(name, of_value)
    if (pair := uncertain(value)) is not None:
        return Value(*pair)
    plain = without_mask(value)
    if plain is not value:
        return read(name, plain, quantity)
    array = _array(name, value)
    if array.ndim:
        raise InputError(name, value, "one number")
    if array.dtype.kind in "fiu":
        return Value(as_double(name, array[()]))
    inside = array.item()
    if inside is value:
        return Value(other_number(name, value))
    if array.dtype.kind not in "OU":
        raise InputError(name, value, A_NUMBER)
    return read(name, inside, quantity)  # an array without a dimension


def _array(name: str, value: Any) -> Any:
    """Return a value of any type as an array of NumPy."""
    if isinstance(value, (bytes, bytearray, Mapping, set, frozenset)):
        raise InputError(name, value, A_NUMBER)
    try:
        return np.asarray(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(name, value, A_NUMBER) from None


def is_gap(value: Any) -> bool:
    """Return whether a value is a gap: None, an empty text, NA and NaT of pandas, or a masked
    entry."""
    if value is None or value is np.ma.masked or type(value).__name__ in _GAPS:
        return True
    return isinstance(value, str) and not value.strip()


def read_one(name: str, value: Any, quantity: str = "") -> float:
    """Return one number in SI. Raise InputError as :func:`read` does, and also for a deviation or
    an interval.

    >>> read_one("radius", "5mm")
    0.005
    """
    one = read(name, value, quantity)
    if one.low is not None:
        raise InputError(name, value, _ONE_NUMBER)
    if one.std is not None:
        raise InputError(name, value, NO_DEVIATION)
    return float(one.si)


def reason_of(bound: str) -> str:
    """Return the bound of an error as a sentence without its subject."""
    if bound == STIFFNESS:  # the bound of a gap, in the words of files and JSON
        return GAP
    return bound if bound.startswith(("is ", "must ")) else f"must be {bound}"


def no_number(name: str, value: object) -> str:
    """Return why a value that is neither a number nor a text is refused in JSON.

    >>> no_number("k", None), no_number("v0", None), no_number("y0", True)
    ('is missing; write rigid or a number', 'is required', 'must be a number')
    """
    if value is None:
        return GAP if name == "k" else "is required"
    return "must be a number, not a text" if isinstance(value, str) else "must be a number"


def as_double(name: str, value: Any, index: int | None = None) -> float:
    """Return one number as a double.  Raise InputError for a number beyond double range, which must
    not become a rigid contact."""
    try:
        number = float(value)
    except OverflowError:
        raise InputError(name, value, _IN_RANGE, index) from None
    if math.isinf(number) and type(value) is not float and value != number:
        raise InputError(name, value, _IN_RANGE, index)
    return number


def other_number(name: str, value: Any, index: int | None = None) -> float:
    """Return a number of another type, such as Decimal.  Raise InputError for truth values, complex
    numbers and times."""
    if isinstance(value, (bool, complex, bytes, np.generic)):
        raise InputError(name, value, A_NUMBER, index)
    try:
        return as_double(name, value, index)
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(name, value, A_NUMBER, index) from None


# --- texts ----------------------------------------------------------------------------------------


@functools.lru_cache(4096)
def _of_text(name: str, quantity: str, raw: str) -> Value:
    """Return a value from the text that a person types."""
    if len(raw) > LONGEST:
        raise InputError(name, f"{raw[:40]}…", "a number, with or without a unit")
    text, quantity = tidy(raw), quantity or quantity_of(name)
    rigid = quantity in OR_RIGID
    if rigid and is_rigid(text):
        return Value(math.inf, text=raw)
    if _NOT_FINITE.fullmatch(text):
        return Value(float(text), text=raw)
    if not text:
        raise InputError(name, raw, _of_no_number(quantity, "must be a number"))
    if rigid and "rigid" in text.lower() and any(mark in text for mark in (*_DEVIATIONS, "..")):
        raise InputError(name, raw, _NOT_BOTH)
    try:
        for mark in _DEVIATIONS:
            if mark in text:
                if ".." in text:
                    raise InputError(name, raw, _NOT_BOTH)
                return _with_deviation(name, quantity, raw, text, mark)
        if ".." in text or "…" in text:
            return _interval(name, quantity, raw, text.replace("…", ".."))
        number, unit = split_number(text)
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(name, raw, _of_no_number(quantity, str(error))) from None
    scale, symbol = _parse_or_refuse(name, quantity, raw, number, unit)
    return Value(_in_si(name, raw, number, scale), text=raw, unit=symbol)


def _in_si(name: str, shown: str, number: float, scale: Scale) -> float:
    """Return a number in SI. Raise InputError beyond double range, because a large stiffness is not
    a rigid contact."""
    si = scale.si(number)
    if math.isinf(si) and math.isfinite(number):
        raise InputError(name, shown, _IN_RANGE)
    return si


def _of_no_number(quantity: str, reason: str) -> str:
    """Return the bound for a text that has no number, or may mean two numbers."""
    about, reason = QUANTITIES[quantity], reason.removeprefix("must be ")
    if reason != "a number":
        return f"one number: it {reason}" if reason.startswith(("is ", "may ")) else reason
    word = ", or rigid" if quantity in OR_RIGID else ""
    return f"a number [{about.unit}], or with a unit such as {about.such_as}{word}"


def _parse_or_refuse(
    name: str, quantity: str, raw: str, number: float, unit: str
) -> tuple[Scale, str | None]:
    """Return the scale and the symbol of a unit (no symbol if there is no unit).  Raise InputError
    for a unit that the quantity cannot have."""
    if not unit:
        return Scale(), None
    parsed = parse_unit(quantity, unit)
    if parsed is not None:
        return parsed.scale, parsed.symbol or None
    if unit.startswith(("-", "to ")):
        try:
            high, behind = split_number(unit.removeprefix("-").removeprefix("to ").strip())
        except ValueError:
            pass
        else:
            if not behind or parse_unit(quantity, behind):
                ends = f"{number:.12g}..{high:.12g}{behind}"
                bound = f"a number; write an interval as {ends}" if name == "k" else _ONE_NUMBER
                raise InputError(name, raw, bound)
    if (last := _LAST_DIGITS.fullmatch(tidy(raw))) is not None:
        deviation = f"{int(last['std']) / 10 ** len(last['part'] or ''):.12g}"
        value_text = f"{last['number'].replace(',', '.')} ± {deviation}{last['unit']}"
        raise InputError(name, raw, f"a number; write its deviation as {value_text}")
    raise InputError(name, raw, explain_unit(quantity, number, unit))


def _with_deviation(name: str, quantity: str, raw: str, text: str, mark: str) -> Value:
    """Read ``1 ± 0.1 N/um``, ``1 N/um ± 10 %``, ``1 ± 10 % N/um`` or ``(1 ± 0.1) N/um``."""
    together, outside = text.startswith("("), ""
    if together:
        inside, _, outside = text[1:].partition(")")
        text = f"{inside} {outside}"
    left, _, right = text.partition(mark)
    number, unit = split_number(left.strip())
    deviation, behind = split_number(right.strip())
    if deviation < 0.0 or not math.isfinite(deviation):
        raise InputError(name, raw, "a number and a deviation >= 0")
    of_both = outside.lstrip().startswith("%")  # the value is in per cent, too
    if not unit and quantity != "ratio" and behind.startswith("%") and not of_both:
        unit, behind, together = behind[1:].strip(), "%", False
    relative = canonical(behind) == "%" and canonical(unit) != "%" and not together
    if relative and not unit and quantity == "ratio" and abs(number) > _SURE_RATIO:
        in_percent = f"({number:.12g} ± {deviation:.12g}) %"
        bound = f"clear: it may be {in_percent}; write that, or the deviation without %"
        raise InputError(name, raw, bound)
    of_value = unit if relative else unit or behind
    scale, symbol = _parse_or_refuse(name, quantity, raw, number, of_value)
    value = _in_si(name, raw, number, scale)
    if relative:
        return Value(value, abs(value) * deviation / 100.0, text=raw, unit=symbol)
    scale, _ = _parse_or_refuse(name, quantity, raw, deviation, behind or unit)
    return Value(value, _in_si(name, raw, deviation, scale), text=raw, unit=symbol)


def _interval(name: str, quantity: str, raw: str, text: str) -> Value:
    """Read ``0.8..1.2 N/um``; a unit after the second end holds for both ends."""
    if name != "k":
        raise InputError(name, raw, _ONE_NUMBER)
    left, _, right = text.partition("..")
    low, unit = split_number(left.strip())
    high, behind = split_number(right.strip(" ."))
    scale_of_low, _ = _parse_or_refuse(name, quantity, raw, low, unit or behind)
    scale, symbol = _parse_or_refuse(name, quantity, raw, high, behind or unit)
    ends = _in_si(name, raw, low, scale_of_low), _in_si(name, raw, high, scale)
    if not 0.0 < ends[0] <= ends[1] < math.inf:
        raise InputError(name, raw, _INTERVAL)
    middle = min(max(math.sqrt(ends[0]) * math.sqrt(ends[1]), ends[0]), ends[1])
    return Value(middle, None, *ends, raw, symbol)


# --- the texts of one case ------------------------------------------------------------------------

# a comma that can only be decimal, points that can only separate thousands; a point that may be
# either
_GERMAN = re.compile(r"\d,(?:\d{1,2}|\d{4,})(?!\d)|\d\.\d{3}\.\d{3}(?!\d)|\d\.\d{3},\d")
_EITHER = re.compile(r"(?<![\d.,])([1-9]\d{0,2})\.(\d{3})(?![\d.,])")


def check_signs(texts: Mapping[str, str]) -> None:
    """Raise InputError for a text of a case that is ambiguous because of another one: if another
    text has a decimal comma, 20.000 may be twenty thousand.

    >>> check_signs({"mu0": "0,3", "f": "20 kHz", "v0": "0.01"})
    """
    german = next((name for name, text in texts.items() if _GERMAN.search(text)), None)
    if german is None:
        return
    for name, text in texts.items():
        if match := _EITHER.search(text):
            whole, part = f"{match[1]}{match[2]}", f"{float(match[0]):g}"
            bound = f'clear beside {german} = "{texts[german]}": it may be {whole} or {part}'
            raise InputError(name, text, f"{bound}; write that")

"""One value of one input, of any type, read in SI: a number, a text as a person types it, a value
that carries a unit or a deviation, and arrays of all of these.

Every entrance reads here: keywords, mappings, frames, files, command, query and JSON.  A value is
understood or refused by its name, with the remedy.  Units and deviations are found by what values
of pint, astropy, unyt, xarray and uncertainties can do; none of these packages is imported.
"""

import functools
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.fields import GAP, QUANTITY_OF, STIFFNESS, is_rigid
from mumacro.inputs.numbers import split_number, tidy
from mumacro.inputs.units import (
    QUANTITIES,
    Scale,
    bound_of_unit,
    canonical,
    is_level,
    scale_in,
    unit_in,
)

#: types of one real number; a truth value is none
NUMBERS: Final = frozenset((float, int, *(np.dtype(code).type for code in "efdbhilqBHILQ")))
_REAL = "fiu"  # kinds of arrays of real numbers
A_NUMBER = "a real number or an array of them"
LONGEST = 200  # characters of a value
#: signs between a value and its deviation
_DEVIATIONS = ("±", "+/-", "+-")
# may be written as the word rigid, as an interval
_OR_RIGID = ("stiffness", "pressure")
_INTERVAL = "two stiffnesses [N/m] with 0 < low <= high, both finite"
_IN_RANGE = "at most 1.8e308, the largest number there is"
_GAPS = ("NAType", "NaTType")  # of pandas, by the name of the type
_ONE_NUMBER = "one number: k alone may be an interval; ask for both ends, one after the other"
#: where an answer has no deviation of its own
NO_DEVIATION = "without a deviation, which only an answer to given cases has"
_NOT_BOTH = "an interval or a deviation, not both; rigid has neither"
# a deviation in units of the last digits: 1.00(10) N/um
_LAST_DIGITS = re.compile(
    r"(?P<number>[+-]?\d{1,15}(?:[.,](?P<part>\d{1,15}))?)\((?P<std>\d{1,9})\)(?P<unit> ?\D{0,40})",
    re.ASCII,
)
# above, a ratio before a deviation in per cent may be meant in per cent, too
_SURE_RATIO = 1.5
# of a unit that turns: without one of them 1/s is a frequency, with one of them it is none
_ANGLES = ("rad", "deg", "°", "turn", "rev", "cycle", "rpm", "arc")


class Value(NamedTuple):
    """What was understood of one input, in SI; each number is a float, or an array of the shape of
    the value."""

    #: the value, of an interval its geometric middle; infinite where rigid
    si: Any
    std: Any = None  #: one standard deviation
    low: Any = None  #: ends of an interval
    high: Any = None
    text: str | None = None  #: as it came, where it came as a text
    unit: str | None = None  #: the unit that was understood; None: the number is in SI

    def scaled(self, scale: Scale, unit: str) -> "Value":
        """The same numbers, meant in a unit."""
        si, std, low, high = (None if part is None else scale.si(part) for part in self[:4])
        return Value(si, std, low, high, self.text, unit)


def read(name: str, value: Any, quantity: str = "") -> Value:
    """The value of an input, or of another argument, in SI.

    Parameters
    ----------
    name : str
        Of the input, for messages; :data:`mumacro.inputs.fields.QUANTITY_OF` has what it measures.
    value : number, str, quantity, array_like
        A number is in SI, a phase in degrees.  An array of numbers is not copied.  A
        :class:`Value` has been read before.
    quantity : str
        What it measures, for a name that is not in the list.

    Raises
    ------
    InputError
        No value, a unit that the input cannot have, a text that may mean two numbers.  Bounds are
        not checked here.

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
        return Value(_double(name, value))
    if of_type is np.ndarray and value.dtype.kind in _REAL:
        return Value(_doubles(name, value))
    if of_type is Value:  # read before
        return value  # type: ignore[no-any-return]
    quantity = quantity or QUANTITY_OF.get(name, "ratio")
    if of_type is str:
        return _of_text(name, quantity, value)
    whole, reasons = _read(name, value, quantity)
    if reasons:
        index, (entry, bound) = next(iter(reasons.items()))
        raise InputError(name, entry, bound, index)
    return whole


def read_one(name: str, value: Any, quantity: str = "") -> float:
    """As :func:`read`, where one number without a deviation is needed.

    >>> read_one("radius", "5mm")
    0.005
    """
    one = read(name, value, quantity)
    if one.low is not None:
        raise InputError(name, value, _ONE_NUMBER)
    if np.ndim(one.si):
        raise InputError(name, value, "one number")
    if one.std is not None:
        raise InputError(name, value, NO_DEVIATION)
    return float(one.si)


def read_column(name: str, values: Any, quantity: str = "") -> tuple[Value, dict[int, str]]:
    """As :func:`read` for an array whose entries spoil only themselves: NaN where one is no value,
    and the reason by its place in the flattened array.

    >>> column, reasons = read_column("y0", [1e-6, "2um", "2 N", None])
    >>> column.si.tolist(), [*reasons]
    ([1e-06, 2e-06, nan, nan], [2, 3])
    """
    if type(values) is np.ndarray and values.dtype.kind in _REAL:
        return read(name, values, quantity), {}
    whole, reasons = _read(name, values, quantity or QUANTITY_OF.get(name, "ratio"))
    missing = GAP if name == "k" else "is missing"
    return whole, {
        index: missing if entry is None or entry == "" else reason_of(bound)
        for index, (entry, bound) in reasons.items()
    }


def reason_of(bound: str) -> str:
    """The bound of an error as a sentence without its subject."""
    if bound == STIFFNESS:  # of a gap, in the words of files and JSON
        return GAP
    return bound if bound.startswith(("is ", "must ")) else f"must be {bound}"


def no_number(name: str, value: object) -> str:
    """Why a value that is neither a number nor a text is refused in JSON.

    >>> no_number("k", None), no_number("v0", None), no_number("y0", True)
    ('is missing; write rigid or a number', 'is required', 'must be a number')
    """
    if value is None:
        return GAP if name == "k" else "is required"
    return "must be a number, not a text" if isinstance(value, str) else "must be a number"


def carries_unit(value: Any) -> bool:
    """Whether a value, such as a quantity of pint or a labelled array with ``attrs["units"]``, says
    its unit."""
    return type(value) not in _WITHOUT_UNIT and _unit(value) is not None


def without_unit(name: str, value: Any, quantity: str = "") -> Any:
    """A labelled value that carries a unit as the same labels with numbers in SI; another value as
    it is.  Chunks of Dask stay lazy.

    InputError for a unit that the input cannot have.
    """
    if not carries_unit(value):
        return value
    library, quantity = _library(value), quantity or QUANTITY_OF.get(name, "ratio")
    if library == "xarray":
        unit = _unit(value)
        scale = _known_scale(name, quantity, unit)
        data = value.data
        numbers = data if _own_unit(data) is None else _magnitude(data)
        plain = value.copy(data=scale.si(numbers))
        plain.attrs = {}
        return plain
    if library == "pandas":
        numbers = read(name, value, quantity).si
        return type(value)(numbers, index=value.index, name=value.name)
    return value


def in_unit(name: str, column: Any, unit: str) -> Any:
    """A column whose head has the unit, such as ``y0 [um]``, in SI and with its labels.

    >>> in_unit("y0", [2.0, 3.0], "um").tolist()
    [2e-06, 3e-06]
    """
    quantity = QUANTITY_OF.get(name.removeprefix("std_"), "ratio")
    scale = scale_in(quantity, unit)
    if scale is None:
        raise InputError(name, f"a column in {unit}", QUANTITIES[quantity].bound)
    kind = getattr(getattr(column, "dtype", None), "kind", "O")
    if _library(column) in ("pandas", "xarray", "dask") and kind in _REAL:
        return scale.si(column)
    numbers: Any = np.asarray(read(name, column, quantity).si)
    numbers = scale.si(numbers)
    if _library(column) == "pandas":
        return type(column)(numbers, index=column.index, name=column.name)
    return numbers


_WITHOUT_UNIT = NUMBERS | {str, list, tuple, dict, type(None), np.ndarray}


# --- arrays ---------------------------------------------------------------------------------------

Reasons = dict[int, tuple[object, str]]  # by place: the entry and its bound


def _read(name: str, value: Any, quantity: str) -> tuple[Value, Reasons]:
    """Any value that is no plain number, array of numbers or text."""
    if value is None:
        raise InputError(name, None, _gap(name))
    if type(value) not in _WITHOUT_UNIT and (unit := _unit(value)) is not None:
        return _of_quantity(name, value, unit, quantity)
    if (pair := _uncertain(value)) is not None:
        return Value(*pair), {}
    value = _without_mask(value)
    if value is None or type(value).__name__ in _GAPS:
        raise InputError(name, None, _gap(name))
    if isinstance(value, (list, tuple)):
        shape, entries = _entries(name, value)
        if NUMBERS.issuperset(map(type, entries)):
            try:
                return Value(np.array(entries, np.float64).reshape(shape)), {}
            except OverflowError:
                pass  # the entry beyond double range is found below
        return _of_entries(name, entries, shape, quantity)
    if isinstance(value, str):
        return _of_text(name, quantity, str(value)), {}
    if isinstance(value, (bytes, bytearray, Mapping, set, frozenset)):
        raise InputError(name, value, A_NUMBER)
    if _library(value) == "pandas" and hasattr(value, "columns"):
        raise InputError(name, "a DataFrame", f"{A_NUMBER}: one column of it")
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(name, value, A_NUMBER) from None
    if array.dtype.kind in _REAL:
        return Value(_doubles(name, array)), {}
    if array.dtype.kind not in "OUT":
        raise InputError(name, value, A_NUMBER)
    if array.ndim == 0 and array.item() is value:
        return Value(_other_number(name, value)), {}
    entries = array.ravel().tolist()
    if not array.ndim:
        return _of_entry(name, entries[0], quantity), {}
    return _of_entries(name, entries, array.shape, quantity)


def _entries(name: str, value: Sequence[Any]) -> tuple[tuple[int, ...], list[Any]]:
    """Shape and entries of nested lists; InputError for lists of several lengths.

    An array that carries a unit is taken apart into entries that carry it.
    """
    if not any(map(_is_row, value)):
        return (len(value),), list(value)
    try:
        parts = [
            (one.shape, one.ravel().tolist()) if type(one) is np.ndarray else _entries(name, [*one])
            for one in value
        ]
    except (TypeError, RecursionError):
        parts = [((), []), ((1,), [])]
    if len({shape for shape, _ in parts}) > 1:
        raise InputError(name, value, f"{A_NUMBER}, its lists of one length")
    return (len(value), *parts[0][0]), [entry for _, entries in parts for entry in entries]


def _is_row(value: Any) -> bool:
    """Whether an entry of a list is a list or an array itself."""
    if isinstance(value, (list, tuple)):
        return True
    dimensions = getattr(value, "ndim", 0)
    return isinstance(dimensions, int) and dimensions > 0


def _of_entries(
    name: str, entries: Sequence[Any], shape: tuple[int, ...], quantity: str
) -> tuple[Value, Reasons]:
    """Entries of several types, one after the other."""
    si, reasons = np.full(len(entries), math.nan), Reasons()
    more: dict[int, Value] = {}
    for i, entry in enumerate(entries):
        try:
            one = _of_entry(name, entry, quantity)
            si[i] = one.si
        except InputError as error:
            reasons[i] = entry, error.bound
            continue
        except (TypeError, ValueError):
            reasons[i] = entry, A_NUMBER
            continue
        if one.std is not None or one.low is not None:
            more[i] = one
    std = low = high = None
    if any(one.std is not None for one in more.values()):
        std = np.zeros(si.size)  # a number has the deviation 0
    if any(one.low is not None for one in more.values()):
        low, high = si.copy(), si.copy()  # and is an interval of itself
    for i, one in more.items():
        if std is not None and one.std is not None:
            std[i] = one.std
        if low is not None and high is not None and one.low is not None:
            low[i], high[i] = one.low, one.high
    parts = [None if x is None else x.reshape(shape) for x in (si, std, low, high)]
    return Value(parts[0], parts[1], parts[2], parts[3]), reasons


def _of_entry(name: str, entry: Any, quantity: str) -> Value:
    """One entry of an array; gaps, also those of pandas and of masks, are refused."""
    if type(entry) is float:
        return Value(entry)
    if entry is None or entry is np.ma.masked:
        raise InputError(name, None, _gap(name))
    one = read(name, entry, quantity)
    if np.ndim(one.si):
        raise InputError(name, entry, "one number in each place")
    return one


def _gap(name: str) -> str:
    return STIFFNESS if name == "k" else A_NUMBER


def _double(name: str, value: Any) -> float:
    """One number as a double; one beyond their range must not pass for a rigid contact."""
    try:
        number = float(value)
    except OverflowError:
        raise InputError(name, value, _IN_RANGE) from None
    if math.isinf(number) and type(value) is not float and value != number:
        raise InputError(name, value, _IN_RANGE)
    return number


def _doubles(name: str, array: Any) -> Any:
    """An array of real numbers as doubles, or the one that it holds without a dimension."""
    with np.errstate(over="ignore"):
        doubles = array.astype(np.float64, copy=False)
    if array.dtype.itemsize > doubles.dtype.itemsize:
        beyond = np.flatnonzero(np.isinf(doubles) & np.isfinite(array))
        if beyond.size:
            index = int(beyond[0]) if array.ndim else None
            raise InputError(name, array.flat[beyond[0]], _IN_RANGE, index)
    return doubles if doubles.ndim else float(doubles)


def _without_mask(value: Any) -> Any:
    """A masked array of NumPy or astropy as a plain one, with NaN or None where it is masked."""
    if isinstance(value, np.ma.MaskedArray):
        plain, mask = value.data, np.ma.getmaskarray(value)
    elif hasattr(value, "unmasked") and hasattr(value, "mask"):
        plain, mask = np.asarray(value.unmasked), np.asarray(value.mask)
    else:
        return value
    gap, dtype = (math.nan, np.float64) if plain.dtype.kind in _REAL else (None, object)
    array = np.array(plain, dtype)
    array[mask] = gap
    return array if array.ndim else array.item()


def _other_number(name: str, value: Any) -> float:
    """A number of another type, such as Decimal; truth values, complex numbers and times are
    none."""
    if isinstance(value, (bool, complex, np.generic)):
        raise InputError(name, value, A_NUMBER)
    try:
        return _double(name, value)
    except (TypeError, ValueError):
        raise InputError(name, value, A_NUMBER) from None


# --- values that carry a unit or a deviation ------------------------------------------------------


def _library(value: Any) -> str:
    return type(value).__module__.partition(".")[0]


def _own_unit(value: Any) -> Any:
    """The unit of a quantity of pint, astropy, unyt and others like them."""
    for attribute in ("units", "unit"):
        unit = getattr(value, attribute, None)
        if unit is not None and not callable(unit) and unit is not value:
            return unit
    return None


def _unit(value: Any) -> Any:
    """The unit that a value carries, None without one."""
    library = _library(value)
    if library not in ("xarray", "pandas"):
        return _own_unit(value) if library != "numpy" else None
    reading = (
        getattr(value.dtype, "units", None)
        if library == "pandas" and hasattr(value, "dtype")
        else _own_unit(getattr(value, "data", None))
        if library == "xarray"
        else None
    )
    if reading is not None:
        return reading
    attributes = getattr(value, "attrs", None) or {}
    text = attributes.get("units", attributes.get("unit"))
    return text if isinstance(text, str) and text.strip() else None


def _magnitude(value: Any) -> Any:
    """The number of a quantity, without its unit."""
    for attribute in ("magnitude", "value", "values"):
        number = getattr(value, attribute, None)
        if number is not None and not callable(number):
            return number
    return np.asarray(value)


def _numbers(value: Any) -> Any:
    """What a value that carries a unit holds, without labels and unit."""
    library = _library(value)
    if library == "pandas":
        array = value.array
        return _magnitude(array.quantity) if hasattr(array, "quantity") else np.asarray(value)
    if library == "xarray":
        data = value.data
        return np.asarray(data) if _own_unit(data) is None else _numbers(data)
    return _magnitude(value.quantity if library == "pint_pandas" else value)


def _unit_text(unit: Any) -> str:
    """A unit as text: short where its library can write it so."""
    if isinstance(unit, str):
        return unit
    try:
        return format(unit, "~C")  # of pint
    except (TypeError, ValueError):
        return str(unit)


def _of_quantity(name: str, value: Any, unit: Any, quantity: str) -> tuple[Value, Reasons]:
    """A value that carries a unit: by the table of units, or by its own library."""
    text = _unit_text(unit)
    scale = scale_in(quantity, text) or scale_in(quantity, str(unit))
    if scale is None:
        si = _converted(value, text, QUANTITIES[quantity].unit, quantity)
        if si is None:
            raise InputError(name, _shown(value, text), _bound(quantity, value, text))
        scale, value = Scale(), si
    numbers = _numbers(value)
    whole, reasons = _read_plain(name, numbers, quantity)
    return whole.scaled(scale, unit_in(quantity, text)), reasons


def _read_plain(name: str, numbers: Any, quantity: str) -> tuple[Value, Reasons]:
    if type(numbers) in NUMBERS or (type(numbers) is np.ndarray and numbers.dtype.kind in _REAL):
        return read(name, numbers, quantity), {}
    return _read(name, numbers, quantity)


def _converted(value: Any, text: str, unit: str, quantity: str) -> Any:
    """A quantity that its own library has converted to an SI unit; None where it cannot be.

    For a frequency libraries take a radian, and a turn, as a plain 1: a factor of 2 pi.
    """
    if not hasattr(value, "to") or is_level(text):
        return None
    turns = any(word in text.lower() for word in _ANGLES)
    hertz = "hz" in text.lower() or "hertz" in text.lower()
    if quantity in ("angular frequency", "angle") and (hertz or not turns):
        return None
    if quantity == "frequency" and turns:
        return None
    for target in (unit, "dimensionless", "") if unit == "-" else (unit,):
        try:
            return value.to(target)
        except Exception:  # noqa: S112 (each library has errors of its own)
            continue
    return None


def _known_scale(name: str, quantity: str, unit: Any) -> Scale:
    """The scale of the unit of a labelled array, without its numbers."""
    text = _unit_text(unit)
    scale = scale_in(quantity, text) or scale_in(quantity, str(unit))
    if scale is None and not isinstance(unit, str):
        one = _converted(1.0 * unit, text, QUANTITIES[quantity].unit, quantity)
        scale = None if one is None else Scale(float(_magnitude(one)))
    if scale is None:
        raise InputError(name, _shown(None, text), _bound(quantity, None, text))
    return scale


def _bound(quantity: str, value: Any, unit: str) -> str:
    try:
        number = float(_numbers(value))
    except (TypeError, ValueError):
        number = math.nan
    if math.isnan(number):
        return QUANTITIES[quantity].bound
    return bound_of_unit(quantity, number, unit)


def _shown(value: Any, unit: str) -> str:
    """A quantity in a message."""
    try:
        return f"{float(_numbers(value)):.12g} {unit or 'without dimension'}"
    except (TypeError, ValueError):
        return f"a value in {unit or 'no unit'}"


def _uncertain(value: Any) -> tuple[float, float] | None:
    """Value and deviation of a number of the package uncertainties, or of one like it."""
    nominal, deviation = (getattr(value, name, None) for name in ("nominal_value", "std_dev"))
    if nominal is None or deviation is None or callable(deviation):
        return None
    return float(nominal), float(deviation)


# --- texts ----------------------------------------------------------------------------------------


@functools.lru_cache(4096)
def _of_text(name: str, quantity: str, raw: str) -> Value:
    """A value as a person types it."""
    if len(raw) > LONGEST:
        raise InputError(name, f"{raw[:40]}…", "a number, with or without a unit")
    text = tidy(raw)
    rigid = quantity in _OR_RIGID
    if rigid and is_rigid(text):
        return Value(math.inf, text=raw)
    if text.lower().strip("+-") in ("inf", "infinity", "nan"):
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
    scale = _scale_or_refuse(name, quantity, raw, number, unit)
    return Value(scale.si(number), text=raw, unit=unit_in(quantity, unit) if unit else None)


def _of_no_number(quantity: str, reason: str) -> str:
    """The bound where a text has no number, or may have two."""
    about, reason = QUANTITIES[quantity], reason.removeprefix("must be ")
    if reason != "a number":
        return f"one number: it {reason}" if reason.startswith(("is ", "may ")) else reason
    word = ", or rigid" if quantity in _OR_RIGID else ""
    return f"a number [{about.unit}], or with a unit such as {about.such_as}{word}"


def _scale_or_refuse(name: str, quantity: str, raw: str, number: float, unit: str) -> Scale:
    if not unit:
        return Scale()
    scale = scale_in(quantity, unit)
    if scale is not None:
        return scale
    if unit.startswith(("-", "to ")):
        try:
            high, behind = split_number(unit.removeprefix("-").removeprefix("to ").strip())
        except ValueError:
            pass
        else:
            if not behind or scale_in(quantity, behind):
                ends = f"{number:.12g}..{high:.12g}{behind}"
                bound = f"a number; write an interval as {ends}" if name == "k" else _ONE_NUMBER
                raise InputError(name, raw, bound)
    if (last := _LAST_DIGITS.fullmatch(tidy(raw))) is not None:
        deviation = f"{int(last['std']) / 10 ** len(last['part'] or ''):.12g}"
        value_text = f"{last['number'].replace(',', '.')} ± {deviation}{last['unit']}"
        raise InputError(name, raw, f"a number; write its deviation as {value_text}")
    raise InputError(name, raw, bound_of_unit(quantity, number, unit))


def _with_deviation(name: str, quantity: str, raw: str, text: str, mark: str) -> Value:
    """``1 ± 0.1 N/um``, ``1 N/um ± 10 %``, ``1 ± 10 % N/um``, ``(1 ± 0.1) N/um``."""
    together, outside = text.startswith("("), ""
    if together:
        inside, _, outside = text[1:].partition(")")
        text = f"{inside} {outside}"
    left, _, right = text.partition(mark)
    number, unit = split_number(left.strip())
    deviation, behind = split_number(right.strip())
    if deviation < 0.0 or not math.isfinite(deviation):
        raise InputError(name, raw, "a number and a deviation >= 0")
    of_both = outside.lstrip().startswith("%")  # of the value, too
    if not unit and quantity != "ratio" and behind.startswith("%") and not of_both:
        unit, behind, together = behind[1:].strip(), "%", False
    relative = canonical(behind) == "%" and canonical(unit) != "%" and not together
    if relative and not unit and quantity == "ratio" and abs(number) > _SURE_RATIO:
        in_percent = f"({number:.12g} ± {deviation:.12g}) %"
        bound = f"clear: it may be {in_percent}; write that, or the deviation without %"
        raise InputError(name, raw, bound)
    own_unit = unit_in(quantity, unit if relative else unit or behind) or None
    if relative:
        value = _scale_or_refuse(name, quantity, raw, number, unit).si(number)
        return Value(value, abs(value) * deviation / 100.0, text=raw, unit=own_unit)
    scale = _scale_or_refuse(name, quantity, raw, number, unit or behind)
    scale_behind = _scale_or_refuse(name, quantity, raw, deviation, behind or unit)
    return Value(scale.si(number), scale_behind.si(deviation), text=raw, unit=own_unit)


def _interval(name: str, quantity: str, raw: str, text: str) -> Value:
    """``0.8..1.2 N/um``; a unit behind the second end holds for both."""
    if name != "k":
        raise InputError(name, raw, _ONE_NUMBER)
    left, _, right = text.partition("..")
    low, unit = split_number(left.strip())
    high, behind = split_number(right.strip(" ."))
    ends = (
        _scale_or_refuse(name, quantity, raw, low, unit or behind).si(low),
        _scale_or_refuse(name, quantity, raw, high, behind or unit).si(high),
    )
    if not 0.0 < ends[0] <= ends[1] < math.inf:
        raise InputError(name, raw, _INTERVAL)
    middle = min(max(math.sqrt(ends[0]) * math.sqrt(ends[1]), ends[0]), ends[1])
    return Value(middle, None, *ends, raw, unit_in(quantity, behind or unit) or None)

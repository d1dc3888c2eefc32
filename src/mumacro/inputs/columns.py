"""Convert columns of a program, arrays of any library, to float64 in SI.

A column holds numbers, and one unit belongs to the whole column: the unit of a quantity array, of
its container, or of its header.  A text or None among numbers is a gap, and its reason is kept.  A
column of texts only is refused, and so are complex numbers, times and truth values.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.carried import (
    carried_unit,
    labelled_in_si,
    library,
    numbers_in,
    read_unit,
    two_units,
    uncertain,
    without_mask,
)
from mumacro.inputs.case import (
    A_NUMBER,
    NO_DEVIATION,
    NUMBERS,
    OR_RIGID,
    Value,
    as_double,
    is_gap,
    other_number,
    read,
)
from mumacro.inputs.fields import GAP, is_rigid
from mumacro.inputs.units import (
    QUANTITIES,
    Unit,
    checked_in_si,
    parse_unit,
    quantity_of,
    scale_of,
)
from mumacro.kernel.arrays import Array

_FLOAT = np.dtype(np.float64)
_REAL = "fiu"  # kinds of arrays of real numbers in NumPy
_NO_NUMBERS = {"b": "truth values", "c": "complex numbers", "M": "times", "m": "durations"}
_NO_ARRAY = (str, bytes, bytearray, Mapping, set, frozenset, type)
NOT_TEXT = "must be a number, not a text"


class Fault(NamedTuple):
    """Tell why an entry of a column has no number: the entry, and the reason as a sentence without
    its subject."""

    entry: object
    reason: str

    @property
    def bound(self) -> str:
        """Return what the entry must be, as part of an error."""
        if self.reason.startswith("is missing"):
            return f"a real number: it {self.reason}"
        return self.reason.removeprefix("must be ")


class Column(NamedTuple):
    """Hold a column as it was understood."""

    si: Array  #: in the shape of the column, NaN at gaps; infinite if a contact is rigid
    unit: str | None = None  #: the unit that was understood; None if the numbers are in SI
    faults: Mapping[int, Fault] = {}  #: by index in the flattened column


def is_column(value: Any) -> bool:
    """Return whether a value is an array of any library, a list or a tuple, and not a single value.

    >>> is_column([1.0]), is_column(np.float64(1.0)), is_column("1"), is_column(np.array(1.0))
    (True, False, False, False)
    """
    of_type = type(value)
    if of_type in NUMBERS or of_type is str:
        return False
    if of_type is Column or of_type is list or of_type is tuple:
        return True
    if of_type is Value:
        return False
    dimensions = getattr(value, "ndim", None)
    if isinstance(dimensions, int):
        return dimensions > 0
    if isinstance(value, _NO_ARRAY):
        return False
    return hasattr(of_type, "__len__") or hasattr(of_type, "__arrow_c_stream__")


def read_column(name: str, values: Any, quantity: str = "", unit: str = "") -> Column:
    """Return a column of an input, or of another argument, as float64 in SI.

    Parameters
    ----------
    name : str
        Name of the input, for messages; :data:`mumacro.inputs.fields.QUANTITY_OF` has its quantity.
    values : array_like
        An array of doubles is not copied.  A :class:`Column` has been read before.
    quantity : str
        Its quantity, for a name that is not in the list.
    unit : str
        The unit in its header or field.

    Raises
    ------
    InputError
        If the column has only texts, values that are not real numbers, or a unit that the input
        cannot have.

    Examples
    --------
    >>> column = read_column("k", [1e6, "rigid", "1 N/um", None])
    >>> column.si.tolist()
    [1000000.0, inf, nan, nan]
    >>> {place: fault.reason for place, fault in column.faults.items()}
    {2: 'must be a number, not a text', 3: 'is missing; write rigid or a number'}
    >>> read_column("y0", np.array([2.0, 3.0]), unit="um").si.tolist()
    [2e-06, 3e-06]
    """
    of_type = type(values)
    if of_type is np.ndarray and values.dtype is _FLOAT and not unit:
        return Column(values)
    if of_type is Column:
        return values  # type: ignore[no-any-return]
    quantity = quantity or quantity_of(name)
    parsed = parse_unit(quantity, unit) if unit else None
    if unit and parsed is None:
        raise InputError(name, f"a column in {unit}", QUANTITIES[quantity].bound)
    scale = None if parsed is None else parsed.scale
    carried = carried_unit(values)
    if carried is not None:
        of_values = read_unit(name, carried, quantity)
        if scale is not None and of_values.scale != scale:
            raise two_units(name, str(carried))
        values, scale, unit = numbers_in(values), of_values.scale, of_values.symbol
    si, faults = _doubles(name, values, quantity)
    if scale is None:
        return Column(si, unit or None, faults)
    numbers, (si, too_large) = si, checked_in_si(si, scale)
    for place, reason in too_large.items():
        faults[place] = Fault(f"{numbers.flat[place]:.12g} {unit}", reason)
    return Column(si, unit, faults)


def to_si(name: str, value: Any, quantity: str = "") -> Any:
    """Return a number as a float, or a column as an array of float64, in SI.

    Raise InputError for a value with a deviation, for an interval, and for a gap.

    >>> to_si("y0", "2 um"), to_si("y0", [2e-6, 3e-6]).tolist()
    (2e-06, [2e-06, 3e-06])
    """
    if is_column(value):
        column = read_column(name, value, quantity)
        refuse_gaps(name, column)
        return column.si
    one = read(name, value, quantity)
    if one.std is not None:
        raise InputError(name, value, NO_DEVIATION)
    if one.low is not None:
        raise InputError(name, value, "one value: only evaluate and its forms take intervals")
    return one.si


def refuse_gaps(name: str, column: Column) -> None:
    """Raise InputError for the first gap of a column, with its place."""
    for place, fault in column.faults.items():
        raise InputError(name, fault.entry, fault.bound, place)


def in_unit(name: str, value: Any, unit: str) -> Any:
    """Return a column, or one value, whose header or field has a unit: in SI, or as it was
    understood.

    Arrays of xarray and Dask keep their labels and stay lazy.

    >>> in_unit("y0", [2.0, 3.0], "um").si.tolist(), in_unit("y0", 2.0, "um").si
    ([2e-06, 3e-06], 2e-06)
    """
    quantity, scale = quantity_of(name), scale_of(name, unit)
    if scale is None:
        raise InputError(name, f"a column in {unit}", QUANTITIES[quantity].bound)
    if library(value) in ("xarray", "dask"):
        return labelled_in_si(name, value, quantity, scale)
    if is_column(value):
        return read_column(name, value, quantity, unit)
    one = read(name, value, quantity)
    if one.unit is None:
        return one.scaled(name, Unit(unit, scale))
    if scale_of(name, one.unit) != scale:
        raise two_units(name, one.unit)
    return one


# --- numbers of any container ---------------------------------------------------------------------


def _doubles(name: str, values: Any, quantity: str) -> tuple[Array, dict[int, Fault]]:
    """Return the numbers of a column without a unit, and its gaps."""
    values = without_mask(values)
    if isinstance(values, (list, tuple)):
        shape, entries = _entries(name, values)
        if NUMBERS.issuperset(map(type, entries)):
            try:
                return np.array(entries, np.float64).reshape(shape), {}
            except OverflowError:
                pass  # the entry beyond double range is found below
        return _of_entries(name, values, entries, shape, quantity)
    array = _array(name, values)
    kind = array.dtype.kind
    if kind in _REAL:
        return as_doubles(name, array), {}
    if kind in _NO_NUMBERS:
        raise InputError(name, values, f"real numbers, not {_NO_NUMBERS[kind]}")
    if kind not in "OUT":
        raise InputError(name, values, A_NUMBER)
    return _of_entries(name, values, array.ravel().tolist(), array.shape, quantity)


def _array(name: str, values: Any) -> Any:
    """Return a container as an array of NumPy."""
    package = library(values)
    if package == "pandas":
        if hasattr(values, "columns"):
            raise InputError(name, "a DataFrame", f"{A_NUMBER}: one column of it")
        dtype = values.dtype
        # such a type has NA instead of NaN
        if dtype.kind in _REAL and not isinstance(dtype, np.dtype):
            return values.to_numpy(np.float64, na_value=math.nan)
    elif package == "netCDF4" or (hasattr(values, "attrs") and package != "xarray"):
        return without_mask(values[...])  # an array in a file
    try:
        return np.asarray(values)
    except (TypeError, ValueError, OverflowError):
        raise InputError(name, values, A_NUMBER) from None


def as_doubles(name: str, array: Any) -> Array:
    """Return an array of real numbers as doubles.  Raise InputError for a number beyond double
    range."""
    with np.errstate(over="ignore"):
        doubles: Array = array.astype(np.float64, copy=False)
    if array.dtype.itemsize > doubles.dtype.itemsize:
        beyond = np.flatnonzero(np.isinf(doubles) & np.isfinite(array))
        if beyond.size:
            index = int(beyond[0])
            as_double(name, array.flat[index], index)
    return doubles


def _entries(name: str, value: Sequence[Any]) -> tuple[tuple[int, ...], list[Any]]:
    """Return shape and entries of nested lists.  Raise InputError for lists of different lengths,
    and for an array with a unit within a list."""
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
    """Return whether an entry of a list is itself a list or an array."""
    if isinstance(value, (list, tuple)):
        return True
    dimensions = getattr(value, "ndim", 0)
    return isinstance(dimensions, int) and dimensions > 0


def _of_entries(
    name: str, values: Any, entries: Sequence[Any], shape: tuple[int, ...], quantity: str
) -> tuple[Array, dict[int, Fault]]:
    """Return the numbers of entries of several types, read one after the other, and their gaps."""
    si, faults = np.full(len(entries), math.nan), dict[int, Fault]()
    or_rigid = quantity in OR_RIGID and not name.startswith("std_")
    numbers = texts = 0
    for i, entry in enumerate(entries):
        if type(entry) is float:
            si[i] = entry
            numbers += 1
        elif type(entry) in NUMBERS:
            si[i] = as_double(name, entry, i)
            numbers += 1
        elif is_gap(entry):
            faults[i] = Fault(None, GAP if name == "k" else "is missing")
        elif isinstance(entry, str):
            if or_rigid and is_rigid(entry):
                si[i] = math.inf
            else:
                texts += 1
                faults[i] = Fault(entry, NOT_TEXT)
        else:
            si[i] = _number(name, entry, i)
            numbers += 1
    if texts and not numbers:
        bound = (
            f'a column of numbers, not of texts: write the unit into its header, as in "{name} '
            f'[{QUANTITIES[quantity].unit}]", or convert the texts to numbers in SI'
        )
        raise InputError(name, values, bound)
    return si.reshape(shape), faults


def _number(name: str, entry: Any, index: int) -> float:
    """Return a number of another type, such as Decimal.  Raise InputError for anything else."""
    if carried_unit(entry) is not None:
        bound = "numbers: the unit belongs to the whole column, as that of a quantity array"
        raise InputError(name, entry, bound, index)
    if uncertain(entry) is not None:
        bound = f"numbers: give their deviations as a column std_{name}"
        raise InputError(name, entry, bound, index)
    return other_number(name, entry, index)

"""Read the unit and the deviation of a value from another library (pint, astropy, unyt, xarray,
pandas, h5py, netCDF4 or uncertainties).  No library is imported: a value is recognised by its
attributes."""

import inspect
import math
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.units import (
    QUANTITIES,
    Scale,
    Unit,
    canonical,
    explain_unit,
    in_si,
    is_level,
    parse_unit,
)

# units of rotation: without one of them 1/s is a frequency, with one of them it is not
_ANGLES = ("rad", "deg", "°", "turn", "rev", "cycle", "rpm", "arc")
#: names of an attribute with the unit
_NAMES = ("units", "unit", "Units", "Unit")
# values of these never have a unit
_PLAIN = ("builtins", "numpy", "polars", "pyarrow", "dask")


def library(value: Any) -> str:
    """Return the name of the package that defines the type of a value."""
    return type(value).__module__.partition(".")[0]


def carried_unit(value: Any) -> Any:
    """Return the unit of a value, as an object of its library or a text, or None if it has no unit.

    ``attrs`` of xarray, pandas and h5py have it under one of :data:`_NAMES`; ``attrs`` of a frame
    have it under the name of the column.

    >>> carried_unit(2.0) is None
    True
    """
    package = library(value)
    if package in _PLAIN:
        return None
    if package == "pandas":
        unit = getattr(getattr(value, "dtype", None), "units", None)  # a type of pint-pandas
    elif package == "xarray":
        unit = _unit_of_quantity(getattr(value, "data", None))
    else:
        unit = _unit_of_quantity(value)
    if unit is None:
        attributes: Any = getattr(value, "attrs", None)
        if hasattr(attributes, "get"):
            unit = next((attributes[name] for name in _NAMES if name in attributes), None)
            if isinstance(unit, Mapping):  # the attrs of a frame
                unit = unit.get(getattr(value, "name", None))
    if isinstance(unit, np.ndarray) and unit.size == 1:
        unit = unit.item()
    if isinstance(unit, bytes):
        unit = unit.decode("utf-8", "replace")
    return None if isinstance(unit, str) and not unit.strip() else unit


def units_of_fields(schema: Any) -> dict[str, str]:
    """Return the units in the metadata of the fields of an Arrow schema, by column."""
    units = {}
    for field in schema:
        metadata = field.metadata or {}
        found = [metadata[name.encode()] for name in _NAMES if name.encode() in metadata]
        unit = found[0].decode("utf-8", "replace").strip() if found else ""
        if unit:
            units[field.name] = unit
    return units


def _unit_of_quantity(value: Any) -> Any:
    """Return the unit of a quantity of pint, astropy, unyt or a similar library."""
    for attribute in _NAMES:
        unit = getattr(value, attribute, None)
        # a logarithmic unit of astropy can be called, too
        if unit is not None and not inspect.isroutine(unit) and unit is not value:
            return unit
    return None


def read_unit(name: str, unit: Any, quantity: str, value: Any = None) -> Unit:
    """Return a unit from :func:`carried_unit`, with its scale.

    Raise InputError for a unit that the input cannot have; the message shows the ``value``.
    """
    text = _text_of(unit)
    parsed = parse_unit(quantity, text) or parse_unit(quantity, str(unit))
    if parsed is not None:
        return parsed
    scale = _scale_by_library(unit, text, quantity)
    if scale is None:
        raise InputError(name, _shown(value, text), _bound(quantity, value, text))
    return Unit(canonical(text), Scale(scale))


def labelled_in_si(name: str, column: Any, quantity: str, scale: Scale | None = None) -> Any:
    """Return an array of xarray or Dask with the same labels and chunks, and with numbers in SI; it
    stays lazy.  ``scale`` is the scale of its header.

    Raise InputError for a unit that the input cannot have, and for two different units.
    """
    unit = carried_unit(column)
    if unit is not None:
        carried = read_unit(name, unit, quantity).scale
        if scale is not None and carried != scale:
            raise two_units(name, _text_of(unit))
        scale = carried
    if library(column) != "xarray":
        return column if scale is None else in_si(column, scale)
    data = column.data
    numbers = data if _unit_of_quantity(data) is None else _magnitude(data)
    plain = column.copy(data=numbers if scale is None else in_si(numbers, scale))
    plain.attrs = {}
    return plain


def two_units(name: str, unit: str) -> InputError:
    """Return the error for a column whose header has another unit than its values."""
    return InputError(name, f"values in {unit}", "in one unit: that of its header is another")


def uncertain(value: Any) -> tuple[float, float] | None:
    """Return value and deviation of a number of the package uncertainties or a similar one."""
    nominal, deviation = (getattr(value, name, None) for name in ("nominal_value", "std_dev"))
    if nominal is None or deviation is None or callable(deviation):
        return None
    return float(nominal), float(deviation)


def without_mask(value: Any) -> Any:
    """Return a masked array of NumPy or astropy as a plain array, with NaN or None where it is
    masked.  Return any other value unchanged."""
    if isinstance(value, np.ma.MaskedArray):
        plain, mask = value.data, np.ma.getmaskarray(value)
    elif hasattr(value, "unmasked") and hasattr(value, "mask"):
        plain, mask = np.asarray(value.unmasked), np.asarray(value.mask)
    else:
        return value
    gap, dtype = (math.nan, np.float64) if plain.dtype.kind in "fiu" else (None, object)
    array = np.array(plain, dtype)
    array[mask] = gap
    return array if array.ndim else array.item()


def _magnitude(value: Any) -> Any:
    """Return the number of a quantity, without its unit."""
    for attribute in ("magnitude", "value", "values"):
        number = getattr(value, attribute, None)
        if number is not None and not callable(number):
            return number
    return np.asarray(value)


def numbers_in(value: Any) -> Any:
    """Return the numbers of a value with a unit, without labels and unit."""
    package = library(value)
    if package == "pandas":
        array = value.array
        return _magnitude(array.quantity) if hasattr(array, "quantity") else array
    if package == "xarray":
        data = value.data
        return np.asarray(data) if _unit_of_quantity(data) is None else numbers_in(data)
    if hasattr(value, "attrs") or package == "netCDF4":  # an array in a file
        return value[...]
    return _magnitude(value.quantity if package == "pint_pandas" else value)


def _text_of(unit: Any) -> str:
    """Return a unit as text, in its short form if the library has one."""
    if isinstance(unit, str):
        return unit
    try:
        return format(unit, "~C")  # of pint
    except (TypeError, ValueError):
        return str(unit)


def _scale_by_library(unit: Any, text: str, quantity: str) -> float | None:
    """Return the size of a unit in SI after its own library has converted it, or None if this is
    impossible.

    For a frequency libraries take a radian, and a turn, as a plain 1, which is wrong by a factor of
    2 pi.
    """
    turns = any(word in text.lower() for word in _ANGLES)
    hertz = "hz" in text.lower() or "hertz" in text.lower()
    if (
        isinstance(unit, str)
        or is_level(text)
        or (quantity in ("angular frequency", "angle") and (hertz or not turns))
        or (quantity == "frequency" and turns)
    ):
        return None
    si = QUANTITIES[quantity].unit
    for target in (si, "dimensionless", "") if si == "-" else (si,):
        with suppress(Exception):  # each library has errors of its own
            one, two = (float(_magnitude((times * unit).to(target))) for times in (1.0, 2.0))
            # a level, or a temperature, is no multiple of its unit
            return one if math.isclose(two, 2.0 * one, rel_tol=1e-12) else None
    return None


def _bound(quantity: str, value: Any, unit: str) -> str:
    try:
        number = float(numbers_in(value))
    except (TypeError, ValueError):
        number = math.nan
    if math.isnan(number):
        return QUANTITIES[quantity].bound
    return explain_unit(quantity, number, unit)


def _shown(value: Any, unit: str) -> str:
    """Return a quantity as text for a message."""
    try:
        return f"{float(numbers_in(value)):.12g} {unit or 'without dimension'}"
    except (TypeError, ValueError):
        return f"a value in {unit or 'no unit'}"

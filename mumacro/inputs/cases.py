"""Cases as columns of numbers."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.fields import (
    BOUNDS,
    FIELDS,
    POSITIVE,
    RAD_PER_CYCLE,
    STIFFNESS,
    UNITS,
    is_rigid,
    refusal,
)
from mumacro.kernel.arrays import Array


def picked(argument: str, cases: Any, names: Iterable[str]) -> dict[str, Any]:
    """Those of ``names`` that a mapping, a data frame, an Arrow table or stream, or a Dataset
    has."""
    # such as a reader of batches
    if hasattr(cases, "__arrow_c_stream__") and not hasattr(cases, "__dataframe__"):
        # its columns come from one reading: a second one may have another order
        import pyarrow as pa

        cases = pa.table(cases)
    try:
        # coordinates of a Dataset are inputs, too, although they are not keys; Arrow and Polars
        # have lists of names
        there = (
            cases
            if hasattr(cases, "keys")
            else getattr(cases, "column_names", None) or cases.columns
        )
        return {name: cases[name] for name in names if name in there}
    except (AttributeError, TypeError, KeyError) as error:
        kind = f"{type(cases).__module__}.{type(cases).__qualname__}"
        raise InputError(
            argument,
            kind,
            "a mapping, DataFrame, Arrow table or Dataset with the inputs by name; "
            "give anything else as {name: array}, what is lazy after its collect() or read_all()",
        ) from error


def as_columns(given: Mapping[str, Any]) -> dict[str, Array]:
    """The six inputs as float64 arrays; InputError where one is missing, given twice, or no real
    number.

    ``given`` holds the fields, ``f`` [Hz] in place of ``omega`` if not None, and ``k``: a number,
    an array or ``rigid``; an array may hold the word, too.
    """
    converted: dict[str, Array] = {}
    for name in FIELDS:
        source = name
        if name == "omega":
            both = given.get("omega") is not None
            if both == (given.get("f") is not None):
                told = "not both" if both else "one of them"
                raise InputError(
                    "omega", given.get("omega"), f"given or f [Hz] in its place, {told}"
                )
            source = "omega" if both else "f"
        if source not in given:
            hint = f": {STIFFNESS}" if name == "k" else f" [{UNITS[name]}]"
            raise InputError(name, None, f"given{hint}")
        value = given[source]
        try:
            array = real(source, value)
        except InputError:
            if name != "k":
                raise
            array = _stiffness(value)
        if source == "f":
            with np.errstate(over="ignore"):  # infinite, which is refused as a value of f
                array = array * RAD_PER_CYCLE
        converted[name] = array
    return converted


def _stiffness(value: Any) -> Array:
    """A stiffness, or an array of them, which may say ``rigid``; InputError with the remedy for a
    gap."""
    try:
        return real("k", _rigid_as_infinity(value))
    except InputError as error:
        raise InputError("k", value, STIFFNESS) from error


def _rigid_as_infinity(value: Any) -> Any:
    """A stiffness, or an array of them, with infinity for the word ``rigid``."""
    if isinstance(value, str):
        return math.inf if is_rigid(value) else value
    if not isinstance(value, (list, tuple)) and getattr(
        getattr(value, "dtype", None), "kind", ""
    ) not in ("O", "U"):
        return value
    try:
        texts = np.asarray(value, dtype=object)
        read = [math.inf if isinstance(x, str) and is_rigid(x) else x for x in texts.flat]
        return np.array(read).reshape(texts.shape)
    except ValueError:  # lists of several lengths
        return value


def real(name: str, value: Any) -> Array:
    """``value`` as float64; complex numbers, times, text and None are refused, also where numpy
    would convert them.

    What is masked is unknown: NaN.
    """
    try:
        if isinstance(value, np.ma.MaskedArray):
            value = (
                np.ma.filled(value.astype(np.float64), math.nan)
                if value.dtype.kind in "fiub"
                else value.data
            )
        array = np.asarray(value)
        if array.dtype.kind in "fiub":
            return array.astype(np.float64, copy=False)
        if array.dtype.kind == "O" and not any(
            isinstance(x, (str, bytes)) or x is None for x in array.ravel()
        ):
            return array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        pass
    raise InputError(name, value, "a real number or an array of them")


def check_inputs(columns: Mapping[str, Array], frequency: Any = None) -> None:
    """Refuse the first value out of :data:`BOUNDS`; ``frequency`` is what was given as ``f`` in
    place of omega."""
    for name, values in columns.items():
        legal = (values > 0.0) if name in POSITIVE else (values >= 0.0)
        bad = ~(legal if name == "k" else legal & np.isfinite(values))
        if bad.any():
            i = int(np.flatnonzero(bad.ravel())[0])
            field, told = (
                ("f", real("f", frequency))
                if name == "omega" and frequency is not None
                else (name, values)
            )
            value = float(told.ravel()[i])
            bound = refusal(field, value).removeprefix("must be ") if field == "f" else BOUNDS[name]
            bound = STIFFNESS if field == "k" and math.isnan(value) else bound
            raise InputError(field, value, bound, i if values.ndim else None)


def length_scale(mu0: Array, Fz: Array, k: Array) -> Array:
    """l0 = mu0 Fz / k [m], eq. (5), without overflow of mu0 Fz; 0 for rigid contact."""
    mu0, Fz, k = np.broadcast_arrays(mu0, Fz, k)
    with np.errstate(all="ignore"):
        quotient = Fz / k
        out = np.asarray(mu0 * quotient)
        low, high = np.minimum(quotient, out), np.maximum(quotient, out)
        odd = ~((low > 1e-290) & (high < 1e290))  # there a partial result may have lost digits
        if odd.any():
            (a, i), (b, j), (c, n) = (np.frexp(x[odd]) for x in (mu0, Fz, k))
            out[odd] = np.ldexp(a * (b / c), i + j - n)
    return out

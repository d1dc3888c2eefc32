"""Cases in their one form: six columns of numbers by name, made once from any form of inputs.

Keywords, a mapping, a data frame, Arrow columns, a row of a file or of JSON become names and values
(:func:`by_name`), and these become :class:`Cases`, which alone the kernel evaluates.  Labels
of pandas, xarray and Dask are taken off and put back by :mod:`mumacro.frames`, between the two
steps.
"""

import enum
import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import Any, Final, NamedTuple

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.fields import (
    BOUNDS,
    POSITIVE,
    RAD_PER_CYCLE,
    STIFFNESS,
    UNITS,
    is_rigid,
    refusal,
)
from mumacro.inputs.k_range import BOUND, ENDS
from mumacro.inputs.kind import AMPLITUDE, DIRECTIONS, LIFTS_OFF, SPRING, Kind
from mumacro.inputs.names import unknown_name
from mumacro.kernel.arrays import Array, common_shape, flat


class Absent(enum.Enum):
    """The default of an input.  None cannot be it: None is a gap in the data, which is refused for
    k."""

    ABSENT = "left out"

    def __repr__(self) -> str:
        return self.value


ABSENT: Final = Absent.ABSENT
#: types of one real number
NUMBERS = frozenset(
    (float, int, bool, np.bool_, *(np.dtype(code).type for code in "efdbhilqBHILQ"))
)
NUMBERS_AND_ARRAYS = NUMBERS | {np.ndarray}
_UNLABELLED = NUMBERS_AND_ARRAYS | {list, tuple, type(None), dict, str}
_FLOAT = np.dtype(np.float64)
_AMPLITUDES = ("y0", AMPLITUDE)


class Cases(NamedTuple):
    """Cases of one kind, as the kernel takes them."""

    kind: Kind
    #: by the names of ``kind.fields`` and in their order: one number for all cases, or an array
    #: (n,); k is infinite where rigid, and the geometric middle of an interval
    columns: dict[str, float | Array]
    #: of the inputs, broadcast: () for one case alone
    shape: tuple[int, ...]
    #: lowest and highest k of an interval, each (n,)
    ends: tuple[Array, Array] | None = None
    #: the values of f [Hz], where the inputs had f: messages then name f in place of omega
    frequency: Any = None

    @classmethod
    def of(cls, inputs: Mapping[str, Any], kind: Kind = SPRING, strict: bool = False) -> "Cases":
        """Cases from inputs by name, see :func:`by_name`.

        InputError where an input is missing, is no real number, or shapes do not broadcast.  A
        value out of bounds is one where ``strict``, and for a case alone.

        >>> inputs = dict(mu0=0.3, Fz=10.0, k="rigid", y0=[1e-6, 2e-6], omega=1e5, v0=0.01)
        >>> cases = Cases.of(inputs)
        >>> cases.shape, cases.columns["k"]
        ((2,), inf)
        """
        low = high = ends = None
        if "k_low" in inputs:
            low, high, geometric_middle = middle(inputs, strict)
            inputs = {**inputs, "k": geometric_middle}
        columns = columns_of(inputs, kind)
        arrays = [column for column in columns.values() if not isinstance(column, float)]
        try:
            shape = common_shape(arrays)
        except ValueError as error:
            shapes = {name: np.shape(column) for name, column in columns.items()}
            raise InputError("inputs", shapes, "arrays whose shapes broadcast together") from error
        if strict or not shape:
            check(columns, inputs.get("f"), shape)
        for name, column in columns.items():
            if not isinstance(column, float):
                columns[name] = flat(column, shape) if column.size != 1 else column.item()
        if low is not None and high is not None:
            ends = flat(low, shape or (1,)), flat(high, shape or (1,))
        return cls(kind, columns, shape, ends, inputs.get("f"))

    @property
    def size(self) -> int:
        """How many cases."""
        return math.prod(self.shape)

    def reason(self, index: int) -> InputError:
        """Why the case at ``index`` has no answer."""
        case = {
            name: column if isinstance(column, float) else float(column[index])
            for name, column in self.columns.items()
        }
        if self.ends is not None and math.isnan(case["k"]):
            return InputError("k_range", tuple(float(end[index]) for end in self.ends), BOUND)
        f = None if self.frequency is None else real("f", self.frequency)
        try:
            check(
                case, f if f is None else float(np.broadcast_to(f, self.shape or (1,)).flat[index])
            )
        except InputError as error:
            return error
        raise AssertionError(f"{case} has an answer")


# --- from inputs of any form to names and values --------------------------------------------------


def by_name(cases: Any, inputs: Mapping[str, Any], kind: Kind = SPRING) -> dict[str, Any]:
    """The inputs of ``cases`` and those given by keyword, each once, by the names of ``kind``.

    An interval of k is ``k_low`` and ``k_high``; columns of Arrow are arrays.  InputError for an
    input given twice, an amplitude of another direction, k beside an interval of it.

    >>> by_name({"mu0": 0.3, "note": "dry"}, {"k_range": (1e6, 2e6)})
    {'mu0': 0.3, 'k_low': 1000000.0, 'k_high': 2000000.0}
    """
    values = dict(inputs)
    if cases is not None:
        columns = select("cases", cases, (*kind.columns, *ENDS))
        if duplicates := columns.keys() & inputs.keys():
            name = min(duplicates)
            raise InputError(name, inputs[name], "given once: in the cases or as a keyword")
        values = {**columns, **inputs}
    own_amplitude = _AMPLITUDES[kind.normal]
    wrong_amplitude = _AMPLITUDES[not kind.normal]
    if wrong_amplitude in values:
        bound = (
            f"left out for direction {DIRECTIONS[kind.direction]}, whose amplitude is "
            f"{own_amplitude}"
        )
        raise InputError(wrong_amplitude, values[wrong_amplitude], bound)
    if not values.keys().isdisjoint(("k_range", *ENDS)):
        values = as_ends(values)
    for name, value in values.items():
        if type(value) not in _UNLABELLED and not library_of(value) and _of_arrow(value):
            values[name] = np.asarray(value)  # NaN where it is null
    return values


def select(argument: str, cases: Any, names: Iterable[str]) -> dict[str, Any]:
    """Those of ``names`` that a mapping, a data frame, an Arrow table or stream, or a Dataset
    has."""
    # a stream of batches has no columns by name
    if hasattr(cases, "__arrow_c_stream__") and not hasattr(cases, "__dataframe__"):
        # its columns come from one reading: a second one may have another order
        import pyarrow as pa

        cases = pa.table(cases)
    try:
        # coordinates of a Dataset are inputs, too, although they are not keys; Arrow and Polars
        # have lists of names
        present = (
            cases
            if hasattr(cases, "keys")
            else getattr(cases, "column_names", None) or cases.columns
        )
        return {name: cases[name] for name in names if name in present}
    except (AttributeError, TypeError, KeyError) as error:
        type_name = f"{type(cases).__module__}.{type(cases).__qualname__}".removeprefix("builtins.")
        raise InputError(
            argument,
            type_name,
            "a mapping, DataFrame, Arrow table or Dataset with the inputs by name; "
            "give anything else as {name: array}, a file as pandas.read_csv reads it, "
            "what is lazy after its collect() or read_all()",
        ) from error


def _of_arrow(value: Any) -> bool:
    """Whether a column comes from Arrow, Polars or another library with Arrow's interface."""
    value_type = type(value)
    return hasattr(value_type, "__arrow_c_stream__") or hasattr(value_type, "__arrow_c_array__")


def library_of(value: Any) -> str:
    """The library whose labels or chunks a value has: pandas, xarray, dask; or nothing."""
    name = type(value).__module__.partition(".")[0]
    return name if name in ("pandas", "xarray", "dask") else ""


def has_labels(cases: Any, inputs: Mapping[str, Any]) -> bool:
    """Whether the answer is labelled, since an input is."""
    values = (cases, *inputs.values())
    return not _UNLABELLED.issuperset(map(type, values)) and any(map(library_of, values))


def fixed_inputs(case: Mapping[str, Any], unknown: str, kind: Kind = SPRING) -> dict[str, float]:
    """The inputs of one case beside the unknown or swept one, by the names of ``kind.fields``; an
    infinite ``k`` is rigid.

    ``f`` may stand for ``omega``; inputs that are None are left out.  InputError where one of the
    five is missing or is not one legal number, and where the unknown has a value.
    """
    if unknown not in kind.fields:
        raise InputError("unknown", unknown, f"one of {', '.join(kind.fields)}")
    for name in ("k_range", *ENDS):
        if case.get(name) is not None:
            bound = (
                "left out: over an interval of k a target has an interval of roots; solve for "
                "both ends of it"
            )
            raise InputError(name, case[name], bound)
    for name in case.keys() - {*kind.columns, *_AMPLITUDES, "k_range", *ENDS}:
        bound = f"one of {', '.join(kind.columns)}; {unknown_name(name, kind.columns)}"
        raise InputError(name, case[name], bound)
    inputs = {
        name: value for name, value in case.items() if value is not None or name == "k" != unknown
    }
    for name in inputs.keys() & ({"omega", "f"} if unknown == "omega" else {unknown}):
        raise InputError(name, inputs[name], f"left out, because {unknown} is the unknown or swept")
    columns = columns_of(by_name(None, {**inputs, unknown: 1.0}, kind), kind)
    for name, column in columns.items():
        if np.size(column) != 1:
            raise InputError(name, inputs.get(name, inputs.get("f")), "one number")
    del columns[unknown]
    check(columns, inputs.get("f"))
    return {name: float(np.ravel(column)[0]) for name, column in columns.items()}


# --- an interval of k -----------------------------------------------------------------------------


def as_ends(inputs: Mapping[str, Any]) -> dict[str, Any]:
    """Inputs with ``k_low`` and ``k_high`` for ``k_range``; InputError for k beside it, for one end
    without the other, and where it is no pair."""
    values = dict(inputs)
    if "k_range" in values:
        if conflicting := [name for name in ("k", *ENDS) if name in values]:
            raise InputError(conflicting[0], values[conflicting[0]], "left out beside k_range")
        pair = values.pop("k_range")
        try:
            values["k_low"], values["k_high"] = pair
        except (TypeError, ValueError) as error:
            raise InputError("k_range", pair, BOUND) from error
    if missing := [name for name in ENDS if name not in values]:
        raise InputError(missing[0], None, "given [N/m] beside the other end of the interval")
    if "k" in values:
        raise InputError("k", values["k"], "left out beside an interval of it")
    return values


def middle(inputs: Mapping[str, Any], strict: bool = False) -> tuple[Array, Array, Array]:
    """Both ends of an interval, and its geometric middle.

    The middle of an illegal interval is NaN; InputError where ``strict``, and for one interval
    alone.
    """
    low, high = (real(name, inputs[name]) for name in ENDS)
    try:
        shape = common_shape((low, high))
    except ValueError as error:
        raise InputError(
            "k_range", (low.shape, high.shape), "of shapes that broadcast together"
        ) from error
    legal = (low > 0.0) & (low <= high) & (high < math.inf)
    if not legal.all() and (strict or not legal.ndim):
        i = int(np.flatnonzero(~legal)[0])
        ends = tuple(float(np.broadcast_to(end, shape).flat[i]) for end in (low, high))
        raise InputError("k_range", ends, BOUND, i if shape else None)
    lower, upper = (np.where(legal, end, np.nan) for end in (low, high))
    return low, high, np.asarray(np.clip(np.sqrt(lower) * np.sqrt(upper), lower, upper))


def without_interval(
    case: Mapping[str, Any], along: str = ""
) -> tuple[Mapping[str, Any], dict[str, Any]]:
    """A case with the middle of an interval of k, and the two ends; no ends where it has one k.

    InputError for an interval where k itself is swept.
    """
    if all(case.get(name) is None for name in ("k_range", *ENDS)):
        return case, {}
    values = as_ends(case)
    if along == "k":
        raise InputError(
            "k_range", (values["k_low"], values["k_high"]), "left out where k is the swept input"
        )
    geometric_middle = middle(values, strict=True)[2]
    ends = {name: values.pop(name) for name in ENDS}
    return {**values, "k": geometric_middle}, ends


# --- from values to numbers -----------------------------------------------------------------------


def columns_of(inputs: Mapping[str, Any], kind: Kind = SPRING) -> dict[str, float | Array]:
    """The six inputs by the names of ``kind.fields``, each one number or an array of float64.

    ``inputs`` has them by name, ``f`` [Hz] in place of ``omega`` if not None.  InputError where one
    is missing, is given twice, or is no real number.
    """
    columns: dict[str, float | Array] = {}
    for name in kind.fields:
        source = name if name != "omega" else _frequency_in(inputs, kind)
        try:
            value = inputs[source]
        except KeyError:
            raise _missing(inputs, kind) from None
        if type(value) is not float and not (
            type(value) is np.ndarray and value.dtype is _FLOAT and value.ndim
        ):
            value = _column(source, value)
        columns[name] = value if source != "f" else _angular(value)
    return columns


def _missing(inputs: Mapping[str, Any], kind: Kind) -> InputError:
    """What to give, where ``inputs`` lack one or more of the six."""
    frequency = {name for name in ("omega", "f") if inputs.get(name) is not None}
    present = {*inputs} - {"omega"} | ({"omega"} if frequency else set())
    absent = [name for name in kind.fields if name not in present]
    in_words = {name: f"{name} [{UNITS.get(name, 'N')}]" for name in absent}
    in_words["omega"] = "omega [rad/s] or f [Hz]"
    bounds = {name: f"given [{UNITS.get(name, 'N')}]" for name in absent} | {
        "k": f"given: {STIFFNESS}",
        "omega": "given, or f [Hz] in its place",
        AMPLITUDE: "given [N] for direction normal",
    }
    others = ", ".join(in_words[name] for name in absent[1:])
    return InputError(absent[0], None, bounds[absent[0]] + (others and f"; so must {others}"))


@np.errstate(over="ignore")  # takes less time than a with statement within
def _angular(frequency: float | Array) -> float | Array:
    """omega [rad/s] of f [Hz]; beyond double range infinite, which is refused as a value of f."""
    return frequency * RAD_PER_CYCLE


def _frequency_in(inputs: Mapping[str, Any], kind: Kind) -> str:
    """Which of omega and f the inputs have."""
    if inputs.get("f") is None:
        if inputs.get("omega") is None:
            raise _missing(inputs, kind)
        return "omega"
    if inputs.get("omega") is None:
        return "f"
    bound = "left out beside f [Hz], which stands in its place: give one, not both"
    raise InputError("omega", inputs["omega"], bound)


def _column(name: str, value: Any) -> float | Array:
    """A value of the input ``name`` as one number or an array of float64; InputError with the
    remedy where it has no real numbers."""
    if name == AMPLITUDE and value is None:
        raise InputError(name, None, "given [N] for direction normal")
    if type(value) in NUMBERS:
        with suppress(OverflowError):  # a whole number beyond double range is refused below
            return float(value)
    try:
        array = real(name, value)
    except InputError as error:
        if name == AMPLITUDE:
            raise InputError(name, value, LIFTS_OFF) from error.__cause__
        if name != "k":
            raise
        array = stiffness(value)
    return array if array.ndim else float(array)


def stiffness(value: Any) -> Array:
    """A stiffness, or an array of them, with the word ``rigid`` allowed; InputError with the remedy
    for a gap."""
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
        values = [math.inf if isinstance(x, str) and is_rigid(x) else x for x in texts.flat]
        return np.array(values).reshape(texts.shape)
    except ValueError:  # lists of several lengths
        return value


def real(name: str, value: Any) -> Array:
    """``value`` as float64; complex numbers, times, text and None are refused, also where numpy
    would convert them.

    Masked entries are NaN.
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


def check(
    columns: Mapping[str, float | Array], frequency: Any = None, shape: tuple[int, ...] = ()
) -> None:
    """Refuse the first value out of :data:`BOUNDS`; ``frequency`` has the values of ``f`` where
    it replaced omega, ``shape`` is that of all cases, for the index of the case."""
    for name, values in columns.items():
        legal = np.greater(values, 0.0) if name in POSITIVE else np.greater_equal(values, 0.0)
        illegal = ~(legal if name == "k" else legal & np.isfinite(values))
        if illegal.any():
            field, column = name, values
            if name == "omega" and frequency is not None:
                field, column = "f", real("f", frequency)
            value = float(np.ravel(column)[np.flatnonzero(illegal)[0]])
            bound = refusal(field, value).removeprefix("must be ") if field == "f" else BOUNDS[name]
            bound = STIFFNESS if field == "k" and math.isnan(value) else bound
            bound = LIFTS_OFF if field == AMPLITUDE else bound
            raise InputError(field, value, bound, _first_case(illegal, shape))
    if AMPLITUDE in columns and "Fz" in columns:
        illegal = ~np.less(columns[AMPLITUDE], columns["Fz"])
        if illegal.any():
            amplitude = np.broadcast_to(columns[AMPLITUDE], illegal.shape)
            value = float(amplitude.flat[np.flatnonzero(illegal)[0]])
            raise InputError(AMPLITUDE, value, LIFTS_OFF, _first_case(illegal, shape))


def _first_case(illegal: Any, shape: tuple[int, ...]) -> int | None:
    """The first case with an illegal value; None for one value that is in all cases."""
    if not illegal.ndim:
        return None
    cases = np.flatnonzero(np.broadcast_to(illegal, shape or illegal.shape))
    return int(cases[0]) if cases.size else 0

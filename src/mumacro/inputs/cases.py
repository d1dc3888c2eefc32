"""Convert cases to their one form: columns of numbers by name, made once from any form of inputs.

Keywords, a mapping, a data frame, Arrow columns, rows of a file or of JSON become names and values
(:func:`named`).  These become :class:`Cases`, the only form that is evaluated
(:mod:`mumacro.outputs`).  Between the two steps :mod:`mumacro.frames` removes labels of pandas,
xarray and Dask; afterwards it adds them again.
"""

import enum
import math
import sys
from collections.abc import Iterable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.carried import library, two_units, units_of_fields
from mumacro.inputs.case import NO_DEVIATION, NUMBERS, Value, check_signs, read
from mumacro.inputs.columns import (
    Column,
    Fault,
    in_unit,
    is_column,
    read_column,
    refuse_gaps,
    to_si,
)
from mumacro.inputs.fields import (
    AMPLITUDE,
    AMPLITUDES,
    BOUNDS,
    DIRECTIONS,
    ENDS,
    FIELDS,
    FIELDS_OF,
    LIFTS_OFF,
    POSITIVE,
    RAD_PER_CYCLE,
    SPRING,
    STIFFNESS,
    UNITS,
    Kind,
    field_of,
    kind_of,
    refusal,
)
from mumacro.inputs.names import in_place_of, split_unit, suggestion
from mumacro.inputs.units import scale_of
from mumacro.kernel.arrays import Array, flat


class Absent(enum.Enum):
    """Define the default of an input.  The default cannot be None, because None is a gap in the
    data, which is refused for k."""

    ABSENT = "left out"

    def __repr__(self) -> str:
        return self.value


ABSENT: Final = Absent.ABSENT
_UNLABELLED = NUMBERS | {np.ndarray, list, tuple, type(None), dict, str}
_FLOAT = np.dtype(np.float64)
#: the inputs of all directions
ALL_FIELDS = (*FIELDS[:4], AMPLITUDE, *FIELDS[4:])
KIND = ("contact", "direction")
#: columns of deviations -> the input
DEVIATIONS = {f"std_{name}": name for name in (*ALL_FIELDS, "f")}
# columns of deviations -> the field, and the value of one unit of the column there
_DEVIATION_OF = {column: field_of(name) for column, name in DEVIATIONS.items()}
#: columns that a data frame or a file may have
COLUMNS = (*ALL_FIELDS, "f", *ENDS, *KIND, *DEVIATIONS)
#: further names that a mapping may have: options of one call
OPTIONS = ("include", "gradient", "illegal")
EXACT = "finite and >= 0, 0 where the input is exact"  # the bound of a deviation
A_DEVIATION = "one number: the deviation itself"
AN_END = "one number: an end of the interval"


class Cases(NamedTuple):
    """Hold cases as they are evaluated, all with the same contact and direction."""

    kind: Kind
    #: by ``kind.fields`` and in their order: one number for all cases, or an array (n,); k is
    #: infinite if rigid, and the geometric middle of an interval
    columns: dict[str, float | Array]
    #: broadcast shape of the inputs; () for a single case
    shape: tuple[int, ...]
    #: lowest and highest k of an interval, in the form of ``columns``
    ends: tuple[float | Array, float | Array] | None = None
    #: standard deviations of inputs, in their units, by name as in ``columns``; 0 if there is no
    #: entry
    std: dict[str, float | Array] = {}  # noqa: RUF012 - never changed
    #: f [Hz] if it replaced omega: messages name the original input
    f: float | Array | None = None
    #: units of the values, by the original input
    units: dict[str, str] = {}  # noqa: RUF012 - never changed
    #: gaps in columns, by the original input and by case
    faults: Mapping[str, Mapping[int, Fault]] = {}

    @classmethod
    def of(
        cls, values: Mapping[str, Any], kind: Kind | None = None, strict: bool = False
    ) -> "Cases":
        """Return cases from names and values, see :func:`named`; ``kind`` is used if the values do
        not tell it.

        Raise InputError if an input is missing or is not a real number, or if shapes do not
        broadcast.  If ``strict``, and for a single case, raise it also for a value out of bounds.

        >>> inputs = dict(mu0=0.3, Fz=10.0, k="rigid", y0=[1e-6, 2e-6], omega=1e5, v0=0.01)
        >>> cases = Cases.of(inputs)
        >>> cases.shape, cases.columns["k"]
        ((2,), inf)
        """
        if kind is None:
            kind = SPRING
            if not values.keys().isdisjoint(KIND):
                kind = kind_of(*(values.get(name, word) for name, word in SPRING.names.items()))
        if kind.direction or AMPLITUDE in values:
            _refuse_other_amplitude(values, kind)
        fields = FIELDS_OF[kind.direction]
        columns, std, ends, units, f, gaps = _inputs(values, fields)
        if not values.keys().isdisjoint(DEVIATIONS):
            std |= _deviations(values, fields, std, gaps)
        if std and ends is not None:
            raise _deviation_beside_interval(values, next(iter(std)))
        shape = _shape_of(columns, std)
        faults = _by_case(gaps, shape, strict) if gaps else {}
        if shape:
            columns = {name: _of_all(x, shape) for name, x in columns.items()}
            std = {name: _of_all(x, shape) for name, x in std.items()}
            f = None if f is None else _of_all(f, shape)
            if ends is not None:
                ends = _of_all(ends[0], shape), _of_all(ends[1], shape)
        cases = cls(kind, columns, shape, ends, std, f, units, faults)
        if strict or not shape:
            if strict and ends is not None:
                _check_ends(*ends, shape)
            check(columns, f, (cases.size,) if shape else ())
        return cases._with_legal_deviations(strict or not shape) if std else cases

    @classmethod
    def of_numbers(cls, names: tuple[str, ...], six: Iterable[Any], kind: Kind) -> "Cases":
        """Return one case of an amplitude y0 in plain numbers, without a check; ``names`` tell
        whether one of them is f or omega."""
        mu0, load, k, y0, rate, v0 = map(float, six)
        f = rate if "f" in names else None
        omega = rate if f is None else RAD_PER_CYCLE * f
        columns: dict[str, float | Array] = {
            "mu0": mu0,
            "Fz": load,
            "k": k,
            "y0": y0,
            "omega": omega,
            "v0": v0,
        }
        return cls(kind, columns, (), None, {}, f)

    @property
    def fields(self) -> tuple[str, ...]:
        """Return the names of the inputs."""
        return self.kind.fields

    @property
    def size(self) -> int:
        """Return the number of cases."""
        return math.prod(self.shape)

    def part(self, which: slice) -> "Cases":
        """Return some of many cases, (m,)."""

        def cut(x: Any) -> Any:
            return x[which] if isinstance(x, np.ndarray) else x

        places = range(self.size)[which]
        faults = {
            name: {places.index(place): gap for place, gap in gaps.items() if place in places}
            for name, gaps in self.faults.items()
        }
        return self._replace(
            columns={name: cut(x) for name, x in self.columns.items()},
            shape=(len(places),),
            faults=faults,
            ends=self.ends and (cut(self.ends[0]), cut(self.ends[1])),
            std={name: cut(x) for name, x in self.std.items()},
            f=cut(self.f),
        )

    def reason(self, index: int) -> InputError:
        """Return why the case at ``index`` has no answer."""
        for name, faults in self.faults.items():
            if fault := faults.get(index):
                return InputError(name, fault.entry, fault.bound)

        def pick(x: Any) -> float:
            return float(x[index] if isinstance(x, np.ndarray) else x)

        k = pick(self.columns["k"])
        try:
            if self.ends is not None and math.isnan(k):
                raise no_interval(pick(self.ends[0]), pick(self.ends[1]))
            for name, deviation in self.std.items():
                if not 0.0 <= pick(deviation) < math.inf:
                    raise InputError(f"std_{name}", pick(deviation), EXACT)
            f = None if self.f is None else pick(self.f)
            check({name: pick(x) for name, x in self.columns.items()}, f)
        except InputError as error:
            return error
        raise AssertionError(f"the case {self.columns} has an answer")

    def _with_legal_deviations(self, refuse: bool) -> "Cases":
        """Return the same cases with NaN in v0 where a deviation is illegal, so that the case has
        no answer.  If ``refuse``, raise InputError for the first one."""
        if not self.shape and all(0.0 <= float(x) < math.inf for x in self.std.values()):
            return self
        bad = np.zeros(self.size if self.shape else 1, np.bool_)
        for deviation in self.std.values():
            bad |= ~((np.asarray(deviation) >= 0.0) & (np.asarray(deviation) < math.inf))
        if not bad.any():
            return self
        if refuse:
            first = int(np.flatnonzero(bad)[0])
            error = self.reason(first)
            raise InputError(error.field, error.value, error.bound, first if self.shape else None)
        v0 = np.where(bad, math.nan, self.columns["v0"])
        return self._replace(columns={**self.columns, "v0": v0})


# --- from inputs of any form to names and values --------------------------------------------------


def named(cases: Any, keywords: Mapping[str, Any]) -> dict[str, Any]:
    """Return the inputs and options of ``cases`` and of the keywords, each once, by name.

    Every name in a mapping must be in :data:`COLUMNS` or :data:`OPTIONS`.  Other columns of a data
    frame, an Arrow table or a Dataset are ignored; a column is refused only if it resembles a
    missing input.  Raise InputError for a name that occurs twice.

    >>> named({"mu0": 0.3, "contact": "ball"}, {"k": 1e6})
    {'mu0': 0.3, 'contact': 'ball', 'k': 1000000.0}
    """
    values = dict(keywords)
    if cases is not None:
        columns, rest = _select(cases)
        if duplicates := columns.keys() & keywords.keys():
            name = min(duplicates)
            raise InputError(name, keywords[name], "given once: in the cases or as a keyword")
        values = {**columns, **keywords}
        _refuse_similar(rest, values)
    for name in KIND:
        if name in values and type(values[name]) is not str:
            values[name] = one_word(name, values[name])
    return values


def one_word(name: str, column: Any) -> Any:
    """Return the one word that a column of contacts or directions holds, or the default if the
    column is empty.

    Raise InputError for several words, and say how to split the cases.

    >>> one_word("contact", ["ball", "ball"])
    'ball'
    """
    words = {str(word): word for word in np.asarray(column, object).ravel().tolist()}
    if len(words) > 1:
        bound = f'one for a call: split the cases, as cases.groupby("{name}") does'
        raise InputError(name, " and ".join([*words][:2]), bound)
    return next(iter(words.values()), SPRING.names[name])


def _select(cases: Any) -> tuple[dict[str, Any], list[str]]:
    """Return the values in ``cases`` under known names, and the other names."""
    if isinstance(cases, Mapping) and not library_of(cases):  # a Dataset is a mapping, too
        for name in cases.keys() - {*COLUMNS, *OPTIONS}:
            raise no_such_input(str(name), cases[name])
        return dict(cases), []
    columns, present = _columns_in("cases", cases, COLUMNS)
    return columns, [name for name in present if name not in columns]


def no_such_input(name: str, value: Any, allowed: Iterable[str] = COLUMNS) -> InputError:
    """Return the error for a name that is not in ``allowed``."""
    names = [name for name in allowed if name not in DEVIATIONS]
    if (bound := in_place_of(name, allowed)) is not None:
        return InputError(name, value, bound)
    similar = suggestion(name)
    advice = f"; did you mean {similar}?" if similar in names else ""
    return InputError(name, value, f"one of {', '.join(names)}{advice}")


def _refuse_similar(rest: Iterable[str], values: Mapping[str, Any]) -> None:
    """Refuse a column that resembles an input if this input is missing."""
    present = {*values}
    if present & {*ENDS}:
        present.add("k")
    for pair in (("omega", "f"), AMPLITUDES):
        if present & {*pair}:
            present |= {*pair}
    if present >= {*ALL_FIELDS}:
        return
    for column in rest:
        similar = suggestion(str(column))
        if similar is not None and similar not in present:
            raise InputError(
                str(column), "a column", f"named {similar} if it is that: {similar} is missing"
            )


def select(argument: str, cases: Any, names: Iterable[str]) -> dict[str, Any]:
    """Return the values of ``names`` in a mapping, a data frame or one row of it, an Arrow table or
    stream, or a Dataset."""
    return _columns_in(argument, cases, names)[0]


def _columns_in(
    argument: str, cases: Any, names: Iterable[str]
) -> tuple[dict[str, Any], Iterable[str]]:
    """Return the columns of these names, and the names of all columns."""
    if library_of(cases) == "pandas" and not hasattr(cases, "columns"):  # one row of a frame
        cases = cases.to_dict()
    # a stream of batches has no columns by name
    if hasattr(cases, "__arrow_c_stream__") and not hasattr(cases, "__dataframe__"):
        # its columns must come from one read: a second one may have another order
        import pyarrow as pa

        cases = pa.table(cases)
    try:
        # Polars warns when the columns of a LazyFrame are read
        if type(cases).__name__ == "LazyFrame":
            raise TypeError("it has no columns yet")
        # coordinates of a Dataset are inputs, too, although they are not keys; Arrow and Polars
        # have lists of names
        present: Any = (
            cases
            if hasattr(cases, "keys")
            else getattr(cases, "column_names", None) or cases.columns
        )
        names = dict.fromkeys(names)  # in their order, so that the first wrong name is reported
        heads = {name: [(name, "")] for name in names if name in present}
        for head in present:
            name, unit = split_unit(head) if isinstance(head, str) else (head, None)
            if unit is not None and name in names and head not in names:
                heads.setdefault(name, []).append((head, unit))
        columns = {}
        of_fields = units_of_fields(cases.schema) if library(cases) == "pyarrow" else {}
        for name, ((head, unit), *twice) in heads.items():
            if twice:
                raise InputError(name, twice[0][0], "given once")
            of_field = of_fields.get(head, "") if name not in KIND else ""
            if unit and of_field and scale_of(name, unit) != scale_of(name, of_field):
                raise two_units(name, of_field)
            columns[name] = cases[head]
            if unit or of_field:
                columns[name] = in_unit(name, columns[name], unit or of_field)
        return columns, present
    except (AttributeError, TypeError, KeyError) as error:
        type_name = f"{type(cases).__module__}.{type(cases).__qualname__}".removeprefix("builtins.")
        raise InputError(
            argument,
            type_name,
            "a mapping, DataFrame, Arrow table or Dataset with the inputs by name; "
            "give anything else as {name: array}, a file as pandas.read_csv reads it, "
            "what is lazy after its collect() or read_all()",
        ) from error


def library_of(value: Any) -> str:
    """Return the library whose labels or chunks a value has: pandas, xarray or dask.  Return an
    empty text for any other value, also for an index or one value of pandas."""
    name = type(value).__module__.partition(".")[0]
    if name == "pandas":
        return name if hasattr(type(value), "iloc") else ""
    return name if name in ("xarray", "dask") else ""


def has_labels(values: Iterable[Any]) -> bool:
    """Return whether the answer has labels, because an input has them."""
    types = {*map(type, values)}
    return not types <= _UNLABELLED and any(map(library_of, values))


def case_around(case: Mapping[str, Any], unknown: str, kind: Kind = SPRING) -> Cases:
    """Return one case without its unknown or swept input, in whose place a legal number stands.

    Inputs that are None are left out.  Raise InputError if one of the five others is missing or is
    not one legal number, or if the unknown has a value or a deviation.
    """
    if unknown not in kind.columns:
        raise InputError("unknown", unknown, f"one of {', '.join(kind.columns)}")
    for name in case.keys() - {*kind.columns, *AMPLITUDES, *ENDS, *DEVIATIONS}:
        raise no_such_input(name, case[name], kind.columns)
    inputs = {
        name: value for name, value in case.items() if value is not None or name == "k" != unknown
    }
    field = field_of(unknown)[0]
    for name in inputs:
        if field_of(name)[0] == field:
            bound = f"left out, because {unknown} is the unknown or swept"
            raise InputError(name, inputs[name], bound)
        if name in ENDS and field == "k":
            raise InputError(name, inputs[name], "left out where k is the swept input")
        if name in DEVIATIONS and field_of(DEVIATIONS[name])[0] == field:
            raise InputError(name, inputs[name], "left out: a sweep is over exact values")
    legal = {AMPLITUDE: 0.0, "Fz": sys.float_info.max}.get(field, 1.0)
    cases = Cases.of({**inputs, field: legal}, kind, strict=True)
    if cases.size != 1:
        name = next(name for name in inputs if is_column(inputs[name]))
        raise InputError(name, inputs[name], "one number")
    return cases


# --- an interval of k -----------------------------------------------------------------------------


def ends_in(values: Mapping[str, Any], gaps: "_Gaps | None" = None) -> tuple[Any, Any] | None:
    """Return lowest and highest k, each one number or an array, if the values have an interval,
    otherwise None.  Add the gaps of columns to ``gaps``.

    Raise InputError for one end without the other, for k in addition to both, and for a single pair
    of ends that are not ordered.
    """
    missing = [name for name in ENDS if name not in values]
    if len(missing) == len(ENDS):
        return None
    if missing:
        raise InputError(missing[0], None, "given [N/m] beside the other end of the interval")
    if "k" in values:
        raise InputError("k", values["k"], "left out beside an interval of it")
    of_ends = [_understood(name, values[name], {} if gaps is None else gaps) for name in ENDS]
    for name, end in zip(ENDS, of_ends, strict=True):
        if end.std is not None:
            raise InputError(name, values[name], AN_END)
    low, high = (end.si for end in of_ends)
    if isinstance(low, np.ndarray) or isinstance(high, np.ndarray):
        try:
            np.broadcast_shapes(np.shape(low), np.shape(high))
        except ValueError as error:
            shapes = np.shape(low), np.shape(high)
            raise InputError("k_low", shapes, "of a shape that broadcasts with k_high") from error
    elif not 0.0 < low <= high < math.inf:
        raise no_interval(float(low), float(high))
    return low, high


def no_interval(low: float, high: float, index: int | None = None) -> InputError:
    """Return the error for two stiffnesses that are not the ends of an interval."""
    for name, end in zip(ENDS, (low, high), strict=True):
        if not 0.0 < end < math.inf:
            return InputError(name, end, BOUNDS[name], index)
    return InputError("k_low", low, "at most k_high", index)


def is_interval(low: Any, high: Any) -> Any:
    """Return whether two stiffnesses are the ends of an interval."""
    return np.greater(low, 0.0) & np.less_equal(low, high) & np.less(high, math.inf)


def middle(low: Any, high: Any) -> float | Array:
    """Return the geometric middle of intervals; NaN where the ends are not ordered."""
    if type(low) is float is type(high):
        return min(max(math.sqrt(low) * math.sqrt(high), low), high)
    legal = is_interval(low, high)
    lower, upper = (np.where(legal, end, math.nan) for end in (low, high))
    inside = np.clip(np.sqrt(lower) * np.sqrt(upper), lower, upper)
    return inside if inside.ndim else float(inside)


# --- from values to numbers -----------------------------------------------------------------------


def columns_of(values: Mapping[str, Any], kind: Kind = SPRING) -> dict[str, float | Array]:
    """Return the six inputs by the names of ``kind.fields``, each as one number or an array of
    float64, exact.

    Raise InputError if an input is missing, occurs twice, is not a real number, has a deviation, or
    is the amplitude of another direction.
    """
    _refuse_other_amplitude(values, kind)
    for name in values.keys() & DEVIATIONS.keys():
        raise InputError(name, values[name], NO_DEVIATION)
    inputs = _inputs(values, kind.fields)
    for name, (column, _) in inputs.gaps.items():
        refuse_gaps(name, column)
    for name in inputs.std:
        raise InputError(name, values.get(name, values.get("f")), NO_DEVIATION)
    if inputs.ends is not None:
        raise InputError("k", values.get("k"), "one value, no interval")
    return inputs.columns


_Numbers = dict[str, float | Array]
#: columns with gaps, and their shape, by the original input
_Gaps = dict[str, tuple[Column, tuple[int, ...]]]


class _Inputs(NamedTuple):
    """Hold the inputs as numbers, and their units, deviations and gaps."""

    columns: _Numbers
    std: _Numbers
    ends: tuple[Any, Any] | None
    units: dict[str, str]
    f: float | Array | None  #: the frequency, if it replaced omega
    gaps: _Gaps


def _understood(name: str, value: Any, gaps: _Gaps) -> Value:
    """Return one value, or the numbers of a column; add its gaps to ``gaps``."""
    if type(value) is float:
        return Value(value)
    if type(value) is str or not is_column(value):
        return read(name, value)
    column = read_column(name, value)
    if column.faults:
        gaps[name] = column, column.si.shape
    return Value(column.si, unit=column.unit)


def _by_case(gaps: _Gaps, shape: tuple[int, ...], strict: bool) -> dict[str, Mapping[int, Fault]]:
    """Return the gaps of columns by the cases that they affect.  If ``strict``, raise InputError
    for the first gap."""
    faults: dict[str, Mapping[int, Fault]] = {}
    for name, (column, of_column) in gaps.items():
        faults[name] = column.faults
        if of_column != shape:
            places = np.broadcast_to(np.arange(column.si.size).reshape(of_column), shape).ravel()
            faults[name] = {
                case: column.faults[place]
                for case, place in enumerate(places.tolist())
                if place in column.faults
            }
        if strict:
            refuse_gaps(name, column._replace(faults=faults[name]))
    return faults


def _inputs(values: Mapping[str, Any], fields: tuple[str, ...]) -> _Inputs:
    """Return the inputs of these names."""
    columns: _Numbers = {}
    units: dict[str, str] = {}
    std: _Numbers = {}
    gaps: _Gaps = {}
    f: float | Array | None = None
    texts = [name for name, x in values.items() if type(x) is str]
    if len(texts) > 1:
        check_signs({name: values[name] for name in texts})
    ends = None if values.keys().isdisjoint(ENDS) else ends_in(values, gaps)
    for name in fields:
        source = name if name != "omega" else _frequency_in(values, fields)
        if name == "k" and ends is not None:
            columns[name] = middle(*ends)
            continue
        if source not in values:
            raise _missing(values, fields)
        value = values[source]
        if type(value) is not float and not (
            type(value) is np.ndarray and value.dtype is _FLOAT and value.ndim
        ):
            one = _understood(source, value, gaps)
            value = one.si
            if one.unit:
                units[source] = one.unit
            if one.std is not None:
                std[name] = one.std * field_of(source)[1]
            if one.low is not None:
                ends = one.low, one.high
        if source == "f":
            f = value
            value = RAD_PER_CYCLE * value if type(value) is float else angular(value)
        columns[name] = value
    return _Inputs(columns, std, ends, units, f, gaps)


def _deviations(
    values: Mapping[str, Any], fields: tuple[str, ...], within: Mapping[str, Any], gaps: _Gaps
) -> _Numbers:
    """Return the deviations that are separate inputs, by field.  ``within`` has the deviations in
    the values themselves.  Add the gaps of columns to ``gaps``."""
    std: _Numbers = {}
    for column in [column for column in DEVIATIONS if column in values]:
        name = DEVIATIONS[column]
        value, (field, per) = values[column], _DEVIATION_OF[column]
        if field not in fields:
            bound = f"left out: this direction has no {name}"
            raise InputError(column, value, bound)
        if field in std or field in within:
            bound = f"left out beside that of {field}: give the deviation once"
            raise InputError(column, value, bound)
        if type(value) is not float:
            deviation = _understood(column, value, gaps)
            if deviation.std is not None or deviation.low is not None:
                raise InputError(column, value, A_DEVIATION)
            value = deviation.si
        std[field] = per * value
    return std


def _deviation_beside_interval(values: Mapping[str, Any], field: str) -> InputError:
    """Return the error for an input with a deviation in a case whose k is an interval."""
    names = (field, "f") if field == "omega" else (field,)
    written = next(name for name in (*(f"std_{name}" for name in names), *names) if name in values)
    absent = "left out" if written in DEVIATIONS else "without a deviation"
    bound = f"{absent} beside an interval of k: give k with a deviation, or the rest without"
    return InputError(written, values[written], bound)


def _refuse_other_amplitude(values: Mapping[str, Any], kind: Kind) -> None:
    """Raise InputError for the amplitude of another direction, unless its column is empty."""
    name = kind.other_amplitude
    if name not in values:
        return
    value, gaps = values[name], dict[str, Any]()
    is_empty = value is not None and np.isnan(_understood(name, value, gaps).si).all()
    unread = (fault.entry for column, _ in gaps.values() for fault in column.faults.values())
    if not is_empty or any(entry is not None for entry in unread):
        raise other_amplitude(name, value, kind)


def other_amplitude(name: str, value: Any, kind: Kind) -> InputError:
    """Return the error for the amplitude of another direction."""
    bound = (
        f"left out for direction {DIRECTIONS[kind.direction]}, whose amplitude is {kind.amplitude}"
    )
    return InputError(name, value, bound)


def _check_ends(low: float | Array, high: float | Array, shape: tuple[int, ...]) -> None:
    """Refuse the first case whose interval has ends that are not ordered."""
    ends = [np.broadcast_to(end, math.prod(shape)) for end in (low, high)]
    for index in np.flatnonzero(~is_interval(*ends) & ~np.isinf(ends[0])).tolist():
        raise no_interval(float(ends[0][index]), float(ends[1][index]), index if shape else None)


def _of_all(x: float | Array, shape: tuple[int, ...]) -> float | Array:
    """Return a column as one number, or flat with one number for each case."""
    if not isinstance(x, np.ndarray):
        return x
    if x.size == 1:
        return x.item()
    is_plain = x.shape == shape and x.ndim == 1 and x.flags.c_contiguous and x.flags.aligned
    return x if is_plain else flat(x, shape)


def _shape_of(columns: _Numbers, std: _Numbers) -> tuple[int, ...]:
    """Return the shape to which all columns broadcast.  Raise InputError if they do not."""
    shapes = {x.shape for x in columns.values() if isinstance(x, np.ndarray)}
    if std:
        shapes |= {x.shape for x in std.values() if isinstance(x, np.ndarray)}
    if len(shapes) < 2:
        return shapes.pop() if shapes else ()
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError as error:
        by_name = {name: np.shape(x) for name, x in (columns | std).items() if np.ndim(x)}
        raise InputError("inputs", by_name, "arrays whose shapes broadcast together") from error


def _missing(values: Mapping[str, Any], fields: tuple[str, ...]) -> InputError:
    """Return the error that says what to give if ``values`` lack inputs."""
    frequency = {name for name in ("omega", "f") if values.get(name) is not None}
    present = {*values} - {"omega"} | ({"omega"} if frequency else set())
    absent = [name for name in fields if name not in present]
    in_words = {name: f"{name} [{UNITS.get(name, 'N')}]" for name in absent}
    in_words["omega"] = "omega [rad/s] or f [Hz]"
    bounds = {name: f"given [{UNITS.get(name, 'N')}]" for name in absent} | {
        "k": f"given: {STIFFNESS}",
        "omega": "given, or f [Hz] in its place",
        AMPLITUDE: "given [N] for direction normal",
    }
    rest = ", ".join(in_words[name] for name in absent[1:])
    return InputError(absent[0], None, bounds[absent[0]] + (rest and f"; so must {rest}"))


@np.errstate(over="ignore")  # faster than a with statement in the function
def angular(frequency: float | Array) -> float | Array:
    """Return omega [rad/s] of f [Hz].  Beyond double range it is infinite, which is later refused
    as a value of f."""
    return frequency * RAD_PER_CYCLE


def _frequency_in(values: Mapping[str, Any], fields: tuple[str, ...]) -> str:
    """Return which of omega and f the values contain."""
    if values.get("f") is None:
        if values.get("omega") is None:
            raise _missing(values, fields)
        return "omega"
    if values.get("omega") is None:
        return "f"
    bound = "left out beside f [Hz], which stands in its place: give one, not both"
    raise InputError("omega", values["omega"], bound)


def real(name: str, value: Any) -> Array:
    """Return a value as an array of float64, exact, in the way of
    :func:`mumacro.inputs.columns.to_si`."""
    return np.asarray(to_si(name, value))


def check(
    columns: Mapping[str, float | Array], frequency: Any = None, shape: tuple[int, ...] = ()
) -> None:
    """Refuse the first value out of :data:`BOUNDS`.  ``frequency`` has the values of ``f`` if it
    replaced omega.  ``shape`` is the shape of all cases, for the index of the case."""
    for name, values in columns.items():
        if type(values) is float and (
            (values > 0.0 or (values == 0.0 and name not in POSITIVE))
            and (values < math.inf or name == "k")
        ):
            continue
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
    """Return the index of the first case with an illegal value, or None for one value that is in
    all cases."""
    if not illegal.ndim:
        return None
    cases = np.flatnonzero(np.broadcast_to(illegal, shape or illegal.shape))
    return int(cases[0]) if cases.size else 0

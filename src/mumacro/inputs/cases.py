"""Cases in their one form: columns of numbers by name, made once from any form of inputs.

Keywords, a mapping, a data frame, Arrow columns, rows of a file or of JSON become names and values
(:func:`named`), and these become :class:`Cases`, which alone are evaluated
(:mod:`mumacro.outputs`).  Labels of pandas, xarray and Dask are taken off and put back by
:mod:`mumacro.frames`, between the two steps.
"""

import enum
import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.fields import (
    BOUNDS,
    ENDS,
    FIELDS,
    LIFTS_OFF,
    POSITIVE,
    RAD_PER_CYCLE,
    STIFFNESS,
    UNITS,
    field_of,
    refusal,
)
from mumacro.inputs.kind import (
    AMPLITUDE,
    AMPLITUDES,
    DIRECTIONS,
    KINDS,
    SPRING,
    Kind,
    code_of,
    kind_of,
)
from mumacro.inputs.names import in_place_of, suggestion
from mumacro.inputs.reading import NO_DEVIATION, NUMBERS, in_unit, read
from mumacro.inputs.units import split_unit
from mumacro.kernel.arrays import Array, Codes, Places, common_shape, flat


class Absent(enum.Enum):
    """The default of an input.  None cannot be it: None is a gap in the data, which is refused for
    k."""

    ABSENT = "left out"

    def __repr__(self) -> str:
        return self.value


ABSENT: Final = Absent.ABSENT
_UNLABELLED = NUMBERS | {np.ndarray, list, tuple, type(None), dict, str}
_FLOAT = np.dtype(np.float64)
#: the fields where the direction is a column
ALL_FIELDS = (*FIELDS[:4], AMPLITUDE, *FIELDS[4:])
KIND = ("contact", "direction")
_NORMAL = np.array([kind.normal for kind in KINDS])
#: columns of deviations -> the input
DEVIATIONS = {f"std_{name}": name for name in (*ALL_FIELDS, "f")}
#: what a data frame or a file may hold
COLUMNS = (*ALL_FIELDS, "f", *ENDS, *KIND, *DEVIATIONS)
#: what a mapping may hold, too: options of one call
OPTIONS = ("include", "gradient", "illegal")
EXACT = "finite and >= 0, 0 where the input is exact"  # the bound of a deviation
# what stands for one number alone, without a deviation of its own
A_DEVIATION = "one number: the deviation itself"
AN_END = "one number: an end of the interval"


class Cases(NamedTuple):
    """Cases as they are evaluated, of one contact and direction, or of one for each case."""

    #: of all cases; None where each has its own, see ``codes``
    kind: Kind | None
    #: the names of the inputs; both amplitudes where the direction is a column
    fields: tuple[str, ...]
    #: by these names and in their order one number for all cases, or an array (n,); k is infinite
    #: where rigid, and the geometric middle of an interval
    columns: dict[str, float | Array]
    #: of the inputs, broadcast: () for one case alone
    shape: tuple[int, ...]
    #: lowest and highest k of an interval, each (n,)
    ends: tuple[Array, Array] | None = None
    #: standard deviations of inputs, in their units, by name as in ``columns``; without an entry 0
    std: dict[str, float | Array] = {}  # noqa: RUF012 - never changed
    #: place in ``kind.KINDS`` of each case, -1 for a contact or a direction that does not exist
    codes: Codes | None = None
    #: what messages name as it came in: f, contact and direction, an amplitude of another direction
    given: dict[str, Any] = {}  # noqa: RUF012 - never changed
    #: units that values carried, by the input as it came in
    units: dict[str, str] = {}  # noqa: RUF012 - never changed

    @classmethod
    def of(
        cls, values: Mapping[str, Any], kind: Kind | None = None, strict: bool = False
    ) -> "Cases":
        """Cases from names and values, see :func:`named`; ``kind`` where the values do not tell.

        InputError where an input is missing, is no real number, or shapes do not broadcast.  A
        value out of bounds is one where ``strict``, and for a case alone.

        >>> inputs = dict(mu0=0.3, Fz=10.0, k="rigid", y0=[1e-6, 2e-6], omega=1e5, v0=0.01)
        >>> cases = Cases.of(inputs)
        >>> cases.shape, cases.columns["k"]
        ((2,), inf)
        >>> Cases.of({**inputs, "contact": ["ball", "spring"]}).codes.tolist()
        [1, 0]
        """
        texts = {} if kind is not None else _texts(values)
        if kind is None and not any(isinstance(text, np.ndarray) for text in texts.values()):
            kind, texts = kind_of(**texts), {}
        of_direction = _of_direction(texts) if kind is None else kind
        fields = ALL_FIELDS if of_direction is None else of_direction.fields
        strange = _strange_amplitude(values, of_direction)
        columns, std, ends, units, others = _inputs(values, fields)
        std |= _deviations(values, fields, std)
        others |= strange | texts
        shape = _shape_of(columns, std, others)
        for part in (columns, std, others):
            for name, x in part.items():
                if isinstance(x, np.ndarray):
                    part[name] = flat(x, shape) if x.size != 1 else x.item()
        if ends is not None:
            ends = _flat_ends(ends, shape, strict)
        codes = codes_of(others, (math.prod(shape),)) if texts else None
        cases = cls(kind, fields, columns, shape, ends, std, codes, others, units)
        if std or strange or texts:
            return cases._where_they_agree(values, strict or not shape)
        if strict or not shape:
            check(columns, others.get("f"), (cases.size,) if shape else ())
        return cases

    @property
    def size(self) -> int:
        """How many cases."""
        return math.prod(self.shape)

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """The contacts and directions among the cases."""
        if self.codes is None:
            return () if self.kind is None else (self.kind,)
        return tuple(KINDS[code] for code in np.unique(self.codes).tolist() if code >= 0)

    @property
    def one_kind(self) -> Kind:
        """The contact and direction of all cases; TypeError where each has its own."""
        if self.kind is None:
            raise TypeError("the cases are of several kinds: see by_kind")
        return self.kind

    def part(self, which: slice | Places) -> "Cases":
        """Some of many cases, (m,)."""

        def cut(columns: Mapping[str, Any]) -> dict[str, Any]:
            return {
                name: x[which] if isinstance(x, np.ndarray) else x for name, x in columns.items()
            }

        size = len(range(*which.indices(self.size))) if isinstance(which, slice) else which.size
        return self._replace(
            columns=cut(self.columns),
            shape=(size,),
            ends=self.ends and (self.ends[0][which], self.ends[1][which]),
            std=cut(self.std),
            codes=None if self.codes is None else self.codes[which],
            given=cut(self.given),
        )

    def by_kind(self) -> Iterator[tuple[slice | Places, "Cases"]]:
        """The cases of each contact and direction, and where they stand."""
        if self.codes is None:
            yield slice(None), self
            return
        for kind in self.kinds:
            where, fields = np.flatnonzero(self.codes == KINDS.index(kind)), kind.fields
            part = self.part(where)
            yield (
                where,
                part._replace(
                    kind=kind,
                    fields=fields,
                    columns={name: part.columns[name] for name in fields},
                    std={name: part.std[name] for name in fields if name in part.std},
                    codes=None,
                ),
            )

    def reason(self, index: int) -> InputError:
        """Why the case at ``index`` has no answer."""

        def at(column: Any) -> Any:
            return column[index] if isinstance(column, np.ndarray) else column

        columns, std, others = (
            {name: at(x) for name, x in part.items()}
            for part in (self.columns, self.std, self.given)
        )
        ends = None
        if self.ends is not None:
            ends = float(self.ends[0][index]), float(self.ends[1][index])
        try:
            kind = self.kind or kind_of(others["contact"], others["direction"])
            for name in AMPLITUDES:
                if np.broadcast_to(self._strange(name), max(self.size, 1))[index]:
                    raise _no_such_amplitude(name, float({**columns, **others}[name]), kind)
            if ends and math.isnan(columns["k"]):
                raise no_interval(*ends)
            for name, deviation in std.items():
                if name in kind.fields and not 0.0 <= deviation < math.inf:
                    raise InputError(f"std_{name}", float(deviation), EXACT)
            check({name: float(columns[name]) for name in kind.fields}, others.get("f"))
        except InputError as error:
            return error
        raise AssertionError(f"the case {columns} has an answer")

    # --- relations between inputs -----------------------------------------------------------------

    def _has(self, name: str) -> Any:
        """Whether a case has an amplitude of this name, () or (n,)."""
        if self.codes is None:
            return np.bool_(name in self.fields)
        return (_NORMAL[self.codes] == (name == AMPLITUDE)) & (self.codes >= 0)

    def _strange(self, name: str) -> Any:
        """Whether a case is given an amplitude that it does not have, () or (n,).  One number is
        for those cases that have it."""
        column, has = self.given.get(name, self.columns.get(name, math.nan)), self._has(name)
        one_for_all = self.codes is not None and not isinstance(column, np.ndarray)
        return ~has & ~np.isnan(column) & (not (one_for_all and has.any()))

    def _where_they_agree(self, values: Mapping[str, Any], refuse: bool) -> "Cases":
        """The same, with NaN in v0 where contact, direction, amplitudes and deviations do not go
        together; where ``refuse``, InputError for the first case that is not legal."""
        bad = np.zeros(self.size if self.shape else 1, np.bool_)
        for name in AMPLITUDES:
            if name not in self.columns and self.codes is not None and self._has(name).any():
                raise _missing(
                    values, tuple(x for x in self.fields if x not in AMPLITUDES or x == name)
                )
            bad |= self._strange(name)
        for name, deviation in self.std.items():
            legal = (np.asarray(deviation) >= 0.0) & (np.asarray(deviation) < math.inf)
            bad |= ~legal if name not in AMPLITUDES else ~legal & self._has(name)
        if self.codes is not None:
            bad |= self.codes < 0
        if refuse:
            self._refuse_first(np.flatnonzero(bad).tolist()[:1])
        if not bad.any():
            return self
        return self._replace(
            columns={**self.columns, "v0": np.where(bad, math.nan, self.columns["v0"])}
        )

    def _refuse_first(self, bad: list[int]) -> None:
        """Refuse the first case that is ``bad``, or has a number out of bounds."""
        for places, part in self.by_kind():
            try:
                check(part.columns, part.given.get("f"), (part.size,) if part.shape else ())
            except InputError as error:
                index = error.index or 0
                bad.append(index if isinstance(places, slice) else int(places[index]))
        if bad:
            reason = self.reason(min(bad))
            where = min(bad) if self.shape else None
            raise InputError(reason.field, reason.value, reason.bound, where)


# --- from inputs of any form to names and values --------------------------------------------------


def named(cases: Any, keywords: Mapping[str, Any]) -> dict[str, Any]:
    """The inputs and options of ``cases`` and those given by keyword, each once, by name.

    Of a mapping every name must be one of :data:`COLUMNS` or :data:`OPTIONS`; of a data frame, an
    Arrow table or a Dataset other columns are ignored, and refused only where one resembles an
    input that is missing.  Columns of Arrow become arrays.  InputError for a name given twice.

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
    for name, value in values.items():
        if type(value) not in _UNLABELLED and not library_of(value) and _of_arrow(value):
            values[name] = np.asarray(value)  # NaN where it is null
    return values


def _select(cases: Any) -> tuple[dict[str, Any], list[str]]:
    """What ``cases`` hold by known names, and the names of the rest."""
    if isinstance(cases, Mapping) and not library_of(cases):  # a Dataset is a mapping, too
        for name in cases.keys() - {*COLUMNS, *OPTIONS}:
            raise no_such_input(str(name), cases[name])
        return dict(cases), []
    columns, present = _columns_in("cases", cases, COLUMNS)
    return columns, [name for name in present if name not in columns]


def no_such_input(name: str, value: Any, allowed: Iterable[str] = COLUMNS) -> InputError:
    """The error for a name that is none of ``allowed``."""
    names = [name for name in allowed if name not in DEVIATIONS]
    if (bound := in_place_of(name, allowed)) is not None:
        return InputError(name, value, bound)
    similar = suggestion(name)
    advice = f"; did you mean {similar}?" if similar in names else ""
    return InputError(name, value, f"one of {', '.join(names)}{advice}")


def _refuse_similar(rest: Iterable[str], values: Mapping[str, Any]) -> None:
    """Refuse a column that resembles an input while that input is missing."""
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
    """Those of ``names`` that a mapping, a data frame or one row of it, an Arrow table or stream,
    or a Dataset has."""
    return _columns_in(argument, cases, names)[0]


def _columns_in(
    argument: str, cases: Any, names: Iterable[str]
) -> tuple[dict[str, Any], Iterable[str]]:
    """The columns of these names, and the names of all columns."""
    if library_of(cases) == "pandas" and not hasattr(cases, "columns"):  # one row of a frame
        cases = cases.to_dict()
    # a stream of batches has no columns by name
    if hasattr(cases, "__arrow_c_stream__") and not hasattr(cases, "__dataframe__"):
        # its columns come from one reading: a second one may have another order
        import pyarrow as pa

        cases = pa.table(cases)
    try:
        # coordinates of a Dataset are inputs, too, although they are not keys; Arrow and Polars
        # have lists of names
        present: Any = (
            cases
            if hasattr(cases, "keys")
            else getattr(cases, "column_names", None) or cases.columns
        )
        names = dict.fromkeys(names)  # in their order: the first one is named where two are wrong
        columns = {name: cases[name] for name in names if name in present}
        for head in present:
            name, unit = split_unit(head) if isinstance(head, str) else (head, None)
            if unit is None or name not in names or head in names:
                continue
            if name in columns:
                raise InputError(name, head, "given once")
            columns[name] = in_unit(name, cases[head], unit)
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


def _of_arrow(value: Any) -> bool:
    """Whether a column comes from Arrow, Polars or another library with Arrow's interface."""
    value_type = type(value)
    return hasattr(value_type, "__arrow_c_stream__") or hasattr(value_type, "__arrow_c_array__")


def library_of(value: Any) -> str:
    """The library whose labels or chunks a value has: pandas, xarray, dask; or nothing, also for an
    index or one value of pandas."""
    name = type(value).__module__.partition(".")[0]
    if name == "pandas":
        return name if hasattr(type(value), "iloc") else ""
    return name if name in ("xarray", "dask") else ""


def has_labels(values: Iterable[Any]) -> bool:
    """Whether the answer is labelled, since an input is."""
    types = {*map(type, values)}
    return not types <= _UNLABELLED and any(map(library_of, values))


def fixed_inputs(case: Mapping[str, Any], unknown: str, kind: Kind = SPRING) -> dict[str, float]:
    """The inputs of one case beside the unknown or swept one, by the names of ``kind.fields``; an
    infinite ``k`` is rigid.

    ``f`` may stand for ``omega``; inputs that are None are left out.  InputError where one of the
    five is missing or is not one legal number, and where the unknown has a value.
    """
    if unknown not in kind.columns:
        raise InputError("unknown", unknown, f"one of {', '.join(kind.columns)}")
    field = field_of(unknown)[0]
    for name in ENDS:
        if case.get(name) is not None:
            bound = (
                "left out: over an interval of k a target has an interval of roots; solve for "
                "both ends of it"
            )
            raise InputError(name, case[name], bound)
    for name in case.keys() & DEVIATIONS.keys():
        raise InputError(name, case[name], NO_DEVIATION)
    for name in case.keys() - {*kind.columns, *AMPLITUDES, *ENDS}:
        raise no_such_input(name, case[name], kind.columns)
    inputs = {
        name: value for name, value in case.items() if value is not None or name == "k" != unknown
    }
    for name in inputs.keys() & ({"omega", "f"} if field == "omega" else {field}):
        raise InputError(name, inputs[name], f"left out, because {unknown} is the unknown or swept")
    columns = columns_of({**inputs, field: 1.0}, kind)
    for name, column in columns.items():
        if np.size(column) != 1:
            raise InputError(name, inputs.get(name, inputs.get("f")), "one number")
    del columns[field]
    check(columns, inputs.get("f"))
    return {name: float(np.ravel(column)[0]) for name, column in columns.items()}


# --- an interval of k -----------------------------------------------------------------------------


def ends_in(values: Mapping[str, Any]) -> tuple[Any, Any] | None:
    """Return lowest and highest k, each one number or an array, where an interval is given.

    Raise InputError for one end without the other, for k beside them, and for one pair that is no
    interval.
    """
    missing = [name for name in ENDS if name not in values]
    if len(missing) == len(ENDS):
        return None
    if missing:
        raise InputError(missing[0], None, "given [N/m] beside the other end of the interval")
    if "k" in values:
        raise InputError("k", values["k"], "left out beside an interval of it")
    of_ends = [read(name, values[name]) for name in ENDS]
    for name, end in zip(ENDS, of_ends, strict=True):
        if end.std is not None:
            raise InputError(name, values[name], AN_END)
    low, high = (end.si for end in of_ends)
    try:
        legal = is_interval(low, high)
    except ValueError as error:
        shapes = np.shape(low), np.shape(high)
        raise InputError("k_low", shapes, "of a shape that broadcasts with k_high") from error
    if not np.ndim(legal) and not legal:
        raise no_interval(float(low), float(high))
    return low, high


def no_interval(low: float, high: float, index: int | None = None) -> InputError:
    """Return the error for two stiffnesses that are not the ends of an interval."""
    for name, end in zip(ENDS, (low, high), strict=True):
        if not 0.0 < end < math.inf:
            return InputError(name, end, BOUNDS[name], index)
    return InputError("k_low", low, "at most k_high", index)


def is_interval(low: Any, high: Any) -> Any:
    """Whether two stiffnesses are the ends of an interval."""
    return np.greater(low, 0.0) & np.less_equal(low, high) & np.less(high, math.inf)


def middle(low: Any, high: Any) -> float | Array:
    """The geometric middle of intervals, NaN where one is none."""
    legal = is_interval(low, high)
    lower, upper = (np.where(legal, end, math.nan) for end in (low, high))
    inside = np.clip(np.sqrt(lower) * np.sqrt(upper), lower, upper)
    return inside if inside.ndim else float(inside)


def without_interval(
    case: Mapping[str, Any], along: str = ""
) -> tuple[Mapping[str, Any], dict[str, Any]]:
    """A case with the middle of an interval of k, and the two ends; no ends where it has one k.

    InputError for an interval where k itself is swept.
    """
    inputs = {name: value for name, value in case.items() if value is not None or name == "k"}
    ends = ends_in(inputs)
    if ends is None and isinstance(inputs.get("k"), str):
        reading = read("k", inputs["k"])
        ends = None if reading.low is None else (reading.low, reading.high)
    if ends is None:
        return case, {}
    if along == "k":
        raise InputError("k_low", ends[0], "left out where k is the swept input")
    rest = {name: x for name, x in inputs.items() if name not in ENDS}
    return {**rest, "k": middle(*ends)}, dict(zip(ENDS, ends, strict=True))


# --- from values to numbers -----------------------------------------------------------------------


def columns_of(values: Mapping[str, Any], kind: Kind = SPRING) -> dict[str, float | Array]:
    """The six inputs by the names of ``kind.fields``, each one number or an array of float64,
    exact.

    InputError where one is missing, is given twice, is no real number, has a deviation, or is the
    amplitude of another direction.
    """
    _strange_amplitude(values, kind, refuse=True)
    for name in values.keys() & DEVIATIONS.keys():
        raise InputError(name, values[name], NO_DEVIATION)
    inputs = _inputs(values, kind.fields)
    for name in inputs.std:
        raise InputError(name, values.get(name, values.get("f")), NO_DEVIATION)
    if inputs.ends is not None:
        raise InputError("k", values.get("k"), "one value, no interval")
    return inputs.columns


_Numbers = dict[str, float | Array]


class _Inputs(NamedTuple):
    """The inputs as numbers, and what else their values say."""

    columns: _Numbers
    std: _Numbers
    ends: tuple[Any, Any] | None
    units: dict[str, str]
    others: dict[str, Any]  #: f, where it was given


def _inputs(values: Mapping[str, Any], fields: tuple[str, ...]) -> _Inputs:
    """The inputs of these names."""
    columns: _Numbers = {}
    units: dict[str, str] = {}
    std: _Numbers = {}
    others: dict[str, Any] = {}
    ends = ends_in(values)
    for name in fields:
        source = name if name != "omega" else _frequency_in(values, fields)
        if name == "k" and ends is not None:
            columns[name] = middle(*ends)
            continue
        if source not in values:
            if name in AMPLITUDES and fields is ALL_FIELDS:
                continue
            raise _missing(values, fields)
        value = values[source]
        if type(value) is not float and not (
            type(value) is np.ndarray and value.dtype is _FLOAT and value.ndim
        ):
            quantity = read(source, value)
            value = quantity.si
            if quantity.unit:
                units[source] = quantity.unit
            if quantity.std is not None:
                std[name] = quantity.std * field_of(source)[1]
            if quantity.low is not None:
                ends = quantity.low, quantity.high
        if source == "f":
            others["f"] = value
            value = _angular(value)
        columns[name] = value
    return _Inputs(columns, std, ends, units, others)


def _deviations(
    values: Mapping[str, Any], fields: tuple[str, ...], within: Mapping[str, Any]
) -> _Numbers:
    """The deviations that are given beside the values, by field; ``within`` are those that stand in
    the values themselves."""
    std: _Numbers = {}
    for column in [column for column in DEVIATIONS if column in values]:
        name = DEVIATIONS[column]
        value, (field, per) = values[column], field_of(name)
        if field not in fields:
            bound = f"left out: this direction has no {name}"
            raise InputError(column, value, bound)
        if field in std or field in within:
            bound = f"left out beside that of {field}: give the deviation once"
            raise InputError(column, value, bound)
        deviation = read(name, value)
        if deviation.std is not None or deviation.low is not None:
            raise InputError(column, value, A_DEVIATION)
        std[field] = per * deviation.si
    return std


def _strange_amplitude(
    values: Mapping[str, Any], kind: Kind | None, refuse: bool = False
) -> dict[str, Any]:
    """The amplitude of another direction, where there is a column of it: a case is refused where
    it has a value.  InputError for one value of all cases."""
    if kind is None:
        return {}
    name = AMPLITUDES[not kind.normal]
    if name not in values:
        return {}
    value = values[name]
    column = math.nan if value is None else read(name, value).si
    if refuse or not isinstance(column, np.ndarray):
        if not np.isnan(column).all() or value is None:
            raise _no_such_amplitude(name, value, kind)
        return {}
    return {name: column}


def _no_such_amplitude(name: str, value: Any, kind: Kind) -> InputError:
    bound = (
        f"left out for direction {DIRECTIONS[kind.direction]}, whose amplitude is "
        f"{AMPLITUDES[kind.normal]}"
    )
    return InputError(name, value, bound)


def _texts(values: Mapping[str, Any]) -> dict[str, Any]:
    """Contact and direction: one text each, or arrays of them."""
    texts = SPRING.names
    for name in values.keys() & texts.keys():
        text = values[name]
        if not isinstance(text, str):
            column = np.asarray(text, dtype=object)
            text = column if column.ndim else column.item()
        texts[name] = text
    return texts


def _of_direction(texts: Mapping[str, Any]) -> Kind | None:
    """One spring in the direction of all cases; None where the direction is a column."""
    direction = texts["direction"]
    return kind_of(direction=direction) if isinstance(direction, str) else None


def _flat_ends(ends: tuple[Any, Any], shape: tuple[int, ...], strict: bool) -> tuple[Array, Array]:
    """Both ends of the interval of every case, (n,); InputError for the first that is none, where
    ``strict``."""
    low, high = (flat(np.asarray(end), shape or (1,)) for end in ends)
    if strict:
        for index in np.flatnonzero(~is_interval(low, high) & ~np.isinf(low)).tolist():
            where = index if shape else None
            raise no_interval(float(low[index]), float(high[index]), where)
    return low, high


def _shape_of(*parts: Mapping[str, Any]) -> tuple[int, ...]:
    """The shape to which all columns broadcast; InputError where they do not."""
    columns = {name: x for part in parts for name, x in part.items() if isinstance(x, np.ndarray)}
    try:
        return common_shape(columns.values())
    except ValueError as error:
        shapes = {name: x.shape for name, x in columns.items()}
        raise InputError("inputs", shapes, "arrays whose shapes broadcast together") from error


def codes_of(words: Mapping[str, Any], shape: tuple[int, ...]) -> Codes:
    """The kind of each case by its place in KINDS, -1 where there is no such kind; contact and
    direction are texts or arrays of them."""
    pairs = []
    for name, usual in SPRING.names.items():
        word = words.get(name, usual)
        one = np.empty((), object)
        one[()] = word  # which may be a list: no word
        column = word if isinstance(word, np.ndarray) else one
        pairs.append(np.broadcast_to(column, shape).ravel().tolist())
    codes = [code_of(*pair) for pair in zip(*pairs, strict=True)]
    return np.array(codes, np.int8).reshape(shape)


def _missing(values: Mapping[str, Any], fields: tuple[str, ...]) -> InputError:
    """What to give, where ``values`` lack one or more of the inputs."""
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
    others = ", ".join(in_words[name] for name in absent[1:])
    return InputError(absent[0], None, bounds[absent[0]] + (others and f"; so must {others}"))


@np.errstate(over="ignore")  # takes less time than a with statement within
def _angular(frequency: float | Array) -> float | Array:
    """omega [rad/s] of f [Hz]; beyond double range infinite, which is refused as a value of f."""
    return frequency * RAD_PER_CYCLE


def _frequency_in(values: Mapping[str, Any], fields: tuple[str, ...]) -> str:
    """Which of omega and f the values have."""
    if values.get("f") is None:
        if values.get("omega") is None:
            raise _missing(values, fields)
        return "omega"
    if values.get("omega") is None:
        return "f"
    bound = "left out beside f [Hz], which stands in its place: give one, not both"
    raise InputError("omega", values["omega"], bound)


def real(name: str, value: Any) -> Array:
    """A value as an array of float64, exact: InputError where it has a deviation or is an
    interval."""
    quantity = read(name, value)
    if quantity.std is not None:
        raise InputError(name, value, NO_DEVIATION)
    if quantity.low is not None:
        raise InputError(name, value, "one value: only evaluate and its forms take intervals")
    return np.asarray(quantity.si)


def check(
    columns: Mapping[str, float | Array], frequency: Any = None, shape: tuple[int, ...] = ()
) -> None:
    """Refuse the first value out of :data:`BOUNDS`; ``frequency`` has the values of ``f`` where
    it replaced omega, ``shape`` is that of all cases, for the index of the case."""
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
    """The first case with an illegal value; None for one value that is in all cases."""
    if not illegal.ndim:
        return None
    cases = np.flatnonzero(np.broadcast_to(illegal, shape or illegal.shape))
    return int(cases[0]) if cases.size else 0

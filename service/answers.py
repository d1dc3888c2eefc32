"""The registry of what an answer holds: the default outputs, and the quantities that ``include`` adds.

A quantity is one entry: its name, its columns with units and texts, its cost, and how it is computed.  JSON, CSV,
Arrow, the models of answers, OpenAPI and the estimated cost of a request use the registry; the default outputs are its
first entry, service/quantities.py has the others.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mumacro import Surrogate
from mumacro.charts import REGIME_OF_SOURCE, REGIMES, SOURCES
from mumacro.contact import AMPLITUDE, SPRING, Kind
from mumacro.inputs import FIELDS
from mumacro.interval import middle

from .case import PLAIN, Asked

__all__ = [
    "DEFAULT", "INTERVAL", "QUANTITIES", "REGIME_NAMES", "SOURCES", "Cases", "Part", "Quantity", "answer_case",
    "answer_columns", "cost_of", "nested", "of_amplitude", "parts_of", "register", "said", "where",
]  # fmt: skip

Array = NDArray[np.float64]
Codes = NDArray[np.int8]
#: name of the regime of every source code
REGIME_NAMES = tuple(REGIMES[code] for code in REGIME_OF_SOURCE)


@dataclass(frozen=True)
class Part:
    """One column of an answer.

    ``path`` is its name in flat formats; in JSON the dot makes an object.  A column of names holds codes, and ``names``
    has the names by code.
    """

    path: str
    unit: str
    text: str
    kind: type = float
    names: tuple[str, ...] = ()

    @property
    def described(self) -> str:
        """Its meaning and unit."""
        return f"{self.text} [{self.unit}]"

    def value(self, number: float) -> Any:
        """One number of the column as JSON has it; NaN is written as null."""
        if self.names:
            return self.names[int(number)]
        return (None if number != number else bool(number)) if self.kind is bool else number

    def values(self, column: Any) -> list[Any]:
        """The column as JSON has it."""
        if self.kind is float:
            return list(column.tolist())
        if self.names:
            return list(np.array(self.names, dtype=object)[column].tolist())
        return [self.value(number) for number in column.tolist()]


@dataclass
class Cases:
    """Legal cases that quantities are computed for: arrays (n,), or numbers of numpy for one; k = inf is rigid contact.

    The groups are those of the library; the slopes, by name of the input, are there if a requested quantity needs them.
    """

    surrogate: Surrogate
    columns: Mapping[str, Any]
    answer: Any
    std: Mapping[str, float]
    kind: Kind = SPRING

    def __post_init__(self) -> None:
        answer = self.answer
        found = [answer.mu_macro, answer.error_bound, answer.v_tilde, answer.y_tilde, answer.length_scale]
        if isinstance(found[0], float):
            found = list(map(np.float64, found))
        self.mu_macro, self.error_bound, self.v_tilde, self.y_tilde, self.length_scale = found
        self.at_rest: Any = (self.columns[self.kind.fields[3]] == 0.0) | (self.columns["omega"] == 0.0)
        #: elastic, oscillating, with groups within double range
        self.usable: Any = np.isfinite(self.y_tilde) & ~self.at_rest

    def again(self, **changed: Any) -> Array:
        """mu_macro with other values of some inputs, in the same shape; NaN where they are not legal."""
        columns = [np.atleast_1d(changed.get(name, self.columns[name])) for name in self.kind.fields]
        n = self.mu_macro.size
        if self.kind == SPRING:
            a, b, c, d, e, f = columns
            found = self.surrogate.evaluate_columns(a, b, c, d, e, f, n)[0]
        else:
            named: dict[str, Any] = dict(zip(self.kind.fields, columns, strict=True))
            found = self.surrogate.evaluate(**named, **self.kind.names).mu_macro
        return np.broadcast_to(found, n).reshape(self.mu_macro.shape)

    def slopes(self) -> tuple[dict[str, Array], dict[str, Array]]:
        """d mu_macro / d input and the bounds, NaN along k where contact is rigid."""
        no_slope = where(np.isinf(self.columns["k"]), np.nan, 0.0)
        slopes, bounds = self.answer.gradient, self.answer.gradient_bound
        return {**slopes, "k": slopes["k"] + no_slope}, {**bounds, "k": bounds["k"] + no_slope}


def where(condition: Any, one: Any, other: Any) -> Any:
    """``np.where``, which takes a microsecond for a single number."""
    return np.where(condition, one, other) if isinstance(condition, np.ndarray) else one if condition else other


@dataclass(frozen=True)
class Quantity:
    """One name that ``include`` may hold."""

    name: str
    text: str  # its meaning, in one sentence
    parts: tuple[Part, ...]  # the columns that it adds
    #: to one column (n,) per part, in their order; NaN where there is no value
    compute: Callable[[Cases], Sequence[Any]]
    cost: float  # time of a case, in times of a plain answer
    slopes: bool = False  # whether it needs the gradient
    #: contact, direction or k_range that it cannot be computed for -> why
    lacks: Mapping[str, str] = field(default_factory=dict)


#: the columns of every answer
DEFAULT = (
    Part("mu_macro", "-", "Macroscopic coefficient of friction"),
    Part("mu_ratio", "-", "mu_macro/mu0, from 0 to 1"),
    Part("regime", "-", "How the contact moves", str, REGIME_NAMES),
    Part("error_bound", "-", "Bound of the absolute error of mu_macro"),
    Part("source", "-", "Block of the table, or closed-form tail, that the value came from", str, tuple(SOURCES)),
)
#: what an interval of k adds to it
INTERVAL = (
    Part("mu_macro_low", "-", "Smallest mu_macro over the interval of k"),
    Part("mu_macro_high", "-", "Largest mu_macro over the interval of k"),
)
_NAMES = tuple(part.path for part in DEFAULT)
_COSTS = {"ball": 100.0, "along": 10.0, "normal": 10.0, "k_range": 40.0}  # in times of one spring, across, at one k
QUANTITIES: dict[str, Quantity] = {}


def register(
    name: str, text: str, parts: Sequence[Part], cost: float, slopes: bool = False, **lacks: str
) -> Callable[[Any], Any]:
    """Add the quantity that the decorated function computes."""

    def add(compute: Callable[[Cases], Sequence[Any]]) -> Callable[[Cases], Sequence[Any]]:
        QUANTITIES[name] = Quantity(name, text, tuple(parts), compute, cost, slopes, lacks)
        return compute

    return add


def parts_of(include: Sequence[str], asked: Asked = PLAIN) -> list[Part]:
    """The columns of an answer with these quantities, in order."""
    parts = [*DEFAULT, *(INTERVAL if asked.interval else ()), *(p for name in include for p in QUANTITIES[name].parts)]
    return [of_amplitude(part) for part in parts] if asked.kind.normal else parts


def of_amplitude(part: Part) -> Part:
    """The column of direction normal for that of y0."""
    if not part.path.endswith(".y0"):
        return part
    path, text = part.path.removesuffix("y0") + AMPLITUDE, part.text.replace("y0", AMPLITUDE)
    return replace(part, path=path, text=text, unit=part.unit.replace("(m)", "(N)"))


def said(asked: Asked) -> list[str]:
    """What is asked beside one spring, across, at one k."""
    words = [word for word in asked.kind.names.values() if word in _COSTS]
    return [*words, "k_range"] if asked.interval else words


def cost_of(include: Sequence[str], asked: Asked = PLAIN) -> float:
    """Time of a case with these quantities, in times of a plain answer."""
    cost = 1.0 + sum(QUANTITIES[name].cost for name in include)
    return cost if asked == PLAIN else cost * math.prod(_COSTS[word] for word in said(asked))


def nested(columns: Mapping[str, Any]) -> dict[str, Any]:
    """Columns by path as JSON has them: ``power.saved`` becomes ``power: {saved: ...}``."""
    out: dict[str, Any] = {}
    for path, column in columns.items():
        name, _, key = path.partition(".")
        if key:
            out.setdefault(name, {})[key] = column
        else:
            out[name] = column
    return out


# --- evaluation ---------------------------------------------------------------------------------------


def answer_case(
    surrogate: Surrogate, case: Mapping[str, float], include: Sequence[str] = (),
    std: Mapping[str, float] | None = None, asked: Asked = PLAIN,
) -> tuple[dict[str, Any], int]:  # fmt: skip
    """The answer to one legal case as plain Python values, and the code of its source; -1: the case is not legal."""
    if not include and asked == PLAIN:
        macro, ratio, bound, source = surrogate.evaluate_case(*(case[name] for name in FIELDS))
        return dict(zip(_NAMES, (macro, ratio, REGIME_NAMES[source], bound, SOURCES[source]), strict=True)), source
    inputs: dict[str, Any] = {**case}
    found = surrogate.evaluate(**inputs, **asked.kind.names, gradient=_need_slopes(include))
    source = found.source_code
    numbers = found.mu_macro, found.mu_ratio, REGIME_NAMES[source], found.error_bound, SOURCES[source]
    cases = Cases(surrogate, _six({n: np.float64(case[n]) for n in asked.fields}, asked), found, std or {}, asked.kind)
    ends = [getattr(found, part.path) for part in INTERVAL] if asked.interval else []
    columns = zip(parts_of(include, asked)[len(_NAMES) :], [*ends, *_computed(cases, include)], strict=True)
    more = nested({part.path: part.value(float(column)) for part, column in columns})
    return {**dict(zip(_NAMES, numbers, strict=True)), **more}, source


def _six(columns: dict[str, Any], asked: Asked) -> dict[str, Any]:
    """Columns with the middle k of an interval."""
    return {**columns, "k": middle(columns, "nan")[2]} if asked.interval else columns


def _need_slopes(include: Sequence[str]) -> bool:
    return any(QUANTITIES[name].slopes for name in include)


def _computed(cases: Cases, include: Sequence[str]) -> list[Any]:
    with np.errstate(over="ignore", under="ignore", invalid="ignore", divide="ignore"):
        return [column for name in include for column in QUANTITIES[name].compute(cases)]


def answer_columns(
    surrogate: Surrogate, six: Sequence[Array], n: int, include: Sequence[str] = (),
    std: Mapping[str, float] | None = None, asked: Asked = PLAIN,
) -> tuple[dict[str, Any], Codes]:  # fmt: skip
    """The columns of the answers by path, and the source codes: NaN and -1 for a case that is not legal.

    ``six`` has n cases in columns of shape (n,) or (1,), in the order of the fields; k = inf is rigid contact.
    """
    ends: dict[str, Any] = {}
    names: Any = asked.kind.names
    if asked == PLAIN:
        macro, ratio, bound, source = surrogate.evaluate_columns(six[0], six[1], six[2], six[3], six[4], six[5], n)
    else:
        whole = surrogate.evaluate(**dict(zip(asked.fields, six, strict=True)), **names)
        macro, ratio, bound, source = whole.mu_macro, whole.mu_ratio, whole.error_bound, whole.source_code
        ends = {part.path: getattr(whole, part.path) for part in INTERVAL} if asked.interval else {}
    parts = parts_of(include, asked)[len(DEFAULT) + len(ends) :]
    found: dict[str, Any] = {part.path: np.full(n, np.nan) for part in parts}
    where = np.flatnonzero(source >= 0)
    if include and where.size:
        legal: dict[str, Any] = {
            name: column[where] if column.size == n else np.full(where.size, column[0])
            for name, column in zip(asked.fields, six, strict=True)
        }
        legal = _six(legal, asked)
        at_k = {name: legal[name] for name in asked.kind.fields}
        answer = surrogate.evaluate(**at_k, **names, gradient=_need_slopes(include), groups=True)
        cases = Cases(surrogate, legal, answer, std or {}, asked.kind)
        for column, values in zip(found.values(), _computed(cases, include), strict=True):
            column[where] = values
    return {**dict(zip(_NAMES, (macro, ratio, source, bound, source), strict=True)), **ends, **found}, source

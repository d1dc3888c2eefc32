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
_USED = ("mu_macro", "error_bound", "v_tilde", "y_tilde", "length_scale")  # of an answer, by the quantities
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
    names: tuple[str, ...] = ()

    @property
    def described(self) -> str:
        """Its meaning and unit."""
        return f"{self.text} [{self.unit}]"

    def values(self, column: Any) -> list[Any]:
        """The column as JSON has it; NaN is written as null."""
        found = np.array(self.names, dtype=object)[column] if self.names else column
        return list(found.tolist())


@dataclass
class Cases:
    """Cases that quantities are computed for: arrays (n,), or numbers of numpy for one; k = inf is rigid contact.

    The slopes, by name of the input, are there if a requested quantity needs them.  What is not legal is NaN.
    """

    surrogate: Surrogate
    columns: Mapping[str, Any]
    answer: Any
    std: Mapping[str, float]
    kind: Kind = SPRING

    def __post_init__(self) -> None:
        self.columns = {name: _of_numpy(column) for name, column in self.columns.items()}
        found = (_of_numpy(getattr(self.answer, name)) for name in _USED)
        self.mu_macro, self.error_bound, self.v_tilde, self.y_tilde, self.length_scale = found
        self.at_rest = (self.columns[self.kind.fields[3]] == 0.0) | (self.columns["omega"] == 0.0)
        self.rigid = np.isinf(self.columns["k"])
        #: elastic, oscillating, with groups within double range
        self.usable = np.isfinite(self.y_tilde) & ~self.at_rest
        self.words: dict[str, Any] = self.kind.names

    def at_speed(self, v0: Any) -> Array:
        """mu_macro at another v0, in the same shape; NaN where that is not legal."""
        columns = {name: np.atleast_1d(column) for name, column in {**self.columns, "v0": v0}.items()}
        found = self.surrogate.evaluate(columns, **self.words).mu_macro
        return np.broadcast_to(found, self.mu_macro.shape or (1,)).reshape(self.mu_macro.shape)

    def slopes(self) -> tuple[dict[str, Array], dict[str, Array]]:
        """d mu_macro / d input and the bounds, NaN along k where contact is rigid."""
        no_slope = where(self.rigid, np.nan, 0.0)
        slopes, bounds = self.answer.gradient, self.answer.gradient_bound
        return {**slopes, "k": slopes["k"] + no_slope}, {**bounds, "k": bounds["k"] + no_slope}


def _of_numpy(column: Any) -> Any:
    return np.float64(column) if isinstance(column, float) else column


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
    Part("regime", "-", "How the contact moves", REGIME_NAMES),
    Part("error_bound", "-", "Bound of the absolute error of mu_macro"),
    Part("source", "-", "Block of the table, or closed-form tail, that the value came from", tuple(SOURCES)),
)
#: what an interval of k adds to it
INTERVAL = (
    Part("mu_macro_low", "-", "Smallest mu_macro over the interval of k"),
    Part("mu_macro_high", "-", "Largest mu_macro over the interval of k"),
)
_NAMES = tuple(part.path for part in DEFAULT)
_COSTS = {"ball": 100.0, "along": 10.0, "normal": 10.0, "k_range": 40.0}  # in times of one spring, across, at one k
QUANTITIES: dict[str, Quantity] = {}


def register(cost: float, *parts: Part, slopes: bool = False, **lacks: str) -> Callable[[Any], Any]:
    """Add the quantity that the decorated function computes: by its name, with its docstring as the text."""

    def add(compute: Callable[[Cases], Sequence[Any]]) -> Callable[[Cases], Sequence[Any]]:
        name, text = compute.__name__, (compute.__doc__ or "").removesuffix(".")
        QUANTITIES[name] = Quantity(name, text, parts, compute, cost, slopes, lacks)
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
    return replace(part, path=path, text=text, unit=part.unit.replace("m", "N"))


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
    surrogate: Surrogate, case: Mapping[str, Any], include: Sequence[str] = (),
    std: Mapping[str, float] | None = None, asked: Asked = PLAIN,
) -> tuple[dict[str, Any], int]:  # fmt: skip
    """The answer to one case as plain Python values, and the code of its source; InputError where it is not legal."""
    if not include and asked is PLAIN:
        macro, ratio, bound, code = surrogate.evaluate_case(*(case[name] for name in FIELDS))
        return dict(zip(_NAMES, (macro, ratio, REGIME_NAMES[code], bound, SOURCES[code]), strict=True)), code
    found, more = _evaluated(surrogate, case, include, std, asked)
    code = found.source_code
    values = found.mu_macro, found.mu_ratio, REGIME_NAMES[code], found.error_bound, SOURCES[code]
    return dict(zip(_NAMES, values, strict=True)) | nested({path: float(value) for path, value in more.items()}), code


def answer_columns(
    surrogate: Surrogate, six: Sequence[Array], n: int, include: Sequence[str] = (),
    std: Mapping[str, float] | None = None, asked: Asked = PLAIN,
) -> tuple[dict[str, Any], Codes]:  # fmt: skip
    """The columns of the answers by path, and the source codes: NaN and -1 for a case that is not legal.

    ``six`` has n cases in columns of shape (n,) or (1,), in the order of the fields; k = inf is rigid contact.
    """
    cases = {name: x if x.size == n else x.item() for name, x in zip(asked.fields, six, strict=True)}
    found, more = _evaluated(surrogate, cases, include, std, asked)
    codes = found.source_code
    values = found.mu_macro, found.mu_ratio, codes, found.error_bound, codes
    legal = codes >= 0
    more = {path: np.where(legal, column, np.nan) for path, column in more.items()}
    return {**dict(zip(_NAMES, values, strict=True)), **more}, codes


def _evaluated(
    surrogate: Surrogate, cases: Mapping[str, Any], include: Sequence[str], std: Mapping[str, float] | None,
    asked: Asked,
) -> tuple[Any, dict[str, Any]]:  # fmt: skip
    """The library's answer, and the columns beside the default ones by path."""
    slopes = any(QUANTITIES[name].slopes for name in include)
    words: dict[str, Any] = asked.kind.names
    found = surrogate.evaluate(**cases, **words, gradient=slopes, groups=bool(include))
    more = [getattr(found, part.path) for part in INTERVAL] if asked.interval else []
    if include:
        if asked.interval:
            cases = {**cases, "k": middle(cases, "nan")[2]}
        known = Cases(surrogate, {name: cases[name] for name in asked.kind.fields}, found, std or {}, asked.kind)
        with np.errstate(all="ignore"):
            more += [column for name in include for column in QUANTITIES[name].compute(known)]
    parts = parts_of(include, asked)[len(DEFAULT) :]
    return found, {part.path: column for part, column in zip(parts, more, strict=True)}

"""The registry of what an answer holds: the default outputs, and the quantities that ``include``
adds.

A quantity is one entry: its name, its columns with units and texts, its cost, and how it is
computed.  JSON, CSV, Arrow, the models of answers, OpenAPI and the estimated cost of a request use
the registry; the default outputs are its first entry, service/quantities.py has the others.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from operator import itemgetter
from typing import Any

import numpy as np

from mumacro import Surrogate
from mumacro.inputs.cases import middle
from mumacro.inputs.fields import FIELDS
from mumacro.inputs.kind import AMPLITUDE, SPRING, Kind
from mumacro.kernel.arrays import Array, Codes
from mumacro.table.atlas import REGIME_OF_SOURCE, REGIMES, SOURCES

from .case import PLAIN, Asked

#: name of the regime of every source code
REGIME_NAMES = tuple(REGIMES[code] for code in REGIME_OF_SOURCE)


@dataclass(frozen=True)
class Part:
    """One column of an answer.

    ``path`` is its name in flat formats; in JSON the dot makes an object.  A column of names holds
    codes, and ``names`` has the names by code; -1 is none.
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
        found = np.array((*self.names, None))[column] if self.names else column
        return list(found.tolist())


@dataclass
class Cases:
    """Cases that quantities are computed for: arrays (n,), or plain numbers for one; k = inf is
    rigid contact.

    The slopes, by name of the input, are there if a requested quantity needs them.  What is not
    legal is NaN.
    """

    surrogate: Surrogate
    columns: Mapping[str, Any]
    answer: Any
    std: Mapping[str, float]
    kind: Kind = SPRING

    def __post_init__(self) -> None:
        answer, columns = self.answer, self.columns
        self.mu_macro, self.error_bound = answer.mu_macro, answer.error_bound
        self.v_tilde, self.y_tilde, self.length_scale = (
            answer.v_tilde,
            answer.y_tilde,
            answer.length_scale,
        )
        self.moving = (columns[self.kind.fields[3]] != 0.0) & (columns["omega"] != 0.0)
        self.rigid = columns["k"] == math.inf
        #: elastic, oscillating, with groups within double range
        self.usable = (self.y_tilde < math.inf) & self.moving
        self.words: dict[str, Any] = self.kind.names

    def at_speed(self, v0: Any) -> Array:
        """mu_macro at another v0, in the same shape; NaN where that is not legal."""
        columns = {
            name: np.atleast_1d(column) for name, column in {**self.columns, "v0": v0}.items()
        }
        found = self.surrogate.evaluate(columns, **self.words).mu_macro
        shape = np.shape(self.mu_macro)
        return np.broadcast_to(found, shape or (1,)).reshape(shape)

    def slopes(self) -> tuple[dict[str, Array], dict[str, Array]]:
        """d mu_macro / d input and the bounds, NaN along k where contact is rigid."""
        no_slope = where(self.rigid, np.nan, 0.0)
        slopes, bounds = self.answer.gradient, self.answer.gradient_bound
        return {**slopes, "k": slopes["k"] + no_slope}, {**bounds, "k": bounds["k"] + no_slope}


def where(condition: Any, one: Any, other: Any) -> Any:
    """``np.where``, which takes a microsecond for a single number."""
    return (
        np.where(condition, one, other)
        if isinstance(condition, np.ndarray)
        else one
        if condition
        else other
    )


@dataclass(frozen=True)
class Quantity:
    """One name that ``include`` may hold."""

    text: str  # its meaning, in one sentence
    parts: tuple[Part, ...]  # the columns that it adds
    #: to one column (n,) per part, in their order; NaN where there is no value
    compute: Callable[[Cases], Sequence[Any]]
    cost: float  # time of a case, in times of a plain answer
    #: contact, direction or k_range that it cannot be computed for -> why
    lacks: Mapping[str, str] = field(default_factory=dict)


#: the columns of every answer
DEFAULT = (
    Part("mu_macro", "-", "Macroscopic coefficient of friction"),
    Part("mu_ratio", "-", "mu_macro/mu0, from 0 to 1"),
    Part("regime", "-", "How the contact moves", REGIME_NAMES),
    Part("error_bound", "-", "Bound of the absolute error of mu_macro"),
    Part(
        "source",
        "-",
        "Block of the table, or closed-form tail, that the value came from",
        tuple(SOURCES),
    ),
)
#: what an interval of k adds to it
INTERVAL = (
    Part("mu_macro_low", "-", "Smallest mu_macro over the interval of k"),
    Part("mu_macro_high", "-", "Largest mu_macro over the interval of k"),
)
_NAMES = tuple(part.path for part in DEFAULT)
_six = itemgetter(*FIELDS)
# in times of one spring, across, at one k; a ball along is a sum over springs
_COSTS = {"ball": 2.0, "along": 10.0, "normal": 10.0, "k_range": 200.0}
_BALL_ALONG = 5.0  # times both
QUANTITIES: dict[str, Quantity] = {}
_SLOPED = set[str]()  # those that need the gradient


def register(cost: float, *parts: Part, slopes: bool = False, **lacks: str) -> Callable[[Any], Any]:
    """Add the quantity that the decorated function computes: by its name, with its docstring as the
    text."""

    def add(compute: Callable[[Cases], Sequence[Any]]) -> Callable[[Cases], Sequence[Any]]:
        name, text = compute.__name__, (compute.__doc__ or "").removesuffix(".")
        QUANTITIES[name] = Quantity(text, parts, compute, cost, lacks)
        _SLOPED.update([name] if slopes else [])
        return compute

    return add


@dataclass(frozen=True)
class Wanted:
    """What is asked of cases: what they are, the quantities beside the default outputs, and
    deviations for ``std``."""

    asked: Asked = PLAIN
    include: tuple[str, ...] = ()
    std: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def parts(self) -> list[Part]:
        """The columns of an answer, in order."""
        more = [part for name in self.include for part in QUANTITIES[name].parts]
        parts = [*DEFAULT, *(INTERVAL if self.asked.interval else ()), *more]
        return [of_amplitude(part) for part in parts] if self.asked.kind.normal else parts

    @cached_property
    def more(self) -> list[str]:
        """The paths of the columns beside the default ones."""
        return [part.path for part in self.parts[len(DEFAULT) :]]

    @cached_property
    def cost(self) -> float:
        """Time of a case, in times of a plain answer."""
        cost = 1.0 + sum(QUANTITIES[name].cost for name in self.include)
        words = said(self.asked)
        if {"ball", "along"} <= {*words}:
            cost *= _BALL_ALONG
        return cost * math.prod(_COSTS[word] for word in words)


def of_amplitude(part: Part) -> Part:
    """The column of direction normal for that of y0."""
    if not part.path.endswith(".y0"):
        return part
    path, text = part.path.removesuffix("y0") + AMPLITUDE, part.text.replace("y0", AMPLITUDE)
    return replace(part, path=path, text=text, unit=part.unit.replace("m", "N"))


def said(asked: Asked) -> list[str]:
    """What is asked beside one spring, across, at one k."""
    words = (*asked.kind.names.values(), *(["k_range"] if asked.interval else []))
    return [word for word in words if word in _COSTS]


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


# --- evaluation -----------------------------------------------------------------------------------


def answer_case(
    surrogate: Surrogate, case: Mapping[str, Any], wanted: Wanted
) -> tuple[dict[str, Any], int]:
    """The answer to one case as plain Python values, and the code of its source; InputError where
    it is not legal."""
    if wanted.asked is PLAIN and not wanted.include:
        macro, ratio, bound, code = surrogate.evaluate_case(*_six(case))
        return dict(
            zip(_NAMES, (macro, ratio, REGIME_NAMES[code], bound, SOURCES[code]), strict=True)
        ), code
    found, more = _evaluated(surrogate, case, wanted)
    code = found.source_code
    values = found.mu_macro, found.mu_ratio, REGIME_NAMES[code], found.error_bound, SOURCES[code]
    return dict(zip(_NAMES, values, strict=True)) | nested(
        dict(zip(wanted.more, map(float, more), strict=True))
    ), code


def answer_columns(
    surrogate: Surrogate, six: Sequence[Array], n: int, wanted: Wanted
) -> tuple[dict[str, Any], Codes]:
    """The columns of the answers by path, and the source codes: NaN and -1 for a case that is not
    legal.

    ``six`` has n cases in columns of shape (n,) or (1,), in the order of the fields; k = inf is
    rigid contact.
    """
    cases = {
        name: x if x.size == n else x.item()
        for name, x in zip(wanted.asked.fields, six, strict=True)
    }
    with np.errstate(all="ignore"):
        found, more = _evaluated(surrogate, cases, wanted)
    codes = found.source_code
    values = dict(
        zip(_NAMES, (found.mu_macro, found.mu_ratio, codes, found.error_bound, codes), strict=True)
    )
    legal = codes >= 0
    return values | {
        path: np.where(legal, x, np.nan) for path, x in zip(wanted.more, more, strict=True)
    }, codes


def _evaluated(
    surrogate: Surrogate, cases: Mapping[str, Any], wanted: Wanted
) -> tuple[Any, list[Any]]:
    """The library's answer, and the columns beside the default ones."""
    asked, include = wanted.asked, wanted.include
    words: dict[str, Any] = asked.kind.names
    found = surrogate.evaluate(
        **cases, **words, gradient=not _SLOPED.isdisjoint(include), groups=bool(include)
    )
    more = [getattr(found, part.path) for part in INTERVAL] if asked.interval else []
    if include:
        if asked.interval:
            cases = {name: cases[name] for name in asked.kind.fields if name != "k"} | {
                "k": middle(cases)[2]
            }
        known = Cases(surrogate, cases, found, wanted.std, asked.kind)
        more += [column for name in include for column in QUANTITIES[name].compute(known)]
    return found, more

"""The registry of what an answer holds: the default outputs, and the quantities that ``include`` adds.

A quantity is one entry: its name, its columns with units and texts, its cost, and how it is computed.  JSON, CSV,
Arrow, the models of answers, OpenAPI and the estimated cost of a request use the registry; the default outputs are its
first entry, service/quantities.py has the others.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mumacro import Surrogate
from mumacro.charts import REGIME_OF_SOURCE, REGIMES, SOURCES
from mumacro.inputs import FIELDS

__all__ = [
    "DEFAULT", "QUANTITIES", "REGIME_NAMES", "SOURCES", "Cases", "Part", "Quantity", "answer_case",
    "answer_columns", "cost_of", "nested", "parts_of", "register",
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
    """Legal cases that quantities are computed for: six columns (n,), k = inf is rigid, and what is known of them."""

    surrogate: Surrogate
    columns: Mapping[str, Array]
    mu_macro: Array
    mu_ratio: Array
    error_bound: Array
    source: Codes
    std: Mapping[str, float]
    slopes: bool

    @cached_property
    def details(self) -> Any:
        """Groups, and slopes if a requested quantity needs them: v_tilde, y_tilde, length_scale, gradient, ..."""
        one = self.source.size == 1  # the library answers plain floats faster than arrays of one
        given: dict[str, Any] = {name: column.item() if one else column for name, column in self.columns.items()}
        answer = self.surrogate.evaluate(**given, gradient=self.slopes, groups=True)
        return _Details(answer, np.isinf(self.columns["k"]))

    @cached_property
    def at_rest(self) -> NDArray[np.bool_]:
        """Where nothing oscillates."""
        resting: NDArray[np.bool_] = (self.columns["y0"] == 0.0) | (self.columns["omega"] == 0.0)
        return resting

    @cached_property
    def usable(self) -> NDArray[np.bool_]:
        """Where the contact is elastic, oscillates, and its groups are within double range."""
        known: NDArray[np.bool_] = np.isfinite(self.details.y_tilde) & ~self.at_rest
        return known


class _Details:
    """Groups and slopes (n,): the slopes by name of the input, NaN along k where contact is rigid."""

    def __init__(self, answer: Any, rigid: NDArray[np.bool_]) -> None:
        self.v_tilde, self.y_tilde, self.length_scale = (
            np.atleast_1d(group) for group in (answer.v_tilde, answer.y_tilde, answer.length_scale)
        )
        self.gradient, self.gradient_bound = (
            {name: np.atleast_1d(slope) for name, slope in (found or {}).items()}
            for found in (answer.gradient, answer.gradient_bound)
        )
        if self.gradient:
            for slopes in (self.gradient, self.gradient_bound):
                slopes["k"] = np.where(rigid, np.nan, slopes["k"])


@dataclass(frozen=True)
class Quantity:
    """The default outputs, or one name that ``include`` may hold.

    Attributes
    ----------
    name : str
    text : str
        Its meaning, in one sentence.
    parts : tuple of Part
        The columns that it adds.
    compute : callable
        From :class:`Cases` to one column (n,) per part, in their order; NaN where there is no value.
    cost : float
        Time of a case, in times of a plain answer.
    slopes : bool
        Whether it needs the gradient.
    """

    name: str
    text: str
    parts: tuple[Part, ...]
    compute: Callable[[Cases], Sequence[Any]]
    cost: float
    slopes: bool = False


DEFAULT = Quantity(
    "answer",
    "The answer to a case",
    (
        Part("mu_macro", "-", "Macroscopic coefficient of friction"),
        Part("mu_ratio", "-", "mu_macro/mu0, from 0 to 1"),
        Part("regime", "-", "How the contact moves", str, REGIME_NAMES),
        Part("error_bound", "-", "Bound of the absolute error of mu_macro"),
        Part("source", "-", "Block of the table, or closed-form tail, that the value came from", str, tuple(SOURCES)),
    ),
    lambda cases: (cases.mu_macro, cases.mu_ratio, cases.source, cases.error_bound, cases.source),
    cost=1,
)
QUANTITIES: dict[str, Quantity] = {}


def register(quantity: Quantity) -> None:
    """Add a quantity."""
    QUANTITIES[quantity.name] = quantity


def parts_of(include: Sequence[str]) -> list[Part]:
    """The columns of an answer with these quantities, in order."""
    return [*DEFAULT.parts, *(part for name in include for part in QUANTITIES[name].parts)]


def cost_of(include: Sequence[str]) -> float:
    """Time of a case with these quantities, in times of a plain answer."""
    return DEFAULT.cost + sum(QUANTITIES[name].cost for name in include)


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
    surrogate: Surrogate, case: Mapping[str, float], include: Sequence[str] = (), std: Mapping[str, float] | None = None
) -> tuple[dict[str, Any], int]:
    """The answer to one legal case as plain Python values, and the code of its source; -1: the case is not legal."""
    mu_macro, mu, bound, source = surrogate.evaluate_case(*(case[name] for name in FIELDS))
    numbers = mu_macro, mu, source, bound, source
    values = {part.path: part.value(number) for part, number in zip(DEFAULT.parts, numbers, strict=True)}
    if include and source >= 0:
        columns = {name: np.array([case[name]]) for name in FIELDS}
        cases = _cases(surrogate, columns, [np.array([x]) for x in numbers[:2]], bound, source, include, std)
        for part, column in zip(parts_of(include)[len(values) :], _computed(cases, include), strict=True):
            values[part.path] = part.value(column[0].item())
        values = nested(values)
    return values, source


def _cases(
    surrogate: Surrogate, columns: Mapping[str, Array], mu: Sequence[Array], bound: Any, source: Any,
    include: Sequence[str], std: Mapping[str, float] | None,
) -> Cases:  # fmt: skip
    slopes = any(QUANTITIES[name].slopes for name in include)
    codes = np.atleast_1d(np.asarray(source, dtype=np.int8))
    return Cases(surrogate, columns, mu[0], mu[1], np.atleast_1d(bound), codes, std or {}, slopes)


def _computed(cases: Cases, include: Sequence[str]) -> list[Any]:
    with np.errstate(over="ignore", under="ignore", invalid="ignore", divide="ignore"):
        return [column for name in include for column in QUANTITIES[name].compute(cases)]


def answer_columns(
    surrogate: Surrogate, six: Sequence[Array], n: int, include: Sequence[str] = (),
    std: Mapping[str, float] | None = None,
) -> tuple[dict[str, Any], Codes]:  # fmt: skip
    """The columns of the answers by path, and the source codes: NaN and -1 for a case that is not legal.

    ``six`` has n cases in columns of shape (n,) or (1,), in the order of FIELDS; k = inf is rigid contact.
    """
    macro, ratio, bound, source = surrogate.evaluate_columns(six[0], six[1], six[2], six[3], six[4], six[5], n)
    parts = parts_of(include)
    found: dict[str, Any] = dict(
        zip((part.path for part in parts), (macro, ratio, source, bound, source), strict=False)
    )
    if include:
        where = np.flatnonzero(source >= 0)
        good = {
            name: column[where] if column.size == n else np.full(where.size, column[0])
            for name, column in zip(FIELDS, six, strict=True)
        }
        extra = parts[len(DEFAULT.parts) :]
        if where.size:
            cases = _cases(surrogate, good, (macro[where], ratio[where]), bound[where], source[where], include, std)
            computed = _computed(cases, include)
        for i, part in enumerate(extra):
            found[part.path] = np.full(n, np.nan)
            if where.size:
                found[part.path][where] = computed[i]
    return found, source

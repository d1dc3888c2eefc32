"""Cases -> answers, one or many.  Only requested quantities are computed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import blake2b
from struct import Struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .hints import TOO_FREQUENT
from .kernel import BOUNDS, FIELDS, RAD_PER_CYCLE, REGIME_NAMES, SOURCES, Array
from .quantities import QUANTITIES, Cases, compute, nested, parts_of
from .schemas import InputStd, deviations
from .tables import LoadedTable, signature

__all__ = [
    "MAX_ERRORS",
    "Answers",
    "Batch",
    "Reason",
    "angular_frequency",
    "answer_batch",
    "answer_case",
    "case_etag",
    "default_answer",
    "locate",
]

MAX_ERRORS = 1000  # bad cases of a batch that are listed
_SLICE = 16384  # cases that included quantities are computed for at a time
_SIX = Struct("<6d")

#: the bad field, or None for the case as a whole, and why
Reason = tuple[str | None, str]


@dataclass
class Batch:
    """A decoded batch.

    Attributes
    ----------
    size : int
    columns : list of ndarray
        The six inputs in the order of FIELDS, (size,) or (1,) where one value holds for all; k = inf is rigid contact.
        An entry that is not a number is NaN.
    reasons : dict of int to Reason
        Why a case could not be read, at least for the first MAX_ERRORS per column.  Such a case has a NaN.
    listed : bool
        Whether any input came as a list.
    """

    size: int
    columns: list[Array]
    reasons: dict[int, Reason] = field(default_factory=dict)
    listed: bool = True


def angular_frequency(f: Any, reasons: dict[int, Reason]) -> Any:
    """omega [rad/s] of ``f`` [Hz]; where that is beyond double range it is infinite, and the reason names f."""
    with np.errstate(over="ignore"):
        omega = f * RAD_PER_CYCLE
    for index in np.flatnonzero(np.isinf(omega))[:MAX_ERRORS].tolist():
        reasons.setdefault(index, ("f", TOO_FREQUENT))
    return omega


@dataclass
class Answers:
    """Answers to a batch, order kept: NaN, and -1 in ``source``, for a bad case.  ``extras`` has columns by path."""

    size: int
    mu_macro: Array
    mu_ratio: Array
    error_bound: Array
    source: NDArray[np.int8]
    n_bad: int
    errors: list[dict[str, Any]]
    extras: dict[str, Array] = field(default_factory=dict)

    def part(self, start: int, stop: int) -> "Answers":
        """The answers from ``start`` to ``stop``; there must be no bad case."""
        part = slice(start, stop)
        extras = {name: column[part] for name, column in self.extras.items()}
        columns = self.mu_macro[part], self.mu_ratio[part], self.error_bound[part], self.source[part]
        return Answers(stop - start, *columns, 0, [], extras)


def default_answer(table: LoadedTable, inputs: tuple[float, ...]) -> tuple[dict[str, Any], int]:
    """The default answer to six legal inputs, as plain Python values, and the code of its source."""
    mu0, Fz, k, y0, omega, v0 = inputs
    mu_macro, mu, bound, source = table.kernel.case(mu0, Fz, k, y0, omega, v0)
    return {
        "mu_macro": mu_macro,
        "mu_ratio": mu,
        "regime": REGIME_NAMES[source],
        "error_bound": bound,
        "source": SOURCES[source],
    }, source


def answer_case(
    table: LoadedTable, inputs: tuple[float, ...], include: Sequence[str] = (), std: InputStd | None = None
) -> tuple[dict[str, Any], int]:
    """The whole answer to six legal inputs, as plain Python values, and the code of its source."""
    values, source = default_answer(table, inputs)
    if include:
        columns = [np.array([value]) for value in inputs]
        numbers = np.array([values["mu_macro"]]), np.array([values["error_bound"]]), np.array([source], dtype=np.int8)
        found = _quantities(table, columns, *numbers, include, deviations(std))
        kinds = {part.path: part.kind for part in parts_of(include)}
        values.update(nested({path: kinds[path](column[0]) for path, column in found.items()}))
    values.update(signature(table))
    return values, source


def case_etag(table: LoadedTable, inputs: tuple[float, ...], include: tuple[str, ...], std: object) -> str:
    """Strong entity tag: an answer is a pure function of the table, the version and the query."""
    mu0, Fz, k, y0, omega, v0 = inputs
    # Adding 0.0 turns -0.0 into 0.0: the same case, the same tag.
    text = table.tag_key + _SIX.pack(mu0, Fz, k, y0 + 0.0, omega + 0.0, v0 + 0.0)
    if include or std is not None:
        text += repr((include, std)).encode()
    return f'"{blake2b(text, digest_size=16).hexdigest()}"'


def answer_batch(table: LoadedTable, batch: Batch, include: Sequence[str], std: Mapping[str, float]) -> Answers:
    """Answer every good case; a bad one gets NaN, -1 and a reason."""
    mu_macro, mu_ratio, bound, source = table.kernel.columns(batch.size, batch.columns)
    bad = np.flatnonzero(source < 0)
    answers = Answers(batch.size, mu_macro, mu_ratio, bound, source, bad.size, locate(batch, bad))
    if include:
        names = [part.path for part in parts_of(include)]
        answers.extras = {name: np.full(batch.size, np.nan) for name in names}
        for start in range(0, batch.size, _SLICE):
            where = start + np.flatnonzero(source[start : start + _SLICE] >= 0)
            if where.size:
                columns = [
                    column[where] if column.size > 1 else np.full(where.size, column[0]) for column in batch.columns
                ]
                known = mu_macro[where], bound[where], source[where]
                for path, values in _quantities(table, columns, *known, include, std).items():
                    answers.extras[path][where] = values
    return answers


def locate(batch: Batch, bad: NDArray[np.intp]) -> list[dict[str, Any]]:
    """The first MAX_ERRORS bad cases with the first bad field of each."""
    return [_error(batch, index) for index in bad[:MAX_ERRORS].tolist()]


def _error(batch: Batch, index: int) -> dict[str, Any]:
    found: Reason | None = batch.reasons.get(index)
    if found is None:
        for name, column in zip(FIELDS, batch.columns, strict=True):
            value = column[index if column.size > 1 else 0]
            legal = value > 0.0 or (value == 0.0 and name in ("y0", "omega", "v0"))
            if not legal or (value == np.inf and name != "k"):
                found = name, f"must be {BOUNDS[name]}"
                break
    bad, reason = found or (None, "is no legal case")
    return {"index": index, "field": bad, "reason": reason}


def _quantities(
    table: LoadedTable,
    columns: Sequence[Array],
    mu_macro: Array,
    bound: Array,
    source: NDArray[np.int8],
    include: Sequence[str],
    std: Mapping[str, float],
) -> dict[str, Array]:
    slopes = any(QUANTITIES[name].slopes for name in include)
    named = dict(zip(FIELDS, columns, strict=True))
    return compute(Cases(table.kernel, named, mu_macro, bound, source, std, slopes), include)

"""Cases -> answers.  Nothing is computed that is not asked for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import blake2b
from struct import Struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from friction import Surrogate
from friction.nondim import FIELDS, dimensional, evaluate_block
from friction.regions import REGIMES, SOURCES
from friction.surrogate import REGIME_OF_SOURCE
from service import API_VERSION
from service.compiled.block import mark_flaws
from service.limits import groups, limits, power, stick_fraction
from service.schemas import CaseRequest, Groups, InputStd, Limits, Power
from service.shelf import LoadedTable

__all__ = [
    "DEFAULT_KEYS",
    "Answers",
    "Cases",
    "answer_case",
    "answer_cases",
    "answer_columns",
    "case_etag",
    "default_answer",
    "included",
    "read_only",
    "signature",
]

Array = NDArray[np.float64]

DEFAULT_KEYS = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")
_NAMES = [(REGIMES[regime], source) for regime, source in zip(REGIME_OF_SOURCE, SOURCES, strict=True)]
_INFINITE = float("inf")
_EXTRA_SLICE = 16384  # cases that included values are computed for at a time
_SIX = Struct("<6d")
_NO_FLAWS = np.zeros(0, dtype=np.uint8)


@dataclass
class Cases:
    """A decoded batch.

    Attributes
    ----------
    size : int
    columns : list of ndarray
        The six inputs in the order of FIELDS, shape (size,) or (1,) where one value holds for all.  ``k`` is infinite
        for rigid contact; an entry that is no number is a NaN whose payload says why, see service/compiled/scan.py.
    flaws : NDArray[uint8]
        Not 0 where a case is bad as a whole.
    names : NDArray[int64] or None
        Where in ``text`` the unknown name of a bad row stands.
    listed : bool
        Whether any input came as a list.
    """

    size: int
    columns: list[Array]
    flaws: NDArray[np.uint8]
    names: NDArray[np.int64] | None = None
    text: NDArray[np.uint8] | None = None
    listed: bool = True


@dataclass
class Answers:
    """Answers to a batch, order kept: NaN, and -1 in ``source``, where ``flaws`` is not 0.

    ``extras`` holds what was included: an array, or a mapping of arrays, a name.  ``cases`` is what locates a fault;
    who writes the answers lets go of it before the first byte.
    """

    cases: Cases | None
    size: int
    mu_macro: Array
    mu_ratio: Array
    error_bound: Array
    source: NDArray[np.int8]
    flaws: NDArray[np.uint8]
    n_bad: int
    extras: dict[str, Any] = field(default_factory=dict)


def signature(table: LoadedTable) -> dict[str, object]:
    """What every reply carries: the table and the version of the interface."""
    return {"table": table.label, "api_version": API_VERSION}


def default_answer(table: LoadedTable, case: CaseRequest) -> tuple[dict[str, Any], int]:
    """The default answer to one checked case, as plain Python values, and the code of its source."""
    mu0, k = case.mu0, case.k
    mu, bound, source, _, _ = dimensional(
        mu0, case.Fz, _INFINITE if k is None else k, case.y0, case.omega, case.v0, *table.arrays
    )
    regime, name = _NAMES[source]
    return (
        {"mu_macro": mu0 * mu, "mu_ratio": mu, "regime": regime, "error_bound": mu0 * bound, "source": name},
        source,
    )


def included(table: LoadedTable, case: CaseRequest, include: Sequence[str]) -> dict[str, Any]:
    """What is included in the answer to one case, as plain Python values."""
    given = {name: getattr(case, name) for name in FIELDS}
    extras = _extras(table.surrogate, given, include, case.std)
    return {
        name: {key: float(part) for key, part in value.items()} if isinstance(value, dict) else float(value)
        for name, value in extras.items()
    }


def answer_case(table: LoadedTable, case: CaseRequest, include: Sequence[str]) -> tuple[dict[str, Any], int]:
    """The whole answer to one case, as plain Python values, and the code of its source."""
    values, source = default_answer(table, case)
    return {**values, **included(table, case, include), **signature(table)}, source


def case_etag(table: LoadedTable, case: CaseRequest, include: Sequence[str]) -> str:
    """Strong entity tag: an answer is a pure function of the table, the version and the query."""
    k = case.k
    # Adding 0.0 turns -0.0 into 0.0: the same case, the same tag.
    numbers = _SIX.pack(case.mu0, case.Fz, 0.0 if k is None else k, case.y0 + 0.0, case.omega + 0.0, case.v0 + 0.0)
    tail = b""
    if include or case.std is not None:
        tail = repr((tuple(include), case.std)).encode()
    return f'"{blake2b(table.tag_key + numbers + tail, digest_size=16).hexdigest()}"'


def read_only(column: Array) -> Array:
    """A view of the column that is not written to."""
    # Compiled code is kept by type, and arrays that may be written to are of another one than those that lie in an
    # Arrow stream.
    seen = column.view()
    seen.setflags(write=False)
    return seen


def answer_columns(table: LoadedTable, n: int, columns: Sequence[Array]) -> Answers:
    """Answer n cases in read-only columns.  Bad ones are counted; which those are, and why, is left to the caller.

    Runs without the interpreter's lock.
    """
    mu_macro, mu_ratio, bound = (np.empty(n) for _ in range(3))
    source = np.empty(n, dtype=np.int8)
    mu0, fz, k, y0, omega, v0 = columns
    a, b, c, d = table.arrays
    n_bad = evaluate_block(mu0, fz, k, y0, omega, v0, a, b, c, d, mu_macro, mu_ratio, bound, source)
    return Answers(None, n, mu_macro, mu_ratio, bound, source, _NO_FLAWS, n_bad)


def answer_cases(table: LoadedTable, cases: Cases, include: Sequence[str], std: InputStd | None = None) -> Answers:
    """Answer every good case; a bad one gets NaN and its code in ``flaws``."""
    columns = [read_only(column) for column in cases.columns]
    answers = answer_columns(table, cases.size, columns)
    answers.cases, answers.flaws = cases, cases.flaws
    if answers.n_bad or cases.flaws.any():
        mu0, fz, k, y0, omega, v0 = columns
        values = answers.mu_macro, answers.mu_ratio, answers.error_bound
        answers.n_bad = mark_flaws(mu0, fz, k, y0, omega, v0, *values, answers.source, cases.flaws)
    if include:
        answers.extras = _batch_extras(table.surrogate, cases, include, std)
    return answers


#: what each part of an answer that is included holds; None: one number
_KEYS: dict[str, tuple[str, ...] | None] = {
    "groups": tuple(Groups.model_fields),
    "limits": tuple(Limits.model_fields),
    "gradient": FIELDS,
    "std": None,
    "stick_fraction": None,
    "stick_fraction_bound": None,
    "power": tuple(Power.model_fields),
}
#: names that add more than the part that is called like them
_PARTS = {"stick_fraction": ("stick_fraction", "stick_fraction_bound")}


def _extras(
    surrogate: Surrogate, case: Mapping[str, Any], include: Sequence[str], std: InputStd | None
) -> dict[str, Any]:
    """What is included, as dicts of values or values; k is missing in what is asked of rigid contact."""
    slopes = "gradient" in include or "std" in include
    answer = surrogate.evaluate(**case, gradient=slopes, groups=True)
    gradient = answer.gradient or {}
    values: dict[str, Any] = {}
    for name in include:
        if name == "groups":
            values[name] = groups(answer)
        elif name == "limits":
            values[name] = limits(surrogate, case, answer)
        elif name == "gradient":
            values[name] = {field: gradient.get(field, np.nan) for field in FIELDS}
        elif name == "stick_fraction":
            values.update(stick_fraction(surrogate, case, answer))
        elif name == "power":
            values[name] = power(surrogate, case, answer)
        elif std is not None:
            total: Any = 0.0
            with np.errstate(over="ignore", invalid="ignore"):
                for field, slope in gradient.items():
                    deviation = getattr(std, field)
                    if deviation:  # an infinite slope does no harm where the input is exact
                        total = np.hypot(total, slope * deviation)
            values[name] = total
    return values


def _batch_extras(surrogate: Surrogate, cases: Cases, include: Sequence[str], std: InputStd | None) -> dict[str, Any]:
    extras: dict[str, Any] = {}
    for name in (part for wanted in include for part in _PARTS.get(wanted, (wanted,))):
        keys = _KEYS[name]
        empty = [np.full(cases.size, np.nan) for _ in keys or (name,)]
        extras[name] = empty[0] if keys is None else dict(zip(keys, empty, strict=True))
    k = cases.columns[FIELDS.index("k")]
    rigid = np.isposinf(k) if k.size != 1 else np.full(cases.size, bool(np.isposinf(k[0])))
    for start in range(0, cases.size, _EXTRA_SLICE):
        part = slice(start, start + _EXTRA_SLICE)
        good = cases.flaws[part] == 0
        for chosen in (good & ~rigid[part], good & rigid[part]):
            where = start + np.flatnonzero(chosen)
            if where.size == 0:
                continue
            case: dict[str, Any] = {
                name: column[where] if column.size > 1 else np.full(where.size, column[0])
                for name, column in zip(FIELDS, cases.columns, strict=True)
            }
            if rigid[where[0]]:
                case["k"] = None
            for name, values in _extras(surrogate, case, include, std).items():
                if isinstance(values, dict):
                    for key, value in values.items():
                        extras[name][key][where] = value
                else:
                    extras[name][where] = values
    return extras

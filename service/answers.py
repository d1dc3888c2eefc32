"""Cases -> answers.  Nothing is computed that is not asked for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import blake2b
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from friction import Surrogate
from friction.nondim import FIELDS, find_faults
from service import API_VERSION, __version__
from service.limits import groups, limits
from service.schemas import CaseRequest, Groups, Limits
from service.shelf import LoadedTable

__all__ = ["DEFAULT_KEYS", "Batch", "CaseFault", "answer_batch", "answer_case", "case_etag", "signature"]

DEFAULT_KEYS = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")
# Array kernels may run in parallel, and numba's threading layer of last resort (no OpenMP, no TBB: small images)
# ends the process when two threads enter such kernels at once.  An evaluation takes milliseconds, so they queue.
_ARRAY_KERNELS = Lock()

INCLUDE_KEYS = {"groups": tuple(Groups.model_fields), "limits": tuple(Limits.model_fields)}


@dataclass(frozen=True)
class CaseFault:
    """Why a case of a batch has no result; ``field`` is None when the case as a whole is bad."""

    field: str | None
    reason: str


@dataclass
class Batch:
    """A decoded batch of ``size`` cases.

    Attributes
    ----------
    size : int
    columns : dict
        A float, or a float64 array of shape (size,), for each of the six inputs.  NaN at ``faults``.
        ``k`` is None when every case has rigid contact.
    rigid : NDArray[bool] or None
        Cases without k, when only some of them are; their entry in ``columns["k"]`` is 1.
    faults : dict
        Cases that were bad already as JSON, by index.
    """

    size: int
    columns: dict[str, Any]
    rigid: NDArray[np.bool_] | None = None
    faults: dict[int, CaseFault] = field(default_factory=dict)


def signature(table: LoadedTable) -> dict[str, object]:
    """What every reply carries: the table and the version of the interface."""
    return {"table": table.label, "api_version": API_VERSION}


def compute(surrogate: Surrogate, case: Mapping[str, Any], include: Sequence[str]) -> dict[str, Any]:
    """Evaluate scalars or columns; ``groups`` and ``limits`` are dicts of their own.

    Raises
    ------
    InputError
        A value is out of bounds.
    """
    answer = surrogate.evaluate(**case)
    values: dict[str, Any] = {
        "mu_macro": answer.mu_macro,
        "mu_ratio": answer.mu_ratio,
        "regime": answer.regime,
        "error_bound": answer.error_bound,
        "source": answer.source,
    }
    if "groups" in include:
        values["groups"] = groups(answer)
    if "limits" in include:
        values["limits"] = limits(surrogate, case, answer)
    return values


def answer_case(table: LoadedTable, case: CaseRequest, include: Sequence[str]) -> dict[str, Any]:
    """Answer one case, as plain Python values."""
    given = {name: getattr(case, name) for name in FIELDS}
    values = compute(table.surrogate, given, include)
    for name in include:
        values[name] = {key: float(values[name][key]) for key in INCLUDE_KEYS[name]}
    values.update(signature(table))
    return values


def case_etag(table: LoadedTable, case: CaseRequest, include: Sequence[str]) -> str:
    """Strong entity tag: an answer is a pure function of the table, the version and the query."""
    # Adding 0.0 turns -0.0 into 0.0: the same case, the same tag.
    numbers = [None if value is None else value + 0.0 for value in (getattr(case, name) for name in FIELDS)]
    text = repr((table.surrogate.checksum, table.surrogate.id, __version__, API_VERSION, numbers, tuple(include)))
    return f'"{blake2b(text.encode(), digest_size=16).hexdigest()}"'


def answer_batch(surrogate: Surrogate, batch: Batch, include: Sequence[str]) -> dict[str, Any]:
    """Answer every good case; a bad one gets None and an entry in ``batch.faults``.

    Returns
    -------
    dict
        Lists of length ``batch.size`` under DEFAULT_KEYS; dicts of such lists under the included names.
    """
    _find_value_faults(batch)
    good = np.ones(batch.size, dtype=np.bool_)
    good[list(batch.faults)] = False
    parts: list[tuple[NDArray[np.intp], dict[str, Any]]] = []
    for rigid in (False, True):
        chosen = good & _rigid_mask(batch, rigid)
        where = np.flatnonzero(chosen)
        if where.size:
            case = {name: _take(column, where, batch.size) for name, column in batch.columns.items()}
            if rigid:
                case["k"] = None
            with _ARRAY_KERNELS:
                parts.append((where, compute(surrogate, case, include)))
    answers: dict[str, Any] = {key: _gather(parts, (key,), batch.size) for key in DEFAULT_KEYS}
    for name in include:
        answers[name] = {key: _gather(parts, (name, key), batch.size) for key in INCLUDE_KEYS[name]}
    return answers


def _find_value_faults(batch: Batch) -> None:
    if batch.size == 0:
        return
    columns = {name: column for name, column in batch.columns.items() if column is not None}
    for fault in find_faults(columns):
        index = fault.index or 0
        if index not in batch.faults:  # one entry per case: its first fault
            batch.faults[index] = CaseFault(fault.field, fault.reason)


def _rigid_mask(batch: Batch, rigid: bool) -> NDArray[np.bool_]:
    if batch.rigid is not None:
        return batch.rigid if rigid else ~batch.rigid
    return np.full(batch.size, (batch.columns["k"] is None) == rigid)


def _take(column: Any, where: NDArray[np.intp], size: int) -> Any:
    if not isinstance(column, np.ndarray) or where.size == size:
        return column
    return column[where]


def _gather(parts: Sequence[tuple[NDArray[np.intp], dict[str, Any]]], path: Sequence[str], size: int) -> list[Any]:
    """Bring one column of the parts into the order of the batch, None where no part has a case."""
    out: NDArray[np.object_] | None = None
    for where, values in parts:
        value = values
        for step in path:
            value = value[step]
        column = np.broadcast_to(np.asarray(value), where.shape)
        if where.size == size:
            whole: list[Any] = column.tolist()
            return whole
        if out is None:
            out = np.full(size, None, dtype=object)
        out[where] = column.tolist()
    return [None] * size if out is None else list(out)

"""Many cases at once: one model of columns for every form of a body, answered slice by slice.

A form (``batch_forms/``) decodes a body to numbers, lists and arrays by name; :class:`CaseColumns`
checks them; :class:`Batch` evaluates slices, so that memory stays small and other threads run
between them; the form writes the slices.  A bad case spoils only itself.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.cases import Cases, by_name
from mumacro.kernel.arrays import Codes

from .included import Outputs, Plan, answer_columns
from .models.inputs import MAX_REASONS, Column
from .models.options import MODEL, BatchOptions, CaseColumns
from .problems import FieldFault, ProblemKind, RequestError, reason_of, refuse
from .reading import of_members
from .tables import LoadedTable, Tables

#: the bad field, or None for the case as a whole, and why
Reason = tuple[str | None, str]


class Body(NamedTuple):
    """What a form reads from a body."""

    #: inputs by name: a number, a list, or an array in which infinity is a rigid contact; options
    members: dict[str, Any]
    #: why cases could not be read, by their index; they have a NaN
    reasons: Mapping[int, Reason] = MappingProxyType({})
    rows: bool = False  # whether the cases came one by one


def too_large(max_batch: int) -> RequestError:
    """The error for a batch with more cases than the settings allow."""
    detail = (
        f"a batch may have up to {max_batch} cases, this one has more: split it, or stream it "
        "as NDJSON"
    )
    return RequestError(ProblemKind.BATCH_TOO_LARGE, detail, max_batch=max_batch)


def both(members: Mapping[str, Any], options: BatchOptions) -> dict[str, Any]:
    """What body and query say, each name once."""
    query = options.members
    if twice := [name for name in query if members.get(name) is not None]:
        reason = "is given in the query and in the body"
        refuse([FieldFault.of(name, reason, members[name]) for name in twice])
    return {**members, **query}


@dataclass
class Batch:
    """Cases, and how they are answered.  ``errors`` and ``n_errors`` grow while the slices are
    taken."""

    table: LoadedTable
    plan: Plan
    columns: dict[str, Any]  # numbers, and arrays (size,)
    size: int
    reasons: dict[int, Reason]
    listed: bool  # whether any input came as a list
    rows: bool
    errors: list[dict[str, Any]] = field(default_factory=list)
    n_errors: int = 0
    count: Callable[[LoadedTable, Codes], None] = lambda _table, _codes: None

    @classmethod
    def of(
        cls, body: Body, options: BatchOptions, tables: Tables, max_batch: int, **more: Any
    ) -> "Batch":
        """The batch of a body, with the options of body and query together."""
        lengths = {
            name: len(value)
            for name, value in body.members.items()
            if isinstance(value, (list, np.ndarray)) and name not in ("include", "k_range")
        }
        if any(length > max_batch for length in lengths.values()):
            raise too_large(max_batch)
        model = of_members(CaseColumns, both(body.members, options))
        if MODEL in (model.include or ()):
            raise InputError("include", MODEL, f"without {MODEL}, which is for one case")
        columns, reasons = model.columns, dict(body.reasons)
        # the first bad input of a case, in the order of the inputs, is told
        for name, column in columns.items():
            if isinstance(column, Column):
                columns[name] = column.values
                for i, reason in column.reasons.items():
                    reasons.setdefault(i, (name, reason))
        lengths = {name: len(x) for name, x in columns.items() if isinstance(x, np.ndarray)}
        size = next(iter(lengths.values()), 1)
        if wrong := [name for name, length in lengths.items() if length != size]:
            shown = ", ".join(f"{name}: {length}" for name, length in lengths.items())
            reason = f"lists must have one length; given {shown}"
            refuse([FieldFault.of(name, reason) for name in wrong])
        if not lengths and "v0" in columns:  # else it is refused below
            columns["v0"] = np.array([columns["v0"]])
        plan = Plan.of(model, columns)
        # relations between inputs are the same for all cases: an empty part shows whether they hold
        Cases.of(by_name(None, _part(columns, 0, 0), plan.kind), plan.kind)
        in_query = options.tolerance is not None
        table = tables.pick(model.tolerance, True if in_query else None)
        return cls(table, plan, columns, size, reasons, bool(lengths), body.rows, **more)

    def slices(self, step: int) -> Iterator[tuple[Outputs, Codes, list[str | None]]]:
        """Outputs by path, source codes and reasons of ``step`` cases after another.

        At least one slice, which is empty if there is no case.
        """
        for start in range(0, max(self.size, 1), step):
            stop = min(start + step, self.size)
            part = _part(self.columns, start, stop)
            outputs, codes = answer_columns(self.table.surrogate, part, self.plan)
            self.count(self.table, codes)
            yield outputs, codes, self._reasons(part, codes, start)

    def _reasons(self, part: Mapping[str, Any], codes: Codes, start: int) -> list[str | None]:
        texts: list[str | None] = [None] * codes.size
        bad = np.flatnonzero(codes < 0).tolist()
        if not bad:
            return texts
        cases = Cases.of(by_name(None, part, self.plan.kind), self.plan.kind)
        for index in bad:
            self.n_errors += 1
            texts[index] = "bad case"
            if len(self.errors) < MAX_REASONS:
                name, reason = self.reasons.get(start + index) or _reason(cases, index)
                self.errors.append({"index": start + index, "field": name, "reason": reason})
                texts[index] = f"{name or 'case'}: {reason}"
        return texts

    @property
    def end(self) -> dict[str, Any]:
        """What is said of the batch as a whole, after all slices."""
        return {"errors": self.errors, "n_errors": self.n_errors, **self.table.signature}


def _part(columns: Mapping[str, Any], start: int, stop: int) -> dict[str, Any]:
    """The columns of the cases from ``start`` to ``stop``."""
    return {name: x[start:stop] if isinstance(x, np.ndarray) else x for name, x in columns.items()}


def _reason(cases: Cases, index: int) -> Reason:
    error = cases.reason(index)
    return error.field, reason_of(error)


class Form(NamedTuple):
    """One form of a batch, by its media type."""

    media_type: str
    aliases: tuple[str, ...]
    #: a body with so many cases at most, and the options of the query; raises RequestError
    read: Callable[[bytearray, int, BatchOptions], Body]
    #: the answer, piece by piece
    write: Callable[[Batch], Iterator[bytes]]
    body: dict[str, Any]  # described
    answer: dict[str, Any]
    streams: bool = False


def text_form(description: str, **more: Any) -> dict[str, Any]:
    """The description of a body or an answer that is no JSON."""
    return {"schema": {"type": "string", "description": description, **more}}

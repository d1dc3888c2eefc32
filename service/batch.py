"""Many cases at once: one model of columns for columns and rows, answered slice by slice.

``forms.py`` reads a body as values, lists and arrays by name; :class:`CaseColumns` checks them;
:class:`Batch` evaluates slices, so that memory stays small and other threads run between them;
``forms.py`` writes the slices.  A bad case spoils only itself.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.cases import Cases, by_name
from mumacro.kernel.arrays import Codes

from .forms import SLICE, Body, Reason, too_large, write_columns, write_rows
from .included import Outputs, Plan, answer_columns
from .models.inputs import MAX_REASONS, Column
from .models.options import MODEL, BatchOptions, CaseColumns
from .problems import FieldFault, reason_of, refuse
from .reading import dump, of_members
from .tables import LoadedTable, Tables


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
        return cls(table, plan, columns, size, reasons, body.rows, **more)

    def write(self) -> Iterator[bytes]:
        """The answer as JSON, piece by piece, in the form of the body."""
        yield from (write_rows if self.rows else write_columns)(self._slices())
        end = {"errors": self.errors, "n_errors": self.n_errors, **self.table.signature}
        yield b"," + dump(end)[1:]

    def _slices(self) -> Iterator[tuple[Outputs, Codes]]:
        """Outputs by path and source codes, slice by slice; one empty slice if there is no case."""
        for start in range(0, max(self.size, 1), SLICE):
            part = _part(self.columns, start, min(start + SLICE, self.size))
            outputs, codes = answer_columns(self.table.surrogate, part, self.plan)
            self.count(self.table, codes)
            self._tell(part, codes, start)
            yield outputs, codes

    def _tell(self, part: Mapping[str, Any], codes: Codes, start: int) -> None:
        """Add the bad cases of a slice to the errors."""
        bad = np.flatnonzero(codes < 0).tolist()
        if not bad:
            return
        cases = Cases.of(by_name(None, part, self.plan.kind), self.plan.kind)
        self.n_errors += len(bad)
        for index in bad[: MAX_REASONS - len(self.errors)]:
            name, reason = self.reasons.get(start + index) or _reason(cases, index)
            self.errors.append({"index": start + index, "field": name, "reason": reason})


def _part(columns: Mapping[str, Any], start: int, stop: int) -> dict[str, Any]:
    """The columns of the cases from ``start`` to ``stop``."""
    return {name: x[start:stop] if isinstance(x, np.ndarray) else x for name, x in columns.items()}


def _reason(cases: Cases, index: int) -> Reason:
    error = cases.reason(index)
    return error.field, reason_of(error)

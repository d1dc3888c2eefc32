"""Answer many cases at once: one model for columns and rows, evaluated slice by slice.

``forms.py`` reads a body as numbers, lists and arrays by name. :class:`CaseColumns` checks them,
and they become the library's ``Cases`` once. :class:`Batch` evaluates slices of them, so that
memory stays small and other threads can run between two slices; ``forms.py`` writes the slices.  A
bad case affects only itself.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.cases import Cases, named, other_amplitude
from mumacro.kernel.arrays import Codes
from mumacro.outputs.answer import Answer
from mumacro.outputs.entry import Output
from mumacro.outputs.evaluation import chosen, cost
from mumacro.results import Note, add

from .bodies import of_members
from .forms import SLICE, Body, Reason, too_large, write_columns, write_rows
from .json_text import dump
from .models.inputs import MAX_REASONS, Column
from .models.options import BatchOptions, CaseColumns
from .problems import FieldFault, reason_of, refuse
from .tables import LoadedTable, Tables


def body_and_query(members: Mapping[str, Any], options: BatchOptions) -> dict[str, Any]:
    """Return the members of body and query together; each name may occur once."""
    query = options.members
    if repeats := [name for name in query if members.get(name) is not None]:
        reason = "is given in the query and in the body"
        refuse([FieldFault.of(name, reason, members[name]) for name in repeats])
    return {**members, **query}


@dataclass
class Batch:
    """Hold cases and the options of their answers.  ``errors``, ``n_errors`` and ``notes`` grow as
    the slices are evaluated."""

    table: LoadedTable
    cases: Cases
    outputs: tuple[Output, ...]
    reasons: dict[int, Reason]
    rows: bool
    errors: list[dict[str, Any]] = field(default_factory=list)
    n_errors: int = 0
    notes: list[Note] = field(default_factory=list)
    count: Callable[[LoadedTable, Codes], None] = lambda _table, _codes: None

    @classmethod
    def of(
        cls, body: Body, options: BatchOptions, tables: Tables, max_batch: int, **fields: Any
    ) -> "Batch":
        """Return the batch of a body, with the options of body and query together."""
        lengths = {
            name: len(value)
            for name, value in body.members.items()
            if isinstance(value, (list, np.ndarray)) and name != "include"
        }
        if any(length > max_batch for length in lengths.values()):
            raise too_large(max_batch)
        model = of_members(CaseColumns, body_and_query(body.members, options))
        if beside := model.beside:
            raise InputError("include", beside[0], f"without {beside[0]}, which is for one case")
        values, reasons = model.columns, dict(body.reasons)
        other = model.kind.other_amplitude
        if isinstance(column := body.members.get(other), (list, np.ndarray)):
            if filled := [x for x in column if x is not None]:
                raise other_amplitude(other, filled[0], model.kind)
            del values[other]  # a list of nulls
        # only the first bad input of a case is reported, in the order of the inputs
        for name, column in [*values.items()]:
            if isinstance(column, Column):
                values[name] = column.numbers
                for i, reason in column.reasons.items():
                    reasons.setdefault(i, Reason(name, reason))
        lengths = {name: len(x) for name, x in values.items() if isinstance(x, np.ndarray)}
        if len({*lengths.values()}) > 1:
            size = next(iter(lengths.values()))
            text = ", ".join(f"{name}: {length}" for name, length in lengths.items())
            reason = f"lists must have one length; given {text}"
            wrong = [name for name, length in lengths.items() if length != size]
            refuse([FieldFault.of(name, reason) for name in wrong])
        if not lengths and "v0" in values:  # otherwise it is refused below
            values["v0"] = np.array([values["v0"]])
        cases = Cases.of(named(None, values))
        outputs = chosen(model.outputs, cases)
        in_query = options.tolerance is not None
        table = tables.pick(model.tolerance, True if in_query else None)
        return cls(table, cases, outputs, reasons, body.rows, **fields)

    @property
    def cost(self) -> float:
        """Return the cost of all cases together, see :mod:`service.admission`."""
        return self.cases.size * cost(self.outputs, self.cases)

    def write(self) -> Iterator[bytes]:
        """Yield the answer as JSON, piece by piece, in the form of the body."""
        yield from (write_rows if self.rows else write_columns)(self._answers())
        end: dict[str, Any] = {"errors": self.errors, "n_errors": self.n_errors}
        if self.notes:
            end["remarks"] = [note.as_remark for note in self.notes]
        yield b"," + dump(end | self.table.signature)[1:]

    def _answers(self) -> Iterator[Answer[Any]]:
        """Yield the answers, slice by slice; yield one empty slice if there is no case."""
        for start in range(0, max(self.cases.size, 1), SLICE):
            part = self.cases.part(slice(start, start + SLICE))
            answer = self.table.surrogate.answer(part, self.outputs)
            self.count(self.table, answer.source_code)
            self._tell(answer.source_code, start)
            for note in answer.notes:
                add(self.notes, note)
            yield answer

    def _tell(self, codes: Codes, start: int) -> None:
        """Add the bad cases of a slice to the errors."""
        bad = np.flatnonzero(codes < 0).tolist()
        self.n_errors += len(bad)
        for index in (start + i for i in bad[: MAX_REASONS - len(self.errors)]):
            name, reason = self.reasons.get(index) or _reason(self.cases, index)
            self.errors.append({"index": index, "field": name, "reason": reason})


def _reason(cases: Cases, index: int) -> Reason:
    error = cases.reason(index)
    return Reason(error.field, reason_of(error))

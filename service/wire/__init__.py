"""Wire forms of batches: text -> columns, answers -> text.  One file each.

Answers are evaluated and written in slices, so that memory stays small and other threads run
between them.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from mumacro.inputs.kind import Kind as ContactKind
from mumacro.kernel.arrays import Codes

from ..answers import Wanted, answer_columns
from ..case import MAX_ERRORS, Columns, columns_of
from ..problems import FieldFault
from ..tables import LoadedTable


def check_names(names: Sequence[str], kind: ContactKind, more: Mapping[str, str]) -> None:
    """Refuse columns that such cases lack, do not have, or have twice; ``more`` are other reasons,
    by name."""
    twice = {name: "is given more than once" for name in names if names.count(name) > 1}
    faults = [FieldFault.of(name, reason) for name, reason in {**more, **twice}.items()]
    columns_of({name: [] for name in names}, 0, faults=faults, kind=kind)


@dataclass
class Batch:
    """Cases, and how they are answered.  ``errors`` and ``n_errors`` grow while the slices are
    taken."""

    table: LoadedTable
    columns: Columns
    wanted: Wanted
    errors: list[dict[str, Any]] = field(default_factory=list)
    n_errors: int = 0
    count: Callable[[LoadedTable, Codes], None] = lambda _table, _source: None

    def slices(self, step: int) -> Iterator[tuple[dict[str, Any], Codes, list[str | None]]]:
        """Columns by path, source codes and faults of ``step`` cases after another; a bad case has
        NaN and -1.

        At least one slice, which is empty if there is no case.
        """
        size = self.columns.size
        for start in range(0, max(size, 1), step):
            n = min(step, size - start)
            six = self.columns.part(start, start + n)
            found, source = answer_columns(self.table.surrogate, six, n, self.wanted)
            self.count(self.table, source)
            faults: list[str | None] = [None] * n
            for index in np.flatnonzero(source < 0).tolist():
                self.n_errors += 1
                faults[index] = "bad case"
                if len(self.errors) < MAX_ERRORS:
                    name, reason = self.columns.reason(start + index)
                    self.errors.append({"index": start + index, "field": name, "reason": reason})
                    faults[index] = f"{name or 'case'}: {reason}"
            yield found, source, faults

    @property
    def end(self) -> dict[str, Any]:
        """What is said of the batch as a whole, after all slices."""
        return {"errors": self.errors, "n_errors": self.n_errors, **self.table.signature}


class Form(NamedTuple):
    """One wire form."""

    media_type: str
    aliases: tuple[str, ...]
    #: the cases of a body with so many cases at most, and its options beside those of the query;
    #: raises RequestError
    read: Callable[[bytearray, int, Mapping[str, Any]], tuple[Columns, dict[str, Any]]]
    #: the answer, piece by piece
    write: Callable[[Batch], Iterator[bytes]]
    body: dict[str, Any]
    answer: dict[str, Any]
    streams: bool = False


def text_form(description: str, **more: Any) -> dict[str, Any]:
    """The description of a body or an answer that is no JSON."""
    return {"schema": {"type": "string", "description": description, **more}}

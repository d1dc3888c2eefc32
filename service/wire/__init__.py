"""Wire forms of batches: text -> columns, answers -> text.  One file each; :data:`FORMS` has all that are installed.

Answers are evaluated and written in slices, so that memory stays small and other threads run between them.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np

from ..answers import Codes, Part, answer_columns, parts_of
from ..case import MAX_ERRORS, Columns
from ..tables import LoadedTable

__all__ = ["FORMS", "Batch", "Form", "forms"]

#: name of a column -> what it holds, for a slice of the cases
Found = Mapping[str, Any]


@dataclass
class Batch:
    """Cases, and how they are answered.  ``errors`` and ``n_errors`` grow while the slices are taken."""

    table: LoadedTable
    columns: Columns
    include: Sequence[str] = ()
    std: Mapping[str, float] = field(default_factory=dict)
    errors: list[dict[str, Any]] = field(default_factory=list)
    n_errors: int = 0
    count: Callable[[LoadedTable, Codes], None] = lambda _table, _source: None

    @property
    def parts(self) -> list[Part]:
        """The columns of the answers."""
        return parts_of(self.include, self.columns.asked)

    def slices(self, step: int) -> Iterator[tuple[int, Found, Codes]]:
        """First case, columns by path, and source codes of ``step`` cases after another; a bad case has NaN and -1.

        At least one slice, which is empty if there is no case.
        """
        size = self.columns.size
        for start in range(0, max(size, 1), step):
            stop = min(start + step, size)
            six = self.columns.part(start, stop)
            found, source = answer_columns(
                self.table.surrogate, six, stop - start, self.include, self.std, self.columns.asked
            )
            self.count(self.table, source)
            for index in np.flatnonzero(source < 0).tolist():
                self.n_errors += 1
                if len(self.errors) < MAX_ERRORS:
                    name, reason = self.columns.reason(start + index)
                    self.errors.append({"index": start + index, "field": name, "reason": reason})
            yield start, found, source

    def texts(self, start: int, source: Codes) -> list[str | None]:
        """What is wrong with each case of the slice that was taken last; for forms with a column of errors."""
        if not self.n_errors:
            return [None] * source.size
        told = {error["index"] - start: f"{error['field'] or 'case'}: {error['reason']}" for error in self.errors}
        return [told.get(i, "bad case") if code < 0 else None for i, code in enumerate(source.tolist())]

    @property
    def end(self) -> dict[str, Any]:
        """What is said of the batch as a whole, after all slices."""
        return {"errors": self.errors, "n_errors": self.n_errors, **self.table.signature}


class Form(NamedTuple):
    """One wire form."""

    media_type: str
    aliases: tuple[str, ...]
    #: the cases of a body with so many cases at most, and its options beside those of the query; raises RequestError
    read: Callable[[bytearray, int, Mapping[str, Any]], tuple[Columns, dict[str, Any]]]
    #: the answer, piece by piece
    write: Callable[[Batch], Iterator[bytes]]
    body: dict[str, Any]
    answer: dict[str, Any]
    streams: bool = False


FORMS: dict[str, Form] = {}


def forms() -> dict[str, Form]:
    """All forms by media type; loaded at the first call, Arrow only where pyarrow is installed."""
    if not FORMS:
        from . import csv, json

        made = [*json.FORMS, csv.FORM]
        if find_spec("pyarrow"):
            from . import arrow

            made.append(arrow.FORM)
        FORMS.update({form.media_type: form for form in made})
    return FORMS

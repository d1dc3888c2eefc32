"""NDJSON: every line is answered with a line as soon as it arrives.

Lines in the usual form are read, evaluated and written together, in memory that is used again.  Every other line, and
every line with a bad case, is answered alone, like a batch.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import groupby, pairwise
from operator import itemgetter
from typing import Any, ClassVar

import numpy as np
import orjson

from .. import numbers
from ..errors import RequestError, problem_of
from ..evaluation import Answers, Batch, answer_batch
from ..tables import LoadedTable, signature
from . import register
from .columns import write_columns
from .rows import objects, write_rows

__all__ = ["LineAnswers", "Spans"]

#: (start, end, number) of each line in a text: the end is before the newline, numbers are from 1
Spans = Sequence[tuple[int, int, int]]

_CASES = 8192  # cases of blocks that are evaluated together
_ONE_OF = ("BatchColumns", "Case")


class Lines:
    """The format.  The endpoint answers its lines with :class:`LineAnswers`."""

    name, media_type, streams = "lines", "application/x-ndjson", True
    aliases: tuple[str, ...] = ("application/ndjson", "application/jsonl", "application/x-jsonlines")
    body: ClassVar[dict[str, Any]] = {
        "schema": {
            "anyOf": [
                *({"$ref": f"#/components/schemas/{name}"} for name in _ONE_OF),
                {"type": "array", "items": {"$ref": "#/components/schemas/Case"}},
            ],
            "description": "One of these per line",
        },
        "example": {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 20690.0, "v0": [0.01, 0.1]},
    }
    answer: ClassVar[dict[str, Any]] = {
        "schema": {
            "anyOf": [
                {"$ref": f"#/components/schemas/{name}"}
                for name in ("ColumnsAnswer", "RowsAnswer", "CaseAnswer", "Problem")
            ],
            "description": "One of these per line, in the order of the lines",
        }
    }

    def matches(self, text: memoryview) -> bool:
        """Always."""
        del text
        return True

    def read(self, text: bytearray, max_batch: int) -> tuple[Batch, dict[str, Any]]:
        """Lines are no batch."""
        raise NotImplementedError

    def write(self, answers: Answers, label: Mapping[str, Any]) -> Iterator[bytes]:
        """Lines are no batch."""
        raise NotImplementedError


class LineAnswers:
    """Answers the lines of one stream, in one thread at a time.

    Parameters
    ----------
    table : LoadedTable
        The table for lines without a ``tolerance``.
    include, std
        The options of the query.
    max_batch : int
        Cases of one line.
    answer : callable
        Answers one text as a batch of its own.
    count : callable
        Counts answers.
    path : str
        That of the request, for the problems of single lines.
    """

    def __init__(
        self,
        table: LoadedTable,
        include: Sequence[str],
        std: Mapping[str, float],
        max_batch: int,
        answer: Callable[[bytearray], Iterator[bytes]],
        count: Callable[[LoadedTable, Answers], None],
        path: str,
    ) -> None:
        self._table = table
        self._include, self._std = include, std
        self._answer = answer
        self._count = count
        self._path = path
        self._room = min(_CASES, max_batch)
        self._columns: Any = None

    def pieces(self, text: bytearray, spans: Spans) -> Iterator[bytes]:
        """The answers to some lines of ``text``, which has one byte after the last line."""
        lines = np.array([span[:2] for span in spans], dtype=np.int64)
        if self._columns is None:
            self._columns = np.empty((6, self._room))
        done = 0
        while done < len(spans):
            seen = np.frombuffer(text, dtype=np.uint8)
            edges, forms = numbers.read_lines(seen, lines[done : done + self._room], self._columns)
            together = self._together(edges, forms) if forms else None
            if together is not None:
                yield from together
            else:
                for start, end, number in spans[done : done + max(len(forms), 1)]:
                    yield from self._line(text[start:end], number)
            done += max(len(forms), 1)

    def _together(self, edges: list[int], forms: list[int]) -> Iterator[bytes] | None:
        """The answers to the lines that were read; None if one of them has a bad case."""
        batch = Batch(edges[-1], [column[: edges[-1]] for column in self._columns])
        answers = answer_batch(self._table, batch, self._include, self._std)
        if answers.n_bad:
            return None
        self._count(self._table, answers)
        return self._written(answers, edges, forms)

    def _written(self, answers: Answers, edges: list[int], forms: list[int]) -> Iterator[bytes]:
        label = signature(self._table)
        for form, group in groupby(zip(forms, pairwise(edges), strict=True), itemgetter(0)):
            parts = [part for _, part in group]
            if form == numbers.CASE:
                yield b"\n".join(map(orjson.dumps, objects(answers, parts[0][0], parts[-1][1], label))) + b"\n"
                continue
            write = write_columns if form == numbers.BLOCK else write_rows
            for start, stop in parts:
                yield from write(answers.part(start, stop), label)
                yield b"\n"

    def _line(self, line: bytearray, number: int) -> Iterator[bytes]:
        try:
            answered = list(self._answer(line))
        except RequestError as error:
            yield bytes(problem_of(error, f"{self._path}#line={number}").body) + b"\n"
        else:
            yield b"".join(answered) + b"\n"


register(Lines())

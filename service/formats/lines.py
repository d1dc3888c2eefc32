"""NDJSON: every line is answered with a line as soon as it arrives.

Large streams mostly hold blocks: lines with an object of lists.  Several blocks are read, evaluated and written
together, in memory that is used again.  Lines of one case each are answered together too.  Every other line, and every
line with a bad case, is answered alone, like a batch.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
import orjson

from .. import numbers
from ..errors import RequestError, problem_of
from ..evaluation import Answers, Batch, answer_batch
from ..tables import LoadedTable, signature
from . import register
from .columns import REGIMES_OF, SOURCES_OF, dump, numbers_ready
from .rows import decode_rows, objects

__all__ = ["LineAnswers", "Spans"]

#: (start, end, number) of each line in a text: the end is before the newline, numbers are from 1
Spans = Sequence[tuple[int, int, int]]

_CASES = 8192  # cases of blocks that are evaluated together
_SHORT_LINE = 1024  # bytes of one case on a line of its own
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
        Answers one text as a batch of its own: (text, media type) -> pieces.
    count : callable
        Counts answers.
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
        self._end = dump({"errors": [], "n_errors": 0, **signature(table)})[1:] + b"\n"

    def pieces(self, text: bytearray, spans: Spans) -> Iterator[bytes]:
        """The answers to some lines of ``text``, which has one byte after the last line."""
        together = self._cases(text, spans) if len(spans) > 1 else None
        if together is not None:
            yield from together
            return
        seen = np.frombuffer(text, dtype=np.uint8)
        edges = [0]  # index of the first case of each block that is read and not yet answered
        for index, (start, end, number) in enumerate(spans):
            size = self._read(seen, start, end, edges[-1])
            if size < 0 and len(edges) > 1:
                yield from self._blocks(text, spans, index, edges)
                edges = [0]
                size = self._read(seen, start, end, 0)
            if size > 0:
                edges.append(edges[-1] + size)
                continue
            yield from self._blocks(text, spans, index, edges)
            edges = [0]
            yield from self._line(text[start:end], number)
        yield from self._blocks(text, spans, len(spans), edges)

    def _read(self, seen: Any, start: int, end: int, first: int) -> int:
        if self._include or not numbers_ready():
            return 0
        if self._columns is None:
            self._columns = np.empty((6, self._room))
        while end > start and seen[end - 1] in (13, 32, 9):
            end -= 1
        return numbers.read_columns(seen, start, end, self._columns, first)

    def _blocks(self, text: bytearray, spans: Spans, stop: int, edges: list[int]) -> Iterator[bytes]:
        """Answer the blocks that were read from the lines before ``stop``."""
        size = edges[-1]
        if size == 0:
            return
        batch = Batch(size, [column[:size] for column in self._columns])
        answers = answer_batch(self._table, batch, (), {})
        if answers.n_bad:
            for start, end, number in spans[stop - len(edges) + 1 : stop]:
                yield from self._line(text[start:end], number)
            return
        self._count(self._table, answers)
        regimes, sources = REGIMES_OF[answers.source].tolist(), SOURCES_OF[answers.source].tolist()
        for start, end in pairwise(edges):
            part = slice(start, end)
            columns = {
                "mu_macro": answers.mu_macro[part], "mu_ratio": answers.mu_ratio[part], "regime": regimes[part],
                "error_bound": answers.error_bound[part], "source": sources[part],
            }  # fmt: skip
            yield orjson.dumps(columns, option=orjson.OPT_SERIALIZE_NUMPY)[:-1] + b"," + self._end

    def _line(self, line: bytearray, number: int) -> Iterator[bytes]:
        try:
            answered = list(self._answer(line))
        except RequestError as error:
            yield bytes(problem_of(error, f"{self._path}#line={number}").body) + b"\n"
        else:
            yield b"".join(answered) + b"\n"

    def _cases(self, text: bytearray, spans: Spans) -> Iterator[bytes] | None:
        """Answer lines of one case each together; None for other lines."""
        if any(end - start > _SHORT_LINE for start, end, _ in spans):
            return None
        lines = [line for line in (text[start:end].strip() for start, end, _ in spans) if line]
        if not all(line.startswith(b"{") and line.endswith(b"}") and line.count(b"{") == 1 for line in lines):
            return None
        batch = decode_rows(bytearray(b"[" + b",".join(lines) + b"]"))
        if batch is None or batch.size != len(lines) or not lines:
            return None
        answers = answer_batch(self._table, batch, self._include, self._std)
        if answers.n_bad:
            return None
        self._count(self._table, answers)
        made = objects(answers, 0, answers.size, signature(self._table))
        return iter([b"\n".join(map(orjson.dumps, made)) + b"\n"])


register(Lines())

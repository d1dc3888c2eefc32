"""Streams of lines: NDJSON in, NDJSON out, each line answered as soon as it is there.

Most lines of a stream that is worth one are blocks: an object of lists.  Those are read, evaluated and written some at
a time, in memory that is used again and again.  Every other line, and every line with a bad case in it, is answered by
itself, as a batch of its own would be.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from service.answers import Answers, answer_cases, answer_columns, read_only, signature
from service.codecs import BlockWriter, lines_text, read_batch, terminated
from service.compiled.digits import PADDING, Bytes
from service.compiled.scan import HARD_ROOM, read_block
from service.errors import RequestError, problem_of
from service.intake import Options, merged_options
from service.middleware import BATCH_PATH
from service.shelf import LoadedTable, Shelf

__all__ = ["Blocks", "LineAnswers", "Lines", "Spans"]

#: where lines begin and end, the end without its newline
Spans = Sequence[tuple[int, int]]

_ROOM = 512 * 1024  # bytes of lines; more for a longer one
_CASES = 4096  # cases of blocks that are evaluated together
_SHORT_LINE = 1024  # bytes of one case on a line of its own


class Lines:
    """What has come of a stream and is not answered yet: lines behind one another, 0 bytes behind the last."""

    def __init__(self, room: int = _ROOM) -> None:
        self._begin = self._filled = 0
        self._memory, self.text = self._made(room)

    @staticmethod
    def _made(room: int) -> tuple[bytearray, Bytes]:
        memory = bytearray(room + PADDING)
        return memory, np.frombuffer(memory, dtype=np.uint8)

    def put(self, piece: bytes) -> None:
        """Add what has come.  What :meth:`take` gave must not be looked at any more."""
        end = self._filled + len(piece)
        if end + PADDING > len(self._memory):
            rest = self._memory[self._begin : self._filled]
            end = len(rest) + len(piece)
            if end + PADDING > len(self._memory):
                self._memory, self.text = self._made(2 * end)
            self._memory[: len(rest)] = rest
            self._begin, self._filled = 0, len(rest)
        self._memory[self._filled : end] = piece
        self._memory[end : end + PADDING] = bytes(PADDING)
        self._filled = end

    def take(self, most: int, *, last: bool = False) -> list[tuple[int, int]]:
        """The next whole lines, of ``most`` bytes or a little more in all; at the end also what has no newline."""
        memory, first, filled = self._memory, self._begin, self._filled
        spans = []
        while self._begin - first < most and (end := memory.find(b"\n", self._begin, filled)) >= 0:
            spans.append((self._begin, end))
            self._begin = end + 1
        if last and not spans and self._begin < filled:
            spans.append((self._begin, filled))
            self._begin = filled
        return spans

    def line(self, span: tuple[int, int]) -> bytearray:
        """A copy of one line."""
        return self._memory[slice(*span)]

    @property
    def rest(self) -> int:
        """How many bytes have not been taken."""
        return self._filled - self._begin


class Blocks:
    """Reads, evaluates and writes plain blocks of columns, some at a time, in memory that is used again.

    For one thread at a time, up to ``room`` cases together.
    """

    def __init__(self, room: int) -> None:
        self._words = np.empty((6, min(_CASES, room)), dtype=np.uint64)
        self._columns = [read_only(row.view(np.float64)) for row in self._words]
        self._hard = np.empty((HARD_ROOM, 4), dtype=np.int64)
        self._writer: tuple[LoadedTable, BlockWriter] | None = None

    def read(self, text: Bytes, start: int, end: int, first: int = 0) -> int:
        """Read a block; see :func:`read_block`."""
        return read_block(text, start, end, self._words, first, self._hard)

    def answer(self, table: LoadedTable, size: int) -> Answers | None:
        """Answer what was read; None where a case is bad."""
        answers = answer_columns(table, size, [column[:size] for column in self._columns])
        return None if answers.n_bad else answers

    def text(self, table: LoadedTable, answers: Answers, edges: Sequence[int]) -> bytes:
        """Each block's answer on a line; see :class:`BlockWriter`."""
        if self._writer is None or self._writer[0] is not table:
            self._writer = table, BlockWriter(signature(table))
        return self._writer[1].text(answers, edges)


class LineAnswers:
    """Answers the lines of one stream.

    ``answer`` answers one text that ends in 0 bytes, ``count`` counts what is answered without it.
    """

    def __init__(
        self,
        shelf: Shelf,
        query: Options,
        max_batch: int,
        answer: Callable[[Bytes], Iterator[bytes]],
        count: Callable[[LoadedTable, Answers, int], None],
    ) -> None:
        self._shelf = shelf
        self._options, self._place = merged_options(query, {})
        self._answer = answer
        self._count = count
        self._plain = Blocks(max_batch)
        shelf.pick(self._options.tolerance, self._place)  # or an error, before the first line

    def pieces(self, lines: Lines, spans: Spans, number: int) -> Iterator[bytes]:
        """The answers to some lines; ``number`` is how many came before."""
        cases = self._cases(lines, spans, number) if len(spans) > 1 else None
        if cases is not None:
            yield from cases
            return
        # Where the lines that are read and not yet answered begin among the cases, and where the last one ends.
        blocks = [0]
        for index, (start, end) in enumerate(spans):
            size = self._read(lines.text, start, end, blocks[-1])
            if size < 0 and len(blocks) > 1:
                yield from self._blocks(lines, spans, index, number, blocks)
                blocks = [0]
                size = self._read(lines.text, start, end, 0)
            if size > 0:
                blocks.append(blocks[-1] + size)
                continue
            yield from self._blocks(lines, spans, index, number, blocks)
            blocks = [0]
            yield from self._line(lines.line((start, end)), number + index + 1)
        yield from self._blocks(lines, spans, len(spans), number, blocks)

    def _read(self, text: Bytes, start: int, end: int, first: int) -> int:
        if self._options.include:
            return 0
        return self._plain.read(text, start, end, first)

    def _blocks(self, lines: Lines, spans: Spans, stop: int, number: int, blocks: list[int]) -> Iterator[bytes]:
        """Answer the blocks that were read from the lines before ``stop``."""
        size = blocks[-1]
        if size == 0:
            return
        table = self._shelf.pick(self._options.tolerance, self._place)
        answers = self._plain.answer(table, size)
        if answers is None:
            for index in range(stop - len(blocks) + 1, stop):
                yield from self._line(lines.line(spans[index]), number + index + 1)
            return
        self._count(table, answers, 0)
        yield self._plain.text(table, answers, blocks)

    def _line(self, line: bytearray, number: int) -> Iterator[bytes]:
        if not line or line.isspace():
            return
        try:
            answered = self._answer(terminated(line))
        except RequestError as error:
            yield bytes(problem_of(error, f"{BATCH_PATH}#line={number}").body)
        else:
            yield from answered
        yield b"\n"

    def _cases(self, lines: Lines, spans: Spans, number: int) -> Iterator[bytes] | None:
        """Answer lines of one case each all at once; None where they are anything else."""
        if any(end - start > _SHORT_LINE for start, end in spans):
            return None
        texts = [lines.line(span) for span in spans]
        for text in texts:
            if text[:1] != b"{" or text.rstrip()[-1:] != b"}" or text.count(b"{") != 1:
                return None
        try:
            cases, _ = read_batch(terminated(bytearray(b"[%b]" % b",".join(texts))), len(texts))
            table = self._shelf.pick(self._options.tolerance, self._place)
        except RequestError:
            return None
        answers = answer_cases(table, cases, self._options.include, self._options.std)
        if answers.size != len(texts):
            return None
        self._count(table, answers, 0)  # whether a case is bad, and why, is found out line by line
        return self._mended(lines_text(answers, signature(table)), answers, texts, number)

    def _mended(
        self, written: Iterator[tuple[int, bytes]], answers: Answers, texts: list[bytearray], number: int
    ) -> Iterator[bytes]:
        """What is written, with what a line by itself is answered in place of every null."""
        for start, text in written:
            pieces = text.splitlines(keepends=True)
            odd = np.flatnonzero(answers.flaws[start : start + len(pieces)]).tolist()
            for index in odd:
                line = start + index
                pieces[index] = b"".join(self._line(texts[line], number + line + 1))
            yield b"".join(pieces) if odd else text

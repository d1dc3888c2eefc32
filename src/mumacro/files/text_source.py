"""Files of tables as text, in blocks of rows: plain lines go through Arrow's reader of CSV, which
is many times as fast; blocks with quotes or faults are read row by row."""

import csv
import io
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv

from mumacro.files.errors import FilesError
from mumacro.inputs.decoding import Piece, Text, TextError
from mumacro.inputs.headings import find_heads
from mumacro.inputs.signs import Cell, Signs
from mumacro.inputs.text_tables import (
    BLANKS,
    COMMENT,
    ColumnNames,
    Dialect,
    Record,
    begin,
    is_row,
    may_be_head,
    records,
    source_of,
)
from mumacro.inputs.units import split_unit

# rows that are searched for the decimal sign: at a time, and in all, before the first block
_AT_ONCE, _LOOKED_AT = 2_000, 60_000
_EXCERPT = 500  # characters that are kept of a row that is refused


class Block(NamedTuple):
    """Some rows in order; ``share`` is how much of the file is read after them.

    A row that could not be read is one of nulls; ``unreadable`` has its index, its text and the
    fault.  ``texts`` are the rows as they came in, where they are text: lines, or lists of cells.
    ``lines`` are their lines in the file, or their numbers where it has none.
    """

    batch: pa.RecordBatch
    share: float
    lines: Sequence[int]
    texts: Sequence[Any] = ()
    unreadable: Sequence[tuple[int, str, str]] = ()
    signs: Signs | None = None  #: of numbers as text


def excerpt(text: str) -> str:
    """A row that is refused, of bounded length."""
    return text if len(text) <= _EXCERPT else text[:_EXCERPT] + "…"


class TextTable:
    """One file: how it is written, and its rows.

    ``as_lines`` are its rows as texts, else they are cells; FilesError says why it is no table.
    """

    def __init__(self, path: Path, column_names: ColumnNames, dialect: Dialect) -> None:
        self.path, self.column_names, self.dialect = path, column_names, dialect
        try:
            pieces, self.dialect = source_of(path, dialect)
            text = Text(pieces, self.dialect.encoding)
            self.layout, lines = begin(text, column_names, self.dialect)
            self.signs = self.dialect.signs(self.layout)
            self._find_signs(lines)
        except TextError as error:
            raise FilesError(f"{path}: {error}") from None

    @property
    def sep(self) -> str:
        """The separator of rows as text."""
        return "\t" if self.layout.sep == BLANKS else self.layout.sep

    @property
    def decimal(self) -> str:
        """The decimal sign of rows as text."""
        return self.signs.decimal or "."

    @property
    def read_as(self) -> str:
        """How the file is read; empty where it is plain CSV."""
        return self.layout.described(self.signs)

    def _find_signs(self, lines: Iterator[tuple[int, str]]) -> None:
        """Find the decimal sign in the first rows that tell it."""
        places, _ = find_heads(self.layout.heads, self.column_names.like)
        rows = islice(records(lines, self.layout, self.column_names), _LOOKED_AT)
        while block := [*islice(rows, _AT_ONCE)]:
            self.signs.see(
                Cell(row.line, name, row.cells[i])
                for row in block
                if row.fault is None
                for name, (i, _) in places.items()
            )
            if self.signs.decimal:
                break

    def _find_signs_in(self, block: Block) -> None:
        """Find the decimal sign in a block, where all numbers before it have none."""
        names = [split_unit(head)[0] for head in block.batch.schema.names]
        for name, column in zip(names, block.batch.columns, strict=True):
            if name in self.column_names.like:
                has_sign = pc.match_substring_regex(column, "[.,]")
                if pc.any(has_sign).as_py():
                    self.signs.see(
                        Cell(block.lines[i], name, column[i].as_py())
                        for i in np.flatnonzero(pc.fill_null(has_sign, False)).tolist()
                    )

    def blocks(self, names: Sequence[str], texts: str) -> Iterator[Block]:
        """The rows in blocks, of the columns ``names``; ``texts`` says whether they come as
        ``lines`` or ``cells``, too."""
        size, at = max(self.path.stat().st_size, 1), 0

        def report_place(place: int) -> None:
            nonlocal at
            at = place

        try:
            pieces, dialect = source_of(self.path, self.dialect, report_place)
            text = Text(pieces, dialect.encoding)
            for piece in text:
                if (before := self.layout.first - piece.first) > 0:
                    piece = Piece(self.layout.first, piece.lines[before:])
                    if not piece.lines:
                        continue
                block = self._plain(piece, names, texts) or self._by_row(piece, text, names, texts)
                if not self.signs.decimal:
                    self._find_signs_in(block)
                yield block._replace(share=at / size, signs=self.signs)
        except TextError as error:
            raise FilesError(f"{self.path}: {error}") from None

    def _plain(self, piece: Piece, names: Sequence[str], texts: str) -> Block | None:
        """A block of lines that each have as many cells as the head; None where there are
        others."""
        layout, sep, lines = self.layout, self.sep, piece.lines
        numbers: Sequence[int] = range(piece.first, piece.first + len(lines))
        doubtful = {"", " ", "\t", sep, *(mark[0] for mark in COMMENT)}
        if any(line[:1] in doubtful for line in lines):
            indices = [i for i, x in enumerate(lines) if x[:1] not in doubtful or is_row(x, layout)]
            lines, numbers = [lines[i] for i in indices], [numbers[i] for i in indices]
        if not lines:
            return Block(pa.RecordBatch.from_pylist([], self._schema(names)), 0.0, [])
        if layout.sep == BLANKS:
            lines = [sep.join(line.split()) for line in lines]
        text, width, count = "\n".join(lines), len(layout.heads), lines[0].count(sep) + 1
        if may_be_head(text, layout, self.column_names):
            return None
        if '"' in text:
            return None if layout.sep == BLANKS else self._of_cells(lines, numbers, names, texts)
        if not (count >= width or (layout.without_comments and count == width - 1)):
            return None
        places = {name: i for i, name in enumerate(layout.heads)}
        indices = [places[name] for name in names]
        columns = _columns(text, sep, count, [*indices, *range(width, count)])
        if columns is None or not all(_is_blank(columns[i]) for i in range(width, count)):
            return None
        if count < width:
            columns[count] = pa.array([""] * len(lines), pa.string())
            lines = [line + sep for line in lines]
        elif count > width and texts:
            lines = [line.rsplit(sep, count - width)[0] for line in lines]
        rows = [line.split(sep) for line in lines] if texts == "cells" else lines
        batch = pa.RecordBatch.from_arrays(
            [columns[i] for i in indices], schema=self._schema(names)
        )
        return Block(batch, 0.0, numbers, rows if texts else ())

    def _of_cells(
        self, lines: Sequence[str], numbers: Sequence[int], names: Sequence[str], texts: str
    ) -> Block | None:
        """A block of lines with quotes, each with as many cells as the head; None where there are
        others, or where a cell goes on in the next line."""
        if any(line.count('"') % 2 for line in lines):
            return None
        try:
            rows = [*csv.reader(lines, delimiter=self.sep, strict=True, skipinitialspace=True)]
        except csv.Error:
            return None
        width = len(self.layout.heads)
        if len(rows) != len(lines) or any(len(row) != width for row in rows):
            return None
        columns = [*zip(*rows, strict=True)]
        places = {name: i for i, name in enumerate(self.layout.heads)}
        arrays = [pa.array(columns[places[name]], pa.string()) for name in names]
        batch = pa.RecordBatch.from_arrays(arrays, schema=self._schema(names))
        return Block(batch, 0.0, numbers, (rows if texts == "cells" else lines) if texts else ())

    def _by_row(self, piece: Piece, text: Text, names: Sequence[str], texts: str) -> Block:
        """A block whose rows are read one by one; the last may go on in the next piece."""
        lines, rows, width = _Lines(piece, text), list[Record](), len(self.layout.heads)
        for row in records(lines, self.layout, self.column_names):
            rows.append(row)
            if lines.at_end:
                break
        places = {name: i for i, name in enumerate(self.layout.heads)}
        empty = [None] * width
        cells = [row.cells if row.fault is None else empty for row in rows]
        arrays = [pa.array([row[places[name]] for row in cells], pa.string()) for name in names]
        return Block(
            pa.RecordBatch.from_arrays(arrays, schema=self._schema(names)),
            0.0,
            [row.line for row in rows],
            [self._text(row) if texts == "lines" else row.cells for row in rows] if texts else (),
            [(i, excerpt(row.text), row.fault) for i, row in enumerate(rows) if row.fault],
        )

    def _text(self, row: Record) -> str:
        """A row as it stands in the file, without the empty cells that may follow it."""
        if row.is_whole and self.layout.sep != BLANKS:
            return row.text
        line = io.StringIO(newline="")
        csv.writer(line, delimiter=self.sep, lineterminator="").writerow(row.cells)
        return line.getvalue()

    @staticmethod
    def _schema(names: Sequence[str]) -> pa.Schema:
        return pa.schema([(name, pa.string()) for name in names])


class _Lines:
    """The numbered lines of a piece; behind it those of the next, where a row goes on there."""

    def __init__(self, piece: Piece, text: Text) -> None:
        self._piece, self._text, self._at = piece, text, 0

    @property
    def at_end(self) -> bool:
        """Whether all lines of the piece are taken."""
        return self._at == len(self._piece.lines)

    def __iter__(self) -> Iterator[tuple[int, str]]:
        return self

    def __next__(self) -> tuple[int, str]:
        while self.at_end:
            self._piece, self._at = next(self._text), 0
        self._at += 1
        return self._piece.first + self._at - 1, self._piece.lines[self._at - 1]


def _columns(text: str, sep: str, count: int, places: Sequence[int]) -> dict[int, pa.Array] | None:
    """The columns at some places of lines without quotes; None where a line has more or fewer
    cells than ``count``."""
    data, names = text.encode(), [str(i) for i in places if i < count]
    try:
        table = pa.csv.read_csv(
            pa.BufferReader(data),
            pa.csv.ReadOptions(
                use_threads=False, block_size=len(data) + 1, column_names=[*map(str, range(count))]
            ),
            pa.csv.ParseOptions(delimiter=sep, quote_char=False, ignore_empty_lines=False),
            pa.csv.ConvertOptions(
                check_utf8=False,
                column_types=dict.fromkeys(names, pa.string()),
                strings_can_be_null=False,
                include_columns=names,
            ),
        )
    except pa.ArrowInvalid:
        return None
    return {int(name): table.column(name).combine_chunks() for name in names}


def _is_blank(column: pa.Array) -> bool:
    return bool(pc.all(pc.equal(pc.utf8_trim_whitespace(column), "")).as_py())

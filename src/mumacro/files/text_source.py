"""Files of tables as text, in blocks of rows.

A file without quotes is read by Arrow's reader of CSV in pieces; the lines that may be something
else than rows of numbers are looked at one by one before.  A file with quotes is read row by row,
by the same layout.
"""

import csv
import io
from collections.abc import Callable, Iterator, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv

from mumacro.files.errors import FilesError
from mumacro.inputs.decoding import Text, TextError
from mumacro.inputs.layout import BLANKS, GAPS, ColumnNames, Dialect
from mumacro.inputs.signs import Cell, Signs
from mumacro.inputs.text_tables import (
    BEGIN_OF_STATISTICS,
    Account,
    Record,
    again,
    begin,
    irregular,
    records,
    regular,
    source_of,
)
from mumacro.inputs.units import split_unit

# rows that are searched for the decimal sign: at a time, and in all, before the first block
_AT_ONCE, _LOOKED_AT = 2_000, 60_000
_ROWS = 65_536  # rows of a block that is read row by row
_EXCERPT = 500  # characters that are kept of a row that is refused
_OF_NUMBERS = b"0123456789+-."  # what the lines begin with that Arrow reads
_NULLS = sorted({text for gap in GAPS for text in (gap, gap.upper(), gap.title())} | {"NaN"})


class Block(NamedTuple):
    """Some rows in order; ``share`` is how much of the file is read after them.

    A row that could not be read is one of nulls; ``unreadable`` has its index, its text and the
    fault.  ``texts`` are the rows as they came in, where they are wanted: an array of lines.
    ``lines`` are their lines in the file, or their numbers where it has none.  ``as_text`` gives
    the same with the cells as text, where the columns are numbers.
    """

    batch: pa.RecordBatch
    share: float
    lines: Sequence[int]
    texts: Any = ()
    unreadable: Sequence[tuple[int, str, str]] = ()
    signs: Signs | None = None  #: of numbers as text
    as_text: Callable[[], "Block"] | None = None


def excerpt(text: str) -> str:
    """A row that is refused, of bounded length."""
    return text if len(text) <= _EXCERPT else text[:_EXCERPT] + "…"


class TextTable:
    """One file: how it is written, and its rows; FilesError says why it is no table."""

    def __init__(self, path: Path, column_names: ColumnNames, dialect: Dialect) -> None:
        self.path, self.column_names = path, column_names
        try:
            self._pieces, self.dialect, self._said = source_of(path, column_names, dialect)
            text = Text(self._pieces(), self.dialect.encoding)
            self.layout, lines = begin(text, column_names, self.dialect)
            self.signs = self.dialect.signs(self.layout)
            self._account = Account(self.layout, column_names)
            self._find_signs(lines)
            self._has_quotes = self._count_quotes() > 0
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
        """How the file was read, once it is."""
        described = self._said + self.layout.described(self.signs)
        return described + again(self._account.repeated)

    def _count_quotes(self) -> int:
        """Count the quotes behind the head."""
        text = Text(self._pieces(), self.dialect.encoding)
        lines = chain.from_iterable(piece.lines for piece in text)
        before = sum(line.count('"') for line in islice(lines, self.layout.first - 1))
        return sum(piece.count(b'"') for piece in self._pieces()) - before

    def _find_signs(self, lines: Iterator[tuple[int, str]]) -> None:
        """Find the decimal sign in the first rows that tell it."""
        rows = islice(records(lines, self.layout, self._account), _LOOKED_AT)
        while block := [*islice(rows, _AT_ONCE)]:
            self.signs.see(
                Cell(row.line, name, row.cells[i])
                for row in block
                if row.fault is None
                for i, name in self.layout.inputs.items()
            )
            if self.signs.decimal:
                break

    def _find_signs_in(self, block: Block) -> None:
        """Find the decimal sign in a block, where all numbers before it have none."""
        names = [split_unit(head)[0] for head in block.batch.schema.names]
        for name, column in zip(names, block.batch.columns, strict=True):
            if name in self.column_names.like and pa.types.is_string(column.type):
                has_sign = pc.match_substring_regex(column, "[.,]")
                if pc.any(has_sign).as_py():
                    self.signs.see(
                        Cell(block.lines[i], name, column[i].as_py())
                        for i in np.flatnonzero(pc.fill_null(has_sign, False)).tolist()
                    )

    def blocks(self, names: Sequence[str], *, lines: bool, numbers: bool) -> Iterator[Block]:
        """Return the rows in blocks, of the columns ``names``: also as ``lines``, and inputs as
        ``numbers`` where all of a block are plain ones."""
        size, place = max(self.path.stat().st_size, 1), 0

        def report_place(at: int) -> None:
            nonlocal place
            place = at

        self._account = Account(self.layout, self.column_names)
        try:
            text = Text(self._pieces(report_place), self.dialect.encoding)
            read = self._by_row if self._has_quotes else self._in_pieces
            for block in read(text, names, lines, numbers):
                if not self.signs.decimal:
                    self._find_signs_in(block)
                yield block._replace(share=place / size, signs=self.signs)
        except TextError as error:
            raise FilesError(f"{self.path}: {error}") from None

    # --- by Arrow's reader --------------------------------------------------------------------

    def _in_pieces(
        self, text: Text, names: Sequence[str], lines: bool, numbers: bool
    ) -> Iterator[Block]:
        first, last = self.layout.first, self.layout.last
        for piece in text:
            number = max(first, piece.first)
            rows = piece.lines[
                number - piece.first : None if last is None else last + 1 - piece.first
            ]
            if rows and (last is None or number <= last):
                yield self._plain(number, rows, names, lines, numbers)

    def _plain(
        self, first: int, lines: list[str], names: Sequence[str], with_lines: bool, numbers: bool
    ) -> Block:
        """A block of lines without quotes, of which ``first`` is the number of the first."""
        sep, width = self.sep, len(self.layout.heads)
        if self.layout.sep == BLANKS:
            lines = [sep.join(line.split()) for line in lines]
        data = "\n".join([*lines, ""]).encode()
        at: Sequence[int] = range(first, first + len(lines))
        unreadable: list[tuple[int, str, str]] = []
        doubtful = self._doubtful(data, lines)
        if doubtful:
            kept: list[str | None] = [*lines]
            faults: dict[int, tuple[str, str]] = {}
            for i in doubtful:
                kept[i] = self._line_of_row(first + i, lines[i], faults)
            if kept != lines:
                places = [i for i, line in enumerate(kept) if line is not None]
                unreadable = [(j, *faults[at[i]]) for j, i in enumerate(places) if at[i] in faults]
                lines, at = [line for line in kept if line is not None], [at[i] for i in places]
                data = "\n".join([*lines, ""]).encode() if lines else b""
        texts: Any = _array_of_lines(data, len(lines)) if with_lines else ()

        def block(as_numbers: bool) -> Block:
            columns = self._columns(data, names, width, as_numbers) if lines else None
            if columns is None:
                columns = [pa.array([], pa.string()) for _ in names]
            batch = pa.RecordBatch.from_arrays(columns, [*names])
            as_text = (lambda: block(False)) if as_numbers else None
            return Block(batch, 0.0, at, texts, unreadable, self.signs, as_text)

        return block(numbers)

    def _doubtful(self, data: bytes, lines: list[str]) -> list[int]:
        """The indices of lines that are looked at one by one: those that do not begin as numbers
        do, have not as many cells as the head, or may be the head again."""
        signs = np.frombuffer(data, np.uint8)
        ends = np.flatnonzero(signs == 10)
        starts = np.concatenate([[0], ends[:-1] + 1])
        seps = np.flatnonzero(signs == ord(self.sep))
        counts = np.searchsorted(seps, ends) - np.searchsorted(seps, starts)
        is_doubtful = counts != len(self.layout.heads) - 1
        place = min(self.layout.inputs)
        if place == 0 or is_doubtful.all():
            is_doubtful |= ~_BEGINS_NUMBER[signs[starts]]
        else:  # a name stands first: what matters is the first cell of an input, and the name
            before = np.minimum(np.searchsorted(seps, starts) + place - 1, len(seps) - 1)
            cells = np.minimum(seps[before] + 1, len(signs) - 1)
            two = (
                signs[starts].astype(np.uint16) << 8 | signs[np.minimum(starts + 1, len(signs) - 1)]
            )
            is_doubtful |= ~_BEGINS_NUMBER[signs[cells]] | _MAY_BE_OTHERWISE[two]
        # the row of units below the head again may begin like a number
        is_doubtful[0] |= bool(self._account.repeated)
        if self._account.may_be_head(data.decode()):
            for i, line in enumerate(lines):
                if self._account.may_be_head(line):
                    is_doubtful[i : i + 2] = True
        doubtful: list[int] = np.flatnonzero(is_doubtful).tolist()
        return doubtful

    def _line_of_row(
        self, number: int, text: str, faults: dict[int, tuple[str, str]]
    ) -> str | None:
        """A row with as many cells as the head, of empty ones where it has a fault; None for a line
        that is no row."""
        sep, width = self.sep, len(self.layout.heads)
        if not self._account.may_be_data(number, text):
            return None
        if text.count(sep) > 2 * width + 1000:  # no use in taking it apart
            faults[number] = excerpt(text), irregular(text.count(sep) + 1, width)
            return sep * (width - 1)
        cells = text.split(sep)
        if not self._account.is_row(number, text, cells):
            return None
        row = regular(Record(number, cells, None, text), self.layout)
        if row.fault is not None:
            faults[number] = excerpt(text), row.fault
            return sep * (width - 1)
        return text if row.is_whole else sep.join(row.cells)

    def _columns(
        self, data: bytes, names: Sequence[str], width: int, as_numbers: bool
    ) -> list[pa.Array]:
        """The columns of lines that each have ``width`` cells and no quotes."""
        places = {name: i for i, name in enumerate(self.layout.heads)}
        chosen = [str(places[name]) for name in names]
        types = dict.fromkeys(chosen, pa.string())
        decimal = self.signs.decimal
        if as_numbers and (decimal or not _has_sign(data, self.sep)):
            types |= {str(i): pa.float64() for i in self.layout.inputs if str(i) in types}
        try:
            columns = self._read(data, width, types, decimal or ".")
        except pa.ArrowInvalid:  # a cell is no plain number
            return self._read(data, width, dict.fromkeys(chosen, pa.string()), ".")
        # too many digits must not pass for a rigid contact
        if any(
            pa.types.is_floating(column.type) and pc.any(pc.is_inf(column)).as_py()
            for column in columns
        ):
            return self._read(data, width, dict.fromkeys(chosen, pa.string()), ".")
        return columns

    def _read(
        self, data: bytes, width: int, types: dict[str, pa.DataType], decimal: str
    ) -> list[pa.Array]:
        table = pa.csv.read_csv(
            pa.BufferReader(data),
            pa.csv.ReadOptions(
                use_threads=False,
                block_size=len(data) + 1,
                column_names=[*map(str, range(width))],
            ),
            pa.csv.ParseOptions(delimiter=self.sep, quote_char=False, ignore_empty_lines=False),
            pa.csv.ConvertOptions(
                check_utf8=False,
                column_types=types,
                null_values=_NULLS,
                strings_can_be_null=False,
                include_columns=[*types],
                decimal_point=decimal,
            ),
        )
        return [table.column(name).combine_chunks() for name in types]

    # --- row by row ---------------------------------------------------------------------------

    def _by_row(
        self, text: Text, names: Sequence[str], with_lines: bool, _numbers: bool
    ) -> Iterator[Block]:
        """Blocks of rows that are read one by one."""
        layout, width = self.layout, len(self.layout.heads)
        all_lines = chain.from_iterable(piece.lines for piece in text)
        lines = enumerate(islice(all_lines, layout.first - 1, layout.last), layout.first)
        rows = records(iter(lines), layout, self._account)
        places = {name: i for i, name in enumerate(layout.heads)}
        empty = [None] * width
        while block := [*islice(rows, _ROWS)]:
            cells = [row.cells if row.fault is None else empty for row in block]
            arrays = [pa.array([row[places[name]] for row in cells], pa.string()) for name in names]
            yield Block(
                pa.RecordBatch.from_arrays(arrays, [*names]),
                0.0,
                [row.line for row in block],
                pa.array([self._text(row) for row in block], pa.string()) if with_lines else (),
                [(i, excerpt(row.text), row.fault) for i, row in enumerate(block) if row.fault],
            )

    def _text(self, row: Record) -> str:
        """A row as it stands in the file, without the empty cells that may follow it."""
        if row.is_whole and self.layout.sep != BLANKS:
            return row.text
        line = io.StringIO(newline="")
        csv.writer(line, delimiter=self.sep, lineterminator="").writerow(row.cells)
        return line.getvalue()


# by the first byte of a cell: whether it begins as numbers do
_BEGINS_NUMBER = np.array([byte in _OF_NUMBERS for byte in range(256)])
# by the first two bytes of a name: whether the line may be a comment, or begin with a word such as
# mean; signs that are neither ASCII letters nor those of numbers are looked at
_MAY_BE_OTHERWISE = np.array(
    [
        not (first.isascii() and (first.isalpha() or ord(first) in _OF_NUMBERS))
        or (first + second).lower() in BEGIN_OF_STATISTICS
        for first in map(chr, range(256))
        for second in map(chr, range(256))
    ]
)


def _has_sign(data: bytes, sep: str) -> bool:
    """Whether a number may have a decimal sign."""
    return b"." in data or (b"," in data and sep != ",")


def _array_of_lines(data: bytes, count: int) -> pa.Array:
    """Lines as an array of texts."""
    ends = np.flatnonzero(np.frombuffer(data, np.uint8) == 10)
    offsets = np.concatenate([[0], ends - np.arange(count)]).astype(np.int32)
    text = data.replace(b"\n", b"")
    return pa.StringArray.from_buffers(count, pa.py_buffer(offsets), pa.py_buffer(text))

"""Read the rows of tables as people and rigs write them, in pieces, and whole tables in memory.

A line passes these modules: :mod:`mumacro.inputs.decoding` makes lines of bytes; ``layout`` finds
the separator and the header, ``column_units`` the units; ``account`` decides what each line is;
this module cuts out the rows; ``numbers`` finds the decimal separator, and ``cells`` reads the
numbers.
"""

import csv
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mumacro.errors import TextError
from mumacro.inputs.account import Account, ColumnNames, names_statistics
from mumacro.inputs.cells import BLANKS, MOST_COLUMNS, is_comment, numbers_of, split_row
from mumacro.inputs.decoding import LONGEST, Piece, Text, file_pieces
from mumacro.inputs.layout import LOOKED_AT, Dialect, find_layout
from mumacro.inputs.names import absent, find_heads
from mumacro.inputs.numbers import Cell
from mumacro.inputs.units import in_si, too_large_in_si
from mumacro.inputs.workbooks import BEGIN, SEP, read_sheet
from mumacro.kernel.arrays import Array

_BETWEEN_BLANKS = re.compile(r'"[^"]*"|\S+')
_BETWEEN = re.compile(r"[,;|\s]+")  # anything that separates cells
# by the separator: a quoted cell after blanks, any quoted cell, and a quote that begins a cell
_BEHIND_BLANKS, _QUOTED, _OPEN_QUOTE = (
    {sep: re.compile(pattern.replace("SEP", re.escape(sep))) for sep in ",;|\t"}
    for pattern in (
        r'(?<![^SEP\n]) ++("(?:[^"]++|"")*+"(?=SEP|\n|\Z))',
        r'"(?<![^SEP\n]")(?:[^"]++|"")*+"(?=SEP|\n|\Z)',
        r'(?<![^SEP\n]) *+"',
    )
)
_CLOSING = re.compile(r'(?:[^"]++|"")*+"')  # the rest of a quoted cell
_UNCLOSED = re.compile(r' *+"(?:[^"]++|"")*+\Z')
_EXCERPT = 500  # characters that are kept of a refused row
_AT_ONCE = 2_000  # rows that are searched for the decimal separator at a time


class Most(NamedTuple):
    """Limit the size of a table."""

    rows: int = 1_000_000
    columns: int = MOST_COLUMNS
    cell: int = LONGEST  #: characters

    def check(self, piece: Piece) -> None:
        """Check lines before they are split, for every separator.  Raise TextError for a line with
        too many cells or too long a cell.

        >>> Most(cell=3).check(Piece(7, "a,b\\na,abcd"))
        Traceback (most recent call last):
        mumacro.errors.TextError: line 8: a cell may have up to 3 characters
        """
        for number, line in enumerate(piece.lines, piece.first):
            if len(line) > self.cell and max(map(len, _BETWEEN.split(line))) > self.cell:
                raise TextError(f"line {number}: a cell may have up to {self.cell:,} characters")
            if len(line) > self.columns:
                cells = max(len(line.split()), 1 + max(line.count(sep) for sep in ",;|\t"))
                if cells > self.columns:
                    raise TextError(f"line {number}: there may be up to {self.columns:,} columns")


class Rows(NamedTuple):
    """Hold rows of a table in order, as text: each has as many cells as the header."""

    sep: str
    texts: list[str]
    lines: Sequence[int]  #: the line of the file in which each row begins
    #: by the index of a row: its text, and why it does not belong to this table; its cells are
    #: empty
    faults: dict[int, tuple[str, str]]

    def cells(self) -> Iterator[list[str]]:
        """Yield the cells of each row."""
        for line, text in zip(self.lines, self.texts, strict=True):
            try:
                yield split_row(text, self.sep)
            except csv.Error as error:
                raise TextError(f"line {line}: {error}") from None


class _OpenRow:
    """Collect the lines of a row that has a line end in a quoted cell."""

    def __init__(self, account: Account) -> None:
        self._account = account
        self.line = 0  #: the line in which the row begins
        self._lines: list[str] = []
        self._size = 0  # characters

    def __bool__(self) -> bool:
        return bool(self._lines)

    def whole(self, number: int, line: str) -> str | None:
        """Return the row that ends with this line, or None if it goes on.  Raise TextError if a
        quote is not at the end of its cell."""
        sep, end = self._account.sep, 0
        if self._lines:
            closing = _CLOSING.match(line)
            if closing is None:
                self._add(line)
                return None
            end = closing.end()
        elif '"' not in line or (is_comment(line) and not self._account.has_name(line)):
            return line
        else:
            self.line = number
        rest = line[end:]
        rest = _BEHIND_BLANKS[sep].sub(r"\1", rest) if ' "' in rest else rest
        bare = _QUOTED[sep].sub(lambda match: "0" * len(match[0]), rest)
        open_quote = _OPEN_QUOTE[sep].search(bare)
        if (end and rest and rest[0] != sep) or (
            open_quote and not _UNCLOSED.match(rest, open_quote.start())
        ):
            raise unclosed(self.line)
        if open_quote:
            self._add(line[:end] + rest)
            return None
        row = "\n".join([*self._lines, line[:end] + rest])
        self._lines, self._size = [], 0
        return row

    def _add(self, line: str) -> None:
        """Add a line after which the row goes on."""
        self._lines.append(line)
        self._size += len(line)
        if self._size > LONGEST:
            raise unclosed(self.line)


def unclosed(line: int) -> TextError:
    """Return the error for a row with a quote that does not end its cell."""
    return TextError(f"line {line}: a quote is not closed, or not at the end of its cell")


# --- whole tables ---------------------------------------------------------------------------------


class TextTable:
    """Read a table in a file or in bytes: how it is written, and its rows in pieces.

    TextError tells why it is not a table; every piece is checked before it is split.
    """

    def __init__(
        self,
        source: Path | bytes,
        column_names: ColumnNames,
        dialect: Dialect,
        check: Callable[[Piece], None] = lambda _piece: None,
    ) -> None:
        self._column_names, self._check = column_names, check
        self._source, self._dialect, self._said = _sheet_in(source, column_names, dialect)
        text, start = self._text(), list[str]()
        self._start = list[Piece]()  # first pieces of the text
        for piece in text:
            check(piece)
            self._start.append(piece)
            start += piece.lines
            if len(start) >= LOOKED_AT:
                break
        self.layout = find_layout(start, column_names, self._dialect, text.encoding)
        self.signs = self._dialect.signs(self.layout)
        self.account = self.layout.account(column_names, self._dialect)

    @property
    def read_as(self) -> str:
        """Return how the table was read, after it was read."""
        described = self.layout.described(self.signs)
        return self._said + described + headers_left_out(self.account.repeated)

    def find_signs(self) -> None:
        """Search the first rows, and then the first pieces, for the separators of numbers.  Skip
        this if columns are missing, because then that is reported."""
        is_known = self._column_names.are_all_in(self.layout.heads)
        for last in (self.layout.first + _AT_ONCE, None):
            if is_known and not self.signs.decimal:
                for piece in self._data_of(self._start, last):
                    self.see_signs(self.rows_in(piece))
        self._start = []

    def pieces(self, report_place: Callable[[int], None] = lambda _place: None) -> Iterator[Piece]:
        """Yield the lines from the first row on in pieces, and tell ``report_place`` how far a file
        has been read."""
        yield from self._data_of(self._text(report_place), None)
        if self.open_row:
            raise unclosed(self.open_row.line)

    def _data_of(self, pieces: Iterable[Piece], last: int | None) -> Iterator[Piece]:
        """Yield the lines of data, up to the line ``last``."""
        self.account = self.layout.account(self._column_names, self._dialect)
        #: a row that continues after the piece that was read last
        self.open_row = _OpenRow(self.account)
        ends = [line for line in (last, self.layout.last) if line is not None]
        end = min(ends, default=None)
        for piece in pieces:
            self._check(piece)
            first, text = _between(piece, self.layout.first, end)
            if text is not None:
                yield Piece(first, text)

    def rows_in(self, piece: Piece) -> Rows:
        """Return the rows in some lines, each of which is accounted for."""
        account, lines = self.account, list[int]()
        rows = Rows(account.sep, [], lines, {})
        for number, line in enumerate(piece.lines, piece.first):
            if self.layout.sep == BLANKS:
                cells = _BETWEEN_BLANKS.findall(line) if '"' in line else line.split()
                line = account.sep.join(cells)
            first = self.open_row.line if self.open_row else number
            text = self.open_row.whole(number, line)
            row = None if text is None else account.row(first, text)
            if text is None or row is None:
                continue
            if row[1] is not None:
                excerpt = text if len(text) <= _EXCERPT else f"{text[:_EXCERPT]}…"
                rows.faults[len(rows.texts)] = excerpt, row[1]
            rows.texts.append(row[0])
            lines.append(first)
        return rows

    def see_signs(self, rows: Rows) -> None:
        """Examine the numbers of some rows until they show their separators."""
        numbered = enumerate(zip(rows.lines, rows.cells(), strict=True))
        while not self.signs.decimal and (some := [*islice(numbered, _AT_ONCE)]):
            self.signs.see(
                Cell(line, name, cells[i])
                for j, (line, cells) in some
                if j not in rows.faults
                for i, name in self.layout.inputs.items()
            )

    def _text(self, report_place: Callable[[int], None] = lambda _place: None) -> Text:
        """Return the text from its beginning."""
        source = self._source
        pieces = [source] if isinstance(source, bytes) else file_pieces(source, report_place)
        return Text(pieces, self._dialect.encoding)


def _between(piece: Piece, first: int, last: int | None) -> tuple[int, str | None]:
    """Return the lines of a piece from ``first`` to ``last``, and the number of the first of them;
    None if there are none."""
    start, text = piece
    if start < first:
        lines = text.split("\n", first - start)
        if len(lines) <= first - start:
            return first, None
        start, text = first, lines[-1]
    if last is not None:
        text = "\n".join(text.split("\n", last - start + 1)[: max(last - start + 1, 0)])
    return start, text if last is None or start <= last else None


def _sheet_in(
    source: Path | bytes, column_names: ColumnNames, dialect: Dialect
) -> tuple[Path | bytes, Dialect, str]:
    """Return a table as text, how it is written, and what to say about the sheets.  For a workbook
    the table is the sheet that has the names."""
    if isinstance(source, bytes):
        start = source[:4]
    else:
        with source.open("rb") as stream:
            start = stream.read(4)
    if start != BEGIN:
        if dialect.sheet is not None:
            raise TextError(f"it is no workbook, and has no sheet {dialect.sheet!r}")
        return source, dialect, ""

    def has_names(lines: list[str]) -> bool:
        layout = find_layout(lines, column_names, dialect._replace(sep=SEP))
        return column_names.are_all_in(layout.heads)

    data, said = read_sheet(source, dialect.sheet, dialect.decimal, has_names)
    return data, dialect._replace(sep=SEP, encoding="utf-8"), said


class TableOfNumbers(NamedTuple):
    """Hold the columns of numbers that were read."""

    columns: dict[str, Array]  #: by name, in SI, (n,)
    as_written: dict[str, Array]  #: the same in the units of the table
    units: dict[str, str]  #: unit of each column in the table; the SI unit if it has none
    lines: list[int]  #: line of each row
    skipped: list[int]  #: lines that are not empty, not the header, not units and not rows
    read_as: str  #: how the table was read, see :meth:`mumacro.inputs.layout.Layout.described`


def read_numbers(
    source: Path | bytes,
    column_names: ColumnNames,
    dialect: Dialect,
    most: Most = Most(),  # noqa: B008
) -> TableOfNumbers:
    """Return the columns of a table that have a meaning, in SI, from a file or its bytes.

    TextError tells everything that is wrong: its ``faults`` are one for each line.

    >>> data = "Rig 7\\n\\nv0\\tmu_macro\\nmm/s\\t%\\n1,5\\t7\\n2,5\\t9\\n".encode()
    >>> names = ColumnNames({"v0": "v0", "mu_macro": "mu0"}, [["v0"]])
    >>> table = read_numbers(data, names, Dialect())
    >>> table.columns["mu_macro"].tolist(), table.skipped
    ([0.07, 0.09], [1])
    >>> table.read_as
    'tab, decimal comma, header in line 3, units in line 4; v0 [mm/s], mu_macro [%]'
    """
    table = TextTable(source, column_names, dialect, most.check)
    layout, signs, input_of = table.layout, table.signs, column_names.input_of
    columns, faults = find_heads(layout.heads, input_of)
    missing = [
        group[0] for group in column_names.required_groups if not columns.keys() & set(group)
    ]
    if missing:
        faults.append(absent(missing, layout.heads))
    if faults:
        raise TextError.of([f"line {layout.line}: {fault}" for fault in faults])
    lines, rows, wrong = list[int](), list[list[str]](), list[tuple[int, str]]()
    for part in map(table.rows_in, table.pieces()):
        if len(lines) + len(part.lines) > most.rows:
            where = f"line {part.lines[most.rows - len(lines)]}"
            raise TextError(f"{where}: there are more than {most.rows:,} rows: average them")
        for i, (line, cells) in enumerate(zip(part.lines, part.cells(), strict=True)):
            if i in part.faults:
                wrong.append((line, f"line {line} {part.faults[i][1]}"))
            else:
                lines.append(line)
                rows.append(cells)
    if not rows and not wrong:
        raise TextError(f"line {layout.line}: no row follows the names of the columns")
    _refuse_named_statistics(table.account, lines, rows)
    signs.see(
        Cell(line, name, cells[i])
        for line, cells in zip(lines, rows, strict=True)
        for name, (i, _) in columns.items()
    )
    si, as_written = dict[str, Array](), dict[str, Array]()
    for name, (i, scale) in columns.items():
        texts = [cells[i] for cells in rows]
        as_written[name], bad = numbers_of(texts, input_of[name], signs, scale)
        si[name] = in_si(as_written[name], scale)
        bad |= too_large_in_si(as_written[name], si[name])
        for j in np.flatnonzero(np.isnan(si[name])).tolist():
            fault = f"{bad[j]}, got {texts[j].strip()[:80]!r}" if j in bad else "is missing"
            wrong.append((lines[j], f"line {lines[j]}: {name} {fault}"))
    if wrong:
        raise _wrong_rows(sorted(wrong, key=lambda one: one[0]), lines, dialect)
    units = {name: layout.units.unit(i) for name, (i, _) in columns.items()}
    skipped = sorted({*layout.skipped, *table.account.skipped})
    return TableOfNumbers(si, as_written, units, lines, skipped, table.read_as)


def _refuse_named_statistics(account: Account, lines: list[int], rows: list[list[str]]) -> None:
    """Refuse rows of statistics whose name is in a column that is empty before them."""
    for i in set(range(account.width)) - account.units.inputs.keys():
        named = [j for j, cells in enumerate(rows) if cells[i].strip()]
        if named and named[0] > 0 and all(names_statistics(rows[j][i].strip()) for j in named):
            line, name = lines[named[0]], rows[named[0]][i].strip()
            what = f"{name!r} names a row of statistics"
            raise TextError(f"line {line}: {what}: {account.remedy(line)}")


def _wrong_rows(wrong: list[tuple[int, str]], lines: list[int], dialect: Dialect) -> TextError:
    """Return the error for wrong rows, with the option that leaves them out if they are before or
    after all other rows."""
    error = TextError.of([fault for _, fault in wrong])
    wrong_lines = {line for line, _ in wrong}
    right = [line for line in lines if line not in wrong_lines]
    if not right or not dialect.dashes or any(right[0] < x < right[-1] for x in wrong_lines):
        return error
    remedy = f"{dialect.dashes}rows {right[0]}..{right[-1]} leaves them out"
    with_remedy = TextError(f"{error}; {remedy}")
    with_remedy.faults = error.faults
    return with_remedy


def headers_left_out(lines: list[int]) -> str:
    """Return the sentence about lines that repeat the header or its units.

    >>> headers_left_out([7]), headers_left_out([])
    ('; the header again in line 7, left out', '')
    """
    if not lines:
        return ""
    rest = f" and {len(lines) - 5:,} more" if len(lines) > 5 else ""
    places = ", ".join(map(str, lines[:5])) + rest
    return f"; the header again in line{'s' * (len(lines) > 1)} {places}, left out"

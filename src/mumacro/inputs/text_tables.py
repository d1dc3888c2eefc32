"""Read the rows of tables as people and rigs write them, in pieces, and whole tables in memory.

A line passes these modules: :mod:`mumacro.inputs.decoding` makes lines of bytes; ``layout`` finds
the separator and the header, ``column_units`` the units; ``account`` decides what each line is;
this module cuts out the rows; ``numbers`` finds the decimal separator, and ``cells`` reads the
numbers.
"""

import csv
import io
import re
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mumacro.errors import TextError
from mumacro.inputs.account import (
    BEGIN_OF_STATISTICS,
    Account,
    ColumnNames,
    names_statistics,
)
from mumacro.inputs.cells import BLANKS, MOST_COLUMNS, is_comment, numbers_of, split_row
from mumacro.inputs.decoding import LONGEST, Piece, Text, file_pieces
from mumacro.inputs.layout import LOOKED_AT, Dialect, find_layout
from mumacro.inputs.names import absent, find_heads
from mumacro.inputs.numbers import Cell
from mumacro.inputs.units import in_si, too_large_in_si
from mumacro.inputs.workbooks import BEGIN, SEP, read_sheet
from mumacro.kernel.arrays import Array, Places

_BETWEEN_BLANKS = re.compile(r'"[^"]*"|\S+')
_BETWEEN = re.compile(r"[,;|\s]+")  # anything that separates cells
_PAIRS = [(first, second) for first in map(chr, range(256)) for second in map(chr, range(256))]
# by the first two bytes of a cell: whether it begins like a number
_BEGINS_NUMBER = np.array(
    [a.isascii() and (a.isdigit() or (a in "+-." and b in "0123456789.")) for a, b in _PAIRS]
)
# by the first two bytes of a name: whether the line may be a comment, or begin with a word such as
# mean.  Other characters than ASCII letters and those of numbers are examined
_MAY_BE_OTHERWISE = np.array(
    [
        not (a.isascii() and (a.isalpha() or a in "0123456789+-."))
        or (a + b).lower() in BEGIN_OF_STATISTICS
        for a, b in _PAIRS
    ]
)
_END, _QUOTE = ord("\n"), ord('"')
# by the separator: a quoted cell, one with blanks before it, and a quote that begins a cell
_QUOTED = {
    sep: re.compile(rb'"(?<![^%b\n]")(?:[^"]++|"")*+"(?=[%b\n])' % (sep.encode(), sep.encode()))
    for sep in ",;|\t"
}
_BEHIND_BLANKS = {
    sep: re.compile(rb'(?<![^%b\n]) ++("(?:[^"]++|"")*+"(?=[%b\n]))' % (sep.encode(), sep.encode()))
    for sep in ",;|\t"
}
_OPEN_QUOTE = {sep: re.compile(rb'(?<![^%b\n]) *+"' % sep.encode()) for sep in ",;|\t"}
_UNCLOSED = re.compile(rb' *+"(?:[^"]++|"")*+\Z')
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

    data: bytes  #: UTF-8; each row ends with a line feed
    ends: Places  #: positions of these line feeds
    lines: Places  #: the line of the file in which each row begins
    #: by the index of a row: its text, and why it does not belong to this table; its cells are
    #: empty
    faults: dict[int, tuple[str, str]]
    sep: str

    @property
    def has_quotes(self) -> bool:
        """Return whether there is a quote."""
        return b'"' in self.data

    @property
    def is_cut_by_lines(self) -> bool:
        """Return whether each line feed ends a row."""
        return not self.has_quotes or self.data.count(b"\n") == self.ends.size

    def cells(self) -> Iterator[list[str]]:
        """Yield the cells of each row."""
        text = self.data.decode()
        if not self.has_quotes:
            yield from (line.split(self.sep) for line in text.split("\n")[:-1])
            return
        try:
            yield from csv.reader(io.StringIO(text, newline="\n"), delimiter=self.sep)
        except csv.Error as error:
            raise TextError(f"line {self.lines[0]} or one of those behind it: {error}") from None

    def of(self, i: int) -> list[str]:
        """Return the cells of one row."""
        start = self.ends[i - 1] + 1 if i else 0
        text = self.data[start : self.ends[i]].decode()
        return split_row(text, self.sep)


def rows_in(first: int, text: str, account: Account) -> tuple[Rows, str]:
    """Return the rows in some lines (``first`` is the number of the first line), and the beginning
    of a row that continues after them.

    Lines that are not rows of numbers are examined one by one.
    """
    sep = account.sep
    if account.header.sep == BLANKS:
        text = "\n".join(
            sep.join(_BETWEEN_BLANKS.findall(line) if '"' in line else line.split())
            for line in text.split("\n")
        )
    data, ends, seps, rest = _cut(first, f"{text}\n".encode(), sep)
    starts = np.concatenate([[0], ends[:-1] + 1])[: ends.size]
    lines = first + np.arange(ends.size)
    if data.count(b"\n") != ends.size:
        all_ends = np.flatnonzero(np.frombuffer(data, np.uint8) == _END)
        lines = first + np.searchsorted(all_ends, starts)
    lengths, keep = ends - starts, np.ones(ends.size, np.bool_)
    parts, faults, end = list[bytes](), dict[int, tuple[str, str]](), 0
    for i in _doubtful(account, data, starts, ends, seps):
        line = data[starts[i] : ends[i]].decode()
        row = account.row(int(lines[i]), line)
        if row is None:
            keep[i] = False
        elif row[1] is not None:
            faults[i] = line if len(line) <= _EXCERPT else line[:_EXCERPT] + "…", row[1]
        if row is None or row[0] != line:
            new = b"" if row is None else f"{row[0]}\n".encode()
            parts += [data[end : starts[i]], new]
            lengths[i], end = len(new) - 1, ends[i] + 1
    if parts:
        data, places = b"".join([*parts, data[end:]]), np.cumsum(keep) - 1
        ends, lines = np.cumsum(lengths[keep] + 1) - 1, lines[keep]
        faults = {int(places[i]): fault for i, fault in faults.items()}
    return Rows(data, ends, lines, faults, sep), rest


def _cut(first: int, data: bytes, sep: str) -> tuple[bytes, Places, Places, str]:
    """Return complete rows, the positions of their ends and of the separators between their cells,
    and the beginning of a row whose quote is not closed.  Raise TextError if a quote is not at the
    end of its cell."""
    rest, bare = "", data
    quotes: Places = np.zeros(0, np.intp)
    if b'"' in data:
        quotes = np.flatnonzero(np.frombuffer(data, np.uint8) == _QUOTE)
        if not _surround_cells(data, quotes, sep):
            data, bare, rest = _without_quotes(first, data, sep)
            quotes = quotes[:0]
    signs = np.frombuffer(bare, np.uint8)
    ends, seps = (np.flatnonzero(signs == ord(sign)) for sign in ("\n", sep))
    if quotes.size:  # text after an odd number of quotes is within a cell
        ends, seps = (places[np.searchsorted(quotes, places) % 2 == 0] for places in (ends, seps))
    return data, ends, seps, rest


def _surround_cells(data: bytes, quotes: Places, sep: str) -> bool:
    """Return whether each quote begins or ends a cell, or is one of two within it."""
    if quotes.size % 2:
        return False
    signs = np.frombuffer(data, np.uint8)
    is_beside = np.zeros(256, np.bool_)
    is_beside[[ord(sep), _END, _QUOTE]] = True
    before, behind = signs[quotes[::2] - 1], signs[quotes[1::2] + 1]
    if quotes[0] == 0:
        before[0] = _END
    return bool(is_beside[before].all() and is_beside[behind].all())


def _without_quotes(first: int, data: bytes, sep: str) -> tuple[bytes, bytes, str]:
    """Return rows that may have quotes in other places: the rows, the rows with zeros instead of
    quoted cells, and the beginning of a row whose quote is not closed."""
    if b' "' in data:
        data = _BEHIND_BLANKS[sep].sub(rb"\1", data)
    bare = _QUOTED[sep].sub(lambda match: b"0" * len(match[0]), data)
    for match in _OPEN_QUOTE[sep].finditer(bare) if b'"' in bare else ():
        start = bare.rfind(b"\n", 0, match.start()) + 1
        if is_comment(data[start : start + 100].decode(errors="ignore")):
            continue
        if _UNCLOSED.match(data, match.start()):
            return data[:start], bare[:start], data[start:-1].decode()
        raise _unclosed(first + data.count(b"\n", 0, start))
    return data, bare, ""


def _unclosed(line: int) -> TextError:
    return TextError(f"line {line}: a quote is not closed, or not at the end of its cell")


def _doubtful(
    account: Account, data: bytes, starts: Places, ends: Places, seps: Places
) -> list[int]:
    """Return the rows that must be examined one by one, because they do not begin like numbers, do
    not have as many cells as the header, or may repeat the header."""
    if not ends.size:
        return []
    signs = np.frombuffer(data, np.uint8)
    until = np.searchsorted(seps, ends)  # number of separators before the end of each row
    before = np.concatenate([[0], until[:-1]])
    is_doubtful = until - before != account.width - 1
    place = min(account.units.inputs, default=0)
    first = starts
    if place and seps.size:  # the first column is a name: test the first cell of an input, too
        is_doubtful |= _MAY_BE_OTHERWISE[_begin_of(starts, signs)]
        first = np.minimum(seps[np.minimum(before + place, seps.size) - 1] + 1, signs.size - 1)
    is_doubtful |= ~_BEGINS_NUMBER[_begin_of(first, signs)]
    # the row of units below a repeated header may begin like a number
    is_doubtful[0] |= bool(account.repeated)
    place = data.find(name := account.name.encode())
    while place >= 0:
        i = int(np.searchsorted(ends, place))
        is_doubtful[i : i + 2] = True
        place = data.find(name, int(ends[i])) if i < ends.size else -1
    doubtful: list[int] = np.flatnonzero(is_doubtful).tolist()
    return doubtful


def _begin_of(cells: Places, signs: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Return the first two bytes of the cells that begin at some positions, after a quote."""
    last = signs.size - 1
    first = cells + (signs[cells] == _QUOTE)
    second = np.minimum(first + 1, last)
    pairs: NDArray[np.uint16] = 256 * signs[np.minimum(first, last)].astype(np.uint16)
    pairs += signs[second]
    return pairs


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
                for rows in self._rows_of(self._start, last):
                    self.see_signs(rows)
        self._start = []

    def rows(self, report_place: Callable[[int], None] = lambda _place: None) -> Iterator[Rows]:
        """Yield the rows in pieces, and tell ``report_place`` how far a file has been read."""
        yield from self._rows_of(self._text(report_place), None)
        if self._rest:
            raise _unclosed(self._behind - self._rest.count("\n") - 1)

    def _rows_of(self, pieces: Iterable[Piece], last: int | None) -> Iterator[Rows]:
        """Yield the rows of pieces, up to the line ``last``."""
        self.account = self.layout.account(self._column_names, self._dialect)
        # the beginning of a row that continues after a piece, and the line after the piece
        self._rest, self._behind = "", self.layout.first
        ends = [line for line in (last, self.layout.last) if line is not None]
        end = min(ends, default=None)
        for piece in pieces:
            self._check(piece)
            first, text = _between(piece, self.layout.first, end)
            if text is None:
                continue
            if self._rest:
                first = self._behind - self._rest.count("\n") - 1
                text = f"{self._rest}\n{text}"
            self._behind = first + text.count("\n") + 1
            rows, self._rest = rows_in(first, text, self.account)
            if len(self._rest) > LONGEST:
                return
            yield rows

    def see_signs(self, rows: Rows) -> None:
        """Examine the numbers of some rows until they show their separators."""
        if b"." not in rows.data and b"," not in rows.data:
            return
        numbered = zip(range(rows.ends.size), rows.lines.tolist(), rows.cells(), strict=True)
        while not self.signs.decimal and (some := [*islice(numbered, _AT_ONCE)]):
            self.signs.see(
                Cell(line, name, cells[i])
                for j, line, cells in some
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
    for part in table.rows():
        numbers = part.lines.tolist()
        if len(lines) + len(numbers) > most.rows:
            where = f"line {numbers[most.rows - len(lines)]}"
            raise TextError(f"{where}: there are more than {most.rows:,} rows: average them")
        for i, cells in enumerate(part.cells()):
            if i in part.faults:
                wrong.append((numbers[i], f"line {numbers[i]} {part.faults[i][1]}"))
            else:
                lines.append(numbers[i])
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

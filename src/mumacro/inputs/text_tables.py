"""Read tables as people and rigs write them, in pieces, and whole tables in memory.

A line passes these modules: :mod:`mumacro.inputs.decoding` makes lines of bytes; ``layout`` finds
the separator and the header, ``column_units`` the units; ``account`` says what each line is and
cuts out the rows; ``numbers`` finds the decimal separator, and ``cells`` reads the numbers.
"""

import re
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mumacro.errors import TextError
from mumacro.inputs.account import Account, Rows, names_statistics, unclosed
from mumacro.inputs.cells import BLANKS, MOST_COLUMNS, Cell, Signs, numbers_of
from mumacro.inputs.decoding import LONGEST, NAMES, Piece, Text, byte_pieces
from mumacro.inputs.layout import LOOKED_AT, Dialect
from mumacro.inputs.names import ColumnNames, absent, find_heads
from mumacro.inputs.units import in_si, too_large_in_si
from mumacro.inputs.workbooks import BEGIN, SEP, read_sheet
from mumacro.kernel.arrays import Array

_WORDS = {",": "comma", ";": "semicolon", "|": "bar", "\t": "tab", BLANKS: "blanks"}
_WORDS_OF_SIGNS = {".": "point", ",": "comma"}
_BETWEEN = re.compile(r"[,;|\s]+")  # anything that separates cells
_OF_START = 2 * LOOKED_AT  # lines that are searched for the header, and for units below it
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
        lines = piece.lines
        if len(max(lines, key=len)) <= min(self.cell, self.columns):
            return
        for number, line in enumerate(lines, piece.first):
            if len(line) > self.cell and max(map(len, _BETWEEN.split(line))) > self.cell:
                raise TextError(f"line {number}: a cell may have up to {self.cell:,} characters")
            if len(line) > self.columns:
                cells = max(len(line.split()), 1 + max(line.count(sep) for sep in ",;|\t"))
                if cells > self.columns:
                    raise TextError(f"line {number}: there may be up to {self.columns:,} columns")


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
        most: Most | None = None,
    ) -> None:
        self._source, dialect, self._sheets = _sheet_in(source, column_names, dialect)
        self._most = most
        text, lines = Text(byte_pieces(self._source), dialect.encoding), list[str]()
        self._start = list[Piece]()  # first pieces of the text
        for piece in text.pieces():
            if most is not None:
                most.check(piece)
            self._start.append(piece)
            lines += piece.text.split("\n", _OF_START)[:_OF_START]
            if len(lines) >= LOOKED_AT:
                break
        self.account = Account(lines, column_names, dialect, text.encoding)
        decimal, sep = self.account.dialect.decimal, self.account.header.sep
        self.signs = Signs(decimal, dialect.thousands, sep, dialect.dashes)

    @property
    def read_as(self) -> str:
        """Return in a few words how the table was read, with the unit of each input, after it was
        read."""
        account, grouped = self.account, self.signs.grouped
        is_utf8 = account.encoding in ("", "utf-8", "utf-8-sig")
        words = [] if is_utf8 else [NAMES.get(account.encoding, account.encoding)]
        words += [_WORDS.get(account.header.sep, repr(account.header.sep))]
        words += ["decimal comma"] if self.signs.decimal == "," else []
        words += [f"{_WORDS_OF_SIGNS[grouped]} between thousands"] if grouped else []
        words += [f"header in line {account.header.start + 1}"] if account.header.start else []
        lines = sorted(account.units.lines)
        places = ", ".join(map(str, lines))
        words += [f"units in line{'s' * (len(lines) > 1)} {places}"] if lines else []
        words += [f"rows {account.first}..{account.last}"] if account.last else []
        units = (f"{name} [{unit}]" for name, unit in account.units.of_inputs().items())
        again = sorted(account.repeated)
        rest = f" and {len(again) - 5:,} more" if len(again) > 5 else ""
        places = f"{'s' * (len(again) > 1)} {', '.join(map(str, again[:5]))}{rest}"
        left_out = f"; the header again in line{places}, left out" if again else ""
        return f"{self._sheets}{', '.join(words)}; {', '.join(units)}{left_out}"

    def find_signs(self) -> None:
        """Search the first pieces for the separators of numbers, some rows at a time.  Skip this if
        columns are missing, because then that is reported."""
        parts = (part for piece in self._data_of(self._start) for part in piece.parts(_AT_ONCE))
        while self.account.has_names and not self.signs.decimal and (part := next(parts, None)):
            self.see_signs(self.account.rows_in(part))
        self._start = []

    def pieces(self) -> Iterator[Piece]:
        """Yield the lines from the first row on in pieces."""
        text = Text(byte_pieces(self._source), self.account.dialect.encoding)
        yield from self._data_of(text.pieces())
        if self.account.open:
            raise unclosed(self.account.begun)

    def _data_of(self, pieces: Iterable[Piece]) -> Iterator[Piece]:
        """Yield the lines of data."""
        self.account.open = []
        for piece in pieces:
            if self._most is not None:
                self._most.check(piece)
            data = piece.between(self.account.first, self.account.last)
            if data is not None:
                yield data

    def see_signs(self, rows: Rows) -> None:
        """Examine the numbers of some rows until they show their separators."""
        numbered = enumerate(zip(rows.lines, rows.cells(), strict=True))
        while not self.signs.decimal and (some := [*islice(numbered, _AT_ONCE)]):
            self.signs.see(
                Cell(line, name, cells[i])
                for j, (line, cells) in some
                if j not in rows.faults
                for i, name in self.account.units.inputs.items()
            )


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
        return Account(lines, column_names, dialect._replace(sep=SEP)).has_names

    data, said = read_sheet(source, dialect.sheet, dialect.decimal, has_names)
    return data, dialect._replace(sep=SEP, encoding="utf-8"), said


class TableOfNumbers(NamedTuple):
    """Hold the columns of numbers that were read."""

    columns: dict[str, Array]  #: by name, in SI, (n,)
    as_written: dict[str, Array]  #: the same in the units of the table
    units: dict[str, str]  #: unit of each column in the table; the SI unit if it has none
    lines: list[int]  #: line of each row
    skipped: list[int]  #: lines that are not empty, not the header, not units and not rows
    read_as: str  #: how the table was read, see :attr:`TextTable.read_as`


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
    table = TextTable(source, column_names, dialect, most)
    account, signs, input_of = table.account, table.signs, column_names.input_of
    columns, faults = find_heads(account.units.heads, input_of)
    missing = [
        group[0] for group in column_names.required_groups if not columns.keys() & set(group)
    ]
    if missing:
        faults.append(absent(missing, account.units.heads))
    if faults:
        raise TextError.of([f"line {account.header.start + 1}: {fault}" for fault in faults])
    lines, rows, wrong = list[int](), list[list[str]](), list[tuple[int, str]]()
    skipped = account.skipped
    for part in map(account.rows_in, table.pieces()):
        skipped += part.skipped
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
        raise TextError(f"line {account.header.start + 1}: no row follows the names of the columns")
    _refuse_named_statistics(account, lines, rows)
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
    units = account.units.of_inputs()
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

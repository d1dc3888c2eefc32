"""Read tables as people and rigs write them: find the layout in the first lines, then account for
each record.

A line is before the header, the header, units, data, a comment, a ruler or empty.  Any other line
(another header, another segment, a row of statistics) is refused with its number and with the
option that leaves it out.

A line passes these modules: :mod:`mumacro.inputs.decoding` makes lines of bytes; ``cells`` makes
records of lines; ``layout`` finds the separator, the header and the units; this module says what
each record is; ``cells`` finds the decimal separator, and reads the numbers.
"""

import enum
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

from mumacro.errors import TextError
from mumacro.inputs.cells import (
    BLANKS,
    COMMENT,
    GAPS,
    MOST_COLUMNS,
    Cell,
    Record,
    Signs,
    is_comment,
    joined,
    may_be_value,
    records,
    split_header,
    split_row,
    starts_as_number,
    unclosed,
    uncommented,
)
from mumacro.inputs.decoding import LONGEST, NAMES, Piece, Text, byte_pieces
from mumacro.inputs.layout import (
    END_OF_HEADER,
    LOOKED_AT,
    ColumnUnits,
    Dialect,
    Header,
    find_header,
)
from mumacro.inputs.names import ColumnNames, find_heads
from mumacro.inputs.workbooks import BEGIN, SEP, read_sheet

_WORDS = {",": "comma", ";": "semicolon", "|": "bar", "\t": "tab", BLANKS: "blanks"}
_WORDS_OF_SIGNS = {".": "point", ",": "comma"}
_BETWEEN = re.compile(r"[,;|\s]+")  # anything that separates cells
# first words of a row of statistics, in lower case
_STATISTICS = re.compile(
    r"(?:mean|average|avg|median|mittel(?:wert)?|mw|moyenne|min(?:imum)?|max(?:imum)?|sum|total"
    r"|summe|range|spannweite|variance|varianz|cov|cv|s\.?d\.?|rsd|count"
    r"|st(?:andar)?d\.?[ _-]?(?:dev(?:iation)?\.?|err(?:or)?\.?)?|st\.?[ _-]?dev(?:iation)?\.?"
    r"|standardabweichung|stabw"
    r"|[ée]cart[ -]type)(?:\.? ?(?:value|wert|of .{1,20}))?\W*"
)
#: what may begin a comment or a row of statistics, for a quick look at texts
NO_ROW = rf"^\s*(?:{'|'.join(map(re.escape, COMMENT))}|{_STATISTICS.pattern}$)"
_DIGITS = frozenset("0123456789")
# a line drawn between rows has only these characters, some of them together
_OF_RULER, _RULER = "-=_+|: \t,;", re.compile(r"-{4}|={3}|\+-{2}|\|:?-{3}")
_EXCERPT = 500  # characters that are kept of a refused row
_BETWEEN_BLANKS = re.compile(r'"[^"]*"|\S+')


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


class Line(enum.Enum):
    """Name what a record that is no row may be."""

    EMPTY, LEFT_OUT, REPEATED = range(3)  #: repeated is the header, or its units


class TableRow(NamedTuple):
    """Hold a row as text."""

    text: str  #: with as many cells as the header, which are empty if there is a fault
    fault: str = ""  #: why it does not belong to this table


class Rows(NamedTuple):
    """Hold rows of a table in order."""

    lines: Sequence[int]  #: the line of the file in which each row begins
    share: float = 1.0  #: fraction of the file that is read after them
    texts: list[str] = []  # noqa: RUF012 - never changed
    sep: str = ""
    #: by the index of a row: its text in the file, and its fault
    faults: Mapping[int, tuple[str, str]] = {}
    #: lines between them that are neither rows nor empty
    skipped: Mapping[int, Line] = {}
    columns: Any = None  #: if they were read at once

    def cells(self) -> Iterator[list[str]]:
        """Yield the cells of each row."""
        return (split_row(text, self.sep) for text in self.texts)

    def written(self, sep: str) -> list[str]:
        """Return the rows as they are in the file.  With another separator, put cells in quotes
        where they need it."""
        return self.texts if sep == self.sep else [joined(cells, sep) for cells in self.cells()]


@dataclass(frozen=True)
class TextTable:
    """Hold how a table in a file or in bytes is written."""

    source: Path | bytes
    column_names: ColumnNames
    dialect: Dialect
    most: Most | None
    encoding: str
    sheets: str  #: what to say about the sheets of a workbook
    header: Header
    units: ColumnUnits
    signs: Signs
    sep: str  #: separator of the cells in rows, in which tabs replace blanks
    width: int  #: the number of columns
    first: int  #: the first line that may be data
    last: int | None  #: the last, if a person names it
    #: lines before it that are not empty, not the header and not units
    skipped: Mapping[int, Line] = field(default_factory=dict)

    def read_as(self, skipped: Mapping[int, Line]) -> str:
        """Return in a few words how the table was read, with the unit of each input; ``skipped``
        are lines between rows."""
        grouped, units = self.signs.grouped, self.units
        is_utf8 = self.encoding in ("", "utf-8", "utf-8-sig")
        words = [] if is_utf8 else [NAMES.get(self.encoding, self.encoding)]
        words += [_WORDS.get(self.header.sep, repr(self.header.sep))]
        words += ["decimal comma"] if self.signs.decimal == "," else []
        words += [f"{_WORDS_OF_SIGNS[grouped]} between thousands"] if grouped else []
        words += [f"header in line {self.header.start + 1}"] if self.header.start else []
        words += [f"units in {_listed(units.lines)}"] if units.lines else []
        words += [f"rows {self.first}..{self.last}"] if self.last else []
        of_inputs = ", ".join(f"{name} [{unit}]" for name, unit in units.of_inputs().items())
        lines = [i for i, what in {**self.skipped, **skipped}.items() if what is Line.REPEATED]
        again = f"; the header again in {_listed(lines)}, left out" if lines else ""
        return f"{self.sheets}{', '.join(words)}; {of_inputs}{again}"

    # --- rows -------------------------------------------------------------------------------------

    def rows(self, columns_of: Callable[[str], Any] = lambda _text: None) -> Iterator[Rows]:
        """Yield the rows in pieces.  Account for each record of a piece, unless ``columns_of``
        returns columns in which each line is a row."""
        begun: Record | None = None
        text = Text(byte_pieces(self.source), self.dialect.encoding)
        for whole in text.pieces():
            if self.most:
                self.most.check(whole)
            piece = self.data_in(whole)
            if piece is None:
                continue
            if begun:
                piece = Piece(begun.line, f"{begun.text}\n{piece.text}", piece.share)
            columns = columns_of(piece.text)
            texts = piece.lines if columns else []
            if columns and len(columns[0]) == len(texts):
                lines = range(piece.first, piece.first + len(texts))
                rows, begun = Rows(lines, piece.share, texts, self.sep, columns=columns), None
            else:
                rows, begun = self.account_for(piece)
            if begun and len(begun.text) > LONGEST:
                break
            yield rows
        if begun:
            raise unclosed(begun.line)

    def data_in(self, piece: Piece) -> Piece | None:
        """Return the lines of data in a piece, with tabs in place of the blanks that separate
        cells, or None if it has none."""
        data = piece.between(self.first, self.last)
        if data is None or self.header.sep != BLANKS:
            return data
        cells = (_BETWEEN_BLANKS.findall(x) if '"' in x else x.split() for x in data.lines)
        return data._replace(text="\n".join(map("\t".join, cells)))

    def account_for(self, piece: Piece) -> tuple[Rows, Record | None]:
        """Return the rows in some lines, and the record that goes on behind them."""
        lines, texts = list[int](), list[str]()
        faults, skipped = dict[int, tuple[str, str]](), dict[int, Line]()
        rows, begun = Rows(lines, piece.share, texts, self.sep, faults, skipped), None
        for record in records(piece, self.sep, self.is_comment):
            if record.is_open:
                begun = record
                break
            what = self.account(record)
            if isinstance(what, TableRow):
                if what.fault:
                    text = record.text
                    excerpt = text if len(text) <= _EXCERPT else f"{text[:_EXCERPT]}…"
                    faults[len(texts)] = excerpt, what.fault
                lines.append(record.line)
                texts.append(what.text)
            elif what is not Line.EMPTY:
                skipped[record.line] = what
        return rows, begun

    # --- what a record is -------------------------------------------------------------------------

    def account(self, record: Record) -> TableRow | Line:
        """Return what a record is.  Raise TextError if it has no meaning at all."""
        line, text, _ = record
        sep, width, inputs = self.sep, self.width, self.units.inputs
        if 0 in inputs and '"' not in text:  # most rows need no closer look
            cells = text.split(sep, width)
            if len(cells) == width and all(cells[i].lstrip("+-.")[:1] in _DIGITS for i in inputs):
                return TableRow(text)
        if text.count(sep) > 2 * width + 1000 and not is_comment(text):  # too long to be split
            return self._irregular(text.count(sep) + 1)
        cells = split_row(text, sep)
        filled = [cell.strip() for cell in cells if cell.strip()]
        if not filled:
            return Line.EMPTY
        if self._repeats_header(line, text):
            return Line.REPEATED
        if is_comment(text) and (len(cells) != width or self.is_comment(text)):
            if "\n" in text:
                raise TextError(f"line {line}: a quote in a comment is not closed: leave it out")
            self.units.take(line, text)
            return Line.LEFT_OUT
        if not text.strip(_OF_RULER) and _RULER.search(text):
            return Line.LEFT_OUT
        if names_statistics(filled[0]):
            what = f"{filled[0]!r} begins a row of statistics"
            raise TextError(f"line {line}: {what}: {self.remedy(line)}")
        values = [cells[i].strip() for i in inputs if i < len(cells) and cells[i].strip()]
        may_be_units = all(not starts_as_number(cell) or cell == "1" for cell in values)
        if may_be_units and self.units.take_row(line, text, is_no_row=True):
            return Line.REPEATED
        # a row without any value is a row with gaps if it is complete and more than a title
        is_complete = len(cells) == width and len(filled) > 1
        if not any(map(may_be_value, values or filled[:1])) and (values or not is_complete):
            shown = " ".join(text.split())[:60]
            remedy = self.remedy(line)
            raise TextError(f"line {line}: {shown!r} is neither a row nor a comment: {remedy}")
        if len(cells) > width and not any(map(str.strip, cells[width:])):
            return TableRow(joined(cells[:width], sep))
        # rows of LabVIEW may end before the last column
        if self.dialect.labview and self.units.names[len(cells) :] == ["Comment"]:
            return TableRow(text + sep)
        return TableRow(text) if len(cells) == width else self._irregular(len(cells))

    def _irregular(self, count: int) -> TableRow:
        """Return a row that has this number of cells."""
        cells = "cell" if count == 1 else "cells"
        names = ": name every column, also that of the row numbers"
        fault = f"has {count:,} {cells}, the header has {self.width:,}"
        return TableRow(self.sep * (self.width - 1), fault + names * (count == self.width + 1))

    def is_comment(self, text: str) -> bool:
        """Return whether a text is a comment, and not the beginning of a row whose first cell is a
        name such as #1, or a gap such as #NV."""
        if not is_comment(text):
            return False
        first, *rest = split_row(text, self.sep)
        may_begin_row = 0 not in self.units.inputs or first.strip().lower() in GAPS
        return not (may_begin_row and any(map(starts_as_number, rest)))

    def _repeats_header(self, line: int, text: str) -> bool:
        """Return whether a line repeats the header.  Raise TextError if it is a different header,
        or begins a new segment of LabVIEW."""
        if self.dialect.labview and text.startswith(END_OF_HEADER):
            raise TextError(f"line {line} begins another segment: {self.remedy(line)}")
        if not self.column_names.may_be_in(text):
            return False
        header, units = self.header, self.units
        cells = split_header(uncommented(text), header.sep)
        if cells[: len(header.cells)] == header.cells:
            return True
        columns = self.column_names.heads_in(cells)[: self.width]
        if not columns:
            return False
        if [name for name, _ in columns] == units.names and all(
            units.agrees(i, columns[i][1]) for i in units.inputs
        ):
            return True
        what = "is another header, with other names or units"
        raise TextError(f"line {line} {what}: {self.remedy(line)}")

    def remedy(self, line: int) -> str:
        """Return the remedy for a line that does not belong to the rows."""
        dashes = self.dialect.dashes
        if not dashes:
            return "give the rows alone"
        if self.units.remedy and line > self.first:  # the rows have begun
            return f"{dashes}rows {self.first}..{line - 1} reads those before it"
        return f"{dashes}rows A..B says which lines are data"


# --- the layout -----------------------------------------------------------------------------------


def find_table(
    source: Path | bytes, column_names: ColumnNames, dialect: Dialect, most: Most | None = None
) -> TextTable:
    """Return how a table is written, from its first lines.  Every piece of it is checked before it
    is split.

    After the header come units and comments; then the rows begin.  Raise TextError if the source is
    not a table as text, if there is no line at all, if units belong to no column or contradict each
    other, or if there are rows before the header.
    """
    source, dialect, sheets = _sheet_in(source, column_names, dialect)
    text, lines = Text(byte_pieces(source), dialect.encoding), list[str]()
    begin, last = dialect.rows or (0, None)
    searched = max(2 * LOOKED_AT, begin)  # lines, for the header, and for units up to the rows
    for piece in text.pieces():
        if most:
            most.check(piece)
        lines += piece.text.split("\n", searched)[:searched]
        if len(lines) >= searched:
            break
    dialect = dialect.completed(lines)
    header = find_header(lines, column_names, dialect)
    while header.cells and not header.cells[-1]:
        header.cells.pop()
    units = ColumnUnits(header.cells, header.sep, column_names.input_of)
    table = TextTable(
        source,
        column_names,
        dialect,
        most,
        text.encoding,
        sheets,
        header,
        units,
        signs=dialect.signs,
        sep="\t" if header.sep == BLANKS else header.sep,
        width=len(units.names),
        first=max(begin, header.end + 1),
        last=last,
    )
    _, faults = find_heads(units.heads, column_names.input_of)
    if faults or not column_names.are_among(units.names):  # which is reported before any line
        return table
    if dialect.units is None:
        units.take_above(lines[: header.start], dialect.skip)
    else:
        cells = split_header(lines[dialect.units], header.sep)
        units.take_cells(dialect.units + 1, ["", *cells[1:]])
    for i in range(header.end, min(table.first - 1, len(lines))):
        units.take(i + 1, lines[i])
    first, found = _first_row(table, Piece(1, "\n".join(lines)))
    skipped = {
        i: found.get(i, Line.LEFT_OUT)
        for i, line in enumerate(lines[: first - 1], 1)
        if line.strip() and i not in units.lines and not header.start < i <= header.end
    }
    table = replace(table, first=first, skipped=skipped)
    units.remedy = table.remedy
    first_rows = Piece(1, "\n".join(lines[: first - 1 + LOOKED_AT]))
    return replace(table, signs=_signs_in(table, first_rows))


def _first_row(table: TextTable, start: Piece) -> tuple[int, dict[int, Line]]:
    """Return the line of the first row, and what the lines before it are.  Take their units."""
    data, found = table.data_in(start), dict[int, Line]()
    for record in records(data, table.sep, table.is_comment) if data else ():
        what = None if record.is_open else table.account(record)
        if not isinstance(what, Line):
            return record.line, found
        found[record.line] = what
    return max(table.first, len(start.lines) + 1), found


def _signs_in(table: TextTable, start: Piece) -> Signs:
    """Return the separators in numbers, from the first lines, or else from the first rows that
    show them."""
    data, shown = table.data_in(start), table.signs

    def without_signs(text: str) -> list[range] | None:
        """Return a column of rows if no number has a separator, so that no row needs a look."""
        signs = (".", '"', "\n\n", *"," * (table.sep != ","))
        return None if any(sign in text for sign in signs) else [range(text.count("\n") + 1)]

    for rows in chain([table.account_for(data)[0]] if data else [], table.rows(without_signs)):
        if rows.columns:
            continue
        shown = table.signs.shown_by(
            (
                Cell(line, name, cells[i])
                for j, (line, cells) in enumerate(zip(rows.lines, rows.cells(), strict=True))
                if j not in rows.faults
                for i, name in table.units.inputs.items()
            ),
            table.sep,
            table.dialect.dashes,
        )
        if shown.decimal:
            break
    return shown


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
    in_text = dialect._replace(sep=SEP, encoding="utf-8")

    def has_names(lines: list[str]) -> bool:
        return bool(column_names.heads_in(find_header(lines, column_names, in_text).cells))

    data, said = read_sheet(source, dialect.sheet, dialect.decimal, has_names)
    return data, in_text, said


def names_statistics(text: str) -> bool:
    """Return whether a text is the first word of a row of statistics.

    >>> names_statistics("Std. dev."), names_statistics("motor")
    (True, False)
    """
    return len(text) < 40 and _STATISTICS.fullmatch(text.lower()) is not None


def _listed(lines: Iterable[int]) -> str:
    """Return the first numbers of some lines.

    >>> _listed([7]), _listed(range(1, 9))
    ('line 7', 'lines 1, 2, 3, 4, 5 and 3 more')
    """
    numbers = sorted(lines)
    rest = f" and {len(numbers) - 5:,} more" if len(numbers) > 5 else ""
    return f"line{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers[:5]))}{rest}"

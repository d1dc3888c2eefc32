"""Read tables as people and rigs write them, in pieces: say what each line is, and cut out the
rows.

A line is before the header, the header, units, data, a comment, a ruler or empty.  Any other line
(another header, another segment, a row of statistics) is refused with its number and with the
option that leaves it out.

A line passes these modules: :mod:`mumacro.inputs.decoding` makes lines of bytes; ``layout`` finds
the separator, the header and the units; this module cuts out the rows; ``cells`` finds the decimal
separator, and reads the numbers.
"""

import csv
import enum
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from mumacro.errors import TextError
from mumacro.inputs.cells import (
    BLANKS,
    COMMENT,
    GAPS,
    MOST_COLUMNS,
    Cell,
    Signs,
    is_comment,
    joined,
    may_be_value,
    split_header,
    split_row,
    starts_as_number,
    uncommented,
)
from mumacro.inputs.decoding import LONGEST, NAMES, Piece, Text, byte_pieces
from mumacro.inputs.layout import (
    END_OF_HEADER,
    LOOKED_AT,
    ColumnUnits,
    Dialect,
    find_header,
    whole,
)
from mumacro.inputs.names import ColumnNames
from mumacro.inputs.workbooks import BEGIN, SEP, read_sheet

_WORDS = {",": "comma", ";": "semicolon", "|": "bar", "\t": "tab", BLANKS: "blanks"}
_WORDS_OF_SIGNS = {".": "point", ",": "comma"}
_BETWEEN = re.compile(r"[,;|\s]+")  # anything that separates cells
_AT_ONCE = 2_000  # lines that are searched for the decimal separator at a time
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
_ABOVE = 4  # units may be within this number of lines above the names
_EXCERPT = 500  # characters that are kept of a refused row
_BETWEEN_BLANKS = re.compile(r'"[^"]*"|\S+')
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
    """Name what a line after the header may be."""

    ROW, EMPTY, LEFT_OUT = range(3)


class Rows(NamedTuple):
    """Hold rows of a table in order, as text: each has as many cells as the header."""

    lines: Sequence[int]  #: the line of the file in which each row begins
    texts: list[str] = []  # noqa: RUF012 - never changed
    sep: str = ""
    #: by the index of a row: its text, and why it does not belong to this table; its cells are
    #: empty
    faults: Mapping[int, tuple[str, str]] = {}
    skipped: Sequence[int] = ()  #: lines between them that are neither rows nor empty

    def cells(self) -> Iterator[list[str]]:
        """Yield the cells of each row."""
        for line, text in zip(self.lines, self.texts, strict=True):
            try:
                yield split_row(text, self.sep)
            except csv.Error:
                raise _too_long(line) from None

    def written(self, sep: str) -> list[str]:
        """Return the rows as they are in the file.  With another separator, put cells in quotes
        where they need it."""
        return self.texts if sep == self.sep else [joined(cells, sep) for cells in self.cells()]


class TextTable:
    """Hold how a table in a file or in bytes is written, from its first lines, and say what each of
    its lines is.

    After the header come units and comments; then the rows begin.  Raise TextError if the source is
    not a table as text, if there is no line at all, if units belong to no column or contradict each
    other, or if there are rows before the header.  Every piece is checked before it is split.
    """

    def __init__(
        self,
        source: Path | bytes,
        column_names: ColumnNames,
        dialect: Dialect,
        most: Most | None = None,
    ) -> None:
        self._source, dialect, self._sheets = _sheet_in(source, column_names, dialect)
        self._column_names, self._dashes, self._most = column_names, dialect.dashes, most
        self.open = list[str]()  #: the lines so far of a row that goes on
        self.begun = 0  #: the line in which it begins
        self.first = 0  #: the first line that may be data; 0 while it is searched
        self.last: int | None = None  #: the last, if a person names it
        text, lines = Text(byte_pieces(self._source), dialect.encoding), list[str]()
        # lines that are searched for the header, and for units up to the rows
        searched = max(2 * LOOKED_AT, dialect.rows[0] if dialect.rows else 0)
        self._start = list[Piece]()  # first pieces of the text
        for piece in self._data_of(text.pieces()):
            self._start.append(piece)
            lines += piece.text.split("\n", searched)[:searched]
            if len(lines) >= LOOKED_AT:
                break
        self.encoding = text.encoding
        self.dialect = dialect.completed(lines)
        self.header = header = find_header(lines, column_names, self.dialect)
        while header.cells and not header.cells[-1]:
            header.cells.pop()
        input_of = column_names.input_of
        self.units = ColumnUnits(header.cells, header.sep, input_of, self._remedy_of_units)
        self.has_names = column_names.are_among(self.units.names)
        self.width = len(self.units.names)
        #: separator of the cells in rows, after blanks were replaced by tabs
        self.sep = "\t" if header.sep == BLANKS else header.sep
        # rows of LabVIEW may end before the last column
        self._may_lack_last = self.dialect.labview and self.units.names[-1:] == ["Comment"]
        # every header has this name; most lines do not, so it is searched first
        groups = column_names.required_groups
        self.necessary_name = max(
            (names[0] for names in groups if len(names) == 1), key=len, default=""
        )
        self.repeated = set[int]()  #: lines that repeat the header or its units
        if self.dialect.units is not None:
            cells = split_header(lines[self.dialect.units], header.sep)
            self.units.take_cells(self.dialect.units + 1, ["", *cells[1:]])
        elif self.has_names:
            self._take_above(lines[: header.start])
        self.first = self._first_row(lines)
        self.last = dialect.rows[1] if dialect.rows else None
        #: lines before the data that are not empty, not the header and not units
        self.skipped = [
            i
            for i, line in enumerate(lines[: self.first - 1], 1)
            if line.strip() and i not in self.units.lines and not header.start < i <= header.end
        ]
        self.signs = Signs(self.dialect.decimal, dialect.thousands, header.sep, dialect.dashes)

    def _take_above(self, lines: Sequence[str]) -> None:
        """Take the units above the header: a row close to it, legends, and comments of ECSV."""
        units = self.units
        above = [i for i in reversed(range(self.dialect.skip, len(lines))) if lines[i].strip()]
        row = next((i for i in above[:_ABOVE] if units.take_row(i + 1, lines[i])), None)
        if any("%ECSV" in lines[i][:20] for i in above):
            units.take_ecsv(lines)
            return
        for i in reversed(above):
            if i != row:
                units.take_legend(i + 1, lines[i])

    def _first_row(self, lines: Sequence[str]) -> int:
        """Return the line of the first row, after the units and comments below the header."""
        rows, end = self.dialect.rows, self.header.end
        if not self.has_names:
            return rows[0] if rows else end + 1
        if rows:
            for i in range(end, min(rows[0] - 1, len(lines))):
                self.units.take(i + 1, lines[i])
            return max(rows[0], end + 1)
        for i in range(end, len(lines)):
            text = lines[i] if is_comment(lines[i]) else whole(lines, i)[0]
            try:
                is_row = self._is_plain(text) or self._what(i + 1, text) is Line.ROW
            except csv.Error:
                raise _too_long(i + 1) from None
            if is_row:
                self.units.rows_begun = True
                return i + 1
        return max(len(lines), end) + 1

    def find_signs(self) -> None:
        """Search the first pieces for the separators of numbers, some lines at a time.  Skip this
        if columns are missing, because then that is reported."""
        start, self._start = self._start, []
        for piece in self._data_of(start) if self.has_names else ():
            for part in piece.parts(_AT_ONCE):
                if self.signs.decimal:
                    return
                self.see_signs(self.rows_in(part))

    def see_signs(self, rows: Rows) -> None:
        """Examine the numbers of some rows, unless they have shown their separators."""
        if not self.signs.decimal:
            self.signs.see(
                Cell(line, name, cells[i])
                for j, (line, cells) in enumerate(zip(rows.lines, rows.cells(), strict=True))
                if j not in rows.faults
                for i, name in self.units.inputs.items()
            )

    @property
    def read_as(self) -> str:
        """Return in a few words how the table was read, with the unit of each input, after it was
        read."""
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
        again = f"; the header again in {_listed(self.repeated)}, left out" if self.repeated else ""
        return f"{self._sheets}{', '.join(words)}; {of_inputs}{again}"

    # --- rows -------------------------------------------------------------------------------------

    def pieces(self) -> Iterator[Piece]:
        """Yield the lines from the first row on in pieces."""
        text = Text(byte_pieces(self._source), self.dialect.encoding)
        yield from self._data_of(text.pieces())
        if self.open:
            raise unclosed(self.begun)

    def _data_of(self, pieces: Iterable[Piece]) -> Iterator[Piece]:
        """Yield the lines of data."""
        self.open = []
        for piece in pieces:
            if self._most is not None:
                self._most.check(piece)
            data = piece.between(self.first, self.last)
            if data is not None:
                yield data

    def rows_in(self, piece: Piece) -> Rows:
        """Return the rows in some lines, each of which is accounted for."""
        lines, texts = list[int](), list[str]()
        faults, skipped = dict[int, tuple[str, str]](), list[int]()
        for number, line in enumerate(piece.lines, piece.first):
            if not line and not self.open:  # there may be millions
                continue
            if self.header.sep == BLANKS:
                cells = _BETWEEN_BLANKS.findall(line) if '"' in line else line.split()
                line = self.sep.join(cells)
            self.begun = self.begun if self.open else number
            try:
                text = self._whole_row(line) if self.open or '"' in line else line
                if text is None:
                    continue
                what, row, fault = self._row(self.begun, text)
            except csv.Error:
                raise _too_long(self.begun) from None
            if what is Line.ROW:
                self.units.rows_begun = True
                if fault is not None:
                    excerpt = text if len(text) <= _EXCERPT else f"{text[:_EXCERPT]}…"
                    faults[len(texts)] = excerpt, fault
                texts.append(row)
                lines.append(self.begun)
            elif what is not Line.EMPTY:
                skipped.append(self.begun)
        if sum(map(len, self.open)) > LONGEST:
            raise unclosed(self.begun)
        return Rows(lines, texts, self.sep, faults, skipped)

    def _whole_row(self, line: str) -> str | None:
        """Return the row that ends with a line with quotes, or None if it goes on, because a quoted
        cell has a line end.  Raise TextError if a quote is not at the end of its cell."""
        sep, end = self.sep, 0
        if self.open:
            closing = _CLOSING.match(line)
            if closing is None:
                self.open.append(line)
                return None
            end = closing.end()
        elif is_comment(line) and not self._may_begin_row(line):
            return line
        rest = line[end:]
        rest = _BEHIND_BLANKS[sep].sub(r"\1", rest) if ' "' in rest else rest
        bare = _QUOTED[sep].sub(lambda match: "0" * len(match[0]), rest)
        quote = _OPEN_QUOTE[sep].search(bare)
        if (end and rest and rest[0] != sep) or (
            quote and not _UNCLOSED.match(rest, quote.start())
        ):
            raise unclosed(self.begun)
        if quote:
            self.open.append(line[:end] + rest)
            return None
        row = "\n".join([*self.open, line[:end] + rest])
        self.open = []
        return row

    def _row(self, line: int, text: str) -> tuple[Line, str, str | None]:
        """Return what a line is, and for a row its text with as many cells as the header, and its
        fault."""
        width, empty = self.width, self.sep * (self.width - 1)
        if self._is_plain(text):
            return Line.ROW, text, None
        if text.count(self.sep) > 2 * width + 1000 and not is_comment(text):  # too long to be split
            return Line.ROW, empty, _irregular(text.count(self.sep) + 1, width)
        what = self._what(line, text)
        if what is not Line.ROW:
            return what, text, None
        cells = split_row(text, self.sep)
        if len(cells) == width:
            return what, text, None
        if len(cells) > width and not any(map(str.strip, cells[width:])):
            return what, joined(cells[:width], self.sep), None
        if len(cells) == width - 1 and self._may_lack_last:
            return what, text + self.sep, None
        return what, empty, _irregular(len(cells), width)

    def _is_plain(self, text: str) -> bool:
        """Return whether a line needs no closer look, as most rows do: all inputs begin like
        numbers, and so does the first cell."""
        if 0 not in self.units.inputs or '"' in text:
            return False
        cells = text.split(self.sep, self.width)
        return len(cells) == self.width and all(
            cells[i].lstrip("+-.")[:1] in _DIGITS for i in self.units.inputs
        )

    # --- other lines ------------------------------------------------------------------------------

    def remedy(self, line: int) -> str:
        """Return the remedy for a line that does not belong to the rows."""
        if not self._dashes:
            return "give the rows alone"
        if self.first and line > self.first:
            return f"{self._dashes}rows {self.first}..{line - 1} reads those before it"
        return f"{self._dashes}rows A..B says which lines are data"

    def _what(self, line: int, text: str) -> Line:
        """Return what a line is.  Raise TextError if it has no meaning at all."""
        if not text.strip(f" \t{self.header.sep}"):
            return Line.EMPTY
        if self._may_be_header(text) and self._repeats_header(line, text):
            return self._again(line)
        if is_comment(text) and not (
            self._may_begin_row(text) and len(self._cells(text)) == self.width
        ):
            if "\n" in text:
                raise TextError(f"line {line}: a quote in a comment is not closed: leave it out")
            self.units.take(line, text)
            return Line.LEFT_OUT
        if not text.strip(_OF_RULER) and _RULER.search(text):
            return Line.LEFT_OUT
        cells = [cell.strip() for cell in self._cells(text)]
        first = next((cell for cell in cells if cell), "")
        if not first:  # a blank line whose cells are in quotes
            return Line.EMPTY
        if names_statistics(first):
            what = f"{first!r} begins a row of statistics"
            raise TextError(f"line {line}: {what}: {self.remedy(line)}")
        filled = [cells[i] for i in self.units.inputs if i < len(cells) and cells[i]]
        may_be_units = all(not starts_as_number(cell) or cell == "1" for cell in filled)
        if may_be_units and self.units.take_row(line, text, is_no_row=True):
            return self._again(line) if self.first else Line.LEFT_OUT
        if not self._holds_values(cells, filled):
            shown = " ".join(text.split())[:60]
            remedy = self.remedy(line)
            raise TextError(f"line {line}: {shown!r} is neither a row nor a comment: {remedy}")
        return Line.ROW

    def _again(self, line: int) -> Line:
        """Account for a line that repeats the header or its units."""
        self.repeated.add(line)
        return Line.LEFT_OUT

    def _holds_values(self, cells: Sequence[str], filled: Sequence[str]) -> bool:
        """Return whether some of the ``filled`` cells of inputs may be a value.  A row without any
        value is a row with gaps if it is complete and more than a title."""
        if filled:
            return any(map(may_be_value, filled))
        texts = [*filter(None, cells)]
        return may_be_value(texts[0]) or (len(cells) == self.width and len(texts) > 1)

    def _cells(self, text: str) -> list[str]:
        """Return the cells of a line, which may still have blanks between them."""
        if self.header.sep == BLANKS and self.sep not in text:
            return split_header(text, BLANKS)
        return split_row(text, self.sep)

    def _may_begin_row(self, text: str) -> bool:
        """Return whether a line that begins like a comment may be a row whose first cell is a name
        such as #1, or a gap such as #NV."""
        first = _BETWEEN.split(text.strip(), maxsplit=1)[0]
        if 0 in self.units.inputs and first.lower() not in GAPS:
            return False
        return any(map(starts_as_number, self._cells(text)[1:]))

    def _remedy_of_units(self, line: int) -> str:
        return "leave one of them out" if not self.first else self.remedy(line)

    def _may_be_header(self, text: str) -> bool:
        """Return whether a text has all names that a header needs, or begins a new segment of
        LabVIEW."""
        if self.dialect.labview and END_OF_HEADER in text:
            return True
        return self.necessary_name in text and self._column_names.may_be_in(text)

    def _repeats_header(self, line: int, text: str) -> bool:
        """Return whether a line repeats the header.  Raise TextError if it is a different
        header."""
        if text.startswith(END_OF_HEADER):
            raise TextError(f"line {line} begins another segment: {self.remedy(line)}")
        header, units = self.header, self.units
        cells = split_header(uncommented(text), header.sep)
        if cells[: len(header.cells)] == header.cells:
            return True
        columns = self._column_names.heads_in(cells)[: self.width]
        if not columns:
            return False
        if [name for name, _ in columns] == units.names and all(
            units.agrees(i, columns[i][1]) for i in units.inputs
        ):
            return True
        what = "is another header, with other names or units"
        raise TextError(f"line {line} {what}: {self.remedy(line)}")


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


def _irregular(count: int, width: int) -> str:
    """Return what is wrong with a row that has this number of cells."""
    cells = "cell" if count == 1 else "cells"
    names = ": name every column, also that of the row numbers" if count == width + 1 else ""
    return f"has {count:,} {cells}, the header has {width:,}{names}"


def _too_long(line: int) -> TextError:
    """Return the error for a row with a cell in quotes that the reader of CSV does not take."""
    most = f"{csv.field_size_limit():,}"
    return TextError(f"line {line}: a cell in quotes may have up to {most} characters")


def unclosed(line: int) -> TextError:
    """Return the error for a row with a quote that does not end its cell."""
    return TextError(f"line {line}: a quote is not closed, or not at the end of its cell")

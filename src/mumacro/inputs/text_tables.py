"""The rows of tables as people and rigs write them, and their numbers.

Every line of a table is accounted for: it is before the head, the head, units, data, a comment or
empty (:mod:`mumacro.inputs.layout` finds how it is written).  What cannot be is refused by its
line: another head, another segment, a row of statistics.  :func:`read_table` reads a table into
memory; files of any length are read in pieces (:mod:`mumacro.files.text_source`).
"""

import csv
import math
import re
from collections.abc import Callable, Iterator, Mapping
from itertools import chain, islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mumacro.inputs.decoding import LONGEST, Piece, Text, TextError, file_pieces
from mumacro.inputs.fields import QUANTITY_OF, RIGID
from mumacro.inputs.headings import absent, absent_together, find_heads, heading, unit_in_si
from mumacro.inputs.layout import (
    BLANKS,
    END_OF_HEADER,
    GAPS,
    LOOKED_AT,
    MOST_COLUMNS,
    ColumnNames,
    Dialect,
    Layout,
    find_layout,
    is_comment,
    is_known,
    is_number,
    is_unit,
    legend,
    may_be_row,
    split,
    uncommented,
    units_in,
)
from mumacro.inputs.numbers import TOO_LARGE, read_number, split_number, tidy
from mumacro.inputs.signs import Cell, Signs
from mumacro.inputs.units import Scale, scale_of, split_unit
from mumacro.inputs.workbooks import BEGIN, SEP, read_sheet
from mumacro.kernel.arrays import Array

SI_UNIT = Scale()
_QUOTED = re.compile(r'"([^"]*)"|(?:[^\s\[\]()"]|\[[^\[\]]*\]|\([^()]*\)|[\[\]()"])+')
_BETWEEN = re.compile(r"[,;|\s]+")  # whatever separates cells
# what a row of statistics begins with, in small letters
_STATISTICS = re.compile(
    r"(?:mean|average|avg|median|mittel(?:wert)?|mw|moyenne|min(?:imum)?|max(?:imum)?|sum|total"
    r"|summe|range|spannweite|variance|varianz|cov|cv|s\.?d\.?|rsd|count"
    r"|st(?:andar)?d\.?[ _-]?(?:dev(?:iation)?\.?|err(?:or)?\.?)?|st\.?[ _-]?dev(?:iation)?\.?"
    r"|standardabweichung|stabw"
    r"|[ée]cart[ -]type)(?:\.? ?(?:value|wert|of .{1,20}))?\W*"
)
#: the first two letters of each of these
BEGIN_OF_STATISTICS = frozenset(
    (
        *("me", "av", "mi", "mw", "mo", "ma", "su", "to", "ra"),
        *("sp", "va", "co", "cv", "sd", "rs", "st", "ec", "s."),
    )
)
_WITH_POINTS = str.maketrans(",.", ".?")
_OF_NUMBERS = re.compile(r"[0-9eE+\-.\n]*")  # the signs of plain numbers, line by line


class Most(NamedTuple):
    """The largest table that is read."""

    rows: int = 1_000_000
    columns: int = MOST_COLUMNS
    cell: int = LONGEST  #: characters

    def check(self, piece: Piece) -> None:
        """Check lines before they are taken apart, whatever separates their cells: TextError for
        one with too many cells or too long a cell.

        >>> Most(cell=3).check(Piece(7, ["a,b", "a,abcd"]))
        Traceback (most recent call last):
        mumacro.inputs.decoding.TextError: line 8: a cell may have up to 3 characters
        """
        for number, line in enumerate(piece.lines, piece.first):
            if len(line) > self.cell and max(map(len, _BETWEEN.split(line))) > self.cell:
                raise TextError(f"line {number}: a cell may have up to {self.cell:,} characters")
            if len(line) > self.columns:
                cells = max(len(line.split()), 1 + max(line.count(sep) for sep in ",;|\t"))
                if cells > self.columns:
                    raise TextError(f"line {number}: there may be up to {self.columns:,} columns")


class Record(NamedTuple):
    """A row of a table."""

    line: int  #: where it begins, as an editor counts
    cells: list[str]
    fault: str | None = None  #: why it is no row of this table
    text: str = ""  #: as it stands there
    is_whole: bool = True  #: whether the text has the cells and no others


def begin(
    text: Text,
    column_names: ColumnNames,
    dialect: Dialect,
    check: Callable[[Piece], None] = lambda _piece: None,
) -> tuple[Layout, Iterator[tuple[int, str]]]:
    """Find how a text is written; return that and the numbered lines of data.  Every piece is
    checked before it is taken apart."""
    start = list[str]()
    for piece in text:
        check(piece)
        start += piece.lines
        if len(start) >= LOOKED_AT:
            break

    def following() -> Iterator[str]:
        for piece in text:
            check(piece)
            yield from piece.lines

    layout = find_layout(Piece(1, start), column_names, dialect, text.encoding)
    lines = islice(chain(start, following()), layout.first - 1, layout.last)
    return layout, iter(enumerate(lines, layout.first))


# --- its rows -------------------------------------------------------------------------------------


class Account:
    """What each line of data is; TextError for one that cannot be any of it."""

    def __init__(self, layout: Layout, column_names: ColumnNames) -> None:
        self._layout, self._column_names = layout, column_names
        self._names = [split_unit(head)[0] for head in layout.heads]
        self._units = {
            name: scale_of(column_names.like[name], split_unit(layout.heads[i])[1] or "")
            for i, name in layout.inputs.items()
        }
        self._first_is_input = 0 in layout.inputs
        # every head has this name: looked for first, as most lines lack it
        groups = column_names.required_groups
        self._name = max((names[0] for names in groups if len(names) == 1), key=len, default="")
        self.repeated: list[int] = []  #: lines that have the head or its units again
        self.skipped: list[int] = []  #: those, and comments

    def may_be_data(self, line: int, text: str) -> bool:
        """Whether a line is neither empty nor a comment; a name such as #1 in the first column
        makes no comment of a row that is whole."""
        layout = self._layout
        if not text.strip(f" \t{layout.sep}"):
            return False
        if not is_comment(text) or (
            not self._first_is_input and may_be_row(text, layout.sep, len(layout.heads))
        ):
            return True
        self.skipped.append(line)
        if self.may_be_head(text) and self._repeats_head(line, text):
            self.repeated.append(line)
            return False
        self._check_comment(line, text)
        return False

    def may_be_head(self, text: str) -> bool:
        """Whether a text has all names that a head needs, or begins another segment of LabVIEW."""
        if self._layout.labview and END_OF_HEADER in text:
            return True
        if self._name not in text:
            return False
        groups = self._column_names.required_groups
        return all(any(name in text for name in names) for names in groups)

    def is_row(self, line: int, text: str, cells: list[str]) -> bool:
        """Whether a line of cells is a row; False for the head or its units again."""
        first = next((cell for cell in cells if cell.strip()), "").strip()
        if self.may_be_head(text) and self._repeats_head(line, text):
            self.repeated.append(line)
            self.skipped.append(line)
            return False
        if first[:1].isdigit() and not (self.repeated and self.repeated[-1] == line - 1):
            return True
        if len(first) < 40 and _STATISTICS.fullmatch(first.lower()):
            remedy = self._layout.without(line)
            raise TextError(f"line {line}: {first!r} begins a row of statistics: {remedy}")
        inputs = [cells[i] for i in self._layout.inputs if i < len(cells)]
        may_be_units = not any(is_number(cell) and cell.strip(" []()") != "1" for cell in inputs)
        if may_be_units and self._has_units(line, text):
            return False
        width = len(self._layout.heads)
        is_whole = len(cells) in (width, width - self._layout.without_comments)
        filled = [cell for cell in map(str.strip, cells[:1000]) if cell]
        is_title = len(filled) == 1 and width > 1 and not is_number(first)
        if is_title or (
            not is_whole and not any(is_number(cell) or cell.lower() in GAPS for cell in filled)
        ):
            shown = " ".join(text.split())[:60]
            remedy = self._layout.without(line)
            raise TextError(f"line {line}: {shown!r} is neither a row nor a comment: {remedy}")
        return True

    def _repeats_head(self, line: int, text: str) -> bool:
        """Whether a line is the head again; TextError where it is another one."""
        layout, like = self._layout, self._column_names.like
        if text.startswith(END_OF_HEADER):
            raise TextError(f"line {line} begins another segment: {layout.without(line)}")
        cells = split(uncommented(text), layout.sep)
        if cells[: len(layout.names)] == layout.names:
            return True
        heads = [heading(cell, like) for cell in cells]
        names = [split_unit(head)[0] for head in heads]
        if not is_known(heads, self._column_names):
            return False
        units = {split_unit(head) for head in heads if split_unit(head)[0] in like}
        alike = all(
            scale_of(like[name], unit or "") == self._units[name]
            or (unit is None and self._units.get(name) == SI_UNIT)
            for name, unit in units
            if name in self._units
        )
        if names[: len(self._names)] == self._names and alike:
            return True
        raise TextError(
            f"line {line} is another head, with other names or units: {layout.without(line)}"
        )

    def _has_units(self, line: int, text: str) -> bool:
        """Whether a line has the units of the columns again; TextError where they are others."""
        layout, like = self._layout, self._column_names.like
        cells = units_in(text, layout.sep, self._names, like, line)
        if cells is None:
            return False
        for i, name in layout.inputs.items():
            unit = cells[i].strip(" []()") if i < len(cells) else ""
            if unit and scale_of(like[name], unit) != (self._units[name] or SI_UNIT):
                raise TextError(
                    f"line {line}: {name} is in {unit}, but not in the rows before: "
                    f"{layout.without(line)}"
                )
        self.repeated.append(line)
        self.skipped.append(line)
        return True

    def _check_comment(self, line: int, text: str) -> None:
        """Refuse a comment among the rows that says other units than the head."""
        like = self._column_names.like
        for name, unit in legend(text, [*self._layout.inputs.values()]):
            if scale_of(like[name], unit) != (self._units[name] or SI_UNIT):
                raise TextError(
                    f"line {line}: {name} is in {unit}, but not in the head: leave one of them out"
                )
        self._has_units(line, text)


def records(lines: Iterator[tuple[int, str]], layout: Layout, account: Account) -> Iterator[Record]:
    """Return the rows among numbered lines; a quoted cell may go on in the next lines.

    TextError where a quote is not closed, and where a line is none of a table's.
    """
    sep, width = layout.sep, len(layout.heads)
    for line, text in lines:
        if not account.may_be_data(line, text):
            continue
        if '"' in text:
            cells, text = _quoted(line, text, lines, sep)
        elif sep == BLANKS:
            cells = text.split()
        elif text.count(sep) > 2 * width + 1000:  # no use in taking it apart
            yield Record(line, [], irregular(text.count(sep) + 1, width), text)
            continue
        else:
            cells = text.split(sep)
        if account.is_row(line, text, cells):
            yield regular(Record(line, cells, None, text), layout)


def _quoted(
    line: int, text: str, lines: Iterator[tuple[int, str]], sep: str
) -> tuple[list[str], str]:
    """The cells of a row with quotes, which may go on in the next lines, and all of its text."""
    if sep == BLANKS:
        return [match[0].strip('"') for match in _QUOTED.finditer(text)], text
    try:  # most rows end in their line
        return next(csv.reader((text,), delimiter=sep, strict=True, skipinitialspace=True)), text
    except csv.Error:
        texts = [text]

    def with_ends() -> Iterator[str]:
        yield f"{text}\n"
        for _, following in lines:
            texts.append(following)
            yield f"{following}\n"

    try:
        reader = csv.reader(with_ends(), delimiter=sep, strict=True, skipinitialspace=True)
        cells = next(reader)
    except csv.Error as error:
        fault = f"a quote is not closed, or not at the end of its cell ({error})"
        raise TextError(f"line {line}: {fault}") from None
    return cells, "\n".join(texts)


def regular(record: Record, layout: Layout) -> Record:
    """Return a row with as many cells as the head, or with its fault; empty cells may follow."""
    cells, width = record.cells, len(layout.heads)
    if len(cells) == width:
        return record
    if len(cells) > width and not any(map(str.strip, cells[width:])):
        return record._replace(cells=cells[:width], is_whole=False)
    if len(cells) == width - 1 and layout.without_comments:
        return record._replace(cells=[*cells, ""], is_whole=False)
    return record._replace(fault=irregular(len(cells), width))


def irregular(count: int, width: int) -> str:
    """What is wrong with a row of so many cells."""
    cells = "cell" if count == 1 else "cells"
    return f"has {count:,} {cells}, the head has {width:,}"


# --- its numbers ----------------------------------------------------------------------------------


def read_cell(like: str, cell: str, signs: Signs, scale: Scale = SI_UNIT) -> float:
    """Return the number in a cell in SI; NaN for a gap.

    A number is in the unit of its column, which is one of the input ``like`` and has the ``scale``.
    ValueError says what is wrong.

    >>> german = Signs(",", None)
    >>> read_cell("v0", "1.000,5", german, Scale(over=1e3)), read_cell("k", "Rigid", german)
    (1.0005, inf)
    >>> read_cell("v0", "#NV", german)
    nan
    """
    text = cell.strip()
    if text.lower() in GAPS:
        return math.nan
    signs.check(text)
    try:
        number = read_number(text, signs.decimal)
    except ValueError as error:
        if like == "k" and text.lower() == RIGID:
            return math.inf
        if text[-1:] in "%‰" and QUANTITY_OF[like] == "ratio":  # a number, whatever the unit
            return read_number(text[:-1].strip(), signs.decimal) / (
                100.0 if text[-1] == "%" else 1e3
            )
        raise ValueError(_no_number(like, text, str(error), signs)) from None
    value = scale.si(number)
    if math.isinf(value) and math.isfinite(number):
        raise ValueError(TOO_LARGE)
    return value


def _no_number(like: str, text: str, fault: str, signs: Signs) -> str:
    """Why a cell has no number."""
    if text.startswith("="):
        return "is a formula without a value: open it in its program, and save it"
    if ".." in text or "±" in text:
        if like == "k":
            return "must be one number; its ends are columns k_low and k_high, a deviation std_k"
        return "must be one number; a deviation is a column std"
    if not text.strip("0123456789.,'’+-−eEdD \u00a0\u202f"):
        return fault  # such as a sign that is not the decimal one
    try:
        _, unit = split_number(signs.with_points(tidy(text)))
    except ValueError:
        return "must be a number"
    if is_unit(unit) or scale_of(like, unit) is not None:
        return f"must be a number alone: write its unit into the head, as in {like} [{unit}]"
    return "must be a number"


class Table(NamedTuple):
    """Columns of numbers that were read."""

    columns: dict[str, Array]  #: by name, in SI, (n,)
    units: dict[str, str]  #: of each column in the table; the SI unit where it has none
    scales: dict[str, Scale]  #: of these units
    lines: list[int]  #: of each row
    skipped: list[int]  #: lines that are neither head nor units nor rows, and not empty
    read_as: str  #: what was found out, see :meth:`Layout.described`

    @property
    def in_own_units(self) -> dict[str, Array]:
        """The columns in their units."""
        return {name: _in_unit(x, self.scales[name]) for name, x in self.columns.items()}


def _in_unit(values: Array, scale: Scale) -> Array:
    """Values in SI in another unit, with the digits that both have."""
    numbers = values * scale.over / scale.times
    return np.array([float(f"{value:.15g}") for value in numbers.tolist()])


class Pieces(NamedTuple):
    """The bytes of a table, from the beginning each time that they are asked for."""

    source: Path | bytes

    def __call__(self, report_place: Callable[[int], None] = lambda _at: None) -> Iterator[bytes]:
        """Return them in pieces; ``report_place`` is told how far a file is read."""
        if isinstance(self.source, bytes):
            return iter([self.source])
        return file_pieces(self.source, report_place)


def source_of(
    source: Path | bytes, column_names: ColumnNames, dialect: Dialect
) -> tuple[Pieces, Dialect, str]:
    """Return the bytes of a table, of a workbook those of the sheet that has the names, how it is
    written, and what is to be said of the sheets."""
    if isinstance(source, bytes):
        start = source[:4]
    else:
        with source.open("rb") as stream:
            start = stream.read(4)
    if start != BEGIN:
        if dialect.sheet is not None:
            raise TextError(f"it is no workbook, and has no sheet {dialect.sheet!r}")
        return Pieces(source), dialect, ""

    def has_names(lines: list[str]) -> bool:
        layout = find_layout(Piece(1, lines), column_names, dialect._replace(sep=SEP))
        return is_known(layout.heads, column_names)

    data, said = read_sheet(source, dialect.sheet, dialect.decimal, has_names)
    return Pieces(data), dialect._replace(sep=SEP, encoding="utf-8"), said


def read_table(
    source: Path | bytes,
    column_names: ColumnNames,
    dialect: Dialect,
    most: Most = Most(),  # noqa: B008
) -> Table:
    """Return the columns of a table that mean something, in SI, from a file or its bytes.

    TextError tells all that is wrong: its ``faults`` are one for each line.

    >>> data = "Rig 7\\n\\nv0\\tmu_macro\\nmm/s\\t%\\n1,5\\t7\\n2,5\\t9\\n".encode()
    >>> table = read_table(data, ColumnNames({"v0": "v0", "mu_macro": "mu0"}, [["v0"]]), Dialect())
    >>> table.columns["mu_macro"].tolist(), table.skipped
    ([0.07, 0.09], [1])
    >>> table.read_as
    'tab, decimal comma, head in line 3, units in line 4; v0 [mm/s], mu_macro [%]'
    """
    pieces, dialect, said = source_of(source, column_names, dialect)
    text = Text(pieces(), dialect.encoding)
    layout, lines = begin(text, column_names, dialect, most.check)
    columns, faults = find_heads(layout.heads, column_names.like)
    missing = [
        group[0] for group in column_names.required_groups if not columns.keys() & set(group)
    ]
    if missing:
        one = len(missing) == 1
        faults.append(
            absent(missing[0], layout.heads) if one else absent_together(missing, layout.heads)
        )
    if faults:
        raise TextError.of([f"line {layout.head}: {fault}" for fault in faults])
    account = Account(layout, column_names)
    rows = [*islice(records(lines, layout, account), most.rows + 1)]
    if len(rows) > most.rows:
        fault = f"there are more than {most.rows:,} rows: average them"
        raise TextError(f"line {rows[-1].line}: {fault}")
    if not rows:
        raise TextError(f"line {layout.head}: no row follows the names of the columns")
    signs = dialect.signs(layout)
    whole = [row for row in rows if row.fault is None]
    signs.see(
        Cell(row.line, name, row.cells[i]) for row in whole for name, (i, _) in columns.items()
    )
    wrong = [(row.line, f"line {row.line} {row.fault}") for row in rows if row.fault]
    numbers: dict[str, Array] = {}
    for name, (i, scale) in columns.items():
        numbers[name] = _column(name, column_names.like[name], whole, i, signs, scale, wrong)
    if wrong:
        raise TextError.of([fault for _, fault in sorted(wrong, key=lambda one: one[0])])
    units = {
        name: split_unit(layout.heads[i])[1] or unit_in_si(name) for name, (i, _) in columns.items()
    }
    scales = {name: scale for name, (_, scale) in columns.items()}
    lines_of_rows = [row.line for row in whole]
    skipped = sorted({*layout.skipped, *account.skipped})
    read_as = said + layout.described(signs) + again(account.repeated)
    return Table(numbers, units, scales, lines_of_rows, skipped, read_as)


def again(lines: list[int]) -> str:
    """Return what is said of lines that have the head or its units again.

    >>> again([7]), again([])
    ('; the head again in line 7, left out', '')
    """
    if not lines:
        return ""
    more = f" and {len(lines) - 5:,} more" if len(lines) > 5 else ""
    places = ", ".join(map(str, lines[:5])) + more
    return f"; the head again in line{'s' * (len(lines) > 1)} {places}, left out"


def read_columns(
    source: Path | bytes,
    like: Mapping[str, str],
    dialect: Dialect = Dialect(),  # noqa: B008
    most: Most = Most(),  # noqa: B008
) -> Table:
    """Return named columns of numbers of a table, all of which it must have.

    ``like`` has their names, each with the input whose units it has.

    >>> data = b"t,x [um],Ft\\n0,1.5,0.2\\n1,2.5,0.3\\n"
    >>> read_columns(data, {"x": "y0", "Ft": "Fz"}).columns["x"].tolist()
    [1.5e-06, 2.5e-06]
    """
    return read_table(source, ColumnNames(like, [(name,) for name in like]), dialect, most)


def _column(
    name: str,
    like: str,
    rows: list[Record],
    i: int,
    signs: Signs,
    scale: Scale,
    wrong: list[tuple[int, str]],
) -> Array:
    """A column in SI; what is ``wrong`` with its cells is added, with their lines."""
    cells = [row.cells[i].strip() for row in rows]
    column = "\n".join(cells)
    if signs.decimal == ",":  # with a point in place of each comma; a point itself is none
        column = column.translate(_WITH_POINTS)
        cells = column.split("\n")
    if _OF_NUMBERS.fullmatch(column):
        try:  # numbers as programs write them, all at once
            values = np.array([*map(float, cells)])
        except ValueError:
            values = np.array([math.inf])
        if np.isfinite(values).all():
            with np.errstate(over="ignore"):
                si: Array = values * scale.times / scale.over
            if np.isfinite(si).all():
                return si
    numbers = np.empty(len(rows))
    for j, row in enumerate(rows):
        try:
            numbers[j] = read_cell(like, row.cells[i], signs, scale)
            if math.isnan(numbers[j]):
                raise ValueError("is missing")
        except ValueError as error:
            shown = "" if str(error) == "is missing" else f", got {row.cells[i].strip()[:80]!r}"
            wrong.append((row.line, f"line {row.line}: {name} {error}{shown}"))
    return numbers

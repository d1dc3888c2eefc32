"""Tables as people and rigs write them: lines before the head, comments, separators, a row of
units, numbers with any decimal sign, gaps.

:func:`find_layout` looks at the first lines and finds how a table is written: the head is the first
line that names what is needed.  :func:`rows` gives its records with the numbers of their lines, as
an editor counts them, and :func:`read_cell` the number in a cell.  :func:`read_table` is all of it
for a table in memory; files of any length are read in pieces (:mod:`mumacro.files.reading`).
"""

import csv
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.decoding import LONGEST, NAMES, Piece, Text, TextError, file_pieces
from mumacro.inputs.fields import is_rigid
from mumacro.inputs.headings import (
    absent,
    absent_together,
    find_heads,
    heading,
    meant_by,
    unit_in_si,
)
from mumacro.inputs.numbers import TOO_LARGE, read_number
from mumacro.inputs.reading import Value, read, reason_of
from mumacro.inputs.signs import Cell, Signs
from mumacro.inputs.units import Scale, scale_of, split_unit
from mumacro.inputs.workbooks import BEGIN, SEP, sheet_of, sheet_pieces
from mumacro.kernel.arrays import Array

BLANKS = " "  #: the separator where any number of blanks stands between the cells
#: separators of the cells, by the name that an option has
SEPARATORS = {",": ",", ";": ";", "|": "|", "tab": "\t", "blanks": BLANKS}
_WORDS = {",": "comma", ";": "semicolon", "|": "bar", "\t": "tab", BLANKS: "blanks"}
_WORDS_OF_SIGNS = {".": "point", ",": "comma"}
COMMENT = ("#", "%", "//", "!")  #: what begins a comment
_LOOKED_AT = 2_000  # lines, in which the head must stand
_MOST_COLUMNS = 200_000
_GAP, SI_UNIT = Value(math.nan), Scale()
#: cells without a value, in small letters
GAPS = frozenset(
    (
        *("", "-", "--", "---", "—", "–", "−", ".", "..", "...", "?", "*"),
        *("nan", "-nan", "nan(ind)", "-nan(ind)", "1.#qnan", "1.#ind", "-1.#ind"),
        *("na", "n/a", "n.a.", "n.d.", "k.a.", "k. a.", "n. v.", "<na>", "#n/a", "#na", "#nv"),
        *("null", "(null)", "none", "nil", "missing", "undefined"),
        *("#div/0!", "#value!", "#wert!", "#ref!", "#bezug!", "#num!", "#zahl!", "#name?"),
    )
)
# cells between blanks: quoted, or with blanks within brackets; brackets belong to what is before
_CELL = re.compile(r'"([^"]*)"|((?:[^\s\[\]()"]|\[[^\[\]]*\]|\([^()]*\)|[\[\]()"])+)')
_BETWEEN = re.compile(r"[,;|\s]")  # cells, whatever separates them
_SEP_LINE = re.compile(r'\ufeff?"?sep=(.)"?', re.IGNORECASE | re.DOTALL)
_APART = "give the rows from there on as a file of their own"
_END_OF_HEADER = "***End_of_Header***"


class Dialect(NamedTuple):
    """How a person says that a table is written; what is None is found out."""

    sep: str | None = None  #: a character, or :data:`BLANKS`
    decimal: str | None = None
    thousands: str | None = None  #: empty where there is none
    encoding: str | None = None
    skip: int = 0  #: lines to leave out at the beginning
    dashes: str = "--"  #: before the name of an option, in messages

    def signs(self, layout: "Layout") -> Signs:
        """What is known of the signs of numbers in a table."""
        return Signs(self.decimal or layout.decimal, self.thousands, layout.sep, self.dashes)


class Most(NamedTuple):
    """The largest table that is read."""

    rows: int = 1_000_000
    columns: int = _MOST_COLUMNS
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


class ColumnNames(NamedTuple):
    """The columns of a table that mean something."""

    like: Mapping[str, str]  #: by name, the input whose units it has
    required_groups: Sequence[Sequence[str]]  #: of each, one name must be there


class Layout(NamedTuple):
    """How a table is written."""

    sep: str
    decimal: str | None  #: as the table says itself
    head: int  #: the line of the head
    units: int | None  #: the line of the units, where they have one
    heads: list[str]  #: names of the columns, with their units in brackets
    first: int  #: the line behind them
    names_first: bool  #: whether the first column is none of those that mean something
    labview: bool  #: whether LabVIEW wrote it
    encoding: str
    skipped: list[int]  #: lines before the head that are not empty

    @property
    def without_comments(self) -> bool:
        """Whether rows end before the last column, as LabVIEW writes them."""
        return self.labview and self.heads[-1:] == ["Comment"]

    def described(self, signs: Signs) -> str:
        """How the table is read, in a few words; empty for plain CSV.

        >>> column_names = ColumnNames({"v0": "v0", "mu_macro": "mu0"}, [["v0"], ["mu_macro"]])
        >>> start = Piece(1, ["run 7", "v0;mu_macro", "mm/s;%", "1,5;7"])
        >>> layout = find_layout(start, column_names, Dialect())
        >>> (signs := Dialect().signs(layout)).see([Cell(4, "v0", "1,5")])
        >>> layout.described(signs)
        'semicolon, decimal comma, head in line 2, units in line 3'
        """
        words = (
            []
            if self.encoding in ("", "utf-8", "utf-8-sig")
            else [NAMES.get(self.encoding, self.encoding)]
        )
        words += [_WORDS.get(self.sep, repr(self.sep))] if self.sep != "," else []
        words += ["decimal comma"] if signs.decimal == "," else []
        words += [f"{_WORDS_OF_SIGNS[signs.grouped]} between thousands"] if signs.grouped else []
        words += [f"head in line {self.head}"] if self.head > 1 else []
        words += [f"units in line {self.units}"] if self.units else []
        return ", ".join(words)


class Record(NamedTuple):
    """A row of a table."""

    line: int  #: where it begins, as an editor counts
    cells: list[str]
    fault: str | None = None  #: why it is no row of this table
    text: str = ""  #: as it stands there
    is_whole: bool = True  #: whether the text has the cells and no others


# --- how a table is written -----------------------------------------------------------------------


class _Declared(NamedTuple):
    """What the lines before the head say of the table."""

    sep: str | None = None
    decimal: str | None = None
    labview: bool = False
    units: int | None = None  # index of a line of LabVIEW with the units of the columns


class _Head(NamedTuple):
    at: int  # index of its line
    end: int  # index of the line behind it
    sep: str
    cells: list[str]


def find_layout(
    start: Piece, column_names: ColumnNames, dialect: Dialect, encoding: str = ""
) -> Layout:
    """How a table is written, from its first lines.

    Where no line names all that is needed, the head is the line that most probably is meant for it.
    TextError where there is no line at all, or the row of units has a unit that is none.
    """
    lines, number = start.lines, start.first
    preamble = _declared(lines)
    sep = dialect.sep or preamble.sep
    seps = (sep,) if sep else tuple(SEPARATORS.values())
    candidates = [*islice(_heads_in(lines, dialect.skip, seps, column_names), 20)]
    head = next((one for one in candidates if _fits(one, lines, preamble.labview)), None)
    head = head or (candidates[0] if candidates else _likely_head(lines, dialect.skip, seps))
    cells = head.cells
    while cells and not cells[-1]:
        cells = cells[:-1]
    heads = [heading(cell, column_names.like) for cell in cells]
    units = None
    if preamble.units is not None:
        label_line = _split(lines[preamble.units], head.sep)
        heads = (
            _with_units(heads, ["", *label_line[1:]], column_names, number + preamble.units)
            or heads
        )
        units = number + preamble.units
    layout = Layout(
        head.sep,
        preamble.decimal,
        number + head.at,
        units,
        heads,
        number + head.end,
        bool(heads) and split_unit(heads[0])[0] not in column_names.like,
        preamble.labview,
        encoding,
        [number + i for i in range(head.at) if lines[i].strip()],
    )
    return _with_row_of_units(layout, head, start, column_names)


def _with_row_of_units(
    layout: Layout, head: _Head, start: Piece, column_names: ColumnNames
) -> Layout:
    """The layout with the units in the first row behind the head, where that is a row of units."""
    lines = start.lines
    in_comments = lines[head.at].lstrip("\ufeff ").startswith(COMMENT)
    for i in range(head.end, len(lines)):
        if not (is_row(lines[i], layout) or (in_comments and lines[i].strip(f" \t{layout.sep}"))):
            continue
        is_comment = lines[i].lstrip().startswith(COMMENT) and not is_row(lines[i], layout)
        cells = _split(_uncommented(lines[i]) if is_comment else lines[i], layout.sep)
        line = start.first + i
        if cells == head.cells:  # the head again
            return layout
        heads = _with_units(layout.heads, cells, column_names, line, is_comment)
        return layout._replace(heads=heads, first=line + 1, units=line) if heads else layout
    return layout


def _declared(lines: Sequence[str]) -> _Declared:
    first = next((line for line in lines if line.strip()), "")
    if match := _SEP_LINE.fullmatch(first.rstrip("\n")):
        return _Declared(sep=match[1])
    if not first.lstrip("\ufeff").startswith("LabVIEW Measurement"):
        return _Declared()
    sep = decimal = units = None
    ends = 0
    for i, line in enumerate(lines[:_LOOKED_AT]):
        tag, *values = re.split(r"[\t,]", line.strip(), maxsplit=1)
        value = values[0].strip() if values else ""
        ends += tag == _END_OF_HEADER
        if tag == "Separator":
            sep = "," if value.lower() == "comma" else "\t"
        elif tag == "Decimal_Separator":
            decimal = value if value in (".", ",") else None
        elif tag == "Y_Unit_Label" and ends < 2:
            units = i
    return _Declared(sep or "\t", decimal, True, units)


def _heads_in(
    lines: Sequence[str], skip: int, seps: Sequence[str], column_names: ColumnNames
) -> Iterator[_Head]:
    """The lines that name all that is needed."""
    for i in range(skip, min(len(lines), _LOOKED_AT)):
        names_all = all(
            any(name in lines[i] for name in names) for names in column_names.required_groups
        )
        # of an odd number of quotes a cell goes on in the next line
        if not names_all and lines[i].count('"') % 2 == 0:
            continue
        text, end = _whole(lines, i)
        for sep in seps:
            cells = _split(_uncommented(text), sep)
            names_in_line = {split_unit(heading(cell, column_names.like))[0] for cell in cells}
            if all(names_in_line.intersection(names) for names in column_names.required_groups):
                yield _Head(i, end, sep, cells)


def _whole(lines: Sequence[str], i: int) -> tuple[str, int]:
    """A line with those behind it in which its quoted cells end, and the index behind them."""
    text = lines[i]
    for end in range(i + 1, min(i + 20, len(lines))):
        if text.count('"') % 2 == 0:
            return text, end
        text += f"\n{lines[end]}"
    return (text, min(i + 20, len(lines))) if text.count('"') % 2 == 0 else (lines[i], i + 1)


def _uncommented(line: str) -> str:
    """A line without the sign that makes it a comment: the head of a table may be in one."""
    text = line.lstrip("\ufeff ")
    return text.lstrip("#%/!").lstrip() if text.startswith(COMMENT) else text


def _split(line: str, sep: str) -> list[str]:
    """The cells of a head or of a row of units, without the blanks around them."""
    if sep != BLANKS and line.count(sep) > _MOST_COLUMNS:
        return []
    if sep == BLANKS:
        cells: list[str] = []
        for match in _CELL.finditer(line):
            if cells and match[0][0] in "[(":
                cells[-1] += f" {match[0]}"
            else:
                cells.append(match[0].strip('"'))
        return cells
    if '"' not in line:
        return [cell.strip() for cell in line.split(sep)]
    try:
        cells = next(csv.reader([line], delimiter=sep, skipinitialspace=True), [])
    except csv.Error:
        return [line.strip()]
    return [cell.strip() for cell in cells]


def _fits(head: _Head, lines: Sequence[str], labview: bool) -> bool:
    """Whether the row behind a head has as many cells."""
    width = len(head.cells)
    for i in range(head.end, len(lines)):
        if lines[i].strip() and not lines[i].lstrip().startswith(COMMENT):
            cells = _split(_whole(lines, i)[0], head.sep)
            return len(cells) in (width, width - labview) or not any(cells[width:] or ["x"])
    return True


def _likely_head(lines: Sequence[str], skip: int, seps: Sequence[str]) -> _Head:
    """The line that is probably meant for a head: one whose names are like those of inputs, or the
    one above the first numbers."""
    best, most = None, 0.0
    for i in range(skip, min(len(lines), _LOOKED_AT)):
        for sep in seps:
            cells = _split(_uncommented(lines[i][:100_000]), sep)
            if not any(cells):
                continue
            alike = sum(meant_by(cell, loosely=False) is not None for cell in cells[:200])
            below = _split(lines[i + 1][:10_000], sep) if i + 1 < len(lines) else []
            numbers = sum(_is_number(cell) for cell in below)
            is_above = len(below) == len(cells) and numbers > len(cells) // 2
            score = alike + 0.5 * is_above + 0.01 * (sep in lines[i])
            if not any(map(_is_number, cells)) and score > most:
                best, most = _Head(i, i + 1, sep, cells), score
    if best is not None:
        return best
    at = next((i for i in range(skip, len(lines)) if lines[i].strip()), None)
    if at is None:
        raise TextError(f"line {skip + 1}: must name the columns, and is empty")
    return _Head(at, at + 1, seps[0], _split(lines[at][:10_000], seps[0])[:_MOST_COLUMNS])


def _is_number(cell: str) -> bool:
    """Whether a cell begins as numbers do."""
    return cell.lstrip("+-−.,")[:1].isdigit()


def _with_units(
    heads: Sequence[str],
    cells: Sequence[str],
    column_names: ColumnNames,
    line: int,
    may_be_prose: bool = False,
) -> list[str] | None:
    """The heads with the units in the row below them; None where that is no row of units.

    A row without any number is one, unless it ``may_be_prose``: TextError where an input has none
    of its units there.
    """
    names = [split_unit(head) for head in heads]
    texts = [cell.strip(" []()") for cell in cells[: len(heads)]] + [""] * (len(heads) - len(cells))
    places = [i for i, (name, _) in enumerate(names) if name in column_names.like and texts[i]]
    scales = {i: scale_of(column_names.like[names[i][0]], texts[i]) for i in places}
    units = [i for i in places if scales[i] is not None and texts[i] not in ("-", "1")]
    numbers = [texts[i] for i in places if i not in units and _is_number(texts[i])]
    if any(number != "1" for number in numbers) or any(map(str.strip, cells[len(heads) :])):
        return None
    is_empty = any(texts[i].lower() in GAPS or is_rigid(texts[i]) for i in places)
    if not places or (not units and (numbers or is_empty)):
        return None
    if may_be_prose and len(units) < len(places):
        return None
    for i in places:
        name, unit = names[i]
        if scales[i] is None:
            raise TextError(
                f"line {line}: {texts[i][:40]!r} is neither a number nor a unit of {name}"
            )
        if unit is not None and scale_of(column_names.like[name], unit) != scales[i]:
            raise TextError(
                f"line {line}: {name} is in {texts[i]}, its head says {unit}; leave one of them out"
            )
    return [
        f"{head} [{text}]"
        if unit is None and text not in ("", "-", "1") and len(text) <= 20
        else head
        for head, text, (_, unit) in zip(heads, texts, names, strict=True)
    ]


def begin(
    text: Text,
    column_names: ColumnNames,
    dialect: Dialect,
    check: Callable[[Piece], None] = lambda _piece: None,
) -> tuple[Layout, Iterator[tuple[int, str]]]:
    """How a text is written, and the numbered lines behind the head; every piece is checked before
    it is taken apart."""
    start = list[str]()
    for piece in text:
        check(piece)
        start += piece.lines
        if len(start) >= _LOOKED_AT:
            break

    def following() -> Iterator[str]:
        for piece in text:
            check(piece)
            yield from piece.lines

    layout = find_layout(Piece(1, start), column_names, dialect, text.encoding)
    lines = chain(start, following())
    return layout, iter(enumerate(islice(lines, layout.first - 1, None), layout.first))


# --- its rows -------------------------------------------------------------------------------------


def is_row(line: str, layout: Layout) -> bool:
    """Whether a line is neither empty nor a comment.

    A name such as #1 in the first column makes no comment of a row that is whole.
    """
    sep = layout.sep
    if not line.strip(f" \t{sep}"):
        return False
    if not line.lstrip().startswith(COMMENT):
        return True
    cells = len(line.split()) if sep == BLANKS else line.count(sep) + 1
    return layout.names_first and cells == len(layout.heads) > 1


def may_be_head(text: str, layout: Layout, column_names: ColumnNames) -> bool:
    """Whether a text has all names that a head needs, or begins another segment of LabVIEW."""
    if layout.labview and _END_OF_HEADER in text:
        return True
    return all(any(name in text for name in names) for names in column_names.required_groups)


def records(
    lines: Iterator[tuple[int, str]],
    layout: Layout,
    column_names: ColumnNames,
    skip: Callable[[int], None] = lambda _line: None,
) -> Iterator[Record]:
    """The rows among numbered lines; a quoted cell may go on in the next lines.

    Comments and repetitions of the head are left out, and ``skip`` is told their lines.  TextError
    where a quote is not closed, and where another head begins.
    """
    sep, width = layout.sep, len(layout.heads)
    for line, text in lines:
        if not is_row(text, layout):
            if text.strip(f" \t{sep}"):
                skip(line)
            continue
        if may_be_head(text, layout, column_names) and _repeats_head(
            line, text, layout, column_names
        ):
            skip(line)
            continue
        if '"' in text:
            cells, text = _quoted(line, text, lines, sep)
        elif sep == BLANKS:
            cells = text.split()
        elif text.count(sep) > 2 * width + 1000:  # no use in taking it apart
            yield Record(line, [], _irregular(text.count(sep) + 1, width), text)
            continue
        else:
            cells = text.split(sep)
        yield _regular(Record(line, cells, None, text), layout)


def _repeats_head(line: int, text: str, layout: Layout, column_names: ColumnNames) -> bool:
    """Whether a line is the head again; TextError where it is another one."""
    heads = [heading(cell, column_names.like) for cell in _split(_uncommented(text), layout.sep)]
    names = [split_unit(head)[0] for head in heads]
    if text.startswith(_END_OF_HEADER):
        raise TextError(f"line {line} begins another segment: {_APART}")
    if not all(any(name in names for name in group) for group in column_names.required_groups):
        return False
    if names[: len(layout.heads)] == [split_unit(head)[0] for head in layout.heads]:
        return True
    raise TextError(f"line {line} is another head: {_APART}")


def _quoted(
    line: int, text: str, lines: Iterator[tuple[int, str]], sep: str
) -> tuple[list[str], str]:
    """The cells of a row with quotes, which may go on in the next lines, and all of its text."""
    if sep == BLANKS:
        return [match[0].strip('"') for match in _CELL.finditer(text)], text
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


def _regular(record: Record, layout: Layout) -> Record:
    """A row with as many cells as the head, or with its fault; empty cells may follow."""
    cells, width = record.cells, len(layout.heads)
    if len(cells) == width:
        return record
    if len(cells) > width and not any(map(str.strip, cells[width:])):
        return record._replace(cells=cells[:width], is_whole=False)
    if len(cells) == width - 1 and layout.without_comments:
        return record._replace(cells=[*cells, ""], is_whole=False)
    return record._replace(fault=_irregular(len(cells), width))


def _irregular(count: int, width: int) -> str:
    cells = "cell" if count == 1 else "cells"
    return f"has {count:,} {cells}, the head has {width:,}"


# --- its numbers ----------------------------------------------------------------------------------


def read_cell(name: str, cell: str, signs: Signs, scale: Scale = SI_UNIT) -> Value:
    """What a cell of the column ``name`` says, in SI: NaN for a gap.

    A number is in the unit of the column, whose ``scale`` is given; a unit in the cell comes first.
    ValueError says what is wrong.

    >>> german = Signs(",", None)
    >>> read_cell("v0", "1.000,5", german, Scale(over=1e3)).si, read_cell("k", "Rigid", german).si
    (1.0005, inf)
    >>> read_cell("v0", "5 um/s", german, Scale(over=1e3)).si, read_cell("k", "#NV", german).si
    (5e-06, nan)
    """
    text = cell.strip()
    if text.lower() in GAPS:
        return _GAP
    signs.check(text)
    try:
        number = read_number(text, signs.decimal)
    except ValueError as error:
        # a number that is none for this decimal sign, and not one with a unit or an interval
        if ".." not in text and not text.strip("0123456789.,'’+-−eEdD \u00a0\u202f"):
            raise ValueError(str(error)) from None
    else:
        value = scale.si(number)
        if math.isinf(value) and math.isfinite(number):
            raise ValueError(TOO_LARGE)
        return Value(value)
    try:
        return read(name, signs.with_points(text))
    except InputError as error:
        raise ValueError(reason_of(error.bound)) from None


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


def source_of(
    source: Path | bytes, dialect: Dialect, report_place: Callable[[int], None] = lambda _at: None
) -> tuple[Iterator[bytes], Dialect]:
    """The pieces of a table's bytes, of a workbook those of its first sheet, and how it is written.

    ``report_place`` is told how far a file is read.
    """
    if isinstance(source, bytes):
        begin, pieces = source[:4], iter([source])
    else:
        with source.open("rb") as stream:
            begin = stream.read(4)
        pieces = file_pieces(source, report_place)
    if begin != BEGIN:
        return pieces, dialect
    sheet = sheet_of(source) if isinstance(source, bytes) else _sheet_in(source)
    return sheet, Dialect(SEP, ".", None, "utf-8", dialect.skip, dialect.dashes)


def _sheet_in(path: Path) -> Iterator[bytes]:
    with path.open("rb") as stream:
        yield from sheet_pieces(stream)


def read_table(
    source: Path | bytes,
    column_names: ColumnNames,
    dialect: Dialect,
    most: Most = Most(),  # noqa: B008
) -> Table:
    """The columns of a table that mean something, in SI, from a file or its bytes.

    TextError tells all that is wrong: its ``faults`` are one for each line.

    >>> data = "Rig 7\\n\\nv0\\tmu_macro\\nmm/s\\t%\\n1,5\\t7\\n2,5\\t9\\n".encode()
    >>> table = read_table(data, ColumnNames({"v0": "v0", "mu_macro": "mu0"}, [["v0"]]), Dialect())
    >>> table.columns["mu_macro"].tolist(), table.skipped
    ([0.07, 0.09], [1])
    >>> table.read_as
    'tab, decimal comma, head in line 3, units in line 4'
    """
    pieces, dialect = source_of(source, dialect)
    text = Text(pieces, dialect.encoding)
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
    skipped = [*layout.skipped]
    rows = [*islice(records(lines, layout, column_names, skipped.append), most.rows + 1)]
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
    numbers = {name: np.empty(len(whole)) for name in columns}
    wrong = [(row.line, f"line {row.line} {row.fault}") for row in rows if row.fault]
    for name, (i, scale) in columns.items():
        for j, row in enumerate(whole):
            try:
                numbers[name][j] = _one_number(name, row.cells[i], signs, scale)
            except ValueError as error:
                wrong.append((row.line, f"line {row.line}: {name} {error}"))
    if wrong:
        raise TextError.of([fault for _, fault in sorted(wrong, key=lambda one: one[0])])
    units = {
        name: split_unit(layout.heads[i])[1] or unit_in_si(name) for name, (i, _) in columns.items()
    }
    scales = {name: scale for name, (_, scale) in columns.items()}
    lines_of_rows = [row.line for row in whole]
    return Table(numbers, units, scales, lines_of_rows, skipped, layout.described(signs))


def _one_number(name: str, cell: str, signs: Signs, scale: Scale) -> float:
    """The number in a cell [SI]; ValueError where there is none, or more."""
    value_text = f", got {cell.strip()[:80]!r}"
    try:
        value = read_cell(name, cell, signs, scale)
    except ValueError as error:
        raise ValueError(f"{error}{value_text}") from None
    if value.std is not None or value.low is not None:
        column = "; a deviation of mu_macro is a column std" if name == "mu_macro" else ""
        raise ValueError(f"must be one number{column}{value_text}")
    if math.isnan(value.si):
        raise ValueError("is missing")
    return float(value.si)

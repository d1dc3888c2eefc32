"""The rows of tables as people and rigs write them, and their numbers.

Every line of a table is accounted for: it is before the head, the head, units, data, a comment or
empty (:mod:`mumacro.inputs.layout` finds how it is written).  What cannot be is refused by its
line: another header, another segment, a row of statistics.  :class:`TextTable` gives the rows in
pieces, whatever the length of the file; :func:`read_numbers` reads a table into memory.
"""

import csv
import io
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mumacro.errors import TextError
from mumacro.inputs.decoding import LONGEST, Piece, Text, file_pieces
from mumacro.inputs.fields import QUANTITY_OF, RIGID
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
    is_unit,
    legend,
    may_be_row,
    split,
    starts_as_number,
    uncommented,
    units_in,
)
from mumacro.inputs.names import absent, find_heads, heading
from mumacro.inputs.numbers import TOO_LARGE, Cell, Signs, read_number, split_number, tidy
from mumacro.inputs.units import Scale, scale_of, split_unit, unit_of
from mumacro.inputs.workbooks import BEGIN, SEP, read_sheet
from mumacro.kernel.arrays import Array, Places

SI_UNIT = Scale()
_BETWEEN_BLANKS = re.compile(r'"[^"]*"|\S+')
_BETWEEN = re.compile(r"[,;|\s]+")  # whatever separates cells
# what a row of statistics begins with, in small letters
_STATISTICS = re.compile(
    r"(?:mean|average|avg|median|mittel(?:wert)?|mw|moyenne|min(?:imum)?|max(?:imum)?|sum|total"
    r"|summe|range|spannweite|variance|varianz|cov|cv|s\.?d\.?|rsd|count"
    r"|st(?:andar)?d\.?[ _-]?(?:dev(?:iation)?\.?|err(?:or)?\.?)?|st\.?[ _-]?dev(?:iation)?\.?"
    r"|standardabweichung|stabw"
    r"|[ée]cart[ -]type)(?:\.? ?(?:value|wert|of .{1,20}))?\W*"
)
# the first two letters of each of these
_BEGIN_OF_STATISTICS = frozenset(
    (
        *("me", "av", "mi", "mw", "mo", "ma", "su", "to", "ra"),
        *("sp", "va", "co", "cv", "sd", "rs", "st", "ec", "s."),
    )
)
_PAIRS = [(first, second) for first in map(chr, range(256)) for second in map(chr, range(256))]
# by the first two bytes of a cell, whether it begins as numbers do
_BEGINS_NUMBER = np.array(
    [a.isascii() and (a.isdigit() or (a in "+-." and b in "0123456789.")) for a, b in _PAIRS]
)
# by the first two bytes of a name, whether the line may be a comment, or begin with a word such as
# mean; signs that are neither ASCII letters nor those of numbers are looked at
_MAY_BE_OTHERWISE = np.array(
    [
        not (a.isascii() and (a.isalpha() or a in "0123456789+-."))
        or (a + b).lower() in _BEGIN_OF_STATISTICS
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
_EXCERPT = 500  # characters that are kept of a row that is refused
_AT_ONCE = 2_000  # rows that are searched for the decimal sign at a time
_WITH_POINTS = str.maketrans(",.", ".?")
_FORTRAN = re.compile(r"(?<=[\d.])[dD](?=[+-]?\d)")


class Most(NamedTuple):
    """The largest table that is read."""

    rows: int = 1_000_000
    columns: int = MOST_COLUMNS
    cell: int = LONGEST  #: characters

    def check(self, piece: Piece) -> None:
        """Check lines before they are taken apart, whatever separates their cells: TextError for
        one with too many cells or too long a cell.

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
    """Rows of a table in order, as text: each has as many cells as the head."""

    data: bytes  #: UTF-8; each row ends with a line feed
    ends: Places  #: the places of these line feeds
    lines: Places  #: the line of the file in which each row begins
    #: by the index of a row: its text, and why it is none of this table; its cells are empty
    faults: dict[int, tuple[str, str]]
    sep: str

    @property
    def has_quotes(self) -> bool:
        """Whether there is a quote."""
        return b'"' in self.data

    @property
    def is_cut_by_lines(self) -> bool:
        """Whether each line feed ends a row."""
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
        return _cells_of(text, self.sep)


def _cells_of(text: str, sep: str) -> list[str]:
    """Return the cells of a row."""
    if '"' not in text:
        return text.split(sep)
    return next(csv.reader(io.StringIO(text, newline="\n"), delimiter=sep), [])


def joined(cells: Iterable[object], sep: str) -> str:
    """Return cells as a row of text, those in quotes that need them.

    >>> joined(["a", "b;c", 1], ";")
    'a;"b;c";1'
    """
    stream = io.StringIO(newline="")
    csv.writer(stream, delimiter=sep, lineterminator="\n").writerow(cells)
    return stream.getvalue()[:-1]


# --- its rows -------------------------------------------------------------------------------------


class Account:
    """What each line of data is; TextError for one that cannot be any of it."""

    def __init__(self, layout: Layout, column_names: ColumnNames) -> None:
        self.layout, self._column_names = layout, column_names
        self._names = [split_unit(head)[0] for head in layout.heads]
        self._units = {
            name: scale_of(column_names.like[name], split_unit(layout.heads[i])[1] or "")
            for i, name in layout.inputs.items()
        }
        self._first_is_input = 0 in layout.inputs
        # every head has this name: looked for first, as most lines lack it
        groups = column_names.required_groups
        self.name = max((names[0] for names in groups if len(names) == 1), key=len, default="")
        self.repeated: list[int] = []  #: lines that have the head or its units again
        self.skipped: list[int] = []  #: those, and comments

    def row(self, line: int, text: str) -> tuple[str, str | None] | None:
        """Return the text of a row, with as many cells as the head, and its fault; None for a line
        that is none."""
        sep, width = self.layout.cell_sep, len(self.layout.heads)
        if not self._may_be_data(line, text):
            return None
        if text.count(sep) > 2 * width + 1000:  # no use in taking it apart
            return sep * (width - 1), irregular(text.count(sep) + 1, width)
        cells = _cells_of(text, sep)
        if not self._is_row(line, text, cells):
            return None
        if len(cells) == width:
            return text, None
        if len(cells) > width and not any(map(str.strip, cells[width:])):
            return joined(cells[:width], sep), None
        if len(cells) == width - 1 and self.layout.without_comments:
            return text + sep, None
        return sep * (width - 1), irregular(len(cells), width)

    def _may_be_data(self, line: int, text: str) -> bool:
        """Return whether a line is neither empty nor a comment; a name such as #1 in the first
        column makes no comment of a row that is whole."""
        layout = self.layout
        if not text.strip(f" \t{layout.sep}"):
            return False
        if not is_comment(text) or (
            not self._first_is_input and may_be_row(text, layout.sep, len(layout.heads))
        ):
            return True
        if "\n" in text:
            raise TextError(f"line {line}: a quote in a comment is not closed: leave it out")
        self.skipped.append(line)
        if self._may_be_head(text) and self._repeats_head(line, text):
            self.repeated.append(line)
            return False
        self._check_comment(line, text)
        return False

    def _may_be_head(self, text: str) -> bool:
        """Return whether a text has all names that a head needs, or begins another segment of
        LabVIEW."""
        if self.layout.labview and END_OF_HEADER in text:
            return True
        if self.name not in text:
            return False
        groups = self._column_names.required_groups
        return all(any(name in text for name in names) for names in groups)

    def _is_row(self, line: int, text: str, cells: list[str]) -> bool:
        """Return whether a line of cells is a row; False for the head or its units again."""
        first = next((cell for cell in cells if cell.strip()), "").strip()
        if self._may_be_head(text) and self._repeats_head(line, text):
            self.repeated.append(line)
            self.skipped.append(line)
            return False
        if first[:1].isdigit() and not (self.repeated and self.repeated[-1] == line - 1):
            return True
        if len(first) < 40 and _STATISTICS.fullmatch(first.lower()):
            remedy = self.layout.without(line)
            raise TextError(f"line {line}: {first!r} begins a row of statistics: {remedy}")
        inputs = [cells[i] for i in self.layout.inputs if i < len(cells)]
        may_be_units = not any(
            starts_as_number(cell) and cell.strip(" []()") != "1" for cell in inputs
        )
        if may_be_units and self._has_units(line, text):
            return False
        width = len(self.layout.heads)
        is_whole = len(cells) in (width, width - self.layout.without_comments)
        filled = [cell for cell in map(str.strip, cells[:1000]) if cell]
        is_title = len(filled) == 1 and width > 1 and not starts_as_number(first)
        if is_title or (
            not is_whole
            and not any(starts_as_number(cell) or cell.lower() in GAPS for cell in filled)
        ):
            shown = " ".join(text.split())[:60]
            remedy = self.layout.without(line)
            raise TextError(f"line {line}: {shown!r} is neither a row nor a comment: {remedy}")
        return True

    def _repeats_head(self, line: int, text: str) -> bool:
        """Return whether a line is the header again; TextError where it is another one."""
        layout, like = self.layout, self._column_names.like
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
            f"line {line} is another header, with other names or units: {layout.without(line)}"
        )

    def _has_units(self, line: int, text: str) -> bool:
        """Return whether a line has the units of the columns again; TextError where they are
        others."""
        layout, like = self.layout, self._column_names.like
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
        for name, unit in legend(text, [*self.layout.inputs.values()]):
            if scale_of(like[name], unit) != (self._units[name] or SI_UNIT):
                raise TextError(
                    f"line {line}: {name} is in {unit}, but not in the header: "
                    "leave one of them out"
                )
        self._has_units(line, text)


def rows_in(first: int, text: str, account: Account) -> tuple[Rows, str]:
    """Return the rows of lines, of which ``first`` is the number of the first, and the beginning of
    a row that goes on behind them.

    Lines that are something else than a row of numbers are looked at one by one.
    """
    sep = account.layout.cell_sep
    if account.layout.sep == BLANKS:
        text = "\n".join(
            sep.join(_BETWEEN_BLANKS.findall(line) if '"' in line else line.split())
            for line in text.split("\n")
        )
    data, bare, rest = _without_quotes(first, f"{text}\n".encode(), sep)
    ends = np.flatnonzero(np.frombuffer(bare, np.uint8) == _END)
    starts = np.concatenate([[0], ends[:-1] + 1])[: ends.size]
    lines = first + np.arange(ends.size)
    if data.count(b"\n") != ends.size:
        all_ends = np.flatnonzero(np.frombuffer(data, np.uint8) == _END)
        lines = first + np.searchsorted(all_ends, starts)
    lengths, keep, faults = (
        ends - starts,
        np.ones(ends.size, np.bool_),
        dict[int, tuple[str, str]](),
    )
    parts, end = list[bytes](), 0
    for i in _doubtful(account, data, bare, starts, ends):
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


def _without_quotes(first: int, data: bytes, sep: str) -> tuple[bytes, bytes, str]:
    """Return rows, the same with zeros in place of quoted cells, and the beginning of a row whose
    quote is not closed; TextError where a quote is not at the end of its cell."""
    if b'"' not in data:
        return data, data, ""
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
    account: Account, data: bytes, bare: bytes, starts: Places, ends: Places
) -> list[int]:
    """Return the rows that are looked at one by one: those that do not begin as numbers do, have
    not as many cells as the head, or may be the header again."""
    if not ends.size:
        return []
    signs = np.frombuffer(data, np.uint8)
    seps = np.flatnonzero(np.frombuffer(bare, np.uint8) == ord(account.layout.cell_sep))
    before = np.searchsorted(seps, starts)
    is_doubtful = np.searchsorted(seps, ends) - before != len(account.layout.heads) - 1
    place = min(account.layout.inputs, default=0)
    first = starts
    if place and seps.size:  # a name stands first: what matters is the first cell of an input, too
        is_doubtful |= _MAY_BE_OTHERWISE[_begin_of(starts, signs)]
        first = np.minimum(seps[np.minimum(before + place, seps.size) - 1] + 1, signs.size - 1)
    is_doubtful |= ~_BEGINS_NUMBER[_begin_of(first, signs)]
    # the row of units below the header again may begin like a number
    is_doubtful[0] |= bool(account.repeated)
    place = data.find(name := account.name.encode())
    while place >= 0:
        i = int(np.searchsorted(ends, place))
        is_doubtful[i : i + 2] = True
        place = data.find(name, int(ends[i]))
    doubtful: list[int] = np.flatnonzero(is_doubtful).tolist()
    return doubtful


def irregular(count: int, width: int) -> str:
    """Return what is wrong with a row of so many cells."""
    cells = "cell" if count == 1 else "cells"
    return f"has {count:,} {cells}, the header has {width:,}"


def _begin_of(cells: Places, signs: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Return the first two bytes of the cells that begin at places, behind a quote."""
    last = signs.size - 1
    first = cells + (signs[cells] == _QUOTE)
    second = np.minimum(first + 1, last)
    pairs: NDArray[np.uint16] = 256 * signs[np.minimum(first, last)].astype(np.uint16)
    pairs += signs[second]
    return pairs


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
    """Return why a cell has no number."""
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
        return f"must be a number alone: write its unit into the header, as in {like} [{unit}]"
    return "must be a number"


def numbers_of(
    cells: Iterable[str | None], like: str, signs: Signs, scale: Scale = SI_UNIT
) -> tuple[Array, Array, dict[int, str]]:
    """Return the numbers in cells in their own unit and in SI, NaN for a gap, and what is wrong
    with other cells, by their index; see :func:`read_cell`.

    >>> numbers_of(["1,5", "-", "x"], "v0", Signs(",", None), Scale(over=1e3))
    (array([1.5, nan, nan]), array([0.0015,    nan,    nan]), {2: 'must be a number'})
    """
    texts = [cell or "" for cell in cells]
    values, others = np.full(len(texts), math.nan), list[int]()
    for i, text in enumerate(texts):
        # where commas are decimal, a point is none
        plain = text.translate(_WITH_POINTS) if signs.decimal == "," else text
        try:
            values[i] = float(_FORTRAN.sub("e", plain) if "D" in plain or "d" in plain else plain)
        except ValueError:
            others.append(i)
            continue
        if not (math.isfinite(values[i]) and plain.isascii()) or "_" in plain:
            others.append(i)
    with np.errstate(over="ignore"):
        si: Array = values * scale.times / scale.over
    faults: dict[int, str] = {}
    for i in [*others, *np.flatnonzero(np.isinf(si)).tolist()]:
        values[i] = si[i] = math.nan
        try:
            si[i] = read_cell(like, texts[i], signs, scale)
            values[i] = float(f"{si[i] * scale.over / scale.times:.15g}")
        except ValueError as error:
            faults[i] = str(error)
    return values, si, faults


# --- whole tables ---------------------------------------------------------------------------------


class TextTable:
    """A table in a file, or in bytes: how it is written, and its rows in pieces.

    TextError tells why it is none; every piece is checked before it is taken apart.
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
        for piece in text:
            check(piece)
            start += piece.lines
            if len(start) >= LOOKED_AT:
                break
        self.layout = find_layout(start, column_names, self._dialect, text.encoding)
        self.signs = self._dialect.signs(self.layout)
        self.account = Account(self.layout, column_names)

    @property
    def read_as(self) -> str:
        """How the table was read, once it is."""
        return self._said + self.layout.described(self.signs) + again(self.account.repeated)

    def find_signs(self) -> None:
        """Look for the signs of numbers in the first rows, and then in the first piece."""
        for last in (self.layout.first + _AT_ONCE, None):
            rows = None if self.signs.decimal else next(self.rows(last=last), None)
            if rows is not None:
                self.see_signs(rows)

    def rows(
        self,
        report_place: Callable[[int], None] = lambda _at: None,
        last: int | None = None,
    ) -> Iterator[Rows]:
        """Yield the rows in pieces, down to the line ``last``; ``report_place`` is told how far a
        file is read."""
        self.account = Account(self.layout, self._column_names)
        rest, behind = "", self.layout.first
        ends = [line for line in (last, self.layout.last) if line is not None]
        end = min(ends, default=None)
        for piece in self._text(report_place):
            self._check(piece)
            first, text = _between(piece, self.layout.first, end)
            if text is None:
                continue
            if rest:
                first, text = behind - rest.count("\n") - 1, f"{rest}\n{text}"
            behind = first + text.count("\n") + 1
            rows, rest = rows_in(first, text, self.account)
            if len(rest) > LONGEST:
                break
            yield rows
        if rest:
            raise _unclosed(behind - rest.count("\n") - 1)

    def see_signs(self, rows: Rows) -> None:
        """Look at the numbers of some rows until they tell what their signs are."""
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

    def _text(self, report_place: Callable[[int], None] = lambda _at: None) -> Text:
        """Return the text from its beginning."""
        source = self._source
        pieces = [source] if isinstance(source, bytes) else file_pieces(source, report_place)
        return Text(pieces, self._dialect.encoding)


def _between(piece: Piece, first: int, last: int | None) -> tuple[int, str | None]:
    """Return the lines of a piece from ``first`` to ``last``, and the number of the first of them;
    None where there are none."""
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
    """Return a table as text: of a workbook the sheet that has the names, how it is written, and
    what is to be said of the sheets."""
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
        return is_known(layout.heads, column_names)

    data, said = read_sheet(source, dialect.sheet, dialect.decimal, has_names)
    return data, dialect._replace(sep=SEP, encoding="utf-8"), said


class TableOfNumbers(NamedTuple):
    """Columns of numbers that were read."""

    columns: dict[str, Array]  #: by name, in SI, (n,)
    in_own_units: dict[str, Array]  #: the same in the units of the table
    units: dict[str, str]  #: of each column in the table; the SI unit where it has none
    lines: list[int]  #: of each row
    skipped: list[int]  #: lines that are neither head nor units nor rows, and not empty
    read_as: str  #: what was found out, see :meth:`Layout.described`


def read_numbers(
    source: Path | bytes,
    column_names: ColumnNames,
    dialect: Dialect,
    most: Most = Most(),  # noqa: B008
) -> TableOfNumbers:
    """Return the columns of a table that mean something, in SI, from a file or its bytes.

    TextError tells all that is wrong: its ``faults`` are one for each line.

    >>> data = "Rig 7\\n\\nv0\\tmu_macro\\nmm/s\\t%\\n1,5\\t7\\n2,5\\t9\\n".encode()
    >>> names = ColumnNames({"v0": "v0", "mu_macro": "mu0"}, [["v0"]])
    >>> table = read_numbers(data, names, Dialect())
    >>> table.columns["mu_macro"].tolist(), table.skipped
    ([0.07, 0.09], [1])
    >>> table.read_as
    'tab, decimal comma, header in line 3, units in line 4; v0 [mm/s], mu_macro [%]'
    """
    table = TextTable(source, column_names, dialect, most.check)
    layout, signs = table.layout, table.signs
    columns, faults = find_heads(layout.heads, column_names.like)
    missing = [
        group[0] for group in column_names.required_groups if not columns.keys() & set(group)
    ]
    if missing:
        faults.append(absent(missing, layout.heads))
    if faults:
        raise TextError.of([f"line {layout.head}: {fault}" for fault in faults])
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
        raise TextError(f"line {layout.head}: no row follows the names of the columns")
    signs.see(
        Cell(line, name, cells[i])
        for line, cells in zip(lines, rows, strict=True)
        for name, (i, _) in columns.items()
    )
    si, own = dict[str, Array](), dict[str, Array]()
    for name, (i, scale) in columns.items():
        texts = [cells[i] for cells in rows]
        own[name], si[name], bad = numbers_of(texts, column_names.like[name], signs, scale)
        for j in np.flatnonzero(np.isnan(si[name])).tolist():
            fault = f"{bad[j]}, got {texts[j].strip()[:80]!r}" if j in bad else "is missing"
            wrong.append((lines[j], f"line {lines[j]}: {name} {fault}"))
    if wrong:
        raise TextError.of([fault for _, fault in sorted(wrong, key=lambda one: one[0])])
    units = {
        name: split_unit(layout.heads[i])[1] or unit_of(name) for name, (i, _) in columns.items()
    }
    skipped = sorted({*layout.skipped, *table.account.skipped})
    return TableOfNumbers(si, own, units, lines, skipped, table.read_as)


def again(lines: list[int]) -> str:
    """Return what is said of lines that have the head or its units again.

    >>> again([7]), again([])
    ('; the header again in line 7, left out', '')
    """
    if not lines:
        return ""
    more = f" and {len(lines) - 5:,} more" if len(lines) > 5 else ""
    places = ", ".join(map(str, lines[:5])) + more
    return f"; the header again in line{'s' * (len(lines) > 1)} {places}, left out"


def read_columns(
    source: Path | bytes,
    like: Mapping[str, str],
    dialect: Dialect = Dialect(),  # noqa: B008
    most: Most = Most(),  # noqa: B008
) -> TableOfNumbers:
    """Return named columns of numbers of a table, all of which it must have.

    ``like`` has their names, each with the input whose units it has.

    >>> data = b"t,x [um],Ft\\n0,1.5,0.2\\n1,2.5,0.3\\n"
    >>> read_columns(data, {"x": "y0", "Ft": "Fz"}).columns["x"].tolist()
    [1.5e-06, 2.5e-06]
    """
    return read_numbers(source, ColumnNames(like, [(name,) for name in like]), dialect, most)

"""Find how a table as text is laid out: its header, from the first lines, and the units of its
columns, from every line that has some.

The header is the first line with all necessary names.  Units are next to the names, in a row of
their own (above, below, in a comment), or in a legend such as ``# v0: speed [mm/s]``.  A unit that
belongs to no column, or that contradicts another one, is refused with its line.
:class:`mumacro.inputs.text_tables.TextTable` says what the other lines are.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import islice, pairwise
from typing import NamedTuple

from mumacro.errors import TextError
from mumacro.inputs.cells import (
    BLANKS,
    MOST_COLUMNS,
    NO_UNIT,
    Signs,
    is_comment,
    is_unit,
    records,
    split_header,
    starts_as_number,
    uncommented,
)
from mumacro.inputs.decoding import Piece
from mumacro.inputs.names import ColumnNames, heading, meant_by, split_unit
from mumacro.inputs.units import Scale, scale_of, unit_of

#: separators of the cells, by the name in an option
SEPARATORS = {",": ",", ";": ";", "|": "|", "tab": "\t", "blanks": BLANKS}
LOOKED_AT = 2_000  #: the header must be within this number of lines
#: what LabVIEW writes after each of its headers
END_OF_HEADER = "***End_of_Header***"
_SEP_LINE = re.compile(r'\ufeff?"?sep=([,;|\t])"?', re.IGNORECASE)
_LABEL_OF_NAMES = re.compile(r"[^\W\d]\w{0,19}:\s+")  # before the names in a comment


class Dialect(NamedTuple):
    """Hold what is known about the layout of a table before its header is found: what a person
    says, and then what the table says about itself.  None means that it is to be found."""

    sep: str | None = None  #: a character, or :data:`BLANKS`
    decimal: str | None = None
    thousands: str | None = None  #: empty if there is none
    encoding: str | None = None
    skip: int = 0  #: lines to leave out at the beginning
    dashes: str = "--"  #: text before the name of an option, in messages
    rows: tuple[int, int] | None = None  #: the first and the last line of data
    sheet: str | None = None  #: sheet of a workbook
    labview: bool = False  #: whether LabVIEW wrote the table
    units: int | None = None  #: index of a line of LabVIEW with the units of the columns

    @property
    def signs(self) -> Signs:
        """Return the separators in numbers that are known.  Raise TextError if they are the
        same."""
        decimal, thousands = self.decimal, self.thousands
        if decimal and decimal == thousands:
            options = f"{self.dashes}decimal and {self.dashes}thousands"
            raise TextError(f"{options} are both {thousands!r}; give one of them")
        return Signs(decimal or {".": ",", ",": "."}.get(thousands or "", ""), thousands)

    def completed(self, lines: Sequence[str]) -> "Dialect":
        """Return also what a line ``sep=;`` or the first lines of LabVIEW say."""
        first = next((line for line in lines if line.strip()), "")
        if match := _SEP_LINE.fullmatch(first.rstrip("\n")):
            return self._replace(sep=self.sep or match[1])
        if not first.lstrip("\ufeff").startswith("LabVIEW Measurement"):
            return self
        sep, decimal, units, ends = "\t", self.decimal, None, 0
        for i, line in enumerate(lines[:LOOKED_AT]):
            tag, *values = re.split(r"[\t,]", line.strip(), maxsplit=1)
            value = values[0].strip() if values else ""
            ends += tag == END_OF_HEADER
            if tag == "Separator":
                sep = "," if value.lower() == "comma" else "\t"
            elif tag == "Decimal_Separator" and not self.decimal:
                decimal = value if value in (".", ",") else None
            elif tag == "Y_Unit_Label" and ends < 2:
                units = i
        return self._replace(sep=self.sep or sep, decimal=decimal, labview=True, units=units)


class Header(NamedTuple):
    """Hold the line with the names of the columns."""

    start: int  #: its line, from 0
    end: int  #: the next line after it
    sep: str
    cells: list[str]


def find_header(lines: list[str], column_names: ColumnNames, dialect: Dialect) -> Header:
    """Return the first line that has all necessary names and fits the next row.  If a person names
    the rows, return the last such line before them.

    If no line has the names, return the line that is most probably meant as a header.  Raise
    TextError if there is no line at all, or if there are rows before the header.
    """
    seps = (dialect.sep,) if dialect.sep else tuple(SEPARATORS.values())
    candidates = [*islice(_headers_in(lines, dialect.skip, seps, column_names), 20)]
    if dialect.rows:
        candidates = [one for one in candidates if one.start + 1 < dialect.rows[0]][::-1]
    header = next((one for one in candidates if _fits(one, lines, dialect.labview)), None)
    header = header or (candidates[0] if candidates else _likely_header(lines, dialect.skip, seps))
    if not dialect.rows:
        for one in candidates:
            if one.start < header.start:
                _refuse_rows_between(one, header, lines, dialect)
    for one in candidates:  # the names in a comment may be above the header itself
        between = lines[header.start : one.start]
        if between and all(is_comment(line) or not line.strip() for line in between):
            return one
    return header


def _refuse_rows_between(
    before: Header, header: Header, lines: list[str], dialect: Dialect
) -> None:
    """Refuse a table that has rows between a header that does not fit them and the header that
    fits."""
    for i in range(before.end, header.start):
        cells = [] if is_comment(lines[i]) else split_header(lines[i], before.sep)
        if len(cells) > 1 and any(map(starts_as_number, cells)):
            skip = f"{dialect.dashes}skip {header.start} leaves them out"
            raise TextError(
                f"line {i + 1}: rows of a segment stand between the headers of lines "
                f"{before.start + 1} and {header.start + 1}: "
                f"{skip if dialect.dashes else 'give the rows of one'}"
            )


def _headers_in(
    lines: Sequence[str], skip: int, seps: Sequence[str], column_names: ColumnNames
) -> Iterator[Header]:
    """Yield the lines that have all necessary names."""
    for i in range(skip, min(len(lines), LOOKED_AT)):
        # with an odd number of quotes a cell continues in the next line
        if not column_names.may_be_in(lines[i]) and lines[i].count('"') % 2 == 0:
            continue
        for sep in seps:
            text = _record(lines, i, sep)
            if sep not in text and sep != BLANKS:
                continue
            bare = uncommented(text)
            texts = [bare]
            if bare != text and (label := _LABEL_OF_NAMES.match(bare)):  # "# columns: v0 mu_macro"
                texts.append(bare[label.end() :])
            for bare in texts:
                cells = split_header(bare, sep)
                if column_names.heads_in(cells):
                    yield Header(i, i + 1 + text.count("\n"), sep, cells)


def _record(lines: Sequence[str], i: int, sep: str) -> str:
    """Return the record that begins in a line: up to 20 lines, or the line if its quotes have
    another meaning."""
    if '"' in lines[i] and sep != BLANKS:
        with suppress(TextError):
            record = next(records(Piece(i, "\n".join(lines[i : i + 20])), sep, is_comment))
            return lines[i] if record.is_open else record.text
    return lines[i]


def _fits(header: Header, lines: Sequence[str], labview: bool) -> bool:
    """Return whether the row after a header has as many cells."""
    width = len(header.cells)
    for i in range(header.end, len(lines)):
        if lines[i].strip() and not is_comment(lines[i]):
            cells = split_header(_record(lines, i, header.sep), header.sep)
            return len(cells) in (width, width - labview) or not any(cells[width:] or ["x"])
    return True


def _likely_header(lines: Sequence[str], skip: int, seps: Sequence[str]) -> Header:
    """Return the line that is probably meant as a header: a line whose names are similar to those
    of inputs, or the line above the first numbers."""
    first = next((i for i in range(skip, len(lines)) if lines[i].strip()), None)
    if first is None:
        raise TextError(f"line {skip + 1}: must name the columns, and is empty")
    cells = split_header(lines[first][:10_000], seps[0])[:MOST_COLUMNS]
    best, most = Header(first, first + 1, seps[0], cells), 0.0
    for i in range(skip, min(len(lines), LOOKED_AT)):
        for sep in seps:
            cells = split_header(uncommented(lines[i][:100_000]), sep)
            if not any(cells):
                continue
            alike = sum(meant_by(cell, loosely=False) is not None for cell in cells[:200])
            below = split_header(lines[i + 1][:10_000], sep) if i + 1 < len(lines) else []
            numbers = sum(map(starts_as_number, below))
            is_above = len(below) == len(cells) and numbers > len(cells) // 2
            score = alike + 0.5 * is_above + 0.01 * (sep in lines[i])
            if not any(map(starts_as_number, cells)) and score > most:
                best, most = Header(i, i + 1, sep, cells), score
    return best


# --- units ----------------------------------------------------------------------------------------

SI_UNIT = Scale()
_LONGEST = 20  # characters of a unit
_ABOVE = 4  # units may be within this number of lines above the names
# words before the units in their row
_LABEL = re.compile(r"(?:units?|einheit(?:en)?|unités?|[a-z]+_units)\W*", re.IGNORECASE)
_LABEL_BEFORE = re.compile(r"(?:units?|einheit(?:en)?|unités?)\s*[:=]\s*", re.IGNORECASE)
_BETWEEN_BLANKS = re.compile(r"\[[^\[\]]*\]|\([^()]*\)|\S+")  # a unit
# of a legend, after the name of a column
_BRACKET = re.compile(r"\s*(?:[:=]\s*)?([\[(])([^\[\]()]{0,40})[\])]")
_LAST_BRACKET = re.compile(r"([\[(])([^\[\]()]{0,40})[\])][\s.;,]*$")
_LAST_WORD = re.compile(r"(?:\bin|[,:=])\s+(\S{1,20})$")
_A_NUMBER = re.compile(r"(?<![\w/^.\-])[+-]?\d")
_BETWEEN_CELLS = re.compile(r"[\t;,|]")
_BEGINNING, _OF_WORD = re.compile(r"(?<![\w.])\S"), re.compile(r"\w")  # of a name in a sentence
# "speed unit: mm/s", "# Sliding speed [mm/s]": with a name that no column has
_OF_ANOTHER_NAME = re.compile(
    r"[#%!/\s]*(?P<what>[^\W\d][^\d\[\](),;|]{0,60}?)\s*"
    r"(?:[\[(](?P<unit>[^\[\]()]{1,20})[\])]|[:=] ?(?P<last>[^\s\[\]()]{1,20}))"
)
_ECSV_COLUMN = re.compile(r"\{[^{}]*\}")
_ECSV_NAME, _ECSV_UNIT = (
    re.compile(rf"\b{word}: *['\"]?([^,'\"}}]*)") for word in ("name", "unit")
)


class ColumnUnits:
    """Hold the columns of a table: their names, and the units that lines have given so far.

    After the first row, a column without a unit is in SI.
    """

    def __init__(self, cells: Sequence[str], sep: str, input_of: Mapping[str, str]) -> None:
        self._sep, self._input_of = sep, input_of
        #: after the first row: the remedy for a line that contradicts the units
        self.remedy: Callable[[int], str] | None = None
        self._heads = [heading(cell, input_of) for cell in cells]
        in_header = [split_unit(head) for head in self._heads]
        self.names = [name for name, _ in in_header]
        #: by index: the columns that have a meaning
        self.inputs = {i: name for i, name in enumerate(self.names) if name in input_of}
        # by index: the unit, and the line that says it if this is not the header
        self._units = {i: unit for i, (_, unit) in enumerate(in_header) if unit is not None}
        self._line_of = dict[int, int]()
        self.lines = set[int]()  #: lines with units, from 1

    @property
    def heads(self) -> list[str]:
        """Return the names of the columns, with their units in brackets."""
        return [
            f"{head} [{self._units[i]}]" if i in self._line_of and self._units[i] else head
            for i, head in enumerate(self._heads)
        ]

    def of_inputs(self) -> dict[str, str]:
        """Return the unit of each input; the SI unit if the table has none."""
        return {name: self._units.get(i) or unit_of(name) for i, name in self.inputs.items()}

    def agrees(self, i: int, unit: str | None) -> bool:
        """Return whether a unit is the unit of an input's column; None stands for the SI unit."""
        return self._scale(i, unit or "") == self._scale(i, self._units.get(i, ""))

    def _scale(self, i: int, unit: str) -> Scale:
        return scale_of(self._input_of[self.names[i]], unit) or SI_UNIT

    def take_above(self, lines: Sequence[str], skip: int) -> None:
        """Take the units in the lines above the header, after the first ``skip``: a row close to
        the header, legends, and comments of ECSV."""
        above = [i for i in reversed(range(skip, len(lines))) if lines[i].strip()]
        row = next((i for i in above[:_ABOVE] if self.take_row(i + 1, lines[i])), None)
        if any("%ECSV" in lines[i][:20] for i in above):
            self.take_ecsv(lines)
            return
        for i in reversed(above):
            if i != row:
                self.take_legend(i + 1, lines[i])

    def take(self, line: int, text: str) -> None:
        """Take the units in a line, either a row of units or a legend."""
        if not self.take_row(line, text):
            self.take_legend(line, text)

    def take_legend(self, line: int, text: str) -> None:
        """Take the units after the names of columns in a line."""
        legend = [*units_in_legend(text, [*self.inputs.values()])]
        for name, unit in legend:
            self._take_one(line, self.names.index(name), unit)
        if not legend and self.remedy is None:
            self._refuse_of_another_name(line, text)

    def take_row(self, line: int, text: str, is_no_row: bool = False) -> bool:
        """Take the units of a line that contains only units.  Return whether it is such a line.
        Raise TextError if the units belong to no column.

        If ``is_no_row`` is true for the line and it is not a comment, columns that are not inputs
        may hold any text.
        """
        if len(text) > 100_000:
            return False
        bare = uncommented(text)
        if is_comment(text) and (label := _LABEL_BEFORE.match(bare)):
            bare = bare[label.end() :]
        width, in_columns = len(self.names), self._sep != BLANKS
        if in_columns:
            cells = split_header(bare, self._sep)
        else:
            cells = _BETWEEN_BLANKS.findall(re.sub(r"(?<=\w)\s?/\s?(?=\w)", "/", bare[:10_000]))
            if cells and _LABEL.fullmatch(cells[0]) and len(cells) != width:
                cells = cells[1:]
        units = [cell.strip(" \t[]()'\"") for cell in cells]
        units = ["" if _LABEL.fullmatch(unit) else unit for unit in units]
        filled = [unit for unit in units if unit not in NO_UNIT]
        known = [unit for unit in filled if is_unit(unit)]
        if not known or any(map(starts_as_number, filled)):  # or a setting with its unit
            return False
        if not any(units[width:]):
            units, cells = units[:width], cells[:width]
        is_whole = len(cells) == width > 1
        is_sure = len([*filter(None, units)]) > 1 or any(sign in bare for sign in "/%[")
        fits = (is_whole or (in_columns and 1 < len(cells) <= width)) and all(
            i >= len(units)
            or units[i] in NO_UNIT
            or scale_of(self._input_of[name], units[i]) is not None
            for i, name in self.inputs.items()
        )
        are_short = all(is_unit(unit) or len(unit) < 8 for unit in filled)
        if fits and ((is_no_row and is_whole) or (are_short and (is_sure or width > 2))):
            self.take_cells(line, units)
            return True
        if is_sure and 2 * len(known) > len(filled):
            shown = " ".join(text.split())[:60]
            raise TextError(
                f"line {line}: {shown!r} has units that cannot be assigned to the columns "
                f"{', '.join(self.names[:8])}: write each behind its name, as in v0 [mm/s]"
            )
        return False

    def take_cells(self, line: int, units: Sequence[str]) -> None:
        """Take the unit of each column; skip an empty one."""
        for i, unit in enumerate(units[: len(self.names)]):
            if unit:
                self._take_one(line, i, unit)

    def _take_one(self, line: int, i: int, unit: str) -> None:
        """Take the unit of one column."""
        name, before = self.names[i], self._units.get(i)
        if name in self._input_of:
            if unit in NO_UNIT and before is not None:
                return
            if scale_of(self._input_of[name], unit) is None:
                raise TextError(f"line {line}: {unit[:40]!r} is no unit of {name}")
            if (before is not None or self.remedy) and not self.agrees(i, unit):
                raise self._contradiction(line, i, unit)
        if self.remedy:
            return
        self.lines.add(line)
        if before is None:
            self._units[i] = "" if unit in NO_UNIT or len(unit) > _LONGEST else unit
            self._line_of[i] = line

    def _contradiction(self, line: int, i: int, unit: str) -> TextError:
        """Return the error for a line with another unit of a column than the one that it has."""
        name, before = self.names[i], self._units.get(i)
        if before is None:
            says = "the rows before are in"
            remedy = f"write the unit behind the name, as in {name} [{unit}]"
        else:
            says = f"line {self._line_of[i]} says" if i in self._line_of else "the header says"
            remedy = self.remedy(line) if self.remedy else "leave one of them out"
        what = f"{name} is in {unit}, {says} {before or unit_of(name)}"
        return TextError(f"line {line}: {what}: {remedy}")

    def _refuse_of_another_name(self, line: int, text: str) -> None:
        """Refuse a line with a unit (other than SI) for something that may be a column whose unit
        is unknown."""
        match = _OF_ANOTHER_NAME.fullmatch(" ".join(text[:100].split()))
        if match is None:
            return
        what, unit = match["what"], match["unit"] or match["last"]
        field = meant_by(what.replace("unit", "").strip(" :="), loosely=False)
        for i, name in self.inputs.items():
            if i in self._units or scale_of(self._input_of[name], unit) in (None, SI_UNIT):
                continue
            if field == name or "unit" in what.lower():
                raise TextError(
                    f"line {line}: {what!r} has the unit {unit}, and {name} has none: write it "
                    f"behind the name, as in {name} [{unit}]"
                )

    def take_ecsv(self, lines: Sequence[str]) -> None:
        """Take the units of the columns from the comments of an ECSV file, which are YAML."""
        text, starts = "", list[tuple[int, int]]()
        for number, line in enumerate(lines, 1):
            if is_comment(line):
                starts.append((len(text), number))
                text += uncommented(line) + " "
        for column in _ECSV_COLUMN.finditer(text[:1_000_000]):
            name, unit = (pattern.search(column[0]) for pattern in (_ECSV_NAME, _ECSV_UNIT))
            if name and unit and name[1].strip() in self.names:
                number = next(n for start, n in reversed(starts) if start <= column.start())
                place = self.names.index(name[1].strip())
                self._take_one(number, place, unit[1].strip())


def units_in_legend(line: str, names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield the names of columns and their units from a line such as ``# v0: speed [mm/s]``.

    >>> [*units_in_legend("# v0: sliding speed [mm/s], mu_macro in %", ["v0", "mu_macro"])]
    [('v0', 'mm/s'), ('mu_macro', '%')]
    >>> [*units_in_legend("v0;double;mm/s;100", ["v0"])], [*units_in_legend("v0;3;mm/s", ["v0"])]
    ([('v0', 'mm/s')], [])
    """
    if len(line) > 2_000 or not any(name in line for name in names):
        return
    first, *cells = _BETWEEN_CELLS.split(uncommented(line))
    if first.strip(" \"'") in names:  # a line for each column, with its own cells
        texts = [cell.strip(" []()\"'") for cell in cells]
        numbers = [i for i, text in enumerate(texts) if starts_as_number(text)]
        units = [text for text in texts[: min(numbers, default=None)] if is_unit(text)]
        if len(units := [unit for unit in units if unit not in NO_UNIT]) == 1:
            yield first.strip(" \"'"), units[0]
            return
    present = [name for name in names if name and name in line]
    for (start, name), (end, _) in pairwise([*_places_of_names(line, present), (len(line), "")]):
        behind = line[start + len(name) : end].rstrip(" ,;|\t\"'.")
        unit = _unit_in_legend(behind)
        if unit is not None:
            yield name, unit


def _places_of_names(line: str, names: Sequence[str]) -> Iterator[tuple[int, str]]:
    """Yield where a name occurs as a word in a line; if several names do, the longest.

    >>> [*_places_of_names("v0 and v0_set, mu.v0", ["v0", "v0_set"])]
    [(0, 'v0'), (7, 'v0_set')]
    """
    longest_first, end = sorted(names, key=len, reverse=True), 0
    for place in _BEGINNING.finditer(line):
        start = place.start()
        for name in longest_first if start >= end else ():
            behind = start + len(name)
            if line.startswith(name, start) and not _OF_WORD.match(line, behind):
                yield start, name
                end = behind
                break


def _unit_in_legend(behind: str) -> str | None:
    """Return the unit in the text after a name, or None if there is none."""
    match = _BRACKET.match(behind)
    if match is None:
        if _A_NUMBER.search(behind):  # a value, or a range of values
            return None
        match = _LAST_BRACKET.search(behind)
    if match is not None:
        unit = match[2].strip()
        looks = is_unit(unit) or (match[1] == "[" and not re.search(r"\s|^\d*$", unit))
        return unit if looks and unit not in NO_UNIT else None
    bare = behind.strip(" :=,\t")
    if bare and is_unit(bare) and bare not in NO_UNIT:
        return bare
    last = _LAST_WORD.search(behind)
    return last[1] if last and is_unit(last[1]) and last[1] not in NO_UNIT else None

"""Decide for each line of a table what it is.

A line is before the header, the header, units, data, a comment, a ruler or empty.  Any other line
(another header, another segment, a row of statistics) is refused with its number and with the
option that leaves it out.
"""

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from mumacro.errors import TextError
from mumacro.inputs.cells import (
    BLANKS,
    COMMENT,
    is_comment,
    joined,
    may_be_value,
    split_header,
    split_row,
    starts_as_number,
    uncommented,
)
from mumacro.inputs.column_units import ColumnUnits
from mumacro.inputs.names import heading
from mumacro.inputs.units import split_unit

#: what LabVIEW writes after each of its headers
END_OF_HEADER = "***End_of_Header***"
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


class ColumnNames(NamedTuple):
    """Name the columns of a table that have a meaning."""

    input_of: Mapping[str, str]  #: by name: the input whose units the column has
    #: of each of these lists, one name must be in the table
    required_groups: Sequence[Sequence[str]]

    def are_all_in(self, heads: Sequence[str]) -> bool:
        """Return whether the headers contain all necessary names."""
        names = {split_unit(head)[0] for head in heads}
        return all(names.intersection(group) for group in self.required_groups)

    def may_be_in(self, text: str) -> bool:
        """Return whether a text contains all necessary names, as words or within other words."""
        return all(any(name in text for name in names) for names in self.required_groups)


class Header(NamedTuple):
    """Hold the line with the names of the columns."""

    start: int  #: its line, from 0
    end: int  #: the next line after it
    sep: str
    cells: list[str]


class Account:
    """Decide what each line after the header is."""

    def __init__(
        self,
        header: Header,
        units: ColumnUnits,
        column_names: ColumnNames,
        dashes: str = "--",
        labview: bool = False,
        first: int | None = None,
    ) -> None:
        self.header, self.units, self._column_names = header, units, column_names
        self._dashes, self._labview = dashes, labview
        self.width = len(units.names)
        #: separator of the cells in rows, after blanks were replaced by tabs
        self.sep = "\t" if header.sep == BLANKS else header.sep
        # rows of LabVIEW may end before the last column
        self.may_lack_last = labview and units.names[-1:] == ["Comment"]
        self.first = first  #: the line of the first row, when it is known
        # every header has this name; most lines do not, so it is searched first
        groups = column_names.required_groups
        self.name = max((names[0] for names in groups if len(names) == 1), key=len, default="")
        self.repeated: list[int] = []  #: lines that repeat the header or its units
        self.skipped: list[int] = []  #: repeated lines, comments and rulers

    def remedy(self, line: int) -> str:
        """Return the remedy for a line that does not belong to the rows."""
        if not self._dashes:
            return "give the rows alone"
        if self.first is not None and line > self.first:
            return f"{self._dashes}rows {self.first}..{line - 1} reads those before it"
        return f"{self._dashes}rows A..B says which lines are data"

    def row(self, line: int, text: str) -> tuple[str, str | None] | None:
        """Return the text of a row, with as many cells as the header, and its fault.  Return None
        if the line is not a row."""
        width, empty = self.width, self.sep * (self.width - 1)
        if self._is_plain(text):
            return text, None
        if text.count(self.sep) > 2 * width + 1000 and not is_comment(text):  # too long to be split
            return empty, irregular(text.count(self.sep) + 1, width)
        if not self.is_row(line, text):
            return None
        cells = split_row(text, self.sep)
        if len(cells) == width:
            return text, None
        if len(cells) > width and not any(map(str.strip, cells[width:])):
            return joined(cells[:width], self.sep), None
        if len(cells) == width - 1 and self.may_lack_last:
            return text + self.sep, None
        return empty, irregular(len(cells), width)

    def _is_plain(self, text: str) -> bool:
        """Return whether a line needs no closer look, as most rows do: after the first row, all
        inputs begin like numbers, and so does the first cell."""
        if self.first is None or 0 not in self.units.inputs or '"' in text:
            return False
        cells = text.split(self.sep, self.width)
        return len(cells) == self.width and all(
            cells[i].lstrip("+-.")[:1] in _DIGITS for i in self.units.inputs
        )

    def is_row(self, line: int, text: str) -> bool:
        """Return whether a line is a row.  Raise TextError if it has no meaning at all."""
        if not text.strip(f" \t{self.header.sep}"):
            return False
        if self._may_be_header(text) and self._repeats_header(line, text):
            return self._skip(line, again=True)
        if is_comment(text) and not (self.has_name(text) and len(self._cells(text)) == self.width):
            if "\n" in text:
                raise TextError(f"line {line}: a quote in a comment is not closed: leave it out")
            self.units.take(line, text, self._remedy_of_units(line))
            return self._skip(line)
        if not text.strip(_OF_RULER) and _RULER.search(text):
            return self._skip(line)
        cells = [cell.strip() for cell in self._cells(text)]
        first = next((cell for cell in cells if cell), "")
        if not first:  # a blank line whose cells are in quotes
            return False
        if names_statistics(first):
            what = f"{first!r} begins a row of statistics"
            raise TextError(f"line {line}: {what}: {self.remedy(line)}")
        filled = [cells[i] for i in self.units.inputs if i < len(cells) and cells[i]]
        may_be_units = all(not starts_as_number(cell) or cell == "1" for cell in filled)
        if may_be_units and self.units.take_row(line, text, self._remedy_of_units(line), True):
            return self._skip(line, again=self.first is not None)
        if not self._holds_values(cells, filled):
            shown = " ".join(text.split())[:60]
            remedy = self.remedy(line)
            raise TextError(f"line {line}: {shown!r} is neither a row nor a comment: {remedy}")
        if self.first is None:
            self.first = line
        self.units.rows_begun = True
        return True

    def _holds_values(self, cells: Sequence[str], filled: Sequence[str]) -> bool:
        """Return whether some of the ``filled`` cells of inputs may be a value.  A row without any
        value is a row with gaps if it is complete and more than a title."""
        if filled:
            return any(map(may_be_value, filled))
        texts = [*filter(None, cells)]
        return may_be_value(texts[0]) or (len(cells) == self.width and len(texts) > 1)

    def _skip(self, line: int, again: bool = False) -> bool:
        """Account for a line that is not a row."""
        self.skipped.append(line)
        if again:
            self.repeated.append(line)
        return False

    def _cells(self, text: str) -> list[str]:
        """Return the cells of a line, which may still have blanks between them."""
        if self.header.sep == BLANKS and self.sep not in text:
            return split_header(text, BLANKS)
        return split_row(text, self.sep)

    def has_name(self, text: str) -> bool:
        """Return whether a line that begins like a comment may be a row whose first cell is a name
        such as #1."""
        return 0 not in self.units.inputs and any(map(starts_as_number, self._cells(text)[1:]))

    def _remedy_of_units(self, line: int) -> str:
        return "leave one of them out" if self.first is None else self.remedy(line)

    def _may_be_header(self, text: str) -> bool:
        """Return whether a text has all names that a header needs, or begins a new segment of
        LabVIEW."""
        if self._labview and END_OF_HEADER in text:
            return True
        return self.name in text and self._column_names.may_be_in(text)

    def _repeats_header(self, line: int, text: str) -> bool:
        """Return whether a line repeats the header.  Raise TextError if it is a different
        header."""
        if text.startswith(END_OF_HEADER):
            raise TextError(f"line {line} begins another segment: {self.remedy(line)}")
        header, units = self.header, self.units
        cells = split_header(uncommented(text), header.sep)
        if cells[: len(header.cells)] == header.cells:
            return True
        heads = [heading(cell, self._column_names.input_of) for cell in cells]
        if not self._column_names.are_all_in(heads):
            return False
        columns = [split_unit(head) for head in heads[: self.width]]
        if [name for name, _ in columns] == units.names and all(
            units.agrees(i, columns[i][1]) for i in units.inputs
        ):
            return True
        what = "is another header, with other names or units"
        raise TextError(f"line {line} {what}: {self.remedy(line)}")


def names_statistics(text: str) -> bool:
    """Return whether a text is the first word of a row of statistics.

    >>> names_statistics("Std. dev."), names_statistics("motor")
    (True, False)
    """
    return len(text) < 40 and _STATISTICS.fullmatch(text.lower()) is not None


def irregular(count: int, width: int) -> str:
    """Return what is wrong with a row that has this number of cells."""
    cells = "cell" if count == 1 else "cells"
    return f"has {count:,} {cells}, the header has {width:,}"

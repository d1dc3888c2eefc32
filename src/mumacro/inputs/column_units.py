"""Find the units of the columns of a table, from every line that has some.

Units are next to the names, in a row of their own (above, below, in a comment), or in a legend such
as ``# v0: speed [mm/s]``.  A unit that belongs to no column, or that contradicts another one, is
refused with its line.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise

from mumacro.errors import TextError
from mumacro.inputs.cells import (
    BLANKS,
    NO_UNIT,
    is_comment,
    is_unit,
    split_header,
    starts_as_number,
    uncommented,
)
from mumacro.inputs.names import heading, meant_by, split_unit
from mumacro.inputs.units import Scale, scale_of, unit_of

SI_UNIT = Scale()
_LONGEST = 20  # characters of a unit
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

    def __init__(
        self,
        cells: Sequence[str],
        sep: str,
        input_of: Mapping[str, str],
        remedy: Callable[[int], str],
    ) -> None:
        self._sep, self._input_of, self._remedy = sep, input_of, remedy
        self._heads = [heading(cell, input_of) for cell in cells]
        in_header = [split_unit(head) for head in self._heads]
        self.names = [name for name, _ in in_header]
        #: by index: the columns that have a meaning
        self.inputs = {i: name for i, name in enumerate(self.names) if name in input_of}
        # by index: the unit, and its line if it is not in the header
        self._units: dict[int, tuple[str, int | None]] = {
            i: (unit, None) for i, (_, unit) in enumerate(in_header) if unit is not None
        }
        self.lines: set[int] = set()  #: lines with units, from 1
        self.rows_begun = False

    @property
    def heads(self) -> list[str]:
        """Return the names of the columns, with their units in brackets."""
        return [
            f"{head} [{self._units[i][0]}]"
            if self._units.get(i, ("", None))[1] is not None and self._units[i][0]
            else head
            for i, head in enumerate(self._heads)
        ]

    def of_inputs(self) -> dict[str, str]:
        """Return the unit of each input; the SI unit if the table has none."""
        units = {name: self._units.get(i, ("", None))[0] for i, name in self.inputs.items()}
        return {name: unit or unit_of(name) for name, unit in units.items()}

    def agrees(self, i: int, unit: str | None) -> bool:
        """Return whether a unit is the unit of an input's column; None stands for the SI unit."""
        return self._scale(i, unit or "") == self._scale(i, self._units.get(i, ("", None))[0])

    def _scale(self, i: int, unit: str) -> Scale:
        return scale_of(self._input_of[self.names[i]], unit) or SI_UNIT

    def take(self, line: int, text: str) -> bool:
        """Take the units in a line, either a row of units or a legend.  Return whether the line has
        units."""
        return self.take_row(line, text) or self.take_legend(line, text)

    def take_legend(self, line: int, text: str) -> bool:
        """Take the units after the names of columns in a line.  Return whether there are any."""
        legend = [*units_in_legend(text, [*self.inputs.values()])]
        for name, unit in legend:
            self._take_one(line, self.names.index(name), unit)
        if not legend and not self.rows_begun:
            self._refuse_of_another_name(line, text)
        return bool(legend)

    def take_row(self, line: int, text: str, is_no_row: bool = False) -> bool:
        """Take the units of a line that contains only units.  Return whether it is such a line.

        If ``is_no_row`` is true for the line and it is not a comment, columns that are not inputs
        may hold any text.
        """
        units = self._cells_of_units(line, text, is_no_row)
        self.take_cells(line, units or [])
        return units is not None

    def take_cells(self, line: int, units: Sequence[str]) -> None:
        """Take the unit of each column; skip an empty one."""
        for i, unit in enumerate(units[: len(self.names)]):
            if unit:
                self._take_one(line, i, unit)

    def _cells_of_units(self, line: int, text: str, is_no_row: bool) -> list[str] | None:
        """Return the units in a line that contains only units, or None for another line.  Raise
        TextError if they belong to no column."""
        if len(text) > 100_000:
            return None
        bare = uncommented(text)
        if is_comment(text) and (label := _LABEL_BEFORE.match(bare)):
            bare = bare[label.end() :]
        width, in_columns = len(self.names), self._sep != BLANKS
        if in_columns:
            cells = split_header(bare, self._sep)
        else:
            cells = _BETWEEN_BLANKS.findall(re.sub(r"(?<=\w) ?/ ?(?=\w)", "/", bare[:10_000]))
            if cells and _LABEL.fullmatch(cells[0]) and len(cells) != width:
                cells = cells[1:]
        units = [cell.strip(" []()'\"") for cell in cells]
        units = ["" if _LABEL.fullmatch(unit) else unit for unit in units]
        filled = [unit for unit in units if unit not in NO_UNIT]
        known = [unit for unit in filled if is_unit(unit)]
        if not known or any(map(starts_as_number, filled)):  # or a setting with its unit
            return None
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
            return units
        if is_sure and 2 * len(known) > len(filled):
            shown = " ".join(text.split())[:60]
            raise TextError(
                f"line {line}: {shown!r} has units that cannot be assigned to the columns "
                f"{', '.join(self.names[:8])}: write each behind its name, as in v0 [mm/s]"
            )
        return None

    def _take_one(self, line: int, i: int, unit: str) -> None:
        """Take the unit of one column."""
        name, before = self.names[i], self._units.get(i)
        if name in self._input_of:
            if unit in NO_UNIT and before is not None:
                return
            if scale_of(self._input_of[name], unit) is None:
                raise TextError(f"line {line}: {unit[:40]!r} is no unit of {name}")
            if (before is not None or self.rows_begun) and not self.agrees(i, unit):
                unit_before, line_before = before or ("", None)
                if before is None:
                    says = "the rows before are in"
                    remedy = f"write the unit behind the name, as in {name} [{unit}]"
                else:
                    says = "the header says" if line_before is None else f"line {line_before} says"
                    remedy = self._remedy(line)
                what = f"{name} is in {unit}, {says} {unit_before or unit_of(name)}"
                raise TextError(f"line {line}: {what}: {remedy}")
        if not self.rows_begun:
            self._units.setdefault(
                i, ("" if unit in NO_UNIT or len(unit) > _LONGEST else unit, line)
            )
            self.lines.add(line)

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

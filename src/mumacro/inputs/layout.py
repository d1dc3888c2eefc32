"""Find the header of a table as text, once, from its first lines, for all functions that read it.

The header is the first line with all necessary names.  :class:`mumacro.inputs.account.Account` says
what the lines after it are.
"""

import re
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import NamedTuple

from mumacro.errors import TextError
from mumacro.inputs.cells import (
    BLANKS,
    MOST_COLUMNS,
    is_comment,
    split_header,
    starts_as_number,
    uncommented,
)
from mumacro.inputs.names import ColumnNames, meant_by

#: separators of the cells, by the name in an option
SEPARATORS = {",": ",", ";": ";", "|": "|", "tab": "\t", "blanks": BLANKS}
LOOKED_AT = 2_000  #: the header must be within this number of lines
#: what LabVIEW writes after each of its headers
END_OF_HEADER = "***End_of_Header***"
_SEP_LINE = re.compile(r'\ufeff?"?sep=([,;|\t])"?', re.IGNORECASE)
_LABEL = re.compile(r"[^\W\d]\w{0,19}:\s+")  # before the names in a comment


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
        text, end = whole(lines, i)
        bare = uncommented(text)
        texts = [bare]
        if bare != text and (label := _LABEL.match(bare)):  # "# columns: v0 mu_macro"
            texts.append(bare[label.end() :])
        for sep in seps:
            for bare in texts:
                cells = split_header(bare, sep)
                if column_names.heads_in(cells):
                    yield Header(i, end, sep, cells)


def whole(lines: Sequence[str], i: int) -> tuple[str, int]:
    """Return a line with the following lines in which its quoted cells end, and the index after
    them."""
    text = lines[i]
    for end in range(i + 1, min(i + 20, len(lines))):
        if text.count('"') % 2 == 0:
            return text, end
        text += f"\n{lines[end]}"
    return (text, min(i + 20, len(lines))) if text.count('"') % 2 == 0 else (lines[i], i + 1)


def _fits(header: Header, lines: Sequence[str], labview: bool) -> bool:
    """Return whether the row after a header has as many cells."""
    width = len(header.cells)
    for i in range(header.end, len(lines)):
        if lines[i].strip() and not is_comment(lines[i]):
            cells = split_header(whole(lines, i)[0], header.sep)
            return len(cells) in (width, width - labview) or not any(cells[width:] or ["x"])
    return True


def _likely_header(lines: Sequence[str], skip: int, seps: Sequence[str]) -> Header:
    """Return the line that is probably meant as a header: a line whose names are similar to those
    of inputs, or the line above the first numbers."""
    best, most = None, 0.0
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
    if best is not None:
        return best
    index = next((i for i in range(skip, len(lines)) if lines[i].strip()), None)
    if index is None:
        raise TextError(f"line {skip + 1}: must name the columns, and is empty")
    cells = split_header(lines[index][:10_000], seps[0])[:MOST_COLUMNS]
    return Header(index, index + 1, seps[0], cells)

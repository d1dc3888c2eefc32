"""Find how a table as text is written, once, from its first lines, for all functions that read it.

:func:`find_layout` finds the header (the first line with all necessary names), then the units of
its columns (:mod:`mumacro.inputs.column_units`) and the first row (:mod:`mumacro.inputs.account`).
"""

import re
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import NamedTuple

from mumacro.errors import TextError
from mumacro.inputs.account import END_OF_HEADER, Account, ColumnNames, Header
from mumacro.inputs.cells import (
    BLANKS,
    MOST_COLUMNS,
    is_comment,
    split_header,
    starts_as_number,
    uncommented,
)
from mumacro.inputs.column_units import ColumnUnits
from mumacro.inputs.decoding import NAMES
from mumacro.inputs.names import heading, meant_by
from mumacro.inputs.numbers import Signs

#: separators of the cells, by the name in an option
SEPARATORS = {",": ",", ";": ";", "|": "|", "tab": "\t", "blanks": BLANKS}
_WORDS = {",": "comma", ";": "semicolon", "|": "bar", "\t": "tab", BLANKS: "blanks"}
_WORDS_OF_SIGNS = {".": "point", ",": "comma"}
LOOKED_AT = 2_000  #: the header must be within this number of lines
_ABOVE = 4  # units may be within this number of lines above the names
_SEP_LINE = re.compile(r'\ufeff?"?sep=([,;|\t])"?', re.IGNORECASE)
_LABEL = re.compile(r"[^\W\d]\w{0,19}:\s+")  # before the names in a comment


class Dialect(NamedTuple):
    """Hold what a person says about the layout of a table; None means that it is to be found."""

    sep: str | None = None  #: a character, or :data:`BLANKS`
    decimal: str | None = None
    thousands: str | None = None  #: empty if there is none
    encoding: str | None = None
    skip: int = 0  #: lines to leave out at the beginning
    dashes: str = "--"  #: text before the name of an option, in messages
    rows: tuple[int, int] | None = None  #: the first and the last line of data
    sheet: str | None = None  #: sheet of a workbook

    def signs(self, layout: "Layout") -> Signs:
        """Return what is known about the separators in the numbers of a table."""
        return Signs(self.decimal or layout.decimal, self.thousands, layout.sep, self.dashes)


class _Declared(NamedTuple):
    """Hold what the lines before the header say about the table."""

    sep: str | None = None
    decimal: str | None = None
    labview: bool = False
    units: int | None = None  # index of a line of LabVIEW with the units of the columns


class Layout(NamedTuple):
    """Hold how a table is written."""

    encoding: str
    header: Header
    units: ColumnUnits
    declared: _Declared
    first: int  #: the first line that may be data
    last: int | None  #: the last line of data, if a person names it
    skipped: list[int]  #: lines before the data that are not empty, not the header and not units
    repeated: list[int]  #: those of them that repeat the header

    @property
    def line(self) -> int:
        """Return the line of the header."""
        return self.header.start + 1

    @property
    def heads(self) -> list[str]:
        """Return the names of the columns, with their units in brackets."""
        return self.units.heads

    @property
    def inputs(self) -> dict[int, str]:
        """Return the columns that have a meaning, by their index."""
        return self.units.inputs

    @property
    def sep(self) -> str:
        """Return the separator of the cells; :data:`BLANKS` means any number of blanks."""
        return self.header.sep

    @property
    def decimal(self) -> str | None:
        """Return the decimal separator, if the table itself says it."""
        return self.declared.decimal

    def account(self, column_names: ColumnNames, dialect: Dialect) -> Account:
        """Return an account of the lines from the first row on."""
        account = Account(
            self.header,
            self.units,
            column_names,
            dialect.dashes,
            self.declared.labview,
            self.first,
        )
        account.repeated += self.repeated
        return account

    def described(self, signs: Signs) -> str:
        """Return in a few words how the table is read, with the unit of each input.

        >>> column_names = ColumnNames({"v0": "v0", "mu_macro": "mu0"}, [["v0"], ["mu_macro"]])
        >>> lines = ["run 7", "v0;mu_macro", "mm/s;%", "1,5;7"]
        >>> layout = find_layout(lines, column_names, Dialect())
        >>> layout.described(Signs(",", None))
        'semicolon, decimal comma, header in line 2, units in line 3; v0 [mm/s], mu_macro [%]'
        """
        is_utf8 = self.encoding in ("", "utf-8", "utf-8-sig")
        words = [] if is_utf8 else [NAMES.get(self.encoding, self.encoding)]
        words += [_WORDS.get(self.sep, repr(self.sep))]
        words += ["decimal comma"] if signs.decimal == "," else []
        words += [f"{_WORDS_OF_SIGNS[signs.grouped]} between thousands"] if signs.grouped else []
        words += [f"header in line {self.line}"] if self.line > 1 else []
        lines = sorted(self.units.lines)
        places = ", ".join(map(str, lines))
        words += [f"units in line{'s' * (len(lines) > 1)} {places}"] if lines else []
        words += [f"rows {self.first}..{self.last}"] if self.last else []
        units = (f"{name} [{self.units.unit(i)}]" for i, name in self.inputs.items())
        return f"{', '.join(words)}; {', '.join(units)}"


def find_layout(
    lines: list[str], column_names: ColumnNames, dialect: Dialect, encoding: str = ""
) -> Layout:
    """Find how a table is written, from its first lines.

    If no line has all necessary names, the header is the line that is most probably meant as a
    header.  Raise TextError if there is no line at all, if units belong to no column or contradict
    each other, or if there are rows before the header.
    """
    declared = _declared(lines)
    header = _find_header(lines, column_names, dialect, declared)
    while header.cells and not header.cells[-1]:
        header.cells.pop()
    units = ColumnUnits(header.cells, header.sep, column_names.input_of)
    account = Account(header, units, column_names, dialect.dashes, declared.labview)
    end = header.end
    if declared.units is not None:
        cells = split_header(lines[declared.units], header.sep)
        units.take_cells(declared.units + 1, ["", *cells[1:]])
    if column_names.are_all_in(units.heads):
        if declared.units is None:
            _take_above(units, lines[: header.start], dialect.skip)
        end = _first_row(account, lines, dialect)
    elif dialect.rows:
        end = dialect.rows[0] - 1
    before = [i for i in range(min(end, len(lines))) if lines[i].strip()]
    is_header = range(header.start, header.end)
    return Layout(
        encoding,
        header,
        units,
        declared,
        end + 1,
        dialect.rows[1] if dialect.rows else None,
        [i + 1 for i in before if i + 1 not in units.lines and i not in is_header],
        account.repeated,
    )


def _take_above(units: ColumnUnits, lines: Sequence[str], skip: int) -> None:
    """Take the units above the header: a row close to it, legends, and comments of ECSV."""
    above = [i for i in reversed(range(skip, len(lines))) if lines[i].strip()]
    row = next((i for i in above[:_ABOVE] if units.take_row(i + 1, lines[i])), None)
    if any("%ECSV" in lines[i][:20] for i in above):
        units.take_ecsv(lines)
        return
    for i in reversed(above):
        if i != row:
            units.take_legend(i + 1, lines[i])


def _first_row(account: Account, lines: Sequence[str], dialect: Dialect) -> int:
    """Return the index of the first row; account for the lines between the header and it."""
    header = account.header
    if dialect.rows:
        end = dialect.rows[0] - 1
        for i in range(header.end, min(end, len(lines))):
            account.units.take(i + 1, lines[i])
        return max(end, header.end)
    for i in range(header.end, len(lines)):
        text = lines[i] if is_comment(lines[i]) else _whole(lines, i)[0]
        if account.is_row(i + 1, text):
            return i
    return max(len(lines), header.end)


# --- the header -----------------------------------------------------------------------------------


def _declared(lines: Sequence[str]) -> _Declared:
    """Return what a line ``sep=;`` or the first lines of LabVIEW say."""
    first = next((line for line in lines if line.strip()), "")
    if match := _SEP_LINE.fullmatch(first.rstrip("\n")):
        return _Declared(sep=match[1])
    if not first.lstrip("\ufeff").startswith("LabVIEW Measurement"):
        return _Declared()
    sep = decimal = units = None
    ends = 0
    for i, line in enumerate(lines[:LOOKED_AT]):
        tag, *values = re.split(r"[\t,]", line.strip(), maxsplit=1)
        value = values[0].strip() if values else ""
        ends += tag == END_OF_HEADER
        if tag == "Separator":
            sep = "," if value.lower() == "comma" else "\t"
        elif tag == "Decimal_Separator":
            decimal = value if value in (".", ",") else None
        elif tag == "Y_Unit_Label" and ends < 2:
            units = i
    return _Declared(sep or "\t", decimal, True, units)


def _find_header(
    lines: list[str], column_names: ColumnNames, dialect: Dialect, declared: _Declared
) -> Header:
    """Return the first line that has all necessary names and fits the next row.  If a person names
    the rows, return the last such line before them."""
    sep = dialect.sep or declared.sep
    seps = (sep,) if sep else tuple(SEPARATORS.values())
    candidates = [*islice(_headers_in(lines, dialect.skip, seps, column_names), 20)]
    if dialect.rows:
        candidates = [one for one in candidates if one.start + 1 < dialect.rows[0]][::-1]
    header = next((one for one in candidates if _fits(one, lines, declared.labview)), None)
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
        text, end = _whole(lines, i)
        bare = uncommented(text)
        texts = [bare]
        if bare != text and (label := _LABEL.match(bare)):  # "# columns: v0 mu_macro"
            texts.append(bare[label.end() :])
        for sep in seps:
            for bare in texts:
                cells = split_header(bare, sep)
                heads = [heading(cell, column_names.input_of) for cell in cells]
                if column_names.are_all_in(heads):
                    yield Header(i, end, sep, cells)


def _whole(lines: Sequence[str], i: int) -> tuple[str, int]:
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
            cells = split_header(_whole(lines, i)[0], header.sep)
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

"""How a table as text is written: found once, from its first lines, for every reader.

:func:`find_layout` finds the head, which is the first line that names what is needed, and the units
of its columns: with the names, in a line beside them (above, below, in a comment), or in a legend
such as ``# v0: speed [mm/s]``.  What looks like units and cannot be assigned is refused.
"""

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from typing import NamedTuple

from mumacro.errors import TextError
from mumacro.inputs.decoding import NAMES
from mumacro.inputs.fields import is_rigid
from mumacro.inputs.names import find_heads, heading, meant_by
from mumacro.inputs.numbers import Signs
from mumacro.inputs.units import QUANTITIES, Scale, canonical, scale_of, split_unit, unit_of

BLANKS = " "  #: the separator where any number of blanks stands between the cells
#: separators of the cells, by the name that an option has
SEPARATORS = {",": ",", ";": ";", "|": "|", "tab": "\t", "blanks": BLANKS}
_WORDS = {",": "comma", ";": "semicolon", "|": "bar", "\t": "tab", BLANKS: "blanks"}
_WORDS_OF_SIGNS = {".": "point", ",": "comma"}
COMMENT = ("#", "%", "//", "!")  #: what begins a comment
LOOKED_AT = 2_000  #: lines, in which the head must stand
MOST_COLUMNS = 200_000
_BESIDE = 4  # lines above the names in which their units may stand
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
_UNIT_CELL = re.compile(r"\[[^\[\]]*\]|\([^()]*\)|\S+")
_BEGINNING, _OF_WORD = re.compile(r"(?<![\w.])\S"), re.compile(r"\w")  # of a name in a sentence
_SEP_LINE = re.compile(r'\ufeff?"?sep=([,;|\t])"?', re.IGNORECASE)
#: what LabVIEW writes behind each of its headers
END_OF_HEADER = "***End_of_Header***"
# words before the units in their row, or before the names in a comment
_LABEL = re.compile(r"(?:units?|einheit(?:en)?|unités?|[a-z]+_units)\W*", re.IGNORECASE)
_LABEL_BEFORE = re.compile(r"(?:units?|einheit(?:en)?|unités?)\s*[:=]\s*", re.IGNORECASE)
_OF_NAMES = re.compile(r"[^\W\d]\w{0,19}:\s+")
# units of columns that are no inputs
_ELSEWHERE = {"s", "ms", "us", "min", "h", "°C", "C", "K", "degC", "V", "mV", "A", "mA", "W", "mW"}
_NO_UNIT = ("", "-", "1")
# of a legend, behind the name of a column
_BRACKET = re.compile(r"\s*(?:[:=]\s*)?([\[(])([^\[\]()]{0,40})[\])]")
_LAST_BRACKET = re.compile(r"([\[(])([^\[\]()]{0,40})[\])][\s.;,]*$")
_LAST_WORD = re.compile(r"(?:\bin|[,:=])\s+(\S{1,20})$")
_A_NUMBER = re.compile(r"(?<![\w/^.\-])[+-]?\d")
_ECSV_COLUMN = re.compile(r"\{[^{}]*\}")
_ECSV_NAME, _ECSV_UNIT = (
    re.compile(rf"\b{word}: *['\"]?([^,'\"}}]*)") for word in ("name", "unit")
)
_OF_TABLE = {unit for quantity in QUANTITIES.values() for unit in quantity.units} - {*_NO_UNIT}


class Dialect(NamedTuple):
    """How a person says that a table is written; what is None is found out."""

    sep: str | None = None  #: a character, or :data:`BLANKS`
    decimal: str | None = None
    thousands: str | None = None  #: empty where there is none
    encoding: str | None = None
    skip: int = 0  #: lines to leave out at the beginning
    dashes: str = "--"  #: before the name of an option, in messages
    rows: tuple[int, int] | None = None  #: the first and the last line of data
    sheet: str | None = None  #: of a workbook

    def signs(self, layout: "Layout") -> Signs:
        """Return what is known of the signs of numbers in a table."""
        return Signs(self.decimal or layout.decimal, self.thousands, layout.sep, self.dashes)


class ColumnNames(NamedTuple):
    """The columns of a table that mean something."""

    like: Mapping[str, str]  #: by name, the input whose units it has
    required_groups: Sequence[Sequence[str]]  #: of each, one name must be there


class Layout(NamedTuple):
    """How a table is written."""

    encoding: str
    sep: str
    decimal: str | None  #: as the table says itself
    names: list[str]  #: the cells of the head
    heads: list[str]  #: names of the columns, with their units in brackets
    head: int  #: the line of the head
    units: list[int]  #: lines with units, other than the head
    first: int  #: the first line that may be data
    last: int | None  #: the last one, where it is said
    inputs: dict[int, str]  #: the columns that mean something, by their places
    labview: bool  #: whether LabVIEW wrote it
    skipped: list[int]  #: lines before the data that are not empty, and neither head nor units
    dashes: str  #: before the name of an option, in messages

    @property
    def cell_sep(self) -> str:
        """What separates the cells of rows, once tabs stand in place of blanks."""
        return "\t" if self.sep == BLANKS else self.sep

    @property
    def without_comments(self) -> bool:
        """Whether rows end before the last column, as LabVIEW writes them."""
        return self.labview and self.heads[-1:] == ["Comment"]

    def without(self, line: int) -> str:
        """Return the remedy for a line that does not belong to the rows."""
        if self.dashes and line > self.first:
            return f"{self.dashes}rows {self.first}..{line - 1} reads those before it"
        return "give the rows alone"

    def described(self, signs: Signs) -> str:
        """Return how the table is read, with the unit of each input, in a few words.

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
        words += [f"header in line {self.head}"] if self.head > 1 else []
        places = ", ".join(map(str, self.units))
        words += [f"units in line{'s' * (len(self.units) > 1)} {places}"] if self.units else []
        words += [f"rows {self.first}..{self.last}"] if self.last else []
        units = (
            f"{name} [{split_unit(self.heads[i])[1] or unit_of(name)}]"
            for i, name in self.inputs.items()
        )
        return f"{', '.join(words)}; {', '.join(units)}"


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
    lines: list[str], column_names: ColumnNames, dialect: Dialect, encoding: str = ""
) -> Layout:
    """Find how a table is written, from its first lines.

    Where no line names all that is needed, the head is the line that most probably is meant for it.
    TextError where there is no line at all, where units are none or contradict each other, and
    where rows stand before the head.
    """
    preamble = _declared(lines)
    sep = dialect.sep or preamble.sep
    head = _find_head(lines, column_names, dialect, sep, preamble.labview)
    cells = head.cells
    while cells and not cells[-1]:
        cells = cells[:-1]
    heads = [heading(cell, column_names.like) for cell in cells]
    found = _Units(heads, column_names.like)
    if preamble.units is not None:
        label_line = split(lines[preamble.units], head.sep)
        found.take_row(preamble.units, ["", *label_line[1:]])
    elif is_known(heads, column_names):
        _find_units(found, lines, head, dialect)
    heads = found.heads()
    data = head.end
    in_units = {preamble.units, *found.lines}
    while data < len(lines) and (data in in_units or not lines[data].strip(f" \t{head.sep}")):
        data += 1
    rows = dialect.rows
    first = max(data + 1, rows[0]) if rows else data + 1
    places, _ = find_heads(heads, column_names.like)
    return Layout(
        encoding,
        head.sep,
        preamble.decimal,
        cells,
        heads,
        head.at + 1,
        [i + 1 for i in sorted(found.lines)],
        first,
        rows[1] if rows else None,
        {i: name for name, (i, _) in sorted(places.items(), key=lambda one: one[1][0])},
        preamble.labview,
        [
            i + 1
            for i in range(min(data, len(lines)))
            if lines[i].strip() and i not in in_units and not head.at <= i < head.end
        ],
        dialect.dashes,
    )


def is_known(heads: Sequence[str], column_names: ColumnNames) -> bool:
    """Return whether heads name all that is needed."""
    names = {split_unit(head)[0] for head in heads}
    return all(names.intersection(group) for group in column_names.required_groups)


# --- the head -------------------------------------------------------------------------------------


def _declared(lines: Sequence[str]) -> _Declared:
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


def _find_head(
    lines: list[str], column_names: ColumnNames, dialect: Dialect, sep: str | None, labview: bool
) -> _Head:
    """Return the first line that names all that is needed and fits the row behind it; where the
    rows are said, the last one before them."""
    seps = (sep,) if sep else tuple(SEPARATORS.values())
    candidates = [*islice(_heads_in(lines, dialect.skip, seps, column_names), 20)]
    if dialect.rows:
        candidates = [one for one in candidates if one.at + 1 < dialect.rows[0]][::-1]
    head = next((one for one in candidates if _fits(one, lines, labview)), None)
    head = head or (candidates[0] if candidates else _likely_head(lines, dialect.skip, seps))
    if not dialect.rows:
        for one in candidates:
            if one.at < head.at:
                _refuse_rows_between(one, head, lines, dialect)
    for one in candidates:  # the names in a comment may stand above the head itself
        between = lines[head.at : one.at]
        if between and all(is_comment(line) or not line.strip() for line in between):
            return one
    return head


def _refuse_rows_between(before: _Head, head: _Head, lines: list[str], dialect: Dialect) -> None:
    """Refuse a table with rows below a head that did not fit them, before the one that fits."""
    for i in range(before.end, head.at):
        cells = [] if is_comment(lines[i]) else split(lines[i], before.sep)
        if len(cells) > 1 and any(map(starts_as_number, cells)):
            raise TextError(
                f"line {i + 1}: rows of a segment stand between the heads of lines "
                f"{before.at + 1} and {head.at + 1}: "
                + (
                    f"{dialect.dashes}skip {head.at} leaves them out"
                    if dialect.dashes
                    else "give the rows of one"
                )
            )


def _heads_in(
    lines: Sequence[str], skip: int, seps: Sequence[str], column_names: ColumnNames
) -> Iterator[_Head]:
    """Yield the lines that name all that is needed."""
    for i in range(skip, min(len(lines), LOOKED_AT)):
        names_all = all(
            any(name in lines[i] for name in names) for names in column_names.required_groups
        )
        # of an odd number of quotes a cell goes on in the next line
        if not names_all and lines[i].count('"') % 2 == 0:
            continue
        text, end = _whole(lines, i)
        bare = uncommented(text)
        texts = [bare]
        if bare != text and (label := _OF_NAMES.match(bare)):  # "# columns: v0 mu_macro"
            texts.append(bare[label.end() :])
        for sep in seps:
            for bare in texts:
                cells = split(bare, sep)
                if is_known([heading(cell, column_names.like) for cell in cells], column_names):
                    yield _Head(i, end, sep, cells)


def _whole(lines: Sequence[str], i: int) -> tuple[str, int]:
    """Return a line with those behind it in which its quoted cells end, and the index behind
    them."""
    text = lines[i]
    for end in range(i + 1, min(i + 20, len(lines))):
        if text.count('"') % 2 == 0:
            return text, end
        text += f"\n{lines[end]}"
    return (text, min(i + 20, len(lines))) if text.count('"') % 2 == 0 else (lines[i], i + 1)


def is_comment(line: str) -> bool:
    """Return whether a line begins as comments do."""
    return line.lstrip("\ufeff \t").startswith(COMMENT)


def uncommented(line: str) -> str:
    """Return a line without the sign that makes it a comment: the head of a table may be in one."""
    text = line.lstrip("\ufeff ")
    return text.lstrip("#%/!").lstrip() if text.startswith(COMMENT) else text


def split(line: str, sep: str) -> list[str]:
    """Return the cells of a head or of a row of units, without the blanks around them."""
    if sep != BLANKS and line.count(sep) > MOST_COLUMNS:
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
    """Return whether the row behind a head has as many cells."""
    width = len(head.cells)
    for i in range(head.end, len(lines)):
        if lines[i].strip() and not is_comment(lines[i]):
            cells = split(_whole(lines, i)[0], head.sep)
            return len(cells) in (width, width - labview) or not any(cells[width:] or ["x"])
    return True


def _likely_head(lines: Sequence[str], skip: int, seps: Sequence[str]) -> _Head:
    """Return the line that is probably meant for a head: one whose names are like those of inputs,
    or the one above the first numbers."""
    best, most = None, 0.0
    for i in range(skip, min(len(lines), LOOKED_AT)):
        for sep in seps:
            cells = split(uncommented(lines[i][:100_000]), sep)
            if not any(cells):
                continue
            alike = sum(meant_by(cell, loosely=False) is not None for cell in cells[:200])
            below = split(lines[i + 1][:10_000], sep) if i + 1 < len(lines) else []
            numbers = sum(starts_as_number(cell) for cell in below)
            is_above = len(below) == len(cells) and numbers > len(cells) // 2
            score = alike + 0.5 * is_above + 0.01 * (sep in lines[i])
            if not any(map(starts_as_number, cells)) and score > most:
                best, most = _Head(i, i + 1, sep, cells), score
    if best is not None:
        return best
    at = next((i for i in range(skip, len(lines)) if lines[i].strip()), None)
    if at is None:
        raise TextError(f"line {skip + 1}: must name the columns, and is empty")
    return _Head(at, at + 1, seps[0], split(lines[at][:10_000], seps[0])[:MOST_COLUMNS])


def starts_as_number(cell: str) -> bool:
    """Return whether a cell begins as numbers do."""
    return cell.lstrip("+-−., ")[:1].isdigit()


# --- the units of its columns ---------------------------------------------------------------------


class _Units:
    """The units of the columns, from every line that has some; TextError where two differ."""

    def __init__(self, heads: list[str], like: Mapping[str, str]) -> None:
        self._heads, self.like = heads, like
        self.names = [split_unit(head)[0] for head in heads]
        self._units: dict[int, tuple[str, int | None]] = {}  # by place: the unit, and its line
        for i, head in enumerate(heads):
            if (unit := split_unit(head)[1]) is not None:
                self._units[i] = unit, None
        self.lines: set[int] = set()  #: indices of the lines that have units

    def heads(self) -> list[str]:
        """Return the heads with their units."""
        return [
            head
            if split_unit(head)[1] is not None or i not in self._units or self._units[i][0] == ""
            else f"{head} [{self._units[i][0]}]"
            for i, head in enumerate(self._heads)
        ]

    def take(self, i: int, unit: str, index: int) -> None:
        """Take the unit of a column from a line."""
        line, name = index + 1, self.names[i]
        if name in self.like:
            scale = scale_of(self.like[name], unit)
            if scale is None:
                raise TextError(f"line {line}: {unit[:40]!r} is no unit of {name}")
            before, where = self._units.get(i, (unit, None))
            if scale_of(self.like[name], before) not in (scale, None):
                says = "its header says" if where is None else f"line {where + 1} says"
                raise TextError(
                    f"line {line}: {name} is in {unit}, {says} {before}; leave one of them out"
                )
        if unit in _NO_UNIT or len(unit) > 20:
            unit = ""
        self._units.setdefault(i, (unit, index))
        self.lines.add(index)

    def take_row(self, index: int, cells: Sequence[str]) -> None:
        """Take the units of a row."""
        for i, cell in enumerate(cells[: len(self.names)]):
            text = cell.strip(" []()")
            if text and not _LABEL.fullmatch(text):
                self.take(i, text, index)

    def refuse_unassigned(self, what: str, unit: str, index: int) -> None:
        """Refuse a line that has a unit, other than that of SI, for something that may be a column
        whose unit is not known."""
        field = meant_by(what.replace("unit", "").strip(" :="), loosely=False)
        for i, name in enumerate(self.names):
            like = self.like.get(name)
            if like is None or i in self._units or scale_of(like, unit) in (None, Scale()):
                continue
            if field == name or "unit" in what.lower():
                raise TextError(
                    f"line {index + 1}: {what!r} has the unit {unit}, and {name} has "
                    f"none: write it behind the name, as in {name} [{unit}]"
                )

    def take_name(self, name: str, unit: str, index: int) -> None:
        """Take the unit of the column of a name."""
        if name in self.names:
            self.take(self.names.index(name), unit, index)


def _find_units(found: _Units, lines: list[str], head: _Head, dialect: Dialect) -> None:
    """Find the units beside the head and in legends; the first row behind it may be theirs."""
    skip = dialect.skip
    end = dialect.rows[0] - 1 if dialect.rows else len(lines)
    above = [i for i in range(head.at - 1, skip - 1, -1) if lines[i].strip()][:_BESIDE]
    for i in above:
        if cells := units_in(lines[i], head.sep, found.names, found.like, i + 1):
            found.take_row(i, cells)
            break
    for i in range(head.end, min(end, len(lines))):
        text = lines[i]
        if not text.strip(f" \t{head.sep}"):
            continue
        if dialect.rows or (is_comment(text) and not _is_whole_row(text, head, found)):
            if cells := units_in(text, head.sep, found.names, found.like, i + 1):
                found.take_row(i, cells)
            else:
                _take_legend(found, text, i)
            continue
        if split(text, head.sep) != head.cells and is_row_of_units(
            split(text, head.sep), found.names, found.like, i + 1
        ):
            found.take_row(i, split(text, head.sep))
            continue
        break
    before = range(skip, head.at)
    if any("%ECSV" in lines[i][:20] for i in before):
        _take_ecsv(found, lines, before)
        return
    for i in before:
        if i not in found.lines:
            _take_legend(found, lines[i], i)


def _is_whole_row(text: str, head: _Head, found: _Units) -> bool:
    """Return whether a line that begins like a comment is a row, whose first cell is a name such as
    #1."""
    names_first = found.names[0] not in found.like
    return names_first and may_be_row(text, head.sep, len(head.cells))


def may_be_row(text: str, sep: str, width: int) -> bool:
    """Return whether a line that begins like a comment has as many cells as the head, with a
    number."""
    cells = text.split() if sep == BLANKS else text.split(sep)
    return len(cells) == width > 1 and any(map(starts_as_number, cells[1:]))


def is_unit(text: str) -> bool:
    """Return whether a text is a unit of anything.

    >>> [is_unit(text) for text in ("mm/s", "-", "°C", "speed")]
    [True, True, True, False]
    """
    return (
        text in _ELSEWHERE or text in _NO_UNIT or text in _OF_TABLE or canonical(text) in _OF_TABLE
    )


def units_in(
    line: str, sep: str, names: Sequence[str], like: Mapping[str, str], number: int
) -> list[str] | None:
    """Return the cells of a line that has nothing but units, which may be a comment; None for
    another one.

    TextError where they are units and those of other columns.
    """
    if len(line) > 100_000:
        return None
    text = uncommented(line)
    if is_comment(line) and (label := _LABEL_BEFORE.match(text)):
        text = text[label.end() :]
    if sep == BLANKS:
        cells = _UNIT_CELL.findall(re.sub(r"(?<=\w) ?/ ?(?=\w)", "/", text[:10_000]))
        if cells and _LABEL.fullmatch(cells[0]) and len(cells) != len(names):
            cells = cells[1:]
    else:
        cells = split(text, sep)
    texts = [cell.strip(" []()") for cell in cells]
    units = [one for one in texts if one and not _LABEL.fullmatch(one)]
    known = [one for one in units if is_unit(one) and one not in _NO_UNIT]
    is_sure = any("/" in one or "%" in one for one in units) or len(units) > 1 or "[" in text
    if not is_sure or not known or 2 * len(known) <= len(units) - units.count("-"):
        return None
    if any(map(_is_value, units)):  # a setting with its unit
        return None
    if len(cells) > len(names) and not any(texts[len(names) :]):
        cells = cells[: len(names)]
    fits = len(cells) in (range(2, len(names) + 1) if sep != BLANKS else (len(names),)) and all(
        not text or name not in like or scale_of(like[name], text) is not None
        for name, text in zip(names, texts, strict=False)
    )
    if not fits or not all(is_unit(one) or len(one) < 8 for one in units):
        shown = " ".join(line.split())[:60]
        raise TextError(
            f"line {number}: {shown!r} has units that cannot be assigned to the columns "
            f"{', '.join(names[:8])}: write each behind its name, as in v0 [mm/s]"
        )
    return cells


def _is_value(text: str) -> bool:
    """Return whether a cell is a number, other than the unit 1."""
    return text != "1" and starts_as_number(text)


def is_row_of_units(
    cells: Sequence[str], names: Sequence[str], like: Mapping[str, str], number: int
) -> bool:
    """Return whether the first row behind a head has units; a row without any number is taken for
    one, and TextError tells what is none."""
    texts = [cell.strip(" []()") for cell in cells]
    places = [i for i, name in enumerate(names[: len(cells)]) if name in like and texts[i]]
    scales = {i: scale_of(like[names[i]], texts[i]) for i in places}
    units = [i for i in places if scales[i] is not None and texts[i] not in ("-", "1")]
    numbers = [texts[i] for i in places if i not in units and starts_as_number(texts[i])]
    if any(text != "1" for text in numbers):
        return False
    is_empty = any(texts[i].lower() in GAPS or is_rigid(texts[i]) for i in places)
    if not places or (not units and (numbers or is_empty)):
        return False
    if any(texts[len(names) :]):
        if not units:
            return False
        raise TextError(f"line {number}: has {len(cells)} units, the header has {len(names)} names")
    for i in places:
        if scales[i] is None:
            what = f"{texts[i][:40]!r} is neither a number nor a unit of {names[i]}"
            raise TextError(f"line {number}: {what}; --rows A..B says which lines are data")
    return True


def _take_legend(found: _Units, line: str, index: int) -> None:
    """Take the units that a line of a legend has, behind the names of columns."""
    names = [name for name in found.names if name in found.like]
    found_here = [*legend(line, names)]
    for name, unit in found_here:
        found.take_name(name, unit, index)
    if not found_here and (one := _OF_ANOTHER_NAME.fullmatch(" ".join(line[:100].split()))):
        found.refuse_unassigned(one["what"], one["unit"] or one["last"], index)


def legend(line: str, names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield the names of columns and their units in a line such as ``# v0: speed [mm/s]``.

    >>> [*legend("# v0: sliding speed [mm/s], mu_macro in %", ["v0", "mu_macro"])]
    [('v0', 'mm/s'), ('mu_macro', '%')]
    >>> [*legend("# v0 was 3 mm/s", ["v0"])]
    []
    """
    if len(line) > 2_000 or not any(name in line for name in names):
        return
    places = [*_places_of_names(line, [name for name in names if name and name in line])]
    ends = [start for start, _ in places[1:]] + [len(line)]
    for (start, name), end in zip(places, ends, strict=True):
        behind = line[start + len(name) : end].rstrip(" ,;|\t\"'.")
        unit = _unit_in_legend(behind)
        if unit is not None:
            yield name, unit


def _places_of_names(line: str, names: Sequence[str]) -> Iterator[tuple[int, str]]:
    """Yield where a name stands as a word of its own in a line, the longest where several do.

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
    """Return the unit in what stands behind a name; None where there is none."""
    match = _BRACKET.match(behind)
    if match is None:
        if _A_NUMBER.search(behind):  # a value, or a range of values
            return None
        match = _LAST_BRACKET.search(behind)
    if match is not None:
        unit = match[2].strip()
        looks = is_unit(unit) or (match[1] == "[" and not re.search(r"\s|^\d*$", unit))
        return unit if looks and unit not in _NO_UNIT else None
    bare = behind.strip(" :=,\t")
    if bare and is_unit(bare) and bare not in _NO_UNIT:
        return bare
    last = _LAST_WORD.search(behind)
    return last[1] if last and is_unit(last[1]) and last[1] not in _NO_UNIT else None


# "speed unit: mm/s", "# Sliding speed [mm/s]": with a name that no column has
_OF_ANOTHER_NAME = re.compile(
    r"[#%!/\s]*(?P<what>[^\W\d][^\d\[\](),;|]{0,60}?)\s*"
    r"(?:[\[(](?P<unit>[^\[\]()]{1,20})[\])]|[:=] ?(?P<last>[^\s\[\]()]{1,20}))"
)


def _take_ecsv(found: _Units, lines: Sequence[str], before: range) -> None:
    """Take the units of the columns that the head of an ECSV file has, as YAML."""
    text, starts = "", list[tuple[int, int]]()
    for i in before:
        if is_comment(lines[i]):
            starts.append((len(text), i))
            text += uncommented(lines[i]) + " "
    for column in _ECSV_COLUMN.finditer(text[:1_000_000]):
        name, unit = (pattern.search(column[0]) for pattern in (_ECSV_NAME, _ECSV_UNIT))
        if name and unit:
            index = next(i for at, i in reversed(starts) if at <= column.start())
            found.take_name(name[1].strip(), unit[1].strip(), index)

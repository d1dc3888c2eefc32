"""Make records of lines and cells of records, find the separators in the numbers of a table, and
read the number in a cell.

A record is a line, or several lines if a cell in quotes has line ends.

``1.000`` alone may be 1 or 1000.  ``0.3``, ``2.5e3``, ``1,234.5`` and ``1.234.567`` show which
separator is which, and one such number decides for the whole table.
"""

import csv
import io
import math
import re
from collections.abc import Callable, Iterable, Iterator
from typing import Literal, NamedTuple

import numpy as np

from mumacro.errors import TextError
from mumacro.inputs.decoding import Piece
from mumacro.inputs.fields import QUANTITY_OF, RIGID, is_rigid
from mumacro.inputs.numbers import NUMBER, read_number, tidy
from mumacro.inputs.units import QUANTITIES, Scale, canonical, explain_unit, scale_of
from mumacro.kernel.arrays import Array

BLANKS = " "  #: the separator if any number of blanks separates the cells
MOST_COLUMNS = 200_000
COMMENT = ("#", "%", "//", "!")  #: first characters of a comment
#: cells without a value, in lower case
GAPS = frozenset(
    (
        *("", "-", "--", "---", "—", "–", "−", ".", "..", "...", "?", "*"),
        *("nan", "-nan", "nan(ind)", "-nan(ind)", "1.#qnan", "1.#ind", "-1.#ind"),
        *("na", "n/a", "n.a.", "n.d.", "k.a.", "k. a.", "n. v.", "<na>", "#n/a", "#na", "#nv"),
        *("null", "(null)", "none", "nil", "missing", "undefined"),
        *("#div/0!", "#value!", "#wert!", "#ref!", "#bezug!", "#num!", "#zahl!", "#name?"),
    )
)
#: texts for "this column has no unit"
NO_UNIT = ("", "-", "1")
# units of columns that are not inputs
_ELSEWHERE = {"s", "ms", "us", "min", "h", "°C", "C", "K", "degC", "V", "mV", "A", "mA", "W", "mW"}
_OF_TABLE = {unit for quantity in QUANTITIES.values() for unit in quantity.units} - {*NO_UNIT}
# cells between blanks: in quotes, or with blanks within brackets; brackets belong to the text
# before them
_CELL = re.compile(r'"([^"]*)"|((?:[^\s\[\]()"]|\[[^\[\]]*\]|\([^()]*\)|[\[\]()"])+)')
# by the separator: a cell of a record with what is before it, a record, and a quoted cell that is
# not closed, with what is before it
_CELL_OF = {
    sep: re.compile(rf'(\A|[{sep}])(?: *+("(?:[^"]++|"")*+") *+(?=[{sep}]|\Z)|([^{sep}]*+))')
    for sep in ",;|\t"
}
_OF_RECORD = r'(?: *+"(?:[^"]++|"")*+" *+(?=[SEP\n]|\Z)|(?! *+")[^SEP\n]*+)'
_RECORD = {
    sep: re.compile(f"{_OF_RECORD}(?:[SEP]{_OF_RECORD})*+".replace("SEP", sep)) for sep in ",;|\t"
}
_UNCLOSED = {sep: re.compile(rf'[{sep}]? *+"(?:[^"]++|"")*+\Z') for sep in ",;|\t"}
_WITH_POINTS = str.maketrans(",.", ".?")


# --- records and their cells ----------------------------------------------------------------------


class Record(NamedTuple):
    """Hold a line with the lines in which its quoted cells end."""

    line: int  #: where it begins
    text: str  #: without blanks around quoted cells
    is_open: bool = False  #: whether a quoted cell does not end in the lines that were given


def records(piece: Piece, sep: str, is_alone: Callable[[str], bool]) -> Iterator[Record]:
    """Yield the records of some lines, without empty ones; ``sep`` is a character.  A line for
    which ``is_alone`` is true is one, whatever quotes it has.  Raise TextError for a quote that
    begins a cell and does not end it.

    >>> piece = Piece(1, 'a\\n5" disk, "b\\nc"\\n"d')
    >>> [record.text for record in records(piece, ",", is_comment)]
    ['a', '5" disk,"b\\nc"', '"d']
    """
    text, line, start = piece.text, piece.first, 0
    if '"' not in text:
        yield from (Record(i, one) for i, one in enumerate(piece.lines, line) if one)
        return
    while start <= len(text):
        end = text.find("\n", start)
        end = len(text) if end < 0 else end
        record = text[start:end]
        if '"' in record and not is_alone(record):
            match = _RECORD[sep].match(text, start)
            end = match.end() if match else start
            if _UNCLOSED[sep].match(text, end):
                yield Record(line, text[start:], is_open=True)
                return
            if not text.startswith("\n", end) and end < len(text):
                raise unclosed(line)
            record = text[start:end]
            if ' "' in record or '" ' in record:
                record = _CELL_OF[sep].sub(r"\1\2\3", record)
        if record:
            yield Record(line, record)
        line += record.count("\n") + 1
        start = end + 1


def unclosed(line: int) -> TextError:
    """Return the error for a record with a quote that does not end its cell."""
    return TextError(f"line {line}: a quote is not closed, or not at the end of its cell")


def is_comment(line: str) -> bool:
    """Return whether a line begins like a comment."""
    return line.lstrip("\ufeff \t").startswith(COMMENT)


def uncommented(line: str) -> str:
    """Return a line without the characters that make it a comment, because the header may be in a
    comment."""
    text = line.lstrip("\ufeff ")
    return text.lstrip("#%/!").lstrip() if text.startswith(COMMENT) else text


def split_header(line: str, sep: str) -> list[str]:
    """Return the cells of a header, without the blanks around them.

    >>> split_header("v0 [mm/s]  mu_macro (-)", BLANKS)
    ['v0 [mm/s]', 'mu_macro (-)']
    """
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
    return [cell.strip() for cell in split_row(line, sep)]


def split_row(text: str, sep: str) -> list[str]:
    """Return the cells of a record unchanged; ``sep`` is a character.

    >>> split_row('5" disk;"a ""b"";";', ";")
    ['5" disk', 'a "b";', '']
    """
    if '"' not in text:
        return text.split(sep)
    return [
        cell if quoted is None else quoted[1:-1].replace('""', '"')
        for _, quoted, cell in (match.groups() for match in _CELL_OF[sep].finditer(text))
    ]


def joined(cells: Iterable[object], sep: str) -> str:
    """Return cells as a row of text, in quotes where necessary.

    >>> joined(["a", "b;c", 1], ";")
    'a;"b;c";1'
    """
    stream = io.StringIO(newline="")
    csv.writer(stream, delimiter=sep, lineterminator="\n").writerow(cells)
    return stream.getvalue()[:-1]


def starts_as_number(cell: str) -> bool:
    """Return whether a cell begins like a number."""
    return cell.lstrip("+-−., ")[:1].isdigit()


def may_be_value(cell: str) -> bool:
    """Return whether a cell may be the value of an input, a written gap or a formula."""
    text = cell.strip()
    return starts_as_number(text) or text.lower() in GAPS or is_rigid(text) or text[:1] == "="


def is_unit(text: str) -> bool:
    """Return whether a text is a unit of any quantity.

    >>> [is_unit(text) for text in ("mm/s", "-", "°C", "speed")]
    [True, True, True, False]
    """
    return (
        text in _ELSEWHERE or text in NO_UNIT or text in _OF_TABLE or canonical(text) in _OF_TABLE
    )


# --- the signs of a table -------------------------------------------------------------------------

Decimal = Literal[".", ",", ""]
#: characters between thousands, by the name in an option
THOUSANDS = {".": ".", ",": ",", "space": " ", "'": "'", "none": ""}
_BLANKS = re.compile("[ \u00a0\u2009\u202f]")
_DIGITS = re.compile(r"\s*[+\-−]?([\d.,]*)(?:[ '’\u00a0\u2009\u202f]\d{3})*([.,]\d+)?([eEdD])?")
_NUMERAL = re.compile(r"\d[\d.,]*")
_GROUPED = re.compile(r"[1-9]\d{0,2}([.,])\d{3}(?:\1\d{3})*")


class Cell(NamedTuple):
    """Hold a cell and its place."""

    line: int
    name: str
    text: str


def evidence(cell: str) -> tuple[Decimal, bool]:
    """Return the decimal separator that a number shows ("" if it shows none), and whether this is
    certain.

    >>> evidence("0,3"), evidence("1.000"), evidence("1.000.000"), evidence("7")
    ((',', True), ('.', False), (',', True), ('', False))
    """
    match = _DIGITS.match(cell.partition("..")[0])
    if match is None or cell.startswith("#", match.end()):  # 1.#QNAN
        return "", False
    digits = match[1] + (match[2] or "")
    if not digits.strip(".,"):
        return "", False
    sign: Decimal = "." if digits.rfind(".") > digits.rfind(",") else ","
    other: Decimal = "," if sign == "." else "."
    if sign not in digits:
        return "", False
    has_thousands = not match[2] and _GROUPED.fullmatch(digits)
    if digits.count(sign) > 1:
        return (other, True) if has_thousands else ("", False)
    return sign, not has_thousands or other in digits or match[3] is not None


class Signs(NamedTuple):
    """Hold the separators in the numbers of a table."""

    decimal: str = ""  #: empty if no number has one
    thousands: str | None = None  #: that the caller names, empty for none
    grouped: str = ""  #: the point or comma that numbers have between thousands

    def shown_by(self, cells: Iterable[Cell], sep: str, dashes: str) -> "Signs":
        """Return also what numbers show: the decimal separator, unless it is known, and the one
        between thousands.  If commas separate the cells, a point is the decimal separator, unless
        another number shows that it is not.

        Raise TextError if numbers contradict each other, or can all be read in two ways;
        ``dashes`` are before the name of an option.
        """
        cells_by_sign: dict[tuple[Decimal, bool], Cell] = {}
        for cell in cells:
            if "." in cell.text or "," in cell.text:
                sign, sure = evidence(cell.text)
                sure = sure or self.thousands is not None  # which is neither of the two here
                if sign:
                    cells_by_sign.setdefault((sign, sure), cell)
        decimal = self.decimal
        if not decimal and cells_by_sign:
            surely = [sign for sign in (".", ",") if (sign, True) in cells_by_sign]
            if len(surely) == 2:
                raise _contradiction(cells_by_sign[".", True], cells_by_sign[",", True], dashes)
            if not surely and not (sep == "," and (".", False) in cells_by_sign):
                raise _ambiguity(next(iter(cells_by_sign.values())), dashes)
            decimal = surely[0] if surely else "."
        other: Decimal = "," if decimal == "." else "."
        grouped = other if decimal and (other, False) in cells_by_sign else ""
        return self._replace(decimal=decimal, grouped=grouped)

    def check(self, text: str) -> None:
        """Raise ValueError if a cell has a separator that is neither the chosen thousands separator
        nor the decimal one."""
        if self.thousands is None:
            return
        text = _BLANKS.sub(" ", text.replace("’", "'"))
        for sign, name in ((".", "point"), (",", "comma")):
            if sign in text and sign not in (self.decimal, self.thousands) and ".." not in text:
                raise ValueError(
                    f"has a {name}, which is neither the decimal separator nor between thousands"
                )


def _contradiction(point: Cell, comma: Cell, dashes: str) -> TextError:
    """Return the error for two numbers with different decimal separators."""
    first, second = sorted((point, comma))
    words = {point: "a decimal point", comma: "a decimal comma"}
    return TextError(
        f"line {first.line}: {first.name} {first.text.strip()[:40]!r} has {words[first]}, line "
        f"{second.line}: {second.name} {second.text.strip()[:40]!r} {words[second]}: write "
        f"them alike, or give {dashes}decimal"
    )


def _ambiguity(cell: Cell, dashes: str) -> TextError:
    """Return the error for a number that can be read in two ways."""
    sign, _ = evidence(cell.text)
    other = "," if sign == "." else "."
    match = _NUMERAL.search(cell.text)
    digits = match[0] if match else cell.text
    part, whole = f"{float(digits.replace(sign, '.')):g}", digits.replace(sign, "")
    option = f"{dashes}decimal"
    return TextError(
        f"line {cell.line}: {cell.name} {cell.text.strip()[:40]!r} may be {part} or {whole}: "
        f"give {option} {sign} ({part}) or {option} {other} ({whole})"
    )


# --- the number in a cell -------------------------------------------------------------------------


def read_cell(name: str, cell: str, signs: Signs, scale: Scale = Scale()) -> float:  # noqa: B008
    """Return the number in a cell of a column, in the unit of the column, or NaN for a gap.

    ``name`` is the input whose units the column has, ``scale`` the scale of its unit.  Raise
    ValueError with the fault.

    >>> german = Signs(",")
    >>> read_cell("v0", "1.000,5", german), read_cell("k", "Rigid", german)
    (1000.5, inf)
    >>> read_cell("v0", "#NV", german)
    nan
    """
    text = cell.strip()
    if text.lower() in GAPS:
        return math.nan
    signs.check(text)
    try:
        return read_number(text, signs.decimal)
    except ValueError as error:
        if name == "k" and text.lower() == RIGID:
            return math.inf
        if text[-1:] in "%‰" and QUANTITY_OF[name] == "ratio":  # a number, whatever the unit is
            number = read_number(text[:-1].strip(), signs.decimal)
            return number * scale.over / (scale.times * (100.0 if text[-1] == "%" else 1e3))
        raise ValueError(_no_number(name, text, str(error))) from None


def _no_number(name: str, text: str, fault: str) -> str:
    """Return why a cell has no number."""
    if text.startswith("="):
        return "is a formula without a value: open it in its program, and save it"
    if ".." in text or "±" in text:
        if name == "k":
            return "must be one number; its ends are columns k_low and k_high, a deviation std_k"
        return f"must be one number; a deviation is a column std_{name}, in points of a fit std"
    if not text.strip("0123456789.,'’+-−eEdD \u00a0\u202f"):
        return fault  # such as a separator that is not the decimal one
    tidied = tidy(text)
    number = NUMBER.match(tidied)
    unit = tidied[number.end() :].strip() if number else ""
    if unit and scale_of(name, unit) is not None:
        return f"must be a number alone: write its unit into the header, as in {name} [{unit}]"
    quantity = QUANTITY_OF[name]
    if unit and (bound := explain_unit(quantity, 1.0, unit)) != QUANTITIES[quantity].bound:
        return f"must be {bound} in place of 1 {unit}"
    if unit and is_unit(unit):
        return f"must be a number: {unit} is no unit of {name}"
    return "must be a number"


def numbers_of(
    cells: Iterable[str | None],
    name: str,
    signs: Signs,
    scale: Scale = Scale(),  # noqa: B008
) -> tuple[Array, dict[int, str]]:
    """Return the numbers in the cells of a column in its unit (NaN for a gap), and the faults by
    the index of the cell; see :func:`read_cell`.

    >>> numbers_of(["1,5", "-", "x"], "v0", Signs(","))
    (array([1.5, nan, nan]), {2: 'must be a number'})
    """
    texts = [cell or "" for cell in cells]
    values, faults = np.full(len(texts), math.nan), dict[int, str]()
    for i, text in enumerate(texts):
        # if commas are decimal separators, a point is not
        plain = text.translate(_WITH_POINTS) if signs.decimal == "," else text
        try:
            value = float(plain)
        except ValueError:
            value = math.nan
        if math.isfinite(value) and plain.isascii() and "_" not in plain:
            values[i] = value
            continue
        try:
            values[i] = read_cell(name, text, signs, scale)
        except ValueError as error:
            faults[i] = str(error)
    return values, faults

"""Split a line of text into cells, and read the number in a cell."""

import csv
import io
import math
import re
from collections.abc import Iterable

import numpy as np

from mumacro.inputs.fields import QUANTITY_OF, RIGID, is_rigid
from mumacro.inputs.numbers import NUMBER, Signs, read_number, tidy
from mumacro.inputs.units import QUANTITIES, Scale, canonical, scale_of
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
_WITH_POINTS = str.maketrans(",.", ".?")
_FORTRAN = re.compile(r"(?<=[\d.])[dD](?=[+-]?\d)")


# --- the cells of a line --------------------------------------------------------------------------


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
    if '"' not in line:
        return [cell.strip() for cell in line.split(sep)]
    try:
        cells = next(csv.reader([line], delimiter=sep, skipinitialspace=True), [])
    except csv.Error:
        return [line.strip()]
    return [cell.strip() for cell in cells]


def split_row(text: str, sep: str) -> list[str]:
    """Return the cells of a row unchanged; ``sep`` is a character."""
    if '"' not in text:
        return text.split(sep)
    return next(csv.reader(io.StringIO(text, newline="\n"), delimiter=sep), [])


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


# --- the number in a cell -------------------------------------------------------------------------


def read_cell(name: str, cell: str, signs: Signs, scale: Scale = Scale()) -> float:  # noqa: B008
    """Return the number in a cell of a column, in the unit of the column, or NaN for a gap.

    ``name`` is the input whose units the column has, ``scale`` the scale of its unit.  Raise
    ValueError with the fault.

    >>> german = Signs(",", None)
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
        return "must be one number; a deviation is a column std"
    if not text.strip("0123456789.,'’+-−eEdD \u00a0\u202f"):
        return fault  # such as a separator that is not the decimal one
    tidied = tidy(text)
    number = NUMBER.match(tidied)
    unit = tidied[number.end() :].strip() if number else ""
    if unit and (is_unit(unit) or scale_of(name, unit) is not None):
        return f"must be a number alone: write its unit into the header, as in {name} [{unit}]"
    return "must be a number"


def numbers_of(
    cells: Iterable[str | None],
    name: str,
    signs: Signs,
    scale: Scale = Scale(),  # noqa: B008
) -> tuple[Array, dict[int, str]]:
    """Return the numbers in the cells of a column in its unit (NaN for a gap), and the faults by
    the index of the cell; see :func:`read_cell`.

    >>> numbers_of(["1,5", "-", "x"], "v0", Signs(",", None))
    (array([1.5, nan, nan]), {2: 'must be a number'})
    """
    texts = [cell or "" for cell in cells]
    values, faults = np.full(len(texts), math.nan), dict[int, str]()
    for i, text in enumerate(texts):
        # if commas are decimal separators, a point is not
        plain = text.translate(_WITH_POINTS) if signs.decimal == "," else text
        try:
            value = float(_FORTRAN.sub("e", plain) if "D" in plain or "d" in plain else plain)
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

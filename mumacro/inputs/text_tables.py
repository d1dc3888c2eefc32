"""Tables with a head: separator and decimal sign of CSV, which column is which input, its unit,
cells as numbers."""

import csv
import math
import re
from collections.abc import Mapping, Sequence

from mumacro.inputs.fields import LIKE, is_rigid, unit_of
from mumacro.inputs.names import suggestion
from mumacro.inputs.old_texts import PLAIN, number_hint
from mumacro.inputs.units import UNITS_OF, Scale, scale_of, split_unit

#: separators of the cells of CSV, by name
SEPARATORS = {",": ",", ";": ";", "|": "|", "tab": "\t"}
TOO_LARGE = "is beyond double range"
NO_UTF8 = "is not in UTF-8; save the file as UTF-8 (Excel: CSV UTF-8)"
# decimal sign -> a number that has it
_SIGNED = {sign: re.compile(rf"[+-]?\d*[{sign}]\d+([eE][+-]?\d+)?") for sign in ".,"}


def _advice(
    header: str, rows: Sequence[str], sep: str, decimal: str, more: Sequence[str]
) -> str | None:
    """The options to give where a file has another separator or decimal sign; else None."""
    separator, sign = _detect(header, rows, sep, decimal, more)
    if (separator, sign) == (sep, decimal):
        return None
    word = next(word for word, character in SEPARATORS.items() if character == separator)
    finding = f"the columns are separated by {word!r} and the decimal sign is {sign!r}"
    return f"{finding}: give --sep '{word}' --decimal '{sign}'"


def _detect(
    header: str, rows: Sequence[str], sep: str, decimal: str, more: Sequence[str]
) -> tuple[str, str]:
    """The separator that gives most names of inputs or ``more``, and the decimal sign of most
    numbers; at a tie those of the options."""

    def inputs(separator: str) -> list[int]:
        names = [split_unit(name)[0] for name in header.replace('"', "").split(separator)]
        return [
            i for i, name in enumerate(names) if name in more or suggestion(name, loosely=False)
        ]

    best = max({sep, *SEPARATORS.values()}, key=lambda s: (len(inputs(s)), s in header, s == sep))
    input_columns = inputs(best)
    cells = [
        cell.strip()
        for row in csv.reader(rows, delimiter=best)
        for i, cell in enumerate(row)
        if i in input_columns
    ]

    def cells_with(sign: str) -> int:
        return sum(_SIGNED[sign].fullmatch(cell) is not None for cell in cells)

    return best, max(".,", key=lambda sign: (cells_with(sign), sign == decimal))


def read_text(data: bytes, where: str) -> str:
    """A file of CSV as text, without the mark of byte order; ValueError with the remedy where it is
    no UTF-8.

    >>> read_text(b"v0 [mm/s];\\xb5", "points.csv")
    Traceback (most recent call last):
    ValueError: points.csv: line 1 is not in UTF-8; save the file as UTF-8 (Excel: CSV UTF-8)
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ValueError(f"{where}: line {line} {NO_UTF8}") from None


def read_head(
    line: str, rows: Sequence[str], sep: str, decimal: str, more: Sequence[str] = ()
) -> list[str]:
    """The names in the first line of CSV; ValueError where it is no header, or the ``rows``
    behind it need other options.

    ``more`` are names of columns that are no inputs.

    >>> read_head("mu0;Fz;v0", ["0,3;10;0,01"], ",", ".")
    Traceback (most recent call last):
    ValueError: the columns are separated by ';' and the decimal sign is ',': give --sep ';'
    --decimal ','
    """
    try:
        cells = next(csv.reader([line], delimiter=sep, strict=True), [])
    except csv.Error as error:
        raise ValueError(f"is no header of CSV ({error})") from None
    if not any(map(str.strip, cells)):
        raise ValueError("must name the columns, and is empty")
    if remedy := _advice(line, rows, sep, decimal, more):
        raise ValueError(remedy)
    return cells


def find_heads(
    heads: Sequence[str], like: Mapping[str, str]
) -> tuple[dict[str, tuple[int, Scale]], list[str]]:
    """The place and unit of each column by name, and the faults of the heads.

    ``like`` has the names of the columns, and for each the input whose units it has; other columns
    are left out.

    >>> find_heads(["v0 [mm/s]", "note"], {"v0": "v0"})
    ({'v0': (0, Scale(times=1.0, over=1000.0))}, [])
    """
    columns: dict[str, tuple[int, Scale]] = {}
    faults = []
    for i, head in enumerate(heads):
        name, unit = split_unit(head)
        if name not in like:
            continue
        scale = Scale() if unit is None else scale_of(like[name], unit)
        if scale is None:
            hint = (
                "; a frequency is f [Hz]" if name == "omega" and scale_of("f", unit or "") else ""
            )
            units = ", ".join(sorted(UNITS_OF[like[name]]))
            faults.append(
                f"the column {head!r} has a unit that {name} cannot have{hint}; known are {units}"
            )
        if name in columns:
            faults.append(
                f"{name} is there twice: {heads[columns[name][0]]!r} and {head!r}; rename one"
            )
        columns[name] = i, scale or Scale()
    if {"f", "omega"} <= columns.keys():
        faults.append("there are both f [Hz] and omega [rad/s]; leave one out")
    return columns, faults


def meant_by(head: str, *, loosely: bool = True) -> str | None:
    """The input that a head probably stands for, as a whole or by its first word: k for
    ``k_N_per_mm``."""
    name = split_unit(head)[0]
    first = re.split(r"[\W_]+", name.strip("_ "))[0]
    return suggestion(name, loosely=loosely) or suggestion(first, loosely=False)


def absent(name: str, heads: Sequence[str]) -> str:
    """What to do about a column that is missing.

    >>> absent("v0", ["speed", "mu_macro"])
    "there is no column v0; 'speed' is similar: rename that column to v0 [m/s] (or another unit in
    brackets)"
    """
    if alike := _similar(name, heads):
        remedy = f"rename that column to {alike[1]} (or another unit in brackets)"
        return f"there is no column {name}; {alike[0]!r} is similar: {remedy}"
    meaning = ": the mean friction force over Fz" if name == "mu_macro" else ""
    columns = ", ".join(map(repr, heads))
    return f"there is no column {_heading(name)}{meaning}; there are {columns}"


def absent_together(names: Sequence[str], heads: Sequence[str]) -> str:
    """What to do about several columns that are missing; what they share is told once.

    >>> absent_together(["Fz", "v0"], ["speed", "note"])
    "there are no columns Fz [N], v0 [m/s]; there are 'speed', 'note'; similar: rename 'speed' to
    v0 [m/s]"
    """
    headings = ", ".join(map(_heading, names))
    renames = [f"{one[0]!r} to {one[1]}" for name in names if (one := _similar(name, heads))]
    remedy = f"; similar: rename {', '.join(renames)}" if renames else ""
    columns = ", ".join(map(repr, heads))
    return f"there are no columns {headings}; there are {columns}{remedy}"


def _heading(name: str) -> str:
    """The heading that a column of an input has, in SI units."""
    heading = f"{name} [{unit_of(name) if name in (*UNITS_OF, *LIKE) else '-'}]"
    return f"{heading} or f [Hz]" if name == "omega" else heading


def _similar(name: str, heads: Sequence[str]) -> tuple[str, str] | None:
    """The head that probably stands for an input, and the heading that it should have."""
    for head in heads:
        field = meant_by(head)
        if field and field in (name, {"omega": "f"}.get(name)):
            return head, f"{field} [{unit_of(field)}]"
    return None


def read_cell(name: str, cell: str, decimal: str = ".") -> float:
    """The number in a cell of the column ``name``: NaN where it is empty, infinity for the word
    rigid in k.

    With a decimal comma 1.5 is refused: it may stand for 1500.  ValueError says what is wrong.

    >>> read_cell("v0", " 0,5 ", ","), read_cell("k", "Rigid"), read_cell("k", "")
    (0.5, inf, nan)
    """
    text = cell.strip()
    if not text:
        return math.nan
    if name == "k" and is_rigid(text):
        return math.inf
    plain = text if decimal == "." else text.replace(".", "?").replace(decimal, ".")
    if not PLAIN.fullmatch(plain):
        has_hint = decimal == "." or (name == "k" and ".." in text)
        raise ValueError(
            number_hint(name, text) if has_hint else f"must be a number such as 0{decimal}5"
        )
    value = float(plain)
    # too many digits must not pass for an infinite stiffness
    if math.isinf(value) and any(map(str.isdigit, plain)):
        raise ValueError(TOO_LARGE)
    return value

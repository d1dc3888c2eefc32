"""Separator and decimal sign of CSV: the words for them, and what a file has, by a look at its first lines."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence

from mumacro.inputs import split_unit, suggestion

__all__ = ["SEPARATORS", "advice"]

#: what may stand between the cells of CSV, by the word for it
SEPARATORS = {",": ",", ";": ";", "|": "|", "tab": "\t"}
_SIGNED = r"[+-]?\d*[{}]\d+([eE][+-]?\d+)?"  # a number with a decimal sign


def advice(header: str, rows: Sequence[str], sep: str, decimal: str) -> str | None:
    """The options to give, where a file is not as they say; None where it is.

    Examples
    --------
    >>> advice("mu0;Fz;v0", ["0,3;10;0,01"], ",", ".")
    "the columns are separated by ';' and the decimal sign is ',': give --sep ';' --decimal ','"
    """
    found, sign = _recognised(header, rows, sep, decimal)
    if (found, sign) == (sep, decimal):
        return None
    word = next(word for word, known in SEPARATORS.items() if known == found)
    told = f"the columns are separated by {word!r} and the decimal sign is {sign!r}"
    return f"{told}: give --sep '{word}' --decimal '{sign}'"


def _recognised(header: str, rows: Sequence[str], sep: str, decimal: str) -> tuple[str, str]:
    """The separator that gives the most names of inputs, and the decimal sign of most numbers; if unsure, as given."""

    def inputs(given: str) -> list[int]:
        names = header.replace('"', "").split(given)
        return [i for i, name in enumerate(names) if suggestion(split_unit(name)[0], loosely=False)]

    best = max({sep, *SEPARATORS.values()}, key=lambda s: (len(inputs(s)), s in header, s == sep))
    places = inputs(best)
    cells = [cell.strip() for row in csv.reader(rows, delimiter=best) for i, cell in enumerate(row) if i in places]

    def cells_with(sign: str) -> int:
        return sum(re.fullmatch(_SIGNED.format(sign), cell) is not None for cell in cells)

    return best, max(".,", key=lambda sign: (cells_with(sign), sign == decimal))

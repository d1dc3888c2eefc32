"""How results show themselves: as text of at most 16 lines, as a table of a notebook, as a frame of
pandas, and as what JSON holds."""

import html
import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from mumacro.errors import MumacroError

Rows = list[tuple[str, ...]]  # of texts, as a table shows them

LINES, WIDTH = 16, 100  # of a ``repr``
_ENDS = 5  # rows at the beginning and at the end of a long table
_DIGITS = 6


def listed(value: Any) -> Any:
    """Numbers, texts, lists and dicts for JSON: lists in place of arrays, None where a number is
    not finite, and for no text.

    >>> listed({"mu_macro": np.array([0.2, np.nan]), "regime": "stick_slip"})
    {'mu_macro': [0.2, None], 'regime': 'stick_slip'}
    """
    if type(value) is float:
        return value if math.isfinite(value) else None
    if isinstance(value, str):
        return value or None
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return members_of(value)
    if isinstance(value, (list, tuple)):
        return [listed(entry) for entry in value]
    if value is None or isinstance(value, (bool, int)):
        return value
    array = np.asarray(value)
    if array.dtype.kind == "f":
        array = np.where(np.isfinite(array), array, None)  # type: ignore[call-overload]
    elif array.dtype.kind in "OU":
        texts = [x if isinstance(x, str) and x else None for x in array.ravel().tolist()]
        array = np.array(texts, object).reshape(array.shape)
    return array.tolist()


def members_of(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values by name for JSON, see :func:`listed`."""
    return {name: listed(value) for name, value in values.items()}


def frame_of(columns: Mapping[str, Any]) -> Any:
    """Columns as a DataFrame of pandas, one row a case; MumacroError without pandas."""
    try:
        import pandas
    except ModuleNotFoundError:
        raise MumacroError("pandas is not installed: pip install pandas") from None
    return pandas.DataFrame(
        {
            name: x if hasattr(x, "index") and hasattr(x, "dtype") else np.ravel(x)
            for name, x in columns.items()
        }
    )


def known(value: float, digits: int, error: float = 0.0, deviation: float = 0.0) -> str:
    """A number with ``digits`` digits, less those that are not known: none is below the first digit
    of its ``error``, or the second of its ``deviation``.

    >>> known(0.24046650645751835, 6), known(0.24046650645751835, 6, deviation=0.0136)
    ('0.240467', '0.240')
    >>> known(-3.7e-10, 6, error=2e-7), known(0.2, 6, error=8e-3)
    ('0', '0.200')
    """
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    if 0.0 < error < math.inf:
        places = min(places, -math.floor(math.log10(error)))
    if 0.0 < deviation < math.inf:
        places = min(places, 1 - math.floor(math.log10(deviation)))
    rounded = round(value, places)
    if rounded == 0.0:
        return "0"
    count = max(places + 1 + math.floor(math.log10(abs(rounded))), 1)
    return f"{rounded:#.{count}g}".removesuffix(".")


def tidy_zeros(text: str) -> str:
    """A number without zeros at its end.

    >>> [tidy_zeros(text) for text in ("2.500", "100", "1.0e-07", "2.0")]
    ['2.5', '100', '1e-07', '2']
    """
    mantissa, e, exponent = text.partition("e")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    return f"{mantissa}{e}{exponent}"


def cell(value: Any) -> str:
    """One value of a table."""
    if isinstance(value, (float, np.floating)):
        return f"{value:.{_DIGITS}g}"
    return str(value)


def _table(columns: Mapping[str, Any]) -> list[list[str]]:
    """The heads of columns, and of their rows (n,) the first and the last; places stand before
    them."""
    arrays = [np.asarray(x) for x in columns.values()]
    shape = arrays[0].shape if arrays else (0,)
    size = math.prod(shape)
    places = np.arange(size) if size <= 2 * _ENDS else np.r_[0:_ENDS, size - _ENDS : size]
    indices = zip(*np.unravel_index(places, shape), strict=True) if shape else [()]
    names = [", ".join(map(str, map(int, index))) for index in indices]
    texts = [[cell(x) for x in np.ravel(array)[places].tolist()] for array in arrays]
    rows = [list(row) for row in zip(names, *texts, strict=True)]
    if size > 2 * _ENDS:
        rows.insert(_ENDS, ["..."] * (1 + len(arrays)))
    return [["", *columns], *rows]


def _fitting(table: Sequence[Sequence[str]]) -> tuple[list[str], int]:
    """The rows of a table as lines, and how many of its last columns do not fit them."""
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    count = len(widths)
    while count > 2 and 2 * count + sum(widths[:count]) > WIDTH:
        count -= 1
    lines = [
        "  ".join(x.rjust(width) for x, width in zip(row, widths[:count], strict=False))
        for row in table
    ]
    return [f"  {line}".rstrip() for line in lines], len(widths) - count


def text_of(heading: str, columns: Mapping[str, Any], notes: Iterable[str] = ()) -> str:
    """A heading, the first and the last rows of columns, and notes, in at most 16 lines of 100
    characters."""
    lines, rest = _fitting(_table(columns)) if columns else ([], 0)
    if rest:
        lines.append(f"  {rest} more columns: see to_frame()")
    below = [part for note in notes for part in _broken(f"  {note}")]
    return _in_lines([*_broken(heading), *lines, *below])


def text_of_rows(heading: str, pairs: Iterable[Sequence[str]], notes: Iterable[str] = ()) -> str:
    """A heading, and rows of cells and notes below it, in at most 16 lines of 100 characters;
    notes come before rows that do not fit."""
    table = [*pairs]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = [
        "  " + "  ".join(x.ljust(width) for x, width in zip(row, widths, strict=True)).rstrip()
        for row in table
    ]
    below = [part for note in notes for part in _broken(f"  {note}")][: LINES - 2]
    rows = _in_lines([heading, *(line[:WIDTH] for line in lines)], LINES - len(below))
    return "\n".join([rows, *below])


def _in_lines(lines: list[str], most: int = LINES) -> str:
    if len(lines) > most:
        lines = [*lines[: most - 1], f"  ... {len(lines) - most + 1} more lines"]
    return "\n".join(lines)


def _broken(line: str) -> list[str]:
    return textwrap.wrap(line, WIDTH, subsequent_indent="    ")


def html_of(heading: str, columns: Mapping[str, Any], notes: Iterable[str] = ()) -> str:
    """The same as a table of a notebook, with all columns."""
    head, *body = _table(columns) if columns else [[]]
    return _html(heading, head, body, notes)


def html_of_rows(heading: str, pairs: Iterable[Sequence[str]], notes: Iterable[str] = ()) -> str:
    """Rows of cells, and notes below them, as a table of a notebook."""
    return _html(heading, [], pairs, notes)


def _html(
    heading: str, head: Sequence[str], body: Iterable[Sequence[str]], notes: Iterable[str]
) -> str:
    def line(tag: str, cells: Sequence[str]) -> str:
        style = ' style="text-align: left"'
        return "<tr>" + "".join(f"<{tag}{style}>{html.escape(x)}</{tag}>" for x in cells) + "</tr>"

    parts = [
        f"<p>{html.escape(heading)}</p>" if heading else "",
        "<table>",
        line("th", head) if head else "",
        *(line("td", row) for row in body),
        "</table>",
        *(f"<p>{html.escape(note)}</p>" for note in notes),
    ]
    return "<div>" + "".join(parts) + "</div>"

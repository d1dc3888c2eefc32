"""Define what every result has: a heading, columns by path, rows if it is about one thing, and
notes.

:class:`Result` makes all forms from them: text of at most 16 lines, a table of a notebook, a frame
of pandas, and JSON.  A :class:`Note` is one type, whoever writes it: an answer remarks on a unit
that is probably wrong, and says what the model leaves out; a motion and a fit warn; a loop notes
what was done to its samples.
"""

import html
import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypedDict

import numpy as np

from mumacro.errors import MumacroError

Rows = list[tuple[str, ...]]  # texts of a table

LINES, WIDTH = 16, 100  # limits of a ``repr``
_ENDS = 5  # rows at the beginning and at the end of a long table
_DIGITS = 6


# --- notes ----------------------------------------------------------------------------------------

REMARK, ASSUMES, WARNING, NOTE = "remark", "assumes", "warning", "note"


class Remark(TypedDict):
    """Define a remark in JSON: its topic, the input, the number of cases, and a sentence about the
    first of them."""

    row: str
    field: str
    cases: int
    text: str


class Row(TypedDict):
    """Define what the model leaves out, in JSON: a row of docs/validity.md, a sentence, and the
    relative change of mu_macro, or None if its size is unknown."""

    row: str
    text: str
    effect: float | None


class Note(NamedTuple):
    """Hold one note on a result."""

    word: str  #: its type: remark, assumes, warning, note
    text: str
    row: str = ""  #: its topic, such as a row of docs/validity.md
    field: str = ""  #: the input or output, if the note is about one
    effect: float | None = None  #: the relative change of mu_macro [-]; None if it is unknown
    cases: int = 1  #: number of cases that it is about; the text is about the first of them

    @property
    def about(self) -> str:
        """Return the topic and the text.

        >>> Note(REMARK, "is k = 1 in N/m?", "units", "k", cases=2).about
        'k: is k = 1 in N/m? (2 cases)'
        """
        name = self.field or self.row
        count = f" ({self.cases} cases)" if self.cases > 1 else ""
        return f"{name}: {self.text}{count}" if name else f"{self.text}{count}"

    @property
    def line(self) -> str:
        """Return the note as a line of its own."""
        return f"{self.word}: {self.about}"

    @property
    def as_remark(self) -> Remark:
        """Return the note as ``remarks`` has it in JSON."""
        return {"row": self.row, "field": self.field, "cases": self.cases, "text": self.text}

    @property
    def as_row(self) -> Row:
        """Return the note as ``model`` has it in JSON."""
        return {"row": self.row, "text": self.text, "effect": self.effect}


def texts_of(notes: Iterable[Note], word: str) -> list[str]:
    """Return the texts of the notes of this type."""
    return [note.text for note in notes if note.word == word]


def add(notes: list[Note], note: Note) -> None:
    """Add a note to a list, or add its cases to a note in the list with the same row and field."""
    for i, other in enumerate(notes):
        if (other.word, other.row, other.field) == (note.word, note.row, note.field):
            notes[i] = other._replace(cases=other.cases + note.cases)
            return
    notes.append(note)


# --- results --------------------------------------------------------------------------------------


class Result:
    """Hold the answer to a question.

    Each subclass tells what its columns are.  It may also have members for JSON, a heading, rows
    and notes.  This class makes the forms.
    """

    __slots__ = ()

    @property
    def columns(self) -> Mapping[str, Any]:
        """Return the result as a table: numbers and texts by path."""
        raise NotImplementedError

    if TYPE_CHECKING:

        @property
        def notes(self) -> Sequence[Note]:
            """Return the notes on the result."""

    else:
        notes = ()  # not a property, because a field of this name could not set it

    @property
    def remarks(self) -> list[Remark]:
        """Return what is doubtful, one remark for each input or output: ``row``, the type of
        doubt; ``field``; ``cases``, their number; ``text``.  Return an empty list if nothing is
        doubtful."""
        return [note.as_remark for note in self.notes if note.word == REMARK]

    @property
    def warnings(self) -> list[str]:
        """Return the texts of the notes that warn."""
        return texts_of(self.notes, WARNING)

    def to_dict(self) -> dict[str, Any]:
        """Return the members as JSON has them.  They are the same on the command line and over
        HTTP, where ``table`` and ``api_version`` are added.  Arrays become lists, and a number that
        is not finite becomes None."""
        return {name: listed(value) for name, value in self._members().items()}

    def to_frame(self) -> Any:
        """Return the columns as a DataFrame of pandas.  Raise MumacroError if pandas is not
        installed."""
        return frame_of(self.columns)

    def __repr__(self) -> str:
        """Show the result in at most 16 lines of 100 characters."""
        rows = self._rows()
        if rows is None:
            return _text_of(self._heading(), _table_lines(self._shown()), self._below())
        return _text_of(self._heading(), _aligned(rows), self._below(), notes_first=True)

    def _repr_html_(self) -> str:
        """Show the result as a table of a notebook."""
        heading, rows, below = self._in_full()
        if rows is not None:
            return _html(heading, [], rows, below)
        columns = self._shown()
        head, *body = _table_of(columns) if columns else [[]]
        return _html(heading, head, body, below)

    # --- what a kind of result says of itself -----------------------------------------------------

    def _members(self) -> Mapping[str, Any]:
        """Return the members as JSON has them, but with arrays."""
        return self.columns

    def _heading(self) -> str:
        """Return the first line."""
        return f"<{type(self).__name__}>"

    def _shown(self) -> Mapping[str, Any]:
        """Return the columns that are shown."""
        return self.columns

    def _rows(self) -> Rows | None:
        """Return rows of name, value, unit and meaning if the result is about one thing.  They
        replace the columns."""
        return None

    def _below(self) -> list[str]:
        """Return the lines below the result."""
        return [note.line for note in self.notes]

    def _in_full(self) -> tuple[str, Rows | None, list[str]]:
        """Return heading, rows and the lines below, for a place with room for all of them."""
        return self._heading(), self._rows(), self._below()


# --- the forms ------------------------------------------------------------------------------------


def listed(value: Any) -> Any:
    """Return numbers, texts, lists and dicts for JSON: lists for arrays, None for a number that is
    not finite and for a missing text.

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
        return {name: listed(entry) for name, entry in value.items()}
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


def frame_of(columns: Mapping[str, Any]) -> Any:
    """Return columns as a DataFrame of pandas, one row for each case.  Raise MumacroError if pandas
    is not installed."""
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


def cell(value: Any) -> str:
    """Return one value of a table as text."""
    if isinstance(value, (float, np.floating)):
        return f"{value:.{_DIGITS}g}"
    return str(value)


def _table_of(columns: Mapping[str, Any]) -> list[list[str]]:
    """Return the rows of a table as texts: the headers first, then the first and the last rows of
    the columns (n,).  Each row begins with its index."""
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
    """Return the rows of a table as lines, and how many of its last columns do not fit in them."""
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    count = len(widths)
    while count > 2 and 2 * count + sum(widths[:count]) > WIDTH:
        count -= 1
    lines = [
        "  ".join(x.rjust(width) for x, width in zip(row, widths[:count], strict=False))
        for row in table
    ]
    return [f"  {line}".rstrip() for line in lines], len(widths) - count


def _in_lines(lines: list[str], most: int = LINES) -> str:
    if len(lines) > most:
        lines = [*lines[: most - 1], f"  ... {len(lines) - most + 1} more lines"]
    return "\n".join(lines)


def _broken(line: str) -> list[str]:
    return textwrap.wrap(line, WIDTH, subsequent_indent="    ")


def _text_of(
    heading: str, lines: Sequence[str], notes: Iterable[str], notes_first: bool = False
) -> str:
    """Return a heading, lines and notes below them, in at most 16 lines of 100 characters.  If
    there is too much, leave out the last notes, or with ``notes_first`` the last lines."""
    below = [part for note in notes for part in _broken(f"  {note}")]
    if notes_first:
        below = below[: LINES - 2]
        return "\n".join([_in_lines([*_broken(heading), *lines], LINES - len(below)), *below])
    return _in_lines([*_broken(heading), *lines, *below])


def _aligned(rows: Rows) -> list[str]:
    """Return rows of cells as lines of at most 100 characters."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ("  ".join(x.ljust(n) for x, n in zip(row, widths, strict=True)) for row in rows)
    return [f"  {line}".rstrip()[:WIDTH] for line in lines]


def _table_lines(columns: Mapping[str, Any]) -> list[str]:
    """Return the first and the last rows of columns as lines, and count the columns that do not
    fit."""
    if not columns:
        return []
    lines, rest = _fitting(_table_of(columns))
    return [*lines, f"  {rest} more columns: see to_frame()"] if rest else lines


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

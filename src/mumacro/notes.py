"""Define the notes on a result: one type, whoever writes them.

An answer remarks on a unit that is probably wrong, and says what the model leaves out.  A motion
and a fit warn.  A loop notes what was done to its samples.  Each of them is a :class:`Note`.
"""

from collections.abc import Iterable
from typing import NamedTuple, TypedDict

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

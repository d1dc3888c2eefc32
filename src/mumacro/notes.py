"""What is said beside a result: one kind of thing, whoever says it.

An answer remarks on a unit that is probably wrong and says what the model leaves out; a motion and
a fit warn; a loop notes what was done to its samples.  Each is a :class:`Note`.
"""

from collections.abc import Iterable
from typing import NamedTuple, TypedDict

REMARK, ASSUMES, WARNING, NOTE = "remark", "assumes", "warning", "note"


class Remark(TypedDict):
    """A remark as JSON has it: what it is about, the input, how many cases, a sentence on the first
    of them."""

    row: str
    field: str
    cases: int
    text: str


class Row(TypedDict):
    """What the model leaves out, as JSON has it: a row of docs/validity.md, a sentence, and the
    relative change of mu_macro, or None where its size is unknown."""

    row: str
    text: str
    effect: float | None


class Note(NamedTuple):
    """One thing that is said beside a result."""

    word: str  #: how it is meant: remark, assumes, warning, note
    text: str
    row: str = ""  #: what it is about, such as a row of docs/validity.md
    field: str = ""  #: the input or output, if it is about one
    effect: float | None = None  #: the relative change of mu_macro [-]; None where it is unknown
    cases: int = 1  #: how many cases it is about; the text is on the first of them

    @property
    def about(self) -> str:
        """The text behind what it is about.

        >>> Note(REMARK, "is k = 1 in N/m?", "units", "k", cases=2).about
        'k: is k = 1 in N/m? (2 cases)'
        """
        name = self.field or self.row
        count = f" ({self.cases} cases)" if self.cases > 1 else ""
        return f"{name}: {self.text}{count}" if name else f"{self.text}{count}"

    @property
    def line(self) -> str:
        """The note in a line of its own."""
        return f"{self.word}: {self.about}"

    @property
    def as_remark(self) -> Remark:
        """The note as ``remarks`` in JSON."""
        return {"row": self.row, "field": self.field, "cases": self.cases, "text": self.text}

    @property
    def as_row(self) -> Row:
        """The note as ``model`` in JSON."""
        return {"row": self.row, "text": self.text, "effect": self.effect}


def texts_of(notes: Iterable[Note], word: str) -> list[str]:
    """Return the texts of the notes with this word."""
    return [note.text for note in notes if note.word == word]


def add(notes: list[Note], note: Note) -> None:
    """Add a note to others, or its cases to one of the same row and field."""
    for i, other in enumerate(notes):
        if (other.word, other.row, other.field) == (note.word, note.row, note.field):
            notes[i] = other._replace(cases=other.cases + note.cases)
            return
    notes.append(note)

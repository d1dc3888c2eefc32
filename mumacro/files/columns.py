"""Which column of a file is which input, and in which unit.  Names similar to a missing input are refused."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from mumacro.answer import IntervalAnswer
from mumacro.contact import AMPLITUDE, SPRING, Kind
from mumacro.errors import MumacroError
from mumacro.inputs import LIKE, UNITS_OF, Scale, scale_of, split_unit, suggestion, unit_of
from mumacro.interval import ENDS

__all__ = ["ANSWERS", "BAND", "Columns", "FilesError", "find_columns"]

#: columns that are added
ANSWERS = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")
BAND = IntervalAnswer.__slots__  # beside mu_macro, of an interval of k


class FilesError(MumacroError):
    """A file of cases cannot be read, understood or written; one line that names it, the reason and the remedy."""


@dataclass(frozen=True)
class Columns:
    """Where the inputs are: by input (``omega`` or ``f``) the column and what its unit is in SI; no k when rigid.

    An interval of k has ``k_low`` and ``k_high`` in its place; ``kind`` is the contact and direction of all cases.
    """

    places: dict[str, tuple[str, Scale]]
    kind: Kind = SPRING

    @property
    def fields(self) -> tuple[str, ...]:
        """The inputs in their order; omega for either frequency."""
        ends = ENDS if ENDS[0] in self.places else ("k",)
        return tuple(name for field in self.kind.fields for name in (ends if field == "k" else (field,)))

    def added(self, include: Sequence[str] = ()) -> list[str]:
        """The names of the columns that are added."""
        slopes = [f"d_mu_macro_d_{name}" for name in self.kind.fields] if "gradient" in include else []
        return [ANSWERS[0], *(BAND if ENDS[0] in self.places else ()), *ANSWERS[1:], *slopes]

    @property
    def inputs(self) -> list[str]:
        """The headings of the inputs."""
        return [heading for heading, _ in self.places.values()]

    @property
    def stiffness(self) -> str | None:
        """The heading of k; None when every contact is rigid, by the user's option."""
        return self.places["k"][0] if "k" in self.places else None


def find_columns(
    names: Sequence[str], rigid: bool = False, include: Sequence[str] = (), kind: Kind = SPRING
) -> Columns:
    """Find the inputs among the columns of a file.

    Parameters
    ----------
    names : sequence of str
        The headings, such as ``Fz``, ``k [N/mm]`` or ``note``.
    rigid : bool
        All contacts are rigid; then there must be no column for k.
    include : sequence of str
        What is added beside the answer: ``"gradient"``.
    kind : Kind
        The contact and direction of all cases.

    Returns
    -------
    Columns
        All inputs; other columns are not named.

    Raises
    ------
    FilesError
        A column that is there twice, would be written twice, has an unknown unit, or is missing; then the columns that
        were seen are listed, or a similar one is named.

    Examples
    --------
    >>> find_columns(["mu0", "Fz [kN]", "k", "y0", "f", "v0", "note"]).places["Fz"]
    ('Fz [kN]', Scale(times=1000.0, over=1.0))
    """
    for name in names:
        if names.count(name) > 1:
            raise FilesError(f"the column {name!r} is there twice")
    places: dict[str, tuple[str, Scale]] = {}
    for column in names:
        name, unit = split_unit(column)
        if name not in (*kind.columns, *ENDS):
            continue
        if name in places:
            raise FilesError(f"{name} is there twice: {places[name][0]!r} and {column!r}; rename one")
        scale = Scale() if unit is None else scale_of(name, unit)
        if scale is None:
            hint = "; a frequency is f [Hz]" if name == "omega" and scale_of("f", unit or "") else ""
            known = ", ".join(sorted(UNITS_OF[LIKE.get(name, name)]))
            raise FilesError(f"the column {column!r} has a unit that {name} cannot have{hint}; known are {known}")
        places[name] = (column, scale)
    if {"f", "omega"} <= places.keys():
        raise FilesError("there are both f [Hz] and omega [rad/s]; leave one out")
    if rigid:
        for column in names:
            if _meant(column, loosely=False) == "k":
                raise FilesError(f"--rigid is given, but the column {column!r} looks like a stiffness; leave one out")
    if "k" in places and (end := next((end for end in ENDS if end in places), None)):
        raise FilesError(f"there are both k and {end}; leave one out")
    ends = ENDS if {*ENDS} & places.keys() else ("k",)
    for field in kind.fields:
        for name in ends if field == "k" else (field,):
            if name not in places and not (name == "omega" and "f" in places) and not (name == "k" and rigid):
                raise FilesError(_advice(name, names))
    found = Columns(places, kind)
    if twice := [name for name in found.added(include) if name in names]:
        raise FilesError(f"the column {twice[0]!r} would be written twice; rename it")
    return found


def _meant(column: str, loosely: bool = True) -> str | None:
    """The input that a heading is taken for, as a whole or by its first word: ``k_N_per_mm`` for k."""
    name = split_unit(column)[0]
    first = re.split(r"[\W_]+", name.strip("_ "))[0]
    return suggestion(name, loosely=loosely) or suggestion(first, loosely=False)


def _advice(name: str, names: Sequence[str]) -> str:
    """What to do about an input that no column holds."""
    if name == "y0" and AMPLITUDE in (split_unit(column)[0] for column in names):
        return f"there is no column y0, but {AMPLITUDE}: give --direction normal"
    wanted = ("omega", "f") if name == "omega" else (name,)
    for column in names:
        meant = _meant(column)
        if meant and meant in wanted:
            unit = unit_of(meant)
            remedy = f"rename that column to {meant} [{unit}] (or another unit in brackets)"
            return f"there is no column {name}; {column!r} is similar: {remedy}"
    missing = "omega [rad/s] or f [Hz]" if name == "omega" else f"{name} [{unit_of(name)}]"
    rigid = "; rename the one that holds it, or give --rigid if all contacts are rigid" if name == "k" else ""
    return f"there is no column {missing}; there are {', '.join(map(repr, names))}{rigid}"

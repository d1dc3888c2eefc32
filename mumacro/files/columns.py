"""Which column of a file is which input, and in which unit.  Names similar to a missing input are refused."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mumacro.errors import MumacroError
from mumacro.inputs import SI, UNITS_OF, Scale, scale_of, split_unit, suggestion

__all__ = ["ANSWERS", "Columns", "FilesError", "find_columns"]

#: columns that are added
ANSWERS = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")
_REQUIRED = ("mu0", "Fz", "k", "y0", "omega", "v0")


class FilesError(MumacroError):
    """A file of cases cannot be read, understood or written; one line that names it, the reason and the remedy."""


@dataclass(frozen=True)
class Columns:
    """Where the inputs are: by input (``omega`` or ``f``) the column and what its unit is in SI; no k when rigid."""

    places: dict[str, tuple[str, Scale]]

    @property
    def rigid(self) -> bool:
        """Whether every contact is rigid, by the user's option."""
        return "k" not in self.places


def find_columns(names: Sequence[str], rigid: bool = False, added: Sequence[str] = ANSWERS) -> Columns:
    """Find the inputs among the columns of a file.

    Parameters
    ----------
    names : sequence of str
        The headings, such as ``Fz``, ``k [N/mm]`` or ``note``.
    rigid : bool
        All contacts are rigid; then there must be no column for k.
    added : sequence of str
        Names of the columns that are added.

    Returns
    -------
    Columns
        All inputs; other columns are not named.

    Raises
    ------
    FilesError
        A column that is there twice, would be written twice, has an unknown unit, or is missing; then a similar
        column is named.

    Examples
    --------
    >>> find_columns(["mu0", "Fz [kN]", "k", "y0", "f", "v0", "note"]).places["Fz"]
    ('Fz [kN]', Scale(times=1000.0, over=1.0))
    """
    for name in names:
        if names.count(name) > 1:
            raise FilesError(f"the column {name!r} is there twice")
        if name in added:
            raise FilesError(f"the column {name!r} would be written twice; rename it")
    places: dict[str, tuple[str, Scale]] = {}
    for column in names:
        name, unit = split_unit(column)
        if name not in SI:
            continue
        if name in places:
            raise FilesError(f"{name} is there twice: {places[name][0]!r} and {column!r}; rename one")
        scale = Scale() if unit is None else scale_of(name, unit)
        if scale is None:
            hint = "; a frequency is f [Hz]" if name == "omega" and scale_of("f", unit or "") else ""
            known = ", ".join(sorted(UNITS_OF[name]))
            raise FilesError(f"the column {column!r} has a unit that {name} cannot have{hint}; known are {known}")
        places[name] = (column, scale)
    if {"f", "omega"} <= places.keys():
        raise FilesError("there are both f [Hz] and omega [rad/s]; leave one out")
    if rigid and "k" in places:
        raise FilesError(f"--rigid is given, but there is a column {places['k'][0]!r}; leave one out")
    _check_missing(names, places, rigid)
    return Columns(places)


def _check_missing(names: Sequence[str], places: dict[str, tuple[str, Scale]], rigid: bool) -> None:
    frequency = bool({"f", "omega"} & places.keys())
    for name in _REQUIRED:
        if name in places or (name == "omega" and frequency):
            continue
        wanted = ("omega", "f") if name == "omega" else (name,)
        alike = [column for column in names if suggestion(split_unit(column)[0], loosely=not rigid) in wanted]
        if alike:
            meant = suggestion(split_unit(alike[0])[0]) or name
            unit = SI[meant][0]
            remedy = f"{alike[0]!r} is similar: rename that column to {meant} [{unit}] (or another unit in brackets)"
            raise FilesError(f"there is no column {name}; {remedy}")
        if name == "k":
            if not rigid:
                seen = ", ".join(map(repr, names))
                raise FilesError(
                    f"there is no column k [N/m] (or another unit in brackets); there are {seen}; rename one of "
                    "them, or give --rigid if all contacts are rigid"
                )
        else:
            hint = "omega [rad/s] or f [Hz]" if name == "omega" else f"{name} [{SI[name][0]}]"
            raise FilesError(f"there is no column {hint}; there are {', '.join(map(repr, names))}")

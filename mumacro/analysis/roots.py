"""The results of the inverse problem, and the case that it is solved for."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from mumacro.analysis.load import Stiffening
from mumacro.errors import InputError
from mumacro.inputs.fields import as_columns, check_inputs
from mumacro.inputs.k_range import ENDS
from mumacro.inputs.kind import AMPLITUDE, SPRING, Kind


class Root(NamedTuple):
    """One value of the unknown."""

    value: float  #: the unknown [SI]
    #: between them, and on the root's side of the next turning point, mu_macro is within the
    #: surrogate's error bound of the target: the true root cannot be distinguished from any of
    #: these values [SI]
    low: float
    high: float
    mu_macro: float  #: the surrogate's value there [-]
    regime: str  #: one of :data:`mumacro.REGIMES`


@dataclass(frozen=True)
class Reach:
    """Which mu_macro is reachable in a range of the unknown."""

    low: float  #: the range of the unknown [SI]
    high: float
    mu_min: float  #: smallest and largest mu_macro in it [-]
    mu_max: float
    min_included: bool  #: False where that value is approached and never reached
    max_included: bool

    def holds(self, target: float) -> bool:
        """Whether ``target`` is reachable."""
        above = target > self.mu_min or (self.min_included and target == self.mu_min)
        return above and (target < self.mu_max or (self.max_included and target == self.mu_max))


@dataclass(frozen=True)
class Solution:
    """All roots of every target."""

    unknown: str  #: the input that was solved for
    targets: tuple[float, ...]  #: the wanted mu_macro [-]
    #: of each target, ascending; empty where it is not reachable
    roots: tuple[tuple[Root, ...], ...]
    reach: Reach  #: what is reachable in the range that was searched
    #: True when the unknown has no influence on mu_macro, such as v0 without oscillation
    constant: bool
    #: of an interval of k, whose geometric middle the rest is for: the solutions for its lowest and
    #: its highest value
    ends: tuple["Solution", "Solution"] | None = None
    #: how k grows with Fz, where that is solved for; None where k is constant
    stiffening: Stiffening | None = None


@dataclass(frozen=True)
class Crossing:
    """A value of the swept input at which the regime changes, mu_macro there, and the regimes below
    and above."""

    value: float
    mu_macro: float
    regimes: tuple[str, str]


def checked_case(case: Mapping[str, Any], without: str, kind: Kind = SPRING) -> dict[str, float]:
    """The five known inputs [SI], each one legal number, by the names of ``kind.fields``; an
    infinite ``k`` is rigid.

    ``f`` [Hz] may stand for ``omega`` [rad/s], the word ``rigid`` for an infinite ``k``.
    """
    if without not in kind.fields:
        raise InputError("unknown", without, f"one of {', '.join(kind.fields)}")
    for name in ("k_range", *ENDS):
        if case.get(name) is not None:
            told = (
                "left out: over an interval of k a target has an interval of roots; solve for "
                "both ends of it"
            )
            raise InputError(name, case[name], told)
    given = {
        name: value for name, value in case.items() if value is not None or name == "k" != without
    }
    for name in given.keys() & ({"omega", "f"} if without == "omega" else {without}):
        raise InputError(name, given[name], f"left out, because {without} is the unknown")
    given = kind.as_six({**given, without: 1.0})
    try:
        six = as_columns(given)
        columns = kind.as_given(six)
        for name, column in columns.items():
            if column.size != 1:
                raise InputError(name, given.get(name, given.get("f")), "one number")
        check_inputs(six, given.get("f"))
        if kind.normal and without not in ("Fz", AMPLITUDE):
            kind.check_lift_off(six["y0"], six["Fz"])
    except InputError as error:
        raise kind.refused(error) from error.__cause__
    return {name: float(column.item()) for name, column in columns.items() if name != without}

"""The results of the inverse problem."""

from dataclasses import dataclass
from typing import NamedTuple


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


@dataclass(frozen=True)
class Crossing:
    """A value of the swept input at which the regime changes, mu_macro there, and the regimes below
    and above."""

    value: float
    mu_macro: float
    regimes: tuple[str, str]

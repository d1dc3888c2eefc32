"""The results of the inverse problem, and the case that it is solved for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from mumacro.errors import InputError
from mumacro.inputs import BOUNDS, FIELDS, MOST_HZ, POSITIVE, RAD_PER_CYCLE, UNITS

__all__ = ["Crossing", "Reach", "Root", "Solution", "checked_case"]


class Root(NamedTuple):
    """One value of the unknown.

    Attributes
    ----------
    value : float
        The unknown [SI].
    low, high : float
        Between them, and on the root's side of the next turning point, mu_macro is within the surrogate's error bound
        of the target: the true root cannot be distinguished from any of these values [SI].
    mu_macro : float
        The surrogate's value there [-].
    regime : str
        "continuous", "stick_slip" or "static".
    """

    value: float
    low: float
    high: float
    mu_macro: float
    regime: str


@dataclass(frozen=True)
class Reach:
    """Which mu_macro is reachable in a range of the unknown.

    Attributes
    ----------
    low, high : float
        The range of the unknown [SI].
    mu_min, mu_max : float
        Smallest and largest mu_macro in it [-].
    min_included, max_included : bool
        False where that value is approached and never reached.
    """

    low: float
    high: float
    mu_min: float
    mu_max: float
    min_included: bool
    max_included: bool

    def holds(self, target: float) -> bool:
        """Whether ``target`` is reachable."""
        above = target > self.mu_min or (self.min_included and target == self.mu_min)
        return above and (target < self.mu_max or (self.max_included and target == self.mu_max))


@dataclass(frozen=True)
class Solution:
    """All roots of every target.

    Attributes
    ----------
    unknown : str
        The input that was solved for.
    targets : tuple of float
        The wanted mu_macro [-].
    roots : tuple of tuple of Root
        The roots of each target, ascending; empty where it is not reachable.
    reach : Reach
        What is reachable in the range that was searched.
    constant : bool
        True when the unknown has no influence on mu_macro, such as v0 without oscillation.
    """

    unknown: str
    targets: tuple[float, ...]
    roots: tuple[tuple[Root, ...], ...]
    reach: Reach
    constant: bool


@dataclass(frozen=True)
class Crossing:
    """A value of the swept input at which continuous sliding begins or ends, and mu_macro there."""

    value: float
    mu_macro: float


def checked_case(case: Mapping[str, float | None], without: str) -> dict[str, float | None]:
    """The five known inputs as floats; ``k`` is None for rigid contact.

    ``f`` [Hz] may stand for ``omega`` [rad/s].

    Raises
    ------
    InputError
        A value is missing, out of bounds, given twice, or given for the unknown.
    """
    if without not in FIELDS:
        raise InputError("unknown", without, f"one of {', '.join(FIELDS)}")
    given = dict(case)
    frequency = given.pop("f", None)
    if frequency is not None:
        if given.get("omega") is not None:
            raise InputError("f", frequency, "left out where omega is given")
        omega = RAD_PER_CYCLE * _number("f", frequency, "finite and >= 0")
        if omega == math.inf:
            raise InputError("f", frequency, f"at most {MOST_HZ:.4g} Hz, where omega leaves double range")
        given["omega"] = omega
    if given.get(without) is not None:
        raise InputError(without, given[without], "left out, because it is the unknown")
    out: dict[str, float | None] = {}
    for name in FIELDS:
        if name == without:
            continue
        if name == "k" and name in given and given[name] in (None, math.inf):
            out[name] = None
            continue
        if given.get(name) is None:
            hint = ": a number [N/m], or None for rigid contact" if name == "k" else f" [{UNITS[name]}]"
            raise InputError(name, None, f"given{hint}")
        out[name] = _number(name, given[name], BOUNDS[name])
    return out


def _number(name: str, value: object, bound: str) -> float:
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(name, value, bound) from error
    if not (math.isfinite(number) and (number > 0.0 or (number == 0.0 and name not in POSITIVE))):
        raise InputError(name, value, bound)
    return number

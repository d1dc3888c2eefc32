"""Hold the solution of an inverse problem: the roots of every target, and which targets are
reachable."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.units import unit_of
from mumacro.results import Result, Rows

NO_LIMIT = 1e300  # limit of the unknown; beyond it is the end of double range
_WIDE = 0.1  # relative width from which a root is described as a range
_DEGREES = 100.0  # width of a root of a phase from which it is described as a range


@dataclass(frozen=True)
class Reach:
    """Tell which means of the friction are reachable in a range of the unknown."""

    low: float  #: the range of the unknown [SI]; a phase in degrees
    high: float
    mu_min: float  #: smallest and largest mean in this range [-]
    mu_max: float
    min_included: bool = True  #: False if the value is approached but never reached
    max_included: bool = True

    def holds(self, target: float) -> bool:
        """Return whether ``target`` is reachable."""
        return self.mu_min <= target <= self.mu_max and not self.only_approaches(target)

    def only_approaches(self, target: float) -> bool:
        """Return whether ``target`` is at an end that is approached but never reached, or beyond
        it."""
        return (not self.min_included and target <= self.mu_min) or (
            not self.max_included and target >= self.mu_max
        )

    def beside(self, target: float) -> tuple[str, str]:
        """Return the target and the range of means as text, with enough digits to show that they
        differ.

        >>> Reach(0.0, 1.0, 0.17172206, 0.3).beside(0.171722)
        ('0.171722', '0.1717221 to 0.3')
        """
        digits = [_apart(end, target) for end in (self.mu_min, self.mu_max)]
        words = [_shown(end, n) for end, n in zip((self.mu_min, self.mu_max), digits, strict=True)]
        if self.only_approaches(target):
            words = [f"{word} (not reached)" if float(word) == target else word for word in words]
        return _shown(target, max(6, *digits)), " to ".join(words)


def _apart(end: float, target: float) -> int:
    """Return how many digits, at least 4, show that two numbers differ."""
    return next((n for n in range(4, 17) if _shown(end, n) != _shown(target, n)), 4)


def _shown(value: float, digits: int) -> str:
    return f"{value:.{digits}g}"


@dataclass(frozen=True, repr=False)
class Solution(Result):
    """Hold all roots of every target."""

    unknown: str  #: the input that was solved for
    of: str  #: "mu_macro", or for a motion "mu_lateral"
    targets: tuple[float, ...]  #: the wanted values [-]
    #: the roots of each target, ascending; empty if it is not reachable.  A range of the unknown in
    #: which every place is a root is one root with its ``low`` and ``high``
    roots: tuple[tuple[Any, ...], ...]
    reach: Reach  #: what is reachable in the range of the search
    #: True if the unknown has no influence within the error, such as v0 without oscillation.  Then
    #: a target has one root, the whole range, or no root
    constant: bool
    _root: ClassVar[Any]

    @property
    def value(self) -> float:
        """Return the one root of the one target [SI], a phase in degrees.  Raise InputError if
        there is not exactly one root, or if every value is a root."""
        every = [root for of_target in self.roots for root in of_target]
        if len(every) == len(self.roots) == 1 and not self.constant:
            return float(every[0].value)
        if len(self.roots) != 1:
            bound = f"that of one target, and there are {len(self.roots)}: see .roots"
        elif self.constant and every:
            bound = f"that of one root: {self.reason()}"
        elif every:
            values = ", ".join(f"{root.value:.6g}" for root in every)
            bound = f"that of one root, and there are {len(every)}, {values}: see .roots"
        else:
            bound = f"that of a root, and there is none: {self.reason()}"
        raise InputError("value", None, bound)

    @property
    def unit(self) -> str:
        """Return the unit of the unknown: SI; degrees for a phase."""
        return unit_of(self.unknown)

    def reason(self, index: int = 0) -> str:
        """Return why a target has no root, or over which range every value is a root.  Return an
        empty text if it has only single roots."""
        reach, unknown = self.reach, self.unknown
        where = f"any {unknown}"  # beyond this limit is the end of double range
        if reach.high < NO_LIMIT:
            where = f"{unknown} from {reach.low:.6g} to {reach.high:.6g} {self.unit}"
        if self.constant:
            return f"{unknown} has no influence here: {self.of} is {reach.mu_min:.6g} for {where}"
        roots = self.roots[index]
        if roots:
            ranges = [
                f"from {root.low:.6g} to {root.high:.6g} {self.unit}"
                for root in roots
                if self._is_range(root)
            ]
            if not ranges:
                return ""
            mean = f"{self.of} = {self.targets[index]:.6g}"
            return f"{mean} within its error for every {unknown} {' and '.join(ranges)}"
        target, means = reach.beside(self.targets[index])
        return f"{self.of} = {target} is out of reach: {where} gives {means}"

    def _is_range(self, root: Any) -> bool:
        """Return whether a root is so wide that it is a range."""
        scale = _DEGREES if self.unit == "deg" else abs(root.value)
        return bool(root.high - root.low > _WIDE * scale)

    def _members(self) -> dict[str, Any]:
        return {"unknown": self.unknown, "unit": self.unit, **self._answers()}

    def _answers(self) -> dict[str, Any]:
        """Return the roots, the range of the search, and the reachable values."""
        reach = self.reach
        return {
            "results": self._results(),
            "range": [reach.low, None if reach.high > NO_LIMIT else reach.high],
            "reachable": {
                "min": reach.mu_min,
                "max": reach.mu_max,
                "min_included": reach.min_included,
                "max_included": reach.max_included,
            },
        }

    def _results(self) -> list[dict[str, Any]]:
        """Return the targets with their roots and remarks."""
        return [
            {
                "target": target,
                "roots": [root._asdict() for root in of_target],
                **({"reason": reason} if (reason := self.reason(i)) else {}),
            }
            for i, (target, of_target) in enumerate(zip(self.targets, self.roots, strict=True))
        ]

    @property
    def columns(self) -> dict[str, Any]:
        """Return the roots as a table, one row for each root: the target, and the values of the
        root."""
        rows = [
            (target, *root)
            for target, of_target in zip(self.targets, self.roots, strict=True)
            for root in of_target
        ]
        names = ("target", *self._root._fields)
        return {name: np.array([row[i] for row in rows]) for i, name in enumerate(names)}

    def _heading(self) -> str:
        name, unit, one = type(self).__name__, self.unit, self._one_root()
        if one is not None:
            value = f"{one.value:.6g} {unit}".rstrip(" -")
            return f"<{name} {self.unknown}: {value}>"
        roots = sum(map(len, self.roots))
        counts = f"{_counted(len(self.targets), 'target')}, {_counted(roots, 'root')}"
        return f"<{name} for {self.unknown} [{unit}], {self.of}: {counts}>"

    def _one_root(self) -> Any:
        """Return the root of the only target, if it has one root that is not a range."""
        every = [root for roots in self.roots for root in roots]
        alone = len(every) == len(self.targets) == 1 and not self.reason()
        return every[0] if alone else None

    def _rows(self) -> Rows | None:
        return None if self._one_root() is None else []

    def _in_full(self) -> tuple[str, Rows | None, list[str]]:
        return self._heading(), None, self._below()

    def _shown(self) -> dict[str, Any]:
        return self.columns if any(self.roots) else {}

    def _below(self) -> list[str]:
        reasons = dict.fromkeys(filter(None, map(self.reason, range(len(self.targets)))))
        return [*reasons][:4]


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"

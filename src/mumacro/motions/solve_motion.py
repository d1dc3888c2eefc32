"""Solve the inverse problem for any periodic motion: find which values of one input give a wanted
mean force.

A mean force over one input of a motion may rise and fall several times.
:mod:`mumacro.questions.search` finds the roots.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mumacro import plotting
from mumacro.errors import InputError
from mumacro.inputs.case import read_one
from mumacro.inputs.cases import real
from mumacro.inputs.columns import to_si
from mumacro.inputs.fields import RAD_PER_CYCLE, Numbers
from mumacro.inputs.names import unknown_name
from mumacro.inputs.units import quantity_of, unit_of
from mumacro.kernel.arrays import Array
from mumacro.motions.motion import PARTS, motion
from mumacro.motions.oscillation import MEMBERS, read_oscillation
from mumacro.questions.search import Root, Search
from mumacro.questions.solutions import Reach, Solution

#: inputs of a motion that may be unknown
INPUTS = ("v0", "k", "Fz", "f", "omega", "mu0")
UNKNOWNS = (*INPUTS, *(f"{part}.{member}" for part in PARTS for member in MEMBERS[1:]))
#: possible targets: mean forces, which have an estimate of their error
OF = ("mu_macro", "mu_lateral")
FIRST = 49  # number of first samples in the whole range
_DRAWN = 200  # additional points of a curve in a picture
_DECADES = 20.0  # a range whose ends differ by more than this factor is searched in logarithms


@dataclass(frozen=True, repr=False)
class MotionSolution(Solution):
    """Hold all roots of every target, over a motion."""

    _root = Root
    #: for v0 without a root: the solution for the opposite x (turned by 180 degrees), which moves
    #: the body the other way; None if that has no root either
    other_way: "MotionSolution | None"
    #: samples of the unknown and of the mean force
    samples: tuple[Array, Array] = field(compare=False)
    case: Mapping[str, Any] = field(compare=False)  #: the motion, without the unknown

    def reason(self, index: int = 0) -> str:
        """Return why a target has no root, and whether the body moves the other way; or over which
        range every value is a root.  Return an empty text if it has only single roots."""
        text = super().reason(index)
        if self.other_way is not None and self.other_way.roots[index]:
            speed = self.other_way.roots[index][0].value
            text += (
                f"; with the phase of x turned by 180 degrees the body moves the other way, at "
                f"{speed:.4g} m/s"
            )
        return text

    def plot(self, ax: Any = None) -> Any:
        """Draw the mean force over the unknown with the targets and their roots.  ``ax`` are
        matplotlib axes, or None for new ones.  They are returned."""
        x, _ = self.samples
        each = zip(self.targets, self.roots, strict=True)
        roots_of = {target: [root.value for root in roots] for target, roots in each}
        even = np.geomspace if _log(x[0], x[-1]) else np.linspace
        x = np.unique([*x, *even(x[0], x[-1], _DRAWN)])
        mean, _ = MotionCurve(self.unknown, self.of, self.case).evaluate(x)
        case = {name: value for name, value in self.case.items() if name in INPUTS}
        title = plotting.case_title(case, {"contact": self.case.get("contact", "spring")})
        terms = {
            part: [(n, float(a), float(p)) for n, a, p in read_oscillation(part, value)]
            for part, value in ((part, self.case.get(part, 0.0)) for part in PARTS)
            if not self.unknown.startswith(part)
        }
        return plotting.plot_law(
            self.unknown,
            x,
            mean,
            ax,
            of=self.of,
            roots_of=roots_of,
            title=f"{title}\n{plotting.motion_words(terms)}",
        )

    def _members(self) -> dict[str, Any]:
        other = self.other_way
        opposite = {} if other is None else {"other_way": other._results()}
        named = {"unknown": self.unknown, "unit": self.unit, "of": self.of}
        return {**named, **self._answers(), **opposite}


@np.errstate(all="ignore")
def solve_motion(
    unknown: str,
    target: Numbers = 0.0,
    of: str = "mu_macro",
    within: tuple[Any, Any] | None = None,
    **case: Any,
) -> MotionSolution:
    """Return every value of one input of a motion at which a mean force is ``target``.

    Parameters
    ----------
    unknown : str
        v0, k, Fz, f, omega, mu0; or amplitude or phase of a part with one harmonic: "x.amplitude",
        "x.phase", "y.amplitude", "y.phase", "normal.amplitude", "normal.phase".
    target : array_like
        Wanted value [-], shape (n,) or a scalar.  At 0 the motion transports the body without a
        drive; then the root of v0 is the transport speed.
    of : str
        "mu_macro", the mean force along the drag over the mean load, or "mu_lateral", across it.
    within : (float, float), optional
        Range to search, in SI (a phase in degrees), or texts with units.  Default: all phases; a
        speed up to ten times the fastest speed of the oscillation; another input over the decades
        in which it matters.
    **case
        One case as in :func:`mumacro.motion`, without the unknown.

    Returns
    -------
    MotionSolution
        All roots, ascending.  If there is no root: the range that is reachable, and for v0 the
        solution that moves the other way.

    Raises
    ------
    InputError
        If the unknown is not an input of a motion, or is given; if an input is missing or is not
        one number.

    Examples
    --------
    The transport speed of a conveyor whose load follows its way by a quarter of a period:

    >>> case = dict(mu0=0.3, Fz=10.0, k=1e5, f=50.0, x=1e-4, normal=(8.0, -90.0))
    >>> solution = solve_motion("v0", target=0.0, **case)
    >>> f"{solution.value * 1e3:.2f} mm/s"
    '11.44 mm/s'
    """
    if unknown not in UNKNOWNS:
        raise InputError("unknown", unknown, unknown_name(str(unknown), UNKNOWNS))
    if of not in OF:
        raise InputError("of", of, f"one of {', '.join(OF)}")
    targets = np.atleast_1d(real("target", target)).astype(np.float64)
    if targets.ndim != 1 or not np.isfinite(targets).all():
        raise InputError("target", target, "finite numbers, one or a list")
    curve = MotionCurve(unknown, of, case)
    low, high = _range(within, unknown, curve)
    solution = _solved(curve, low, high, targets)
    if unknown != "v0" or any(solution.roots) or not {"x", "normal"} <= case.keys():
        return solution
    opposite = _solved(curve.opposite(), low, high, targets)
    return replace(solution, other_way=opposite if any(opposite.roots) else None)


def _solved(curve: "MotionCurve", low: float, high: float, targets: Array) -> MotionSolution:
    """Return all roots in a range, without the solution of the other direction."""
    search = Search(curve, _places(curve, low, high), low, high, targets)
    samples = search.samples
    if samples.x.size < 4:
        curve.evaluate(np.asarray(0.5 * (low + high)))  # raises the reason
        raise InputError("within", (low, high), "a range in which the motion is possible")
    found = search.roots()
    if curve.unknown.endswith(".phase") and high - low == 360.0:  # the end is the beginning
        found = [
            roots[:-1] if len(roots) > 1 and roots[-1].high - 360.0 >= roots[0].low else roots
            for roots in found
        ]
    return MotionSolution(
        unknown=curve.unknown,
        of=curve.of,
        targets=tuple(targets.tolist()),
        roots=tuple(map(tuple, found)),
        reach=Reach(low, high, *search.extremes),
        constant=search.constant,
        other_way=None,
        samples=(samples.x, samples.value),
        case=curve.case,
    )


def _places(curve: "MotionCurve", low: float, high: float) -> Array:
    """Return the first samples of a range."""
    if curve.unknown == "v0" and low == 0.0:
        # at a speed of 0 there may be several cycles: the search begins at the smallest speed above
        # 0
        slow = np.geomspace(1e-6 * high, 1e-2 * high, FIRST // 3)
        return np.concatenate([slow, np.linspace(1e-2 * high, high, FIRST)[1:]])
    return (np.geomspace if _log(low, high) else np.linspace)(low, high, FIRST)


# --- the curve ------------------------------------------------------------------------------------


class MotionCurve:
    """Evaluate a mean force over the unknown of one motion."""

    costly = True

    def __init__(self, unknown: str, of: str, case: Mapping[str, Any]) -> None:
        self.unknown, self.of, self.case = unknown, of, dict(case)
        part, _, member = unknown.partition(".")
        self._part, self._member = part, member
        if member:
            oscillation = read_oscillation(part, case.get(part, 0.0))
            if len(oscillation) > 1:
                bound = f"of one harmonic where {unknown} is the unknown"
                raise InputError(part, case[part], bound)
            self._term = dict(zip(MEMBERS, oscillation[0], strict=True))
            if member == "phase" and not np.any(self._term["amplitude"]):
                bound = f"an amplitude > 0, whose {unknown} is unknown"
                raise InputError(part, case.get(part), bound)
        elif case.get(unknown) is not None:
            raise InputError(unknown, case[unknown], "left out: it is the unknown")
        partner = {"f": "omega", "omega": "f"}.get(unknown)
        if partner and case.get(partner) is not None:
            raise InputError(partner, case[partner], f"left out: {unknown} is the unknown")
        for name in INPUTS:
            if case.get(name) is not None:
                self.case[name] = self.number(name)

    def opposite(self) -> "MotionCurve":
        """Return the same motion with x shifted by half a period: it moves the body the other
        way."""
        terms = read_oscillation("x", self.case["x"])
        opposite = [(order, amplitude, phase + 180.0) for order, amplitude, phase in terms]
        return MotionCurve(self.unknown, self.of, {**self.case, "x": opposite})

    def evaluate(self, values: Array) -> tuple[Array, Array]:
        """Return the mean force and its error estimate, in the shape of the values; NaN where the
        motion does not exist."""
        replaced: dict[str, Any] = {self.unknown: values}
        if self._member:
            replaced = {self._part: {**self._term, self._member: values}}
        answer = motion(**{**self.case, **replaced})
        mean, error = (
            np.asarray(x, float) for x in (getattr(answer, self.of), answer.error_estimate)
        )
        return np.broadcast_to(mean, values.shape), np.broadcast_to(error, values.shape)

    def number(self, name: str) -> float:
        """Return one known input of the case [SI]."""
        value = self.case.get(name)
        if value is None:
            raise InputError(name, None, f"given [{unit_of(name)}]")
        one = np.asarray(to_si(name, value))
        if one.size != 1:
            raise InputError(name, value, "one number: a search has one motion")
        return float(one.ravel()[0])

    def swing(self) -> float:
        """Return the largest displacement of the oscillations in x and y [m]; a harmonic counts as
        often as it turns in a period."""
        total = 0.0
        for part in ("x", "y"):
            if part != self._part or not self._member:
                for order, amplitude, _ in read_oscillation(part, self.case.get(part, 0.0)):
                    total += order * float(np.max(np.abs(amplitude)))
        return total


def _range(within: Any, unknown: str, curve: MotionCurve) -> tuple[float, float]:
    """Return the range of the search, ascending."""
    if within is None:
        return _usual_range(unknown, curve)
    part, _, member = unknown.partition(".")
    quantity = quantity_of(unknown)
    name = part if member else unknown
    try:
        low, high = (read_one(name, end, quantity) for end in within)
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError("within", within, "two values, low and high") from error
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise InputError("within", (low, high), "two finite values, ascending")
    if low < 0.0 and member != "phase":
        raise InputError("within", (low, high), ">= 0")
    return low, high


def _usual_range(unknown: str, curve: MotionCurve) -> tuple[float, float]:
    """Return the range in which the unknown matters."""
    member = unknown.partition(".")[2]
    if member == "phase":
        return 0.0, 360.0
    if unknown == "normal.amplitude":
        return 0.0, 0.999 * curve.number("Fz")
    if unknown == "mu0":
        return 1e-3, 10.0
    if unknown == "v0":
        swing = curve.swing()
        if swing == 0.0:
            raise InputError(
                "x", curve.case.get("x"), "an oscillation in x or y, or within=(low, high)"
            )
        has_omega = curve.case.get("omega") is not None
        omega = curve.number("omega") if has_omega else RAD_PER_CYCLE * curve.number("f")
        return 0.0, 10.0 * swing * omega
    if member:  # an amplitude, in units of mu0 Fz / k
        length = curve.number("mu0") * curve.number("Fz") / curve.number("k")
        return 1e-3 * length, 1e3 * length
    swing = curve.swing()
    if unknown in ("f", "omega"):
        drag = curve.number("v0")
        if drag == 0.0 or swing == 0.0:
            raise InputError(
                unknown, None, "searched within=(low, high), where v0 or x and y are 0"
            )
        middle = drag / swing  # the amplitude at which the oscillation is as fast as the drag
        low, high = 1e-2 * middle, 1e4 * middle
        return (low, high) if unknown == "omega" else (low / RAD_PER_CYCLE, high / RAD_PER_CYCLE)
    if swing == 0.0:
        raise InputError(unknown, None, "searched within=(low, high), where x and y are 0")
    if unknown == "k":  # the oscillation is 1e-3 to 1e3 times mu0 Fz / k
        middle = curve.number("mu0") * curve.number("Fz") / swing
    else:
        middle = curve.number("k") * swing / curve.number("mu0")
    return 1e-3 * middle, 1e3 * middle


def _log(low: float, high: float) -> bool:
    """Return whether a range is searched and drawn in logarithms."""
    return low > 0.0 and high / low > _DECADES

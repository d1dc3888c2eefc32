"""The inverse problem over any periodic motion: which values of one input give a mean force.

A mean force over one input of a motion may rise and fall several times, so the curve is sampled
until every part of it is decided: an interval is halved as long as its middle differs from a cubic
through its neighbours by so much that the target could be crossed in it.  Each change of sign is
then narrowed by the method of Illinois; where the curve comes near the target without crossing it,
the nearest place is looked for, since two roots may lie there.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from mumacro import plotting
from mumacro.errors import InputError
from mumacro.inputs.cases import real
from mumacro.inputs.fields import QUANTITY_OF, RAD_PER_CYCLE, unit_of
from mumacro.inputs.names import unknown_name
from mumacro.inputs.oscillation import read_oscillation
from mumacro.inputs.reading import read, read_one
from mumacro.inputs.signature import Numbers
from mumacro.kernel.arrays import Array, Bools
from mumacro.motions.motion import PARTS, motion
from mumacro.questions import solutions as tables
from mumacro.results import Result, Rows

#: inputs of a motion that may be unknown
INPUTS = ("v0", "k", "Fz", "f", "omega", "mu0")
MEMBERS = ("amplitude", "phase")
UNKNOWNS = (*INPUTS, *(f"{part}.{member}" for part in PARTS for member in MEMBERS))
#: what may be the target: mean forces, which have an estimate of their error
OF = ("mu_macro", "mu_lateral")
FIRST, LEVELS = 49, 7  # samples of the whole range, and how often an interval is halved
# An interval is not searched if the target is away by this many times the difference between a
# sample and the cubic through its neighbours.  Found with 1,000 random problems
# (benchmarks/solve_motion.py): with 1 a root was missed.
_CLEAR = 4.0
_NARROW = 1e-12  # share of the range in which a bracket counts as one place
_MOST_STEPS = 80
_DRAWN = 200  # more places of a curve that is drawn
_DECADES = 20.0  # a range whose ends are further apart than this factor is searched in logarithms


class MotionRoot(NamedTuple):
    """One value of the unknown."""

    value: float  #: the unknown [SI], a phase in degrees
    #: between them the mean force is within its error estimate of the target, to first order
    low: float
    high: float
    mean: float  #: the mean force over the mean load there [-]
    error_estimate: float  #: of it [-]


class MotionReach(NamedTuple):
    """Which mean forces the searched range has."""

    low: float  #: the range of the unknown [SI], of a phase in degrees
    high: float
    least: float  #: smallest and largest mean force in it [-], of the samples
    most: float


@dataclass(frozen=True, repr=False)
class MotionSolution(Result):
    """All roots of every target."""

    unknown: str
    of: str  #: "mu_macro" or "mu_lateral"
    targets: tuple[float, ...]
    roots: tuple[tuple[MotionRoot, ...], ...]  #: of each target, ascending
    reach: MotionReach
    #: for v0 without a root: the solution with x turned by 180 degrees, which moves the body the
    #: other way; None where that has no root either
    other_way: "MotionSolution | None"
    samples: tuple[Array, Array] = field(compare=False)  #: of the unknown and the mean force
    case: Mapping[str, Any] = field(compare=False)  #: the motion, without the unknown

    @property
    def value(self) -> float:
        """The one root of the one target [SI], a phase in degrees; InputError where there are none
        or several."""
        return tables.one_value(self.roots, self.reason)

    @property
    def unit(self) -> str:
        """The unit of the unknown."""
        return unit_of_unknown(self.unknown)

    def reason(self, index: int = 0) -> str:
        """Why a target has no root; empty where it has one."""
        if self.roots[index]:
            return ""
        reach, target = self.reach, self.targets[index]
        text = (
            f"{self.of} = {target:.6g} is out of reach: {self.unknown} from {reach.low:.4g} to "
            f"{reach.high:.4g} {self.unit} gives {reach.least:.4g} to {reach.most:.4g}"
        )
        if self.other_way is not None and self.other_way.roots[index]:
            speed = self.other_way.roots[index][0].value
            text += (
                f"; with the phase of x turned by 180 degrees the body moves the other way, at "
                f"{speed:.4g} m/s"
            )
        return text

    def plot(self, ax: Any = None) -> Any:
        """The mean force over the unknown with the targets and their roots, on axes ``ax`` of
        matplotlib, or new ones, which are returned."""
        x, _ = self.samples
        places = [root.value for roots in self.roots for root in roots]
        even = np.geomspace if _log(x[0], x[-1]) else np.linspace
        x = np.unique(np.clip([*x, *even(x[0], x[-1], _DRAWN), *places], x[0], x[-1]))
        mean, _ = Curve(self.unknown, self.of, self.case).at(x)
        case = {name: value for name, value in self.case.items() if name in INPUTS}
        title = plotting.in_words(case, {"contact": self.case.get("contact", "spring")})
        axis, log = _axis(self.unknown), _log(x[0], x[-1])
        return plotting.plot_roots(
            axis,
            x,
            mean,
            self.of,
            self.targets,
            places,
            log,
            ax,
            f"{title}\n{self._motion_words()}",
        )

    def _motion_words(self) -> str:
        """The oscillations, without the unknown part."""
        words = []
        for part, symbol, unit in (("x", "$x$", "m"), ("y", "$y$", "m"), ("normal", "$F_z$", "N")):
            terms = read_oscillation(part, self.case.get(part, 0.0))
            shown = [(n, float(a), float(p)) for n, a, p in terms if np.any(a)]
            if not self.unknown.startswith(part):
                words.append(plotting.oscillation_words(symbol, unit, shown))
        return "; ".join(filter(None, words))

    def _members(self) -> dict[str, Any]:
        reach, other = self.reach, self.other_way
        members: dict[str, Any] = {
            "unknown": self.unknown,
            "unit": self.unit,
            "of": self.of,
            "results": tables.results_of(self.targets, self.roots, self.reason),
            "range": [reach.low, reach.high],
            "reachable": {
                "min": reach.least,
                "max": reach.most,
                "min_included": True,
                "max_included": True,
            },
        }
        if other is not None:
            members["other_way"] = tables.results_of(other.targets, other.roots, other.reason)
        return members

    @property
    def columns(self) -> dict[str, Any]:
        """The roots as a table: target, value, low, high, mean, error_estimate; one row a root."""
        return tables.columns_of(MotionRoot, self.targets, self.roots)

    def _heading(self) -> str:
        unit, one = self.unit, self._one_root()
        if one is not None:
            value = f"{one.value:.6g} {unit}".rstrip(" -")
            return f"<MotionSolution {self.unknown}: {value}>"
        counts = tables.counts(self.roots)
        return f"<MotionSolution for {self.unknown} [{unit}], {self.of}: {counts}>"

    def _one_root(self) -> MotionRoot | None:
        """The root of the only target, where it has one."""
        every = [root for roots in self.roots for root in roots]
        return every[0] if len(every) == len(self.targets) == 1 else None

    def _shown(self) -> dict[str, Any]:
        return self.columns if any(self.roots) else {}

    def _rows(self) -> Rows | None:
        return None if self._one_root() is None else []

    def _below(self) -> list[str]:
        return [*filter(None, map(self.reason, range(len(self.targets))))][:4]

    def _in_full(self) -> tuple[str, Rows | None, list[str]]:
        return self._heading(), None, self._below()


def unit_of_unknown(unknown: str) -> str:
    """The unit of an unknown of a motion: SI, a phase in degrees.

    >>> [unit_of_unknown(name) for name in ("v0", "x.amplitude", "normal.amplitude", "y.phase")]
    ['m/s', 'm', 'N', 'deg']
    """
    part, _, member = unknown.partition(".")
    if member == "phase":
        return "deg"
    return ("N" if part == "normal" else "m") if member else unit_of(part)


def quantity_of_unknown(unknown: str) -> str:
    """What an unknown of a motion measures.

    >>> [quantity_of_unknown(name) for name in ("v0", "normal.amplitude", "y.phase")]
    ['speed', 'force', 'angle']
    """
    part, _, member = unknown.partition(".")
    return "angle" if member == "phase" else QUANTITY_OF[part]


@np.errstate(all="ignore")
def solve_motion(
    unknown: str,
    target: Numbers = 0.0,
    of: str = "mu_macro",
    within: tuple[Any, Any] | None = None,
    **case: Any,
) -> MotionSolution:
    """Every value of one input of a motion at which a mean force is ``target``.

    Parameters
    ----------
    unknown : str
        v0, k, Fz, f, omega, mu0; or amplitude or phase of a part with one harmonic: "x.amplitude",
        "x.phase", "y.amplitude", "y.phase", "normal.amplitude", "normal.phase".
    target : array_like
        Wanted value [-], shape (n,) or a scalar; 0 is the speed at which the motion carries itself.
    of : str
        "mu_macro", the mean force along the drag over the mean load, or "mu_lateral", across it.
    within : (float, float), optional
        Range to search, in SI (a phase in degrees), or texts with units.  Left out: all phases; a
        speed up to ten times the fastest of the oscillation; another input over the decades in
        which it matters.
    **case
        As in :func:`mumacro.motion`, one case, without the unknown.

    Returns
    -------
    MotionSolution
        All roots, ascending; where there is none, the range that is reachable, and for v0 the
        solution that moves the other way.

    Raises
    ------
    InputError
        An unknown that a motion does not have, or that is given; an input that is missing or not
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
    curve = Curve(unknown, of, case)
    low, high = _range(within, unknown, curve)
    solution = _solved(curve, low, high, targets)
    if unknown != "v0" or any(solution.roots) or not {"x", "normal"} <= case.keys():
        return solution
    opposite = _solved(curve.opposite(), low, high, targets)
    return replace(solution, other_way=opposite if any(opposite.roots) else None)


def _solved(curve: "Curve", low: float, high: float, targets: Array) -> MotionSolution:
    """All roots in a range, without a look at the other way."""
    scan = _Scan(curve, low, high, targets)
    return MotionSolution(
        unknown=curve.unknown,
        of=curve.of,
        targets=tuple(targets.tolist()),
        roots=scan.roots(targets),
        reach=MotionReach(low, high, float(scan.mean.min()), float(scan.mean.max())),
        other_way=None,
        samples=(scan.x, scan.mean),
        case=curve.case,
    )


# --- the curve ------------------------------------------------------------------------------------


class Curve:
    """A mean force over the unknown of one motion."""

    def __init__(self, unknown: str, of: str, case: Mapping[str, Any]) -> None:
        self.unknown, self.of, self.case = unknown, of, dict(case)
        part, _, member = unknown.partition(".")
        if member:
            oscillation = read_oscillation(part, case.get(part, 0.0))
            if len(oscillation) > 1:
                bound = f"of one harmonic where {unknown} is the unknown"
                raise InputError(part, case[part], bound)
            self._harmonic, self._amplitude, self._phase = oscillation[0]
            if member == "phase" and not np.any(self._amplitude):
                raise InputError(
                    part, case.get(part), f"an amplitude > 0, whose {unknown} is unknown"
                )
        elif case.get(unknown) is not None:
            raise InputError(unknown, case[unknown], "left out: it is the unknown")
        partner = {"f": "omega", "omega": "f"}.get(unknown)
        if partner and case.get(partner) is not None:
            raise InputError(partner, case[partner], f"left out: {unknown} is the unknown")
        self._part, self._member = part, member
        for name in INPUTS:
            if case.get(name) is not None:
                self.case[name] = self.number(name)

    def opposite(self) -> "Curve":
        """The same motion with x turned by half a period: it moves the other way."""
        terms = read_oscillation("x", self.case["x"])
        opposite = [(order, amplitude, phase + 180.0) for order, amplitude, phase in terms]
        return Curve(self.unknown, self.of, {**self.case, "x": opposite})

    def at(self, values: Array) -> tuple[Array, Array]:
        """The mean force and the estimate of its error, (n,) both; NaN where there is no motion."""
        case = dict(self.case)
        if self._member == "amplitude":
            case[self._part] = [(self._harmonic, values, self._phase)]
        elif self._member == "phase":
            case[self._part] = [(self._harmonic, self._amplitude, values)]
        else:
            case[self.unknown] = values
        answer = motion(**case)
        shape = values.shape
        mean, error = getattr(answer, self.of), answer.error_estimate
        return np.broadcast_to(mean, shape).astype(float), np.broadcast_to(error, shape).astype(
            float
        )

    def number(self, name: str) -> float:
        """One given input of the case [SI]."""
        value = self.case.get(name)
        if value is None:
            raise InputError(name, None, f"given [{unit_of(name)}]")
        one = np.asarray(read(name, value).si)
        if one.size != 1:
            raise InputError(name, value, "one number: a search has one motion")
        return float(one.ravel()[0])

    @property
    def omega(self) -> float:
        """The angular frequency [rad/s]."""
        if self.case.get("omega") is not None:
            return self.number("omega")
        return RAD_PER_CYCLE * self.number("f")

    def swing(self) -> float:
        """The largest way of the oscillations in x and y [m], harmonics as often as they turn."""
        total = 0.0
        for part in ("x", "y"):
            if part != self._part or not self._member:
                for order, amplitude, _ in read_oscillation(part, self.case.get(part, 0.0)):
                    total += order * float(np.max(np.abs(amplitude)))
        return total


def _range(within: Any, unknown: str, curve: Curve) -> tuple[float, float]:
    """The range to search, ascending."""
    if within is None:
        return _usual_range(unknown, curve)
    part, _, member = unknown.partition(".")
    quantity = quantity_of_unknown(unknown)
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


def _usual_range(unknown: str, curve: Curve) -> tuple[float, float]:
    """Where the unknown matters."""
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
        return 0.0, 10.0 * swing * curve.omega
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
        middle = drag / swing  # where the oscillation is as fast as the drag
        low, high = 1e-2 * middle, 1e4 * middle
        return (low, high) if unknown == "omega" else (low / RAD_PER_CYCLE, high / RAD_PER_CYCLE)
    if swing == 0.0:
        raise InputError(unknown, None, "searched within=(low, high), where x and y are 0")
    if unknown == "k":  # the way of the oscillation is 1e-3 to 1e3 times mu0 Fz / k
        middle = curve.number("mu0") * curve.number("Fz") / swing
    else:
        middle = curve.number("k") * swing / curve.number("mu0")
    return 1e-3 * middle, 1e3 * middle


def _log(low: float, high: float) -> bool:
    """Whether a range is searched, and drawn, in logarithms."""
    return low > 0.0 and high / low > _DECADES


# --- the search -----------------------------------------------------------------------------------


class _Scan:
    """Samples of a curve, dense enough that every part of it is decided for every target."""

    def __init__(self, curve: Curve, low: float, high: float, targets: Array) -> None:
        self.curve, self.low, self.high = curve, low, high
        self._known: dict[tuple[float, float], tuple[Array, Array, Array]] = {}
        # a speed of 0 leaves a choice of the cycle: the search begins right beside it
        start = 1e-6 * high if curve.unknown == "v0" and low == 0.0 else low
        if curve.unknown == "v0" and low == 0.0:
            places = np.concatenate(
                [
                    np.geomspace(start, 1e-2 * high, FIRST // 3),
                    np.linspace(1e-2 * high, high, FIRST)[1:],
                ]
            )
        elif _log(low, high):
            places = np.geomspace(low, high, FIRST)
        else:
            places = np.linspace(low, high, FIRST)
        mean, error = curve.at(places)
        self._keep(places, mean, error)
        if self.x.size < 4:
            curve.at(np.asarray(0.5 * (low + high)))  # says why
            raise InputError("within", (low, high), "a range in which the motion is possible")
        open_ = np.ones(self.x.size - 1, dtype=np.bool_)
        for _ in range(LEVELS):
            open_ = self._halve(open_, targets)
            if not open_.any():
                break

    def _keep(self, x: Array, mean: Array, error: Array) -> None:
        legal = np.isfinite(mean)
        self.x, self.mean, self.error = x[legal], mean[legal], error[legal]

    def _halve(self, open_: Bools, targets: Array) -> Bools:
        """Halve the intervals that are ``open_``, (n - 1,); which of the new ones stay open."""
        i = np.flatnonzero(open_)
        middles = _between(self.x[i], self.x[i + 1])
        mean, error = self.curve.at(middles)
        off = np.abs(mean - self._cubic(i, middles))
        gaps = [np.abs(side[:, None] - targets) for side in (self.mean[i], mean, self.mean[i + 1])]
        nearest = np.min([np.min(gap, axis=1) for gap in gaps], axis=0)
        # a target is the mean force within its estimate: halves tell no more, they are one root
        errors = (self.error[i], error, self.error[i + 1])
        flat = np.any(
            np.all([gap <= e[:, None] for gap, e in zip(gaps, errors, strict=True)], axis=0), axis=1
        )
        # an interval that crosses a target is open until the curve in it is smooth
        undecided = ~(nearest > _CLEAR * off + error)
        smooth = off <= 1e-3 * np.abs(self.mean[i + 1] - self.mean[i]) + error
        crossing = np.any(
            np.sign(self.mean[i][:, None] - targets)
            != np.sign(self.mean[i + 1][:, None] - targets),
            axis=1,
        )
        monotone = _monotone(self.mean[i], mean, self.mean[i + 1])
        still = undecided & ~flat & ~(crossing & smooth & monotone)
        order = np.argsort(np.concatenate([self.x, middles]), kind="stable")
        flags = np.zeros(self.x.size + middles.size, dtype=np.bool_)  # of the interval behind each
        flags[i], flags[self.x.size :] = still, still
        columns = [
            np.concatenate(pair)[order]
            for pair in ((self.x, middles), (self.mean, mean), (self.error, error))
        ]
        flags = flags[order]
        legal = np.isfinite(columns[1])
        self._keep(*columns)
        return np.asarray(flags[legal][:-1])

    def _cubic(self, i: Any, at: Array) -> Array:
        """Cubics through four neighbouring samples each, at places within their middle interval."""
        first = np.clip(i - 1, 0, self.x.size - 4)
        x = np.stack([self.x[first + j] for j in range(4)])
        y = np.stack([self.mean[first + j] for j in range(4)])
        out = np.zeros(at.size)
        for j in range(4):
            factor = np.ones(at.size)
            for m in range(4):
                if m != j:
                    factor *= (at - x[m]) / (x[j] - x[m])
            out += y[j] * factor
        return out

    def roots(self, targets: Array) -> tuple[tuple[MotionRoot, ...], ...]:
        """All roots of every target, ascending."""
        brackets: list[_Bracket] = []
        exact: list[tuple[int, float]] = []  # target, place
        for k, target in enumerate(targets.tolist()):
            gap = self.mean - target
            brackets += [
                _Bracket(k, self.x[j], self.x[j + 1], gap[j], gap[j + 1])
                for j in np.flatnonzero(np.sign(gap[:-1]) * np.sign(gap[1:]) < 0.0)
            ]
            exact += [(k, float(self.x[j])) for j in np.flatnonzero(gap == 0.0)]
            flat = np.abs(gap) <= self.error
            inner = flat[:-2] & flat[1:-1] & flat[2:]
            # the samples of a range that is one root: within it there is nothing to look for
            exact += [(k, float(self.x[j])) for j in np.flatnonzero(_spread(inner))]
            for i in self._near(gap):
                if inner[i - 1]:
                    continue
                inside, touching = self._touched(i, gap, k, target)
                brackets += inside
                exact += [(k, place) for place in touching]
        exact += self._narrowed(brackets, targets)
        every = self._at([place for _, place in exact])
        candidates: list[list[MotionRoot]] = [[] for _ in targets]
        for (k, _), root in zip(exact, every, strict=True):
            candidates[k].append(root)
        return tuple(map(self._unique, candidates, targets.tolist()))

    def _unique(self, roots: list[MotionRoot], target: float) -> tuple[MotionRoot, ...]:
        """Roots of one target, ascending, each once.

        Roots whose widths overlap cannot be told apart and are one; so is a range in which the mean
        force is the target within its estimate, such as that of continuous sliding.
        """
        unique: list[MotionRoot] = []
        flat = np.abs(self.mean - target) <= self.error
        for root in sorted(roots):
            if unique and (root.low <= unique[-1].high or self._joined(unique[-1], root, flat)):
                last = unique[-1]
                unique[-1] = last._replace(high=max(last.high, root.high))
            else:
                unique.append(root)
        if self._is_whole_turn and len(unique) > 1 and unique[-1].high - 360.0 >= unique[0].low:
            unique.pop()  # 360 degrees are 0
        return tuple(unique)

    def _joined(self, root: MotionRoot, following: MotionRoot, flat: Bools) -> bool:
        """Whether all samples between two roots, or else those around them, are ``flat``."""
        first, end = map(int, np.searchsorted(self.x, (root.value, following.value)))
        near = slice(first, end) if first < end else slice(max(first - 1, 0), end + 1)
        return bool(flat[near].all())

    @property
    def _is_whole_turn(self) -> bool:
        return self.curve.unknown.endswith(".phase") and self.high - self.low == 360.0

    def _near(self, gap: Array) -> list[int]:
        """Inner samples nearer to the target than both neighbours, on the same side as these, and
        not too far from it for the course of the curve there."""
        size, side = np.abs(gap), np.sign(gap)
        inner = np.arange(1, gap.size - 1)
        lowest = (size[inner] <= size[inner - 1]) & (size[inner] <= size[inner + 1])
        same = (side[inner] == side[inner - 1]) & (side[inner] == side[inner + 1])
        spread = np.maximum(size[inner - 1], size[inner + 1]) - size[inner]
        within = size[inner] <= _CLEAR * spread + self.error[inner]
        return [int(i) for i in inner[lowest & same & within & (side[inner] != 0.0)]]

    def _inside(self, low: float, high: float) -> tuple[Array, Array, Array]:
        """Eight places within an interval, and the curve there, kept for other targets."""
        if (low, high) not in self._known:
            inner = np.linspace(low, high, 10)[1:-1]
            self._known[low, high] = inner, *self.curve.at(inner)
        return self._known[low, high]

    def _touched(
        self, i: int, gap: Array, k: int, target: float
    ) -> tuple[list["_Bracket"], list[float]]:
        """Near a place where the curve comes near the target: two brackets, or the place of a root
        that touches, or none."""
        low, high, side = self.x[i - 1], self.x[i + 1], math.copysign(1.0, gap[i])
        best, least = self.x[i], abs(gap[i])
        for _ in range(12):
            # the parabola through the ends and the best place says whether it can still be reached
            inner, mean, error = self._inside(float(low), float(high))
            size = side * (mean - target)
            j = int(np.nanargmin(size))
            if size[j] < least:
                best, least = inner[j], size[j]
            if least <= 0.0:
                ends = self.x[i - 1], best, self.x[i + 1]
                gaps = gap[i - 1], side * least, gap[i + 1]
                brackets = [_Bracket(k, ends[n], ends[n + 1], gaps[n], gaps[n + 1]) for n in (0, 1)]
                return brackets, []
            spread = np.nanmax(size) - np.nanmin(size)
            if least > _CLEAR * spread + error[j]:
                return [], []  # further away than what is left of its course
            step = (high - low) / 9.0
            low, high = max(best - step, self.x[i - 1]), min(best + step, self.x[i + 1])
        return [], [float(best)] if least <= self._error_at(best) else []

    def _error_at(self, x: float) -> float:
        return float(self.curve.at(np.array([x]))[1][0])

    def _narrowed(self, brackets: Sequence["_Bracket"], targets: Array) -> list[tuple[int, float]]:
        """The roots in brackets, all at once, by the method of Illinois: targets and places;
        without those at a jump."""
        if not brackets:
            return []
        k, a, b, fa, fb = (np.array(column) for column in zip(*brackets, strict=True))
        width, side, active = b - a, np.zeros(a.size, np.int8), np.arange(a.size)
        x, f, error = a.copy(), np.zeros(a.size), np.zeros(a.size)
        for step in range(_MOST_STEPS):
            ai, bi, fai, fbi = a[active], b[active], fa[active], fb[active]
            middle = 0.5 * (ai + bi)
            with np.errstate(divide="ignore", invalid="ignore"):
                new = middle if step % 4 == 3 else (fai * bi - fbi * ai) / (fai - fbi)
            new = np.where((ai < new) & (new < bi), new, middle)
            mean, error[active] = self.curve.at(new)
            x[active], f[active] = new, mean - targets[k[active]]
            fi = f[active]
            narrow = bi - ai <= _NARROW * np.maximum(np.abs(ai), np.abs(bi))
            going = ~((np.abs(fi) <= 0.1 * error[active]) | narrow)
            active, fi, new = active[going], fi[going], new[going]
            if not active.size:
                break
            left = (fi < 0.0) == (fa[active] < 0.0)
            lefts, rights = active[left], active[~left]
            fb[lefts] *= np.where(side[lefts] == -1, 0.5, 1.0)
            a[lefts], fa[lefts], side[lefts] = new[left], fi[left], -1
            fa[rights] *= np.where(side[rights] == 1, 0.5, 1.0)
            b[rights], fb[rights], side[rights] = new[~left], fi[~left], 1
        jump = (np.abs(f) > 100.0 * error) & (b - a <= _NARROW * width)
        return [
            (int(one), float(place))
            for one, place, lost in zip(k, x, jump, strict=True)
            if not lost
        ]

    def _at(self, places: Sequence[float]) -> list[MotionRoot]:
        """Roots with the width in which the mean force is within its estimate of the target."""
        x = np.array(places, np.float64)
        if not x.size:
            return []
        step = 1e-4 * np.where(x != 0.0, np.abs(x), self.high - self.low)
        left, right = np.maximum(x - step, self.x[0]), np.minimum(x + step, self.x[-1])
        mean, error = (part.reshape(3, -1) for part in self.curve.at(np.r_[left, x, right]))
        slope = np.abs(mean[2] - mean[0]) / (right - left)
        with np.errstate(divide="ignore"):
            # where the mean force hardly changes, or not at all, every place near is a root
            width = np.where(slope > 0.0, error[1] / slope, math.inf)
        low, high = np.maximum(x - width, self.low), np.minimum(x + width, self.high)
        columns = (x, low, high, mean[1], error[1])
        return [MotionRoot(*root) for root in zip(*(c.tolist() for c in columns), strict=True)]


class _Bracket(NamedTuple):
    """An interval in which the mean force crosses a target."""

    target: int  #: its place
    low: float
    high: float
    at_low: float  #: the mean force minus the target at both ends
    at_high: float


def _between(a: Array, b: Array) -> Array:
    """Middles of intervals, in logarithms where these are far from 0."""
    with np.errstate(invalid="ignore"):
        return np.where((a > 0.0) & (b > 1.5 * a), np.sqrt(np.abs(a * b)), 0.5 * (a + b))


def _spread(inner: Bools) -> Bools:
    """Places (n,) that are in a run of three or more, from the middles of every three, (n - 2,)."""
    padded = np.pad(inner, 2)
    return np.asarray(padded[:-2] | padded[1:-1] | padded[2:])


def _monotone(a: Array, middle: Array, b: Array) -> Bools:
    return np.asarray((middle - a) * (b - middle) >= 0.0)


def _axis(unknown: str) -> str:
    return f"{unknown} [{unit_of_unknown(unknown)}]"

"""Solve the inverse problem: find which values of one input give a wanted mu_macro.

mu_macro over one input behaves as follows, if the other inputs are constant and the oscillation is
across:

=====  =====================================  =====================================================
input  course                                 roots
=====  =====================================  =====================================================
v0     rises from the static limit to mu0     one; mu0 itself is not reached
y0     falls from mu0 to 0                    one; 0 is not reached, unless v0 = 0
omega  falls from mu0 to the static limit     one; the static limit is not reached
k      mu0 at k -> 0, eq. (37) at k -> inf    up to three: for r = y0 omega / v0 above 9.72 it falls
                                              to a minimum at y~ from 4.1 to 6.4, rises to a maximum
                                              (at y~ = 0.115 r^2 for large r), and falls again
Fz     the same in 1/Fz                       the same
mu0    rises: it would fold only where        one
       d ln mu~ / d ln y~ > 1 on a ray of
       constant r; it is 0.09 at the most
=====  =====================================  =====================================================

The figures are for the tightest table, one spring, and r up to 1e8; a ball behaves in the same way,
but at larger r and more weakly.  For along and normal every input has one root, and mu0 is reached
where the upper point never moves backwards, or the springs slide all the time.  There mu_macro
falls with k and rises with Fz (along), and rises with both (normal).

If k grows with the load as Fz^m, m < 1, then v~ and y~ are proportional to Fz^(m-1) (across and
along). mu_macro then passes through the same values in the same order.  It has the same number of
turning points and borders, and their distances in ln Fz are 1/(1 - m) times larger.  For m = 1 it
is constant.  For normal, mu_macro rises with Fz at constant k and with k, so it rises with Fz for
every m, up to mu0 where that is reached.

:mod:`mumacro.questions.search` finds the roots.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.case import NO_DEVIATION, read_one
from mumacro.inputs.cases import DEVIATIONS, case_around, real
from mumacro.inputs.fields import AMPLITUDE, POSITIVE, QUANTITY_OF, Numbers, field_of, kind_of
from mumacro.inputs.stiffening import stiffening_of
from mumacro.kernel.arrays import Array
from mumacro.questions.input_curve import EVERYWHERE, InputCurve
from mumacro.questions.law import DRAWN, law
from mumacro.questions.search import TINY, Search, samples
from mumacro.questions.solutions import Reach, Solution
from mumacro.results import Note
from mumacro.surrogate import Surrogate
from mumacro.validity import digits, effect_of, load_notes

HUGE = 1.7976931348623157e308

# A ray of constant r = y0 omega / v0 is searched for turning points with this many samples a
# decade.  At r = 10, three per cent above the smallest r with a fold, the fold is a sixth of a
# decade wide.  The steep part (y~ = 1 at large r) has no fold.  Where mu_macro is monotone, samples
# only bracket roots.
_PER_DECADE, _PER_DECADE_MONOTONE = 100, 2
# Direction -> y~ (for normal: v~/z) of a contact so soft, and so stiff, that more makes no
# difference.  Across, mu~ = 1 - O(y~^2); along, 1 - O(y~).  Reverse slip may begin at y~ = 3/c^3,
# where the angle c = arccos(v~/y~) is 1e-8 or more.
_ENDS = {"across": (1e-6, 1e8), "along": (1e-17, 1e30), "normal": (1e-17, 10.0)}


class TableRoot(NamedTuple):
    """Hold one value of the unknown."""

    value: float  #: the unknown [SI]
    #: between them mu_macro differs from the target by less than the error bound, so any of these
    #: values may be the true root [SI]
    low: float
    high: float
    mu_macro: float  #: the surrogate's value there [-]
    regime: str  #: one of :data:`mumacro.REGIMES`


@dataclass(frozen=True, repr=False)
class TableSolution(Solution):
    """Hold all roots of every target, found with a table."""

    _root = TableRoot
    curve: InputCurve = field(compare=False)  #: what was searched; k is the middle of its interval
    #: the words of the question: contact, direction, the other five inputs
    question: dict[str, Any] = field(compare=False)
    #: the range that the caller asked for [SI]; None for the default range
    within: tuple[float, float] | None = field(compare=False)
    #: with an interval of k: the solutions for its lowest and its highest value; the other fields
    #: are for its geometric middle
    ends: tuple["TableSolution", "TableSolution"] | None = None

    def _members(self) -> dict[str, Any]:
        """Return the members of every solution; ``ends`` has the answers for the softest and the
        stiffest contact of an interval of k."""
        ends = {"ends": [end._answers() for end in self.ends]} if self.ends else {}
        model = {"model": [note.as_row for note in self.notes]} if self.notes else {}
        return {**super()._members(), **ends, **model}

    @property
    def digits(self) -> int:
        """Return the number of digits that the uncertainty of k supports, at the first root."""
        first = next((root for roots in self.roots for root in roots), None)
        if first is None:
            return digits(0.0)
        return digits(effect_of(self.curve.answer(field_of(self.unknown)[1] * first.value)))

    @property
    def notes(self) -> list[Note]:
        """Return the notes about k, if Fz is the unknown."""
        curve = self.curve
        return load_notes(self.unknown, curve.case, curve.kind.names["contact"], curve.stiffening)

    def plot(self, ax: Any = None) -> Any:
        """Draw the law over the unknown with the targets and their roots.  Draw it over the range
        that was asked for, or over a decade around the roots.  For an interval of k also draw its
        band, and the roots at its ends.

        ``ax`` are matplotlib axes, or None for new ones.  They are returned.
        """
        roots_of: dict[float, list[float]] = {target: [] for target in self.targets}
        for one in (self, *(self.ends or ())):
            for target, roots in zip(self.targets, one.roots, strict=True):
                roots_of[target] += (root.value for root in roots)
        every = [root for roots in roots_of.values() for root in roots] or [1.0]
        low, high = self.within or _around(every)
        over = law(
            self.curve.surrogate,
            self.unknown,
            start=low,
            stop=high,
            points=DRAWN,
            scale="log" if low > 0.0 else "linear",
            **self.question,
        )
        return over.plot(ax, roots_of=roots_of)

    def _below(self) -> list[str]:
        ends = zip(("softest", "stiffest"), self.ends or (), strict=False)
        of_ends = [
            f"for the {word} contact: {root.value:.6g} {self.unit}"
            for word, end in ends
            for root in end.roots[0]
        ]
        return [*[*of_ends, *super()._below()][:4], *(note.line for note in self.notes)]


def _around(roots: Sequence[float]) -> tuple[float, float]:
    """Return a range of a decade around the roots; roots at 0 are shown in the range up to 1."""
    least, most = min(roots), max(roots)
    return 0.1 * least or 1e-6 * (most or 1.0), 10.0 * most or 1.0


@np.errstate(all="ignore")
def solve_for(
    surrogate: Surrogate,
    unknown: str,
    target: Numbers,
    *,
    within: tuple[Any, Any] | None = None,
    contact: str = "spring",
    direction: str = "across",
    stiffness_exponent: float | None = None,
    **case: Any,
) -> TableSolution:
    """Return every value of one input at which mu_macro is ``target``.

    Parameters
    ----------
    surrogate : Surrogate
    unknown : str
        One of mu0, Fz, k, y0, omega, f, v0; for direction normal Fz_amplitude instead of y0.
    target : array_like
        mu_macro [-], >= 0, shape (n,) or a scalar.
    within : (float, float), optional
        Search range [SI], or with units as in ("1um", "1mm").  Default: all values of v0, y0,
        omega, f and Fz_amplitude (below Fz); for k, Fz and mu0 the range from a contact so soft
        that softer makes no difference to one that is as good as rigid.
    contact, direction : str
        As in :meth:`mumacro.Surrogate.evaluate`.
    stiffness_exponent : float, optional
        For Fz only: m in k = k_given (Fz/Fz_given)^m, from 0 to 1, where ``Fz`` of the case is
        Fz_given: see :func:`mumacro.law`.
    **case : float
        The other five inputs [SI].  ``k`` "rigid" or infinite is a rigid contact.  ``f`` [Hz] may
        replace ``omega``; ``k_low`` and ``k_high`` may replace ``k``: see ``TableSolution.ends``.

    Raises
    ------
    InputError
        If a value is out of bounds, the unknown is given or does not exist, or the range is
        invalid.

    Examples
    --------
    >>> import mumacro
    >>> case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3, "v0": 0.01}
    >>> solution = mumacro.solve_for(mumacro.open(), "y0", target=[0.15, 0.4], **case)
    >>> [[f"{root.value:.4e} m" for root in roots] for roots in solution.roots]  # 0.4: above mu0
    [['2.8656e-06 m'], []]
    """
    kind, (name, _) = kind_of(contact, direction), field_of(unknown)
    within = None if within is None else _ends(unknown, within)
    remaining, stiffening = stiffening_of(case, name, kind, stiffness_exponent)
    for deviation in DEVIATIONS:
        if case.get(deviation) is not None:
            raise InputError(deviation, case[deviation], NO_DEVIATION)
    one, levels = case_around(remaining, unknown, kind), _levels(target)
    for input_ in one.std:
        written = "f" if input_ == "omega" and one.f is not None else input_
        raise InputError(written, case[written], NO_DEVIATION)
    fixed = {input_: float(x) for input_, x in one.columns.items() if input_ != name}
    words = {"contact": contact, "direction": direction, "stiffness_exponent": stiffness_exponent}

    def solved(**k: float) -> TableSolution:
        curve = InputCurve(surrogate, fixed | k, name, kind, stiffening)
        return _solution_over(curve, unknown, levels, within, {**words, **case})

    middle = solved()
    if one.ends is None:
        return middle
    softest, stiffest = (solved(k=float(k)) for k in one.ends)
    return replace(middle, ends=(softest, stiffest))


def _levels(target: Numbers) -> Array:
    """Return the targets, (n,).  Raise InputError if mu_macro cannot have this value."""
    levels = real("target", target).ravel()
    bad = np.flatnonzero(~(np.isfinite(levels) & (levels >= 0.0)))
    if bad.size:
        index = int(bad[0]) if np.ndim(target) else None
        raise InputError("target", float(levels[bad[0]]), "finite and >= 0", index)
    return levels


def _solution_over(
    curve: InputCurve,
    unknown: str,
    levels: Array,
    within: tuple[float, float] | None,
    question: dict[str, Any],
) -> TableSolution:
    """Return the roots of each target on a curve, in a range or in the default range, both in the
    unit of the unknown: omega of the curve may be f here."""
    per = field_of(unknown)[1]
    if within is None:
        low, high = _default_range(curve, levels)
    else:
        low, high = _checked_range(curve, per * within[0], per * within[1])
    folds = curve.unknown in ("k", "Fz") and not curve.kind.direction
    places = samples(low, high, _PER_DECADE if folds else _PER_DECADE_MONOTONE)
    search = Search(curve, np.array([low, *places, high]), low, high, levels)
    found = search.roots()
    reach = Reach(*(within or (low / per, high / per)), *search.extremes)
    if within is None and curve.unknown in EVERYWHERE and not search.constant:
        reach = _without_limit(curve, reach)
    targets = tuple(levels.tolist())
    kept = [
        [] if reach.only_approaches(target) else of_target
        for target, of_target in zip(targets, found, strict=True)
    ]
    values = np.array([root.value for of_target in kept for root in of_target])
    regimes = iter(curve.answer(values).regime.tolist() if values.size else [])
    roots = tuple(
        tuple(
            TableRoot(root.value / per, root.low / per, root.high / per, root.mean, next(regimes))
            for root in of_target
        )
        for of_target in kept
    )
    return TableSolution(
        unknown, "mu_macro", targets, roots, reach, search.constant, curve, question, within
    )


def _ends(unknown: str, within: Any) -> tuple[float, float]:
    """Return both ends of a range of the unknown, in its SI unit."""
    try:
        low, high = within
    except (TypeError, ValueError) as error:
        raise InputError("range", within, "two ascending, finite numbers") from error
    quantity = QUANTITY_OF.get(unknown, "")
    return read_one("range", low, quantity), read_one("range", high, quantity)


def _legal(curve: InputCurve) -> tuple[float, float]:
    """Return the smallest and the largest legal value of the unknown."""
    low, high = TINY if curve.unknown in POSITIVE else 0.0, HUGE
    if curve.kind.normal and curve.unknown == "Fz":
        low = math.nextafter(curve.case[AMPLITUDE], math.inf)
    return low, math.nextafter(curve.case["Fz"], 0.0) if curve.unknown == AMPLITUDE else high


def _checked_range(curve: InputCurve, low: float, high: float) -> tuple[float, float]:
    """Return a range of the unknown.  Raise InputError if it is not one of legal values."""
    least, most = _legal(curve)
    if not least <= low < high <= most:
        bound = "two ascending, finite numbers " + ("> 0" if curve.unknown in POSITIVE else ">= 0")
        if curve.kind.normal:
            bound += ", with Fz_amplitude below Fz"
        raise InputError("range", [low, high], bound)
    return low, high


def _default_range(curve: InputCurve, targets: Array) -> tuple[float, float]:
    """Return the default range: all legal values; or, for k, Fz and mu0, from a soft contact to a
    rigid one, to about 1e-12, and further if the targets need it."""
    case, unknown, (least, most) = curve.case, curve.unknown, _legal(curve)
    if unknown in EVERYWHERE:
        return least, most
    low, high = _soft_to_rigid(curve, targets, least)
    if curve.stiffening is not None:
        lightest, heaviest = curve.stiffening.range(case["k"])
        inner = max(low, lightest), min(high, heaviest)
        low, high = inner if inner[0] < inner[1] else (max(least, lightest), heaviest)
    return low, high


def _soft_to_rigid(curve: InputCurve, targets: Array, least: float) -> tuple[float, float]:
    """Return the range for k, Fz and mu0; ``least`` is the smallest legal value."""
    case, unknown = curve.case, curve.unknown
    amplitude = case[curve.kind.amplitude]
    if 0.0 in (amplitude, case["omega"]) or curve.proportional:
        return max(least, 1e-300), 1e300
    if unknown == "Fz" and curve.kind.normal:
        return least, min(1e17 * amplitude, 1e300)
    direction = curve.kind.names["direction"]
    soft, stiff = _ENDS[direction]
    if direction == "across" and case.get("k") != math.inf:
        log_r = (
            math.log(amplitude) + math.log(case["omega"]) - math.log(case["v0"])
            if case["v0"] > 0.0
            else 0.0
        )
        r = math.exp(min(log_r, 230.0))
        stiff = max(stiff, stiff * r, 1e3 * r * r)
    low, high = sorted((curve.where(soft), curve.where(stiff)))
    if unknown == "mu0":  # mu_macro grows with mu0 without limit
        positive = targets[targets > 0.0]
        low, high = (
            0.5 * float(positive.min(initial=2.0 * low)),
            2.0 * float(positive.max(initial=0.5 * high)),
        )
    return max(low, 1e-300), min(high, 1e300)


def _without_limit(curve: InputCurve, reach: Reach) -> Reach:
    """Return ``reach`` for a v0, y0 or omega that grows without limit: the last value is approached
    but usually not reached."""
    if curve.unknown == "v0":
        return replace(reach, max_included=curve.kind.direction > 0)
    if curve.unknown == AMPLITUDE:
        return reach
    vanishes = curve.unknown == "y0" or curve.case["k"] == math.inf
    # at rest mu_macro reaches its last value at y0 = l0, or at any frequency
    return replace(
        reach, mu_min=0.0 if vanishes else reach.mu_min, min_included=curve.case["v0"] == 0.0
    )

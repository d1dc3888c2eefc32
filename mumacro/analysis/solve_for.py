"""The inverse problem: which value of one input gives a wanted mu_macro; and where a sweep of it
crosses the border.

What is known of mu_macro as a function of one input, the others constant, for an oscillation
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

The figures are of the tightest table, for one spring and r up to 1e8; a ball does the same, later
and less. Along and normal every input has one root, and mu0 is reached: where the upper point never
moves backwards, or the springs slide all the time.  There mu_macro falls with k and rises with Fz
(along), and rises with both (normal).

Where k grows with the load as Fz^m, m < 1, v~ and y~ go like Fz^(m-1) (across and along): mu_macro
runs through the same values in the same order, its turning points and its border are as many, and
stand in ln Fz 1/(1 - m) times as far apart.  For m = 1 it is constant.  For normal it rises with Fz
at constant k and rises with k, so it rises with Fz for every m, up to mu0 where that is reached.

How a level is found on a monotone piece: :mod:`mumacro.analysis.rootfinding`.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mumacro.analysis.load import Stiffening, stiffening_of
from mumacro.analysis.rootfinding import TINY, Curve, Sweep, curves_between, last_double, samples
from mumacro.analysis.roots import Crossing, Reach, Root, Solution, checked_case
from mumacro.answer import Answer
from mumacro.errors import InputError
from mumacro.inputs.fields import POSITIVE
from mumacro.inputs.k_range import without_interval
from mumacro.inputs.kind import AMPLITUDE, kind_of
from mumacro.kernel.arrays import Array, Bools, Places
from mumacro.surrogate import Surrogate

EVERYWHERE = ("v0", "y0", "omega", AMPLITUDE)  # searched over all their values
HUGE = 1.7976931348623157e308

# A ray of constant r = y0 omega / v0 is searched for turning points at this many places a decade.
# At r = 10, three percent above its onset, the fold is a sixth of a decade wide; the steep descent
# (y~ = 1 at large r) holds none. Where mu_macro is monotone, samples only bracket roots, for
# Newton's method to finish.
_PER_DECADE, _PER_DECADE_MONOTONE = 100, 2
# Direction -> y~, for normal v~/z, of a contact as soft and as stiff as it matters.  Across, mu~ =
# 1 - O(y~^2), along 1 - O(y~); reverse slip may begin at y~ = 3/c^3, where the angle c =
# arccos(v~/y~) is 1e-8 or more.
_ENDS = {"across": (1e-6, 1e8), "along": (1e-17, 1e30), "normal": (1e-17, 10.0)}
# y~ where v~/v~crit(y~) is smallest on a ray: there d ln v~crit / d ln y~ = 1.  The slope falls
# strictly from 2 to 1/2 (20,001 places from 1e-6 to 1e12), so the border is crossed at most once on
# either side.
_Y_CLOSEST = 1.290791


def solve_for(
    surrogate: Surrogate,
    unknown: str,
    targets: ArrayLike,
    case: Mapping[str, Any],
    within: tuple[float, float] | None = None,
    *,
    contact: str = "spring",
    direction: str = "across",
    stiffness_exponent: float | None = None,
) -> Solution:
    """Every value of one input at which mu_macro has the wanted value.

    Parameters
    ----------
    surrogate : Surrogate
    unknown : str
        One of mu0, Fz, k, y0, omega, v0; for direction normal Fz_amplitude in place of y0.
    targets : array_like
        Wanted mu_macro [-], >= 0, shape (n,) or a scalar.
    case : mapping
        The other five inputs [SI]; ``k`` "rigid" or infinite is rigid contact; ``f`` [Hz] may stand
        for ``omega``; ``k_range``, lowest and highest stiffness, for ``k``: see
        :attr:`mumacro.analysis.roots.Solution.ends`.
    within : (float, float), optional
        Search range [SI].  Left out: everywhere for v0, y0, omega and Fz_amplitude (below Fz); for
        k, Fz and mu0 from where the contact is so soft that it does not matter to where it is as
        good as rigid.
    contact, direction : str
        As in :meth:`mumacro.Surrogate.evaluate`.
    stiffness_exponent : float, optional
        For Fz only, m in k = k_given (Fz/Fz_given)^m, from 0 to 1, where ``Fz`` of the case is
        Fz_given: see :func:`mumacro.analysis.law.friction_law`.

    Raises
    ------
    InputError
        A value out of bounds, an unknown that is given or does not exist, an invalid range.

    Examples
    --------
    >>> import mumacro
    >>> case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "omega": 1.3e5, "v0": 0.01}
    >>> found = solve_for(mumacro.open(), "y0", [0.15, 0.4], case)
    >>> [[f"{root.value:.4e} m" for root in roots] for roots in found.roots]  # 0.4 is above mu0
    [['2.8570e-06 m'], []]
    """
    kind = kind_of(contact, direction)
    case, interval = without_interval(case, unknown)
    if interval:
        softest, middle, stiffest = (
            solve_for(
                surrogate,
                unknown,
                targets,
                {**case, "k": k},
                within,
                contact=contact,
                direction=direction,
                stiffness_exponent=stiffness_exponent,
            )
            for k in (interval["k_low"], case["k"], interval["k_high"])
        )
        return replace(middle, ends=(softest, stiffest))
    case, stiffening = stiffening_of(case, unknown, kind, stiffness_exponent)
    sweep = Sweep(surrogate, checked_case(case, unknown, kind), unknown, kind, stiffening)
    wanted = np.asarray(targets, dtype=np.float64).ravel()
    bad = np.flatnonzero(~(np.isfinite(wanted) & (wanted >= 0.0)))
    if bad.size:
        raise InputError(
            "target",
            float(wanted[bad[0]]),
            "finite and >= 0",
            int(bad[0]) if np.ndim(targets) else None,
        )
    low, high = _default_range(sweep, wanted) if within is None else _checked_range(sweep, within)
    folds = unknown in ("k", "Fz") and direction == "across"
    x = samples(low, high, _PER_DECADE if folds else _PER_DECADE_MONOTONE)
    answer = sweep.answer(x)
    mu, noise = answer.mu_macro, 2.0 * answer.error_bound
    turns = _turning_points(sweep, x, mu, noise) if folds else []
    curves = curves_between(sweep, [low, *turns, high], x, mu)
    if low == 0.0 and unknown != "v0" and abs(curves[0].mu[0] - mu[0]) > 1e-9 * mu[0]:
        # mu_macro = mu0 at y0 = 0 or omega = 0 even where it is another constant for every other
        # value
        curves = [
            Curve(sweep, np.zeros(1), curves[0].mu[:1]),
            *curves_between(sweep, [TINY, high], x, mu),
        ]
    ends = np.concatenate([curve.mu[[0, -1]] for curve in curves])
    reach = Reach(low, high, float(ends.min()), float(ends.max()), True, True)
    constant = reach.mu_max - reach.mu_min <= (0.0 if unknown in EVERYWHERE else float(noise.max()))
    if within is None and unknown in EVERYWHERE and not constant:
        reach = _without_limit(sweep, reach)
    levels = tuple(wanted.tolist())
    found = _roots(sweep, [] if constant else curves, wanted)
    roots = (
        tuple(some) if reach.holds(level) else () for level, some in zip(levels, found, strict=True)
    )
    return Solution(unknown, levels, tuple(roots), reach, constant, stiffening=sweep.stiffening)


def border_crossings(
    surrogate: Surrogate,
    along: str,
    case: Mapping[str, Any],
    low: float,
    high: float,
    *,
    contact: str = "spring",
    direction: str = "across",
    stiffening: Stiffening | None = None,
) -> tuple[Crossing, ...]:
    """Where in ``low <= along <= high`` continuous sliding or (along) reverse slip begins or ends,
    ascending.

    ``case`` holds the other five inputs, of which k grows with Fz where there is a ``stiffening``.
    Of continuous sliding none, one, or (across, over mu0, Fz
    or k) two places; none for rigid contact (never any stick) and without oscillation.
    """
    kind = kind_of(contact, direction)
    sweep = Sweep(surrogate, checked_case(case, along, kind), along, kind, stiffening)
    if sweep.case.get("k") == math.inf or 0.0 in sweep.case.values() or _proportional(sweep):
        return ()
    low = max(low, TINY)  # at 0 nothing oscillates or slides
    middle = low if along in EVERYWHERE or direction != "across" else _where(sweep, _Y_CLOSEST)
    edges = np.array([low, middle, high] if low < middle < high else [low, high])
    found = []
    for regime in ("continuous", "reverse_slip"):
        state = sweep.answer(edges).regime == regime
        i = np.flatnonzero(state[1:] != state[:-1])

        def before(x: Array, regime: str = regime, states: Bools = state[i, None]) -> Bools:
            same: Bools = (sweep.answer(x).regime == regime) == states
            return same

        cuts = last_double(before, edges[i], edges[i + 1])
        found += [*zip(*(cut.tolist() for cut in cuts), strict=True)]
    below, first = np.array(sorted(set(found))).reshape(-1, 2).T
    after = sweep.answer(first)
    regimes = zip(sweep.answer(below).regime.tolist(), after.regime.tolist(), strict=True)
    return tuple(map(Crossing, first.tolist(), after.mu_macro.tolist(), regimes))


def _legal(sweep: Sweep) -> tuple[float, float]:
    """Smallest and largest legal value of the unknown."""
    low, high = TINY if sweep.unknown in POSITIVE else 0.0, HUGE
    if sweep.kind.normal and sweep.unknown == "Fz":
        low = math.nextafter(sweep.case[AMPLITUDE], math.inf)
    return low, math.nextafter(sweep.case["Fz"], 0.0) if sweep.unknown == AMPLITUDE else high


def _checked_range(sweep: Sweep, within: tuple[float, float]) -> tuple[float, float]:
    low, high = (float(end) for end in within)
    least, most = _legal(sweep)
    if not least <= low < high <= most:
        bound = "two ascending, finite numbers " + ("> 0" if sweep.unknown in POSITIVE else ">= 0")
        bound += ", with Fz_amplitude below Fz" * sweep.kind.normal
        raise InputError("range", [low, high], bound)
    return low, high


def _default_range(sweep: Sweep, targets: Array) -> tuple[float, float]:
    """Everywhere; or from a soft contact to a rigid one, to 1e-12 or so, and what the targets need
    beyond."""
    case, unknown, (least, most) = sweep.case, sweep.unknown, _legal(sweep)
    if unknown in EVERYWHERE:
        return least, most
    low, high = _soft_to_rigid(sweep, targets, least)
    if sweep.stiffening is not None:
        lightest, heaviest = sweep.stiffening.range(case["k"])
        inner = max(low, lightest), min(high, heaviest)
        low, high = inner if inner[0] < inner[1] else (max(least, lightest), heaviest)
    return low, high


def _soft_to_rigid(sweep: Sweep, targets: Array, least: float) -> tuple[float, float]:
    """The same for k, Fz and mu0, whose smallest legal value is ``least``."""
    case, unknown = sweep.case, sweep.unknown
    amplitude = case[AMPLITUDE if sweep.kind.normal else "y0"]
    if 0.0 in (amplitude, case["omega"]) or _proportional(sweep):
        return max(least, 1e-300), 1e300
    if unknown == "Fz" and sweep.kind.normal:
        return least, min(1e17 * amplitude, 1e300)
    direction = sweep.kind.names["direction"]
    soft, stiff = _ENDS[direction]
    if direction == "across" and case.get("k") != math.inf:
        log_r = (
            math.log(amplitude) + math.log(case["omega"]) - math.log(case["v0"])
            if case["v0"] > 0.0
            else 0.0
        )
        r = math.exp(min(log_r, 230.0))
        stiff = max(stiff, stiff * r, 1e3 * r * r)
    low, high = sorted((_where(sweep, soft), _where(sweep, stiff)))
    if unknown == "mu0":  # mu_macro grows with it without limit
        wanted = targets[targets > 0.0]
        low, high = (
            0.5 * float(wanted.min(initial=2.0 * low)),
            2.0 * float(wanted.max(initial=0.5 * high)),
        )
    return max(low, 1e-300), min(high, 1e300)


def _where(sweep: Sweep, place: float) -> float:
    """Value of k, Fz or mu0 at which y~, for normal v~/z, is ``place``, within double range; of a
    rigid contact any."""
    one = sweep.answer(1.0 if sweep.stiffening is None else sweep.stiffening.load)
    at_one = float(one.v_tilde / one.y_tilde if sweep.kind.normal else one.y_tilde)
    scale = 1.0 if sweep.case.get("k") == math.inf else min(max(at_one, 1e-300), 1e300)
    if sweep.stiffening is not None:
        return sweep.stiffening.place(place / scale)
    return place / scale if sweep.unknown == "k" else scale / place


def _proportional(sweep: Sweep) -> bool:
    """Whether k grows in proportion to Fz, so that Fz has no influence."""
    growth = sweep.stiffening
    return growth is not None and growth.exponent == 1.0 and not sweep.kind.normal


def _without_limit(sweep: Sweep, reach: Reach) -> Reach:
    """``reach`` as v0, y0 or omega grows without limit: the last value is approached, and in
    general not reached."""
    if sweep.unknown == "v0":
        return replace(reach, max_included=sweep.kind.direction > 0)
    if sweep.unknown == AMPLITUDE:
        return reach
    vanishes = sweep.unknown == "y0" or sweep.case["k"] == math.inf
    # at rest friction takes its last value at y0 = l0, or at any frequency
    return replace(
        reach, mu_min=0.0 if vanishes else reach.mu_min, min_included=sweep.case["v0"] == 0.0
    )


def _turning_points(sweep: Sweep, x: Array, mu: Array, noise: Array) -> list[float]:
    """Where mu_macro over k or Fz has its minimum and maximum, ascending, from samples ``x``,
    ``mu`` (n,)."""
    # along k it falls, may rise by more than the noise, and falls again
    order = 1 if sweep.unknown == "k" else -1
    falling = mu[::order]
    rise = falling - np.minimum.accumulate(falling)
    top = int(np.argmax(rise))
    if rise[top] <= noise[::order][top]:
        return []
    bottom = int(np.argmin(falling[: top + 1]))
    places = np.array([bottom, top] if order == 1 else [x.size - 1 - top, x.size - 1 - bottom])
    sign = np.array([[-1.0], [1.0]])[::order]
    inside = (places > 0) & (places < x.size - 1)
    places, sign = places[inside], sign[inside]
    _, turns = last_double(
        lambda at: ~(sign * sweep.with_slope(at)[1] < 0.0), x[places - 1], x[places + 1]
    )
    return [*map(float, turns)]


def _roots(sweep: Sweep, curves: list[Curve], targets: Array) -> list[list[Root]]:
    """All roots on all pieces, ascending."""
    found: list[list[Root]] = [[] for _ in targets]
    for curve in curves:
        which = np.flatnonzero(curve.holds(targets))
        if not which.size:
            continue
        wanted, start = targets[which], curve.x[0]
        # a target equal to the value at an edge has its root there; just inside, rounding may hide
        # it
        value = np.where(wanted == curve.mu[0], start, curve.meet(wanted))
        last = wanted == curve.mu[-1]
        if last.any():
            value = np.where(last & (sweep.mu(value) != wanted), curve.end(), value)
        answer, slope = sweep.with_slope(value)
        low, high = _enclosures(sweep, curve, wanted, value, answer, slope)
        columns = (value, low, high, answer.mu_macro, answer.regime)
        for i, root in zip(
            which.tolist(), map(Root, *(column.tolist() for column in columns)), strict=True
        ):
            if not found[i] or root.value != found[i][-1].value:
                found[i].append(root)
    return found


def _enclosures(
    sweep: Sweep, curve: Curve, wanted: Array, value: Array, answer: Answer[Any], slope: Array
) -> tuple[Array, Array]:
    """Between which values mu_macro is within its error bound of the target: ``low`` and ``high``
    of a root, (n,).

    ``answer`` and ``slope`` (d mu_macro / d ln x) are those at the root.
    """
    bound = answer.error_bound
    if not bound.all():  # at y0 = 0 mu_macro is exact, and beside it no longer
        beside = np.minimum(np.nextafter(value, HUGE), curve.x[-1])
        bound = np.maximum(bound, sweep.answer(beside).error_bound)
    # a root is found to rounding, even where mu_macro is exact
    bound = np.maximum(bound, 2.0**-50 * wanted)
    # an end may be a jump of mu_macro, at the border or a seam, with a larger bound beyond it: then
    # that one counts
    bounds, left = np.concatenate((bound, bound)), np.arange(2 * value.size)
    ends, outwards, targets = (
        np.empty(left.size),
        np.repeat([0.0, HUGE], value.size),
        np.concatenate((wanted, wanted)),
    )
    while left.size:
        ends[left] = _where_off(
            sweep, curve, left % value.size, left >= value.size, bounds[left], wanted, value, slope
        )
        beyond = sweep.answer(
            np.clip(np.nextafter(ends[left], outwards[left]), curve.x[0], curve.x[-1])
        )
        still = np.abs(beyond.mu_macro - targets[left]) < 0.97 * beyond.error_bound
        still &= beyond.error_bound > bounds[left]
        left = left[still]
        bounds[left] = beyond.error_bound[still]
    return np.minimum(ends[: value.size], value), np.maximum(ends[value.size :], value)


def _where_off(
    sweep: Sweep,
    curve: Curve,
    i: Places,
    above: Bools,
    bound: Array,
    wanted: Array,
    value: Array,
    slope: Array,
) -> Array:
    """Where, above or below the roots ``i``, mu_macro is off its target by ``bound``, each (m,)."""
    sign = np.where(above, 1.0, -1.0)
    levels = wanted[i] + sign * curve.sign * bound
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        step = bound / (curve.sign * slope[i])
        ends: Array = value[i] * np.exp(sign * step)
        straight = (ends > curve.x[0]) & (ends < curve.x[-1]) & (step > 0.0)
    # most often the curve is straight over so short a way; where it is not, the levels are searched
    # for
    tried = np.where(straight, ends, curve.x[0])
    straight &= np.abs(sweep.mu(tried) - levels) <= 0.01 * bound
    curved = np.flatnonzero(~straight)
    if curved.size:
        ends[curved] = curve.meet(levels[curved], leave=above[curved])
    return ends

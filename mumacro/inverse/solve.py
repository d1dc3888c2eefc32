"""The inverse problem: which value of one input gives a wanted mu_macro; and where a sweep of it crosses the border.

What is known of mu_macro as a function of one input, the others constant:

=====  =====================================  ====================================================================
input  course                                 roots
=====  =====================================  ====================================================================
v0     rises from the static limit to mu0     one; mu0 itself is not reached
y0     falls from mu0 to 0                    one; 0 is not reached, unless v0 = 0
omega  falls from mu0 to the static limit     one; the static limit is not reached
k      mu0 at k -> 0, eq. (37) at k -> inf    up to three: for r = y0 omega / v0 above 9.72 it falls to a minimum at y~
                                              from 4.1 to 6.4, rises to a maximum (at y~ = 0.115 r^2 for large r), and
                                              falls again
Fz     the same in 1/Fz                       the same
mu0    rises: it would fold only where        one, but searched like k and Fz
       d ln mu~ / d ln y~ > 1 on a ray of
       constant r; it is 0.09 at the most
=====  =====================================  ====================================================================

The figures are those of benchmarks/folds.py, for r up to 1e8.

How a level is found on a monotone piece: :mod:`mumacro.inverse.rootfinding`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mumacro.answer import Answer
from mumacro.errors import InputError
from mumacro.inputs import POSITIVE
from mumacro.inverse.results import Reach, Root, Solution, checked_case
from mumacro.inverse.rootfinding import TINY, Curve, Sweep
from mumacro.surrogate import Surrogate

__all__ = ["MONOTONE", "Y_CLOSEST", "scale_of", "solve_for"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

MONOTONE = ("v0", "y0", "omega")
HUGE = 1.7976931348623157e308

# A ray of constant r = y0 omega / v0 is searched for turning points at this many places a decade.  At r = 10, three
# percent above its onset, the fold is a sixth of a decade wide; the steep descent (y~ = 1 at large r) holds none.
_PER_DECADE = 100
_MAX_SAMPLES = 20_001
# Elsewhere samples only bracket roots, for Newton's method to finish: close together within so many decades of where
# mu_macro turns from one limit to the other, wide apart in the rest of the double range.
_NEAR, _NEAR_PER_DECADE, _FAR = 9, 6, 8
# y~ where v~/v~crit(y~) is smallest on a ray: there d ln v~crit / d ln y~ = 1.  The slope falls strictly from 2 to 1/2
# (20,001 places from 1e-6 to 1e12), so the border is crossed at most once on either side.
Y_CLOSEST = 1.290791


def scale_of(case: Mapping[str, float | None], unknown: str) -> float:
    """Value of ``unknown`` (k, Fz or mu0) at which y~ = 1, within double range; y0 must be > 0, k not None."""
    product = {"k": ("mu0", "Fz"), "Fz": ("y0", "k"), "mu0": ("y0", "k")}[unknown]
    divisor = {"k": "y0", "Fz": "mu0", "mu0": "Fz"}[unknown]
    a, b = (math.log(float(case[name] or 1.0)) for name in product)
    return math.exp(min(max(a + b - math.log(float(case[divisor] or 1.0)), -690.0), 690.0))


def _ratio(case: Mapping[str, float | None]) -> float:
    """r = y0 omega / v0 [-], cut to [1e-100, 1e100]."""
    y0, omega, v0 = (float(case[name] or 0.0) for name in ("y0", "omega", "v0"))
    if v0 == 0.0:
        return 1.0
    return math.exp(min(max(math.log(y0) + math.log(omega) - math.log(v0), -230.0), 230.0))


def _default_range(case: Mapping[str, float | None], unknown: str, targets: Array) -> tuple[float, float]:
    """Where mu~ goes from 1 to its limit for rigid contact, to 1e-12 or so, and what the targets need beyond that."""
    if case.get("k") is None and unknown != "k":
        scale, y_low, y_high = 1.0, 1e-6, 1e6
    else:
        r = _ratio(case)
        scale, y_low, y_high = scale_of(case, unknown), 1e-6, max(1e8, 1e8 * r, 1e3 * r * r)
    low, high = (scale * y_low, scale * y_high) if unknown == "k" else (scale / y_high, scale / y_low)
    if unknown == "mu0":  # mu_macro grows with it without limit
        wanted = targets[targets > 0.0]
        if wanted.size:
            low, high = min(low, 0.5 * float(wanted.min())), max(high, 2.0 * float(wanted.max()))
    return max(low, 1e-300), min(high, 1e300)


def _turning_points(sweep: Sweep, x: Array, mu: Array, noise: Array) -> list[float]:
    """Where mu_macro stops rising or falling by more than ``noise``, ascending, from samples ``x``, ``mu`` (n,)."""
    rise = np.sign(np.diff(mu))
    # only where the samples themselves turn; the ends close the last stretch
    places = np.unique(np.concatenate(([0], 1 + np.flatnonzero(rise[1:] != rise[:-1]), [x.size - 1])))
    found: list[tuple[int, float]] = []
    direction, top, bottom = 0.0, 0, 0
    for i, m, slack in zip(places.tolist(), mu[places].tolist(), noise[places].tolist(), strict=True):
        top = i if m > mu[top] else top
        bottom = i if m < mu[bottom] else bottom
        if direction >= 0.0 and m < mu[top] - slack:
            if direction > 0.0:
                found.append((top, 1.0))
            direction, bottom = -1.0, i
        elif direction <= 0.0 and m > mu[bottom] + slack:
            if direction < 0.0:
                found.append((bottom, -1.0))
            direction, top = 1.0, i
    return [_extremum(sweep, float(x[i - 1]), float(x[min(i + 1, x.size - 1)]), sign) for i, sign in found]


def _extremum(sweep: Sweep, low: float, high: float, sign: float) -> float:
    """Where the slope of mu_macro goes through zero between two samples: at a maximum (sign +1) or a minimum (-1)."""
    a, b = low, high
    for _ in range(5):
        grid = np.geomspace(a, b, 34)
        grid[0], grid[-1] = a, b
        _, slope = sweep.with_slope(grid[1:-1])
        # the first place from which the slope has turned; the ends stand for the directions that are known
        turned = np.append(sign * slope < 0.0, True)
        i = int(np.argmax(turned)) + 1
        a, b = float(grid[i - 1]), float(grid[i])
    return math.sqrt(a) * math.sqrt(b)


def _curves(sweep: Sweep, edges: list[float], x: Array, mu: Array) -> list[Curve]:
    """The monotone pieces between ``edges`` (ascending), from samples ``x``, ``mu`` (n,) of the whole range."""
    at = np.array(edges)
    ends = sweep.mu(at)
    curves = []
    for i in range(at.size - 1):
        two = slice(i, i + 2)
        inside = slice(np.searchsorted(x, at[i], side="right"), np.searchsorted(x, at[i + 1], side="left"))
        # next to a turning point a sample may lie beyond it by a rounding error
        between = np.clip(mu[inside], ends[two].min(), ends[two].max())
        curves.append(Curve(sweep, np.insert(at[two], 1, x[inside]), np.insert(ends[two], 1, between)))
    return curves


def _roots(sweep: Sweep, curves: list[Curve], targets: Array) -> list[list[Root]]:
    """All roots on all pieces, ascending."""
    found: list[list[Root]] = [[] for _ in targets]
    for curve in curves:
        which = np.flatnonzero(curve.holds(targets))
        if not which.size:
            continue
        wanted, start, end = targets[which], curve.x[0], curve.x[-1]
        # a target equal to the value at an edge has its root there; just inside, rounding may hide it
        value = np.where(wanted == curve.mu[0], start, curve.meet(wanted))
        last = wanted == curve.mu[-1]
        if last.any():
            value = np.where(last & (sweep.mu(value) != wanted), end, value)
        answer, slope = sweep.with_slope(value)
        low, high = _enclosures(sweep, curve, wanted, value, answer, slope)
        columns = (value, low, high, np.asarray(answer.mu_macro), np.asarray(answer.regime))
        for i, root in zip(which.tolist(), map(Root, *(column.tolist() for column in columns)), strict=True):
            if not found[i] or root.value != found[i][-1].value:
                found[i].append(root)
    return found


def _enclosures(
    sweep: Sweep, curve: Curve, wanted: Array, value: Array, answer: Answer[Any], slope: Array
) -> tuple[Array, Array]:
    """Between which values mu_macro is within its error bound of the target: ``low`` and ``high`` of a root, (n,).

    ``answer`` and ``slope`` (d mu_macro / d ln x) are those at the root.
    """
    bound = np.asarray(answer.error_bound)
    if not bound.all():  # at y0 = 0 mu_macro is exact, and beside it no longer
        beside = np.minimum(np.nextafter(value, HUGE), curve.x[-1])
        bound = np.maximum(bound, np.asarray(sweep.answer(beside).error_bound))
    levels = np.concatenate((wanted - curve.sign * bound, wanted + curve.sign * bound))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        step = bound / (curve.sign * slope)
        ends = np.concatenate((value * np.exp(-step), value * np.exp(step)))
        straight = (ends > curve.x[0]) & (ends < curve.x[-1]) & (np.concatenate((step, step)) > 0.0)
    # most often the curve is straight over so short a way; where it is not, the levels are searched for
    tried = np.where(straight, ends, curve.x[0])
    straight &= np.abs(sweep.mu(tried) - levels) <= 0.01 * np.concatenate((bound, bound))
    curved = np.flatnonzero(~straight)
    if curved.size:
        ends[curved] = curve.meet(levels[curved], leave=curved >= value.size)
    return np.minimum(ends[: value.size], value), np.maximum(ends[value.size :], value)


def solve_for(
    surrogate: Surrogate,
    unknown: str,
    targets: ArrayLike,
    case: Mapping[str, float | None],
    within: tuple[float, float] | None = None,
) -> Solution:
    """Every value of one input at which mu_macro has the wanted value.

    Parameters
    ----------
    surrogate : Surrogate
        What is solved; a root is as good as its error bound, see :class:`Root`.
    unknown : str
        One of mu0, Fz, k, y0, omega, v0.
    targets : array_like
        Wanted mu_macro [-], >= 0, shape (n,) or a scalar.
    case : mapping
        The other five inputs [SI]; ``k`` None is rigid contact; ``f`` [Hz] may stand for ``omega``.
    within : (float, float), optional
        Search range [SI].  Left out: everywhere for v0, y0, omega; for k, Fz and mu0 from where the contact is so soft
        that mu_macro = mu0 to where it is as good as rigid.

    Returns
    -------
    Solution
        All roots of every target, ascending, each with its interval from the error bound; and the reachable range.

    Raises
    ------
    InputError
        A value out of bounds, an unknown that is given or does not exist, an invalid range.

    Examples
    --------
    >>> import mumacro
    >>> case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "omega": 1.3e5, "v0": 0.01}
    >>> found = solve_for(mumacro.open(), "y0", [0.15, 0.4], case)
    >>> [[f"{root.value:.4e} m" for root in roots] for roots in found.roots]      # 0.4 is more than mu0
    [['2.8570e-06 m'], []]
    """
    known = checked_case(case, unknown)
    wanted = np.atleast_1d(np.asarray(targets, dtype=np.float64)).ravel()
    bad = ~(np.isfinite(wanted) & (wanted >= 0.0))
    if bad.any():
        i = int(np.flatnonzero(bad)[0])
        raise InputError("target", float(wanted[i]), "finite and >= 0", i if np.ndim(targets) else None)
    if within is not None:
        within = _checked_range(within, unknown)
    sweep = Sweep(surrogate, known, unknown)
    return (_solve_monotone if unknown in MONOTONE else _solve_folded)(sweep, wanted, within)


def _checked_range(within: tuple[float, float], unknown: str) -> tuple[float, float]:
    low, high = (float(end) for end in within)
    floor = low > 0.0 if unknown in POSITIVE else low >= 0.0
    if not (floor and low < high and math.isfinite(high)):
        bound = "two ascending, finite numbers " + ("> 0" if unknown in POSITIVE else ">= 0")
        raise InputError("range", [low, high], bound)
    return low, high


def _solve_monotone(sweep: Sweep, targets: Array, within: tuple[float, float] | None) -> Solution:
    low, high = within if within is not None else (0.0, HUGE)
    mu = sweep.mu(np.array([low, max(low, TINY), high]))
    # mu_macro = mu0 at y0 = 0 or omega = 0 even where it is another constant for every other value
    jump = low == 0.0 and sweep.unknown != "v0" and abs(mu[0] - mu[1]) > 1e-9 * mu[0]
    constant = bool(mu[1] == mu[2])
    first, last = float(mu[0]), float(mu[2])
    if within is None and not constant:
        last = _limit(sweep, last)
    reach = Reach(
        low, high, min(first, last), max(first, last),
        min_included=within is not None or constant or first < last or last == first or _attained(sweep, last),
        max_included=within is not None or constant or first > last,
    )  # fmt: skip
    if constant:
        reach = Reach(low, high, min(first, last), max(first, last), True, True)
    edges = [max(low, TINY) if jump else low, high]
    solved: list[list[Root]] = [[] for _ in targets]
    if not constant:
        x = _samples(sweep, *edges)
        solved = _roots(sweep, _curves(sweep, edges, x, sweep.mu(x)), targets)
    at_zero = [Root(low, low, low, first, str(sweep.answer(np.array([low])).regime[0]))] if jump else []
    roots = [
        at_zero if jump and target == first else found if reach.holds(float(target)) else []
        for target, found in zip(targets, solved, strict=True)
    ]
    return _solution(sweep, targets, roots, reach, constant and not jump)


def _samples(sweep: Sweep, low: float, high: float) -> Array:
    """Values strictly between ``low`` and ``high`` that bracket what is looked for: v0, y0 or omega, ascending."""
    # products over quotients: where v~ or y~ is 1, and where y~ = v~
    elastic = {
        "v0": (("mu0", "Fz", "omega"), ("k",)),
        "y0": (("mu0", "Fz"), ("k",)),
        "omega": (("v0", "k"), ("mu0", "Fz")),
    }
    rigid = {"v0": (("y0", "omega"), ()), "y0": (("v0",), ("omega",)), "omega": (("v0",), ("y0",))}
    parts = [np.arange(-323.0, 308.0, _FAR)]
    for above, under in (elastic[sweep.unknown], rigid[sweep.unknown]):
        if all(sweep.case[name] for name in above + under):
            centre = sum(math.log10(sweep.case[name]) for name in above) - sum(
                math.log10(sweep.case[name]) for name in under
            )
            parts.append(np.linspace(centre - _NEAR, centre + _NEAR, 2 * _NEAR * _NEAR_PER_DECADE + 1))
    exponents = np.unique(np.clip(np.concatenate(parts), -323.0, 308.0))
    x = 10.0**exponents
    return np.unique(np.append(x[(x > low) & (x < high)], TINY if low < TINY < high else [])).astype(np.float64)


def _limit(sweep: Sweep, last: float) -> float:
    """What mu_macro tends to as v0, y0 or omega grows without limit; ``last`` is its value at the largest double."""
    if sweep.unknown == "v0":
        return float(sweep.case["mu0"])
    if sweep.unknown == "y0":
        return 0.0
    return last if sweep.case["k"] is not None else 0.0


def _attained(sweep: Sweep, last: float) -> bool:
    """Whether the smallest mu_macro is reached at a finite value: friction that vanishes at rest, at y0 = l0."""
    return sweep.unknown == "y0" and last == 0.0 and sweep.case["v0"] == 0.0


def _solve_folded(sweep: Sweep, targets: Array, within: tuple[float, float] | None) -> Solution:
    still = 0.0 in (sweep.case.get("y0"), sweep.case.get("omega"))
    if within is not None:
        low, high = within
    elif still:
        low, high = (1e-300, 1e300)
    else:
        low, high = _default_range(sweep.case, sweep.unknown, targets)
    decades = math.log10(high) - math.log10(low)
    x = np.exp(np.linspace(math.log(low), math.log(high), min(max(int(decades * _PER_DECADE), 64) + 1, _MAX_SAMPLES)))
    x[0], x[-1] = low, high
    answer = sweep.answer(x)
    mu, noise = np.asarray(answer.mu_macro), 2.0 * np.asarray(answer.error_bound)
    constant = float(mu.max() - mu.min()) <= float(noise.max())
    edges = [low, *([] if constant else _turning_points(sweep, x, mu, noise)), high]
    ends = sweep.mu(np.array(edges))
    reach = Reach(low, high, float(ends.min()), float(ends.max()), True, True)
    roots: list[list[Root]] = [[] for _ in targets]
    if not constant:
        roots = _roots(sweep, _curves(sweep, edges, x, mu), targets)
    return _solution(sweep, targets, roots, reach, constant)


def _solution(sweep: Sweep, targets: Array, roots: list[list[Root]], reach: Reach, constant: bool) -> Solution:
    return Solution(sweep.unknown, tuple(targets.tolist()), tuple(map(tuple, roots)), reach, constant)

"""The inverse question: which value of one input gives a wanted mu_macro; and where a sweep of it crosses the border.

What is known of mu_macro as a function of one input, the others held:

=====  =====================================  ====================================================================
input  course                                 roots
=====  =====================================  ====================================================================
v0     rises from the static limit to mu0     one; mu0 itself is not reached
y0     falls from mu0 to 0                    one; 0 is not reached, unless v0 = 0
omega  falls from mu0 to the static limit     one; the static limit is not reached
k      mu0 at k -> 0, eq. (37) at k -> inf    up to three: for r = y0 omega / v0 above 9.72 it falls to a minimum at y~
                                              from 4.1 to 6.5, rises to a maximum (at y~ = 0.115 r^2 for large r), and
                                              falls again
Fz     the same in 1/Fz                       the same
mu0    rises: it would fold only where        one, but searched like k and Fz
       d ln mu~ / d ln y~ > 1 on a ray of
       constant r; it is 0.09 at the most
=====  =====================================  ====================================================================

The figures are those of benchmarks/folds.py, for r up to 1e8.

Roots are found by bisection on the *bits* of the input: doubles of one sign are ordered like the integers that their
bits spell, so cutting ends at two neighbouring doubles, whatever the scale, at no risk of overflow.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from friction.errors import InputError
from friction.nondim import BOUNDS, FIELDS, POSITIVE
from friction.surrogate import Answer, Surrogate

__all__ = ["Crossing", "Reach", "Root", "Solution", "border_crossings", "checked_case", "last_double", "solve_for"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

MONOTONE = ("v0", "y0", "omega")
TINY, HUGE = 5e-324, 1.7976931348623157e308

# A ray of constant r = y0 omega / v0 is searched for turning points at this many places a decade.  At r = 10, three
# percent above its birth, the fold is a sixth of a decade wide; the steep descent (y~ = 1 at large r) holds none.
_PER_DECADE = 100
_MAX_SAMPLES = 20_001
_PER_CALL = 512
# y~ where v~/v~crit(y~) is smallest on a ray: there d ln v~crit / d ln y~ = 1.  The slope falls strictly from 2 to 1/2
# (20,001 places from 1e-6 to 1e12), so the border is crossed at most once on either side.
Y_CLOSEST = 1.290791


@dataclass(frozen=True)
class Root:
    """One value of the unknown.

    Attributes
    ----------
    value : float
        The unknown [SI].
    low, high : float
        Between them, and on the root's side of the next turning point, mu_macro is within the surrogate's error bound
        of the target: the true root cannot be told from any of these values [SI].
    mu_macro : float
        What the surrogate says there [-].
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
    """The mu_macro [-] to be had in ``low <= unknown <= high``; an end that is only approached is not included."""

    low: float
    high: float
    mu_min: float
    mu_max: float
    min_included: bool
    max_included: bool

    def holds(self, target: float) -> bool:
        """Whether ``target`` can be had."""
        above = target > self.mu_min or (self.min_included and target == self.mu_min)
        return above and (target < self.mu_max or (self.max_included and target == self.mu_max))


@dataclass(frozen=True)
class Solution:
    """All roots of every target, ascending; ``constant`` when the unknown has no influence on mu_macro."""

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
    """The five known inputs as floats (``k`` may be None, rigid contact).

    Raises
    ------
    InputError
        A value is missing, out of bounds, or given for the unknown.
    """
    if without not in FIELDS:
        raise InputError("unknown", without, f"one of {', '.join(FIELDS)}")
    if case.get(without) is not None:
        raise InputError(without, case[without], "left out, because it is what is asked for")
    out: dict[str, float | None] = {}
    for name in FIELDS:
        if name == without:
            continue
        value = case.get(name)
        if value is None:
            if name != "k":
                raise InputError(name, value, BOUNDS[name])
            out[name] = None
            continue
        number = float(value)
        if not (math.isfinite(number) and (number > 0.0 or (number == 0.0 and name not in POSITIVE))):
            raise InputError(name, value, BOUNDS[name])
        out[name] = number
    return out


def _ordered(x: ArrayLike) -> NDArray[np.int64]:
    """Doubles >= 0 as integers of the same order.  Adding 0.0 turns -0.0, the smallest integer, into 0.0."""
    return (np.asarray(x, dtype=np.float64) + 0.0).view(np.int64)


def last_double(below: Callable[[Array], Bools], low: ArrayLike, high: ArrayLike) -> tuple[Array, Array]:
    """Neighbouring doubles (a, b): the last with ``below`` true, the first with it false.

    Parameters
    ----------
    below : callable
        Array (n, m) in, array of bool (n, m) out, row i judging bracket i; true at ``low``, false at ``high``, monotone
        in between.
    low, high : array_like
        Ends of the brackets, >= 0, shape (n,).
    """
    a, b = _ordered(low).copy(), _ordered(high).copy()
    rows = np.arange(a.size)
    # a call costs as much as some hundred points: few brackets are cut into many parts at once
    parts = min(max(_PER_CALL // max(a.size, 1), 2), 64)
    inner = np.arange(1, parts)
    while np.any(b - a > 1):
        step, rest = np.divmod(b - a, parts)
        cuts = a[:, None] + step[:, None] * inner + rest[:, None] * inner // parts
        count = np.argmin(np.column_stack((below(cuts.view(np.float64)), np.zeros(a.size, dtype=np.bool_))), axis=1)
        ends = np.column_stack((a, cuts, b))
        a, b = ends[rows, count], ends[rows, count + 1]
    return a.view(np.float64), b.view(np.float64)


class _Sweep:
    """mu_macro as a function of one input."""

    def __init__(self, surrogate: Surrogate, case: Mapping[str, float | None], unknown: str) -> None:
        self.surrogate = surrogate
        self.unknown = unknown
        self.case: dict[str, Any] = {"k": None, **case}

    def answer(self, x: Array) -> Answer:
        return self.surrogate.evaluate(**{**self.case, self.unknown: x})

    def mu(self, x: Array) -> Array:
        out: Array = np.asarray(self.answer(x).mu_macro)
        return out

    def at(self, x: float) -> float:
        return float(self.mu(np.array([x]))[0])


def _scale(case: Mapping[str, float | None], unknown: str) -> float:
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
        scale, y_low, y_high = _scale(case, unknown), 1e-6, max(1e8, 1e8 * r, 1e3 * r * r)
    low, high = (scale * y_low, scale * y_high) if unknown == "k" else (scale / y_high, scale / y_low)
    if unknown == "mu0":  # mu_macro grows with it without limit
        wanted = targets[targets > 0.0]
        if wanted.size:
            low, high = min(low, 0.5 * float(wanted.min())), max(high, 2.0 * float(wanted.max()))
    return max(low, 1e-300), min(high, 1e300)


def _turning_points(sweep: _Sweep, low: float, high: float) -> tuple[list[float], bool]:
    """Where mu_macro stops rising or falling, ascending; and whether it is the same everywhere, to its own error."""
    decades = math.log10(high) - math.log10(low)
    n = min(max(int(decades * _PER_DECADE), 64) + 1, _MAX_SAMPLES)
    x = np.exp(np.linspace(math.log(low), math.log(high), n))
    x[0], x[-1] = low, high
    answer = sweep.answer(x)
    mu, noise = np.asarray(answer.mu_macro), 2.0 * np.asarray(answer.error_bound)
    if float(mu.max() - mu.min()) <= float(noise.max()):
        return [], True
    found: list[int] = []
    direction, top, bottom = 0, 0, 0
    for i in range(1, n):
        top = i if mu[i] > mu[top] else top
        bottom = i if mu[i] < mu[bottom] else bottom
        if direction >= 0 and mu[i] < mu[top] - noise[i]:
            if direction > 0:
                found.append(top)
            direction, bottom = -1, i
        elif direction <= 0 and mu[i] > mu[bottom] + noise[i]:
            if direction < 0:
                found.append(bottom)
            direction, top = 1, i
    sign = {i: 1.0 if mu[i] >= max(mu[i - 1], mu[min(i + 1, n - 1)]) else -1.0 for i in found}
    return [_extremum(sweep, x[i - 1], x[min(i + 1, n - 1)], sign[i]) for i in found], False


def _extremum(sweep: _Sweep, low: float, high: float, sign: float) -> float:
    """Largest (sign +1) or smallest (-1) mu_macro between two samples, in the logarithm, to where it is flat."""
    a, b = math.log(low), math.log(high)
    for _ in range(8):
        grid = np.linspace(a, b, 33)
        i = int(np.argmax(sign * sweep.mu(np.exp(grid))))
        a, b = float(grid[max(i - 1, 0)]), float(grid[min(i + 1, 32)])
    return math.exp(0.5 * (a + b))


def _on_pieces(sweep: _Sweep, edges: Array, targets: Array) -> list[list[Root]]:
    """All roots, given the edges (m + 1,) of m pieces on each of which mu_macro is monotone; ascending."""
    mu = sweep.mu(edges)
    which, piece = np.nonzero(
        (targets[:, None] >= np.minimum(mu[:-1], mu[1:])) & (targets[:, None] <= np.maximum(mu[:-1], mu[1:]))
    )
    found: list[list[Root]] = [[] for _ in targets]
    if not which.size:
        return found
    sign = np.where(mu[piece + 1] >= mu[piece], 1.0, -1.0)
    wanted, start, end = targets[which], edges[piece], edges[piece + 1]

    def reach(level: Array, beyond: bool = False) -> tuple[Array, Array]:
        """Neighbours between which mu_macro comes to ``level``, or leaves it; an end of the piece where it does not."""

        def below(x: Array) -> Bools:
            m, limit = sign[:, None] * sweep.mu(x), (sign * level)[:, None]
            out: Bools = m <= limit if beyond else m < limit
            return out

        return last_double(below, start, end)

    a, b = reach(wanted)
    off_a, off_b = np.abs(sweep.mu(a) - wanted), np.abs(sweep.mu(b) - wanted)
    value = np.where(off_a <= off_b, a, b)
    # a target that is the very value at an edge has its root there; just inside, rounding may say otherwise
    value = np.where(mu[piece] == wanted, start, value)
    value = np.where((mu[piece + 1] == wanted) & (np.minimum(off_a, off_b) > 0.0), end, value)
    answer = sweep.answer(value)
    # at y0 = 0 mu_macro is exact, and beside it no longer
    bound = np.maximum(np.asarray(answer.error_bound), np.asarray(sweep.answer(b).error_bound))
    low = np.minimum(reach(wanted - sign * bound)[0], value)
    high = np.maximum(reach(wanted + sign * bound, beyond=True)[1], value)
    columns = (value, low, high, np.asarray(answer.mu_macro), np.asarray(answer.regime))
    for i, *root in zip(which.tolist(), *(column.tolist() for column in columns), strict=True):
        if not found[i] or root[0] != found[i][-1].value:
            found[i].append(Root(*root))
    return found


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
        The other five inputs [SI]; ``k`` None or left out is rigid contact, unless it is the unknown.
    within : (float, float), optional
        Where to look [SI].  Left out: everywhere for v0, y0, omega; for k, Fz and mu0 from where the contact is so soft
        that mu_macro = mu0 to where it is as good as rigid.

    Raises
    ------
    InputError
        A value out of bounds, an unknown that is given or does not exist, a range that is none.
    """
    known = checked_case(case, unknown)
    wanted = np.atleast_1d(np.asarray(targets, dtype=np.float64)).ravel()
    bad = ~(np.isfinite(wanted) & (wanted >= 0.0))
    if bad.any():
        i = int(np.flatnonzero(bad)[0])
        raise InputError("target", float(wanted[i]), "finite and >= 0", i if np.ndim(targets) else None)
    if within is not None:
        within = _checked_range(within, unknown)
    sweep = _Sweep(surrogate, known, unknown)
    if unknown in MONOTONE:
        return _solve_monotone(sweep, wanted, within)
    return _solve_folded(sweep, wanted, within)


def _checked_range(within: tuple[float, float], unknown: str) -> tuple[float, float]:
    low, high = (float(end) for end in within)
    floor = low > 0.0 if unknown in POSITIVE else low >= 0.0
    if not (floor and low < high and math.isfinite(high)):
        bound = "two ascending, finite numbers " + ("> 0" if unknown in POSITIVE else ">= 0")
        raise InputError("range", [low, high], bound)
    return low, high


def _solve_monotone(sweep: _Sweep, targets: Array, within: tuple[float, float] | None) -> Solution:
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
    edges = np.array([max(low, TINY) if jump else low, high])
    solved: list[list[Root]] = [[] for _ in targets] if constant else _on_pieces(sweep, edges, targets)
    at_zero = [Root(low, low, low, first, str(sweep.answer(np.array([low])).regime[0]))] if jump else []
    roots = [
        at_zero if jump and target == first else found if reach.holds(float(target)) else []
        for target, found in zip(targets, solved, strict=True)
    ]
    return _solution(sweep, targets, roots, reach, constant and not jump)


def _limit(sweep: _Sweep, last: float) -> float:
    """What mu_macro tends to as v0, y0 or omega grows without limit; ``last`` is its value at the largest double."""
    if sweep.unknown == "v0":
        return float(sweep.case["mu0"])
    if sweep.unknown == "y0":
        return 0.0
    return last if sweep.case["k"] is not None else 0.0


def _attained(sweep: _Sweep, last: float) -> bool:
    """Whether the smallest mu_macro is reached at a finite value: friction that vanishes at rest, at y0 = l0."""
    return sweep.unknown == "y0" and last == 0.0 and sweep.case["v0"] == 0.0


def _solve_folded(sweep: _Sweep, targets: Array, within: tuple[float, float] | None) -> Solution:
    still = 0.0 in (sweep.case.get("y0"), sweep.case.get("omega"))
    if within is not None:
        low, high = within
    elif still:
        low, high = (1e-300, 1e300)
    else:
        low, high = _default_range(sweep.case, sweep.unknown, targets)
    turns, constant = _turning_points(sweep, low, high)
    edges = np.array([low, *turns, high])
    mu = sweep.mu(edges)
    reach = Reach(low, high, float(mu.min()), float(mu.max()), True, True)
    roots: list[list[Root]] = [[] for _ in targets] if constant else _on_pieces(sweep, edges, targets)
    return _solution(sweep, targets, roots, reach, constant)


def _solution(sweep: _Sweep, targets: Array, roots: list[list[Root]], reach: Reach, constant: bool) -> Solution:
    return Solution(sweep.unknown, tuple(targets.tolist()), tuple(map(tuple, roots)), reach, constant)


def border_crossings(
    surrogate: Surrogate, along: str, case: Mapping[str, float | None], low: float, high: float
) -> tuple[Crossing, ...]:
    """Where in ``low <= along <= high`` continuous sliding begins or ends: none, one, or (mu0, Fz, k) two places.

    ``case`` holds the other five inputs.  None for rigid contact (never any stick) and without oscillation.
    """
    known = checked_case(case, along)
    sweep = _Sweep(surrogate, known, along)
    if sweep.case["k"] is None and along != "k":
        return ()
    if any(known.get(name) == 0.0 for name in ("y0", "omega", "v0") if name != along):
        return ()
    edges = [low, high]
    if along not in MONOTONE:
        scale = _scale(known, along)
        middle = scale * Y_CLOSEST if along == "k" else scale / Y_CLOSEST
        if low < middle < high:
            edges.insert(1, middle)

    def slides(x: Array) -> Bools:
        out: Bools = np.asarray(sweep.answer(x).regime) == "continuous"
        return out

    state = slides(np.array(edges))
    found = []
    for a, b, here, there in zip(edges[:-1], edges[1:], state[:-1], state[1:], strict=True):
        if here != there:
            wanted = bool(here)
            _, first = last_double(lambda x, wanted=wanted: slides(x) == wanted, np.array([a]), np.array([b]))  # type: ignore[misc]
            found.append(Crossing(float(first[0]), sweep.at(float(first[0]))))
    return tuple(found)

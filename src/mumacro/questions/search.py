"""Search for roots: where a function of one unknown reaches its targets.

At every place the function has a value and an estimate of its error.  The search samples it, and
adds samples until no target can be crossed unnoticed.  The turning points divide the function into
branches, on which it rises or falls by more than its error.  On a branch two samples bracket a
target.  A bisection over the bits of a double then finds the first place that reaches the target,
and the range around it in which the function equals the target within its error.

If one call of the function takes long (a motion), the bisection uses cubics through the samples.
The function is then called at the roots of the cubics until it agrees with them.  All targets share
the samples.
"""

import itertools
from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mumacro.kernel.arrays import Array, Bools, Places

TINY = 5e-324
LEVELS = 7  # number of times that an interval between samples is halved
# An interval is not searched if all targets are further away than this many times the difference
# between a sample and the cubic through its neighbours.  Root with 1,000 random problems
# (benchmarks/solve_motion.py): with 1 a root was missed.
_CLEAR = 4.0
_ROUNDING = 2.0**-50  # relative to a target: the rounding error of a value whose error is 0
# where cubics are used, the function may differ from a target by this fraction of its error
_ENOUGH = 0.1
_NARROW = 1e-12  # a bracket of a costly function with a smaller relative width is one place
# If the function steps between neighbouring doubles by more than this fraction of its whole range,
# it is a jump and not a root. (At a cusp, such as that of the static limit at y~ = 1, the step is
# only the square root of the rounding error.)
_JUMP = 1e-6
_MOST_STEPS = 80
_SHARPENINGS, _INNER = 12, 8  # rounds in which a turning point is narrowed, and samples in each
_SAFE = 16  # after this many steps on a bracket every second step halves it
_NEAR = 2.0**61  # a bracket with more doubles in it is halved

Function = Callable[[Array], tuple[Array, Array]]


class Curve(Protocol):
    """A function over one unknown."""

    #: whether a call takes so long that cubics through the samples stand for it
    costly: bool

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        """Return the values at ``x`` and the estimates of their errors, in the shape of ``x``; NaN
        where the function has no value."""
        ...


class Root(NamedTuple):
    """Hold a place that reaches a target."""

    value: float  #: the unknown [SI], a phase in degrees: the first place that reaches the target
    #: between them the function equals the target within its error (for a motion to first order)
    low: float
    high: float
    mean: float  #: the function at this value: a mean friction [-]
    error_estimate: float  #: the estimate of its error [-]


class Samples:
    """Hold values of a curve and their errors at ascending places."""

    def __init__(self, curve: Curve) -> None:
        self.curve = curve
        self.x, self.value, self.error = np.empty(0), np.empty(0), np.empty(0)

    def add(self, places: Array) -> None:
        """Sample the curve at new places; drop a place where it has no value."""
        x = np.setdiff1d(places, self.x)
        if not x.size:
            return
        value, error = self.curve.evaluate(x)
        legal = np.isfinite(value)
        every = np.concatenate((self.x, x[legal]))
        order = np.argsort(every, kind="stable")
        self.x = every[order]
        self.value = np.concatenate((self.value, value[legal]))[order]
        self.error = np.concatenate((self.error, error[legal]))[order]

    def cubics(self) -> Function:
        """Return cubics through the samples, monotone between them, and their errors."""
        x, y, error = self.x, self.value, self.error
        width = np.diff(x)
        chord = np.diff(y) / width
        before, after = width[:-1], width[1:]
        slope = np.concatenate((chord[:1], chord[:-1], chord[-1:]))
        slope[1:-1] = (before * chord[1:] + after * chord[:-1]) / (before + after)
        least = np.minimum(np.abs(chord[:-1]), np.abs(chord[1:]))
        same = np.sign(chord[:-1]) == np.sign(chord[1:])
        slope[1:-1] = np.where(same, np.clip(slope[1:-1], -3.0 * least, 3.0 * least), 0.0)

        def between(places: Array) -> tuple[Array, Array]:
            i = np.clip(np.searchsorted(x, places, side="right") - 1, 0, x.size - 2)
            h, t = width[i], (places - x[i]) / width[i]
            rest = 1.0 - t
            value = (
                y[i]
                + (y[i + 1] - y[i]) * t * t * (3.0 - 2.0 * t)
                + h * t * rest * (slope[i] * rest - slope[i + 1] * t)
            )
            return value, error[i] + (error[i + 1] - error[i]) * t

        return between


class Search:
    """Find every root of every target in a range."""

    def __init__(
        self, curve: Curve, places: Array, low: float, high: float, targets: Array
    ) -> None:
        self.curve, self.low, self.high, self.targets = curve, low, high, targets
        self._sorted = np.sort(targets)
        self.samples = Samples(curve)
        self.samples.add(places)

    def roots(self) -> list[list[Root]]:
        """Return the roots of each target, ascending.  A range of roots counts as one root, and so
        do roots whose ranges overlap."""
        self._refine()
        self._sharpen()
        which, places = self._first_places()
        samples = self.samples
        if self.curve.costly:
            i = np.searchsorted(samples.x, places)
            value, error = samples.value[i], samples.error[i]
            function = samples.cubics()
        else:
            value, error = self.curve.evaluate(places)
            function = self.curve.evaluate
        off = np.abs(value - self.targets[which])
        real = off <= np.maximum(
            _allowed(error, self.targets[which]), _JUMP * np.ptp(samples.value)
        )
        which, places = which[real], places[real]
        low, high = self._widths(function, which, places)
        roots: list[list[Root]] = [[] for _ in self.targets]
        columns = (part.tolist() for part in (places, low, high, value[real], error[real]))
        for k, root in sorted(zip(which.tolist(), map(Root, *columns), strict=True)):
            of_target = roots[k]
            if of_target and root.low <= of_target[-1].high:
                widest = max(of_target[-1].high, root.high)
                of_target[-1] = of_target[-1]._replace(high=widest)
            else:
                of_target.append(root)
        return roots

    @property
    def extremes(self) -> tuple[float, float]:
        """Return the smallest and the largest value in the range."""
        ends = self.samples.value[self._edges()]
        return float(ends.min()), float(ends.max())

    @property
    def constant(self) -> bool:
        """Return whether the function is constant within its error."""
        value, error = self.samples.value, self.samples.error
        return bool(np.max(value - error) <= np.min(value + error))

    # --- samples ----------------------------------------------------------------------------------

    def _hold(self, low: Array, high: Array) -> Bools:
        """Return which ranges of values contain a target."""
        first = np.searchsorted(self._sorted, low, side="left")
        return np.asarray(np.searchsorted(self._sorted, high, side="right") > first)

    def _refine(self) -> None:
        """Halve the intervals between samples until it is decided for each whether it crosses a
        target."""
        samples = self.samples
        starts = samples.x[:-1]  # first samples of the open intervals
        for _ in range(LEVELS):
            i = np.searchsorted(samples.x, starts)
            middles = _middle(samples.x[i], samples.x[i + 1])
            inside = (samples.x[i] < middles) & (middles < samples.x[i + 1])
            i, middles = i[inside], middles[inside]
            if not i.size:
                return
            starts, guess = samples.x[i], samples.cubics()(middles)[0]
            samples.add(middles)
            j = np.clip(np.searchsorted(samples.x, middles), 1, samples.x.size - 2)
            legal = samples.x[j] == middles
            j, guess, starts, middles = j[legal], guess[legal], starts[legal], middles[legal]
            still = self._undecided(j, np.abs(samples.value[j] - guess))
            starts = np.concatenate((starts[still], middles[still]))

    def _undecided(self, j: Places, off: Array) -> Bools:
        """Return which intervals next to the new samples ``j`` may cross a target unnoticed;
        ``off`` is the difference between the cubic and the new samples."""
        value, error = self.samples.value, self.samples.error
        a, middle, b = value[j - 1], value[j], value[j + 1]
        away = np.where(np.isnan(off), np.inf, _CLEAR * off + error[j])
        near = np.any([self._hold(v - away, v + away) for v in (a, middle, b)], axis=0)
        # if the whole interval equals the target within its error, it is one root; do not halve it
        triples = [(value[j + n], error[j + n]) for n in (-1, 0, 1)]
        least, most = (
            pick([v + side * e for v, e in triples], axis=0)
            for pick, side in ((np.max, -1.0), (np.min, 1.0))
        )
        flat = (least <= most) & self._hold(least, most)
        # an interval that crosses a target stays open until the curve in it is smooth
        crossing = self._hold(np.minimum(a, b), np.maximum(a, b))
        smooth = off <= 1e-3 * np.abs(b - a) + error[j]
        monotone = (middle - a) * (b - middle) >= 0.0
        return np.asarray(near & ~flat & ~(crossing & smooth & monotone))

    def _sharpen(self) -> None:
        """Add samples around the turning points, until targets and extremes are decided."""
        samples = self.samples
        turns = [
            (samples.x[i - 1], samples.x[i + 1], side)
            for i, side in turning_points(samples.value, samples.error)
        ]
        for low, high, side in turns:
            for _ in range(_SHARPENINGS):
                samples.add(np.linspace(low, high, _INNER + 2)[1:-1])
                i = slice(*np.searchsorted(samples.x, [low, np.nextafter(high, np.inf)]))
                x, value, error = samples.x[i], side * samples.value[i], samples.error[i]
                best = int(np.argmax(value))
                top, spread = value[best], np.ptp(value)
                if spread <= error[best] or not 0 < best < x.size - 1:
                    break
                reach = side * np.array([[top - error[best]], [top + _CLEAR * spread]])
                is_extreme = top >= np.max(side * samples.value)
                if not (is_extreme or self._hold(reach.min(axis=0), reach.max(axis=0))[0]):
                    break
                low, high = x[best - 1], x[best + 1]

    # --- roots ------------------------------------------------------------------------------------

    def _first_places(self) -> tuple[Places, Array]:
        """Return the indices of targets, and the places where a branch first reaches them."""
        samples = self.samples
        for step in range(_MOST_STEPS):
            (at_ends, ends), (which, i, sign) = self._brackets()
            a, b, level = samples.x[i - 1], samples.x[i], self.targets[which]
            if not self.curve.costly:
                before, places = _first(self.curve.evaluate, a, b, level, sign)
                value, error = self.curve.evaluate(np.stack((before, places)))
                off = np.abs(value - level) - _allowed(error, level)
                # after a jump the value may equal the target only because of the error before the
                # jump
                places = np.where((off[0] <= 0.0) & (off[1] > 0.0), before, places)
                break
            off = np.abs(samples.value[[i - 1, i]] - level) - _ENOUGH * samples.error[[i - 1, i]]
            places = np.where(off[0] < off[1], a, b)
            narrow = b - a <= _NARROW * np.maximum(np.abs(a), np.abs(b))
            j = np.flatnonzero(~(off.min(axis=0) <= 0.0) & ~narrow)
            if not j.size:
                break
            a, b, level, sign = a[j], b[j], level[j], sign[j]
            halved = step % 4 == 3
            samples.add(_middle(a, b) if halved else _first(samples.cubics(), a, b, level, sign)[1])
        return np.concatenate((at_ends, which)), np.concatenate((ends, places))

    def _edges(self) -> list[int]:
        """Return the samples at the ends of the branches."""
        samples = self.samples
        turns = [i for i, _ in turning_points(samples.value, samples.error)]
        return [0, *turns, samples.x.size - 1]

    def _brackets(self) -> tuple[tuple[Places, Array], tuple[Places, Places, Array]]:
        """Return two groups of brackets.  In the first, the end of a branch equals the target
        within its error: targets and ends.  In the second, the branch crosses the target: targets,
        the samples that first reach them, and 1 if the branch rises or -1 if it falls."""
        x, value, error = self.samples.x, self.samples.value, self.samples.error
        at_ends, ends, crossed, firsts, signs = [], [], [], [], []
        for first, last in pairwise(self._edges()):
            sign = 1.0 if value[last] >= value[first] else -1.0
            # rounding may make a plateau fall by a digit; a root is where the target is reached
            risen = np.maximum.accumulate(sign * value[first : last + 1])
            j = np.searchsorted(risen, sign * self.targets)
            inside = np.flatnonzero((j > 0) & (j < risen.size))
            crossed.append(inside)
            firsts.append(first + j[inside])
            signs.append(np.full(inside.size, sign))
            for beyond, i in ((j == 0, 0), (j == risen.size, int(np.argmax(risen)))):
                touched = np.abs(value[first + i] - self.targets)
                k = np.flatnonzero(beyond & (touched <= _allowed(error[first + i], self.targets)))
                at_ends.append(k)
                ends.append(np.full(k.size, x[first + i]))
        every = [np.concatenate(part) for part in (at_ends, ends, crossed, firsts, signs)]
        return (every[0], every[1]), (every[2], every[3], every[4])

    def _widths(self, function: Function, which: Places, places: Array) -> tuple[Array, Array]:
        """Return how far the range in which the function equals the target within its error extends
        below and above each root.  ``which`` is the target of each of ``places``."""
        samples, targets = self.samples, self.targets[which]
        x = samples.x

        def outside(i: Any, target: Any) -> Bools:
            away = np.abs(samples.value[i] - target)
            return np.asarray(away > _allowed(samples.error[i], target))

        # the nearest samples that differ from the target: nearly always the next ones
        below = np.searchsorted(x, places) - 1
        above = np.searchsorted(x, places, side="right")
        above[above == x.size] = -1
        low, high = np.full(places.size, self.low), np.full(places.size, self.high)
        next_ones = outside(np.stack((below, above)), targets) | (np.stack((below, above)) < 0)
        for n in np.flatnonzero(~next_ones.all(axis=0)).tolist():
            i = np.flatnonzero(outside(slice(None), targets[n]))
            left, right = i[x[i] < places[n]], i[x[i] > places[n]]
            below[n] = left[-1] if left.size else -1
            above[n] = right[0] if right.size else -1

        def excess(q: Array, rows: Places) -> Array:
            value, error = function(q)
            target = targets[rows]
            return np.asarray(np.abs(value - target) - _allowed(error, target))

        on_cusp = excess(places, np.arange(places.size)) > 0.0  # the next double differs, too
        low[on_cusp] = high[on_cusp] = places[on_cusp]
        i, j = np.flatnonzero((below >= 0) & ~on_cusp), np.flatnonzero((above >= 0) & ~on_cusp)
        roots, upward = np.r_[i, j], np.repeat([False, True], [i.size, j.size])

        def height(q: Array, rows: Places) -> Array:
            off = excess(q, roots[rows])
            # at upward 0 it still equals the target
            return np.where(upward[rows], off - TINY, -off)

        first, last = np.r_[x[below[i]], places[j]], np.r_[places[i], x[above[j]]]
        before, after = last_double(height, first, last)
        low[i], high[j] = after[: i.size], before[i.size :]
        return low, high


def _allowed(error: Array, target: Array) -> Array:
    """Return by how much a value may differ from a target that it equals within its error."""
    return np.maximum(error, _ROUNDING * np.abs(target))


def _first(
    function: Function, a: Array, b: Array, level: Array, sign: Array
) -> tuple[Array, Array]:
    """Return for each level, from ``a`` on, the last double before it is reached and the first one
    at which it is reached, (n,)."""

    def height(q: Array, rows: Places) -> Array:
        return sign[rows] * (function(q)[0] - level[rows])

    return last_double(height, a, b)


def _middle(a: Array, b: Array) -> Array:
    """Return the middles of intervals; the middle in logarithms if the interval is far from 0."""
    far = (a > 0.0) & (b > 1.5 * a)
    root = np.sqrt(np.where(far, a, 1.0)) * np.sqrt(np.where(far, b, 1.0))
    return np.where(far, root, 0.5 * a + 0.5 * b)


def turning_points(value: Array, error: Array) -> list[tuple[int, float]]:
    """Return the samples at which values turn by more than their error, with 1 for a maximum and -1
    for a minimum.

    >>> turning_points(np.array([0.0, 2.0, 1.9, 3.0, 0.0, 1.0]), np.full(6, 0.2))
    [(3, 1.0), (4, -1.0)]
    """
    step = np.flatnonzero(np.diff(value))
    side = np.sign(np.diff(value)[step])
    bends = step[1:][side[1:] != side[:-1]]
    turns: list[tuple[int, float]] = []
    best, way = 0, 0.0  # the furthest sample since the last turn, and the direction since then
    values, errors = value.tolist(), error.tolist()
    lowest = highest = 0
    for i in [*bends.tolist(), value.size - 1]:
        if way == 0.0:
            lowest = i if values[i] < values[lowest] else lowest
            highest = i if values[i] > values[highest] else highest
            for best, way in ((lowest, 1.0), (highest, -1.0)):
                if way * (values[i] - values[best]) > errors[i] + errors[best]:
                    best = i
                    break
            else:
                way = 0.0
        elif way * (values[i] - values[best]) >= 0.0:
            best = i
        elif way * (values[best] - values[i]) > errors[i] + errors[best]:
            turns.append((best, way))
            best, way = i, -way
    return turns


# --- doubles --------------------------------------------------------------------------------------


def samples(low: float, high: float, per_decade: int, most: int = 20_001) -> Array:
    """Return values > 0 from ``low`` to ``high``, evenly spaced in the logarithm."""
    first = max(low, TINY)
    start, stop = np.log(first), np.log(high)
    count = min(max(int((stop - start) / np.log(10.0) * per_decade), 64) + 1, most)
    with np.errstate(over="ignore"):
        return np.clip(np.exp(np.linspace(start, stop, count)), first, high)


_SIGN = np.uint64(1 << 63)


def _key_of(x: ArrayLike) -> NDArray[np.uint64]:
    """Return integers that have the same order as the doubles."""
    bits = (np.array(x, dtype=np.float64) + 0.0).view(np.uint64)  # + 0.0: -0.0 is 0.0
    return np.where(bits & _SIGN, ~bits, bits | _SIGN)


def _double_of(key: NDArray[np.uint64]) -> Array:
    """Return the doubles that belong to the integers."""
    return np.where(key & _SIGN, key ^ _SIGN, ~key).view(np.float64)


def last_double(
    height: Callable[[Array, Places], Array], low: ArrayLike, high: ArrayLike
) -> tuple[Array, Array]:
    """Return neighbouring doubles (a, b), (n,): the last one with a height below 0, and the first
    one with a height >= 0.

    ``height`` takes values (m,) and the indices (m,) of their brackets, and returns heights (m,).
    Each height is below 0 at ``low`` (n,) and changes its sign once up to ``high``.

    Doubles have the order of integers, their *bits*, so the search ends at two neighbours on any
    scale.  A bracket is cut at the root of an inverse parabola (Chandrupatla's method) if that is
    safe, and halved otherwise.  The parabola passes through both ends and the end that was replaced
    last.
    """
    newest, other = np.atleast_1d(_key_of(low)), np.atleast_1d(_key_of(high))
    i, one = np.arange(newest.size), np.uint64(1)
    if not i.size:
        return _double_of(newest), _double_of(other)
    f, g = height(_double_of(np.concatenate((newest, other))), np.tile(i, 2)).reshape(2, -1)
    left, h = other.copy(), g.copy()  # no parabola yet
    for step in itertools.count():
        width = np.maximum(newest, other) - np.minimum(newest, other)
        open_ = width > one
        i = i[open_[i]]
        if not i.size:
            break
        a, b, c, w = newest[i], other[i], left[i], width[i]
        share = _share(a, b, c, f[i], g[i], h[i])
        if step > _SAFE and step % 2:
            share = np.full(i.size, 0.5)
        share = np.where(a < b, share, 1.0 - share)
        cut = np.minimum(a, b) + np.clip((share * w).astype(np.uint64), one, w - one)
        f_cut = height(_double_of(cut), i)
        same = (f_cut < 0.0) == (f[i] < 0.0)
        left[i], h[i] = np.where(same, a, b), np.where(same, f[i], g[i])
        other[i], g[i] = np.where(same, b, a), np.where(same, g[i], f[i])
        newest[i], f[i] = cut, f_cut
    return _double_of(np.minimum(newest, other)), _double_of(np.maximum(newest, other))


def _share(
    a: NDArray[np.uint64],
    b: NDArray[np.uint64],
    c: NDArray[np.uint64],
    f: Array,
    g: Array,
    h: Array,
) -> Array:
    """Return where to cut brackets between the newest end ``a`` and ``b``, as a fraction of the
    distance.  ``c`` is the end that was replaced; ``f``, ``g`` and ``h`` are the heights, all (n,).
    """
    with np.errstate(all="ignore"):
        to_b, c_to_b = ((b - x).view(np.int64).astype(np.float64) for x in (a, c))
        xi, phi = to_b / c_to_b, (f - g) / (h - g)
        safe = (phi * phi < xi) & ((1.0 - phi) ** 2 < 1.0 - xi) & (np.abs(to_b) < _NEAR)
        parabola = f / (g - f) * h / (g - h) + (to_b - c_to_b) / to_b * f / (h - f) * g / (h - g)
        return np.where(safe, parabola, 0.5)

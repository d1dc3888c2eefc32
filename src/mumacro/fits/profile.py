"""Compute the least chi2 over a curve of contacts, with samples where they matter: find its minima,
and the range that the points allow.

A contact on the curve has a place s: the logarithm of k, of mu0 or of k/mu0.  Its friction at n
points is a row of n numbers.  So the contacts form a line in n dimensions, and chi2 is the squared
distance from this line to the measured point.  If k and mu0 are both unknown, friction is mu0
mu~(k/mu0): mu0 is a factor of the row, and the best factor follows from a linear equation.

Between two samples the line is close to a straight chord.  The point of the chord that is nearest
to the measured point has a closed form.  The derivatives at the two samples tell how far the line
may be from the chord.  A chord is halved only if the line may come near the measured point, and if
its distance from the chord may be large enough to matter.  So every valley is found, however narrow
it is, provided that the derivatives on both sides of it show the turn.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from mumacro.errors import missing
from mumacro.kernel.arrays import Array, Bools, Places

CONFIDENCE = 0.95  # the probability of intervals, and of the solutions that are kept
_ROUNDS = 40
_NARROWEST = 1e-6  # a chord that is shorter in s is not halved
# Relative to the allowed rise of chi2: a smaller dip is not a minimum; the error of a chord may
# change chi2 by this much.
_RIPPLE = 1e-9
_FINE = 0.1
_ZOOM, _ZOOMS = 9, 3  # samples and rounds of the search for the end of an interval
# rounds of the search for the least chi2: its interval becomes 4^14 times narrower
_LOWEST_ROUNDS = 14
_SAME = 1e-12  # a smaller relative decrease of chi2 is a rounding error
_INSIDE = 32  # least number of samples in the allowed ranges

#: s (m,), whether slopes are wanted -> friction over its standard deviation, and its derivative
#: with respect to s, or zero: (m, n) each
Model = Callable[[Array, bool], tuple[Array, Array]]
#: places, factors and half widths of the factors (m,) -> the quantity to maximise (m,)
Goal = Callable[[Array, Array, Array], Array]


# for each value: minus its minimum, and its maximum
_ALONE: tuple[Goal, ...] = (lambda s, _, __: -np.exp(s), lambda s, _, __: np.exp(s))
_WITH_FACTOR: tuple[Goal, ...] = (
    lambda s, factor, off: np.exp(s) * np.minimum(off - factor, 0.0),
    lambda s, factor, off: np.exp(s) * (factor + off),
    lambda _, factor, off: off - factor,
    lambda _, factor, off: factor + off,
)


def _dots(a: Array, b: Array) -> Array:
    """Return the scalar product of each row of one array with the same row of the other, (m,),
    without a temporary array (m, n)."""
    return np.asarray(np.einsum("ij,ij->i", a, b))


class ProfileSamples(NamedTuple):
    """Hold samples of the curve at places ``s`` (m,), ascending; the last one may be infinite."""

    s: Array
    rows: Array  #: friction over its standard deviation, without the factor (m, n)
    slopes: Array  #: derivatives of the rows with respect to s (m, n)
    factor: Array  #: the best factor, or 1 if there is no factor (m,)
    chi2: Array  #: (m,)
    tilt: Array  #: d chi2 / d s (m,)
    rise: Array  #: chi2 = least + rise (factor - best)^2; infinite if there is no factor (m,)


class Profile:
    """Find the least chi2 over the places of a curve.

    Parameters
    ----------
    model : callable
    measured : ndarray
        Friction over its standard deviation (n,).
    has_factor : bool
        Whether each row may be multiplied by a factor >= 0, the second unknown.
    s : ndarray
        First places (m,), ascending.
    limit_of : callable
        Takes the least chi2, returns the chi2 up to which a contact is allowed.
    """

    def __init__(
        self,
        model: Model,
        measured: Array,
        has_factor: bool,
        s: Array,
        limit_of: Callable[[float], float],
    ) -> None:
        self._model, self._measured, self._has_factor = model, measured, has_factor
        self._limit_of = limit_of
        self.samples = self.sample(s)
        self._refine()
        self._insert(self._minima())
        self._refine()
        self._insert(self._lowest_places())

    @property
    def limit(self) -> float:
        """Return the chi2 up to which a contact is allowed."""
        return self._limit_of(float(self.samples.chi2.min()))

    def sample(self, s: Array, slopes: bool = True) -> ProfileSamples:
        """Return the curve at places ``s`` (m,); slopes and tilt are zero if ``slopes`` is
        False."""
        rows, steps = self._model(s, slopes)
        squares = _dots(rows, rows)
        factor: Array = np.ones(s.size)
        rise: Array = np.full(s.size, np.inf)
        if self._has_factor:
            rise = squares
            along = np.maximum(rows @ self._measured, 0.0)
            factor = np.divide(along, squares, out=np.zeros(s.size), where=squares > 0.0)
        off = self._measured - factor[:, None] * rows
        chi2 = np.nan_to_num(_dots(off, off), nan=np.inf)
        tilt = -2.0 * factor * _dots(off, steps)
        return ProfileSamples(s, rows, steps, factor, chi2, tilt, rise)

    def lowest(self) -> Places:
        """Return the indices of the samples that are minima."""
        chi2 = np.concatenate(([np.inf], self.samples.chi2, [np.inf]))
        return np.flatnonzero((chi2[1:-1] < chi2[:-2]) & (chi2[1:-1] <= chi2[2:]))

    def ridge(self, one: int, other: int) -> float:
        """Return the largest chi2 between one sample and another."""
        return float(self.samples.chi2[min(one, other) : max(one, other) + 1].max())

    # --- sampling ---------------------------------------------------------------------------------

    def _insert(self, s: Array) -> None:
        s = np.setdiff1d(s, self.samples.s)
        if not s.size:
            return
        places = np.searchsorted(self.samples.s, s)
        self.samples = ProfileSamples(
            *(
                np.insert(old, places, new, axis=0)
                for old, new in zip(self.samples, self.sample(s), strict=True)
            )
        )

    def _refine(self) -> None:
        for _ in range(_ROUNDS):
            near, error, width = self._chords()
            limit = self.limit
            reach = np.sqrt(limit)
            tolerance = _FINE * (limit - self.samples.chi2.min()) / reach if reach > 0.0 else 0.0
            halved = (near - error < reach) & (error > tolerance) & (width > _NARROWEST)
            if not halved.any():
                return
            self._insert(self.samples.s[:-1][halved] + 0.5 * width[halved])

    def _chords(self) -> tuple[Array, Array, Array]:
        """Return three numbers for each chord, (m - 1,) each: the distance from the measured point
        to it, a bound for the distance of the line from it, and its width in s."""
        a, b = self.samples.rows[:-1], self.samples.rows[1:]
        chord, width = b - a, np.diff(self.samples.s)
        m = self._measured
        with np.errstate(all="ignore"):
            if self._has_factor:
                am, cm = a @ m, chord @ m
                aa, ac, cc = (_dots(x, y) for x, y in ((a, a), (a, chord), (chord, chord)))
                t = (cm * aa - am * ac) / (am * cc - cm * ac)
            else:
                t = _dots(m - a, chord) / _dots(chord, chord)
            inner = a + np.clip(np.nan_to_num(t), 0.0, 1.0)[:, None] * chord
            factor: Array = np.ones(width.size)
            if self._has_factor:
                factor = np.nan_to_num(np.maximum(inner @ m, 0.0) / _dots(inner, inner))
            inner *= factor[:, None]
            inner -= m
            near = np.sqrt(_dots(inner, inner))
            near = np.fmin(near, np.sqrt(np.minimum(self.samples.chi2[:-1], self.samples.chi2[1:])))
            # the worst case, a corner between straight parts, is off by half of the larger
            # difference
            off = []
            for end in (self.samples.slopes[:-1], self.samples.slopes[1:]):
                way = width[:, None] * end
                way -= chord
                off.append(np.sqrt(_dots(way, way)))
            largest = np.maximum(self.samples.factor[:-1], self.samples.factor[1:])
            error = 0.5 * largest * np.fmax(*off)
        width = np.where(np.isfinite(width), width, 0.0)
        return near, np.where(width > 0.0, error, 0.0), width

    def _minima(self) -> Array:
        """Return the places where chi2 turns from falling to rising, if it is allowed there and the
        dip is more than a ripple."""
        near, error, width = self._chords()
        ripple = _RIPPLE * (self.limit - self.samples.chi2.min())
        depth = self.samples.tilt[:-1] * width, self.samples.tilt[1:] * width
        turns = (depth[0] < -ripple) & (depth[1] > ripple)
        turns &= near - error < np.sqrt(self.limit)
        return self._zeros(np.flatnonzero(turns), lambda samples: samples.tilt, 1e-13, slopes=True)

    def _lowest_places(self) -> Array:
        """Return the places of least chi2 next to each allowed minimum among the samples.  The
        curve may have a kink between two samples, so their derivatives do not show this place."""
        s, here = self.samples.s, self.lowest()
        here = here[(self.samples.chi2[here] <= self.limit) & np.isfinite(s[here])]
        ends = np.flatnonzero(np.isfinite(s))[[0, -1]]
        low, high = (s[np.clip(here + side, *ends)] for side in (-1, 1))
        best, least, each = s[here].copy(), self.samples.chi2[here].copy(), np.arange(here.size)
        for _ in range(_LOWEST_ROUNDS if here.size else 0):
            places = np.linspace(low, high, _ZOOM, axis=1)
            chi2 = self.sample(places.ravel(), slopes=False).chi2.reshape(places.shape)
            j = np.argmin(chi2, axis=1)
            better = chi2[each, j] < least
            best, least = np.where(better, places[each, j], best), np.minimum(chi2[each, j], least)
            low, high = (places[each, np.clip(j + side, 0, _ZOOM - 1)] for side in (-1, 1))
        return best[least < self.samples.chi2[here] * (1.0 - _SAME)]

    def _zeros(
        self,
        chords: Places,
        quantity: Callable[[ProfileSamples], Array],
        tolerance: float,
        slopes: bool,
    ) -> Array:
        """Return the places in the given chords where a quantity is zero."""
        from scipy.optimize import brentq

        s, f = self.samples.s.tolist(), quantity(self.samples).tolist()

        def zero(i: int) -> float:
            # a second evaluation may differ from the first by a rounding error
            known = {s[i]: f[i], s[i + 1]: f[i + 1]}

            def value(place: float) -> float:
                if place in known:
                    return float(known[place])
                return float(quantity(self.sample(np.array([place]), slopes))[0])

            return float(brentq(value, s[i], s[i + 1], xtol=tolerance, rtol=1e-14))

        return np.array([zero(i) for i in chords.tolist()])

    # --- ranges -----------------------------------------------------------------------------------

    def ranges(self) -> list[tuple[float, float]]:
        """Return the smallest and the largest allowed value of e^s.  If there is a factor, return
        this for e^s times the factor, and for the factor.

        If the sample at infinite s is allowed, the first value has no upper bound.
        """
        samples, inside = self.samples, self.samples.chi2 <= self.limit
        finite = np.isfinite(samples.s)
        goals = _WITH_FACTOR if self._has_factor else _ALONE
        low, high = [math.inf] * (len(goals) // 2), [0.0] * (len(goals) // 2)
        if inside[finite].any():
            ends = self._ends(goals)
            low, high = [max(-end, 0.0) for end in ends[::2]], ends[1::2]
        if inside[-1]:
            low[0] = min(low[0], float(np.exp(samples.s[finite][-1]) * samples.factor[-1]))
            high[0] = math.inf
        if inside[-1] and self._has_factor:
            half = math.sqrt((self.limit - samples.chi2[-1]) / samples.rise[-1])
            low[1] = min(low[1], max(float(samples.factor[-1]) - half, 0.0))
            high[1] = max(high[1], float(samples.factor[-1]) + half)
        return [*zip(low, high, strict=True)]

    def _ends(self, goals: Sequence[Goal]) -> list[float]:
        """Return the largest value of each goal over the allowed contacts of finite s."""
        inside = self.samples.chi2 <= self.limit
        s = self._allowed_places(inside)
        samples = self.sample(s, slopes=False)
        starts = [int(np.argmax(self._values(goal, samples))) for goal in goals]
        low = np.array([s[max(i - 1, 0)] for i in starts])
        high = np.array([s[min(i + 1, s.size - 1)] for i in starts])
        best = [
            float(self._values(goal, samples)[i]) for goal, i in zip(goals, starts, strict=True)
        ]
        for _ in range(_ZOOMS if self._has_factor else 0):  # without a factor the ends are borders
            places = np.linspace(low, high, _ZOOM, axis=1)
            samples = self.sample(places.ravel(), slopes=False)
            for i, goal in enumerate(goals):
                values = self._values(goal, samples)[i * _ZOOM : (i + 1) * _ZOOM]
                j = int(np.argmax(values))
                best[i] = max(best[i], float(values[j]))
                low[i], high[i] = places[i, max(j - 1, 0)], places[i, min(j + 1, _ZOOM - 1)]
        return best

    def _values(self, goal: Goal, samples: ProfileSamples) -> Array:
        spare = self.limit - samples.chi2
        half_width = np.sqrt(np.maximum(spare, 0.0) / samples.rise)
        # at the border of the allowed range chi2 exceeds the limit by a rounding error
        allowed = spare >= -1e-9 * self.limit
        return np.where(allowed, goal(samples.s, samples.factor, half_width), -np.inf)

    def _allowed_places(self, inside: Bools) -> Array:
        """Return allowed finite places, ascending: samples, the borders of the allowed ranges, and
        places between them."""
        finite, limit = np.isfinite(self.samples.s), self.limit
        crossings = np.flatnonzero((inside[:-1] != inside[1:]) & finite[1:])
        borders = self._zeros(crossings, lambda samples: samples.chi2 - limit, 1e-9, slopes=False)
        s = np.unique(np.concatenate([self.samples.s[inside & finite], borders]))
        parts = 1 + _INSIDE // max(s.size, 1)
        between = np.linspace(s[:-1], s[1:], parts, endpoint=False).ravel()
        return np.unique(np.concatenate([s, between]))


def quantile(dof: int | None) -> float:
    """Return the half width of a 95 % interval in standard deviations, from Student's distribution
    or, without ``dof``, the normal distribution."""
    try:
        from scipy.special import ndtri, stdtrit
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(missing("fit", error), name=error.name) from None
    share = 0.5 + 0.5 * CONFIDENCE
    return float(ndtri(share) if dof is None or dof < 1 else stdtrit(dof, share))

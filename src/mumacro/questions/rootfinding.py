"""Where mu_macro, as a function of one input, reaches a level: bracketed Newton steps for many
levels at once.

All levels of one problem lie on one curve, so the curve is sampled once; a search in the samples
brackets every level, and Newton's method in the logarithm of the input, with the surrogate's
gradient, does the rest.  A step that leaves its bracket, that has no finite slope (plateaus, the
cusp of the static limit at y~ = 1) or that does not halve the last step is replaced by halving the
bracket: by its geometric mean, so that any scale is reached.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mumacro.kernel.arrays import Array, Bools, Places
from mumacro.questions.input_curve import InputCurve

TINY = 5e-324
_ROUNDING = 2.0**-52
_PER_CALL = 512
_MAX_SAMPLES = 20_001


class Branch:
    """A branch of a curve on which mu_macro is monotone: samples ``x`` (m,), ascending, and ``mu``
    (m,) there."""

    def __init__(self, curve: InputCurve, x: Array, mu: Array) -> None:
        self.curve, self.x, self.mu = curve, x, mu
        self.sign = 1.0 if mu[-1] >= mu[0] else -1.0
        # Rounding may make a plateau fall by a digit; a root is where its level is first reached.
        self._risen = np.maximum.accumulate(self.sign * mu)

    def holds(self, level: Array) -> Bools:
        """Which of the levels (n,) lie between the ends of the branch, these included."""
        low, high = sorted((float(self.mu[0]), float(self.mu[-1])))
        return np.asarray((level >= low) & (level <= high))

    def end(self) -> float:
        """Where the branch first has its last value: at its end, or where the plateau begins that
        ends it."""
        index = int(np.argmax(self.mu == self.mu[-1]))
        before, first_x = self.x[max(index - 1, 0) : index], self.x[index : index + 1]
        return float(
            last_double(lambda x: self.curve.mu(x) != self.mu[-1], before, first_x)[1][0]
            if index
            else first_x[0]
        )

    def meet(self, level: Array, leave: ArrayLike = False) -> Array:
        """Where mu_macro reaches the levels (n,), or where ``leave`` is true goes beyond them, (n,)
        [SI].

        To a rounding error of mu_macro; an end of the branch where it never does.
        """
        leaving = np.broadcast_to(np.asarray(leave, dtype=np.bool_), level.shape)
        first, beyond = (
            np.searchsorted(self._risen, self.sign * level, side) for side in ("left", "right")
        )
        j = np.where(leaving, beyond, first)
        inside = np.flatnonzero((j > 0) & (j < self.x.size))
        x: Array = np.where(j == 0, self.x[0], self.x[-1])
        if inside.size:
            x[inside] = self._newton(level[inside], j[inside], leaving[inside])
        return x

    def _newton(self, level: Array, j: Places, leave: Bools) -> Array:
        """The same for levels between the samples j - 1 and j, (n,)."""
        a, b = self.x[j - 1].copy(), self.x[j].copy()
        fa, fb = self.sign * (self.mu[j - 1] - level), self.sign * (self.mu[j] - level)
        start = np.log(np.maximum(a, TINY))
        width = np.log(b) - start
        x = np.exp(start + np.clip(fa / np.where(fb > fa, fa - fb, -1.0), 0.02, 0.98) * width)
        last = width.copy()  # the last step, in ln x
        roots: Array = np.empty_like(a)
        i = np.arange(level.size)
        while i.size:
            lower, upper = a[i], b[i]
            trial = np.where((x[i] > lower) & (x[i] < upper), x[i], _middle(lower, upper))
            answer, slope = self.curve.with_slope(trial)
            f, slope = self.sign * (np.asarray(answer.mu_macro) - level[i]), self.sign * slope
            below = (f < 0.0) | (leave[i] & (f == 0.0))
            a[i], fa[i] = np.where(below, trial, lower), np.where(below, f, fa[i])
            b[i], fb[i] = np.where(below, upper, trial), np.where(below, fb[i], f)
            steep = np.isfinite(slope) & (slope > 0.0)
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                step = np.where(steep, -f / np.where(steep, slope, 1.0), np.inf)
                proposal = trial * np.exp(np.clip(step, -1.0e3, 1.0e3))
                # a step below the spacing of doubles goes to the neighbour: near the cusp of the
                # static limit the level is not yet reached
                proposal = np.where(
                    proposal == trial, np.nextafter(trial, np.where(below, np.inf, 0.0)), proposal
                )
                is_newton = (
                    (proposal > a[i]) & (proposal < b[i]) & (2.0 * np.abs(step) <= np.abs(last[i]))
                )
                x[i] = np.where(is_newton, proposal, _middle(a[i], b[i]))
                last[i] = np.where(is_newton, step, np.log(x[i] / trial))
            at_level = steep & (np.abs(f) <= 2.0 * _ROUNDING * np.abs(level[i]))
            at_neighbours = np.nextafter(a[i], np.inf) >= b[i]
            roots[i] = np.where(
                at_level, trial, np.where(np.abs(fa[i]) < np.abs(fb[i]), a[i], b[i])
            )
            i = i[~(at_level | at_neighbours)]
        return roots


def samples(low: float, high: float, per_decade: int) -> Array:
    """Values > 0 from ``low`` to ``high``, ascending, evenly spread over the logarithm."""
    start, stop = math.log(max(low, TINY)), math.log(high)
    count = min(max(int((stop - start) / math.log(10.0) * per_decade), 64) + 1, _MAX_SAMPLES)
    with np.errstate(over="ignore"):
        return np.clip(np.exp(np.linspace(start, stop, count)), max(low, TINY), high)


def branches_between(curve: InputCurve, edges: list[float], x: Array, mu: Array) -> list[Branch]:
    """The monotone branches between ``edges`` (ascending), from samples ``x``, ``mu`` (n,) of the
    whole range."""
    edge_x = np.array(edges)
    ends = curve.mu(edge_x)
    branches = []
    for i in range(edge_x.size - 1):
        pair = slice(i, i + 2)
        inside = slice(
            np.searchsorted(x, edge_x[i], side="right"),
            np.searchsorted(x, edge_x[i + 1], side="left"),
        )
        # next to a turning point a sample may lie beyond it by a rounding error
        inner_mu = np.clip(mu[inside], ends[pair].min(), ends[pair].max())
        branches.append(
            Branch(curve, np.insert(edge_x[pair], 1, x[inside]), np.insert(ends[pair], 1, inner_mu))
        )
    return branches


def _middle(a: Array, b: Array) -> Array:
    """A double between ``a`` and ``b``, in the middle of their logarithms; ``a`` where they are
    neighbours."""
    middle = np.sqrt(np.maximum(a, TINY)) * np.sqrt(b)
    # the square roots of subnormal numbers keep fewer digits than the numbers have
    return np.where((middle > a) & (middle < b), middle, a + 0.5 * (b - a))


def _order_key(x: ArrayLike) -> NDArray[np.int64]:
    """Doubles >= 0 as integers of the same order.  Adding 0.0 turns -0.0, the smallest integer,
    into 0.0."""
    return (np.asarray(x, dtype=np.float64) + 0.0).view(np.int64)


def last_double(
    below: Callable[[Array], Bools], low: ArrayLike, high: ArrayLike
) -> tuple[Array, Array]:
    """Neighbouring doubles (a, b): the last with ``below`` true, the first with it false.

    For functions without a slope, such as a regime.  Cuts the *bits*: doubles of one sign are
    ordered like the integers with the same bits, so this ends at two neighbours, whatever the
    scale.  ``below``
    maps (n, m) values, row i for bracket i, to bool; from true at ``low`` (n,) to false at ``high``
    it changes once.
    """
    a, b = _order_key(low).copy(), _order_key(high).copy()
    rows = np.arange(a.size)
    # a call costs as much as some hundred points: few brackets are cut into many parts at once
    parts = min(max(_PER_CALL // max(a.size, 1), 2), 64)
    inner = np.arange(1, parts)
    while np.any(b - a > 1):
        step, rest = np.divmod(b - a, parts)
        cuts = a[:, None] + step[:, None] * inner + rest[:, None] * inner // parts
        count = np.argmin(
            np.column_stack((below(cuts.view(np.float64)), np.zeros(a.size, dtype=np.bool_))),
            axis=1,
        )
        ends: NDArray[np.int64] = np.column_stack((a, cuts, b))
        a, b = ends[rows, count], ends[rows, count + 1]
    return a.view(np.float64), b.view(np.float64)

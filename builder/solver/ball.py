"""Solve the ball: a quadrature over its springs, which are on a ray of the map of one spring.

The middle spring has V = v~/1.5 and Y = y~/1.5.  The spring at the fraction xi of the contact
radius has v~ = V/s and y~ = Y/s with s = 1 - xi^2:

    mu~(v~, y~) = 3/2 int_0^1 s mu~_spring(V/s, Y/s) d xi

and the power has another factor 1.5 s.  The ray is cut where a spring begins or ceases to stick and
at y~ = 1, where the corner makes a step of the width (V/Y)^(2/3).  On every piece the tanh-sinh
rule crowds its points towards both ends, so that roots, logarithms and steps there do no harm: it
converges like exp(-c n / ln n).  A spring is the interpolant of a table that is finer than the one
to be built, with 1 - mu~ known to its own digits.
"""

import itertools
import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from mumacro import Surrogate, TableError
from mumacro.kernel.arrays import Array
from mumacro.kernel.binding import kernels
from mumacro.table import atlas
from mumacro.table.atlas import MIDDLE, STEEPEST, STEEPEST_Y

CORNER = atlas.BLOCK_NAMES.index("corner")
#: results of a ball: every tabulated quantity, and 1 - mu~ with its own digits
NAMES = (*atlas.QUANTITY_NAMES, "deficit")
#: quantities of a spring that are also proportional to its length scale: one more factor s
_WITH_LENGTH = ("power",)
POINTS = 73  # points on either side of the middle of a piece
#: tolerance from which this number of points is enough
FEWER_POINTS = {1e-5: 34, 1e-8: 46}
LAST = 3.3  # limit of the rule's variable: beyond it weights are below 1e-17
BISECTIONS = 62  # from an interval of less than e^64 to its last digit
LONGEST = 4.0  # longest piece, in ln s
#: number of springs that are evaluated together
TOGETHER = 100_000


def _rule(points: int) -> tuple[Array, Array]:
    """Return for [0, 1] the distances from the left end, ascending, and weights, (2 points + 1,)
    each."""
    t = np.linspace(-LAST, LAST, 2 * points + 1)
    turn = math.pi * np.sinh(t)
    share = 1.0 / (1.0 + np.exp(-turn))
    weight = math.pi * np.cosh(t) * share / (1.0 + np.exp(turn)) * (t[1] - t[0])
    return share, weight


def points_for(tolerance: float) -> int:
    """Return the number of points on either side with which a quadrature error is far below
    ``tolerance``."""
    return next((points for least, points in FEWER_POINTS.items() if tolerance >= least), POINTS)


class Springs:
    """Evaluate one spring at many points from the table of ``fine``: :data:`NAMES`.

    Raises
    ------
    TableError
        If the table is older than one of the quantities.
    """

    def __init__(self, fine: Surrogate) -> None:
        absent = [name for name in atlas.QUANTITY_NAMES if name not in fine.table.quantities]
        if absent:
            reason = f"has no {', '.join(absent)}: build this table anew, before any coarser one"
            raise TableError(fine.path, reason)
        self.fine = fine
        for name in atlas.QUANTITY_NAMES:
            self._data = fine.tabulated.data(name)  # one object for all, which then has the cells

    def crit(self, y: Array) -> Array:
        """Return v~crit of one spring."""
        return self.fine.border(y)

    def __call__(self, v: Array, y: Array, eta: Array) -> dict[str, Array]:
        """Return results at points (n,) with v~, y~ > 0, finite; eta = y~ - 1 is used in the
        corner."""
        block, a, b = kernels[-1].places(self._data, v, y)
        i = np.flatnonzero(block == CORNER)
        a[i], b[i] = _corner(v[i], eta[i])
        out = {name: np.zeros(v.size) for name in NAMES}
        charts = atlas.CHARTS["spring"]
        for index in np.unique(block):
            i = np.flatnonzero(block == index)
            vs, ys = v[i], y[i]
            if index >= len(charts):
                for name in atlas.QUANTITY_NAMES:
                    out[name][i] = self.fine.quantity(name, vs, ys)[0]
                out["deficit"][i] = _fast_deficit(vs, ys)
                continue
            for code, quantity in enumerate(atlas.QUANTITIES):
                if not charts[index].holds(quantity):
                    continue
                base, factor = kernels[-1].forms(code, int(index), vs, ys, eta[i])
                q = kernels[-1].tabulated(self._data, code, int(index), a[i], b[i])
                out[quantity.name][i] = base + factor * q
                if code == atlas.MU:
                    plain = 1.0 - base - factor * q
                    out["deficit"][i] = np.where(base == 1.0, -factor * q, plain)
        return out


def _corner(v: Array, eta: Array) -> tuple[Array, Array]:
    """Return the corner's coordinates as the evaluation has them, without a rounded y~ in
    between."""
    phi = kernels[-1].normal_form_root(v, eta)
    s0 = np.sqrt(2.0 * math.pi * v / phi)
    radius = np.sqrt(0.5 * s0 * s0 + 2.0 * phi * phi)
    return radius, 2.0 * phi / (math.sqrt(2.0) * radius + s0)


def _fast_deficit(v: Array, y: Array) -> Array:
    """Return 1 - mu~ for large v~, with its own digits."""
    share = 1.0 / (1.0 + v * v)
    r = y / np.hypot(1.0, v)
    n = np.square(np.minimum(r, 1.0))
    terms, total = np.ones_like(n), np.zeros_like(n)
    for k in range(1, 24):  # (2/pi) K(i r) in powers of r^2
        terms = terms * -n * ((2 * k - 1) / (2 * k)) ** 2
        total = total - terms
    expansion = kernels[-1].outer_expansion(r)
    return np.where(
        n < 0.1,
        total - (expansion[:, 1] + 0.5 * expansion[:, 2]) * share,
        1.0 - _mu_fast(expansion, share),
    )


def _mu_fast(expansion: Array, share: Array) -> Array:
    return expansion[:, 0] + (expansion[:, 1] + 0.5 * expansion[:, 2]) * share


class Ball:
    """Solve the ball at many points (V, Y) of its middle spring."""

    def __init__(self, springs: Springs, points: int = POINTS, workers: int = 1) -> None:
        self.springs = springs
        self._pool = ThreadPoolExecutor(max_workers=workers)
        self._share, self._weight = _rule(points)

    def crossings(self, ratio: Array) -> tuple[Array, Array]:
        """Return y~ at which rays V/Y = ``ratio`` (n,), below the steepest ray, enter stick-slip
        and leave it."""
        steep = math.log(STEEPEST_Y)
        low, high = np.log(1.5 * ratio), np.full(ratio.shape, steep)
        entry = self._bisect(ratio, np.minimum(low, steep - 1e-9), high, 1.0)
        top = np.log(np.maximum(0.4 / (ratio * ratio), STEEPEST_Y * 1.000001))
        return entry, self._bisect(ratio, np.full(ratio.shape, steep), top, -1.0)

    def _bisect(self, ratio: Array, low: Array, high: Array, rising: float) -> Array:
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            y = np.exp(middle)
            below = rising * (self.springs.crit(y) / y - ratio) < 0.0
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return np.exp(0.5 * (low + high))

    def _edges(self, v: Array, y: Array) -> Array:
        """Return values of s (n, edges), descending from 1 to 0, between which springs are smooth
        and of similar size."""
        ratio = v / y
        cuts = ratio < STEEPEST * (1.0 - 1e-15)
        entry, leave = self.crossings(np.where(cuts, ratio, 0.1))
        inner, outer = (np.where(cuts, y / bound, 1.0) for bound in (entry, leave))
        last = np.where(cuts, outer, np.maximum(v, y))
        width = np.minimum(3.0 * np.cbrt(ratio * ratio), 0.5)
        beyond = np.minimum(np.maximum(width, 3.0 * np.abs(y - 1.0)), 0.5)
        # beyond the corner xi grows by a factor of ten from piece to piece
        rising = (y / (1.0 + np.minimum(beyond * 100.0**i, 0.5)) for i in range(5))
        steps = (inner, y / (1.0 - width), y, y / (1.0 + width), *rising, last)
        # springs beyond the border's last crossing may be on this side of it, next to the ridge
        edges = -np.sort(-np.minimum([np.ones(v.shape), *steps], 1.0), axis=0)
        decades = [edges[0]]
        for above, below in itertools.pairwise(edges):
            parts = math.ceil(float(np.log(above / below).max()) / LONGEST)
            decades += [
                np.maximum(above * math.exp(-LONGEST * i), below) for i in range(1, parts)
            ] + [below]
        return np.stack([*decades, np.zeros(v.shape)], axis=1)

    def solve(self, v: Array, y: Array, eta: Array | None = None) -> dict[str, Array]:
        """Return :data:`NAMES` at V = ``v``, Y = ``y``, which have the same shape; eta = Y - 1."""
        v, y = np.broadcast_arrays(v, y)
        shape = v.shape
        eta = y - 1.0 if eta is None else np.broadcast_to(eta, shape)
        v, y, eta = (np.ascontiguousarray(x, np.float64).ravel() for x in (v, y, eta))
        step = max(1, TOGETHER // (4 * self._share.size))
        parts = self._pool.map(
            lambda i: self._solve(v[i : i + step], y[i : i + step], eta[i : i + step]),
            range(0, v.size, step),
        )
        rows = np.concatenate([np.empty((len(NAMES), 0)), *parts], axis=1)
        return {name: row.reshape(shape) for name, row in zip(NAMES, rows, strict=True)}

    def _solve(self, v: Array, y: Array, eta: Array) -> Array:
        edges, out = self._edges(v, y), np.zeros((len(NAMES), v.size))
        # xi and 1 - xi of the edges, each with its own digits; eta = y - 1 has the digits of s = y
        at_corner = edges == y[:, None]
        complement = np.where(at_corner, -eta[:, None], 1.0 - edges)
        xi_of = np.sqrt(complement)
        rest_of = edges / (1.0 + xi_of)
        for piece in range(edges.shape[1] - 1):
            present = np.flatnonzero(edges[:, piece] > edges[:, piece + 1])
            if not present.size:
                continue
            left, right, last = (
                xi_of[present, piece, None],
                xi_of[present, piece + 1, None],
                rest_of[present, piece + 1, None],
            )
            length = np.where(left > 0.5, rest_of[present, piece, None] - last, right - left)
            before, behind = length * self._share, length * self._share[::-1]
            first_half = self._share < 0.5
            xi = np.where(first_half, left + before, right - behind)
            rest = np.where(first_half & (left < 0.5), 1.0 - xi, last + behind)
            s = np.maximum(rest * (1.0 + xi), 1e-290)
            # Y - s from the distance to the corner if the corner is an edge, and beyond it
            excess = np.where(s > 0.01, eta[present, None] + xi * xi, np.inf)
            excess = np.where(at_corner[present, piece, None], before * (xi + left), excess)
            excess = np.where(at_corner[present, piece + 1, None], -behind * (xi + right), excess)
            near = np.abs(excess) < 0.3 * s
            amplitude = np.where(near, 1.0 + excess / s, y[present, None] / s)
            off = np.where(near, excess / s, amplitude - 1.0)
            integrands = self.springs(
                (v[present, None] / s).ravel(), amplitude.ravel(), off.ravel()
            )
            share = MIDDLE * s * length * self._weight
            for row, name in zip(out, NAMES, strict=True):
                weight = share * MIDDLE * s if name in _WITH_LENGTH else share
                row[present] += (integrands[name].reshape(s.shape) * weight).sum(axis=1)
        return out

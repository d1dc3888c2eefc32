"""Many points at once: the same answers as :mod:`friction.kernels`, in passes that the compiler turns into vector code.

A point's way through the blocks is a chain of branches that a processor cannot foresee; here a chunk of points goes
through them together.  Coordinates of every kind are computed for all, and selected; a number of a table then says
which cells to use.  What is rare or needs a closed form (the corner, both tails, zero and extreme inputs) is listed
on the way and answered one by one by :func:`friction.kernels.ratio`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from friction.floats import log, square_plus
from friction.kernels import (
    C_HIGH,
    C_LOW,
    C_MID_1,
    C_MID_2,
    DENORMAL,
    RHO_MAX,
    ROUNDING,
    S_HIGH,
    S_LOW,
    S_MID,
    S_MID_1,
    S_MID_2,
    SIGMA_CUT,
    SQRT2,
    WIDTH,
    Y_CONT,
    Y_HIGH,
    Y_MID,
    Y_STICK_LO,
    Y_TAIL,
    Array,
    fast,
    ratio,
)  # fmt: skip
from friction.outer import FUSE
from friction.patch_simd import patch_value

__all__ = ["CHUNK", "evaluate_chunk", "plan", "ratio_array", "scratch", "value_array"]

CHUNK = 256  # points that go through the passes together: their scratch stays in the fastest cache
Ints = NDArray[np.int64]

# block by twice the number of seams below y~, plus one in continuous sliding; the last is for points listed as rare
_BLOCK = np.array([S_LOW, C_LOW, S_MID, C_LOW, S_MID_1, C_MID_1, S_MID_2, C_MID_2, S_HIGH, C_HIGH, C_LOW])
_RARE = _BLOCK.size - 1
_FIRST_LOGARITHM = 4
_TINY, _HUGE = 1e-150, 1e150  # squares of what lies between are normal numbers
_SPEED_TINY = 1e-290


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def plan(meta: Array) -> Array:
    """What the passes look up (kinds, 8): pace and offset along a and b, first patch, patches a step, error, floor.

    The bound of an answer is the error times |factor|, plus the floor.
    """
    out = np.empty((_BLOCK.size, 8))
    for k in range(_BLOCK.size):
        m = meta[_BLOCK[k]]
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = m[4], m[3], m[6], m[5]
        out[k, 4], out[k, 5], out[k, 6] = m[0], m[2], m[7]
        out[k, 7] = ROUNDING if k < _FIRST_LOGARITHM else (0.0 if k & 1 else DENORMAL)
    return out


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def _amplitudes(y: Array, bmeta: Array, cell: Ints, local: Array, scale: Array, level: Array) -> None:
    """The border's cell, coordinate in it and scale, and the logarithm of y~ (anything legal where y~ is rare)."""
    offset0, pace0, offset1, pace1 = bmeta[0, 2], bmeta[0, 3], bmeta[1, 2], bmeta[1, 3]
    above = np.int64(bmeta[1, 0])
    for i in range(y.size):
        given = y[i]
        a = given if (given > _TINY) & (given <= Y_TAIL) else 1.0
        y2 = a * a
        ln = log(a)
        small = a <= Y_CONT
        x = y2 * pace0 + offset0 if small else ln * pace1 + offset1
        j = np.int64(x)
        cell[i] = j + (0 if small else above)
        local[i] = 2.0 * (x - j) - 1.0
        scale[i] = 0.5 * y2 if small else 1.0
        level[i] = ln


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def _borders(n: int, cell: Ints, local: Array, bcoef: Array, crit: Array) -> None:
    """Turn the scale in ``crit`` into v~crit."""
    for i in range(n):
        j, u = cell[i], local[i]
        r: float = bcoef[j, 0]
        for k in range(1, WIDTH):
            r = r * u + bcoef[j, k]
        crit[i] *= r


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def _places(
    v: Array, y: Array, crit: Array, level: Array,
    kind: Ints, a: Array, b: Array, base: Array, factor: Array,
) -> None:  # fmt: skip
    """The kind of block and the coordinates in it, with mu~ = base + factor q(a, b)."""
    for i in range(v.size):
        speed, amplitude = v[i], y[i]
        rho = speed / crit[i]
        y2 = amplitude * amplitude
        sliding = rho >= 1.0
        small = amplitude <= Y_CONT
        lowest = amplitude <= Y_STICK_LO
        half = rho < 0.5
        # one division and one root do for all blocks
        share = 1.0 / (square_plus(speed, 1.0 if small else y2) if sliding else amplitude)
        root = math.sqrt(speed * speed * share if sliding else (rho if half else 1.0 - rho))
        sigma = root if half else SQRT2 - root
        beyond = 1.0 - share if small else log(rho)
        along = amplitude if (small & (not lowest) & (not sliding)) else (y2 if small else level[i])
        across = beyond if sliding else sigma
        deficit = lowest | (small & sliding)
        common = (
            (speed > _SPEED_TINY) & (speed < _HUGE) & (amplitude > _TINY) & (amplitude <= Y_TAIL)
            & (small | (rho <= RHO_MAX))
            & ((not small) | lowest | (sigma >= SIGMA_CUT) | sliding)
        )  # fmt: skip
        seams = (
            np.int64(amplitude > Y_STICK_LO) + np.int64(amplitude > Y_CONT)
            + np.int64(amplitude > Y_MID) + np.int64(amplitude > Y_HIGH)
        )  # fmt: skip
        k = 2 * seams + np.int64(sliding)
        kind[i] = k if common else _RARE
        a[i] = along if common else 0.0
        b[i] = across if common else 0.0
        f = y2 * (-0.25 * share if sliding else -1.0)
        g = root if sliding else (1.0 if small else speed * share)
        factor[i] = f if deficit else g
        base[i] = 1.0 if deficit else 0.0


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def _cells(n: int, kind: Ints, table: Array, a: Array, b: Array, patch: Ints, rare: Ints) -> int:
    """Patch numbers; turn (a, b) into local coordinates; list the rare points and return how many they are."""
    found = 0
    for i in range(n):
        k = kind[i]
        x = a[i] * table[k, 0] + table[k, 1]
        z = b[i] * table[k, 2] + table[k, 3]
        p, q = np.trunc(x), np.trunc(z)
        patch[i] = np.int64(table[k, 4] + p * table[k, 5] + q)
        a[i] = 2.0 * (x - p) - 1.0
        b[i] = 2.0 * (z - q) - 1.0
        rare[found] = i
        found += int(k == _RARE)
    return found


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def _values(coef: Array, patch: Ints, u: Array, w: Array, base: Array, factor: Array, mu: Array) -> None:
    for i in range(mu.size):
        x = base[i] + factor[i] * patch_value(coef, patch[i], u[i], w[i])
        x = x if x > 0.0 else 0.0
        mu[i] = x if x < 1.0 else 1.0


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def _bounds(kind: Ints, table: Array, factor: Array, bound: Array, source: NDArray[np.int8]) -> None:
    for i in range(bound.size):
        k = kind[i]
        bound[i] = abs(factor[i]) * table[k, 6] + table[k, 7]
        source[i] = _BLOCK[k]


@njit(cache=True, error_model="numpy", nogil=True)
def scratch() -> tuple[Array, Ints]:
    """What one chunk needs besides its inputs and outputs."""
    return np.empty((6, CHUNK)), np.empty((3, CHUNK + 1), np.int64)


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def evaluate_chunk(
    v: Array, y: Array, coef: Array, meta: Array, bcoef: Array, bmeta: Array,
    table: Array, floats: Array, ints: Ints, mu: Array, bound: Array, source: NDArray[np.int8],
) -> None:  # fmt: skip
    """Answer up to CHUNK points; ``bound`` and ``source`` are filled only where they are not empty.

    Points must be legal (v~ >= 0, 0 <= y~ < infinity) to be answered; others give NaN and the source -1.
    """
    n = v.size
    crit, level, a, b, base, factor = floats[0], floats[1], floats[2], floats[3], floats[4], floats[5]
    kind, patch, rare = ints[0], ints[1], ints[2]
    _amplitudes(y, bmeta, patch, a, crit, level)
    _borders(n, patch, a, bcoef, crit)
    _places(v, y, crit, level, kind, a, b, base, factor)
    found = _cells(n, kind, table, a, b, patch, rare)
    _values(coef, patch, a, b, base, factor, mu)
    told = bound.size > 0
    if told:
        _bounds(kind, table, factor, bound, source)
    for j in range(found):
        i = rare[j]
        # between these amplitudes nothing but a large speed is rare
        if Y_CONT < y[i] <= Y_TAIL and _SPEED_TINY < v[i] < _HUGE:
            s, _, _, m, _, e = fast(v[i], y[i])
        elif v[i] >= 0.0 and 0.0 <= y[i] < math.inf:
            m, e, s = ratio(v[i], y[i], coef, meta, bcoef, bmeta)
        else:
            m, e, s = math.nan, math.nan, -1
        mu[i] = m
        if told:
            bound[i] = e
            source[i] = s


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, parallel=True)
def ratio_array(
    v: Array, y: Array, coef: Array, meta: Array, bcoef: Array, bmeta: Array,
    mu: Array, bound: Array, source: NDArray[np.int8],
) -> None:  # fmt: skip
    """Fill ``mu``, ``bound``, ``source`` (n,) for the points (``v``, ``y``) (n,); see :func:`evaluate_chunk`."""
    n = v.size
    table = plan(meta)
    for c in prange((n + CHUNK - 1) // CHUNK):
        floats, ints = scratch()
        a = c * CHUNK
        b = min(a + CHUNK, n)
        evaluate_chunk(
            v[a:b], y[a:b], coef, meta, bcoef, bmeta, table, floats, ints, mu[a:b], bound[a:b], source[a:b]
        )  # fmt: skip


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def value_array(
    v: Array, y: Array, coef: Array, meta: Array, bcoef: Array, bmeta: Array, mu: Array
) -> None:  # fmt: skip
    """Fill ``mu`` (n,) alone: the dimensionless fast path.  NaN where the point is outside the quadrant."""
    ratio_array(v, y, coef, meta, bcoef, bmeta, mu, np.empty(0), np.empty(0, np.int8))

"""The compiled evaluation loop: from (v~, y~) to mu~, its error bound and where it came from.

Every block is cut into cells; each cell holds a polynomial of degree DEGREE in both local coordinates u, w in [-1, 1]
as power-basis coefficients.  The coordinates are those of :mod:`friction.regions`.  Nothing here validates: callers do.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from friction import regions as _r
from friction.floats import log, square_plus
from friction.outer import FUSE, QUICK_MAX, outer_expansion, outer_quick
from friction.patch_simd import patch_value

Array = NDArray[np.float64]

DEGREE = 7
WIDTH = DEGREE + 1
ROUNDING = 2e-15  # of coordinates, Horner sums and the inputs' last digits, relative to the scale of the answer
CONTINUOUS_ROUNDING = 6.0 * ROUNDING  # the same, relative to the factor, where coordinates are logarithms
STICK_ROUNDING = 16.0 * ROUNDING
DENORMAL = 1e-306  # what an answer may lose where it leaves the normal range of double precision

Y_CONT, Y_MID, Y_HIGH, Y_TAIL = _r.Y_CONT, _r.Y_MID, _r.Y_HIGH, _r.Y_TAIL
Y_STICK_LO, L_MAX, RHO_MAX = _r.Y_STICK_LO, _r.L_MAX, _r.RHO_MAX
C_LOW, C_MID_1, C_MID_2, C_HIGH, C_TAIL = 0, 1, 2, 3, 4
S_LOW, S_MID, CORNER, S_MID_1, S_MID_2, S_HIGH, S_TAIL = 5, 6, 7, 8, 9, 10, 11
FAST, NO_OSCILLATION, STATIC_LIMIT = _r.FAST, _r.NO_OSCILLATION, _r.STATIC_LIMIT
FAST_KAPPA = math.exp(L_MAX)
SIGMA_CUT = _r.SIGMA_CUT
CUSP = math.sqrt(2.0 * ROUNDING)
TWO_OVER_PI = 2.0 / math.pi
SQRT2 = math.sqrt(2.0)
NO_PATCH = FAST  # sources from here on are closed forms

# forceinline: numba returns tuples through memory from a call, which costs more than the work itself.


def rounding_of(spec: _r.BlockSpec) -> float:
    """What a block's error bound takes for rounding relative to its factor: logarithms have lost some digits."""
    if spec.a_name != "ln_y":
        return 0.0
    return CONTINUOUS_ROUNDING if spec.regime == _r.CONTINUOUS else STICK_ROUNDING


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def normal_form_root(v: float, eta: float) -> float:
    """Positive root phi of phi^3 + 2 eta phi = pi v, v > 0: a guess right in every limit, then Halley's method.

    The guess is off by 28 % at most, and three steps of third order take that to rounding.
    """
    c, p = math.pi * v, 2.0 * eta
    root = np.cbrt(c)
    phi: float = c / (p + root * root) if eta >= 0.0 else math.sqrt(root * root - p)
    for _ in range(3):
        slope = 3.0 * phi * phi + p
        newton = (phi * (phi * phi + p) - c) / slope
        phi -= newton / (1.0 - 3.0 * phi * newton / slope)
    return phi


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, forceinline=True)
def _line(coef: Array, bmeta: Array, piece: int, a: float) -> float:
    """One piece of the border; ``coef`` (cells in all pieces, WIDTH), highest power first."""
    x = a * bmeta[piece, 3] + bmeta[piece, 2]
    j = np.trunc(x)
    u = 2.0 * (x - j) - 1.0
    i = int(bmeta[piece, 0] + j)
    r: float = coef[i, 0]
    for k in range(1, WIDTH):
        r = r * u + coef[i, k]
    return r


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, forceinline=True)
def cell(meta: Array, block: int, a: float, b: float) -> tuple[int, float, float]:
    """Patch number and local coordinates u, w in [-1, 1] of the block coordinates (a, b).

    ``meta`` (blocks, 8): first patch, cells in a, cells in b, offset and pace of a, offset and pace of b, error, as
    :func:`friction.patches.pace_of` gives them.
    """
    x = a * meta[block, 4] + meta[block, 3]
    z = b * meta[block, 6] + meta[block, 5]
    # an offset's rounding may leave a coordinate at the near end below zero: truncation keeps it in the first cell
    i, j = np.trunc(x), np.trunc(z)
    return int(meta[block, 0] + i * meta[block, 2] + j), 2.0 * (x - i) - 1.0, 2.0 * (z - j) - 1.0


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def border_scaled(y: float, bcoef: Array, bmeta: Array) -> tuple[float, float]:
    """v~crit = value * scale, as (value, scale): y~^2/2, 1 or sqrt(y~) is the scale.

    ``bmeta`` (3, 4): first cell, cells, offset and pace of each piece of the border.
    """
    if y <= Y_CONT:
        w = y * y
        return _line(bcoef, bmeta, 0, w), 0.5 * w
    k, a, scale = (1, log(y), 1.0) if y <= Y_TAIL else (2, 1.0 / y, math.sqrt(y))
    return _line(bcoef, bmeta, k, a), scale


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, forceinline=True)
def edge_coordinate(rho: float) -> float:
    """sigma in [0, sqrt 2] for rho = v~/v~crit in [0, 1]: sqrt(rho), then sqrt 2 - sqrt(1 - rho) from rho = 1/2 on.

    Both square-root edges become smooth, as with s = (2/pi) asin sqrt(rho) of the table file, for one square root;
    sigma is analytic in s on either half, and the knot between them is an edge of cells.
    """
    return math.sqrt(rho) if rho < 0.5 else SQRT2 - math.sqrt(1.0 - rho)


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def polar(v: float, eta: float) -> tuple[float, float, float, float]:
    """Corner coordinates (phi, s0, R, tan(psi/2)): R sin psi = sqrt 2 phi, R cos psi = s0/sqrt 2, s0^2 = 2 pi v/phi.

    The tangent of half the angle is analytic in it, runs from 0 to 1 as well, and costs a division.
    """
    phi = normal_form_root(v, eta)
    squared = 2.0 * math.pi * v / phi
    s0 = math.sqrt(squared)
    radius = math.sqrt(0.5 * squared + 2.0 * phi * phi)
    return phi, s0, radius, 2.0 * phi / (SQRT2 * radius + s0)


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, forceinline=True)
def locate(v: float, y: float, bcoef: Array, bmeta: Array) -> tuple[int, float, float, float, float, float]:
    """Where (v~, y~) falls: (source, a, b, base, factor, extra) with mu~ = base + factor q(a, b).

    ``v`` > 0 and 0 < ``y`` < infinity.  ``extra`` is what the answer may be wrong by beyond the error of q: rounding,
    the last digit of the inputs, and for closed forms the next term.  A source from NO_PATCH on has no q.
    """
    if y <= Y_CONT:
        w = y * y
        rho = v / (0.5 * w * _line(bcoef, bmeta, 0, w))
        if rho >= 1.0:
            if v > 1e150:
                return C_LOW, w, 1.0, 1.0, 0.0, ROUNDING
            rest = 1.0 / square_plus(v, 1.0)
            return C_LOW, w, 1.0 - rest, 1.0, -0.25 * w * rest, ROUNDING
        b = edge_coordinate(rho)
        if y <= Y_STICK_LO:
            return S_LOW, w, b, 1.0, -w, ROUNDING
        if b >= SIGMA_CUT:
            return S_MID, y, b, 0.0, 1.0, ROUNDING
        eta = y - 1.0
        phi, _, radius, angle = polar(v, eta)
        # one ulp of y~ and of v~ next to the corner: d phi / d eta = -2 phi / (3 phi^2 + 2 eta), and never more than
        # the cusp itself gives, phi(eta - d) <= phi(eta) + sqrt(2 d)
        shaken = ROUNDING * phi + min(ROUNDING * phi / (3.0 * phi * phi + 2.0 * eta), CUSP)
        return CORNER, radius, angle, 0.0, phi, shaken
    if y > Y_TAIL:
        return _beyond(v, y, bcoef, bmeta)
    t = log(y)
    rho = v / _line(bcoef, bmeta, 1, t)
    if rho > RHO_MAX:
        return fast(v, y)
    if rho >= 1.0:
        k = C_MID_1 if y <= Y_MID else (C_MID_2 if y <= Y_HIGH else C_HIGH)
        share = 1.0 / square_plus(v, y * y)
        return k, t, log(rho), 0.0, math.sqrt(v * v * share), 0.0
    k = S_MID_1 if y <= Y_MID else (S_MID_2 if y <= Y_HIGH else S_HIGH)
    return k, t, edge_coordinate(rho), 0.0, v * (1.0 / y), DENORMAL


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def fast(v: float, y: float) -> tuple[int, float, float, float, float, float]:
    """:func:`locate` for large v~: two terms in closed form."""
    # (35) at y~ / sqrt(1 + v~^2) is exact to O(y~^2) at every v~; what it takes from the second term is half r f'
    if max(v, y) < 1e150:
        share = 1.0 / (1.0 + v * v)
        t = 1.0 + y * y * share
    else:
        share, t = 0.0, 1.0 + (y / v) * (y / v)
    if t < QUICK_MAX:
        first, rest = outer_quick(t)
    else:
        first, second, slope, _, _ = outer_expansion(y / math.hypot(v, 1.0))
        rest = second + 0.5 * slope
    correction = rest * share
    # the next term is smaller by (y~/v~^2)^2 where y~ > v~, by 1/v~^2 elsewhere
    small = max(y / v / v, 1.0 / v)
    bound = 4.0 * abs(correction) * small * small + ROUNDING * first
    return FAST, 0.0, 0.0, min(first + correction, 1.0), 0.0, bound


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def _beyond(v: float, y: float, bcoef: Array, bmeta: Array) -> tuple[int, float, float, float, float, float]:
    """:func:`locate` for y~ > Y_TAIL: the outer solution carries the logarithm, the block what the layers add."""
    a = 1.0 / y
    root = math.sqrt(y)
    crit = root * _line(bcoef, bmeta, 2, a)
    if v > FAST_KAPPA * root:
        return fast(v, y)
    factor = v / y
    if factor == 0.0:
        return S_TAIL, a, 0.0, 0.0, 0.0, 0.0
    first, _, _, _, _ = outer_expansion(1.0 / factor)
    extra = 8.0 * ROUNDING * first
    if v >= crit:
        return C_TAIL, a, math.log(v / root), first, factor, extra
    base = first + factor * TWO_OVER_PI * math.log(v / root)
    return S_TAIL, a, edge_coordinate(v / crit), base, factor, extra + STICK_ROUNDING * factor


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def at_zero_speed(y: float) -> tuple[float, float]:
    """Static limit, eq. (16), and the bound of its rounding."""
    if y >= 1.0:
        return 0.0, 0.0
    mu = math.sqrt((1.0 - y) * (1.0 + y))
    return mu, ROUNDING / mu


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, forceinline=True)
def ratio(v: float, y: float, coef: Array, meta: Array, bcoef: Array, bmeta: Array) -> tuple[float, float, int]:
    """(mu~, bound of its absolute error, source) at v~ = ``v`` >= 0, y~ = ``y`` >= 0; v~ may be infinite, y~ not."""
    if y == 0.0 or v == math.inf:
        return 1.0, 0.0, NO_OSCILLATION if y == 0.0 else FAST
    if v == 0.0:
        mu, bound = at_zero_speed(y)
        return mu, bound, STATIC_LIMIT
    source, a, b, base, factor, extra = locate(v, y, bcoef, bmeta)
    if source >= NO_PATCH:
        return base, extra, source
    p, u, w = cell(meta, source, a, b)
    mu = base + factor * patch_value(coef, p, u, w)
    return min(max(mu, 0.0), 1.0), abs(factor) * meta[source, 7] + extra, source

"""The compiled evaluation loop: from (v~, y~) to mu~, its error bound and where it came from.

Every block is cut into cells; each cell holds a polynomial of degree DEGREE in both local coordinates u, w in [-1, 1]
as power-basis coefficients.  The coordinates are those of :mod:`friction.regions`.  Nothing here validates: callers do.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from friction import regions as _r
from friction.patch_simd import patch_value

Array = NDArray[np.float64]

DEGREE = 7
WIDTH = DEGREE + 1
ROUNDING = 2e-15  # of coordinates, Horner sums and the inputs' last digits, relative to the scale of the answer

Y_CONT, Y_MID_C, Y_MID_S, Y_HIGH, Y_TAIL = _r.Y_CONT, _r.Y_MID_C, _r.Y_MID_S, _r.Y_HIGH, _r.Y_TAIL
Y_STICK_LO, Y_STICK_HI, L_MAX = _r.Y_STICK_LO, _r.Y_STICK_HI, _r.L_MAX
C_LOW, C_MID_1, C_MID_2, C_HIGH, C_TAIL = 0, 1, 2, 3, 4
S_LOW, S_MID, CORNER, S_MID_1, S_MID_2, S_HIGH, S_TAIL = 5, 6, 7, 8, 9, 10, 11
FAST, NO_OSCILLATION, STATIC_LIMIT = _r.FAST, _r.NO_OSCILLATION, _r.STATIC_LIMIT
FAST_KAPPA = math.exp(L_MAX)
SIGMA_CUT = _r.SIGMA_CUT
CUSP = math.sqrt(2.0 * ROUNDING)
TWO_OVER_PI = 2.0 / math.pi
SQRT2 = math.sqrt(2.0)
NO_PATCH = FAST  # sources from here on are closed forms

# Fused multiply-add changes the last digit and nothing else; no other liberty is taken with the arithmetic.
FUSE = {"contract"}
# forceinline: numba returns tuples through memory from a call, which costs more than the work itself.
CHUNK = 512  # points whose places are found before their patches are read: mispredicted branches then stall no loads


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def outer_expansion(r: float) -> tuple[float, float, float, float, float]:
    """Two terms of mu~ = f(r) + g(r)/v~^2 + ... for v~ -> infinity: f, g, r f', r g', r (r f')'; r = y~/v~ >= 0.

    f = (2/pi) K(i r) is eq. (35); g = r^2 <sin^2 (1/2 - r^2 cos^2) (1 + r^2 cos^2)^(-7/2)>.
    """
    h = math.hypot(1.0, r)
    q = 1.0 / h  # sqrt(1 - m) with m = r^2 / (1 + r^2)
    if q == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    m = (r * q) * (r * q)
    a, g, power, total = 1.0, q, 0.5, 0.5 * m
    for _ in range(64):
        c = 0.5 * (a - g)
        a, g = 0.5 * (a + g), math.sqrt(a * g)
        power *= 2.0
        total += power * c * c
        if c <= 1e-9 * a:
            break
    k = 1.0 / a  # (2/pi) K(m)
    e = k * (1.0 - total)
    q2 = q * q
    # q^p <(1 - m sin^2)^(-p/2)> without the powers of q, by the recurrence in p
    i5 = (2.0 * (2.0 - m) * e - q2 * k) / 3.0
    i7 = (4.0 * (2.0 - m) * i5 - 3.0 * q2 * e) / 5.0
    i9 = (6.0 * (2.0 - m) * i7 - 5.0 * q2 * i5) / 7.0
    second = (1.5 * i7 - m * i5) * h + q * (e - 2.5 * i5)
    # d J_p / d ln r = -p (J_p - J_(p+2)), J_p = <(1 + r^2 cos^2)^(-p/2)>: J3 = q e, J5 = q i5, J7 = q i7, J9 = q i9
    # with (1 + r^2) = h^2 taken into i7 and i9
    slope = (
        3.0 * m * i7 * h - 10.5 * (i7 - i9) * h - 2.0 * m * i5 * h
        + 5.0 * (m * h + 2.5 * q) * (i5 - i7) - 3.0 * q * (e - i5)
    )  # fmt: skip
    return k * q, second, q * (e - k), slope, q * (k - e - 3.0 * (e - i5))


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def normal_form_root(v: float, eta: float) -> float:
    """Positive root phi of phi^3 + 2 eta phi = pi v: Newton from above, where the cubic is convex."""
    c = math.pi * v
    phi: float = c ** (1.0 / 3.0)
    if eta > 0.0:
        phi = min(phi, c / (2.0 * eta))
    else:
        phi += math.sqrt(-2.0 * eta)
    for _ in range(60):
        f = phi * (phi * phi + 2.0 * eta) - c
        new = phi - f / (3.0 * phi * phi + 2.0 * eta)
        if not new < phi * (1.0 - 1e-15):
            break
        phi = new
    return phi


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, forceinline=True)
def _line(coef: Array, first: int, cells: int, a: float, start: float, scale: float) -> float:
    """Piecewise polynomial of one variable; ``coef`` (cells in all pieces, WIDTH), highest power first."""
    x = (a - start) * scale
    i = min(max(int(x), 0), cells - 1)
    u = 2.0 * (x - i) - 1.0
    i += first
    r: float = coef[i, 0]
    for k in range(1, WIDTH):
        r = r * u + coef[i, k]
    return r


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, forceinline=True)
def cell(meta: Array, block: int, a: float, b: float) -> tuple[int, float, float]:
    """Patch number and local coordinates u, w in [-1, 1] of the block coordinates (a, b).

    ``meta`` (blocks, 8): first patch, cells in a, cells in b, start and scale of a, start and scale of b, error.
    """
    na, nb = int(meta[block, 1]), int(meta[block, 2])
    x = (a - meta[block, 3]) * meta[block, 4]
    z = (b - meta[block, 5]) * meta[block, 6]
    i = min(max(int(x), 0), na - 1)
    j = min(max(int(z), 0), nb - 1)
    return int(meta[block, 0]) + i * nb + j, 2.0 * (x - i) - 1.0, 2.0 * (z - j) - 1.0


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def border_scaled(y: float, bcoef: Array, bmeta: Array) -> tuple[float, float]:
    """v~crit = value * scale, as (value, scale): y~^2/2 or sqrt(y~) is the scale.

    ``bmeta`` (3, 4): first cell, cells, start and scale of each piece of the border.
    """
    if y <= Y_CONT:
        w = y * y
        return _line(bcoef, int(bmeta[0, 0]), int(bmeta[0, 1]), w, bmeta[0, 2], bmeta[0, 3]), 0.5 * w
    k, a = (1, math.log(y)) if y <= Y_TAIL else (2, 1.0 / y)
    return _line(bcoef, int(bmeta[k, 0]), int(bmeta[k, 1]), a, bmeta[k, 2], bmeta[k, 3]), math.sqrt(y)


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, forceinline=True)
def edge_coordinate(rho: float) -> float:
    """sigma in [0, sqrt 2] for rho = v~/v~crit in [0, 1]: sqrt(rho), then sqrt 2 - sqrt(1 - rho) from rho = 1/2 on.

    Both square-root edges become smooth, as with s = (2/pi) asin sqrt(rho) of the table file, for one square root;
    sigma is analytic in s on either half, and the knot between them is an edge of cells.
    """
    return math.sqrt(rho) if rho < 0.5 else SQRT2 - math.sqrt(1.0 - rho)


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def polar(v: float, eta: float) -> tuple[float, float, float, float]:
    """Corner coordinates (phi, s0, R, 2 psi/pi): R sin psi = sqrt 2 phi, R cos psi = s0/sqrt 2, s0^2 = 2 pi v/phi."""
    phi = normal_form_root(v, eta)
    s0 = math.sqrt(2.0 * math.pi * v / phi)
    return phi, s0, math.sqrt(0.5 * s0 * s0 + 2.0 * phi * phi), TWO_OVER_PI * math.atan2(2.0 * phi, s0)


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, forceinline=True)
def locate(v: float, y: float, bcoef: Array, bmeta: Array) -> tuple[int, float, float, float, float, float]:
    """Where (v~, y~) falls: (source, a, b, base, factor, extra) with mu~ = base + factor q(a, b).

    ``v`` > 0 and 0 < ``y`` < infinity.  ``extra`` is what the answer may be wrong by beyond factor times the error of
    q: rounding, the last digit of the inputs, and for closed forms the next term.  A source from NO_PATCH on has no q.
    """
    if y <= Y_CONT:
        w = y * y
        crit = 0.5 * w * _line(bcoef, int(bmeta[0, 0]), int(bmeta[0, 1]), w, bmeta[0, 2], bmeta[0, 3])
        if v >= crit:
            if v > 1e150:
                return C_LOW, w, 1.0, 1.0, 0.0, ROUNDING
            rest = 1.0 / (1.0 + v * v)
            return C_LOW, w, v * v * rest, 1.0, -0.25 * w * rest, ROUNDING
        b = edge_coordinate(v / crit)
        if y <= Y_STICK_LO:
            return S_LOW, w, b, 1.0, -w, ROUNDING
    else:
        # one logarithm for both signs of v - crit: it is a coordinate on either side
        root = math.sqrt(y)
        t = math.log(y)
        if y > Y_TAIL:
            return _beyond(v, y, root, bcoef, bmeta)
        crit = root * _line(bcoef, int(bmeta[1, 0]), int(bmeta[1, 1]), t, bmeta[1, 2], bmeta[1, 3])
        if v >= crit:
            if v > FAST_KAPPA * root:
                return _fast(v, y, root)
            k = C_MID_1 if y <= Y_MID_C else (C_MID_2 if y <= Y_HIGH else C_HIGH)
            factor = v / math.sqrt(v * v + y * y)
            return k, t, math.log(v / root), 0.0, factor, 6.0 * ROUNDING * factor
        b = edge_coordinate(v / crit)
        if y > Y_STICK_HI:
            k = S_MID_1 if y <= Y_MID_S else (S_MID_2 if y <= Y_HIGH else S_HIGH)
            factor = v / y
            return k, t, b, 0.0, factor, 16.0 * ROUNDING * factor
    if b >= SIGMA_CUT:
        return S_MID, y, b, 0.0, 1.0, ROUNDING
    eta = y - 1.0
    phi, _, radius, angle = polar(v, eta)
    # one ulp of y~ and of v~ next to the corner: d phi / d eta = -2 phi / (3 phi^2 + 2 eta), and never more than the
    # cusp itself gives, phi(eta - d) <= phi(eta) + sqrt(2 d)
    shaken = ROUNDING * phi + min(ROUNDING * phi / (3.0 * phi * phi + 2.0 * eta), CUSP)
    return CORNER, radius, angle, 0.0, phi, shaken


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def _fast(v: float, y: float, root: float) -> tuple[int, float, float, float, float, float]:
    # (35) at y~ / sqrt(1 + v~^2) is exact to O(y~^2) at every v~; what it takes from the second term is half r f'
    speed = math.hypot(v, 1.0)
    first, second, slope, _, _ = outer_expansion(y / speed)
    correction = (second + 0.5 * slope) / speed / speed
    # the next term is smaller by (y~/v~^2)^2 where y~ > v~, by 1/v~^2 elsewhere
    small = max(root / v * (root / v), 1.0 / v)
    bound = 4.0 * abs(correction) * small * small + ROUNDING * first
    return FAST, 0.0, 0.0, min(first + correction, 1.0), 0.0, bound


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def _beyond(
    v: float, y: float, root: float, bcoef: Array, bmeta: Array
) -> tuple[int, float, float, float, float, float]:
    """:func:`locate` for y~ > Y_TAIL: the outer solution carries the logarithm, the block what the layers add."""
    a = 1.0 / y
    crit = root * _line(bcoef, int(bmeta[2, 0]), int(bmeta[2, 1]), a, bmeta[2, 2], bmeta[2, 3])
    if v > FAST_KAPPA * root:
        return _fast(v, y, root)
    factor = v / y
    if factor == 0.0:
        return S_TAIL, a, 0.0, 0.0, 0.0, 0.0
    first, _, _, _, _ = outer_expansion(1.0 / factor)
    extra = 8.0 * ROUNDING * first
    if v >= crit:
        return C_TAIL, a, math.log(v / root), first, factor, extra
    base = first + factor * TWO_OVER_PI * math.log(v / root)
    return S_TAIL, a, edge_coordinate(v / crit), base, factor, extra + 16.0 * ROUNDING * factor


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


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, parallel=True)
def ratio_array(
    v: Array, y: Array, coef: Array, meta: Array, bcoef: Array, bmeta: Array,
    mu: Array, bound: Array, source: NDArray[np.int8],
) -> None:  # fmt: skip
    """Fill ``mu``, ``bound``, ``source`` (n,) for the points (``v``, ``y``) (n,)."""
    for i in prange(v.size):
        m, e, s = ratio(v[i], y[i], coef, meta, bcoef, bmeta)
        mu[i] = m
        bound[i] = e
        source[i] = s


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, parallel=True)
def value_array(
    v: Array, y: Array, coef: Array, meta: Array, bcoef: Array, bmeta: Array, mu: Array
) -> None:  # fmt: skip
    """Fill ``mu`` (n,) alone: the dimensionless fast path.  NaN where the point is outside the quadrant."""
    n = v.size
    for c in prange((n + CHUNK - 1) // CHUNK):
        low = c * CHUNK
        high = min(low + CHUNK, n)
        patch = np.empty(CHUNK, np.int64)
        place = np.empty((CHUNK, 4))
        for i in range(low, high):
            k = i - low
            vi, yi = v[i], y[i]
            patch[k] = -1
            if 0.0 < vi < math.inf and 0.0 < yi < math.inf:
                source, a, b, base, factor, _ = locate(vi, yi, bcoef, bmeta)
                place[k, 2] = base
                if source < NO_PATCH:
                    patch[k], place[k, 0], place[k, 1] = cell(meta, source, a, b)
                    place[k, 3] = factor
            elif vi >= 0.0 and 0.0 <= yi < math.inf:
                place[k, 2] = ratio(vi, yi, coef, meta, bcoef, bmeta)[0]
            else:
                place[k, 2] = math.nan
        for i in range(low, high):
            k = i - low
            m = place[k, 2]
            if patch[k] >= 0:
                m += place[k, 3] * patch_value(coef, patch[k], place[k, 0], place[k, 1])
                m = min(max(m, 0.0), 1.0)
            mu[i] = m

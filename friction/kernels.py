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

DEGREE = 7
WIDTH = DEGREE + 1
ROUNDING = 2e-15  # of coordinates, Horner sums and the inputs' last digits, relative to the scale of the answer

Y_CONT, Y_MID_C, Y_MID_S, Y_HIGH, Y_TAIL = _r.Y_CONT, _r.Y_MID_C, _r.Y_MID_S, _r.Y_HIGH, _r.Y_TAIL
Y_STICK_LO, Y_STICK_HI, S_CUT, L_MAX = _r.Y_STICK_LO, _r.Y_STICK_HI, _r.S_CUT, _r.L_MAX
C_LOW, C_MID_1, C_MID_2, C_HIGH, C_TAIL = 0, 1, 2, 3, 4
S_LOW, S_MID, CORNER, S_MID_1, S_MID_2, S_HIGH, S_TAIL = 5, 6, 7, 8, 9, 10, 11
FAST, NO_OSCILLATION, STATIC_LIMIT = _r.FAST, _r.NO_OSCILLATION, _r.STATIC_LIMIT
TWO_OVER_PI = 2.0 / math.pi


@njit(cache=True, error_model="numpy", nogil=True)
def outer_expansion(r: float) -> tuple[float, float]:
    """(2/pi) K(i r) of eq. (35) and the coefficient of 1/v~^2 that follows it; r = y~/v~ >= 0 [-]."""
    h = math.hypot(1.0, r)
    q = 1.0 / h  # sqrt(1 - m) with m = r^2 / (1 + r^2)
    if q == 0.0:
        return 0.0, 0.0
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
    i5 = (2.0 * (2.0 - m) * e - q2 * k) / 3.0
    i7 = (4.0 * (2.0 - m) * i5 - 3.0 * q2 * e) / 5.0
    return k * q, (1.5 * i7 - m * i5) * h + q * (e - 2.5 * i5)


@njit(cache=True, error_model="numpy", nogil=True)
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


@njit(cache=True, error_model="numpy", nogil=True)
def _line(coef: NDArray[np.float64], first: int, cells: int, a: float, start: float, scale: float) -> float:
    """Piecewise polynomial of one variable; ``coef`` (cells in all pieces, WIDTH), highest power first."""
    x = (a - start) * scale
    i = min(max(int(x), 0), cells - 1)
    u = 2.0 * (x - i) - 1.0
    i += first
    r: float = coef[i, 0]
    for k in range(1, WIDTH):
        r = r * u + coef[i, k]
    return r


@njit(cache=True, error_model="numpy", nogil=True)
def _patch(coef: NDArray[np.float64], meta: NDArray[np.float64], block: int, a: float, b: float) -> float:
    """Tabulated quantity of one block at its coordinates (a, b).

    ``coef`` (patches, WIDTH, WIDTH): powers of w by rows, of u along a row, highest first, so that one row is one
    vector operation.  ``meta`` (blocks, 8): first patch, cells in a, cells in b, start and scale of a and of b, error.
    """
    na, nb = int(meta[block, 1]), int(meta[block, 2])
    x = (a - meta[block, 3]) * meta[block, 4]
    z = (b - meta[block, 5]) * meta[block, 6]
    i = min(max(int(x), 0), na - 1)
    j = min(max(int(z), 0), nb - 1)
    u = 2.0 * (x - i) - 1.0
    w = 2.0 * (z - j) - 1.0
    p = int(meta[block, 0]) + i * nb + j
    c0, c1, c2, c3 = coef[p, 0, 0], coef[p, 0, 1], coef[p, 0, 2], coef[p, 0, 3]
    c4, c5, c6, c7 = coef[p, 0, 4], coef[p, 0, 5], coef[p, 0, 6], coef[p, 0, 7]
    for k in range(1, WIDTH):
        c0 = c0 * w + coef[p, k, 0]
        c1 = c1 * w + coef[p, k, 1]
        c2 = c2 * w + coef[p, k, 2]
        c3 = c3 * w + coef[p, k, 3]
        c4 = c4 * w + coef[p, k, 4]
        c5 = c5 * w + coef[p, k, 5]
        c6 = c6 * w + coef[p, k, 6]
        c7 = c7 * w + coef[p, k, 7]
    out: float = ((((((c0 * u + c1) * u + c2) * u + c3) * u + c4) * u + c5) * u + c6) * u + c7
    return out


@njit(cache=True, error_model="numpy", nogil=True)
def border_scaled(y: float, bcoef: NDArray[np.float64], bmeta: NDArray[np.float64]) -> tuple[float, float]:
    """v~crit = value * scale, as (value, scale): y~^2/2 or sqrt(y~) is the scale.

    ``bmeta`` (3, 4): first cell, cells, start and scale of each piece of the border.
    """
    if y <= Y_CONT:
        return _line(bcoef, int(bmeta[0, 0]), int(bmeta[0, 1]), y * y, bmeta[0, 2], bmeta[0, 3]), 0.5 * y * y
    if y <= Y_TAIL:
        return _line(bcoef, int(bmeta[1, 0]), int(bmeta[1, 1]), math.log(y), bmeta[1, 2], bmeta[1, 3]), math.sqrt(y)
    return _line(bcoef, int(bmeta[2, 0]), int(bmeta[2, 1]), 1.0 / y, bmeta[2, 2], bmeta[2, 3]), math.sqrt(y)


@njit(cache=True, error_model="numpy", nogil=True)
def angle_of(rho: float) -> float:
    """s in [0, 1] with v~/v~crit = sin^2(pi s / 2), keeping the digits at both ends."""
    if rho < 0.5:
        return TWO_OVER_PI * math.asin(math.sqrt(rho))
    return 1.0 - TWO_OVER_PI * math.asin(math.sqrt(1.0 - rho))


@njit(cache=True, error_model="numpy", nogil=True)
def polar(v: float, eta: float) -> tuple[float, float, float]:
    """Corner coordinates (phi, R, 2 psi / pi): R sin psi = sqrt 2 phi, R cos psi = s0 / sqrt 2, s0^2 = 2 pi v / phi."""
    phi = normal_form_root(v, eta)
    s0 = math.sqrt(2.0 * math.pi * v / phi)
    return phi, math.sqrt(0.5 * s0 * s0 + 2.0 * phi * phi), TWO_OVER_PI * math.atan2(2.0 * phi, s0)


@njit(cache=True, error_model="numpy", nogil=True)
def ratio(
    v: float,
    y: float,
    coef: NDArray[np.float64],
    meta: NDArray[np.float64],
    bcoef: NDArray[np.float64],
    bmeta: NDArray[np.float64],
) -> tuple[float, float, int]:
    """(mu~, bound of its absolute error, source) at v~ = ``v`` >= 0, y~ = ``y`` >= 0; v~ may be infinite, y~ not."""
    if y == 0.0 or v == math.inf:
        return 1.0, 0.0, NO_OSCILLATION if y == 0.0 else FAST
    if v == 0.0:
        if y >= 1.0:
            return 0.0, 0.0, STATIC_LIMIT
        mu = math.sqrt((1.0 - y) * (1.0 + y))
        return mu, ROUNDING / mu, STATIC_LIMIT
    if y <= Y_CONT:
        w = y * y
        rho = (v / y) / (0.5 * y * _line(bcoef, int(bmeta[0, 0]), int(bmeta[0, 1]), w, bmeta[0, 2], bmeta[0, 3]))
        if rho >= 1.0:
            if v < 1.0:
                rest = 1.0 / (1.0 + v * v)
                share = v * v * rest
            else:
                inv = 1.0 / v
                share = 1.0 / (1.0 + inv * inv)
                rest = inv * inv * share
            scale = 0.25 * w * rest
            q = _patch(coef, meta, C_LOW, w, share)
            return 1.0 - scale * q, scale * meta[C_LOW, 7] + ROUNDING, C_LOW
        s = angle_of(rho)
        if y <= Y_STICK_LO:
            q = _patch(coef, meta, S_LOW, w, s)
            return 1.0 - w * q, w * meta[S_LOW, 7] + ROUNDING, S_LOW
        t = 0.0
        kappa = 0.0
    else:
        t = math.log(y)
        kappa = v / math.sqrt(y)
        if y <= Y_TAIL:
            d = _line(bcoef, int(bmeta[1, 0]), int(bmeta[1, 1]), t, bmeta[1, 2], bmeta[1, 3])
        else:
            d = _line(bcoef, int(bmeta[2, 0]), int(bmeta[2, 1]), 1.0 / y, bmeta[2, 2], bmeta[2, 3])
        rho = kappa / d
        if rho >= 1.0:
            b = math.log(kappa)
            r = y / v
            if b > L_MAX:
                first, second = outer_expansion(r)
                correction = second / v / v
                # the next term is smaller by y~^2/v~^4 where r > 1, by 1/v~^2 where r < 1; see docs/model.md
                small = max(1.0 / (kappa * kappa), 1.0 / v)
                mu = min(first + correction, 1.0)
                return mu, 4.0 * abs(correction) * small * small + ROUNDING * mu, FAST
            if y <= Y_TAIL:
                k = C_MID_1 if y <= Y_MID_C else (C_MID_2 if y <= Y_HIGH else C_HIGH)
                scale = 1.0 / math.sqrt(1.0 + r * r)
                mu = min(scale * _patch(coef, meta, k, t, b), 1.0)
                return mu, scale * meta[k, 7] + 4.0 * ROUNDING * mu, k
            first, _ = outer_expansion(r)
            mu = first + _patch(coef, meta, C_TAIL, 1.0 / y, b) / r
            return mu, meta[C_TAIL, 7] / r + 4.0 * ROUNDING * mu, C_TAIL
        s = angle_of(rho)
    if y <= Y_STICK_HI:
        if s >= S_CUT:
            return _patch(coef, meta, S_MID, y, s), meta[S_MID, 7] + ROUNDING, S_MID
        eta = y - 1.0
        phi, radius, angle = polar(v, eta)
        mu = phi * _patch(coef, meta, CORNER, radius, angle)
        # one ulp of y~ and of v~ next to the corner: d phi / d eta = -2 phi / (3 phi^2 + 2 eta)
        shaken = ROUNDING * phi * (1.0 + 1.0 / (3.0 * phi * phi + 2.0 * eta))
        return mu, phi * meta[CORNER, 7] + shaken, CORNER
    if y <= Y_TAIL:
        k = S_MID_1 if y <= Y_MID_S else (S_MID_2 if y <= Y_HIGH else S_HIGH)
        scale = v / y
        mu = scale * _patch(coef, meta, k, t, s)
        return mu, scale * meta[k, 7] + 4.0 * ROUNDING * mu, k
    scale = v / y
    first, _ = outer_expansion(1.0 / scale)
    mu = (
        first + scale * (TWO_OVER_PI * math.log(kappa) + _patch(coef, meta, S_TAIL, 1.0 / y, s)) if scale > 0.0 else 0.0
    )
    return mu, scale * meta[S_TAIL, 7] + 4.0 * ROUNDING * mu, S_TAIL


@njit(cache=True, error_model="numpy", nogil=True, parallel=True)
def ratio_array(
    v: NDArray[np.float64],
    y: NDArray[np.float64],
    coef: NDArray[np.float64],
    meta: NDArray[np.float64],
    bcoef: NDArray[np.float64],
    bmeta: NDArray[np.float64],
    mu: NDArray[np.float64],
    bound: NDArray[np.float64],
    source: NDArray[np.int8],
) -> None:
    """Fill ``mu``, ``bound``, ``source`` (n,) for the points (``v``, ``y``) (n,)."""
    for i in prange(v.size):
        m, e, s = ratio(v[i], y[i], coef, meta, bcoef, bmeta)
        mu[i] = m
        bound[i] = e
        source[i] = s


@njit(cache=True, error_model="numpy", nogil=True, parallel=True)
def value_array(
    v: NDArray[np.float64],
    y: NDArray[np.float64],
    coef: NDArray[np.float64],
    meta: NDArray[np.float64],
    bcoef: NDArray[np.float64],
    bmeta: NDArray[np.float64],
    mu: NDArray[np.float64],
) -> None:
    """Fill ``mu`` (n,) alone: the dimensionless fast path.  NaN where the point is outside the quadrant."""
    for i in prange(v.size):
        if v[i] >= 0.0 and y[i] >= 0.0 and (v[i] < math.inf or y[i] < math.inf):
            mu[i] = ratio(v[i], y[i], coef, meta, bcoef, bmeta)[0]
        else:
            mu[i] = math.nan

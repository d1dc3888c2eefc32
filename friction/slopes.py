"""Slopes of mu~ from the same patches: v~ d mu~/d v~ and y~ d mu~/d y~, block by block by the chain rule.

The logarithmic slopes are the natural ones: bounded everywhere but on the line v~ -> 0 at y~ = 1, where mu~ has the
infinite slope of a cube root in v~ (and a finite logarithmic one).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from friction.floats import log
from friction.kernels import (
    C_HIGH,
    C_LOW,
    C_MID_1,
    C_TAIL,
    CORNER,
    FAST,
    S_LOW,
    S_MID,
    S_TAIL,
    SQRT2,
    TWO_OVER_PI,
    WIDTH,
    Y_CONT,
    Y_TAIL,
    Array,
    at_zero_speed,
    cell,
    locate,
    polar,
)  # fmt: skip
from friction.outer import FUSE, outer_expansion

__all__ = ["ratio_and_slopes", "slopes_array", "speed_slope_at_zero"]


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def _border_slope(y: float, bcoef: Array, bmeta: Array) -> float:
    """d ln v~crit / d ln y~ [-]: 2 for y~ -> 0, 1/2 for y~ -> infinity."""
    if y <= Y_CONT:
        k, a, weight, base = 0, y * y, 2.0 * y * y, 2.0
    elif y <= Y_TAIL:
        k, a, weight, base = 1, log(y), 1.0, 0.0
    else:
        k, a, weight, base = 2, 1.0 / y, -1.0 / y, 0.5
    x = a * bmeta[k, 3] + bmeta[k, 2]
    j = np.trunc(x)
    u = 2.0 * (x - j) - 1.0
    i = int(bmeta[k, 0] + j)
    value: float = bcoef[i, 0]
    slope: float = 0.0
    for n in range(1, WIDTH):
        slope = slope * u + value
        value = value * u + bcoef[i, n]
    out: float = base + weight * 2.0 * bmeta[k, 3] * slope / value
    return out


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def patch_slopes(coef: Array, p: int, u: float, w: float) -> tuple[float, float, float]:
    """Value, d/du and d/dw of patch ``p`` (see :func:`friction.patch_simd.patch_value`)."""
    value = du = dw = 0.0
    for i in range(WIDTH):
        c: float = coef[p, 0, i]
        d = 0.0
        for k in range(1, WIDTH):
            d = d * w + c
            c = c * w + coef[p, k, i]
        du = du * u + value
        value = value * u + c
        dw = dw * u + d
    return value, du, dw


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def _edge_slope(coef: Array, p: int, u: float, w: float) -> float:
    """(d/dw at w minus d/dw at w = 1) of patch ``p``.

    At the border mu~ is smooth in v~, so q has no linear term in sqrt(1 - v~/v~crit); the interpolant has one of the
    size of its error, which the chain rule would divide by that root.  Taking it out leaves the slope bounded.
    """
    out: float = 0.0
    for i in range(WIDTH):
        d: float = 0.0
        for k in range(WIDTH - 1):
            n = WIDTH - 1 - k
            # n (w^(n-1) - 1), summed over the powers of w
            d += coef[p, k, i] * n * (w ** (n - 1) - 1.0)
        out = out * u + d
    return out


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def ratio_and_slopes(
    v: float, y: float, coef: Array, meta: Array, bcoef: Array, bmeta: Array
) -> tuple[float, float, float]:
    """(mu~, v~ d mu~/d v~, y~ d mu~/d y~) at v~ = ``v`` >= 0, 0 <= ``y`` < infinity."""
    if y == 0.0 or v == math.inf:
        return 1.0, 0.0, 0.0
    if v == 0.0:
        mu, _ = at_zero_speed(y)
        return mu, 0.0, (-y * y / mu if mu > 0.0 else 0.0)
    source, a, b, base, factor, _ = locate(v, y, bcoef, bmeta)
    if source == FAST:
        speed = math.hypot(v, 1.0)
        _, second, slope, change, bend = outer_expansion(y / speed)
        along_y = slope + (change + 0.5 * bend) / speed / speed
        share = (v / speed) * (v / speed)
        return base, -share * (along_y + (2.0 * second + slope) / speed / speed), along_y
    p, u, w = cell(meta, source, a, b)
    q, qa, qb = patch_slopes(coef, p, u, w)
    qa *= 2.0 * meta[source, 4]
    qb *= 2.0 * meta[source, 6]
    mu = min(base + factor * q, 1.0)
    if source == C_LOW:
        rest = 1.0 / (1.0 + v * v)
        share = v * v * rest if v < 1.0 else b
        ww = a
        along_v = factor * 2.0 * (share * rest * qb - share * q)
        return mu, along_v, 2.0 * factor * (q + ww * qa)
    if C_MID_1 <= source <= C_HIGH:
        # b = ln(v~/v~crit), whose y~ slope is minus that of ln v~crit
        tilt = 1.0 / (1.0 + (v / y) * (v / y))
        return mu, factor * (tilt * q + qb), factor * (qa - tilt * q - _border_slope(y, bcoef, bmeta) * qb)
    if source == C_TAIL:
        _, _, slope, _, _ = outer_expansion(1.0 / factor)
        return mu, -slope + factor * (q + qb), slope + factor * (-q - a * qa - 0.5 * qb)
    if source == CORNER:
        return _corner_slopes(v, y, mu, factor, q, qa, qb)
    # stick-slip: sigma through rho = v~/v~crit, whose y~ slope is minus that of ln v~crit
    if b < 0.5 * SQRT2:
        beta = 0.5 * b * qb
    else:
        root = SQRT2 - b
        rho = 1.0 - root * root
        if b * meta[source, 6] + meta[source, 5] >= meta[source, 2] - 1.0:
            # the last cell
            qb = _edge_slope(coef, p, u, w) * 2.0 * meta[source, 6]
            if root < 1e-9:
                root = 1e-9
                qb = _edge_slope(coef, p, u, 1.0 - 2.0 * root * meta[source, 6]) * 2.0 * meta[source, 6]
        beta = 0.5 * rho / root * qb
    drift = -_border_slope(y, bcoef, bmeta) * beta
    if source == S_LOW:
        return mu, factor * beta, factor * (2.0 * q + 2.0 * a * qa + drift)
    if source == S_MID:
        return mu, beta, a * qa + drift
    if source == S_TAIL:
        _, _, slope, _, _ = outer_expansion(1.0 / factor) if factor > 0.0 else (0.0, 0.0, 0.0, 0.0, 0.0)
        layer = TWO_OVER_PI * (math.log(v) - 0.5 * math.log(y)) + q
        return (
            mu,
            -slope + factor * (layer + TWO_OVER_PI + beta),
            slope + factor * (drift - layer - 0.5 * TWO_OVER_PI - a * qa),
        )
    return mu, factor * (q + beta), factor * (qa - q + drift)


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def _corner_slopes(
    v: float, y: float, mu: float, phi: float, q: float, qr: float, qs: float
) -> tuple[float, float, float]:
    """Chain rule through phi(v~, eta), R and tan(psi/2)."""
    eta = y - 1.0
    _, s0, radius, half = polar(v, eta)
    stiff = 3.0 * phi * phi + 2.0 * eta
    phi_v = math.pi * v / stiff  # d phi / d ln v~
    phi_y = -2.0 * phi / stiff  # d phi / d y~
    s_v = 0.5 * s0 * (1.0 - phi_v / phi)
    s_y = -0.5 * s0 * phi_y / phi
    turn = 0.5 * (1.0 + half * half) / (radius * radius)  # d tan(psi/2) / d psi, over R^2

    along_v = phi_v * q + phi * (
        qr * (0.5 * s0 * s_v + 2.0 * phi * phi_v) / radius + qs * turn * (s0 * phi_v - phi * s_v)
    )
    along_y = phi_y * q + phi * (
        qr * (0.5 * s0 * s_y + 2.0 * phi * phi_y) / radius + qs * turn * (s0 * phi_y - phi * s_y)
    )
    return mu, along_v, y * along_y


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def speed_slope_at_zero(y: float, coef: Array, meta: Array, bcoef: Array, bmeta: Array) -> float:
    """d mu~/d v~ at v~ = 0: pi/(2 (1 - y~^2)) below y~ = 1, C(y~) above, infinite on y~ = 1, 0 at y~ = 0 or infinite.

    C(y~) = lim mu~/v~ is read off the table where v~ is far below anything that matters and far above underflow.
    """
    if y == 0.0 or y == math.inf:
        return 0.0
    if y < 1.0:
        return 0.5 * math.pi / ((1.0 - y) * (1.0 + y))
    if y == 1.0:
        return math.inf
    v = 1e-60 * min(1.0, y - 1.0)
    mu, _, _ = ratio_and_slopes(v, y, coef, meta, bcoef, bmeta)
    return mu / v


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, parallel=True)
def slopes_array(
    v: Array, y: Array, coef: Array, meta: Array, bcoef: Array, bmeta: Array, mu: Array, along_v: Array, along_y: Array
) -> None:
    """Fill mu~ and both logarithmic slopes (n,) for legal points; y~ = infinity gives zeros."""
    for i in prange(v.size):
        if y[i] < math.inf:
            a, b, c = ratio_and_slopes(v[i], y[i], coef, meta, bcoef, bmeta)
        else:
            a, b, c = 0.0, 0.0, 0.0
        mu[i] = a
        along_v[i] = b
        along_y[i] = c

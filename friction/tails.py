"""Closed-form limits, each with its equation, range and order of error.  All dimensionless, arrays welcome."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from friction.kernels import normal_form_root
from friction.outer import outer_expansion

__all__ = [
    "agm",
    "border_blend",
    "border_large_amplitude",
    "border_small_amplitude",
    "continuous",
    "corner_root",
    "outer",
    "second_order",
    "small_amplitude",
    "static_limit",
]

BORDER_CONSTANT = 4.402914  # lim y~ / v~crit^2; the paper rounds it to 4.5 in eq. (26)
# The blend has both ends of the border built in; this one number is fitted, by benchmarks/approximations.py.
_BLEND = 0.786


def agm(b: ArrayLike) -> Any:
    """Arithmetic-geometric mean of 1 and ``b`` >= 1 [-], to rounding."""
    g = np.asarray(b, dtype=np.float64)
    a: Any = np.ones_like(g)
    for _ in range(64):
        if np.all(np.abs(a - g) <= 1e-8 * a):
            break
        a, g = 0.5 * (a + g), np.sqrt(a) * np.sqrt(g)
    return 0.5 * (a + g)


def outer(r: ArrayLike) -> Any:
    """(2/pi) K(i r), r = y~/v~ [-]: rigid contact, eqs. (35), (37); the limit v~ -> infinity at fixed r."""
    r = np.asarray(r, dtype=np.float64)
    return 1.0 / agm(np.hypot(1.0, r))


def second_order(r: ArrayLike) -> Any:
    """Coefficient of 1/v~^2 at fixed r = y~/v~ [-], the first correction to eq. (35).

    With D = 1 + r^2 cos^2 tau it is r^2 <sin^2 tau (1/2 - r^2 cos^2 tau) D^(-7/2)>, from the slow manifold of eq. (11)
    to second order, reduced to complete elliptic integrals.  The error of (35) with this term is O(v~^-4).
    Absolute accuracy is rounding; for r << 1 the value tends to r^2/4 and its relative accuracy is 1e-16/r^2.
    """
    return np.vectorize(lambda x: outer_expansion(x)[1], otypes=[np.float64])(r)


def static_limit(y: ArrayLike) -> Any:
    """mu~ for v~ -> 0 [-]: sqrt(1 - y~^2) for y~ < 1, else 0, eq. (16).  Error O(v~) for y~ != 1."""
    y = np.asarray(y, dtype=np.float64)
    inside = np.minimum(y, 1.0)
    return np.sqrt((1.0 - inside) * (1.0 + inside))


def small_amplitude(v: ArrayLike, y: ArrayLike) -> Any:
    """mu~ of continuous sliding for y~ << 1 [-]: 1 - y~^2 / (4 (1 + v~^2)), eq. (31).  Error O(y~^4)."""
    v, y = np.asarray(v, dtype=np.float64), np.asarray(y, dtype=np.float64)
    return 1.0 - y * y / (4.0 * (1.0 + v * v))


def continuous(v: ArrayLike, y: ArrayLike) -> Any:
    """(2/pi) K(i y~ / sqrt(1 + v~^2)) [-]: this project's one formula for continuous sliding.

    Eq. (31) for y~ -> 0 and eq. (35) for v~ -> infinity, both with their order of error; off by less than 0.041 in
    between.
    """
    v, y = np.asarray(v, dtype=np.float64), np.asarray(y, dtype=np.float64)
    return outer(y / np.hypot(1.0, v))


def border_small_amplitude(y: ArrayLike) -> Any:
    """v~crit for y~ -> 0 [-]: (y~^2 / 2)(1 - 5 y~^2 / 12).  Relative error O(y~^4)."""
    y = np.asarray(y, dtype=np.float64)
    return 0.5 * y * y * (1.0 - 5.0 / 12.0 * y * y)


def border_large_amplitude(y: ArrayLike) -> Any:
    """v~crit for y~ -> infinity [-]: sqrt(y~ / 4.402914), eq. (26) with the exact constant.  Relative error 0.07/y~."""
    return np.sqrt(np.asarray(y, dtype=np.float64) / BORDER_CONSTANT)


def border_blend(y: ArrayLike) -> Any:
    """v~crit for every y~ [-] by one formula of this project, relative error below 0.6 percent.

    v~crit = (y~^2 / 2) [(1 + (5/9 + d) w + c d w^2) / (1 + d w)]^(-3/4) with w = y~^2 and c = (4.402914 / 4)^(2/3): two
    terms of the small amplitudes, the leading one of the large; d is fitted.
    """
    y = np.asarray(y, dtype=np.float64)
    # in w below 1 and in 1/w above, so that no square overflows that need not
    low, high = np.minimum(y, 1.0) ** 2, np.maximum(y, 1.0) ** -2.0
    c = (BORDER_CONSTANT / 4.0) ** (2.0 / 3.0)
    below = 0.5 * low * ((1.0 + (5.0 / 9.0 + _BLEND) * low + c * _BLEND * low * low) / (1.0 + _BLEND * low)) ** -0.75
    fraction = (high * high + (5.0 / 9.0 + _BLEND) * high + c * _BLEND) / (high + _BLEND)
    above = 0.5 * np.sqrt(np.maximum(y, 1.0)) * fraction**-0.75
    return np.where(y <= 1.0, below, above)


def corner_root(v: ArrayLike, eta: ArrayLike) -> Any:
    """Positive root of mu~^3 + 2 (y~ - 1) mu~ = pi v~ [-]; mu~ near y~ = 1, v~ -> 0 to O(mu~^3).  eta = y~ - 1."""
    return np.vectorize(normal_form_root, otypes=[np.float64])(v, eta)

"""Compute closed forms of the model: those of the paper with their equation numbers, and this
project's own.

Every function takes and returns dimensionless arrays that broadcast: ``v`` = v~ = v0/(l0 omega),
``y`` = y~ = y0/l0, l0 = mu0 Fz/k.  With the factors mu0 and l0 omega they are the paper's
dimensional equations: (37) is :func:`outer`, (38) is :func:`static_limit`, (39) is
:func:`border_24`, (40) is :func:`critical`.  ``builder.approximations`` offers them in SI units by
their numbers.

"Off by" means the largest deviation from the full model. docs/validation.md has all deviations with
the ranges within 1, 5 and 10 %; ``python benchmarks/validation.py`` measures them.

References
----------
Benad, Nakano, Popov, Popov, "Active control of friction by transverse oscillations", Friction
(2018).
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mumacro.kernel.arrays import Array
from mumacro.kernel.binding import kernels

BORDER_CONSTANT = 4.402914  # lim y~ / v~crit^2; the paper rounds it to 4.5 in eq. (26)
# The blend is exact at both ends of the border; this number makes its largest error (y~ from 1e-4
# to 1e8) smallest.
_BLEND = 0.786


def _float(x: ArrayLike) -> Array:
    return np.asarray(x, dtype=np.float64)


# --- mu~ over the plane ---


@np.errstate(all="ignore")
def agm(b: ArrayLike) -> Any:
    """Return the arithmetic-geometric mean of 1 and ``b`` >= 1 [-], to rounding."""
    a, g = np.ones(np.shape(b)), _float(b)
    while np.any(np.abs(a - g) > 1e-8 * a):
        a, g = 0.5 * (a + g), np.sqrt(a) * np.sqrt(g)
    return 0.5 * (a + g)


@np.errstate(all="ignore")
def outer(r: ArrayLike) -> Any:
    """Return (2/pi) K(i r) with r = y~/v~ [-], eqs. (35), (37): rigid contact, and the limit v~ ->
    infinity at fixed r.

    K is the complete elliptic integral of the first kind by its modulus, eq. (36).

    It is too low in continuous sliding, by up to 0.23 (y~ = 1.6), 0.056 (8), 0.016 (80), 0.0014
    (1e4).  For v~ -> 0 it is too high, by less than 0.01, but its ratio to the exact value grows
    like ln(y~/v~) without limit.

    >>> float(outer(1.0)).hex() == float(1.0 / agm(2.0**0.5)).hex()
    True
    """
    return 1.0 / agm(np.hypot(1.0, _float(r)))


@np.errstate(all="ignore")
def second_order(r: ArrayLike) -> Any:
    """Return the coefficient of 1/v~^2 at fixed r = y~/v~ [-], the first correction to eq. (35).

    With D = 1 + r^2 cos^2 tau it is r^2 <sin^2 tau (1/2 - r^2 cos^2 tau) D^(-7/2)>, from the slow
    manifold of eq. (11) to second order, reduced to complete elliptic integrals.  With this term
    the error of (35) is O(v~^-4).  The absolute error is rounding.  For r << 1 the value tends to
    r^2/4, so its relative error is 1e-16/r^2.
    """
    r = _float(r)
    return kernels[-1].outer_expansion(r.ravel())[:, 1].reshape(r.shape)[()]


@np.errstate(all="ignore")
def static_limit(y: ArrayLike) -> Any:
    """Return mu~ for v~ -> 0 [-]: sqrt(1 - y~^2) for y~ < 1, otherwise 0, eqs. (16), (38).  It is
    exact; at v~ > 0 the error is O(v~) for y~ != 1.

    >>> float(static_limit(0.6))
    0.8
    """
    inside = np.minimum(_float(y), 1.0)
    return np.sqrt((1.0 - inside) * (1.0 + inside))


@np.errstate(all="ignore")
def small_angle(v: ArrayLike, y: ArrayLike) -> Any:
    """Return mu~ of continuous sliding for y~ << 1 [-]: <cos(kappa cos tau)>, kappa = y~ / sqrt(1 +
    v~^2), eqs. (29), (30).

    This is the Bessel function J0(kappa), computed by the trapezoidal rule on 32 points, to
    rounding for kappa <= 10.  It is off by 0.05 % (y~ = 0.3), 0.37 % (0.5), 4.8 % (1), always at
    the border.
    """
    kappa = _float(y) / np.hypot(1.0, _float(v))
    # the integrand is even about 0 and pi/2, so 32 points on the period are 8 in the quarter
    quarter = np.cos((np.arange(8) + 0.5) * (np.pi / 16.0))
    return np.cos(kappa[..., None] * quarter).mean(axis=-1)


@np.errstate(all="ignore")
def small_amplitude(v: ArrayLike, y: ArrayLike) -> Any:
    """Return mu~ of continuous sliding for y~ << 1 [-]: 1 - y~^2 / (4 (1 + v~^2)), eq. (31).  The
    error is O(y~^4).

    It is off by 0.06 % (y~ = 0.3), 0.47 % (0.5), 6.3 % (1), always at the border.  It has no
    meaning in stick-slip.
    """
    return 1.0 - _float(y) ** 2 / (4.0 * (1.0 + _float(v) ** 2))


@np.errstate(all="ignore")
def continuous(v: ArrayLike, y: ArrayLike) -> Any:
    """Return (2/pi) K(i y~ / sqrt(1 + v~^2)) [-]: one formula of this project for all of continuous
    sliding.

    It contains eq. (31) for y~ -> 0 and eq. (35) for v~ -> infinity, both with their order of
    error.  It is off by less than 0.0401 in all of continuous sliding.  It has no meaning in
    stick-slip.
    """
    return outer(_float(y) / np.hypot(1.0, _float(v)))


@np.errstate(all="ignore")
def critical(y: ArrayLike) -> Any:
    """Return mu~ at the border for y~ << 1 [-]: 1 - y~^2 / 4, eqs. (32), (40).

    It is too low by 0.07 % (y~ = 0.3), 0.55 % (0.5), 9.2 % (1).
    """
    return 1.0 - 0.25 * _float(y) ** 2


@np.errstate(all="ignore")
def critical_next(y: ArrayLike) -> Any:
    """Return mu~ at the border with one term more than eq. (32) [-]: 1 - y~^2 / 4 + (5/64) y~^4.
    The error is O(y~^6).

    It is off by -0.0023 % (y~ = 0.3), -0.035 % (0.5), -0.14 % (0.7), +0.24 % (1).
    """
    square = _float(y) ** 2
    return 1.0 - 0.25 * square + 5.0 / 64.0 * square * square


# --- the master curve of stick-slip at small amplitudes ---


@np.errstate(all="ignore")
def master_curve(x: ArrayLike) -> Any:
    """Return (mu~ - static) / (critical - static) at x = v~/v~crit for y~ << 1 [-], eq. (28); NaN
    for x > 1.

    1 - [(3/4)(x - 1)^2 + (1/4)(x - 1)^4] is a fit to :func:`master_curve_limit`, too low by up to
    0.0144 (x = 0.104).  Against the model it is too low by up to 0.0142 (y~ = 0.1), 0.0166 (0.5),
    0.125 (0.9), and too high by at most 0.0019 (near the border at y~ = 0.9).  Above x = 1 the
    polynomial falls.

    >>> float(master_curve(0.5))
    0.796875
    """
    x = _float(x)
    with np.errstate(over="ignore"):
        square = (x - 1.0) ** 2
        return np.where(x <= 1.0, 1.0 - square * (0.75 + 0.25 * square), np.nan)


@np.errstate(all="ignore")
def master_curve_limit(x: ArrayLike) -> Any:
    """Return the limit of the master curve for y~ -> 0, exact [-]: N_0(x), of which eq. (28) is a
    fit; 1 for x >= 1.

    The contact point is pulled at the speed x under a limit cos t and sticks from t1 to t2: cos t1
    = x (t1 < 0), sin t2 - sin t1 = x (t2 - t1), an equation like Kepler's.  With D = t2 - t1

        N_0(x) = 1 + [D sin t1 + x D^2/2 + cos t2 - cos t1] / (2 pi),    N_0'(0) = pi.

    It has full relative accuracy down to x = 0.  The curves of the model differ from it by 2e-4 (y~
    = 0.1), 1.6e-3 (0.3), 5e-3 (0.5). docs/model.md derives it.

    >>> round(float(master_curve_limit(1e-12)) / 1e-12, 4)        # the slope at rest, pi
    3.1416
    """
    # b = arcsin x, 2 d = duration of slip, 2 h = duration of stick: tan b = sin^2 d / (h - sin h
    # cos h), by Newton's method
    x = np.minimum(_float(x), 1.0)
    b = np.arcsin(x)
    d = np.minimum(0.5 * b + np.sqrt(0.25 * b * b + np.pi * b), np.pi)
    for _ in range(5):
        s, rest = np.sin(d), 0.5 * _minus_sine(2.0 * (np.pi - d))
        slope = 2.0 * s * (np.cos(d) * rest + s**3) / np.maximum(s**4 + rest**2, 1e-200)
        d = d - np.divide(
            np.arctan2(s * s, rest) - b, slope, out=np.zeros_like(d), where=slope > 0.0
        )
    stick = 2.0 * (np.pi - d)
    # integrals of 1 + cos t over stick and slip; every term is positive
    pull = stick * (2.0 * np.sin(0.5 * b) ** 2 + 0.5 * x * stick)
    arc = 2.0 * _minus_sine(d) + 4.0 * np.sin(d) * np.sin(0.5 * (d - b)) ** 2
    return (pull + arc) / (2.0 * np.pi)


def _minus_sine(d: Any) -> Any:
    """Return D - sin d without cancellation."""
    q = d * d
    series = (
        d * q / 6.0 * (1 - q / 20 * (1 - q / 42 * (1 - q / 72 * (1 - q / 110 * (1 - q / 156)))))
    )
    return np.where(d < 0.7, series, d - np.sin(d))


# --- the border of continuous sliding ---


@np.errstate(all="ignore")
def border_23(y: ArrayLike) -> Any:
    """Return v~crit for y~ << 1 [-]: the root of y~^2 = 2 v~ (1 + v~^2) (sqrt(1 + v~^2) + v~), eq.
    (23).

    With v~ = d / (2 sqrt(1 + d)) it is the cubic d (d + 2)^2 = 4 y~^2 (1 + d), solved by Newton's
    method.  It is off by -1.2 % (y~ = 0.5), +0.7 % (1), +12 % (2).
    """
    y = _float(y)
    size = np.minimum(y, 1e50)
    square = size * size
    # start above the root, so that Newton's method falls towards it
    d = np.minimum(square, 2.0 * size)
    for _ in range(8):  # the slowest case, y~ = 2, needs 7
        f = d * ((d + 4.0) * d + 4.0 - 4.0 * square) - 4.0 * square
        d = d - f / ((3.0 * d + 8.0) * d + 4.0 * (1.0 - square))
    return np.where(y < 1e50, 0.5 * d / np.sqrt(1.0 + d), np.sqrt(0.5 * y))


@np.errstate(all="ignore")
def border_24(y: ArrayLike) -> Any:
    """Return v~crit for y~ << 1 [-]: sqrt(1/4 + y~^2/2) - 1/2, eqs. (24), (39).

    It is off by -0.4 % (y~ = 0.3), +0.4 % (0.5), +12.6 % (1), +61 % (2).

    >>> float(border_24(2.0))
    1.0
    """
    y = _float(y)
    root = np.hypot(0.5, y * np.sqrt(0.5))
    return 0.5 * y * (y / (root + 0.5))


@np.errstate(all="ignore")
def border_26(y: ArrayLike) -> Any:
    """Return v~crit for y~ >> 1 [-]: sqrt(y~ / 4.5), eq. (26).  It is off by -1.08 % for y~ ->
    infinity, -5 % at y~ = 2.25."""
    return np.sqrt(_float(y) / 4.5)


@np.errstate(all="ignore")
def border_27(y: ArrayLike) -> Any:
    """Return v~crit for every y~ [-]: 0.47 y~^(5/2) / (y~^2 + 0.94 y~^(1/2) / (1 + y~^2)), eq.
    (27).

    It is off by -5.2 % at y~ = 0.413, less elsewhere; -1.38 % for y~ -> infinity.
    """
    y = _float(y)
    root = np.sqrt(y)
    # divided by y~^2, so that large y~ does not overflow
    with np.errstate(over="ignore", divide="ignore"):
        return 0.47 * root / (1.0 + 0.94 / (root * y * (1.0 + y * y)))


@np.errstate(all="ignore")
def border_small_amplitude(y: ArrayLike) -> Any:
    """Return v~crit for y~ -> 0, exact to two terms [-]: (y~^2 / 2)(1 - 5 y~^2 / 12).  The relative
    error is O(y~^4).

    Eqs. (23) and (24) have 1/2 instead of 5/12.
    """
    square = _float(y) ** 2
    return 0.5 * square * (1.0 - 5.0 / 12.0 * square)


@np.errstate(all="ignore")
def border_large_amplitude(y: ArrayLike) -> Any:
    """Return v~crit for y~ -> infinity [-]: sqrt(y~ / 4.402914), eq. (26) with the exact constant.
    The relative error is 0.07/y~."""
    return np.sqrt(_float(y) / BORDER_CONSTANT)


@np.errstate(all="ignore")
def border_blend(y: ArrayLike) -> Any:
    """Return v~crit for every y~ [-] by one formula of this project, with a relative error below
    0.6 per cent.

    v~crit = (y~^2 / 2) [(1 + (5/9 + d) w + c d w^2) / (1 + d w)]^(-3/4) with w = y~^2 and c =
    (4.402914 / 4)^(2/3).  It has two terms of the expansion for small amplitudes, and the leading
    one for large amplitudes; d is fitted.
    """
    y = _float(y)
    w = np.minimum(y, 1e60) ** 2  # above this limit v~crit grows like the square root to all digits
    c = (BORDER_CONSTANT / 4.0) ** (2.0 / 3.0)
    fraction = (1.0 + (5.0 / 9.0 + _BLEND) * w + c * _BLEND * w * w) / (1.0 + _BLEND * w)
    return 0.5 * w * fraction**-0.75 * np.sqrt(np.maximum(y / 1e60, 1.0))


@np.errstate(all="ignore")
def reverse_slip(ray: ArrayLike) -> Any:
    """Return y~ [-] from which a spring that is shaken along also slips backwards, at ``ray`` =
    v~/y~ from 0 to 1: 1/(sqrt(1 - ray^2) - ray arccos(ray)).

    >>> float(reverse_slip(0.0)), float(reverse_slip(1.0))
    (1.0, inf)
    """
    ray = _float(ray)
    return 1.0 / (np.sqrt((1.0 - ray) * (1.0 + ray)) - ray * np.arccos(ray))


@np.errstate(all="ignore")
def corner_root(v: ArrayLike, eta: ArrayLike) -> Any:
    """Return the positive root of mu~^3 + 2 (y~ - 1) mu~ = pi v~ [-], which is mu~ near y~ = 1, v~
    -> 0 to O(mu~^3). eta = y~ - 1."""
    v, eta = np.broadcast_arrays(_float(v), _float(eta))
    return kernels[-1].normal_form_root(v.ravel(), eta.ravel()).reshape(v.shape)[()]

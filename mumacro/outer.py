"""The limit of large speed, mu~ = f(r) + g(r)/v~^2 + ... with r = y~/v~: in closed form, and as polynomials of it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mumacro.kernel_cache import kernel, part

__all__ = ["TWO_OVER_PI", "outer_expansion", "outer_quick", "power_expansion"]

TWO_OVER_PI = 2.0 / math.pi
WIDTH = 8
CELLS = 48  # between 0 and LOG_MAX of ln (1 + r^2): the singularities are at +-i pi and beyond
LOG_MAX = 4.0


@kernel
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


def _cut() -> NDArray[np.float64]:
    """Power-basis coefficients (CELLS, 2, WIDTH) of f and g + r f'/2 in cells of ln (1 + r^2), highest power first."""
    local = -np.cos((np.arange(WIDTH) + 0.5) * np.pi / WIDTH)
    to_powers = np.linalg.inv(np.vander(local, WIDTH))
    closed_form = getattr(outer_expansion, "py_func", outer_expansion)
    out = np.empty((CELLS, 2, WIDTH))
    for i in range(CELLS):
        r = np.sqrt(np.expm1((i + 0.5 + 0.5 * local) * LOG_MAX / CELLS))
        f, g, slope, _, _ = np.array([closed_form(x) for x in r]).T
        # the mean apart: the change of basis multiplies rounding errors by a hundred
        values = np.array([f, g + 0.5 * slope])
        mean = values.mean(axis=1)
        out[i] = (values - mean[:, None]) @ to_powers.T
        out[i, :, -1] += mean
    return out


_COEF = _cut()
QUICK_MAX = math.exp(LOG_MAX)


@part
def outer_quick(t: float) -> tuple[float, float]:
    """f and g + r f'/2 of :func:`outer_expansion` for 1 <= t = 1 + r^2 < QUICK_MAX, to rounding."""
    x = math.log(t) * (CELLS / LOG_MAX)
    i = min(int(x), CELLS - 1)
    u = 2.0 * (x - i) - 1.0
    f: float = _COEF[i, 0, 0]
    g: float = _COEF[i, 1, 0]
    for k in range(1, WIDTH):
        f = f * u + _COEF[i, 0, k]
        g = g * u + _COEF[i, 1, k]
    return f, g


SERIES_MAX = 0.2  # of y~/v~: below, the first eleven terms hold to rounding
#: <cos^2 / sqrt(1 + n cos^2)> = sum of (-1)^k c_k c_(k+1) n^k, c_k = (2k choose k) / 4^k; highest power first
SERIES = np.array(
    [(-1) ** k * math.comb(2 * k, k) * math.comb(2 * k + 2, k + 1) / 4.0 ** (2 * k + 1) for k in range(10, -1, -1)]
)


@part
def power_expansion(v: float, y: float) -> tuple[float, float, float, float, float, float]:
    """Power for large v~: the first order and the sum of two, then the slopes of each along ln v~ and ln y~.

    From the slow manifold of eq. (11); the sum's relative error is O(v~^-4).  With D = 1 + r^2 cos^2, r = y~/v~ and
    J_p = <D^(-p/2)>: the first order is v~ <r^2 cos^2 / sqrt D>, the second -(((1 + r^2) J_5 - J_3)/2 + g)/v~.
    """
    r = y / v
    n = r * r
    # <sqrt(1 + n cos^2)> = (1 + n) J3 and J1 - J3 = -r f'; J1 is f
    first, second, slope, change, bend = outer_expansion(r)
    j3 = first + slope
    j5 = j3 - (first - j3 - bend) / 3.0
    lead, lead_y = v * ((1.0 + n) * j3 - first), v * (n * j3)
    if r < SERIES_MAX:
        # n <cos^2 / sqrt(1 + n cos^2)> by its power series: of the closed form, digits would cancel
        series, rising = SERIES[0], 0.0
        for k in range(1, SERIES.size):
            rising = rising * n + series
            series = series * n + SERIES[k]
        lead = y * r * series
        lead_y = 2.0 * y * r * (series + n * rising)
    j7 = (4.0 * (2.0 + n) * j5 - 3.0 * j3) / (5.0 * (1.0 + n))
    next_order = (0.5 * ((1.0 + n) * j5 - j3) + second) / v
    next_y = (n * j5 - 2.5 * (1.0 + n) * (j5 - j7) + 1.5 * (j3 - j5) + change) / v
    both = lead - next_order
    return lead, both, lead - lead_y, lead_y, both + 2.0 * next_order - (lead_y - next_y), lead_y - next_y

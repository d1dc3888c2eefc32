"""What the same steady cycle gives besides mu~: oscillation power and stick fraction, tabulated at the same nodes.

Power is p = <y~ cos tau u_y>, the mean power that the shaker puts in, in units of mu0 Fz l0 omega; the drive puts in
v~ mu~, and together they are the frictional loss.  Scaled so that a block holds a smooth function of order one:

=============================  ================================  =========================
blocks                         power                             stick fraction f
=============================  ================================  =========================
continuous_low                 p (1 + v~^2) / (v~ y~^2)          0
continuous_mid_1, _2, _high    p sqrt(v~^2 + y~^2) / y~^2        0
continuous_tail                (p - first order) y~ / v~^2       0
stick_slip_low                 p / (v~ y~^2)                     f
stick_slip_mid                 p                                 f
corner                         p phi / v~                        f
stick_slip_mid_1, _2           p / y~                            f
stick_slip_high, _tail         p / y~                            f sqrt(y~)
=============================  ================================  =========================

Beyond the blocks (large v~): p = y~^2 <cos^2 / |w|>, the first order, and the second in 1/v~.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from friction.kernels import (
    C_LOW,
    C_TAIL,
    CORNER,
    NO_PATCH,
    S_HIGH,
    S_LOW,
    S_MID,
    S_TAIL,
    Array,
    cell,
    locate,
    normal_form_root,
)  # fmt: skip
from friction.outer import FUSE, outer_expansion
from friction.patch_simd import patch_value

__all__ = ["companions_array", "fast_power", "power_scale", "stick_scale"]

SERIES_MAX = 0.2  # of y~/v~: below, the first eleven terms hold to rounding
#: <cos^2 / sqrt(1 + n cos^2)> = sum of (-1)^k c_k c_(k+1) n^k, c_k = (2k choose k) / 4^k; highest power first
SERIES = np.array(
    [(-1) ** k * math.comb(2 * k, k) * math.comb(2 * k + 2, k + 1) / 4.0 ** (2 * k + 1) for k in range(10, -1, -1)]
)


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def power_scale(source: int, v: float, y: float) -> float:
    """Power over what the block ``source`` tabulates for it."""
    if source == C_LOW:
        return v * y * y / (1.0 + v * v) if v < 1e150 else y * (y / v)
    if source < C_TAIL:
        return y * (y / math.hypot(v, y))
    if source == C_TAIL:
        return v * (v / y)
    if source == S_LOW:
        return v * y * y
    if source == S_MID:
        return 1.0
    if source == CORNER:
        return v / normal_form_root(v, y - 1.0)
    return y


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def stick_scale(source: int, y: float) -> float:
    """Stick fraction over what the block ``source`` tabulates for it; 0 in continuous sliding."""
    if source <= C_TAIL or source >= NO_PATCH:
        return 0.0
    return 1.0 / math.sqrt(y) if source in (S_HIGH, S_TAIL) else 1.0


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def fast_power(v: float, y: float) -> tuple[float, float]:
    """Power for large v~ to first and to second order: slow manifold of eq. (11), relative error O(v~^-4)."""
    r = y / v
    n = r * r
    # <sqrt(1 + n cos^2)> = h^2 J3 and J1 - J3 = -r f'; J1 is f
    first, second, slope, _, bend = outer_expansion(r)
    j3 = first + slope
    j5 = j3 - (first - j3 - bend) / 3.0
    lead = v * ((1.0 + n) * j3 - first)
    if r < SERIES_MAX:
        # n <cos^2 / sqrt(1 + n cos^2)> by its power series: of the closed form, digits would cancel
        series = SERIES[0]
        for k in range(1, SERIES.size):
            series = series * n + SERIES[k]
        lead = y * r * series
    return lead, lead - (0.5 * ((1.0 + n) * j5 - j3) + second) / v


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, parallel=True)
def companions_array(
    v: Array, y: Array, power_coef: Array, stick_coef: Array, meta: Array, bcoef: Array, bmeta: Array,
    power: Array, stick: Array,
) -> None:  # fmt: skip
    """Fill oscillation power and stick fraction (n,) at legal points; limits at v~ = 0, y~ = 0 and v~ = infinity.

    At v~ = 0 the shaker does no work below y~ = 1, where the contact sticks all the time.
    """
    for i in prange(v.size):
        a, b = v[i], y[i]
        if a == 0.0 and b < math.inf:
            # no slip at all below y~ = 1; above, the limit v~ -> 0 of the stick-slip cycle
            if b <= 1.0:
                power[i], stick[i] = 0.0, (1.0 if b > 0.0 else 0.0)
                continue
            a = 1e-60
        if b == 0.0 or a == math.inf:
            power[i], stick[i] = 0.0, 0.0
            continue
        if b == math.inf:
            power[i], stick[i] = math.inf, 0.0
            continue
        source, x, z, _, _, _ = locate(a, b, bcoef, bmeta)
        if source >= NO_PATCH:
            power[i], stick[i] = fast_power(a, b)[1], 0.0
            continue
        p, u, w = cell(meta, source, x, z)
        lead = fast_power(a, b)[0] if source == C_TAIL else 0.0
        power[i] = lead + power_scale(source, a, b) * patch_value(power_coef, p, u, w)
        scale = stick_scale(source, b)
        stick[i] = min(max(scale * patch_value(stick_coef, p, u, w), 0.0), 1.0) if scale > 0.0 else 0.0

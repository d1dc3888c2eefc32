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

The bound of an error is that of the tabulated quantity, found by the build, on the scale above; and beside it what no
polynomial is to blame for.  Below the border f = C(y~) sqrt(1 - rho) with rho = v~/v~crit, so that the stored border,
right to d, leaves f uncertain by C sqrt(d) at rho = 1, on both sides of it: far more than f errs anywhere else.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from friction.kernels import (
    C_LOW,
    C_TAIL,
    CORNER,
    DENORMAL,
    NO_PATCH,
    ROUNDING,
    S_HIGH,
    S_LOW,
    S_MID,
    S_TAIL,
    Array,
    border_scaled,
    cell,
    locate,
    normal_form_root,
)  # fmt: skip
from friction.outer import FUSE, outer_expansion
from friction.patch_simd import patch_value

__all__ = [
    "POWER_ROUNDING",
    "bounds_array",
    "companions_array",
    "edge_uncertainty",
    "fast_power",
    "power_scale",
    "stick_scale",
]  # fmt: skip

POWER_ROUNDING = 8.0 * ROUNDING  # of coordinates, inputs and closed forms, relative to the power
NEXT_ORDER = 1.25  # times max(1/v~, y~/v~^2)^4: what fast_power leaves out, relative; 1.001 at most on 50,000 solves
EDGE_LOW, EDGE_HIGH = 0.7, 0.96  # C(y~) of the module's text is below the first and below the second / sqrt(y~)

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


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def edge_uncertainty(v: float, y: float, bcoef: Array, bmeta: Array, border_error: float) -> float:
    """What the stick fraction may be off by because v~crit is known to ``border_error``, relative; y~ > 0 and finite.

    |sqrt(x) - sqrt(x - d)| <= d / sqrt(max(x, d)) below the border; above it, sqrt(d - distance) within d of it.
    """
    value, scale = border_scaled(y, bcoef, bmeta)
    inside = 1.0 - v / (value * scale)
    off = border_error + ROUNDING
    slope = min(EDGE_LOW, EDGE_HIGH / math.sqrt(y))
    if inside > 0.0:
        return slope * off / math.sqrt(max(inside, off))
    return slope * math.sqrt(off + inside) if off + inside > 0.0 else 0.0


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, parallel=True)
def bounds_array(
    v: Array, y: Array, power: Array, power_error: Array, stick_error: Array, border_error: float,
    bcoef: Array, bmeta: Array, power_bound: Array, stick_bound: Array,
) -> None:  # fmt: skip
    """Fill the bounds (n,) of what :func:`companions_array` gives at the same points; ``power`` is its power.

    ``power_error`` and ``stick_error`` (blocks,) bound the errors of what the blocks tabulate.  In the corner and at
    v~ = 0 the last digit of y~ = y0 k/(mu0 Fz) counts, too, as it does for mu~: next to y~ = 1 the power is linear in
    y~ - 1 and the stick fraction a square root of it.
    """
    for i in prange(v.size):
        a, b = v[i], y[i]
        if b == 0.0 or a == math.inf:
            power_bound[i], stick_bound[i] = 0.0, 0.0
            continue
        if b == math.inf:
            power_bound[i], stick_bound[i] = math.inf, 0.0
            continue
        if a == 0.0:
            if b <= 1.0:
                near = b > 1.0 - ROUNDING
                power_bound[i], stick_bound[i] = (ROUNDING, 2.0 * math.sqrt(ROUNDING)) if near else (0.0, 0.0)
                continue
            a = 1e-60
        source, _, _, _, _, _ = locate(a, b, bcoef, bmeta)
        bound = POWER_ROUNDING * power[i] + DENORMAL
        if source >= NO_PATCH:
            small = max(1.0 / a, b / a / a)
            power_bound[i], stick_bound[i] = bound + NEXT_ORDER * power[i] * small**4, 0.0
            continue
        power_bound[i] = bound + power_scale(source, a, b) * power_error[source]
        edge = edge_uncertainty(a, b, bcoef, bmeta, border_error)
        if source <= C_TAIL:
            stick_bound[i] = edge
            continue
        stick_bound[i] = stick_scale(source, b) * (stick_error[source] + 4.0 * ROUNDING) + edge
        if source == CORNER:
            # p = v~/phi has d p / d eta = 2 p / (3 phi^2 + 2 eta) <= 2/pi, and s0 = sqrt(2 pi v~/phi) moves by half as
            # much relative to itself; both are no longer linear where eta itself is of the size of its last digit
            eta = b - 1.0
            phi = normal_form_root(a, eta)
            move = ROUNDING / (3.0 * phi * phi + 2.0 * eta) if abs(eta) > 2.0 * ROUNDING else math.inf
            power_bound[i] += min(4.0 * power[i] * move, ROUNDING)
            stick_bound[i] += 2.0 * min(math.sqrt(2.0 * math.pi * a / phi) * move, math.sqrt(ROUNDING))


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

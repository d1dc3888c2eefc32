"""Kernels of dimensional cases: the dimensionless groups, the answer, and the chain rule to the six inputs.

y~ = y0 k / (mu0 Fz), v~ = v0 k / (mu0 Fz omega), l0 = mu0 Fz / k (eq. (5)); SI units throughout.  An infinite k is
rigid contact, eq. (37).  What is legal stands in :mod:`mumacro.inputs`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mumacro.charts import DENORMAL, MU, NO_OSCILLATION, OTHER, RIGID, ROUNDING, STATIC_LIMIT
from mumacro.evaluate import answer, answer_with_slopes, common_ratio, speed_slope_at_zero
from mumacro.kernel_cache import kernel, part
from mumacro.outer import outer_expansion

__all__ = [
    "evaluate_case",
    "evaluate_unusual",
    "first_bad",
    "gradient",
    "group_columns",
    "groups",
    "other_cases",
    "scaled",
]

Array = NDArray[np.float64]
Codes = NDArray[np.int8]

# --- groups ---------------------------------------------------------------------------------------------


@part
def scaled(a: float, b: float, c: float, d: float, e: float) -> float:
    """a b / (c d e) for finite positive numbers whose partial products may overflow or underflow."""
    ma, ea = math.frexp(a)
    mb, eb = math.frexp(b)
    mc, ec = math.frexp(c)
    md, ed = math.frexp(d)
    me, ee = math.frexp(e)
    return math.ldexp(ma * mb / (mc * md * me), ea + eb - ec - ed - ee)


@part(inline=True)
def _plain_groups(mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float) -> tuple[float, float, bool]:
    """(v~, y~) [-], eqs. (6), (8), and whether they are right: legal inputs, no product near the ends of the range."""
    force, stretch, speed = mu0 * Fz, y0 * k, v0 * k
    force_rate = force * omega
    smallest = min(min(force, stretch), min(force_rate, speed))
    largest = max(max(force, stretch), max(force_rate, speed))
    v, y = speed / force_rate, stretch / force
    # with mu0 and k positive, positive products leave no negative factor; NaN fails the comparisons
    plain = (
        (mu0 > 0.0) & (k > 0.0) & (smallest > 1e-290) & (largest < 1e290)
        & (v > 0.0) & (v < math.inf) & (y > 0.0) & (y < math.inf)
    )  # fmt: skip
    return v, y, plain


@part
def _amplitude_ratio(y0: float, omega: float, v0: float) -> float:
    """r = y~/v~ = y0 omega/v0 [-], which needs no stiffness."""
    product = y0 * omega
    return product / v0 if 1e-290 < product < 1e290 else scaled(y0, omega, v0, 1.0, 1.0)


@part
def groups(mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float) -> tuple[float, float]:
    """(v~, y~) [-] of any legal case: v~ is infinite where nothing oscillates, both are for rigid contact."""
    if y0 == 0.0 or omega == 0.0 or v0 == 0.0:
        y = 0.0 if y0 == 0.0 else (math.inf if k == math.inf else scaled(y0, k, mu0, Fz, 1.0))
        return math.inf if v0 > 0.0 else 0.0, y
    if k == math.inf:
        return math.inf, math.inf
    v, y, plain = _plain_groups(mu0, Fz, k, y0, omega, v0)
    return (v, y) if plain else (scaled(v0, k, mu0, Fz, omega), scaled(y0, k, mu0, Fz, 1.0))


@part
def first_bad(mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float) -> int:
    """0 for a case within the bounds of inputs.py, else 1 + the place of its first bad field among FIELDS."""
    if not 0.0 < mu0 < math.inf:
        return 1
    if not 0.0 < Fz < math.inf:
        return 2
    if not k > 0.0:
        return 3
    if not 0.0 <= y0 < math.inf:
        return 4
    if not 0.0 <= omega < math.inf:
        return 5
    return 0 if 0.0 <= v0 < math.inf else 6


@kernel
def group_columns(mu0: Array, Fz: Array, k: Array, y0: Array, omega: Array, v0: Array, v: Array, y: Array) -> Any:
    """Fill v~ and y~ (n,) of ordinary cases; -1 in the others, which are counted: zero, rigid, extreme or illegal."""
    found = np.int64(0)
    for i in range(v.size):
        speed, amplitude, plain = _plain_groups(mu0[i], Fz[i], k[i], y0[i], omega[i], v0[i])
        v[i] = speed if plain else -1.0
        y[i] = amplitude if plain else -1.0
    for i in range(v.size):
        found += np.int64(v[i] < 0.0)
    return found


# --- answers --------------------------------------------------------------------------------------------


@kernel
def evaluate_case(
    mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float,
    coef: Array, blocks: Array, border: Array, pieces: Array,
) -> tuple[float, float, int, float, float]:  # fmt: skip
    """(mu~, bound, source, v~, y~) of one case; with a source of CORNER, FAST or OTHER ask :func:`evaluate_unusual`."""
    v, y, plain = _plain_groups(mu0, Fz, k, y0, omega, v0)
    if not plain:
        return math.nan, math.nan, OTHER, v, y
    mu, bound, source = common_ratio(v, y, coef, blocks, border, pieces)
    return mu, bound, source, v, y


@kernel
def evaluate_unusual(
    mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float,
    coef: Array, blocks: Array, border: Array, pieces: Array,
) -> tuple[float, float, int, float, float]:  # fmt: skip
    """:func:`evaluate_case` for every legal case: zero inputs, rigid contact, groups beyond double precision, too."""
    if first_bad(mu0, Fz, k, y0, omega, v0) != 0:
        return math.nan, math.nan, -1, math.nan, math.nan
    v, y = groups(mu0, Fz, k, y0, omega, v0)
    if y0 == 0.0 or omega == 0.0:
        return 1.0, 0.0, NO_OSCILLATION, v, y
    if v0 == 0.0 and k == math.inf:
        return 0.0, 0.0, STATIC_LIMIT, v, y
    if y == 0.0 and v0 > 0.0:
        return 1.0, ROUNDING, NO_OSCILLATION, v, y
    # v~ below 5e-324: the static limit holds to rounding, mu~ itself underflows for y~ > 1
    if v < math.inf and y < math.inf:
        mu, bound, source = answer(MU, v, y, coef, blocks, border, pieces)
        return mu, bound + (DENORMAL if v == 0.0 < v0 else 0.0), source, v, y
    if v0 == 0.0:
        return 0.0, 0.0, STATIC_LIMIT, v, y
    r = _amplitude_ratio(y0, omega, v0)
    if r == 0.0:
        return 1.0, ROUNDING, RIGID, v, y
    mu, _, _, _, _ = outer_expansion(r)
    if r == math.inf:  # eq. (35) is 2.5e-306 where r leaves double range
        return 0.0, 3.0 * DENORMAL, RIGID, v, y
    # y~ beyond double range: only the outer solution is left, corrected by the layers when v~ is not large
    return mu, ROUNDING * mu + (0.0 if k == math.inf or v > 1e150 else mu), RIGID, v, y


@kernel
def other_cases(
    mu0: Array, Fz: Array, k: Array, y0: Array, omega: Array, v0: Array,
    coef: Array, blocks: Array, border: Array, pieces: Array, v: Array, y: Array,
    mu: Array, bound: Array, source: Codes,
) -> None:  # fmt: skip
    """Finish what :func:`group_columns` left at -1; NaN and -1 for illegal cases."""
    for i in range(v.size):
        if v[i] == -1.0:
            mu[i], bound[i], source[i], v[i], y[i] = evaluate_unusual(
                mu0[i], Fz[i], k[i], y0[i], omega[i], v0[i], coef, blocks, border, pieces
            )


@kernel
def gradient(
    mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float,
    mu: float, bound: float, source: int, v: float, y: float,
    coef: Array, blocks: Array, border: Array, pieces: Array, out: Array,
) -> None:  # fmt: skip
    """Fill ``out`` (2, 6) with d mu_macro / d input in the order of FIELDS and the bounds of their errors.

    ``mu``, ``bound``, ``source``, ``v`` and ``y`` are what :func:`evaluate_unusual` found.  One-sided at the edges:
    d/dy0 = 0 at y0 = 0, d/domega = 0 at omega = 0, d/dv0 = mu0/(l0 omega) dmu~/dv~ at v0 = 0, which is infinite on
    y~ = 1 and for rigid contact.  Relative to k the slope is 0 for rigid contact.
    """
    out[:, :] = 0.0
    out[0, 0], out[1, 0] = mu, bound
    if source == -1:
        out[:, :] = math.nan
        return
    if source == NO_OSCILLATION:
        return
    if source == RIGID:
        slope = 0.0
        if mu < 1.0 or y0 * omega > 0.0:
            _, _, slope, _, _ = outer_expansion(_amplitude_ratio(y0, omega, v0))
        error = 8.0 * ROUNDING * mu + (bound if bound > 8.0 * ROUNDING * mu else 0.0)
        out[0, 3], out[0, 4], out[0, 5] = mu0 * slope / y0, mu0 * slope / omega, -mu0 * slope / v0
        out[1, 3], out[1, 4], out[1, 5] = mu0 * error / y0, mu0 * error / omega, mu0 * error / v0
        return
    if source == STATIC_LIMIT and y == math.inf:
        out[0, 5] = out[1, 5] = math.inf
        return
    _, along_v, along_y, error_v, error_y = answer_with_slopes(MU, v, y, coef, blocks, border, pieces)
    both, errors = along_v + along_y, error_v + error_y
    out[0, 0], out[1, 0] = mu - both, bound + errors
    out[0, 1], out[1, 1] = -mu0 * both / Fz, mu0 * errors / Fz
    out[0, 2], out[1, 2] = mu0 * both / k, mu0 * errors / k
    out[0, 3], out[1, 3] = mu0 * along_y / y0, mu0 * error_y / y0
    out[0, 4], out[1, 4] = -mu0 * along_v / omega, mu0 * error_v / omega
    if v > 0.0:
        out[0, 5], out[1, 5] = mu0 * along_v / v0, mu0 * error_v / v0
    else:
        slope, error = speed_slope_at_zero(y, coef, blocks, border, pieces)
        unit = (k / Fz) / omega
        out[0, 5], out[1, 5] = slope * unit, error * unit


@kernel
def gradients(
    mu0: Array, Fz: Array, k: Array, y0: Array, omega: Array, v0: Array,
    mu: Array, bound: Array, source: Codes, v: Array, y: Array,
    coef: Array, blocks: Array, border: Array, pieces: Array, out: Array,
) -> None:  # fmt: skip
    """Fill ``out`` (n, 2, 6), see :func:`gradient`; bounds relative to mu~ in, to mu_macro out."""
    for i in range(mu.size):
        gradient(
            mu0[i], Fz[i], k[i], y0[i], omega[i], v0[i], mu[i], bound[i], source[i], v[i], y[i],
            coef, blocks, border, pieces, out[i],
        )  # fmt: skip

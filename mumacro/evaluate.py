"""From (v~, y~) to a value with its bound: one point, and many in passes that the compiler turns into vector code.

The choice of a point's block is a chain of branches that a processor cannot predict.  So CHUNK points go together
through :func:`mumacro.charts.place`, which selects instead of branching; what it does not handle (the corner, closed
forms, zero and extreme inputs) is marked and evaluated one by one by :func:`answer`.  One point and many give the same
bits: they run the same functions.

Arrays of a table, as :mod:`mumacro.cells` makes them: ``coef`` (patches, 8, 8) of a quantity, ``blocks`` (sources + 1,
BLOCK_COLUMNS), ``border`` (cells, 8) and ``pieces`` (3, PIECE_COLUMNS) of v~crit.  Nothing here reads out of bounds,
for any input: an illegal case is NaN with the source -1.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mumacro import charts
from mumacro.cells import patch_value
from mumacro.charts import (
    C_TAIL,
    CORNER,
    DENORMAL,
    ERROR,
    FAST,
    FLOOR,
    MU,
    NO_OSCILLATION,
    OFFSET_B,
    OTHER,
    PIECE_ERROR,
    POWER,
    ROUNDING,
    S_LOW,
    S_TAIL,
    SQRT2,
    STATIC_LIMIT,
    STEP_A,
    STEP_B,
    STICK,
    Array,
)  # fmt: skip
from mumacro.kernel_cache import kernel, part
from mumacro.outer import QUICK_MAX, outer_expansion, outer_quick, power_expansion

Ints = NDArray[np.int64]
Codes = NDArray[np.int8]

CHUNK = 256  # points that go through the passes together: their scratch stays in the fastest cache
POWER_ROUNDING = 8.0 * ROUNDING
NEXT_ORDER = (
    1.25  # times max(1/v~, y~/v~^2)^4: what power_expansion leaves out, relative; 1.001 at most in 50,000 solves
)
# The stick fraction below the border is C(y~) sqrt(1 - rho); C is below the first, and below the second / sqrt(y~)
EDGE_LOW, EDGE_HIGH = 0.7, 0.96
CREEP = 1e-60  # v~ that is used for the limit v~ -> 0: far below any speed of interest, far above underflow


# --- many points ----------------------------------------------------------------------------------------


@part
def _amplitudes(y: Array, pieces: Array, at: Ints, local: Array, crit: Array, level: Array) -> None:
    """The border's cell, coordinate in it and scale, and ln y~; those of y~ = 1 where the amplitude is not common."""
    counts = charts.border_counts(pieces)
    for i in range(y.size):
        known = charts.is_common(1.0, y[i])
        at[i], local[i], crit[i], level[i] = charts.border_cell(y[i] if known else 1.0, counts)


@part
def _borders(n: int, at: Ints, local: Array, border: Array, crit: Array) -> None:
    """Turn the scale in ``crit`` into v~crit."""
    for i in range(n):
        crit[i] *= charts.border_value(border, at[i], local[i])


@part
def _places(
    v: Array, y: Array, crit: Array, level: Array, block: Ints, a: Array, b: Array, base: Array, factor: Array
) -> None:
    """Blocks, coordinates and forms; OTHER for points that :func:`mumacro.charts.place` does not handle."""
    for i in range(v.size):
        k, a[i], b[i], base[i], factor[i] = charts.place(v[i], y[i], crit[i], level[i])
        block[i] = k if charts.is_common(v[i], y[i]) else np.int64(OTHER)


@part
def _cells(n: int, patches: int, block: Ints, blocks: Array, a: Array, b: Array, patch: Ints) -> Any:
    """Patch numbers; turn (a, b) into local coordinates; count what has no patch."""
    found = np.int64(0)
    for i in range(n):
        k = block[i]
        patch[i], a[i], b[i] = charts.cell(blocks, patches, k, a[i], b[i])
        found += np.int64((k >= FAST) | (k == CORNER))
    return found


@part
def _values(coef: Array, patch: Ints, u: Array, w: Array, base: Array, factor: Array, mu: Array) -> None:
    for i in range(mu.size):
        x = base[i] + factor[i] * patch_value(coef, patch[i], u[i], w[i])
        x = x if x > 0.0 else 0.0
        mu[i] = x if x < 1.0 else 1.0


@part
def _bounds(block: Ints, blocks: Array, factor: Array, bound: Array, source: Codes) -> None:
    for i in range(bound.size):
        k = block[i]
        bound[i] = abs(factor[i]) * blocks[k, ERROR] + blocks[k, FLOOR]
    for i in range(source.size):
        source[i] = block[i]


@kernel
def common_ratios(
    v: Array, y: Array, coef: Array, blocks: Array, border: Array, pieces: Array, mu: Array, bound: Array, source: Codes
) -> int:
    """Fill mu~, its bound and the source (n,) where blocks answer; mark the rest CORNER, FAST or OTHER and count it.

    ``bound`` may be empty: bounds are not computed then.
    """
    n = v.size
    floats, ints = np.empty((6, CHUNK)), np.empty((2, CHUNK), np.int64)
    crit, level, a, b, base, factor = floats[0], floats[1], floats[2], floats[3], floats[4], floats[5]
    block, patch = ints[0], ints[1]
    found = 0
    for low in range(0, n, CHUNK):
        high = min(low + CHUNK, n)
        _amplitudes(y[low:high], pieces, patch, a, crit, level)
        _borders(high - low, patch, a, border, crit)
        _places(v[low:high], y[low:high], crit, level, block, a, b, base, factor)
        found += _cells(high - low, coef.shape[0], block, blocks, a, b, patch)
        _values(coef, patch, a, b, base, factor, mu[low:high])
        _bounds(block, blocks, factor, bound[low:high], source[low:high])
    return found


@part
def _forms(quantity: int, block: Ints, v: Array, y: Array, base: Array, factor: Array) -> None:
    """Bases and factors of another quantity than mu~."""
    for i in range(v.size):
        k = block[i]
        if k < FAST and k != CORNER:
            base[i], factor[i] = charts.form(quantity, k, v[i], y[i], 0.0)


@part
def _other_bounds(
    quantity: int, block: Ints, blocks: Array, pieces: Array, v: Array, y: Array, crit: Array, factor: Array,
    value: Array, bound: Array,
) -> None:  # fmt: skip
    """Keep power and stick fraction in their ranges, and bound them."""
    for i in range(v.size):
        k = block[i]
        bound[i] = abs(factor[i]) * blocks[k, ERROR + 3 * quantity]
        value[i] = max(value[i], 0.0)
        if quantity == POWER:
            bound[i] += POWER_ROUNDING * value[i] + DENORMAL
        else:
            value[i] = min(value[i], 1.0)
            bound[i] += 4.0 * ROUNDING * factor[i] + _edge_uncertainty(v[i] / crit[i], y[i], pieces)


@kernel
def common_others(
    quantity: int, v: Array, y: Array, coef: Array, blocks: Array, border: Array, pieces: Array,
    value: Array, bound: Array, source: Codes,
) -> Any:  # fmt: skip
    """:func:`common_ratios` for power or stick fraction."""
    n = v.size
    floats, ints = np.empty((6, CHUNK)), np.empty((2, CHUNK), np.int64)
    crit, level, a, b, base, factor = floats[0], floats[1], floats[2], floats[3], floats[4], floats[5]
    block, patch = ints[0], ints[1]
    found = np.int64(0)
    for low in range(0, n, CHUNK):
        high = min(low + CHUNK, n)
        part_v, part_y, part_value = v[low:high], y[low:high], value[low:high]
        _amplitudes(part_y, pieces, patch, a, crit, level)
        _borders(high - low, patch, a, border, crit)
        _places(part_v, part_y, crit, level, block, a, b, base, factor)
        _forms(quantity, block, part_v, part_y, base, factor)
        found += _cells(high - low, coef.shape[0], block, blocks, a, b, patch)
        for i in range(high - low):
            part_value[i] = base[i] + factor[i] * patch_value(coef, patch[i], a[i], b[i])
            source[low + i] = block[i]
        _other_bounds(quantity, block, blocks, pieces, part_v, part_y, crit, factor, part_value, bound[low:high])
    return found


@kernel
def others(
    quantity: int, v: Array, y: Array, coef: Array, blocks: Array, border: Array, pieces: Array,
    value: Array, bound: Array, source: Codes,
) -> None:  # fmt: skip
    """Finish what the passes marked: closed forms, the corner, limits; NaN and -1 for illegal points."""
    for i in range(v.size):
        code = np.int64(source[i])
        if code < FAST and code != CORNER:
            continue
        if code == FAST:
            value[i], error, _ = _fast(quantity, v[i], y[i])
        elif code == CORNER and quantity != STICK:  # whose bound needs v~crit
            a, b, phi = charts.corner(v[i], y[i])
            value[i], error = _in_block(quantity, CORNER, v[i], y[i], a, b, phi, coef, blocks)
        else:
            value[i], error, source[i] = answer(quantity, v[i], y[i], coef, blocks, border, pieces)
        if bound.size > 0:
            bound[i] = error


@kernel
def slopes(
    quantity: int, v: Array, y: Array, coef: Array, blocks: Array, border: Array, pieces: Array, out: Array
) -> None:
    """:func:`answer_with_slopes` at every point (n,); rows of ``out`` (5, n)."""
    for i in range(v.size):
        out[0, i], out[1, i], out[2, i], out[3, i], out[4, i] = answer_with_slopes(
            quantity, v[i], y[i], coef, blocks, border, pieces
        )


# --- one point ------------------------------------------------------------------------------------------


@kernel
def common_ratio(
    v: float, y: float, coef: Array, blocks: Array, border: Array, pieces: Array
) -> tuple[float, float, int]:
    """(mu~, bound, source) where a block answers; else the source is CORNER, FAST or OTHER: ask :func:`answer`."""
    if not charts.is_common(v, y):
        return math.nan, math.nan, OTHER
    j, u, scale, ln_y = charts.border_cell(y, charts.border_counts(pieces))
    k, a, b, base, factor = charts.place(v, y, scale * charts.border_value(border, j, u), ln_y)
    if k in (CORNER, FAST):
        return math.nan, math.nan, k
    patch, u, w = charts.cell(blocks, coef.shape[0], k, a, b)
    mu = base + factor * patch_value(coef, patch, u, w)
    return min(max(mu, 0.0), 1.0), abs(factor) * blocks[k, ERROR] + blocks[k, FLOOR], k


@part
def fast_ratio(v: float, y: float) -> tuple[float, float]:
    """mu~ and its bound for large v~: two terms in closed form."""
    # (35) at y~ / sqrt(1 + v~^2) is exact to O(y~^2) at every v~; what it takes from the second term is half r f'
    plain = max(v, y) < 1e150
    share = 1.0 / (1.0 + v * v)
    t = 1.0 + (y * y * share if plain else (y / v) * (y / v))
    if t < QUICK_MAX:
        first, rest = outer_quick(t)
    else:
        first, second, slope, _, _ = outer_expansion(y / math.hypot(v, 1.0))
        rest = second + 0.5 * slope
    correction = rest * share if plain else rest / v / v
    # the next term is smaller by (y~/v~^2)^2 where y~ > v~, by 1/v~^2 elsewhere
    small = max(y / v / v, 1.0 / v)
    return min(first + correction, 1.0), 4.0 * abs(correction) * small * small + ROUNDING * first


@part
def limit(quantity: int, v: float, y: float) -> tuple[float, float, int]:
    """The one ladder of limits: (value, bound, source) at v~ = 0, y~ = 0 or infinity; the source is OTHER inside.

    Illegal points give NaN and -1.  At v~ = 0 the static limit, eq. (16); power and stick fraction have a limit
    v~ -> 0 of their own above y~ = 1, which is not a closed form: OTHER.  The last digit of y~ = y0 k/(mu0 Fz) counts
    next to y~ = 1, where |sqrt(1 - y - d) - sqrt(1 - y)| <= sqrt(d).
    """
    endless = y == math.inf and (quantity == MU or (quantity == POWER and v == math.inf))
    if endless or not (v >= 0.0 and y >= 0.0):
        return math.nan, math.nan, -1
    if y == 0.0 or v == math.inf:
        return (1.0 if quantity == MU else 0.0), 0.0, NO_OSCILLATION if y == 0.0 else FAST
    if y == math.inf:
        return (math.inf if quantity == POWER else 0.0), 0.0, S_TAIL
    if v > 0.0:
        return math.nan, math.nan, OTHER
    near = y < 1.0 + ROUNDING
    cusp = math.sqrt(2.0 * ROUNDING) if near else 0.0
    if quantity == MU:
        if y >= 1.0:
            return 0.0, cusp, STATIC_LIMIT
        mu = math.sqrt((1.0 - y) * (1.0 + y))
        return mu, min(ROUNDING / mu, cusp), STATIC_LIMIT
    if y > 1.0:
        return math.nan, math.nan, OTHER
    near = y > 1.0 - ROUNDING
    if quantity == POWER:
        return 0.0, ROUNDING if near else 0.0, STATIC_LIMIT
    return 1.0, 2.0 * math.sqrt(ROUNDING) if near else 0.0, STATIC_LIMIT


@kernel
def answer(
    quantity: int, v: float, y: float, coef: Array, blocks: Array, border: Array, pieces: Array
) -> tuple[float, float, int]:
    """(value, bound of its absolute error, source) of a quantity at any v~ = ``v``, y~ = ``y``.

    The bound is that of the tabulated quantity, which the build measures, times the factor; and beside it what no
    polynomial causes: rounding, the last digit of y~ in the corner, the stored border's error in the stick fraction.
    """
    if not (0.0 < v < math.inf and 0.0 < y < math.inf):
        value, bound, source = limit(quantity, v, y)
        if source != OTHER:
            return value, bound, source
    still = v == 0.0
    v = CREEP if still else v
    block, a, b, phi, crit, _ = charts.locate(v, y, border, pieces)
    if block == FAST:
        return _fast(quantity, v, y)
    value, bound = _in_block(quantity, block, v, y, a, b, phi, coef, blocks)
    if quantity == STICK:
        bound += _edge_uncertainty(v / crit, y, pieces)
    return value, bound, STATIC_LIMIT if still else block


@part
def _in_block(
    quantity: int, block: int, v: float, y: float, a: float, b: float, phi: float, coef: Array, blocks: Array
) -> tuple[float, float]:
    """Value and bound from the chart's coordinates; the border's own error in the stick fraction is left out."""
    base, factor = charts.form(quantity, block, v, y, phi)
    if factor == 0.0 and quantity == STICK:
        return 0.0, 0.0
    patch, u, w = charts.cell(blocks, coef.shape[0], block, a, b)
    value = max(base + factor * patch_value(coef, patch, u, w), 0.0)
    if quantity != POWER:
        value = min(value, 1.0)
    slack = _slack(quantity, block, v, y, phi, value, factor, blocks)
    return value, abs(factor) * blocks[block, ERROR + 3 * quantity] + slack


@part
def _fast(quantity: int, v: float, y: float) -> tuple[float, float, int]:
    if quantity == MU:
        mu, bound = fast_ratio(v, y)
        return mu, bound, FAST
    if quantity == STICK:
        return 0.0, 0.0, FAST
    _, power, _, _, _, _ = power_expansion(v, y)
    small = max(1.0 / v, y / v / v)
    return power, (POWER_ROUNDING + NEXT_ORDER * small**4) * power + DENORMAL, FAST


@part
def _slack(
    quantity: int, block: int, v: float, y: float, phi: float, value: float, factor: float, blocks: Array
) -> float:
    """What the bound allows beyond the error of q: rounding, and in the corner the last digit of y~."""
    shaken = 0.0
    if block == CORNER:
        eta = y - 1.0
        # d phi / d eta = -2 phi / stiff; where that is no longer linear over a digit of y~, the root itself is computed
        digit = ROUNDING / (3.0 * phi * phi + 2.0 * eta)
        moved = digit if digit < 1e-3 else (charts.normal_form_root(v, eta - ROUNDING) - phi) / phi
        if quantity == MU:
            return ROUNDING * phi + phi * moved
        # p = v~/phi has d p / d eta = 2 p / stiff <= 2/pi; s0 = sqrt(2 pi v~/phi) moves by half as much
        if quantity == POWER:
            shaken = min(4.0 * value * moved, ROUNDING)
        else:
            shaken = 2.0 * min(math.sqrt(2.0 * math.pi * v / phi) * moved, math.sqrt(ROUNDING))
    if quantity == POWER:
        return POWER_ROUNDING * value + DENORMAL + shaken
    if quantity == STICK:
        return 4.0 * ROUNDING * factor + shaken
    floor: float = blocks[block, FLOOR]
    if block in (C_TAIL, S_TAIL):
        # the terms that are added up: the outer solution, and the layer's logarithm
        terms = value + (factor * abs(math.log(v) - 0.5 * math.log(y)) if factor > 0.0 else 0.0)
        return 8.0 * ROUNDING * terms + (16.0 * ROUNDING * factor if block == S_TAIL else 0.0) + DENORMAL
    return floor


@part
def _edge_uncertainty(rho: float, y: float, pieces: Array) -> float:
    """What the stick fraction may be off by because v~crit is known to PIECE_ERROR, relative; y~ > 0 and finite.

    |sqrt(x) - sqrt(x - d)| <= d / sqrt(max(x, d)) below the border; above it, sqrt(d - distance) within d of it.
    """
    inside = 1.0 - rho
    off = pieces[0, PIECE_ERROR] + ROUNDING
    slope: float = min(EDGE_LOW, EDGE_HIGH / math.sqrt(y))
    if inside > 0.0:
        return float(slope * off / math.sqrt(max(inside, off)))
    return float(slope * math.sqrt(off + inside)) if off + inside > 0.0 else 0.0


# --- slopes ---------------------------------------------------------------------------------------------


@part
def _patch_slopes(coef: Array, p: int, u: float, w: float) -> tuple[float, float, float]:
    """Value, d/du and d/dw of patch ``p`` (see :func:`mumacro.cells.patch_value`)."""
    value = du = dw = 0.0
    for i in range(8):
        c: float = coef[p, 0, i]
        d = 0.0
        for k in range(1, 8):
            d = d * w + c
            c = c * w + coef[p, k, i]
        du = du * u + value
        value = value * u + c
        dw = dw * u + d
    return value, du, dw


@part
def _limit_slopes(quantity: int, v: float, y: float) -> tuple[float, float, float, float, float]:
    """:func:`answer_with_slopes` where :func:`limit` has the value."""
    value, _, source = limit(quantity, v, y)
    if source == -1:
        return math.nan, math.nan, math.nan, math.nan, math.nan
    if source == STATIC_LIMIT and quantity == MU and y < 1.0:
        along = -y * y / value
        # the slope of the square root, whose argument is uncertain by the last digit of y~
        return value, 0.0, along, 0.0, abs(along) * min(2.0 * ROUNDING / (value * value) + ROUNDING, 1e300)
    return value, 0.0, 0.0, 0.0, 0.0


@kernel
def answer_with_slopes(
    quantity: int, v: float, y: float, coef: Array, blocks: Array, border: Array, pieces: Array
) -> tuple[float, float, float, float, float]:
    """(value, v~ d/d v~, y~ d/d y~, bound of the first slope, of the second) of a quantity at any point.

    The logarithmic slopes are the natural ones: bounded everywhere but on the line v~ -> 0 at y~ = 1, where mu~ has
    the infinite slope of a cube root in v~ (and a finite logarithmic one).
    """
    if not (0.0 < v < math.inf and 0.0 < y < math.inf):
        _, _, source = limit(quantity, v, y)
        if source != OTHER:
            return _limit_slopes(quantity, v, y)
    still = v == 0.0
    v = CREEP if still else v
    block, a, b, phi, _, tilt = charts.locate(v, y, border, pieces)
    if block == FAST:
        return _fast_slopes(quantity, v, y)
    if quantity == STICK and block < S_LOW:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    base, factor = charts.form(quantity, block, v, y, phi)
    a_v, a_y, b_v, b_y, base_v, base_y, form_v, form_y = charts.differential(quantity, block, v, y, a, b, phi, tilt)
    patch, u, w = charts.cell(blocks, coef.shape[0], block, a, b)
    q, qa, qb = _patch_slopes(coef, patch, u, w)
    qa *= 2.0 * blocks[block, STEP_A]
    qb *= 2.0 * blocks[block, STEP_B]
    reach = abs(b_v)
    if quantity != STICK and block >= S_LOW and block != CORNER:
        # At the border mu~ and the power are smooth in v~, so q has no linear term in sqrt(1 - v~/v~crit); the
        # interpolant has one of the size of its error, which the chain rule would divide by that root.  Taken out of
        # the last cell, it leaves the slope bounded.
        reach = min(reach, 0.5 * blocks[block, STEP_B])
        last = np.trunc(SQRT2 * blocks[block, STEP_B] + blocks[block, OFFSET_B])
        if b * blocks[block, STEP_B] + blocks[block, OFFSET_B] >= last:
            w = min(w, 1.0 - 2.0e-9 * blocks[block, STEP_B])
            _, _, here = _patch_slopes(coef, patch, u, w)
            _, _, edge = _patch_slopes(coef, patch, u, 1.0)
            qb = (here - edge) * 2.0 * blocks[block, STEP_B]
    along_v = base_v + factor * (form_v * q + a_v * qa + b_v * qb)
    along_y = base_y + factor * (form_y * q + a_y * qa + b_y * qb)
    scale = abs(factor)
    value = max(base + factor * q, 0.0)
    errors = ERROR + 3 * quantity
    noise = 8.0 * ROUNDING * (scale * (1.0 + abs(form_v) + abs(form_y) + reach) + abs(base_v) + abs(base_y)) + DENORMAL
    bound_v = scale * blocks[block, errors + 1] * slope_weight(a_v, reach, form_v) + noise
    # along y~ what is removed from the last cell also depends on the border's slope
    ratio = reach / abs(b_v) if b_v != 0.0 else 1.0
    bound_y = scale * blocks[block, errors + 2] * slope_weight(a_y, b_y * ratio, form_y) + noise
    if block == CORNER:
        digit = 8.0 * ROUNDING / (3.0 * phi * phi + 2.0 * (y - 1.0))
        bound_v += digit * (abs(along_v) + scale)
        bound_y += digit * (abs(along_y) + scale * abs(form_y))
    return min(value, 1.0) if quantity != POWER else value, (0.0 if still else along_v), along_y, bound_v, bound_y


@part
def slope_weight(of_a: float, of_b: float, of_form: float) -> float:
    """How much an error of q and of its derivatives moves a logarithmic slope, per |factor|."""
    return abs(of_a) + abs(of_b) + abs(of_form)


@part
def _fast_slopes(quantity: int, v: float, y: float) -> tuple[float, float, float, float, float]:
    if quantity == STICK:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    small = max(1.0 / v, y / v / v)
    if quantity == POWER:
        _, power, _, _, along_v, along_y = power_expansion(v, y)
        bound = (2.0 * POWER_ROUNDING + 8.0 * NEXT_ORDER * small**4) * power + DENORMAL
        return power, along_v, along_y, bound, bound
    mu, _ = fast_ratio(v, y)
    speed = math.hypot(v, 1.0)
    _, second, slope, change, bend = outer_expansion(y / speed)
    along_y = slope + (change + 0.5 * bend) / speed / speed
    share = (v / speed) * (v / speed)
    along_v = -share * (along_y + (2.0 * second + slope) / speed / speed)
    bound = 16.0 * (abs(second) + abs(change) + abs(slope)) / speed / speed * small * small + 8.0 * ROUNDING * mu
    return mu, along_v, along_y, bound, bound


@kernel
def speed_slope_at_zero(y: float, coef: Array, blocks: Array, border: Array, pieces: Array) -> tuple[float, float]:
    """d mu~/d v~ at v~ = 0 and its bound: pi/(2 (1 - y~^2)) below y~ = 1, C(y~) above, infinite on y~ = 1.

    0 at y~ = 0 or infinity.  C(y~) = lim mu~/v~ is read off the table at a speed that stands for the limit.
    """
    if y == 0.0 or y == math.inf:
        return 0.0, 0.0
    if y < 1.0:
        gap = (1.0 - y) * (1.0 + y)
        return 0.5 * math.pi / gap, 0.5 * math.pi / gap * (4.0 * ROUNDING / gap + ROUNDING)
    if y == 1.0:
        return math.inf, math.inf
    v = CREEP * min(1.0, y - 1.0)
    mu, bound, _ = answer(MU, v, y, coef, blocks, border, pieces)
    return mu / v, bound / v

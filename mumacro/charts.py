"""The atlas: how the quadrant v~, y~ >= 0 is divided into blocks, and the chart of each.

No other module has properties of single blocks.

A chart maps (v~, y~) to two coordinates (a, b) in which what the block tabulates is a smooth function q(a, b).  Three
quantities are tabulated; each is value = base + factor q.

Continuous sliding needs no fitted border: its orbit is analytic in (v~^2, y~^2), beyond the border too.  Stick-slip
is between the static limit and the border, both of them square-root edges; with v~ = v~crit sin^2(pi s / 2) it is
analytic in s on [0, 1].  Around y~ = 1, v~ = 0 only polar coordinates of the normal form
mu~^3 + 2 (y~ - 1) mu~ = pi v~ are analytic.

========================  =======================  ========================  =======================================
block                     where                    coordinates (a, b)        q of mu~
========================  =======================  ========================  =======================================
continuous_low            y~ <= 1.5, all v~        y~^2, v~^2 / (1 + v~^2)   (1 - mu~) 4 (1 + v~^2) / y~^2
continuous_mid_1, _2      1.5 < y~ <= 3, 32        ln y~, ln(v~ / v~crit)    mu~ sqrt(1 + y~^2 / v~^2)
continuous_high           32 < y~ <= 2^17          ln y~, ln(v~ / v~crit)    mu~ sqrt(1 + y~^2 / v~^2)
continuous_tail           y~ > 2^17                1 / y~, ln(v~ / sqrt y~)  (mu~ - outer) y~ / v~
tail_fast (closed form)   v~ > 128 v~crit          -                         -
  where y~ > 2^17         ln(v~ / sqrt y~) > 4
stick_slip_low            y~ <= 0.75               y~^2, s                   (1 - mu~) / y~^2
stick_slip_mid            0.75 < y~ <= 1.5         y~, s >= 0.3              mu~
corner                    0.75 < y~ <= 1.5         R, 2 psi / pi (s < 0.3)   mu~ / phi
stick_slip_mid_1, _2      1.5 < y~ <= 3, 32        ln y~, s                  mu~ y~ / v~
stick_slip_high           32 < y~ <= 2^17          ln y~, s                  mu~ y~ / v~
stick_slip_tail           y~ > 2^17                1 / y~, s                 (mu~ - outer) y~ / v~
                                                                             - (2/pi) ln(v~ / sqrt y~)
========================  =======================  ========================  =======================================

outer = 1 / AGM(1, sqrt(1 + y~^2/v~^2)) = (2/pi) K(i y~/v~), eq. (35).

Power p = <y~ cos tau u_y> is the mean power of the shaker in units of mu0 Fz l0 omega; that of the drive is v~ mu~.
The stick fraction f is the share of the period during which the contact sticks:

=============================  ================================  =========================
blocks                         q of the power                    q of the stick fraction
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
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mumacro.arithmetic import log, square_plus
from mumacro.kernel_cache import kernel, part
from mumacro.outer import TWO_OVER_PI, outer_expansion, power_expansion

Array = NDArray[np.float64]

Y_CONT = 1.5  # continuous: rational coordinates below, logarithmic above
Y_MID = 3.0
Y_HIGH = 32.0
Y_TAIL = 2.0**17  # above, what is left beyond the outer solution is linear in 1/y~ to 1e-12
Y_STICK_LO = 0.75
Y_STICK_HI = Y_CONT
S_CUT = 0.3
R_MAX = 1.25  # covers s <= S_CUT for every y~ in [Y_STICK_LO, Y_STICK_HI]
L_MAX = 4.0  # ln(v~ / sqrt y~) from which the two-term expansion for v~ -> infinity holds to 1e-14
RHO_MAX = 128.0  # v~/v~crit from which the same holds for y~ <= Y_TAIL: ln(v~ / sqrt y~) is 3.95 to 4.11 there
L_HIGH = math.log(0.47)  # below the border for y~ >= Y_HIGH: ln 0.4754

CONTINUOUS, STICK_SLIP, STATIC = 0, 1, 2
REGIMES = ("continuous", "stick_slip", "static")
MU, POWER, STICK = 0, 1, 2
QUANTITIES = ("mu_ratio", "power", "stick_fraction")

SQRT2 = math.sqrt(2.0)
SIGMA_CUT = math.sin(0.5 * math.pi * S_CUT)  # S_CUT as sqrt(v~/v~crit)
FAST_KAPPA = math.exp(L_MAX)

#: coordinate of a table file -> what it is
COORDINATES = {
    "y_squared": "square of the dimensionless amplitude",
    "v_squared_share": "v_tilde^2/(1 + v_tilde^2)",
    "ln_y": "natural logarithm of y_tilde",
    "ln_rho": "natural logarithm of v_tilde/v_tilde_crit",
    "ln_kappa": "natural logarithm of v_tilde/sqrt(y_tilde)",
    "inverse_y": "1/y_tilde",
    "s": "s with v_tilde = v_tilde_crit sin^2(pi s/2)",
    "y": "dimensionless amplitude y_tilde",
    "radius": "distance R from the corner y_tilde = 1, v_tilde = 0 in normal-form coordinates",
    "angle": "polar angle of the normal form, 2 psi/pi",
}


@dataclass(frozen=True)
class Axis:
    """One coordinate of a chart: its name in :data:`COORDINATES` and its range in the table file.

    Evaluation uses a coordinate that costs less than the file's where the two differ: sigma for s and tan(psi/2) for
    the angle.  sigma is sqrt(rho), then sqrt 2 - sqrt(1 - rho) from rho = v~/v~crit = 1/2 on: both square-root edges
    become smooth for one square root, and the knot between the halves is an edge of cells.
    """

    name: str
    low: float
    high: float

    @property
    def span(self) -> tuple[float, float]:
        """The range of evaluation's coordinate; along s the cells cover all of [0, sqrt 2]."""
        return (0.0, SQRT2) if self.name == "s" else (self.low, self.high)

    def to_file(self, x: Array) -> Array:
        """The table file's coordinate at evaluation's ``x`` (n,)."""
        if self.name == "angle":
            return np.asarray(4.0 / np.pi * np.arctan(x), dtype=np.float64)
        if self.name != "s":
            return x
        low = np.arcsin(np.minimum(x, math.sqrt(0.5)))
        high = 0.5 * math.pi - np.arcsin(np.clip(SQRT2 - x, 0.0, math.sqrt(0.5)))
        out: Array = 2.0 / math.pi * np.where(x <= math.sqrt(0.5), low, high)
        return out

    def to_evaluation(self, x: Array) -> Array:
        """Evaluation's coordinate at the table file's ``x`` (n,)."""
        if self.name == "angle":
            return np.asarray(np.tan(0.25 * np.pi * x), dtype=np.float64)
        if self.name != "s":
            return x
        out: Array = np.where(x <= 0.5, np.sin(0.5 * np.pi * x), SQRT2 - np.cos(0.5 * np.pi * x))
        return out


@dataclass(frozen=True)
class Chart:
    """One block: name, regime, coordinates with their ranges, and what its nodes hold for mu~."""

    name: str
    regime: int
    a: Axis
    b: Axis
    quantity: str


_LN = math.log
_A_LOW, _A_MID_1, _A_MID_2 = (
    Axis("y_squared", 0.0, Y_CONT**2), Axis("ln_y", _LN(Y_CONT), _LN(Y_MID)), Axis("ln_y", _LN(Y_MID), _LN(Y_HIGH)),
)  # fmt: skip
_A_HIGH, _A_TAIL = Axis("ln_y", _LN(Y_HIGH), _LN(Y_TAIL)), Axis("inverse_y", 0.0, 1.0 / Y_TAIL)
_B_RHO, _B_S = Axis("ln_rho", 0.0, _LN(RHO_MAX)), Axis("s", 0.0, 1.0)
_HYPOTENUSE, _SLOPE = "mu_ratio sqrt(1 + y_tilde^2/v_tilde^2)", "mu_ratio y_tilde/v_tilde"
_LAYER = "(mu_ratio - outer) y_tilde/v_tilde, outer = 1/AGM(1, sqrt(1 + y_tilde^2/v_tilde^2))"
#: a block's place in this list is the source code of its values
CHARTS = (
    Chart("continuous_low", CONTINUOUS, _A_LOW, Axis("v_squared_share", 0.0, 1.0),
          "(1 - mu_ratio) 4 (1 + v_tilde^2)/y_tilde^2"),
    Chart("continuous_mid_1", CONTINUOUS, _A_MID_1, _B_RHO, _HYPOTENUSE),
    Chart("continuous_mid_2", CONTINUOUS, _A_MID_2, _B_RHO, _HYPOTENUSE),
    Chart("continuous_high", CONTINUOUS, _A_HIGH, _B_RHO, _HYPOTENUSE),
    Chart("continuous_tail", CONTINUOUS, _A_TAIL, Axis("ln_kappa", L_HIGH, L_MAX), _LAYER),
    Chart("stick_slip_low", STICK_SLIP, Axis("y_squared", 0.0, Y_STICK_LO**2), _B_S, "(1 - mu_ratio)/y_tilde^2"),
    Chart("stick_slip_mid", STICK_SLIP, Axis("y", Y_STICK_LO, Y_STICK_HI), Axis("s", S_CUT, 1.0), "mu_ratio"),
    Chart("corner", STICK_SLIP, Axis("radius", 0.0, R_MAX), Axis("angle", 0.0, 1.0),
          "mu_ratio/phi, phi^3 + 2 (y_tilde - 1) phi = pi v_tilde"),
    Chart("stick_slip_mid_1", STICK_SLIP, _A_MID_1, _B_S, _SLOPE),
    Chart("stick_slip_mid_2", STICK_SLIP, _A_MID_2, _B_S, _SLOPE),
    Chart("stick_slip_high", STICK_SLIP, _A_HIGH, _B_S, _SLOPE),
    Chart("stick_slip_tail", STICK_SLIP, _A_TAIL, _B_S, _LAYER + ", minus (2/pi) ln(v_tilde/sqrt(y_tilde))"),
)  # fmt: skip
NAMES = tuple(chart.name for chart in CHARTS)
C_LOW, C_MID_1, C_MID_2, C_HIGH, C_TAIL, S_LOW, S_MID, CORNER, S_MID_1, S_MID_2, S_HIGH, S_TAIL = range(len(CHARTS))
FAST = len(CHARTS)  # source code of the closed form for large v~; sources from here on have no cells
NO_OSCILLATION, STATIC_LIMIT, RIGID = FAST + 1, FAST + 2, FAST + 3
SOURCES = (*NAMES, "tail_fast", "no_oscillation", "static_limit", "rigid")
OTHER = len(SOURCES)  # not placed among the common blocks: zero, extreme or illegal inputs, and y~ > Y_TAIL
#: regime code of every source code
REGIME_OF_SOURCE = np.array(
    [chart.regime for chart in CHARTS] + [CONTINUOUS, CONTINUOUS, STATIC, CONTINUOUS], dtype=np.int8
)

#: v~crit in three pieces: name, coordinate, what its nodes hold
BORDER_PIECES = (
    ("low", Axis("y_squared", 0.0, Y_CONT**2), "2 v_tilde_crit / y_tilde^2"),
    ("mid", Axis("ln_y", _LN(Y_CONT), _LN(Y_TAIL)), "v_tilde_crit / sqrt(y_tilde)"),
    ("high", Axis("inverse_y", 0.0, 1.0 / Y_TAIL), "v_tilde_crit / sqrt(y_tilde)"),
)

# Columns of the array of blocks, a row a source; rows from FAST on are zero.  Offset and step count cells: the whole
# part of step * coordinate + offset is the cell.
FIRST, CELLS_B, OFFSET_A, STEP_A, OFFSET_B, STEP_B, FLOOR = range(7)
ERROR = 7  # of q: ERROR + 3 * quantity + 0 for the value, + 1 for its slope along ln v~, + 2 along ln y~
BLOCK_COLUMNS = ERROR + 9
# Columns of the array of the border's pieces
PIECE_FIRST, PIECE_OFFSET, PIECE_STEP, PIECE_ERROR = range(4)
PIECE_COLUMNS = 4

ROUNDING = 2e-15  # of coordinates, Horner sums and the inputs' last digits, relative to the scale of the value
DENORMAL = 1e-306  # what a value may lose where it leaves the normal range of double precision

_TINY, _HUGE = 1e-150, 1e150  # squares of what lies between are normal numbers
_SPEED_TINY = 1e-290


def floor_of(block: int) -> float:
    """What the bound of mu~ in a block allows for rounding, absolute."""
    if CHARTS[block].a.name == "ln_y":
        return DENORMAL if block >= S_LOW else 0.0
    return 0.0 if block in (CORNER, C_TAIL, S_TAIL) else ROUNDING


def rounding_of(block: int) -> float:
    """What it allows for rounding relative to the factor: logarithms have lost some digits."""
    if CHARTS[block].a.name != "ln_y":
        return 0.0
    return (16.0 if block >= S_LOW else 6.0) * ROUNDING


@part(inline=True)
def border_counts(pieces: Array) -> tuple[float, float, float, float, float]:
    """What :func:`border_cell` counts with: offset and step of both pieces up to Y_TAIL, first cell of the second."""
    return (
        pieces[0, PIECE_OFFSET], pieces[0, PIECE_STEP], pieces[1, PIECE_OFFSET], pieces[1, PIECE_STEP],
        pieces[1, PIECE_FIRST],
    )  # fmt: skip


@part(inline=True)
def border_cell(y: float, counts: tuple[float, float, float, float, float]) -> tuple[Any, float, float, float]:
    """Cell of v~crit(y~), local coordinate in it, factor of its value, and ln y~; 0 < ``y`` <= Y_TAIL."""
    offset, step, offset_mid, step_mid, first_mid = counts
    ln_y = log(y)
    small = y <= Y_CONT
    squared = y * y
    x = squared * step + offset if small else ln_y * step_mid + offset_mid
    j = np.int64(x)
    return j + np.int64(0.0 if small else first_mid), 2.0 * (x - j) - 1.0, 0.5 * squared if small else 1.0, ln_y


@part(inline=True)
def border_value(coef: Array, j: int, u: float) -> float:
    """The polynomial of cell ``j`` of the border; ``coef`` (cells, 8), highest power first."""
    r: float = coef[j, 0]
    for n in range(1, 8):
        r = r * u + coef[j, n]
    return r


@part(inline=True)
def _share(v: float, y: float, sliding: bool, small: bool) -> float:
    """The one quotient of all common charts: 1/(1 + v~^2), 1/(v~^2 + y~^2) or, in stick-slip, 1/y~."""
    return 1.0 / (square_plus(v, 1.0 if small else y * y) if sliding else y)


@part(inline=True)
def _common_form(v: float, y: float, sliding: bool, small: bool, share: float, root: float) -> tuple[float, float]:
    """(base, factor) of mu~ in a common chart; in continuous sliding ``root`` = v~ sqrt(share)."""
    deficit = (y <= Y_STICK_LO) | (small & sliding)
    of_deficit = y * y * (-0.25 * share if sliding else -1.0)
    of_value = root if sliding else (1.0 if small else v * share)
    return (1.0 if deficit else 0.0), (of_deficit if deficit else of_value)


@part(inline=True)
def place(v: float, y: float, crit: float, ln_y: float) -> tuple[Any, float, float, float, float]:
    """(block, a, b, base, factor) with mu~ = base + factor q(a, b), for 0 < y~ <= Y_TAIL: selections, no branches.

    The block is CORNER or FAST, without coordinates, where these have a chart of their own or a closed form.  ``crit``
    = v~crit(y~).
    """
    rho = v / crit
    sliding = rho >= 1.0
    small = y <= Y_CONT
    lowest = y <= Y_STICK_LO
    half = rho < 0.5
    squared = y * y
    # one division and one root do for all blocks
    share = _share(v, y, sliding, small)
    root = math.sqrt(v * v * share if sliding else (rho if half else 1.0 - rho))
    sigma = root if half else SQRT2 - root
    a = y if (small & (not lowest) & (not sliding)) else (squared if small else ln_y)
    beyond = 1.0 - share if small else log(rho)
    b = beyond if sliding else sigma
    base, factor = _common_form(v, y, sliding, small, share, root)
    # the blocks of either regime stand in the order of y~
    block = (
        np.int64(not small) + np.int64(y > Y_MID) + np.int64(y > Y_HIGH)
        + (np.int64(0) if sliding else np.int64(S_LOW) + np.int64(not lowest) + np.int64(not small))
    )  # fmt: skip
    plain = (small | (rho <= RHO_MAX)) & ((not small) | lowest | (sigma >= SIGMA_CUT) | sliding)
    return block if plain else (np.int64(CORNER) if small else np.int64(FAST)), a, b, base, factor


@part(inline=True)
def is_common(v: float, y: float) -> bool:
    """Whether :func:`place` handles the point: legal, above zero, neither extreme nor beyond Y_TAIL."""
    return (v > _SPEED_TINY) & (v < _HUGE) & (y > _TINY) & (y <= Y_TAIL)


@part(inline=True)
def cell(blocks: Array, patches: int, block: int, a: float, b: float) -> tuple[Any, float, float]:
    """Patch number below ``patches`` and local coordinates u, w in [-1, 1] of the block coordinates (a, b)."""
    x = a * blocks[block, STEP_A] + blocks[block, OFFSET_A]
    z = b * blocks[block, STEP_B] + blocks[block, OFFSET_B]
    # an offset's rounding may leave a coordinate at the near end below zero: truncation keeps it in the first cell
    i, j = np.trunc(x), np.trunc(z)
    patch = np.int64(blocks[block, FIRST] + i * blocks[block, CELLS_B] + j)
    # no table and no input makes it read elsewhere
    return min(max(patch, np.int64(0)), patches - 1), 2.0 * (x - i) - 1.0, 2.0 * (z - j) - 1.0


@part(inline=True)
def border(y: float, coef: Array, pieces: Array) -> tuple[float, float, float]:
    """v~crit, its slope d ln v~crit / d ln y~ (2 for y~ -> 0, 1/2 for y~ -> infinity), and ln y~; 0 < ``y`` finite."""
    if y > Y_TAIL:
        inverse = 1.0 / y
        x = inverse * pieces[2, PIECE_STEP] + pieces[2, PIECE_OFFSET]
        k = np.trunc(x)
        j, u, scale, ln_y = np.int64(pieces[2, PIECE_FIRST] + k), 2.0 * (x - k) - 1.0, math.sqrt(y), log(y)
        weight, base, step = -inverse, 0.5, pieces[2, PIECE_STEP]
    else:
        j, u, scale, ln_y = border_cell(y, border_counts(pieces))
        if y <= Y_CONT:
            weight, base, step = 2.0 * y * y, 2.0, pieces[0, PIECE_STEP]
        else:
            weight, base, step = 1.0, 0.0, pieces[1, PIECE_STEP]
    value: float = coef[j, 0]
    slope = 0.0
    for n in range(1, 8):
        slope = slope * u + value
        value = value * u + coef[j, n]
    return scale * value, base + weight * 2.0 * step * slope / value, ln_y


@kernel
def normal_form_root(v: float, eta: float) -> float:
    """Positive root phi of phi^3 + 2 eta phi = pi v, v > 0: a guess right in every limit, then Halley's method.

    The guess is off by 28 % at most, and three steps of third order take that to rounding.
    """
    c, p = math.pi * v, 2.0 * eta
    root = np.cbrt(c)
    phi: float = c / (p + root * root) if eta >= 0.0 else math.sqrt(root * root - p)
    for _ in range(3):
        slope = 3.0 * phi * phi + p
        newton = (phi * (phi * phi + p) - c) / slope
        phi -= newton / (1.0 - 3.0 * phi * newton / slope)
    return phi


@part(inline=True)
def corner(v: float, y: float) -> tuple[float, float, float]:
    """Corner coordinates (R, tan(psi/2)) and phi: R sin psi = sqrt 2 phi, R cos psi = s0/sqrt 2, s0^2 = 2 pi v/phi.

    The tangent of half the angle is analytic in it, runs from 0 to 1 as well, and costs a division.
    """
    phi = normal_form_root(v, y - 1.0)
    squared = 2.0 * math.pi * v / phi
    radius = math.sqrt(0.5 * squared + 2.0 * phi * phi)
    return radius, 2.0 * phi / (SQRT2 * radius + math.sqrt(squared)), phi


@part(inline=True)
def locate(v: float, y: float, coef: Array, pieces: Array) -> tuple[Any, float, float, float, float, float]:
    """(block, a, b, phi, v~crit, d ln v~crit / d ln y~) of any point with v~ > 0, 0 < y~, both finite.

    FAST has no coordinates; phi is 0 outside the corner.
    """
    crit, tilt, ln_y = border(y, coef, pieces)
    if y > Y_TAIL:
        root = math.sqrt(y)
        if v > FAST_KAPPA * root:
            return np.int64(FAST), 0.0, 0.0, 0.0, crit, tilt
        if v >= crit:
            return np.int64(C_TAIL), 1.0 / y, math.log(v / root), 0.0, crit, tilt
        rho = v / crit
        sigma = math.sqrt(rho) if rho < 0.5 else SQRT2 - math.sqrt(1.0 - rho)
        return np.int64(S_TAIL), 1.0 / y, sigma, 0.0, crit, tilt
    block, a, b, _, _ = place(v, y, crit, ln_y)
    phi = 0.0
    if block == CORNER:
        a, b, phi = corner(v, y)
    return block, a, b, phi, crit, tilt


@part
def form(quantity: int, block: int, v: float, y: float, phi: float) -> tuple[float, float]:
    """(base, factor) with value = base + factor q in ``block``; ``phi`` is :func:`normal_form_root`, in the corner."""
    if quantity == STICK:
        return 0.0, (0.0 if block < S_LOW else (1.0 / math.sqrt(y) if block >= S_HIGH else 1.0))
    if block == CORNER:
        return 0.0, phi if quantity == MU else v / phi
    if quantity == POWER:
        if block < C_TAIL:
            share = _share(v, y, True, block == C_LOW)
            squared = y * y
            if block == C_LOW:
                return 0.0, v * squared * share if v < _HUGE else y * (y / v)
            return 0.0, squared * math.sqrt(share)
        if block == C_TAIL:
            return power_expansion(v, y)[0], v * (v / y)
        return 0.0, v * y * y if block == S_LOW else (1.0 if block == S_MID else y)
    if block in (C_TAIL, S_TAIL):
        factor = v / y
        if block == S_TAIL and factor < 1e-100:  # the outer solution's logarithm and the layer's cancel in closed form
            return factor * TWO_OVER_PI * (math.log(4.0) + 0.5 * math.log(y)), factor
        first, _, _, _, _ = outer_expansion(1.0 / factor)
        return first + factor * TWO_OVER_PI * math.log(v / math.sqrt(y)) if block == S_TAIL else first, factor
    sliding, small = block < S_LOW, y <= Y_CONT
    share = _share(v, y, sliding, small)
    return _common_form(v, y, sliding, small, share, math.sqrt(v * v * share) if sliding else 0.0)


@part
def differential(
    quantity: int, block: int, v: float, y: float, a: float, b: float, phi: float, tilt: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """The chart's derivatives along ln v~ and ln y~: of a, of b, of the base, and of ln |factor|, in pairs.

    ``tilt`` = d ln v~crit / d ln y~.  In the last 1e-9 of sigma below the border b's derivative is that 1e-9 below it.
    """
    if block == CORNER:
        return _corner_differential(quantity, v, y, a, b, phi)
    a_y, b_v, b_y = 1.0, 1.0, -tilt
    if block in (C_LOW, S_LOW):
        a_y = 2.0 * a
    elif block == S_MID:
        a_y = a
    elif block in (C_TAIL, S_TAIL):
        a_y = -a
    share = 0.0
    if block == C_LOW:
        rest = _share(v, y, True, True)
        share = v * v * rest if v < 1.0 else 1.0 - rest  # v~^2 / (1 + v~^2)
        b_v, b_y = 2.0 * share * rest, 0.0
    elif block == C_TAIL:
        b_y = -0.5
    elif block >= S_LOW:
        root = max(SQRT2 - b, 1e-9)
        b_v = 0.5 * b if b < 0.5 * SQRT2 else 0.5 * (1.0 - root * root) / root
        b_y = -tilt * b_v
    base_v = base_y = 0.0
    if quantity == STICK:
        return 0.0, a_y, b_v, b_y, 0.0, 0.0, 0.0, -0.5 if block >= S_HIGH else 0.0
    if quantity == POWER:
        if block == C_LOW:
            return 0.0, a_y, b_v, b_y, 0.0, 0.0, 1.0 - 2.0 * share, 2.0
        if block < C_TAIL:
            part_of_v = v * v * _share(v, y, True, False)
            return 0.0, a_y, b_v, b_y, 0.0, 0.0, -part_of_v, 1.0 + part_of_v
        if block == C_TAIL:
            _, _, base_v, base_y, _, _ = power_expansion(v, y)
            return 0.0, a_y, b_v, b_y, base_v, base_y, 2.0, -1.0
        if block == S_LOW:
            return 0.0, a_y, b_v, b_y, 0.0, 0.0, 1.0, 2.0
        return 0.0, a_y, b_v, b_y, 0.0, 0.0, 0.0, 0.0 if block == S_MID else 1.0
    if block == C_LOW:
        return 0.0, a_y, b_v, b_y, 0.0, 0.0, -2.0 * share, 2.0
    if block in (S_LOW, S_MID):
        return 0.0, a_y, b_v, b_y, 0.0, 0.0, 0.0, 2.0 if block == S_LOW else 0.0
    if block < C_TAIL:
        rest = 1.0 / (1.0 + (v / y) * (v / y))
        return 0.0, a_y, b_v, b_y, 0.0, 0.0, rest, -rest
    if block in (C_TAIL, S_TAIL):
        factor = v / y
        if block == S_TAIL and factor < 1e-100:
            base_v, _ = form(MU, block, v, y, 0.0)
            base_y = 0.5 * factor * TWO_OVER_PI - base_v
        else:
            _, _, slope, _, _ = outer_expansion(1.0 / factor)
            layer = factor * TWO_OVER_PI if block == S_TAIL else 0.0
            level = layer * math.log(v / math.sqrt(y))
            base_v, base_y = layer + level - slope, slope - level - 0.5 * layer
    return 0.0, a_y, b_v, b_y, base_v, base_y, 1.0, -1.0


@part
def _corner_differential(
    quantity: int, v: float, y: float, radius: float, half: float, phi: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """:func:`differential` through phi(v~, eta), R and tan(psi/2)."""
    s0 = math.sqrt(2.0 * math.pi * v / phi)
    stiff = 3.0 * phi * phi + 2.0 * (y - 1.0)
    phi_v, phi_y = math.pi * v / stiff, -2.0 * phi * y / stiff
    s_v, s_y = 0.5 * s0 * (1.0 - phi_v / phi), -0.5 * s0 * phi_y / phi
    turn = 0.5 * (1.0 + half * half) / (radius * radius)  # d tan(psi/2) / d psi, over R^2
    a_v, a_y = (0.5 * s0 * s_v + 2.0 * phi * phi_v) / radius, (0.5 * s0 * s_y + 2.0 * phi * phi_y) / radius
    b_v, b_y = turn * (s0 * phi_v - phi * s_v), turn * (s0 * phi_y - phi * s_y)
    along_v, along_y = phi_v / phi, phi_y / phi
    if quantity == POWER:
        along_v, along_y = 1.0 - along_v, -along_y
    elif quantity == STICK:
        along_v = along_y = 0.0
    return a_v, a_y, b_v, b_y, 0.0, 0.0, along_v, along_y


def point(chart: Chart, a: Array, b: Array, border_of: Callable[[Array], Array]) -> tuple[Array, Array, Array]:
    """The inverse: (v~, y~, eta = y~ - 1) at the table file's coordinates ``a``, ``b`` (broadcast together).

    eta is exact in the corner, where rounding y~ to double costs 1e-16/mu~.  ``border_of`` gives v~crit(y~): the stored
    curve, so that nodes and evaluation use the same one.
    """
    a, b = np.broadcast_arrays(a, b)
    if chart.a.name == "radius":
        phi = a * np.sin(0.5 * math.pi * b) / SQRT2
        s0 = SQRT2 * a * np.cos(0.5 * math.pi * b)
        eta = 0.25 * s0 * s0 - 0.5 * phi * phi
        return phi * s0 * s0 / (2.0 * math.pi), 1.0 + eta, eta
    y = amplitude(chart.a, a)
    if chart.b.name == "v_squared_share":
        v = np.sqrt(b / (1.0 - b))
    elif chart.b.name == "ln_rho":
        v = np.exp(b) * border_of(y)
    elif chart.b.name == "ln_kappa":
        v = np.exp(b) * np.sqrt(y)
    else:
        v = border_of(y) * np.sin(0.5 * math.pi * b) ** 2
    return v, y, y - 1.0


def amplitude(axis: Axis, x: Array) -> Array:
    """y~ at the table file's coordinate ``x`` of a block or a piece of the border."""
    if axis.name == "y_squared":
        return np.asarray(np.sqrt(x), dtype=np.float64)
    if axis.name == "ln_y":
        return np.asarray(np.exp(x), dtype=np.float64)
    return np.asarray(1.0 / x if axis.name == "inverse_y" else x.copy(), dtype=np.float64)

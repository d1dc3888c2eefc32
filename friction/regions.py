"""How the quadrant (v~, y~) is divided: the seams and the block names.  Part of the table format.

Continuous sliding needs no fitted border: its orbit is analytic in (v~^2, y~^2), beyond the border too.  Above
y~ = 1.5 its blocks start at the border all the same, since v~/v~crit is at hand.  Stick-slip lives between the static
limit and the border, both of them square-root edges; with v~ = v~crit sin^2(pi s / 2) it is analytic in s on [0, 1].
Around y~ = 1, v~ = 0 only polar coordinates of the normal form mu~^3 + 2 (y~ - 1) mu~ = pi v~ are analytic.

========================  =======================  =================================  =============================
block                     where                    coordinates (a, b)                 tabulated q
========================  =======================  =================================  =============================
continuous_low            y~ <= 1.5, all v~        y~^2, v~^2 / (1 + v~^2)            (1 - mu~) 4 (1 + v~^2) / y~^2
continuous_mid_1, _2      1.5 < y~ <= 3, 32        ln y~, ln(v~ / v~crit)             mu~ sqrt(1 + y~^2 / v~^2)
continuous_high           32 < y~ <= 2^17          ln y~, ln(v~ / v~crit)             mu~ sqrt(1 + y~^2 / v~^2)
continuous_tail           y~ > 2^17                1 / y~, ln(v~ / sqrt y~)           (mu~ - outer) y~ / v~
fast (closed form)        v~ > 128 v~crit          -                                  -
  where y~ > 2^17         ln(v~ / sqrt y~) > 4
stick_slip_low            y~ <= 0.75               y~^2, s                            (1 - mu~) / y~^2
stick_slip_mid            0.75 < y~ <= 1.5         y~, s >= 0.3                       mu~
corner                    0.75 < y~ <= 1.5         R, 2 psi / pi (s < 0.3)            mu~ / phi
stick_slip_mid_1, _2      1.5 < y~ <= 3, 32        ln y~, s                           mu~ y~ / v~
stick_slip_high           32 < y~ <= 2^17          ln y~, s                           mu~ y~ / v~
stick_slip_tail           y~ > 2^17                1 / y~, s                          (mu~ - outer) y~ / v~
                                                                                      - (2/pi) ln(v~ / sqrt y~)
========================  =======================  =================================  =============================

outer = 1 / AGM(1, sqrt(1 + y~^2/v~^2)) = (2/pi) K(i y~/v~), eq. (35).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = [
    "BLOCKS",
    "BLOCK_INDEX",
    "BORDER_PIECES",
    "CONTINUOUS",
    "FAST",
    "L_MAX",
    "NAMES",
    "REGIMES",
    "RHO_MAX",
    "R_MAX",
    "SOURCES",
    "STATIC",
    "STICK_SLIP",
    "S_CUT",
    "Y_CONT",
    "Y_HIGH",
    "Y_MID",
    "Y_STICK_HI",
    "Y_STICK_LO",
    "Y_TAIL",
    "BlockSpec",
]  # fmt: skip

Y_CONT = 1.5  # continuous: rational coordinates below, logarithmic above
Y_MID = 3.0
Y_HIGH = 32.0
Y_TAIL = 2.0**17  # above, what is left beyond the outer solution is linear in 1/y~ to 1e-12
Y_STICK_LO = 0.75
Y_STICK_HI = Y_CONT
S_CUT = 0.3
SIGMA_CUT = math.sin(0.5 * math.pi * S_CUT)  # S_CUT as sqrt(v~/v~crit), the coordinate of the evaluation
R_MAX = 1.25  # covers s <= S_CUT for every y~ in [Y_STICK_LO, Y_STICK_HI]
L_MAX = 4.0  # ln(v~ / sqrt y~) from which the two-term expansion for v~ -> infinity holds to 1e-14
RHO_MAX = 128.0  # v~/v~crit from which the same holds for y~ <= Y_TAIL: ln(v~ / sqrt y~) is 3.95 to 4.11 there
L_HIGH = math.log(0.47)  # below the border for y~ >= Y_HIGH: ln 0.4754

CONTINUOUS, STICK_SLIP, STATIC = 0, 1, 2
REGIMES = ("continuous", "stick_slip", "static")


@dataclass(frozen=True)
class BlockSpec:
    """Name, regime and coordinate rectangle of one block; ``quantity`` names what its nodes hold."""

    name: str
    regime: int
    a_name: str
    b_name: str
    a: tuple[float, float]
    b: tuple[float, float]
    quantity: str


_LN = math.log
_LOW, _MID_1, _MID_2 = (0.0, Y_CONT**2), (_LN(Y_CONT), _LN(Y_MID)), (_LN(Y_MID), _LN(Y_HIGH))
_HIGH, _TAIL, _UNIT = (_LN(Y_HIGH), _LN(Y_TAIL)), (0.0, 1.0 / Y_TAIL), (0.0, 1.0)
_RHO, _KAPPA = (0.0, _LN(RHO_MAX)), (L_HIGH, L_MAX)
BLOCKS = (
    BlockSpec("continuous_low", CONTINUOUS, "y_squared", "v_squared_share", _LOW, _UNIT, "deficit_low"),
    BlockSpec("continuous_mid_1", CONTINUOUS, "ln_y", "ln_rho", _MID_1, _RHO, "hypotenuse"),
    BlockSpec("continuous_mid_2", CONTINUOUS, "ln_y", "ln_rho", _MID_2, _RHO, "hypotenuse"),
    BlockSpec("continuous_high", CONTINUOUS, "ln_y", "ln_rho", _HIGH, _RHO, "hypotenuse"),
    BlockSpec("continuous_tail", CONTINUOUS, "inverse_y", "ln_kappa", _TAIL, _KAPPA, "layer"),
    BlockSpec("stick_slip_low", STICK_SLIP, "y_squared", "s", (0.0, Y_STICK_LO**2), _UNIT, "deficit"),
    BlockSpec("stick_slip_mid", STICK_SLIP, "y", "s", (Y_STICK_LO, Y_STICK_HI), (S_CUT, 1.0), "mu_ratio"),
    BlockSpec("corner", STICK_SLIP, "radius", "angle", (0.0, R_MAX), _UNIT, "normal_form"),
    BlockSpec("stick_slip_mid_1", STICK_SLIP, "ln_y", "s", _MID_1, _UNIT, "slope"),
    BlockSpec("stick_slip_mid_2", STICK_SLIP, "ln_y", "s", _MID_2, _UNIT, "slope"),
    BlockSpec("stick_slip_high", STICK_SLIP, "ln_y", "s", _HIGH, _UNIT, "slope"),
    BlockSpec("stick_slip_tail", STICK_SLIP, "inverse_y", "s", _TAIL, _UNIT, "layer_log"),
)  # fmt: skip
NAMES = tuple(b.name for b in BLOCKS)
BLOCK_INDEX = {name: i for i, name in enumerate(NAMES)}

FAST = len(BLOCKS)  # source code of the closed form for large v~
NO_OSCILLATION = FAST + 1
STATIC_LIMIT = FAST + 2
RIGID = FAST + 3
SOURCES = (*NAMES, "tail_fast", "no_oscillation", "static_limit", "rigid")

#: v~crit in three pieces: (name, coordinate, range, tabulated)
BORDER_PIECES = (
    ("low", "y_squared", (0.0, Y_CONT**2), "2 v_tilde_crit / y_tilde^2"),
    ("mid", "ln_y", (_LN(Y_CONT), _LN(Y_TAIL)), "v_tilde_crit / sqrt(y_tilde)"),
    ("high", "inverse_y", (0.0, 1.0 / Y_TAIL), "v_tilde_crit / sqrt(y_tilde)"),
)

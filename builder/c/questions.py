"""What the header computes beyond the library's own scalar functions; written to be translated, see translate.py.

Arrays are those of :mod:`mumacro.evaluate`; each quantity has its own ``coef`` and ``blocks``.
"""

from __future__ import annotations

import math

from mumacro.dimensional import evaluate_case, evaluate_unusual, groups, scaled
from mumacro.evaluate import answer, common_ratio

from mumacro.border import border_at
from mumacro.charts import CORNER, FAST, MU, OTHER, POWER, STICK, Array

__all__ = ["case", "cycle", "ratio"]


def ratio(v: float, y: float, coef: Array, blocks: Array, border: Array, pieces: Array) -> float:
    """mu~ [-] at any v~, y~; NaN where illegal."""
    mu, _, source = common_ratio(v, y, coef, blocks, border, pieces)
    if source in (CORNER, FAST, OTHER):
        mu, _, _ = answer(MU, v, y, coef, blocks, border, pieces)
    return mu


def case(
    mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float,
    coef: Array, blocks: Array, border: Array, pieces: Array,
) -> tuple[float, float, int, float, float]:  # fmt: skip
    """(mu~, bound, source, v~, y~) of any case; NaN and the source -1 where illegal."""
    mu, bound, source, v, y = evaluate_case(mu0, Fz, k, y0, omega, v0, coef, blocks, border, pieces)
    if source in (CORNER, FAST, OTHER):
        return evaluate_unusual(mu0, Fz, k, y0, omega, v0, coef, blocks, border, pieces)
    return mu, bound, source, v, y


def cycle(
    mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float,
    power_coef: Array, power_blocks: Array, stick_coef: Array, stick_blocks: Array, border: Array, pieces: Array,
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """(v0 at the border [m/s], shaker's power [W], its bound, stick fraction [-], its bound) of a legal case.

    Where nothing oscillates there is no border and no power: 0.  Rigid contact has its border at 0, and no power in the
    table: NaN.  So has the power where v~ or y~ is beyond double range; the stick fraction then has a bound of 1.
    """
    v, y = groups(mu0, Fz, k, y0, omega, v0)
    stick, stick_bound, _ = answer(STICK, v, y, stick_coef, stick_blocks, border, pieces)
    if y0 == 0.0 or omega == 0.0:
        return 0.0, 0.0, 0.0, stick, stick_bound
    if k == math.inf:
        return 0.0, math.nan, math.nan, stick, stick_bound
    if y == 0.0 and v < math.inf:  # the groups no longer determine whether such a contact sticks
        stick_bound = 1.0
    if v == math.inf or y == math.inf:
        return math.nan, math.nan, math.nan, stick, stick_bound
    length = scaled(mu0, Fz, k, 1.0, 1.0)
    unit = mu0 * Fz * (length * omega)
    power, power_bound, _ = answer(POWER, v, y, power_coef, power_blocks, border, pieces)
    return length * border_at(y, border, pieces) * omega, power * unit, power_bound * unit, stick, stick_bound

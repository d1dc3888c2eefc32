"""What only the builder knows of each tabulated quantity; the rest is its record in ``mumacro/kernel/records.c``.

The solver's column (:data:`builder.sweep.COLUMNS`) has the quantity's name.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["SOLVED", "SOLVER_NOISE", "Solved", "solver_noise"]

Array = NDArray[np.float64]
Sliding = NDArray[np.bool_] | bool
#: what a fresh solve of mu~ may be wrong by, relative: rounding, and the input's last digit next to the corner
SOLVER_NOISE = 2e-15
STICK_NOISE = 1e-15  # the same of the stick fraction, absolute, away from the border


@dataclass(frozen=True)
class Solved:
    """One quantity as the solver gives it.

    Attributes
    ----------
    noise : callable
        (v~, y~, value, whether sliding is continuous) -> what a fresh solve may be wrong by, absolute.
    relative : bool
        Whether reports state errors relative to the value.
    complement : str
        The column of 1 - value, which has the digits where the value is next to 1; empty where there is none.
    """

    noise: Callable[[Array, Array, Array, Sliding], Array]
    relative: bool
    complement: str = ""


def _ratio_noise(_v: Array, _y: Array, ratio: Array, _sliding: Sliding) -> Array:
    return SOLVER_NOISE * ratio


def _power_noise(v: Array, y: Array, power: Array, sliding: Sliding) -> Array:
    """Where it is small it is the difference of larger numbers.

    In stick-slip what the drive puts in during stick, v~, is taken out; in continuous sliding the angle swings by y~,
    and only v~ of that is out of phase.
    """
    lost = np.where(sliding, np.where(y < 1.0, 1e-15 * y * y, 0.0), np.where(y < 2.0, 4e-15 * v, 0.0))
    noise: Array = SOLVER_NOISE * power + np.where(v < 1.0, lost, 0.0)
    return noise


def _stick_noise(_v: Array, _y: Array, fraction: Array, _sliding: Sliding) -> Array:
    return np.full(fraction.shape, STICK_NOISE)


SOLVED = {
    "mu_ratio": Solved(_ratio_noise, relative=False, complement="deficit"),
    "power": Solved(_power_noise, relative=True),
    "stick_fraction": Solved(_stick_noise, relative=False),
}


def solver_noise(name: str, v: Array, y: Array, solved: dict[str, Array], sliding: Sliding) -> Array:
    """What fresh solves of a quantity may be wrong by, absolute."""
    return SOLVED[name].noise(v, y, solved[name], sliding)

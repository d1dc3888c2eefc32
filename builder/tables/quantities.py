"""Define what only the builder knows about each tabulated quantity; the rest is its record in
``src/mumacro/kernel/records.c``.

The solver's column (:data:`builder.solver.sweep.COLUMNS`) has the quantity's name.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mumacro.kernel.arrays import Array

Sliding = NDArray[np.bool_] | bool
# the largest relative error of mu~ may be this many times the tolerance of a table
ABS_TO_REL = 10.0
#: possible error of a fresh solve of mu~, relative: rounding, and the input's last digit next to
#: the corner
SOLVER_NOISE = 2e-15
STICK_NOISE = 1e-15  # the same for the stick fraction, absolute, away from the border


class Solved(NamedTuple):
    """Describe one quantity as the solver gives it.

    ``noise(v, y, value, sliding)``: what a fresh solve may be wrong by, absolute; ``sliding``:
    whether continuously. ``relative``: tables state its error relative to the value.
    ``complement``: the column of 1 - value, which has the digits where the value is next to 1;
    empty where there is none.
    """

    noise: Callable[[Array, Array, Array, Sliding], Array]
    relative: bool
    complement: str = ""


def _power_noise(v: Array, y: Array, power: Array, sliding: Sliding) -> Array:
    """Return the error of the power, which is a difference of larger numbers where it is small.

    In stick-slip the work of the drive during stick, v~, is subtracted; in continuous sliding the
    angle swings by y~, and only v~ of it is out of phase.
    """
    loss = np.where(
        sliding, np.where(y < 1.0, 1e-15 * y * y, 0.0), np.where(y < 2.0, 4e-15 * v, 0.0)
    )
    noise: Array = SOLVER_NOISE * power + np.where(v < 1.0, loss, 0.0)
    return noise


SOLVED = {
    "mu_ratio": Solved(
        lambda _v, _y, ratio, _sliding: SOLVER_NOISE * ratio, relative=False, complement="deficit"
    ),
    "power": Solved(_power_noise, relative=True),
    "stick_fraction": Solved(
        lambda _v, _y, fraction, _sliding: np.full(fraction.shape, STICK_NOISE), relative=False
    ),
}


def solver_noise(
    name: str, v: Array, y: Array, solution: dict[str, Array], sliding: Sliding
) -> Array:
    """Return the possible absolute error of fresh solves of a quantity."""
    return SOLVED[name].noise(v, y, solution[name], sliding)

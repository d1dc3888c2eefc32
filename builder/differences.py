"""Slopes of the model by differences of fresh solves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mumacro import Surrogate

from .quantities import solver_noise
from .sweep import Sweep

__all__ = ["Neighbours", "differences"]

Array = NDArray[np.float64]
_STENCIL = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])
_SIXTH_ORDER = np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) / 60.0
_FOURTH_ORDER = np.array([0.0, 1.0, -8.0, 8.0, -1.0, 0.0]) / 12.0
_STEP = 0.003  # in ln v~ and ln y~: beside the corner 0.01 leaves out more than the finest table errs by


class Neighbours:
    """Fresh solves around points (n,): three on either side along ln v~ and along ln y~.

    A step is a share of the distance to what is not smooth: border and corner.
    """

    def __init__(self, surrogate: Surrogate, sweep: Sweep, v: Array, y: Array) -> None:
        self.v, self.y, self.crit, mu = v, y, surrogate.v_tilde_crit(y), surrogate.mu_ratio(v, y)
        gap = np.abs(np.log(v / self.crit))
        stiff = np.maximum(mu * mu, np.abs(1.0 - y * y))
        self.steps = np.minimum(_STEP, gap / 32.0), np.minimum(np.minimum(_STEP, gap / 64.0), _STEP * stiff)
        around_v, around_y = (
            x[:, None] * np.exp(_STENCIL * step[:, None]) for x, step in zip((v, y), self.steps, strict=True)
        )
        self.solved = sweep.solve("full", around_v, y[:, None]), sweep.solve("full", v[:, None], around_y)

    def slopes(self, name: str) -> tuple[Array, Array]:
        """Slopes along ln v~ and ln y~, (2, n), by central differences, and what these may be wrong by."""
        slope, noise = np.empty((2, self.v.size)), np.empty((2, self.v.size))
        sliding = (self.v > self.crit)[:, None]
        for row, (step, solved) in enumerate(zip(self.steps, self.solved, strict=True)):
            slope[row] = solved[name] @ _SIXTH_ORDER / step
            # what the fourth order leaves out; the sixth leaves out up to a seventh of it
            left_out = np.abs(slope[row] - solved[name] @ _FOURTH_ORDER / step)
            each = solver_noise(name, self.v[:, None], self.y[:, None], solved, sliding).max(axis=1)
            noise[row] = (2.0 * each + 4e-16 * np.abs(slope[row])) / step + 0.2 * left_out
        return slope, noise


def differences(surrogate: Surrogate, sweep: Sweep, name: str, v: Array, y: Array) -> tuple[Array, Array]:
    """:meth:`Neighbours.slopes` of one quantity at points (n,)."""
    return Neighbours(surrogate, sweep, v, y).slopes(name)

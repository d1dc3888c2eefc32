"""One steady cycle as a picture: the spring's end in the friction circle, and both forces over a period."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["CASES", "steady_cycle"]

Array = NDArray[np.float64]

#: (v~, y~) -> title
CASES = {
    (0.6, 0.8): "continuous sliding",
    (0.1, 0.8): r"stick-slip, $\tilde y < 1$",
    (0.1, 1.5): r"stick-slip, $\tilde y > 1$",
}


def steady_cycle(v: float, y: float, steps: int = 2000) -> tuple[Array, Array, NDArray[np.bool_]]:
    """The steady cycle at v~ = ``v`` > 0, y~ = ``y`` [-], marched: an independent and simple method for pictures.

    With u = u_x + i u_y and w = v~ tau + i y~ sin tau, eqs. (9) to (12) are u' = w' during stick, abs(u) < 1, and
    u' = (w' - u^2 conj(w')) / 2 on the circle.  A step of slip is the linear fractional map of that equation for the
    mean w', which keeps to the circle and is right to second order in the step.

    Parameters
    ----------
    v, y : float
        Dimensionless speed and amplitude [-].
    steps : int
        Steps in a period.

    Returns
    -------
    tau : ndarray
        Phase at the end of each step [rad], shape (steps,), from 0 to 2 pi.
    u : ndarray
        Force of the spring over mu0 Fz [-], along and across the sliding direction, shape (steps, 2).
    sticks : ndarray of bool
        Whether the foot rests in that step, shape (steps,).

    Examples
    --------
    >>> tau, u, sticks = steady_cycle(0.1, 0.8)
    >>> round(float(u[:, 0].mean()), 4), round(float(sticks.mean()), 2)        # mu~ and stick fraction
    (0.8064, 0.57)
    """
    tau = np.linspace(0.0, 2.0 * math.pi, steps + 1)
    moves = (v * tau[1] + 1j * np.diff(y * np.sin(tau))).tolist()
    path, sticks = np.empty(steps, dtype=np.complex128), np.zeros(steps, dtype=np.bool_)
    u, on_circle = 0j, False
    for _ in range(math.ceil(3.0 / v)):  # the initial state decays after a drag of some l0
        for i, move in enumerate(moves):
            free = u + move
            sticks[i] = abs(free) <= 1.0
            if sticks[i]:
                u = free
            else:
                u = (u + 0.5 * move) / (1.0 + 0.5 * move.conjugate() * u) if on_circle else free / abs(free)
            on_circle = not sticks[i]
            path[i] = u
    return tau[1:], path.view(np.float64).reshape(steps, 2), sticks

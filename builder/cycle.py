"""One steady cycle as a picture: the spring's end in the friction circle, and both forces over a period."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mumacro import Surrogate

__all__ = ["CASES", "draw_cycles", "steady_cycle"]

Array = NDArray[np.float64]
ALONG, ACROSS, STICK, INK, SOFT = "#1f6fb4", "#c1272d", "#f6e7df", "#1f2328", "#8c959f"

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


def draw_cycles(_: Surrogate, axes: Any) -> None:
    """One cycle of each regime: the path of the spring's end in the friction circle, above its two components."""
    axes.set_axis_off()
    for i, ((v, y), title) in enumerate(CASES.items()):
        tau, u, sticks = steady_cycle(v, y)
        left = i / 3.0
        disc = axes.inset_axes((left + 0.03, 0.42, 0.29, 0.52))
        turn = np.linspace(0.0, 2.0 * math.pi, 361)
        disc.plot(np.cos(turn), np.sin(turn), color=SOFT, lw=1.0)
        disc.plot(*np.where(sticks[:, None], np.nan, u).T, color=INK, lw=3.0, label="slip")
        disc.plot(*np.where(sticks[:, None], u, np.nan).T, color=ACROSS, lw=1.4, ls="--", label="stick")
        mean = float(u[:, 0].mean())
        disc.plot([mean], [0.0], "o", color=ALONG, ms=6, label=r"mean: $\tilde\mu$")
        disc.set(xlim=(-1.1, 1.1), ylim=(-1.1, 1.1), xticks=(-1, 0, 1), yticks=(-1, 0, 1), aspect="equal")
        disc.set_title(f"{title}\n$\\tilde v$ = {v:g}, $\\tilde y$ = {y:g}: $\\tilde\\mu$ = {mean:.3f}", fontsize=10)
        disc.set_xlabel("$u_x$, along", labelpad=0, fontsize=9)
        disc.tick_params(labelsize=8)
        trace = axes.inset_axes((left + 0.03, 0.0, 0.29, 0.3))
        trace.fill_between(tau, -1.1, 1.1, where=sticks, color=STICK, lw=0, step="pre")
        trace.plot(tau, u[:, 0], color=ALONG, lw=1.8, label="$u_x$, along")
        trace.plot(tau, u[:, 1], color=ACROSS, lw=1.2, label="$u_y$, across")
        trace.axhline(mean, color=ALONG, lw=0.9, ls=":")
        trace.set(xlim=(0.0, 2.0 * math.pi), ylim=(-1.1, 1.1), yticks=(-1, 0, 1))
        trace.set_xticks((0.0, math.pi, 2.0 * math.pi), ("0", r"$\pi$", r"$2\pi$"))
        trace.set_xlabel(r"$\tau = \omega t$", labelpad=-2, fontsize=9)
        trace.tick_params(labelsize=8)
        if i == 0:
            disc.set_ylabel("$u_y$, across", labelpad=-4, fontsize=9)
            disc.legend(loc="center left", fontsize=8)
            trace.legend(loc="lower right", fontsize=7, ncols=2)

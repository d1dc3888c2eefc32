"""A deliberately naive solver of the same model: Euler steps projected on the friction limit, whole
periods, no theory.

It shares nothing with ``builder``: no half period, no closed form, no events, no root-finding.  The
foot follows the sweeping process u <- P(u + dP) with P the projection on the unit disc and dP the
displacement of the upper point. Its error is proportional to the step, so extrapolation gives an
independent check.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar, cast

import numpy as np
from numba import njit
from numpy.typing import NDArray

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """``njit``, whose stubs lose the types of a function."""
    return cast("Function", njit(function))


@compiled
def march(
    v: float, y: float, steps: int, periods: int, ux: float = 0.0, uy: float = 0.0
) -> NDArray[np.float64]:
    """Orbit (steps, 2) of u over the last of ``periods`` periods from (ux, uy); v = v~ [-], y = y~
    [-]."""
    orbit = np.empty((steps, 2))
    d_tau = 2.0 * math.pi / steps
    for _ in range(periods):
        for i in range(steps):
            ux += v * d_tau
            uy += y * (math.sin((i + 1) * d_tau) - math.sin(i * d_tau))
            stretch = math.hypot(ux, uy)
            if stretch > 1.0:
                ux /= stretch
                uy /= stretch
            orbit[i, 0] = ux
            orbit[i, 1] = uy
    return orbit


def periods_until_steady(v: float, y: float) -> int:
    """Periods until the start has no effect: the slip path per period is at least 4 (y~ - 1) and
    about 2 pi v~."""
    return math.ceil(1.0 / v + 40.0 / max(2.0 * math.pi * v, 4.0 * (y - 1.0)))


def mu_ratio(v: float, y: float, steps: int) -> float:
    """mu~ = <u_x> over one steady period of ``steps`` steps; first-order accurate."""
    return float(march(v, y, steps, periods_until_steady(v, y))[:, 0].mean())


@compiled
def march_ball(v: float, y: float, springs: int, steps: int) -> float:
    """mu~ of a ball as ``springs`` independent springs, each marched by itself over one steady
    period."""
    total = 0.0
    for j in range(springs):
        s = 1.5 * (1.0 - ((j + 0.5) / springs) ** 2)  # load of the spring over the mean one's
        a, b = v / s, y / s
        periods = math.ceil(1.0 / a + 40.0 / max(2.0 * math.pi * a, 4.0 * (b - 1.0)))
        total += s * march(a, b, steps, periods)[:, 0].mean()
    return total / springs

"""The usual method: integrate the equations of motion with scipy until two cycles agree.

Stick and slip are phases of :func:`scipy.integrate.solve_ivp`, their ends are events, and the average of u_x is an
unknown.  A disturbance of the cycle decays with the slip path, by exp(-2 pi v~) a cycle in continuous sliding, so
the cost grows as v~ falls; for the same reason two cycles agree to 1e-9 while both are 1e-9 / (2 pi v~) off.
"""

import math
from dataclasses import dataclass
from typing import Any

from scipy.integrate import solve_ivp

RTOL, ATOL, AGREE = 1e-9, 1e-12, 1e-9
PERIOD = 2.0 * math.pi


@dataclass(frozen=True)
class Marched:
    """mu~ of the last cycle [-], cycles marched, and whether two successive averages agreed."""

    mu_ratio: float
    cycles: int
    agreed: bool


def march(v: float, y: float, max_step: float = math.inf) -> Marched:
    """Steady mu~ at v~ = ``v``, y~ = ``y`` by marching whole cycles from an unloaded spring (eqs. (9)-(12), (15)).

    Gives up after 20 + 6/v~ cycles, several times the number for the decay exp(-2 pi v~) a cycle.  That happens beside
    the border, where steps of any length jump over short windows of stick; ``max_step`` = 0.1 rad avoids it for 2 to 4
    times the cost.
    """

    def stick(tau: float, s: Any) -> list[float]:
        return [v, y * math.cos(tau), s[0]]

    def slip(tau: float, s: Any) -> list[float]:
        c, n = math.cos(s[0]), math.sin(s[0])
        return [-v * n + y * math.cos(tau) * c, c]

    def full(_tau: float, s: Any) -> float:
        return float(s[0] * s[0] + s[1] * s[1] - 1.0)

    def speed(tau: float, s: Any) -> float:
        return v * math.cos(s[0]) + y * math.cos(tau) * math.sin(s[0])

    full.terminal, full.direction = True, 1.0  # type: ignore[attr-defined]
    speed.terminal, speed.direction = True, -1.0  # type: ignore[attr-defined]
    max_cycles = 20 + math.ceil(6.0 / v)
    state: tuple[float, ...] = (0.0, 0.0)
    sticking, before = True, math.inf
    for cycle in range(1, max_cycles + 1):
        tau, total = 0.0, 0.0
        while tau < PERIOD:
            law, event, start = (stick, full, [*state, total]) if sticking else (slip, speed, [*state, total])
            options: Any = {"rtol": RTOL, "atol": ATOL, "max_step": max_step}
            run = solve_ivp(law, (tau, PERIOD), start, method="DOP853", events=event, **options)
            tau, total = float(run.t[-1]), float(run.y[-1, -1])
            if sticking:
                state = (float(run.y[0, -1]), float(run.y[1, -1]))
                if run.status == 1:
                    sticking, state = False, (math.atan2(state[1], state[0]),)
            else:
                state = (float(run.y[0, -1]),)
                if run.status == 1:
                    sticking, state = True, (math.cos(state[0]), math.sin(state[0]))
        average = total / PERIOD
        if abs(average - before) <= AGREE:
            return Marched(average, cycle, True)
        before = average
    return Marched(before, max_cycles, False)

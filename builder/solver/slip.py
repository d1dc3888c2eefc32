"""Define the equations of motion of one half period of slip, and find where it ends.

Time is sigma = tau - pi/2, so that the shaker turns at sigma = 0 and cos tau = -sin sigma is exact
near the turn.  The elongation during slip is u = (cos th, sin th).  Angles are kept in one of three
charts, th = base + x with base 0, +pi/2 or -pi/2 (chart 0, +1, -1), so that whichever of u_x, u_y,
1 - u_x is small keeps all its digits.  The equations are those of Benad, Nakano, Popov, Popov
(2018), eqs. (9)-(12), (15).

Everything in this module is compiled; arguments are float64 scalars, dimensionless: v = v~, y = y~.
"""

import math
from typing import Any

import numpy as np

from . import series
from .compiled import solver_kernel
from .radau import collocate

STIFF = 60.0  # relaxation lengths in a step from which collocation is cheaper than Taylor steps
# number of relaxation lengths after which the initial state has decayed below rounding, exp(-38) =
# 3e-17
FORGOTTEN = 38.0
MAX_STEPS = 10_000
# below these v~ and y~ EXCESS is followed; u stays in chart 0, stick included
SMALL_V, SMALL_Y = 0.05, 0.3

OK = 0
NO_SLIP = 1  # the stick phase never reaches the friction limit
NO_STICK = 2  # slip does not end within a period
TOO_MANY_STEPS = 3
DIVERGED = 4  # collocation did not converge

# Slip writes into ``out`` (12,): sigma [rad], local angle x [rad] and chart where it ended;
# increment of the angle [rad]; integrals over sigma of u_x, 1 - u_x, lam (the slip path in l0) and
# y~ cos tau u_y (the shaker's work); the smallest lam; angle th [rad] where lam first falls below
# zero, otherwise NaN; steps; integral of lam (1 - u_x).
SIGMA, ANGLE, CHART, TURNED, SUM_UX, SUM_DEFICIT, PATH, WORK, MIN_SPEED, FALL, STEPS, EXCESS = (
    range(12)
)

# Arguments of slip.  They are NumPy scalars, because numba compiles a function again for every
# literal int and bool.
HERE: Any = np.int64(0)  # time counts from the turn of the shaker at sigma = 0
FRONT: Any = np.int64(0)  # chart of small angles
SIDE: Any = np.int64(1)  # chart of angles next to pi/2
TO_STICK: Any = np.bool_(True)
ALL_THE_WAY: Any = np.bool_(False)


@solver_kernel
def rechart(x: float, chart: int, target: int) -> float:
    """Return the local angle of the same direction in another chart [rad]."""
    return x + (chart - target) * (0.5 * math.pi)


@solver_kernel
def _standstill(w: np.ndarray, h: float, out: np.ndarray) -> float:
    """Return the time [rad] within the step ``h`` at which lam falls below zero, -1 if it does not;
    update the smallest lam.

    Next to the border lam is negative for a moment between two positive ends, so the minimum is
    found first.
    """
    lam, rate, stop = w[series.SPEED], w[series.SPEED_RATE], -1.0
    end, s0, s1 = series.value(lam, h), lam[1], series.slope(lam, h)
    if s0 < 0.0 < s1 or (end < 0.0 and lam[0] <= 0.0):
        series.derivative(lam, rate)
    if s0 < 0.0 < s1:
        t = series.root(rate, 0.0, h)
        low = series.value(lam, t)
        out[MIN_SPEED] = min(out[MIN_SPEED], low)
        if low < 0.0 and lam[0] > 0.0:
            stop = series.root(lam, 0.0, t)
    out[MIN_SPEED] = min(out[MIN_SPEED], end, lam[0])
    if stop < 0.0 and end < 0.0:
        if lam[0] > 0.0:
            stop = series.root(lam, 0.0, h)
        elif s0 > 0.0:  # rises from zero first: the crossing is beyond the maximum
            t = series.root(rate, 0.0, h) if s1 < 0.0 else h
            stop = series.root(lam, t, h) if series.value(lam, t) > 0.0 else 0.0
        else:
            stop = 0.0
    return stop


@solver_kernel
def _add_integrals(
    y: float, chart: int, h: float, excess: bool, w: np.ndarray, out: np.ndarray
) -> None:
    """Add the integrals over a Taylor step of length ``h`` [rad] to ``out``; EXCESS only if
    ``excess``."""
    if chart == FRONT:
        d = series.integral(w[series.DEFICIT_X], h)
        out[SUM_UX] += h - d
        out[SUM_DEFICIT] += d
        out[WORK] += y * series.integral(w[series.C_SIN], h)
        if excess:
            out[EXCESS] += series.integral_of_product(w[series.SPEED], w[series.DEFICIT_X], h)
    else:
        s = series.integral(w[series.SIN_X], h) * chart
        out[SUM_UX] -= s
        out[SUM_DEFICIT] += h + s
        out[WORK] += y * chart * series.integral(w[series.C_COS], h)
    out[PATH] += series.integral(w[series.SPEED], h)


@solver_kernel
def _stiff_length(sigma: float, ratio: float, remaining: float) -> float:
    """Return the length of a collocation step [rad] from ``sigma``; the turn's layer is ``ratio`` =
    v~/y~ [rad] wide."""
    gap = math.hypot(sigma, ratio) if ratio < 1.0 else 1.0
    # after a turn a step may be as long as the distance from it; before the next turn half of the
    # distance to it
    ahead = 0.5 * (math.pi - sigma) if sigma > 0.0 else 0.5 * gap
    return min(gap, max(ahead, 0.5 * gap) if sigma > 0.0 else ahead, remaining, 0.8)


@solver_kernel
def slip(
    v: float,
    y: float,
    sigma: float,
    turn: int,
    x: float,
    chart: int,
    end: float,
    to_stick: bool,
    w: np.ndarray,
    out: np.ndarray,
) -> int:
    """Follow the slip orbit, eq. (11), from (sigma + turn pi, chart base + x) to ``end``, or to the
    first lam = 0 if ``to_stick``.

    ``turn`` is 0 or -1: time counts from the nearer turn of the shaker, whose layers are as thin as
    1/sqrt(y~).  ``w`` (9, ORDER + 2) is workspace; ``out`` (12,) receives the end and the
    integrals.  Return a status.
    """
    out[TURNED:MIN_SPEED] = 0.0
    out[MIN_SPEED], out[FALL], out[EXCESS] = math.inf, math.nan, 0.0
    ratio, layer, steps = v / y, min(0.3, 10.0 / math.sqrt(y)), 0
    while steps <= MAX_STEPS:
        if abs(x) > 0.9:
            # a quarter turn back from chart +-1 leads to 0; a larger one leaves the half plane u_x
            # > 0
            target = (1 if x > 0.0 else -1) if chart == FRONT else 0
            x, chart = rechart(x, chart, target), target
        if turn < 0 and sigma > 0.5 * math.pi:
            sigma, turn = sigma - math.pi, 0
        sign = -1.0 if turn == 0 else 1.0
        series.series(v, y, sign * math.sin(sigma), sign * math.cos(sigma), x, chart, w)
        lam = w[series.SPEED, 0]
        h = series.step_length(w, layer, lam)
        remaining = end - (sigma + turn * math.pi)
        jump, stop = _stiff_length(sigma, ratio, remaining), -1.0
        if lam * jump > STIFF and out[PATH] > FORGOTTEN:
            last, h = jump == remaining, jump
            x_end, least = collocate(v, y, sign, sigma, x, chart, jump, out[SUM_UX : WORK + 1])
            if math.isnan(x_end):
                return DIVERGED
            out[MIN_SPEED] = min(out[MIN_SPEED], least)
            angle, x = x_end - x, x_end
        else:
            last = h >= remaining
            h = remaining if last else h
            stop = _standstill(w, h, out)
            if stop >= 0.0 and not to_stick:
                if math.isnan(out[FALL]):
                    out[FALL] = chart * 0.5 * math.pi + series.value(w[series.X], stop)
                stop = -1.0
            h = stop if stop >= 0.0 else h
            _add_integrals(y, chart, h, v < SMALL_V and y < SMALL_Y, w, out)
            angle = series.increment(w[series.X], h)
            x += angle
        out[TURNED] += angle
        steps += 1
        if stop < 0.0 and last and to_stick:
            return NO_STICK
        if stop >= 0.0 or last:
            sigma = sigma + h if stop >= 0.0 else end - turn * math.pi
            out[SIGMA], out[ANGLE], out[CHART], out[STEPS] = sigma + turn * math.pi, x, chart, steps
            return OK
        sigma += h
    return TOO_MANY_STEPS

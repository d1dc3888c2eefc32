"""Compute Taylor series of the slip orbit over one step, and their values, integrals and roots.

Every polynomial is a row (ORDER + 2,) of the workspace ``w``, its coefficients in powers of the
time [rad] since the start of the step.  Equations: Benad, Nakano, Popov, Popov (2018), (11), (12);
symbols as in :mod:`.slip`.
"""

import math

import numpy as np

from .compiled import solver_kernel

# order of the Taylor series; 20 to 28 cost the same within 10 %, see benchmarks/solver.py
ORDER = 24
TRUNCATION = 2e-17  # last Taylor term relative to the increment over the step

# Rows of ``w`` (9, ORDER + 2): x, sin x, 1 - cos x, x', C = cos tau, C sin x, C cos x, lam; lam' by
# derivative() only.
X, SIN_X, DEFICIT_X, RATE, COS_TAU, C_SIN, C_COS, SPEED, SPEED_RATE = range(9)

_INV = np.array([0.0] + [1.0 / k for k in range(1, ORDER + 3)])


@solver_kernel
def series(v: float, y: float, c0: float, c1: float, x: float, chart: int, w: np.ndarray) -> None:
    """Write the Taylor coefficients at one point of the slip orbit, eqs. (11), (12), into the rows
    of ``w`` (9, ORDER + 2).

    ``x`` [rad] is the local angle in ``chart``; c0, c1 [-] = cos tau and its derivative there.
    """
    x_, S, D, XP, C, CS, CD, L = (
        w[X],
        w[SIN_X],
        w[DEFICIT_X],
        w[RATE],
        w[COS_TAU],
        w[C_SIN],
        w[C_COS],
        w[SPEED],
    )
    half = math.sin(0.5 * x)
    x_[0], S[0], D[0], C[0], C[1] = x, math.sin(x), 2.0 * half * half, c0, c1
    for k in range(ORDER - 1):
        C[k + 2] = -C[k] * _INV[k + 1] * _INV[k + 2]
    for k in range(ORDER + 1):
        cs = 0.0
        cd = C[k]
        for j in range(k + 1):
            cs += C[j] * S[k - j]
            cd -= C[j] * D[k - j]
        along, across = v * ((1.0 if k == 0 else 0.0) - D[k]) + y * cs, y * cd - v * S[k]
        xp, speed = (
            (across, along) if chart == 0 else (-along, across) if chart > 0 else (along, -across)
        )
        CS[k], CD[k], XP[k], L[k] = cs, cd, xp, speed
        if k < ORDER:
            sn, dn = xp, 0.0
            for j in range(k + 1):
                sn -= D[j] * XP[k - j]
                dn += S[j] * XP[k - j]
            x_[k + 1], S[k + 1], D[k + 1] = xp * _INV[k + 1], sn * _INV[k + 1], dn * _INV[k + 1]


@solver_kernel
def increment(p: np.ndarray, t: float) -> float:
    """Return p(t) - p(0), computed without a difference, from the Taylor coefficients ``p`` (ORDER
    + 2,) at a time ``t`` [rad] into the step."""
    r: float = p[ORDER]
    for k in range(ORDER - 1, 0, -1):
        r = r * t + p[k]
    return r * t


@solver_kernel
def value(p: np.ndarray, t: float) -> float:
    """Return p(t), in the way of :func:`increment`."""
    r: float = increment(p, t) + p[0]
    return r


@solver_kernel
def slope(p: np.ndarray, t: float) -> float:
    """Return p'(t), in the way of :func:`increment`."""
    r: float = ORDER * p[ORDER]
    for k in range(ORDER - 1, 0, -1):
        r = r * t + k * p[k]
    return r


@solver_kernel
def integral(p: np.ndarray, t: float) -> float:
    """Return the integral of p from 0 to ``t``, in the way of :func:`increment`."""
    r: float = p[ORDER] * _INV[ORDER + 1]
    for k in range(ORDER - 1, -1, -1):
        r = r * t + p[k] * _INV[k + 1]
    return r * t


@solver_kernel
def integral_of_product(p: np.ndarray, q: np.ndarray, t: float) -> float:
    """Return the integral of p q from 0 to ``t``, to the order of the series."""
    r = 0.0
    for k in range(ORDER, -1, -1):
        c = 0.0
        for j in range(k + 1):
            c += p[j] * q[k - j]
        r = r * t + c * _INV[k + 1]
    return r * t


@solver_kernel
def root(p: np.ndarray, lo: float, hi: float) -> float:
    """Return the root of p in [lo, hi], where the sign changes, by Newton's method kept inside the
    bracket."""
    up = value(p, hi) > 0.0
    t = 0.5 * (lo + hi)
    # the window of slip may be as short as 1e-30: bisection alone must find it
    for _ in range(300):
        f = value(p, t)
        lo, hi = (lo, t) if (f > 0.0) == up else (t, hi)
        g = slope(p, t)
        new = t - f / g if g != 0.0 else lo - 1.0
        if not (lo < new < hi):
            new = 0.5 * (lo + hi)
        if abs(new - t) <= 2e-16 * abs(new) or hi - lo <= 2e-16 * hi:
            return new
        t = new
    return t


@solver_kernel
def derivative(p: np.ndarray, q: np.ndarray) -> None:
    """Write p' into ``q``."""
    for k in range(ORDER):
        q[k] = (k + 1) * p[k + 1]
    q[ORDER] = 0.0


@solver_kernel
def step_length(w: np.ndarray, layer: float, lam: float) -> float:
    """Return the step [rad] for which the last terms are below TRUNCATION and the explicit series
    stays stable at ``lam`` [-].

    Where x' passes zero, x'' and the time ``layer`` [rad] (at most the width of the layers) limit
    the increment.
    """
    x, h = w[X], 0.9
    scale = max(abs(x[1]), layer * abs(x[2]))
    for k in (ORDER - 1, ORDER):
        top = max(abs(x[k]), abs(w[DEFICIT_X, k]))
        h = min(h, (TRUNCATION * scale / top) ** (1.0 / (k - 1)))
    return min(h, 0.33 * ORDER / lam) if lam > 0.0 else h

"""Equations of motion of one half period: stick in closed form, slip by Taylor series, events on the local polynomial.

Time is sigma = tau - pi/2, so that the shaker turns at sigma = 0 and cos tau = -sin sigma is exact near the turn.
The foot's deflection during slip is u = (cos th, sin th).  Angles are kept in one of three charts,
th = base + x with base 0, +pi/2 or -pi/2 (chart 0, +1, -1), so that whichever of u_x, u_y, 1 - u_x is small keeps
all its digits.  Source of the equations: Benad, Nakano, Popov, Popov (2018), eqs. (9)-(12), (15).

Everything here is compiled; arguments are float64 scalars, dimensionless: v = v~, y = y~.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from builder.radau import RADAU_DIFF, RADAU_NODES, RADAU_WEIGHTS

ORDER = 24  # of the Taylor series; 20 to 28 cost the same within 10 %, see benchmarks/solver.py
TRUNCATION = 2e-17  # last Taylor term relative to the increment over the step
STIFF = 60.0  # relaxation lengths in a step from which collocation is cheaper than Taylor steps
FORGOTTEN = 38.0  # relaxation lengths after which a start has decayed below rounding, exp(-38) = 3e-17
MAX_STEPS = 10_000

OK = 0
NO_SLIP = 1  # the stick phase never reaches the friction limit
NO_STICK = 2  # slip does not end within a period
TOO_MANY_STEPS = 3
DIVERGED = 4  # collocation or root-finding did not converge

_INV = np.array([0.0] + [1.0 / k for k in range(1, ORDER + 3)])
_N = RADAU_NODES.size


@njit(cache=True, error_model="numpy")
def rechart(x: float, chart: int, target: int) -> float:
    """Local angle of the same direction in another chart [rad]."""
    return x + (chart - target) * (0.5 * math.pi)


@njit(cache=True, error_model="numpy")
def series(v: float, y: float, c0: float, c1: float, x: float, chart: int, w: np.ndarray) -> None:
    """Taylor coefficients at one point of the slip orbit, eqs. (11), (12); c0, c1 = cos tau and its derivative there.

    ``w`` has shape (8, ORDER + 2) and receives rows x, sin x, 1 - cos x, x', C = cos tau, C sin x, C cos x, lam.
    """
    X, S, D, XP, C, CS, CD, L = w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7]
    X[0] = x
    S[0] = math.sin(x)
    half = math.sin(0.5 * x)
    D[0] = 2.0 * half * half
    C[0] = c0
    C[1] = c1
    for k in range(ORDER - 1):
        C[k + 2] = -C[k] * _INV[k + 1] * _INV[k + 2]
    for k in range(ORDER + 1):
        cs = 0.0
        cd = C[k]
        for j in range(k + 1):
            cs += C[j] * S[k - j]
            cd -= C[j] * D[k - j]
        CS[k] = cs
        CD[k] = cd
        one = 1.0 if k == 0 else 0.0
        if chart == 0:
            xp = y * cd - v * S[k]
            L[k] = v * (one - D[k]) + y * cs
        elif chart > 0:
            xp = -v * (one - D[k]) - y * cs
            L[k] = y * cd - v * S[k]
        else:
            xp = v * (one - D[k]) + y * cs
            L[k] = v * S[k] - y * cd
        XP[k] = xp
        if k < ORDER:
            sn = xp
            dn = 0.0
            for j in range(k + 1):
                sn -= D[j] * XP[k - j]
                dn += S[j] * XP[k - j]
            X[k + 1] = xp * _INV[k + 1]
            S[k + 1] = sn * _INV[k + 1]
            D[k + 1] = dn * _INV[k + 1]


@njit(cache=True, error_model="numpy")
def _value(p: np.ndarray, t: float) -> float:
    r: float = p[ORDER]
    for k in range(ORDER - 1, -1, -1):
        r = r * t + p[k]
    return r


@njit(cache=True, error_model="numpy")
def _slope(p: np.ndarray, t: float) -> float:
    r: float = ORDER * p[ORDER]
    for k in range(ORDER - 1, 0, -1):
        r = r * t + k * p[k]
    return r


@njit(cache=True, error_model="numpy")
def _integral(p: np.ndarray, t: float) -> float:
    r: float = p[ORDER] * _INV[ORDER + 1]
    for k in range(ORDER - 1, -1, -1):
        r = r * t + p[k] * _INV[k + 1]
    return r * t


@njit(cache=True, error_model="numpy")
def _increment(p: np.ndarray, t: float) -> float:
    """p(t) - p(0) without forming the difference."""
    r: float = p[ORDER]
    for k in range(ORDER - 1, 0, -1):
        r = r * t + p[k]
    return r * t


@njit(cache=True, error_model="numpy")
def _root(p: np.ndarray, lo: float, hi: float, derivative: bool) -> float:
    """Root of p (or of p') in [lo, hi], where the sign changes: Newton kept inside the bracket."""
    up = (_slope(p, hi) if derivative else _value(p, hi)) > 0.0
    t = 0.5 * (lo + hi)
    for _ in range(1100):  # the window of slip may be as short as 1e-150: bisection alone must get there
        f = _slope(p, t) if derivative else _value(p, t)
        if (f > 0.0) == up:
            hi = t
        else:
            lo = t
        g = 0.0
        if derivative:
            g = ORDER * (ORDER - 1) * p[ORDER]
            for k in range(ORDER - 1, 1, -1):
                g = g * t + k * (k - 1) * p[k]
        else:
            g = _slope(p, t)
        new = t - f / g if g != 0.0 else lo - 1.0
        if not (lo < new < hi):
            new = 0.5 * (lo + hi)
        if abs(new - t) <= 2e-16 * abs(new) or hi - lo <= 2e-16 * hi:
            return new
        t = new
    return t


@njit(cache=True, error_model="numpy")
def _step_length(w: np.ndarray, lam: float) -> float:
    """Step for which the last terms are below TRUNCATION and the explicit series stays stable."""
    X = w[0]
    scale = max(abs(X[1]), 0.3 * abs(X[2]))
    if scale == 0.0:
        scale = abs(X[3])
    h = 0.9
    for k in (ORDER - 1, ORDER):
        top = max(abs(X[k]), abs(w[2][k]))
        if top > 0.0:
            h = min(h, (TRUNCATION * scale / top) ** (1.0 / (k - 1)))
    return min(h, 0.33 * ORDER / lam) if lam > 0.0 else h


@njit(cache=True, error_model="numpy")
def _collocate(
    v: float, y: float, sign: float, sigma: float, x0: float, chart: int, length: float, out: np.ndarray
) -> bool:
    """One stiff step: Radau IIA collocation, started on the slow manifold th = atan2(y cos tau, v).

    cos tau = sign sin sigma.

    ``out`` (5,) receives x_end and the integrals of u_x, 1 - u_x, lam and y cos tau u_y.
    """
    xs = np.empty(_N)
    base = chart * (0.5 * math.pi)
    for i in range(_N):
        s = sigma + RADAU_NODES[i] * length
        xs[i] = math.atan2(sign * y * math.sin(s), v) - base
    jac = np.empty((_N, _N))
    res = np.empty(_N)
    for it in range(12):
        for i in range(_N):
            s = sigma + RADAU_NODES[i] * length
            c = sign * math.sin(s)
            sx = math.sin(xs[i])
            cx = math.cos(xs[i])
            if chart == 0:
                f = y * c * cx - v * sx
                lam = v * cx + y * c * sx
            elif chart > 0:
                f = -v * cx - y * c * sx
                lam = y * c * cx - v * sx
            else:
                f = v * cx + y * c * sx
                lam = v * sx - y * c * cx
            acc = RADAU_DIFF[i, 0] * x0
            for j in range(_N):
                acc += RADAU_DIFF[i, j + 1] * xs[j]
                jac[i, j] = RADAU_DIFF[i, j + 1]
            jac[i, i] += lam * length
            res[i] = acc - f * length
        dx = np.linalg.solve(jac, res)
        worst = 0.0
        for i in range(_N):
            xs[i] -= dx[i]
            worst = max(worst, abs(dx[i]))
        if worst < 1e-9:
            break
        if it == 11 or not worst < 1e3:
            return False
    out[:] = 0.0
    for i in range(_N):
        s = sigma + RADAU_NODES[i] * length
        c = sign * math.sin(s)
        sx = math.sin(xs[i])
        cx = math.cos(xs[i])
        wt = RADAU_WEIGHTS[i] * length
        if chart == 0:
            ux, uy, deficit = cx, sx, 2.0 * math.sin(0.5 * xs[i]) ** 2
        elif chart > 0:
            ux, uy, deficit = -sx, cx, 1.0 + sx
        else:
            ux, uy, deficit = sx, -cx, 1.0 - sx
        out[1] += wt * ux
        out[2] += wt * deficit
        out[3] += wt * (v * ux + y * c * uy)
        out[4] += wt * y * c * uy
    out[0] = xs[_N - 1]
    return True


@njit(cache=True, error_model="numpy")
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
    """Slip orbit from (sigma + turn pi, chart base + x) to ``end``, or to the first lam = 0 if ``to_stick``.

    ``turn`` is 0 or -1: time counts from the nearer turn of the shaker, whose layers are as thin as 1/sqrt(y~).

    ``w`` is workspace of shape (8, ORDER + 2).  ``out`` (11,) receives: 0 sigma at the end, 1 local angle, 2 chart,
    3 increment of the angle, 4-7 the integrals of u_x, 1 - u_x, lam and y cos tau u_y, 8 smallest lam on the way,
    9 angle th where lam first falls below zero if the orbit was followed beyond it, 10 number of steps.
    Returns a status.
    """
    out[3:8] = 0.0
    out[8] = math.inf
    out[9] = math.nan
    ratio = v / y if y > 0.0 else math.inf
    stiff = np.empty(5)
    steps = 0
    while True:
        if abs(x) > 0.9:
            target = (1 if x > 0.0 else -1) if chart == 0 else 0
            # a quarter turn back from chart +-1 leads to 0; further than that leaves the half plane u_x > 0
            x = rechart(x, chart, target)
            chart = target
        if turn < 0 and sigma > 0.5 * math.pi:
            sigma -= math.pi
            turn = 0
        sign = -1.0 if turn == 0 else 1.0
        series(v, y, sign * math.sin(sigma), sign * math.cos(sigma), x, chart, w)
        L = w[7]
        h = _step_length(w, L[0])
        left = end - (sigma + turn * math.pi)
        gap = math.hypot(sigma, ratio) if ratio < 1.0 else 1.0
        # away from the turn behind a step may be as long as the way back to it; towards the next one half the way to it
        ahead = 0.5 * (math.pi - sigma) if sigma > 0.0 else 0.5 * gap
        jump = min(gap, max(ahead, 0.5 * gap) if sigma > 0.0 else ahead, left, 0.8)
        if L[0] * jump > STIFF and out[6] > FORGOTTEN:
            if not _collocate(v, y, sign, sigma, x, chart, jump, stiff):
                return DIVERGED
            out[3] += stiff[0] - x
            for i in range(4):
                out[4 + i] += stiff[1 + i]
            sigma = end - turn * math.pi if jump == left else sigma + jump
            x = stiff[0]
            steps += 1
            if jump == left:
                if to_stick:
                    return NO_STICK
                break
            continue
        last = h >= left
        if last:
            h = left
        stop = -1.0
        lo = _value(L, h)
        s0 = L[1]
        s1 = _slope(L, h)
        if s0 < 0.0 < s1:
            t = _root(L, 0.0, h, True)
            m = _value(L, t)
            out[8] = min(out[8], m)
            if m < 0.0 and L[0] > 0.0:
                stop = _root(L, 0.0, t, False)
        out[8] = min(out[8], lo, L[0])
        if stop < 0.0 and lo < 0.0:
            if L[0] > 0.0:
                stop = _root(L, 0.0, h, False)
            elif s0 > 0.0:  # rises from zero first: the crossing lies beyond the maximum
                t = _root(L, 0.0, h, True) if s1 < 0.0 else h
                stop = _root(L, t, h, False) if _value(L, t) > 0.0 else 0.0
            else:
                stop = 0.0
        if stop >= 0.0 and not to_stick:
            if math.isnan(out[9]):
                out[9] = chart * 0.5 * math.pi + _value(w[0], stop)
            stop = -1.0
        if stop >= 0.0:
            h = stop
        out[3] += _increment(w[0], h)
        D = w[2]
        if chart == 0:
            d = _integral(D, h)
            out[4] += h - d
            out[5] += d
            out[7] += y * _integral(w[5], h)
        else:
            s = _integral(w[1], h) * chart
            out[4] -= s
            out[5] += h + s
            out[7] += y * chart * _integral(w[6], h)
        out[6] += _integral(L, h)
        x += _increment(w[0], h)
        steps += 1
        if stop >= 0.0:
            sigma += h
            break
        sigma = end - turn * math.pi if last else sigma + h
        if last:
            if to_stick:
                return NO_STICK
            break
        if steps > MAX_STEPS:
            return TOO_MANY_STEPS
    out[0] = sigma + turn * math.pi
    out[1] = x
    out[2] = chart
    out[10] = steps
    return OK

"""The steady cycle at one (v~, y~) by root-finding on half a period; never by marching cycles.

Continuous sliding is a fixed point of the half-period map, th(tau + pi) = -th(tau), found by Newton's method with
d th_end / d th_start = exp(-integral of lam).  Stick-slip is a root on a one-dimensional section.  Two sections are
used, because neither is well conditioned everywhere:

* the *angle section*: unknown th0, the angle at which slip stops (lam = 0 ties sigma0 to it); used from the border down
  and for y~ > 1;
* the *time section*: unknown sigma1 < 0, the instant at which slip starts; used at creeping speeds for y~ <= 1 and in
  the corner, where the window in which |u| > 1 is far shorter than any scan step and th0 hardly moves.

``eta`` = y~ - 1 is an argument of its own: next to the corner rounding y~ to double costs 1e-16 / mu~.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from builder import model
from builder.model import FORGOTTEN, NO_SLIP, NO_STICK, OK, ORDER, rechart, slip

CONTINUOUS, STICK_SLIP = 0, 1
REGIMES = ("continuous", "stick_slip")

NOT_CONVERGED = 10
BAD_INPUT = 11

ADVICE = {
    OK: "solved",
    NO_SLIP: "the stick phase never reaches the friction limit: v~ is too small for doubles; use its limit 0",
    NO_STICK: "slip does not end within a period although the continuous orbit is not admissible",
    model.TOO_MANY_STEPS: "more than 10,000 Taylor steps in one half period: use the tail for large v~ or y~",
    model.DIVERGED: "the stiff step did not converge: use the tail for large v~ or y~",
    NOT_CONVERGED: "the section's root was not found to rounding: take the error estimate seriously",
    BAD_INPUT: "v~ must be finite and > 0, y~ must be finite and > 0",
}

BORDER_SLOPE = 0.4765728  # v~crit / sqrt(y~) for y~ -> infinity
BELOW_LINEAR = (
    1e-15  # of v~ at SMALLEST_Y, 2,000 times the border: below it 1 - mu~ no longer depends on v~ beyond v~^2
)
SMALLEST_Y = 1e-9  # below, 1 - mu~ = y~^2 h(v~/y~^2) holds to rounding and the problem is solved at this amplitude


@njit(cache=True, error_model="numpy")
def border_guess(y: float) -> float:
    """v~crit to about 15 %: the harmonic blend of both ends, eqs. (24), (26) with the exact constant."""
    return 1.0 / (2.0 / (y * y) + 1.0 / (BORDER_SLOPE * math.sqrt(y)))


@njit(cache=True, error_model="numpy")
def continuous(v: float, y: float, w: np.ndarray, out: np.ndarray) -> int:
    """Continuous orbit over sigma in [-pi/2, pi/2]; ``out`` as in :func:`builder.model.slip`."""
    th = math.atan(v * y / (1.0 + v * v))
    half = 0.5 * math.pi
    done = False
    for _ in range(60):
        chart = 0
        x = th
        if th > 0.75:
            chart = 1
            x = th - half
        status = slip(v, y, -half, 0, x, chart, half, False, w, out)
        if status != OK:
            return status
        x_end = out[1]
        chart_end = int(out[2])
        # residual th_end + th_start, formed in the mirrored chart so that small angles keep their digits
        res = rechart(x_end, chart_end, -chart) + x
        if done:
            return OK
        step = res / (1.0 + math.exp(-out[6]))
        th -= step
        scale = min(max(abs(th), y / math.sqrt(1.0 + v * v)), 1.0)
        if abs(step) < 1e-8 * scale or (out[6] > FORGOTTEN and abs(step) < 0.05):
            done = True
        if out[6] > FORGOTTEN:  # the start is forgotten within half a period: one more pass starts on the orbit
            th = -(x_end + chart_end * half)
    return NOT_CONVERGED


@njit(cache=True, error_model="numpy")
def _sinc(a: float) -> float:
    return 1.0 - a * a / 6.0 if abs(a) < 1e-4 else math.sin(a) / a


@njit(cache=True, error_model="numpy")
def _third(d: float) -> float:
    """(d - sin d) / d^2."""
    if d < 0.3:
        q = d * d
        return d * (1 / 6 - q * (1 / 120 - q * (1 / 5040 - q * (1 / 362880 - q * (1 / 39916800 - q / 6227020800)))))
    return (d - math.sin(d)) / (d * d)


@njit(cache=True, error_model="numpy")
def stick_excess(v: float, y: float, eta: float, x0: float, chart: int, s0: float, s1: float, d: float) -> float:
    """(|u|^2 - 1) / d^2 a time d after slip stopped at (s0, chart base + x0); s1 = s0 + d - pi.

    The double root at d = 0 is divided out with lam = 0 at the onset; at d = 0 this is d lam/d tau there.
    """
    half = _sinc(0.5 * d)
    h2 = half * half
    sth = math.sin(x0) if chart == 0 else math.cos(x0)
    if chart == 0 or d < 1.0:
        # a short stick: s1 counts from the far turn and has lost the digits that s0 + d still has
        c = math.sin(s0 + 0.5 * d) if d < 1.0 else math.cos(0.5 * (s0 + s1))
        m = y * c * c - sth * math.cos(s0)
    else:
        a, b, c = math.sin(0.5 * x0), math.sin(0.5 * s0), math.sin(0.5 * (s0 + s1))
        m = eta - y * c * c + 2.0 * a * a + 2.0 * b * b * (1.0 - 2.0 * a * a)
    return v * v + y * h2 * m + 2.0 * y * sth * math.sin(s0) * _third(d)


@njit(cache=True, error_model="numpy")
def _stick_end(v: float, y: float, eta: float, x0: float, chart: int, s0: float) -> tuple[float, float]:
    """Duration of stick and sigma at its end (shifted back by pi); (-1, 0) if the limit is not reached in time."""
    if stick_excess(v, y, eta, x0, chart, s0, s0 - math.pi, 0.0) >= 0.0:
        return 0.0, s0 - math.pi
    n = 24
    lo = 0.0
    hi = -1.0
    best, best_d = -math.inf, 0.0
    for i in range(1, n + 1):
        d = math.pi * i / n
        g = stick_excess(v, y, eta, x0, chart, s0, s0 + d - math.pi, d)
        if g > 0.0:
            hi = d
            break
        if g > best:
            best, best_d = g, d
        lo = d
    if hi < 0.0:
        # the window of |u| > 1 may be shorter than the scan: climb the largest sample by golden section
        a, b = max(best_d - math.pi / n, 0.0), best_d + math.pi / n
        for _ in range(80):
            c, e = b - 0.6180339887498949 * (b - a), a + 0.6180339887498949 * (b - a)
            gc = stick_excess(v, y, eta, x0, chart, s0, s0 + c - math.pi, c)
            ge = stick_excess(v, y, eta, x0, chart, s0, s0 + e - math.pi, e)
            if gc > 0.0 or ge > 0.0:
                hi = c if gc > 0.0 else e
                break
            if gc > ge:
                b = e
            else:
                a = c
        if hi < 0.0:
            return -1.0, 0.0
        lo = max(best_d - math.pi / n, 0.0)
    if hi > 2.0:
        # long stick: solve for sigma1 itself, which keeps its digits when it is small
        a, b = s0 + lo - math.pi, s0 + hi - math.pi
        fa = stick_excess(v, y, eta, x0, chart, s0, a, lo)
        fb = stick_excess(v, y, eta, x0, chart, s0, b, hi)
        s1 = _chandrupatla(v, y, eta, x0, chart, s0, a, b, fa, fb, True)
        return math.pi - s0 + s1, s1
    fa = stick_excess(v, y, eta, x0, chart, s0, s0 + lo - math.pi, lo)
    fb = stick_excess(v, y, eta, x0, chart, s0, s0 + hi - math.pi, hi)
    d = _chandrupatla(v, y, eta, x0, chart, s0, lo, hi, fa, fb, False)
    return d, s0 + d - math.pi


@njit(cache=True, error_model="numpy")
def _chandrupatla(
    v: float, y: float, eta: float, x0: float, chart: int, s0: float,
    a: float, b: float, fa: float, fb: float, in_sigma: bool,
) -> float:  # fmt: skip
    """Root of stick_excess in d (or in sigma1) between a and b: Chandrupatla's bracketed inverse interpolation."""
    x1, f1, x2, f2, x3, f3 = b, fb, a, fa, a, fa
    t = 0.5
    for _ in range(200):
        x = x1 + t * (x2 - x1)
        if in_sigma:
            f = stick_excess(v, y, eta, x0, chart, s0, x, math.pi - s0 + x)
        else:
            f = stick_excess(v, y, eta, x0, chart, s0, s0 + x - math.pi, x)
        if (f > 0.0) == (f1 > 0.0):
            x3, f3 = x1, f1
        else:
            x3, f3 = x2, f2
            x2, f2 = x1, f1
        x1, f1 = x, f
        best = x1 if abs(f1) < abs(f2) else x2
        tol = 2.0e-16 * abs(best)
        if f1 == 0.0 or abs(x2 - x1) <= 2.0 * tol:
            return best
        tl = tol / abs(x2 - x1)
        xi = (x1 - x2) / (x3 - x2)
        phi = (f1 - f2) / (f3 - f2)
        if phi * phi < xi and (1.0 - phi) * (1.0 - phi) < 1.0 - xi:
            t = f1 / (f2 - f1) * f3 / (f2 - f3) + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2)
        else:
            t = 0.5
        t = min(max(t, tl), 1.0 - tl)
    return x1


@njit(cache=True, error_model="numpy")
def _angle_section(
    v: float, y: float, eta: float, x0: float, chart: int, w: np.ndarray, out: np.ndarray, orbit: np.ndarray
) -> tuple[float, int]:
    """Return map's residual th_end - th0 for slip that stops at th0 = base + x0; x0 in chart 0, or delta = -x in 1.

    ``orbit`` (6,) receives stick duration, cos th0, 1 - cos th0, sin th0, sigma0, sigma1.
    """
    if chart == 0:
        sth, cth = math.sin(x0), math.cos(x0)
        a = math.sin(0.5 * x0)
        deficit = 2.0 * a * a
    else:
        sth, cth = math.cos(x0), math.sin(x0)
        deficit = 1.0 - cth
    q = v * cth / (y * sth)
    s0 = math.asin(min(q, 1.0))
    d, s1 = _stick_end(v, y, eta, x0, chart, s0)
    if d < 0.0:
        return -1.0, NO_SLIP
    orbit[0], orbit[1], orbit[2], orbit[3], orbit[4], orbit[5] = d, cth, deficit, sth, s0, s1
    # sigma1 counted from the nearer turn: after a short stick that is the one which slip came from
    turn = -1 if d < 0.5 * math.pi else 0
    near = s0 + d if turn < 0 else s1
    ux = cth + v * d
    uy = 2.0 * y * math.sin(s0 + 0.5 * d) * math.sin(0.5 * d) - sth  # mirrored
    if chart == 1 and uy > 0.0:
        d1 = math.asin(min(ux, 1.0))
        # 2 B = delta1 - delta0 from sin delta1 - sin delta0 = v d, free of cancellation
        b = math.asin(min(1.0, 0.5 * v * d / math.cos(0.5 * (x0 + d1))))
        status = slip(v, y, near, turn, -(x0 + 2.0 * b), 1, 0.5 * math.pi, True, w, out)
        return out[3] - 2.0 * b, status
    th1 = math.atan2(uy, ux)
    status = slip(v, y, near, turn, th1, 0, 0.5 * math.pi, True, w, out)
    if status != OK:
        return 0.0, status
    if chart == 1:
        return rechart(out[1], int(out[2]), 1) + x0, status
    return rechart(out[1], int(out[2]), 0) - x0, status


@njit(cache=True, error_model="numpy")
def _time_section(
    v: float, y: float, eta: float, s1: float, chart: int, w: np.ndarray, out: np.ndarray, orbit: np.ndarray
) -> tuple[float, int]:
    """Residual of the slip increment for slip that starts at sigma1 < 0 and closes the stick phase exactly.

    With A, B = (th0 +- th1)/2 the stick phase closes where 2 sin A sin B = v (pi - slip duration) and
    sin A cos B = y cos((s0 + s1)/2) cos((s0 - s1)/2); both are explicit once sigma0 is known, and sigma0 is small.
    """
    s0 = 0.0
    th0 = b = a_ang = 0.0
    for _ in range(100):
        s, h = 0.5 * (s0 + s1), 0.5 * (s0 - s1)
        cc = math.cos(s) * math.cos(h)
        gain = 0.5 * v * (math.pi - 2.0 * h)
        b = math.atan(gain / (y * cc))
        if chart == 0:
            sa = y * cc / math.cos(b)
            if sa > 1.0:
                return -1.0, NO_SLIP
            a_ang = math.asin(sa)
            th0 = a_ang + b
            ratio = v * math.cos(th0) / (y * math.sin(th0))
        else:
            ss, sh = math.sin(s), math.sin(h)
            ca2 = y * y * (ss * ss + (1.0 - ss * ss) * sh * sh) - eta * (2.0 + eta) - gain * gain
            if ca2 <= 0.0:
                return -1.0, NO_SLIP
            a_ang = math.asin(math.sqrt(ca2))
            th0 = a_ang - b
            if th0 <= 0.0:
                return -1.0, NO_SLIP
            ratio = v * math.tan(th0) / y
        new = math.asin(min(1.0, ratio))
        if abs(new - s0) <= 1e-16 * abs(new):
            s0 = new
            break
        s0 = new
    if chart == 0:
        sth, cth = math.sin(th0), math.cos(th0)
        k = math.sin(0.5 * th0)
        deficit = 2.0 * k * k
        start, base = a_ang - b, 0
    else:
        sth, cth = math.cos(th0), math.sin(th0)
        deficit = 1.0 - cth
        start, base = -(a_ang + b), 1
    orbit[0], orbit[1], orbit[2], orbit[3], orbit[4], orbit[5] = math.pi - s0 + s1, cth, deficit, sth, s0, s1
    status = slip(v, y, s1, 0, start, base, 0.5 * math.pi, True, w, out)
    return 2.0 * b - out[3], status


@njit(cache=True, error_model="numpy")
def _section(
    kind: int, v: float, y: float, eta: float, z: float, chart: int, w: np.ndarray, out: np.ndarray, orbit: np.ndarray
) -> tuple[float, int]:
    """Residual, increasing in z for every section and chart; z > 0."""
    if kind == 0:
        r, status = _angle_section(v, y, eta, z, chart, w, out, orbit)
        # in chart 0 the residual th_end - th0 falls with th0; delta = pi/2 - th0 turns the sign of z but not of r
        return (-r if chart == 0 else r), status
    r, status = _time_section(v, y, eta, -z, chart, w, out, orbit)
    return -r, status


@njit(cache=True, error_model="numpy")
def stick_slip(
    v: float, y: float, eta: float, hint: float, w: np.ndarray, out: np.ndarray, orbit: np.ndarray
) -> tuple[int, float]:
    """Steady stick-slip orbit; ``hint`` = th0 if something is known of it, else NaN.

    Returns the status and the relative uncertainty of the section's unknown.
    """
    guess = border_guess(y)
    ratio = v / guess
    # phi: the positive root of phi^3 - (1 - y^2) phi = pi v, the normal form of the corner and exact for v -> 0, y < 1
    gap = -eta * (2.0 + eta)
    phi = math.sqrt(max(gap, 0.0)) + (math.pi * v) ** (1.0 / 3.0)
    for _ in range(60):
        new = phi - (phi * (phi * phi - gap) - math.pi * v) / (3.0 * phi * phi - gap)
        if abs(new - phi) <= 1e-12 * phi:
            break
        phi = new
    kind = 1 if ratio < 0.15 and (eta <= 0.0 or (eta < 0.5 * phi * phi and phi < 0.5)) else 0
    chart = 0 if y < 0.7 else 1
    if kind == 1:
        z = math.sqrt(2.0 * math.pi * v / (y * y * phi))
        lo, hi = 0.0, 0.5 * math.pi
    elif chart == 0:
        z = math.asin(min(1.0, y * (1.0 - 0.2 * min(ratio, 1.0))))
        lo, hi = 0.0, 0.5 * math.pi
    else:
        z = math.atan(v / y) + (phi if eta < 0.5 else v / y)
        z = min(z, 0.7)
        lo, hi = 0.0, 0.5 * math.pi
    near = kind == 0 and not math.isnan(hint)
    if kind == 0:
        if near:
            z = hint if chart == 0 else 0.5 * math.pi - hint
        # edge of the section: lam = 0 = lam' there, (v / sin th)^2 = y sin th cos sigma0; beyond it no stick starts
        a, b = math.atan(v / y), 0.5 * math.pi
        for _ in range(60):
            m = 0.5 * (a + b)
            sm = math.sin(m)
            q = v * math.cos(m) / (y * sm)
            if q < 1.0 and (v / sm) ** 2 < y * sm * math.sqrt(1.0 - q * q):
                b = m
            else:
                a = m
            if b - a < 2e-16 * a:
                break
        if chart == 0:
            lo = b
        else:
            hi = 0.5 * math.pi - b
    if not (lo < z < hi):
        z = 0.5 * (lo + hi)
    z_old = z
    f_old = math.inf
    spread = before = math.inf
    for it in range(200):
        f, status = _section(kind, v, y, eta, z, chart, w, out, orbit)
        if status in (NO_SLIP, NO_STICK):
            # no slip: th0 too large, or sigma1 too close to zero.  No stick: next to the border slip misses lam = 0
            # when th0 is too large, since the half-period map turns the order of orbits round there
            if kind == 0 and chart == 0:
                hi = z
            else:
                lo = z
            z = 0.5 * (lo + hi)
            f_old = math.inf
            continue
        if status != OK:
            return status, math.inf
        if f > 0.0:
            hi = z
        else:
            lo = z
        if f == 0.0 or spread * before < 1e-17:
            # the secant method's error is about the product of its last two steps: this evaluation is the answer
            return OK, 2e-16
        secant = False
        if f_old == math.inf:
            if kind == 0 and (near or abs(f) > 1e-3 * z):
                # the map contracts: its own image is the next trial; next to the border it also turns orbits round
                new = z - (0.6 * f if near else f)
            else:
                new = z * (0.98 if f > 0.0 else 1.02)
        else:
            secant = f != f_old
            new = z - f * (z - z_old) / (f - f_old) if secant else z
        if not (lo <= new <= hi):
            secant = False
            new = 0.5 * (lo + hi)
            if lo == 0.0 and it < 40:
                new = 0.1 * hi
        if hi - lo <= 4e-16 * hi or new == z:
            return OK, 2e-16
        # only a secant step tells how far the root still is
        before = spread
        spread = abs(new - z) / abs(new) if secant else math.inf
        z_old, f_old, z = z, f, new
    return NOT_CONVERGED, spread


@njit(cache=True, error_model="numpy")
def _sliding(out: np.ndarray, res: np.ndarray) -> None:
    """Results of continuous sliding but the smallest slip speed, from what :func:`continuous` left in ``out``."""
    mean = 1.0 / math.pi
    res[0] = out[4] * mean
    res[1] = out[5] * mean
    res[2] = 0.0
    res[3] = 0.0
    res[4] = out[7] * mean
    res[5] = out[6] * mean
    res[7] = 4e-16
    if res[1] < 0.5:
        res[0] = 1.0 - res[1]


@njit(cache=True, error_model="numpy")
def _unshrink(res: np.ndarray, shrink: float, v: float, solved: float) -> None:
    """From the amplitude SMALLEST_Y back to ``shrink`` times it; ``solved`` is the v~ that stood in for ``v``."""
    if shrink != 1.0:
        square = shrink * shrink
        res[1] *= square
        res[4] *= square
        res[0] = 1.0 - res[1]
        if solved < BELOW_LINEAR:  # v~ was scaled with the square of the amplitude, and all speeds with it
            res[5] *= square
            res[6] *= square
        else:  # far in continuous sliding: only what the oscillation adds is quadratic
            res[5] = v * res[0] + res[4]
            res[6] = v - (solved - res[6]) * square


@njit(cache=True, error_model="numpy")
def border_raw(y: float, w: np.ndarray, out: np.ndarray) -> tuple[float, float, int]:
    """(v~crit, mu~ there, status): where the smallest slip speed of the continuous orbit reaches zero."""
    guess = border_guess(y)
    lo, hi = 0.7 * guess, 1.4 * guess
    z, z_old, f_old = 1.02 * guess, 0.0, math.inf
    for _ in range(100):
        status = continuous(z, y, w, out)
        if status != OK:
            return math.nan, math.nan, status
        f = out[8]
        if f > 0.0:
            hi = z
        else:
            lo = z
        if f == 0.0 or (f_old < math.inf and abs(z - z_old) <= 1e-9 * z):
            if f not in (0.0, f_old):  # both at rounding level: z is the answer
                z -= f * (z - z_old) / (f - f_old)
            mu = out[4] / math.pi
            return z, (1.0 - out[5] / math.pi if mu > 0.5 else mu), OK
        new = z - f * (z - z_old) / (f - f_old) if f_old < math.inf else z * (0.99 if f > 0.0 else 1.01)
        if not (lo < new < hi):
            new = 0.5 * (lo + hi)
        z_old, f_old, z = z, f, new
    return z, out[4] / math.pi, NOT_CONVERGED


@njit(cache=True, error_model="numpy")
def solve_raw(
    v: float, y: float, eta: float, w: np.ndarray, out: np.ndarray, orbit: np.ndarray, res: np.ndarray
) -> int:
    """Steady state; ``res`` (8,) receives mu~, 1 - mu~, regime, stick fraction, oscillation power <y~ cos tau u_y>,
    mean slip path per radian <lam>, smallest lam of the continuous orbit (NaN if not followed), error estimate."""
    res[:] = math.nan
    if not (0.0 < v < math.inf and 0.0 < y < math.inf):
        return BAD_INPUT
    shrink = 1.0
    given = v
    if y < SMALLEST_Y:
        shrink = y / SMALLEST_Y
        # in stick-slip v~ scales with y~^2; in continuous sliding the response is linear at any v~
        scaled = (v / shrink) / shrink
        v = scaled if scaled < BELOW_LINEAR else max(v, BELOW_LINEAR)
        y = SMALLEST_Y
        eta = y - 1.0
    guess = border_guess(y)
    hint = math.nan
    if v > 0.75 * guess:
        status = continuous(v, y, w, out)
        if status != OK:
            return status
        res[6] = out[8]
        if out[8] >= 0.0:
            _sliding(out, res)
            _unshrink(res, shrink, given, v)
            return OK
        hint = out[9]
    status, spread = stick_slip(v, y, eta, hint, w, out, orbit)
    if status != OK and res[6] > -1e-13 * v:
        # the last digit below the border: the section ends where its root lies, and the two orbits are one to rounding
        status = continuous(v, y, w, out)
        if status == OK:
            _sliding(out, res)
            _unshrink(res, shrink, given, v)
        return status
    if status != OK and status != NOT_CONVERGED:
        return status
    d, cth, deficit = orbit[0], orbit[1], orbit[2]
    # Next to the border lam grazes zero and the end of slip is known to 1e-16/sqrt(1 - v~/v~crit) only; the state there
    # is known far better, so the surplus is taken out and stick and slip together last exactly half a period.
    surplus = out[0] - orbit[4]
    out[4] -= surplus * cth
    out[5] -= surplus * deficit
    out[7] += surplus * y * math.sin(orbit[4]) * orbit[3]
    mean = 1.0 / math.pi
    res[0] = (d * (cth + 0.5 * v * d) + out[4]) * mean
    res[1] = (d * (deficit - 0.5 * v * d) + out[5]) * mean
    res[2] = 1.0
    res[3] = d * mean
    # during stick the spring takes up and returns the same energy, so the shaker's work is minus the drive's
    res[4] = (out[7] - v * d * (cth + 0.5 * v * d)) * mean
    res[5] = out[6] * mean
    res[7] = 4e-16 + spread * res[0]
    if res[1] < 0.5:
        res[0] = 1.0 - res[1]
    else:
        res[1] = 1.0 - res[0]
    _unshrink(res, shrink, given, v)
    return status


@dataclass(frozen=True)
class Steady:
    """Steady cycle at one (v~, y~); every quantity dimensionless.

    Attributes
    ----------
    mu_ratio, deficit : float
        mu~ = mu_macro/mu0 = <u_x>, eq. (15), and 1 - mu~ with its own full precision.
    regime : str
        ``"continuous"`` or ``"stick_slip"``.
    stick_fraction : float
        Share of the period during which the foot sticks.
    power : float
        <y~ cos tau u_y>: mean power of the shaker in units of mu0 Fz l0 omega.
    slip_speed : float
        <lam>: mean slip path per radian in units of l0; equals v~ mu~ + power.
    min_slip_speed : float
        Smallest lam of the continuous orbit; NaN far below the border, where it is not followed.
    error_estimate : float
        Estimated absolute error of mu_ratio.
    status : int
        0 when solved.
    advice : str
        What the status means and what to do.
    """

    mu_ratio: float
    deficit: float
    regime: str
    stick_fraction: float
    power: float
    slip_speed: float
    min_slip_speed: float
    error_estimate: float
    status: int
    advice: str

    @property
    def ok(self) -> bool:
        """True when the steady cycle was found."""
        return self.status == OK


def workspace() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Arrays that :func:`solve_raw` writes to; one set per thread."""
    return np.zeros((8, ORDER + 2)), np.zeros(11), np.zeros(6), np.zeros(8)


def solve(v: float, y: float, eta: float | None = None) -> Steady:
    """Solve the full model at v~ = ``v``, y~ = ``y`` (eqs. (9)-(12), (15)).

    Parameters
    ----------
    v, y : float
        Dimensionless speed and amplitude [-], finite and > 0.
    eta : float, optional
        y~ - 1 [-], to be given where it is known better than ``y`` in double precision.

    Returns
    -------
    Steady
        Never raises for numerical reasons: a failure is a status with advice.
    """
    w, out, orbit, res = workspace()
    status = int(solve_raw(float(v), float(y), float(y) - 1.0 if eta is None else float(eta), w, out, orbit, res))
    regime = "unknown" if math.isnan(res[2]) else REGIMES[int(res[2])]
    return Steady(
        float(res[0]), float(res[1]), regime, float(res[3]), float(res[4]), float(res[5]), float(res[6]),
        float(res[7]), status, ADVICE[status],
    )  # fmt: skip


def border(y: float) -> tuple[float, float]:
    """Border of continuous sliding: (v~crit, mu~ on it) at the amplitude y~ = ``y`` [-], 1e-8 < y < 1e8.

    Raises
    ------
    ArithmeticError
        When the root-finder fails.
    """
    w, out, _, _ = workspace()
    v, mu, status = border_raw(float(y), w, out)
    if status != OK:
        raise ArithmeticError(f"border at y~ = {y!r}: {ADVICE[int(status)]}")
    return float(v), float(mu)

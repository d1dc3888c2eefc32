"""Compute the stick phase in closed form: the time at which the spring reaches the friction limit
again.

During stick u moves with the upper point, eqs. (9), (10): |u|^2 - 1 is explicit in the time, and
its first root ends stick.  Time is sigma = tau - pi/2 [rad]; v = v~ [-], y = y~ [-], eta = y~ - 1
[-]; angles of u are as in :mod:`.slip`.
"""

import math

from .compiled import solver_kernel

SCAN = 24  # samples of half a period


@solver_kernel
def _sinc(a: float) -> float:
    """Return sin a / a."""
    return 1.0 - a * a / 6.0 if abs(a) < 1e-4 else math.sin(a) / a


@solver_kernel
def _third(d: float) -> float:
    """Return (d - sin d) / d^2."""
    if d < 0.3:
        q = d * d
        return d * (
            1 / 6
            - q
            * (1 / 120 - q * (1 / 5040 - q * (1 / 362880 - q * (1 / 39916800 - q / 6227020800))))
        )
    return (d - math.sin(d)) / (d * d)


@solver_kernel
def stick_excess(
    v: float, y: float, eta: float, x0: float, chart: int, s0: float, s1: float, d: float
) -> float:
    """Return (|u|^2 - 1) / d^2 [-] a time ``d`` [rad] after slip stopped at (s0, chart base + x0);
    s1 = s0 + d - pi.

    The double root at d = 0 is divided out with lam = 0 at the onset; at d = 0 the result is d
    lam/d tau there.
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


@solver_kernel
def _chandrupatla(
    v: float,
    y: float,
    eta: float,
    x0: float,
    chart: int,
    s0: float,
    a: float,
    b: float,
    fa: float,
    fb: float,
    in_sigma: bool,
) -> float:
    """Return the root of stick_excess in d, or in sigma1 if ``in_sigma``, between a and b [rad].

    The method is Chandrupatla's bracketed inverse interpolation (Advances in Engineering Software
    28, 1997).
    """
    x1, f1, x2, f2, x3, f3 = b, fb, a, fa, a, fa
    t = 0.5
    for _ in range(200):
        x = x1 + t * (x2 - x1)
        s1, d = (x, math.pi - s0 + x) if in_sigma else (s0 + x - math.pi, x)
        f = stick_excess(v, y, eta, x0, chart, s0, s1, d)
        if (f > 0.0) != (f1 > 0.0):
            x1, f1, x2, f2 = x2, f2, x1, f1
        x1, f1, x3, f3 = x, f, x1, f1
        best = x1 if abs(f1) < abs(f2) else x2
        tol = 2.0e-16 * abs(best)
        if f1 == 0.0 or abs(x2 - x1) <= 2.0 * tol:
            return best
        tl = tol / abs(x2 - x1)
        xi = (x1 - x2) / (x3 - x2)
        phi = (f1 - f2) / (f3 - f2)
        if phi * phi < xi and (1.0 - phi) * (1.0 - phi) < 1.0 - xi:
            t = f1 / (f2 - f1) * f3 / (f2 - f3) + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (
                f3 - f2
            )
        else:
            t = 0.5
        t = min(max(t, tl), 1.0 - tl)
    return x1


@solver_kernel
def _reached(
    v: float, y: float, eta: float, x0: float, chart: int, s0: float
) -> tuple[float, float]:
    """Return two times since the onset of stick [rad], |u| < 1 at the first, > 1 at the second; (0,
    -1) if it stays below."""
    d = 0.0
    for i in range(1, SCAN + 1):
        lo, d = d, math.pi * i / SCAN
        if stick_excess(v, y, eta, x0, chart, s0, s0 + d - math.pi, d) > 0.0:
            return lo, d
    # the window of |u| > 1, next to the last sample, may be shorter than the scan: climb by golden
    # section
    lo = d - math.pi / SCAN
    a, b = lo, d + math.pi / SCAN
    for _ in range(80):
        c, e = b - 0.6180339887498949 * (b - a), a + 0.6180339887498949 * (b - a)
        gc = stick_excess(v, y, eta, x0, chart, s0, s0 + c - math.pi, c)
        ge = stick_excess(v, y, eta, x0, chart, s0, s0 + e - math.pi, e)
        if gc > 0.0 or ge > 0.0:
            return lo, c if gc > 0.0 else e
        a, b = (a, e) if gc > ge else (c, b)
    return 0.0, -1.0


@solver_kernel
def stick_end(
    v: float, y: float, eta: float, x0: float, chart: int, s0: float
) -> tuple[float, float]:
    """Return the duration of stick, and sigma at its end, less pi [rad]; (-1, 0) if the limit is
    not reached in half a period."""
    lo, hi = _reached(v, y, eta, x0, chart, s0)
    if hi < 0.0:
        return -1.0, 0.0
    fa = stick_excess(v, y, eta, x0, chart, s0, s0 + lo - math.pi, lo)
    fb = stick_excess(v, y, eta, x0, chart, s0, s0 + hi - math.pi, hi)
    long = hi > 2.0  # then solve for sigma1, which keeps its digits when it is small
    if long:
        lo, hi = s0 + lo - math.pi, s0 + hi - math.pi
    x = _chandrupatla(v, y, eta, x0, chart, s0, lo, hi, fa, fb, long)
    return (math.pi - s0 + x, x) if long else (x, s0 + x - math.pi)

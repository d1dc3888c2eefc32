"""Find the steady stick-slip cycle as a root on a one-dimensional section.

There are two sections, because neither is well conditioned everywhere:

* the *angle section*: unknown th0, the angle at which slip stops (lam = 0 ties sigma0 to it); used
  from the border down and for y~ > 1;
* the *time section*: unknown sigma1 < 0, the instant at which slip starts; used at creeping speeds
  for y~ <= 1 and in the corner, where the window in which |u| > 1 is far shorter than any scan step
  and th0 hardly moves.

``eta`` = y~ - 1 is a separate argument: next to the corner rounding y~ to double costs 1e-16 / mu~.
v = v~ [-], y = y~ [-]; angles and charts as in :mod:`.slip`.
"""

import math

import numpy as np

from mumacro.closed_forms import BORDER_CONSTANT

from . import slip as slip_phase
from .compiled import solver_kernel
from .slip import FRONT, OK, SIDE, rechart, slip
from .stick import stick_end

BORDER_SLOPE: float = BORDER_CONSTANT**-0.5  # v~crit / sqrt(y~) for y~ -> infinity
NOT_CONVERGED = 10
ANGLE_SECTION, TIME_SECTION = 0, 1

# A section writes into ``orbit`` (6,): duration of stick [rad]; cos, 1 - cos and sin of the angle
# th0 where slip stops; sigma where stick starts and where it ends, less pi [rad].
DURATION, COS_0, DEFICIT_0, SIN_0, SIGMA_0, SIGMA_1 = range(6)


@solver_kernel
def border_guess(y: float) -> float:
    """Return v~crit [-] to about 15 %: the harmonic blend of both ends, eqs. (24), (26) with the
    exact constant."""
    return 1.0 / (2.0 / (y * y) + 1.0 / (BORDER_SLOPE * math.sqrt(y)))


@solver_kernel
def _direction(x0: float, chart: int) -> tuple[float, float, float]:
    """Return cos, sin and 1 - cos [-] of the angle th0 = ``x0`` [rad] where slip stops, in chart 1
    pi/2 - ``x0``."""
    half = math.sin(0.5 * x0)
    c, s = math.cos(x0), math.sin(x0)
    return (c, s, 2.0 * half * half) if chart == FRONT else (s, c, 1.0 - s)


@solver_kernel
def _keep(orbit: np.ndarray, duration: float, s0: float, s1: float, x0: float, chart: int) -> None:
    """Write the stick phase into ``orbit`` (6,)."""
    orbit[DURATION], orbit[SIGMA_0], orbit[SIGMA_1] = duration, s0, s1
    orbit[COS_0], orbit[SIN_0], orbit[DEFICIT_0] = _direction(x0, chart)


@solver_kernel
def _angle_section(
    v: float,
    y: float,
    eta: float,
    x0: float,
    chart: int,
    w: np.ndarray,
    out: np.ndarray,
    orbit: np.ndarray,
) -> tuple[float, int]:
    """Return the map's residual th_end - th0 [rad] and a status, for slip that stops at th0 = base
    + x0; in chart 1 x0 = -x.

    ``w`` and ``out`` as in :func:`.slip.slip`; ``orbit`` (6,) receives the stick phase.
    """
    cth, sth, _ = _direction(x0, chart)
    s0 = math.asin(min(v * cth / (y * sth), 1.0))
    d, s1 = stick_end(v, y, eta, x0, chart, s0)
    if d < 0.0:
        return -1.0, slip_phase.NO_SLIP
    _keep(orbit, d, s0, s1, x0, chart)
    # sigma1 counted from the nearer turn: after a short stick it is the turn from which slip came
    turn = -1 if d < 0.5 * math.pi else 0
    near = s0 + d if turn < 0 else s1
    ux = cth + v * d
    uy = 2.0 * y * math.sin(s0 + 0.5 * d) * math.sin(0.5 * d) - sth  # mirrored
    if chart == SIDE and uy > 0.0:
        d1 = math.asin(min(ux, 1.0))
        # 2 B = delta1 - delta0 from sin delta1 - sin delta0 = v d, free of cancellation
        b = math.asin(min(1.0, 0.5 * v * d / math.cos(0.5 * (x0 + d1))))
        status = slip(
            v,
            y,
            near,
            turn,
            -(x0 + 2.0 * b),
            SIDE,
            0.5 * math.pi,
            slip_phase.TO_STICK,
            w,
            out,
        )
        return out[slip_phase.TURNED] - 2.0 * b, status
    th1 = math.atan2(uy, ux)
    status = slip(v, y, near, turn, th1, FRONT, 0.5 * math.pi, slip_phase.TO_STICK, w, out)
    if status != OK:
        return 0.0, status
    x_end = rechart(out[slip_phase.ANGLE], int(out[slip_phase.CHART]), chart)
    return (x_end + x0 if chart == SIDE else x_end - x0), status


@solver_kernel
def _time_section(
    v: float,
    y: float,
    eta: float,
    s1: float,
    chart: int,
    w: np.ndarray,
    out: np.ndarray,
    orbit: np.ndarray,
) -> tuple[float, int]:
    """Return the residual of the angle turned [rad] and a status, for slip that starts at sigma1 =
    ``s1`` < 0 and closes the stick.

    With A, B = (th0 +- th1)/2 the stick phase closes where 2 sin A sin B = v (pi - slip duration)
    and sin A cos B = y cos((s0 + s1)/2) cos((s0 - s1)/2); both are explicit once sigma0 is known,
    and sigma0 is small.
    """
    s0 = 0.0
    th0 = b = a_ang = 0.0
    for _ in range(100):
        s, h = 0.5 * (s0 + s1), 0.5 * (s0 - s1)
        cc = math.cos(s) * math.cos(h)
        gain = 0.5 * v * (math.pi - 2.0 * h)
        b = math.atan(gain / (y * cc))
        if chart == FRONT:
            a_ang = math.asin(y * cc / math.cos(b))
            th0 = a_ang + b
            ratio = v * math.cos(th0) / (y * math.sin(th0))
        else:
            ss, sh = math.sin(s), math.sin(h)
            ca2 = y * y * (ss * ss + (1.0 - ss * ss) * sh * sh) - eta * (2.0 + eta) - gain * gain
            a_ang = math.asin(math.sqrt(ca2))
            th0 = a_ang - b
            ratio = v * math.tan(th0) / y
        if not th0 > 0.0:  # NaN if slip cannot start there
            return -1.0, slip_phase.NO_SLIP
        old, s0 = s0, math.asin(min(1.0, ratio))
        if abs(s0 - old) <= 1e-16 * abs(s0):
            break
    _keep(orbit, math.pi - s0 + s1, s0, s1, th0, chart)
    start = a_ang - b if chart == FRONT else -(a_ang + b)
    status = slip(
        v, y, s1, slip_phase.HERE, start, chart, 0.5 * math.pi, slip_phase.TO_STICK, w, out
    )
    return 2.0 * b - out[slip_phase.TURNED], status


@solver_kernel
def section(
    kind: int,
    v: float,
    y: float,
    eta: float,
    z: float,
    chart: int,
    w: np.ndarray,
    out: np.ndarray,
    orbit: np.ndarray,
) -> tuple[float, int]:
    """Return the residual [rad], which increases with the unknown z > 0 [rad] for every section and
    chart, and a status."""
    if kind == ANGLE_SECTION:
        r, status = _angle_section(v, y, eta, z, chart, w, out, orbit)
        # in chart 0 the residual th_end - th0 falls with th0; delta = pi/2 - th0 turns the sign of
        # z but not of r
        return (-r if chart == FRONT else r), status
    r, status = _time_section(v, y, eta, -z, chart, w, out, orbit)
    return -r, status


@solver_kernel
def _choose(v: float, y: float, eta: float, hint: float) -> tuple[int, int, float]:
    """Return section, chart and a first guess of its unknown z [rad] from the limits; ``hint`` =
    th0 if known, otherwise NaN."""
    ratio = v / border_guess(y)
    # phi: the positive root of phi^3 - (1 - y^2) phi = pi v, the normal form of the corner; exact
    # for v -> 0, y < 1
    gap = -eta * (2.0 + eta)
    phi = math.sqrt(max(gap, 0.0)) + (math.pi * v) ** (1.0 / 3.0)
    for _ in range(60):
        new = phi - (phi * (phi * phi - gap) - math.pi * v) / (3.0 * phi * phi - gap)
        if abs(new - phi) <= 1e-12 * phi:
            break
        phi = new
    chart = 0 if y < 0.7 else 1
    if ratio < 0.15 and (eta <= 0.0 or (eta < 0.5 * phi * phi and phi < 0.5)):
        return TIME_SECTION, chart, math.sqrt(2.0 * math.pi * v / (y * y * phi))
    if not math.isnan(hint):
        return ANGLE_SECTION, chart, hint if chart == FRONT else 0.5 * math.pi - hint
    if chart == FRONT:
        return ANGLE_SECTION, chart, math.asin(min(1.0, y * (1.0 - 0.2 * min(ratio, 1.0))))
    return ANGLE_SECTION, chart, min(math.atan(v / y) + (phi if eta < 0.5 else v / y), 0.7)


@solver_kernel
def _edge(v: float, y: float) -> float:
    """Return the angle th0 [rad] below which no stick starts: lam = 0 = lam' there, (v / sin th)^2
    = y sin th cos sigma0."""
    a, b = math.atan(v / y), 0.5 * math.pi
    for _ in range(60):
        m = 0.5 * (a + b)
        sm = math.sin(m)
        q = v * math.cos(m) / (y * sm)
        starts = q < 1.0 and (v / sm) ** 2 < y * sm * math.sqrt(1.0 - q * q)
        a, b = (a, m) if starts else (m, b)
        if b - a < 2e-16 * a:
            break
    return b


@solver_kernel
def stick_slip(
    v: float, y: float, eta: float, hint: float, w: np.ndarray, out: np.ndarray, orbit: np.ndarray
) -> int:
    """Write the steady stick-slip orbit into ``out`` and ``orbit``, by the bracketed secant method;
    return a status.

    ``hint`` = th0 [rad] if something is known about it, as next to the border, otherwise NaN.
    """
    kind, chart, z = _choose(v, y, eta, hint)
    near = kind == ANGLE_SECTION and not math.isnan(hint)
    lo, hi = 0.0, 0.5 * math.pi
    if kind == ANGLE_SECTION:
        lo, hi = (_edge(v, y), hi) if chart == FRONT else (lo, hi - _edge(v, y))
    z_old, f_old, spread, before = z, math.inf, math.inf, math.inf
    for trial in range(200):
        f, status = section(kind, v, y, eta, z, chart, w, out, orbit)
        if status in (slip_phase.NO_SLIP, slip_phase.NO_STICK):
            # no slip: th0 too large, or sigma1 too close to zero.  No stick: next to the border
            # slip misses lam = 0 if th0 is too large, because there the half-period map reverses
            # the order of orbits
            lo, hi = (lo, z) if kind == ANGLE_SECTION and chart == FRONT else (z, hi)
            z, f_old = 0.5 * (lo + hi), math.inf
            continue
        if status != OK:
            return status
        lo, hi = (lo, z) if f > 0.0 else (z, hi)
        if f == 0.0 or spread * before < 1e-17:
            # the error of the secant method is about the product of its last two steps: this
            # evaluation is the result
            return OK
        secant = f_old < math.inf and f != f_old
        if secant:
            new = z - f * (z - z_old) / (f - f_old)
        elif f_old < math.inf:
            new = z
        elif kind == ANGLE_SECTION and (near or abs(f) > 1e-3 * z):
            # the map contracts, so its own image is the next trial; next to the border it also
            # reverses orbits
            new = z - (0.6 * f if near else f)
        else:
            new = z * (0.98 if f > 0.0 else 1.02)
        if not (lo <= new <= hi):
            secant = False
            new = 0.1 * hi if lo == 0.0 and trial < 40 else 0.5 * (lo + hi)
        if hi - lo <= 4e-16 * hi or new == z:
            return OK
        # only a secant step shows how far away the root still is
        before, spread = spread, abs(new - z) / abs(new) if secant else math.inf
        z_old, f_old, z = z, f, new
    return NOT_CONVERGED

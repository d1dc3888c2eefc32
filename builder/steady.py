"""The steady cycle at one (v~, y~) by root-finding on half a period; never by marching cycles.

Continuous sliding is a fixed point of the half-period map, th(tau + pi) = -th(tau), found by Newton's method with
d th_end / d th_start = exp(-integral of lam).  Stick-slip is a root on a section, :mod:`.sections`.

Every positive double is solved.  Where a limit holds to rounding, the problem is solved at the nearest ordinary v~ and
y~ and scaled, so that no product underflows: see :func:`solve_raw`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from . import model
from .compiled import solver_kernel
from .model import OK, rechart, slip
from .sections import COS_0, DEFICIT_0, DURATION, NOT_CONVERGED, SIGMA_0, SIN_0, border_guess, stick_slip
from .series import ORDER

CONTINUOUS, STICK_SLIP = 0, 1
REGIMES = ("continuous", "stick_slip")
BAD_INPUT = 11

_LOST = "the solver failed here, which is a defect of the solver: use a v~ that differs in the tenth digit"
ADVICE = {
    OK: "solved",
    model.NO_SLIP: "the stick phase never reaches the friction limit: " + _LOST,
    model.NO_STICK: "slip does not end within a period although the continuous orbit is not admissible: " + _LOST,
    model.TOO_MANY_STEPS: "more than 10,000 Taylor steps in one half period: " + _LOST,
    model.DIVERGED: "the stiff step did not converge: " + _LOST,
    NOT_CONVERGED: "the section's root was not found to rounding: " + _LOST,
    BAD_INPUT: "v~ must be finite and > 0, y~ must be finite and > 0",
}

# Results of solve_raw in ``res`` (7,), named as in Steady.
MU_RATIO, DEFICIT, REGIME, STICK_FRACTION, POWER, SLIP_SPEED, MIN_SLIP_SPEED = range(7)

SMALLEST_Y = 1e-9  # below, 1 - mu~ = y~^2 h(v~/y~^2) holds to rounding and the problem is solved at this amplitude
#: of v~ at SMALLEST_Y, 2,000 times the border: below it 1 - mu~ no longer depends on v~ beyond v~^2
BELOW_LINEAR = 1e-15
SMALLEST_V = 1e-60  # below, at y~ != 1, what depends on v~ is linear in it: the next terms are of order sqrt(v~)
CORNER = 1e-36  # of v~ / abs(y~ - 1)^(3/2): the same next to y~ = 1; above it, the normal form's scaling
LARGEST_Y = 1e14  # above, mu~ = (2/pi) K(i y~/v~) + (v~/y~) G(v~/sqrt(y~)) holds to rounding
SMALLEST_X = 1e-40  # of v~/sqrt(y~) at LARGEST_Y: below, mu~ is linear in v~
RELATIVE_ERROR = 3e-15  # of the smaller of mu~ and 1 - mu~, see error_estimate
RIGID_V, RIGID_X = 1e8, 4e3  # of v~ and v~/sqrt(y~): above both, eq. (35) holds to rounding


@solver_kernel
def error_estimate(mu: float, deficit: float) -> float:
    """Largest absolute error of mu~ [-] to be expected; mu~ and 1 - mu~ are solved for.

    No larger one was found to points in quadruple precision, between the two sections where both apply, between
    neighbouring doubles and to the laws of scale at both ends: tests/test_steady.py and tests/test_extremes.py look.
    """
    return RELATIVE_ERROR * min(mu, deficit) + 2.3e-16 * mu + 5e-324


@solver_kernel
def continuous(v: float, y: float, w: np.ndarray, out: np.ndarray) -> int:
    """Continuous orbit over sigma in [-pi/2, pi/2], eq. (11); ``w`` and ``out`` as in :func:`.model.slip`; a status."""
    th = math.atan(v * y / (1.0 + v * v))
    half = 0.5 * math.pi
    done = False
    for _ in range(60):
        chart = 0
        x = th
        if th > 0.75:
            chart = 1
            x = th - half
        status = slip(v, y, -half, model.HERE, x, chart, half, model.ALL_THE_WAY, w, out)
        if status != OK:
            return status
        x_end = out[model.ANGLE]
        chart_end = int(out[model.CHART])
        # residual th_end + th_start, formed in the mirrored chart so that small angles keep their digits
        res = rechart(x_end, chart_end, -chart) + x
        if done:
            return OK
        step = res / (1.0 + math.exp(-out[model.PATH]))
        th -= step
        scale = min(max(abs(th), y / math.sqrt(1.0 + v * v)), 1.0)
        if abs(step) < 1e-8 * scale or (out[model.PATH] > model.FORGOTTEN and abs(step) < 0.05):
            done = True
        if out[model.PATH] > model.FORGOTTEN:
            # the initial state decays within half a period: one more pass starts on the orbit
            th = -(x_end + chart_end * half)
    return NOT_CONVERGED


@solver_kernel
def border_raw(y: float, w: np.ndarray, out: np.ndarray) -> tuple[float, float, int]:
    """(v~crit, mu~ there, status): where the smallest slip speed of the continuous orbit reaches zero."""
    guess = border_guess(y)
    lo, hi = 0.7 * guess, 1.4 * guess
    z, z_old, f_old = 1.02 * guess, 0.0, math.inf
    for _ in range(100):
        status = continuous(z, y, w, out)
        if status != OK:
            return math.nan, math.nan, status
        f = out[model.MIN_SPEED]
        if f > 0.0:
            hi = z
        else:
            lo = z
        if f == 0.0 or (f_old < math.inf and abs(z - z_old) <= 1e-9 * z):
            if f not in (0.0, f_old):  # both at rounding level: z is the root
                z -= f * (z - z_old) / (f - f_old)
            mu = out[model.SUM_UX] / math.pi
            return z, (1.0 - out[model.SUM_DEFICIT] / math.pi if mu > 0.5 else mu), OK
        new = z - f * (z - z_old) / (f - f_old) if f_old < math.inf else z * (0.99 if f > 0.0 else 1.01)
        if not (lo < new < hi):
            new = 0.5 * (lo + hi)
        z_old, f_old, z = z, f, new
    return z, out[model.SUM_UX] / math.pi, NOT_CONVERGED


@njit(inline="always", error_model="numpy")
def _small_power(v: float, out: np.ndarray, res: np.ndarray) -> float:
    """Power as <lam> - v~ mu~, nothing subtracted: <lam u_x> = v~ is the foot's mean velocity along the drive."""
    power: float = out[model.EXCESS] / math.pi + v * res[DEFICIT]
    return power


@solver_kernel
def sliding(v: float, y: float, out: np.ndarray, res: np.ndarray) -> None:
    """Results (7,) of continuous sliding from what :func:`continuous` left in ``out``, eq. (15)."""
    mean = 1.0 / math.pi
    res[MU_RATIO], res[DEFICIT] = out[model.SUM_UX] * mean, out[model.SUM_DEFICIT] * mean
    res[REGIME], res[STICK_FRACTION] = CONTINUOUS, 0.0
    res[POWER], res[SLIP_SPEED], res[MIN_SLIP_SPEED] = (
        out[model.WORK] * mean,
        out[model.PATH] * mean,
        out[model.MIN_SPEED],
    )
    if res[DEFICIT] < 0.5:
        res[MU_RATIO] = 1.0 - res[DEFICIT]
    else:
        res[DEFICIT] = 1.0 - res[MU_RATIO]
    if v < model.SMALL_V and y < model.SMALL_Y:
        res[POWER] = _small_power(v, out, res)


@njit(inline="always", error_model="numpy")
def _sticking(v: float, y: float, out: np.ndarray, orbit: np.ndarray, res: np.ndarray) -> None:
    """Results (7,) of stick-slip from what :func:`stick_slip` left in ``out`` and ``orbit``, eq. (15)."""
    d, cth, deficit = orbit[DURATION], orbit[COS_0], orbit[DEFICIT_0]
    # Next to the border lam grazes zero and the end of slip is known to 1e-16/sqrt(1 - v~/v~crit) only; the state there
    # is known far better, so the surplus is taken out and stick and slip together last exactly half a period.
    surplus = out[model.SIGMA] - orbit[SIGMA_0]
    out[model.SUM_UX] -= surplus * cth
    out[model.SUM_DEFICIT] -= surplus * deficit
    out[model.WORK] += surplus * y * math.sin(orbit[SIGMA_0]) * orbit[SIN_0]
    mean = 1.0 / math.pi
    res[MU_RATIO] = (d * (cth + 0.5 * v * d) + out[model.SUM_UX]) * mean
    res[DEFICIT] = (d * (deficit - 0.5 * v * d) + out[model.SUM_DEFICIT]) * mean
    res[REGIME], res[STICK_FRACTION], res[SLIP_SPEED] = STICK_SLIP, d * mean, out[model.PATH] * mean
    if res[DEFICIT] < 0.5:
        res[MU_RATIO] = 1.0 - res[DEFICIT]
    else:
        res[DEFICIT] = 1.0 - res[MU_RATIO]
    if v < model.SMALL_V and y < model.SMALL_Y:
        res[POWER] = _small_power(v, out, res)
    else:
        # during stick the spring takes up and returns the same energy, so the shaker's work is minus the drive's
        res[POWER] = (out[model.WORK] - v * d * (cth + 0.5 * v * d)) * mean


@njit(inline="always", error_model="numpy")
def _ordinary(
    v: float, y: float, eta: float, w: np.ndarray, out: np.ndarray, orbit: np.ndarray, res: np.ndarray
) -> int:
    """Steady state where no scale is extreme; arguments as in :func:`solve_raw`."""
    hint = least = math.nan
    if v > 0.75 * border_guess(y):
        status = continuous(v, y, w, out)
        if status != OK:
            return status
        least = out[model.MIN_SPEED]
        hint = out[model.FALL]
    if not least >= 0.0:
        status = stick_slip(v, y, eta, hint, w, out, orbit)
        if status == OK:
            _sticking(v, y, out, orbit, res)
            res[MIN_SLIP_SPEED] = least
            return OK
        # the last digit below the border: the section ends where its root lies, and the two orbits are one to rounding
        if not least > -1e-13 * v or continuous(v, y, w, out) != OK:
            return status
    sliding(v, y, out, res)
    return OK


@solver_kernel
def rigid(v: float, y: float) -> tuple[float, float, float]:
    """mu~, 1 - mu~ and power of rigid contact, eqs. (33)-(37): means over tan th = (y~/v~) cos tau, i.e. K(i y~/v~).

    By the arithmetic-geometric mean of 1 + p = sqrt(1 + r^2) and 1 + q = 1, as K; its step takes
    <(a cos^2 + b sin^2) / sqrt((1 + p)^2 cos^2 + (1 + q)^2 sin^2)> over into itself, and nothing is subtracted.
    """
    r = y / v
    p, q, a, b = r / (1.0 + math.hypot(1.0, r)) * r, 0.0, 1.0, 0.0
    for _ in range(16):
        mean = math.sqrt(1.0 + p) * math.sqrt(1.0 + q)
        a, b = 0.5 * (a + b), (a * (1.0 + q) + b * (1.0 + p)) / (2.0 + p + q)
        p, q = 0.5 * (p + q), p / (1.0 + mean) * (1.0 + q) + q / (1.0 + mean)
    return 1.0 / (1.0 + p), p / (1.0 + p), y * (r * a / (1.0 + p))


@njit(inline="always", error_model="numpy")
def _unshrink(res: np.ndarray, v: float, y: float, solved: float) -> None:
    """``res`` from the amplitude SMALLEST_Y to ``y`` below it; ``solved`` is the v~ that stood in for ``v``."""
    square = (y / SMALLEST_Y) * (y / SMALLEST_Y)
    res[DEFICIT] *= square
    res[MU_RATIO] = 1.0 - res[DEFICIT]
    if solved < BELOW_LINEAR:  # v~ was scaled with the square of the amplitude, and all speeds with it
        res[POWER] = res[POWER] * square * square
        res[SLIP_SPEED] *= square
        res[MIN_SLIP_SPEED] *= square
    else:  # far in continuous sliding: only what the oscillation adds is quadratic, the power linear in small v~
        res[POWER] *= square * (v / solved)
        res[SLIP_SPEED] = v * res[MU_RATIO] + res[POWER]
        res[MIN_SLIP_SPEED] = v - (solved - res[MIN_SLIP_SPEED]) * square


@njit(inline="always", error_model="numpy")
def _widen(res: np.ndarray, v: float, y: float, solved: float) -> None:
    """``res`` from the amplitude LARGEST_Y to ``y`` above it; ``solved`` is the v~ that stood in for ``v``.

    Only the turns of the shaker, layers of width 1/sqrt(y~), differ from rigid contact; they depend on v~/sqrt(y~).
    """
    stretch = math.sqrt(y / LARGEST_Y)
    mu, _, power = rigid(solved, LARGEST_Y)
    layer, work = (res[MU_RATIO] - mu) * (LARGEST_Y / solved), res[POWER] - power
    x = solved * stretch  # v, or the speed below which mu~ is linear
    mu, _, power = rigid(x, y)
    res[MU_RATIO] = v * (mu * (y / x) + layer) / y
    res[DEFICIT] = 1.0 - res[MU_RATIO]
    res[POWER] = power + work
    res[STICK_FRACTION] /= stretch
    res[SLIP_SPEED] = v * res[MU_RATIO] + res[POWER]
    res[MIN_SLIP_SPEED] *= stretch


@njit(inline="always", error_model="numpy")
def _creep_scales(v: float, eta: float) -> tuple[float, float]:
    """Factors from ordinary speeds down to ``v`` < SMALLEST_V: of v~ at constant y~, and of mu~ at the corner.

    At the corner mu~^3 + 2 (y~ - 1) mu~ = pi v~: mu~ by s takes y~ - 1 by s^2 and v~ by s^3.  The linear law comes
    first, as far as the corner lets it.
    """
    near = min(SMALLEST_V, CORNER * abs(eta) ** 1.5)
    linear = v / near if v < near else 1.0
    return linear, min(1.0, (v / linear / SMALLEST_V) ** (1.0 / 3.0))


@njit(inline="always", error_model="numpy")
def _slow(res: np.ndarray, eta: float, linear: float, corner: float) -> None:
    """``res`` from ordinary speeds down to creep by the factors of :func:`_creep_scales`."""
    mu = (linear if eta > 0.0 else 1.0) * corner
    path = (linear if eta < 0.0 else 1.0) * corner * corner
    if mu != 1.0:
        res[MU_RATIO] *= mu
        res[DEFICIT] = 1.0 - res[MU_RATIO]
    res[STICK_FRACTION] = 1.0 - (1.0 - res[STICK_FRACTION]) * corner
    res[POWER] *= path
    res[SLIP_SPEED] *= path


@solver_kernel
def solve_raw(
    v: float, y: float, eta: float, w: np.ndarray, out: np.ndarray, orbit: np.ndarray, res: np.ndarray
) -> int:
    """Steady state at v~ = ``v``, y~ = ``y``, eta = y~ - 1 [-] into ``res`` (7,); the rest is workspace; a status.

    Extreme scales are taken to ordinary ones first and the results back: v~ -> infinity is rigid contact; y~ -> 0
    depends on v~/y~^2 alone, y~ -> infinity on v~/sqrt(y~) but for rigid contact, v~ -> 0 is linear or the corner's.
    """
    res[:] = math.nan
    if not (0.0 < v < math.inf and 0.0 < y < math.inf):
        return BAD_INPUT
    if v > max(RIGID_V, RIGID_X * math.sqrt(y)):
        res[MU_RATIO], res[DEFICIT], res[POWER] = rigid(v, y)
        res[REGIME], res[STICK_FRACTION], res[MIN_SLIP_SPEED] = CONTINUOUS, 0.0, v
        res[SLIP_SPEED] = v * res[MU_RATIO] + res[POWER]
        return OK
    at_v, at_y, linear, corner = v, y, 1.0, 1.0
    if y < SMALLEST_Y:
        # in stick-slip v~ scales with y~^2; in continuous sliding the response is linear at any v~
        scaled = v / (y / SMALLEST_Y) / (y / SMALLEST_Y)
        at_v, at_y = scaled if scaled < BELOW_LINEAR else max(v, BELOW_LINEAR), SMALLEST_Y
        eta = at_y - 1.0
    elif y > LARGEST_Y:
        at_v, at_y = max(v / math.sqrt(y), SMALLEST_X) * math.sqrt(LARGEST_Y), LARGEST_Y
        eta = at_y - 1.0
    at_eta = eta
    if at_v < SMALLEST_V:
        linear, corner = _creep_scales(at_v, eta)
        at_v = SMALLEST_V if corner < 1.0 else at_v / linear
        if corner < 1.0:
            at_eta = eta / (corner * corner)
            at_y = 1.0 + at_eta
    status = _ordinary(at_v, at_y, at_eta, w, out, orbit, res)
    if status != OK:
        return status
    if linear < 1.0 or corner < 1.0:
        _slow(res, eta, linear, corner)
    if y < SMALLEST_Y:
        _unshrink(res, v, y, at_v * linear)
    elif y > LARGEST_Y:
        _widen(res, v, y, at_v)
    return OK


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
        Smallest lam of the continuous orbit; NaN far below the border, where it is not followed.  Where v~ is so far
        above the border that stiff steps pass it by, it is right to 0.1 %.
    error_estimate : float
        Largest absolute error of mu_ratio to be expected, see ``error_estimate``.
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


@solver_kernel
def workspace() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Arrays ``w``, ``out``, ``orbit``, ``res`` that :func:`solve_raw` writes to; one set per thread."""
    return np.zeros((9, ORDER + 2)), np.zeros(12), np.zeros(6), np.zeros(7)


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
    mu, deficit, regime, stick, power, speed, least = res.tolist()
    name = "unknown" if math.isnan(regime) else REGIMES[int(regime)]
    return Steady(mu, deficit, name, stick, power, speed, least, error_estimate(mu, deficit), status, ADVICE[status])


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

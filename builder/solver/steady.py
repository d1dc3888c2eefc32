"""Find the steady cycle at one (v~, y~) by root-finding on half a period, never by following
cycles.

Continuous sliding is a fixed point of the half-period map, th(tau + pi) = -th(tau).  Newton's
method finds it with d th_end / d th_start = exp(-integral of lam).  Stick-slip is a root on a
section, :mod:`.sections`.

The solver's range is 1e-60 <= v~ <= 1e10, 1e-15 <= y~ <= 1e14; outside it :func:`check_range`
refuses.  Below it products underflow.  Above y~ = 1e14 rounding hides the section's root, and at v~
= 1e12 some points need too many steps.  There the limits of the model hold to rounding, so a table
answers for every v~ and y~.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mumacro.errors import InputError
from mumacro.table.atlas import REGIMES

from . import slip as slip_phase
from .compiled import solver_kernel
from .sections import (
    COS_0,
    DEFICIT_0,
    DURATION,
    NOT_CONVERGED,
    SIGMA_0,
    SIN_0,
    border_guess,
    stick_slip,
)
from .series import ORDER
from .slip import OK, rechart, slip

CONTINUOUS, STICK_SLIP = map(REGIMES.index, ("continuous", "stick_slip"))

_LOST = (
    "the solver failed here, which is a defect of the solver: use a v~ that differs in the "
    "tenth digit"
)
ADVICE = {
    OK: "solved",
    slip_phase.NO_SLIP: "the stick phase never reaches the friction limit: " + _LOST,
    slip_phase.NO_STICK: "slip does not end within a period although the continuous orbit is not "
    "admissible: " + _LOST,
    slip_phase.TOO_MANY_STEPS: "more than 10,000 Taylor steps in one half period: " + _LOST,
    slip_phase.DIVERGED: "the stiff step did not converge: " + _LOST,
    NOT_CONVERGED: "the section's root was not found to rounding: " + _LOST,
}

#: results of solve_raw in ``res``, with the names of Steady; those before the regime are columns of
#: a sweep
RESULTS = (
    "mu_ratio",
    "deficit",
    "stick_fraction",
    "power",
    "regime",
    "slip_speed",
    "min_slip_speed",
)
MU_RATIO, DEFICIT, STICK_FRACTION, POWER, REGIME, SLIP_SPEED, MIN_SLIP_SPEED = range(
    N_RESULTS := len(RESULTS)
)

V_RANGE, Y_RANGE = (1e-60, 1e10), (1e-15, 1e14)  # of v~ and y~, dimensionless
MEAN = 1.0 / math.pi  # mean of an integral over half a period
RELATIVE_ERROR = 3e-15  # of the smaller of mu~ and 1 - mu~, see error_estimate


@solver_kernel
def error_estimate(mu: float, deficit: float) -> float:
    """Return the largest absolute error of mu~ [-] to be expected; the solver finds both mu~ and 1
    - mu~.

    No larger error was found in comparison with points in quadruple precision, between neighbouring
    doubles, and with the laws at the ends of the range: see test_steady.py and test_extremes.py in
    tests/builder/solver.
    """
    return RELATIVE_ERROR * min(mu, deficit) + 2.3e-16 * mu + 5e-324


@solver_kernel
def continuous(v: float, y: float, w: np.ndarray, out: np.ndarray) -> int:
    """Follow the continuous orbit over sigma in [-pi/2, pi/2], eq. (11); ``w`` and ``out`` as in
    :func:`.slip.slip`.  Return a status."""
    th, half, is_last = math.atan(v * y / (1.0 + v * v)), 0.5 * math.pi, False
    for _ in range(60):
        chart = 1 if th > 0.75 else 0
        x = th - chart * half
        status = slip(v, y, -half, slip_phase.HERE, x, chart, half, slip_phase.ALL_THE_WAY, w, out)
        if status != OK:
            return status
        x_end, chart_end = out[slip_phase.ANGLE], int(out[slip_phase.CHART])
        # residual th_end + th_start, computed in the mirrored chart so that small angles keep their
        # digits
        res = rechart(x_end, chart_end, -chart) + x
        if is_last:
            return OK
        step = res / (1.0 + math.exp(-out[slip_phase.PATH]))
        th -= step
        scale = min(max(abs(th), y / math.sqrt(1.0 + v * v)), 1.0)
        if abs(step) < 1e-8 * scale or (
            out[slip_phase.PATH] > slip_phase.FORGOTTEN and abs(step) < 0.05
        ):
            is_last = True
        if out[slip_phase.PATH] > slip_phase.FORGOTTEN:
            # the initial state decays within half a period: one more pass starts on the orbit
            th = -(x_end + chart_end * half)
    return NOT_CONVERGED


@solver_kernel
def border_raw(y: float, w: np.ndarray, out: np.ndarray) -> tuple[float, float, int]:
    """Return (v~crit, mu~ at v~crit, status): at v~crit the smallest slip speed of the continuous
    orbit is zero."""
    guess = border_guess(y)
    lo, hi = 0.7 * guess, 1.4 * guess
    z, z_old, f_old = 1.02 * guess, 0.0, math.inf
    for _ in range(100):
        status = continuous(z, y, w, out)
        if status != OK:
            return math.nan, math.nan, status
        f = out[slip_phase.MIN_SPEED]
        lo, hi = (lo, z) if f > 0.0 else (z, hi)
        if f == 0.0 or (f_old < math.inf and abs(z - z_old) <= 1e-9 * z):
            if f not in (0.0, f_old):  # both at rounding level: z is the root
                z -= f * (z - z_old) / (f - f_old)
            mu = out[slip_phase.SUM_UX] / math.pi
            return z, (1.0 - out[slip_phase.SUM_DEFICIT] / math.pi if mu > 0.5 else mu), OK
        new = (
            z - f * (z - z_old) / (f - f_old)
            if f_old < math.inf
            else z * (0.99 if f > 0.0 else 1.01)
        )
        if not (lo < new < hi):
            new = 0.5 * (lo + hi)
        z_old, f_old, z = z, f, new
    return z, out[slip_phase.SUM_UX] / math.pi, NOT_CONVERGED


@solver_kernel
def _finish(v: float, y: float, regime: int, out: np.ndarray, res: np.ndarray) -> None:
    """Write the rest of the results (7,): the smaller of mu~ and 1 - mu~ has the digits; the slip
    speed; a small power."""
    res[REGIME], res[SLIP_SPEED], res[MIN_SLIP_SPEED] = (
        regime,
        out[slip_phase.PATH] * MEAN,
        out[slip_phase.MIN_SPEED],
    )
    if res[DEFICIT] < 0.5:
        res[MU_RATIO] = 1.0 - res[DEFICIT]
    else:
        res[DEFICIT] = 1.0 - res[MU_RATIO]
    if v < slip_phase.SMALL_V and y < slip_phase.SMALL_Y:
        # <lam> - v~ mu~ without a subtraction: <lam u_x> = v~ is the mean velocity of the contact
        # point along the drive
        res[POWER] = out[slip_phase.EXCESS] / math.pi + v * res[DEFICIT]


@solver_kernel
def sliding(v: float, y: float, out: np.ndarray, res: np.ndarray) -> None:
    """Write the results (7,) of continuous sliding from what :func:`continuous` wrote into ``out``,
    eq. (15)."""
    res[MU_RATIO], res[DEFICIT] = out[slip_phase.SUM_UX] * MEAN, out[slip_phase.SUM_DEFICIT] * MEAN
    res[STICK_FRACTION], res[POWER] = 0.0, out[slip_phase.WORK] * MEAN
    _finish(v, y, CONTINUOUS, out, res)


@solver_kernel
def _sticking(v: float, y: float, out: np.ndarray, orbit: np.ndarray, res: np.ndarray) -> None:
    """Write the results (7,) of stick-slip from what :func:`stick_slip` wrote into ``out`` and
    ``orbit``, eq. (15)."""
    d, cth, deficit = orbit[DURATION], orbit[COS_0], orbit[DEFICIT_0]
    # Next to the border lam grazes zero, and the end of slip is known only to 1e-16/sqrt(1 -
    # v~/v~crit).  The state there is known far better, so the surplus is removed, and stick and
    # slip together last exactly half a period.
    surplus = out[slip_phase.SIGMA] - orbit[SIGMA_0]
    out[slip_phase.SUM_UX] -= surplus * cth
    out[slip_phase.SUM_DEFICIT] -= surplus * deficit
    out[slip_phase.WORK] += surplus * y * math.sin(orbit[SIGMA_0]) * orbit[SIN_0]
    res[MU_RATIO] = (d * (cth + 0.5 * v * d) + out[slip_phase.SUM_UX]) * MEAN
    res[DEFICIT] = (d * (deficit - 0.5 * v * d) + out[slip_phase.SUM_DEFICIT]) * MEAN
    # during stick the spring takes up and returns the same energy, so the shaker's work is minus
    # the drive's
    res[STICK_FRACTION], res[POWER] = (
        d * MEAN,
        (out[slip_phase.WORK] - v * d * (cth + 0.5 * v * d)) * MEAN,
    )
    _finish(v, y, STICK_SLIP, out, res)


@solver_kernel
def solve_raw(
    v: float,
    y: float,
    eta: float,
    w: np.ndarray,
    out: np.ndarray,
    orbit: np.ndarray,
    res: np.ndarray,
) -> int:
    """Write the steady state at v~ = ``v``, y~ = ``y``, eta = y~ - 1 [-] into ``res`` (7,); the
    other arguments are workspace.  Return a status."""
    res[:] = math.nan
    hint = least = math.nan
    if v > 0.75 * border_guess(y):
        status = continuous(v, y, w, out)
        if status != OK:
            return status
        least = out[slip_phase.MIN_SPEED]
        hint = out[slip_phase.FALL]
    if not least >= 0.0:
        status = stick_slip(v, y, eta, hint, w, out, orbit)
        if status == OK:
            _sticking(v, y, out, orbit, res)
            res[MIN_SLIP_SPEED] = least
            return OK
        # the last digit below the border: the section ends at its root, and the two orbits agree to
        # rounding
        if not least > -1e-13 * v or continuous(v, y, w, out) != OK:
            return status
    sliding(v, y, out, res)
    return OK


@dataclass(frozen=True)
class Steady:
    """Hold the steady cycle at one (v~, y~); every quantity is dimensionless."""

    #: mu~ = mu_macro/mu0 = <u_x>, eq. (15), and 1 - mu~ with its own full precision
    mu_ratio: float
    deficit: float
    #: "continuous" or "stick_slip"
    regime: str
    #: fraction of the period during which the contact point sticks
    stick_fraction: float
    #: <y~ cos tau u_y>: mean power of the shaker in units of mu0 Fz l0 omega
    power: float
    #: <lam>: mean slip path per radian in units of l0; equals v~ mu~ + power
    slip_speed: float
    #: smallest lam of the continuous orbit; NaN far below the border, where it is not followed;
    #: right to 0.1 % if v~ is so far above the border that stiff steps pass it
    min_slip_speed: float
    #: largest absolute error of mu_ratio to be expected, see error_estimate()
    error_estimate: float
    #: 0 if solved; what the status means and what to do
    status: int
    advice: str

    @property
    def ok(self) -> bool:
        """Return whether the steady cycle was found."""
        return self.status == OK


def check_range(v: ArrayLike, y: ArrayLike, eta: ArrayLike) -> None:
    """Refuse v~, y~ or eta = y~ - 1 [-], arrays of one shape, outside the range of the solver.

    Raises
    ------
    InputError
        If a value is out of range or NaN, or ``eta`` differs from y~ - 1 by more than rounding.
    """
    v, y, eta = (np.asarray(values, dtype=np.float64) for values in (v, y, eta))
    for field, values, (low, high) in (("v_tilde", v, V_RANGE), ("y_tilde", y, Y_RANGE)):
        bound = (
            f"from {low:g} to {high:g}, the range of the solver (Surrogate.mu_ratio of a "
            "table answers beyond it)"
        )
        _refuse(field, values, (low <= values) & (values <= high), bound)
    _refuse(
        "eta", eta, np.abs(eta - (y - 1.0)) <= 4e-16 * np.maximum(1.0, y), "y_tilde - 1 to rounding"
    )


def _refuse(field: str, values: NDArray[np.float64], right: NDArray[np.bool_], bound: str) -> None:
    """Raise for the first of ``values`` that is not ``right``."""
    if not right.all():
        index = int(np.argmin(right))
        raise InputError(field, values.flat[index].item(), bound, index if values.ndim else None)


@solver_kernel
def workspace() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return arrays ``w``, ``out``, ``orbit``, ``res`` to which :func:`solve_raw` writes; each
    thread needs its own set."""
    return np.zeros((9, ORDER + 2)), np.zeros(12), np.zeros(6), np.zeros(N_RESULTS)


def solve(v: float, y: float, eta: float | None = None) -> Steady:
    """Solve the full model at v~ = ``v``, y~ = ``y`` (eqs. (9)-(12), (15)).

    Parameters
    ----------
    v, y : float
        Dimensionless speed and amplitude [-], in ``builder.solver.steady.V_RANGE`` and
        ``builder.solver.steady.Y_RANGE``.
    eta : float, optional
        y~ - 1 [-], if it is known better than ``y`` in double precision.

    Returns
    -------
    Steady
        Never raises for numerical reasons: a failure is a status with advice.

    Raises
    ------
    InputError
        If a value is out of range.

    Examples
    --------
    >>> round(solve(0.1, 0.5).mu_ratio, 12)
    0.942004289514
    """
    v, y = float(v), float(y)
    eta = y - 1.0 if eta is None else float(eta)
    check_range(v, y, eta)
    w, out, orbit, res = workspace()
    status = int(solve_raw(v, y, eta, w, out, orbit, res))
    results = dict(zip(RESULTS, res.tolist(), strict=True))
    results["regime"] = REGIMES[int(res[REGIME])] if status == OK else "unknown"
    results["error_estimate"] = error_estimate(res[MU_RATIO], res[DEFICIT])
    return Steady(**results, status=status, advice=ADVICE[status])


def border(y: float) -> tuple[float, float]:
    """Return the border of continuous sliding: (v~crit, mu~ on it) at the amplitude y~ = ``y`` [-]
    in ``builder.solver.steady.Y_RANGE``.

    Raises
    ------
    InputError
        If the amplitude is out of range.
    ArithmeticError
        If the root-finder fails.
    """
    y = float(y)
    check_range(1.0, y, y - 1.0)
    w, out, _, _ = workspace()
    v, mu, status = border_raw(y, w, out)
    if status != OK:
        raise ArithmeticError(f"border at y~ = {y!r}: {ADVICE[int(status)]}")
    return float(v), float(mu)

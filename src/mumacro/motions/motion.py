"""Compute any periodic motion of the contact: oblique, elliptic, with harmonics, also together with
an oscillating load.

No table holds these motions.  The steady cycle is computed from the equations of the contact, the
same as those of :class:`mumacro.Element`, in ``kernel/motion*.c``.  A method of order 5 follows
slip to its end, and the cycle is the fixed point of the map of a period.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from mumacro import plotting
from mumacro.errors import InputError
from mumacro.inputs.cases import ABSENT, columns_of, real
from mumacro.inputs.doubts import remarks_on_motion
from mumacro.inputs.fields import BOUNDS, RAD_PER_CYCLE, STIFFNESS, Numbers, Oscillation, kind_of
from mumacro.kernel.arrays import Array, Bools, common_shape, flat
from mumacro.kernel.binding import kernels
from mumacro.kernel.threads import STOP, look, share_out
from mumacro.motions.oscillation import read_oscillation
from mumacro.results import WARNING, Note, Result, Rows, cell

TOLERANCES = 1e-9, 1e-2
# the largest and the smallest displacement in a radian, in units of mu0 Fz / k; below the smallest
# one, rounding decides in which direction the drag pulls
FURTHEST, SLOWEST = 1e9, 1e-9
REMAINING = 0.01  # the fraction of a disturbance that is left after ``periods``
PARTS = ("x", "y", "normal")
_SPRINGS = 64  # number of springs of a ball in a picture
# about how many times longer a motion of a spring, or of a ball, takes than a point of the table
_COST = 4096, 16_384
_KERNEL = kernels[-1]
_LIFTS_OFF = "an oscillation that leaves a load > 0 at every moment: at 0 the contact lifts off"
_STILL = "> 0, or x or y an oscillation: the friction of a contact that does not move is not fixed"
_RIGID = "finite: a rigid contact is the limit of a large k; raise it until mu_macro stays the same"
_OF_A_BALL = (
    "left out for a ball: with its normal force the contact radius would change, not modelled"
)


class Term(NamedTuple):
    """Hold one harmonic of a motion: amplitude sin(harmonic omega t + phase)."""

    harmonic: int
    amplitude: Array  #: [m], or for the normal force [N]; ``(n,)`` after broadcasting
    phase: Array  #: [rad]

    def evaluate(self, tau: Array, i: int) -> Array:
        """Return the values of case i at tau = omega t."""
        out: Array = self.amplitude[i] * np.sin(self.harmonic * tau + self.phase[i])
        return out


class _Cycle(NamedTuple):
    t: Array  #: time [s], from 0 to the end of the period
    x: Array  #: displacement of the upper point along the drag [m], including the drag
    y: Array  #: displacement across [m]
    Fx: Array  #: force on it along the drag [N]; its mean is mu_macro Fz
    Fy: Array  #: force across [N]
    Fz: Array  #: normal force [N]
    share: Array  #: size of the force along and across over mu0 Fz [-]: 1 while a spring slips


class Cycle(Result, _Cycle):
    """Hold one steady period of one case, arrays (n + 1,)."""

    __slots__ = ()

    @property
    def columns(self) -> dict[str, Array]:
        """Return the times, and the displacements and forces at each time."""
        return self._asdict()

    def _heading(self) -> str:
        return f"<Cycle of {self.t.size} times>"


#: members of a motion: unit and meaning
NUMBERS = {
    "mu_macro": ("-", "mean force along / Fz"),
    "mu_lateral": ("-", "mean force across / Fz"),
    "stick_fraction": ("-", "share of the period"),
    "slip_path": ("m", "of the foot per period"),
    "power": ("W", "of the shaker"),
    "power_drive": ("W", "of the drive, mu_macro Fz v0"),
    "periods": ("-", "until a disturbance has fallen to 1 %"),
    "error_estimate": ("-", "of mu_macro and mu_lateral"),
}


@dataclass(frozen=True)
class Scenes:
    """Hold the inputs of n cases: columns (n,) in SI, and harmonics of x, y and the normal
    force."""

    columns: dict[str, Array]  #: mu0, Fz, k, omega, v0
    terms: tuple[tuple[Term, ...], ...]
    contact: str
    tolerance: float
    frequency: str  #: the input that the caller used: omega or f

    @property
    def amplitudes(self) -> tuple[Array, ...]:
        """Return the largest amplitude of each part (n,): 0 if it does not oscillate."""
        still = np.zeros(self.columns["mu0"].size)
        return tuple(
            np.asarray(np.maximum.reduce([still, *(term.amplitude for term in part)]))
            for part in self.terms
        )

    @property
    def orders(self) -> tuple[tuple[int, ...], ...]:
        """Return the harmonics of each part."""
        return tuple(tuple(term.harmonic for term in part) for part in self.terms)

    @property
    def length(self) -> Array:
        """Return l0 = mu0 Fz / k [m]."""
        c = self.columns
        return np.asarray(c["mu0"] * c["Fz"] / c["k"])

    @property
    def dimensionless(self) -> Array:
        """Return the cases as the kernel takes them, (n, 1 + 2 terms)."""
        c = self.columns
        with np.errstate(all="ignore"):  # illegal cases are left out later
            length = self.length
            rows = [c["v0"] / c["omega"] / length]
            for part, unit in zip(self.terms, (length, length, c["Fz"]), strict=True):
                for term in part:
                    rows += [term.amplitude / unit, term.phase]
        return np.ascontiguousarray(np.stack(rows, axis=1))


@dataclass(frozen=True, repr=False)
class Motion(Result):
    """Hold steady cycles: floats for one case, otherwise arrays of the broadcast shape, with NaN at
    an illegal case."""

    #: mean force along the drag, divided by the mean normal force [-]; may be negative
    mu_macro: Any
    mu_lateral: Any  #: mean force along y, divided by the mean normal force [-]
    stick_fraction: Any  #: fraction of the period; for a ball the mean of its springs [-]
    #: slip path of the contact point per period [m]; for a ball the mean of its springs
    slip_path: Any
    power: Any  #: mean power of the shaker in x and y [W]
    power_drive: Any  #: mean power of the drive [W], mu_macro Fz v0
    error_estimate: Any  #: estimated error of mu_macro and mu_lateral [-]
    #: number of periods until a small disturbance has fallen to 1 % [-]; for a ball that of its
    #: slowest spring; infinite if nothing slips
    periods: Any
    scenes: Scenes = field(compare=False)

    def cycle(self, index: int | None = None, points: int = 400) -> Cycle:
        """Return one steady period at ``points`` + 1 equally spaced times.

        ``index`` is the place of a case in the flattened arrays; it is needed if there are several
        cases.  A ball has 64 springs here, so the mean of Fx/Fz may differ from ``mu_macro`` by
        1e-3 mu0.
        """
        i, scenes = self._place(index), self.scenes
        if isinstance(points, bool) or not isinstance(points, int) or not 2 <= points <= 10**6:
            raise InputError("points", points, "a whole number from 2 to 1000000")
        if math.isnan(np.ravel(self.mu_macro)[i]):
            raise InputError("index", i, "that of a case with an answer")
        shares = weights = np.ones(1)
        if scenes.contact == "ball":
            nodes, halves = np.polynomial.legendre.leggauss(_SPRINGS)
            a = 0.5 * (nodes + 1.0)
            shares, weights = 1.5 * a**2 * (2.0 - a**2), halves * a
        case = scenes.dimensionless[i].copy()
        forces = _KERNEL.motion_cycle(
            scenes.orders, case, shares, weights, scenes.tolerance, points, STOP.get().flag
        )
        look()
        mu0, Fz, _, omega, v0 = (float(column[i]) for column in scenes.columns.values())
        tau = np.linspace(0.0, 2.0 * math.pi, points + 1)
        x, y, load = (
            sum((term.evaluate(tau, i) for term in part), np.zeros(tau.size))
            for part in scenes.terms
        )
        Fx, Fy = mu0 * Fz * forces.T
        share = np.hypot(*forces.T) / (1.0 + load / Fz)
        return Cycle(tau / omega, v0 * (tau / omega) + x, y, Fx, Fy, Fz + load, share)

    def plot(self, ax: Any = None, *, index: int | None = None) -> Any:
        """Draw the forces over a period, and next to them the path of the upper point with the
        force at 16 moments.  Of several cases, ``index`` selects one, as in :meth:`cycle`.

        ``ax`` is a pair of matplotlib axes, or one (then no path is drawn), or None for new ones.
        The axes of the forces are returned.
        """
        i = self._place(index)
        case = {name: float(column[i]) for name, column in self.scenes.columns.items()}
        title = plotting.case_title(case, {"contact": self.scenes.contact})
        terms = (
            [(term.harmonic, term.amplitude[i], math.degrees(term.phase[i])) for term in part]
            for part in self.scenes.terms
        )
        words = plotting.motion_words(dict(zip(PARTS, terms, strict=True)))
        title = f"{title}\n{words}".rstrip()
        return plotting.plot_cycle(*self.cycle(index)[:-1], case["mu0"], title, ax)

    def _place(self, index: int | None) -> int:
        n = np.size(self.mu_macro)
        if index is None and n == 1:
            return 0
        whole = isinstance(index, (int, np.integer)) and not isinstance(index, bool)
        if index is None or not whole or not 0 <= index < n:
            raise InputError("index", index, f"a whole number from 0 to {n - 1}: one of the cases")
        return int(index)

    @property
    def columns(self) -> dict[str, Any]:
        """Return the results by name, each in the shape of the cases."""
        return {name: getattr(self, name) for name in NUMBERS}

    @property
    def notes(self) -> list[Note]:
        """Return the notes.  A warning says what to do if the search gave up before the estimate
        was below the tolerance.  A remark names an unusual input: each amplitude is checked as y0,
        that of the normal force as Fz_amplitude, and a motion without oscillation has a remark,
        too."""
        scenes = self.scenes
        doubts = remarks_on_motion(
            scenes.columns,
            dict(zip(PARTS, scenes.amplitudes, strict=True)),
            scenes.frequency == "f",
        )
        return [*self._gave_up(), *doubts]

    def _gave_up(self) -> list[Note]:
        """Return a warning for cases whose error is above the tolerance."""
        c, tolerance = self.scenes.columns, self.scenes.tolerance
        error = np.ravel(self.error_estimate)
        left = error > tolerance * c["mu0"] * (1.0 + 1e-9)
        if not left.any():
            return []
        cases = f" in {np.count_nonzero(left)} of {left.size} cases" if left.size > 1 else ""
        text = (
            f"the search gave up{cases}: the error is about {error[left].max():.1e}, above the "
            f"tolerance {tolerance:g} mu0; try a larger tolerance, fewer harmonics or a faster drag"
        )
        return [Note(WARNING, text)]

    def _members(self) -> dict[str, Any]:
        said = {name: said for name in ("warnings", "remarks") if (said := getattr(self, name))}
        return {**self.columns, "contact": self.scenes.contact, **said}

    def _heading(self) -> str:
        contact, shape = self.scenes.contact, np.shape(self.mu_macro)
        if shape:
            return f"<Motion of a {contact}, {math.prod(shape)} cases of shape {shape}>"
        return (
            f"<Motion of a {contact}: mu_macro {self.mu_macro:.6g}, mu_lateral "
            f"{self.mu_lateral:.6g}, error_estimate {self.error_estimate:.1e}>"
        )

    def _rows(self) -> Rows | None:
        return None if np.shape(self.mu_macro) else []

    def _in_full(self) -> tuple[str, Rows | None, list[str]]:
        """Return the results of one case, one in a row, with unit and meaning."""
        if np.shape(self.mu_macro):
            return super()._in_full()
        rows: Rows = [
            (name, cell(getattr(self, name)), f"[{unit}]", meaning)
            for name, (unit, meaning) in NUMBERS.items()
        ]
        return f"<Motion of a {self.scenes.contact}>", rows, self._below()


@np.errstate(all="ignore")
def motion(
    *,
    mu0: Any = ABSENT,
    Fz: Any = ABSENT,
    k: Any = ABSENT,
    v0: Any = ABSENT,
    omega: Numbers | None = None,
    f: Numbers | None = None,
    x: Oscillation = 0.0,
    y: Oscillation = 0.0,
    normal: Oscillation = 0.0,
    contact: str = "spring",
    tolerance: float = 1e-6,
    threads: int | None = None,
) -> Motion:
    """Return the steady cycle of a contact that is dragged along x and shaken in x, y and normally.

    Parameters
    ----------
    mu0, Fz, k : array_like
        Coulomb friction [-], mean normal force [N], tangential stiffness [N/m], all > 0.
    v0 : array_like
        Drag along x [m/s], >= 0.  At 0 there may be several steady cycles; then the contact starts
        without force.
    omega or f : array_like
        Angular frequency [rad/s] or frequency [Hz], > 0, of the period.
    x, y, normal : array_like, tuple or list
        Oscillations along [m], across [m] and of the normal force [N].  Each is an amplitude (half
        of peak to peak), a text such as "2um@90deg" or "2um, 3:0.4um@90deg", a pair (amplitude,
        phase in degrees), or a list of triples (harmonic, amplitude, phase); a triple means
        amplitude sin(harmonic omega t + phase).  Harmonics are whole numbers from 1 to 1000.
        Phases beyond 360 degrees count modulo 360.
    contact : str
        "spring", or "ball" under a constant normal force.
    tolerance : float
        Tolerance of the mean force over mu0 Fz, 1e-9 to 1e-2.  The search for a motion that needs
        more than 50 million steps, some seconds, gives up; ``warnings`` says so.
    threads : int, optional
        Threads for arrays; all processors by default.

    Returns
    -------
    Motion
        ``error_estimate`` is below ``tolerance mu0``, unless the search gives up; then it says how
        large the error still is.  ``stick_fraction`` and ``slip_path`` have no estimate and are
        less accurate, because a brief stick or a slow approach to the cycle hardly changes a mean
        force.

    Raises
    ------
    InputError
        If a single value is out of bounds; in arrays such a case has NaN.  Always if an input is
        missing or has no meaning, a ball has an oscillating normal force, shapes do not broadcast,
        or an array has a negative amplitude: it may hold samples, which :func:`mumacro.harmonics`
        takes.

    Examples
    --------
    Shaken obliquely, at 45 degrees to the drag: it also pushes the contact aside.

    >>> case = dict(mu0=0.3, Fz=10.0, k=1e6, f=20e3, v0=0.02)
    >>> motion(**case, x=2e-6, y=2e-6)
    <Motion of a spring: mu_macro 0.130052, mu_lateral -0.105596, error_estimate 2.8e-08>
    """
    kind = kind_of(contact)
    terms = tuple(
        tuple(_terms(name, part)) for name, part in zip(PARTS, (x, y, normal), strict=True)
    )
    if kind.contact and any(np.any(term.amplitude != 0.0) for term in terms[2]):
        raise InputError("normal", normal, _OF_A_BALL)
    if threads is not None and (type(threads) is not int or threads < 1):
        raise InputError("threads", threads, "a whole number >= 1")
    least, most = TOLERANCES
    size = real("tolerance", tolerance)
    if size.ndim or not least <= float(size) <= most:
        raise InputError("tolerance", tolerance, f"from {least:g} to {most:g}")
    if (omega is None) == (f is None):
        raise InputError("omega", omega, "given [rad/s], or f [Hz], exactly one of them")
    inputs = {"mu0": mu0, "Fz": Fz, "k": k, "y0": 0.0, "omega": omega, "f": f, "v0": v0}
    present = {name: value for name, value in inputs.items() if value is not ABSENT}
    columns = {name: np.asarray(x) for name, x in columns_of(present).items() if name != "y0"}
    numbers = [number for part in terms for term in part for number in term[1:]]
    try:
        shape = common_shape([*columns.values(), *numbers])
    except ValueError as error:
        shapes = {name: column.shape for name, column in columns.items()}
        raise InputError("inputs", shapes, "arrays whose shapes broadcast together") from error
    whole = shape or (1,)
    scenes = Scenes(
        {name: flat(column, whole) for name, column in columns.items()},
        tuple(
            tuple(Term(n, flat(size, whole), flat(phase, whole)) for n, size, phase in part)
            for part in terms
        ),
        contact,
        float(size),
        "omega" if f is None else "f",
    )
    legal = _legal(scenes, one=not shape)
    out = np.full((legal.size, 7), math.nan)
    out[legal] = _steady(scenes, legal, threads)
    return _answer(scenes, out, shape)


def _terms(name: str, part: Any) -> Iterable[Term]:
    """Yield the harmonics of one part of a motion; yield nothing for an amplitude 0."""
    for order, amplitude, degrees in read_oscillation(name, part):
        size = np.asarray(amplitude, np.float64)
        with np.errstate(invalid="ignore"):
            angle = np.deg2rad(np.fmod(np.asarray(degrees, np.float64), 360.0))
        if size.ndim or angle.ndim or size != 0.0 or not np.isfinite(angle):
            yield Term(order, size, np.asarray(angle))


def _legal(scenes: Scenes, one: bool) -> Bools:
    """Return which cases have an answer, (n,).  If there is only ``one`` case and it has none,
    raise InputError."""
    c, frequency = scenes.columns, scenes.frequency
    legal = np.ones(c["mu0"].size, dtype=np.bool_)

    def require(name: str, holds: Any, value: Any, bound: str) -> None:
        if one and not np.all(holds):
            raise InputError(name, float(np.ravel(value)[0]), bound)
        np.logical_and(legal, holds, out=legal)

    for name in ("mu0", "Fz"):
        require(name, (c[name] > 0.0) & np.isfinite(c[name]), c[name], BOUNDS[name])
    require("k", ~np.isposinf(c["k"]), c["k"], _RIGID)
    require("k", c["k"] > 0.0, c["k"], STIFFNESS)
    cycles = c["omega"] / (RAD_PER_CYCLE if frequency == "f" else 1.0)
    moves = (c["omega"] > 0.0) & np.isfinite(c["omega"])
    require(frequency, moves, cycles, "finite and > 0: a motion needs its period")
    require("v0", (c["v0"] >= 0.0) & np.isfinite(c["v0"]), c["v0"], BOUNDS["v0"])
    for name, part in zip(PARTS, scenes.terms, strict=True):
        for term in part:
            size = term.amplitude
            holds = (size >= 0.0) & np.isfinite(size)
            require(f"{name}, amplitude", holds, size, "finite and >= 0")
            require(f"{name}, phase", np.isfinite(term.phase), term.phase, "finite, in degrees")
    lowest = _lowest_load(scenes, legal)
    still, x_and_y = np.zeros(legal.size), [*scenes.terms[0], *scenes.terms[1]]
    swing = sum((term.amplitude for term in scenes.terms[2]), still)
    require("normal", lowest > 0.0, swing, _LIFTS_OFF)
    swing = sum((term.amplitude for term in x_and_y), still)
    require("v0", (c["v0"] > 0.0) | (swing > 0.0), c["v0"], _STILL)
    with np.errstate(all="ignore"):
        length = scenes.length
        drag = c["v0"] / c["omega"] / length
        shaken = sum((term.harmonic * (term.amplitude / length) for term in x_and_y), still)
        fastest = np.maximum(drag, shaken)
    unit = "mu0 Fz / k per radian of omega t"
    holds = np.isfinite(length) & (length > 0.0)
    require("mu0 Fz / k", holds, length, "a length > 0 within the range of numbers")
    require("speed", fastest <= FURTHEST, fastest, f"at most {FURTHEST:g} {unit}")
    require(
        "v0",
        (drag == 0.0) | (drag >= SLOWEST * (1.0 - 1e-12)),
        c["v0"],
        f"0, or at least {SLOWEST:g} {unit}",
    )
    return legal


def _lowest_load(scenes: Scenes, legal: Bools) -> Array:
    """Return a lower bound of the normal force over the period [N], (n,)."""
    Fz, part = scenes.columns["Fz"], scenes.terms[2]
    low: Array = Fz - sum((term.amplitude for term in part), np.zeros(Fz.size))
    if not part:
        return low
    most = max(term.harmonic for term in part)
    tau = np.linspace(0.0, 2.0 * math.pi, 64 * most, endpoint=False)
    for i in np.flatnonzero(legal & ~(low > 0.0)):
        # between these points the load may be lower, by at most the bound that its curvature gives
        bend = sum(term.harmonic**2 * term.amplitude[i] for term in part)
        load = Fz[i] + sum((term.evaluate(tau, int(i)) for term in part), np.zeros(tau.size))
        low[i] = load.min() - bend * tau[1] ** 2 / 8.0
    return low


def _steady(scenes: Scenes, legal: Bools, threads: int | None) -> Array:
    """Return the rows of the kernel for the legal cases."""
    cases = np.ascontiguousarray(scenes.dimensionless[legal])
    out = np.empty((cases.shape[0], 7))
    ball, stop = int(scenes.contact == "ball"), STOP.get()

    def work(part: slice) -> None:
        _KERNEL.motions(ball, scenes.orders, cases[part], scenes.tolerance, out[part], stop.flag)
        stop.look()  # a result that was interrupted does not count

    share_out(cases.shape[0], threads, work, _COST[ball])
    return out


def _answer(scenes: Scenes, rows: Array, shape: tuple[int, ...]) -> Motion:
    c = scenes.columns
    along, across, stick, path, work, decay, error = rows.T
    with np.errstate(all="ignore"):
        limit, length = c["mu0"] * c["Fz"], scenes.length
        mu = c["mu0"] * along
        columns = {
            "mu_macro": mu,
            "mu_lateral": c["mu0"] * across,
            "stick_fraction": stick,
            "slip_path": path * length,
            "power": work / (2.0 * math.pi) * limit * length * c["omega"],
            "power_drive": mu * c["Fz"] * c["v0"],
            "error_estimate": c["mu0"] * error,
            # such a slow decay is a rounding error of a contact that sticks
            "periods": np.where(decay <= 1e-12, math.inf, math.log(1.0 / REMAINING) / decay),
        }
    answers: dict[str, Any] = {
        name: column.reshape(shape) if shape else float(column[0])
        for name, column in columns.items()
    }
    return Motion(**answers, scenes=scenes)

"""Fit k and mu0 to a measured loop of force over displacement.

The force of the model is mu0 f(k/mu0) plus an offset and a drift.  The displacement determines f
(``kernel/loop.c``).  A projection removes offset and drift from the forces and from the model, and
mu0 is a factor.  What remains is one profile of chi2 over k/mu0 (:mod:`mumacro.fits.profile`).  The
fit needs scipy, a plot needs matplotlib.
"""

import math
from itertools import pairwise
from typing import Any

import numpy as np

from mumacro.errors import InputError
from mumacro.fits.cycles import cycles_of
from mumacro.fits.loop_fitted import LoopFit
from mumacro.fits.profile import Profile, quantile
from mumacro.inputs.cases import real
from mumacro.inputs.columns import to_si
from mumacro.inputs.fields import Numbers, kind_of
from mumacro.kernel.arrays import Array, Bools
from mumacro.kernel.binding import kernels
from mumacro.kernel.threads import look
from mumacro.results import NOTE, Note

LEAST, MOST = 6, 50_000  # samples of a loop
_PER_DECADE = 12
# values of k range / (mu0 Fz) below which a loop looks like a straight line
_SOFT = {"spring": 0.5, "ball": 1e-3}
_NARROW = 1e-6  # chi2 is a parabola in an interval with a smaller relative width
_ALLOWED = 200  # samples of the profile at which offset and drift are computed
_STEPS = 30  # steps of the Gauss-Newton method, and of the search for the force at the start
# Limits above which a note is made: standard deviations, fraction of mu0 Fz, fraction of the sum of
# squared residuals.
_SURE, _LARGE, _EXPLAINED = 4.0, 0.02, 0.2
# a cycle is periodic if the force at its ends differs by less than this fraction of its range
_GAP = 0.1
_AT_ONCE = 500_000  # samples that the kernel processes between two checks of the flag that stops it
_PIECES = 8  # smallest number of independent pieces into which the residuals of a cycle are cut
_KERNEL = kernels[-1]
_OTHER_SIGN = "the force is against the displacement: its sign is turned"
_FIRST = (
    "the force does not come back: a first cycle from rest is not periodic; record two cycles or "
    "more"
)
_OPEN = (
    "less than one cycle: the first measured force is the state at the start, and there is no "
    "offset"
)


def fit_loop(
    displacement: Numbers,
    force: Numbers,
    Fz: Numbers,
    contact: str = "spring",
    cycles: tuple[int, int] | None = None,
) -> LoopFit:
    """Fit k and mu0 of a contact to a loop of tangential force over displacement.

    Parameters
    ----------
    displacement, force : array_like
        Relative displacement [m] and the tangential force that moves it [N], in the order of time,
        (n,).  The force is positive along the displacement; if its sign is the opposite, it is
        changed, with a note.
    Fz : array_like
        Normal force [N]: one number, or for a spring one for each sample.
    contact : str
        "spring" or "ball", as for :func:`mumacro.motion`: k of a ball is its initial stiffness.
    cycles : (int, int), optional
        The first and the last whole cycle to use, counted from 1.  By default all samples are used.

    Returns
    -------
    LoopFit
        If there are several cycles, the first one sets the state and does not count.  One cycle is
        taken as periodic.  Less than one cycle (a spring only) begins with the first measured
        force.

    Raises
    ------
    InputError
        If a value is not a finite number; if the columns have different lengths; if the motion
        never turns and the contact is not a spring; if a load is not > 0.

    Examples
    --------
    >>> from mumacro import Element
    >>> way = 5e-6 * np.sin(np.linspace(0.0, 4.0 * np.pi, 401))
    >>> contact = Element(mu0=0.3, Fz=10.0, k=1e6)
    >>> measured = [contact.step(step, 0.0)[0] for step in np.diff(way, prepend=0.0)]
    >>> found = fit_loop(way, measured, Fz=10.0)
    >>> f"{found.values['k']:.4g} N/m, {found.values['mu0']:.4g}, {found.energy * 1e6:.1f} uJ"
    '1e+06 N/m, 0.3, 24.0 uJ'
    """
    problem = _Loop(displacement, force, Fz, contact, cycles)
    with np.errstate(all="ignore"):
        return problem.solve()


class _Loop:
    """Hold a loop, and search for its k and mu0."""

    x: Array  #: displacement of the samples in use [m]
    force: Array  #: [N]
    Fz: Array  #: [N]

    def __init__(
        self,
        displacement: Any,
        force: Any,
        Fz: Any,
        contact: str,
        cycles: tuple[int, int] | None,
    ) -> None:
        self.contact, self.code = contact, kind_of(contact).contact
        x = _column("displacement", displacement, "length")
        measured = _column("force", force, "force")
        load = real("Fz", Fz)
        if self.code and load.ndim:
            raise InputError(
                "Fz", load.shape, "one number for a ball, whose contact radius would change with it"
            )
        if measured.size != x.size or load.shape not in ((), x.shape):
            shapes = {"displacement": x.shape, "force": measured.shape, "Fz": load.shape}
            raise InputError("force", shapes, "columns of one length; Fz may be one number")
        bad = ~((load > 0.0) & np.isfinite(load))
        if bad.any():
            index = int(np.argmax(bad)) if load.ndim else None
            raise InputError("Fz", float(load.flat[index or 0]), "finite and > 0", index)
        if np.ptp(x) == 0.0:
            raise InputError("displacement", float(x[0]), "one that moves")
        if np.ptp(measured) == 0.0:
            raise InputError("force", float(measured[0]), "one that changes")
        load = np.ascontiguousarray(np.broadcast_to(load, x.size))
        self.notes: list[Note] = []
        self._take(x, measured, load, cycles)
        # Use units in which values are about 1: the range of the displacement, the mean load.
        self.length, self.load = float(np.ptp(self.x)), float(self.Fz.mean())
        if _against(self.x, self.force):
            self.force = -self.force
            self._note(_OTHER_SIGN)
        self._set_out()

    def _take(self, x: Array, force: Array, load: Array, chosen: tuple[int, int] | None) -> None:
        """Select the samples in use, the cycles among them, and the samples that count."""
        found = cycles_of(x)
        begins, part = np.array(found.begins), slice(None)
        if chosen is not None:
            first, last = _whole(chosen)
            if not 1 <= first <= last <= found.number:
                bound = f"from 1 to {found.number}, the whole cycles there are"
                raise InputError("cycles", chosen, bound)
            begins = begins[first - 1 : last + 1]
            part = slice(begins[0], begins[-1])
        self.x, self.force, self.Fz = x[part], force[part], load[part]
        self.begins = (begins - begins[0]).tolist()
        self.number = len(self.begins) - 1
        self.open = self.number == 0
        self.before = self.begins[1] if self.number == 1 else 0
        self.counted = slice(self.begins[1] if self.number > 1 else 0, None)
        if self.open:
            if self.code:
                bound = "at least one whole cycle of a ball: its springs have a state of their own"
                raise InputError("displacement", "less than one cycle", bound)
            self._note(_OPEN)
        elif self.number == 1 and not found.goes_on and self._is_first():
            self._note(_FIRST)

    def _is_first(self) -> bool:
        """Return whether the force at the end of a single closed cycle is far from the force at its
        start."""
        step = float(np.abs(np.diff(self.force)).max()) if self.x[-1] != self.x[0] else 0.0
        gap = abs(float(self.force[-1] - self.force[0]))
        return gap > _GAP * float(np.ptp(self.force)) + step

    def _set_out(self) -> None:
        """Compute an orthonormal basis of the columns for offset and drift, and the force without
        them."""
        n = self.x.size
        times = np.arange(n, dtype=np.float64)[self.counted]
        middle, half = 0.5 * (times[0] + times[-1]), max(0.5 * float(np.ptp(times)), 1.0)
        self.names = ("offset", "drift")[: 0 if self.open else min(self.number, 2)]
        terms = np.stack([np.ones(times.size), (times - middle) / half], axis=1)
        self.linear = terms[:, : len(self.names)]
        # from the factors of these columns to the offset, at the first sample, and the drift
        turn = np.array([[1.0, (times[0] - middle) / half], [0.0, 1.0 / half]])
        self.turn = turn[: len(self.names), : len(self.names)]
        self.basis = np.linalg.qr(self.linear)[0] if self.names else self.linear
        self.measured = self.force[self.counted]
        self.beside = self._aside(self.measured[None, :])[0]
        self.dof = self.measured.size - 2 - len(self.names)
        if self.dof < 1:
            bound = f"more than {2 + len(self.names)} samples that count, one for each unknown"
            raise InputError("displacement", f"{self.measured.size}", bound)

    def _aside(self, rows: Array) -> Array:
        """Return rows without the part that offset and drift can explain."""
        return np.ascontiguousarray(rows - (rows @ self.basis) @ self.basis.T)

    def _rows(self, p: Array, start: float) -> tuple[Array, Array]:
        """Return the force divided by mu0 at all samples, and its derivative with respect to ln p,
        for p = k/mu0 (m,)."""
        found = []
        for piece in np.array_split(p, 1 + p.size * self.x.size // _AT_ONCE):
            look()
            found.append(_KERNEL.loop_forces(self.code, piece, self.x, self.Fz, self.before, start))
        forces, slopes = zip(*found, strict=True)
        return np.concatenate(forces), np.concatenate(slopes)

    def _profile(self, start: float, spare: float) -> Profile:
        """Return the profile of chi2 over s = ln(k/mu0).  ``spare`` is the rise of chi2 that is
        allowed, relative to the variance about the fit."""

        def model(s: Array, _slopes: bool) -> tuple[Array, Array]:
            rows, slopes = self._rows(np.exp(s), start)
            return self._aside(rows[:, self.counted]), self._aside(slopes[:, self.counted])

        size = float(self.beside @ self.beside)
        steps = np.abs(np.diff(self.x))
        low = _SOFT[self.contact] * self.Fz.min() / self.length
        high = 8.0 * self.Fz.max() / steps[steps > 0.0].min()
        high = min(max(high, 100.0 * low), 1e12 * low)
        count = max(int(math.log10(high / low) * _PER_DECADE), 24)
        s = np.append(np.linspace(math.log(low), math.log(high), count), math.inf)
        return Profile(
            model, self.beside, True, s, lambda chi2: chi2 + spare * max(chi2, 1e-20 * size)
        )

    # --- solution ---------------------------------------------------------------------------------

    def solve(self) -> LoopFit:
        """Return the best k and mu0 with their intervals and notes."""
        width = quantile(self.dof)
        start, tau = 0.0, 1.0
        for _ in range(_STEPS):
            profile = self._profile(start, width**2 * tau / self.dof)
            best = int(np.argmin(profile.samples.chi2))
            mu0 = float(profile.samples.factor[best])
            if not self.open or mu0 <= 0.0:
                break
            before, start = start, float(self.force[0]) / mu0
            if abs(start - before) <= 1e-12 * self.load:
                break
        if not mu0 > 0.0:
            raise InputError("force", "forces", "larger where the displacement has grown")
        s, mu0 = self._polished(float(profile.samples.s[best]), mu0)
        start = float(self.force[0]) / mu0 if self.open else 0.0
        rows, slopes = (part[0] for part in self._rows(np.exp([s]), start))
        linear = self._linear(rows, mu0)
        fitted = mu0 * rows + self._line(linear)
        residuals = (self.force - fitted)[self.counted]
        chi2 = float(residuals @ residuals)
        cycle = residuals.size / max(self.number - 1, 1)
        tau, dof = _correlation(residuals, self.dof, max(cycle / _PIECES, 1.0))
        if tau > 1.0:
            spare = quantile(max(int(dof), 1)) ** 2 * tau / dof
            profile = self._profile(start, spare)
        size = float(self.beside @ self.beside)
        variance = max(chi2 / dof * tau, 1e-30 * size)
        sticks = slopes[self.counted] != 0.0
        values = {"k": mu0 * math.exp(s), "mu0": mu0, **linear}
        interval = self._intervals(profile, values, rows, slopes, variance, max(int(dof), 1))
        self._say_open_ends(values, interval, sticks)
        self._doubt(rows, slopes, mu0, residuals, sticks, variance / tau)
        return LoopFit(
            values=values,
            interval=interval,
            residuals=residuals,
            scatter=math.sqrt(chi2 / dof),
            energy=self._energy(linear),
            cycles=self.number,
            notes=tuple(self.notes),
            contact=self.contact,
            loop={
                "displacement": self.x[self.counted],
                "force": self.measured,
                "Fz": self.Fz[self.counted],
                "fitted": fitted[self.counted],
            },
        )

    def _polished(self, s: float, mu0: float) -> tuple[float, float]:
        """Return the minimum near a given place, by the Gauss-Newton method.  The force is linear
        in k and mu0 except where a sample begins to slip."""

        def off(s: float, mu0: float) -> tuple[float, Array, Array, Array]:
            begin = float(self.force[0]) / mu0 if self.open else 0.0
            rows, slopes = (x[0, self.counted] for x in self._rows(np.exp([s]), begin))
            if self.open:  # the force at the start is not proportional to mu0
                kept = np.logical_and.accumulate(np.abs(rows) < self.Fz[self.counted])
                by_mu0 = rows - np.where(kept, begin, 0.0)
            else:
                by_mu0 = rows
            r = self._aside((self.measured - mu0 * rows)[None, :])[0]
            return float(r @ r), r, self._aside(slopes[None, :])[0], self._aside(by_mu0[None, :])[0]

        if not math.isfinite(s):
            return s, mu0
        chi2, r, along, factor = off(s, mu0)
        for _ in range(_STEPS):
            columns = np.stack([mu0 * along, factor], axis=1)
            step = np.linalg.lstsq(columns, r, rcond=1e-14)[0]
            trial = s + float(step[0]), mu0 + float(step[1])
            if not (abs(step[0]) < 1.0 and trial[1] > 0.0):
                break
            better = off(*trial)
            if not better[0] < chi2:
                break
            (s, mu0), (chi2, r, along, factor) = trial, better
        return s, mu0

    def _linear(self, rows: Array, mu0: float) -> dict[str, float]:
        """Return the offset at the first sample and the drift per sample."""
        if not self.names:
            return {}
        shares = np.linalg.lstsq(self.linear, self.measured - mu0 * rows[self.counted])[0]
        return dict(zip(self.names, (self.turn * shares).sum(axis=1).tolist(), strict=True))

    def _line(self, linear: dict[str, float]) -> Array:
        """Return the sum of offset and drift at all samples."""
        times = np.arange(self.x.size) - (self.counted.start or 0)
        return np.asarray(linear.get("offset", 0.0) + linear.get("drift", 0.0) * times)

    def _energy(self, linear: dict[str, float]) -> float:
        """Return the work of the force over a whole cycle [J], the mean over the cycles that
        count."""
        if self.open:
            return math.nan
        force = self.force - self._line(linear)
        ends = self.begins[1:] if self.number > 1 else self.begins
        works = []
        for begin, end in pairwise(ends):
            x, f = (np.append(part[begin:end], part[begin]) for part in (self.x, force))
            works.append(float(np.sum(0.5 * (f[1:] + f[:-1]) * np.diff(x))))
        return float(np.mean(works))

    # --- intervals --------------------------------------------------------------------------------

    def _intervals(
        self,
        profile: Profile,
        values: dict[str, float],
        rows: Array,
        slopes: Array,
        variance: float,
        dof: int,
    ) -> dict[str, tuple[float, float]]:
        width, mu0 = quantile(dof), values["mu0"]
        # columns k, mu0, offset, drift: d ln k = d s + d ln mu0
        columns = np.stack(
            [mu0 * slopes[self.counted], rows[self.counted] - slopes[self.counted]], axis=1
        )
        columns = np.column_stack([columns, self.linear])
        inverse = np.linalg.pinv(columns.T @ columns)
        off = width * np.sqrt(variance * np.maximum(np.diag(inverse), 0.0))
        halves = {"k": off[0] * values["k"], "mu0": off[1]}
        spread = np.diag(self.turn @ inverse[2:, 2:] @ self.turn.T)
        halves |= zip(self.names, (width * np.sqrt(variance * spread)).tolist(), strict=True)
        around = {
            name: (values[name] - float(half), values[name] + float(half))
            for name, half in halves.items()
        }
        straight = np.abs(self._aside(slopes[None, self.counted])).max() > 1e-6 * self.load
        narrow = straight and max(off[0], off[1] / mu0) < _NARROW
        if narrow and math.isfinite(values["k"]) and profile.samples.chi2[0] > profile.limit:
            return around
        ranges = dict(zip(("k", "mu0"), profile.ranges(), strict=True))
        if profile.samples.chi2[0] <= profile.limit:  # a straight line: the loop need not slip
            ranges["mu0"] = ranges["mu0"][0], math.inf
        return ranges | self._linear_by_profile(profile, around)

    def _linear_by_profile(
        self, profile: Profile, around: dict[str, tuple[float, float]]
    ) -> dict[str, tuple[float, float]]:
        """Return the smallest and the largest offset and drift among the allowed contacts."""
        if not self.names:
            return {}
        allowed = np.flatnonzero(profile.samples.chi2 <= profile.limit)
        allowed = allowed[:: 1 + allowed.size // _ALLOWED]
        rows, _ = self._rows(np.exp(profile.samples.s[allowed]), 0.0)
        ends = {name: list(around[name]) for name in self.names}
        for i, row in zip(allowed.tolist(), rows[:, self.counted], strict=True):
            look()
            columns = np.column_stack([row, self.linear])
            inverse = np.linalg.pinv(columns.T @ columns)
            shares = inverse @ (columns.T @ self.measured)
            middle = self.turn @ shares[1:]
            spread = np.diag(self.turn @ inverse[1:, 1:] @ self.turn.T)
            half = np.sqrt(np.maximum(profile.limit - profile.samples.chi2[i], 0.0) * spread)
            for name, value, off in zip(self.names, middle.tolist(), half.tolist(), strict=True):
                ends[name] = [min(ends[name][0], value - off), max(ends[name][1], value + off)]
        return {name: (low, high) for name, (low, high) in ends.items()}

    # --- notes ------------------------------------------------------------------------------------

    def _note(self, text: str) -> None:
        self.notes.append(Note(NOTE, text))

    def _say_open_ends(
        self, values: dict[str, float], interval: dict[str, tuple[float, float]], sticks: Bools
    ) -> None:
        """Add notes about what the loop does not determine.  If an end of an interval is open and
        nothing else can be said, the value becomes infinite."""
        if interval["mu0"][1] == math.inf:
            least = interval["mu0"][0]
            self._note(f"the loop need not slip: mu0 has only a lower bound, {least:.4g} (95 %)")
            if sticks.all():
                values["mu0"] = math.inf
        if interval["k"][1] == math.inf:
            least = interval["k"][0]
            self._note(f"the loop need not stick: k has only a lower bound, {least:.4g} N/m (95 %)")
            if not sticks.any():
                values["k"] = math.inf

    def _doubt(
        self,
        rows: Array,
        slopes: Array,
        mu0: float,
        residuals: Array,
        sticks: Bools,
        variance: float,
    ) -> None:
        """Add notes about what in the residuals contradicts the model."""
        x, step = self.x[self.counted], np.diff(self.x, prepend=self.x[0])[self.counted]
        sign, speed = np.sign(step), np.abs(step)
        slips = ~sticks & (speed > 0.0)
        columns = np.column_stack([rows[self.counted], slopes[self.counted], self.linear])
        basis = np.linalg.qr(columns)[0]
        load = mu0 * self.load

        def effect(regressor: Array, size: float) -> float:
            """Return the amplitude of a regressor in the residuals as a fraction of mu0 Fz; 0 if it
            is not significant."""
            left = regressor - basis @ (basis.T @ regressor)
            square = float(left @ left)
            if not square > 1e-9 * float(regressor @ regressor) or not load > 0.0:
                return 0.0
            factor = float(left @ residuals) / square
            sure = abs(factor) > _SURE * math.sqrt(variance / square)
            sure &= factor**2 * square > _EXPLAINED * float(residuals @ residuals)
            share = abs(factor) * size / load
            return share if sure and share > _LARGE else 0.0

        forward = np.where(sticks, sign, 0.0) * slopes[self.counted]
        if sticks.any() and (share := effect(forward, 2.0 * float(np.abs(forward).max()))):
            self._note(
                f"the branches have different slopes: their forces differ by {share:.0%} of mu0 Fz"
            )
        if np.count_nonzero(slips) > LEAST:
            for values, cause in ((speed, "speed"), (x, "place")):
                spread = float(np.ptp(values[slips]))
                centred = np.where(slips, sign * (values - values[slips].mean()), 0.0)
                if spread > 0.0 and (share := effect(centred, spread)):
                    self._note(
                        f"the sliding force depends on the {cause}: by {share:.0%} of mu0 Fz"
                    )


def _column(name: str, value: Any, quantity: str) -> Array:
    """Return a column as finite numbers in SI, (n,), in the order of time."""
    column = np.ascontiguousarray(to_si(name, value, quantity))
    if column.ndim != 1 or not LEAST <= column.size <= MOST:
        bound = f"a column of {LEAST} to {MOST} samples: give some cycles, or each second sample"
        raise InputError(name, column.shape, bound)
    if not np.isfinite(column).all():
        index = int(np.argmin(np.isfinite(column)))
        raise InputError(name, float(column[index]), "finite: leave the row out", index)
    return column


def _whole(chosen: Any) -> tuple[int, int]:
    """Return the numbers of the first and the last cycle."""
    if (
        not isinstance(chosen, tuple | list)
        or len(chosen) != 2
        or not all(isinstance(x, int) and not isinstance(x, bool) for x in chosen)
    ):
        raise InputError("cycles", chosen, "the first and the last cycle, such as (3, 8)")
    return int(chosen[0]), int(chosen[1])


def _against(x: Array, force: Array) -> bool:
    """Return whether the force has the opposite sign of the displacement.  If it has the same sign,
    the work of a cycle and the correlation are both positive."""
    x, force = x - x.mean(), force - force.mean()
    work = float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(x)))
    travelled = float(np.abs(np.diff(x)).sum())
    correlation = float(x @ force) / math.sqrt(float(x @ x) * float(force @ force))
    return 2.0 * work / (travelled * float(np.ptp(force))) + correlation < 0.0


def _correlation(residuals: Array, dof: int, most: float) -> tuple[float, float]:
    """Return how many times larger the variance of a mean of the residuals is than for independent
    residuals (from 1 to ``most``), and the remaining degrees of freedom."""
    n = residuals.size
    spectrum = np.abs(np.fft.rfft(residuals, 2 * n)) ** 2
    covariance = np.fft.irfft(spectrum)[:n]
    if not covariance[0] > 0.0:
        return 1.0, float(dof)
    rho = covariance / covariance[0]
    if rho[1] < 2.0 / math.sqrt(n):
        return 1.0, float(dof)
    sums = 1.0 + 2.0 * np.cumsum(rho[1 : max(n // 2, 2)])
    window = np.flatnonzero(np.arange(1, sums.size + 1) >= 5.0 * sums)
    # The sum of a few correlations is too small, because the fit absorbs slow noise.  For noise
    # whose correlation decays exponentially, the sum follows from the first correlation, with
    # little of that loss (Kendall).
    first = min(float(rho[1]) + (1.0 + 4.0 * float(rho[1])) / n, 1.0 - 1.0 / n)
    of_first = (1.0 + first) / (1.0 - first)
    tau = max(float(sums[window[0]] if window.size else sums.max()), of_first, 1.0)
    tau = min(tau, most)
    lost = n - dof
    return tau, max(n - lost * tau, dof / tau, 1.0)

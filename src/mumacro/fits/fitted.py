"""Hold the results of a fit to measured points: :class:`Fit`, from :func:`mumacro.fit`."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from mumacro import plotting
from mumacro.fits.measured_points import STD, UNKNOWNS, Measured
from mumacro.fits.profile import quantile
from mumacro.inputs.fields import RIGID
from mumacro.inputs.units import unit_of
from mumacro.kernel.arrays import Array, Bools
from mumacro.results import Note, Result, Rows
from mumacro.validity import digits

_CURVE = 200  # points of the fitted law


class _Prediction(NamedTuple):
    mu_macro: Any  #: [-]
    #: its standard deviation [-], from the covariance of the fit.  If the points had no ``std``,
    #: only their scatter about the fit is known; then multiply it by Student's factor for a 95 %
    #: interval
    std: Any


class Prediction(Result, _Prediction):
    """Hold the friction that a fit predicts, in the shape of the inputs."""

    __slots__ = ()

    @property
    def columns(self) -> dict[str, Any]:
        """Return mu_macro and its standard deviation by name; for a frame one row for each case."""
        return self._asdict()


@dataclass(frozen=True, repr=False)
class Fit(Result):
    """k and mu0 of a contact, fitted to measured points.

    Attributes
    ----------
    values : dict
        k [N/m] and mu0 [-], if they were unknown; k is infinite if a rigid contact fits best.
    std : dict
        Their standard deviations; infinite if the points do not determine a value.
    covariance : ndarray
        Shape (unknowns, unknowns), in the order of ``values``.  If the points have no standard
        deviations, it is scaled by the scatter about the fit.
    interval : dict of tuple
        95 % intervals (low, high); low = 0 or high = inf if there is no bound on that side.  If
        there are several solutions, the interval covers all; ``std`` and ``covariance`` belong to
        the best one.
    residuals : ndarray
        Measured mu_macro minus mu_macro of the fit [-], (n,).
    chi2, reduced_chi2 : float
        Sum of squared residuals over their variances (1 by default); the same divided by the
        degrees of freedom, NaN if there are none.
    solutions : tuple of dict
        All minima that the points allow with a probability of 95 %, the best one first, each with
        its values and ``chi2``.
    notes : tuple of Note
        Warnings: a value that the points do not determine, or a doubt about the fit.  Remarks: what
        looks wrong in the points.
    contact, direction : str
        Contact and direction that were fitted.
    points : dict of ndarray
        The known inputs [SI] of each point, (n,); ``mu_macro``, and ``std`` if the points have it.
    """

    values: dict[str, float]
    std: dict[str, float]
    covariance: Array
    interval: dict[str, tuple[float, float]]
    residuals: Array
    chi2: float
    reduced_chi2: float
    solutions: tuple[dict[str, float], ...]
    notes: tuple[Note, ...] = field()
    contact: str
    direction: str
    points: dict[str, Array]
    _problem: Measured = field(repr=False, compare=False)

    @np.errstate(all="ignore")
    def predict(self, **inputs: Any) -> Prediction:
        """Return mu_macro of the fit and its standard deviation, at the measured points or for
        other inputs.

        Parameters
        ----------
        **inputs : float or array_like
            Fz, y0, omega or f, v0, and k or mu0 if it was known, as for
            :meth:`mumacro.Surrogate.evaluate`.  An input that is left out has the value of the
            points.

        Returns
        -------
        Prediction
            ``mu_macro`` and ``std``; numbers for one case.  A 95 % interval is mu_macro ± 1.96
            ``std``. If the points had no ``std``, use Student's factor instead of 1.96.  Its
            degrees of freedom are points minus unknowns; for 6 it is 2.45.  The band of the plot
            uses it, too.

        Raises
        ------
        InputError
            If an input was fitted or does not exist; if one is left out that differs between the
            points; if a value is out of bounds.

        Examples
        --------
        >>> import mumacro
        >>> measured = {"v0": [0.002, 0.01, 0.05, 0.2], "mu_macro": [0.1, 0.22, 0.28, 0.3]}
        >>> found = mumacro.fit(measured, Fz=10.0, y0=4e-7, f=20e3)
        >>> at_lower_frequency = found.predict(v0=0.02, f=10e3)
        >>> f"{at_lower_frequency.mu_macro:.3f} ± {at_lower_frequency.std:.3f}"
        '0.266 ± 0.003'
        """
        columns = self._problem.elsewhere(inputs)
        mu, slopes = self._problem.model(self.values, columns)
        # a rigid contact has no derivative with respect to k
        covariance = np.where(np.isfinite(self.covariance), self.covariance, 0.0)
        rows = np.stack([np.asarray(slopes[name]) for name in self.values], axis=-1)
        std = np.sqrt(np.einsum("...i,ij,...j", rows, covariance, rows))
        if not np.ndim(mu):
            return Prediction(float(mu), float(std))
        return Prediction(np.asarray(mu), std)

    @np.errstate(all="ignore")
    def curve(self) -> dict[str, Array] | None:
        """Return the fitted law over v0 with its 95 % band: v0 [m/s], mu_macro, low and high [-],
        (n,).  Return None if other inputs vary, too, or if v0 is 0 everywhere."""
        inputs = dict(self._problem.columns)
        v0 = inputs.pop("v0")
        if any(np.unique(x).size > 1 for x in inputs.values()) or not v0.any():
            return None
        fine = _fine(v0)
        mu, std = self.predict(v0=fine)
        half_width = self._width() * std
        return {
            "v0": fine,
            "mu_macro": mu,
            "low": np.maximum(mu - half_width, 0.0),
            "high": mu + half_width,
        }

    def _members(self) -> dict[str, Any]:
        """Return the members of the fit; the word rigid stands for an infinite k."""
        names = ["values", "std", "covariance", "interval", "residuals", "chi2", "reduced_chi2"]
        names += ["solutions", "warnings", *(["remarks"] if self.remarks else [])]
        members = {name: getattr(self, name) for name in (*names, "contact", "direction", "points")}
        for name in ("values", "interval", "solutions", "points"):  # an infinite std is not rigid
            members[name] = _worded(members[name])
        return {**members, "curve": self.curve()}

    @property
    def columns(self) -> dict[str, Array]:
        """Return the points, with mu_macro of the fit and the residuals."""
        friction = self.points["mu_macro"] - self.residuals
        return {**self.points, "fitted": friction, "residual": self.residuals}

    def _width(self) -> float:
        """Return the half width of a 95 % interval in standard deviations."""
        has_std = STD in self.points
        return quantile(None if has_std else self.residuals.size - len(self.values))

    def plot(self, ax: Any = None) -> Any:
        """Plot points, fit and its 95 % band over the input that varies most, usually v0, and below
        them the residuals.

        Each set of the other inputs has its own curve; if there are more than 8, there is no
        legend.  If each point has its own set (for example its own mu0), one curve passes through
        all of them, and the other inputs are interpolated.  ``ax`` is a pair of matplotlib axes, or
        one (then no residuals are drawn), or None for new ones.  The upper axes are returned.
        """
        inputs = {name: x for name, x in self._problem.columns.items() if name not in UNKNOWNS}
        along = max(inputs, key=lambda name: (np.unique(inputs[name]).size, name == "v0"))
        x, names = inputs[along], [name for name in self._problem.columns if name != along]
        sets, member = np.unique([self.points[name] for name in names], axis=1, return_inverse=True)
        fine = _fine(x)
        if sets.shape[1] == x.size > 1:
            fixed = {name: _interpolated(x, self.points[name], fine) for name in names}
            every = np.ones(x.size, np.bool_)
            curves = [self._curve("fit", along, every, fine, fixed)]
            return plotting.plot_fit(along, curves, self._title(), ax)
        curves = []
        for i, row in enumerate(sets.T):
            differing = [
                plotting.quantity_words(name, x)
                for name, x, all_ in zip(names, row, sets, strict=True)
                if all_.min() < all_.max()
            ]
            here, fixed = member.ravel() == i, dict(zip(names, row, strict=True))
            label, places = ", ".join(differing) or "fit", np.union1d(fine, x[here])
            curves.append(self._curve(label, along, here, places, fixed))
        return plotting.plot_fit(along, curves, self._title(), ax)

    def _curve(
        self, label: str, along: str, here: Bools, fine: Array, fixed: Mapping[str, Any]
    ) -> plotting.MeasuredCurve:
        """Return the curve of the fit over the values ``fine`` of one input, with the points that
        ``here`` selects; ``fixed`` has the other inputs."""
        mu, deviation = self.predict(**{along: fine}, **fixed)
        bars = self.points[STD][here] if STD in self.points else None
        x, friction, residuals = (
            column[here] for column in (self.points[along], self.points["mu_macro"], self.residuals)
        )
        band = self._width() * deviation
        return plotting.MeasuredCurve(label, x, friction, bars, residuals, fine, mu, band)

    def _title(self) -> str:
        return f"{', '.join(self._value_texts())}; {self.contact}, {self.direction}"

    def _value_texts(self) -> list[str]:
        units = {"k": " N/m", "mu0": ""}
        return [
            f"{name} = {x:.4g} ± {self.std[name]:.2g}{units[name]}"
            for name, x in self.values.items()
        ]

    def _heading(self) -> str:
        scatter = (
            f"reduced chi2 {self.reduced_chi2:.3g}"
            if STD in self.points
            else f"scatter {math.sqrt(self.reduced_chi2):.2g}"
        )
        summary = f"{self.residuals.size} points, {scatter}, {self.contact}"
        return f"<Fit {', '.join(self._value_texts())}; {summary}>"

    def _rows(self) -> Rows:
        return []

    def _in_full(self) -> tuple[str, Rows | None, list[str]]:
        """Return the values with their deviations and intervals as text, the scatter, and the
        other solutions."""
        rows: Rows = []
        for name, value in self.values.items():
            off, (low, high) = self.std[name], self.interval[name]
            form = f".{digits(off / value if 0.0 < value < math.inf else 0.0)}g"
            number = "rigid" if math.isinf(value) else f"{value:{form}}"
            ends = f"95 %: {low:{form}} to {high:{form}}"
            rows.append((name, number, f"[{unit_of(name)}]", f"+- {off:.2g}", ends))
        if STD in self.points:
            rows.append(("chi2", f"{self.reduced_chi2:.3g}", "[-]", "over the degrees of freedom"))
        else:
            scatter = f"{math.sqrt(self.reduced_chi2):.2g}"
            rows.append(("scatter", scatter, "[-]", "of mu_macro about the fit"))
        rows.append(("points", str(self.residuals.size), "", f"{self.contact}, {self.direction}"))
        for i, one in enumerate(self.solutions[1:], 2):
            values = ", ".join(f"{name} = {one[name]:.4g} {unit_of(name)}" for name in self.values)
            rows.append((f"solution {i}", values))
        return self._heading(), rows, self._below()


def _fine(x: Array) -> Array:
    """Return the points and values between them, so many that a curve through them looks smooth."""
    low = x[x > 0.0].min(initial=math.inf)
    if low == math.inf:
        return np.unique(x)
    return np.union1d(np.geomspace(low, x.max(), _CURVE), x)


def _interpolated(x: Array, column: Array, fine: Array) -> Any:
    """Return an input of the points, interpolated at other values of ``x``, smooth and monotone
    between points."""
    if column.min() == column.max() or np.unique(x).size < 2:
        return float(column[0])
    from scipy.interpolate import PchipInterpolator

    places, member = np.unique(x, return_inverse=True)
    means = np.bincount(member.ravel(), column) / np.bincount(member.ravel())
    # evenly spaced on the axis of the picture, which is logarithmic if the range is wide
    scale = places[places > 0.0].min()
    curve = PchipInterpolator(np.arcsinh(places / scale), means)
    return np.asarray(curve(np.arcsinh(fine / scale)))


def _worded(part: Any, name: str = "") -> Any:
    """Return a member of a fit, with the word rigid for an infinite k."""
    if isinstance(part, Mapping):
        return {key: _worded(entry, key) for key, entry in part.items()}
    if isinstance(part, np.ndarray):
        part = part.tolist()
    if isinstance(part, (list, tuple)):
        return [_worded(entry, name) for entry in part]
    return RIGID if name == "k" and part == math.inf else part

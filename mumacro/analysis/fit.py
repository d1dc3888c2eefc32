"""k and mu0 from measured points: least squares with the exact gradient of the table, and warnings
of what the points do not determine.

mu_macro = mu0 mu~(p) with p = k/mu0: at each p the best mu0 follows from a linear equation, so that
one scan of p sees every minimum, the limits of a soft and of a rigid contact, and the ranges that
the points allow.  Each minimum is then refined by :func:`scipy.optimize.least_squares`.  Needs
scipy, a plot matplotlib.
"""

import functools
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mumacro import plotting
from mumacro.analysis.measured_points import HARDLY, STD, UNKNOWNS, Measured
from mumacro.errors import InputError, missing
from mumacro.inputs.cases import real
from mumacro.kernel.arrays import Array
from mumacro.surrogate import Surrogate

CONFIDENCE = 0.95  # of intervals, and of the solutions that are kept
_PER_DECADE, _MOST_NODES = 10, 600  # of the scan


@dataclass(frozen=True)
class Fit:
    """k and mu0 of a contact, fitted to measured points.

    Attributes
    ----------
    values : dict
        k [N/m] and mu0 [-], those that were unknown; k is infinite where a rigid contact fits best.
    std : dict
        Their standard deviations; infinite where the points do not determine a value.
    covariance : ndarray
        (unknowns, unknowns), in the order of ``values``.  Without standard deviations of the points
        it is scaled by the scatter about the fit.
    interval : dict of tuple
        95 % intervals (low, high); low = 0 or high = inf where there is no bound on that side.  Of
        several solutions they cover all, while ``std`` and ``covariance`` are those of the best
        one.
    residuals : ndarray
        Measured mu_macro minus the fit's [-], (n,).
    chi2, reduced_chi2 : float
        Sum of squared residuals over their variances (1 by default); the same over the degrees of
        freedom, NaN without any.
    solutions : tuple of dict
        All minima that the points allow within 95 %, best first, each with values and ``chi2``.
    warnings : tuple of str
        Each names a value that the points do not determine, or a doubt about the fit.
    contact, direction : str
        Of the contact that was fitted.
    points : dict of ndarray
        The inputs [SI] of each point, (n,), the unknown ones left out; ``mu_macro``, and ``std``
        where given.
    """

    values: dict[str, float]
    std: dict[str, float]
    covariance: Array
    interval: dict[str, tuple[float, float]]
    residuals: Array
    chi2: float
    reduced_chi2: float
    solutions: tuple[dict[str, float], ...]
    warnings: tuple[str, ...]
    contact: str
    direction: str
    points: dict[str, Array]
    _problem: Measured = field(repr=False, compare=False)

    def predict(self, **inputs: ArrayLike) -> tuple[Array, Array]:
        """mu_macro of the fit [-] and its standard deviation, at inputs [SI] that replace those of
        the points."""
        columns = {
            **self._problem.columns,
            **{name: real(name, value) for name, value in inputs.items()},
        }
        mu, slopes = self._problem.model(self.values, columns)
        # a rigid contact has no slope along k
        covariance = np.where(np.isfinite(self.covariance), self.covariance, 0.0)
        rows = np.stack([slopes[name] for name in self.values], axis=-1)
        return mu, np.sqrt(np.einsum("...i,ij,...j", rows, covariance, rows))

    def plot(self, ax: Any = None) -> Any:
        """Points, fit and its 95 % band over the input that varies most; returns matplotlib's axes.

        Each set of the other inputs has a curve; more than 8 of them have no legend.  Where each
        point has a set of its own, such as its mu0, one line joins the fit at the points.
        """
        inputs = {name: x for name, x in self._problem.columns.items() if name not in UNKNOWNS}
        along = max(inputs, key=lambda name: (np.unique(inputs[name]).size, name == "v0"))
        x, names = inputs[along], [name for name in self._problem.columns if name != along]
        sets, member = np.unique([self.points[name] for name in names], axis=1, return_inverse=True)
        if sets.shape[1] == x.size > 1:
            return self._plot_each(along, ax)
        low = x[x > 0.0].min(initial=math.inf)
        fine = np.geomspace(low, x.max(), 300) if low < math.inf else x
        width = quantile(None if STD in self.points else x.size - len(self.values))
        curves = []
        for i, row in enumerate(sets.T):
            in_set = member.ravel() == i
            set_labels = [
                f"{name} = {x:.4g}"
                for name, x, all_ in zip(names, row, sets, strict=True)
                if np.ptp(all_) > 0.0
            ]
            x_curve = np.unique(np.concatenate([fine, x[in_set]]))
            mu, deviation = self.predict(**{along: x_curve}, **dict(zip(names, row, strict=True)))
            bars = self.points[STD][in_set] if STD in self.points else None
            label, mu_measured = ", ".join(set_labels) or "fit", self.points["mu_macro"][in_set]
            curves.append(
                plotting.Curve(label, x[in_set], mu_measured, bars, x_curve, mu, width * deviation)
            )
        return plotting.plot_fit(along, curves, self._title(), ax)

    def _plot_each(self, along: str, ax: Any) -> Any:
        """The same where each point has its own other inputs, such as mu0: one line."""
        order = np.argsort(self.points[along])
        x, mu_measured = self.points[along][order], self.points["mu_macro"][order]
        mu, deviation = (column[order] for column in self.predict())
        std = self.points.get(STD)
        width = quantile(None if std is not None else x.size - len(self.values))
        bars, label = None if std is None else std[order], "fit, at the inputs of each point"
        curve = plotting.Curve(label, x, mu_measured, bars, x, mu, width * deviation)
        return plotting.plot_fit(along, [curve], self._title(), ax)

    def _title(self) -> str:
        return f"{', '.join(self._value_texts())}; {self.contact}, {self.direction}"

    def _value_texts(self) -> list[str]:
        units = {"k": " N/m", "mu0": ""}
        return [
            f"{name} = {x:.4g} ± {self.std[name]:.2g}{units[name]}"
            for name, x in self.values.items()
        ]

    def __repr__(self) -> str:
        has_std = STD in self.points
        scatter = (
            f"reduced chi2 {self.reduced_chi2:.3g}"
            if has_std
            else f"scatter {math.sqrt(self.reduced_chi2):.2g}"
        )
        summary = f"{self.residuals.size} points, {scatter}, {self.contact}"
        lines = [
            f"<Fit {', '.join(self._value_texts())}; {summary}>",
            *(f"  warning: {text}" for text in self.warnings),
        ]
        return "\n".join(lines)


def fit(
    data: Any,
    unknowns: str | Sequence[str] | None = None,
    *,
    contact: str = "spring",
    direction: str = "across",
    surrogate: Surrogate | None = None,
    **fixed: Any,
) -> Fit:
    """k and mu0 of a contact, or one of them, from measured friction.

    Parameters
    ----------
    data : mapping, DataFrame, Arrow table or Dataset
        Columns ``v0`` [m/s] and ``mu_macro`` [-]; where they vary also ``Fz`` [N], ``y0`` [m],
        ``omega`` [rad/s] or ``f`` [Hz]; if known ``std``, the standard deviation of mu_macro [-],
        and ``mu0`` of each point, such as from the force without oscillation.  Other columns are
        ignored.
    unknowns : str or sequence of str, optional
        "k", "mu0" or both.  Left out: both, and k alone where ``mu0`` is a column.
    contact, direction : str
        As in :meth:`mumacro.Surrogate.evaluate`.
    surrogate : Surrogate, optional
        The table; the tightest bundled one if left out.
    **fixed : float or array_like
        Inputs that are not columns: ``Fz=10.0, y0=2e-6, f=20e3``, and k or mu0 where it is known.

    Returns
    -------
    Fit
        Its warnings are also issued by ``warnings``.

    Raises
    ------
    InputError
        A column or input is missing, out of bounds, given twice or of another length; fewer points
        than unknowns; points without information; more friction than the known mu0 allows; an
        unknown contact or unknown.

    Examples
    --------
    >>> import numpy as np
    >>> rig = {"Fz": 10.0, "y0": 2e-6, "f": 20e3}
    >>> v0 = np.geomspace(1e-3, 1.0, 30)
    >>> measured = Surrogate.open().evaluate(mu0=0.3, k=1e6, v0=v0, **rig).mu_macro
    >>> result = fit({"v0": v0, "mu_macro": measured + 1e-3 * np.cos(17.0 * np.arange(30))}, **rig)
    >>> f"{result.values['k']:.2g} {result.values['mu0']:.3f}"
    '1e+06 0.300'
    """
    names = (
        (unknowns,) if isinstance(unknowns, str) else None if unknowns is None else tuple(unknowns)
    )
    problem = _Problem(data, names, contact, direction, surrogate or _bundled_surrogate(), fixed)
    with np.errstate(all="ignore"):  # a value that the points do not determine is infinite
        result = problem.solve()
    for text in result.warnings:
        warnings.warn(text, stacklevel=2)
    return result


@functools.cache
def _bundled_surrogate() -> Surrogate:
    return Surrogate.open()


@dataclass
class _Scan:
    """Profile of chi2 over the unknowns, (nodes,); chi2 rises with mu0 by ``rise`` (mu0 - best)^2
    at fixed k/mu0."""

    k: Array
    mu0: Array
    chi2: Array
    rise: Array


class _Minimum(NamedTuple):
    """A minimum of chi2, refined from a node of the scan."""

    chi2: float
    values: dict[str, float]
    node: int


class _Problem(Measured):
    """The search for the unknowns at which the model fits the points best."""

    def _scan(self) -> _Scan:
        """Every legal k from so soft that friction is mu0 to rigid, the last node; or every mu0 of
        a known k."""
        if "k" not in self.unknowns:
            mu0 = np.geomspace(0.2, 1e6, 7 * _PER_DECADE) * self.mu.max()
            return self._scan_at(self.columns["k"][:1].repeat(mu0.size), mu0)
        force, omega, v0 = (self.columns[name] for name in ("Fz", "omega", "v0"))
        with np.errstate(all="ignore"):
            speed_length = v0 / omega
            amplitude = self.columns["y0"] if self.amplitude == "y0" else speed_length
            oscillates = (amplitude > 0.0) & (omega > 0.0)
            # v~ = 100, and 100 times y~/v~, where it slides; where it only rests y~ = 100
            stiff = (
                100.0
                * (
                    force
                    / np.where(
                        speed_length > 0.0,
                        np.minimum(speed_length, speed_length / amplitude * speed_length),
                        amplitude,
                    )
                )[oscillates]
            )
            ends = np.log([1e-3 * (force / amplitude)[oscillates].min(), stiff.max()])
        low, high = np.clip(ends, -650.0, 650.0)
        nodes = int(np.clip((high - low) / math.log(10.0) * _PER_DECADE, 16, _MOST_NODES))
        p = np.append(np.exp(np.linspace(low, high, nodes)), math.inf)
        if "mu0" not in self.unknowns:
            return self._scan_at(
                p * float(np.median(self.columns["mu0"])), np.full(p.size, math.nan)
            )
        ratio, w2 = self.at(p, np.ones(p.size)), self.weight**2
        rise = (w2 * ratio**2).sum(axis=1)
        mu0 = np.divide(
            (w2 * ratio * self.mu).sum(axis=1), rise, out=np.zeros(p.size), where=rise > 0.0
        )
        return _Scan(p * np.maximum(mu0, 1e-300), mu0, self.chi2(mu0[:, None] * ratio), rise)

    def _scan_at(self, k: Array, mu0: Array) -> _Scan:
        return _Scan(k, mu0, self.chi2(self.at(k, mu0)), np.zeros(k.size))

    # --- solutions --------------------------------------------------------------------------------

    def solve(self) -> Fit:
        """Scan, refine every minimum, and make the fit with its intervals and warnings."""
        scan, size = self._scan(), float(((self.weight * self.mu) ** 2).sum())
        if "k" in self.unknowns and np.ptp(scan.chi2) <= 1e-12 * size:
            bound = (
                "points in which k matters: up to a factor, every k fits these alike; vary v0 "
                f"or {self.amplitude}"
            )
            raise InputError("data", f"{self.n} points", bound)
        walled_chi2 = np.concatenate(([math.inf], scan.chi2, [math.inf]))
        lowest = np.flatnonzero(
            (walled_chi2[1:-1] < walled_chi2[:-2]) & (walled_chi2[1:-1] <= walled_chi2[2:])
        )
        minima = sorted((self._refine(scan, int(i)) for i in lowest), key=lambda m: m.chi2)
        chi2, dof = minima[0].chi2, self.n - len(self.unknowns)
        rounding = 1e-30 * size  # of exact points: mu_macro has sixteen digits
        variance = 1.0 if self.std is not None else max(chi2 / dof, rounding) if dof else math.inf
        width = quantile(dof if self.std is None else None)
        barrier = 1e-12 * size if math.isinf(variance) else max(variance, 1e-14 * size)
        solutions: list[_Minimum] = []
        # A minimum within 95 % is a solution of its own if chi2 rises by at least one standard
        # deviation on the way to every better solution; else it is a ripple of that one.
        for minimum in minima:
            ridges = (
                scan.chi2[
                    min(minimum.node, solution.node) : max(minimum.node, solution.node) + 1
                ].max()
                for solution in solutions
            )
            if minimum.chi2 - chi2 <= width**2 * barrier and all(
                ridge > minimum.chi2 + barrier for ridge in ridges
            ):
                solutions.append(minimum)
        values = solutions[0].values
        logs = self._covariance(values, variance)
        scale = np.array([x if math.isfinite(x) else 1.0 for x in values.values()])
        covariance = np.where(np.isinf(logs), logs, logs * np.outer(scale, scale))
        deviations = np.sqrt(np.diag(logs))
        std = dict(zip(values, (scale * deviations).tolist(), strict=True))
        interval = self._interval(scan, chi2, width, variance, values, deviations)
        # any of the solutions may be the true contact: the interval covers them all
        for solution in solutions[1:]:
            half_widths = width * np.sqrt(np.diag(self._covariance(solution.values, variance)))
            ends = _around(solution.values, half_widths)
            interval = {
                name: (min(low, ends[name][0]), max(high, ends[name][1]))
                for name, (low, high) in interval.items()
            }
        solution_dicts = tuple({**solution.values, "chi2": solution.chi2} for solution in solutions)
        points = {
            **self.columns,
            "mu_macro": self.mu,
            **({} if self.std is None else {STD: self.std}),
        }
        return Fit(
            values,
            std,
            covariance,
            interval,
            self.mu - self.model(values, self.columns)[0],
            chi2,
            chi2 / dof if dof else math.nan,
            solution_dicts,
            tuple(self._warnings(values, interval, solution_dicts, chi2, dof)),
            self.contact,
            self.direction,
            points,
            self,
        )

    def _refine(self, scan: _Scan, node: int) -> _Minimum:
        """The minimum beside a node of the scan."""
        try:
            from scipy.optimize import least_squares
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(missing("fit", error), name=error.name) from None
        values = {name: float(getattr(scan, name)[node]) for name in self.unknowns}
        if not all(0.0 < x < math.inf for x in values.values()):
            return _Minimum(float(scan.chi2[node]), values, node)

        def residuals(logs: Array) -> Array:
            return self.weight * (self.model(self._values(logs), self.columns)[0] - self.mu)

        def slopes(logs: Array) -> Array:
            return self._log_slopes(self._values(logs))

        start = np.log(list(values.values()))
        bounds = start - 2.5, start + 2.5
        # It ends by the step alone: an unknown that the points hardly determine changes chi2 and
        # its slope by next to nothing.
        optimum = least_squares(residuals, start, slopes, bounds, xtol=1e-12, ftol=None, gtol=None)
        if not np.isfinite(optimum.x).all():  # 0 / 0 in scipy, where no point depends on k
            return _Minimum(float(scan.chi2[node]), values, node)
        return _Minimum(2.0 * float(optimum.cost), self._values(optimum.x), node)

    def _values(self, logs: Array) -> dict[str, float]:
        return dict(zip(self.unknowns, np.exp(logs).tolist(), strict=True))

    def _log_slopes(self, values: Mapping[str, float]) -> Array:
        """d(weighted mu_macro) / d ln(unknown), (points, unknowns); 0 for an infinite k."""
        slopes = self.model(values, self.columns)[1]
        columns = [slopes[name] * (x if math.isfinite(x) else 0.0) for name, x in values.items()]
        return np.stack(columns, axis=-1) * self.weight[:, None]

    def _covariance(self, values: Mapping[str, float], variance: float) -> Array:
        """Of the logarithms of the unknowns; infinite for one that the points do not determine."""
        slopes = self._log_slopes(values)
        determined = np.abs(slopes).max(axis=0) > 1e-12 * np.abs(self.weight * self.mu).max()
        covariance = np.diag(np.where(determined, 0.0, math.inf))
        _, singular_values, right_vectors = np.linalg.svd(
            slopes[:, determined], full_matrices=False
        )
        if math.isinf(variance) or (
            singular_values.size and singular_values[-1] <= 1e-10 * singular_values[0]
        ):
            return np.diag(np.full(determined.size, math.inf))
        covariance[np.ix_(determined, determined)] = (
            right_vectors.T * (variance / singular_values**2) @ right_vectors
        )
        return covariance

    def _interval(
        self,
        scan: _Scan,
        chi2: float,
        width: float,
        variance: float,
        values: Mapping[str, float],
        deviations: Array,
    ) -> dict[str, tuple[float, float]]:
        """From the profile of chi2 where it has enough nodes, since an end may be open there; else
        from the covariance."""
        margin = width**2 * variance - (scan.chi2 - chi2)
        inside = margin >= 0.0
        if np.count_nonzero(inside) < 6 or math.isinf(variance):
            return _around(values, width * deviations)
        ranges = {
            "k": (scan.k[inside], scan.k[inside]),
            "mu0": (scan.mu0[inside], scan.mu0[inside]),
        }
        if len(self.unknowns) == 2:
            mu0, k = scan.mu0[inside], scan.k[inside]
            half_width = np.sqrt(margin[inside] / scan.rise[inside])
            relative_width = half_width / mu0
            low = k * np.where(relative_width < 1.0, 1.0 - relative_width, 0.0)
            ranges = {
                "k": (low, k * (1.0 + relative_width)),
                "mu0": (np.maximum(mu0 - half_width, 0.0), mu0 + half_width),
            }
        ends = {
            name: (float(ranges[name][0].min()), float(ranges[name][1].max())) for name in values
        }
        if "k" in ends and inside[0]:
            ends["k"] = 0.0, ends["k"][1]
        return ends

    def _warnings(
        self,
        values: Mapping[str, float],
        interval: Mapping[str, tuple[float, float]],
        solutions: Sequence[Mapping[str, float]],
        chi2: float,
        dof: int,
    ) -> list[str]:
        messages = []
        low, high = interval.get("k", (1.0, 1.0))
        if self.std is None and dof == 0:
            messages.append(
                "as many points as unknowns, without std: there is no measure of the error"
            )
        elif low == 0.0 and high == math.inf:
            messages.append("k is not determined: every k fits within 95 %")
        elif high == math.inf:
            messages.append(
                f"k has only a lower bound, {low:.3g} N/m (95 %): a rigid contact fits, too"
            )
        elif low == 0.0:
            messages.append(f"k has only an upper bound, {high:.3g} N/m (95 %)")
        if "k" in values and self.amplitude == "y0":
            mu0 = values["mu0"] if "mu0" in values else self.columns["mu0"]
            y = self.columns["y0"] / (mu0 * self.columns["Fz"]) * values["k"]
            if y.min() > HARDLY:
                messages.append(
                    f"y~ >= {y.min():.3g} in all points: above {HARDLY:g} mu_macro hardly depends "
                    "on k"
                )
        if len(solutions) > 1:
            listing = "; ".join(
                ", ".join(f"{name} = {solution[name]:.4g}" for name in values)
                for solution in solutions
            )
            messages.append(
                f"{len(solutions)} solutions fit within 95 %, the interval covers them all: "
                f"{listing}"
            )
        if self.std is not None and dof:
            from scipy.special import chdtrc

            if chdtrc(dof, chi2) < 1e-3:
                messages.append(
                    f"reduced chi2 {chi2 / dof:.3g}: the points scatter by more than their std"
                )
        if self.contact == "ball" and "k" in values and np.ptp(self.columns["Fz"]) > 0.0:
            messages.append(
                "one k for all loads, while k of a ball grows like Fz^(1/3): fit each load alone"
            )
        return messages


def _around(values: Mapping[str, float], half_widths: Array) -> dict[str, tuple[float, float]]:
    """Intervals about values whose logarithms may be off by ``apart`` (unknowns,)."""
    with np.errstate(over="ignore"):
        return {
            name: (
                float(x * np.exp(-half_width)) if x < math.inf else 0.0,
                float(x * np.exp(half_width)),
            )
            for (name, x), half_width in zip(values.items(), half_widths, strict=True)
        }


def quantile(dof: int | None) -> float:
    """Half width of a 95 % interval in standard deviations: of Student's t, or of the normal
    distribution."""
    from scipy.special import ndtri, stdtrit

    share = 0.5 + 0.5 * CONFIDENCE
    return float(ndtri(share) if dof is None or dof < 1 else stdtrit(dof, share))

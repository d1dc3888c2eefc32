"""Fit k and mu0 to measured points: least squares with the exact gradient of the table.  Warn of
what the points do not determine.

The model is mu_macro = mu0 mu~(p) with p = k/mu0.  For each p the best mu0 follows from a linear
equation.  So one profile of chi2 over p (:mod:`mumacro.fits.profile`) shows every minimum, the
limits of a soft and of a rigid contact, and the ranges that the points allow.  The fit needs scipy,
a plot needs matplotlib.
"""

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from mumacro.errors import InputError
from mumacro.fits.fitted import Fit
from mumacro.fits.measured_points import STD, Measured
from mumacro.fits.profile import Profile, quantile
from mumacro.kernel.arrays import Array
from mumacro.results import WARNING, Note
from mumacro.surrogate import Surrogate
from mumacro.validity import HARDLY

_PER_DECADE, _MOST_NODES = 10, 600  # the first samples: per decade, and the largest number
# at this y~ (for normal: v~) a contact is so soft that friction is mu0 to at least 6 digits
_SOFT = {"across": 1e-4, "along": 1e-6, "normal": 1e-6}
# chi2 is a parabola in an interval of k or mu0 whose width in logarithms is less than this
_NARROW = 1e-6


def fit(
    data: Any,
    unknowns: str | Sequence[str] | None = None,
    *,
    contact: str = "spring",
    direction: str = "across",
    surrogate: Surrogate | None = None,
    **fixed: Any,
) -> Fit:
    """Return k and mu0 of a contact, or one of them, from measured friction.

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
        If a column or input is missing, out of bounds, given twice or of another length; if there
        are fewer points than unknowns, or points without information; if friction is larger than
        the known mu0 allows; if the contact or an unknown does not exist.

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
    table = surrogate or Surrogate.open()
    result = best_fit(data, unknowns, table, contact=contact, direction=direction, **fixed)
    for text in result.warnings:
        warnings.warn(text, stacklevel=2)
    return result


@np.errstate(all="ignore")
def best_fit(
    data: Any,
    unknowns: str | Sequence[str] | None,
    table: Surrogate,
    /,
    *,
    contact: str,
    direction: str,
    **fixed: Any,
) -> Fit:
    """Return the result of :func:`fit`, and issue no warnings: Python has one filter of them for
    all threads."""
    return _Problem(data, unknowns, contact, direction, table, fixed).solve()


class _Minimum(NamedTuple):
    """A minimum of chi2, at a sample of the profile."""

    chi2: float
    values: dict[str, float]
    sample: int


class _Problem(Measured):
    """The search for the unknowns at which the model fits the points best."""

    def _profile(self, limit_of: Callable[[float], float]) -> Profile:
        """Return the profile of chi2 over k, over mu0 (if k is known), or over k/mu0 with the best
        mu0.  The last sample of k is the rigid contact."""
        has_factor = len(self.unknowns) == 2
        along = self.unknowns[0]

        def model(s: Array, slopes: bool) -> tuple[Array, Array]:
            with np.errstate(over="ignore"):
                x = np.exp(s)
            values = ({"mu0": 1.0} if has_factor else {}) | {along: x[:, None]}
            mu, by_name = self.model(values, self.columns, slopes)
            slope = by_name[along] if slopes else np.zeros_like(mu)
            steps = slope * np.where(np.isfinite(x), x, 0.0)[:, None]
            return mu * self.weight, np.nan_to_num(steps, posinf=0.0, neginf=0.0) * self.weight

        if along == "mu0":  # from a small one to a large one
            top = math.log(self.mu.max())
            low, high = top + math.log(1e-3), top + math.log(1e6)
        else:
            low, high = self._ends_of_k(has_factor)
        low, high = np.clip([low, high], -650.0, 650.0)
        nodes = int(np.clip((high - low) / math.log(10.0) * _PER_DECADE, 16, _MOST_NODES))
        s = np.linspace(low, high, nodes)
        rigid = [math.inf] if along == "k" else []
        return Profile(model, self.weight * self.mu, has_factor, np.append(s, rigid), limit_of)

    def _ends_of_k(self, per_mu0: bool) -> tuple[float, float]:
        """Return two logarithms of k, or of k/mu0: one so small that friction is mu0, and one so
        large that the contact is as good as rigid."""
        force, omega, v0 = (self.columns[name] for name in ("Fz", "omega", "v0"))
        with np.errstate(all="ignore"):
            speed_length = v0 / omega
            amplitude = self.columns["y0"] if self.amplitude == "y0" else speed_length
            oscillates = (amplitude > 0.0) & (omega > 0.0)
            # Where the body slides: v~ = 100, and 100 times y~/v~.  Where it only rests: y~ = 100.
            length = np.where(
                speed_length > 0.0,
                np.minimum(speed_length, speed_length / amplitude * speed_length),
                amplitude,
            )
            soft = _SOFT[self.kind.names["direction"]] * (force / amplitude)[oscillates].min()
            stiff = 100.0 * (force / length)[oscillates].max()
            mu0 = 1.0 if per_mu0 else float(np.median(self.columns["mu0"]))
            low, high = np.log([soft, stiff]) + math.log(mu0)
        return float(low), float(high)

    # --- solutions --------------------------------------------------------------------------------

    def solve(self) -> Fit:
        """Return the fit: sample the profile of chi2, then compute intervals and warnings."""
        size, dof = float(((self.weight * self.mu) ** 2).sum()), self.n - len(self.unknowns)
        width = quantile(dof if self.std is None else None)

        def variance_at(chi2: float) -> float:
            rounding = 1e-30 * size  # points without errors: mu_macro has 16 digits
            if self.std is not None:
                return 1.0
            return max(chi2 / dof, rounding) if dof else math.inf

        def barrier_at(chi2: float) -> float:
            variance = variance_at(chi2)
            return 1e-12 * size if math.isinf(variance) else max(variance, 1e-14 * size)

        profile = self._profile(lambda chi2: chi2 + width**2 * barrier_at(chi2))
        if "k" in self.unknowns and np.ptp(profile.samples.chi2) <= 1e-12 * size:
            bound = (
                "points in which k matters: up to a factor, every k fits these alike; vary v0 "
                f"or {self.amplitude}"
            )
            raise InputError("data", f"{self.n} points", bound)
        solutions = self._solutions(profile, barrier_at)
        chi2, values = solutions[0].chi2, solutions[0].values
        variance = variance_at(chi2)
        logs = self._covariance(values, variance)
        scale = np.array([x if math.isfinite(x) else 1.0 for x in values.values()])
        covariance = np.where(np.isinf(logs), logs, logs * np.outer(scale, scale))
        std = dict(zip(values, (scale * np.sqrt(np.diag(logs))).tolist(), strict=True))
        interval = self._interval(profile, solutions, width, variance)
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
            (*self._warnings(values, interval, solution_dicts, chi2, dof), *self.remarks()),
            **self.kind.names,
            points=points,
            _problem=self,
        )

    def _solutions(self, profile: Profile, barrier_at: Callable[[float], float]) -> list[_Minimum]:
        """Return the allowed minima, the best one first.

        A minimum is a separate solution if chi2 rises by at least one standard deviation on the way
        to every better solution.  Otherwise it is a ripple of a better one.
        """
        minima = [
            _Minimum(float(profile.samples.chi2[i]), self._values_at(profile, i), i)
            for i in profile.lowest().tolist()
            if profile.samples.chi2[i] <= profile.limit
        ]
        minima.sort(key=lambda minimum: minimum.chi2)
        barrier = barrier_at(minima[0].chi2)
        solutions: list[_Minimum] = []
        for minimum in minima:
            ridges = (profile.ridge(minimum.sample, other.sample) for other in solutions)
            if all(ridge > minimum.chi2 + barrier for ridge in ridges):
                solutions.append(minimum)
        return solutions

    def _values_at(self, profile: Profile, sample: int) -> dict[str, float]:
        """Return the values of the unknowns at a sample of the profile."""
        with np.errstate(over="ignore"):
            x, factor = (
                float(np.exp(profile.samples.s[sample])),
                float(profile.samples.factor[sample]),
            )
        if len(self.unknowns) == 1:
            return {self.unknowns[0]: x}
        factor = max(factor, 1e-300)
        values = {"k": x * factor, "mu0": factor}
        return {name: values[name] for name in self.unknowns}

    def _covariance(self, values: Mapping[str, float], variance: float) -> Array:
        """Return the covariance of the logarithms of the unknowns.  It is infinite for an unknown
        that the points do not determine."""
        by_name = self.model(values, self.columns)[1]
        # d(weighted mu_macro) / d ln(unknown), (points, unknowns); 0 for an infinite k
        steps = [by_name[name] * (x if math.isfinite(x) else 0.0) for name, x in values.items()]
        slopes = np.stack(steps, axis=-1) * self.weight[:, None]
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
        self, profile: Profile, solutions: Sequence[_Minimum], width: float, variance: float
    ) -> dict[str, tuple[float, float]]:
        """Return the 95 % interval of each unknown: the range that the profile of chi2 allows.  The
        covariance gives the interval if the points have no error, or if their error is unknown.
        Any of the solutions may be the true contact, so the interval covers all of them."""
        half_widths = [
            width * np.sqrt(np.diag(self._covariance(one.values, variance))) for one in solutions
        ]
        narrow = max(float(x.max()) for x in half_widths) < _NARROW
        if narrow or math.isinf(variance):
            each = [_around(one.values, x) for one, x in zip(solutions, half_widths, strict=True)]
            return {
                name: (min(x[name][0] for x in each), max(x[name][1] for x in each))
                for name in self.unknowns
            }
        ranges = dict(zip(self.unknowns, profile.ranges(), strict=True))
        if profile.samples.chi2[0] <= profile.limit:  # the softest contact: k has no lower bound
            along = self.unknowns[0]
            ranges[along] = 0.0, ranges[along][1]
        return ranges

    def _warnings(
        self,
        values: Mapping[str, float],
        interval: Mapping[str, tuple[float, float]],
        solutions: Sequence[Mapping[str, float]],
        chi2: float,
        dof: int,
    ) -> list[Note]:
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
            if HARDLY < y.min() < math.inf:
                messages.append(
                    f"every point has a y~ above {HARDLY:g} (the smallest is {y.min():.3g}), where "
                    "mu_macro hardly depends on k"
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
        if self.kind.contact and "k" in values and np.ptp(self.columns["Fz"]) > 0.0:
            messages.append(
                "one k for all loads, while k of a ball grows like Fz^(1/3): fit each load alone"
            )
        return [Note(WARNING, text) for text in messages]


def _around(values: Mapping[str, float], half_widths: Array) -> dict[str, tuple[float, float]]:
    """Return the intervals around values whose logarithms have an uncertainty of ``half_widths``
    (unknowns,)."""
    with np.errstate(over="ignore"):
        return {
            name: (
                float(x * np.exp(-half_width)) if x < math.inf else 0.0,
                float(x * np.exp(half_width)),
            )
            for (name, x), half_width in zip(values.items(), half_widths, strict=True)
        }

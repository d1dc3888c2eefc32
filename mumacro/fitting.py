"""k and mu0 from measured points: least squares with the exact gradient of the table, and what the points do not tell.

mu_macro = mu0 mu~(p) with p = k/mu0: at each p the best mu0 is linear, so that one sweep over p sees every minimum, the
limits of a soft and of a rigid contact, and the ranges of k and mu0 that the points allow.  Each minimum of the sweep is
then refined by :func:`scipy.optimize.least_squares`.  Needs scipy, a plot matplotlib.
"""

from __future__ import annotations

import functools
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mumacro.errors import InputError
from mumacro.extras import missing
from mumacro.inputs import FIELDS, NAMES, as_columns, check_inputs, real, unknown_name
from mumacro.surrogate import Surrogate

__all__ = ["CONFIDENCE", "Fit", "fit"]

Array = NDArray[np.float64]
UNKNOWNS = ("k", "mu0")
CONFIDENCE = 0.95  # of intervals, and of the solutions that are kept
HARDLY = 20.0  # y~, from which on mu_macro hardly depends on k (docs/validity.md)
_PER_DECADE, _MOST_NODES = 16, 600  # of the sweep
_SCATTER = 5.0  # standard deviations that a point may lie outside of what is possible
_STD = "std"


@dataclass(frozen=True)
class Fit:
    """What measured points say about a contact.

    Attributes
    ----------
    values : dict
        k [N/m] and mu0 [-], those that were unknown; k is infinite where a rigid contact fits best.
    std : dict
        Their standard deviations; infinite where the points do not determine a value.
    covariance : ndarray
        (unknowns, unknowns), in the order of ``values``.  Without standard deviations of the points it is scaled
        by the scatter about the fit.
    interval : dict of (low, high)
        95 % intervals; low = 0 or high = inf where there is no bound on that side.
    residuals : ndarray
        Measured mu_macro minus the fit's [-], (n,).
    chi2, reduced_chi2 : float
        Sum of squared residuals over their variances (1 if not given); the same over the degrees of freedom, NaN if
        there is none.
    solutions : tuple of dict
        All minima that the points allow within 95 %, best first, each with values and ``chi2``.
    warnings : tuple of str
        What the points do not determine.
    contact, direction : str
        As given.
    points : dict of ndarray
        The inputs [SI] of each point, (n,), the unknown ones left out; ``mu_macro``, and ``std`` where given.
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
    _problem: _Problem = field(repr=False, compare=False)

    def predict(self, **inputs: ArrayLike) -> tuple[Array, Array]:
        """mu_macro of the fit [-] and its standard deviation, at inputs [SI] that replace those of the points."""
        given = {**self._problem.columns, **{name: real(name, value) for name, value in inputs.items()}}
        mu, slopes = self._problem.model(self.values, given)
        used = np.where(np.isfinite(self.covariance), self.covariance, 0.0)  # a rigid contact has no slope along k
        rows = np.stack([slopes[name] for name in self.values], axis=-1)
        return mu, np.sqrt(np.einsum("...i,ij,...j", rows, used, rows))

    def plot(self, ax: Any = None) -> Any:
        """Points, fit and its 95 % band over v0, one curve for each set of other inputs; returns matplotlib's axes."""
        try:
            from matplotlib import pyplot as plt
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(missing("fit", error), name=error.name) from None
        if ax is None:
            ax = plt.subplots()[1]
        names = [name for name in self._problem.columns if name not in ("v0", *self.values)]
        others = np.column_stack([self._problem.columns[name] for name in names])
        sets, member = np.unique(others, axis=0, return_inverse=True)
        v0, positive = self.points["v0"], self.points["v0"][self.points["v0"] > 0.0]
        for i, row in enumerate(sets):
            mine = member.ravel() == i
            said = [f"{name}={value:.4g}" for name, value in zip(names, row, strict=True) if np.ptp(sets, axis=0).any()]
            curve = np.unique(np.concatenate([np.geomspace(positive.min(), positive.max(), 300), v0[mine]])) \
                if positive.size else v0[mine]  # fmt: skip
            mu, off = self.predict(v0=curve, **dict(zip(names, row, strict=True)))
            shown = ax.errorbar(v0[mine], self.points["mu_macro"][mine],
                                self.points[_STD][mine] if _STD in self.points else None, fmt="o")  # fmt: skip
            ax.plot(curve, mu, color=shown[0].get_color(), label=", ".join(said) or "fit")
            ax.fill_between(curve, mu - 1.96 * off, mu + 1.96 * off, color=shown[0].get_color(), alpha=0.25, lw=0)
        if positive.size and positive.max() > 10.0 * positive.min():
            ax.set_xscale("log" if positive.size == v0.size else "symlog", **(
                {} if positive.size == v0.size else {"linthresh": positive.min()}))  # fmt: skip
        ax.set(xlabel="v0 [m/s]", ylabel="mu_macro [-]", title=", ".join(self._told()))
        ax.legend()
        return ax

    def _told(self) -> list[str]:
        units = {"k": " N/m", "mu0": ""}
        return [f"{name} = {x:.4g} ± {self.std[name]:.2g}{units[name]}" for name, x in self.values.items()]

    def __repr__(self) -> str:
        given = _STD in self.points
        scatter = f"reduced chi2 {self.reduced_chi2:.3g}" if given else f"scatter {math.sqrt(self.reduced_chi2):.2g}"
        about = f"{self.residuals.size} points, {scatter}, {self.contact}"
        lines = [f"<Fit {', '.join(self._told())}; {about}>", *(f"  warning: {text}" for text in self.warnings)]
        return "\n".join(lines)


def fit(
    data: Any,
    unknowns: str | Sequence[str] = UNKNOWNS,
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
        Columns ``v0`` [m/s] and ``mu_macro`` [-]; where they vary also ``Fz`` [N], ``y0`` [m], ``omega`` [rad/s] or
        ``f`` [Hz]; if known ``std``, the standard deviation of mu_macro [-].  Other columns are ignored.
    unknowns : str or sequence of str
        "k", "mu0" or both.
    contact, direction : str
        As in :meth:`mumacro.Surrogate.evaluate`.
    surrogate : Surrogate, optional
        The table; the tightest bundled one if left out.
    **fixed : float or array_like
        Inputs that are not columns: ``Fz=10.0, y0=2e-6, f=20e3``, and k (None: rigid) or mu0 where it is known.

    Returns
    -------
    Fit
        Values with covariance, every solution, and warnings, which are also issued by :mod:`warnings`.

    Raises
    ------
    InputError
        A column or input is missing, out of bounds, given twice or of another length; fewer points than unknowns; points
        without information; more friction than the known mu0 allows; an unknown contact or unknown.

    Examples
    --------
    >>> import numpy as np
    >>> rig = {"Fz": 10.0, "y0": 2e-6, "f": 20e3}
    >>> v0 = np.geomspace(1e-3, 1.0, 30)
    >>> measured = Surrogate.open().evaluate(mu0=0.3, k=1e6, v0=v0, **rig).mu_macro
    >>> found = fit({"v0": v0, "mu_macro": measured + 1e-3 * np.cos(17.0 * np.arange(30))}, **rig)
    >>> f"{found.values['k']:.2g} {found.values['mu0']:.3f}"
    '1e+06 0.300'
    """
    names = (unknowns,) if isinstance(unknowns, str) else tuple(unknowns)
    problem = _Problem(data, names, contact, direction, surrogate or _bundled(), fixed)
    found = problem.solve()
    for text in found.warnings:
        warnings.warn(text, stacklevel=2)
    return found


@functools.cache
def _bundled() -> Surrogate:
    return Surrogate.open()


@dataclass
class _Scan:
    """Profile of chi2 over the unknowns, (nodes,); ``rise`` is d2 chi2 / 2 d mu0^2 at fixed k/mu0, where mu0 is free."""

    k: Array
    mu0: Array
    chi2: Array
    rise: Array


class _Problem:
    """The points, checked, and the model at them."""

    def __init__(
        self, data: Any, unknowns: tuple[str, ...], contact: str, direction: str, surrogate: Surrogate,
        fixed: Mapping[str, Any],
    ) -> None:  # fmt: skip
        if not unknowns or len(set(unknowns)) != len(unknowns) or set(unknowns) - set(UNKNOWNS):
            raise InputError("unknowns", unknowns, 'one or both of "k" and "mu0"')
        self.unknowns, self.contact, self.direction, self.surrogate = unknowns, contact, direction, surrogate
        # what evaluate takes beside the inputs; nothing where its defaults do
        chosen = {"contact": (contact, "spring"), "direction": (direction, "across")}
        self.said = {name: value for name, (value, usual) in chosen.items() if value != usual}
        self.amplitude = "Fz_amplitude" if direction == "normal" else "y0"
        given = self._given(data, fixed)
        self._read(given)
        self._check()

    def _given(self, data: Any, fixed: Mapping[str, Any]) -> dict[str, Any]:
        known = [name for name in NAMES if name not in self.unknowns and (name != "y0" or name == self.amplitude)]
        known += [self.amplitude] if self.amplitude not in known else []
        for name in fixed:
            if name in self.unknowns:
                raise InputError(name, fixed[name], f"left out, or taken from unknowns={self.unknowns}: it is fitted")
            if name not in (*known, "mu_macro", _STD):
                raise InputError(name, fixed[name], f"one of {', '.join(known)}; {unknown_name(name, known)}")
        names = [*known, "mu_macro", _STD]
        try:
            there = data if hasattr(data, "keys") else getattr(data, "column_names", None) or data.columns
            columns = {name: data[name] for name in names if name in there}
        except (AttributeError, TypeError, KeyError) as error:
            raise InputError("data", type(data).__qualname__, "a mapping or table with columns by name") from error
        if twice := sorted(columns.keys() & fixed.keys()):
            raise InputError(twice[0], fixed[twice[0]], "given once: as a column or as a keyword")
        given = {**columns, **fixed}
        for name in ("mu_macro", "v0"):
            if name not in given:
                raise InputError(name, sorted(map(str, there)), f"a column of the data: {name} of each point")
        return given

    def _read(self, given: dict[str, Any]) -> None:
        """Columns of one length, (n,), in SI."""
        measured = {name: real(name, np.asarray(given.pop(name))) for name in ("mu_macro", _STD) if name in given}
        six = {"y0": 0.0, **given, **dict.fromkeys(self.unknowns, 1.0)}
        frequency, six = six.get("f"), {n: x if x is None else np.asarray(x) for n, x in six.items() if n in NAMES}
        if self.amplitude == "y0" and "y0" not in given:
            raise InputError("y0", None, "given [m]")
        columns = as_columns(six)
        check_inputs(columns, frequency)
        if self.amplitude != "y0":
            if self.amplitude not in given:
                raise InputError(self.amplitude, None, "given [N]")
            columns[self.amplitude] = real(self.amplitude, np.asarray(given[self.amplitude]))
            del columns["y0"]
        whole = {**columns, **measured}
        lengths = {name: x.shape for name, x in whole.items() if x.ndim}
        if len({*lengths.values()}) > 1 or any(x.ndim > 1 for x in whole.values()):
            raise InputError("data", lengths, "columns of one length, or single values")
        n = max((x.size for x in whole.values() if x.ndim), default=1)
        whole = {name: np.ascontiguousarray(np.broadcast_to(x, n)) for name, x in whole.items()}
        self.mu, self.std = whole.pop("mu_macro"), whole.pop(_STD, None)
        self.columns = {name: x for name, x in whole.items() if name not in self.unknowns}
        self.weight = np.ones(n) if self.std is None else 1.0 / self.std
        self.n = n

    def _check(self) -> None:
        spread = np.zeros(self.n) if self.std is None else self.std
        if self.std is not None:
            _refuse("std", self.std, (spread > 0.0) & np.isfinite(spread), "finite and > 0")
        _refuse("mu_macro", self.mu, np.isfinite(self.mu) & (self.mu >= -_SCATTER * spread),
                f"finite and >= 0, within {_SCATTER:g} standard deviations")  # fmt: skip
        settings = len(np.unique(np.column_stack([*self.columns.values()]), axis=0))
        if settings < len(self.unknowns):
            raise InputError(
                "data", f"{self.n} points with {settings} different inputs",
                f"points with at least {len(self.unknowns)} different inputs for the unknowns {', '.join(self.unknowns)}; "
                "measure more, or fix one of the two",
            )  # fmt: skip
        if not self.mu.any():
            raise InputError("mu_macro", 0.0, "> 0 in at least one point: friction of zero tells nothing")
        oscillates = (self.columns[self.amplitude] > 0.0) & (self.columns["omega"] > 0.0)
        if "k" in self.unknowns and not oscillates.any():
            raise InputError("data", f"{self.n} points without oscillation",
                             f"points with {self.amplitude} > 0 and omega > 0: without oscillation mu_macro = mu0 for "
                             "every k")  # fmt: skip
        if "mu0" not in self.unknowns:
            most = self.columns["mu0"] * (1.0 + 1e-9) + _SCATTER * spread
            _refuse("mu_macro", self.mu, self.mu <= most, f"<= mu0, within {_SCATTER:g} standard deviations: oscillation "
                    "only lowers friction; give std where the points scatter, fit mu0, or look at the units")  # fmt: skip

    # --- the model ------------------------------------------------------------------------------------

    def model(self, values: Mapping[str, float], columns: Mapping[str, Array]) -> tuple[Array, dict[str, Array]]:
        """mu_macro, and its slopes along the unknowns."""
        found = self.surrogate.evaluate(**columns, **values, **self.said, gradient=True)
        slopes = {name: np.nan_to_num(found.gradient[name], posinf=0.0, neginf=0.0) for name in self.unknowns}
        return found.mu_macro, slopes

    def _scan(self) -> _Scan:
        """Every legal k from so soft that friction is mu0 to rigid, the last node; or every mu0 of a known k."""
        if "k" not in self.unknowns:
            mu0 = np.geomspace(0.2, 1e6, 7 * _PER_DECADE) * self.mu.max()
            return self._scanned(self.columns["k"][:1].repeat(mu0.size), mu0)
        force, omega, v0 = (self.columns[name] for name in ("Fz", "omega", "v0"))
        with np.errstate(all="ignore"):
            pull = v0 / omega
            reach = self.columns["y0"] if self.amplitude == "y0" else pull
            alive = (reach > 0.0) & (omega > 0.0)
            # v~ = 100, and 100 times y~/v~, where it slides; where it only rests y~ = 100
            stiff = 100.0 * (force / np.where(pull > 0.0, np.minimum(pull, pull / reach * pull), reach))[alive]
            ends = np.log([1e-3 * (force / reach)[alive].min(), stiff.max()])
        low, high = np.clip(ends, -650.0, 650.0)
        nodes = int(np.clip((high - low) / math.log(10.0) * _PER_DECADE, 16, _MOST_NODES))
        p = np.append(np.exp(np.linspace(low, high, nodes)), math.inf)
        if "mu0" not in self.unknowns:
            return self._scanned(p * float(np.median(self.columns["mu0"])), np.full(p.size, math.nan))
        ratio, w2 = self._at(p, np.ones(p.size)), self.weight**2
        rise = (w2 * ratio**2).sum(axis=1)
        mu0 = np.divide((w2 * ratio * self.mu).sum(axis=1), rise, out=np.zeros(p.size), where=rise > 0.0)
        return _Scan(p * np.maximum(mu0, 1e-300), mu0, self._chi2(mu0[:, None] * ratio), rise)

    def _scanned(self, k: Array, mu0: Array) -> _Scan:
        return _Scan(k, mu0, self._chi2(self._at(k, mu0)), np.zeros(k.size))

    def _chi2(self, model: Array) -> Array:
        return np.asarray(((self.weight * (self.mu - model)) ** 2).sum(axis=-1))

    def _at(self, k: Array, mu0: Array) -> Array:
        """mu_macro at rows of k and mu0, those that are unknown: (rows, points)."""
        rows = {"k": k[:, None], "mu0": mu0[:, None]}
        unknown = {name: rows[name] for name in UNKNOWNS if name in self.unknowns or name not in self.columns}
        return np.asarray(self.surrogate.evaluate(**self.columns, **unknown, **self.said).mu_macro)

    # --- solutions ------------------------------------------------------------------------------------

    def solve(self) -> Fit:
        """Scan, refine every minimum, and say what is known."""
        scan, size = self._scan(), float(((self.weight * self.mu) ** 2).sum())
        if "k" in self.unknowns and np.ptp(scan.chi2) <= 1e-12 * size:
            raise InputError("data", f"{self.n} points", "points in which k matters: at these inputs mu_macro is the same "
                             f"for every k up to a factor; vary v0 or {self.amplitude}")  # fmt: skip
        padded = np.concatenate(([math.inf], scan.chi2, [math.inf]))
        lowest = np.flatnonzero((padded[1:-1] < padded[:-2]) & (padded[1:-1] <= padded[2:]))
        refined = sorted((self._refine(scan, int(i)) for i in lowest), key=lambda one: one[0])
        chi2, dof = refined[0][0], self.n - len(self.unknowns)
        variance = 1.0 if self.std is not None else chi2 / dof if dof else math.inf
        width = _quantile(dof if self.std is None else None)
        least = 1e-12 * size if math.isinf(variance) else max(variance, 1e-14 * size)
        solutions: list[tuple[float, dict[str, float], int]] = []
        for one in refined:  # an island of its own, above whose shores all ways lead by one standard deviation
            walls = (scan.chi2[min(one[2], other[2]) : max(one[2], other[2]) + 1].max() for other in solutions)
            if one[0] - chi2 <= width**2 * least and all(wall > one[0] + least for wall in walls):
                solutions.append(one)
        values = solutions[0][1]
        logs = self._covariance(values) * variance if math.isfinite(variance) else np.full((len(values),) * 2, math.inf)
        scale = np.array([x if math.isfinite(x) else 1.0 for x in values.values()])
        covariance = logs * np.outer(scale, scale)
        std = {name: float(math.sqrt(x)) for name, x in zip(values, np.diag(covariance), strict=True)}
        interval = self._interval(scan, chi2, width, variance, values, np.sqrt(np.diag(logs)))
        listed = tuple({**found, "chi2": value} for value, found, _ in solutions)
        points = {**self.columns, "mu_macro": self.mu, **({} if self.std is None else {_STD: self.std})}
        return Fit(
            values, std, covariance, interval, self.mu - self.model(values, self.columns)[0], chi2,
            chi2 / dof if dof else math.nan, listed, tuple(self._warnings(values, interval, listed, chi2, dof)),
            self.contact, self.direction, points, self,
        )  # fmt: skip

    def _refine(self, scan: _Scan, node: int) -> tuple[float, dict[str, float], int]:
        """chi2 and values at the minimum beside a node."""
        try:
            from scipy.optimize import least_squares
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(missing("fit", error), name=error.name) from None
        values = {name: float(getattr(scan, name)[node]) for name in self.unknowns}
        if not all(0.0 < x < math.inf for x in values.values()):
            return float(scan.chi2[node]), values, node

        def residuals(logs: Array) -> Array:
            return self.weight * (self.model(self._values(logs), self.columns)[0] - self.mu)

        start = np.log(list(values.values()))
        found = least_squares(
            residuals, start, lambda logs: self._log_slopes(self._values(logs)), (start - 2.5, start + 2.5),
            xtol=1e-12, ftol=1e-14, gtol=1e-14,
        )  # fmt: skip
        return 2.0 * float(found.cost), self._values(found.x), node

    def _values(self, logs: Array) -> dict[str, float]:
        return dict(zip(self.unknowns, np.exp(logs).tolist(), strict=True))

    def _log_slopes(self, values: Mapping[str, float]) -> Array:
        """d(weighted mu_macro) / d ln(unknown), (points, unknowns); 0 for an infinite k."""
        slopes = self.model(values, self.columns)[1]
        columns = [slopes[name] * (x if math.isfinite(x) else 0.0) for name, x in values.items()]
        return np.stack(columns, axis=-1) * self.weight[:, None]

    def _covariance(self, values: Mapping[str, float]) -> Array:
        """Of the logarithms, at unit variance; infinite on the diagonal where the points do not tell."""
        slopes = self._log_slopes(values)
        told = np.abs(slopes).max(axis=0) > 1e-12 * np.abs(self.weight * self.mu).max()
        out = np.diag(np.where(told, 0.0, math.inf))
        left, sizes, right = np.linalg.svd(slopes[:, told], full_matrices=False)
        if sizes.size and sizes[-1] <= 1e-10 * sizes[0]:
            return np.diag(np.full(told.size, math.inf))
        out[np.ix_(told, told)] = right.T / sizes**2 @ right
        return out

    def _interval(
        self, scan: _Scan, chi2: float, width: float, variance: float, values: Mapping[str, float], off: Array
    ) -> dict[str, tuple[float, float]]:
        """From the profile where it is wide, which ends of it may be open; else from the covariance."""
        room = width**2 * variance - (scan.chi2 - chi2)
        inside = room >= 0.0
        if np.count_nonzero(inside) < 6 or math.isinf(variance):
            with np.errstate(over="ignore"):
                return {name: (float(x * np.exp(-width * o)) if x < math.inf else 0.0, float(x * np.exp(width * o)))
                        for (name, x), o in zip(values.items(), off, strict=True)}  # fmt: skip
        found = {"k": (scan.k[inside], scan.k[inside]), "mu0": (scan.mu0[inside], scan.mu0[inside])}
        if len(self.unknowns) == 2:
            mu0, k = scan.mu0[inside], scan.k[inside]
            side = np.sqrt(room[inside] / scan.rise[inside])
            found = {"k": (k * np.maximum(1.0 - side / mu0, 0.0), k * (1.0 + side / mu0)), "mu0": (mu0 - side, mu0 + side)}
        ends = {name: (float(found[name][0].min()), float(found[name][1].max())) for name in values}
        if "k" in ends and inside[0]:
            ends["k"] = 0.0, ends["k"][1]
        return ends

    def _warnings(
        self, values: Mapping[str, float], interval: Mapping[str, tuple[float, float]],
        solutions: Sequence[Mapping[str, float]], chi2: float, dof: int,
    ) -> list[str]:  # fmt: skip
        said = []
        low, high = interval.get("k", (1.0, 1.0))
        if self.std is None and dof == 0:
            said.append("as many points as unknowns, without std: there is no measure of the error")
        elif low == 0.0 and high == math.inf:
            said.append("k is not determined: every k fits within 95 %")
        elif high == math.inf:
            said.append(f"k has only a lower bound, {low:.3g} N/m (95 %): a rigid contact fits, too")
        elif low == 0.0:
            said.append(f"k has only an upper bound, {high:.3g} N/m (95 %)")
        if "k" in values and self.amplitude == "y0":
            y = self.columns["y0"] / (values.get("mu0", self.columns.get("mu0")) * self.columns["Fz"]) * values["k"]
            if y.min() > HARDLY:
                said.append(f"y~ >= {y.min():.3g} in all points: above {HARDLY:g} mu_macro hardly depends on k")
        if len(solutions) > 1:
            told = "; ".join(", ".join(f"{name} = {one[name]:.4g}" for name in values) for one in solutions)
            said.append(f"{len(solutions)} solutions fit within 95 %: {told}")
        if self.std is not None and dof:
            from scipy.special import chdtrc

            if chdtrc(dof, chi2) < 1e-3:
                said.append(f"reduced chi2 {chi2 / dof:.3g}: the points are further from the model than their std allows")
        if self.contact == "ball" and "k" in values and np.ptp(self.columns["Fz"]) > 0.0:
            said.append("one k for all loads, while k of a ball grows like Fz^(1/3): fit each load alone")
        return said


def _refuse(name: str, column: Array, legal: NDArray[np.bool_], bound: str) -> None:
    """An error for the first value that is not legal."""
    if not legal.all():
        at = int(np.argmin(legal))
        raise InputError(name, float(column[at]), bound, at)


def _quantile(dof: int | None) -> float:
    """Half width of a 95 % interval in standard deviations: of Student's t, or of the normal distribution."""
    from scipy.special import ndtri, stdtrit

    share = 0.5 + 0.5 * CONFIDENCE
    return float(ndtri(share) if dof is None or dof < 1 else stdtrit(dof, share))

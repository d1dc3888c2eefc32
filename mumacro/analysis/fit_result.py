"""What measured points say about a contact: the result of :func:`mumacro.fit`, and its picture."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mumacro.analysis.measured_points import STD, UNKNOWNS, Measured
from mumacro.inputs.fields import real, unit_of
from mumacro.kernel.arrays import Array

CONFIDENCE = 0.95  # of intervals, and of the solutions that are kept


def quantile(dof: int | None) -> float:
    """Half width of a 95 % interval in standard deviations: of Student's t, or of the normal
    distribution."""
    from scipy.special import ndtri, stdtrit

    share = 0.5 + 0.5 * CONFIDENCE
    return float(ndtri(share) if dof is None or dof < 1 else stdtrit(dof, share))


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
        (unknowns, unknowns), in the order of ``values``.  Without standard deviations of the points
        it is scaled by the scatter about the fit.
    interval : dict of tuple
        95 % intervals (low, high); low = 0 or high = inf where there is no bound on that side.  Of
        several solutions they cover all, while ``std`` and ``covariance`` are those of the best
        one.
    residuals : ndarray
        Measured mu_macro minus the fit's [-], (n,).
    chi2, reduced_chi2 : float
        Sum of squared residuals over their variances (1 if not given); the same over the degrees of
        freedom, NaN if there is none.
    solutions : tuple of dict
        All minima that the points allow within 95 %, best first, each with values and ``chi2``.
    warnings : tuple of str
        What the points do not determine.
    contact, direction : str
        As given.
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
        given = {
            **self._problem.columns,
            **{name: real(name, value) for name, value in inputs.items()},
        }
        mu, slopes = self._problem.model(self.values, given)
        # a rigid contact has no slope along k
        used = np.where(np.isfinite(self.covariance), self.covariance, 0.0)
        rows = np.stack([slopes[name] for name in self.values], axis=-1)
        return mu, np.sqrt(np.einsum("...i,ij,...j", rows, used, rows))

    def plot(self, ax: Any = None) -> Any:
        """Points, fit and its 95 % band over the input that varies most; returns matplotlib's axes.

        There is a curve for each set of the other inputs; more than 8 of them have no legend.
        Where each point has its own, such as mu0, there is one line through the fit at the points.
        """
        from mumacro.plotting import own

        ax = own(ax)
        given = {name: x for name, x in self._problem.columns.items() if name not in UNKNOWNS}
        along = max(given, key=lambda name: (np.unique(given[name]).size, name == "v0"))
        x, names = given[along], [name for name in self._problem.columns if name != along]
        sets, member = np.unique([self.points[name] for name in names], axis=1, return_inverse=True)
        if sets.shape[1] == x.size > 1:
            return self._plot_each(ax, along)
        low = x[x > 0.0].min(initial=math.inf)
        fine = np.geomspace(low, x.max(), 300) if low < math.inf else x
        width = quantile(None if STD in self.points else x.size - len(self.values))
        for i, row in enumerate(sets.T):
            mine = member.ravel() == i
            varied = [
                f"{name} = {x:.4g}"
                for name, x, all_ in zip(names, row, sets, strict=True)
                if np.ptp(all_) > 0.0
            ]
            curve = np.unique(np.concatenate([fine, x[mine]]))
            mu, off = self.predict(**{along: curve}, **dict(zip(names, row, strict=True)))
            bars = self.points[STD][mine] if STD in self.points else None
            color = ax.errorbar(x[mine], self.points["mu_macro"][mine], bars, fmt="o")[
                0
            ].get_color()
            ax.plot(curve, mu, color=color, label=", ".join(varied) or "fit")
            ax.fill_between(
                curve, mu - width * off, mu + width * off, color=color, alpha=0.25, lw=0
            )
        if low < x.max() / 10.0:
            ax.set_xscale("symlog", linthresh=low) if (x == 0.0).any() else ax.set_xscale("log")
        ax.set(
            xlabel=f"{along} [{unit_of(along)}]",
            ylabel="mu_macro [-]",
            title=", ".join(self._told()),
        )
        if sets.shape[1] <= 8:
            ax.legend()
        return ax

    def _plot_each(self, ax: Any, along: str) -> Any:
        """The same where each point has its own other inputs, such as mu0: one line."""
        order = np.argsort(self.points[along])
        x, measured = self.points[along][order], self.points["mu_macro"][order]
        mu, off = (column[order] for column in self.predict())
        std = self.points.get(STD)
        width = quantile(None if std is not None else x.size - len(self.values))
        color = ax.errorbar(x, measured, None if std is None else std[order], fmt="o")[
            0
        ].get_color()
        ax.plot(x, mu, color=color, label="fit, at the inputs of each point")
        ax.fill_between(x, mu - width * off, mu + width * off, color=color, alpha=0.25, lw=0)
        if x[0] > 0.0 and x[-1] > 10.0 * x[0]:
            ax.set_xscale("log")
        ax.set(
            xlabel=f"{along} [{unit_of(along)}]",
            ylabel="mu_macro [-]",
            title=", ".join(self._told()),
        )
        ax.legend()
        return ax

    def _told(self) -> list[str]:
        units = {"k": " N/m", "mu0": ""}
        return [
            f"{name} = {x:.4g} ± {self.std[name]:.2g}{units[name]}"
            for name, x in self.values.items()
        ]

    def __repr__(self) -> str:
        given = STD in self.points
        scatter = (
            f"reduced chi2 {self.reduced_chi2:.3g}"
            if given
            else f"scatter {math.sqrt(self.reduced_chi2):.2g}"
        )
        about = f"{self.residuals.size} points, {scatter}, {self.contact}"
        lines = [
            f"<Fit {', '.join(self._told())}; {about}>",
            *(f"  warning: {text}" for text in self.warnings),
        ]
        return "\n".join(lines)

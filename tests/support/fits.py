"""Random measured points, and the least chi2 of a fit to them by another search."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from mumacro import Surrogate
from tests.support.cases import Case

Array = NDArray[np.float64]
_PER_DECADE, _AROUND = 300, 4


def random_points(table: Surrogate, seed: int) -> tuple[Case, Case]:
    """3 to 8 noisy points of a spring along, most of them near y~ = 1, and the rig."""
    rng = np.random.default_rng([62, seed])
    n = int(rng.integers(3, 9))
    rig: Case = {"Fz": 10.0, "omega": 1.2e5, "direction": "along"}
    mu0, k = rng.uniform(0.1, 0.6), 10.0 ** rng.uniform(5.5, 7.5)
    length = mu0 * rig["Fz"] / k
    rig["y0"] = float(length * np.exp(rng.normal(0.0, 0.5)))
    v0 = rig["y0"] * rig["omega"] * 10.0 ** rng.uniform(-3.0, 1.0, n)
    std = mu0 * 10.0 ** rng.uniform(-3.0, -1.3, n)
    mu = table.evaluate(mu0=mu0, k=k, v0=v0, **rig).mu_macro + std * rng.standard_normal(n)
    return {"v0": v0, "mu_macro": np.maximum(mu, 0.0), "std": std}, rig


def least_chi2(table: Surrogate, points: Case, rig: Case) -> float:
    """Over a dense grid of k/mu0 with the best mu0 of each, and then between its lowest places."""

    def chi2(logs: Array) -> Array:
        k = np.exp(np.atleast_1d(logs))[:, None]
        ratio = table.evaluate(mu0=1.0, k=k, v0=points["v0"][None, :], **rig).mu_macro
        row, measured = ratio / points["std"], points["mu_macro"] / points["std"]
        mu0 = np.maximum(row @ measured, 0.0) / (row * row).sum(axis=1)
        return np.asarray(((measured - mu0[:, None] * row) ** 2).sum(axis=1))

    stiff = rig["Fz"] / rig["y0"]
    s = np.log(stiff) + np.log(10.0) * np.arange(-4.0, 7.0, 1.0 / _PER_DECADE)
    grid = chi2(s)
    inner = np.flatnonzero((grid[1:-1] <= grid[:-2]) & (grid[1:-1] <= grid[2:])) + 1
    least = float(grid.min())
    for i in inner[np.argsort(grid[inner])][:_AROUND]:
        found = minimize_scalar(
            lambda x: float(chi2(np.array([x]))[0]),
            bounds=(s[i - 1], s[i + 1]),
            method="bounded",
            options={"xatol": 1e-10},
        )
        least = min(least, float(found.fun))
    return least

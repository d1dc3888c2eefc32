"""Make the plain grid at the root of a table: for plots, and for tools with their own
interpolation, with the errors of these tools."""

from typing import Any

import numpy as np
from scipy.interpolate import RectBivariateSpline, RegularGridInterpolator

from mumacro.table.blocks import (
    INTERPOLATION_STATISTICS,
    Table,
    interpolation_error,
)

from ..solver.sweep import Sweep
from .rounding import ERROR_BITS, bits, to_bits

#: fresh solves with which interpolation is compared: over the whole grid, and along its smallest
#: v~, where the corner is sharpest and the error largest
POINTS = 20_000


def plain_grid(sweep: Sweep, tolerance: float) -> dict[str, Any]:
    """Return the log-spaced grid for plots.  It is finer for finer tables; its nodes are solved,
    not interpolated.

    mu~ and the stick fraction keep as many digits as the table's tolerance needs;
    ``error_estimate`` is the error of the solver and of the rounding.
    """
    n = 31 if tolerance > 1e-5 else (61 if tolerance > 1e-9 else 121)
    v, y = np.geomspace(1e-3, 1e3, n), np.geomspace(1e-3, 1e3, n)
    solution = sweep.solve("full", v[:, None], y[None, :])
    crit = sweep.solve("border", np.ones_like(y), y)["deficit"]
    mu, stick = (
        to_bits(solution[name], bits(tolerance)) for name in ("mu_ratio", "stick_fraction")
    )
    error = to_bits(
        solution["error_estimate"] + np.abs(mu - solution["mu_ratio"]),
        ERROR_BITS,
        away_from_zero=True,
    )
    return {
        "v_tilde": v,
        "y_tilde": y,
        "mu_ratio": mu,
        "stick_fraction": stick,
        "error_estimate": error,
        "v_tilde_crit": crit,
    }


def interpolation_errors(table: Table, sweep: Sweep, seed: int = 2018) -> dict[str, float]:
    """Return the attributes of the root that state the errors of tools that interpolate the plain
    grid.

    The tools are linear and bicubic interpolation over ln v~ and ln y~ by scipy.  The errors are
    the median and the 99 % value at log-uniform points, and the largest error at these points and
    along the smallest v~.
    """
    rng, axes = np.random.default_rng(seed), (np.log(table.v_tilde), np.log(table.y_tilde))
    inner = np.array([rng.uniform(axis[0], axis[-1], POINTS) for axis in axes])
    edge = np.array([np.full(POINTS, axes[0][0]), rng.uniform(axes[1][0], axes[1][-1], POINTS)])
    where = np.concatenate([inner, edge], axis=1)
    truth = sweep.solve("full", *np.exp(where))["mu_ratio"]
    values = {
        "linear": RegularGridInterpolator(axes, table.mu_ratio)(where.T),
        "cubic": RectBivariateSpline(*axes, table.mu_ratio).ev(*where),
    }
    out: dict[str, float] = {}
    for method, value in values.items():
        error = np.abs(value - truth)
        found = (*np.quantile(error[:POINTS], (0.5, 0.99)), error.max())
        out |= {
            interpolation_error(method, statistic): float(x)
            for statistic, x in zip(INTERPOLATION_STATISTICS, found, strict=True)
        }
    return out

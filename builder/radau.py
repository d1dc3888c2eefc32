"""Radau IIA collocation on [0, 1]: nodes, weights and the differentiation matrix, from NumPy's Legendre series."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

__all__ = ["RADAU_DIFF", "RADAU_NODES", "RADAU_WEIGHTS"]

STAGES = 20  # 5.8**-20 = 5e-16: the decay on a step whose length is half the distance to the turn of the shaker


def _radau(n: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Nodes (n,) in (0, 1], weights (n,), and d/dc of the interpolant through (0, nodes) at the nodes, (n, n + 1)."""
    series = np.zeros(n + 1)
    series[n], series[n - 1] = 1.0, -1.0
    roots = np.sort(legendre.legroots(series).real)
    slope = legendre.legder(series)
    for _ in range(3):
        step = legendre.legval(roots, series) / legendre.legval(roots, slope)
        roots = roots - step
    roots[-1] = 1.0
    nodes = 0.5 * (1.0 + roots)
    # interpolatory weights: int_0^1 of the Lagrange polynomials, by a Gauss rule that is exact for them
    points, gauss = legendre.leggauss(n)
    points = 0.5 * (1.0 + points)
    weights = np.array(
        [0.5 * np.sum(gauss * np.prod([(points - c) / (a - c) for c in nodes if c != a], axis=0)) for a in nodes]
    )
    full = np.concatenate(([0.0], nodes))
    bary = np.array([1.0 / np.prod([a - c for c in full if c != a]) for a in full])
    gap = full[:, None] - full[None, :]
    np.fill_diagonal(gap, 1.0)
    diff = (bary[None, :] / bary[:, None]) / gap
    np.fill_diagonal(diff, 0.0)
    np.fill_diagonal(diff, -diff.sum(axis=1))
    return nodes, weights, diff[1:]


RADAU_NODES, RADAU_WEIGHTS, RADAU_DIFF = _radau(STAGES)

"""Compute one stiff step of slip by Radau IIA collocation, with nodes, weights and derivatives from
NumPy's Legendre series.

Equations: Benad, Nakano, Popov, Popov (2018), (11), (12); symbols and charts as in :mod:`.slip`.
"""

import math

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from .compiled import solver_kernel

# 5.8**-20 = 5e-16: the decay on a step whose length is half the distance to the turn of the shaker
STAGES = 20


def _radau(n: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return nodes (n,) in (0, 1], weights (n,), and d/dc of the interpolant through (0, nodes) at
    the nodes, (n, n + 1)."""
    series = np.array([0.0] * (n - 1) + [-1.0, 1.0])
    roots, slope = np.sort(legendre.legroots(series).real), legendre.legder(series)
    for _ in range(3):
        roots = roots - legendre.legval(roots, series) / legendre.legval(roots, slope)
    roots[-1] = 1.0
    nodes = 0.5 * (1.0 + roots)
    # interpolatory weights: int_0^1 of the Lagrange polynomials, by a Gauss rule that is exact for
    # them
    points, gauss = legendre.leggauss(n)
    points = 0.5 * (1.0 + points)
    weights = np.array(
        [
            0.5 * np.sum(gauss * np.prod([(points - c) / (a - c) for c in nodes if c != a], axis=0))
            for a in nodes
        ]
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


@solver_kernel
def _solve_in_place(a: np.ndarray, b: np.ndarray) -> None:
    """Solve a x = b by elimination with row pivots; write x into ``b`` (n,) and destroy ``a`` (n,
    n).

    This replaces np.linalg.solve, which takes 5 s to compile and 3 times as long to run on 20
    unknowns.
    """
    n = b.size
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            pivot = i if abs(a[i, k]) > abs(a[pivot, k]) else pivot
        for j in range(k, n):
            a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
        b[k], b[pivot] = b[pivot], b[k]
        for i in range(k + 1, n):
            factor = a[i, k] / a[k, k]
            for j in range(k + 1, n):
                a[i, j] -= factor * a[k, j]
            b[i] -= factor * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= a[k, j] * b[j]
        b[k] /= a[k, k]


@solver_kernel
def _direction(x: float, chart: int) -> tuple[float, float, float]:
    """Return u_x, u_y and 1 - u_x [-] of the local angle ``x`` [rad] in ``chart``."""
    s, c = math.sin(x), math.cos(x)
    if chart == 0:
        half = math.sin(0.5 * x)
        return c, s, 2.0 * (half * half)
    return (-s, c, 1.0 + s) if chart > 0 else (s, -c, 1.0 - s)


@solver_kernel
def collocate(
    v: float,
    y: float,
    sign: float,
    sigma: float,
    x0: float,
    chart: int,
    length: float,
    sums: np.ndarray,
) -> tuple[float, float]:
    """Compute one step of ``length`` [rad] from (sigma, chart base + x0), started on the slow
    manifold tan th = y cos tau / v.

    cos tau = sign sin sigma.  Add the integrals of u_x, 1 - u_x, lam and y cos tau u_y to ``sums``
    (4,).  Return the local angle at the end [rad], NaN without convergence, and the smallest lam at
    the nodes, which exceeds the smallest one between them by at most 0.1 %.
    """
    xs, c = np.empty(STAGES), np.empty(STAGES)
    for i in range(STAGES):
        c[i] = sign * math.sin(sigma + RADAU_NODES[i] * length)
        xs[i] = math.atan2(y * c[i], v) - chart * (0.5 * math.pi)
    jac, res, worst = np.empty((STAGES, STAGES)), np.empty(STAGES), math.inf
    for _ in range(12):
        for i in range(STAGES):
            ux, uy, _deficit = _direction(xs[i], chart)
            acc = RADAU_DIFF[i, 0] * x0
            for j in range(STAGES):
                acc += RADAU_DIFF[i, j + 1] * xs[j]
                jac[i, j] = RADAU_DIFF[i, j + 1]
            jac[i, i] += (v * ux + y * c[i] * uy) * length
            res[i] = acc - (y * c[i] * ux - v * uy) * length
        _solve_in_place(jac, res)
        worst = 0.0
        for i in range(STAGES):
            xs[i] -= res[i]
            worst = max(worst, abs(res[i]))
        if worst < 1e-9 or not worst < 1e3:
            break
    part, least = np.zeros(4), math.inf
    for i in range(STAGES):
        ux, uy, deficit = _direction(xs[i], chart)
        wt, lam = RADAU_WEIGHTS[i] * length, v * ux + y * c[i] * uy
        part[0] += wt * ux
        part[1] += wt * deficit
        part[2] += wt * lam
        part[3] += wt * y * c[i] * uy
        least = min(least, lam)
    sums += part
    return (xs[STAGES - 1] if worst < 1e-9 else math.nan), least

"""From Chebyshev nodes, as they stand in the file, to the cells that the kernel evaluates.

The file holds the values at tensor-product Chebyshev points of the first kind: none lies on an edge, where a solve
would be ill conditioned, and the interpolant is the near-best polynomial on the closed rectangle.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from friction.kernels import DEGREE, SQRT2, WIDTH
from friction.regions import BlockSpec

__all__ = [
    "axis_positions",
    "cells_1d",
    "cells_2d",
    "chebyshev_coefficients",
    "interpolation_matrix",
    "nodes",
    "s_of_sigma",
]

Array = NDArray[np.float64]

# Chebyshev points of one cell and the matrix that takes values there to power-basis coefficients, highest power first
_LOCAL = -np.cos((np.arange(WIDTH) + 0.5) * np.pi / WIDTH)
_TO_POWERS: Array = np.linalg.inv(np.vander(_LOCAL, WIDTH))


def nodes(n: int, low: float, high: float) -> Array:
    """Chebyshev points of the first kind on [low, high], ascending, shape (n,)."""
    x = -np.cos((np.arange(n) + 0.5) * np.pi / n)
    return np.asarray(0.5 * (low + high) + 0.5 * (high - low) * x, dtype=np.float64)


def chebyshev_coefficients(values: Array) -> Array:
    """Chebyshev coefficients of the interpolant through ``values`` at :func:`nodes`, along every axis."""
    out = np.asarray(values, dtype=np.float64)
    for axis in range(out.ndim):
        n = out.shape[axis]
        x = (np.arange(n) + 0.5) * np.pi / n
        k = np.arange(n)
        matrix = 2.0 / n * np.cos(np.outer(k, np.pi - x))
        matrix[0] *= 0.5
        out = np.moveaxis(np.tensordot(matrix, out, axes=(1, axis)), 0, axis)
    return out


def interpolation_matrix(n: int, t: Array) -> Array:
    """Matrix (len(t), n) from Chebyshev coefficients to values at ``t`` in [-1, 1]."""
    return np.asarray(chebyshev.chebvander(t, n - 1), dtype=np.float64)


def _cell_points(cells: int) -> Array:
    """Local Chebyshev points of all cells as positions in [-1, 1], shape (cells * WIDTH,)."""
    edge = np.arange(cells)[:, None]
    return (-1.0 + (2.0 * edge + 1.0 + _LOCAL[None, :]) / cells).ravel()


def cells_1d(values: Array, cells: int) -> Array:
    """Power-basis coefficients (cells, WIDTH), highest power first, of node ``values`` (n,)."""
    matrix = interpolation_matrix(values.size, _cell_points(cells))
    local = (matrix @ chebyshev_coefficients(values)).reshape(cells, WIDTH)
    out: Array = np.ascontiguousarray(local @ _TO_POWERS.T)
    return out


def s_of_sigma(sigma: Array) -> Array:
    """s of the table file for the evaluation's coordinate sigma (:func:`friction.kernels.edge_coordinate`)."""
    low = np.arcsin(np.minimum(sigma, math.sqrt(0.5)))
    high = 0.5 * math.pi - np.arcsin(np.clip(SQRT2 - sigma, 0.0, math.sqrt(0.5)))
    out: Array = 2.0 / math.pi * np.where(sigma <= math.sqrt(0.5), low, high)
    return out


def axis_positions(spec: BlockSpec, axis: int, cells: int) -> Array:
    """Local Chebyshev points of all cells along one axis, as positions in [-1, 1] on the nodes' axis.

    Along s the cells are uniform in sigma; cells that lie wholly below the block are never visited and repeat its edge.
    """
    if (spec.a_name, spec.b_name)[axis] != "s":
        return _cell_points(cells)
    low, high = spec.b
    s = s_of_sigma(0.5 * SQRT2 * (_cell_points(cells) + 1.0))
    first = s.reshape(cells, WIDTH)
    dead = s_of_sigma(SQRT2 * (np.arange(cells) + 1.0) / cells) <= low
    first[dead] = low
    return (2.0 * first.ravel() - low - high) / (high - low)


def cells_2d(spec: BlockSpec, values: Array, cells_a: int, cells_b: int) -> Array:
    """Power-basis coefficients (cells_a * cells_b, WIDTH, WIDTH) of node ``values`` (n_a, n_b).

    Axis 1 counts powers of the b coordinate, axis 2 powers of the a coordinate, both from DEGREE down to 0.
    """
    c = chebyshev_coefficients(values)
    left = interpolation_matrix(values.shape[0], axis_positions(spec, 0, cells_a))
    right = interpolation_matrix(values.shape[1], axis_positions(spec, 1, cells_b))
    local = (left @ c @ right.T).reshape(cells_a, WIDTH, cells_b, WIDTH)
    power = np.einsum("pi,aibj,qj->abqp", _TO_POWERS, local, _TO_POWERS, optimize=True)
    return np.ascontiguousarray(power.reshape(cells_a * cells_b, DEGREE + 1, DEGREE + 1))

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
    "aligned",
    "cell_positions",
    "cells_1d",
    "cells_2d",
    "chebyshev_coefficients",
    "evaluation_span",
    "file_coordinate",
    "interpolation_matrix",
    "nodes",
    "pace_of",
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


def evaluation_span(name: str, low: float, high: float) -> tuple[float, float]:
    """The span of a coordinate as evaluation knows it: sigma for s, tan(psi/2) for the angle, else itself."""
    return (0.0, SQRT2) if name == "s" else (low, high)


def pace_of(name: str, low: float, high: float, cells: int) -> tuple[float, float]:
    """(offset, pace) with which pace * coordinate + offset counts cells from 0; its whole part is the cell.

    The far end counts a hair less than ``cells``, so that it belongs to the last cell.
    """
    start, stop = evaluation_span(name, low, high)
    pace = cells / (stop - start) * (1.0 - 2.0**-51)
    return -pace * start, pace


def file_coordinate(name: str, x: Array) -> Array:
    """The table file's coordinate at ``x``, the evaluation's."""
    if name == "angle":
        return np.asarray(4.0 / np.pi * np.arctan(x), dtype=np.float64)
    return s_of_sigma(x) if name == "s" else x


def _cell_points(cells: int, low: float, high: float) -> Array:
    """Local Chebyshev points of all cells between ``low`` and ``high``, shape (cells * WIDTH,)."""
    edge = np.arange(cells)[:, None]
    out: Array = (low + (high - low) * (0.5 * (2.0 * edge + 1.0 + _LOCAL[None, :]) / cells)).ravel()
    return out


def cell_positions(name: str, low: float, high: float, cells: int) -> tuple[Array, Array]:
    """Cell points of one axis: as evaluation's coordinate and as positions in [-1, 1] on the axis of nodes.

    Along s, points below the block are never visited; cells that lie wholly below it repeat its edge.
    """
    start, stop = evaluation_span(name, low, high)
    x = _cell_points(cells, start, stop)
    at = file_coordinate(name, x)
    if name == "s":
        dead = s_of_sigma(SQRT2 * (np.arange(cells) + 1.0) / cells) <= low
        at.reshape(cells, WIDTH)[dead] = low
    return x, (2.0 * at - low - high) / (high - low)


def cells_1d(name: str, span: tuple[float, float], values: Array, cells: int) -> Array:
    """Power-basis coefficients (cells, WIDTH), highest power first, of a piece of v~crit with node ``values`` (n,).

    On the logarithmic piece they hold v~crit itself, on the others the tabulated quotient.
    """
    x, at = cell_positions(name, *span, cells)
    local = interpolation_matrix(values.size, at) @ chebyshev_coefficients(values)
    if name == "ln_y":
        local = local * np.exp(0.5 * x)
    local = local.reshape(cells, WIDTH)
    mean = local.mean(axis=1)
    out: Array = np.ascontiguousarray((local - mean[:, None]) @ _TO_POWERS.T)
    out[:, -1] += mean
    return out


def s_of_sigma(sigma: Array) -> Array:
    """s of the table file for the evaluation's coordinate sigma (:func:`friction.kernels.edge_coordinate`)."""
    low = np.arcsin(np.minimum(sigma, math.sqrt(0.5)))
    high = 0.5 * math.pi - np.arcsin(np.clip(SQRT2 - sigma, 0.0, math.sqrt(0.5)))
    out: Array = 2.0 / math.pi * np.where(sigma <= math.sqrt(0.5), low, high)
    return out


def cells_2d(spec: BlockSpec, values: Array, cells: tuple[int, int]) -> Array:
    """Power-basis coefficients (cells_a * cells_b, WIDTH, WIDTH) of node ``values`` (n_a, n_b).

    Axis 1 counts powers of the b coordinate, axis 2 powers of the a coordinate, both from DEGREE down to 0.
    """
    left = interpolation_matrix(values.shape[0], cell_positions(spec.a_name, *spec.a, cells[0])[1])
    right = interpolation_matrix(values.shape[1], cell_positions(spec.b_name, *spec.b, cells[1])[1])
    local = (left @ chebyshev_coefficients(values) @ right.T).reshape(cells[0], WIDTH, cells[1], WIDTH)
    # the mean apart: the change of basis multiplies rounding errors by a hundred
    mean = local.mean(axis=(1, 3))
    power = np.einsum("pi,aibj,qj->abqp", _TO_POWERS, local - mean[:, None, :, None], _TO_POWERS, optimize=True)
    power[:, :, -1, -1] += mean
    out = aligned(cells[0] * cells[1], DEGREE + 1, DEGREE + 1)
    out[...] = power.reshape(out.shape)
    return out


def aligned(*shape: int) -> Array:
    """An empty array that starts on a cache line: a row of eight coefficients then lies in one."""
    raw = np.empty(math.prod(shape) + 8)
    skip = (-raw.ctypes.data % 64) // 8
    return raw[skip : skip + math.prod(shape)].reshape(shape)

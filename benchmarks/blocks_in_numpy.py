"""The blocks of a table evaluated with NumPy: what the coordinates give, without the kernel.

One spring that is shaken across, 0 < y~ <= 2^17: the charts of ``src/mumacro/kernel/atlas.c`` with
the Chebyshev polynomials of the file, not cut into cells.
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import ellipe, ellipk

from mumacro.table import atlas
from mumacro.table.atlas import Axis
from mumacro.table.blocks import Table
from mumacro.table.polynomials import chebyshev_coefficients, interpolation_matrix

Array = NDArray[np.float64]
PORTION = 4096  # points at once: their matrices stay in the cache
NAMES = atlas.BLOCK_NAMES
LOW, CORNER, MID = map(NAMES.index, ("stick_slip_low", "corner", "stick_slip_mid"))
#: blocks of 1.5 < y~ <= 2^17 in the order of y~: first index in continuous sliding, in stick-slip
SLIDES, STICKS = map(NAMES.index, ("continuous_mid_1", "stick_slip_mid_1"))
FAST = len(NAMES)


class BlocksInNumpy:
    """mu~(v~, y~) of one spring that is shaken across, from the nodes of a table."""

    def __init__(self, table: Table) -> None:
        spring = table.contacts["spring"]
        self._border = [chebyshev_coefficients(piece.values) for piece in table.border]
        self._blocks = [
            (chart, chebyshev_coefficients(block.nodes["mu_ratio"]))
            for chart, block in zip(spring.charts, spring.blocks, strict=True)
        ]

    def __call__(self, v: Array, y: Array) -> Array:
        """mu~ at points (n,)."""
        out = np.empty(v.size)
        for start in range(0, v.size, PORTION):
            part = slice(start, start + PORTION)
            out[part] = self._some(v[part], y[part])
        return out

    def crit(self, y: Array) -> Array:
        """v~crit at ``y`` (n,)."""
        low, out = y <= atlas.Y_CONT, np.empty(y.size)
        out[low] = self._piece(0, y[low] ** 2) * 0.5 * y[low] ** 2
        out[~low] = self._piece(1, np.log(y[~low])) * np.sqrt(y[~low])
        return out

    def _piece(self, index: int, x: Array) -> Array:
        c = self._border[index]
        return np.asarray(_polynomials(atlas.BORDER_PIECES[index][1], x, c.size) @ c)

    def _some(self, v: Array, y: Array) -> Array:
        rho = v / self.crit(y)
        slides, small, lowest = rho >= 1.0, y <= atlas.Y_CONT, y <= atlas.Y_STICK_LO
        # coordinates of the blocks of stick-slip, then of those of continuous sliding; mu~ is a
        # base and a factor times what a block holds
        s = 2.0 / math.pi * np.arcsin(np.sqrt(np.minimum(rho, 1.0)))
        squares, logarithm, ratio = y * y, np.log(y), v / y
        a = np.where(small, squares, logarithm)
        b = np.where(slides, np.where(small, v * v / (1.0 + v * v), np.log(rho)), s)
        base = (small & (slides | lowest)).astype(float)
        factor = np.where(slides, ratio / np.hypot(1.0, ratio), ratio)
        factor = np.where(small, np.where(slides, -0.25 * squares / (1.0 + v * v), 1.0), factor)
        factor = np.where(lowest & ~slides, -squares, factor)
        later = (y > atlas.Y_MID).astype(int) + (y > atlas.Y_HIGH)
        block = np.where(slides, SLIDES + later, STICKS + later)
        block[small] = np.where(slides[small], 0, np.where(lowest[small], LOW, MID))
        block[~small & (rho > atlas.RHO_MAX)] = FAST
        beside = block == MID
        a[beside] = y[beside]
        corner = beside & (s < atlas.S_CUT)
        block[corner] = CORNER
        if corner.any():
            a[corner], b[corner], factor[corner] = _polar(v[corner], y[corner])
        out = np.empty(v.size)
        for index, (chart, c) in enumerate(self._blocks):
            at = block == index
            if at.any():
                left = _polynomials(chart.a, a[at], c.shape[0])
                right = _polynomials(chart.b, b[at], c.shape[1])
                out[at] = base[at] + factor[at] * np.einsum("pj,pj->p", left @ c, right)
        at = block == FAST
        out[at] = _large_speed(v[at], y[at])
        return out


def _polynomials(axis: Axis, x: Array, n: int) -> Array:
    """Chebyshev polynomials (points, n) at the file's coordinate ``x``."""
    t = (2.0 * x - axis.low - axis.high) / (axis.high - axis.low)
    return interpolation_matrix(n, np.clip(t, -1.0, 1.0))


def _polar(v: Array, y: Array) -> tuple[Array, Array, Array]:
    """Radius, angle and phi of the corner, phi^3 + 2 (y~ - 1) phi = pi v~."""
    c, p = math.pi * v, 2.0 * (y - 1.0)
    root = np.cbrt(c)
    phi = np.where(
        p >= 0.0, c / (np.maximum(p, 0.0) + root * root), np.sqrt(root * root - np.minimum(p, 0.0))
    )
    for _ in range(3):
        slope = 3.0 * phi * phi + p
        newton = (phi * (phi * phi + p) - c) / slope
        phi -= newton / (1.0 - 3.0 * phi * newton / slope)
    s0 = np.sqrt(2.0 * c / phi)
    psi = np.arctan2(math.sqrt(2.0) * phi, s0 / math.sqrt(2.0))
    return np.hypot(s0 / math.sqrt(2.0), math.sqrt(2.0) * phi), 2.0 / math.pi * psi, phi


def _large_speed(v: Array, y: Array) -> Array:
    """The two terms that hold from v~/v~crit = 128 on."""
    share = 1.0 / (1.0 + v * v)
    squares = y * y * share
    h = np.sqrt(1.0 + squares)
    m, q2 = squares / (h * h), 1.0 / (h * h)
    k, e = 2.0 / math.pi * ellipk(m), 2.0 / math.pi * ellipe(m)
    i5 = (2.0 * (2.0 - m) * e - q2 * k) / 3.0
    i7 = (4.0 * (2.0 - m) * i5 - 3.0 * q2 * e) / 5.0
    second = (1.5 * i7 - m * i5) * h + (1.5 * e - 0.5 * k - 2.5 * i5) / h
    return np.asarray(k / h + second * share)

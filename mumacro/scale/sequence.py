"""The Sobol sequence from any counter on.

scipy.stats.qmc.Sobol holds 2^30 points and reaches point n in n steps; chunk 1e6 of a design would wait for all before
it.  Here the first point of a chunk comes from the binary digits of its counter, the others by one exclusive or each.
"""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from mumacro.kernel_cache import kernel

__all__ = ["DIMENSIONS", "MOST_POINTS", "shifts", "sobol_points"]

BITS = 52  # (i + 1/2) 2^-52 is a double, inside (0, 1)
MOST_POINTS = 2**BITS
# Joe and Kuo's new-joe-kuo-6.21201: coefficients of the primitive polynomial, first direction numbers
_POLYNOMIALS = ((0, (1,)), (1, (1, 3)), (1, (1, 3, 1)), (2, (1, 1, 1)), (1, (1, 1, 3, 3)))
DIMENSIONS = 1 + len(_POLYNOMIALS)


@functools.cache
def _directions() -> NDArray[np.int64]:
    """Direction numbers (DIMENSIONS, BITS), scaled by 2^BITS."""
    rows = [[1] * BITS]
    for inner, first in _POLYNOMIALS:
        m, degree = list(first), len(first)
        for i in range(degree, BITS):
            new = m[i - degree] ^ (m[i - degree] << degree)
            for k in range(1, degree):
                new ^= ((inner >> (degree - 1 - k)) & 1) * (m[i - k] << k)
            m.append(new)
        rows.append(m)
    return np.array([[m << (BITS - 1 - i) for i, m in enumerate(row)] for row in rows], np.int64)


def shifts(seed: int | None) -> NDArray[np.int64]:
    """The digital shift of each dimension; 0 where there is no seed."""
    if seed is None:
        return np.zeros(DIMENSIONS, np.int64)
    return np.random.default_rng(seed).integers(0, MOST_POINTS, DIMENSIONS)


@kernel
def _fill(directions: NDArray[np.int64], first: int, shift: int, out: NDArray[np.float64]) -> None:
    state, gray, bit = shift, first ^ (first >> 1), 0
    while gray:
        if gray & 1:
            state ^= directions[bit]
        gray >>= 1
        bit += 1
    for i in range(out.size):
        out[i] = (state + 0.5) * 2.0**-52
        counter, bit = first + i, 0
        while counter & 1:  # the lowest binary digit that is 0 changes Gray's code
            counter >>= 1
            bit += 1
        state ^= directions[min(bit, 51)]


def sobol_points(dimension: int, first: int, n: int, shift: int) -> NDArray[np.float64]:
    """Coordinate ``dimension`` of the points ``first`` to ``first + n - 1``, (n,), in (0, 1)."""
    out = np.empty(n)
    _fill(_directions()[dimension], first, shift, out)
    return out

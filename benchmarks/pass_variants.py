"""The passes of :mod:`friction.lanes` with a part exchanged, compiled anew, and the loop that they stand for."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from friction import kernels, lanes
from friction.outer import FUSE

__all__ = ["bits", "library_log", "passes", "places", "point_by_point"]

Array = NDArray[np.float64]
_ONE = 1023 << 52


@njit(error_model="numpy", nogil=True, fastmath=FUSE, forceinline=True)
def bits(x: float) -> float:
    """Exponent + mantissa - 1 of normal ``x`` > 0, as they stand in memory."""
    return float(np.float64(x).view(np.int64) - _ONE) * 2.0**-52


@njit(error_model="numpy", nogil=True, fastmath=FUSE, forceinline=True)
def library_log(x: float) -> float:
    """The mathematical library's."""
    return math.log(x)


def _again(function: Any, inline: bool = False, **replaced: Any) -> Any:
    """``function`` compiled with other globals."""
    plain = function.py_func
    body = FunctionType(plain.__code__, {**plain.__globals__, **replaced}, plain.__name__)
    return njit(error_model="numpy", nogil=True, fastmath=FUSE, forceinline=inline)(body)


def _kernels(replaced: dict[str, Any]) -> dict[str, Any]:
    """One point's way, with ``patch_value`` or ``log`` replaced."""
    locate = _again(kernels.locate, True, **replaced)
    return {"ratio": _again(kernels.ratio, True, **replaced, locate=locate)}


def passes(**replaced: Any) -> Callable[..., None]:
    """``f(v, y, coef, meta, bcoef, bmeta, mu)`` on one thread, with globals of kernels and passes ``replaced``."""
    parts = ("_amplitudes", "_borders", "_places", "_cells", "_values")
    names = dict(replaced)
    if replaced:
        names |= {name: _again(getattr(lanes, name), **replaced) for name in parts} | _kernels(replaced)
    evaluate = _again(lanes.evaluate_chunk, **names) if replaced else lanes.evaluate_chunk
    plan, scratch, chunk = lanes.plan, lanes.scratch, lanes.CHUNK

    @njit(error_model="numpy", nogil=True, fastmath=FUSE)
    def run(v: Array, y: Array, coef: Array, meta: Array, bcoef: Array, bmeta: Array, mu: Array) -> None:
        table = plan(meta)
        floats, ints = scratch()
        bound, source = np.empty(0), np.empty(0, np.int8)
        for low in range(0, v.size, chunk):
            here = slice(low, low + chunk)
            evaluate(v[here], y[here], coef, meta, bcoef, bmeta, table, floats, ints, mu[here], bound, source)

    return run


@njit(error_model="numpy", nogil=True, fastmath=FUSE)
def point_by_point(v: Array, y: Array, coef: Array, meta: Array, bcoef: Array, bmeta: Array, mu: Array) -> None:
    """One point after another through the branches of :func:`friction.kernels.ratio`."""
    for i in range(v.size):
        mu[i] = kernels.ratio(v[i], y[i], coef, meta, bcoef, bmeta)[0]


@njit(error_model="numpy", nogil=True, fastmath=FUSE)
def places(
    v: Array, y: Array, meta: Array, bcoef: Array, bmeta: Array, patch: NDArray[np.int64], u: Array, w: Array
) -> int:  # fmt: skip
    """Fill patches and local coordinates of those points that have a patch, and return how many they are."""
    n = 0
    for i in range(v.size):
        source, a, b, _, _, _ = kernels.locate(v[i], y[i], bcoef, bmeta)
        if source < kernels.NO_PATCH:
            patch[n], u[n], w[n] = kernels.cell(meta, source, a, b)
            n += 1
    return n

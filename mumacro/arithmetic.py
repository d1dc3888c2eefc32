"""Arithmetic that is the same for one point and for many: a logarithm that becomes vector code, and a fused sum."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types
from numba.extending import intrinsic, overload

from mumacro.kernel_cache import part

__all__ = ["log", "square_plus"]

_ONE = 1023 << 52  # the bits of 1.0
_FRACTION = (1 << 52) - 1
_LN2 = math.log(2.0)


@part(inline=True)
def log(x: float) -> float:
    """ln ``x`` for normal ``x`` > 0; off by at most 4e-16 of the larger of 1 and |ln x|.

    The exponent times ln 2, plus the interpolant of ln m at 22 Chebyshev points of 1 <= m < 2 in powers of t = 2 m - 3.
    A call of the library would keep the loops around it from becoming vector code, and so would a loop over the
    coefficients.
    """
    bits = np.float64(x).view(np.int64)
    exponent = float((bits >> 52) - 1023)
    t = 2.0 * np.int64((bits & _FRACTION) | _ONE).view(np.float64) - 3.0
    r = 8.147030617423693e-12 * t - 2.5599340398034772e-11
    r = r * t + 3.581167726977918e-11
    r = r * t - 1.137399589058893e-10
    r = r * t + 4.68876933664286e-10
    r = r * t - 1.4937846446461467e-09
    r = r * t + 4.634629673422033e-09
    r = r * t - 1.489798820617583e-08
    r = r * t + 4.825438145941571e-08
    r = r * t - 1.5682598837570532e-07
    r = r * t + 5.131822958476521e-07
    r = r * t - 1.6935019474605292e-06
    r = r * t + 5.645029741591138e-06
    r = r * t - 1.9051975262152995e-05
    r = r * t + 6.53210529159902e-05
    r = r * t - 0.00022862368522794772
    r = r * t + 0.000823045267493534
    r = r * t - 0.003086419753098382
    r = r * t + 0.012345679012345583
    r = r * t - 0.055555555555555254
    r = r * t + 0.3333333333333333
    r = r * t + 0.4054651081081644
    return exponent * _LN2 + r


def square_plus(x: float, c: float) -> float:
    """x^2 + c, rounded once when compiled: left to the compiler, one point and many would differ in the last digit."""
    return x * x + c


@intrinsic
def _square_plus(_typing: Any, _x: Any, _c: Any) -> Any:
    def codegen(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        return builder.fma(args[0], args[0], args[1])

    return types.float64(types.float64, types.float64), codegen


@overload(square_plus, inline="always")
def _compiled_square_plus(x: Any, c: Any) -> Any:  # noqa: ARG001 (numba reads the signature)
    def body(x: Any, c: Any) -> Any:
        return _square_plus(x, c)  # type: ignore[call-arg]  # numba supplies the typing context

    return body

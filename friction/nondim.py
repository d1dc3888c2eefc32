"""Dimensional inputs: what is legal, the dimensionless groups, and products that would overflow.

y~ = y0 k / (mu0 Fz), v~ = v0 k / (mu0 Fz omega), l0 = mu0 Fz / k (eq. (5)); SI units throughout.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit, prange
from numpy.typing import ArrayLike, NDArray

from friction.errors import InputError
from friction.kernels import NO_OSCILLATION, ROUNDING, STATIC_LIMIT, ratio
from friction.lanes import CHUNK, evaluate_chunk, plan, scratch
from friction.outer import FUSE, outer_expansion
from friction.regions import RIGID
from friction.slopes import ratio_and_slopes, speed_slope_at_zero

__all__ = [
    "BOUNDS",
    "FIELDS",
    "POSITIVE",
    "UNITS",
    "Fault",
    "as_columns",
    "check_inputs",
    "evaluate_array",
    "evaluate_block",
    "find_faults",
    "gradient",
    "gradient_array",
    "groups",
    "groups_array",
]

FIELDS = ("mu0", "Fz", "k", "y0", "omega", "v0")
UNITS = {"mu0": "-", "Fz": "N", "k": "N/m", "y0": "m", "omega": "rad/s", "v0": "m/s"}
POSITIVE = ("mu0", "Fz", "k")
BOUNDS = {name: "finite and > 0" if name in POSITIVE else "finite and >= 0" for name in FIELDS}
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Fault:
    """One bad value of a batch: where, which field, what was given, why it is refused."""

    index: int
    field: str
    value: float
    reason: str


def _bad(name: str, values: Array) -> NDArray[np.bool_]:
    legal = np.isfinite(values) & ((values > 0.0) if name in POSITIVE else (values >= 0.0))
    out: NDArray[np.bool_] = ~legal
    return out


def find_faults(columns: Mapping[str, ArrayLike]) -> list[Fault]:
    """Every bad case of a batch, one fault (its first bad field) a case, in order.

    ``columns`` maps field names to scalars or arrays that broadcast together; a missing ``k`` means rigid contact.
    """
    names = [name for name in FIELDS if columns.get(name) is not None]
    arrays = dict(
        zip(names, np.broadcast_arrays(*(np.asarray(columns[n], dtype=np.float64) for n in names)), strict=True)
    )
    first: dict[int, Fault] = {}
    for name in names:
        values = arrays[name].ravel()
        for i in np.flatnonzero(_bad(name, values)):
            first.setdefault(int(i), Fault(int(i), name, float(values[i]), f"must be {BOUNDS[name]}"))
    return [first[i] for i in sorted(first)]


def as_columns(columns: Mapping[str, Any]) -> dict[str, Array]:
    """What was given, as float64 arrays; their values are not looked at.

    Raises
    ------
    InputError
        When something is no number.
    """
    converted: dict[str, Array] = {}
    for name in FIELDS:
        value = columns.get(name)
        if value is None:
            continue
        try:
            converted[name] = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(name, value, "a real number or an array of them") from error
    return converted


def check_inputs(columns: Mapping[str, Any]) -> dict[str, Array]:
    """What was given, as float64 arrays within :data:`BOUNDS`.

    Raises
    ------
    InputError
        At the first value out of bounds, naming field, value, bound and index; or when a value is no number.
    """
    converted = as_columns(columns)
    for name, values in converted.items():
        bad = _bad(name, values)
        if bad.any():
            i = int(np.flatnonzero(bad.ravel())[0])
            raise InputError(name, float(values.ravel()[i]), BOUNDS[name], i if values.ndim else None)
    return converted


@njit(cache=True, error_model="numpy", nogil=True)
def _scaled(a: float, b: float, c: float, d: float, e: float) -> float:
    """a b / (c d e) for finite positive numbers whose partial products may overflow or underflow."""
    ma, ea = math.frexp(a)
    mb, eb = math.frexp(b)
    mc, ec = math.frexp(c)
    md, ed = math.frexp(d)
    me, ee = math.frexp(e)
    return math.ldexp(ma * mb / (mc * md * me), ea + eb - ec - ed - ee)


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, forceinline=True)
def groups(mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float) -> tuple[float, float]:
    """(v~, y~) [-], eqs. (6), (8); 0 and inf where they leave the range of double precision.  y0, omega, v0 > 0."""
    force = mu0 * Fz
    stretch, pace, speed = y0 * k, force * omega, v0 * k
    # the plain products are right unless one of them came near the ends of the double range
    smallest = min(min(force, stretch), min(pace, speed))
    largest = max(max(force, stretch), max(pace, speed))
    if smallest > 1e-290 and largest < 1e290:
        return speed / pace, stretch / force
    return _scaled(v0, k, mu0, Fz, omega), _scaled(y0, k, mu0, Fz, 1.0)


@njit(cache=True, error_model="numpy", nogil=True)
def amplitude_ratio(y0: float, omega: float, v0: float) -> float:
    """r = y~/v~ = y0 omega/v0 [-], which needs no stiffness."""
    product = y0 * omega
    return product / v0 if 1e-290 < product < 1e290 else _scaled(y0, omega, v0, 1.0, 1.0)


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def case_groups(mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float) -> tuple[float, float]:
    """(v~, y~) [-] of a legal case, zero and rigid ones included: v~ is infinite where nothing oscillates."""
    if y0 == 0.0 or omega == 0.0 or v0 == 0.0:
        y = 0.0 if y0 == 0.0 else (math.inf if k == math.inf else _scaled(y0, k, mu0, Fz, 1.0))
        return math.inf if v0 > 0.0 else 0.0, y
    if k == math.inf:
        return math.inf, math.inf
    return groups(mu0, Fz, k, y0, omega, v0)


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def _unusual(
    mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float,
    coef: Array, meta: Array, bcoef: Array, bmeta: Array,
) -> tuple[float, float, int, float, float]:  # fmt: skip
    """:func:`dimensional` where an input is zero, the contact rigid, or a group beyond double precision."""
    v, y = case_groups(mu0, Fz, k, y0, omega, v0)
    if y0 == 0.0 or omega == 0.0:
        return 1.0, 0.0, NO_OSCILLATION, v, y
    if v0 == 0.0:
        if k == math.inf:
            return 0.0, 0.0, STATIC_LIMIT, v, y
        mu, bound, source = ratio(0.0, y, coef, meta, bcoef, bmeta)
        return mu, bound, source, v, y
    r = amplitude_ratio(y0, omega, v0)
    mu, _, _, _, _ = outer_expansion(r)
    if k == math.inf:
        return mu, ROUNDING * mu, RIGID, v, y
    if y == 0.0 or r == 0.0:
        return 1.0, ROUNDING, NO_OSCILLATION if y == 0.0 else RIGID, v, y
    if v == 0.0:
        # v~ below 5e-324: the static limit holds to rounding, mu~ itself underflows for y~ > 1
        mu, bound, source = ratio(0.0, y, coef, meta, bcoef, bmeta)
        return mu, bound, source, v, y
    # y~ beyond double range: only the outer solution is left, corrected by the layers when v~ is not large
    return mu, ROUNDING * mu + (mu if v < 1e150 else 0.0), RIGID, v, y


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, forceinline=True)
def dimensional(
    mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float,
    coef: Array, meta: Array, bcoef: Array, bmeta: Array,
) -> tuple[float, float, int, float, float]:  # fmt: skip
    """(mu~, bound, source, v~, y~) of one legal case; k = inf is rigid contact, eq. (37)."""
    if y0 > 0.0 and omega > 0.0 and v0 > 0.0 and k < math.inf:
        v, y = groups(mu0, Fz, k, y0, omega, v0)
        if 0.0 < y < math.inf and 0.0 < v < math.inf:
            mu, bound, source = ratio(v, y, coef, meta, bcoef, bmeta)
            return mu, bound, source, v, y
    return _unusual(mu0, Fz, k, y0, omega, v0, coef, meta, bcoef, bmeta)


@njit(cache=True, error_model="numpy", nogil=True)
def gradient(
    mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float,
    mu: float, source: int, v: float, y: float, coef: Array, meta: Array, bcoef: Array, bmeta: Array, out: Array,
) -> None:  # fmt: skip
    """Fill ``out`` (6,) with d mu_macro / d input in the order of FIELDS, given what :func:`dimensional` found.

    One-sided at the edges: d/dy0 = 0 at y0 = 0, d/domega = 0 at omega = 0, d/dv0 = mu0/(l0 omega) dmu~/dv~ at v0 = 0,
    which is infinite on y~ = 1 and for rigid contact.
    """
    out[:] = 0.0
    out[0] = mu
    if source == NO_OSCILLATION:
        return
    if source == RIGID:
        if v0 > 0.0:
            _, _, slope, _, _ = outer_expansion(amplitude_ratio(y0, omega, v0))
            out[3], out[4], out[5] = mu0 * slope / y0, mu0 * slope / omega, -mu0 * slope / v0
        return
    if source == STATIC_LIMIT and y == math.inf:
        out[5] = math.inf
        return
    _, along_v, along_y = ratio_and_slopes(v, y, coef, meta, bcoef, bmeta)
    both = along_v + along_y
    out[0] = mu - both
    out[1] = -mu0 * both / Fz
    out[2] = mu0 * both / k
    out[3] = mu0 * along_y / y0
    out[4] = -mu0 * along_v / omega
    if v0 > 0.0:
        out[5] = mu0 * along_v / v0
    else:
        out[5] = mu0 * speed_slope_at_zero(y, coef, meta, bcoef, bmeta) * (k / (mu0 * Fz)) / omega


@njit(cache=True, error_model="numpy", nogil=True, parallel=True)
def gradient_array(
    mu0: Array, Fz: Array, k: Array, y0: Array, omega: Array, v0: Array,
    mu: Array, source: NDArray[np.int8], v: Array, y: Array,
    coef: Array, meta: Array, bcoef: Array, bmeta: Array, out: Array,
) -> None:  # fmt: skip
    """Fill ``out`` (n, 6), see :func:`gradient`."""
    for i in prange(mu.size):
        gradient(
            mu0[i], Fz[i], k[i], y0[i], omega[i], v0[i], mu[i], source[i], v[i], y[i], coef, meta, bcoef, bmeta, out[i]
        )


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def _groups(
    mu0: Array, Fz: Array, k: Array, y0: Array, omega: Array, v0: Array,
    v: Array, y: Array, odd: NDArray[np.int64],
) -> int:  # fmt: skip
    """v~ and y~ of ordinary cases; list the others: zero, rigid, near the ends of the double range, or illegal."""
    for i in range(v.size):
        force, stretch, speed = mu0[i] * Fz[i], y0[i] * k[i], v0[i] * k[i]
        pace = force * omega[i]
        smallest = min(min(force, stretch), min(pace, speed))
        largest = max(max(force, stretch), max(pace, speed))
        fast, wide = speed / pace, stretch / force
        # with mu0 and k positive, positive products leave no negative factor; NaN fails the comparisons
        ordinary = (
            (mu0[i] > 0.0) & (k[i] > 0.0) & (smallest > 1e-290) & (largest < 1e290)
            & (fast > 0.0) & (fast < math.inf) & (wide > 0.0) & (wide < math.inf)
        )  # fmt: skip
        v[i] = fast if ordinary else -1.0
        y[i] = wide if ordinary else -1.0
    found = 0
    for i in range(v.size):
        odd[found] = i
        found += int(v[i] < 0.0)
    return found


@njit(cache=True, error_model="numpy", nogil=True)
def _legal(mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float, rigid: bool) -> bool:
    """Whether the case is within :data:`BOUNDS`; with ``rigid`` k is infinite."""
    return (
        0.0 < mu0 < math.inf and 0.0 < Fz < math.inf and k > 0.0 and (rigid or k < math.inf)
        and 0.0 <= y0 < math.inf and 0.0 <= omega < math.inf and 0.0 <= v0 < math.inf
    )  # fmt: skip


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def _evaluate_chunk(
    mu0: Array, Fz: Array, k: Array, y0: Array, omega: Array, v0: Array,
    coef: Array, meta: Array, bcoef: Array, bmeta: Array, table: Array, floats: Array, ints: NDArray[np.int64],
    rigid: bool, macro: Array, mu: Array, bound: Array, source: NDArray[np.int8],
) -> int:  # fmt: skip
    n = mu.size
    v, y, odd = np.empty(n), np.empty(n), np.empty(n + 1, np.int64)
    found = _groups(mu0, Fz, k, y0, omega, v0, v, y, odd)
    evaluate_chunk(v, y, coef, meta, bcoef, bmeta, table, floats, ints, mu, bound, source)
    illegal = 0
    for j in range(found):
        i = odd[j]
        if _legal(mu0[i], Fz[i], k[i], y0[i], omega[i], v0[i], rigid):
            mu[i], bound[i], source[i], _, _ = dimensional(
                mu0[i], Fz[i], k[i], y0[i], omega[i], v0[i], coef, meta, bcoef, bmeta
            )
        else:
            illegal += 1
            mu[i], bound[i], source[i] = math.nan, math.nan, -1
    for i in range(n):
        macro[i] = mu[i] * mu0[i]
        bound[i] *= mu0[i]
    return illegal


@njit(cache=True, error_model="numpy", nogil=True)
def _part(given: Array, n: int, low: int, high: int, row: Array) -> Array:
    """What a column of n values, or of one that holds for all, says of the cases from ``low`` to ``high``."""
    if given.size == n:
        return given[low:high]
    row[:] = given[0]
    return row[: high - low]


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE, parallel=True)
def evaluate_array(
    mu0: Array, Fz: Array, k: Array, y0: Array, omega: Array, v0: Array,
    coef: Array, meta: Array, bcoef: Array, bmeta: Array,
    rigid: bool, macro: Array, mu: Array, bound: Array, source: NDArray[np.int8],
) -> int:  # fmt: skip
    """Fill mu_macro, mu~, the bound of mu_macro and the source (n,) from six columns (n,) or (1,); count illegal cases.

    What stands at an illegal case is NaN, and -1 for the source.  With ``rigid`` an infinite k is legal.
    """
    n = mu.size
    table = plan(meta)
    illegal = 0
    for c in prange((n + CHUNK - 1) // CHUNK):
        floats, ints = scratch()
        rows = np.empty((6, CHUNK))
        a = c * CHUNK
        b = min(a + CHUNK, n)
        illegal += _evaluate_chunk(
            _part(mu0, n, a, b, rows[0]), _part(Fz, n, a, b, rows[1]), _part(k, n, a, b, rows[2]),
            _part(y0, n, a, b, rows[3]), _part(omega, n, a, b, rows[4]), _part(v0, n, a, b, rows[5]),
            coef, meta, bcoef, bmeta, table, floats, ints,
            rigid, macro[a:b], mu[a:b], bound[a:b], source[a:b],
        )  # fmt: skip
    return illegal


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def evaluate_block(
    mu0: Array, Fz: Array, k: Array, y0: Array, omega: Array, v0: Array,
    coef: Array, meta: Array, bcoef: Array, bmeta: Array,
    macro: Array, mu: Array, bound: Array, source: NDArray[np.int8],
) -> int:  # fmt: skip
    """:func:`evaluate_array` on the calling thread, for columns of n values or of one that holds for all cases.

    An infinite k is rigid contact.
    """
    n = mu.size
    table = plan(meta)
    floats, ints = scratch()
    columns = np.empty((6, CHUNK))
    illegal = 0
    for low in range(0, n, CHUNK):
        m = min(CHUNK, n - low)
        for j, given in enumerate((mu0, Fz, k, y0, omega, v0)):
            if given.size == n:
                columns[j, :m] = given[low : low + m]
            elif low == 0:
                columns[j, :] = given[0]
        illegal += _evaluate_chunk(
            columns[0], columns[1], columns[2], columns[3], columns[4], columns[5],
            coef, meta, bcoef, bmeta, table, floats, ints, True,
            macro[low : low + m], mu[low : low + m], bound[low : low + m], source[low : low + m],
        )  # fmt: skip
    return illegal


@njit(cache=True, error_model="numpy", nogil=True, fastmath=FUSE)
def groups_array(
    mu0: Array, Fz: Array, k: Array, y0: Array, omega: Array, v0: Array, v: Array, y: Array
) -> None:  # fmt: skip
    """Fill v~ and y~ (n,) of legal cases, as :func:`dimensional` has them."""
    for i in range(v.size):
        v[i], y[i] = case_groups(mu0[i], Fz[i], k[i], y0[i], omega[i], v0[i])

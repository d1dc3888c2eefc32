"""Dimensional inputs: what is legal, the dimensionless groups, and the chain rule to the six inputs.

y~ = y0 k / (mu0 Fz), v~ = v0 k / (mu0 Fz omega), l0 = mu0 Fz / k (eq. (5)); SI units throughout.  An infinite k is
rigid contact, eq. (37).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mumacro.charts import DENORMAL, MU, NO_OSCILLATION, OTHER, RIGID, ROUNDING, STATIC_LIMIT
from mumacro.errors import InputError
from mumacro.evaluate import answer, answer_with_slopes, common_ratio, speed_slope_at_zero
from mumacro.kernel_cache import kernel, part
from mumacro.outer import outer_expansion

__all__ = [
    "BOUNDS",
    "FIELDS",
    "MOST_HZ",
    "POSITIVE",
    "RAD_PER_CYCLE",
    "UNITS",
    "Fault",
    "as_columns",
    "check_inputs",
    "evaluate_case",
    "evaluate_unusual",
    "find_faults",
    "first_bad",
    "gradient",
    "group_columns",
    "groups",
    "length_scale",
    "other_cases",
    "real",
    "scaled",
]

FIELDS = ("mu0", "Fz", "k", "y0", "omega", "v0")
UNITS = {"mu0": "-", "Fz": "N", "k": "N/m", "y0": "m", "omega": "rad/s", "v0": "m/s"}
POSITIVE = ("mu0", "Fz", "k")
BOUNDS = {name: "finite and > 0" if name in POSITIVE else "finite and >= 0" for name in FIELDS}
Array = NDArray[np.float64]
Codes = NDArray[np.int8]
RAD_PER_CYCLE = 2.0 * math.pi  # omega [rad/s] at f = 1 Hz
MOST_HZ = sys.float_info.max / RAD_PER_CYCLE  # above, omega is beyond double range


@dataclass(frozen=True)
class Fault:
    """One bad value of a batch: where, which field, what was given, why it is refused."""

    index: int
    field: str
    value: float
    reason: str


def _bad(name: str, values: Array) -> NDArray[np.bool_]:
    legal = (values > 0.0) if name in POSITIVE else (values >= 0.0)
    out: NDArray[np.bool_] = ~(legal if name == "k" else legal & np.isfinite(values))
    return out


def find_faults(columns: Mapping[str, ArrayLike | None]) -> list[Fault]:
    """Every bad case of a batch, one fault (its first bad field) a case, in order.

    ``columns`` maps field names to scalars or arrays that broadcast together; None for ``k`` is rigid contact.
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


def as_columns(given: Mapping[str, Any]) -> dict[str, Array]:
    """The six inputs as float64 arrays; their values are not checked.

    ``given`` holds the fields, ``f`` [Hz] in place of ``omega`` if not None, and ``k``: a number, an array, or None.

    Raises
    ------
    InputError
        An input is missing, given twice, or not a real number.
    """
    converted: dict[str, Array] = {}
    if (given.get("omega") is None) == (given.get("f") is None):
        both = given.get("omega") is not None
        raise InputError(
            "omega", given.get("omega"), "given or f [Hz] in its place, " + ("not both" if both else "one of them")
        )
    for name in FIELDS:
        source = "f" if name == "omega" and given.get("omega") is None else name
        if source not in given:
            hint = ": a number [N/m], or None for rigid contact" if name == "k" else f" [{UNITS[name]}]"
            raise InputError(name, None, f"given{hint}")
        value = given[source]
        if name == "k" and value is None:
            value = math.inf
        array = real(source, value)
        if source == "f":
            with np.errstate(over="ignore"):  # infinite, which is refused as a value of f
                array = array * RAD_PER_CYCLE
        converted[name] = array
    return converted


def real(name: str, value: Any) -> Array:
    """``value`` as float64; complex numbers, times, text and None are refused, also where numpy would convert them.

    What is masked is unknown: NaN.
    """
    try:
        if isinstance(value, np.ma.MaskedArray):
            value = np.ma.filled(value.astype(np.float64), math.nan) if value.dtype.kind in "fiub" else value.data
        array = np.asarray(value)
        if array.dtype.kind in "fiub":
            return array.astype(np.float64, copy=False)
        if array.dtype.kind == "O" and not any(isinstance(x, (str, bytes)) or x is None for x in array.ravel()):
            return array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        pass
    raise InputError(name, value, "a real number or an array of them")


def check_inputs(columns: Mapping[str, Array], frequency: Any = None) -> None:
    """Refuse the first value out of :data:`BOUNDS`; ``frequency`` is what was given as ``f`` in place of omega.

    Raises
    ------
    InputError
        Naming field, value, bound and, in an array, the index.
    """
    for name, values in columns.items():
        bad = _bad(name, values)
        if bad.any():
            i = int(np.flatnonzero(bad.ravel())[0])
            field, told = ("f", real("f", frequency)) if name == "omega" and frequency is not None else (name, values)
            raise InputError(field, float(told.ravel()[i]), BOUNDS[name], i if values.ndim else None)


# --- groups ---------------------------------------------------------------------------------------------


def length_scale(mu0: Array, Fz: Array, k: Array) -> Array:
    """l0 = mu0 Fz / k [m], eq. (5), without overflow of mu0 Fz; 0 for rigid contact."""
    mu0, Fz, k = np.broadcast_arrays(mu0, Fz, k)
    with np.errstate(all="ignore"):
        quotient = Fz / k
        out = np.asarray(mu0 * quotient)
        low, high = np.minimum(quotient, out), np.maximum(quotient, out)
        odd = ~((low > 1e-290) & (high < 1e290))  # there a partial result may have lost digits
        if odd.any():
            (a, i), (b, j), (c, n) = (np.frexp(x[odd]) for x in (mu0, Fz, k))
            out[odd] = np.ldexp(a * (b / c), i + j - n)
    return out


@part
def scaled(a: float, b: float, c: float, d: float, e: float) -> float:
    """a b / (c d e) for finite positive numbers whose partial products may overflow or underflow."""
    ma, ea = math.frexp(a)
    mb, eb = math.frexp(b)
    mc, ec = math.frexp(c)
    md, ed = math.frexp(d)
    me, ee = math.frexp(e)
    return math.ldexp(ma * mb / (mc * md * me), ea + eb - ec - ed - ee)


@part(inline=True)
def _plain_groups(mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float) -> tuple[float, float, bool]:
    """(v~, y~) [-], eqs. (6), (8), and whether they are right: legal inputs, no product near the ends of the range."""
    force, stretch, speed = mu0 * Fz, y0 * k, v0 * k
    force_rate = force * omega
    smallest = min(min(force, stretch), min(force_rate, speed))
    largest = max(max(force, stretch), max(force_rate, speed))
    v, y = speed / force_rate, stretch / force
    # with mu0 and k positive, positive products leave no negative factor; NaN fails the comparisons
    plain = (
        (mu0 > 0.0) & (k > 0.0) & (smallest > 1e-290) & (largest < 1e290)
        & (v > 0.0) & (v < math.inf) & (y > 0.0) & (y < math.inf)
    )  # fmt: skip
    return v, y, plain


@part
def _amplitude_ratio(y0: float, omega: float, v0: float) -> float:
    """r = y~/v~ = y0 omega/v0 [-], which needs no stiffness."""
    product = y0 * omega
    return product / v0 if 1e-290 < product < 1e290 else scaled(y0, omega, v0, 1.0, 1.0)


@part
def groups(mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float) -> tuple[float, float]:
    """(v~, y~) [-] of any legal case: v~ is infinite where nothing oscillates, both are for rigid contact."""
    if y0 == 0.0 or omega == 0.0 or v0 == 0.0:
        y = 0.0 if y0 == 0.0 else (math.inf if k == math.inf else scaled(y0, k, mu0, Fz, 1.0))
        return math.inf if v0 > 0.0 else 0.0, y
    if k == math.inf:
        return math.inf, math.inf
    v, y, plain = _plain_groups(mu0, Fz, k, y0, omega, v0)
    return (v, y) if plain else (scaled(v0, k, mu0, Fz, omega), scaled(y0, k, mu0, Fz, 1.0))


@part
def first_bad(mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float) -> int:
    """0 for a case within :data:`BOUNDS`, else 1 + the place of its first bad field among :data:`FIELDS`."""
    if not 0.0 < mu0 < math.inf:
        return 1
    if not 0.0 < Fz < math.inf:
        return 2
    if not k > 0.0:
        return 3
    if not 0.0 <= y0 < math.inf:
        return 4
    if not 0.0 <= omega < math.inf:
        return 5
    return 0 if 0.0 <= v0 < math.inf else 6


@kernel
def group_columns(mu0: Array, Fz: Array, k: Array, y0: Array, omega: Array, v0: Array, v: Array, y: Array) -> Any:
    """Fill v~ and y~ (n,) of ordinary cases; -1 in the others, which are counted: zero, rigid, extreme or illegal."""
    found = np.int64(0)
    for i in range(v.size):
        speed, amplitude, plain = _plain_groups(mu0[i], Fz[i], k[i], y0[i], omega[i], v0[i])
        v[i] = speed if plain else -1.0
        y[i] = amplitude if plain else -1.0
    for i in range(v.size):
        found += np.int64(v[i] < 0.0)
    return found


# --- answers --------------------------------------------------------------------------------------------


@kernel
def evaluate_case(
    mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float,
    coef: Array, blocks: Array, border: Array, pieces: Array,
) -> tuple[float, float, int, float, float]:  # fmt: skip
    """(mu~, bound, source, v~, y~) of one case; with a source of CORNER, FAST or OTHER ask :func:`evaluate_unusual`."""
    v, y, plain = _plain_groups(mu0, Fz, k, y0, omega, v0)
    if not plain:
        return math.nan, math.nan, OTHER, v, y
    mu, bound, source = common_ratio(v, y, coef, blocks, border, pieces)
    return mu, bound, source, v, y


@kernel
def evaluate_unusual(
    mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float,
    coef: Array, blocks: Array, border: Array, pieces: Array,
) -> tuple[float, float, int, float, float]:  # fmt: skip
    """:func:`evaluate_case` for every legal case: zero inputs, rigid contact, groups beyond double precision, too."""
    if first_bad(mu0, Fz, k, y0, omega, v0) != 0:
        return math.nan, math.nan, -1, math.nan, math.nan
    v, y = groups(mu0, Fz, k, y0, omega, v0)
    if y0 == 0.0 or omega == 0.0:
        return 1.0, 0.0, NO_OSCILLATION, v, y
    if v0 == 0.0 and k == math.inf:
        return 0.0, 0.0, STATIC_LIMIT, v, y
    if y == 0.0 and v0 > 0.0:
        return 1.0, ROUNDING, NO_OSCILLATION, v, y
    # v~ below 5e-324: the static limit holds to rounding, mu~ itself underflows for y~ > 1
    if v < math.inf and y < math.inf:
        mu, bound, source = answer(MU, v, y, coef, blocks, border, pieces)
        return mu, bound + (DENORMAL if v == 0.0 < v0 else 0.0), source, v, y
    if v0 == 0.0:
        return 0.0, 0.0, STATIC_LIMIT, v, y
    r = _amplitude_ratio(y0, omega, v0)
    if r == 0.0:
        return 1.0, ROUNDING, RIGID, v, y
    mu, _, _, _, _ = outer_expansion(r)
    if r == math.inf:  # eq. (35) is 2.5e-306 where r leaves double range
        return 0.0, 3.0 * DENORMAL, RIGID, v, y
    # y~ beyond double range: only the outer solution is left, corrected by the layers when v~ is not large
    return mu, ROUNDING * mu + (0.0 if k == math.inf or v > 1e150 else mu), RIGID, v, y


@kernel
def other_cases(
    mu0: Array, Fz: Array, k: Array, y0: Array, omega: Array, v0: Array,
    coef: Array, blocks: Array, border: Array, pieces: Array, v: Array, y: Array,
    mu: Array, bound: Array, source: Codes,
) -> None:  # fmt: skip
    """Finish what :func:`group_columns` left at -1; NaN and -1 for illegal cases."""
    for i in range(v.size):
        if v[i] == -1.0:
            mu[i], bound[i], source[i], v[i], y[i] = evaluate_unusual(
                mu0[i], Fz[i], k[i], y0[i], omega[i], v0[i], coef, blocks, border, pieces
            )


@kernel
def gradient(
    mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float,
    mu: float, bound: float, source: int, v: float, y: float,
    coef: Array, blocks: Array, border: Array, pieces: Array, out: Array,
) -> None:  # fmt: skip
    """Fill ``out`` (2, 6) with d mu_macro / d input in the order of FIELDS and the bounds of their errors.

    ``mu``, ``bound``, ``source``, ``v`` and ``y`` are what :func:`evaluate_unusual` found.  One-sided at the edges:
    d/dy0 = 0 at y0 = 0, d/domega = 0 at omega = 0, d/dv0 = mu0/(l0 omega) dmu~/dv~ at v0 = 0, which is infinite on
    y~ = 1 and for rigid contact.  Relative to k the slope is 0 for rigid contact.
    """
    out[:, :] = 0.0
    out[0, 0], out[1, 0] = mu, bound
    if source == -1:
        out[:, :] = math.nan
        return
    if source == NO_OSCILLATION:
        return
    if source == RIGID:
        slope = 0.0
        if mu < 1.0 or y0 * omega > 0.0:
            _, _, slope, _, _ = outer_expansion(_amplitude_ratio(y0, omega, v0))
        error = 8.0 * ROUNDING * mu + (bound if bound > 8.0 * ROUNDING * mu else 0.0)
        out[0, 3], out[0, 4], out[0, 5] = mu0 * slope / y0, mu0 * slope / omega, -mu0 * slope / v0
        out[1, 3], out[1, 4], out[1, 5] = mu0 * error / y0, mu0 * error / omega, mu0 * error / v0
        return
    if source == STATIC_LIMIT and y == math.inf:
        out[0, 5] = out[1, 5] = math.inf
        return
    _, along_v, along_y, error_v, error_y = answer_with_slopes(MU, v, y, coef, blocks, border, pieces)
    both, errors = along_v + along_y, error_v + error_y
    out[0, 0], out[1, 0] = mu - both, bound + errors
    out[0, 1], out[1, 1] = -mu0 * both / Fz, mu0 * errors / Fz
    out[0, 2], out[1, 2] = mu0 * both / k, mu0 * errors / k
    out[0, 3], out[1, 3] = mu0 * along_y / y0, mu0 * error_y / y0
    out[0, 4], out[1, 4] = -mu0 * along_v / omega, mu0 * error_v / omega
    if v > 0.0:
        out[0, 5], out[1, 5] = mu0 * along_v / v0, mu0 * error_v / v0
    else:
        slope, error = speed_slope_at_zero(y, coef, blocks, border, pieces)
        unit = (k / Fz) / omega
        out[0, 5], out[1, 5] = slope * unit, error * unit


@kernel
def gradients(
    mu0: Array, Fz: Array, k: Array, y0: Array, omega: Array, v0: Array,
    mu: Array, bound: Array, source: Codes, v: Array, y: Array,
    coef: Array, blocks: Array, border: Array, pieces: Array, out: Array,
) -> None:  # fmt: skip
    """Fill ``out`` (n, 2, 6), see :func:`gradient`; bounds relative to mu~ in, to mu_macro out."""
    for i in range(mu.size):
        gradient(
            mu0[i], Fz[i], k[i], y0[i], omega[i], v0[i], mu[i], bound[i], source[i], v[i], y[i],
            coef, blocks, border, pieces, out[i],
        )  # fmt: skip

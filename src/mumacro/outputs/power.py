"""Compute the mean power of the shaker and of the drive."""

import math
from typing import Any

import numpy as np

from mumacro.kernel.arrays import Array
from mumacro.outputs.entry import Member, Output, Values
from mumacro.outputs.evaluated import Evaluated, where
from mumacro.table.atlas import ROUNDING

_LEAST, _MOST = 1e-290, 1e290  # products between these limits have all their digits
_FAST = (
    1e100  # a v~ that stands for the limit of fast sliding, where p is v~ times a function of y~/v~
)
_STEEPEST = 1e50  # a y0 omega / v0 that stands for v0 = 0, where p is y~ times a constant
_DENORMAL = 1e-323  # two times the smallest double


def power(cases: Evaluated) -> Values:
    """Return the power of the shaker, mu0 Fz l0 omega <y~ cos tau u_y>, and the power that the
    drive saves, (mu0 - mu_macro) Fz v0."""
    mu0, load, _, _, omega, v0 = cases.columns.values()
    usable, moving, length = cases.usable, cases.moving, cases.length_scale
    v, y = where(usable, cases.v_tilde, 1.0), where(usable, cases.y_tilde, 1.0)
    number, bound = cases.quantity("power", v, y)
    force, rate = mu0 * load, length * omega
    unit = where(usable, force * rate, math.nan)
    shaker, shaker_bound = where(moving, number * unit, 0.0), where(moving, bound * unit, 0.0)
    saved = (mu0 - cases.mu_macro) * load * v0
    size: Any = abs(saved)
    saved_bound = cases.error_bound * load * v0 + ROUNDING * size
    # first the power of the drive, then that of the shaker
    driven = (mu0 > _LEAST) & ((cases.mu_macro == mu0) | (size > _LEAST)) & (size < _MOST)
    plain = driven & (v < math.inf)
    for product in (mu0, force, length, rate, unit, shaker):
        plain = plain & (product > _LEAST) & (product < _MOST)
    values = [shaker, saved, shaker_bound, saved_bound]
    if not (plain.all() if isinstance(plain, np.ndarray) else plain):
        here = np.flatnonzero(~np.broadcast_to(plain, np.size(cases.mu_ratio)))
        for i, whole in enumerate(_at_the_ends(cases, here, v, y, number, bound)):
            column = np.array(np.broadcast_to(values[i], np.size(cases.mu_ratio)))
            kept = np.isnan(whole) | (i in (1, 3)) & np.broadcast_to(driven, column.size)[here]
            column[here] = np.where(kept, column[here], whole)
            values[i] = column if cases.cases.shape else float(column[0])
    return {
        "power.oscillation": values[0],
        "power.saved": values[1],
        "power_bound.oscillation": values[2],
        "power_bound.saved": values[3],
    }


def _at_the_ends(cases: Evaluated, here: Any, *of_table: Any) -> tuple[Array, Array, Array, Array]:
    """Return the same powers where v~, y~ or a product may leave double range though the result
    does not, as for a rigid contact.  Products are computed as a whole.  The result is NaN where
    the power is 0 or does not exist."""
    size = np.size(cases.mu_ratio)
    mu0, load, k, y0, omega, v0 = (np.broadcast_to(x, size)[here] for x in cases.columns.values())
    v, y, number, bound, ratio, error, usable, rigid = (
        np.broadcast_to(x, size)[here]
        for x in (
            *of_table,
            cases.mu_ratio,
            cases.error_bound,
            cases.usable,
            cases.rigid & cases.moving,
        )
    )
    with np.errstate(all="ignore"):
        # without creep: v~ is infinite, and p is v~ times a function of y~/v~
        fast = rigid | (v == math.inf) & usable
        exists = usable | rigid
        steep = np.where(fast, np.minimum(_product((y0, omega), (v0,)), _STEEPEST), 1.0)
        sliding = cases.tabulated.values("power", np.full(v.size, _FAST), _FAST * steep, cases.kind)
        value, value_bound = (
            np.where(
                fast,
                np.where(
                    steep < _STEEPEST,
                    _product((mu0, load, v0, at_speed / _FAST)),
                    _product((mu0, load, y0, omega, at_speed / _FAST / _STEEPEST)),
                ),
                _product((mu0, mu0, load, load, omega, row), (k,)),
            )
            for row, at_speed in zip((number, bound), sliding[:2], strict=True)
        )
        # if v~ or y~ underflow: p is below y~^2, and below v~
        value_bound += np.where((y == 0.0) & (y0 > 0.0), _product((k, y0, y0, omega)), 0.0)
        value_bound += np.where((v == 0.0) & (v0 > 0.0), _product((mu0, load, v0)), 0.0)
        value, value_bound = (
            np.where(exists, x, math.nan) for x in (value, value_bound + _DENORMAL)
        )
        saved = _product((mu0, 1.0 - ratio, load, v0))
        # for a ratio that was rounded to the next number below 1
        rounding = _product((mu0, np.full(v.size, 2.0**-53), load, v0))
        saved_bound = _product((error, load, v0)) + ROUNDING * saved + rounding + _DENORMAL
        # for a subnormal mu_macro and its bound
        lost = _product((np.full(v.size, _DENORMAL), load, v0))
        saved_bound += np.where(mu0 < _LEAST, lost, 0.0)
        saved_bound = np.where((v0 == 0.0) & (saved == 0.0), 0.0, saved_bound)
    return value, saved, value_bound, saved_bound


def _product(factors: tuple[Array, ...], divisors: tuple[Array, ...] = ()) -> Array:
    """Return a product, rounded to double range at the end, though its parts may leave this
    range."""
    mantissa, exponent = np.ones(factors[0].size), np.zeros(factors[0].size, np.int64)
    for x in factors:
        part, power_of_two = np.frexp(x)
        mantissa, exponent = mantissa * part, exponent + power_of_two
    for x in divisors:
        part, power_of_two = np.frexp(x)
        mantissa, exponent = mantissa / part, exponent - power_of_two
    # in two steps, of which the first is exact
    half = np.clip(exponent, -1000, 1000)
    rest = np.clip(exponent - half, -2000, 2000).astype(np.int32)
    return np.asarray(np.ldexp(np.ldexp(mantissa, half.astype(np.int32)), rest))


POWER = Output(
    "power",
    power,
    {
        "power.oscillation": Member(
            "W",
            "Mean power of the shaker, mu0 Fz l0 omega <y~ cos tau u_y>",
        ),
        "power.saved": Member("W", "Power that the drive saves: (mu0 - mu_macro) Fz v0"),
        "power_bound.oscillation": Member("W", "Bound of the absolute error of oscillation"),
        "power_bound.saved": Member("W", "Bound of the absolute error of saved"),
    },
    cost=5,
    lacks={"normal": "how far the load moves is not modelled"},
    parts={
        "power": "Mean powers; NaN: not finite in double precision",
        "power_bound": "Bounds of the absolute errors of the powers; NaN also: not known",
    },
)

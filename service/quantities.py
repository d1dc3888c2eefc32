"""The quantities that ``include`` can add to an answer: one entry of the registry each.

Equation numbers are those of Benad, Nakano, Popov, Popov, "Active control of friction by transverse oscillations"
(Friction, 2018).
"""

from collections.abc import Sequence
from functools import reduce

import numpy as np

from mumacro.charts import ROUNDING
from mumacro.inputs import FIELDS, SI
from mumacro.settling import settling

from .answers import QUANTITIES, Array, Cases, Part, register, where

__all__ = ["INCLUDES"]

_PER = {name: "-" if unit == "-" else f"1/({unit})" for name, (unit, _) in SI.items()}


@register(
    "groups",
    "Dimensionless groups; null: not finite (rigid contact, no oscillation, or beyond double range)",
    (
        Part("groups.v_tilde", "-", "v0/(l0 omega)"),
        Part("groups.y_tilde", "-", "y0/l0; for direction normal Fz_amplitude/Fz"),
        Part("groups.l0", "m", "Length scale mu0 Fz/k; 0 for rigid contact"),
    ),
    cost=2,
)
def _groups(cases: Cases) -> Sequence[Array]:
    return cases.v_tilde, cases.y_tilde, cases.length_scale


@register(
    "limits",
    "Marks on the friction law of this case; null: beyond double range",
    (
        Part("limits.mu_static", "-", "Static limit, v0 -> 0, eq. (38): mu0 sqrt(1 - y~^2), or 0 for y~ >= 1"),
        Part("limits.v0_crit", "m/s", "Velocity at the border of continuous sliding"),
        Part("limits.mu_crit", "-", "mu_macro at that border"),
    ),
    cost=8,
)
def _limits(cases: Cases) -> Sequence[Array]:
    omega = cases.columns["omega"]
    if cases.words["direction"] == "along":  # where the contact begins to slide backwards
        speed = cases.columns["y0"] * omega
    else:  # rigid contact is the limit y~ -> inf: l0 omega v~crit = 0.477 omega sqrt(y0 l0) -> 0
        crit = cases.surrogate.v_tilde_crit(where(cases.usable, cases.y_tilde, 0.0), **cases.words)
        speed = where(cases.usable, cases.length_scale * crit * omega, np.nan)
        speed = where(cases.at_rest | cases.rigid, 0.0, speed)
    return cases.at_speed(0.0), speed, cases.at_speed(speed)


# --- sensitivity and uncertainty ----------------------------------------------------------------------


@register(
    "gradient",
    "d mu_macro / d input; null: not finite, or no such input (k of rigid contact)",
    [
        *(Part(f"gradient.{name}", _PER[name], f"d mu_macro / d {name}") for name in FIELDS),
        *(
            Part(f"gradient_bound.{name}", _PER[name], "Bound of its absolute error; null: not in this table")
            for name in FIELDS
        ),
    ],
    cost=6,
    slopes=True,
)
def _gradient(cases: Cases) -> Sequence[Array]:
    return [found[name] for found in cases.slopes() for name in cases.kind.fields]


@register(
    "std",
    "Standard deviation of mu_macro from independent standard deviations of the inputs",
    [
        Part("std", "-", "To first order, from the gradient"),
        Part("std_bound", "-", "The part of std that comes from the gradient's own bound; null: not in this table"),
        *(Part(f"std_share.{name}", "-", f"Share of {name} in the variance, 0 to 1") for name in FIELDS),
    ],
    cost=8,
    slopes=True,
    k_range="it needs one k: give k with its standard deviation, or k_range without std",
)
def _std(cases: Cases) -> Sequence[Array]:
    std = {name: cases.std.get(name, 0.0) for name in cases.kind.fields}
    # k has no effect where contact is rigid, nor has an infinite slope where the input is exact
    exact = {name: (cases.rigid & (name == "k")) | (given == 0.0) for name, given in std.items()}
    terms, doubts = (
        [where(exact[name], 0.0, found[name] * given) for name, given in std.items()] for found in cases.slopes()
    )
    total, doubt = (reduce(np.hypot, found) for found in (terms, doubts))
    return [total, doubt, *(where(total > 0.0, (term / total) ** 2, 0.0) for term in terms)]


# --- stick fraction, power and settling -----------------------------------------------------------------


@register(
    "stick_fraction",
    "Share of the period during which the contact sticks",
    (
        Part("stick_fraction", "-", "Share of the period during which the contact sticks"),
        Part("stick_fraction_bound", "-", "Bound of its absolute error, larger at the border; null: not known"),
    ),
    cost=4,
)
def _stick_fraction(cases: Cases) -> Sequence[Array]:
    value, bound = cases.surrogate.stick_fraction_with_bound(cases.v_tilde, cases.y_tilde, **cases.words)
    # y~ below double range: the groups do not show whether such a contact sticks
    lost = (cases.y_tilde == 0.0) & (cases.v_tilde < np.inf) & ~cases.at_rest
    return value, where(lost, 1.0, bound)


@register(
    "power",
    "Mean powers; null: not finite in double precision",
    (
        Part("power.oscillation", "W", "Mean power of the shaker, mu0 Fz l0 omega <y~ cos tau u_y>; null: rigid"),
        Part("power.saved", "W", "Power that the drive saves: (mu0 - mu_macro) Fz v0"),
        Part("power_bound.oscillation", "W", "Bound of the absolute error; null also where not in this table"),
        Part("power_bound.saved", "W", "Bound of the absolute error of saved"),
    ),
    cost=5,
    normal="how far the load moves is not modelled",
)
def _power(cases: Cases) -> Sequence[Array]:
    mu0, load, omega, v0 = (cases.columns[name] for name in ("mu0", "Fz", "omega", "v0"))
    unit = where(cases.usable, mu0 * load * (cases.length_scale * omega), np.nan)
    v, y = (where(cases.usable, group, 1.0) for group in (cases.v_tilde, cases.y_tilde))
    found = cases.surrogate.power_with_bound(v, y, **cases.words)
    shaker, bound = (where(cases.at_rest, 0.0, power * unit) for power in found)
    saved = (mu0 - cases.mu_macro) * load * v0
    return shaker, saved, bound, cases.error_bound * load * v0 + ROUNDING * np.abs(saved)


@register(
    "settling",
    "Periods until a disturbed contact is within 1 % of its steady cycle; null: infinite, it never slips",
    (
        Part("settling.periods", "-", "For a small disturbance: ln(100)/slip_path; in stick-slip at most as many"),
        Part("settling.periods_any", "-", "For a disturbance of any size: twice as many"),
        Part("settling.time", "s", "periods as a time; also without oscillation"),
        Part("settling.slip_path", "-", "Path of the foot in a period over l0; null also for rigid contact"),
        Part("settling_bound.periods", "-", "Bound of the absolute error of periods; null also: not known"),
    ),
    cost=5,
    along="how a disturbance decays is derived for across only",
    normal="how a disturbance decays is derived for across only",
)
def _settling(cases: Cases) -> Sequence[Array]:
    found = settling(cases.surrogate, **cases.columns, **cases.words)
    return found.periods, found.periods_any, found.time, found.slip_path, found.error_bound


#: names that ``include`` may hold
INCLUDES = tuple(QUANTITIES)

"""The quantities that ``include`` can add to an answer: one entry of the registry each.

Equation numbers are those of Benad, Nakano, Popov, Popov, "Active control of friction by transverse
oscillations" (Friction, 2018).
"""

from collections.abc import Sequence
from functools import reduce

import numpy as np

from mumacro.analysis.settling import settling as decay
from mumacro.inputs.fields import FIELDS, PER_UNIT
from mumacro.kernel.arrays import Array
from mumacro.table.atlas import ROUNDING

from .answers import QUANTITIES, Cases, Part, register, where


@register(
    2,
    Part("groups.v_tilde", "-", "v0/(l0 omega)"),
    Part("groups.y_tilde", "-", "y0/l0; for direction normal Fz_amplitude/Fz"),
    Part("groups.l0", "m", "Length scale mu0 Fz/k; 0 for rigid contact"),
)
def groups(cases: Cases) -> Sequence[Array]:
    """Dimensionless groups; null: not finite (rigid contact, no oscillation, or beyond double
    range)."""
    return cases.v_tilde, cases.y_tilde, cases.length_scale


@register(
    8,
    Part(
        "limits.mu_static",
        "-",
        "Static limit, v0 -> 0, eq. (38): mu0 sqrt(1 - y~^2), or 0 for y~ >= 1",
    ),
    Part("limits.v0_crit", "m/s", "Velocity at the border of continuous sliding"),
    Part("limits.mu_crit", "-", "mu_macro at that border"),
)
def limits(cases: Cases) -> Sequence[Array]:
    """Marks on the friction law of this case; null: beyond double range."""
    if cases.words["direction"] == "along":  # where the contact begins to slide backwards
        speed = cases.columns["y0"] * cases.columns["omega"]
    else:  # rigid contact is the limit y~ -> inf: l0 omega v~crit = 0.477 omega sqrt(y0 l0) -> 0
        crit = cases.surrogate.v_tilde_crit(where(cases.usable, cases.y_tilde, 0.0), **cases.words)
        speed = where(cases.usable, cases.length_scale * crit * cases.columns["omega"], np.nan)
        speed = where(cases.moving, where(cases.rigid, 0.0, speed), 0.0)
    return cases.at_speed(0.0), speed, cases.at_speed(speed)


# --- sensitivity and uncertainty ------------------------------------------------------------------


@register(
    6,
    *(Part(f"gradient.{name}", PER_UNIT[name], f"d mu_macro / d {name}") for name in FIELDS),
    *(
        Part(
            f"gradient_bound.{name}", PER_UNIT[name], "Bound of its absolute error; null: not known"
        )
        for name in FIELDS
    ),
    slopes=True,
)
def gradient(cases: Cases) -> Sequence[Array]:
    """d mu_macro / d input; null: not finite, or no such input (k of rigid contact)."""
    return [found[name] for found in cases.slopes() for name in cases.kind.fields]


@register(
    8,
    Part("std", "-", "To first order, from the gradient"),
    Part(
        "std_bound",
        "-",
        "The part of std that comes from the gradient's own bound; null: not known",
    ),
    *(
        Part(f"std_share.{name}", "-", f"Share of {name} in the variance, 0 to 1")
        for name in FIELDS
    ),
    slopes=True,
    k_range="it needs one k: give k with its standard deviation, or k_range without std",
)
def std(cases: Cases) -> Sequence[Array]:
    """Standard deviation of mu_macro from independent standard deviations of the inputs."""
    given = {name: cases.std.get(name, 0.0) for name in cases.kind.fields}
    # k has no effect where contact is rigid, nor has an infinite slope where the input is exact
    exact = {
        name: (cases.rigid & (name == "k")) | (spread == 0.0) for name, spread in given.items()
    }
    terms, doubts = (
        [where(exact[name], 0.0, found[name] * spread) for name, spread in given.items()]
        for found in cases.slopes()
    )
    with np.errstate(all="ignore"):
        total, doubt = (reduce(np.hypot, found) for found in (terms, doubts))
        return [total, doubt, *(where(total > 0.0, (term / total) ** 2, 0.0) for term in terms)]


# --- stick fraction, power and settling -----------------------------------------------------------


@register(
    4,
    Part("stick_fraction", "-", "Share of the period during which the contact sticks"),
    Part(
        "stick_fraction_bound",
        "-",
        "Bound of its absolute error, larger at the border; null: not known",
    ),
)
def stick_fraction(cases: Cases) -> Sequence[Array]:
    """Share of the period during which the contact sticks."""
    value, bound = cases.surrogate.stick_fraction_with_bound(
        cases.v_tilde, cases.y_tilde, **cases.words
    )
    # y~ below double range: the groups do not show whether such a contact sticks
    lost = (cases.y_tilde == 0.0) & (cases.v_tilde < np.inf) & cases.moving
    return value, where(lost, 1.0, bound)


@register(
    5,
    Part(
        "power.oscillation",
        "W",
        "Mean power of the shaker, mu0 Fz l0 omega <y~ cos tau u_y>; null: rigid",
    ),
    Part("power.saved", "W", "Power that the drive saves: (mu0 - mu_macro) Fz v0"),
    Part("power_bound.oscillation", "W", "Bound of the absolute error; null also where not known"),
    Part("power_bound.saved", "W", "Bound of the absolute error of saved"),
    normal="how far the load moves is not modelled",
)
def power(cases: Cases) -> Sequence[Array]:
    """Mean powers; null: not finite in double precision."""
    mu0, load, omega, v0 = (cases.columns[name] for name in ("mu0", "Fz", "omega", "v0"))
    unit = where(cases.usable, mu0 * load * (cases.length_scale * omega), np.nan)
    v, y = (where(cases.usable, group, 1.0) for group in (cases.v_tilde, cases.y_tilde))
    found = cases.surrogate.power_with_bound(v, y, **cases.words)
    shaker, bound = (where(cases.moving, number * unit, 0.0) for number in found)
    saved = (mu0 - cases.mu_macro) * load * v0
    return shaker, saved, bound, cases.error_bound * load * v0 + ROUNDING * abs(saved)


_DERIVED = "how a disturbance decays is derived for across only"


@register(
    5,
    Part(
        "settling.periods",
        "-",
        "For a small disturbance: ln(100)/slip_path; in stick-slip at most as many",
    ),
    Part("settling.periods_any", "-", "For a disturbance of any size: twice as many"),
    Part("settling.time", "s", "periods as a time; also without oscillation"),
    Part(
        "settling.slip_path",
        "-",
        "Path of the foot in a period over l0; null also for rigid contact",
    ),
    Part(
        "settling_bound.periods",
        "-",
        "Bound of the absolute error of periods; null also: not known",
    ),
    along=_DERIVED,
    normal=_DERIVED,
)
def settling(cases: Cases) -> Sequence[Array]:
    """Periods until a disturbed contact is within 1 % of its steady cycle; null: infinite, it never
    slips."""
    found = decay(cases.surrogate, **cases.columns, **cases.words)
    return found.periods, found.periods_any, found.time, found.slip_path, found.error_bound


#: names that ``include`` may hold
INCLUDES = tuple(QUANTITIES)

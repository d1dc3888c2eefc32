"""The quantities that ``include`` can add to an answer: one entry of the registry each.

Equation numbers are those of Benad, Nakano, Popov, Popov, "Active control of friction by transverse oscillations"
(Friction, 2018).
"""

from collections.abc import Sequence
from functools import cache, reduce
from statistics import NormalDist

import numpy as np

from mumacro.charts import ROUNDING
from mumacro.contact import SPRING
from mumacro.inputs import FIELDS, SI
from mumacro.settling import settling

from .answers import QUANTITIES, Array, Cases, Part, register, where

__all__ = ["INCLUDES"]

SAMPLES = 256  # of the inputs, for std_sampled
ENOUGH = 0.1  # relative difference of std_sampled and std up to which first order counts as enough
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
    cost=4,
)
def _limits(cases: Cases) -> Sequence[Array]:
    # Rigid contact is the limit y~ -> inf: l0 omega v~crit = 0.477 omega sqrt(y0 l0) -> 0, with mu_crit -> 0.
    if cases.kind != SPRING:
        return _limits_as(cases)
    mu0, omega, surrogate = cases.columns["mu0"], cases.columns["omega"], cases.surrogate
    y = where(cases.usable, cases.y_tilde, 1.0)
    v = surrogate.v_tilde_crit(y)
    below = np.minimum(cases.y_tilde, 1.0)
    static = mu0 * np.sqrt((1.0 - below) * (1.0 + below))  # keeps the digits that 1 - y^2 loses near y~ = 1
    rest, rigid = cases.at_rest, np.isinf(cases.columns["k"])
    speed = where(cases.usable, cases.length_scale * v * omega, np.nan)
    crit = where(cases.usable, mu0 * surrogate.mu_ratio(v, y), np.nan)
    return (
        where(rest, mu0, where(rigid, 0.0, static)),
        where(rest | rigid, 0.0, speed),
        where(rest, mu0, where(rigid, 0.0, crit)),
    )


def _limits_as(cases: Cases) -> Sequence[Array]:
    """The same for another contact or direction."""
    omega = cases.columns["omega"]
    if cases.kind.names["direction"] == "along":  # where the contact begins to slide backwards
        speed = cases.columns["y0"] * omega
    else:
        crit = cases.surrogate.v_tilde_crit(where(cases.usable, cases.y_tilde, 0.0), **cases.kind.names)
        speed = where(cases.usable, cases.length_scale * crit * omega, np.nan)
        speed = where(cases.at_rest | np.isinf(cases.columns["k"]), 0.0, speed)
    return cases.again(v0=0.0), speed, cases.again(v0=speed)


@register(
    "regime_certain",
    "Whether the regime is certain",
    [Part("regime_certain", "-", "false: within the error of this table's border", bool)],
    cost=3,
)
def _regime_certain(cases: Cases) -> Sequence[Array]:
    return ((cases.answer.regime_certain | ~cases.usable).astype(np.float64),)


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


@cache
def _normal_samples() -> Array:
    """Points of a six-dimensional rank-1 lattice as standard normal deviates, (SAMPLES, 6), with mean 0."""
    root = 1.0
    for _ in range(64):  # the positive root of x^7 = x + 1, whose powers fill six dimensions most evenly
        root = (1.0 + root) ** (1.0 / 7.0)
    half = SAMPLES // 2
    shares = (0.5 + np.outer(np.arange(1, half + 1), root ** -np.arange(1.0, 7.0))) % 1.0
    inverse = NormalDist().inv_cdf
    points = np.array([[inverse(min(max(x, 1e-9), 1.0 - 1e-9)) for x in row] for row in shares.tolist()])
    points /= np.sqrt(np.mean(points**2, axis=0))
    return np.concatenate((points, -points))


def _sampled(cases: Cases) -> Array:
    """Standard deviation of mu_macro over normal inputs; samples out of bounds are left out."""
    total, squares, count = (np.zeros(cases.mu_macro.shape) for _ in range(3))
    deviations = np.array([cases.std.get(name, 0.0) for name in cases.kind.fields])
    for point in _normal_samples():
        pairs = zip(cases.kind.fields, point * deviations, strict=True)
        off = cases.again(**{name: cases.columns[name] + shift for name, shift in pairs}) - cases.mu_macro
        total += np.nan_to_num(off)
        squares += np.nan_to_num(off * off)
        count += ~np.isnan(off)
    spread: Array = np.sqrt(np.maximum(squares / count - (total / count) ** 2, 0.0))
    return spread


@register(
    "std",
    "Standard deviation of mu_macro from independent standard deviations of the inputs",
    [
        Part("std", "-", "To first order, from the gradient"),
        Part("std_bound", "-", "The part of std that comes from the gradient's own bound; null: not in this table"),
        *(Part(f"std_share.{name}", "-", f"Share of {name} in the variance, 0 to 1") for name in FIELDS),
        Part("std_sampled", "-", f"Over {SAMPLES} evenly spread samples of normal inputs, those in bounds"),
        Part(
            "std_first_order_enough", "-",
            f"false: std and std_sampled differ by more than {ENOUGH:.0%}, use the sampled value", bool,
        ),
    ],
    cost=SAMPLES + 6,
    slopes=True,
    k_range="it needs one k: give k with its standard deviation, or k_range without std",
)  # fmt: skip
def _std(cases: Cases) -> Sequence[Array]:
    # k has no effect where contact is rigid, nor has an infinite slope where the input is exact
    exact = {
        name: (np.isinf(cases.columns["k"]) if name == "k" else False) | (cases.std.get(name, 0.0) == 0.0)
        for name in cases.kind.fields
    }
    terms, doubts = (
        [where(exact[name], 0.0, found[name] * cases.std.get(name, 0.0)) for name in exact] for found in cases.slopes()
    )
    std, doubt = (reduce(np.hypot, found, 0.0 * cases.mu_macro) for found in (terms, doubts))
    shares = [where(std > 0.0, (term / std) ** 2, 0.0) for term in terms]
    sampled = _sampled(cases) if any(cases.std.values()) else 0.0 * std
    enough = np.abs(sampled - std) <= ENOUGH * sampled + np.nan_to_num(doubt) + 4.0 * cases.error_bound
    return [std, doubt, *shares, sampled, enough.astype(np.float64)]


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
    value, bound = cases.surrogate.stick_fraction_with_bound(cases.v_tilde, cases.y_tilde, **cases.kind.names)
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
    columns = cases.columns
    mu0, load, omega, v0 = (columns[name] for name in ("mu0", "Fz", "omega", "v0"))
    unit = where(cases.usable, mu0 * load * (cases.length_scale * omega), np.nan)
    v, y = (where(cases.usable, group, 1.0) for group in (cases.v_tilde, cases.y_tilde))
    value, bound = cases.surrogate.power_with_bound(v, y, **cases.kind.names)
    saved = (mu0 - cases.mu_macro) * load * v0
    return (
        where(cases.at_rest, 0.0, value * unit),
        saved,
        where(cases.at_rest, 0.0, bound * unit),
        cases.error_bound * load * v0 + ROUNDING * np.abs(saved),
    )


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
    **dict.fromkeys(("ball", "along", "normal"), "the decay of a disturbance is known for one spring, across"),
)
def _settling(cases: Cases) -> Sequence[Array]:
    found = settling(cases.surrogate, **dict(cases.columns))
    return found.periods, found.periods_any, found.time, found.slip_path, found.error_bound


#: names that ``include`` may hold
INCLUDES = tuple(QUANTITIES)

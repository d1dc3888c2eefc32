"""Compute the paper's approximations along a friction law, by equation number, and the speeds at
which continuous sliding begins by its formulas for the border."""

import math
from typing import Any

import numpy as np

from mumacro import closed_forms
from mumacro.errors import InputError
from mumacro.inputs.fields import SPRING
from mumacro.kernel.arrays import Array
from mumacro.questions.law import Law
from mumacro.surrogate import Surrogate

#: column -> its formula and range; NaN outside.  A formula without an equation number is from this
#: project
APPROXIMATIONS = {
    "static": "eqs. (16), (38), the limit v0 -> 0: mu0 sqrt(1 - y~^2), 0 for y~ >= 1",
    "creep": "slow sliding, first order: mu0 (sqrt(1 - y~^2) + pi v~ / (2 (1 - y~^2))), or mu0 "
    "C(y~) v~ for y~ > 1, C from the table; given up to mu0",
    "master_curve": "eq. (28), stick-slip at y~ << 1, between (38) at v0 = 0 and (40) at the "
    "border (27); given for y~ <= 1 up to that border",
    "master_curve_limit": "the limit of (28) for y~ -> 0, between (38) and the table's value at "
    "the table's border; given for y~ <= 1 up to the border",
    "critical": "eqs. (32), (40), the value at the border for y~ << 1: mu0 (1 - y~^2 / 4); given "
    "for y~ <= 1",
    "small_amplitude": "eq. (31), continuous sliding at y~ << 1: mu0 (1 - y~^2 / (4 (1 + v~^2))); "
    "given for y~ <= 1 in continuous sliding",
    "continuous": "mu0 (2/pi) K(i y~ / sqrt(1 + v~^2)), eqs. (31) and (35) in one; given in "
    "continuous sliding",
    "rigid": "eqs. (35), (37), fast sliding or rigid contact: mu0 (2/pi) K(i y~/v~)",
    "corner": "slow sliding near y~ = 1, root of mu~^3 + 2 (y~ - 1) mu~ = pi v~; given for |y~ - "
    "1| <= 0.5, mu~ <= 0.7",
}
#: v0 at which continuous sliding begins: column -> its formula and range
BORDERS = {
    "exact": "the table's border",
    "eq_23": "l0 omega v~, v~ the root of y~^2 = 2 v~ (1 + v~^2)(sqrt(1 + v~^2) + v~); given for "
    "y~ <= 1",
    "eq_24": "eqs. (24), (39): (omega / 2)(sqrt(l0^2 + 2 y0^2) - l0); given for y~ <= 1",
    "eq_26": "l0 omega sqrt(y~ / 4.5); given for y~ >= 1",
    "eq_27": "l0 omega 0.47 y~^(5/2) / (y~^2 + 0.94 y~^(1/2) / (1 + y~^2))",
    "small_amplitude": "l0 omega (y~^2 / 2)(1 - 5 y~^2 / 12); given for y~ <= 1",
    "large_amplitude": "l0 omega sqrt(y~ / 4.402914), eq. (26) with the exact constant; given for "
    "y~ >= 1",
    "blend": "one formula for every y~, within 0.6 percent",
}
_CORNER_REACH, _CORNER_TOP = 0.5, 0.7
#: column of BORDERS -> formula, smallest and largest y~
_FORMULAS = {
    "eq_23": (closed_forms.border_23, 0.0, 1.0),
    "eq_24": (closed_forms.border_24, 0.0, 1.0),
    "eq_26": (closed_forms.border_26, 1.0, math.inf),
    "eq_27": (closed_forms.border_27, 0.0, math.inf),
    "small_amplitude": (closed_forms.border_small_amplitude, 0.0, 1.0),
    "large_amplitude": (closed_forms.border_large_amplitude, 1.0, math.inf),
    "blend": (closed_forms.border_blend, 0.0, math.inf),
}


def approximations(surrogate: Surrogate, law: Law) -> dict[str, Array]:
    """Return the approximations of :data:`APPROXIMATIONS` along a law [-], (n,); NaN outside the
    stated range.

    Raise InputError for a ball, and for an oscillation along or normal, because the article has one
    spring, across.
    """
    inputs = _spring_inputs(law)
    mu0, v, y = inputs["mu0"], law.answer.v_tilde, law.answer.y_tilde
    # a rigid contact has no finite v~ and y~; eq. (37) is then the result
    elastic = np.isfinite(v) & np.isfinite(y)
    small_y, slides = elastic & (y <= 1.0), elastic & (law.answer.regime == "continuous")
    near_corner = elastic & (np.abs(y - 1.0) <= _CORNER_REACH) & (v > 0.0) & (v < 1.0)
    # the tangent of mu_macro(v0) at v0 = 0; not finite where it is vertical (y~ = 1, rigid contact)
    at_rest = surrogate.evaluate({**inputs, "v0": np.zeros(law.values.shape)}, gradient=True)
    with np.errstate(all="ignore"):
        creep = law.mu_static + at_rest.gradient["v0"] * inputs["v0"]
        border, fit_border = surrogate.v_tilde_crit(y), closed_forms.border_27(y)
        # without oscillation v~crit is 0, and v~/v~crit is infinite for every speed except 0
        rho, fit_rho = (np.where(v > 0.0, v / crit, 0.0) for crit in (border, fit_border))
        static, critical, top = (
            closed_forms.static_limit(y),
            closed_forms.critical(y),
            surrogate.mu_ratio(border, y),
        )
        rigid = np.where(
            elastic, closed_forms.outer(np.where(v > 0.0, y / v, math.inf)), law.answer.mu_ratio
        )
        corner, limit = closed_forms.corner_root(v, y - 1.0), closed_forms.master_curve_limit(rho)
        columns = {
            "static": (law.mu_static, True),
            "creep": (creep, creep <= mu0),
            "master_curve": (
                mu0 * (static + (critical - static) * closed_forms.master_curve(fit_rho)),
                small_y,
            ),
            "master_curve_limit": (
                mu0 * (static + (top - static) * limit),
                small_y & (v <= border),
            ),
            "critical": (mu0 * critical, small_y),
            "small_amplitude": (mu0 * closed_forms.small_amplitude(v, y), small_y & slides),
            "continuous": (mu0 * closed_forms.continuous(v, y), slides),
            "rigid": (mu0 * rigid, True),
            "corner": (mu0 * corner, near_corner & (corner <= _CORNER_TOP)),
        }
    return {
        name: np.where(in_range, column, np.nan) for name, (column, in_range) in columns.items()
    }


def _spring_inputs(law: Law) -> dict[str, Any]:
    """Return the inputs of a law of one spring across."""
    if law.kind != SPRING:
        kind_names = " ".join(law.kind.names.values())
        raise InputError(
            "approximations", kind_names, "left out: they are those of one spring, across"
        )
    return law.inputs


def border_speeds(surrogate: Surrogate, law: Law) -> dict[str, Array]:
    """Return v0 [m/s] at which continuous sliding begins, for each case of a law, exact and by
    :data:`BORDERS`; (n,).

    It is NaN where an approximation does not apply and where y~ is beyond double range; it is 0 for
    a rigid contact and without oscillation, which never stick.  InputError is raised as in
    :func:`approximations`.
    """
    inputs = _spring_inputs(law)
    y, omega = law.answer.y_tilde, inputs["omega"]
    never_sticks = (inputs["y0"] == 0.0) | (omega == 0.0) | np.isinf(inputs["k"])
    with np.errstate(all="ignore"):
        speed_unit = np.where(np.isfinite(y), law.answer.length_scale * omega, np.nan)
        columns = {"exact": surrogate.v_tilde_crit(y)} | {
            name: np.where((y >= least) & (y <= most), formula(y), np.nan)
            for name, (formula, least, most) in _FORMULAS.items()
        }
        return {
            name: np.where(never_sticks, 0.0, speed_unit * column)
            for name, column in columns.items()
        }

"""Compute the marks on the friction law of a case: its static limit and its border."""

import math

from mumacro.inputs.fields import DIRECTIONS
from mumacro.outputs.entry import Member, Output, Values
from mumacro.outputs.evaluated import Evaluated, where


def limits(cases: Evaluated) -> Values:
    """Return mu_macro at rest, the speed at the border of continuous sliding, and mu_macro
    there."""
    omega = cases.columns["omega"]
    # the speed below which the contact slides backwards during a part of the period
    if DIRECTIONS[cases.kind.direction] == "along":
        speed = cases.columns["y0"] * omega
    else:  # rigid contact is the limit y~ -> inf: l0 omega v~crit = 0.477 omega sqrt(y0 l0) -> 0
        crit = cases.crit(where(cases.usable, cases.y_tilde, 0.0))
        speed = where(cases.usable, cases.length_scale * crit * omega, math.nan)
        speed = where(cases.moving, where(cases.rigid, 0.0, speed), 0.0)
    return {
        "limits.mu_static": cases.replace(v0=0.0).mu_macro,
        "limits.v0_crit": speed,
        "limits.mu_crit": cases.replace(v0=speed).mu_macro,
    }


LIMITS = Output(
    "limits",
    limits,
    {
        "limits.mu_static": Member(
            "-", "Static limit, v0 -> 0, eq. (38): mu0 sqrt(1 - y~^2), or 0 for y~ >= 1"
        ),
        "limits.v0_crit": Member("m/s", "Velocity at the border of continuous sliding"),
        "limits.mu_crit": Member("-", "mu_macro at that border"),
    },
    cost=8,
    parts={"limits": "Marks on the friction law of this case; NaN: beyond double range"},
)

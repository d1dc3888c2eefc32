"""The mean powers of the shaker and of the drive."""

import math

from mumacro.outputs.entry import Member, Output, Values
from mumacro.outputs.evaluated import Evaluated, where
from mumacro.table.atlas import ROUNDING


def power(cases: Evaluated) -> Values:
    """mu0 Fz l0 omega <y~ cos tau u_y> of the shaker, (mu0 - mu_macro) Fz v0 saved by the drive."""
    mu0, load, omega, v0 = (cases.columns[name] for name in ("mu0", "Fz", "omega", "v0"))
    unit = where(cases.usable, mu0 * load * (cases.length_scale * omega), math.nan)
    v, y = (where(cases.usable, group, 1.0) for group in (cases.v_tilde, cases.y_tilde))
    shaker, bound = (
        where(cases.moving, number * unit, 0.0) for number in cases.quantity("power", v, y)
    )
    saved = (mu0 - cases.mu_macro) * load * v0
    return {
        "power.oscillation": shaker,
        "power.saved": saved,
        "power_bound.oscillation": bound,
        "power_bound.saved": cases.error_bound * load * v0 + ROUNDING * abs(saved),
    }


POWER = Output(
    "power",
    power,
    {
        "power.oscillation": Member(
            "W",
            "Mean power of the shaker, mu0 Fz l0 omega <y~ cos tau u_y>; no value where rigid",
        ),
        "power.saved": Member("W", "Power that the drive saves: (mu0 - mu_macro) Fz v0"),
        "power_bound.oscillation": Member("W", "Bound of the absolute error of oscillation"),
        "power_bound.saved": Member("W", "Bound of the absolute error of saved"),
    },
    cost=5,
    lacks={"normal": "how far the load moves is not modelled"},
)

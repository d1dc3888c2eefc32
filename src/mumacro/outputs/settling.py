"""How many periods until a disturbed contact is steady again: the kinetics behind the averages,
from table quantities.

Two motions of the same contact, steady and disturbed, are two elongations u_a, u_b under the same
motion of the upper point.  They differ by d = u_b - u_a, in units of l0, and only slip changes d
(docs/model.md derives it):

    abs(d)^2/2 falls at the rate (lam_a + lam_b)(1 - u_a.u_b) >= (lam_a + lam_b) abs(d)^2/2

with the slip speed lam of the foot.  With the slip path S of the steady cycle per period this gives
for every disturbance, of any size,

    abs(d) after n periods <= abs(d) exp(-n S/2),

and for small ones exp(-n S) in continuous sliding, exp(-n S) cos^(2n)(th1 - th0) in stick-slip,
where th0 and th1 are the angles at which stick begins and ends.  S follows from the energy that
drive and shaker put in:

    S = 2 pi (v~ mu~ + p),    p = <y~ cos tau u_y>, the oscillation power

Both are tabulated, with bounds.  The springs of a ball are independent, and S rises along the ray
of their v~ and y~ (60 rays from y~/v~ = 1e-4 to 1e6), so the middle one is the slowest: that of the
smallest k, two thirds of the mean.
"""

import math
from typing import Any

import numpy as np

from mumacro.inputs.kind import CONTACTS, SPRING, SPRINGS_OF
from mumacro.outputs.entry import Member, Output, Values
from mumacro.outputs.evaluated import Evaluated, where

REMAINING = 0.01  # share of a disturbance that is left


def decay(cases: Evaluated, remaining: float = REMAINING) -> tuple[Any, Any, Any, Any]:
    """Periods until a small disturbance has fallen to ``remaining``, their time [s], the slip path
    of a period over l0, and the bound of the error of the periods; for oscillation across."""
    load_ratio = SPRINGS_OF[CONTACTS[cases.kind.contact]].middle_load
    speed, frequency = cases.columns["v0"], cases.columns["omega"]
    v, y = cases.v_tilde / load_ratio, cases.y_tilde / load_ratio
    l0 = load_ratio * cases.length_scale
    # no oscillation: dragged only, mu~ = 1
    unshaken = np.logical_not(cases.moving)
    inside = np.isfinite(v) & np.isfinite(y) & ~unshaken
    groups = where(inside, v, 1.0), where(inside, y, 0.0)
    ratio, bound = cases.quantity("mu_ratio", *groups, SPRING)
    power, power_bound = cases.quantity("power", *groups, SPRING)
    to_remaining = math.log(1.0 / remaining)
    with np.errstate(all="ignore"):
        # slip speed of the foot in units of l0 omega; infinite for rigid contact and beyond double
        # range
        drag_rate = np.where(speed == 0.0, 0.0, np.divide(np.divide(speed, l0), frequency))
        rate = np.where(inside, v * ratio + power, np.where(unshaken, drag_rate, np.inf))
        rate = np.where(np.isnan(cases.mu_ratio), np.nan, rate)  # an illegal case
        relative_error = np.where(inside, (v * bound + power_bound) / rate, 0.0)
        slip_path = 2.0 * math.pi * rate
        periods = to_remaining / slip_path
        # nothing slips at rate 0, rigid contact at rest included
        dragged = l0 * np.divide(to_remaining, speed)
        shaken = to_remaining / rate / frequency
        time = np.where(rate == 0.0, np.inf, np.where(unshaken, dragged, shaken))
        error = np.where(
            (rate == 0.0) | (relative_error >= 1.0),
            np.inf,
            periods * relative_error / (1.0 - relative_error),
        )
    parts = periods, time, slip_path, error
    return parts if cases.cases.shape else tuple(map(float, parts))  # type: ignore[return-value]


def settling(cases: Evaluated) -> Values:
    """Periods until a disturbed contact is within 1 % of its steady cycle."""
    periods, time, slip_path, bound = decay(cases)
    return {
        "settling.periods": periods,
        "settling.periods_any": 2.0 * periods,
        "settling.time": time,
        "settling.slip_path": slip_path,
        "settling_bound.periods": bound,
    }


_DERIVED = "how a disturbance decays is derived for across only"
SETTLING = Output(
    "settling",
    settling,
    {
        "settling.periods": Member(
            "-", "For a small disturbance: ln(100)/slip_path; in stick-slip at most as many"
        ),
        "settling.periods_any": Member("-", "For a disturbance of any size: twice as many"),
        "settling.time": Member("s", "periods as a time; also without oscillation"),
        "settling.slip_path": Member(
            "-", "Path of the foot in a period over l0; no value for a rigid contact"
        ),
        "settling_bound.periods": Member("-", "Bound of the absolute error of periods"),
    },
    cost=5,
    lacks={"along": _DERIVED, "normal": _DERIVED},
)

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
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mumacro.errors import InputError
from mumacro.inputs.cases import ABSENT
from mumacro.inputs.fields import RAD_PER_CYCLE
from mumacro.inputs.kind import CONTACTS, SPRINGS_OF, kind_of
from mumacro.surrogate import Surrogate


@dataclass(frozen=True)
class Settling:
    """How fast a disturbance decays; floats for scalar inputs, arrays of the broadcast shape
    otherwise."""

    #: periods [-] until a small disturbance has fallen to ``remaining``; in stick-slip at most as
    #: many
    periods: Any
    #: periods [-] after which any disturbance has, whatever its size: twice ``periods``
    periods_any: Any
    time: Any  #: ``periods`` in seconds; finite without oscillation, too
    #: path of the foot per period [l0], of a ball that of its middle spring [1.5 l0];
    #: exp(-slip_path) is the multiplier of a small disturbance per period
    slip_path: Any
    error_bound: Any  #: bound of the error of ``periods`` that comes from the table [-]


def settling(
    surrogate: Surrogate,
    *,
    mu0: Any = ABSENT,
    Fz: Any = ABSENT,
    k: Any = ABSENT,
    y0: Any = ABSENT,
    v0: Any = ABSENT,
    omega: ArrayLike | None = None,
    f: ArrayLike | None = None,
    remaining: float = 0.01,
    contact: str = "spring",
    direction: str = "across",
) -> Settling:
    """Periods until a disturbance of the contact has decayed to ``remaining`` of its size.

    Parameters
    ----------
    surrogate : Surrogate
    mu0, Fz, k, y0, v0, omega or f : array_like
        The case [-, N, N/m, m, m/s, rad/s or Hz], as in :meth:`mumacro.Surrogate.evaluate`.
    remaining : float
        Share of the disturbance that is left [-], 0 < remaining < 1.
    contact : str
        "spring"; or "ball", for which the periods are those of its slowest spring.
    direction : str
        "across" only, else InputError: the decay is not derived for the other directions.

    Returns
    -------
    Settling
        Infinite where nothing slips (v0 = 0 with y~ <= 1, or with omega = 0): a disturbance stays.
        Zero for rigid contact, whose friction follows at once.  NaN at an illegal case of an array.

    Notes
    -----
    The force averaged over period n differs from the steady one by at most mu0 Fz abs(d) of that
    period.  Source: this project; the paper (Sec. 8) names the kinetics as open.

    Examples
    --------
    >>> from mumacro import Surrogate
    >>> s = Surrogate.open("tables/mumacro-1e-10.nc")
    >>> result = settling(s, mu0=0.3, Fz=10.0, k=1e6, y0=2e-6, f=20e3, v0=0.01)
    >>> round(result.periods, 2), round(result.slip_path, 3)      # slow sliding settles slowly
    (22.13, 0.208)
    """
    if not 0.0 < remaining < 1.0:
        raise InputError("remaining", remaining, "> 0 and < 1")
    kind = kind_of(contact, direction)
    if kind.direction:
        raise InputError(
            "direction", direction, "across: how a disturbance decays is derived for no other"
        )
    case = {"mu0": mu0, "Fz": Fz, "k": k, "y0": y0, "omega": omega, "f": f, "v0": v0}
    present = {
        name: value
        for name, value in case.items()
        if value is not ABSENT and (value is not None or name == "k")
    }
    answer = surrogate.evaluate(present, groups=True)
    amplitude, speed = (np.asarray(x, dtype=np.float64) for x in (y0, v0))
    frequency = (
        np.asarray(omega, dtype=np.float64)
        if f is None
        else RAD_PER_CYCLE * np.asarray(f, dtype=np.float64)
    )
    load_ratio = SPRINGS_OF[CONTACTS[kind.contact]].middle_load
    v, y, l0 = (
        answer.v_tilde / load_ratio,
        answer.y_tilde / load_ratio,
        load_ratio * answer.length_scale,
    )
    unshaken = (amplitude == 0.0) | (frequency == 0.0)  # no oscillation: dragged only, mu~ = 1
    inside = np.isfinite(v) & np.isfinite(y) & ~unshaken
    groups = np.where(inside, v, 1.0), np.where(inside, y, 0.0)
    ratio, bound, _ = surrogate.ratio_with_bound(*groups)
    power, power_bound = surrogate.power_with_bound(*groups)
    decay = math.log(1.0 / remaining)
    with np.errstate(all="ignore"):
        # slip speed of the foot in units of l0 omega; infinite for rigid contact and beyond double
        # range
        drag_rate = np.where(speed == 0.0, 0.0, speed / l0 / frequency)
        rate = np.where(inside, v * ratio + power, np.where(unshaken, drag_rate, np.inf))
        rate = np.where(np.isnan(answer.mu_ratio), np.nan, rate)  # an illegal case of an array
        relative_error = np.where(inside, (v * bound + power_bound) / rate, 0.0)
        slip_path = 2.0 * math.pi * rate
        periods = decay / slip_path
        # nothing slips at rate 0, rigid contact at rest included
        time = np.where(
            rate == 0.0, np.inf, np.where(unshaken, l0 * (decay / speed), decay / rate / frequency)
        )
        error = np.where(
            (rate == 0.0) | (relative_error >= 1.0),
            np.inf,
            periods * relative_error / (1.0 - relative_error),
        )
    values = (periods, 2.0 * periods, time, slip_path, error)
    return Settling(*(x if np.ndim(answer.mu_ratio) else float(x) for x in values))

"""Compute how many periods a disturbed contact needs until it is steady again, from quantities of
the table.

Consider two motions of the same contact, one steady and one disturbed.  They are two elongations
u_a, u_b of the spring, under the same motion of its upper point.  Their difference is d = u_b -
u_a, in units of l0.  Only slip changes d (docs/model.md derives it):

    abs(d)^2/2 falls at the rate (lam_a + lam_b)(1 - u_a.u_b) >= (lam_a + lam_b) abs(d)^2/2

where lam_a and lam_b are the slip speeds of the contact point.  With the slip path S of the steady
cycle per period this gives, for a disturbance of any size,

    abs(d) after n periods <= abs(d) exp(-n S/2),

and for small ones exp(-n S) in continuous sliding, exp(-n S) cos^(2n)(th1 - th0) in stick-slip,
where th0 and th1 are the angles at which stick begins and ends.  The energy from drive and shaker
gives S, and the duration of stick gives the angles (kernel/settling.c):

    S = 2 pi (v~ mu~ + p),    p = <y~ cos tau u_y>, the oscillation power

The table has mu~, p and the stick fraction, with bounds.  The springs of a ball are independent,
and the slowest one determines the result.  Their v~ and y~ are on one ray, along
which S rises (60 rays from y~/v~ = 1e-4 to 1e6).  The cosine is not monotone there, so the slowest
spring has to be searched for.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mumacro.inputs.fields import CONTACTS, SPRING, SPRINGS_OF
from mumacro.kernel.arrays import Array
from mumacro.kernel.binding import kernels
from mumacro.outputs.entry import Member, Output, Values
from mumacro.outputs.evaluated import Evaluated
from mumacro.outputs.tabulated import Tabulated
from mumacro.table.atlas import ROUNDING

REMAINING = 0.01  # the remaining fraction of a disturbance
_KERNEL = kernels[-1]


class Decay(NamedTuple):
    """Hold how fast a disturbance of one spring across decays, at points (n,)."""

    #: mean slip speed of the contact point over a period, in units of l0 omega; times 2 pi it is
    #: the slip path S
    rate: Array
    #: -ln of the remaining fraction of a small disturbance after a period, and its smallest and
    #: largest value within the bounds of the table
    of_small: Array
    least: Array
    most: Array


def decay_of_springs(tabulated: Tabulated, v: Array, y: Array) -> Decay:
    """Return the decay for springs at finite v~, y~."""
    (ratio, off), (power, power_off), (stick, stick_off) = (
        tabulated.values(name, v, y, SPRING)[:2] for name in ("mu_ratio", "power", "stick_fraction")
    )
    turn, turn_off = _KERNEL.turns_in_stick(v, y, stick, stick_off)
    rate = v * ratio + power
    rate_off = v * off + power_off + 2.0 * ROUNDING * rate
    low, high = np.maximum(rate - rate_off, 0.0), rate + rate_off
    # the cosine may pass zero within the bounds
    cosines = [_size_of_cosine(x) for x in (turn - turn_off, turn + turn_off)]
    passes = (turn - turn_off < 1.0) & (turn + turn_off > 1.0)
    largest, smallest = np.maximum(*cosines), np.where(passes, -np.inf, np.minimum(*cosines))
    path = 2.0 * math.pi
    return Decay(
        rate,
        path * rate - 2.0 * _size_of_cosine(turn),
        path * low - 2.0 * largest,
        path * high - 2.0 * smallest,
    )


def _size_of_cosine(turn: Array) -> Array:
    """Return ln abs(cos) of an angle, computed from 1 - cos."""
    rest = np.clip(np.where(turn < 1.0, turn, 2.0 - turn), 0.0, 1.0)
    return np.asarray(np.log1p(-rest))


#: springs of a ball that are tried, down to 1/REACH of the middle spring's load, or to the spring
#: whose y~ is REACH: first FIRST springs, then ROUNDS times FINER springs between the neighbours of
#: the slowest
REACH, FIRST, FINER, ROUNDS = 8.0, 129, 17, 10
AT_ONCE = 128  # balls


def decay_of_balls(tabulated: Tabulated, v: Array, y: Array) -> Decay:
    """Return the decay of the slowest spring of each ball, from finite v~, y~ of the middle spring.
    The rate is that of the middle spring."""
    parts = [
        _decay_of_balls(tabulated, v[start : start + AT_ONCE], y[start : start + AT_ONCE])
        for start in range(0, max(v.size, 1), AT_ONCE)
    ]
    return Decay(*map(np.concatenate, zip(*parts, strict=True)))


def _decay_of_balls(tabulated: Tabulated, v: Array, y: Array) -> Decay:
    stop = np.log(np.maximum(REACH / np.maximum(y, 1e-300), REACH))
    springs, shares, slowest = _along_rays(tabulated, v, y, np.zeros(v.size), stop, FIRST)
    found = Decay(*(x[:, 0] for x in springs))  # the middle springs
    inner = np.flatnonzero(slowest > 0)
    if not inner.size:
        return found
    v, y, shares, slowest = v[inner], y[inner], shares[inner], slowest[inner]
    each = np.arange(inner.size)
    for _ in range(ROUNDS):
        ends = (np.clip(slowest + side, 0, shares.shape[1] - 1) for side in (-1, 1))
        low, high = (shares[each, end] for end in ends)
        springs, shares, slowest = _along_rays(tabulated, v, y, low, high, FINER)
    small, least, most = (x[each, slowest] for x in springs[1:])
    # if the decay is convex, it is nowhere lower than the slowest spring by more than it rises to
    # the neighbours
    ends = (np.clip(slowest + side, 0, FINER - 1) for side in (-1, 1))
    rise = np.maximum(*(springs.of_small[each, end] for end in ends)) - small
    for column, value in zip(found[1:], (small, np.maximum(least - rise, 0.0), most), strict=True):
        column[inner] = value
    return found


def _along_rays(
    tabulated: Tabulated, v: Array, y: Array, low: Array, high: Array, count: int
) -> tuple[Decay, Array, NDArray[np.intp]]:
    """Return the decay at ``count`` springs along the ray of each ball, these springs, and which of
    them is the slowest.  ``low`` and ``high`` are logarithms of v~ and y~ over those of the middle
    spring."""
    places = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, count)
    with np.errstate(over="ignore"):
        ray = [np.minimum((x[:, None] * np.exp(places)).ravel(), 1e300) for x in (v, y)]
    springs = Decay(*(x.reshape(places.shape) for x in decay_of_springs(tabulated, *ray)))
    return springs, places, np.argmin(springs.of_small, axis=1)


@np.errstate(all="ignore")
def decay(cases: Evaluated, remaining: float = REMAINING) -> tuple[Any, Any, Any, Any, Any]:
    """Return how fast a disturbance decays, for oscillation across: the periods until a small
    disturbance has fallen to ``remaining``, the periods until any disturbance has, the time of the
    former [s], the slip path of a period over l0, and the error bound of the first."""
    load_ratio = SPRINGS_OF[CONTACTS[cases.kind.contact]].middle_load
    speed, frequency, moving, ratio, length, v, y = np.atleast_1d(
        *(cases.columns["v0"], cases.columns["omega"], cases.moving),
        *(cases.mu_ratio, cases.length_scale, cases.v_tilde, cases.y_tilde),
    )
    v, y, l0 = v / load_ratio, y / load_ratio, load_ratio * length
    unshaken = np.logical_not(moving)  # dragged without oscillation, mu~ = 1
    inside = np.isfinite(v) & np.isfinite(y) & ~unshaken
    of = decay_of_balls if cases.kind.contact else decay_of_springs
    found = of(cases.tabulated, v[inside], y[inside])
    to_remaining = math.log(1.0 / remaining)
    with np.errstate(all="ignore"):
        # in units of l0 omega; infinite for a rigid contact and beyond double range
        drag_rate = np.where(speed == 0.0, 0.0, speed / l0 / frequency)
        rate = np.where(unshaken, drag_rate, np.inf)
        rate[inside] = found.rate
        rate = np.where(np.isnan(ratio), np.nan, rate)  # an illegal case
        slip_path = 2.0 * math.pi * rate
        small, least, most = slip_path.copy(), slip_path.copy(), slip_path.copy()
        small[inside], least[inside], most[inside] = found[1:]
        # if rate is 0, nothing slips; also for a rigid contact at rest
        still = rate == 0.0
        periods, longest, shortest = (
            np.where(still, np.inf, to_remaining / x) for x in (small, least, most)
        )
        error = np.where(still, np.inf, np.maximum(longest - periods, periods - shortest))
        error = np.where(np.isinf(small) & ~np.isinf(least), longest, error)
        any_size = np.where(still, np.inf, 2.0 * to_remaining / slip_path)
        dragged = l0 * (to_remaining / speed)
        time = np.where(unshaken, dragged, periods * 2.0 * math.pi / frequency)
        time = np.where(still, np.inf, time)
    parts = periods, any_size, time, slip_path, error
    return parts if cases.cases.shape else tuple(float(x[0]) for x in parts)  # type: ignore[return-value]


def settling(cases: Evaluated) -> Values:
    """Return periods until a disturbed contact is within 1 % of its steady cycle."""
    periods, any_size, time, slip_path, bound = decay(cases)
    return {
        "settling.periods": periods,
        "settling.periods_any": any_size,
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
            "-", "Until 1 % of a small disturbance is left; of a ball in its slowest spring"
        ),
        "settling.periods_any": Member(
            "-", "The same for a disturbance of any size: at most 2 ln(100)/slip_path"
        ),
        "settling.time": Member("s", "periods as a time; also without oscillation"),
        "settling.slip_path": Member(
            "-", "Path of the foot in a period over l0; no value for a rigid contact"
        ),
        "settling_bound.periods": Member("-", "Bound of the absolute error of periods"),
    },
    cost=75,
    cost_of_ball=5000,
    lacks={"along": _DERIVED, "normal": _DERIVED},
    parts={
        "settling": "Until a disturbed contact is within 1 % of its steady cycle; infinite (null "
        "in JSON) where it never slips",
        "settling_bound": "Bound of the absolute error of periods; NaN: not known",
    },
)

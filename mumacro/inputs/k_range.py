"""A stiffness that is known as an interval only: the extremes of mu_macro over it.

mu~ along a ray of k (v~ and y~ are both proportional to it) is not monotone: it falls from 1, may
rise again, by up to 0.0087 per unit of ln k, and falls to its limit of rigid contact.  So the
extremes may lie inside; where the slope changes its sign between two samples, bisection finds them.
Both turns begin in one point, for one spring at y~ = 9.72 v~, so they may stand between two
samples, which the cubic through these then shows.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.fields import real
from mumacro.kernel.arrays import Array, Places

ENDS = ("k_low", "k_high")  # columns that hold an interval
BOUND = "two stiffnesses [N/m] with 0 < low <= high, both finite"
SPACING = 0.1  # of samples, in ln k
HALVINGS = 20  # of a spacing, until mu_macro next to an extreme is flat to 1e-14


def as_ends(inputs: Mapping[str, Any]) -> dict[str, Any]:
    """Inputs with :data:`ENDS` for ``k_range``; InputError for k beside it, half an interval, or
    what is no pair."""
    given = dict(inputs)
    if "k_range" in given:
        if told := [name for name in ("k", *ENDS) if name in given]:
            raise InputError(told[0], given[told[0]], "left out beside k_range")
        pair = given.pop("k_range")
        try:
            given["k_low"], given["k_high"] = pair
        except (TypeError, ValueError) as error:
            raise InputError("k_range", pair, BOUND) from error
    if missing := [name for name in ENDS if name not in given]:
        raise InputError(missing[0], None, "given [N/m] beside the other end of the interval")
    if "k" in given:
        raise InputError("k", given["k"], "left out beside an interval of it")
    return given


def middle(inputs: Mapping[str, Any], illegal: str) -> tuple[Array, Array, Array]:
    """Both ends and their geometric middle; for no interval NaN, or InputError as ``illegal`` and
    one value ask for."""
    low, high = (real(name, inputs[name]) for name in ENDS)
    try:
        low, high = np.broadcast_arrays(low, high)
    except ValueError as error:
        raise InputError(
            "k_range", (low.shape, high.shape), "of shapes that broadcast together"
        ) from error
    legal = (low > 0.0) & (low <= high) & (high < math.inf)
    if not legal.all() and (illegal == "raise" or not legal.ndim):
        i = int(np.flatnonzero(~legal.ravel())[0])
        raise InputError(
            "k_range", (float(low.flat[i]), float(high.flat[i])), BOUND, i if legal.ndim else None
        )
    low, high = (np.where(legal, end, np.nan) for end in (low, high))
    return low, high, np.asarray(np.clip(np.sqrt(low) * np.sqrt(high), low, high))


def without_interval(
    case: Mapping[str, Any], along: str
) -> tuple[Mapping[str, Any], dict[str, Any]]:
    """A case with the middle stiffness, and the ends of an interval of it, if any; there is none
    where k is swept."""
    if all(case.get(name) is None for name in ("k_range", *ENDS)):
        return case, {}
    given = as_ends(case)
    if along == "k":
        raise InputError(
            "k_range", (given["k_low"], given["k_high"]), "left out where k is the swept input"
        )
    between = middle(given, "raise")[2]
    ends = {name: given.pop(name) for name in ENDS}
    return {**given, "k": between}, ends


def extremes(
    evaluate: Callable[[Array, Places], tuple[Array, Array, Array]], low: Array, high: Array
) -> tuple[Array, Array, Array]:
    """Smallest and largest mu_macro over [low, high], shapes (n,), and the largest bound of its
    error met there.

    ``evaluate(k, places)`` gives (mu_macro, its bound, d mu_macro / d ln k) of cases ``places``
    with stiffnesses ``k``.
    """
    places = np.arange(low.size)
    ratio = np.log(high) - np.log(low)  # high/low may be beyond double range
    largest = float(np.nanmax(ratio, initial=0.0))
    count = 1 + max(1, math.ceil(largest / SPACING)) if largest > 0.0 else 1
    least, most, bound = np.full(low.size, np.inf), np.full(low.size, -np.inf), np.zeros(low.size)

    def take(k: Array, where: Places) -> tuple[Array, Array]:
        mu, error, slope = evaluate(k, where)
        least[where] = np.fmin(least[where], mu)
        most[where] = np.fmax(most[where], mu)
        bound[where] = np.fmax(bound[where], error)
        return mu, slope

    def close_in(left: Array, right: Array, sign: Array, where: Places) -> None:
        """Takes points ever closer to a turn, left of which the slope has this sign."""
        for _ in range(HALVINGS if where.size else 0):
            half = np.sqrt(left) * np.sqrt(right)
            same = take(half, where)[1] * sign > 0.0
            left, right = np.where(same, half, left), np.where(same, right, half)

    before, (mu_before, slope_before) = low, take(low, places)
    for i in range(1, count):
        share = i / (count - 1)
        here = high if i == count - 1 else low ** (1.0 - share) * high**share
        mu, slope = take(here, places)
        turns = np.flatnonzero(slope_before * slope < 0.0)
        close_in(before[turns], here[turns], slope_before[turns], turns)
        place = _between(
            mu - mu_before, slope_before * np.log(here / before), slope * np.log(here / before)
        )
        pairs = np.flatnonzero(place > 0.0)
        inside = before[pairs] * (here[pairs] / before[pairs]) ** place[pairs]
        turned = take(inside, pairs)[1] * slope[pairs] < 0.0 if pairs.size else pairs > 0
        pairs, inside = pairs[turned], inside[turned]
        close_in(before[pairs], inside, slope_before[pairs], pairs)
        close_in(inside, here[pairs], -slope[pairs], pairs)
        before, mu_before, slope_before = here, mu, slope
    illegal = np.isnan(ratio) | (least > most)
    least[illegal] = most[illegal] = np.nan
    return least, most, bound


def _between(rise: Array, first: Array, last: Array) -> Array:
    """Where two turns may hide between samples whose slopes have the same sign: the place of the
    extreme slope.

    That of the cubic with this rise and these slopes over an interval of 1, where it has the other
    sign; else 0.
    """
    with np.errstate(all="ignore"):
        bend, fall = 3.0 * (first + last - 2.0 * rise), 6.0 * rise - 4.0 * first - 2.0 * last
        place = -0.5 * fall / bend
        hidden = (
            (first * last > 0.0)
            & (place > 0.0)
            & (place < 1.0)
            & ((first + 0.5 * fall * place) * first < 0.0)
        )
    return np.where(hidden, place, 0.0)

"""A stiffness that is known as an interval only: its ends among the inputs.

mu~ is not monotone in k, so the extremes of mu_macro may lie inside: ``kernel/interval.c`` finds
them.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.fields import real
from mumacro.kernel.arrays import Array

ENDS = ("k_low", "k_high")  # columns that hold an interval
BOUND = "two stiffnesses [N/m] with 0 < low <= high, both finite"


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

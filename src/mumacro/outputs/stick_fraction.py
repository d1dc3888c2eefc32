"""Compute how long the contact sticks."""

import math

from mumacro.outputs.entry import Member, Output, Values
from mumacro.outputs.evaluated import Evaluated, where


def stick_fraction(cases: Evaluated) -> Values:
    """Return the fraction of the period during which the contact sticks."""
    value, bound = cases.quantity("stick_fraction", cases.v_tilde, cases.y_tilde)
    # y~ below double range: v~ and y~ do not show whether such a contact sticks
    lost = (cases.y_tilde == 0.0) & (cases.v_tilde < math.inf) & cases.moving
    return {"stick_fraction": value, "stick_fraction_bound": where(lost, 1.0, bound)}


STICK_FRACTION = Output(
    "stick_fraction",
    stick_fraction,
    {
        "stick_fraction": Member("-", "Share of the period during which the contact sticks"),
        "stick_fraction_bound": Member(
            "-", "Bound of its absolute error, larger at the border; no value where it is not known"
        ),
    },
    cost=4,
)

"""Compute the standard deviation of mu_macro from independent deviations of the inputs, to first
order, the range in which it lies one deviation up and down, and tell where the two differ."""

import math
from functools import reduce
from typing import Any

import numpy as np

from mumacro.inputs.cases import ALL_FIELDS
from mumacro.inputs.fields import POSITIVE
from mumacro.outputs.answer import BAND
from mumacro.outputs.entry import Member, Output, Values
from mumacro.outputs.evaluated import Evaluated, where
from mumacro.results import REMARK, Note

#: limit, as a fraction of the whole deviation, of the difference between mu_macro one deviation up
#: or down and the straight line
STRAIGHT = 0.2


def std(cases: Evaluated) -> Values:
    """Return the whole deviation, the part of it that comes from the gradient's bound, the ends of
    the band, and the part of the variance that comes from each input."""
    spreads = {name: cases.cases.std.get(name, 0.0) for name in cases.kind.fields}
    # k has no effect on a rigid contact; an infinite slope has none if the input is exact
    exact = {
        name: (cases.rigid & (name == "k")) | (spread == 0.0) for name, spread in spreads.items()
    }
    terms, doubts = (
        [where(exact[name], 0.0, of_inputs[name] * spread) for name, spread in spreads.items()]
        for of_inputs in (cases.gradient, cases.gradient_bound)
    )
    with np.errstate(all="ignore"):
        total, doubt = (reduce(np.hypot, parts) for parts in (terms, doubts))
        shares = [where(total > 0.0, (term / total) ** 2, 0.0) for term in terms]
        ends = dict(zip(BAND, _one_deviation(cases), strict=True))
    by_input = {f"std_share.{name}": share for name, share in zip(spreads, shares, strict=True)}
    return {"std": total, "std_bound": doubt, **ends, **by_input}


def _one_deviation(cases: Evaluated) -> tuple[Any, Any]:
    """Return mu_macro at its lowest and at its highest one deviation up and down.

    The changes of several inputs are added as independent ones, those up apart from those down.
    The slope says the change where an input cannot have the value, because the contact lifts off.
    """
    fall = rise = 0.0 * cases.mu_macro
    for name, (up, down) in cases.deviating.items():
        straight = cases.gradient[name] * cases.cases.std[name]
        steps = where(np.isnan(up), straight, up), where(np.isnan(down), -straight, down)
        fall = np.hypot(fall, np.minimum(np.minimum(*steps), 0.0))
        rise = np.hypot(rise, np.maximum(np.maximum(*steps), 0.0))
    return np.maximum(cases.mu_macro - fall, 0.0), cases.mu_macro + rise


def rough(cases: Evaluated, total: float) -> list[Note]:
    """Return remarks on one case: name the inputs for which first order is not enough.  For such an
    input mu_macro one deviation up or down differs from the straight line by more than a fifth of
    the whole deviation."""
    remarks: list[Note] = []
    for name, (up, down) in cases.deviating.items():
        spread, value = cases.cases.std[name], cases.columns[name]
        if not spread or value == math.inf:
            continue
        straight, least = cases.gradient[name] * spread, value - spread
        if least < 0.0 or (least == 0.0 and name in POSITIVE):
            bound = "> 0" if name in POSITIVE else ">= 0"
            text = f"{name} less its deviation is not {bound}: its distribution is not symmetric"
        elif math.isnan(up + down):
            text = f"the contact lifts off when {name} is one deviation away"
        elif max(abs(up - straight), abs(down + straight)) > STRAIGHT * total:
            low, high = sorted((cases.mu_macro + up, cases.mu_macro + down))
            text = f"± is rough for {name}: one deviation up and down gives {low:.3g} to {high:.3g}"
        else:
            continue
        remarks.append(Note(REMARK, text, "std", name))
    return remarks


STD = Output(
    "std",
    std,
    {
        "std": Member("-", "Standard deviation of mu_macro to first order, from the gradient"),
        "std_bound": Member("-", "The part of std that comes from the gradient's bound"),
        BAND[0]: Member("-", "Smallest mu_macro over the interval of k, or one deviation away"),
        BAND[1]: Member("-", "Largest mu_macro over the interval of k, or one deviation away"),
    }
    | {f"std_share.{name}": Member("-", f"Share of {name}") for name in ALL_FIELDS},
    cost=20,
    gradient=True,
    parts={"std_share": "Share of each input in the variance, 0 to 1"},
)

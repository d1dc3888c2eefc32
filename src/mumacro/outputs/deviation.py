"""Compute the standard deviation of mu_macro from independent deviations of the inputs, to first
order, the range in which it lies one deviation up and down, and tell where the two differ."""

import math
import sys
from functools import reduce
from typing import Any

import numpy as np

from mumacro.inputs.cases import ALL_FIELDS
from mumacro.inputs.fields import POSITIVE
from mumacro.outputs.entry import Member, Output, Values
from mumacro.outputs.evaluated import Evaluated, where
from mumacro.results import REMARK, Note

#: limit, as a fraction of the whole deviation, of the difference between mu_macro one deviation up
#: or down and the straight line
STRAIGHT = 0.2


def std(cases: Evaluated) -> Values:
    """Return the whole deviation, the part of it that comes from the gradient's bound, and the part
    of the variance that comes from each input."""
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
    return {"std": total, "std_bound": doubt} | {
        f"std_share.{name}": share for name, share in zip(spreads, shares, strict=True)
    }


def bent(cases: Evaluated, total: float) -> list[Note]:
    """Return remarks on one case: name the inputs for which first order is not enough.  For such an
    input mu_macro one deviation up or down differs from the straight line by more than a fifth of
    the whole deviation."""
    remarks: list[Note] = []
    for name, spread in cases.cases.std.items():
        value = cases.columns[name]
        if not spread or value == math.inf:
            continue
        up, down = (_with(cases, name, value + step) for step in (spread, -spread))
        straight = cases.gradient[name] * spread
        if math.isnan(down):
            least = "> 0" if name in POSITIVE else ">= 0"
            text = f"{name} less its deviation is not {least}: its distribution is not symmetric"
        elif max(abs(up - straight), abs(down + straight)) > STRAIGHT * total:
            low, high = sorted((cases.mu_macro + up, cases.mu_macro + down))
            text = f"± is rough for {name}: one deviation up and down gives {low:.3g} to {high:.3g}"
        else:
            continue
        remarks.append(Note(REMARK, text, "std", name))
    return remarks


def _with(cases: Evaluated, name: str, value: Any) -> Any:
    """Return by how much mu_macro changes if one input has another value; NaN if it cannot."""
    return cases.replace(**{name: value}).mu_macro - cases.mu_macro


def one_deviation(cases: Evaluated) -> tuple[Any, Any]:
    """Return mu_macro (n,) at its lowest and at its highest one deviation up and down.

    Each input is set one deviation up and down, down to its smallest legal value.  The changes of
    several inputs are added as independent ones, those up apart from those down.  The slope says
    the change where an input cannot have the value, because the contact lifts off.
    """
    fall, rise = np.zeros_like(cases.mu_macro), np.zeros_like(cases.mu_macro)
    for name, spread in cases.cases.std.items():
        value, straight = cases.columns[name], cases.gradient[name] * spread
        least = sys.float_info.min if name in POSITIVE else 0.0
        steps = [
            np.where(np.isnan(change), slope, change)
            for change, slope in (
                (_with(cases, name, value + spread), straight),
                (_with(cases, name, np.maximum(value - spread, least)), -straight),
            )
        ]
        fall = np.hypot(fall, np.minimum(np.minimum(*steps), 0.0))
        rise = np.hypot(rise, np.maximum(np.maximum(*steps), 0.0))
    return np.maximum(cases.mu_macro - fall, 0.0), cases.mu_macro + rise


STD = Output(
    "std",
    std,
    {
        "std": Member("-", "Standard deviation of mu_macro to first order, from the gradient"),
        "std_bound": Member("-", "The part of std that comes from the gradient's bound"),
    }
    | {f"std_share.{name}": Member("-", f"Share of {name}") for name in ALL_FIELDS},
    cost=8,
    gradient=True,
    parts={"std_share": "Share of each input in the variance, 0 to 1"},
)

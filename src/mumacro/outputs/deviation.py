"""The standard deviation of mu_macro from independent deviations of the inputs, to first order; and
where first order is not enough."""

from functools import reduce
from typing import Any

import numpy as np

from mumacro.inputs.cases import ALL_FIELDS
from mumacro.inputs.fields import POSITIVE
from mumacro.notes import REMARK, Note
from mumacro.outputs.entry import Member, Output, Values
from mumacro.outputs.evaluated import Evaluated, where
from mumacro.outputs.gradient import slopes_by_input

#: how far, in whole deviations, mu_macro one deviation up or down may be from the straight line
STRAIGHT = 0.2


def std(cases: Evaluated) -> Values:
    """Return whole deviation, its part that comes from the gradient's bound, and the share of each
    input in the variance."""
    spreads = {name: cases.cases.std.get(name, 0.0) for name in cases.kind.fields}
    # k has no effect where contact is rigid, nor has an infinite slope where the input is exact
    exact = {
        name: (cases.rigid & (name == "k")) | (spread == 0.0) for name, spread in spreads.items()
    }
    terms, doubts = (
        [where(exact[name], 0.0, of_inputs[name] * spread) for name, spread in spreads.items()]
        for of_inputs in slopes_by_input(cases)
    )
    with np.errstate(all="ignore"):
        total, doubt = (reduce(np.hypot, parts) for parts in (terms, doubts))
        shares = [where(total > 0.0, (term / total) ** 2, 0.0) for term in terms]
    return {"std": total, "std_bound": doubt} | {
        f"std_share.{name}": share for name, share in zip(spreads, shares, strict=True)
    }


def bent(cases: Evaluated, total: float) -> list[Note]:
    """Return remarks on one case: the inputs along which first order is not enough, since
    mu_macro one deviation up or down differs from the slope's by more than a fifth of the whole
    deviation."""
    spreads = {name: x for name, x in cases.cases.std.items() if x and cases.columns[name] < np.inf}
    if not spreads:
        return []
    moved: dict[str, Any] = {
        name: np.full(2 * len(spreads), x) for name, x in cases.columns.items()
    }
    for i, (name, spread) in enumerate(spreads.items()):
        moved[name][2 * i : 2 * i + 2] += spread, -spread
    many = np.asarray(cases.beside(moved, 2 * len(spreads)).mu_macro)
    mu = many.reshape(-1, 2) - cases.mu_macro
    remarks: list[Note] = []
    for (name, spread), (up, down) in zip(spreads.items(), mu.tolist(), strict=True):
        straight = cases.gradient[name] * spread
        if np.isnan(down):
            least = "> 0" if name in POSITIVE else ">= 0"
            text = f"{name} less its deviation is not {least}: its distribution is not symmetric"
        elif max(abs(up - straight), abs(down + straight)) > STRAIGHT * total:
            text = (
                f"first order is not enough along {name}: one deviation up changes mu_macro by "
                f"{up:+.3g}, one down by {down:+.3g}, the slope says {straight:+.3g}"
            )
        else:
            continue
        remarks.append(Note(REMARK, text, "std", name))
    return remarks


_ONE_K = (
    "it needs one k: give k with its standard deviation, or an interval of k without deviations"
)
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
    lacks={"interval": _ONE_K},
    parts={"std_share": "Share of each input in the variance, 0 to 1"},
)

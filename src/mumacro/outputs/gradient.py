"""Compute the derivatives of mu_macro."""

import math
from typing import Any

from mumacro.inputs.cases import ALL_FIELDS
from mumacro.inputs.fields import AMPLITUDE, PER_UNIT
from mumacro.outputs.entry import Member, Output, Values
from mumacro.outputs.evaluated import Evaluated, where

PER = {name: PER_UNIT["Fz" if name == AMPLITUDE else name] for name in ALL_FIELDS}


def slopes_by_input(cases: Evaluated) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return d mu_macro / d input and the bounds, by field; NaN along k if the contact is rigid."""
    no_slope = where(cases.rigid, math.nan, 0.0)
    slopes, bounds = cases.gradient, cases.gradient_bound
    return {**slopes, "k": slopes["k"] + no_slope}, {**bounds, "k": bounds["k"] + no_slope}


def gradient(cases: Evaluated) -> Values:
    """Return d mu_macro / d input, with bounds."""
    of_inputs, bounds = slopes_by_input(cases)
    return {f"gradient.{name}": slope for name, slope in of_inputs.items()} | {
        f"gradient_bound.{name}": bound for name, bound in bounds.items()
    }


GRADIENT = Output(
    "gradient",
    gradient,
    {f"gradient.{name}": Member(unit, f"d mu_macro / d {name}") for name, unit in PER.items()}
    | {
        f"gradient_bound.{name}": Member(
            unit, f"Bound of the absolute error of the slope of {name}"
        )
        for name, unit in PER.items()
    },
    cost=6,
    gradient=True,
    parts={
        "gradient": "d mu_macro / d input; NaN: not finite, or no such input (k of rigid contact)",
        "gradient_bound": "Bounds of the absolute errors of the gradient; NaN: not known",
    },
)

"""Friction as a component of an OpenMDAO model, with exact partial derivatives; least_power.py uses
it. A value out of bounds raises AnalysisError, so that a line search steps back.
"""

from typing import Any

import numpy as np
import openmdao.api as om

from mumacro import InputError, Surrogate
from mumacro.inputs.fields import FIELDS, UNITS


class Friction(om.ExplicitComponent):
    """Six inputs in SI -> mu_macro [-], with the option ``power`` also oscillation_power [W], that
    of the shaker."""

    def initialize(self) -> None:
        self.options.declare(
            "surrogate", default=None, types=Surrogate, allow_none=True, recordable=False
        )
        self.options.declare("vec_size", default=1, types=int, lower=1)
        self.options.declare("power", default=False, types=bool)

    def setup(self) -> None:
        size, self.table = self.options["vec_size"], self.options["surrogate"] or Surrogate.open()
        for name in FIELDS:
            self.add_input(name, np.ones(size), units=None if UNITS[name] == "-" else UNITS[name])
        self.add_output("mu_macro", np.ones(size))
        if self.options["power"]:
            self.add_output("oscillation_power", np.ones(size), units="W")
        self.declare_partials("*", "*", rows=np.arange(size), cols=np.arange(size))

    def answer(self, inputs: Any, gradient: bool = False) -> tuple[Any, Any, Any]:
        case = {name: np.asarray(inputs[name]) for name in FIELDS}
        if self.options["power"] and np.isinf(case["k"]).any():
            raise om.AnalysisError(
                "the power of a rigid contact is not defined: give a finite k, or power=False"
            )
        try:
            friction = self.table.evaluate(
                case, gradient=gradient, include="groups", illegal="raise"
            )
            return friction, case["mu0"] * case["Fz"], case["omega"]
        except InputError as error:
            raise om.AnalysisError(str(error)) from error

    def compute(self, inputs: Any, outputs: Any) -> None:
        friction, force, omega = self.answer(inputs)
        outputs["mu_macro"] = friction.mu_macro
        if self.options["power"]:
            share = self.table.power(friction.v_tilde, friction.y_tilde)
            outputs["oscillation_power"] = force * friction.length_scale * omega * share

    def compute_partials(self, inputs: Any, partials: Any) -> None:
        friction, force, omega = self.answer(inputs, gradient=True)
        for name, slope in friction.gradient.items():
            partials["mu_macro", name] = slope
        if self.options["power"]:
            # at rest the partials are those just beside it
            v, y = np.maximum(friction.v_tilde, 1e-9), np.maximum(friction.y_tilde, 1e-9)
            p, along_v, along_y = self.table.slopes(v, y, "power")
            unit, by_force = force * friction.length_scale, 2.0 * p - along_v - along_y
            for name in ("mu0", "Fz"):
                partials["oscillation_power", name] = omega * unit * by_force / inputs[name]
            partials["oscillation_power", "k"] = (
                omega * unit * (along_v + along_y - p) / inputs["k"]
            )
            partials["oscillation_power", "omega"] = unit * (p - along_v)
            partials["oscillation_power", "y0"] = force * omega * along_y / y
            partials["oscillation_power", "v0"] = force * along_v / v

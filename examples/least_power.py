"""Which amplitude and frequency bring friction down to a target at the least power?  With OpenMDAO.

    python examples/least_power.py [TABLE]

A shaker (moving mass m, quality factor Q) brings the friction of a guide from mu0 down to ``TARGET``.  It pays twice:
for the sliding that it causes in the contact, mu0 Fz l0 omega p(v~, y~), and for its own losses,
m omega^3 y0^2 / (2 Q).  At low frequency the contact takes more, at high frequency the shaker itself does: the optimum
lies between.

:class:`Friction` is a component to take away: mu_macro with exact gradients from the table, ready for any model.
"""

import sys
from pathlib import Path

import numpy as np
import openmdao.api as om

from mumacro import Surrogate

TABLE = Path(__file__).resolve().parent.parent / "tables" / "mumacro-1e-10.nc"
TARGET = 0.15
INPUTS = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 3e-6, "omega": 3e4, "v0": 0.01}
UNITS = {"mu0": None, "Fz": "N", "k": "N/m", "y0": "m", "omega": "rad/s", "v0": "m/s"}
MASS, QUALITY = 0.005, 1000.0  # [kg], [-]


class Friction(om.ExplicitComponent):
    """Six inputs in SI units -> mu_macro [-], with its gradient."""

    def initialize(self):
        self.options.declare("surrogate", types=Surrogate)

    def setup(self):
        for name, value in INPUTS.items():
            self.add_input(name, value, units=UNITS[name])
        self.add_output("mu_macro", 0.3)
        self.declare_partials("mu_macro", list(INPUTS))

    def _answer(self, inputs, gradient=False):
        case = {name: float(inputs[name][0]) for name in INPUTS}
        return self.options["surrogate"].evaluate(**case, gradient=gradient)

    def compute(self, inputs, outputs):
        outputs["mu_macro"] = self._answer(inputs).mu_macro

    def compute_partials(self, inputs, partials):
        for name, slope in self._answer(inputs, gradient=True).gradient.items():
            partials["mu_macro", name] = slope


class Power(om.ExplicitComponent):
    """Six inputs in SI units -> power of the shaker [W]: into the contact, and its own losses."""

    def initialize(self):
        self.options.declare("surrogate", types=Surrogate)

    def setup(self):
        for name, value in INPUTS.items():
            self.add_input(name, value, units=UNITS[name])
        self.add_output("contact", 0.05, units="W")
        self.add_output("total", 0.05, units="W")
        self.declare_partials("*", list(INPUTS))

    def _powers(self, case):
        length = case["mu0"] * case["Fz"] / case["k"]
        y_tilde, v_tilde = case["y0"] / length, case["v0"] / (length * case["omega"])
        share = self.options["surrogate"].power(v_tilde, y_tilde)
        contact = case["mu0"] * case["Fz"] * length * case["omega"] * share
        return np.array([contact, contact + MASS * case["omega"] ** 3 * case["y0"] ** 2 / (2.0 * QUALITY)])

    def compute(self, inputs, outputs):
        outputs["contact"], outputs["total"] = self._powers({name: float(inputs[name][0]) for name in INPUTS})

    def compute_partials(self, inputs, partials):
        # the table differentiates friction, not power: central differences, good to nine digits on so smooth a table
        case = {name: float(inputs[name][0]) for name in INPUTS}
        for name, value in case.items():
            step = 1e-5 * value
            high, low = self._powers({**case, name: value + step}), self._powers({**case, name: value - step})
            partials["contact", name], partials["total", name] = (high - low) / (2.0 * step)


def optimise(surrogate, target=TARGET):
    """The finished problem: ``y0`` and ``omega`` at least total power under mu_macro <= target."""
    problem = om.Problem(reports=None)
    problem.model.add_subsystem("mumacro", Friction(surrogate=surrogate), promotes=["*"])
    problem.model.add_subsystem("power", Power(surrogate=surrogate), promotes=["*"])
    for name, value in INPUTS.items():
        problem.model.set_input_defaults(name, value, units=UNITS[name])
    problem.model.add_design_var("y0", lower=1e-7, upper=1e-4, ref=1e-6)
    problem.model.add_design_var("omega", lower=1e3, upper=1e6, ref=1e4)
    problem.model.add_objective("total", ref=0.01)
    problem.model.add_constraint("mu_macro", upper=target, ref=0.1)
    problem.driver = om.ScipyOptimizeDriver(optimizer="SLSQP", tol=1e-10, maxiter=200, disp=False)
    problem.setup()
    problem.run_driver()
    return problem


def main():
    surrogate = Surrogate.open(sys.argv[1] if len(sys.argv) > 1 else TABLE)
    problem = optimise(surrogate)
    y0, omega = problem.get_val("y0")[0], problem.get_val("omega")[0]
    print(f"mu_macro = {problem.get_val('mu_macro')[0]:.6f} (mu0 = {INPUTS['mu0']}, target {TARGET})")
    print(f"y0 = {1e6 * y0:.4f} um, frequency {omega / (2e3 * np.pi):.4f} kHz")
    total, contact = (1e3 * problem.get_val(name)[0] for name in ("total", "contact"))
    print(f"power {total:.3f} mW, {contact:.3f} of it in the contact")
    saved = (INPUTS["mu0"] - problem.get_val("mu_macro")[0]) * INPUTS["Fz"] * INPUTS["v0"]
    print(f"saved in the drive: {1e3 * saved:.3f} mW")


if __name__ == "__main__":
    main()

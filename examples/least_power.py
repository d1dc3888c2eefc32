"""Which amplitude and frequency bring friction down to a target at the least power?  With OpenMDAO.

    python examples/least_power.py [TABLE]

A shaker (moving mass m, quality factor Q) brings the friction of a guide from mu0 down to
``TARGET``.  It pays twice: for the sliding that it causes in the contact, mu0 Fz l0 omega p(v~,
y~), and for its own losses, m omega^3 y0^2 / (2 Q).  At low frequency the contact takes more, at
high frequency the shaker itself does: the optimum lies between.

The component, with exact gradients from the table, is that of openmdao_component.py.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import openmdao.api as om
from openmdao_component import Friction

from mumacro import Surrogate
from mumacro.inputs.fields import UNITS

TABLE = Path(__file__).resolve().parent.parent / "tables" / "mumacro-1e-10.nc"
TARGET = 0.15
INPUTS = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 3e-6, "omega": 3e4, "v0": 0.01}
MASS, QUALITY = 0.005, 1000.0  # [kg], [-]


def optimise(surrogate: Surrogate, target: float = TARGET) -> Any:
    """The finished problem: ``y0`` and ``omega`` at least total power under mu_macro <= target."""
    problem = om.Problem(reports=None)
    problem.model.add_subsystem(
        "friction", Friction(surrogate=surrogate, power=True), promotes=["*"]
    )
    losses = om.ExecComp(
        f"total = oscillation_power + {MASS} * omega**3 * y0**2 / (2 * {QUALITY})",
        total={"units": "W"},
        oscillation_power={"units": "W"},
        omega={"units": "rad/s"},
        y0={"units": "m"},
    )
    problem.model.add_subsystem("shaker", losses, promotes=["*"])
    for name in ("omega", "y0"):
        problem.model.set_input_defaults(name, INPUTS[name], units=UNITS[name])
    problem.model.add_design_var("y0", lower=1e-7, upper=1e-4, ref=1e-6)
    problem.model.add_design_var("omega", lower=1e3, upper=1e6, ref=1e4)
    problem.model.add_objective("total", ref=0.01)
    problem.model.add_constraint("mu_macro", upper=target, ref=0.1)
    problem.driver = om.ScipyOptimizeDriver(optimizer="SLSQP", tol=1e-10, maxiter=200, disp=False)
    problem.setup()
    for name, value in INPUTS.items():
        problem.set_val(name, value)
    problem.run_driver()
    return problem


def main() -> None:
    surrogate = Surrogate.open(sys.argv[1] if len(sys.argv) > 1 else TABLE)
    problem = optimise(surrogate)
    y0, omega = problem.get_val("y0")[0], problem.get_val("omega")[0]
    print(
        f"mu_macro = {problem.get_val('mu_macro')[0]:.6f} (mu0 = {INPUTS['mu0']}, target {TARGET})"
    )
    print(f"y0 = {1e6 * y0:.4f} um, frequency {omega / (2e3 * np.pi):.4f} kHz")
    total, contact = (1e3 * problem.get_val(name)[0] for name in ("total", "oscillation_power"))
    print(f"power {total:.3f} mW, {contact:.3f} of it in the contact")
    saved = (INPUTS["mu0"] - problem.get_val("mu_macro")[0]) * INPUTS["Fz"] * INPUTS["v0"]
    print(f"saved in the drive: {1e3 * saved:.3f} mW")


if __name__ == "__main__":
    main()

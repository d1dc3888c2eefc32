"""Friction as a component of an OpenMDAO model, with exact partial derivatives.  Needs the extra ``openmdao``."""

from __future__ import annotations

from typing import Any

import numpy as np
import openmdao.api as om
from numpy.typing import NDArray

from mumacro.errors import InputError
from mumacro.inputs import FIELDS, UNITS
from mumacro.interop.derivatives import quantities
from mumacro.surrogate import Surrogate

__all__ = ["Friction"]

Array = NDArray[np.float64]


class Friction(om.ExplicitComponent):  # type: ignore[misc]
    """Six inputs in SI units -> ``mu_macro`` [-], and with the option ``power`` ``oscillation_power`` [W].

    Options
    -------
    surrogate : Surrogate or None
        The table; None is the tightest one that comes with the library.
    vec_size : int
        Cases at once: the length of every input and output.
    power : bool
        Also give ``oscillation_power``, the mean power of the shaker: mu0 Fz l0 omega <y~ cos tau u_y> [W].

    Notes
    -----
    A value out of bounds raises openmdao.api.AnalysisError, so that a line search steps back.

    Examples
    --------
    >>> import openmdao.api as om
    >>> problem = om.Problem(reports=None)
    >>> _ = problem.model.add_subsystem("friction", Friction(power=True), promotes=["*"])
    >>> _ = problem.setup()
    >>> for name, value in dict(mu0=0.3, Fz=10, k=1e6, y0=2e-6, omega=1.3e5, v0=0.01).items():
    ...     problem.set_val(name, value)
    >>> problem.run_model()
    >>> [f"{problem.get_val(name)[0]:.6f}" for name in ("mu_macro", "oscillation_power")]
    ['0.240012', '0.013518']
    """

    def initialize(self) -> None:
        """Declare the options."""
        self.options.declare("surrogate", default=None, types=Surrogate, allow_none=True, recordable=False)
        self.options.declare("vec_size", default=1, types=int, lower=1)
        self.options.declare("power", default=False, types=bool)

    def setup(self) -> None:
        """Declare inputs, outputs and where the partial derivatives are: every case has its own."""
        size = self.options["vec_size"]
        self._surrogate = self.options["surrogate"] or Surrogate.open()
        for name in FIELDS:
            self.add_input(name, np.ones(size), units=None if UNITS[name] == "-" else UNITS[name])
        self.add_output("mu_macro", np.ones(size))
        if self.options["power"]:
            self.add_output("oscillation_power", np.ones(size), units="W")
        self.declare_partials("*", "*", rows=np.arange(size), cols=np.arange(size))

    def _evaluated(self, inputs: Any, gradient: bool = False) -> tuple[dict[str, Array], Any]:
        case = {name: np.asarray(inputs[name]) for name in FIELDS}
        try:
            answer = self._surrogate.evaluate(case, gradient=gradient, groups=self.options["power"], illegal="raise")
        except InputError as error:
            raise om.AnalysisError(str(error)) from error
        if self.options["power"] and not np.all(np.isfinite(case["k"])):
            raise om.AnalysisError("the power of a rigid contact is not defined: give a finite k, or power=False")
        return case, answer

    def compute(self, inputs: Any, outputs: Any) -> None:
        """Fill the outputs."""
        case, answer = self._evaluated(inputs)
        outputs["mu_macro"] = answer.mu_macro
        if self.options["power"]:
            share = self._surrogate.power(answer.v_tilde, answer.y_tilde)
            outputs["oscillation_power"] = case["mu0"] * case["Fz"] * answer.length_scale * case["omega"] * share

    def compute_partials(self, inputs: Any, partials: Any) -> None:
        """Fill the partial derivatives from the table's slopes."""
        case, answer = self._evaluated(inputs, gradient=True)
        for name, slope in answer.gradient.items():
            partials["mu_macro", name] = slope
        if self.options["power"]:
            for name, slope in self._power_slopes(case, answer).items():
                partials["oscillation_power", name] = slope

    def _power_slopes(self, case: dict[str, Array], answer: Any) -> dict[str, Array]:
        """d power / d input: power = force l0 omega p(v~, y~), l0 = force / k, v~ = v0 / (l0 omega), y~ = y0 / l0."""
        share, along_v, along_y = self._surrogate.slopes(answer.v_tilde, answer.y_tilde, "power")
        by_speed, by_amplitude = quantities(self._surrogate)["power"].slopes(answer.v_tilde, answer.y_tilde)
        force = case["mu0"] * case["Fz"]
        unit = force * answer.length_scale
        by_force = case["omega"] * unit * (2.0 * share - along_v - along_y)  # times force
        return {
            "mu0": by_force / case["mu0"],
            "Fz": by_force / case["Fz"],
            "k": case["omega"] * unit * (along_v + along_y - share) / case["k"],
            "y0": force * case["omega"] * by_amplitude,
            "omega": unit * (share - along_v),
            "v0": force * by_speed,
        }

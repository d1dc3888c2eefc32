"""Serve mu_macro as a UM-Bridge model: ``python examples/umbridge_server.py PORT``; needs the
package ``umbridge``.

Inputs [[mu0, Fz, k, y0, omega, v0]] in SI units, output [[mu_macro]], with Gradient and
ApplyJacobian.  The model mu_macro_log10 takes the decimal logarithms of the inputs, for samplers.
The server of the package listens on every interface and has no key and no limits: use it in a
trusted network only.
"""

import math
import sys
from typing import Any

import umbridge

from mumacro import Surrogate

FIELDS = ("mu0", "Fz", "k", "y0", "omega", "v0")


class Friction(umbridge.Model):
    """The model ``mu_macro``, or that of the logarithms."""

    def __init__(self, log10: bool = False) -> None:
        super().__init__("mu_macro_log10" if log10 else "mu_macro")
        self.log10 = log10
        self.surrogate = Surrogate.open()

    def case(self, parameters: list[list[float]]) -> Any:
        """The six inputs by name."""
        values = [10.0**value for value in parameters[0]] if self.log10 else parameters[0]
        return dict(zip(FIELDS, values, strict=True))

    def get_input_sizes(self, _config: Any) -> list[int]:
        """Six inputs in one block."""
        return [len(FIELDS)]

    def get_output_sizes(self, _config: Any) -> list[int]:
        """One output."""
        return [1]

    def supports_evaluate(self) -> bool:
        """Values."""
        return True

    def supports_gradient(self) -> bool:
        """Slopes from the table."""
        return True

    def supports_apply_jacobian(self) -> bool:
        """The same in a direction."""
        return True

    def __call__(self, parameters: list[list[float]], _config: Any) -> list[list[float]]:
        """mu_macro; an illegal value raises InputError, which names it."""
        return [[self.surrogate.evaluate(self.case(parameters)).mu_macro]]

    def gradient(
        self, _out: int, _inp: int, parameters: Any, sens: list[float], _config: Any
    ) -> list[float]:
        """The slopes times ``sens``; an infinite one (v0 = 0 at y~ = 1) is an error."""
        case = self.case(parameters)
        answer = self.surrogate.evaluate(case, gradient=True)
        slopes = [
            answer.gradient[name] * sens[0] * (math.log(10.0) * case[name] if self.log10 else 1.0)
            for name in FIELDS
        ]
        if not all(map(math.isfinite, slopes)):
            raise ValueError("a slope is not finite at v0 = 0 and y~ = 1: choose another point")
        return slopes

    def apply_jacobian(
        self, out: int, inp: int, parameters: Any, vec: list[float], config: Any
    ) -> list[float]:
        """The slope in the direction ``vec``."""
        slopes = self.gradient(out, inp, parameters, [1.0], config)
        return [math.fsum(slope * step for slope, step in zip(slopes, vec, strict=True))]


if __name__ == "__main__":
    umbridge.serve_models([Friction(), Friction(log10=True)], int(sys.argv[1]))

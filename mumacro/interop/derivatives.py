"""What the classes for JAX and PyTorch share: the quantities by name, and mu_macro as a function of the groups."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

__all__ = ["NO_THIRD", "DifferentiableFriction", "slopes_by_groups"]

NO_THIRD = "third derivatives are not tabulated: take differences of the second ones"


class DifferentiableFriction:
    """The quantities of a table as functions of tensors.  Arguments broadcast together; illegal cases are NaN."""

    def _call(self, quantity: str, *arguments: Any) -> Any:
        raise NotImplementedError

    def mu_macro(self, mu0: Any, Fz: Any, k: Any, y0: Any, omega: Any, v0: Any) -> Any:
        """mu_macro [-] from SI inputs, see :meth:`mumacro.Surrogate.evaluate`; k None or inf is rigid contact."""
        return self._call("mu_macro", mu0, Fz, math.inf if k is None else k, y0, omega, v0)

    def mu_ratio(self, v_tilde: Any, y_tilde: Any) -> Any:
        """mu~ = mu_macro/mu0 [-], see :meth:`mumacro.Surrogate.mu_ratio`."""
        return self._call("mu_ratio", v_tilde, y_tilde)

    def power(self, v_tilde: Any, y_tilde: Any) -> Any:
        """Mean power of the shaker [-], see :meth:`mumacro.Surrogate.power`."""
        return self._call("power", v_tilde, y_tilde)

    def stick_fraction(self, v_tilde: Any, y_tilde: Any) -> Any:
        """Share of the period that sticks [-], see :meth:`mumacro.Surrogate.stick_fraction`."""
        return self._call("stick_fraction", v_tilde, y_tilde)


def slopes_by_groups(value: Any, slopes: Any, six: Sequence[Any]) -> tuple[Any, ...]:
    """d mu_macro / d input by the chain rule, from mu~ and its slopes as functions of v~ and y~, eqs. (6) and (8).

    Differentiated once more it gives the second derivatives of mu_macro.
    """
    mu0, Fz, k, y0, omega, v0 = six
    v, y = v0 * k / (mu0 * Fz * omega), y0 * k / (mu0 * Fz)
    by_v, by_y = slopes(v, y)
    along_v, along_y = v * by_v, y * by_y
    both = along_v + along_y
    return (
        value(v, y) - both, -mu0 * both / Fz, mu0 * both / k, mu0 * along_y / y0, -mu0 * along_v / omega,
        mu0 * along_v / v0,
    )  # fmt: skip

"""Values and slopes of arrays for automatic differentiation, without exceptions for single cases.

Illegal cases are NaN: a traced program cannot stop for one of its values.  Slopes are one-sided at v = 0, where some
are infinite.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mumacro.charts import QUANTITY_NAMES
from mumacro.inputs import FIELDS
from mumacro.surrogate import Surrogate

__all__ = ["NO_SECOND", "DifferentiableFriction", "Quantity", "quantities"]

Array = NDArray[np.float64]
NO_SECOND = "second derivatives are not tabulated: take differences of the first ones"


@dataclass(frozen=True)
class Quantity:
    """A function of arrays of one shape.

    Attributes
    ----------
    inputs : tuple of str
        Names of its arguments, in order.
    value : callable
        Arrays of float64 of one shape in, one of that shape out.
    slopes : callable
        The same in, the slopes along the inputs out, (inputs, *shape).
    """

    inputs: tuple[str, ...]
    value: Callable[..., Array]
    slopes: Callable[..., Array]


class DifferentiableFriction:
    """What the classes for JAX and PyTorch share: the quantities by name.  Arguments broadcast together."""

    def __init__(self, surrogate: Surrogate | None = None) -> None:
        known = quantities(Surrogate.open() if surrogate is None else surrogate)
        self._known = {name: self._made(quantity) for name, quantity in known.items()}

    def _made(self, quantity: Quantity) -> Any:
        return quantity

    def _call(self, quantity: Any, *arguments: Any) -> Any:
        raise NotImplementedError

    def mu_macro(self, mu0: Any, Fz: Any, k: Any, y0: Any, omega: Any, v0: Any) -> Any:
        """mu_macro [-] from SI inputs, see :meth:`mumacro.Surrogate.evaluate`; k None or inf is rigid contact."""
        return self._call(self._known["mu_macro"], mu0, Fz, math.inf if k is None else k, y0, omega, v0)

    def mu_ratio(self, v_tilde: Any, y_tilde: Any) -> Any:
        """mu~ = mu_macro/mu0 [-], see :meth:`mumacro.Surrogate.mu_ratio`."""
        return self._call(self._known["mu_ratio"], v_tilde, y_tilde)

    def power(self, v_tilde: Any, y_tilde: Any) -> Any:
        """Mean power of the shaker [-], see :meth:`mumacro.Surrogate.power`."""
        return self._call(self._known["power"], v_tilde, y_tilde)

    def stick_fraction(self, v_tilde: Any, y_tilde: Any) -> Any:
        """Share of the period that sticks [-], see :meth:`mumacro.Surrogate.stick_fraction`."""
        return self._call(self._known["stick_fraction"], v_tilde, y_tilde)


def quantities(surrogate: Surrogate) -> Mapping[str, Quantity]:
    """The differentiable quantities of a table by name."""

    def evaluated(six: tuple[Array, ...], **options: bool) -> Any:
        return surrogate.evaluate(dict(zip(FIELDS, map(np.atleast_1d, six), strict=True)), **options)

    def mu_macro(*six: Array) -> Array:
        found: Array = evaluated(six).mu_macro
        return found.reshape(np.shape(six[0]))

    def mu_macro_slopes(*six: Array) -> Array:
        gradient = evaluated(six, gradient=True).gradient
        return np.stack([gradient[name] for name in FIELDS]).reshape(6, *np.shape(six[0]))

    pointwise = {name: _of_groups(surrogate, name) for name in QUANTITY_NAMES}
    return {"mu_macro": Quantity(FIELDS, mu_macro, mu_macro_slopes), **pointwise}


def _of_groups(surrogate: Surrogate, name: str) -> Quantity:
    """A quantity of v~ and y~; a single point, too, gives NaN where it is illegal."""
    method = getattr(surrogate, name)

    def value(v: Array, y: Array) -> Array:
        found: Array = method(np.atleast_1d(v), np.atleast_1d(y))
        return found.reshape(np.shape(v))

    def slopes(v: Array, y: Array) -> Array:
        shape, v, y = np.shape(v), np.atleast_1d(v), np.atleast_1d(y)
        _, along_v, along_y = surrogate.slopes(v, y, name)
        with np.errstate(all="ignore"):
            by_speed, by_amplitude = along_v / v, np.where(y == 0.0, 0.0 * along_y, along_y / y)  # even in y~
        rest = (v == 0.0) & ~np.isnan(along_v)
        if rest.any():
            by_speed[rest] = _from_rest(surrogate, name, y[rest])
        return np.stack([by_speed, by_amplitude]).reshape(2, *shape)

    return Quantity(("v_tilde", "y_tilde"), value, slopes)


def _from_rest(surrogate: Surrogate, name: str, y: Array) -> Array:
    """Slope along v~ from v~ = 0 on, at (n,) amplitudes: no logarithmic slope holds it.

    Above y~ = 1 the contact slips on both sides; power and stick fraction are even in v~.  Below, it creeps: the power
    is v~ y~^2 / sqrt(1 - y~^2) to first order, and the time of slip grows as the root of v~.
    """
    if name == "mu_ratio":  # that of mu_macro of the case (1, 1, 1, y~, 1, v~)
        gradient = surrogate.evaluate(mu0=1.0, Fz=1.0, k=1.0, y0=y, omega=1.0, v0=0.0, gradient=True).gradient or {}
        return np.asarray(gradient["v0"])
    creep = (y > 0.0) & (y <= 1.0)
    if name == "stick_fraction":
        return np.where(creep, -math.inf, 0.0)
    with np.errstate(all="ignore"):
        return np.where(creep, y * y / np.sqrt((1.0 - y) * (1.0 + y)), 0.0)

"""Values and slopes of arrays for automatic differentiation, without exceptions for single cases.

Illegal cases are NaN: a traced program cannot stop for one of its values.  Slopes are one-sided at v = 0, where some
are infinite.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
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
    """A function of arrays of one shape: ``slopes`` are those along the inputs, (inputs, *shape)."""

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

    def mu_macro(*six: Array) -> Array:
        found: Array = surrogate.evaluate(dict(zip(FIELDS, six, strict=True))).mu_macro
        return found

    def mu_macro_slopes(*six: Array) -> Array:
        gradient = surrogate.evaluate(dict(zip(FIELDS, six, strict=True)), gradient=True).gradient
        return np.stack([gradient[name] for name in FIELDS])

    found = {"mu_macro": Quantity(FIELDS, _of_any_shape(mu_macro), _of_any_shape(mu_macro_slopes))}
    for name in QUANTITY_NAMES:
        slopes = _of_any_shape(partial(_slopes, surrogate, name))
        found[name] = Quantity(("v_tilde", "y_tilde"), _of_any_shape(getattr(surrogate, name)), slopes)
    return found


def _of_any_shape(function: Callable[..., Array]) -> Callable[..., Array]:
    """``function`` of arrays (n,), with or without an axis before the last in its result, for arrays of any shape.

    A single point, too, gives NaN where it is illegal.
    """

    def called(*arrays: Array) -> Array:
        found = function(*(np.ravel(x) for x in arrays))
        return found.reshape((*found.shape[:-1], *np.shape(arrays[0])))

    return called


def _slopes(surrogate: Surrogate, name: str, v: Array, y: Array) -> Array:
    _, along_v, along_y = surrogate.slopes(v, y, name)
    with np.errstate(all="ignore"):
        by_speed, by_amplitude = along_v / v, np.where(y == 0.0, 0.0 * along_y, along_y / y)  # even in y~
    rest = (v == 0.0) & ~np.isnan(along_v)
    if rest.any():
        by_speed[rest] = _from_rest(surrogate, name, y[rest])
    return np.stack([by_speed, by_amplitude])


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

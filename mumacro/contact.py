"""The contact and the direction of the oscillation: what a case may be beside one spring that is shaken across.

``contact="ball"`` is a sphere on a flat, Hertz under a constant load, as independent springs (method of dimensionality
reduction): mu~(v~, y~) = (3/2) int_0^1 s mu~_spring(v~/(1.5 s), y~/(1.5 s)) d xi with s = 1 - xi^2 and
l0 = mu0 Fz / k, where k = 8 a G* is the stiffness before slip.  ``direction="along"`` shakes along the sliding direction,
``"normal"`` the normal force, Fz + Fz_amplitude cos(omega t).  The formulas are in ``kernel/contact.c`` and
``kernel/directions.c``; here are the names, and the rules of quadrature, which grow with the table's tolerance.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from mumacro.errors import InputError
from mumacro.inputs import FIELDS
from mumacro.library import Data

__all__ = ["CONTACTS", "DIRECTIONS", "ContactName", "DirectionName", "Kind", "kind_of", "put_rules", "rules"]

Array = NDArray[np.float64]
ContactName = Literal["spring", "ball"]
DirectionName = Literal["across", "along", "normal"]
#: in the order of the kernel's codes
CONTACTS: tuple[ContactName, ...] = ("spring", "ball")
DIRECTIONS: tuple[DirectionName, ...] = ("across", "along", "normal")
AMPLITUDE = "Fz_amplitude"  # of the normal force [N], in place of y0


class Kind(NamedTuple):
    """A contact and a direction by their codes in the kernel."""

    contact: int
    direction: int

    @property
    def normal(self) -> bool:
        """Whether the normal force oscillates."""
        return self.direction == DIRECTIONS.index("normal")

    @property
    def fields(self) -> tuple[str, ...]:
        """The six inputs by name, :data:`mumacro.inputs.FIELDS` with Fz_amplitude in place of y0 for normal."""
        return tuple(AMPLITUDE if name == "y0" and self.normal else name for name in FIELDS)

    def refused(self, error: InputError) -> InputError:
        """``error`` by the name and the bound that the user knows."""
        if not self.normal or error.field != "y0":
            return error
        bound = "given [N] for direction normal" if error.value is None else ">= 0 and below Fz, else the contact lifts off"
        return InputError(AMPLITUDE, error.value, bound, error.index)

    def as_six(self, inputs: Mapping[str, Any]) -> dict[str, Any]:
        """Inputs with the amplitude in the place of y0.

        Raises
        ------
        InputError
            An amplitude that does not belong to the direction.
        """
        wrong, right = ("y0", AMPLITUDE) if self.normal else (AMPLITUDE, "y0")
        if wrong in inputs:
            word = DIRECTIONS[self.direction]
            raise InputError(wrong, inputs[wrong], f"left out for direction {word}, whose amplitude is {right}")
        return {"y0" if name == AMPLITUDE else name: value for name, value in inputs.items()}


SPRING = Kind(0, 0)


def kind_of(contact: str = "spring", direction: str = "across") -> Kind:
    """The codes of a contact and a direction.

    Raises
    ------
    InputError
        A name that is not known; a ball whose normal force oscillates.

    Examples
    --------
    >>> kind_of("ball", "along")
    Kind(contact=1, direction=1)
    """
    for name, value, known in (("contact", contact, CONTACTS), ("direction", direction, DIRECTIONS)):
        if not isinstance(value, str) or value not in known:
            raise InputError(name, value, f"one of {', '.join(known)}")
    if contact == "ball" and direction == "normal":
        bound = "across or along for a ball: an oscillating normal force changes its contact radius, which is not modelled"
        raise InputError("direction", direction, bound)
    return Kind(CONTACTS.index(contact), DIRECTIONS.index(direction))  # type: ignore[arg-type]


# --- quadrature -----------------------------------------------------------------------------------------

# Gauss's rules after t -> xi with d xi proportional to t^(p - 1) (1 - t)^(q - 1): what ends in a root becomes smooth.
_POWERS = ((1, 2), (2, 4), (2, 1), (2, 2), (1, 2))
#: tolerance of a table -> for each piece of the integral (kernel/contact.c) the number of nodes; the largest errors, see
#: mumacro_rule in kernel/data.h, absolute and relative.  benchmarks/contacts.py measures them, a tenth is added.
_RULES: dict[float, tuple[tuple[int, tuple[float, ...], tuple[float, ...]], ...]] = {
    0.0001: (
        (8, (9.5e-07, 1.3e-07, 0, 1.8e-06, 2.5e-06), (0.16, 0.14, 0, 1.7, 0.16)),
        (10, (1.6e-06, 1.3e-07, 2.5e-05, 2.6e-06, 0.0015), (0.012, 0.0058, 0.093, 0.19, 0.0072)),
        (8, (8.9e-06, 9.5e-07, 8.5e-05, 2.9e-05, 0.09), (0.14, 9.9e-05, 0.0015, 0.18, 1.1)),
        (8, (5.1e-06, 3.5e-06, 1.5e-05, 1e-05, 8.6e-05), (0.11, 3.6e-06, 5.6e-05, 0.11, 1.1)),
        (8, (2.8e-06, 1.4e-05, 0, 1.7e-05, 2.9e-05), (0.0007, 4.6e-05, 0, 0.00023, 9.7e-05)),
    ),
    1e-07: (
        (14, (1.7e-08, 6.6e-10, 0, 3.8e-08, 5.1e-08), (0.11, 0.053, 0, 1.5, 0.11)),
        (16, (3e-08, 1.3e-09, 1.2e-06, 7e-08, 0.00022), (0.00051, 0.001, 0.076, 0.11, 0.0021)),
        (16, (4.3e-08, 1.7e-09, 1.1e-05, 2.1e-07, 0.0037), (0.082, 9.2e-07, 0.00018, 0.049, 1.1)),
        (14, (3.5e-08, 5.5e-07, 1.6e-07, 3.7e-08, 8.1e-07), (0.071, 6.7e-09, 1.2e-06, 0.071, 0.99)),
        (12, (1.8e-08, 1.1e-07, 0, 1.7e-07, 3.3e-07), (0.00064, 3.5e-07, 0, 2.4e-06, 1.1e-06)),
    ),
    1e-10: (
        (26, (1.2e-10, 8.3e-13, 0, 4.1e-10, 2.9e-10), (0.051, 0.0076, 0, 0.86, 0.026)),
        (28, (1.3e-10, 1.7e-12, 2e-08, 3.7e-10, 2.8e-05), (1.7e-06, 7.6e-05, 0.087, 0.033, 0.00026)),
        (28, (1.4e-10, 1.7e-12, 1.7e-06, 9.4e-10, 4.6e-05), (0.013, 4.8e-09, 3e-05, 0.014, 1.1)),
        (22, (6.5e-11, 1.5e-06, 1.1e-08, 8e-11, 7.1e-09), (0.018, 2.6e-11, 1.7e-07, 0.018, 0.75)),
        (18, (2.1e-11, 3.4e-10, 0, 2.8e-10, 4.9e-10), (0.00047, 1.9e-09, 0, 1.9e-08, 1.9e-08)),
    ),
    1e-12: (
        (40, (4.2e-12, 5.7e-15, 0, 1.4e-11, 9.8e-12), (0.064, 0.0013, 0, 0.17, 0.0059)),
        (40, (2.8e-12, 1.4e-14, 1.4e-09, 8.6e-12, 7.8e-06), (1.7e-07, 7.4e-06, 0.11, 0.015, 4.6e-05)),
        (40, (1.2e-12, 2.1e-14, 4.6e-07, 1.1e-10, 4.1e-06), (0.0027, 1.6e-10, 8e-06, 0.0045, 6.8)),
        (28, (1.3e-12, 3.2e-07, 2.5e-09, 3.2e-12, 6.8e-10), (0.0039, 9.5e-12, 1.6e-07, 0.0039, 0.56)),
        (22, (7.9e-13, 4.5e-10, 0, 1.2e-11, 2.2e-11), (0.00077, 3.2e-09, 0, 3.7e-08, 3.7e-08)),
    ),
}


def rules(tolerance: float) -> list[tuple[Array, Array]]:
    """Points (nodes, 2) and errors (2, 8) of every piece, for a table of this tolerance.

    Points are the share of the piece beyond a node, and its weight.
    """
    chosen = _RULES[min((known for known in _RULES if known >= 0.99 * tolerance), default=max(_RULES))]
    found = []
    for (p, q), (nodes, absolute, relative) in zip(_POWERS, chosen, strict=True):
        x, weight = np.polynomial.legendre.leggauss(nodes)
        t = 0.5 * (1.0 + x)
        # the share beyond is a polynomial in 1 - t, exact where it is small
        slope = Polynomial([0.0, 1.0]) ** (q - 1) * Polynomial([1.0, -1.0]) ** (p - 1)
        beyond = slope.integ() / slope.integ()(1.0)
        points = np.stack([beyond(1.0 - t), 0.5 * weight * beyond.deriv()(1.0 - t)], axis=1)
        errors = np.zeros((2, 8))
        errors[0, : len(absolute)], errors[1, : len(relative)] = absolute, relative
        found.append((np.ascontiguousarray(points), errors))
    return found


def put_rules(data: Data, tolerance: float) -> None:
    """Give the kernel its rules, once."""
    if not data.rules:
        data.put_rules(rules(tolerance))

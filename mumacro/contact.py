"""The contact and the direction of the oscillation: what a case may be beside one spring that is shaken across.

``contact="ball"`` is a sphere on a flat, Hertz under a constant load, as independent springs (method of dimensionality
reduction): mu~(v~, y~) = (3/2) int_0^1 s mu~_spring(v~/(1.5 s), y~/(1.5 s)) d xi with s = 1 - xi^2 and
l0 = mu0 Fz / k, where k = 8 a G* is the stiffness before slip.  ``direction="along"`` shakes along the sliding
direction, ``"normal"`` the normal force, Fz + Fz_amplitude cos(omega t).  The formulas are in ``kernel/contact.c`` and
``kernel/directions.c``; here are the names, and the rules of quadrature, which grow with the table's tolerance.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
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
LIFTS_OFF = ">= 0 and below Fz: at Fz the contact lifts off"  # the bound of that amplitude


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

    @property
    def names(self) -> dict[str, Any]:
        """Both as the keywords of ``evaluate``."""
        return {"contact": CONTACTS[self.contact], "direction": DIRECTIONS[self.direction]}

    @property
    def columns(self) -> tuple[str, ...]:
        """What a table of cases may hold."""
        return (*self.fields, "f")

    def check_lift_off(self, amplitude: Array, force: Array) -> None:
        """Refuse an amplitude of the normal force that is not below it."""
        bad = np.atleast_1d(~(amplitude < force))
        if bad.any():
            i = int(np.flatnonzero(bad.ravel())[0])
            value = float(np.broadcast_to(amplitude, bad.shape).flat[i])
            raise self.refused(InputError("y0", value, "", i if np.ndim(amplitude) or np.ndim(force) else None))

    def refused(self, error: InputError) -> InputError:
        """``error`` by the name and the bound that the user knows."""
        if not self.normal or error.field != "y0":
            return error
        bound = "given [N] for direction normal"
        if error.value is not None:
            bound = LIFTS_OFF
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

    def as_given(self, six: Mapping[str, Any]) -> dict[str, Any]:
        """The inputs of :meth:`as_six` by the user's names."""
        return {AMPLITUDE if name == "y0" and self.normal else name: value for name, value in six.items()}


SPRING = Kind(0, 0)
_KINDS: dict[tuple[str, str], Kind] = {
    (word, way): Kind(i, j) for i, word in enumerate(CONTACTS) for j, way in enumerate(DIRECTIONS)
}
del _KINDS["ball", "normal"]


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
    with suppress(KeyError, TypeError):
        return _KINDS[contact, direction]
    for name, value, known in (("contact", contact, CONTACTS), ("direction", direction, DIRECTIONS)):
        if not isinstance(value, str) or value not in known:
            raise InputError(name, value, f"one of {', '.join(known)}")
    told = "across or along for a ball: a normal force that oscillates changes its contact radius, not modelled"
    raise InputError("direction", direction, told)


# --- quadrature -----------------------------------------------------------------------------------------

# Gauss's rules after t -> xi with d xi proportional to t^(p - 1) (1 - t)^(q - 1): what ends in a root becomes smooth.
_POWERS = ((1, 2), (2, 4), (2, 1), (2, 2), (1, 2))
#: tolerance of a table -> for each piece of the integral (kernel/contact.c) the number of nodes; the largest errors,
#: absolute and relative, see mumacro_rule in kernel/data.h.  benchmarks/contacts.py measures them, half is added.
_RULES: dict[float, tuple[tuple[int, tuple[float, ...], tuple[float, ...]], ...]] = {
    0.0001: (
        (8, (1.3e-06, 1.8e-07, 0, 2.4e-06, 3.4e-06), (1.5, 1.5, 1.5, 2.3, 1.5)),
        (10, (2.2e-06, 1.8e-07, 3.4e-05, 3.5e-06, 0.002), (0.016, 0.0079, 0.13, 0.26, 0.0098)),
        (8, (1.2e-05, 1.3e-06, 0.00012, 3.9e-05, 0.24), (0.19, 0.00013, 0.002, 0.24, 3)),
        (8, (6.9e-06, 4.8e-06, 2e-05, 1.4e-05, 0.00012, 2.7e-07, 0.00033, 2e-05),
         (0.15, 4.9e-06, 7.6e-05, 0.15, 1.5, 6.4e-05, 0.22)),
        (8, (3.8e-06, 1.9e-05, 0, 2.3e-05, 3.9e-05), (0.00095, 6.3e-05, 0, 0.00031, 0.00013)),
    ),
    1e-07: (
        (14, (2.3e-08, 9e-10, 0, 5.2e-08, 6.9e-08), (1.5, 1.5, 1.5, 2, 1.5)),
        (16, (4.1e-08, 1.8e-09, 1.6e-06, 9.5e-08, 0.0003), (0.00069, 0.0014, 0.1, 0.15, 0.0029)),
        (16, (5.8e-08, 2.3e-09, 1.5e-05, 2.9e-07, 0.01), (0.11, 1.3e-06, 0.00024, 0.067, 3)),
        (14, (4.8e-08, 7.5e-07, 2.2e-07, 5e-08, 1.1e-06, 3.9e-10, 4.8e-07, 4.8e-07),
         (0.097, 9.1e-09, 1.6e-06, 0.097, 1.3, 2e-06, 0.037)),
        (12, (2.4e-08, 1.5e-07, 0, 2.3e-07, 4.5e-07), (0.00087, 4.8e-07, 0, 3.3e-06, 1.5e-06)),
    ),
    1e-10: (
        (26, (1.6e-10, 1.1e-12, 0, 5.6e-10, 3.9e-10), (1.5, 1.5, 1.5, 1.5, 1.5)),
        (28, (1.8e-10, 2.3e-12, 2.7e-08, 5e-10, 3.8e-05), (2.3e-06, 0.0001, 0.12, 0.045, 0.00035)),
        (28, (1.9e-10, 2.3e-12, 2.3e-06, 1.3e-09, 0.00013), (0.018, 6.5e-09, 4.1e-05, 0.019, 3)),
        (22, (8.8e-11, 2e-06, 1.5e-08, 1.1e-10, 9.7e-09, 1.2e-12, 2.3e-08, 1.9e-08),
         (0.024, 3.5e-11, 2.3e-07, 0.024, 1, 1.4e-07, 0.0068)),
        (18, (2.9e-11, 4.6e-10, 0, 3.8e-10, 6.7e-10), (0.00064, 2.6e-09, 0, 2.6e-08, 2.6e-08)),
    ),
    1e-12: (
        (40, (5.7e-12, 7.8e-15, 0, 1.9e-11, 1.3e-11), (1.5, 1.5, 1.5, 1.5, 1.5)),
        (40, (3.8e-12, 1.9e-14, 1.9e-09, 1.2e-11, 1.1e-05), (2.3e-07, 1e-05, 0.15, 0.02, 6.3e-05)),
        (40, (1.6e-12, 2.9e-14, 6.3e-07, 1.5e-10, 1.1e-05), (0.0037, 2.2e-10, 1.1e-05, 0.0061, 18)),
        (28, (1.8e-12, 4.4e-07, 3.4e-09, 4.4e-12, 9.2e-10, 1.1e-13, 5.3e-09, 3e-09),
         (0.0053, 1.3e-11, 2.2e-07, 0.0053, 0.76, 3.3e-08, 0.0033)),
        (22, (1.1e-12, 6.1e-10, 0, 1.6e-11, 3e-11), (0.001, 4.4e-09, 0, 5e-08, 5e-08)),
    ),
}  # fmt: skip


def rules(tolerance: float) -> list[tuple[Array, Array]]:
    """Points (nodes, 2) and errors (2, 8) of every piece, for a table of this tolerance."""
    chosen = _RULES[max((known for known in _RULES if known <= 1.01 * tolerance), default=min(_RULES))]
    found = []
    for piece, (nodes, *stated) in enumerate(chosen):
        errors = np.zeros((2, 8))
        for row, numbers in zip(errors, stated, strict=True):
            row[: len(numbers)] = numbers
        found.append((points(piece, nodes), errors))
    return found


def points(piece: int, nodes: int) -> Array:
    """The rule of a piece, (nodes, 2): the share of the piece beyond a node, and its weight."""
    p, q = _POWERS[piece]
    x, weight = np.polynomial.legendre.leggauss(nodes)
    t = 0.5 * (1.0 + x)
    # the share beyond is a polynomial in 1 - t, exact where it is small
    slope = Polynomial([0.0, 1.0]) ** (q - 1) * Polynomial([1.0, -1.0]) ** (p - 1)
    beyond = slope.integ() / slope.integ()(1.0)
    return np.ascontiguousarray(np.stack([beyond(1.0 - t), 0.5 * weight * beyond.deriv()(1.0 - t)], axis=1))


def put_rules(data: Data, tolerance: float) -> None:
    """Give the kernel its rules, once."""
    if not data.rules:
        data.put_rules(rules(tolerance))

"""The contact and the direction of the oscillation: what a case may be beside one spring that is
shaken across.

``contact="ball"`` is a sphere on a flat, Hertz under a constant load, as independent springs
(method of dimensionality reduction): mu~(v~, y~) = (3/2) int_0^1 s mu~_spring(v~/(1.5 s), y~/(1.5
s)) d xi with s = 1 - xi^2 and l0 = mu0 Fz / k, where k = 8 a G* is the stiffness before slip.
``direction="along"`` shakes along the sliding direction, ``"normal"`` the normal force, Fz +
Fz_amplitude cos(omega t).  The formulas are in ``kernel/contact.c`` and ``kernel/directions.c``;
here are the names.
"""

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.fields import FIELDS
from mumacro.kernel.arrays import Array

ContactName = Literal["spring", "ball"]
DirectionName = Literal["across", "along", "normal"]
#: in the order of the kernel's codes
CONTACTS: tuple[ContactName, ...] = ("spring", "ball")
DIRECTIONS: tuple[DirectionName, ...] = ("across", "along", "normal")
AMPLITUDE = "Fz_amplitude"  # of the normal force [N], in place of y0
# the fields of direction normal
_FORCED = tuple(AMPLITUDE if name == "y0" else name for name in FIELDS)
LIFTS_OFF = ">= 0 and below Fz: at Fz the contact lifts off"  # the bound of that amplitude


class Kind(NamedTuple):
    """A contact and a direction by their codes in the kernel."""

    contact: int
    direction: int

    @property
    def normal(self) -> bool:
        """Whether the normal force oscillates."""
        return DIRECTIONS[self.direction] == "normal"

    @property
    def fields(self) -> tuple[str, ...]:
        """The six inputs by name, :data:`mumacro.inputs.fields.FIELDS` with Fz_amplitude in place
        of y0 for normal."""
        return _FORCED if self.normal else FIELDS

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
            raise self.refused(
                InputError("y0", value, "", i if np.ndim(amplitude) or np.ndim(force) else None)
            )

    def refused(self, error: InputError) -> InputError:
        """``error`` by the name and the bound that the user knows."""
        if not self.normal or error.field != "y0":
            return error
        bound = "given [N] for direction normal" if error.value is None else LIFTS_OFF
        return InputError(AMPLITUDE, error.value, bound, error.index)

    def as_six(self, inputs: Mapping[str, Any]) -> dict[str, Any]:
        """Inputs with the amplitude in the place of y0; InputError for one that does not belong to
        the direction."""
        wrong, right = ("y0", AMPLITUDE) if self.normal else (AMPLITUDE, "y0")
        if wrong in inputs:
            word = DIRECTIONS[self.direction]
            raise InputError(
                wrong, inputs[wrong], f"left out for direction {word}, whose amplitude is {right}"
            )
        return {"y0" if name == AMPLITUDE else name: value for name, value in inputs.items()}

    def as_given(self, six: Mapping[str, Any]) -> dict[str, Any]:
        """The inputs of :meth:`as_six` by the user's names."""
        return {
            AMPLITUDE if name == "y0" and self.normal else name: value
            for name, value in six.items()
        }


SPRING = Kind(0, 0)
_KINDS: dict[tuple[str, str], Kind] = {
    (word, way): Kind(i, j) for i, word in enumerate(CONTACTS) for j, way in enumerate(DIRECTIONS)
}
del _KINDS["ball", "normal"]


def kind_of(contact: str = "spring", direction: str = "across") -> Kind:
    """The codes of a contact and a direction; InputError for unknown names and a ball whose normal
    force oscillates.

    >>> kind_of("ball", "along")
    Kind(contact=1, direction=1)
    """
    try:
        return _KINDS[contact, direction]
    except (KeyError, TypeError):
        pass  # the reason follows
    for name, value, known in (
        ("contact", contact, CONTACTS),
        ("direction", direction, DIRECTIONS),
    ):
        if not isinstance(value, str) or value not in known:
            raise InputError(name, value, f"one of {', '.join(known)}")
    told = (
        "across or along for a ball: a normal force that oscillates changes its contact "
        "radius, not modelled"
    )
    raise InputError("direction", direction, told)

"""The contact and the direction of the oscillation; one spring, shaken across, is the default.

``contact="ball"`` is a sphere on a flat, Hertz under a constant load, as independent springs
(method of dimensionality reduction): mu~(v~, y~) = (3/2) int_0^1 s mu~_spring(v~/(1.5 s), y~/(1.5
s)) d xi with s = 1 - xi^2 and l0 = mu0 Fz / k, where k = 8 a G* is the stiffness before slip.
``direction="along"`` shakes along the sliding direction, ``"normal"`` the normal force, Fz +
Fz_amplitude cos(omega t).  The formulas are in ``kernel/contact.c`` and ``kernel/directions.c``;
here are the names.
"""

from typing import Any, Literal, NamedTuple

from mumacro.errors import InputError
from mumacro.inputs.fields import FIELDS

ContactName = Literal["spring", "ball"]
DirectionName = Literal["across", "along", "normal"]
#: in the order of the kernel's codes
CONTACTS: tuple[ContactName, ...] = ("spring", "ball")
DIRECTIONS: tuple[DirectionName, ...] = ("across", "along", "normal")


class Springs(NamedTuple):
    """What is known of a contact's springs without an evaluation."""

    meaning: str
    exponent: float  #: k grows with this power of the load
    middle_load: float  #: load of the middle spring over the mean


#: by contact
SPRINGS_OF: dict[str, Springs] = {
    "spring": Springs("one spring of stiffness k", 0.0, 1.0),
    "ball": Springs("a ball (Hertz) with the initial stiffness k", 1.0 / 3.0, 1.5),
}
AMPLITUDE = "Fz_amplitude"  # of the normal force [N], in place of y0
AMPLITUDES = ("y0", AMPLITUDE)
# by code of the direction
_FIELDS = (
    FIELDS,
    FIELDS,
    tuple(AMPLITUDE if name == "y0" else name for name in FIELDS),
)


class Kind(NamedTuple):
    """A contact and a direction by their codes in the kernel."""

    contact: int
    direction: int

    @property
    def normal(self) -> bool:
        """Whether the normal force oscillates."""
        return DIRECTIONS[self.direction] == "normal"

    @property
    def amplitude(self) -> str:
        """The input that says how far it oscillates."""
        return AMPLITUDES[self.normal]

    @property
    def other_amplitude(self) -> str:
        """The input that says so for other directions."""
        return AMPLITUDES[not self.normal]

    @property
    def fields(self) -> tuple[str, ...]:
        """The six inputs by name, :data:`mumacro.inputs.fields.FIELDS` with Fz_amplitude in place
        of y0 for normal."""
        return _FIELDS[self.direction]

    @property
    def names(self) -> dict[str, Any]:
        """Both as the keywords of ``evaluate``."""
        return {"contact": CONTACTS[self.contact], "direction": DIRECTIONS[self.direction]}

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of columns that a table of cases may have."""
        return (*self.fields, "f")


SPRING, BALL = Kind(0, 0), Kind(1, 0)  # across
_KINDS: dict[tuple[str, str], Kind] = {
    (contact, direction): Kind(i, j)
    for j, direction in enumerate(DIRECTIONS)
    for i, contact in enumerate(CONTACTS)
}
del _KINDS["ball", "normal"]
#: all that there are
KINDS = (*_KINDS.values(),)


def kind_of(contact: str = "spring", direction: str = "across") -> Kind:
    """Return the codes of a contact and a direction; InputError for unknown names and a ball whose
    normal force oscillates.

    >>> kind_of("ball", "along")
    Kind(contact=1, direction=1)
    """
    try:
        return _KINDS[contact, direction]
    except (KeyError, TypeError):
        pass  # the reason follows
    for name, value, names in (
        ("contact", contact, CONTACTS),
        ("direction", direction, DIRECTIONS),
    ):
        if not isinstance(value, str) or value not in names:
            raise InputError(name, value, f"one of {', '.join(names)}")
    bound = (
        "across or along for a ball: a normal force that oscillates changes its contact "
        "radius, not modelled"
    )
    raise InputError("direction", direction, bound)

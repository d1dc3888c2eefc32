"""List the geometries of :mod:`mumacro.stiffness` by name, with arguments, units and meaning.

Command line, service and page derive their fields from :data:`GEOMETRIES` and :data:`ARGUMENTS`.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from mumacro.errors import InputError
from mumacro.inputs.case import read_one
from mumacro.inputs.cases import real
from mumacro.inputs.doubts import UNITS
from mumacro.inputs.names import unknown_name
from mumacro.results import REMARK, Note
from mumacro.stiffness import (
    AXES,
    Contact,
    Material,
    flat_punch,
    hertz_ball,
    hertz_cylinder,
)


class Argument(NamedTuple):
    """Describe one argument: SI unit, meaning, an example as a person writes it; for a choice its
    only values."""

    unit: str
    meaning: str
    example: str
    choices: tuple[str, ...] = ()


class Geometry(NamedTuple):
    """Describe one geometry: its function, its meaning, and its own arguments (apart from those of
    the two bodies)."""

    function: Callable[..., Contact]
    meaning: str
    arguments: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of all arguments that it takes, including alternatives."""
        instead = (INSTEAD[name] for name in self.arguments if name in INSTEAD)
        return (*self.arguments, *instead, *BODIES)


ARGUMENTS = {
    "radius": Argument("m", "radius of ball, pin or cylinder; of two balls 1/(1/R1 + 1/R2)", "5mm"),
    "diameter": Argument("m", "in place of the radius: twice as much", "10mm"),
    "length": Argument("m", "length of the cylinder", "10mm"),
    "Fz": Argument("N", "normal force", "10N"),
    "oscillation": Argument(
        "", "how the contact oscillates beside the axis of the cylinder", AXES[0], AXES
    ),
    "E": Argument("Pa", "Young's modulus of the first body; rigid, or a number", "210GPa"),
    "nu": Argument("-", "its Poisson's ratio", "0.3"),
    "E2": Argument(
        "Pa",
        "Young's modulus of the second body; left out, the bodies are of one material",
        "70GPa",
    ),
    "nu2": Argument("-", "its Poisson's ratio; left out, that of the first body", "0.33"),
}
#: arguments of every geometry; the first two are required
BODIES = ("E", "nu", "E2", "nu2")
#: pairs of arguments of which one replaces the other
INSTEAD = {"radius": "diameter"}
#: lengths that bodies usually have [m]
_USUAL = 1e-6, 0.5
GEOMETRIES = {
    "ball": Geometry(hertz_ball, "a ball on a flat, or two balls", ("radius", "Fz")),
    "flat": Geometry(
        flat_punch,
        "a flat circular end in full contact, such as a pin that has run in",
        ("radius", "Fz"),
    ),
    "cylinder": Geometry(
        hertz_cylinder, "a lying cylinder", ("radius", "length", "Fz", "oscillation")
    ),
}


def contact_of(geometry: str, /, **arguments: Any) -> Contact:
    """Return the contact of one of :data:`GEOMETRIES`, from its arguments and those of the bodies
    in SI.

    Its notes have the warnings, and remarks on lengths that are unusual for a body.  Raise
    InputError for an unknown geometry, and for an argument that is missing, unknown, not a number
    or out of bounds.

    >>> contact_of("ball", radius=5e-3, Fz=10.0, E=210e9, nu=0.3).contact
    'ball'
    """
    contact = _contact(geometry, **arguments)
    return replace(contact, notes=(*contact.notes, *doubts_of(arguments)))


def _contact(geometry: str, **arguments: Any) -> Contact:
    """Return the contact without the remarks on its lengths."""
    if geometry not in GEOMETRIES:
        raise InputError("geometry", geometry, f"one of {', '.join(GEOMETRIES)}")
    entry = GEOMETRIES[geometry]
    names = entry.names
    for name, value in arguments.items():
        if name not in names:
            raise InputError(name, value, f"left out: {unknown_name(name, names)}")
        if not ARGUMENTS[name].choices and real(name, value).ndim:
            raise InputError(name, value, "one number")
    for name, other in INSTEAD.items():
        if name in arguments and other in arguments:
            raise InputError(other, arguments[other], f"left out beside {name}")
    if "diameter" in arguments:
        return _of_diameter(geometry, **arguments)
    if absent := next(
        (name for name in (*entry.arguments, "E", "nu") if name not in arguments), None
    ):
        unit = ARGUMENTS[absent].unit
        words = f"{ARGUMENTS[absent].meaning}"
        if absent in INSTEAD:
            words += f"; or {INSTEAD[absent]}"
        raise InputError(absent, None, f"given{f' [{unit}]' if unit else ''}: {words}")
    first = Material(arguments["E"], arguments["nu"])
    second = Material(arguments.get("E2", first.E), arguments.get("nu2", first.nu))
    return entry.function(
        first=first, second=second, **{name: arguments[name] for name in entry.arguments}
    )


def _of_diameter(geometry: str, diameter: float, **arguments: Any) -> Contact:
    """Return the contact of a ball, pin or cylinder from its diameter."""
    try:
        return _contact(geometry, radius=0.5 * diameter, **arguments)
    except InputError as error:
        if error.field != "radius":
            raise
        raise InputError("diameter", diameter, f"twice a radius that is {error.bound}") from None


def doubts_of(arguments: Mapping[str, Any]) -> list[Note]:
    """Return a question for each length of a geometry that is unusual for a body.

    >>> [doubt.text for doubt in doubts_of({"radius": 5.0})]
    ['radius = 5 m: is it 5 mm? Usual is 1e-06 to 0.5 m']
    """
    least, most = _USUAL
    remarks: list[Note] = []
    for name in ("radius", "diameter", "length"):
        value = arguments.get(name)
        if value is None or least <= value <= most:
            continue
        question = f"is it {value:.6g} mm?" if value > most else "is it in metres?"
        text = f"{name} = {value:.6g} m: {question} Usual is {least:g} to {most:g} m"
        remarks.append(Note(REMARK, text, UNITS, name))
    return remarks


def read_argument(name: str, text: str) -> Any:
    """Return the value of an argument in SI from a text; ``rigid`` is an infinite modulus.

    >>> read_argument("E", "210 GPa"), read_argument("radius", "5mm"), read_argument("E2", "rigid")
    (210000000000.0, 0.005, inf)
    """
    return text.strip() if ARGUMENTS[name].choices else read_one(name, text)

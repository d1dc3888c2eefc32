"""The geometries of :mod:`mumacro.stiffness` by name, with arguments, units and meaning.

Command line, service and page derive their fields from :data:`GEOMETRIES` and :data:`ARGUMENTS`.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from mumacro.errors import InputError
from mumacro.inputs.cases import real
from mumacro.inputs.names import unknown_name
from mumacro.inputs.reading import read_one
from mumacro.stiffness import (
    AXES,
    Contact,
    Material,
    flat_punch,
    hertz_ball,
    hertz_cylinder,
)


class Argument(NamedTuple):
    """One argument: SI unit, meaning, a value as a person writes it; its only values, for a
    choice."""

    unit: str
    meaning: str
    example: str
    choices: tuple[str, ...] = ()


class Geometry(NamedTuple):
    """One geometry: its function, its meaning, and its own arguments beside those of the two
    bodies."""

    function: Callable[..., Contact]
    meaning: str
    arguments: tuple[str, ...]


ARGUMENTS = {
    "radius": Argument("m", "radius of ball, pin or cylinder; of two balls 1/(1/R1 + 1/R2)", "5mm"),
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
    """The contact of one of :data:`GEOMETRIES`, from its arguments and those of the bodies in SI.

    Its warnings are in it.  InputError for an unknown geometry, and an argument that is missing,
    unknown, no number or out of bounds.

    >>> contact_of("ball", radius=5e-3, Fz=10.0, E=210e9, nu=0.3).contact
    'ball'
    """
    if geometry not in GEOMETRIES:
        raise InputError("geometry", geometry, f"one of {', '.join(GEOMETRIES)}")
    entry = GEOMETRIES[geometry]
    names = (*entry.arguments, *BODIES)
    for name, value in arguments.items():
        if name not in names:
            raise InputError(name, value, f"left out: {unknown_name(name, names)}")
        if not ARGUMENTS[name].choices and real(name, value).ndim:
            raise InputError(name, value, "one number")
    if absent := next(
        (name for name in (*entry.arguments, "E", "nu") if name not in arguments), None
    ):
        unit = ARGUMENTS[absent].unit
        raise InputError(
            absent, None, f"given{f' [{unit}]' if unit else ''}: {ARGUMENTS[absent].meaning}"
        )
    first = Material(arguments["E"], arguments["nu"])
    second = Material(arguments.get("E2", first.E), arguments.get("nu2", first.nu))
    return entry.function(
        first=first, second=second, **{name: arguments[name] for name in entry.arguments}
    )


def read_argument(name: str, text: str) -> Any:
    """The value of an argument in SI from text; ``rigid`` is an infinite modulus.

    >>> read_argument("E", "210 GPa"), read_argument("radius", "5mm"), read_argument("E2", "rigid")
    (210000000000.0, 0.005, inf)
    """
    return text.strip() if ARGUMENTS[name].choices else read_one(name, text)

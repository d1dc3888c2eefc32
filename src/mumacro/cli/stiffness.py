"""Run ``mumacro stiffness``: print k of a contact from materials and geometry."""

import argparse
from collections.abc import Mapping, Sequence
from typing import Any

from mumacro.cli import common
from mumacro.cli.common import OneLineParser, UsageError, as_json
from mumacro.inputs.case import read_one
from mumacro.stiffness import (
    ARGUMENTS,
    BODIES,
    GEOMETRIES,
    INSTEAD,
    MATERIALS,
    Material,
    contact_of,
)


def _example(geometry: str) -> str:
    """Return an example of a command that gives a result."""
    names = (*GEOMETRIES[geometry].arguments, *BODIES[:2])
    options = (f"--{name} {ARGUMENTS[name].example}" for name in names)
    return " ".join(("mumacro stiffness", geometry, *options))


EXAMPLE = _example("ball")


_NAMES = ", ".join(MATERIALS)


def _of_materials(options: argparse.Namespace, arguments: Mapping[str, Any]) -> dict[str, float]:
    """Return E and nu of the bodies whose material is named.  Raise UsageError if the command also
    has a number for one of them."""
    numbers: dict[str, float] = {}
    for suffix in ("", "2"):
        name = getattr(options, f"material{suffix}")
        if name is None:
            continue
        for argument in (f"E{suffix}", f"nu{suffix}"):
            if argument in arguments:
                raise UsageError(f"--{argument}: leave it out beside --material{suffix}")
        body = Material(name)
        numbers |= {f"E{suffix}": body.E, f"nu{suffix}": body.nu}
    return numbers


def run(words: Sequence[str]) -> str:
    """Run ``mumacro stiffness``."""
    parser = OneLineParser(
        prog="mumacro stiffness",
        description="The tangential stiffness k of a contact from materials and geometry.",
        epilog=f"example:\n  {EXAMPLE}\n\nThe arguments of each: mumacro stiffness ball --help.",
    )
    parts = parser.add_subparsers(dest="geometry", required=True, metavar="GEOMETRY")
    for name, geometry in GEOMETRIES.items():
        part = parts.add_parser(
            name,
            help=geometry.meaning,
            description=f"k of {geometry.meaning}.",
            epilog=f"example:\n  {_example(name)}",
        )
        required = {*geometry.arguments} - INSTEAD.keys()
        for argument_name in geometry.names:
            argument = ARGUMENTS[argument_name]
            unit = f" [{argument.unit}]" if argument.unit else ""
            part.add_argument(
                f"--{argument_name}",
                required=argument_name in required,
                choices=argument.choices or None,
                help=f"{argument.meaning}{unit}",
            )
        for number, which in (("", "first"), ("2", "second")):
            text = f"of the {which} body, in place of E{number} and nu{number}: {_NAMES}"
            part.add_argument(f"--material{number}", metavar="NAME", help=text)
        common.add_options(part, "json")
    options = parser.parse_args(words)
    names = GEOMETRIES[options.geometry].names
    arguments = {name: text for name in names if (text := getattr(options, name)) is not None}
    texts = {name: text for name, text in arguments.items() if not ARGUMENTS[name].choices}
    arguments |= zip(texts, common.read_values(texts.items(), read_one), strict=True)
    arguments |= _of_materials(options, arguments)
    contact = contact_of(options.geometry, **arguments)
    if options.json:
        return as_json({"geometry": options.geometry, **contact.to_dict()})
    option = "" if contact.contact == "spring" else f" --contact {contact.contact}"
    paste = ("paste", f"k={contact.k:.4g}{option}")
    return common.in_full(contact, ("contact", contact.contact), paste)

"""Tell how the program understood the inputs of a request: ``include=inputs``, for the page and for
logs."""

import math
from collections.abc import Mapping
from typing import Any

from mumacro.errors import InputError
from mumacro.inputs.case import read
from mumacro.inputs.fields import INPUTS, QUANTITY_OF, RIGID
from mumacro.inputs.units import QUANTITIES
from mumacro.motions.motion import PARTS
from mumacro.motions.oscillation import read_oscillation
from mumacro.stiffness import ARGUMENTS

UNDERSTOOD = "inputs"  # the name in include


def is_wanted(members: Mapping[str, Any]) -> bool:
    """Return whether a request asks for it; its members may be of any type."""
    include = members.get("include")
    return include == UNDERSTOOD or (
        isinstance(include, (list, tuple, set)) and UNDERSTOOD in include
    )


def understood(members: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return each input that can be read: its text, its value in SI, the unit in the text or else
    the SI unit, and its deviation or interval if it has one.  An input that is refused is left out.

    >>> understood({"k": "1 ± 0.1 N/um", "target": "15 %"})["target"]
    {'text': '15 %', 'value': 0.15, 'unit': '%'}
    """
    along = members.get("along", "v0")
    of_ends = QUANTITY_OF[along] if isinstance(along, str) and along in INPUTS else ""
    quantities = {name: field.quantity for name, field in INPUTS.items()}
    quantities |= {"start": of_ends, "stop": of_ends, "target": "ratio"}
    if "geometry" in members:  # of a contact; its modulus may be rigid
        quantities |= {name: QUANTITY_OF[name] for name in ARGUMENTS if name in QUANTITY_OF}
    inputs: dict[str, dict[str, Any]] = {}
    for name, quantity in quantities.items():
        try:
            if quantity and (one := _of(name, members.get(name), quantity)) is not None:
                inputs[name] = one
            deviation = _of(name, members.get(f"std_{name}"), quantity)
            if name in inputs and deviation is not None:
                inputs[name]["std"] = deviation["value"]
        except InputError:
            continue
    for name in PARTS:
        if (part := _part(name, members.get(name))) is not None:
            inputs[name] = part
    return inputs


def _part(name: str, value: Any) -> dict[str, Any] | None:
    """Return an oscillation of a motion: the amplitude of its first harmonic, and all harmonics."""
    if value is None:
        return None
    try:
        parts = read_oscillation(name, tuple(value) if _is_pair(value) else value)
    except InputError:
        return None
    members = ("harmonic", "amplitude", "phase")
    return {
        "text": value if isinstance(value, str) else None,
        "value": parts[0][1],
        "unit": QUANTITIES[QUANTITY_OF[name]].unit,
        "harmonics": [dict(zip(members, part, strict=True)) for part in parts],
    }


def _is_pair(value: Any) -> bool:
    """Return whether a list of JSON is an amplitude and its phase."""
    return isinstance(value, list) and len(value) == 2 and not isinstance(value[0], dict)


def _of(name: str, value: Any, quantity: str) -> dict[str, Any] | None:
    """Return one value, or None if there is none.  Raise InputError if it cannot be read."""
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        return None
    one, unit = read(name, value, quantity), QUANTITIES[quantity].unit
    number = RIGID if math.isinf(one.si) else one.si
    entry: dict[str, Any] = {"text": one.text, "value": number, "unit": one.unit or unit}
    parts = {"std": one.std, "low": one.low, "high": one.high}
    return entry | {part: x for part, x in parts.items() if x is not None}

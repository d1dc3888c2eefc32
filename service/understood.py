"""What was understood of the inputs of a request: ``include=inputs``, for the page and for logs."""

import math
from collections.abc import Mapping
from typing import Any

from mumacro.errors import InputError
from mumacro.inputs.fields import INPUTS, RIGID
from mumacro.inputs.reading import read

UNDERSTOOD = "inputs"  # the name in include


def is_wanted(members: Mapping[str, Any]) -> bool:
    """Whether a request asks for it; its members may be of any type."""
    include = members.get("include")
    return isinstance(include, (list, tuple, set)) and UNDERSTOOD in include


def understood(members: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Each input that can be read: its text, its value in SI, the unit that was typed or the SI
    unit; the deviation and the ends of an interval where it has them.  An input that is refused is
    left out."""
    inputs: dict[str, dict[str, Any]] = {}
    for name, field in INPUTS.items():
        try:
            one = _of(name, members.get(name))
            if one is not None:
                inputs[name] = {**one, "unit": one["unit"] or field.unit}
            deviation = _of(name, _deviation(members, name))
            if name in inputs and deviation is not None:
                inputs[name]["std"] = deviation["value"]
        except InputError:
            continue
    ends = members.get("k_range")
    if isinstance(ends, (list, tuple)) and len(ends) == 2:
        try:
            low, high = (_of("k", end) for end in ends)
        except InputError:
            return inputs
        if low and high and all(isinstance(end["value"], float) for end in (low, high)):
            middle = math.sqrt(low["value"]) * math.sqrt(high["value"])
            inputs["k"] = {"text": None, "value": middle, "unit": low["unit"] or "N/m"}
            inputs["k"] |= {"low": low["value"], "high": high["value"]}
    return inputs


def _deviation(members: Mapping[str, Any], name: str) -> Any:
    std = members.get("std")
    within = std.get(name) if isinstance(std, Mapping) else None
    return members.get(f"std_{name}") if within is None else within


def _of(name: str, value: Any) -> dict[str, Any] | None:
    """One value, None where there is none; InputError where it cannot be read."""
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        return None
    one = read(name, value)
    number = RIGID if math.isinf(one.si) else one.si
    entry: dict[str, Any] = {"text": one.text, "value": number, "unit": one.unit}
    more = {"std": one.std, "low": one.low, "high": one.high}
    return entry | {part: x for part, x in more.items() if x is not None}

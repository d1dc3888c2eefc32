"""The types of values: a number in SI, or a text as the library reads it, such as ``"1 N/um"``.

A text is checked here, so that all faults of a request are told at once, and is handed to the
library as it came: what it says beside its number, a deviation or an interval, is not lost.
"""

import math
from collections.abc import Callable
from typing import Annotated, Any

from pydantic import Field, ValidationInfo, WithJsonSchema, WrapValidator
from pydantic_core import PydanticCustomError

from mumacro.errors import InputError
from mumacro.inputs.fields import ABOVE_ZERO, INPUTS, MOST_HZ, QUANTITY_OF
from mumacro.inputs.reading import read, reason_of
from mumacro.inputs.units import QUANTITIES

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Hertz = Annotated[float, Field(ge=0, le=MOST_HZ, allow_inf_nan=False)]
RIGID = {"const": "rigid", "type": "string"}


def fault(reason: str) -> PydanticCustomError:
    """The error of a value, in the words of the library."""
    return PydanticCustomError("input", "{reason}", {"reason": reason})


def _checked(value: Any, number: Callable[[Any], float], info: ValidationInfo) -> Any:
    """A number as it is, and a text that the library can read."""
    if type(value) is not str:
        return number(value)
    name = (info.field_name or "").removeprefix("std_")
    try:
        one = read(name, value)
    except InputError as error:
        raise fault(reason_of(error.bound)) from None
    if not (math.isinf(one.si) and QUANTITY_OF[name] in ("stiffness", "pressure")):
        number(one.si)
    return value


def _in_si(value: Any, number: Callable[[Any], float], info: ValidationInfo) -> Any:
    """A number in SI from a number or a text, where deviations and intervals mean nothing."""
    if type(value) is not str:
        return number(value)
    _checked(value, number, info)
    one = read(info.field_name or "", value)
    if one.std is not None or one.low is not None:
        raise fault("must be one number without a deviation")
    return one.si


def text_schema(quantity: str, positive: bool) -> dict[str, Any]:
    """The JSON Schema of a text, for clients: the library reads more than its pattern."""
    digits = r"[1-9][0-9]{0,8}" if positive else r"[0-9]{1,9}"
    units = [
        unit for unit in QUANTITIES[quantity].units if unit.isascii() and unit.strip("-1%") == unit
    ]
    of_unit = f" ?({'|'.join(unit for unit in units if unit)})" if any(units) else " ?%"
    return {"type": "string", "pattern": rf"^{digits}(\.[0-9]{{1,9}})?({of_unit})?$"}


def _schema(name: str, positive: bool) -> dict[str, Any]:
    sign = "exclusiveMinimum" if positive else "minimum"
    number: dict[str, Any] = {"type": "number", sign: 0}
    if QUANTITY_OF[name] == "frequency":
        number["maximum"] = MOST_HZ
    kinds = [number, text_schema(QUANTITY_OF[name], positive)]
    if QUANTITY_OF[name] in ("stiffness", "pressure") and positive:
        kinds.append(RIGID)
    return {"anyOf": kinds}


def value_of(name: str) -> Any:
    """The type of an input: a number in SI, or a text, which stays one."""
    positive = INPUTS[name].bound == ABOVE_ZERO
    number = Positive if positive else Hertz if name == "f" else NotNegative
    return Annotated[number, WrapValidator(_checked), WithJsonSchema(_schema(name, positive))]


def deviation_of(name: str) -> Any:
    """The type of a standard deviation of an input, in its unit."""
    number = Hertz if name == "f" else NotNegative
    return Annotated[number, WrapValidator(_checked), WithJsonSchema(_schema(name, False))]


def number_of(name: str, number: Any, positive: bool) -> Any:
    """The type of another argument, in SI from a number or a text."""
    return Annotated[number, WrapValidator(_in_si), WithJsonSchema(_schema(name, positive))]

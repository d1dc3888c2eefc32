"""Define the types of values: a number in SI, or a text as the library reads it, such as ``"1
N/um"``.

A text is checked here, so that all faults of a request are reported at once.  It is then given to
the library unchanged, because it may hold more than a number: a deviation or an interval.
"""

import math
from collections.abc import Callable
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema, WrapValidator
from pydantic_core import PydanticCustomError

from mumacro.errors import InputError
from mumacro.inputs.case import read, reason_of
from mumacro.inputs.fields import ENDS, MOST_HZ, QUANTITY_OF
from mumacro.inputs.units import QUANTITIES

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Hertz = Annotated[float, Field(ge=0, le=MOST_HZ, allow_inf_nan=False)]
RIGID_SCHEMA = {"const": "rigid", "type": "string"}
#: a number as text; the library accepts more than this pattern
PLAIN_TEXT = {"type": "string", "pattern": r"^[0-9]{1,9}(\.[0-9]{1,9})?$"}


#: one name instead of a list with one name
OR_ONE = BeforeValidator(lambda value: [value] if isinstance(value, str) else value)


def fault(reason: str) -> PydanticCustomError:
    """Return the error of a value, in the words of the library."""
    return PydanticCustomError("input", "{reason}", {"reason": reason})


def _checked(value: Any, number: Callable[[Any], float], info: ValidationInfo) -> Any:
    """Return a number unchanged, or a text that the library can read."""
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
    """Return a number in SI from a number or a text; a deviation or an interval is refused."""
    if type(value) is not str:
        return number(value)
    _checked(value, number, info)
    one = read(info.field_name or "", value)
    if one.std is not None or one.low is not None:
        raise fault("must be one number without a deviation")
    return one.si


def text_schema(quantity: str, positive: bool) -> dict[str, Any]:
    """Return the JSON Schema of a text, for clients; the library accepts more than its pattern."""
    digits = r"[1-9][0-9]{0,8}" if positive else r"[0-9]{1,9}"
    about = QUANTITIES[quantity]
    units = about.such_as.replace(":", ",").replace(";", ",").split(", ")
    of_unit = f" ?({'|'.join(unit for unit in units if unit in about.units)})"
    return {"type": "string", "pattern": rf"^{digits}(\.[0-9]{{1,9}})?({of_unit})?$"}


def _schema(
    name: str, positive: bool, example: float | None = None, rigid: bool = True
) -> dict[str, Any]:
    sign = "exclusiveMinimum" if positive else "minimum"
    number: dict[str, Any] = {"type": "number", sign: 0}
    if QUANTITY_OF[name] == "frequency":
        number["maximum"] = MOST_HZ
    kinds = [number, text_schema(QUANTITY_OF[name], positive)]
    if rigid and QUANTITY_OF[name] in ("stiffness", "pressure") and positive:
        kinds.append(RIGID_SCHEMA)
    return {"anyOf": kinds, **({} if example is None else {"examples": [example]})}


def _is(name: str, positive: bool, example: float | None = None, **bounds: bool) -> WithJsonSchema:
    return WithJsonSchema(_schema(name, positive, example, **bounds))


_CHECKED, _IN_SI = WrapValidator(_checked), WrapValidator(_in_si)
# values of inputs: a text stays a text
Friction = Annotated[Positive, _CHECKED, _is("mu0", True, 0.3)]
Force = Annotated[Positive, _CHECKED, _is("Fz", True, 10.0)]
Stiffness = Annotated[Positive, _CHECKED, _is("k", True, 1e6)]
#: stiffness of an elastic contact; an end of an interval replaces k, so the example of a whole
#: request has none
StiffnessEnd = Annotated[Positive, _CHECKED, _is("k", True, rigid=False)]
Amplitude = Annotated[NotNegative, _CHECKED, _is("y0", False, 2e-6)]
ForceAmplitude = Annotated[NotNegative, _CHECKED, _is("Fz_amplitude", False)]
AngularFrequency = Annotated[NotNegative, _CHECKED, _is("omega", False)]
Frequency = Annotated[Hertz, _CHECKED, _is("f", False, 20e3)]
Speed = Annotated[NotNegative, _CHECKED, _is("v0", False, 0.01)]
#: in a law, which sweeps v0 unless the request names another input, so the example has no v0
OtherSpeed = Annotated[NotNegative, _CHECKED, _is("v0", False)]
#: a standard deviation, in the unit of its input
Deviation = Annotated[
    NotNegative,
    _CHECKED,
    WithJsonSchema({"anyOf": [{"type": "number", "minimum": 0}, PLAIN_TEXT]}),
]
_END: Any = {"anyOf": [{"type": "number", "minimum": 0}, PLAIN_TEXT]}
#: an end of a range; the library reads a text with the input to which it belongs
End = Annotated[
    NotNegative,
    WrapValidator(lambda value, number: value if type(value) is str else number(value)),
    WithJsonSchema(_END),
]
# ends of a law; the schema holds their examples, because FastAPI drops those of a query's field
Start = Annotated[End, WithJsonSchema({**_END, "examples": [1e-4]})]
Stop = Annotated[End, WithJsonSchema({**_END, "examples": [10.0]})]
# other arguments, in SI: a text becomes a number
Length = Annotated[Positive, _IN_SI, _is("radius", True)]
Modulus = Annotated[Positive, _IN_SI, _is("E", True)]
Load = Annotated[Positive, _IN_SI, _is("Fz", True)]
#: a fraction or a coefficient, which may be in per cent
Ratio = Annotated[
    float,
    Field(allow_inf_nan=False),
    _IN_SI,
    WithJsonSchema({"anyOf": [{"type": "number"}, text_schema("ratio", False)]}),
]


def stiffness_inputs(k: str) -> dict[str, Any]:
    """Return the inputs that a checked text gives: k, infinite for a rigid contact, or both ends of
    it."""
    one = read("k", k)
    if one.low is not None:
        return dict(zip(ENDS, (one.low, one.high), strict=True))
    return {"k": math.inf if one.si == math.inf else k}

"""The inputs of one case, and of many in columns: meaning, unit, bound and example of each.

Bounds of one input are checked here; relations between inputs (omega or f, k or an interval of it,
the amplitude of the direction) are the library's, which refuses them when it is asked.
"""

import math
import sys
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainValidator,
    ValidationInfo,
    WithJsonSchema,
)

from mumacro.errors import InputError
from mumacro.inputs.cases import A_DEVIATION, AN_END, DEVIATIONS, EXACT, one_word
from mumacro.inputs.fields import BOUNDS, ENDS, MOST_HZ, POSITIVE, described, refusal
from mumacro.inputs.kind import ContactName, DirectionName
from mumacro.inputs.reading import Value, no_number, read, reason_of

from .values import (
    PLAIN_TEXT,
    POSITIVE_TEXT,
    RIGID,
    Amplitude,
    AngularFrequency,
    Force,
    ForceAmplitude,
    Frequency,
    Friction,
    OtherSpeed,
    Speed,
    Stiffness,
    StiffnessEnd,
    fault,
    stiffness_inputs,
)

#: what a case may hold, in the order in which it is described
INPUTS = (
    "mu0",
    "Fz",
    "k",
    "y0",
    "omega",
    "f",
    "v0",
    "Fz_amplitude",
    "k_low",
    "k_high",
)
#: the first case of the documentation: mu_macro = 0.2405
EXAMPLE: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 20e3, "v0": 0.01}
MAX_REASONS = 1000  # bad cases of a batch that are listed

Name = Literal["mu0", "Fz", "k", "y0", "omega", "f", "v0", "Fz_amplitude"]
OR_RIGID = [{"type": "number", "exclusiveMinimum": 0}, RIGID]


NULL = {"type": "null"}


def optional(description: str, **more: Any) -> Any:
    """A member that may be left out; null says the same, but for a query, which has none."""
    return Field(None, description=description, json_schema_extra=_or_null, **more)


def either(description: str, **more: Any) -> Any:
    """A member that another one may stand for; null is refused."""
    return Field(None, description=description, json_schema_extra=without_null, **more)


def without_null(schema: dict[str, Any]) -> None:
    """Describe a member that is no null."""
    schema.pop("default", None)
    kinds = [kind for kind in schema.pop("anyOf", [schema]) if kind != NULL]
    schema |= kinds[0] if len(kinds) == 1 else {"anyOf": kinds}


def _or_null(schema: dict[str, Any]) -> None:
    without_null(schema)
    about = {name: schema.pop(name) for name in ("title", "description") if name in schema}
    examples = {"examples": schema.pop("examples")} if "examples" in schema else {}
    kinds = schema.pop("anyOf", None) or [{**schema}]
    schema.clear()
    schema |= about | {"anyOf": [*kinds, NULL]} | examples


class Strict(BaseModel):
    """A model with its own members only, each of its own type."""

    model_config = ConfigDict(extra="forbid", strict=True)


_K = described("k", '; "rigid" in a text; it must be given, here or as an interval')
_MU0, _FZ, _V0 = described("mu0"), described("Fz"), described("v0")
_OMEGA = described("omega", "; omega or f is required")
_F = described("f", ", in place of omega")
_LOW, _HIGH = described("k_low"), described("k_high")
_Y0 = described("y0", ", across or along; required, unless the direction is normal")
_AMPLITUDE = described("Fz_amplitude", ": for direction normal in place of y0")


def _given_together(*names: str) -> dict[str, Any]:
    """The schema of members that are all given: there, and no null."""
    return {"required": [*names], "properties": {name: {"not": NULL} for name in names}}


def one_of(*names: str) -> dict[str, Any]:
    """The schema of alternatives: exactly one of these members is given."""
    return {"oneOf": [_given_together(name) for name in names]}


def not_both(one: str, other: str) -> dict[str, Any]:
    """The schema of two members of which one at most is given."""
    return {"not": _given_together(one, other)}


def both_or_none(one: str, other: str) -> dict[str, Any]:
    """The schema of two members of which each needs the other."""
    neither = {"not": {"anyOf": [_given_together(one), _given_together(other)]}}
    return {"anyOf": [_given_together(one, other), neither]}


ONE_FREQUENCY = one_of("omega", "f")
#: what is given of every case, beside what is always required
ALTERNATIVES: Any = {
    "allOf": [
        one_of("k", "k_low"),
        one_of("y0", "Fz_amplitude"),
        ONE_FREQUENCY,
        both_or_none("k_low", "k_high"),
    ]
}
#: the same of a case whose unknown or swept input is left out
NOT_BOTH: Any = {
    "allOf": [
        not_both("k", "k_low"),
        not_both("y0", "Fz_amplitude"),
        not_both("omega", "f"),
    ]
}


class CaseInputs(Strict):
    """One case, in SI units; omega or f, and k or an interval of it: exactly one of each."""

    model_config = ConfigDict(json_schema_extra={"examples": [EXAMPLE], **ALTERNATIVES})

    mu0: Friction = Field(description=_MU0, examples=[0.3])
    Fz: Force = Field(description=_FZ, examples=[10.0])
    k: Stiffness = either(_K, examples=[1e6])
    y0: Amplitude | None = optional(_Y0, examples=[2e-6])
    omega: AngularFrequency | None = optional(_OMEGA)
    f: Frequency | None = optional(_F, examples=[20e3])
    v0: Speed = Field(description=_V0, examples=[0.01])
    Fz_amplitude: ForceAmplitude | None = optional(_AMPLITUDE)
    k_low: StiffnessEnd | None = optional(_LOW)
    k_high: StiffnessEnd | None = optional(_HIGH)

    @property
    def inputs(self) -> dict[str, Any]:
        """Those that are given, by name; a rigid contact is infinite."""
        return _given(self)


class OtherInputs(Strict):
    """The inputs of a question about one of them, which is left out or null."""

    mu0: Friction | None = optional(_MU0, examples=[0.3])
    Fz: Force | None = optional(_FZ, examples=[10.0])
    k: Stiffness | None = optional(_K, examples=[1e6])
    y0: Amplitude | None = optional(_Y0, examples=[2e-6])
    omega: AngularFrequency | None = optional(_OMEGA)
    f: Frequency | None = optional(_F, examples=[20e3])
    v0: OtherSpeed | None = optional(_V0)
    Fz_amplitude: ForceAmplitude | None = optional(_AMPLITUDE)
    k_low: StiffnessEnd | None = optional(_LOW)
    k_high: StiffnessEnd | None = optional(_HIGH)

    @property
    def inputs(self) -> dict[str, Any]:
        """Those that are given, by name; a rigid contact is infinite, and a null in k stays."""
        inputs = _given(self)
        if self.k is None and "k" in self.model_fields_set:
            inputs["k"] = None
        return inputs


def _given(model: BaseModel) -> dict[str, Any]:
    """The inputs that are given, by name; an interval in k by both of its ends."""
    values = model.__dict__
    inputs = {name: values[name] for name in INPUTS if values.get(name) is not None}
    return inputs | stiffness_inputs(inputs.pop("k")) if type(inputs.get("k")) is str else inputs


# --- columns --------------------------------------------------------------------------------------


class Column(NamedTuple):
    """One input of many cases: numbers, NaN where there is none, with deviations and ends of
    intervals where entries have some; and why there is none, by the index of the case."""

    value: Value
    reasons: Mapping[int, str]


_LEAST = {name: 5e-324 if name in POSITIVE else 0.0 for name in BOUNDS}
_LEAST |= dict.fromkeys(DEVIATIONS, 0.0)
_MOST = dict.fromkeys(_LEAST, sys.float_info.max) | {"f": MOST_HZ}
_NUMBERS = frozenset((float, int))
_ONE_NUMBER = dict.fromkeys(ENDS, AN_END) | dict.fromkeys(DEVIATIONS, A_DEVIATION)


def entry(name: str, value: object) -> tuple[Value, str | None]:
    """The value of an input and None, or NaN and the reason why it is none."""
    if isinstance(value, str):
        try:
            one = read(name.removeprefix("std_"), value)
        except InputError as error:
            return _NO_VALUE, reason_of(error.bound)
        if (of := _ONE_NUMBER.get(name)) and (one.std is not None or one.low is not None):
            return _NO_VALUE, reason_of(of)
        if name == "k" and one.si == math.inf:
            return one, None
    elif type(value) in _NUMBERS:
        try:
            one = Value(float(value))  # type: ignore[arg-type]
        except OverflowError:
            one = Value(math.inf)
    else:
        return _NO_VALUE, no_number(name, value)
    if _LEAST[name] <= one.si <= _MOST[name]:
        return one, None
    return _NO_VALUE, refusal(name, one.si) if name in BOUNDS else f"must be {EXACT}"


_NO_VALUE = Value(math.nan)


def column(name: str, values: Sequence[Any]) -> Column:
    """A list as a column.  A number beyond double range is never a rigid contact."""
    if _NUMBERS.issuperset(map(type, values)):
        try:
            array = np.array(values, np.float64)
        except OverflowError:
            array = np.array([math.inf])
        if np.isfinite(array).all():
            return Column(Value(array), {})
    read_values, reasons = [], dict[int, str]()
    for i, value in enumerate(values):
        one, reason = entry(name, value)
        read_values.append(one)
        if reason is not None and len(reasons) < MAX_REASONS:
            reasons[i] = reason
    si = np.array([one.si for one in read_values], np.float64)
    std = low = high = None
    if any(one.std is not None for one in read_values):
        std = np.array([one.std or 0.0 for one in read_values])
    if any(one.low is not None for one in read_values):  # a number is an interval of itself
        low = np.array([one.si if one.low is None else one.low for one in read_values])
        high = np.array([one.si if one.high is None else one.high for one in read_values])
    return Column(Value(si, std, low, high), reasons)


_ALWAYS = ("mu0", "Fz", "k", "v0")  # where null is refused


def cells(name: str, value: Any) -> float | str | Column | None:
    """A number or a text for all cases, or a list or an array with one for each."""
    if isinstance(value, list):
        return column(name, value)
    if isinstance(value, np.ndarray):  # finite numbers
        return Column(Value(value), {})
    if isinstance(value, Value):  # of rows
        return Column(value, {})
    if value is None and name not in _ALWAYS:
        return None
    one, reason = entry(name, value)
    if reason is not None:
        raise fault(reason)
    return value if isinstance(value, str) else float(one.si)


def _of_cases(value: Any, info: ValidationInfo) -> float | str | Column | None:
    return cells(info.field_name or "", value)


def _one_word(value: Any, info: ValidationInfo) -> Any:
    """Return the one word that a list of words holds, and another value as it is."""
    if not isinstance(value, list) or not all(isinstance(word, str) for word in value):
        return value
    try:
        return one_word(info.field_name or "", value)
    except InputError as error:
        raise fault(reason_of(error.bound)) from None


def _or_listed(one: dict[str, Any], *texts: dict[str, Any]) -> WithJsonSchema:
    """One value for all cases, which ``texts`` describe, too, or a list of any, where a bad entry
    spoils its case only."""
    several = {"type": "array", "items": {"anyOf": [one, {"type": "string"}, NULL]}}
    return WithJsonSchema({"anyOf": [one, *texts, several]})


_CELLS = PlainValidator(_of_cases)
_ABOVE_ZERO: Any = {"type": "number", "exclusiveMinimum": 0}
_FROM_ZERO: Any = {"type": "number", "minimum": 0}
PositiveColumn = Annotated[Any, _CELLS, _or_listed(_ABOVE_ZERO, POSITIVE_TEXT)]
NotNegativeColumn = Annotated[Any, _CELLS, _or_listed(_FROM_ZERO, PLAIN_TEXT)]
HertzColumn = Annotated[Any, _CELLS, _or_listed({**_FROM_ZERO, "maximum": MOST_HZ}, PLAIN_TEXT)]
StiffnessColumn = Annotated[Any, _CELLS, _or_listed(_ABOVE_ZERO, POSITIVE_TEXT, RIGID)]


DeviationColumn = Annotated[Any, _CELLS, _or_listed(_FROM_ZERO, PLAIN_TEXT)]
#: one for all cases; a list of one word repeated is that word
ContactColumn = Annotated[ContactName, BeforeValidator(_one_word)]
DirectionColumn = Annotated[DirectionName, BeforeValidator(_one_word)]


class InputColumns(Strict):
    """Cases in columns: lists of one length, and a plain number holds for every case.

    An entry that is no legal number spoils its own case only.
    """

    mu0: PositiveColumn = Field(description=_MU0)
    Fz: PositiveColumn = Field(description=_FZ)
    k: StiffnessColumn = either(described("k", '; "rigid" in a text; or k_low and k_high'))
    y0: NotNegativeColumn = optional(described("y0"))
    omega: NotNegativeColumn = optional(described("omega", "; or f"))
    f: HertzColumn = optional(_F)
    v0: NotNegativeColumn = Field(description=_V0)
    Fz_amplitude: NotNegativeColumn = optional(_AMPLITUDE)
    k_low: PositiveColumn = optional(_LOW)
    k_high: PositiveColumn = optional(_HIGH)

    @property
    def columns(self) -> dict[str, Any]:
        """What is given, by name."""
        values = self.__dict__
        return {name: x for name in INPUTS if (x := values[name]) is not None}

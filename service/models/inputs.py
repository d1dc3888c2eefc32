"""Define the inputs of one case, and of many cases in columns: meaning, unit, bound and example of
each.

The bounds of one input are checked here.  The library checks relations between inputs (omega or f,
k or its interval, the amplitude of the direction) when it evaluates.
"""

import math
import sys
from contextlib import suppress
from typing import Annotated, Any, Literal

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
from mumacro.inputs.case import no_number, reason_of
from mumacro.inputs.cases import DEVIATIONS, EXACT, one_word
from mumacro.inputs.columns import Column, Fault
from mumacro.inputs.fields import (
    BOUNDS,
    MOST_HZ,
    POSITIVE,
    ContactName,
    DirectionName,
    described,
    is_rigid,
    refusal,
)
from mumacro.kernel.arrays import Array

from .values import (
    RIGID_SCHEMA,
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

#: members of a case, in the order of the description
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
MAX_REASONS = 1000  # largest number of bad cases of a batch that are listed

Name = Literal["mu0", "Fz", "k", "y0", "omega", "f", "v0", "Fz_amplitude"]
OR_RIGID = [{"type": "number", "exclusiveMinimum": 0}, RIGID_SCHEMA]


NULL = {"type": "null"}


def optional(description: str, **keywords: Any) -> Any:
    """Return a member that may be left out; null means the same, except in a query, which has no
    null."""
    return Field(None, description=description, json_schema_extra=_or_null, **keywords)


def either(description: str, **keywords: Any) -> Any:
    """Return a member that another member may replace; null is refused."""
    return Field(None, description=description, json_schema_extra=without_null, **keywords)


def without_null(schema: dict[str, Any]) -> None:
    """Change the schema of a member so that it excludes null."""
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
    """Accept only a model's own members, each of its own type."""

    model_config = ConfigDict(extra="forbid", strict=True)


_K = described("k", '; "rigid" in a text; it must be given, here or as an interval')
_MU0, _FZ, _V0 = described("mu0"), described("Fz"), described("v0")
_OMEGA = described("omega", "; omega or f is required")
_F = described("f", ", in place of omega")
_LOW, _HIGH = described("k_low"), described("k_high")
_Y0 = described("y0", ", across or along; required, unless the direction is normal")
_AMPLITUDE = described("Fz_amplitude", ": for direction normal in place of y0")


def _given_together(*names: str) -> dict[str, Any]:
    """Return the schema for members that must all be there and not null."""
    return {"required": [*names], "properties": {name: {"not": NULL} for name in names}}


def one_of(*names: str) -> dict[str, Any]:
    """Return the schema of alternatives: exactly one of these members is there."""
    return {"oneOf": [_given_together(name) for name in names]}


def not_both(one: str, other: str) -> dict[str, Any]:
    """Return the schema of two members of which at most one is there."""
    return {"not": _given_together(one, other)}


def both_or_none(one: str, other: str) -> dict[str, Any]:
    """Return the schema of two members that need each other."""
    neither = {"not": {"anyOf": [_given_together(one), _given_together(other)]}}
    return {"anyOf": [_given_together(one, other), neither]}


ONE_FREQUENCY = one_of("omega", "f")
#: members of every case, in addition to the ones that are always required
ALTERNATIVES: Any = {
    "allOf": [
        one_of("k", "k_low"),
        one_of("y0", "Fz_amplitude"),
        ONE_FREQUENCY,
        both_or_none("k_low", "k_high"),
    ]
}
#: the same for a case whose unknown or swept input is left out
NOT_BOTH: Any = {
    "allOf": [
        not_both("k", "k_low"),
        not_both("y0", "Fz_amplitude"),
        not_both("omega", "f"),
    ]
}


class _Inputs(Strict):
    """Members of which some are inputs."""

    @property
    def inputs(self) -> dict[str, Any]:
        """Return the inputs that are there, by name; a rigid contact is infinite, and an interval
        in k becomes its two ends."""
        values = self.__dict__
        inputs = {name: values[name] for name in INPUTS if values.get(name) is not None}
        if type(inputs.get("k")) is str:
            inputs |= stiffness_inputs(inputs.pop("k"))
        return inputs


class CaseInputs(_Inputs):
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


class OtherInputs(_Inputs):
    """Inputs of a question about one of them, which is left out or null."""

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
        """Return the inputs that are there, by name; a rigid contact is infinite, and a null in k
        stays."""
        inputs = super().inputs
        if self.k is None and "k" in self.model_fields_set:
            inputs["k"] = None
        return inputs


# --- columns --------------------------------------------------------------------------------------


_LEAST = {name: 5e-324 if name in POSITIVE else 0.0 for name in BOUNDS}
_LEAST |= dict.fromkeys(DEVIATIONS, 0.0)
_MOST = dict.fromkeys(_LEAST, sys.float_info.max) | {"f": MOST_HZ}
_NUMBERS = frozenset((float, int))
_NO_TEXTS = "must be numbers: a column has no texts; a text with a unit is for one case"


def entry(name: str, value: object) -> tuple[float, str | None]:
    """Return the number of an input and None, or NaN and the reason why there is no number."""
    if type(value) in _NUMBERS:
        try:
            number = float(value)  # type: ignore[arg-type]
        except OverflowError:
            number = math.inf
        if _LEAST[name] <= number <= _MOST[name]:
            return number, None
        return math.nan, refusal(name, number) if name in BOUNDS else f"must be {EXACT}"
    if name == "k" and is_rigid(value):
        return math.inf, None
    if name == "k" and isinstance(value, str):
        return math.nan, "must be a number, or the word rigid, and no other text"
    return math.nan, no_number(name, value)


_ALWAYS = ("mu0", "Fz", "k", "v0")  # these refuse null


def cells(value: Any, info: ValidationInfo) -> float | Array | Column | None:
    """Return one number for all cases, or a column with a number for each.  A list has a gap with a
    reason where it holds no legal number.

    A number beyond double range never becomes a rigid contact.
    """
    name = info.field_name or ""
    if isinstance(value, np.ndarray) or (value is None and name not in _ALWAYS):
        return value
    if not isinstance(value, list):
        number, reason = entry(name, value)
        if reason is not None:
            raise fault(reason)
        return number
    if _NUMBERS.issuperset(map(type, value)):
        with suppress(OverflowError):
            array = np.array(value, np.float64)
            if np.isfinite(array).all():
                return array
    if all(isinstance(one, str) and not (name == "k" and is_rigid(one)) for one in value):
        raise fault(_NO_TEXTS)
    numbers, gaps = np.empty(len(value)), dict[int, Fault]()
    for i, one in enumerate(value):
        numbers[i], reason = entry(name, one)
        if reason is not None and len(gaps) < MAX_REASONS:
            gaps[i] = Fault(one, reason)
    return Column(numbers, faults=gaps)


def _one_word(value: Any, info: ValidationInfo) -> Any:
    """Return the word if a list has the same word everywhere; return any other value unchanged."""
    if not isinstance(value, list) or not all(isinstance(word, str) for word in value):
        return value
    try:
        return one_word(info.field_name or "", value)
    except InputError as error:
        raise fault(reason_of(error.bound)) from None


def _or_listed(one: dict[str, Any], *texts: dict[str, Any]) -> WithJsonSchema:
    """Return the schema of one number for all cases (``texts`` describe it, too), or of a list of
    any values, where a bad entry affects only its case."""
    several = {"type": "array", "items": {"anyOf": [one, {"type": "string"}, NULL]}}
    return WithJsonSchema({"anyOf": [one, *texts, several]})


_CELLS = PlainValidator(cells)
_ABOVE_ZERO: Any = {"type": "number", "exclusiveMinimum": 0}
_FROM_ZERO: Any = {"type": "number", "minimum": 0}
PositiveColumn = Annotated[Any, _CELLS, _or_listed(_ABOVE_ZERO)]
NotNegativeColumn = Annotated[Any, _CELLS, _or_listed(_FROM_ZERO)]
HertzColumn = Annotated[Any, _CELLS, _or_listed({**_FROM_ZERO, "maximum": MOST_HZ})]
StiffnessColumn = Annotated[Any, _CELLS, _or_listed(_ABOVE_ZERO, RIGID_SCHEMA)]


DeviationColumn = Annotated[Any, _CELLS, _or_listed(_FROM_ZERO)]
#: one word for all cases; a list that repeats one word is this word
ContactColumn = Annotated[ContactName, BeforeValidator(_one_word)]
DirectionColumn = Annotated[DirectionName, BeforeValidator(_one_word)]


class InputColumns(Strict):
    """Cases in columns: lists of one length; a plain number is the same for every case.

    A bad entry affects only its own case.
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

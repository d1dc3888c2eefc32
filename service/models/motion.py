"""Define the request for a periodic motion, and the answer with its steady cycle."""

from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    WithJsonSchema,
    WrapValidator,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from mumacro.errors import InputError
from mumacro.inputs.case import read_one, reason_of
from mumacro.inputs.fields import MOST_HZ, QUANTITY_OF, ContactName, described
from mumacro.motions.motion import TOLERANCES
from mumacro.motions.oscillation import MOST_HARMONIC, WHOLE, read_oscillation

from .answers import REMARKS, Number, Numbers, Remark, Understood, quantity, understood_inputs
from .inputs import EXAMPLE, ONE_FREQUENCY, Strict, either, optional
from .values import (
    AngularFrequency,
    Force,
    Frequency,
    Friction,
    NotNegative,
    Speed,
    StiffnessEnd,
    fault,
    text_schema,
)

MAX_TERMS = 10  # largest number of harmonics in one part of the motion
# the highest harmonic and the smallest tolerance of a ball, because each of its hundreds of springs
# follows every turn of the motion
MOST_OF_A_BALL, LEAST_OF_A_BALL = 20, 1e-7
MOTIONS_OF_A_SEARCH = 150  # approximate number of motions that solve_motion computes
# costs, see service/admission.py: measured with random motions, right within a factor of 10
_COST, _COST_OF_A_TERM, _SPRINGS_OF_A_BALL = 4000.0, 400.0, 250.0


def _whole(number: Any) -> Any:
    if type(number) in (int, float) and 1 <= number <= MOST_HARMONIC and number == int(number):
        return int(number)
    raise PydanticCustomError("input", "{reason}", {"reason": f"must be {WHOLE}"})


_Harmonic = Annotated[
    int,
    BeforeValidator(_whole),
    WithJsonSchema({"type": "integer", "minimum": 1, "maximum": MOST_HARMONIC}),
]
# the library gives the reason
_POSITIVE = WithJsonSchema({"type": "number", "exclusiveMinimum": 0})
_HERTZ = WithJsonSchema({"type": "number", "exclusiveMinimum": 0, "maximum": MOST_HZ})
_Degrees = Annotated[float, Field(allow_inf_nan=False)]


class Harmonic(Strict):
    """amplitude sin(harmonic omega t + phase)."""

    harmonic: _Harmonic = Field(1, description="Times the frequency")
    amplitude: NotNegative = Field(description="Half of peak to peak [m]; of normal [N]")
    phase: _Degrees = Field(0.0, description="[degrees]")


_Pair = Annotated[tuple[NotNegative, _Degrees], Field(strict=False)]
_Listed = Annotated[list[Harmonic], Field(max_length=MAX_TERMS)]
_STRICT = ConfigDict(strict=True)
_AMPLITUDE: Any = TypeAdapter(NotNegative, config=_STRICT)
_PAIR: Any = TypeAdapter(_Pair, config=_STRICT)
_LISTED: Any = TypeAdapter(_Listed)
_HARMONIC: Any = TypeAdapter(Harmonic)
_Text = Annotated[str, WithJsonSchema(text_schema("length", False))]


def _of_its_form(value: Any, _: Any, info: ValidationInfo) -> Any:
    """Return the oscillation as the library takes it. (A union would report the faults of every
    form.)"""
    name = info.field_name or ""
    if isinstance(value, str):
        try:
            return read_oscillation(name, value)
        except InputError as error:
            raise fault(reason_of(error.bound)) from None
    if isinstance(value, dict):
        one = _HARMONIC.validate_python(_with_numbers(name, value, ()))
        return [(one.harmonic, one.amplitude, one.phase)]
    if not isinstance(value, list):
        return _AMPLITUDE.validate_python(value)
    if value and not isinstance(value[0], dict):
        return _PAIR.validate_python(_pair_of_numbers(name, value))
    parts = [
        _with_numbers(name, part, (i,)) if isinstance(part, dict) else part
        for i, part in enumerate(value[: MAX_TERMS + 1])
    ]
    return [(one.harmonic, one.amplitude, one.phase) for one in _LISTED.validate_python(parts)]


def _pair_of_numbers(name: str, pair: list[Any]) -> list[Any]:
    """Return an amplitude and its phase as numbers, also if they are texts."""
    numbers = [*pair]
    for i, kind in enumerate((QUANTITY_OF[name], "angle")[: len(pair)]):
        if isinstance(pair[i], str):
            numbers[i] = _number(name, pair[i], kind, (i,))
    return numbers


def _number(name: str, text: str, kind: str, place: tuple[str | int, ...]) -> float:
    """Return the number of a text in SI; refuse a bad text with its place within the
    oscillation."""
    try:
        return read_one(name, text, kind)
    except InputError as error:
        reason = InitErrorDetails(type=fault(reason_of(error.bound)), loc=place, input=text)
        raise ValidationError.from_exception_data(name, [reason]) from None


def _with_numbers(name: str, part: dict[str, Any], place: tuple[int, ...]) -> dict[str, Any]:
    """Return a part in which amplitude and phase are numbers, also if they are texts such as "2um"
    and "90 deg"."""
    numbers = dict(part)
    for member, kind in (("amplitude", QUANTITY_OF[name]), ("phase", "angle")):
        if isinstance(part.get(member), str):
            numbers[member] = _number(name, part[member], kind, (*place, member))
    return numbers


Oscillation = Annotated[
    NotNegative | _Text | Harmonic | _Pair | _Listed, WrapValidator(_of_its_form)
]
FORMS = (
    'an amplitude, half of peak to peak; a text such as "2um@90deg"; an amplitude with its phase '
    f"in degrees; or a list of harmonics, at most {MAX_TERMS}. Left out: none"
)


def cost_of(contact: str, *parts: Any) -> float:
    """Return the cost of a motion, see :mod:`service.admission`: the number of terms times the
    turns of the highest harmonic."""
    terms = [one for part in parts if isinstance(part, list) for one in part]
    plain = sum(isinstance(part, (float, tuple)) for part in parts)
    highest: int = max([1, *(harmonic for harmonic, *_ in terms)])
    cost = _COST + _COST_OF_A_TERM * highest * (1 + plain + len(terms))
    return cost * (_SPRINGS_OF_A_BALL if contact == "ball" else 1.0)


class MotionRequest(Strict):
    """A contact that is dragged along x and shaken in x, y and normally, all with one period."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    **{name: x for name, x in EXAMPLE.items() if name != "y0"},
                    "x": {"amplitude": 1e-6, "phase": 90.0},
                    "y": "2um",
                }
            ],
            "allOf": [ONE_FREQUENCY],
        }
    )

    mu0: Friction = Field(description=described("mu0"))
    Fz: Force = Field(description=described("Fz", ", its mean"))
    k: StiffnessEnd = Field(
        description=described("k", ": here a number; a rigid contact is the limit of a large one")
    )
    omega: Annotated[AngularFrequency, _POSITIVE] | None = optional(
        described("omega", ", that of the period; omega or f is required")
    )
    f: Annotated[Frequency, _HERTZ] | None = optional(
        described("f", ", that of the period, in place of omega")
    )
    v0: Speed = Field(description=described("v0", ", of the drag along x"))
    x: Oscillation | None = optional(f"Oscillation along the drag [m]: {FORMS}")
    y: Oscillation | None = optional(f"Oscillation across it [m]: {FORMS}")
    normal: Oscillation | None = optional(
        f"Oscillation of the normal force [N], not of a ball: {FORMS}"
    )
    contact: ContactName = Field(
        "spring",
        description="One spring, or a ball on a flat (Hertz) under a constant normal force, with "
        f"harmonics up to {MOST_OF_A_BALL} and a tolerance from {LEAST_OF_A_BALL:g}",
    )
    tolerance: Annotated[float, Field(ge=TOLERANCES[0], le=TOLERANCES[1])] = Field(
        1e-6, description="Of the mean force over mu0 Fz"
    )
    cycle: bool = Field(False, description="Whether the answer has one period of the forces")
    include: Annotated[list[Literal["inputs"]], Field(max_length=16)] = either(
        "More to answer: inputs (what was understood of them)"
    )

    @model_validator(mode="after")
    def _within_the_time(self) -> Self:
        if self.contact == "ball":
            if self.tolerance < LEAST_OF_A_BALL:
                raise InputError(
                    "tolerance", self.tolerance, f">= {LEAST_OF_A_BALL:g} for a ball over HTTP"
                )
            for name in ("x", "y"):
                part = getattr(self, name)
                if isinstance(part, list) and any(n > MOST_OF_A_BALL for n, *_ in part):
                    bound = f"of harmonics up to {MOST_OF_A_BALL} for a ball over HTTP"
                    raise InputError(name, None, bound)
        return self

    @property
    def cost(self) -> float:
        """Return the cost of the answer, see :mod:`service.admission`."""
        return cost_of(self.contact, self.x, self.y, self.normal)

    @property
    def case(self) -> dict[str, Any]:
        """Return the arguments of ``mumacro.motion`` that are there."""
        values = self.__dict__
        of_answer = ("cycle", "include")
        return {name: x for name, x in values.items() if name not in of_answer and x is not None}


class CycleColumns(BaseModel):
    """One steady period at equal times, both ends included."""

    t: list[float] = quantity("Time", "s")
    x: list[float] = quantity("Way of the upper point along, that of the drag included", "m")
    y: list[float] = quantity("Way of the upper point across", "m")
    Fx: Numbers = quantity("Force on it along", "N")
    Fy: Numbers = quantity("Force on it across", "N")
    Fz: list[float] = quantity("Normal force", "N")
    share: list[float] = quantity(
        "Size of the force along and across over mu0 Fz: 1 while a spring slips", "-"
    )


class MotionAnswer(BaseModel):
    """Steady cycle of a motion; it is computed without a table.

    A mean force may be negative.
    """

    mu_macro: float = quantity("Mean force along the drag over the mean normal force", "-")
    mu_lateral: float = quantity("Mean force along y over the mean normal force", "-")
    stick_fraction: float = quantity(
        "Share of the period during which the contact sticks; no error estimate", "-"
    )
    slip_path: Number = quantity("Path of the foot in a period; no error estimate", "m")
    power: Number = quantity("Mean power of the shaker in x and y", "W")
    power_drive: Number = quantity("Mean power of the drive, mu_macro Fz v0", "W")
    error_estimate: float = quantity("Estimated error of mu_macro and mu_lateral, no bound", "-")
    periods: Number = quantity(
        "Until a small disturbance has fallen to 1 %; null: infinite, nothing slips", "-"
    )
    contact: ContactName
    warnings: list[str] | None = Field(None, description="Only where the search gave up: why")
    remarks: list[Remark] | None = Field(None, description=REMARKS)
    cycle: CycleColumns | None = Field(None, description="Only if requested")
    inputs: dict[str, Understood] | None = understood_inputs()
    api_version: str

"""Define the bodies and queries of the questions: friction law, inverse problem, stiffness, fit."""

import math
from base64 import b64decode
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, get_args

import numpy as np
from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    PlainValidator,
    ValidationError,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import InitErrorDetails

from mumacro.errors import InputError
from mumacro.inputs.case import no_number, read_one, reason_of
from mumacro.inputs.cells import THOUSANDS
from mumacro.inputs.fields import MOST_HZ, QUANTITY_OF, STIFFNESS, described
from mumacro.inputs.layout import SEPARATORS, Dialect
from mumacro.motions.motion import PARTS
from mumacro.motions.solve_motion import UNKNOWNS
from mumacro.stiffness import GEOMETRIES

from .inputs import (
    EXAMPLE,
    NOT_BOTH,
    OR_RIGID,
    Name,
    OtherInputs,
    Strict,
    either,
    optional,
)
from .motion import FORMS, Oscillation
from .options import Choice, Deviations, Options
from .values import OR_ONE, End, Length, Load, Modulus, Ratio, Start, Stop, fault, text_schema

MAX_VALUES = 10_001  # largest number of values of a law
_OF_A_MOTION = ("mu0", "Fz", "k", "omega", "f", "v0", "contact")
_NOT_OF_A_MOTION = (
    "y0",
    "Fz_amplitude",
    "k_low",
    "k_high",
    "direction",
    "include",
    *Deviations.model_fields,
    "stiffness_exponent",
)
MAX_TARGETS = 10_000
MAX_POINTS = 1000  # largest number of points in a fit: scipy answers it within seconds

# JSON has only one type of number: in JSON and in a JSON Schema 55.0 is an integer
_AS_WHOLE = BeforeValidator(lambda n: int(n) if isinstance(n, float) and n.is_integer() else n)
_Whole = Annotated[int, Field(ge=2, le=MAX_VALUES), _AS_WHOLE]
_Exponent = Annotated[
    Ratio,
    Field(ge=0, le=1),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "minimum": 0, "maximum": 1},
                {"type": "string", "pattern": r"^0(\.[0-9]{1,9})?$"},
            ]
        }
    ),
]
_EXPONENT = (
    "For Fz only: k grows as Fz to this power, and Fz of the case is the load at which k holds; "
    "left out: 1/3 for a ball with Fz, else k is constant"
)


class Sweep(Strict):
    """The values of a law."""

    along: Name = Field("v0", description="The swept input, which is left out of the case")
    start: Start = Field(description="First value [SI], or with a unit; > 0 on a logarithmic scale")
    stop: Stop = Field(description="Last value [SI], or with a unit; > start")
    points: _Whole = Field(201, description="Number of values")
    scale: Literal["log", "linear"] = Field("log", description="Spacing of the values")
    stiffness_exponent: _Exponent | None = optional(_EXPONENT)

    @property
    def ends(self) -> tuple[float, float]:
        """Return both ends in the SI unit of the swept input."""
        quantity = QUANTITY_OF[self.along]
        return read_one("start", self.start, quantity), read_one("stop", self.stop, quantity)


_five = {name: value for name, value in EXAMPLE.items() if name != "v0"}
_without_y0 = {name: value for name, value in EXAMPLE.items() if name != "y0"}


class LawRequest(Options, Sweep, OtherInputs):
    """mu_macro over a range of one input."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{**_five, "start": 1e-4, "stop": 10.0, "points": 5}],
            **NOT_BOTH,
        }
    )


# its error names the field, so no schema of numbers >= 0 is needed
_TARGET: list[dict[str, Any]] = [{"type": "number"}, text_schema("ratio", False)]
if TYPE_CHECKING:
    Unknown = str
else:
    Unknown = Literal[(*get_args(Name), *(name for name in UNKNOWNS if "." in name))]


class SolveForRequest(Options, OtherInputs):
    """Which value of one input gives a wanted mu_macro; with x, y or normal for any motion."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{**_without_y0, "unknown": "y0", "target": 0.15}],
            **NOT_BOTH,
        }
    )

    unknown: Unknown = Field(
        description="The input to solve for, which is left out of the case; of a motion also the "
        "amplitude or the phase of a part"
    )
    target: Annotated[
        list[Ratio],
        Field(min_length=1, max_length=MAX_TARGETS),
        BeforeValidator(lambda value: value if isinstance(value, list) else [value]),
        WithJsonSchema(
            {
                "anyOf": [
                    *_TARGET,
                    {
                        "type": "array",
                        "items": {"anyOf": _TARGET},
                        "minItems": 1,
                        "maxItems": MAX_TARGETS,
                    },
                ]
            }
        ),
    ] = Field(
        description=f"Wanted value [-]: one, or a list of up to {MAX_TARGETS}; of a motion it may "
        "be negative"
    )
    quantity: Literal["mu_macro", "mu_ratio"] = Field(
        "mu_macro",
        description="What the target is; mu_ratio = mu_macro/mu0 (0.5 halves the friction)",
    )
    range: Annotated[list[End], Field(min_length=2, max_length=2)] | None = optional(
        "Where to search [SI], or with units, ascending; left out: wherever it changes mu_macro"
    )
    stiffness_exponent: _Exponent | None = optional(_EXPONENT)
    x: Oscillation | None = optional(f"Of a motion: oscillation along the drag [m]: {FORMS}")
    y: Oscillation | None = optional(f"Of a motion: oscillation across it [m]: {FORMS}")
    normal: Oscillation | None = optional(
        f"Of a motion: oscillation of the normal force [N], not of a ball: {FORMS}"
    )
    of: Literal["mu_macro", "mu_lateral"] | None = optional(
        "Of a motion: which mean force is the target; left out: mu_macro"
    )

    @property
    def is_motion(self) -> bool:
        """Return whether the question is about a motion."""
        of_motions = (getattr(self, name) for name in (*PARTS, "of"))
        return "." in self.unknown or any(part is not None for part in of_motions)

    @property
    def motion(self) -> dict[str, Any]:
        """Return the arguments of the motion.  Raise InputError for a member that a motion does not
        have."""
        values = {
            name: value
            for name in self.model_fields_set
            if (value := getattr(self, name)) is not None
        }
        # only inputs may be included: how the program understood them
        if not (self.outputs or self.model):
            values.pop("include", None)
        for name in _NOT_OF_A_MOTION:
            if name in values:
                raise InputError(name, None, "left out over a motion: x, y and normal say it")
        return {name: value for name, value in values.items() if name in (*_OF_A_MOTION, *PARTS)}


# --- stiffness ------------------------------------------------------------------------------------

_Poisson = Annotated[
    Ratio,
    Field(gt=-1, le=0.5),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "exclusiveMinimum": -1, "maximum": 0.5},
                {"type": "string", "pattern": r"^0(\.[0-4][0-9]{0,8})?$"},
            ]
        }
    ),
]
if TYPE_CHECKING:
    _Geometry = str
else:
    _Geometry = Literal[tuple(GEOMETRIES)]
_GEOMETRIES = "; ".join(f"{name}: {one.meaning}" for name, one in GEOMETRIES.items())


class StiffnessRequest(Strict):
    """Two bodies in contact, in SI units."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"geometry": "ball", "radius": 5e-3, "Fz": 10.0, "E": 210e9, "nu": 0.3}]
        }
    )

    geometry: _Geometry = Field(description=_GEOMETRIES)
    radius: Length | None = optional("Radius of the ball, pin or cylinder [m]; or diameter")
    diameter: Length | None = optional("In place of the radius: twice as much [m]")
    length: Length | None = optional("Length of the cylinder [m]; of: cylinder")
    Fz: Load | None = optional(described("Fz"))
    oscillation: Literal["across", "along"] | None = optional(
        "To the axis of the cylinder; of: cylinder"
    )
    E: Modulus = Field(description='Young\'s modulus of the first body [Pa], or "rigid"')
    nu: _Poisson = Field(description="Poisson's ratio of the first body [-]")
    E2: Modulus | None = optional("Of the second body [Pa]; left out, both are of one material")
    nu2: _Poisson | None = optional("Of the second body [-]")
    include: Annotated[list[Literal["inputs"]], Field(max_length=16), OR_ONE] = either(
        "More to answer: inputs (what was understood of them)"
    )


# --- fit ------------------------------------------------------------------------------------------


def _of_points(value: Any, info: ValidationInfo) -> Any:
    """Return a number, a text, or a list of them as an array in SI; the word rigid in k is
    infinite."""
    name = info.field_name or ""
    entries = value if isinstance(value, list) else [value]
    if len(entries) > MAX_POINTS:
        raise fault(f"may have up to {MAX_POINTS} points, this has {len(entries)}: average them")
    numbers = np.empty(len(entries))
    for i, entry in enumerate(entries):
        number, reason = _of_point(name, entry)
        if reason is not None:
            place = (i,) if isinstance(value, list) else ()
            raise ValidationError.from_exception_data(
                name, [InitErrorDetails(type=fault(reason), loc=place, input=entry)]
            )
        numbers[i] = number
    return numbers if isinstance(value, list) else numbers[0]


def _of_point(name: str, value: Any) -> tuple[float, str | None]:
    """Return one number in SI, or the reason why it is not a number."""
    if type(value) not in (int, float, str):
        return math.nan, no_number(name, value)
    try:
        number = read_one(name, value)
    except InputError as error:
        return math.nan, reason_of(error.bound)
    rigid = name == "k" and type(value) is str
    return number, None if math.isfinite(number) or rigid else "must be finite"


_LISTED = {
    "type": "array",
    "items": {"type": "number"},
    "minItems": 1,
    "maxItems": MAX_POINTS,
}


_POINTS = PlainValidator(_of_points)
PositivePoints = Annotated[
    Any,
    _POINTS,
    WithJsonSchema({"anyOf": [{"type": "number", "exclusiveMinimum": 0}, _LISTED]}),
]
NotNegativePoints = Annotated[
    Any, _POINTS, WithJsonSchema({"anyOf": [{"type": "number", "minimum": 0}, _LISTED]})
]
HertzPoints = Annotated[
    Any,
    _POINTS,
    WithJsonSchema({"anyOf": [{"type": "number", "minimum": 0, "maximum": MOST_HZ}, _LISTED]}),
]
StiffnessPoints = Annotated[Any, _POINTS, WithJsonSchema({"anyOf": [*OR_RIGID, _LISTED]})]
MeasuredPoints = Annotated[Any, _POINTS, WithJsonSchema(_LISTED)]


class FitRequest(Choice):
    """Measured points as columns, lists of one length, where a plain number holds for every point;
    or as a table, as it was pasted or as the bytes of its file."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "v0": [0.001, 0.003, 0.01, 0.03, 0.1, 0.3],
                    "mu_macro": [0.226, 0.23, 0.24, 0.26, 0.273, 0.282],
                    "Fz": 10.0,
                    "y0": 2e-6,
                    "f": 20e3,
                }
            ]
        }
    )

    unknowns: Annotated[list[Literal["k", "mu0"]], Field(min_length=1, max_length=2)] = Field(
        ["k", "mu0"], description="What is fitted; with a table left out: k alone where it has mu0"
    )
    v0: PositivePoints | None = optional(
        described("v0", " of each point; required without a table")
    )
    mu_macro: MeasuredPoints | None = optional(
        "Measured mu_macro of each point [-]; required without a table"
    )
    std: PositivePoints | None = optional("Standard deviation of mu_macro [-]")
    mu0: PositivePoints | None = optional(described("mu0", ", unless it is fitted"))
    Fz: PositivePoints | None = optional(described("Fz"))
    k: StiffnessPoints | None = optional(described("k", '; "rigid" in a text; unless it is fitted'))
    y0: NotNegativePoints | None = optional(described("y0"))
    omega: NotNegativePoints | None = optional(described("omega", "; or f"))
    f: HertzPoints | None = optional(described("f", ", in place of omega"))
    Fz_amplitude: NotNegativePoints | None = optional(
        described("Fz_amplitude", ": for direction normal in place of y0")
    )
    points: str | None = optional(
        "The points as a table: its header is the first line that names v0 and mu_macro, units "
        "stand in brackets or in the line below",
        examples=["v0 [mm/s]\tmu_macro\n1\t0.069\n5\t0.174\n20\t0.247\n100\t0.289\n"],
    )
    points_base64: str | None = optional("The bytes of the file of a table, in base64")
    sep: Literal[tuple(SEPARATORS)] | None = optional(  # type: ignore[valid-type]
        "Between the cells of the table; left out: found in it"
    )
    decimal: Literal[".", ","] | None = optional("In its numbers; left out: found in them")
    thousands: Literal[tuple(THOUSANDS)] | None = optional(  # type: ignore[valid-type]
        "Between the thousands of its numbers; left out: found in them"
    )
    encoding: Annotated[str, Field(max_length=40)] | None = optional(
        "Of the bytes, such as utf-8, utf-16, windows-1252; left out: found in them"
    )
    skip: Annotated[int, Field(ge=0, le=1_000_000), _AS_WHOLE] = Field(
        0, description="Lines to leave out at the beginning of the table"
    )
    read_only: bool = Field(False, description="Answer what was read of the table, without a fit")

    @model_validator(mode="after")
    def _refuse_what_contradicts(self) -> Self:
        for name in self.unknowns:
            if getattr(self, name) is not None:
                raise InputError(name, None, "left out: it is among the unknowns")
        other = self.kind.other_amplitude
        if getattr(self, other) is not None:
            raise InputError(other, None, f"left out for direction {self.direction}")
        if self.points is not None and self.points_base64 is not None:
            raise InputError("points_base64", None, "left out beside points")
        if self.points is not None and self.encoding is not None:
            raise InputError("encoding", None, "left out beside points, which are text already")
        if self.points is None and self.points_base64 is None:
            for column in ("v0", "mu_macro"):
                if getattr(self, column) is None:
                    raise InputError(column, None, "given: a list, or a table as points")
            for option in ("sep", "decimal", "thousands", "encoding", "skip", "read_only"):
                if option in self.model_fields_set and getattr(self, option) is not None:
                    raise InputError(option, None, "left out: it belongs to a table, points")
        return self

    @property
    def columns(self) -> dict[str, Any]:
        """Return the columns that are there, by name; a null in k stays, unless k is fitted."""
        columns = {name: value for name in _COLUMNS if (value := getattr(self, name)) is not None}
        if "k" in self.model_fields_set and self.k is None and "k" not in self.unknowns:
            raise InputError("k", None, STIFFNESS)
        return columns

    @property
    def table(self) -> tuple[str, bytes] | None:
        """Return the member that holds a table, and its bytes; None if there is no table."""
        if self.points is not None:
            return "points", self.points.encode("utf-8", "surrogatepass")
        if self.points_base64 is None:
            return None
        try:
            return "points_base64", b64decode(self.points_base64, validate=True)
        except ValueError:
            raise InputError("points_base64", None, "base64 of the bytes of a file") from None

    @property
    def dialect(self) -> Dialect:
        """Return how the table is written, as far as the request says."""
        return Dialect(
            None if self.sep is None else SEPARATORS[self.sep],
            self.decimal,
            None if self.thousands is None else THOUSANDS[self.thousands],
            "utf-8" if self.points is not None else self.encoding,
            self.skip,
            dashes="",
        )


_COLUMNS = ("v0", "mu_macro", "std", "mu0", "Fz", "k", "y0", "omega", "f", "Fz_amplitude")

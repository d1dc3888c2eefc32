"""Models of requests and answers: their legal values and their OpenAPI description."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    JsonValue,
    ModelWrapValidatorHandler,
    ValidationError,
    create_model,
    model_validator,
)
from pydantic_core import PydanticCustomError

from .hints import ONE_FREQUENCY, STATE_OMEGA, read_number
from .kernel import FIELDS, MOST_HZ, RAD_PER_CYCLE
from .quantities import QUANTITIES, Part

__all__ = [
    "INCLUDES", "MAX_INCLUDE", "Answered", "BatchColumns", "BatchFault", "BatchQuery", "Case", "CaseAnswer",
    "CaseQuery", "CaseRequest", "ColumnsAnswer", "Health", "InputStd", "NotNegative", "Options", "Positive", "Problem",
    "Result", "RowsAnswer", "Stiffness", "TableAnswer", "TableChoice", "TableLabel", "canonical",
    "check_std", "deviations", "examples", "relation", "split_names",
]  # fmt: skip

INCLUDES = tuple(QUANTITIES)
Include = Literal[INCLUDES]  # type: ignore[valid-type]
MAX_INCLUDE = 2 * len(INCLUDES)

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Frequency = Annotated[float, Field(ge=0, le=MOST_HZ, allow_inf_nan=False)]
#: null and "rigid" are rigid contact
Stiffness = Positive | Literal["rigid"] | None
IncludeList = Annotated[list[Include], Field(max_length=MAX_INCLUDE)]

_TEXTS = {
    "mu0": "Coulomb friction coefficient of the contact [-], finite and > 0",
    "Fz": "Normal force [N], finite and > 0",
    "k": "Tangential contact stiffness [N/m], finite and > 0; rigid contact must be stated",
    "y0": "Amplitude of the transverse oscillation [m], finite and >= 0",
    "omega": "Angular frequency of the oscillation [rad/s], finite and >= 0; or f in its place",
    "f": "Frequency of the oscillation [Hz], finite and >= 0; in place of omega",
    "v0": "Sliding velocity [m/s], finite and >= 0",
}
_INCLUDE = "More to compute: " + "; ".join(f"{name} ({entry.text})" for name, entry in QUANTITIES.items())
_TOLERANCE = "Wanted error of mu_macro/mu0 [-]: the smallest loaded table that meets it answers"
_STD = "Standard deviations of the inputs; required if include has std, refused otherwise"
_EXAMPLE: dict[str, JsonValue] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}


def examples(*found: Mapping[str, JsonValue]) -> ConfigDict:
    """Strict checks (``"0.3"`` and true are not numbers), no unknown fields, and examples."""
    return ConfigDict(strict=True, extra="forbid", json_schema_extra={"examples": [dict(case) for case in found]})


def relation(field: str, reason: str) -> PydanticCustomError:
    """A fault in the relation of several fields, and the field to change."""
    return PydanticCustomError("relation", "{field}: {reason}", {"field": field, "reason": reason})


class Case(BaseModel):
    """One case, in SI units; ``omega`` or ``f``, exactly one of them."""

    model_config = examples(_EXAMPLE)

    mu0: Positive = Field(description=_TEXTS["mu0"])
    Fz: Positive = Field(description=_TEXTS["Fz"])
    k: Stiffness = Field(description=f'{_TEXTS["k"]}: null or "rigid"')
    y0: NotNegative = Field(description=_TEXTS["y0"])
    omega: NotNegative | None = Field(None, description=_TEXTS["omega"])
    f: Frequency | None = Field(None, description=_TEXTS["f"])
    v0: NotNegative = Field(description=_TEXTS["v0"])

    def inputs(self) -> tuple[float, float, float, float, float, float]:
        """The six inputs in the order of FIELDS; k = inf is rigid contact."""
        k, omega = self.k, self.omega
        if omega is None:
            omega = RAD_PER_CYCLE * (self.f or 0.0)
        return self.mu0, self.Fz, k if isinstance(k, float) else math.inf, self.y0, omega, self.v0

    @model_validator(mode="wrap")
    @classmethod
    def _related(cls, value: Any, handler: ModelWrapValidatorHandler[Self]) -> Any:
        """Check a case and the relations between its fields; a missing frequency is reported with the other faults."""
        try:
            made = handler(value)
        except ValidationError as error:
            if not isinstance(value, dict) or (value.get("omega") is None) != (value.get("f") is None):
                raise
            entries: Any = [
                {"type": relation(**entry["ctx"]), "loc": entry["loc"], "input": entry["input"]}
                if entry["type"] == "relation"
                else {name: entry[name] for name in ("type", "loc", "input", "ctx") if name in entry}
                for entry in error.errors(include_url=False)
            ]
            entries.append({"type": frequency_fault(value.get("f") is not None), "loc": (), "input": None})
            raise ValidationError.from_exception_data(cls.__name__, entries) from None
        if (made.omega is None) == (made.f is None):
            raise frequency_fault(made.f is not None)
        return made


def frequency_fault(both: bool) -> PydanticCustomError:
    """The fault of a case with both omega and f, or with neither."""
    if both:
        return relation("f", ONE_FREQUENCY)
    return relation("omega", STATE_OMEGA)


class InputStd(BaseModel):
    """Standard deviations of the inputs, in their units; independent errors are assumed."""

    model_config = ConfigDict(strict=True, extra="forbid")

    mu0: NotNegative = Field(0.0, description="[-]")
    Fz: NotNegative = Field(0.0, description="[N]")
    k: NotNegative = Field(0.0, description="[N/m]; no effect on rigid contact")
    y0: NotNegative = Field(0.0, description="[m]")
    omega: NotNegative = Field(0.0, description="[rad/s]; or f in its place")
    f: Frequency = Field(0.0, description="[Hz]; in place of omega")
    v0: NotNegative = Field(0.0, description="[m/s]")

    @model_validator(mode="after")
    def _one_frequency(self) -> Self:
        if self.omega and self.f:
            raise relation("f", "give the standard deviation of omega or of f, not of both")
        return self


class Options(BaseModel):
    """The options of a request: everything but its cases."""

    model_config = ConfigDict(strict=True, extra="forbid")

    include: IncludeList | None = Field(None, description=_INCLUDE)
    tolerance: Positive | None = Field(None, description=_TOLERANCE)
    std: InputStd | None = Field(None, description=_STD)

    @model_validator(mode="after")
    def _std_where_asked(self) -> Self:
        check_std(self)
        return self

    def names(self) -> tuple[str, ...]:
        """Included names once each, in the order of the registry."""
        return canonical(self.include)


def check_std(form: Any) -> None:
    """Refuse standard deviations without ``std`` in ``include``, and ``std`` without standard deviations."""
    if (form.std is not None) != ("std" in (form.include or ())):
        raise relation(
            "std", "is required if include has std" if form.std is None else "has no effect unless include has std"
        )


def deviations(std: InputStd | None) -> dict[str, float]:
    """Standard deviations by name of the input, omega in place of f; empty if there are none."""
    if std is None:
        return {}
    found = {name: getattr(std, name) for name in FIELDS}
    found["omega"] += RAD_PER_CYCLE * std.f
    return found


def canonical(include: Any) -> tuple[str, ...]:
    """Names once each, in the order of the registry."""
    asked = set(include or ())
    return tuple(name for name in QUANTITIES if name in asked) if asked else ()


class CaseRequest(Options, Case):
    """One case and the options of its answer; ``omega`` or ``f``, exactly one of them."""


# --- queries ------------------------------------------------------------------------------------------

_Number = BeforeValidator(read_number)
QueryPositive = Annotated[float, Field(gt=0, allow_inf_nan=False), _Number]
QueryNotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False), _Number]
QueryFrequency = Annotated[float, Field(ge=0, le=MOST_HZ, allow_inf_nan=False), _Number]


def split_names(names: Any) -> Any:
    """``include=a,b`` and ``include=a&include=b`` are the same; an empty name is refused as unknown."""
    if isinstance(names, list) and all(isinstance(part, str) for part in names):
        return [part.strip() for name in names for part in name.split(",")]
    return names


QueryInclude = Annotated[list[Include], Field(min_length=1, max_length=MAX_INCLUDE), BeforeValidator(split_names)]


class BatchQuery(BaseModel):
    """Options as a query."""

    model_config = ConfigDict(strict=True, extra="forbid")

    include: QueryInclude = Field([], description=_INCLUDE)
    tolerance: QueryPositive | None = Field(None, description=_TOLERANCE)
    std_mu0: QueryNotNegative | None = Field(None, description="Standard deviation of mu0 [-]")
    std_Fz: QueryNotNegative | None = Field(None, description="Standard deviation of Fz [N]")  # noqa: N815
    std_k: QueryNotNegative | None = Field(None, description="Standard deviation of k [N/m]")
    std_y0: QueryNotNegative | None = Field(None, description="Standard deviation of y0 [m]")
    std_omega: QueryNotNegative | None = Field(None, description="Standard deviation of omega [rad/s]")
    std_f: QueryFrequency | None = Field(None, description="Standard deviation of f [Hz]")
    std_v0: QueryNotNegative | None = Field(None, description="Standard deviation of v0 [m/s]")

    def given(self) -> dict[str, Any]:
        """The options as :class:`Options` has them."""
        std = {name: getattr(self, f"std_{name}") for name in InputStd.model_fields}
        std = {name: value for name, value in std.items() if value is not None}
        found: dict[str, Any] = {"include": list(self.include) or None, "tolerance": self.tolerance, "std": std or None}
        return {name: value for name, value in found.items() if value is not None}


class CaseQuery(BatchQuery):
    """One case as a query; ``omega`` or ``f``, exactly one of them."""

    mu0: QueryPositive = Field(description=_TEXTS["mu0"], examples=[0.3])
    Fz: QueryPositive = Field(description=_TEXTS["Fz"], examples=[10.0])
    k: Annotated[Positive | Literal["rigid"], _Number] = Field(description=f"{_TEXTS['k']}: rigid", examples=[1e6])
    y0: QueryNotNegative = Field(description=_TEXTS["y0"], examples=[2e-6])
    omega: QueryNotNegative | None = Field(None, description=_TEXTS["omega"], examples=[1.3e5])
    f: QueryFrequency | None = Field(None, description=_TEXTS["f"])
    v0: QueryNotNegative = Field(description=_TEXTS["v0"], examples=[0.01])

    def case(self) -> CaseRequest:
        """The same case as a JSON body."""
        named = {name: getattr(self, name) for name in Case.model_fields}
        return CaseRequest.model_validate({**named, **self.given()})


class TableChoice(BaseModel):
    """Choice of a table: by id or by tolerance; with neither, the tightest."""

    model_config = ConfigDict(strict=True, extra="forbid")

    id: str | None = Field(None, description="Name of the table")
    tolerance: QueryPositive | None = Field(None, description=_TOLERANCE)

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if self.id is not None and self.tolerance is not None:
            raise relation("id", "choose by one id or by tolerance")
        return self


# --- batches ------------------------------------------------------------------------------------------

_COLUMNS: dict[str, JsonValue] = {**_EXAMPLE, "v0": [0.001, 0.01, 0.1], "Fz": [10.0, 20.0, 30.0]}


class BatchColumns(BaseModel):
    """A batch as columns: lists of one length; a plain number holds for every case."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [_COLUMNS]})

    mu0: Positive | list[float] = Field(description="[-], finite and > 0")
    Fz: Positive | list[float] = Field(description="[N], finite and > 0")
    k: Stiffness | list[float | Literal["rigid"] | None] = Field(description='[N/m]; null or "rigid": rigid contact')
    y0: NotNegative | list[float] = Field(description="[m], finite and >= 0")
    omega: NotNegative | list[float] | None = Field(None, description="[rad/s], finite and >= 0; or f in its place")
    f: Frequency | list[float] | None = Field(None, description="[Hz], finite and >= 0; in place of omega")
    v0: NotNegative | list[float] = Field(description="[m/s], finite and >= 0")
    include: IncludeList | None = Field(None, description=_INCLUDE)
    tolerance: Positive | None = Field(None, description=_TOLERANCE)
    std: InputStd | None = Field(None, description=_STD)


# --- answers ------------------------------------------------------------------------------------------


class TableLabel(BaseModel):
    """The table that an answer came from."""

    id: str = Field(description="Name of the table")
    tolerance: float = Field(description="The error of mu_macro/mu0 [-] that it was built to")


class Answered(BaseModel):
    """The fields of every answer."""

    table: TableLabel
    api_version: str


class _Default(BaseModel):
    """The default answer to one case."""

    mu_macro: float = Field(description="Macroscopic coefficient of friction [-]")
    mu_ratio: float = Field(description="mu_macro/mu0 [-], from 0 to 1")
    regime: Literal["continuous", "stick_slip", "static"] = Field(description="How the contact moves")
    error_bound: float | None = Field(description="Bound of the absolute error of mu_macro [-]")
    source: str = Field(description="Block of the table, or closed-form tail, that the value came from")


class _BatchEnd(Answered):
    errors: list["BatchFault"] = Field(description="One entry per bad case, in order; the first 1000 of them")
    n_errors: int = Field(description="Number of bad cases, listed or not")


class _DefaultColumns(_BatchEnd):
    mu_macro: list[float | None]
    mu_ratio: list[float | None]
    regime: list[str | None]
    error_bound: list[float | None]
    source: list[str | None]


class BatchFault(BaseModel):
    """Why one case of a batch has no result."""

    index: int = Field(description="Position in the batch, from 0")
    field: str | None = Field(description="The bad field; null when the case as a whole is bad")
    reason: str


def _title(name: str) -> str:
    return "".join(word.capitalize() for word in name.split("_"))


def _included(listed: bool) -> dict[str, Any]:
    """Members that the registry of quantities adds to a model of an answer."""
    members: dict[str, list[Part]] = {}
    texts = {}
    for quantity in QUANTITIES.values():
        for part in quantity.parts:
            name = part.path.partition(".")[0]
            members.setdefault(name, []).append(part)
            texts[name] = quantity.text

    def kind(part: Part) -> Any:
        return (list[part.kind | None] if listed else part.kind) | None  # type: ignore[name-defined]

    fields: dict[str, Any] = {}
    for name, parts in members.items():
        only = "Only if requested"
        if "." not in parts[0].path:
            fields[name] = (kind(parts[0]), Field(None, description=f"{only}. {parts[0].text} [{parts[0].unit}]"))
            continue
        inner = {
            part.path.partition(".")[2]: (kind(part), Field(description=f"{part.text} [{part.unit}]")) for part in parts
        }
        model = create_model(_title(name) + ("Columns" if listed else ""), __doc__=texts[name] + ".", **inner)  # type: ignore[call-overload]
        fields[name] = (model | None, Field(None, description=only))
    return fields


_made: Any = create_model
Result: type[BaseModel] = _made("Result", __base__=_Default, __doc__="Answer to one case.", **_included(False))
CaseAnswer: type[BaseModel] = _made("CaseAnswer", __base__=(Result, Answered), __doc__="Answer to one case.")
ColumnsAnswer: type[BaseModel] = _made(
    "ColumnsAnswer", __base__=_DefaultColumns, __doc__="Answer to a batch in columns, order kept; null: a bad case.",
    **_included(True),
)  # fmt: skip
RowsAnswer: type[BaseModel] = _made(
    "RowsAnswer", __base__=_BatchEnd, __doc__="Answer to a batch in rows, order kept; null where a case is bad.",
    results=(list[Result | None], ...),  # type: ignore[valid-type]
)  # fmt: skip


class TableAnswer(Answered):
    """Properties of a table."""

    id: str
    tolerance: float
    checksum: str = Field(description="SHA-256 of the table's content")
    file: str
    size_bytes: int
    max_abs_error: float | None = Field(description="Largest verified absolute error of mu_macro/mu0 [-]")
    max_rel_error: float | None = Field(description="Largest verified relative error of mu_macro [-]")
    attributes: dict[str, Any] = Field(description="Root attributes of the file")
    blocks: list[dict[str, Any]]
    loaded: list[TableLabel] = Field(description="All loaded tables, tightest first")
    service_version: str


class Health(BaseModel):
    """Answer of a health endpoint."""

    status: Literal["alive", "ready"]
    tables: list[TableLabel] | None = None
    api_version: str
    service_version: str


class FieldProblem(BaseModel):
    """One bad field."""

    pointer: str | None = Field(None, description="JSON pointer into the body")
    parameter: str | None = Field(None, description="Query parameter")
    field: str
    value: Any = Field(None, description="As given; a number that JSON cannot hold is a text, such as NaN")
    reason: str
    bound: str | None = None


class Problem(BaseModel):
    """Problem details, RFC 9457."""

    type: str
    title: str
    status: int
    detail: str
    instance: str
    request_id: str | None = None
    errors: list[FieldProblem] | None = None
    n_errors: int | None = None

"""Requests and answers of ``/v1/solve-for`` and ``/v1/law``, and how their bodies and queries are checked."""

import re
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, JsonValue, ValidationError

from friction.nondim import BOUNDS
from service.errors import FieldFault, InvalidFieldsError, MalformedBodyError, safe_value
from service.schemas import NotNegative, Positive, TableLabel

__all__ = [
    "MAX_POINTS",
    "MAX_TARGETS",
    "LawAnswer",
    "LawRequest",
    "SolveForAnswer",
    "SolveForRequest",
    "from_text",
    "read_form",
]

# A query's numbers, narrower than Python's; an unescaped "+" arrives as a space.
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+\- ]?\d+)?", re.ASCII)
_INTEGER = re.compile(r"\d{1,9}", re.ASCII)
MAX_POINTS = 10_001
MAX_TARGETS = 10_000

Name = Literal["mu0", "Fz", "k", "y0", "omega", "v0"]
# JSON has one kind of number: 55.0 is an integer there, and in a JSON Schema.
_Whole = BeforeValidator(lambda value: int(value) if isinstance(value, float) and value.is_integer() else value)
Target = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Form = TypeVar("Form", bound="_Five")

_LEFT_OUT = "the input that is asked for is left out"
_SOLVE: dict[str, JsonValue] = {
    "unknown": "y0", "target": 0.15, "mu0": 0.3, "Fz": 10.0, "k": 1e6, "omega": 1.3e5, "v0": 0.01
}  # fmt: skip
_LAW: dict[str, JsonValue] = {
    "along": "v0", "start": 1e-4, "stop": 10.0, "points": 5, "scale": "log",
    "mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5,
}  # fmt: skip


class _Five(BaseModel):
    """Five of the six inputs, in SI units."""

    model_config = ConfigDict(strict=True, extra="forbid")

    mu0: Positive | None = Field(None, description=f"Coulomb friction coefficient [-], finite and > 0; {_LEFT_OUT}")
    Fz: Positive | None = Field(None, description="Normal force [N], finite and > 0")
    k: Positive | None = Field(None, description="Tangential stiffness [N/m], finite and > 0; left out: rigid contact")
    y0: NotNegative | None = Field(None, description="Amplitude [m], finite and >= 0")
    omega: NotNegative | None = Field(None, description="Angular frequency [rad/s], finite and >= 0")
    v0: NotNegative | None = Field(None, description="Sliding velocity [m/s], finite and >= 0")
    tolerance: Positive | None = Field(None, description="Wanted error of mu_macro/mu0 [-]")

    def inputs(self, without: str) -> dict[str, float | None]:
        """The known inputs.

        Raises
        ------
        InvalidFieldsError
            One is missing, or the one that is asked for is given.
        """
        faults = []
        for name, bound in BOUNDS.items():
            value = getattr(self, name)
            if name == without and value is not None:
                faults.append(FieldFault(name, "must be left out: it is what is asked for", value))
            elif name not in (without, "k") and value is None:
                faults.append(FieldFault(name, "is required", bound=bound))
        if faults:
            raise InvalidFieldsError(f"{faults[0].field}: {faults[0].reason}", faults)
        return {name: getattr(self, name) for name in BOUNDS if name != without}


class SolveForRequest(_Five):
    """Which value of one input gives a wanted mu_macro."""

    model_config = ConfigDict(strict=True, extra="forbid", json_schema_extra={"examples": [_SOLVE]})

    unknown: Name = Field(description="The input that is asked for")
    target: Target | Annotated[list[Target], Field(min_length=1, max_length=MAX_TARGETS)] = Field(
        description=f"Wanted mu_macro [-], finite and >= 0: one, or a list of up to {MAX_TARGETS}"
    )
    range: Annotated[list[NotNegative], Field(min_length=2, max_length=2)] | None = Field(
        None, description="Where to look for the unknown [SI], ascending; left out: everywhere it makes a difference"
    )


class LawRequest(_Five):
    """mu_macro over a range of one input."""

    model_config = ConfigDict(strict=True, extra="forbid", json_schema_extra={"examples": [_LAW]})

    along: Name = Field("v0", description="The swept input")
    start: NotNegative = Field(description="First value [SI]; > 0 on a logarithmic scale")
    stop: Positive = Field(description="Last value [SI], > start")
    points: Annotated[int, Field(ge=2, le=MAX_POINTS), _Whole] = Field(
        201, description=f"Number of values, 2 to {MAX_POINTS}"
    )
    scale: Literal["log", "linear"] = Field("log", description="Spacing of the values")
    include: list[Literal["approximations"]] | None = Field(None, description="More to compute: approximations")


class RootAnswer(BaseModel):
    """One value of the unknown."""

    value: float = Field(description="The unknown [SI]")
    low: float = Field(description="From here ...")
    high: float = Field(description="... to here mu_macro is the target, as far as the table's error bound can tell")
    mu_macro: float = Field(description="What the table says there [-]")
    regime: Literal["continuous", "stick_slip", "static"]


class TargetAnswer(BaseModel):
    """All values that give one target."""

    target: float
    roots: list[RootAnswer] = Field(description="Ascending; more than one where mu_macro folds (k, Fz, mu0)")
    reason: str | None = Field(None, description="Why there is no root")


class Reachable(BaseModel):
    """The mu_macro that the unknown can give within its range."""

    min: float
    max: float
    min_included: bool = Field(description="false: approached, never reached")
    max_included: bool


class SolveForAnswer(BaseModel):
    """Answer to the inverse question."""

    unknown: Name
    unit: str
    range: list[float] = Field(description="Where was looked [SI]")
    reachable: Reachable
    results: list[TargetAnswer] = Field(description="One per target, in order")
    table: TableLabel
    api_version: str


class BorderMark(BaseModel):
    """Where continuous sliding begins or ends."""

    value: float = Field(description="The swept input [SI]")
    mu_macro: float = Field(description="[-]")


class LawAnswer(BaseModel):
    """A friction law in columns."""

    along: Name
    unit: str
    values: list[float] = Field(description="The swept input [SI]")
    mu_macro: list[float]
    mu_ratio: list[float]
    regime: list[Literal["continuous", "stick_slip", "static"]]
    error_bound: list[float | None]
    source: list[str]
    mu_static: list[float] = Field(description="Static limit (v0 -> 0) of each case [-]")
    border: list[BorderMark] = Field(description="Up to two places inside the range")
    approximations: dict[str, list[float | None]] | None = Field(
        None,
        description="Only if asked for [-]: static (16), creep, small_amplitude (31), continuous, rigid (35), corner; "
        "null: not meant there",
    )
    border_speeds: dict[str, list[float | None]] | None = Field(
        None,
        description="Only with approximations [m/s]: v0 at which continuous sliding begins for each case: exact, "
        "small_amplitude, large_amplitude (26), blend; null: not meant there",
    )
    table: TableLabel
    api_version: str


def read_form(form: type[Form], body: bytes) -> Form:
    """The checked request of a JSON body.

    Raises
    ------
    MalformedBodyError, InvalidFieldsError
        Not JSON; bad fields, all of them listed.
    """
    try:
        return form.model_validate_json(body)
    except ValidationError as error:
        raise _refusal(form, error, "pointer") from None


def from_text(form: type[Form], pairs: list[tuple[str, str]]) -> Form:
    """The checked request of a query; numbers are read from their text.

    Raises
    ------
    InvalidFieldsError
        Bad, unknown, missing or repeated parameters.
    """
    values: dict[str, Any] = {}
    faults = []
    for name, text in pairs:
        if name in values:
            faults.append(FieldFault(name, "is given more than once", text, place="parameter"))
        elif name == "include":
            values[name] = [part.strip() for part in text.split(",") if part.strip()]
        elif name == "points" and _INTEGER.fullmatch(text):
            values[name] = int(text)
        else:
            values[name] = float(text.replace(" ", "+")) if _NUMBER.fullmatch(text) else text
    if faults:
        raise InvalidFieldsError(f"{faults[0].field}: {faults[0].reason}", faults)
    try:
        return form.model_validate(values)
    except ValidationError as error:
        raise _refusal(form, error, "parameter") from None


def _refusal(form: type[BaseModel], error: ValidationError, place: str) -> MalformedBodyError | InvalidFieldsError:
    faults: dict[tuple[str | int, ...], FieldFault] = {}
    for entry in error.errors(include_url=False, include_context=False):
        if entry["type"] == "json_invalid":
            return MalformedBodyError(f"the body is not JSON: {entry['msg'].removeprefix('Invalid JSON: ')}")
        # a union reports each of its branches; their names are no place in the body
        path = tuple(step for i, step in enumerate(entry["loc"]) if i == 0 or isinstance(step, int))
        field = str(path[0]) if path else "body"
        known = form.model_fields.get(field)
        if entry["type"] == "missing":
            fault = FieldFault(field, "is required", place=place, path=path)
        elif entry["type"] == "extra_forbidden":
            allowed = ", ".join(form.model_fields)
            fault = FieldFault(field, f"unknown field; allowed: {allowed}", entry["input"], place=place, path=path)
        else:
            reason = entry["msg"][:1].lower() + entry["msg"][1:]
            bound = BOUNDS.get(field) or (known.description if known is not None else None)
            fault = FieldFault(field, reason, entry["input"], bound, place, path)
        faults.setdefault(path, fault)
    found = list(faults.values())
    return InvalidFieldsError(f"{safe_value(found[0].field)}: {found[0].reason}", found)

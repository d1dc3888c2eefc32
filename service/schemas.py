"""Requests and responses of ``/v1``: what is accepted, and what the interface's description says of it."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue

__all__ = [
    "INCLUDES",
    "BatchColumns",
    "BatchFault",
    "Case",
    "CaseAnswer",
    "CaseRequest",
    "ColumnsAnswer",
    "Gradient",
    "Groups",
    "Health",
    "InputStd",
    "Limits",
    "Power",
    "Problem",
    "Result",
    "RowsAnswer",
    "TableAnswer",
    "TableLabel",
]

Include = Literal["groups", "limits", "gradient", "std", "stick_fraction", "power"]
INCLUDES: tuple[Include, ...] = ("groups", "limits", "gradient", "std", "stick_fraction", "power")
_INCLUDE = f"More to compute: {', '.join(INCLUDES)}"

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]

_K = "Tangential contact stiffness [N/m], finite and > 0; left out or null: rigid contact"
_STD = "Standard deviations of the inputs; needed where include asks for std, and nowhere else"
_STICK = "Share of the period during which the contact sticks [-]; only if asked for"
_STICK_BOUND = (
    "Bound of the absolute error of stick_fraction [-]; comes with it. null: the table does not have it. Larger at the "
    "border of continuous sliding than elsewhere"
)
_EXAMPLE: dict[str, JsonValue] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}


class Case(BaseModel):
    """One case, in SI units."""

    # Strict: "0.3" and true are no numbers here.
    model_config = ConfigDict(strict=True, extra="forbid", json_schema_extra={"examples": [_EXAMPLE]})

    mu0: Positive = Field(description="Coulomb friction coefficient of the contact [-], finite and > 0")
    Fz: Positive = Field(description="Normal force [N], finite and > 0")
    k: Positive | None = Field(None, description=_K)
    y0: NotNegative = Field(description="Amplitude of the transverse oscillation [m], finite and >= 0")
    omega: NotNegative = Field(description="Angular frequency of the oscillation [rad/s], finite and >= 0")
    v0: NotNegative = Field(description="Sliding velocity [m/s], finite and >= 0")


class InputStd(BaseModel):
    """Standard deviations of the inputs, in their units; independent errors are assumed."""

    model_config = ConfigDict(strict=True, extra="forbid")

    mu0: NotNegative = Field(0.0, description="[-]")
    Fz: NotNegative = Field(0.0, description="[N]")
    k: NotNegative = Field(0.0, description="[N/m]; means nothing where contact is rigid")
    y0: NotNegative = Field(0.0, description="[m]")
    omega: NotNegative = Field(0.0, description="[rad/s]")
    v0: NotNegative = Field(0.0, description="[m/s]")


class CaseRequest(Case):
    """One case, and what is wanted beside the default answer."""

    include: list[Include] | None = Field(None, description=_INCLUDE)
    tolerance: Positive | None = Field(
        None, description="Wanted error of mu_macro/mu0 [-]: the smallest loaded table that meets it answers"
    )
    std: InputStd | None = Field(None, description=_STD)


class BatchColumns(BaseModel):
    """A batch as columns: lists of one length; a plain number holds for every case."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={"examples": [{**_EXAMPLE, "v0": [0.001, 0.01, 0.1], "Fz": [10.0, 20.0, 30.0]}]},
    )

    mu0: Positive | list[float] = Field(description="[-], finite and > 0")
    Fz: Positive | list[float] = Field(description="[N], finite and > 0")
    k: Positive | list[float | None] | None = Field(None, description="[N/m], finite and > 0; null: rigid contact")
    y0: NotNegative | list[float] = Field(description="[m], finite and >= 0")
    omega: NotNegative | list[float] = Field(description="[rad/s], finite and >= 0")
    v0: NotNegative | list[float] = Field(description="[m/s], finite and >= 0")
    include: list[Include] | None = Field(None, description=_INCLUDE)
    tolerance: Positive | None = Field(None, description="Wanted error of mu_macro/mu0 [-]")
    std: InputStd | None = Field(None, description=_STD)


class TableLabel(BaseModel):
    """The table that an answer came from."""

    id: str = Field(description="Name of the table")
    tolerance: float = Field(description="The error of mu_macro/mu0 [-] that it was built to")


class Groups(BaseModel):
    """Dimensionless groups.  null: not finite (rigid contact, no oscillation, or beyond double range)."""

    v_tilde: float | None = Field(description="v0/(l0 omega) [-]")
    y_tilde: float | None = Field(description="y0/l0 [-]")
    l0: float | None = Field(description="Length scale mu0 Fz/k [m]; 0 for rigid contact")


class Limits(BaseModel):
    """Marks on the friction law of this case.  null: not finite in double precision."""

    mu_static: float | None = Field(description="Static limit, v0 -> 0 [-]: mu0 sqrt(1 - y~^2), or 0 for y~ >= 1")
    v0_crit: float | None = Field(description="Velocity at the border of continuous sliding [m/s]")
    mu_crit: float | None = Field(description="Macroscopic coefficient of friction at that border [-]")


class Gradient(BaseModel):
    """d mu_macro / d input.  null: not finite, or no such input (k of rigid contact)."""

    mu0: float | None = Field(description="[-]")
    Fz: float | None = Field(description="[1/N]")
    k: float | None = Field(description="[m/N]")
    y0: float | None = Field(description="[1/m]")
    omega: float | None = Field(description="[s/rad]")
    v0: float | None = Field(description="[s/m]")


class Power(BaseModel):
    """Mean powers [W].  null: not finite in double precision."""

    oscillation: float | None = Field(
        description="What the shaker puts in: mu0 Fz l0 omega <y~ cos tau u_y>; null for rigid contact"
    )
    saved: float | None = Field(description="What the drive is spared: (mu0 - mu_macro) Fz v0")
    oscillation_bound: float | None = Field(
        description="Bound of the absolute error of oscillation; null also where the table does not have it"
    )
    saved_bound: float | None = Field(description="Bound of the absolute error of saved")


class Result(BaseModel):
    """What is known of one case."""

    mu_macro: float = Field(description="Macroscopic coefficient of friction [-]")
    mu_ratio: float = Field(description="mu_macro/mu0 [-], from 0 to 1")
    regime: Literal["continuous", "stick_slip", "static"] = Field(description="How the contact moves")
    error_bound: float | None = Field(description="Bound of the absolute error of mu_macro [-]")
    source: str = Field(description="Block of the table, or closed-form tail, that the value came from")
    groups: Groups | None = Field(None, description="Only if asked for")
    limits: Limits | None = Field(None, description="Only if asked for")
    gradient: Gradient | None = Field(None, description="Only if asked for")
    std: float | None = Field(None, description="Standard deviation of mu_macro [-], to first order; only if asked for")
    stick_fraction: float | None = Field(None, description=_STICK)
    stick_fraction_bound: float | None = Field(None, description=_STICK_BOUND)
    power: Power | None = Field(None, description="Only if asked for")


class CaseAnswer(Result):
    """Answer to one case."""

    table: TableLabel
    api_version: str


class BatchFault(BaseModel):
    """Why one case of a batch has no result."""

    index: int = Field(description="Position in the batch, from 0")
    field: str | None = Field(description="The bad field; null when the case as a whole is bad")
    reason: str


class _BatchEnd(BaseModel):
    errors: list[BatchFault] = Field(description="One entry per bad case, in order; the first 1000 of them")
    n_errors: int = Field(description="Number of bad cases, listed or not")
    table: TableLabel
    api_version: str


class ColumnsAnswer(_BatchEnd):
    """Answer to a batch in columns, order kept; null where a case is bad."""

    mu_macro: list[float | None]
    mu_ratio: list[float | None]
    regime: list[str | None]
    error_bound: list[float | None]
    source: list[str | None]
    groups: dict[str, list[float | None]] | None = None
    limits: dict[str, list[float | None]] | None = None
    gradient: dict[str, list[float | None]] | None = None
    std: list[float | None] | None = None
    stick_fraction: list[float | None] | None = None
    stick_fraction_bound: list[float | None] | None = None
    power: dict[str, list[float | None]] | None = None


class RowsAnswer(_BatchEnd):
    """Answer to a batch in rows, order kept; null where a case is bad."""

    results: list[Result | None]


class TableAnswer(BaseModel):
    """What is known of a table."""

    id: str
    tolerance: float
    checksum: str = Field(description="SHA-256 of the table's content")
    file: str
    size_bytes: int
    max_abs_error: float | None = Field(description="Largest verified absolute error of mu_macro/mu0 [-]")
    max_rel_error: float | None = Field(description="Largest verified relative error of mu_macro [-]")
    attributes: dict[str, Any] = Field(description="Root attributes of the file")
    blocks: list[dict[str, Any]]
    table: TableLabel
    loaded: list[TableLabel] = Field(description="All loaded tables, tightest first")
    api_version: str
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
    value: Any = Field(None, description="As given; what JSON cannot hold is a text, such as NaN")
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

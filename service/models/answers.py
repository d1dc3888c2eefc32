"""Define the answers.  The library's list of outputs, with its units and meanings, gives the models
of a case and of cases in columns; the others are written here.

A member whose value can be missing is null there; a value that ``include`` did not ask for is left
out.
"""

from collections import defaultdict
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, Field, WithJsonSchema, create_model

from mumacro.inputs.fields import AMPLITUDE, ContactName, DirectionName
from mumacro.outputs import MEMBERS, OUTPUTS
from mumacro.outputs.entry import Member

from .inputs import Name

Regime = Literal["continuous", "stick_slip", "static", "partial_slip", "reverse_slip"]
Number: TypeAlias = float | None
Numbers: TypeAlias = list[float | None]


def quantity(text: str, unit: str, default: Any = ...) -> Any:
    """Return a member with its meaning and unit."""
    return Field(default, description=f"{text} [{unit}]", json_schema_extra={"x-unit": unit})


def _described(member: Member, default: Any = ...) -> Any:
    return quantity(member.meaning, member.unit, default)


def member(path: str, default: Any = ...) -> Any:
    """Return a member for a value of an output, with the unit and the meaning from the library's
    list."""
    return _described(MEMBERS[path], default)


def _included(number: Any, ending: str) -> Any:
    """Return the model of the values that ``include`` asks for: of numbers, or of columns.

    Values whose paths have two steps are in their own model, such as ``PowerBound``.
    """
    members: dict[str, Any] = {}
    for output in OUTPUTS.values():
        of_part = defaultdict[str, dict[str, Any]](dict)
        for path, one in output.members.items():
            part, _, name = path.partition(".")
            if not name:
                members[part] = number | None, _described(one, None)
            elif name in ("y0", AMPLITUDE):  # whichever of the two the direction has
                of_part[part][name] = number | None, _described(one, None)
            else:
                of_part[part][name] = number, _described(one)
        for part, values in of_part.items():
            title = part.title().replace("_", "") + ending
            about = output.parts[part].replace("NaN", "null")
            model: Any = create_model(title, __doc__=f"{about}.", **values)
            members[part] = model | None, None
    return create_model(f"Included{ending}", __doc__="What ``include`` asks for.", **members)


def _answer(name: str, included: Any, about: str, number: Any, regime: Any, source: Any) -> Any:
    """Return the model of the default answer and of what ``include`` adds."""
    output_paths = {path for output in OUTPUTS.values() for path in output.members}
    members: dict[str, Any] = {
        path: (number, _described(one)) for path, one in MEMBERS.items() if path not in output_paths
    }
    members["regime"] = regime, Field(description="How the contact moves")
    text = "Block of the table, or closed-form tail, that the value came from"
    members["source"] = source, Field(description=text)
    return create_model(name, __base__=included, __doc__=about, **members)


Included, IncludedColumns = _included(Number, ""), _included(Numbers, "Columns")
Result = _answer("Result", Included, "Answer to one case.", Number, Regime, str)
Columns = _answer(
    "Columns",
    IncludedColumns,
    "Answers in columns, order kept.",
    Numbers,
    list[Regime | None],
    list[str | None],
)


class TableLabel(BaseModel):
    """The table that an answer came from."""

    id: str = Field(description="Name of the table")
    tolerance: float = Field(description="The error of mu_macro/mu0 [-] that it was built to")


class Answered(BaseModel):
    """The members of every answer."""

    table: TableLabel
    api_version: str


class HarmonicRead(BaseModel):
    """One harmonic of an oscillation."""

    harmonic: int
    amplitude: float = Field(description="[SI]")
    phase: float = Field(description="[degrees]")


class Understood(BaseModel):
    """How the program understood one input."""

    text: str | None = Field(description="As it came; null where it was a number")
    value: float | Literal["rigid"] = Field(description="In SI; of an interval its middle")
    unit: str = Field(description="That was typed, or the SI unit")
    std: float | None = Field(None, description="One standard deviation [SI]")
    low: float | None = Field(None, description="Ends of an interval [SI]")
    high: float | None = None
    harmonics: list[HarmonicRead] | None = Field(
        None, description="Of an oscillation of a motion, whose value is the first amplitude"
    )


class ModelRow(BaseModel):
    """One effect that the model leaves out, see docs/validity.md."""

    row: str = Field(description="Its name")
    text: str = Field(description="What it does here")
    effect: float | None = Field(description="Relative change of mu_macro; null: not known")


class Remark(BaseModel):
    """One doubt about the inputs or outputs, for one case or many."""

    row: str = Field(description="The kind of doubt, such as units")
    field: str = Field(description="The input or output that is meant")
    cases: int = Field(description="How many cases it is about")
    text: str = Field(description="A sentence on the first of them")


REMARKS = "What is doubtful; left out where nothing is"
_UNDERSTOOD = "Only if requested: what was understood of each input"


def understood_inputs() -> Any:
    """Return the member of an answer that tells how the program understood the inputs."""
    return Field(None, description=_UNDERSTOOD)


class CaseAnswer(Result, Answered):  # type: ignore[misc, valid-type]
    """Answer to one case."""

    mu_macro: float = member("mu_macro")
    mu_ratio: float = member("mu_ratio")
    model: list[ModelRow] | None = Field(
        None, description="Only if requested: what the model leaves out here"
    )
    digits: int | None = Field(None, description="With model: digits of mu_macro that k supports")
    remarks: list[Remark] | None = Field(None, description=REMARKS)
    inputs: dict[str, Understood] | None = understood_inputs()


# --- batches --------------------------------------------------------------------------------------


class BatchFault(BaseModel):
    """Why one case of a batch has no result."""

    index: int = Field(description="Position in the batch, from 0")
    field: str | None = Field(description="The bad field; null when the case as a whole is bad")
    reason: str


class BatchAnswered(Answered):
    """Statements about a whole batch."""

    errors: list[BatchFault] = Field(
        description="One entry per bad case, in order; the first 1000 of them"
    )
    n_errors: int = Field(description="Number of bad cases, listed or not")
    remarks: list[Remark] | None = Field(None, description=REMARKS)


class ColumnsAnswer(Columns, BatchAnswered):  # type: ignore[misc, valid-type]
    """Answer to a batch in columns, in the same order; a bad case has null."""


class RowsAnswer(BatchAnswered):
    """Answer to a batch in rows, in the same order; a bad case has null."""

    results: list[Result | None]  # type: ignore[valid-type]


# --- questions ------------------------------------------------------------------------------------

_MODEL = "Along Fz, or solved for it: what is said of k"


class BorderMark(BaseModel):
    """Where continuous sliding begins or ends."""

    value: float = Field(description="The swept input [SI]")
    mu_macro: float = Field(description="[-]")


class LawAnswer(Columns, Answered):  # type: ignore[misc, valid-type]
    """A friction law in columns."""

    along: Name
    unit: str
    values: list[float] = Field(description="The swept input [SI]")
    mu_static: list[float] = quantity("Static limit (v0 -> 0) of each case", "-")
    k: list[float] | None = quantity(
        "Stiffness at each value, where it grows along Fz", "N/m", None
    )
    model: list[ModelRow] | None = Field(None, description=_MODEL)
    border: list[BorderMark] = Field(description="Up to two points inside the range")
    inputs: dict[str, Understood] | None = understood_inputs()


class Root(Included):  # type: ignore[misc, valid-type]
    """One value of the unknown, and the answer there."""

    value: float = Field(description="The unknown [SI]")
    low: float = Field(description="From low ...")
    high: float = Field(
        description="... to high, mu_macro is the target within the table's error bound"
    )
    mu_macro: float = quantity("Value of the table there", "-")
    regime: Regime


class TargetAnswer(BaseModel):
    """All values that give one target."""

    target: float
    roots: list[Root] = Field(
        description="Ascending; more than one where mu_macro is not monotonic (k, Fz, mu0)"
    )
    reason: str | None = Field(
        None, description="Why there is no root, or over which range every value is one"
    )


class Reachable(BaseModel):
    """Range of mu_macro for all values of the unknown in its range."""

    min: float
    max: float
    min_included: bool = Field(description="false: approached, never reached")
    max_included: bool


class Solved(BaseModel):
    """The roots of every target, the range of the search, and the reachable values."""

    results: list[TargetAnswer] = Field(description="One per target, in order")
    range: list[float | None] = Field(description="The searched range [SI]; null: without limit")
    reachable: Reachable


class SolveForEnd(Solved):
    """The same for one end of an interval of k."""

    k: float = Field(description="[N/m]")


class SolveForAnswer(Solved, Answered):
    """Answer to the inverse problem."""

    unknown: Name
    unit: str
    quantity: Literal["mu_macro", "mu_ratio"]
    ends: list[SolveForEnd] | None = Field(
        None, description="Only with an interval of k: for both ends; the rest is for the middle"
    )
    model: list[ModelRow] | None = Field(None, description=_MODEL)
    inputs: dict[str, Understood] | None = understood_inputs()


class MotionRoot(BaseModel):
    """One value of the unknown of a motion."""

    value: float = Field(description="The unknown [SI], a phase in degrees")
    low: float = Field(description="From low ...")
    high: float = Field(
        description="... to high, the mean force is the target within its error estimate"
    )
    mean: float = quantity("The mean force over the mean load there", "-")
    error_estimate: float = quantity("Estimated error of it", "-")


class MotionTargetAnswer(BaseModel):
    """All values that give one target of a motion."""

    target: float
    roots: list[MotionRoot] = Field(description="Ascending; there may be several")
    reason: str | None = Field(
        None, description="Why there is no root, or over which range every value is one"
    )


class SolveMotionAnswer(BaseModel):
    """Answer to the inverse problem of a motion; it is computed without a table."""

    unknown: str
    unit: str
    quantity: Literal["mu_macro", "mu_ratio"]
    of: Literal["mu_macro", "mu_lateral"]
    results: list[MotionTargetAnswer] = Field(description="One per target, in order")
    range: list[float] = Field(description="The searched range [SI], of a phase in degrees")
    reachable: Reachable
    other_way: list[MotionTargetAnswer] | None = Field(
        None,
        description="For v0 without a root: with the phase of x turned by 180 degrees the body "
        "moves the other way, at these speeds",
    )
    api_version: str
    inputs: dict[str, Understood] | None = understood_inputs()


class StiffnessAnswer(BaseModel):
    """Contact of two bodies; ``k`` and ``contact`` are members of a case."""

    geometry: str
    k: float = Field(description="Tangential stiffness while everything sticks [N/m]")
    k_normal: float = Field(description="Normal stiffness [N/m]")
    half_width: float = Field(
        description="Radius of a circular contact, half width of a line contact [m]"
    )
    pressure: float = Field(
        description="Largest pressure [Pa]: Hertz's, or the mean one under a flat punch"
    )
    contact: ContactName
    warnings: list[str] = Field(description="Where the theory behind k is off")
    remarks: list[Remark] | None = Field(None, description=REMARKS)
    inputs: dict[str, Understood] | None = understood_inputs()
    api_version: str


# --- fit ------------------------------------------------------------------------------------------

# an enumeration, because openapi-python-client takes a constant for the only possible value
_Rigid = Annotated[Literal["rigid"], WithJsonSchema({"type": "string", "enum": ["rigid"]})]
_Stiffness = float | _Rigid | None


class FittedValues(BaseModel):
    """k [N/m] (or rigid) and mu0 [-], if they were unknown."""

    k: _Stiffness = None
    mu0: float | None = None


class Solution(FittedValues):
    """One minimum that the points allow."""

    chi2: float


class Interval(BaseModel):
    """Interval of each unknown; a known value is left out."""

    k: list[_Stiffness] | None = None
    mu0: list[float | None] | None = None


class FittedCurve(BaseModel):
    """The fitted law over v0, with its 95 % band."""

    v0: list[float] = Field(description="[m/s]")
    mu_macro: list[float]
    low: list[float | None]
    high: list[float | None]


class FitAnswer(Answered):
    """Result of a fit to measured points."""

    values: FittedValues
    std: FittedValues = Field(
        description="Standard deviations; null: the points do not determine it, see warnings"
    )
    covariance: list[list[float | None]] = Field(
        description="In the order of values; null: not determined"
    )
    interval: Interval = Field(
        description="95 % intervals [low, high]; k may be rigid, null: without bound"
    )
    residuals: list[float] = Field(description="Measured minus fitted mu_macro, of each point [-]")
    chi2: float
    reduced_chi2: float | None = Field(description="null: no point more than unknowns")
    solutions: list[Solution] = Field(description="All minima within 95 %, best first")
    warnings: list[str] = Field(description="What the points do not determine")
    remarks: list[Remark] | None = Field(
        None, description="What is doubtful about the points; left out where nothing is"
    )
    contact: ContactName
    direction: DirectionName
    points: dict[str, list[_Stiffness]] = Field(
        description="What was fitted to, in SI: the known inputs of each point, mu_macro, and std "
        "where it was given"
    )
    curve: FittedCurve | None = Field(
        description="null where other inputs than v0 vary, or v0 is 0 everywhere"
    )
    read_as: str | None = Field(None, description="Of a table: how it was read")
    skipped_lines: list[int] | None = Field(
        None, description="Of a table: lines that are neither names nor units nor points"
    )


class PointsAnswer(BaseModel):
    """Points as they were read from a table, without a fit."""

    columns: dict[str, list[float]] = Field(
        description="By name, in the units of the table", examples=[{"v0": [1.0, 5.0]}]
    )
    units: dict[str, str] = Field(description="Of the columns", examples=[{"v0": "mm/s"}])
    lines: list[int] = Field(description="The line of each point, from 1")
    skipped_lines: list[int] = Field(
        description="Lines that are neither names nor units nor points, and not empty"
    )
    read_as: str = Field(
        description="How the table was read; empty for plain CSV",
        examples=["tab, decimal comma, header in line 3, units in line 4"],
    )
    api_version: str


# --- tables, health, problems ---------------------------------------------------------------------


class TableAnswer(Answered):
    """Properties of a table."""

    id: str
    tolerance: float
    checksum: str = Field(description="SHA-256 of the table's content")
    file: str
    size_bytes: int
    max_abs_error: float | None = Field(
        description="Largest verified absolute error of mu_macro/mu0 [-]"
    )
    max_rel_error: float | None = Field(
        description="Largest verified relative error of mu_macro [-]"
    )
    error_distribution: dict[str, dict[str, float]] = Field(
        description="By quantity: the error that a share of the verified points does not exceed; "
        "bound over error"
    )
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
    value: Any = Field(
        None, description="As given; a number that JSON cannot hold is a text, such as NaN"
    )
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
    inputs: dict[str, Understood] | None = understood_inputs()

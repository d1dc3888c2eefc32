"""Requests and answers of ``/v1/solve-for`` and ``/v1/law``."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, JsonValue, create_model, model_validator

from mumacro.law import APPROXIMATIONS, BORDERS

from .hints import ONE_FREQUENCY, STATE_K, STATE_OMEGA
from .kernel import BOUNDS, FIELDS, INPUTS, RAD_PER_CYCLE
from .quantities import QUANTITIES
from .schemas import (
    INCLUDES,
    Answered,
    CaseAnswer,
    ColumnsAnswer,
    Frequency,
    InputStd,
    NotNegative,
    Positive,
    QueryFrequency,
    QueryNotNegative,
    QueryPositive,
    Stiffness,
    canonical,
    check_std,
    examples,
    relation,
    split_names,
)

__all__ = ["MAX_CURVES", "MAX_POINTS", "MAX_TARGETS", "LawAnswer", "LawFamilyAnswer", "LawQuery", "LawRequest",
           "SolveForAnswer", "SolveForRequest"]  # fmt: skip

MAX_POINTS = 10_001
MAX_CURVES = 20
MAX_ALL_POINTS = 20_002
MAX_TARGETS = 10_000

Name = Literal["mu0", "Fz", "k", "y0", "omega", "f", "v0"]
# JSON has one kind of number: 55.0 is an integer there, and in a JSON Schema.
_Whole = BeforeValidator(lambda value: int(value) if isinstance(value, float) and value.is_integer() else value)
Target = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Included = Literal[INCLUDES]  # type: ignore[valid-type]
LawIncluded = Literal[("approximations", *INCLUDES)]  # type: ignore[valid-type]

_LEFT_OUT = "the unknown or swept input is left out"
_SOLVE: dict[str, JsonValue] = {
    "unknown": "y0", "target": 0.15, "mu0": 0.3, "Fz": 10.0, "k": 1e6, "omega": 1.3e5, "v0": 0.01
}  # fmt: skip
_LAW: dict[str, JsonValue] = {
    "along": "v0", "start": 1e-4, "stop": 10.0, "points": 5, "scale": "log",
    "mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5,
}  # fmt: skip


class _Five(BaseModel):
    """Five of the six inputs, in SI units; ``omega`` or ``f``."""

    model_config = examples()

    mu0: Positive | None = Field(None, description=f"Coulomb friction coefficient [-], finite and > 0; {_LEFT_OUT}")
    Fz: Positive | None = Field(None, description="Normal force [N], finite and > 0")
    k: Stiffness = Field(None, description='Tangential stiffness [N/m], finite and > 0; null or "rigid": rigid contact')
    y0: NotNegative | None = Field(None, description="Amplitude [m], finite and >= 0")
    omega: NotNegative | None = Field(None, description="Angular frequency [rad/s], finite and >= 0; or f")
    f: Frequency | None = Field(None, description="Frequency [Hz], finite and >= 0; in place of omega")
    v0: NotNegative | None = Field(None, description="Sliding velocity [m/s], finite and >= 0")
    tolerance: Positive | None = Field(None, description="Wanted error of mu_macro/mu0 [-]")
    std: InputStd | None = Field(None, description="Standard deviations of the inputs, if include has std")

    def _asked(self) -> str:
        raise NotImplementedError

    @model_validator(mode="after")
    def _five(self) -> Self:
        asked = self._asked()
        input_asked = "omega" if asked == "f" else asked
        for name in FIELDS:
            given = getattr(self, name)
            if name == "omega":
                if input_asked == "omega":
                    if given is not None or self.f is not None:
                        field = "omega" if given is not None else "f"
                        raise relation(field, "must be left out: it is the unknown or swept input")
                elif given is None and self.f is None:
                    raise relation("omega", STATE_OMEGA)
                elif given is not None and self.f is not None:
                    raise relation("f", ONE_FREQUENCY)
            elif name == asked and name in self.model_fields_set and given is not None:
                raise relation(name, "must be left out: it is the unknown or swept input")
            elif name == "k" and name != asked and "k" not in self.model_fields_set:
                raise relation("k", STATE_K.format(rigid=self._rigid()))
            elif name not in ("k", asked) and given is None:
                raise relation(name, "is required")
        return self

    def _rigid(self) -> str:
        return "null"

    def inputs(self) -> dict[str, Any]:
        """The five inputs by name, omega in place of f; k is None for rigid contact."""
        asked = "omega" if self._asked() == "f" else self._asked()
        found = {name: getattr(self, name) for name in FIELDS if name != asked}
        if found.get("omega", 0) is None:
            found["omega"] = RAD_PER_CYCLE * (self.f or 0.0)
        if found.get("k") == "rigid":
            found["k"] = None
        return found


class SolveForRequest(_Five):
    """Which value of one input gives a wanted mu_macro."""

    model_config = examples(_SOLVE)

    unknown: Name = Field(description="The input to solve for")
    target: Target | Annotated[list[Target], Field(min_length=1, max_length=MAX_TARGETS)] = Field(
        description=f"Wanted value [-], finite and >= 0: one, or a list of up to {MAX_TARGETS}"
    )
    quantity: Literal["mu_macro", "mu_ratio"] = Field(
        "mu_macro", description="What the target is: mu_macro, or mu_ratio = mu_macro/mu0 (0.5 halves the friction)"
    )
    range: Annotated[list[NotNegative], Field(min_length=2, max_length=2)] | None = Field(
        None, description="Where to search the unknown [SI], ascending; left out: wherever it changes mu_macro"
    )
    include: Annotated[list[Included], Field(max_length=2 * len(INCLUDES))] | None = Field(
        None, description=f"More to compute at every root: {', '.join(INCLUDES)}"
    )

    def _asked(self) -> str:
        return self.unknown

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        check_std(self)
        if self.quantity == "mu_ratio" and self.unknown == "mu0":
            raise relation("quantity", "must be mu_macro where mu0 is the unknown")
        return self


class LawRequest(_Five):
    """mu_macro over a range of one input; a list for one more input gives a family of curves."""

    model_config = examples(_LAW)

    along: Name = Field("v0", description="The swept input")
    start: NotNegative = Field(description="First value [SI]; > 0 on a logarithmic scale")
    stop: Positive = Field(description="Last value [SI], > start")
    points: Annotated[int, Field(ge=2, le=MAX_POINTS), _Whole] = Field(
        201, description=f"Number of values, 2 to {MAX_POINTS}"
    )
    scale: Literal["log", "linear"] = Field("log", description="Spacing of the values")
    family: dict[Name, Annotated[list[NotNegative], Field(min_length=1, max_length=MAX_CURVES)]] | None = Field(
        None,
        max_length=1,
        description=f"One input that is left out elsewhere, and up to {MAX_CURVES} values of it: one curve per value",
    )
    include: Annotated[list[LawIncluded], Field(max_length=2 + 2 * len(INCLUDES))] | None = Field(
        None, description=f"More to compute at every value: approximations, {', '.join(INCLUDES)}"
    )

    def _asked(self) -> str:
        return self.along

    @model_validator(mode="before")
    @classmethod
    def _first_of_family(cls, values: Any) -> Any:
        """Use the first curve's value as the input while the other fields are checked."""
        if isinstance(values, dict) and isinstance(values.get("family"), dict) and len(values["family"]) == 1:
            name, listed = next(iter(values["family"].items()))
            if name in values:
                raise relation(str(name), "must be left out: the family has its values")
            if name in INPUTS and isinstance(listed, list) and listed:
                return {**values, name: listed[0]}
        return values

    @model_validator(mode="after")
    def _sensible(self) -> Self:
        check_std(self)
        if self.scale == "log" and self.start == 0.0:
            raise relation("start", "must be > 0 on a logarithmic scale; for a range from 0 set scale to linear")
        for name, values in (self.family or {}).items():
            if name == self.along:
                raise relation("family", f"{name} is the swept input")
            if len(values) * self.points > MAX_ALL_POINTS:
                raise relation("points", f"all curves together may have up to {MAX_ALL_POINTS} points")
            if name in ("mu0", "Fz", "k") and min(values) <= 0.0:
                raise relation("family", f"{name} must be {BOUNDS[name]}")
        return self

    def quantities(self) -> tuple[str, ...]:
        """Included names that are quantities of every case."""
        return canonical([name for name in self.include or () if name in QUANTITIES])


class LawQuery(BaseModel):
    """A law as a query."""

    model_config = ConfigDict(strict=True, extra="forbid")

    along: Name = Field("v0", description="The swept input")
    start: QueryNotNegative = Field(description="First value [SI]; > 0 on a logarithmic scale", examples=[1e-4])
    stop: QueryPositive = Field(description="Last value [SI], > start", examples=[10.0])
    points: Annotated[int, Field(ge=2, le=MAX_POINTS), BeforeValidator(lambda v: int(v) if str(v).isdigit() else v)] = (
        Field(201, description=f"Number of values, 2 to {MAX_POINTS}")
    )
    scale: Literal["log", "linear"] = Field("log", description="Spacing of the values")
    mu0: QueryPositive | None = Field(None, description="[-], finite and > 0", examples=[0.3])
    Fz: QueryPositive | None = Field(None, description="[N], finite and > 0", examples=[10.0])
    k: QueryPositive | Literal["rigid"] | None = Field(None, description="[N/m], or rigid", examples=[1e6])
    y0: QueryNotNegative | None = Field(None, description="[m], finite and >= 0", examples=[2e-6])
    omega: QueryNotNegative | None = Field(None, description="[rad/s]; or f", examples=[1.3e5])
    f: QueryFrequency | None = Field(None, description="[Hz]; in place of omega")
    v0: QueryNotNegative | None = Field(None, description="[m/s], finite and >= 0")
    tolerance: QueryPositive | None = Field(None, description="Wanted error of mu_macro/mu0 [-]")
    include: Annotated[
        list[Literal["approximations"]],
        Field(min_length=1, max_length=4),
        BeforeValidator(split_names),
    ] = Field([], description="approximations: those of the paper beside the exact values")

    def form(self) -> LawRequest:
        """The same request as a body."""
        given = {name: getattr(self, name) for name in self.model_fields_set}
        return LawRequest.model_validate(given)


# --- answers ------------------------------------------------------------------------------------------


class _RootBase(BaseModel):
    """One value of the unknown, and the answer there."""

    value: float = Field(description="The unknown [SI]")
    low: float = Field(description="From low ...")
    high: float = Field(description="... to high, mu_macro is the target within the table's error bound")
    mu_macro: float = Field(description="Value of the table there [-]")
    regime: Literal["continuous", "stick_slip", "static"]


def _only_included(model: type[BaseModel]) -> dict[str, Any]:
    plain = {"mu_macro", "mu_ratio", "regime", "error_bound", "source", "table", "api_version", "errors", "n_errors"}
    return {name: (info.annotation, info) for name, info in model.model_fields.items() if name not in plain}


_made: Any = create_model
Root: Any = _made("Root", __base__=_RootBase, __doc__=_RootBase.__doc__, **_only_included(CaseAnswer))


class TargetAnswer(BaseModel):
    """All values that give one target."""

    target: float
    roots: list[Root] = Field(description="Ascending; more than one where mu_macro is not monotonic (k, Fz, mu0)")
    reason: str | None = Field(None, description="Why there is no root")


class Reachable(BaseModel):
    """Range of mu_macro for all values of the unknown in its range."""

    min: float
    max: float
    min_included: bool = Field(description="false: approached, never reached")
    max_included: bool


class SolveForAnswer(Answered):
    """Answer to the inverse problem."""

    unknown: Name
    unit: str
    quantity: Literal["mu_macro", "mu_ratio"]
    range: list[float | None] = Field(description="The searched range [SI]; null: without limit")
    reachable: Reachable
    results: list[TargetAnswer] = Field(description="One per target, in order")


class BorderMark(BaseModel):
    """Where continuous sliding begins or ends."""

    value: float = Field(description="The swept input [SI]")
    mu_macro: float = Field(description="[-]")


def _listed(columns: Mapping[str, str]) -> str:
    return "; ".join(f"{name}: {text}" for name, text in columns.items())


class _CurveBase(BaseModel):
    """A friction law in columns."""

    mu_macro: list[float]
    mu_ratio: list[float]
    regime: list[Literal["continuous", "stick_slip", "static"]]
    error_bound: list[float | None]
    source: list[str]
    mu_static: list[float] = Field(description="Static limit (v0 -> 0) of each case [-]")
    border: list[BorderMark] = Field(description="Up to two points inside the range")
    approximations: dict[str, list[float | None]] | None = Field(
        None,
        description=f"Only if requested [-]; null: outside the range of the formula. {_listed(APPROXIMATIONS)}",
    )
    border_speeds: dict[str, list[float | None]] | None = Field(
        None,
        description="Only with approximations [m/s]: v0 at which continuous sliding begins for each case; null: "
        f"outside the range of the formula. {_listed(BORDERS)}",
    )


Curve: Any = _made("Curve", __base__=_CurveBase, __doc__=_CurveBase.__doc__, **_only_included(ColumnsAnswer))


class _Swept(Answered):
    along: Name
    unit: str
    values: list[float] = Field(description="The swept input [SI]")


class FamilyCurve(Curve):  # type: ignore[misc]
    """One curve of a family."""

    value: float = Field(description="The family's input [SI]")


LawAnswer: type[BaseModel] = _made("LawAnswer", __base__=(_Swept, Curve), __doc__="A friction law in columns.")


class LawFamilyAnswer(_Swept):
    """Friction laws for several values of one more input."""

    family: Name
    family_unit: str
    curves: list[FamilyCurve]

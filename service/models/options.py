"""What is asked beside the inputs: which contact and table, what else is computed."""

from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, WithJsonSchema, WrapValidator, model_validator

from mumacro.errors import InputError
from mumacro.inputs.kind import ContactName, DirectionName, Kind, kind_of
from mumacro.outputs import OUTPUTS

from .inputs import (
    ALTERNATIVES,
    EXAMPLE,
    OR_RIGID,
    CaseInputs,
    ContactColumn,
    DeviationColumn,
    DirectionColumn,
    Hertz,
    InputColumns,
    NotNegative,
    OneCase,
    Positive,
    Strict,
    either,
    optional,
    rigid_or,
)

MODEL = "model"  # for one case only
if TYPE_CHECKING:
    Include = str
else:
    Include = Literal[(*OUTPUTS, MODEL)]
_INCLUDE = (
    "More to compute: groups (v~, y~, l0), limits (of the friction law), gradient, std (standard "
    "deviation), stick_fraction, power, settling, and for one case model (what it leaves out here)"
)
_CONTACT = "One spring of stiffness k, or a ball on a flat (Hertz) whose stiffness before slip is k"
_DIRECTION = (
    "Of the oscillation, to that of sliding: across it, along it, or normal: the force oscillates"
)
_EACH = "; a list has one for each case"
_TOLERANCE = "Error of mu_macro/mu0 [-]: the smallest loaded table that meets it answers"


class Choice(Strict):
    """Which contact, which direction, which table; a model of these checks its ``kind``."""

    contact: ContactName = Field("spring", description=_CONTACT)
    direction: DirectionName = Field("across", description=_DIRECTION)
    tolerance: Positive | None = optional(_TOLERANCE)

    @cached_property
    def kind(self) -> Kind:
        """Contact and direction; InputError where they do not go together."""
        return kind_of(self.contact, self.direction)

    @property
    def words(self) -> dict[str, Any]:
        """Contact and direction as the library takes them, where they are not the usual ones."""
        words: dict[str, Any] = {}
        if self.contact != "spring":
            words["contact"] = self.contact
        if self.direction != "across":
            words["direction"] = self.direction
        return words


class InputStd(Strict):
    """Standard deviations of the inputs, in their units; independent errors are assumed."""

    mu0: NotNegative = Field(0.0, description="[-]")
    Fz: NotNegative = Field(0.0, description="[N]")
    k: NotNegative = Field(0.0, description="[N/m]")
    y0: NotNegative = Field(0.0, description="[m]")
    omega: NotNegative = Field(0.0, description="[rad/s]; or f")
    f: Hertz = Field(0.0, description="[Hz], in place of omega")
    v0: NotNegative = Field(0.0, description="[m/s]")
    Fz_amplitude: NotNegative = Field(0.0, description="[N], for direction normal")

    @model_validator(mode="after")
    def _one_frequency(self) -> Self:
        if self.omega and self.f:
            bound = "left out beside omega: give the deviation of one of them, not of both"
            raise InputError("f", self.f, bound)
        return self

    @property
    def columns(self) -> dict[str, Any]:
        """Those that are given, as the library names them: ``std_k`` and so on; none of them says
        that the inputs are exact."""
        given = {f"std_{name}": getattr(self, name) for name in self.model_fields_set}
        return given or {"std_mu0": 0.0}


class StdColumns(Strict):
    """Standard deviations of the inputs of many cases: numbers, or lists with one for each case."""

    mu0: DeviationColumn = either("[-]")
    Fz: DeviationColumn = either("[N]")
    k: DeviationColumn = either("[N/m]")
    y0: DeviationColumn = either("[m]")
    omega: DeviationColumn = either("[rad/s]; or f")
    f: DeviationColumn = either("[Hz], in place of omega")
    v0: DeviationColumn = either("[m/s]")
    Fz_amplitude: DeviationColumn = either("[N], for direction normal")

    @property
    def columns(self) -> dict[str, Any]:
        """Those that are given, as the library names them: ``std_k`` and so on."""
        return {f"std_{name}": getattr(self, name) for name in self.model_fields_set}


class Outputs(Strict):
    """What is computed beside the default answer."""

    include: Annotated[list[Include], Field(max_length=16)] | None = optional(
        f"{_INCLUDE}; in a query joined by commas"
    )

    @property
    def outputs(self) -> tuple[str, ...]:
        """The names that the library knows."""
        return tuple(name for name in self.include or () if name != MODEL)

    @property
    def model(self) -> bool:
        """Whether remarks on the model are wanted."""
        return MODEL in (self.include or ())


class Options(Outputs, Choice):
    """The options of a request in JSON."""

    std: InputStd | None = optional("Standard deviations of the inputs; they imply include=std")

    @property
    def deviations(self) -> dict[str, Any]:
        """Those that are given, as the library names them."""
        return {} if self.std is None else self.std.columns


class CaseRequest(Options, CaseInputs):
    """One case and the options of its answer."""


class Case(CaseInputs):
    """One case of a batch in rows."""

    contact: ContactName | None = optional(_CONTACT)
    direction: DirectionName | None = optional(_DIRECTION)
    std: InputStd | None = optional("Standard deviations of the inputs")

    @property
    def values(self) -> dict[str, Any]:
        """All that the library takes."""
        words = {"contact": self.contact, "direction": self.direction}
        deviations = {} if self.std is None else self.std.columns
        given = {name: word for name, word in words.items() if word is not None}
        return self.inputs | given | deviations


class CaseColumns(Outputs, InputColumns):
    """Cases as columns and the options of their answers: lists of one length; a number holds for
    every case."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{**EXAMPLE, "v0": [0.001, 0.01, 0.1], "Fz": [10.0, 20.0, 30.0]}],
            **ALTERNATIVES,
        }
    )

    contact: ContactColumn = Field(
        "spring", description=f"{_CONTACT}; a list has one for each case"
    )
    direction: DirectionColumn = Field(
        "across", description=f"{_DIRECTION}; a list has one for each case"
    )
    tolerance: Positive | None = optional(_TOLERANCE)
    std: StdColumns | None = optional("Standard deviations of the inputs; they imply include=std")

    @property
    def columns(self) -> dict[str, Any]:
        """All that the library takes: numbers, texts, and what lists hold."""
        deviations = {} if self.std is None else self.std.columns
        words = {"contact": self.contact, "direction": self.direction}
        return super().columns | words | deviations


# --- queries --------------------------------------------------------------------------------------


class Deviations(Strict):
    """The members of ``std``, each as a parameter of its own."""

    std_mu0: NotNegative | None = optional("Standard deviation [-]")
    std_Fz: NotNegative | None = optional("Standard deviation [N]")
    std_k: NotNegative | None = optional("Standard deviation [N/m]")
    std_y0: NotNegative | None = optional("Standard deviation [m]")
    std_omega: NotNegative | None = optional("Standard deviation [rad/s]")
    std_f: Hertz | None = optional("Standard deviation [Hz]")
    std_v0: NotNegative | None = optional("Standard deviation [m/s]")
    std_Fz_amplitude: NotNegative | None = optional("Standard deviation [N]")

    @property
    def deviations(self) -> dict[str, Any]:
        """Those that are given."""
        names = self.model_fields_set & _DEVIATIONS
        return {name: x for name in names if (x := getattr(self, name)) is not None}


_DEVIATIONS = frozenset(Deviations.model_fields)


class QueryOptions(Deviations, Outputs, Choice):
    """The options of a request as a query."""


class BatchOptions(Deviations, Outputs):
    """The options of a batch as a query; what is in the body is left out here."""

    contact: ContactName | None = optional(_CONTACT)
    direction: DirectionName | None = optional(_DIRECTION)
    tolerance: Positive | None = optional(_TOLERANCE)

    @property
    def members(self) -> dict[str, Any]:
        """What is given, as in a body."""
        names = ("contact", "direction", "tolerance", "include")
        given = {name: value for name in names if (value := getattr(self, name)) is not None}
        if deviations := self.deviations:
            given["std"] = {name.removeprefix("std_"): x for name, x in deviations.items()}
        return given


def _interval_or(value: Any, stiffness: Any) -> Any:
    """Two ends for low..high, which the request has taken apart; any other value is one k."""
    if isinstance(value, tuple):
        return tuple(stiffness(end) for end in value)
    return stiffness(value)


_NUMBER = r"[0-9]{1,9}(\.[0-9]{1,9})?([eE][+-]?[0-9]{1,2})?"
_INTERVAL = {"type": "string", "pattern": rf"^{_NUMBER}\.\.{_NUMBER}$"}
#: one k, the word rigid, or low..high
QueryStiffness = Annotated[
    Positive,
    WrapValidator(rigid_or),
    WrapValidator(_interval_or),
    WithJsonSchema({"anyOf": [*OR_RIGID, _INTERVAL], "examples": [1e6]}),
]


class CaseQuery(QueryOptions, OneCase):
    """One case and the options of its answer."""

    k: QueryStiffness = either(
        'Tangential stiffness of the contact [N/m], "rigid", or low..high; required',
        examples=[1e6],
    )

    @property
    def inputs(self) -> dict[str, Any]:
        """Those that are given, by name; two ends are an interval of k."""
        return with_interval(super().inputs)


class TextQuery(CaseQuery):
    """One case and the value that is wanted of its answer."""

    value: str = Field("mu_macro", description="Such as mu_macro, regime or power.saved")


def with_interval(inputs: dict[str, Any]) -> dict[str, Any]:
    """Two ends in k as k_range."""
    if isinstance(inputs.get("k"), tuple):
        inputs["k_range"] = inputs.pop("k")
    return inputs

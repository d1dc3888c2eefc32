"""What is asked beside the inputs: which contact and table, what else is computed."""

from functools import cached_property
from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, WithJsonSchema, WrapValidator, model_validator

from mumacro.errors import InputError
from mumacro.inputs.fields import RAD_PER_CYCLE
from mumacro.inputs.kind import AMPLITUDE, ContactName, DirectionName, Kind, kind_of

from .inputs import (
    ALTERNATIVES,
    EXAMPLE,
    OR_RIGID,
    Case,
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
Include = Literal[
    "groups", "limits", "gradient", "std", "stick_fraction", "power", "settling", "model"
]
_INCLUDE = (
    "More to compute: groups (v~, y~, l0), limits (of the friction law), gradient, std (standard "
    "deviation), stick_fraction, power, settling, and for one case model (what it leaves out here)"
)
_CONTACT = "One spring of stiffness k, or a ball on a flat (Hertz) whose stiffness before slip is k"
_DIRECTION = (
    "Of the oscillation, to that of sliding: across it, along it, or normal: the force oscillates"
)
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
    def by_field(self) -> dict[str, float]:
        """The same with omega for f."""
        values = self.model_dump()
        values["omega"] += RAD_PER_CYCLE * values.pop("f")
        return values


def _check_options(options: Any) -> Any:
    """Refuse deviations that have no effect, ``std`` in ``include`` without them, and a contact and
    a direction that do not go together."""
    std, kind = options.std, options.kind
    if (std is None) == ("std" in (options.include or ())):
        bound = "given if include has std"
        if std is not None:
            bound = "left out: no effect unless include has std"
        raise InputError("std", None, bound)
    if std is None:
        return options
    other = "y0" if kind.normal else AMPLITUDE
    if getattr(std, other):
        bound = f"without {other}, which direction {kind.names['direction']} does not have"
        raise InputError("std", other, bound)
    return options


class Options(Choice):
    """The options of a request in JSON."""

    include: Annotated[list[Include], Field(max_length=16)] | None = optional(_INCLUDE)
    std: InputStd | None = optional("Standard deviations of the inputs, for include=std")

    _options_agree = model_validator(mode="after")(_check_options)


class CaseRequest(Options, Case):
    """One case and the options of its answer."""


class CaseColumns(Options, InputColumns):
    """Cases as columns and the options of their answers: lists of one length; a number holds for
    every case."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{**EXAMPLE, "v0": [0.001, 0.01, 0.1], "Fz": [10.0, 20.0, 30.0]}],
            **ALTERNATIVES,
        }
    )


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
    def std(self) -> InputStd | None:
        """The deviations together; None where there are none."""
        names = self.model_fields_set & _DEVIATIONS
        if not names:
            return None
        deviations = {name.removeprefix("std_"): getattr(self, name) for name in names}
        if deviations.get("omega") and deviations.get("f"):
            raise InputError("std_f", deviations["f"], "left out beside std_omega: not of both")
        return InputStd(**deviations)


_DEVIATIONS = frozenset(Deviations.model_fields)


class QueryOptions(Deviations, Choice):
    """The options of a request as a query."""

    include: Annotated[list[Include], Field(max_length=16)] | None = optional(
        f"{_INCLUDE}; joined by commas"
    )

    _options_agree = model_validator(mode="after")(_check_options)


class BatchOptions(Deviations):
    """The options of a batch as a query; what is in the body is left out here."""

    contact: ContactName | None = optional(_CONTACT)
    direction: DirectionName | None = optional(_DIRECTION)
    tolerance: Positive | None = optional(_TOLERANCE)
    include: Annotated[list[Include], Field(max_length=16)] | None = optional(
        f"{_INCLUDE}; joined by commas"
    )

    _options_agree = model_validator(mode="after")(_check_options)

    @cached_property
    def kind(self) -> Kind:
        """Contact and direction; InputError where they do not go together."""
        return kind_of(self.contact or "spring", self.direction or "across")

    @property
    def members(self) -> dict[str, Any]:
        """What is given, as in a body."""
        names = ("contact", "direction", "tolerance", "include", "std")
        return {name: value for name in names if (value := getattr(self, name)) is not None}


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

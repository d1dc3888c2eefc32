"""What is asked beside the inputs: which contact and table, what else is computed."""

from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from mumacro.errors import InputError
from mumacro.inputs.fields import unit_of
from mumacro.inputs.kind import ContactName, DirectionName, Kind, kind_of
from mumacro.outputs import OUTPUTS

from ..understood import UNDERSTOOD
from .inputs import (
    ALTERNATIVES,
    EXAMPLE,
    CaseInputs,
    ContactColumn,
    DeviationColumn,
    DirectionColumn,
    InputColumns,
    OneCase,
    Strict,
    either,
    optional,
)
from .values import Deviation, Positive

MODEL = "model"  # for one case only
_BESIDE = (MODEL, UNDERSTOOD)  # what the library does not compute
if TYPE_CHECKING:
    Include = str
else:
    Include = Literal[(*OUTPUTS, *_BESIDE)]
_INCLUDE = (
    f"More to compute: {', '.join(OUTPUTS)}; for one case model (what it leaves out here); not for "
    "a batch inputs (what was understood of them)"
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


def _unit(name: str, more: str = "", before: str = "") -> str:
    """The unit of a deviation, which is that of its input."""
    return f"{before}[{unit_of(name)}]{more}"


class InputStd(Strict):
    """Standard deviations of the inputs, in their units; independent errors are assumed."""

    mu0: Deviation = Field(0.0, description=_unit("mu0"))
    Fz: Deviation = Field(0.0, description=_unit("Fz"))
    k: Deviation = Field(0.0, description=_unit("k"))
    y0: Deviation = Field(0.0, description=_unit("y0"))
    omega: Deviation = Field(0.0, description=_unit("omega", "; or f"))
    f: Deviation = Field(0.0, description=_unit("f", ", in place of omega"))
    v0: Deviation = Field(0.0, description=_unit("v0"))
    Fz_amplitude: Deviation = Field(
        0.0, description=_unit("Fz_amplitude", ", for direction normal")
    )

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
        members = {f"std_{name}": getattr(self, name) for name in self.model_fields_set}
        return members or {"std_mu0": 0.0}


class StdColumns(Strict):
    """Standard deviations of the inputs of many cases: numbers, or lists with one for each case."""

    mu0: DeviationColumn = either(_unit("mu0"))
    Fz: DeviationColumn = either(_unit("Fz"))
    k: DeviationColumn = either(_unit("k"))
    y0: DeviationColumn = either(_unit("y0"))
    omega: DeviationColumn = either(_unit("omega", "; or f"))
    f: DeviationColumn = either(_unit("f", ", in place of omega"))
    v0: DeviationColumn = either(_unit("v0"))
    Fz_amplitude: DeviationColumn = either(_unit("Fz_amplitude", ", for direction normal"))

    @property
    def columns(self) -> dict[str, Any]:
        """Those that are given, as the library names them: ``std_k`` and so on."""
        return {f"std_{name}": getattr(self, name) for name in self.model_fields_set}


class Outputs(Strict):
    """What is computed beside the default answer."""

    include: Annotated[list[Include], Field(max_length=16)] = either(
        f"{_INCLUDE}; in a query joined by commas"
    )

    @property
    def outputs(self) -> tuple[str, ...]:
        """The names that the library knows."""
        return tuple(name for name in self.include or () if name not in _BESIDE)

    @property
    def beside(self) -> list[str]:
        """The others: ``model`` and ``inputs``."""
        return [name for name in self.include or () if name in _BESIDE]

    @property
    def model(self) -> bool:
        """Whether remarks on the model are wanted."""
        return MODEL in (self.include or ())

    @property
    def understood(self) -> bool:
        """Whether it is wanted what was understood of the inputs."""
        return UNDERSTOOD in (self.include or ())


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
        members = {name: word for name, word in words.items() if word is not None}
        return self.inputs | members | deviations


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

    std_mu0: Deviation | None = optional(_unit("mu0", before="Standard deviation "))
    std_Fz: Deviation | None = optional(_unit("Fz", before="Standard deviation "))
    std_k: Deviation | None = optional(_unit("k", before="Standard deviation "))
    std_y0: Deviation | None = optional(_unit("y0", before="Standard deviation "))
    std_omega: Deviation | None = optional(_unit("omega", before="Standard deviation "))
    std_f: Deviation | None = optional(_unit("f", before="Standard deviation "))
    std_v0: Deviation | None = optional(_unit("v0", before="Standard deviation "))
    std_Fz_amplitude: Deviation | None = optional(
        _unit("Fz_amplitude", before="Standard deviation ")
    )

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
        inputs = {name: value for name in names if (value := getattr(self, name)) is not None}
        if deviations := self.deviations:
            inputs["std"] = {name.removeprefix("std_"): x for name, x in deviations.items()}
        return inputs


class CaseQuery(QueryOptions, OneCase):
    """One case and the options of its answer."""


class TextQuery(CaseQuery):
    """One case and the value that is wanted of its answer."""

    value: Annotated[str, BeforeValidator(str)] = Field(
        "mu_macro", description="Such as mu_macro, regime or power.saved"
    )

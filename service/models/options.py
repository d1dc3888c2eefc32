"""Define the options of a request: the contact, the table, and the outputs."""

from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field

from mumacro.inputs.cases import DEVIATIONS, KIND
from mumacro.inputs.fields import ContactName, DirectionName, Kind, kind_of
from mumacro.inputs.units import unit_of
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
    Strict,
    either,
    optional,
)
from .values import OR_ONE, Deviation, Positive

MODEL = "model"  # only for one case
OF_ONE_CASE = (MODEL, UNDERSTOOD)  # what the library does not compute
if TYPE_CHECKING:
    Include = str
else:
    Include = Literal[(*OUTPUTS, *OF_ONE_CASE)]
_INCLUDE = (
    f"More to compute: {', '.join(OUTPUTS)}; for one case model (what it leaves out here); not for "
    "a batch inputs (what was understood of them)"
)
_CONTACT = "One spring of stiffness k, or a ball on a flat (Hertz) whose stiffness before slip is k"
_DIRECTION = (
    "Of the oscillation, to that of sliding: across it, along it, or normal: the force oscillates"
)
_TOLERANCE = "Error of mu_macro/mu0 [-]: the smallest loaded table that meets it answers"


class Choice(Strict):
    """Contact, direction and table; a model of these checks its ``kind``."""

    contact: ContactName = Field("spring", description=_CONTACT)
    direction: DirectionName = Field("across", description=_DIRECTION)
    tolerance: Positive | None = optional(_TOLERANCE)

    @cached_property
    def kind(self) -> Kind:
        """Return contact and direction.  Raise InputError if they do not go together."""
        return kind_of(self.contact, self.direction)

    @property
    def words(self) -> dict[str, Any]:
        """Return contact and direction as the library takes them, if they are not the default
        ones."""
        words: dict[str, Any] = {}
        if self.contact != "spring":
            words["contact"] = self.contact
        if self.direction != "across":
            words["direction"] = self.direction
        return words


def _deviation(name: str, condition: str = "") -> str:
    """Return the meaning of a deviation, in the unit of its input."""
    return f"Standard deviation of {name} [{unit_of(name)}], of independent errors{condition}"


class Deviations(Strict):
    """Standard deviations of the inputs, in their units; they imply include=std."""

    std_mu0: Deviation | None = optional(_deviation("mu0"))
    std_Fz: Deviation | None = optional(_deviation("Fz"))
    std_k: Deviation | None = optional(_deviation("k"))
    std_y0: Deviation | None = optional(_deviation("y0"))
    std_omega: Deviation | None = optional(_deviation("omega", "; or std_f"))
    std_f: Deviation | None = optional(_deviation("f", ", in place of std_omega"))
    std_v0: Deviation | None = optional(_deviation("v0"))
    std_Fz_amplitude: Deviation | None = optional(_deviation("Fz_amplitude"))

    @property
    def deviations(self) -> dict[str, Any]:
        """Return the deviations that are there, by name."""
        names = self.model_fields_set & DEVIATIONS.keys()
        return {name: x for name in names if (x := getattr(self, name)) is not None}


class DeviationColumns(Strict):
    """Deviations of many cases: one value for all of them, or lists with one for each."""

    std_mu0: DeviationColumn = optional(_deviation("mu0"))
    std_Fz: DeviationColumn = optional(_deviation("Fz"))
    std_k: DeviationColumn = optional(_deviation("k"))
    std_y0: DeviationColumn = optional(_deviation("y0"))
    std_omega: DeviationColumn = optional(_deviation("omega", "; or std_f"))
    std_f: DeviationColumn = optional(_deviation("f", ", in place of std_omega"))
    std_v0: DeviationColumn = optional(_deviation("v0"))
    std_Fz_amplitude: DeviationColumn = optional(_deviation("Fz_amplitude"))


class Outputs(Strict):
    """Outputs in addition to the default answer."""

    include: Annotated[list[Include], Field(max_length=16), OR_ONE] = either(
        f"{_INCLUDE}; in a query joined by commas"
    )

    @property
    def outputs(self) -> tuple[str, ...]:
        """Return the names that the library knows."""
        return tuple(name for name in self.include or () if name not in OF_ONE_CASE)

    @property
    def model(self) -> bool:
        """Return whether remarks on the model are wanted."""
        return MODEL in (self.include or ())

    @property
    def understood(self) -> bool:
        """Return whether the answer must tell how the program understood the inputs."""
        return UNDERSTOOD in (self.include or ())


class Options(Deviations, Outputs, Choice):
    """The options of a request."""


class CaseRequest(Options, CaseInputs):
    """One case and the options of its answer."""


def _without_texts(schema: dict[str, Any]) -> None:
    """Describe members that are numbers, or the word rigid."""
    schema |= {"examples": [EXAMPLE], **ALTERNATIVES}
    for name in schema["properties"].keys() - KIND:
        member = schema["properties"][name]
        member["anyOf"] = [kind for kind in member["anyOf"] if "pattern" not in kind]


class Case(Deviations, CaseInputs):
    """One case of a batch in rows: numbers in SI."""

    model_config = ConfigDict(json_schema_extra=_without_texts)

    contact: ContactName | None = optional(_CONTACT)
    direction: DirectionName | None = optional(_DIRECTION)


class CaseColumns(DeviationColumns, Outputs, Choice, InputColumns):
    """Cases as columns and the options of their answers: lists of one length; a number holds for
    every case."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{**EXAMPLE, "v0": [0.001, 0.01, 0.1], "Fz": [10.0, 20.0, 30.0]}],
            **ALTERNATIVES,
        }
    )

    contact: ContactColumn = Field("spring", description=_CONTACT)
    direction: DirectionColumn = Field("across", description=_DIRECTION)


# --- queries --------------------------------------------------------------------------------------


class BatchOptions(Deviations, Outputs):
    """Options of a batch as a query; what is in the body is left out here."""

    contact: ContactName | None = optional(_CONTACT)
    direction: DirectionName | None = optional(_DIRECTION)
    tolerance: Positive | None = optional(_TOLERANCE)


class TextQuery(CaseRequest):
    """One case, and the name of the value that is wanted."""

    value: Annotated[str, BeforeValidator(str)] = Field(
        "mu_macro", description="Such as mu_macro, regime or power.saved"
    )

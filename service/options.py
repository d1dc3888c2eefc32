"""The options of a request, and the models that describe cases in OpenAPI; both from :mod:`mumacro.inputs`.

What every endpoint asks beside its case (``include``, ``tolerance``, ``std``) is a field of :class:`Options`.
"""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import cache, lru_cache, reduce
from operator import or_
from types import NoneType
from typing import Annotated, Any, Literal, Self, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model, model_validator
from pydantic.json_schema import SkipJsonSchema
from pydantic_core import PydanticCustomError

from mumacro.contact import AMPLITUDE, CONTACTS, DIRECTIONS, SPRING, ContactName, DirectionName, Kind, kind_of
from mumacro.errors import InputError
from mumacro.inputs import BOUNDS, MOST_HZ, POSITIVE, RAD_PER_CYCLE, RIGID, SI
from mumacro.inputs import NAMES as INPUTS
from mumacro.interval import BOUND, ENDS

from .answers import QUANTITIES, said
from .case import LIKE, PLAIN, Asked, asked_of, checked
from .problems import FieldFault, faults_of, refuse
from .quantities import INCLUDES

__all__ = [
    "NO_NULL", "OPTIONS", "Case", "CaseColumns", "CaseQuery", "CaseRequest", "Choice", "NotNegative", "Options",
    "OptionsQuery", "Positive", "bounded", "example", "input_fields", "kind_in", "options_of", "query_of", "read_form",
    "relation", "split_names",
]  # fmt: skip

_NAMES = frozenset(INPUTS)
_TEXTS = {
    "mu0": "Coulomb friction coefficient of the contact",
    "Fz": "Normal force",
    "k": f'Tangential contact stiffness; rigid contact must be said: "{RIGID}"',
    "y0": "Amplitude of the transverse oscillation",
    "omega": "Angular frequency of the oscillation; or f in its place",
    "f": "Frequency of the oscillation, in place of omega",
    "v0": "Sliding velocity",
    AMPLITUDE: "Amplitude of the normal force, below Fz, in place of y0 for direction normal",
    "k_low": "Lowest stiffness; with k_high in place of k",
    "k_high": "Highest stiffness",
}
UNITS = {name: SI[LIKE.get(name, name)][0] for name in (*SI, *LIKE)}
example: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}


def bounded(bound: str, text: str = "", default: Any = ..., **more: Any) -> Any:
    """A field of a model that says what its value must be; errors tell it."""
    return Field(default, description=f"{text}; {bound}" if text else bound, json_schema_extra={"bound": bound}, **more)


Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Hertz = Annotated[float, Field(ge=0, le=MOST_HZ, allow_inf_nan=False)]
_STRICT = ConfigDict(strict=True, extra="forbid")
_NUMBER = r"[0-9]{1,9}(\.[0-9]{1,9})?([eE][+-]?[0-9]{1,2})?"
_RANGE = rf"^{_NUMBER}\.\.{_NUMBER}$"
NO_NULL: Any = Annotated[None, SkipJsonSchema()]  # type: ignore[type-arg]  # not described: a query has none
Model = TypeVar("Model", bound="Choice")
Asking = TypeVar("Asking", bound="Options")


def relation(name: str, reason: str) -> PydanticCustomError:
    """A fault in the relation of several fields, and the field to change."""
    return PydanticCustomError("relation", "{field}: {reason}", {"field": name, "reason": reason})


def input_fields(
    *,
    optional: Iterable[str] = ("omega", "f", "k", "y0", *LIKE),
    null: bool = True,
    listed: bool = False,
    shown: Iterable[str] = (),
    query: bool = False,
) -> Any:
    """The inputs as fields of a model; those that are ``shown`` have an example; in a query k may be low..high."""
    fields: dict[str, Any] = {}
    for name, unit in UNITS.items():
        kind: Any = (
            Positive
            if LIKE.get(name, name) in POSITIVE and name != AMPLITUDE
            else Hertz
            if name == "f"
            else NotNegative
        )
        entry: Any = float | Literal["rigid"] if name == "k" else float
        kind = kind | Literal["rigid"] if name == "k" else kind
        kind = kind | None if name in ("omega", "f") or (name == "k" and null) else kind
        bound = BOUNDS.get(name, BOUNDS["k" if name in ENDS else "omega"])
        default = None if name in optional or name in LIKE else ...
        fields[name] = (
            kind | list[entry] if listed else kind,
            bounded(
                bound, f"{_TEXTS[name]} [{unit}]", default, **({"examples": [example[name]]} if name in shown else {})
            ),
        )
    if not query:
        fields["k_range"] = (list[Positive] | None, bounded(BOUND, "In place of k: [low, high] [N/m]", None))
    else:
        kind, info = fields["k"]
        fields["k"] = (kind | Annotated[str, Field(pattern=_RANGE)], info)
    return fields


INCLUDE = "More to compute: " + "; ".join(f"{name} ({entry.text})" for name, entry in QUANTITIES.items())
MODEL = "model"
INCLUDE += f"; {MODEL} (for one case: what the model leaves out here, and the digits that k supports)"
_INCLUDED = f"a list of names from: {', '.join((*INCLUDES, MODEL))}"
Include: Any = Literal[(*INCLUDES, MODEL)]

_DEVIATE = {name: unit for name, unit in UNITS.items() if name not in ENDS}
_std: Any = {name: (NotNegative, bounded("finite and >= 0", f"[{unit}]", 0.0)) for name, unit in _DEVIATE.items()}
_InputStd: Any = create_model("_InputStd", __config__=_STRICT, **_std)


class InputStd(_InputStd):
    """Standard deviations of the inputs, in their units; independent errors are assumed; omega or f."""

    @model_validator(mode="after")
    def _one_frequency(self) -> Self:
        given = self.model_dump()
        if given["omega"] and given["f"]:
            raise relation("f", "give the standard deviation of omega or of f, not of both")
        return self

    def by_field(self) -> dict[str, float]:
        """Standard deviations by field, omega in place of f."""
        given: dict[str, float] = self.model_dump()
        given["omega"] += RAD_PER_CYCLE * given.pop("f")
        return given


class Choice(BaseModel):
    """Which contact and which table."""

    model_config = _STRICT

    contact: ContactName = bounded(f"one of {', '.join(CONTACTS)}", "One spring, or a ball on a flat (Hertz)", "spring")
    direction: DirectionName = bounded(
        f"one of {', '.join(DIRECTIONS)}", "Direction of the oscillation, to that of sliding", "across"
    )
    tolerance: Positive | None = bounded(
        "finite and > 0", "Wanted error of mu_macro/mu0 [-]: the smallest loaded table that meets it answers", None
    )

    @model_validator(mode="after")
    def _together(self) -> Self:
        try:
            kind_of(self.contact, self.direction)
        except InputError as error:
            raise relation(error.field, f"must be {error.bound}") from None
        return self

    @property
    def kind(self) -> Kind:
        """Contact and direction."""
        return kind_of(self.contact, self.direction)


class Options(Choice):
    """The options of a request: everything but its cases."""

    include: Annotated[list[Include], Field(max_length=2 + 2 * len(INCLUDES))] | None = bounded(
        _INCLUDED, INCLUDE, None
    )
    std: InputStd | None = bounded("an object of numbers", "Standard deviations of the inputs, for include=std", None)

    @model_validator(mode="after")
    def _std_where_asked(self) -> Self:
        check_std(self)
        wrong = "y0" if self.kind.normal else AMPLITUDE
        if self.deviations().get(wrong):
            raise relation("std", f"has {wrong}, which direction {self.direction} does not have")
        return self

    def check(self, asked: Asked, one: bool = False) -> None:
        """Refuse what ``include`` asks for and such cases do not have; ``model`` is for ``one`` case."""
        faults = []
        if not one and MODEL in (self.include or ()):
            faults.append(FieldFault.of("include", f"{MODEL} is for one case: ask /v1/mu-macro", MODEL))
        for word in said(asked) if asked != PLAIN else ():
            for name in self.names():
                if word in QUANTITIES[name].lacks:
                    told = f"{name} is not computed for {word}: {QUANTITIES[name].lacks[word]}"
                    faults.append(FieldFault.of("include", told, name))
        if faults:
            refuse(faults)

    def names(self) -> tuple[str, ...]:
        """Included quantities once each, in the order of the registry."""
        return tuple(name for name in INCLUDES if name in self.include) if self.include else ()

    def deviations(self) -> dict[str, float]:
        """Standard deviations by field; empty if there are none."""
        return {} if self.std is None else self.std.by_field()


def check_std(form: Any) -> None:
    """Refuse standard deviations without ``std`` in ``include``, and the reverse."""
    if (form.std is not None) != ("std" in (form.include or ())):
        raise relation(
            "std", "is required if include has std" if form.std is None else "has no effect unless include has std"
        )


OPTIONS = tuple(Options.model_fields)
NO_OPTIONS = Options()


@lru_cache(256)
def _including(names: tuple[str, ...]) -> Options:
    return Options(include=list(names))


def options_of(
    model: type[Model], given: Mapping[str, Any], known: Iterable[str], parameter: bool | None = None
) -> tuple[Model | None, Mapping[str, Any], list[FieldFault]]:
    """The options of a request, checked by their model; the rest of it, which is its case; and faults.

    ``known`` are all names that the request may have.
    """
    if model is Options and given.keys() <= _NAMES:
        return NO_OPTIONS, given, []  # type: ignore[return-value]
    if model is Options and given.keys() - _NAMES == {"include"} and type(given["include"]) is list:
        names = given["include"]
        if len(names) < 9 and all(type(name) is str for name in names):
            with suppress(ValidationError):
                rest = {name: value for name, value in given.items() if name != "include"}
                return _including(tuple(names)), rest, []  # type: ignore[return-value]
    fields = model.model_fields
    own = {name: value for name, value in given.items() if name in fields}
    rest = {name: value for name, value in given.items() if name not in own}
    try:
        return model.model_validate(own), rest, []
    except ValidationError as error:
        return None, rest, faults_of(error, model, known, parameter)


def kind_in(given: Mapping[str, Any]) -> Kind:
    """Contact and direction among checked options; raises InputError where they do not go together."""
    return kind_of(given.get("contact", "spring"), given.get("direction", "across"))


@cache
def _known(model: type[BaseModel]) -> tuple[str, ...]:
    return *INPUTS, AMPLITUDE, "k_range", *ENDS, *model.model_fields


def read_form(
    model: type[Asking], given: Mapping[str, Any], left_out: Iterable[str] = (), null_is_rigid: bool = True,
    one: bool = False,
) -> tuple[Asking, dict[str, Any], Asked]:  # fmt: skip
    """The options and the case of a request, and what it is; ``left_out`` are the inputs that it asks for."""
    known = _known(model)
    form, rest, faults = options_of(model, given, known)
    if left_out:  # a null says the same
        rest = {name: value for name, value in rest.items() if value is not None or name not in left_out}
    asked = PLAIN
    if form is not NO_OPTIONS:
        kind = SPRING
        with suppress(InputError):  # which is among the faults
            kind = kind_in(given)
        asked = asked_of(rest, kind)
    values, more = checked(rest, left_out, null_is_rigid, known, asked)
    if form is None or more:
        refuse([*faults, *more])
    if asked != PLAIN or form.include:
        form.check(asked, one)
    return form, values, asked


def split_names(names: Any) -> Any:
    """``include=a,b`` and ``include=a&include=b`` are the same."""
    return [part.strip() for name in names for part in name.split(",")]


Case: Any = create_model(
    "Case", __config__=ConfigDict(**_STRICT, json_schema_extra={"examples": [example]}),
    __doc__="One case, in SI units; omega or f, exactly one of them.", **input_fields(),
)  # fmt: skip
CaseRequest: Any = create_model(
    "CaseRequest", __base__=(Options, Case), __doc__="One case and the options of its answer; omega or f."
)


def query_of(name: str, base: type[BaseModel], **changed: Any) -> Any:
    """The model of a query with the same members as a body; ``std`` becomes std_mu0, std_Fz, ... unless ``changed``."""
    fields: dict[str, Any] = {}
    for key, info in base.model_fields.items():
        kind, kinds = info.annotation, get_args(info.annotation)
        if NoneType in kinds:
            kind = reduce(or_, [*(one for one in kinds if one is not NoneType), NO_NULL])
        fields[key] = (kind, info)
        if key in ("contact", "direction"):  # without a default, which clients would send beside that of a body
            told = bounded(str(info.json_schema_extra["bound"]), "", None)  # type: ignore[index]
            fields[key] = (kind | NO_NULL, told)
    for key in ("std", "family"):  # objects
        fields.pop(key, None)
    if "std" in base.model_fields and not changed:
        for key, unit in _DEVIATE.items():
            kind = Hertz if key == "f" else NotNegative
            told = bounded("finite and >= 0", f"Standard deviation [{unit}]", None)
            fields[f"std_{key}"] = (kind | NO_NULL, told)
    return create_model(name, __config__=_STRICT, **{**fields, **changed})


CaseQuery: Any = query_of(
    "CaseQuery",
    create_model(
        "_Case", __base__=(Options, create_model("_Given", **input_fields(null=False, shown=example, query=True)))
    ),
)
OptionsQuery: Any = query_of("OptionsQuery", Options)
_many = {**example, "v0": [0.001, 0.01, 0.1], "Fz": [10.0, 20.0, 30.0]}
CaseColumns: Any = create_model(
    "CaseColumns", __base__=Options, __config__=None,
    __doc__="Cases as columns: lists of one length; a plain number holds for every case.",
    **input_fields(null=False, listed=True),
)  # fmt: skip
CaseColumns.model_config["json_schema_extra"] = {"examples": [_many]}

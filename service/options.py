"""The options of a request, and the models that describe cases in OpenAPI; both from
:mod:`mumacro.inputs.fields`.

What every endpoint asks beside its case (``include``, ``tolerance``, ``std``) is a field of
:class:`Options`.
"""

from collections.abc import Iterable, Mapping
from functools import cache, cached_property
from types import NoneType
from typing import Annotated, Any, Literal, Self, TypeVar, Union, get_args

from pydantic import BaseModel, Field, ValidationError, model_validator
from pydantic.json_schema import SkipJsonSchema

from mumacro.errors import InputError
from mumacro.inputs.fields import BOUNDS, LIKE, MOST_HZ, RAD_PER_CYCLE, RIGID, unit_of
from mumacro.inputs.fields import NAMES as INPUTS
from mumacro.inputs.k_range import BOUND, ENDS
from mumacro.inputs.kind import (
    AMPLITUDE,
    CONTACTS,
    DIRECTIONS,
    SPRING,
    ContactName,
    DirectionName,
    Kind,
    kind_of,
)

from .answers import QUANTITIES, Wanted, said
from .case import LEAST, Asked
from .models import Strict, model
from .problems import FieldFault, faults_of, refuse
from .quantities import INCLUDES

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
NAMES = (*INPUTS, AMPLITUDE)
Name: Any = Literal[NAMES]
MODEL = "model"  # what only one case may include
example: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}


def bounded(bound: str, text: str = "", default: Any = ..., **more: Any) -> Any:
    """A field of a model that says what its value must be; errors tell it."""
    return Field(
        default,
        description=f"{text}; {bound}" if text else bound,
        json_schema_extra={"bound": bound},
        **more,
    )


Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
_Hertz = Annotated[float, Field(ge=0, le=MOST_HZ, allow_inf_nan=False)]
_NUMBER = r"[0-9]{1,9}(\.[0-9]{1,9})?([eE][+-]?[0-9]{1,2})?"
_Range = Annotated[str, Field(pattern=rf"^{_NUMBER}\.\.{_NUMBER}$")]
_NO_NULL: Any = Annotated[None, SkipJsonSchema()]  # type: ignore[type-arg]  # not described: a query has none
Model = TypeVar("Model", bound="Choice")


# --- options --------------------------------------------------------------------------------------


class Choice(Strict):
    """Which contact and which table."""

    contact: ContactName = bounded(
        f"one of {', '.join(CONTACTS)}", "One spring, or a ball on a flat (Hertz)", "spring"
    )
    direction: DirectionName = bounded(
        f"one of {', '.join(DIRECTIONS)}",
        "Direction of the oscillation, to that of sliding",
        "across",
    )
    tolerance: Positive | None = bounded(
        "finite and > 0",
        "Wanted error of mu_macro/mu0 [-]: the smallest loaded table that meets it answers",
        None,
    )

    @model_validator(mode="after")
    def _together(self) -> Self:
        kind_of(self.contact, self.direction)
        return self

    @cached_property
    def kind(self) -> Kind:
        """Contact and direction."""
        return kind_of(self.contact, self.direction)


def includes(word: str, text: str) -> tuple[Any, Any]:
    """The member ``include``: the quantities, and one more ``word``."""
    names = (*INCLUDES, word)
    told = "; ".join(f"{name} ({QUANTITIES[name].text})" for name in INCLUDES)
    kind = Annotated[list[Literal[names]], Field(max_length=2 * len(names))] | None  # type: ignore[valid-type]
    return kind, bounded(
        f"a list of names from: {', '.join(names)}",
        f"More to compute: {told}; {word} ({text})",
        None,
    )


_DEVIATE = [*INPUTS, AMPLITUDE]
_std: Any = {
    name: (NotNegative, bounded("finite and >= 0", f"[{unit_of(name)}]", 0.0)) for name in _DEVIATE
}


class InputStd(model("_InputStd", "", Strict, **_std)):  # type: ignore[misc]
    """Standard deviations of the inputs, in their units; independent errors are assumed; omega or
    f."""

    @model_validator(mode="after")
    def _one_frequency(self) -> Self:
        if self.omega and self.f:
            raise InputError(
                "f", self.f, "left out beside omega: give the deviation of one of them, not of both"
            )
        return self


_include: Any = includes(
    MODEL, "for one case: what the model leaves out here, and the digits that k supports"
)


class Options(model("_Including", "", Choice, include=_include)):  # type: ignore[misc]
    """The options of a request: everything but its cases."""

    std: InputStd | None = bounded(
        "an object of numbers", "Standard deviations of the inputs, for include=std", None
    )

    @model_validator(mode="after")
    def _std_where_asked(self) -> Self:
        """Refuse standard deviations without ``std`` in ``include``, and the reverse."""
        if (self.std is None) == ("std" in (self.include or ())):
            bound = (
                "given if include has std"
                if self.std is None
                else "left out: no effect unless include has std"
            )
            raise InputError("std", self.std, bound)
        wrong = "y0" if self.kind.normal else AMPLITUDE
        if self.std and getattr(self.std, wrong):
            raise InputError(
                "std", wrong, f"without {wrong}, which direction {self.direction} does not have"
            )
        return self

    def wanted(self, asked: Asked, one: bool = False) -> Wanted:
        """What is asked of such cases; refused where they do not have it.  ``model`` is for ``one``
        case."""
        if found := self._wanted.get((asked, one)):
            return found
        # once each, in order
        faults, include = [], tuple(name for name in INCLUDES if name in (self.include or ()))
        if not one and MODEL in (self.include or ()):
            faults.append(
                FieldFault.of("include", f"{MODEL} is for one case: ask /v1/mu-macro", MODEL)
            )
        lacks = [
            (name, word, QUANTITIES[name].lacks.get(word))
            for word in said(asked)
            for name in include
        ]
        for name, word, why in lacks:
            if why is not None:
                faults.append(
                    FieldFault.of("include", f"{name} is not computed for {word}: {why}", name)
                )
        if faults:
            refuse(faults)
        std: dict[str, float] = {} if self.std is None else self.std.model_dump()
        if std:
            std["omega"] += RAD_PER_CYCLE * std.pop("f")
        return self._wanted.setdefault((asked, one), Wanted(asked, include, std))

    @cached_property
    def _wanted(self) -> dict[tuple[Asked, bool], Wanted]:
        return {}


OPTIONS = tuple(Options.model_fields)


def options_of(
    model: type[Model], given: Mapping[str, Any], parameter: bool | None = None
) -> tuple[Model | None, Mapping[str, Any], list[FieldFault]]:
    """The options of a request, checked by their model; the rest of it, which is its case; and
    faults."""
    fields, own, rest = names_in(model)[0], {}, given
    if not fields.isdisjoint(given):
        rest = dict(given)
        own = {name: rest.pop(name) for name in given if name in fields}
    key = model, repr(own)
    form = _valid.get(key)
    if form is None:
        try:
            form = model.model_validate(own)
        except ValidationError as error:
            return None, rest, faults_of(error, model, (), parameter)
        if len(_valid) >= _KEPT:
            _valid.clear()
        if len(key[1]) < _LONG:
            _valid[key] = form
    return form, rest, []


_KEPT, _LONG = 256, 1024
_valid: dict[tuple[Any, str], Any] = {}  # most requests have the options of another one


@cache
def names_in(model: Any) -> tuple[frozenset[str], tuple[str, ...]]:
    """The names of the options, and of all that a request may have."""
    return frozenset(model.model_fields), (*NAMES, "k_range", *ENDS, *model.model_fields)


def kind_in(given: Mapping[str, Any]) -> Kind:
    """Contact and direction; one spring across where they are bad, which is a fault of the
    options."""
    try:
        return kind_of(given.get("contact", "spring"), given.get("direction", "across"))
    except InputError:
        return SPRING


# --- models of cases ------------------------------------------------------------------------------


def input_fields(
    optional: Iterable[str] = ("omega", "f", "k", "y0"),
    listed: bool = False,
    shown: Iterable[str] = example,
) -> Any:
    """The inputs as fields of a model; those that are ``shown`` have an example."""
    fields: dict[str, Any] = {}
    for name, text in _TEXTS.items():
        kind: Any = Positive if LEAST[name] else _Hertz if name == "f" else NotNegative
        entry: Any = float | Literal["rigid"] if name == "k" else float
        kind = kind | Literal["rigid"] if name == "k" else kind
        kind = kind | None if name in ("omega", "f") else kind
        more = {"examples": [example[name]]} if name in shown else {}
        default = None if name in optional or name in LIKE else ...
        info = bounded(BOUNDS[name], f"{text} [{unit_of(name)}]", default, **more)
        fields[name] = (kind | list[entry] if listed else kind, info)
    fields["k_range"] = (
        list[Positive] | None,
        bounded(BOUND, "In place of k: [low, high] [N/m]", None),
    )
    return fields


_text = "One case, in SI units; omega or f, exactly one of them."
Case = model("Case", _text, Strict, example=example, **input_fields())
CaseRequest = model(
    "CaseRequest", "One case and the options of its answer; omega or f.", Options, Case
)
#: the inputs of a question about one of them, which is left out
Five = model("Five", "", **input_fields(INPUTS, shown=[name for name in example if name != "v0"]))
CaseColumns = model(
    "CaseColumns",
    "Cases as columns: lists of one length; a plain number holds for every case.",
    Options,
    example={**example, "v0": [0.001, 0.01, 0.1], "Fz": [10.0, 20.0, 30.0]},
    **input_fields(listed=True, shown=()),
)


def query_of(base: type[BaseModel]) -> Any:
    """The model of a query with the same members as a body.

    ``std`` becomes std_mu0, std_Fz, ...; k may be low..high in place of k_range; there is no null.
    """
    fields: dict[str, Any] = {}
    for key, info in base.model_fields.items():
        kinds = [kind for kind in get_args(info.annotation) if kind is not NoneType]
        null = len(kinds) < len(get_args(info.annotation))
        kind: Any = Union[(*kinds, _NO_NULL)] if null else info.annotation
        fields[key] = (kind | _Range if key == "k" else kind, info)
        # without a default, which clients would send beside that of a body
        if key in ("contact", "direction"):
            fields[key] = (kind | _NO_NULL, bounded(str(info.json_schema_extra["bound"]), "", None))  # type: ignore[index]
    fields.pop("k_range", None)
    if fields.pop("std", None):
        for key in _DEVIATE:
            told = bounded("finite and >= 0", f"Standard deviation [{unit_of(key)}]", None)
            fields[f"std_{key}"] = ((_Hertz if key == "f" else NotNegative) | _NO_NULL, told)
    return model(f"{base.__name__.removesuffix('Request')}Query", "", Strict, **fields)

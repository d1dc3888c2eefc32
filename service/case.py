"""A case, many cases, and the options of a request: the only place where they are checked.

Every form of asking decodes to ``{name: number | list | array}``.  :func:`checked` checks one case and
:func:`columns_of` many, both entry by entry with :func:`number`; names, bounds and reasons are those of
:mod:`mumacro.inputs`.  The models of cases describe the same in OpenAPI.
"""

import math
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from types import NoneType
from typing import Annotated, Any, Literal, Self, TypeVar, Union, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model, model_validator
from pydantic.json_schema import SkipJsonSchema
from pydantic_core import PydanticCustomError

from mumacro.inputs import (
    BOUNDS,
    FIELDS,
    GAP,
    MOST_HZ,
    POSITIVE,
    RAD_PER_CYCLE,
    RIGID,
    SI,
    is_rigid,
    number_hint,
    refusal,
    unknown_name,
)
from mumacro.inputs import NAMES as INPUTS

from .answers import QUANTITIES
from .problems import FieldFault, Kind, RequestError, faults_of, refuse
from .quantities import INCLUDES

__all__ = [
    "INCLUDE", "INPUTS", "MAX_ERRORS", "NO_OPTIONS", "OPTIONS", "Case", "CaseColumns", "CaseQuery", "CaseRequest",
    "Columns", "InputStd", "NotNegative", "Options", "OptionsQuery", "Positive", "Reason", "bounded", "check_std",
    "checked", "columns_of", "example", "faults_in", "input_fields", "number", "options_of", "query_of", "read_form",
    "relation", "split_names", "too_large",
]  # fmt: skip

Array = NDArray[np.float64]
#: the bad field, or None for the case as a whole, and why
Reason = tuple[str | None, str]
MAX_ERRORS = 1000  # bad cases of a batch that are listed
STATE_OMEGA = "is required: omega [rad/s], or f [Hz] in its place"
ONE_FREQUENCY = "omega is given, too: give exactly one of omega [rad/s] and f [Hz]"
STATE_K = f"is required: the tangential stiffness [N/m], or {RIGID}"
LEFT_OUT = "must be left out: it is the unknown or swept input"
_LEAST = {name: 5e-324 if name in POSITIVE else 0.0 for name in INPUTS}
_MOST = {name: MOST_HZ if name == "f" else sys.float_info.max for name in INPUTS}


# --- one value, one case ------------------------------------------------------------------------------


def number(name: str, value: object, null_is_rigid: bool = True) -> tuple[float, str | None]:
    """The value of an input and None; or NaN and the reason why it is none.  A rigid contact is infinite."""
    if type(value) is float or type(value) is int:
        try:
            found = float(value)
        except OverflowError:
            found = math.inf
        if _LEAST[name] <= found <= _MOST[name]:
            return found, None
        return math.nan, refusal(name, found)
    if name == "k":
        if isinstance(value, str) and is_rigid(value):
            return math.inf, None
        if value is None:
            return (math.inf, None) if null_is_rigid else (math.nan, GAP)
    return math.nan, number_hint(name, value)


def faults_in(given: Iterable[str], left_out: Iterable[str] = ()) -> list[FieldFault]:
    """Faults between the names of the inputs that are given: missing ones, omega and f, or one that is asked for."""
    names, out = set(given), set(left_out)
    if out & {"omega", "f"}:
        out |= {"omega", "f"}
    faults = [FieldFault.of(name, LEFT_OUT) for name in INPUTS if name in names & out]
    for name in FIELDS:
        if name in names or name in out:
            continue
        if name == "omega":
            if "f" not in names:
                faults.append(FieldFault.of(name, STATE_OMEGA))
        else:
            faults.append(FieldFault.of(name, STATE_K if name == "k" else "is required"))
    if {"omega", "f"} <= names - out:
        faults.append(FieldFault.of("f", ONE_FREQUENCY))
    return faults


def checked(
    given: Mapping[str, Any], left_out: Iterable[str] = (), null_is_rigid: bool = True, known: Iterable[str] = INPUTS
) -> tuple[dict[str, float], list[FieldFault]]:
    """The inputs of one case by field, with ``omega`` for ``f``, and all of its faults.

    Parameters
    ----------
    given : mapping
        Inputs by name; ``f`` may stand in place of ``omega``.
    left_out : iterable of str
        Inputs that the request asks for, which must not be given.
    null_is_rigid : bool
        Whether a k of null is a rigid contact: in a single case; in a batch it is a gap.
    known : iterable of str
        All names that the request may have, for the advice on another one.
    """
    values: dict[str, float] = {}
    faults: list[FieldFault] = []
    for name, value in given.items():
        if name not in _LEAST:
            faults.append(FieldFault.of(name, unknown_name(name, known) if len(faults) < 100 else "unknown", value))
        elif value is not None or name not in ("omega", "f"):
            values[name], reason = number(name, value, null_is_rigid)
            if reason is not None:
                faults.append(FieldFault.of(name, reason, value))
    if left_out or len(values) != 6 or not ("omega" in values) ^ ("f" in values):
        faults += faults_in(values, left_out)
    if "f" in values and not faults:
        values["omega"] = RAD_PER_CYCLE * values.pop("f")
    return values, faults


# --- many cases ---------------------------------------------------------------------------------------


@dataclass
class Columns:
    """The six inputs of ``size`` cases.

    Attributes
    ----------
    size : int
    six : list of ndarray
        In the order of FIELDS, (size,) or (1,) where one value holds for all; a value that is no number is NaN.
    reasons : dict of int to Reason
        Why a case could not be read, for the first MAX_ERRORS of each column; such a case has a NaN.
    hertz : bool
        Whether the frequency was given as f.
    listed : bool
        Whether any input came as a list.
    rows : bool
        Whether the cases came one by one.
    """

    size: int
    six: list[Array]
    reasons: dict[int, Reason] = field(default_factory=dict)
    hertz: bool = False
    listed: bool = True
    rows: bool = False

    def part(self, start: int, stop: int) -> list[Array]:
        """The six columns of the cases from ``start`` to ``stop``."""
        return [column[start:stop] if column.size > 1 else column for column in self.six]

    def reason(self, index: int) -> Reason:
        """Why a case is bad."""
        if index in self.reasons:
            return self.reasons[index]
        for name, column in zip(FIELDS, self.six, strict=True):
            value = column[index if column.size > 1 else 0].item()
            if not _LEAST[name] <= value <= (math.inf if name == "k" else _MOST[name]):
                shown = "f" if name == "omega" and self.hertz else name
                return shown, refusal(shown, value)
        return None, "is no legal case"


def too_large(max_batch: int) -> RequestError:
    """The error for a batch with more cases than the settings allow."""
    return RequestError(
        Kind.BATCH_TOO_LARGE,
        f"a batch may have up to {max_batch} cases, this one has more: split it, or stream it as NDJSON",
        max_batch=max_batch,
    )


def columns_of(
    given: Mapping[str, Any], max_batch: int, known: Iterable[str] = INPUTS, faults: Iterable[FieldFault] = ()
) -> Columns:
    """Columns from numbers, lists and arrays of float64 by name.

    A bad entry of a list spoils its own case; a bad name or a bad number that holds for every case refuses the batch,
    together with the ``faults`` that were found before.

    Raises
    ------
    RequestError
    """
    lists = {name: value for name, value in given.items() if isinstance(value, (list, np.ndarray)) and name in _LEAST}
    if any(len(value) > max_batch for value in lists.values()):
        raise too_large(max_batch)
    plain, more = checked(
        {name: 1.0 if name in lists else value for name, value in given.items()}, null_is_rigid=False, known=known
    )
    faults = [*faults, *more]
    lengths = {name: len(value) for name, value in lists.items()}
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"{name}: {lengths[name]}" for name in INPUTS if name in lengths)
        first = next(lengths[name] for name in INPUTS if name in lengths)
        faults += [
            FieldFault.of(name, f"lists must have one length; given {told}")
            for name in INPUTS
            if lengths.get(name, first) != first
        ]
    if faults:
        refuse(faults)
    reasons: dict[int, Reason] = {}
    columns = {name: np.array([value]) for name, value in plain.items()}
    for name in INPUTS:  # in their order, so that the first bad field of a case is told
        if name in lists:
            columns[name] = _column(name, lists[name], reasons)
    if "f" in lists:
        with np.errstate(over="ignore"):  # infinite, which is refused
            columns["omega"] = columns["f"] * RAD_PER_CYCLE
    size = next(iter(lengths.values()), 1)
    return Columns(size, [columns[name] for name in FIELDS], reasons, "f" in lists, bool(lists))


def _column(name: str, values: list[Any] | Array, reasons: dict[int, Reason]) -> Array:
    if isinstance(values, np.ndarray):
        return values
    column = np.empty(len(values))
    told = 0
    for i, value in enumerate(values):
        column[i], reason = number(name, value, null_is_rigid=False)
        if reason is not None and told < MAX_ERRORS:
            told += 1
            reasons.setdefault(i, (name, reason))
    return column


# --- models -------------------------------------------------------------------------------------------

_TEXTS = {
    "mu0": "Coulomb friction coefficient of the contact",
    "Fz": "Normal force",
    "k": f'Tangential contact stiffness; rigid contact must be said: "{RIGID}"',
    "y0": "Amplitude of the transverse oscillation",
    "omega": "Angular frequency of the oscillation; or f in its place",
    "f": "Frequency of the oscillation, in place of omega",
    "v0": "Sliding velocity",
}
example: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}


def bounded(bound: str, text: str = "", default: Any = ..., **more: Any) -> Any:
    """A field of a model that says what its value must be; errors tell it."""
    return Field(default, description=f"{text}; {bound}" if text else bound, json_schema_extra={"bound": bound}, **more)


Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Hertz = Annotated[float, Field(ge=0, le=MOST_HZ, allow_inf_nan=False)]
_STRICT = ConfigDict(strict=True, extra="forbid")
Model = TypeVar("Model", bound=BaseModel)


def relation(name: str, reason: str) -> PydanticCustomError:
    """A fault in the relation of several fields, and the field to change."""
    return PydanticCustomError("relation", "{field}: {reason}", {"field": name, "reason": reason})


def input_fields(
    *, optional: Iterable[str] = ("omega", "f"), null: bool = True, listed: bool = False, shown: Iterable[str] = ()
) -> Any:
    """The inputs as fields of a model; those that are ``shown`` have an example."""
    fields: dict[str, Any] = {}
    for name, (unit, _) in SI.items():
        kind: Any = Positive if name in POSITIVE else Hertz if name == "f" else NotNegative
        entry: Any = float | Literal["rigid"] if name == "k" else float
        kind = kind | Literal["rigid"] if name == "k" else kind
        kind = kind | None if name in ("omega", "f") or (name == "k" and null) else kind
        bound = BOUNDS["omega" if name == "f" else name]
        default = None if name in optional else ...
        fields[name] = (
            kind | list[entry] if listed else kind,
            bounded(
                bound, f"{_TEXTS[name]} [{unit}]", default, **({"examples": [example[name]]} if name in shown else {})
            ),
        )
    return fields


INCLUDE = "More to compute: " + "; ".join(f"{name} ({entry.text})" for name, entry in QUANTITIES.items())
_INCLUDED = f"a list of names from: {', '.join(INCLUDES)}"
Include: Any = Literal[INCLUDES]

_std: Any = {name: (NotNegative, bounded("finite and >= 0", f"[{unit}]", 0.0)) for name, (unit, _) in SI.items()}
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


class Options(BaseModel):
    """The options of a request: everything but its cases."""

    model_config = _STRICT

    include: list[Include] | None = bounded(_INCLUDED, INCLUDE, None, max_length=2 * len(INCLUDES))
    tolerance: Positive | None = bounded(
        "finite and > 0", "Wanted error of mu_macro/mu0 [-]: the smallest loaded table that meets it answers", None
    )
    std: InputStd | None = bounded("an object of numbers", "Standard deviations of the inputs, for include=std", None)

    @model_validator(mode="after")
    def _std_where_asked(self) -> Self:
        check_std(self)
        return self

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


def options_of(
    model: type[Model], given: Mapping[str, Any], known: Iterable[str], parameter: bool | None = None
) -> tuple[Model | None, Mapping[str, Any], list[FieldFault]]:
    """The options of a request, checked by their model; the rest of it, which is its case; and faults.

    ``known`` are all names that the request may have.
    """
    if model is Options and given.keys() <= _LEAST.keys():
        return NO_OPTIONS, given, []  # type: ignore[return-value]
    fields = model.model_fields
    own = {name: value for name, value in given.items() if name in fields}
    rest = {name: value for name, value in given.items() if name not in own}
    try:
        return model.model_validate(own), rest, []
    except ValidationError as error:
        return None, rest, faults_of(error, model, known, parameter)


@cache
def _known(model: type[BaseModel]) -> tuple[str, ...]:
    return *INPUTS, *model.model_fields


def read_form(
    model: type[Model], given: Mapping[str, Any], left_out: Iterable[str] = (), null_is_rigid: bool = True
) -> tuple[Model, dict[str, float]]:
    """The options and the case of a request; ``left_out`` are the inputs that it asks for.

    Raises
    ------
    RequestError
        With all faults of both.
    """
    known = _known(model)
    form, rest, faults = options_of(model, given, known)
    if left_out:  # a null says the same
        rest = {name: value for name, value in rest.items() if value is not None or name not in left_out}
    values, more = checked(rest, left_out, null_is_rigid, known)
    if form is None or more:
        refuse([*faults, *more])
    return form, values


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
        kinds = get_args(info.annotation)
        kind = Union[(*(kind for kind in kinds if kind is not NoneType), SkipJsonSchema[None])]
        fields[key] = (kind if NoneType in kinds else info.annotation, info)
    fields.pop("std", None)
    if not changed:
        for key, (unit, _) in SI.items():
            kind = Hertz if key == "f" else NotNegative
            fields[f"std_{key}"] = (
                kind | SkipJsonSchema[None],
                bounded("finite and >= 0", f"Standard deviation [{unit}]", None),
            )
    return create_model(name, __config__=_STRICT, **{**fields, **changed})


CaseQuery: Any = query_of(
    "CaseQuery",
    create_model("_Case", __base__=(Options, create_model("_Given", **input_fields(null=False, shown=example)))),
)
OptionsQuery: Any = query_of("OptionsQuery", Options)
_many = {**example, "v0": [0.001, 0.01, 0.1], "Fz": [10.0, 20.0, 30.0]}
CaseColumns: Any = create_model(
    "CaseColumns", __base__=Options, __config__=None,
    __doc__="Cases as columns: lists of one length; a plain number holds for every case.",
    **input_fields(null=False, listed=True),
)  # fmt: skip
CaseColumns.model_config["json_schema_extra"] = {"examples": [_many]}

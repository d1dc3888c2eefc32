"""Models for OpenAPI, and those of answers: the columns come from the registry of
:mod:`service.answers`."""

from collections.abc import Callable, Iterable
from functools import cache
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, create_model

from .answers import DEFAULT, INTERVAL, QUANTITIES, Part, nested, of_amplitude
from .quantities import INCLUDES

_create: Any = create_model


class Strict(BaseModel):
    """What has its own members only, of their own types."""

    model_config = ConfigDict(strict=True, extra="forbid")


def model(
    name: str, text: str, /, *bases: type[BaseModel], example: Any = None, **members: Any
) -> Any:
    """A model; a member is a type, or what :func:`told` or :func:`optional` gives."""
    given = {
        key: member if isinstance(member, tuple) else (member, ...)
        for key, member in members.items()
    }
    found = _create(name, __base__=bases or None, __doc__=text, **given)
    if example is not None:
        found.model_config["json_schema_extra"] = {"examples": [example]}
    return found


def told(kind: Any, text: str) -> tuple[Any, Any]:
    """A member with its meaning."""
    return kind, Field(description=text)


def optional(kind: Any, text: str = "") -> tuple[Any, Any]:
    """A member that is there only where it was requested, or does not apply everywhere."""
    return kind | None, Field(None, description=text or None)


def many(kind: Any) -> Any:
    """A list of a kind, or of a model."""
    return list[kind]


TableLabel = model(
    "TableLabel",
    "The table that an answer came from.",
    id=told(str, "Name of the table"),
    tolerance=told(float, "The error of mu_macro/mu0 [-] that it was built to"),
)
Answered = model("Answered", "The fields of every answer.", table=TableLabel, api_version=str)
BatchFault = model(
    "BatchFault",
    "Why one case of a batch has no result.",
    index=told(int, "Position in the batch, from 0"),
    field=told(str | None, "The bad field; null when the case as a whole is bad"),
    reason=str,
)
_BatchEnd = model(
    "_BatchEnd",
    "",
    Answered,
    errors=told(many(BatchFault), "One entry per bad case, in order; the first 1000 of them"),
    n_errors=told(int, "Number of bad cases, listed or not"),
)


# --- columns --------------------------------------------------------------------------------------


def _member(part: Part, listed: bool, make: Callable[..., Any] = optional) -> Any:
    kind: Any = (
        Literal[tuple(dict.fromkeys(part.names))]
        if part.path == "regime"
        else str
        if part.names
        else float
    )
    kind = kind if part in DEFAULT and part.path != "error_bound" and not listed else kind | None
    return make(many(kind) if listed else kind, part.described)


def default(listed: bool) -> dict[str, Any]:
    """The default outputs as members of a model."""
    members = {part.path: _member(part, listed, told) for part in DEFAULT}
    return members | {part.path: _member(part, listed) for part in INTERVAL}


@cache
def grouped(parts: Iterable[Part], listed: bool, text: str) -> dict[str, Any]:
    """Columns that are there if requested as members of a model, those with a dot in their path in
    models of theirs."""
    members: dict[str, Any] = {}
    for part in parts:
        either = dict.fromkeys((part, of_amplitude(part)))  # of which there is one
        members |= {
            one.path: _member(one, listed, told if len(either) == 1 else optional) for one in either
        }
    fields = nested(members)
    for name, found in fields.items():
        if isinstance(found, dict):
            title = "".join(word.capitalize() for word in name.split("_")) + (
                "Columns" if listed else ""
            )
            found = model(title, f"{text}.", **found), Field()
        fields[name] = optional(found[0], found[1].description or "Only if requested")
    return fields


def included(listed: bool) -> dict[str, Any]:
    """Members that ``include`` adds to a model of an answer."""
    found = (grouped(QUANTITIES[name].parts, listed, QUANTITIES[name].text) for name in INCLUDES)
    return {name: member for members in found for name, member in members.items()}


Result = model("Result", "Answer to one case.", **default(False), **included(False))


ModelRow = model(
    "ModelRow",
    "One thing that the model leaves out, see docs/validity.md.",
    row=told(str, "Its name"),
    text=told(str, "What it does here"),
    effect=told(float | None, "Relative change of mu_macro; null: not known"),
)
CaseAnswer = model(
    "CaseAnswer",
    "Answer to one case.",
    Result,
    Answered,
    model=optional(many(ModelRow), "Only if requested. What the model leaves out here"),
    digits=optional(int, "Only with model. Digits of mu_macro that k supports"),
)
ColumnsAnswer = model(
    "ColumnsAnswer",
    "Answer to a batch in columns, order kept; null: a bad case.",
    _BatchEnd,
    **default(True),
    **included(True),
)
RowsAnswer = model(
    "RowsAnswer",
    "Answer to a batch in rows, order kept; null where a case is bad.",
    _BatchEnd,
    results=many(Result | None),
)
TableAnswer = model(
    "TableAnswer",
    "Properties of a table.",
    Answered,
    id=str,
    tolerance=float,
    checksum=told(str, "SHA-256 of the table's content"),
    file=str,
    size_bytes=int,
    max_abs_error=told(float | None, "Largest verified absolute error of mu_macro/mu0 [-]"),
    max_rel_error=told(float | None, "Largest verified relative error of mu_macro [-]"),
    error_distribution=told(
        dict[str, dict[str, float]],
        "By quantity: the error that a share of the verified points does not exceed; bound over "
        "error",
    ),
    attributes=told(dict[str, Any], "Root attributes of the file"),
    blocks=list[dict[str, Any]],
    loaded=told(many(TableLabel), "All loaded tables, tightest first"),
    service_version=str,
)
Health = model(
    "Health",
    "Answer of a health endpoint.",
    status=Literal["alive", "ready"],
    tables=optional(many(TableLabel)),
    api_version=str,
    service_version=str,
)
FieldProblem = model(
    "FieldProblem",
    "One bad field.",
    pointer=optional(str, "JSON pointer into the body"),
    parameter=optional(str, "Query parameter"),
    field=str,
    value=(
        Any,
        Field(None, description="As given; a number that JSON cannot hold is a text, such as NaN"),
    ),
    reason=str,
    bound=optional(str),
)
Problem = model(
    "Problem",
    "Problem details, RFC 9457.",
    type=str,
    title=str,
    status=int,
    detail=str,
    instance=str,
    request_id=optional(str),
    errors=optional(many(FieldProblem)),
    n_errors=optional(int),
)

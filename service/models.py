"""Models of answers, for OpenAPI: the columns come from the registry of :mod:`service.answers`."""

from collections.abc import Iterable
from functools import cache
from typing import Any, Literal

from pydantic import BaseModel, Field, create_model

from .answers import DEFAULT, INTERVAL, QUANTITIES, Part, nested, of_amplitude
from .quantities import INCLUDES

__all__ = [
    "Answered", "BatchFault", "CaseAnswer", "ColumnsAnswer", "Health", "Problem", "RowsAnswer", "TableAnswer",
    "TableLabel", "default", "grouped", "included", "model", "optional", "told",
]  # fmt: skip

_create: Any = create_model


def model(name: str, text: str, *bases: type[BaseModel], **members: Any) -> Any:
    """A model that is described and never made."""
    return _create(name, __base__=bases or None, __doc__=text, **members)


def told(kind: Any, text: str) -> tuple[Any, Any]:
    """A member with its meaning."""
    return kind, Field(description=text)


def optional(kind: Any, text: str) -> tuple[Any, Any]:
    """A member that may be left out."""
    return kind | None, Field(None, description=text)


class TableLabel(BaseModel):
    """The table that an answer came from."""

    id: str = Field(description="Name of the table")
    tolerance: float = Field(description="The error of mu_macro/mu0 [-] that it was built to")


class Answered(BaseModel):
    """The fields of every answer."""

    table: TableLabel
    api_version: str


class BatchFault(BaseModel):
    """Why one case of a batch has no result."""

    index: int = Field(description="Position in the batch, from 0")
    field: str | None = Field(description="The bad field; null when the case as a whole is bad")
    reason: str


class _BatchEnd(Answered):
    errors: list[BatchFault] = Field(description="One entry per bad case, in order; the first 1000 of them")
    n_errors: int = Field(description="Number of bad cases, listed or not")


def _kind(part: Part, listed: bool, null: bool = True) -> Any:
    kind: Any = Literal[tuple(dict.fromkeys(part.names))] if part.path == "regime" else str if part.names else float
    kind = kind | None if null else kind
    return list[kind] if listed else kind


def default(listed: bool) -> dict[str, Any]:
    """The default outputs as members of a model."""
    members = {
        part.path: told(_kind(part, listed, listed or part.path == "error_bound"), part.described) for part in DEFAULT
    }
    ends = {part.path: optional(_kind(part, listed), f"Only for an interval. {part.described}") for part in INTERVAL}
    return members | ends


def grouped(parts: Iterable[Part], listed: bool, text: str) -> dict[str, Any]:
    """Columns that are there if requested as members of a model, those with a dot in their path in models of theirs."""
    members: dict[str, Any] = {}
    for part in parts:
        either = {one.path: one for one in (part, of_amplitude(part))}
        make = told if len(either) == 1 else optional  # else there is one of the two
        members |= {path: make(_kind(one, listed), one.described) for path, one in either.items()}
    fields: dict[str, Any] = {}
    for name, found in nested(members).items():
        if isinstance(found, dict):
            title = "".join(word.capitalize() for word in name.split("_")) + ("Columns" if listed else "")
            fields[name] = optional(model(title, f"{text}.", **found), "Only if requested")
        else:
            fields[name] = optional(found[0], f"Only if requested. {found[1].description}")
    return fields


@cache
def included(listed: bool) -> dict[str, Any]:
    """Members that ``include`` adds to a model of an answer."""
    found = (grouped(QUANTITIES[name].parts, listed, QUANTITIES[name].text) for name in INCLUDES)
    return {name: member for members in found for name, member in members.items()}


Result = model("Result", "Answer to one case.", **default(False), **included(False))


class ModelRow(BaseModel):
    """One thing that the model leaves out, see docs/validity.md."""

    row: str = Field(description="Its name")
    text: str = Field(description="What it does here")
    effect: float | None = Field(description="Relative change of mu_macro; null: not known")


CaseAnswer = model(
    "CaseAnswer", "Answer to one case.", Result, Answered,
    model=optional(list[ModelRow], "Only if requested. What the model leaves out here"),
    digits=optional(int, "Only with model. Digits of mu_macro that k supports"),
)  # fmt: skip
ColumnsAnswer = model(
    "ColumnsAnswer", "Answer to a batch in columns, order kept; null: a bad case.", _BatchEnd,
    **default(True), **included(True),
)  # fmt: skip
RowsAnswer = model(
    "RowsAnswer", "Answer to a batch in rows, order kept; null where a case is bad.", _BatchEnd,
    results=(list[Result | None], ...),
)  # fmt: skip


class TableAnswer(Answered):
    """Properties of a table."""

    id: str
    tolerance: float
    checksum: str = Field(description="SHA-256 of the table's content")
    file: str
    size_bytes: int
    max_abs_error: float | None = Field(description="Largest verified absolute error of mu_macro/mu0 [-]")
    max_rel_error: float | None = Field(description="Largest verified relative error of mu_macro [-]")
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
    value: Any = Field(None, description="As given; a number that JSON cannot hold is a text, such as NaN")
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

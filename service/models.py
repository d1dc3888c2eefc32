"""Models of answers, for OpenAPI: the columns come from the registry of :mod:`service.answers`."""

from typing import Any, Literal

from pydantic import BaseModel, Field, create_model

from .answers import DEFAULT, INTERVAL, QUANTITIES, Part, nested, of_amplitude

__all__ = [
    "Answered", "BatchFault", "CaseAnswer", "ColumnsAnswer", "Health", "Problem", "RowsAnswer", "TableAnswer",
    "TableLabel", "included",
]  # fmt: skip


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


def _kind(part: Part, listed: bool, null: bool) -> Any:
    kind: Any = Literal[tuple(dict.fromkeys(part.names))] if part.path == "regime" else part.kind
    kind = kind | None if null else kind
    return list[kind] if listed else kind


def default(listed: bool) -> dict[str, Any]:
    """The default outputs as members of a model."""
    return {
        part.path: (_kind(part, listed, listed or part.path == "error_bound"), Field(description=part.described))
        for part in DEFAULT
    } | {
        part.path: (
            _kind(part, listed, True) | None,
            Field(None, description=f"Only for an interval. {part.described}"),
        )
        for part in INTERVAL
    }


def included(listed: bool) -> dict[str, Any]:
    """Members that ``include`` adds to a model of an answer."""
    fields: dict[str, Any] = {}
    for quantity in QUANTITIES.values():
        kinds: dict[str, Any] = {}
        for part in quantity.parts:
            kinds[part.path] = (_kind(part, listed, True), Field(description=part.described))
            other = of_amplitude(part)
            if other != part:  # there is one of them
                for one in (part, other):
                    kinds[one.path] = (_kind(one, listed, True) | None, Field(None, description=one.described))
        for name, found in nested(kinds).items():
            if isinstance(found, dict):
                title = "".join(word.capitalize() for word in name.split("_")) + ("Columns" if listed else "")
                model: Any = create_model(title, __doc__=f"{quantity.text}.", **found)
                fields[name] = (model | None, Field(None, description="Only if requested"))
            else:
                kind, told = found
                fields[name] = (kind | None, Field(None, description=f"Only if requested. {told.description}"))
    return fields


_made: Any = create_model
Result: type[BaseModel] = _made("Result", __doc__="Answer to one case.", **default(False), **included(False))


class ModelRow(BaseModel):
    """One thing that the model leaves out, see docs/validity.md."""

    row: str = Field(description="Its name")
    text: str = Field(description="What it does here")
    effect: float | None = Field(description="Relative change of mu_macro; null: not known")


_about: Any = (list[ModelRow] | None, Field(None, description="Only if requested. What the model leaves out here"))
_digits: Any = (int | None, Field(None, description="Only with model. Digits of mu_macro that k supports"))
CaseAnswer: type[BaseModel] = _made(
    "CaseAnswer", __base__=(Result, Answered), __doc__="Answer to one case.", model=_about, digits=_digits
)
ColumnsAnswer: type[BaseModel] = _made(
    "ColumnsAnswer", __base__=_BatchEnd, __doc__="Answer to a batch in columns, order kept; null: a bad case.",
    **default(True), **included(True),
)  # fmt: skip
RowsAnswer: type[BaseModel] = _made(
    "RowsAnswer", __base__=_BatchEnd, __doc__="Answer to a batch in rows, order kept; null where a case is bad.",
    results=(list[Result | None], ...),  # type: ignore[valid-type]
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

"""The description of the interface, from the same models that check requests."""

from collections.abc import Sequence
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from service import __version__, forms
from service import schemas as models
from service.intake import ARROW, JSON, NDJSON

__all__ = [
    "batch_bodies",
    "case_parameters",
    "describe_batch",
    "describe_json",
    "describe_problems",
    "describe_umbridge",
    "form_parameters",
    "install",
    "json_body",
    "option_parameters",
    "table_parameters",
    "umbridge_body",
]

_REF = "#/components/schemas/{model}"
_DESCRIPTION = (
    "Macroscopic coefficient of friction of a spring-loaded contact whose base slides at v0 and oscillates "
    "across the sliding direction. Inputs in SI units; answers come from a table verified against the full model. "
    "Errors are problem details (RFC 9457)."
)
_WHY = {
    400: "The body is empty or cannot be read",
    408: "The body did not come in time",
    401: "An API key is in force, and none or a wrong one was sent",
    413: "The body or the batch is too large",
    415: "The body has another media type",
    422: "Invalid, missing or unknown fields",
    503: "Not ready or overloaded; see Retry-After",
}
_REQUESTS: tuple[Any, ...] = (
    models.Case, models.CaseRequest, models.BatchColumns, forms.SolveForRequest, forms.LawRequest
)  # fmt: skip
_ARROW_BODY = "Arrow IPC stream with number columns mu0, Fz, y0, omega, v0 and, unless contact is rigid, k"
_ARROW_ANSWER = (
    "Arrow IPC stream, order kept: mu_macro, mu_ratio, regime, error_bound, source, error; "
    "null results and a text in error where a case is bad; the table and the version in the schema's metadata; what "
    "include adds are columns like stick_fraction, stick_fraction_bound, power.oscillation, power.oscillation_bound"
)
_ANSWERS: tuple[Any, ...] = (
    models.CaseAnswer,
    models.ColumnsAnswer,
    models.RowsAnswer,
    forms.SolveForAnswer,
    forms.LawAnswer,
    models.TableAnswer,
    models.Health,
    models.Problem,
)
_PARAMETER_SCHEMAS = models.CaseRequest.model_json_schema()["properties"]
_EXAMPLE = models.Case.model_json_schema()["examples"][0]
_COLUMNS = models.BatchColumns.model_json_schema()["examples"][0]


def describe_json(answer: str | Sequence[str], *statuses: int) -> dict[int | str, dict[str, Any]]:
    """Describe the answer (one model or several) and the problems that an endpoint can give."""
    names = (answer,) if isinstance(answer, str) else tuple(answer)
    refs = [{"$ref": _REF.format(model=name)} for name in names]
    schema = refs[0] if len(refs) == 1 else {"oneOf": refs}
    return {
        200: {"description": "The answer", "content": {"application/json": {"schema": schema}}},
        **describe_problems(*statuses),
    }


def json_body(model: str) -> dict[str, Any]:
    """Describe a body of JSON of one model."""
    schema = {"$ref": _REF.format(model=model)}
    return {"requestBody": {"required": True, "content": {"application/json": {"schema": schema}}}}


def describe_problems(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Describe the problems that an endpoint can give."""
    problem = {"schema": {"$ref": _REF.format(model="Problem")}}
    return {
        status: {"description": _WHY[status], "content": {"application/problem+json": problem}} for status in statuses
    }


def umbridge_body(example: dict[str, Any]) -> dict[str, Any]:
    """Describe the body of a UM-Bridge call; what it holds beside the model's name is the protocol's business."""
    schema = {
        "type": "object",
        "required": ["name"],
        "properties": {"name": {"type": "string", "enum": ["mu_macro", "mu_macro_log10"]}},
    }
    return {"requestBody": {"required": True, "content": {"application/json": {"schema": schema, "example": example}}}}


def describe_umbridge(example: dict[str, Any] | None = None) -> dict[int | str, dict[str, Any]]:
    """Describe the answers of a UM-Bridge call: the protocol has its own form of errors, 400 and 500."""
    text = {"type": "string"}
    error = {
        "type": "object",
        "required": ["error"],
        "properties": {"error": {"type": "object", "required": ["type", "message"], "properties": {"type": text}}},
    }
    answer: dict[str, Any] = {"schema": {"type": "object"}}
    if example is not None:
        answer["example"] = example
    described: dict[int | str, dict[str, Any]] = {
        200: {"description": "The answer", "content": {"application/json": answer}}
    }
    for status, why in ((400, "ModelNotFound, UnsupportedFeature or InvalidInput"), (500, "InvalidOutput")):
        described[status] = {"description": why, "content": {"application/json": {"schema": error}}}
    return {**described, **describe_problems(401, 413)}


def batch_bodies() -> dict[str, Any]:
    """Describe the forms of a batch."""
    columns, row = {"$ref": _REF.format(model="BatchColumns")}, {"$ref": _REF.format(model="Case")}
    rows = {"type": "array", "items": row}
    return {
        "required": True,
        "content": {
            JSON: {
                "schema": {"oneOf": [columns, rows]},
                "examples": {"columns": {"value": _COLUMNS}, "rows": {"value": [_EXAMPLE, {**_EXAMPLE, "v0": 0.1}]}},
            },
            NDJSON: {
                "schema": {"oneOf": [columns, rows, row], "description": "One of these a line"},
                "examples": {"a line": {"value": _COLUMNS}},
            },
            ARROW: {"schema": {"type": "string", "format": "binary", "description": _ARROW_BODY}},
        },
    }


def describe_batch() -> dict[int | str, dict[str, Any]]:
    """Describe the answers to a batch, each in the form of its question."""
    described = describe_json(("ColumnsAnswer", "RowsAnswer"), 400, 401, 408, 413, 415, 422, 503)
    content = described[200]["content"]
    lines = ("ColumnsAnswer", "RowsAnswer", "CaseAnswer", "Problem")
    content[NDJSON] = {
        "schema": {
            "oneOf": [{"$ref": _REF.format(model=name)} for name in lines],
            "description": "One of these a line, in the order of the lines",
        }
    }
    content[ARROW] = {"schema": {"type": "string", "format": "binary", "description": _ARROW_ANSWER}}
    return described


def case_parameters() -> list[dict[str, Any]]:
    """Query parameters of one case, from the model of its JSON form."""
    names = [name for name in _PARAMETER_SCHEMAS if name != "std"]
    return [_parameter(name, name in models.Case.model_fields and name != "k") for name in names] + _std_parameters()


def option_parameters() -> list[dict[str, Any]]:
    """Query parameters of a batch."""
    return [_parameter(name, False) for name in ("include", "tolerance")] + _std_parameters()


def _std_parameters() -> list[dict[str, Any]]:
    schemas = models.InputStd.model_json_schema()["properties"]
    return [
        {
            "name": f"std_{name}",
            "in": "query",
            "required": False,
            "description": f"Standard deviation of {name} {schema['description']}, where include asks for std",
            "schema": {"type": "number", "minimum": 0},
        }
        for name, schema in schemas.items()
    ]


def table_parameters() -> list[dict[str, Any]]:
    """Query parameters that choose a table."""
    identity = {
        "name": "id", "in": "query", "required": False, "schema": {"type": "string"}, "description": "Name of the table"
    }  # fmt: skip
    return [identity, _parameter("tolerance", False)]


def form_parameters(form: type[BaseModel]) -> list[dict[str, Any]]:
    """Query parameters of a request that also exists as a JSON body."""
    example = form.model_json_schema()["examples"][0]
    described = []
    for name, full in form.model_json_schema()["properties"].items():
        schema = dict(full)
        description = schema.pop("description", "")
        for choice in schema.pop("anyOf", ()):
            if choice.get("type") != "null":
                schema.update(choice)
        required = form.model_fields[name].is_required()
        parameter: dict[str, Any] = {
            "name": name, "in": "query", "required": required, "description": description,
            "schema": {key: value for key, value in schema.items() if key not in ("default", "title")},
        }  # fmt: skip
        if name in example:
            parameter["example"] = example[name]
        if name == "include":
            parameter.update(style="form", explode=False)
        described.append(parameter)
    return described


def _parameter(name: str, required: bool) -> dict[str, Any]:
    # A query has no null: leaving a parameter out says it.
    schema = dict(_PARAMETER_SCHEMAS[name])
    description = schema.pop("description", "")
    for choice in schema.pop("anyOf", ()):
        if choice.get("type") != "null":
            schema.update(choice)
    schema.pop("default", None)
    schema.pop("title", None)
    parameter: dict[str, Any] = {
        "name": name, "in": "query", "required": required, "description": description, "schema": schema
    }  # fmt: skip
    if name in _EXAMPLE:
        parameter["example"] = _EXAMPLE[name]
    if name == "include":
        parameter.update(style="form", explode=False)
    return parameter


def install(app: FastAPI) -> None:
    """Make ``app.openapi()`` return the description with the models of ``service.schemas`` in it."""

    def describe() -> dict[str, Any]:
        if app.openapi_schema is None:
            description = get_openapi(title="mumacro", version=__version__, description=_DESCRIPTION, routes=app.routes)
            wanted = [(model, "validation") for model in _REQUESTS] + [(model, "serialization") for model in _ANSWERS]
            _, definitions = models_json_schema(wanted, ref_template=_REF)  # type: ignore[arg-type]
            schemas = description.setdefault("components", {}).setdefault("schemas", {})
            schemas.update(definitions["$defs"])
            app.openapi_schema = description
        return app.openapi_schema

    app.openapi = describe  # type: ignore[method-assign]

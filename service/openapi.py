"""The parts of the OpenAPI description that do not follow from the types of the routes."""

from collections.abc import Mapping, Sequence
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic.json_schema import models_json_schema

from . import __version__
from . import schemas as models
from .formats import Format

__all__ = ["ANSWER_HEADERS", "batch_operation", "describe_umbridge", "install", "problems", "umbridge_body"]

_REF = "#/components/schemas/{model}"
_DESCRIPTION = (
    "Macroscopic coefficient of friction of a spring-loaded contact whose base slides at v0 and oscillates "
    "across the sliding direction. Inputs in SI units; answers come from a table verified against the full model. "
    "Errors are problem details (RFC 9457)."
)
_WHY = {
    400: "The body is empty or cannot be read, or a header is wrong or given twice",
    408: "The body was not complete in time",
    401: "The service needs an API key, and none or a wrong one was sent",
    413: "The body or the batch is too large",
    415: "The body has another media type",
    416: "The file has no such part",
    422: "Invalid, missing or unknown fields",
    503: "Not ready or overloaded; see Retry-After",
}
_ID = {"description": "The request's id, as in the log", "schema": {"type": "string"}}
_RETRY = {"description": "Seconds after which to send the request again", "schema": {"type": "integer"}}
#: headers of an answer that may be cached
ANSWER_HEADERS = {
    "ETag": {"description": "The tag of this answer, for If-None-Match", "schema": {"type": "string"}},
    "Cache-Control": {"description": "How long, and by whom, the answer may be cached", "schema": {"type": "string"}},
}
# Models that no route names by its type.
_REQUESTS: tuple[Any, ...] = (models.Case, models.BatchColumns)
_ANSWERS: tuple[Any, ...] = (models.CaseAnswer, models.ColumnsAnswer, models.RowsAnswer, models.Problem)


def problems(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Describe the problems that an endpoint can give."""
    problem = {"schema": {"$ref": _REF.format(model="Problem")}}
    described: dict[int | str, dict[str, Any]] = {}
    for status in statuses:
        described[status] = {"description": _WHY[status], "content": {"application/problem+json": problem}}
        if status == 503:
            described[status]["headers"] = {"Retry-After": _RETRY}
    return described


def batch_operation(forms: Sequence[Format]) -> dict[str, Any]:
    """The body of a batch and its answer, in these forms."""
    body: dict[str, Any] = {}
    answer: dict[str, Any] = {}
    for entry in forms:
        for content, described in ((body, entry.body), (answer, entry.answer)):
            known = content.get(entry.media_type)
            if known is None:
                content[entry.media_type] = dict(described)
            else:
                one_of = known["schema"].get("oneOf", [known["schema"]])
                content[entry.media_type] = {**known, "schema": {"oneOf": [*one_of, described["schema"]]}}
    return {
        "body": {"required": True, "content": body},
        "answer": {"description": "The answers, in the format of the request", "content": answer},
    }


def umbridge_body(example: dict[str, Any]) -> dict[str, Any]:
    """Describe the body of a UM-Bridge call: the model's name.  The protocol defines the rest."""
    schema = {
        "type": "object",
        "required": ["name"],
        "properties": {"name": {"type": "string", "enum": ["mu_macro", "mu_macro_log10"]}},
    }
    return {"requestBody": {"required": True, "content": {"application/json": {"schema": schema, "example": example}}}}


def describe_umbridge(example: dict[str, Any] | None = None) -> dict[int | str, dict[str, Any]]:
    """Describe the answers of a UM-Bridge call: the protocol defines its own errors, 400 and 500."""
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
    return {**described, **problems(401, 413)}


def _with_headers(paths: Mapping[str, Any]) -> None:
    for methods in paths.values():
        for operation in methods.values():
            for response in operation.get("responses", {}).values():
                response.setdefault("headers", {})["X-Request-ID"] = _ID


def install(app: FastAPI, *, keys: bool) -> None:
    """Make ``app.openapi()`` return the description with the models of batches, headers and keys in it."""

    def describe() -> dict[str, Any]:
        if app.openapi_schema is None:
            description = get_openapi(
                title="mumacro", version=__version__, description=_DESCRIPTION, routes=app.routes,
                servers=[{"url": app.root_path}] if app.root_path else None,
            )  # fmt: skip
            wanted = [(model, "validation") for model in _REQUESTS] + [(model, "serialization") for model in _ANSWERS]
            _, definitions = models_json_schema(wanted, ref_template=_REF)  # type: ignore[arg-type]
            components = description.setdefault("components", {})
            schemas = components.setdefault("schemas", {})
            for name in ("HTTPValidationError", "ValidationError"):  # FastAPI's form of 422, which is not used
                schemas.pop(name, None)
            schemas.update({name: schema for name, schema in definitions["$defs"].items() if name not in schemas})
            _with_headers(description["paths"])
            if keys:
                components["securitySchemes"] = {
                    "key": {"type": "apiKey", "in": "header", "name": "X-API-Key"},
                    "bearer": {"type": "http", "scheme": "bearer"},
                }
                description["security"] = [{"key": []}, {"bearer": []}]
            app.openapi_schema = description
        return app.openapi_schema

    app.openapi = describe  # type: ignore[method-assign]

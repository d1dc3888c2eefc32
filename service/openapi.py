"""The OpenAPI description: paths from the records of the endpoints, schemas from their models."""

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from . import __version__
from .case import Case, CaseColumns
from .models import CaseAnswer, ColumnsAnswer, Problem, RowsAnswer
from .routes import JSON, Endpoint

__all__ = ["describe"]

_DESCRIPTION = (
    "Macroscopic coefficient of friction of a spring-loaded contact. A body slides at v0 and oscillates across the "
    "sliding direction. Inputs in SI units; answers come from a table verified against the full model. "
    "Errors are problem details (RFC 9457)."
)
_WHY = {
    400: "The request cannot be read: an empty body, a wrong text, a header that is given twice",
    401: "The service needs an API key, and none or a wrong one was sent",
    408: "The request was not complete in time",
    413: "The body or the batch is too large",
    415: "The body has another media type",
    416: "The file has no such part",
    422: "Invalid, missing or unknown fields",
    503: "Not ready or overloaded; see Retry-After",
}
_ID = {"X-Request-ID": {"description": "The request's id, as in the log", "schema": {"type": "string"}}}
_RETRY = {"description": "Seconds after which to send the request again", "schema": {"type": "integer"}}
_REF = "#/components/schemas/{model}"
# models that no endpoint names by its type
_MORE: tuple[tuple[Any, str], ...] = (
    (Case, "validation"), (CaseColumns, "validation"), (CaseAnswer, "serialization"),
    (ColumnsAnswer, "serialization"), (RowsAnswer, "serialization"), (Problem, "serialization"),
)  # fmt: skip


def _names(model: Any) -> list[Any]:
    """The models of an answer that is one of several."""
    return list(getattr(model, "__args__", (model,)))


def _ref(model: Any) -> dict[str, Any]:
    refs = [{"$ref": _REF.format(model=one.__name__)} for one in _names(model)]
    return refs[0] if len(refs) == 1 else {"anyOf": refs}


def describe(endpoints: Sequence[Endpoint], root_path: str, keys: bool) -> dict[str, Any]:
    """The whole description."""
    wanted = list(_MORE)
    for endpoint in endpoints:
        if endpoint.name:
            wanted += [(model, "validation") for model in (endpoint.query, endpoint.body) if model is not None]
            wanted += [(model, "serialization") for model in _names(endpoint.model) if model is not None]
    _, definitions = models_json_schema(list(dict.fromkeys(wanted)), ref_template=_REF)  # type: ignore[arg-type]
    schemas: dict[str, Any] = definitions["$defs"]
    paths: dict[str, dict[str, Any]] = {}
    for endpoint in endpoints:
        if endpoint.name:
            operation = _operation(endpoint, schemas)
            paths.setdefault(endpoint.path, {})[endpoint.method.lower()] = operation
    for endpoint in endpoints:
        if endpoint.name and endpoint.query is not None:
            schemas.pop(endpoint.query.__name__, None)
    described: dict[str, Any] = {
        "openapi": "3.1.0",
        "info": {"title": "mumacro", "version": __version__, "description": _DESCRIPTION},
        "paths": paths,
        "components": {"schemas": schemas},
    }
    if root_path:
        described["servers"] = [{"url": root_path}]
    if keys:
        described["components"]["securitySchemes"] = {
            "key": {"type": "apiKey", "in": "header", "name": "X-API-Key"},
            "bearer": {"type": "http", "scheme": "bearer"},
        }
        described["security"] = [{"key": []}, {"bearer": []}]
    return described


def _operation(endpoint: Endpoint, schemas: Mapping[str, Any]) -> dict[str, Any]:
    operation: dict[str, Any] = {
        "tags": [endpoint.tag],
        "summary": endpoint.summary,
        "description": " ".join((endpoint.answer.__doc__ or "").split()),
        "operationId": endpoint.name,
    }
    if endpoint.query is not None:
        operation["parameters"] = _parameters(endpoint.query, schemas)
    if endpoint.body is not None:
        operation["requestBody"] = {"required": True, "content": {JSON: {"schema": _ref(endpoint.body)}}}
    elif endpoint.request is not None:
        operation["requestBody"] = dict(endpoint.request)
    responses: dict[str, Any] = {}
    answer: dict[str, Any] = {"description": "The answer"}
    if endpoint.model is not None:
        answer["content"] = {JSON: {"schema": _ref(endpoint.model)}}
    responses["200"] = answer
    for status, more in endpoint.content.items():
        responses.setdefault(str(status), {}).update(more)
    problem = {"application/problem+json": {"schema": _ref(Problem)}}
    for status in endpoint.statuses:
        responses[str(status)] = {"description": _WHY[status], "content": problem}
        if status == 503:
            responses[str(status)]["headers"] = {"Retry-After": _RETRY}
    for response in responses.values():
        response["headers"] = {**response.get("headers", {}), **_ID}
    return {**operation, "responses": responses}


def _parameters(model: type[BaseModel], schemas: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The fields of a query as parameters; a list is given as names joined by commas."""
    schema = schemas[model.__name__]
    found = []
    for name, described in schema["properties"].items():
        kinds = [kind for kind in described.get("anyOf", [described]) if kind.get("type") != "null"]
        outer = ("title", "description", "default", "bound", "anyOf", "examples")
        if "object" in (kind.get("type") for kind in kinds):
            continue  # such as family, which a query cannot hold
        kind = kinds[0] if len(kinds) == 1 else {"anyOf": kinds}
        kind = {key: value for key, value in kind.items() if key not in outer or (key == "anyOf" and len(kinds) > 1)}
        if described.get("default") is not None:
            kind["default"] = described["default"]
        parameter = {"name": name, "in": "query", "required": name in schema.get("required", ()), "schema": kind}
        if "examples" in described:
            kind["examples"] = described["examples"]
        if "description" in described:
            parameter["description"] = described["description"]
        if kind.get("type") == "array":
            kind["minItems"] = 1
            parameter |= {"style": "form", "explode": False}
        found.append(parameter)
    return found

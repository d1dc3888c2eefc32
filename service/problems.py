"""Exception -> RFC 9457 problem details.

Every error that leaves the application is ``application/problem+json``: ``type, title, status,
detail, instance``, the request id, and for bad fields ``errors`` with a JSON pointer (bodies) or a
parameter (queries), the value, and what it must be.  All faults of a request are reported at once.
No traceback reaches a user.
"""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, NoReturn

import orjson
from pydantic import BaseModel, ValidationError
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.types import Scope

from mumacro.errors import InputError, MumacroError, TableError
from mumacro.inputs.fields import BOUNDS
from mumacro.inputs.fields import NAMES as INPUTS
from mumacro.inputs.units import number_hint, unknown_name

MAX_FIELD_FAULTS = 100
_MAX_TEXT = 80
_NO_VALUE = object()
CLOSE = {"Connection": "close"}


@dataclass(frozen=True)
class FieldFault:
    """One bad field of a request: where it is, what was given, why it is refused.

    ``parameter``: whether it stands in the query; None: as in all of its request (a GET has a
    query, a POST a body).
    """

    path: tuple[str | int, ...]
    reason: str
    value: object = _NO_VALUE
    parameter: bool | None = None

    @classmethod
    def of(cls, name: str, reason: str, value: object = _NO_VALUE) -> "FieldFault":
        """The fault of a field at the top of the body, or of a parameter."""
        return cls((name,), reason, value)

    def as_json(self, query: bool) -> dict[str, object]:
        """The entry of ``errors``; the pointer is in RFC 6901's URI fragment form, as in RFC
        9457."""
        names = [step for step in self.path if isinstance(step, str)]
        entry: dict[str, object] = {}
        if query if self.parameter is None else self.parameter:
            # one for each input
            entry["parameter"] = _shown("_".join(names)) if names != ["std"] else "std_mu0"
        else:
            steps = (
                str(_shown(str(step))).replace("~", "~0").replace("/", "~1") for step in self.path
            )
            entry["pointer"] = "#" + "".join(f"/{step}" for step in steps)
        entry["field"] = _shown(names[-1]) if names else "body"
        if self.value is not _NO_VALUE:
            entry["value"] = _shown(self.value)
        entry["reason"] = self.reason
        if self.path and self.path[-1] in BOUNDS:
            entry["bound"] = BOUNDS["v0" if self.path[0] == "std" else str(self.path[-1])]
        return entry


def _shown(value: object) -> object:
    """The value as JSON can hold it, and short enough to be shown: NaN becomes the text "NaN"."""
    if isinstance(value, str):
        short = value if len(value) <= _MAX_TEXT else value[: _MAX_TEXT - 1] + "…"
        return short.encode("utf-8", "replace").decode()  # half of a surrogate pair is no text
    if isinstance(value, float) and not math.isfinite(value):
        return json.dumps(value)
    if isinstance(value, int) and not -(2**63) <= value < 2**64:
        return "an integer beyond double range"
    if value is None or isinstance(value, (int, float)):
        return value
    return "an object" if isinstance(value, Mapping) else "a list"


def refuse(faults: Sequence[FieldFault], **members: Any) -> NoReturn:
    """Raise the error that reports all of these faults."""
    first = faults[0]
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    raise RequestError(
        Kind.INVALID_VALUE,
        f"{first.as_json(False)['field']}: {first.reason}{more}",
        faults,
        **members,
    )


def faults_of(
    error: ValidationError,
    model: type[BaseModel],
    known: Iterable[str],
    parameter: bool | None = None,
) -> list[FieldFault]:
    """Pydantic's entries as faults, one per place.

    A field of ``model`` says in its ``json_schema_extra`` what it must be (``bound``); ``known``
    are the names that the request may have.
    """
    found: dict[tuple[str | int, ...], FieldFault] = {}
    for entry in error.errors(include_url=False):
        path, kind, value = entry["loc"], entry["type"], entry["input"]
        if kind == "missing":
            value, reason = _NO_VALUE, "is required"
        elif kind == "extra_forbidden":
            reason = unknown_name(str(path[-1]), known if len(path) == 1 else INPUTS)
        elif (
            kind == "value_error"
        ):  # in the relation of several fields: InputError names the one to change
            fault: InputError = entry["ctx"]["error"]
            path, value, reason = (*path, fault.field), _NO_VALUE, f"must be {fault.bound}"
        elif kind == "float_type":
            reason = number_hint(str(path[0]), value)
        elif (
            kind in ("greater_than_equal", "finite_number") and len(path) > 1
        ):  # one of several numbers
            reason = f"must be {BOUNDS['v0']}"
        else:
            extra: Any = model.model_fields[str(path[0])].json_schema_extra
            reason = f"must be {extra['bound']}"
        found.setdefault(path, FieldFault(path, reason, value, parameter))
    return list(found.values())


class Kind(Enum):
    """A type of problem: status, title, and headers.  The connection closes where the rest of a
    request is not read."""

    MALFORMED_HTTP = 400, "The request is no HTTP that this service reads", CLOSE
    MALFORMED_BODY = 400, "The request cannot be read"
    UNAUTHORIZED = 401, "An API key is needed", CLOSE
    NOT_FOUND = 404, "Not Found"
    METHOD_NOT_ALLOWED = 405, "Method Not Allowed"
    SLOW_CLIENT = 408, "The request did not come in time", CLOSE
    BODY_TOO_LARGE = 413, "The body is too large", CLOSE
    BATCH_TOO_LARGE = 413, "The batch is too large"
    UNSUPPORTED_BODY = 415, "The body's media type is not supported", CLOSE
    RANGE_NOT_SATISFIABLE = 416, "The file has no such part"
    INVALID_VALUE = 422, "The request holds invalid values"
    HEAD_TOO_LARGE = 431, "The head is too large", CLOSE
    UNEXPECTED = 500, "An unexpected error"
    NOT_INSTALLED = 501, "This service lacks a package"
    NOT_READY = 503, "The service is not ready", {"Retry-After": "5"}
    OVERLOADED = 503, "The service is overloaded", {**CLOSE, "Retry-After": "1"}
    OUT_OF_MEMORY = 503, "The service has too little memory", {"Retry-After": "1"}
    TOOK_TOO_LONG = 503, "The request took too long", {**CLOSE, "Retry-After": "1"}

    def __init__(self, status: int, title: str, headers: Mapping[str, str] | None = None) -> None:
        self.status, self.title, self.headers = status, title, headers or {}


class RequestError(MumacroError):
    """A request that cannot be answered: the kind, why, the bad fields, headers and members of the
    document."""

    def __init__(
        self,
        kind: Kind,
        detail: str,
        faults: Sequence[FieldFault] = (),
        headers: Mapping[str, str] | None = None,
        **members: object,
    ) -> None:
        self.kind, self.detail, self.faults = kind, detail, tuple(faults)
        self.headers, self.members = headers or {}, members
        super().__init__(detail)


def _request_error(error: Exception) -> RequestError:
    """What an exception means for its request; nothing of an unknown one is told."""
    if isinstance(error, RequestError):
        return error
    if isinstance(error, HTTPException):  # of Starlette: no such path, method or part of a file
        named = {
            Kind.MALFORMED_BODY,
            Kind.NOT_FOUND,
            Kind.METHOD_NOT_ALLOWED,
            Kind.RANGE_NOT_SATISFIABLE,
        }
        kind = next((kind for kind in named if kind.status == error.status_code), Kind.UNEXPECTED)
        return RequestError(kind, error.detail, headers=error.headers)
    if isinstance(error, InputError):
        fault = FieldFault.of(error.field, f"must be {error.bound}", error.value)
        return RequestError(Kind.INVALID_VALUE, f"{error.field} must be {error.bound}", [fault])
    if isinstance(error, TableError):
        return RequestError(Kind.NOT_READY, f"table {error.path.name}: {error.reason}")
    if isinstance(error, MemoryError):
        return RequestError(Kind.OUT_OF_MEMORY, "send a smaller request, or send it later")
    detail = "The request could not be answered; the log has the reason under its request id."
    return RequestError(Kind.UNEXPECTED, detail)


def document_of(error: Exception, scope: Scope) -> dict[str, Any]:
    """The problem document of an exception."""
    found = _request_error(error)
    slug = found.kind.name.lower().replace("_", "-")
    body: dict[str, Any] = {"type": f"urn:problem-type:mumacro:{slug}", "title": found.kind.title}
    body |= {"status": found.kind.status, "detail": found.detail, "instance": scope["path"]}
    if "request_id" in scope:
        body["request_id"] = scope["request_id"]
    if found.faults:
        query = scope["method"] in ("GET", "HEAD")
        body["errors"] = [fault.as_json(query) for fault in found.faults[:MAX_FIELD_FAULTS]]
        body["n_errors"] = len(found.faults)
    return body | found.members


def problem_of(error: Exception, scope: Scope) -> Response:
    """The response to an exception."""
    found = _request_error(error)
    headers = {"Cache-Control": "no-store", **found.kind.headers, **found.headers}
    content = orjson.dumps(document_of(found, scope))
    return Response(
        content, found.kind.status, headers=headers, media_type="application/problem+json"
    )

"""Exception -> RFC 9457 problem details, in one table.

Every error that leaves the application is ``application/problem+json``: ``type, title, status, detail, instance``, the
request id, and for bad fields ``errors`` with a JSON pointer (bodies) or a parameter (queries), the value, and what it
must be.  All faults of a request are reported at once.  No traceback reaches a user.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from http import HTTPStatus
from typing import Any, NoReturn

import orjson
from pydantic import BaseModel, ValidationError
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.types import Scope

from mumacro.errors import InputError, MumacroError, TableError
from mumacro.inputs import BOUNDS, number_hint, unknown_name
from mumacro.inputs import NAMES as INPUTS

__all__ = [
    "CLOSE", "PROBLEMS", "BatchTooLargeError", "BodyTooLargeError", "FieldFault", "HeadTooLargeError",
    "InvalidFieldsError", "MalformedBodyError", "NotReadyError", "OverloadedError", "RequestError", "SlowClientError",
    "TookTooLongError", "UnauthorizedError", "UnsupportedBodyError", "faults_of", "in_query", "pieces_of_problem",
    "problem_of", "refuse",
]  # fmt: skip

MAX_FIELD_FAULTS = 100
_MAX_TEXT = 80
_NO_VALUE = object()
#: header of a response that is sent before the whole request was read
CLOSE = {"Connection": "close"}


@dataclass(frozen=True)
class FieldFault:
    """One bad field of a request: where it is, what was given, why it is refused.

    ``parameter``: whether it stands in the query; None: as in all of its request (a GET has a query, a POST a body).
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
        """The entry of ``errors``; the pointer is in RFC 6901's URI fragment form, as in RFC 9457."""
        steps = [str(_shown(str(step))) for step in self.path]
        entry: dict[str, object] = {}
        if query if self.parameter is None else self.parameter:
            names = [step for step in self.path if isinstance(step, str)]
            entry["parameter"] = _shown("_".join(names)) if names != ["std"] else "std_mu0"  # one for each input
        else:
            entry["pointer"] = "#" + "".join("/" + step.replace("~", "~0").replace("/", "~1") for step in steps)
        entry["field"] = next((step for step in reversed(self.path) if isinstance(step, str)), "body")
        entry["field"] = _shown(entry["field"])
        if self.value is not _NO_VALUE:
            entry["value"] = _shown(self.value)
        entry["reason"] = self.reason
        if self.path and self.path[-1] in INPUTS:
            name = "omega" if self.path[-1] == "f" else str(self.path[-1])
            entry["bound"] = "finite and >= 0" if self.path[0] == "std" else BOUNDS[name]
        return entry


def _shown(value: object) -> object:
    """The value as JSON can hold it, and short enough to be shown: NaN becomes the text "NaN"."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, float):
        if math.isnan(value):
            return "NaN"
        return value if math.isfinite(value) else ("Infinity" if value > 0 else "-Infinity")
    if isinstance(value, int):
        return value if -(2**63) <= value < 2**64 else "an integer beyond double range"
    if isinstance(value, str):
        short = value if len(value) <= _MAX_TEXT else value[: _MAX_TEXT - 1] + "…"
        return short.encode("utf-8", "replace").decode()  # half of a surrogate pair is no text
    return "an object" if isinstance(value, Mapping) else "a list" if isinstance(value, Sequence) else "a value"


class RequestError(MumacroError):
    """A request that cannot be answered.  The subclass is the reason; PROBLEMS has its HTTP status."""

    def __init__(
        self,
        detail: str,
        faults: Sequence[FieldFault] = (),
        headers: Mapping[str, str] | None = None,
        **members: object,
    ) -> None:
        self.detail = detail
        self.faults = tuple(faults)
        self.headers = dict(headers or {})
        self.members = members
        super().__init__(detail)


class MalformedBodyError(RequestError):
    """The body, or the head, cannot be read as what it says it is."""


class HeadTooLargeError(RequestError):
    """The head of the request has too many bytes or fields."""


class UnauthorizedError(RequestError):
    """The API key is missing or wrong."""


class BodyTooLargeError(RequestError):
    """The body has more bytes than the settings allow."""


class BatchTooLargeError(RequestError):
    """The batch has more cases than the settings allow."""


class UnsupportedBodyError(RequestError):
    """The body has a media type or a coding that is not read here."""


class InvalidFieldsError(RequestError):
    """The body or the query was read, and some of its fields have no valid value."""


class NotReadyError(RequestError):
    """The tables are not loaded, or they are no longer valid."""


class OverloadedError(RequestError):
    """More requests are being answered than the settings allow."""


class SlowClientError(RequestError):
    """The client sent or read too slowly."""


class TookTooLongError(RequestError):
    """The request is not finished in the time that the settings allow."""


@dataclass(frozen=True)
class Kind:
    """Status, type and title of the response to an exception."""

    status: int
    slug: str
    title: str
    retry_after_s: int | None = None


_INVALID = Kind(422, "invalid-value", "The request holds invalid values")
_NOT_READY = Kind(503, "not-ready", "The service is not ready", 5)
PROBLEMS: dict[type[Exception], Kind] = {
    MalformedBodyError: Kind(400, "malformed-body", "The request cannot be read"),
    UnauthorizedError: Kind(401, "unauthorized", "An API key is needed"),
    SlowClientError: Kind(408, "slow-client", "The request did not come in time"),
    BodyTooLargeError: Kind(413, "body-too-large", "The body is too large"),
    BatchTooLargeError: Kind(413, "batch-too-large", "The batch is too large"),
    HeadTooLargeError: Kind(431, "head-too-large", "The head is too large"),
    UnsupportedBodyError: Kind(415, "unsupported-body", "The body's media type is not supported"),
    InvalidFieldsError: _INVALID,
    InputError: _INVALID,
    NotReadyError: _NOT_READY,
    TableError: _NOT_READY,
    OverloadedError: Kind(503, "overloaded", "The service is overloaded", 1),
    MemoryError: Kind(503, "out-of-memory", "The service has too little memory", 1),
    TookTooLongError: Kind(503, "took-too-long", "The request took too long", 1),
}
UNEXPECTED = Kind(500, "unexpected", "An unexpected error")


def _kind_of(error: Exception) -> Kind:
    for cls in type(error).__mro__:
        if cls in PROBLEMS:
            return PROBLEMS[cls]
    if isinstance(error, HTTPException):
        title = HTTPStatus(error.status_code).phrase
        return Kind(error.status_code, title.lower().replace(" ", "-"), title)
    return UNEXPECTED


def pieces_of_problem(error: Exception, scope: Scope) -> tuple[int, dict[str, Any], dict[str, str]]:
    """Status, document and headers of the answer to an exception; that of an unknown exception has no details."""
    kind = _kind_of(error)
    detail, faults, members, headers = "", [], {}, dict[str, str]()
    if isinstance(error, RequestError):
        detail, faults, members, headers = error.detail, list(error.faults), error.members, error.headers
    elif isinstance(error, InputError):
        detail = f"{error.field} must be {error.bound}"
        faults = [FieldFault.of(error.field, f"must be {error.bound}", error.value)]
    elif isinstance(error, TableError):
        detail = f"table {error.path.name}: {error.reason}"
    elif isinstance(error, HTTPException):
        detail, headers = str(error.detail), dict(error.headers or {})
    elif isinstance(error, MemoryError):
        detail = "send a smaller request, or send it later"
    else:
        detail = "The request could not be answered; the log has the reason under its request id."
    body: dict[str, Any] = {
        "type": f"urn:problem-type:mumacro:{kind.slug}",
        "title": kind.title,
        "status": kind.status,
        "detail": detail,
        "instance": scope["path"],
    }
    if "request_id" in scope:
        body["request_id"] = scope["request_id"]
    if faults:
        query = scope["method"] in ("GET", "HEAD")
        body["errors"] = [fault.as_json(query) for fault in faults[:MAX_FIELD_FAULTS]]
        body["n_errors"] = len(faults)
    body.update(members)
    headers = {"Cache-Control": "no-store", **headers}
    if kind.retry_after_s is not None:
        headers.setdefault("Retry-After", str(kind.retry_after_s))
    return kind.status, body, headers


def problem_of(error: Exception, scope: Scope) -> Response:
    """The response to an exception."""
    status, body, headers = pieces_of_problem(error, scope)
    return Response(orjson.dumps(body), status, headers=headers, media_type="application/problem+json")


# --- faults of fields -----------------------------------------------------------------------------------


def refuse(faults: Sequence[FieldFault], **members: Any) -> NoReturn:
    """Raise the error that reports all of these faults."""
    first = faults[0]
    field = first.as_json(query=False)["field"]
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    raise InvalidFieldsError(f"{field}: {first.reason}{more}", faults, **members)


def faults_of(error: ValidationError, model: type[BaseModel], known: Iterable[str]) -> list[FieldFault]:
    """Pydantic's entries as faults, one per place.

    A field of ``model`` says in its ``json_schema_extra`` what it must be (``bound``); ``known`` are the names that the
    request may have.
    """
    found: dict[tuple[str | int, ...], FieldFault] = {}
    for entry in error.errors(include_url=False):
        path, kind, value = entry["loc"], entry["type"], entry["input"]
        if kind == "missing":
            fault = FieldFault(path, "is required")
        elif kind == "extra_forbidden":
            fault = FieldFault(path, unknown_name(str(path[-1]), known if len(path) == 1 else INPUTS), value)
        elif kind == "relation":  # between fields: the model names the one to change
            context = entry["ctx"]
            fault = FieldFault((*path, context["field"]), context["reason"])
        else:
            extra = model.model_fields[str(path[0])].json_schema_extra
            bound = str(extra["bound"]) if isinstance(extra, dict) else "a valid value"
            hint = number_hint(str(path[0]), value) if kind == "float_type" else f"must be {bound}"
            fault = FieldFault(path, hint, value)
        found.setdefault(fault.path, fault)
    return list(found.values())


def in_query(error: InvalidFieldsError) -> InvalidFieldsError:
    """The same faults as faults of the query of a POST."""
    faults = [replace(fault, parameter=True) for fault in error.faults]
    return InvalidFieldsError(error.detail, faults, error.headers, **dict[str, Any](error.members))

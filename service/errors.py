"""Exception -> RFC 9457 problem details, in one table.

Every error that leaves the service is ``application/problem+json`` with ``type, title, status, detail,
instance``, the request id, and for bad fields ``errors``: a JSON pointer (bodies) or a parameter (queries),
the value in a form that JSON can hold, and what it must be.  No traceback reaches a user.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from friction.errors import InputError, MumacroError, TableError
from service.logs import request_id

__all__ = [
    "PROBLEMS",
    "BatchTooLargeError",
    "BodyTooLargeError",
    "FieldFault",
    "InvalidFieldsError",
    "MalformedBodyError",
    "NotReadyError",
    "OverloadedError",
    "RequestError",
    "SlowClientError",
    "TookTooLongError",
    "UnauthorizedError",
    "UnsupportedBodyError",
    "problem_of",
    "problem_response",
    "safe_value",
]

MAX_FIELD_FAULTS = 100
_MAX_TEXT = 80
_NO_VALUE = object()


def safe_value(value: object) -> object:
    """Return the value as JSON can hold it, and short enough to be shown: NaN becomes the text "NaN"."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, float):
        if math.isnan(value):
            return "NaN"
        return value if math.isfinite(value) else ("Infinity" if value > 0 else "-Infinity")
    if isinstance(value, int):
        return value if -(2**63) <= value < 2**64 else "an integer beyond double range"
    if isinstance(value, str):
        return value if len(value) <= _MAX_TEXT else value[: _MAX_TEXT - 1] + "…"
    return "an object" if isinstance(value, Mapping) else "a list" if isinstance(value, Sequence) else "a value"


@dataclass(frozen=True)
class FieldFault:
    """One bad field of a request.  ``place`` is "pointer" (JSON body) or "parameter" (query)."""

    field: str
    reason: str
    value: object = _NO_VALUE
    bound: str | None = None
    place: str = "pointer"
    path: tuple[str | int, ...] | None = None

    def as_json(self) -> dict[str, object]:
        """Return the entry of ``errors``; the pointer is in RFC 6901's URI fragment form, as in RFC 9457."""
        name = str(safe_value(self.field))
        entry: dict[str, object] = {}
        if self.place == "pointer":
            steps = (self.field,) if self.path is None else self.path
            text = (str(safe_value(str(step))).replace("~", "~0").replace("/", "~1") for step in steps)
            entry["pointer"] = "#" + "".join("/" + step for step in text)
        else:
            entry["parameter"] = name
        entry["field"] = name
        if self.value is not _NO_VALUE:
            entry["value"] = safe_value(self.value)
        entry["reason"] = self.reason
        if self.bound is not None:
            entry["bound"] = self.bound
        return entry


class RequestError(MumacroError):
    """A request that cannot be answered.  The subclass says why; PROBLEMS says what HTTP calls it."""

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
    """The body is empty or is not JSON."""


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
    """No table can answer yet, or any more."""


class OverloadedError(RequestError):
    """More large batches are being answered than the settings allow."""


class SlowClientError(RequestError):
    """The caller sends or takes nothing for too long."""


class TookTooLongError(RequestError):
    """The request is not finished in the time that the settings allow."""


@dataclass(frozen=True)
class Kind:
    """What HTTP calls an exception."""

    status: int
    slug: str
    title: str
    retry_after_s: int | None = None


PROBLEMS: dict[type[Exception], Kind] = {
    MalformedBodyError: Kind(400, "malformed-body", "The body is not JSON"),
    UnauthorizedError: Kind(401, "unauthorized", "An API key is needed"),
    SlowClientError: Kind(408, "slow-client", "The request did not come in time"),
    BodyTooLargeError: Kind(413, "body-too-large", "The body is too large"),
    BatchTooLargeError: Kind(413, "batch-too-large", "The batch is too large"),
    UnsupportedBodyError: Kind(415, "unsupported-body", "The body's media type is not supported"),
    InvalidFieldsError: Kind(422, "invalid-value", "The request holds invalid values"),
    InputError: Kind(422, "invalid-value", "The request holds invalid values"),
    NotReadyError: Kind(503, "not-ready", "The service is not ready", 5),
    TableError: Kind(503, "not-ready", "The service is not ready", 5),
    OverloadedError: Kind(503, "overloaded", "The service is overloaded", 1),
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


def problem_response(
    path: str,
    kind: Kind,
    detail: str,
    faults: Sequence[FieldFault] = (),
    headers: Mapping[str, str] | None = None,
    members: Mapping[str, object] | None = None,
) -> Response:
    """Write the problem document of RFC 9457."""
    body: dict[str, Any] = {
        "type": f"urn:problem-type:mumacro:{kind.slug}",
        "title": kind.title,
        "status": kind.status,
        "detail": detail,
        "instance": path,
    }
    current = request_id.get()
    if current is not None:
        body["request_id"] = current
    if faults:
        body["errors"] = [fault.as_json() for fault in faults[:MAX_FIELD_FAULTS]]
        body["n_errors"] = len(faults)
    body.update(members or {})
    all_headers = {"Cache-Control": "no-store", **(headers or {})}
    if kind.retry_after_s is not None:
        all_headers.setdefault("Retry-After", str(kind.retry_after_s))
    return Response(
        json.dumps(body, allow_nan=False), kind.status, headers=all_headers, media_type="application/problem+json"
    )


def problem_of(error: Exception, path: str) -> Response:
    """Turn any exception into a problem response.  What is not in the table says nothing about itself."""
    kind = _kind_of(error)
    if isinstance(error, RequestError):
        return problem_response(path, kind, error.detail, error.faults, error.headers, error.members)
    if isinstance(error, InputError):
        reason = f"must be {error.bound}"
        fault = FieldFault(error.field, reason, error.value, error.bound)
        return problem_response(path, kind, f"{error.field} {reason}", [fault])
    if isinstance(error, TableError):
        return problem_response(path, kind, f"table {error.path.name}: {error.reason}")
    if isinstance(error, HTTPException):
        return problem_response(path, kind, str(error.detail), headers=error.headers)
    return problem_response(
        path, kind, "The request could not be answered; the log has the reason under its request id."
    )


async def answer_problem(request: Request, error: Exception) -> Response:
    """Exception handler of the application."""
    return problem_of(error, request.url.path)

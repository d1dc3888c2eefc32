"""Convert exceptions to problem details (RFC 9457).

Every error that leaves the application is ``application/problem+json``: ``type, title, status,
detail, instance`` and the request id.  For bad fields it has ``errors`` with a JSON pointer
(bodies) or a parameter (queries), the value, and what it must be.  All faults of a request are
reported at once.  A user never sees a traceback.
"""

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from typing import Any, NoReturn

import numpy as np
import orjson
from pydantic import BaseModel, ValidationError
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.types import Scope

from mumacro.errors import InputError, MumacroError, TableError
from mumacro.inputs.case import no_number
from mumacro.inputs.fields import AMPLITUDE, BOUNDS, ENDS, MEASURED_AS, RIGID, STIFFNESS, refusal
from mumacro.inputs.fields import NAMES as INPUTS
from mumacro.inputs.names import unknown_name
from mumacro.motions.motion import PARTS

from .understood import UNDERSTOOD, is_wanted, understood

MAX_FIELD_FAULTS = 100
_MAX_TEXT = 80
_NO_VALUE = object()
CLOSE = {"Connection": "close"}
# the members of the objects within a body
_WITHIN = dict.fromkeys(PARTS, ("harmonic", "amplitude", "phase"))


@dataclass(frozen=True)
class FieldFault:
    """Hold one bad field of a request: its place, its value, and the reason.

    ``parameter`` tells whether it is in the query; None means: as for the whole request (a GET has
    a query, a POST a body).
    """

    path: tuple[str | int, ...]
    reason: str
    value: object = _NO_VALUE
    parameter: bool | None = None

    @classmethod
    def of(cls, name: str, reason: str, value: object = _NO_VALUE) -> "FieldFault":
        """Return the fault of a field at the top level of the body, or of a parameter."""
        return cls((name,), reason, value)

    def as_json(self, query: bool) -> dict[str, object]:
        """Return the entry of ``errors``; the pointer has RFC 6901's URI fragment form, as in RFC
        9457."""
        names = [step for step in self.path if isinstance(step, str)]
        entry: dict[str, object] = {}
        if query if self.parameter is None else self.parameter:
            entry["parameter"] = _shown("_".join(names))
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
            entry["bound"] = BOUNDS[str(self.path[-1])]
        return entry


def _shown(value: object) -> object:
    """Return the value in a form that JSON can hold, short enough to be shown; NaN becomes the text
    "NaN"."""
    if isinstance(value, str):
        short = value if len(value) <= _MAX_TEXT else value[: _MAX_TEXT - 1] + "…"
        # half of a surrogate pair is not valid text
        return short.encode("utf-8", "replace").decode()
    if isinstance(value, float) and not math.isfinite(value):
        return json.dumps(value)
    if isinstance(value, int) and not -(2**63) <= value < 2**64:
        return "an integer of many digits"
    if value is None or isinstance(value, (int, float)):
        return value
    return "an object" if isinstance(value, Mapping) else "a list"


def refused(faults: Sequence[FieldFault], **members: Any) -> "RequestError":
    """Return the error that reports all of these faults."""
    first = faults[0]
    rest = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    return RequestError(
        ProblemKind.INVALID_VALUE,
        f"{first.as_json(False)['field']}: {first.reason}{rest}",
        faults,
        **members,
    )


def refuse(faults: Sequence[FieldFault], **members: Any) -> NoReturn:
    """Raise the error that reports all of these faults."""
    raise refused(faults, **members)


def faults_of(
    errors: Iterable[Any], allowed: Iterable[str], parameter: bool | None = None
) -> list[FieldFault]:
    """Return Pydantic's errors as faults, one per place; ``allowed`` are the names that may be
    there.

    A fault that is not shown has no reason, because to find the reason takes longer than to find
    the fault.
    """
    faults: dict[tuple[str | int, ...], FieldFault] = {}
    for error in errors:
        path, value = error["loc"], error["input"]
        if len(faults) >= MAX_FIELD_FAULTS:
            faults.setdefault(path, FieldFault(path, ""))
            continue
        cause = error.get("ctx", {}).get("error")
        if isinstance(cause, InputError):  # a relation: it names the input to change
            path, value = (*path, cause.field), _NO_VALUE
        elif error["type"] == "missing":
            value = _NO_VALUE
        names = [str(step) for step in path if isinstance(step, str)]
        name = names[-1] if names else "body"
        choices = _WITHIN.get(names[0], INPUTS) if len(names) > 1 else allowed
        reason = _reason(error, name, choices)
        faults.setdefault(path, FieldFault(path, reason, value, parameter))
    return list(faults.values())


def reason_of(error: InputError) -> str:
    """Return why an input is refused, in the words of an answer over HTTP."""
    if error.field in BOUNDS and error.bound in (BOUNDS[error.field], STIFFNESS):
        value = error.value if isinstance(error.value, (int, float)) else math.nan
        return refusal(error.field, value)
    return f"must be {error.bound}".replace(" or math.inf", "")


def _reason(error: Any, name: str, allowed: Iterable[str]) -> str:
    """Return what is wrong with a value, in the words of the library if it has some."""
    kind, value = error["type"], error["input"]
    cause = error.get("ctx", {}).get("error")
    if isinstance(cause, InputError):
        return reason_of(cause)
    if kind == "missing":
        return "is required"
    if kind == "extra_forbidden":
        return unknown_name(name, allowed)
    if kind == "float_type" and type(value) is int and name in BOUNDS:  # beyond double range
        return refusal(name, math.inf)
    if kind == "float_type":
        return no_number(name if len(error["loc"]) == 1 else "", value)
    if kind in _OUT_OF_BOUNDS and name in BOUNDS and len(error["loc"]) == 1:
        return refusal(name, math.inf if abs(value) > _LARGE else float(value))
    if kind == "finite_number":
        return "must be finite"
    if kind in _LEAST:
        sign, bound = _LEAST[kind]
        return f"must be finite and {sign} {error['ctx'][bound]:g}"
    if kind == "literal_error":
        return f"must be one of {error['ctx']['expected'].replace(' or ', ', ')}".replace("'", "")
    if kind in ("model_type", "model_attributes_type"):
        return "must be an object"
    if kind in ("too_short", "too_long"):
        least, most = (error["ctx"].get(end) for end in ("min_length", "max_length"))
        if most is None:
            return f"must have at least {least} entries"
        return f"may have up to {most} entries"
    if kind == "list_type":
        return "must be a list"
    if kind == "string_unicode":
        return "must be text, in which \\ud800 to \\udfff stand in pairs"
    message: str = error["msg"]
    return message.replace("Input should be", "must be").replace("Input should", "must")


_OUT_OF_BOUNDS = ("finite_number", "greater_than", "greater_than_equal", "less_than_equal")
_LEAST = {"greater_than": (">", "gt"), "greater_than_equal": (">=", "ge")}
_LARGE = 1e308


def names_of(model: type[BaseModel]) -> tuple[str, ...]:
    """Return the names of a model's members: inputs first, then options."""
    fields = model.model_fields
    inputs = [name for name in (*INPUTS, *MEASURED_AS) if name in fields]
    return tuple(dict.fromkeys([*inputs, *fields]))


def _place(path: tuple[str | int, ...], body: Any) -> tuple[str | int, ...]:
    """Return a place as the body has it.  A single value that stands for a list, such as a target,
    has no place within the list."""
    for i, step in enumerate(path):
        if isinstance(step, int) and not isinstance(body, list):
            return path[:i]
        try:
            body = body[step]
        except (LookupError, TypeError):
            body = None
    return path


def invalid(
    error: ValidationError,
    model: type[BaseModel],
    members: Mapping[str, Any],
    parameter: bool | None = None,
) -> "RequestError":
    """Return the error that reports what a model refuses in the members of a body or query."""
    errors = [
        {**fault, "loc": _place(fault["loc"], members)} for fault in error.errors(include_url=False)
    ]
    faults = faults_of(errors, names_of(model), parameter)
    if {"mu0", "y0"} <= model.model_fields.keys() and model.model_fields["mu0"].is_required():
        paths = {fault.path for fault in faults}
        faults += [fault for fault in _absent_in(members) if fault.path not in paths]
    return refused(faults, **_understood(members))


def _understood(members: Any) -> dict[str, Any]:
    """Return how the program understood the other inputs, if the request asks for it."""
    if not isinstance(members, Mapping) or not is_wanted(members):
        return {}
    return {UNDERSTOOD: understood(members)}


def _absent_in(members: Mapping[str, Any]) -> Iterator[FieldFault]:
    """Yield the faults of missing inputs where one of several is required. (The library would
    report only the first one, after all other faults are corrected.)"""
    directions = members.get("direction", "across")
    words = directions if isinstance(directions, (list, np.ndarray)) else [directions]
    normal = any(isinstance(word, str) and word == "normal" for word in words)
    amplitudes = (AMPLITUDE,) if normal else ("y0",)
    for names in (("k", *ENDS), amplitudes, ("omega", "f")):
        if all(members.get(name) is None for name in names):
            yield FieldFault.of(names[0], _ALTERNATIVES.get(names[0], "is required"))


_ALTERNATIVES = {
    "omega": "is required: omega [rad/s], or f [Hz] in its place",
    "k": f"is required: the tangential stiffness [N/m], or {RIGID}",
}


class ProblemKind(Enum):
    """Define the problems in one table: status, title, headers, the exception that belongs to it
    and the detail.  The connection is closed if the rest of a request is not read.
    """

    MALFORMED_BODY = 400, "The request cannot be read"
    MALFORMED_HTTP = 400, "The request is no HTTP that this service reads", CLOSE
    UNAUTHORIZED = 401, "An API key is needed", CLOSE
    NOT_FOUND = 404, "Not Found"
    METHOD_NOT_ALLOWED = 405, "Method Not Allowed"
    SLOW_CLIENT = 408, "The request did not come in time", CLOSE
    BODY_TOO_LARGE = 413, "The body is too large", CLOSE
    BATCH_TOO_LARGE = 413, "The batch is too large"
    UNSUPPORTED_BODY = 415, "The body's media type is not supported", CLOSE
    RANGE_NOT_SATISFIABLE = 416, "The file has no such part"
    INVALID_VALUE = 422, "The request holds invalid values", None, InputError
    HEAD_TOO_LARGE = 431, "The head is too large", CLOSE
    NOT_READY = (
        503,
        "The service is not ready",
        {"Retry-After": "5"},
        TableError,
        "table {0.path.name}: {0.reason}",
    )
    OVERLOADED = 503, "The service is overloaded", {**CLOSE, "Retry-After": "1"}
    OUT_OF_MEMORY = (
        503,
        "The service has too little memory",
        {"Retry-After": "1"},
        MemoryError,
        "send a smaller request, or send it later",
    )
    TOOK_TOO_LONG = 503, "The request took too long", {**CLOSE, "Retry-After": "1"}
    # last, because it matches every other exception, of which no detail is shown
    UNEXPECTED = (
        500,
        "An unexpected error",
        None,
        Exception,
        "The request could not be answered; the log has the reason under its request id.",
    )

    def __init__(
        self,
        status: int,
        title: str,
        headers: Mapping[str, str] | None = None,
        exception: type[Exception] | tuple[()] = (),
        detail: str = "",
    ) -> None:
        self.status, self.title, self.headers = status, title, headers or {}
        self.exception, self.detail = exception, detail


class RequestError(MumacroError):
    """Report a request that cannot be answered: the problem, the reason, the bad fields, and
    headers and members of the document."""

    def __init__(
        self,
        kind: ProblemKind,
        detail: str,
        faults: Sequence[FieldFault] = (),
        headers: Mapping[str, str] | None = None,
        **members: object,
    ) -> None:
        self.kind, self.detail, self.faults = kind, detail, tuple(faults)
        self.headers, self.members = headers or {}, members
        super().__init__(detail)


#: what our own server (server.py) writes into ``scope["state"]`` of a request: how to end its
#: connection, whether too many are open, and the status if the server refused it
ABORT, FULL, REFUSED = "abort", "full", "refused"
#: the status of an answer that has begun, in ``scope["state"]``, and what the request holds (a
#: :class:`~service.admission.Ticket`), in its scope
STATUS, TICKET = "status", "mumacro.ticket"


def path_in(scope: Scope) -> str:
    """Return the path without the prefix that a proxy has added."""
    return str(scope["path"]).removeprefix(scope.get("root_path", ""))


# --- exceptions of the application ----------------------------------------------------------------


def meaning(error: Exception, scope: Scope) -> RequestError:
    """Return the error that an exception means for its request."""
    if isinstance(error, RequestError):
        return error
    if isinstance(error, InputError):
        return of_input(error)
    if isinstance(error, HTTPException):
        return _of_http(error, scope)
    kind = next(kind for kind in ProblemKind if isinstance(error, kind.exception))
    return RequestError(kind, kind.detail.format(error))


def _of_http(error: HTTPException, scope: Scope) -> RequestError:
    """Return the error for what Starlette refuses: an unknown path, method or part of a file."""
    kinds = (kind for kind in ProblemKind if kind.status == error.status_code)
    kind = next(kinds, ProblemKind.UNEXPECTED)
    detail, headers = error.detail, error.headers
    if kind is ProblemKind.UNEXPECTED:
        detail = kind.detail
    elif kind is ProblemKind.NOT_FOUND:
        detail = _no_such_path(scope)
    # Starlette names only the methods of one route of the path
    elif kind is ProblemKind.METHOD_NOT_ALLOWED:
        methods = scope["app"].state.methods.get(path_in(scope), "GET, HEAD")
        detail = f"{scope['method'][:20]} is not allowed here; allowed: {methods}"
        headers = {"Allow": methods}
    return RequestError(kind, detail, headers=headers)


_NO_GUIDE = "the documentation is not installed here: in the source, python3 dev.py serve builds it"


def _no_such_path(scope: Scope) -> str:
    """Return what to do about an unknown path."""
    path = path_in(scope)
    if scope["app"].state.settings.guide is None and (path + "/").startswith("/guide/"):
        return _NO_GUIDE
    return "no such path; /docs describes all of them"


def of_input(error: InputError, **members: Any) -> RequestError:
    """Return the error for what the library refuses, such as a relation between inputs."""
    value = _NO_VALUE if error.value is None else error.value
    path: tuple[str | int, ...] = (error.field,)
    if error.index is not None:
        path = (*path, error.index)
    return refused([FieldFault(path, reason_of(error), value)], **members)


@contextmanager
def with_members(**members: Any) -> Iterator[None]:
    """Add members to the problem document of any refusal within the block."""
    try:
        yield
    except InputError as error:
        raise of_input(error, **members) from None
    except RequestError as error:
        error.members |= members
        raise


def document_of(error: RequestError, scope: Scope) -> dict[str, Any]:
    """Return the problem document of an error."""
    slug = error.kind.name.lower().replace("_", "-")
    body: dict[str, Any] = {"type": f"urn:problem-type:mumacro:{slug}", "title": error.kind.title}
    # a server may leave halves of surrogate pairs in a path
    path = scope["path"].encode("utf-8", "replace").decode()
    body |= {"status": error.kind.status, "detail": error.detail, "instance": path}
    if "request_id" in scope:
        body["request_id"] = scope["request_id"]
    if error.faults:
        query = scope["method"] in ("GET", "HEAD")
        body["errors"] = [fault.as_json(query) for fault in error.faults[:MAX_FIELD_FAULTS]]
        body["n_errors"] = len(error.faults)
    return body | error.members


def problem_of(error: RequestError, scope: Scope) -> Response:
    """Return the response to an error."""
    headers = {"Cache-Control": "no-store", **error.kind.headers, **error.headers}
    content = orjson.dumps(document_of(error, scope))
    return Response(
        content, error.kind.status, headers=headers, media_type="application/problem+json"
    )

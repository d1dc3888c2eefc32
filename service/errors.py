"""Exception -> RFC 9457 problem details, in one table.

Every error that leaves the service is ``application/problem+json`` with ``type, title, status, detail,
instance``, the request id, and for bad fields ``errors``: a JSON pointer (bodies) or a parameter (queries),
the value in a form that JSON can hold, and what it must be.  No traceback reaches a user.
"""

import json
import math
from collections import Counter
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from mumacro.errors import InputError, MumacroError, TableError

from .hints import ONE_FREQUENCY, STATE_K, STATE_OMEGA, number_hint, unknown_name
from .kernel import BOUNDS, INPUTS
from .logs import request_id

__all__ = [
    "MAX_FIELD_FAULTS",
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
    "accepts",
    "faults_of",
    "invalid_request",
    "missing_inputs",
    "names_at",
    "problem_of",
    "problem_response",
    "refusal",
    "repeated",
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
        short = value if len(value) <= _MAX_TEXT else value[: _MAX_TEXT - 1] + "…"
        return short.encode("utf-8", "replace").decode()  # half of a surrogate pair is no text
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
    """The tables are not loaded, or they are no longer valid."""


class OverloadedError(RequestError):
    """More large batches are being answered than the settings allow."""


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
    """Turn any exception into a problem response.  That of an exception outside of PROBLEMS has no details."""
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


# --- errors of pydantic -> faults ---------------------------------------------------------------------

_KNOWN_BOUNDS = {**BOUNDS, "tolerance": "finite and > 0"} | {f"std_{name}": "finite and >= 0" for name in INPUTS}


def refusal(faults: Sequence[FieldFault]) -> InvalidFieldsError:
    """The error that reports all of these faults."""
    first = faults[0]
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    return InvalidFieldsError(f"{safe_value(first.field)}: {first.reason}{more}", faults)


def repeated(names: Iterable[str], place: str = "pointer") -> list[FieldFault]:
    """Faults of the names that are given more than once."""
    counts = Counter(names).items()
    return [FieldFault(name, "is given more than once", place=place) for name, count in counts if count > 1]


def missing_inputs(given: Container[str], rigid: str) -> list[FieldFault]:
    """Faults of a batch with these inputs: missing ones, or omega and f; ``rigid`` is how its format writes k = inf."""
    reasons = {"k": STATE_K.format(rigid=rigid), "omega": STATE_OMEGA}
    optional = ("omega", "f") if "f" in given else ("f",)
    faults = [
        FieldFault(name, reasons.get(name, "is required"), bound=BOUNDS[name])
        for name in INPUTS
        if name not in given and name not in optional
    ]
    if "omega" in given and "f" in given:
        faults.append(FieldFault("f", ONE_FREQUENCY))
    return faults


def faults_of(
    entries: Iterable[Mapping[str, Any]], place: str, known: Sequence[str], bounds: Mapping[str, str] | None = None
) -> list[FieldFault]:
    """Pydantic's entries as faults, one per location.

    Parameters
    ----------
    entries : iterable of mapping
        With ``type``, ``loc`` (from the field on), ``msg`` and ``input``.
    place : str
        "pointer" (JSON body) or "parameter" (query).
    known : sequence of str
        Names of the model's fields.
    bounds : mapping, optional
        Bounds of fields other than the inputs.
    """
    found: dict[tuple[str | int, ...], FieldFault] = {}
    all_bounds = {**_KNOWN_BOUNDS, **(bounds or {})}
    for entry in entries:
        # a union reports each of its branches; their names are not part of the path in the body
        loc: tuple[str | int, ...] = entry["loc"]
        path = tuple(step for i, step in enumerate(loc) if i == 0 or isinstance(step, int) or _is_member(loc, i))
        kind, value = entry["type"], entry.get("input")
        context = entry.get("ctx") or {}
        if place == "parameter" and path[:1] == ("std",):
            path = (f"std_{path[1]}" if len(path) > 1 else "std",)
        if kind == "relation":  # between fields: the model names the one to change
            field = context["field"]
            if loc == ("std",):
                path = ("std", field) if place == "pointer" else (f"std_{field}",)
            else:
                path = ("std_mu0",) if place == "parameter" and field == "std" else (field,)
            fault = FieldFault(
                str(path[-1]), context["reason"], place=place, path=path, bound=all_bounds.get("_".join(map(str, path)))
            )
        elif kind == "missing":
            name = str(path[-1]) if path else "body"
            rigid = "null" if place == "pointer" else "rigid"
            reason = STATE_K.format(rigid=rigid) if name == "k" else "is required"
            fault = FieldFault(name, reason, bound=all_bounds.get(name), place=place, path=path)
        elif kind == "extra_forbidden":
            name = str(path[-1])
            names = known if len(path) == 1 else INPUTS
            reason = unknown_name(name, names) if len(found) < MAX_FIELD_FAULTS else "unknown field"  # not reported
            fault = FieldFault(name, reason, value, place=place, path=path)
        else:
            name = str(path[0]) if path else "body"
            reason = _reason(kind, name, value, entry["msg"], all_bounds, place)
            bound = all_bounds.get("_".join(map(str, path)), all_bounds.get(name))
            fault = FieldFault(name, reason, value, bound, place, path)
        found.setdefault(tuple(path), fault)
    return list(found.values())


def _is_member(loc: tuple[str | int, ...], index: int) -> bool:
    """Whether a text in a location is the name of a member, such as std.mu0, and not of a branch of a union."""
    return index == 1 and loc[0] == "std"


def _reason(kind: str, name: str, value: object, message: str, bounds: Mapping[str, str], place: str) -> str:
    plain = name.removeprefix("std_")
    if name == "k" and isinstance(value, str) and value.strip().lower() in ("", "null", "none", "inf", "infinity"):
        return (
            "must be a number; write rigid for rigid contact"
            if place == "parameter"
            else ('must be a number; write null or "rigid" for rigid contact')
        )
    if plain in INPUTS or name == "tolerance":
        text_of_none = isinstance(value, str) and value.strip().lower().lstrip("+-") in ("nan", "inf", "infinity")
        if (isinstance(value, (int, float)) and not isinstance(value, bool)) or text_of_none:
            return f"must be {bounds[name]}"
        return number_hint(value, plain)
    if name == "include":
        names = message.partition("be ")[2].replace(" or ", ", ").replace("'", "")
        return f"must be a list of names from: {names}" if names else "must be a list of names, each once"
    if name == "std" and kind in ("float_type", "greater_than_equal", "finite_number"):
        return "must be finite and >= 0"
    if kind in ("model_type", "model_attributes_type", "dict_type", "dataclass_type"):
        return "must be a JSON object"
    return message[:1].lower() + message[1:]


#: path -> names of the fields that its body or query may have
_FIELDS_AT: dict[str, tuple[str, ...]] = {}


def accepts(path: str, names: Iterable[str]) -> None:
    """Register the fields that a path takes; error messages list them."""
    _FIELDS_AT[path] = tuple(names)


def names_at(path: str) -> tuple[str, ...]:
    """The fields that a path takes."""
    return _FIELDS_AT.get(path, ())


def invalid_request(path: str, entries: Sequence[Mapping[str, Any]]) -> RequestError:
    """The error for a body or a query that FastAPI refused."""
    for entry in entries:
        if entry["type"] == "model_attributes_type" and tuple(entry["loc"]) == ("body",) and entry["input"] == b"":
            return MalformedBodyError("the body is empty")
        if entry["type"] == "json_invalid":
            reason = str((entry.get("ctx") or {}).get("error", "unexpected text"))
            return MalformedBodyError(f"the body is not JSON: {reason}")
        if entry["type"] == "missing" and tuple(entry["loc"]) == ("body",):
            return MalformedBodyError("the body is empty")
    known = names_at(path)
    faults = []
    for place, name in (("body", "pointer"), ("query", "parameter")):
        chosen = [{**entry, "loc": tuple(entry["loc"][1:])} for entry in entries if entry["loc"][0] == place]
        faults += faults_of(chosen, name, known)
    return refusal(faults)

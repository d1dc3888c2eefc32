"""Bodies and queries -> checked requests.

JSON numbers are strict.  A query holds text, so its numbers are parsed here, by a grammar narrower than Python's.
Everything wrong with a request is reported at once, as a list of field faults.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import parse_qsl

from pydantic import ValidationError
from starlette.requests import Request

from friction.nondim import BOUNDS, FIELDS
from service.errors import FieldFault, InvalidFieldsError, MalformedBodyError, UnsupportedBodyError, safe_value
from service.schemas import INCLUDES, CaseRequest, InputStd

__all__ = [
    "ARROW",
    "JSON",
    "KNOWN_FIELDS",
    "NDJSON",
    "STD_PARAMETERS",
    "Options",
    "canonical",
    "case_from_body",
    "case_from_query",
    "check_std",
    "media_type",
    "merged_options",
    "options_from",
    "options_from_query",
    "query_pairs",
    "read_body",
    "refuse_query",
    "table_choice_from_query",
]

KNOWN_FIELDS = (*FIELDS, "include", "tolerance", "std")
STD_PARAMETERS = tuple(f"std_{name}" for name in FIELDS)
_OPTION_PARAMETERS = ("include", "tolerance", *STD_PARAMETERS)
_BOUND = {**BOUNDS, "tolerance": "finite and > 0", **dict.fromkeys(STD_PARAMETERS, "finite and >= 0")}

JSON, NDJSON, ARROW = "application/json", "application/x-ndjson", "application/vnd.apache.arrow.stream"
_ALIASES = {"application/ndjson": NDJSON, "application/jsonl": NDJSON, "application/x-jsonlines": NDJSON}
_MAX_PARAMETERS = 100

# An unescaped "+" of a query arrives as a space; between "e" and a digit it can be nothing else.
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+\- ]?\d+)?", re.ASCII)


@dataclass(frozen=True)
class Options:
    """What a request asks for beside its cases."""

    include: tuple[str, ...] = ()
    tolerance: float | None = None
    std: InputStd | None = None


def media_type(request: Request, known: Sequence[str]) -> str:
    """Return which of the known types the body has; a body without a type is of the first.

    Raises
    ------
    UnsupportedBodyError
        Another media type, another charset than UTF-8, or a compressed body.
    """
    given = request.headers.get("content-type")
    found = known[0]
    if given is not None:
        media, _, parameters = given.lower().partition(";")
        charset = parameters.strip().removeprefix("charset=").strip('"') if "charset=" in parameters else "utf-8"
        found = _ALIASES.get(media.strip(), media.strip())
        if found not in known or charset not in ("utf-8", "utf8", "us-ascii"):
            offer = ", ".join(known)
            raise UnsupportedBodyError(f"send {offer}, not {given[:80]}", headers={"Accept-Post": offer})
    if request.headers.get("content-encoding", "identity").lower() != "identity":
        raise UnsupportedBodyError("send the body without Content-Encoding", headers={"Accept-Encoding": "identity"})
    return found


async def read_body(request: Request) -> bytes:
    """Return the body of a JSON request.

    Raises
    ------
    UnsupportedBodyError, MalformedBodyError, BodyTooLargeError
        Another media type or a compressed body; nothing in it; more than the limit.
    """
    media_type(request, (JSON,))
    body = await request.body()
    if not body:
        raise MalformedBodyError("the body is empty")
    return body


def case_from_body(body: bytes) -> CaseRequest:
    """Return the checked request of one case.

    Raises
    ------
    MalformedBodyError, InvalidFieldsError
        Not JSON; bad fields, all of them listed.
    """
    try:
        case = CaseRequest.model_validate_json(body)
    except ValidationError as error:
        raise _refusal(error, "pointer") from None
    check_std(case.include, case.std, "pointer")
    return case


def check_std(include: Iterable[str] | None, std: InputStd | None, place: str) -> None:
    """Raise InvalidFieldsError unless standard deviations are given exactly where they are asked for."""
    asked = include is not None and "std" in include
    if asked == (std is not None):
        return
    name = "std" if place == "pointer" else "std_mu0"
    reason = "is required where include asks for std" if asked else "is of no use unless include asks for std"
    raise InvalidFieldsError(f"{name}: {reason}", [FieldFault(name, reason, place=place)])


def query_pairs(request: Request) -> list[tuple[str, str]]:
    """Return names and values of the query, in order."""
    raw: bytes = request.scope["query_string"]
    if not raw:
        return []
    try:
        return parse_qsl(raw.decode("latin-1"), keep_blank_values=True, max_num_fields=_MAX_PARAMETERS)
    except ValueError:
        raise InvalidFieldsError(f"a query may have up to {_MAX_PARAMETERS} parameters") from None


def case_from_query(request: Request) -> CaseRequest:
    """Return the checked request of one case.

    Raises
    ------
    InvalidFieldsError
        Bad, unknown, missing or repeated parameters, all of them listed.
    """
    values, faults = _read_query(query_pairs(request), (*FIELDS, *_OPTION_PARAMETERS))
    try:
        case = CaseRequest.model_validate(values)
    except ValidationError as error:
        refused = {fault.field for fault in faults}
        raise _refusal(error, "parameter", faults, refused) from None
    if faults:
        raise InvalidFieldsError(_summary(faults), faults)
    check_std(case.include, case.std, "parameter")
    return case


def options_from_query(request: Request) -> Options:
    """Return ``include`` and ``tolerance`` of a query that may hold nothing else.

    Raises
    ------
    InvalidFieldsError
        Otherwise.
    """
    pairs = query_pairs(request)
    if not pairs:
        return Options()
    values, faults = _read_query(pairs, _OPTION_PARAMETERS)
    return options_from(values, "parameter", faults)


def refuse_query(request: Request) -> None:
    """Raise InvalidFieldsError if a request that has a body has a query, too."""
    pairs = query_pairs(request)
    if pairs:
        faults = [FieldFault(name, "belongs into the body", text, place="parameter") for name, text in pairs]
        raise InvalidFieldsError(_summary(faults), faults)


def table_choice_from_query(request: Request) -> tuple[str | None, float | None]:
    """Return ``id`` and ``tolerance``, of which a query may hold one, and nothing else.

    Raises
    ------
    InvalidFieldsError
        Otherwise.
    """
    pairs = query_pairs(request)
    identities = [text for name, text in pairs if name == "id"]
    values, faults = _read_query([pair for pair in pairs if pair[0] != "id"], ("tolerance",), ("id", "tolerance"))
    if len(identities) > 1 or (identities and "tolerance" in values):
        faults.append(FieldFault("id", "choose by one id or by tolerance", identities[-1], place="parameter"))
    return (identities[0] if identities else None), options_from(values, "parameter", faults).tolerance


def options_from(values: dict[str, Any], place: str, faults: Sequence[FieldFault] = ()) -> Options:
    """Return checked options; ``faults`` are those already found.

    Raises
    ------
    InvalidFieldsError
        A name that is not offered, or a tolerance that is none.
    """
    filler: dict[str, Any] = dict.fromkeys(("mu0", "Fz", "y0", "omega", "v0"), 1.0)
    wanted = {name: values[name] for name in ("include", "tolerance", "std") if name in values}
    try:
        checked = CaseRequest.model_validate({**filler, **wanted})
    except ValidationError as error:
        raise _refusal(error, place, faults, {fault.field for fault in faults}) from None
    if faults:
        raise InvalidFieldsError(_summary(faults), faults)
    return Options(canonical(checked.include), checked.tolerance, checked.std)


def merged_options(query: Options, body: dict[str, Any]) -> tuple[Options, str]:
    """Return the options of query and body, and the place of the tolerance: "parameter" or "pointer".

    Raises
    ------
    InvalidFieldsError
        One is given in both; a bad one in the body.
    """
    if not body:
        check_std(query.include, query.std, "parameter")
        return query, "parameter"
    own = options_from(body, "pointer")
    given = {"include": query.include, "tolerance": query.tolerance, "std": query.std}
    twice = [name for name, value in given.items() if value and body.get(name) is not None]
    if twice:
        faults = [FieldFault(name, "is given in the query and in the body", body[name]) for name in twice]
        raise InvalidFieldsError(f"{twice[0]} is given in the query and in the body", faults)
    place = "pointer" if query.tolerance is None else "parameter"
    merged = Options(own.include or query.include, own.tolerance or query.tolerance, own.std or query.std)
    check_std(merged.include, merged.std, "pointer")
    return merged, place


def canonical(include: Iterable[str] | None) -> tuple[str, ...]:
    """Included names once each, in the order of INCLUDES."""
    asked = set(include or ())
    return tuple(name for name in INCLUDES if name in asked)


def _read_query(
    pairs: list[tuple[str, str]], known: Sequence[str], shown: Sequence[str] = ()
) -> tuple[dict[str, Any], list[FieldFault]]:
    values: dict[str, Any] = {}
    faults: list[FieldFault] = []
    for name, text in pairs:
        if name not in known:
            reason = f"unknown parameter; allowed: {', '.join(shown or known)}"
            faults.append(FieldFault(name, reason, text, place="parameter"))
        elif name == "include":
            values.setdefault(name, []).extend(part.strip() for part in text.split(",") if part.strip())
        elif name in values or any(fault.field == name for fault in faults):
            faults.append(FieldFault(name, "is given more than once", text, place="parameter"))
        elif _NUMBER.fullmatch(text):
            values[name] = float(text.replace(" ", "+"))
        else:
            faults.append(FieldFault(name, _not_a_number(name, text), text, _BOUND[name], "parameter"))
    std = {name: values.pop(f"std_{name}") for name in FIELDS if f"std_{name}" in values}
    if std:
        values["std"] = std
    return values, faults


def _not_a_number(name: str, text: str) -> str:
    if text.strip().lower().lstrip("+-") in ("nan", "inf", "infinity"):
        return f"must be {_BOUND[name]}"
    if name == "k" and text.lower() in ("", "null", "none"):
        return "must be a number; leave k out for rigid contact"
    return "must be a number"


def _refusal(
    error: ValidationError, place: str, faults: Sequence[FieldFault] = (), refused: Iterable[str] = ()
) -> MalformedBodyError | InvalidFieldsError:
    """Translate pydantic's list.  Fields in ``refused`` already have their fault and only look missing."""
    all_faults = list(faults)
    skip = set(refused)
    for entry in error.errors(include_url=False, include_context=False):
        if entry["type"] == "json_invalid":
            return _unreadable(entry["msg"].removeprefix("Invalid JSON: "))
        path = entry["loc"]
        field = str(path[0]) if path else "body"
        if place == "parameter" and field == "std":
            field, path = f"std_{path[-1]}", (f"std_{path[-1]}",)
        if field in skip:
            continue
        bound = _BOUND.get(field)
        if entry["type"] == "missing":
            all_faults.append(FieldFault(field, "is required", bound=bound, place=place, path=path))
        else:
            reason = _reason(entry["type"], field)
            all_faults.append(FieldFault(field, reason, entry["input"], bound, place, path))
    return InvalidFieldsError(_summary(all_faults), all_faults)


def _reason(kind: str, field: str) -> str:
    if kind == "extra_forbidden":
        return f"unknown field; allowed: {', '.join(FIELDS if field == 'std' else KNOWN_FIELDS)}"
    if field == "include":
        return f"must be a list of names out of: {', '.join(INCLUDES)}"
    if kind == "float_type":
        return "must be a number"
    if field in _BOUND:
        return f"must be {_BOUND[field]}"
    return "must be a JSON object"


def _unreadable(reason: str) -> MalformedBodyError | InvalidFieldsError:
    if reason.startswith("number out of range"):  # valid JSON; the parser gives up on integers of 4300 digits
        return InvalidFieldsError("a number in the body is beyond double range")
    return MalformedBodyError(f"the body is not JSON: {reason}")


def _summary(faults: Sequence[FieldFault]) -> str:
    first = faults[0]
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    return f"{safe_value(first.field)}: {first.reason}{more}"

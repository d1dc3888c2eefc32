"""Read a request as the model that its endpoint declares.

:class:`DirectRoute` reads one model from body or query and does nothing else, because FastAPI's own
reading of a case takes longer than its answer (docs/decisions.md).  It refuses a member or a
parameter that occurs twice, reads numbers in a query as people type them, and keeps the limits.
"""

import asyncio
import string
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from functools import partial
from typing import Any, TypeVar
from urllib.parse import parse_qsl

from fastapi import Request, Response
from fastapi.routing import APIRoute
from pydantic import ValidationError
from starlette.requests import ClientDisconnect
from starlette.types import Receive, Scope

from .admission import Ticket, compute, ticket_of
from .json_text import decode
from .problems import ABORT, FieldFault, ProblemKind, RequestError, invalid, refuse
from .understood import UNDERSTOOD, understood

T = TypeVar("T")
Handler = Callable[[Request], Coroutine[Any, Any, Response]]
JSON = b"application/json"
SMALL_BODY = 64 * 1024  # largest body of a question, in bytes
AT_ONCE = 16 * 1024  # largest body that is checked without a thread, in bytes
_BYTES_PER_UNIT = 1.0  # bytes of such a body whose check has the cost 1, see service/admission.py
_UTF_8 = {"utf-8", "utf8", "us-ascii", ""}  # US-ASCII is a part of UTF-8
# the characters of a query that needs no decoding
_PLAIN = f"{string.ascii_letters}{string.digits}.-_,=&".encode()
_LISTS = frozenset(("include",))


# --- time -----------------------------------------------------------------------------------------


async def within(limit: int, move: Awaitable[T], kind: ProblemKind = ProblemKind.SLOW_CLIENT) -> T:
    """Wait until the client sends or reads, or until another move has ended, up to a limit."""
    try:
        async with asyncio.timeout(limit):
            return await move
    except TimeoutError:
        raise RequestError(kind, f"this may take up to {limit} s") from None


# --- bodies ---------------------------------------------------------------------------------------


def only_json(headers: Mapping[bytes, bytes], remedy: str = "") -> None:
    """Refuse a body that is compressed or is not JSON in UTF-8.  A body without Content-Type counts
    as JSON."""
    media_type = headers.get(b"content-type", JSON).lower()
    media, *parameters = media_type.decode("latin-1").split(";")
    pairs = (parameter.partition("=") for parameter in parameters)
    charsets = {value.strip(' \t"') for name, _, value in pairs if name.strip() == "charset"}
    if media.strip().encode() != JSON or charsets - _UTF_8:
        text = media_type[:80].decode("latin-1")
        detail = f"send {JSON.decode()}, not {text}{remedy and f'; {remedy}'}"
        raise RequestError(
            ProblemKind.UNSUPPORTED_BODY, detail, headers={"Accept-Post": JSON.decode()}
        )
    if headers.get(b"content-encoding", b"identity").lower() != b"identity":
        detail = "send the body without Content-Encoding"
        raise RequestError(
            ProblemKind.UNSUPPORTED_BODY, detail, headers={"Accept-Encoding": "identity"}
        )


_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


async def read_body(
    headers: Mapping[bytes, bytes],
    receive: Receive,
    limit: int,
    scope: Scope,
) -> bytearray:
    """Return the body of a request.  Its ticket holds the bytes, unless the body is small and
    arrives at once; then it is answered before anything else is read."""
    length = headers.get(b"content-length", b"0").strip()
    size = int(length) if length.isdigit() and len(length) < 19 else limit + 1
    body, unfinished = bytearray(), True
    ticket: Ticket | None = None
    while True:
        if size > limit:
            remedy = (
                "send many cases to /v1/mu-macro/batch, more in several requests, or give "
                "`mumacro eval` a file"
            )
            raise RequestError(
                ProblemKind.BODY_TOO_LARGE,
                f"a body may have up to {limit} bytes: {remedy}",
                max_bytes=limit,
            )
        if size > AT_ONCE or (body and unfinished):
            ticket = ticket or ticket_of(scope)
            ticket.weigh(size)
            ticket.hold(len(body))
        if not unfinished:
            if body.startswith(_BYTE_ORDER_MARK):  # RFC 8259, 8.1
                del body[: len(_BYTE_ORDER_MARK)]
            return body
        message = await receive()
        if message["type"] != "http.request":
            raise ClientDisconnect
        body += message.get("body", b"")
        unfinished = message.get("more_body", False)
        size = len(body)


async def small_body(request: Request) -> bytes:
    """Return the bytes of a small JSON body; refuse a query next to it."""
    headers = dict(request.scope["headers"])
    if headers.get(b"content-type") != JSON or b"content-encoding" in headers:
        only_json(headers)
    settings = request.app.state.settings
    limit = min(SMALL_BODY, settings.max_body_bytes)
    receiving = read_body(headers, request.receive, limit, request.scope)
    if ABORT in request.scope.get("state", ()):  # our own server limits this wait (server.py)
        body = bytes(await receiving)
    else:
        body = bytes(await within(settings.client_timeout_s, receiving))
    query = request.scope["query_string"]
    if query and (pairs := _pairs(query)):
        refuse(
            [
                FieldFault((name,), "belongs in the body", value, parameter=True)
                for name, value in pairs
            ]
        )
    return body


def members_of(query: bytes) -> dict[str, Any]:
    """Return the parameters of a query as a body has them: numbers as numbers, all others as
    texts."""
    members: dict[str, Any] = {}
    repeats: dict[str, None] = {}
    for name, value in _pairs(query) if query else ():
        if name in _LISTS:
            members.setdefault(name, []).extend(part.strip() for part in value.split(","))
        elif name in members:
            repeats[name] = None
        else:
            members[name] = _number(value)
    if repeats:
        refuse([FieldFault((name,), "is given more than once", parameter=True) for name in repeats])
    return members


def _pairs(query: bytes) -> list[tuple[str, str]]:
    """Return names and values of a query."""
    text = query.decode("latin-1")
    # a fast test; urllib would take longer
    if not query.translate(None, _PLAIN) and query.count(b"&") < 100:
        pairs = [pair.partition("=") for pair in text.split("&") if pair]
        return [(name, value) for name, _, value in pairs]
    try:
        return parse_qsl(text, keep_blank_values=True, errors="strict", max_num_fields=1000)
    except (ValueError, UnicodeDecodeError) as error:
        raise RequestError(
            ProblemKind.MALFORMED_BODY, f"the query cannot be read: {error}"
        ) from None


def _number(text: str) -> Any:
    """Return a number if the text is one, otherwise the text.  An unescaped "+" of a query arrives
    as a space."""
    if text.strip("0123456789.eE+- ") == "":
        try:
            number = float(text.replace("e ", "e+").replace("E ", "E+"))
        except ValueError:
            return text
        return int(number) if text.isdigit() and len(text) < 16 else number
    return text


# --- routes ---------------------------------------------------------------------------------------


async def understood_in(request: Request, is_requested: bool) -> dict[str, Any]:
    """Return the member of an answer that tells how the program understood the inputs in JSON, if
    the request asks for it."""
    return {UNDERSTOOD: understood(decode(await request.body()))} if is_requested else {}


class DirectRoute(APIRoute):
    """Handle ``async def answer(request, model)``: read the model directly from the bytes of the
    body, or from the query.

    Nothing else is resolved: such an endpoint declares no dependency, and its path has no
    parameter.
    """

    def get_route_handler(self) -> Handler:
        """Return the handler that replaces FastAPI's."""
        in_body = bool(self.dependant.body_params)
        parameter = (self.dependant.body_params or self.dependant.query_params)[0]
        model: Any = parameter.field_info.annotation
        answer: Any = self.endpoint

        async def of_body(request: Request) -> Response:
            request._body = body = await small_body(request)  # for understood_in
            if len(body) <= AT_ONCE:
                asked = validated(model, body)
            else:
                check = partial(validated, model, body)
                asked = await compute(request, check, len(body) / _BYTES_PER_UNIT)
            response: Response = await answer(request, asked)
            return response

        async def of_query(request: Request) -> Response:
            members = members_of(request.scope["query_string"])
            try:
                case = model.model_validate(members)
            except ValidationError as error:
                raise invalid(error, model, members, parameter=True) from None
            response: Response = await answer(request, case)
            return response

        if self.dependant.dependencies:
            raise TypeError(f"{self.path} has a dependency, which a DirectRoute does not solve")
        return of_body if in_body else of_query


def of_members(model: Any, members: Mapping[str, Any]) -> Any:
    """Return the model of these members."""
    try:
        return model.model_validate(members)
    except ValidationError as error:
        raise invalid(error, model, members) from None


def validated(model: Any, text: bytes) -> Any:
    """Return the model that a JSON text holds."""
    try:
        instance = model.model_validate_json(text)
    except ValidationError as error:
        # Python's reader gives the reason if the text is not JSON or a member occurs twice
        members = decode(text)
        if not isinstance(members, dict):
            refuse([FieldFault((), "must be a JSON object", members)])
        if error.error_count() > 1 or error.errors()[0]["type"] != "json_invalid":
            raise invalid(error, model, members) from None
        return of_members(model, members)  # such as half of a surrogate pair
    # one colon for each member: no name occurs twice, and no object is nested
    if text.count(b":") != len(instance.model_fields_set):
        decode(text)
    return instance

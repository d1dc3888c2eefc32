"""The short way: one good case is answered ahead of the router, straight on the protocol.

Whatever is not plainly good - a fault, a condition, a missing key, an odd header - goes the long way through the
application, which reads the same request again and finds the words for it.  So there is one definition of what is
right (service/schemas.py), and every refusal is written in one place.
"""

import secrets
import time
from collections.abc import Awaitable, Callable

import orjson
from fastapi import FastAPI
from pydantic import ValidationError
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service import API_VERSION
from service.answers import case_etag, default_answer, included
from service.errors import InvalidFieldsError
from service.intake import canonical
from service.logs import AccessLog, accept_request_id, new_request_id
from service.metrics import Metrics
from service.middleware import BATCH_PATH
from service.schemas import CaseRequest
from service.settings import Settings, cache_control
from service.shelf import LoadedTable, Shelf

__all__ = ["Application", "ShortWay"]

_PATH = "/v1/mu-macro"
_LONG = 4  # digits of a Content-Length that no single case has
_JSON = frozenset({None, b"application/json", b"application/json; charset=utf-8", b"application/json;charset=utf-8"})
_PLAIN_QUERY = b"0123456789.eE+-=&" + "".join(sorted(set("mu0Fzky0omegav0tolerance"))).encode()
_validate = CaseRequest.__pydantic_validator__.validate_json

Handler = Callable[[Scope, Receive, Send], Awaitable[None]]


class Application(FastAPI):
    """The application, with the short way in front of it."""

    short: "ShortWay"
    batch_way: ASGIApp

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run one request, the short way if it may be one for it."""
        if scope["type"] == "http" and scope["path"] == _PATH:
            method = scope["method"]
            if method == "POST":
                await self.short.post(scope, receive, send)
                return
            if method == "GET":
                await self.short.get(scope, receive, send)
                return
        elif scope["type"] == "http" and scope["path"] == BATCH_PATH and scope["method"] == "POST":
            await self.batch_way(scope, receive, send)
            return
        await self.long_way(scope, receive, send)

    async def long_way(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run one request through middleware and router."""
        await super().__call__(scope, receive, send)


class ShortWay:
    """``POST`` and ``GET /v1/mu-macro`` for one good case."""

    def __init__(self, long_way: Handler, shelf: Shelf, settings: Settings, metrics: Metrics, log: AccessLog) -> None:
        self._long_way = long_way
        self._shelf = shelf
        self._max_bytes = settings.max_body_bytes
        self._key = None if settings.api_key is None else settings.api_key.get_secret_value().encode("ascii")
        self._cache_control = cache_control(settings).encode("ascii")
        self._metrics = metrics
        self._log = log
        self._posted = metrics.place(_PATH, "POST", 200)
        self._got = metrics.place(_PATH, "GET", 200)

    async def post(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one case in the body."""
        started = time.perf_counter()
        headers = dict(scope["headers"])
        length = headers.get(b"content-length", b"")
        if (
            not 0 < len(length) < _LONG
            or headers.get(b"content-type") not in _JSON
            or scope["query_string"]
            or b"content-encoding" in headers
            or (self._key is not None and not self._admits(headers))
        ):
            await self._long_way(scope, receive, send)
            return
        message = await receive()
        body = message.get("body", b"")
        while message.get("more_body") and len(body) < 1000:
            message = await receive()
            body += message.get("body", b"")
        content = None
        if message["type"] == "http.request" and not message.get("more_body") and len(body) <= self._max_bytes:
            content = self._answer(body)
        if content is None:
            await self._long_way(scope, _again(message, body, receive), send)
            return
        offered = headers.get(b"x-request-id")
        identity = new_request_id() if offered is None else accept_request_id(offered)
        await send(
            {
                "type": "http.response.start",
                "status": 200,
                "headers": [
                    (b"content-length", b"%d" % len(content)),
                    (b"content-type", b"application/json"),
                    (b"x-request-id", identity.encode("ascii")),
                    (b"x-content-type-options", b"nosniff"),
                ],
            }
        )
        await send({"type": "http.response.body", "body": content})
        seconds = time.perf_counter() - started
        self._metrics.count(self._posted, seconds)
        client = scope["client"]
        self._log.write(identity, "POST", _PATH, 200, seconds, client[0] if client else None)

    async def get(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one case in the query."""
        started = time.perf_counter()
        headers = dict(scope["headers"])
        found = None
        if b"if-none-match" not in headers and (self._key is None or self._admits(headers)):
            found = self._answer_query(scope["query_string"])
        if found is None:
            await self._long_way(scope, receive, send)
            return
        content, etag = found
        offered = headers.get(b"x-request-id")
        identity = new_request_id() if offered is None else accept_request_id(offered)
        await send(
            {
                "type": "http.response.start",
                "status": 200,
                "headers": [
                    (b"etag", etag.encode("ascii")),
                    (b"cache-control", self._cache_control),
                    (b"content-length", b"%d" % len(content)),
                    (b"content-type", b"application/json"),
                    (b"x-request-id", identity.encode("ascii")),
                    (b"x-content-type-options", b"nosniff"),
                ],
            }
        )
        await send({"type": "http.response.body", "body": content})
        seconds = time.perf_counter() - started
        self._metrics.count(self._got, seconds)
        client = scope["client"]
        self._log.write(identity, "GET", _PATH, 200, seconds, client[0] if client else None)

    def _admits(self, headers: dict[bytes, bytes]) -> bool:
        assert self._key is not None  # noqa: S101  (asked only when there is a key)
        return secrets.compare_digest(headers.get(b"x-api-key", b""), self._key)

    def _answer(self, body: bytes) -> bytes | None:
        try:
            case = _validate(body)
        except ValidationError:
            return None
        table = self._table(case)
        return None if table is None else self._write(table, case)

    def _answer_query(self, query: bytes) -> tuple[bytes, str] | None:
        # A query of plain numbers is a JSON object in another spelling.  Anything that JSON, or a query, spells
        # in its own way has a character or a word that is not let through here, or is no JSON after this.
        if not query or query.translate(None, _PLAIN_QUERY) or b"=null" in query:
            return None
        try:
            case = _validate(b'{"' + query.replace(b"=", b'":').replace(b"&", b',"') + b"}")
        except ValidationError:
            return None
        if len(case.model_fields_set) != query.count(b"&") + 1:
            return None  # a name is given twice
        table = self._table(case)
        return None if table is None else (self._write(table, case), case_etag(table, case, ()))

    def _table(self, case: CaseRequest) -> LoadedTable | None:
        shelf = self._shelf
        if shelf.fault is not None:
            return None
        if case.tolerance is None:
            return shelf.tables[0]
        try:
            return shelf.pick(case.tolerance)
        except InvalidFieldsError:
            return None

    def _write(self, table: LoadedTable, case: CaseRequest) -> bytes:
        values, source = default_answer(table, case)
        if case.include:
            values.update(included(table, case, canonical(case.include)))
        values["table"] = table.fragment
        values["api_version"] = API_VERSION
        self._metrics.cells[table.metrics_place + source] += 1.0
        return orjson.dumps(values)


def _again(message: Message, body: bytes, receive: Receive) -> Receive:
    """A ``receive`` that gives once more what was taken."""
    first: Message | None = {**message, "body": body} if message["type"] == "http.request" else message

    async def receive_again() -> Message:
        nonlocal first
        if first is not None:
            taken, first = first, None
            return taken
        return await receive()

    return receive_again

"""The short way: one good case, or a small batch, is answered ahead of the router, straight on the protocol.

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
from service.middleware import BATCH_PATH, COMPRESS_FROM
from service.schemas import CaseRequest
from service.sending import wants_gzip
from service.settings import Settings, cache_fields
from service.shelf import LoadedTable, Shelf

__all__ = ["CASE_PATH", "SMALL_BATCH", "Application", "ShortWay"]

CASE_PATH = "/v1/mu-macro"
#: bytes of a batch that needs no place, and is answered on the connection
SMALL_BATCH = 64 * 1024
_LONG = 4  # digits of a Content-Length that no single case has
_MANY = 6  # and of one that no small batch has
_UNLIMITED = 1 << 62
_JSON = frozenset({None, b"application/json", b"application/json; charset=utf-8", b"application/json;charset=utf-8"})
_PLAIN_QUERY = b"0123456789.eE+-=&" + "".join(sorted(set("mu0Fzky0omegav0tolerance"))).encode()
_validate = CaseRequest.__pydantic_validator__.validate_json

_HEAD = (
    b"%bcontent-length: %d\r\ncontent-type: application/json\r\n"
    b"x-request-id: %b\r\nx-content-type-options: nosniff\r\n\r\n"
)

Headers = dict[bytes, bytes]
Handler = Callable[[Scope, Receive, Send], Awaitable[None]]
#: answers a small batch with no more bytes than that, or not at all
SmallBatch = Callable[[bytes, int], bytes | None]


class Application(FastAPI):
    """The application, with the short way in front of it."""

    short: "ShortWay"
    batch_way: ASGIApp

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run one request, the short way if it may be one for it."""
        if scope["type"] == "http":
            path, method = scope["path"], scope["method"]
            if path == CASE_PATH and method in ("GET", "POST"):
                await self.short(scope, receive, send)
                return
            if path == BATCH_PATH and method == "POST":
                await self.batch_way(scope, receive, send)
                return
        await self.long_way(scope, receive, send)

    async def long_way(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run one request through middleware and router."""
        await super().__call__(scope, receive, send)


class ShortWay:
    """``POST`` and ``GET /v1/mu-macro`` for one good case; on our own connections also batches of up to 64 KiB."""

    def __init__(
        self,
        long_way: Handler,
        batch: SmallBatch,
        shelf: Shelf,
        settings: Settings,
        metrics: Metrics,
        log: AccessLog,
    ) -> None:
        self._long_way = long_way
        self._batch = batch
        self._shelf = shelf
        self._max_bytes = settings.max_body_bytes
        self._key = None if settings.api_key is None else settings.api_key.get_secret_value().encode("ascii")
        self._kept = [(name.encode("ascii"), value.encode("ascii")) for name, value in cache_fields(settings).items()]
        self._kept_head = b"".join(b"%b: %b\r\n" % field for field in self._kept)
        self._metrics = metrics
        self._log = log
        kinds = ((CASE_PATH, "GET"), (CASE_PATH, "POST"), (BATCH_PATH, "POST"))
        self._durations = {kind: metrics.pending(metrics.place(*kind, 200)) for kind in kinds}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, or hand the request on with nothing taken from it."""
        started = time.perf_counter()
        headers = dict(scope["headers"])
        method = scope["method"]
        body = b""
        if method == "POST":
            if not self.is_short(scope, headers):
                await self._long_way(scope, receive, send)
                return
            message = await receive()
            body = message.get("body", b"")
            if message["type"] != "http.request" or message.get("more_body"):
                await self._long_way(scope, _again(message, receive), send)
                return
            receive = _again(message, receive)
        reply = self.reply(scope, headers, body)
        if reply is None:
            await self._long_way(scope, receive, send)
            return
        identity, etag, content = reply
        fields = [
            (b"content-length", b"%d" % len(content)),
            (b"content-type", b"application/json"),
            (b"x-request-id", identity.encode("ascii")),
            (b"x-content-type-options", b"nosniff"),
        ]
        if etag is not None:
            fields += [(b"etag", etag.encode("ascii")), *self._kept]
        await send({"type": "http.response.start", "status": 200, "headers": fields})
        await send({"type": "http.response.body", "body": content})
        self.finish(scope, identity, time.perf_counter() - started)

    @staticmethod
    def is_short(scope: Scope, headers: Headers) -> bool:
        """Whether the head of a request promises one case, or a small batch, plainly put."""
        path, method = scope["path"], scope["method"]
        if method == "GET":
            return bool(path == CASE_PATH)
        length = headers.get(b"content-length", b"")
        if path == CASE_PATH:
            few = 0 < len(length) < _LONG
        else:
            few = path == BATCH_PATH and 0 < len(length) < _MANY and length.isdigit() and int(length) <= SMALL_BATCH
        return (
            few
            and method == "POST"
            and headers.get(b"content-type") in _JSON
            and not scope["query_string"]
            and b"content-encoding" not in headers
        )

    def reply(self, scope: Scope, headers: Headers, body: bytes) -> tuple[str, str | None, bytes] | None:
        """Request id, entity tag (for GET) and content; None for what has to go the long way."""
        if self._key is not None and not secrets.compare_digest(headers.get(b"x-api-key", b""), self._key):
            return None
        if scope["path"] == BATCH_PATH:
            packed = wants_gzip(headers.get(b"accept-encoding", b"").decode("latin-1"))
            content = self._batch(body, COMPRESS_FROM - 1 if packed else _UNLIMITED)
            return None if content is None else (self._identity(headers), None, content)
        if scope["method"] == "GET":
            if b"if-none-match" in headers:
                return None
            case = self._case_in_query(scope["query_string"])
        else:
            case = self._case_in_body(body)
        if case is None or (case.std is None) == ("std" in (case.include or ())):
            return None
        table = self._table(case.tolerance)
        if table is None:
            return None
        content = self._write(table, case)
        etag = case_etag(table, case, ()) if scope["method"] == "GET" else None
        return self._identity(headers), etag, content

    @staticmethod
    def _identity(headers: Headers) -> str:
        offered = headers.get(b"x-request-id")
        return new_request_id() if offered is None else accept_request_id(offered)

    def head(self, identity: str, etag: str | None, length: int) -> bytes:
        """The fields of a reply as they stand on the wire."""
        cached = b"" if etag is None else b"etag: %b\r\n%b" % (etag.encode(), self._kept_head)
        return _HEAD % (cached, length, identity.encode())

    def finish(self, scope: Scope, identity: str, seconds: float) -> None:
        """Count and log."""
        path, method, client = scope["path"], scope["method"], scope["client"]
        self._durations[path, method].append(seconds)
        self._log.write(identity, method, path, 200, seconds, client[0] if client else None)

    def _case_in_body(self, body: bytes) -> CaseRequest | None:
        if len(body) > self._max_bytes:
            return None
        try:
            case: CaseRequest = _validate(body)
        except ValidationError:
            return None
        return case

    @staticmethod
    def _case_in_query(query: bytes) -> CaseRequest | None:
        # A query of plain numbers is a JSON object in another spelling.  Anything that JSON, or a query, spells
        # in its own way has a character or a word that is not let through here, or is no JSON after this.
        if query.translate(None, _PLAIN_QUERY) or b"=null" in query:
            return None
        try:
            case: CaseRequest = _validate(b'{"' + query.replace(b"=", b'":').replace(b"&", b',"') + b"}")
        except ValidationError:
            return None
        # fewer fields than names: one is given twice
        return case if len(case.__pydantic_fields_set__) == query.count(b"&") + 1 else None

    def _table(self, tolerance: float | None) -> LoadedTable | None:
        shelf = self._shelf
        if shelf.fault is not None:
            return None
        if tolerance is None:
            return shelf.tables[0]
        try:
            return shelf.pick(tolerance)
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


def _again(message: Message, receive: Receive) -> Receive:
    """A ``receive`` that gives once more what was taken."""
    first: Message | None = message

    async def receive_again() -> Message:
        nonlocal first
        if first is not None:
            taken, first = first, None
            return taken
        return await receive()

    return receive_again

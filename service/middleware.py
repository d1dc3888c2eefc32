"""Pure ASGI middleware: request record, API key, body limit.

Written against the protocol itself: ``BaseHTTPMiddleware`` would cost a task and a queue per request.
Outermost first: RequestRecord, ApiKeyGate, BodyLimit, Compression.
"""

import logging
import secrets
import time

from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.errors import BodyTooLargeError, UnauthorizedError, problem_of
from service.logs import AccessLog, accept_request_id, request_id
from service.metrics import Metrics

__all__ = ["BATCH_PATH", "COMPRESS_FROM", "HEALTH_PATHS", "ApiKeyGate", "BodyLimit", "Compression", "RequestRecord"]

BATCH_PATH = "/v1/mu-macro/batch"
#: bytes of an answer that is worth packing
COMPRESS_FROM = 16 * 1024
HEALTH_PATHS = frozenset({"/livez", "/readyz", "/healthz"})

_errors = logging.getLogger("mumacro.error")


def _header(scope: Scope, name: bytes) -> bytes | None:
    for key, value in scope["headers"]:
        if key == name:
            found: bytes = value
            return found
    return None


class RequestRecord:
    """Gives a request its id, writes its line into the log, and is the last net under an exception."""

    def __init__(self, app: ASGIApp, metrics: Metrics, log: AccessLog) -> None:
        self.app = app
        self.metrics = metrics
        self.log = log

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run one request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        identity = accept_request_id(_header(scope, b"x-request-id"))
        token = request_id.set(identity)
        started = time.perf_counter()
        status = 0

        async def send_marked(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                message["headers"] = [
                    *message.get("headers", ()),
                    (b"x-request-id", identity.encode("ascii")),
                    (b"x-content-type-options", b"nosniff"),
                ]
            await send(message)

        try:
            await self.app(scope, receive, send_marked)
        except ClientDisconnect:
            status = 499  # the customary number for a caller who left before the answer
        except Exception as error:
            _errors.exception("unexpected error", extra={"fields": {"path": scope["path"]}})
            if status == 0:
                await problem_of(error, scope["path"])(scope, receive, send_marked)
        finally:
            self._finish(scope, status, time.perf_counter() - started)
            request_id.reset(token)

    def _finish(self, scope: Scope, status: int, seconds: float) -> None:
        method, path = scope["method"], scope["path"]
        self.metrics.count(self.metrics.place(path, method, status), seconds)
        # Probes come every few seconds and say nothing while they succeed.
        level = logging.DEBUG if status == 200 and path in HEALTH_PATHS else logging.INFO
        client = scope.get("client")
        self.log.record(level, method, path, status, seconds, client[0] if client else None)


class ApiKeyGate:
    """Asks for the API key, everywhere but at ``open_paths``.  Without a key in the settings it is open."""

    def __init__(self, app: ASGIApp, key: str | None, open_paths: frozenset[str] = HEALTH_PATHS) -> None:
        self.app = app
        self.key = None if key is None else key.encode("ascii")
        self.open_paths = open_paths

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run one request, or answer 401."""
        if self.key is None or scope["type"] != "http" or scope["path"] in self.open_paths or self._admits(scope):
            await self.app(scope, receive, send)
            return
        fault = UnauthorizedError(
            "send the API key as X-API-Key or as Authorization: Bearer", headers={"WWW-Authenticate": "Bearer"}
        )
        await problem_of(fault, scope["path"])(scope, receive, send)

    def _admits(self, scope: Scope) -> bool:
        assert self.key is not None  # noqa: S101  (__call__ lets everyone in when there is no key)
        offered = _header(scope, b"x-api-key")
        if offered is None:
            scheme, _, credentials = (_header(scope, b"authorization") or b"").partition(b" ")
            offered = credentials.strip() if scheme.lower() == b"bearer" else b""
        return secrets.compare_digest(offered, self.key)


class BodyLimit:
    """Refuses a body over the limit: before reading where Content-Length tells, else while reading."""

    def __init__(self, app: ASGIApp, max_bytes: int) -> None:
        self.app = app
        self.max_bytes = max_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run one request with a counted ``receive``."""
        # Batches watch their own size: one that comes as a stream has no end to count to.
        if scope["type"] != "http" or scope["method"] in ("GET", "HEAD") or scope["path"] == BATCH_PATH:
            await self.app(scope, receive, send)
            return
        length = _header(scope, b"content-length")
        if length is not None and length.isdigit() and int(length) > self.max_bytes:
            await problem_of(self._fault(), scope["path"])(scope, receive, send)
            return
        count = 0

        async def receive_counted() -> Message:
            nonlocal count
            message = await receive()
            if message["type"] == "http.request":
                count += len(message.get("body", b""))
                if count > self.max_bytes:
                    raise self._fault()
            return message

        await self.app(scope, receive_counted, send)

    def _fault(self) -> BodyTooLargeError:
        # The rest of the body is not wanted: without "close" the server would go on reading it.
        return BodyTooLargeError(
            f"the body may have up to {self.max_bytes} bytes", headers={"Connection": "close"}, max_bytes=self.max_bytes
        )


class Compression:
    """Packs large answers for callers who want it, but never the table's file: it is packed, and its tag is that of
    its bytes.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._plain = app
        self._packing = GZipMiddleware(app, minimum_size=COMPRESS_FROM, compresslevel=1)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run one request."""
        packing = scope["type"] == "http" and scope["path"] != "/v1/table.nc"
        await (self._packing if packing else self._plain)(scope, receive, send)

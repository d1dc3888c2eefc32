"""Pure ASGI middleware: the record of a request, and compression.

Outermost first: CORS (if set), SingleCase, RequestRecord, Guard, Compression, then the router.  Middleware added with
``app.add_middleware`` is outside all of them.
"""

import logging
import time
from typing import Any

from isal import isal_zlib
from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from .errors import problem_of
from .guard import path_of
from .logs import AccessLog, accept_request_id, request_id
from .metrics import Metrics
from .tables import Tables

__all__ = ["COMPRESS_FROM", "HEALTH_PATHS", "NOSNIFF", "Compression", "RequestRecord"]

#: least size of an answer that is compressed [bytes]
COMPRESS_FROM = 16 * 1024
HEALTH_PATHS = frozenset({"/livez", "/readyz", "/healthz"})
NOSNIFF = (b"x-content-type-options", b"nosniff")
_CLOSE = (b"connection", b"close")

_errors = logging.getLogger("mumacro.error")


class RequestRecord:
    """Gives a request its id, logs and counts it, and answers 500 for an exception that nothing else handled.

    While the service is stopping, responses have ``Connection: close``, so that no client sends a request on a
    connection that is about to end.
    """

    def __init__(self, app: ASGIApp, metrics: Metrics, log: AccessLog, tables: Tables) -> None:
        self.app = app
        self.metrics = metrics
        self.log = log
        self.tables = tables

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run one request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        offered, close = None, self.tables.draining
        for name, value in scope["headers"]:
            if name == b"x-request-id":
                offered = value
            elif name == b"upgrade":
                close = True
        identity = accept_request_id(offered)
        token = request_id.set(identity)
        started = time.perf_counter()
        status = 0

        async def send_marked(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                headers = [*message["headers"], (b"x-request-id", identity.encode("ascii")), NOSNIFF]
                if close and _CLOSE not in headers:
                    headers.append(_CLOSE)
                message["headers"] = headers
            await send(message)

        try:
            await self.app(scope, receive, send_marked)
        except ClientDisconnect:
            status = 499  # the usual status for a client that disconnected before the answer
        except Exception as error:
            _errors.exception("unexpected error", extra={"fields": {"path": scope["path"]}})
            if status == 0:
                await problem_of(error, scope["path"])(scope, receive, send_marked)
        finally:
            self._finish(scope, identity, status, time.perf_counter() - started)
            request_id.reset(token)

    def _finish(self, scope: Scope, identity: str, status: int, seconds: float) -> None:
        method, path = scope["method"], path_of(scope)
        self.metrics.count(path, method, status, seconds)
        client = scope.get("client")
        state = scope.get("state")
        self.log.write(
            identity, method, path, status, seconds, client[0] if client else None,
            state.get("key_name") if state else None, quiet=status == 200 and path in HEALTH_PATHS,
        )  # fmt: skip


class Compression:
    """Compresses large answers with gzip if the client accepts it; never the table file, whose ETag is of its bytes.

    Intel's library takes a few per cent of the time of zlib, at the same size.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run one request."""
        if scope["type"] == "http" and path_of(scope) != "/v1/table.nc":
            for name, value in scope["headers"]:
                if name == b"accept-encoding" and _wants_gzip(value.decode("latin-1")):
                    send = _Packed(send)
                    break
        await self.app(scope, receive, send)


class _Packed:
    """A ``send`` that compresses large answers; it holds the head until the first piece shows the size."""

    def __init__(self, send: Send) -> None:
        self._send = send
        self._start: Message | None = None
        self._packer: Any = None

    async def __call__(self, message: Message) -> None:
        """Send a message."""
        if message["type"] == "http.response.start":
            self._start = message
            return
        start = self._start
        body, more = message.get("body", b""), message.get("more_body", False)
        if start is not None:
            self._start = None
            names = {name for name, _ in start["headers"]}
            if b"content-encoding" not in names and start["status"] == 200:
                if b"vary" not in names:
                    start["headers"] = [*start["headers"], (b"vary", b"accept-encoding")]
                if len(body) >= COMPRESS_FROM or (more and b"content-length" not in names):
                    self._packer = isal_zlib.compressobj(1, isal_zlib.DEFLATED, 31)
                    kept = [field for field in start["headers"] if field[0] != b"content-length"]
                    start["headers"] = [*kept, (b"content-encoding", b"gzip")]
            await self._send(start)
        if self._packer is not None and message["type"] == "http.response.body":
            packed = self._packer.compress(body)
            packed += self._packer.flush(isal_zlib.Z_SYNC_FLUSH if more else isal_zlib.Z_FINISH)
            message = {"type": "http.response.body", "body": packed, "more_body": more}
        await self._send(message)


def _wants_gzip(offers: str) -> bool:
    """Whether this value of Accept-Encoding accepts gzip."""
    wanted = {}
    for offer in offers.lower().split(","):
        name, _, weight = offer.partition(";")
        wanted[name.strip()] = weight.replace(" ", "") not in ("q=0", "q=0.0", "q=0.00", "q=0.000")
    return wanted.get("gzip", wanted.get("*", False))

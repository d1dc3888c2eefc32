"""HTTP/1.1 on one connection: bytes to ASGI and back, one request after another, with a limit on every part.

uvicorn gets this class by its documented ``http`` parameter; the parser is llhttp (httptools).  uvicorn's own protocol
over the same parser has no limit on the size of a head, on the number of pipelined requests and on the wait for the
rest of a head.  It also takes half as long again for a request: docs/decisions/0011-wire.md.
"""

import asyncio
import logging
import math
from collections import deque
from http import HTTPStatus
from typing import Any
from urllib.parse import unquote

import httptools
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from .errors import OverloadedError, problem_of
from .guard import BATCH_PATH, CLOSE, path_of

__all__ = ["Connection"]

MAX_HEAD = 64 * 1024  # bytes of a request's head, and of anything else that is not a body
_HEADS = 16 * 1024  # bytes that are parsed at a time between requests: limits the queue of pipelined requests
_BODIES = 64 * 1024  # and within a body
_AHEAD = 256 * 1024  # bytes that wait to be parsed; above this the socket is not read
_UNREAD = 256 * 1024  # bytes of a body that the application has not taken yet
_TOGETHER = 64 * 1024  # bytes of a body that are copied after the head: one write to the socket instead of two
_LINGER_S = 5.0  # how long the rest of an unused body is read, so that the client gets the answer and not a reset,
_LINGER = 32 * 1024 * 1024  # and how many bytes of it
_LAST_S = 0.25  # how long a stopping service still accepts a request on an open connection
_STATUS = {status.value: f"HTTP/1.1 {status.value} {status.phrase}\r\n".encode() for status in HTTPStatus}
_NOTED = frozenset({b"host", b"expect", b"transfer-encoding"})  # header fields that are used here
_log = logging.getLogger("mumacro.error")


async def _refuse(scope: Scope, receive: Receive, send: Send) -> None:
    error = OverloadedError("too many connections are open", headers=CLOSE)
    await problem_of(error, scope["path"])(scope, receive, send)


class _Exchange:
    """One request and its answer."""

    __slots__ = (
        "answered", "connection", "expects", "gone", "head", "keep", "left", "more", "pieces", "scope", "started",
        "taken", "task", "unread", "waiter",
    )  # fmt: skip

    def __init__(self, connection: "Connection", scope: Scope, keep: bool, expects: bool) -> None:
        self.connection, self.scope = connection, scope
        self.keep = keep  # whether the connection stays open after it
        self.expects = expects  # whether the client waits for "100 Continue"
        self.pieces: list[bytes] = []  # of the body, that the application has not taken yet
        self.unread = 0  # bytes in them
        self.more = True
        self.taken = False  # whether the application has all of the body
        self.started = self.answered = self.gone = False
        self.head = b""  # of an answer of known length: written together with its first piece
        self.left = 0.0  # bytes of Content-Length that are not written yet; infinite: sent in chunks
        self.waiter: asyncio.Future[None] | None = None
        self.task: asyncio.Task[None] | None = None

    async def run(self, app: ASGIApp) -> None:
        """Let the application answer the request."""
        try:
            await app(self.scope, self.receive, self.send)
        except Exception:
            _log.exception("unexpected error outside of the application")
        finally:
            self.connection.finished(self)

    def wake(self) -> None:
        """Wake ``receive``: there is a message."""
        if self.waiter is not None and not self.waiter.done():
            self.waiter.set_result(None)

    async def receive(self) -> Message:
        """The next piece of the body, or the message that the client has disconnected."""
        if self.expects and not self.started:
            self.expects = False
            self.connection.write(b"HTTP/1.1 100 Continue\r\n\r\n")
        while not (self.gone or self.answered):
            if self.pieces or not (self.more or self.taken):
                pieces, self.pieces, self.unread = self.pieces, [], 0
                body = pieces[0] if len(pieces) == 1 else b"".join(pieces)
                self.taken = not self.more
                if self.connection.paused:
                    self.connection.regulate()
                return {"type": "http.request", "body": body, "more_body": self.more}
            self.waiter = asyncio.get_running_loop().create_future()
            await self.waiter
        return {"type": "http.disconnect"}

    async def send(self, message: Message) -> None:
        """Write the head or a piece of the answer.

        Raises
        ------
        RuntimeError
            Messages out of order, a line break or a zero byte in a header, or another length than Content-Length.
        """
        if self.connection.stalled is not None and not self.gone:
            await self.connection.stalled.wait()
        if self.gone:
            return
        if message["type"] == "http.response.start" and not self.started:
            self._begin(message["status"], message.get("headers", ()))
            return
        if message["type"] != "http.response.body" or not self.started or self.answered:
            raise RuntimeError(f"{message['type']} is out of order")
        body, more = message.get("body", b""), message.get("more_body", False)
        if self.left == math.inf:
            content = b"%x\r\n%b\r\n" % (len(body), body) if body else b""
            self.connection.write(content if more else content + b"0\r\n\r\n")
        else:
            if self.scope["method"] == "HEAD":
                body = b""
            self.left -= len(body)
            if self.left < 0.0 or (self.left > 0.0 and not more):
                raise RuntimeError("the answer has another length than was announced")
            if len(body) <= _TOGETHER:
                self.connection.write(self.head + body)
            else:
                self.connection.write(self.head)
                self.connection.write(body)
            self.head = b""
        if not more:
            self.answered = True
            self.wake()
            self.connection.answered(self)

    def _begin(self, status: int, headers: Any) -> None:
        bodiless = self.scope["method"] == "HEAD" or status in (204, 304)
        sized = bodiless
        fields = []
        for name, value in headers:
            name = name.lower()
            if name == b"content-length":
                sized, self.left = True, 0.0 if bodiless else float(value)
            elif name == b"connection":
                self.keep = self.keep and b"close" not in value.lower()
                continue
            fields.append(b"%b: %b\r\n" % (name, value))
        if not sized:
            self.left = math.inf
            fields.append(b"transfer-encoding: chunked\r\n")
        if not self.keep:
            fields.append(b"connection: close\r\n")
        text = b"".join(fields)
        if text.count(b"\n") != len(fields) or text.count(b"\r") != len(fields) or b"\0" in text:
            raise RuntimeError("a header holds a line break or a zero byte")
        self.started = True
        head = b"%b%b%b\r\n" % (_STATUS[status], self.connection.defaults(), text)
        if sized:
            self.head = head
        else:
            self.connection.write(head)


class Connection(asyncio.Protocol):
    """One connection; ``timeout_s`` is set by the application for all."""

    timeout_s = 30.0
    _default_fields: tuple[Any, bytes] = ((), b"")

    def __init__(self, config: Any, server_state: Any, app_state: dict[str, Any], _loop: Any = None) -> None:
        if not config.loaded:
            config.load()
        self._config, self._server, self._app_state = config, server_state, app_state
        self._loop: asyncio.AbstractEventLoop = _loop or asyncio.get_event_loop()
        self._parser = httptools.HttpRequestParser(self)
        self._transport: Any = None
        self._fixed: dict[str, Any] = {}  # of every scope
        self._held = bytearray()  # bytes that arrived while an earlier request was unanswered
        self._queue: deque[_Exchange] = deque()  # requests that are parsed and wait for their turn
        self._now: _Exchange | None = None  # the request that is being answered
        self._coming: _Exchange | None = None  # the request whose body is being read
        self._in_head = False
        self._url, self._headers = b"", list[tuple[bytes, bytes]]()
        self._expects, self._hosts = False, 0
        self._idle_bytes = 0  # since the last head, or piece of a body, was complete
        self._moved = False
        self._stopping = False
        self._deaf = False  # whether received bytes are discarded
        self.paused = False  # whether the socket is not read
        self.stalled: asyncio.Event | None = None  # while the client does not read
        self._clock: asyncio.TimerHandle | None = None
        self._idle_clock: asyncio.TimerHandle | None = None
        self._idle_since = 0.0

    # --- callbacks of the transport -------------------------------------------------------------------

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin."""
        self._transport = transport
        self._server.connections.add(self)
        info = transport.get_extra_info
        self._fixed = {
            "type": "http",
            "asgi": {"version": self._config.asgi_version, "spec_version": "2.3"},
            "scheme": "https" if info("sslcontext") else "http",
            "root_path": self._config.root_path,
            "client": _address(info("peername")),
            "server": _address(info("sockname")),
        }
        self._watch(self.timeout_s)
        self._rest()
        self._idle_clock = self._loop.call_later(self._config.timeout_keep_alive, self._close_idle)

    def connection_lost(self, exc: Exception | None) -> None:
        """End."""
        del exc
        self._server.connections.discard(self)
        self._deaf = True
        self._held.clear()
        self._unwatch()
        if self._idle_clock is not None:
            self._idle_clock.cancel()
        for exchange in (self._now, *self._queue):
            if exchange is not None:
                exchange.gone = True
                exchange.wake()
        self._queue.clear()
        self.resume_writing()

    def eof_received(self) -> bool:
        """The client sends no more: answer complete requests, then close.  False: the transport closes at once."""
        self._deaf = True
        now = self._now
        if now is None or now.answered or now.gone or self._coming is now:
            return False
        if self._coming is not None:
            self._queue.remove(self._coming)  # never complete
        self._last().keep = False
        return True

    def pause_writing(self) -> None:
        """The client reads too slowly: start its time limit."""
        self.stalled = asyncio.Event()
        self._watch(self.timeout_s)

    def resume_writing(self) -> None:
        """The client reads again."""
        if self.stalled is not None:
            self.stalled.set()
            self.stalled = None
            self._unwatch()

    def shutdown(self) -> None:
        """Answer the requests that have arrived or arrive within a short time, then close; uvicorn calls it."""
        self._stopping = True
        if self._is_idle:
            self._loop.call_later(_LAST_S, self._close_unused)
        else:
            self._last().keep = False

    @property
    def _is_idle(self) -> bool:
        return self._now is None or self._now.answered

    def _close_unused(self) -> None:
        if self._is_idle:
            self._transport.close()

    def data_received(self, data: bytes) -> None:
        """Parse bytes of the request that is being answered or begins; hold those of later requests."""
        if self._deaf:
            self._idle_bytes += len(data)
            if self._idle_bytes > _LINGER:
                self._give_up()
        elif self._held:
            self._held += data
            self._go_on()
        elif len(data) <= _HEADS and self._is_wanted:
            self._parse(data)
        else:
            self._feed(data)

    # --- from bytes to requests -----------------------------------------------------------------------

    @property
    def _is_wanted(self) -> bool:
        return self._now is None or self._coming is self._now

    def _go_on(self) -> None:
        """Parse held bytes."""
        if self._held and not self._deaf and self._is_wanted:
            held, self._held = self._held, bytearray()
            self._feed(held)
        self.regulate()

    def _feed(self, data: bytes | bytearray) -> None:
        """Parse bytes until a request waits for an earlier answer; hold the rest."""
        view, start = memoryview(data), 0
        while start < len(data) and not self._deaf and self._is_wanted:
            size = _HEADS if self._coming is None else _BODIES
            self._parse(view[start : start + size])
            start += size
        if start < len(data) and not self._deaf:
            self._held += view[start:]
            self.regulate()

    def _parse(self, data: bytes | memoryview) -> None:
        self._moved = False
        try:
            self._parser.feed_data(data)
        except httptools.HttpParserUpgrade:  # the following bytes would be another protocol
            self._last().keep = False
            self._deaf = True
        except httptools.HttpParserError:
            self._break(400)
        if self._moved:
            self._idle_bytes = 0
        else:
            self._idle_bytes += len(data)
            if self._idle_bytes > MAX_HEAD:
                self._break(431)
        if self._deaf:
            return
        now = self._now
        if now is not None and now.answered and self._coming is not now:
            self._next()  # all of an answered request has been read
        elif self._clock is None and self.stalled is None:
            coming = self._coming
            if self._in_head or (coming is not None and (coming.answered or not _keeps_time(coming.scope))):
                self._watch(self.timeout_s)
        if self._coming is not None:
            self.regulate()

    def on_message_begin(self) -> None:
        """Callback of the parser: a request begins."""
        self._in_head = True
        self._url, self._headers, self._expects, self._hosts = b"", [], False, 0

    def on_url(self, url: bytes) -> None:
        """Callback of the parser: a piece of the target."""
        self._url += url

    def on_header(self, name: bytes, value: bytes) -> None:
        """Callback of the parser: a header field, or a trailer field, which is ignored."""
        if self._in_head:
            name = name.lower()
            self._headers.append((name, value))
            if name in _NOTED:
                if name == b"host":
                    self._hosts += 1
                elif name == b"expect":
                    self._expects = value.lower() == b"100-continue"
                elif value.lower() != b"chunked":
                    raise ValueError("an unknown transfer coding")

    def on_headers_complete(self) -> None:
        """Callback of the parser: the head is complete."""
        self._in_head, self._moved = False, True
        url, parser = self._url, self._parser
        version = parser.get_http_version()
        if (version != "1.1" and version != "1.0") or (self._hosts != 1 and (self._hosts or version == "1.1")):
            raise ValueError("another version of HTTP, or not one Host")  # the parser reports it like its own errors
        if url.startswith(b"/") and b"#" not in url:
            path, _, query = url.partition(b"?")
        else:
            parsed = httptools.parse_url(url)
            path, query = parsed.path or b"/", parsed.query or b""
        text = path.decode("ascii")
        if "%" in text:
            text = unquote(text)
        root: str = self._fixed["root_path"]
        scope = {
            **self._fixed,
            "http_version": version,
            "method": parser.get_method().decode("ascii"),
            "path": root + text,
            "raw_path": root.encode("ascii") + path,
            "query_string": query,
            "headers": self._headers,
            "state": self._app_state.copy(),
        }
        keep = version != "1.0" and parser.should_keep_alive() and not self._stopping
        self._coming = exchange = _Exchange(self, scope, keep, self._expects)
        if self._now is None:
            self._begin(exchange)
        else:
            self._queue.append(exchange)

    def on_body(self, body: bytes) -> None:
        """Callback of the parser: a piece of the body."""
        self._moved = True
        exchange = self._coming
        if exchange is not None and not exchange.answered:
            exchange.pieces.append(body)
            exchange.unread += len(body)
            exchange.wake()

    def on_message_complete(self) -> None:
        """Callback of the parser: the request is complete."""
        self._moved = True
        exchange, self._coming = self._coming, None
        if exchange is not None:
            exchange.more = False
            exchange.wake()
        if self.stalled is None:
            self._unwatch()

    # --- from requests to answers ---------------------------------------------------------------------

    def _begin(self, exchange: _Exchange) -> None:
        self._now = exchange
        if self._clock is not None:
            self._unwatch()
        limit = self._config.limit_concurrency
        app = _refuse if limit is not None and len(self._server.connections) > limit else self._config.loaded_app
        exchange.task = self._loop.create_task(exchange.run(app))
        self._server.tasks.add(exchange.task)

    def answered(self, exchange: _Exchange) -> None:
        """The answer is written."""
        self._server.total_requests += 1
        if not exchange.keep:
            self._close(unread=exchange.more)
        elif exchange.more:  # first read the rest of its body
            self._watch(self.timeout_s)
            self.regulate()
        else:
            self._next()

    def finished(self, exchange: _Exchange) -> None:
        """The application is done with the request."""
        if exchange.task is not None:
            self._server.tasks.discard(exchange.task)
        if not (exchange.answered or exchange.gone):
            exchange.gone = True
            if exchange.started:
                self._transport.abort()  # the only way to show that the answer is not complete
            else:
                self._queue.clear()
                self._break(500)

    def _next(self) -> None:
        self._now = None
        self._rest()
        if self._queue:
            self._begin(self._queue.popleft())
        if self._held or self.paused:
            self._go_on()

    def _last(self) -> Any:
        return self._queue[-1] if self._queue else self._now

    def _break(self, status: int) -> None:
        """Answer with an error status, unless an answer has begun, and close."""
        self._deaf = True
        now = self._now
        if self._queue or (now is not None and not now.answered and not now.gone and self._coming is not now):
            self._last().keep = False  # complete requests are answered first
            return
        if now is not None and now.started and not now.answered:
            self._transport.abort()
            return
        self.write(_STATUS[status] + b"content-length: 0\r\nconnection: close\r\n\r\n")
        if now is not None and not now.answered:
            now.gone = True
            now.wake()
        self._close(unread=True)

    def _close(self, *, unread: bool) -> None:
        """Close after the written bytes; if the client may still send, after it has read the answer."""
        self._deaf = True
        if not unread and not self._held:
            self._transport.close()
            return
        self._held.clear()
        if self._transport.can_write_eof():
            self._transport.write_eof()
        self._watch(_LINGER_S)
        self.regulate()

    def write(self, data: bytes) -> None:
        """Write to the socket."""
        if data:
            self._transport.write(data)

    def defaults(self) -> bytes:
        """The header fields that the server adds to every answer: the date."""
        fields = self._server.default_headers
        known, text = Connection._default_fields
        if fields is not known:  # a new list every second
            text = b"".join(b"%b: %b\r\n" % field for field in fields)
            Connection._default_fields = fields, text
        return text

    # --- bounds ---------------------------------------------------------------------------------------

    def regulate(self) -> None:
        """Read the socket only while there is room in the buffers."""
        coming = self._coming
        full = len(self._held) > _AHEAD or (
            coming is not None and not coming.answered and coming.unread > _UNREAD
        )  # fmt: skip
        full = full and not self._deaf
        if full != self.paused:
            self.paused = full
            if full:
                self._transport.pause_reading()
            elif not self._transport.is_closing():
                self._transport.resume_reading()

    def _rest(self) -> None:
        self._idle_since = self._loop.time()

    def _close_idle(self) -> None:
        """Close after the keep-alive time without a request; else set the timer again."""
        kept: float = self._config.timeout_keep_alive
        left = kept if self._now is not None else self._idle_since + kept - self._loop.time()
        if left <= 0.0:
            self._transport.close()
        else:
            self._idle_clock = self._loop.call_later(left, self._close_idle)

    def _watch(self, seconds: float) -> None:
        self._unwatch()
        self._clock = self._loop.call_later(seconds, self._give_up)

    def _unwatch(self) -> None:
        if self._clock is not None:
            self._clock.cancel()
            self._clock = None

    def _give_up(self) -> None:
        self._deaf = True
        self._transport.abort()


def _address(found: Any) -> tuple[str, int] | None:
    """Host and port of a socket that has them."""
    return (str(found[0]), int(found[1])) if isinstance(found, tuple) and len(found) > 1 else None


def _keeps_time(scope: Scope) -> bool:
    """Whether the application itself limits the time of the body: batches do."""
    return path_of(scope).startswith(BATCH_PATH)

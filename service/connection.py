"""A bound around each connection: heads of limited size, in limited time, one request after another.

uvicorn's fast parser takes heads of any size, queues pipelined requests without a limit and waits for ever for the rest
of a head or for a caller who does not read.  This protocol, given to uvicorn as its documented ``http`` parameter,
stands between the socket and uvicorn's own: it only counts, holds back and closes.  It knows when a request begins,
wants its body and ends from the application's side, by an ASGI middleware (:class:`Bounded`) that finds the connection
in the scope's state.
"""

import asyncio
from typing import Any

from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.auto import AutoHTTPProtocol

from .guard import BATCH_PATH, path_of

__all__ = ["Bounded", "Connection"]

MAX_HEAD = 64 * 1024  # bytes of a request's head
_SLICE = 16 * 1024  # bytes that are handed on at a time between requests: so few pipelined ones are parsed at once
_SETTLE_S = 0.005
_AHEAD = 256 * 1024  # bytes that are held back before the socket is no longer read
_TOO_LARGE = (
    b"HTTP/1.1 431 Request Header Fields Too Large\r\ncontent-type: text/plain\r\ncontent-length: 0\r\n"
    b"connection: close\r\n\r\n"
)


class _Transport:
    """What uvicorn sees of the socket: it cannot go on reading while too much is held back."""

    def __init__(self, transport: Any, connection: "Connection") -> None:
        self._transport = transport
        self._connection = connection

    def resume_reading(self) -> None:
        if not self._connection.full:
            self._transport.resume_reading()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)


class Connection(asyncio.Protocol):
    """One connection; ``timeout_s`` is set by the application for all."""

    timeout_s = 30.0

    def __init__(self, config: Any, server_state: Any, app_state: dict[str, Any], _loop: Any = None) -> None:
        state = {**app_state, "connection": self}
        made: Any = AutoHTTPProtocol
        self._inner = made(config=config, server_state=server_state, app_state=state, _loop=_loop)
        self._loop = asyncio.get_event_loop()
        self._transport: Any = None
        self._held = bytearray()
        self._head = b""  # the end of what came of a head that is not complete
        self._head_size = 0
        self._open = 0  # requests that the application is answering
        self._due = 0  # ends of heads that were handed on, less requests that have begun
        self._begun = 0
        self._settling = False  # whether a request has just ended
        self._wanting = False  # whether it waits for a body
        self._closing = False
        self._stalled = False  # whether the caller does not read
        self._clock: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin."""
        self._transport = transport
        seen: Any = _Transport(transport, self)
        self._inner.connection_made(seen)
        self._watch()

    def connection_lost(self, exc: Exception | None) -> None:
        """End."""
        self._unwatch()
        self._closing = True
        self._held.clear()
        self._inner.connection_lost(exc)

    def eof_received(self) -> Any:
        """Hand on."""
        return self._inner.eof_received()

    def pause_writing(self) -> None:
        """Give the caller some time to read."""
        self._stalled = True
        self._watch()
        self._inner.pause_writing()

    def resume_writing(self) -> None:
        """The caller reads."""
        self._stalled = False
        self._unwatch()
        self._inner.resume_writing()

    @property
    def full(self) -> bool:
        """Whether as much is held back as may be."""
        return len(self._held) > _AHEAD

    @property
    def _is_free(self) -> bool:
        return self._open == 0 and self._due == 0 and not self._settling

    def data_received(self, data: bytes) -> None:
        """Hand on what belongs to the request that is being answered, or begins one; hold back the rest."""
        if self._closing:
            return
        if self._is_free and not self._held and len(data) <= _SLICE:
            self._hand_on(data)
        elif self._wanting and not self._held:
            self._inner.data_received(data)
        else:
            self._held += data
            self._feed()
            if self.full:
                self._transport.pause_reading()

    def _feed(self) -> None:
        """Hand on what was held back, as far as somebody wants it."""
        while self._held and not self._closing and (self._wanting or self._is_free):
            size = _AHEAD if self._open else _SLICE
            piece = bytes(self._held[:size])
            del self._held[:size]
            if self._open:
                self._inner.data_received(piece)
                continue
            self._hand_on(piece)
            if self._held and self._due == 0:
                continue
            break
        if not self.full and self._transport is not None and not self._closing:
            self._transport.resume_reading()

    def _hand_on(self, data: bytes) -> None:
        """Hand on the beginning of a request, or the next piece of it."""
        seen = self._head + data
        end = seen.rfind(b"\r\n\r\n")
        if end >= 0:
            self._due += seen.count(b"\r\n\r\n")
            self._head_size = 0
            self._head = b""  # a body may follow: what is in it counts as a head only until the application begins
        else:
            self._head_size += len(data)
            self._head = seen[-3:]
            if self._clock is None:
                self._watch()
            if self._head_size > MAX_HEAD:
                self._closing = True
                self._transport.write(_TOO_LARGE)
                self._transport.close()
                return
        self._inner.data_received(data)

    def begin(self) -> None:
        """The application begins to answer a request."""
        self._open += 1
        self._begun += 1
        self._due = max(self._due - 1, 0)
        self._head_size, self._head = 0, b""
        self._unwatch()

    def want(self, wanting: bool, timed: bool) -> None:
        """The application waits for a body, or no longer; ``timed``: all of it has to come within the limit."""
        self._wanting = wanting
        if timed and self._clock is None:
            self._watch()
        if wanting and self._held:
            self._feed()

    def end(self) -> None:
        """The application has answered."""
        self._open -= 1
        self._wanting = False
        if not self._stalled:
            self._unwatch()
        if self._due:
            # What looked like the end of a head was in a body, or another request is about to begin.
            self._loop.call_later(_SETTLE_S, self._settle, self._begun)
        else:
            # A request that was parsed already begins before this: what comes until then may be its body.
            self._settling = True
            self._loop.call_soon(self._settled)

    def _settled(self) -> None:
        self._settling = False
        self._feed()

    def _settle(self, begun: int) -> None:
        if self._open == 0 and self._begun == begun:
            self._due = 0
            self._feed()

    def _watch(self) -> None:
        self._unwatch()
        self._clock = self._loop.call_later(self.timeout_s, self._give_up)

    def _unwatch(self) -> None:
        if self._clock is not None:
            self._clock.cancel()
            self._clock = None

    def _give_up(self) -> None:
        self._closing = True
        self._transport.abort()


class Bounded:
    """Middleware: tells a :class:`Connection` what the application is doing; under other servers it does nothing."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run one request."""
        connection = scope["state"].get("connection") if scope["type"] == "http" and "state" in scope else None
        if not isinstance(connection, Connection):
            await self.app(scope, receive, send)
            return

        timed = scope["method"] == "POST" and not path_of(scope).startswith(BATCH_PATH)  # batches watch the time

        async def wanted() -> Message:
            connection.want(True, timed)
            try:
                return await receive()
            finally:
                connection.want(False, False)

        connection.begin()
        try:
            await self.app(scope, wanted, send)
        finally:
            connection.end()

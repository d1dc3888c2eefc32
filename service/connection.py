"""The server's side of a connection: the shortest way to an answer, and an end for callers who stand still.

Under any other ASGI server the service does the same without these two: answers take a little longer, and standing
callers are that server's business.
"""

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any
from weakref import WeakSet

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from service.middleware import BATCH_PATH
from service.wire import CASE_PATH, Application, ShortWay

__all__ = ["FILL", "PIECES", "Connection", "sweep"]

#: extension of the protocol: puts the rest of a body where the application wants it, see Connection.fill
FILL = "mumacro.fill"
#: extension of the protocol: hands on the pieces of a body as they came, see Connection.pieces
PIECES = "mumacro.pieces"

_AHEAD = 256 * 1024  # bytes that are read while the application is busy with what came before
_EVERY_S = 1.0
_SHORT = frozenset({CASE_PATH, BATCH_PATH})  # where the short way leads
_TURN = 512 * 1024  # bytes of a body that are taken before others get their turn
_open: "WeakSet[Connection]" = WeakSet()


class Connection(HttpToolsProtocol):
    """A connection that answers one good case as soon as it has come in, and else starts the application.

    It knows since when its caller owes a move: the server ends idle connections, but would wait for ever for the rest
    of a request, and for a caller who does not read.  A sweep once a second costs a request nothing.
    """

    paused_since = 0.0
    owed_since = 0.0
    owed: object = None
    _short: ShortWay | None = None
    _filling: "_Filling | None" = None
    _stream: "_Stream | None" = None
    _taken = 0
    _held: tuple[Any, Any] | None = None
    _date: tuple[Any, bytes] = (None, b"")

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        app: Any = self.app
        while app is not None and not isinstance(app, Application):  # what the server wraps around it
            app = getattr(app, "app", None)
        if app is not None and not self.root_path:
            self._short = app.short

    def _start_asgi_task(self, cycle: Any, app: Any) -> None:
        """Start the application, unless the rest of a short request is worth waiting for."""
        scope = cycle.scope
        if scope["path"] == BATCH_PATH:
            scope["extensions"] = {FILL: partial(self.fill, cycle), PIECES: partial(self.pieces, cycle)}
        if self._short is not None and scope["path"] in _SHORT and cycle is self.cycle and app is self.app:
            headers = dict(scope["headers"])
            if (
                self._short.is_short(scope, headers)
                and cycle.more_body
                and cycle.keep_alive
                and not cycle.waiting_for_100_continue
                and b"x-forwarded-for" not in headers
            ):
                self._held = cycle, headers
                return
        super()._start_asgi_task(cycle, app)

    async def fill(self, cycle: Any, room: memoryview, start: int, note: Callable[[int], None]) -> bool:
        """Put the rest of the body into ``room``, from ``start`` on; False if the caller leaves before all is there.

        ``note`` is told of the bytes as they come.

        Raises
        ------
        ValueError
            There is more than room.
        """
        filling = _Filling(cycle, room, start, note, asyncio.get_running_loop().create_future())
        filling.put(cycle.body)
        cycle.body = bytearray()
        if cycle.disconnected or not cycle.more_body:
            return not cycle.disconnected
        self._filling = filling
        self.flow.resume_reading()
        try:
            return await filling.done
        finally:
            self._filling = None

    async def pieces(self, cycle: Any) -> tuple[list[bytes], bool] | None:
        """The pieces of the body that have come since the last call, and whether there may be more.

        None if the caller has left.
        """
        stream = self._stream
        if stream is None or stream.cycle is not cycle:
            stream = self._stream = _Stream(cycle, [bytes(cycle.body)] if cycle.body else [])
            cycle.body = bytearray()
        while not stream.pieces and cycle.more_body and not cycle.disconnected:
            cycle.message_event.clear()
            self.flow.resume_reading()
            await cycle.message_event.wait()
        pieces, stream.pieces, stream.size = stream.pieces, [], 0
        return None if cycle.disconnected else (pieces, cycle.more_body)

    def on_body(self, body: bytes) -> None:
        """Put a piece where it belongs."""
        filling, stream = self._filling, self._stream
        if filling is not None and filling.cycle is self.cycle:
            filling.put(body)
            self._taken += len(body)
            if self._taken >= _TURN:
                # The loop would read on while there is more: megabytes, for which all others would wait.
                self._taken = 0
                self.transport.pause_reading()
                self.loop.call_soon(self._read_on)
        elif stream is not None and stream.cycle is self.cycle and not stream.cycle.response_complete:
            stream.pieces.append(body)
            stream.size += len(body)
            if stream.size > _AHEAD:
                self.flow.pause_reading()
            stream.cycle.message_event.set()
        else:
            super().on_body(body)

    def _read_on(self) -> None:
        if not (self.flow.read_paused or self.transport.is_closing()):
            self.transport.resume_reading()

    def on_message_complete(self) -> None:
        """Answer what was held back, or start the application after all."""
        super().on_message_complete()
        if self._filling is not None and self._filling.cycle is self.cycle:
            self._filling.end(whole=True)
        if self._held is not None:
            (cycle, headers), self._held = self._held, None
            if cycle.disconnected or not self._reply(cycle, headers):
                super()._start_asgi_task(cycle, self.app)

    def _reply(self, cycle: Any, headers: dict[bytes, bytes]) -> bool:
        short = self._short
        if short is None or not cycle.keep_alive or self.flow.write_paused:
            return False
        started = time.perf_counter()
        try:
            reply = short.reply(cycle.scope, headers, bytes(cycle.body))
        except Exception:
            return False  # the application will meet it again, and log it
        if reply is None:
            return False
        identity, etag, content = reply
        self.transport.write(b"".join((self._status_line(), short.head(identity, etag, len(content)), content)))
        cycle.response_started = cycle.response_complete = True
        cycle.message_event.set()
        cycle.on_response()
        cycle.on_response = _nothing
        short.finish(cycle.scope, identity, time.perf_counter() - started)
        return True

    def _status_line(self) -> bytes:
        """The status line and the server's own fields; those change once a second."""
        fields = self.server_state.default_headers
        known, text = Connection._date
        if known is not fields:
            text = b"HTTP/1.1 200 OK\r\n" + b"".join(b"%b: %b\r\n" % field for field in fields)
            Connection._date = fields, text
        return text

    def connection_made(self, transport: Any) -> None:
        """Join those that are swept."""
        super().connection_made(transport)
        _open.add(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """Leave them."""
        _open.discard(self)
        super().connection_lost(exc)
        if self._filling is not None:
            self._filling.end(whole=False)

    def pause_writing(self) -> None:
        """Note since when the caller does not read."""
        self.paused_since = time.monotonic()
        super().pause_writing()

    def stands_still(self, now: float, limit_s: float) -> bool:
        """Whether the caller has owed a move for longer than the limit: reading, or the rest of a request."""
        if self.flow.write_paused:
            return now - self.paused_since > limit_s
        cycle = self.cycle
        answered = cycle is None or cycle.response_complete
        between_two = answered and self.timeout_keep_alive_task is not None  # the server's own clock runs
        # All is here, or the answer has begun: the move is ours, or a stream watches its own clock.
        ours = not answered and (not cycle.more_body or cycle.response_started)
        if between_two or ours:
            self.owed = None
            return False
        owed = id(cycle), answered
        if self.owed != owed:
            self.owed, self.owed_since = owed, now
        return now - self.owed_since > limit_s


@dataclass
class _Filling:
    """A body on its way into the application's memory."""

    cycle: Any
    room: memoryview
    end_of_text: int
    note: Callable[[int], None]
    done: "asyncio.Future[bool]"

    def put(self, piece: bytes | bytearray) -> None:
        end = self.end_of_text + len(piece)
        self.room[self.end_of_text : end] = piece
        self.end_of_text = end
        self.note(len(piece))

    def end(self, whole: bool) -> None:
        if not self.done.done():
            self.done.set_result(whole)


@dataclass
class _Stream:
    """A body whose pieces are handed on as they came."""

    cycle: Any
    pieces: list[bytes]
    size: int = 0


def _nothing() -> None:
    pass


async def sweep(limit_s: float) -> None:
    """Cut, for ever, what stands still."""
    while True:
        await asyncio.sleep(_EVERY_S)
        now = time.monotonic()
        for connection in list(_open):
            # Also one that is closing: it would wait for its caller to read the rest.
            if connection.stands_still(now, limit_s):
                connection.transport.abort()

"""Extend uvicorn's protocol by limits: a time for every wait, the size of the headers, one request
at a time.

uvicorn takes the class by its documented ``http`` parameter.  The class uses parts of
``HttpToolsProtocol`` that are not promised to be stable, so pyproject.toml bounds the version, and
the tests try every limit on a socket.
"""

import math
from collections.abc import Iterator
from itertools import chain
from typing import Any, ClassVar

import httptools
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from .admission import Admission
from .observe import Observer
from .problems import ABORT, FULL, REFUSED, ProblemKind, RequestError, problem_of

MAX_HEAD = 64 * 1024  # largest size of a request's headers, in bytes
MAX_FIELDS = 100  # largest number of headers
_MOST_SHOWN = 200  # bytes that are shown of a path that is refused here
_PIECE = 2048  # bytes of the headers that are read before they are counted
# seconds after the deadline of an answer, which the application itself keeps if it can
_MARGIN_S = 2.0
_LOOK_EVERY_S = 0.25  # seconds between two checks whether the time of a connection is over
# how long the answer to a client that has closed its side may take to begin
_CLOSED_SIDE_S = 5.0
# limits of time and bytes for dropping the rest of a body after its answer, and the time without a
# byte after which the client has read the answer
_DROP_S, _DROP, _PAUSE_S = 5.0, 32 * 1024 * 1024, 1.0
_TOO_LARGE = RequestError(
    ProblemKind.HEAD_TOO_LARGE, f"a head may have up to {MAX_FIELDS} fields and {MAX_HEAD} bytes"
)


def _without_upgrade(headers: list[tuple[bytes, bytes]]) -> Iterator[tuple[bytes, bytes]]:
    """Yield the headers that do not ask for another protocol."""
    for name, value in headers:
        if name == b"connection":
            options = (option.strip() for option in value.split(b","))
            yield name, b", ".join(one for one in options if one.lower() != b"upgrade")
        elif name != b"upgrade":
            yield name, value


class _Transport:
    """Send the headers of an answer together with the data that follow immediately: one packet, not
    two."""

    def __init__(self, transport: Any, connection: "Connection") -> None:
        self._transport, self._connection, self._pending = transport, connection, b""
        self.is_closing = transport.is_closing

    def write(self, data: bytes) -> None:
        """Keep the first piece until the next one, or until the loop continues."""
        if not self._pending:
            self._connection.loop.call_soon(self.flush)
            self._pending = data
        else:
            self.flush(data)

    def flush(self, data: bytes = b"") -> None:
        """Send what is pending, and this, unless the client has left."""
        head, self._pending = self._pending, b""
        if head and not self.is_closing():
            self._transport.write(head + data)

    def close(self) -> None:
        """Close when everything is sent.  If the rest of a body is still to come, close this side
        only: a client that is reset while it sends may lose the answer."""
        self.flush()
        if self._connection.drops():
            self._transport.write_eof()
        else:
            self._transport.close()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)


class Connection(HttpToolsProtocol):
    """Serve one connection.  Close it if the client is silent, is slow to send or to read, or sends
    headers that are too large.

    A request to upgrade the connection to another protocol is answered as if it did not ask for it
    (RFC 9110, 7.8).  A second request that arrives before the first is answered is dropped, and the
    connection closes after the answer.  The rest of a body that was answered before it was complete
    is dropped for a while.  If all connections are open, a new one replaces the one that has waited
    longest for a request.
    """

    #: connections without a request; the one that has waited longest is the first
    waiting: ClassVar[dict["Connection", None]] = {}
    # times by which the client must have moved, and the answer must be complete
    _due = _end = math.inf
    _bytes = 0  # bytes since the last answer
    _in_head = _second = _drops = False
    _refusal: RequestError | None = None

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._settings = self.app_state["settings"]
        self._observer: Observer = self.app_state["observer"]
        self._admission: Admission = self.app_state["admission"]
        self.headers, self.url = [], b""
        self._begun = self.loop.time()

    @property
    def _busy(self) -> bool:
        return self.cycle is not None and not self.cycle.response_complete

    def _watch(self) -> None:
        self._due = min(self._due, self.loop.time() + self._settings.client_timeout_s)

    def _look(self) -> None:
        """End the connection if its time is over; answer 408 if a request has begun and its answer
        has not."""
        now = self.loop.time()
        if now > self._due and (self._in_head or self._busy) and now <= self._end:
            self._refuse(
                RequestError(
                    ProblemKind.SLOW_CLIENT,
                    f"a client may take up to {self._settings.client_timeout_s} s",
                )
            )
        elif now > min(self._due, self._end):
            self.transport.abort()
        if self in self.connections:
            self.loop.call_later(_LOOK_EVERY_S, self._look)

    def _refuse(self, error: RequestError) -> None:
        """Answer instead of the application (unless it has begun its answer), and close."""
        if self._busy and self.cycle.response_started:
            self.abort()
        elif not self.transport.is_closing():
            problem = self._refused(error.kind.status)
            answer, marks = problem_of(error, problem), self._observer.name(problem)
            fields = b"".join(b"%b: %b\r\n" % field for field in (*answer.raw_headers, *marks))
            start = b"HTTP/1.1 %d %b" % (error.kind.status, error.kind.title.encode())
            self.transport.write(b"%b\r\n%b\r\n%b" % (start, fields, bytes(answer.body)))
            self.transport.close()

    def _refused(self, status: int) -> Any:
        """Return the scope of a request that is refused here.  The observer records it, now or when
        the application has ended."""
        if self._busy:
            busy: Any = self.scope
            self._observer.name(busy)
            busy["state"][REFUSED] = status
            return busy
        if not self._in_head:  # no part of a request has arrived
            super().on_message_begin()
        method = self.parser.get_method().decode("ascii") if self.url else ""
        path = self.url.partition(b"?")[0][:_MOST_SHOWN].decode("latin-1")
        scope: Any = {**self.scope, "path": path, "method": method}
        self._observer.name(scope)
        self._observer.record(scope, status, self.loop.time() - self._begun)
        return scope

    def shutdown(self) -> None:
        """Refuse new work; uvicorn calls this for every connection when the server must stop."""
        self._admission.begin_stop()
        super().shutdown()

    def abort(self) -> None:
        """End the connection without the rest of an answer."""
        if self.cycle is not None:
            self.cycle.disconnected = True
        self.transport.abort()

    def drops(self) -> bool:
        """Return whether the rest of a body will be dropped before the connection closes."""
        if self._drops or self._in_head or self._busy or self.cycle is None:
            return False
        self._drops, now = self.cycle.more_body, self.loop.time()
        self.cycle.body.clear()
        self._due, self._end, self._bytes = now + _PAUSE_S, now + _DROP_S, 0
        return self._drops

    def connection_made(self, transport: Any) -> None:
        """Make room, and wait for a request."""
        super().connection_made(transport)
        self.transport: Any = _Transport(transport, self)
        self._admission.connections = self.connections.__len__
        if len(self.connections) > self._settings.max_connections and self.waiting:
            oldest = next(iter(self.waiting))
            del self.waiting[oldest]
            self.connections.discard(oldest)
            oldest.transport.abort()
        self.waiting[self] = None
        self._watch()
        self._look()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self.waiting.pop(self, None)
        super().connection_lost(exc)

    def eof_received(self) -> bool:  # type: ignore[override]
        """Answer a complete request of a client that has closed its side, if the answer begins
        soon: most clients that close their side have gone."""
        self.transport.flush()
        if not self._busy or self.cycle.more_body:
            return False
        self.cycle.keep_alive = False
        self.loop.call_later(_CLOSED_SIDE_S, self._end_unanswered, self.cycle)
        return True

    def _end_unanswered(self, cycle: Any) -> None:
        """End a request whose answer has not begun; the application sees that the client has
        gone."""
        if not cycle.response_started and not cycle.disconnected:
            cycle.disconnected = True
            cycle.message_event.set()
            self.transport.close()

    def data_received(self, data: bytes) -> None:
        """Read bytes, unless they follow a request that is not answered yet."""
        if self._drops:
            self._due, self._bytes = self.loop.time() + _PAUSE_S, self._bytes + len(data)
            if self._bytes > _DROP:
                self.transport.abort()
            return
        start, whole = 0, memoryview(data)  # whose pieces are no copies
        while start < len(data) and not self._second and not self.transport.is_closing():
            stop = len(data) if self._busy and not self._in_head else start + _PIECE
            piece = whole[start:stop]
            start, self._bytes = stop, self._bytes + len(piece)
            self._feed(piece)
            # also after a body
            if len(self.headers) > MAX_FIELDS or (self._in_head and self._bytes > MAX_HEAD):
                self._refuse(_TOO_LARGE)
        # where the application limits every wait
        in_batch = self._busy and self.scope["path"].endswith("/batch")
        if self._in_head or not self._busy or (self.cycle.more_body and not in_batch):
            self._watch()

    def _feed(self, data: bytes | memoryview) -> None:
        """Read bytes; refuse what the parser, or a limit here, refuses."""
        try:
            self.parser.feed_data(data)
        except httptools.HttpParserError:
            if not self._second:
                fault = RequestError(ProblemKind.MALFORMED_HTTP, "this is no request of HTTP/1.1")
                self._refuse(self._refusal or fault)
        except httptools.HttpParserUpgrade as upgrade:
            if self._upgrades:
                self._read_without_upgrade(bytes(data[upgrade.args[0] :]))

    @property
    def _upgrades(self) -> bool:
        """Return whether the parser takes the data after the headers for another protocol."""
        upgrades: bool = self.parser.should_upgrade()
        return upgrades and self.parser.get_method() != b"CONNECT"

    def _read_without_upgrade(self, rest: bytes) -> None:
        """Read the headers again, without those that ask for an upgrade, and then the body, because
        this parser reads no body after an upgrade."""
        start = b"%b %b HTTP/%b" % (
            self.parser.get_method(),
            self.url,
            self.parser.get_http_version().encode(),
        )
        lines = [start, *(b"%b: %b" % field for field in _without_upgrade(self.headers))]
        self.parser = httptools.HttpRequestParser(self)
        self.parser.set_dangerous_leniencies(lenient_data_after_close=True)
        self._feed(b"\r\n".join([*lines, b"", rest]))

    def pause_writing(self) -> None:
        """Give the client its time to read."""
        super().pause_writing()
        self._watch()

    def resume_writing(self) -> None:
        """Continue, since the client has read."""
        super().resume_writing()
        self._due = math.inf

    def on_message_begin(self) -> None:
        """Begin to read headers, if the previous request is answered."""
        if self._busy:
            self._second, self.cycle.keep_alive = True, False
            raise ValueError("a second request")
        self._in_head, self._due, self._begun = True, math.inf, self.loop.time()
        super().on_message_begin()

    def on_headers_complete(self) -> None:
        """Begin a request."""
        large = (
            self._bytes > MAX_HEAD and sum(map(len, (self.url, *chain(*self.headers)))) > MAX_HEAD
        )
        if large or len(self.headers) > MAX_FIELDS:
            self._refusal = _TOO_LARGE
            raise _TOO_LARGE
        if self._upgrades:
            return
        if self.parser.get_http_version() not in ("1.0", "1.1"):
            raise ValueError("a version of HTTP that has no head like this")
        self._in_head, self._due = False, math.inf
        self.waiting.pop(self, None)
        if len(self.connections) > self._settings.max_connections:
            self.scope["state"][FULL] = True
        self.scope["state"][ABORT] = self.abort
        super().on_headers_complete()
        # headers after a body say nothing about the request (RFC 9110, 6.5.1)
        self.headers = []
        self._end = self.loop.time() + self._settings.time_limit_s + _MARGIN_S

    def on_message_complete(self) -> None:
        """Take a request that has arrived completely."""
        if self._in_head:  # the data that follow are read again
            return
        self._due = math.inf
        super().on_message_complete()

    def on_response_complete(self) -> None:
        """Wait for the next request.  This replaces uvicorn's method, which starts its own timer
        for it."""
        self.server_state.total_requests += 1
        if not self.transport.is_closing():
            self.flow.resume_reading()
            if not self._drops:
                self._due, self._end, self._bytes = (
                    self.loop.time() + self._settings.keep_alive_s,
                    math.inf,
                    0,
                )
            self.waiting[self] = None

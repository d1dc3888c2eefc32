"""Connections that are cut when their caller stands still.

The server below ends idle connections, but waits for ever for the rest of a request, and for a caller who does not
read.  A sweep once a second costs a request nothing.
"""

import asyncio
import time
from typing import Any
from weakref import WeakSet

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

__all__ = ["Connection", "sweep"]

_EVERY_S = 1.0
_open: "WeakSet[Connection]" = WeakSet()


class Connection(HttpToolsProtocol):
    """A connection that knows since when its caller owes a move."""

    paused_since = 0.0
    owed_since = 0.0
    owed: object = None

    def connection_made(self, transport: Any) -> None:
        """Join those that are swept."""
        super().connection_made(transport)
        _open.add(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """Leave them."""
        _open.discard(self)
        super().connection_lost(exc)

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


async def sweep(limit_s: float) -> None:
    """Cut, for ever, what stands still."""
    while True:
        await asyncio.sleep(_EVERY_S)
        now = time.monotonic()
        for connection in list(_open):
            # Also one that is closing: it would wait for its caller to read the rest.
            if connection.stands_still(now, limit_s):
                connection.transport.abort()

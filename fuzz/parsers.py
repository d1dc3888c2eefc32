"""The bytes of HTTP/1.1 as this service reads them, beside h11: no request is seen where h11 sees none, or another one.

    python fuzz/parsers.py [--only parsers] [--share 0.05] [--write]

A difference between two readers of one connection lets a client hide a request behind another one (request smuggling).
"""

from __future__ import annotations

import asyncio
import random
import re
import time
from types import SimpleNamespace
from typing import Any

import h11
import reporting
from measuring import markdown

from service.connection import Connection

TRIED = 1_000_000
_POST, _LAST = b"POST /a HTTP/1.1\r\nHost: x\r\n", b"GET /b HTTP/1.1\r\nHost: x\r\n\r\n"
_BODIES = (
    b"Content-Length: 5\r\n\r\nhello", b"Content-Length: 5\r\nContent-Length: 6\r\n\r\nhello",
    b"Content-Length: 5\r\nContent-Length: 5\r\n\r\nhello", b"Content-Length: 5, 6\r\n\r\nhello",
    b"Content-Length: -5\r\n\r\nhello", b"Content-Length: +5\r\n\r\nhello", b"Content-Length: 0x5\r\n\r\nhello",
    b"Content-Length: \r\n\r\nhello", b"Content-Length: 99999999999999999999999\r\n\r\nhello",
    b"Content-Length : 5\r\n\r\nhello", b"Content-Length: 50\r\n\r\nhello",
    b"Transfer-Encoding: chunked\r\nContent-Length: 5\r\n\r\n0\r\n\r\n",
    b"Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
    b"Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
    *(b"Transfer-Encoding:" + coding + b"\r\n\r\n0\r\n\r\n" for coding in (
        b" CHUNKED", b"\tchunked", b" \x0bchunked", b" xchunked", b" identity", b" gzip", b" gzip, chunked",
        b" chunked, gzip",
    )),
    b"Transfer-Encoding : chunked\r\n\r\n0\r\n\r\n",
    *(b"Transfer-Encoding: chunked\r\n\r\n" + chunks for chunks in (
        b"5;a=b\r\nhello\r\n0\r\n\r\n", b"-5\r\nhello\r\n0\r\n\r\n", b"0x5\r\nhello\r\n0\r\n\r\n",
        b"fffffffffffffffff\r\nhello\r\n0\r\n\r\n", b"5\r\nhello0\r\n\r\n", b"5\nhello\n0\n\n", b"zz\r\n\r\n",
        b"5 \r\nhello\r\n0\r\n\r\n", b"5;a\rb\r\nhello\r\n0\r\n\r\n", b"5\r\nhello\r\n0\r\nX-A: b\r\n\r\n",
        b"0\r\nContent-Length: 30\r\n\r\n",
    )),
)  # fmt: skip
_HEADS = (
    b"GET /b HTTP/1.1\nHost: x\n\n", b"GET /b HTTP/1.1\rHost: x\r\r", b"GET /b HTTP/1.1\r\n Host: x\r\n\r\n",
    *(b"GET /b HTTP/1.1\r\nHost: x\r\n" + field + b"\r\n\r\n" for field in (
        b"X-A: b\r\n c", b"X-A: b\0c", b"X-A: b\rc", b"X-A: b\xffc", b"X-A: b\x01c", b"X A: b", b"XA", b": b",
        b"Host: y", b"Connection: close", b"Content-Length: 3",
    )),
    b"GET /b HTTP/1.1\r\n\r\n", b"GET /b\r\n\r\n", b"GET /b HTTP/1.0\r\nConnection: keep-alive\r\n\r\n",
    *(b"GET /b " + version + b"\r\nHost: x\r\n\r\n" for version in (
        b"HTTP/2.0", b"HTTP/1.2", b"HTTP/1.11", b"HTTP/0.9", b"http/1.1",
    )),
    b"GET\t/b HTTP/1.1\r\nHost: x\r\n\r\n", b"GET /b c HTTP/1.1\r\nHost: x\r\n\r\n",
    b"GET /b\xff HTTP/1.1\r\nHost: x\r\n\r\n", b"GET /b\0 HTTP/1.1\r\nHost: x\r\n\r\n",
    b"FOO /b HTTP/1.1\r\nHost: x\r\n\r\n", b"get /b HTTP/1.1\r\nHost: x\r\n\r\n",
    b"POST /a HTTP/1.0\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    b"OPTIONS * HTTP/1.1\r\nHost: x\r\n\r\n", b"GET /b HTTP/1.1\r\nHost",
)  # fmt: skip
#: requests on one connection, good and bad ones
TEXTS = [_POST + body + _LAST for body in _BODIES] + [head + _LAST for head in _HEADS]
_PIECES = [bytes([byte]) for byte in b" \t\r\n\0:;,x05-+/\x0b\x7f\xff"] + [
    b"\r\n", b"chunked", b"Content-Length: 5\r\n", b"Transfer-Encoding: chunked\r\n", b"0\r\n\r\n", b"HTTP/1.1",
    b"Host: x\r\n",
]  # fmt: skip

SAME, EARLIER = "the same requests", "refused earlier here"
LENIENT = "read here in spite of blanks that RFC 9112 lets a server ignore, refused by h11"
OTHER = "a request that h11 does not see"
#: method, target, body
Requests = list[tuple[bytes, bytes, bytes]]


class _Transport(asyncio.Transport):
    """Goes nowhere."""

    def can_write_eof(self) -> bool:
        """Yes."""
        return True

    def _nothing(self, *_: object) -> None:
        """Do nothing."""

    write = write_eof = close = abort = pause_reading = resume_reading = is_closing = _nothing  # type: ignore[assignment]


async def read_here(text: bytes) -> Requests:
    """The requests that an application gets."""
    found: Requests = []

    async def app(scope: Any, receive: Any, send: Any) -> None:
        body, more = b"", True
        while more:
            message = await receive()
            if message["type"] != "http.request":
                return
            body, more = body + message["body"], message["more_body"]
        query = scope["query_string"]
        found.append((scope["method"].encode(), scope["raw_path"] + (b"?" + query if query else b""), body))
        await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"0")]})
        await send({"type": "http.response.body"})

    state: Any = SimpleNamespace(connections=set(), tasks=set(), total_requests=0, default_headers=[])
    config = SimpleNamespace(
        loaded=True, loaded_app=app, asgi_version="3.0", root_path="", timeout_keep_alive=5, limit_concurrency=None
    )
    connection = Connection(config, state, {})
    connection.connection_made(_Transport())
    connection.data_received(text)
    while state.tasks and len(asyncio.all_tasks()) > 1 and not _waits(connection):
        await asyncio.sleep(0.0)
    connection.connection_lost(None)
    await asyncio.gather(*(task for task in asyncio.all_tasks() if task is not asyncio.current_task()))
    return found


def _waits(connection: Connection) -> bool:
    """Whether the application waits for more than was sent."""
    now = connection._now
    return now is not None and now.waiter is not None and not now.waiter.done()


def read_by_h11(text: bytes, *, lenient: bool = False) -> Requests:
    """The requests that h11 reads; ``lenient``: without the blanks that RFC 9112 lets a server ignore."""
    found: Requests = []
    try:
        while True:
            if lenient:  # empty lines before a request (2.2), more than one space in its first line (3)
                line, end, rest = text.lstrip(b"\r\n").partition(b"\n")
                text = re.sub(rb" +", b" ", line) + end + rest
            connection = h11.Connection(h11.SERVER)
            connection.receive_data(text)
            connection.receive_data(b"")
            request, body = connection.next_event(), b""
            if not isinstance(request, h11.Request):
                return found
            while isinstance(event := connection.next_event(), h11.Data):
                body += event.data
            if not isinstance(event, h11.EndOfMessage):
                return found
            found.append((request.method, request.target, body))
            if connection.their_state is h11.MUST_CLOSE:
                return found
            text = connection.trailing_data[0]
    except h11.RemoteProtocolError:
        return found


def changed(text: bytes, chance: random.Random) -> bytes:
    """The text with one to three changes, the start of its lines of requests left alone."""
    for _ in range(chance.randint(1, 3)):
        place, kind = chance.randrange(1, len(text)), chance.random()
        before, after = text[:place], text[place:]
        if kind < 0.5:
            text = before + chance.choice(_PIECES) + after
        elif kind < 0.75:
            text = before + after[chance.randint(1, 4) :]
        else:
            text = before + chance.choice(_PIECES) + after[1:]
    return text


async def compared(text: bytes) -> str:
    """How the two readings of a text compare."""
    here, there = await read_here(text), read_by_h11(text)
    if here == there:
        return SAME
    if here == there[: len(here)]:
        return EARLIER
    return LENIENT if here == read_by_h11(text, lenient=True)[: len(here)] else OTHER


async def compare(count: int, seed: int = 1) -> tuple[dict[str, int], list[bytes]]:
    """How often both agree, and the texts where this service sees a request that h11 does not."""
    chance = random.Random(seed)  # noqa: S311
    counts = dict.fromkeys((SAME, EARLIER, LENIENT, OTHER), 0)
    bad = []
    for index in range(count):
        text = TEXTS[index] if index < len(TEXTS) else changed(chance.choice(TEXTS), chance)
        kind = await compared(text)
        counts[kind] += 1
        if kind == OTHER:
            bad.append(text)
    return counts, bad


def parsers(share: float) -> str:
    """Changed requests, read here and by h11."""
    started = time.perf_counter()
    counts, bad = asyncio.run(compare(max(int(TRIED * share), len(TEXTS))))
    rows = [[name, f"{count:,}"] for name, count in counts.items()]
    text = f"\n\nFAILED: {bad[:3]}" if bad else ""
    table = markdown(("two requests on a connection, changed", "count"), rows)
    return f"{table}{text}\n\n{reporting.took(started, 'h11', 'httptools')}"


SECTIONS = {"parsers": parsers}

if __name__ == "__main__":
    reporting.report(__doc__ or "", SECTIONS)

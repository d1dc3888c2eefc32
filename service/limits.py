"""Limits: API keys, the head and the body of a request, slots for large requests, time.

A request that may take longer than one case needs a slot and runs in a thread.  Batches and streams
share the slots of ``MUMACRO_MAX_BATCHES``; the questions of a person (law, solve-for, the page)
have slots and threads of their own.
"""

import asyncio
import os
import re
import secrets
import sys
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, suppress
from functools import partial
from typing import TypeVar

from starlette.requests import ClientDisconnect
from starlette.types import Receive, Scope

from mumacro.kernel.threads import processors

from .problems import Kind, RequestError
from .settings import Settings

T = TypeVar("T")
SMALL_BODY = 64 * 1024  # bytes of a body that needs no slot
# largest cost without a thread, in times of a plain case: under half a millisecond
AT_ONCE = 4000.0
QUESTIONS = 8  # questions that are answered at the same time
_NICENESS = 5  # that is added to the threads of batches, so that short requests are answered first
# how long, and how many bytes of a refused body are read
_LINGER_S, _LINGER = 5.0, 32 * 1024 * 1024
_PAUSE_S = 0.25  # a client that sends nothing for so long waits for the answer
_OTHER_CHARSET = re.compile(r'charset=(?! *"?(utf-?8|us-ascii|) *"? *(;|$))')
_ONCE = (
    b"host",
    b"x-api-key",
    b"authorization",
    b"content-type",
    b"content-encoding",
    b"transfer-encoding",
    b"x-request-id",
)


def holder_of(headers: Mapping[bytes, bytes], keys: Mapping[str, str]) -> str:
    """The name of the holder of the request's key; ``keys`` are the names by key."""
    offered = headers.get(b"x-api-key")
    if offered is None:
        scheme, _, credentials = headers.get(b"authorization", b"").partition(b" ")
        offered = credentials.strip() if scheme.lower() == b"bearer" else b""
    # compares all keys: the time does not depend on the key sent
    found = [
        name for key, name in keys.items() if secrets.compare_digest(offered, key.encode("ascii"))
    ]
    if not found:
        told = "send the API key as X-API-Key or as Authorization: Bearer"
        raise RequestError(Kind.UNAUTHORIZED, told, headers={"WWW-Authenticate": "Bearer"})
    return found[0]


def check_head(scope: Scope, headers: Mapping[bytes, bytes]) -> None:
    """Refuse a head that says two things, or asks for another protocol, as which its body would be
    read."""
    version = scope["http_version"]
    if version not in ("1.0", "1.1") or (version == "1.1" and b"host" not in headers):
        raise RequestError(Kind.MALFORMED_HTTP, "a request is of HTTP/1.1 and has one Host")
    if headers.get(b"transfer-encoding", b"chunked").lower().strip(b" \t,") != b"chunked":
        raise RequestError(Kind.MALFORMED_HTTP, "the only transfer coding is chunked")
    if len(headers) != len(scope["headers"]):
        names = [name for name, _ in scope["headers"]]
        for name in _ONCE:
            if names.count(name) > 1:
                raise RequestError(
                    Kind.MALFORMED_HTTP, f"the header {name.decode()} is given more than once"
                )
    if b"upgrade" in headers and scope["method"] not in ("GET", "HEAD"):
        raise RequestError(
            Kind.MALFORMED_HTTP, "this service does not upgrade connections: send no Upgrade"
        )


def form_of(headers: Mapping[bytes, bytes], known: Mapping[str, T]) -> T:
    """What is known by the media type of a body; without a Content-Type it is the first."""
    given = headers.get(b"content-type", b"").decode("latin-1").lower() or next(iter(known))
    media, _, parameters = given.partition(";")
    found = known.get(media.strip())
    if found is None or (parameters and _OTHER_CHARSET.search(parameters)):
        offer = ", ".join(known)
        told = f"send {offer}, not {given[:80]}"
        raise RequestError(Kind.UNSUPPORTED_BODY, told, headers={"Accept-Post": offer})
    if headers.get(b"content-encoding", b"identity").lower() != b"identity":
        told = "send the body without Content-Encoding"
        raise RequestError(Kind.UNSUPPORTED_BODY, told, headers={"Accept-Encoding": "identity"})
    return found


async def read_body(
    headers: Mapping[bytes, bytes],
    receive: Receive,
    limit: int,
    large: Callable[[], None] = lambda: None,
) -> bytearray:
    """The body of a request; ``large`` is called before more than SMALL_BODY is read."""
    length = headers.get(b"content-length", b"0").strip()
    size = int(length) if length.isdigit() and len(length) < 19 else limit + 1
    body, more = bytearray(), True
    while True:
        if size > limit:
            told = (
                "send many cases to /v1/mu-macro/batch, more as NDJSON without a "
                "Content-Length, reading while you send"
            )
            raise RequestError(
                Kind.BODY_TOO_LARGE, f"a body may have up to {limit} bytes: {told}", max_bytes=limit
            )
        if size > SMALL_BODY:
            large()
        if not more:
            return body
        message = await receive()
        if message["type"] != "http.request":
            raise ClientDisconnect
        body += message.get("body", b"")
        more = message.get("more_body", False)
        size = len(body)


async def drained(receive: Receive) -> None:
    """Read and drop the rest of a body that is refused, for a while: else many clients see a reset
    and no reason."""
    count, more = 0, True
    with suppress(TimeoutError):
        async with asyncio.timeout(_LINGER_S):
            while more and count < _LINGER:
                message = await asyncio.wait_for(receive(), _PAUSE_S)
                count += len(message.get("body", b""))
                more = message.get("more_body", False)


class Slots:
    """The right to run a large request: so many at the same time, and the threads that run them."""

    def __init__(self, number: int, name: str, niceness: int = 0) -> None:
        self.number, self.used, self._name = number, 0, name
        # where that is of the thread
        stand_back = partial(os.nice, niceness) if sys.platform == "linux" else None
        self.threads = ThreadPoolExecutor(processors(), name, initializer=stand_back)

    def take(self) -> None:
        """Take a slot; the code that called this gives it back."""
        if self.used >= self.number:
            raise RequestError(
                Kind.OVERLOADED, f"{self.used} {self._name} are being answered already"
            )
        self.used += 1

    def give_back(self) -> None:
        """Give a slot back."""
        self.used -= 1


class Work:
    """The slots of one process, and the time limits."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.batches = Slots(settings.max_batches, "batches", _NICENESS)
        self.questions = Slots(QUESTIONS, "questions")

    def close(self) -> None:
        """Let no thread keep the process alive."""
        for slots in (self.batches, self.questions):
            slots.threads.shutdown(wait=False, cancel_futures=True)

    async def question(self, work: Callable[[], T]) -> T:
        """Do the work of a question in a thread; its slot is held until it is done, even without a
        client."""
        self.questions.take()
        loop = asyncio.get_running_loop()
        task = self.questions.threads.submit(work)
        task.add_done_callback(lambda _: loop.call_soon_threadsafe(self.questions.give_back))
        async with within(self.settings.time_limit_s):
            return await asyncio.wrap_future(task)

    async def client(self, move: Awaitable[T]) -> T:
        """Wait for the client to send or to read."""
        async with within(self.settings.client_timeout_s, Kind.SLOW_CLIENT):
            return await move


@asynccontextmanager
async def within(limit: int, late: Kind = Kind.TOOK_TOO_LONG) -> AsyncIterator[None]:
    """A time limit: of a whole answer, its reading, computing and sending, or of a client's next
    move."""
    try:
        async with asyncio.timeout(limit):
            yield
    except TimeoutError:
        raise RequestError(late, f"this may take up to {limit} s") from None

"""Limits: API keys, the head and the body of a request, slots for large requests, time.

A request that may take longer than one case needs a slot and runs in a thread.  Batches and streams share the slots of
``MUMACRO_MAX_BATCHES``; the questions of a person (law, solve-for, the page) have slots and threads of their own.
"""

import asyncio
import os
import secrets
import sys
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, suppress
from typing import TypeVar

from starlette.requests import ClientDisconnect
from starlette.types import Receive, Scope

from mumacro.processors import processors

from .problems import CLOSE, Kind, RequestError
from .settings import Settings

__all__ = ["AT_ONCE", "SMALL_BODY", "Keys", "Slots", "Work", "check_head", "drained", "media_type_of", "read_body"]

T = TypeVar("T")
SMALL_BODY = 64 * 1024  # bytes of a body that needs no slot
AT_ONCE = 4000.0  # largest cost without a thread, in times of a plain case: under half a millisecond
QUESTIONS = 8  # questions that are answered at the same time
_NICENESS = 5  # that is added to the threads of batches, so that short requests are answered first
_LINGER_S, _LINGER = 5.0, 32 * 1024 * 1024  # how long, and how many bytes of a refused body are read
_PAUSE_S = 0.25  # a client that sends nothing for so long waits for the answer
_ONCE = (b"x-api-key", b"authorization", b"content-type", b"content-encoding", b"x-request-id")


class Keys:
    """API keys and the names of their holders, by key; with none, the service is open to all."""

    def __init__(self, keys: Mapping[str, str]) -> None:
        self._keys = [(key.encode("ascii"), name) for key, name in keys.items()]

    def __bool__(self) -> bool:
        return bool(self._keys)

    def holder(self, headers: Mapping[bytes, bytes]) -> str:
        """The name of the holder of the request's key."""
        offered = headers.get(b"x-api-key")
        if offered is None:
            scheme, _, credentials = headers.get(b"authorization", b"").partition(b" ")
            offered = credentials.strip() if scheme.lower() == b"bearer" else b""
        found = None
        for key, name in self._keys:  # compares all keys: the time does not depend on the key sent
            if secrets.compare_digest(offered, key):
                found = name
        if found is None:
            fields = {"WWW-Authenticate": "Bearer", **CLOSE}
            told = "send the API key as X-API-Key or as Authorization: Bearer"
            raise RequestError(Kind.UNAUTHORIZED, told, headers=fields)
        return found


def check_head(scope: Scope, headers: Mapping[bytes, bytes]) -> None:
    """Refuse a head that says two things, or asks for another protocol."""
    if len(headers) != len(scope["headers"]):
        names = [name for name, _ in scope["headers"]]
        for name in _ONCE:
            if names.count(name) > 1:
                told = f"the header {name.decode()} is given more than once"
                raise RequestError(Kind.MALFORMED_BODY, told, headers=CLOSE)
    if b"upgrade" in headers and scope["method"] not in ("GET", "HEAD"):
        # the body would be read as another protocol
        told = "this service does not upgrade connections: send no Upgrade"
        raise RequestError(Kind.MALFORMED_BODY, told, headers=CLOSE)


def media_type_of(headers: Mapping[bytes, bytes], known: Mapping[str, str]) -> str:
    """The media type of a body, out of the known ones (alias -> type); without a Content-Type it is the first."""
    given = headers.get(b"content-type", b"").decode("latin-1")
    media, _, parameters = given.lower().partition(";")
    found = known.get(media.strip()) if given else next(iter(known.values()))
    charset = parameters.partition("charset=")[2].partition(";")[0].strip('" ')
    if found is None or charset not in ("", "utf-8", "utf8", "us-ascii"):
        offer = ", ".join(dict.fromkeys(known.values()))
        fields = {"Accept-Post": offer, **CLOSE}
        raise RequestError(Kind.UNSUPPORTED_BODY, f"send {offer}, not {given[:80]}", headers=fields)
    if headers.get(b"content-encoding", b"identity").lower() != b"identity":
        fields = {"Accept-Encoding": "identity", **CLOSE}
        raise RequestError(Kind.UNSUPPORTED_BODY, "send the body without Content-Encoding", headers=fields)
    return found


async def read_body(
    headers: Mapping[bytes, bytes], receive: Receive, limit: int, large: Callable[[], None] = lambda: None
) -> bytearray:
    """The body of a request; ``large`` is called before more than SMALL_BODY is read."""
    length = headers.get(b"content-length", b"0")
    if not length.isdigit() or len(length) > 18 or int(length) > limit:
        raise _too_large(limit)
    if int(length) > SMALL_BODY:
        large()
    body, more = bytearray(), True
    while more:
        message = await receive()
        if message["type"] != "http.request":
            raise ClientDisconnect
        body += message.get("body", b"")
        more = message.get("more_body", False)
        if len(body) > limit:
            raise _too_large(limit)
        if len(body) > SMALL_BODY:
            large()
    return body


def _too_large(limit: int) -> RequestError:
    told = (
        f"the body may have up to {limit} bytes: send many cases to /v1/mu-macro/batch, as NDJSON without a "
        "Content-Length if they are more, and read the answer while you send"
    )
    # The rest of the body is not used: without "close" the server would read all of it.
    return RequestError(Kind.BODY_TOO_LARGE, told, headers=CLOSE, max_bytes=limit)


async def drained(receive: Receive) -> None:
    """Read and drop the rest of a body that is refused, for a while: else many clients see a reset and no reason."""
    until, count, more = asyncio.get_running_loop().time() + _LINGER_S, 0, True
    with suppress(TimeoutError):
        while more and count < _LINGER:
            async with asyncio.timeout(min(_PAUSE_S, until - asyncio.get_running_loop().time())):
                message = await receive()
            count += len(message.get("body", b""))
            more = message.get("more_body", False)


def _stand_back() -> None:
    """Lower the priority of this thread.  Linux only."""
    if sys.platform == "linux":
        with suppress(OSError):
            thread = threading.get_native_id()
            own = os.getpriority(os.PRIO_PROCESS, thread)
            os.setpriority(os.PRIO_PROCESS, thread, min(19, own + _NICENESS))


class Slots:
    """The right to run a large request: so many at the same time, and the threads that run them."""

    def __init__(self, number: int, threads: int, name: str, behind: bool) -> None:
        self.number = number
        self.used = 0
        self.threads = ThreadPoolExecutor(threads, name, initializer=_stand_back if behind else None)
        self._name = name

    def take(self) -> None:
        """Take a slot; the code that called this gives it back."""
        if self.used >= self.number:
            raise RequestError(Kind.OVERLOADED, f"{self.used} {self._name} are being answered already", headers=CLOSE)
        self.used += 1

    def give_back(self) -> None:
        """Give a slot back."""
        self.used -= 1

    async def run(self, work: Callable[[], T], cost: float = float("inf")) -> T:
        """Do the work at once if it is small, else in a thread, so that it delays no other request."""
        if cost <= AT_ONCE:
            return work()
        return await asyncio.get_running_loop().run_in_executor(self.threads, work)


class Work:
    """The slots of one process, and the time limits."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        count = processors()
        self.batches = Slots(settings.max_batches, count, "batches", behind=True)
        self.questions = Slots(QUESTIONS, count, "questions", behind=False)

    def close(self) -> None:
        """Let no thread keep the process alive."""
        for slots in (self.batches, self.questions):
            slots.threads.shutdown(wait=False, cancel_futures=True)

    @asynccontextmanager
    async def deadline(self) -> AsyncIterator[None]:
        """One time limit for a whole answer: reading, computing and sending."""
        limit = self.settings.time_limit_s
        try:
            async with asyncio.timeout(limit):
                yield
        except TimeoutError:
            raise RequestError(Kind.TOOK_TOO_LONG, f"a request may take up to {limit} s", headers=CLOSE) from None

    async def question(self, work: Callable[[], T]) -> T:
        """Do the work of a question in a thread; its slot is held until it is done, even without a client."""
        self.questions.take()
        task = asyncio.ensure_future(self.questions.run(work))

        def done(task: "asyncio.Future[T]") -> None:
            self.questions.give_back()
            if not task.cancelled():
                task.exception()

        task.add_done_callback(done)
        async with self.deadline():
            return await asyncio.shield(task)

    async def client(self, move: Awaitable[T]) -> T:
        """Wait for the client to send or to read."""
        limit = self.settings.client_timeout_s
        try:
            async with asyncio.timeout(limit):
                return await move
        except TimeoutError:
            raise RequestError(Kind.SLOW_CLIENT, f"a client may take up to {limit} s", headers=CLOSE) from None

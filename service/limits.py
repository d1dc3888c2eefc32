"""Limits: the body of a request, slots for large requests, time.

A request that may take longer than one case needs a slot and runs in a thread.  Batches
share the slots of ``MUMACRO_MAX_BATCHES``; the questions of a person (law, solve-for, the page)
have slots and threads of their own, and so have questions that may take longer than a person waits.

A *cost*, here and in the models and routers, is the time of a computation divided by the time of
mu_macro of one spring that is shaken across, one case of a long column.
"""

import asyncio
import os
import sys
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from functools import partial
from typing import Annotated, TypeVar

from fastapi import Depends, Request
from starlette.requests import ClientDisconnect
from starlette.types import Receive, Scope

from mumacro.kernel.threads import processors

from .admission import Ticket
from .problems import ABORT, ProblemKind, RequestError
from .settings import Settings

T = TypeVar("T")
JSON = b"application/json"
SMALL_BODY = 64 * 1024  # bytes; a larger body needs a slot
# the largest cost that is computed without a thread: under half a millisecond
AT_ONCE = 4000.0
QUESTIONS = 8  # questions that are answered at the same time
# the same of questions that take longer, such as the motion of a ball: up to seconds each
LONG_QUESTIONS = 4
#: largest cost of a question that is not long: about 50 ms
LONG = 100.0 * AT_ONCE
# added to the niceness of the threads of batches and long questions, so that short requests are
# answered first
_NICENESS = 5
_CHARSETS = ("utf-8", "utf8", "us-ascii", "")  # US-ASCII is a part of UTF-8


def only_json(headers: Mapping[bytes, bytes], remedy: str = "") -> None:
    """Refuse a body that is not JSON in UTF-8, or is compressed; no Content-Type says JSON."""
    media_type = headers.get(b"content-type", JSON).lower()
    media, _, parameters = media_type.decode("latin-1").partition(";")
    if media.strip().encode() != JSON or not _is_utf8(parameters):
        text = media_type[:80].decode("latin-1")
        detail = f"send {JSON.decode()}, not {text}{remedy and f'; {remedy}'}"
        raise RequestError(
            ProblemKind.UNSUPPORTED_BODY, detail, headers={"Accept-Post": JSON.decode()}
        )
    if headers.get(b"content-encoding", b"identity").lower() != b"identity":
        detail = "send the body without Content-Encoding"
        raise RequestError(
            ProblemKind.UNSUPPORTED_BODY, detail, headers={"Accept-Encoding": "identity"}
        )


def _is_utf8(parameters: str) -> bool:
    """Whether the parameters of a media type name no other character set.

    >>> _is_utf8('version=1; charset="UTF-8"'.lower()), _is_utf8("charset=latin-1")
    (True, False)
    """
    pairs = (parameter.partition("=") for parameter in parameters.split(";"))
    return all(
        value.strip(' \t"') in _CHARSETS for name, _, value in pairs if name.strip() == "charset"
    )


_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


async def read_body(
    headers: Mapping[bytes, bytes],
    receive: Receive,
    limit: int,
    ticket: Ticket,
    large: Callable[[], None] = lambda: None,
) -> bytearray:
    """The body of a request, which its ``ticket`` holds; ``large`` is called before more than
    SMALL_BODY is read."""
    length = headers.get(b"content-length", b"0").strip()
    size = int(length) if length.isdigit() and len(length) < 19 else limit + 1
    body, more = bytearray(), True
    while True:
        if size > limit:
            remedy = (
                "send many cases to /v1/mu-macro/batch, more in several requests, or give "
                "`mumacro eval` a file"
            )
            raise RequestError(
                ProblemKind.BODY_TOO_LARGE,
                f"a body may have up to {limit} bytes: {remedy}",
                max_bytes=limit,
            )
        ticket.weigh(size)
        if size > SMALL_BODY:
            large()
        if not more:
            return body.removeprefix(_BYTE_ORDER_MARK)  # RFC 8259, 8.1
        message = await receive()
        if message["type"] != "http.request":
            raise ClientDisconnect
        body += message.get("body", b"")
        more = message.get("more_body", False)
        size = len(body)
        ticket.hold(size)


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
                ProblemKind.OVERLOADED, f"{self.used} {self._name} are being answered already"
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
        self.long_questions = Slots(LONG_QUESTIONS, "long questions", _NICENESS)

    def close(self) -> None:
        """Let no thread keep the process alive."""
        for slots in (self.batches, self.questions, self.long_questions):
            slots.threads.shutdown(wait=False, cancel_futures=True)

    async def question(self, work: Callable[[], T], cost: float = 0.0) -> T:
        """Do the work of a question of this cost in a thread; its slot is held until it is done,
        even without a client."""
        slots = self.long_questions if cost > LONG else self.questions
        slots.take()
        loop = asyncio.get_running_loop()
        try:
            task = slots.threads.submit(work)
        except BaseException:  # such as RuntimeError: no thread can start
            slots.give_back()
            raise
        task.add_done_callback(lambda _: loop.call_soon_threadsafe(slots.give_back))
        async with within(self.settings.time_limit_s):
            return await asyncio.wrap_future(task)

    async def small_body(self, reading: Awaitable[bytearray], scope: Scope) -> bytearray:
        """Wait for a small body.

        Our own server limits this wait (server.py); a timer beside that takes a tenth of the time
        of one case.
        """
        return await (reading if ABORT in scope.get("state", ()) else self.client(reading))

    async def client(self, move: Awaitable[T]) -> T:
        """Wait for the client to send or to read."""
        limit = self.settings.client_timeout_s
        try:
            async with asyncio.timeout(limit):
                return await move
        except TimeoutError:
            raise _late(ProblemKind.SLOW_CLIENT, limit) from None


async def _work(request: Request) -> Work:
    work: Work = request.app.state.work
    return work


#: the slots and threads of the application, for endpoints
Working = Annotated[Work, Depends(_work)]


@asynccontextmanager
async def within(limit: int) -> AsyncIterator[None]:
    """A time limit of a whole answer: its reading, computing and sending."""
    try:
        async with asyncio.timeout(limit):
            yield
    except TimeoutError:
        raise _late(ProblemKind.TOOK_TOO_LONG, limit) from None


def _late(kind: ProblemKind, limit: int) -> RequestError:
    return RequestError(kind, f"this may take up to {limit} s")

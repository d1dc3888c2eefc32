"""Limits that hold before a request is evaluated: API key, headers, body size, slots for large requests, time.

The body of a single case has up to 64 KiB.  Large bodies and streams need a slot; the number of slots is a setting.
The estimated computing time decides whether a request needs a slot and a thread.  Every wait for the client has a time
limit.
"""

import asyncio
import secrets
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from typing import TypeVar

from starlette.datastructures import Headers
from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from mumacro.errors import MumacroError

from .errors import (
    BodyTooLargeError,
    MalformedBodyError,
    OverloadedError,
    SlowClientError,
    TookTooLongError,
    UnauthorizedError,
    UnsupportedBodyError,
    problem_of,
)
from .settings import Settings

__all__ = ["BATCH_PATH", "CASE_PATH", "CLOSE", "SMALL_BODY", "Guard", "Keys", "Work", "check_media_type", "path_of"]

T = TypeVar("T")

CASE_PATH = "/v1/mu-macro"
BATCH_PATH = "/v1/mu-macro/batch"
SMALL_BODY = 64 * 1024  # bytes of a body that needs no slot
AT_ONCE = 4000.0  # largest cost without a thread, in times of a plain case: under half a millisecond
#: header of a response that is sent before the whole request was read
CLOSE = {"Connection": "close"}
_ONCE = (b"x-api-key", b"authorization", b"content-type", b"content-encoding", b"if-none-match", b"x-request-id")


def path_of(scope: Scope) -> str:
    """The path within this application: without the prefix of a proxy."""
    path: str = scope["path"]
    root: str = scope.get("root_path", "")
    return path.removeprefix(root) if root else path


class Keys:
    """API keys and the names of their holders; with none, the service is open to all.

    Parameters
    ----------
    keys : mapping
        API key -> name of its holder.
    """

    def __init__(self, keys: Mapping[str, str]) -> None:
        self._keys = [(key.encode("ascii"), name) for key, name in keys.items()]

    def __bool__(self) -> bool:
        return bool(self._keys)

    def holder(self, headers: Mapping[bytes, bytes]) -> str | None:
        """The name of the holder of the request's key; None: no known key."""
        if not self._keys:
            return None
        offered = headers.get(b"x-api-key")
        if offered is None:
            scheme, _, credentials = headers.get(b"authorization", b"").partition(b" ")
            offered = credentials.strip() if scheme.lower() == b"bearer" else b""
        found = None
        for key, name in self._keys:  # compares all keys: the time does not depend on the key sent
            if secrets.compare_digest(offered, key):
                found = name
        return found


class Guard:
    """Middleware: refuses invalid requests before their body is read.

    Parameters
    ----------
    keys : Keys
    open_paths : frozenset of str
        Paths that need no key.
    max_bytes : int
        Largest body; that of a single case is at most 64 KiB.
    """

    def __init__(self, app: ASGIApp, keys: Keys, open_paths: frozenset[str], max_bytes: int) -> None:
        self.app = app
        self._max_bytes = min(SMALL_BODY, max_bytes)
        self._keys = keys
        self._open_paths = open_paths

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass one request on, or refuse it."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        headers = dict(scope["headers"])
        try:
            if len(headers) != len(scope["headers"]):
                _refuse_repeated(scope)
            if b"upgrade" in headers and scope["method"] not in ("GET", "HEAD"):
                # The body would be read as another protocol.
                raise MalformedBodyError("this service does not upgrade connections: send no Upgrade", headers=CLOSE)
            path = path_of(scope)
            if self._keys and path not in self._open_paths:
                self._admit(scope, headers)
            if scope["method"] not in ("GET", "HEAD") and not path.startswith(BATCH_PATH):
                if path.startswith("/v1/") and (
                    headers.get(b"content-type") != b"application/json" or b"content-encoding" in headers
                ):
                    check_media_type(Headers(scope=scope), {"application/json": "application/json"})
                receive = _limited(headers, receive, self._max_bytes)
        except MumacroError as error:
            await problem_of(error, scope["path"])(scope, receive, send)
            return
        await self.app(scope, receive, send)

    def _admit(self, scope: Scope, headers: Mapping[bytes, bytes]) -> None:
        holder = self._keys.holder(headers)
        if holder is None:
            raise UnauthorizedError(
                "send the API key as X-API-Key or as Authorization: Bearer", headers={"WWW-Authenticate": "Bearer"}
            )
        scope.setdefault("state", {})["key_name"] = holder


def _refuse_repeated(scope: Scope) -> None:
    names = [name for name, _ in scope["headers"]]
    for name in _ONCE:
        if names.count(name) > 1:
            raise MalformedBodyError(f"the header {name.decode()} is given more than once", headers=CLOSE)


def _limited(headers: Mapping[bytes, bytes], receive: Receive, limit: int) -> Receive:
    """A ``receive`` that refuses a body above the limit."""
    length = headers.get(b"content-length", b"0")
    if not length.isdigit() or len(length) > 9 or int(length) > limit:
        raise _too_large(limit)
    if b"content-length" in headers:
        return receive
    count = 0

    async def counted() -> Message:
        nonlocal count
        message = await receive()
        if message["type"] == "http.request":
            count += len(message.get("body", b""))
            if count > limit:
                raise _too_large(limit)
        return message

    return counted


def _too_large(limit: int) -> BodyTooLargeError:
    # The rest of the body is not used: without "close" the server would read all of it.
    return BodyTooLargeError(
        f"the body may have up to {limit} bytes; send many cases to {BATCH_PATH}",
        headers=CLOSE, max_bytes=limit,
    )  # fmt: skip


def check_media_type(headers: Mapping[str, str], known: Mapping[str, str]) -> str:
    """The media type of a body, out of the known ones (alias -> type); without a Content-Type it is the first.

    Raises
    ------
    UnsupportedBodyError
        Another media type, another charset than UTF-8, or a compressed body.
    """
    given = headers.get("content-type")
    found = next(iter(known.values()))
    if given is not None:
        media, _, parameters = given.lower().partition(";")
        charset = parameters.strip().removeprefix("charset=").strip('"') if "charset=" in parameters else "utf-8"
        named = known.get(media.strip())
        if named is None or charset.split(";")[0].strip() not in ("utf-8", "utf8", "us-ascii"):
            offer = ", ".join(dict.fromkeys(known.values()))
            raise UnsupportedBodyError(f"send {offer}, not {given[:80]}", headers={"Accept-Post": offer})
        found = named
    if headers.get("content-encoding", "identity").lower() != "identity":
        raise UnsupportedBodyError("send the body without Content-Encoding", headers={"Accept-Encoding": "identity"})
    return found


class Work:
    """Slots for large requests, and the threads that compute their answers.

    A slot is the right to run one large request.  A process has ``MUMACRO_MAX_BATCHES`` slots.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self.used = 0
        self.threads: ThreadPoolExecutor | None = None

    @asynccontextmanager
    async def place(self) -> AsyncIterator[None]:
        """Hold a slot.

        Raises
        ------
        OverloadedError
            No slot is free.
        """
        self.take()
        try:
            yield
        finally:
            self.used -= 1

    def take(self) -> None:
        """Take a slot; the code that called this gives it back by ``used -= 1``."""
        if self.used >= self._settings.max_batches:
            raise OverloadedError(f"{self.used} large requests are being answered already", headers=CLOSE)
        self.used += 1

    async def run(self, work: Callable[[], T], cost: float = float("inf")) -> T:
        """Do the work at once if it is small, else in a thread, so that it delays no other request."""
        if cost <= AT_ONCE or self.threads is None:
            return work()
        return await asyncio.get_running_loop().run_in_executor(self.threads, work)

    async def run_in_place(self, work: Callable[[], T]) -> T:
        """Do the work in a thread and a slot.  It keeps the slot until it is done, even if the client has left.

        Raises
        ------
        OverloadedError, TookTooLongError
        """
        self.take()
        task = asyncio.ensure_future(self.run(work))
        task.add_done_callback(self._give_back)
        try:
            async with asyncio.timeout(self._settings.time_limit_s):
                return await asyncio.shield(task)
        except TimeoutError:
            raise self.took_too_long() from None

    def _give_back(self, task: "asyncio.Future[T]") -> None:
        self.used -= 1
        if not task.cancelled():
            task.exception()

    async def client(self, move: Awaitable[T], until: float | None = None) -> T:
        """Wait for the client to send or to read, until the given time or for the client timeout.

        Raises
        ------
        SlowClientError
        """
        limit = self._settings.client_timeout_s
        loop = asyncio.get_running_loop()
        try:
            async with asyncio.timeout_at(loop.time() + limit if until is None else until):
                return await move
        except TimeoutError:
            raise SlowClientError(f"a client may take up to {limit} s", headers=CLOSE) from None

    def took_too_long(self) -> TookTooLongError:
        """The error for a request beyond the time limit."""
        return TookTooLongError(f"a request may take up to {self._settings.time_limit_s} s", headers=CLOSE)

    async def message(self, receive: Receive, until: float | None = None) -> Message:
        """The next piece of a body.

        Raises
        ------
        SlowClientError, ClientDisconnect
        """
        message = await self.client(receive(), until)
        if message["type"] != "http.request":
            raise ClientDisconnect
        return message

"""Record what is visible of a request from outside: its id, its log line, its counters.

Logs are JSON lines on standard output; a thread writes them.
"""

import asyncio
import itertools
import logging
import os
import re
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from functools import partial
from typing import Any, ClassVar

import orjson
from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

from .metrics import Metrics
from .middleware import HEALTH_PATHS, NOSNIFF
from .problems import ABORT, REFUSED, STATUS, meaning, path_in

_GONE = 499  # the usual status for a client that disconnected before the answer
_ID = re.compile(rb"[A-Za-z0-9._:-]{1,128}")  # an id goes into a header and into logs
_TRACE = re.compile(rb"[0-9a-f]{2}-[0-9a-f]{32}-[0-9a-f]{16}-[0-9a-f]{2}")
_OF_PROXIES = (b"x-forwarded-for", b"x-forwarded-proto")
# characters that are shown of a client's address, which behind a proxy is a header of any length
_MOST_SHOWN = 64
_MOST_WAITING = 10_000  # largest number of lines that wait to be written; further lines are dropped
_MOST_OF_ODD = 1000  # characters that are shown of a value that cannot be written as it is
_WRITE_EVERY_S = 0.05

_ESCAPED = {code: f"\\x{code:02x}" for code in (*range(32), *range(127, 160))}

_log = logging.getLogger(__name__)
_access = logging.getLogger("mumacro.access")


def for_people(line: Mapping[str, Any]) -> bytes:
    """Return a line of the log as a person at a terminal reads it.  Escape control characters, so
    that a client cannot forge a line or move the cursor."""
    rest = {name: x for name, x in line.items() if name not in ("time", "level", "logger")}
    traceback = str(rest.pop("exception", "")).splitlines()
    if "duration_ms" in rest:
        words = [rest["method"], rest["path"], rest["status"], f"{rest['duration_ms']} ms"]
    else:
        words = [rest.pop("message", "")]
        words += [f"{name}={x}" for name, x in rest.items() if isinstance(x, (str, int, float))]
    level = "" if line["level"] in ("info", "debug") else f"{line['level']}: "
    text = f"{line['time']:%H:%M:%S}  {level}{' '.join(map(str, words))}"
    lines = [one.translate(_ESCAPED) for one in (text, *traceback)]
    return ("\n".join(lines) + "\n").encode("utf-8", "backslashreplace")


_as_json = partial(orjson.dumps, default=str, option=orjson.OPT_APPEND_NEWLINE)


def _written(line: Mapping[str, Any], form: Callable[[Mapping[str, Any]], bytes]) -> bytes:
    """Return a line of the log.  If it cannot be written, write Python's representation of the
    values."""
    try:
        return form(line)
    except Exception:
        return form(
            {
                **line,
                **{
                    name: ascii(x)[:_MOST_OF_ODD]
                    for name, x in line.items()
                    if name not in ("time", "level", "logger")
                },
            }
        )


class LogLines(logging.Handler):
    """Keep lines for a thread that writes them twenty times a second, so that a slow reader delays
    no request.

    ``logging.handlers.QueueListener`` would wake its thread for every record.  A record takes a
    tenth of the time of a request, so :class:`Observe` puts its lines here itself.
    """

    #: the instance of this process; if there is none, another server runs, and that server logs its
    #: answers
    running: ClassVar["LogLines | None"] = None

    def __init__(self) -> None:
        super().__init__()
        self._waiting, self._dropped, self._writes = deque[dict[str, Any]](), 0, False
        threading.Thread(target=self._write, name="log", daemon=True).start()
        LogLines.running = self

    @property
    def lost(self) -> int:
        """Return how many lines could not be written."""
        return self._dropped

    def put(self, line: dict[str, Any]) -> None:
        """Keep a line if there is room."""
        if len(self._waiting) < _MOST_WAITING:
            self._waiting.append(line)
        else:
            self._dropped += 1

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a record: its time, level, logger, message and ``fields``."""
        line: dict[str, Any] = {
            "time": datetime.fromtimestamp(record.created, UTC),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            **getattr(record, "fields", {}),
        }
        if record.exc_info:
            line["exception"] = logging.Formatter().formatException(record.exc_info)
        self.put(line)

    def _write(self) -> None:
        """Write the lines by file descriptor, because a Python file would hold its lock while the
        reader of a pipe is slow.

        Escape line breaks within a line, so that a client cannot forge a line.  Whatever happens,
        this thread continues.
        """
        losses, form = 0, for_people if os.isatty(1) else _as_json
        while True:
            time.sleep(_WRITE_EVERY_S)
            self._writes = True
            lines = [self._waiting.popleft() for _ in range(len(self._waiting))]
            if lost := self._dropped - losses:
                losses += lost
                _log.warning(
                    "%d lines of the log were dropped: standard output was not read in time", lost
                )
            texts = [_written(line, form) for line in lines]
            sizes, sent = [*itertools.accumulate(map(len, texts))], 0
            rest = memoryview(b"".join(texts))
            try:
                while rest:
                    written = os.write(1, rest)
                    rest, sent = rest[written:], sent + written
            except OSError:  # the reader is gone, or the disk is full
                lost = sum(size > sent for size in sizes)
                self._dropped += lost
                losses += lost  # a line about the lost lines would be lost, too
            self._writes = False

    def flush(self) -> None:
        """Wait up to a second for the last lines to be written."""
        until = time.monotonic() + 1.0
        while (self._waiting or self._writes) and time.monotonic() < until:
            time.sleep(0.01)


def log_config(level: str) -> dict[str, Any]:
    """Return a ``logging.config.dictConfig`` for this process: everything goes to standard output,
    as JSON lines."""
    return {
        "version": 1,
        "disable_existing_loggers": False,
        "handlers": {"out": {"()": LogLines}},
        "root": {"level": "WARNING", "handlers": ["out"]},
        "loggers": {name: {"level": level.upper()} for name in ("mumacro", "uvicorn")},
    }


def _trace_in(scope: Scope) -> dict[str, str]:
    """Return the trace to which a request belongs, if it says so (W3C Trace Context)."""
    for name, value in scope["headers"]:
        if name == b"traceparent" and _TRACE.fullmatch(value):
            return {"traceparent": value.decode()}
    return {}


class Observer:
    """Record every answer: its id, its line in the log, its counters."""

    def __init__(self, metrics: Metrics) -> None:
        self._metrics = metrics
        self._stem = os.urandom(8).hex()
        self._numbers = itertools.count(int.from_bytes(os.urandom(6)))

    def name(self, scope: Scope) -> tuple[tuple[bytes, bytes], ...]:
        """Give a request its id, the one in its header or a new one, and return the headers of its
        answer."""
        if "request_id" not in scope:
            proposal = dict(scope["headers"]).get(b"x-request-id", b"")
            scope["request_id"] = (
                proposal.decode()
                if _ID.fullmatch(proposal)
                else f"{self._stem}{next(self._numbers):016x}"
            )
        return (b"x-request-id", scope["request_id"].encode()), NOSNIFF

    def record(self, scope: Scope, status: int, seconds: float) -> None:
        """Count an answer, and log it."""
        path, method = path_in(scope), scope["method"]
        self._metrics.request(path, method, status, seconds)
        quiet, lines = status == 200 and path in HEALTH_PATHS, LogLines.running
        if lines is None or not _access.isEnabledFor(logging.DEBUG if quiet else logging.INFO):
            return
        client, holder = scope.get("client"), scope.get("key_holder")
        lines.put(
            {
                "time": datetime.now(UTC),
                "level": "debug" if quiet else "info",
                "logger": "mumacro.access",
                "message": "request",
                "request_id": scope["request_id"],
                "method": method,
                "path": path,
                "status": status,
                "duration_ms": round(1e3 * seconds, 3),
                "client": client[0][:_MOST_SHOWN] if client else None,
                **({"key": holder} if holder else {}),
                **_trace_in(scope),
            }
        )


class Observe:
    """Record every answer with :class:`Observer` (middleware)."""

    def __init__(self, app: ASGIApp, observer: Observer, trusted_proxies: list[str]) -> None:
        self._app, self._observer = app, observer
        # in scope
        self._proxies: Any = ProxyHeadersMiddleware(lambda *_: asyncio.sleep(0), trusted_proxies)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        start, state = time.perf_counter(), scope.setdefault("state", {})
        marks = self._observer.name(scope)
        if any(name in _OF_PROXIES for name, _ in scope["headers"]):
            await self._proxies(scope, receive, send)

        async def send_marked(message: Message) -> None:
            if message["type"] == "http.response.start":
                state[STATUS] = message["status"]
                message["headers"] = [*message["headers"], *marks]
            await send(message)

        try:
            await self._app(scope, receive, send_marked)
        except ClientDisconnect as error:
            state[STATUS], cause = _GONE, error.__cause__
            if isinstance(cause, Exception):
                # in the middle of its answer: the connection ends without the rest
                state[STATUS] = meaning(cause, scope).kind.status
                if ABORT not in state:
                    raise  # another server ends it
                state[ABORT]()
        finally:
            seconds = time.perf_counter() - start
            self._observer.record(scope, state.get(REFUSED, state.get(STATUS, _GONE)), seconds)

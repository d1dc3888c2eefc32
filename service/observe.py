"""What is seen of a request from outside: its id, its log line, its counters, and the answer to an
exception.

Logs are JSON lines on standard output, written by a thread.  Counters are those of
prometheus_client; several workers share them through its multiprocess mode, in a private folder
that is made at the start.
"""

import asyncio
import itertools
import logging
import os
import re
import tempfile
import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping
from collections.abc import Set as AbstractSet
from contextlib import ExitStack, contextmanager, suppress
from datetime import UTC, datetime
from functools import cache, partial
from typing import Any, ClassVar

import numpy as np
import orjson
from prometheus_client import (
    CollectorRegistry,
    Counter,
    Gauge,
    Histogram,
    disable_created_metrics,
    generate_latest,
)
from prometheus_client.multiprocess import MultiProcessCollector
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

from mumacro.errors import MumacroError
from mumacro.table.atlas import SOURCES

from .answers import REGIME_NAMES
from .limits import check_head, drained, holder_of
from .problems import Kind, RequestError, problem_of
from .routes import Routes
from .settings import Settings
from .tables import LoadedTable, Tables

HEALTH_PATHS = frozenset({"/livez", "/readyz", "/healthz"})
_METHODS = frozenset({"GET", "HEAD", "POST"})
_SHARED = "PROMETHEUS_MULTIPROC_DIR"  # read by prometheus_client when it is imported
_BUCKETS_S = (
    1e-4,
    2.5e-4,
    5e-4,
    1e-3,
    2.5e-3,
    5e-3,
    0.01,
    0.025,
    0.05,
    0.1,
    0.25,
    0.5,
    1.0,
    2.5,
    5.0,
    10.0,
)
_ID = re.compile(rb"[A-Za-z0-9._:-]{1,128}")  # an id goes into a header and into logs
_MOST_SHOWN = 64  # characters of a client's address: behind a proxy it is a header, of any length
_MOST_WAITING = 10_000  # lines that wait to be written; further lines are dropped
_WRITE_EVERY_S = 0.05
_NO_SNIFF = (b"x-content-type-options", b"nosniff")

_ESCAPED = {code: f"\\x{code:02x}" for code in (*range(32), *range(127, 160))}

_log = logging.getLogger(__name__)
_access = logging.getLogger("mumacro.access")
_errors = logging.getLogger("mumacro.error")


def for_people(line: Mapping[str, Any]) -> bytes:
    """A line of the log as a person at a terminal reads it; control characters are escaped, so that
    a client cannot forge a line or move the cursor."""
    rest = {name: x for name, x in line.items() if name not in ("time", "level", "logger")}
    raised = str(rest.pop("exception", "")).splitlines()
    if "duration_ms" in rest:
        words = [rest["method"], rest["path"], rest["status"], f"{rest['duration_ms']} ms"]
    else:
        words = [rest.pop("message", "")]
        words += [f"{name}={x}" for name, x in rest.items() if isinstance(x, (str, int, float))]
    level = "" if line["level"] in ("info", "debug") else f"{line['level']}: "
    text = f"{line['time']:%H:%M:%S}  {level}{' '.join(map(str, words))}"
    lines = [one.translate(_ESCAPED) for one in (text, *raised)]
    return ("\n".join(lines) + "\n").encode("utf-8", "backslashreplace")


class LogLines(logging.Handler):
    """Keeps lines for a thread that writes them twenty times a second: a stalled reader delays no
    request.

    ``logging.handlers.QueueListener`` would wake its thread for every record; a record takes a
    tenth of the time of a request, so :class:`Observe` puts its lines here itself.
    """

    #: the one of this process; without it, under another server, that server says what it answered
    running: ClassVar["LogLines | None"] = None

    def __init__(self) -> None:
        super().__init__()
        self._waiting, self._dropped, self._writes = deque[dict[str, Any]](), 0, False
        threading.Thread(target=self._write, name="log", daemon=True).start()
        LogLines.running = self

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
        """Write by file descriptor: a Python file would hold its lock while the reader of a pipe
        stalls.

        Line breaks within a line are escaped, so that a client cannot forge one.
        """
        as_json = partial(orjson.dumps, default=str, option=orjson.OPT_APPEND_NEWLINE)
        told, form = 0, for_people if os.isatty(1) else as_json
        while True:
            time.sleep(_WRITE_EVERY_S)
            self._writes = True
            lines = [self._waiting.popleft() for _ in range(len(self._waiting))]
            if more := self._dropped - told:
                told += more
                _log.warning(
                    "%d lines of the log were dropped: standard output was not read in time", more
                )
            rest = memoryview(b"".join(map(form, lines)))
            with suppress(OSError):  # the reader is gone
                while rest:
                    rest = rest[os.write(1, rest) :]
            self._writes = False

    def flush(self) -> None:
        """At the end, wait a second at most for the last lines."""
        until = time.monotonic() + 1.0
        while (self._waiting or self._writes) and time.monotonic() < until:
            time.sleep(0.01)


def log_config(level: str) -> dict[str, Any]:
    """A ``logging.config.dictConfig`` for this process: everything to standard output, as JSON
    lines."""
    return {
        "version": 1,
        "disable_existing_loggers": False,
        "handlers": {"out": {"()": LogLines}},
        "root": {"level": "WARNING", "handlers": ["out"]},
        "loggers": {name: {"level": level.upper()} for name in ("mumacro", "uvicorn")},
    }


@contextmanager
def shared_counters() -> Iterator[None]:
    """A private folder for the counters of all workers, in memory if possible; it is empty, and
    removed at the end.

    Without a writable folder every worker reports its own counters.
    """
    place = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None  # noqa: S108  (a folder of its own is made there)
    with ExitStack() as stack:
        with suppress(OSError):
            made = tempfile.TemporaryDirectory(
                prefix="mumacro-metrics-", dir=place, ignore_cleanup_errors=True
            )
            os.environ[_SHARED] = stack.enter_context(made)
        yield


class Metrics:
    """Counters of requests and cases."""

    def __init__(self, paths: frozenset[str]) -> None:
        disable_created_metrics()  # type: ignore[no-untyped-call]
        self._paths = paths
        self.registry = own = CollectorRegistry()
        requests = Counter(
            "mumacro_requests", "Finished requests", ["route", "method", "status"], registry=own
        )
        told = "From the head of a request to the end of its answer"
        seconds = Histogram(
            "mumacro_request_duration_seconds", told, ["route"], buckets=_BUCKETS_S, registry=own
        )
        cases = Counter(
            "mumacro_cases", "Answered cases", ["table", "source", "regime"], registry=own
        )
        bad = Counter(
            "mumacro_bad_cases", "Cases of batches that were refused", ["table"], registry=own
        )
        labels = ["id", "tolerance"]
        self._info = Gauge(
            "mumacro_table_info",
            "Loaded tables",
            labels,
            registry=own,
            multiprocess_mode="mostrecent",
        )
        # a look-up of labels takes longer than counting
        self._of_request = cache(
            lambda *labels: (requests.labels(*labels).inc, seconds.labels(labels[0]).observe)
        )
        self._of_source = cache(
            lambda table, code: (
                bad.labels(table)
                if code < 0
                else cases.labels(table, SOURCES[code], REGIME_NAMES[code])
            )
        )

    def start(self, tables: Tables) -> None:
        """Name the loaded tables."""
        for table in tables.loaded:
            self._info.labels(table.id, format(table.surrogate.tolerance, "g")).set(1)
            self._of_source(table.id, -1)

    def request(self, path: str, method: str, status: int, seconds: float) -> None:
        """Count one request."""
        path, method = (
            path if path in self._paths else "other",
            method if method in _METHODS else "other",
        )
        count, observe = self._of_request(path, method, status)
        count()
        observe(seconds)

    def case(self, table: LoadedTable, source: int, number: int = 1) -> None:
        """Count answered cases of one source code; -1 are bad ones."""
        self._of_source(table.id, source).inc(number)

    def cases(self, table: LoadedTable, source: Any) -> None:
        """Count the cases of a batch by their source codes, bad ones among them."""
        for code, number in enumerate(np.bincount(source + 1).tolist()):
            if number:
                self.case(table, code - 1, number)

    def text(self) -> bytes:
        """The exposition format of Prometheus; with several workers, the sum over all."""
        registry = self.registry
        if _SHARED in os.environ:
            registry = CollectorRegistry()
            MultiProcessCollector(registry)  # type: ignore[no-untyped-call]
        return generate_latest(registry)


class Observe:
    """Around every answer: id, key, log line, counters, and problem details for every exception.

    Endpoints are found by ``routes``, ``others`` answers what is none.  ``open_paths``, and what is
    below ``/guide/``, need no key.
    """

    def __init__(
        self,
        routes: Routes,
        others: ASGIApp,
        metrics: Metrics,
        settings: Settings,
        open_paths: AbstractSet[str],
    ) -> None:
        self._routes, self._others, self._metrics = routes, others, metrics
        self._keys, self._open_paths = settings.keys(), open_paths
        # in scope
        self._proxies: Any = ProxyHeadersMiddleware(
            lambda *_: asyncio.sleep(0), settings.trusted_proxies
        )
        self._stem, self._numbers = (
            os.urandom(8).hex(),
            itertools.count(int.from_bytes(os.urandom(6))),
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run one request."""
        started = time.perf_counter()
        headers: dict[bytes, bytes] = dict(scope["headers"])
        offered = headers.get(b"x-request-id", b"")
        identity = (
            offered.decode()
            if _ID.fullmatch(offered)
            else f"{self._stem}{next(self._numbers):016x}"
        )
        scope["request_id"] = identity
        if b"x-forwarded-for" in headers or b"x-forwarded-proto" in headers:
            await self._proxies(scope, receive, send)
        path, status, holder = str(scope["path"]).removeprefix(scope.get("root_path", "")), 0, None

        async def send_marked(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                message["headers"] = [
                    *message["headers"],
                    (b"x-request-id", identity.encode()),
                    _NO_SNIFF,
                ]
            await send(message)

        try:
            if "full" in scope.get("state", ()) and path not in HEALTH_PATHS:
                raise RequestError(Kind.OVERLOADED, "too many connections are open")
            check_head(scope, headers)
            if self._keys and path not in self._open_paths and not path.startswith("/guide/"):
                holder = holder_of(headers, self._keys)
            answer = self._routes.find(path, scope["method"])
            response = self._others if answer is None else await answer(Request(scope, receive))
            await response(scope, receive, send_marked)
        except ClientDisconnect:
            status = 499  # the usual status for a client that disconnected before the answer
        except Exception as error:
            if not isinstance(error, (MumacroError, HTTPException, MemoryError)):
                fields = {"request_id": identity, "path": scope["path"]}
                _errors.exception("unexpected error", extra={"fields": fields})
            if status:  # the answer has begun: end the connection without its end
                status = 499
                raise ClientDisconnect from error
            problem = problem_of(error, scope)
            late = getattr(error, "kind", None) in (Kind.SLOW_CLIENT, Kind.TOOK_TOO_LONG)
            if "connection" in problem.headers and not late and b"expect" not in headers:
                await drained(receive)
            await problem(scope, receive, send_marked)
        finally:
            seconds = time.perf_counter() - started
            self._metrics.request(path, scope["method"], status, seconds)
            quiet, lines = status == 200 and path in HEALTH_PATHS, LogLines.running
            if lines is not None and _access.isEnabledFor(logging.DEBUG if quiet else logging.INFO):
                client = scope.get("client")
                lines.put(
                    {
                        "time": datetime.now(UTC),
                        "level": "debug" if quiet else "info",
                        "logger": "mumacro.access",
                        "message": "request",
                        "request_id": identity,
                        "method": scope["method"],
                        "path": path,
                        "status": status,
                        "duration_ms": round(1e3 * seconds, 3),
                        "client": client[0][:_MOST_SHOWN] if client else None,
                        **({"key": holder} if holder else {}),
                    }
                )

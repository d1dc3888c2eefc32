"""What is seen of a request from outside: its id, its log line, its counters, and the answer to an exception.

Logs are JSON lines on standard output, written by a thread.  Counters are those of prometheus_client; several workers
share them through its multiprocess mode, in a private folder that is made at the start.
"""

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
from functools import cache
from typing import Any

import numpy as np
import orjson
from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, disable_created_metrics, generate_latest
from prometheus_client.multiprocess import MultiProcessCollector
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from mumacro.errors import MumacroError

from .answers import REGIME_NAMES, SOURCES
from .limits import check_head, drained, holder_of
from .problems import Kind, RequestError, problem_of
from .routes import path_of
from .tables import LoadedTable, Tables

__all__ = ["JsonFormatter", "LogLines", "Metrics", "Observe", "log_config", "shared_counters"]

HEALTH_PATHS = frozenset({"/livez", "/readyz", "/healthz"})
_METHODS = frozenset({"GET", "HEAD", "POST"})
_SHARED = "PROMETHEUS_MULTIPROC_DIR"  # read by prometheus_client when it is imported
_BUCKETS_S = (1e-4, 2.5e-4, 5e-4, 1e-3, 2.5e-3, 5e-3, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0)
_ID = re.compile(rb"[A-Za-z0-9._:-]{1,128}")  # an id goes into a header and into logs
_MOST_SHOWN = 64  # characters of a client's address: behind a proxy it is a header, of any length
_MOST_WAITING = 10_000  # lines that wait to be written; further lines are dropped
_WRITE_EVERY_S = 0.05
_NO_SNIFF = (b"x-content-type-options", b"nosniff")

_log = logging.getLogger(__name__)
_access = logging.getLogger("mumacro.access")
_errors = logging.getLogger("mumacro.error")


class JsonFormatter(logging.Formatter):
    """One record, one line of JSON: time, level, logger, message, the record's ``fields``."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the record as JSON.  Line breaks in it are escaped, so that a client cannot forge a line."""
        line: dict[str, Any] = {
            "time": datetime.fromtimestamp(record.created, UTC),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            **getattr(record, "fields", {}),
        }
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return orjson.dumps(line, default=str).decode()


class LogLines(logging.Handler):
    """Keeps records for a thread that writes them twenty times a second: a stalled reader delays no request.

    ``logging.handlers.QueueListener`` would wake its thread for every record.
    """

    def __init__(self) -> None:
        super().__init__()
        self.setFormatter(JsonFormatter())
        self._waiting, self._dropped, self._writes = deque[logging.LogRecord](), 0, False
        threading.Thread(target=self._write, name="log", daemon=True).start()

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a record if there is room."""
        if len(self._waiting) < _MOST_WAITING:
            self._waiting.append(record)
        else:
            self._dropped += 1

    def _write(self) -> None:
        """Write by file descriptor: a Python file would hold its lock while the reader of a pipe stalls."""
        told = 0
        while True:
            time.sleep(_WRITE_EVERY_S)
            self._writes = True
            records = [self._waiting.popleft() for _ in range(len(self._waiting))]
            if more := self._dropped - told:
                told += more
                _log.warning("%d lines of the log were dropped: standard output was not read in time", more)
            rest = memoryview("".join(f"{self.format(record)}\n" for record in records).encode())
            with suppress(OSError):  # the reader is gone
                while rest:
                    rest = rest[os.write(1, rest) :]
            self._writes = False

    def flush(self) -> None:
        """At the end, wait a second at most for the last lines."""
        until = time.monotonic() + 1.0
        while (self._waiting or self._writes) and time.monotonic() < until:
            time.sleep(0.01)


class AccessRecord(logging.LogRecord):
    """The record of a request.  It has no place in a source file: finding that takes longer than all the rest."""

    def __init__(self, level: int, fields: dict[str, Any]) -> None:
        self.__dict__ = {**_SAME[level], "created": time.time(), "fields": fields}


_SAME = {
    level: vars(logging.LogRecord("mumacro.access", level, "", 0, "request", None, None))
    for level in (logging.DEBUG, logging.INFO)
}


def log_config(level: str) -> dict[str, Any]:
    """A ``logging.config.dictConfig`` for this process: everything to standard output, as JSON lines."""
    return {
        "version": 1,
        "disable_existing_loggers": False,
        "handlers": {"out": {"()": LogLines}},
        "root": {"level": "WARNING", "handlers": ["out"]},
        "loggers": {name: {"level": level.upper()} for name in ("mumacro", "uvicorn")},
    }


@contextmanager
def shared_counters() -> Iterator[None]:
    """A private folder for the counters of all workers, in memory if possible; it is empty, and removed at the end.

    Without a writable folder every worker reports its own counters.
    """
    place = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None  # noqa: S108  (a folder of its own is made there)
    with ExitStack() as stack:
        with suppress(OSError):
            made = tempfile.TemporaryDirectory(prefix="mumacro-metrics-", dir=place, ignore_cleanup_errors=True)
            os.environ[_SHARED] = stack.enter_context(made)
        yield


class Metrics:
    """Counters of requests and cases."""

    def __init__(self, paths: frozenset[str]) -> None:
        disable_created_metrics()  # type: ignore[no-untyped-call]
        self._paths = paths
        self.registry = own = CollectorRegistry()
        requests = Counter("mumacro_requests", "Finished requests", ["route", "method", "status"], registry=own)
        told = "From the head of a request to the end of its answer"
        seconds = Histogram("mumacro_request_duration_seconds", told, ["route"], buckets=_BUCKETS_S, registry=own)
        cases = Counter("mumacro_cases", "Answered cases", ["table", "source", "regime"], registry=own)
        bad = Counter("mumacro_bad_cases", "Cases of batches that were refused", ["table"], registry=own)
        labels = ["id", "tolerance"]
        self._info = Gauge("mumacro_table_info", "Loaded tables", labels, registry=own, multiprocess_mode="mostrecent")
        # a look-up of labels takes longer than counting
        self._of_request = cache(lambda *labels: (requests.labels(*labels), seconds.labels(labels[0])))
        self._of_source = cache(
            lambda table, code: (
                bad.labels(table) if code < 0 else cases.labels(table, SOURCES[code], REGIME_NAMES[code])
            )
        )

    def start(self, tables: Tables) -> None:
        """Name the loaded tables."""
        for table in tables.loaded:
            self._info.labels(table.id, format(table.surrogate.tolerance, "g")).set(1)
            self._of_source(table.id, -1)

    def request(self, path: str, method: str, status: int, seconds: float) -> None:
        """Count one request."""
        path, method = path if path in self._paths else "other", method if method in _METHODS else "other"
        count, durations = self._of_request(path, method, status)
        count.inc()
        durations.observe(seconds)

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
    """Middleware: id, key, log line, counters, and problem details for every exception.

    ``open_paths``, and what is below ``/guide/``, need no key.
    """

    def __init__(self, app: ASGIApp, metrics: Metrics, keys: Mapping[str, str], open_paths: AbstractSet[str]) -> None:
        self.app = app
        self._metrics, self._keys, self._open_paths = metrics, keys, open_paths
        self._stem, self._numbers = os.urandom(8).hex(), itertools.count(int.from_bytes(os.urandom(6)))

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Run one request."""
        started = time.perf_counter()
        headers: dict[bytes, bytes] = dict(scope["headers"])
        offered = headers.get(b"x-request-id", b"")
        identity = offered.decode() if _ID.fullmatch(offered) else f"{self._stem}{next(self._numbers):016x}"
        scope["request_id"] = identity
        path, status, holder = path_of(scope), 0, None

        async def send_marked(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                message["headers"] = [*message["headers"], (b"x-request-id", identity.encode()), _NO_SNIFF]
            await send(message)

        try:
            if "full" in scope.get("state", ()) and path not in HEALTH_PATHS:
                raise RequestError(Kind.OVERLOADED, "too many connections are open")
            check_head(scope, headers)
            if self._keys and path not in self._open_paths and not path.startswith("/guide/"):
                holder = holder_of(headers, self._keys)
            await self.app(scope, receive, send_marked)
        except ClientDisconnect:
            status = 499  # the usual status for a client that disconnected before the answer
        except Exception as error:
            if not isinstance(error, (MumacroError, HTTPException, MemoryError)):
                fields = {"request_id": identity, "path": scope["path"]}
                _errors.exception("unexpected error", extra={"fields": fields})
            if status:  # the answer has begun: end the connection without its end
                status = 499
                raise ClientDisconnect from error
            answer = problem_of(error, scope)
            late = getattr(error, "kind", None) in (Kind.SLOW_CLIENT, Kind.TOOK_TOO_LONG)
            if "connection" in answer.headers and not late and b"expect" not in headers:
                await drained(receive)
            await answer(scope, receive, send_marked)
        finally:
            seconds = time.perf_counter() - started
            self._metrics.request(path, scope["method"], status, seconds)
            level = logging.DEBUG if status == 200 and path in HEALTH_PATHS else logging.INFO
            if _access.isEnabledFor(level):
                client = scope.get("client")
                fields = {
                    "request_id": identity, "method": scope["method"], "path": path, "status": status,
                    "duration_ms": round(1e3 * seconds, 3), "client": client[0][:_MOST_SHOWN] if client else None,
                    **({} if holder is None else {"key": holder}),
                }  # fmt: skip
                _access.handle(AccessRecord(level, fields))

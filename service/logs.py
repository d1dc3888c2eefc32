"""Logs as JSON lines, each with the id of the request that it belongs to."""

import asyncio
import json
import logging
import os
import re
import threading
import time
from collections.abc import Callable
from contextlib import nullcontext, suppress
from contextvars import ContextVar
from datetime import UTC, datetime
from functools import lru_cache
from queue import SimpleQueue
from typing import Any

__all__ = [
    "AccessLog",
    "JsonFormatter",
    "LineHandler",
    "accept_request_id",
    "log_config",
    "new_request_id",
    "request_id",
]

request_id: ContextVar[str | None] = ContextVar("request_id", default=None)

# Letters, digits and a few marks only: an id goes into a header and into logs.
_ID = re.compile(r"[A-Za-z0-9._:-]{1,128}", re.ASCII)

_FLUSH_AFTER_S = 0.05
_MOST_WAITING = 1 << 20  # characters of lines that wait to be written; further lines are dropped
_LAST_S = 1.0  # how long the end of the process waits for them
_MOST_SHOWN = 64  # characters of a client's address: behind a proxy it is a header, of any length
# Lines of the most frequent requests are written without a LogRecord; their texts need no escape in JSON.
_KNOWN, _METHODS = frozenset({"/v1/mu-macro", "/v1/mu-macro/batch"}), frozenset({"GET", "POST"})
_stem, _number = os.urandom(8).hex(), 0


def new_request_id() -> str:
    """A fresh id of 32 hex digits: unique, not secret."""
    global _stem, _number
    if _number == 0 or _number >= 1 << 64:
        # New in every process, however it was started.
        _stem, _number = os.urandom(8).hex(), int.from_bytes(os.urandom(7)) + 1
    _number += 1
    return f"{_stem}{_number:016x}"


def accept_request_id(offered: bytes | None) -> str:
    """The client's id if it is well formed, else a fresh one of 32 hex digits."""
    if offered is not None:
        text = offered.decode("latin-1")
        if _ID.fullmatch(text):
            return text
    return new_request_id()


class JsonFormatter(logging.Formatter):
    """One record, one line of JSON: time, level, logger, message, request_id, the record's ``fields``."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the record as JSON.  Line breaks in it are escaped, so that a client cannot forge a line."""
        line: dict[str, Any] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        current = request_id.get()
        if current is not None:
            line["request_id"] = current
        line.update(getattr(record, "fields", {}))
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return json.dumps(line, default=str)


# time, request id, text between it and the duration, seconds, client, holder of the key; only the client may need an
# escape in JSON
Entry = tuple[float, str, str, float, str | None, str | None]


def _access_text(method: str, path: str, status: int) -> str:
    """The text of a request's line between its id and its duration."""
    return f'", "method": "{method}", "path": "{path}", "status": {status}, "duration_ms": '


@lru_cache(maxsize=256)
def _shown(client: str | None) -> str:
    return json.dumps(client)


def _access_lines(entries: list[Entry]) -> str:
    lines = []
    second, text = -1, ""
    for now, identity, between, seconds, client, key in entries:
        if int(now) != second:
            second = int(now)
            text = time.strftime('{"time": "%Y-%m-%dT%H:%M:%S.', time.gmtime(second))
        holder = f', "key": "{key}"' if key is not None else ""
        lines.append(
            f'{text}{int(1e3 * (now - second)):03d}+00:00", "level": "info", "logger": "mumacro.access", '
            f'"message": "request", "request_id": "{identity}{between}{1e3 * seconds:.3f}, "client": {_shown(client)}'
            f"{holder}}}\n"
        )
    return "".join(lines)


class _Writer:
    """A stream whose ``write`` never waits: a thread writes the texts to the file.

    If the reader of a pipe stalls, lines are dropped and counted; requests are not delayed.
    """

    def __init__(self, number: int) -> None:
        self._number = number
        self._texts: SimpleQueue[str | None] = SimpleQueue()
        self._given = self._dropped = 0  # characters; lines
        self._taken = 0
        self._thread = threading.Thread(target=self._run, daemon=True, name="log")
        self._thread.start()

    def write(self, text: str) -> None:
        """Queue whole lines."""
        if self._given - self._taken > _MOST_WAITING:
            self._dropped += text.count("\n")
            return
        self._given += len(text)
        self._texts.put(text)

    def flush(self) -> None:
        """Do nothing: the thread writes texts at once."""

    def close(self) -> None:
        """Wait a moment until all is written."""
        self._texts.put(None)
        self._thread.join(_LAST_S)

    def _run(self) -> None:
        told = 0
        while True:
            text = self._texts.get()
            self._put(text or "")
            self._taken += len(text or "")
            if self._dropped > told and (text is None or self._texts.empty()):
                message = f"{self._dropped - told} lines of the log were dropped: standard output was not read in time"
                told = self._dropped
                fields = {"name": __name__, "levelname": "WARNING", "msg": message}
                self._put(JsonFormatter().format(logging.makeLogRecord(fields)) + "\n")
            if text is None:
                return

    def _put(self, text: str) -> None:
        # By file descriptor: a Python file object would hold its lock while it waits, also when the process ends.
        rest = memoryview(text.encode("utf-8", "backslashreplace"))
        with suppress(OSError):  # the reader is gone
            while rest:
                rest = rest[os.write(self._number, rest) :]


class LineHandler(logging.StreamHandler[Any]):
    """Writes records at once, and the lines of finished requests together, which saves time.

    Parameters
    ----------
    stream : file
        With a file descriptor; the lines are written to it.
    """

    def __init__(self, stream: Any) -> None:
        super().__init__(_Writer(stream.fileno()))
        self._entries: list[Entry] = []

    def close(self) -> None:
        """Write the waiting lines; give up after a second if nothing reads them."""
        self.flush()
        self.stream.close()
        super().close()

    def put(self, entry: Entry) -> None:
        """Take a finished request; its line is written within a twentieth of a second, before any later record."""
        if not self._entries:
            asyncio.get_running_loop().call_later(_FLUSH_AFTER_S, self.flush)
        self._entries.append(entry)

    def emit(self, record: logging.LogRecord) -> None:
        """Write the waiting lines, then the record."""
        if self._entries:
            self.flush()
        super().emit(record)

    def flush(self) -> None:
        """Write the waiting lines."""
        with self.lock or nullcontext():
            entries, self._entries = self._entries, []
            if entries:
                self.stream.write(_access_lines(entries))
            super().flush()


class _Texts(dict[tuple[str, str, int], str]):
    def __missing__(self, key: tuple[str, str, int]) -> str:
        text = self[key] = _access_text(*key)
        return text


class AccessLog:
    """Lines of the logger ``mumacro.access``, without the cost of a LogRecord if this module configured the logs."""

    def __init__(self) -> None:
        self._log = logging.getLogger("mumacro.access")
        self._put: Callable[[Entry], None] | None = None
        self._texts = _Texts()

    def start(self) -> None:
        """Find the handler that writes the lines."""
        found = [handler for handler in logging.getLogger().handlers if isinstance(handler, LineHandler)]
        straight = found and self._log.propagate and not self._log.handlers and self._log.isEnabledFor(logging.INFO)
        self._put = found[0].put if straight else None

    def write(
        self, identity: str, method: str, path: str, status: int, seconds: float, client: str | None, key: str | None,
        *, quiet: bool = False,
    ) -> None:  # fmt: skip
        """Write the line of one finished request; ``quiet`` requests (successful probes) are logged at ``debug``."""
        if client is not None:
            client = client[:_MOST_SHOWN]
        if self._put is not None and not quiet and path in _KNOWN and method in _METHODS:
            self._put((time.time(), identity, self._texts[method, path, status], seconds, client, key))
            return
        level = logging.DEBUG if quiet else logging.INFO
        if not self._log.isEnabledFor(level):
            return
        fields = {
            "method": method, "path": path, "status": status, "duration_ms": round(1e3 * seconds, 3), "client": client,
        }  # fmt: skip
        if key is not None:
            fields["key"] = key
        self._log.log(level, "request", extra={"fields": fields})


def log_config(level: str) -> dict[str, Any]:
    """A ``logging.config.dictConfig`` for this process: everything to standard output, as JSON lines."""
    return {
        "version": 1,
        "disable_existing_loggers": False,
        "formatters": {"json": {"()": JsonFormatter}},
        "handlers": {"out": {"()": LineHandler, "stream": "ext://sys.stdout", "formatter": "json"}},
        "root": {"level": "WARNING", "handlers": ["out"]},
        "loggers": {name: {"level": level.upper()} for name in ("mumacro", "uvicorn")},
    }

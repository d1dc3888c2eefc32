"""Logs as JSON lines, each with the id of the request that it belongs to."""

import json
import logging
import os
import re
from contextvars import ContextVar
from datetime import UTC, datetime
from typing import Any

__all__ = ["JsonFormatter", "accept_request_id", "log_config", "request_id"]

request_id: ContextVar[str | None] = ContextVar("request_id", default=None)

# Letters, digits and a few marks only: an id goes into a header and into logs, and is nobody's free text.
_ID = re.compile(r"[A-Za-z0-9._:-]{1,128}", re.ASCII)


def accept_request_id(offered: bytes | None) -> str:
    """The caller's id when it is well formed, else a fresh one of 32 hex digits."""
    if offered is not None:
        text = offered.decode("latin-1")
        if _ID.fullmatch(text):
            return text
    return os.urandom(16).hex()


class JsonFormatter(logging.Formatter):
    """One record, one line of JSON: time, level, logger, message, request_id, the record's ``fields``."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the record as JSON.  Line breaks in it are escaped, so that nobody can forge a line."""
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


def log_config(level: str) -> dict[str, Any]:
    """A ``logging.config.dictConfig`` for this process: everything to standard output, as JSON lines."""
    return {
        "version": 1,
        "disable_existing_loggers": False,
        "formatters": {"json": {"()": JsonFormatter}},
        "handlers": {"out": {"class": "logging.StreamHandler", "stream": "ext://sys.stdout", "formatter": "json"}},
        "root": {"level": "WARNING", "handlers": ["out"]},
        "loggers": {name: {"level": level.upper()} for name in ("mumacro", "uvicorn")},
    }

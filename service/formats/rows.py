"""JSON rows: a list of objects, each one case.  A bad row affects only itself.

Compiled code (:mod:`service.numbers`) reads ordinary rows into arrays.  Any other body is read again, row by row, and
gives the reasons.
"""

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np
import orjson

from .. import numbers
from ..evaluation import MAX_ERRORS, Answers, Batch, Reason
from ..hints import ONE_FREQUENCY, STATE_K, STATE_OMEGA, TOO_FREQUENT, unknown_name
from ..kernel import FIELDS, INPUTS, MOST_HZ, RAD_PER_CYCLE
from ..quantities import nested
from . import decode, limit_values, read_plain, register, too_large
from .columns import REGIMES_OF, SOURCES_OF, dump, is_bool, read_entry

__all__ = ["objects", "read_row", "read_values", "write_rows"]

_SLICE = 8192  # cases that are written at a time


class Rows:
    """The format."""

    name, media_type, streams = "rows", "application/json", False
    aliases: tuple[str, ...] = ()
    body: ClassVar[dict[str, Any]] = {
        "schema": {"type": "array", "items": {"$ref": "#/components/schemas/Case"}},
        "example": [{"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 20690.0, "v0": 0.01}],
    }
    answer: ClassVar[dict[str, Any]] = {"schema": {"$ref": "#/components/schemas/RowsAnswer"}}

    def matches(self, text: memoryview) -> bool:
        """Whether it is a list."""
        return bytes(text[:4096]).lstrip()[:1] == b"["

    def read(self, text: bytearray, max_batch: int) -> tuple[Batch, dict[str, Any]]:
        """See :class:`Format`."""
        plain = read_plain(text, max_batch, numbers.ROWS)
        if plain is not None:
            return plain
        limit_values(text, max_batch, len(INPUTS) + 1)
        found = decode(text, list)
        if len(found) > max_batch:
            raise too_large(max_batch)
        return read_values(found), {}

    def write(self, answers: Answers, label: Mapping[str, Any]) -> Iterator[bytes]:
        """See :class:`Format`."""
        return write_rows(answers, label)


def read_values(found: list[Any]) -> Batch:
    """Rows from decoded JSON, one by one."""
    size = len(found)
    columns = np.full((6, size), np.nan)
    reasons: dict[int, Reason] = {}
    for i, row in enumerate(found):
        values, reason = read_row(row)
        if reason is None:
            columns[:, i] = values
        elif len(reasons) < MAX_ERRORS:
            reasons[i] = reason
    return Batch(size, list(columns), reasons)


def read_row(row: Any) -> tuple[list[float], Reason | None]:
    """The six inputs of a row, or the reason why it is not a case."""
    if not isinstance(row, dict):
        return [], (None, "must be an object")
    for name in row:
        if name not in INPUTS:
            return [], (str(name)[:80], unknown_name(str(name), INPUTS))
    values = {}
    for name in INPUTS:
        if name not in row or (name in ("omega", "f") and row[name] is None):
            if name == "k":
                return [], (name, STATE_K.format(rigid="null"))
            if name == "omega" and row.get("f") is None:
                return [], (name, STATE_OMEGA)
            if name not in ("omega", "f"):
                return [], (name, "is required")
            continue
        values[name], reason = read_entry(row[name], name)
        if reason is not None:
            return [], (name, reason)
    if "f" in values:
        if "omega" in values:
            return [], ("f", ONE_FREQUENCY)
        if values["f"] > MOST_HZ:
            return [], ("f", TOO_FREQUENT)
        values["omega"] = RAD_PER_CYCLE * values["f"]
    return [values[name] for name in FIELDS], None


def write_rows(answers: Answers, label: Mapping[str, Any]) -> Iterator[bytes]:
    """An object with the list of results, piece by piece."""
    yield b'{"results":['
    for start in range(0, answers.size, _SLICE):
        text = orjson.dumps(objects(answers, start, start + _SLICE))
        yield text[1:-1] if start == 0 else b"," + text[1:-1]
    yield b"]," + dump({"errors": answers.errors, "n_errors": answers.n_bad, **label})[1:]


def objects(answers: Answers, start: int, stop: int, label: Mapping[str, Any] | None = None) -> list[Any]:
    """Answers as objects, each with ``label``; None for a bad case."""
    part = slice(start, stop)
    extras = {
        name: [None if value != value else bool(value) for value in column[part].tolist()]
        if is_bool(name) else column[part].tolist()
        for name, column in answers.extras.items()
    }  # fmt: skip
    source = answers.source[part]
    lists = (
        answers.mu_macro[part].tolist(), answers.mu_ratio[part].tolist(), REGIMES_OF[source].tolist(),
        answers.error_bound[part].tolist(), SOURCES_OF[source].tolist(),
    )  # fmt: skip
    more = label or {}
    made: list[Any] = [
        None if name is None else {
            "mu_macro": mu, "mu_ratio": ratio, "regime": regime, "error_bound": bound, "source": name, **more
        }
        for mu, ratio, regime, bound, name in zip(*lists, strict=True)
    ]  # fmt: skip
    if extras:
        for i, entry in enumerate(made):
            if entry is not None:
                entry.update(nested({name: column[i] for name, column in extras.items()}))
    return made


register(Rows())

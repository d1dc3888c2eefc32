"""CSV: a header with the names of the inputs, one case per line; the answer likewise, with a text for a bad case."""

import csv
import io
import math
import re
from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Any, ClassVar

import numpy as np

from ..errors import MAX_FIELD_FAULTS, FieldFault, MalformedBodyError, missing_inputs, refusal
from ..evaluation import MAX_ERRORS, Answers, Batch, Reason
from ..hints import NUMBER, TOO_FREQUENT, number_hint, unknown_name
from ..kernel import BOUNDS, FIELDS, INPUTS, RAD_PER_CYCLE, UNITS
from . import register, too_large
from .columns import REGIMES_OF, SOURCES_OF

__all__: list[str] = []

_HEADER = re.compile(r"\s*([A-Za-z_0-9~]+)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\s*")
_RIGID = ("", "rigid", "inf", "null")
_SLICE = 4096  # lines that are written at a time
_LONGEST_NAME = 100  # characters of a cell of the header


class Csv:
    """The format."""

    name, media_type, streams = "csv", "text/csv", False
    aliases: tuple[str, ...] = ("application/csv",)
    body: ClassVar[dict[str, Any]] = {
        "schema": {
            "type": "string",
            "description": "RFC 4180 with a header: mu0, Fz, k, y0, omega or f, v0; units in brackets are checked; an "
            "empty cell or the word rigid in k is rigid contact",
        },
        "example": "mu0,Fz,k,y0,f,v0\r\n0.3,10,1e6,2e-6,20690,0.01\r\n",
    }
    answer: ClassVar[dict[str, Any]] = {
        "schema": {
            "type": "string",
            "description": "One line per case: mu_macro, mu_ratio, regime, error_bound, source, what include adds, "
            "error",
        }
    }

    def matches(self, text: memoryview) -> bool:
        """Always."""
        del text
        return True

    def read(self, text: bytearray, max_batch: int) -> tuple[Batch, dict[str, Any]]:
        """See :class:`Format`."""
        try:
            lines = csv.reader(io.StringIO(text.decode("utf-8-sig"), newline=""), strict=True)
            names = _names(next(lines, []))
            rows = list(islice(filter(None, lines), max_batch + 1))
        except (UnicodeDecodeError, csv.Error) as error:
            raise MalformedBodyError(f"the body is not CSV: {error}") from None
        if len(rows) > max_batch:
            raise too_large(max_batch)
        columns = np.full((6, len(rows)), np.nan)
        reasons: dict[int, Reason] = {}
        places = [FIELDS.index("omega" if name == "f" else name) for name in names]
        scales = [RAD_PER_CYCLE if name == "f" else 1.0 for name in names]
        for i, cells in enumerate(rows):
            reason = _read(cells, names, places, scales, columns[:, i])
            if reason is not None:
                columns[:, i] = np.nan
                if len(reasons) < MAX_ERRORS:
                    reasons[i] = reason
        return Batch(len(rows), list(columns), reasons), {}

    def write(self, answers: Answers, label: Mapping[str, Any]) -> Iterator[bytes]:
        """See :class:`Format`.  The table's name is in the response header X-Table."""
        del label
        text = io.StringIO()
        writer = csv.writer(text)
        writer.writerow(["mu_macro", "mu_ratio", "regime", "error_bound", "source", *answers.extras, "error"])
        errors = {error["index"]: f"{error['field'] or 'case'}: {error['reason']}" for error in answers.errors}
        for start in range(0, answers.size, _SLICE):
            part = slice(start, start + _SLICE)
            source = answers.source[part]
            lists = [
                _cells(answers.mu_macro[part]), _cells(answers.mu_ratio[part]), REGIMES_OF[source].tolist(),
                _cells(answers.error_bound[part]), SOURCES_OF[source].tolist(),
                *(_cells(column[part]) for column in answers.extras.values()),
                [errors.get(start + i, "bad case" if code < 0 else "") for i, code in enumerate(source.tolist())],
            ]  # fmt: skip
            writer.writerows(zip(*lists, strict=True))
            yield text.getvalue().encode()
            text.seek(0)
            text.truncate()
        if answers.size == 0:
            yield text.getvalue().encode()


def _cells(column: Any) -> list[Any]:
    return ["" if value != value else value for value in column.tolist()]


def _names(header: list[str]) -> list[str]:
    faults, names = [], []
    for cell in header[:MAX_FIELD_FAULTS]:  # so many cannot all be valid, and no more faults are reported
        found = _HEADER.fullmatch(cell) if len(cell) <= _LONGEST_NAME else None
        name, unit = (found[1], found[2]) if found else (cell, None)
        if name not in INPUTS:
            faults.append(FieldFault(cell, unknown_name(name, INPUTS)))
        elif name in names:
            faults.append(FieldFault(name, "is given more than once"))
        elif unit is not None and unit.replace(" ", "") not in (UNITS[name], ""):
            faults.append(FieldFault(cell, f"must be in {UNITS[name]}, not in {unit}: convert the column"))
        names.append(name)
    faults += missing_inputs(names, "a column of empty cells or of the word rigid")
    if faults:
        raise refusal(faults)
    return names


def _read(cells: list[str], names: list[str], places: list[int], scales: list[float], out: Any) -> Reason | None:
    if len(cells) != len(names):
        return None, f"has {len(cells)} cells where the header has {len(names)}"
    for name, place, scale, cell in zip(names, places, scales, cells, strict=True):
        text = cell.strip()
        if NUMBER.fullmatch(text) and " " not in text:
            out[place] = scale * float(text)
            if out[place] == math.inf:
                return name, TOO_FREQUENT if name == "f" else f"must be {BOUNDS[FIELDS[place]]}"
        elif name == "k" and text.lower() in _RIGID:
            out[place] = math.inf
        else:
            return name, "is required" if not text else number_hint(text, name)
    return None


register(Csv())

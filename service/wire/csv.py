"""CSV: a head with the names of the inputs, one case per line; the answer likewise, with a text for a bad case."""

import csv
import io
from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import islice
from typing import Any

import numpy as np

from mumacro.contact import Kind as ContactKind
from mumacro.inputs import RIGID, SI, UNITS_OF, Scale, is_rigid, scale_of, split_unit

from ..case import (
    LIKE,
    MAX_ERRORS,
    Columns,
    Reason,
    asked_of,
    columns_of,
    faults_in,
    joined,
    names_of,
    stranger,
    too_large,
)
from ..options import kind_in
from ..problems import FieldFault, Kind, RequestError, refuse
from . import Batch, Form

__all__ = ["FORM"]

_LONGEST_LINE = 64 * 1024  # characters
_SLICE = 4096  # lines that are read or written at a time
_DIGITS = b"0123456789.eE+-"


def _read(text: bytearray, max_batch: int, query: Mapping[str, Any]) -> tuple[Columns, dict[str, Any]]:
    kind = kind_in(query)
    lines = csv.reader(_lines(text, max_batch), strict=True)
    short: dict[int, Reason] = {}
    size = 0
    try:
        names, scales = _head(next(lines, []), kind)
        parts: dict[str, list[Any]] = {name: [np.empty(0)] for name in names}
        while rows := list(islice(lines, _SLICE)):
            rows = [row for row in rows if row]
            for i, row in enumerate(rows):
                if len(row) != len(names):
                    short[size + i] = None, f"has {len(row)} cells where the head has {len(names)}"
                    rows[i] = ["nan"] * len(names)
            for name, scale, cells in zip(names, scales, zip(*rows, strict=True), strict=False):
                parts[name].append(_values(name, scale, cells))
            size += len(rows)
    except (UnicodeDecodeError, csv.Error) as error:
        raise RequestError(Kind.MALFORMED_BODY, f"the body is not CSV: {error}") from None
    columns = columns_of({name: joined(name, found) for name, found in parts.items()}, max_batch, kind=kind)
    columns.reasons |= dict(islice(short.items(), MAX_ERRORS))
    return columns, {}


def _lines(text: bytearray, max_batch: int) -> Iterator[str]:
    """The lines, blank ones among them; at most as many as a batch may have."""
    lines = io.TextIOWrapper(io.BytesIO(text), "utf-8-sig", newline="")
    count = 0
    while line := lines.readline(_LONGEST_LINE + 1):
        count += 1
        if len(line) > _LONGEST_LINE:
            raise RequestError(
                Kind.MALFORMED_BODY, f"line {count} of the body has more than {_LONGEST_LINE} characters"
            )
        if count > max_batch + 2:
            raise too_large(max_batch)
        yield line


def _head(cells: list[str], kind: ContactKind) -> tuple[list[str], list[Scale]]:
    """The inputs of the columns and their units."""
    faults, names, scales = [], list[str](), []
    asked = asked_of([split_unit(cell)[0] for cell in cells[:100]], kind)
    known = names_of(asked)
    for cell in cells[:100]:  # so many cannot all be valid, and no more faults are reported
        name, unit = split_unit(cell)
        like = LIKE.get(name, name)
        scale = Scale() if unit is None else scale_of(like, unit) if like in SI else None
        if name not in known:
            faults.append(FieldFault.of(cell, stranger(name, asked, known)))
        elif name in names:
            faults.append(FieldFault.of(name, "is given more than once"))
        elif scale is None:
            units = ", ".join(UNITS_OF[like])[:300]
            faults.append(FieldFault.of(cell, f"has a unit that {name} cannot have; known are {units}"))
        names.append(name)
        scales.append(scale or Scale())
    faults += faults_in(names, asked=asked)
    if faults:
        refuse(faults)
    return names, scales


def _values(name: str, scale: Scale, cells: tuple[str, ...]) -> Any:
    """A part of a column: an array, or a list where a cell is no number; a gap is None."""
    if all(cells) and not "".join(cells).encode().translate(None, _DIGITS):
        with suppress(ValueError), np.errstate(over="ignore"):  # infinite, which is refused
            column = np.array(list(map(float, cells)))
            if name != "k" or np.isfinite(column).all():  # a number of too many digits is not rigid
                return np.divide(column * scale.times, scale.over) if scale != Scale() else column
    return [_value(name, scale, cell.strip()) for cell in cells]


def _value(name: str, scale: Scale, text: str) -> Any:
    if not text or text.lower() == "nan":
        return None
    if name == "k" and is_rigid(text):
        return RIGID
    with suppress(ValueError):
        if not text.encode().translate(None, _DIGITS):
            return scale.si(float(text))
    return text


def _write(batch: Batch) -> Iterator[bytes]:
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow([*(part.path for part in batch.parts), "error"])
    for start, found, source in batch.slices(_SLICE):
        good = source >= 0
        lists = []
        for part in batch.parts:
            column = found[part.path]
            names = part.values(np.where(good, column, 0)) if part.names else part.values(column)
            lists.append(
                [name if fine else "" for name, fine in zip(names, good.tolist(), strict=True)]
                if part.names
                else ["" if value != value or value is None else value for value in names]
            )
        writer.writerows(zip(*lists, batch.texts(start, source), strict=True))
        yield text.getvalue().encode()
        text.seek(0)
        text.truncate()


FORM = Form(
    "text/csv",
    ("application/csv",),
    _read,
    _write,
    body={
        "schema": {
            "type": "string",
            "description": "RFC 4180 with a head: mu0, Fz, k, y0, omega or f, v0, each in SI or with a unit in "
            "brackets; k_low and k_high in place of k, Fz_amplitude in place of y0 for direction normal; the "
            "word rigid in k is rigid contact, an empty cell is refused",
        },
        "example": "mu0,Fz,k [N/mm],y0 [um],f,v0\r\n0.3,10,1000,2,20690,0.01\r\n",
    },
    answer={
        "schema": {
            "type": "string",
            "description": "One line per case: mu_macro, mu_ratio, regime, error_bound, source, what include adds, "
            "error; the name of the table is in the header X-Table",
        }
    },
)

"""CSV: a head with the names of the inputs, one case per line; the answer likewise, with a text for
a bad case."""

import csv
import io
from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import islice
from typing import Any

import numpy as np

from mumacro.inputs.fields import LIKE
from mumacro.inputs.kind import Kind as ContactKind
from mumacro.inputs.units import UNITS_OF, Scale, scale_of, split_unit

from ..case import Columns, Reason, columns_of, numbers, too_large
from ..options import kind_in
from ..problems import Kind, RequestError
from . import Batch, Form, check_names, text_form

_LONGEST_LINE = 64 * 1024  # characters
_SLICE = 4096  # lines that are read or written at a time
_DIGITS = b"0123456789.eE+-"


def _read(
    text: bytearray, max_batch: int, query: Mapping[str, Any]
) -> tuple[Columns, dict[str, Any]]:
    kind = kind_in(query)
    lines = csv.reader(_lines(text, max_batch), strict=True)
    reasons: dict[int, Reason] = {}
    size = 0
    try:
        scales = _head(next(lines, []), kind)
        parts = {name: [np.empty(0)] for name in scales}
        while rows := list(islice(lines, _SLICE)):
            rows = [row for row in rows if row]
            for i, row in enumerate(rows):
                if len(row) != len(scales):
                    reasons[size + i] = (
                        None,
                        f"has {len(row)} cells where the head has {len(scales)}",
                    )
                    rows[i] = ["nan"] * len(scales)
            for (name, scale), cells in zip(scales.items(), zip(*rows, strict=True), strict=False):
                parts[name].append(_values(name, scale, cells, reasons, size))
            size += len(rows)
    except (UnicodeDecodeError, csv.Error) as error:
        raise RequestError(Kind.MALFORMED_BODY, f"the body is not CSV: {error}") from None
    columns = columns_of(
        {name: np.concatenate(found) for name, found in parts.items()}, max_batch, kind=kind
    )
    columns.reasons = reasons
    return columns, {}


def _lines(text: bytearray, max_batch: int) -> Iterator[str]:
    """The lines, blank ones among them; at most as many as a batch may have."""
    lines = io.TextIOWrapper(io.BytesIO(text), "utf-8-sig", newline="")
    count = 0
    while line := lines.readline(_LONGEST_LINE + 1):
        count += 1
        if len(line) > _LONGEST_LINE:
            told = f"line {count} of the body has more than {_LONGEST_LINE} characters"
            raise RequestError(Kind.MALFORMED_BODY, told)
        if count > max_batch + 2:
            raise too_large(max_batch)
        yield line


def _head(cells: list[str], kind: ContactKind) -> dict[str, Scale]:
    """The inputs of the columns and their units."""
    names, scales, wrong = [], dict[str, Scale](), {}
    for cell in cells[:100]:  # so many cannot all be valid, and no more faults are reported
        name, unit = split_unit(cell)
        units = UNITS_OF.get(LIKE.get(name, name), {})
        scale = Scale() if unit is None or not units else scale_of(name, unit)
        if scale is None:
            wrong[name] = f"has a unit that {name} cannot have; known are {', '.join(units)[:300]}"
        names.append(name)
        scales[name] = scale or Scale()
    check_names(names, kind, wrong)
    return scales


def _values(
    name: str, scale: Scale, cells: tuple[str, ...], reasons: dict[int, Reason], first: int
) -> Any:
    """A part of a column, and why a cell is no number within double range."""
    if all(cells) and not "".join(cells).encode().translate(None, _DIGITS):
        with suppress(ValueError), np.errstate(over="ignore"):
            column = np.array(list(map(float, cells))) * scale.times / scale.over
            if np.isfinite(column).all():
                return column
    return numbers(name, [_value(scale, cell.strip()) for cell in cells], reasons, first)


def _value(scale: Scale, text: str) -> Any:
    """What a cell says: a number, None for a gap, or a word."""
    if not text or text.lower() == "nan":
        return None
    with suppress(ValueError):
        if not text.encode().translate(None, _DIGITS):
            return scale.si(float(text))
    return text


def _write(batch: Batch) -> Iterator[bytes]:
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow([*(part.path for part in batch.wanted.parts), "error"])
    for found, _, faults in batch.slices(_SLICE):
        shown = (part.values(found[part.path]) for part in batch.wanted.parts)
        columns = ([None if value != value else value for value in column] for column in shown)
        writer.writerows(zip(*columns, faults, strict=True))
        yield text.getvalue().encode()
        text.seek(0)
        text.truncate()


FORM = Form(
    "text/csv",
    ("application/csv",),
    _read,
    _write,
    body=text_form(
        "RFC 4180 with a head: mu0, Fz, k, y0, omega or f, v0, each in SI or with a unit in "
        "brackets; k_low and k_high in place of k, Fz_amplitude in place of y0 for direction "
        "normal; the word rigid in k is rigid contact, an empty cell is refused"
    )
    | {"example": "mu0,Fz,k [N/mm],y0 [um],f,v0\r\n0.3,10,1000,2,20690,0.01\r\n"},
    answer=text_form(
        "One line per case: mu_macro, mu_ratio, regime, error_bound, source, what include adds, "
        "error; the name of the table is in the header X-Table"
    ),
)

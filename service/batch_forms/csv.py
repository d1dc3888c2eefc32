"""CSV: a head with the names of the inputs, one case per line; the answer likewise, with a text for
a bad case.  Needs pyarrow."""

import codecs
import csv
import io
import re
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pcsv

from mumacro.inputs.fields import LIKE
from mumacro.inputs.units import UNITS_OF, Scale, scale_of, split_unit

from ..batch import Batch, Body, Form, Reason, text_form, too_large
from ..models.inputs import INPUTS
from ..models.options import BatchOptions
from ..problems import FieldFault, ProblemKind, RequestError, refuse
from .arrow import record_batches, twice

_LONGEST_HEAD = 64 * 1024  # bytes
_BLOCK = 1024 * 1024  # bytes that are read at a time; a line may have as many
_SLICE = 32768  # cases that are written at a time
_DIGITS = b"0123456789.eE+-"


def _read(text: bytearray, max_batch: int, _options: BatchOptions) -> Body:
    start = len(_MARK) if text.startswith(_MARK) else 0
    first_line = _HEAD.match(text, start)
    head, start = (b"", start) if first_line is None else (first_line[1], first_line.end())
    if len(head) > _LONGEST_HEAD:
        detail = f"the first line of the body has more than {_LONGEST_HEAD} bytes"
        raise RequestError(ProblemKind.MALFORMED_BODY, detail)
    wrong: list[Any] = []
    columns: dict[str, list[Any]] = {}
    size = 0
    try:
        scales = _head(next(csv.reader([head.decode()], strict=True), []))
        _check(text)
        for block in _blocks(text, start, [*scales], wrong):
            size += block.num_rows
            if size + len(wrong) > max_batch:
                raise too_large(max_batch)
            for name, scale in scales.items():
                cells = _values(block[name], scale) if name in INPUTS else []
                columns.setdefault(name, []).append(cells)
    except (UnicodeDecodeError, csv.Error, pa.ArrowInvalid) as error:
        reason = str(error).splitlines()[0][:200]
        raise RequestError(ProblemKind.MALFORMED_BODY, f"the body is not CSV: {reason}") from None
    if size + len(wrong) > max_batch:
        raise too_large(max_batch)
    reasons: dict[int, Reason] = {
        row.number - 1: (None, f"has {row.actual_columns} cells where the head has {len(scales)}")
        for row in wrong
    }
    places = sorted(reasons)
    members = {name: _joined(columns.get(name, []), places) for name in scales}
    return Body(members, reasons)


_MARK = b"\xef\xbb\xbf"  # of UTF-8, as spreadsheets write it
_HEAD = re.compile(rb"[\r\n]*([^\r\n]*)(\r\n|\r|\n|$)")


def _check(text: bytearray) -> None:
    """UnicodeDecodeError for a wrong byte, of which pyarrow would tell standard error where its row
    is wrong, too; csv.Error for a quote that is not closed."""
    decoder = codecs.getincrementaldecoder("utf-8")()
    for at in range(0, len(text), _BLOCK):
        decoder.decode(text[at : at + _BLOCK], at + _BLOCK >= len(text))
    if text.count(b'"') % 2:
        raise csv.Error("a quote is not closed")


def _blocks(text: bytearray, start: int, names: list[str], wrong: list[Any]) -> Iterator[Any]:
    """The rows as blocks of columns of texts; ``wrong`` gets those with other cells than names."""
    if not text[start : start + 1000].strip(b"\r\n") and not text[start:].strip(b"\r\n"):
        return

    def skip(row: Any) -> str:
        wrong.append(row)
        return "skip"

    yield from pcsv.open_csv(
        pa.BufferReader(pa.py_buffer(text)[start:]),
        pcsv.ReadOptions(use_threads=False, block_size=_BLOCK, column_names=names),
        pcsv.ParseOptions(invalid_row_handler=skip),
        pcsv.ConvertOptions(
            column_types=dict.fromkeys(names, pa.string()), strings_can_be_null=False
        ),
    )


def _joined(parts: list[Any], gaps: list[int]) -> Any:
    """A column as an array, or as a list where a cell is no number or has a gap."""
    if not gaps and parts and all(isinstance(part, np.ndarray) for part in parts):
        return np.concatenate(parts)
    column = [cell for part in parts for cell in part]
    column = [float(cell) if isinstance(cell, np.float64) else cell for cell in column]
    for place in gaps:
        column.insert(place, None)
    return column


def _head(cells: list[str]) -> dict[str, Scale]:
    """The inputs of the columns and their units."""
    names, scales, faults = [], dict[str, Scale](), []
    for cell in cells[:100]:  # so many cannot all be valid, and no more faults are reported
        name, unit = split_unit(cell)
        units = UNITS_OF.get(LIKE.get(name, name), {})
        scale = Scale() if unit is None or not units else scale_of(name, unit)
        if scale is None:
            symbols = ", ".join(units)[:300]
            reason = f"has a unit that {name} cannot have; known are {symbols}"
            faults.append(FieldFault.of(name, reason))
        names.append(name)
        scales[name] = scale or Scale()
    if faults := [*faults, *twice(names)]:
        refuse(faults)
    return scales


def _values(column: Any, scale: Scale) -> Any:
    """A column of texts as an array of finite numbers; where a cell is none, as a list."""
    # 9 MB and 0.1 s, which a service that is sent no CSV does not need
    import pyarrow.compute as pc

    with suppress(pa.ArrowInvalid):
        numbers = pc.cast(pc.utf8_trim_whitespace(column), pa.float64()).to_numpy()
        with np.errstate(over="ignore"):
            numbers = numbers * scale.times / scale.over
        if np.isfinite(numbers).all():
            return numbers
    return [_value(scale, cell.strip()) for cell in column.to_pylist()]


def _value(scale: Scale, text: str) -> Any:
    """What a cell says: a number, None for a gap, or a word."""
    if not text or text.lower() == "nan":
        return None
    with suppress(ValueError):
        if not text.encode().translate(None, _DIGITS):
            return scale.si(float(text))
    return text


def _write(batch: Batch) -> Iterator[bytes]:
    opened = False
    for record_batch in record_batches(batch, _SLICE):
        plain = pa.table(
            {
                name: column.cast(pa.string()) if pa.types.is_dictionary(column.type) else column
                for name, column in zip(
                    record_batch.schema.names, record_batch.columns, strict=True
                )
            }
        )
        if not opened:
            yield ",".join(plain.column_names).encode() + b"\n"
            opened = True
        sink = io.BytesIO()
        pcsv.write_csv(plain, sink, pcsv.WriteOptions(include_header=False, quoting_style="needed"))
        yield sink.getvalue()


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

"""CSV: a head with the names of the inputs, one case per line; the answer likewise, with a text for
a bad case.  Needs pyarrow."""

import csv
import io
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pcsv

from mumacro.inputs.fields import LIKE
from mumacro.inputs.units import UNITS_OF, Scale, scale_of, split_unit

from ..batch import Batch, Body, Form, Reason, text_form, too_large
from ..models.inputs import INPUTS
from ..models.options import BatchOptions
from ..problems import FieldFault, Kind, RequestError, refuse
from .arrow import tables_of, twice

_SLICE = 32768  # cases that are written at a time
_DIGITS = b"0123456789.eE+-"


def _read(text: bytearray, max_batch: int, _options: BatchOptions) -> Body:
    body = bytes(text).removeprefix(b"\xef\xbb\xbf")
    head, _, rest = (
        body.replace(b"\r\n", b"\n").replace(b"\r", b"\n").lstrip(b"\n").partition(b"\n")
    )
    if rest.count(b"\n") > 2 * max_batch + 2:
        raise too_large(max_batch)
    try:
        scales = _head(next(csv.reader([head.decode()], strict=True), []))
        rest.decode()  # pyarrow would tell standard error of a wrong byte in a wrong row
        if rest.count(b'"') % 2:
            raise csv.Error("a quote is not closed")
        wrong: list[Any] = []

        def odd(row: Any) -> str:
            wrong.append(row)
            return "skip"

        table = _parsed(rest, [*scales], odd)
    except (UnicodeDecodeError, csv.Error, pa.ArrowInvalid) as error:
        reason = str(error).splitlines()[0][:200]
        raise RequestError(Kind.MALFORMED_BODY, f"the body is not CSV: {reason}") from None
    if table.num_rows + len(wrong) > max_batch:
        raise too_large(max_batch)
    columns = {
        name: _values(table[name], scale) for name, scale in scales.items() if name in INPUTS
    }
    reasons: dict[int, Reason] = {}
    for row in wrong:
        index = row.number - 1 if row.number else len(reasons)
        reason = f"has {row.actual_columns} cells where the head has {len(scales)}"
        reasons[index] = (None, reason)
    if reasons:
        places = sorted(reasons)
        columns = {name: _with_gaps(values, places) for name, values in columns.items()}
    others: dict[str, Any] = {name: [] for name in scales}  # which the model refuses by its name
    return Body({**others, **columns}, reasons)


def _parsed(text: bytes, names: list[str], odd: Any) -> Any:
    """The rows as columns of texts."""
    if not text.strip(b"\n"):
        return pa.table({name: pa.array([], pa.string()) for name in names})
    return pcsv.read_csv(
        io.BytesIO(text),
        pcsv.ReadOptions(use_threads=False, column_names=names),
        pcsv.ParseOptions(invalid_row_handler=odd),
        pcsv.ConvertOptions(
            column_types=dict.fromkeys(names, pa.string()), strings_can_be_null=False
        ),
    )


def _head(cells: list[str]) -> dict[str, Scale]:
    """The inputs of the columns and their units."""
    names, scales, faults = [], dict[str, Scale](), []
    for cell in cells[:100]:  # so many cannot all be valid, and no more faults are reported
        name, unit = split_unit(cell)
        units = UNITS_OF.get(LIKE.get(name, name), {})
        scale = Scale() if unit is None or not units else scale_of(name, unit)
        if scale is None:
            known = ", ".join(units)[:300]
            reason = f"has a unit that {name} cannot have; known are {known}"
            faults.append(FieldFault.of(name, reason))
        names.append(name)
        scales[name] = scale or Scale()
    if faults := [*faults, *twice(names)]:
        refuse(faults)
    return scales


def _values(column: Any, scale: Scale) -> Any:
    """A column of texts as an array of finite numbers; where a cell is none, as a list."""
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


def _with_gaps(values: Any, places: list[int]) -> list[Any]:
    """A column with a gap at each of these places."""
    filled = values if isinstance(values, list) else values.tolist()
    for place in places:
        filled.insert(place, None)
    return filled


def _write(batch: Batch) -> Iterator[bytes]:
    opened = False
    for made in tables_of(batch, _SLICE):
        plain = pa.table(
            {
                name: pc.cast(column, pa.string())
                if pa.types.is_dictionary(column.type)
                else column
                for name, column in zip(made.schema.names, made.columns, strict=True)
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

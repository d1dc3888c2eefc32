"""Arrow streams in and out, without copies of the columns and without text.  Needs pyarrow."""

import io
import math
from collections.abc import Iterator, Mapping
from struct import error, unpack_from
from typing import Any

import numpy as np
import pyarrow as pa

from mumacro.inputs.fields import RIGID

from ..answers import Part
from ..case import Columns, columns_of, too_large
from ..options import kind_in
from ..problems import Kind, RequestError
from . import Batch, Form, check_names, text_form
from .json import dump

_SLICE = 32768  # cases of a record batch of the answer


def _read(
    text: bytearray, max_batch: int, query: Mapping[str, Any]
) -> tuple[Columns, dict[str, Any]]:
    kind = kind_in(query)
    try:
        buffer = pa.py_buffer(text)
        with pa.ipc.open_stream(buffer) as reader:
            wrong = {
                field.name: f"must be a column of numbers, not of {str(field.type)[:80]}"
                for field in reader.schema
                if not (pa.types.is_floating(field.type) or pa.types.is_integer(field.type))
            }
            check_names(reader.schema.names, kind, wrong)
            for message in pa.ipc.MessageReader.open_stream(buffer):
                if message.type == "record batch" and _is_compressed(message.metadata):
                    told = "the body is a compressed Arrow stream: send it uncompressed"
                    raise RequestError(Kind.MALFORMED_BODY, told)
            table = reader.read_all()
        table.validate()
        if table.num_rows > max_batch:
            raise too_large(max_batch)
        found = {name: _column(table[name], name) for name in table.column_names}
    except (pa.ArrowException, OSError, ValueError) as fault:
        if isinstance(fault, MemoryError):
            raise
        reason = (str(fault).splitlines() or [type(fault).__name__])[0][:200]
        raise RequestError(
            Kind.MALFORMED_BODY, f"the body is not an Arrow stream: {reason}"
        ) from None
    return columns_of(found, max_batch, kind=kind), {}


def _column(column: Any, name: str) -> Any:
    """A column as float64; as a list where it has nulls, with the word rigid for an infinite k."""
    column = column.cast(pa.float64(), safe=False)
    if column.null_count:
        return [
            RIGID if name == "k" and value == math.inf else value for value in column.to_pylist()
        ]
    return column.to_numpy()


def _is_compressed(metadata: Any) -> bool:
    """Whether a record batch states compressed buffers: member 3 of RecordBatch, which is member 2
    of Message.

    A compressed buffer states its unpacked length, so that a small body could fill the memory;
    pyarrow has no option that refuses one.  A table of flatbuffers begins with the distance back to
    the list of its members, which begins with its own size and that of the table; a member stands
    at its distance from the table, 0 if it is absent.
    """

    def member(table: int, index: int) -> int:
        members = table - unpack_from("<i", metadata, table)[0]
        if unpack_from("<H", metadata, members)[0] < 6 + 2 * index:
            return 0
        distance: int = unpack_from("<H", metadata, members + 4 + 2 * index)[0]
        return distance and table + distance

    try:
        header = member(unpack_from("<I", metadata)[0], 2)
        return header == 0 or member(header + unpack_from("<I", metadata, header)[0], 3) != 0
    except error:
        return True


def _write(batch: Batch) -> Iterator[bytes]:
    sink, signature = io.BytesIO(), batch.table.signature
    writer: Any = None
    for found, source, faults in batch.slices(_SLICE):
        arrays = {part.path: _array(part, found[part.path], source) for part in batch.wanted.parts}
        made = pa.record_batch({**arrays, "error": pa.array(faults, pa.string())})
        if writer is None:
            label = {
                name: value if isinstance(value, str) else dump(value)
                for name, value in signature.items()
            }
            writer = pa.ipc.new_stream(sink, made.schema.with_metadata(label))
        writer.write_batch(made)
        yield sink.getvalue()
        sink.seek(0)
        sink.truncate()
    writer.close()
    yield sink.getvalue()


def _array(part: Part, column: Any, source: Any) -> Any:
    """A column.  Regime and source are dictionaries: one byte per case."""
    if not part.names:
        return pa.array(column, mask=np.isnan(column))
    names = list(dict.fromkeys(part.names))
    codes = np.array([names.index(name) for name in part.names], np.int8)[column]
    return pa.DictionaryArray.from_arrays(pa.array(codes, mask=source < 0), names)


FORM = Form(
    "application/vnd.apache.arrow.stream",
    (),
    _read,
    _write,
    body=text_form(
        "Arrow IPC stream, uncompressed, number columns mu0, Fz, k, y0, omega or f, v0; k_low and "
        "k_high in place of k, Fz_amplitude in place of y0 for direction normal; infinity in k is "
        "rigid contact, null is refused",
        format="binary",
    ),
    answer=text_form(
        "Arrow IPC stream, order kept: mu_macro, mu_ratio, regime, error_bound, source, what "
        "include adds (such as power.saved), error; a bad case has null results and a text in "
        "error; the table and the version are in the schema's metadata",
        format="binary",
    ),
)

"""Arrow streams in and out, without copies of the columns and without text.  Needs pyarrow."""

import io
import math
from collections.abc import Iterator, Mapping
from struct import error, unpack_from
from typing import Any

import numpy as np
import pyarrow as pa

from mumacro.contact import Kind as ContactKind
from mumacro.inputs import RIGID

from ..case import Columns, asked_of, columns_of, faults_in, joined, names_of, stranger, too_large
from ..options import kind_in
from ..problems import FieldFault, Kind, RequestError, refuse
from . import Batch, Form
from .json import dump

__all__ = ["FORM"]

_SLICE = 32768  # cases of a record batch of the answer


def _read(text: bytearray, max_batch: int, query: Mapping[str, Any]) -> tuple[Columns, dict[str, Any]]:
    kind = kind_in(query)
    parts: dict[str, list[Any]] = {}
    size = 0
    try:
        buffer = pa.py_buffer(text)
        with pa.ipc.open_stream(buffer) as reader:
            _check(reader.schema, kind)
            parts = {name: [np.empty(0)] for name in reader.schema.names}
            if any(
                message.type == "record batch" and _is_compressed(message.metadata)
                for message in pa.ipc.MessageReader.open_stream(buffer)
            ):
                raise RequestError(Kind.MALFORMED_BODY, "the body is a compressed Arrow stream: send it uncompressed")
            for batch in reader:
                batch.validate()
                size += batch.num_rows
                if size > max_batch:
                    raise too_large(max_batch)
                for name, found in parts.items():
                    found.append(_column(batch.column(name), name))
    except (pa.ArrowInvalid, pa.ArrowTypeError, pa.ArrowNotImplementedError, OSError, ValueError) as fault:
        reason = (str(fault).splitlines() or [type(fault).__name__])[0][:200]
        raise RequestError(Kind.MALFORMED_BODY, f"the body is not an Arrow stream: {reason}") from None
    return columns_of({name: joined(name, found) for name, found in parts.items()}, max_batch, kind=kind), {}


def _check(schema: Any, contact: ContactKind) -> None:
    faults, names = [], schema.names
    asked = asked_of(names, contact)
    known = names_of(asked)
    for name in sorted(set(names)):
        kind = schema.field(name).type if names.count(name) == 1 else None
        if name not in known:
            faults.append(FieldFault.of(name, stranger(name, asked, known)))
        elif kind is None:
            faults.append(FieldFault.of(name, "is given more than once"))
        elif not (pa.types.is_floating(kind) or pa.types.is_integer(kind)):
            faults.append(FieldFault.of(name, f"must be a column of numbers, not of {str(kind)[:80]}"))
    faults += faults_in(names, asked=asked)
    if faults:
        refuse(faults)


def _column(column: Any, name: str) -> Any:
    """A column as float64; as a list where it has nulls, with the word rigid for an infinite k."""
    if column.type != pa.float64():
        column = column.cast(pa.float64(), safe=False)
    if column.null_count:
        return [RIGID if name == "k" and value == math.inf else value for value in column.to_pylist()]
    return column.to_numpy()


def _is_compressed(metadata: Any) -> bool:
    """Whether a record batch states compressed buffers: member 3 of RecordBatch, which is member 2 of Message.

    A compressed buffer states its unpacked length, so that a small body could fill the memory; pyarrow has no option
    that refuses one.  A table of flatbuffers begins with the distance back to the list of its members, which begins
    with its own size and that of the table; a member stands at its distance from the table, 0 if it is absent.
    """
    text = memoryview(metadata)

    def member(table: int, index: int) -> int:
        (back,) = unpack_from("<i", text, table)
        (size,) = unpack_from("<H", text, table - back)
        distance = unpack_from("<H", text, table - back + 4 + 2 * index)[0] if size >= 6 + 2 * index else 0
        return table + int(distance) if distance else 0

    try:
        header = member(unpack_from("<I", text, 0)[0], 2)
        return header == 0 or member(header + unpack_from("<I", text, header)[0], 3) != 0
    except error:
        return True


def _write(batch: Batch) -> Iterator[bytes]:
    sink, writer = io.BytesIO(), None
    for start, found, source in batch.slices(_SLICE):
        made = _record(batch, found, source, batch.texts(start, source))
        if writer is None:
            label = {
                key: value if isinstance(value, str) else dump(value) for key, value in batch.table.signature.items()
            }
            writer = pa.ipc.new_stream(sink, made.schema.with_metadata(label))
        writer.write_batch(made)
        yield sink.getvalue()
        sink.seek(0)
        sink.truncate()
    if writer is not None:
        writer.close()
    yield sink.getvalue()


def _record(batch: Batch, found: Any, source: Any, texts: list[str | None]) -> Any:
    """One record batch.  Regime and source are dictionaries: one byte per case."""
    bad = source < 0
    arrays = {}
    for part in batch.parts:
        column = found[part.path]
        if part.names:
            names = list(dict.fromkeys(part.names))
            codes = np.array([names.index(name) for name in part.names], np.int8)[column]
            arrays[part.path] = pa.DictionaryArray.from_arrays(pa.array(codes, mask=bad), names)
        else:
            arrays[part.path] = pa.array(column, mask=np.isnan(column))
    arrays["error"] = pa.array(texts, pa.string())
    return pa.record_batch(arrays)


FORM = Form(
    "application/vnd.apache.arrow.stream",
    (),
    _read,
    _write,
    body={
        "schema": {
            "type": "string",
            "format": "binary",
            "description": "Arrow IPC stream, uncompressed, number columns mu0, Fz, k, y0, omega or f, v0; k_low and "
            "k_high in place of k, Fz_amplitude in place of y0 for direction normal; infinity in k "
            "is rigid contact, null is refused",
        }
    },
    answer={
        "schema": {
            "type": "string",
            "format": "binary",
            "description": "Arrow IPC stream, order kept: mu_macro, mu_ratio, regime, error_bound, source, what "
            "include adds (such as power.saved), error; a bad case has null results and a text in error; the "
            "table and the version are in the schema's metadata",
        }
    },
)

"""Arrow streams in and out, without copies of the columns and without text.  Needs pyarrow."""

import io
import math
from collections.abc import Iterator
from struct import error, unpack_from
from typing import Any

import numpy as np
import pyarrow as pa

from mumacro.inputs.fields import RIGID

from ..batch import Batch, Body, Form, text_form, too_large
from ..included import REGIME_OF, SOURCES
from ..models.inputs import INPUTS
from ..models.options import BatchOptions
from ..problems import FieldFault, ProblemKind, RequestError, refuse
from ..reading import dump

_SLICE = 32768  # cases of a record batch of the answer
_NAMES = {"regime": REGIME_OF, "source": SOURCES}


def _read(text: bytearray, max_batch: int, _options: BatchOptions) -> Body:
    try:
        buffer = pa.py_buffer(text)
        with pa.ipc.open_stream(buffer) as reader:
            faults = [
                FieldFault.of(
                    column.name, f"must be a column of numbers, not of {str(column.type)[:80]}"
                )
                for column in reader.schema
                if column.name in INPUTS and not _is_readable(column)
            ]
            if faults := [*faults, *twice(reader.schema.names)]:
                refuse(faults)
            for message in pa.ipc.MessageReader.open_stream(buffer):
                if message.type == "record batch" and _is_compressed(message.metadata):
                    detail = "the body is a compressed Arrow stream: send it uncompressed"
                    raise RequestError(ProblemKind.MALFORMED_BODY, detail)
            table = reader.read_all()
        table.validate()
        if table.num_rows > max_batch:
            raise too_large(max_batch)
        return Body({name: _column(table[name], name) for name in table.column_names})
    except (pa.ArrowException, OSError, ValueError) as fault:
        if isinstance(fault, MemoryError):
            raise
        reason = (str(fault).splitlines() or [type(fault).__name__])[0][:200]
        raise RequestError(
            ProblemKind.MALFORMED_BODY, f"the body is not an Arrow stream: {reason}"
        ) from None


def twice(names: list[str]) -> list[FieldFault]:
    """The faults of columns that a table has more than once."""
    return [
        FieldFault.of(name, "is given more than once")
        for name in dict.fromkeys(names)
        if names.count(name) > 1
    ]


def _is_text(arrow_type: Any) -> bool:
    """Whether a column is of plain text.  Not of views or dictionaries, in which a small body can
    repeat a long text many times."""
    return arrow_type in (pa.string(), pa.large_string())


def _is_readable(column: Any) -> bool:
    """Whether a column of an input has numbers or, for k, the word rigid."""
    is_number = pa.types.is_floating(column.type) or pa.types.is_integer(column.type)
    return is_number or (column.name == "k" and _is_text(column.type))


def _column(column: Any, name: str) -> Any:
    """A column as float64; as a list where it has nulls, with the word rigid for an infinite k;
    texts in k as they are."""
    if name not in INPUTS:  # which the model refuses by its name
        return []
    if _is_text(column.type):
        column.validate(full=True)  # texts that overlap would fill the memory
        return column.to_pylist()
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


def record_batches(batch: Batch, step: int) -> Iterator[Any]:
    """The answers as record batches, with the reasons in the last column."""
    for outputs, codes, reasons in batch.slices(step):
        arrays = {path: _array(path, column, codes) for path, column in outputs.items()}
        yield pa.record_batch({**arrays, "error": pa.array(reasons, pa.string())})


def _array(path: str, column: Any, codes: Any) -> Any:
    """A column.  Regime and source are dictionaries: one byte per case."""
    if path not in _NAMES:
        return pa.array(column, mask=np.isnan(column))
    names = list(dict.fromkeys(_NAMES[path]))
    places = np.array([names.index(name) for name in _NAMES[path]], np.int8)[codes]
    return pa.DictionaryArray.from_arrays(pa.array(places, mask=codes < 0), names)


def _write(batch: Batch) -> Iterator[bytes]:
    sink, writer = io.BytesIO(), None
    label = {
        name: value if isinstance(value, str) else dump(value)
        for name, value in batch.table.signature.items()
    }
    for record_batch in record_batches(batch, _SLICE):
        if writer is None:
            writer = pa.ipc.new_stream(sink, record_batch.schema.with_metadata(label))
        writer.write_batch(record_batch)
        yield sink.getvalue()
        sink.seek(0)
        sink.truncate()
    if writer is not None:
        writer.close()
    yield sink.getvalue()


FORM = Form(
    "application/vnd.apache.arrow.stream",
    (),
    _read,
    _write,
    body=text_form(
        "Arrow IPC stream, uncompressed, number columns mu0, Fz, k, y0, omega or f, v0; k_low and "
        "k_high in place of k, Fz_amplitude in place of y0 for direction normal; infinity in k is "
        "rigid contact, in a text column k the word rigid is; null is refused",
        format="binary",
    ),
    answer=text_form(
        "Arrow IPC stream, order kept: mu_macro, mu_ratio, regime, error_bound, source, what "
        "include adds (such as power.saved), error; a bad case has null results and a text in "
        "error; the table and the version are in the schema's metadata",
        format="binary",
    ),
)

"""Arrow streams in and out, without copies of the columns and without text.  Needs pyarrow."""

from collections.abc import Iterator, Mapping
from struct import error, unpack_from
from typing import Any, ClassVar

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from ..errors import FieldFault, MalformedBodyError, missing_inputs, refusal
from ..evaluation import MAX_ERRORS, Answers, Batch, Reason, angular_frequency
from ..hints import unknown_name
from ..kernel import FIELDS, INPUTS, REGIME_NAMES, REGIMES, SOURCES
from . import register, too_large
from .columns import dump, is_bool

__all__: list[str] = []

_SLICE = 65536  # cases of a record batch of the answer
_REGIME_CODES = np.array([REGIMES.index(name) for name in REGIME_NAMES], dtype=np.int8)


class Arrow:
    """The format."""

    name, media_type, streams = "arrow", "application/vnd.apache.arrow.stream", False
    aliases: tuple[str, ...] = ()
    body: ClassVar[dict[str, Any]] = {
        "schema": {
            "type": "string",
            "format": "binary",
            "description": "Arrow IPC stream, uncompressed, number columns mu0, Fz, k, y0, omega or f, v0; null or "
            "infinity in k is rigid contact",
        }
    }
    answer: ClassVar[dict[str, Any]] = {
        "schema": {
            "type": "string",
            "format": "binary",
            "description": "Arrow IPC stream, order kept: mu_macro, mu_ratio, regime, error_bound, source, what "
            "include adds (such as power.saved), error; a bad case has null results and a text in error; the "
            "table and the version are in the schema's metadata",
        }
    }

    def matches(self, text: memoryview) -> bool:
        """Always."""
        del text
        return True

    def read(self, text: bytearray, max_batch: int) -> tuple[Batch, dict[str, Any]]:
        """See :class:`Format`."""
        schema, batches = _read(text, max_batch)
        _check(schema)
        reasons: dict[int, Reason] = {}
        parts: dict[str, list[NDArray[np.float64]]] = {name: [] for name in schema.names}
        size = 0
        for batch in batches:
            for name in schema.names:
                parts[name].append(_column(batch, name, size, reasons))
            size += batch.num_rows
        columns = {
            name: found[0] if len(found) == 1 else np.concatenate(found) if found else np.empty(0)
            for name, found in parts.items()
        }
        if "f" in columns:
            columns["omega"] = angular_frequency(columns["f"], reasons)
        return Batch(size, [columns[name] for name in FIELDS], reasons), {}

    def write(self, answers: Answers, label: Mapping[str, Any]) -> Iterator[bytes]:
        """See :class:`Format`."""
        sink = _Sink()
        writer: Any = None
        errors = {error["index"]: f"{error['field'] or 'case'}: {error['reason']}" for error in answers.errors}
        for start in range(0, max(answers.size, 1), _SLICE):
            made = _record(answers, slice(start, start + _SLICE), errors)
            if writer is None:
                metadata = {name: value if isinstance(value, str) else dump(value) for name, value in label.items()}
                writer = pa.ipc.new_stream(sink, made.schema.with_metadata(metadata))
            writer.write_batch(made)
            yield sink.taken()
        writer.close()
        yield sink.taken()


class _Sink:
    """A buffer that a stream is written to; it is read piece by piece."""

    closed = False

    def __init__(self) -> None:
        self._pieces: list[Any] = []

    def write(self, piece: Any) -> int:
        """Keep a piece."""
        self._pieces.append(piece)
        return len(piece)

    def flush(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""

    def taken(self) -> bytes:
        """All that was written since the last call."""
        pieces, self._pieces = self._pieces, []
        return b"".join(pieces)


def _read(text: bytearray, max_batch: int) -> tuple[Any, list[Any]]:
    """Schema and record batches.

    A compressed buffer states its unpacked length, which may be false.  So compressed streams are refused by their
    messages' metadata, before anything is unpacked.  Dictionaries and nested columns are refused by the schema.
    """
    batches, size = [], 0
    try:
        buffer = pa.py_buffer(text)
        with pa.ipc.open_stream(buffer) as reader:
            schema = reader.schema
            _check(schema)
            for message in pa.ipc.MessageReader.open_stream(buffer):
                if message.type == "record batch" and _is_compressed(message.metadata):
                    raise MalformedBodyError("the body is a compressed Arrow stream: send it uncompressed")
            while True:
                try:
                    batch = reader.read_next_batch()
                except StopIteration:
                    break
                batch.validate()
                size += batch.num_rows
                if size > max_batch:
                    raise too_large(max_batch)
                batches.append(batch)
    except (pa.ArrowException, OSError, ValueError) as fault:
        raise MalformedBodyError(f"the body is not an Arrow stream: {str(fault).splitlines()[0][:200]}") from None
    return schema, batches


def _is_compressed(metadata: Any) -> bool:
    """Whether a record batch states compressed buffers: member 3 of RecordBatch, which is member 2 of Message.

    The layout of flatbuffers: a table begins with the distance back to its list of members.  The list begins with its
    own size and the size of the table.  Each member is given by its distance from the table, 0 if it is absent.
    """
    text = memoryview(metadata)

    def member(table: int, index: int) -> int:
        (back,) = unpack_from("<i", text, table)
        (size,) = unpack_from("<H", text, table - back)
        if size < 6 + 2 * index:
            return 0
        (distance,) = unpack_from("<H", text, table - back + 4 + 2 * index)
        return table + int(distance) if distance else 0

    try:
        header = member(unpack_from("<I", text, 0)[0], 2)
        return header == 0 or member(header + unpack_from("<I", text, header)[0], 3) != 0
    except error:
        return True


def _check(schema: Any) -> None:
    faults = []
    names = schema.names
    for name in sorted(set(names)):
        if name not in INPUTS:
            faults.append(FieldFault(name, unknown_name(name, INPUTS)))
        elif names.count(name) > 1:
            faults.append(FieldFault(name, "is given more than once"))
        elif not (pa.types.is_floating(schema.field(name).type) or pa.types.is_integer(schema.field(name).type)):
            faults.append(FieldFault(name, f"must be a column of numbers, not of {str(schema.field(name).type)[:80]}"))
    faults += missing_inputs(names, "a column of nulls")
    if faults:
        raise refusal(faults)


def _column(batch: Any, name: str, first: int, reasons: dict[int, Reason]) -> NDArray[np.float64]:
    column = batch.column(name)
    if column.type != pa.float64():
        column = column.cast(pa.float64(), safe=False)
    values: NDArray[np.float64] = column.to_numpy(zero_copy_only=False)
    if column.null_count:
        values = values.copy()
        missing = np.flatnonzero(column.is_null().to_numpy(zero_copy_only=False))
        values[missing] = np.inf if name == "k" else np.nan
        if name != "k":
            for i in missing[:MAX_ERRORS].tolist():
                reasons.setdefault(first + i, (name, "must be a number"))
    return np.ascontiguousarray(values)


def _record(answers: Answers, part: slice, errors: Mapping[int, str]) -> Any:
    """One record batch.  Regime and source are dictionaries: one byte per case."""
    source = answers.source[part]
    bad = source < 0 if answers.n_bad else None
    arrays = {
        "mu_macro": pa.array(answers.mu_macro[part], mask=bad),
        "mu_ratio": pa.array(answers.mu_ratio[part], mask=bad),
        "regime": _names(_REGIME_CODES[source], REGIMES, bad),
        "error_bound": pa.array(answers.error_bound[part], mask=bad),
        "source": _names(source, SOURCES, bad),
    }
    for name, column in answers.extras.items():
        values = column[part]
        lost = np.isnan(values)
        arrays[name] = pa.array(values != 0.0 if is_bool(name) else values, mask=lost)
    texts = sorted(set(errors.values())) or ["bad case"]
    codes = {text: code for code, text in enumerate(texts)}
    told: list[int | None] = [None] * source.size
    for i in np.flatnonzero(source < 0).tolist():
        told[i] = codes[errors.get(part.start + i, texts[0])]
    arrays["error"] = pa.DictionaryArray.from_arrays(pa.array(told, pa.int32()), texts)
    return pa.record_batch(arrays)


def _names(codes: NDArray[np.int8], names: Any, empty: NDArray[np.bool_] | None) -> Any:
    return pa.DictionaryArray.from_arrays(pa.array(codes, mask=empty), list(names))


register(Arrow())

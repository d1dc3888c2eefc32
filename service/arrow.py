"""Arrow streams in and out: the columns are used where they lie, and nothing is turned into text.  Needs pyarrow."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from friction.nondim import BOUNDS, FIELDS
from friction.regions import REGIMES, SOURCES
from friction.surrogate import REGIME_OF_SOURCE
from service import API_VERSION
from service.answers import Answers, Cases, answer_cases
from service.codecs import encode
from service.compiled.block import BOUND_FLAW, MISSING_FLAW, NUMBER_FLAW
from service.compiled.scan import NOT_A_NUMBER
from service.errors import BatchTooLargeError, FieldFault, InvalidFieldsError, MalformedBodyError
from service.intake import Options
from service.shelf import LoadedTable

__all__ = ["answer_arrow"]

Count = Callable[[LoadedTable, Answers], None]

_REASONS = [f"{name}: must be a number" for name in FIELDS] + [f"{name}: must be {BOUNDS[name]}" for name in FIELDS]
_SLICE = 65536  # cases of a record batch of the answer


def answer_arrow(
    body: NDArray[np.uint8], table: LoadedTable, options: Options, max_batch: int, count: Count
) -> Iterator[bytes]:
    """Answer a stream, order kept; what is yielded is a stream again.

    Raises
    ------
    MalformedBodyError, InvalidFieldsError, BatchTooLargeError
        No stream; columns that are missing, unknown or hold no numbers; too many cases.  All of it before the first
        byte is yielded.
    """
    batches, schema = _read(body)
    _check_columns(schema)
    size = sum(batch.num_rows for batch in batches)
    if size > max_batch:
        raise BatchTooLargeError(f"a batch may have up to {max_batch} cases, this one has {size}", max_batch=max_batch)
    if not batches:
        batches = [pa.RecordBatch.from_pylist([], schema=schema)]
    sink = _Sink()
    writer: Any = None
    for batch in batches:
        for start in range(0, max(batch.num_rows, 1), _SLICE):
            answers = answer_cases(table, _cases(batch.slice(start, _SLICE)), options.include, options.std)
            count(table, answers)
            answered = _answer(answers)
            if writer is None:
                label = {"table": encode(table.label), "api_version": API_VERSION}
                writer = pa.ipc.new_stream(sink, answered.schema.with_metadata(label))
            writer.write_batch(answered)
            yield sink.taken()
    writer.close()
    yield sink.taken()


class _Sink:
    """What a stream is written to; gives away what came in."""

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
        """All that came since the last time."""
        pieces, self._pieces = self._pieces, []
        return b"".join(pieces)


def _read(body: NDArray[np.uint8]) -> tuple[list[Any], Any]:
    try:
        with pa.ipc.open_stream(pa.py_buffer(body)) as reader:
            batches = list(reader)
            for batch in batches:
                batch.validate()
            return batches, reader.schema
    except (pa.ArrowException, OSError, ValueError) as error:
        raise MalformedBodyError(f"the body is not an Arrow stream: {str(error).splitlines()[0][:200]}") from None


def _check_columns(schema: Any) -> None:
    faults = []
    for name in sorted(set(schema.names)):
        if name not in FIELDS:
            faults.append(FieldFault(name, f"unknown column; allowed: {', '.join(FIELDS)}"))
        elif schema.names.count(name) > 1:
            faults.append(FieldFault(name, "is given more than once"))
        elif not _is_number(schema.field(name).type):
            faults.append(FieldFault(name, f"must be a column of numbers, not of {schema.field(name).type}"))
    faults += [
        FieldFault(name, "is required", bound=BOUNDS[name])
        for name in FIELDS
        if name != "k" and name not in schema.names
    ]
    if faults:
        raise InvalidFieldsError(f"{faults[0].field}: {faults[0].reason}", faults)


def _is_number(kind: Any) -> bool:
    return bool(pa.types.is_floating(kind) or pa.types.is_integer(kind))


def _cases(batch: Any) -> Cases:
    size = batch.num_rows
    columns = []
    for name in FIELDS:
        if name not in batch.schema.names:
            columns.append(np.full(1, np.inf))  # k alone may be left out
            continue
        column = batch.column(name)
        if column.type != pa.float64():
            column = column.cast(pa.float64(), safe=False)
        values: NDArray[np.float64] = column.to_numpy(zero_copy_only=False)
        if name == "k" or column.null_count:
            values = values.copy()
        if name == "k":
            values[np.isinf(values)] = np.nan  # infinity is what rigid contact is called inside
        if column.null_count:
            missing = column.is_null().to_numpy(zero_copy_only=False)
            values[missing] = np.inf if name == "k" else NOT_A_NUMBER.view(np.float64)
        columns.append(np.ascontiguousarray(values))
    return Cases(size, columns, np.zeros(size, dtype=np.uint8))


def _answer(answers: Answers) -> Any:
    """One record batch.  Regime and source are dictionaries: a byte a case."""
    bad = answers.flaws != 0 if answers.n_bad else None
    source = answers.source
    arrays = {
        "mu_macro": _numbers(answers.mu_macro, bad),
        "mu_ratio": _numbers(answers.mu_ratio, bad),
        "regime": _names(REGIME_OF_SOURCE[source], list(REGIMES), bad),
        "error_bound": _numbers(answers.error_bound, bad),
        "source": _names(source, list(SOURCES), bad),
    }
    for name, group in answers.extras.items():
        if isinstance(group, dict):
            for key, values in group.items():
                arrays[f"{name}.{key}"] = _numbers(values, bad)
        else:
            arrays[name] = _numbers(group, bad)
    arrays["error"] = _names(_reasons(answers), _REASONS, None if bad is None else ~bad, answers.n_bad == 0)
    return pa.record_batch(arrays)


def _numbers(values: NDArray[np.float64], bad: NDArray[np.bool_] | None) -> Any:
    return pa.array(values, mask=bad)


def _names(codes: NDArray[np.int8], names: list[str], empty: NDArray[np.bool_] | None, none: bool = False) -> Any:
    if none:
        return pa.DictionaryArray.from_arrays(pa.nulls(codes.size, pa.int8()), names)
    return pa.DictionaryArray.from_arrays(pa.array(codes, mask=empty), names)


def _reasons(answers: Answers) -> NDArray[np.int8]:
    if answers.n_bad == 0:
        return answers.flaws.view(np.int8)
    flaws = answers.flaws.astype(np.int16)
    first = np.where(
        flaws >= BOUND_FLAW, BOUND_FLAW - len(FIELDS), np.where(flaws >= NUMBER_FLAW, NUMBER_FLAW, MISSING_FLAW)
    )
    return np.maximum(flaws - first, 0).astype(np.int8)

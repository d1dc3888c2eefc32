"""Evaluated batches as Parquet, CSV or NDJSON: parts that get their name when complete, and one file of them."""

from __future__ import annotations

import gzip
import json
import os
import shutil
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet

from mumacro.files.blocks import one_line
from mumacro.files.columns import FilesError
from mumacro.writing import put

__all__ = ["Part", "csv_text", "join_parts", "json_text", "open_part"]

ROWS = 262_144  # of a row group that is written


# --- text ---------------------------------------------------------------------------------------------


def _bytes_of(lines: pa.Array) -> bytes:
    """All the text of an array without nulls, one after the other."""
    lines = pa.concat_arrays([lines])  # a separate array, whose text begins at its first entry
    if len(lines) == 0:
        return b""
    total = pc.sum(pc.binary_length(lines)).as_py()
    return bytes(lines.buffers()[2][:total])


def _as_text(column: pa.Array, name: str) -> tuple[pa.Array, str]:
    """A column as text, null where it is, and what it holds: ``number``, ``text`` or ``json``."""
    kind = column.type
    if pa.types.is_dictionary(kind):
        return _as_text(column.dictionary_decode(), name)
    if pa.types.is_nested(kind):
        texts = [None if value is None else json.dumps(value, default=str) for value in column.to_pylist()]
        return pa.array(texts, pa.large_string()), "json"
    try:
        text = pc.cast(column, pa.large_string())
    except (pa.ArrowInvalid, pa.ArrowNotImplementedError) as error:
        raise FilesError(f"the column {name!r} holds {kind}, which text cannot ({one_line(error)})") from None
    if pa.types.is_floating(kind):
        text = pc.if_else(pc.is_finite(column), text, None)
        return text, "number"
    plain = (
        pa.types.is_integer(kind) or pa.types.is_decimal(kind) or pa.types.is_boolean(kind) or pa.types.is_null(kind)
    )
    return text, "number" if plain else "text"


def _put_together(*parts: Any) -> pa.Array:
    """Text of arrays and constants, element by element; of bytes where one of them holds bytes."""
    binary = any(isinstance(part, pa.Array) and pa.types.is_large_binary(part.type) for part in parts)
    kind = pa.large_binary() if binary else pa.large_string()
    cast = [part.cast(kind) if isinstance(part, pa.Array) else pa.scalar(part, kind) for part in parts]
    return pc.binary_join_element_wise(*cast, pa.scalar("", kind))


def _csv_cell(column: pa.Array, name: str) -> pa.Array:
    text, kind = _as_text(column, name)
    if kind != "number":
        special = pc.match_substring_regex(text, '[",\r\n]')
        if pc.any(special).as_py():
            quoted = _put_together('"', pc.replace_substring(text, '"', '""'), '"')
            text = pc.if_else(special, quoted, text)
    return pc.fill_null(text, "")


def _json_cell(column: pa.Array, name: str) -> pa.Array:
    text, kind = _as_text(column, name)
    if kind == "text":
        text = pc.replace_substring(pc.replace_substring(text, "\\", "\\\\"), '"', '\\"')
        if pc.any(pc.match_substring_regex(text, r"[\x00-\x1f]")).as_py():
            column = column.dictionary_decode() if pa.types.is_dictionary(column.type) else column
            given = pc.cast(column, pa.large_string()).to_pylist()
            text = pa.array([None if v is None else json.dumps(v)[1:-1] for v in given], pa.large_string())
        text = _put_together('"', text, '"')
    return pc.fill_null(text, "null")


def csv_text(names: Sequence[str], columns: Sequence[pa.Array], lines: pa.Array | None) -> bytes:
    """Rows of CSV; with ``lines`` the columns are put behind them."""
    parts: list[Any] = [] if lines is None else [lines]
    for name, column in zip(names, columns, strict=True):
        parts += [","] if parts else []
        parts.append(_csv_cell(column, name))
    return _bytes_of(_put_together(*parts, "\n"))


def json_text(names: Sequence[str], columns: Sequence[pa.Array], lines: pa.Array | None) -> bytes:
    """Lines of NDJSON; with ``lines``, each an object, the columns are put into it at its end."""
    parts: list[Any] = []
    if lines is not None:  # without the brace that closes it
        parts.append(pa.array([line.rstrip()[:-1].rstrip() for line in lines.to_pylist()], pa.large_binary()))
    for name, column in zip(names, columns, strict=True):
        parts += [f"{', ' if parts else '{'}{json.dumps(name)}: ", _json_cell(column, name)]
    return _bytes_of(_put_together(*parts, "}\n"))


# --- parts --------------------------------------------------------------------------------------------


class Part(ABC):
    """A file that has another name until it is complete and on the disk."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.growing = path.with_name(f"{path.name}.{os.getpid()}.growing")

    @abstractmethod
    def write(self, batch: pa.RecordBatch, lines: pa.Array | None, added: int) -> None:
        """Append the rows; the last ``added`` columns are results, the others are in ``lines`` already."""

    @abstractmethod
    def close(self) -> None:
        """Finish the file under the name it grows by."""

    def finish(self) -> None:
        """Bring the file to the disk and give it its name."""
        self.close()
        put(self.growing, self.path)

    def discard(self) -> None:
        """Delete the file; on a full disk, data that cannot be written are dropped."""
        with suppress(OSError, pa.ArrowException):
            self.close()
        self.growing.unlink(missing_ok=True)


class _TextPart(Part):
    def __init__(self, path: Path, kind: str, packed: bool, header: bytes) -> None:
        super().__init__(path)
        self.text = csv_text if kind == "csv" else json_text
        self.file = self.growing.open("wb")
        # without name and time, so that the same text gives the same bytes
        self.stream: Any = gzip.GzipFile("", "wb", 6, self.file, mtime=0) if packed else self.file
        self.stream.write(header)

    def write(self, batch: pa.RecordBatch, lines: pa.Array | None, added: int) -> None:
        first = batch.num_columns - added if lines is not None else 0
        self.stream.write(self.text(batch.schema.names[first:], batch.columns[first:], lines))

    def close(self) -> None:
        self.stream.close()
        self.file.close()


class _ParquetPart(Part):
    def __init__(self, path: Path, schema: pa.Schema) -> None:
        super().__init__(path)
        self.writer = parquet_writer(self.growing, schema)
        self.held: list[pa.RecordBatch] = []

    def write(self, batch: pa.RecordBatch, lines: pa.Array | None, added: int) -> None:  # noqa: ARG002
        self.held.append(batch)
        if sum(held.num_rows for held in self.held) >= ROWS:
            self._flush()

    def _flush(self) -> None:
        if self.held:
            self.writer.write_table(pa.Table.from_batches(self.held).combine_chunks(), row_group_size=2 * ROWS)
            self.held = []

    def close(self) -> None:
        self._flush()
        self.writer.close()


def parquet_writer(path: Path, schema: pa.Schema) -> pa.parquet.ParquetWriter:
    """A Parquet file; doubles are written plainly, which is three times as fast and, mostly different, as small."""
    coded = [field.name for field in schema if not pa.types.is_floating(field.type)]
    return pa.parquet.ParquetWriter(path, schema, use_dictionary=coded, compression="snappy")


def open_part(path: Path, kind: str, packed: bool, schema: pa.Schema, header: bytes) -> Part:
    """A part to write."""
    if kind == "parquet":
        return _ParquetPart(path, schema)
    return _TextPart(path, kind, packed, header)


def join_parts(parts: Sequence[Path], out: Path, kind: str, packed: bool, schema: pa.Schema, header: bytes) -> None:
    """Make one file of the parts; it gets its name when it is whole.  The parts stay."""
    growing = out.with_name(f"{out.name}.{os.getpid()}.growing")
    try:
        if kind == "parquet":
            _join_parquet(parts, growing, schema)
        else:
            with growing.open("wb") as stream:
                stream.write(gzip.compress(header, 6, mtime=0) if packed and header else header)
                for part in parts:
                    with part.open("rb") as source:
                        shutil.copyfileobj(source, stream, 2**20)
        put(growing, out)
    finally:
        growing.unlink(missing_ok=True)


def _join_parquet(parts: Iterable[Path], growing: Path, schema: pa.Schema) -> None:
    with parquet_writer(growing, schema) as writer:
        for part in parts:
            with pa.parquet.ParquetFile(part) as file:
                for i in range(file.num_row_groups):
                    writer.write_table(file.read_row_group(i).cast(schema), row_group_size=2 * ROWS)

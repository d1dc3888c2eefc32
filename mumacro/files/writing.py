"""Evaluated batches as pieces of a file: CSV, NDJSON, or Arrow streams, of which a Parquet file is made at the end."""

from __future__ import annotations

import csv
import gzip
import io
import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet

from mumacro.files.columns import FilesError

__all__ = ["Output", "csv_line", "write_parquet"]

ROWS = 262_144  # of a row group that is written, at least


def csv_line(cells: Iterable[object], sep: str = ",") -> str:
    """One line of CSV."""
    text = io.StringIO(newline="")
    csv.writer(text, delimiter=sep, lineterminator="\n").writerow(cells)
    return text.getvalue()


@dataclass(frozen=True)
class Output:
    """How rows are written: ``csv``, ``ndjson`` or ``parquet``; text ``packed`` (.gz) piece by piece.

    ``sep`` and ``decimal`` are those of CSV; in the column ``stiffness`` infinity is written as ``rigid``.
    """

    kind: str
    packed: bool
    sep: str
    decimal: str
    stiffness: str | None

    def pack(self, text: bytes) -> bytes:
        """A piece of text as it is in the file."""
        # without name and time, so that the same text gives the same bytes
        return gzip.compress(text, 6, mtime=0) if self.packed else text

    def piece(self, batch: pa.RecordBatch, lines: pa.Array | None = None) -> bytes | memoryview:
        """Rows; where ``lines`` holds the records as they came in, the columns are put behind them."""
        if self.kind == "parquet":
            sink = pa.BufferOutputStream()
            with pa.ipc.new_stream(sink, batch.schema) as writer:
                writer.write_batch(batch)
            return memoryview(sink.getvalue())
        cells: list[Any] = [] if lines is None else [lines]
        if lines is not None and self.kind == "ndjson":  # without the brace that closes it
            cells = [pa.array([line.rstrip()[:-1].rstrip() for line in lines.to_pylist()], pa.large_binary())]
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            if self.kind == "csv":
                cells += [self.sep] if cells else []
            else:
                cells += [f"{', ' if cells else '{'}{json.dumps(name)}: "]
            cells += [pc.fill_null(self._cell(name, column), "" if self.kind == "csv" else "null")]
        return self.pack(_bytes_of(_joined(*cells, "\n" if self.kind == "csv" else "}\n")))

    def _cell(self, name: str, column: pa.Array) -> pa.Array:
        """A column as cells of text, null where it is."""
        kind = column.type
        if pa.types.is_dictionary(kind):
            return self._cell(name, column.dictionary).take(column.indices)
        text = self._text(name, column)
        if self.kind == "ndjson":
            if pa.types.is_nested(kind) or (pa.types.is_primitive(kind) and not pa.types.is_temporal(kind)):
                return text
            cells = [None if cell is None else json.dumps(cell) for cell in text.to_pylist()]
            return pa.array(cells, pa.large_string())
        if pa.types.is_floating(kind) or pa.types.is_decimal(kind):
            return text if self.decimal == "." else pc.replace_substring(text, ".", self.decimal)
        special = pc.match_substring_regex(text, f'[{self.sep}"\r\n]')
        if pc.any(special).as_py():
            text = pc.if_else(special, _joined('"', pc.replace_substring(text, '"', '""'), '"'), text)
        return text

    def _text(self, name: str, column: pa.Array) -> pa.Array:
        kind = column.type
        if pa.types.is_nested(kind):
            texts = [None if value is None else json.dumps(value, default=str) for value in column.to_pylist()]
            return pa.array(texts, pa.large_string())
        try:
            text = pc.cast(column, pa.large_string())
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError) as error:
            raise FilesError(f"the column {name!r} holds {kind}, which text cannot ({error})") from None
        if pa.types.is_floating(kind):
            rigid = '"rigid"' if self.kind == "ndjson" else "rigid"
            infinite = pc.if_else(pc.is_inf(column), rigid if name == self.stiffness else None, None)
            text = pc.if_else(pc.is_finite(column), text, infinite)
        return text


def _joined(*parts: Any) -> pa.Array:
    """Text of arrays and constants, element by element; of bytes where one of them holds bytes."""
    binary = any(isinstance(part, pa.Array) and pa.types.is_large_binary(part.type) for part in parts)
    kind = pa.large_binary() if binary else pa.large_string()
    cast = [part.cast(kind) if isinstance(part, pa.Array) else pa.scalar(part, kind) for part in parts]
    return pc.binary_join_element_wise(*cast, pa.scalar("", kind))


def _bytes_of(lines: pa.Array) -> bytes:
    """All the text of an array without nulls, one after the other."""
    lines = pa.concat_arrays([lines])  # a separate array, whose text begins at its first entry
    total = pc.sum(pc.binary_length(lines)).as_py()
    return bytes(lines.buffers()[2][:total]) if total else b""


def write_parquet(path: Path, schema: pa.Schema, pieces: Iterable[bytes]) -> None:
    """One Parquet file of the pieces; doubles are written plainly, which is three times as fast."""
    coded = [field.name for field in schema if not pa.types.is_floating(field.type)]
    with pa.parquet.ParquetWriter(path, schema, use_dictionary=coded, compression="snappy") as writer:
        held: list[pa.RecordBatch] = []
        for piece in pieces:
            held += pa.ipc.open_stream(piece)
            if sum(batch.num_rows for batch in held) >= ROWS:
                writer.write_table(pa.Table.from_batches(held).combine_chunks(), row_group_size=2 * ROWS)
                held = []
        if held:
            writer.write_table(pa.Table.from_batches(held).combine_chunks(), row_group_size=2 * ROWS)

"""Evaluated batches as pieces of a file: tables as text, or Parquet."""

import csv
import gzip
import io
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, BinaryIO, NamedTuple

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet

from mumacro.inputs.layout import BLANKS, Dialect


def csv_lines(rows: Iterable[Iterable[object]], sep: str = ",") -> str:
    """Lines of CSV."""
    text = io.StringIO(newline="")
    csv.writer(text, delimiter=sep, lineterminator="\n").writerows(rows)
    return text.getvalue()


def written_as(ending: str, sep: str, decimal: str, dialect: Dialect) -> tuple[str, str]:
    """Separator and decimal sign of an output as text: those that are given, else those of the
    input, ``sep`` and ``decimal``, where the ending fits."""
    sep, decimal = dialect.sep or sep, dialect.decimal or decimal
    if ending == ".tsv" or sep == BLANKS or (ending == ".txt" and not sep):
        sep = "\t"
    elif ending == ".csv" and not dialect.sep and sep in ("", "\t"):
        sep = ";" if decimal == "," else ","
    return sep or ",", decimal


class Output(NamedTuple):
    """How rows are written: ``text`` or ``parquet``; text piece by piece, ``is_compressed`` as .gz.

    ``sep`` and ``decimal`` are those of a table as text; in the column ``stiffness`` infinity is
    written as ``rigid``.
    """

    format: str
    is_compressed: bool
    sep: str
    decimal: str
    stiffness: str | None

    def pack(self, text: str) -> bytes:
        """A piece of text as it is in the file."""
        data = text.encode("utf-8", "surrogateescape")
        # without name and time, so that the same text gives the same bytes
        return gzip.compress(data, 6, mtime=0) if self.is_compressed else data

    def piece(self, batch: pa.RecordBatch, texts: Sequence[Any] | None = None) -> Any:
        """Rows as they are written, for Parquet the batch itself; where ``texts`` has the unchanged
        input records, the columns stand behind them."""
        if self.format == "parquet":
            return batch
        if isinstance(texts, pa.Array):
            return self.pack(self._joined(texts, batch))
        cells = [
            self._cells(name, column)
            for name, column in zip(batch.schema.names, batch.columns, strict=True)
        ]
        return self.pack(csv_lines(zip(*cells, strict=True), self.sep))

    def _joined(self, lines: pa.Array, batch: pa.RecordBatch) -> str:
        """Lines as they came in, with the columns behind them."""
        columns = [self._texts(name, batch.column(name)) for name in batch.schema.names]
        if self.sep == self.decimal:
            columns = [
                pc.if_else(
                    pc.match_substring(column, self.sep),
                    pc.binary_join_element_wise('"', column, '"', ""),
                    column,
                )
                for column in columns
            ]
        last = pc.binary_join_element_wise(columns.pop(), "\n", "")
        rows = pc.binary_join_element_wise(lines, *columns, last, self.sep)
        return "".join(rows.to_pylist())

    def _texts(self, name: str, column: pa.Array) -> pa.Array:
        """A column as texts, nothing where it is null."""
        if pa.types.is_dictionary(column.type):
            column = column.dictionary_decode()
        text = pc.cast(column, pa.string())
        if pa.types.is_floating(column.type):
            rigid = "rigid" if name == self.stiffness else None
            text = pc.if_else(
                pc.is_finite(column), text, pc.if_else(pc.is_inf(column), rigid, None)
            )
            if self.decimal != ".":
                text = pc.replace_substring(text, ".", self.decimal)
        return pc.fill_null(text, "")

    def _cells(self, name: str, column: pa.Array) -> list[str | None]:
        """A column as cells of text."""
        arrow_type = column.type
        if pa.types.is_dictionary(arrow_type):
            words = [*self._cells(name, column.dictionary), None]
            return [words[i] for i in pc.fill_null(column.indices, len(words) - 1).to_pylist()]
        if pa.types.is_nested(arrow_type):
            return [json.dumps(value, default=str) for value in column.to_pylist()]
        text = pc.cast(column, pa.string())
        if pa.types.is_floating(arrow_type):
            rigid = "rigid" if name == self.stiffness else None
            text = pc.if_else(
                pc.is_finite(column), text, pc.if_else(pc.is_inf(column), rigid, None)
            )
        is_real = pa.types.is_floating(arrow_type) or pa.types.is_decimal(arrow_type)
        return list(
            (pc.replace_substring(text, ".", self.decimal) if is_real else text).to_pylist()
        )

    @contextmanager
    def writing(self, stream: BinaryIO, schema: pa.Schema) -> Iterator[Callable[[Any], object]]:
        """What writes a piece; doubles in Parquet are written plainly, which is three times as
        fast."""
        if self.format != "parquet":
            yield stream.write
            return
        words = [field.name for field in schema if not pa.types.is_floating(field.type)]
        with pa.parquet.ParquetWriter(
            stream, schema, use_dictionary=words, compression="snappy"
        ) as writer:
            yield writer.write_batch

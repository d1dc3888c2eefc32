"""Write evaluated batches as pieces of a file: tables as text, or Parquet."""

import gzip
import json
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO, NamedTuple

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet

from mumacro.inputs.cells import BLANKS, joined
from mumacro.inputs.layout import Dialect


def csv_lines(rows: Iterable[Iterable[object]], sep: str = ",") -> str:
    """Return rows as lines of text."""
    return "".join(f"{joined(row, sep)}\n" for row in rows)


def written_as(ending: str, sep: str, decimal: str, dialect: Dialect) -> tuple[str, str]:
    """Return the separator and the decimal separator of an output as text: the ones in ``dialect``,
    otherwise those of the input, ``sep`` and ``decimal``, if the extension fits."""
    sep, decimal = dialect.sep or sep, dialect.decimal or decimal
    if ending == ".tsv" or sep == BLANKS or (ending == ".txt" and not sep):
        sep = "\t"
    elif ending == ".csv" and not dialect.sep and sep in ("", "\t"):
        sep = ";" if decimal == "," else ","
    return sep or ",", decimal


class OutputFormat(NamedTuple):
    """Describe how rows are written: as Parquet, or as text, piece by piece, as .gz if
    ``is_compressed``.

    ``sep`` and ``decimal`` are the separators of a table as text.  In the column ``stiffness``
    infinity is written as ``rigid``.
    """

    is_parquet: bool
    is_compressed: bool
    sep: str
    decimal: str
    stiffness: str | None

    def pack(self, text: str) -> bytes:
        """Return a piece of text as the file has it."""
        data = text.encode("utf-8", "surrogateescape")
        # without name and time, so that the same text gives the same bytes
        return gzip.compress(data, 6, mtime=0) if self.is_compressed else data

    def piece(self, batch: pa.RecordBatch, lines: pa.Array | None = None) -> Any:
        """Return rows as they are written; for Parquet the batch itself.  The columns are written
        after ``lines``, if there are any."""
        if self.is_parquet:
            return batch
        columns = [*map(self._cells, batch.schema.names, batch.columns)]
        last = pc.binary_join_element_wise(columns.pop(), "\n", "")
        columns = columns if lines is None else [lines, *columns]
        rows = pc.binary_join_element_wise(*columns, last, self.sep)
        return self.pack("".join(rows.to_pylist()))

    def _cells(self, name: str, column: pa.Array) -> pa.Array:
        """Return a column as cells of text; a null is an empty cell."""
        if pa.types.is_dictionary(column.type):
            column = column.dictionary_decode()
        if pa.types.is_nested(column.type):
            column = pa.array([json.dumps(value, default=str) for value in column.to_pylist()])
        text = pc.cast(column, pa.string())
        is_number = pa.types.is_floating(column.type) or pa.types.is_decimal(column.type)
        if pa.types.is_floating(column.type):
            rigid = "rigid" if name == self.stiffness else None
            text = pc.if_else(
                pc.is_finite(column), text, pc.if_else(pc.is_inf(column), rigid, None)
            )
        if is_number and self.decimal != ".":
            text = pc.replace_substring(text, ".", self.decimal)
        text = pc.fill_null(text, "")
        if is_number and self.sep != self.decimal:
            return text
        needs_quotes = pc.match_substring_regex(text, f'[{re.escape(self.sep)}"\r\n]')
        if not pc.any(needs_quotes).as_py():
            return text
        doubled = pc.replace_substring(text, '"', '""')
        return pc.if_else(needs_quotes, pc.binary_join_element_wise('"', doubled, '"', ""), text)

    @contextmanager
    def writing(self, stream: BinaryIO, schema: pa.Schema) -> Iterator[Callable[[Any], object]]:
        """Yield the function that writes a piece.  Doubles in Parquet are written plainly, which is
        three times as fast."""
        if not self.is_parquet:
            yield stream.write
            return
        words = [field.name for field in schema if not pa.types.is_floating(field.type)]
        with pa.parquet.ParquetWriter(
            stream, schema, use_dictionary=words, compression="snappy"
        ) as writer:
            yield writer.write_batch

"""The three formats: which columns there are, of which type, and the blocks from a place on."""

from __future__ import annotations

import io
import json
import math
import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute
import pyarrow.csv
import pyarrow.dataset
import pyarrow.json
import pyarrow.parquet

from mumacro.files.blocks import (
    Block,
    Fault,
    Place,
    Records,
    decoding_fault,
    header_of,
    one_line,
    records_of,
    shorten,
)
from mumacro.files.columns import Columns, FilesError
from mumacro.inputs import NAMES, is_rigid, split_unit

__all__ = ["FORMATS", "Source", "format_of", "open_source"]

FORMATS = {".parquet": "parquet", ".csv": "csv", ".ndjson": "ndjson", ".jsonl": "ndjson"}
ROWS = 262_144  # of a Parquet batch
BYTES = 8 * 2**20  # of a text block
_PACKED = (".csv.gz", ".ndjson.gz", ".jsonl.gz")


def format_of(path: Path) -> tuple[str, bool] | None:
    """The format by a name's ending, and whether it is compressed; None for another ending."""
    name = path.name.lower()
    packed = name.endswith(_PACKED)
    found = FORMATS.get(Path(name.removesuffix(".gz")).suffix if packed else Path(name).suffix)
    return None if found is None else (found, packed)


class Source(ABC):
    """Files of one format, one after the other.

    Attributes
    ----------
    names : list of str
        The headings.
    schema : pyarrow.Schema
        The columns of the blocks.
    cells_are_text : bool
        Inputs are read as text, since any cell may hold no number.
    """

    names: list[str]
    schema: pa.Schema
    cells_are_text = False

    def __init__(self, files: Sequence[Path]) -> None:
        self.files = list(files)
        self.sizes = [max(path.stat().st_size, 1) for path in files]

    @abstractmethod
    def settle(self, columns: Columns, verbatim: bool, part_rows: int) -> None:
        """Fix :attr:`schema`, now that the inputs are known; ``verbatim``: the records come out as they are."""

    @abstractmethod
    def blocks(self, place: Place) -> Iterator[Block]:
        """The blocks of the file at ``place`` from there on."""

    def share(self, place: Place, part: float) -> float:
        """How much of all files lies before ``part`` of the file at ``place``."""
        return (sum(self.sizes[: place.file]) + part * self.sizes[place.file]) / sum(self.sizes)

    def done(self, place: Place) -> float:
        """How much of all files lies before ``place``."""
        if place.file >= len(self.files):
            return 1.0
        packed = 3.0 if self.files[place.file].suffix == ".gz" else 1.0  # a guess, for the progress bar only
        return self.share(place, min(place.at / (packed * self.sizes[place.file]), 1.0))


def open_source(files: Sequence[Path], kind: str, folder: Path | None) -> Source:
    """The cases of files of one format; ``folder`` is where they were found, if that was all that was named."""
    if kind == "parquet":
        return ParquetSource(files, folder)
    return CsvSource(files) if kind == "csv" else NdjsonSource(files)


class ParquetSource(Source):
    """Parquet; folders named ``key=value`` give columns, as in Hive."""

    def __init__(self, files: Sequence[Path], folder: Path | None) -> None:
        super().__init__(files)
        self.constants: list[dict[str, Any]] = [{} for _ in files]
        self.counts: list[int] = []
        schemas = []
        for path in files:
            try:
                with pa.parquet.ParquetFile(path) as file:
                    schemas.append(file.schema_arrow)
                    self.counts.append(file.metadata.num_rows)
            except (pa.ArrowException, OSError) as error:
                raise FilesError(f"{path}: not a readable Parquet file ({one_line(error)})") from None
        self.schema = schemas[0]
        for path, schema in zip(files, schemas, strict=True):
            try:
                self.schema = pa.unify_schemas([self.schema, schema.remove_metadata()], promote_options="permissive")
            except (pa.ArrowInvalid, pa.ArrowTypeError) as error:
                raise FilesError(f"{path}: its columns do not fit those of {files[0]}: {one_line(error)}") from None
        if folder is not None:
            self._read_folder_names(folder)
        self.names = self.schema.names

    def _read_folder_names(self, folder: Path) -> None:
        hive = pa.dataset.partitioning(flavor="hive")
        names = [str(path) for path in self.files]
        found = pa.dataset.dataset(names, format="parquet", partitioning=hive, partition_base_dir=str(folder))
        keys = {str(Path(f.path)): pa.dataset.get_partition_keys(f.partition_expression) for f in found.get_fragments()}
        self.constants = [keys[str(path)] for path in self.files]
        for name in sorted({name for entry in self.constants for name in entry} - set(self.schema.names)):
            self.schema = self.schema.append(found.schema.field(name))

    def settle(self, columns: Columns, verbatim: bool, part_rows: int) -> None:  # noqa: ARG002
        """Fix the size of a batch; the schema is known."""
        self.rows = max(1, min(ROWS, part_rows))

    def done(self, place: Place) -> float:
        """How much of all files lies before ``place``."""
        if place.file >= len(self.files):
            return 1.0
        return self.share(place, place.at / max(self.counts[place.file], 1))

    def blocks(self, place: Place) -> Iterator[Block]:
        """The blocks of a file from a place on."""
        path = self.files[place.file]
        before = 0
        with pa.parquet.ParquetFile(path, pre_buffer=False) as file:
            try:
                # Group by group: batches then begin at the same rows from wherever a run continues.
                for i in range(file.num_row_groups):
                    rows = file.metadata.row_group(i).num_rows
                    if before + rows <= place.at:
                        before += rows
                        continue
                    for batch in file.iter_batches(self.rows, row_groups=[i]):
                        before += batch.num_rows
                        if before > place.at:
                            yield self._block(batch, place.file, before)
            except (pa.ArrowException, OSError) as error:
                raise FilesError(f"{path}: damaged after row {before} ({one_line(error)})") from None

    def _block(self, batch: pa.RecordBatch, file: int, end: int) -> Block:
        first = end - batch.num_rows
        arrays = []
        for field in self.schema:
            if field.name in batch.schema.names:
                column = batch.column(field.name)
                arrays.append(column if column.type == field.type else column.cast(field.type))
            else:
                value = self.constants[file].get(field.name)
                arrays.append(pa.repeat(pa.scalar(value, field.type), batch.num_rows))
        whole = pa.RecordBatch.from_arrays(arrays, schema=self.schema)
        return Block(whole, np.arange(first + 1, end + 1), Place(file, end, end))


class _TextSource(Source):
    """What CSV and NDJSON share.  Types are settled by one pass over all files, unless records come out verbatim."""

    quotes: bool

    def settle(self, columns: Columns, verbatim: bool, part_rows: int) -> None:
        """Fix the schema, now that the inputs are known."""
        self.columns, self.verbatim = columns, verbatim
        self.inputs = [column for column, _ in columns.places.values()]
        self.bytes = max(2**14, min(BYTES, 64 * part_rows))
        self.schema = pa.schema([]) if verbatim else self._types()

    def _types(self) -> pa.Schema:
        found: pa.Schema | None = None
        for i, path in enumerate(self.files):
            for records in records_of(path, self.start(i), self.bytes, self.quotes):
                schema = self.inferred(path, records)
                try:
                    found = schema if found is None else self.joined(found, schema)
                except (pa.ArrowInvalid, pa.ArrowTypeError) as error:
                    last = records.place.rows
                    raise FilesError(f"{path}: up to row {last}: columns of mixed types: {one_line(error)}") from None
        fields = sorted(
            found or pa.schema([]), key=lambda f: self.names.index(f.name) if f.name in self.names else 10**6
        )
        return pa.schema([pa.field(f.name, pa.string()) if pa.types.is_null(f.type) else f for f in fields])

    def blocks(self, place: Place) -> Iterator[Block]:
        """The blocks of a file from a place on."""
        path = self.files[place.file]
        place = place if place.at else self.start(place.file)
        for records in records_of(path, place, self.bytes, self.quotes):
            yield self.block(path, records)

    @abstractmethod
    def start(self, file: int) -> Place:
        """Where the first record of a file begins."""

    @abstractmethod
    def inferred(self, path: Path, records: Records) -> pa.Schema:
        """The types that these records would have by themselves."""

    @abstractmethod
    def joined(self, one: pa.Schema, other: pa.Schema) -> pa.Schema:
        """Types that hold both."""

    @abstractmethod
    def block(self, path: Path, records: Records) -> Block:
        """These records, read."""


class CsvSource(_TextSource):
    """RFC 4180 with a header, in UTF-8."""

    quotes = True
    cells_are_text = True

    def __init__(self, files: Sequence[Path]) -> None:
        super().__init__(files)
        heads = [header_of(path) for path in files]
        self.names, self.starts = heads[0][0], [start for _, start in heads]
        for path, (names, _) in zip(files, heads, strict=True):
            if names != self.names:
                raise FilesError(f"{path}: its header differs from that of {files[0]}")

    def start(self, file: int) -> Place:
        """Where the first record of a file begins."""
        return Place(file, self.starts[file], 0)

    def _read(
        self, path: Path, records: Records, include: list[str] | None, types: dict[str, pa.DataType]
    ) -> tuple[pa.RecordBatch, dict[int, str]]:
        """Cells of the records that have as many as the header, and what is wrong with the others by index."""
        wrong: dict[int, str] = {}

        def note(row: Any) -> str:
            wrong[row.number - 1] = f"has {row.actual_columns} cells, the header has {row.expected_columns}"
            return "skip"

        data = b"\n".join(records.texts)
        try:
            table = pa.csv.read_csv(
                io.BytesIO(data),
                read_options=pa.csv.ReadOptions(
                    column_names=self.names, use_threads=False, block_size=max(len(data) + 1, 1024)
                ),
                parse_options=pa.csv.ParseOptions(newlines_in_values=True, invalid_row_handler=note),
                convert_options=pa.csv.ConvertOptions(
                    include_columns=include, column_types=types, strings_can_be_null=False,
                    null_values=["", "NA", "N/A", "NaN", "nan", "null", "NULL", "None"],
                ),
            )  # fmt: skip
        except pa.ArrowInvalid as error:
            raise decoding_fault(path, records, error) from None
        if any(pa.types.is_binary(field.type) for field in table.schema):  # what pyarrow takes for no text
            raise decoding_fault(path, records, ValueError("not in UTF-8"))
        batches = table.combine_chunks().to_batches()
        empty = pa.RecordBatch.from_arrays([pa.array([], f.type) for f in table.schema], schema=table.schema)
        return (batches[0] if batches else empty), wrong

    def inferred(self, path: Path, records: Records) -> pa.Schema:
        """The types that these records would have by themselves."""
        types = dict.fromkeys(self.inputs, pa.string())
        return self._read(path, records, None, types)[0].schema

    def joined(self, one: pa.Schema, other: pa.Schema) -> pa.Schema:
        """Types that hold both."""
        return pa.schema([pa.field(a.name, _joined_type(a.type, b.type)) for a, b in zip(one, other, strict=True)])

    def block(self, path: Path, records: Records) -> Block:
        """These records, read."""
        if self.verbatim:
            batch, wrong = self._read(path, records, self.inputs, dict.fromkeys(self.inputs, pa.string()))
        else:
            types = {field.name: field.type for field in self.schema}
            batch, wrong = self._read(path, records, None, types)
        return _without(records, batch, wrong, self.verbatim)


def _joined_type(one: pa.DataType, other: pa.DataType) -> pa.DataType:
    """A type for cells that were taken for ``one`` in one block and for ``other`` in another."""
    if one == other or pa.types.is_null(other):
        return one
    if pa.types.is_null(one):
        return other
    if {one, other} == {pa.int64(), pa.float64()}:
        return pa.float64()
    return pa.string()


def _without(records: Records, batch: pa.RecordBatch, wrong: dict[int, str], verbatim: bool) -> Block:
    """A block from the records that were read (``batch``) and those that were not (``wrong``, by index)."""
    n = len(records.texts)
    first = records.place.rows - n
    rows, texts = np.arange(first + 1, first + n + 1), records.texts
    faults = [Fault(first + i + 1, None, shorten(texts[i]), reason) for i, reason in sorted(wrong.items())]
    if wrong:
        kept = np.ones(n, np.bool_)
        kept[list(wrong)] = False
        rows, texts = rows[kept], [text for i, text in enumerate(texts) if i not in wrong]
    if batch.num_rows != len(texts):  # cannot happen; no row may get the result of another
        raise FilesError(f"rows {first + 1} to {first + n}: {len(texts)} records, but {batch.num_rows} were read")
    lines = pa.array(texts, pa.large_binary()) if verbatim else None
    return Block(batch, rows, records.place, lines, faults)


class NdjsonSource(_TextSource):
    """One JSON object a line."""

    quotes = False

    def __init__(self, files: Sequence[Path]) -> None:
        super().__init__(files)
        self.names = []
        for path in files:
            for records in records_of(path, Place(), 2**20, False):
                found = dict.fromkeys(name for entry in _objects(records.texts[:1000]) for name in entry)
                self.names += [name for name in found if name not in self.names]
                break
        if not self.names:
            raise FilesError(f"{files[0]}: holds no JSON object, one a line")

    def start(self, file: int) -> Place:
        """Where the first record of a file begins."""
        return Place(file, 0, 0)

    def settle(self, columns: Columns, verbatim: bool, part_rows: int) -> None:
        """Fix the schema, now that the inputs are known."""
        super().settle(columns, verbatim, part_rows)
        if verbatim:
            self.schema = pa.schema([pa.field(name, pa.float64()) for name in self.inputs])

    def inferred(self, path: Path, records: Records) -> pa.Schema:
        """The types that these records would have by themselves."""
        explicit = pa.schema([pa.field(name, pa.float64()) for name in self.inputs])
        try:
            schema = _json_table(records.texts, explicit, "infer").schema
        except (pa.ArrowInvalid, _DoubtError):
            objects = _objects(records.texts)
            names = dict.fromkeys(name for found in objects for name in found if name not in self.inputs)
            fields = [pa.field(name, self._type_of(path, records, name, objects)) for name in names]
            schema = pa.schema([*explicit, *fields])
        for name in schema.names:
            heading = split_unit(name)[0]
            if heading in NAMES and name not in self.inputs:
                raise FilesError(f"{path}: up to row {records.place.rows}: a field {name!r} that no earlier row has")
        return schema

    def _type_of(self, path: Path, records: Records, name: str, objects: list[dict[str, Any]]) -> pa.DataType:
        try:
            return pa.array([found.get(name) for found in objects]).type
        except (pa.ArrowInvalid, pa.ArrowTypeError) as error:
            last = records.place.rows
            raise FilesError(f"{path}: up to row {last}: {name!r} holds mixed types: {one_line(error)}") from None

    def joined(self, one: pa.Schema, other: pa.Schema) -> pa.Schema:
        """Types that hold both."""
        # text that looks like dates in one block and not in another is text
        for name in set(one.names) & set(other.names):
            kinds = one.field(name).type, other.field(name).type
            if pa.string() in kinds and any(map(pa.types.is_timestamp, kinds)):
                one, other = (s.set(s.get_field_index(name), pa.field(name, pa.string())) for s in (one, other))
        return pa.unify_schemas([one, other], promote_options="permissive")

    def block(self, path: Path, records: Records) -> Block:
        """These records, read."""
        try:
            table = _json_table(records.texts, self.schema, "ignore")
            stiffness = next((column for name, (column, _) in self.columns.places.items() if name == "k"), None)
            batch = table.select(self.schema.names).combine_chunks().to_batches()[0]
            if stiffness is not None and batch.column(stiffness).null_count:
                _check_said(records.texts, batch.column(stiffness), stiffness)
            return _without(records, batch, {}, self.verbatim)
        except (pa.ArrowInvalid, _DoubtError):
            return self._by_line(path, records)

    def _by_line(self, path: Path, records: Records) -> Block:
        """The block again, line by line, so that a bad line rejects only itself."""
        first = records.place.rows - len(records.texts)
        objects, texts, rows, faults = [], [], [], []
        for row, text in enumerate(records.texts, first + 1):
            try:
                found = _object(text)
            except ValueError as error:
                faults.append(Fault(row, None, shorten(text), str(error)))
                continue
            # a line with NaN or an infinity in it is no JSON: then it is written anew, with null for them
            clean = re.search(rb"NaN|Infinity", text) is None or _finite(found) == found
            fault = self._read_inputs(row, found)
            if fault is not None:
                faults.append(fault)
                continue
            objects.append(found)
            rows.append(row)
            texts.append(text.strip() if clean else json.dumps(_finite(found)).encode())
        try:
            batch = pa.RecordBatch.from_pylist(objects, schema=self.schema)
        except (pa.ArrowException, TypeError, ValueError, OverflowError) as error:
            raise FilesError(f"{path}: rows {first + 1} to {records.place.rows}: {one_line(error)}") from None
        lines = pa.array(texts, pa.large_binary()) if self.verbatim else None
        return Block(batch, np.array(rows, np.int64), records.place, lines, faults)

    def _read_inputs(self, row: int, found: dict[str, Any]) -> Fault | None:
        """The inputs of one object as doubles, or the fault of one of them."""
        for name, (column, _) in self.columns.places.items():
            value = found.get(column)
            if value is None or (name == "k" and isinstance(value, str) and not value.strip()):
                found[column] = None
                continue  # reported with all missing values
            if name == "k" and isinstance(value, str) and is_rigid(value):
                found[column] = math.inf
                continue
            shown = shorten(json.dumps(value).encode())
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                return Fault(row, name, shown, "must be a number")
            try:
                found[column] = float(value)
            except OverflowError:
                found[column] = math.inf
            if math.isinf(found[column]):  # JSON has no infinity, and a long number is no rigid contact
                return Fault(row, name, shown, "must be finite")
        return None


class _DoubtError(Exception):
    """The quick reader may have misread something."""


def _json_table(texts: list[bytes], schema: pa.Schema, unexpected: str) -> pa.Table:
    """Many lines at once; _DoubtError or ArrowInvalid where a single line decides."""
    data = b"\n".join(texts)
    if b"NaN" in data or b"Infinity" in data:
        raise _DoubtError
    table = pa.json.read_json(
        io.BytesIO(data),
        read_options=pa.json.ReadOptions(use_threads=False, block_size=max(len(data) + 1, 1024)),
        parse_options=pa.json.ParseOptions(explicit_schema=schema, unexpected_field_behavior=unexpected),
    )
    if table.num_rows != len(texts):  # two objects on a line, or one on several
        raise _DoubtError
    for name in table.schema.names:
        column = table.column(name)
        if pa.types.is_floating(column.type) and pa.compute.any(pa.compute.is_inf(column)).as_py():
            raise _DoubtError
    return table


def _check_said(texts: list[bytes], stiffness: pa.Array, column: str) -> None:
    """A null k must be written: a line without k is refused."""
    said = re.compile(rb'"' + re.escape(json.dumps(column)[1:-1].encode()) + rb'"\s*:')
    for i in np.flatnonzero(stiffness.is_null().to_numpy(zero_copy_only=False)).tolist():
        if said.search(texts[i]) is None or texts[i].count(b"{") > 1:
            raise _DoubtError


def _object(text: bytes) -> dict[str, Any]:
    """The JSON object of a line.  NaN and infinities, which JSON lacks, are let in: they are wrong as values.

    Raises
    ------
    ValueError
        No JSON, no object, or a key that is there twice.
    """
    try:
        found = json.loads(text, object_pairs_hook=_without_repeats)
    except RecursionError:
        raise ValueError("is no JSON: too deep") from None
    except ValueError as error:
        raise ValueError(str(error) if str(error).startswith("repeats") else f"is no JSON: {error}") from None
    if not isinstance(found, dict):
        raise ValueError("is no JSON object")
    return found


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        name = next(name for i, (name, _) in enumerate(pairs) if name in dict(pairs[:i]))
        raise ValueError(f"repeats the key {name!r}")
    return found


def _objects(texts: Sequence[bytes]) -> list[dict[str, Any]]:
    """The objects of those lines that hold one."""
    found = []
    for text in texts:
        with suppress(ValueError):
            found.append(_object(text))
    return found


def _finite(value: Any) -> Any:
    """``value`` with null for every NaN and infinity."""
    if isinstance(value, dict):
        return {name: _finite(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value

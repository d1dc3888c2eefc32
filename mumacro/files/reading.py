"""The three formats: which columns there are, and blocks of records from a place on.

Cells of CSV and values of NDJSON are text.  Inputs become numbers; all else stays text.
"""

from __future__ import annotations

import csv
import gzip
import io
import json
import math
import re
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.dataset
from numpy.typing import NDArray

from mumacro.files.columns import Columns, FilesError
from mumacro.files.records import Place, Records, opened, records_of
from mumacro.inputs import split_unit, suggestion

__all__ = ["SEPARATORS", "Block", "CsvSource", "Fault", "NdjsonSource", "ParquetSource", "one_line"]

#: what may stand between the cells of CSV, by the word for it
SEPARATORS = {",": ",", ";": ";", "|": "|", "tab": "\t"}
ROWS = 262_144  # of a block of Parquet
_SHOWN = 500  # characters of a bad record that are listed
_SIGNED = r"[+-]?\d*[{}]\d+([eE][+-]?\d+)?"  # a number with a decimal sign


class Fault(NamedTuple):
    """A record without a result: its number in its file (from 1), input, value, reason."""

    row: int
    field: str | None
    value: str | None
    reason: str


class Block(NamedTuple):
    """Some records in order: those that could be read, and what is wrong with the others.

    ``rows`` are their numbers in the file, from 1; ``place`` is what follows, ``share`` how much of the file is read;
    ``lines`` are the records themselves, where there are any.
    """

    batch: pa.RecordBatch
    rows: NDArray[np.int64]
    place: Place
    share: float
    lines: pa.Array | None = None
    faults: Sequence[Fault] = ()


def one_line(error: Any) -> str:
    """The message of an exception without line ends."""
    return " ".join(str(error).split())


class ParquetSource:
    """Parquet; folders below ``folder`` that are named ``key=value`` give columns, as in Hive."""

    def __init__(self, files: Sequence[Path], folder: Path | None) -> None:
        names = [str(path) for path in files]
        hive = pa.dataset.partitioning(flavor="hive") if folder else None
        options = {"format": "parquet", "partitioning": hive, "partition_base_dir": str(folder) if folder else None}
        try:
            found = pa.dataset.dataset(names, **options)
            schemas = [part.physical_schema.remove_metadata() for part in found.get_fragments()]
            self.schema = pa.unify_schemas([found.schema, *schemas], promote_options="permissive")
            self.parts = list(pa.dataset.dataset(names, schema=self.schema, **options).get_fragments())
        except (pa.ArrowException, OSError) as error:
            raise FilesError(f"{', '.join(names)}: no Parquet, or unlike columns ({one_line(error)})") from None

    def blocks(self, place: Place, columns: Columns, verbatim: bool) -> Iterator[Block]:  # noqa: ARG002
        """The blocks of the file at ``place`` from there on."""
        part, row = self.parts[place.file], 0
        scan = pa.dataset.ParquetFragmentScanOptions(pre_buffer=False)
        try:
            # group by group: blocks then begin at the same rows from wherever a run continues
            for group in part.split_by_row_group():
                rows = group.row_groups[0].num_rows
                if row + rows <= place.at:
                    row += rows
                    continue
                for batch in group.to_batches(
                    self.schema, batch_size=ROWS, batch_readahead=1, fragment_scan_options=scan, use_threads=False
                ):
                    before, row = row, row + batch.num_rows
                    if row > place.at:
                        share = row / part.metadata.num_rows
                        yield Block(batch, np.arange(before + 1, row + 1), Place(place.file, row, row), share)
        except (pa.ArrowException, OSError) as error:
            raise FilesError(f"{part.path}: damaged after row {row} ({one_line(error)})") from None


def _where(path: Path, records: Records) -> str:
    return f"{path}: rows {records.numbers[0]} to {records.numbers[-1]}"


def _block(records: Records, batch: pa.RecordBatch, texts: list[bytes], wrong: dict[int, str]) -> Block:
    """A block of the records that were read (``batch``) and those that were not (``wrong``, by index)."""
    rows, faults = np.array(records.numbers), []
    for i, reason in sorted(wrong.items()):
        shown = texts[i].decode("utf-8", "replace")
        faults.append(Fault(int(rows[i]), None, shown if len(shown) <= _SHOWN else shown[:_SHOWN] + "…", reason))
    kept = [text for i, text in enumerate(texts) if i not in wrong] if wrong else texts
    rows = np.delete(rows, list(wrong))
    return Block(batch, rows, records.place, records.share, pa.array(kept, pa.large_binary()), faults)


class CsvSource:
    """RFC 4180 with a header, in UTF-8; any separator and decimal sign.

    Raises
    ------
    FilesError
        No header, headers that differ, another separator or decimal sign; then the options to give are named.
    """

    def __init__(self, files: Sequence[Path], sep: str, decimal: str) -> None:
        self.files, self.sep = files, sep
        heads = [self._header(path, sep, decimal) for path in files]
        self.head, self.starts = heads[0].rstrip(b"\r\n"), [len(head) for head in heads]
        names = [self._cells(head) for head in heads]
        self.schema = pa.schema([(name, pa.string()) for name in names[0]])
        for path, found in zip(files, names, strict=True):
            if found != names[0]:
                raise FilesError(f"{path}: its header differs from that of {files[0]}")

    def _cells(self, head: bytes) -> list[str]:
        cells = next(csv.reader([head.decode("utf-8-sig").rstrip("\r\n")], delimiter=self.sep, strict=True), [])
        return [cell.strip() for cell in cells]

    def _header(self, path: Path, sep: str, decimal: str) -> bytes:
        """The first line, after a look at the records behind it."""
        try:
            with path.open("rb") as raw:
                stream = opened(path, raw)
                head, sample = stream.readline(2**20), stream.read(2**16)
            named = any(self._cells(head))
        except (UnicodeDecodeError, csv.Error, EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise FilesError(f"{path}: line 1 is no header of a CSV file in UTF-8 ({error})") from None
        if not named:
            raise FilesError(f"{path}: is empty; the first line must name the columns")
        rows = sample.decode("utf-8", "replace").splitlines()[:50]
        found = _recognised(head.decode("utf-8-sig"), rows, sep, decimal)
        if found != (sep, decimal):
            word = next(word for word, known in SEPARATORS.items() if known == found[0])
            raise FilesError(
                f"{path}: the columns are separated by {word!r} and the decimal sign is {found[1]!r}: "
                f"give --sep '{word}' --decimal '{found[1]}'"
            )
        return bytes(head)

    def blocks(self, place: Place, columns: Columns, verbatim: bool) -> Iterator[Block]:
        """The blocks of the file at ``place`` from there on."""
        path = self.files[place.file]
        place = place if place.at else place._replace(at=self.starts[place.file])
        names = columns.inputs if verbatim else self.schema.names
        for records in records_of(path, place, self.sep):
            wrong: dict[int, str] = {}

            def note(row: Any, wrong: dict[int, str] = wrong) -> str:
                wrong[row.number - 1] = f"has {row.actual_columns} cells, the header has {row.expected_columns}"
                return "skip"

            data = b"\n".join(records.texts)
            size = max(len(data) + 1, 1024)
            try:
                table = pa.csv.read_csv(
                    io.BytesIO(data),
                    pa.csv.ReadOptions(column_names=self.schema.names, use_threads=False, block_size=size),
                    pa.csv.ParseOptions(delimiter=self.sep, newlines_in_values=True, invalid_row_handler=note),
                    pa.csv.ConvertOptions(include_columns=names, column_types=self.schema, strings_can_be_null=False),
                )
            except pa.ArrowInvalid as error:
                raise FilesError(f"{_where(path, records)}: no CSV in UTF-8 ({one_line(error)})") from None
            if table.num_rows + len(wrong) != len(records.texts):  # no row may get the result of another
                raise FilesError(f"{_where(path, records)}: records end in several ways")
            batches = table.combine_chunks().to_batches() or [pa.RecordBatch.from_pylist([], table.schema)]
            yield _block(records, batches[0], records.texts, wrong)


def _recognised(header: str, rows: list[str], sep: str, decimal: str) -> tuple[str, str]:
    """The separator that gives the most names of inputs, and the decimal sign of most numbers; if unsure, as given."""

    def inputs(given: str) -> list[int]:
        names = header.replace('"', "").split(given)
        return [i for i, name in enumerate(names) if suggestion(split_unit(name)[0], loosely=False)]

    best = max({sep, *SEPARATORS.values()}, key=lambda s: (len(inputs(s)), s in header, s == sep))
    places = inputs(best)
    cells = [cell.strip() for row in csv.reader(rows, delimiter=best) for i, cell in enumerate(row) if i in places]

    def cells_with(sign: str) -> int:
        return sum(re.fullmatch(_SIGNED.format(sign), cell) is not None for cell in cells)

    return best, max(".,", key=lambda sign: (cells_with(sign), sign == decimal))


class NdjsonSource:
    """One JSON object a line; the columns are those of the first block of every file."""

    def __init__(self, files: Sequence[Path]) -> None:
        self.files = files
        names: dict[str, None] = {}
        for path in files:
            for records in records_of(path, Place()):
                names |= dict.fromkeys(name for found, _, _ in _objects(records.texts) for name in found)
                break
        if not names:
            raise FilesError(f"{files[0]}: holds no JSON object, one a line")
        self.schema = pa.schema([(name, pa.string()) for name in names])

    def blocks(self, place: Place, columns: Columns, verbatim: bool) -> Iterator[Block]:
        """The blocks of the file at ``place`` from there on."""
        path = self.files[place.file]
        schema = pa.schema([self.schema.field(name) for name in columns.inputs]) if verbatim else self.schema
        for records in records_of(path, place):
            objects, texts, wrong = [], [], {}
            for i, (found, text, fault) in enumerate(_objects(records.texts)):
                texts.append(text)
                if fault is None:
                    objects.append(found)
                else:
                    wrong[i] = fault
            if not verbatim and (new := {name for found in objects for name in found} - set(schema.names)):
                late = f"{min(new)!r} is in no earlier row; name it in the first, or write NDJSON"
                raise FilesError(f"{_where(path, records)}: {late}")
            arrays = [_column([found.get(name) for found in objects], name in columns.inputs) for name in schema.names]
            yield _block(records, pa.RecordBatch.from_arrays(arrays, schema.names), texts, wrong)


def _objects(texts: Iterable[bytes]) -> Iterator[tuple[dict[str, Any], bytes, str | None]]:
    """The object of each line; the line, with null for NaN and infinities, which JSON lacks; what is wrong with it."""
    constants: list[str] = []
    decoder = json.JSONDecoder(object_pairs_hook=_without_repeats, parse_constant=constants.append)
    for text in texts:
        try:
            found = decoder.decode(text.decode("utf-8-sig"))
            if b"\\u" in text:
                json.dumps(found, ensure_ascii=False).encode()  # half of a surrogate pair is no text
            fault = None if isinstance(found, dict) else "is no JSON object"
        except RecursionError:
            fault = "is no JSON: too deep"
        except ValueError as error:
            fault = str(error) if str(error).startswith("repeats") else f"is no JSON: {error}"
        yield ({} if fault else found), (json.dumps(found).encode() if constants and not fault else text), fault
        constants.clear()


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        name = next(name for i, (name, _) in enumerate(pairs) if name in dict(pairs[:i]))
        raise ValueError(f"repeats the key {name!r}")
    return found


def _column(values: list[Any], is_input: bool) -> pa.Array:
    """Values of JSON: inputs as doubles where all are numbers; else text: strings as they are, others as JSON."""
    if is_input and {*map(type, values)} <= {float, int}:
        with suppress(OverflowError):
            numbers = np.array(values, np.float64)
            if np.isfinite(numbers).all():
                return pa.array(numbers)
    return pa.array([_text(value) for value in values], pa.string())


def _text(value: Any) -> str | None:
    if value is None or isinstance(value, str):
        return value
    # JSON has no infinity: this is a number of too many digits, which must not pass for a rigid contact
    return "1e999" if isinstance(value, float) and math.isinf(value) else json.dumps(value)

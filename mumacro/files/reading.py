"""The three formats: which columns there are, and blocks of records from a place on.

Cells of CSV and values of NDJSON are text.  Inputs become numbers; all else stays text.
"""

from __future__ import annotations

import csv
import gzip
import json
import math
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.dataset
from numpy.typing import NDArray

from mumacro.files.columns import Columns, FilesError
from mumacro.separators import advice

__all__ = ["Block", "CsvSource", "Fault", "NdjsonSource", "ParquetSource", "Place", "one_line"]

ROWS = 65_536  # of a block, at most: a third of a second of work
LONGEST = 64 * 2**20  # bytes of a line
_SHOWN = 500  # characters of a bad record that are listed


class Place(NamedTuple):
    """Where the next record begins: file, byte (of unpacked text) or row (of Parquet), and records before it."""

    file: int = 0
    at: int = 0
    rows: int = 0


class Fault(NamedTuple):
    """A record without a result: its number in its file (from 1), input, value, reason."""

    row: int
    field: str | None
    value: str | None
    reason: str


class Block(NamedTuple):
    """Some records in order: those that could be read, and what is wrong with the others.

    ``rows`` are their numbers in the file, from 1; ``place`` is what follows, ``share`` how much of the file is read;
    ``texts`` are the records as they came in, where they are text: cells of CSV, lines of NDJSON.
    """

    batch: pa.RecordBatch
    rows: NDArray[np.int64]
    place: Place
    share: float
    texts: Sequence[Any] = ()
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
        options = {"batch_size": ROWS, "batch_readahead": 1, "fragment_scan_options": scan, "use_threads": False}
        try:
            # group by group: blocks then begin at the same rows from wherever a run continues
            for group in part.split_by_row_group():
                rows = group.row_groups[0].num_rows
                if row + rows <= place.at:
                    row += rows
                    continue
                for batch in group.to_batches(self.schema, **options):
                    before, row = row, row + batch.num_rows
                    if row > place.at:
                        share = row / part.metadata.num_rows
                        yield Block(batch, np.arange(before + 1, row + 1), Place(place.file, row, row), share)
        except (pa.ArrowException, OSError) as error:
            raise FilesError(f"{part.path}: damaged after row {row} ({one_line(error)})") from None


class _Lines:
    """The lines of a text file, also a compressed one, from a byte on; ``at`` is the byte after the last line."""

    def __init__(self, path: Path, at: int = 0) -> None:
        self.path, self.at, self.share = path, at, 0.0

    def __iter__(self) -> Iterator[bytes]:
        try:
            with self.path.open("rb") as raw:
                stream: Any = gzip.GzipFile(fileobj=raw) if self.path.name.lower().endswith(".gz") else raw
                stream.seek(self.at)
                size = max(self.path.stat().st_size, 1)
                while line := stream.readline(LONGEST):
                    if len(line) == LONGEST:
                        raise FilesError(f"{self.path}: a line has more than {LONGEST >> 20} MiB")
                    self.at, self.share = self.at + len(line), raw.tell() / size
                    yield line
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise FilesError(f"{self.path}: the compressed file is damaged ({error})") from None


def _block(
    place: Place, lines: _Lines, texts: Sequence[Any], wrong: dict[int, tuple[str, str]], columns: dict[str, Any]
) -> Block:
    """A block of records: ``columns`` of those that were read, what is ``wrong`` with the others, by index."""
    rows = place.rows + 1 + np.arange(len(texts))
    faults = [
        Fault(int(rows[i]), None, text if len(text) <= _SHOWN else text[:_SHOWN] + "…", reason)
        for i, (text, reason) in wrong.items()
    ]
    place = Place(place.file, lines.at, place.rows + len(texts))
    try:
        arrays = [x if isinstance(x, pa.Array) else pa.array(x, pa.string()) for x in columns.values()]
    except UnicodeEncodeError as error:
        raise FilesError(f"{lines.path}: rows {rows[0]} to {rows[-1]}: no text in UTF-8 ({error.reason})") from None
    batch = pa.RecordBatch.from_arrays(arrays, list(columns))
    if wrong:
        texts = [text for i, text in enumerate(texts) if i not in wrong]
    return Block(batch, np.delete(rows, list(wrong)), place, lines.share, texts, faults)


class CsvSource:
    """RFC 4180 with a header, in UTF-8; any separator and decimal sign.

    Raises
    ------
    FilesError
        No header, headers that differ, another separator or decimal sign; then the options to give are named.
    """

    def __init__(self, files: Sequence[Path], sep: str, decimal: str) -> None:
        self.files, self.sep = files, sep
        heads = [self._head(path, sep, decimal) for path in files]
        self.head = heads[0]
        names = [[cell.strip("\ufeff \t") for cell in head] for head in heads]
        self.schema = pa.schema([(name, pa.string()) for name in names[0]])
        for path, found in zip(files, names, strict=True):
            if found != names[0]:
                raise FilesError(f"{path}: its header differs from that of {files[0]}")

    def _head(self, path: Path, sep: str, decimal: str) -> list[str]:
        """The cells of the first line, after a look at the records behind it; a mark of byte order stays."""
        first, *rows = [*islice(_Lines(path), 51)] or [b""]
        try:
            text = first.decode("utf-8-sig")
            cells = next(csv.reader([text], delimiter=sep, strict=True), [])
        except (UnicodeDecodeError, csv.Error) as error:
            raise FilesError(f"{path}: line 1 is no header of a CSV file in UTF-8 ({error})") from None
        if not any(map(str.strip, cells)):
            raise FilesError(f"{path}: is empty; the first line must name the columns")
        if remedy := advice(text, [row.decode("utf-8", "replace") for row in rows], sep, decimal):
            raise FilesError(f"{path}: {remedy}")
        return ["\ufeff" * (first[:3] == b"\xef\xbb\xbf") + cells[0], *cells[1:]]

    def blocks(self, place: Place, columns: Columns, verbatim: bool) -> Iterator[Block]:
        """The blocks of the file at ``place`` from there on."""
        lines = _Lines(self.files[place.file], place.at)
        texts = (line.decode("utf-8", "surrogateescape") for line in lines)  # bytes come out as they came in
        reader = csv.reader(texts, delimiter=self.sep, strict=True)
        if not place.at:
            next(reader, None)
        names, width = self.schema.names, len(self.head)
        while rows := self._rows(reader, lines.path, place.rows):
            wrong = {
                i: (self.sep.join(row), f"has {len(row)} cells, the header has {width}")
                for i, row in enumerate(rows)
                if len(row) != width
            }
            by_name = dict(zip(names, zip(*(row for row in rows if len(row) == width), strict=True), strict=False))
            wanted = columns.inputs if verbatim else names
            yield (block := _block(place, lines, rows, wrong, {name: by_name.get(name, ()) for name in wanted}))
            place = block.place

    @staticmethod
    def _rows(reader: Iterator[list[str]], path: Path, before: int) -> list[list[str]]:
        """The next records; blank lines are left out."""
        rows: list[list[str]] = []
        try:
            for row in reader:
                if len(row) > 1 or (row and row[0].strip()):
                    rows.append(row)
                    if len(rows) == ROWS:
                        break
        except csv.Error as error:
            number = before + len(rows) + 1
            fault = f"a quote is not closed, or not at the end of its cell ({error})"
            raise FilesError(f"{path}: row {number}: {fault}") from None
        return rows


class NdjsonSource:
    """One JSON object a line; the columns are those of the first block of every file."""

    def __init__(self, files: Sequence[Path]) -> None:
        self.files = files
        names: dict[str, None] = {}
        for path in files:
            for found, _ in _objects(islice(_Lines(path), ROWS)):
                names |= dict.fromkeys(found)
        if not names:
            raise FilesError(f"{files[0]}: holds no JSON object, one a line")
        self.schema = pa.schema([(name, pa.string()) for name in names])

    def blocks(self, place: Place, columns: Columns, verbatim: bool) -> Iterator[Block]:
        """The blocks of the file at ``place`` from there on."""
        lines = _Lines(self.files[place.file], place.at)
        texts, names = iter(lines), columns.inputs if verbatim else self.schema.names
        while block := [*islice(texts, ROWS)]:
            records = [line.strip() for line in block if line.strip()]
            read = [*_objects(records)]
            wrong = {i: (records[i].decode("utf-8", "replace"), why) for i, (_, why) in enumerate(read) if why}
            objects = [found for found, why in read if not why]
            if not verbatim and (new := {name for found in objects for name in found} - set(names)):
                last = place.rows + len(records)
                late = f"{min(new)!r} is in no earlier row; name it in the first, or write NDJSON"
                raise FilesError(f"{lines.path}: rows {place.rows + 1} to {last}: {late}")
            given = {name: _column([found.get(name) for found in objects], name in columns.inputs) for name in names}
            yield (found := _block(place, lines, records, wrong, given))
            place = found.place


def _objects(texts: Iterable[bytes]) -> Iterator[tuple[dict[str, Any], str | None]]:
    """The object of each line that is not blank, and what is wrong with it."""
    decoder = json.JSONDecoder(object_pairs_hook=_without_repeats, parse_constant=_refuse_constant)
    for text in filter(bytes.strip, texts):
        try:
            found = decoder.decode(text.decode("utf-8-sig"))
            if b"\\u" in text:
                json.dumps(found, ensure_ascii=False).encode()  # half of a surrogate pair is no text
            fault = None if isinstance(found, dict) else "is no JSON object"
        except RecursionError:
            fault = "is no JSON: too deep"
        except ValueError as error:
            fault = str(error) if str(error).startswith("repeats") else f"is no JSON: {error}"
        yield ({} if fault else found), fault


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        name = next(name for i, (name, _) in enumerate(pairs) if name in dict(pairs[:i]))
        raise ValueError(f"repeats the key {name!r}")
    return found


def _refuse_constant(word: str) -> None:
    raise ValueError(f"{word} is not in it; write null")


def _column(values: list[Any], is_input: bool) -> Any:
    """Values of JSON: inputs as doubles where all are numbers; else text: strings as they are, others as JSON."""
    if is_input and {*map(type, values)} <= {float, int}:
        with suppress(OverflowError):
            numbers = np.array(values, np.float64)
            if np.isfinite(numbers).all():
                return pa.array(numbers)
    return [_text(value) for value in values]


def _text(value: Any) -> str | None:
    if value is None or isinstance(value, str):
        return value
    # JSON has no infinity: this is a number of too many digits, which must not pass for a rigid contact
    return "1e999" if isinstance(value, float) and math.isinf(value) else json.dumps(value)

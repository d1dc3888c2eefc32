"""The three formats: which files and columns there are, and blocks of records.

Cells of CSV and values of NDJSON are text.  Inputs become numbers; other columns stay text.
"""

import csv
import glob
import gzip
import json
import math
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa
import pyarrow.dataset

from mumacro.files.record_batch import FilesError
from mumacro.inputs.text_tables import NO_UTF8, read_head

FORMATS = {".parquet": "parquet", ".csv": "csv", ".ndjson": "ndjson", ".jsonl": "ndjson"}
ENDINGS = f"{', '.join(FORMATS)} (text also .gz)"
ROWS = 65_536  # of a block, at most: a third of a second of work
LONGEST = 64 * 2**20  # bytes of a line


class Block(NamedTuple):
    """Some records in order; ``share`` is how much of the file is read after them.

    A record that could not be read is a row of nulls; ``unreadable`` has its index, its text and
    the fault. ``texts`` are the unchanged records, where they are text: cells of CSV, lines of
    NDJSON.
    """

    batch: pa.RecordBatch
    share: float
    texts: Sequence[Any] = ()
    unreadable: Sequence[tuple[int, str, str]] = ()


def format_of(path: Path) -> tuple[str, bool]:
    """The format by a name's ending, empty for another ending, and whether it is compressed."""
    name = path.name.lower()
    file_format, compressed = (
        FORMATS.get(Path(name.removesuffix(".gz")).suffix, ""),
        name.endswith(".gz"),
    )
    return "" if compressed and file_format == "parquet" else file_format, compressed


def find_files(cases: Sequence[str | Path]) -> tuple[list[Path], str]:
    """The files that paths, folders and patterns name, in order, and their format; FilesError where
    one names no file, or the formats differ."""
    files: list[Path] = []
    for entry in cases:
        path = Path(entry)
        pattern = f"{glob.escape(str(path))}/**/*" if path.is_dir() else str(path)
        matches = (
            [path] if path.is_file() else sorted(map(Path, glob.glob(pattern, recursive=True)))
        )
        # in a folder, what begins with _ is metadata
        candidates = [
            p
            for p in matches
            if p == path or not (p.name.startswith("_") or p.name.endswith(".rejects.csv"))
        ]
        files += (usable := [p for p in candidates if p.is_file() and format_of(p)[0]])
        if not usable:
            raise FilesError(f"{entry}: no such file, or none that ends in {ENDINGS}")
    formats = sorted({format_of(path)[0] for path in files})
    if len(formats) > 1:
        raise FilesError(f"the files are of several formats: {', '.join(formats)}")
    return files, formats[0]


class ParquetSource:
    """Parquet; folders below ``folder`` that are named ``key=value`` give columns, as in Hive."""

    head: Sequence[str] = ()

    def __init__(self, files: Sequence[Path], folder: str | None) -> None:
        names = [str(path) for path in files]
        hive = pa.dataset.partitioning(flavor="hive") if folder else None
        options = {"format": "parquet", "partitioning": hive, "partition_base_dir": folder}
        dataset = pa.dataset.dataset(names, **options)
        schemas = [part.physical_schema.remove_metadata() for part in dataset.get_fragments()]
        self.schema = pa.unify_schemas([dataset.schema, *schemas], promote_options="permissive")
        self.parts = list(pa.dataset.dataset(names, schema=self.schema, **options).get_fragments())

    def blocks(self, file: int, skip: int, names: Sequence[str]) -> Iterator[Block]:
        """The blocks of a file behind the first ``skip`` rows, of the columns ``names``."""
        part, row = self.parts[file], 0
        scan = pa.dataset.ParquetFragmentScanOptions(pre_buffer=False)
        options = {
            "batch_size": ROWS,
            "batch_readahead": 1,
            "fragment_scan_options": scan,
            "use_threads": False,
        }
        try:
            for batch in part.to_batches(self.schema, columns=names, **options):
                row += len(batch)
                if row > skip:
                    yield Block(batch, row / part.metadata.num_rows)
        except (pa.ArrowException, OSError) as error:
            raise FilesError(f"{part.path}: damaged after row {row} ({error})") from None


class _Lines:
    """The lines of a text file, also a compressed one; ``share`` is how much of it is read."""

    def __init__(self, path: Path) -> None:
        self.path, self.share = path, 0.0

    def __iter__(self) -> Iterator[bytes]:
        try:
            with self.path.open("rb") as raw:
                stream: Any = gzip.GzipFile(fileobj=raw) if format_of(self.path)[1] else raw
                size = max(self.path.stat().st_size, 1)
                while line := stream.readline(LONGEST):
                    if len(line) == LONGEST:
                        raise FilesError(f"{self.path}: a line has more than {LONGEST >> 20} MiB")
                    self.share = raw.tell() / size
                    yield line
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise FilesError(f"{self.path}: the compressed file is damaged ({error})") from None


class TextSource:
    """CSV, RFC 4180 with a header, or without ``sep`` NDJSON, one object a line; both in UTF-8.

    The columns of NDJSON are those of the first block of every file, and others are refused unless
    ``verbatim``: then records come out as they came in.  ``head`` has the names as they came in.
    FilesError where there is no header, or headers differ, or the separator or decimal sign is
    another one; then the options to give are named.
    """

    def __init__(self, files: Sequence[Path], sep: str, decimal: str, verbatim: bool) -> None:
        self.files, self.sep, self.verbatim = files, sep, verbatim
        if sep:
            heads = [_head(path, sep, decimal) for path in files]
            names = [[cell.strip("\ufeff \t") for cell in head] for head in heads]
            if differ := [
                path for path, header in zip(files, names, strict=True) if header != names[0]
            ]:
                raise FilesError(f"{differ[0]}: its header differs from that of {files[0]}")
        else:
            starts = (
                record for path in files for record in islice(self._records(_Lines(path)), ROWS)
            )
            heads = names = [
                [*dict.fromkeys(name for record in starts for name in _object(record)[0])]
            ]
            if not names[0]:
                raise FilesError(f"{files[0]}: holds no JSON object, one a line")
        self.head, self.schema = heads[0], pa.schema([(name, pa.string()) for name in names[0]])

    def blocks(self, file: int, skip: int, names: Sequence[str]) -> Iterator[Block]:
        """The blocks of a file behind the first ``skip`` records, of the columns ``names``."""
        lines = _Lines(self.files[file])
        records = islice(self._records(lines), skip, None)
        while texts := [*islice(records, ROWS)]:
            where, skip = f"{lines.path}: rows {skip + 1} to {skip + len(texts)}", skip + len(texts)
            columns, faults = self._columns(texts, names, where)
            try:
                batch = pa.RecordBatch.from_arrays(
                    [pa.array(columns[x], pa.string()) for x in names], [*names]
                )
            except UnicodeEncodeError:
                row = (
                    skip - len(texts) + 1 + next(i for i, x in enumerate(texts) if not _is_utf8(x))
                )
                raise FilesError(f"{lines.path}: row {row} {NO_UTF8}") from None
            unreadable = [
                (i, self._excerpt(texts[i]), fault) for i, fault in enumerate(faults) if fault
            ]
            yield Block(batch, lines.share, texts, unreadable)

    def _records(self, lines: _Lines) -> Iterator[Any]:
        """Lists of cells, or lines."""
        if not self.sep:
            yield from filter(None, map(bytes.strip, lines))
            return
        # bytes come out as they came in
        texts = (line.decode("utf-8", "surrogateescape") for line in lines)
        count = 0
        try:
            for row in islice(csv.reader(texts, delimiter=self.sep, strict=True), 1, None):
                if len(row) > 1 or (row and row[0].strip()):
                    count += 1
                    yield row
        except csv.Error as error:
            fault = f"a quote is not closed, or not at the end of its cell ({error})"
            raise FilesError(f"{lines.path}: row {count + 1}: {fault}") from None

    def _columns(
        self, records: Any, names: Sequence[str], where: str
    ) -> tuple[dict[str, Any], Sequence[str | None]]:
        """Values by column, and the fault of each record, if any."""
        if self.sep:
            width = len(self.head)
            faults = [
                None if len(x) == width else f"has {len(x)} cells, the header has {width}"
                for x in records
            ]
            rows = (row if len(row) == width else [None] * width for row in records)
            return dict(zip(self.schema.names, zip(*rows, strict=True), strict=True)), faults
        objects, faults = zip(*map(_object, records), strict=True)
        if not self.verbatim and (
            new := {name for record in objects for name in record} - {*names}
        ):
            raise FilesError(
                f"{where}: {min(new)!r} is in no earlier row; name it in the first, or write NDJSON"
            )
        return {name: [_text(record.get(name)) for record in objects] for name in names}, faults

    def _excerpt(self, record: Any) -> str:
        text: str = self.sep.join(record) if self.sep else record.decode("utf-8", "replace")
        return text if len(text) <= 500 else text[:500] + "…"


def _head(path: Path, sep: str, decimal: str) -> list[str]:
    """The cells of the first line, after a look at the records behind it; a mark of byte order
    stays."""
    first, *rows = [*islice(_Lines(path), 51)] or [b""]
    try:
        cells = read_head(
            first.decode("utf-8-sig"),
            [row.decode("utf-8", "replace") for row in rows],
            sep,
            decimal,
        )
    except UnicodeDecodeError:
        raise FilesError(f"{path}: line 1 {NO_UTF8}") from None
    except ValueError as error:
        raise FilesError(f"{path}: line 1: {error}") from None
    return ["\ufeff" * (first[:3] == b"\xef\xbb\xbf") + cells[0], *cells[1:]]


def _is_utf8(record: Sequence[str]) -> bool:
    """Whether no cell has a byte that is kept as a half of a surrogate pair."""
    return not any("\udc80" <= sign <= "\udcff" for cell in record for sign in cell)


def _object(text: bytes) -> tuple[dict[str, Any], str | None]:
    """The object of a line, and its fault, if any."""
    try:
        value = _DECODER.decode(text.decode("utf-8-sig"))
        if b"\\u" in text:
            json.dumps(value, ensure_ascii=False).encode()  # half of a surrogate pair is no text
        return (value, None) if isinstance(value, dict) else ({}, "is no JSON object")
    except (ValueError, RecursionError) as error:
        return {}, f"is no JSON object: {error}"


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    if len(unique := dict(pairs)) < len(pairs):
        raise ValueError(
            f"repeats the key {Counter(name for name, _ in pairs).most_common(1)[0][0]!r}"
        )
    return unique


def _refuse_constant(word: str) -> None:
    raise ValueError(f"{word} is not in it; write null")


_DECODER = json.JSONDecoder(object_pairs_hook=_without_repeats, parse_constant=_refuse_constant)


def _text(value: Any) -> str | None:
    """A value as text: strings as they are, others as JSON."""
    if value is None or isinstance(value, str):
        return value
    # JSON has no infinity: too many digits must not pass for a rigid contact
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else "1e999"
    return json.dumps(value)

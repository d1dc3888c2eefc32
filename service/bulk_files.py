"""Files of cases, in chunks, forward and resumable: CSV, NDJSON, Parquet in; the same out."""

import csv
import io
import json
import math
import os
import re
import shutil
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from pydantic_core import from_json

from friction.nondim import FIELDS, UNITS

__all__ = ["FileError", "Row", "Sink", "Source", "open_sink", "open_source", "suffix_of"]

_REQUIRED = tuple(name for name in FIELDS if name != "k")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.ASCII | re.IGNORECASE)
_FORMATS = {".csv": "csv", ".ndjson": "ndjson", ".jsonl": "ndjson", ".parquet": "parquet"}
_MAX_CONTENT = 500  # characters of a bad row that are kept


class FileError(Exception):
    """A file that cannot be read or written; the text names it and says why."""


def suffix_of(path: Path) -> str:
    """The format of a file.

    Raises
    ------
    FileError
        The suffix tells none, or it is Parquet and pyarrow is missing.
    """
    found = _FORMATS.get(path.suffix.lower())
    if found is None:
        raise FileError(f"{path}: the suffix must be one of {', '.join(_FORMATS)}")
    if found == "parquet":
        try:
            import pyarrow.parquet  # noqa: F401
        except ImportError:
            raise FileError(f"{path}: Parquet needs pyarrow, which is not installed") from None
    return found


@dataclass
class Row:
    """One row: what it held, the inputs read from it, and either an answer or a fault (field, reason)."""

    values: Mapping[str, Any]
    inputs: dict[str, float | None] = field(default_factory=dict)
    fault: tuple[str | None, str] | None = None
    answer: tuple[Any, ...] | None = None
    raw: str | None = None

    @property
    def content(self) -> str:
        """The row as text, for the side file."""
        text = self.raw if self.raw is not None else json.dumps(dict(self.values), default=str)
        return text if len(text) <= _MAX_CONTENT else text[: _MAX_CONTENT - 1] + "…"

    def read(self, names: Mapping[str, str]) -> None:
        """Fill ``inputs`` from ``values``; ``names`` maps inputs to columns."""
        for name in FIELDS:
            value = self.values.get(names[name]) if name in names else None
            if value is None or value == "":
                if name != "k":
                    self.fault = (name, "is missing")
                    return
                self.inputs[name] = None
                continue
            number = _number(value)
            if number is None:
                self.fault = (name, "must be a number")
                return
            self.inputs[name] = number


def _number(value: Any) -> float | None:
    if isinstance(value, str):
        text = value.strip()
        return float(text) if _NUMBER.fullmatch(text) else None
    if type(value) not in (int, float):
        return None
    try:
        return float(value)
    except OverflowError:
        return math.inf


# --- sources ------------------------------------------------------------------------------------------


class Source(ABC):
    """Chunks of rows.  ``place`` is where the next chunk begins, in terms that ``open_source`` takes up again."""

    columns: tuple[str, ...] = ()
    place: Any = None
    share: float = 0.0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @abstractmethod
    def close(self) -> None:
        """Let go of the file."""

    @abstractmethod
    def __iter__(self) -> Iterator[list[Row]]:
        """Yield the chunks."""


def open_source(path: Path, chunk: int, place: Any = None) -> Source:
    """The cases of a file, from ``place`` on.

    Raises
    ------
    FileError, OSError
        No such file, no such format, a column missing.
    """
    kinds: dict[str, Callable[[Path, int, Any], Source]]
    kinds = {"csv": _CsvSource, "ndjson": _NdjsonSource, "parquet": _ParquetSource}
    return kinds[suffix_of(path)](path, chunk, place)


def _columns_of(path: Path, columns: Sequence[str]) -> dict[str, str]:
    """Input -> column, which may carry its SI unit: ``v0`` or ``v0 [m/s]``."""
    found: dict[str, str] = {}
    for column in columns:
        if columns.count(column) > 1:
            raise FileError(f"{path}: the column {column!r} is there twice")
        for name in FIELDS:
            if column.strip() in (name, f"{name} [{UNITS[name]}]"):
                if name in found:
                    raise FileError(f"{path}: {name} is there twice")
                found[name] = column
    missing = [name for name in _REQUIRED if name not in found]
    if missing:
        raise FileError(f"{path}: no column {', '.join(missing)}; there are {', '.join(columns)}")
    return found


class _Lines(Source):
    """A text file in UTF-8 whose place is a byte offset."""

    def __init__(self, path: Path, chunk: int, place: Any) -> None:
        self.path, self.chunk = path, chunk
        self.size = max(path.stat().st_size, 1)
        self.stream = path.open("rb")
        self.offset = 0
        try:
            self.start(place)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        self.stream.close()

    @abstractmethod
    def start(self, place: Any) -> None:
        """Learn the columns, then go to ``place``."""

    @abstractmethod
    def rows(self) -> Iterator[Row]:
        """The rows from here on, one by one."""

    def __iter__(self) -> Iterator[list[Row]]:
        rows: list[Row] = []
        for row in self.rows():
            rows.append(row)
            if len(rows) >= self.chunk:
                self.mark()
                yield rows
                rows = []
        self.mark()
        if rows:
            yield rows

    def go_to(self, offset: int) -> None:
        self.stream.seek(offset)
        self.offset = offset
        self.mark()

    def mark(self) -> None:
        self.place, self.share = self.offset, min(self.offset / self.size, 1.0)

    def lines(self) -> Iterator[str]:
        """The lines from here on; ``offset`` counts what was given out.  What is no UTF-8 becomes U+FFFD."""
        for line in self.stream:
            text = line.decode("utf-8-sig" if self.offset == 0 else "utf-8", errors="replace")
            self.offset += len(line)
            yield text


class _CsvSource(_Lines):
    """RFC 4180 with a header."""

    def start(self, place: Any) -> None:
        self.go_to(0)
        try:
            header = next(csv.reader(self.lines(), strict=True), None)
        except csv.Error as error:
            raise FileError(f"{self.path}: the header is no CSV ({error})") from None
        if not header:
            raise FileError(f"{self.path}: the file is empty; a header with the names of the columns is needed")
        self.columns = tuple(header)
        self.names = _columns_of(self.path, header)
        self.go_to(int(place) if place else self.offset)

    def rows(self) -> Iterator[Row]:
        lines = self.lines()
        reader = csv.reader(lines)
        while True:
            try:
                cells = next(reader)
            except StopIteration:
                return
            except csv.Error as error:  # a cell without end, most often: a quote that is never closed
                yield Row({}, fault=(None, f"is no CSV: {error}"), raw="")
                reader = csv.reader(lines)
                continue
            if cells:  # else an empty line, often the last
                yield self.row(cells)

    def row(self, cells: list[str]) -> Row:
        row = Row(dict(zip(self.columns, cells, strict=False)), raw=",".join(cells))
        if len(cells) != len(self.columns):
            row.fault = (None, f"has {len(cells)} cells, the header has {len(self.columns)}")
        else:
            row.read(self.names)
        return row


class _NdjsonSource(_Lines):
    """One JSON object a line.  The first one tells the columns that come out; later ones may lack some."""

    def start(self, place: Any) -> None:
        self.go_to(0)
        columns: tuple[str, ...] = FIELDS
        for line in self.lines():
            if line.strip():
                row = self.row(line)
                columns = tuple(row.values) if row.fault is None or row.values else columns
                break
        self.columns = columns
        self.go_to(int(place or 0))

    def rows(self) -> Iterator[Row]:
        for line in self.lines():
            if line.strip():
                yield self.row(line)

    def row(self, line: str) -> Row:
        text = line.strip()
        try:
            values = from_json(text)
        except ValueError as error:
            return Row({}, fault=(None, f"is no JSON: {error}"), raw=text)
        if not isinstance(values, dict):
            return Row({}, fault=(None, "is no JSON object"), raw=text)
        row = Row(values, raw=text)
        text_in = next((name for name in FIELDS if isinstance(values.get(name), str)), None)
        if text_in is not None:
            row.fault = (text_in, "must be a number")
        else:
            row.read({name: name for name in FIELDS})
        return row


class _ParquetSource(Source):
    """Parquet, whose place is a number of chunks."""

    def __init__(self, path: Path, chunk: int, place: Any) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        self.path, self.chunk, self.done = path, chunk, int(place or 0)
        try:
            self.file = pq.ParquetFile(path)
        except pa.ArrowInvalid as error:
            raise FileError(f"{path}: not a Parquet file ({error})") from None
        self.columns = tuple(self.file.schema_arrow.names)
        self.names = _columns_of(path, self.columns)
        self.total = max(self.file.metadata.num_rows, 1)
        self.mark()

    def close(self) -> None:
        self.file.close()

    def mark(self) -> None:
        self.place, self.share = self.done, min(self.done * self.chunk / self.total, 1.0)

    def __iter__(self) -> Iterator[list[Row]]:
        skipped = self.done
        for batch in self.file.iter_batches(self.chunk):
            if skipped:
                skipped -= 1
                continue
            rows = [Row(values) for values in batch.to_pylist()]
            for row in rows:
                row.read(self.names)
            self.done += 1
            self.mark()
            yield rows


# --- sinks --------------------------------------------------------------------------------------------


class Sink(ABC):
    """A file that grows under a name of its own and gets its real one when it is whole."""

    def __init__(self, path: Path, columns: Sequence[str], size: int) -> None:
        self.path, self.columns = path, tuple(columns)
        self.part = path.with_name(path.name + ".part")
        self.start(size)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @abstractmethod
    def start(self, size: int) -> None:
        """Begin, or cut back to what ``sync`` said last (0: nothing)."""

    @abstractmethod
    def write(self, rows: Sequence[Sequence[Any]]) -> None:
        """Append rows."""

    @abstractmethod
    def sync(self) -> int:
        """Bring everything to the disk; return what ``start`` needs to come back to here."""

    @abstractmethod
    def close(self) -> None:
        """Let go of the file."""

    @abstractmethod
    def finish(self) -> None:
        """Give the whole file its name."""

    @abstractmethod
    def discard(self) -> None:
        """Leave nothing."""


def open_sink(path: Path, columns: Sequence[str], size: int) -> Sink:
    """The file to write, cut back to ``size`` (see Sink.start)."""
    kinds: dict[str, Callable[[Path, Sequence[str], int], Sink]]
    kinds = {"csv": _CsvSink, "ndjson": _NdjsonSink, "parquet": _ParquetSink}
    return kinds[suffix_of(path)](path, columns, size)


class _TextSink(Sink):
    def start(self, size: int) -> None:
        self.stream = self.part.open("r+b" if size and self.part.exists() else "wb")
        if size and os.fstat(self.stream.fileno()).st_size < size:
            raise FileError(f"{self.part}: is shorter than the progress file says; start again with --fresh")
        self.stream.truncate(size)
        self.stream.seek(size)
        if not size:
            self.stream.write(self.header())

    def header(self) -> bytes:
        return b""

    def sync(self) -> int:
        self.stream.flush()
        os.fsync(self.stream.fileno())
        return self.stream.tell()

    def close(self) -> None:
        self.stream.close()

    def finish(self) -> None:
        self.sync()
        self.stream.close()
        self.part.replace(self.path)

    def discard(self) -> None:
        self.stream.close()
        self.part.unlink(missing_ok=True)


class _CsvSink(_TextSink):
    def header(self) -> bytes:
        return self.text([self.columns])

    def write(self, rows: Sequence[Sequence[Any]]) -> None:
        self.stream.write(self.text(rows))

    @staticmethod
    def text(rows: Sequence[Sequence[Any]]) -> bytes:
        text = io.StringIO()
        csv.writer(text).writerows(rows)
        return text.getvalue().encode()


class _NdjsonSink(_TextSink):
    def write(self, rows: Sequence[Sequence[Any]]) -> None:
        lines = [json.dumps(dict(zip(self.columns, row, strict=True)), default=str) for row in rows]
        self.stream.write("".join(f"{line}\n" for line in lines).encode())


class _ParquetSink(Sink):
    """A Parquet file cannot grow after a stop, so each chunk is a file of its own until all are joined."""

    def start(self, size: int) -> None:
        if not size:
            shutil.rmtree(self.part, ignore_errors=True)
        self.part.mkdir(exist_ok=True)
        self.count = size
        if len([piece for piece in self.pieces() if piece.exists()]) < size:
            raise FileError(f"{self.part}: has fewer pieces than the progress file says; start again with --fresh")

    def pieces(self) -> list[Path]:
        return [self.part / f"{number:08d}.parquet" for number in range(self.count)]

    def write(self, rows: Sequence[Sequence[Any]]) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        columns = [list(column) for column in zip(*rows, strict=True)] if rows else [[] for _ in self.columns]
        self.count += 1
        pq.write_table(pa.table(dict(zip(self.columns, columns, strict=True))), self.pieces()[-1])

    def sync(self) -> int:
        return self.count

    def close(self) -> None:
        pass

    def finish(self) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        # a column that is empty in one piece has no type there; the pieces agree on one
        schema = pa.unify_schemas([pq.read_schema(p) for p in self.pieces()], promote_options="permissive")
        whole = self.part / "whole.parquet"
        with pq.ParquetWriter(whole, schema) as writer:
            for piece in self.pieces():
                writer.write_table(pq.read_table(piece).cast(schema))
        whole.replace(self.path)
        self.discard()

    def discard(self) -> None:
        shutil.rmtree(self.part, ignore_errors=True)

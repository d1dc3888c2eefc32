"""Files of cases in, pieces of the output out; nothing here is written."""

from __future__ import annotations

import glob
import hashlib
from collections.abc import Iterator, Sequence
from itertools import compress
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa

from mumacro.contact import kind_of
from mumacro.files.answering import added_fields, answer_columns
from mumacro.files.columns import FilesError, find_columns
from mumacro.files.reading import Block, CsvSource, Fault, NdjsonSource, ParquetSource, Place
from mumacro.files.writing import Output, csv_lines
from mumacro.surrogate import Surrogate

__all__ = ["Evaluation", "Piece", "find_files", "format_of"]

FORMATS = {".parquet": "parquet", ".csv": "csv", ".ndjson": "ndjson", ".jsonl": "ndjson"}
ENDINGS = f"{', '.join(FORMATS)} (text also .gz)"


class Piece(NamedTuple):
    """Evaluated records as they stand in the output, the lines for the rejected ones, and the place after them."""

    text: bytes | memoryview
    rejects: str
    place: Place
    rows: int
    rejected: int
    share: float


def format_of(path: Path) -> tuple[str, bool] | None:
    """The format by a name's ending, and whether it is compressed; None for another ending."""
    name = path.name.lower()
    kind = FORMATS.get(Path(name.removesuffix(".gz")).suffix)
    packed = name.endswith(".gz")
    return None if kind is None or (packed and kind == "parquet") else (kind, packed)


def find_files(given: Sequence[str | Path]) -> tuple[list[Path], str, Path | None]:
    """The files that paths, folders and patterns name, in order, their format, and the folder if it was one alone.

    Raises
    ------
    FilesError
        Nothing is there, a file has another ending, or the formats differ.
    """
    files: list[Path] = []
    folder = Path(given[0]) if len(given) == 1 and Path(given[0]).is_dir() else None
    for entry in given:
        path, found = Path(entry), [Path(entry)]
        if path.is_dir():
            found = sorted(p for p in path.rglob("*") if p.is_file() and format_of(p) and p.name[0] not in "._")
        elif not path.exists() and glob.has_magic(str(entry)):
            found = sorted(map(Path, glob.glob(str(entry), recursive=True)))
        found = [p for p in found if p == path or not p.name.endswith(".rejects.csv")]
        if not found:
            raise FilesError(f"{entry}: there is no file that ends in {ENDINGS}")
        files += found
    kinds = set()
    for path in files:
        if not path.is_file():
            raise FilesError(f"{path}: no such file")
        if (kind := format_of(path)) is None:
            raise FilesError(f"{path}: the name must end in {ENDINGS}")
        kinds.add(kind[0])
    if len(kinds) > 1:
        raise FilesError(f"the files are of several formats: {', '.join(sorted(kinds))}")
    return files, kinds.pop(), folder


def stamp(path: Path) -> list[int]:
    """What differs after a change of a file: the system itself sets the last of these."""
    found = path.stat()
    return [found.st_size, found.st_mtime_ns, found.st_ctime_ns]


def _checksum(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


class Evaluation:
    """Cases of files, and what comes out of them.

    Parameters are those of ``evaluate_files``; without ``out`` text comes out in the format of the input.
    """

    def __init__(
        self, given: Sequence[str | Path], out: Path | None, surrogate: Surrogate, *, rigid: bool = False,
        include: Sequence[str] = (), sep: str = ",", decimal: str = ".", contact: str = "spring",
        direction: str = "across",
    ) -> None:  # fmt: skip
        if sep == decimal:
            raise FilesError(f"--sep and --decimal are both {sep!r}; give another --sep, such as ';'")
        self.files, kind, folder = find_files(given)
        self._stamps = [stamp(path) for path in self.files]
        self.checksums = [_checksum(path) for path in self.files]
        told = format_of(out) if out else ("csv" if kind == "parquet" else kind, False)
        if told is None:
            raise FilesError(f"{out}: the name must end in {ENDINGS}")
        self.source: CsvSource | NdjsonSource | ParquetSource
        if kind == "csv":
            self.source = CsvSource(self.files, sep, decimal)
        else:
            self.source = NdjsonSource(self.files) if kind == "ndjson" else ParquetSource(self.files, folder)
        self.surrogate, self.include = surrogate, include
        self.decimal = decimal if kind == "csv" else "."
        try:
            self.columns = find_columns(self.source.schema.names, rigid, include, kind_of(contact, direction))
        except FilesError as error:
            raise FilesError(f"{self.files[0]}: {error}") from None
        added = added_fields(self.columns.added(include))
        self.output = Output(*told, sep, decimal, self.columns.stiffness)
        self.verbatim = told[0] == kind != "parquet"
        given_fields = [
            field.with_type(pa.float64()) if field.name in self.columns.inputs and kind != "parquet" else field
            for field in self.source.schema
        ]
        self.schema = pa.schema([*([] if self.verbatim else given_fields), *added], self.source.schema.metadata)
        self.head = b""
        if self.output.kind == "csv":
            before = self.source.head if isinstance(self.source, CsvSource) and self.verbatim else []
            self.head = self.output.pack(csv_lines([[*before, *self.schema.names]], sep))
        self.rejects_head = csv_lines([[*(["file"] if len(self.files) > 1 else []), *Fault._fields]])

    def pieces(self, place: Place | None = None) -> Iterator[Piece]:
        """What follows ``place``, in order; from the beginning, the head comes first.

        Raises
        ------
        FilesError
            A file that cannot be read; at the end, an input that changed meanwhile.
        """
        if place is None:
            place = Place()
            yield Piece(self.head, "", place, 0, 0, 0.0)
        for file in range(place.file, len(self.files)):
            start = place if file == place.file else Place(file)
            for block in self.source.blocks(start, self.columns, self.verbatim):
                yield self._piece(block)
        for path, before, checksum in zip(self.files, self._stamps, self.checksums, strict=True):
            if not path.exists() or (stamp(path) != before and _checksum(path) != checksum):
                raise FilesError(f"{path}: changed while it was read; give the command again")

    def _piece(self, block: Block) -> Piece:
        added, rejects, given = answer_columns(block.batch, self.surrogate, self.columns, self.include, self.decimal)
        faults = [*block.faults]
        faults += [Fault(int(block.rows[row]), *why) for row, *why in zip(*rejects.to_pydict().values(), strict=True)]
        path, place = self.files[block.place.file], block.place
        columns = [
            column if column.type == field.type else pa.array(given[field.name])
            for field, column in zip(self.schema, [] if self.verbatim else block.batch.columns, strict=False)
        ]
        batch = pa.RecordBatch.from_arrays([*columns, *added], schema=self.schema)
        texts = block.texts if self.verbatim else None
        if rejects.num_rows:
            kept = np.ones(batch.num_rows, np.bool_)
            kept[rejects.column("row")] = False
            batch, texts = batch.filter(pa.array(kept)), None if texts is None else [*compress(texts, kept)]
        several = [path] if len(self.files) > 1 else []
        listed = csv_lines([*several, *fault] for fault in sorted(faults))
        n = block.batch.num_rows + len(block.faults)
        share = (place.file + block.share) / len(self.files)
        return Piece(self.output.piece(batch, texts), listed, place, n, len(faults), share)

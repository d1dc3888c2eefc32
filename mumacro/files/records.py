"""Text files as whole records, from any record on: lines, or, in CSV with quotes, several lines."""

from __future__ import annotations

import csv
import gzip
import os
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from mumacro.files.columns import FilesError

__all__ = ["Place", "Records", "opened", "records_of"]

BLOCK = 4 * 2**20  # bytes that are read at a time
LONGEST = 64 * 2**20  # bytes of one record


class Place(NamedTuple):
    """Where the next record begins: file, byte (of unpacked text) or row (of Parquet), and records before it."""

    file: int = 0
    at: int = 0
    rows: int = 0


class Records(NamedTuple):
    """Whole records without line ends, blank ones left out; the place after them; how much of the file is read."""

    texts: list[bytes]
    place: Place
    share: float

    @property
    def numbers(self) -> range:
        """Their numbers, from 1."""
        return range(self.place.rows - len(self.texts) + 1, self.place.rows + 1)


def opened(path: Path, raw: Any) -> Any:
    """The text of an open file; one whose name ends in ``.gz`` is unpacked."""
    return gzip.GzipFile(fileobj=raw) if path.name.lower().endswith(".gz") else raw


def records_of(path: Path, place: Place, sep: str | None = None) -> Iterator[Records]:
    """The records of a text file from ``place`` on; ``sep`` separates the cells of CSV, and is None for lines.

    Blocks of records end at the same places from wherever a run continues.

    Raises
    ------
    FilesError
        A quote that is never closed, or is closed in the middle of a cell; names the row.
    """
    with path.open("rb") as raw:
        total = max(os.fstat(raw.fileno()).st_size, 1)
        stream = opened(path, raw)
        try:
            stream.seek(place.at)
            data, last = b"", False
            while not last:
                size = BLOCK - stream.tell() % BLOCK
                more = stream.read(size)
                data, last = data + more, len(more) < size
                texts, taken, fault = _cut(data, last, sep)
                data = data[taken:]
                place = Place(place.file, place.at + taken, place.rows + len(texts))
                if len(data) > LONGEST:
                    fault = f"a record of more than {LONGEST >> 20} MiB begins here"
                if fault:
                    raise FilesError(f"{path}: row {place.rows + 1}: {fault}")
                if texts:
                    yield Records(texts, place, raw.tell() / total)
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise FilesError(f"{path}: the compressed file is damaged ({error})") from None


def _cut(data: bytes, last: bool, sep: str | None) -> tuple[list[bytes], int, str | None]:
    """Whole records, the bytes that they take, and what is wrong with the one after them."""
    end = len(data) if last else data.rfind(b"\n") + 1
    if sep is None or b'"' not in data:
        return [text for text in data[:end].splitlines() if text.strip()], end, None
    lines = data[:end].splitlines(keepends=True)
    reader = csv.reader((line.decode("latin-1") for line in lines), delimiter=sep, strict=True)
    texts: list[bytes] = []
    done, fault = 0, None
    try:
        for _ in reader:
            texts.append(b"".join(lines[done : reader.line_num]).rstrip(b"\r\n"))
            done = reader.line_num
    except csv.Error as error:
        if last or reader.line_num < len(lines):  # else the record may end in what follows
            fault = f"a quote is not closed, or not at the end of its cell ({error})"
    return [text for text in texts if text.strip()], sum(map(len, lines[:done])), fault

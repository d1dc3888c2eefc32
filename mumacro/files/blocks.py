"""Files of cases as blocks of whole records, from any record on: the basis of reading and resuming."""

from __future__ import annotations

import csv
import gzip
import io
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, cast

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from mumacro.files.columns import FilesError

__all__ = ["Block", "Fault", "Place", "Records", "header_of", "records_of", "shorten"]

_LONGEST = 64 * 2**20  # bytes of one record
_SHOWN = 500  # characters of a bad record that are kept
# A quoted cell: it begins where a cell begins; inside, a quote is written twice.
_QUOTED = re.compile(rb'(?<![^,\r\n])"[^"]*+(?:""[^"]*+)*+("?)')


class Place(NamedTuple):
    """Where the next record begins: file, byte (of text) or row (of Parquet), and how many records came before."""

    file: int = 0
    at: int = 0
    rows: int = 0


class Fault(NamedTuple):
    """A record without a result: its number in its file (from 1), input, value, reason."""

    row: int
    field: str | None
    value: str | None
    reason: str


@dataclass
class Block:
    """Some records in order.

    Attributes
    ----------
    batch : RecordBatch
        Those that could be read.
    rows : ndarray of int64
        Their numbers in the file, from 1.
    lines : pyarrow.Array or None
        The records themselves, where they are to be written unchanged.
    faults : list of Fault
        Those that could not be read.
    place : Place
        What follows.
    """

    batch: pa.RecordBatch
    rows: NDArray[np.int64]
    place: Place
    lines: pa.Array | None = None
    faults: list[Fault] = field(default_factory=list)


class Records(NamedTuple):
    """Whole records of a text file without line ends, blank ones left out; the place after them."""

    texts: list[bytes]
    place: Place


def shorten(text: bytes) -> str:
    """A record as it is shown."""
    shown = text.decode("utf-8", "replace")
    return shown if len(shown) <= _SHOWN else shown[: _SHOWN - 1] + "…"


def _open(path: Path) -> BinaryIO:
    return cast("BinaryIO", gzip.open(path, "rb") if path.suffix == ".gz" else path.open("rb"))


def header_of(path: Path) -> tuple[list[str], int]:
    """The headings of a CSV file and the byte at which its records begin.

    Raises
    ------
    FilesError
        No header, or one that is no CSV.
    """
    with _open(path) as stream:
        try:
            first = stream.readline(2**20)
        except (EOFError, zlib.error) as error:
            raise FilesError(f"{path}: the compressed file is damaged ({error})") from None
    try:
        text = first.decode("utf-8-sig")
        cells = next(csv.reader(io.StringIO(text), strict=True), [])
    except (UnicodeDecodeError, csv.Error) as error:
        raise FilesError(f"{path}: line 1 is no header of a CSV file in UTF-8 ({error})") from None
    if not any(cell.strip() for cell in cells):
        raise FilesError(f"{path}: is empty; the first line must name the columns")
    if len(cells) == 1 and re.search(r"[;\t]", cells[0]):
        raise FilesError(f"{path}: the columns must be separated by commas, decimals by a point")
    return [cell.strip() for cell in cells], len(first)


def records_of(path: Path, place: Place, size: int, quotes: bool) -> Iterator[Records]:
    """The records of a text file from ``place`` on, about ``size`` bytes at a time.

    Parameters
    ----------
    path : Path
        A text file; one that ends in ``.gz`` is unpacked.
    place : Place
        Where to begin.
    size : int
        Bytes to read at a time; where blocks end depends on the file and ``size`` alone.
    quotes : bool
        CSV: a record continues beyond the end of a line inside quotes.

    Raises
    ------
    FilesError
        A quote that is never closed, or is closed in the middle of a cell; names the line.
    """
    with _open(path) as stream:
        try:
            stream.seek(place.at)
            rest, last = b"", False
            while not last:
                # up to the next multiple of size: blocks are then the same from whichever record a run continues
                data = stream.read(size - stream.tell() % size)
                last = not data
                data, begin = rest + data, place
                end, breaks = _cut(path, data, last, quotes, place.at)
                rest = data[end:]
                if len(rest) > _LONGEST:
                    line = _line_of(path, place.at + end)
                    raise FilesError(f"{path}: line {line}: a record of more than {_LONGEST >> 20} MiB begins here")
                texts = [text for text in _split(data[:end], breaks) if text.strip()]
                place = Place(begin.file, begin.at + end, begin.rows + len(texts))
                if texts:
                    yield Records(texts, place)
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise FilesError(f"{path}: the compressed file is damaged ({error})") from None


def _cut(path: Path, data: bytes, last: bool, quotes: bool, start: int) -> tuple[int, NDArray[np.intp] | None]:
    """Where the last whole record of ``data`` ends; and where records end, unless that is at every line end."""
    open_at = len(data)
    inside: list[tuple[int, int]] = []
    if quotes and b'"' in data:
        for found in _QUOTED.finditer(data):
            begin, end = found.span()
            if not found[1] or (end == len(data) and not last):
                if last:
                    line = _line_of(path, start + begin)
                    raise FilesError(f"{path}: line {line}: a quote opens here and is never closed")
                open_at = begin
                break
            if end < len(data) and data[end] not in b",\r\n":
                line = _line_of(path, start + end)
                raise FilesError(f"{path}: line {line}: text follows a closing quote; inside a cell write it twice")
            if b"\n" in found[0]:
                inside.append((begin, end))
    if not inside:
        return (open_at if last else data.rfind(b"\n", 0, open_at) + 1), None
    breaks = np.flatnonzero(np.frombuffer(data, np.uint8)[:open_at] == 10)
    edges = np.array(inside).ravel()
    breaks = breaks[np.searchsorted(edges, breaks) % 2 == 0]
    end = len(data) if last else (int(breaks[-1]) + 1 if breaks.size else 0)
    return end, breaks


def _split(data: bytes, breaks: NDArray[np.intp] | None) -> list[bytes]:
    if breaks is None:
        lines = data.split(b"\n")
    else:
        ends = [*breaks.tolist(), len(data)]
        lines = [data[begin:end] for begin, end in zip([0, *(e + 1 for e in ends[:-1])], ends, strict=True)]
    return [line[:-1] if line.endswith(b"\r") else line for line in lines] if b"\r" in data else lines


def _line_of(path: Path, offset: int) -> int:
    """The number of the line at a byte, counted only when something is wrong there."""
    line = 1
    with _open(path) as stream:
        while offset > 0 and (data := stream.read(min(offset, 2**20))):
            line += data.count(b"\n")
            offset -= len(data)
    return line


def decoding_fault(path: Path, records: Records, error: Exception) -> FilesError:
    """The error for text that pyarrow could not decode: which record, or pyarrow's message."""
    first = records.place.rows - len(records.texts)
    for i, text in enumerate(records.texts):
        try:
            text.decode()
        except UnicodeDecodeError as fault:
            return FilesError(f"{path}: row {first + i + 1} is not in UTF-8 ({fault.reason})")
    return FilesError(f"{path}: rows {first + 1} to {records.place.rows}: {one_line(error)}")


def one_line(error: Any) -> str:
    """The message of an exception without line ends."""
    return " ".join(str(error).split())

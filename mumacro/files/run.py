"""A run over files of cases that can be killed at any moment: the same command goes on, and gives
the same bytes.

While it runs, ``OUT.parts/log`` holds a line for the plan (inputs with checksums, options, table),
and then the pieces of the output, each behind a note: size and checksum of the piece, what is done
with it, its rejects, and a checksum of the note itself.  Pieces that fit their notes are kept; what
follows them is done again. ``OUT.run.json`` stays: it tells what the output was made of, so that
the same command finds it complete.
"""

import hashlib
import json
import os
import zlib
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import compress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa

from mumacro.files import reading
from mumacro.files.record_batch import (
    REJECTS,
    FilesError,
    added_fields,
    answer_columns,
    find_columns,
)
from mumacro.files.writing import Output, csv_lines
from mumacro.inputs.kind import Kind, kind_of
from mumacro.surrogate import Surrogate
from mumacro.table.atomic import alone_in, put, write_whole
from mumacro.version import __version__


@dataclass(frozen=True)
class Summary:
    """What a run did: rows read, answered, rejected, found done already; the files (``rejects``
    None without any)."""

    rows: int
    answered: int
    rejected: int
    out: Path
    rejects: Path | None
    resumed: int


def evaluate_files(
    given: Sequence[str | Path],
    out: str | Path,
    surrogate: Surrogate,
    *,
    rigid: bool = False,
    include: Sequence[str] = (),
    sep: str = ",",
    decimal: str = ".",
    contact: str = "spring",
    direction: str = "across",
    force: bool = False,
    progress: Callable[[float, int, int], None] = lambda _share, _rows, _rejected: None,
    say: Callable[[str], None] = lambda _text: None,
) -> Summary:
    """Evaluate every case of some files.

    Parameters
    ----------
    given : sequence of path
        Files, folders or patterns; all of one format.
    out : path
        Its ending sets the format.  Rows keep their order; a rejected row is not in it, but in
        ``OUT.rejects.csv``.
    surrogate : Surrogate
    rigid, include, contact, direction
        As in :func:`mumacro.files.answer`.
    sep, decimal : str
        Between the cells of CSV, and within its numbers, read and written.
    force : bool
        Replace an output that exists, and delete the parts of another run.
    progress, say : callable
        Called with the share that is done, rows read and rejected; with one line about what a
        resumed run found.

    Raises
    ------
    FilesError
        An input or output that cannot be used, or an input that changed meanwhile; names it, with
        the remedy.
    BusyError
        Another run writes the same output.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> rows = "mu0,Fz,k,y0 [um],f [kHz],v0\\n0.3,10,rigid,2,20,0.01\\n"
    >>> _ = (folder / "cases.csv").write_text(rows)
    >>> evaluate_files([folder / "cases.csv"], folder / "out.parquet", Surrogate.open()).answered
    1
    """
    try:
        run = _Run(
            given, Path(out), surrogate, rigid, include, sep, decimal, kind_of(contact, direction)
        )
        return run.go(force, progress, say)
    except (
        pa.ArrowException
    ) as error:  # no Parquet, or columns that are unlike or of a type that text cannot hold
        raise FilesError(f"{given[0]}: {error}") from None


class _Done(NamedTuple):
    """What is done with a piece: ``at`` records of a file, rows in all and the rejected ones; its
    rejects as CSV."""

    file: int = 0
    at: int = 0
    rows: int = 0
    rejected: int = 0
    rejects: str = ""


class _Run:
    def __init__(
        self,
        given: Sequence[str | Path],
        out: Path,
        surrogate: Surrogate,
        rigid: bool,
        include: Sequence[str],
        sep: str,
        decimal: str,
        kind: Kind,
    ) -> None:
        if sep == decimal:
            raise FilesError(
                f"--sep and --decimal are both {sep!r}; give another --sep, such as ';'"
            )
        self.files, start = reading.find_files(given)
        end, packed = reading.format_of(out)
        if not end or out.is_dir():
            raise FilesError(f"{out}: must be the name of a file that ends in {reading.ENDINGS}")
        self.out, self.parts, self.rejects, self.record = (
            out.with_name(out.name + ending)
            for ending in ("", ".parts", ".rejects.csv", ".run.json")
        )
        self.log, self.made = self.parts / "log", self.parts / "made"
        for target in (out, self.rejects, self.record, self.log, self.made):
            if target.exists() and any(target.samefile(path) for path in self.files):
                raise FilesError(
                    f"{target}: is an input, and would be overwritten; give another -o"
                )
        self.checksums = [_checksum(path) for path in self.files]
        self.verbatim = start == end != "parquet"
        self.source: reading.ParquetSource | reading.TextSource
        if start == "parquet":
            folder = str(given[0]) if len(given) == 1 and Path(given[0]).is_dir() else None
            self.source = reading.ParquetSource(self.files, folder)
        else:
            self.source = reading.TextSource(
                self.files, sep if start == "csv" else "", decimal, self.verbatim
            )
        places, names = find_columns(
            self.source.schema.names, rigid, include, kind, f"{self.files[0]}: "
        )
        self.how = surrogate, places, names, kind, decimal if start == "csv" else "."
        inputs = [heading for heading, _ in places.values()]
        self.output = Output(end, packed, sep, decimal, places.get("k", (None,))[0])
        copied = [
            field.with_type(pa.float64()) if field.name in inputs and start != "parquet" else field
            for field in self.source.schema
        ]
        self.wanted = inputs if self.verbatim else self.source.schema.names
        fields = [*([] if self.verbatim else copied), *added_fields(names)]
        self.schema = pa.schema(fields, self.source.schema.metadata)
        plan = {
            "version": __version__,
            "table": surrogate.checksum,
            "inputs": [
                [path.name, checksum]
                for path, checksum in zip(self.files, self.checksums, strict=True)
            ],
            "options": [self.output, [*places.items()], kind, names, reading.ROWS],
        }
        self.first = json.dumps(plan).encode() + b"\n"

    def go(
        self, force: bool, progress: Callable[[float, int, int], None], say: Callable[[str], None]
    ) -> Summary:
        """Find what is done, do what is left, and put it into place."""
        with alone_in(self.parts):
            if begun := None if force else self._complete():
                done = begun
                say(f"{self.out}: is complete already; nothing is left to do")
            else:
                begun = self._begin(force, say)
                done = begun or _Done()
                try:
                    # nothing is brought to the disk here: after a loss of power the checksums tell
                    # what is there
                    with self.log.open("ab") as log:
                        for done, text, share in self._evaluated(begun):
                            note = json.dumps([len(text), zlib.crc32(text), *done]).encode()
                            log.write(b"%08x %b\n" % (zlib.crc32(note), note))
                            log.write(text)
                            log.flush()
                            progress(share, done.rows, done.rejected)
                except (
                    FilesError,
                    pa.ArrowException,
                ):  # an input must be changed before this run can end
                    self._clear()
                    self._refuse_changed()  # first: what was half written looks like a damaged row
                    raise
                self._finish(done)
            self._clear()
        rows, rejected, resumed = done.rows, done.rejected, begun.rows if begun else 0
        return Summary(
            rows, rows - rejected, rejected, self.out, self.rejects if rejected else None, resumed
        )

    def _complete(self) -> _Done | None:
        """What an earlier run of the same command has done, if its files are as it left them."""
        with suppress(OSError, ValueError, KeyError, TypeError):
            record = json.loads(self.record.read_bytes())
            done = _Done(rows=record["rows"], rejected=record["rejected"])
            return done if record == self._record(done) else None
        return None

    def _record(self, done: _Done) -> dict[str, Any]:
        """What ``OUT.run.json`` holds; the files with their content."""
        checksums = [
            _checksum(path) for path in ([self.out, self.rejects] if done.rejected else [self.out])
        ]
        return {
            "rows": done.rows,
            "rejected": done.rejected,
            "files": checksums,
            "plan": json.loads(self.first),
        }

    def _begin(self, force: bool, say: Callable[[str], None]) -> _Done | None:
        """Keep what is sound of an earlier run of the same command, or make a new beginning."""
        found = b""
        with suppress(FileNotFoundError), self.log.open("rb") as log:
            found = log.readline()
        if found == self.first:
            (done, end), *_ = deque(((done, end) for done, _, end in self._kept()), 1) or [
                (None, len(found))
            ]
            more = "; what follows them was cut or changed, and is done again" * (
                end < self.log.stat().st_size
            )
            os.truncate(self.log, end)
            rows, rejected = (done or _Done())[2:4]
            say(f"{self.parts}: {rows:,} rows are done already ({rejected:,} rejected){more}")
            return done
        if found and not force:
            plan, old = json.loads(self.first), json.loads(found)
            differ = ", ".join(name for name in plan if old.get(name) != plan[name])
            raise FilesError(
                f"{self.parts}: has parts of another run ({differ} differ); --force deletes them"
            )
        for path in (self.out, self.rejects):
            if path.exists() and not force:
                raise FilesError(f"{path}: exists already; --force replaces it")
        self._clear()
        write_whole(self.log, self.first)
        return None

    def _kept(self) -> Iterator[tuple[_Done, bytes, int]]:
        """What the log holds, as far as it is sound: pieces with what is done, and where they
        end."""
        with self.log.open("rb") as log:
            log.readline()
            while line := log.readline():
                note = line[9:-1]
                if line != b"%08x %b\n" % (zlib.crc32(note), note):
                    return
                size, checksum, *done = json.loads(note)
                text = log.read(size)
                if zlib.crc32(text) != checksum:
                    return
                yield _Done(*done), text, log.tell()

    def _evaluated(self, done: _Done | None) -> Iterator[tuple[_Done, bytes, float]]:
        """What follows a piece, with the share of the input that is read; from the beginning, the
        head comes first."""
        if done is None:
            heads = csv_lines(
                [[*(self.source.head if self.verbatim else ()), *self.schema.names]],
                self.output.sep,
            )
            done = _Done(rejects=csv_lines([["file"] * (len(self.files) > 1) + REJECTS.names]))
            yield done, self.output.pack(heads) if self.output.kind == "csv" else b"", 0.0
        for file in range(done.file, len(self.files)):
            done = done if file == done.file else done._replace(file=file, at=0)
            for block in self.source.blocks(file, done.at, self.wanted):
                done, text = self._piece(done, block)
                yield done, text, (file + block.share) / len(self.files)
        self._refuse_changed()

    def _refuse_changed(self) -> None:
        for path, checksum in zip(self.files, self.checksums, strict=True):
            if _checksum(path) != checksum:
                raise FilesError(
                    f"{path}: changed while it was read; give the command again"
                ) from None

    def _piece(self, done: _Done, block: reading.Block) -> tuple[_Done, bytes]:
        """A block as it stands in the output, and what is done with it."""
        added, rejects, given = answer_columns(block.batch, *self.how)
        faults = {row: why for row, *why in rejects}
        faults |= {i: [None, text, why] for i, text, why in block.wrong}
        columns = [
            column if column.type == field.type else pa.array(given[field.name])
            for field, column in zip(
                self.schema, [] if self.verbatim else block.batch.columns, strict=False
            )
        ]
        batch, texts = (
            pa.RecordBatch.from_arrays([*columns, *added], schema=self.schema),
            block.texts,
        )
        if faults:
            kept = np.ones(len(batch), np.bool_)
            kept[[*faults]] = False
            batch, texts = batch.filter(pa.array(kept)), [*compress(texts, kept)]
        file = [self.files[done.file]] * (len(self.files) > 1)
        listed = csv_lines([*file, done.at + i + 1, *why] for i, why in faults.items())
        n, rejected = len(block.batch), done.rejected + len(faults)
        text = self.output.piece(batch, texts if self.verbatim else None)
        return _Done(done.file, done.at + n, done.rows + n, rejected, listed), text

    def _finish(self, done: _Done) -> None:
        """Put the files into place; a run that is stopped here does this again."""
        if done.rejected:
            with self.made.open(
                "w", encoding="utf-8", errors="surrogateescape", newline=""
            ) as stream:
                stream.writelines(kept.rejects for kept, *_ in self._kept())
            put(self.made, self.rejects)
        else:
            self.rejects.unlink(missing_ok=True)
        self.output.whole(self.made, self.schema, (text for _, text, _ in self._kept() if text))
        put(self.made, self.out)
        write_whole(self.record, json.dumps(self._record(done), indent=1).encode())

    def _clear(self) -> None:
        for path in (self.made, self.log):
            path.unlink(missing_ok=True)


def _checksum(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()

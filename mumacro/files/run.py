"""A run over files of cases that can be killed at any moment: the same command goes on, and gives
the same bytes.

While it runs, ``OUT.parts/log`` holds a line for the plan (inputs with checksums, options, table),
and then the pieces of the output, each behind a note: size and checksum of the piece, the state
after it, its rejects, and a checksum of the note itself.  Pieces that fit their notes are kept;
the rest is done again.  ``OUT.run.json`` stays: it records how the output was made, so that the
same command recognises it as complete.
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
from mumacro.files.errors import FilesError
from mumacro.files.record_batch import (
    REJECTS,
    added_fields,
    answer_columns,
    find_columns,
    wanted_columns,
)
from mumacro.files.text_source import Block
from mumacro.files.writing import Output, csv_lines, written_as
from mumacro.inputs.kind import Kind, kind_of
from mumacro.inputs.text_tables import Dialect
from mumacro.surrogate import Surrogate
from mumacro.table.atomic import alone_in, put, write_whole
from mumacro.version import __version__


@dataclass(frozen=True)
class Summary:
    """What a run did: rows read, answered, rejected, and kept from an earlier run; the files
    (``rejects`` is None without any)."""

    rows: int
    answered: int
    rejected: int
    out: Path
    rejects: Path | None
    resumed: int


def evaluate_files(
    cases: Sequence[str | Path],
    out: str | Path,
    surrogate: Surrogate,
    *,
    rigid: bool = False,
    include: Sequence[str] = (),
    dialect: Dialect = Dialect(),  # noqa: B008
    contact: str = "spring",
    direction: str = "across",
    force: bool = False,
    progress: Callable[[float, int, int], None] = lambda _share, _rows, _rejected: None,
    say: Callable[[str], None] = lambda _text: None,
) -> Summary:
    """Evaluate every case of some files.

    Parameters
    ----------
    cases : sequence of path
        Files, folders or patterns; all of one format.
    out : path
        Its ending sets the format.  Rows keep their order; a rejected row is not in it, but in
        ``OUT.rejects.csv``.
    surrogate : Surrogate
    rigid, include, contact, direction
        As in :func:`mumacro.files.answer`.
    dialect : mumacro.inputs.text_tables.Dialect
        How tables as text are written, as far as it is known; the rest is found in the files.  A
        separator and a decimal sign hold for an output as text, too.
    force : bool
        Replace an output that exists, and delete the parts of another run.
    progress, say : callable
        Called with the finished share, rows read and rejected; with one line about how a table
        as text is read, which files of a folder are left out, what a resumed run keeps.

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
        kind = kind_of(contact, direction)
        run = _Run(cases, Path(out), surrogate, rigid, include, dialect, kind, say)
        return run.go(force, progress, say)
    except (
        pa.ArrowException
    ) as error:  # no Parquet, or columns that are unlike or of a type that text cannot hold
        raise FilesError(f"{cases[0]}: {error}") from None


class _State(NamedTuple):
    """How far the run is after a piece: ``at`` records of a file, all rows and the rejected ones;
    the piece's rejects as CSV."""

    file: int = 0
    at: int = 0
    rows: int = 0
    rejected: int = 0
    rejects: str = ""


class _Run:
    def __init__(
        self,
        cases: Sequence[str | Path],
        out: Path,
        surrogate: Surrogate,
        rigid: bool,
        include: Sequence[str],
        dialect: Dialect,
        kind: Kind,
        say: Callable[[str], None],
    ) -> None:
        self.files, input_format = reading.find_files(cases, say)
        output_format, compressed = reading.format_of(out)
        if not output_format or out.is_dir():
            raise FilesError(f"{out}: must be the name of a file that ends in {reading.ENDINGS}")
        self.out, self.parts, self.rejects, self.record = (
            out.with_name(out.name + ending)
            for ending in ("", ".parts", ".rejects.csv", ".run.json")
        )
        self.log, self.unfinished = self.parts / "log", self.parts / "made"
        for output in (out, self.rejects, self.record, self.log, self.unfinished):
            if output.exists() and any(output.samefile(path) for path in self.files):
                raise FilesError(
                    f"{output}: is an input, and would be overwritten; give another -o"
                )
        self.checksums = [_checksum(path) for path in self.files]
        self.verbatim = input_format == output_format != "parquet"
        self.source: reading.ParquetSource | reading.TextSource | reading.NdjsonSource
        where = f"{self.files[0]}: "
        if input_format == "parquet":
            folder = str(cases[0]) if len(cases) == 1 and Path(cases[0]).is_dir() else None
            self.source = reading.ParquetSource(self.files, folder)
        elif input_format == "ndjson":
            self.source = reading.NdjsonSource(self.files, self.verbatim)
        else:
            self.source = reading.TextSource(
                self.files, dialect, wanted_columns(rigid), self.verbatim
            )
            where = self.source.where
        headings, names = find_columns(self.source.schema.names, rigid, include, kind, where)
        self.evaluation = (surrogate, headings, names, kind)
        sep, decimal = written_as(
            reading.ending_of(out), self.source.sep, self.source.decimal, dialect
        )
        input_headings = [heading for heading, _ in headings.values()]
        self.output = Output(output_format, compressed, sep, decimal, headings.get("k", (None,))[0])
        if isinstance(self.source, reading.TextSource):
            self.source.write_with(sep)
            self.source.describe(say)
        input_fields = [
            field.with_type(pa.float64())
            if field.name in input_headings and input_format != "parquet"
            else field
            for field in self.source.schema
        ]
        self.columns_read = input_headings if self.verbatim else self.source.schema.names
        fields = [*([] if self.verbatim else input_fields), *added_fields(names)]
        self.schema = pa.schema(fields, self.source.schema.metadata)
        plan = {
            "version": __version__,
            "table": surrogate.checksum,
            "inputs": [
                [path.name, checksum]
                for path, checksum in zip(self.files, self.checksums, strict=True)
            ],
            "options": [self.output, [*headings.items()], kind, names, reading.ROWS],
        }
        self.plan_line = json.dumps(plan).encode() + b"\n"

    def go(
        self, force: bool, progress: Callable[[float, int, int], None], say: Callable[[str], None]
    ) -> Summary:
        """Keep the sound pieces of an earlier run, do the rest, and put the files into place."""
        with alone_in(self.parts):
            if earlier := None if force else self._complete():
                state = earlier
                say(f"{self.out}: is complete already; nothing is left to do")
            else:
                earlier = self._begin(force, say)
                state = earlier or _State()
                try:
                    # no flush to the disk here: after a loss of power the checksums show which
                    # pieces are whole
                    with self.log.open("ab") as log:
                        for state, text, share in self._new_pieces(earlier):
                            note = json.dumps([len(text), zlib.crc32(text), *state]).encode()
                            log.write(b"%08x %b\n" % (zlib.crc32(note), note))
                            log.write(text)
                            log.flush()
                            progress(share, state.rows, state.rejected)
                except (
                    FilesError,
                    pa.ArrowException,
                ):  # an input must be changed before this run can end
                    self._clear()
                    self._refuse_changed()  # first: a half-written input looks damaged
                    raise
                self._finish(state)
            self._clear()
        rows, rejected, rows_before = state.rows, state.rejected, earlier.rows if earlier else 0
        return Summary(
            rows,
            rows - rejected,
            rejected,
            self.out,
            self.rejects if rejected else None,
            rows_before,
        )

    def _complete(self) -> _State | None:
        """The last state of an earlier run of the same command, if its files are unchanged."""
        with suppress(OSError, ValueError, KeyError, TypeError):
            record = json.loads(self.record.read_bytes())
            state = _State(rows=record["rows"], rejected=record["rejected"])
            return state if record == self._record(state) else None
        return None

    def _record(self, state: _State) -> dict[str, Any]:
        """The content of ``OUT.run.json``: rows, the plan, and the checksums of the files."""
        checksums = [
            _checksum(path) for path in ([self.out, self.rejects] if state.rejected else [self.out])
        ]
        return {
            "rows": state.rows,
            "rejected": state.rejected,
            "files": checksums,
            "plan": json.loads(self.plan_line),
        }

    def _begin(self, force: bool, say: Callable[[str], None]) -> _State | None:
        """Keep the sound pieces of an earlier run of the same command, or start anew."""
        first_line = b""
        with suppress(FileNotFoundError), self.log.open("rb") as log:
            first_line = log.readline()
        if first_line == self.plan_line:
            (state, end), *_ = deque(
                ((state, end) for state, _, end in self._sound_pieces()), 1
            ) or [(None, len(first_line))]
            remark = "; what follows them was cut or changed, and is done again" * (
                end < self.log.stat().st_size
            )
            os.truncate(self.log, end)
            rows, rejected = (state or _State())[2:4]
            say(f"{self.parts}: {rows:,} rows are done already ({rejected:,} rejected){remark}")
            return state
        if first_line and not force:
            plan, earlier_plan = json.loads(self.plan_line), json.loads(first_line)
            differences = ", ".join(name for name in plan if earlier_plan.get(name) != plan[name])
            raise FilesError(
                f"{self.parts}: has parts of another run ({differences} differ); "
                "--force deletes them"
            )
        for path in (self.out, self.rejects):
            if path.exists() and not force:
                raise FilesError(f"{path}: exists already; --force replaces it")
        self._clear()
        write_whole(self.log, self.plan_line)
        return None

    def _sound_pieces(self) -> Iterator[tuple[_State, bytes, int]]:
        """The sound pieces of the log: the state after each, its text, and where it ends."""
        with self.log.open("rb") as log:
            log.readline()
            while line := log.readline():
                note = line[9:-1]
                if line != b"%08x %b\n" % (zlib.crc32(note), note):
                    return
                size, checksum, *state = json.loads(note)
                text = log.read(size)
                if zlib.crc32(text) != checksum:
                    return
                yield _State(*state), text, log.tell()

    def _new_pieces(self, state: _State | None) -> Iterator[tuple[_State, bytes, float]]:
        """The pieces that follow a state, with the share of the input that is read; at the
        beginning the head comes first."""
        if state is None:
            copied = self.source.head if self.verbatim else ()
            headings = csv_lines([[*copied, *self.schema.names]], self.output.sep)
            state = _State(rejects=csv_lines([self._rejects_head()]))
            mark = "\ufeff" * (self.verbatim and self.source.has_mark)
            text = self.output.pack(mark + headings) if self.output.format == "text" else b""
            yield state, text, 0.0
        for file in range(state.file, len(self.files)):
            done = state.at if file == state.file else 0
            state = state if file == state.file else state._replace(file=file, at=0)
            row = 0
            for block in self.source.blocks(file, self.columns_read):
                row += len(block.batch)
                if row > done:
                    state, piece = self._piece(state, block)
                    yield state, piece, (file + block.share) / len(self.files)
        self._refuse_changed()

    def _refuse_changed(self) -> None:
        for path, checksum in zip(self.files, self.checksums, strict=True):
            if _checksum(path) != checksum:
                raise FilesError(
                    f"{path}: changed while it was read; give the command again"
                ) from None

    def _rejects_head(self) -> list[str]:
        where = REJECTS.names[0] if isinstance(self.source, reading.ParquetSource) else "line"
        return [*["file"] * (len(self.files) > 1), where, *REJECTS.names[1:]]

    def _piece(self, state: _State, block: Block) -> tuple[_State, bytes]:
        """A block as it stands in the output, and the state after it."""
        added, rejects, columns_in = answer_columns(block.batch, *self.evaluation, block.signs)
        faults = {row: reason for row, *reason in rejects}
        faults |= {i: [None, text, reason] for i, text, reason in block.unreadable}
        columns = [
            column if column.type == field.type else pa.array(columns_in[field.name])
            for field, column in zip(
                self.schema, [] if self.verbatim else block.batch.columns, strict=False
            )
        ]
        batch, texts = (
            pa.RecordBatch.from_arrays([*columns, *added], schema=self.schema),
            block.texts,
        )
        if faults:
            accepted = np.ones(len(batch), np.bool_)
            accepted[[*faults]] = False
            batch, texts = batch.filter(pa.array(accepted)), [*compress(texts, accepted)]
        file = [self.files[state.file]] * (len(self.files) > 1)
        reject_lines = csv_lines([*file, block.lines[i], *reason] for i, reason in faults.items())
        n, rejected = len(block.batch), state.rejected + len(faults)
        text = self.output.piece(batch, texts if self.verbatim else None)
        return _State(state.file, state.at + n, state.rows + n, rejected, reject_lines), text

    def _finish(self, state: _State) -> None:
        """Put the files into place; a run that is stopped here does this again."""
        if state.rejected:
            with self.unfinished.open(
                "w", encoding="utf-8", errors="surrogateescape", newline=""
            ) as stream:
                stream.writelines(state_before.rejects for state_before, *_ in self._sound_pieces())
            put(self.unfinished, self.rejects)
        else:
            self.rejects.unlink(missing_ok=True)
        self.output.whole(
            self.unfinished, self.schema, (text for _, text, _ in self._sound_pieces() if text)
        )
        put(self.unfinished, self.out)
        write_whole(self.record, json.dumps(self._record(state), indent=1).encode())

    def _clear(self) -> None:
        for path in (self.unfinished, self.log):
            path.unlink(missing_ok=True)


def _checksum(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()

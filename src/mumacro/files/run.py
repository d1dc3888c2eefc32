"""Evaluate files of cases in one run.  The output appears complete or not at all."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa

from mumacro.files import sources
from mumacro.files.record_batch import (
    REJECTS,
    FilesError,
    answer_columns,
    answer_fields,
    find_columns,
    kind_of_batch,
    names_of_columns,
)
from mumacro.files.sources import ParquetSource, RowBlock, TextSource
from mumacro.files.writing import OutputFormat, csv_lines, written_as
from mumacro.inputs.cases import KIND
from mumacro.inputs.fields import Kind, kind_of
from mumacro.inputs.layout import Dialect
from mumacro.results import Note, Remark, add
from mumacro.surrogate import Surrogate
from mumacro.table.atomic import growing, to_disk


@dataclass(frozen=True)
class Summary:
    """Tell what a run did: rows read, answered and rejected; the files (``rejects`` is None if
    there are no rejects); remarks."""

    rows: int
    answered: int
    rejected: int
    out: Path
    rejects: Path | None
    remarks: list[Remark]


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

    A run that fails or is interrupted leaves an older output unchanged, and no other file.

    Parameters
    ----------
    cases : sequence of path
        Files, folders or patterns; all of one format.
    out : path
        Its file extension sets the format.  Rows keep their order; a rejected row is not in it but
        in ``OUT.rejects.csv``.
    surrogate : Surrogate
    rigid, include, contact, direction
        As in :func:`mumacro.files.answer`.
    dialect : mumacro.inputs.layout.Dialect
        How tables as text are written, if it is known; the rest is found from the files.  A
        separator and a decimal separator also hold for an output as text.
    force : bool
        Whether to replace an output that exists.
    progress, say : callable
        ``progress`` is called with the finished fraction, rows read and rows rejected.  ``say`` is
        called with one line about how a table as text is read, and which files of a folder are left
        out.

    Raises
    ------
    FilesError
        If an input or output cannot be used, or an input changed during the run; the message names
        it, with the remedy.

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
        return run.evaluate(force, progress)
    except (
        pa.ArrowException
    ) as error:  # no Parquet, or columns that differ or have a type that text cannot hold
        raise FilesError(f"{cases[0]}: {error}") from None


class _Run:
    """Hold what a run reads and writes, and how far it is."""

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
        self.files = sources.find_files(cases, say)
        ending = sources.ending_of(out)
        if ending not in sources.WRITTEN or out.is_dir():
            raise FilesError(f"{out}: must be the name of a file that ends in {sources.ENDINGS}")
        self.out, self.rejects = out, out.with_name(f"{out.name}.rejects.csv")
        for output in (self.out, self.rejects):
            if output.exists() and any(output.samefile(path) for path in self.files):
                raise FilesError(
                    f"{output}: is an input, and would be overwritten; give another -o"
                )
        self.n_rows = self.n_rejected = 0  # so far
        self.states_at_start = [_state_of(path) for path in self.files]
        is_text = sources.ending_of(self.files[0]) != sources.PARQUET
        #: rows of a text are written as they were read, with the answers after them
        self.keeps_lines = is_text and ending != sources.PARQUET
        folder = str(cases[0]) if len(cases) == 1 and Path(cases[0]).is_dir() else None
        self.source = (
            TextSource(self.files, dialect, names_of_columns(rigid), self.keeps_lines)
            if is_text
            else ParquetSource(self.files, folder)
        )
        self.surrogate, self.say, self.notes = surrogate, say, list[Note]()
        names, where = self.source.schema.names, self.source.where
        if words := [name for name in KIND if name in names]:
            first = next(self.source.blocks(0, words), None)
            kind = kind if first is None else kind_of_batch(first.batch, kind, where)
        self.columns = find_columns(names, rigid, include, kind, where, self.source.units)
        headings = self.columns.headings
        sep, decimal = written_as(ending, self.source.sep, self.source.decimal, dialect)
        self.output = OutputFormat(
            ending == sources.PARQUET,
            out.name.lower().endswith(".gz"),
            sep,
            decimal,
            headings.get("k", (None,))[0],
        )
        inputs = [heading for heading, _ in headings.values()]
        self.columns_read = [*inputs, *self.columns.words] if self.keeps_lines else names
        copied = [
            field.with_type(pa.float64()) if is_text and field.name in inputs else field
            for field in ([] if self.keeps_lines else self.source.schema)
        ]
        fields = [*copied, *answer_fields(self.columns.answer_names)]
        self.schema = pa.schema(fields, self.source.schema.metadata)

    def evaluate(self, force: bool, progress: Callable[[float, int, int], None]) -> Summary:
        """Evaluate piece by piece, and move the files to their places."""
        for path in (self.out, self.rejects):
            if path.exists() and not force:
                raise FilesError(f"{path}: exists already; --force replaces it")
        rejects = None
        with ExitStack() as files:  # the rejects are moved to their place before the output
            stream = files.enter_context(growing(self.out))
            try:
                with self.output.writing(stream, self.schema) as write:
                    for piece, lines, share in self._new_pieces():
                        write(piece)
                        if lines:
                            rejects = rejects or self._opened_rejects(files)
                            rejects.write(lines.encode("utf-8", "surrogateescape"))
                        progress(share, self.n_rows, self.n_rejected)
            except (FilesError, pa.ArrowException):
                self._refuse_changed()  # first, because a half-written input looks damaged
                raise
            to_disk(stream)  # a full disk refuses this, before the rejects are in place
        if rejects is None:
            self.rejects.unlink(missing_ok=True)
        return Summary(
            self.n_rows,
            self.n_rows - self.n_rejected,
            self.n_rejected,
            self.out,
            None if rejects is None else self.rejects,
            [note.as_remark for note in self.notes],
        )

    def _opened_rejects(self, files: ExitStack) -> BinaryIO:
        stream = files.enter_context(growing(self.rejects))
        where = REJECTS.names[0] if isinstance(self.source, ParquetSource) else "line"
        head = [*["file"] * (len(self.files) > 1), where, *REJECTS.names[1:]]
        stream.write(csv_lines([head]).encode())
        return stream

    def _new_pieces(self) -> Iterator[tuple[Any, str, float]]:
        """Yield the pieces of the output, with the lines of rejects after each and the fraction of
        the input that was read.  The header comes first."""
        if not self.output.is_parquet:
            headings = [*(self.source.schema.names if self.keeps_lines else ()), *self.schema.names]
            mark = "\ufeff" if self.source.has_mark else ""
            yield self.output.pack(mark + csv_lines([headings], self.output.sep)), "", 0.0
        for file, path in enumerate(self.files):
            name = [path] * (len(self.files) > 1)
            for block in self.source.blocks(file, self.columns_read):
                piece, faults = self._piece(block)
                self.n_rows += len(block.batch)
                self.n_rejected += len(faults)
                rows = ([*name, block.rows.lines[i], *reason] for i, reason in faults.items())
                yield piece, csv_lines(rows), (file + block.rows.share) / len(self.files)
        self._refuse_changed()
        self.source.describe(self.say)

    def _refuse_changed(self) -> None:
        for path, beginning in zip(self.files, self.states_at_start, strict=True):
            if _state_of(path) != beginning:
                raise FilesError(
                    f"{path}: changed while it was read; give the command again"
                ) from None

    def _piece(self, block: RowBlock) -> tuple[Any, dict[int, tuple[str | None, Any, str]]]:
        """Return a block as the output has it, and by the index of a rejected row its input, the
        cell and the reason."""
        rows, keeps_lines = block.rows, self.keeps_lines
        answers, rejects, inputs, notes = answer_columns(
            block.batch, self.surrogate, self.columns, block.signs
        )
        for note in notes:
            add(self.notes, note)
        faults: dict[int, tuple[str | None, Any, str]] = {
            i: (name, self.source.cell(block, i, self.columns.headings[name][0]), reason)
            for i, name, reason in rejects
        }
        faults |= {i: (None, text, reason) for i, (text, reason) in rows.faults.items()}
        copied = [
            column if column.type == field.type else pa.array(inputs[field.name])
            for field, column in zip(
                self.schema, [] if keeps_lines else block.batch.columns, strict=False
            )
        ]
        batch = pa.RecordBatch.from_arrays([*copied, *answers], schema=self.schema)
        lines = pa.array(rows.written(self.output.sep), pa.string()) if keeps_lines else None
        if faults:
            keep = np.ones(len(batch), np.bool_)
            keep[[*faults]] = False
            batch = batch.filter(pa.array(keep))
            lines = None if lines is None else lines.filter(pa.array(keep))
        return self.output.piece(batch, lines), faults


def _state_of(path: Path) -> tuple[int, ...]:
    """Return values that change when a file changes."""
    is_now = path.stat()
    return is_now.st_ino, is_now.st_size, is_now.st_mtime_ns

"""A run over files of cases: parts, a note of each, resuming after a stop, one output of all parts.

While it runs, ``OUT.parts`` holds a plan (inputs, options and table), the finished parts, and a note of
each with the place where the next one begins.  A part that has its note is never made again, and one without it is
written again from the place that the note before it names, with the same bytes.
"""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa

from mumacro.files.answering import added_fields, answer_columns, numbers
from mumacro.files.blocks import Block, Fault, Place
from mumacro.files.columns import FilesError, find_columns
from mumacro.files.reading import FORMATS, Source, format_of, open_source
from mumacro.files.writing import join_parts, open_part
from mumacro.surrogate import Surrogate
from mumacro.version import __version__
from mumacro.writing import alone_in, sync_folder, write_whole

__all__ = ["PART_ROWS", "Summary", "evaluate_files", "find_files"]

#: rows of a part by default: joining Parquet means writing it twice, joining text means copying
PART_ROWS = {"parquet": 10_000_000, "csv": 1_000_000, "ndjson": 1_000_000}
ON_ERROR = ("list", "stop")
Progress = Callable[[float, int, int], None]


@dataclass(frozen=True)
class Summary:
    """What a run did: rows read, answered, rejected, found done already; the files (``rejects`` None without any)."""

    rows: int
    answered: int
    rejected: int
    out: Path
    rejects: Path | None
    resumed: int


@dataclass
class _Note:
    """The contents of a part, and where the next one begins."""

    place: Place
    rows: int = 0
    rejected: int = 0


def find_files(given: Sequence[str | Path]) -> tuple[list[Path], str, Path | None]:
    """The files that paths, folders and patterns name, in order, their format, and the folder if it was one alone.

    Raises
    ------
    FilesError
        Nothing is there, a file has another ending, or the formats differ.
    """
    files: list[Path] = []
    folder = None
    for entry in given:
        path = Path(entry)
        if path.is_dir():
            found = sorted(p for p in path.rglob("*") if p.is_file() and format_of(p) and p.name[0] not in "._")
            folder = path if len(given) == 1 else None
        elif path.exists() or not any(c in str(entry) for c in "*?["):
            found = [path]
        else:
            base = Path(path.anchor) if path.is_absolute() else Path()
            found = sorted(p for p in base.glob(str(path.relative_to(base))) if p.is_file())
        if not found:
            raise FilesError(f"{entry}: there is no file that ends in {', '.join(FORMATS)} (text also .gz)")
        files += found
    kinds = set()
    for path in files:
        if not path.is_file():
            raise FilesError(f"{path}: no such file")
        kind = format_of(path)
        if kind is None:
            raise FilesError(f"{path}: the name must end in {', '.join(FORMATS)} (text also .gz)")
        kinds.add(kind[0])
    if len(kinds) > 1:
        raise FilesError(f"the files are of several formats: {', '.join(sorted(kinds))}")
    return files, kinds.pop(), folder


def evaluate_files(
    given: Sequence[str | Path],
    out: str | Path,
    surrogate: Surrogate,
    *,
    rigid: bool = False,
    include: Sequence[str] = (),
    on_error: str = "list",
    force: bool = False,
    part_rows: int | None = None,
    progress: Progress = lambda _share, _rows, _rejected: None,
) -> Summary:
    """Evaluate every case of some files.

    Parameters
    ----------
    given : sequence of path
        Files, folders or patterns; all of one format.
    out : path
        A file, whose ending sets the format, or a folder (that exists, or ends in ``/``) for a file a part, in the
        format of the input.  Rows keep their order; a rejected row is not in it, but in ``OUT.rejects.csv``.
    surrogate : Surrogate
        The table.
    rigid : bool
        All contacts are rigid and there is no column k.
    include : sequence of str
        ``"gradient"`` adds d mu_macro / d input.
    on_error : str
        ``"list"`` puts rejected rows into the side file, ``"stop"`` raises at the first one.
    force : bool
        Replace an output that exists, and delete the parts of another run.
    part_rows : int, optional
        Rows after which a part ends: what a stopped run loses at the most.  Left out: 10 million of Parquet, 1 million
        of text.
    progress : callable
        Called with the share that is done, rows read and rows rejected.

    Returns
    -------
    Summary
        What was done.

    Raises
    ------
    FilesError
        An input or output that cannot be used; names it, with the remedy.
    BusyError
        Another run writes the same output.
    """
    run = _Run(given, out, surrogate, rigid, include, on_error, part_rows)
    with alone_in(run.parts):
        run.begin(force)
        return run.finish(*run.answer(progress))


class _Run:
    def __init__(
        self,
        given: Sequence[str | Path],
        out: str | Path,
        surrogate: Surrogate,
        rigid: bool,
        include: Sequence[str],
        on_error: str,
        part_rows: int | None,
    ) -> None:
        files, kind, folder = find_files(given)
        self.source: Source = open_source(files, kind, folder)
        self.surrogate, self.include, self.on_error = surrogate, include, on_error
        self.folder = str(out).endswith(("/", os.sep)) or Path(out).is_dir()
        self.out = Path(out)
        told = (kind, False) if self.folder else format_of(self.out)
        if told is None:
            raise FilesError(f"{out}: the name must end in {', '.join(FORMATS)} (text also .gz), or in / for a folder")
        self.kind, self.packed = told
        self.part_rows = part_rows or PART_ROWS[self.kind]
        if not self.out.parent.is_dir():
            raise FilesError(f"{self.out.parent}: no such folder")
        if self.out.resolve() in {path.resolve() for path in files}:
            raise FilesError(f"{out}: is an input")
        self.added = added_fields(include)
        names = [field.name for field in self.added]
        try:
            self.columns = find_columns(self.source.names, rigid, names)
        except FilesError as error:
            raise FilesError(f"{files[0]}: {error}") from None
        verbatim = kind == self.kind and kind != "parquet"
        self.source.settle(self.columns, verbatim, self.part_rows)
        self.verbatim = verbatim
        given_fields = [] if verbatim else [self._out_field(field) for field in self.source.schema]
        self.schema = pa.schema([*given_fields, *self.added], self.source.schema.metadata)
        headings = [*(self.source.names if verbatim else self.schema.names), *(names if verbatim else [])]
        self.header = _csv_line(headings) if self.kind == "csv" else b""
        self.suffix = "".join([f".{self.kind}", ".gz" if self.packed else ""])
        self.parts = self.out.with_name(self.out.name + ".parts")
        self.rejects = self.out.with_name(self.out.name + ".rejects.csv")
        self.plan = {
            "version": __version__,
            "files": [[str(path.resolve()), path.stat().st_size, path.stat().st_mtime_ns] for path in files],
            "columns": {name: [column, *scale] for name, (column, scale) in self.columns.places.items()},
            "options": [self.kind, self.packed, list(include), on_error, self.part_rows],
            "table": surrogate.checksum,
        }

    def _out_field(self, field: pa.Field) -> pa.Field:
        """Inputs that were cells of text are written as numbers; all else is unchanged."""
        inputs = {column for column, _ in self.columns.places.values()}
        return field.with_type(pa.float64()) if self.source.cells_are_text and field.name in inputs else field

    # --- begin --------------------------------------------------------------------------------------

    def begin(self, force: bool) -> None:
        """Take over the parts of an earlier run of the same command, or make a folder for them."""
        plan = json.dumps(self.plan).encode()
        kept = self.parts / "plan.json"
        if not (kept.is_file() and kept.read_bytes() == plan):
            if not force and any(path.name[0] != "." for path in self.parts.iterdir()):
                raise FilesError(
                    f"{self.parts}: has parts of another run (input, options or table differ); --force deletes them"
                )
            if not force:
                self._check_free()
            self._clear()
            write_whole(kept, plan)

    def _clear(self) -> None:
        """Empty the folder of parts.  In this order a stopped run can resume: last note, parts, plan.json."""
        found = sorted(self.parts.iterdir(), reverse=True)
        for path in sorted(found, key=lambda path: (path.name == "plan.json", path.suffix != ".json")):
            path.unlink()

    def _check_free(self) -> None:
        taken = [*self.out.glob("part-*")] if self.folder else [self.out] * self.out.exists()
        taken += [self.rejects] * self.rejects.exists()
        if taken:
            raise FilesError(f"{taken[0]}: exists already; --force replaces it")

    # --- answer -------------------------------------------------------------------------------------

    def answer(self, progress: Progress) -> tuple[list[_Note], int]:
        """Make every part that is not there; return the notes, and how many rows were there already."""
        notes: list[_Note] = []
        place, rows, rejected = Place(), 0, 0
        while (note := self._noted(len(notes))) is not None:
            notes.append(note)
            place, rows, rejected = note.place, rows + note.rows, rejected + note.rejected
        resumed = rows
        blocks = self._blocks(place)
        while place.file < len(self.source.files):
            note = self._make_part(len(notes), place, blocks, partial(_added, progress, rows, rejected))
            notes.append(note)
            place, rows, rejected = note.place, rows + note.rows, rejected + note.rejected
        progress(1.0, rows, rejected)
        return notes, resumed

    def _blocks(self, place: Place) -> Iterator[tuple[Block, bool]]:
        """All blocks from ``place`` on, of this file and those after it, and whether one is the last."""
        held = None
        for file in range(place.file, len(self.source.files)):
            for block in self.source.blocks(place if file == place.file else Place(file)):
                if held is not None:
                    yield held, False
                held = block
        if held is not None:
            yield held, True

    def _path(self, number: int, suffix: str) -> Path:
        return self.parts / f"part-{number:05d}{suffix}"

    def _noted(self, number: int) -> _Note | None:
        try:
            found = json.loads(self._path(number, ".json").read_text("utf-8"))
        except FileNotFoundError:
            return None
        return _Note(Place(*found["place"]), found["rows"], found["rejected"])

    def _make_part(self, number: int, place: Place, blocks: Iterator[tuple[Block, bool]], progress: Progress) -> _Note:
        header = self.header if self.folder else b""
        part = open_part(self._path(number, self.suffix), self.kind, self.packed, self.schema, header)
        note = _Note(place)
        rejects = io.StringIO(newline="")
        try:
            last = True
            for block, last in blocks:  # noqa: B007 (also after the loop)
                batch, faults = self._answered(block)
                note.place, note.rows = block.place, note.rows + batch.num_rows + len(faults)
                note.rejected += len(faults)
                self._list(rejects, self.source.files[block.place.file], faults)
                part.write(batch, block.lines, len(self.added))
                progress(self.source.done(note.place), note.rows, note.rejected)
                if note.rows >= self.part_rows:
                    break
            if last:
                note.place = Place(len(self.source.files))
            part.finish()
        except BaseException:
            part.discard()
            raise
        for suffix, text in ((".rejects.csv", rejects.getvalue()), (".json", json.dumps(vars(note)))):
            write_whole(self._path(number, suffix), text.encode())
        return note

    def _answered(self, block: Block) -> tuple[pa.RecordBatch, list[Fault]]:
        """The evaluated rows of a block (and their lines, in place), and what is wrong with the others."""
        batch, rejects = answer_columns(block.batch, self.surrogate, self.columns, self.include)
        faults = block.faults
        if rejects.num_rows:
            found = rejects.to_pydict()
            rows = block.rows[found["row"]].tolist()
            faults = sorted([*faults, *map(Fault, rows, found["field"], found["value"], found["reason"])])
            kept = np.ones(batch.num_rows, np.bool_)
            kept[found["row"]] = False
            batch = batch.filter(pa.array(kept))
            block.lines = None if block.lines is None else block.lines.filter(pa.array(kept))
        if self.verbatim:
            return batch, faults
        columns = []
        for field in self.schema:
            column = batch.column(field.name)
            if column.type != field.type:  # an input that was text
                value, _ = numbers(column, stiffness=self._is_stiffness(field.name))
                column = pa.array(value)  # infinite for a rigid contact: a null would be a gap
            columns.append(column)
        return pa.RecordBatch.from_arrays(columns, schema=self.schema), faults

    def _is_stiffness(self, column: str) -> bool:
        return not self.columns.rigid and self.columns.places["k"][0] == column

    def _list(self, rejects: io.StringIO, path: Path, faults: Iterable[Fault]) -> None:
        several = len(self.source.files) > 1
        writer = csv.writer(rejects, lineterminator="\n")
        for fault in faults:
            if self.on_error == "stop":
                what = f"{fault.field} {fault.reason}" if fault.field else fault.reason
                raise FilesError(f"{path}: row {fault.row}: {what}, got {fault.value!r}")
            writer.writerow([*([path] if several else []), *fault])

    # --- finish -------------------------------------------------------------------------------------

    def finish(self, notes: list[_Note], resumed: int) -> Summary:
        """One output of all parts; then the parts are deleted."""
        rejected = sum(note.rejected for note in notes)
        if rejected:
            head = [*(["file"] if len(self.source.files) > 1 else []), *Fault._fields]
            lists = [self._path(number, ".rejects.csv") for number in range(len(notes))]
            join_parts(lists, self.rejects, "csv", False, self.schema, _csv_line(head))
        else:
            self.rejects.unlink(missing_ok=True)
        parts = [self._path(number, self.suffix) for number in range(len(notes))]
        if self.folder:
            self._move(parts)
        elif self.kind == "parquet" and len(parts) == 1:
            if parts[0].exists():  # else a run that was stopped here moved it
                os.replace(parts[0], self.out)
                sync_folder(self.out.parent)
        else:
            join_parts(parts, self.out, self.kind, self.packed, self.schema, self.header)
        self._clear()
        rows = sum(note.rows for note in notes)
        return Summary(rows, rows - rejected, rejected, self.out, self.rejects if rejected else None, resumed)

    def _move(self, parts: Sequence[Path]) -> None:
        self.out.mkdir(exist_ok=True)
        names = {part.name for part in parts}
        for left in self.out.glob("part-*"):
            if left.name not in names:
                left.unlink()
        for part in parts:
            if part.exists():  # else a run that was stopped here moved it
                os.replace(part, self.out / part.name)
        sync_folder(self.out)


def _added(progress: Progress, rows: int, rejected: int, share: float, more: int, bad: int) -> None:
    progress(share, rows + more, rejected + bad)


def _csv_line(cells: Sequence[str]) -> bytes:
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue().encode()

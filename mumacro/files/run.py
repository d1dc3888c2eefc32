"""A run over files of cases that can be killed at any moment: the same command goes on, and gives the same bytes.

While it runs, ``OUT.parts`` holds ``answers``, to which pieces are appended, and ``notes``: a line for the plan (inputs
with checksums, options, table), then a line for each piece with its size, its rejects, the place that follows it, and
the checksum of all of that.  Pieces that fit their notes are kept; from the first that does not, all is done again.
``OUT.run.json`` stays: it tells what the output was made of, so that the same command finds it complete.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from mumacro.files.columns import FilesError
from mumacro.files.evaluation import Evaluation, Piece
from mumacro.files.records import Place
from mumacro.files.writing import write_parquet
from mumacro.surrogate import Surrogate
from mumacro.version import __version__
from mumacro.writing import alone_in, put, write_whole

__all__ = ["Summary", "evaluate_files"]

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


class _Note(NamedTuple):
    """What is known of a piece: its size in bytes, the lines of its rejects, what follows it."""

    size: int
    rejects: str
    place: Sequence[int]
    rows: int
    rejected: int

    def line(self, text: bytes) -> bytes:
        """The note behind the checksum of the piece and of itself."""
        body = json.dumps(self).encode()
        return b"%08x %b\n" % (zlib.crc32(body, zlib.crc32(text)), body)


@dataclass
class _Done:
    """How far a run has come: bytes of both files, rows, and the place that follows (None: nothing is written)."""

    answers: int = 0
    notes: int = 0
    rows: int = 0
    rejected: int = 0
    place: Place | None = None

    def add(self, note: _Note, line: bytes) -> None:
        """Count one more piece."""
        self.answers, self.notes, self.place = self.answers + note.size, self.notes + len(line), Place(*note.place)
        self.rows, self.rejected = self.rows + note.rows, self.rejected + note.rejected


def evaluate_files(
    given: Sequence[str | Path],
    out: str | Path,
    surrogate: Surrogate,
    *,
    rigid: bool = False,
    include: Sequence[str] = (),
    on_error: str = "list",
    sep: str = ",",
    decimal: str = ".",
    force: bool = False,
    progress: Progress = lambda _share, _rows, _rejected: None,
    say: Callable[[str], None] = lambda _text: None,
) -> Summary:
    """Evaluate every case of some files.

    Parameters
    ----------
    given : sequence of path
        Files, folders or patterns; all of one format.
    out : path
        A file, whose ending sets the format.  Rows keep their order; a rejected row is not in it, but in
        ``OUT.rejects.csv``.
    surrogate : Surrogate
        The table.
    rigid : bool
        All contacts are rigid and there is no column k.
    include : sequence of str
        ``"gradient"`` adds d mu_macro / d input.
    on_error : str
        ``"list"`` puts rejected rows into the side file, ``"stop"`` raises at the first one.
    sep, decimal : str
        Between the cells of CSV, and within its numbers, read and written.
    force : bool
        Replace an output that exists, and delete the parts of another run.
    progress : callable
        Called with the share that is done, rows read and rows rejected.
    say : callable
        Called with one line about what a resumed run found.

    Returns
    -------
    Summary
        What was done.

    Raises
    ------
    FilesError
        An input or output that cannot be used, or an input that changed meanwhile; names it, with the remedy.
    BusyError
        Another run writes the same output.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> _ = (folder / "cases.csv").write_text("mu0,Fz,k,y0 [um],f [kHz],v0\\n0.3,10,rigid,2,20,0.01\\n")
    >>> evaluate_files([folder / "cases.csv"], folder / "out.parquet", Surrogate.open()).answered
    1
    """
    work = Evaluation(
        given, Path(out), surrogate, rigid=rigid, include=include, on_error=on_error, sep=sep, decimal=decimal
    )
    return _Run(work, Path(out)).run(force, progress, say)


def _stamp(path: Path) -> list[int]:
    return [path.stat().st_size, path.stat().st_mtime_ns]


class _Run:
    def __init__(self, work: Evaluation, out: Path) -> None:
        self.work, self.out = work, out
        if not out.parent.is_dir():
            raise FilesError(f"{out.parent}: no such folder")
        if out.is_dir():
            raise FilesError(f"{out}: is a folder; give the name of a file")
        self.parts, self.rejects, self.record = (
            out.with_name(out.name + ending) for ending in (".parts", ".rejects.csv", ".run.json")
        )
        self.answers, self.notes, self.made = (self.parts / name for name in ("answers", "notes", "made"))
        targets = [out, self.rejects, self.record, self.answers, self.notes, self.made]
        for target in targets:
            if target.exists() and any(target.samefile(path) for path in work.files):
                raise FilesError(f"{target}: is an input, and would be overwritten; give another -o")
        self.plan: dict[str, Any] = {
            "version": __version__,
            "table": work.surrogate.checksum,
            "inputs": [[path.name, checksum] for path, checksum in zip(work.files, work.checksums, strict=True)],
            "options": [vars(work.output), list(work.include), work.on_error, [*work.columns.places.items()]],
        }
        self.plan = json.loads(json.dumps(self.plan))

    def run(self, force: bool, progress: Progress, say: Callable[[str], None]) -> Summary:
        """Find what is done, do what is left, and put it into place."""
        with alone_in(self.parts):
            complete = None if force else self._complete()
            if complete:
                self._clear()
                say(f"{self.out}: is complete already; nothing is left to do")
                return complete
            done = self._begin(force, say)
            resumed = done.rows
            try:
                self._go_on(done, progress)
            except FilesError:  # an input must be changed before this run can end
                self._clear()
                raise
            return self._finish(done, resumed)

    # --- what is there already ----------------------------------------------------------------------

    def _complete(self) -> Summary | None:
        """The summary of an earlier run of the same command, if its files are as it left them."""
        with suppress(FileNotFoundError, ValueError, KeyError):
            found = json.loads(self.record.read_text("utf-8"))
            rejects = self.rejects if found["rejected"] else None
            if found["plan"] == self.plan and found["files"] == [_stamp(path) for path in self._written(rejects)]:
                rows, rejected = found["rows"], found["rejected"]
                return Summary(rows, rows - rejected, rejected, self.out, rejects, rows)
        return None

    def _written(self, rejects: Path | None) -> list[Path]:
        return [self.out, *([rejects] if rejects else [])]

    def _begin(self, force: bool, say: Callable[[str], None]) -> _Done:
        """Keep what is sound of an earlier run of the same command, or make a new beginning."""
        plan = json.dumps(self.plan).encode() + b"\n"
        first = self.notes.open("rb").readline() if self.notes.exists() else b""
        if first == plan:
            return self._kept(plan, say)
        if first and not force:
            raise FilesError(f"{self.parts}: has parts of another run ({self._differences(first)}); --force deletes them")
        for path in (self.out, self.rejects):
            if path.exists() and not force:
                raise FilesError(f"{path}: exists already; --force replaces it")
        self._clear()
        self.answers.touch()
        write_whole(self.notes, plan)
        return _Done(notes=len(plan))

    def _differences(self, first: bytes) -> str:
        with suppress(ValueError, AttributeError):
            found = json.loads(first)
            return ", ".join(name for name in self.plan if found.get(name) != self.plan[name]) + " differ"
        return "its plan cannot be read"

    def _kept(self, plan: bytes, say: Callable[[str], None]) -> _Done:
        whole = sum(note.size for note, _ in self._noted())
        if not self.answers.exists() and self.out.exists() and self.out.stat().st_size == whole:
            os.replace(self.out, self.answers)  # a run that was stopped here had put it into place
        self.answers.touch()
        done = _Done(notes=len(plan))
        with self.answers.open("rb") as answers:
            for note, line in self._noted():
                if note.line(answers.read(note.size)) != line:
                    break
                done.add(note, line)
        damaged = done.notes < self.notes.stat().st_size
        for path, size in ((self.answers, done.answers), (self.notes, done.notes)):
            os.truncate(path, size)
        again = "; what follows them was cut or changed, and is done again" if damaged else ""
        say(f"{self.parts}: {done.rows:,} rows are done already ({done.rejected:,} rejected){again}")
        return done

    def _noted(self) -> Iterator[tuple[_Note, bytes]]:
        """The notes and their lines, up to the first that is none."""
        with self.notes.open("rb") as notes:
            notes.readline()
            for line in notes:
                try:
                    yield _Note(*json.loads(line.partition(b" ")[2])), line
                except (ValueError, TypeError):
                    return

    # --- what is left -------------------------------------------------------------------------------

    def _go_on(self, done: _Done, progress: Progress) -> None:
        with self.answers.open("ab") as answers, self.notes.open("ab") as notes:
            for piece in self.work.pieces(done.place):
                self._append(answers, piece.text)
                note = _Note(len(piece.text), piece.rejects, piece.place, piece.rows, piece.rejected)
                self._append(notes, line := note.line(piece.text))
                done.add(note, line)
                progress(piece.share, done.rows, done.rejected)

    @staticmethod
    def _append(stream: BinaryIO, text: bytes) -> None:
        # not brought to the disk: after a loss of power the checksums tell what is there
        stream.write(text)
        stream.flush()

    # --- the end --------------------------------------------------------------------------------------

    def _finish(self, done: _Done, resumed: int) -> Summary:
        """Put the files into place; a run that is stopped here does this again."""
        if done.rejected:
            with self.made.open("w", encoding="utf-8", newline="") as stream:
                stream.write(self.work.rejects_head)
                stream.writelines(note.rejects for note, _ in self._noted())
            put(self.made, self.rejects)
        else:
            self.rejects.unlink(missing_ok=True)
        if self.work.output.kind == "parquet":
            with self.answers.open("rb") as answers:
                texts = (answers.read(note.size) for note, _ in self._noted())
                write_parquet(self.made, self.work.schema, filter(None, texts))
            put(self.made, self.out)
        else:
            put(self.answers, self.out)
        rejects = self.rejects if done.rejected else None
        files = [_stamp(path) for path in self._written(rejects)]
        record = {"plan": self.plan, "rows": done.rows, "rejected": done.rejected, "files": files}
        write_whole(self.record, json.dumps(record, indent=1).encode())
        self._clear()
        return Summary(done.rows, done.rows - done.rejected, done.rejected, self.out, rejects, resumed)

    def _clear(self) -> None:
        for path in (self.answers, self.made, self.notes):
            path.unlink(missing_ok=True)

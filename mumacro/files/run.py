"""A run over files of cases that can be killed at any moment: the same command goes on, and gives the same bytes.

While it runs, ``OUT.parts`` holds ``answers``, to which pieces are appended, and ``notes``: a line for the plan (inputs
with checksums, options, table), then a line for each piece with its size and checksum, its rejects and the place that
follows it, behind a checksum of the line.  Pieces that fit their notes are kept; what follows them is done again.
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
from typing import Any, NamedTuple

from mumacro.files.columns import FilesError
from mumacro.files.evaluation import Evaluation, stamp
from mumacro.files.reading import Place
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
    """What a piece leaves behind: its checksum, bytes and rows up to its end, what follows, its rejects as lines."""

    checksum: int = 0
    end: int = 0
    place: Sequence[int] | None = None
    rows: int = 0
    rejected: int = 0
    rejects: str = ""

    def line(self) -> bytes:
        """The note behind its own checksum."""
        body = json.dumps(self).encode()
        return b"%08x %b\n" % (zlib.crc32(body), body)


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
    sep, decimal : str
        Between the cells of CSV, and within its numbers, read and written.
    contact, direction : str
        Of all cases, as in :meth:`mumacro.Surrogate.evaluate`.
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
    InputError
        An unknown contact or direction.
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
        given, Path(out), surrogate, rigid=rigid, include=include, sep=sep, decimal=decimal, contact=contact,
        direction=direction,
    )  # fmt: skip
    return _Run(work, Path(out)).run(force, progress, say)


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
        for target in (out, self.rejects, self.record, self.answers, self.notes, self.made):
            if target.exists() and any(target.samefile(path) for path in work.files):
                raise FilesError(f"{target}: is an input, and would be overwritten; give another -o")
        self.plan: dict[str, Any] = {
            "version": __version__,
            "table": work.surrogate.checksum,
            "inputs": [[path.name, checksum] for path, checksum in zip(work.files, work.checksums, strict=True)],
            "options": [vars(work.output), list(work.include), [*work.columns.places.items()], work.columns.kind.names],
        }
        self.first = json.dumps(self.plan).encode() + b"\n"

    def run(self, force: bool, progress: Progress, say: Callable[[str], None]) -> Summary:
        """Find what is done, do what is left, and put it into place."""
        with alone_in(self.parts):
            complete = None if force else self._complete()
            if complete:
                self._clear()
                say(f"{self.out}: is complete already; nothing is left to do")
                return complete
            note = self._begin(force, say)
            resumed = note.rows
            try:
                note = self._go_on(note, progress)
            except FilesError:  # an input must be changed before this run can end
                self._clear()
                raise
            self._finish(note)
            return self._summary(note.rows, note.rejected, resumed)

    def _summary(self, rows: int, rejected: int, resumed: int) -> Summary:
        return Summary(rows, rows - rejected, rejected, self.out, self.rejects if rejected else None, resumed)

    def _record(self, rows: int, rejected: int) -> bytes:
        written = [self.out, *([self.rejects] if rejected else [])]
        record = {"rows": rows, "rejected": rejected, "files": [stamp(path)[:2] for path in written], "plan": self.plan}
        return json.dumps(record, indent=1).encode()

    def _complete(self) -> Summary | None:
        """The summary of an earlier run of the same command, if its files are as it left them."""
        with suppress(OSError, ValueError, KeyError, TypeError):
            text = self.record.read_bytes()
            rows, rejected = (json.loads(text)[name] for name in ("rows", "rejected"))
            if text == self._record(rows, rejected):
                return self._summary(rows, rejected, rows)
        return None

    def _begin(self, force: bool, say: Callable[[str], None]) -> _Note:
        """Keep what is sound of an earlier run of the same command, or make a new beginning."""
        found = b""
        if self.notes.exists():
            with self.notes.open("rb") as notes:
                found = notes.readline()
        if found == self.first:
            return self._kept(say)
        if found and not force:
            differ = "its plan cannot be read"
            with suppress(ValueError, AttributeError):
                plan, old = json.loads(self.first), json.loads(found)
                differ = ", ".join(name for name in plan if old.get(name) != plan[name]) + " differ"
            raise FilesError(f"{self.parts}: has parts of another run ({differ}); --force deletes them")
        for path in (self.out, self.rejects):
            if path.exists() and not force:
                raise FilesError(f"{path}: exists already; --force replaces it")
        self._clear()
        self.answers.touch()
        write_whole(self.notes, self.first)
        return _Note()

    def _kept(self, say: Callable[[str], None]) -> _Note:
        self.answers.touch()
        last, size = _Note(), len(self.first)
        for last, _ in self._pieces():
            size += len(last.line())
        damaged = size < self.notes.stat().st_size
        os.truncate(self.answers, last.end)
        os.truncate(self.notes, size)
        again = "; what follows them was cut or changed, and is done again" if damaged else ""
        say(f"{self.parts}: {last.rows:,} rows are done already ({last.rejected:,} rejected){again}")
        return last

    def _pieces(self) -> Iterator[tuple[_Note, bytes]]:
        """The notes and the pieces that they tell of, as far as both are sound."""
        with self.notes.open("rb") as notes, self.answers.open("rb") as answers:
            notes.readline()
            for line in notes:
                body = line[9:-1]
                if line != b"%08x %b\n" % (zlib.crc32(body), body):
                    return
                note = _Note(*json.loads(body))
                text = answers.read(note.end - answers.tell())
                if zlib.crc32(text) != note.checksum:
                    return
                yield note, text

    def _go_on(self, note: _Note, progress: Progress) -> _Note:
        # nothing is brought to the disk here: after a loss of power the checksums tell what is there
        with self.answers.open("ab", 0) as answers, self.notes.open("ab", 0) as notes:
            for piece in self.work.pieces(Place(*note.place) if note.place else None):
                _write(answers, piece.text)
                end, rows, rejected = note.end + len(piece.text), note.rows + piece.rows, note.rejected + piece.rejected
                note = _Note(zlib.crc32(piece.text), end, piece.place, rows, rejected, piece.rejects)
                _write(notes, note.line())
                progress(piece.share, note.rows, note.rejected)
        return note

    def _finish(self, last: _Note) -> None:
        """Put the files into place; a run that is stopped here does this again."""
        if last.rejected:
            with self.made.open("w", encoding="utf-8", errors="surrogateescape", newline="") as stream:
                stream.write(self.work.rejects_head)
                stream.writelines(note.rejects for note, _ in self._pieces())
            put(self.made, self.rejects)
        else:
            self.rejects.unlink(missing_ok=True)
        texts = (text for _, text in self._pieces() if text)
        if self.work.output.kind == "parquet":
            write_parquet(self.made, self.work.schema, texts)
        else:
            with self.made.open("wb") as made:
                made.writelines(texts)
        put(self.made, self.out)
        write_whole(self.record, self._record(last.rows, last.rejected))
        self._clear()

    def _clear(self) -> None:
        for path in (self.answers, self.made, self.notes):
            path.unlink(missing_ok=True)


def _write(stream: Any, text: bytes | memoryview) -> None:
    rest = memoryview(text)
    while rest:
        rest = rest[stream.write(rest) :]

"""``python -m service eval CASES -o OUT``: files of cases without a server, in constant memory, resumable.

CSV, NDJSON (``.ndjson``, ``.jsonl``) and, with pyarrow, Parquet, told by the file's suffix; in and out may differ.
Each good row comes out with everything it came with, its number in the input (``row``, from 1), and the answer.  Each
bad row goes into a side file with its number, the field, the reason and the row itself, and into that file only.

A run that is stopped at any moment goes on where it was when it is started again: work is written in chunks, and after
each chunk a progress file says how far input and outputs are.  The output gets its name when it is whole.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from friction import Surrogate
from friction.nondim import FIELDS, find_faults
from service.bulk_files import FileError, Row, Sink, Source, open_sink, open_source, suffix_of
from service.settings import SettingsError, load_settings
from service.shelf import Shelf

__all__ = ["ANSWERS", "main"]

ANSWERS = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")
REJECTS = ("row", "field", "reason", "content")
_VERSION = 1  # of the progress file


class _Progress:
    """How far a run is: in a file that is replaced in one step after every chunk."""

    def __init__(self, path: Path, identity: dict[str, Any]) -> None:
        self.path, self.identity = path, identity
        self.state: dict[str, Any] = {"place": None, "rows": 0, "bad": 0, "out": 0, "rejects": 0}

    def load(self) -> bool:
        """Take up what a run on the same input with the same options left; False when there is nothing like that."""
        try:
            left = json.loads(self.path.read_text("utf-8"))
        except (OSError, ValueError):
            return False
        if not isinstance(left, dict) or left.get("identity") != self.identity:
            return False
        self.state = left["state"]
        return True

    def save(self, **state: Any) -> None:
        """Write the state down."""
        self.state = state
        temporary = self.path.with_name(self.path.name + ".new")
        with temporary.open("w", encoding="utf-8") as stream:
            json.dump({"identity": self.identity, "state": state}, stream)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(self.path)


class _Bar:
    """One line on a terminal, rewritten a few times a second; a line every half minute elsewhere."""

    def __init__(self, stream: TextIO, share: float) -> None:
        self.stream, self.live = stream, stream.isatty()
        self.start_share, self.start = share, time.monotonic()
        self.shown = self.start if not self.live else -1.0

    def show(self, share: float, rows: int, bad: int, last: bool = False) -> None:
        now = time.monotonic()
        if not last and now - self.shown < (0.2 if self.live else 30.0):
            return
        self.shown = now
        done, elapsed = share - self.start_share, now - self.start
        left = "" if last or done <= 0.0 else f", {elapsed * (1.0 - share) / done:.0f} s left"
        filled = int(30 * share)
        bar = f"[{'#' * filled}{'.' * (30 - filled)}] {100 * share:3.0f} %"
        text = f"{bar}  {rows} rows, {bad} bad{left}"
        self.stream.write(f"\r{text:<78}" + ("\n" if last else "") if self.live else text + "\n")
        self.stream.flush()


def evaluate_rows(surrogate: Surrogate, rows: Sequence[Row]) -> None:
    """Put the answer, or the fault, into every row that has no fault yet."""
    good = [row for row in rows if row.fault is None]
    for rigid in (False, True):
        chosen = [row for row in good if (row.inputs["k"] is None) == rigid]
        if not chosen:
            continue
        names = [name for name in FIELDS if not (rigid and name == "k")]
        columns: dict[str, Any] = {n: np.array([row.inputs[n] for row in chosen], dtype=np.float64) for n in names}
        for fault in find_faults(columns):
            shown = json.dumps(fault.value) if np.isfinite(fault.value) else str(fault.value)
            chosen[fault.index].fault = (fault.field, f"{fault.reason}, got {shown}")
        sound = np.array([row.fault is None for row in chosen])
        if not sound.any():
            continue
        case: dict[str, Any] = {name: column[sound] for name, column in columns.items()}
        answer = surrogate.evaluate(**{"k": None, **case})
        values = zip(*(getattr(answer, name).tolist() for name in ANSWERS), strict=True)
        for row, value in zip((row for row in chosen if row.fault is None), values, strict=True):
            row.answer = value


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m service eval", description="Answer a file of cases.")
    parser.add_argument(
        "cases", type=Path, help="CSV, NDJSON or Parquet with mu0, Fz, y0, omega, v0 and, if elastic, k"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="file to write; its suffix tells the format")
    parser.add_argument("--rejects", type=Path, help="side file for bad rows (CSV); default: OUTPUT.rejects.csv")
    parser.add_argument("--tables", help="table file or directory; default: the setting MUMACRO_TABLES")
    parser.add_argument(
        "--tolerance", type=float, help="wanted error of mu_macro/mu0: the smallest table that meets it"
    )
    parser.add_argument("--chunk", type=int, default=20_000, help="rows that are in memory at a time; default: 20000")
    parser.add_argument("--fresh", action="store_true", help="start anew, whatever an earlier run left")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; 0 every row answered, 3 some rows rejected, 1 could not run, 2 bad argument."""
    parser = _parser()
    chosen = parser.parse_args(arguments)
    rejects = chosen.rejects or chosen.output.with_name(chosen.output.name + ".rejects.csv")
    if chosen.chunk < 1:
        parser.error(f"--chunk must be >= 1, got {chosen.chunk}")
    if chosen.tolerance is not None and not 0.0 < chosen.tolerance < float("inf"):
        parser.error(f"--tolerance must be finite and > 0, got {chosen.tolerance}")
    if len({path.resolve() for path in (chosen.cases, chosen.output, rejects)}) < 3:
        parser.error("the cases, the output and the rejects must be three files")
    try:
        for path in (chosen.cases, chosen.output):
            suffix_of(path)
        surrogate = _surrogate(chosen)
        return _run(chosen, rejects, surrogate)
    except SettingsError as error:
        print(error, file=sys.stderr)
        return 2
    except FileError as error:
        print(f"eval: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"eval: {error.filename or chosen.output}: {error.strerror or error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\neval: stopped; the same command goes on from here", file=sys.stderr)
        return 130


def _surrogate(chosen: argparse.Namespace) -> Surrogate:
    settings = load_settings(**({"tables": chosen.tables} if chosen.tables else {}))
    shelf = Shelf(settings.tables)
    shelf.load()
    if shelf.fault is not None:
        raise FileError(shelf.fault)
    if chosen.tolerance is not None and chosen.tolerance < shelf.tables[0].surrogate.tolerance:
        tightest = shelf.tables[0].surrogate.tolerance
        raise FileError(f"no table meets the tolerance {chosen.tolerance:g}; the tightest has {tightest:g}")
    return shelf.pick(chosen.tolerance).surrogate


def _run(chosen: argparse.Namespace, rejects: Path, surrogate: Surrogate) -> int:
    status = chosen.cases.stat()
    progress = _Progress(
        chosen.output.with_name(chosen.output.name + ".progress"),
        {
            "version": _VERSION,
            "cases": [str(chosen.cases.resolve()), status.st_size, status.st_mtime_ns],
            "outputs": [str(chosen.output.resolve()), str(rejects.resolve())],
            "table": surrogate.checksum,
            "chunk": chosen.chunk,
        },
    )
    resumed = not chosen.fresh and progress.load()
    with open_source(chosen.cases, chosen.chunk, progress.state["place"]) as source:
        taken = [name for name in ("row", *ANSWERS) if name in source.columns]
        if taken:
            raise FileError(f"{chosen.cases}: the column {taken[0]} would be written twice; rename it")
        if resumed:
            print(f"eval: going on after row {progress.state['rows']}", file=sys.stderr)
        rows, bad = _answer(chosen, rejects, surrogate, source, progress)
    progress.path.unlink(missing_ok=True)
    where = f", {bad} rejected: {rejects}" if bad else ""
    print(f"{rows - bad} of {rows} rows answered by {surrogate.id}: {chosen.output}{where}")
    return 3 if bad else 0


def _answer(
    chosen: argparse.Namespace, rejects: Path, surrogate: Surrogate, source: Source, progress: _Progress
) -> tuple[int, int]:
    """Write both outputs; return the number of rows and of bad ones."""
    state = progress.state
    columns = ("row", *source.columns, *ANSWERS)
    bar = _Bar(sys.stderr, source.share)
    rows, bad = int(state["rows"]), int(state["bad"])
    with open_sink(chosen.output, columns, state["out"]) as out, open_sink(rejects, REJECTS, state["rejects"]) as side:
        for chunk in source:
            evaluate_rows(surrogate, chunk)
            _write(out, side, chunk, rows, source.columns)
            rows += len(chunk)
            bad += sum(row.fault is not None for row in chunk)
            progress.save(place=source.place, rows=rows, bad=bad, out=out.sync(), rejects=side.sync())
            bar.show(source.share, rows, bad)
        out.finish()
        if bad:
            side.finish()
        else:
            side.discard()
    bar.show(1.0, rows, bad, last=True)
    return rows, bad


def _write(out: Sink, side: Sink, chunk: Iterable[Row], first: int, columns: Sequence[str]) -> None:
    good: list[Sequence[Any]] = []
    bad: list[Sequence[Any]] = []
    for number, row in enumerate(chunk, first + 1):
        if row.fault is None and row.answer is not None:
            good.append((number, *(row.values.get(name) for name in columns), *row.answer))
        elif row.fault is not None:
            bad.append((number, *row.fault, row.content))
    out.write(good)
    side.write(bad)

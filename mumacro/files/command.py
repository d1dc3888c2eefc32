"""``mumacro eval``: files of cases from the command line."""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pyarrow as pa
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from mumacro.command import OneLineParser, add_kind, open_table
from mumacro.files.columns import FilesError
from mumacro.files.evaluation import Evaluation
from mumacro.files.reading import one_line
from mumacro.files.run import evaluate_files
from mumacro.separators import SEPARATORS

__all__ = ["main"]

_COLUMNS = """\
columns, by name in any order; another unit in brackets, as in k [N/mm] or y0 [um]:
  mu0 [-]   Fz [N]   k [N/m]   y0 [m]   omega [rad/s] or f [Hz]   v0 [m/s]
  "rigid" in k is a rigid contact, an empty cell is missing; without a column k give --rigid
  for k also k_low and k_high, its ends; for y0, with --direction normal, Fz_amplitude [N]
  other columns are copied; those of CSV and NDJSON stay text
added: mu_macro, mu_ratio, regime, error_bound, source; for k_low and k_high also mu_macro_low and mu_macro_high
rejected rows are in OUT.rejects.csv only: row (from 1), field, value, reason

examples:
  mumacro eval cases.parquet -o out.parquet
  mumacro eval german.csv -o out.csv --sep ';' --decimal ,
  mumacro eval - -o - < cases.csv > out.csv

A stopped run goes on when the same command is given again; the output has the same bytes.
exit codes: 0 every row evaluated, 3 some rows rejected, 1 could not run, 2 wrong arguments, 130 interrupted
"""


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(
        prog="mumacro eval",
        description="Evaluate every case of Parquet, CSV or NDJSON files (text also compressed, .gz).",
        epilog=_COLUMNS,
    )
    parser.add_argument("cases", nargs="+", help="files, folders or patterns, all of one format; - is standard input")
    parser.add_argument("-o", "--out", required=True, help="the file to write; its ending sets the format; - is output")
    add_kind(parser)
    parser.add_argument("--table", metavar="PATH|TOLERANCE", help="default: the tightest bundled table")
    parser.add_argument("--sep", choices=SEPARATORS, default=",", help="between the cells of CSV; default: ,")
    parser.add_argument("--decimal", choices=(".", ","), default=".", help="in the numbers of CSV; default: .")
    parser.add_argument("--rigid", action="store_true", help="there is no column k: all contacts are rigid")
    parser.add_argument(
        "--include", choices=("gradient",), action="append", default=[], help="add d mu_macro / d input"
    )
    parser.add_argument("--force", action="store_true", help="replace an output, delete the parts of another run")
    return parser


@contextmanager
def _bar() -> Iterator[tuple[Callable[[float, int, int], None], Callable[[str], None]]]:
    """A bar on a terminal, and lines above it; elsewhere lines alone."""
    console = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)
    columns = (BarColumn(), TaskProgressColumn(), TextColumn("{task.description}"), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=1.0)

        def report(share: float, rows: int, rejected: int) -> None:
            bar.update(task, completed=share, description=f"{rows:,} rows, {rejected:,} rejected")

        yield report, lambda text: console.print(f"mumacro eval: {text}")


def _spooled(folder: Path) -> Path:
    """Standard input as a file, in the format that it begins like."""
    path = folder / "standard-input"
    with path.open("wb") as stream:
        shutil.copyfileobj(sys.stdin.buffer, stream, 2**20)
    with path.open("rb") as stream:
        begin = stream.read(4)
    kind = ".parquet" if begin == b"PAR1" else ".ndjson" if begin.lstrip()[:1] == b"{" else ".csv"
    packed = ".gz" if begin[:2] == b"\x1f\x8b" else ""
    return path.rename(path.with_name(path.name + kind + packed))


def _to_output(work: Evaluation) -> tuple[int, int]:
    """Write to standard output, and rejected rows to standard error; the numbers of rows and rejected rows."""
    rows = rejected = 0
    for piece in work.pieces():
        sys.stdout.buffer.write(piece.text)
        if piece.rejected:
            sys.stderr.write(piece.rejects if rejected else work.rejects_head + piece.rejects)
        rows, rejected = rows + piece.rows, rejected + piece.rejected
    return rows, rejected


def main(words: Sequence[str]) -> int:
    """Run ``mumacro eval``; return the exit code.

    Raises
    ------
    UsageError, FilesError, TableError, InputError
        One line each; the command prints it.
    """
    chosen = _parser().parse_intermixed_args(words)
    surrogate = open_table(chosen.table)
    options = {name: getattr(chosen, name) for name in ("rigid", "include", "decimal", "contact", "direction")}
    options["sep"] = SEPARATORS[chosen.sep]
    try:
        with ExitStack() as stack:
            cases = chosen.cases
            if "-" in cases:
                folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="mumacro-")))
                standard = _spooled(folder)
                cases = [standard if name == "-" else name for name in cases]
            if chosen.out == "-":
                rows, rejected = _to_output(Evaluation(cases, None, surrogate, **options))
                print(f"{rows - rejected:,} of {rows:,} rows evaluated with {surrogate.id}", file=sys.stderr)
                return 3 if rejected else 0
            report, say = stack.enter_context(_bar())
            summary = evaluate_files(
                cases, chosen.out, surrogate, force=chosen.force, progress=report, say=say, **options
            )
    except KeyboardInterrupt:
        print("mumacro eval: stopped; the same command goes on", file=sys.stderr)
        return 130
    except pa.ArrowException as error:
        raise FilesError(f"{chosen.cases[0]}: {one_line(error)}") from None
    told = [f"{summary.answered:,} of {summary.rows:,} rows evaluated with {surrogate.id}: {summary.out}"]
    told += [f"{summary.rejected:,} rejected: {summary.rejects}"] if summary.rejects else []
    told += [f"{summary.resumed:,} were done already"] if summary.resumed else []
    print("; ".join(told))
    return 3 if summary.rejected else 0

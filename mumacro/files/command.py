"""``mumacro eval``: files of cases from the command line."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import pyarrow as pa
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from mumacro.command import OneLineParser, UsageError, open_table
from mumacro.files.blocks import one_line
from mumacro.files.columns import FilesError
from mumacro.files.run import ON_ERROR, Summary, evaluate_files
from mumacro.files.run import Progress as Report

__all__ = ["main"]

_COLUMNS = """\
columns, by name in any order; another unit in brackets, as in k [N/mm] or y0 [um]:
  mu0 [-]   Fz [N]   k [N/m]   y0 [m]   omega [rad/s] or f [Hz]   v0 [m/s]
  the word rigid in k is a rigid contact, an empty cell is refused; without a column k give --rigid
  other columns are copied unchanged
added: mu_macro, mu_ratio, regime, error_bound, source
rejected rows are in OUT.rejects.csv only: row (from 1), field, value, reason

examples:
  mumacro eval cases.parquet -o out.parquet
  mumacro eval 'runs/2024-*.csv.gz' -o answers/ --table 1e-7

A stopped run resumes when the same command is given again; the output has the same bytes.
exit codes: 0 every row evaluated, 3 some rows rejected, 1 could not run, 2 wrong arguments, 130 interrupted
"""


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(
        prog="mumacro eval",
        description="Evaluate every case of Parquet, CSV or NDJSON files (text also compressed, .gz).",
        epilog=_COLUMNS,
    )
    parser.add_argument("cases", nargs="+", help="files, folders or patterns, all of one format")
    parser.add_argument(
        "-o", "--out", required=True, help="the file to write; its ending sets the format; or a folder/"
    )
    parser.add_argument("--table", metavar="PATH|TOLERANCE", help="default: the tightest bundled table")
    parser.add_argument("--rigid", action="store_true", help="there is no column k: all contacts are rigid")
    parser.add_argument(
        "--include", choices=("gradient",), action="append", default=[], help="add d mu_macro / d input"
    )
    parser.add_argument("--on-error", choices=ON_ERROR, default="list", help="list rejected rows, or stop")
    parser.add_argument("--force", action="store_true", help="replace an output, delete the parts of another run")
    parser.add_argument("--part-rows", type=int, metavar="N", help="rows that a stopped run loses at the most")
    return parser


@contextmanager
def _bar() -> Iterator[Report]:
    """A bar on a terminal; nothing elsewhere."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _share, _rows, _rejected: None
        return
    columns = (BarColumn(), TaskProgressColumn(), TextColumn("{task.description}"), TimeRemainingColumn())
    with Progress(*columns, console=console) as bar:
        task = bar.add_task("", total=1.0)

        def report(share: float, rows: int, rejected: int) -> None:
            bar.update(task, completed=share, description=f"{rows:,} rows, {rejected:,} rejected")

        yield report


def _told(summary: Summary, table: str) -> str:
    parts = [f"{summary.answered:,} of {summary.rows:,} rows evaluated with {table}: {summary.out}"]
    if summary.rejects:
        parts.append(f"{summary.rejected:,} rejected: {summary.rejects}")
    if summary.resumed:
        parts.append(f"{summary.resumed:,} were done already")
    return "; ".join(parts)


def main(words: Sequence[str]) -> int:
    """Run ``mumacro eval``; return the exit code.

    Raises
    ------
    UsageError, FilesError, TableError, InputError
        One line each; the command prints it.
    """
    chosen = _parser().parse_intermixed_args(words)
    if chosen.part_rows is not None and chosen.part_rows < 1:
        raise UsageError(f"--part-rows must be >= 1, got {chosen.part_rows}")
    surrogate = open_table(chosen.table)
    try:
        with _bar() as report:
            summary = evaluate_files(
                chosen.cases, chosen.out, surrogate, rigid=chosen.rigid, include=chosen.include,
                on_error=chosen.on_error, force=chosen.force, part_rows=chosen.part_rows, progress=report,
            )  # fmt: skip
    except KeyboardInterrupt:
        print("mumacro eval: stopped; the same command resumes", file=sys.stderr)
        return 130
    except pa.ArrowException as error:
        raise FilesError(f"{chosen.cases[0]}: {one_line(error)}") from None
    print(_told(summary, surrogate.id))
    return 3 if summary.rejected else 0

"""Run ``mumacro eval``: evaluate files of cases from the command line."""

import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from mumacro.cli.common import (
    OneLineParser,
    add_options,
    included,
    open_table,
)
from mumacro.cli.table_format import add_format, dialect_in
from mumacro.files.run import evaluate_files
from mumacro.results import Remark

_COLUMNS = """\
columns, by name in any order; another unit in brackets, as in k [N/mm] or y0 [um]:
  mu0 [-]   Fz [N]   k [N/m]   y0 [m]   omega [rad/s] or f [Hz]   v0 [m/s]
  "rigid" in k is a rigid contact, an empty cell is missing; without a column k give --rigid
  also k_low and k_high; Fz_amplitude [N]; contact, direction, std_k, ...; others are copied
in text the header is the first line with these names; units may be in it, near it or in a legend
added: mu_macro, mu_ratio, regime, error_bound, source; mu_macro_low, _high; power.saved, ...
rejected rows are in OUT.rejects.csv only: line (of Parquet row, from 1), field, value, reason

example:
  mumacro eval rig.txt -o out.csv --decimal ,
exit codes: 0 all rows, 3 some are rejected, 1 could not run, 2 wrong arguments, 130 interrupted
"""


def _standard_input(folder: Path) -> Path:
    """Return standard input as a file, in the format that its first bytes show."""
    path = folder / "standard-input"
    with path.open("w+b") as stream:
        shutil.copyfileobj(sys.stdin.buffer, stream, 2**20)
        stream.seek(0)
        begin = stream.read(4)
    endings = {b"PAR1": ".parquet", b"PK\x03\x04": ".xlsx"}
    kind = endings.get(begin, ".json" if begin.lstrip()[:1] == b"{" else ".csv")
    packing = ".gz" if begin[:2] == b"\x1f\x8b" else ""
    return path.rename(f"{path}{kind}{packing}")


def _bar(console: Console) -> Progress:
    """Return a bar for the fraction of the rows that are evaluated, on a terminal."""
    return Progress(
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.description}"),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
    )


def _parser() -> OneLineParser:
    """Return the parser of the command's arguments."""
    parser = OneLineParser(
        prog="mumacro eval",
        description="Evaluate every case of files: Parquet, text, .xlsx. "
        "The output appears whole or not.",
        epilog=_COLUMNS,
    )
    text = "files, folders or patterns, all of one format; - is standard input"
    parser.add_argument("cases", nargs="+", help=text)
    text = "the file to write; its ending sets the format; - is output"
    parser.add_argument("-o", "--out", required=True, help=text)
    add_options(parser, "contact", "direction", "table")
    add_format(parser)
    text = "there is no column k: all contacts are rigid"
    parser.add_argument("--rigid", action="store_true", help=text)
    add_options(parser, "include")
    parser.add_argument("--force", action="store_true", help="replace an output that exists")
    return parser


def main(words: Sequence[str]) -> int:
    """Run ``mumacro eval`` and return the exit code. :func:`mumacro.cli.common.run` reports
    errors."""
    options = _parser().parse_intermixed_args(words)
    surrogate = open_table(options.table)
    console = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)
    try:
        with tempfile.TemporaryDirectory(prefix="mumacro-") as folder:
            files = [
                _standard_input(Path(folder)) if name == "-" else name for name in options.cases
            ]
            out = options.out
            if out == "-":
                out = f"{folder}/standard-output.csv"
            with _bar(console) as bar:
                rows_read = bar.add_task("", total=1.0)
                outcome = evaluate_files(
                    files,
                    out,
                    surrogate,
                    rigid=options.rigid,
                    contact=options.contact,
                    direction=options.direction,
                    force=options.force,
                    dialect=dialect_in(options),
                    include=included(options),
                    progress=lambda share, rows, rejected: bar.update(
                        rows_read,
                        completed=share,
                        description=f"{rows:,} rows, {rejected:,} rejected",
                    ),
                    say=lambda text: console.print(f"mumacro eval: {text}"),
                )
            counts = f"{outcome.answered:,} of {outcome.rows:,} rows evaluated with {surrogate.id}"
            remarks = "".join(map(_remark, outcome.remarks))
            if options.out == "-":
                with outcome.out.open("rb") as stream:
                    shutil.copyfileobj(stream, sys.stdout.buffer)
                sys.stderr.write(
                    (outcome.rejects.read_text("utf-8", "replace") if outcome.rejects else "")
                    + f"{counts}{remarks}\n"
                )
            else:
                rejects = (
                    f"; {outcome.rejected:,} rejected: {outcome.rejects}" if outcome.rejects else ""
                )
                print(f"{counts}: {outcome.out}{rejects}{remarks}")
    except KeyboardInterrupt:
        print("mumacro eval: interrupted; nothing was written", file=sys.stderr)
        return 130
    return 3 if outcome.rejected else 0


def _remark(remark: Remark) -> str:
    """Return the text of a remark for the last lines."""
    cases = remark["cases"]
    rows = f" in {cases:,} rows" if cases > 1 else ""
    return f"; remark on {remark['field']}{rows}: {remark['text']}"

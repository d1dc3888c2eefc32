"""Run ``python -m builder``: build, verify, query and export tables offline."""

import errno
import math
import os
import sys
import time
from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable, Sequence
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import Any

from mumacro import InputError, Surrogate
from mumacro.cli.common import (
    ImpossibleError,
    OneLineParser,
    UsageError,
    as_json,
    in_columns,
    open_table,
    run,
)
from mumacro.errors import missing
from mumacro.kernel.threads import processors


class _Bar:
    """Show progress as a line on stderr: on a terminal one line that is rewritten, elsewhere one
    line for each finished stage."""

    def __init__(self, stages: int) -> None:
        self.stages, self.finished, self.start = stages, 0, time.monotonic()

    def __call__(self, stage: str, is_finished: bool) -> None:
        self.finished += is_finished
        bar = ("#" * round(30 * self.finished / self.stages)).ljust(30, ".")
        seconds = time.monotonic() - self.start
        line = f"{bar} {self.finished:2d}/{self.stages} {seconds:6.0f} s  {stage:<32}"
        if sys.stderr.isatty():
            end = "\n" if self.finished == self.stages else ""
            print(f"\r{line}", end=end, file=sys.stderr, flush=True)
        elif is_finished:
            print(line.rstrip(), file=sys.stderr)


def _writer() -> None:
    """Import the package that writes a table file, so that a missing one is reported before the
    work."""
    import_module("netCDF4")


def _place(out: Path, folder: bool = False) -> None:
    """Refuse a place for a result if its folder is missing or not writable, or if it is a folder
    where a file is needed."""
    if not out.parent.is_dir():
        raise UsageError(f"--out {out}: folder {str(out.parent)!r} does not exist")
    if out.is_dir() and not folder:
        raise UsageError(f"--out {out} is a folder")
    if not os.access(out.parent, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(out.parent))


def _build(options: Namespace) -> str:
    from .solver.sweep import Sweep
    from .tables.build import MAX_TOLERANCE, MIN_TOLERANCE, build_table, stages

    out, tolerance = options.out, options.tolerance
    _writer()
    if not MIN_TOLERANCE <= tolerance <= MAX_TOLERANCE:
        raise UsageError(
            f"--tolerance must be from {MIN_TOLERANCE:g} to {MAX_TOLERANCE:g}, got {tolerance!r}"
        )
    _place(out)
    with Sweep(options.workers) as sweep:
        surrogate = build_table(out, tolerance, sweep, _Bar(stages()))
    return as_json(
        {
            "table": str(out),
            "tolerance": tolerance,
            "verified_max_abs_error": surrogate.max_abs_error,
            "verified_max_rel_error": surrogate.max_rel_error,
            "n_solves": surrogate.attributes["n_solves"],
            "bytes": out.stat().st_size,
            "content_sha256": surrogate.checksum,
        }
    )


def _solve(options: Namespace) -> int:
    from .solver.steady import solve

    try:
        steady = solve(options.v, options.y)
    except InputError as error:
        option = {"v_tilde": "--v", "y_tilde": "--y"}[error.field]
        raise UsageError(f"{option} must be {error.bound}, got {error.value!r}") from None
    print(as_json({"v_tilde": options.v, "y_tilde": options.y, **asdict(steady)}))
    return 0 if steady.ok else 1


def _verify(options: Namespace) -> int:
    from .solver.sweep import Sweep
    from .tables.build import SOLVED_BY, write_verified
    from .tables.plain_grid import interpolation_errors
    from .tables.verify import holds, verify

    if options.write:
        _writer()
    surrogate = Surrogate.open(options.table)
    table = surrogate.table
    with Sweep(options.workers) as sweep:
        reports = {
            name: verify(
                surrogate,
                SOLVED_BY[name](table, contact.tolerance, sweep),
                options.points,
                options.seed,
            )
            for name, contact in table.contacts.items()
        }
        of_grid = interpolation_errors(table, sweep, options.seed)
    all_hold = all(
        holds(report, table.contacts[name].tolerance) for name, report in reports.items()
    )
    report = {"tolerance": surrogate.tolerance, "holds": all_hold, "contacts": reports}
    print(as_json(report | {"plain_grid": of_grid}))
    if not all_hold:
        raise ImpossibleError(
            f"{options.table} misses its tolerance of {surrogate.tolerance:g} or a bound"
        )
    if options.write:
        write_verified(options.table, reports, of_grid)
    return 0


def _export(options: Namespace) -> str:
    table, kind, out = options.path or options.table, options.format, options.out
    if kind == "c":  # the C export needs no further package
        from .export.c import DEFAULT_TOLERANCE, write_c

        surrogate = open_table(table or repr(DEFAULT_TOLERANCE))
        paths = [str(path) for path in write_c(surrogate.table, out or Path("mumacro.h"))]
        return _report(options, {"table": str(surrogate.path), "format": kind, "out": paths})
    from .export.c import ExportError
    from .export.grid import FORMATS, check_format, export_table, grid_errors

    try:
        check_format(kind)
    except ExportError as error:
        raise UsageError(f"--{error}") from None
    path = open_table(table).path
    out = out or Path(FORMATS[kind][0].format(path.stem))
    if out.is_dir():
        raise UsageError(f"--out {out} is a folder")
    exported = export_table(path, kind, out)
    members = {"table": str(path), "format": kind, "out": str(out)}
    if kind == "csv":
        members |= {"shape": exported.mu_ratio.shape, **grid_errors(exported)}
    return _report(options, members)


def _report(options: Namespace, members: dict[str, Any]) -> str:
    """Return what was written, as JSON or in columns, in the way of ``mumacro table``."""
    if options.json:
        return as_json(members)
    return in_columns([(name, _text(value)) for name, value in members.items()])


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.2g}"
    return value if isinstance(value, str) else " ".join(map(str, value))


def _figures(options: Namespace) -> str:
    from .figures import draw_figures

    _place(options.out, folder=True)
    surrogate = Surrogate.open(options.table)
    options.out.mkdir(exist_ok=True)
    paths = draw_figures(surrogate, options.out)
    return as_json({"table": str(surrogate.path), "figures": list(map(str, paths))})


def _whole(low: int, high: float = math.inf) -> Callable[[str], int]:
    """Return the type of an argument: a whole number within bounds."""

    def number(text: str) -> int:
        if text.isdecimal() and low <= int(text) <= high:
            return int(text)
        raise ArgumentTypeError(f"must be a whole number from {low} to {high}, got {text!r}")

    return number


def _build_arguments(parser: OneLineParser) -> None:
    parser.add_argument("--out", type=Path, required=True, help="the netCDF file to write")
    text = (
        "largest absolute error of mu_macro/mu0; the relative one may be 10 times it; default: "
        "%(default)s"
    )
    parser.add_argument("--tolerance", type=float, default=1e-8, help=text)
    _workers_argument(parser)


def _solve_arguments(parser: OneLineParser) -> None:
    parser.add_argument(
        "--v", type=float, required=True, help="dimensionless speed v~, from 1e-60 to 1e10"
    )
    parser.add_argument(
        "--y", type=float, required=True, help="dimensionless amplitude y~, from 1e-15 to 1e14"
    )


def _verify_arguments(parser: OneLineParser) -> None:
    parser.add_argument("table", type=Path, help="a table file")
    text = "fresh solves to compare with; default: %(default)s"
    parser.add_argument("--points", type=_whole(100, 10_000_000), default=20_000, help=text)
    parser.add_argument(
        "--seed", type=_whole(0), default=1, help="seed of the drawn points; default: %(default)s"
    )
    text = "store the errors in the table's attributes, as a build does with --seed 2018"
    parser.add_argument("--write", action="store_true", help=text)
    _workers_argument(parser)


def _export_arguments(parser: OneLineParser) -> None:
    parser.add_argument(
        "path", nargs="?", metavar="TABLE", help="a table file, the same as --table"
    )
    text = "a table file, or a tolerance; default: the tightest bundled table, for c that of 1e-7"
    parser.add_argument("--table", metavar="PATH|TOLERANCE", help=text)
    parser.add_argument("--format", required=True, help="c, csv, fmu or fmu3")
    text = (
        "the file to write; for c a header .h or a folder for three files; default: here, by "
        "the name of the table"
    )
    parser.add_argument("--out", type=Path, help=text)
    parser.add_argument("--json", action="store_true", help="print JSON")


def _figures_arguments(parser: OneLineParser) -> None:
    text = "the folder to write to; it is made where it is missing"
    parser.add_argument("--out", type=Path, required=True, help=text)
    text = "the table that lines come from; default: the tightest"
    parser.add_argument("--table", type=Path, help=text)


def _workers_argument(parser: OneLineParser) -> None:
    text = "threads; default: %(default)s"
    parser.add_argument("--workers", type=_whole(1, 1024), default=processors(), help=text)


#: each command, the function that adds its arguments to a parser, and its help
_COMMANDS: tuple[
    tuple[Callable[[Namespace], int | str], Callable[[OneLineParser], None], str], ...
] = (
    (_build, _build_arguments, "Build a table; it appears whole or not at all."),
    (
        _solve,
        _solve_arguments,
        "Solve the full model once and print the steady cycle as JSON.",
    ),
    (
        _verify,
        _verify_arguments,
        "Compare a table with fresh solves; exit code 1 when it misses its own tolerance.",
    ),
    (_export, _export_arguments, "Write a table for other tools; print what was written."),
    (
        _figures,
        _figures_arguments,
        "Draw the paper's Fig. 4 to 11 from the solver and a table, as PNG.",
    ),
)


def _parser(prog: str) -> OneLineParser:
    text = "exit codes: 0 done, 1 no result or a tolerance missed, 2 wrong arguments"
    parser = OneLineParser(
        prog=prog, description="Build, verify, query and export tables offline.", epilog=text
    )
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for command, add_arguments, text in _COMMANDS:
        name = command.__name__.strip("_")
        subparser = commands.add_parser(name, help=text, description=text)
        subparser.set_defaults(run=command, title=subparser.prog)
        add_arguments(subparser)
    return parser


def main(arguments: Sequence[str] | None = None, prog: str = "python -m builder") -> int:
    """Run the command and return the exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    options = _parser(prog).parse_args(words or ["--help"])
    try:
        return run(options.title, options.run, options)
    except ModuleNotFoundError as error:
        print(f"{options.title}: {missing('builder', error)}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())

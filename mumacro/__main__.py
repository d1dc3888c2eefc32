"""The command ``mumacro`` (``python -m mumacro``): macroscopic friction from the command line.

Exit codes: 0 done, 1 no result is possible (a table, a file, a package, a target out of reach), 2 wrong
arguments; ``mumacro eval`` also 3, done with rejected rows, and 130, interrupted.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from mumacro import command
from mumacro.bundled import bundled_tables
from mumacro.command import ImpossibleError, OneLineParser, UsageError
from mumacro.errors import InputError, MumacroError
from mumacro.inputs import NAMES
from mumacro.version import __version__

__all__ = ["main"]

CASE = "mu0=0.3 Fz=10 k=1e6 y0=2e-6 f=20690 v0=0.01"
INPUTS = """\
inputs, SI units, each as name=value:
  mu0    Coulomb friction coefficient [-], > 0
  Fz     normal force [N], > 0
  k      tangential stiffness [N/m], > 0, or rigid
  y0     amplitude of the transverse oscillation [m], >= 0
  omega  its angular frequency [rad/s], or f, its frequency [Hz], >= 0
  v0     sliding speed [m/s], >= 0
"""
OVERVIEW = f"""\
Macroscopic friction of a contact that is oscillated transversely to its sliding direction.

  mumacro '{CASE}'         one case
  mumacro eval cases.parquet -o out.parquet                  files of cases: csv, ndjson, parquet
  mumacro law 'mu0=0.3 ...' --along v0 --from 1e-4 --to 1    mu_macro along one input
  mumacro solve-for y0 'mu0=0.3 ...' --target 0.15           which input gives a wanted mu_macro
  mumacro table                                              the table in use and its errors
  mumacro export --format csv                                the table for other tools
  mumacro serve                                              the same over HTTP

Each command has its own help: mumacro eval --help.

"""


def _add_table(parser: OneLineParser) -> None:
    text = (
        "a table file, or the error of mu_macro/mu0 that a bundled table must keep; default: the tightest bundled table"
    )
    parser.add_argument("--table", metavar="PATH|TOLERANCE", help=text)
    parser.add_argument("--json", action="store_true", help="print JSON")


def _one_case(words: Sequence[str]) -> int:
    parser = OneLineParser(prog="mumacro", description=OVERVIEW + INPUTS)
    parser.add_argument("words", nargs="+", metavar="name=value", help="the six inputs, quoted together or apart")
    parser.add_argument("--gradient", action="store_true", help="also d mu_macro / d input")
    parser.add_argument("--version", action="version", version=f"mumacro {__version__}")
    _add_table(parser)
    print(command.one_case(parser.parse_intermixed_args(words)))
    return 0


def _law(words: Sequence[str]) -> int:
    parser = OneLineParser(
        prog="mumacro law",
        description="mu_macro over a range of one input, with the static value and the border of continuous sliding.",
        epilog=f"{INPUTS}\nexamples:\n"
        "  mumacro law 'mu0=0.3 Fz=10 k=1e6 y0=2e-6 f=20690' --along v0 --from 1e-4 --to 1",
    )
    parser.add_argument("words", nargs="+", metavar="name=value", help="the other five inputs")
    parser.add_argument("--along", choices=NAMES, default="v0", help="the swept input; default: v0")
    parser.add_argument("--from", dest="start", type=float, required=True, help="first value, in its SI unit")
    parser.add_argument("--to", dest="stop", type=float, required=True, help="last value, in its SI unit")
    parser.add_argument("--points", type=int, default=25, help="number of values; default: 25")
    parser.add_argument("--scale", choices=("log", "linear"), default="log", help="default: log")
    parser.add_argument("--approximations", action="store_true", help="also print the approximations of the article")
    _add_table(parser)
    chosen = parser.parse_intermixed_args(words)
    print(command.law(chosen))
    return 0


def _solve_for(words: Sequence[str]) -> int:
    parser = OneLineParser(
        prog="mumacro solve-for",
        description="Every value of one input at which mu_macro has a wanted value.",
        epilog=f"{INPUTS}\nexample, the amplitude [m] that halves the friction:\n"
        "  mumacro solve-for y0 'mu0=0.3 Fz=10 k=1e6 f=20690 v0=0.01' --target 0.15",
    )
    parser.add_argument("unknown", choices=NAMES, help="the unknown input")
    parser.add_argument("words", nargs="+", metavar="name=value", help="the other five inputs")
    parser.add_argument("--target", type=float, required=True, help="wanted mu_macro [-]")
    parser.add_argument("--ratio", action="store_true", help="the target is mu_macro / mu0")
    parser.add_argument(
        "--between", type=float, nargs=2, metavar=("LOW", "HIGH"), help="range to search, in the SI unit of the unknown"
    )
    _add_table(parser)
    print(command.solve(parser.parse_intermixed_args(words)))
    return 0


def _table(words: Sequence[str]) -> int:
    parser = OneLineParser(
        prog="mumacro table",
        description="Name, path, tolerance, verified errors and checksum of the table in use.",
        epilog="example:\n  mumacro table --table 1e-7",
    )
    _add_table(parser)
    print(command.table(parser.parse_args(words)))
    return 0


def _eval(words: Sequence[str]) -> int:
    try:
        from mumacro.files.command import main as evaluate
    except ModuleNotFoundError as error:
        from mumacro.extras import missing

        raise ImpossibleError(missing("files", error)) from None
    return evaluate(words)


def _part(name: str) -> Any:
    """The command of ``builder`` or ``service``: inside the package when installed, beside it in a checkout."""
    package = Path(__file__).resolve().parent
    if (package / name).is_dir():
        return importlib.import_module(f"mumacro.{name}.__main__")
    if not (package.parent / name / "__main__.py").is_file():
        raise ImpossibleError(f"this installation has no {name}: pip install 'mumacro[{name}]'")
    if str(package.parent) not in sys.path:
        sys.path.insert(0, str(package.parent))
    return importlib.import_module(f"{name}.__main__")


def _export(words: Sequence[str]) -> int:
    parser = OneLineParser(
        prog="mumacro export",
        description="Write the table in use for other tools.",
        epilog="example:\n  mumacro export --format csv --out grid.csv",
    )
    parser.add_argument("--format", required=True, help="csv, mat, modelica, parquet, ...")
    parser.add_argument("--out", help="the file to write; default: the table's name with another suffix, here")
    parser.add_argument("--table", metavar="PATH|TOLERANCE", help="default: the tightest bundled table")
    chosen = parser.parse_args(words)
    builder = _part("builder")
    path = command.open_table(chosen.table).path
    out = [] if chosen.out is None else ["--out", chosen.out]
    builder.app(["export", str(path), "--format", chosen.format, *out], prog_name="mumacro")
    return 0


def _serve(words: Sequence[str]) -> int:
    service = _part("service")
    if "MUMACRO_TABLES" not in os.environ and bundled_tables():
        os.environ["MUMACRO_TABLES"] = os.pathsep.join(map(str, bundled_tables()))
    return int(service.main(list(words)))


COMMANDS: dict[str, Callable[[Sequence[str]], int]] = {
    "eval": _eval, "law": _law, "solve-for": _solve_for, "table": _table, "export": _export, "serve": _serve,
}  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return the exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    run = COMMANDS.get(words[0]) if words else None
    title = f"mumacro {words[0]}" if run else "mumacro"
    try:
        code = run(words[1:]) if run else _one_case(words or ["--help"])
        sys.stdout.flush()
        return code
    except (UsageError, InputError) as error:
        print(f"{title}: {error}", file=sys.stderr)
        return 2
    except (ImpossibleError, MumacroError) as error:
        print(f"{title}: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:  # the reader, such as head, has closed the pipe
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        print(f"{title}: {where}{' '.join((error.strerror or str(error)).split())}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"{title}: interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())

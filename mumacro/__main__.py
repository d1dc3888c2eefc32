"""The command ``mumacro`` (``python -m mumacro``): macroscopic friction from the command line.

Exit codes: 0 done, 1 no result is possible (a table, a file, a package, a target out of reach), 2 wrong
arguments; ``mumacro eval`` also 3, done with rejected rows, and 130, interrupted.
"""

from __future__ import annotations

import difflib
import importlib
import math
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

from mumacro.bundled import bundled_tables
from mumacro.command import ImpossibleError, OneLineParser, UsageError, as_json, open_table, read_case, read_value, run
from mumacro.extras import missing
from mumacro.inputs import NAMES, PER_UNIT, RAD_PER_CYCLE, SI
from mumacro.inverse import solve_for
from mumacro.law import approximations, friction_law, sweep_values
from mumacro.surrogate import Surrogate
from mumacro.version import __version__

__all__ = ["main"]

CASE = "mu0=0.3 Fz=10 k=1e6 y0=2um f=20.69kHz v0=0.01"
LAW = "mumacro law 'mu0=0.3 Fz=10 k=1e6 y0=2um f=20.69kHz' --from 1e-4 --to 1"
SOLVE_FOR = "mumacro solve-for y0 'mu0=0.3 Fz=10 k=1e6 f=20.69kHz v0=0.01' --target 0.15"
INPUTS = """\
inputs, each as name=value, in SI units or with a unit as in y0=2um:
  mu0    Coulomb friction coefficient [-], > 0
  Fz     normal force [N], > 0
  k      tangential stiffness [N/m], > 0, or rigid
  y0     amplitude of the transverse oscillation [m], >= 0
  omega  its angular frequency [rad/s], or f, its frequency [Hz], >= 0
  v0     sliding speed [m/s], >= 0
"""
FIRST = f"""\
friction of one case:      mumacro '{CASE}'
friction along the speed:  {LAW}
which amplitude halves it: {SOLVE_FOR}
everything else:           mumacro --help"""
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
REGIME_WORDS = {
    "continuous": "slips all the time",
    "stick_slip": "sticks during a part of each period",
    "static": "at rest: the limit v0 -> 0",
}


def _add_table(parser: OneLineParser, words: str | None = None) -> None:
    """The options of all commands that answer, after the inputs, if there are any, explained by ``words``."""
    if words is not None:
        parser.add_argument("words", nargs="+", metavar="name=value", help=words)
    text = "a table file, or the error of mu_macro/mu0 that a bundled table must keep; default: the tightest one"
    parser.add_argument("--table", metavar="PATH|TOLERANCE", help=text)
    parser.add_argument("--json", action="store_true", help="print JSON")


def _about(surrogate: Surrogate) -> dict[str, Any]:
    return {"id": surrogate.id, "tolerance": surrogate.tolerance}


def _inner(name: str) -> tuple[str, float]:
    """The input of the model behind a name, and what one unit of the name is of it."""
    return ("omega", RAD_PER_CYCLE) if name == "f" else (name, 1.0)


def _lines(rows: Iterable[Sequence[str]]) -> str:
    """Rows of cells as text in columns."""
    columns = list(zip_longest(*rows, fillvalue=""))
    padded = ([cell.ljust(max(map(len, column))) for cell in column] for column in columns)
    return "\n".join("  ".join(row).rstrip() for row in zip(*padded, strict=True))


def _one_case(words: Sequence[str]) -> str:
    parser = OneLineParser(prog="mumacro", description=OVERVIEW + INPUTS)
    _add_table(parser, "the six inputs, quoted together or apart")
    parser.add_argument("--gradient", action="store_true", help="also d mu_macro / d input")
    parser.add_argument("--version", action="version", version=f"mumacro {__version__}")
    chosen = parser.parse_intermixed_args(words)
    case = read_case(chosen.words)
    surrogate = open_table(chosen.table)
    answer = surrogate.evaluate(case, gradient=chosen.gradient)
    if chosen.json:
        names = ["mu_macro", "mu_ratio", "regime", "error_bound", "source", "v_tilde", "y_tilde"]
        found = {name: getattr(answer, name) for name in names + ["gradient"] * chosen.gradient}
        return as_json({**found, "inputs": case, "table": _about(surrogate)})
    rows = [
        ("mu_macro", f"{answer.mu_macro:.15g}", "[-]", f"+- {answer.error_bound:.2g}"),
        ("mu_ratio", f"{answer.mu_ratio:.15g}", "[-]", "mu_macro / mu0"),
        ("regime", answer.regime, "", REGIME_WORDS[answer.regime]),
        ("v_tilde", f"{answer.v_tilde:.15g}", "[-]", "v0 k / (mu0 Fz omega)"),
        ("y_tilde", f"{answer.y_tilde:.15g}", "[-]", "y0 k / (mu0 Fz)"),
        ("source", answer.source, "", f"of {surrogate.id}, tolerance {surrogate.tolerance:g}"),
    ]
    for name, slope in (answer.gradient or {}).items():
        rows.append((f"slope {name}", f"{slope:.10g}", f"[{PER_UNIT[name]}]", f"d mu_macro / d {name}"))
    return _lines(rows)


def _law(words: Sequence[str]) -> str:
    parser = OneLineParser(
        prog="mumacro law",
        description="mu_macro over a range of one input, with the static value and the border of continuous sliding.",
        epilog=f"{INPUTS}\nexample:\n  {LAW}",
    )
    _add_table(parser, "the other five inputs")
    parser.add_argument("--along", choices=NAMES, default="v0", help="the swept input; default: v0")
    parser.add_argument("--from", dest="start", required=True, help="first value, in its SI unit or with a unit")
    parser.add_argument("--to", dest="stop", required=True, help="last value, in its SI unit or with a unit")
    parser.add_argument("--points", type=int, default=25, help="number of values; default: 25")
    parser.add_argument("--scale", choices=("log", "linear"), default="log", help="default: log")
    parser.add_argument("--approximations", action="store_true", help="also print the approximations of the article")
    chosen = parser.parse_intermixed_args(words)
    along, (inner, scale), unit = chosen.along, _inner(chosen.along), SI[chosen.along][0]
    case = read_case(chosen.words, along)
    start, stop = (scale * read_value(along, text) for text in (chosen.start, chosen.stop))
    values = sweep_values(inner, start, stop, chosen.points, chosen.scale)
    surrogate = open_table(chosen.table)
    found = friction_law(surrogate, inner, values, case)
    columns: dict[str, Any] = {
        along: values / scale,
        **{name: getattr(found.answer, name) for name in ("mu_macro", "regime", "error_bound", "source")},
        "mu_static": found.mu_static,
    }
    if chosen.approximations:
        columns |= approximations(surrogate, found, case)
    border = [{along: c.value / scale, "mu_macro": c.mu_macro} for c in found.border]
    if chosen.json:
        return as_json({"along": along, "unit": unit, **columns, "border": border, "table": _about(surrogate)})
    del columns["source"]
    shown = [[cell if isinstance(cell, str) else _shown(cell) for cell in column] for column in columns.values()]
    heads = [f"{name} [{unit}]" if name == along else name for name in columns]
    marks = [f"border of continuous sliding at {along} = {b[along]:.12g} {unit}" for b in border]
    return "\n".join([_lines([heads, *zip(*shown, strict=True)]), *marks])


def _shown(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.12g}"


def _solve_for(words: Sequence[str]) -> str:
    parser = OneLineParser(
        prog="mumacro solve-for",
        description="Every value of one input at which mu_macro has a wanted value.",
        epilog=f"{INPUTS}\nexample, the amplitude [m] that halves the friction:\n  {SOLVE_FOR}",
    )
    parser.add_argument("unknown", choices=NAMES, help="the unknown input")
    _add_table(parser, "the other five inputs")
    parser.add_argument("--target", type=float, required=True, help="wanted mu_macro [-]")
    parser.add_argument("--ratio", action="store_true", help="the target is mu_macro / mu0")
    text = "range to search, in the SI unit of the unknown or with a unit"
    parser.add_argument("--between", nargs=2, metavar=("LOW", "HIGH"), help=text)
    chosen = parser.parse_intermixed_args(words)
    unknown, (inner, scale), unit = chosen.unknown, _inner(chosen.unknown), SI[chosen.unknown][0]
    case = read_case(chosen.words, unknown)
    if chosen.ratio and unknown == "mu0":
        raise UsageError("--ratio cannot be used with mu0 as the unknown: give --target alone")
    target = chosen.target * case["mu0"] if chosen.ratio else chosen.target
    low, high = (scale * read_value(unknown, text) for text in chosen.between or ("0", "0"))
    surrogate = open_table(chosen.table)
    found = solve_for(surrogate, inner, target, case, (low, high) if chosen.between else None)
    reach = found.reach
    if not found.roots[0]:
        where = f"{unknown} from {reach.low / scale:.6g} to {reach.high / scale:.6g} {unit}"
        if found.constant:
            raise ImpossibleError(f"{unknown} has no influence here: mu_macro is {reach.mu_min:.12g} for {where}")
        raise ImpossibleError(
            f"mu_macro = {target:.12g} is out of reach: {where} gives {reach.mu_min:.12g} to {reach.mu_max:.12g}"
        )
    roots = [(r.value / scale, r.low / scale, r.high / scale, r.mu_macro, r.regime) for r in found.roots[0]]
    if chosen.json:
        listed = [dict(zip((unknown, "low", "high", "mu_macro", "regime"), root, strict=True)) for root in roots]
        return as_json(
            {"unknown": unknown, "unit": unit, "target": target, "roots": listed, "table": _about(surrogate)}
        )
    heads = [f"{unknown} [{unit}]", "between", "and", "mu_macro [-]", "regime"]
    return _lines([heads, *([*(f"{x:.15g}" for x in numbers), regime] for *numbers, regime in roots)])


def _table(words: Sequence[str]) -> str:
    parser = OneLineParser(
        prog="mumacro table",
        description="Name, path, tolerance, verified errors and checksum of the table in use.",
        epilog="example:\n  mumacro table --table 1e-7",
    )
    _add_table(parser)
    chosen = parser.parse_args(words)
    surrogate = open_table(chosen.table)
    found = {
        "id": surrogate.id,
        "path": str(surrogate.path),
        "tolerance": surrogate.tolerance,
        "verified_max_abs_error": surrogate.max_abs_error,
        "verified_max_rel_error": surrogate.max_rel_error,
        "checksum": surrogate.checksum,
        "format_version": surrogate.attributes.get("format_version"),
        "product_version": surrogate.attributes.get("product_version"),
        "bytes": surrogate.path.stat().st_size,
    }
    bundled = [str(path) for path in bundled_tables()]
    if chosen.json:
        return as_json({**found, "bundled": bundled})
    rows = [(name, f"{value:.3g}" if isinstance(value, float) else str(value)) for name, value in found.items()]
    return _lines([*rows, *zip_longest(["bundled"], bundled, fillvalue="")])


def _part(name: str) -> Any:
    """The command of ``builder`` or ``service``: inside the package when installed, beside it in a checkout."""
    package = Path(__file__).resolve().parent
    if (package / name).is_dir():
        return importlib.import_module(f"mumacro.{name}.__main__")
    if not (package.parent / name).is_dir():
        raise ImpossibleError(f"this installation has no {name}: pip install 'mumacro[{name}]'")
    if str(package.parent) not in sys.path:
        sys.path.insert(0, str(package.parent))
    return importlib.import_module(f"{name}.__main__")


def _eval(words: Sequence[str]) -> int:
    try:
        from mumacro.files.command import main as evaluate
    except ModuleNotFoundError as error:
        raise ImpossibleError(missing("files", error)) from None
    return evaluate(words)


def _export(words: Sequence[str]) -> int:
    return int(_part("builder").main(["export", *words], "mumacro"))


def _serve(words: Sequence[str]) -> int:
    service = _part("service")
    if "MUMACRO_TABLES" not in os.environ and bundled_tables():
        os.environ["MUMACRO_TABLES"] = os.pathsep.join(map(str, bundled_tables()))
    return int(service.main(list(words)))


COMMANDS: dict[str, Callable[[Sequence[str]], int | str]] = {
    "eval": _eval, "law": _law, "solve-for": _solve_for, "table": _table, "export": _export, "serve": _serve,
}  # fmt: skip


def _no_command(words: Sequence[str]) -> str:
    """A case, or what helps a person who wrote something else."""
    if not words:
        return FIRST
    meant = difflib.get_close_matches(words[0], COMMANDS, n=1)
    if meant and words[0] not in NAMES:
        raise UsageError(f"unknown command {words[0]!r}: did you mean {meant[0]}?")
    return _one_case(words)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return the exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words and words[0] in COMMANDS:
        return run(f"mumacro {words[0]}", COMMANDS[words[0]], words[1:])
    return run("mumacro", _no_command, words)


if __name__ == "__main__":
    sys.exit(main())

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
from collections.abc import Callable, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

from mumacro import command
from mumacro.bundled import bundled_tables
from mumacro.command import ImpossibleError, OneLineParser, UsageError, as_json, in_columns, open_table, read_case
from mumacro.extras import missing
from mumacro.inputs import NAMES, PER_UNIT
from mumacro.inverse import solve_for
from mumacro.questions import LAW, SOLVE_FOR, law, map_, solve, stiffness_of
from mumacro.version import __version__

__all__ = ["main"]

CASE = "mu0=0.3 Fz=10N k=1N/um y0=2um f=20.69kHz v0=1cm/s"
FIRST = f"""\
friction of one case:      mumacro '{CASE}'
friction along the speed:  {LAW}
which amplitude halves it: {SOLVE_FOR}
everything else:           mumacro --help"""
OVERVIEW = f"""\
Macroscopic friction of a contact that is oscillated transversely to its sliding direction.

  mumacro '{CASE}'          one case
  mumacro eval cases.parquet -o out.parquet                      files of cases: csv, ndjson, parquet
  mumacro law 'mu0=0.3 ...' --along v0 1mm/s 1m/s -o law.png     mu_macro along one input
  mumacro solve-for y0 'mu0=0.3 ...' --target 0.15               which input gives a wanted mu_macro
  mumacro map -o map.png                                         mu_macro/mu0 over speed and amplitude
  mumacro stiffness ball --radius 5mm --Fz 10N --E 210GPa --nu 0.3    k from materials
  mumacro table                                                  the table in use and its errors
  mumacro export --format csv                                    the table for other tools
  mumacro serve                                                  the same over HTTP

Each command has its own help: mumacro eval --help.

"""
REGIME_WORDS = {
    "continuous": "slips all the time",
    "stick_slip": "sticks during a part of each period",
    "static": "at rest: the limit v0 -> 0",
}


def _one_case(words: Sequence[str]) -> str:
    parser = OneLineParser(prog="mumacro", description=OVERVIEW + command.INPUTS)
    command.add_table(parser, "the six inputs, quoted together or apart")
    parser.add_argument("--gradient", action="store_true", help="also d mu_macro / d input")
    parser.add_argument("--version", action="version", version=f"mumacro {__version__}")
    chosen = parser.parse_intermixed_args(words)
    case = read_case(chosen.words, ranges=True)
    between: dict[str, Any] = {}
    surrogate = open_table(chosen.table)
    if isinstance(case["k"], tuple):
        reach = solve_for(surrogate, "k", 0.0, {**case, "k": None}, case["k"]).reach
        between = {"k": case["k"], "mu_macro_low": reach.mu_min, "mu_macro_high": reach.mu_max}
        case["k"] = math.sqrt(case["k"][0]) * math.sqrt(case["k"][1])
    answer = surrogate.evaluate(case, gradient=chosen.gradient)
    if chosen.json:
        names = ["mu_macro", "mu_ratio", "regime", "error_bound", "source", "v_tilde", "y_tilde"]
        found = {name: getattr(answer, name) for name in names + ["gradient"] * chosen.gradient}
        return as_json({**found, "inputs": case, "k_range": between or None, "table": command.about(surrogate)})
    digits = f".{chosen.digits}g"
    rows = [
        ("mu_macro", f"{answer.mu_macro:{digits}}", "[-]", f"+- {answer.error_bound:.2g}"),
        ("mu_ratio", f"{answer.mu_ratio:{digits}}", "[-]", "mu_macro / mu0"),
        ("regime", answer.regime, "", REGIME_WORDS[answer.regime]),
        ("v_tilde", f"{answer.v_tilde:{digits}}", "[-]", "v0 k / (mu0 Fz omega)"),
        ("y_tilde", f"{answer.y_tilde:{digits}}", "[-]", "y0 k / (mu0 Fz)"),
        ("source", answer.source, "", f"of {surrogate.id}, tolerance {surrogate.tolerance:g}"),
    ]
    if between:
        rows.insert(1, ("from", f"{between['mu_macro_low']:{digits}}", "[-]", f"for k from {between['k'][0]:{digits}}"))
        rows.insert(2, ("to", f"{between['mu_macro_high']:{digits}}", "[-]", f"to {between['k'][1]:{digits}} N/m"))
        rows[0] = (*rows[0][:3], f"{rows[0][3]}, at k = {case['k']:{digits}} N/m, the geometric middle")
    for name, slope in (answer.gradient or {}).items():
        rows.append((f"slope {name}", f"{slope:{digits}}", f"[{PER_UNIT[name]}]", f"d mu_macro / d {name}"))
    return in_columns(rows)


def _table(words: Sequence[str]) -> str:
    parser = OneLineParser(
        prog="mumacro table",
        description="Name, path, tolerance, verified errors and checksum of the table in use.",
        epilog="example:\n  mumacro table --table 1e-7",
    )
    command.add_table(parser)
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
    return in_columns([*rows, *zip_longest(["bundled"], bundled, fillvalue="")])


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
    "eval": _eval, "law": law, "solve-for": solve, "map": map_, "stiffness": stiffness_of, "table": _table,
    "export": _export, "serve": _serve,
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
        return command.run(f"mumacro {words[0]}", COMMANDS[words[0]], words[1:])
    return command.run("mumacro", _no_command, words)


if __name__ == "__main__":
    sys.exit(main())

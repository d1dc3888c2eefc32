"""The command ``mumacro`` (``python -m mumacro``): macroscopic friction from the command line.

Exit codes: 0 done, 1 no result is possible (a table, a file, a package, a target out of reach), 2
wrong arguments; ``mumacro eval`` also 3, done with rejected rows, and 130, interrupted.
"""

import difflib
import importlib
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

from mumacro.analysis.validity import model_rows
from mumacro.answer import BAND
from mumacro.cli import common
from mumacro.cli.common import (
    ImpossibleError,
    OneLineParser,
    UsageError,
    as_json,
    in_columns,
    open_table,
    read_case,
)
from mumacro.cli.fit import FIT, fit_points
from mumacro.cli.questions import LAW, SOLVE_FOR, STIFFNESS, law, map_, solve, stiffness_of
from mumacro.extras import missing
from mumacro.inputs.fields import LIKE, NAMES, PER_UNIT
from mumacro.inputs.kind import SPRING, Kind
from mumacro.surrogate import Surrogate
from mumacro.table.bundled import bundled_tables
from mumacro.version import __version__

CASE = "mu0=0.3 Fz=10N k=1N/um y0=2um f=20.69kHz v0=1cm/s"
FIRST = f"""\
friction of one case:      mumacro '{CASE}'
friction along the speed:  {LAW}
which amplitude halves it: {SOLVE_FOR}
everything else:           mumacro --help"""
OVERVIEW = f"""\
Macroscopic friction of a contact that oscillates across or along its sliding direction,
or normally.

  mumacro '{CASE}'          one case
  mumacro eval cases.parquet -o out.parquet                      files: csv, ndjson, parquet
  mumacro law 'mu0=0.3 ...' --along v0 1mm/s 1m/s -o law.png     mu_macro along one input
  mumacro solve-for y0 'mu0=0.3 ...' --target 0.15               which input gives a wanted mu_macro
  mumacro map -o map.png                                         mu_macro/mu0, speed and amplitude
  {FIT}    k and mu0 from measured points
  {STIFFNESS}    k from materials
  mumacro table                                                  the table in use and its errors
  mumacro export --format csv                                    the table for other tools
  mumacro serve                                                  the same over HTTP

Each command has its own help: mumacro eval --help.

"""
REGIME_WORDS = {
    "continuous": "slips all the time",
    "stick_slip": "sticks during a part of each period",
    "static": "at rest: the limit v0 -> 0",
    "partial_slip": "the rim of the contact slips all the time, its middle sticks during a part of "
    "each period",
    "reverse_slip": "slips forwards and backwards in each period",
}
ROW_OF_K = ("k is known", True)  # the answer for an interval tells that already


def _one_case(words: Sequence[str]) -> str:
    parser = OneLineParser(prog="mumacro", description=OVERVIEW + common.INPUTS)
    common.add_case(parser, "the six inputs, quoted together or apart")
    parser.add_argument("--gradient", action="store_true", help="also d mu_macro / d input")
    parser.add_argument(
        "--model", action="store_true", help="in JSON, too: what the model leaves out in this case"
    )
    parser.add_argument("--version", action="version", version=f"mumacro {__version__}")
    chosen = parser.parse_intermixed_args(words)
    kind = common.kind_in(chosen)
    case = read_case(chosen.words, kind)
    surrogate = open_table(chosen.table)
    answer = surrogate.evaluate(**{**case, **kind.names, "gradient": chosen.gradient})
    middle = common.middle_of(case)
    rows = model_rows(surrogate, middle, **kind.names) if chosen.model or not chosen.json else []
    if chosen.json:
        names = ["mu_macro", "mu_ratio", "regime", "error_bound", "source", "v_tilde", "y_tilde"]
        found = {name: getattr(answer, name) for name in names + ["gradient"] * chosen.gradient}
        ends = {name: getattr(answer, name) for name in BAND if "k_range" in case}
        found |= {"inputs": middle, "k_range": {"k": case["k_range"], **ends} if ends else None}
        found |= {"model": rows} if chosen.model else {}
        found |= dict(kind.names.items() - SPRING.names.items())
        return as_json({**found, "table": common.about(surrogate)})
    lines = [
        ("model", f"{row['row']}: {common.in_words(row['text'], middle)}")
        for row in rows
        if (row["row"], "k_range" in case) != ROW_OF_K
    ]
    text = in_columns(
        _rows_of(answer, surrogate, case, kind, common.format_for(chosen, surrogate, case, kind))
    )
    error = f"numerical error  {answer.error_bound:.2g}"
    return "\n".join([text, *([in_columns(lines)] if lines else []), error])


def _rows_of(
    answer: Any, surrogate: Surrogate, case: Mapping[str, Any], kind: Kind, form: str
) -> list[Sequence[str]]:
    """An answer as rows of name, value, unit, meaning."""
    groups = "Fz_amplitude / Fz" if kind.normal else "y0 k / (mu0 Fz)"
    rows = [
        ("mu_macro", f"{answer.mu_macro:#{form}}", "[-]", ""),
        ("mu_ratio", f"{answer.mu_ratio:#{form}}", "[-]", "mu_macro / mu0"),
        ("regime", answer.regime, "", REGIME_WORDS[answer.regime]),
        ("v_tilde", f"{answer.v_tilde:{form}}", "[-]", "v0 k / (mu0 Fz omega)"),
        ("y_tilde", f"{answer.y_tilde:{form}}", "[-]", groups),
        ("source", answer.source, "", f"of {surrogate.id}, tolerance {surrogate.tolerance:g}"),
    ]
    if "k_range" in case:
        low, high = (f"{end:.6g}" for end in case["k_range"])
        middle = f"at k = {common.middle_of(case)['k']:.6g} N/m, the geometric middle"
        rows[:1] = [
            (*rows[0][:3], middle),
            (
                "from",
                f"{answer.mu_macro_low:#{form}}",
                "[-]",
                f"the least for k from {low} to {high} N/m",
            ),
            ("to", f"{answer.mu_macro_high:#{form}}", "[-]", "the most"),
        ]
    for name, slope in (answer.gradient or {}).items():
        unit = PER_UNIT[LIKE.get(name, name)]
        rows.append((f"slope {name}", f"{slope:{form}}", f"[{unit}]", f"d mu_macro / d {name}"))
    return list(rows)


def _table(words: Sequence[str]) -> str:
    parser = OneLineParser(
        prog="mumacro table",
        description="Name, path, tolerance, verified errors and checksum of the table in use.",
        epilog="example:\n  mumacro table --table 1e-7",
    )
    common.add_table(parser)
    chosen = parser.parse_args(words)
    surrogate = open_table(chosen.table)
    names = (
        "verified_max_abs_error",
        "verified_max_rel_error",
        "content_sha256",
        "format_version",
        "product_version",
    )
    told = {name: surrogate.attributes.get(name) for name in names}
    told["checksum"] = told.pop("content_sha256")
    found = {
        **common.about(surrogate),
        "path": str(surrogate.path),
        **told,
        "bytes": surrogate.path.stat().st_size,
    }
    bundled = [str(path) for path in bundled_tables()]
    if chosen.json:
        errors = surrogate.error_distribution
        return as_json({**found, "error_distribution": errors, "bundled": bundled})
    rows = [
        (name, f"{value:.3g}" if isinstance(value, float) else str(value))
        for name, value in found.items()
    ]
    told_rows = in_columns([*rows, *zip_longest(["bundled"], bundled, fillvalue="")])
    return "\n\n".join([told_rows, *_errors(surrogate)])


def _errors(surrogate: Surrogate) -> Iterator[str]:
    """How the verified errors are distributed, as text; nothing for a table without that."""
    spread = surrogate.error_distribution
    if spread:
        heads = [
            f"{100.0 * float(x):g} %" if x[0].isdigit() else x for x in next(iter(spread.values()))
        ]
        rows = [
            (name, *(f"{value:.2g}" for value in part.values())) for name, part in spread.items()
        ]
        text = "errors that a share of the verified points does not exceed; bound over error"
        yield f"{text}\n{in_columns([('', *heads), *rows])}"


def _part(name: str) -> Any:
    """The command of ``builder`` or ``service``: inside the package when installed, beside it in a
    checkout."""
    package = Path(__file__).resolve().parent.parent
    if (package / name).is_dir():
        return importlib.import_module(f"mumacro.{name}.__main__")
    if not (package.parent / name).is_dir():
        raise ImpossibleError(f"this installation has no {name}: pip install 'mumacro[{name}]'")
    if str(package.parent) not in sys.path:
        sys.path.insert(0, str(package.parent))
    return importlib.import_module(f"{name}.__main__")


def _eval(words: Sequence[str]) -> int:
    try:
        from mumacro.cli.eval import main as evaluate
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
    "eval": _eval,
    "law": law,
    "solve-for": solve,
    "map": map_,
    "fit": fit_points,
    "stiffness": stiffness_of,
    "table": _table,
    "export": _export,
    "serve": _serve,
}


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
        return common.run(f"mumacro {words[0]}", COMMANDS[words[0]], words[1:])
    return common.run("mumacro", _no_command, words)

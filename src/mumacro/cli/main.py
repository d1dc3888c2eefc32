"""Run the command ``mumacro`` (``python -m mumacro``): macroscopic friction from the command line.

Exit codes: 0 done; 1 no result is possible (a table, a file, a package, a target out of reach); 2
wrong arguments.  ``mumacro eval`` also has 3, done with rejected rows, and 130, interrupted.
"""

import difflib
import importlib
import os
import shlex
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from mumacro import __version__
from mumacro.cli import common
from mumacro.cli.common import ImpossibleError, OneLineParser, UsageError
from mumacro.errors import missing
from mumacro.inputs.fields import NAMES, kind_of
from mumacro.table.bundled import bundled_tables
from mumacro.validity import in_words, rows_of

EXAMPLE = "mu0=0.3 Fz=10N k=1N/um y0=2um f=20kHz v0=10mm/s"
_TASKS = {
    f'mumacro "{EXAMPLE}"': "one case",
    "mumacro eval cases.parquet -o out.parquet": "files: text, xlsx, parquet",
    'mumacro law "mu0=0.3 ..." --along v0 1mm/s 1m/s -o law.png': "mu_macro along one input",
    'mumacro solve-for y0 "mu0=0.3 ..." --target 0.15': "the input for a mu_macro",
    "mumacro map -o map.png": "the map of all cases",
    'mumacro motion "mu0=0.3 ..." --x 1um@90deg --y 2um': "any periodic motion",
    'mumacro fit measured.csv "Fz=10N ..." -o fit.png': "k from measured points",
    "mumacro fit-loop loop.csv Fz=10N --displacement x --force Ft": "k from a measured loop",
    "mumacro stiffness ball --radius 5mm --Fz 10N ...": "k from materials",
    "mumacro table": "the table in use, its errors",
    "mumacro export --format csv": "the table for other tools",
    "mumacro serve": "page and REST service",
}
OVERVIEW = (
    "Friction of a shaken contact.  Each command has its own help: mumacro eval --help.\n\n"
    + "".join(f"  {words:68}  {description}\n" for words, description in _TASKS.items())
    + "\n"
)


def _part(name: str) -> Any:
    """Return the command of ``builder`` or ``service``: inside the package when installed, at the
    top of a checkout."""
    package = Path(__file__).resolve().parent.parent
    if (package / name).is_dir():
        return importlib.import_module(f"mumacro.{name}.__main__")
    checkout = package.parent.parent
    if not (checkout / name).is_dir():
        raise ImpossibleError(f'this installation has no {name}: pip install "mumacro[{name}]"')
    if str(checkout) not in sys.path:
        sys.path.insert(0, str(checkout))
    return importlib.import_module(f"{name}.__main__")


def _eval(words: Sequence[str]) -> int:
    if any(word.partition("=")[0] in NAMES and not Path(word).exists() for word in words):
        raise UsageError(
            f"it evaluates files; one case is given without eval: mumacro {shlex.join(words)}"
        )
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
    return int(service.main(list(words), "mumacro serve"))


Command = Callable[[Sequence[str]], int | str]


def _in_module(name: str) -> Command:
    """Return a command whose module is loaded when it is called, so that one case starts sooner."""
    module = f"mumacro.cli.{name.replace('-', '_')}"
    return lambda words: importlib.import_module(module).run(words)


COMMANDS: dict[str, Command] = {
    "eval": _eval,
    **{
        name: _in_module(name)
        for name in ("law", "solve-for", "map", "motion", "fit", "fit-loop", "stiffness", "table")
    },
    "export": _export,
    "serve": _serve,
}


def _first_steps() -> str:
    """Return the text for a person who wrote no arguments."""
    from mumacro.cli import law, solve_for

    return (
        f'friction of one case:      mumacro "{EXAMPLE}"\n'
        f"friction along the speed:  {law.EXAMPLE}\n"
        f"which amplitude halves it: {solve_for.EXAMPLE}\n"
        "everything else:           mumacro --help"
    )


def _no_command(words: Sequence[str]) -> str:
    """Return the answer to a case, or advice if the words are neither a case nor a command."""
    if not words:
        return _first_steps()
    similar = difflib.get_close_matches(words[0], COMMANDS, n=1, cutoff=0.7)
    if similar and words[0] not in NAMES:
        raise UsageError(f"unknown command {words[0]!r}: did you mean {similar[0]}?")
    return _one_case(words)


def _one_case(words: Sequence[str]) -> str:
    """Run ``mumacro "mu0=0.3 ..."``: return the friction of one case."""
    parser = OneLineParser(prog="mumacro", description=OVERVIEW + common.ABOUT_INPUTS)
    common.add_case(parser, "the six inputs, quoted together or apart")
    common.add_options(parser, "include")
    parser.add_argument(
        "--model", action="store_true", help="in JSON, too: what the model leaves out in this case"
    )
    parser.add_argument("--version", action="version", version=f"mumacro {__version__}")
    options = parser.parse_intermixed_args(words)
    kind = kind_of(options.contact, options.direction)
    case = common.read_case(options.words, kind, deviations=True)
    surrogate, include = common.open_table(options.table), common.included(options)
    inputs: dict[str, Any] = {**case.inputs, **kind.names, "include": include}
    answer: Any = surrogate.evaluate(**inputs)
    if options.json:
        model = {"model": rows_of(answer)} if options.model else {}
        return common.as_json({**answer.to_dict(), **model}, surrogate)
    rows, notes, error = in_words(answer, case.units)
    lines = [common.case_line(case, kind), common.in_columns(rows)]
    return "\n".join([*lines, *([common.in_columns(notes)] if notes else []), error])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return the exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words and words[0] in COMMANDS:
        return common.run(f"mumacro {words[0]}", COMMANDS[words[0]], words[1:])
    return common.run("mumacro", _no_command, words)

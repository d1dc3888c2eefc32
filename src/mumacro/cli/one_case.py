"""Run ``mumacro "mu0=0.3 Fz=10N ..."``: print the friction of one case."""

import argparse
from collections.abc import Sequence
from typing import Any

from mumacro.cli import common
from mumacro.cli.common import OneLineParser, as_json, in_columns, open_table, read_case
from mumacro.validity import rows_of
from mumacro.version import __version__
from mumacro.words import of_one_case as words_of_one_case

EXAMPLE = "mu0=0.3 Fz=10N k=1N/um y0=2um f=20kHz v0=10mm/s"


def run(words: Sequence[str], description: str) -> str:
    """Run ``mumacro "mu0=0.3 ..."``; ``description`` is the text of the help for the whole
    command."""
    parser = OneLineParser(prog="mumacro", description=description + common.ABOUT_INPUTS)
    common.add_case(parser, "the six inputs, quoted together or apart")
    common.add_include(parser)
    parser.add_argument("--gradient", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument(
        "--model", action="store_true", help="in JSON, too: what the model leaves out in this case"
    )
    parser.add_argument("--version", action="version", version=f"mumacro {__version__}")
    arguments = parser.parse_intermixed_args(words)
    kind = common.kind_in(arguments)
    case = read_case(arguments.words, kind, deviations=True)
    surrogate = open_table(arguments.table)
    include = (*common.included(arguments), *(["gradient"] if arguments.gradient else []))
    options: dict[str, Any] = {**kind.names, "include": include}
    answer: Any = surrogate.evaluate(case, **options)
    if arguments.json:
        said = {"model": rows_of(answer)} if arguments.model else {}
        return as_json({**answer.to_dict(), **said, "table": common.table_members(surrogate)})
    units = common.typed_units(arguments.words)
    rows, notes, error = words_of_one_case(answer, arguments.digits, units)
    line = common.case_line(case, units, kind)
    return "\n".join([line, in_columns(rows), *([in_columns(notes)] if notes else []), error])

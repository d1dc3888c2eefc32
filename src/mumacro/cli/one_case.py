"""Run ``mumacro "mu0=0.3 Fz=10N ..."``: print the friction of one case."""

from collections.abc import Sequence
from typing import Any

from mumacro import __version__
from mumacro.cli import common
from mumacro.cli.common import OneLineParser, as_json, in_columns, open_table, read_case
from mumacro.inputs.fields import kind_of
from mumacro.validity import in_words, rows_of

EXAMPLE = "mu0=0.3 Fz=10N k=1N/um y0=2um f=20kHz v0=10mm/s"


def run(words: Sequence[str], description: str) -> str:
    """Run ``mumacro "mu0=0.3 ..."``; ``description`` is the text of the help for the whole
    command."""
    parser = OneLineParser(prog="mumacro", description=description + common.ABOUT_INPUTS)
    common.add_case(parser, "the six inputs, quoted together or apart")
    common.add_options(parser, "include")
    parser.add_argument(
        "--model", action="store_true", help="in JSON, too: what the model leaves out in this case"
    )
    parser.add_argument("--version", action="version", version=f"mumacro {__version__}")
    options = parser.parse_intermixed_args(words)
    kind = kind_of(options.contact, options.direction)
    case = read_case(options.words, kind, deviations=True)
    surrogate, include = open_table(options.table), common.included(options)
    inputs: dict[str, Any] = {**case.inputs, **kind.names, "include": include}
    answer: Any = surrogate.evaluate(**inputs)
    if options.json:
        model = {"model": rows_of(answer)} if options.model else {}
        return as_json({**answer.to_dict(), **model}, surrogate)
    rows, notes, error = in_words(answer, case.units)
    line = common.case_line(case, kind)
    return "\n".join([line, in_columns(rows), *([in_columns(notes)] if notes else []), error])

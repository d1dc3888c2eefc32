"""Run ``mumacro fit-loop``: fit k and mu0 to a measured loop of force over displacement in a
file."""

import argparse
from collections.abc import Sequence
from functools import partial

from mumacro import plotting
from mumacro.cli import common
from mumacro.cli.common import OneLineParser, UsageError
from mumacro.cli.table_format import add_format, dialect_in, fit_to, read_file, say_how_read
from mumacro.errors import InputError
from mumacro.fits.loop import fit_loop
from mumacro.inputs.case import read_one
from mumacro.inputs.names import ColumnNames
from mumacro.inputs.whole_tables import read_numbers

EXAMPLE = "mumacro fit-loop loop.csv Fz=10N --displacement x --force Ft -o loop.png"
_ABOUT = f"""\
columns in the order of time, in SI or with a unit as in x [um]; others are ignored:
  the displacement, the force that moves it, and for a spring, if it varies, the normal force
of several cycles the first sets the state, and the others count

examples:
  {EXAMPLE}
  mumacro fit-loop loop.csv --displacement x --force Ft --load Fn --cycles 3..8
"""


def _cycles(text: str) -> tuple[int, int]:
    """Return the first and the last cycle; argparse reports a fault in another text."""
    first, _, last = text.partition("..")
    if not (first.isdecimal() and (last or first).isdecimal()):
        raise argparse.ArgumentTypeError(f"{text!r}: must be numbers of cycles, as 3..8")
    return int(first), int(last or first)


def _parser() -> OneLineParser:
    """Return the parser of the command's arguments."""
    description = "k and mu0 of a contact from a measured loop of force over displacement."
    parser = OneLineParser(prog="mumacro fit-loop", description=description, epilog=_ABOUT)
    parser.add_argument("loop", help="a table as text, or .xlsx; - is standard input")
    parser.add_argument("words", nargs="*", metavar="Fz=value", help="the normal force [N]")
    for name, what in (
        ("displacement", "of the displacement"),
        ("force", "of the tangential force"),
    ):
        parser.add_argument(f"--{name}", required=True, metavar="COLUMN", help=what)
    parser.add_argument("--load", metavar="COLUMN", help="of the normal force, in place of Fz=")
    text = "the first and the last cycle; default: all samples"
    parser.add_argument("--cycles", type=_cycles, metavar="A..B", help=text)
    common.add_options(parser, "contact")
    common.add_out(parser, "--plot")
    common.add_options(parser, "json")
    add_format(parser)
    return parser


def run(words: Sequence[str]) -> str:
    """Run ``mumacro fit-loop``."""
    options = _parser().parse_intermixed_args(words)
    names = {"displacement": options.displacement, "force": options.force}
    if options.load is not None:
        names["Fz"] = options.load
    if len({*names.values()}) < len(names):
        raise UsageError(f"{', '.join(names.values())}: each column has one meaning")
    load = _load(options.words, options.load)
    input_of = {name: "y0" if what == "displacement" else "Fz" for what, name in names.items()}
    column_names = ColumnNames(input_of, [(name,) for name in names.values()])
    dialect = dialect_in(options)
    table = read_file(options.loop, lambda source: read_numbers(source, column_names, dialect))
    columns = {what: table.columns[name] for what, name in names.items()} | load
    fit = partial(fit_loop, **columns, contact=options.contact, cycles=options.cycles)
    found = fit_to(options.loop, table, fit, names)
    heads = ("displacement [m]", "force [N]", "Fz [N]", "force fitted [N]")
    in_si = dict(zip(heads, found.loop.values(), strict=True))
    samples = ("samples", str(found.residuals.size), "", f"{found.contact}, {found.cycles} cycles")
    text = common.in_full(found, samples)
    output = common.present(options, found, in_si, text, **plotting.OF_FIT)
    say_how_read("fit-loop", table)
    return output


def _load(words: Sequence[str], column: str | None) -> dict[str, float]:
    """Return the normal force that was typed [N], or nothing if it is a column."""
    text = " ".join(words)
    name, equals, value = text.partition("=")
    if column is not None:
        if text:
            raise UsageError(f"{text}: --load {column} is the normal force")
        return {}
    if name.strip() != "Fz" or not equals:
        raise UsageError(f"{text or 'Fz'}: give the normal force alone, as Fz=10N or --load COLUMN")
    try:
        return {"Fz": read_one("Fz", value.strip())}
    except InputError as error:
        raise UsageError(str(error)) from None

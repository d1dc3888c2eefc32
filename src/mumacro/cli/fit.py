"""Run ``mumacro fit``: fit k and mu0 to measured points in a file."""

from collections.abc import Sequence

from mumacro import plotting
from mumacro.cli import common
from mumacro.cli.common import OneLineParser, UsageError, open_table
from mumacro.cli.table_format import add_format, dialect_in, fit_to, read_file, say_how_read
from mumacro.fits.fit import best_fit
from mumacro.fits.fitted import Fit
from mumacro.fits.measured_points import STD, UNKNOWNS, read_points, unknowns_beside
from mumacro.inputs.fields import AMPLITUDE, kind_of
from mumacro.inputs.units import unit_of

EXAMPLE = 'mumacro fit measured.csv "Fz=10N y0=2um f=20kHz" -o fit.png'
_COLUMNS = f"""\
columns by name, in SI or with a unit as in v0 [mm/s]; others are ignored:
  v0 and mu_macro, or Ft [N] over Fz; what varies of Fz, y0 (or {AMPLITUDE}), omega or f;
  {STD}: of mu_macro, if known; mu0, if it is known at each point: then k alone is fitted
what is neither a column nor unknown is given as name=value

examples:
  {EXAMPLE}
  mumacro fit measured.csv Fz=10N y0=2um f=20kHz mu0=0.3 --unknown k --contact ball
"""


def _parser() -> OneLineParser:
    """Return the parser of the command's arguments."""
    first = "points", {"help": "a table as text, or .xlsx; - is standard input"}
    description = "k and mu0 of a contact from measured friction."
    parser = common.question(
        "fit", description, _COLUMNS, "the other inputs", "*", first, ("--plot",)
    )
    parser.add_argument(
        "--unknown",
        nargs="+",
        metavar="NAME",
        help="k, mu0; default: both, k alone beside a column mu0",
    )
    add_format(parser)
    return parser


def run(words: Sequence[str]) -> str:
    """Run ``mumacro fit``."""
    options = _parser().parse_intermixed_args(words)
    unknown, pairs = (
        [x for x in options.unknown or () if ("=" in x) == has_value] for has_value in (False, True)
    )
    if wrong := [name for name in unknown if name not in UNKNOWNS]:
        raise UsageError(f"--unknown {wrong[0]}: k, mu0 or both can be fitted")
    kind, dialect = kind_of(options.contact, options.direction), dialect_in(options)
    table = read_file(options.points, lambda source: read_points(source, dialect))
    unknown = unknown or unknowns_beside(table.columns)
    in_table = [name for name in table.columns if name in kind.columns]
    case = common.read_case(
        [*options.words, *pairs],
        kind,
        [*unknown, *in_table],
        one_k="one k is needed; or leave it out, and it is fitted",
    )
    surrogate = open_table(options.table)

    def fitted() -> Fit:
        return best_fit(table.columns, unknown, surrogate, **kind.names, **case.inputs)

    result = fit_to(options.points, table, fitted, {})
    columns = {
        name if name in ("mu_macro", STD) else f"{name} [{unit_of(name)}]": column
        for name, column in result.points.items()
    }
    columns |= {"mu_macro fitted": result.points["mu_macro"] - result.residuals}
    text = common.in_full(result)
    output = common.present(options, result, columns, text, surrogate, **plotting.OF_FIT)
    say_how_read("fit", table)
    return output

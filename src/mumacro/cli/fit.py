"""Run ``mumacro fit``: fit k and mu0 to measured points in a file."""

import math
import sys
import warnings
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mumacro import plotting
from mumacro.cli import common
from mumacro.cli.common import (
    ImpossibleError,
    OneLineParser,
    UsageError,
    as_json,
    in_columns,
    open_table,
)
from mumacro.cli.table_format import add_format, dialect_in
from mumacro.errors import InputError, TextError
from mumacro.fits.fit import fit
from mumacro.fits.fitted import Fit
from mumacro.fits.measured_points import STD, UNKNOWNS, read_points, unknowns_beside
from mumacro.inputs.fields import AMPLITUDE
from mumacro.inputs.units import unit_of
from mumacro.surrogate import Surrogate
from mumacro.validity import digits

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
    parser = common.question("fit", description, _COLUMNS, "the other inputs", "*", first)
    parser.add_argument(
        "--unknown",
        nargs="+",
        metavar="NAME",
        help="k, mu0; default: both, k alone beside a column mu0",
    )
    parser.add_argument("--plot", dest="out", type=Path, metavar="FILE", help="the same as --out")
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
    kind = common.kind_in(options)
    source = sys.stdin.buffer.read() if options.points == "-" else Path(options.points)
    try:
        table = read_points(source, dialect_in(options))
    except TextError as error:
        raise ImpossibleError(f"{options.points}: {error}") from None
    points: dict[str, Any] = {**table.columns}
    unknown = unknown or unknowns_beside(points)
    in_table = [name for name in points if name in kind.columns]
    case = common.read_case(
        [*options.words, *pairs],
        kind,
        [*unknown, *in_table],
        one_k="one k is needed; or leave it out, and it is fitted",
    )
    surrogate = open_table(options.table)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # they are in the result
            result = fit(points, unknown, **kind.names, surrogate=surrogate, **case)
    except InputError as error:
        at_line = f"line {table.lines[error.index]}: " if error.index is not None else ""
        fault = InputError(error.field, error.value, error.bound) if at_line else error
        raise ImpossibleError(f"{options.points}: {at_line}{fault}") from None
    except ModuleNotFoundError as error:  # it says what to install
        raise ImpossibleError(str(error)) from None
    output = _output(result, options, surrogate)
    if table.read_as:
        print(f"mumacro fit: read as: {table.read_as}", file=sys.stderr)
    return output


def _output(result: Fit, options: Namespace, surrogate: Surrogate) -> str:
    """Write the file of ``-o``, and return the text to print."""
    if options.out is not None:
        heads = [
            name if name in ("mu_macro", STD) else f"{name} [{unit_of(name)}]"
            for name in result.points
        ]
        columns = dict(zip(heads, result.points.values(), strict=True))
        columns |= {"mu_macro fitted": result.points["mu_macro"] - result.residuals}
        return (
            common.write_result(options.out, columns, result.plot, **plotting.OF_FIT)
            + "\n"
            + _text(result, options.digits)
        )
    if options.json:
        return as_json({**result.to_dict(), "table": common.table_members(surrogate)})
    return _text(result, options.digits)


def _text(result: Fit, digit_count: int | None) -> str:
    """Return the text of the result: values with standard deviations and intervals, the scatter,
    other solutions, warnings."""
    rows: list[Sequence[str]] = []
    for name, value in result.values.items():
        off, (low, high) = result.std[name], result.interval[name]
        form = f".{digit_count or digits(off / value if 0.0 < value < math.inf else 0.0)}g"
        number = "rigid" if math.isinf(value) else f"{value:{form}}"
        rows.append(
            (
                name,
                number,
                f"[{unit_of(name)}]",
                f"+- {off:.2g}",
                f"95 %: {low:{form}} to {high:{form}}",
            )
        )
    if STD in result.points:
        rows.append(("chi2", f"{result.reduced_chi2:.3g}", "[-]", "over the degrees of freedom"))
    else:
        rows.append(
            ("scatter", f"{math.sqrt(result.reduced_chi2):.2g}", "[-]", "of mu_macro about the fit")
        )
    rows.append(("points", str(result.residuals.size), "", f"{result.contact}, {result.direction}"))
    for i, one in enumerate(result.solutions[1:], 2):
        values = ", ".join(f"{name} = {one[name]:.4g} {unit_of(name)}" for name in result.values)
        rows.append((f"solution {i}", values))
    return "\n".join([in_columns(rows), *(note.line for note in result.notes)])

"""Run ``mumacro law``: print mu_macro over a range of one input."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from mumacro.cli import common
from mumacro.cli.common import (
    OneLineParser,
    UsageError,
    in_columns,
    open_table,
    read_case,
)
from mumacro.inputs.case import read_one
from mumacro.inputs.fields import kind_of
from mumacro.inputs.units import (
    Unit,
    choose_unit,
    format_number,
    format_quantity,
    known,
    tidy_zeros,
    unit_of,
)
from mumacro.questions.law import DRAWN
from mumacro.questions.law import law as friction_law

EXAMPLE = 'mumacro law "mu0=0.3 Fz=10N k=1N/um y0=2um f=20kHz" --along v0 0.1mm/s 1m/s'


def _parser() -> OneLineParser:
    """Return the parser of the command's arguments."""
    description = (
        "mu_macro over a range of one input, with the static value and the border of "
        "continuous sliding."
    )
    epilog = f"{common.ABOUT_INPUTS}\nexamples:\n  {EXAMPLE}\n  {EXAMPLE} -o law.png"
    parser = common.question("law", description, epilog, "a case without the swept input", "*")
    text = "the swept input, its first and its last value, in its SI unit or with a unit"
    parser.add_argument(
        "--along", nargs=3, metavar=("NAME", "LOW", "HIGH"), required=True, help=text
    )
    parser.add_argument(
        "--points", type=int, help="number of values; default: 25, in pictures 2000"
    )
    parser.add_argument("--scale", choices=("log", "linear"), default="log", help="default: log")
    common.add_options(parser, "stiffness-exponent")
    return parser


def run(words: Sequence[str]) -> str:
    """Run ``mumacro law``."""
    options = _parser().parse_intermixed_args(words)
    (along, *ends), kind = options.along, kind_of(options.contact, options.direction)
    if along not in kind.columns:
        raise UsageError(f"--along {along}: the swept input is one of {', '.join(kind.columns)}")
    case = read_case(options.words, kind, deviations=True, **common.without_or_load(along))
    start, stop = common.read_values(((along, end) for end in ends), read_one)
    is_picture = options.out is not None and options.out.suffix != ".csv"
    surrogate = open_table(options.table)
    law = friction_law(
        surrogate,
        along,
        start=start,
        stop=stop,
        points=(DRAWN if is_picture else 25) if options.points is None else options.points,
        scale=options.scale,
        stiffness_exponent=options.stiffness_exponent,
        **kind.names,
        **case.inputs,
    )
    columns = law.columns
    middle = float(law.values[law.values.size // 2])
    units = case.units | common.unit_of_ends(along, ends)
    unit = choose_unit(along, middle, units)
    of_k = ", for the geometric middle of k" if law.k_ends else ""
    notes = [
        f"{c.name} at {along} = {format_quantity(c.value, unit, law.digits)}{of_k}"
        for c in law.border
    ]
    notes += common.note_lines(law.notes)
    heads = [f"{name} [{unit_of(name)}]" if name in (along, "k") else name for name in columns]
    column_units = {along: unit}
    if law.stiffening is not None:
        column_units["k"] = choose_unit("k", float(law.inputs["k"].max()), units)
    lines = notes
    if options.out is None:
        table = _table(columns, column_units, law.digits)
        lines = [common.case_line(case, kind), table, *notes]
    in_si = dict(zip(heads, columns.values(), strict=True))
    return common.present(options, law, in_si, "\n".join(lines), surrogate)


def _table(columns: Mapping[str, Any], units: Mapping[str, Unit], count: int) -> str:
    """Return the columns of a law as text; a column with a unit is in this unit, and ``source`` is
    left out."""
    cells = {
        f"{name} [{units[name].symbol}]" if name in units else name: [
            _cell(x, name, units.get(name), count, error)
            for x, error in zip(column, columns["error_bound"], strict=True)
        ]
        for name, column in columns.items()
        if name != "source"
    }
    return in_columns([[*cells], *zip(*cells.values(), strict=True)])


def _cell(value: Any, name: str, unit: Unit | None, count: int, error: float) -> str:
    """Return a cell: a text, or a number with its significant digits."""
    if isinstance(value, str):
        return value
    if math.isnan(value):
        return "-"
    if unit is not None:
        return tidy_zeros(format_number(value, unit, 6))
    if name == "error_bound":
        return f"{value:.2g}"
    return tidy_zeros(known(value, count, error))

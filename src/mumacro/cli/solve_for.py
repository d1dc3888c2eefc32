"""Run ``mumacro solve-for``: print the values of one input that give a wanted mu_macro."""

import argparse
import difflib
from collections.abc import Sequence
from typing import Any

from mumacro.cli import common, motion, solve_motion
from mumacro.cli.common import (
    ImpossibleError,
    OneLineParser,
    UsageError,
    in_columns,
    number_of,
    open_table,
    read_case,
)
from mumacro.inputs.case import read_one
from mumacro.inputs.fields import AMPLITUDE, ENDS, NAMES, kind_of
from mumacro.inputs.names import suggestion
from mumacro.inputs.units import Unit, choose_unit, format_number, tidy_zeros
from mumacro.motions.solve_motion import UNKNOWNS
from mumacro.questions.solve_for import TableRoot, TableSolution, solve_for

EXAMPLE = 'mumacro solve-for y0 "mu0=0.3 Fz=10N k=1N/um f=20kHz v0=10mm/s" --target 0.15'
_TARGET = ": give mu_macro, such as 0.15 or 15%, or with --ratio mu_macro/mu0"
_HEADS = ("between", "and", "mu_macro [-]", "regime")  # behind the unknown
#: possible unknowns, of a case or of a motion
UNKNOWN = (*dict.fromkeys((*NAMES, AMPLITUDE, *UNKNOWNS)),)


def _unknown(text: str) -> str:
    """Return the name of an unknown; for another text argparse says what it may mean."""
    if text in UNKNOWN:
        return text
    similar = suggestion(text, loosely=False)
    if similar is None:
        names = {name.lower(): name for name in UNKNOWN}
        near = difflib.get_close_matches(text.lower(), names, n=1)
        similar = names[near[0]] if near else suggestion(text)
    advice = f"did you mean {similar}?" if similar else f"there are {', '.join(UNKNOWN)}"
    raise argparse.ArgumentTypeError(f"{text!r} is no input: {advice}")


def _parser() -> OneLineParser:
    """Return the parser of the command's arguments."""
    description = "Every value of one input at which mu_macro is the target."
    epilog = (
        f"{common.ABOUT_INPUTS}\nexample, the amplitude [m] that halves the friction:\n"
        f"  {EXAMPLE}\nthe speed at which a conveyor carries its load:\n"
        f"  {solve_motion.EXAMPLE} --target 0"
    )
    first = (
        "unknown",
        {
            "type": _unknown,
            "metavar": "unknown",
            "help": "the unknown input; of a motion also x.amplitude, x.phase, ...",
        },
    )
    parser = common.question("solve-for", description, epilog, "the other five inputs", first=first)
    parser.add_argument(
        "--target",
        type=number_of("target", _TARGET),
        required=True,
        help="wanted mu_macro [-]; with --ratio over mu0",
    )
    parser.add_argument("--ratio", action="store_true", help="the target is mu_macro / mu0")
    text = "range to search, in the SI unit of the unknown or with a unit"
    parser.add_argument("--between", nargs=2, metavar=("LOW", "HIGH"), help=text)
    common.add_options(parser, "stiffness-exponent")
    motion.add_parts(parser)
    return parser


def run(words: Sequence[str]) -> str:
    """Run ``mumacro solve-for``."""
    options = _parser().parse_intermixed_args(words)
    if solve_motion.is_motion(options):
        return solve_motion.run(options)
    unknown, kind = options.unknown, kind_of(options.contact, options.direction)
    if unknown not in kind.columns:
        raise UsageError(
            f"{unknown} does not belong to --direction {options.direction}: "
            f"{', '.join(kind.columns)} do"
        )
    case = read_case(options.words, kind, **common.without_or_load(unknown))
    target = common.target_in(options, case.inputs)
    between = options.between or ()
    ends = common.read_values([(unknown, text) for text in between], read_one)
    surrogate = open_table(options.table)
    solution = solve_for(
        surrogate,
        unknown,
        target,
        within=(ends[0], ends[1]) if ends else None,
        stiffness_exponent=options.stiffness_exponent,
        **kind.names,
        **case.inputs,
    )
    # for an interval of k with the solutions of its ends, by k [N/m], ascending
    solutions: dict[Any, TableSolution] = {solution.curve.case.get("k"): solution}
    if solution.ends:
        low, high = (case.inputs[name] for name in ENDS)
        solutions = {low: solution.ends[0], **solutions, high: solution.ends[1]}
    rows = [(k, root) for k, one in solutions.items() for root in one.roots[0]]
    if not rows:
        raise ImpossibleError(solution.reason() + common.other_meaning(options, case, solution))
    units = case.units | common.unit_of_ends(unknown, between)
    unit = choose_unit(unknown, rows[0][1].value, units)
    k_unit = choose_unit("k", rows[-1][0], units) if solution.ends else None
    without = [
        f"no {unknown} gives that for k = {k:.6g} N/m"
        for k, one in solutions.items()
        if not one.roots[0]
    ]
    ranges = [solution.reason()] if solution.roots[0] and solution.reason() else []
    table = _table(unknown, rows, unit, k_unit, solution.digits)
    notes = common.note_lines(solution.notes)
    text = "\n".join([common.case_line(case, kind), table, *ranges, *without, *notes])
    heads = (f"{unknown} [{solution.unit}]", *_HEADS)
    columns: dict[str, Sequence[Any]] = dict(
        zip(heads, zip(*(root for _, root in rows), strict=True), strict=True)
    )
    if solution.ends:
        columns = {"k [N/m]": [k for k, _ in rows], **columns}
    text = text if options.out is None else ""
    return common.present(options, solution, columns, text, surrogate)


def _table(
    unknown: str,
    rows: Sequence[tuple[Any, TableRoot]],
    unit: Unit,
    k_unit: Unit | None,
    count: int,
) -> str:
    """Return the roots as text, with their k if it is an interval."""
    table = [[*([f"k [{k_unit.symbol}]"] if k_unit else []), f"{unknown} [{unit.symbol}]", *_HEADS]]
    for k, root in rows:
        of_k = [tidy_zeros(format_number(k, k_unit, 6))] if k_unit else []
        values = [format_number(x, unit, count) for x in (root.value, root.low, root.high)]
        table.append([*of_k, *values, f"{root.mu_macro:.{count}g}", root.regime])
    return in_columns(table)

"""Run ``mumacro solve-for ... --x --y --normal``: print the values of one input of a motion that
give a wanted mean friction."""

import argparse
from collections.abc import Sequence

from mumacro.cli import common
from mumacro.cli.common import ImpossibleError, UsageError, in_columns
from mumacro.cli.motion import read_motion
from mumacro.inputs.case import read
from mumacro.inputs.units import (
    Unit,
    format_number,
    known,
    parse_unit,
    quantity_of,
    suit_unit,
    tidy_zeros,
)
from mumacro.motions.motion import PARTS
from mumacro.motions.solve_motion import MotionSolution, solve_motion

EXAMPLE = 'mumacro solve-for v0 "mu0=0.3 Fz=10N k=0.1N/um f=50Hz" --x 0.1mm --normal 8N@-90deg'


def is_motion(options: argparse.Namespace) -> bool:
    """Return whether the options describe a motion, or the unknown is a member of one."""
    return "." in options.unknown or any(getattr(options, name) is not None for name in PARTS)


def run(options: argparse.Namespace) -> str:
    """Return the roots over a motion, as text, JSON, a picture or CSV."""
    if options.direction != "across":
        raise UsageError("--direction is left out beside --x, --y and --normal, which say it")
    unknown, within = options.unknown, options.between
    optional = [] if "." in unknown else [unknown, *(["omega"] if unknown == "f" else [])]
    case, parts, line = read_motion(options, optional)
    solution = solve_motion(
        unknown,
        common.target_in(options, case.inputs),
        within=within,
        contact=options.contact,
        **case.inputs,
        **parts,
    )
    (roots,) = solution.roots
    if not roots:
        raise ImpossibleError(solution.reason() + common.other_meaning(options, case, solution))
    unit = _unit_of_roots(solution, within or ())
    names = ("between", "and", "mu_macro [-]")
    table = [[f"{unknown} [{unit.symbol}]", *names]]
    for root in roots:
        width = root.high - root.low
        cells = [format_number(root.value, unit, 6, width)]
        cells += [format_number(x, unit, 6) for x in (root.low, root.high)]
        table.append([*cells, tidy_zeros(known(root.mean, 6, root.error_estimate))])
    text = "\n".join([line, in_columns(table), *filter(None, [solution.reason()])])
    heads = (f"{unknown} [{solution.unit}]", *names)
    columns = dict(zip(heads, zip(*(root[:4] for root in roots), strict=True), strict=True))
    return common.present(options, solution, columns, text if options.out is None else "")


def _unit_of_roots(solution: MotionSolution, typed: Sequence[str]) -> Unit:
    """Return the unit in which the roots are printed."""
    quantity = quantity_of(solution.unknown)
    for text in typed:
        symbol = read(solution.unknown, text, quantity).unit
        if symbol is not None and (unit := parse_unit(quantity, symbol)) is not None:
            return unit
    return suit_unit(solution.unit, solution.roots[0][0].value)

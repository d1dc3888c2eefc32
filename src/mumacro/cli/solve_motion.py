"""Run ``mumacro solve-for ... --x --y --normal``: print the values of one input of a motion that
give a wanted mean friction."""

import argparse
from collections.abc import Mapping, Sequence
from typing import Any

from mumacro.cli import common
from mumacro.cli.common import ImpossibleError, UsageError, as_json, in_columns
from mumacro.cli.motion import read_motion
from mumacro.inputs.case import read
from mumacro.inputs.fields import quantity_of
from mumacro.inputs.units import Unit, format_number, known, parse_unit, suit_unit, tidy_zeros
from mumacro.motions.motion import PARTS
from mumacro.motions.solve_motion import MotionSolution, solve_motion

EXAMPLE = 'mumacro solve-for v0 "mu0=0.3 Fz=10N k=0.1N/um f=50Hz" --x 0.1mm --normal 8N@-90deg'


def is_motion(options: argparse.Namespace) -> bool:
    """Return whether the options describe a motion, or the unknown is a member of one."""
    return "." in options.unknown or any(getattr(options, name) is not None for name in PARTS)


def run(options: argparse.Namespace, within: list[str] | None) -> str:
    """Return the roots over a motion, as text, JSON, a picture or CSV."""
    if options.direction != "across":
        raise UsageError("--direction is left out beside --x, --y and --normal, which say it")
    optional = [] if "." in options.unknown else [options.unknown]
    if options.unknown == "f":
        optional.append("omega")
    case, parts, line = read_motion(options, optional)
    target = options.target
    if options.ratio:
        if "mu0" not in case:
            raise UsageError("--ratio cannot be used with mu0 as the unknown: give --target alone")
        target *= case["mu0"]
    solution = solve_motion(
        options.unknown,
        target,
        within=None if within is None else (within[0], within[1]),
        contact=options.contact,
        **case,
        **parts,
    )
    (roots,) = solution.roots
    if not roots:
        raise ImpossibleError(solution.reason() + _hint(options, case, solution))
    if options.json:
        return as_json(solution.to_dict())
    if options.out is not None:
        heads = [f"{solution.unknown} [{solution.unit}]", "between", "and", "mu_macro [-]"]
        columns = dict(zip(heads, zip(*(root[:4] for root in roots), strict=True), strict=True))
        return common.write_result(options.out, columns, solution.plot)
    unit = _unit_of_roots(solution, within or (), options.digits)
    table = [[f"{solution.unknown} [{unit.symbol}]", "between", "and", "mu_macro [-]"]]
    for root in roots:
        width = root.high - root.low
        cells = [format_number(root.value, unit, 6, options.digits, width)]
        cells += [format_number(x, unit, 6, options.digits) for x in (root.low, root.high)]
        mean = (
            f"{root.mean:.{options.digits}g}"
            if options.digits
            else tidy_zeros(known(root.mean, 6, root.error_estimate))
        )
        table.append([*cells, mean])
    said = filter(None, [solution.reason()])
    return "\n".join([line, in_columns(table), *said])


def _unit_of_roots(solution: MotionSolution, typed: Sequence[str], digits: int | None) -> Unit:
    """Return the unit in which the roots are printed."""
    si, (first, *_) = solution.unit, solution.roots[0]
    if digits is not None:
        return Unit(si)
    quantity = quantity_of(solution.unknown)
    for text in typed:
        symbol = read(solution.unknown, text, quantity).unit
        if symbol is not None and (unit := parse_unit(quantity, symbol)) is not None:
            return unit
    return suit_unit(si, first.value)


def _hint(options: argparse.Namespace, case: Mapping[str, Any], solution: MotionSolution) -> str:
    """Return what was perhaps meant if a target is out of reach."""
    return common.other_meaning(options.target, options.ratio, case, solution.reach.holds)

"""``mumacro solve-for ... --x --y --normal``: the values of one input of a motion that give a mean
friction."""

import argparse

from mumacro.analysis.motion import PARTS
from mumacro.analysis.solve_motion import solve_motion
from mumacro.cli import common
from mumacro.cli.common import ImpossibleError, UsageError, as_json, in_columns, read_case
from mumacro.inputs.oscillation import read_oscillation

EXAMPLE = 'mumacro solve-for v0 "mu0=0.3 Fz=10N k=0.1N/um f=50Hz" --x 0.1mm --normal 8N@-90deg'


def is_motion(options: argparse.Namespace) -> bool:
    """Whether a motion is given, or one of its members is the unknown."""
    return "." in options.unknown or any(getattr(options, name) is not None for name in PARTS)


def run(options: argparse.Namespace, within: list[str] | None) -> str:
    """The roots over a motion, as text, JSON, a picture or CSV."""
    if options.direction != "across":
        raise UsageError("--direction is left out beside --x, --y and --normal, which say it")
    texts = [(name, text) for name in PARTS if (text := getattr(options, name)) is not None]
    parts = common.read_values(texts, read_oscillation)
    motion = dict(zip((name for name, _ in texts), parts, strict=True))
    optional = ["y0", *([] if "." in options.unknown else [options.unknown])]
    if options.unknown == "f":
        optional.append("omega")
    case = read_case(
        options.words, one_k="one motion has one k; ask for both ends", optional=optional
    )
    if "y0" in case:
        raise UsageError("y0 is an option here: --y for across, --x for along the drag")
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
        **motion,
    )
    (roots,) = solution.roots
    if not roots:
        raise ImpossibleError(solution.reason())
    names = ("value", "low", "high", "mean", "error_estimate")
    if options.json:
        rows = [dict(zip(names, root, strict=True)) for root in roots]
        return as_json(
            {
                "unknown": solution.unknown,
                "unit": solution.unit,
                "target": target,
                "roots": rows,
            }
        )
    heads = [f"{solution.unknown} [{solution.unit}]", "between", "and", "mu_macro [-]"]
    if options.out is not None:
        columns = dict(zip(heads, zip(*(root[:4] for root in roots), strict=True), strict=True))
        return common.write_result(options.out, columns, solution.plot)
    return in_columns([heads, *(_row(root, options.digits) for root in roots)])


def _row(root: tuple[float, ...], digits: int | None) -> list[str]:
    """A root with the digits that its width leaves; a mean within its estimate of 0 is 0."""
    value, low, high, mean, error = root
    figures = digits or 6
    shown = mean if abs(mean) > error else 0.0
    return [*(f"{x:.{figures}g}" for x in (value, low, high)), f"{shown:.{figures}g}"]

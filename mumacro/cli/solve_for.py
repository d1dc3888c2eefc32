"""``mumacro solve-for``: the values of one input that give a mu_macro."""

import argparse
import difflib
from collections.abc import Mapping, Sequence
from typing import Any

from mumacro.analysis.law import law as friction_law
from mumacro.analysis.solve_for import Solution, solve_for
from mumacro.analysis.solve_motion import UNKNOWNS
from mumacro.cli import common, motion, solve_motion
from mumacro.cli.common import (
    CURVE,
    ImpossibleError,
    Unit,
    UsageError,
    as_json,
    in_columns,
    number_of,
    open_table,
    read_case,
)
from mumacro.inputs.fields import NAMES, unit_of
from mumacro.inputs.kind import AMPLITUDE
from mumacro.inputs.names import suggestion
from mumacro.inputs.reading import read_one
from mumacro.shown import tidy_zeros
from mumacro.validity import load_rows

EXAMPLE = 'mumacro solve-for y0 "mu0=0.3 Fz=10N k=1N/um f=20kHz v0=10mm/s" --target 0.15'
_TARGET = ": give mu_macro, such as 0.15 or 15%, or with --ratio mu_macro/mu0"


#: what may be unknown, of a case or of a motion
UNKNOWN = (*dict.fromkeys((*NAMES, AMPLITUDE, *UNKNOWNS)),)


def _unknown(text: str) -> str:
    """The name of an unknown; argparse says what another text may mean."""
    if text in UNKNOWN:
        return text
    similar = suggestion(text, loosely=False)
    if similar is None:
        names = {name.lower(): name for name in UNKNOWN}
        near = difflib.get_close_matches(text.lower(), names, n=1)
        similar = names[near[0]] if near else suggestion(text)
    advice = f"did you mean {similar}?" if similar else f"there are {', '.join(UNKNOWN)}"
    raise argparse.ArgumentTypeError(f"{text!r} is no input: {advice}")


def run(words: Sequence[str]) -> str:
    """``mumacro solve-for``."""
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
    common.add_exponent(parser)
    motion.add_parts(parser)
    options = parser.parse_intermixed_args(words)
    if solve_motion.is_motion(options):
        return solve_motion.run(options, options.between)
    unknown, unit = options.unknown, unit_of(options.unknown)
    kind = common.kind_in(options)
    if unknown not in kind.columns:
        raise UsageError(
            f"{unknown} does not belong to --direction {options.direction}: "
            f"{', '.join(kind.columns)} do"
        )
    case = read_case(options.words, kind, **common.without_or_load(unknown))
    if options.ratio and unknown == "mu0":
        raise UsageError("--ratio cannot be used with mu0 as the unknown: give --target alone")
    target = options.target * case["mu0"] if options.ratio else options.target
    between = [(unknown, text) for text in options.between or ()]
    ends = common.read_values(between, read_one)
    surrogate = open_table(options.table)
    solution = solve_for(
        surrogate,
        unknown,
        target,
        within=(ends[0], ends[1]) if ends else None,
        stiffness_exponent=options.stiffness_exponent,
        **kind.names,
        **case,
    )
    model = load_rows(unknown, common.middle_of(case), options.contact, solution.stiffening)
    two = solution.ends
    if not solution.roots[0] and not (two and any(end.roots[0] for end in two)):
        raise ImpossibleError(solution.reason() + _hint(options, case, solution))
    places = {common.middle_of(case).get("k"): solution}
    if two:
        places = dict(sorted({**places, **dict(zip(case["k_range"], two, strict=True))}.items()))
    roots = [
        (
            *((k,) if two else ()),
            r.value,
            r.low,
            r.high,
            r.mu_macro,
            r.regime,
        )
        for k, one in places.items()
        for r in one.roots[0]
    ]
    names = (*(("k",) if two else ()), unknown, "low", "high", "mu_macro", "regime")
    if options.json:
        rows = [dict(zip(names, root, strict=True)) for root in roots]
        return as_json(
            {
                "unknown": unknown,
                "unit": unit,
                "target": target,
                "roots": rows,
                **({"model": model} if model else {}),
                "table": common.about(surrogate),
            }
        )
    if options.out is not None:
        heads = [
            *(["k [N/m]"] if two else []),
            f"{unknown} [{unit}]",
            "between",
            "and",
            "mu_macro [-]",
            "regime",
        ]
        at = [root.value for one in places.values() for root in one.roots[0]]
        # a decade around the roots; what is at 0 is shown up to 1
        low, high = ends or (0.1 * min(at) or 1e-6 * (max(at) or 1.0), 10.0 * max(at) or 1.0)
        curve = friction_law(
            surrogate,
            unknown,
            start=low,
            stop=high,
            points=CURVE,
            scale="log" if low > 0.0 else "linear",
            refine=True,
            stiffness_exponent=options.stiffness_exponent,
            **kind.names,
            **case,
        )
        columns = dict(zip(heads, zip(*roots, strict=True), strict=True))
        return common.write_result(
            options.out,
            columns,
            lambda axes: curve.plot(axes, roots=at, target=target),
        )
    at_one = next(one.roots[0][0].value for one in places.values() if one.roots[0])
    count = common.count_for(options, surrogate, {**case, unknown: at_one}, kind)
    units = common.units_in(options.words, **{unknown: options.between or ()})
    of_root = Unit.of(unknown, at_one, units, options.digits)
    of_k = Unit.of("k", roots[-1][0], units, options.digits) if two else None
    table = [
        [
            *([of_k.head("k")] if of_k else []),
            of_root.head(unknown),
            "between",
            "and",
            "mu_macro [-]",
            "regime",
        ]
    ]
    for *k, value, low, high, mu, regime in roots:
        cells = [tidy_zeros(of_k.shown(k[0], 6, options.digits))] if of_k else []
        cells += [of_root.shown(x, count, options.digits) for x in (value, low, high)]
        table.append([*cells, f"{mu:.{count}g}", regime])
    none = [
        f"no {unknown} gives that for k = {k:.6g} N/m"
        for k, one in places.items()
        if not one.roots[0]
    ]
    line = common.case_line(case, units, kind)
    return "\n".join([line, in_columns(table), *none, *common.model_lines(model)])


def _hint(options: argparse.Namespace, case: Mapping[str, Any], solution: Solution) -> str:
    """What was perhaps meant where a target is out of reach."""
    if solution.constant:
        return ""
    return common.other_meaning(options.target, options.ratio, case, solution.reach.holds)

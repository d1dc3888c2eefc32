"""``mumacro solve-for``: the values of one input that give a mu_macro."""

from collections.abc import Sequence

from mumacro.analysis.law import law as friction_law
from mumacro.analysis.solve_for import solve_for
from mumacro.analysis.solve_motion import UNKNOWNS
from mumacro.cli import common, motion, solve_motion
from mumacro.cli.common import (
    CURVE,
    ImpossibleError,
    UsageError,
    as_json,
    in_columns,
    number_of,
    open_table,
    read_case,
)
from mumacro.inputs.fields import NAMES, unit_of
from mumacro.inputs.kind import AMPLITUDE
from mumacro.inputs.reading import read_one
from mumacro.validity import load_rows

EXAMPLE = 'mumacro solve-for y0 "mu0=0.3 Fz=10N k=1N/um f=20kHz v0=10mm/s" --target 0.15'
_TARGET = ": give mu_macro, such as 0.15 or 15%, or with --ratio mu_macro/mu0"


def run(words: Sequence[str]) -> str:
    """``mumacro solve-for``."""
    description = "Every value of one input at which mu_macro is the target."
    epilog = (
        f"{common.ABOUT_INPUTS}\nexample, the amplitude [m] that halves the friction:\n"
        f"  {EXAMPLE}\nthe speed at which a conveyor carries its load:\n"
        f"  {solve_motion.EXAMPLE} --target 0"
    )
    unknowns = dict.fromkeys((*NAMES, AMPLITUDE, *UNKNOWNS))
    first = (
        "unknown",
        {
            "choices": [*unknowns],
            "metavar": "unknown",
            "help": "the unknown input; of a motion also x.amplitude, x.phase, ...",
        },
    )
    parser = common.question("solve-for", description, epilog, "the other five inputs", first=first)
    parser.add_argument(
        "--target", type=number_of("target", _TARGET), required=True, help="wanted mu_macro [-]"
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
    reach, two = solution.reach, solution.ends
    if not solution.roots[0] and not (two and any(end.roots[0] for end in two)):
        where = f"{unknown} from {reach.low:.6g} to {reach.high:.6g} {unit}"
        if not ends:  # all that a double holds
            where = f"any {unknown}"
        if solution.constant:
            raise ImpossibleError(
                f"{unknown} has no influence here: mu_macro is {reach.mu_min:.6g} for {where}"
            )
        raise ImpossibleError(
            f"mu_macro = {target:.6g} is out of reach: {where} gives {reach.mu_min:.4g} to "
            f"{reach.mu_max:.4g}"
        )
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
    heads = [
        *(["k [N/m]"] if two else []),
        f"{unknown} [{unit}]",
        "between",
        "and",
        "mu_macro [-]",
        "regime",
    ]
    if options.out is not None:
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
    form = common.format_for(options, surrogate, {**case, unknown: at_one}, kind)
    text = in_columns(
        [heads, *([*(f"{x:{form}}" for x in numbers), regime] for *numbers, regime in roots)]
    )
    none = [
        f"no {unknown} gives that for k = {k:.6g} N/m"
        for k, one in places.items()
        if not one.roots[0]
    ]
    return "\n".join([text, *none, *common.model_lines(model)])

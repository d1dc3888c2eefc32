"""``mumacro law``: mu_macro over a range of one input."""

import math
from collections.abc import Sequence

from mumacro.analysis.approximations import approximations
from mumacro.analysis.law import law as friction_law
from mumacro.cli import common
from mumacro.cli.common import CURVE, UsageError, as_json, in_columns, open_table, read_case
from mumacro.inputs.fields import unit_of
from mumacro.inputs.reading import read_one
from mumacro.validity import load_rows

EXAMPLE = 'mumacro law "mu0=0.3 Fz=10N k=1N/um y0=2um f=20kHz" --along v0 0.1mm/s 1m/s'


def run(words: Sequence[str]) -> str:
    """``mumacro law``."""
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
    parser.add_argument("--points", type=int, help="number of values; default: 25, in pictures 400")
    parser.add_argument("--scale", choices=("log", "linear"), default="log", help="default: log")
    parser.add_argument(
        "--approximations", action="store_true", help="also the approximations of the article"
    )
    common.add_exponent(parser)
    options = parser.parse_intermixed_args(words)
    (along, *ends), kind = options.along, common.kind_in(options)
    if along not in kind.columns:
        raise UsageError(f"--along {along}: the swept input is one of {', '.join(kind.columns)}")
    unit = unit_of(along)
    case = read_case(options.words, kind, **common.without_or_load(along))
    start, stop = common.read_values(((along, end) for end in ends), read_one)
    is_picture = options.out is not None and options.out.suffix != ".csv"
    surrogate = open_table(options.table)
    law = friction_law(
        surrogate,
        along,
        start=start,
        stop=stop,
        points=(CURVE if is_picture else 25) if options.points is None else options.points,
        scale=options.scale,
        refine=is_picture,
        stiffness_exponent=options.stiffness_exponent,
        **kind.names,
        **case,
    )
    model = load_rows(along, law.case, options.contact, law.stiffening)
    columns = law.columns | (approximations(surrogate, law) if options.approximations else {})
    by_unit = {along: unit, "k": unit_of("k")}
    border = [{along: c.value, "mu_macro": c.mu_macro} for c in law.border]
    if options.json:
        return as_json(
            {
                "along": along,
                "unit": unit,
                **columns,
                "border": border,
                **({"model": model} if model else {}),
                "table": common.about(surrogate),
            }
        )
    headed = {
        f"{name} [{by_unit[name]}]" if name in by_unit else name: column
        for name, column in columns.items()
    }
    middle = float(law.values[law.values.size // 2])
    form = common.format_for(options, surrogate, {**case, along: middle}, kind)
    of_k = ", for the geometric middle of k" if law.band else ""
    marks = [f"{c.name} at {along} = {c.value:{form}} {unit}{of_k}" for c in law.border]
    marks += common.model_lines(model)
    if options.out is not None:
        return "\n".join(
            [
                common.write_result(options.out, headed, law.plot),
                *marks,
            ]
        )
    del headed["source"]
    shown = [
        [cell if isinstance(cell, str) else _shown(cell, form) for cell in x]
        for x in headed.values()
    ]
    return "\n".join([in_columns([[*headed], *zip(*shown, strict=True)]), *marks])


def _shown(value: float, form: str) -> str:
    return "-" if math.isnan(value) else f"{value:{form}}"

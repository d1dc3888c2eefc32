"""The commands that answer more than one case: ``mumacro law``, ``solve-for``, ``map`` and
``stiffness``."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from mumacro import plotting
from mumacro.analysis.law import approximations, friction_law, sweep_values
from mumacro.analysis.solve_for import solve_for
from mumacro.analysis.validity import Row, load_rows
from mumacro.cli import common
from mumacro.cli.common import (
    ImpossibleError,
    OneLineParser,
    UsageError,
    as_json,
    in_columns,
    open_table,
    read_case,
)
from mumacro.contacts.geometries import ARGUMENTS, BODIES, GEOMETRIES, contact_of, read_argument
from mumacro.inputs.fields import NAMES, field_of, unit_of
from mumacro.inputs.kind import AMPLITUDE

LAW = "mumacro law 'mu0=0.3 Fz=10N k=1N/um y0=2um f=20.69kHz' --along v0 0.1mm/s 1m/s"
SOLVE_FOR = "mumacro solve-for y0 'mu0=0.3 Fz=10N k=1N/um f=20.69kHz v0=1cm/s' --target 0.15"
STIFFNESS = "mumacro stiffness ball --radius 5mm --Fz 10N --E 210GPa --nu 0.3"
CURVE = 400  # points of a curve in a picture
_UNITS = {"k": "N/m", "k_normal": "N/m", "half_width": "m", "pressure": "Pa"}


def law(words: Sequence[str]) -> str:
    """``mumacro law``."""
    told = (
        "mu_macro over a range of one input, with the static value and the border of "
        "continuous sliding."
    )
    epilog = f"{common.INPUTS}\nexamples:\n  {LAW}\n  {LAW} -o law.png"
    parser = common.question("law", told, epilog, "a case without the swept input", "*")
    text = "the swept input, its first and its last value, in its SI unit or with a unit"
    parser.add_argument(
        "--along", nargs=3, metavar=("NAME", "LOW", "HIGH"), required=True, help=text
    )
    parser.add_argument("--points", type=int, help="number of values; default: 25, in pictures 400")
    parser.add_argument("--scale", choices=("log", "linear"), default="log", help="default: log")
    parser.add_argument(
        "--approximations", action="store_true", help="also the approximations of the article"
    )
    add_exponent(parser)
    chosen = parser.parse_intermixed_args(words)
    (along, *ends), kind = chosen.along, common.kind_in(chosen)
    if along not in kind.columns:
        raise UsageError(f"--along {along}: the swept input is one of {', '.join(kind.columns)}")
    (inner, scale), unit = field_of(along), unit_of(along)
    case = read_case(chosen.words, kind, **without_or_load(along))
    start, stop = (scale * end for end in common.read_values((along, end) for end in ends))
    drawn = chosen.out is not None and chosen.out.suffix != ".csv"
    values = sweep_values(
        inner, start, stop, chosen.points or (CURVE if drawn else 25), chosen.scale
    )
    surrogate = open_table(chosen.table)
    options: dict[str, Any] = {
        **kind.names,
        "refine": drawn,
        "stiffness_exponent": chosen.stiffness_exponent,
    }
    found = friction_law(surrogate, inner, values, case, **options)
    model = load_rows(inner, found.case, chosen.contact, found.stiffening)
    columns = found.columns | (approximations(surrogate, found) if chosen.approximations else {})
    columns = {along: columns.pop(inner) / scale, **columns}
    by_unit = {along: unit, "k": unit_of("k")}
    border = [{along: c.value / scale, "mu_macro": c.mu_macro} for c in found.border]
    if chosen.json:
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
    form = common.format_for(chosen, surrogate, {**case, inner: values[values.size // 2]}, kind)
    of_k = ", for the geometric middle of k" if found.band else ""
    marks = [
        f"{plotting.mark_of(c)[1]} at {along} = {c.value / scale:{form}} {unit}{of_k}"
        for c in found.border
    ]
    marks += model_lines(model)
    if chosen.out is not None:
        return "\n".join(
            [
                common.write_result(
                    chosen.out, headed, lambda axes: plotting.plot_law(found, axes)
                ),
                *marks,
            ]
        )
    del headed["source"]
    shown = [
        [cell if isinstance(cell, str) else _shown(cell, form) for cell in x]
        for x in headed.values()
    ]
    return "\n".join([in_columns([[*headed], *zip(*shown, strict=True)]), *marks])


def add_exponent(parser: OneLineParser) -> None:
    """The option for a stiffness that grows with the load."""
    text = (
        "where Fz is swept or the unknown: k grows as Fz^M, 0 to 1, and Fz= in the case is the "
        "load at which k holds; default with Fz=: 1/3 for a ball"
    )
    parser.add_argument("--stiffness-exponent", type=float, metavar="M", help=text)


def without_or_load(unknown: str) -> dict[str, Any]:
    """Keywords of ``read_case``: the unknown must not be there; Fz may be, as the load at which k
    holds."""
    return {"optional": ["Fz"]} if unknown == "Fz" else {"without": [unknown]}


def model_lines(rows: Sequence[Row]) -> list[str]:
    """What is said about the model, below a result."""
    return [in_columns([("model", f"{row['row']}: {row['text']}")]) for row in rows]


def _shown(value: float, form: str) -> str:
    return "-" if math.isnan(value) else f"{value:{form}}"


def solve(words: Sequence[str]) -> str:
    """``mumacro solve-for``."""
    told = "Every value of one input at which mu_macro has a wanted value."
    epilog = f"{common.INPUTS}\nexample, the amplitude [m] that halves the friction:\n  {SOLVE_FOR}"
    first = "unknown", {"choices": (*NAMES, AMPLITUDE), "help": "the unknown input"}
    parser = common.question("solve-for", told, epilog, "the other five inputs", first=first)
    parser.add_argument("--target", type=float, required=True, help="wanted mu_macro [-]")
    parser.add_argument("--ratio", action="store_true", help="the target is mu_macro / mu0")
    text = "range to search, in the SI unit of the unknown or with a unit"
    parser.add_argument("--between", nargs=2, metavar=("LOW", "HIGH"), help=text)
    add_exponent(parser)
    chosen = parser.parse_intermixed_args(words)
    unknown, (inner, scale), unit = (
        chosen.unknown,
        field_of(chosen.unknown),
        unit_of(chosen.unknown),
    )
    kind = common.kind_in(chosen)
    if unknown not in kind.columns:
        raise UsageError(
            f"{unknown} does not belong to --direction {chosen.direction}: "
            f"{', '.join(kind.columns)} do"
        )
    case = read_case(chosen.words, kind, **without_or_load(unknown))
    if chosen.ratio and unknown == "mu0":
        raise UsageError("--ratio cannot be used with mu0 as the unknown: give --target alone")
    target = chosen.target * case["mu0"] if chosen.ratio else chosen.target
    ends = [
        scale * end for end in common.read_values((unknown, text) for text in chosen.between or ())
    ]
    surrogate = open_table(chosen.table)
    found = solve_for(
        surrogate,
        inner,
        target,
        case,
        (ends[0], ends[1]) if ends else None,
        **kind.names,
        stiffness_exponent=chosen.stiffness_exponent,
    )
    model = load_rows(inner, common.middle_of(case), chosen.contact, found.stiffening)
    reach, two = found.reach, found.ends
    if not found.roots[0] and not (two and any(end.roots[0] for end in two)):
        where = f"{unknown} from {reach.low / scale:.6g} to {reach.high / scale:.6g} {unit}"
        if found.constant:
            raise ImpossibleError(
                f"{unknown} has no influence here: mu_macro is {reach.mu_min:.12g} for {where}"
            )
        raise ImpossibleError(
            f"mu_macro = {target:.12g} is out of reach: {where} gives {reach.mu_min:.12g} to "
            f"{reach.mu_max:.12g}"
        )
    places = {common.middle_of(case).get("k"): found}
    if two:
        places = dict(sorted({**places, **dict(zip(case["k_range"], two, strict=True))}.items()))
    roots = [
        (
            *((k,) if two else ()),
            r.value / scale,
            r.low / scale,
            r.high / scale,
            r.mu_macro,
            r.regime,
        )
        for k, one in places.items()
        for r in one.roots[0]
    ]
    names = (*(("k",) if two else ()), unknown, "low", "high", "mu_macro", "regime")
    if chosen.json:
        listed = [dict(zip(names, root, strict=True)) for root in roots]
        return as_json(
            {
                "unknown": unknown,
                "unit": unit,
                "target": target,
                "roots": listed,
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
    if chosen.out is not None:
        at = [root.value for one in places.values() for root in one.roots[0]]
        # a decade around the roots; what is at 0 is shown up to 1
        low, high = ends or (0.1 * min(at) or 1e-6 * (max(at) or 1.0), 10.0 * max(at) or 1.0)
        values = sweep_values(inner, low, high, CURVE, "log" if low > 0.0 else "linear")
        options: dict[str, Any] = {
            **kind.names,
            "refine": True,
            "stiffness_exponent": chosen.stiffness_exponent,
        }
        curve = friction_law(surrogate, inner, values, case, **options)
        columns = dict(zip(heads, zip(*roots, strict=True), strict=True))
        return common.write_result(
            chosen.out,
            columns,
            lambda axes: plotting.plot_law(curve, axes, roots=at, target=target),
        )
    at_one = next(one.roots[0][0].value for one in places.values() if one.roots[0])
    form = common.format_for(chosen, surrogate, {**case, inner: at_one}, kind)
    text = in_columns(
        [heads, *([*(f"{x:{form}}" for x in numbers), regime] for *numbers, regime in roots)]
    )
    none = [
        f"no {unknown} gives that for k = {k:.6g} N/m"
        for k, one in places.items()
        if not one.roots[0]
    ]
    return "\n".join([text, *none, *model_lines(model)])


def map_(words: Sequence[str]) -> str:
    """``mumacro map``."""
    told = (
        "The map of mu~ = mu_macro/mu0 over the dimensionless speed and amplitude, with a case "
        "on it."
    )
    epilog = f"{common.INPUTS}\nexample:\n  mumacro map -o map.png"
    parser = common.question("map", told, epilog, "a case to mark, if any", "*")
    chosen = parser.parse_intermixed_args(words)
    if chosen.out is None:
        raise UsageError("a map is written to a file: give -o map.png")
    kind, surrogate = common.kind_in(chosen), open_table(chosen.table)
    one_k = "one k is needed: the map marks one point"
    point = None
    if chosen.words:
        case = surrogate.evaluate(**{**read_case(chosen.words, kind, one_k=one_k), **kind.names})
        point = (case.v_tilde, case.y_tilde)
    ranges = (plotting.V_RANGE, plotting.y_range(kind))
    v, y = (
        x.ravel() for x in np.meshgrid(np.geomspace(*ranges[0], 141), np.geomspace(*ranges[1], 101))
    )
    columns = {
        "v_tilde": v,
        "y_tilde": y,
        "mu_ratio": surrogate.quantity("mu_ratio", v, y, **kind.names)[0],
    }
    text = common.write_result(
        chosen.out,
        columns,
        lambda axes: plotting.plot_map(surrogate, axes, point=point, **kind.names),
    )
    if point and not all(low <= x <= high for x, (low, high) in zip(point, ranges, strict=True)):
        text += f"\nthe case lies outside the map: v~ = {point[0]:.6g}, y~ = {point[1]:.6g}"
    return text


def stiffness_of(words: Sequence[str]) -> str:
    """``mumacro stiffness``."""
    parser = OneLineParser(
        prog="mumacro stiffness",
        description="The tangential stiffness k of a contact from materials and geometry, and the "
        "kind of the contact.",
        epilog=f"example:\n  {STIFFNESS}\n\nThe arguments of each: mumacro stiffness ball --help.",
    )
    parts = parser.add_subparsers(dest="geometry", required=True, metavar="GEOMETRY")
    for name, geometry in GEOMETRIES.items():
        part = parts.add_parser(
            name, help=geometry.meaning, description=f"k of {geometry.meaning}."
        )
        for argument in (*geometry.arguments, *BODIES):
            about, needed = ARGUMENTS[argument], argument in (*geometry.arguments, *BODIES[:2])
            unit, choices = f" [{about.unit}]" if about.unit else "", about.choices or None
            part.add_argument(
                f"--{argument}", required=needed, choices=choices, help=f"{about.meaning}{unit}"
            )
        common.add_form(part)
    chosen = parser.parse_args(words)
    names = (*GEOMETRIES[chosen.geometry].arguments, *BODIES)
    texts = {name: text for name in names if (text := getattr(chosen, name)) is not None}
    given = dict(zip(texts, common.read_values(texts.items(), read_argument), strict=True))
    contact = contact_of(chosen.geometry, **given)
    found = asdict(contact)
    if chosen.json:
        return as_json({**found, "geometry": chosen.geometry, **given})
    form = f".{chosen.digits or 4}g"  # what materials and geometry give at best
    rows = [(name, f"{found[name]:{form}}", f"[{unit}]") for name, unit in _UNITS.items()]
    option = "" if contact.contact == "spring" else f" --contact {contact.contact}"
    rows += [("contact", contact.contact, ""), ("paste", f"k={contact.k:{form}}{option}", "")]
    return "\n".join([in_columns(rows), *(f"warning: {text}" for text in contact.warnings)])

"""The commands that answer more than one case: ``mumacro law``, ``solve-for``, ``map`` and ``stiffness``."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from mumacro import command, plotting, stiffness
from mumacro.command import ImpossibleError, OneLineParser, UsageError, as_json, in_columns, open_table, read_case
from mumacro.inputs import BODIES, NAMES, RAD_PER_CYCLE, SI
from mumacro.inverse import solve_for
from mumacro.law import approximations, friction_law, sweep_values

__all__ = ["LAW", "SOLVE_FOR", "law", "map_", "solve", "stiffness_of"]

LAW = "mumacro law 'mu0=0.3 Fz=10N k=1N/um y0=2um f=20.69kHz' --along v0 0.1mm/s 1m/s"
SOLVE_FOR = "mumacro solve-for y0 'mu0=0.3 Fz=10N k=1N/um f=20.69kHz v0=1cm/s' --target 0.15"
OUT = "write the result there: a picture, .png, .svg or .pdf, or .csv"
CURVE = 400  # points of a curve in a picture
GEOMETRIES: dict[str, Callable[..., stiffness.Contact]] = {
    "ball": stiffness.ball_on_flat, "flat": stiffness.flat_punch, "cylinder": stiffness.cylinder_on_flat,
}  # fmt: skip
_UNITS = {"k": "N/m", "k_normal": "N/m", "half_width": "m", "pressure": "Pa"}


def _inner(name: str) -> tuple[str, float]:
    """The input of the model behind a name, and what one unit of the name is of it."""
    return ("omega", RAD_PER_CYCLE) if name == "f" else (name, 1.0)


def law(words: Sequence[str]) -> str:
    """``mumacro law``."""
    parser = OneLineParser(
        prog="mumacro law",
        description="mu_macro over a range of one input, with the static value and the border of continuous sliding.",
        epilog=f"{command.INPUTS}\nexamples:\n  {LAW}\n  {LAW} -o law.png",
    )
    command.add_table(parser, "a case without the swept input")
    text = "the swept input, its first and its last value"
    parser.add_argument("--along", nargs="+", metavar=("NAME", "LOW HIGH"), default=["v0"], help=text)
    parser.add_argument("--from", dest="start", help="first value, in its SI unit or with a unit, as in --along")
    parser.add_argument("--to", dest="stop", help="last value, the same")
    parser.add_argument("--points", type=int, help="number of values; default: 25, in pictures 400")
    parser.add_argument("--scale", choices=("log", "linear"), default="log", help="default: log")
    parser.add_argument("--approximations", action="store_true", help="also the approximations of the article")
    parser.add_argument("-o", "--out", type=Path, help=OUT)
    chosen = parser.parse_intermixed_args(words)
    (along, *ends), known = [x for x in chosen.along if "=" not in x] or [""], [x for x in chosen.along if "=" in x]
    if along not in NAMES:
        raise UsageError(f"--along {along or known[0]}: the swept input is one of {', '.join(NAMES)}")
    ends = ends or [end for end in (chosen.start, chosen.stop) if end is not None]
    if len(ends) != 2:
        raise UsageError(f"give the first and the last value: --along {along} LOW HIGH")
    (inner, scale), unit = _inner(along), SI[along][0]
    case = read_case([*chosen.words, *known], along)
    start, stop = (scale * end for end in command.read_values((along, end) for end in ends))
    drawn = chosen.out is not None and chosen.out.suffix != ".csv"
    values = sweep_values(inner, start, stop, chosen.points or (CURVE if drawn else 25), chosen.scale)
    surrogate = open_table(chosen.table)
    found = friction_law(surrogate, inner, values, case)
    columns: dict[str, Any] = {
        along: values / scale,
        **{name: getattr(found.answer, name) for name in ("mu_macro", "regime", "error_bound", "source")},
        "mu_static": found.mu_static,
    }
    if chosen.approximations:
        columns |= approximations(surrogate, found)
    border = [{along: c.value / scale, "mu_macro": c.mu_macro} for c in found.border]
    if chosen.json:
        return as_json({"along": along, "unit": unit, **columns, "border": border, "table": command.about(surrogate)})
    headed = {f"{name} [{unit}]" if name == along else name: column for name, column in columns.items()}
    marks = [f"border of continuous sliding at {along} = {b[along]:.{chosen.digits}g} {unit}" for b in border]
    if chosen.out is not None:
        return "\n".join(
            [command.write_result(chosen.out, headed, lambda axes: plotting.plot_law(found, axes)), *marks]
        )
    del headed["source"]
    shown = [[cell if isinstance(cell, str) else _shown(cell, chosen.digits) for cell in x] for x in headed.values()]
    return "\n".join([in_columns([[*headed], *zip(*shown, strict=True)]), *marks])


def _shown(value: float, digits: int) -> str:
    return "-" if math.isnan(value) else f"{value:.{digits}g}"


def solve(words: Sequence[str]) -> str:
    """``mumacro solve-for``."""
    parser = OneLineParser(
        prog="mumacro solve-for",
        description="Every value of one input at which mu_macro has a wanted value.",
        epilog=f"{command.INPUTS}\nexample, the amplitude [m] that halves the friction:\n  {SOLVE_FOR}",
    )
    parser.add_argument("unknown", choices=NAMES, help="the unknown input")
    command.add_table(parser, "the other five inputs")
    parser.add_argument("--target", type=float, required=True, help="wanted mu_macro [-]")
    parser.add_argument("--ratio", action="store_true", help="the target is mu_macro / mu0")
    text = "range to search, in the SI unit of the unknown or with a unit"
    parser.add_argument("--between", nargs=2, metavar=("LOW", "HIGH"), help=text)
    parser.add_argument("-o", "--out", type=Path, help=OUT)
    chosen = parser.parse_intermixed_args(words)
    unknown, (inner, scale), unit = chosen.unknown, _inner(chosen.unknown), SI[chosen.unknown][0]
    case = read_case(chosen.words, unknown)
    if chosen.ratio and unknown == "mu0":
        raise UsageError("--ratio cannot be used with mu0 as the unknown: give --target alone")
    target = chosen.target * case["mu0"] if chosen.ratio else chosen.target
    ends = [scale * end for end in command.read_values((unknown, text) for text in chosen.between or ())]
    surrogate = open_table(chosen.table)
    found = solve_for(surrogate, inner, target, case, (ends[0], ends[1]) if ends else None)
    reach = found.reach
    if not found.roots[0]:
        where = f"{unknown} from {reach.low / scale:.6g} to {reach.high / scale:.6g} {unit}"
        if found.constant:
            raise ImpossibleError(f"{unknown} has no influence here: mu_macro is {reach.mu_min:.12g} for {where}")
        raise ImpossibleError(
            f"mu_macro = {target:.12g} is out of reach: {where} gives {reach.mu_min:.12g} to {reach.mu_max:.12g}"
        )
    roots = [(r.value / scale, r.low / scale, r.high / scale, r.mu_macro, r.regime) for r in found.roots[0]]
    names = (unknown, "low", "high", "mu_macro", "regime")
    if chosen.json:
        listed = [dict(zip(names, root, strict=True)) for root in roots]
        return as_json(
            {"unknown": unknown, "unit": unit, "target": target, "roots": listed, "table": command.about(surrogate)}
        )
    heads = [f"{unknown} [{unit}]", "between", "and", "mu_macro [-]", "regime"]
    if chosen.out is not None:
        at = [root.value for root in found.roots[0]]
        # a decade around the roots; what is at 0 is shown up to 1
        low, high = ends or (0.1 * min(at) or 1e-6 * (max(at) or 1.0), 10.0 * max(at) or 1.0)
        values = sweep_values(inner, low, high, CURVE, "log" if low > 0.0 else "linear")
        curve = friction_law(surrogate, inner, values, case)
        columns = dict(zip(heads, zip(*roots, strict=True), strict=True))
        return command.write_result(
            chosen.out, columns, lambda axes: plotting.plot_law(curve, axes, roots=at, target=target)
        )  # fmt: skip
    text = f".{chosen.digits}g"
    return in_columns([heads, *([*(f"{x:{text}}" for x in numbers), regime] for *numbers, regime in roots)])


def map_(words: Sequence[str]) -> str:
    """``mumacro map``."""
    parser = OneLineParser(
        prog="mumacro map",
        description="The map of mu~ = mu_macro/mu0 over the dimensionless speed and amplitude, with a case on it.",
        epilog=f"{command.INPUTS}\nexample:\n  mumacro map -o map.png",
    )
    command.add_table(parser, "a case to mark, if any")
    parser.add_argument("-o", "--out", type=Path, required=True, help=OUT)
    chosen = parser.parse_intermixed_args(words)
    surrogate = open_table(chosen.table)
    case = surrogate.evaluate(read_case(chosen.words)) if chosen.words else None
    point = None if case is None else (case.v_tilde, case.y_tilde)
    v, y = (x.ravel() for x in np.meshgrid(np.geomspace(*plotting.V_RANGE, 141), np.geomspace(*plotting.Y_RANGE, 101)))
    columns = {"v_tilde": v, "y_tilde": y, "mu_ratio": surrogate.mu_ratio(v, y)}
    text = command.write_result(chosen.out, columns, lambda axes: plotting.plot_map(surrogate, axes, point=point))
    ranges = (plotting.V_RANGE, plotting.Y_RANGE)
    if point and not all(low <= x <= high for x, (low, high) in zip(point, ranges, strict=True)):
        text += f"\nthe case lies outside the map: v~ = {point[0]:.6g}, y~ = {point[1]:.6g}"
    return text


def stiffness_of(words: Sequence[str]) -> str:
    """``mumacro stiffness``."""
    parser = OneLineParser(
        prog="mumacro stiffness",
        description="The tangential stiffness k of a contact from materials and geometry.",
        epilog="example:\n  mumacro stiffness ball --radius 5mm --Fz 10N --E 210GPa --nu 0.3",
    )
    parser.add_argument("geometry", choices=GEOMETRIES, help="a ball, a flat punch or a lying cylinder on a flat body")
    parser.add_argument("--radius", required=True, help="[m], of the ball, the punch or the cylinder")
    parser.add_argument("--length", help="[m], of the cylinder")
    parser.add_argument("--Fz", required=True, help="normal force [N]")
    parser.add_argument("--E", required=True, help="Young's modulus [Pa], of both bodies or of the first")
    parser.add_argument("--nu", required=True, help="Poisson's ratio [-], of both bodies or of the first")
    parser.add_argument("--E2", help="of the flat body, where it is another material; inf: rigid")
    parser.add_argument("--nu2", help="of the flat body")
    parser.add_argument("--along", action="store_true", help="k along the axis of the cylinder, not across it")
    command.add_form(parser)
    chosen = parser.parse_args(words)
    texts = {name: getattr(chosen, name) for name in ("radius", "length", "Fz", "E", "nu", "E2", "nu2")}
    texts |= {"E2": texts["E2"] or texts["E"], "nu2": texts["nu2"] or texts["nu"]}
    wanted = inspect.signature(GEOMETRIES[chosen.geometry]).parameters
    faults = []
    for name in ("length", "along"):
        given = getattr(chosen, name)
        if given and name not in wanted:
            faults.append(f"--{name}: a {chosen.geometry} has none; leave it out")
        elif name == "length" and name in wanted and not given:
            faults.append("--length is missing: the length of the cylinder [m]")
    if faults:
        raise UsageError("; ".join(faults))
    there = {name: text for name, text in texts.items() if text is not None}
    values = command.read_values((name.rstrip("2"), text) for name, text in there.items())
    si = dict(zip(there, values, strict=True))
    bodies = [stiffness.Material(si["E"], si["nu"]), stiffness.Material(si["E2"], si["nu2"])]
    sizes = {name: si[name] for name in ("radius", "length", "Fz") if name in wanted}
    more = {"along": chosen.along} if "along" in wanted else {}
    found = asdict(GEOMETRIES[chosen.geometry](**sizes, **more, first=bodies[0], second=bodies[1]))
    contact = "ball" if chosen.geometry == "ball" else "spring"
    if chosen.json:
        materials = [asdict(body) for body in bodies]
        return as_json({**found, "contact": contact, "geometry": chosen.geometry, **sizes, "bodies": materials})
    rows = [(name, f"{value:.{chosen.digits}g}", f"[{_UNITS[name]}]") for name, value in found.items()]
    told = [f"E = {body.E:.6g} {BODIES['E'][0]}, nu = {body.nu:g}" for body in bodies]
    return in_columns([*rows, ("contact", contact), *zip(("first body", "second body"), told, strict=True)])

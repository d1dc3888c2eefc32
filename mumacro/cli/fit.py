"""``mumacro fit``: k and mu0 from measured points in a file."""

import csv
import math
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mumacro.analysis.fit import fit
from mumacro.analysis.fitted import Fit
from mumacro.analysis.measured_points import STD, UNKNOWNS, unknowns_beside
from mumacro.cli import common
from mumacro.cli.common import ImpossibleError, UsageError, as_json, in_columns, open_table
from mumacro.errors import InputError
from mumacro.inputs.fields import LIKE, SI, unit_of
from mumacro.inputs.kind import AMPLITUDE
from mumacro.inputs.text_tables import (
    SEPARATORS,
    absent,
    find_heads,
    read_cell,
    read_head,
    read_text,
)
from mumacro.validity import digits

EXAMPLE = "mumacro fit measured.csv 'Fz=10N y0=2um f=20kHz' -o fit.png"
_COLUMNS = f"""\
columns by name, in SI or with a unit as in v0 [mm/s]; others are ignored:
  v0 and mu_macro, of each point; what varies of Fz, y0 (or {AMPLITUDE}), omega or f;
  {STD}: of mu_macro, if known
  mu0, if it is known at each point, such as from the force without oscillation: then k
  alone is fitted
what is neither a column nor unknown is given as name=value

examples:
  {EXAMPLE}
  mumacro fit measured.csv Fz=10N y0=2um f=20kHz mu0=0.3 --unknown k --contact ball
"""
_READ = (*SI, AMPLITUDE, "mu_macro", STD)  # columns
_SHOWN = 5  # faults of a file


def run(words: Sequence[str]) -> str:
    """``mumacro fit``."""
    first = "points", {"help": "a file of CSV; - is standard input"}
    description = "k and mu0 of a contact from measured friction."
    parser = common.question("fit", description, _COLUMNS, "the other inputs", "*", first)
    parser.add_argument(
        "--unknown",
        nargs="+",
        metavar="NAME",
        help="k, mu0; default: both, k alone beside a column mu0",
    )
    parser.add_argument("--plot", dest="out", type=Path, metavar="FILE", help="the same as --out")
    common.add_format(parser)
    chosen = parser.parse_intermixed_args(words)
    unknown, more = (
        [x for x in chosen.unknown or () if ("=" in x) == has_value] for has_value in (False, True)
    )
    if wrong := [name for name in unknown if name not in UNKNOWNS]:
        raise UsageError(f"--unknown {wrong[0]}: k, mu0 or both can be fitted")
    kind = common.kind_in(chosen)
    try:
        text = (
            sys.stdin.read()
            if chosen.points == "-"
            else read_text(Path(chosen.points).read_bytes(), chosen.points)
        )
    except ValueError as error:
        raise ImpossibleError(str(error)) from None
    points = read_points(text, chosen.points, SEPARATORS[chosen.sep], chosen.decimal)
    unknown = unknown or unknowns_beside(points)
    there = [*unknown, *(name for name in points if name in kind.columns)]
    case = common.read_case(
        [*chosen.words, *more],
        kind,
        there,
        one_k="one k is needed; or leave it out, and it is fitted",
    )
    surrogate = open_table(chosen.table)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # they are in the result
            result = fit(points, unknown, **kind.names, surrogate=surrogate, **case)
    except InputError as error:
        raise ImpossibleError(f"{chosen.points}: {error}") from None
    except ModuleNotFoundError as error:  # says what to install
        raise ImpossibleError(str(error)) from None
    if chosen.out is not None:
        heads = [
            name if name in ("mu_macro", STD) else f"{name} [{unit_of(name)}]"
            for name in result.points
        ]
        columns = dict(zip(heads, result.points.values(), strict=True))
        columns |= {"mu_macro fitted": result.points["mu_macro"] - result.residuals}
        return (
            common.write_result(chosen.out, columns, result.plot)
            + "\n"
            + _text(result, chosen.digits)
        )
    if chosen.json:
        return as_json({**result.to_dict(), "table": common.about(surrogate)})
    return _text(result, chosen.digits)


def _text(result: Fit, shown: int | None) -> str:
    """Values with standard deviations and intervals, the scatter, other solutions, warnings."""
    rows: list[Sequence[str]] = []
    for name, value in result.values.items():
        off, (low, high) = result.std[name], result.interval[name]
        form = f".{shown or digits(off / value if 0.0 < value < math.inf else 0.0)}g"
        number = "rigid" if math.isinf(value) else f"{value:{form}}"
        rows.append(
            (
                name,
                number,
                f"[{unit_of(name)}]",
                f"+- {off:.2g}",
                f"95 %: {low:{form}} to {high:{form}}",
            )
        )
    if STD in result.points:
        rows.append(("chi2", f"{result.reduced_chi2:.3g}", "[-]", "over the degrees of freedom"))
    else:
        rows.append(
            ("scatter", f"{math.sqrt(result.reduced_chi2):.2g}", "[-]", "of mu_macro about the fit")
        )
    rows.append(("points", str(result.residuals.size), "", f"{result.contact}, {result.direction}"))
    for i, one in enumerate(result.solutions[1:], 2):
        values = ", ".join(f"{name} = {one[name]:.4g} {unit_of(name)}" for name in result.values)
        rows.append((f"solution {i}", values))
    doubts = [f"warning: {text}" for text in result.warnings]
    doubts += [f"{remark['row']}: {remark['text']}" for remark in result.remarks]
    return "\n".join([in_columns(rows), *doubts])


def read_points(text: str, where: str, sep: str = ",", decimal: str = ".") -> dict[str, Any]:
    """The columns of measured points, by name in SI, (n,); those of other names are left out.

    ImpossibleError tells what is wrong with the header or with cells, after ``where``.

    >>> read_points("v0 [mm/s],mu_macro\\n10,0.2\\n", "points.csv")
    {'v0': array([0.01]), 'mu_macro': array([0.2])}
    """
    lines = text.removeprefix("\ufeff").splitlines()
    try:
        header = read_head("".join(lines[:1]), lines[1:50], sep, decimal, ("mu_macro", STD))
    except ValueError as error:
        raise ImpossibleError(f"{where}: line 1: {error}") from None
    rows = [row for row in csv.reader(lines[1:], delimiter=sep) if any(map(str.strip, row))]
    places, faults = find_heads(
        header, {name: name if name in SI else LIKE.get(name, "mu0") for name in _READ}
    )
    faults += [absent(name, header) for name in ("v0", "mu_macro") if name not in places]
    columns = {name: np.empty(len(rows)) for name in places}
    for number, row in enumerate(rows, 1):
        if len(row) != len(header):
            faults.append(f"row {number} has {len(row)} cells, the header has {len(header)}")
            continue
        for name, (i, scale) in places.items():
            try:
                value = read_cell(name, row[i], decimal)
                columns[name][number - 1] = scale.si(value)
                if math.isnan(value):
                    faults.append(f"row {number}: {name} is missing")
            except ValueError as error:
                faults.append(f"row {number}: {name} {error}, got {row[i][:80]!r}")
    if faults:
        more = f"; and {len(faults) - _SHOWN} more" if len(faults) > _SHOWN else ""
        raise ImpossibleError(f"{where}: {'; '.join(faults[:_SHOWN])}{more}")
    return columns

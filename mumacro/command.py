"""What the command ``mumacro`` computes from the library alone: a case, a friction law, an inverse problem, the table.

Every function here takes what the user wrote and returns the text to print; wrong arguments raise a UsageError, a
request without a result an ImpossibleError.
"""

from __future__ import annotations

import argparse
import json
import math
import re
from argparse import Namespace
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from mumacro.bundled import bundled_tables
from mumacro.inputs import FIELDS, NAMES, RAD_PER_CYCLE, SI, read_number, suggestion
from mumacro.inverse import Root, solve_for
from mumacro.law import approximations, friction_law, sweep_values
from mumacro.surrogate import Surrogate

__all__ = [
    "ImpossibleError",
    "OneLineParser",
    "UsageError",
    "law",
    "one_case",
    "open_table",
    "read_case",
    "solve",
    "table",
]

REGIME_WORDS = {
    "continuous": "slips all the time",
    "stick_slip": "sticks during a part of each period",
    "static": "at rest: the limit v0 -> 0",
}
_PER_UNIT = {"mu0": "-", "Fz": "1/N", "k": "m/N", "y0": "1/m", "omega": "s/rad", "v0": "s/m"}


class UsageError(Exception):
    """The command is written wrongly; one line, with the remedy."""


class ImpossibleError(Exception):
    """The request is valid and has no result; one line, with the reason."""


class OneLineParser(argparse.ArgumentParser):
    """A fault, reported in one line."""

    def __init__(self, **options: Any) -> None:
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False, **options)

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message} ({self.prog} --help)\n")


def read_case(words: Sequence[str], without: str | None = None) -> dict[str, float]:
    """The inputs from arguments such as ``mu0=0.3 Fz=10``, in SI; an infinite ``k`` is rigid.

    Parameters
    ----------
    words : sequence of str
        Each holds any number of ``name=value``.
    without : str, optional
        The unknown or swept input, which must not be among them.

    Returns
    -------
    dict of str to float
        By name: the six inputs (``f`` [Hz] in place of ``omega`` where that was given) less ``without``.

    Raises
    ------
    UsageError
        Text that is no ``name=value``, an unknown, repeated, missing or superfluous name, a value that is no number.

    Examples
    --------
    >>> read_case(["mu0=0.3 Fz=10", "k=rigid", "y0=2e-6 f=20690 v0=0.01"])["k"]
    inf
    """
    case: dict[str, float] = {}
    for word in re.sub(r"\s*=\s*", "=", " ".join(words)).split():
        name, equals, text = word.strip(",;").partition("=")
        if not equals:
            raise UsageError(f"{word!r} is no name=value such as Fz=10")
        if name not in NAMES:
            meant = suggestion(name)
            raise UsageError(
                f"unknown input {name!r}" + (f": did you mean {meant}?" if meant else f"; there are {', '.join(NAMES)}")
            )
        if name in case:
            raise UsageError(f"{name} is given twice")
        try:
            case[name] = read_number(name, text)
        except ValueError as error:
            raise UsageError(str(error)) from None
    _check_names(case, without)
    return case


def _check_names(case: dict[str, float], without: str | None) -> None:
    other = {"f": "omega", "omega": "f"}
    for name in case.keys() & {without, other.get(without or "")}:
        raise UsageError(f"leave {name} out: {without} is the unknown or the swept input")
    if {"f", "omega"} <= case.keys():
        raise UsageError("give exactly one of omega [rad/s] and f [Hz]")
    absent = [
        n for n in FIELDS if n not in case and n != without and not (n == "omega" and (case.keys() | {without}) & {"f"})
    ]
    hints = {"k": "k [N/m] (k=rigid for a rigid contact)", "omega": "omega [rad/s] or f [Hz]"}
    if absent:
        raise UsageError("missing: " + ", ".join(hints.get(name, f"{name} [{SI[name][0]}]") for name in absent))


def open_table(which: str | None) -> Surrogate:
    """The table that ``--table`` names: a tolerance, a path, or nothing for the tightest bundled one.

    A first use compiles the kernels, which is reported on stderr.
    """
    try:
        return Surrogate.open(None if which is None else float(which))
    except ValueError:
        if which is None or not re.search(r"[^\d.eE+-]", which):
            raise
        return Surrogate.open(Path(which))


def _json(value: object) -> str:
    """JSON in which what is not finite is null."""

    def clean(item: Any) -> Any:
        if isinstance(item, dict):
            return {key: clean(entry) for key, entry in item.items()}
        if isinstance(item, (list, tuple)):
            return [clean(entry) for entry in item]
        if isinstance(item, np.generic):
            item = item.item()
        return None if isinstance(item, float) and not math.isfinite(item) else item

    return json.dumps(clean(value), indent=2)


def _about(surrogate: Surrogate) -> dict[str, Any]:
    return {"id": surrogate.id, "tolerance": surrogate.tolerance}


def _lines(rows: Iterable[Sequence[str]]) -> str:
    """Rows of cells as text in columns."""
    cells = [list(row) for row in rows]
    widths = [max(len(row[i]) for row in cells if i < len(row)) for i in range(max(map(len, cells)))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=False)).rstrip() for row in cells
    )


def one_case(chosen: Namespace) -> str:
    """``mumacro 'mu0=0.3 ...'``: value, regime, bound and source of one case."""
    case = read_case(chosen.words)
    surrogate = open_table(chosen.table)
    answer = surrogate.evaluate(case, gradient=chosen.gradient)
    found: dict[str, Any] = {
        name: getattr(answer, name)
        for name in ("mu_macro", "mu_ratio", "regime", "error_bound", "source", "v_tilde", "y_tilde")
    }
    if chosen.gradient:
        found["gradient"] = answer.gradient
    if chosen.json:
        return _json({**found, "inputs": {**case, "k": case["k"]}, "table": _about(surrogate)})
    rows = [
        ("mu_macro", f"{answer.mu_macro:.15g}", "[-]", f"+- {answer.error_bound:.2g}"),
        ("mu_ratio", f"{answer.mu_ratio:.15g}", "[-]", "mu_macro / mu0"),
        ("regime", answer.regime, "", REGIME_WORDS[answer.regime]),
        ("v_tilde", f"{answer.v_tilde:.15g}", "[-]", "v0 k / (mu0 Fz omega)"),
        ("y_tilde", f"{answer.y_tilde:.15g}", "[-]", "y0 k / (mu0 Fz)"),
        ("source", answer.source, "", f"of {surrogate.id}, tolerance {surrogate.tolerance:g}"),
    ]
    for name, slope in (answer.gradient or {}).items():
        rows.append((f"slope {name}", f"{slope:.10g}", f"[{_PER_UNIT[name]}]", f"d mu_macro / d {name}"))
    return _lines(rows)


def law(chosen: Namespace) -> str:
    """``mumacro law``: mu_macro along one input, with the border and the static value."""
    case = read_case(chosen.words, chosen.along)
    inner, scale = ("omega", RAD_PER_CYCLE) if chosen.along == "f" else (chosen.along, 1.0)
    values = sweep_values(inner, scale * chosen.start, scale * chosen.stop, chosen.points, chosen.scale)
    surrogate = open_table(chosen.table)
    found = friction_law(surrogate, inner, values, case)
    unit = SI[chosen.along][0]
    columns: dict[str, Any] = {
        chosen.along: values / scale,
        **{name: getattr(found.answer, name) for name in ("mu_macro", "regime", "error_bound", "source")},
        "mu_static": found.mu_static,
    }
    if chosen.approximations:
        columns |= approximations(surrogate, found, case)
    border = [{chosen.along: c.value / scale, "mu_macro": c.mu_macro} for c in found.border]
    if chosen.json:
        lists = {name: np.asarray(column).tolist() for name, column in columns.items()}
        return _json({"along": chosen.along, "unit": unit, **lists, "border": border, "table": _about(surrogate)})
    shown = [name for name in columns if name != "source"]
    rows = [[f"{name} [{unit}]" if name == chosen.along else name for name in shown]]
    for i in range(values.size):
        cells = [columns[name][i] for name in shown]
        rows.append([cell if isinstance(cell, str) else _shown(cell) for cell in cells])
    marks = [f"border of continuous sliding at {chosen.along} = {b[chosen.along]:.12g} {unit}" for b in border]
    return "\n".join([_lines(rows), *marks])


def _shown(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.12g}"


def solve(chosen: Namespace) -> str:
    """``mumacro solve-for``: every value of one input that gives a wanted mu_macro."""
    case = read_case(chosen.words, chosen.unknown)
    inner, scale = ("omega", RAD_PER_CYCLE) if chosen.unknown == "f" else (chosen.unknown, 1.0)
    if chosen.ratio and inner == "mu0":
        raise UsageError("--ratio cannot be used with mu0 as the unknown: give --target alone")
    target = chosen.target * float(case["mu0"] or 0.0) if chosen.ratio else chosen.target
    within = None if chosen.between is None else (scale * chosen.between[0], scale * chosen.between[1])
    surrogate = open_table(chosen.table)
    found = solve_for(surrogate, inner, target, case, within)
    reach, unit = found.reach, SI[chosen.unknown][0]
    if not found.roots[0]:
        where = f"{chosen.unknown} from {reach.low / scale:.6g} to {reach.high / scale:.6g} {unit}"
        if found.constant:
            raise ImpossibleError(
                f"{chosen.unknown} has no influence here: mu_macro is {reach.mu_min:.12g} for {where}"
            )
        raise ImpossibleError(
            f"mu_macro = {target:.12g} is out of reach: {where} gives {reach.mu_min:.12g} to {reach.mu_max:.12g}"
        )
    roots = [Root(r.value / scale, r.low / scale, r.high / scale, r.mu_macro, r.regime) for r in found.roots[0]]
    if chosen.json:
        listed = [
            {chosen.unknown: r.value, "low": r.low, "high": r.high, "mu_macro": r.mu_macro, "regime": r.regime}
            for r in roots
        ]
        return _json(
            {"unknown": chosen.unknown, "unit": unit, "target": target, "roots": listed, "table": _about(surrogate)}
        )
    rows = [[f"{chosen.unknown} [{unit}]", "between", "and", "mu_macro [-]", "regime"]]
    rows += [[*(f"{x:.15g}" for x in (r.value, r.low, r.high, r.mu_macro)), r.regime] for r in roots]
    return _lines(rows)


def table(chosen: Namespace) -> str:
    """``mumacro table``: the table in use, its tolerance and its errors."""
    surrogate = open_table(chosen.table)
    found = {
        "id": surrogate.id,
        "path": str(surrogate.path),
        "tolerance": surrogate.tolerance,
        "verified_max_abs_error": surrogate.max_abs_error,
        "verified_max_rel_error": surrogate.max_rel_error,
        "checksum": surrogate.checksum,
        "format_version": surrogate.attributes.get("format_version"),
        "product_version": surrogate.attributes.get("product_version"),
        "bytes": surrogate.path.stat().st_size,
    }
    if chosen.json:
        return _json({**found, "bundled": [str(path) for path in bundled_tables()]})
    text = {name: f"{value:.3g}" if isinstance(value, float) else str(value) for name, value in found.items()}
    rows = [[name, value] for name, value in text.items()]
    rows += [["bundled" if i == 0 else "", str(path)] for i, path in enumerate(bundled_tables())]
    return _lines(rows)

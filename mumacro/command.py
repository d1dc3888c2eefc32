"""What all commands share: one look of the arguments, exit codes, cases and tables as a person writes them."""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
import re
import sys
from argparse import RawDescriptionHelpFormatter
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from mumacro.errors import InputError, MumacroError
from mumacro.inputs import FIELDS, NAMES, RAD_PER_CYCLE, SI, check_inputs, read_number, read_range, scale_of, suggestion
from mumacro.surrogate import Surrogate

__all__ = [
    "INPUTS", "ImpossibleError", "OneLineParser", "UsageError", "about", "add_form", "add_table", "as_json",
    "in_columns", "open_table", "read_case", "read_values", "run", "write_result",
]  # fmt: skip

INPUTS = """\
inputs, each as name=value, in SI units or with a unit as in y0=2um:
  mu0    Coulomb friction coefficient [-], > 0
  Fz     normal force [N], > 0
  k      tangential stiffness [N/m], > 0, or rigid
  y0     amplitude of the transverse oscillation [m], >= 0
  omega  its angular frequency [rad/s], or f, its frequency [Hz], >= 0
  v0     sliding speed [m/s], >= 0
"""


class UsageError(Exception):
    """The command is written wrongly; one line, with the remedy."""


class ImpossibleError(MumacroError):
    """The request is valid and has no result; one line, with the reason."""


class OneLineParser(argparse.ArgumentParser):
    """A fault, reported in one line."""

    def __init__(self, **options: Any) -> None:
        super().__init__(formatter_class=RawDescriptionHelpFormatter, allow_abbrev=False, **options)

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message} ({self.prog} --help)\n")


def add_table(parser: OneLineParser, words: str | None = None) -> None:
    """The options of all commands that answer, after the inputs, if there are any, explained by ``words``."""
    if words is not None:
        parser.add_argument("words", nargs="*" if words.startswith("a case") else "+", metavar="name=value", help=words)
    text = "a table file, or the error of mu_macro/mu0 that a bundled table must keep; default: the tightest one"
    parser.add_argument("--table", metavar="PATH|TOLERANCE", help=text)
    add_form(parser)


def add_form(parser: OneLineParser) -> None:
    """The options for the form of a result."""
    parser.add_argument("--json", action="store_true", help="print JSON, with all digits")
    parser.add_argument("--digits", type=int, choices=range(1, 18), default=6, metavar="N", help="default: 6; 15: all")


def run(title: str, command: Callable[[Any], int | str], given: Any) -> int:
    """Run a command, print the text that it returns, and return the exit code; an error is one line on stderr."""
    try:
        found = command(given)
        if isinstance(found, str):
            print(found, flush=True)
            return 0
        sys.stdout.flush()
        return found
    except BrokenPipeError:  # the reader, such as head, has closed the pipe
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        code, text = 130, "interrupted"
    except (UsageError, InputError) as error:
        code, text = 2, str(error)
    except MumacroError as error:
        code, text = 1, str(error)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        code, text = 1, where + " ".join((error.strerror or str(error)).split())
    print(f"{title}: {text}", file=sys.stderr)
    return code


# --- what a person writes -------------------------------------------------------------------------------


def read_case(words: Sequence[str], without: str | None = None, ranges: bool = False) -> dict[str, Any]:
    """The inputs from arguments such as ``mu0=0.3 Fz=10 y0=2um``, in SI; an infinite ``k`` is rigid.

    Parameters
    ----------
    words : sequence of str
        Each holds any number of ``name=value``, with or without a unit.
    without : str, optional
        The unknown or swept input, which must not be among them.
    ranges : bool
        ``k`` may be ``low..high``; then it is the pair of both.

    Returns
    -------
    dict of str to float
        By name: the six inputs (``f`` [Hz] in place of ``omega`` where that was given) less ``without``.

    Raises
    ------
    UsageError
        Everything that is wrong, in one line: text that is no ``name=value``, an unknown, repeated, missing or
        superfluous name, a value that is no number, in no known unit, or out of bounds.

    Examples
    --------
    >>> read_case(["mu0=0.3 Fz=10", "k=1 N/um", "y0=2um f=20.69kHz v0=0.01"])["k"]
    1000000.0
    """
    case: dict[str, Any] = {}
    faults = []
    for name, text in _pairs(words):
        if text is None:
            faults.append(f"{name!r} is no name=value such as Fz=10")
            continue
        if name not in NAMES:
            meant = suggestion(name)
            case[meant or name] = math.nan  # not reported as missing, too
            advice = f"did you mean {meant}?" if meant else f"there are {', '.join(NAMES)}"
            faults.append(f"unknown input {name!r}: {advice}")
            continue
        if name in case:
            faults.append(f"{name} is given twice")
        case[name] = math.nan
        try:
            if ".." in text and name == "k" and ranges:
                case[name] = read_range(name, text)
                continue
            case[name] = read_number(name, text)
            field, value = ("omega", case[name] * RAD_PER_CYCLE) if name == "f" else (name, case[name])
            check_inputs({field: np.asarray(value)}, case[name] if name == "f" else None)
        except ValueError as error:
            faults.append(str(error))
    faults += _faults_of_names(case, without)
    if faults:
        raise UsageError("; ".join(faults))
    return case


def _pairs(words: Sequence[str]) -> list[tuple[str, str | None]]:
    """Name and value of each ``name=value``; a unit may stand apart; other words have no value."""
    found: list[tuple[str, str | None]] = []
    for word in re.sub(r"\s*=\s*", "=", " ".join(words)).split():
        name, equals, text = word.strip(",;").partition("=")
        last, value = found[-1] if found else ("", None)
        if equals:
            found.append((name, text))
        elif value is not None and last in NAMES and scale_of(last, name):
            found[-1] = last, f"{value} {name}"
        else:
            found.append((name, None))
    return found


def _faults_of_names(case: Mapping[str, Any], without: str | None) -> list[str]:
    frequencies = {"f", "omega"}
    left_out = frequencies if without in frequencies else {without}
    faults = [f"leave {name} out: {without} is the unknown or the swept input" for name in case if name in left_out]
    if frequencies <= case.keys():
        faults.append("give exactly one of omega [rad/s] and f [Hz]")
    given = case.keys() | left_out | (frequencies if frequencies & case.keys() else set())
    hints = {"k": "k [N/m] (k=rigid for a rigid contact)", "omega": "omega [rad/s] or f [Hz]"}
    absent = [hints.get(name, f"{name} [{SI[name][0]}]") for name in FIELDS if name not in given]
    return faults + (["missing: " + ", ".join(absent)] if absent else [])


def read_values(given: Iterable[tuple[str, str]]) -> list[float]:
    """Values from pairs of name and text, with or without a unit, in SI; UsageError names all that are none."""
    values, faults = [], []
    for name, text in given:
        try:
            values.append(read_number(name, text))
        except ValueError as error:
            faults.append(str(error))
    if faults:
        raise UsageError("; ".join(dict.fromkeys(faults)))
    return values


def open_table(which: str | None) -> Surrogate:
    """The table that ``--table`` names: a tolerance, a path, or nothing for the tightest bundled one."""
    try:
        return Surrogate.open(None if which is None else float(which))
    except ValueError:
        if which is None or not re.search(r"[^\d.eE+-]", which):
            raise
        return Surrogate.open(Path(which))


# --- results --------------------------------------------------------------------------------------------


def about(surrogate: Surrogate) -> dict[str, Any]:
    """What names a table in JSON."""
    return {"id": surrogate.id, "tolerance": surrogate.tolerance}


def in_columns(rows: Iterable[Sequence[str]]) -> str:
    """Rows of cells as text in columns."""
    columns = list(zip_longest(*rows, fillvalue=""))
    padded = ([cell.ljust(max(map(len, column))) for cell in column] for column in columns)
    return "\n".join("  ".join(row).rstrip() for row in zip(*padded, strict=True))


def write_result(path: Path, columns: Mapping[str, Sequence[Any]], draw: Callable[[Any], Any]) -> str:
    """Write ``-o x.csv``, the columns under their heads with all digits, or a picture; a line that names the file."""
    if path.suffix == ".csv":
        with path.open("w", encoding="utf-8", newline="") as stream:
            rows = csv.writer(stream, lineterminator="\n")
            rows.writerow(columns)
            rows.writerows(zip(*(np.asarray(column).tolist() for column in columns.values()), strict=True))
    else:
        from mumacro import plotting

        if path.suffix not in plotting.ENDINGS:
            raise UsageError(f"-o {path}: the name must end in .csv, {', '.join(plotting.ENDINGS)}")
        plotting.save(path, draw)
    return f"written: {path}"


def as_json(value: object) -> str:
    """JSON in which what is not finite is null."""

    def clean(item: Any) -> Any:
        if isinstance(item, dict):
            return {key: clean(entry) for key, entry in item.items()}
        if isinstance(item, (list, tuple)):
            return [clean(entry) for entry in item]
        if isinstance(item, (np.generic, np.ndarray)):
            return clean(item.tolist())
        return None if isinstance(item, float) and not math.isfinite(item) else item

    return json.dumps(clean(value), indent=2)

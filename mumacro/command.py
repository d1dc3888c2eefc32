"""What all commands share: one look of the arguments, exit codes, cases and tables as a person writes them."""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import sys
from argparse import RawDescriptionHelpFormatter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from mumacro.errors import InputError, MumacroError
from mumacro.inputs import FIELDS, NAMES, RAD_PER_CYCLE, SI, check_inputs, read_number, scale_of, suggestion
from mumacro.surrogate import Surrogate

__all__ = ["ImpossibleError", "OneLineParser", "UsageError", "as_json", "open_table", "read_case", "read_value", "run"]


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


def read_case(words: Sequence[str], without: str | None = None) -> dict[str, float]:
    """The inputs from arguments such as ``mu0=0.3 Fz=10 y0=2um``, in SI; an infinite ``k`` is rigid.

    Parameters
    ----------
    words : sequence of str
        Each holds any number of ``name=value``, with or without a unit.
    without : str, optional
        The unknown or swept input, which must not be among them.

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
    case: dict[str, float] = {}
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


def _faults_of_names(case: dict[str, float], without: str | None) -> list[str]:
    frequencies = {"f", "omega"}
    left_out = frequencies if without in frequencies else {without}
    faults = [f"leave {name} out: {without} is the unknown or the swept input" for name in case if name in left_out]
    if frequencies <= case.keys():
        faults.append("give exactly one of omega [rad/s] and f [Hz]")
    given = case.keys() | left_out | (frequencies if frequencies & case.keys() else set())
    hints = {"k": "k [N/m] (k=rigid for a rigid contact)", "omega": "omega [rad/s] or f [Hz]"}
    absent = [hints.get(name, f"{name} [{SI[name][0]}]") for name in FIELDS if name not in given]
    return faults + (["missing: " + ", ".join(absent)] if absent else [])


def read_value(name: str, text: str) -> float:
    """A value of an input, with or without a unit, in SI; UsageError where it is none."""
    try:
        return read_number(name, text)
    except ValueError as error:
        raise UsageError(str(error)) from None


def open_table(which: str | None) -> Surrogate:
    """The table that ``--table`` names: a tolerance, a path, or nothing for the tightest bundled one."""
    try:
        return Surrogate.open(None if which is None else float(which))
    except ValueError:
        if which is None or not re.search(r"[^\d.eE+-]", which):
            raise
        return Surrogate.open(Path(which))


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

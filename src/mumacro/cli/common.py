"""Define what all commands share: the layout of the help, exit codes, and how to read cases and
tables that a person writes."""

import argparse
import csv
import difflib
import io
import json
import math
import os
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np

from mumacro import plotting
from mumacro.errors import InputError, MumacroError
from mumacro.inputs.case import NO_DEVIATION, Value, check_signs, read, read_one
from mumacro.inputs.cases import A_DEVIATION, EXACT, KIND, check
from mumacro.inputs.fields import (
    AMPLITUDE,
    CONTACTS,
    DIRECTIONS,
    ENDS,
    INPUTS,
    RAD_PER_CYCLE,
    SPRING,
    Kind,
    in_help,
)
from mumacro.inputs.names import suggestion
from mumacro.inputs.units import belongs_to_value, choose_unit, format_number, tidy_zeros, unit_of
from mumacro.outputs import OUTPUTS
from mumacro.outputs.evaluation import names_in
from mumacro.questions.solutions import Solution
from mumacro.results import Note, Result, listed
from mumacro.surrogate import Surrogate

ABOUT_INPUTS = f"""\
inputs, each as name=value, in SI units or with a unit as in y0=2um:
  mu0    {in_help("mu0")};   Fz  {in_help("Fz")}
  k      {in_help("k")}; rigid; or k=0.8..1.2N/um
  y0     {in_help("y0")}; or Fz_amplitude [N]
  omega  {in_help("omega")}, or f [Hz] in its place
  v0     {in_help("v0")}
"""


class UsageError(Exception):
    """Report a command that is written wrongly, in one line with the remedy."""


class ImpossibleError(MumacroError):
    """Report a valid request that has no result, in one line with the reason."""


#: the help in 100 columns, one option per line, so that most of it fits a screen
_LINES = partial(argparse.RawDescriptionHelpFormatter, max_help_position=34, width=100)


class OneLineParser(argparse.ArgumentParser):
    """Parse arguments; report a fault in one line."""

    def __init__(self, **options: Any) -> None:
        super().__init__(formatter_class=_LINES, allow_abbrev=False, **options)

    def error(self, message: str) -> NoReturn:
        """End the program with code 2 and the fault.  Add the choice that was probably meant, or
        the example of the help if something is missing."""
        fault, _, offer = message.rpartition(" (choose from ")
        _, wrong, choice = fault.rpartition(": invalid choice: ")
        if wrong:
            choices = [word.strip(" '") for word in offer.removesuffix(")").split(",")]
            near = difflib.get_close_matches(choice.strip("'").lower(), choices, n=1)
            message = f"{fault}, did you mean {near[0]}?" if near else message
        _, unknown, option = message.partition("unrecognized arguments: ")
        if unknown:
            first = option.partition(" ")[0]
            near = difflib.get_close_matches(first, self._option_string_actions, n=1)
            message += f", did you mean {near[0]}?" if near else ""
            message += "" if option.strip() else "an empty one"
        message = message.replace("the following arguments are required", "missing")
        lines = (self.epilog or "").splitlines()
        example = next((line.strip() for line in lines if line.startswith("  mumacro ")), None)
        if example and re.match(r"missing: |argument .*: expected ", message):
            message += f", as in {example}"
        self.exit(2, f"{self.prog}: {message} ({self.prog} --help)\n")


def number_of(name: str, advice: str = "") -> Callable[[str], float]:
    """Return a function that reads an option with a number, as 0.15, 0,15 or 15%. For another text
    argparse reports the fault with the ``advice``."""

    def number(text: str) -> float:
        try:
            return read_one(name, text)
        except InputError as error:
            raise argparse.ArgumentTypeError(f"{error}{advice}") from None

    return number


#: options that several commands have
OPTIONS: dict[str, dict[str, Any]] = {
    "contact": {"choices": CONTACTS, "default": "spring", "help": "default: spring"},
    "direction": {
        "choices": DIRECTIONS,
        "default": "across",
        "metavar": "NAME",
        "help": f"{', '.join(DIRECTIONS)} (of the normal force); default: across",
    },
    "table": {
        "metavar": "PATH|TOLERANCE",
        "help": "a file, or the largest error; default: the tightest bundled one",
    },
    "json": {"action": "store_true", "help": "print JSON, with all digits, in SI"},
    "include": {
        "action": "append",
        "default": [],
        "metavar": "NAMES",
        "help": ", ".join(OUTPUTS),
    },
    "stiffness-exponent": {
        "type": number_of("stiffness_exponent"),
        "metavar": "M",
        "help": "k grows as Fz^M from its value at the case's Fz; of a ball: 1/3",
    },
}


def add_options(parser: argparse.ArgumentParser, *names: str) -> None:
    """Add options of :data:`OPTIONS`."""
    for name in names:
        parser.add_argument(f"--{name}", **OPTIONS[name])


def add_out(parser: argparse.ArgumentParser, *names: str) -> None:
    """Add the option for a file with the result, with more ``names`` than ``-o`` and ``--out``."""
    text = "write the result there: a picture, .png, .svg or .pdf, or .csv"
    parser.add_argument("-o", "--out", *names, type=Path, metavar="OUT", help=text)


def add_case(parser: OneLineParser, words: str, least: str = "+") -> None:
    """Add the inputs, explained by ``words``, and the options of all commands that answer."""
    parser.add_argument("words", nargs=least, metavar="name=value", help=words)
    add_options(parser, "contact", "direction", "table", "json")


def question(
    name: str,
    description: str,
    epilog: str,
    words: str,
    least: str = "+",
    first: tuple[str, dict[str, Any]] | None = None,
    names_of_out: Sequence[str] = (),
) -> OneLineParser:
    """Return the parser of a command that takes a case and ``-o``, which may have more names;
    ``first`` is an argument before the case."""
    parser = OneLineParser(prog=f"mumacro {name}", description=description, epilog=epilog)
    if first:
        parser.add_argument(first[0], **first[1])
    add_case(parser, words, least)
    add_out(parser, *names_of_out)
    return parser


def included(options: argparse.Namespace) -> tuple[str, ...]:
    """Return the outputs that ``--include`` names.  Raise InputError for an unknown one."""
    return tuple(name for text in options.include for name in names_in(text))


def run(title: str, command: Callable[[Any], int | str], arguments: Any) -> int:
    """Run a command, print the text that it returns, and return the exit code.  Print an error as
    one line on stderr."""
    for stream in (sys.stdout, sys.stderr):
        # a character that the terminal cannot show must not end a run whose output is written
        if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")
    try:
        output = command(arguments)
        if isinstance(output, str):
            print(output, flush=True)
            return 0
        sys.stdout.flush()
        return output
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
        code, text = 1, where + (error.strerror or str(error))
    print(f"{title}: {' '.join(text.split())}", file=sys.stderr)
    return code


# --- what a person writes -------------------------------------------------------------------------


class TypedCase(NamedTuple):
    """Hold a case as a person typed it."""

    inputs: dict[str, Any]  #: in SI, as keywords of ``Surrogate.evaluate``
    units: dict[str, str]  #: the units that were typed, by input


def read_case(
    words: Sequence[str],
    kind: Kind = SPRING,
    without: Sequence[str] = (),
    *,
    one_k: str = "",
    optional: Sequence[str] = (),
    deviations: bool = False,
) -> TypedCase:
    """Return the inputs from arguments such as ``mu0=0.3 Fz=10 y0=2um``.

    ``without`` are unknown or swept inputs, which must not be there.  ``one_k`` says why ``k`` must
    not be an interval here; if it is empty, an interval becomes ``k_low`` and ``k_high``.  All
    other inputs must be there, except those in ``optional``.  With ``deviations`` a typed one, as
    in ``k=1±0.1N/um``, becomes ``std_k`` and so on.  UsageError lists all faults in one line.

    >>> case = read_case(["mu0=0.3 Fz=10", "k=1 N/um", "y0=2um f=20kHz v0=0.01"])
    >>> case.inputs["k"], case.units
    (1000000.0, {'k': 'N/um', 'y0': 'um', 'f': 'kHz'})
    """
    allowed = [*kind.columns, *([] if one_k else ENDS)]
    allowed += [f"std_{name}" for name in kind.columns] if deviations else []
    case: dict[str, float] = {}
    units: dict[str, str] = {}
    faults: list[str] = []
    no_pairs: list[str] = []
    for name, text in _pairs(words):
        if text is None:
            no_pairs.append(repr(name))
            continue
        if name not in allowed:
            similar = suggestion(name)
            case[similar or name] = math.nan  # so that it is not reported as missing, too
            faults.append(_unknown(name, text, similar, kind))
            continue
        try:
            value = read(name.removeprefix("std_"), text)
            values = _inputs_of(name, text, value, one_k, deviations)
            units |= _unit(name, value)
        except InputError as error:
            faults.append(str(error))
            values = {name: math.nan}
        faults += [f"{twice} is given twice" for twice in values if twice in case]
        case |= values
    if no_pairs:
        verb = "is" if len(no_pairs) == 1 else "are"
        faults.insert(0, f"{', '.join(no_pairs)} {verb} no name=value such as Fz=10")
    try:
        check_signs({name: text for name, text in _pairs(words) if text is not None})
    except InputError as error:
        faults.append(str(error))
    absent = {*optional} - case.keys()
    faults += _faults_of_names(case, kind, [*without, *absent])
    if faults:
        raise UsageError("; ".join(faults))
    return TypedCase(case, units)


def _inputs_of(
    name: str, text: str, value: Value, one_k: str, deviations: bool
) -> dict[str, float]:
    """Return what a value says about an input: the number, with its deviation, or both ends of k.

    Raise InputError if it is out of bounds, or has what is not allowed here.
    """
    if name.startswith("std_"):
        if value.std is not None or value.low is not None:
            raise InputError(name, text, A_DEVIATION)
        if not 0.0 <= value.si < math.inf:
            raise InputError(name, text, EXACT)
        return {name: float(value.si)}
    if value.low is not None:
        if one_k:
            raise InputError(name, text, f"one number: {one_k}")
        return dict(zip(ENDS, (value.low, value.high), strict=True))
    if value.std is not None and not deviations:
        raise InputError(name, text, NO_DEVIATION)
    field, in_model = ("omega", value.si * RAD_PER_CYCLE) if name == "f" else (name, value.si)
    check({field: in_model}, value.si if name == "f" else None)
    std = {} if value.std is None else {f"std_{name}": value.std}
    return {name: float(value.si), **std}


def _unknown(name: str, text: str, similar: str | None, kind: Kind) -> str:
    """Return why a name is refused, and what to write instead."""
    if name in ("contact", "direction"):
        return f"{name} is an option: --{name} {text}"
    if name == AMPLITUDE:
        return f"{name} is the amplitude of --direction normal; otherwise it is y0"
    if name == "y0":
        return f"y0 does not belong to --direction normal, whose amplitude is {AMPLITUDE}"
    advice = f"did you mean {similar}?" if similar else f"there are {', '.join(kind.columns)}"
    if not similar and (options := difflib.get_close_matches(name, KIND, n=1)):
        advice = f"did you mean the option --{options[0]} {text}?"
    return f"unknown input {name!r}: {advice}"


def _pairs(words: Sequence[str]) -> list[tuple[str, str | None]]:
    """Return name and value of each ``name=value``.  A unit may follow after a space.  Other words
    have no value."""
    pairs: list[tuple[str, str | None]] = []
    text = " ".join(" ".join(words).split())
    for word in text.replace(" =", "=").split():
        name, equals, text = word.strip(",;").partition("=")
        last, value = pairs[-1] if pairs else ("", None)
        if equals:
            pairs.append((name, text))
        elif value is not None and (last in INPUTS or not value) and not _is_name(word):
            pairs[-1] = last, f"{value} {word.rstrip(',;')}".strip()
        else:
            pairs.append((name, None))
    return pairs


def _is_name(word: str) -> bool:
    """Return whether a word is the name of an input without a value.  Any other word belongs to the
    value before it, and is refused with this value if it does not fit."""
    if word in (*INPUTS, *KIND):
        return True
    return not belongs_to_value(word) and suggestion(word, loosely=False) is not None


def _unit(name: str, value: Value) -> dict[str, str]:
    """Return the unit of a value by the name of its input; nothing for a bare number."""
    return {} if name not in INPUTS or value.unit in (None, "", "1", "-") else {name: value.unit}


def _faults_of_names(case: Mapping[str, Any], kind: Kind, without: Sequence[str]) -> list[str]:
    frequencies = {"f", "omega"}
    unknowns = {*without} | (frequencies if frequencies & {*without} else set())
    faults = [
        f"leave {name} out of the case: this command varies or computes it"
        for name in case
        if name in unknowns
    ]
    if frequencies <= case.keys():
        faults.append("give exactly one of omega [rad/s] and f [Hz]")
    complete = case.keys() | unknowns | ({"k"} if case.keys() & {*ENDS} else set())
    complete |= frequencies if frequencies & case.keys() else set()
    hints = {"k": "k [N/m] (k=rigid for a rigid contact)", "omega": "omega [rad/s] or f [Hz]"}
    absent = [
        hints.get(name, f"{name} [{unit_of(name)}]") for name in kind.fields if name not in complete
    ]
    return faults + (["missing: " + ", ".join(absent)] if absent else [])


def target_in(options: argparse.Namespace, case: Mapping[str, Any]) -> float:
    """Return the mu_macro of ``--target``, which with ``--ratio`` is over mu0."""
    if not options.ratio:
        return float(options.target)
    if "mu0" not in case:
        raise UsageError("--ratio cannot be used with mu0 as the unknown: give --target alone")
    return float(options.target * case["mu0"])


def other_meaning(options: argparse.Namespace, case: TypedCase, solution: Solution) -> str:
    """Return the option that was perhaps forgotten or unnecessary, if a target is out of reach: it
    may be mu_macro, or its ratio to mu0."""
    target, mu0 = options.target, case.inputs.get("mu0")
    if solution.constant or not mu0:
        return ""
    if not solution.reach.holds(target if options.ratio else target * mu0):
        return ""
    if options.ratio:
        return f"; did you mean mu_macro = {target:g}? Then leave out --ratio"
    return f"; did you mean mu_macro/mu0 = {target:g}? Then add --ratio"


def without_or_load(unknown: str) -> dict[str, Any]:
    """Return keywords of ``read_case``: the unknown must not be there, but Fz may be, as the load
    at which k holds."""
    return {"optional": ["Fz"]} if unknown == "Fz" else {"without": [unknown]}


def unit_of_ends(name: str, texts: Iterable[str]) -> dict[str, str]:
    """Return the unit of the first of several texts of an input that has one, by its name.

    >>> unit_of_ends("v0", ["0.1m/s", "1"]), unit_of_ends("v0", ["1"])
    ({'v0': 'm/s'}, {})
    """
    return next(filter(None, (_unit(name, read(name, text)) for text in texts)), {})


def case_line(typed: TypedCase, kind: Kind, *oscillations: str) -> str:
    """Return the case as the program understood it, in the units that were typed, and its
    ``oscillations``."""
    (case, units), parts = typed, list[str]()
    for name, value in case.items():
        if name.startswith("std_") or name == ENDS[1]:
            continue
        ends = (value, case[ENDS[1]]) if name == ENDS[0] else (value,)
        field = "k" if name == ENDS[0] else name
        if math.isinf(ends[-1]):
            parts.append("k rigid")
            continue
        unit = choose_unit(field, float(ends[-1]), units)
        deviation = [case[f"std_{name}"]] if f"std_{name}" in case else []
        shown = [tidy_zeros(format_number(float(x), unit, 6)) for x in (*ends, *deviation)]
        numbers = (" ± " if deviation else " to ").join(shown)
        parts.append(f"{field} = {numbers} {unit.symbol}".removesuffix(" -"))
    return "; ".join([", ".join([*parts, *oscillations]), ", ".join(kind.names.values())])


def read_values(pairs: Iterable[tuple[str, str]], reader: Callable[[str, str], Any]) -> list[Any]:
    """Return values in SI from pairs of name and text, with or without a unit.  UsageError names
    all texts that are not values."""
    values, faults = [], []
    for name, text in pairs:
        try:
            values.append(reader(name, text))
        except InputError as error:
            faults.append(str(error))
    if faults:
        raise UsageError("; ".join(dict.fromkeys(faults)))
    return values


def open_table(table: str | None) -> Surrogate:
    """Return the table that ``--table`` names: a tolerance, a path, or nothing for the tightest
    bundled one."""
    try:
        return Surrogate.open(None if table is None else float(table))
    except ValueError:
        if table is None or not re.search(r"[^\d.eE+-]", table):
            raise
        return Surrogate.open(Path(table))


# --- results --------------------------------------------------------------------------------------


def in_columns(rows: Iterable[Sequence[str]]) -> str:
    """Return rows of cells as text in columns."""
    columns = list(zip_longest(*rows, fillvalue=""))
    widths = [max(map(len, column)) for column in columns]
    cells_of_rows = (
        [cell.ljust(width) for cell in column]
        for column, width in zip(columns, widths, strict=True)
    )
    return "\n".join("  ".join(row).rstrip() for row in zip(*cells_of_rows, strict=True))


def in_full(result: Result, *last: tuple[str, ...]) -> str:
    """Return a result about one thing with all of its rows, the ``last`` rows and its notes."""
    _, rows, below = result._in_full()
    return "\n".join([in_columns([*(rows or ()), *last]), *below])


def note_lines(notes: Iterable[Note]) -> list[str]:
    """Return the lines below a result."""
    return [f"{note.word}  {note.about}" for note in notes]


def present(
    options: argparse.Namespace,
    result: Any,
    columns: Mapping[str, Any],
    text: str,
    surrogate: Surrogate | None = None,
    **panels: Any,
) -> str:
    """Return a result as the options ask for it, as JSON or as ``text``, after a line that names
    the file of ``-o`` with its picture or its columns."""
    written = ""
    if options.out is not None:
        written = write_result(options.out, columns, result.plot, **panels)
    if options.json:
        return as_json(result.to_dict(), surrogate)
    return "\n".join(filter(None, (written, text)))


def write_result(
    path: Path, columns: Mapping[str, Any], draw: Callable[[Any], Any], **panels: Any
) -> str:
    """Write ``-o``: x.csv with the columns under their headers, with all digits; or a picture.
    Return a line that names the file."""
    if path.suffix == ".csv":
        with path.open("w", encoding="utf-8", newline="") as stream:
            rows = csv.writer(stream, lineterminator="\n")
            rows.writerow(columns)
            rows.writerows(
                zip(*(np.asarray(column).tolist() for column in columns.values()), strict=True)
            )
    else:
        plotting.save(path, draw, **panels)
    return f"written: {path}"


def as_json(value: Mapping[str, Any], surrogate: Surrogate | None = None) -> str:
    """Return JSON in which a number that is not finite is null, with the table that answered."""
    table = {} if surrogate is None else {"table": members_of(surrogate)}
    return json.dumps(listed({**value, **table}), indent=2)


def members_of(surrogate: Surrogate) -> dict[str, Any]:
    """Return the members that identify a table in JSON."""
    return {"id": surrogate.id, "tolerance": surrogate.tolerance}

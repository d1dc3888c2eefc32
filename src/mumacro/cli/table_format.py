"""Read a table as text for a command: the options for its layout, the file, and the line that a
refusal is about."""

import argparse
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from mumacro.cli.common import ImpossibleError, UsageError
from mumacro.errors import InputError, TextError
from mumacro.inputs.cells import THOUSANDS
from mumacro.inputs.layout import SEPARATORS, Dialect
from mumacro.inputs.whole_tables import TableOfNumbers


def add_format(parser: argparse.ArgumentParser) -> None:
    """Add the options for the layout of a table as text; :func:`dialect_in` reads them."""
    for name, choices, text in (
        ("sep", SEPARATORS, "between the cells"),
        ("decimal", (".", ","), "in numbers"),
        ("thousands", THOUSANDS, "between thousands"),
    ):
        words = f"{text}: {' '.join(choices)}; default: as the table has"
        parser.add_argument(f"--{name}", choices=choices, metavar="SIGN", help=words)
    parser.add_argument("--encoding", metavar="NAME", help="such as utf-16; default: found out")
    parser.add_argument("--skip", type=int, default=0, metavar="N", help="leave out N lines")
    text = "the first and the last line of data, as 4..12"
    parser.add_argument("--rows", type=_lines, metavar="A..B", help=text)
    text = "of a workbook; default: the one that has the names of the columns"
    parser.add_argument("--sheet", metavar="NAME", help=text)


def _lines(text: str) -> tuple[int, int]:
    """Return the numbers of two lines; argparse reports a fault in another text."""
    first, dots, last = text.partition("..")
    if not (dots and first.isdecimal() and last.isdecimal() and 0 < int(first) <= int(last)):
        raise argparse.ArgumentTypeError(f"{text!r}: must be two numbers of lines, as 4..12")
    return int(first), int(last)


def dialect_in(options: argparse.Namespace) -> Dialect:
    """Return how a table as text is written, as far as the options say."""
    if options.skip < 0:
        raise UsageError(f"--skip {options.skip}: a number of lines, 0 or more")
    return Dialect(
        None if options.sep is None else SEPARATORS[options.sep],
        options.decimal,
        None if options.thousands is None else THOUSANDS[options.thousands],
        options.encoding,
        options.skip,
        rows=options.rows,
        sheet=options.sheet,
    )


def read_file(name: str, read: Callable[[Path | bytes], TableOfNumbers]) -> TableOfNumbers:
    """Return the table of a file, or of standard input, whose name is -."""
    try:
        return read(sys.stdin.buffer.read() if name == "-" else Path(name))
    except TextError as error:
        raise ImpossibleError(f"{name}: {error}") from None


def fit_to(
    name: str, table: TableOfNumbers, fit: Callable[[], Any], heads: Mapping[str, str]
) -> Any:
    """Return the fit to a table.

    A refusal of a value names its line, and its column, whose header ``heads`` may have.
    """
    try:
        return fit()
    except InputError as error:
        at_line = f"line {table.lines[error.index]}: " if error.index is not None else ""
        fault = InputError(heads.get(error.field, error.field), error.value, error.bound)
        raise ImpossibleError(f"{name}: {at_line}{fault}") from None
    except ModuleNotFoundError as error:  # it says what to install
        raise ImpossibleError(str(error)) from None


def say_how_read(command: str, table: TableOfNumbers) -> None:
    """Say on stderr how a table was read."""
    if table.read_as:
        print(f"mumacro {command}: read as: {table.read_as}", file=sys.stderr)

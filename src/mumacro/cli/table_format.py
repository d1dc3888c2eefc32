"""Define the options for the layout of a table as text, for the commands that take files."""

import argparse

from mumacro.cli.common import UsageError
from mumacro.inputs.layout import SEPARATORS, Dialect
from mumacro.inputs.numbers import THOUSANDS


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

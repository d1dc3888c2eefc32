"""Run ``mumacro motion``: print the friction under any periodic motion."""

import argparse
from collections.abc import Sequence
from typing import Any

from mumacro import plotting
from mumacro.cli import common
from mumacro.cli.common import OneLineParser, TypedCase, UsageError, in_columns, read_case
from mumacro.inputs.fields import in_help, kind_of
from mumacro.inputs.units import format_number, suit_unit
from mumacro.motions.motion import NUMBERS, PARTS, Motion
from mumacro.motions.motion import motion as steady_cycle
from mumacro.motions.oscillation import read_oscillation

EXAMPLE = 'mumacro motion "mu0=0.3 Fz=10N k=1N/um f=20kHz v0=1cm/s" --x 1um@90deg --y 2um'
_INPUTS = f"""\
inputs, each as name=value, in SI units or with a unit as in v0=1cm/s:
  mu0    {in_help("mu0")}
  Fz     {in_help("Fz")}: its mean
  k      {in_help("k")}
  omega  {in_help("omega").replace(">=", ">")}, or f [Hz] in its place
  v0     {in_help("v0")}: that of the drag along x
an oscillation is amplitude@phase, of several harmonics a list such as 2um,3:0.4um@90deg
"""
_SI = {"t": "s", "x": "m", "y": "m", "Fx": "N", "Fy": "N", "Fz": "N", "share": "-"}


def add_parts(parser: argparse.ArgumentParser) -> None:
    """Add the options of a motion."""
    helps = (
        "A: amplitude [m] along the drag, half of peak to peak",
        "across it, likewise",
        "of the normal force [N], likewise",
    )
    for name, text in zip(PARTS, helps, strict=True):
        parser.add_argument(f"--{name}", metavar="A[@PHASE]", help=text)


def read_motion(
    options: argparse.Namespace, optional: Sequence[str] = ()
) -> tuple[TypedCase, dict[str, Any], str]:
    """Return the case that was typed, the oscillations as keywords of :func:`mumacro.motion`, and a
    line that says how the program understood both.

    ``optional`` are inputs of the case that may be left out.
    """
    why = "one motion has one k; ask for both ends"
    case = read_case(options.words, one_k=why, optional=["y0", *optional])
    if "y0" in case.inputs:
        raise UsageError("y0 is an option here: --y for across, --x for along the drag")
    texts = {name: text for name in PARTS if (text := getattr(options, name)) is not None}
    parts = dict(zip(texts, common.read_values(texts.items(), read_oscillation), strict=True))
    oscillations = [f"{name} = {text}" for name, text in texts.items()]
    line = common.case_line(case, kind_of(options.contact), *oscillations)
    return case, parts, line.removesuffix(", across")


def _parser() -> OneLineParser:
    """Return the parser of the command's arguments."""
    parser = OneLineParser(
        prog="mumacro motion",
        description="Mean friction and steady cycle of a contact that is dragged along x and "
        "shaken in any periodic way.",
        epilog=f"{_INPUTS}\nexamples:\n  {EXAMPLE}\n  {EXAMPLE} -o cycle.png",
    )
    parser.add_argument("words", nargs="+", metavar="name=value", help="a case without y0")
    add_parts(parser)
    common.add_options(parser, "contact")
    text = "of the mean force over mu0 Fz, 1e-9 to 1e-2; default: 1e-6"
    parser.add_argument("--tolerance", type=common.number_of("tolerance"), default=1e-6, help=text)
    common.add_out(parser)
    common.add_options(parser, "json")
    return parser


def run(words: Sequence[str]) -> str:
    """Run ``mumacro motion``."""
    options = _parser().parse_intermixed_args(words)
    case, parts, line = read_motion(options)
    motion = steady_cycle(
        **case.inputs, **parts, contact=options.contact, tolerance=options.tolerance
    )
    rows = [
        (name, *_shown(name, getattr(motion, name), unit, motion), meaning)
        for name, (unit, meaning) in NUMBERS.items()
        if name != "error_estimate"
    ]
    error = f"numerical error of both about {motion.error_estimate:.1e}"
    text = "\n".join([line, in_columns(rows), error, *(note.line for note in motion.notes)])
    columns = {}
    if options.out is not None and options.out.suffix == ".csv":
        columns = {f"{name} [{_SI[name]}]": x for name, x in motion.cycle()._asdict().items()}
    return common.present(options, motion, columns, text, **plotting.OF_CYCLE)


def _shown(name: str, value: float, unit: str, motion: Motion) -> tuple[str, str]:
    """Return a number with the digits that its error estimate allows, and its unit."""
    share = {"mu_macro": 1.0, "mu_lateral": 1.0}
    if name == "power_drive" and motion.mu_macro:  # mu_macro Fz v0
        share[name] = abs(value / motion.mu_macro)
    error = motion.error_estimate * share.get(name, 0.0)
    shown = suit_unit(unit, value)
    return format_number(value, shown, 6, error), f"[{shown.symbol}]"

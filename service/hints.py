"""Advice in the reason of a refusal: which field or number was probably meant."""

import re
from collections.abc import Iterable
from difflib import get_close_matches

from .kernel import BOUNDS, SI, scale_of, suggestion

__all__ = [
    "NUMBER",
    "ONE_FREQUENCY",
    "STATE_K",
    "STATE_OMEGA",
    "TOO_FREQUENT",
    "number_hint",
    "read_number",
    "unknown_name",
]

#: a number in a query or a cell, narrower than Python's; an unescaped "+" of a query arrives as a space
NUMBER = re.compile(r"[+-]?(\d+(?:\.\d*)?|\.\d+)([eE][+\- ]?\d+)?", re.ASCII)
STATE_K = "is required: the tangential stiffness [N/m], or {rigid} for rigid contact"
STATE_OMEGA = "is required: omega [rad/s], or f [Hz] in its place"
ONE_FREQUENCY = "omega is given, too: give exactly one of omega [rad/s] and f [Hz]"
TOO_FREQUENT = f"must be {BOUNDS['f']}"

_WITH_UNIT = re.compile(r"\s*([+-]?(?:\d+[.,]?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-zµμ%/·*^0-9]+)\s*")


def unknown_name(name: str, known: Iterable[str]) -> str:
    """The reason for refusing a name, with the known name that is closest to it."""
    names = list(known)
    meant = suggestion(name[:80], loosely=False)
    if meant not in names:
        meant = next(iter(get_close_matches(name[:80], names, n=1, cutoff=0.6)), None)
    advice = f"did you mean {meant}? " if meant else ""
    return f"unknown field; {advice}allowed: {', '.join(names)}"


def number_hint(text: object, name: str) -> str:
    """The reason for refusing what should be the number of an input, or of ``tolerance``."""
    if isinstance(text, str):
        if NUMBER.fullmatch(text.strip()):
            return "must be a number, not a text: leave out the quotes"
        if re.fullmatch(r"\s*[+-]?\d+,\d+\s*", text[:80]):
            return f"must be a number with a decimal point: {text.strip().replace(',', '.')}"
        found = _WITH_UNIT.fullmatch(text[:80])
        if found:
            like = name if name in SI else "mu0"  # a tolerance is a plain number, too
            words, scale = SI[like][1], scale_of(like, found[2])
            if scale is not None:  # rounded to what a person would write
                return f"must be a number: give {words}, {scale.si(float(found[1].replace(',', '.'))):.12g}"
            return f"must be a number without a unit: give {words}"
    return "must be a number"


def read_number(text: object) -> object:
    """A query's text as a number where it is one, else as it was."""
    if isinstance(text, str) and NUMBER.fullmatch(text):
        return float(text.replace(" ", "+"))
    return text

"""The six inputs as text: their names, the names they are mistaken for, and their units.

One table of units and one of other names, for the command line, for the columns of files and for hints anywhere else.
An angular frequency ``omega`` [rad/s] may be given as a frequency ``f`` [Hz] in its place.
"""

from __future__ import annotations

import difflib
import math
import re
from typing import NamedTuple

__all__ = ["NAMES", "SI", "UNITS_OF", "Scale", "read_number", "scale_of", "split_unit", "suggestion"]

#: unit names that may be given, and the SI unit in words, for errors such as "give metres"
SI = {
    "mu0": ("-", "a plain number"),
    "Fz": ("N", "newtons"),
    "k": ("N/m", "newtons per metre"),
    "y0": ("m", "metres"),
    "omega": ("rad/s", "radians per second"),
    "f": ("Hz", "hertz"),
    "v0": ("m/s", "metres per second"),
}
NAMES = tuple(SI)


class Scale(NamedTuple):
    """A unit in SI: value * times / over.  Small powers of ten stand in ``over``: 2 um are 2 / 1e6, rounded once."""

    times: float = 1.0
    over: float = 1.0

    def si(self, value: float) -> float:
        """``value`` in the SI unit."""
        return value * self.times / self.over


_LENGTH = {
    "m": Scale(), "cm": Scale(over=1e2), "mm": Scale(over=1e3), "um": Scale(over=1e6), "µm": Scale(over=1e6),
    "μm": Scale(over=1e6), "nm": Scale(over=1e9), "pm": Scale(over=1e12), "in": Scale(254.0, 1e4),
}  # fmt: skip
_FORCE = {"N": Scale(), "mN": Scale(over=1e3), "uN": Scale(over=1e6), "kN": Scale(1e3), "MN": Scale(1e6),
          "lbf": Scale(4.4482216152605)}  # fmt: skip
_TIME = {"s": 1.0, "min": 60.0, "h": 3600.0}

#: input -> unit -> scale; the only table of units
UNITS_OF: dict[str, dict[str, Scale]] = {
    "mu0": {"-": Scale(), "1": Scale(), "": Scale(), "%": Scale(over=1e2)},
    "Fz": _FORCE,
    "k": {
        f"{force}/{length}": Scale(up.times * down.over, up.over * down.times)
        for force, up in _FORCE.items()
        for length, down in _LENGTH.items()
    },
    "y0": _LENGTH,
    "omega": {
        "rad/s": Scale(), "1/s": Scale(), "krad/s": Scale(1e3), "rpm": Scale(math.tau, 60.0),
        "1/min": Scale(math.tau, 60.0), "deg/s": Scale(math.pi, 180.0),
    },
    "f": {"Hz": Scale(), "1/s": Scale(), "mHz": Scale(over=1e3), "kHz": Scale(1e3), "MHz": Scale(1e6)},
    "v0": {
        f"{length}/{time}": Scale(scale.times, scale.over * seconds)
        for length, scale in {**_LENGTH, "km": Scale(1e3)}.items()
        for time, seconds in _TIME.items()
    },
}  # fmt: skip

# Without case, spaces and punctuation.  Only names that hardly mean anything else: a column of a file that has one of
# them while the input itself is missing is refused.
_OTHER_NAMES = {
    "mu": "mu0", "mus": "mu0", "muk": "mu0", "mucoulomb": "mu0", "frictioncoefficient": "mu0",
    "coefficientoffriction": "mu0", "cof": "mu0", "µ": "mu0", "µ0": "mu0", "μ": "mu0", "μ0": "mu0",
    "fn": "Fz", "n": "Fz", "force": "Fz", "normalforce": "Fz", "load": "Fz", "normalload": "Fz",
    "kx": "k", "kt": "k", "ktangential": "k", "stiffness": "k", "tangentialstiffness": "k", "contactstiffness": "k",
    "y": "y0", "amplitude": "y0", "ampl": "y0", "amp": "y0", "a": "y0", "a0": "y0",
    "w": "omega", "om": "omega", "ω": "omega", "angularfrequency": "omega", "angularvelocity": "omega",
    "freq": "f", "frequency": "f", "hz": "f", "f0": "f",
    "v": "v0", "vx": "v0", "speed": "v0", "velocity": "v0", "slidingspeed": "v0", "slidingvelocity": "v0",
}  # fmt: skip
_OTHER_NAMES |= {name.lower(): name for name in NAMES}

_IN_BRACKETS = re.compile(r"\s*(.*?)\s*(?:\[\s*([^\[\]]*?)\s*\]|\(\s*([^()]*?)\s*\))\s*", re.DOTALL)
_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_WITH_UNIT = re.compile(rf"({_NUMBER})\s*([^\d\s.,+-].*)", re.ASCII)
_PLAIN = re.compile(rf"{_NUMBER}|[+-]?(?:nan|inf|infinity)", re.ASCII | re.IGNORECASE)


def split_unit(column: str) -> tuple[str, str | None]:
    """Name and unit of a heading such as ``k [N/mm]`` or ``k (N/mm)``; the unit is None where there are no brackets.

    >>> split_unit("k [N/mm]"), split_unit("v0")
    (('k', 'N/mm'), ('v0', None))
    """
    found = _IN_BRACKETS.fullmatch(column)
    if found is None:
        return column.strip(), None
    return found[1], found[2] if found[2] is not None else found[3]


def scale_of(name: str, unit: str) -> Scale | None:
    """What one ``unit`` of the input ``name`` is in SI; None for a unit that is not in the table.

    >>> scale_of("k", "N/mm").si(3.0)
    3000.0
    """
    return UNITS_OF[name].get(unit.replace(" ", "").replace("·", ""))


def suggestion(name: str, *, loosely: bool = True) -> str | None:
    """The input that ``name`` is taken for, in another case, by another name or (``loosely``) misspelt; None for none.

    >>> suggestion("FZ"), suggestion("F"), suggestion("stiffness"), suggestion("omga"), suggestion("temperature")
    ('Fz', 'Fz', 'k', 'omega', None)
    """
    if name.strip() == "F":  # a force; without case it would be the frequency f
        return "Fz"
    plain = re.sub(r"[\s_.\-~^*{}$\\]", "", name).lower()
    if plain in _OTHER_NAMES:
        return _OTHER_NAMES[plain]
    if loosely and len(plain) > 1:
        near = difflib.get_close_matches(plain, _OTHER_NAMES, n=1, cutoff=0.75)
        return _OTHER_NAMES[near[0]] if near else None
    return None


def read_number(name: str, text: str) -> float:
    """The value of an input from text, in SI; ``rigid`` is an infinite stiffness.

    Raises
    ------
    ValueError
        The text is not a plain number; the message states what to write.

    Examples
    --------
    >>> read_number("y0", "2e-6")
    2e-06
    >>> read_number("y0", "2um")
    Traceback (most recent call last):
    ...
    ValueError: y0=2um: give metres, 2e-6
    """
    words = SI[name][1]
    text = text.strip()
    if name == "k" and text.lower() == "rigid":
        return math.inf
    if _PLAIN.fullmatch(text):
        return float(text)
    with_unit = _WITH_UNIT.fullmatch(text)
    scale = scale_of(name, with_unit[2].strip(" []()")) if with_unit else None
    if with_unit and scale:
        value = re.sub(r"e([+-])0*", r"e\1", f"{scale.si(float(with_unit[1])):.15g}").replace("e+", "e")
        raise ValueError(f"{name}={text}: give {words}, {value}")
    if _PLAIN.fullmatch(text.replace(",", ".")):
        raise ValueError(f"{name}={text}: the decimal sign is a point, {text.replace(',', '.')}")
    hint = ", or rigid" if name == "k" else ""
    raise ValueError(f"{name}={text}: give {words} as a plain number such as 2e-6{hint}")

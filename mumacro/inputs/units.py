"""Numbers and units as text, read in SI; and hints for a text that cannot be read."""

import difflib
import math
import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from mumacro.inputs.fields import GAP, LIKE, NAMES, RAD_PER_CYCLE, SI, is_rigid


class Scale(NamedTuple):
    """A unit in SI: value * times / over.  Small powers of ten stand in ``over``: 2 um are 2 / 1e6,
    rounded once."""

    times: float = 1.0
    over: float = 1.0

    def si(self, value: float) -> float:
        """``value`` in the SI unit."""
        return value * self.times / self.over


_LENGTH = {
    "m": Scale(),
    "cm": Scale(over=1e2),
    "mm": Scale(over=1e3),
    "um": Scale(over=1e6),
    "µm": Scale(over=1e6),
    "μm": Scale(over=1e6),
    "nm": Scale(over=1e9),
    "pm": Scale(over=1e12),
    "in": Scale(254.0, 1e4),
}
_FORCE = {
    "N": Scale(),
    "mN": Scale(over=1e3),
    "uN": Scale(over=1e6),
    "kN": Scale(1e3),
    "MN": Scale(1e6),
    "lbf": Scale(4.4482216152605),
}
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
        "rad/s": Scale(),
        "1/s": Scale(),
        "krad/s": Scale(1e3),
        "rpm": Scale(RAD_PER_CYCLE, 60.0),
        "1/min": Scale(RAD_PER_CYCLE, 60.0),
        "deg/s": Scale(RAD_PER_CYCLE, 360.0),
    },
    "f": {
        "Hz": Scale(),
        "1/s": Scale(),
        "mHz": Scale(over=1e3),
        "kHz": Scale(1e3),
        "MHz": Scale(1e6),
    },
    "v0": {
        f"{length}/{time}": Scale(scale.times, scale.over * seconds)
        for length, scale in {**_LENGTH, "km": Scale(1e3)}.items()
        for time, seconds in _TIME.items()
    },
}

# Lower case, without spaces and punctuation.  Only names that hardly mean anything else, since a
# file whose column has one of them while the input itself is missing is refused.
_SYNONYMS = {
    "mu": "mu0",
    "mus": "mu0",
    "muk": "mu0",
    "mucoulomb": "mu0",
    "frictioncoefficient": "mu0",
    "coefficientoffriction": "mu0",
    "cof": "mu0",
    "µ": "mu0",
    "µ0": "mu0",
    "μ": "mu0",
    "μ0": "mu0",
    "fn": "Fz",
    "n": "Fz",
    "force": "Fz",
    "normalforce": "Fz",
    "load": "Fz",
    "normalload": "Fz",
    "kx": "k",
    "kt": "k",
    "ktangential": "k",
    "stiffness": "k",
    "tangentialstiffness": "k",
    "contactstiffness": "k",
    "y": "y0",
    "amplitude": "y0",
    "ampl": "y0",
    "amp": "y0",
    "a": "y0",
    "a0": "y0",
    "w": "omega",
    "om": "omega",
    "ω": "omega",
    "angularfrequency": "omega",
    "angularvelocity": "omega",
    "freq": "f",
    "frequency": "f",
    "hz": "f",
    "f0": "f",
    "v": "v0",
    "vx": "v0",
    "speed": "v0",
    "velocity": "v0",
    "slidingspeed": "v0",
    "slidingvelocity": "v0",
}
_SYNONYMS |= {name.lower(): name for name in NAMES}

# closing bracket -> the one that opens it
_OPENING = {"]": "[", ")": "("}
_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_WITH_UNIT = re.compile(rf"({_NUMBER})\s*([^\d\s.,+-].*)", re.ASCII)
# an interval, as people write it
_DASHED = re.compile(rf"({_NUMBER})\s*(?:-|–|to)\s*({_NUMBER})\s*(\D.*)?")
PLAIN = re.compile(rf"{_NUMBER}|[+-]?(?:nan|inf|infinity)", re.ASCII | re.IGNORECASE)


def split_unit(column: str) -> tuple[str, str | None]:
    """Name and unit of a heading such as ``k [N/mm]`` or ``k (N/mm)``; the unit is None where there
    are no brackets.

    >>> split_unit("k [N/mm]"), split_unit("v0")
    (('k', 'N/mm'), ('v0', None))
    """
    text = column.strip()
    closing = text[-1:]
    if closing not in _OPENING:
        return text, None
    name, opening, unit = text[:-1].rpartition(_OPENING[closing])
    if not opening or closing in unit:
        return text, None
    return name.strip(), unit.strip()


def scale_of(name: str, unit: str) -> Scale | None:
    """The scale of a ``unit`` of the input ``name``; None for a unit that is not in the table.

    >>> scale_of("k", "N/mm").si(3.0)
    3000.0
    """
    return _scale(UNITS_OF[LIKE.get(name, name)], unit)


def _scale(units: Mapping[str, Scale], unit: str) -> Scale | None:
    return units.get(unit.replace(" ", "").replace("·", ""))


def suggestion(name: str, *, loosely: bool = True) -> str | None:
    """The input that ``name`` probably stands for, in another case, by another name or
    (``loosely``) misspelt; else None.

    >>> [suggestion(name) for name in ("FZ", "F", "stiffness", "omga", "temperature")]
    ['Fz', 'Fz', 'k', 'omega', None]
    """
    if name.strip() == "F":  # a force; without case it would be the frequency f
        return "Fz"
    plain = re.sub(r"[\s_.\-~^*{}$\\]", "", name).lower()
    if plain in _SYNONYMS:
        return _SYNONYMS[plain]
    if loosely and len(plain) > 1:
        matches = difflib.get_close_matches(plain, _SYNONYMS, n=1, cutoff=0.75)
        return _SYNONYMS[matches[0]] if matches else None
    return None


def unknown_name(name: str, allowed: Iterable[str]) -> str:
    """Why an unknown name is refused, with the most similar one of those allowed.

    >>> unknown_name("omga", ("omega", "f"))
    'unknown field; did you mean omega? allowed: omega, f'
    """
    names = list(allowed)
    nearest = suggestion(name[:80], loosely=False)
    if nearest not in names:
        nearest = next(iter(difflib.get_close_matches(name[:80], names, n=1, cutoff=0.6)), None)
    advice = f"did you mean {nearest}? " if nearest else ""
    return f"unknown field; {advice}allowed: {', '.join(names)}"


def number_hint(name: str, value: object) -> str:
    """Why ``value`` is refused where the number of an input, or another number, should stand.

    >>> number_hint("y0", "2um")
    'must be a number: give metres, 2e-06'
    >>> number_hint("y0", "2,5")
    'must be a number with a decimal point: 2.5'
    >>> number_hint("y0", "2")
    'must be a number, not a text: leave out the quotes'
    >>> number_hint("y0", True)
    'must be a number'
    """
    if not isinstance(value, str):
        return GAP if name == "k" and value is None else "must be a number"
    text = value.strip()[:80]
    if PLAIN.fullmatch(text):
        number = float(text)
        if math.isfinite(number):
            return "must be a number, not a text: leave out the quotes"
        return "must be a number, or rigid" if name == "k" else "must be finite"
    if re.fullmatch(r"[+-]?\d+,\d+", text):
        return f"must be a number with a decimal point: {text.replace(',', '.')}"
    if name == "k" and ".." in text:
        return (
            "must be a number, or rigid; an interval is k_range in JSON, columns k_low and "
            "k_high in a file"
        )
    match = _WITH_UNIT.fullmatch(text)
    if match is None:
        return "must be a number, or rigid" if name == "k" else "must be a number"
    like = LIKE.get(name, name if name in SI else "mu0")  # another number is a plain one, too
    words, scale = SI[like][1], scale_of(like, match[2])
    if scale is None:
        return f"must be a number without a unit: give {words}"
    return f"must be a number: give {words}, {scale.si(float(match[1])):.12g}"


def read_number(name: str, text: str) -> float:
    """The value of an input from text, a number in SI or with a unit, in SI; ``rigid`` is an
    infinite stiffness.

    >>> read_number("y0", "2e-6"), read_number("k", "1 N/um")
    (2e-06, 1000000.0)
    >>> read_number("y0", "2 N")
    Traceback (most recent call last):
    ...
    ValueError: y0=2 N: give metres as a plain number, or with a unit: m, cm, mm, um, ...
    """
    like = LIKE.get(name, name)
    return read_quantity(name, text, SI[like][1], UNITS_OF[like], rigid=name == "k")


def read_quantity(
    name: str, text: str, words: str, units: Mapping[str, Scale], *, rigid: bool = False
) -> float:
    """As :func:`read_number`, of any quantity: ``words`` for its SI unit, its ``units``, whether
    it may be ``rigid``."""
    text = text.strip()
    if rigid and is_rigid(text):
        return math.inf
    if PLAIN.fullmatch(text):
        return float(text)
    with_unit = _WITH_UNIT.fullmatch(text)
    scale = _scale(units, with_unit[2].strip(" []()")) if with_unit else None
    if with_unit and scale:
        return scale.si(float(with_unit[1]))
    if PLAIN.fullmatch(text.replace(",", ".")):
        raise ValueError(f"{name}={text}: the decimal sign is a point, {text.replace(',', '.')}")
    if hint := _hint(name, text, units):
        raise ValueError(f"{name}={text}: {hint}")
    examples = ", ".join([unit for unit in units if unit][:4])
    or_rigid = ", or rigid" if rigid else ""
    raise ValueError(
        f"{name}={text}: give {words} as a plain number, or with a unit: {examples}, ...{or_rigid}"
    )


def _hint(name: str, text: str, units: Mapping[str, Scale]) -> str | None:
    """A hint for a text that is no quantity: how an interval is written, a unit in another case, f
    in place of omega.

    >>> _hint("k", "0.8-1.2N/um", UNITS_OF["k"]), _hint("omega", "20kHz", UNITS_OF["omega"])
    ('write an interval as k=0.8..1.2N/um', 'did you mean f=20kHz? omega is in rad/s')
    """
    if name == "k" and (ends := _DASHED.fullmatch(text)):
        return f"write an interval as k={ends[1]}..{ends[2]}{ends[3] or ''}"
    if not (match := _WITH_UNIT.fullmatch(text)):
        return None
    number, unit = match[1], match[2].replace(" ", "")
    symbols = [symbol for symbol in units if symbol.lower() == unit.lower()]
    partner = {"omega": "f", "f": "omega"}.get(name)
    if symbols:
        return f"did you mean {' or '.join(f'{number}{symbol}' for symbol in symbols)}?"
    if partner and (
        partner_unit := next(
            (symbol for symbol in UNITS_OF[partner] if symbol.lower() == unit.lower()), None
        )
    ):
        return f"did you mean {partner}={number}{partner_unit}? {name} is in {SI[name][0]}"
    return None


def read_range(name: str, text: str) -> tuple[float, float]:
    """Both ends of ``low..high`` in SI; a unit behind the second end holds for both.  ValueError as
    in read_number.

    >>> read_range("k", "0.8..1.2 N/um")
    (800000.0, 1200000.0)
    """
    low, _, high = text.partition("..")
    plain = [PLAIN.fullmatch(end.strip()) for end in (low, high)]  # 1.2e6 is not 1.2 of a unit e6
    if plain[0] and not plain[1] and (match := _WITH_UNIT.fullmatch(high.strip())):
        low = f"{low} {match[2]}"
    ends = read_number(name, low), read_number(name, high)
    if not 0.0 < ends[0] < ends[1] < math.inf:
        raise ValueError(f"{name}={text}: the ends of a range must be > 0, finite and ascending")
    return ends

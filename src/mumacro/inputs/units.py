"""Hold the table of units.  Read a unit as text, find its scale, explain a unit that a quantity
cannot have, and show numbers in a unit."""

import functools
import math
import re
from collections.abc import Mapping
from typing import NamedTuple, TypeVar

import numpy as np

from mumacro.inputs.fields import QUANTITY_OF, RAD_PER_CYCLE, SI
from mumacro.inputs.numbers import TOO_LARGE, tidy
from mumacro.kernel.arrays import Array

#: one number, or an array of numbers
Number = TypeVar("Number", float, Array)


class Scale(NamedTuple):
    """Hold the size of a unit in SI: value * times / over.  Small powers of ten are in ``over``: 2
    um are 2 / 1e6, rounded once."""

    times: float = 1.0
    over: float = 1.0

    def si(self, value: Number) -> Number:
        """Return a number, or an array, in the SI unit; infinite if it is too large."""
        return value * self.times / self.over

    def of_si(self, value: float) -> float:
        """Return ``value``, which is in SI, in this unit."""
        return value * self.over / self.times


class Unit(NamedTuple):
    """Hold a unit: its symbol in the table, and its size."""

    symbol: str
    scale: Scale = Scale()


class Quantity(NamedTuple):
    """Describe what a value measures."""

    unit: str  #: unit in SI
    words: str  #: the unit in words, for errors such as "give metres"
    units: Mapping[str, Scale]
    such_as: str  #: some of the units, for messages

    @property
    def bound(self) -> str:
        """Return what a text must be, as in "y0 must be ..."."""
        where = "" if self.unit == "-" else f"in {self.words}: "
        return f"{where}a plain number, or with a unit such as {self.such_as}"


_LENGTH = {
    "m": Scale(),
    "dm": Scale(over=1e1),
    "cm": Scale(over=1e2),
    "mm": Scale(over=1e3),
    "um": Scale(over=1e6),
    "nm": Scale(over=1e9),
    "pm": Scale(over=1e12),
    "Å": Scale(over=1e10),
    "in": Scale(254.0, 1e4),
    "ft": Scale(3048.0, 1e4),
    "mil": Scale(254.0, 1e7),
}
_FORCE = {
    "N": Scale(),
    "pN": Scale(over=1e12),
    "nN": Scale(over=1e9),
    "uN": Scale(over=1e6),
    "mN": Scale(over=1e3),
    "cN": Scale(over=1e2),
    "daN": Scale(1e1),
    "kN": Scale(1e3),
    "MN": Scale(1e6),
    "GN": Scale(1e9),
    "gf": Scale(9.80665, 1e3),
    "kgf": Scale(9.80665),
    "lbf": Scale(4.4482216152605),
    "ozf": Scale(4.4482216152605, 16.0),
    "dyn": Scale(over=1e5),
}
_TIME = {
    "s": Scale(),
    "ms": Scale(over=1e3),
    "us": Scale(over=1e6),
    "min": Scale(60.0),
    "h": Scale(3600.0),
}
_FREQUENCY = {
    "Hz": Scale(),
    "mHz": Scale(over=1e3),
    "kHz": Scale(1e3),
    "MHz": Scale(1e6),
    "GHz": Scale(1e9),
    "1/s": Scale(),
    "1/min": Scale(over=60.0),
    "rpm": Scale(over=60.0),
    "rev/s": Scale(),
    "rev/min": Scale(over=60.0),
}


def _over(upper: Mapping[str, Scale], lower: Mapping[str, Scale]) -> dict[str, Scale]:
    """Return every unit of ``upper`` divided by every unit of ``lower``."""
    return {
        f"{one}/{other}": Scale(up.times * down.over, up.over * down.times)
        for one, up in upper.items()
        for other, down in lower.items()
    }


#: quantity -> its units; the only table of units
QUANTITIES = {
    "ratio": Quantity(
        "-",
        "a plain number",
        {"-": Scale(), "1": Scale(), "": Scale(), "%": Scale(over=1e2), "‰": Scale(over=1e3)},
        "%",
    ),
    "force": Quantity("N", "newtons", _FORCE, "N, mN, kN, gf, kgf, lbf"),
    "stiffness": Quantity(
        "N/m",
        "newtons per metre",
        _over(_FORCE, _LENGTH),
        "N/m, N/mm, N/um, lbf/in: a force over a length",
    ),
    "length": Quantity("m", "metres", _LENGTH, "m, mm, um, nm, in, mil"),
    "angular frequency": Quantity(
        "rad/s",
        "radians per second",
        {
            "rad/s": Scale(),
            "1/s": Scale(),
            "mrad/s": Scale(over=1e3),
            "krad/s": Scale(1e3),
            "Mrad/s": Scale(1e6),
            "rpm": Scale(RAD_PER_CYCLE, 60.0),
            "1/min": Scale(RAD_PER_CYCLE, 60.0),
            "rad/min": Scale(over=60.0),
            "deg/s": Scale(RAD_PER_CYCLE, 360.0),
            "rev/s": Scale(RAD_PER_CYCLE),
            "rev/min": Scale(RAD_PER_CYCLE, 60.0),
        },
        "rad/s, krad/s, rpm, deg/s; a frequency in Hz is f",
    ),
    "frequency": Quantity("Hz", "hertz", _FREQUENCY, "Hz, kHz, MHz, rpm"),
    "speed": Quantity(
        "m/s",
        "metres per second",
        {**_over({**_LENGTH, "km": Scale(1e3)}, _TIME), "mph": Scale(44704.0, 1e5)},
        "m/s, mm/s, um/s, mm/min, km/h",
    ),
    "angle": Quantity(
        "deg",
        "degrees",
        {
            "deg": Scale(),
            "°": Scale(),
            "rad": Scale(360.0, RAD_PER_CYCLE),
            "mrad": Scale(360.0, 1e3 * RAD_PER_CYCLE),
        },
        "deg, rad",
    ),
    "pressure": Quantity(
        "Pa",
        "pascals",
        {
            "Pa": Scale(),
            "kPa": Scale(1e3),
            "MPa": Scale(1e6),
            "GPa": Scale(1e9),
            "TPa": Scale(1e12),
            "N/m2": Scale(),
            "N/mm2": Scale(1e6),
            "kN/mm2": Scale(1e9),
            "bar": Scale(1e5),
            "psi": Scale(6894.757293168361),
            "ksi": Scale(6894757.293168361),
            "Mpsi": Scale(6894757293.168361),
        },
        "Pa, MPa, GPa, N/mm2, psi",
    ),
}
#: input -> unit -> scale
UNITS_OF = {name: QUANTITIES[QUANTITY_OF[name]].units for name in SI}

#: SI unit -> units in which a value is shown, the largest first
_SHOWN: dict[str, dict[str, Scale]] = {
    QUANTITIES[quantity].unit: {unit: QUANTITIES[quantity].units[unit] for unit in units}
    for quantity, units in {
        "force": ("MN", "kN", "N", "mN", "uN", "nN"),
        "stiffness": ("N/nm", "N/um", "kN/m", "N/m", "mN/m"),
        "length": ("m", "mm", "um", "nm", "pm"),
        "angular frequency": ("Mrad/s", "krad/s", "rad/s", "mrad/s"),
        "frequency": ("GHz", "MHz", "kHz", "Hz", "mHz"),
        "speed": ("m/s", "mm/s", "um/s", "nm/s"),
    }.items()
} | {
    "s": {"s": Scale(), "ms": Scale(over=1e3), "us": Scale(over=1e6), "ns": Scale(over=1e9)},
    "W": {
        "kW": Scale(1e3),
        "W": Scale(),
        "mW": Scale(over=1e3),
        "uW": Scale(over=1e6),
        "nW": Scale(over=1e9),
    },
}


def suit_unit(si: str, value: float) -> Unit:
    """Return a unit in which a value in the unit ``si`` is easy to read: the largest of the common
    units in which it is at least 0.1; the SI unit for 0.

    >>> suit_unit("m", 2.455e-6).symbol, suit_unit("N/m", 13.07e6).symbol
    ('um', 'N/um')
    """
    usual, size = [Unit(*one) for one in _SHOWN.get(si, {}).items()], abs(value)
    if not usual or size == 0.0 or not math.isfinite(size):
        return Unit(si)
    return next((unit for unit in usual if size >= 0.1 * unit.scale.si(1.0)), usual[-1])


def in_si(values: Array, scale: Scale) -> Array:
    """Return the numbers of an array in SI, NaN for a number that is too large, because a large
    stiffness is not a rigid contact.

    >>> in_si(np.array([2.0, 1e308]), Scale(times=1e3))
    array([2000.,   nan])
    """
    if scale == Scale():
        return values
    with np.errstate(over="ignore"):
        si: Array = scale.si(values)
    return np.where(np.isinf(si) & np.isfinite(values), math.nan, si)


def checked_in_si(values: Array, scale: Scale) -> tuple[Array, dict[int, str]]:
    """Return the same, and the faults of the numbers that are too large, by their index."""
    si = in_si(values, scale)
    if si is values:
        return si, {}
    places = np.flatnonzero(np.isnan(si) & ~np.isnan(values))
    return si, dict.fromkeys(places.tolist(), TOO_LARGE)


# --- a unit as people and programs write it -------------------------------------------------------

# words of a unit, in lower case -> their symbols
_PREFIXES = {"": "", "pico": "p", "nano": "n", "micro": "u", "milli": "m", "centi": "c"}
_PREFIXES |= {"deci": "d", "deca": "da", "kilo": "k", "mega": "M", "giga": "G", "tera": "T"}
_BASES = {"metre": "m", "meter": "m", "newton": "N", "hertz": "Hz", "pascal": "Pa"}
_BASES |= {"second": "s", "radian": "rad"}
#: names of a unit, in lower case -> its symbol
_NAMED = {
    f"{prefix}{base}{plural}": short + symbol
    for prefix, short in _PREFIXES.items()
    for base, symbol in _BASES.items()
    for plural in ("", "s")
} | {
    name: symbol
    for symbol, names in {
        "s": "sec secs",
        "min": "minute minutes",
        "h": "hr hour hours",
        "um": "micron microns",
        "Å": "angstrom angstroms",
        "in": "inch inches",
        "ft": "foot feet",
        "mil": "mils thou",
        "kgf": "kp force_kilogram kilogram_force kilopond",
        "gf": "gram_force force_gram",
        "lbf": "force_pound pound_force",
        "ozf": "force_ounce ounce_force",
        "dyn": "dyne",
        "deg": "degree degrees",
        "%": "percent pct",
        "‰": "permille",
        "rev": "revolution revolutions turn turns cycle cycles",
        "km/h": "kmh kph",
        "in/s": "ips",
        "rpm": "revolutions_per_minute revolution_per_minute",
    }.items()
    for name in names.split()
}
_FACTOR = re.compile(r"([^\d^+-]+)\^?([+-]?\d)?", re.ASCII)
_MU = str.maketrans("µμ", "uu")
LONGEST = 80  # limit of the characters of a unit


@functools.lru_cache(1024)
def canonical(unit: str) -> str:
    """Return a unit in the spelling of the table.

    >>> [canonical(unit) for unit in ("mm s^-1", "mm/sec", "N·mm⁻¹", "newton / micrometer", "[N]")]
    ['mm/s', 'mm/s', 'N/mm', 'N/um', 'N']
    """
    text = tidy(unit[:LONGEST]).translate(_MU).strip(" []()")
    if text.lower() == "dimensionless":
        return ""
    text = text.replace(" per ", "/")
    for times in "*·⋅.":
        text = text.replace(times, " ")
    powers: dict[str, int] = {}
    for i, part in enumerate(text.split("/")):
        factors = part.replace("(", " ").replace(")", " ").split()
        if factors == ["1"] and i == 0:  # of 1/s
            continue
        for factor in factors:
            match = _FACTOR.fullmatch(factor)
            if match is None or match[2] in ("0", "+0", "-0"):
                return text
            name = match[1]
            symbol = name if name in _SYMBOLS else _NAMED.get(name.lower(), name)
            powers[symbol] = powers.get(symbol, 0) + int(match[2] or 1) * (-1 if i else 1)
    upper, lower = (
        " ".join(
            f"{name}{abs(power) if abs(power) > 1 else ''}"
            for name, power in powers.items()
            if power * sign > 0
        )
        for sign in (1, -1)
    )
    return f"{upper or '1'}/{lower}" if lower else upper or text


#: every symbol in the table, also within another one
_SYMBOLS = {
    symbol
    for quantity in QUANTITIES.values()
    for unit in quantity.units
    for symbol in unit.split("/")
}


# words that belong to the value before them: of its unit, of an interval, of how an amplitude was
# measured
_WORDS = {"per", "to", "rms", "pp", "p-p", "pk-pk", "ptp", "peak", "peak-to-peak"}


def belongs_to_value(word: str) -> bool:
    """Return whether a word after a value is a part of it, such as a separate unit.

    >>> [belongs_to_value(word) for word in ("um", "±", "1.2", "/", "newtons", "fast")]
    [True, True, True, True, True, False]
    """
    plain = word.translate(_MU).strip("[](),;")
    return (
        plain in _SYMBOLS
        or plain.lower() in _NAMED
        or plain.lower() in _WORDS
        or any(sign in "0123456789±%°/^*·" for sign in plain)
        or ".." in plain
        or plain in ("+-", "-", "–")
    )


# an amplitude in the terms of vibration measurement: from zero to the peak
_PEAK = re.compile(r"(.*?\w) ?(?:0-?|zero[ -]to[ -])?(?:peak|pk|(?<=0)-?p)", re.IGNORECASE)


def parse_unit(quantity: str, text: str) -> Unit | None:
    """Return a unit of a quantity, or None if it is not in the table.  The unit of a length may say
    that the value is an amplitude.

    >>> parse_unit("speed", "mm sec^-1"), parse_unit("length", "um 0-pk").symbol
    (Unit(symbol='mm/s', scale=Scale(times=1.0, over=1000.0)), 'um')
    >>> parse_unit("length", "umpp") is None
    True
    """
    units = QUANTITIES[quantity].units
    if text in units:
        return Unit(text, units[text])
    if len(text) > LONGEST:
        return None
    symbol = canonical(text)
    if quantity == "length" and (match := _PEAK.fullmatch(text.strip(" []()"))) is not None:
        of_length = canonical(match[1])
        symbol = of_length if of_length in units else symbol
    return Unit(symbol, units[symbol]) if symbol in units else None


def quantity_of(name: str) -> str:
    """Return the quantity of an input, of its deviation, of a part of an oscillation, or of another
    argument, by its name.  The default is a ratio.

    >>> [quantity_of(name) for name in ("v0", "std_k", "normal.amplitude", "y.phase")]
    ['speed', 'stiffness', 'force', 'angle']
    """
    part, _, member = name.removeprefix("std_").partition(".")
    return QUANTITY_OF.get("phase" if member == "phase" else part, "ratio")


def scale_of(name: str, unit: str) -> Scale | None:
    """Return the size of a ``unit`` of a value by its name, or None if the unit is not in the
    table.

    >>> scale_of("k", "N/mm").si(3.0)
    3000.0
    """
    parsed = parse_unit(quantity_of(name), unit)
    return None if parsed is None else parsed.scale


def unit_of(name: str) -> str:
    """Return the SI unit of a value by its name; degrees for a phase.

    >>> [unit_of(name) for name in ("k_low", "mu_macro", "x.amplitude", "y.phase")]
    ['N/m', '-', 'm', 'deg']
    """
    return QUANTITIES[quantity_of(name)].unit


# --- what is meant by a unit that a quantity cannot have ------------------------------------------

_MASS = {
    "mg": 1e-6,
    "g": 1e-3,
    "kg": 1.0,
    "lb": 0.45359237,
    "lbs": 0.45359237,
    "oz": 0.028349523125,
}
_GRAVITY = 9.80665  # m/s^2
_ACCELERATION = {"g": _GRAVITY, "m/s2": 1.0, "mm/s2": 1e-3}
_WHOLE = ("peak to peak", "peaktopeak", "pkpk", "p2p", "ptp", "pp", "ss")
_LEVELS = ("db", "decibel", "bel", "neper")
_OTHER = {"angular frequency": "frequency", "frequency": "angular frequency"}
_INPUT = {"frequency": "f", "angular frequency": "omega", "speed": "v0", "length": "y0"}


def is_level(unit: str) -> bool:
    """Return whether a unit is a level, such as dB, whose reference is not stated."""
    words = re.split(r"[^a-z]+", unit[:LONGEST].lower())
    return any(word.rstrip("s") in _LEVELS or word.startswith("db") for word in words)


def explain_unit(quantity: str, number: float, unit: str) -> str:
    """Return what a value must be if its quantity cannot have ``unit``, as in "y0 must be ...",
    with the number to give if it is clear what is meant.

    >>> explain_unit("length", 4.0, "umpp"), explain_unit("force", 100.0, "g")
    ('half of peak to peak: give 2um', 'a force: the weight of 100 g is 0.980665 N, give 0.980665N')
    >>> explain_unit("angular frequency", 20.0, "kHz")
    'in radians per second: did you mean f=20kHz?'
    """
    about, text = QUANTITIES[quantity], unit.strip()[:LONGEST]
    plain = "".join(sign for sign in text.lower() if sign not in "-_. ()[]")
    for ending in _WHOLE:
        size = ending.replace(" ", "")
        if plain.endswith(size) and quantity in ("length", "force"):
            rest = plain.removesuffix(size)
            mine = next((u for u in about.units if u.lower() == canonical(rest).lower()), None)
            if mine is not None or not rest:
                return f"half of peak to peak: give {0.5 * number:.12g}{mine or ''}"
    if plain.endswith("rms") and quantity in ("length", "force"):
        mine = next((u for u in about.units if u.lower() == canonical(plain[:-3]).lower()), None)
        if mine is not None:
            return (
                f"the amplitude, of a sine {math.sqrt(2.0):.6g} times its rms value: give "
                f"{math.sqrt(2.0) * number:.12g}{mine}"
            )
    if is_level(text):
        return "the value itself: the reference of a level in dB is not known"
    key = canonical(text)
    if quantity == "stiffness" and key in QUANTITIES["pressure"].units:
        return "a force over a length: k from materials computes it from a modulus and the bodies"
    if quantity == "force" and key in _MASS:
        newtons = number * _MASS[key] * _GRAVITY
        return (
            f"a force: the weight of {number:.12g} {key} is {newtons:.12g} N, give {newtons:.12g}N"
        )
    if quantity == "length" and key in _ACCELERATION:
        peak = number * _ACCELERATION[key]
        return f"a length: of an acceleration give {peak:.12g}/(2 pi f)^2 metres, f in hertz"
    if quantity == "length" and (speed := QUANTITIES["speed"].units.get(key)) is not None:
        return f"a length: of a velocity amplitude give {speed.si(number):.12g}/(2 pi f) metres"
    if quantity == "speed" and (turns := QUANTITIES["angular frequency"].units.get(key)):
        return f"a speed: give {turns.si(number):.12g} m/s times the radius in metres"
    if text in ("k", "M", "G") and (remedy := text + about.unit) in about.units:
        return f"in {about.words}: did you mean {number:.12g}{remedy}?"
    lower = key.lower()
    if alike := [symbol for symbol in about.units if symbol and symbol.lower() == lower]:
        remedy = " or ".join(f"{number:.12g}{symbol}" for symbol in alike)
        return f"in {about.words}: did you mean {remedy}?"
    if (other := _OTHER.get(quantity)) is not None:
        units = QUANTITIES[other].units
        if mine := next((symbol for symbol in units if symbol.lower() == lower), None):
            return f"in {about.words}: did you mean {_INPUT[other]}={number:.12g}{mine}?"
    return about.bound


# --- numbers in a unit ----------------------------------------------------------------------------


def known(value: float, digits: int, error: float = 0.0, deviation: float = 0.0) -> str:
    """Return a number with ``digits`` digits, or fewer: no digit is below the first digit of its
    ``error``, or below the second digit of its ``deviation``.

    >>> known(0.24046650645751835, 6), known(0.24046650645751835, 6, deviation=0.0136)
    ('0.240467', '0.240')
    >>> known(-3.7e-10, 6, error=2e-7), known(0.2, 6, error=8e-3)
    ('0', '0.200')
    """
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    if 0.0 < error < math.inf:
        places = min(places, -math.floor(math.log10(error)))
    if 0.0 < deviation < math.inf:
        places = min(places, 1 - math.floor(math.log10(deviation)))
    rounded = round(value, places)
    if rounded == 0.0:
        return "0"
    count = max(places + 1 + math.floor(math.log10(abs(rounded))), 1)
    return f"{rounded:#.{count}g}".removesuffix(".")


def plain(value: float, digits: int) -> str:
    """Return a number for a sentence, without a power of ten if it has up to twelve digits.

    >>> plain(20618.6, 3), plain(251.3, 2), plain(0.00103, 3), plain(2e15, 3)
    ('20600', '250', '0.00103', '2e+15')
    """
    return f"{float(f'{value:.{digits}g}'):.12g}"


def choose_unit(name: str, value: float, typed: Mapping[str, str]) -> Unit:
    """Return the unit in which an input is shown: the unit that was typed, or a suitable one for a
    value [SI].

    >>> choose_unit("y0", 2e-6, {}).symbol, choose_unit("y0", 2e-6, {"y0": "mm"}).symbol
    ('um', 'mm')
    """
    parsed = parse_unit(quantity_of(name), typed[name]) if name in typed else None
    return parsed or suit_unit(unit_of(name), value)


def format_number(value: float, unit: Unit, count: int, error: float = 0.0) -> str:
    """Return a value [SI] as a number of a unit, with ``count`` digits, or fewer if its ``error``
    does not support them."""
    return known(unit.scale.of_si(value), count, unit.scale.of_si(error))


def format_quantity(value: float, unit: Unit, count: int) -> str:
    """Return the number with the unit.

    >>> format_quantity(2.4547623e-6, suit_unit("m", 2.4547623e-6), 4)
    '2.455 um'
    """
    return f"{format_number(value, unit, count)} {unit.symbol}"


def tidy_zeros(text: str) -> str:
    """Return a number without zeros at its end.

    >>> [tidy_zeros(text) for text in ("2.500", "100", "1.0e-07", "2.0")]
    ['2.5', '100', '1e-07', '2']
    """
    mantissa, e, exponent = text.partition("e")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    return f"{mantissa}{e}{exponent}"

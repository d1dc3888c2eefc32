"""The inputs of a case, one row each: name, symbol, unit, meaning, bound, usual range, example.

The library, the files, the command line, the service, the page and the exports take the words for
an input from here.  A frequency ``f`` [Hz] may be given in place of the angular frequency ``omega``
[rad/s], exactly one of them.  The stiffness ``k`` has no default: it is a positive number, or rigid
contact by the word ``rigid`` or by infinity.

**A gap is never rigid**: a single None or NaN is refused, an empty cell, null or NaN in a column
``k`` makes its case illegal, see :data:`GAP`.
"""

import math
import sys
from typing import NamedTuple

RAD_PER_CYCLE = 2.0 * math.pi  # omega [rad/s] at f = 1 Hz
RIGID = "rigid"  # the word for a stiffness without bound
GAP = "is missing; write rigid or a number"  # the reason for refusing a gap in a column k
#: what a stiffness must be, in messages of :class:`InputError`
STIFFNESS = 'a number > 0 [N/m], or for a rigid contact "rigid" or math.inf'
MOST_HZ = sys.float_info.max / RAD_PER_CYCLE  # above, omega is beyond double range
NOT_NEGATIVE, ABOVE_ZERO = "finite and >= 0", "finite and > 0"
LIFTS_OFF = ">= 0 and below Fz: at Fz the contact lifts off"  # the bound of Fz_amplitude in a case


class Field(NamedTuple):
    """One input."""

    name: str
    symbol: str  #: in formulas and pictures
    quantity: str  #: what it measures, a key of :data:`mumacro.inputs.units.QUANTITIES`
    unit: str  #: in SI
    words: str  #: the unit in words, for errors such as "give metres"
    meaning: str
    bound: str  #: what every value must satisfy
    usual: tuple[float, float]  #: outside there is a remark; zero is usual where it is legal
    example: str  #: as a person types it: the first case of the documentation
    in_place_of: str = ""  #: another input, where this one stands for it


_ROWS = (
    Field(
        "mu0", "µ₀", "ratio", "-", "a plain number",
        "Coulomb friction coefficient of the contact", ABOVE_ZERO, (1e-3, 2.0), "0.3",
    ),
    Field(
        "Fz", "Fz", "force", "N", "newtons",
        "Normal force", ABOVE_ZERO, (1e-6, 1e6), "10N",
    ),
    Field(
        "k", "k", "stiffness", "N/m", "newtons per metre",
        "Tangential stiffness of the contact", ABOVE_ZERO, (1.0, 1e12), "1N/um",
    ),
    Field(
        "y0", "y₀", "length", "m", "metres",
        "Amplitude of the oscillation, half of peak to peak", NOT_NEGATIVE, (1e-12, 2e-2), "2um",
    ),
    Field(
        "omega", "ω", "angular frequency", "rad/s", "radians per second",
        "Angular frequency of the oscillation", NOT_NEGATIVE,
        (RAD_PER_CYCLE * 1e-3, RAD_PER_CYCLE * 1e8), "1.3e5rad/s",
    ),
    Field(
        "f", "f", "frequency", "Hz", "hertz",
        "Frequency of the oscillation", NOT_NEGATIVE, (1e-3, 1e8), "20kHz", "omega",
    ),
    Field(
        "v0", "v₀", "speed", "m/s", "metres per second",
        "Sliding speed", NOT_NEGATIVE, (0.0, 300.0), "10mm/s",
    ),
    Field(
        "Fz_amplitude", "ΔFz", "force", "N", "newtons",
        "Amplitude of the normal force, half of peak to peak, below Fz", NOT_NEGATIVE,
        (1e-6, 1e6), "3N", "y0",
    ),
    Field(
        "k_low", "k_low", "stiffness", "N/m", "newtons per metre",
        "Lowest stiffness of an interval, beside k_high", ABOVE_ZERO, (1.0, 1e12), "0.8N/um", "k",
    ),
    Field(
        "k_high", "k_high", "stiffness", "N/m", "newtons per metre",
        "Highest stiffness of an interval, beside k_low", ABOVE_ZERO, (1.0, 1e12), "1.2N/um", "k",
    ),
)  # fmt: skip
ENDS = ("k_low", "k_high")  # of an interval of k
#: every input by its name
INPUTS = {row.name: row for row in _ROWS}

#: names of inputs, and the SI unit in words, for errors such as "give metres"
SI = {row.name: (row.unit, row.words) for row in _ROWS if row.in_place_of in ("", "omega")}
#: inputs in place of another one -> the input whose unit they have: the amplitude of the normal
#: force, the ends of k
LIKE = {"Fz_amplitude": "Fz", "k_low": "k", "k_high": "k"}
NAMES = tuple(SI)
FIELDS = tuple(name for name in NAMES if name != "f")
UNITS = {name: SI[name][0] for name in FIELDS}
# of a slope along each
PER_UNIT = {"mu0": "-", "Fz": "1/N", "k": "m/N", "y0": "1/m", "omega": "s/rad", "v0": "s/m"}
POSITIVE = tuple(row.name for row in _ROWS if row.bound == ABOVE_ZERO)
BOUNDS = {row.name: row.bound for row in _ROWS}
#: other values that are read -> what they measure
QUANTITY_OF = {row.name: row.quantity for row in _ROWS} | {
    "mu_macro": "ratio",
    "target": "ratio",
    "stiffness_exponent": "ratio",
    "tolerance": "ratio",
    "v_tilde": "ratio",
    "y_tilde": "ratio",
    "nu": "ratio",
    "nu2": "ratio",
    "E": "pressure",
    "E2": "pressure",
    "radius": "length",
    "diameter": "length",
    "length": "length",
    "dx": "length",
    "dy": "length",
    "x": "length",
    "y": "length",
    "normal": "force",
    "Ft": "force",
    "phase": "angle",
    "v_rest": "speed",
    "stiffness": "stiffness",
}


def is_rigid(text: object) -> bool:
    """Return whether a text says that the contact is rigid.

    >>> is_rigid(" Rigid "), is_rigid(""), is_rigid(1.0)
    (True, False, False)
    """
    return isinstance(text, str) and text.strip().lower() == RIGID


def unit_of(name: str) -> str:
    """Return the SI unit of an input, or of one in its place.

    >>> unit_of("k_low"), unit_of("f")
    ('N/m', 'Hz')
    """
    return INPUTS[name].unit


def described(name: str, more: str = "") -> str:
    """Return what an input is, with its unit, as descriptions have it.

    >>> described("v0"), described("f", ", in place of omega")
    ('Sliding speed [m/s]', 'Frequency of the oscillation [Hz], in place of omega')
    """
    return f"{INPUTS[name].meaning} [{unit_of(name)}]{more}"


def in_help(name: str) -> str:
    """Return the same within a sentence, with the bound.

    >>> in_help("mu0"), in_help("v0")
    ('Coulomb friction coefficient of the contact [-], > 0', 'sliding speed [m/s], >= 0')
    """
    text = described(name)
    text = text if text.startswith("Coulomb") else text[0].lower() + text[1:]
    return f"{text}, {BOUNDS[name].removeprefix('finite and ')}"


def field_of(name: str) -> tuple[str, float]:
    """Return the field behind the name of an input, and its value for one unit of the name.

    >>> field_of("f"), field_of("y0")
    (('omega', 6.283185307179586), ('y0', 1.0))
    """
    return ("omega", RAD_PER_CYCLE) if name == "f" else (name, 1.0)


def refusal(name: str, value: float) -> str:
    """Return why ``value`` is no legal value of an input; NaN stands for a gap, which is never a
    rigid contact.

    >>> refusal("v0", -1.0), refusal("k", math.nan)
    ('must be finite and >= 0', 'is missing; write rigid or a number')
    """
    if name == "Fz_amplitude":
        return f"must be {LIFTS_OFF}"
    if name == "k":
        return GAP if math.isnan(value) else "must be finite and > 0, or rigid"
    if name == "f":
        return f"must be {BOUNDS['omega']}, and so must be omega = 2 pi f"
    return f"must be {BOUNDS[name]}"

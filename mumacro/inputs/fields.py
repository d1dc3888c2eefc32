"""The six inputs of a case: names, units, bounds, and the inputs in their place.

The library, the files, the command line, the service and the exports take their fields from here.
A frequency ``f`` [Hz] may be given in place of the angular frequency ``omega`` [rad/s], exactly one
of them.  The stiffness ``k`` has no default: it is a positive number, or rigid contact by the word
``rigid`` or by infinity.

**A gap is never rigid**: a single None or NaN is refused, an empty cell, null or NaN in a column
``k`` makes its case illegal, see :data:`GAP`.
"""

import math
import sys

#: names of inputs, and the SI unit in words, for errors such as "give metres"
SI = {
    "mu0": ("-", "a plain number"),
    "Fz": ("N", "newtons"),
    "k": ("N/m", "newtons per metre"),
    "y0": ("m", "metres"),
    "omega": ("rad/s", "radians per second"),
    "f": ("Hz", "hertz"),
    "v0": ("m/s", "metres per second"),
}
#: inputs in place of another one -> the input whose unit they have: the amplitude of the normal
#: force, the ends of k
LIKE = {"Fz_amplitude": "Fz", "k_low": "k", "k_high": "k"}
NAMES = tuple(SI)
FIELDS = tuple(name for name in NAMES if name != "f")
UNITS = {name: SI[name][0] for name in FIELDS}
# of a slope along each
PER_UNIT = {"mu0": "-", "Fz": "1/N", "k": "m/N", "y0": "1/m", "omega": "s/rad", "v0": "s/m"}
POSITIVE = ("mu0", "Fz", "k", "k_low", "k_high")
BOUNDS = {
    name: "finite and > 0" if name in POSITIVE else "finite and >= 0" for name in (*NAMES, *LIKE)
}
RAD_PER_CYCLE = 2.0 * math.pi  # omega [rad/s] at f = 1 Hz
RIGID = "rigid"  # the word for a stiffness without bound
GAP = "is missing; write rigid or a number"  # the reason for refusing a gap in a column k
#: what a stiffness must be, in messages of :class:`InputError`
STIFFNESS = 'a number > 0 [N/m], or for a rigid contact "rigid" or math.inf'
MOST_HZ = sys.float_info.max / RAD_PER_CYCLE  # above, omega is beyond double range


def is_rigid(text: str) -> bool:
    """Whether a text says that the contact is rigid.

    >>> is_rigid(" Rigid "), is_rigid("")
    (True, False)
    """
    return text.strip().lower() == RIGID


def unit_of(name: str) -> str:
    """The SI unit of an input, or of one in its place.

    >>> unit_of("k_low"), unit_of("f")
    ('N/m', 'Hz')
    """
    return SI[LIKE.get(name, name)][0]


def field_of(name: str) -> tuple[str, float]:
    """The field behind the name of an input, and its value for one unit of the name.

    >>> field_of("f"), field_of("y0")
    (('omega', 6.283185307179586), ('y0', 1.0))
    """
    return ("omega", RAD_PER_CYCLE) if name == "f" else (name, 1.0)


def refusal(name: str, value: float) -> str:
    """Why ``value`` is no legal value of an input; NaN stands for a gap, which is never a rigid
    contact.

    >>> refusal("v0", -1.0), refusal("k", math.nan)
    ('must be finite and >= 0', 'is missing; write rigid or a number')
    """
    if name == "k":
        return GAP if math.isnan(value) else "must be finite and > 0, or rigid"
    if name == "f":
        return f"must be {BOUNDS['omega']}, and so must be omega = 2 pi f"
    return f"must be {BOUNDS[name]}"

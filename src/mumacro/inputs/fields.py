"""List the inputs of a case, one row each: name, symbol, unit, meaning, bound, usual range,
example.  List also the contacts and the directions of the oscillation, and the types of arguments
for type checkers.

The library, the files, the command line, the service, the page and the exports take the words for
an input from here.  A frequency ``f`` [Hz] may replace the angular frequency ``omega`` [rad/s];
exactly one of them is necessary.  The stiffness ``k`` has no default: it is a positive number, or a
rigid contact by the word ``rigid`` or by infinity.

**A gap is never rigid**: a single None or NaN is refused.  An empty cell, null or NaN in a column
``k`` makes its case illegal, see :data:`GAP`.

The default is one spring, shaken across.  ``contact="ball"`` is a sphere on a flat, Hertz under a
constant load, as independent springs (method of dimensionality reduction): mu~(v~, y~) = (3/2)
int_0^1 s mu~_spring(v~/(1.5 s), y~/(1.5 s)) d xi with s = 1 - xi^2 and l0 = mu0 Fz / k, where k = 8
a G* is the stiffness before slip.  ``direction="along"`` shakes along the sliding direction; with
``"normal"`` the normal force is Fz + Fz_amplitude cos(omega t).  The formulas are in
``kernel/contact.c`` and ``kernel/directions.c``; this module has the names.
"""

import math
import sys
from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, Literal, NamedTuple, Required, TypedDict, TypeVar

from numpy.typing import ArrayLike

from mumacro.errors import InputError

RAD_PER_CYCLE = 2.0 * math.pi  # omega [rad/s] at f = 1 Hz
RIGID = "rigid"  # the word for an infinite stiffness
GAP = "is missing; write rigid or a number"  # the reason for refusing a gap in a column k
#: what a stiffness must be, in messages of :class:`InputError`
STIFFNESS = 'a number > 0 [N/m], or for a rigid contact "rigid" or math.inf'
MOST_HZ = sys.float_info.max / RAD_PER_CYCLE  # above, omega is beyond double range
NOT_NEGATIVE, ABOVE_ZERO = "finite and >= 0", "finite and > 0"
LIFTS_OFF = ">= 0 and below Fz: at Fz the contact lifts off"  # the bound of Fz_amplitude in a case


class Field(NamedTuple):
    """Describe one input."""

    name: str
    symbol: str  #: symbol in formulas and pictures
    quantity: str  #: its quantity, a key of :data:`mumacro.inputs.units.QUANTITIES`
    unit: str  #: unit in SI
    words: str  #: the unit in words, for errors such as "give metres"
    meaning: str
    bound: str  #: condition for every value
    #: outside this range there is a remark; zero is usual if it is legal
    usual: tuple[float, float]
    example: str  #: text as a person types it: the first case of the documentation
    in_place_of: str = ""  #: the input that this one replaces, if it replaces one


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
ENDS = ("k_low", "k_high")  # the ends of an interval of k
#: every input by its name
INPUTS = {row.name: row for row in _ROWS}

#: names of inputs, and the SI unit in words, for errors such as "give metres"
SI = {row.name: (row.unit, row.words) for row in _ROWS if row.in_place_of in ("", "omega")}
#: inputs that replace another one -> the input whose unit they have: the amplitude of the normal
#: force, the ends of k
MEASURED_AS = {"Fz_amplitude": "Fz", "k_low": "k", "k_high": "k"}
NAMES = tuple(SI)
FIELDS = tuple(name for name in NAMES if name != "f")
UNITS = {name: SI[name][0] for name in FIELDS}
# units of the derivatives
PER_UNIT = {"mu0": "-", "Fz": "1/N", "k": "m/N", "y0": "1/m", "omega": "s/rad", "v0": "s/m"}
POSITIVE = tuple(row.name for row in _ROWS if row.bound == ABOVE_ZERO)
BOUNDS = {row.name: row.bound for row in _ROWS}
#: other values that are read -> their quantities
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


def described(name: str, addition: str = "") -> str:
    """Return the description of an input, with its unit.

    >>> described("v0"), described("f", ", in place of omega")
    ('Sliding speed [m/s]', 'Frequency of the oscillation [Hz], in place of omega')
    """
    return f"{INPUTS[name].meaning} [{INPUTS[name].unit}]{addition}"


def in_help(name: str) -> str:
    """Return the description as part of a sentence, with the bound.

    >>> in_help("mu0"), in_help("v0")
    ('Coulomb friction coefficient of the contact [-], > 0', 'sliding speed [m/s], >= 0')
    """
    text = described(name)
    text = text if text.startswith("Coulomb") else text[0].lower() + text[1:]
    return f"{text}, {BOUNDS[name].removeprefix('finite and ')}"


def field_of(name: str) -> tuple[str, float]:
    """Return the field of an input by its name, and the value of one unit of the name in this
    field.

    >>> field_of("f"), field_of("y0")
    (('omega', 6.283185307179586), ('y0', 1.0))
    """
    return ("omega", RAD_PER_CYCLE) if name == "f" else (name, 1.0)


def refusal(name: str, value: float) -> str:
    """Return why ``value`` is not a legal value of an input; NaN stands for a gap, which is never a
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


# --- the contact and the direction of the oscillation ---------------------------------------------

ContactName = Literal["spring", "ball"]
DirectionName = Literal["across", "along", "normal"]
#: in the order of the kernel's codes
CONTACTS: tuple[ContactName, ...] = ("spring", "ball")
DIRECTIONS: tuple[DirectionName, ...] = ("across", "along", "normal")


class Springs(NamedTuple):
    """Describe a contact's springs, as far as no evaluation is necessary."""

    meaning: str
    exponent: float  #: k grows with this power of the load
    middle_load: float  #: load of the middle spring divided by the mean load


#: by contact
SPRINGS_OF: dict[str, Springs] = {
    "spring": Springs("one spring of stiffness k", 0.0, 1.0),
    "ball": Springs("a ball (Hertz) with the initial stiffness k", 1.0 / 3.0, 1.5),
}
AMPLITUDE = "Fz_amplitude"  # amplitude of the normal force [N], replaces y0
AMPLITUDES = ("y0", AMPLITUDE)
#: the six inputs by code of the direction
FIELDS_OF = (
    FIELDS,
    FIELDS,
    tuple(AMPLITUDE if name == "y0" else name for name in FIELDS),
)


class _Codes(NamedTuple):
    contact: int
    direction: int


class Kind(_Codes):
    """Hold a contact and a direction by their codes in the kernel."""

    @cached_property
    def normal(self) -> bool:
        """Return whether the normal force oscillates."""
        return DIRECTIONS[self.direction] == "normal"

    @cached_property
    def amplitude(self) -> str:
        """Return the input that is the amplitude of the oscillation."""
        return AMPLITUDES[self.normal]

    @cached_property
    def other_amplitude(self) -> str:
        """Return the amplitude of the other directions."""
        return AMPLITUDES[not self.normal]

    @cached_property
    def fields(self) -> tuple[str, ...]:
        """Return the names of the six inputs: :data:`mumacro.inputs.fields.FIELDS`, with
        Fz_amplitude instead of y0 for normal."""
        return FIELDS_OF[self.direction]

    @cached_property
    def names(self) -> Mapping[str, Any]:
        """Return contact and direction as keywords of ``evaluate``."""
        return {"contact": CONTACTS[self.contact], "direction": DIRECTIONS[self.direction]}

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Return the names of the columns that a table of cases may have."""
        return (*self.fields, "f")


SPRING, BALL = Kind(0, 0), Kind(1, 0)  # across
_KINDS: dict[tuple[str, str], Kind] = {
    (contact, direction): Kind(i, j)
    for j, direction in enumerate(DIRECTIONS)
    for i, contact in enumerate(CONTACTS)
}
del _KINDS["ball", "normal"]
#: all pairs that exist
KINDS = (*_KINDS.values(),)


def kind_of(contact: str = "spring", direction: str = "across") -> Kind:
    """Return the codes of a contact and a direction.  Raise InputError for unknown names, and for a
    ball whose normal force oscillates.

    >>> kind_of("ball", "along")
    Kind(contact=1, direction=1)
    """
    try:
        return _KINDS[contact, direction]
    except (KeyError, TypeError):
        pass  # the reason follows
    for name, value, names in (
        ("contact", contact, CONTACTS),
        ("direction", direction, DIRECTIONS),
    ):
        if not isinstance(value, str) or value not in names:
            raise InputError(name, value, f"one of {', '.join(names)}")
    bound = (
        "across or along for a ball: a normal force that oscillates changes its contact "
        "radius, not modelled"
    )
    raise InputError("direction", direction, bound)


# --- what functions take, for type checkers and in their signatures -------------------------------

if TYPE_CHECKING:
    Numbers = ArrayLike
    Oscillation = Any
else:  # a signature shows this name instead of a union of twenty lines

    class Numbers:
        """Accept a number in SI, a text with a unit such as "2um", a quantity, or an array of
        numbers."""

    class Oscillation:
        """Accept an amplitude, a text such as "2um@90deg", (amplitude, phase in degrees), or a list
        of (harmonic, amplitude, phase): see :func:`mumacro.motion`."""


_Value = float | str  # a text is read as a person types it
_AnyValue = TypeVar("_AnyValue")


class _Options(TypedDict, total=False):
    include: Iterable[str]
    illegal: Literal["nan", "raise"]


class _Deviations(TypedDict, Generic[_AnyValue], total=False):
    std_mu0: _AnyValue
    std_Fz: _AnyValue
    std_k: _AnyValue
    std_y0: _AnyValue
    std_Fz_amplitude: _AnyValue
    std_omega: _AnyValue
    std_f: _AnyValue
    std_v0: _AnyValue


class _One(_Deviations[_Value], _Options, total=False):
    mu0: Required[_Value]
    Fz: Required[_Value]
    y0: _Value
    Fz_amplitude: _Value
    omega: _Value
    f: _Value
    v0: Required[_Value]
    contact: ContactName
    direction: DirectionName


class OneCase(_One):
    """Type the inputs of one case."""

    k: _Value


class OneInterval(_One):
    """Type the inputs of one case whose k is an interval."""

    k_low: Required[_Value]
    k_high: Required[_Value]


class _Inputs(_Deviations[_AnyValue], Generic[_AnyValue], total=False):
    mu0: _AnyValue
    Fz: _AnyValue
    k: _AnyValue
    k_low: _AnyValue
    k_high: _AnyValue
    y0: _AnyValue
    Fz_amplitude: _AnyValue
    omega: _AnyValue | None
    f: _AnyValue | None
    v0: _AnyValue
    contact: _AnyValue
    direction: _AnyValue


class ManyCases(_Inputs[ArrayLike], _Options, total=False):
    """Type the inputs of cases as arrays, or names that are given with a mapping."""


class AnyCases(_Inputs[Any], total=False):
    """Type the same inputs of any type, such as labelled arrays or quantities with units."""

    include: Any
    gradient: bool
    illegal: str

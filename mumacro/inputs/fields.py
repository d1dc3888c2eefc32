"""The six inputs of a case: names, units, bounds, other names, and what may stand for them.  The
one truth of a case.

The library, the files, the command line, the service and the exports take their fields from here.
A frequency ``f`` [Hz] may be given in place of the angular frequency ``omega`` [rad/s], exactly one
of them.  The stiffness ``k`` is always said: a positive number, or rigid contact by the word
``rigid`` or by infinity.

**A gap is never rigid**: a single None or NaN is refused, an empty cell, null or NaN in a column
``k`` makes its case illegal, see :data:`GAP`.
"""

import difflib
import math
import re
import sys
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from mumacro.errors import InputError
from mumacro.kernel.arrays import Array

#: names that may be given, and the SI unit in words, for errors such as "give metres"
SI = {
    "mu0": ("-", "a plain number"),
    "Fz": ("N", "newtons"),
    "k": ("N/m", "newtons per metre"),
    "y0": ("m", "metres"),
    "omega": ("rad/s", "radians per second"),
    "f": ("Hz", "hertz"),
    "v0": ("m/s", "metres per second"),
}
#: what may stand for an input, and the input that has its unit: the amplitude of the normal force,
#: the ends of k
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
#: what a stiffness must be, told by :class:`InputError`
STIFFNESS = 'a number > 0 [N/m], or for a rigid contact "rigid" or math.inf'
MOST_HZ = sys.float_info.max / RAD_PER_CYCLE  # above, omega is beyond double range


# --- names and units as text ----------------------------------------------------------------------


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

# Without case, spaces and punctuation.  Only names that hardly mean anything else: a column of a
# file that has one of them while the input itself is missing is refused.
_OTHER_NAMES = {
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
_OTHER_NAMES |= {name.lower(): name for name in NAMES}

_IN_BRACKETS = re.compile(r"\s*(.*?)\s*(?:\[\s*([^\[\]]*?)\s*\]|\(\s*([^()]*?)\s*\))\s*", re.DOTALL)
_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_WITH_UNIT = re.compile(rf"({_NUMBER})\s*([^\d\s.,+-].*)", re.ASCII)
# an interval, as people write it
_DASHED = re.compile(rf"({_NUMBER})\s*(?:-|–|to)\s*({_NUMBER})\s*(\D.*)?")
PLAIN = re.compile(rf"{_NUMBER}|[+-]?(?:nan|inf|infinity)", re.ASCII | re.IGNORECASE)


def is_rigid(text: str) -> bool:
    """Whether a text says that the contact is rigid.

    >>> is_rigid(" Rigid "), is_rigid("")
    (True, False)
    """
    return text.strip().lower() == RIGID


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


def split_unit(column: str) -> tuple[str, str | None]:
    """Name and unit of a heading such as ``k [N/mm]`` or ``k (N/mm)``; the unit is None where there
    are no brackets.

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
    return _scale(UNITS_OF[LIKE.get(name, name)], unit)


def unit_of(name: str) -> str:
    """The SI unit of an input, or of what may stand for one.

    >>> unit_of("k_low"), unit_of("f")
    ('N/m', 'Hz')
    """
    return SI[LIKE.get(name, name)][0]


def field_of(name: str) -> tuple[str, float]:
    """The field behind the name of an input, and what one unit of the name is of it.

    >>> field_of("f"), field_of("y0")
    (('omega', 6.283185307179586), ('y0', 1.0))
    """
    return ("omega", RAD_PER_CYCLE) if name == "f" else (name, 1.0)


def _scale(units: Mapping[str, Scale], unit: str) -> Scale | None:
    return units.get(unit.replace(" ", "").replace("·", ""))


def suggestion(name: str, *, loosely: bool = True) -> str | None:
    """The input that ``name`` is taken for, in another case, by another name or (``loosely``)
    misspelt; None for none.

    >>> [suggestion(name) for name in ("FZ", "F", "stiffness", "omga", "temperature")]
    ['Fz', 'Fz', 'k', 'omega', None]
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


def unknown_name(name: str, known: Iterable[str]) -> str:
    """Why an unknown name is refused, with the known name that was probably meant.

    >>> unknown_name("omga", ("omega", "f"))
    'unknown field; did you mean omega? allowed: omega, f'
    """
    names = list(known)
    meant = suggestion(name[:80], loosely=False)
    if meant not in names:
        meant = next(iter(difflib.get_close_matches(name[:80], names, n=1, cutoff=0.6)), None)
    advice = f"did you mean {meant}? " if meant else ""
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
    found = _WITH_UNIT.fullmatch(text)
    if found is None:
        return "must be a number, or rigid" if name == "k" else "must be a number"
    like = LIKE.get(name, name if name in SI else "mu0")  # another number is a plain one, too
    words, scale = SI[like][1], scale_of(like, found[2])
    if scale is None:
        return f"must be a number without a unit: give {words}"
    return f"must be a number: give {words}, {scale.si(float(found[1])):.12g}"


def read_number(name: str, text: str) -> float:
    """The value of an input from text, a number in SI or with a unit, in SI; ``rigid`` is an
    infinite stiffness.

    >>> read_number("y0", "2e-6"), read_number("k", "1 N/um")
    (2e-06, 1000000.0)
    >>> read_number("y0", "2 N")
    Traceback (most recent call last):
    ...
    ValueError: y0=2 N: give metres as a plain number such as 2e-6, or with a unit: m, cm, mm, um,
    ...
    """
    like = LIKE.get(name, name)
    return read_quantity(name, text, SI[like][1], UNITS_OF[like], rigid=name == "k")


def read_quantity(
    name: str, text: str, words: str, units: Mapping[str, Scale], *, rigid: bool = False
) -> float:
    """As :func:`read_number`, of any quantity: what it is in ``words``, its ``units``, whether it
    may be ``rigid``."""
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
    if meant := _meant(name, text, units):
        raise ValueError(f"{name}={text}: {meant}")
    known = ", ".join([unit for unit in units if unit][:4])
    hint = ", or rigid" if rigid else ""
    raise ValueError(
        f"{name}={text}: give {words} as a plain number such as 2e-6, or with a unit: {known}, "
        f"...{hint}"
    )


def _meant(name: str, text: str, units: Mapping[str, Scale]) -> str | None:
    """What was probably meant by a text that is no quantity: an interval, a unit in other case, f
    for omega.

    >>> _meant("k", "0.8-1.2N/um", UNITS_OF["k"]), _meant("omega", "20kHz", UNITS_OF["omega"])
    ('write an interval as k=0.8..1.2N/um', 'did you mean f=20kHz? omega is in rad/s')
    """
    if name == "k" and (ends := _DASHED.fullmatch(text)):
        return f"write an interval as k={ends[1]}..{ends[2]}{ends[3] or ''}"
    if not (found := _WITH_UNIT.fullmatch(text)):
        return None
    number, unit = found[1], found[2].replace(" ", "")
    near = [known for known in units if known.lower() == unit.lower()]
    other = {"omega": "f", "f": "omega"}.get(name)
    if near:
        return f"did you mean {' or '.join(f'{number}{known}' for known in near)}?"
    if other and (
        there := next((known for known in UNITS_OF[other] if known.lower() == unit.lower()), None)
    ):
        return f"did you mean {other}={number}{there}? {name} is in {SI[name][0]}"
    return None


def read_range(name: str, text: str) -> tuple[float, float]:
    """Both ends of ``low..high`` in SI; a unit behind the second end holds for both.  ValueError as
    in read_number.

    >>> read_range("k", "0.8..1.2 N/um")
    (800000.0, 1200000.0)
    """
    low, _, high = text.partition("..")
    plain = [PLAIN.fullmatch(end.strip()) for end in (low, high)]  # 1.2e6 is not 1.2 of a unit e6
    if plain[0] and not plain[1] and (found := _WITH_UNIT.fullmatch(high.strip())):
        low = f"{low} {found[2]}"
    ends = read_number(name, low), read_number(name, high)
    if not 0.0 < ends[0] < ends[1] < math.inf:
        raise ValueError(f"{name}={text}: the ends of a range must be > 0, finite and ascending")
    return ends


# --- columns --------------------------------------------------------------------------------------


def picked(argument: str, cases: Any, names: Iterable[str]) -> dict[str, Any]:
    """Those of ``names`` that a mapping, a data frame, an Arrow table or stream, or a Dataset
    has."""
    # such as a reader of batches
    if hasattr(cases, "__arrow_c_stream__") and not hasattr(cases, "__dataframe__"):
        # its columns come from one reading: a second one may have another order
        import pyarrow as pa

        cases = pa.table(cases)
    try:
        # coordinates of a Dataset are inputs, too, although they are not keys; Arrow and Polars
        # have lists of names
        there = (
            cases
            if hasattr(cases, "keys")
            else getattr(cases, "column_names", None) or cases.columns
        )
        return {name: cases[name] for name in names if name in there}
    except (AttributeError, TypeError, KeyError) as error:
        kind = f"{type(cases).__module__}.{type(cases).__qualname__}"
        raise InputError(
            argument,
            kind,
            "a mapping, DataFrame, Arrow table or Dataset with the inputs by name; "
            "give anything else as {name: array}, what is lazy after its collect() or read_all()",
        ) from error


def as_columns(given: Mapping[str, Any]) -> dict[str, Array]:
    """The six inputs as float64 arrays; InputError where one is missing, given twice, or no real
    number.

    ``given`` holds the fields, ``f`` [Hz] in place of ``omega`` if not None, and ``k``: a number,
    an array or ``rigid``; an array may hold the word, too.
    """
    converted: dict[str, Array] = {}
    for name in FIELDS:
        source = name
        if name == "omega":
            both = given.get("omega") is not None
            if both == (given.get("f") is not None):
                told = "not both" if both else "one of them"
                raise InputError(
                    "omega", given.get("omega"), f"given or f [Hz] in its place, {told}"
                )
            source = "omega" if both else "f"
        if source not in given:
            hint = f": {STIFFNESS}" if name == "k" else f" [{UNITS[name]}]"
            raise InputError(name, None, f"given{hint}")
        value = given[source]
        try:
            array = real(source, value)
        except InputError:
            if name != "k":
                raise
            array = _stiffness(value)
        if source == "f":
            with np.errstate(over="ignore"):  # infinite, which is refused as a value of f
                array = array * RAD_PER_CYCLE
        converted[name] = array
    return converted


def _stiffness(value: Any) -> Array:
    """A stiffness, or an array of them, which may say ``rigid``; InputError with the remedy for a
    gap."""
    try:
        return real("k", _rigid_as_infinity(value))
    except InputError as error:
        raise InputError("k", value, STIFFNESS) from error


def _rigid_as_infinity(value: Any) -> Any:
    """A stiffness, or an array of them, with infinity for the word ``rigid``."""
    if isinstance(value, str):
        return math.inf if is_rigid(value) else value
    if not isinstance(value, (list, tuple)) and getattr(
        getattr(value, "dtype", None), "kind", ""
    ) not in ("O", "U"):
        return value
    try:
        texts = np.asarray(value, dtype=object)
        read = [math.inf if isinstance(x, str) and is_rigid(x) else x for x in texts.flat]
        return np.array(read).reshape(texts.shape)
    except ValueError:  # lists of several lengths
        return value


def real(name: str, value: Any) -> Array:
    """``value`` as float64; complex numbers, times, text and None are refused, also where numpy
    would convert them.

    What is masked is unknown: NaN.
    """
    try:
        if isinstance(value, np.ma.MaskedArray):
            value = (
                np.ma.filled(value.astype(np.float64), math.nan)
                if value.dtype.kind in "fiub"
                else value.data
            )
        array = np.asarray(value)
        if array.dtype.kind in "fiub":
            return array.astype(np.float64, copy=False)
        if array.dtype.kind == "O" and not any(
            isinstance(x, (str, bytes)) or x is None for x in array.ravel()
        ):
            return array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        pass
    raise InputError(name, value, "a real number or an array of them")


def check_inputs(columns: Mapping[str, Array], frequency: Any = None) -> None:
    """Refuse the first value out of :data:`BOUNDS`; ``frequency`` is what was given as ``f`` in
    place of omega."""
    for name, values in columns.items():
        legal = (values > 0.0) if name in POSITIVE else (values >= 0.0)
        bad = ~(legal if name == "k" else legal & np.isfinite(values))
        if bad.any():
            i = int(np.flatnonzero(bad.ravel())[0])
            field, told = (
                ("f", real("f", frequency))
                if name == "omega" and frequency is not None
                else (name, values)
            )
            value = float(told.ravel()[i])
            bound = refusal(field, value).removeprefix("must be ") if field == "f" else BOUNDS[name]
            bound = STIFFNESS if field == "k" and math.isnan(value) else bound
            raise InputError(field, value, bound, i if values.ndim else None)


def length_scale(mu0: Array, Fz: Array, k: Array) -> Array:
    """l0 = mu0 Fz / k [m], eq. (5), without overflow of mu0 Fz; 0 for rigid contact."""
    mu0, Fz, k = np.broadcast_arrays(mu0, Fz, k)
    with np.errstate(all="ignore"):
        quotient = Fz / k
        out = np.asarray(mu0 * quotient)
        low, high = np.minimum(quotient, out), np.maximum(quotient, out)
        odd = ~((low > 1e-290) & (high < 1e290))  # there a partial result may have lost digits
        if odd.any():
            (a, i), (b, j), (c, n) = (np.frexp(x[odd]) for x in (mu0, Fz, k))
            out[odd] = np.ldexp(a * (b / c), i + j - n)
    return out

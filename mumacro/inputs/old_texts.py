"""What stays until every entrance reads with :mod:`mumacro.inputs.reading`."""

import math
import re
from collections.abc import Mapping

from mumacro.inputs.fields import GAP, LIKE, SI, is_rigid
from mumacro.inputs.units import UNITS_OF, Scale, scale_of


def _scale(units: Mapping[str, Scale], unit: str) -> Scale | None:
    return units.get(unit.replace(" ", "").replace("·", "").replace("µ", "u").replace("μ", "u"))


_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_WITH_UNIT = re.compile(rf"({_NUMBER})\s*([^\d\s.,+-].*)", re.ASCII)
# an interval, as people write it
_DASHED = re.compile(rf"({_NUMBER})\s*(?:-|–|to)\s*({_NUMBER})(\D.*)?")
PLAIN = re.compile(rf"{_NUMBER}|[+-]?(?:nan|inf|infinity)", re.ASCII | re.IGNORECASE)


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
    ValueError: y0=2 N: give metres as a plain number, or with a unit: m, dm, cm, mm, ...
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

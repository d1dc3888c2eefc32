"""Names of inputs as people write them: which input a name probably stands for."""

import difflib
import re
from collections.abc import Iterable

from mumacro.inputs.fields import NAMES
from mumacro.inputs.units import split_unit

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
    "vo": "v0",
    "yo": "y0",
    "muo": "mu0",
    "wo": "omega",
    "fo": "f",
    "vx": "v0",
    "speed": "v0",
    "velocity": "v0",
    "slidingspeed": "v0",
    "slidingvelocity": "v0",
}
_SYNONYMS |= {name.lower(): name for name in NAMES}
# names that people expect, or that said the same before -> what says it now
_FORMER = {
    "k_range": 'written as k_low and k_high, or in k as an interval such as "0.8..1.2 N/um"',
    "std": "written as std_k, std_mu0 and so on: one name for each deviation",
    "groups": 'written as include="groups"',
    "cases": 'left out: rows are [{"mu0": ...}, ...], columns {"mu0": [...], ...}',
}


def suggestion(name: str, *, loosely: bool = True) -> str | None:
    """Return the input that ``name`` probably stands for, in another case, by another name or
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


def in_place_of(name: str, allowed: Iterable[str]) -> str | None:
    """Return what to write in place of a former name, or of one with a unit, which is the head of
    a column; None for another name.

    >>> in_place_of("y0 [um]", ["y0"]), in_place_of("groups", [])
    ('named y0, with the unit in the value, as in "2 um"', 'written as include="groups"')
    """
    if name in _FORMER:
        return _FORMER[name]
    field, unit = split_unit(name[:80])
    if unit is None or field not in allowed:
        return None
    return f'named {field}, with the unit in the value, as in "2 {unit}"'


def unknown_name(name: str, allowed: Iterable[str]) -> str:
    """Return why an unknown name is refused, with the most similar one of those allowed.

    >>> unknown_name("omga", ("omega", "f"))
    'unknown field; did you mean omega? allowed: omega, f'
    """
    names = list(allowed)
    if (bound := in_place_of(name, names)) is not None:
        return f"must be {bound}"
    nearest = suggestion(name[:80], loosely=False)
    if nearest not in names:
        nearest = next(iter(difflib.get_close_matches(name[:80], names, n=1, cutoff=0.6)), None)
    advice = f"did you mean {nearest}? " if nearest else ""
    return f"unknown field; {advice}allowed: {', '.join(names)}"

"""Find the input that a name stands for.  Names are as people write them, alone or above a column
with a unit.  Return also the unit, and the advice for a name that is unknown or missing."""

import difflib
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple

from mumacro.inputs.fields import INPUTS, NAMES, QUANTITY_OF
from mumacro.inputs.units import (
    QUANTITIES,
    Unit,
    canonical,
    explain_unit,
    parse_unit,
    quantity_of,
    scale_of,
    unit_of,
)

# Lower case, without spaces and punctuation.  Only names that hardly have another meaning, because
# a file with such a column is refused if the input itself is missing.
_SYNONYMS = {
    synonym: name
    for name, synonyms in {
        "mu0": "mu mus muk mucoulomb frictioncoefficient coefficientoffriction cof µ µ0 μ μ0 muo",
        "Fz": "fn n force normalforce load normalload",
        "k": "kx kt ktangential stiffness tangentialstiffness contactstiffness",
        "y0": "y amplitude ampl amp a a0 yo",
        "omega": "w om ω angularfrequency angularvelocity wo",
        "f": "freq frequency hz f0 fo",
        "v0": "v vo vx speed velocity slidingspeed slidingvelocity",
    }.items()
    for synonym in synonyms.split()
}
_SYNONYMS |= {name.lower(): name for name in NAMES}
# names that people expect, or former names -> the present name
_FORMER = {
    "k_range": 'written as k_low and k_high, or in k as an interval such as "0.8..1.2 N/um"',
    "std": "written as std_k, std_mu0 and so on: one name for each deviation",
    "groups": 'written as include="groups"',
    "cases": 'left out: rows are [{"mu0": ...}, ...], columns {"mu0": [...], ...}',
}


def suggestion(name: str, *, loosely: bool = True) -> str | None:
    """Return the input that ``name`` probably stands for, in another case, by another name or
    (``loosely``) misspelt, otherwise None.

    >>> [suggestion(name) for name in ("FZ", "F", "stiffness", "omga", "temperature")]
    ['Fz', 'Fz', 'k', 'omega', None]
    """
    if name.strip() == "F":  # a force; in lower case it would be the frequency f
        return "Fz"
    plain = re.sub(r"[\s_.\-~^*{}$\\]", "", name).lower()
    if plain in _SYNONYMS:
        return _SYNONYMS[plain]
    if loosely and len(plain) > 1:
        matches = difflib.get_close_matches(plain, _SYNONYMS, n=1, cutoff=0.75)
        return _SYNONYMS[matches[0]] if matches else None
    return None


def in_place_of(name: str, allowed: Iterable[str]) -> str | None:
    """Return what to write instead of a former name, or of a name with a unit, which is the header
    of a column.  Return None for any other name.

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
    """Return why an unknown name is refused, with the most similar allowed name.

    >>> unknown_name("omga", ("omega", "f"))
    'unknown field; did you mean omega? allowed: omega, f'
    """
    names = list(allowed)
    if (bound := in_place_of(name, names)) is not None:
        return f"must be {bound}"
    nearest = suggestion(name[:80], loosely=False)
    if nearest not in names:
        alike = difflib.get_close_matches(name[:80], names, n=1, cutoff=0.6)
        first = meant_by(name[:80], loosely=False)
        nearest = alike[0] if alike else first if first in names else None
    advice = f"did you mean {nearest}{_part_of(name, nearest)}? " if nearest else ""
    return f"unknown field; {advice}allowed: {', '.join(names)}"


# --- heads of columns -----------------------------------------------------------------------------

# limits of the headers that a message lists, and that are compared with misspelt names
_LISTED, _COMPARED = 20, 100
# "k in N/mm", "k / (N/mm)", "k, N/mm": forms from standards for tables
_WITH_UNIT = re.compile(r"(\w+)(?: ?/ ?| in |, ?)(\S.*)")


# closing bracket -> its opening bracket
_OPENING = {"]": "[", ")": "("}


def split_unit(column: str) -> tuple[str, str | None]:
    """Return name and unit of a header such as ``k [N/mm]`` or ``k (N/mm)``; the unit is None if
    there are no brackets.

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


def heading(cell: str, input_of: Mapping[str, str]) -> str:
    """Return a header as it is in a table, on one line; put its unit in brackets if its name is in
    ``input_of``.

    >>> heading("v0 / (mm/s)", {"v0": "v0"}), heading("run / day", {"v0": "v0"})
    ('v0 [mm/s]', 'run / day')
    """
    text = " ".join(cell.split()) if "\n" in cell else cell.strip()
    match = _WITH_UNIT.fullmatch(text)
    if match and match[1] in input_of and text not in input_of:
        unit = match[2].strip(" ()[]")
        if scale_of(input_of[match[1]], unit) is not None:
            return f"{match[1]} [{unit}]"
    return text


class ColumnNames(NamedTuple):
    """Name the columns of a table that have a meaning."""

    input_of: Mapping[str, str]  #: by name: the input whose units the column has
    #: of each of these lists, one name must be in the table
    required_groups: Sequence[Sequence[str]]

    def may_be_in(self, text: str) -> bool:
        """Return whether a text contains all necessary names, as words or within other words."""
        return all(any(name in text for name in names) for names in self.required_groups)

    def are_among(self, names: Collection[str]) -> bool:
        """Return whether some names contain all necessary names."""
        return all(any(name in names for name in group) for group in self.required_groups)

    def heads_in(self, cells: Sequence[str]) -> list[tuple[str, str | None]]:
        """Return the name and the unit in each cell of a header, or nothing if a necessary name is
        not among them."""
        heads = [split_unit(heading(cell, self.input_of)) for cell in cells]
        return heads if self.are_among({name for name, _ in heads}) else []


def find_heads(
    heads: Sequence[str], input_of: Mapping[str, str]
) -> tuple[dict[str, tuple[int, Unit]], list[str]]:
    """Return the index and the unit of each column by name, and the faults of the headers.

    ``input_of`` has the names of the columns, and for each the input whose units it has; other
    columns are left out.

    >>> find_heads(["v0 [mm/s]", "note"], {"v0": "v0"})
    ({'v0': (0, Unit(symbol='mm/s', scale=Scale(times=1.0, over=1000.0)))}, [])
    """
    columns: dict[str, tuple[int, Unit]] = {}
    faults = []
    for i, head in enumerate(heads):
        name, text = split_unit(head)
        if name not in input_of:
            continue
        unit = Unit("") if text is None else parse_unit(quantity_of(input_of[name]), text)
        if unit is None:
            reason = _why_no_unit(name, text or "", input_of[name])
            faults.append(f"the column {head!r} has a unit that {reason}")
        if name in columns:
            faults.append(
                f"{name} is there twice: {heads[columns[name][0]]!r} and {head!r}; rename one"
            )
        columns[name] = i, unit or Unit("")
    if {"f", "omega"} <= columns.keys():
        faults.append("there are both f [Hz] and omega [rad/s]; leave one out")
    return columns, faults


def _why_no_unit(name: str, unit: str, input_name: str) -> str:
    """Return why a unit of a column is refused, with the number to give if it is clear what is
    meant.

    >>> _why_no_unit("y0", "um pp", "y0")
    'y0 cannot have: it must be half of peak to peak: give 0.5um in place of 1 um pp'
    """
    quantity = QUANTITY_OF[input_name]
    if name == "omega" and scale_of("f", unit):
        return f"{name} cannot have: a frequency is f [Hz]; give {QUANTITIES[quantity].such_as}"
    bound = explain_unit(quantity, 1.0, unit)
    if bound == QUANTITIES[quantity].bound:
        return f"{name} cannot have; give {QUANTITIES[quantity].such_as}"
    return f"{name} cannot have: it must be {bound} in place of 1 {unit}"


def meant_by(head: str, *, loosely: bool = True) -> str | None:
    """Return the input that a header probably stands for, as a whole or by its first word: k for
    ``k_N_per_mm``."""
    name = split_unit(head)[0]
    first = re.split(r"[\W_]+", name.strip("_ "))[0]
    return suggestion(name, loosely=loosely) or suggestion(first, loosely=False)


def absent(names: Sequence[str], heads: Sequence[str]) -> str:
    """Return what to do about missing columns.

    >>> absent(["v0"], ["speed", "mu_macro"])
    "there is no column v0; 'speed' is similar: rename that column to v0 [m/s] (or another unit in
    brackets)"
    >>> absent(["Fz", "v0"], ["speed", "note"])
    "there are no columns Fz [N], v0 [m/s]; there are 'speed', 'note'; similar: rename 'speed' to
    v0 [m/s]"
    """
    alike = [one for name in names if (one := _similar(name, heads))]
    if len(names) == 1 and alike:
        head, column = alike[0]
        remedy = f"rename that column to {column} (or another unit in brackets)"
        return f"there is no column {names[0]}; {head!r} is similar: {remedy}"
    what = "is no column" if len(names) == 1 else "are no columns"
    renames = ", ".join(f"{head!r} to {column}" for head, column in alike)
    remedy = f"; similar: rename {renames}" if alike else ""
    return f"there {what} {', '.join(map(_heading, names))}; there are {_listed(heads)}{remedy}"


def _listed(heads: Sequence[str]) -> str:
    """Return the headers for a message of limited length."""
    text = ", ".join(
        repr(head if len(head) <= 80 else f"{head[:77]}...") for head in heads[:_LISTED]
    )
    rest = len(heads) - _LISTED
    return f"{text} and {rest:,} more" if rest > 0 else text


def _heading(name: str) -> str:
    """Return the header of an input's column in SI units."""
    heading = f"{name} [{unit_of(name)}]"
    addition = {"omega": " or f [Hz]", "mu_macro": " (the mean friction force over Fz)"}
    return heading + addition.get(name, "")


def _similar(name: str, heads: Sequence[str]) -> tuple[str, str] | None:
    """Return the header that probably stands for an input, and the header that it should be."""
    for loosely, candidates in ((False, heads), (True, heads[:_COMPARED])):
        for head in candidates:
            if field := _stands_for(head, name, loosely):
                column = f"{field} [{_unit_in_head(head, field) or unit_of(field)}]"
                return head, column + _part_of(head, field)
    return None


def _stands_for(head: str, name: str, loosely: bool) -> str | None:
    """Return the input for which a header probably stands, if this column is missing.  Omega may
    also be f, and mu_macro may be what people call friction.

    >>> _stands_for("freq", "omega", False), _stands_for("COF", "mu_macro", False)
    ('f', 'mu_macro')
    """
    field = meant_by(head, loosely=loosely)
    if name == "mu_macro":
        friction = field == "mu0" or "macro" in head.lower()
        return name if friction and split_unit(head)[0] not in INPUTS else None
    return field if field in (name, {"omega": "f"}.get(name)) else None


# how people say that a value is more or less than the amplitude, and what to give
_PARTS = {
    re.compile(
        r"p(?:ea)?k[\W_]*+(?:to|2)?+[\W_]*+p(?:ea)?k|(?<![a-z])p[\W_]?(?:to|2|t)?[\W_]?p(?![a-z])"
        r"|double[\W_]amplitude|(?<![a-z])s[\W_]?s(?![a-z])|spitze[\W_]*+spitze",
        re.IGNORECASE,
    ): ", with half of each value: it is peak to peak",
    re.compile(r"(?<![a-z])(?:rms|eff)(?![a-z])", re.IGNORECASE): (
        f", with {math.sqrt(2.0):.6g} times each value, if it is a sine: it is rms"
    ),
}


def _part_of(name: str, field: str) -> str:
    """Return what to do with the values of a name that says that they are not the amplitude.

    >>> _part_of("Amplitude p-p [um]", "y0"), _part_of("peak amplitude [um]", "y0")
    (', with half of each value: it is peak to peak', '')
    >>> _part_of("y0_rms", "y0")
    ', with 1.41421 times each value, if it is a sine: it is rms'
    """
    if field not in ("y0", "Fz_amplitude"):
        return ""
    return next((advice for part, advice in _PARTS.items() if part.search(name[:80])), "")


def _unit_in_head(head: str, field: str) -> str | None:
    """Return the unit that a header has in brackets of any kind, or as its last words.

    >>> [_unit_in_head(head, "y0") for head in ("Amplitude [um]", "Amplitude µm", "amplitude")]
    ['um', 'µm', None]
    >>> _unit_in_head("v0_um_s", "v0"), _unit_in_head("k_N_per_mm", "k")
    ('um/s', 'N/mm')
    >>> _unit_in_head("v0 {mm/s}", "v0"), _unit_in_head("Amplitude [um p-p]", "y0")
    ('mm/s', 'um')
    """
    unit = split_unit(head)[1]
    if unit is not None and scale_of(field, unit) is not None:
        return unit
    text = head[:80]
    for part in _PARTS:
        text = part.sub(" ", text)
    words = re.split(r"[\s_:|<>{}()\[\]]+", text.strip(" _:|<>{}()[]*"))
    for ratio in (" ".join(words[-3:]), "/".join(words[-2:])):
        if len(words) > 2 and scale_of(field, ratio) is not None:
            return canonical(ratio)
    return words[-1] if words[-1] and scale_of(field, words[-1]) is not None else None

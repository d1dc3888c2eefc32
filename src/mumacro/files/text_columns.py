"""A column of text as numbers: the usual ones all at once, the others cell by cell."""

import math

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from mumacro.inputs.fields import LIKE, RIGID
from mumacro.inputs.layout import GAPS
from mumacro.inputs.signs import Signs
from mumacro.inputs.text_tables import read_cell
from mumacro.inputs.units import Scale
from mumacro.kernel.arrays import Array

_NUMBER = r"^[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?$"
_THOUSANDS = r"^[+-]?[1-9][0-9]{0,2}(%s[0-9]{3})+(%s[0-9]*)?$"
_FORTRAN = r"^([+-]?[0-9.]+)[dD]([+-]?[0-9]+)$"


def like_of(name: str) -> str:
    """The input whose units a column of numbers has: that of its deviation, or of its ends."""
    field = name.removeprefix("std_")
    return LIKE.get(field, field)


def numbers_of(
    column: pa.Array, name: str, signs: Signs, scale: Scale
) -> tuple[Array, Array, dict[int, str]]:
    """The numbers of a column of the input ``name`` in its own unit, and in SI; NaN where a cell is
    empty or has none, and then why, by its index."""
    text = pc.utf8_trim_whitespace(column)
    plain = pc.fill_null(pc.match_substring_regex(text, _NUMBER), False)
    if signs.decimal == "," or not pc.all(plain).as_py():
        text = _as_written_by_programs(text, name, signs)
        plain = pc.fill_null(pc.match_substring_regex(text, _NUMBER), False)
    numbers = pc.cast(pc.if_else(plain, text, None), pa.float64())
    values: Array = pc.fill_null(numbers, math.nan).to_numpy(zero_copy_only=False).copy()
    with np.errstate(over="ignore"):
        si: Array = values * scale.times / scale.over
    faults: dict[int, str] = {}
    # the others, and those beyond double range
    others = pc.and_kleene(pc.invert(plain), pc.is_valid(text)).to_numpy(zero_copy_only=False)
    for i in np.flatnonzero(others | np.isinf(si)).tolist():
        si[i] = values[i] = math.nan
        try:
            si[i] = read_cell(like_of(name), column[i].as_py(), signs, scale)
            values[i] = si[i] * scale.over / scale.times
        except ValueError as error:
            faults[i] = str(error)
    return values, si, faults


def _as_written_by_programs(text: pa.Array, name: str, signs: Signs) -> pa.Array:
    """Cells with a decimal point and an e before the exponent where they are numbers; gaps are
    null."""
    small = pc.utf8_lower(text)
    text = pc.if_else(pc.is_in(small, pa.array(sorted(GAPS))), None, text)
    if signs.decimal == ",":
        has_thousands = pc.match_substring_regex(text, _THOUSANDS % (r"\.", ","))
        if signs.thousands not in (None, "."):
            has_thousands = pc.and_(has_thousands, False)
        text = pc.if_else(has_thousands, pc.replace_substring(text, ".", ""), text)
        # a point that is left is no decimal point
        has_point = pc.match_substring(text, ".")
        with_point = pc.replace_substring(pc.replace_substring(text, ".", "?"), ",", ".")
        text = pc.if_else(has_point, pc.replace_substring(text, ".", "?"), with_point)
    elif signs.decimal == "." and signs.thousands in (None, ","):
        has_thousands = pc.match_substring_regex(text, _THOUSANDS % (",", r"\."))
        text = pc.if_else(has_thousands, pc.replace_substring(text, ",", ""), text)
    text = pc.replace_substring_regex(text, _FORTRAN, r"\1e\2")
    if name in ("k", "k_low", "k_high"):
        text = pc.if_else(pc.equal(small, RIGID), "rigid", text)
    return text

"""The compiled middle of a batch: faults, answers -> text; without the interpreter's lock."""

import numpy as np
from numpy.typing import NDArray

from service.compiled.digits import Bytes, decimal, write_decimal, write_number
from service.compiled.machine import inlined, load_eight, loop, store_eight
from service.compiled.scan import MISSING, NOT_A_NUMBER

__all__ = [
    "BOUND_FLAW",
    "MISSING_FLAW",
    "NUMBER_FLAW",
    "count_codes",
    "mark_flaws",
    "write_block",
    "write_names",
    "write_numbers",
    "write_rows",
]

_U = np.uint64
Array = NDArray[np.float64]
Codes = NDArray[np.int8]
Flaws = NDArray[np.uint8]

#: what is wrong with a case, plus the index of its field: not there, no number, out of bounds
MISSING_FLAW, NUMBER_FLAW, BOUND_FLAW = 10, 20, 30


@loop
def _flaw(mu0: float, fz: float, k: float, y0: float, omega: float, v0: float) -> int:
    """First fault of a case that has one: what is missing before what is no number before what is out of bounds."""
    values = (mu0, fz, k, y0, omega, v0)
    for field in range(6):
        if np.float64(values[field]).view(np.uint64) == MISSING:
            return MISSING_FLAW + field
    for field in range(6):
        if np.float64(values[field]).view(np.uint64) == NOT_A_NUMBER:
            return NUMBER_FLAW + field
    for field in range(6):
        x = values[field]
        if not (x > 0.0 or (x == 0.0 and field > 2)) or (x == np.inf and field != 2):
            return BOUND_FLAW + field
    return 0


@loop
def mark_flaws(
    mu0: Array, fz: Array, k: Array, y0: Array, omega: Array, v0: Array,
    mu_macro: Array, mu_ratio: Array, bound: Array, source: Codes, flaws: Flaws,
) -> int:  # fmt: skip
    """Give every bad case its code, NaN in the answers and -1 in ``source``; return how many are bad.

    Columns have the size n, or 1 where one value holds for all.  A case is bad that has a code already, or that the
    evaluation left without a source.
    """
    s0, s1, s2 = min(mu0.size - 1, 1), min(fz.size - 1, 1), min(k.size - 1, 1)
    s3, s4, s5 = min(y0.size - 1, 1), min(omega.size - 1, 1), min(v0.size - 1, 1)
    bad = 0
    for i in range(flaws.size):
        if flaws[i] != 0 or source[i] < 0:
            bad += 1
            if flaws[i] == 0:
                flaws[i] = _flaw(mu0[i * s0], fz[i * s1], k[i * s2], y0[i * s3], omega[i * s4], v0[i * s5])
            mu_macro[i] = np.nan
            mu_ratio[i] = np.nan
            bound[i] = np.nan
            source[i] = -1
    return bad


@loop
def count_codes(codes: Codes, counts: NDArray[np.int64]) -> None:
    """Add how many there are of each code to ``counts``; the last place is that of -1."""
    for i in range(codes.size):
        counts[codes[i]] += 1


@inlined
def _copy(out: Bytes, p: int, text: Bytes, start: int, stop: int) -> int:
    """Copy text[start:stop] eight bytes at a time, most texts without a loop: up to 24 behind it go, too."""
    for i in range(0, 24, 8):
        store_eight(out, p + i, load_eight(text, start + i))  # type: ignore[call-arg]
    for i in range(24, stop - start, 8):
        store_eight(out, p + i, load_eight(text, start + i))  # type: ignore[call-arg]
    return p + stop - start


@loop
def write_numbers(out: Bytes, p: int, values: Array) -> int:
    """Write the values with a comma behind each; null for what is not finite."""
    # The digits of the next one are begun before this one is written: the processor works on both at a time.
    last = values.size - 1
    digits, point = decimal(values[0]) if last >= 0 else (np.uint64(0), 0)
    for i in range(values.size):
        next_digits, next_point = decimal(values[_U(min(i + 1, last))])
        p = write_decimal(out, p, values[i], digits, point)
        out[_U(p)] = 44
        p += 1
        digits, point = next_digits, next_point
    return p


@loop
def write_names(out: Bytes, p: int, codes: Codes, names: Bytes, ends: NDArray[np.int64]) -> int:
    """Write ``names[ends[c]:ends[c + 1]]`` of each code with a comma behind it; null for a negative code."""
    for i in range(codes.size):
        c = codes[i]
        if c < 0:
            out[p], out[p + 1], out[p + 2], out[p + 3] = 110, 117, 108, 108
            p += 4
        else:
            p = _copy(out, p, names, ends[c], ends[c + 1])
        out[p] = 44
        p += 1
    return p


@loop
def write_block(
    out: Bytes,
    p: int,
    mu_macro: Array,
    mu_ratio: Array,
    bound: Array,
    codes: Codes,
    pieces: Bytes,
    piece_ends: NDArray[np.int64],
    regimes: Bytes,
    regime_ends: NDArray[np.int64],
    sources: Bytes,
    source_ends: NDArray[np.int64],
) -> int:
    """Write good cases as one object of lists.  ``pieces`` is the text before each list and at the end."""
    p = _copy(out, p, pieces, piece_ends[0], piece_ends[1])
    p = write_numbers(out, p, mu_macro) - 1  # what comes next overwrites the last comma
    p = _copy(out, p, pieces, piece_ends[1], piece_ends[2])
    p = write_numbers(out, p, mu_ratio) - 1
    p = _copy(out, p, pieces, piece_ends[2], piece_ends[3])
    p = write_names(out, p, codes, regimes, regime_ends) - 1
    p = _copy(out, p, pieces, piece_ends[3], piece_ends[4])
    p = write_numbers(out, p, bound) - 1
    p = _copy(out, p, pieces, piece_ends[4], piece_ends[5])
    p = write_names(out, p, codes, sources, source_ends) - 1
    return _copy(out, p, pieces, piece_ends[5], piece_ends[6])


@loop
def write_rows(
    out: Bytes,
    p: int,
    flaws: Flaws,
    behind: int,
    pieces: Bytes,
    piece_ends: NDArray[np.int64],
    numbers: NDArray[np.float64],
    codes: Codes,
    regimes: Bytes,
    regime_ends: NDArray[np.int64],
    sources: Bytes,
    source_ends: NDArray[np.int64],
) -> int:
    """Write one object a case with the byte ``behind`` behind it, null for a bad case.

    ``pieces`` is the constant text: before mu_macro, mu_ratio, regime, error_bound and source, before each further
    number, and at the end.  ``numbers`` (columns, n): mu_macro, mu_ratio, error_bound, further numbers.
    """
    for i in range(flaws.size):
        if flaws[i] != 0:
            out[p], out[p + 1], out[p + 2], out[p + 3] = 110, 117, 108, 108
            p += 4
        else:
            p = _copy(out, p, pieces, piece_ends[0], piece_ends[1])
            p = write_number(out, p, numbers[0, i])
            p = _copy(out, p, pieces, piece_ends[1], piece_ends[2])
            p = write_number(out, p, numbers[1, i])
            p = _copy(out, p, pieces, piece_ends[2], piece_ends[3])
            c = codes[i]
            p = _copy(out, p, regimes, regime_ends[c], regime_ends[c + 1])
            p = _copy(out, p, pieces, piece_ends[3], piece_ends[4])
            p = write_number(out, p, numbers[2, i])
            p = _copy(out, p, pieces, piece_ends[4], piece_ends[5])
            p = _copy(out, p, sources, source_ends[c], source_ends[c + 1])
            for j in range(3, numbers.shape[0]):
                p = _copy(out, p, pieces, piece_ends[j + 2], piece_ends[j + 3])
                p = write_number(out, p, numbers[j, i])
            last = piece_ends.size - 2
            p = _copy(out, p, pieces, piece_ends[last], piece_ends[last + 1])
        out[p] = behind
        p += 1
    return p

"""Compiled reader of batches in JSON: from text to arrays, without the interpreter's lock.

It accepts only the usual form: an object of the six inputs (``f`` for ``omega``), each a list of numbers or one number,
or a list of such objects with one number each.  ``k`` may be null or "rigid", an unused ``omega`` or ``f`` null; any
other null of one case is a NaN.  Other members of an object are skipped; the caller reads them.  Every other text has
size 0: :mod:`service.formats` reads it again and finds the reason.  Why no library is used here:
docs/decisions/0011-wire.md.

Decimal text becomes a double by the algorithm of D. Lemire, "Number parsing at a gigabyte per second", Software:
Practice and Experience 51 (2021), exactly rounded for up to 19 significant digits; numbers with more are not ordinary.
"""


import numpy as np
from numba import njit
from numpy.typing import NDArray

from .kernel import FIELDS, MOST_HZ, RAD_PER_CYCLE, Array

__all__ = ["BLOCK", "CASE", "MOST_SPANS", "NO_ROOM", "ROWS", "load", "read", "read_lines"]

Bytes = NDArray[np.uint8]
#: forms of a text: an object of numbers, one with lists, a list of objects
CASE, BLOCK, ROWS = range(3)
#: the size of a text that has more cases than there is room for
NO_ROOM = -1
#: members other than inputs that an object may have
MOST_SPANS = 3

_U = np.uint64
_SMALLEST, _LARGEST = -342, 308  # decimal exponents
_0, _1, _3, _8, _9, _10, _32, _52, _63 = (_U(n) for n in (0, 1, 3, 8, 9, 10, 32, 52, 63))
_LOW32, _NINE, _HIDDEN, _FRACTION = _U(2**32 - 1), _U(0x1FF), _U(1 << 52), _U((1 << 52) - 1)
_SIGN = _U(1 << 63)
# Eight digits at a time: "0" in each of eight bytes, their upper halves, what lifts ":" and beyond out of the digits,
# and the weights of pairs and of fours.
_ZEROS, _UPPER, _LIFT = _U(0x3030303030303030), _U(0xF0F0F0F0F0F0F0F0), _U(0x0606060606060606)
_PAIRS, _WEIGHT_1, _WEIGHT_2 = _U(0x000000FF000000FF), _U(0x000F424000000064), _U(0x0000271000000001)
_EIGHT = _U(100_000_000)
_NAMES = np.array([int.from_bytes(name.encode(), "little") for name in (*FIELDS, "f")], dtype=np.uint64)
_RIGID = np.frombuffer(b'"rigid"', dtype=np.uint8)
_INFINITE, _NAN = _U(0x7FF0_0000_0000_0000), _U(0x7FF8_0000_0000_0000)
_K, _OMEGA, _F = FIELDS.index("k"), FIELDS.index("omega"), len(FIELDS)


def _powers_of_five() -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
    """5^q, 128 bits with the first one set: truncated, reciprocals one unit above."""
    rows = []
    for q in range(_SMALLEST, _LARGEST + 1):
        power = 5 ** abs(q)
        if q < 0:
            bits = (power - 1).bit_length()
            value = 2 ** (bits + 127 if q >= -27 else 2 * bits + 128) // power + 1
        else:
            value = power << 128 >> 1
        value = value << 128 >> value.bit_length() if value.bit_length() < 128 else value >> (value.bit_length() - 128)
        rows.append((value >> 64, value & (2**64 - 1)))
    table = np.array(rows, dtype=np.uint64)
    return table[:, 0].copy(), table[:, 1].copy()


_FIVE_HIGH, _FIVE_LOW = _powers_of_five()
_compiled = njit(nogil=True, error_model="numpy")
_inlined = njit(nogil=True, error_model="numpy", forceinline=True)


@_inlined
def _high(a: np.uint64, b: np.uint64) -> np.uint64:
    """Upper 64 bits of the product."""
    a0, a1, b0, b1 = a & _LOW32, a >> _32, b & _LOW32, b >> _32
    middle = a1 * b0 + (a0 * b0 >> _32)
    return a1 * b1 + (middle >> _32) + (((middle & _LOW32) + a0 * b1) >> _32)


@_inlined
def _double(w: np.uint64, q: int) -> tuple[np.uint64, bool]:
    """Bits of w 10^q, w > 0, rounded to nearest even; False where it is beyond double range."""
    if q < _SMALLEST:
        return _0, True
    if q > _LARGEST:
        return _0, False
    # The exponent of w as a double gives its length, or one more where w was rounded up to a power of two.
    shift = max(1086 - int(np.float64(w).view(np.int64) >> 52), 0)
    w = w << _U(shift)
    if w < _SIGN:
        w = w << _1
        shift += 1
    row = _U(q - _SMALLEST)
    low, high = w * _FIVE_HIGH[row], _high(w, _FIVE_HIGH[row])
    if high & _NINE == _NINE:  # only then can the lower half of the power matter
        more = _high(w, _FIVE_LOW[row])
        low = low + more
        if more > low:
            high = high + _1
    upper = high >> _63
    down = upper + _9
    mantissa = high >> down
    exponent = ((217706 * q) >> 16) + 63 + int(upper) - shift + 1023
    if exponent <= 0:
        if exponent <= -63:
            return _0, True
        mantissa = mantissa >> _U(1 - exponent)
        return (mantissa + (mantissa & _1)) >> _1, True
    if low <= _1 and -4 <= q <= 23 and mantissa & _3 == _1 and mantissa << down == high:
        mantissa = mantissa ^ _1  # exactly between two doubles: to the even one
    mantissa = (mantissa + (mantissa & _1)) >> _1
    if mantissa >= _HIDDEN << _1:
        mantissa = _HIDDEN
        exponent += 1
    if exponent >= 0x7FF:
        return _0, False
    return (mantissa & _FRACTION) | (_U(exponent) << _52), True


@_inlined
def _space(text: Bytes, i: int) -> int:
    """Index of the next byte that is no white space."""
    while text[_U(i)] == 32 or text[_U(i)] == 10 or text[_U(i)] == 13 or text[_U(i)] == 9:
        i += 1
    return i


@_inlined
def _digits(text: Bytes, i: int, w: np.uint64) -> tuple[np.uint64, int]:
    """(w followed by the digits at ``i``, index after them)."""
    while i + 8 <= text.size:
        eight = _0
        for j in range(8):  # the compiler makes one load of it
            eight |= _U(text[_U(i + j)]) << _U(8 * j)
        if (eight & _UPPER) | ((eight + _LIFT & _UPPER) >> _U(4)) != _ZEROS | _ZEROS >> _U(4):
            break
        eight -= _ZEROS
        eight = eight * _10 + (eight >> _8)
        eight = ((eight & _PAIRS) * _WEIGHT_1 + (eight >> _U(16) & _PAIRS) * _WEIGHT_2) >> _32
        w = w * _EIGHT + eight
        i += 8
    c = text[_U(i)] - np.uint8(48)
    while c < 10:
        w = w * _10 + _U(c)
        i += 1
        c = text[_U(i)] - np.uint8(48)
    return w, i


@_inlined
def _number(text: Bytes, i: int) -> tuple[np.uint64, int]:
    """(bits of the JSON number at ``i``, index after it), or (0, -1) for anything else."""
    start = i
    negative = text[_U(i)] == 45
    if negative:
        i += 1
    first = i
    w, i = _digits(text, i, _0)
    if i == first or (text[_U(first)] == 48 and i - first > 1):
        return _0, -1
    count, q = i - first, 0
    if text[_U(i)] == 46:
        point = i + 1
        w, i = _digits(text, point, w)
        if i == point:
            return _0, -1
        q = point - i
        count += i - point
    if count > 19:  # zeros in front do not count; they are rare
        leading = first
        while text[_U(leading)] == 48 or text[_U(leading)] == 46:
            count -= int(text[_U(leading)] == 48)
            leading += 1
        if count > 19:
            return _0, -1
    if text[_U(i)] == 101 or text[_U(i)] == 69:
        i += 1
        minus = text[_U(i)] == 45
        if minus or text[_U(i)] == 43:
            i += 1
        power, end = _digits(text, i, _0)
        if end == i or end - i > 6:
            return _0, -1
        i = end
        q += -int(power) if minus else int(power)
    bits, finite = (_0, True) if w == _0 else _double(w, q)
    if not finite:
        return _0, -1
    if negative:
        bits = bits | _SIGN
    return bits, i if i > start else -1


@_inlined
def _null(text: Bytes, i: int) -> bool:
    found: bool = text[_U(i)] == 110 and text[_U(i + 1)] == 117 and text[_U(i + 2)] == 108 and text[_U(i + 3)] == 108
    return found


@_inlined
def _rigid(text: Bytes, i: int) -> int:
    """Index after ``null`` or ``"rigid"`` at ``i``, or -1."""
    if _null(text, i):
        return i + 4
    for j in range(_RIGID.size):
        if text[_U(i + j)] != _RIGID[_U(j)]:
            return -1
    return i + int(_RIGID.size)


@_compiled
def _values(text: Bytes, i: int, row: NDArray[np.uint64], stiff: bool) -> tuple[int, int]:
    """(index after the number or list at ``i``, its entries, 0 for a number), or (-1, _); (-2, _): no room."""
    n = 0
    listed = text[_U(i)] == 91
    if listed:
        i = _space(text, i + 1)
    while True:
        if n == row.size:
            return -2, n
        bits, end = _number(text, i)
        if end < 0:
            if stiff:
                bits, end = _INFINITE, _rigid(text, i)
            elif _null(text, i):
                bits, end = _NAN, i + 4
            if end < 0:
                return -1, n
        row[_U(n)] = bits
        if not listed:
            return end, 0
        n += 1
        i = _space(text, end)
        if text[_U(i)] == 93:
            return i + 1, n
        if text[_U(i)] != 44:
            return -1, n
        i = _space(text, i + 1)


@_inlined
def _field(text: Bytes, i: int) -> tuple[int, int]:
    """(index of the name in quotes at ``i``, index after it), or (-1, i)."""
    if text[_U(i)] != 34:
        return -1, i
    word, shift, j = _0, _0, i + 1
    while text[_U(j)] != 34:
        if j - i > 5 or text[_U(j)] < 32:
            return -1, i
        word = word | (_U(text[_U(j)]) << shift)
        shift = shift + _U(8)
        j += 1
    for field in range(7):
        if word == _NAMES[field]:
            return field, j + 1
    return -1, i


@_inlined
def _member_end(text: Bytes, i: int, stop: int) -> int:
    """Index of the comma or brace after the member at ``i``, or -1.  Its own text is not checked."""
    depth, quoted = 0, False
    while i < stop:
        c = text[_U(i)]
        if quoted:
            i += int(c == 92)
            quoted = c != 34
        elif c == 34:
            quoted = True
        elif depth == 0 and (c == 44 or c == 125):
            return i
        elif c == 91 or c == 123:
            depth += 1
        elif c == 93 or c == 125:
            depth -= 1
        i += 1
    return -1


@_inlined
def _repeat(words: NDArray[np.uint64], first: int, size: int, listed: int) -> bool:
    """Repeat the values that hold for all cases; False where one is out of bounds, which is no reason of one case."""
    for row in range(6):
        if not listed >> row & 1:
            bits = words[row, first]
            if bits > _INFINITE or (bits == _0 and row < 3):
                return False
            for case in range(first, first + size):
                words[row, case] = bits
    return True


@_inlined
def _hertz(words: NDArray[np.uint64], first: int, size: int) -> bool:
    """Turn f into omega; False where one is too large or null."""
    for case in range(first, first + size):
        f = _U(words[_OMEGA, case]).view(np.float64)
        if not f <= MOST_HZ:
            return False
        words[_OMEGA, case] = np.float64(f * RAD_PER_CYCLE).view(np.uint64)
    return True


@_compiled
def _object(
    text: Bytes, i: int, stop: int, words: NDArray[np.uint64], first: int, spans: NDArray[np.int64]
) -> tuple[int, int, int, int]:
    """(index after the object at ``i``, cases, bits of the inputs that came as lists, other members).

    0 cases: not ordinary.  ``words`` are the bits of the columns.
    """
    size, named, seen, listed, others = -1, 0, 0, 0, 0
    if text[_U(i)] != 123:
        return i, 0, 0, 0
    while True:
        start = _space(text, i + 1)
        field, i = _field(text, start)
        if field < 0:
            if others == spans.shape[0] or text[_U(start)] != 34:
                return i, 0, 0, 0
            i = _member_end(text, start, stop)
            if i < 0:
                return i, 0, 0, 0
            spans[others, 0], spans[others, 1] = start, i
            others += 1
        else:
            row = _OMEGA if field == _F else field
            if named >> field & 1:
                return i, 0, 0, 0
            named |= 1 << field
            i = _space(text, i)
            if text[_U(i)] != 58:
                return i, 0, 0, 0
            i = _space(text, i + 1)
            if row == _OMEGA and _null(text, i):
                i += 4
            elif seen >> row & 1:
                return i, 0, 0, 0
            else:
                i, n = _values(text, i, words[row, first:], row == _K)
                if i < 0 or (n and listed and n != size):
                    return i, NO_ROOM if i == -2 else 0, 0, 0
                seen |= 1 << row | int(field == _F) << 6
                if n:
                    size = n
                    listed |= 1 << row
            i = _space(text, i)
        if text[_U(i)] == 125:
            break
        if text[_U(i)] != 44:
            return i, 0, 0, 0
    if seen & 63 != 63:
        return i, 0, 0, 0
    if not listed:
        size = 1
    if listed and not _repeat(words, first, size, listed):
        return i, 0, 0, 0
    if seen >> 6 and not _hertz(words, first, size):
        return i, 0, 0, 0
    return i + 1, size, listed, others


@_compiled
def _lines(
    text: Bytes,
    lines: NDArray[np.int64],
    words: NDArray[np.uint64],
    edges: NDArray[np.int64],
    forms: NDArray[np.int64],
    spans: NDArray[np.int64],
) -> tuple[int, int, int]:
    """(lines that were read, 0 or NO_ROOM for the next one, members other than inputs in the last one)."""
    first, others = edges[0], 0  # edges[0] is 0: a literal 0 would compile the callees twice
    for n in range(lines.shape[0]):
        i, stop = _space(text, lines[n, 0]), lines[n, 1]
        rows = text[_U(i)] == 91
        while True:
            if rows:
                i = _space(text, i + 1)
            i, size, listed, others = _object(text, i, stop, words, first, spans)
            if size <= 0 or (rows and (listed or others)):
                return n, min(size, 0), 0
            first += size
            if not rows:
                break
            i = _space(text, i)
            if text[_U(i)] != 44:
                break
        if rows:
            if text[_U(i)] != 93:
                return n, 0, 0
            i += 1
        while i < stop and (text[_U(i)] == 32 or text[_U(i)] == 13 or text[_U(i)] == 9 or text[_U(i)] == 10):
            i += 1  # not beyond stop: there may be a newline and the next line
        if i != stop:
            return n, 0, 0
        edges[n + 1] = first
        forms[n] = ROWS if rows else BLOCK if listed else CASE
    return int(lines.shape[0]), 0, others


def read(text: Bytes, columns: Array) -> tuple[int, int, list[list[int]]]:
    """Read a text into columns.

    Parameters
    ----------
    text : NDArray[uint8]
        The last byte is no part of it: 0, or another that ends a number.  White space at both ends is skipped.
    columns : ndarray
        Shape (6, room); filled with the six inputs, k = inf for rigid contact.

    Returns
    -------
    size : int
        Number of cases; 0: not ordinary; NO_ROOM: too many.
    form : int
        CASE, BLOCK or ROWS.
    spans : list
        Where the texts of the members that are not inputs begin and end.
    """
    edges, form, spans = np.zeros(2, np.int64), np.zeros(1, np.int64), np.empty((MOST_SPANS, 2), np.int64)
    _, fault, others = _lines(text, np.array([[0, text.size - 1]]), columns.view(np.uint64), edges, form, spans)
    return int(edges[1]) or fault, int(form[0]), spans[:others].tolist()


def read_lines(text: Bytes, lines: NDArray[np.int64], columns: Array) -> tuple[list[int], list[int]]:
    """Read lines into columns, one after another, up to the first that is not ordinary or has other members.

    Parameters
    ----------
    text : NDArray[uint8]
        One byte follows the last line.
    lines : NDArray[int64]
        Shape (n, 2): where each begins and ends, without its newline.
    columns : ndarray
        Shape (6, room).

    Returns
    -------
    edges : list of int
        0, and for each line that was read the number of cases up to its end.
    forms : list of int
        CASE, BLOCK or ROWS for each of these lines.
    """
    edges, forms = np.zeros(len(lines) + 1, np.int64), np.empty(len(lines), np.int64)
    done, _, _ = _lines(text, lines, columns.view(np.uint64), edges, forms, np.empty((0, 2), np.int64))
    return edges[: done + 1].tolist(), forms[:done].tolist()


def load() -> None:
    """Compile or load the reader, so that no request waits for it."""
    read(np.frombuffer(bytearray(b"0"), dtype=np.uint8), np.empty((6, 1)))

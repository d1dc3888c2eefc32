"""Decimal text <-> double, compiled: exactly rounded both ways, without the interpreter's lock.

Reading is the algorithm of Eisel and Lemire (D. Lemire, "Number parsing at a gigabyte per second", Software: Practice
and Experience 51, 2021), writing is Schubfach (R. Giulietti, "The Schubfach way to render doubles", 2020): the
shortest text that reads back as the same number.  Text is a uint8 array that ends in PADDING 0 bytes, which are part
of no JSON token: every loop here stops at the first of them at the latest.

What takes the time is not arithmetic but guesses: a branch that goes either way costs as much as ten multiplications.
So both ways are computed where numbers of all digits toss a coin, and branches are left to what columns have in
common.  Indices that cannot be negative are given as uint64, for numba looks at the sign of others.
"""

import numpy as np
from numpy.typing import NDArray

from service.compiled.machine import (
    inlined,
    leading_zeros,
    load_eight,
    loop,
    multiply_high,
    other_than_digits,
    store_eight,
    trailing_zeros,
)

__all__ = [
    "HARD",
    "MALFORMED",
    "NO_NUMBER",
    "NUMBER",
    "OUT_OF_RANGE",
    "PADDING",
    "TEXT_WIDTH",
    "Bytes",
    "decimal",
    "read_number",
    "write_decimal",
    "write_number",
]

Bytes = NDArray[np.uint8]

#: what :func:`read_number` met: a number; NaN, Infinity or beyond double range; more digits than 64 bits hold
#: (left to the caller); no number at all; something that JSON has not
NUMBER, OUT_OF_RANGE, HARD, NO_NUMBER, MALFORMED = 0, 1, 2, 3, 4
#: bytes from its start on that :func:`write_number` may touch; its text has up to 24
TEXT_WIDTH = 27
#: bytes of 0 that must stand behind a text: as many as are read at a time.  What is copied needs as many behind it,
#: both where it comes from and where it goes
PADDING = 32

_U = np.uint64
_U0, _U1, _U2, _U3, _U4, _U10 = _U(0), _U(1), _U(2), _U(3), _U(4), _U(10)
_U8, _U16, _S32, _S52, _S56, _S63 = _U(8), _U(16), _U(32), _U(52), _U(56), _U(63)
_U40, _U100 = _U(40), _U(100)
_ZEROS, _PAIRS_LOW = _U(0x3030303030303030), _U(0x000000FF000000FF)
_PLACES = np.array([10**n for n in range(9)], dtype=np.uint64)
_TIMES_LOW, _TIMES_HIGH = _U(0x000F424000000064), _U(0x0000271000000001)  # 10^6 and 100, 10^4 and 1
_HIDDEN, _FRACTION, _EXPONENT = _U(1 << 52), _U((1 << 52) - 1), _U(0x7FF)
_MASK9 = _U(0x1FF)
_INFINITE, _ALL_BUT_SIGN = _U(0x7FF << 52), _U((1 << 63) - 1)

_SMALLEST, _LARGEST = -342, 308  # decimal exponents of reading
_FIRST, _LAST = -292, 324  # decimal exponents of writing


def _powers_of_five() -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
    """5^q for reading, 128 bits with the first one set, truncated; reciprocals one unit above."""
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


def _powers_of_ten() -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
    """10^k for writing, 128 bits with the first one set, rounded up."""
    rows = []
    for k in range(_FIRST, _LAST + 1):
        value = -(-(1 << (129 + (10**-k).bit_length())) // 10**-k) if k < 0 else 10**k << 128
        shift = value.bit_length() - 128
        value = -(-value >> shift)
        rows.append((value >> 64, value & (2**64 - 1)))
    table = np.array(rows, dtype=np.uint64)
    return table[:, 0].copy(), table[:, 1].copy()


_FIVE_HIGH, _FIVE_LOW = _powers_of_five()
_TEN_HIGH, _TEN_LOW = _powers_of_ten()
# "e-308" and the like as text, zero bytes behind, from the exponent _SMALLEST on
_EXPONENTS = np.array(
    [int.from_bytes(f"e{n}".encode(), "little") for n in range(_SMALLEST, _LARGEST + 1)], dtype=np.uint64
)
_NULL_POINT = _U(int.from_bytes(b"0.000000", "little"))
_MOST = 17  # digits that a double needs at most
_TENS = np.array([10**n for n in range(20)], dtype=np.uint64)
_TEN8, _TEN15, _TEN16, _U10000, _U48 = _U(10**8), _U(10**15), _U(10**16), _U(10000), _U(48)
# n * 10486 >> 20 is n // 100 for n < 10^4, and n * 103 >> 10 is n // 10 for n < 100
_U10486, _U103, _S20 = _U(10486), _U(103), _U(20)
_HUNDREDS, _TENTHS = _U(0x0000007F0000007F), _U(0x000F000F000F000F)


@inlined
def _high(a: np.uint64, b: np.uint64) -> np.uint64:
    """Upper 64 bits of the product."""
    upper: np.uint64 = multiply_high(a, b)  # type: ignore[call-arg]  # numba supplies the typing context
    return upper


@inlined
def _below(count: int) -> np.uint64:
    """Ones in the lowest ``count`` <= 8 bytes.  All shifts by up to 64 take two steps: one of 64 is not defined."""
    half = _U(4 * count)
    return (_U1 << half << half) - _U1


@inlined
def _append(w: np.uint64, eight: np.uint64, count: int) -> np.uint64:
    """w followed by the first ``count`` of eight bytes, which are digits; the others may be anything."""
    half = _U(32 - 4 * count)
    eight = (eight - _ZEROS) << half << half  # as if zeros stood in front
    eight = eight * _U10 + (eight >> _U8)  # pairs of digits, in every other byte
    eight = ((eight & _PAIRS_LOW) * _TIMES_LOW + ((eight >> _U16) & _PAIRS_LOW) * _TIMES_HIGH) >> _S32
    place: np.uint64 = _PLACES[_U(count)]
    return w * place + eight


@inlined
def _double(w: np.uint64, q: int) -> np.uint64:
    """Bits of w 10^q, w > 0, rounded to nearest even; those of infinity when it is beyond range."""
    if q < _SMALLEST:
        return _U0
    if q > _LARGEST:
        return _EXPONENT << _S52
    shift: int = leading_zeros(w)  # type: ignore[call-arg]
    w = w << _U(shift)
    row = _U(q - _SMALLEST)
    low, high = w * _FIVE_HIGH[row], _high(w, _FIVE_HIGH[row])
    if high & _MASK9 == _MASK9:  # only then can the lower half of the power matter
        more = _high(w, _FIVE_LOW[row])
        low = low + more
        if more > low:
            high = high + _U1
    upper = high >> _S63
    down = upper + _U(9)
    mantissa = high >> down
    exponent = ((217706 * q) >> 16) + 63 + int(upper) - shift + 1023
    if exponent <= 0:
        if exponent <= -63:
            return _U0
        mantissa = mantissa >> _U(1 - exponent)
        return (mantissa + (mantissa & _U1)) >> _U1  # reaching 2^52 it is the smallest normal number by itself
    if low <= _U1 and -4 <= q <= 23 and mantissa & _U3 == _U1 and mantissa << down == high:
        mantissa = mantissa ^ _U1  # exactly between two doubles: to the even one
    mantissa = (mantissa + (mantissa & _U1)) >> _U1
    if mantissa >= _HIDDEN << _U1:
        mantissa = _HIDDEN
        exponent += 1
    if exponent >= 0x7FF:
        return _EXPONENT << _S52
    return (mantissa & _FRACTION) | (_U(exponent) << _S52)


@loop
def _significant(text: Bytes, i: int, end: int) -> int:
    """Digits of the number in text[i:end] from the first that is not 0, up to its exponent."""
    count = 0
    while i < end:
        c = text[i]
        if c == 101 or c == 69:
            break
        if 48 <= c <= 57 and (count > 0 or c != 48):
            count += 1
        i += 1
    return count


@loop
def _matches(text: Bytes, i: int, word: bytes) -> bool:
    # One byte after another: the text's last 0 differs from every word, so nothing behind it is looked at.
    for j in range(len(word)):  # noqa: SIM110  (compiled code has no generators)
        if text[i + j] != word[j]:
            return False
    return True


@inlined
def _rounded(w: np.uint64, q: int, negative: bool, end: int) -> tuple[np.uint64, int, int]:
    """What :func:`read_number` returns for w 10^q with its sign."""
    bits = _U0 if w == _U0 else _double(w, q)
    if bits >> _S52 == _EXPONENT:
        return _U0, end, OUT_OF_RANGE
    if negative:
        bits = bits | (_U1 << _S63)
    return bits, end, NUMBER


@inlined
def _digits(text: Bytes, i: int, w: np.uint64) -> tuple[np.uint64, int]:
    """(w followed by the digits at ``i``, index behind them)."""
    while 48 <= text[i] <= 57:
        w = w * _U10 + _U(text[i] - 48)
        i += 1
    return w, i


@loop
def _read_slowly(text: Bytes, i: int) -> tuple[np.uint64, int, int]:
    """What :func:`read_number` returns, for anything: signs, more than 16 digits before the point, no number."""
    start = i
    negative = text[i] == 45
    if negative:
        i += 1
    c = text[i]
    w = _U0
    if c == 48:
        i += 1
        if 48 <= text[i] <= 57:
            return _U0, i, MALFORMED
    elif 49 <= c <= 57:
        w, i = _digits(text, i, w)
    elif c == 78 and not negative and _matches(text, i, b"NaN"):
        return _U0, i + 3, OUT_OF_RANGE
    elif c == 73 and _matches(text, i, b"Infinity"):
        return _U0, i + 8, OUT_OF_RANGE
    else:
        return _U0, i, MALFORMED if negative else NO_NUMBER
    q = 0
    if text[i] == 46:
        i += 1
        first = i
        w, i = _digits(text, i, w)
        if i == first:
            return _U0, i, MALFORMED
        q = first - i
    many = i - start > 19
    if text[i] == 101 or text[i] == 69:
        i += 1
        minus = text[i] == 45
        if minus or text[i] == 43:
            i += 1
        if not 48 <= text[i] <= 57:
            return _U0, i, MALFORMED
        exponent = 0
        while 48 <= text[i] <= 57:
            if exponent < 100_000_000:
                exponent = 10 * exponent + int(text[i] - 48)
            i += 1
        q += -exponent if minus else exponent
    if many and _significant(text, start, i) > 19:
        return _U0, i, HARD
    return _rounded(w, q, negative, i)


@inlined
def read_number(text: Bytes, i: int) -> tuple[np.uint64, int, int]:
    """(bits of the double, index behind it, what it was) of the JSON number that begins at ``i``.

    NaN, Infinity and -Infinity count as numbers out of range.  Bits are meaningful for NUMBER only.
    """
    # Where the parts end is seen in one mask of 32 bytes, before any digit is looked at: so the processor gets to the
    # next number while it computes this one.
    others: np.uint64 = other_than_digits(text, i)  # type: ignore[call-arg]
    before: int = trailing_zeros(others)
    point = text[_U(i + before)] == 46
    if before == 0 or (point and before > 16):
        return _read_slowly(text, i)
    # Eight digits and eight more; the point goes.
    first: np.uint64 = load_eight(text, i)
    second: np.uint64 = load_eight(text, i + 8)
    wrong = (before > 1) & (text[_U(i)] == 48)
    end, count, third = before, before, i + 16
    if point:
        others = others & (others - _U1)
        end = trailing_zeros(others)
        count = end - 1
        wrong |= count == before
        third += 1
        moved: np.uint64 = load_eight(text, i + 9)
        if before > 8:
            low = _below(before - 8)
            second = (second & low) | (moved & ~low)
        else:
            low = _below(before)
            first = (first & low) | (load_eight(text, i + 1) & ~low)
            second = moved
    zeros: int = trailing_zeros(first - _ZEROS) >> 3
    wrong |= (count > 24) | (count - zeros > 19)
    q = before - count
    last = text[_U(i + end)]
    if last == 101 or last == 69:
        at = end + 1
        sign = text[_U(i + at)]
        others = others & (others - _U1)
        end = trailing_zeros(others)
        if end == at:
            wrong |= (sign != 45) & (sign != 43)
            at += 1
            others = others & (others - _U1)
            end = trailing_zeros(others)
        word: np.uint64 = load_eight(text, i + at)
        exponent = int(_append(_U0, word, min(end - at, 8)))
        q += -exponent if sign == 45 else exponent
        wrong |= (end == at) | (end - at > 8)
    if wrong | (end >= 32):
        return _read_slowly(text, i)
    if count <= 8:
        w = _append(_U0, first, count)
    else:
        more = min(count - 8, 8)
        w = _append(_U0, first, 8)
        w = _append(w, second, more)
        w = _append(w, load_eight(text, third), count - 8 - more)
    return _rounded(w, q, False, i + end)


@inlined
def _round_to_odd(high: np.uint64, low: np.uint64, c: np.uint64) -> np.uint64:
    y0 = high * c + _high(low, c)
    y1 = _high(high, c)
    if y0 < high * c:
        y1 = y1 + _U1
    return y1 | (_U1 if y0 > _U1 else _U0)


@inlined
def _shortest(bits: np.uint64) -> tuple[np.uint64, int]:
    """(digits, k) with the shortest digits 10^k that round to the positive, finite double of these bits."""
    fraction, biased = bits & _FRACTION, int((bits >> _S52) & _EXPONENT)
    if biased != 0:  # also of what is not finite, for which the powers of ten suffice as well
        c, q = fraction | _HIDDEN, biased - 1075
        if 0 <= -q < 53 and c & ((_U1 << _U(-q)) - _U1) == _U0:
            return c >> _U(-q), 0
    else:
        c, q = fraction, -1074
    odd = c & _U1
    closer = fraction == _U0 and biased > 1
    k = (q * 1262611 - (524031 if closer else 0)) >> 22
    h = _U(q + ((-k * 1741647) >> 19) + 1)
    high, low = _TEN_HIGH[-k - _FIRST], _TEN_LOW[-k - _FIRST]
    left = _U4 * c - (_U1 if closer else _U2)
    lower = _round_to_odd(high, low, left << h) + odd
    middle = _round_to_odd(high, low, (_U4 * c) << h)
    upper = _round_to_odd(high, low, (_U4 * c + _U2) << h) - odd
    s = middle >> _U2  # 16 or 17 digits, one less if the last can be 0: any of these as often as not
    tens = s // _U10 * _U10
    below, above = lower <= _U4 * tens, _U4 * tens + _U40 <= upper
    shorter = (below != above) & (s >= _U10)
    tens = tens + _U10 * _U(above)
    below, above = lower <= _U4 * s, _U4 * s + _U4 <= upper
    nearer = (middle & _U3) + (s & _U1) > _U2  # to the even one where it is half
    s = s + _U(((below != above) & above) | ((below == above) & nearer))
    return (tens if shorter else s), k


@inlined
def _eight_digits(value: np.uint64) -> np.uint64:
    """The digits of a number below 10^8, one a byte, the first one lowest; halves, quarters, eighths side by side."""
    x = value // _U10000 | (value % _U10000) << _S32
    y = ((x * _U10486) >> _S20) & _HUNDREDS
    x = y | (x - _U100 * y) << _U16
    y = ((x * _U103) >> _U10) & _TENTHS
    return y | (x - _U10 * y) << _U8


@inlined
def _opened(eight: np.uint64, at: int) -> np.uint64:
    """Eight bytes with those from ``at`` <= 8 on moved one place up, the last one out."""
    low = _below(at)
    return (eight & low) | (eight & ~low) << _U8


@inlined
def decimal(x: float) -> tuple[np.uint64, int]:
    """(17 digits, how many of them stand before the point) of the shortest text of |x|; anything for 0 and null."""
    digits, k = _shortest(np.float64(x).view(np.uint64) & _ALL_BUT_SIGN)
    length = _MOST
    if digits < _TEN15:  # an integer or a tiny number
        width: int = leading_zeros(digits)  # type: ignore[call-arg]
        length = ((64 - width) * 1233) >> 12  # 1233/4096 is log10(2) to the accuracy that 64 bits need
        length += int(digits >= _TENS[_U(length)])
        digits = digits * _TENS[_U(_MOST - length)]
    else:
        fewer = digits < _TEN16
        length = _MOST - int(fewer)
        digits = digits * _U10 if fewer else digits
    return digits, length + k


@inlined
def write_decimal(out: Bytes, p: int, x: float, digits: np.uint64, point: int) -> int:
    """Write x, of which :func:`decimal` said the rest, or null for what is not finite; return the index behind it."""
    bits = np.float64(x).view(np.uint64)
    if bits & _INFINITE == _INFINITE:
        out[p], out[p + 1], out[p + 2], out[p + 3] = 110, 117, 108, 108
        return p + 4
    if bits >> _S63 == _U1:
        out[p] = 45
        p += 1
    if x == 0.0:
        out[p], out[p + 1], out[p + 2] = 48, 46, 48
        return p + 3
    # all 17 digits, zeros behind, and how many there are without those zeros
    upper = digits // _TEN8
    first, high, low = upper // _TEN8, _eight_digits(upper % _TEN8), _eight_digits(digits % _TEN8)
    zeros: int = leading_zeros(low)  # type: ignore[call-arg]
    count = 17 - (zeros >> 3)
    if low == _U0:
        zeros = leading_zeros(high)
        count = 9 - (zeros >> 3)
    first, high, low = first + _U48, high + _ZEROS, low + _ZEROS
    if -4 < point <= 0:
        store_eight(out, p, _NULL_POINT)
        p += 2 - point
        out[_U(p)] = np.uint8(first)
        store_eight(out, p + 1, high)
        store_eight(out, p + 9, low)
        return p + count
    if 0 < point <= 16:
        start, rest = first | high << _U8, high >> _S56 | low << _U8
        # from the point on one place to the right
        store_eight(out, p + 10, low)
        if point < 8:
            store_eight(out, p + 2, high)
            store_eight(out, p, _opened(start, point))
        else:
            store_eight(out, p, start)
            store_eight(out, p + 8, _opened(rest, point - 8))
        out[_U(p + point)] = 46
        return p + max(count + 1, point + 2)
    out[_U(p)], out[_U(p + 1)] = np.uint8(first), 46
    store_eight(out, p + 2, high)
    store_eight(out, p + 10, low)
    p += count + int(count > 1)
    exponent = _EXPONENTS[_U(point - 1 - _SMALLEST)]
    store_eight(out, p, exponent)
    zeros = leading_zeros(exponent)
    return p + 8 - (zeros >> 3)


@loop
def write_number(out: Bytes, p: int, x: float) -> int:
    """Write one number, or null for what is not finite; return the index behind it."""
    digits, point = decimal(x)
    return write_decimal(out, p, x, digits, point)

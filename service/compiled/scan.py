"""Scanner of JSON batches, compiled: text straight into columns, without Python objects or the interpreter's lock.

Cases land in an array (6, capacity) of doubles seen as uint64.  An entry that is no legal number leaves a NaN there
whose payload says why, so one array carries values and faults, and a repeated key simply writes again.  A null ``k``
is infinity: rigid contact.  Text ends in a 0 byte, where every loop stops.
"""

import numpy as np
from numpy.typing import NDArray

from friction.nondim import FIELDS
from service.compiled.digits import HARD, MALFORMED, NO_NUMBER, NUMBER, OUT_OF_RANGE, Bytes, read_number
from service.compiled.machine import inlined, load_eight, loop

__all__ = [
    "BROKEN",
    "DEEP",
    "FULL",
    "HARD_ROOM",
    "LONG",
    "MISSING",
    "NOT_A_NUMBER",
    "NO_OBJECT",
    "OUT_OF_BOUNDS",
    "PAUSE",
    "RIGID",
    "SOUND",
    "UNKNOWN",
    "read_block",
    "read_list",
    "read_rows",
    "skip_space",
    "skip_value",
]

Words = NDArray[np.uint64]
Places = NDArray[np.int64]

_NAN = 0x7FF8_0000_0000_0000
#: bits of an entry that is no number, beyond the doubles (or NaN), not there
NOT_A_NUMBER, OUT_OF_BOUNDS, MISSING = np.uint64(_NAN + 1), np.uint64(_NAN + 2), np.uint64(_NAN + 3)
#: bits of a number that waits for the caller
LONG = np.uint64(_NAN + 4)
#: bits of k for rigid contact
RIGID = np.uint64(0x7FF0_0000_0000_0000)

#: how a scan ended: at the closing bracket; no room for another case; text that is not JSON, there; nested too deeply;
#: numbers of more digits than 64 bits hold are waiting for the caller
SOUND, FULL, BROKEN, DEEP, PAUSE = 0, 1, 2, 3, 4
#: what makes a row no case at all
NO_OBJECT, UNKNOWN = 1, 2
#: how many long numbers a scan leaves to its caller at a time
HARD_ROOM = 1024

_DEPTH = 128  # bits of two words
_U = np.uint64
_ZERO, _ONE, _TOP = _U(0), _U(1), _U(63)
_K = FIELDS.index("k")  # the field that may be null
# the names with their quotes, as words of eight bytes
_NAMES = [f'"{name}"'.encode() for name in FIELDS]
_NAME_WORDS = np.array([int.from_bytes(name, "little") for name in _NAMES], dtype=np.uint64)
_NAME_MASKS = np.array([(1 << 8 * len(name)) - 1 for name in _NAMES], dtype=np.uint64)
_NAME_LENGTHS = np.array([len(name) for name in _NAMES])


@inlined
def skip_space(text: Bytes, i: int) -> int:
    """Index of the next byte that is not white space."""
    c = text[i]
    while c == 32 or c == 10 or c == 13 or c == 9:
        i += 1
        c = text[i]
    return i


@loop
def _skip_string(text: Bytes, i: int) -> int:
    """Index behind the string that begins at ``i``, or minus one minus where it is no string."""
    i += 1
    while True:
        c = text[i]
        if c == 34:
            return i + 1
        if c < 32:
            return -1 - i
        if c == 92:
            i += 1
            c = text[i]
            if c == 117:
                for _ in range(4):
                    i += 1
                    h = text[i]
                    if not (48 <= h <= 57 or 65 <= h <= 70 or 97 <= h <= 102):
                        return -1 - i
            elif not (c == 34 or c == 92 or c == 47 or c == 98 or c == 102 or c == 110 or c == 114 or c == 116):
                return -1 - i
        i += 1


@loop
def _skip_word(text: Bytes, i: int) -> int:
    """Index behind true, false or null, or minus one minus where it is none of them."""
    c = text[i]
    if c == 116:
        if text[i + 1] == 114 and text[i + 2] == 117 and text[i + 3] == 101:
            return i + 4
    elif c == 110:
        if text[i + 1] == 117 and text[i + 2] == 108 and text[i + 3] == 108:
            return i + 4
    elif c == 102:  # noqa: SIM102  (in the form of the other two)
        if text[i + 1] == 97 and text[i + 2] == 108 and text[i + 3] == 115 and text[i + 4] == 101:
            return i + 5
    return -1 - i


@loop
def _skip_leaf(text: Bytes, i: int) -> int:
    """Index behind a string, a number or a word, or minus one minus where it is none."""
    c = text[i]
    if c == 34:
        return _skip_string(text, i)
    if c == 45 or 48 <= c <= 57 or c == 78 or c == 73:
        _, end, kind = read_number(text, i)
        return -1 - end if kind in (MALFORMED, NO_NUMBER) else end
    return _skip_word(text, i)


@loop
def skip_value(text: Bytes, i: int) -> tuple[int, int]:
    """(index behind the JSON value at ``i``, SOUND), or (where, BROKEN or DEEP)."""
    # What is open, one bit each, the innermost lowest: set for an object.
    outer = inner = np.uint64(0)
    depth = 0
    while True:
        # a value is due at i
        c = text[i]
        opened = c == 91 or c == 123
        if opened:
            if depth == _DEPTH:
                return i, DEEP
            outer = (outer << _ONE) | (inner >> _TOP)
            inner = (inner << _ONE) | np.uint64(c == 123)
            depth += 1
            i = skip_space(text, i + 1)
            opened = text[i] != c + 2
            if not opened:
                depth -= 1
                i += 1
                inner = (inner >> _ONE) | (outer << _TOP)
                outer = outer >> _ONE
        else:
            i = _skip_leaf(text, i)
            if i < 0:
                return -1 - i, BROKEN
        if not opened:
            # a value is complete: close what ends here, or go on behind a comma
            while True:
                if depth == 0:
                    return i, SOUND
                i = skip_space(text, i)
                if text[i] == (125 if inner & _ONE else 93):
                    depth -= 1
                    i += 1
                    inner = (inner >> _ONE) | (outer << _TOP)
                    outer = outer >> _ONE
                elif text[i] == 44:
                    i = skip_space(text, i + 1)
                    break
                else:
                    return i, BROKEN
        if inner & _ONE:
            if text[i] != 34:
                return i, BROKEN
            i = _skip_string(text, i)
            if i < 0:
                return -1 - i, BROKEN
            i = skip_space(text, i)
            if text[i] != 58:
                return i, BROKEN
            i = skip_space(text, i + 1)


@inlined
def _read_entry(text: Bytes, i: int, nullable: bool) -> tuple[np.uint64, int, int]:
    """(bits, index behind the value at ``i``, NUMBER or HARD), or (0, where, MALFORMED or minus DEEP)."""
    bits, end, kind = read_number(text, i)
    if kind == NUMBER:
        return bits, end, kind
    if kind == HARD:
        return LONG, end, kind
    if kind == OUT_OF_RANGE:
        return OUT_OF_BOUNDS, end, NUMBER
    if kind == MALFORMED:
        return np.uint64(0), end, MALFORMED
    if nullable and text[i] == 110:
        end = _skip_word(text, i)
        if end < 0:
            return np.uint64(0), i, MALFORMED
        return RIGID, end, NUMBER
    end, state = skip_value(text, i)
    if state != SOUND:
        return np.uint64(0), end, MALFORMED if state == BROKEN else -DEEP
    return NOT_A_NUMBER, end, NUMBER


@loop
def read_list(
    text: Bytes, i: int, column: Words, count: int, nullable: bool, hard: Places, waiting: int
) -> tuple[int, int, int, int]:
    """Read entries of a list into ``column`` from index ``count`` on; ``i`` is where an entry or the end is due.

    Returns
    -------
    i, count, waiting, state : int
        Where it stopped, entries so far, numbers in ``hard`` (rows of case, field, start, end), how it ended.
    """
    i = skip_space(text, i)
    if count == 0 and text[i] == 93:
        return i + 1, count, waiting, SOUND
    while True:
        if count == column.size:
            return i, count, waiting, FULL
        if waiting == hard.shape[0]:
            return i, count, waiting, PAUSE
        bits, end, kind = _read_entry(text, i, nullable)
        if kind != NUMBER:
            if kind != HARD:
                return end, count, waiting, BROKEN if kind == MALFORMED else DEEP
            hard[waiting, 0], hard[waiting, 1], hard[waiting, 2], hard[waiting, 3] = count, 0, i, end
            waiting += 1
        column[_U(count)] = bits
        count += 1
        i = end
        if text[_U(i)] == 44 and text[_U(i + 1)] > 32:  # the common case, without looking for white space
            i += 1
            continue
        i = skip_space(text, i)
        if text[i] == 93:
            return i + 1, count, waiting, SOUND
        if text[i] != 44:
            return i, count, waiting, BROKEN
        i = skip_space(text, i + 1)


@inlined
def _field(text: Bytes, i: int) -> tuple[int, int]:
    """(index among FIELDS of the name that begins at ``i`` with its quote, index behind it), or (-1, i)."""
    word: np.uint64 = load_eight(text, i)  # type: ignore[call-arg]
    for field in range(6):
        if word & _NAME_MASKS[field] == _NAME_WORDS[field]:
            return field, i + _NAME_LENGTHS[field]
    return -1, i


@loop
def read_block(text: Bytes, i: int, stop: int, words: Words, first: int, hard: Places) -> int:
    """Read text[i:stop], one object of lists and plain numbers under the names of the inputs, from case ``first`` on.

    A quick look at what most lines of a stream are, where lines lie behind one another in ``text``.  Returns how many
    cases it is; -1 where ``words`` (6, capacity) has no room for them; 0 for anything out of the ordinary.
    """
    size = -1
    seen = listed = 0
    i = skip_space(text, i)
    if text[i] != 123:
        return 0
    while True:
        i = skip_space(text, i + 1)
        field, i = _field(text, i)
        if field < 0 or seen >> field & 1:
            return 0
        seen |= 1 << field
        i = skip_space(text, i)
        if text[i] != 58:
            return 0
        i = skip_space(text, i + 1)
        if text[i] == 91:
            i, count, waiting, state = read_list(text, i + 1, words[field, first:], 0, field == _K, hard, 0)
            if state == FULL:
                return -1
            if state != SOUND or waiting > 0 or count == 0 or (listed and count != size):
                return 0
            size = count
            listed |= 1 << field
        else:
            bits, i, kind = _read_entry(text, i, field == _K)
            if kind != NUMBER or bits > RIGID or (bits == RIGID and field != _K) or (bits == _ZERO and field < 3):
                return 0
            if first == words.shape[1]:
                return -1
            words[field, first] = bits
        i = skip_space(text, i)
        if text[i] == 125:
            break
        if text[i] != 44:
            return 0
    i += 1
    while i < stop and (text[i] == 32 or text[i] == 13 or text[i] == 9):
        i += 1
    if i != stop or listed == 0 or seen | 1 << _K != 63:
        return 0
    for field in range(6):
        if not listed >> field & 1:
            bits = words[field, first] if seen >> field & 1 else RIGID
            for j in range(first, first + size):
                words[field, j] = bits
    return size


@loop
def _read_row(
    text: Bytes, i: int, cases: Words, flaws: NDArray[np.uint8], names: Places, case: int, hard: Places, waiting: int
) -> tuple[int, int, int]:
    """(index behind the object at ``i``, numbers waiting, SOUND), or (where, _, BROKEN or DEEP)."""
    for field in range(6):
        cases[field, case] = MISSING
    cases[_K, case] = RIGID
    i = skip_space(text, i + 1)
    if text[i] == 125:
        return i + 1, waiting, SOUND
    while True:
        if text[i] != 34:
            return i, waiting, BROKEN
        start = i
        field, i = _field(text, i)
        if field < 0:
            i = _skip_string(text, i)
            if i < 0:
                return -1 - i, waiting, BROKEN
        stop = i
        i = skip_space(text, i)
        if text[i] != 58:
            return i, waiting, BROKEN
        i = skip_space(text, i + 1)
        if field < 0:
            if flaws[case] == 0:
                flaws[case] = UNKNOWN
                names[case] = start
            end, state = skip_value(text, i)
            if state != SOUND:
                return end, waiting, state
        else:
            bits, end, kind = _read_entry(text, i, field == _K)
            if kind != NUMBER:
                if kind != HARD:
                    return end, waiting, BROKEN if kind == MALFORMED else DEEP
                hard[waiting, 0], hard[waiting, 1], hard[waiting, 2], hard[waiting, 3] = case, field, i, end
                waiting += 1
                if waiting == hard.shape[0]:  # a name repeated more often than any honest row repeats it
                    return stop, waiting, DEEP
            cases[field, case] = bits
        i = skip_space(text, end)
        if text[i] == 125:
            return i + 1, waiting, SOUND
        if text[i] != 44:
            return i, waiting, BROKEN
        i = skip_space(text, i + 1)


@loop
def read_rows(
    text: Bytes,
    i: int,
    cases: Words,
    flaws: NDArray[np.uint8],
    names: Places,
    count: int,
    hard: Places,
    waiting: int,
) -> tuple[int, int, int, int]:
    """Read rows into ``cases`` (6, capacity) from index ``count`` on; ``i`` is where a row or the end is due.

    ``flaws`` (capacity,) gets NO_OBJECT or UNKNOWN, ``names`` where the
    unknown name stands.  Returns what :func:`read_list` returns.
    """
    i = skip_space(text, i)
    if count == 0 and text[i] == 93:
        return i + 1, count, waiting, SOUND
    while True:
        if count == flaws.size:
            return i, count, waiting, FULL
        if waiting > hard.shape[0] // 2:
            return i, count, waiting, PAUSE
        flaws[count] = 0
        if text[i] == 123:
            i, waiting, state = _read_row(text, i, cases, flaws, names, count, hard, waiting)
        else:
            flaws[count] = NO_OBJECT
            i, state = skip_value(text, i)
        if state != SOUND:
            return i, count, waiting, state
        count += 1
        i = skip_space(text, i)
        if text[i] == 93:
            return i + 1, count, waiting, SOUND
        if text[i] != 44:
            return i, count, waiting, BROKEN
        i = skip_space(text, i + 1)

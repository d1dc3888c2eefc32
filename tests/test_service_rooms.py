"""Memory for bodies: used again, but never while anybody looks at it, and no more of it than may be."""

import gc

import numpy as np
import pyarrow as pa
import pytest

from service.compiled.digits import PADDING
from service.rooms import Rooms

MB = 2**20


def place(text):
    return text.ctypes.data


@pytest.mark.parametrize("length", [0, 1, 1000, MB - PADDING - 1, MB - PADDING, MB, 3 * MB + 17])
def test_zeros_follow_the_text(length):
    rooms = Rooms(4 * MB)
    for _ in range(2):
        text = rooms.take(length)
        assert text.size == length + PADDING
        assert not text[length:].any()
        text[:] = 255  # what the next one finds
        del text


def test_what_nobody_has_is_used_again():
    rooms = Rooms(16 * MB)
    text = rooms.take(5 * MB)
    where = place(text)
    del text
    text = rooms.take(5 * MB - 1000)
    assert place(text) == where
    smaller = rooms.take(2 * MB)
    first = place(smaller)
    del text, smaller
    assert place(rooms.take(MB)) == first  # the smallest that fits


@pytest.mark.parametrize(
    "view", [lambda text: text[10:20], lambda text: text.view(np.int8)[::2], lambda text: text.data, pa.py_buffer]
)
def test_what_anybody_looks_at_is_not_given_away(view):
    rooms = Rooms(16 * MB)
    text = rooms.take(2 * MB)
    text[:] = 1
    where, seen = place(text), view(text)
    del text
    gc.collect()
    other = rooms.take(2 * MB)
    assert place(other) != where
    other[:] = 2
    assert set(bytes(seen)) == {1}


def test_no_more_is_kept_than_may_be():
    rooms = Rooms(4 * MB)
    texts = [rooms.take(2 * MB - PADDING) for _ in range(5)]
    places = [place(text) for text in texts]
    for text in texts:
        text[:] = 1
    kept = {room.size for room in rooms._kept}
    assert (len(rooms._kept), kept) == (2, {2 * MB})
    rooms.empty()
    assert len(rooms._kept) == 2  # both are in use
    del texts, text
    assert place(rooms.take(MB)) in places
    rooms.empty()
    assert rooms._kept == []

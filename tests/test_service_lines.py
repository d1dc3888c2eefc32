"""Lines of a stream: blocks that are answered together against each line by itself; memory that is used again."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from friction.nondim import FIELDS
from service.answers import answer_cases, signature
from service.codecs import columns_text, is_rows, read_batch, row_text, rows_text, terminated
from service.compiled.digits import PADDING
from service.compiled.scan import HARD_ROOM, read_block
from service.intake import Options
from service.shelf import Shelf
from service.streams import LineAnswers, Lines

LIMIT = 40


@pytest.fixture(scope="module")
def shelf(surrogate):
    loaded = Shelf([surrogate.path])
    loaded.load()
    return loaded


class OneByOne(LineAnswers):
    """Takes no line for a block."""

    def _read(self, *_):
        return 0


def stream_of(kind, shelf, counted=None):
    def answer(text):
        cases, _ = read_batch(text, LIMIT)
        table = shelf.pick()
        answers = answer_cases(table, cases, ())
        if counted is not None:
            counted.append((answers.size, answers.n_bad))
        if not is_rows(text) and not cases.listed:
            return row_text(answers, signature(table))
        return (rows_text if is_rows(text) else columns_text)(answers, signature(table))

    def count(_table, answers, bad):
        if counted is not None:
            counted.append((answers.size, bad))

    return kind(shelf, Options(), LIMIT, answer, count)


def answered(kind, shelf, text, counted=None):
    lines = Lines()
    lines.put(text)
    spans = lines.take(len(text) + 1, last=True)
    if not text.endswith(b"\n"):
        spans += lines.take(len(text) + 1, last=True)
    return b"".join(stream_of(kind, shelf, counted).pieces(lines, spans, 0))


plain = st.floats(1e-9, 1e9) | st.integers(1, 10**6)
entries = st.lists(plain, min_size=1, max_size=12)
odd_entries = st.lists(
    plain | st.sampled_from([0, -1, None, True, "1", 10**400, 123456789012345678901234, [1]]), max_size=4
)
blocks = st.integers(1, 12).flatmap(
    lambda n: st.dictionaries(
        st.sampled_from(FIELDS), st.lists(plain, min_size=n, max_size=n) | plain, min_size=5, max_size=6
    )
)
odd = st.dictionaries(
    st.sampled_from((*FIELDS, "include", "tolerance", "x")), entries | odd_entries | plain | st.none(), max_size=7
)
separators = st.sampled_from([(",", ":"), (" , ", "\t: "), (",\r", ":")])
documents = blocks | blocks | odd | st.just([]) | st.just(17)


@settings(max_examples=300, deadline=None)
@given(batch=st.lists(st.tuples(documents, separators), max_size=12), end=st.sampled_from(["", "\n", "\r\n"]))
def test_blocks_are_answered_like_lines_by_themselves(shelf, batch, end):
    text = "\n".join(json.dumps(value, separators=kind) for value, kind in batch) + end
    together, alone = [], []
    assert answered(LineAnswers, shelf, text.encode(), together) == answered(OneByOne, shelf, text.encode(), alone)
    assert np.sum(together, axis=0).tolist() == np.sum(alone, axis=0).tolist()  # each case is counted, once


CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": [0.01, 0.02]}


def block(text, room=8, first=0, stop=None):
    words = np.zeros((6, room), dtype=np.uint64)
    size = read_block(
        terminated(text), 0, len(text) if stop is None else stop, words, first, np.empty((HARD_ROOM, 4), dtype=np.int64)
    )
    return size, words.view(np.float64)[:, first : first + max(size, 0)]


def test_a_block_has_lists_and_numbers_that_hold_for_all():
    size, values = block(json.dumps(CASE).encode(), first=3)
    assert (size, values[:, 0].tolist(), values[5].tolist()) == (2, [0.3, 10.0, 1e6, 2e-6, 1.3e5, 0.01], [0.01, 0.02])
    for k in ({}, {"k": None}, {"k": [None, None]}):
        rigid = {name: value for name, value in CASE.items() if name != "k"} | k
        assert block(json.dumps(rigid).encode())[1][2].tolist() == [np.inf, np.inf]


@pytest.mark.parametrize(
    "change",
    [
        {"mu0": 0}, {"Fz": -1.0}, {"y0": -0.0}, {"k": 10**400}, {"v0": [0.1, 10**22 + 1]}, {"v0": []}, {"v0": 0.1},
        {"y0": [1e-6]}, {"y0": [1e-6] * 3}, {"y0": None}, {"y0": True}, {"y0": "1"}, {"include": ["groups"]}, {"y": 1},
    ],
)  # fmt: skip
def test_what_is_out_of_the_ordinary_is_no_block(change):
    changed = CASE | change
    if change == {"v0": [0.1, 10**22 + 1]}:  # more digits than 64 bits hold
        assert len(str(changed["v0"][1])) > 20
    assert block(json.dumps(changed).encode())[0] == 0


def test_a_damaged_block_is_no_block():
    text = json.dumps(CASE).encode()
    for stop in range(len(text)):
        assert block(text[:stop])[0] == 0
        assert block(text, stop=stop)[0] == 0  # it goes on beyond its line
    assert block(text + b"}")[0] == block(text + b" 1")[0] == block(b"1" + text)[0] == 0
    assert block(text.replace(b"Fz", b"mu0"))[0] == block(text.replace(b"Fz", b'\\u0046z"'))[0] == 0
    assert block(text.replace(b" ", b"  ") + b" \t\r")[0] == 2


def test_a_block_needs_room_for_all_its_cases():
    text = json.dumps(CASE).encode()
    assert [block(text, room=4, first=first)[0] for first in range(5)] == [2, 2, 2, -1, -1]


@settings(max_examples=200, deadline=None)
@given(
    texts=st.lists(st.binary(max_size=40).map(lambda text: text.replace(b"\n", b"")), max_size=20),
    sizes=st.lists(st.integers(1, 60), min_size=1),
    most=st.integers(1, 100),
)
def test_lines_come_out_as_they_went_in(texts, sizes, most):
    text = b"\n".join(texts)
    lines, found, start = Lines(room=64), [], 0
    while start < len(text):
        size = sizes[len(found) % len(sizes)]
        lines.put(text[start : start + size])
        start += size
        while spans := lines.take(most, last=start >= len(text)):
            found += [bytes(lines.line(span)) for span in spans]
            filled = spans[-1][1] + int(lines.text[spans[-1][1]] == ord("\n")) + lines.rest
            assert not lines.text[filled : filled + PADDING].any()  # every scan stops there
    assert found == (texts if texts and texts[-1] else texts[:-1])
    assert lines.rest == 0


def test_memory_is_used_again():
    lines = Lines(room=1000)
    for _ in range(100):
        before = lines.text
        lines.put(b"x" * 400 + b"\n" + b"y" * 300)
        lines.put(b"\n")
        assert len(lines.take(10_000)) == 2
        assert lines.text is before

"""The compiled reader of plain numeric columns: exact, and only for simple input."""

import json
import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.numbers import NO_ROOM, read_columns

NAMES = ("mu0", "Fz", "k", "y0", "omega", "v0")
CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": [0.01, 0.1]}


def read(text, room=100, behind=b"\0"):
    columns = np.empty((6, room))
    size = read_columns(np.frombuffer(bytearray(text.encode() + behind), dtype=np.uint8), 0, len(text), columns)
    return size, columns[:, : max(size, 0)]


@settings(max_examples=300, deadline=None)
@given(values=st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=20))
def test_every_double_is_read_exactly(values):
    size, columns = read(json.dumps(dict.fromkeys(NAMES, values)))
    assert size == len(values)
    assert all(np.array_equal(column, np.array(values)) for column in columns)


@pytest.mark.slow
@settings(max_examples=500, deadline=None)
@given(text=st.from_regex(r"-?(0|[1-9][0-9]{0,15})(\\.[0-9]{1,20})?([eE][+-]?[0-9]{1,3})?", fullmatch=True))
def test_accepted_numbers_are_those_that_python_reads(text):
    size, columns = read(json.dumps({**CASE, "v0": "@"}).replace('"@"', f"[{text}]"))
    if size:
        assert columns[5, 0] == float(text)


@pytest.mark.parametrize("behind", [b"\0", b"\n", b'\n{"mu0": 1}\n'])
def test_a_block_ends_at_its_stated_end(behind):
    size, columns = read(json.dumps(CASE), behind=behind)
    assert size == 2
    assert columns[:, 0].tolist() == [0.3, 10.0, 1e6, 2e-6, 1.3e5, 0.01]
    assert columns[:, 1].tolist() == [0.3, 10.0, 1e6, 2e-6, 1.3e5, 0.1]


def test_rigid_contact_and_hertz_are_read():
    size, columns = read(json.dumps({**{n: v for n, v in CASE.items() if n != "omega"}, "f": 100.0, "k": None}))
    assert size == 2
    assert columns[2].tolist() == [math.inf] * 2
    assert columns[4].tolist() == [100.0 * 2.0 * math.pi] * 2


@pytest.mark.parametrize(
    "text",
    [
        "", "{}", "[]", "3", json.dumps({**CASE, "x": 1}), json.dumps({**CASE, "f": 1.0}),
        json.dumps({**CASE, "mu0": -1}),
        json.dumps({**CASE, "v0": []}), json.dumps({**CASE, "v0": [1, "2"]}), json.dumps({**CASE, "v0": [1, None]}),
        json.dumps({**CASE, "v0": 0.1}), json.dumps({**CASE, "y0": [1, 2, 3]}), json.dumps(CASE)[:-1],
        json.dumps(CASE) + "}", json.dumps({**CASE, "v0": "@"}).replace('"@"', "[01]"),
        json.dumps({**CASE, "v0": "@"}).replace('"@"', "[1e999]"),
        json.dumps({**CASE, "v0": "@"}).replace('"@"', "[NaN]"),
        json.dumps({**CASE, "v0": "@"}).replace('"@"', "[1,]"), json.dumps({**CASE, "mu0": [0.1] * 2, "k": "rigid"}),
        json.dumps({name: value for name, value in CASE.items() if name != "k"}),
    ],
)  # fmt: skip
def test_anything_else_is_not_accepted(text):
    assert read(text)[0] == 0


def test_too_many_cases_are_reported():
    assert read(json.dumps(CASE), room=1)[0] == NO_ROOM


def test_no_request_waits_for_a_kernel_of_the_reader(repository):
    code = """
from service import app, numbers
from service.settings import load_settings
from service.tables import Tables
app.load(Tables(load_settings().tables))
print([len(one.signatures) for one in (numbers._object, numbers._spread)])
"""
    words = [sys.executable, "-c", code]
    done = subprocess.run(words, cwd=repository, capture_output=True, text=True, check=False)
    assert done.stdout == "[1, 1]\n", done.stderr

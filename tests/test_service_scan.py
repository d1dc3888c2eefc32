"""The scanner of batches against an ordinary JSON parser: it accepts what that accepts, and reads the same from it."""

import json
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic_core import from_json

from friction.nondim import FIELDS
from service.codecs import read_batch, terminated
from service.compiled.scan import UNKNOWN
from service.errors import BatchTooLargeError, InvalidFieldsError, MalformedBodyError

LIMIT = 1000
numbers = st.integers(-(10**25), 10**25) | st.floats() | st.sampled_from([0.5, 1, 2.5e-7, 10**400])
leaves = numbers | st.none() | st.booleans() | st.text(max_size=4)
values = st.recursive(leaves, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=2), inner))
rows = st.lists(
    st.dictionaries(st.sampled_from(FIELDS), numbers | leaves, max_size=6) | st.fixed_dictionaries(
        dict.fromkeys(FIELDS, numbers)) | values,
    max_size=6,
)  # fmt: skip
columns = st.fixed_dictionaries({name: st.lists(leaves, min_size=3, max_size=3) | st.just(1.0) for name in FIELDS})
spaces = st.sampled_from([None, (",", ":"), (" , ", "\t:\n")])


def scan(text):
    return read_batch(terminated(text if isinstance(text, bytes) else text.encode()), LIMIT)


def as_double(entry, nullable):
    """What an entry of a column must become: a number, infinity for rigid contact, else NaN."""
    if entry is None and nullable:
        return math.inf
    if type(entry) not in (int, float):
        return math.nan
    try:
        value = float(entry)
    except OverflowError:
        return math.nan
    return value if math.isfinite(value) else math.nan


def assert_same(found, expected):
    assert np.array_equal(found, np.array(expected, dtype=np.float64), equal_nan=True)


@settings(max_examples=500, deadline=None)
@given(document=rows, separators=spaces)
def test_rows_are_read_as_json_reads_them(document, separators):
    cases, options = scan(json.dumps(document, separators=separators))
    assert (cases.size, options) == (len(document), {})
    for index, row in enumerate(document):
        whole = isinstance(row, dict) and set(row) <= set(FIELDS)
        assert (cases.flaws[index] == 0) == whole
        if whole:
            for field, name in enumerate(FIELDS):
                missing = math.inf if name == "k" else math.nan
                assert_same(cases.columns[field][index], as_double(row[name], name == "k") if name in row else missing)


@settings(max_examples=300, deadline=None)
@given(document=columns, separators=spaces)
def test_columns_are_read_as_json_reads_them(document, separators):
    cases, _ = scan(json.dumps(document, separators=separators))
    for field, name in enumerate(FIELDS):
        column = document[name]
        expected = [as_double(entry, name == "k") for entry in column] if isinstance(column, list) else [column]
        assert_same(cases.columns[field], expected)


@settings(max_examples=2000, deadline=None)
@given(text=st.text(alphabet=' \n[]{}:,"\\u0k1.eE+-truefalsn', max_size=14).map("[{}]".format) | st.text(max_size=8))
def test_what_is_refused_is_what_a_parser_refuses(text):
    try:
        from_json(text)
        sound = True
    except ValueError:
        sound = False
    try:
        scan(text)
        accepted = True
    except InvalidFieldsError:
        accepted = True
    except MalformedBodyError:
        accepted = False
    assert accepted == sound


@settings(max_examples=300, deadline=None)
@given(document=rows, cut=st.integers(0, 10**6))
def test_text_that_ends_too_early_is_malformed(document, cut):
    text = json.dumps(document).encode()
    with pytest.raises(MalformedBodyError):
        scan(text[: cut % len(text)])


def test_the_last_of_a_repeated_name_holds():
    row = '{"mu0":1,"Fz":1,"y0":1,"omega":1,"v0":1%s}'
    texts = [',"v0":2', ',"v0":"x","v0":2', ',"v0":12345678901234567890,"v0":2', ',"v0":2.0000000000000000000']
    cases, _ = scan("[" + ",".join(row % text for text in texts) + "]")
    assert cases.columns[5].tolist() == [2.0] * 4
    cases, _ = scan('{"mu0":1,"Fz":1,"y0":1,"omega":1,"v0":["x",1],"v0":[3,4]}')
    assert cases.columns[5].tolist() == [3.0, 4.0]


@pytest.mark.parametrize("name", FIELDS)
def test_a_name_is_known_to_the_letter(name):
    assert scan(f'[{{"{name}" : 1}}]')[0].columns[FIELDS.index(name)].tolist() == [1.0]
    for other in (
        name[:-1],
        name + "0",
        name.swapcase(),
        " " + name,
        name + " ",
        name + '\\"',
        "\\u00" + name,
        name * 3,
    ):
        try:
            json.loads(f'"{other}"')
        except ValueError:
            continue
        assert scan(f'[{{"{other}":1}}]')[0].flaws.tolist() == [UNKNOWN], other


def test_many_long_numbers_are_read_exactly():
    texts = [f"0.{index}{'123456789' * 3}" for index in range(1, 3001)]
    body = f'{{"mu0":1,"Fz":1,"y0":1,"omega":1,"v0":[{",".join(texts)}]}}'
    cases, _ = read_batch(terminated(body.encode()), 5000)
    assert cases.columns[5].tolist() == [float(text) for text in texts]
    body = "[" + ",".join(f'{{"v0":{text},"mu0":{text}}}' for text in texts) + "]"
    cases, _ = read_batch(terminated(body.encode()), 5000)
    assert cases.columns[0].tolist() == cases.columns[5].tolist() == [float(text) for text in texts]


def test_depth_is_bounded():
    scan("[" * 100 + "]" * 100)
    with pytest.raises(MalformedBodyError, match="deep"):
        scan("[" * 1000 + "]" * 1000)


@pytest.mark.parametrize("body", ["[" + "1," * LIMIT + "1]", '{"v0":[' + "1," * LIMIT + "1]}"])
def test_one_case_too_many_is_noticed_while_reading(body):
    with pytest.raises(BatchTooLargeError):
        scan(body)


_CHECKED = """
import json, random
from service.codecs import read_batch, terminated, rows_text, columns_text
from service.errors import RequestError
random.seed(5)
good = json.dumps([{"mu0": .3, "Fz": 1e1, "k": None, "y0": 2e-6, "omega": 13e4, "v0": [1, {"a": "\\\\u00e4"}]}] * 3)
columns = json.dumps({"mu0": .3, "Fz": [1, 2.5, "x"], "y0": [1e-9, 10**30 + 1, True], "omega": 1, "v0": 2})
for text in (good, columns):
    for end in range(len(text) + 1):
        for body in (text[:end], text[:end] + random.choice('[]{}":,\\\\0eE.-tfn') + text[end + 1:]):
            try:
                read_batch(terminated(body.encode()), 10)
            except RequestError:
                pass
print("done")
"""


def test_no_index_leaves_its_array(repository, tmp_path):
    environment = {
        **os.environ,
        "NUMBA_BOUNDSCHECK": "1",
        "NUMBA_CACHE_DIR": str(tmp_path),
        "PYTHONPATH": str(repository),
    }
    done = subprocess.run(
        [sys.executable, "-c", _CHECKED], env=environment, cwd=repository, capture_output=True, text=True, check=False
    )
    assert done.stdout == "done\n", done.stderr

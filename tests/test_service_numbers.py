"""The compiled reader of batches: exact, and only for the usual form."""

import json
import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service import numbers
from service.errors import BatchTooLargeError
from service.formats import columns, decode, read_plain, rows
from service.numbers import BLOCK, CASE, NO_ROOM, ROWS

NAMES = ("mu0", "Fz", "k", "y0", "omega", "v0")
PAIR = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": [0.01, 0.1]}
ONE = {**PAIR, "v0": 0.01}


def read(text, room=100):
    """(size, form, columns, texts of the other members)."""
    columns, data = np.empty((6, room)), text.encode()
    size, form, spans = numbers.read(np.frombuffer(bytearray(data + b"\0"), dtype=np.uint8), columns)
    return size, form, columns[:, : max(size, 0)], [data[start:stop].decode() for start, stop in spans]


def read_lines(lines, room=100):
    data, spans = bytearray(), []
    for line in lines:
        spans.append([len(data), len(data) + len(line)])
        data += line.encode() + b"\n"
    columns = np.empty((6, room))
    edges, forms = numbers.read_lines(np.frombuffer(data, dtype=np.uint8), np.array(spans, dtype=np.int64), columns)
    return edges, forms, columns


@settings(max_examples=300, deadline=None)
@given(values=st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=20))
def test_every_double_is_read_exactly(values):
    size, form, columns, _ = read(json.dumps(dict.fromkeys(NAMES, values)))
    assert (size, form) == (len(values), BLOCK)
    assert all(np.array_equal(column, np.array(values)) for column in columns)
    size, form, columns, _ = read(json.dumps([dict.fromkeys(NAMES, value) for value in values], indent=1))
    assert (size, form) == (len(values), ROWS)
    assert all(np.array_equal(column, np.array(values)) for column in columns)


@pytest.mark.slow
@settings(max_examples=500, deadline=None)
@given(text=st.from_regex(r"-?(0|[1-9][0-9]{0,15})(\\.[0-9]{1,20})?([eE][+-]?[0-9]{1,3})?", fullmatch=True))
def test_accepted_numbers_are_those_that_python_reads(text):
    size, _, columns, _ = read(json.dumps({**PAIR, "v0": "@"}).replace('"@"', f"[{text}]"))
    if size:
        assert columns[5, 0] == float(text)


def test_a_block_ends_at_its_stated_end():
    block = json.dumps(PAIR)
    edges, forms, columns = read_lines([block, f"  {block} \r", json.dumps(ONE), json.dumps([ONE, ONE]), '{"mu0": 1}'])
    assert (edges, forms) == ([0, 2, 4, 5, 7], [BLOCK, BLOCK, CASE, ROWS])
    assert columns[:, 1].tolist() == [0.3, 10.0, 1e6, 2e-6, 1.3e5, 0.1]
    for case in (0, 2, 4, 5, 6):
        assert columns[:, case].tolist() == [0.3, 10.0, 1e6, 2e-6, 1.3e5, 0.01]


@pytest.mark.parametrize("cut", range(1, 40))
def test_a_line_that_goes_on_in_the_next_line_is_not_read(cut):
    text = json.dumps(ONE)
    assert read_lines([text[:cut], text[cut:]])[:2] == ([0], [])


def test_lines_are_read_until_there_is_no_room():
    block = json.dumps(PAIR)
    assert read_lines([block] * 3, room=5)[:2] == ([0, 2, 4], [BLOCK, BLOCK])
    assert read_lines([block] * 3, room=1)[:2] == ([0], [])


@pytest.mark.parametrize("rigid", [None, "rigid"])
def test_rigid_contact_and_hertz_are_read(rigid):
    hertz = {**{name: value for name, value in PAIR.items() if name != "omega"}, "f": 100.0, "k": rigid}
    for text in (hertz, {**hertz, "omega": None}, {**hertz, "f": [100.0, 100.0]}, {**hertz, "k": [rigid, rigid]}):
        size, form, columns, _ = read(json.dumps(text))
        assert (size, form) == (2, BLOCK)
        assert columns[2].tolist() == [math.inf] * 2
        assert columns[4].tolist() == [100.0 * 2.0 * math.pi] * 2
    size, _, columns, _ = read(json.dumps([{**hertz, "v0": 1.0}, {**ONE, "f": None}]))
    assert size == 2
    assert columns[4].tolist() == [100.0 * 2.0 * math.pi, 1.3e5]


def test_other_members_are_found():
    options = {"include": ['a}],"{\\', {"b": [1, {}]}], "tolerance": 1e-3, "std": {"mu0": 0.1}}
    for text in (json.dumps({**options, **PAIR}), json.dumps({**PAIR, **options}, indent=2)):
        size, form, _, members = read(text)
        assert (size, form, len(members)) == (2, BLOCK, 3)
        assert json.loads("{" + ",".join(members) + "}") == options
    assert read(json.dumps({**PAIR, **options, "x": 1}))[0] == 0
    assert read(json.dumps([{**ONE, "x": 1}]))[0] == 0
    assert read_lines([json.dumps({**PAIR, "x": 1})])[1] == []


def test_a_row_may_have_numbers_that_are_out_of_bounds():
    size, _, columns, _ = read(json.dumps([ONE, {**ONE, "mu0": -1}]))
    assert size == 2
    assert columns[0].tolist() == [0.3, -1.0]


@settings(max_examples=500, deadline=None)
@given(
    text=st.sampled_from([json.dumps({**PAIR, "include": ["groups"]}), json.dumps([ONE] * 3), json.dumps(PAIR)]),
    edits=st.lists(st.tuples(st.integers(0, 120), st.sampled_from('{}[],:"0-.eE \\\nnulrigdf\0')), max_size=3),
)
def test_whatever_is_accepted_is_json_with_the_same_numbers(text, edits):
    for place, letter in edits:
        text = text[: place % len(text)] + letter + text[place % len(text) + 1 :]
    form = ROWS if text.lstrip().startswith("[") else BLOCK
    plain = read_plain(bytearray(text.encode()), 100, form)
    if plain is not None:
        batch, options = plain
        found = json.loads(text)
        rows = found if form == ROWS else [found]
        assert len(rows[0]) == len(options) + 6
        for name in ("mu0", "Fz", "y0", "v0"):
            values = [row[name] for row in rows]
            expected = values[0] if isinstance(values[0], list) else values * (batch.size // len(values))
            assert batch.columns[NAMES.index(name)].tolist() == expected


VALUE = st.one_of(st.none(), st.sampled_from([0, 1, -1.0, 0.3, 1e300]))
INPUT = st.sampled_from(["mu0", "Fz", "k", "y0", "omega", "f", "v0"])


def batch_of(plain):
    """A batch as comparable values: a case with a NaN is bad, whatever its other values."""
    batch, options = plain
    columns = np.array([np.broadcast_to(column, batch.size) for column in batch.columns])
    columns[:, np.isnan(columns).any(axis=0)] = math.nan
    return columns.tobytes(), batch.reasons, options


@settings(max_examples=500, deadline=None)
@given(values=st.dictionaries(INPUT, st.one_of(VALUE, st.lists(VALUE, min_size=1, max_size=3))))
def test_columns_have_the_same_cases_and_reasons_by_both_readers(values):
    values = {**PAIR, **values}
    text = bytearray(
        json.dumps({name: value for name, value in values.items() if name != "omega" or "f" not in values}).encode()
    )
    plain = read_plain(text, 100, BLOCK)
    if plain is not None:
        assert batch_of(plain) == batch_of(columns.read_values(decode(text, dict), 100))


@settings(max_examples=500, deadline=None)
@given(changes=st.lists(st.dictionaries(INPUT, VALUE), min_size=1, max_size=3))
def test_rows_have_the_same_cases_and_reasons_by_both_readers(changes):
    text = bytearray(json.dumps([{**ONE, **change} for change in changes]).encode())
    plain = read_plain(text, 100, ROWS)
    if plain is not None:
        assert batch_of(plain) == batch_of((rows.read_values(decode(text, list)), {}))


@pytest.mark.parametrize("body", [{**PAIR, "v0": [0.01] * 101}, [ONE] * 101])
def test_too_many_cases_are_refused_by_the_compiled_reader(body, monkeypatch):
    read_whole = rows.Rows().read if isinstance(body, list) else columns.Columns().read
    for module in (rows, columns):
        monkeypatch.setattr(module, "decode", None)  # the slow reader is not called
    with pytest.raises(BatchTooLargeError):
        read_whole(bytearray(json.dumps(body).encode()), 100)


def test_a_null_in_a_list_is_read_by_compiled_code():
    plain = read_plain(bytearray(json.dumps({**PAIR, "v0": [1, None]}).encode()), 100, BLOCK)
    assert plain is not None
    assert plain[0].reasons == {1: ("v0", "must be a number")}


@pytest.mark.parametrize(
    "text",
    [
        "", "{}", "[]", "3", "[{}]", json.dumps({**PAIR, "f": 1.0}), json.dumps({**PAIR, "mu0": -1}),
        json.dumps({**PAIR, "v0": []}), json.dumps({**PAIR, "v0": [1, "2"]}),
        json.dumps({**PAIR, "y0": [1, 2, 3]}), json.dumps(PAIR)[:-1], json.dumps(PAIR)[:-1] + ",}",
        json.dumps(PAIR) + "}", json.dumps({**PAIR, "v0": "@"}).replace('"@"', "[01]"),
        json.dumps({**PAIR, "v0": "@"}).replace('"@"', "[1e999]"),
        json.dumps({**PAIR, "v0": "@"}).replace('"@"', "[NaN]"),
        json.dumps({**PAIR, "v0": "@"}).replace('"@"', "[1,]"), json.dumps({**PAIR, "mu0": "rigid"}),
        json.dumps({name: value for name, value in PAIR.items() if name != "k"}),
        json.dumps({name: value for name, value in PAIR.items() if name != "omega"}),
        json.dumps({**ONE, "omega": None}), json.dumps({**PAIR, "f": 1e308, "omega": None}),
        json.dumps([ONE, PAIR]), json.dumps([ONE])[:-1], json.dumps([ONE])[:-1] + ",]", json.dumps([[ONE]]),
        json.dumps(ONE)[:-1] + ',"mu0":0.3}', json.dumps([ONE]) + "]",
    ],
)  # fmt: skip
def test_anything_else_is_not_accepted(text):
    assert read(text)[0] == 0


def test_too_many_cases_are_reported():
    assert read(json.dumps(PAIR), room=1)[0] == NO_ROOM
    assert read(json.dumps([ONE, ONE]), room=1)[0] == NO_ROOM


def test_no_request_waits_for_a_kernel_of_the_reader(repository):
    code = """
from service import app, numbers
from service.settings import load_settings
from service.tables import Tables
app.load(Tables(load_settings().tables))
print(len(numbers._lines.signatures))
"""
    words = [sys.executable, "-c", code]
    done = subprocess.run(words, cwd=repository, capture_output=True, text=True, check=False)
    assert done.stdout == "1\n", done.stderr

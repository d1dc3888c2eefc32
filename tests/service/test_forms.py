"""JSON of a batch: read in slices it gives what Python's ``json`` reads, wherever a slice ends."""

import json
import math
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mumacro.inputs.cases import Cases
from service import forms
from service.problems import RequestError
from tests.support.serving import CASE

NUMBERS = st.one_of(st.floats(), st.integers(), st.sampled_from([1e308, -0.0, 5e-324, 10**400]))
TEXTS = st.one_of(st.text(max_size=5), st.sampled_from(["rigid", "],", "},", '"', "\\", "1,5 mm"]))
VALUES = st.one_of(NUMBERS, TEXTS, st.none(), st.booleans(), st.lists(st.integers(), max_size=2))
COLUMNS = st.one_of(VALUES, st.lists(NUMBERS, max_size=40), st.lists(VALUES, max_size=40))
OBJECTS = st.dictionaries(st.one_of(st.sampled_from([*CASE]), TEXTS), COLUMNS, max_size=8)
POSITIVE = st.one_of(st.floats(1e-3, 1e3), st.integers(1, 9))
ROWS = st.lists(st.fixed_dictionaries(dict.fromkeys(CASE, POSITIVE)), min_size=1, max_size=30)
SPACES = st.sampled_from([(",", ":"), (", ", ": "), (" ,\n", "\t:\r\n")])
SLICES = st.sampled_from([1, 7, 64, 256 * 1024])


def plain(value: Any) -> Any:
    """Arrays as lists, integers as floats; truth values and NaN as texts, which equal no number."""
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, (list, np.ndarray)):
        return [*map(plain, value)]
    if isinstance(value, float) and math.isnan(value):
        return "NaN"
    if isinstance(value, int) and abs(value) < 10**300:
        return float(value)
    return value


def outcome(text: str, step: int) -> Any:
    """What is read of a body in slices of so many bytes; None where it is refused."""
    with patch.object(forms, "_READ", step):
        try:
            body = forms.read(bytearray(text.encode()), 1000, {})
        except RequestError:
            return None
    return {name: plain(value) for name, value in body.members.items()}


@given(OBJECTS, SPACES, st.booleans(), SLICES)
def test_columns_are_read_as_json_reads_them(
    value: dict[str, Any], spaces: Any, ascii_only: bool, step: int
) -> None:
    text = json.dumps(value, separators=spaces, ensure_ascii=ascii_only)
    expected = {name: plain(column) for name, column in value.items()}
    assert outcome(text, step) == expected


@given(ROWS, SPACES, SLICES)
def test_rows_are_read_as_json_reads_them(rows: list[Any], spaces: Any, step: int) -> None:
    expected = {name: [float(row[name]) for row in rows] for name in CASE}
    assert outcome(json.dumps(rows, separators=spaces), step) == expected


@given(ROWS, st.sampled_from([*CASE]), st.one_of(st.booleans(), VALUES), SLICES)
def test_no_value_of_rows_becomes_another(
    rows: list[Any], name: str, value: Any, step: int
) -> None:
    rows[-1][name] = value
    read = outcome(json.dumps(rows), step)
    if read is not None:
        new = read[name][-1]
        # where rows are read one by one a text is the number that it means
        means = isinstance(value, str) and isinstance(new, float)
        assert new in (Cases.of(rows[-1]).columns[name] if means else plain(value), "NaN")


@pytest.mark.parametrize("value", ["false", "true", '"3"'])
def test_no_escape_in_a_name_hides_a_value_that_is_no_number(value: str) -> None:
    """The l of false stands where one is missing in Fz_amplitude."""
    case = {name: 1.0 for name in CASE if name != "y0"}
    text = json.dumps([{**case, "Fz_amplitude": 0.5}] * 3)
    text = text.replace("Fz_amplitude", "Fz_amp\\u006citude").replace("0.5", value)
    body = forms.read(bytearray(text.encode()), 10, {"direction": "normal"})
    read = body.members["Fz_amplitude"]
    assert plain(read) in ([plain(json.loads(value))] * 3, ["NaN"] * 3)


@given(st.one_of(OBJECTS, ROWS), SLICES, st.data())
def test_a_wrong_character_is_never_read_over(value: Any, step: int, data: st.DataObject) -> None:
    """A text with a change is refused unless it is JSON, wherever a slice ends."""
    text = json.dumps(value)
    at = data.draw(st.integers(0, len(text)))
    cut = data.draw(st.integers(0, 1))
    new = data.draw(st.sampled_from(["", "", *'[]{},:" \f0e-\\', ",,", "],[", "},{"]))
    changed = text[:at] + new + text[at + cut :]
    read = outcome(changed, step)
    try:
        json.loads(changed)
    except ValueError:
        assert read is None
    # a row that is no case is read alone, and has a reason in place of its values
    whole = outcome(changed, 10**9)
    assert read == whole if isinstance(value, dict) else (read is None) == (whole is None)

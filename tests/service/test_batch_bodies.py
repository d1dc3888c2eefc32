"""JSON of a batch: read fast or slowly, it gives what Python's ``json`` reads."""

import json
import math
from contextlib import ExitStack
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mumacro.inputs.cases import KIND
from service import batch
from service import rows as rows_of
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


def outcome(text: str, fast: bool = True, piece: int = 20) -> Any:
    """What is read of a body, by the fast readers where they can, in pieces of so many bytes, or
    never by them; None where it is refused."""
    with ExitStack() as stack:
        stack.enter_context(patch.object(rows_of, "_PIECE", piece))
        if not fast:
            for name in ("decode_columns", "decode_rows"):
                stack.enter_context(patch.object(batch, name, side_effect=ValueError))
        try:
            body = batch.read(bytearray(text.encode()), 1000, {})
        except RequestError:
            return None
    return {name: plain(value) for name, value in body.members.items()}


@given(OBJECTS, SPACES, st.booleans(), st.booleans())
def test_columns_are_read_as_json_reads_them(
    value: dict[str, Any], spaces: Any, ascii_only: bool, fast: bool
) -> None:
    text = json.dumps(value, separators=spaces, ensure_ascii=ascii_only)
    expected = {name: plain(column) for name, column in value.items()}
    assert outcome(text, fast) == expected


@given(ROWS, SPACES, st.booleans(), st.integers(0, 1000))
def test_rows_are_read_as_json_reads_them(
    rows: list[Any], spaces: Any, fast: bool, piece: int
) -> None:
    expected = {name: [float(row[name]) for row in rows] for name in CASE}
    assert outcome(json.dumps(rows, separators=spaces), fast, piece) == expected


@pytest.mark.parametrize("row", [{"k": 1.0, "contact": "spring"}, dict.fromkeys(KIND, "along")])
def test_rows_that_are_mostly_words_get_a_reason(row: dict[str, Any]) -> None:
    body = batch.read(bytearray(json.dumps([row] * 2).encode()), 10, {})
    assert body.reasons[0] == body.reasons[1] == ("mu0", "is required")


@given(ROWS, st.sampled_from([*CASE]), st.one_of(st.booleans(), VALUES))
def test_no_value_of_rows_becomes_another(rows: list[Any], name: str, value: Any) -> None:
    rows[-1][name] = value
    read = outcome(json.dumps(rows))
    if read is not None:
        rigid = name == "k" and isinstance(value, str) and value.strip().lower() == "rigid"
        assert read[name][-1] in (math.inf if rigid else plain(value), "NaN")


@pytest.mark.parametrize("value", ["false", "true", '"3"', "null", "[]", "{}"])
@pytest.mark.parametrize("name", ["Fz_amplitude", "Fz_amp\\u006citude"])
def test_no_escape_in_a_name_hides_a_value_that_is_no_number(name: str, value: str) -> None:
    case = {name: 1.0 for name in CASE if name != "y0"}
    text = json.dumps([{**case, "Fz_amplitude": 0.5}] * 3)
    text = text.replace("Fz_amplitude", name).replace("0.5", value)
    body = batch.read(bytearray(text.encode()), 10, {"direction": "normal"})
    assert plain(body.members["Fz_amplitude"]) == ["NaN"] * 3


@given(st.one_of(OBJECTS, ROWS), st.data())
def test_a_wrong_character_is_never_read_over(value: Any, data: st.DataObject) -> None:
    """A text with a change is refused unless it is JSON, and the fast readers refuse what the slow
    one refuses."""
    text = json.dumps(value)
    at = data.draw(st.integers(0, len(text)))
    cut = data.draw(st.integers(0, 1))
    new = data.draw(st.sampled_from(["", "", *'[]{},:" \f0e-\\', ",,", "],[", "},{"]))
    changed = text[:at] + new + text[at + cut :]
    read, slowly = outcome(changed), outcome(changed, fast=False)
    try:
        json.loads(changed)
    except ValueError:
        assert read is None
    # a row that is no case is read alone, and has a reason in place of its values
    assert read == slowly if isinstance(value, dict) else (read is None) == (slowly is None)

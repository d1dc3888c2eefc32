"""Decimal text and doubles: exact both ways, and the grammar of JSON to the letter."""

import json
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numba import njit

from service.compiled.block import write_names, write_numbers
from service.compiled.digits import (
    HARD,
    MALFORMED,
    NUMBER,
    OUT_OF_RANGE,
    PADDING,
    TEXT_WIDTH,
    read_number,
    write_number,
)


@njit
def read_all(text, count, bits, kinds):
    i = 0
    for index in range(count):
        bits[index], i, kinds[index] = read_number(text, i)
        i += 1


@njit
def write_all(out, values, ends):
    p = 0
    for index in range(values.size):
        p = write_number(out, p, values[index])
        ends[index] = p


def read(text):
    bits, end, kind = read_number(np.frombuffer(text.encode() + bytes(PADDING), dtype=np.uint8), 0)
    return float(np.uint64(bits).view(np.float64)), end, kind


def written(values):
    out, ends = np.zeros(TEXT_WIDTH * values.size, dtype=np.uint8), np.zeros(values.size, dtype=np.int64)
    write_all(out, values, ends)
    starts = [0, *ends[:-1].tolist()]
    assert np.diff([0, *ends]).max() <= TEXT_WIDTH
    return [out[a:b].tobytes().decode() for a, b in zip(starts, ends.tolist(), strict=True)]


def plain(text):
    """Python's repr in the spelling that is used here."""
    return text.replace("e-0", "e-").replace("e+", "e")


def samples():
    rng = np.random.default_rng(20180301)
    bits = rng.integers(0, 2**64, 200_000, dtype=np.uint64).view(np.float64)
    yield bits[np.isfinite(bits)]
    yield rng.uniform(-1, 1, 100_000)
    yield rng.integers(1, 2**52, 20_000, dtype=np.uint64).view(np.float64)  # subnormal
    yield np.ldexp(1.0, np.arange(-1074, 1024))
    yield np.nextafter(np.ldexp(1.0, np.arange(-1074, 1024)), 0)
    yield np.array([float(f"1e{k}") for k in range(-323, 309)])
    yield np.arange(0, 50_000) / 64
    yield np.array([0.0, -0.0, 5e-324, 2.2250738585072014e-308, 1.7976931348623157e308, 9007199254740993.0, 0.1, 1e22])


@pytest.mark.parametrize("index", range(8))
def test_a_double_is_written_as_short_as_python_writes_it_and_read_back(index):
    values = list(samples())[index]
    texts = written(values)
    assert texts == [plain(repr(value)) for value in values.tolist()]
    bits, kinds = np.zeros(values.size, dtype=np.uint64), np.zeros(values.size, dtype=np.int64)
    read_all(np.frombuffer(",".join(texts).encode() + bytes(PADDING), dtype=np.uint8), values.size, bits, kinds)
    assert not kinds.any()
    assert np.array_equal(bits, values.view(np.uint64))


@pytest.mark.parametrize("form", [".18e", ".17e", ".16e", ".15e", ".3f"])
def test_a_text_of_any_length_is_read_to_the_nearest_double(form):
    rng = np.random.default_rng(1)
    values = rng.uniform(0, 10, 50_000) * 10.0 ** (rng.integers(-300, 300, 50_000) if "e" in form else 3)
    texts = [format(value, form) for value in values.tolist()]
    bits, kinds = np.zeros(values.size, dtype=np.uint64), np.zeros(values.size, dtype=np.int64)
    read_all(np.frombuffer(",".join(texts).encode() + bytes(PADDING), dtype=np.uint8), values.size, bits, kinds)
    assert not kinds.any()
    assert bits.view(np.float64).tolist() == [float(text) for text in texts]


def test_halfway_cases_go_to_the_even_double():
    for text in ("9007199254740993", "9007199254740995", "9007199254740993.0", "4503599627370496.5", "0.5e-323"):
        assert read(text)[0] == float(text)
        assert read(text)[2] == NUMBER


def test_what_is_not_finite_is_written_as_null():
    assert written(np.array([math.nan, math.inf, -math.inf, 1.0])) == ["null", "null", "null", "1.0"]


@pytest.mark.parametrize("text", ["NaN", "Infinity", "-Infinity", "1e309", "-1e400", "1" + "0" * 18 + "e300"])
def test_what_no_double_holds_is_out_of_range(text):
    assert read(text)[1:] == (len(text), OUT_OF_RANGE)


@pytest.mark.parametrize("text", ["12345678901234567890", "0.12345678901234567890", "1" * 400, "1" * 30 + "e-30"])
def test_more_than_nineteen_digits_are_left_to_the_caller(text):
    assert read(text)[1:] == (len(text), HARD)


@pytest.mark.parametrize("text", ["0.00000000000000000000012", "-0.000000000000000000000000001e10", "0." + "0" * 40])
def test_leading_zeros_are_no_digits(text):
    assert read(text) == (float(text), len(text), NUMBER)


def lengths():
    """Numbers of every length before the point and behind it, around all groups that digits are read in."""
    digits = "91827364509182736450918273645"
    for exponent in ("", "e5", "E-07", "e+123", "e-300", "e00000012", "e-000000012"):
        for count in range(26):
            for before in range(1, 26):
                yield digits[:before] + ("." + digits[:count] if count else "") + exponent
            for zeros in range(12):
                yield "0." + "0" * zeros + digits[:count] + ("0" if count == 0 else "") + exponent
            if count:
                yield "0" * count + "1" + exponent


def test_digits_of_any_number_are_read_wherever_they_end():
    for text in lengths():
        number = text.lower().partition("e")[0].replace(".", "")
        if text[0] == "0" and text[1] != ".":
            assert read(text)[1:] == (1, MALFORMED), text
            continue
        kind = HARD if len(number.lstrip("0")) > 19 else OUT_OF_RANGE if math.isinf(float(text)) else NUMBER
        for sign in ("", "-"):
            # at the very end, and before text that must not count
            for behind in ("", ",9182.736e5", "]", " 918273645091827364509182736450"):
                value, end, found = read(sign + text + behind)
                assert (end, found) == (len(sign + text), kind), text
                assert kind != NUMBER or value == float(sign + text), text


def test_a_number_that_breaks_off_is_malformed():
    for text in ("1.", "1.e5", "123456789.", "1e", "1e+", "1.5e-", "1.5e-x", "-", "-.5", "-01", "00", "01.5"):
        for behind in ("", ",1", " 1.5e5,"):
            assert read(text + behind)[2] == MALFORMED, text


def test_any_number_of_digits_is_written_wherever_the_point_is():
    digits = "91827364509182736"
    texts = [f"{digits[:count]}e{exponent}" for count in range(1, 18) for exponent in range(-40, 40)]
    values = np.array([float(text) for text in texts])
    values = np.concatenate([values, -values])
    assert written(values) == [plain(repr(value)) for value in values.tolist()]


def test_no_number_takes_more_room_than_is_said():
    for values in samples():
        for value in [*values[:200].tolist(), math.nan, -math.inf]:
            out = np.full(TEXT_WIDTH + 8, 255, dtype=np.uint8)
            write_number(out, 0, value)
            assert (out[TEXT_WIDTH:] == 255).all()


@pytest.mark.parametrize("size", [0, 1, 2, 9])
def test_a_list_is_written_as_its_numbers_are(size):
    values = np.array([0.1, math.nan, -0.0, 0.0, math.inf, -2.5e-300, 5e-324, 12345.678, 1e22])[:size]
    out = np.zeros(size * (TEXT_WIDTH + 1) + PADDING, dtype=np.uint8)
    end = write_numbers(out, 0, values)
    assert out[:end].tobytes().decode() == "".join(text + "," for text in written(values)) if size else end == 0


def test_names_of_any_length_are_written():
    names = ["x" * length for length in range(70)]
    ends = np.cumsum([0, *map(len, names)]).astype(np.int64)
    text = np.frombuffer("".join(names).encode() + bytes(PADDING), dtype=np.uint8)
    codes = np.array([*range(70), -1, 3], dtype=np.int8)
    expected = ",".join([*names, "null", "xxx", ""]).encode()
    out = np.zeros(len(expected) + PADDING, dtype=np.uint8)
    assert out[: write_names(out, 0, codes, text, ends)].tobytes() == expected


@settings(max_examples=1000, deadline=None)
@given(text=st.text(alphabet="0123456789.eE+-", min_size=1, max_size=12))
@example(text="-")
@example(text="01")
@example(text="1.")
@example(text="1e")
@example(text="-0")
def test_the_grammar_is_that_of_json(text):
    try:
        expected = json.loads(text)
    except ValueError:
        expected = None
    value, end, kind = read(text)
    if expected is None:
        assert kind not in (NUMBER, OUT_OF_RANGE, HARD) or end < len(text)
    else:
        assert end == len(text)
        assert kind == (NUMBER if math.isfinite(float(expected)) else OUT_OF_RANGE)
        assert kind == OUT_OF_RANGE or value == float(expected)

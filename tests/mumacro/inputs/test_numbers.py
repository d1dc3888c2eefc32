"""Numbers as people write them, and the decimal sign of a table: read as they are meant, or refused
with what they may be."""

import pytest

from mumacro import InputError
from mumacro.errors import TextError
from mumacro.inputs.case import check_signs
from mumacro.inputs.cells import Cell, Signs
from mumacro.inputs.numbers import read_number


@pytest.mark.parametrize(
    ("text", "decimal", "number"),
    [
        ("0,123", "", 0.123),  # no thousands begin with 0
        ("-0,050", "", -0.05),
        ("12,5", "", 12.5),
        ("1,234e3", "", 1234.0),
        ("1.234", "", 1.234),
        ("1.234", ",", 1234.0),
        ("1.234,5", ",", 1234.5),
        ("1,234.5", ".", 1234.5),
        ("2,5d-3", "", 2.5e-3),
    ],
)
def test_a_number_has_one_meaning(text: str, decimal: str, number: float) -> None:
    assert read_number(text, decimal) == number


@pytest.mark.parametrize(
    ("text", "decimal", "reason"),
    [
        ("1,234", "", "may be 1234 or 1.234"),
        ("-1,234", "", "may be -1234 or -1.234"),
        ("1,2.345", ",", "must be a number such as 0,5"),
        ("0.123,5", ",", "must be a number such as 0,5"),
        ("1,2,3", ",", "must be a number such as 0,5"),
        ("12.34.5", "", "must be a number"),
        ("1 23", "", "must be a number"),
        ("1e400", "", "too large"),
        ("-1e400", "", "too large"),
        ("1_000", "", "must be a number"),
    ],
)
def test_what_has_no_meaning_or_two_gets_its_reason(text: str, decimal: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        read_number(text, decimal)


@pytest.mark.parametrize("clear", ["20 kHz", "0.01", "0.123", "20000", "1.2345", "20.000,0"])
def test_beside_a_decimal_comma_a_number_that_can_be_one_alone_stays(clear: str) -> None:
    check_signs({"mu0": "0,3", "f": clear})


@pytest.mark.parametrize("text", ["20.000", "1.234 kHz", "999.999"])
def test_beside_a_decimal_comma_points_before_three_digits_are_not_clear(text: str) -> None:
    check_signs({"mu0": "0.3", "f": text})
    with pytest.raises(InputError, match="clear beside mu0"):
        check_signs({"mu0": "0,3", "f": text})


@pytest.mark.parametrize(
    ("cells", "sep", "decimal"),
    [
        (["0,3", "1.000"], ";", ","),
        (["1.234e3", "7"], ";", "."),  # an exponent stands behind a fraction
        (["1.234,5"], ";", ","),
        (["1.000.000"], ";", ","),
        (["1.000"], ",", "."),  # where commas separate the cells
        (["7", "12"], ";", ""),
    ],
)
def test_the_decimal_sign_of_a_table_is_found(cells: list[str], sep: str, decimal: str) -> None:
    numbers = (Cell(i, "v0", cell) for i, cell in enumerate(cells, 1))
    assert Signs().shown_by(numbers, sep, "--").decimal == decimal


@pytest.mark.parametrize(
    ("cells", "reason"),
    [
        (["1.000"], "may be 1 or 1000"),
        (["1,000", "2,000"], "may be 1 or 1000"),
        (["0.3", "0,4"], "has a decimal point, line 2"),
    ],
)
def test_a_table_whose_sign_may_be_either_says_so(cells: list[str], reason: str) -> None:
    with pytest.raises(TextError, match=reason):
        Signs().shown_by((Cell(i, "v0", cell) for i, cell in enumerate(cells, 1)), ";", "--")

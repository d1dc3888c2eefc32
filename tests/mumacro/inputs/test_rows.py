"""Lines of a table that are easily taken for something else, and numbers that are too large in SI;
one remark for each case."""

import math
from typing import Any

import pytest

from mumacro.errors import TextError
from mumacro.inputs.case import read
from mumacro.inputs.cells import Signs, numbers_of
from mumacro.inputs.doubts import remarks
from mumacro.inputs.layout import Dialect
from mumacro.inputs.names import ColumnNames
from mumacro.inputs.numbers import TOO_LARGE
from mumacro.inputs.text_tables import TableOfNumbers, read_numbers
from mumacro.inputs.units import in_si, scale_of, too_large_in_si
from tests.support.comparing import close

POINTS = ColumnNames({"v0": "v0", "mu_macro": "mu0"}, [["v0"], ["mu_macro"]])
ONE, TWO, THREE = "1,0.069\n", "2,0.097\n", "5,0.174\n"


def table_of(text: str) -> TableOfNumbers:
    return read_numbers(text.encode(), POINTS, Dialect())


@pytest.mark.parametrize("between", range(4))
def test_units_stand_up_to_four_lines_above_the_names(between: int) -> None:
    lines = "".join(f"# step {i}\n" for i in range(between))
    assert table_of(f"mm/s,-\n{lines}v0,mu_macro\n{ONE}").columns["v0"] == close(1e-3, rel=1e-15)


@pytest.mark.parametrize("head", ["v0 (mm/s) mu_macro (-)", "v0 [mm/s] mu_macro [-]"])
def test_a_bracket_between_blanks_belongs_to_the_name_before_it(head: str) -> None:
    table = table_of(f"{head}\n1 0.069\n2 0.097\n")
    assert table.columns["v0"].tolist() == close([1e-3, 2e-3], rel=1e-15)


def test_empty_cells_behind_the_rows_do_not_hide_their_head() -> None:
    table = table_of("v0,mu_macro\n1,0.069,\n2,0.097,\nv0,mu_macro\n5,0.174\n")
    assert table.columns["v0"].tolist() == [1.0, 2.0, 5.0]


def test_a_row_that_is_commented_out_is_no_row() -> None:
    table = table_of(f"v0,mu_macro\n{ONE}#{TWO}{THREE}")
    assert table.columns["v0"].tolist() == [1.0, 5.0]
    assert table.skipped == [3]


def test_a_quote_in_a_comment_does_not_take_rows_into_it() -> None:
    table = table_of(f'v0,mu_macro\n{ONE}# a,"b\n{TWO}# "\n{THREE}')
    assert table.columns["v0"].tolist() == [1.0, 2.0, 5.0]
    assert table.skipped == [3, 5]


def test_a_cell_beyond_the_head_is_not_dropped() -> None:
    assert table_of(f"v0,mu_macro\n1,0.069, ,\n{TWO}").columns["v0"].tolist() == [1.0, 2.0]
    with pytest.raises(TextError, match="line 3 has 3 cells, the header has 2"):
        table_of(f"v0,mu_macro\n{ONE}2,0.097,7\n")


def test_a_number_that_is_too_large_in_si_is_no_rigid_contact() -> None:
    scale: Any = scale_of("k", "N/um")
    values, _ = numbers_of(["1e301", "1e305"], "k", Signs(".", None))
    si = in_si(values, scale)
    assert si[0] == close(1e307, rel=1e-15)
    assert math.isnan(si[1])
    assert too_large_in_si(values, si) == {1: TOO_LARGE}


@pytest.mark.parametrize(
    ("unit", "size"),
    [
        ("rad/min", 1.0 / 60.0),
        ("mrad/s", 1e-3),
        ("deg/s", math.pi / 180.0),
        ("rpm", math.pi / 30.0),
        ("rev/min", math.pi / 30.0),
        ("rev/s", 2.0 * math.pi),
    ],
)
def test_an_angular_frequency_is_in_radians(unit: str, size: float) -> None:
    assert read("omega", f"3 {unit}").si == close(3.0 * size, rel=1e-15)


CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}


@pytest.mark.parametrize(
    ("changed", "row"),
    [
        ({"y0": 0.0, "omega": 0.0}, "model"),
        ({"y0": 0.0}, "model"),
        ({"k": 1e8, "y0": 1e-7, "omega": 1.0, "v0": 100.0}, "units"),  # v~ = 3e9
        ({"k": 1e12, "y0": 1e-2}, "units"),  # y~ = 3e9
    ],
)
def test_a_case_gets_one_remark(changed: dict[str, float], row: str) -> None:
    assert remarks(CASE) == []
    assert [one.row for one in remarks({**CASE, **changed})] == [row]

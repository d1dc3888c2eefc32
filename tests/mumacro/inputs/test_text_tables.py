"""Tables as people and rigs write them: files of rigs, every way to write a table, and what is
refused with which lines."""

import csv
import io
import itertools
import re
import subprocess
import sys
import time
import tracemalloc
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mumacro.errors import InputError, TextError
from mumacro.fits.fit import fit
from mumacro.fits.measured_points import read_points
from mumacro.inputs.cells import (
    BLANKS,
    GAPS,
    Signs,
    evidence,
    joined,
    numbers_of,
    records,
    split_row,
)
from mumacro.inputs.decoding import Piece, Text
from mumacro.inputs.layout import LOOKED_AT, Dialect
from mumacro.inputs.names import ColumnNames, absent
from mumacro.inputs.text_tables import Most, TextTable, find_table
from mumacro.inputs.whole_tables import TableOfNumbers, read_numbers
from tests.support.comparing import close

V0 = [1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.2]
MU = [0.069, 0.097, 0.174, 0.221, 0.247, 0.274, 0.289, 0.305]
#: made after descriptions of what rigs and programs write, each with how it is read
RIGS = {
    "amplifier.asc": "Windows-1252, tab, decimal comma, header in line 9",
    "excel_de.csv": "semicolon, decimal comma, point between thousands, header in line 2",
    "finite_elements.txt": "blanks, header in line 6",
    "labview.lvm": "tab, decimal comma, header in line 23, units in line 18",
    "oscilloscope.csv": "comma, units in line 2",
    "preamble.csv": "comma, header in line 8",
    "rheometer.txt": "tab, header in line 10, units in line 11",
    "rheometer_utf16.csv": "UTF-16, tab, decimal comma, header in line 6, units in line 8",
    "savetxt.dat": "blanks, header in line 2",
    "testing_machine.csv": "comma, header in line 7, units in line 8",
    "windows_1252.csv": "Windows-1252, semicolon, decimal comma",
    "astronomers.ecsv": "blanks, header in line 9, units in line 4",
    "controller_recorder.csv": "comma, header in line 4, units in line 3",
    "data_logger.csv": "comma, header in line 7",
    "hydraulic.txt": "blanks, header in line 5, units in line 4",
    "joined.csv": "comma",
    "pruefstand_legende.csv": "Windows-1252, semicolon, decimal comma, header in line 4, units in "
    "line 2",
    "simulator.csv": "comma",
    "statistics_r.csv": "comma",
    "worksheet_origin.txt": "tab, units in line 2",
}
POINTS = ColumnNames({"v0": "v0", "mu_macro": "mu0", "note": "mu0"}, [["v0"], ["mu_macro"]])


@pytest.fixture
def rigs(repository: Path) -> Path:
    return repository / "tests" / "data" / "rigs"


def refused(text: str | bytes, **options: Any) -> TextError:
    """Why a table is refused."""
    with pytest.raises(TextError) as refusal:
        read(text, **options)
    assert len(str(refusal.value).splitlines()) == 1
    return refusal.value


def read(text: str | bytes, **options: Any) -> TableOfNumbers:
    data = text if isinstance(text, bytes) else text.encode()
    return read_numbers(
        data,
        ColumnNames(dict(list(POINTS.input_of.items())[:2]), POINTS.required_groups),
        Dialect(**options),
    )


@pytest.mark.parametrize("name", RIGS)
def test_what_rigs_write_is_read_and_said(rigs: Path, name: str) -> None:
    points = read_points(rigs / name)
    assert points.columns["v0"].tolist() == close(V0, rel=1e-12)
    assert points.columns["mu_macro"].tolist() == close(MU, rel=1e-12)
    assert points.read_as.partition("; ")[0] == RIGS[name]
    same = read_points((rigs / name).read_bytes())
    assert same.columns["v0"].tolist() == points.columns["v0"].tolist()


@pytest.mark.parametrize(
    ("name", "line", "parts"),
    [
        ("ambiguous.txt", 2, ("'1.000'", "may be 1 or 1000", "--decimal .", "--decimal ,")),
        ("recorder.csv", 6, ("neither a row nor a comment",)),
        ("two_steps.csv", 8, ("another header", "--rows 4..7")),
        ("catalogue.dat", 1, ("v0", "mu_macro")),
        ("plc_scope.csv", 13, ("'EOF'", "--rows 5..12")),
        ("rheometer_steps.txt", 11, ("'[step]'", "--rows 6..10")),
        ("rock_mechanics.txt", 1, ("'v0_um_s' to v0 [um/s]", "'mu' to mu_macro")),
        ("testing_machine_statistics.csv", 10, ("'Mean'", "statistics", "--rows 2..9")),
        ("worksheet_origin_comments.txt", 3, ("'mean of 3'", "--rows")),
    ],
)
def test_what_can_be_read_in_two_ways_names_its_line_and_the_remedy(
    rigs: Path, name: str, line: int, parts: tuple[str, ...]
) -> None:
    with pytest.raises(TextError) as refusal:
        read_points(rigs / name)
    assert str(refusal.value).startswith(f"line {line}")
    assert all(part in str(refusal.value) for part in parts)


@pytest.mark.parametrize(
    ("name", "rows"),
    [
        ("plc_scope.csv", (5, 12)),
        ("testing_machine_statistics.csv", (2, 9)),
        ("worksheet_origin_comments.txt", (4, 11)),
    ],
)
def test_the_rows_that_are_named_are_read(rigs: Path, name: str, rows: tuple[int, int]) -> None:
    points = read_points(rigs / name, Dialect(rows=rows))
    assert points.columns["v0"].tolist() == close(V0, rel=1e-12)
    assert points.lines == [*range(rows[0], rows[1] + 1)]


@pytest.mark.parametrize("text", ["v0,mu_macro\nmm/s,-\n1,0.2\n", "v0,mu_macro\n# mm/s,-\n1,0.2\n"])
def test_units_that_are_among_the_rows_that_are_named_count(text: str) -> None:
    table = read(text, rows=(2, 3))
    assert table.columns["v0"].tolist() == [1e-3]
    assert table.lines == [3]
    assert table.read_as == "comma, units in line 2, rows 3..3; v0 [mm/s], mu_macro [-]"


def test_units_between_the_rows_that_are_named_are_told() -> None:
    text = "v0,mu_macro\n10,0.2\n# v0: speed [mm/s]\n20,0.3\n"
    assert "line 3: v0 is in mm/s, the rows before are in m/s" in str(refused(text, rows=(2, 4)))


def test_units_above_the_rows_that_are_named_count_however_far_down_they_are() -> None:
    text = "v0 [mm/s],mu_macro\n" + "1,0.2\n" * 5000 + "v0 [um/s],mu_macro\n2,0.2\n"
    assert str(refused(text, rows=(5003, 5003))).startswith("line 5002: v0 is in um/s")
    assert read(text, rows=(5000, 5001)).lines == [5000, 5001]


def test_each_of_two_segments_is_read_with_its_own_units(rigs: Path) -> None:
    parts = [
        read_points(rigs / "rheometer_steps.txt", Dialect(rows=rows)).columns["v0"].tolist()
        for rows in ((6, 9), (15, 18))
    ]
    assert parts == [close(V0[:4], rel=1e-12), close(V0[4:], rel=1e-12)]


def test_two_forces_of_a_tribometer_are_read(rigs: Path) -> None:
    points = read_points(rigs / "tribometer_forces.csv")
    assert points.columns["Ft"].tolist() == close([10.0 * mu for mu in MU], rel=1e-12)
    assert points.read_as.endswith("v0 [mm/s], Ft [mN], Fz [N]")


def test_the_advice_for_an_ambiguous_number_works(rigs: Path) -> None:
    as_thousands = read_points(rigs / "ambiguous.txt", Dialect(decimal=",")).columns["v0"]
    as_decimals = read_points(rigs / "ambiguous.txt", Dialect(decimal=".")).columns["v0"]
    assert as_thousands.tolist() == close(V0, rel=1e-12)
    assert as_decimals.tolist() == close([1e-3 * v for v in V0], rel=1e-12)
    same = read_points(rigs / "ambiguous.txt", Dialect(thousands=".")).columns["v0"]
    assert same.tolist() == as_thousands.tolist()


def test_a_fit_reads_its_table_without_pyarrow(rigs: Path) -> None:
    program = (
        "import sys; sys.modules['pyarrow'] = None; from mumacro.cli.main import main; "
        f"sys.exit(main(['fit', {str(rigs / 'excel_de.csv')!r}, 'Fz=10N y0=0.4um f=20kHz']))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr


# --- every way to write a table -------------------------------------------------------------------

NUMBERS = st.floats(1e-9, 1e9).map(lambda x: float(f"{x:.6g}"))
FORMS = st.sampled_from(["r", ".6g", ".3f", ".4e", "D", ",.4f", ",.0f"])


def written(number: float, form: str, decimal: str) -> str:
    """A number as text; groups of thousands have the other sign."""
    text = (
        repr(number)
        if form == "r"
        else f"{number:.8E}".replace("E", "D")
        if form == "D"
        else f"{number:{form}}"
    )
    return text if decimal == "." else text.translate(str.maketrans(".,", ",."))


def value_of(text: str, decimal: str) -> float:
    plain = text if decimal == "." else text.translate(str.maketrans(".,", ",."))
    return float(plain.replace(",", "").replace("D", "E"))


@settings(max_examples=300)
@example([(1000.0, 1.0)], ",", ",", (",.0f", "r"), "\n", "utf-8", [], "none", False, "")
@given(
    rows=st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=8),
    sep=st.sampled_from([",", ";", "\t", "|", BLANKS]),
    decimal=st.sampled_from(".,"),
    forms=st.tuples(FORMS, FORMS),
    line_end=st.sampled_from(["\n", "\r\n", "\r"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "cp1252", "utf-16"]),
    before=st.lists(
        st.sampled_from(
            ["", "Rig: 7", "# v0 is the speed", "a,b;c\td", "date 2026-11-27", "1 2 3"]
        ),
        max_size=4,
    ),
    units=st.sampled_from(["none", "in the head", "below"]),
    quoted=st.booleans(),
    more=st.sampled_from(["", "comments", "empty", "trailing"]),
)
def test_a_table_is_read_as_it_was_written_unless_it_has_two_meanings(
    rows: list[tuple[float, float]],
    sep: str,
    decimal: str,
    forms: tuple[str, str],
    line_end: str,
    encoding: str,
    before: list[str],
    units: str,
    quoted: bool,
    more: str,
) -> None:
    cells = [
        [written(x, form, decimal) for x, form in zip(row, forms, strict=True)] for row in rows
    ]
    head = ["v0 [µm/s]", "mu_macro"] if units == "in the head" else ["v0", "mu_macro"]
    lines = [*before]
    for row in [head, *([["µm/s", "-"]] if units == "below" else []), *cells]:
        stream = io.StringIO(newline="")
        separator = "\t" if sep == BLANKS else sep
        style: Any = csv.QUOTE_ALL if quoted and sep != BLANKS else csv.QUOTE_MINIMAL
        csv.writer(stream, delimiter=separator, quoting=style, lineterminator="").writerow(row)
        text = stream.getvalue().replace("\t", "  ") if sep == BLANKS else stream.getvalue()
        lines.append(text + sep * (more == "trailing" and sep != BLANKS))
        lines += {"comments": ["# a comment"], "empty": ["", sep * 3]}.get(more, [])
    data = line_end.join([*lines, ""]).encode(encoding)
    shown = [evidence(cell) for row in cells for cell in row]
    if any(sign for sign, _ in shown) and not any(sure for _, sure in shown):
        # alone what may be read in two ways is refused; and read, once the sign is given
        signs = {sign for sign, _ in shown if sign}
        if not (sep == "," and signs == {"."}):
            assert "may be" in str(refused(data))
        table = read(data, decimal=decimal)
    else:
        table = read(data)
    scale = 1.0 if units == "none" else 1e-6
    expected = np.array([[value_of(cell, decimal) for cell in row] for row in cells])
    np.testing.assert_allclose(table.columns["v0"], scale * expected[:, 0], rtol=1e-14)
    np.testing.assert_allclose(table.columns["mu_macro"], expected[:, 1], rtol=1e-14)
    numbered = [i for i, line in enumerate(lines, 1) if cells[0][0] in line or len(rows) > 1]
    assert len(table.lines) == len(rows)
    assert {*table.lines} <= {*numbered}


@settings(max_examples=200)
@given(
    text=st.text(alphabet="ab,\r\nµ €", max_size=60),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-32"]),
    cuts=st.lists(st.integers(0, 300), max_size=6),
)
def test_lines_do_not_depend_on_how_the_bytes_come(
    text: str, encoding: str, cuts: list[int]
) -> None:
    data = text.encode(encoding)
    # the first piece shows the encoding
    places = [0, *sorted(min(4 + cut, len(data)) for cut in cuts), len(data)]
    pieces = [(data[a:b], 0.0) for a, b in itertools.pairwise(places)]
    expected = re.split("\r\n|\r|\n", text)
    expected = expected[:-1] if expected[-1] == "" else expected
    numbered = [
        (piece.first + i, line)
        for piece in Text(pieces, None if encoding != "utf-8" else "utf-8").pieces()
        for i, line in enumerate(piece.lines)
    ]
    assert numbered == list(enumerate(expected, 1))


@given(
    rows=st.lists(
        st.lists(st.text('ab ",;\n'), min_size=1, max_size=4).filter(lambda row: row != [""]),
        min_size=1,
        max_size=4,
    ),
    sep=st.sampled_from(",;"),
)
def test_cells_are_those_that_were_written_whatever_signs_they_have(
    rows: list[list[str]], sep: str
) -> None:
    lines = [joined(row, sep) for row in rows]
    found = [*records(Piece(1, "\n".join(lines)), sep, lambda _line: False)]
    assert [split_row(record.text, sep) for record in found] == rows
    assert not any(record.is_open for record in found)
    begins = itertools.accumulate((line.count("\n") + 1 for line in lines), initial=1)
    assert [record.line for record in found] == [*begins][:-1]


@given(
    text=st.text(alphabet="0123456789.,", max_size=12).filter(
        lambda x: not re.search(r"\.\.|,,", x)
    )
)
def test_the_signs_of_a_number_tell_the_same_with_both_swapped(text: str) -> None:
    swapped = str.maketrans(".,", ",.")
    sign, sure = evidence(text)
    assert evidence(text.translate(swapped)) == (sign.translate(swapped), sure)


def test_bytes_after_ascii_are_windows_1252_unless_they_are_mixed() -> None:
    head = "v0,mu_macro,note\n1,0.2,"
    assert read((head + "µ").encode("cp1252")).columns["v0"].tolist() == [1.0]
    assert "line 3" in str(refused((head + "µ\n2,0.3,").encode() + b"\xb5"))
    assert "0x81" in str(refused(head.encode() + b"\x81"))


def test_a_text_that_is_not_in_the_encoding_that_is_named_is_told() -> None:
    fault = refused("v0,mu_macro\n1,0.2\n", encoding="utf-16")
    assert "give utf-16-le or utf-16-be" in str(fault)


# --- options --------------------------------------------------------------------------------------


def test_a_given_option_wins_over_what_is_found() -> None:
    assert read("v0;mu_macro\n1.000;2\n", decimal=",").columns["v0"].tolist() == [1000.0]
    assert read("v0;mu_macro\n1.000;2,5\n", thousands=".").columns["v0"].tolist() == [1000.0]
    assert read("v0;mu_macro\n1'000;0.5\n", thousands="'").columns["v0"].tolist() == [1000.0]
    assert "line 2" in str(refused("v0;mu_macro\n1.000;2,5\n", thousands=""))
    assert "line 2" in str(refused("v0;mu_macro\n0.5;2\n", decimal=","))
    assert read("v0|mu_macro|a;b\n1|2|3\n", sep="|").columns["v0"].tolist() == [1.0]
    assert "v0" in str(refused("v0,mu_macro\n1,2\n", sep=";"))
    again = "v0,mu_macro\n1,2\nmu_macro,v0\n3,4\n"
    assert read(again, skip=2).columns["mu_macro"].tolist() == [3.0]
    assert read("v0,mu_macro,µ\n1,2,3\n".encode("mac-roman"), encoding="mac-roman").lines == [2]
    assert "both" in str(refused("v0,mu_macro\n1,2\n", decimal=",", thousands=","))
    for name in ("punycode", "idna", "rot13", "utf-7", "unicode_escape", "x" * 999):
        assert "is no encoding" in str(refused("v0,mu_macro\n1,2\n", encoding=name))


# --- cells ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("cell", "number"),
    [
        ("1.5", 1.5),
        ("1.0D-3", 1e-3),
        ("1.0d+03", 1000.0),
        ("−2", -2.0),
        ("+2", 2.0),
        ("1,234.5", 1234.5),
        ("12 345", 12345.0),
        ("12\u202f345.5", 12345.5),
        ("1'000", 1000.0),
        (" 7 ", 7.0),
    ],
)
def test_numbers_in_cells(cell: str, number: float) -> None:
    values, faults = numbers_of([cell], "v0", Signs("."))
    assert (values.tolist(), faults) == ([number], {})


@pytest.mark.parametrize("unit", ["-", "%"])
def test_per_cent_in_a_cell_comes_before_the_unit_of_the_column(unit: str) -> None:
    table = read(f"v0,mu_macro [{unit}]\n1,7 %\n")
    assert table.columns["mu_macro"].tolist() == close([0.07], rel=1e-15)


@pytest.mark.parametrize("gap", sorted(GAPS))
def test_every_spelling_of_a_gap_is_missing(gap: str) -> None:
    values, _ = numbers_of([gap, gap.upper(), f" {gap} "], "v0", Signs("."))
    assert np.isnan(values).all()
    if gap.strip("-–—−"):  # a row of dashes is one of units
        assert "line 3: v0 is missing" in str(refused(f'v0;mu_macro\n1;0,2\n"{gap}";0,3\n'))


@pytest.mark.parametrize(
    ("name", "cell", "fault"),
    [
        ("v0", "5 V", "must be a number: V is no unit of v0"),
        ("y0", "4 um pp", "must be half of peak to peak: give 0.5um in place of 1 um pp"),
        ("mu0", "0.3±0.1", "must be one number; a deviation is a column std_mu0"),
    ],
)
def test_the_fault_of_a_cell_says_what_helps(name: str, cell: str, fault: str) -> None:
    _, faults = numbers_of([cell], name, Signs("."))
    assert faults[0].startswith(fault)


# --- units ----------------------------------------------------------------------------------------


def test_a_row_of_units_is_checked() -> None:
    assert read("v0,mu_macro\nmm/s,%\n1,7\n").columns["v0"].tolist() == [1e-3]
    assert read("v0,mu_macro\n(mm/s),[-]\n1,7\n").units == {"v0": "mm/s", "mu_macro": "-"}
    assert read("v0 [mm/s],mu_macro\nmm/s,\n1,7\n").columns["v0"].tolist() == [1e-3]
    assert "line 2" in str(refused("v0 [m/s],mu_macro\nmm/s,\n1,7\n"))
    assert "line 2" in str(refused("v0,mu_macro\nfurlong,pct\n1,7\n"))
    assert read("v0 / (mm/s),mu_macro in %\n1,7\n").columns["mu_macro"].tolist() == [0.07]


TWO = "1,0.069\n2,0.097\n"
IN_MM = [1e-3, 2e-3]


@pytest.mark.parametrize(
    "text",
    [
        "# mm/s,-\nv0,mu_macro\n",
        "mm/s,-\nv0,mu_macro\n",
        "v0,mu_macro\n# mm/s,-\n",
        "v0,mu_macro\n# units: mm/s,-\n",
        "mm/s,-\nv0 [mm/s],mu_macro\nmm/s,-\n",
        "# v0: speed [mm/s]\nv0,mu_macro\n",
        "v0,mu_macro\n# v0: speed [mm/s]\n",
        "# v0 in mm/s, mu_macro\n\nv0,mu_macro\n",
        "# column 1: v0 (mm/s)\nv0,mu_macro\n",
        "# v0 = sliding speed, mm/s\nv0,mu_macro\n",
        "Speed,Friction\nv0,mu_macro\nmm/s,-\n",
    ],
)
def test_units_stand_beside_the_names_or_in_a_legend(text: str) -> None:
    table = read(text + TWO)
    assert table.columns["v0"].tolist() == close(IN_MM, rel=1e-15)
    assert "v0 [mm/s]" in table.read_as
    # a value with its unit, and prose, are no legends
    assert read("# v0 max: 3 mm/s\n# v0 was measured\nv0,mu_macro\n" + TWO).units["v0"] == "m/s"
    in_blanks = read(f"# v0 mu_macro\n# mm / s  -\n{TWO.replace(',', ' ')}")
    assert in_blanks.columns["v0"].tolist() == table.columns["v0"].tolist()


def test_a_first_segment_with_a_longer_row_of_units_is_not_lost() -> None:
    text = f"v0,mu_macro\nmm/s,-,N\n{TWO}\nv0,mu_macro\n{TWO}"
    assert "between the headers of lines 1 and 6: --skip 5" in str(refused(text))
    assert read(text, skip=5).lines == [7, 8]


@pytest.mark.parametrize("head", ["v0 [mm/s],mu_macro\n", "v0,mu_macro\nmm/s,-\n"])
def test_the_same_head_again_is_left_out_and_said(head: str) -> None:
    table = read(head + TWO + head + TWO)
    assert table.columns["v0"].tolist() == close([*IN_MM, *IN_MM], rel=1e-15)
    assert "the header again in line" in table.read_as
    assert len(table.skipped) == head.count("\n")


def test_of_many_heads_the_first_five_are_named() -> None:
    head = "v0 [mm/s],mu_macro\n1,0.2\n"
    assert read(6 * head).read_as.endswith("again in lines 3, 5, 7, 9, 11, left out")
    assert read(8 * head).read_as.endswith("again in lines 3, 5, 7, 9, 11 and 2 more, left out")


# --- bad input ------------------------------------------------------------------------------------


def zipped(name: str, data: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as parts:
        parts.writestr(name, data)
    return stream.getvalue()


ODS = b"PK\x03\x04" + bytes(26) + b"mimetypeapplication/vnd.oasis.opendocument.spreadsheet"
ALONE = "must be a number alone: write its unit into the header"


@pytest.mark.parametrize(
    ("data", "parts"),
    [
        # cells
        *(
            (f"v0\tmu_macro\n1\t0.2\n{cell}\t0.2\n", ("line 3: v0 ", repr(cell)))
            for cell in ("x", "1_0", "1.2.3", "0x10", "1e", "--1", "1e400", "1 2", "²")
        ),
        *(
            (f"v0;mu_macro\n{cell};0,2\n1,5;0,3\n", ("line 2: v0 ", ALONE))
            for cell in ("5 um/s", "5um/s", "2,5 mm/s")
        ),
        ("v0,mu_macro\n1,0.2 ± 0.1\n", ("line 2", "std")),
        ("v0,mu_macro\n1..2,0.2\n", ("line 2: v0",)),
        ("v0,mu_macro\n=A1*2,0.1\n", ("line 2: v0 is a formula without a value",)),
        # units
        ("x,mm/s,%\nv0,mu_macro\n" + TWO, ("line 1: ", "cannot be assigned")),
        ("# mm/s\nv0,mu_macro\n" + TWO, ("line 1: ", "cannot be assigned")),
        ("# v0: speed [furlong/h]\nv0,mu_macro\n" + TWO, ("line 1: ", "no unit of v0")),
        ("# v0: [N]\nv0,mu_macro\n" + TWO, ("line 1: ", "no unit of v0")),
        ("# speed unit: mm/s\nv0,mu_macro\n" + TWO, ("line 1: ", "v0 [mm/s]")),
        ("# Sliding speed [mm/s]\nv0,mu_macro\n" + TWO, ("line 1: ", "v0 [mm/s]")),
        ("v0,mu_macro\nmm/s,-,N\n" + TWO, ("line 2: ", "cannot be assigned")),
        ("mm/s,-\nv0,mu_macro\nm/s,-\n" + TWO, ("line 3: ", "line 1 says mm/s")),
        (f"v0,mu_macro\n{TWO}# v0: speed [mm/s]\n", ("line 4: ", "rows before are in m/s")),
        # files of another kind
        (b'{"v0": [1, 2], "mu_macro": [0.1, 0.2]}', ("JSON",)),
        (b'[{"v0": 1, "mu_macro": 0.1}]', ("JSON",)),
        (b"ARROW1\0\0", ("Arrow",)),
        (b"FEA1\0\0\0\0", ("Feather",)),
        (ODS, ("ods",)),
        (zipped("points.csv", b"v0,mu_macro\n"), ("zip file with points.csv; unpack it",)),
        # tables
        (b'v0,mu_macro,note\n1,2,a\n1,2,"b"c\n', ("line 3", "quote")),
        (b'name,v0,mu_macro,note\n#1,1,2,"b\nc",1,2,3\n', ("line 2", "quote")),
        (b"", ("line 1", "is empty")),
        (b"\n \n\t\n", ("line 1", "is empty")),
        (b"v0,mu_macro\n", ("line 1", "no row")),
        (b"speed,mu_macro\n1,2\n", ("line 1", "'speed'", "v0 [m/s]")),
        (b"a note\n\nspeed (mm/s);cof\n1,5;0,2\n2,5;0,3\n", ("line 3", "v0 [mm/s]")),
        (b'v0,mu_macro\n1,"0.2\n', ("line 2", "quote")),
        (b"v0,mu_macro\n1,0.2\n2", ("line 3 has 1 cell",)),
        (b"v0,mu_macro\n1,0.2\n\0\0\0", ("line 3", "zero byte")),
        (b"\0" * 5000, ("line 1", "zero byte")),
        (b"PK\x03\x04 no workbook", ("workbook",)),
        (b"\xd0\xcf\x11\xe0", (".xls",)),
        (b"<html>", ("HTML",)),
        (b"PAR1", ("Parquet",)),
        (b"v0;mu_macro\n0,5;0.5\n", ("line 2", "'0,5'", "'0.5'", "decimal")),
        (b"v0 [s],mu_macro\n1,2\n", ("line 1", "'v0 [s]'")),
        (b"v0 [s],mu_macro\n1,2\nMean,2\n", ("line 1: ", "'v0 [s]'")),
        (b"v0,v0,mu_macro\n1,1,2\n", ("line 1", "v0 is there twice")),
    ],
)
def test_one_line_says_where_a_table_is_wrong_and_how(
    data: str | bytes, parts: tuple[str, ...]
) -> None:
    message = str(refused(data))
    assert message.startswith(parts[0]) or not parts[0].endswith(" ")
    assert all(part in message for part in parts), message


@pytest.mark.parametrize("head", ["note,v0,mu_macro", "v0,mu_macro,note"])
@pytest.mark.parametrize("line", ['#1,"{}",1', 'x,"{}",1', '"{}",1,2', '1,2,"{}"'])
def test_a_cell_in_quotes_may_be_long(head: str, line: str) -> None:
    """The reader of CSV of Python takes 131,072 characters."""

    def outcome(n: int) -> object:
        text = line.format("a" * n)
        try:
            return read(f"{head}\n1,0.2,1\n{text}\n").lines
        except TextError as error:
            return str(error).split("'")[::2]  # without the excerpt

    assert outcome(200_000) == outcome(2)


def test_all_faults_are_told_by_line() -> None:
    fault = refused("v0,mu_macro\n" + "x,1\n" * 20)
    assert [one.partition(":")[0] for one in fault.faults] == [f"line {i}" for i in range(2, 22)]
    assert "and 15 more" in str(fault)


@pytest.mark.parametrize(
    ("begin", "fault"),
    [
        (b"", "line 1 has a zero byte"),
        (b"v0,mu_macro\n1,0.2\n", "line 3 has a zero byte"),
        (
            b'v0,mu_macro\n1,0.2\n"' + 30_000 * (b"1" * 1000 + b"\n"),
            "line 3: a quote is not closed",
        ),
    ],
    ids=["zeros", "rows", "open quote"],
)
def test_a_sparse_file_of_two_gigabytes_is_not_read_to_its_end(
    tmp_path: Path, begin: bytes, fault: str
) -> None:
    path = tmp_path / "sparse.csv"
    with path.open("wb") as stream:
        stream.write(begin)
        stream.truncate(2 * 2**30)
    with pytest.raises(TextError, match=fault):
        read_points(path)
    path.unlink()


def test_a_table_may_be_as_large_as_its_limits() -> None:
    data = b"v0,mu_macro,a\n" + 3 * b"1,0.2,abc\n"
    assert len(read_points(data, Dialect(), Most(rows=3, columns=3, cell=8)).lines) == 3
    for most, fault in (
        (Most(rows=2), "line 4: there are more than 2 rows"),
        (Most(columns=2), "line 1: there may be up to 2 columns"),
        (Most(cell=7), "line 1: a cell may have up to 7 characters"),
    ):
        with pytest.raises(TextError, match=fault):
            read_points(data, Dialect(), most)


def test_millions_of_empty_lines_are_counted_and_not_kept() -> None:
    def peak(n: int) -> int:
        data = b"v0,mu_macro\n" + b"\n" * n + b"1,0.2\n" + b"\n" * n
        tracemalloc.start()
        points = read(data)
        assert (points.lines, points.skipped) == ([n + 2], [])
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak

    # a piece of the text, and a list of its lines with 8 bytes each
    assert peak(8 * 2**20) - peak(2) < 64 * 2**20


def long_line(n: int) -> bytes:
    return b"v0,mu_macro\n" + b"1," * n


#: tables of n signs, made to be slow
SLOW: dict[str, Callable[[int], bytes]] = {
    "one line": long_line,
    "a head of columns": lambda n: (
        b"v0,mu_macro," + b",".join(b"c%d" % i for i in range(n // 8)) + b"\n1,2\n"
    ),
    "heads that are nearly right": lambda n: b"v0 mu_macr0 x\n" * (n // 14),
    "blanks in brackets": lambda n: b"v0 mu_macro k [" + b" " * n + b"x\n1 2\n",
    "open brackets": lambda n: b"v0 mu_macro " + b"[(" * (n // 2) + b"\n1 2\n",
    "quotes": lambda n: b"v0,mu_macro\n" + b'"",' * (n // 3) + b"\n",
    "open quotes": lambda n: b'v0,mu_macro\n"' + b"1\n" * (n // 2),
    "digits": lambda n: b"v0;mu_macro\n" + b"1" * (n // 2) + b".;" + b"1" * (n // 2) + b"\n",
    "groups": lambda n: b"v0;mu_macro\n1" + b".111" * (n // 4) + b"x;2\n",
    "comments": lambda n: b"v0,mu_macro\n1,2\n" + b"#\n" * (n // 2),
    "units": lambda n: b"v0,mu_macro\n" + b"m" * n + b",%\n1,2\n",
    "names in comments": lambda n: b"v0,mu_macro\n1,2\n" + b"# v0 x mu_macro\n" * (n // 16),
    "names in a long comment": lambda n: b"# " + b"v0 [" * (n // 4) + b"\nv0,mu_macro\n1,2\n",
    "lines of units": lambda n: b"v0,mu_macro\nm/s,-\n" + b"m/s,-\n" * (n // 6) + b"1,2\n",
    "heads again": lambda n: b"v0,mu_macro\n1,2\n" + b"v0,mu_macro\n" * (n // 12),
    "columns of ECSV": lambda n: (
        b"# %ECSV 1.0\n# " + b"{name: v0, unit: m/s}" * (n // 21) + b"\nv0 mu_macro\n1 2\n"
    ),
    "open braces of ECSV": lambda n: b"# %ECSV 1.0\n# " + b"{" * n + b"\nv0 mu_macro\n1 2\n",
    "blanks": lambda n: b"v0 mu_macro\n1 2\n" + b" " * n + b"x\n",
    "empty cells": lambda n: b"v0,mu_macro\n" + b"," * n + b"\n1,2\n",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SLOW)
def test_no_table_takes_longer_than_in_proportion_to_its_size(name: str) -> None:
    def seconds(data: bytes) -> float:
        times = []
        for _ in range(3):
            start = time.process_time()
            with suppress(TextError):
                read(data)
            times.append(time.process_time() - start)
        return min(times)

    # a quadratic one takes 64 times as long; an ordinary one stands for what a short one does not
    # need, such as memory
    ordinary = b"v0,mu_macro\n" + b"1,2\n" * 10_000
    short, long = map(SLOW[name], (20_000, 160_000))
    assert seconds(long) < 20.0 * seconds(short) + seconds(ordinary)


@pytest.mark.parametrize(
    ("head", "column"),
    [
        ("Amplitude [um]", "y0 [um]"),
        ("Amplitude µm", "y0 [µm]"),
        ("amplitude_mm", "y0 [mm]"),
        ("Amplitude", "y0 [m]"),
        ("peak amplitude [um]", "y0 [um]"),
        ("Amplitude peak-peak [um]", "y0 [um], with half of each value: it is peak to peak"),
        ("amplitude p-p µm", "y0 [µm], with half of each value: it is peak to peak"),
        ("Amplitude (pk to pk) [um]", "y0 [um], with half of each value: it is peak to peak"),
        ("amplitude_pp_um", "y0 [um], with half of each value: it is peak to peak"),
    ],
)
def test_advice_to_rename_a_column_keeps_its_unit_and_halves_peak_to_peak(
    head: str, column: str
) -> None:
    assert f"rename that column to {column} (or another unit" in absent(["y0"], [head])


@pytest.mark.parametrize(
    ("head", "advice"),
    [
        ("y0 [um pp]", "half of peak to peak: give 0.5um"),
        ("y0 [um rms]", "1.41421 times its rms value"),
        ("Fz [g]", "the weight of 1 g is 0.00980665 N"),
        ("Fz [kg]", "the weight of 1 kg is 9.80665 N"),
        ("v0 [rpm]", "times the radius"),
        ("omega [kHz]", "a frequency is f [Hz]"),
    ],
)
def test_the_unit_of_a_head_gets_the_advice_that_a_value_gets(head: str, advice: str) -> None:
    name = head.partition(" ")[0]
    columns = [head, *(one for one in ("v0", "mu_macro") if one != name)]
    with pytest.raises(TextError, match=re.escape(advice)):
        read_points(f"{','.join(columns)}\n{','.join('1' * len(columns))}\n".encode())


def test_columns_of_two_forces_stand_for_mu_macro() -> None:
    rows = [f"{v0},{10 * mu},10" for v0, mu in zip(V0, MU, strict=True)]
    table = read_points("\n".join(["v0,Ft,Fz", *rows]).encode())
    result = fit(table.columns, y0=0.4e-6, f=20e3)
    expected = fit({"v0": V0, "mu_macro": MU}, Fz=10.0, y0=0.4e-6, f=20e3)
    assert result.values["k"] == close(expected.values["k"], rel=1e-9)
    in_newtons = {"v0": V0, "Ft": [10.0 * mu for mu in MU]}
    same = fit(in_newtons, Fz=10.0, y0=0.4e-6, f=20e3)
    assert same.values["k"] == result.values["k"]
    with pytest.raises(InputError, match="Ft/Fz"):
        fit(in_newtons, y0=0.4e-6, f=20e3)
    measured = {"v0": V0, "mu_macro": MU, "Ft": [7.0] * len(V0)}  # mu_macro is what counts
    assert fit(measured, Fz=10.0, y0=0.4e-6, f=20e3).values["k"] == expected.values["k"]


@pytest.mark.parametrize(("sep", "last"), [(",", "7"), (";", "7"), (",", "0.5"), (";", "0,5")])
def test_the_decimal_separator_is_searched_in_lines_that_can_show_it(
    monkeypatch: pytest.MonkeyPatch, sep: str, last: str
) -> None:
    rows = 100 * LOOKED_AT
    lines = [sep.join(("v0", "mu_macro")), *[sep.join(("12", "7"))] * rows, sep.join(("12", last))]
    accounted = 0
    account = TextTable.account

    def counted(table: TextTable, record: Any) -> Any:
        nonlocal accounted
        accounted += 1
        return account(table, record)

    monkeypatch.setattr(TextTable, "account", counted)
    names = ColumnNames({"v0": "v0", "mu_macro": "mu0"}, [["v0"]])
    table = find_table("\n".join(lines).encode(), names, Dialect())
    assert table.signs.decimal == last.strip("0257")
    assert accounted < 10 * LOOKED_AT or last != "7"

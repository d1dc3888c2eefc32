"""``mumacro eval`` of tables as people and rigs write them: what is read, what is written, which
files of a folder are left out."""

import csv
import gzip
import io
import math
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.support.cases import CASE, Capture, opened
from tests.support.comparing import close

pa = pytest.importorskip("pyarrow", reason="the extra files is not installed")
pc = pytest.importorskip("pyarrow.compute")

from mumacro.cli.main import main  # noqa: E402
from mumacro.files import FilesError, evaluate_files  # noqa: E402
from mumacro.inputs import decoding  # noqa: E402
from mumacro.inputs.layout import Dialect  # noqa: E402
from mumacro.inputs.text_tables import NO_ROW  # noqa: E402

TABLE = opened(1e-12)
MU = [0.24046650645751833, 0.13083979951924246]
HEAD = "mu0,Fz,k,y0,f,v0"
ROWS = "0.3,10,1e6,2e-6,20000,0.01\n0.3,10,1e6,3e-6,20000,0.01\n"


def rows_of(path: Path, sep: str = ",") -> list[dict[str, str]]:
    text = path.read_bytes().decode("utf-8-sig")
    return list(csv.DictReader(io.StringIO(text, newline=""), delimiter=sep))


def friction(path: Path, sep: str = ",") -> list[float]:
    return [float(row["mu_macro"].replace(",", ".")) for row in rows_of(path, sep)]


@pytest.fixture
def rigs(repository: Path) -> Path:
    return repository / "tests" / "data" / "rigs"


@pytest.mark.parametrize(
    ("name", "sep", "head"),
    [
        ("units_row.csv", ",", "id,mu0,Fz [N],k [N/um],y0 [um],f [kHz],v0 [mm/s],mu_macro"),
        ("mixed_cr.csv", ",", "mu0,Fz,k,y0,f,v0,mu_macro"),
        ("thousands_de.csv", ";", "mu0;Fz [N];k [N/mm];y0 [nm];f [Hz];v0 [um/s];mu_macro"),
    ],
)
def test_files_of_rigs_are_evaluated_with_one_line_of_heads(
    tmp_path: Path, rigs: Path, name: str, sep: str, head: str
) -> None:
    said = list[str]()
    evaluate_files([rigs / name], tmp_path / "out.csv", TABLE, say=said.append)
    assert friction(tmp_path / "out.csv", sep) == close(MU, rel=1e-12)
    assert (tmp_path / "out.csv").read_text().startswith(head)
    (read_as,) = said
    assert "mu0 [-], Fz [N], k [N/" in read_as
    # what was written can be read again
    again = (tmp_path / "out.csv").read_text().replace("mu_", "own_", 2).replace("mu_ratio", "r")
    (tmp_path / "again.csv").write_text(
        again.replace("regime", "a").replace("error_bound", "b").replace("source", "c")
    )
    evaluate_files([tmp_path / "again.csv"], tmp_path / "twice.csv", TABLE)
    assert friction(tmp_path / "twice.csv", sep) == close(MU, rel=1e-12)


def test_fixed_columns_of_a_program_in_fortran(tmp_path: Path, rigs: Path) -> None:
    evaluate_files([rigs / "fortran.prn"], tmp_path / "out.csv", TABLE)
    expected = TABLE.evaluate(**{**CASE, "y0": np.array([2e-6, 3e-6])}).mu_macro
    assert friction(tmp_path / "out.csv") == expected.tolist()


@pytest.mark.parametrize("ending", ["tsv", "txt", "csv", "tsv.gz"])
@pytest.mark.parametrize("sep", [",", ";", "\t", " "])
def test_text_of_every_ending_comes_in_and_goes_out(tmp_path: Path, ending: str, sep: str) -> None:
    source = tmp_path / "cases.txt"
    source.write_text(f"{HEAD}\n{ROWS}".replace(",", sep))
    evaluate_files([source], tmp_path / f"out.{ending}", TABLE)
    assert (
        evaluate_files([source], tmp_path / f"o.{ending}", TABLE, dialect=Dialect(sep=sep)).answered
        == 2
    )
    if ending != "tsv.gz":
        tab = ending == "tsv" or (ending == "txt" and sep in "\t ")
        written = "\t" if tab else "," if sep in "\t " else sep
        assert friction(tmp_path / f"out.{ending}", written) == close(MU, rel=1e-12)


@settings(max_examples=40)
@given(
    notes=st.lists(
        st.sampled_from(["", "a", "a b", '"', "a\nb", "#1", "1,5", "µ", "x;y", "'", "a\tb"]),
        min_size=1,
        max_size=12,
    ),
    piece=st.sampled_from([5, 40, 1000]),
    sep=st.sampled_from([",", ";", "\t"]),
    more=st.sampled_from(["", "# a comment\n", "\n", ";;;;;;\n", f"note,{HEAD}\n"]),
)
@example(notes=["#1"], piece=5, sep=",", more=f"note,{HEAD}\n")  # the head behind its only row
@example(notes=["a\nb"], piece=5, sep=",", more=f"note,{HEAD}\n")
def test_plain_and_quoted_rows_give_the_same_however_the_file_is_cut(
    tmp_path_factory: pytest.TempPathFactory, notes: list[str], piece: int, sep: str, more: str
) -> None:
    folder = tmp_path_factory.mktemp("cut")
    rows = [
        [note, "0.3", "10", "1e6", f"{i + 1}e-6", "20000", "0.01"] for i, note in enumerate(notes)
    ]
    stream = io.StringIO(newline="")
    writer = csv.writer(stream, delimiter=sep, lineterminator="\n")
    writer.writerow(["note", *HEAD.split(",")])
    for row in rows:
        writer.writerow(row)
        stream.write(
            more.replace(",", sep).replace(";", sep) if "note" not in more or sep == "," else ""
        )
    (folder / "cases.csv").write_text(stream.getvalue(), "utf-8")
    whole = evaluate_files([folder / "cases.csv"], folder / "whole.csv", TABLE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(decoding, "PIECE", piece)
        evaluate_files([folder / "cases.csv"], folder / "cut.csv", TABLE)
        evaluate_files([folder / "cases.csv"], folder / "cut.parquet", TABLE)
    assert whole.answered == len(notes)
    assert (folder / "cut.csv").read_bytes() == (folder / "whole.csv").read_bytes()
    written = sep if sep != "\t" else ","
    assert [row["note"] for row in rows_of(folder / "cut.csv", written)] == notes


def test_what_others_leave_in_a_folder_is_skipped_with_a_word(
    tmp_path: Path, capsys: Capture
) -> None:
    runs = tmp_path / "runs"
    runs.mkdir()
    for name in ("a.csv", "b.csv"):
        (runs / name).write_text(f"{HEAD}\n{ROWS}")
    (runs / "~$a.csv").write_bytes(b"\0" * 165)
    (runs / "_SUCCESS.csv").write_text("")
    (runs / "notes.txt").write_text("no cases")
    (runs / "c.csv.rejects.csv").write_text("row")
    assert main(["eval", str(runs), "-o", str(tmp_path / "out.csv")]) == 0
    said = capsys.readouterr().err
    assert all(name in said for name in ("~$a.csv", "notes.txt"))
    assert len(friction(tmp_path / "out.csv")) == 4


def test_files_that_differ_in_their_dialect_alone_are_one(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(f"{HEAD}\n{ROWS}")
    (tmp_path / "b.csv").write_bytes(f"by hand\n{HEAD}\n{ROWS}".replace(",", ";").encode("utf-16"))
    files = [tmp_path / "a.csv", tmp_path / "b.csv"]
    evaluate_files(files, tmp_path / "out.csv", TABLE)
    assert friction(tmp_path / "out.csv") == close([*MU, *MU], rel=1e-12)
    (tmp_path / "b.csv").write_text(f"{HEAD}\n{ROWS}".replace(",", ";").replace(".", ","))
    with pytest.raises(FilesError, match="decimal separator"):
        evaluate_files(files, tmp_path / "o.csv", TABLE)
    evaluate_files(files, tmp_path / "o.parquet", TABLE)
    (tmp_path / "b.csv").write_text(f"{HEAD} [mm/s]\n{ROWS}")
    with pytest.raises(FilesError, match="header differs"):
        evaluate_files(files, tmp_path / "o.csv", TABLE)


TABLE_BYTES = f"{HEAD},note\n{ROWS}".replace("01\n", "01,a\n").encode()
MIB = 2**20
#: files that are no tables, or damaged ones, and what is said of each
HOSTILE: dict[str, tuple[Callable[[], bytes], str]] = {
    "empty": (lambda: b"", "line 1: must name the columns, and is empty"),
    "blank lines": (lambda: b"\n \r\n\t\n" * 5000, "line 1: must name the columns"),
    "bytes": (lambda: bytes(range(256)) * 40, "byte 0x81 in line 3 is not"),
    "a picture": (lambda: b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(90), "has a zero byte"),
    "a line of 64 MiB": (lambda: TABLE_BYTES + b"1" * 64 * MIB, "line 4 has more than 16 MiB"),
    "64 MiB of cells": (lambda: TABLE_BYTES + b"1," * 32 * MIB, "line 4 has more than 16 MiB"),
    "an open quote": (
        lambda: TABLE_BYTES + b'0.3,10,1e6,2e-6,2e4,0.01,"a\n' + TABLE_BYTES * 200_000,
        "line 4: a quote is not closed",
    ),
    "cut in a quote": (
        lambda: TABLE_BYTES + b'0.3,10,1e6,2e-6,2e4,0.01,"a',
        "line 4: a quote is not closed",
    ),
    "a head of 100,000 other columns": (
        lambda: ",".join(f"c{i}" for i in range(100_000)).encode(),
        "line 1: there are no columns mu0",
    ),
    "a head of a million columns": (
        lambda: TABLE_BYTES.replace(b"note", b"c," * 1_000_000),
        "line 1: the column 'c' is there twice",
    ),
    "mixed encodings": (
        lambda: TABLE_BYTES + "0.3,10,1e6,2e-6,2e4,0.01,µ\n".encode() + b"0.3,10,1,1,1,1,\xb5\n",
        "byte 0xb5 in line 5 is not UTF-8",
    ),
    "mixed signs": (
        lambda: TABLE_BYTES.replace(b",", b";") + b"0,3;10;1e6;2e-6;2e4;0,01;a\n",
        "line 4: mu0 '0,3' a decimal comma",
    ),
    "a number of two meanings": (
        lambda: (
            TABLE_BYTES.replace(b",", b"\t")
            .replace(b"0.3", b"1")
            .replace(b"1e6", b"1.000")
            .replace(b"2e-6", b"2")
            .replace(b"3e-6", b"3")
            .replace(b"0.01", b"1")
        ),
        "line 2: k '1.000' may be 1 or 1000",
    ),
    "a unit of another input": (
        lambda: TABLE_BYTES.replace(b"note\n", b"note\nm,N,N/m,m,Hz,m/s,-\n"),
        "units that cannot be assigned to the columns mu0",
    ),
    "JSON": (lambda: b"{}", "it is JSON"),
    "other columns": (lambda: b"a;b;c\n1;2;3\n", "line 1: there are no columns mu0"),
    "a head of words alone": (
        lambda: b"contact,note\nball,1\n",
        "line 1: there are no columns mu0",
    ),
    "no column of k": (lambda: b"mu0,Fz,y0,omega,v0\n", "line 1: there is no column k"),
    "a missing column beside a bad row": (
        lambda: f"{HEAD.replace('v0', 'w0')}\n{ROWS}Mean,10,1,1,1,1\n".encode(),
        "line 1: there is no column v0",
    ),
    "two tables": (
        lambda: TABLE_BYTES + TABLE_BYTES.replace(b"v0", b"v0 [mm/s]"),
        "line 4 is another header",
    ),
}


@pytest.mark.parametrize("end", ["csv", "parquet"])
@pytest.mark.parametrize("name", HOSTILE)
def test_a_file_that_is_no_table_gets_one_line_and_leaves_nothing(
    tmp_path: Path, capsys: Capture, name: str, end: str
) -> None:
    data, what = HOSTILE[name]
    (tmp_path / "cases.csv").write_bytes(data())
    assert main(["eval", str(tmp_path / "cases.csv"), "-o", str(tmp_path / f"out.{end}")]) == 1
    (said,) = capsys.readouterr().err.splitlines()
    assert said.startswith(f"mumacro eval: {tmp_path / 'cases.csv'}: ")
    assert what in said
    assert len(said) < 2000
    assert [path.name for path in tmp_path.iterdir()] == ["cases.csv"]


@pytest.mark.parametrize("end", ["csv", "parquet"])
def test_a_file_that_is_cut_or_has_two_gigabytes_of_zeros_leaves_nothing(
    tmp_path: Path, end: str
) -> None:
    packed = gzip.compress(TABLE_BYTES * 9)
    (tmp_path / "cut.csv.gz").write_bytes(packed[: len(packed) // 2])
    with pytest.raises(FilesError, match="the compressed file is damaged"):
        evaluate_files([tmp_path / "cut.csv.gz"], tmp_path / f"out.{end}", TABLE)
    with (tmp_path / "sparse.csv").open("wb") as stream:
        stream.write(TABLE_BYTES)
        stream.truncate(2 * 2**30)
    with pytest.raises(FilesError, match="line 4 has a zero byte"):
        evaluate_files([tmp_path / "sparse.csv"], tmp_path / f"out.{end}", TABLE)
    assert {path.name for path in tmp_path.iterdir()} == {"cut.csv.gz", "sparse.csv"}


def test_a_head_of_a_hundred_thousand_columns(tmp_path: Path, capsys: Capture) -> None:
    more = ",".join(f"c{i}" for i in range(100_000))
    cells = ",".join("1" for _ in range(100_000))
    source, out = tmp_path / "wide.csv", tmp_path / "out.csv"
    source.write_text(f"{HEAD},{more}\n" + ROWS.replace("\n", f",{cells}\n"))
    assert main(["eval", str(source), "-o", str(out)]) == 0
    csv.field_size_limit()
    line = out.read_text().splitlines()[1].split(",")
    assert float(line[100_006]) == close(MU[0], rel=1e-12)
    source.write_text(f"{HEAD.replace('v0', 'w0')},{more}\n" + ROWS.replace("\n", f",{cells}\n"))
    capsys.readouterr()
    assert main(["eval", str(source), "-o", str(out), "--force"]) == 1
    assert len(capsys.readouterr().err) < 2000


def test_only_the_columns_in_which_a_line_may_begin_are_looked_through(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    looked_through = Mock(side_effect=pc.match_substring_regex)
    monkeypatch.setattr(pc, "match_substring_regex", looked_through)
    head, row = ",".join(f"c{i}" for i in range(50)), ",".join(["1"] * 48)
    text = f"{head},{HEAD}\n" + "".join(
        f"{cell},b,{row},{line}\n" for cell, line in zip(("a", ""), ROWS.splitlines(), strict=True)
    )
    (tmp_path / "cases.csv").write_text(text)
    assert evaluate_files([tmp_path / "cases.csv"], tmp_path / "out.csv", TABLE).answered == 2
    in_columns = [call for call in looked_through.call_args_list if call.args[1] == NO_ROW]
    assert len(in_columns) == 2


def test_a_row_without_a_value_is_rejected_and_the_run_goes_on(tmp_path: Path) -> None:
    row = ROWS.splitlines()[0]
    text = f"name,note,{HEAD}\na,b,{row}\nc,d{',' * 6}\n7{',' * 7}\ne,f,{row}\n"
    (tmp_path / "cases.csv").write_text(text)
    summary = evaluate_files([tmp_path / "cases.csv"], tmp_path / "out.csv", TABLE)
    assert (summary.answered, summary.rejected) == (2, 2)


@settings(max_examples=40)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(
                ["r1", '"a, b"', '"a ""b"""', '"two\nlines"', "#1", "mean 1", '5"', ""]
            ),
            st.sampled_from(["0.3", "", "-", "nan", "0.4", "1e-1", "x", " 0.2"]),
            st.sampled_from(["1e6", "rigid", "inf", "1e999", "2.5E6", ""]),
            st.sampled_from(["ok", "std", '"q"', "", "# no comment"]),
        ),
        min_size=1,
        max_size=12,
    )
)
def test_rows_read_at_once_are_those_read_one_by_one(
    tmp_path_factory: pytest.TempPathFactory, rows: list[tuple[str, str, str, str]]
) -> None:
    lines = [f"{name},{mu0},10,{k},2e-6,20000,0.01,{note}" for name, mu0, k, note in rows]
    folder, head = tmp_path_factory.mktemp("rows"), f"name,{HEAD},note"
    read = []
    for comment in ("", "# a comment, for which all lines are looked at\n"):
        path = folder / "cases.csv"
        path.write_text("\n".join([head, *lines, comment]))
        try:
            summary = evaluate_files([path], folder / "out.csv", TABLE, force=True)
            rejects = summary.rejects.read_text() if summary.rejects else ""
            read.append(((folder / "out.csv").read_text(), rejects))
        except FilesError as error:
            read.append((str(error), ""))
    assert read[0] == read[1]


@pytest.mark.parametrize("comment", ["", "# a comment, for which all lines are looked at\n"])
def test_a_row_whose_first_cell_is_a_gap_such_as_nv_is_rejected(
    tmp_path: Path, comment: str
) -> None:
    (tmp_path / "cases.csv").write_text(f"{HEAD}\n{comment}{ROWS}#N/A,10,1e6,3e-6,20000,0.01\n")
    summary = evaluate_files([tmp_path / "cases.csv"], tmp_path / "out.csv", TABLE)
    assert (summary.rows, summary.rejected) == (3, 1)
    assert summary.rejects is not None
    assert summary.rejects.read_text().endswith("mu0,#N/A,is missing\n")


def test_the_decimal_sign_may_show_late(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decoding, "PIECE", 100)
    row = "1;10;1000000;1;20000;1\n"
    late = row * 40 + row.replace(";1\n", ";0,5\n")
    (tmp_path / "late.csv").write_text(f"{HEAD}\n".replace(",", ";") + late)
    summary = evaluate_files([tmp_path / "late.csv"], tmp_path / "out.parquet", TABLE)
    assert (summary.answered, summary.rejected) == (41, 0)


def test_a_piece_without_a_row_says_nothing_about_the_contact(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(decoding, "PIECE", 200)
    rows = "".join(f"{line},ball\n" for line in ROWS.splitlines())
    (tmp_path / "cases.csv").write_text(f"{HEAD},contact\n{rows * 20}" + "# end\n\n\n" * 200)
    summary = evaluate_files([tmp_path / "cases.csv"], tmp_path / "out.csv", TABLE)
    assert (summary.rows, summary.rejected) == (40, 0)


# --- workbooks ------------------------------------------------------------------------------------


@pytest.fixture
def workbook(tmp_path: Path) -> Any:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["Rig 7"])
    sheet.append([])
    sheet.append(["mu0 [%]", "Fz", "k", "y0", "f", "v0", "day"])
    sheet.append(["", "N", "N/um", "um", "kHz", "mm/s", ""])
    for y0 in (2, 3):
        sheet.append([0.3, 10, 1, y0, 20, 10.0, "Monday"])
        sheet.cell(sheet.max_row, 1).number_format = "0 %"
    book.create_sheet("others").append(["x"])
    book.save(tmp_path / "cases.xlsx")
    return tmp_path / "cases.xlsx"


def test_the_first_sheet_of_a_workbook_is_read(tmp_path: Path, workbook: Path) -> None:
    said = list[str]()
    evaluate_files([workbook], tmp_path / "out.csv", TABLE, say=said.append)
    assert friction(tmp_path / "out.csv") == close(MU, rel=1e-12)
    assert [row["day"] for row in rows_of(tmp_path / "out.csv")] == ["Monday"] * 2
    assert "header in line 3, units in line 4" in said[0]


def sheets(path: Path, **rows_of: Any) -> Path:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for title, rows in rows_of.items():
        sheet = book.create_sheet(title)
        for row in rows:
            sheet.append(row)
    book.save(path)
    return path


@pytest.mark.parametrize("end", ["csv", "parquet"])
def test_a_table_may_begin_in_any_column_and_have_columns_without_a_name(
    tmp_path: Path, end: str
) -> None:
    head: list[Any] = [None, None, "mu0", "Fz", None, "k", "y0", "f", "v0", None, "note"]
    row: list[Any] = [None, "a", 0.3, 10, "b", 1e6, 2e-6, 20000, 0.01, None, "c"]
    path = sheets(tmp_path / "cases.xlsx", data=[[], head, row])
    out = tmp_path / f"out.{end}"
    evaluate_files([path], out, TABLE)
    if end == "parquet":
        (answer,) = pa.parquet.read_table(out).to_pylist()
    else:
        (answer,) = rows_of(out)
    assert [answer[f"column {i}"] or "" for i in (1, 2, 5, 10)] == ["", "a", "b", ""]
    assert answer["note"] == "c"
    assert float(answer["mu_macro"]) == close(MU[0], rel=1e-12)


def test_rows_with_numbers_that_the_header_does_not_name_are_told_so(tmp_path: Path) -> None:
    path, out = tmp_path / "cases.txt", tmp_path / "out.csv"
    path.write_text('"mu0" "Fz" "k" "y0" "f" "v0"\n"1" 0.3 10 1e6 2e-6 2e4 0.01\n')
    assert evaluate_files([path], out, TABLE).rejected == 1
    (reject,) = rows_of(tmp_path / "out.csv.rejects.csv")
    assert reject["reason"].endswith("name every column, also that of the row numbers")


CASE_ROWS: list[list[Any]] = [HEAD.split(","), [0.3, 10, 1e6, 2e-6, 20000, 0.01]]


def test_the_sheet_that_has_the_names_is_taken_and_the_others_are_named(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    path = sheets(tmp_path / "c.xlsx", Cover=[["Rig 7"], []], Hidden=CASE_ROWS, Data=CASE_ROWS)
    book = openpyxl.load_workbook(path)
    book["Hidden"].sheet_state = "hidden"
    book.save(path)
    said = list[str]()
    evaluate_files([path], tmp_path / "out.csv", TABLE, say=said.append)
    assert friction(tmp_path / "out.csv") == close(MU[:1], rel=1e-12)
    assert "sheet 'Data', not 'Cover', 'Hidden'" in said[0]
    twice = sheets(tmp_path / "d.xlsx", a=CASE_ROWS, b=[*CASE_ROWS, CASE_ROWS[1]])
    with pytest.raises(FilesError, match=r"'a' and 'b' all have the names; choose one \(--sheet\)"):
        evaluate_files([twice], tmp_path / "o.csv", TABLE)
    named = evaluate_files([twice], tmp_path / "o.csv", TABLE, dialect=Dialect(sheet="b"))
    assert named.answered == 2
    with pytest.raises(FilesError, match="there is no sheet 'c'; there are 'a', 'b'"):
        evaluate_files([twice], tmp_path / "p.csv", TABLE, dialect=Dialect(sheet="c"))


@pytest.mark.parametrize(
    ("cell", "form", "reason"),
    [
        (2.0, '0.0 "um"', "write its unit into the header, as in y0 [um]"),
        (2.0, "0.0\\ \\u\\m", "write its unit into the header, as in y0 [um]"),
        ("=A2*2", "General", "is a formula without a value"),
    ],
)
def test_a_unit_in_a_number_format_and_a_formula_without_a_value_are_rejected(
    tmp_path: Path, cell: Any, form: str, reason: str
) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    path = sheets(tmp_path / "c.xlsx", Data=CASE_ROWS)
    book = openpyxl.load_workbook(path)
    book["Data"]["D2"] = cell
    book["Data"]["D2"].number_format = form
    book.save(path)
    assert evaluate_files([path], tmp_path / "out.csv", TABLE).rejected == 1
    (row,) = rows_of(tmp_path / "out.csv.rejects.csv")
    assert (row["line"], row["field"]) == ("2", "y0")
    assert reason in row["reason"]


def test_a_formula_is_found_wherever_it_stands_in_its_sheet(tmp_path: Path) -> None:
    """Also across the end of a piece that is searched at once, 1 MiB."""
    row = [*CASE_ROWS[1][:3], "=A2*2", *CASE_ROWS[1][4:]]
    path, moved = sheets(tmp_path / "c.xlsx", Data=[CASE_ROWS[0], row]), tmp_path / "moved.xlsx"
    with zipfile.ZipFile(path) as parts, zipfile.ZipFile(moved, "w") as out:
        for part in parts.infolist():
            data = parts.read(part)
            if b"<f>" in data:
                blanks = b" " * (2**20 - 1 - data.index(b"<f>") - len(b"<!---->"))
                data = data.replace(b"<sheetData>", b"<!--%s--><sheetData>" % blanks)
                assert data.index(b"<f>") == 2**20 - 1
            out.writestr(part, data)
    assert evaluate_files([moved], tmp_path / "out.csv", TABLE).rejected == 1
    (reject,) = rows_of(tmp_path / "out.csv.rejects.csv")
    assert "is a formula without a value" in reject["reason"]


def test_options_count_for_workbooks(tmp_path: Path) -> None:
    cells: list[Any] = ["0,3", 10, 1e6, 2e-6, "20.000", 0.01]
    path = sheets(tmp_path / "c.xlsx", Data=[["v0", "mu0"], *CASE_ROWS[:1], cells, ["mean"]])
    dialect = Dialect(decimal=",", skip=1, rows=(3, 3))
    evaluate_files([path], tmp_path / "out.csv", TABLE, dialect=dialect)
    assert friction(tmp_path / "out.csv", ";") == close(MU[:1], rel=1e-12)


@pytest.mark.parametrize("quote", ["", '"'])
@pytest.mark.parametrize(
    ("more", "line", "part"),
    [
        (HEAD.replace("v0", "v0 [mm/s]"), 4, "another header"),
        ("Mean,10,1e6,2e-6,20000,0.01", 4, "statistics"),
        ("Segment 2", 4, "neither a row nor a comment"),
        ("-,N,N/m,m,Hz,mm/s", 4, "v0 is in mm/s"),
        ("# v0: speed [mm/s]", 4, "v0 is in mm/s"),
    ],
)
def test_what_is_no_row_ends_the_run_with_and_without_quotes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, quote: str, more: str, line: int, part: str
) -> None:
    monkeypatch.setattr(decoding, "PIECE", 60)
    quoted = ROWS.replace("0.3", f"{quote}0.3{quote}")
    (tmp_path / "cases.csv").write_text(f"{HEAD}\n{quoted}{more}\n{quoted}")
    with pytest.raises(FilesError, match=f"line {line}.*{part}"):
        evaluate_files([tmp_path / "cases.csv"], tmp_path / "out.csv", TABLE)
    assert [path.name for path in tmp_path.iterdir()] == ["cases.csv"]
    only = evaluate_files(
        [tmp_path / "cases.csv"], tmp_path / "out.csv", TABLE, dialect=Dialect(rows=(2, 3))
    )
    assert (only.answered, only.rejected) == (2, 0)
    assert friction(tmp_path / "out.csv") == close(MU, rel=1e-12)


#: what begins a row of statistics: in three languages, short and with words behind it
LABELS = [
    *("Mean", "AVERAGE", "Avg.", "median", "Min", "Maximum", "minimum", "Sum", "Total", "Range"),
    *("Variance", "CoV", "cv", "s.d.", "SD", "RSD", "Count", "Std", "stdev"),
    *("Mittelwert", "MW", "Spannweite", "Stabw", "moyenne", "Ecart-type", "Écart type"),
    *("max. value", "Std. Dev.", "Standard deviation", "standard error", "mean of 3"),
]


@pytest.mark.parametrize("label", LABELS)
@pytest.mark.parametrize("quote", ["", '"'])
def test_a_row_of_statistics_is_found_behind_any_name(
    tmp_path: Path, label: str, quote: str
) -> None:
    row = ROWS.splitlines()[0]
    text = f"name,{HEAD}\nab,{row}\nmotor,{row}\n{quote}{label}{quote},{row}\n"
    (tmp_path / "cases.csv").write_text(text, "utf-8")
    with pytest.raises(FilesError, match=r"line 4: .* begins a row of statistics: --rows 2\.\.3"):
        evaluate_files([tmp_path / "cases.csv"], tmp_path / "out.csv", TABLE)


def test_quotes_change_no_row_and_no_reject(tmp_path: Path) -> None:
    cells = ["0.3", "-1", "", "1e400", "x", "rigid", "nan", "1.0D-1", "1,5", "2 um", "+0.3"]
    lines = [f"a,{cell if ',' not in cell else '0.3'},10,{k},2e-6,2e4,0.01,µ" for cell in cells
             for k in ("1e6", "rigid", "inf", "1e400", "")]  # fmt: skip
    head = "a,mu0,Fz,k,y0,f,v0,note"
    for name, last in (("plain", "b"), ("quoted", '"b"')):
        text = "\n".join([head, *lines, f"{last},0.3,10,1e6,2e-6,2e4,0.01,b", "0,1"])
        (tmp_path / f"{name}.csv").write_text(text, "utf-8")
        evaluate_files([tmp_path / f"{name}.csv"], tmp_path / f"{name}.out.csv", TABLE)
    for ending in ("out.csv", "out.csv.rejects.csv"):
        plain, quoted = (
            (tmp_path / f"{name}.{ending}").read_text("utf-8") for name in ("plain", "quoted")
        )
        assert plain == quoted.replace('"b"', "b")


def test_a_text_that_may_be_two_numbers_is_none_in_a_workbook(
    tmp_path: Path, workbook: Path
) -> None:
    openpyxl = pytest.importorskip("openpyxl")

    book = openpyxl.load_workbook(workbook)
    book.worksheets[0]["C5"] = "1.000"
    book.save(workbook)
    assert evaluate_files([workbook], tmp_path / "out.csv", TABLE).rejected == 1
    assert (tmp_path / "out.csv.rejects.csv").read_text().splitlines()[1].startswith("5,k,")


def test_a_corner_far_away_and_a_damaged_workbook(tmp_path: Path, workbook: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")

    book = openpyxl.load_workbook(workbook)
    book.worksheets[0].cell(30_000, 16_384, "far")
    book.save(workbook)
    summary = evaluate_files([workbook], tmp_path / "out.parquet", TABLE)
    assert summary.answered == 2
    data = workbook.read_bytes()
    for cut in (10, len(data) // 2, len(data) - 30):
        workbook.write_bytes(data[:cut])
        with pytest.raises(FilesError, match="workbook"):
            evaluate_files([workbook], tmp_path / "cut.csv", TABLE)
    assert not math.isnan(summary.answered)


@pytest.mark.parametrize(
    ("name", "size"), [("xl/styles.xml", 5), ("xl/sharedStrings.xml", 65), ("xl/any.xml", 5)]
)
def test_the_parts_of_a_workbook_are_weighed_before_they_are_read(
    tmp_path: Path, workbook: Path, monkeypatch: pytest.MonkeyPatch, name: str, size: int
) -> None:
    monkeypatch.setattr(
        pytest.importorskip("openpyxl"), "load_workbook", Mock(side_effect=AssertionError)
    )
    with zipfile.ZipFile(workbook, "w", zipfile.ZIP_DEFLATED) as book:
        book.writestr("[Content_Types].xml", "<Types/>")
        with book.open(name, "w") as part:
            for _ in range(size):
                part.write(bytes(2**20))
    with pytest.raises(FilesError, match=f"MiB in '{name}' .*save it as CSV"):
        evaluate_files([workbook], tmp_path / "out.csv", TABLE)


def test_a_workbook_without_openpyxl_gets_the_remedy(
    tmp_path: Path, workbook: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "openpyxl", None)
    with pytest.raises(FilesError, match=r"mumacro\[files\].*save it as CSV"):
        evaluate_files([workbook], tmp_path / "out.csv", TABLE)

"""``mumacro eval``: what comes in, in which form, what comes out, and which rows are rejected with
which reason."""

import csv
import decimal
import gzip
import io
import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.cases import Capture, Case, opened

pa = pytest.importorskip("pyarrow", reason="the extra files is not installed")
import pyarrow.parquet as pq  # noqa: E402

from mumacro.cli.main import main  # noqa: E402
from mumacro.files import ANSWERS, evaluate_files, sources  # noqa: E402
from mumacro.inputs import decoding  # noqa: E402
from tests.support.forms import as_csv  # noqa: E402

NAMES, TABLE = ("mu0", "Fz", "k", "y0", "omega", "v0"), opened(1e-12)
HEADER = ",".join(NAMES)
GOOD = "0.3,10,1e6,2e-6,1.3e5,0.01"
CASE: Case = dict(zip(NAMES, map(float, GOOD.split(",")), strict=True))
KINDS = ("csv", "csv.gz", "tsv", "parquet")
MISSING_K = "is missing; write rigid or a number"


def cases(n: int, seed: int = 1) -> Any:
    rng = np.random.default_rng(seed)
    low, high = np.array([-2, -1, 4, -8, 2, -5]), np.array([0, 3, 8, -4, 6, 1])
    columns = dict(zip(NAMES, (10.0 ** rng.uniform(low, high, (n, 6))).T, strict=True))
    columns["k"][::7] = math.inf
    return pa.table(columns)


def write(cases: Any, path: Any) -> Any:
    """Cases in the format of the name; an infinite k is the word rigid, where the format has no
    infinity."""
    if path.suffix == ".parquet":
        pq.write_table(cases, path, row_group_size=100)
        return path
    rows = [
        {name: "rigid" if x == math.inf else x for name, x in row.items()}
        for row in cases.to_pylist()
    ]
    text = as_csv(rows)
    data = (text.replace(",", "\t") if ".tsv" in path.name else text).encode()
    path.write_bytes(gzip.compress(data) if path.suffix == ".gz" else data)
    return path


def read(path: Any, sep: str = ",") -> Any:
    """Rows of an output as dicts of Python values; cells of CSV as text."""
    if path.suffix == ".parquet":
        return pq.read_table(path).to_pylist()
    data = path.read_bytes()
    text = (gzip.decompress(data) if path.suffix == ".gz" else data).decode()
    delimiter = "\t" if ".tsv" in path.name else sep
    return list(csv.DictReader(io.StringIO(text, newline=""), delimiter=delimiter))


def rejects_of(path: Any) -> Any:
    rows = read(path.with_name(path.name + ".rejects.csv"))
    return [(int(row.get("line") or row["row"]), row["field"], row["reason"]) for row in rows]


def ran(capsys: Capture, code: Any, *words: Any) -> Any:
    """The last line of ``mumacro eval WORDS``; the only one if it fails."""
    assert main(["eval", *map(str, words)]) == code
    output = capsys.readouterr()
    assert "Traceback" not in output.err
    assert code not in (1, 2) or len(output.err.splitlines()) == 1
    return output.err if code in (1, 2) else output.out


@pytest.mark.parametrize("start", KINDS)
@pytest.mark.parametrize("end", KINDS)
def test_every_format_goes_into_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, start: Any, end: Any
) -> None:
    monkeypatch.setattr(sources, "ROWS", 70)  # several blocks
    monkeypatch.setattr(decoding, "PIECE", 5000)
    inputs = cases(300)
    source, out = write(inputs, tmp_path / f"cases.{start}"), tmp_path / f"out.{end}"
    summary = evaluate_files([source], out, TABLE)
    assert (summary.rows, summary.answered, summary.rejects) == (300, 300, None)
    written = read(out)
    columns = {name: inputs.column(name).to_numpy() for name in NAMES}
    expected = TABLE.evaluate(**columns)
    assert list(written[0]) == [*NAMES, *ANSWERS]
    for name in (*NAMES, "mu_macro", "mu_ratio", "error_bound"):
        target = columns[name] if name in NAMES else getattr(expected, name)
        assert [
            math.inf if row[name] == "rigid" else float(row[name]) for row in written
        ] == target.tolist()
    for name in ("source", "regime"):
        assert [row[name] for row in written] == getattr(expected, name).tolist()


def test_columns_of_parquet_keep_their_types_and_are_valid_as_text(tmp_path: Path) -> None:
    others = {
        "i32": pa.array(range(300), pa.int32()),
        "f32": pa.array([0.1, math.nan, -math.inf] * 100, pa.float32()),
        "ns": pa.array([10**18 + i for i in range(300)], pa.timestamp("ns", "UTC")),
        "words": pa.array(["a", 'b"', None] * 100).dictionary_encode(),
        "text": pa.array(["µ,\n\\"] * 300),
        "money": pa.array([decimal.Decimal("1.10")] * 300),
        "list": pa.array([[1, 2]] * 300),
        "flag": pa.array([True, None] * 150),
    }
    inputs = cases(300)
    for name, values in others.items():
        inputs = inputs.append_column(name, values)
    source = write(inputs, tmp_path / "cases.parquet")
    evaluate_files([source], tmp_path / "out.parquet", TABLE)
    written, before = pq.read_table(tmp_path / "out.parquet"), pq.read_table(source)
    assert written.select(before.schema.names).schema == before.schema
    assert (
        written.select(before.schema.names).drop_columns("f32").equals(before.drop_columns("f32"))
    )
    assert pa.types.is_dictionary(written.schema.field("regime").type)
    evaluate_files([source], tmp_path / "out.csv", TABLE)
    rows = read(tmp_path / "out.csv")
    assert [row["text"] for row in rows] == ["µ,\n\\"] * 300
    assert [row["words"] for row in rows[:3]] == ["a", 'b"', ""]
    assert [row["f32"] for row in rows[1:3]] == ["", ""]
    assert json.loads(rows[0]["list"]) == [1, 2]


def test_text_comes_out_as_it_came_in(tmp_path: Path) -> None:
    text = (
        f'name,{HEADER}\r\n"say ""so"",\nand more",{GOOD}\r\n007,{GOOD}\r\n5" pipe,{GOOD}\n,{GOOD}'
    )
    (tmp_path / "cases.csv").write_bytes(text.encode())
    for kind in ("csv", "parquet"):
        evaluate_files([tmp_path / "cases.csv"], tmp_path / f"o.{kind}", TABLE)
        written = read(tmp_path / f"o.{kind}")
        assert [row["name"] for row in written] == ['say "so",\nand more', "007", '5" pipe', ""]
    assert (
        (tmp_path / "o.csv")
        .read_bytes()
        .startswith(text.replace("\r", "").encode()[: len(HEADER) + 5])
    )


GERMAN = (
    "name;mu0;Fz;k [N/mm];y0 [µm];f "
    '[kHz];v0\n"a;b";0,3;10;1,5e3;0,2;20;0,005\nc;0.3;10;rigid;0,2;20;0,005\n'
)


@pytest.mark.parametrize("text", [GERMAN, "\ufeff" + GERMAN.replace("\n", "\r\n")])
def test_a_german_file_is_recognised_and_read_with_its_options(
    tmp_path: Path, capsys: Capture, text: str
) -> None:
    (tmp_path / "cases.csv").write_bytes(text.encode())
    out, words = tmp_path / "out.csv", [tmp_path / "cases.csv", "-o", tmp_path / "out.csv"]
    # two decimal signs in a file
    assert all(part in ran(capsys, 1, *words) for part in ("line 2", "line 3", "--decimal"))
    ran(capsys, 3, *words, "--decimal", ",")
    (row,) = read(out, ";")
    assert out.read_bytes().splitlines()[1].startswith(text.splitlines()[1].encode())
    assert "," in row["mu_macro"]
    assert 0.0 < float(row["mu_macro"].replace(",", ".")) < 0.3
    # 0.3 may be meant for 03
    assert rejects_of(out) == [(3, "mu0", "must be a number such as 0,5")]
    (tmp_path / "cases.csv").write_text(f"{HEADER}\n{GOOD}\n".replace(",", "\t"))
    ran(capsys, 0, *words, "--force")
    ran(capsys, 0, *words, "--sep", "tab", "--force")
    assert "line 1" in ran(capsys, 1, *words, "--sep", ";", "--force")


@pytest.mark.parametrize("kind", ["csv", "csv.gz", "parquet"])
def test_standard_input_output(
    tmp_path: Path, capfdbinary: Any, monkeypatch: pytest.MonkeyPatch, kind: Any
) -> None:
    bad = cases(50).set_column(0, "mu0", pa.array([-1.0] + [0.3] * 49))
    source, expected = write(bad, tmp_path / f"cases.{kind}"), tmp_path / "o.csv"
    rejects = evaluate_files([source], expected, TABLE).rejects
    assert rejects
    with source.open("rb") as stream:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(stream))
        monkeypatch.setattr(
            sys, "stdout", io.TextIOWrapper(written := io.BytesIO(), write_through=True)
        )
        assert main(["eval", "-", "-o", "-"]) == 3
        assert written.getvalue() == expected.read_bytes()
    assert rejects.read_bytes() + b"49 of 50 rows" in capfdbinary.readouterr().err


def with_k(cell: Any) -> Any:
    return GOOD.replace("1e6", cell)


@pytest.mark.parametrize("end", ["csv", "parquet"])
def test_bad_rows_of_csv_land_in_the_side_file_and_only_there(
    tmp_path: Path, capsys: Capture, end: Any
) -> None:
    rows = [
        GOOD,
        "-" + GOOD,
        "x" + GOOD,
        GOOD[:-4],
        GOOD[:-5],
        GOOD + ",7",
        with_k(""),
        with_k("Rigid"),
        "",
        with_k("inf"),
        with_k("nan"),
        with_k("1e400"),
        GOOD.replace("1.3e5", "inf"),
        GOOD,
    ]
    (tmp_path / "cases.csv").write_text("\n".join([HEADER, *rows]))
    out = tmp_path / f"out.{end}"
    assert "4 of 13 rows evaluated" in ran(capsys, 3, tmp_path / "cases.csv", "-o", out)
    assert [row["source"] for row in read(out)] == [
        "stick_slip_low",
        "rigid",
        "rigid",
        "stick_slip_low",
    ]
    if end == "parquet":
        assert [row["k"] for row in read(out)] == [1e6, math.inf, math.inf, 1e6]
    assert rejects_of(out) == [
        (3, "mu0", "must be finite and > 0"),
        (4, "mu0", "must be a number"),
        (5, "v0", "is missing"),
        (6, "", "has 5 cells, the header has 6"),
        (7, "", "has 7 cells, the header has 6: name every column, also that of the row numbers"),
        (8, "k", MISSING_K),
        (12, "k", MISSING_K),
        (13, "k", "is too large, above 1.8e308"),
        (14, "omega", "must be finite and >= 0"),
    ]


@pytest.mark.parametrize("name", ["cases.ndjson", "cases.jsonl.gz", "-"])
def test_json_is_no_table_and_is_told_what_to_write(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    (tmp_path / "cases.ndjson").write_text(json.dumps(CASE))
    (tmp_path / "cases.jsonl.gz").write_bytes(gzip.compress(json.dumps(CASE).encode()))
    source = name if name == "-" else tmp_path / name
    with (tmp_path / "cases.ndjson").open() as stream:
        monkeypatch.setattr(sys, "stdin", stream)
        assert "write CSV or Parquet" in ran(capsys, 1, source, "-o", tmp_path / "out.csv")
    assert not (tmp_path / "out.csv").exists()


@pytest.mark.parametrize("piece", [7, 50, 10_000])
def test_cells_with_line_ends_do_not_shift_the_numbers_of_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, piece: int
) -> None:
    monkeypatch.setattr(decoding, "PIECE", piece)  # rows that go on in the next block
    rows = [
        f'"a\nb",{GOOD}',
        f"c,{GOOD}",
        f'"d\n\n",{GOOD},1',
        f"e,-{GOOD}",
        f'"f\r\ng",{GOOD}',
    ] * 3
    (tmp_path / "cases.csv").write_text(f"name,{HEADER}\n" + "\n".join(rows) + "\n", newline="")
    evaluate_files([tmp_path / "cases.csv"], tmp_path / "out.csv", TABLE)
    assert [row["name"] for row in read(tmp_path / "out.csv")] == ["a\nb", "c", "f\ng"] * 3
    # the lines in which the rows begin
    assert [line for line, *_ in rejects_of(tmp_path / "out.csv")] == [5, 8, 14, 17, 23, 26]


def test_damaged_and_missing_files_are_reported_in_one_line(
    tmp_path: Path, capsys: Capture
) -> None:
    good = write(cases(2000), tmp_path / "good.parquet")
    (tmp_path / "text.parquet").write_text("no parquet")
    (tmp_path / "cut.csv.gz").write_bytes(
        write(cases(5000), tmp_path / "whole.csv.gz").read_bytes()[:50_000]
    )
    (tmp_path / "mixed.csv").write_bytes(f"{HEADER},name\n{GOOD},µ\n".encode() + b"\xb5")
    flipped = bytearray(good.read_bytes())
    flipped[2000:60_000:97] = bytes(byte ^ 255 for byte in flipped[2000:60_000:97])
    (tmp_path / "flipped.parquet").write_bytes(flipped)
    for name, out, words in (
        ("none.csv", "o.csv", "no such file"),
        ("*.none", "o.csv", "no such file"),
        ("text.parquet", "o.csv", "Is this a 'parquet' file?"),
        ("cut.csv.gz", "o.csv", "is damaged"),
        ("mixed.csv", "o.parquet", "line 3 is not UTF-8: save the file as UTF-8"),
        ("flipped.parquet", "o.csv", ""),
        ("good.parquet", "o.xlsx", "ends in"),
        ("good.parquet", "none/o.csv", "No such file or directory"),
        ("good.parquet", ".", "must be the name of a file"),
    ):
        assert words in ran(capsys, 1, tmp_path / name, "-o", tmp_path / out, "--force")
    assert "several formats" in ran(
        capsys, 1, good, tmp_path / "mixed.csv", "-o", tmp_path / "o.csv"
    )


@pytest.mark.parametrize("end", ["csv", "parquet"])
@pytest.mark.parametrize("bad", [1, 2, 5])
def test_a_file_that_is_windows_1252_from_some_line_on_is_read(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch, bad: int, end: str
) -> None:
    monkeypatch.setattr(decoding, "PIECE", 50)  # several blocks
    rows = [f"{GOOD},{'µ' if i == bad else 'u'}" for i in range(1, bad + 2)]
    text = "\n".join([f"{HEADER},name", *rows])
    out = tmp_path / f"out.{end}"
    (tmp_path / "german.csv").write_bytes(text.encode("cp1252"))
    ran(capsys, 0, tmp_path / "german.csv", "-o", out)
    assert [row["name"] for row in read(out)] == [row[-1] for row in rows]
    (tmp_path / "german.csv").write_bytes(text.replace("u", "µ").encode() + b"\n\xb5")
    message = ran(capsys, 1, tmp_path / "german.csv", "-o", out, "--force")
    assert f"line {bad + 3}" in message
    assert "give its encoding" in message


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_a_file_without_rows_gives_a_file_without_rows(tmp_path: Path, kind: Any) -> None:
    source = tmp_path / f"cases.{kind}"
    source.write_text(HEADER) if kind == "csv" else write(cases(0), source)
    assert evaluate_files([source], tmp_path / f"out.{kind}", TABLE).rows == 0
    assert read(tmp_path / f"out.{kind}") == []


def test_folders_patterns_and_hive_names(tmp_path: Path) -> None:
    for year in (2023, 2024):
        (tmp_path / "runs" / f"year={year}").mkdir(parents=True)
        for name in "ba":
            write(
                cases(10, year + ord(name)), tmp_path / "runs" / f"year={year}" / f"{name}.parquet"
            )
    (tmp_path / "runs" / "notes.txt").write_text("no cases")
    evaluate_files([tmp_path / "runs"], tmp_path / "out.parquet", TABLE)
    written = pq.read_table(tmp_path / "out.parquet")
    assert written.column("year").to_pylist() == [2023] * 20 + [2024] * 20
    pattern = str(tmp_path / "runs" / "*" / "a.parquet")
    assert evaluate_files([pattern], tmp_path / "a.csv", TABLE).rows == 20
    mixed = cases(10).set_column(0, "mu0", pa.array([1] * 10, pa.int32()))
    pq.write_table(mixed, tmp_path / "ints.parquet")
    files = [tmp_path / "ints.parquet", tmp_path / "runs" / "year=2023" / "a.parquet"]
    evaluate_files(files, tmp_path / "both.parquet", TABLE)
    assert read(tmp_path / "both.parquet")[0]["mu0"] == 1.0
    texts = [write(cases(5, i), tmp_path / f"{i}.csv") for i in (1, 2)]
    texts[1].write_text(texts[1].read_text() + "1,2\n")
    summary = evaluate_files(texts, tmp_path / "both.csv", TABLE)
    assert (summary.answered, summary.rejected) == (10, 1)
    (reject,) = read(summary.rejects)
    assert (reject["file"], reject["line"]) == (str(texts[1]), "7")


ALIKE = {name: value for name, value in CASE.items() if name not in ("k", "y0", "omega")}
ANSWERED: dict[str, tuple[Case, Case]] = {
    "ball": ({"contact": "ball"}, {"k": 1e6, "y0": 2e-6}),
    "along": ({"direction": "along"}, {"k": 1e6, "y0": 2e-6}),
    "normal": ({"direction": "normal"}, {"k": 1e6, "Fz_amplitude": 1.0}),
    "range": ({}, {"k_low": 0.8e6, "k_high": 1.2e6, "y0": 2e-6}),
    "range of a ball": ({"contact": "ball"}, {"k_low": 0.8e6, "k_high": 1.2e6, "y0": 2e-6}),
}


@pytest.mark.parametrize("end", ["csv", "parquet"])
@pytest.mark.parametrize("start", ["csv", "parquet"])
@pytest.mark.parametrize("name", ANSWERED)
def test_files_know_contact_and_ends_of_k(
    tmp_path: Path, capsys: Capture, start: Any, end: Any, name: str
) -> None:
    kind, more = ANSWERED[name]
    rng = np.random.default_rng(3)
    inputs = {
        field: value * rng.uniform(0.9, 1.1, 40)
        for field, value in {**ALIKE, **more, "omega": 1.3e5}.items()
    }
    source, out = write(pa.table(inputs), tmp_path / f"cases.{start}"), tmp_path / f"out.{end}"
    options = [f"--{key}={value}" for key, value in kind.items()]
    ran(capsys, 0, source, "-o", out, *options, "--include", "gradient")
    written = read(out)
    expected = TABLE.evaluate(inputs, gradient=True, **kind)
    names = [
        "mu_macro",
        *(["mu_macro_low", "mu_macro_high"] if "k_low" in inputs else []),
        *ANSWERS[1:],
    ]
    slopes = [
        f"{name}.{field}" for name in ("gradient", "gradient_bound") for field in expected.gradient
    ]
    assert list(written[0]) == [*inputs, *names, *slopes]
    for column in names:
        read_back = [
            row[column] if column in ("regime", "source") else float(row[column]) for row in written
        ]
        assert read_back == getattr(expected, column).tolist()
    for field, slope in expected.gradient.items():
        assert [float(row[f"gradient.{field}"]) for row in written] == slope.tolist()


def said(inputs: Any, head: str, key: str, unit: str) -> Any:
    """The same table, whose field of v0 has another header and says a unit."""
    fields = [
        field.with_name(head).with_metadata({key: unit}) if field.name == "v0" else field
        for field in inputs.schema
    ]
    return pa.table(inputs.columns, schema=pa.schema(fields))


@pytest.mark.parametrize("key", ["unit", "units", "Unit"])
def test_the_unit_of_a_field_of_parquet_is_that_of_its_column(
    tmp_path: Path, capsys: Capture, key: str
) -> None:
    inputs = cases(20)
    in_mm = inputs.set_column(5, "v0", pa.array(inputs["v0"].to_numpy() * 1e3))
    right = TABLE.evaluate(inputs)["mu_macro"].to_numpy()
    for head in ("v0", "v0 [mm/s]"):
        source = write(said(in_mm, head, key, "mm s-1"), tmp_path / "said.parquet")
        evaluate_files([source], tmp_path / "out.parquet", TABLE, force=True)
        written = pq.read_table(tmp_path / "out.parquet")
        np.testing.assert_allclose(written["mu_macro"].to_numpy(), right, rtol=1e-12)
        assert written[head].to_pylist() == in_mm["v0"].to_pylist()
    fast = inputs.set_column(5, "v0", pa.array([1e6] * 20))
    source = write(said(fast, "v0", key, "mm/s"), tmp_path / "fast.parquet")
    remarks = evaluate_files([source], tmp_path / "out.parquet", TABLE, force=True).remarks
    assert "v0 = 1000000 mm/s" in remarks[0]["text"]
    other = write(said(inputs, "v0", key, "m/s"), tmp_path / "other.parquet")
    bad = write(said(inputs, "v0 [mm/s]", key, "m/s"), tmp_path / "bad.parquet")
    mass = write(said(inputs, "v0", key, "kg"), tmp_path / "mass.parquet")
    source = write(said(in_mm, "v0", key, "mm/s"), tmp_path / "said.parquet")
    for files, words in (
        ([bad], "has another unit in its field: m/s"),
        ([mass], "'v0 [kg]' has a unit that v0 cannot have"),
        ([source, other], "other units than those of"),
    ):
        message = ran(capsys, 1, *files, "-o", tmp_path / "no.csv")
        assert words in message

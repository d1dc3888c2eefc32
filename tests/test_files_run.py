"""``mumacro eval``: input and output formats, rejects, resuming after a stop, and every known cause of lost rows."""

import csv
import gzip
import json
import math
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress

import numpy as np
import pytest

pytestmark = pytest.mark.slow

pa = pytest.importorskip("pyarrow", reason="the extra files is not installed")
import pyarrow.csv  # noqa: E402
import pyarrow.parquet as pq  # noqa: E402

from mumacro import Surrogate  # noqa: E402
from mumacro.__main__ import main  # noqa: E402
from mumacro.files import ANSWERS, evaluate_files, run  # noqa: E402

NAMES = ("mu0", "Fz", "k", "y0", "omega", "v0")
GOOD = "0.3,10,1e6,2e-6,1.3e5,0.01"
CASE = dict(zip(NAMES, map(float, GOOD.split(",")), strict=True))
HEADER = ",".join(NAMES)


@pytest.fixture(scope="module")
def table():
    return Surrogate.open()


def cases(n, seed=1):
    rng = np.random.default_rng(seed)
    low, high = np.array([-2, -1, 4, -8, 2, -5]), np.array([0, 3, 8, -4, 6, 1])
    return pa.table(dict(zip(NAMES, (10.0 ** rng.uniform(low, high, (n, 6))).T, strict=True)))


def write(cases, path):
    """Cases in the format of the name."""
    name = path.name.removesuffix(".gz")
    opened = gzip.open if path.suffix == ".gz" else open
    if name.endswith(".parquet"):
        pq.write_table(cases, path, row_group_size=1000)
    elif name.endswith(".csv"):
        with opened(path, "wb") as stream:
            pyarrow.csv.write_csv(cases, stream)
    else:
        with opened(path, "wb") as stream:
            stream.writelines(json.dumps(row).encode() + b"\n" for row in cases.to_pylist())
    return path


def read(path):
    """Rows of an output as dicts of Python values; cells of CSV as text."""
    name = path.name.removesuffix(".gz")
    if name.endswith(".parquet"):
        return pq.read_table(path).to_pylist()
    with (gzip.open if path.suffix == ".gz" else open)(path, "rt", encoding="utf-8", newline="") as stream:
        if name.endswith(".csv"):
            return list(csv.DictReader(stream))
        return [json.loads(line, parse_constant=pytest.fail) for line in stream]


def rejects_of(path):
    return [
        (int(row["row"]), row["field"], row["value"], row["reason"])
        for row in read(path.with_name(path.name + ".rejects.csv"))
    ]


def ran(capsys, code, *words):
    """The output of ``mumacro eval WORDS``; one line if it fails."""
    assert main(["eval", *map(str, words)]) == code
    said = capsys.readouterr()
    assert "Traceback" not in said.err
    if code in (1, 2):
        assert len(said.err.splitlines()) == 1
        return said.err
    return said.out


def left(folder):
    return sorted(path.name for path in folder.iterdir())


# --- formats ------------------------------------------------------------------------------------------

KINDS = ("csv", "csv.gz", "ndjson", "jsonl.gz", "parquet")


@pytest.mark.parametrize("start", KINDS)
@pytest.mark.parametrize("end", KINDS)
def test_every_format_goes_into_every_other_with_the_same_bits_in_order(tmp_path, table, start, end):
    given = cases(1500)
    source, out = write(given, tmp_path / f"cases.{start}"), tmp_path / f"out.{end}"
    summary = evaluate_files([source], out, table, part_rows=400)
    assert (summary.rows, summary.answered, summary.rejects) == (1500, 1500, None)
    found = read(out)
    assert left(tmp_path) == sorted([source.name, out.name])
    columns = {name: given.column(name).to_numpy() for name in NAMES}
    expected = table.evaluate(**columns)
    assert list(found[0]) == [*NAMES, *ANSWERS]
    for name in (*NAMES, "mu_macro", "mu_ratio", "error_bound"):
        wanted = columns[name] if name in NAMES else getattr(expected, name)
        assert [float(row[name]) for row in found] == wanted.tolist()
    assert [row["source"] for row in found] == expected.source.tolist()
    assert [row["regime"] for row in found] == expected.regime.tolist()


def test_columns_of_parquet_keep_their_types(tmp_path, table):
    n = 300
    given = cases(n)
    for name, values in {
        "i32": pa.array(range(n), pa.int32()), "f32": pa.array([0.1] * n, pa.float32()),
        "ns": pa.array([10**18 + i for i in range(n)], pa.timestamp("ns", "UTC")),
        "day": pa.array([1] * n, pa.date32()), "words": pa.array(["a", "b", None] * 100).dictionary_encode(),
        "money": pa.array([1] * n, pa.decimal128(9, 2)), "text": pa.array(["µ,\n"] * n),
        "list": pa.array([[1, 2]] * n), "flag": pa.array([True, None] * (n // 2)),
    }.items():  # fmt: skip
        given = given.append_column(name, values)
    source = write(given, tmp_path / "cases.parquet")
    evaluate_files([source], tmp_path / "out.parquet", table, part_rows=100)
    found = pq.read_table(tmp_path / "out.parquet")
    before = pq.read_table(source)
    assert found.select(before.schema.names).schema == before.schema
    assert found.select(before.schema.names).equals(before)
    assert pa.types.is_dictionary(found.schema.field("regime").type)
    assert pa.types.is_dictionary(found.schema.field("source").type)
    evaluate_files([source], tmp_path / "out.ndjson", table)  # and as text: valid JSON
    first = read(tmp_path / "out.ndjson")[0]
    assert (first["text"], first["list"], first["money"], first["flag"]) == ("µ,\n", [1, 2], 1.0, True)
    evaluate_files([source], tmp_path / "out.csv", table)
    assert read(tmp_path / "out.csv")[2]["text"] == "µ,\n"


def test_text_columns_are_unchanged(tmp_path, table):
    lines = ['{"mu0":0.30,"Fz":10,"k":1000000,"y0":2e-6,"omega":130000,"v0":1E-2,"id":12345678901234567890, "b":[1] }',
             '{"v0":0.01,"mu0":0.3,"Fz":10,"k":"rigid","y0":2e-6,"omega":130000,"note":"\\u00b5 NaN"}']  # fmt: skip
    (tmp_path / "cases.ndjson").write_text("\n".join(lines))
    evaluate_files([tmp_path / "cases.ndjson"], tmp_path / "out.ndjson", table)
    for line, given in zip((tmp_path / "out.ndjson").read_text().splitlines(), lines, strict=True):
        assert line.startswith(given.rstrip("} "))
        json.loads(line)
    text = f'name,{HEADER}\r\n"say ""so"",\nand more",{GOOD}\r\n007,{GOOD}\r\n,{GOOD}'
    (tmp_path / "cases.csv").write_bytes(text.encode())
    evaluate_files([tmp_path / "cases.csv"], tmp_path / "out.csv", table)
    assert [row["name"] for row in read(tmp_path / "out.csv")] == ['say "so",\nand more', "007", ""]


def test_types_of_csv_are_those_of_the_whole_file(tmp_path, table):
    rows = [f"{i if i < 4000 else i + 0.5},{'x' if i == 4999 else i},2024-01-0{i % 9 + 1},{GOOD}" for i in range(5000)]
    (tmp_path / "cases.csv").write_text(f"number,word,day,{HEADER}\n" + "\n".join(rows))
    evaluate_files([tmp_path / "cases.csv"], tmp_path / "out.parquet", table, part_rows=500)
    schema = pq.read_schema(tmp_path / "out.parquet")
    assert [schema.field(n).type for n in ("number", "word", "day", "k")] == [
        pa.float64(), pa.string(), pa.date32(), pa.float64()
    ]  # fmt: skip
    found = pq.read_table(tmp_path / "out.parquet")
    assert found.column("word")[0].as_py() == "0"
    assert found.column("number")[4999].as_py() == 4999.5


def test_folders_patterns_and_hive_names(tmp_path, table):
    for year in (2023, 2024):
        folder = tmp_path / "runs" / f"year={year}"
        folder.mkdir(parents=True)
        write(cases(10, year), folder / "b.parquet")
        write(cases(10, year + 10), folder / "a.parquet")
    (tmp_path / "runs" / "notes.txt").write_text("no cases")
    evaluate_files([tmp_path / "runs"], tmp_path / "out.parquet", table)
    found = pq.read_table(tmp_path / "out.parquet")
    assert found.column("year").to_pylist() == [2023] * 20 + [2024] * 20
    pattern = str(tmp_path / "runs" / "*" / "a.parquet")
    summary = evaluate_files([pattern], f"{tmp_path}/answers/", table, part_rows=5)
    assert summary.rows == 20
    parts = sorted((tmp_path / "answers").iterdir())
    assert len(parts) > 1
    assert [row["mu0"] for part in parts for row in read(part)] == [
        float(m) for y in (2023, 2024) for m in cases(10, y + 10).column("mu0").to_pylist()
    ]
    csvs = [write(cases(5, i), tmp_path / f"{i}.csv") for i in (1, 2)]
    csvs[1].write_text(csvs[1].read_text() + "1,2\n")
    assert (
        evaluate_files(csvs, tmp_path / "both", table, force=True).rejected == 1
        if (tmp_path / "both").is_dir()
        else True
    )
    summary = evaluate_files(csvs, tmp_path / "both.csv", table)
    assert (summary.answered, summary.rejected) == (10, 1)
    (reject,) = read(summary.rejects)
    assert (reject["file"], reject["row"]) == (str(csvs[1]), "6")


# --- rejects ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("end", ["csv", "parquet"])
def test_bad_rows_of_csv_land_in_the_side_file_and_only_there(tmp_path, capsys, end):
    good = GOOD.split(",")
    rows = [GOOD, ",".join(["-0.3", *good[1:]]), ",".join(["x", *good[1:]]), ",".join([*good[:5], ""]),
            ",".join(good[:5]), GOOD + ",7", ",".join([*good[:2], "", *good[3:]]),
            ",".join([*good[:2], "rigid", *good[3:]]), "", ",".join([*good[:4], "inf", good[5]]), GOOD]  # fmt: skip
    (tmp_path / "cases.csv").write_text("\n".join([HEADER, *rows]))
    out = tmp_path / f"out.{end}"
    assert "3 of 10 rows evaluated" in ran(capsys, 3, tmp_path / "cases.csv", "-o", out)
    found = read(out)
    assert [row["source"] for row in found] == ["stick_slip_low", "rigid", "stick_slip_low"]
    if end == "parquet":
        assert [row["k"] for row in found] == [1e6, math.inf, 1e6]
    assert rejects_of(out) == [
        (2, "mu0", "-0.3", "must be finite and > 0"), (3, "mu0", "x", "must be a number"), (4, "v0", "", "is missing"),
        (5, "", ",".join(good[:5]), "has 5 cells, the header has 6"),
        (6, "", GOOD + ",7", "has 7 cells, the header has 6"), (7, "k", "", "is missing; write rigid or a number"),
        (9, "omega", "inf", "must be finite and >= 0"),
    ]  # fmt: skip
    assert "row 2: mu0 must be finite and > 0, got '-0.3'" in ran(
        capsys, 1, tmp_path / "cases.csv", "-o", tmp_path / "stop.csv", "--on-error", "stop"
    )
    assert not (tmp_path / "stop.csv").exists()


def test_cells_with_line_ends_do_not_shift_the_numbers_of_rows(tmp_path, table):
    rows = [f'"a\nb",{GOOD}', f"c,{GOOD}", f'"d\n\n",{GOOD},1', f"e,{GOOD.replace('0.3', '-1')}", f'"f\ng",{GOOD}']
    (tmp_path / "cases.csv").write_text(f"name,{HEADER}\n" + "\n".join(rows) + "\n")
    evaluate_files([tmp_path / "cases.csv"], tmp_path / "out.csv", table)
    assert [row["name"] for row in read(tmp_path / "out.csv")] == ["a\nb", "c", "f\ng"]
    assert [(row, field) for row, field, _, _ in rejects_of(tmp_path / "out.csv")] == [(3, ""), (4, "mu0")]


@pytest.mark.parametrize("end", ["ndjson", "parquet"])
def test_bad_lines_of_ndjson_land_in_the_side_file(tmp_path, capsys, table, end):
    lines = [
        json.dumps({**CASE, "tag": "a"}), "", json.dumps({**CASE, "k": None}), "[1]", "{",
        json.dumps({**CASE, "v0": "1"}), json.dumps({**CASE, "v0": True}), json.dumps({**CASE, "Fz": 10**400}),
        json.dumps({**CASE, "k": 10**400}), '{"mu0": 0.3}', json.dumps({**CASE, "k": "rigid"}),
        json.dumps({n: v for n, v in CASE.items() if n != "k"}), json.dumps({**CASE, "v0": None}),
        '{"mu0": 0.3, "mu0": 0.4}', json.dumps({**CASE, "v0": math.nan}), json.dumps(CASE),
        json.dumps(CASE) + json.dumps(CASE),
    ]  # fmt: skip
    (tmp_path / "cases.ndjson").write_text("\n".join(lines))
    out = tmp_path / f"out.{end}"
    ran(capsys, 3, tmp_path / "cases.ndjson", "-o", out)
    found = read(out)
    assert [row.get("tag") for row in found] == ["a", None, None]
    assert [row["source"] for row in found] == ["stick_slip_low", "rigid", "stick_slip_low"]
    assert found[0]["mu_macro"] == table.evaluate(**CASE).mu_macro
    reasons = {row: (field, reason) for row, field, _, reason in rejects_of(out)}
    assert reasons.keys() == {2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13, 14, 16}
    assert reasons[2] == ("k", "is missing; write rigid or a number")
    assert reasons[3] == ("", "is no JSON object")
    assert reasons[5] == reasons[6] == ("v0", "must be a number")
    assert reasons[7] == ("Fz", "must be finite")
    assert reasons[8] == ("k", "must be finite")
    assert reasons[11] == ("k", "is missing; write rigid or a number")
    assert reasons[12] == ("v0", "is missing")
    assert reasons[13] == ("", "repeats the key 'mu0'")
    assert reasons[14][0] == "v0"
    assert "no JSON" in reasons[16][1]


def test_a_forgotten_k_in_one_line_is_not_rigid(tmp_path, table):
    lines = [json.dumps(CASE)] * 3 + [json.dumps({n: v for n, v in CASE.items() if n != "k"})]
    (tmp_path / "cases.ndjson").write_text("\n".join(lines))
    assert evaluate_files([tmp_path / "cases.ndjson"], tmp_path / "out.ndjson", table).rejected == 1
    assert rejects_of(tmp_path / "out.ndjson")[0][:2] == (4, "k")


# --- known faults -------------------------------------------------------------------------------------


@pytest.mark.parametrize("end", ["csv", "parquet"])
@pytest.mark.parametrize("rows_before", [1, 40_000])
def test_a_quote_that_is_never_closed_near_the_end_names_its_line(tmp_path, capsys, end, rows_before):
    text = f"name,{HEADER}\n" + f"a,{GOOD}\n" * rows_before + f'"b,{GOOD}\n' + f"c,{GOOD}\n" * 50
    (tmp_path / "cases.csv").write_text(text)
    message = ran(capsys, 1, tmp_path / "cases.csv", "-o", tmp_path / f"out.{end}")
    assert f"line {rows_before + 2}: a quote opens here and is never closed" in message
    assert not (tmp_path / f"out.{end}").exists()


def test_a_quote_that_is_closed_by_another_names_its_line(tmp_path, capsys):
    (tmp_path / "cases.csv").write_text(f'name,{HEADER}\n"a,{GOOD}\n"b",{GOOD}\nc,{GOOD}\n')
    assert "line 3: text follows a closing quote" in ran(capsys, 1, tmp_path / "cases.csv", "-o", tmp_path / "out.csv")


def test_a_quote_inside_a_cell_is_part_of_it(tmp_path, table):
    (tmp_path / "cases.csv").write_text(f'name,{HEADER}\n5" pipe,{GOOD}\nb,{GOOD}\n')
    evaluate_files([tmp_path / "cases.csv"], tmp_path / "out.csv", table)
    assert [row["name"] for row in read(tmp_path / "out.csv")] == ['5" pipe', "b"]


@pytest.mark.parametrize("start", ["ndjson", "parquet"])
@pytest.mark.parametrize("end", ["ndjson", "csv"])
def test_nan_is_written_as_an_empty_cell_or_null(tmp_path, table, start, end):
    source = tmp_path / f"cases.{start}"
    if start == "ndjson":
        source.write_text(json.dumps({**CASE, "x": math.nan, "y": [math.inf]}))
    else:
        pq.write_table(pa.table({**{n: [v] for n, v in CASE.items()}, "x": [math.nan], "y": [-math.inf]}), source)
    evaluate_files([source], tmp_path / f"out.{end}", table)
    (row,) = read(tmp_path / f"out.{end}")
    assert row["x"] == (None if end == "ndjson" else "")


def test_mixed_types_are_reported_in_one_line(tmp_path, capsys):
    lines = [json.dumps({**CASE, "x": 1}), json.dumps({**CASE, "x": "a"})]
    (tmp_path / "cases.ndjson").write_text("\n".join(lines))
    message = ran(capsys, 1, tmp_path / "cases.ndjson", "-o", tmp_path / "out.parquet")
    assert "cases.ndjson" in message
    assert "mixed types" in message
    assert "Field x" in message
    ran(capsys, 0, tmp_path / "cases.ndjson", "-o", tmp_path / "out.ndjson", "--force")  # text needs no types
    assert [row["x"] for row in read(tmp_path / "out.ndjson")] == [1, "a"]


@pytest.mark.parametrize("part_rows", [100, 500])
@pytest.mark.parametrize("stop", range(5))
@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_a_run_that_is_stopped_between_naming_the_output_and_clearing_up_ends_well(
    tmp_path, table, monkeypatch, kind, stop, part_rows
):
    """Files are deleted one after the other; after any of these steps the same command resumes."""
    source, out = write(cases(500), tmp_path / f"cases.{kind}"), tmp_path / f"out.{kind}"
    removed = []

    def unlink(path, missing_ok=False):
        if out.exists():
            removed.append(path)
            if len(removed) > stop:
                raise KeyboardInterrupt
        os.unlink(path) if path.exists() or not missing_ok else None

    with monkeypatch.context() as patch:
        patch.setattr(run.Path, "unlink", unlink)
        with suppress(KeyboardInterrupt):
            evaluate_files([source], out, table, part_rows=part_rows)
    if len(removed) <= stop:
        return  # one part only: complete before the stop
    before = out.read_bytes()
    assert evaluate_files([source], out, table, part_rows=part_rows).rows == 500
    assert out.read_bytes() == before
    assert left(tmp_path) == [source.name, out.name]


@pytest.mark.parametrize("left_over", [[], [".plan.json.abc.growing"]])
def test_a_run_that_is_killed_before_its_list_is_written_resumes(tmp_path, table, left_over):
    source = write(cases(10), tmp_path / "cases.csv")
    (tmp_path / "out.csv.parts").mkdir()
    for name in left_over:
        (tmp_path / "out.csv.parts" / name).touch()
    assert evaluate_files([source], tmp_path / "out.csv", table).rows == 10
    assert left(tmp_path) == ["cases.csv", "out.csv"]


def test_a_second_run_to_one_output_is_refused(tmp_path, capsys, table):
    source = write(cases(3000), tmp_path / "cases.csv")
    said = []

    def other(*_):
        if not said:
            said.append(ran(capsys, 1, source, "-o", tmp_path / "out.csv", "--force"))

    assert evaluate_files([source], tmp_path / "out.csv", table, progress=other).rows == 3000
    assert "out.csv.parts: another process is at work here; wait for it, or stop it" in said[0]
    assert left(tmp_path) == ["cases.csv", "out.csv"]


def test_a_folder_of_parts_of_another_run_is_unchanged(tmp_path, capsys):
    source = write(cases(10), tmp_path / "cases.csv")
    (tmp_path / "out.csv.parts").mkdir()
    (tmp_path / "out.csv.parts" / "precious.txt").write_text("mine")
    assert "--force deletes them" in ran(capsys, 1, source, "-o", tmp_path / "out.csv")
    assert (tmp_path / "out.csv.parts" / "precious.txt").read_text() == "mine"


# --- resuming ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["csv", "csv.gz", "ndjson", "parquet"])
@pytest.mark.parametrize("stop_after", [1, 2, 3])
def test_a_stopped_run_goes_on_with_the_same_bytes(tmp_path, table, kind, stop_after):
    given = cases(6000)
    given = given.set_column(
        0, "mu0", pa.array([-1.0 if i % 1999 == 0 else v for i, v in enumerate(given["mu0"].to_pylist())])
    )
    source = write(given, tmp_path / f"cases.{kind}")
    options = {"part_rows": 1500}
    evaluate_files([source], tmp_path / f"whole.{kind}", table, **options)

    def stop(_share, rows, _rejected):
        if rows > 1500 * stop_after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        evaluate_files([source], tmp_path / f"out.{kind}", table, progress=stop, **options)
    assert not (tmp_path / f"out.{kind}").exists()
    summary = evaluate_files([source], tmp_path / f"out.{kind}", table, **options)
    assert 0 < summary.resumed < 6000 or stop_after == 1
    assert (tmp_path / f"out.{kind}").read_bytes() == (tmp_path / f"whole.{kind}").read_bytes()
    for side in ("out", "whole"):
        assert [row for row, *_ in rejects_of(tmp_path / f"{side}.{kind}")] == [1, 2000, 3999, 5998]
    assert len(left(tmp_path)) == 5


@pytest.mark.parametrize("kind", ["parquet", "csv"])
def test_a_killed_run_goes_on_with_the_same_bytes(tmp_path, repository, kind):
    source = write(cases(400_000), tmp_path / f"cases.{kind}")
    words = ["eval", str(source), "--part-rows", "20000", "-o"]
    command = [sys.executable, "-m", "mumacro", *words, str(tmp_path / f"out.{kind}")]
    rng = np.random.default_rng(3)
    kills = 0
    for _ in range(3):
        process = subprocess.Popen(command, cwd=repository, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        parts = tmp_path / f"out.{kind}.parts"
        had = len(list(parts.glob("*.json"))) if parts.exists() else 0
        while process.poll() is None and (not parts.exists() or len(list(parts.glob("*.json"))) <= had + 1):
            time.sleep(0.005)
        time.sleep(float(rng.uniform(0.0, 0.05)))
        if process.poll() is None:
            os.kill(process.pid, signal.SIGKILL)
            kills += 1
        process.wait(timeout=60)
    assert kills
    assert main(words[:1] + words[1:] + [str(tmp_path / f"out.{kind}")]) == 0
    assert main([*words, str(tmp_path / f"whole.{kind}")]) == 0
    assert (tmp_path / f"out.{kind}").read_bytes() == (tmp_path / f"whole.{kind}").read_bytes()
    assert left(tmp_path) == sorted([f"cases.{kind}", f"out.{kind}", f"whole.{kind}"])


def test_parts_of_another_run_and_outputs_that_exist_are_kept_unless_forced(tmp_path, capsys, table):
    source = write(cases(50), tmp_path / "cases.csv")
    out = tmp_path / "out.csv"
    out.write_text("precious")
    assert "exists already; --force" in ran(capsys, 1, source, "-o", out)
    assert out.read_text() == "precious"

    def stop(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        evaluate_files([source], out, table, force=True, progress=stop)
    write(cases(60), source)
    assert "parts of another run" in ran(capsys, 1, source, "-o", out)
    assert "60 of 60 rows" in ran(capsys, 0, source, "-o", out, "--force")
    assert left(tmp_path) == ["cases.csv", "out.csv"]


@pytest.mark.skipif(os.name == "nt", reason="no limit of file sizes")
@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_a_full_disk_is_reported_in_one_line_and_the_run_resumes_later(tmp_path, table, repository, kind):
    source = write(cases(20_000), tmp_path / f"cases.{kind}")
    out = tmp_path / f"out.{kind}"
    program = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000)); "
        "from mumacro.__main__ import main; "
        f"sys.exit(main(['eval', {str(source)!r}, '-o', {str(out)!r}, '--part-rows', '15000']))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=repository, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 1, done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert "File too large" in done.stderr
    assert not out.exists()
    assert not list(tmp_path.rglob("*.growing"))
    evaluate_files([source], out, table, part_rows=15_000)
    evaluate_files([source], tmp_path / f"whole.{kind}", table, part_rows=15_000)
    assert out.read_bytes() == (tmp_path / f"whole.{kind}").read_bytes()


# --- wrong arguments and files ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "parts"),
    [
        ("", ["is empty"]), ("a;b;c\n1;2;3\n", ["separated by commas"]), ("a,b\n1,2\n", ["no column mu0 [-]"]),
        ("mu0,Fz,y0,omega,v0\n", ["no column k", "--rigid"]), ("mu0,Fz,K,y0,omega,v0\n", ["'K' is similar"]),
        ("mu0,Fz,k,y0,omega,v0,v0 [m/s]\n", ["v0 is there twice"]), (f"{HEADER},source\n", ["would be written twice"]),
        ('"mu0,Fz\n', ["line 1 is no header"]),
    ],
)  # fmt: skip
def test_a_file_that_holds_no_cases_is_refused_by_name(tmp_path, capsys, content, parts):
    (tmp_path / "cases.csv").write_text(content)
    message = ran(capsys, 1, tmp_path / "cases.csv", "-o", tmp_path / "out.csv")
    assert str(tmp_path / "cases.csv") in message
    for part in parts:
        assert part in message
    assert left(tmp_path) == ["cases.csv"]


def test_damaged_and_missing_files_are_reported_in_one_line(tmp_path, capsys):
    good = write(cases(5000), tmp_path / "good.parquet")
    (tmp_path / "text.parquet").write_text("no parquet")
    (tmp_path / "cut.csv.gz").write_bytes(write(cases(5000), tmp_path / "whole.csv.gz").read_bytes()[:50_000])
    (tmp_path / "latin.csv").write_bytes(f"{HEADER},name\n{GOOD},µ\n".encode("latin-1"))
    flipped = bytearray(good.read_bytes())
    for i in range(2000, 60_000, 97):
        flipped[i] ^= 255
    (tmp_path / "flipped.parquet").write_bytes(flipped)
    for name, out, said in (
        ("none.csv", "o.csv", "no such file"), ("*.none", "o.csv", "there is no file"),
        ("text.parquet", "o.csv", "not a readable"), ("cut.csv.gz", "o.csv", "is damaged"),
        ("latin.csv", "o.parquet", "row 1 is not in UTF-8"), ("flipped.parquet", "o.csv", ""),
        ("good.parquet", "o.xlsx", "must end in"), ("good.parquet", "none/o.csv", "no such folder"),
        ("good.parquet", "good.parquet", "is an input"),
    ):  # fmt: skip
        message = ran(capsys, 1, tmp_path / name, "-o", tmp_path / out, "--force")
        assert said in message
    assert "several formats" in ran(capsys, 1, good, tmp_path / "latin.csv", "-o", tmp_path / "o.csv")
    assert "--part-rows" in ran(capsys, 2, good, "-o", tmp_path / "o.csv", "--part-rows", "0")


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_without_rows_gives_a_file_without_rows(tmp_path, table, kind):
    source = write(cases(1).slice(0, 0), tmp_path / f"cases.{kind}")
    if "json" in kind:
        pytest.skip("a text of no lines names no columns")
    summary = evaluate_files([source], tmp_path / f"out.{kind}", table)
    assert summary.rows == 0
    assert read(tmp_path / f"out.{kind}") == []


def test_misnamed_keys_of_ndjson_are_refused(tmp_path, capsys):
    (tmp_path / "cases.ndjson").write_text(json.dumps({"K" if n == "k" else n: v for n, v in CASE.items()}))
    assert "'K' is similar" in ran(capsys, 1, tmp_path / "cases.ndjson", "-o", tmp_path / "out.ndjson")


def test_memory_does_not_grow_with_the_file(tmp_path, repository):
    def peak(n):
        source = write(cases(n), tmp_path / f"{n}.parquet")
        program = (
            "import resource, sys; from mumacro.__main__ import main; "
            f"code = main(['eval', {str(source)!r}, '-o', {str(tmp_path / 'out.parquet')!r}, '--force']); "
            "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024); sys.exit(code)"
        )
        done = subprocess.run(
            [sys.executable, "-c", program], cwd=repository, capture_output=True, text=True, timeout=300, check=True
        )
        return int(done.stdout.split()[-1])

    # 1.2 million more rows are 130 MB of numbers
    assert peak(1_500_000) - peak(300_000) < 100

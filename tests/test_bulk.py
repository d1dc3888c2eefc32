"""``python -m service eval``: formats, bad rows, going on after a stop, memory, and every way to call it wrongly."""

import csv
import gc
import json
import os
import signal
import subprocess
import sys
import time
import tracemalloc

import numpy as np
import pytest

from service import bulk
from service.__main__ import main

NAMES = ("mu0", "Fz", "k", "y0", "omega", "v0")
ANSWERS = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")


@pytest.fixture(autouse=True)
def _clean_environment(monkeypatch):
    for name in list(os.environ):
        if name.startswith("MUMACRO_"):
            monkeypatch.delenv(name)


@pytest.fixture
def table(surrogate):
    return str(surrogate.path)


def cases(n, seed=1):
    rng = np.random.default_rng(seed)
    low, high = np.array([-2, -1, 4, -8, 2, -5]), np.array([0, 3, 8, -4, 6, 1])
    return 10.0 ** rng.uniform(low, high, (n, 6))


def write_csv(path, rows, header=NAMES):
    with path.open("w", newline="") as stream:
        csv.writer(stream).writerows([header, *rows])
    return path


def read_csv(path):
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def run(*arguments):
    return main(["eval", *map(str, arguments)])


def test_every_row_is_answered_as_alone(tmp_path, table, surrogate, capsys):
    values = cases(50)
    source = write_csv(tmp_path / "cases.csv", values.tolist())
    assert run(source, "-o", tmp_path / "out.csv", "--tables", table, "--chunk", 7) == 0
    rows = read_csv(tmp_path / "out.csv")
    assert tuple(rows[0]) == ("row", *NAMES, *ANSWERS)
    assert [int(row["row"]) for row in rows] == list(range(1, 51))
    for row, value in zip(rows, values, strict=True):
        expected = surrogate.evaluate(*value)
        assert float(row["mu_macro"]) == pytest.approx(expected.mu_macro, rel=1e-15)
        assert (row["regime"], row["source"]) == (expected.regime, expected.source)
        assert float(row["error_bound"]) == pytest.approx(expected.error_bound, rel=1e-12)
        assert float(row["k"]) == value[2]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cases.csv", "out.csv"]
    assert "50 of 50 rows answered" in capsys.readouterr().out


def test_other_columns_and_units_come_along(tmp_path, table):
    header = ("name", "mu0", "Fz [N]", "y0 [m]", "omega [rad/s]", "v0 [m/s]", "note")
    rows = [("a", 0.3, 10, 2e-6, 1.3e5, 0.01, 'says "so",\nand more'), ("b", 0.3, 10, 2e-6, 1.3e5, 0.02, "µ")]
    source = write_csv(tmp_path / "cases.csv", rows, header)
    assert run(source, "-o", tmp_path / "out.csv", "--tables", table) == 0
    found = read_csv(tmp_path / "out.csv")
    assert [row["note"] for row in found] == [rows[0][-1], "µ"]
    assert [row["source"] for row in found] == ["rigid", "rigid"]  # there is no k


def test_bad_rows_land_in_the_side_file(tmp_path, table, capsys):
    good = ["0.3", "10", "1e6", "2e-6", "1.3e5", "0.01"]
    rows = [
        good,
        ["-0.3", *good[1:]],
        ["x", *good[1:]],
        [*good[:5], ""],
        good[:5],
        [*good, "7"],
        [*good[:5], "nan"],
        [*good[:2], "", *good[3:]],
        ["1_0", *good[1:]],
        [*good[:4], "inf", good[5]],
        good,
    ]
    source = write_csv(tmp_path / "cases.csv", rows)
    assert run(source, "-o", tmp_path / "out.csv", "--tables", table, "--chunk", 4) == 3
    assert [int(row["row"]) for row in read_csv(tmp_path / "out.csv")] == [1, 8, 11]
    rejected = read_csv(tmp_path / "out.csv.rejects.csv")
    assert [(int(row["row"]), row["field"], row["reason"]) for row in rejected] == [
        (2, "mu0", "must be finite and > 0, got -0.3"),
        (3, "mu0", "must be a number"),
        (4, "v0", "is missing"),
        (5, "", "has 5 cells, the header has 6"),
        (6, "", "has 7 cells, the header has 6"),
        (7, "v0", "must be finite and >= 0, got nan"),
        (9, "mu0", "must be a number"),
        (10, "omega", "must be finite and >= 0, got inf"),
    ]
    assert rejected[0]["content"].startswith("-0.3,10,")
    assert "3 of 11 rows answered" in capsys.readouterr().out


def test_a_quote_that_is_never_closed_spoils_its_cell_only(tmp_path, table):
    good = "0.3,10,1e6,2e-6,1.3e5,0.01\n"
    text = ",".join(NAMES) + "\n" + good + '"' + good * 10_000 + good * 5
    (tmp_path / "cases.csv").write_text(text)
    assert run(tmp_path / "cases.csv", "-o", tmp_path / "out.csv", "--tables", table) == 3
    rejected = read_csv(tmp_path / "out.csv.rejects.csv")
    assert rejected
    assert "no CSV" in rejected[0]["reason"]
    assert read_csv(tmp_path / "out.csv")[0]["row"] == "1"


def test_ndjson_in_and_out(tmp_path, table, surrogate):
    case = {"mu0": 0.3, "Fz": 10, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
    lines = [
        json.dumps({**case, "tag": "a"}), "", json.dumps({**case, "k": None}), "[1]", "{",
        json.dumps({**case, "v0": "1"}),
        json.dumps({**case, "v0": True}), json.dumps({**case, "Fz": 10**400}), '{"mu0": 0.3}', json.dumps(case),
    ]  # fmt: skip
    (tmp_path / "cases.ndjson").write_text("\n".join(lines))
    assert run(tmp_path / "cases.ndjson", "-o", tmp_path / "out.jsonl", "--tables", table, "--chunk", 2) == 3
    rows = [json.loads(line) for line in (tmp_path / "out.jsonl").read_text().splitlines()]
    assert [row["row"] for row in rows] == [1, 2, 9]
    assert [row["tag"] for row in rows] == ["a", None, None]
    assert rows[0]["mu_macro"] == surrogate.evaluate(**case).mu_macro
    assert rows[1]["mu_macro"] == surrogate.evaluate(**{**case, "k": None}).mu_macro
    reasons = {int(row["row"]): (row["field"], row["reason"]) for row in read_csv(tmp_path / "out.jsonl.rejects.csv")}
    assert reasons.keys() == {3, 4, 5, 6, 7, 8}
    assert reasons[3] == ("", "is no JSON object")
    assert reasons[5] == reasons[6] == ("v0", "must be a number")
    assert reasons[7] == ("Fz", "must be finite and > 0, got inf")
    assert reasons[8] == ("Fz", "is missing")


def test_parquet_in_and_out(tmp_path, table, surrogate):
    pq = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    import pyarrow as pa

    values = cases(25)
    columns = {name: values[:, i].tolist() for i, name in enumerate(NAMES)}
    columns["k"][3] = None
    columns["mu0"][20:25] = [-1.0] * 5  # a whole chunk without an answer
    pq.write_table(pa.table({**columns, "label": [f"case {i}" for i in range(25)]}), tmp_path / "cases.parquet")
    assert run(tmp_path / "cases.parquet", "-o", tmp_path / "out.parquet", "--tables", table, "--chunk", 5) == 3
    found = pq.read_table(tmp_path / "out.parquet").to_pydict()
    assert found["row"] == list(range(1, 21))
    assert found["label"][19] == "case 19"
    case = [None if i == 2 else value for i, value in enumerate(values[3])]
    assert found["mu_macro"][3] == pytest.approx(surrogate.evaluate(*case).mu_macro, rel=1e-15)
    assert len(read_csv(tmp_path / "out.parquet.rejects.csv")) == 5
    assert run(tmp_path / "cases.parquet", "-o", tmp_path / "out.csv", "--tables", table) == 3
    assert [float(row["mu_macro"]) for row in read_csv(tmp_path / "out.csv")] == pytest.approx(found["mu_macro"])
    assert not list(tmp_path.glob("*.part"))


def test_a_run_that_is_killed_goes_on_and_gives_the_same_bytes(tmp_path, table, repository, capsys):
    values = cases(60_000).tolist()
    values[100][0] = values[59_000][0] = -1.0
    source = write_csv(tmp_path / "cases.csv", values)
    arguments = ["--tables", table, "--chunk", "1000"]
    command = [sys.executable, "-m", "service", "eval", str(source), "-o", str(tmp_path / "out.csv"), *arguments]
    progress = tmp_path / "out.csv.progress"
    process = subprocess.Popen(command, cwd=repository, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while not progress.exists():
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait(timeout=60)
    done = json.loads(progress.read_text())["state"]["rows"]
    assert 0 < done < 60_000
    assert not (tmp_path / "out.csv").exists()
    # what was written after the last note of progress is cut off again
    with (tmp_path / "out.csv.part").open("ab") as part:
        part.write(b"half a row")
    assert run(source, "-o", tmp_path / "out.csv", *arguments) == 3
    assert f"going on after row {done}" in capsys.readouterr().err
    assert run(source, "-o", tmp_path / "whole.csv", *arguments) == 3
    assert (tmp_path / "out.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()
    assert [row["row"] for row in read_csv(tmp_path / "out.csv.rejects.csv")] == ["101", "59001"]
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "cases.csv", "out.csv", "out.csv.rejects.csv", "whole.csv", "whole.csv.rejects.csv"
    ]  # fmt: skip


def stopped(table, source, monkeypatch, out):
    """A run that stops before its third chunk."""
    calls = []

    def stop(*arguments):
        calls.append(1)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return evaluate(*arguments)

    evaluate = bulk.evaluate_rows
    with monkeypatch.context() as patch:
        patch.setattr(bulk, "evaluate_rows", stop)
        assert run(source, "-o", out, "--tables", table, "--chunk", 10) == 130


@pytest.mark.parametrize("suffix", ["csv", "ndjson", "parquet"])
def test_every_format_goes_on_after_a_stop(tmp_path, table, monkeypatch, capsys, suffix):
    if suffix == "parquet":
        pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    source = write_csv(tmp_path / "cases.csv", cases(55).tolist())
    if suffix != "csv":
        start = tmp_path / f"cases.{suffix}"
        assert run(source, "-o", start, "--tables", table) == 0
        source = tmp_path / f"clean.{suffix}"
        _without_answers(start, source)
    out = tmp_path / f"out.{suffix}"
    stopped(table, source, monkeypatch, out)
    assert "goes on from here" in capsys.readouterr().err
    assert not out.exists()
    assert run(source, "-o", out, "--tables", table, "--chunk", 10) == 0
    assert "going on after row 20" in capsys.readouterr().err
    whole = tmp_path / f"whole.{suffix}"
    assert run(source, "-o", whole, "--tables", table, "--chunk", 10) == 0
    assert out.read_bytes() == whole.read_bytes()


def _without_answers(path, clean):
    if path.suffix == ".ndjson":
        rows = [json.loads(line) for line in path.read_text().splitlines()]
        kept = [json.dumps({name: float(row[name]) for name in NAMES}) for row in rows]
        clean.write_text("\n".join(kept))
    else:
        import pyarrow as pa
        import pyarrow.parquet as pq

        table = pq.read_table(path).select(list(NAMES))
        pq.write_table(table.cast(pa.schema([(name, pa.float64()) for name in NAMES])), clean)


def test_another_input_starts_anew(tmp_path, table, monkeypatch, capsys):
    source = write_csv(tmp_path / "cases.csv", cases(55).tolist())
    stopped(table, source, monkeypatch, tmp_path / "out.csv")
    write_csv(source, cases(56, seed=2).tolist())
    assert run(source, "-o", tmp_path / "out.csv", "--tables", table, "--chunk", 10) == 0
    assert "going on" not in capsys.readouterr().err
    assert len(read_csv(tmp_path / "out.csv")) == 56
    stopped(table, source, monkeypatch, tmp_path / "out.csv")
    assert run(source, "-o", tmp_path / "out.csv", "--tables", table, "--chunk", 10, "--fresh") == 0
    assert "going on" not in capsys.readouterr().err


def test_memory_does_not_grow_with_the_file(tmp_path, table, monkeypatch):
    source = write_csv(tmp_path / "cases.csv", cases(30_000).tolist())
    held = []

    def watched(*arguments):
        gc.collect()
        held.append(tracemalloc.get_traced_memory()[0])
        return evaluate(*arguments)

    evaluate = bulk.evaluate_rows
    monkeypatch.setattr(bulk, "evaluate_rows", watched)
    tracemalloc.start()
    try:
        assert run(source, "-o", tmp_path / "out.csv", "--tables", table, "--chunk", 1000) == 0
    finally:
        tracemalloc.stop()
    assert len(held) == 30
    # a row takes more than 1000 bytes while it is in memory
    assert max(held[3:]) - min(held[3:]) < 100_000


def test_a_tolerance_picks_the_smallest_table(tmp_path, tables_dir, app, client, capsys):
    assert client.get("/readyz").status_code == 200
    source = write_csv(tmp_path / "cases.csv", cases(3).tolist())
    for table in app.state.shelf.tables:
        tolerance = str(table.surrogate.tolerance)
        assert run(source, "-o", tmp_path / "out.csv", "--tables", tables_dir, "--tolerance", tolerance) == 0
        assert f"answered by {table.surrogate.id}:" in capsys.readouterr().out
    assert run(source, "-o", tmp_path / "out.csv", "--tables", tables_dir, "--tolerance", "1e-30") == 1
    assert "the tightest has" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "said"),
    [("", "is empty"), ("a,b\n1,2\n", "no column mu0, Fz, y0, omega, v0"), ("mu0,mu0,Fz,y0,omega,v0\n", "there twice"),
     ("mu0,Fz,y0,omega,v0,v0 [m/s]\n", "v0 is there twice"),
     ("mu0,Fz,y0,omega,v0,mu_macro\n", "mu_macro would be written")],
)  # fmt: skip
def test_a_file_that_holds_no_cases_is_refused_by_name(tmp_path, table, capsys, content, said):
    source = tmp_path / "cases.csv"
    source.write_text(content)
    assert run(source, "-o", tmp_path / "out.csv", "--tables", table) == 1
    message = capsys.readouterr().err
    assert str(source) in message
    assert said in message
    assert [path.name for path in tmp_path.iterdir()] == ["cases.csv"]


def test_a_wrong_call_is_told_in_a_line(tmp_path, table, capsys):
    source = write_csv(tmp_path / "cases.csv", cases(2).tolist())
    for arguments, code, said in (
        ((tmp_path / "none.csv", "-o", tmp_path / "o.csv"), 1, "none.csv: No such file"),
        ((source, "-o", tmp_path / "o.xlsx"), 1, "the suffix must be one of .csv"),
        ((source, "-o", tmp_path / "missing" / "o.csv"), 1, "No such file or directory"),
        ((source, "-o", tmp_path / "o.csv", "--tables", tmp_path / "none.nc"), 1, "none.nc: missing"),
    ):
        if "--tables" not in arguments:
            arguments = (*arguments, "--tables", table)
        assert run(*arguments) == code
        message = capsys.readouterr().err
        assert said in message
        assert "Traceback" not in message
    for arguments in (
        (source,),
        (source, "-o", source),
        (source, "-o", tmp_path / "o.csv", "--chunk", "0"),
        (source, "-o", tmp_path / "o.csv", "--tolerance", "nan"),
    ):
        with pytest.raises(SystemExit) as caught:
            run(*arguments)
        assert caught.value.code == 2
        assert "Traceback" not in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["cases.csv"]


def test_a_file_without_rows_gives_a_file_without_rows(tmp_path, table):
    source = write_csv(tmp_path / "cases.csv", [])
    assert run(source, "-o", tmp_path / "out.csv", "--tables", table) == 0
    assert (tmp_path / "out.csv").read_bytes().decode() == ",".join(("row", *NAMES, *ANSWERS)) + "\r\n"

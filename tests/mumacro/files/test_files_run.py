"""``mumacro eval`` killed, stopped, cut, changed: the same command goes on with the same bytes, or
says why not."""

import gzip
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from tests.mumacro.files.test_files_formats import cases as random_cases
from tests.mumacro.files.test_files_formats import write
from tests.support.cases import Capture, opened

pa = pytest.importorskip("pyarrow", reason="the extra files is not installed")
import pyarrow.parquet as pq  # noqa: E402

from mumacro.cli.main import main  # noqa: E402
from mumacro.files import FilesError, evaluate_files, reading, run  # noqa: E402
from mumacro.inputs import decoding  # noqa: E402

TABLE = opened(1e-12)
KINDS = ("csv", "csv.gz", "ndjson", "parquet")


@pytest.fixture(scope="module", autouse=True)
def small_blocks() -> Any:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reading, "ROWS", 400)
        patch.setattr(decoding, "PIECE", 20_000)
        yield


def table_of(n: int) -> Any:
    inputs = random_cases(n)
    mu0 = inputs["mu0"].to_numpy().copy()
    mu0[::999] *= -1.0  # rejected
    return inputs.set_column(0, "mu0", pa.array(mu0))


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory, small_blocks: Any) -> Any:  # noqa: ARG001
    """3,000 cases in every format, and the output of a run that nothing disturbed."""
    folder = tmp_path_factory.mktemp("cases")
    for kind in KINDS:
        evaluate_files(
            [write(table_of(3000), folder / f"cases.{kind}")], folder / f"whole.{kind}", TABLE
        )
    return folder


def copied(cases: Any, kind: Any, folder: Path) -> Any:
    return shutil.copy(cases / f"cases.{kind}", folder)


def files_in(folder: Path) -> Any:
    return sorted(path.name for path in folder.iterdir())


def stopped(source: Any, out: Any, share: float = 0.5, **options: Any) -> None:
    """A run that is interrupted when ``share`` of its input is read."""

    def stop(done: Any, _rows: Any, _rejected: Any) -> None:
        if done > share:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        evaluate_files([source], out, TABLE, progress=stop, **options)


def assert_whole(out: Any, cases: Any) -> None:
    """The bytes of the undisturbed run, and nothing left over."""
    kind = out.name.partition(".")[2]
    for ending in ("", ".rejects.csv"):
        assert (
            out.with_name(out.name + ending).read_bytes()
            == (cases / f"whole.{kind}{ending}").read_bytes()
        )
    assert [name for name in files_in(out.parent) if name.startswith("out")] == [
        f"out.{kind}",
        f"out.{kind}.rejects.csv",
        f"out.{kind}.run.json",
    ]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("share", [-1.0, 0.4, 0.8])
def test_a_stopped_run_goes_on_with_the_same_bytes(
    tmp_path: Path, cases: Any, kind: Any, share: Any
) -> None:
    source, out, words = copied(cases, kind, tmp_path), tmp_path / f"out.{kind}", list[str]()
    stopped(source, out, share)
    assert not out.exists()
    summary = evaluate_files([source], out, TABLE, say=words.append)
    assert (summary.rows, summary.rejected) == (3000, 4)
    assert words == [
        f"{out}.parts: {summary.resumed:,} rows are done already ({words[0].partition('(')[2]}"
    ]
    # Python 3.12 and newer read far ahead of what they unpack
    done = 0.0 if kind == "csv.gz" else share
    assert 3000 * (done - 0.1) <= summary.resumed < 3000
    assert_whole(out, cases)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("harm", ["cut", "changed", "gone", "longer"])
def test_finished_pieces_cut_or_changed_are_done_again(
    tmp_path: Path, cases: Any, kind: Any, harm: Any
) -> None:
    source, out, words = copied(cases, kind, tmp_path), tmp_path / f"out.{kind}", list[str]()
    stopped(source, out)
    part = tmp_path / f"out.{kind}.parts" / "log"
    data = part.read_bytes()
    if harm == "gone":
        part.unlink()
    else:
        at = 2 * len(data) // 3
        swapped = data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]
        part.write_bytes({"cut": data[:at], "changed": swapped, "longer": data + data[at:]}[harm])
    summary = evaluate_files([source], out, TABLE, say=words.append)
    assert summary.rows == 3000
    assert ("is done again" in "".join(words)) == (harm != "gone")
    assert_whole(out, cases)


@pytest.mark.parametrize("kind", KINDS)
def test_a_stop_at_any_step_ends_well(
    tmp_path: Path, cases: Any, monkeypatch: pytest.MonkeyPatch, kind: Any
) -> None:
    """Before each file that is put into place or deleted; then the same command completes the
    run."""
    source, steps = copied(cases, kind, tmp_path), 0
    while True:
        out, count = tmp_path / str(steps) / f"out.{kind}", 0
        out.parent.mkdir()

        def step(act: Any, stop: Any = steps) -> Any:
            def counted(*words: Any, **options: Any) -> Any:
                nonlocal count
                count += 1
                if count > stop:
                    raise KeyboardInterrupt
                return act(*words, **options)

            return counted

        with monkeypatch.context() as patch:
            for place, name in ((run, "put"), (run, "write_whole"), (Path, "unlink")):
                patch.setattr(place, name, step(getattr(place, name)))
            try:
                evaluate_files([source], out, TABLE)
            except KeyboardInterrupt:
                pass
            else:
                break
        assert evaluate_files([source], out, TABLE).rows == 3000
        assert_whole(out, cases)
        steps += 1
    assert steps > 6


@pytest.mark.parametrize("kind", KINDS)
def test_the_command_given_again_finds_all_done(
    tmp_path: Path, cases: Any, capsys: Capture, kind: Any
) -> None:
    source, out = copied(cases, kind, tmp_path), tmp_path / f"out.{kind}"
    words = ["eval", str(source), "-o", str(out)]
    assert [main(words), main(words)] == [3, 3]
    output = capsys.readouterr()
    assert "3,000 were done already" in output.out
    assert "is complete already" in output.err
    assert_whole(out, cases)
    out.write_text("mine")  # what is no longer the output of that run is kept
    assert main(words) == 1
    assert "exists already; --force replaces it" in capsys.readouterr().err
    assert out.read_text() == "mine"
    assert main([*words, "--force"]) == 3
    assert_whole(out, cases)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["parquet", "csv"])
def test_a_killed_run_goes_on_with_the_same_bytes(
    tmp_path: Path, repository: Path, cases: Any, kind: Any
) -> None:
    source, out, log = (
        tmp_path / "cases.csv",
        tmp_path / f"out.{kind}",
        tmp_path / f"out.{kind}.parts" / "log",
    )
    header, *rows = (cases / "cases.csv").read_text().splitlines(keepends=True)
    source.write_text("".join([header, *(100 * rows)]))
    command, kills = [sys.executable, "-m", "mumacro", "eval", str(source), "-o"], 0
    for pause in (0.0, 0.01, 0.05, 0.2):
        process = subprocess.Popen([*command, str(out)], cwd=repository, stdout=-3, stderr=-3)
        had = log.stat().st_size if log.exists() else 0
        while process.poll() is None and (not log.exists() or log.stat().st_size <= had):
            time.sleep(0.002)
        time.sleep(pause)
        if process.poll() is None:
            os.kill(process.pid, signal.SIGKILL)
            kills += 1
        process.wait(timeout=60)
    assert kills
    for path in (out, tmp_path / f"whole.{kind}"):
        assert (
            subprocess.run(
                [*command, str(path)], cwd=repository, capture_output=True, check=False
            ).returncode
            == 3
        )
    assert out.read_bytes() == (tmp_path / f"whole.{kind}").read_bytes()
    assert not list(tmp_path.glob("*.parts"))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("harm", ["cut", "changed"])
def test_an_input_that_changes_is_not_reported_complete(
    tmp_path: Path, cases: Any, kind: Any, harm: Any
) -> None:
    source, out = tmp_path / f"cases.{kind}", tmp_path / f"out.{kind}"
    copied(cases, kind, tmp_path)
    data, times = source.read_bytes(), (source.stat().st_atime_ns, source.stat().st_mtime_ns)

    def change(*_: Any) -> None:
        if harm == "cut":
            os.truncate(source, len(data) // 2)
        else:  # a digit; the size and the time stay
            source.write_bytes(data[:1000] + bytes([data[1000] ^ 1]) + data[1001:])
            os.utime(source, ns=times)

    with pytest.raises(FilesError, match="changed while it was read"):
        evaluate_files([source], out, TABLE, progress=change)
    assert files_in(tmp_path) == [source.name]


@pytest.mark.parametrize("kind", KINDS)
def test_a_fault_that_a_change_brings_in_is_told_as_a_change(
    tmp_path: Path, cases: Any, kind: Any
) -> None:
    """The file ends in half a row, in half a member of gzip or before its footer."""
    source, out = tmp_path / f"cases.{kind}", tmp_path / f"out.{kind}"
    rows = b"".join((cases / "cases.csv").read_bytes().splitlines(keepends=True)[:20])
    half = {
        "csv": rows + b'"half',
        "csv.gz": gzip.compress(rows + b'"half'),
        "ndjson": b"\xff" * 20,
        "parquet": (cases / "cases.parquet").read_bytes()[:5000],
    }[kind]
    copied(cases, kind, tmp_path)

    def change(*_: Any) -> None:  # its first call comes before the file is opened
        source.write_bytes(half)

    with pytest.raises(FilesError, match="changed while it was read") as failure:
        evaluate_files([source], out, TABLE, progress=change)
    assert "quote" not in str(failure.value)
    assert files_in(tmp_path) == [source.name]
    if kind.startswith("csv"):  # the fault alone is told as what it is
        with pytest.raises(FilesError, match=r"line 21: a quote is not closed"):
            evaluate_files([source], out, TABLE)


@pytest.mark.parametrize("kind", [{}, {"contact": "ball"}, {"direction": "along"}])
def test_another_content_contact_or_direction_is_another_run(
    tmp_path: Path, cases: Any, kind: Any
) -> None:
    source, out = tmp_path / "cases.csv", tmp_path / "out.csv"
    copied(cases, "csv", tmp_path)
    stopped(source, out, **kind)
    data, times = source.read_bytes(), (source.stat().st_atime_ns, source.stat().st_mtime_ns)
    if not kind:  # of the same size and time
        source.write_bytes(data.replace(b"e-05", b"e-06"))
        os.utime(source, ns=times)
    what = "options" if kind else "inputs"
    with pytest.raises(
        FilesError, match=rf"parts of another run \({what} differ\); --force deletes them"
    ):
        evaluate_files([source], out, TABLE)
    source.write_bytes(data)  # and the same content of another time is the same input
    assert evaluate_files([source], out, TABLE, **kind).resumed
    if kind:
        evaluate_files([source], tmp_path / "whole.csv", TABLE, **kind)
        assert (
            out.read_bytes()
            == (tmp_path / "whole.csv").read_bytes()
            != (cases / "whole.csv").read_bytes()
        )
    else:
        assert_whole(out, cases)


@pytest.mark.parametrize("name", ["out.csv", "out.csv.rejects.csv"])
@pytest.mark.parametrize("link", ["", "link.csv"])
def test_an_output_never_replaces_an_input(
    tmp_path: Path, capsys: Capture, cases: Any, name: str, link: Any
) -> None:
    shutil.copy(cases / "cases.csv", tmp_path / name)
    if link:
        (tmp_path / link).hardlink_to(tmp_path / name)
    assert (
        main(["eval", str(tmp_path / (link or name)), "-o", str(tmp_path / "out.csv"), "--force"])
        == 1
    )
    assert "is an input, and would be overwritten" in capsys.readouterr().err
    assert (tmp_path / name).read_bytes() == (cases / "cases.csv").read_bytes()


def test_other_files_are_kept_and_a_second_run_is_refused(
    tmp_path: Path, cases: Any, capsys: Capture
) -> None:
    source, out, words = copied(cases, "csv", tmp_path), tmp_path / "out.csv", list[str]()
    (tmp_path / "out.csv.parts").mkdir()
    (tmp_path / "out.csv.parts" / "precious.txt").write_text("mine")

    def other(*_: Any) -> None:
        if not words:
            assert main(["eval", str(source), "-o", str(out), "--force"]) == 1
            words.append(capsys.readouterr().err)

    assert evaluate_files([source], out, TABLE, force=True, progress=other).rows == 3000
    assert "out.csv.parts: another process is at work here; wait for it, or stop it" in words[0]
    assert (tmp_path / "out.csv.parts" / "precious.txt").read_text() == "mine"


@pytest.mark.skipif(os.name == "nt", reason="no limit of file sizes")
@pytest.mark.slow
@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_a_full_disk_is_told_and_the_run_goes_on_later(
    tmp_path: Path, cases: Any, repository: Path, kind: Any
) -> None:
    source, out = copied(cases, kind, tmp_path), tmp_path / f"out.{kind}"
    program = (
        "import resource, sys; from mumacro.files import reading; reading.ROWS = 400; "
        "from mumacro.cli.main import main; resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, "
        f"200_000)); sys.exit(main(['eval', {str(source)!r}, '-o', {str(out)!r}]))"
    )
    words = [sys.executable, "-c", program]
    done = subprocess.run(
        words, cwd=repository, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 1, done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert "File too large" in done.stderr
    assert not out.exists()
    assert evaluate_files([source], out, TABLE).resumed
    assert_whole(out, cases)


@pytest.mark.slow
def test_memory_does_not_grow_with_the_file(tmp_path: Path, repository: Path) -> None:
    def peak(n: int) -> Any:
        pq.write_table(table_of(n), tmp_path / "cases.parquet", row_group_size=100_000)
        program = (
            "import resource; from mumacro.cli.main import main; "
            f"main(['eval', {str(tmp_path / 'cases.parquet')!r}, '-o', "
            f"{str(tmp_path / 'out.parquet')!r}, '--force']); "
            "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024)"
        )
        words = [sys.executable, "-c", program]
        done = subprocess.run(
            words, cwd=repository, capture_output=True, text=True, timeout=300, check=True
        )
        return int(done.stdout.split()[-1])

    # 1.2 million more rows are 130 MB of numbers
    assert peak(1_500_000) - peak(300_000) < 100

"""``mumacro eval`` killed, interrupted, on a full disk, with an input that changes: its output is
whole, or the older one stays, and there is no other file."""

import gzip
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.mumacro.files.test_files_formats import cases as random_cases
from tests.mumacro.files.test_files_formats import write
from tests.support.cases import Capture, opened

pa = pytest.importorskip("pyarrow", reason="the extra files is not installed")
import pyarrow.parquet as pq  # noqa: E402

from mumacro.cli.main import main  # noqa: E402
from mumacro.files import FilesError, evaluate_files, sources  # noqa: E402
from mumacro.inputs import decoding  # noqa: E402
from mumacro.table import atomic  # noqa: E402

TABLE = opened(1e-12)
KINDS = ("csv", "csv.gz", "parquet")


@pytest.fixture(scope="module", autouse=True)
def small_blocks() -> Any:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sources, "ROWS", 400)
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


@pytest.fixture(params=[False, True], ids=["new", "old"])
def older(request: pytest.FixtureRequest) -> bytes | None:
    """The content of an older output that ``--force`` would replace; None where there is none."""
    return b"older" if request.param else None


def assert_as_before(out: Path, older: bytes | None) -> None:
    """An older output is what it was, and nothing else is left."""
    names = [name for name in files_in(out.parent) if not name.startswith("cases.")]
    assert names == ([out.name] if older else [])
    assert older is None or out.read_bytes() == older


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("share", [-1.0, 0.4, 0.99])
@pytest.mark.parametrize("named", [False, True])
def test_an_interrupted_run_leaves_what_was_there(
    tmp_path: Path,
    cases: Any,
    monkeypatch: pytest.MonkeyPatch,
    kind: Any,
    share: Any,
    older: bytes | None,
    named: bool,
) -> None:
    """Also where the system has no files without a name."""
    source, out = copied(cases, kind, tmp_path), tmp_path / f"out.{kind}"
    if older:
        out.write_bytes(older)
    if named:
        monkeypatch.setattr(atomic, "_without_name", lambda _folder: None)

    def stop(done: Any, _rows: Any, _rejected: Any) -> None:
        if done > share:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        evaluate_files([source], out, TABLE, progress=stop, force=True)
    assert_as_before(out, older)


@pytest.mark.parametrize("kind", KINDS)
def test_a_second_run_replaces_its_output_only_when_told_to(
    tmp_path: Path, cases: Any, capsys: Capture, kind: Any
) -> None:
    source, out = copied(cases, kind, tmp_path), tmp_path / f"out.{kind}"
    out.write_text("mine")
    words = ["eval", str(source), "-o", str(out)]
    assert main(words) == 1
    assert "exists already; --force replaces it" in capsys.readouterr().err
    assert_as_before(out, b"mine")
    assert main([*words, "--force"]) == 3
    for ending in ("", ".rejects.csv"):
        whole = (cases / f"whole.{kind}{ending}").read_bytes()
        assert out.with_name(out.name + ending).read_bytes() == whole
    assert files_in(tmp_path) == [f"cases.{kind}", f"out.{kind}", f"out.{kind}.rejects.csv"]


def test_old_rejects_go_when_a_new_run_has_none(tmp_path: Path, cases: Any) -> None:
    out = tmp_path / "out.csv"
    assert evaluate_files([copied(cases, "csv", tmp_path)], out, TABLE).rejects
    good = write(random_cases(500), tmp_path / "good.csv")
    assert evaluate_files([good], out, TABLE, force=True).rejects is None
    assert files_in(tmp_path) == ["cases.csv", "good.csv", "out.csv"]


@pytest.mark.skipif(os.name == "nt", reason="no signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_stopped_process_leaves_what_was_there(
    tmp_path: Path, repository: Path, cases: Any, number: Any, older: bytes | None
) -> None:
    source, out = copied(cases, "csv", tmp_path), tmp_path / "out.csv"
    if older:
        out.write_bytes(older)
    # it says when half of the input is read, and waits
    program = (
        "import sys, time; from mumacro.files import sources, run; sources.ROWS = 400\n"
        "from mumacro.cli import eval as command\n"
        "def evaluate(*words, progress, **options):\n"
        "    def wait(share, *counts):\n"
        "        if share > 0.5:\n"
        "            print('half', flush=True)\n"
        "            time.sleep(60)\n"
        "    return run.evaluate_files(*words, progress=wait, **options)\n"
        "command.evaluate_files = evaluate\n"
        f"sys.exit(command.main([{str(source)!r}, '-o', {str(out)!r}, '--force']))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program], cwd=repository, stdout=-1, stderr=-3, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "half\n"
    process.send_signal(number)
    code = process.wait(timeout=60)
    process.stdout.close()
    assert code == (130 if number == signal.SIGINT else -number)
    assert_as_before(out, older)


@pytest.mark.skipif(os.name == "nt", reason="no limit of file sizes")
@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_a_full_disk_is_told_and_leaves_what_was_there(
    tmp_path: Path, cases: Any, repository: Path, kind: Any, older: bytes | None
) -> None:
    source, out = copied(cases, kind, tmp_path), tmp_path / f"out.{kind}"
    if older:
        out.write_bytes(older)
    program = (
        "import resource, sys; from mumacro.files import sources; sources.ROWS = 400; "
        "from mumacro.cli.main import main; resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, "
        f"200_000)); sys.exit(main(['eval', {str(source)!r}, '-o', {str(out)!r}, '--force']))"
    )
    words = [sys.executable, "-c", program]
    done = subprocess.run(
        words, cwd=repository, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 1, done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert "File too large" in done.stderr
    assert_as_before(out, older)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("harm", ["cut", "changed"])
def test_an_input_that_changes_is_not_reported_complete(
    tmp_path: Path, cases: Any, kind: Any, harm: Any
) -> None:
    source, out = tmp_path / f"cases.{kind}", tmp_path / f"out.{kind}"
    copied(cases, kind, tmp_path)
    data = source.read_bytes()

    def change(*_: Any) -> None:
        if harm == "cut":
            os.truncate(source, len(data) // 2)
        else:  # a digit; the size stays
            source.write_bytes(data[:1000] + bytes([data[1000] ^ 1]) + data[1001:])

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

"""Compiled kernels on disk: ownership, damaged files, and folders that cannot be written."""

import os
import stat
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mumacro import kernel_cache

pytestmark = pytest.mark.slow

posix = pytest.mark.skipif(not hasattr(os, "getuid"), reason="this system has no owners of that kind")
root = pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root may give files away")


def double(x: float) -> float:
    return 2.0 * x


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder for kernels of this test."""
    monkeypatch.setattr(kernel_cache, "cache_folder", lambda *_: tmp_path)
    return tmp_path


def declared(function: Callable[..., Any] = double) -> Any:
    """The function as another process would declare it."""
    return kernel_cache.kernel(function)


def hits(kernel: Any) -> int:
    """How many of its signatures were loaded from disk."""
    return sum(kernel.stats.cache_hits.values())


def stored(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


# --- files that are damaged ---------------------------------------------------------------------------


def test_a_kernel_is_kept_and_taken_up_again(folder: Path) -> None:
    assert declared()(1.5) == 3.0
    assert len(stored(folder)) == 1
    again = declared()
    assert again(1.5) == 3.0
    assert hits(again) == 1


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "no byte": lambda _: b"",
    "one byte": lambda whole: whole[:1],
    "its first half": lambda whole: whole[: len(whole) // 2],
    "all but its last byte": lambda whole: whole[:-1],
    "a byte more": lambda whole: whole + b"x",
    "zeros, as after a crash": lambda whole: bytes(len(whole)),
    "something else": lambda _: b"cos\nsystem\n(S'exit 1'\ntR.",
    "a flipped byte": lambda whole: whole[:900] + bytes([whole[900] ^ 1]) + whole[901:],
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_compiled_again_and_replaced(folder: Path, damage: str) -> None:
    declared()(1.5)
    whole = {path: path.read_bytes() for path in stored(folder)}
    for path in whole:
        for other, content in whole.items():  # one damaged, the others sound
            other.write_bytes(DAMAGES[damage](content) if other == path else content)
        mended = declared()
        assert mended(1.5) == 3.0
        assert hits(mended) == 0
        after = declared()
        assert after(1.5) == 3.0
        assert hits(after) == 1


def test_every_flipped_byte_is_noticed(folder: Path) -> None:
    """Damaged machine code could give wrong values or crash; it is never run."""
    declared()(1.5)
    (path,) = stored(folder)
    whole = path.read_bytes()
    rng = np.random.default_rng(1)
    for offset in rng.integers(0, len(whole), 20):
        path.write_bytes(whole[:offset] + bytes([whole[offset] ^ 1 << int(rng.integers(8))]) + whole[offset + 1 :])
        kernel = declared()
        assert kernel(1.5) == 3.0
        assert hits(kernel) == 0
        assert path.read_bytes() != b""


def test_a_file_with_the_name_of_another_kernel_is_not_run(folder: Path) -> None:
    declared()(1.5)
    (one,) = stored(folder)
    whole = one.read_bytes()
    declared()(np.ones(3)[0].astype(np.float32))
    (other,) = set(stored(folder)) - {one}
    other.write_bytes(whole)
    kernel = declared()
    assert kernel(np.float32(1.5)) == 3.0
    assert hits(kernel) == 0


def test_a_folder_that_goes_away_costs_time_only(folder: Path) -> None:
    kernel = declared()
    folder.rmdir()
    assert kernel(1.5) == 3.0
    assert declared()(1.5) == 3.0


@pytest.mark.parametrize("number", [28, 13, 30, 5])  # no space, no permission, read-only, input/output error
def test_a_kernel_that_cannot_be_kept_answers(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, number: int
) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", refuse)
        kernel = declared()
        assert kernel(1.5) == 3.0
        assert kernel(np.float32(1.5)) == 3.0
    assert stored(folder) == []  # no part of a file is left
    (record,) = caplog.records  # reported once, not for every kernel
    assert os.strerror(number) in record.getMessage()


def test_kernels_may_be_written_by_many_at_once(tmp_path: Path, repository: Path) -> None:
    """Two processes with two signatures each, one empty folder: right answers, complete files, no other files left."""
    program = (
        "import sys; from pathlib import Path; sys.path.insert(0, sys.argv[2]); import numpy as np\n"
        "from mumacro import kernel_cache; kernel_cache.cache_folder = lambda *_: Path(sys.argv[1])\n"
        "exec('def double(x):\\n    return 2.0 * x')\n"
        "sys.stdin.readline()\n"
        "for kind in (np.float64, np.float32) if int(sys.argv[3]) % 2 else (np.float32, np.float64):\n"
        "    kernel = kernel_cache.kernel(double)\n"
        "    assert kernel(kind(1.5)) == 3.0\n"
        "print(sum(kernel.stats.cache_hits.values()))\n"
    )
    command = [sys.executable, "-c", program, str(tmp_path), str(repository)]
    processes = [
        subprocess.Popen([*command, str(i)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) for i in range(2)
    ]
    with ThreadPoolExecutor(len(processes)) as pool:
        for process, (out, _) in zip(
            processes, pool.map(lambda process: process.communicate("go\n", timeout=120), processes), strict=True
        ):
            assert process.returncode == 0
            assert int(out) >= 0
    assert len(stored(tmp_path)) == 2
    late = subprocess.run([*command, "0"], input="go\n", capture_output=True, text=True, timeout=120, check=True)
    assert int(late.stdout) == 1


# --- owners of the files ------------------------------------------------------------------------------


@pytest.fixture
def chosen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder named by NUMBA_CACHE_DIR, and the folder of kernels in it."""
    kernel_cache.cache_folder.cache_clear()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))
    yield tmp_path / "kernels" / f"kernels-{kernel_cache.source_digest()}"
    kernel_cache.cache_folder.cache_clear()


@posix
def test_a_new_folder_can_be_written_by_its_user_only(chosen: Path) -> None:
    before = os.umask(0)
    try:
        assert kernel_cache.cache_folder() == chosen
    finally:
        os.umask(before)
    for made in (chosen, chosen.parent):
        assert stat.S_IMODE(made.stat().st_mode) == 0o700


@root
@pytest.mark.parametrize("which", ["the folder", "a folder above it"])
def test_a_folder_that_belongs_to_somebody_else_is_not_used(
    chosen: Path, capsys: pytest.CaptureFixture[str], which: str
) -> None:
    chosen.mkdir(parents=True, mode=0o700)
    (chosen / "planted.kernel").write_bytes(b"cos\nsystem\n(S'exit 1'\ntR.")
    os.chown(chosen if which == "the folder" else chosen.parent, 12345, 12345)
    assert kernel_cache.cache_folder() is None
    assert "others can write to" in capsys.readouterr().err


@posix
@pytest.mark.parametrize("mode", [0o777, 0o770, 0o702, 0o1777])
def test_a_folder_that_others_can_write_to_is_not_used(chosen: Path, mode: int) -> None:
    chosen.mkdir(parents=True)
    chosen.chmod(mode)
    assert kernel_cache.cache_folder() is None


@posix
@pytest.mark.parametrize(("mode", "used"), [(0o777, False), (0o1777, True), (0o755, True)])
def test_a_folder_that_others_can_rename_is_not_used(chosen: Path, mode: int, used: bool) -> None:
    """In a folder that all can write to, only the sticky bit prevents others from replacing it."""
    chosen.parent.mkdir()
    chosen.parent.chmod(mode)
    assert (kernel_cache.cache_folder() == chosen) is used


@root
def test_a_folder_of_the_administrator_is_used(chosen: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An image's kernels are compiled by root when it is built, and run by another user."""
    chosen.mkdir(parents=True)
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    assert kernel_cache.cache_folder() == chosen


@posix
def test_a_link_to_somebody_elses_folder_is_not_used(chosen: Path, tmp_path: Path) -> None:
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs").chmod(0o777)
    chosen.parent.mkdir()
    chosen.symlink_to(tmp_path / "theirs")
    assert kernel_cache.cache_folder() is None


@pytest.mark.parametrize("home", ["missing", "a file", "nowhere"])
def test_without_a_home_no_kernel_is_stored_in_a_shared_folder(tmp_path: Path, repository: Path, home: str) -> None:
    """No predictable folder among the temporary files is used instead; the kernel runs; one line gives the reason."""
    (tmp_path / "file").touch()
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    environment = {
        name: value for name, value in os.environ.items() if name not in ("HOME", "NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
    }
    environment |= {"TMPDIR": str(temporary), "PYTHONPATH": str(repository), "PYTHONDONTWRITEBYTECODE": "1"}
    if home != "missing":
        environment["HOME"] = str(tmp_path / "file") if home == "a file" else "/proc/none"
    program = (
        "import os, sys\n"
        "if sys.argv[1] == 'missing' and hasattr(os, 'setuid'):\n"
        "    import pwd; pwd.getpwuid = lambda _: (_ for _ in ()).throw(KeyError('nobody of that number'))\n"
        "from mumacro import kernel_cache\n"
        "import tempfile; print(kernel_cache.cache_folder())\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, home], env=environment, capture_output=True, text=True, timeout=120, check=True
    )
    assert done.stdout.strip() == "None"
    assert "mumacro: compiled kernels are not stored: " in done.stderr
    assert list(temporary.iterdir()) == []

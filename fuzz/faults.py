"""Faults of disks, permissions and processes: no data are lost, and the same command resumes.

    python fuzz/faults.py [--write]

Small disks are mounted as tmpfs and permissions are removed for another user; both need root.  A
trial that cannot be made on this machine is reported as "not tried".
"""

import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from benchmarks.measuring import ROOT, main, markdown, sections
from mumacro import Surrogate
from mumacro.table.atomic import alone_in

SMALLEST = ROOT / "tables" / "mumacro-1e-4.nc"
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
TOLERANCE = "1e-2"
# a user that owns nothing
AS_NOBODY = ("setpriv", "--reuid=12345", "--regid=12345", "--clear-groups")


class NotTriedError(Exception):
    """A trial cannot be made here; the message says why."""


def run(*words: object, nobody: bool = False, code: int = 0) -> str:
    """Run a command of the project and return its last output: one line if it fails."""
    command = (*(AS_NOBODY if nobody else ()), sys.executable, *map(str, words))
    done = subprocess.run(
        command,
        cwd=ROOT,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        timeout=1800,
        check=False,
    )
    assert "Traceback" not in done.stderr, done.stderr
    assert done.returncode == code, f"exit code {done.returncode}: {done.stderr or done.stdout}"
    lines = (done.stderr if done.returncode in (1, 2) else done.stdout).strip().splitlines()
    return lines[-1] if lines else ""


def build(out: Path) -> list[str]:
    return ["-m", "builder", "build", "--tolerance", TOLERANCE, "--out", str(out)]


def checksum(path: Path) -> str:
    return Surrogate.open(path).checksum


@contextmanager
def small_disk(folder: Path, size: str) -> Iterator[Path]:
    """A small file system in memory, which fills quickly."""
    disk = folder / "disk"
    disk.mkdir()
    mount = shutil.which("mount")
    words = [str(mount), "-t", "tmpfs", "-o", f"size={size},mode=0777", "tmpfs", str(disk)]
    if mount is None or subprocess.run(words, capture_output=True, check=False).returncode:
        raise NotTriedError("mounting a small file system is not permitted here")
    try:
        yield disk
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)


def closed(folder: Path) -> Path:
    """A folder that another user can read but not write."""
    if not hasattr(os, "getuid") or os.getuid() != 0:
        raise NotTriedError("only root may run a trial as another user")
    folder.chmod(0o755)
    try:
        words = [*AS_NOBODY, sys.executable, "-c", "import numpy"]
        subprocess.run(words, cwd=folder, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        raise NotTriedError("another user cannot run this Python") from None
    subfolder = folder / "closed"
    subfolder.mkdir(mode=0o755)
    return subfolder


def files_in(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def full_disk_in_a_build(folder: Path) -> str:
    with small_disk(folder, "96k") as disk:
        line = run(*build(disk / "rough.nc"), code=1)
        assert (
            "No space left on device; repair that and give the same command again: it resumes"
            in line
        ), line
        assert not [name for name in files_in(disk) if name.endswith(".growing")], files_in(disk)
        parts = len(files_in(disk))
        subprocess.run(["mount", "-o", "remount,size=64m", str(disk)], check=True)
        run(*build(disk / "rough.nc"))
        assert files_in(disk) == ["rough.nc"]
        run(*build(folder / "whole.nc"))
        assert checksum(disk / "rough.nc") == checksum(folder / "whole.nc")
    return (
        f"one line; {parts} finished parts kept; with more space the same command gives the "
        "same table"
    )


def lost_permission(folder: Path) -> str:
    """Commands whose user must not write into the folder."""
    shut, source = closed(folder), folder / "cases.csv"
    source.write_text("mu0,Fz,k,y0,omega,v0\n0.3,10,1e6,2e-6,1.3e5,0.01\n")
    program = (
        "import sys, mumacro\nfrom mumacro.table.netcdf import read_table, write_table\ntable = "
        "read_table(sys.argv[1])\n"
        "try:\n    write_table(table, sys.argv[2])\nexcept mumacro.TableError as error:\n    "
        "sys.exit(error.reason)"
    )
    for words in (
        build(shut / "rough.nc"),
        ("-c", program, SMALLEST, shut / "new.nc"),
        ("-m", "mumacro", "eval", source, "-o", shut / "out.csv"),
    ):
        line = run(*words, nobody=True, code=1)
        assert "Permission denied" in line, line
        assert files_in(shut) == []
    return "one line; no file left"


def two_builds_to_one_output(folder: Path) -> str:
    with alone_in(folder / "rough.nc.checkpoint"):
        line = run(*build(folder / "rough.nc"), code=1)
    assert (
        "rough.nc.checkpoint: another process is at work here; wait for it, or stop it" in line
    ), line
    assert files_in(folder) == []
    return "the second is refused with one line"


def killed_builds(folder: Path, kills: int = 20) -> str:
    """Every other one is killed after it has finished a part, the rest at any moment."""
    out, chance, resumed, done = folder / "rough.nc", random.Random(7), 0, 0  # noqa: S311

    def parts() -> int:
        return len(list(folder.glob(f"{out.name}.checkpoint/*.npy")))

    begun = time.perf_counter()
    run(*build(folder / "whole.nc"))
    most = (time.perf_counter() - begun) / 2.0
    for i in range(kills):
        before = parts()
        done += out.exists()
        process = subprocess.Popen(
            [sys.executable, *build(out)], cwd=ROOT, env=ENVIRONMENT, stdout=-3, stderr=-3
        )
        while i % 2 == 0 and process.poll() is None and parts() <= before:
            time.sleep(0.01)
        with suppress(subprocess.TimeoutExpired):
            process.wait(timeout=chance.uniform(0.0, most) / (10 if i % 2 == 0 else 1))
        process.kill()
        process.wait()
        resumed += parts() > 0
    run(*build(out))
    assert checksum(out) == checksum(folder / "whole.nc")
    assert files_in(folder) == ["rough.nc", "whole.nc"], files_in(folder)
    return (
        f"{kills} kills, {resumed} starts from finished parts, {done} after an end: the same "
        "data, no file left"
    )


FAULTS: dict[str, Callable[[Path], str]] = {
    "disk full while a build runs": full_disk_in_a_build,
    "SIGKILL of builds": killed_builds,
    "no permission to write": lost_permission,
    "two builds to one output": two_builds_to_one_output,
}
QUICK = [*FAULTS][2:]


def outcome_of(fault: Callable[[Path], str]) -> tuple[str, str]:
    """Result of the trial ("held" if it passed), and what was seen."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            return "held", fault(Path(folder))
        except NotTriedError as reason:
            return "not tried", str(reason)
        except AssertionError as error:
            return "FAILED", " ".join(str(error).split())[:300]


def faults() -> str:
    rows = [[name, *outcome_of(fault)] for name, fault in FAULTS.items()]
    return markdown(("fault", "result", "what was seen"), rows, 3)


if __name__ == "__main__":
    main(__doc__, sections(faults))

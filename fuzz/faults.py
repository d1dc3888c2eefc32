"""Faults of disks, permissions and processes: what was there stays, and no other file is left.

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

from mumacro import Surrogate
from tests.support.measuring import main, markdown, sections
from tests.support.places import ROOT

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
    with small_disk(folder, "16k") as disk:
        older = disk / "rough.nc"
        older.write_bytes(b"older")
        line = run(*build(older), code=1)
        assert "No space left on device" in line, line
        assert (files_in(disk), older.read_bytes()) == (["rough.nc"], b"older")
    return "one line; the older file stays, and there is no other"


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


def killed_builds(folder: Path, kills: int = 20) -> str:
    out, chance, finished = folder / "rough.nc", random.Random(7), 0  # noqa: S311
    begun = time.perf_counter()
    run(*build(out))
    whole, most = out.read_bytes(), time.perf_counter() - begun
    for _ in range(kills):
        out.write_bytes(whole)
        process = subprocess.Popen(
            [sys.executable, *build(out)], cwd=ROOT, env=ENVIRONMENT, stdout=-3, stderr=-3
        )
        with suppress(subprocess.TimeoutExpired):
            process.wait(timeout=chance.uniform(0.0, most))
            finished += 1
        process.kill()
        process.wait()
        assert files_in(folder) == ["rough.nc"], files_in(folder)
        Surrogate.open(out)
    return f"{kills - finished} killed, {finished} done before: a whole table, no other file"


FAULTS: dict[str, Callable[[Path], str]] = {
    "disk full while a build runs": full_disk_in_a_build,
    "SIGKILL of builds": killed_builds,
    "no permission to write": lost_permission,
}
QUICK = ["no permission to write"]


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

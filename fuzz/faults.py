"""Faults of disks, permissions, processes and clocks: no data are lost, and the same command resumes.

    python fuzz/faults.py [--only killed_builds] [--share 0.1] [--write]

Small disks are mounted as tmpfs and permissions are removed for another user; both need root.  A trial
that cannot be made on this machine is reported as "not tried".
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from benchmarks.measuring import ROOT, main, markdown

SMALLEST = ROOT / "tables" / "mumacro-1e-4.nc"
TOLERANCE = "1e-2"
NAMES = ("mu0", "Fz", "k", "y0", "omega", "v0")
AS_NOBODY = ("setpriv", "--reuid=12345", "--regid=12345", "--clear-groups")  # a user that owns nothing


# --- what the trials share ----------------------------------------------------------------------------


class NotTriedError(Exception):
    """A trial cannot be made here; the message says why."""


def run(*words: object, nobody: bool = False, code: int | None = 0, **environment: str) -> str:
    """Run a command of the project and return its last output: one line if it fails."""
    variables = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1", **environment}
    done = subprocess.run(
        [*(AS_NOBODY if nobody else ()), sys.executable, *map(str, words)], cwd=ROOT, env=variables,
        capture_output=True, text=True, timeout=1800, check=False,
    )  # fmt: skip
    assert "Traceback" not in done.stderr, done.stderr
    assert code is None or done.returncode == code, f"exit code {done.returncode}: {done.stderr or done.stdout}"
    lines = (done.stderr if done.returncode in (1, 2) else done.stdout).strip().splitlines()
    return lines[-1] if lines else ""


def build(out: Path) -> list[str]:
    """The arguments that build a coarse table."""
    return ["-m", "builder", "build", "--tolerance", TOLERANCE, "--out", str(out)]


def checksum(path: Path) -> str:
    """The checksum of the numbers in a table."""
    from mumacro import Surrogate

    return Surrogate.open(path).checksum


def cases(path: Path, n: int) -> Path:
    """A CSV file of random cases."""
    rng = np.random.default_rng(1)
    rows = 10.0 ** rng.uniform([-2, -1, 4, -8, 2, -5], [0, 3, 8, -4, 6, 1], (n, 6))
    path.write_text("\n".join([",".join(NAMES), *(",".join(map(repr, row)) for row in rows.tolist()), ""]))
    return path


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
    made = folder / "closed"
    made.mkdir(mode=0o755)
    return made


def left(folder: Path) -> list[str]:
    """The names of all files in a folder, hidden ones too."""
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


# --- full disks and lost permissions ------------------------------------------------------------------


def full_disk_in_a_build(folder: Path) -> str:
    with small_disk(folder, "96k") as disk:
        said = run(*build(disk / "rough.nc"), code=1)
        assert "No space left on device; give the same command again" in said, said
        assert not [name for name in left(disk) if name.endswith(".growing")], left(disk)
        kept = len(left(disk))
        subprocess.run(["mount", "-o", "remount,size=64m", str(disk)], check=True)
        run(*build(disk / "rough.nc"))
        assert left(disk) == ["rough.nc"]
        run(*build(folder / "whole.nc"))
        assert checksum(disk / "rough.nc") == checksum(folder / "whole.nc")
    return f"one line; {kept} finished parts kept; with more space the same command gives the same table"


def full_disk_in_writing_a_table(folder: Path) -> str:
    from mumacro import TableError
    from mumacro.table import read_table, write_table

    with small_disk(folder, "64k") as disk:
        (disk / "before.txt").write_text("kept")
        try:
            write_table(read_table(SMALLEST), disk / "new.nc")
        except TableError as error:
            assert error.reason == "cannot be written: No space left on device", error.reason
        else:
            raise AssertionError("a table of 126 kB was written to a disk of 64 kB")
        assert left(disk) == ["before.txt"]
    return "TableError; no file left"


def full_disk_in_eval(folder: Path, n: int = 100_000) -> str:
    source = cases(folder / "cases.csv", n)
    for kind in ("csv", "ndjson", "parquet"):
        run("-m", "mumacro", "eval", source, "-o", folder / f"whole.{kind}")
        with small_disk(folder, f"{n * 100 >> 10}k") as disk:
            words = ("-m", "mumacro", "eval", source, "-o", disk / f"out.{kind}")
            said = run(*words, code=1)
            assert "No space left on device" in said, said
            assert not (disk / f"out.{kind}").exists()
            subprocess.run(["mount", "-o", f"remount,size={n >> 9}m", str(disk)], check=True)
            run(*words)
            assert (disk / f"out.{kind}").read_bytes() == (folder / f"whole.{kind}").read_bytes()
            assert left(disk) == [f"out.{kind}", f"out.{kind}.run.json"]
        (folder / "disk").rmdir()
    return "one line; with more space the same command resumes and gives the same bytes; CSV, NDJSON, Parquet"


def lost_permission_in_a_build(folder: Path) -> str:
    said = run(*build(closed(folder) / "rough.nc"), nobody=True, code=1)
    assert "Permission denied" in said, said
    assert left(folder / "closed") == []
    return "one line; no file left"


def lost_permission_in_writing_a_table(folder: Path) -> str:
    out = closed(folder) / "new.nc"
    program = (
        "import sys, mumacro\nfrom mumacro.table import read_table, write_table\ntable = read_table(sys.argv[1])\n"
        "try:\n    write_table(table, sys.argv[2])\nexcept mumacro.TableError as error:\n    print(error.reason)"
    )
    said = run("-c", program, SMALLEST, out, nobody=True)
    assert said == "cannot be written: Permission denied", said
    assert left(folder / "closed") == []
    return "TableError; no file left"


def lost_permission_in_eval(folder: Path) -> str:
    source = cases(folder / "cases.csv", 100)
    said = run("-m", "mumacro", "eval", source, "-o", closed(folder) / "out.csv", nobody=True, code=1)
    assert "Permission denied" in said, said
    assert left(folder / "closed") == []
    return "one line; no file left"


# --- processes ----------------------------------------------------------------------------------------


def two_builds_to_one_output(folder: Path) -> str:
    out = folder / "rough.nc"
    variables = {**os.environ, "PYTHONPATH": str(ROOT)}
    words = [sys.executable, *build(out)]
    first = subprocess.Popen(words, cwd=ROOT, env=variables, stdout=-3, stderr=-3)
    while not list(folder.glob("rough.nc.checkpoint/*")):
        assert first.poll() is None
        time.sleep(0.01)
    said = run(*build(out), code=1)
    assert "another process is at work here" in said, said
    assert first.wait(timeout=1800) == 0
    run(*build(folder / "whole.nc"))
    assert checksum(out) == checksum(folder / "whole.nc")
    assert left(folder) == ["rough.nc", "whole.nc"]
    return "the second is refused with one line, the first completes"


def killed_eval(folder: Path, n: int = 400_000, kills: int = 10) -> str:
    source = cases(folder / "cases.csv", n)
    variables = {**os.environ, "PYTHONPATH": str(ROOT)}
    chance = random.Random(1)  # noqa: S311
    for kind in ("csv", "parquet"):
        words = ["-m", "mumacro", "eval", str(source), "-o"]
        run(*words, folder / f"whole.{kind}")
        out, log = folder / f"out.{kind}", folder / f"out.{kind}.parts" / "log"
        for _ in range(kills):
            command = [sys.executable, *words, str(out)]
            process = subprocess.Popen(command, cwd=ROOT, env=variables, stdout=-3, stderr=-3)
            before = log.stat().st_size if log.exists() else 0
            while process.poll() is None and (not log.exists() or log.stat().st_size <= before):
                time.sleep(0.002)
            time.sleep(chance.uniform(0.0, 0.03))
            process.kill()
            process.wait()
        run(*words, out)  # also where a kill came after the end
        assert out.read_bytes() == (folder / f"whole.{kind}").read_bytes()
        assert not list(folder.glob("*.parts"))
    return f"killed {kills} times each; then the same command gives the same bytes; CSV, Parquet"


# --- home, clock --------------------------------------------------------------------------------------

ASK = ("-m", "mumacro", "mu0=0.3 Fz=10 k=1e6 y0=2e-6 f=20690 v0=0.01", "--json", "--table", "1e-4")


def no_home(folder: Path) -> str:
    if os.getuid() != 0:
        raise NotTriedError("only root may run a trial as a user without a home")
    (folder / "tmp").mkdir(mode=0o777)
    (folder / "tmp").chmod(0o777)
    closed(folder)
    for home in ("", "/nonexistent"):
        said = run(*ASK, nobody=True, HOME=home, XDG_CACHE_HOME="", TMPDIR=str(folder / "tmp"))
        assert said == run(*ASK)
    assert left(folder / "tmp") == []
    return "the same answer; no file in a folder of temporary files"


def clock_steps(folder: Path) -> str:
    """Clock readings are off by up to ten years; file times are in the next century and in 1970."""
    (folder / "stepping").mkdir()
    (folder / "stepping" / "sitecustomize.py").write_text(
        "import random, time\nreal, chance = time.time, random.Random(1)\n"
        "time.time = lambda: real() + chance.uniform(-3e8, 3e8)\n"
    )
    source = cases(folder / "cases.csv", 3000)
    path = os.pathsep.join([str(folder / "stepping"), str(ROOT)])
    run("-m", "mumacro", "eval", source, "-o", folder / "whole.csv")
    for stamp in (0, 4_100_000_000):
        os.utime(source, (stamp, stamp))
        words = ("-m", "mumacro", "eval", source, "-o", folder / "out.csv", "--force")
        run(*words, PYTHONPATH=path)
        assert (folder / "out.csv").read_bytes() == (folder / "whole.csv").read_bytes()
    return "eval: the same bytes"


FAULTS: dict[str, Callable[..., str]] = {
    "disk full while a build runs": full_disk_in_a_build,
    "disk full while a table is written": full_disk_in_writing_a_table,
    "disk full while eval runs": full_disk_in_eval,
    "no permission to write a build": lost_permission_in_a_build,
    "no permission to write a table": lost_permission_in_writing_a_table,
    "no permission to write eval's output": lost_permission_in_eval,
    "two builds to one output": two_builds_to_one_output,
    "SIGKILL of eval": killed_eval,
    "no home, and an unwritable one": no_home,
    "a clock that steps": clock_steps,
}


def tried(fault: Callable[[Path], str]) -> tuple[str, str]:
    """Result of the trial ("held" if it passed), and what was seen."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            return "held", fault(Path(folder))
        except NotTriedError as reason:
            return "not tried", str(reason)
        except AssertionError as error:
            return "FAILED", " ".join(str(error).split())[:300]


def faults(share: float) -> str:  # noqa: ARG001 (every fault is tried once)
    """Every fault once."""
    rows = [[name, *tried(fault)] for name, fault in FAULTS.items()]
    return markdown(("fault", "result", "what was seen"), rows, 3)


def killed_builds(share: float, total: int = 20) -> str:
    """Builds that are killed at random moments and restarted until they are complete."""
    total = max(1, round(total * share))
    chance = random.Random(7)  # noqa: S311
    killed = resumed = 0
    variables = {**os.environ, "PYTHONPATH": str(ROOT)}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        begun = time.perf_counter()
        run(*build(folder / "whole.nc"))
        whole = time.perf_counter() - begun
        outs = [folder / "0.nc"]
        while killed < total:
            if outs[-1].exists():
                outs.append(folder / f"{len(outs)}.nc")
            resumed += bool(list(folder.glob(f"{outs[-1].name}.checkpoint/*.npy")))
            words = [sys.executable, *build(outs[-1])]
            process = subprocess.Popen(words, cwd=ROOT, env=variables, stdout=-3, stderr=-3)
            try:
                process.wait(timeout=chance.uniform(0.0, whole / 2.0))
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
                process.wait()
                killed += 1
        run(*build(outs[-1]))
        same = sum(checksum(out) == checksum(folder / "whole.nc") for out in outs)
        names = [out.name for out in (*outs, folder / "whole.nc")]
        rest = [name for name in left(folder) if name not in names]
    rows = [["builds killed, at random moments", f"{killed}"],
            ["starts that resumed from finished parts", f"{resumed}"],
            ["tables completed", f"{len(outs)}"],
            ["of them with the data of an undisturbed build", f"{same}"],
            ["other files left", f"{len(rest)}"]]  # fmt: skip
    return markdown(("", "count"), rows)


SECTIONS = {"faults": faults, "killed_builds": killed_builds}

if __name__ == "__main__":
    main(__doc__, SECTIONS, share=1.0)

"""Truncated, damaged and hostile table files are refused, or give the answers of the intact table.

    python fuzz/tables.py [--only damaged_tables] [--share 0.01] [--write]

Files are opened by other processes (``python fuzz/tables.py open``), which may use 256 MB more than they have after
opening the intact table; a process that crashes is a failure.
"""

import functools
import json
import os
import random
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.measuring import ROOT, main, markdown, sections
from fuzz.hostile_tables import HOSTILE, SMALLEST
from mumacro import Surrogate, TableError
from mumacro.table import parse_table

STEP = 256  # bytes between truncations
MORE = 256 * 2**20  # bytes of memory allowed for opening a file
PATIENCE = 3600.0  # seconds for one share of work

HEAD = ("the smallest table", "files", "refused", "same answers", "same answers, other texts",
        "other answers, or a crash", "slowest [s]", "memory [MB]")  # fmt: skip
CHANGES = {"cut": f"cut at every {STEP} bytes", "flip": "every byte in turn, some of its bits flipped"}
REFUSED, SAME, TEXTS, DIFFERS, ESCAPED, DIED = "refused", "same", "texts", "differs", "escaped", "died"


class Outcome(NamedTuple):
    """Result for a file: one of the words above, the message, processor time [s], memory [MB] beyond that of the
    intact table.
    """

    what: str
    said: str
    seconds: float
    megabytes: float


def work(start: int, count: int, change: str, stride: int = 1) -> Iterator[tuple[int, bytes]]:
    """Changed copies of the smallest table: at every ``stride``-th of ``count`` offsets from ``start``."""
    whole = SMALLEST.read_bytes()
    for offset in range(start, min(start + count, len(whole)), stride):
        if change == "cut":
            if offset % STEP == 0:
                yield offset, whole[:offset]
            continue
        changed = bytearray(whole)
        changed[offset] ^= random.Random(offset).randrange(1, 256)  # noqa: S311
        yield offset, bytes(changed)


def in_other_process(*arguments: object) -> list[Outcome]:
    """Results of the other process, one a line; the last is :data:`DIED` if it crashed."""
    command = [sys.executable, "-m", "fuzz.tables", "open", *map(str, arguments)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE, check=False)
    found = [Outcome(*json.loads(line)) for line in done.stdout.splitlines()]
    return found if done.returncode == 0 else [*found, Outcome(DIED, done.stderr[-300:], 0.0, 0.0)]


def ask(table: Surrogate) -> None:
    """Evaluate all quantities of a table over the whole range: any answer is allowed, but no crash."""
    v, y = np.meshgrid(*2 * [np.concatenate([[0.0, 5e-324, 1e300, np.inf], np.geomspace(1e-6, 1e6, 60)])])
    for quantity in ("mu_ratio", "power", "stick_fraction"):
        table.slopes(v, y, quantity, bounds=True)
    table.evaluate(mu0=0.3, Fz=10.0, k=1e6, y0=1e-5 * y, omega=1e3, v0=1e-2 * v, gradient=True)
    table.v_tilde_crit(y)


@functools.cache
def sound() -> Surrogate:
    """The smallest table, with all kernels loaded."""
    opened = Surrogate.open(SMALLEST)
    ask(opened)
    return opened


def outcome(image: bytes, path: Path, before: float = 0.0) -> Outcome:
    """Open one file; ``before`` is the memory [kB] that was used before."""
    expected = sound()
    started = time.process_time()
    try:
        table = parse_table(image, path)
        what, said = SAME, ""
        if table.attributes["content_sha256"] != expected.checksum:
            ask(Surrogate(table, path))
            what = DIFFERS
        elif table.attributes != expected.table.attributes:
            names = [n for n, value in expected.table.attributes.items() if table.attributes.get(n) != value]
            what, said = TEXTS, ", ".join(names)
    except TableError as error:
        what, said = REFUSED, error.reason
    except BaseException as error:  # any other exception is a failure
        what, said = ESCAPED, f"{type(error).__name__}: {error}"
    more = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    return Outcome(what, said[:300], time.process_time() - started, more / 1024.0)


def open_all(arguments: Sequence[str]) -> None:
    """Open the files under a memory limit."""
    sound()
    size = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (size + MORE, size + MORE))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    files: Any = ((path, Path(path).read_bytes()) for path in arguments)
    if arguments[0] in CHANGES:
        files = work(int(arguments[1]), int(arguments[2]), arguments[0], int(arguments[3]))
    for name, image in files:
        print(json.dumps(outcome(image, Path(str(name)), before)), flush=True)


def damaged(share: float, change: str) -> list[Outcome]:
    """Every copy of the smallest table with one change; if ``share`` is less than 1, bytes are skipped."""
    stride = 1 if change == "cut" else round(1.0 / share)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        starts = range(0, SMALLEST.stat().st_size, 4096)
        parts = pool.map(lambda start: in_other_process(change, start, 4096, stride), starts)
        return [one for outcomes in parts for one in outcomes]


def row(name: str, found: Sequence[Outcome]) -> list[str]:
    count = Counter(outcome.what for outcome in found)
    numbers = [len(found), *(count[what] for what in (REFUSED, SAME, TEXTS))]
    numbers.append(sum(count[what] for what in (DIFFERS, ESCAPED, DIED)))
    worst = max(outcome.seconds for outcome in found), max(outcome.megabytes for outcome in found)
    return [name, *(f"{n:,}" for n in numbers), f"{worst[0]:.2f}", f"{worst[1]:.0f}"]


def damaged_tables(share: float) -> str:
    rows = [row(name, damaged(share, change)) for change, name in CHANGES.items()]
    left_out = "" if share == 1.0 else f"One byte of {round(1.0 / share)} was tried, {share:.1%} of the full run. "
    return f"{markdown(HEAD, rows)}\n\n{left_out}Seconds are processor time."


def opened(folder: Path) -> list[Outcome]:
    """Of all crafted files; after a crash, a new process continues with the next file."""
    found: list[Outcome] = []
    paths = [folder / f"{i}.nc" for i in range(len(HOSTILE))]
    for path, make in zip(paths, HOSTILE.values(), strict=True):
        make(path)
    while len(found) < len(paths):
        found += in_other_process(*paths[len(found) :])
    return found


def hostile_tables(share: float) -> str:  # noqa: ARG001 (all of them)
    """Crafted files, opened by another process."""
    with tempfile.TemporaryDirectory() as folder:
        rows = [
            [name, one.what, one.said.replace("|", "/")[:90], f"{one.seconds:.2f}", f"{one.megabytes:.0f}"]
            for name, one in zip(HOSTILE, opened(Path(folder)), strict=True)
        ]
    return markdown(("content of the file", "result", "reason", "seconds", "memory so far [MB]"), rows, 3)


if __name__ == "__main__":
    if sys.argv[1:2] == ["open"]:
        open_all(sys.argv[2:])
    else:
        main(__doc__, sections(damaged_tables, hostile_tables), share=1.0)

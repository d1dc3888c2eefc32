"""Truncated, damaged and hostile table files are refused, or give the answers of the intact table.

    python fuzz/tables.py [--only damaged_tables] [--share 0.01] [--write]

Files are opened by other processes (``python fuzz/tables.py open``), which may use 256 MB more than
they have after opening the intact table; a process that crashes is a failure.
"""

import functools
import json
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from mumacro import Surrogate, TableError
from mumacro.table.atlas import BORDER_PIECES
from mumacro.table.blocks import Table
from mumacro.table.netcdf import parse_table, read_table, write_table
from mumacro.table.polynomials import nodes
from tests.support.measuring import main, markdown, sections
from tests.support.places import ROOT

SMALLEST = ROOT / "tables" / "mumacro-1e-4.nc"
STEP = 256  # bytes between truncations
MORE = 256 * 2**20  # bytes of memory allowed for opening a file
PATIENCE = 3600.0  # seconds for one share of work

HEAD = (
    "the smallest table",
    "files",
    "refused",
    "same answers",
    "same answers, other texts",
    "other answers, or a crash",
    "slowest [s]",
    "memory [MB]",
)
CHANGES = {
    "cut": f"cut at every {STEP} bytes",
    "flip": "every byte in turn, some of its bits flipped",
}
REFUSED, SAME, TEXTS, DIFFERS, ESCAPED, DIED = (
    "refused",
    "same",
    "texts",
    "differs",
    "escaped",
    "died",
)


class Outcome(NamedTuple):
    """Result for a file: one of the words above, the message, processor time [s], memory [MB]
    beyond that of the intact table.
    """

    what: str
    reason: str
    seconds: float
    megabytes: float


def work(start: int, count: int, change: str, stride: int = 1) -> Iterator[tuple[int, bytes]]:
    """Changed copies of the smallest table: at every ``stride``-th of ``count`` offsets from
    ``start``."""
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
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    outcomes = [Outcome(*json.loads(line)) for line in done.stdout.splitlines()]
    if done.returncode != 0:
        outcomes.append(Outcome(DIED, done.stderr[-300:], 0.0, 0.0))
    return outcomes


def ask(table: Surrogate) -> None:
    """Evaluate all quantities of a table over the whole range: any answer is allowed, but no
    crash."""
    v, y = np.meshgrid(
        *2 * [np.concatenate([[0.0, 5e-324, 1e300, np.inf], np.geomspace(1e-6, 1e6, 60)])]
    )
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
        what, reason = SAME, ""
        if table.attributes["content_sha256"] != expected.checksum:
            ask(Surrogate(table, path))
            what = DIFFERS
        elif names := [
            name
            for name, value in expected.table.attributes.items()
            if not np.array_equal(np.asarray(table.attributes.get(name)), np.asarray(value))
        ]:
            what, reason = TEXTS, ", ".join(names)
    except TableError as error:
        what, reason = REFUSED, error.reason
    except BaseException as error:  # any other exception is a failure
        what, reason = ESCAPED, f"{type(error).__name__}: {error}"
    more = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    return Outcome(what, reason[:300], time.process_time() - started, more / 1024.0)


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
    """Every copy of the smallest table with one change; if ``share`` is less than 1, bytes are
    skipped."""
    stride = 1 if change == "cut" else round(1.0 / share)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        starts = range(0, SMALLEST.stat().st_size, 4096)
        parts = pool.map(lambda start: in_other_process(change, start, 4096, stride), starts)
        return [one for outcomes in parts for one in outcomes]


def row(name: str, outcomes: Sequence[Outcome]) -> list[str]:
    count = Counter(outcome.what for outcome in outcomes)
    numbers = [len(outcomes), *(count[what] for what in (REFUSED, SAME, TEXTS))]
    numbers.append(sum(count[what] for what in (DIFFERS, ESCAPED, DIED)))
    worst = (
        max(outcome.seconds for outcome in outcomes),
        max(outcome.megabytes for outcome in outcomes),
    )
    return [name, *(f"{n:,}" for n in numbers), f"{worst[0]:.2f}", f"{worst[1]:.0f}"]


def damaged_tables(share: float) -> str:
    rows = [row(name, damaged(share, change)) for change, name in CHANGES.items()]
    note = (
        ""
        if share == 1.0
        else f"One byte of {round(1.0 / share)} was tried, {share:.1%} of the full run. "
    )
    return f"{markdown(HEAD, rows)}\n\n{note}Seconds are processor time."


# --- files made to harm the program that opens them: memory, time, stack, other files, wrong types
# -----------

Make = Callable[[Path], None]


def edited(change: Callable[[h5py.File], Any]) -> Make:
    """The smallest table, changed with the HDF5 library."""

    def make(path: Path) -> None:
        shutil.copy(SMALLEST, path)
        with h5py.File(path, "a") as file:
            change(file)

    return make


def signed(change: Callable[[Table], Any]) -> Make:
    """The smallest table with other numbers and a checksum that fits them."""

    def make(path: Path) -> None:
        table = read_table(SMALLEST)
        change(table)
        write_table(table, path)

    return make


def zeros(n: int) -> bytes:
    """``n`` zeros, a whole number of MiB, compressed: one compressed MiB repeated, and the checksum
    of all."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    block = packer.compress(bytes(2**20)) + packer.flush(zlib.Z_FULL_FLUSH)
    return (
        b"\x78\xda"
        + block * (n >> 20)
        + packer.flush()
        + ((n % 65521 << 16) + 1).to_bytes(4, "big")
    )


def replaced(file: h5py.File, name: str, packed: bytes, **options: Any) -> None:
    """Replace the variable of this name; its only chunk is written as the given bytes, if there are
    any."""
    del file[name]
    variable = file.create_dataset(name, dtype="f8", **options)
    if packed:
        variable.id.write_direct_chunk((0,) * variable.ndim, packed)


def many_nodes(table: Table) -> None:
    axis = BORDER_PIECES[0][1]
    table.border[0].nodes = nodes(20_000, axis.low, axis.high)
    table.border[0].values = np.full(20_000, table.border[0].values[0])


def many_cells(table: Table) -> None:
    for block in table.contacts["spring"].blocks:
        block.cells, block.cell_errors = (1000, 1000), {}


def huge_numbers(table: Table) -> None:
    for block in table.contacts["spring"].blocks:
        block.nodes["mu_ratio"][...] = 1.7e308
        block.nodes["power"][...] = -1.7e308


def shuffled(table: Table) -> None:
    for block in table.contacts["spring"].blocks:
        block.nodes["mu_ratio"] = (
            np.random.default_rng(1).normal(size=block.nodes["mu_ratio"].shape) * 1e100
        )


def deep(file: h5py.File) -> None:
    group = file
    for _ in range(3000):
        group = group.create_group("g")


def links(file: h5py.File, link: Any) -> None:
    del file["border/spring/corner"]
    file["border/spring/corner"] = link


def attribute(name: str, value: Any, group: str = "/") -> Make:
    return edited(lambda file: file[group].attrs.__setitem__(name, value))


def variable(name: str, packed: Callable[[], bytes] = bytes, **options: Any) -> Make:
    return edited(lambda file: replaced(file, name, packed(), **options))


ZEROS, TEN = (
    functools.partial(zeros, 2**31),
    {"shape": (10,), "chunks": (10,), "compression": "gzip"},
)
HOSTILE: dict[str, Make] = {
    "a group that contains itself": edited(
        lambda file: file.__setitem__("border/again", file["border"])
    ),
    "a group that contains the root": edited(
        lambda file: file.__setitem__("border/spring/root", file["/"])
    ),
    "3,000 nested groups": edited(deep),
    "3,000 groups among the blocks": edited(
        lambda file: [file.create_group(f"border/spring/g{i}") for i in range(3000)]
    ),
    "2 GB of zeros in a chunk of 2 GB": variable(
        "mu_ratio", ZEROS, **{**TEN, "maxshape": (None,), "chunks": (2**28,)}
    ),
    "2 GB of zeros in a chunk of 80 bytes": variable("v_tilde", ZEROS, **TEN),
    "2 GB of zeros, compressed twice": variable(
        "v_tilde", lambda: zlib.compress(ZEROS(), 9), **TEN
    ),
    "a variable of 160 GB without stored data": variable(
        "mu_ratio", shape=(2_000_000_000, 10), chunks=(1000, 10), compression="gzip"
    ),
    "a variable of 31 dimensions": variable("v_tilde", shape=(2,) * 31, chunks=(1,) * 31),
    "a variable in another file": variable(
        "v_tilde", shape=(31,), external=[("/dev/zero", 0, 31 * 8)]
    ),
    "a variable with another filter": variable(
        "v_tilde", shape=(31,), chunks=(31,), compression="lzf"
    ),
    "a grid of another shape": variable("mu_ratio", shape=(3, 3)),
    "a link to another file": edited(
        lambda file: links(file, h5py.ExternalLink(SMALLEST, "/border/spring/corner"))
    ),
    "a link to itself": edited(lambda file: links(file, h5py.SoftLink("/border/spring/corner"))),
    "a variable in place of a group": edited(lambda file: links(file, np.zeros(3))),
    "a type in place of a group": edited(lambda file: links(file, np.dtype("f8"))),
    "60 kB of text in an attribute": edited(
        lambda file: file.attrs.create(
            "many", np.array(["x" * 1000] * 60, dtype=object), dtype=h5py.string_dtype()
        )
    ),
    "50 attributes of 60 kB": edited(
        lambda file: [file.attrs.__setitem__(f"a{i}", "x" * 60_000) for i in range(50)]
    ),
    "5,000 attributes": edited(
        lambda file: [file.attrs.__setitem__(f"a{i}", i) for i in range(5000)]
    ),
    "a tolerance that is text": attribute("tolerance", "1e-4", "border/spring"),
    "a tolerance of three numbers": attribute("tolerance", np.zeros(3), "border/spring"),
    "a tolerance that is not finite": attribute("tolerance", np.nan, "border/ball"),
    "an error of interpolation that is text": attribute(
        "interpolation_error_linear_largest", "small"
    ),
    "a checksum of three numbers": attribute("content_sha256", np.zeros(3)),
    "an error that is text": attribute("verified_max_abs_error", "small", "border/ball"),
    "names of errors that are numbers": attribute(
        "verified_quantities", np.zeros(2), "border/ball"
    ),
    "shares of errors that are text": attribute("verified_quantiles", "half", "border/spring"),
    "options that are not JSON": attribute("builder_options", "{"),
    "options nested too deeply": attribute("builder_options", "[" * 60_000),
    "a version of two numbers": attribute("format_version", np.array([3, 3])),
    "cells of a compound type": attribute(
        "cells", np.zeros(1, [("a", "i4")]), "border/spring/corner"
    ),
    "errors that are complex": attribute("errors", np.zeros(9, complex), "border/spring/corner"),
    "text that is not UTF-8": attribute("title", np.bytes_(b"\xff\xfe")),
    "20,000 nodes, checksum right": signed(many_nodes),
    "12 million cells, checksum right": signed(many_cells),
    "numbers of 1.7e308, checksum right": signed(huge_numbers),
    "random numbers of 1e100, checksum right": signed(shuffled),
    "a border of 1e300, checksum right": signed(lambda table: table.border[1].values.fill(1e300)),
    "amplitudes of 1e300, checksum right": signed(
        lambda table: setattr(table, "y_tilde", table.y_tilde * 1e300)
    ),
    "errors of 1e308, checksum right": signed(
        lambda table: table.contacts["spring"].blocks[0].errors["mu_ratio"].fill(1e308)
    ),
}
#: a table with other numbers and a matching checksum is a different table; any answer is allowed
ANOTHER = {
    "numbers of 1.7e308, checksum right",
    "random numbers of 1e100, checksum right",
    "amplitudes of 1e300, checksum right",
    "errors of 1e308, checksum right",
}
#: what lies beside the parts that are read, is not read
HARMLESS = {
    "a group that contains itself",
    "a group that contains the root",
    "3,000 nested groups",
    "3,000 groups among the blocks",
}


def opened(folder: Path) -> list[Outcome]:
    """Of all crafted files; after a crash, a new process continues with the next file."""
    outcomes: list[Outcome] = []
    paths = [folder / f"{i}.nc" for i in range(len(HOSTILE))]
    for path, make in zip(paths, HOSTILE.values(), strict=True):
        make(path)
    while len(outcomes) < len(paths):
        outcomes += in_other_process(*paths[len(outcomes) :])
    return outcomes


def hostile_tables(share: float) -> str:  # noqa: ARG001 (all of them)
    """Crafted files, opened by another process."""
    with tempfile.TemporaryDirectory() as folder:
        rows = [
            [
                name,
                one.what,
                one.reason.replace("|", "/")[:90],
                f"{one.seconds:.2f}",
                f"{one.megabytes:.0f}",
            ]
            for name, one in zip(HOSTILE, opened(Path(folder)), strict=True)
        ]
    return markdown(
        ("content of the file", "result", "reason", "seconds", "memory so far [MB]"), rows, 3
    )


if __name__ == "__main__":
    if sys.argv[1:2] == ["open"]:
        open_all(sys.argv[2:])
    else:
        main(__doc__, sections(damaged_tables, hostile_tables), share=1.0)

#!/usr/bin/env python3
"""mumacro.h compared with the numba kernels: nanoseconds a point and distance in units of the last place, in one run.

    python benchmarks/c_header.py              print the tables of docs/c.md
    python benchmarks/c_header.py --write      write them into the page
    python benchmarks/c_header.py --quick      fewer points, one lookup table

Points are spread evenly in ln v~ and ln y~ over 1e-4 to 1e6 and 1e-3 to 1e7, in random order.  Distances are measured
on them and as many more around the border of continuous sliding and the corner; and once more without those within 1e-8
of the border, where rounding decides the side and the error is the root of a rounding error.
"""

from __future__ import annotations

import argparse
import ctypes
import importlib.util
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import measuring
import numpy as np
from mumacro.evaluate import answer, common_ratio
from mumacro.kernel_cache import kernel
from numpy.typing import NDArray

from builder.export import export_table
from mumacro import Surrogate
from mumacro.charts import CORNER, FAST, MU, OTHER

Array = NDArray[np.float64]
DRIVER = measuring.ROOT / "tests" / "c" / "driver.c"
PAGE = measuring.ROOT / "docs" / "c.md"
PLAIN = ("-O2", "-std=c99", "-ffp-contract=off")
SIDE = 1e-8  # of v~/v~crit - 1
FUSED = ("-O3", "-std=c99", "-march=native", "-ffp-contract=fast")


@kernel(beside=Path(__file__).parent)
def one_by_one(v: Array, y: Array, coef: Array, blocks: Array, border: Array, pieces: Array, out: Array) -> None:
    """The scalar kernels in a compiled loop, equivalent to the header."""
    for i in range(v.size):
        out[i], _, source = common_ratio(v[i], y[i], coef, blocks, border, pieces)
        if source in (CORNER, FAST, OTHER):
            out[i], _, _ = answer(MU, v[i], y[i], coef, blocks, border, pieces)


def compilers() -> Iterator[tuple[str, list[str]]]:
    for name in ("gcc", "clang"):
        if found := shutil.which(name):
            yield name, [found]
    if importlib.util.find_spec("ziglang") is not None:
        yield "zig cc", [sys.executable, "-m", "ziglang", "cc"]


def library(folder: Path, command: list[str], options: tuple[str, ...]) -> Any:
    out = folder / f"driver{len(list(folder.glob('*.so')))}.so"
    subprocess.run(
        [*command, *options, "-shared", "-fPIC", str(DRIVER), f"-I{folder}", "-o", str(out), "-lm"], check=True
    )
    return ctypes.CDLL(str(out))


def ratios(found: Any, v: Array, y: Array, out: Array) -> Callable[[], object]:
    pointers = [a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in (v, y, out)]
    return lambda: found.ratios(pointers[0], pointers[1], v.size, pointers[2])


def points(n: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(11)
    return 10.0 ** rng.uniform(-4.0, 6.0, n), 10.0 ** rng.uniform(-3.0, 7.0, n)


def hard_points(surrogate: Surrogate, n: int) -> tuple[Array, Array]:
    """Around the border, to the last digit, and around the corner y~ = 1, v~ = 0."""
    rng = np.random.default_rng(12)
    y = 10.0 ** np.where(rng.random(n) < 0.5, rng.uniform(-0.3, 0.3, n), rng.uniform(-6.0, 9.0, n))
    crit = np.asarray(surrogate.v_tilde_crit(y))
    off = rng.choice([-1.0, 1.0], n) * 10.0 ** rng.uniform(-16.0, -0.1, n)
    return crit * np.where(rng.random(n) < 0.5, 1.0 + off, 10.0 ** rng.uniform(-9.0, 3.0, n)), y


def table_of(tolerance: str, n: int, rounds: int) -> tuple[str, str]:
    path = measuring.ROOT / "tables" / f"mumacro-{tolerance}.nc"
    surrogate = Surrogate.open(path, threads=1)
    v, y = points(n)
    hard_v, hard_y = (np.concatenate(pair) for pair in zip((v, y), hard_points(surrogate, n), strict=True))
    expected = surrogate.mu_ratio(hard_v, hard_y)
    beside = np.abs(hard_v / np.asarray(surrogate.v_tilde_crit(hard_y)) - 1.0) > SIDE
    few = list(zip(v[:20_000].tolist(), y[:20_000].tolist(), strict=True))
    out = np.empty(n)
    data = surrogate._of(MU)
    work: dict[str, Callable[[], object]] = {
        "Python, arrays": lambda: surrogate.mu_ratio(v, y),
        "Python, compiled loop": lambda: one_by_one(v, y, *data, out),
        "Python, calls": lambda: [surrogate.mu_ratio(*at) for at in few],
    }
    distances: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        export_table(path, "c", folder / "mumacro.h")
        size = (folder / "mumacro.h").stat().st_size
        for compiler, command in compilers():
            for options in (PLAIN, FUSED):
                measuring.progress(f"{tolerance}: {compiler} {' '.join(options)}")
                made = library(folder, command, options)
                row = f"{compiler} {' '.join(options)}"
                work[row] = ratios(made, v, y, out)
                found = np.empty(2 * n)
                ratios(made, hard_v, hard_y, found)()
                same = found == expected
                ulp = np.where(same, 0.0, np.abs(found - expected) / np.spacing(np.abs(expected)))
                distances[row] = [
                    figure for some in (ulp, ulp[beside]) for figure in (np.mean(some > 4.0), np.max(some))
                ]
        timed = measuring.best_of(rounds, work, "processor")
    rows = []
    for name, seconds in timed.best.items():
        count = len(few) if name == "Python, calls" else n
        share, largest, share_beside, largest_beside = distances.get(name, [0.0] * 4)
        cells = [f"{share:.1e}".replace("0.0e+00", "0"), measuring.quantity(largest)]
        cells += [f"{share_beside:.1e}".replace("0.0e+00", "0"), measuring.quantity(largest_beside)]
        rows.append([f"`{name}`" if name in distances else name, measuring.quantity(1e9 * seconds / count), *cells])
    header = [
        "evaluator",
        "ns/point",
        "share beyond 4 ulp",
        "largest, ulp",
        "beyond 4, off the border",
        "largest there",
    ]
    text = f"Table of tolerance {tolerance}: {size / 1e3:,.0f} kB of header, {2 * n:,} points compared.\n\n"
    return text + measuring.markdown(header, rows), timed.note()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--rounds", type=int, default=7)
    chosen = parser.parse_args()
    n, tolerances = (20_000, ["1e-4"]) if chosen.quick else (500_000, ["1e-4", "1e-7", "1e-10"])
    parts, note = [], ""
    for tolerance in tolerances:
        text, note = table_of(tolerance, n, chosen.rounds)
        parts.append(text)
    page = "\n\n".join([*parts, measuring.machine() + " " + note])
    print(page)
    if chosen.write:
        measuring.write_section("c_header", page, PAGE)


if __name__ == "__main__":
    main()

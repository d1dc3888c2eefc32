"""What it takes to evaluate one polynomial patch: vector code, scalar rows, one plain Horner chain after another.

    python benchmarks/kernel.py [--rounds 9] [--quick] [--write]

One thread, processor time, random patches of a set as large as that of a fine table.  Prints times and their ratios;
``--write`` puts them into docs/decisions/0003-vector-patch.md.
"""

from __future__ import annotations

import measuring  # isort: split

import argparse
import math
from collections.abc import Callable
from functools import partial

import numpy as np
from measuring import best_of, markdown, quantity
from numba import njit
from numpy.typing import NDArray

from friction.kernels import WIDTH
from friction.outer import FUSE
from friction.patch_simd import patch_value
from friction.patches import aligned
from friction.table import read_table

Array = NDArray[np.float64]
PAGE = measuring.ROOT / "docs" / "decisions" / "0003-vector-patch.md"
TABLES = ("mumacro-1e-10", "mumacro-1e-12")


@njit(error_model="numpy", nogil=True, fastmath=FUSE)
def vector(coef: Array, p: NDArray[np.int64], u: Array, w: Array, out: Array) -> None:
    """Eight lanes, written out."""
    for i in range(p.size):
        out[i] = patch_value(coef, p[i], u[i], w[i])


@njit(error_model="numpy", nogil=True, fastmath=FUSE)
def rows(coef: Array, p: NDArray[np.int64], u: Array, w: Array, out: Array) -> None:
    """Eight sums in w side by side, as scalars that the compiler could make one vector of."""
    for i in range(p.size):
        c, x = coef[p[i]], w[i]
        a0, a1, a2, a3, a4, a5, a6, a7 = c[0, 0], c[0, 1], c[0, 2], c[0, 3], c[0, 4], c[0, 5], c[0, 6], c[0, 7]
        for k in range(1, WIDTH):
            a0, a1, a2, a3 = a0 * x + c[k, 0], a1 * x + c[k, 1], a2 * x + c[k, 2], a3 * x + c[k, 3]
            a4, a5, a6, a7 = a4 * x + c[k, 4], a5 * x + c[k, 5], a6 * x + c[k, 6], a7 * x + c[k, 7]
        t = u[i]
        out[i] = ((((((a0 * t + a1) * t + a2) * t + a3) * t + a4) * t + a5) * t + a6) * t + a7


@njit(error_model="numpy", nogil=True, fastmath=FUSE)
def plain(coef: Array, p: NDArray[np.int64], u: Array, w: Array, out: Array) -> None:
    """Horner in u over Horner in w, as in a textbook."""
    for i in range(p.size):
        total = 0.0
        for j in range(WIDTH):
            inner = coef[p[i], 0, j]
            for k in range(1, WIDTH):
                inner = inner * w[i] + coef[p[i], k, j]
            total = total * u[i] + inner
        out[i] = total


LOOPS: dict[str, Callable[..., None]] = {"vector": vector, "rows": rows, "plain": plain}


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--quick", action="store_true", help="few points, one round")
    parser.add_argument("--write", action="store_true", help="put the table into the decision")
    given = parser.parse_args()
    if given.quick and given.write:
        parser.error("--quick measures nothing worth writing down")
    if given.rounds < 1:
        parser.error("--rounds must be at least 1")
    points, rounds = (10_000, 1) if given.quick else (1_000_000, given.rounds)
    rng = np.random.default_rng(1)
    u, w = rng.uniform(-1.0, 1.0, points), rng.uniform(-1.0, 1.0, points)
    lines = []
    for name in TABLES:
        blocks = read_table(measuring.ROOT / "tables" / f"{name}.nc").blocks
        patches = sum(math.prod(block.cells) for block in blocks)
        coef = aligned(patches, WIDTH, WIDTH)
        coef[...] = rng.standard_normal(coef.shape)
        p = rng.integers(0, patches, points)
        answers = {key: np.empty(points) for key in LOOPS}
        work = {key: partial(loop, coef, p, u, w, answers[key]) for key, loop in LOOPS.items()}
        timed = best_of(rounds, work, "processor")
        apart = max(float(np.abs(a - answers["plain"]).max()) for a in answers.values())
        ns = {key: 1e9 * seconds / points for key, seconds in timed.best.items()}
        cells = [quantity(ns[key]) for key in LOOPS]
        cells += [quantity(ns["rows"] / ns["vector"]), quantity(ns["plain"] / ns["vector"]), quantity(apart)]
        lines.append([f"{patches:,}, as many as {name} has", *cells])
    header = (
        "patches",
        "vector, ns",
        "scalar rows, ns",
        "plain Horner, ns",
        "rows / vector",
        "plain / vector",
        "apart",
    )
    text = measuring.machine("llvmlite") + "\n\n" + markdown(header, lines)
    print(text)
    if given.write:
        measuring.write_section("kernel", text, PAGE)


if __name__ == "__main__":
    main()

"""What it takes to evaluate one polynomial patch: vector code, scalar rows, one plain Horner chain after another.

    python benchmarks/kernel.py [--points 1000000] [--rounds 9] [--write]

One thread, processor time, random patches of a set as large as that of a fine table.  Prints times and their ratios;
``--write`` puts them into docs/decisions/0003-vector-patch.md.
"""

from __future__ import annotations

import measuring  # isort: split

import argparse
from typing import Any

import numpy as np
from measuring import best_of, markdown, quantity
from numba import njit
from numpy.typing import NDArray

from friction.kernels import FUSE, WIDTH
from friction.patch_simd import patch_value

Array = NDArray[np.float64]
PAGE = measuring.ROOT / "docs" / "decisions" / "0003-vector-patch.md"
BEGIN, END = "<!-- begin kernel -->\n", "<!-- end kernel -->"
PATCHES = {"as many as mumacro-1e-10 has": 1004, "as many as mumacro-1e-12 has": 3150}
OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "fastmath": FUSE}


@njit(**OPTIONS)
def vector(coef: Array, p: NDArray[np.int64], u: Array, w: Array, out: Array) -> None:
    """Eight lanes, written out."""
    for i in range(p.size):
        out[i] = patch_value(coef, p[i], u[i], w[i])


@njit(**OPTIONS)
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


@njit(**OPTIONS)
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


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--write", action="store_true", help="put the table into the decision")
    given = parser.parse_args()
    if given.points < 1 or given.rounds < 1:
        parser.error("--points and --rounds must be at least 1")
    rng = np.random.default_rng(1)
    u, w = rng.uniform(-1.0, 1.0, given.points), rng.uniform(-1.0, 1.0, given.points)
    lines = []
    for name, patches in PATCHES.items():
        coef = rng.standard_normal((patches, WIDTH, WIDTH))
        p = rng.integers(0, patches, given.points)
        answers = {f.__name__: np.empty(given.points) for f in (vector, rows, plain)}
        work = {
            f.__name__: (lambda f=f: f(coef, p, u, w, answers[f.__name__]))  # noqa: B023 (called inside this round)
            for f in (vector, rows, plain)
        }
        timed = best_of(given.rounds, work, "processor")
        apart = max(float(np.abs(a - answers["plain"]).max()) for a in answers.values())
        ns = {key: 1e9 * seconds / given.points for key, seconds in timed.best.items()}
        cells = [quantity(ns[key]) for key in ("vector", "rows", "plain")]
        cells += [quantity(ns["rows"] / ns["vector"]), quantity(ns["plain"] / ns["vector"]), quantity(apart)]
        lines.append([f"{patches:,}, {name}", *cells])
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
        page = PAGE.read_text(encoding="utf-8")
        if page.count(BEGIN) != 1 or page.count(END) != 1:
            parser.error(f"{PAGE} must hold {BEGIN.strip()!r} and {END!r} once each")
        before, _, rest = page.partition(BEGIN)
        PAGE.write_text(f"{before}{BEGIN}\n{text}\n\n{END}{rest.partition(END)[2]}", encoding="utf-8")


if __name__ == "__main__":
    main()

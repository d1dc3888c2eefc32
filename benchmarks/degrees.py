"""Cells of other degrees, another basis, other coordinates, other loops: what they would need and what they would take.

    python benchmarks/degrees.py [--rounds 9] [--quick] [--write]

For every committed table: cells, bytes and time for degree 5 to 11; Chebyshev polynomials and gathered coefficients in
place of powers in rows; exponent and mantissa, or the library's logarithm, in place of arithmetic; one point after
another in place of passes.  Log-uniform random points over v~, y~ in [1e-3, 1e3], one thread, processor time.
``--write`` puts the tables into docs/decisions/0012-degree-and-coordinates.md.
"""

from __future__ import annotations

import measuring  # isort: split

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from cutting import LOGARITHMS, Data, cut_table, plain_counts
from measuring import best_of, markdown, progress, quantity
from numba import njit
from numpy.typing import NDArray
from pass_variants import bits, library_log, passes, places, point_by_point
from patch_codes import LANES, chebyshev_code, gathering_code, power_code

from builder.sweep import Sweep
from friction import Surrogate
from friction.kernels import WIDTH
from friction.outer import FUSE
from friction.regions import BLOCKS, BORDER_PIECES

Array = NDArray[np.float64]
PAGE = measuring.ROOT / "docs" / "decisions" / "0012-degree-and-coordinates.md"
#: degrees along a and b; the columns of a patch are powers of a, and stand side by side in a vector
DEGREES = ((5, 5), (7, 5), (7, 7), (7, 9), (7, 11), (9, 9), (11, 11))
OWN = (WIDTH - 1, WIDTH - 1)
QUICK = ((5, 5), OWN, (11, 11))
SECTION = "degrees"


def shape_of(degrees: tuple[int, int]) -> tuple[int, int]:
    """Rows and columns of a patch."""
    return degrees[1] + 1, degrees[0] + 1


def each(code: Any) -> Callable[..., None]:
    """A loop over patches."""

    @njit(error_model="numpy", nogil=True, fastmath=FUSE)
    def run(coef: Array, p: NDArray[np.int64], u: Array, w: Array, out: Array) -> None:
        for i in range(p.size):
            out[i] = code(coef, p[i], u[i], w[i])

    return run


def eight_at_a_time(code: Any) -> Callable[..., None]:
    """A loop over groups of points; what is left of the last group is not evaluated."""

    @njit(error_model="numpy", nogil=True, fastmath=FUSE)
    def run(coef: Array, p: NDArray[np.int64], u: Array, w: Array, out: Array) -> None:
        for i in range(0, p.size - LANES + 1, LANES):
            code(coef, p, u, w, out, i)

    return run


@dataclass
class Tools:
    """Everything compiled, once for all tables."""

    loops: dict[tuple[int, int], Callable[..., None]]
    passes: dict[tuple[int, int], Callable[..., None]]
    chebyshev: Callable[..., None]
    gathering: Callable[..., None]
    library: Callable[..., None]
    bits: Callable[..., None]


def compiled(wanted: Sequence[tuple[int, int]]) -> Tools:
    """Compile every loop; they run first where they do not count."""
    codes = {degrees: power_code(*shape_of(degrees)) for degrees in wanted}
    return Tools(
        {degrees: each(code) for degrees, code in codes.items()},
        {degrees: passes() if degrees == OWN else passes(patch_value=code) for degrees, code in codes.items()},
        each(chebyshev_code()),
        eight_at_a_time(gathering_code(WIDTH)),
        passes(log=library_log),
        passes(log=bits),
    )


def exact_sums(coef: Array, p: NDArray[np.int64], u: Array, w: Array) -> Array:
    """Chebyshev polynomials with ``coef`` summed in the longest floating-point format there is."""

    def polynomials(x: Array) -> Any:
        t = np.ones((coef.shape[1], x.size), dtype=np.longdouble)
        t[1] = x
        for k in range(2, coef.shape[1]):
            t[k] = 2.0 * t[1] * t[k - 1] - t[k - 2]
        return t

    out: Array = np.einsum("kn,nkj,jn->n", polynomials(w), coef[p].astype(np.longdouble), polynomials(u))
    return out


class Rows:
    """The tables as they grow."""

    def __init__(self, tools: Tools, points: int, solves: int, rounds: int) -> None:
        rng = np.random.default_rng(10)
        self.tools, self.rounds = tools, rounds
        self.v, self.y = 10.0 ** rng.uniform(-3.0, 3.0, points), 10.0 ** rng.uniform(-3.0, 3.0, points)
        self.few = slice(0, solves)
        with Sweep() as sweep:
            self.truth = sweep.solve("full", self.v[self.few], self.y[self.few])["mu_ratio"]
        self.degrees: list[list[str]] = []
        self.bases: list[list[str]] = []
        self.loops: list[list[str]] = []
        self.cells: dict[str, list[str]] = {}

    def add(self, surrogate: Surrogate) -> None:
        """All rows of one table."""
        progress(surrogate.id)
        degrees = list(self.tools.loops)
        tables = {key: cut_table(surrogate, shape_of(key)) for key in degrees}
        by_bits, shapes, border = cut_table(surrogate, by_bits=True)
        together = cut_table(surrogate, together=True)[0]
        in_chebyshev = cut_table(surrogate, basis="chebyshev")[0][0]
        work: dict[str, Callable[[], object]] = {}
        spots = {key: self._spots(tables[key][0]) for key in degrees}
        values = {key: np.empty(spots[key][0].size) for key in degrees}
        answers = {key: np.empty(self.v.size) for key in degrees}
        for key in degrees:
            data = tables[key][0]
            work[f"patch {key}"] = self._call(self.tools.loops[key], data[0], *spots[key], values[key])
            work[f"point {key}"] = self._call(self.tools.passes[key], self.v, self.y, *data, answers[key])
        own, at, value = tables[OWN][0], spots[OWN], values[OWN]
        other = {name: np.empty(value.size) for name in ("chebyshev", "gathering")}
        work["chebyshev"] = self._call(self.tools.chebyshev, in_chebyshev, *at, other["chebyshev"])
        work["gathering"] = self._call(self.tools.gathering, own[0], *at, other["gathering"])
        mu = {name: np.empty(self.v.size) for name in ("library", "bits", "together", "one by one")}
        work["library"] = self._call(self.tools.library, self.v, self.y, *own, mu["library"])
        work["bits"] = self._call(self.tools.bits, self.v, self.y, *by_bits, mu["bits"])
        work["together"] = self._call(self.tools.passes[OWN], self.v, self.y, *together, mu["together"])
        work["one by one"] = self._call(point_by_point, self.v, self.y, *own, mu["one by one"])
        best = best_of(self.rounds, work, "processor").best
        for key in degrees:
            data = tables[key][0]
            self.degrees.append([
                surrogate.id, str(key[0]), str(key[1]), f"{data[0].shape[0]:,}", f"{sum(a.nbytes for a in data):,}",
                quantity(1e9 * best[f"patch {key}"] / values[key].size, 3),
                quantity(1e9 * best[f"point {key}"] / self.v.size, 3),
                quantity(self._error(answers[key])),
            ])  # fmt: skip
        exact = exact_sums(in_chebyshev, at[0][self.few], at[1][self.few], at[2][self.few])
        some = slice(0, min(exact.size, value.size // LANES * LANES))
        for name, timed, found in (
            ("powers, eight rows of a patch", f"patch {OWN}", value),
            ("Chebyshev, eight rows of a patch", "chebyshev", other["chebyshev"]),
            ("powers, gathered for eight points", "gathering", other["gathering"]),
        ):
            off = float(np.abs(found[some] - exact[some]).max())
            self.bases.append([surrogate.id, name, quantity(1e9 * best[timed] / value.size, 3), quantity(off)])
        for name, timed, data, found in (
            ("passes, logarithm by arithmetic", f"point {OWN}", own, answers[OWN]),
            ("passes, the library's logarithm", "library", own, mu["library"]),
            ("passes, exponent and mantissa", "bits", by_bits, mu["bits"]),
            ("passes, cells of both axes chosen together", "together", together, mu["together"]),
            ("one point after another", "one by one", own, mu["one by one"]),
        ):
            self.loops.append([
                surrogate.id, name, f"{data[0].shape[0]:,}", f"{sum(a.nbytes for a in data):,}",
                quantity(1e9 * best[timed] / self.v.size, 3), quantity(self._error(found)),
            ])  # fmt: skip
        self._count(surrogate, tables[OWN][1:], (shapes, border))

    def _count(self, surrogate: Surrogate, own: Any, by_bits: Any) -> None:
        for (name, coordinate, _, _), log, bit in zip(BORDER_PIECES, own[1], by_bits[1], strict=True):
            if coordinate in LOGARITHMS:
                self.cells.setdefault(f"border, {name}", []).append(f"{log} / {bit} / -")
        for spec, block, log, bit in zip(BLOCKS, surrogate.table.blocks, own[0], by_bits[0], strict=True):
            plain = plain_counts(surrogate, spec, block) if spec.quantity == "hypotenuse" else None
            for axis, coordinate in enumerate((spec.a_name, spec.b_name)):
                if coordinate in LOGARITHMS:
                    row = self.cells.setdefault(f"{spec.name}, {coordinate}", [])
                    row.append(f"{log[axis]} / {bit[axis]} / {plain[axis] if plain else '-'}")

    def _spots(self, data: Data) -> tuple[NDArray[np.int64], Array, Array]:
        patch, u, w = np.empty(self.v.size, np.int64), np.empty(self.v.size), np.empty(self.v.size)
        n = places(self.v, self.y, *data[1:], patch, u, w)
        return patch[:n], u[:n], w[:n]

    def _error(self, mu: Array) -> float:
        return float(np.abs(mu[self.few] - self.truth).max())

    @staticmethod
    def _call(function: Callable[..., object], *arguments: Any) -> Callable[[], object]:
        return lambda: function(*arguments)


def text_of(rows: Rows, names: list[str]) -> str:
    """The section as it stands on the page."""
    per_degree = ("table", "degree, a", "degree, b", "cells", "bytes", "ns a patch", "ns a point", "max abs error")
    per_basis = ("table", f"patches of degree {WIDTH - 1}", "ns a patch", "rounding")
    per_loop = ("table", "loop", "cells", "bytes", "ns a point", "max abs error")
    return "\n\n".join([
        measuring.machine("llvmlite"),
        f"{rows.v.size:,} points, best of {rounds_text(rows.rounds)}; errors on {rows.truth.size:,} fresh solves.",
        "Cells of other degrees along the two coordinates of a block, in powers:",
        markdown(per_degree, rows.degrees),
        "Other ways to evaluate the same patches; rounding is the largest distance from a sum in extended precision:",
        markdown(per_basis, rows.bases, 2),
        "Other ways through the passes:",
        markdown(per_loop, rows.loops, 2),
        "Cells along each logarithmic axis: with the logarithm / with exponent and mantissa / with the logarithm, and"
        " mu~ itself in place of a quotient:",
        markdown(("axis", *names), [[name, *cells] for name, cells in rows.cells.items()]),
    ])  # fmt: skip


def rounds_text(rounds: int) -> str:
    """How often."""
    return f"{rounds} interleaved round{'s' if rounds > 1 else ''}"


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--quick", action="store_true", help="few points, degrees and tables, one round")
    parser.add_argument("--write", action="store_true", help="put the tables into the decision")
    given = parser.parse_args()
    if given.quick and given.write:
        parser.error("--quick measures nothing worth writing down")
    if given.rounds < 1:
        parser.error("--rounds must be at least 1")
    rows = Rows(
        compiled(QUICK if given.quick else DEGREES),
        *((20_000, 1000, 1) if given.quick else (1_000_000, 20_000, given.rounds)),
    )
    opened = [Surrogate.open(path) for path in (measuring.ROOT / "tables").glob("*.nc")]
    opened.sort(key=lambda surrogate: -surrogate.tolerance)
    if given.quick:
        opened = opened[:2]
    for surrogate in opened:
        rows.add(surrogate)
    text = text_of(rows, [surrogate.id for surrogate in opened])
    print(text)
    if given.write:
        measuring.write_section(SECTION, text, PAGE)


if __name__ == "__main__":
    main()

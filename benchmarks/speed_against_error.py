"""Speed against error: the committed tables and their peers, on the same points in one run.

    python benchmarks/speed_against_error.py [--points 1000000] [--quick] [--write]

Points are log-uniform over v~, y~ in [1e-3, 1e3].  Times are of one thread, best of interleaved rounds; errors are
against fresh solves.  A full run draws build/results/speed_against_error.png.
"""

from benchmarks.measuring import RESULTS, ROOT, best_of, main, markdown, progress, quantity  # isort: split

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from benchmarks import peers
from benchmarks.peers import Contender
from builder.sweep import Sweep, solve_chunk
from mumacro import Surrogate, closed_forms

Array = NDArray[np.float64]
OURS, PEER, EXACT = "ours", "peer", "exact"
FULL_GRIDS, QUICK_GRIDS = (64, 256, 1024), (24, 48)
HEADER = ("method", "data", "ns/point", "max abs error", "99 % abs error", "bytes", "solves")


class Row(NamedTuple):
    """One line of the table; times in ns a point, errors of mu~ [-], NaN if not applicable."""

    kind: str
    method: Contender
    ns: float
    max_abs: float = math.nan
    p99_abs: float = math.nan

    def cells(self) -> list[str]:
        name = self.method.name
        numbers = [quantity(x) if x == x else "-" for x in (self.ns, self.max_abs, self.p99_abs)]
        counts = [f"{n:,}" if n else "-" for n in (self.method.bytes, self.method.solves)]
        return [f"**{name}**" if self.kind == OURS else name, self.method.size, *numbers, *counts]


def draw(n: int, seed: int) -> Array:
    low, high = np.log(peers.SQUARE)
    return np.exp(np.random.default_rng(seed).uniform(low, high, (2, n)))


def tables() -> list[Surrogate]:
    opened = [Surrogate.open(path, threads=1) for path in (ROOT / "tables").glob("*.nc")]
    return sorted(opened, key=lambda s: -s.tolerance)


def contenders(sweep: Sweep, quick: bool) -> list[tuple[str, Contender]]:
    found = []
    for s in tables():
        solves = int(s.table.attributes["n_solves"])
        found.append((OURS, Contender(s.id, "border-fitted blocks", s.mu_ratio, s.memory, solves)))
    for n in QUICK_GRIDS if quick else FULL_GRIDS:
        progress(f"grid {n} x {n}")
        found += [(PEER, c) for c in peers.on_grid(peers.solve_grid(sweep, n))]
        found.append((PEER, peers.fitted_to_the_border(sweep, n // 2)))
    found.append((PEER, Contender("eq. (35), rigid contact", "formula", lambda v, y: closed_forms.outer(y / v), 0, 0)))
    return found


def compare(points: int, quick: bool, rounds: int) -> list[Row]:
    """All rows: the tables, the peers, the formula, the solvers."""
    v, y = draw(points, seed=1)
    v_true, y_true = draw(2_000 if quick else 100_000, seed=2)
    with Sweep(1, checkpoint=peers.cache()) as sweep:
        progress("fresh solves")
        truth = sweep.solve("full", v_true, y_true)["mu_ratio"]
        entries = contenders(sweep, quick)
    work: dict[str, Callable[[], object]] = {str(i): partial(c.evaluate, v, y) for i, (_, c) in enumerate(entries)}
    direct = np.stack([v, y, y - 1.0], axis=1)[: 500 if quick else 10_000]
    work["direct"] = lambda: solve_chunk("full", direct)
    progress(f"{rounds} rounds of {len(work)} contenders")
    best = best_of(rounds, work)
    rows: list[Row] = []
    for i, (kind, c) in enumerate(entries):
        error = np.abs(c.evaluate(v_true, y_true) - truth)
        ns = best[str(i)] / points * 1e9
        rows.append(Row(kind, c, ns, float(error.max()), float(np.quantile(error, 0.99))))
    solver = Contender("direct solve of the full model", "compiled", lambda v, _: v, 0, 0)
    rows.append(Row(EXACT, solver, best["direct"] / len(direct) * 1e9))
    return rows


def speed_against_error(points: int, rounds: int, quick: bool) -> str:
    points = 20_000 if quick else points
    numba.set_num_threads(1)
    rows = compare(points, quick, rounds)
    if not quick:
        plot(rows, RESULTS / "speed_against_error.png")
    text = f"{points:,} log-uniform random points over v~, y~ in [1e-3, 1e3]; one thread, best of {rounds} rounds, "
    text += "processor time. Errors of mu~ are against fresh solves. Bytes are those of the data in memory."
    return f"{text}\n\n{markdown(HEADER, [row.cells() for row in rows], 2)}"


def plot(rows: list[Row], path: Path) -> None:
    """The picture of all rows: ns a point against the largest error, one line a method."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.5, 5.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot(xscale="log", yscale="log", ylabel="ns per point, one thread")
    axes.set_xlabel(r"largest error of $\tilde\mu$ over $\tilde v$, $\tilde y$ from 0.001 to 1000")
    colors = iter(("#c1272d", "#1f5fa8", "#2a8c8c", "#8a8a8a", "#b07aa1", "#e08214", "#222222"))
    shown = [row for row in rows if row.max_abs == row.max_abs]
    for name in dict.fromkeys("our tables" if row.kind == OURS else row.method.name for row in shown):
        line = [row for row in shown if name == ("our tables" if row.kind == OURS else row.method.name)]
        width = 2.2 if line[0].kind == OURS else 1.0
        x, y = [row.max_abs for row in line], [row.ns for row in line]
        axes.plot(x, y, "o-", label=name, color=next(colors), lw=width)
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_yticks([10, 20, 50, 100, 200, 500, 1000], minor=False)
    axes.minorticks_off()
    axes.grid(color="#e4e4e4")
    axes.legend(fontsize=9, loc="upper left")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100, metadata={"Software": None})


if __name__ == "__main__":
    main(__doc__, {"speed_against_error": speed_against_error}, points=1_000_000, rounds=5, quick=False)

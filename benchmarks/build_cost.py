"""Cost of a table: solves, seconds, bytes and verified error for every tolerance, compared with plain grids.

    python benchmarks/build_cost.py [--workers 2] [--quick] [--write]

Tables are built in a temporary folder and deleted.  ``--write`` writes the table and the plot to docs/.
"""

from __future__ import annotations

import measuring  # isort: split

import argparse
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import matplotlib
import numpy as np
import peers
from measuring import markdown, progress, quantity
from scipy.interpolate import RectBivariateSpline

from builder.assemble import MAX_TOLERANCE, build_table
from builder.sweep import Sweep
from mumacro import charts

matplotlib.use("Agg")
import matplotlib.pyplot as plt

TOLERANCES = tuple(10.0**-e for e in range(3, 13))
RED, BLUE, INK, PALE = "#c1272d", "#1f5fa8", "#222222", "#e4e4e4"
HEADER = (
    "tolerance", "solves, nodes", "solves, all", "seconds", "file, bytes", "in memory, bytes",
    "verified max abs error", "verified max rel error",
)  # fmt: skip


@dataclass(frozen=True)
class Built:
    """One table: its cost and its verified error."""

    tolerance: float
    nodes: int
    solves: int
    seconds: float
    file: int
    memory: int
    max_abs: float
    max_rel: float

    def cells(self) -> list[str]:
        """The line as text."""
        numbers = [
            f"{self.nodes:,}",
            f"{self.solves:,}",
            quantity(self.seconds, 3),
            f"{self.file:,}",
            f"{self.memory:,}",
        ]
        return [f"{self.tolerance:.0e}", *numbers, quantity(self.max_abs), quantity(self.max_rel)]


@dataclass(frozen=True)
class Plain:
    """A cubic spline on a plain log-log grid of n x n nodes and its largest error over the square."""

    n: int
    max_abs: float
    max_rel: float


def build(tolerance: float, workers: int, folder: Path) -> Built:
    """Build one table from scratch and measure it."""
    names = {chart.name for chart in charts.CHARTS}
    nodes = 0
    path = folder / f"{tolerance:.0e}.nc"
    start = perf_counter()
    with Sweep(workers) as sweep:

        def stage(text: str, done: bool) -> None:
            nonlocal nodes
            if done and text in names:
                nodes = sweep.n_solves

        surrogate = build_table(path, tolerance, sweep, stage)
        solves = sweep.n_solves
    seconds = perf_counter() - start
    errors = (surrogate.max_abs_error, surrogate.max_rel_error)
    return Built(tolerance, nodes, solves, seconds, path.stat().st_size, surrogate.memory, *errors)


def plain(sizes: tuple[int, ...], points: int) -> list[Plain]:
    """Cubic splines on plain grids, against fresh solves over the square."""
    rng = np.random.default_rng(2)
    low, high = np.log(peers.SQUARE)
    a, b = rng.uniform(low, high, points), rng.uniform(low, high, points)
    found = []
    with Sweep(1, checkpoint=peers.cache()) as sweep:
        truth = sweep.solve("full", np.exp(a), np.exp(b))["mu_ratio"]
        for n in sizes:
            progress(f"plain grid {n} x {n}")
            axis = np.log(peers.grid_axis(n))
            error = np.abs(RectBivariateSpline(axis, axis, peers.solve_grid(sweep, n)).ev(a, b) - truth)
            found.append(Plain(n, float(error.max()), float((error / truth).max())))
    return found


def plot(tables: list[Built], grids: list[Plain], path: Path) -> None:
    """Solves and bytes against the verified error, for these tables and plain grids."""
    plt.rcParams.update({"font.size": 10.5, "axes.edgecolor": INK, "axes.labelcolor": INK})
    figure, panels = plt.subplots(1, 2, figsize=(9.5, 4.3), sharex=True)
    error, grid_error = [t.max_abs for t in tables], [g.max_abs for g in grids]
    ours = ([t.solves for t in tables], [t.file for t in tables])
    theirs = ([g.n**2 for g in grids], [8 * g.n**2 for g in grids])
    labels = ("solves, verification included", "bytes of the file")
    for axes, mine, other, label in zip(panels, ours, theirs, labels, strict=True):
        axes.plot(error, mine, "o-", color=RED, lw=2, label="table of the whole quadrant")
        axes.plot(grid_error, other, "s-", color=BLUE, lw=1.2, label="plain grid of the square")
        for g, value in zip(grids, other, strict=True):
            axes.annotate(f"{g.n}²", (g.max_abs, value), (8, -3), textcoords="offset points", ha="left", color=BLUE)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlim(right=3.0)
        axes.set_xlabel(r"largest error of $\tilde\mu$")
        axes.set_title(label, loc="left", color=INK)
        axes.grid(True, which="major", color=PALE, lw=0.8)
        axes.set_axisbelow(True)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    panels[0].plot(error, [t.nodes for t in tables], "o--", color=RED, lw=1.2, ms=4, label="its nodes alone")
    panels[0].legend(fontsize=9, frameon=False, loc="upper left", bbox_to_anchor=(0.0, 0.93))
    figure.tight_layout()
    figure.savefig(path, dpi=100)
    plt.close(figure)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="threads that solve")
    parser.add_argument("--quick", action="store_true", help="one table and two small grids: a smoke test")
    parser.add_argument("--write", action="store_true", help="put table and plot into docs/")
    given = parser.parse_args()
    if given.quick and given.write:
        parser.error("--quick cannot be combined with --write")
    if given.workers < 1:
        parser.error(f"--workers must be at least 1, got {given.workers}")
    tables = []
    with tempfile.TemporaryDirectory() as folder:
        if not given.quick:
            progress("compiling")
            build(MAX_TOLERANCE, given.workers, Path(folder))
        for tolerance in TOLERANCES[:1] if given.quick else TOLERANCES:
            progress(f"building for {tolerance:.0e}")
            tables.append(build(tolerance, given.workers, Path(folder)))
    sizes = (24, 48) if given.quick else (64, 256, 1024)
    grids = plain(sizes, 2_000 if given.quick else 100_000)
    rows = [
        [f"{g.n} x {g.n}", f"{g.n**2:,}", f"{8 * g.n**2:,}", quantity(g.max_abs), quantity(g.max_rel)] for g in grids
    ]
    text = "\n\n".join(
        [
            measuring.machine("scipy"),
            f"Built from nothing on {given.workers} threads, with the fresh solves of the verification; errors are "
            "those that the verification found over the whole quadrant.",
            markdown(HEADER, [t.cells() for t in tables]),
            "For comparison, cubic splines on plain log-log grids over v~, y~ in [1e-3, 1e3] alone:",
            markdown(("plain grid", "solves", "bytes", "max abs error", "max rel error"), rows),
        ]
    )
    print(text)
    if given.write:
        measuring.write_section("build_cost", text)
        plot(tables, grids, measuring.IMAGES / "build_cost.png")


if __name__ == "__main__":
    main()

"""Speed against error: the committed tables and their peers, on the same points in one run.

    python benchmarks/speed_against_error.py [--points 1000000] [--quick] [--write]

Points are log-uniform over v~, y~ in [1e-3, 1e3].  Times are of one thread, best of interleaved rounds; errors are
against fresh solves.  A full run draws build/results/speed_against_error.png.
"""

from benchmarks.measuring import RESULTS, ROOT, best_of, main, markdown, progress, quantity  # isort: split

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray

from benchmarks import peers
from benchmarks.peers import Contender
from builder.sweep import Sweep, solve_chunk
from mumacro import Surrogate, closed_forms

Array = NDArray[np.float64]
Line = tuple[str, list[tuple[float, float]]]  # what a method is called, and its (largest error, ns a point)
FULL_GRIDS, QUICK_GRIDS = (64, 256, 1024), (24, 48)
HEADER = ("method", "data", "ns/point", "max abs error", "99 % abs error", "solves")


def draw(n: int, seed: int) -> Array:
    low, high = np.log(peers.SQUARE)
    return np.exp(np.random.default_rng(seed).uniform(low, high, (2, n)))


def contenders(sweep: Sweep, quick: bool) -> dict[str, list[Contender]]:
    """The tables, the peers and the formula, by what a line of the picture is called."""
    opened = [Surrogate.open(path, threads=1) for path in (ROOT / "tables").glob("*.nc")]
    found = {"our tables": [
        Contender(f"**{s.id}**", "border-fitted blocks", s.mu_ratio, int(s.table.attributes["n_solves"]))
        for s in sorted(opened, key=lambda s: -s.tolerance)]}  # fmt: skip
    for n in QUICK_GRIDS if quick else FULL_GRIDS:
        progress(f"grid {n} x {n}")
        for one in (*peers.on_grid(peers.solve_grid(sweep, n)), peers.fitted_to_the_border(sweep, n // 2)):
            found.setdefault(one.name, []).append(one)
    rigid = Contender("eq. (35), rigid contact", "formula", lambda v, y: closed_forms.outer(y / v))
    return {**found, rigid.name: [rigid]}


def speed_against_error(points: int, rounds: int, quick: bool) -> str:
    """The table of all contenders, with the solver; a full run draws the picture."""
    points = 20_000 if quick else points
    numba.set_num_threads(1)
    v, y = draw(points, seed=1)
    v_true, y_true = draw(2_000 if quick else 100_000, seed=2)
    with Sweep(1, checkpoint=peers.cache()) as sweep:
        progress("fresh solves")
        truth = sweep.solve("full", v_true, y_true)["mu_ratio"]
        methods = contenders(sweep, quick)
    direct = np.stack([v, y, y - 1.0], axis=1)[: 500 if quick else 10_000]
    work: dict[str, Callable[[], object]] = {"direct": lambda: solve_chunk("full", direct)}
    work |= {f"{c.name} {c.size}": partial(c.evaluate, v, y) for of_one in methods.values() for c in of_one}
    progress(f"{rounds} rounds of {len(work)} contenders")
    best = best_of(rounds, work)
    rows, lines = [], list[Line]()
    for name, of_one in methods.items():
        lines.append((name, []))
        for c in of_one:
            error, ns = np.abs(c.evaluate(v_true, y_true) - truth), best[f"{c.name} {c.size}"] / points * 1e9
            numbers = map(quantity, (ns, float(error.max()), float(np.quantile(error, 0.99))))
            rows.append([c.name, c.size, *numbers, f"{c.solves:,}" if c.solves else "-"])
            lines[-1][1].append((float(error.max()), ns))
    each = quantity(best["direct"] / len(direct) * 1e9)
    rows.append(["direct solve of the full model", "compiled", each, "-", "-", "-"])
    if not quick:
        plot(lines, RESULTS / "speed_against_error.png")
    text = f"{points:,} log-uniform random points over v~, y~ in [1e-3, 1e3]; one thread, best of {rounds} rounds, "
    text += "processor time. Errors of mu~ are against fresh solves."
    return f"{text}\n\n{markdown(HEADER, rows, 2)}"


def plot(lines: list[Line], path: Path) -> None:
    """The picture of all methods: ns a point against the largest error, one line a method."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.5, 5.0), layout="constrained")
    axes = figure.add_subplot(xscale="log", yscale="log", ylabel="ns per point, one thread")
    axes.set_xlabel(r"largest error of $\tilde\mu$ over $\tilde v$, $\tilde y$ from 0.001 to 1000")
    colors = ("#c1272d", "#1f5fa8", "#2a8c8c", "#8a8a8a", "#b07aa1", "#e08214", "#222222")
    for (name, points), color in zip(lines, colors, strict=True):
        axes.plot(*zip(*points, strict=True), "o-", label=name, color=color, lw=1.0 + 1.2 * (color == colors[0]))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_yticks([10, 20, 50, 100, 200, 500, 1000], minor=False)
    axes.minorticks_off()
    axes.grid(color="#e4e4e4")
    axes.legend(fontsize=9, loc="upper left")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100, metadata={"Software": None})


if __name__ == "__main__":
    main(__doc__, {"speed_against_error": speed_against_error}, points=1_000_000, rounds=5, quick=False)

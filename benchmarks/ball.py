"""Speed against error of a ball that is shaken across: the committed tables and their peers, on the
same points in one run.

Peers are quadratures over the springs of the finest table at every call, as a program would do it
that has one spring alone, and interpolators on plain log-log grids of solved balls.

    python benchmarks/ball.py [--points 200000] [--quick] [--write]

Points are log-uniform over v~, y~ in [1e-3, 1e3].  Times are of one thread, best of interleaved
rounds; errors are against fresh quadratures that are cut where a spring begins or ceases to slip.
A full run draws docs/img/ball_speed_against_error.png.  speed_against_error.py runs this, too.
"""

# isort: split
import os
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad

from benchmarks.peers import Contender, Line, draw, grid_axis, on_grid, plot
from builder.solver.ball import Ball, Springs
from mumacro import Surrogate
from mumacro.table.atlas import MIDDLE
from tests.support.measuring import IMAGES, best_of, main, markdown, progress, quantity
from tests.support.places import ROOT

Array = NDArray[np.float64]
FULL_GRIDS, QUICK_GRIDS = (64, 128, 256), (16, 24)
GAUSS = (8, 32, 128)
SLOW = 200  # points that a contender of a millisecond is timed with
HEADER = ("method", "data", "ns/point", "max abs error", "99 % abs error")


def gauss(springs: Surrogate, nodes: int) -> Contender:
    """mu~ of a ball as a Gauss rule over its springs, each at the share xi of the contact
    radius."""
    x, weights = np.polynomial.legendre.leggauss(nodes)
    xi = 0.5 * (1.0 + x)
    s = (1.0 - xi) * (1.0 + xi)
    shares = 0.5 * weights * MIDDLE * s

    def evaluate(v: Array, y: Array) -> Array:
        total = np.zeros(v.size)
        for node, share in zip(MIDDLE * s, shares, strict=True):
            total += share * springs.mu_ratio(v / node, y / node)
        return total

    return Contender("Gauss rule over springs", f"{nodes} nodes", evaluate)


def adaptive(springs: Surrogate) -> Contender:
    """The same by scipy's adaptive quadrature, to its default tolerance of 1.5e-8."""

    def one(v: float, y: float) -> float:
        def spring(xi: float) -> float:
            s = (1.0 - xi) * (1.0 + xi)
            return MIDDLE * s * springs.mu_ratio(v / (MIDDLE * s), y / (MIDDLE * s)) if s else 0.0

        return float(quad(spring, 0.0, 1.0, limit=200)[0])

    return Contender("scipy quad over springs", "adaptive", np.vectorize(one, otypes=[float]))


def tables() -> Iterator[Contender]:
    opened = [Surrogate.open(path, threads=1) for path in (ROOT / "tables").glob("*.nc")]
    for s in sorted(opened, key=lambda s: -s.tolerance):
        yield Contender(f"**{s.id}**", "blocks of a ball", partial(_of_table, s))


def _of_table(table: Surrogate, v: Array, y: Array) -> Array:
    return np.asarray(table.quantity("mu_ratio", v, y, contact="ball")[0])


def contenders(exact: Ball, springs: Surrogate, quick: bool) -> dict[str, list[Contender]]:
    """The tables and the peers, by what a line of the picture is called."""
    methods = {
        "our tables": list(tables()),
        "Gauss rule over springs": [gauss(springs, nodes) for nodes in GAUSS],
        "scipy quad over springs": [adaptive(springs)],
    }
    for n in QUICK_GRIDS if quick else FULL_GRIDS:
        progress(f"grid {n} x {n}")
        axis = grid_axis(n) / MIDDLE
        values = exact.solve(axis[:, None], axis[None, :])["mu_ratio"]
        for one in on_grid(values):
            methods.setdefault(one.name, []).append(one)
    return methods


def ball_speed_against_error(points: int, rounds: int, quick: bool) -> str:
    """The table of all contenders; a full run draws the picture."""
    points = 2_000 if quick else points
    springs = Surrogate.open(1e-12, threads=1)
    exact = Ball(Springs(springs), workers=os.cpu_count() or 1)
    v, y = draw(points, seed=1)
    v_true, y_true = draw(500 if quick else 20_000, seed=2)
    progress("fresh quadratures")
    truth = exact.solve(v_true / MIDDLE, y_true / MIDDLE)["mu_ratio"]
    methods = contenders(exact, springs, quick)
    timed = {
        f"{c.name} {c.size}": (c, SLOW if c.size == "adaptive" else points)
        for of_one in methods.values()
        for c in of_one
    }
    work: dict[str, Callable[[], object]] = {
        name: partial(c.evaluate, v[:count], y[:count]) for name, (c, count) in timed.items()
    }
    progress(f"{rounds} rounds of {len(work)} contenders")
    best = best_of(rounds, work)
    rows, lines = [], list[Line]()
    for name, of_one in methods.items():
        lines.append((name, []))
        for c in of_one:
            count = timed[f"{c.name} {c.size}"][1]
            compared = slice(10 * SLOW if c.size == "adaptive" else None)
            error = np.abs(c.evaluate(v_true[compared], y_true[compared]) - truth[compared])
            ns = best[f"{c.name} {c.size}"] / count * 1e9
            largest, most = float(error.max()), float(np.quantile(error, 0.99))
            rows.append([c.name, c.size, *map(quantity, (ns, largest, most))])
            lines[-1][1].append((largest, ns))
    if not quick:
        plot(lines, IMAGES / "ball_speed_against_error.png")
    text = (
        f"{points:,} log-uniform random points over v~, y~ in [1e-3, 1e3]; one thread, best of "
        f"{rounds} rounds, processor time. Tables also give the bound. Errors of mu~ are against "
        f"{truth.size:,} fresh quadratures, those of the adaptive rule against "
        f"{min(10 * SLOW, truth.size):,}."
    )
    return f"{text}\n\n{markdown(HEADER, rows, 2)}"


if __name__ == "__main__":
    main(
        __doc__,
        {"ball_speed_against_error": ball_speed_against_error},
        points=200_000,
        rounds=5,
        quick=False,
    )

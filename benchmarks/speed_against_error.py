"""Speed against error: the committed tables and their peers, on the same points in one run.

Peers are common interpolators with the same solved values on plain log-log grids; each takes v~ and
y~, and its time includes that of the two logarithms, as with a table.

    python benchmarks/speed_against_error.py [--points 1000000] [--quick] [--write]

Points are log-uniform over v~, y~ in [1e-3, 1e3].  Times are of one thread, best of interleaved
rounds; errors are against fresh solves.  A full run draws build/results/speed_against_error.png.
"""

# isort: split
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Literal, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.interpolate import RectBivariateSpline, RegularGridInterpolator, make_interp_spline

from builder.solver.sweep import Sweep, solve_chunk
from mumacro import Surrogate, closed_forms
from tests.support.measuring import RESULTS, ROOT, best_of, main, markdown, progress, quantity

Array = NDArray[np.float64]
Evaluate = Callable[[Array, Array], Array]
# what a method is called, and its (largest error, ns a point)
Line = tuple[str, list[tuple[float, float]]]
FULL_GRIDS, QUICK_GRIDS = (64, 256, 1024), (24, 48)
SQUARE = (1e-3, 1e3)  # of v~ and of y~
HEADER = ("method", "data", "ns/point", "max abs error", "99 % abs error", "solves")


class Contender(NamedTuple):
    """One method for mu~: ``evaluate(v~, y~)``, the size of its data, and the solves to build
    them."""

    name: str
    size: str
    evaluate: Evaluate
    solves: int = 0


def grid_axis(n: int) -> Array:
    return np.geomspace(*SQUARE, n)


def solve_grid(sweep: Sweep, n: int) -> Array:
    """mu~ on the plain grid of ``n`` x ``n`` nodes, axis 0 along v~."""
    axis = grid_axis(n)
    return sweep.solve("full", axis[:, None], axis[None, :])["mu_ratio"]


def _map_coordinates(x: Array, values: Array, order: Literal[1, 3]) -> Evaluate:
    filtered: Array = (
        ndimage.spline_filter(values, order=order, mode="nearest") if order > 1 else values
    )
    start, scale = x[0], 1.0 / (x[1] - x[0])

    def evaluate(v: Array, y: Array) -> Array:
        at = np.empty((2, v.size))
        np.log(v, out=at[0])
        np.log(y, out=at[1])
        at -= start
        at *= scale
        out: Array = ndimage.map_coordinates(
            filtered, at, order=order, mode="nearest", prefilter=False
        )
        return out

    return evaluate


def on_grid(values: Array) -> Iterator[Contender]:
    """Interpolators on the plain grid that ``values`` (n, n) were solved on.

    Others of scipy and xarray give the errors of these, for they interpolate alike, and take
    longer.
    """
    n = values.shape[0]
    x = np.log(grid_axis(n))
    linear, cubic = RegularGridInterpolator((x, x), values), RectBivariateSpline(x, x, values)
    methods: dict[str, Evaluate] = {
        "scipy RegularGridInterpolator linear": lambda v, y: np.asarray(
            linear(np.log(np.stack((v, y), axis=1)))
        ),
        "scipy RectBivariateSpline.ev k=3": lambda v, y: np.asarray(cubic.ev(np.log(v), np.log(y))),
        "scipy map_coordinates order 1": _map_coordinates(x, values, 1),
        "scipy map_coordinates order 3": _map_coordinates(x, values, 3),
    }
    for name, evaluate in methods.items():
        yield Contender(name, f"{n} x {n}", evaluate, n * n)


def fitted_to_the_border(sweep: Sweep, n: int) -> Contender:
    """What an engineer would build who knows of the border: one quintic patch on each side, ``n`` x
    ``n`` nodes each.

    Along ln y~, and along ln v~ as the share of the way to the border, which is a quintic spline of
    4 n nodes.  The corner v~ -> 0, y~ = 1, where three scales meet, gets no coordinate of its own.
    """
    low, high = SQUARE
    fine = np.geomspace(low, high, 4 * n)
    border = make_interp_spline(
        np.log(fine), np.log(sweep.solve("border", np.ones_like(fine), fine)["deficit"]), k=5
    )
    # the amplitude whose border is at the least v~
    first = float(np.interp(low, np.exp(border(np.log(fine))), fine))
    share = np.linspace(0.0, 1.0, n)

    def patch(axis: Array, end: float, kind: str) -> RectBivariateSpline:
        crit = border(axis)
        v = np.exp(crit + np.outer(share, np.log(end) - crit))
        values = sweep.solve(kind, v, np.broadcast_to(np.exp(axis), v.shape))["mu_ratio"]
        return RectBivariateSpline(axis, share, values.T, kx=5, ky=5)

    ends = 0.25 * low, 2.0 * high  # beyond the square, so that the shares have no singular end
    stick = patch(np.linspace(np.log(first), np.log(high), n), ends[0], "full")
    slide = patch(np.linspace(np.log(low), np.log(high), n), ends[1], "continuous")

    def evaluate(v: Array, y: Array) -> Array:
        x, at = np.log(y), np.log(v)
        crit, out = border(x), np.empty(v.size)
        for spline, end, inside in ((stick, ends[0], at < crit), (slide, ends[1], at >= crit)):
            way = (at[inside] - crit[inside]) / (np.log(end) - crit[inside])
            out[inside] = spline.ev(x[inside], way)
        return out

    return Contender(
        "two quintic patches fitted to the border", f"2 x {n} x {n}", evaluate, 2 * n * n + 4 * n
    )


def draw(n: int, seed: int) -> Array:
    low, high = np.log(SQUARE)
    return np.exp(np.random.default_rng(seed).uniform(low, high, (2, n)))


def contenders(sweep: Sweep, quick: bool) -> dict[str, list[Contender]]:
    """The tables, the peers and the formula, by what a line of the picture is called."""
    opened = [Surrogate.open(path, threads=1) for path in (ROOT / "tables").glob("*.nc")]
    lines = {
        "our tables": [
            Contender(
                f"**{s.id}**",
                "border-fitted blocks",
                s.mu_ratio,
                int(s.table.attributes["n_solves"]),
            )
            for s in sorted(opened, key=lambda s: -s.tolerance)
        ]
    }
    for n in QUICK_GRIDS if quick else FULL_GRIDS:
        progress(f"grid {n} x {n}")
        for one in (*on_grid(solve_grid(sweep, n)), fitted_to_the_border(sweep, n // 2)):
            lines.setdefault(one.name, []).append(one)
    rigid = Contender("eq. (35), rigid contact", "formula", lambda v, y: closed_forms.outer(y / v))
    return {**lines, rigid.name: [rigid]}


def speed_against_error(points: int, rounds: int, quick: bool) -> str:
    """The table of all contenders, with the solver; a full run draws the picture."""
    points = 20_000 if quick else points
    numba.set_num_threads(1)
    v, y = draw(points, seed=1)
    v_true, y_true = draw(2_000 if quick else 100_000, seed=2)
    with Sweep(1) as sweep:
        progress("fresh solves")
        truth = sweep.solve("full", v_true, y_true)["mu_ratio"]
        methods = contenders(sweep, quick)
    direct = np.stack([v, y, y - 1.0], axis=1)[: 500 if quick else 10_000]
    work: dict[str, Callable[[], object]] = {"direct": lambda: solve_chunk("full", direct)}
    work |= {
        f"{c.name} {c.size}": partial(c.evaluate, v, y)
        for of_one in methods.values()
        for c in of_one
    }
    progress(f"{rounds} rounds of {len(work)} contenders")
    best = best_of(rounds, work)
    rows, lines = [], list[Line]()
    for name, of_one in methods.items():
        lines.append((name, []))
        for c in of_one:
            error, ns = (
                np.abs(c.evaluate(v_true, y_true) - truth),
                best[f"{c.name} {c.size}"] / points * 1e9,
            )
            numbers = map(quantity, (ns, float(error.max()), float(np.quantile(error, 0.99))))
            rows.append([c.name, c.size, *numbers, f"{c.solves:,}" if c.solves else "-"])
            lines[-1][1].append((float(error.max()), ns))
    each = quantity(best["direct"] / len(direct) * 1e9)
    rows.append(["direct solve of the full model", "compiled", each, "-", "-", "-"])
    if not quick:
        plot(lines, RESULTS / "speed_against_error.png")
    text = (
        f"{points:,} log-uniform random points over v~, y~ in [1e-3, 1e3]; one thread, best of "
        f"{rounds} rounds, "
    )
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
        axes.plot(
            *zip(*points, strict=True),
            "o-",
            label=name,
            color=color,
            lw=1.0 + 1.2 * (color == colors[0]),
        )
    axes.yaxis.set_major_formatter("{x:,.0f}")
    slowest = max(ns for _, points in lines for _, ns in points)
    decades, between = [10, 100, 1000, 10_000, 100_000], [20, 50, 200, 500]
    ticks = decades if slowest > 2000.0 else sorted([*decades[:3], *between])
    axes.set_yticks(ticks, minor=False)
    axes.minorticks_off()
    axes.grid(color="#e4e4e4")
    axes.legend(fontsize=9, loc="upper left")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100, metadata={"Software": None})


if __name__ == "__main__":
    main(
        __doc__,
        {"speed_against_error": speed_against_error},
        points=1_000_000,
        rounds=5,
        quick=False,
    )

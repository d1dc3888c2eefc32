"""Speed against error: the committed tables and their peers, on the same points in one run.

    python benchmarks/speed_against_error.py [--points 1000000] [--quick] [--write]

Points are log-uniform over v~, y~ in [1e-3, 1e3].  Times are of one thread, best of interleaved rounds; errors are
against fresh solves.  ``--write`` puts the tables and the plot into docs/.
"""

from __future__ import annotations

import measuring  # isort: split

import argparse
import csv
import math
import os
import timeit
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numba
import numpy as np
import peers
from marching import march
from measuring import best_of, markdown, progress, quantity
from numpy.typing import NDArray
from peers import Contender
from scipy.interpolate import RectBivariateSpline, RegularGridInterpolator

from builder.differences import differences
from builder.sweep import Sweep, solve_chunk
from mumacro import Surrogate, closed_forms
from mumacro.inverse import solve_for

Array = NDArray[np.float64]
OURS, PEER, EXACT = "ours", "peer", "exact"
CORES = os.cpu_count() or 1
TRIAL = 2000  # points of the trial that determines the points of one round
BUDGET = 2.0  # seconds allowed for one round of one contender; slower ones are timed on fewer points
FULL_GRIDS, QUICK_GRIDS = (64, 256, 1024), (24, 48)
FULL_TREES, QUICK_TREES = ((6, 1e-3), (8, 1e-4), (8, 1e-5), (8, 1e-6), (8, 1e-7), (12, 1e-8)), ((6, 1e-2),)
HEADER = ("method", "data", "ns/point", "max abs error", "99 % abs error", "max rel error", "bytes", "solves")


@dataclass(frozen=True)
class Row:
    """One line of the table; times in ns a point, errors of mu~ [-], NaN if not applicable."""

    kind: str
    name: str
    size: str
    ns: float
    max_abs: float = math.nan
    p99_abs: float = math.nan
    max_rel: float = math.nan
    bytes: int = 0
    solves: int = 0

    def cells(self) -> list[str]:
        """The line as text."""
        numbers = [quantity(x) if x == x else "-" for x in (self.ns, self.max_abs, self.p99_abs, self.max_rel)]
        counts = [f"{n:,}" if n else "-" for n in (self.bytes, self.solves)]
        return [f"**{self.name}**" if self.kind == OURS else self.name, self.size, *numbers, *counts]


def draw(n: int, seed: int, low: float = peers.SQUARE[0]) -> tuple[Array, Array]:
    """``n`` points (v~ >= ``low``, y~), log-uniform over the square."""
    rng = np.random.default_rng(seed)
    high = peers.SQUARE[1]
    v = np.exp(rng.uniform(np.log(low), np.log(high), n))
    return v, np.exp(rng.uniform(np.log(peers.SQUARE[0]), np.log(high), n))


def tables(threads: int = 1) -> list[Surrogate]:
    """The committed tables, coarse to fine."""
    opened = [Surrogate.open(path, threads) for path in (measuring.ROOT / "tables").glob("*.nc")]
    return sorted(opened, key=lambda s: -s.tolerance)


def spread(error: Array, truth: Array) -> tuple[float, float, float]:
    """Largest and 99 % absolute error and largest relative error."""
    return float(error.max()), float(np.quantile(error, 0.99)), float((error / truth).max())


def reference_error() -> tuple[float, float, float]:
    """Largest and 99 % absolute and largest relative error of a direct solve on the quadruple-precision points."""
    with open(measuring.ROOT / "tests" / "data" / "points.csv", newline="") as stream:
        cases = [(float(r["v"]), float(r["y"]), float(r["mu_ratio"])) for r in csv.DictReader(stream)]
    low, high = peers.SQUARE
    v, y, truth = np.array([c for c in cases if low <= c[0] <= high and low <= c[1] <= high]).T
    error = np.abs(solve_chunk("full", np.stack([v, y, y - 1.0], axis=1))[:, 0] - truth)
    return spread(error, truth)


def marching_row(points: int) -> Row:
    """solve_ivp on a few points, v~ >= 0.01 so that marching ends."""
    v, y = draw(points, seed=4, low=0.01)
    got: list[float] = []
    seconds = timeit.timeit(lambda: got.extend(march(a, b).mu_ratio for a, b in zip(v, y, strict=True)), number=1)
    truth = solve_chunk("full", np.stack([v, y, y - 1.0], axis=1))[:, 0]
    errors = spread(np.abs(np.array(got) - truth), truth)
    return Row(EXACT, "scipy solve_ivp, marched", f"{points} points, v~ >= 0.01", seconds / points * 1e9, *errors)


def contenders(sweep: Sweep, quick: bool) -> list[tuple[str, Contender]]:
    """All methods timed on the large set of points, the tables first."""
    found = []
    for s in tables():
        solves = int(s.table.attributes["n_solves"])
        found.append((OURS, Contender(s.id, "border-fitted blocks", s.mu_ratio, s.memory, solves)))
    for n in QUICK_GRIDS if quick else FULL_GRIDS:
        progress(f"grid {n} x {n}")
        found += [(PEER, c) for c in peers.on_grid(peers.solve_grid(sweep, n))]
    for order, tolerance in QUICK_TREES if quick else FULL_TREES:
        progress(f"baobzi order {order}, tolerance {tolerance:g}")
        tree = peers.adaptive(order, tolerance)
        if tree is not None:
            found.append((PEER, tree))
    found.append((PEER, Contender("eq. (35), rigid contact", "formula", lambda v, y: closed_forms.outer(y / v), 0, 0)))
    return found


def affordable(contender: Contender, v: Array, y: Array) -> int:
    """The number of points for one round, from a short trial; the first call compiles."""
    contender.evaluate(v[:TRIAL], y[:TRIAL])
    seconds = min(timeit.repeat(partial(contender.evaluate, v[:TRIAL], y[:TRIAL]), number=1, repeat=3))
    return int(min(v.size, max(TRIAL, BUDGET * TRIAL / seconds)))


def compare(points: int, quick: bool, rounds: int, clock: str) -> tuple[list[Row], str]:
    """All rows: the tables, the peers, the formula, the solvers; and a sentence about other load."""
    v, y = draw(points, seed=1)
    v_true, y_true = draw(2_000 if quick else 100_000, seed=2)
    with Sweep(1, checkpoint=peers.cache()) as sweep:
        progress("fresh solves")
        truth = sweep.solve("full", v_true, y_true)["mu_ratio"]
        entries = contenders(sweep, quick)
    used = {str(i): affordable(c, v, y) for i, (_, c) in enumerate(entries)}
    work: dict[str, Callable[[], object]] = {
        str(i): partial(c.evaluate, v[: used[str(i)]], y[: used[str(i)]]) for i, (_, c) in enumerate(entries)
    }
    on_all_cores = {s.id: s for s in tables(CORES)}
    parallel: dict[str, Callable[[], object]] = {
        str(i): partial(on_all_cores[c.name].mu_ratio, v, y) for i, (kind, c) in enumerate(entries) if kind == OURS
    }
    logs = np.empty((points, 2))
    work["logs"] = lambda: (np.log(v, out=logs[:, 0]), np.log(y, out=logs[:, 1]))
    direct = np.stack([v, y, y - 1.0], axis=1)[: 500 if quick else 10_000]
    work["direct"] = lambda: solve_chunk("full", direct)
    progress(f"{rounds} rounds of {len(work)} contenders")
    timed, cores = best_of(rounds, work, clock), best_of(rounds, parallel)
    rows: list[Row] = []
    for i, (kind, c) in enumerate(entries):
        error = np.abs(c.evaluate(v_true, y_true) - truth)
        rest = (*spread(error, truth), c.bytes, c.solves)
        rows.append(Row(kind, c.name, c.size, timed.best[str(i)] / used[str(i)] * 1e9, *rest))
        if str(i) in parallel:
            rows.append(Row(OURS, c.name, f"{CORES} threads", cores.best[str(i)] / points * 1e9, *rest))
    ns = timed.best["logs"] / points * 1e9
    rows.append(Row(EXACT, "the two logarithms alone, part of every grid's time", "numpy", ns))
    ns = timed.best["direct"] / len(direct) * 1e9
    rows.append(Row(EXACT, "direct solve of the full model", "compiled", ns, *reference_error()))
    progress("solve_ivp")
    rows.append(marching_row(2 if quick else 40))
    progress("yardstick")
    rod = peers.yardstick(20_000 if quick else points, rounds, build=not quick)
    if rod is not None:
        rows.append(Row("other", rod.name, "200 x 200", rod.ns, max_rel=rod.max_rel, bytes=rod.bytes))
    return rows, timed.note()


def one_at_a_time(surrogate: Surrogate, number: int) -> str:
    """Microseconds of calls with plain floats, and ns a point of the call with six dimensional columns."""
    n = 64
    axis = np.log(peers.grid_axis(n))
    values = np.asarray(surrogate.mu_ratio(np.exp(axis)[:, None], np.exp(axis)[None, :]))
    spline, regular = RectBivariateSpline(axis, axis, values), RegularGridInterpolator((axis, axis), values)
    log = np.log
    calls: dict[str, Callable[[], object]] = {
        f"**{surrogate.id}** `s.mu_ratio(v, y)`": lambda: surrogate.mu_ratio(0.1, 0.5),
        f"**{surrogate.id}** `s.evaluate(mu0, Fz, k, y0, omega, v0)`": partial(
            surrogate.evaluate, mu0=0.3, Fz=10.0, k=1e6, y0=2e-6, omega=1.3e5, v0=0.01
        ),
        "scipy RectBivariateSpline.ev k=3": lambda: spline.ev(log(0.1), log(0.5)),
        "scipy RegularGridInterpolator linear": lambda: regular((log(0.1), log(0.5))),
    }
    rows = []
    for name, call in calls.items():
        call()
        best = min(timeit.repeat(call, number=number, repeat=5)) / number
        rows.append([name, quantity(best * 1e6)])
    return markdown(("one case a call", "microseconds"), rows)


def six_columns(points: int, rounds: int, clock: str) -> str:
    """ns a point of ``evaluate`` on six columns, and with four of them scalars."""
    v, y = draw(points, seed=3)
    rng = np.random.default_rng(6)
    mu0, Fz = rng.uniform(0.1, 0.8, points), 10.0 ** rng.uniform(-1.0, 3.0, points)
    k, omega = 10.0 ** rng.uniform(4.0, 8.0, points), 10.0 ** rng.uniform(2.0, 6.0, points)
    length = mu0 * Fz / k
    y0, v0 = y * length, v * length * omega
    scale = 0.3 * 10.0 / 1e6
    y0_fixed, v0_fixed = y * scale, v * scale * 1.3e5
    columns = {"mu0": mu0, "Fz": Fz, "k": k, "y0": y0, "omega": omega, "v0": v0}
    fixed = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": y0_fixed, "omega": 1.3e5, "v0": v0_fixed}
    best = {}
    for threads in (1, CORES):
        calls: dict[str, Callable[[], object]] = {}
        for s in tables(threads)[-2:]:
            six, two = f"**{s.id}** `s.evaluate`, six columns", f"**{s.id}** `s.evaluate`, two columns, four scalars"
            calls[six] = partial(s.evaluate, **columns)
            calls[f"{six}, with v~, y~ and l0"] = partial(s.evaluate, **columns, groups=True)
            calls[two] = partial(s.evaluate, **fixed)
        found = best_of(rounds, calls, clock if threads == 1 else "wall").best
        best |= {f"{name}, {threads} thread{'s' * (threads > 1)}": seconds for name, seconds in found.items()}
    rows = [[name, quantity(s / points * 1e9)] for name, s in best.items()]
    return markdown(("dimensional batch", "ns/point"), rows)


def other_quantities(points: int, rounds: int, clock: str, quick: bool) -> str:
    """Gradient, power, stick fraction and the inverse question: time, largest error, largest bound of every table."""
    v, y = draw(points, seed=4)
    few = 200 if quick else 5_000
    v_few, y_few = draw(few, seed=5)
    case = {"mu0": 1.0, "Fz": 1.0, "k": 1.0, "omega": 1.0}
    rows = []
    with Sweep(1, checkpoint=peers.cache()) as sweep:
        truth = sweep.solve("full", v_few, y_few)
        for s in tables():
            progress(f"other quantities of {s.id}")
            slopes, noise = differences(s, sweep, "mu_ratio", v_few, y_few)
            calls: dict[str, Callable[[], object]] = {
                "gradient": partial(s.evaluate, y0=y, v0=v, **case, gradient=True),
                "power": partial(s.power_with_bound, v, y),
                "stick fraction": partial(s.stick_fraction_with_bound, v, y),
            }
            timed = best_of(rounds, calls, clock).best
            _, along_v, along_y, *bounds = s.slopes(v_few, y_few, bounds=True)
            off = np.maximum(np.abs(np.stack((along_v, along_y)) - slopes) - noise, 0.0)
            power, of_power = s.power_with_bound(v_few, y_few)
            stick, of_stick = s.stick_fraction_with_bound(v_few, y_few)
            found = {
                "gradient": ("slopes along ln v~, ln y~, absolute", off, np.stack(bounds)),
                "power": ("relative", np.abs(power / truth["power"] - 1.0), of_power / truth["power"]),
                "stick fraction": ("absolute", np.abs(stick - truth["stick_fraction"]), of_stick),
            }
            for name, (kind, error, bound) in found.items():
                ns = quantity(timed[name] / points * 1e9)
                rows.append([f"**{s.id}** {name}", kind, ns, quantity(error.max()), quantity(float(bound.max()))])
            targets = np.linspace(0.05, 0.95, 19 if quick else 1_000)
            inverse = partial(solve_for, s, "v0", targets, {**case, "y0": 2.0})
            seconds = best_of(rounds, {"": inverse}, clock).best[""]
            roots = np.array([root[0].value for root in inverse().roots])
            error = np.abs(sweep.solve("full", roots, np.full(roots.size, 2.0))["mu_ratio"] - targets)
            ns = quantity(seconds / targets.size * 1e9)
            rows.append(
                [f"**{s.id}** v0 for a wanted mu_macro", "mu~ at the root, absolute", ns, quantity(error.max()), "-"]
            )
    return markdown(("quantity", "error", "ns/point", "max error", "max bound"), rows, 2)


def verdict(rows: list[Row]) -> str:
    """The peers that beat the tables; one thread against one thread."""
    ours = [r for r in rows if r.kind == OURS and "threads" not in r.size]
    theirs = [r for r in rows if r.kind == PEER]

    def listed(found: list[Row], error: Callable[[Row], float]) -> str:
        found = sorted(found, key=error)
        text = "; ".join(f"{p.name} {p.size} ({quantity(p.ns)} ns, {quantity(error(p))})" for p in found[:5])
        return (text + (f"; and {len(found) - 5} with larger errors" if len(found) > 5 else "")) or "none"

    def largest(row: Row) -> float:
        return row.max_abs

    def usual(row: Row) -> float:
        return row.p99_abs

    lines = []
    for table in ours:
        for word, error in (("largest", largest), ("99 %", usual)):
            better = [p for p in theirs if p.ns < table.ns and error(p) <= error(table)]
            own = f"{quantity(table.ns)} ns, {quantity(error(table))}"
            lines.append(f"- Faster than {table.name} ({own}) at its {word} error or less: {listed(better, error)}.")
    quickest = min(ours, key=lambda r: r.ns)
    faster = [p for p in theirs if p.ns < quickest.ns]
    lines.append(f"- Faster than the fastest, {quickest.name}, whatever the error: {listed(faster, largest)}.")
    beaten = [p for p in theirs if any(t.ns <= p.ns and t.max_abs <= p.max_abs for t in ours)]
    lines.append(f"- One of the tables is both faster and closer than {len(beaten)} of the {len(theirs)} peers.")
    return "\n".join(lines)


def headline(rows: list[Row], points: int) -> str:
    """The section of the README: the tables, each above the fastest peer with no larger error, or the closest peer."""
    lines = []
    for table in (r for r in rows if r.kind == OURS and "threads" not in r.size):
        theirs = [p for p in rows if p.kind == PEER]
        as_good = [p for p in theirs if p.max_abs <= table.max_abs]
        peer = min(as_good, key=lambda p: p.ns) if as_good else min(theirs, key=lambda p: p.max_abs)
        lines.append([f"**{table.name}**", quantity(table.ns), quantity(table.max_abs), f"{table.solves:,}"])
        word = "fastest peer as close" if as_good else "closest peer"
        lines.append(
            [f"{word}: {peer.name}, {peer.size}", quantity(peer.ns), quantity(peer.max_abs), f"{peer.solves:,}"]
        )
    return "\n\n".join(
        [
            f"{points:,} random points over v~, y~ in [1e-3, 1e3] on one thread; {measuring.processor()}:",
            markdown(("method", "ns/point", "max abs error of mu~", "solves to build"), lines),
        ]
    )


def report(rows: list[Row], note: str, extra: list[str], points: int, rounds: int) -> str:
    """The section of docs/benchmarks.md."""
    missing = [f"- {name}: {reason}" for name, reason in sorted(peers.MISSING.items())]
    return "\n\n".join(
        [
            measuring.machine("scipy", "xarray", "baobzi", "CoolProp", "interpolation"),
            f"{points:,} log-uniform random points over v~, y~ in [1e-3, 1e3]; one thread unless the row states more; "
            f"best of {rounds} interleaved rounds. {note} Errors of mu~ are against fresh solves, those of the direct "
            "solve against quadruple precision. Bytes are those of the data in memory.",
            markdown(HEADER, [r.cells() for r in rows], 2),
            "Where a peer wins, and by how much (ns a point and error in brackets):",
            verdict(rows),
            *extra,
            *(["Not in this run:", "\n".join(missing)] if missing else []),
        ]
    )


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, help="points that are timed (1,000,000; quick: 20,000)")
    parser.add_argument("--rounds", type=int, default=5, help="interleaved rounds, the best counts")
    parser.add_argument("--clock", choices=measuring.CLOCKS, default="wall", help="processor: on a busy machine")
    parser.add_argument("--quick", action="store_true", help="small grids and few points: a smoke test, no measurement")
    parser.add_argument("--write", action="store_true", help="put tables and plot into docs/")
    given = parser.parse_args()
    if given.quick and given.write:
        parser.error("--quick cannot be combined with --write")
    points = given.points or (20_000 if given.quick else 1_000_000)
    if points < 10_000:
        parser.error(f"--points must be at least 10,000, got {points}")
    numba.set_num_threads(1)
    rows, note = compare(points, given.quick, given.rounds, given.clock)
    finest = tables()[-1]
    extra = [
        one_at_a_time(finest, 200 if given.quick else 20_000),
        six_columns(points, given.rounds, given.clock),
        other_quantities(points, given.rounds, given.clock, given.quick),
    ]
    text = report(rows, note, extra, points, given.rounds)
    print(text)
    if given.write:
        from plot_speed import plot

        measuring.write_section("speed_against_error", text)
        measuring.write_section("headline", headline(rows, points), measuring.ROOT / "README.md")
        plot(rows, measuring.IMAGES / "speed_against_error.png")


if __name__ == "__main__":
    main()

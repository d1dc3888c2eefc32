"""Speed against error: the committed tables beside interpolators, numpy and the model itself.

    python benchmarks/speed_against_error.py [--only SECTION] [--quick] [--write]

One run on one machine, in less than ten minutes, makes every figure of docs/speed-and-error.md and
its pictures, which a run without --quick draws to docs/img.  Peers are common interpolators with
the same solved values on plain log-log grids; each takes v~ and y~, and its time includes that of
the two logarithms, as with a table.  Points are log-uniform over v~, y~ in [1e-3, 1e3].  Times are
processor time of one thread, best of interleaved rounds; errors are against fresh solves.
"""

from tests.support.measuring import (  # isort: split
    FINEST,
    IMAGES,
    best_of,
    main,
    markdown,
    progress,
    quantity,
    sections,
)

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numba
import numpy as np
from scipy.interpolate import RectBivariateSpline, make_interp_spline

from benchmarks import ball, calls
from benchmarks.blocks_in_numpy import BlocksInNumpy
from benchmarks.peers import (
    CUBIC,
    ERROR,
    LINEAR,
    SPLINE,
    SQUARE,
    Array,
    Contender,
    draw,
    grid_axis,
    logarithmic,
    on_grid,
)
from benchmarks.service import BATCH, FORMS, ask, batch
from benchmarks.solver import march
from builder.export.c import write_c
from builder.solver.steady import solve
from builder.solver.sweep import Sweep, solve_chunk
from builder.tables.blocks import build_block, build_border
from builder.tables.contacts import spring
from builder.tables.draws import SEAMS, fast_from, log_uniform
from builder.tables.rounding import round_block
from mumacro import Surrogate, closed_forms
from mumacro.plotting import save
from mumacro.table import atlas
from mumacro.table.atlas import QUANTITY_NAMES
from mumacro.table.blocks import Table, TabulatedContact
from mumacro.table.netcdf import write_table
from mumacro.table.polynomials import Border
from tests.support.places import ROOT
from tests.support.serving import CASE, serving

FULL_GRIDS, QUICK_GRIDS = (64, 256, 1024), (24, 48)
WORKERS = os.cpu_count() or 1  # where no time is taken
HEADER = (
    "method",
    "data",
    "numbers solved",
    "bytes in memory",
    "ns/point",
    "max abs error",
    "99 % abs error",
)
OURS, IN_NUMPY = "blocks in C, with bound", "blocks in NumPy"
PATCHES, RIGID = "two quintic patches fitted to the border", "eq. (35), rigid contact"
#: line of a picture -> its name there, its colour and mark
LOOKS = {
    OURS: ("this table in C", "#c1272d", "o"),
    IN_NUMPY: ("this table in NumPy", "#c1272d", "s"),
    LINEAR: ("log grid, linear (scipy)", "#8a8a8a", "v"),
    CUBIC: ("log grid, cubic (scipy.ndimage)", "#2a8c8c", "^"),
    SPLINE: ("log grid, cubic spline (scipy)", "#1f5fa8", "D"),
    PATCHES: ("two quintic patches along the border", "#e08214", "P"),
}


def solve_grid(sweep: Sweep, n: int) -> Array:
    """mu~ on the plain grid of ``n`` x ``n`` nodes, axis 0 along v~."""
    axis = grid_axis(n)
    return sweep.solve("full", axis[:, None], axis[None, :])["mu_ratio"]


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

    solves = 2 * n * n + 4 * n
    return Contender(PATCHES, f"2 x {n} x {n}", evaluate, solves, 8 * solves)


def tables() -> list[Surrogate]:
    """The committed tables, the coarsest first."""
    opened = [Surrogate.open(path, threads=1) for path in (ROOT / "tables").glob("*.nc")]
    return sorted(opened, key=lambda s: -s.tolerance)


def of_tables() -> Iterator[Contender]:
    """Every table as the library evaluates it, and its nodes with NumPy."""
    for s in tables():
        solved = sum(block.nodes["mu_ratio"].size for block in s.table.contacts["spring"].blocks)
        solved += sum(piece.values.size for piece in s.table.border)
        yield Contender(OURS, s.id, partial(_with_bound, s), solved, s.memory)
        yield Contender(IN_NUMPY, s.id, BlocksInNumpy(s.table), solved, 8 * solved)


def _with_bound(s: Surrogate, v: Array, y: Array) -> Array:
    return np.asarray(s.quantity("mu_ratio", v, y)[0])


class Measured(NamedTuple):
    """A contender with its ns a point, its largest error, and the one that 99 % do not exceed."""

    contender: Contender
    ns: float
    largest: float
    most: float


@cache
def truth(quick: bool) -> tuple[Array, Array, Array]:
    """Points with mu~ of fresh solves."""
    v, y = draw(2_000 if quick else 100_000, seed=2)
    progress("fresh solves")
    with Sweep(WORKERS) as sweep:
        return v, y, sweep.solve("full", v, y)["mu_ratio"]


@cache
def measured(points: int, rounds: int, quick: bool) -> tuple[list[Measured], float]:
    """All contenders, and ns of one solve of the model."""
    v, y = draw(points, seed=1)
    v_true, y_true, mu = truth(quick)
    contenders = [*of_tables()]
    with Sweep(WORKERS) as sweep:
        for n in QUICK_GRIDS if quick else FULL_GRIDS:
            progress(f"grid {n} x {n}")
            contenders += [*on_grid(solve_grid(sweep, n)), fitted_to_the_border(sweep, n // 2)]
    contenders.append(Contender(RIGID, "formula", lambda v, y: closed_forms.outer(y / v)))
    direct = np.stack([v, y, y - 1.0], axis=1)[: 500 if quick else 10_000]
    few = points // 20  # of what takes longer than a microsecond
    work: dict[str, Callable[[], object]] = {"direct": lambda: solve_chunk("full", direct)}
    counts = [few if c.name == IN_NUMPY else points for c in contenders]
    for i, (c, count) in enumerate(zip(contenders, counts, strict=True)):
        work[str(i)] = partial(c.evaluate, v[:count], y[:count])
    progress(f"{rounds} rounds of {len(work)} contenders")
    best = best_of(rounds, work)
    found = []
    for i, (c, count) in enumerate(zip(contenders, counts, strict=True)):
        error = np.abs(c.evaluate(v_true, y_true) - mu)
        ns = best[str(i)] / count * 1e9
        found.append(Measured(c, ns, float(error.max()), float(np.quantile(error, 0.99))))
    return found, best["direct"] / len(direct) * 1e9


def _points(points: int, quick: bool) -> int:
    return 20_000 if quick else points


def speed(points: int, rounds: int, quick: bool) -> str:
    """The table of all contenders, with the solver; a full run draws two pictures."""
    numba.set_num_threads(1)
    found, direct = measured(_points(points, quick), rounds, quick)
    rows = []
    for c, ns, largest, most in found:
        sizes = (f"{n:,}" if n else "-" for n in (c.solves, c.memory))
        rows.append([c.name, c.size, *sizes, *map(quantity, (ns, largest, most))])
    rows.append(["one solve of the full model", "compiled", "-", "-", quantity(direct), "-", "-"])
    if not quick:
        over_time, over_size = partial(_over_time, found, direct), partial(_over_size, found)
        save(IMAGES / "speed_against_error.png", over_time, dpi=110, figsize=(8.0, 5.4))
        save(IMAGES / "error_over_size.png", over_size, dpi=100, ncols=2, figsize=(10.0, 5.0))
    v_true = truth(quick)[0]
    text = (
        f"Times are of {_points(points, quick):,} random points, one thread, processor time, best "
        f"of {rounds} rounds. Errors of mu~ are against {v_true.size:,} fresh solves."
    )
    return f"{text}\n\n{markdown(HEADER, rows, 2)}"


def headline(points: int, rounds: int, quick: bool) -> str:
    """Three rows for the first page of the project."""
    found, direct = measured(_points(points, quick), rounds, quick)
    ours = min((m for m in found if m.contender.name == OURS), key=lambda m: m.largest)
    peer = max((m for m in found if m.contender.name == SPLINE), key=lambda m: m.contender.solves)
    rows = [
        [f"`{ours.contender.size}`", quantity(ours.ns), quantity(ours.largest)],
        [
            f"cubic spline of scipy on a log grid of {peer.contender.size} solved nodes",
            quantity(peer.ns),
            quantity(peer.largest),
        ],
        ["the model itself, solved", quantity(direct), "-"],
    ]
    return markdown(("one thread", "ns a point", "largest error"), rows)


# --- the four tables ------------------------------------------------------------------------------

ONE_CASE = "import mumacro; mumacro.open().evaluate(**{case})"
#: a program with one case of each contact; it prints the most memory that it took [kB]
BOTH_CONTACTS = """import mumacro, pathlib, re
s = mumacro.open({tolerance})
for contact in ("spring", "ball"):
    s.evaluate(**{case}, contact=contact, include=("power", "stick_fraction"))
print(re.search("VmHWM: *(.*) kB", pathlib.Path("/proc/self/status").read_text())[1])"""


def which_table(points: int, rounds: int, quick: bool) -> str:  # noqa: ARG001
    """What each committed table costs: to load, to start with, to hold, to compile."""
    rows = []
    for s in tables():
        best = best_of(1 if quick else 7, {"open": partial(Surrogate.open, s.path, 1)})["open"]
        with tempfile.TemporaryDirectory() as folder:
            written = write_c(s.table, Path(folder) / "mumacro.h")
            source = sum(path.stat().st_size for path in written)
        program = BOTH_CONTACTS.format(tolerance=s.tolerance, case=CASE)
        done = subprocess.run(
            [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
        )
        counts = s.path.stat().st_size, s.memory, source
        sizes = (f"{count / 1000.0:,.0f}" for count in counts)
        memory = f"{int(done.stdout) / 1000.0:.0f}"
        rows.append([s.id, *sizes, memory, quantity(1000.0 * best)])
    header = (
        "table",
        "file [kB]",
        "cells of mu~ [kB]",
        "C header [kB]",
        "a process with both contacts [MB]",
        "to open [ms]",
    )
    return markdown(header, rows)


# --- where users stand ----------------------------------------------------------------------------


def users(points: int, rounds: int, quick: bool) -> str:
    """Time of an array, of one call, of one request and of a batch, beside scipy and the model."""
    count, n = _points(points, quick), QUICK_GRIDS[-1] if quick else 256
    v, y = draw(count, seed=1)
    s = Surrogate.open(FINEST, threads=1)
    unit = CASE["mu0"] * CASE["Fz"] / CASE["k"]
    many = {**CASE, "v0": unit * CASE["omega"] * v, "y0": unit * y}
    with Sweep(WORKERS) as sweep:
        by_name = {c.name: c.evaluate for c in on_grid(solve_grid(sweep, n))}
    few = 200 if quick else 2000
    one, some = np.array([0.1]), np.array([0.5])
    at = [*zip(*(x[:few].tolist() for x in (v, y)), strict=True)]
    marched = [(1.0, 0.1), (0.3, 0.5), (0.1, 2.0), (1.0, 3.0)]

    def repeated(call: Callable[[], object], times: int) -> Callable[[], object]:
        return lambda: [call() for _ in range(times)]

    #: kind and method -> how many cases it answers, its work
    work: dict[tuple[str, str], tuple[int, Callable[[], object]]] = {
        ("array", "`s.mu_ratio(v, y)`"): (count, lambda: s.mu_ratio(v, y)),
        ("array", "`s.evaluate(**cases)`: value, bound, regime"): (
            count,
            lambda: s.evaluate(many),
        ),
        ("array", f"scipy, linear, {n} x {n}"): (count, lambda: by_name[LINEAR](v, y)),
        ("array", f"scipy, cubic spline, {n} x {n}"): (count, lambda: by_name[SPLINE](v, y)),
        ("array", "full model, compiled"): (
            few,
            lambda: solve_chunk("full", np.stack([v, y, y - 1.0], axis=1)[:few]),
        ),
        ("one call", "`s.mu_ratio(v, y)`"): (few, repeated(lambda: s.mu_ratio(0.1, 0.5), few)),
        ("one call", "`s.evaluate(**case)`: value, bound, regime"): (
            few,
            repeated(lambda: s.evaluate(**CASE), few),
        ),
        ("one call", f"scipy, linear, {n} x {n}"): (
            few,
            repeated(lambda: by_name[LINEAR](one, some), few),
        ),
        ("one call", f"scipy, cubic spline, {n} x {n}"): (
            few,
            repeated(lambda: by_name[SPLINE](one, some), few),
        ),
        ("one call", "full model, `solve(v, y)`"): (few, lambda: [solve(*x) for x in at]),
        ("one call", "the equations of motion by scipy's `solve_ivp`"): (
            len(marched),
            lambda: [march(*x) for x in marched],
        ),
    }
    progress(f"{rounds} rounds of {len(work)} calls")
    best = best_of(1 if quick else 3, {str(name): call for name, (_, call) in work.items()})
    times = {name: best[str(name)] / cases for name, (cases, _) in work.items()}
    times |= over_http(quick) | of_processes(quick)
    rows, first = [], dict[str, float]()
    for (kind, method), seconds in times.items():
        first.setdefault(kind, seconds)
        ratio = quantity(seconds / first[kind])
        rows.append([kind, method, _time(seconds), ratio])
    text = (
        f"The array has {count:,} cases. Processor time of one thread; of requests that of the "
        f"service, with {FINEST.stem}."
    )
    header = ("where", "method", "a case", "times the first")
    return f"{text}\n\n{markdown(header, rows, 2)}"


def _time(seconds: float) -> str:
    """A time in the unit that suits it."""
    for unit, scale in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if seconds >= scale:
            return f"{quantity(seconds / scale)} {unit}"
    return f"{quantity(seconds / 1e-9)} ns"


def over_http(quick: bool) -> dict[tuple[str, str], float]:
    """Processor seconds of the service for one case: of a request, and of a batch."""
    number, cases = (64, 1000) if quick else (3200, 100_000)
    speeds = np.geomspace(1e-3, 1.0, cases).tolist()
    # as any client writes it
    body = json.dumps({**CASE, "v0": speeds}).encode()
    kinds: dict[tuple[str, str], tuple[int, Callable[[Any], None]]] = {
        ("one request", "`POST /v1/mu-macro`"): (
            number,
            lambda server: ask(server, FORMS["POST"], number, 1),
        ),
        ("batch", f"`POST {BATCH}`, {cases:,} cases in columns"): (
            cases,
            lambda server: batch(server, body),
        ),
    }
    out = {}
    with serving(FINEST) as server:
        for name, (count, call) in kinds.items():
            call(server)
            least = float("inf")
            for _ in range(1 if quick else 5):
                before = server.busy()
                call(server)
                least = min(least, server.busy() - before)
            out[name] = least / count
    return out


def of_processes(quick: bool) -> dict[tuple[str, str], float]:
    """Processor seconds of new processes."""
    programs = {
        "`mumacro.open().evaluate(**case)`": ONE_CASE.format(case=CASE),
        "`import scipy.interpolate`": "import scipy.interpolate",
        "`import numpy`": "import numpy",
    }
    least = dict.fromkeys(programs, float("inf"))
    for _ in range(1 if quick else 5):
        for name, program in programs.items():
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            least[name] = min(least[name], spent)
    return {("a new process", name): seconds for name, seconds in least.items()}


# --- where the errors are -------------------------------------------------------------------------


def error_map(points: int, rounds: int, quick: bool) -> str:  # noqa: ARG001
    """Error and bound of one table over v~ and y~; a full run draws both."""
    s, n = Surrogate.open(1e-7, threads=1), 30 if quick else 300
    # between the nodes of any plain grid
    v, y = (np.geomspace(*SQUARE, 2 * n + 1)[1::2] for _ in range(2))
    with Sweep(WORKERS) as sweep:
        mu = sweep.solve("full", v[:, None], y[None, :])["mu_ratio"]
    value, bound, source = s.quantity("mu_ratio", v[:, None], y[None, :])
    error = np.abs(value - mu)
    if not quick:
        save(
            IMAGES / "error_map.png",
            partial(_map, s, v, y, error, bound),
            dpi=100,
            ncols=2,
            figsize=(10.0, 4.6),
        )
    rows = []
    for code in np.unique(source):
        at = source == code
        share = f"{100.0 * float(np.mean(at)):.1f}"
        numbers = (np.quantile(error[at], 0.5), error[at].max(), bound[at].max())
        rows.append([atlas.SOURCES[code], share, *(quantity(float(x)) for x in numbers)])
    header = ("block or closed form", "% of the map", "median error", "largest", "largest bound")
    return f"{s.id}, {error.size:,} fresh solves:\n\n{markdown(header, rows)}"


# --- convergence ----------------------------------------------------------------------------------

DECADES = range(-2, -13, -1)


def convergence(points: int, rounds: int, quick: bool) -> str:  # noqa: ARG001
    """Error of blocks and of grids over what they cost: solves, bytes of a file, seconds."""
    v, y, mu = truth(quick)
    lines: dict[str, list[tuple[float, ...]]] = {}
    rows = []
    for decade in (-3, -6) if quick else DECADES:
        tolerance = 10.0**decade
        progress(f"blocks for {tolerance:.0e}")
        with Sweep(1) as sweep:
            before = process_time()
            table = _one_spring(sweep, tolerance)
            seconds, solves = process_time() - before, sweep.n_solves
        error = np.abs(Surrogate(table, "built").on_threads(1).mu_ratio(v, y) - mu)
        largest, most = float(error.max()), float(np.quantile(error, 0.99))
        cost = solves, _bytes(table), seconds
        lines.setdefault(OURS, []).append((*cost, largest, most))
        texts = f"{cost[0]:,}", f"{cost[1]:,}", *map(quantity, (seconds, largest, most))
        rows.append([f"blocks, {tolerance:.0e}", *texts])
    for n in QUICK_GRIDS if quick else (16, 32, 64, 128, 256, 512):
        with Sweep(1) as sweep:
            before = process_time()
            values = solve_grid(sweep, n)
            seconds = process_time() - before
        for c in on_grid(values):
            if c.name in (LINEAR, SPLINE):
                error = np.abs(c.evaluate(v, y) - mu)
                largest, most = float(error.max()), float(np.quantile(error, 0.99))
                lines.setdefault(c.name, []).append((n * n, 8 * n * n, seconds, largest, most))
                texts = f"{n * n:,}", f"{8 * n * n:,}", *map(quantity, (seconds, largest, most))
                rows.append([f"{LOOKS[c.name][0]}, {n} x {n}", *texts])
    if not quick:
        picture = partial(_convergence, lines)
        save(IMAGES / "convergence.png", picture, dpi=100, ncols=3, figsize=(12.0, 4.6))
    header = ("built for", "solves", "bytes", "seconds", "max abs error", "99 % abs error")
    return (
        "Border and blocks of one spring across, with friction, power and stick fraction; without "
        "plain grid, ball and verification. Seconds are processor time.\n\n"
        f"{markdown(header, rows)}"
    )


def _one_spring(sweep: Sweep, tolerance: float) -> Table:
    """The border and the blocks of one spring, as a build makes them before it measures errors."""
    border = Border(pieces := build_border(sweep, tolerance))
    solved, entry = spring(sweep), TabulatedContact("spring", [], {"tolerance": tolerance})
    entry.blocks += [
        round_block(build_block(solved, i, border, tolerance), tolerance)
        for i in range(len(entry.charts))
    ]
    # a file needs some plain grid: the smallest that there is
    axis, plane = np.ones(1), np.ones((1, 1))
    quantities = {"quantities": " ".join(QUANTITY_NAMES)}
    return Table(pieces, {"spring": entry}, axis, axis, plane, plane, plane, axis, quantities)


def _bytes(table: Table) -> int:
    with tempfile.TemporaryDirectory() as folder:
        write_table(table, path := Path(folder) / "blocks.nc")
        return path.stat().st_size


# --- tails ----------------------------------------------------------------------------------------


def tails(points: int, rounds: int, quick: bool) -> str:
    """What blocks and closed forms far outside cost, and how well they join."""
    s, n = Surrogate.open(FINEST, threads=1), 2000 if quick else min(points, 200_000)
    rng = np.random.default_rng(3)

    def drawn(low: float, high: float) -> Array:
        return log_uniform(rng, low, high, n)

    y = drawn(1e-3, 1e3)
    far, large = drawn(1.32e5, 1e12), drawn(1.5, 1e5)
    places = {
        "speed, amplitude from 1e-3 to 1e3, blocks": (drawn(1e-3, 1e3), y),
        "corner: speed below 0.2 of the border": (
            (y_corner := rng.uniform(0.75, 1.5, n)) * 0.0
            + drawn(1e-4, 0.2) * s.v_tilde_crit(y_corner),
            y_corner,
        ),
        "creep: speed from 1e-12 to 1e-4": (drawn(1e-12, 1e-4), y),
        "small amplitude: from 1e-9 to 1e-3": (drawn(1e-3, 1e3), drawn(1e-9, 1e-3)),
        "large speed: above 128 times the border": (
            drawn(130.0, 1e6) * s.v_tilde_crit(large),
            large,
        ),
        "large amplitude: from 1.3e5 to 1e12": (s.v_tilde_crit(far) * drawn(1e-3, 10.0), far),
    }
    work = {name: partial(s.mu_ratio, *at) for name, at in places.items()}
    best = best_of(rounds, work)
    usual = next(iter(best.values()))
    rows = [[name, quantity(1e9 * best[name] / n), f"{best[name] / usual:.1f}"] for name in places]
    joins = []
    low, high = 1.0 - 1e-15, 1.0 + 1e-15
    y = drawn(1e-3, 1e7)
    edge = rng.uniform(atlas.Y_STICK_LO, atlas.Y_STICK_HI, n)
    above = drawn(atlas.Y_CONT, 1e8)
    pairs: dict[str, tuple[Array, Array, Array, Array]] = {
        "border": ((v := s.v_tilde_crit(y)) * low, v * high, y, y),
        "edge of the corner": (
            (v := s.v_tilde_crit(edge) * atlas.SIGMA_CUT**2) * low,
            v * high,
            edge,
            edge,
        ),
        "large speed, closed form": ((v := fast_from(s, above)) * low, v * high, above, above),
    }
    for seam in SEAMS:
        v = drawn(1e-9, 1e5)
        name = "tail, " if seam == atlas.Y_TAIL else ""
        pairs[f"{name}amplitude {seam:,g}"] = (
            v,
            v,
            np.full(n, seam * low),
            np.full(n, seam * high),
        )
    for name, (v1, v2, y1, y2) in pairs.items():
        (one, of_one, _), (other, of_other, _) = (
            s.quantity("mu_ratio", *at) for at in ((v1, y1), (v2, y2))
        )
        jump = np.abs(one - other)
        numbers = (jump / one).max(), (jump / (of_one + of_other)).max()
        joins.append([name, *(quantity(float(x)) for x in numbers)])
    header = ("where the table joins", "largest jump over mu~", "largest jump over both bounds")
    return (
        f"{s.id}, {n:,} random points in each place.\n\n"
        f"{markdown(('place', 'ns/point', 'times the first'), rows)}\n\nPoints 2e-15 apart, one "
        f"on each side:\n\n{markdown(header, joins)}"
    )


# --- pictures -------------------------------------------------------------------------------------


def _legend(axes: Any, columns: int) -> None:
    """The names of the lines of ``axes``, above all panels."""
    axes.figure.legend(
        *axes.get_legend_handles_labels(),
        loc="outside upper center",
        ncols=columns,
        fontsize=9,
        frameon=False,
    )


def _by_name(found: Sequence[Measured]) -> dict[str, list[Measured]]:
    return {name: [m for m in found if m.contender.name == name] for name in LOOKS}


def _over_time(found: Sequence[Measured], direct: float, axes: Any) -> None:
    """ns a point over the error: filled the largest, hollow the one that 99 % do not exceed."""
    for name, some in _by_name(found).items():
        label, color, mark = LOOKS[name]
        ns = [m.ns for m in some]
        axes.plot([m.largest for m in some], ns, mark + "-", color=color, label=label)
        axes.plot(
            [m.most for m in some], ns, mark + ":", color=color, mfc="white", lw=1.0, zorder=1.5
        )
    axes.axhline(direct, color="#222222", lw=1.2)
    axes.annotate(
        "one solve of the model",
        (0.02, direct),
        (0, 4),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        fontsize=9,
    )
    axes.set(
        xlabel=f"{ERROR}: filled the largest, hollow of 99 %", ylabel="ns per point, one thread"
    )
    logarithmic(axes)
    axes.set_ylim(bottom=4.0)
    _legend(axes, 3)


def _over_size(found: Sequence[Measured], panels: Any) -> None:
    """Error over bytes in memory, the largest and that of 99 %."""
    for axes, title, of in zip(panels, ("largest", "99 %"), ("largest", "most"), strict=True):
        for name, some in _by_name(found).items():
            label, color, mark = LOOKS[name]
            sizes, errors = zip(*((m.contender.memory, getattr(m, of)) for m in some), strict=True)
            axes.plot(sizes, errors, mark + "-", color=color, label=label)
        axes.set_xlim(1e3, 2e7)
        axes.set(xlabel="bytes in memory", ylabel=rf"error of $\tilde\mu$, {title}")
        logarithmic(axes)
    _legend(panels[0], 3)


def _convergence(lines: dict[str, list[tuple[float, ...]]], panels: Any) -> None:
    costs = ("solves", "bytes of the file", "seconds to build, one thread")
    for i, (axes, cost) in enumerate(zip(panels, costs, strict=True)):
        for name, points in lines.items():
            label, color, mark = LOOKS[name]
            label = "blocks" if name == OURS else label
            x = [point[i] for point in points]
            axes.plot(x, [point[3] for point in points], mark + "-", color=color, label=label)
            most = [point[4] for point in points]
            axes.plot(x, most, mark + ":", color=color, mfc="white", lw=1.0, zorder=1.5)
        axes.set(xlabel=cost, ylabel=r"error of $\tilde\mu$: filled the largest, hollow of 99 %")
        logarithmic(axes)
    _legend(panels[0], 3)


def _map(s: Surrogate, v: Array, y: Array, error: Array, bound: Array, panels: Any) -> None:
    from matplotlib.colors import LogNorm

    colours = LogNorm(1e-12, 1e-7)
    for axes, values, title in zip(panels, (error, bound), ("error", "bound"), strict=True):
        drawn = axes.pcolormesh(
            v, y, np.maximum(values, 1e-30).T, norm=colours, cmap="viridis", rasterized=True
        )
        axes.plot(s.v_tilde_crit(y), y, "--", color="white", lw=1.0)
        axes.set(xscale="log", yscale="log", xlim=SQUARE, ylim=SQUARE, title=f"{title}, {s.id}")
        axes.set(xlabel=r"$\tilde v$", ylabel=r"$\tilde y$")
        axes.grid(visible=False)
    panels[0].figure.colorbar(drawn, ax=panels, extend="both", label=r"of $\tilde\mu$")


# --- what other scripts measure, in the same run --------------------------------------------------


def small(points: int, rounds: int, quick: bool) -> str:  # noqa: ARG001
    """Small calls, of calls.py."""
    return calls.small(points, quick)


def ball_speed_against_error(points: int, rounds: int, quick: bool) -> str:
    """A ball, of ball.py."""
    return ball.ball_speed_against_error(points // 5, rounds, quick)


SECTIONS = sections(
    speed,
    headline,
    which_table,
    users,
    small,
    error_map,
    convergence,
    tails,
    ball_speed_against_error,
)

if __name__ == "__main__":
    main(__doc__, SECTIONS, points=1_000_000, rounds=5, quick=False)

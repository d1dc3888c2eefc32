"""Errors over their estimates, times and pictures of `mumacro.motion`.

python benchmarks/motion.py [--only SECTION] [--share 0.01]

Motions are random: up to three harmonics of 1 to 5 along and across, up to two of the load, drags
from 1e-3 to 10 of the amplitude or of mu0 Fz / k, every tenth at rest.
"""

from tests.support.measuring import IMAGES, best_of, main, markdown, quantity, sections

# isort: split

import functools
import itertools
import math
import time
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mumacro import Surrogate, motion
from mumacro.plotting import BLUE, GREY, INK, OF_CYCLE, RED, head, save

Array = NDArray[np.float64]
CASE: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "omega": 1e5}
L0 = 3e-6  # m, mu0 Fz / k
#: motions, tolerance, how many, and the tolerance of what they are compared with
SEARCHES = (
    ("spring", 1e-4, 10_000, 1e-8),
    ("spring", 1e-6, 10_000, 1e-9),
    ("spring", 1e-7, 5_000, 1e-9),
    ("ball, one harmonic", 1e-4, 10_000, 1e-6),
    ("ball", 1e-6, 2_000, 1e-8),
    ("ball, v0 = 0", 1e-6, 500, 1e-8),
    ("spring, slow drag", 1e-6, 9_000, 1e-8),
    ("ball, slow drag", 1e-6, 300, 1e-7),
)
AGAINST_TABLES = (
    ("spring", "across", 20_000),
    ("spring", "along", 20_000),
    ("spring", "normal", 20_000),
    ("ball", "across", 2_000),
    ("ball", "along", 2_000),
)


def random_motions(n: int, ball: bool = False, seed: int = 1) -> Iterator[dict[str, Any]]:
    """Keywords of ``motion``."""
    rng = np.random.default_rng(seed)
    for _ in range(n):
        size = 10.0 ** rng.uniform(-2.0, 2.0)
        counts = [*rng.integers(0, 4, 2), 0 if ball else rng.integers(0, 3)]
        if not any(counts[:2]):
            counts[rng.integers(0, 2)] = 1
        parts = []
        for count in counts:
            orders = rng.integers(1, 6, count)
            amplitudes = rng.uniform(0.0, 1.0, count) * 10.0 ** rng.uniform(-1.0, 0.0)
            even = rng.random(count) < 0.2  # phases at which events may coincide
            phases = np.where(even, 90.0 * rng.integers(0, 4, count), rng.uniform(0, 360, count))
            parts.append([*zip(orders.tolist(), amplitudes, phases, strict=True)])
        x, y = ([(o, a * size * L0, p) for o, a, p in part] for part in parts[:2])
        total = sum(a for _, a, _ in parts[2]) or 1.0
        swing = rng.uniform(0.01, 0.98) * CASE["Fz"]
        normal = [(o, a / total * swing, p) for o, a, p in parts[2]]
        drag = 10.0 ** rng.uniform(-3.0, 1.0) * (size if rng.random() < 0.5 else 1.0)
        v0 = 0.0 if rng.random() < 0.1 else drag * L0 * CASE["omega"]
        yield {**CASE, "v0": v0, "x": x or 0.0, "y": y or 0.0, "normal": normal or 0.0}


def resting_motions(n: int, ball: bool = False, seed: int = 1) -> Iterator[dict[str, Any]]:
    """Those of ``random_motions`` without drag."""
    many = random_motions(100 * n, ball, seed)
    return itertools.islice((case for case in many if not case["v0"]), n)


def slow_motions(n: int, ball: bool = False, seed: int = 1) -> Iterator[dict[str, Any]]:
    """Those of ``random_motions`` with drags from 1e-9 to 1e-3 of mu0 Fz / k per radian."""
    rng = np.random.default_rng(seed)
    for case in random_motions(n, ball, seed):
        yield {**case, "v0": 10.0 ** rng.uniform(-9.0, -3.0) * L0 * CASE["omega"]}


def single_harmonics(n: int, seed: int = 1) -> Iterator[dict[str, Any]]:
    """Keywords of ``motion`` with one harmonic along or across, log-uniform, dragged."""
    rng = np.random.default_rng(seed)
    for _ in range(n):
        drag, size = 10.0 ** rng.uniform(-4.0, 1.5), 10.0 ** rng.uniform(-2.0, 2.0)
        name = "x" if rng.random() < 0.5 else "y"
        yield {**CASE, "v0": drag * L0 * CASE["omega"], name: size * L0}


class Deviations(NamedTuple):
    """Of random motions from finer cycles, each (n,)."""

    error: Array  #: of the mean force over Fz
    estimate: Array  #: of both
    most: Array  #: what the tolerances allow the estimate
    stick: Array  #: of the stick fraction
    path: Array  #: of the slip path, over itself plus mu0 Fz / k


def deviations(kind: str, tolerance: float, finer: float, n: int, seed: int = 1) -> Deviations:
    """``kind`` is "spring" or "ball", alone or with ", one harmonic", ", v0 = 0", ", slow drag"."""
    contact, _, which = kind.partition(", ")
    if which == "one harmonic":
        cases = single_harmonics(n, seed)
    elif which == "v0 = 0":
        cases = resting_motions(n, contact == "ball", seed)
    elif which == "slow drag":
        cases = slow_motions(n, contact == "ball", seed)
    else:
        cases = random_motions(n, contact == "ball", seed)
    rows = []
    for case in cases:
        a, b = (motion(**case, contact=contact, tolerance=t) for t in (tolerance, finer))
        rows.append(
            (
                math.hypot(a.mu_macro - b.mu_macro, a.mu_lateral - b.mu_lateral),
                a.error_estimate + b.error_estimate,
                (tolerance + finer) * CASE["mu0"],
                abs(a.stick_fraction - b.stick_fraction),
                abs(a.slip_path - b.slip_path) / (L0 + b.slip_path),
            )
        )
    return Deviations(*np.array(rows).T)


def errors(share: float = 1.0) -> str:
    """Error over estimate of random motions beside cycles of a finer tolerance."""
    rows = []
    for kind, tolerance, n, finer in SEARCHES:
        off = deviations(kind, tolerance, finer, max(1, round(share * n)))
        ratio, within = off.error / off.estimate, off.estimate <= off.most
        rows.append(
            [
                f"{kind}, {tolerance:g}",
                f"{ratio.size:,}",
                *(quantity(float(x)) for x in np.quantile(ratio, (0.5, 0.99, 1.0))),
                f"{np.count_nonzero(ratio > 1.0)}",
                quantity(float(off.error.max() / CASE["mu0"])),
                f"{np.count_nonzero(~within)}",
                *(quantity(float(x[within].max())) for x in (off.stick, off.path)),
            ]
        )
    header = (
        "motion, tolerance",
        "motions",
        "error/estimate: median",
        "99 %",
        "largest",
        "above 1",
        "largest error/mu0",
        "given up",
        "stick fraction off",
        "slip path off",
    )
    return markdown(header, rows)


def table_points(direction: str, n: int, seed: int = 2) -> tuple[Array, Array]:
    """v~ and y~, log-uniform, of the load's oscillation uniform."""
    rng = np.random.default_rng(seed)
    y = 10.0 ** rng.uniform(-2.0, 4.0, n)
    return 10.0 ** rng.uniform(-4.0, 1.5, n), rng.uniform(
        0.01, 0.99, n
    ) if direction == "normal" else y


def beside_table(contact: str, direction: str, n: int, seed: int = 2) -> tuple[Array, Array]:
    """Errors of mu_macro/mu0 beside the table, and estimate plus bound, (n,)."""
    v, y = table_points(direction, n, seed)
    case = {**CASE, "v0": v * L0 * CASE["omega"]}
    name = {"across": "y", "along": "x", "normal": "normal"}[direction]
    size = y * (CASE["Fz"] if direction == "normal" else L0)
    field = "Fz_amplitude" if direction == "normal" else "y0"
    moving: Any = {**case, name: size, "contact": contact}
    tabulated: Any = {**case, field: size, "contact": contact, "direction": direction}
    a, b = motion(**moving), Surrogate.open().evaluate(**tabulated)
    error = np.hypot(a.mu_macro - b.mu_macro, a.mu_lateral)
    return error / CASE["mu0"], (a.error_estimate + b.error_bound) / CASE["mu0"]


def beside_tables(share: float = 1.0) -> str:
    """Single harmonics beside the tables: the error over estimate plus bound."""
    rows = []
    for contact, direction, n in AGAINST_TABLES:
        error, off = beside_table(contact, direction, max(10, round(share * n)))
        cells = (float(np.median(error)), float(error.max()), float((error / off).max()))
        rows.append([f"{contact} {direction}", f"{error.size:,}", *map(quantity, cells)])
    header = ("", "points", "median error/mu0", "largest", "error over estimate and bound")
    return markdown(header, rows)


def times(share: float = 1.0) -> str:
    """Processor time of one motion at 1e-6, and 1,000 cases of one motion, dragged, on all
    processors."""
    rows = []
    for contact, n in (("spring", 1000), ("ball", 300)):
        each: dict[bool, list[float]] = {False: [], True: []}  # by whether it is at rest
        for case in random_motions(max(3, round(share * n)), contact == "ball", seed=5):
            call = functools.partial(motion, **case, contact=contact, threads=1)
            each[case["v0"] == 0.0].append(1e3 * best_of(1, {"": call})[""])
        rng = np.random.default_rng(3)
        many = max(10, round(1000 * share))
        case = {
            **CASE,
            "v0": 10.0 ** rng.uniform(-3, 0, many),
            "x": (10.0 ** rng.uniform(-8, -4, many), rng.uniform(0, 360, many)),
            "y": 10.0 ** rng.uniform(-8, -4, many),
        }
        start, used = time.perf_counter(), time.process_time()
        motion(**case, contact=contact)
        wall, used = time.perf_counter() - start, time.process_time() - used
        at_once = [f"{many:,}", f"{wall:.2f}", f"{used:.2f}"]
        for rest, cells in ((False, at_once), (True, ["", "", ""])):
            quantiles = np.quantile(each[rest] or [math.nan], (0.5, 0.9, 0.99, 1.0))
            name = f"{contact}, v0 = 0" if rest else f"{contact}, dragged"
            rows.append([name, *(f"{x:.2f}" for x in quantiles), *cells])
    header = (
        "",
        "one, median [ms]",
        "90 %",
        "99 %",
        "slowest",
        "cases at once",
        "seconds",
        "of one processor",
    )
    return markdown(header, rows)


def wide_motions(n: int, ball: bool, seed: int = 6) -> Iterator[dict[str, Any]]:
    """Yield keywords of ``motion`` in SI units over decades of every input, every tenth at rest:
    from contacts that hardly slip to such as are all but rigid, at most 3e8 mu0 Fz / k."""
    rng = np.random.default_rng(seed)
    while n:
        mu0, Fz, k, f = 10.0 ** rng.uniform((-2.0, -2.0, 4.0, 0.0), (0.0, 3.0, 11.0, 6.0))
        x, y, way = 10.0 ** rng.uniform(-9.0, -4.0, 3)
        if max(x, y, way) * k > 3e8 * mu0 * Fz:
            continue
        n -= 1
        v0 = 0.0 if rng.random() < 0.1 else 2.0 * math.pi * f * way
        phases = rng.uniform(0.0, 360.0, 3)
        case: dict[str, Any] = {"mu0": mu0, "Fz": Fz, "k": k, "f": f, "v0": v0}
        case |= {"x": (x, phases[0]), "y": (y, phases[1])}
        if not ball and rng.random() < 0.3:
            case["normal"] = (Fz * rng.uniform(0.0, 0.95), phases[2])
        yield case


def drawn(share: float = 1.0) -> str:
    """Processor time of single motions over decades of every input at 1e-6, and how many give
    up."""
    rows = []
    for contact in ("spring", "ball"):
        n = max(10, round(5_000 * share))
        ms, lost = [], 0
        for case in wide_motions(n, contact == "ball"):
            start = time.process_time()
            answer = motion(**case, contact=contact, tolerance=1e-6, threads=1)
            ms.append(1e3 * (time.process_time() - start))
            lost += answer.error_estimate > 1e-6 * case["mu0"]
        quantiles = np.quantile(ms, (0.5, 0.99, 0.999, 1.0))
        rows.append([contact, f"{n:,}", *map(quantity, quantiles.tolist()), f"{lost:,}"])
    return markdown(
        ("contact", "motions", "median [ms]", "99 %", "99.9 %", "slowest", "given up"), rows
    )


PHASES = np.linspace(0.0, 360.0, 73)
SPEEDS = (0.02, 0.1, 0.5)  # m/s
LOOKS = ((BLUE, "-"), (RED, "--"), (INK, "-."))  # of their curves


def phase_sweep(v0: float) -> Array:
    """mu_macro/mu0 over the phase between an oscillation along and that of the load, (73,)."""
    case: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3, "v0": v0}
    return np.asarray(motion(**case, x=4e-6, normal=(5.0, PHASES)).mu_macro) / 0.3


def pictures(share: float = 1.0) -> str:  # noqa: ARG001 - every section gets it
    """Writes the pictures of docs/how-to/motion.md, and prints the phase sweep at its ends."""
    case: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3, "v0": 0.02}
    cycle = motion(**case, x=(2e-6, 90), y=4e-6)
    save(IMAGES / "motion-ellipse.png", cycle.plot, dpi=110, **OF_CYCLE)
    rows: list[list[str]] = []
    save(
        IMAGES / "motion-phase.png",
        lambda axes: rows.extend(_draw_phases(axes)),
        figsize=(6.4, 4.2),
        dpi=110,
    )
    header = ("v0 [m/s]", "least mu_macro/mu0", "at [degrees]", "most", "at [degrees]")
    return markdown(header, rows)


def _draw_phases(axes: Any) -> list[list[str]]:
    """The phase sweeps, and their ends."""
    rows = []
    for v0, (color, dashes) in zip(SPEEDS, LOOKS, strict=True):
        ratio = phase_sweep(v0)
        axes.plot(PHASES, ratio, color=color, ls=dashes, lw=2.0, label=f"$v_0$ = {v0:g} m/s")
        low, high = int(ratio.argmin()), int(ratio.argmax())
        rows.append(
            [
                f"{v0:g}",
                f"{ratio[low]:.3f}",
                f"{PHASES[low]:.0f}",
                f"{ratio[high]:.3f}",
                f"{PHASES[high]:.0f}",
            ]
        )
    axes.axhline(0.0, lw=0.8, color=GREY)
    axes.set(
        xlabel="phase of the load [degrees]",
        ylabel=r"$\mu_\mathrm{macro}/\mu_0$ [-]",
        xticks=np.arange(0, 361, 45),
    )
    head(axes, r"$\mu_0$ = 0.3, $F_z$ = 10 ± 5 N, $k$ = 1 N/µm, $x_0$ = 4 µm, $f$ = 20 kHz; spring")
    return rows


SECTIONS = sections(errors, beside_tables, times, drawn, pictures)

if __name__ == "__main__":
    main(__doc__, SECTIONS, share=1.0)

"""``solve_motion`` beside a scan of 2,000 points in random problems, its time, and its picture.

python benchmarks/solve_motion.py [--only SECTION] [--share 0.01]

Problems are springs with oscillations in x, y and the load, an unknown, and a target that a scan of
the unknown crosses.
"""

from tests.support.measuring import IMAGES, main, sections  # isort: split

import math
import sys
import time
from collections import Counter
from typing import Any

import numpy as np

import mumacro
from mumacro.motions.solve_motion import UNKNOWNS, MotionCurve
from mumacro.plotting import INK, head, save

PROBLEMS, FINE = 1000, 2000
POSSIBLE = [name for name in UNKNOWNS if name != "omega"]
CONVEYOR: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e5, "f": 50.0, "x": 1e-4}
BALL: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3, "x": 2e-6, "y": 1e-6}
BALL["contact"] = "ball"
PHASES = np.linspace(0.0, 360.0, 73)


def problem(rng: np.random.Generator) -> tuple[str, dict[str, Any]]:
    """An unknown and a motion without it, in units of mu0 Fz = k = omega = 1."""
    unknown = str(rng.choice(POSSIBLE))
    case: dict[str, Any] = {
        "mu0": 0.3,
        "Fz": 1.0 / 0.3,
        "k": 1.0,
        "f": 1.0 / (2.0 * math.pi),
        "v0": float(10.0 ** rng.uniform(-2.5, 0.5)),
    }
    for part in ("x", "y"):
        case[part] = (float(10.0 ** rng.uniform(-0.7, 0.9)), float(rng.uniform(0.0, 360.0)))
    case["normal"] = (float(rng.uniform(0.1, 0.9)) * case["Fz"], float(rng.uniform(0.0, 360.0)))
    name, _, member = unknown.partition(".")
    if not member:
        del case[name]
        if name == "Fz":
            case["normal"] = 0.0
    return unknown, case


def crossings(x: Any, gap: Any) -> list[tuple[float, float]]:
    """Neighbours of a scan between which the gap changes its sign."""
    legal = np.isfinite(gap)
    x, gap = x[legal], gap[legal]
    return [(x[i], x[i + 1]) for i in np.flatnonzero(gap[:-1] * gap[1:] < 0.0)]


def search(share: float = 1.0) -> str:
    """Crossings of a scan without a root, and roots that the motion does not confirm."""
    rng = np.random.default_rng(20261127)
    counts, several, spent, samples = Counter[str](), 0, 0.0, 0
    missed, wrong = list[object](), list[object]()
    problems = max(round(share * PROBLEMS), 1)
    for done in range(1, problems + 1):
        if done % 100 == 0:
            print(f"{done} problems, {len(missed)} roots missed", file=sys.stderr, flush=True)
        unknown, case = problem(rng)
        x = mumacro.solve_motion(unknown, 1e9, **case).samples[0]  # how its range is spread
        fine = np.interp(np.linspace(0.0, 1.0, FINE), np.linspace(0.0, 1.0, x.size), x)
        mean, _ = MotionCurve(unknown, "mu_macro", case).evaluate(fine)
        target = float(np.nanquantile(mean, rng.uniform(0.1, 0.9)))
        start = time.perf_counter()
        solution = mumacro.solve_motion(unknown, target, **case)
        spent += time.perf_counter() - start
        samples += solution.samples[0].size
        roots, places = solution.roots[0], crossings(fine, mean - target)
        several += len(places) > 1
        counts[unknown] += 1
        for a, b in places:
            met = any(root.low <= b and root.high >= a for root in roots)
            whole_turn = unknown.endswith("phase") and (a < 1e-3 or b > 360.0 - 1e-3)
            if not (met or whole_turn):
                missed.append((unknown, case, target, a, b))
        wrong += [root for root in roots if abs(root.mean - target) > 2.0 * root.error_estimate]
    kinds = ", ".join(f"{name} {count}" for name, count in sorted(counts.items()))
    lines = [
        f"{problems} problems, {several} with several roots ({kinds}): {len(missed)} roots missed, "
        f"{len(wrong)} off by more than twice their estimate.",
        f"{1e3 * spent / problems:.0f} ms and {samples / problems:.0f} motions a problem.",
        *(f"FAILED: {one}" for one in (*missed, *wrong)),
    ]
    return "\n".join(lines)


def times(share: float = 1.0) -> str:
    """Of one transport speed, and of 1,000 targets of one motion of a spring and of a ball."""
    conveyor = {**CONVEYOR, "normal": (8.0, -90.0)}
    targets = np.linspace(-0.1, 0.29, max(round(share * PROBLEMS), 1))

    def spent(target: Any, case: dict[str, Any] = conveyor) -> tuple[float, float, int]:
        elapsed, processor = time.perf_counter(), time.process_time()
        solution = mumacro.solve_motion("v0", target, **case)
        number = sum(map(len, solution.roots))
        return time.perf_counter() - elapsed, time.process_time() - processor, number

    one = min(spent(0.0) for _ in range(7))
    many = spent(targets)
    balls = spent(np.linspace(0.11, 0.28, targets.size), BALL)
    return (
        f"One transport speed: {1e3 * one[0]:.0f} ms, {1e3 * one[1]:.0f} ms of processor time.\n"
        f"{targets.size} targets, {many[2]} roots: {many[0]:.1f} s, {many[1]:.1f} s of processor "
        f"time; of a ball, {balls[2]} roots: {balls[0]:.1f} s, {balls[1]:.1f} s of processor time."
    )


def picture(share: float = 1.0) -> str:  # noqa: ARG001 - every section gets it
    """Writes the picture of docs/how-to/motion.md: transport speed over the phase of the load."""
    speeds = np.full(PHASES.size, np.nan)
    for i, phase in enumerate(PHASES):
        roots = mumacro.solve_motion("v0", 0.0, **CONVEYOR, normal=(8.0, phase)).roots[0]
        if roots:
            speeds[i] = roots[-1].value
    best = int(np.nanargmax(speeds))

    def draw(axes: Any) -> None:
        axes.plot(PHASES, 1e3 * speeds, label="transport speed")
        axes.plot(PHASES[best], 1e3 * speeds[best], "o", color=INK, mec="white", label="fastest")
        axes.set(
            xlabel="phase of the load [degrees]",
            ylabel="speed at which the mean force is 0 [mm/s]",
            xticks=np.arange(0, 361, 45),
            xlim=(0.0, 360.0),
        )
        axes.set_ylim(bottom=0.0)
        head(axes, r"$\mu_0$ = 0.3, $F_z$ = 10 ± 8 N, $k$ = 0.1 N/µm, $x_0$ = 0.1 mm, $f$ = 50 Hz")

    save(IMAGES / "conveyor.png", draw, dpi=110, figsize=(6.4, 4.2))
    return f"fastest: {1e3 * speeds[best]:.2f} mm/s at {PHASES[best]:g} degrees"


SECTIONS = sections(search, times, picture)

if __name__ == "__main__":
    main(__doc__, SECTIONS, share=1.0)

"""How often the intervals of k and mu0 from noisy loops hold the truth, how long a fit takes, and
the picture of the how-to.

python benchmarks/loops.py [--write] [--loops 2000]    # also draws docs/img/loop.png
"""

from tests.support.measuring import IMAGES, best_of, main, markdown, sections  # isort: split

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

import mumacro
from mumacro.kernel.arrays import Array
from mumacro.kernel.binding import kernels
from mumacro.plotting import OF_FIT, save

MU0, FZ = 0.3, 10.0
SEED = 20


class Loop(NamedTuple):
    """A loop without noise, and what it was made of."""

    contact: str
    x: Array
    force: Array
    k: float
    noise: float
    share: float  #: of a branch that sticks


def forces(contact: str, x: Array, k: float, before: int = 0) -> Array:
    """The force of the model [N] at places x."""
    rows, _ = kernels[-1].loop_forces(
        int(contact == "ball"), np.array([k / MU0]), x, np.full(x.size, FZ), before
    )
    return np.asarray(MU0 * rows[0])


def random_loops(n: int, seed: int = SEED) -> Iterator[Loop]:
    """Sines and triangles of 1 to 5 cycles, 20 to 5,000 samples, 5 to 95 % of a branch sticking,
    noise from 0.2 to 5 % of mu0 Fz."""
    random = np.random.default_rng(seed)
    for i in range(n):
        contact = ("spring", "ball")[i % 2]
        samples = int(np.exp(random.uniform(math.log(20.0), math.log(5000.0))))
        most = min(5, samples // 12)
        cycles = int(random.integers(1, most + 1))
        share = random.uniform(0.05, 0.95)
        tau = 2.0 * math.pi * (cycles * np.linspace(0.0, 1.0, samples) + random.uniform())
        way = np.sin(tau) if random.uniform() < 0.5 else np.arcsin(np.sin(tau)) / (0.5 * math.pi)
        k = 10.0 ** random.uniform(4.0, 8.0)
        slip = (1.5 if contact == "ball" else 1.0) * MU0 * FZ / k
        x = slip / share * way
        force = forces(contact, x, k, samples if cycles == 1 else 0)
        noise = MU0 * FZ * 10.0 ** random.uniform(math.log10(0.002), math.log10(0.05))
        offset = random.normal() * MU0 * FZ
        yield Loop(
            contact, x, force + offset + random.normal(size=samples) * noise, k, noise, share
        )


def judged(loop: Loop) -> dict[str, Any]:
    """Whether the intervals hold the truth, and how wide they are."""
    found = mumacro.fit_loop(loop.x, loop.force, FZ, loop.contact)
    truth = {"k": loop.k, "mu0": MU0}
    held = {
        name: found.interval[name][0] <= value <= found.interval[name][1]
        for name, value in truth.items()
    }
    bound = any(math.isinf(ends[1]) for ends in found.interval.values())
    return {**held, "bound": bound, "notes": found.notes, "found": found}


def held(loops: int) -> str:
    """Shares of the intervals that hold the truth, by contact, samples and stick."""
    rows: dict[str, list[dict[str, Any]]] = {}
    for loop in random_loops(loops):
        result = judged(loop)
        size = (
            "20 to 100" if loop.x.size < 100 else "to 1,000" if loop.x.size < 1000 else "to 5,000"
        )
        for name in (
            "all",
            loop.contact,
            f"{size} samples",
            f"sticks {'below' if loop.share < 0.5 else 'above'} 50 %",
        ):
            rows.setdefault(name, []).append(result)
    lines = []
    for name, results in rows.items():
        shares = [100.0 * np.mean([one[key] for one in results]) for key in ("k", "mu0", "bound")]
        lines.append([name, f"{len(results)}", *(f"{share:.1f} %" for share in shares)])
    return markdown(["loops", "number", "k held", "mu0 held", "a bound is said"], lines)


def times(**_options: Any) -> str:
    """How long a fit of 1,000 samples takes, and draw the picture."""
    tau = np.linspace(0.0, 6.0 * math.pi, 1000)
    x = 6e-6 * np.sin(tau)
    lines = []
    for contact in ("spring", "ball"):
        force = forces(contact, x, 1e6) + np.random.default_rng(1).normal(size=x.size) * 0.1

        def work(force: Array = force, contact: str = contact) -> object:
            return mumacro.fit_loop(x, force, FZ, contact)

        lines.append([contact, f"{1e3 * best_of(5, {'fit': work})['fit']:.0f} ms"])
    draw()
    return markdown(["1,000 samples, three cycles", "fit"], lines)


def draw() -> None:
    """docs/img/loop.png: a noisy loop of a ball."""
    x = 6e-6 * np.sin(np.linspace(0.0, 6.0 * math.pi, 600))
    force = forces("ball", x, 1e6) + np.random.default_rng(1).normal(size=x.size) * 0.08
    save(IMAGES / "loop.png", mumacro.fit_loop(x, force, FZ, "ball").plot, dpi=100, **OF_FIT)


if __name__ == "__main__":
    main(__doc__, sections(held, times), loops=2000)

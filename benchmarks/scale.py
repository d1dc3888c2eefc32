"""Processor time a case up to 1e9 cases: one thread, all threads, one and two worker processes of Dask.

    python benchmarks/scale.py [--largest 1e8] [--write]

Every chunk of cases is generated, evaluated and reduced (mean, extremes, a histogram); no case is stored.  Starting a
worker is not counted; its kernels are loaded before.  Processor time is the sum over all processes: other work on the
machine has little effect on it.
"""

from __future__ import annotations

from benchmarks.measuring import main, markdown, progress, quantity  # isort: split

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from time import process_time
from typing import Any

import dask
import numpy as np
import xarray as xr
from scipy.stats import qmc

from mumacro import Surrogate
from mumacro.inputs import FIELDS
from mumacro.processors import processors

PLAN = 1e12  # cases of the worked plan
CORES = 64  # of the plan's cluster
Reduced = tuple[float, float, float, int]


def points(block_info: Any = None) -> Any:
    """One chunk in (0, 1): a scrambled Sobol set of its own."""
    (place, _), (n, inputs) = block_info[None]["chunk-location"], block_info[None]["chunk-shape"]
    sequence = qmc.Sobol(inputs, bits=52, rng=np.random.default_rng([0, place]))
    return sequence.random_base2((n - 1).bit_length())[:n] + 0.5**53


def design(n: int) -> Any:
    """``n`` cases of six inputs, all varying over decades, in chunks of 2^20."""
    import dask.array as da

    ranges = {"mu0": (0.1, 1.0), "Fz": (1, 100), "k": (1e5, 1e8), "y0": (1e-7, 1e-5), "omega": (1e3, 1e6),
              "v0": (1e-4, 1.0)}  # fmt: skip
    sizes = da.core.normalize_chunks(2**20, (n,))[0]
    u = da.map_blocks(points, chunks=(sizes, (len(ranges),)), dtype=float, meta=np.empty((0, 0)))

    def over(shares: Any, low: float, high: float) -> Any:
        return np.exp(np.log(low) + np.log(high / low) * shares)

    columns = {
        name: ("case", u[:, i].map_blocks(over, *ends, dtype=float)) for i, (name, ends) in enumerate(ranges.items())
    }
    return xr.Dataset(columns)


def lazy(surrogate: Surrogate, n: int) -> Reduced:
    """Generate, evaluate and reduce with Dask's current scheduler, chunk by chunk."""
    import dask.array as da

    ratio = surrogate.evaluate(design(n)).mu_ratio.data
    counts, _ = da.histogram(ratio, bins=1000, range=(0.0, 1.0))
    mean, least, largest, counts = dask.compute(ratio.mean(), ratio.min(), ratio.max(), counts.sum())
    return float(mean), float(least), float(largest), int(counts)


def stages(surrogate: Surrogate, n: int) -> dict[str, float]:
    """Processor nanoseconds a case on one thread: to generate the inputs, and to evaluate them."""
    cases = design(n)
    spent = {}
    started = process_time()
    columns = dask.compute(*(cases[name].data for name in FIELDS))
    spent["make"] = 1e9 * (process_time() - started) / n
    started = process_time()
    surrogate.evaluate_columns(*columns)
    spent["answer"] = 1e9 * (process_time() - started) / n
    return spent


def _worker_memory() -> int:
    """Peak resident memory of this process [kB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


@contextmanager
def workers(n: int, surrogate: Surrogate) -> Iterator[Any]:
    """``n`` worker processes with one thread each, kernels loaded; freed arrays are kept for the next chunk."""
    from distributed import Client, LocalCluster

    keep = {f"MALLOC_{name}_THRESHOLD_": 2**30 for name in ("TRIM", "MMAP")}
    with (
        dask.config.set({"distributed.nanny.pre-spawn-environ": {**keep, "OMP_NUM_THREADS": 1}}),
        LocalCluster(n_workers=n, threads_per_worker=1, dashboard_address=None, host="127.0.0.1") as cluster,
        Client(cluster) as client,
    ):
        client.run(_load, surrogate)
        yield client


def _load(surrogate: Surrogate) -> None:
    with dask.config.set(scheduler="synchronous"):
        lazy(surrogate, 1000)


def processor_time(client: Any = None) -> float:
    """Processor seconds so far of this process and of the client's workers."""
    return process_time() + (0.0 if client is None else sum(client.run(process_time).values()))


def scale(largest: float, quick: bool) -> str:
    """Every run at every size, and the two builds."""
    sizes = [10**e for e in range(6, 12) if 10**e <= largest] if not quick else [10_000, 100_000]
    surrogate = Surrogate.open(1e-10)
    _load(surrogate)
    busy: dict[str, dict[int, float]] = {}
    memory: dict[str, float] = {}
    found: dict[int, set[Reduced]] = {n: set() for n in sizes}

    def measure(name: str, client: Any = None) -> None:
        busy[name] = {}
        for n in sizes:
            before = processor_time(client)
            mean, least, largest, count = lazy(surrogate, n)
            busy[name][n] = processor_time(client) - before
            found[n].add((round(mean, 12), least, largest, count))
            progress(f"{name}, {n:.0e} cases: {busy[name][n]:.2f} s of processor time")
        peak = _worker_memory() if client is None else max(client.run(_worker_memory).values())
        memory[name] = peak / 1024

    with dask.config.set(scheduler="synchronous"):
        measure("one thread, no scheduler")
        parts = stages(surrogate, sizes[-1] if quick else 10**6)
    with dask.config.set(scheduler="threads", num_workers=processors()):
        measure(f"{processors()} threads")
    for n in (1, 2):
        with workers(n, surrogate) as client:
            measure(f"{n} worker process{'es' * (n > 1)}", client)
    if any(len(answers) != 1 for answers in found.values()):
        raise SystemExit(f"error: results differ: {found}")
    return report(sizes, busy, memory, parts)


def report(
    sizes: list[int], busy: dict[str, dict[int, float]], memory: dict[str, float], parts: dict[str, float]
) -> str:
    """The section of docs/scale.md."""
    n = sizes[-1]
    rows = [[name, quantity(1e9 * times[n] / n), quantity(memory[name])] for name, times in busy.items()]
    fixed, each = fit(sizes, busy["2 worker processes"])
    core_hours = PLAN * each / 3600.0
    stored = PLAN * 8 / 1e12
    plan = [
        ["work of one core", f"{quantity(core_hours)} core hours"],
        [f"{CORES} workers of one thread, each with a core of its own", f"{quantity(60 * core_hours / CORES)} min"],
        ["mu_macro alone, if it were stored as doubles", f"{quantity(stored)} TB"],
        ["the six inputs beside it", f"{quantity(6 * stored)} TB"],
    ]
    return "\n\n".join(
        [
            f"{n:.0e} Sobol cases of six varying inputs, made, answered by mumacro-1e-10 and reduced to mean, extremes "
            "and a histogram in one pass, in chunks of 2^20. Processor time is that of all processes; memory is that "
            "of the largest process so far.",
            markdown(["run", "processor ns a case", "peak MB"], rows, 1),
            f"Cost model, least squares of two worker processes from {sizes[0]:.0e} cases on: {quantity(fixed)} s + "
            f"{quantity(1e9 * each)} ns a case. Between processes only the reduced numbers are sent, 8 kB a chunk for "
            "the histogram.",
            f"On one thread, making the six inputs is {quantity(parts['make'])} ns a case, answering "
            f"{quantity(parts['answer'])} ns; the rest is the reductions and Dask.",
            f"For {PLAN:.0e} cases the model gives:",
            markdown(["what", "how much"], plan, 1),
        ]
    )


def fit(sizes: list[int], times: dict[int, float]) -> tuple[float, float]:
    """Seconds before the first case, and seconds a case, weighted so that every size has equal weight."""
    n = np.array(sizes, float)
    t = np.array([times[size] for size in sizes])
    matrix = np.stack([1.0 / t, n / t], axis=1)
    (fixed, each), *_ = np.linalg.lstsq(matrix, np.ones(n.size))
    return max(float(fixed), 0.0), float(each)


if __name__ == "__main__":
    main(__doc__, {"scale": scale}, largest=1e8, quick=False)

"""Processor time a case up to 1e8 cases: one thread, all threads, two worker processes of Dask.

    python benchmarks/scale.py [--largest 1e8] [--write]

Every chunk of cases is generated, evaluated and reduced (mean, extremes, a histogram); no case is stored.  Processor
time is the sum over all processes, without the start of workers: other work on the machine has little effect on it.
"""

from __future__ import annotations

from benchmarks.measuring import main, markdown, progress, quantity  # isort: split

from contextlib import nullcontext
from time import process_time
from typing import Any

import dask
import numpy as np
import xarray as xr
from scipy.stats import qmc

from mumacro import Surrogate
from mumacro.processors import processors

PLAN = 1e12  # cases of the worked plan
RANGES = {"mu0": (0.1, 1.0), "Fz": (1, 100), "k": (1e5, 1e8), "y0": (1e-7, 1e-5), "omega": (1e3, 1e6),
          "v0": (1e-4, 1.0)}  # fmt: skip


def points(block_info: Any = None) -> Any:
    """One chunk in (0, 1): a scrambled Sobol set of its own."""
    (place, _), (n, inputs) = block_info[None]["chunk-location"], block_info[None]["chunk-shape"]
    sequence = qmc.Sobol(inputs, bits=52, rng=np.random.default_rng([0, place]))
    return sequence.random_base2((n - 1).bit_length())[:n] + 0.5**53


def over(shares: Any, low: float, high: float) -> Any:
    """Numbers log-uniform from ``low`` to ``high`` for uniform ``shares``."""
    return np.exp(np.log(low) + np.log(high / low) * shares)


def reduced(surrogate: Surrogate, n: int) -> tuple[float, ...]:
    """Mean, extremes and the number of ``n`` cases, in chunks of 2^20, by Dask's current scheduler."""
    import dask.array as da

    sizes = da.core.normalize_chunks(2**20, (n,))[0]
    u = da.map_blocks(points, chunks=(sizes, (len(RANGES),)), dtype=float, meta=np.empty((0, 0)))
    columns = {
        name: ("case", u[:, i].map_blocks(over, *ends, dtype=float)) for i, (name, ends) in enumerate(RANGES.items())
    }
    ratio = surrogate.evaluate(xr.Dataset(columns)).mu_ratio.data
    counts, _ = da.histogram(ratio, bins=1000, range=(0.0, 1.0))
    found = dask.compute(ratio.mean(), ratio.min(), ratio.max(), counts.sum())
    return (round(float(found[0]), 12), *map(float, found[1:]))


def scale(largest: float, quick: bool) -> str:
    """Every run at every size."""
    from distributed import Client, LocalCluster

    sizes = [10**e for e in range(6, 12) if 10**e <= largest] if not quick else [10_000, 100_000]
    surrogate = Surrogate.open(1e-10)
    rows, answers = [], {n: set[tuple[float, ...]]() for n in sizes}
    runs: tuple[tuple[str, dict[str, Any]], ...] = (
        ("one thread", {"scheduler": "synchronous"}),
        (f"{processors()} threads", {"scheduler": "threads", "num_workers": processors()}),
        ("2 worker processes", {}),
    )
    for name, settings in runs:
        local = None if settings else LocalCluster(2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1")
        with dask.config.set(settings), local or nullcontext(), Client(local) if local else nullcontext() as client:
            reduced(surrogate, 1000)
            for n in sizes:

                def busy(client: Any = client) -> float:
                    return process_time() + (sum(client.run(process_time).values()) if client else 0.0)

                before = busy()
                answers[n].add(reduced(surrogate, n))
                each = (busy() - before) / n
                rows.append([name, f"{n:.0e}", quantity(1e9 * each), quantity(PLAN * each / 3600.0)])
                progress(f"{name}, {n:.0e} cases: {1e9 * each:.0f} ns")
    if any(len(found) != 1 for found in answers.values()):
        raise SystemExit(f"error: results differ: {answers}")
    header = ("run", "cases", "processor ns a case", f"core hours for {PLAN:.0e}")
    return f"Sobol cases of six inputs, made, answered and reduced in one pass:\n\n{markdown(header, rows)}"


if __name__ == "__main__":
    main(__doc__, {"scale": scale}, largest=1e8, quick=False)

"""Processor time a case, of many cases: the plan in docs/how-to/many-cases.md.

    python benchmarks/scale.py [--cases 1e8] [--write]

Every chunk of cases is generated, evaluated and reduced (mean, extremes, a histogram) by Dask's
threads; no case is stored.  Processor time is the sum over all threads: other work on the machine
has little effect on it.
"""

from tests.support.measuring import main, markdown, quantity  # isort: split

from time import process_time
from typing import Any

import dask
import dask.array as da
import numpy as np
import xarray as xr
from scipy.stats import qmc

from mumacro import Surrogate

PLAN = 1e12  # cases of the worked plan
RANGES = {
    "mu0": (0.1, 1.0),
    "Fz": (1, 100),
    "k": (1e5, 1e8),
    "y0": (1e-7, 1e-5),
    "omega": (1e3, 1e6),
    "v0": (1e-4, 1.0),
}


def points(block_info: Any = None) -> Any:
    """One chunk in (0, 1): a scrambled Sobol set of its own."""
    (place, _), (n, inputs) = block_info[None]["chunk-location"], block_info[None]["chunk-shape"]
    sequence = qmc.Sobol(inputs, bits=52, rng=np.random.default_rng([0, place]))
    return sequence.random_base2((n - 1).bit_length())[:n] + 0.5**53


def over(shares: Any, low: float, high: float) -> Any:
    return np.exp(np.log(low) + np.log(high / low) * shares)


def reduced(surrogate: Surrogate, n: int) -> float:
    """Processor seconds a case, of ``n`` cases in chunks of 2^20."""
    sizes = da.core.normalize_chunks(2**20, (n,))[0]
    u = da.map_blocks(points, chunks=(sizes, (len(RANGES),)), dtype=float, meta=np.empty((0, 0)))
    shares = {name: (u[:, i], *ends) for i, (name, ends) in enumerate(RANGES.items())}
    columns = {
        name: ("case", column.map_blocks(over, *ends, dtype=float))
        for name, (column, *ends) in shares.items()
    }
    ratio = surrogate.evaluate(xr.Dataset(columns)).mu_ratio.data
    counts, _ = da.histogram(ratio, bins=1000, range=(0.0, 1.0))
    before = process_time()
    mean, low, high, counted = dask.compute(
        ratio.mean(), ratio.min(), ratio.max(), counts.sum(), scheduler="threads"
    )
    if not (counted == n and 0.0 <= low <= mean <= high <= 1.0):
        raise SystemExit(f"error: {counted} cases from {low} to {high}, mean {mean}")
    return (process_time() - before) / n


def scale(cases: float) -> str:
    """After a short run that loads what is needed."""
    surrogate, n = Surrogate.open(1e-10), round(cases)
    each = [reduced(surrogate, number) for number in (1000, n)][-1]
    row = [f"{n:.0e}", quantity(1e9 * each), quantity(PLAN * each / 3600.0)]
    return markdown(("cases", "processor ns a case", f"core hours for {PLAN:.0e}"), [row], 0)


if __name__ == "__main__":
    main(__doc__, {"scale": scale}, cases=1e8)

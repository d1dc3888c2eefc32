"""More cases than fit in memory: Sobol designs that exist chunk by chunk.

The arrays are Dask's in an xarray Dataset, so that a laptop and a cluster run the same code.  Grids, means, extremes,
quantiles and best cases need these two alone: docs/scale.md.  Needs the extra ``dask``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mumacro.errors import InputError
from mumacro.extras import missing
from mumacro.inputs import real

try:
    import dask.array
    import xarray as xr
    from scipy.stats import qmc
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(missing("dask", error), name=error.name) from None

__all__ = ["CHUNK", "sobol"]

CHUNK = 2**20  # cases: a tenth of a second of work, 8 MB an array
MOST_CHUNKS = 2**20  # of which Dask holds the graph
BITS = 52  # of a coordinate: (i + 1/2) 2^-52 is a double inside (0, 1)
da: Any = dask.array  # of which parts have no types


def sobol(n: int, *, seed: int = 0, chunk: int = CHUNK, **inputs: Any) -> xr.Dataset:
    """``n`` cases whose varying inputs fill their ranges evenly; every chunk is a scrambled Sobol set of its own.

    Parameters
    ----------
    n : int
        Cases, up to 2^20 chunks.
    seed : int
        Of the scrambling, 0 or more; other seeds give independent repetitions.
    chunk : int
        Cases of a chunk, up to 2^30; powers of two are most even.
    **inputs : float, None, distribution or callable
        The inputs of :meth:`mumacro.Surrogate.evaluate`: a number (for k also None) holds for all cases; what varies is
        a frozen distribution of scipy.stats, or a function from arrays of numbers in (0, 1) to values.

    Returns
    -------
    xarray.Dataset
        Dask arrays over the dimension ``case``.  A chunk is made by the worker that needs it.  Chunks are independent:
        the spread of their means gives the error of an average.

    Raises
    ------
    InputError
        ``n``, ``seed`` or ``chunk`` out of range; an input that is none of these; no input that varies.

    Examples
    --------
    >>> from scipy import stats
    >>> speed = lambda u: 10 ** (3 * u - 3)     # log-uniform from 1 mm/s to 1 m/s
    >>> cases = sobol(2**30, mu0=0.3, Fz=10, k=None, f=2e4, y0=stats.uniform(1e-6, 1e-5), v0=speed)
    >>> cases.v0.size, round(float(cases.y0[-CHUNK:].mean()), 11)
    (1073741824, 6e-06)
    """
    for name, value, low, high in (("chunk", chunk, 1, 2**30), ("seed", seed, 0, 2**63)):
        _check_whole(name, value, low, high)
    _check_whole("n", n, 1, MOST_CHUNKS * chunk)
    varying = {
        name: getattr(value, "ppf", value) for name, value in inputs.items() if callable(value) or hasattr(value, "ppf")
    }
    if not varying:
        raise InputError("inputs", sorted(inputs), "such that at least one varies: a distribution or a function")
    sizes = (chunk,) * (n // chunk) + ((n % chunk,) if n % chunk else ())
    points = da.map_blocks(_points, seed, chunks=(sizes, (len(varying),)), dtype=float, meta=np.empty((0, 0)))
    columns: dict[str, Any] = {}
    for name, value in inputs.items():
        if name in varying:
            shares = points[:, list(varying).index(name)]
            columns[name] = ("case", shares.map_blocks(varying[name], dtype=float, meta=np.empty(0)))
            continue
        number = real(name, math.inf if value is None and name == "k" else value)
        if number.ndim:
            raise InputError(name, number.shape, "a number, a distribution or a function")
        columns[name] = ((), number)
    return xr.Dataset(columns)


def _check_whole(name: str, value: object, low: int, high: int) -> None:
    if not (type(value) is int and low <= value <= high):
        raise InputError(name, value, f"a whole number from {low} to {high}")


def _points(seed: int, block_info: Mapping[Any, Any]) -> NDArray[np.float64]:
    """The points of one chunk in (0, 1), (cases, varying inputs)."""
    chunk = block_info[None]
    (size, dimensions), (place, _) = chunk["chunk-shape"], chunk["chunk-location"]
    sequence = qmc.Sobol(dimensions, bits=BITS, rng=np.random.default_rng([seed, place]))
    return sequence.random_base2((size - 1).bit_length())[:size] + 0.5**BITS / 2.0

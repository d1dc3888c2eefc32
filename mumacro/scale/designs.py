"""Lazy designs: a grid, and Sobol points by their counter.  A chunk is made by the worker that evaluates it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import dask.array
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from mumacro.errors import InputError
from mumacro.inputs import real
from mumacro.scale.sequence import DIMENSIONS, MOST_POINTS, shifts, sobol_points

__all__ = ["CHUNK", "grid", "sobol"]

CHUNK = 2**20  # cases of a chunk: a tenth of a second of work, 8 MB an array
da: Any = dask.array  # of which parts have no types


def grid(chunk: int = CHUNK, **inputs: Any) -> xr.Dataset:
    """Every combination of the values of each input; values are made on request.

    Parameters
    ----------
    chunk : int
        Cases of a chunk, at the most.
    **inputs : float, None or array_like
        The inputs of :meth:`mumacro.Surrogate.evaluate`: a number (for k also None), or the values (n,) of an axis.

    Returns
    -------
    xarray.Dataset
        Dask arrays; the axis of y0 is the dimension ``along_y0``, and so on; the last one varies fastest.

    Raises
    ------
    InputError
        An axis of more than one dimension, or an empty one; a chunk below 1.

    Examples
    --------
    >>> import numpy as np
    >>> cases = grid(mu0=0.3, Fz=10, k=1e6, f=2e4, y0=np.linspace(0, 1e-5, 1001), v0=np.geomspace(1e-3, 1, 2000))
    >>> dict(cases.sizes)
    {'along_y0': 1001, 'along_v0': 2000}
    """
    _check_chunk(chunk)
    axes: dict[str, Any] = {}
    numbers: dict[str, Any] = {}
    for name, value in inputs.items():
        values = _number(name, value)
        if values.ndim > 1 or values.size == 0:
            raise InputError(name, values.shape, "a number or the values (n,) of an axis")
        (axes if values.ndim else numbers)[name] = values
    columns: dict[str, Any] = {name: ((), value) for name, value in numbers.items()}
    left = chunk
    for name, values in reversed(axes.items()):
        size = min(values.size, left)
        left //= size
        columns[name] = (f"along_{name}", da.from_array(values, chunks=size))
    return xr.Dataset({name: columns[name] for name in inputs})


def sobol(n: int, *, seed: int | None = 0, chunk: int = CHUNK, **inputs: Any) -> xr.Dataset:
    """``n`` cases whose varying inputs fill their ranges evenly: a Sobol sequence, each point from its counter.

    Parameters
    ----------
    n : int
        Cases, up to 2^52; powers of two are most even.
    seed : int or None
        Of the random digital shift that makes averages unbiased; other seeds give independent repetitions.  None leaves
        the sequence as it is.
    chunk : int
        Cases of a chunk.
    **inputs : float, None, distribution or callable
        The inputs of :meth:`mumacro.Surrogate.evaluate`: a number (for k also None) holds for all cases; what varies is
        a frozen distribution of scipy.stats, or a function from arrays of numbers in (0, 1) to values.

    Returns
    -------
    xarray.Dataset
        Dask arrays over the dimension ``case``.

    Raises
    ------
    InputError
        ``n`` or ``chunk`` out of range; an input that is none of these; no input that varies, or more than six.

    Notes
    -----
    Direction numbers of Joe and Kuo (SIAM J. Sci. Comput. 30 (2008) 2635), 52 binary digits.

    Examples
    --------
    >>> from scipy import stats
    >>> speed = lambda u: 10 ** (3 * u - 3)     # log-uniform from 1 mm/s to 1 m/s
    >>> cases = sobol(2**30, mu0=0.3, Fz=10, k=None, f=2e4, y0=stats.uniform(1e-6, 1e-5), v0=speed)
    >>> round(float(cases.v0[2**29].compute()), 6)
    0.001037
    """
    _check_chunk(chunk)
    if not (type(n) is int and 1 <= n <= MOST_POINTS):
        raise InputError("n", n, f"a whole number from 1 to {MOST_POINTS}")
    varying = {
        name: getattr(value, "ppf", value) for name, value in inputs.items() if callable(value) or hasattr(value, "ppf")
    }
    if not 1 <= len(varying) <= DIMENSIONS:
        raise InputError("inputs", sorted(varying), f"from 1 to {DIMENSIONS} that vary: distributions or functions")
    chunks = ((chunk,) * (n // chunk) + ((n % chunk,) if n % chunk else ()),)
    columns: dict[str, Any] = {}
    for name, value in inputs.items():
        if name not in varying:
            number = _number(name, value)
            if number.ndim:
                raise InputError(name, number.shape, "a number, a distribution or a function")
            columns[name] = ((), number)
            continue
        dimension = list(varying).index(name)
        block = _Block(dimension, int(shifts(seed)[dimension]), varying[name])
        columns[name] = ("case", da.map_blocks(block, chunks=chunks, dtype=np.float64, meta=np.empty(0)))
    return xr.Dataset(columns)


class _Block:
    """The values of one input in one chunk."""

    def __init__(self, dimension: int, shift: int, transform: Callable[[Any], Any]) -> None:
        self.dimension, self.shift, self.transform = dimension, shift, transform

    def __call__(self, block_info: Mapping[Any, Any] | None = None) -> NDArray[np.float64]:
        if not block_info:
            return np.empty(0)
        ((first, last),) = block_info[None]["array-location"]
        return np.asarray(self.transform(sobol_points(self.dimension, first, last - first, self.shift)), np.float64)


def _number(name: str, value: Any) -> NDArray[np.float64]:
    return real(name, math.inf if value is None and name == "k" else value)


def _check_chunk(chunk: int) -> None:
    if not (type(chunk) is int and chunk >= 1):
        raise InputError("chunk", chunk, "a whole number of cases, at least 1")

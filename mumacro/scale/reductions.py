"""Reductions chunk by chunk that Dask and xarray lack: quantiles with a bound, and the best case.

Mean, standard deviation, extremes and histograms are theirs: ``answer.mu_macro.mean()`` skips illegal cases.
"""

from __future__ import annotations

import math
from typing import Any

import dask
import dask.array
import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from mumacro.errors import InputError

__all__ = ["best", "quantiles"]

Array = NDArray[np.float64]
da: Any = dask.array  # of which parts have no types
compute: Any = dask.compute  # type: ignore[attr-defined]


def quantiles(
    values: Any, q: ArrayLike, *, low: float = 0.0, high: float = 1.0, bins: int = 65_536
) -> tuple[Array, Array]:
    """Bounds of quantiles, from one pass that counts values in bins of one width.

    Parameters
    ----------
    values : xarray.DataArray or dask.array.Array
        Any shape; NaN (illegal cases) is skipped.
    q : array_like
        Probabilities, 0 to 1.
    low, high : float
        The range of the values; that of mu_ratio by default.
    bins : int
        The bounds are (high - low)/bins apart.

    Returns
    -------
    below, above : ndarray
        Of the shape of ``q``: the least value that a share q of all values does not exceed (numpy's "inverted_cdf")
        lies between them.

    Raises
    ------
    InputError
        A probability out of range, a value outside the range, no value at all.

    Examples
    --------
    >>> import dask.array as da
    >>> below, above = quantiles(da.arange(1000, chunks=100) / 1000, [0.5, 0.9], bins=100)
    >>> below.round(2).tolist(), above.round(2).tolist()
    ([0.49, 0.89], [0.5, 0.9])
    """
    shares = np.asarray(q, np.float64)
    if not np.all((shares >= 0.0) & (shares <= 1.0)):
        raise InputError("q", q, "probabilities from 0 to 1")
    flat = da.asarray(getattr(values, "data", values)).ravel()
    known = da.where(da.isnan(flat), -math.inf, flat)
    counted, edges = da.histogram(known, bins=bins, range=(low, high))
    counts, legal, least, largest = compute(counted, da.sum(~da.isnan(flat)), da.nanmin(flat), da.nanmax(flat))
    if legal == 0:
        raise InputError("values", int(flat.size), "numbers: all of them are NaN")
    if counts.sum() != legal:
        raise InputError("values", (float(least), float(largest)), f"from low = {low} to high = {high}")
    rank = np.maximum(np.ceil(shares * legal), 1)
    found = np.searchsorted(np.cumsum(counts), rank)
    return edges[found], edges[found + 1]


def best(cases: xr.Dataset, objective: xr.DataArray, feasible: xr.DataArray | None = None) -> xr.Dataset:
    """The case of the least ``objective`` among those that are ``feasible``.

    Parameters
    ----------
    cases : xarray.Dataset
        A design.
    objective : xarray.DataArray
        One number a case; NaN is never best.
    feasible : xarray.DataArray, optional
        Whether a case is allowed.

    Returns
    -------
    xarray.Dataset
        The inputs of the first best case, computed, and its ``objective``.

    Raises
    ------
    InputError
        No case is feasible.

    Examples
    --------
    >>> import numpy as np
    >>> from mumacro import Surrogate
    >>> from mumacro.scale import grid
    >>> cases = grid(mu0=0.3, Fz=10, k=1e6, omega=1.3e5, v0=0.01, y0=np.linspace(0, 1e-5, 1001))
    >>> answer = Surrogate.open().evaluate(cases)
    >>> found = best(cases, cases.y0, answer.mu_macro <= 0.15)     # the least amplitude that halves friction
    >>> round(float(found.y0), 9)
    2.86e-06
    """
    allowed = objective if feasible is None else objective.where(feasible)
    ranked = allowed.fillna(math.inf)
    place = int(da.argmin(da.asarray(ranked.data).ravel()).compute())
    at = dict(zip(ranked.dims, np.unravel_index(place, ranked.shape), strict=True))
    found, value = compute(cases.isel(at, missing_dims="ignore"), ranked.isel(at))
    if not math.isfinite(float(value)):
        raise InputError("feasible", 0, "true for at least one case with a finite objective")
    out: xr.Dataset = found.assign(objective=value)
    return out

"""More cases than fit in memory: designs that exist chunk by chunk, and results reduced as they are computed.

The arrays are Dask's in xarray's Datasets, so that a laptop and a cluster run the same code.
Needs the extra ``dask``.
"""

from mumacro.extras import missing

try:
    from mumacro.scale.designs import grid, sobol
    from mumacro.scale.reductions import best, quantiles
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(missing("dask", error), name=error.name) from None

__all__ = ["best", "grid", "quantiles", "sobol"]

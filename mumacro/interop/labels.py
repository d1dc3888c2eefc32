"""Labels are kept: pandas, xarray and Dask objects in, the same out; Dask stays lazy.

The inputs of one call come from one of these libraries, with plain numbers and NumPy arrays beside them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mumacro.answer import Answer
from mumacro.errors import InputError
from mumacro.inputs import FIELDS

if TYPE_CHECKING:
    from mumacro.surrogate import Surrogate

__all__ = ["evaluate_labelled"]

_VALUES = ("mu_macro", "mu_ratio", "error_bound", "source_code")


def evaluate_labelled(
    surrogate: Surrogate, cases: Any, inputs: Mapping[str, Any], *, gradient: bool, groups: bool, illegal: str
) -> Any:
    """:meth:`mumacro.Surrogate.evaluate` for labelled inputs.

    Returns
    -------
    Answer, pandas.DataFrame or xarray.Dataset
        An answer whose attributes are Series, DataArrays or Dask arrays; for a DataFrame or Dataset of cases one of
        these, with the columns mu_macro, mu_ratio, regime, error_bound and source (regime and source as categories).

    Raises
    ------
    InputError
        Series whose indexes differ, objects of two libraries in one call, and what ``evaluate`` refuses.
    """
    given = {name: value for name, value in inputs.items() if name != "k" or value is not None}
    libraries = {type(x).__module__.partition(".")[0] for x in (cases, *given.values())} & {"pandas", "xarray", "dask"}
    if "pandas" in libraries and len(libraries) > 1:
        raise InputError("inputs", sorted(libraries), "objects of one library: pandas, or xarray and Dask")
    if "k" in inputs and inputs["k"] is None:
        given["k"] = math.inf
    options = {"gradient": gradient, "groups": groups or gradient, "illegal": illegal}
    if "pandas" in libraries:
        answer = _pandas(surrogate, given, options)
    else:
        answer = _lazy(surrogate, given, options, xarray="xarray" in libraries)
    if cases is None or isinstance(cases, dict):
        return answer
    columns = {"mu_macro": answer.mu_macro, "mu_ratio": answer.mu_ratio, "regime": answer.regime,
               "error_bound": answer.error_bound, "source": answer.source}  # fmt: skip
    if "pandas" in libraries:
        import pandas as pd

        return pd.DataFrame(columns)
    import xarray as xr

    return xr.Dataset(columns)


def _pandas(surrogate: Surrogate, given: Mapping[str, Any], options: Mapping[str, Any]) -> Answer[Any]:
    import pandas as pd

    index: Any = None
    plain = {}
    for name, value in given.items():
        if isinstance(value, (pd.Series, pd.Index)):
            own = value.index if isinstance(value, pd.Series) else value
            if isinstance(value, pd.Series):
                if index is not None and not own.equals(index):
                    raise InputError(name, "a Series", "indexed as the other inputs are: align them first")
                index = own
            plain[name] = value.to_numpy()
        else:
            plain[name] = value
    found = surrogate.evaluate(**plain, **options)

    def series(values: Any) -> Any:
        return values if np.ndim(values) == 0 else pd.Series(values, index=index)

    def categories(table: Any, code: Any) -> Any:
        found = table[code.to_numpy()]
        if table.dtype == object:  # names: as categories, without the empty one of illegal cases
            kinds = list(dict.fromkeys(name for name in table if name))
            found = pd.Categorical(np.where(found == "", None, found), categories=kinds)
        return pd.Series(found, index=index)

    return _answer([getattr(found, name) for name in _VALUES], found, series, categories)


def _answer(
    values: list[Any], found: Answer[Any], wrap: Callable[[Any], Any], look_up: Callable[[Any, Any], Any]
) -> Answer[Any]:
    mu_macro, mu_ratio, bound, source = map(wrap, values)
    answer = Answer(mu_macro, mu_ratio, bound, source, look_up=look_up)
    if found._groups is not None:
        answer._groups, certain = tuple(map(wrap, found._groups)), found._certain
        answer._certain = None if certain is None else lambda v, y: wrap(certain(np.asarray(v), np.asarray(y)))
    for name in ("gradient", "gradient_bound"):
        slopes = getattr(found, name)
        setattr(answer, name, None if slopes is None else {field: wrap(slopes[field]) for field in FIELDS})
    return answer


def _lazy(surrogate: Surrogate, given: Mapping[str, Any], options: Mapping[str, Any], xarray: bool) -> Answer[Any]:
    """One pass over every chunk, on one thread: Dask has its own."""
    names = list(given)
    counts = {"groups": 3 if options["groups"] else 0, "gradient": 12 if options["gradient"] else 0}
    outputs = len(_VALUES) + sum(counts.values())
    serial = surrogate.on_one_thread()
    kinds = [np.dtype(np.int8) if name == "source_code" else np.dtype(np.float64) for name in _VALUES]
    kinds += [np.dtype(np.float64)] * (outputs - len(_VALUES))

    def chunk(*values: Any) -> tuple[Any, ...]:
        arrays: dict[str, Any] = dict(zip(names, map(np.asarray, values), strict=True))
        found = serial.evaluate(**arrays, **options)
        parts = [getattr(found, name) for name in _VALUES]
        if found._groups is not None and options["groups"]:
            parts += found._groups
        if found.gradient is not None and found.gradient_bound is not None:
            parts += [*found.gradient.values(), *found.gradient_bound.values()]
        return tuple(np.asarray(part, kind) for part, kind in zip(parts, kinds, strict=True))

    def certain(v: Any, y: Any) -> Any:
        return np.asarray(serial._certain(v, y))

    if xarray:
        import xarray as xr

        def apply(function: Any, *over: Any, kinds: list[Any]) -> Any:
            outs: list[tuple[()]] = [()] * len(kinds)
            return xr.apply_ufunc(function, *over, output_core_dims=outs, dask="parallelized", output_dtypes=kinds)

        def look_up(table: Any, code: Any) -> Any:
            return apply(table.__getitem__, code, kinds=[table.dtype])
    else:
        import dask.array

        da: Any = dask.array  # of which parts have no types

        def apply(function: Any, *over: Any, kinds: list[Any]) -> Any:
            signature = ",".join(["()"] * len(over)) + "->" + ",".join(["()"] * len(kinds))
            return da.apply_gufunc(function, signature, *over, output_dtypes=kinds, vectorize=False)

        def look_up(table: Any, code: Any) -> Any:
            return code.map_blocks(table.__getitem__, dtype=table.dtype)

    try:
        columns = apply(chunk, *given.values(), kinds=kinds)
    except InputError:
        raise
    except ValueError as error:
        labels = {name: getattr(value, "sizes", np.shape(value)) for name, value in given.items()}
        raise InputError("inputs", labels, "labelled and shaped alike: align them first") from error
    mu_macro, mu_ratio, bound, source = columns[: len(_VALUES)]
    answer = Answer(mu_macro, mu_ratio, bound, source, look_up=look_up)
    rest = list(columns[len(_VALUES) :])
    if counts["groups"]:
        answer._groups, rest = tuple(rest[:3]), rest[3:]
        answer._certain = (
            (lambda v, y: apply(certain, v, y, kinds=[np.dtype(np.bool_)]))
            if xarray
            else (lambda v, y: da.map_blocks(certain, v, y, dtype=np.bool_))
        )
    if counts["gradient"]:
        answer.gradient = dict(zip(FIELDS, rest[:6], strict=True))
        answer.gradient_bound = dict(zip(FIELDS, rest[6:], strict=True))
    return answer

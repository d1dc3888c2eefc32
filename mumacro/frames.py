"""Labels are kept: pandas, xarray and Dask objects in, the same out; Dask stays lazy.

The inputs of one call come from one of these libraries, with plain numbers and NumPy arrays beside
them.
"""

import importlib
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mumacro.answer import BAND, GROUPS, Answer, IntervalAnswer
from mumacro.errors import InputError
from mumacro.inputs.fields import PER_UNIT
from mumacro.inputs.kind import AMPLITUDE, Kind
from mumacro.table.atlas import REGIMES

#: name -> units and long_name, as xarray and CF write them
_ABOUT = {
    "mu_macro": ("1", "macroscopic friction coefficient"),
    "mu_ratio": ("1", "macroscopic over Coulomb friction coefficient"),
    "error_bound": ("1", "bound of the absolute error of mu_macro"),
    "source_code": (
        "1",
        "index of the block or closed form that gave the value, -1 for an illegal case",
    ),
    "v_tilde": ("1", "dimensionless sliding speed"),
    "y_tilde": ("1", "dimensionless oscillation amplitude"),
    "length_scale": ("m", "mu0 Fz / k"),
    "mu_macro_low": ("1", "smallest mu_macro over the interval of k"),
    "mu_macro_high": ("1", "largest mu_macro over the interval of k"),
    "regime": ("1", ", ".join(REGIMES)),
    "regime_code": ("1", "index of the regime, -1 for an illegal case"),
    "regime_certain": ("1", "whether the regime is certain"),
    "source": ("1", "block or closed form that gave the value"),
} | {
    f"d_mu_macro_d_{name}{end}": (unit.replace("-", "1"), f"{term} of mu_macro along {name}")
    for end, term in (("", "slope"), ("_bound", "bound of the absolute error of the slope"))
    for name, unit in {**PER_UNIT, AMPLITUDE: PER_UNIT["Fz"]}.items()
}
_DTYPES = {
    "source_code": np.int8,
    "regime_code": np.int8,
    "regime_certain": np.bool_,
    "source": object,
    "regime": object,
}
Evaluate = Callable[..., Any]
Apply = Callable[[Callable[..., Any], Mapping[str, Any], Sequence[str]], list[Any]]


def evaluate_labelled(
    evaluate: Evaluate,
    evaluate_on_one_thread: Evaluate,
    certain: Callable[[Any, Any], Any],
    cases: Any,
    inputs: Mapping[str, Any],
    kind: Kind,
    interval: bool,
    options: dict[str, Any],
) -> Any:
    """:meth:`mumacro.Surrogate.evaluate` for labelled inputs, ``options`` are its other keywords.

    ``evaluate`` evaluates arrays, ``evaluate_on_one_thread`` the parts that Dask and xarray hand
    out, and ``certain`` says whether the regime at (v~, y~) is certain.

    Returns an answer whose attributes are Series, DataArrays or Dask arrays, by their names, for
    xarray with ``units`` and ``long_name``; for a DataFrame or Dataset of cases one of these, with
    the columns mu_macro, mu_ratio, regime, error_bound and source (regime and source of pandas as
    categories).  InputError for Series whose indexes differ, objects of two libraries in one call,
    and what ``evaluate`` refuses.
    """
    arguments = dict(inputs)
    library_by_name = {
        name: type(value).__module__.partition(".")[0]
        for name, value in {"": cases, **arguments}.items()
    }
    libraries = set(library_by_name.values()) & set(_APPLY)
    if "pandas" in libraries and len(libraries) > 1:
        raise InputError(
            "inputs", sorted(libraries), "objects of one library: pandas, or xarray and Dask"
        )
    library = next(name for name in _APPLY if name in libraries)
    if library != "pandas":  # Dask has its own threads
        evaluate = evaluate_on_one_thread
    if library_by_name[""] == "dask":
        keywords = {name: value for name, value in inputs.items() if name not in cases.columns}
        return _parts(evaluate, cases, {**options, **keywords})
    for name, value in arguments.items():
        if hasattr(value, "to_dask_array"):
            raise InputError(
                name, type(value).__name__, "a Dask array: .to_dask_array(lengths=True)"
            )
    gradient, groups = options["gradient"], options["groups"] or options["gradient"]
    slopes = (
        [f"d_mu_macro_d_{name}{end}" for end in ("", "_bound") for name in kind.fields]
        if gradient
        else []
    )
    names = ["mu_macro", "mu_ratio", "error_bound", "source_code", *(BAND if interval else ())]
    names += [*(GROUPS if groups else ()), *slopes]

    def chunk(*values: Any) -> list[Any]:
        answer = evaluate(dict(zip(arguments, values, strict=True)), **options)
        rows = [*answer.gradient.values(), *answer.gradient_bound.values()] if gradient else []
        return [getattr(answer, name) for name in names if name not in slopes] + rows

    apply = _APPLY[library]
    results = dict(zip(names, apply(chunk, arguments, names), strict=True))

    def look_up(name: str, entries: Any, code: Any) -> Any:
        if library == "pandas" and entries.dtype == object:
            return _categories(entries, code, name)
        return apply(lambda codes: [entries[codes]], {"source_code": code}, [name])[0]

    def labelled_certain(v: Any, y: Any) -> Any:
        groups_by_name = {"v_tilde": v, "y_tilde": y}
        return apply(lambda v, y: [certain(v, y)], groups_by_name, ["regime_certain"])[0]

    mu_macro, mu_ratio, bound, code = (results[name] for name in names[:4])
    answer: Any = (IntervalAnswer if interval else Answer)(
        mu_macro, mu_ratio, bound, code, look_up=look_up
    )
    for name in BAND if interval else ():
        setattr(answer, name, results[name])
    if groups:
        answer._groups, answer._certain = (
            (results["v_tilde"], results["y_tilde"], results["length_scale"]),
            labelled_certain,
        )
    if gradient:
        answer.gradient = {name: results[f"d_mu_macro_d_{name}"] for name in kind.fields}
        answer.gradient_bound = {
            name: results[f"d_mu_macro_d_{name}_bound"] for name in kind.fields
        }
    if library_by_name[""] not in ("pandas", "xarray"):
        return answer
    shown = ("mu_macro", *(BAND if interval else ()), "mu_ratio", "regime", "error_bound", "source")
    columns = {name: getattr(answer, name) for name in shown}
    module = importlib.import_module(library_by_name[""])
    return module.DataFrame(columns) if library == "pandas" else module.Dataset(columns)


def _parts(evaluate: Evaluate, cases: Any, options: dict[str, Any]) -> Any:
    """A DataFrame of Dask, part by part; one without rows is evaluated now, so that faults of its
    columns show."""
    import pandas as pd

    empty = pd.DataFrame({name: pd.Series(dtype=dtype) for name, dtype in cases.dtypes.items()})
    return cases.map_partitions(evaluate, meta=evaluate(empty, **options), **options)


# --- a function of arrays, applied to labelled objects: one result for each name ------------------


def _dtypes(names: Sequence[str]) -> list[Any]:
    return [_DTYPES.get(name, np.float64) for name in names]


def _on_arrays(function: Callable[..., Any], names: Sequence[str]) -> Callable[..., Any]:
    """``function``, called with arrays, its results as arrays of the types of ``names``; a tuple
    where there are several."""

    def wrapper(*values: Any) -> Any:
        results = function(*map(np.asarray, values))
        arrays = tuple(
            np.asarray(x, dtype) for x, dtype in zip(results, _dtypes(names), strict=True)
        )
        return arrays if len(names) > 1 else arrays[0]

    return wrapper


def _call_aligned(call: Callable[[], Any], inputs: Mapping[str, Any]) -> list[Any]:
    """All results of ``call``; InputError where the labels or shapes of its arguments do not
    fit."""
    try:
        results = call()
    except InputError:
        raise
    except ValueError as error:
        labels = {name: getattr(value, "sizes", np.shape(value)) for name, value in inputs.items()}
        raise InputError("inputs", labels, "labelled and shaped alike: align them first") from error
    return list(results) if isinstance(results, tuple) else [results]


def _pandas(
    function: Callable[..., Any], inputs: Mapping[str, Any], names: Sequence[str]
) -> list[Any]:
    import pandas as pd

    series = {name: value for name, value in inputs.items() if isinstance(value, pd.Series)}
    index = next((value.index for value in series.values()), None)
    for name, value in series.items():
        if not value.index.equals(index):
            raise InputError(name, "a Series", "indexed as the other inputs are: align them first")
    arrays_in = [
        _without_gaps(x).to_numpy() if isinstance(x, (pd.Series, pd.Index)) else x
        for x in inputs.values()
    ]
    arrays = _call_aligned(lambda: _on_arrays(function, names)(*arrays_in), inputs)
    return _call_aligned(
        lambda: tuple(pd.Series(x, index, name=n) for x, n in zip(arrays, names, strict=True)),
        inputs,
    )


def _without_gaps(column: Any) -> Any:
    """A column of objects or texts, such as numbers beside the word rigid, with NaN for None and
    NA: a gap rejects its row alone, in such a column as in one of numbers."""
    if column.dtype.kind != "O":
        return column
    return column.astype(object).where(column.notna(), math.nan)


def _categories(entries: Any, code: Any, name: str) -> Any:
    """Names as categories, without the empty one of illegal cases."""
    import pandas as pd

    categories = list(dict.fromkeys(entry for entry in entries if entry))
    codes = np.array([categories.index(entry) if entry else -1 for entry in entries])
    return pd.Series(
        pd.Categorical.from_codes(codes[code.to_numpy()], categories), code.index, name=name
    )


def _xarray(
    function: Callable[..., Any], inputs: Mapping[str, Any], names: Sequence[str]
) -> list[Any]:
    import xarray as xr

    options: dict[str, Any] = {
        "output_core_dims": [()] * len(names),
        "output_dtypes": _dtypes(names),
    }
    options |= {"dask": "parallelized", "keep_attrs": False}
    arrays = _call_aligned(
        lambda: xr.apply_ufunc(_on_arrays(function, names), *inputs.values(), **options), inputs
    )
    results = [array.rename(name) for array, name in zip(arrays, names, strict=True)]
    for array, name in zip(results, names, strict=True):
        array.attrs = dict(zip(("units", "long_name"), _ABOUT[name], strict=True))
    return results


def _dask(
    function: Callable[..., Any], inputs: Mapping[str, Any], names: Sequence[str]
) -> list[Any]:
    import dask.array

    apply: Any = dask.array.apply_gufunc  # Dask declares no types
    signature = ",".join(["()"] * len(inputs)) + "->" + ",".join(["()"] * len(names))
    options = {
        "output_dtypes": _dtypes(names) if len(names) > 1 else _dtypes(names)[0],
        "vectorize": False,
    }
    return _call_aligned(
        lambda: apply(_on_arrays(function, names), signature, *inputs.values(), **options), inputs
    )


_APPLY: dict[str, Apply] = {"pandas": _pandas, "xarray": _xarray, "dask": _dask}

"""Labels are kept: pandas, xarray and Dask objects in, the same out; Dask stays lazy.

The inputs of one call come from one of these libraries, with plain numbers and NumPy arrays beside
them.
"""

import importlib
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
    f"d_mu_macro_d_{name}{end}": (unit.replace("-", "1"), f"{what} of mu_macro along {name}")
    for end, what in (("", "slope"), ("_bound", "bound of the absolute error of the slope"))
    for name, unit in {**PER_UNIT, AMPLITUDE: PER_UNIT["Fz"]}.items()
}
_KINDS = {
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
    out, and ``certain`` tells whether the regime at (v~, y~) is.

    An answer whose attributes are Series, DataArrays or Dask arrays, by their names, for xarray
    with ``units`` and ``long_name``; for a DataFrame or Dataset of cases one of these, with the
    columns mu_macro, mu_ratio, regime, error_bound and source (regime and source of pandas as
    categories).  InputError for Series whose indexes differ, objects of two libraries in one call,
    and what ``evaluate`` refuses.
    """
    given = dict(inputs)
    kinds = {
        name: type(value).__module__.partition(".")[0]
        for name, value in {"": cases, **given}.items()
    }
    libraries = set(kinds.values()) & set(_APPLY)
    if "pandas" in libraries and len(libraries) > 1:
        raise InputError(
            "inputs", sorted(libraries), "objects of one library: pandas, or xarray and Dask"
        )
    library = next(name for name in _APPLY if name in libraries)
    if library != "pandas":  # Dask has its own threads
        evaluate = evaluate_on_one_thread
    if kinds[""] == "dask":
        beside = {name: value for name, value in inputs.items() if name not in cases.columns}
        return _parts(evaluate, cases, {**options, **beside})
    for name, value in given.items():
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
        found = evaluate(dict(zip(given, values, strict=True)), **options)
        rows = [*found.gradient.values(), *found.gradient_bound.values()] if gradient else []
        return [getattr(found, name) for name in names if name not in slopes] + rows

    apply = _APPLY[library]
    found = dict(zip(names, apply(chunk, given, names), strict=True))

    def look_up(name: str, entries: Any, code: Any) -> Any:
        if library == "pandas" and entries.dtype == object:
            return _categories(entries, code, name)
        return apply(lambda codes: [entries[codes]], {"source_code": code}, [name])[0]

    def labelled_certain(v: Any, y: Any) -> Any:
        both = {"v_tilde": v, "y_tilde": y}
        return apply(lambda v, y: [certain(v, y)], both, ["regime_certain"])[0]

    mu_macro, mu_ratio, bound, code = (found[name] for name in names[:4])
    answer: Any = (IntervalAnswer if interval else Answer)(
        mu_macro, mu_ratio, bound, code, look_up=look_up
    )
    for name in BAND if interval else ():
        setattr(answer, name, found[name])
    if groups:
        answer._groups, answer._certain = (
            (found["v_tilde"], found["y_tilde"], found["length_scale"]),
            labelled_certain,
        )
    if gradient:
        answer.gradient = {name: found[f"d_mu_macro_d_{name}"] for name in kind.fields}
        answer.gradient_bound = {name: found[f"d_mu_macro_d_{name}_bound"] for name in kind.fields}
    if kinds[""] not in ("pandas", "xarray"):
        return answer
    shown = ("mu_macro", *(BAND if interval else ()), "mu_ratio", "regime", "error_bound", "source")
    columns = {name: getattr(answer, name) for name in shown}
    whole = importlib.import_module(kinds[""])
    return whole.DataFrame(columns) if library == "pandas" else whole.Dataset(columns)


def _parts(evaluate: Evaluate, cases: Any, options: dict[str, Any]) -> Any:
    """A DataFrame of Dask, part by part; one without rows is evaluated now, so that faults of its
    columns show."""
    import pandas as pd

    empty = pd.DataFrame({name: pd.Series(dtype=kind) for name, kind in cases.dtypes.items()})
    return cases.map_partitions(evaluate, meta=evaluate(empty, **options), **options)


# --- a function of arrays, applied to labelled objects: one result for each name ------------------


def _kinds(names: Sequence[str]) -> list[Any]:
    return [_KINDS.get(name, np.float64) for name in names]


def _plain(function: Callable[..., Any], names: Sequence[str]) -> Callable[..., Any]:
    """``function`` with arrays of known types as its results; one alone is no tuple."""

    def called(*values: Any) -> Any:
        found = function(*map(np.asarray, values))
        arrays = tuple(np.asarray(x, kind) for x, kind in zip(found, _kinds(names), strict=True))
        return arrays if len(names) > 1 else arrays[0]

    return called


def _aligned(call: Callable[[], Any], given: Mapping[str, Any]) -> list[Any]:
    """All results of ``call``; InputError where the labels or shapes of its arguments do not
    fit."""
    try:
        found = call()
    except InputError:
        raise
    except ValueError as error:
        labels = {name: getattr(value, "sizes", np.shape(value)) for name, value in given.items()}
        raise InputError("inputs", labels, "labelled and shaped alike: align them first") from error
    return list(found) if isinstance(found, tuple) else [found]


def _pandas(
    function: Callable[..., Any], given: Mapping[str, Any], names: Sequence[str]
) -> list[Any]:
    import pandas as pd

    series = {name: value for name, value in given.items() if isinstance(value, pd.Series)}
    index = next((value.index for value in series.values()), None)
    for name, value in series.items():
        if not value.index.equals(index):
            raise InputError(name, "a Series", "indexed as the other inputs are: align them first")
    plain = [x.to_numpy() if isinstance(x, (pd.Series, pd.Index)) else x for x in given.values()]
    arrays = _aligned(lambda: _plain(function, names)(*plain), given)
    return _aligned(
        lambda: tuple(pd.Series(x, index, name=n) for x, n in zip(arrays, names, strict=True)),
        given,
    )


def _categories(entries: Any, code: Any, name: str) -> Any:
    """Names as categories, without the empty one of illegal cases."""
    import pandas as pd

    kinds = list(dict.fromkeys(entry for entry in entries if entry))
    places = np.array([kinds.index(entry) if entry else -1 for entry in entries])
    return pd.Series(
        pd.Categorical.from_codes(places[code.to_numpy()], kinds), code.index, name=name
    )


def _xarray(
    function: Callable[..., Any], given: Mapping[str, Any], names: Sequence[str]
) -> list[Any]:
    import xarray as xr

    options: dict[str, Any] = {
        "output_core_dims": [()] * len(names),
        "output_dtypes": _kinds(names),
    }
    options |= {"dask": "parallelized", "keep_attrs": False}
    arrays = _aligned(
        lambda: xr.apply_ufunc(_plain(function, names), *given.values(), **options), given
    )
    found = [array.rename(name) for array, name in zip(arrays, names, strict=True)]
    for array, name in zip(found, names, strict=True):
        array.attrs = dict(zip(("units", "long_name"), _ABOUT[name], strict=True))
    return found


def _dask(
    function: Callable[..., Any], given: Mapping[str, Any], names: Sequence[str]
) -> list[Any]:
    import dask.array

    apply: Any = dask.array.apply_gufunc  # which has no types
    signature = ",".join(["()"] * len(given)) + "->" + ",".join(["()"] * len(names))
    options = {
        "output_dtypes": _kinds(names) if len(names) > 1 else _kinds(names)[0],
        "vectorize": False,
    }
    return _aligned(
        lambda: apply(_plain(function, names), signature, *given.values(), **options), given
    )


_APPLY: dict[str, Apply] = {"pandas": _pandas, "xarray": _xarray, "dask": _dask}

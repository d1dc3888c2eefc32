"""Labels are kept: pandas, xarray and Dask objects in, the same out; Dask stays lazy.

The inputs of one call come from one of these libraries, with plain numbers and NumPy arrays beside
them.
"""

import importlib
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mumacro.answer import BAND, GROUPS, Answer, add
from mumacro.errors import InputError
from mumacro.inputs.cases import DEVIATIONS, KIND, Cases, library_of
from mumacro.inputs.doubts import Remark
from mumacro.inputs.fields import ENDS
from mumacro.inputs.kind import kind_of
from mumacro.inputs.reading import without_unit
from mumacro.outputs import MEMBERS, OUTPUTS
from mumacro.outputs.evaluation import chosen, paths_of
from mumacro.table.atlas import REGIMES

#: what stands beside the outputs -> its unit and long name, as xarray and CF write them
_BESIDE = {
    "source_code": (
        "1",
        "index of the block or closed form that gave the value, -1 for an illegal case",
    ),
    "v_tilde": ("1", "dimensionless sliding speed"),
    "y_tilde": ("1", "dimensionless oscillation amplitude"),
    "length_scale": ("m", "mu0 Fz / k"),
    "regime": ("1", ", ".join(REGIMES)),
    "regime_code": ("1", "index of the regime, -1 for an illegal case"),
    "regime_certain": ("1", "whether the regime is certain"),
    "source": ("1", "block or closed form that gave the value"),
}
_ALWAYS = ("mu_macro", "mu_ratio", "error_bound", "source_code")
#: the slopes along k of attributes -> those of outputs: 0 and NaN where the contact is rigid
_SLOPES_OF_K = {"slope of k": "gradient.k", "bound of the slope of k": "gradient_bound.k"}
_DTYPES = {
    "source_code": np.int8,
    "regime_code": np.int8,
    "regime_certain": np.bool_,
    "source": object,
    "regime": object,
}
Apply = Callable[[Callable[..., Any], Mapping[str, Any], Sequence[str]], list[Any]]


class LabelledAnswer(Answer[Any]):
    """An answer whose attributes and outputs are Series, DataArrays or Dask arrays."""

    __slots__ = ("_kinds", "_library", "_values")

    _kinds: dict[str, Any]  # contact and direction, where they were given
    _library: str
    _values: dict[str, Any]  # all inputs

    def _apply(self, function: Callable[..., Any], inputs: Mapping[str, Any], name: str) -> Any:
        return _APPLY[self._library](lambda *arrays: [function(*arrays)], inputs, [name])[0]

    def _by_source(self, name: str, table: Any) -> Any:
        code = self.source_code
        if self._library == "pandas" and table.dtype == object:
            return _categories(table, code, name)
        return self._apply(lambda codes: table[codes], {"source_code": code}, name)

    def _shown(self) -> Mapping[str, Any]:
        """What is shown; of Dask only the names, since it computes when it is asked to."""
        columns = super()._shown()
        lazy = any(getattr(x, "chunks", None) is not None for x in columns.values())
        return {"computed by Dask": np.array([*columns])} if lazy else columns

    def plot(self, ax: Any = None) -> Any:
        """As in :class:`mumacro.Answer`."""
        if self._has_cases:
            return super().plot(ax)
        values = self._values
        if self._library == "xarray":
            with_labels = {name: x for name, x in values.items() if library_of(x)}
            arrays = importlib.import_module("xarray").broadcast(*with_labels.values())
            values = {**values, **dict(zip(with_labels, arrays, strict=True))}
        plain = {name: np.asarray(x) if np.ndim(x) else x for name, x in values.items()}
        return self._surrogate.evaluate(plain).plot(ax)

    @property
    def regime_certain(self) -> Any:
        """As in :class:`mumacro.Answer`."""
        tabulated, kind = self._surrogate.tabulated, kind_of(**self._kinds)

        def certain(v: Any, y: Any) -> Any:
            return tabulated.certain(v, y, kind)

        groups = {"v_tilde": self.v_tilde, "y_tilde": self.y_tilde}
        return self._apply(certain, groups, "regime_certain")


def evaluate_labelled(
    surrogate: Any, cases: Any, values: Mapping[str, Any], include: Sequence[str], strict: bool
) -> Any:
    """:meth:`mumacro.Surrogate.evaluate` for labelled inputs: ``values`` are those of ``cases`` and
    of the keywords, by name.

    Returns an answer whose attributes and outputs are Series, DataArrays or Dask arrays, by their
    names, for xarray with ``units`` and ``long_name``; for a DataFrame or Dataset of cases one of
    these, with a column for each output by its path (regime and source of pandas as categories).
    InputError for Series whose indexes differ, objects of two libraries in one call, and what
    ``evaluate`` refuses.
    """
    of_cases = library_of(cases)
    libraries = {*map(library_of, values.values()), of_cases} - {""}
    if "pandas" in libraries and len(libraries) > 1:
        raise InputError(
            "inputs", sorted(libraries), "objects of one library: pandas, or xarray and Dask"
        )
    library = next(name for name in _APPLY if name in libraries)
    if library != "pandas":  # Dask has its own threads
        surrogate = surrogate.on_one_thread()
    if of_cases == "dask":
        options = {"include": include, "illegal": "raise" if strict else "nan"}
        keywords = {name: value for name, value in values.items() if name not in cases.columns}
        return _parts(surrogate.evaluate, cases, {**options, **keywords})
    for name, value in values.items():
        if hasattr(value, "to_dask_array"):
            raise InputError(
                name, type(value).__name__, "a Dask array: .to_dask_array(lengths=True)"
            )
    values = {name: without_unit(name, x) if library_of(x) else x for name, x in values.items()}
    answer = (_of_pandas if library == "pandas" else _of_chunks)(
        surrogate, values, include, strict, library
    )
    answer._library, answer._surrogate = library, surrogate
    answer._kinds, answer._values = {name: values[name] for name in KIND if name in values}, values
    if of_cases not in ("pandas", "xarray"):
        return answer
    columns = {path: answer[path] for path in answer.paths}
    if library == "pandas":
        frame = importlib.import_module("pandas").DataFrame(columns)
        if remarks := answer.remarks:
            frame.attrs["remarks"] = remarks
        return frame
    dataset = importlib.import_module("xarray").Dataset(columns)
    if remarks := answer.remarks:  # as text, which netCDF can hold
        dataset.attrs["remarks"] = "\n".join(
            f"{remark['field']} ({remark['cases']} cases): {remark['text']}" for remark in remarks
        )
    return dataset


def _of_pandas(
    surrogate: Any, values: Mapping[str, Any], include: Sequence[str], strict: bool, _: str
) -> LabelledAnswer:
    """Series become arrays, and the arrays of the answer Series."""
    import pandas as pd

    # a frame as one of the inputs is refused below, by its name
    index = next((x.index for x in values.values() if isinstance(x, pd.Series)), None)
    arrays = _plain(values, index)
    try:
        cases = Cases.of(arrays, strict=strict)
        answer = surrogate.answer(cases, chosen(include, cases))
        return _labelled(answer, lambda x, name: pd.Series(x, index, name=name))
    except InputError:
        raise
    except ValueError as error:
        raise _not_alike(values) from error


def _plain(values: Mapping[str, Any], index: Any) -> dict[str, Any]:
    """Series and indexes as arrays; InputError for one that is not indexed as the others."""
    import pandas as pd

    for name, value in values.items():
        if isinstance(value, pd.Series) and not value.index.equals(index):
            raise InputError(name, "a Series", "indexed as the other inputs are: align them first")
    return {
        name: _without_gaps(x).to_numpy() if isinstance(x, (pd.Series, pd.Index)) else x
        for name, x in values.items()
    }


def _labelled(answer: Answer[Any], label: Callable[[Any, str], Any]) -> LabelledAnswer:
    """An answer of arrays with labels."""
    mu_macro, mu_ratio, bound, code = (label(getattr(answer, name), name) for name in _ALWAYS)
    result = LabelledAnswer(mu_macro, mu_ratio, bound, code, cases=answer.cases)
    if answer._groups is not None:
        v, y, length = map(label, answer._groups, GROUPS)
        result._groups = v, y, length
    for name in BAND:
        if hasattr(answer, name):
            setattr(result, name, label(getattr(answer, name), name))
    for name in ("gradient", "gradient_bound"):
        if (slopes := getattr(answer, name)) is not None:
            of_field = {field: label(x, f"{name}.{field}") for field, x in slopes.items()}
            setattr(result, name, of_field)
    result.outputs = {path: label(x, path) for path, x in answer.outputs.items()}
    result.remarks_on_outputs = answer.remarks_on_outputs
    return result


def _of_chunks(
    surrogate: Any, values: Mapping[str, Any], include: Sequence[str], strict: bool, library: str
) -> LabelledAnswer:
    """A function of arrays, applied to DataArrays or Dask arrays, chunk by chunk; the names of all
    results are known before."""
    arguments = {name: x for name, x in values.items() if library_of(x) or np.ndim(x)}
    constants = {name: x for name, x in values.items() if name not in arguments}
    deviations = any(name in DEVIATIONS for name in values)
    outputs = tuple(OUTPUTS[x] for x in OUTPUTS if x in include or (x == "std" and deviations))
    fields = kind_of(direction=values.get("direction", "across")).fields
    paths = paths_of(outputs, fields)
    gradient = any(output.name == "gradient" for output in outputs)
    band = BAND if {*ENDS} & values.keys() else ()
    names = [*_ALWAYS, *band]
    names += [*(GROUPS if outputs else ()), *(_SLOPES_OF_K if gradient else ()), *paths]

    remarks: list[Remark] = []

    def chunk(*columns: Any) -> list[Any]:
        inputs = {**constants, **dict(zip(arguments, columns, strict=True))}
        cases = Cases.of(inputs, strict=strict)
        answer = surrogate.answer(cases, chosen(include, cases))
        for remark in answer.remarks:
            add(remarks, remark)
        if (cases.std and not deviations) or (cases.ends is not None and not band):
            bound = "numbers: give deviations and intervals as arrays, std_k, k_low and k_high"
            raise InputError("inputs", "texts", bound)
        values = dict(answer.outputs)
        for name, path in _SLOPES_OF_K.items():
            slopes = getattr(answer, path.removesuffix(".k"))
            values[name] = None if slopes is None else slopes["k"]
        return [values[name] if name in values else getattr(answer, name) for name in names]

    results = dict(zip(names, _APPLY[library](chunk, arguments, names), strict=True))
    answer = LabelledAnswer(*(results[name] for name in names[:4]))
    if library == "xarray" and results["mu_macro"].chunks is None:  # else they are not known yet
        answer.remarks_on_outputs = remarks
    for name in band:
        setattr(answer, name, results[name])
    if outputs:
        answer._groups = results["v_tilde"], results["y_tilde"], results["length_scale"]
    answer.outputs = {path: results[path] for path in paths}
    if gradient:
        answer.gradient, answer.gradient_bound = (
            {field: results[f"{name}.{field}"] for field in fields} | {"k": results[of_k]}
            for of_k, name in (
                ("slope of k", "gradient"),
                ("bound of the slope of k", "gradient_bound"),
            )
        )
    return answer


def _parts(evaluate: Callable[..., Any], cases: Any, options: dict[str, Any]) -> Any:
    """A DataFrame of Dask, part by part; one without rows is evaluated now, so that faults of its
    columns show."""
    import pandas as pd

    empty = pd.DataFrame({name: pd.Series(dtype=dtype) for name, dtype in cases.dtypes.items()})
    return cases.map_partitions(evaluate, meta=evaluate(empty, **options), **options)


# --- a function of arrays, applied to labelled objects: one result for each name ------------------


def _about(name: str) -> dict[str, str]:
    """Unit and long name of a result, as attributes of xarray."""
    unit, meaning = _BESIDE[name] if name in _BESIDE else MEMBERS[_SLOPES_OF_K.get(name, name)]
    return {"units": unit.replace("-", "1"), "long_name": meaning}


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
        raise _not_alike(inputs) from error
    return list(results) if isinstance(results, tuple) else [results]


def _not_alike(inputs: Mapping[str, Any]) -> InputError:
    labels = {name: getattr(value, "sizes", np.shape(value)) for name, value in inputs.items()}
    return InputError("inputs", labels, "labelled and shaped alike: align them first")


def _pandas(
    function: Callable[..., Any], inputs: Mapping[str, Any], names: Sequence[str]
) -> list[Any]:
    import pandas as pd

    index = next(value.index for value in inputs.values())
    arrays = _on_arrays(function, names)(*inputs.values())
    arrays = arrays if len(names) > 1 else (arrays,)
    return [pd.Series(x, index, name=name) for x, name in zip(arrays, names, strict=True)]


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
        array.attrs = _about(name)
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

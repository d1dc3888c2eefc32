"""Keep frames and labels: inputs from pandas, Polars, Arrow, xarray or Dask give outputs of the
same library.

The outputs have their usual names, their paths.  All labelled inputs of one call come from one of
these libraries; plain numbers and NumPy arrays may be mixed with them.
"""

import json
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mumacro.errors import InputError
from mumacro.inputs.carried import labelled_in_si, library
from mumacro.inputs.cases import Cases, library_of
from mumacro.inputs.columns import is_column, read_column
from mumacro.inputs.units import quantity_of
from mumacro.outputs import MEMBERS
from mumacro.outputs.answer import TEXTS, Answer
from mumacro.outputs.evaluation import chosen
from mumacro.results import Note, add
from mumacro.table.atlas import REGIMES, SOURCES

#: libraries whose frames and tables give a result of the same type
FRAMES = ("pandas", "polars", "pyarrow", "xarray", "dask")
# outputs that are texts -> their unit and long name, as xarray and CF write them
_ABOUT_TEXTS = {
    "regime": ("1", ", ".join(REGIMES)),
    "source": ("1", "block or closed form that gave the value"),
}


def frame_of_cases(cases: Any) -> str:
    """Return the library of the frame, table or Dataset of cases.  A stream of Arrow, or an object
    with its interface, is a table.  Return an empty text for anything else, such as one row of a
    frame.

    >>> frame_of_cases({"mu0": 0.3})
    ''
    """
    package = library(cases)
    if package == "pandas":
        return package if hasattr(cases, "columns") else ""
    if package in FRAMES:
        return package
    return "pyarrow" if hasattr(cases, "__arrow_c_stream__") else ""


def evaluate_labelled(
    surrogate: Any, cases: Any, values: Mapping[str, Any], include: Sequence[str], strict: bool
) -> Any:
    """Return the answer of :meth:`mumacro.Surrogate.evaluate` for a frame of cases, or for labelled
    inputs.  ``values`` has the inputs of ``cases`` and of the keywords, by name.

    Objects of pandas give a DataFrame with their index (regime and source as categories).  Objects
    of xarray give a Dataset with ``units`` and ``long_name``, arrays of Dask a dict.  A frame of
    Dask or Polars and a table of Arrow give a result of the same type.  There is a column for each
    output, named by its path.

    Raise InputError if indexes differ, if objects of two libraries are in one call, and for
    everything that ``evaluate`` refuses.
    """
    frame = frame_of_cases(cases) if cases is not None else ""
    libraries = {*map(library_of, values.values()), frame} - {""}
    if len(libraries) > 1 and libraries != {"xarray", "dask"}:
        bound = "objects of one library: pandas, or xarray and Dask"
        raise InputError("inputs", sorted(libraries), bound)
    if frame == "dask":
        return _of_parts(surrogate.on_threads(1), cases, values, include, strict)
    if libraries & {"xarray", "dask"}:
        # Dask has its own threads
        return _of_chunks(surrogate.on_threads(1), values, include, strict)
    index = _common_index(cases if frame == "pandas" else None, values)
    of_cases = Cases.of(values, strict=strict)
    answer = surrogate.answer(of_cases, chosen(include, of_cases))
    if frame == "polars":
        return _as_polars(answer)
    if frame == "pyarrow":
        return _as_arrow(answer, cases)
    if of_cases.shape not in ((len(index),), (1,), ()):
        raise _not_alike(values)
    return _as_pandas(answer, index)


# --- frames and tables ----------------------------------------------------------------------------


def _common_index(frame: Any, values: Mapping[str, Any]) -> Any:
    """Return the index of all Series.  Raise InputError for a Series with another index."""
    series = {name: x for name, x in values.items() if library_of(x) == "pandas"}
    for name, one in series.items():
        if not hasattr(one, "index"):
            raise InputError(name, "a DataFrame", "one column of it")
    indexes = ([] if frame is None else [frame.index]) + [one.index for one in series.values()]
    for name, one in series.items():
        if not one.index.equals(indexes[0]):
            raise InputError(name, "a Series", "indexed as the other inputs are: align them first")
    return indexes[0] if indexes else None


def _codes(answer: Answer[Any], path: str) -> tuple[Any, tuple[str, ...]]:
    """Return a text output as codes (-1 for an illegal case), and the texts."""
    if path == "source":
        return np.ravel(answer.source_code), tuple(SOURCES)
    return np.ravel(answer.regime_code), tuple(REGIMES)


def _as_pandas(answer: Answer[Any], index: Any) -> Any:
    """Return a DataFrame with the remarks in its ``attrs``."""
    import pandas as pd

    columns: dict[str, Any] = {}
    for path in answer.paths:
        if path in TEXTS:
            codes, texts = _codes(answer, path)
            column = pd.Categorical.from_codes(np.broadcast_to(codes, len(index)), [*texts])
        else:
            column = np.broadcast_to(np.ravel(answer[path]), len(index))
        columns[path] = column
    frame = pd.DataFrame(columns, index)
    if remarks := answer.remarks:
        frame.attrs["remarks"] = remarks
    return frame


def _as_polars(answer: Answer[Any]) -> Any:
    """Return a DataFrame.  It has no place for remarks, so they become warnings."""
    import polars as pl

    columns = []
    for path in answer.paths:
        if path in TEXTS:
            codes, texts = _codes(answer, path)
            words = np.array([*texts, None], object)[codes].tolist()
            columns.append(pl.Series(path, words, dtype=pl.Enum(texts)))
        else:
            columns.append(pl.Series(path, np.ravel(answer[path])))
    for line in (note.line for note in answer.notes):
        # the warning shows the line that called evaluate
        warnings.warn(line, UserWarning, stacklevel=4)
    return pl.DataFrame(columns)


def _as_arrow(answer: Answer[Any], cases: Any) -> Any:
    """Return a table (for a batch: a batch) with the remarks as JSON in its metadata."""
    import pyarrow as pa

    columns: dict[str, Any] = {}
    for path in answer.paths:
        if path in TEXTS:
            codes, texts = _codes(answer, path)
            indices = pa.array(codes, pa.int8(), mask=codes < 0)
            # NumPy would take a null of a dictionary for its last word
            words = pa.DictionaryArray.from_arrays(indices, pa.array(texts))
            columns[path] = words.dictionary_decode()
        else:
            columns[path] = np.ravel(answer[path])
    make: Any = pa.record_batch if isinstance(cases, pa.RecordBatch) else pa.table
    remarks = answer.remarks
    return make(columns, metadata={"remarks": json.dumps(remarks)} if remarks else None)


def _of_parts(
    surrogate: Any, cases: Any, values: Mapping[str, Any], include: Sequence[str], strict: bool
) -> Any:
    """Return a DataFrame of Dask, evaluated part by part.  A frame without rows is evaluated now,
    so that faults of its columns are reported now."""
    import pandas as pd

    options = {"include": include, "illegal": "raise" if strict else "nan"}
    options |= {name: value for name, value in values.items() if name not in cases.columns}
    empty = pd.DataFrame({name: pd.Series(dtype=dtype) for name, dtype in cases.dtypes.items()})
    evaluate: Callable[..., Any] = surrogate.evaluate
    return cases.map_partitions(evaluate, meta=evaluate(empty, **options), **options)


# --- arrays of xarray and Dask --------------------------------------------------------------------


def _of_chunks(
    surrogate: Any, values: Mapping[str, Any], include: Sequence[str], strict: bool
) -> Any:
    """Return a Dataset, or a dict of arrays of Dask, evaluated chunk by chunk."""
    arrays, constants = dict[str, Any](), dict[str, Any]()
    for name, x in values.items():
        if hasattr(x, "to_dask_array"):
            bound = "a Dask array: .to_dask_array(lengths=True)"
            raise InputError(name, type(x).__name__, bound)
        if library_of(x):
            arrays[name] = labelled_in_si(name, x, quantity_of(name))
        elif is_column(x):
            arrays[name] = read_column(name, x).si
        else:
            constants[name] = x
    one = Cases.of({**constants, **dict.fromkeys(arrays, np.full(1, np.nan))})
    # the names and types of all outputs are known before the cases are
    types = {path: np.asarray(x).dtype for path, x in _outputs(surrogate, one, include).items()}
    notes: list[Note] = []

    def evaluate(*columns: Any) -> tuple[Any, ...]:
        inputs = {**constants, **dict(zip(arrays, columns, strict=True))}
        cases = Cases.of(inputs, strict=strict)
        outputs = _outputs(surrogate, cases, include, notes)
        return tuple(np.asarray(outputs[path], dtype) for path, dtype in types.items())

    if not any(library_of(x) == "xarray" for x in arrays.values()):
        return _as_dask(evaluate, arrays, types)
    return _as_xarray(evaluate, arrays, types, notes)


def _outputs(
    surrogate: Any, cases: Cases, include: Sequence[str], notes: list[Note] | None = None
) -> dict[str, Any]:
    """Return all outputs of cases by path, and add their notes to ``notes``."""
    answer = surrogate.answer(cases, chosen(include, cases))
    if notes is not None:
        for note in answer.notes:
            add(notes, note)
    return {path: answer[path] for path in answer.paths}


def _as_xarray(
    evaluate: Callable[..., Any],
    arrays: Mapping[str, Any],
    types: Mapping[str, Any],
    notes: list[Note],
) -> Any:
    """Return a Dataset.  Values that Dask has not computed yet have no remarks."""
    import xarray as xr

    options: dict[str, Any] = {
        "output_core_dims": [()] * len(types),
        "output_dtypes": [*types.values()],
        "dask": "parallelized",
        "keep_attrs": False,
    }
    results = _call_aligned(lambda: xr.apply_ufunc(evaluate, *arrays.values(), **options), arrays)
    dataset = xr.Dataset(dict(zip(types, results, strict=True)))
    for path, array in dataset.items():
        unit, meaning = _ABOUT_TEXTS.get(str(path)) or MEMBERS[str(path)]
        array.attrs = {"units": unit.replace("-", "1"), "long_name": meaning}
    if notes and dataset["mu_macro"].chunks is None:
        lines = (f"{one.field} ({one.cases} cases): {one.text}" for one in notes)
        dataset.attrs["remarks"] = "\n".join(lines)  # as a text, because netCDF can hold it
    return dataset


def _as_dask(
    evaluate: Callable[..., Any], arrays: Mapping[str, Any], types: Mapping[str, Any]
) -> dict[str, Any]:
    """Return lazy arrays by path."""
    import dask.array

    apply: Any = dask.array.apply_gufunc  # Dask declares no types
    signature = ",".join(["()"] * len(arrays)) + "->" + ",".join(["()"] * len(types))
    options = {"output_dtypes": [*types.values()], "vectorize": False}
    results = _call_aligned(lambda: apply(evaluate, signature, *arrays.values(), **options), arrays)
    return dict(zip(types, results, strict=True))


def _call_aligned(call: Callable[[], Any], inputs: Mapping[str, Any]) -> Any:
    """Return all results of ``call``.  Raise InputError if the labels or shapes of its arguments do
    not fit."""
    try:
        return call()
    except InputError:
        raise
    except ValueError as error:
        raise _not_alike(inputs) from error


def _not_alike(inputs: Mapping[str, Any]) -> InputError:
    labels = {name: getattr(value, "sizes", np.shape(value)) for name, value in inputs.items()}
    return InputError("inputs", labels, "labelled and shaped alike: align them first")

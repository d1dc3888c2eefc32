"""One Arrow record batch of cases in, the same batch with results out, and a list of rejected rows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from mumacro.charts import REGIME_OF_SOURCE, REGIMES, SOURCES
from mumacro.files.columns import ANSWERS, Columns, FilesError, find_columns
from mumacro.inputs import FIELDS, POSITIVE, RAD_PER_CYCLE, RIGID, Scale, refusal
from mumacro.surrogate import Surrogate

__all__ = ["ANSWERS", "REJECTS", "added_fields", "answer", "numbers"]

Array = NDArray[np.float64]

#: of a row without a result: its index, the input (null: the row itself), the value, the reason
REJECTS = pa.schema([("row", pa.int64()), ("field", pa.string()), ("value", pa.string()), ("reason", pa.string())])

_PLAIN = r"^[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$|^[+-]?(?i:nan|inf|infinity)$"
_REGIMES, _SOURCES = pa.array(REGIMES, pa.string()), pa.array(SOURCES, pa.string())
_MISSING, _NO_NUMBER, _TOO_LARGE = 1, 2, 3
_WHY = {_MISSING: "is missing", _NO_NUMBER: "must be a number", _TOO_LARGE: "is beyond double range"}


def added_fields(include: Sequence[str] = ()) -> list[pa.Field]:
    """The Arrow fields that :func:`answer` adds."""
    words = pa.dictionary(pa.int8(), pa.string())
    kinds = {"regime": words, "source": words}
    fields = [pa.field(name, kinds.get(name, pa.float64())) for name in ANSWERS]
    if "gradient" in include:
        fields += [pa.field(f"d_mu_macro_d_{name}", pa.float64()) for name in FIELDS]
    return fields


def answer(
    batch: pa.RecordBatch,
    surrogate: Surrogate | None = None,
    *,
    rigid: bool = False,
    include: Sequence[str] = (),
) -> tuple[pa.RecordBatch, pa.RecordBatch]:
    """Evaluate every case of a batch.

    Parameters
    ----------
    batch : pyarrow.RecordBatch
        Columns ``mu0`` [-], ``Fz`` [N], ``k`` [N/m], ``y0`` [m], ``omega`` [rad/s] or ``f`` [Hz], ``v0`` [m/s], with
        another unit where the heading has it in brackets; numbers or text.  A ``rigid`` or infinite k is a
        rigid contact.  Other columns are copied unchanged.
    surrogate : Surrogate, optional
        The table; left out, the tightest one that comes with the library.
    rigid : bool
        All contacts are rigid and there is no column k.
    include : sequence of str
        ``"gradient"`` adds d mu_macro / d input, ``d_mu_macro_d_mu0`` and so on.

    Returns
    -------
    batch : pyarrow.RecordBatch
        As many rows in the same order, with mu_macro, mu_ratio, regime, error_bound and source; null where a case has
        no result.
    rejects : pyarrow.RecordBatch
        One row of ``REJECTS`` for each of those.

    Raises
    ------
    FilesError
        A column is missing, has a wrong name or no numbers.

    Examples
    --------
    >>> case = {"mu0": [0.3], "Fz": [10], "k": ["rigid"], "y0 [um]": [2.0], "f": [20690], "v0": [-1.0]}
    >>> answered, rejects = answer(pa.RecordBatch.from_pydict(case))
    >>> rejects.to_pylist()
    [{'row': 0, 'field': 'v0', 'value': '-1.0', 'reason': 'must be finite and >= 0'}]
    """
    fields = added_fields(include)
    columns = find_columns(batch.schema.names, rigid, [field.name for field in fields])
    return answer_columns(batch, surrogate or Surrogate.open(), columns, include)


def answer_columns(
    batch: pa.RecordBatch, surrogate: Surrogate, columns: Columns, include: Sequence[str] = ()
) -> tuple[pa.RecordBatch, pa.RecordBatch]:
    """:func:`answer` where the columns are known already."""
    n = batch.num_rows
    values: dict[str, Array] = {"k": np.array([math.inf])}
    faults: dict[str, NDArray[np.int8]] = {}
    for name, (heading, scale) in columns.places.items():
        field = "omega" if name == "f" else name
        try:
            found, fault = numbers(batch.column(heading), name == "k")
        except FilesError as error:
            raise FilesError(f"the column {heading!r} {error}") from None
        values[field] = _in_si(found, scale, RAD_PER_CYCLE if name == "f" else 1.0)
        if fault is not None:
            faults[field] = fault
    if n == 0:  # a column of one value would count as a case
        values["k"] = np.empty(0)
    macro, ratio, bound, source = surrogate.evaluate_columns(
        values["mu0"], values["Fz"], values["k"], values["y0"], values["omega"], values["v0"]
    )
    bad = source < 0
    mask = bad if bad.any() else None
    words = {
        "regime": (np.append(REGIME_OF_SOURCE, np.int8(0))[source], _REGIMES),
        "source": (np.where(bad, 0, source).astype(np.int8) if mask is not None else source, _SOURCES),
    }
    plain = {"mu_macro": macro, "mu_ratio": ratio, "error_bound": bound}
    if "gradient" in include:
        full: dict[str, Any] = {name: np.broadcast_to(column, n) for name, column in values.items()}
        slopes = surrogate.evaluate(**full, gradient=True).gradient or {}
        # the slope along k is 0 for a rigid contact, which has no k
        slopes["k"] = np.where(np.isinf(full["k"]), math.nan, slopes["k"])
        plain |= {f"d_mu_macro_d_{name}": column for name, column in slopes.items()}
    added = []
    for field in added_fields(include):
        if field.name in words:
            codes, texts = words[field.name]
            added.append(pa.DictionaryArray.from_arrays(pa.array(codes, pa.int8(), mask=mask), texts))
        else:
            column = plain[field.name]
            added.append(pa.array(column, mask=np.isnan(column) if field.name.startswith("d_") else mask))
    schema = pa.schema([*batch.schema, *added_fields(include)], batch.schema.metadata)
    rejects = _rejects(batch, columns, np.flatnonzero(bad), values, faults)
    return pa.RecordBatch.from_arrays([*batch.columns, *added], schema=schema), rejects


def _in_si(found: Array, scale: Scale, factor: float) -> Array:
    """Values in SI; a power of ten below one divides, so that 2 um is the double 2e-6."""
    if scale != Scale():
        with np.errstate(over="ignore"):
            found = found * scale.times / scale.over
    return found * factor if factor != 1.0 else np.require(found, requirements=("C", "W"))


def numbers(array: pa.Array, stiffness: bool) -> tuple[Array, NDArray[np.int8] | None]:
    """A column as doubles (n,), NaN where it holds none, and why (n,) (None: no such place).

    With ``stiffness`` the word ``rigid`` is infinite.

    Raises
    ------
    FilesError
        The column's type is none of numbers or text.
    """
    kind = array.type
    if pa.types.is_dictionary(kind):
        array = array.dictionary_decode()
        kind = array.type
    fault: NDArray[np.int8] | None = None
    if pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_string_view(kind):
        array, fault = _parsed(_words_as_infinity(array) if stiffness else array)
    elif pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind):
        array = pc.cast(array, pa.float64(), safe=False)
    elif pa.types.is_null(kind):
        array = pa.nulls(len(array), pa.float64())
    else:
        raise FilesError(f"holds {kind}, not numbers")
    if array.null_count == 0:
        return array.to_numpy(zero_copy_only=False), fault
    empty = array.is_null().to_numpy(zero_copy_only=False)
    out: Array = array.to_numpy(zero_copy_only=False).copy()
    fault = np.zeros(out.size, np.int8) if fault is None else fault
    fault[empty & (fault == 0)] = _MISSING
    return out, fault


def _words_as_infinity(array: pa.Array) -> pa.Array:
    """A stiffness as text, with ``inf`` for the word ``rigid``."""
    text = pc.utf8_trim_whitespace(pc.cast(array, pa.large_string()))
    return pc.if_else(pc.fill_null(pc.equal(pc.ascii_lower(text), RIGID), False), "inf", text)


def _parsed(array: pa.Array) -> tuple[pa.Array, NDArray[np.int8] | None]:
    """Text as doubles, null where a cell is empty or no number; and where it is no number."""
    text = pc.utf8_trim_whitespace(pc.cast(array, pa.large_string()))
    text = pc.if_else(pc.equal(text, ""), None, text)
    wrong: NDArray[np.bool_] = np.zeros(len(text), np.bool_)
    try:
        out = pc.cast(text, pa.float64())
    except pa.ArrowInvalid:
        plain = pc.match_substring_regex(text, _PLAIN)
        wrong = pc.invert(pc.fill_null(plain, True)).to_numpy(zero_copy_only=False)
        out = pc.cast(pc.if_else(plain, text, None), pa.float64())
    # a number of too many digits must not pass for an infinite stiffness
    large = np.zeros(len(text), np.bool_)
    infinite = pc.fill_null(pc.is_inf(out), False)
    if pc.any(infinite).as_py():
        large = pc.and_(infinite, pc.match_substring_regex(text, r"\d")).to_numpy(zero_copy_only=False)
        out = pc.if_else(large, None, out)
    if not (wrong.any() or large.any()):
        return out, None
    return out, np.where(large, _TOO_LARGE, np.where(wrong, _NO_NUMBER, 0)).astype(np.int8)


def _rejects(
    batch: pa.RecordBatch,
    columns: Columns,
    rows: NDArray[np.intp],
    values: dict[str, Array],
    faults: dict[str, NDArray[np.int8]],
) -> pa.RecordBatch:
    """What is wrong with ``rows``: the first bad input of each, in the order of the inputs."""
    listed: list[tuple[int, str | None, str | None, str]] = []
    named = {"omega" if name == "f" else name: name for name in columns.places}
    given = [(field, named[field], columns.places[named[field]][0]) for field in FIELDS if field in named]
    for i in rows.tolist():
        for field, name, column in given:
            fault = int(faults[field][i]) if field in faults else 0
            value = values[field][i]
            positive = value > 0.0 if field in POSITIVE else value >= 0.0
            if fault or not (positive and (math.isfinite(value) or field == "k")):
                gap = field == "k" and fault == _MISSING
                reason = _WHY[fault] if fault and not gap else refusal(field, math.nan if gap else value)
                listed.append((i, name, _text(batch.column(column)[i].as_py()), reason))
                break
    by_field: list[Any] = [list(column) for column in zip(*listed, strict=True)] or [[] for _ in REJECTS]
    return pa.RecordBatch.from_arrays(
        [pa.array(column, field.type) for column, field in zip(by_field, REJECTS, strict=True)], schema=REJECTS
    )


def _text(value: object) -> str | None:
    return None if value is None else str(value)

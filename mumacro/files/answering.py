"""One Arrow record batch of cases in, the same batch with results out, and a list of rejected rows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from mumacro.charts import REGIME_OF_SOURCE, REGIMES, SOURCES
from mumacro.contact import AMPLITUDE, kind_of
from mumacro.files.columns import ANSWERS, BAND, Columns, FilesError, find_columns
from mumacro.inputs import POSITIVE, RAD_PER_CYCLE, Scale, refusal
from mumacro.interval import ENDS
from mumacro.surrogate import Surrogate

__all__ = ["ANSWERS", "REJECTS", "added_fields", "answer", "answer_columns", "numbers"]

Array = NDArray[np.float64]
Codes = NDArray[np.int8]

#: of a row without a result: its index, the input (null: the row itself), the value, the reason
REJECTS = pa.schema([("row", pa.int64()), ("field", pa.string()), ("value", pa.string()), ("reason", pa.string())])

_PLAIN = r"^[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$|^[+-]?(?i:nan|inf|infinity)$"
_NO_NUMBER, _TOO_LARGE = 1, 2
_WHY = {_NO_NUMBER: "must be a number", _TOO_LARGE: "is beyond double range"}


def added_fields(names: Sequence[str] = ANSWERS) -> list[pa.Field]:
    """The Arrow fields of the columns that :func:`answer` adds."""
    words = pa.dictionary(pa.int8(), pa.string())
    return [pa.field(name, words if name in ("regime", "source") else pa.float64()) for name in names]


def answer(
    batch: pa.RecordBatch,
    surrogate: Surrogate | None = None,
    *,
    rigid: bool = False,
    include: Sequence[str] = (),
    contact: str = "spring",
    direction: str = "across",
) -> tuple[pa.RecordBatch, pa.RecordBatch]:
    """Evaluate every case of a batch.

    Parameters
    ----------
    batch : pyarrow.RecordBatch
        Columns ``mu0`` [-], ``Fz`` [N], ``k`` [N/m], ``y0`` [m], ``omega`` [rad/s] or ``f`` [Hz], ``v0`` [m/s], with
        another unit where the heading has it in brackets; numbers or text.  An infinite k, or the word ``rigid``, is a
        rigid contact.  A null, a NaN or an empty cell is missing, in k as elsewhere.  ``k_low`` and ``k_high`` may
        stand for k; ``Fz_amplitude`` [N] stands for y0 in direction normal.  Other columns are copied unchanged.
    surrogate : Surrogate, optional
        The table; left out, the tightest one that comes with the library.
    rigid : bool
        All contacts are rigid and there is no column k.
    include : sequence of str
        ``"gradient"`` adds d mu_macro / d input, ``d_mu_macro_d_mu0`` and so on.
    contact, direction : str
        Of all cases, as in :meth:`mumacro.Surrogate.evaluate`.

    Returns
    -------
    batch : pyarrow.RecordBatch
        As many rows in the same order, with mu_macro (for an interval of k also mu_macro_low and mu_macro_high),
        mu_ratio, regime, error_bound and source; null where a case has no result.
    rejects : pyarrow.RecordBatch
        One row of ``REJECTS`` for each of those.

    Raises
    ------
    FilesError
        A column is missing, has a wrong name or no numbers.
    InputError
        An unknown contact or direction.

    Examples
    --------
    >>> case = {"mu0": [0.3], "Fz": [10], "k": ["rigid"], "y0 [um]": [2.0], "f": [20690], "v0": [-1.0]}
    >>> answered, rejects = answer(pa.RecordBatch.from_pydict(case))
    >>> rejects.to_pylist()
    [{'row': 0, 'field': 'v0', 'value': '-1.0', 'reason': 'must be finite and >= 0'}]
    """
    columns = find_columns(batch.schema.names, rigid, include, kind_of(contact, direction))
    added, rejects, _ = answer_columns(batch, surrogate or Surrogate.open(), columns, include)
    schema = pa.schema([*batch.schema, *added_fields(columns.added(include))], batch.schema.metadata)
    return pa.RecordBatch.from_arrays([*batch.columns, *added], schema=schema), rejects


def answer_columns(
    batch: pa.RecordBatch, surrogate: Surrogate, columns: Columns, include: Sequence[str] = (), decimal: str = "."
) -> tuple[list[pa.Array], pa.RecordBatch, dict[str, Array]]:
    """The columns that :func:`answer` adds, the rejects, and the inputs as doubles in their units by heading."""
    n = batch.num_rows
    given: dict[str, Array] = {}
    values: dict[str, Any] = {} if ENDS[0] in columns.places else {"k": np.full(n, math.inf)}
    faults: dict[str, Codes] = {}
    for name, (heading, scale) in columns.places.items():
        field = "omega" if name == "f" else name
        try:
            given[heading], fault = numbers(batch.column(heading), name == "k", decimal)
        except FilesError as error:
            raise FilesError(f"the column {heading!r} {error}") from None
        values[field] = _in_si(given[heading], scale, RAD_PER_CYCLE if name == "f" else 1.0, fault)
        faults[field] = fault
    gradient = "gradient" in include
    found = surrogate.evaluate(**{**values, **columns.kind.names, "gradient": gradient})
    bad = found.source_code < 0
    mask = bad if bad.any() else None
    code = np.where(bad, 0, found.source_code).astype(np.int8)
    arrays: dict[str, Any] = {
        "regime": _words(REGIME_OF_SOURCE[code], REGIMES, mask),
        "source": _words(code, SOURCES, mask),
    }
    for name, slope in (found.gradient or {}).items():
        # the slope along k is 0 for a rigid contact, which has no k
        told = slope if name != "k" or name not in values else np.where(np.isinf(values["k"]), math.nan, slope)
        arrays[f"d_mu_macro_d_{name}"] = pa.array(told, mask=np.isnan(told))
    for name in ("mu_macro", *BAND, "mu_ratio", "error_bound"):
        if hasattr(found, name):
            arrays[name] = pa.array(getattr(found, name), mask=mask)
    rejects = _rejects(batch, columns, np.flatnonzero(bad), values, faults)
    return [arrays[name] for name in columns.added(include)], rejects, given


def _words(codes: Codes, words: Sequence[str], mask: NDArray[np.bool_] | None) -> pa.Array:
    return pa.DictionaryArray.from_arrays(pa.array(codes, pa.int8(), mask=mask), pa.array(words, pa.string()))


def _in_si(found: Array, scale: Scale, factor: float, fault: Codes) -> Array:
    """Values in SI; a power of ten below one divides, so that 2 um is the double 2e-6."""
    if scale == Scale() and factor == 1.0:
        return np.require(found, requirements=("C", "W"))
    with np.errstate(over="ignore"):
        values: Array = found * scale.times / scale.over * factor
    beyond = np.isinf(values) & np.isfinite(found)  # a large stiffness is not a rigid contact
    values[beyond], fault[beyond] = math.nan, _TOO_LARGE
    return values


def numbers(array: pa.Array, stiffness: bool = False, decimal: str = ".") -> tuple[Array, Codes]:
    """A column as doubles (n,), NaN where it holds none, and a code (n,) for text that is no number.

    With ``stiffness`` the word ``rigid`` is infinite.

    Raises
    ------
    FilesError
        The column's type is none of numbers or text.
    """
    if pa.types.is_dictionary(array.type):
        array = array.dictionary_decode()
    kind = array.type
    fault: Codes = np.zeros(len(array), np.int8)
    if pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_string_view(kind):
        array = _parsed(array, stiffness, decimal, fault)
    elif pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind):
        array = pc.cast(array, pa.float64(), safe=False)
    elif pa.types.is_null(kind):
        array = pa.nulls(len(array), pa.float64())
    else:
        raise FilesError(f"holds {kind}, not numbers")
    if array.null_count:
        array = pc.fill_null(array, math.nan)
    return array.to_numpy(zero_copy_only=False), fault


def _parsed(array: pa.Array, stiffness: bool, decimal: str, fault: Codes) -> pa.Array:
    """Text as doubles, null where it is none; ``fault`` gets the reason, unless the cell is empty."""
    text = pc.utf8_trim_whitespace(pc.cast(array, pa.large_string()))
    if decimal != ".":  # with a decimal comma 1.5 may mean 1500: it is no number
        text = pc.replace_substring(pc.replace_substring(text, ".", "?"), decimal, ".")
    rigid = pc.equal(pc.ascii_lower(text), "rigid") if stiffness else pa.scalar(False)
    text = pc.if_else(pc.or_(rigid, pc.equal(text, "")), None, text)
    try:
        out = pc.cast(text, pa.float64())
    except pa.ArrowInvalid:
        plain = pc.fill_null(pc.match_substring_regex(text, _PLAIN), True)
        fault[pc.invert(plain).to_numpy(zero_copy_only=False)] = _NO_NUMBER
        text = pc.if_else(plain, text, None)
        out = pc.cast(text, pa.float64())
    infinite = pc.fill_null(pc.is_inf(out), False)
    if pc.any(infinite).as_py():  # a number of too many digits must not pass for an infinite stiffness
        large = pc.and_(infinite, pc.match_substring_regex(text, r"\d"))
        fault[pc.fill_null(large, False).to_numpy(zero_copy_only=False)] = _TOO_LARGE
        out = pc.if_else(large, None, out)
    return pc.if_else(rigid, math.inf, out) if stiffness else out


def _rejects(
    batch: pa.RecordBatch,
    columns: Columns,
    rows: NDArray[np.intp],
    values: dict[str, Array],
    faults: dict[str, Codes],
) -> pa.RecordBatch:
    """What is wrong with ``rows``: the first bad input of each, in the order of the inputs."""
    listed: list[tuple[int, str, str | None, str]] = []
    named = {"omega" if name == "f" else name: name for name in columns.places}
    for i in rows.tolist():
        row = {field: float(values[field][i]) for field in columns.fields if field in named}
        reasons = ((field, _reason(field, row, int(faults[field][i]))) for field in row)
        for field, reason in filter(lambda pair: pair[1], reasons):
            cell = batch.column(columns.places[named[field]][0])[i].as_py()
            listed.append((i, named[field], None if cell is None else str(cell), str(reason)))
            break
    by_field: list[Any] = [list(column) for column in zip(*listed, strict=True)] or [[] for _ in REJECTS]
    arrays = [pa.array(column, field.type) for column, field in zip(by_field, REJECTS, strict=True)]
    return pa.RecordBatch.from_arrays(arrays, schema=REJECTS)


def _reason(field: str, row: Mapping[str, float], fault: int) -> str | None:
    """What is wrong with one value of a row; None if it is legal."""
    value = row[field]
    if fault:
        return _WHY[fault]
    if math.isnan(value) and field != "k":
        return "is missing"
    positive = field in (*POSITIVE, *ENDS)
    legal = (value > 0.0 if positive else value >= 0.0) and (math.isfinite(value) or field == "k")
    if field == AMPLITUDE:
        return None if legal and not value >= row["Fz"] else "must be >= 0 and below Fz: at Fz the contact lifts off"
    if field in ENDS:
        ordered = field == ENDS[0] or not value < row[ENDS[0]]
        return "must be finite and > 0" if not legal else None if ordered else f"must be >= {ENDS[0]}"
    return None if legal else refusal(field, value)

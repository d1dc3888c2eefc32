"""One Arrow record batch of cases in, the same batch with results out, and a list of rejected rows.

Columns that are named like a missing input are refused.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from mumacro.answer import BAND
from mumacro.errors import InputError
from mumacro.files.errors import FilesError
from mumacro.files.text_columns import numbers_of
from mumacro.inputs.cases import Cases
from mumacro.inputs.fields import GAP, LIKE, SI, refusal
from mumacro.inputs.headings import absent, absent_together, find_heads, meant_by
from mumacro.inputs.k_range import ENDS
from mumacro.inputs.kind import AMPLITUDE, SPRING, Kind, kind_of
from mumacro.inputs.numbers import TOO_LARGE
from mumacro.inputs.signs import Signs
from mumacro.inputs.text_tables import Wanted
from mumacro.inputs.units import Scale, split_unit
from mumacro.kernel.arrays import Array, Bools, Codes
from mumacro.outputs.gradient import GRADIENT
from mumacro.surrogate import Surrogate
from mumacro.table.atlas import REGIME_OF_SOURCE, REGIMES, SOURCES

#: columns that are added
ANSWERS = ("mu_macro", "mu_ratio", "regime", "error_bound", "source")
#: of a row without a result: its index, the input (null: the row itself), the value, the reason
REJECTS = pa.schema(
    [("row", pa.int64()), ("field", pa.string()), ("value", pa.string()), ("reason", pa.string())]
)


def added_fields(names: Sequence[str] = ANSWERS) -> list[pa.Field]:
    """The Arrow fields of the columns that :func:`answer` adds."""
    words = pa.dictionary(pa.int8(), pa.string())
    return [
        pa.field(name, words if name in ("regime", "source") else pa.float64()) for name in names
    ]


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
        Columns ``mu0`` [-], ``Fz`` [N], ``k`` [N/m], ``y0`` [m], ``omega`` [rad/s] or ``f`` [Hz],
        ``v0`` [m/s], with another unit where the heading has it in brackets; numbers or text.  An
        infinite k, or the word ``rigid``, is a rigid contact.  A null, a NaN or an empty cell is
        missing, in k as elsewhere.  ``k_low`` and ``k_high`` may stand for k; ``Fz_amplitude`` [N]
        stands for y0 in direction normal.  Other columns are copied unchanged.
    surrogate : Surrogate, optional
        Left out, the tightest table that comes with the library.
    rigid : bool
        All contacts are rigid and there is no column k.
    include : sequence of str
        ``"gradient"`` adds d mu_macro / d input, ``d_mu_macro_d_mu0`` and so on.
    contact, direction : str
        Of all cases, as in :meth:`mumacro.Surrogate.evaluate`.

    Returns
    -------
    batch : pyarrow.RecordBatch
        As many rows in the same order, with mu_macro (for an interval of k also mu_macro_low and
        mu_macro_high), mu_ratio, regime, error_bound and source; null where a case has no result.
    rejects : pyarrow.RecordBatch
        One row of ``REJECTS`` for each of those.

    Raises
    ------
    FilesError
        A column is missing, has a wrong name or no numbers.

    Examples
    --------
    >>> case = {"mu0": [0.3], "Fz": [10], "k": ["rigid"], "y0 [um]": [2.0]}
    >>> case |= {"f": [20e3], "v0": [-1.0]}
    >>> answered, rejects = answer(pa.RecordBatch.from_pydict(case))
    >>> rejects.to_pylist()
    [{'row': 0, 'field': 'v0', 'value': '-1.0', 'reason': 'must be finite and >= 0'}]
    """
    kind = kind_of(contact, direction)
    headings, names = find_columns(batch.schema.names, rigid, include, kind)
    added, rejects, _ = answer_columns(batch, surrogate or Surrogate.open(), headings, names, kind)
    schema = pa.schema([*batch.schema, *added_fields(names)], batch.schema.metadata)
    answered = pa.RecordBatch.from_arrays([*batch.columns, *added], schema=schema)
    return answered, pa.RecordBatch.from_pylist(
        [dict(zip(REJECTS.names, row, strict=True)) for row in rejects], REJECTS
    )


def find_columns(
    names: Sequence[str],
    rigid: bool = False,
    include: Sequence[str] = (),
    kind: Kind = SPRING,
    where: str = "",
) -> tuple[dict[str, tuple[str, Scale]], list[str]]:
    """By input, in their order, the heading and the scale of its unit; and the names of the
    columns that are added.

    FilesError names, after ``where``, all columns that stand twice in the heading, would be written
    twice, have an unknown unit, or are missing; for a missing one it lists the columns of the file,
    or names a similar one.

    >>> find_columns(["mu0", "Fz [kN]", "k", "y0", "f", "v0", "note"])[0]["Fz"]
    ('Fz [kN]', Scale(times=1000.0, over=1.0))
    """
    heads, faults = find_heads(
        names, {name: LIKE.get(name, name) for name in (*kind.columns, *ENDS)}
    )
    other_names = dict.fromkeys(name for name in names if split_unit(name)[0] not in heads)
    counts = Counter(names)
    faults += [f"the column {name!r} is there twice" for name in other_names if counts[name] > 1]
    stiffness_columns = [column for column in names if meant_by(column, loosely=False) == "k"]
    if rigid and stiffness_columns:
        faults.append(
            f"--rigid is given, but the column {stiffness_columns[0]!r} looks like a stiffness; "
            "leave one out"
        )
    if "k" in heads and (end := [name for name in ENDS if name in heads]):
        faults.append(f"there are both k and {end[0]}; leave one out")
    ends = ENDS if heads.keys() & {*ENDS} else () if rigid else ("k",)
    required = [name for field in kind.fields for name in (ends if field == "k" else (field,))]
    faults += _absent(
        [name for name in required if name not in heads and (name != "omega" or "f" not in heads)],
        names,
    )
    slopes = [f"d_mu_macro_d_{name}" for name in kind.fields] if "gradient" in include else []
    added = [ANSWERS[0], *(BAND if ends == ENDS else ()), *ANSWERS[1:], *slopes]
    faults += [
        f"the column {name!r} would be written twice; rename it" for name in added if name in names
    ]
    if faults:
        raise FilesError(where + "; ".join(faults))
    return {
        name: (names[heads[name][0]], heads[name][1]) for name in (*required, "f") if name in heads
    }, added


def wanted_columns(rigid: bool = False) -> Wanted:
    """The columns that a table of cases may have, and those that it needs."""
    names = [*SI, *LIKE]
    like = {name: LIKE.get(name, name) for name in names}
    like |= {f"std_{name}": unit for name, unit in like.items()}
    stiffness = [] if rigid else [("k", ENDS[0])]
    groups = [("mu0",), ("Fz",), *stiffness, ("y0", AMPLITUDE), ("omega", "f"), ("v0",)]
    return Wanted(like, groups)


def _absent(inputs: Sequence[str], names: Sequence[str]) -> Iterator[str]:
    """The faults of columns that are missing."""
    if "y0" in inputs and AMPLITUDE in (split_unit(column)[0] for column in names):
        yield f"there is no column y0, but {AMPLITUDE}: give --direction normal"
        inputs = [name for name in inputs if name != "y0"]
    if inputs:
        one = len(inputs) == 1
        yield absent(inputs[0], names) if one else absent_together(inputs, names)
    if "k" in inputs and not any(meant_by(column, loosely=False) == "k" for column in names):
        yield "rename the one that holds k, or give --rigid if all contacts are rigid"


def answer_columns(
    batch: pa.RecordBatch,
    surrogate: Surrogate,
    headings: Mapping[str, tuple[str, Scale]],
    names: Sequence[str],
    kind: Kind,
    signs: Signs | None = None,
) -> tuple[list[pa.Array], list[tuple[int, str, str | None, str]], dict[str, Array]]:
    """The columns ``names`` that :func:`answer` adds, rows of the rejects, and the inputs in the
    file's units by heading; ``signs`` are those of numbers as text."""
    columns_in: dict[str, Array] = {}
    values: dict[str, Array] = (
        {} if {"k", *ENDS} & headings.keys() else {"k": np.full(len(batch), math.inf)}
    )
    faults: dict[str, dict[int, str]] = {}
    for name, (heading, scale) in headings.items():
        columns_in[heading], values[name], faults[name] = numbers(
            batch.column(heading), name, signs or Signs(".", None), scale
        )
    cases = Cases.of(values, kind)
    result = surrogate.answer(cases, (GRADIENT,) if "d_mu_macro_d_mu0" in names else ())
    rejected = result.source_code < 0
    mask = rejected if rejected.any() else None
    source_code = np.where(rejected, 0, result.source_code).astype(np.int8)
    arrays = {
        "regime": _dictionary(REGIME_OF_SOURCE[source_code], REGIMES, mask),
        "source": _dictionary(source_code, SOURCES, mask),
    }
    for name, slope in (result.gradient or {}).items():
        # the slope along k is 0 for a rigid contact, which has no k
        column = (
            slope
            if name != "k" or name not in values
            else np.where(np.isinf(values["k"]), math.nan, slope)
        )
        arrays[f"d_mu_macro_d_{name}"] = pa.array(column, mask=np.isnan(column))
    columns = [
        arrays[name] if name in arrays else pa.array(getattr(result, name), mask=mask)
        for name in names
    ]
    rejects = []
    for i in np.flatnonzero(rejected).tolist():
        name, reason = _field_and_reason(cases.reason(i))
        cell = batch.column(headings[name][0])[i].as_py()
        rejects.append((i, name, None if cell is None else str(cell), faults[name].get(i, reason)))
    return columns, rejects, columns_in


def _dictionary(codes: Codes, words: Sequence[str], mask: Bools | None) -> pa.Array:
    return pa.DictionaryArray.from_arrays(
        pa.array(codes, pa.int8(), mask=mask), pa.array(words, pa.string())
    )


def numbers(
    array: pa.Array, name: str, signs: Signs, scale: Scale
) -> tuple[Array, Array, dict[int, str]]:
    """A column of the input ``name`` as doubles (n,) in its own unit and in SI, NaN where a cell
    has no number, and what is wrong with it.

    FilesError where the column is of another type than numbers or text.
    """
    if pa.types.is_dictionary(array.type):
        array = array.dictionary_decode()
    arrow_type = array.type
    if (
        pa.types.is_string(arrow_type)
        or pa.types.is_large_string(arrow_type)
        or pa.types.is_string_view(arrow_type)
    ):
        return numbers_of(pc.cast(array, pa.string()), name, signs, scale)
    is_number = (
        pa.types.is_integer(arrow_type)
        or pa.types.is_floating(arrow_type)
        or pa.types.is_decimal(arrow_type)
    )
    if not (is_number or pa.types.is_null(arrow_type)):
        raise FilesError(f"the column {name} holds {arrow_type}, not numbers")
    column = pc.fill_null(pc.cast(array, pa.float64(), safe=False), math.nan)
    values: Array = column.to_numpy(zero_copy_only=False)
    # a power of ten below one divides, so that 2 um is the double 2e-6
    with np.errstate(over="ignore"):
        si: Array = values if scale == Scale() else values * scale.times / scale.over
    beyond = np.isinf(si) & np.isfinite(values)  # a large stiffness is not a rigid contact
    si = np.where(beyond, math.nan, si) if beyond.any() else si
    return values, si, dict.fromkeys(np.flatnonzero(beyond).tolist(), TOO_LARGE)


def _field_and_reason(error: InputError) -> tuple[str, str]:
    """The input of a row that has no result, and why."""
    name, value = error.field, error.value
    if isinstance(value, tuple):  # of an interval the end that is missing, or the lower one
        end = int(math.isnan(value[1]) and not math.isnan(value[0]))
        name, value = ENDS[end], value[end]
    number = float(value)  # type: ignore[arg-type]  # a number of the row
    if math.isnan(number):
        return name, GAP if name == "k" else "is missing"
    return name, refusal(name, number) if name in SI else f"must be {error.bound}"

"""Evaluate one Arrow record batch of cases: return the same batch with results, and a list of
rejected rows.

A column whose name resembles a missing input is refused.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from mumacro.errors import InputError, MumacroError
from mumacro.inputs.carried import units_of_fields
from mumacro.inputs.cases import ALL_FIELDS, DEVIATIONS, KIND, Cases, other_amplitude
from mumacro.inputs.cells import Signs, numbers_of
from mumacro.inputs.fields import (
    AMPLITUDE,
    ENDS,
    GAP,
    MEASURED_AS,
    SI,
    SPRING,
    Kind,
    kind_of,
    refusal,
)
from mumacro.inputs.names import ColumnNames, absent, find_heads, meant_by, split_unit
from mumacro.inputs.units import Scale, Unit, checked_in_si, scale_of
from mumacro.kernel.arrays import Array
from mumacro.outputs.answer import BAND, DEFAULT
from mumacro.outputs.entry import Output
from mumacro.outputs.evaluation import names_in, outputs_for, paths_of
from mumacro.results import Note
from mumacro.surrogate import Surrogate
from mumacro.table.atlas import REGIME_OF_SOURCE, REGIMES, SOURCES

#: columns that a table of cases may have, and the input whose units each has
_INPUT_OF = {name: MEASURED_AS.get(name, name) for name in (*ALL_FIELDS, "f", *ENDS)}
_INPUT_OF |= {column: MEASURED_AS.get(name, name) for column, name in DEVIATIONS.items()}
#: columns that are always added
ANSWERS = DEFAULT
#: for a row without a result: its index, the input (null if the fault is the row), the value, the
#: reason
REJECTS = pa.schema(
    [("row", pa.int64()), ("field", pa.string()), ("value", pa.string()), ("reason", pa.string())]
)


class FilesError(MumacroError):
    """Report a file of cases that cannot be read, understood or written, in one line with its name,
    the reason and the remedy."""


def answer_fields(names: Sequence[str] = ANSWERS) -> list[pa.Field]:
    """Return the Arrow fields of the columns that :func:`answer` adds."""
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
        ``v0`` [m/s]; the header may have another unit in brackets; numbers or text.  An infinite k,
        or the word ``rigid``, is a rigid contact.  A null, a NaN or an empty cell is missing, also
        in k.  ``k_low`` and ``k_high`` may replace k; ``Fz_amplitude`` [N] replaces y0 in direction
        normal.  ``contact`` and ``direction`` hold one value each, ``std_k`` and so on standard
        deviations.  Other columns are copied unchanged.
    surrogate : Surrogate, optional
        The tightest table that comes with the library by default.
    rigid : bool
        Whether all contacts are rigid and there is no column k.
    include : sequence of str
        More outputs, as in :meth:`mumacro.Surrogate.evaluate`; their columns have the paths as
        names: ``power.saved``.
    contact, direction : str
        Contact and direction of all cases, as in :meth:`mumacro.Surrogate.evaluate`, if there is no
        column of them.

    Returns
    -------
    batch : pyarrow.RecordBatch
        The same rows in the same order, with mu_macro (for an interval of k also mu_macro_low and
        mu_macro_high), mu_ratio, regime, error_bound and source; null if a case has no result.
    rejects : pyarrow.RecordBatch
        One row of ``REJECTS`` for each case without a result.

    Raises
    ------
    FilesError
        If a column is missing, has a wrong name or no numbers.

    Examples
    --------
    >>> case = {"mu0": [0.3], "Fz": [10], "k": ["rigid"], "y0 [um]": [2.0]}
    >>> case |= {"f": [20e3], "v0": [-1.0]}
    >>> answered, rejects = answer(pa.RecordBatch.from_pydict(case))
    >>> rejects.to_pylist()
    [{'row': 0, 'field': 'v0', 'value': '-1.0', 'reason': 'must be finite and >= 0'}]
    """
    kind = kind_of_batch(batch, kind_of(contact, direction))
    units = units_of_fields(batch.schema)
    columns = find_columns(batch.schema.names, rigid, include, kind, units=units)
    result = answer_columns(batch, surrogate or Surrogate.open(), columns, Signs())
    schema = pa.schema([*batch.schema, *answer_fields(columns.answer_names)], batch.schema.metadata)
    answers = pa.RecordBatch.from_arrays([*batch.columns, *result.columns], schema=schema)
    cells = [batch.column(columns.headings[name][0])[i].as_py() for i, name, _ in result.rejects]
    rejects = [
        {"row": i, "field": name, "value": None if cell is None else str(cell), "reason": reason}
        for cell, (i, name, reason) in zip(cells, result.rejects, strict=True)
    ]
    return answers, pa.RecordBatch.from_pylist(rejects, REJECTS)


class Columns(NamedTuple):
    """Tell the meaning of the columns of a table of cases, and which answers are added."""

    #: by input, or ``std_k`` and so on: the header, and its unit
    headings: dict[str, tuple[str, Unit]]
    words: list[str]  #: the columns of contact and direction, if the table has them
    kind: Kind
    outputs: tuple[Output, ...]
    answer_names: list[str]  #: names of the columns with answers


class AnswerColumns(NamedTuple):
    """Hold the result of :func:`answer_columns`."""

    columns: list[pa.Array]
    rejects: list[tuple[int, str, str]]  #: index, input and reason of each row without a result
    inputs: dict[str, Array]  #: the inputs in the units of the table, by header
    notes: list[Note]


def find_columns(
    names: Sequence[str],
    rigid: bool = False,
    include: Sequence[str] = (),
    kind: Kind = SPRING,
    where: str = "",
    units: Mapping[str, str] | None = None,
) -> Columns:
    """Return the meaning of the columns of these names, and the names of the columns with answers.
    ``units`` are the units in the metadata of fields, by column.

    Raise FilesError for all columns that occur twice in the header, would be written twice, have an
    unknown unit, or are missing; the message begins with ``where``.  For a missing one it lists the
    columns of the file, or names a similar one.

    >>> find_columns(["mu0", "Fz [kN]", "k", "y0", "f", "v0", "note"]).headings["Fz"]
    ('Fz [kN]', Unit(symbol='kN', scale=Scale(times=1000.0, over=1.0)))
    """
    units = units or {}
    with_units = [
        f"{name} [{units[name]}]" if units.get(name) and split_unit(name)[1] is None else name
        for name in names
    ]
    heads, faults = find_heads(with_units, _INPUT_OF)
    for name, (i, unit) in heads.items():
        of_field = units.get(names[i])
        if of_field and scale_of(_INPUT_OF[name], of_field) not in (unit.scale, None):
            faults.append(f"the column {names[i]!r} has another unit in its field: {of_field}")
    words = [name for name in KIND if name in names]
    faults += [
        f"the column {name!r} is there twice; rename one"
        for name, count in Counter(names).items()
        if count > 1 and split_unit(name)[0] not in heads
    ]
    if rigid and (stiffness := [name for name in names if meant_by(name, loosely=False) == "k"]):
        faults.append(
            f"--rigid is given, but the column {stiffness[0]!r} looks like a stiffness; leave one "
            "out"
        )
    if "k" in heads and (end := [name for name in ENDS if name in heads]):
        faults.append(f"there are both k and {end[0]}; leave one out")
    ends = ENDS if heads.keys() & {*ENDS} else () if rigid else ("k",)
    fields = kind.fields
    necessary = [name for field in fields for name in (ends if field == "k" else (field,))]
    if missing := [
        name for name in necessary if name not in heads and (name != "omega" or "f" not in heads)
    ]:
        faults += _absent(missing, names)
    deviations = [column for column in DEVIATIONS if column in heads]
    if deviations and ends == ENDS:
        faults.append(f"there are both {deviations[0]} and an interval of k; leave one out")
    outputs = outputs_for(frozenset(names_in(include)), kind, bool(deviations))
    band = BAND if ends == ENDS else ()
    answer_names = [DEFAULT[0], *band, *DEFAULT[1:], *paths_of(outputs, fields)]
    faults += [
        f"the column {name!r} would be written twice; rename it"
        for name in answer_names
        if name in names
    ]
    if faults:
        raise FilesError(where + "; ".join(faults))
    found = [name for name in _INPUT_OF if name in heads]
    headings = {name: (names[heads[name][0]], heads[name][1]) for name in found}
    return Columns(headings, words, kind, outputs, answer_names)


def kind_of_batch(batch: pa.RecordBatch, kind: Kind, where: str = "") -> Kind:
    """Return the contact and the direction of a batch: those of its columns, otherwise ``kind``.

    Raise FilesError for a column with several values or an unknown one, or if an option says the
    same; the message begins with ``where``.
    """
    words = dict(kind.names)
    for name in KIND:
        if name not in batch.schema.names:
            continue
        if words[name] != SPRING.names[name]:
            raise FilesError(
                f"{where}--{name} {words[name]} is given, but there is a column {name}; "
                "leave one out"
            )
        cells = pc.unique(batch.column(name)).to_pylist()
        found = sorted({cell.strip() if isinstance(cell, str) else "" for cell in cells})
        if len(found) > 1:
            several = " and ".join(word or "an empty cell" for word in found[:2])
            raise FilesError(
                f"{where}the column {name} holds {several}: it is one for a file; write a file "
                "for each"
            )
        words[name] = found[0] if found else words[name]
    try:
        return kind_of(**words)
    except InputError as error:
        raise FilesError(f"{where}{error}") from None


def names_of_columns(rigid: bool = False) -> ColumnNames:
    """Return the columns that a table of cases may have, and the ones that it needs."""
    stiffness = [] if rigid else [("k", ENDS[0])]
    groups = [("mu0",), ("Fz",), *stiffness, ("y0", AMPLITUDE), ("omega", "f"), ("v0",)]
    return ColumnNames(_INPUT_OF, groups)


def _absent(inputs: Sequence[str], names: Sequence[str]) -> Iterator[str]:
    """Yield the faults of missing columns as parts of one sentence.  The last part, about k,
    continues what is said about the columns before it."""
    if "y0" in inputs and AMPLITUDE in (split_unit(column)[0] for column in names):
        yield f"there is no column y0, but {AMPLITUDE}: give --direction normal"
        inputs = [name for name in inputs if name != "y0"]
    if inputs:
        yield absent(inputs, names)
    if "k" in inputs and not any(meant_by(column, loosely=False) == "k" for column in names):
        yield "rename the one that holds k, or give --rigid if all contacts are rigid"


def answer_columns(
    batch: pa.RecordBatch, surrogate: Surrogate, columns: Columns, signs: Signs
) -> AnswerColumns:
    """Return the answers to a batch; ``signs`` are the separators in numbers as text.

    Raise FilesError if it has another contact or direction than the batches before it.
    """
    if columns.words and (kind := kind_of_batch(batch, SPRING)) != columns.kind:
        kinds = " and ".join(", ".join(one.names.values()) for one in (columns.kind, kind))
        raise FilesError(f"the file holds {kinds}: it is one for a file; write a file for each")
    headings, kind = columns.headings, columns.kind
    values: dict[str, Any] = {} if {"k", *ENDS} & headings.keys() else {"k": math.inf}
    inputs, faults = dict[str, Array](), dict[str, dict[int, str]]()
    for name, (head, unit) in headings.items():
        inputs[head], faults[name] = _numbers(batch.column(head), name, signs, unit.scale)
    for name, (head, unit) in headings.items():
        values[name], too_large = checked_in_si(inputs[head], unit.scale)
        faults[name] |= too_large
    if (other := kind.other_amplitude) in headings:
        if faults[other] or not np.isnan(values[other]).all():
            error = other_amplitude(other, None, kind)
            raise FilesError(f"the column {headings[other][0]!r} must be {error.bound}")
        del values[other]
    cases = Cases.of(values, kind)
    result = surrogate.answer(cases, columns.outputs)
    is_rejected = result.source_code < 0
    mask = is_rejected if is_rejected.any() else None
    source_code = np.where(is_rejected, 0, result.source_code).astype(np.int8)
    words = {
        "regime": (REGIME_OF_SOURCE[source_code], REGIMES),
        "source": (source_code, SOURCES),
    }
    arrays = []
    for path in columns.answer_names:
        if path in words:
            codes, of_codes = words[path]
            codes = pa.array(codes, pa.int8(), mask=mask)
            column = pa.DictionaryArray.from_arrays(codes, pa.array(of_codes, pa.string()))
        else:
            numbers = result[path]
            # an output that does not exist is null
            absent = np.isnan(numbers) if path in result.outputs else mask
            column = pa.array(numbers, mask=absent)
        arrays.append(column)
    rejects = []
    for i in np.flatnonzero(is_rejected).tolist():
        name, reason = _field_and_reason(cases.reason(i))
        rejects.append((i, name, faults.get(name, {}).get(i, reason)))
    in_heads = {name: unit.symbol for name, (_, unit) in headings.items() if unit.symbol}
    return AnswerColumns(arrays, rejects, inputs, result.notes_in(in_heads))


def _numbers(
    array: pa.Array, name: str, signs: Signs, scale: Scale
) -> tuple[Array, dict[int, str]]:
    """Return the doubles (n,) in a column of the input ``name``, in its own unit (NaN where a cell
    has no number), and the faults of cells by row.

    Raise FilesError if the column's type is neither a number nor text.
    """
    if pa.types.is_dictionary(array.type):
        array = array.dictionary_decode()
    kind = array.type
    if pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_string_view(kind):
        return numbers_of(pc.cast(array, pa.string()).to_pylist(), _INPUT_OF[name], signs, scale)
    if not (
        pa.types.is_integer(kind)
        or pa.types.is_floating(kind)
        or pa.types.is_decimal(kind)
        or pa.types.is_null(kind)
    ):
        raise FilesError(f"the column {name} holds {kind}, not numbers")
    column = pc.fill_null(pc.cast(array, pa.float64(), safe=False), math.nan)
    return column.to_numpy(zero_copy_only=False), {}


def _field_and_reason(error: InputError) -> tuple[str, str]:
    """Return the input that is at fault in a row without a result, and the reason."""
    name, value = error.field, error.value
    number = float(value)  # type: ignore[arg-type]  # a number of the row
    if math.isnan(number):
        return name, GAP if name == "k" else "is missing"
    return name, refusal(name, number) if name in SI else f"must be {error.bound}"

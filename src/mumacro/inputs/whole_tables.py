"""Read a whole table of numbers, such as measured points, in memory."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from mumacro.errors import TextError
from mumacro.inputs.cells import numbers_of
from mumacro.inputs.layout import Dialect
from mumacro.inputs.names import ColumnNames, absent, find_heads
from mumacro.inputs.text_tables import Most, TextTable, find_table, names_statistics
from mumacro.inputs.units import checked_in_si
from mumacro.kernel.arrays import Array


class TableOfNumbers(NamedTuple):
    """Hold the columns of numbers that were read."""

    columns: dict[str, Array]  #: by name, in SI, (n,)
    as_written: dict[str, Array]  #: the same in the units of the table
    units: dict[str, str]  #: unit of each column in the table; the SI unit if it has none
    lines: list[int]  #: line of each row
    skipped: list[int]  #: lines that are not empty, not the header, not units and not rows
    read_as: str  #: how the table was read, see :attr:`TextTable.read_as`


def read_numbers(
    source: Path | bytes,
    column_names: ColumnNames,
    dialect: Dialect,
    most: Most = Most(),  # noqa: B008
) -> TableOfNumbers:
    """Return the columns of a table that have a meaning, in SI, from a file or its bytes.

    TextError tells everything that is wrong: its ``faults`` are one for each line.

    >>> data = "Rig 7\\n\\nv0\\tmu_macro\\nmm/s\\t%\\n1,5\\t7\\n2,5\\t9\\n".encode()
    >>> names = ColumnNames({"v0": "v0", "mu_macro": "mu0"}, [["v0"]])
    >>> table = read_numbers(data, names, Dialect())
    >>> table.columns["mu_macro"].tolist(), table.skipped
    ([0.07, 0.09], [1])
    >>> table.read_as
    'tab, decimal comma, header in line 3, units in line 4; v0 [mm/s], mu_macro [%]'
    """
    table = find_table(source, column_names, dialect, most)
    units, input_of = table.units, column_names.input_of
    columns, faults = find_heads(units.heads, input_of)
    missing = [
        group[0] for group in column_names.required_groups if not columns.keys() & set(group)
    ]
    if missing:
        faults.append(absent(missing, units.heads))
    if faults:
        raise TextError.of([f"line {table.header.start + 1}: {fault}" for fault in faults])
    lines, rows, wrong = list[int](), list[list[str]](), list[tuple[int, str]]()
    skipped = {**table.skipped}
    for part in table.rows():
        skipped |= part.skipped
        if len(lines) + len(part.lines) > most.rows:
            where = f"line {part.lines[most.rows - len(lines)]}"
            raise TextError(f"{where}: there are more than {most.rows:,} rows: average them")
        for i, (line, cells) in enumerate(zip(part.lines, part.cells(), strict=True)):
            if i in part.faults:
                wrong.append((line, f"line {line} {part.faults[i][1]}"))
            else:
                lines.append(line)
                rows.append(cells)
    if not rows and not wrong:
        raise TextError(f"line {table.header.start + 1}: no row follows the names of the columns")
    _refuse_named_statistics(table, lines, rows)
    si, as_written = dict[str, Array](), dict[str, Array]()
    for name, (i, unit) in columns.items():
        texts = [cells[i] for cells in rows]
        as_written[name], bad = numbers_of(texts, input_of[name], table.signs, unit.scale)
        si[name], too_large = checked_in_si(as_written[name], unit.scale)
        bad |= too_large
        for j in np.flatnonzero(np.isnan(si[name])).tolist():
            fault = f"{bad[j]}, got {texts[j].strip()[:80]!r}" if j in bad else "is missing"
            wrong.append((lines[j], f"line {lines[j]}: {name} {fault}"))
    if wrong:
        raise _wrong_rows(sorted(wrong, key=lambda one: one[0]), lines, dialect)
    read_as = table.read_as(skipped)
    return TableOfNumbers(si, as_written, units.of_inputs(), lines, [*skipped], read_as)


def _refuse_named_statistics(table: TextTable, lines: list[int], rows: list[list[str]]) -> None:
    """Refuse rows of statistics whose name is in a column that is empty before them."""
    for i in set(range(table.width)) - table.units.inputs.keys():
        named = [j for j, cells in enumerate(rows) if cells[i].strip()]
        if named and named[0] > 0 and all(names_statistics(rows[j][i].strip()) for j in named):
            line, name = lines[named[0]], rows[named[0]][i].strip()
            what = f"{name!r} names a row of statistics"
            raise TextError(f"line {line}: {what}: {table.remedy(line)}")


def _wrong_rows(wrong: list[tuple[int, str]], lines: list[int], dialect: Dialect) -> TextError:
    """Return the error for wrong rows, with the option that leaves them out if they are before or
    after all other rows."""
    error = TextError.of([fault for _, fault in wrong])
    wrong_lines = {line for line, _ in wrong}
    right = [line for line in lines if line not in wrong_lines]
    if not right or not dialect.dashes or any(right[0] < x < right[-1] for x in wrong_lines):
        return error
    remedy = f"{dialect.dashes}rows {right[0]}..{right[-1]} leaves them out"
    with_remedy = TextError(f"{error}; {remedy}")
    with_remedy.faults = error.faults
    return with_remedy

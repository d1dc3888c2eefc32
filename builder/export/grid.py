"""Export a table in the formats of other tools: C sources, FMU; its plain grid as CSV.

The plain grid at the root of the file is exported: ``mu_ratio``, ``stick_fraction`` and
``error_estimate`` over (``v_tilde``, ``y_tilde``), and ``v_tilde_crit`` over ``y_tilde``; all are
dimensionless.  It is for tools with their own interpolation.  Its nodes are solved; between them
such tools have the errors that the table states for its plain grid.  Only
:class:`mumacro.Surrogate` keeps the tolerance of the table.

Every file is written under a temporary name and then renamed, and the same table gives the same
bytes.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from mumacro.kernel.arrays import Array
from mumacro.table.atomic import write_whole
from mumacro.table.blocks import INTERPOLATION_ERRORS, Table
from mumacro.table.netcdf import read_table

from .c import ExportError, write_c
from .fmu.model import fmu2, fmu3

PLANE = ("mu_ratio", "stick_fraction", "error_estimate")


def long_columns(table: Table) -> dict[str, Array]:
    """Return the grid with one row for each node, ``y_tilde`` running fastest; columns (m n,)
    [-]."""
    v, y, crit = np.broadcast_arrays(table.v_tilde[:, None], table.y_tilde, table.v_tilde_crit)
    plane = {name: np.asarray(getattr(table, name)) for name in PLANE}
    columns = {"v_tilde": v, "y_tilde": y, **plane, "v_tilde_crit": crit}
    return {name: column.ravel() for name, column in columns.items()}


def grid_errors(table: Table) -> dict[str, float]:
    """Return the errors of tools that interpolate the grid, with the names of the table."""
    return {name: float(table.attributes[name]) for name in INTERPOLATION_ERRORS}


def _csv(table: Table) -> bytes:
    """Return CSV (RFC 4180): a header, one row for each node, numbers with all their digits."""
    columns = long_columns(table)
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return "".join(",".join(map(str, row)) + "\r\n" for row in (columns, *rows)).encode("ascii")


#: format -> (name of the file after the table's, its content; only C may be a folder of files)
FORMATS: dict[str, tuple[str, Callable[[Table], bytes] | None]] = {
    "c": ("mumacro.h", None),
    "csv": ("{}.csv", _csv),
    "fmu": ("mumacro.fmu", fmu2),
    "fmu3": ("mumacro-fmi3.fmu", fmu3),
}


def check_format(name: str) -> None:
    """Raise ExportError with the list of formats if ``name`` is not one of them."""
    if name not in FORMATS:
        raise ExportError(f"format must be one of {', '.join(FORMATS)}, got {name!r}")


def export_table(path: str | Path, name: str, out: str | Path) -> Table:
    """Write the table at ``path`` to ``out`` in the format ``name``, one of :data:`FORMATS`.

    Raises
    ------
    ExportError
        If the format is unknown, a compiler fails, or ``out`` is the table itself or not a place
        for C sources.
    TableError
        If the table cannot be read.
    OSError
        If ``out`` cannot be written; an older file of that name is unchanged.
    """
    check_format(name)
    path, out = Path(path), Path(out)
    if path.resolve() == out.resolve():
        raise ExportError(f"{out} is the table itself")
    table, content_of = read_table(path), FORMATS[name][1]
    if content_of is None:
        write_c(table, out)
    else:
        write_whole(out, content_of(table))
    return table

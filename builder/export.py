"""A table in the formats of other tools: C sources, FMU, WebAssembly; its plain grid as CSV, MAT, Modelica, Parquet.

The plain grid at the root of the file is exported: ``mu_ratio``, ``stick_fraction`` and ``error_estimate`` over
(``v_tilde``, ``y_tilde``), and ``v_tilde_crit`` over ``y_tilde``; all dimensionless.  It is a grid for tools with
their own interpolation: its nodes are solved, the values between them depend on that tool.  The tolerance of
the table is kept by :class:`mumacro.Surrogate` alone.

Every file is written beside its name and then renamed, and the same table gives the same bytes.
"""

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat

from mumacro.arrays import Array
from mumacro.table import Table, json_attributes, read_table
from mumacro.writing import write_whole

from .c.fmu.model import fmu2, fmu3
from .c.source import ExportError, write_c
from .c.wasm import wasm

PLANE = ("mu_ratio", "stick_fraction", "error_estimate")
#: matrices of a Modelica file; those with log10 axes are the ones to interpolate
MODELICA_TABLES = (*PLANE, "mu_ratio_log10", "stick_fraction_log10", "v_tilde_crit")
_MAT_TEXT = 116  # bytes of free text at the start of a MAT file, where scipy would write the time of day


def long_columns(table: Table) -> dict[str, Array]:
    """The grid with a row a node, ``y_tilde`` running fastest; columns (m n,) [-]."""
    v, y, crit = np.broadcast_arrays(table.v_tilde[:, None], table.y_tilde, table.v_tilde_crit)
    plane = {name: np.asarray(getattr(table, name)) for name in PLANE}
    columns = {"v_tilde": v, "y_tilde": y, **plane, "v_tilde_crit": crit}
    return {name: column.ravel() for name, column in columns.items()}


def _attributes(table: Table) -> dict[str, Any]:
    """Those of the file; what has parts is JSON."""
    found = json_attributes(table)
    return {name: json.dumps(value) if isinstance(value, dict) else value for name, value in found.items()}


def _csv(table: Table) -> bytes:
    """RFC 4180, a header, a row a node; numbers with all their digits."""
    columns = long_columns(table)
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return "".join(",".join(map(str, row)) + "\r\n" for row in (columns, *rows)).encode("ascii")


def _mat(table: Table) -> bytes:
    """MAT version 5, for MATLAB and Octave: matrices (v_tilde, y_tilde), axes as columns, attributes in ``info``."""
    names = ("v_tilde", "y_tilde", *PLANE, "v_tilde_crit")
    content = {name: getattr(table, name) for name in names} | {"info": _attributes(table)}
    held: Any = io.BytesIO()  # it takes streams, too, though not all of its releases document it
    savemat(held, content, do_compression=True, oned_as="column")
    text = f"MATLAB 5.0 MAT-file, mumacro table of tolerance {table.attributes['tolerance']:g}"
    return text.encode("ascii").ljust(_MAT_TEXT) + bytes(held.getvalue()[_MAT_TEXT:])


def _modelica(table: Table) -> bytes:
    """Text tables of the Modelica Standard Library: CombiTable2Ds matrices u1 = v_tilde (rows), u2 = y_tilde (columns).

    ``v_tilde_crit`` is a CombiTable1Ds matrix: y_tilde, v_tilde_crit.
    """
    lines = [
        "#1",
        f"# mumacro {table.attributes['content_sha256']}, tolerance {table.attributes['tolerance']:g}",
        "# First column v_tilde, first row y_tilde; both as log10 in the matrices whose names say so.",
    ]
    for name in MODELICA_TABLES:
        v, y = table.v_tilde[:, None], table.y_tilde[None, :]
        plain = name.removesuffix("_log10")
        if name != plain:
            v, y = np.log10(v), np.log10(y)
        if name == "v_tilde_crit":
            matrix = np.column_stack((table.y_tilde, table.v_tilde_crit))
        else:
            matrix = np.block([[np.zeros((1, 1)), y], [v, getattr(table, plain)]])
        lines.append(f"double {name}({matrix.shape[0]},{matrix.shape[1]})")
        lines += [" ".join(map(repr, row)) for row in matrix.tolist()]
    return ("\n".join(lines) + "\n").encode("ascii")


def _parquet(table: Table) -> bytes:
    """Columns as in CSV, the table's attributes as metadata of the schema."""
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError as error:
        raise ExportError("Parquet needs the extra 'arrow' (pyarrow), which is not installed") from error
    metadata = {
        name: value if isinstance(value, str) else json.dumps(value) for name, value in _attributes(table).items()
    }
    out = io.BytesIO()
    parquet.write_table(pa.table(long_columns(table)).replace_schema_metadata(metadata), out, compression="zstd")
    return out.getvalue()


#: format -> (name of the file after the table's, its content; C alone may be a folder of files)
FORMATS: dict[str, tuple[str, Callable[[Table], bytes] | None]] = {
    "c": ("mumacro.h", None),
    "csv": ("{}.csv", _csv),
    "fmu": ("mumacro.fmu", fmu2),
    "fmu3": ("mumacro-fmi3.fmu", fmu3),
    "mat": ("{}.mat", _mat),
    "modelica": ("{}.txt", _modelica),
    "parquet": ("{}.parquet", _parquet),
    "wasm": ("mumacro.wasm", wasm),
}


def export_table(path: str | Path, kind: str, out: str | Path) -> Table:
    """Write the table at ``path`` to ``out`` in the format ``kind``, one of :data:`FORMATS`.

    Raises
    ------
    ExportError
        Unknown format, a package or a compiler missing, ``out`` is the table itself or no place for C sources.
    TableError
        The table cannot be read.
    OSError
        ``out`` cannot be written; what was there before is still there.
    """
    if kind not in FORMATS:
        raise ExportError(f"format must be one of {', '.join(FORMATS)}, got {kind!r}")
    path, out = Path(path), Path(out)
    if path.resolve() == out.resolve():
        raise ExportError(f"{out} is the table itself")
    table, content_of = read_table(path), FORMATS[kind][1]
    if content_of is None:
        write_c(table, out)
    else:
        write_whole(out, content_of(table))
    return table

"""A table in the formats of other tools: C sources; its plain grid as CSV, MAT, Modelica's text tables, Parquet.

The plain grid at the root of the file is exported: ``mu_ratio``, ``stick_fraction`` and ``error_estimate`` over
(``v_tilde``, ``y_tilde``), and ``v_tilde_crit`` over ``y_tilde``; all dimensionless.  It is a grid for tools with
their own interpolation: its nodes are solved, the values between them depend on that tool.  The tolerance of
the table is kept by :class:`mumacro.Surrogate` alone.

Every file is written beside its name and then renamed, and the same table gives the same bytes.
"""

from __future__ import annotations

import csv
import io
import json
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray
from scipy.io import savemat

from mumacro.errors import MumacroError
from mumacro.table import Table, json_attributes, read_table

from .c.fmu.model import write_fmu2, write_fmu3
from .c.source import write_c
from .c.wasm import write_wasm

__all__ = ["FORMATS", "MODELICA_TABLES", "ExportError", "export_table", "long_columns"]

Array = NDArray[np.float64]

PLANE = ("mu_ratio", "stick_fraction", "error_estimate")
#: matrices of a Modelica file; those with log10 axes are the ones to interpolate
MODELICA_TABLES = (*PLANE, "mu_ratio_log10", "stick_fraction_log10", "v_tilde_crit")
# bytes 0 to 115 of a MAT file are free text, where scipy would write the time of day
_MAT_TEXT = 116


class ExportError(MumacroError):
    """A table that cannot be exported; the text states why."""


def long_columns(table: Table) -> dict[str, Array]:
    """The grid with a row a node, ``y_tilde`` running fastest; columns (m n,) [-]."""
    v, y = np.meshgrid(table.v_tilde, table.y_tilde, indexing="ij")
    columns = {"v_tilde": v.ravel(), "y_tilde": y.ravel()}
    columns.update({name: np.asarray(getattr(table, name)).ravel() for name in PLANE})
    columns["v_tilde_crit"] = np.tile(table.v_tilde_crit, table.v_tilde.size)
    return columns


def _csv(table: Table, out: BinaryIO) -> None:
    """RFC 4180, a header, a row a node; numbers with all their digits."""
    columns = long_columns(table)
    text = io.TextIOWrapper(out, encoding="ascii", newline="", write_through=True)
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
    text.detach()


def _mat(table: Table, out: BinaryIO) -> None:
    """MAT version 5, for MATLAB and Octave: matrices (v_tilde, y_tilde), axes as columns, attributes in ``info``."""
    names = ("v_tilde", "y_tilde", *PLANE, "v_tilde_crit")
    content: dict[str, Any] = {name: getattr(table, name) for name in names}
    attributes = json_attributes(table)
    content["info"] = {
        name: json.dumps(value) if isinstance(value, dict) else value for name, value in attributes.items()
    }
    held: Any = io.BytesIO()  # it takes streams, too, though not all of its releases document it
    savemat(held, content, do_compression=True, oned_as="column")
    data = bytearray(held.getvalue())
    text = f"MATLAB 5.0 MAT-file, mumacro table of tolerance {table.attributes['tolerance']:g}"
    data[:_MAT_TEXT] = text.encode("ascii").ljust(_MAT_TEXT)
    out.write(data)


def _modelica(table: Table, out: BinaryIO) -> None:
    """Text tables of the Modelica Standard Library: CombiTable2Ds matrices u1 = v_tilde (rows), u2 = y_tilde (columns).

    ``v_tilde_crit`` is a CombiTable1Ds matrix: y_tilde, v_tilde_crit.
    """
    axes = {"": (table.v_tilde, table.y_tilde), "_log10": (np.log10(table.v_tilde), np.log10(table.y_tilde))}
    lines = [
        "#1",
        f"# mumacro {table.attributes['content_sha256']}, tolerance {table.attributes['tolerance']:g}",
        "# First column v_tilde, first row y_tilde; both as log10 in the matrices whose names say so.",
    ]
    for name in MODELICA_TABLES:
        if name == "v_tilde_crit":
            matrix = np.column_stack((table.y_tilde, table.v_tilde_crit))
        else:
            plain = name.removesuffix("_log10")
            v, y = axes[name.removeprefix(plain)]
            matrix = np.block([[np.zeros((1, 1)), y[None, :]], [v[:, None], getattr(table, plain)]])
        rows, columns = matrix.shape
        lines.append(f"double {name}({rows},{columns})")
        lines += [" ".join(map(repr, row)) for row in matrix.tolist()]
    out.write(("\n".join(lines) + "\n").encode("ascii"))


def _parquet(table: Table, out: BinaryIO) -> None:
    """The rows of the CSV; the attributes of the table in the schema's metadata."""
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError as error:
        raise ExportError("Parquet needs the extra 'arrow' (pyarrow), which is not installed") from error
    metadata = {
        name: value if isinstance(value, str) else json.dumps(value) for name, value in json_attributes(table).items()
    }
    arrow = pa.table(long_columns(table)).replace_schema_metadata(metadata)
    parquet.write_table(arrow, out, compression="zstd")


#: format -> (name of the file after the table's, writer to a stream; C alone may be a folder of files)
FORMATS: dict[str, tuple[str, Callable[[Table, BinaryIO], None] | None]] = {
    "c": ("mumacro.h", None),
    "csv": ("{}.csv", _csv),
    "fmu": ("mumacro.fmu", write_fmu2),
    "fmu3": ("mumacro-fmi3.fmu", write_fmu3),
    "mat": ("{}.mat", _mat),
    "modelica": ("{}.txt", _modelica),
    "parquet": ("{}.parquet", _parquet),
    "wasm": ("mumacro.wasm", write_wasm),
}


def export_table(path: str | Path, kind: str, out: str | Path) -> Table:
    """Write the table at ``path`` to ``out`` in the format ``kind``, one of :data:`FORMATS`.

    Raises
    ------
    ExportError
        Unknown format, a package missing, ``out`` is the table itself.
    OutputError
        ``out`` is no place for C sources.
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
    table, write = read_table(path), FORMATS[kind][1]
    if write is None:
        write_c(table, out)
        return table
    handle, name = tempfile.mkstemp(dir=out.parent, prefix=out.name, suffix=".partial")
    try:
        with os.fdopen(handle, "wb") as stream:
            write(table, stream)
            stream.flush()
            os.fsync(stream.fileno())
        os.chmod(name, 0o644)
        os.replace(name, out)
    finally:
        Path(name).unlink(missing_ok=True)
    return table

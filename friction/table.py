"""The table file: netCDF-4 with CF-1.11 conventions; written atomically, read with suspicion.

:mod:`friction.table_writer` lays it out; a reader needs the netCDF library only.

Layout (all quantities dimensionless, units "1"):

* root: the plain log-spaced grid a person plots first, ``mu_ratio(v_tilde, y_tilde)`` with ``stick_fraction``,
  ``error_estimate`` and ``v_tilde_crit(y_tilde)``, and the provenance as attributes;
* group ``border``: one sub-group a piece of v~crit (:data:`friction.regions.BORDER_PIECES`);
* group ``border/blocks``: one sub-group a block (:data:`friction.regions.BLOCKS`): node coordinates, node values, the
  coordinate map by name, the number of cells for evaluation, the verified error.
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
from numpy.typing import NDArray

from friction import regions
from friction.errors import TableError

__all__ = ["FORMAT_VERSION", "Block", "BorderPiece", "Table", "read_table", "write_table"]

FORMAT_VERSION = 2
Array = NDArray[np.float64]


@dataclass
class BorderPiece:
    """One piece of v~crit: Chebyshev ``nodes`` (n,) of its coordinate, ``values`` (n,), cells for evaluation."""

    nodes: Array
    values: Array
    cells: int
    max_rel_error: float = 0.0


@dataclass
class Block:
    """One block: Chebyshev nodes ``a`` (m,), ``b`` (n,), ``values`` (m, n), cells for evaluation, verified errors.

    ``quantity_error`` bounds the error of the tabulated quantity; ``max_abs_error`` and ``max_rel_error`` are those of
    mu~ over the block.  ``power`` (m, n) and, in stick-slip, ``stick`` (m, n) hold the scaled oscillation
    power and stick fraction of :mod:`friction.companions` at the same nodes; ``power_error`` and ``stick_error`` bound
    the errors of those two, and are None where nobody has measured them.
    """

    a: Array
    b: Array
    values: Array
    cells: tuple[int, int]
    quantity_error: float = 0.0
    max_abs_error: float = 0.0
    max_rel_error: float = 0.0
    power: Array = field(default_factory=lambda: np.empty(0))
    stick: Array = field(default_factory=lambda: np.empty(0))
    power_error: float | None = None
    stick_error: float | None = None


@dataclass
class Table:
    """Everything that a table file holds."""

    border: list[BorderPiece]
    blocks: list[Block]
    v_tilde: Array
    y_tilde: Array
    mu_ratio: Array
    stick_fraction: Array
    error_estimate: Array
    v_tilde_crit: Array
    attributes: dict[str, Any] = field(default_factory=dict)


def _digest(table: Table) -> str:
    """SHA-256 over every number that takes part in an answer, and over the names and the tolerance they belong to."""
    h = hashlib.sha256()
    h.update(f"mumacro {FORMAT_VERSION} {float(table.attributes['tolerance'])!r}".encode())
    for array in (
        table.v_tilde, table.y_tilde, table.mu_ratio, table.stick_fraction, table.error_estimate, table.v_tilde_crit,
    ):  # fmt: skip
        h.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    for (name, *_), piece in zip(regions.BORDER_PIECES, table.border, strict=True):
        h.update(f"{name} {piece.cells} {piece.max_rel_error!r}".encode())
        h.update(np.ascontiguousarray(piece.nodes, dtype="<f8").tobytes())
        h.update(np.ascontiguousarray(piece.values, dtype="<f8").tobytes())
    for name, block in zip(regions.NAMES, table.blocks, strict=True):
        errors = (block.quantity_error, block.max_abs_error, block.max_rel_error)
        h.update(f"{name} {tuple(block.cells)} {errors!r}".encode())
        for array in (block.a, block.b, block.values, block.power, block.stick):
            h.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return h.hexdigest()


def _bounds_digest(table: Table, content: str) -> str | None:
    """SHA-256 over the errors of power and stick fraction and the content that they belong to; None without them.

    A checksum of its own: the other one is the same for a table with and without them, and programs that do not know
    them read such a table.
    """
    errors = [(name, b.power_error, b.stick_error) for name, b in zip(regions.NAMES, table.blocks, strict=True)]
    if all(power is None for _, power, _ in errors):
        return None
    return hashlib.sha256(f"{content} {errors!r}".encode()).hexdigest()


def write_table(table: Table, path: str | Path) -> str:
    """Write ``table`` to ``path`` atomically (temporary file beside it, fsync, rename) and return its checksum.

    Raises
    ------
    TableError
        When the folder does not exist or cannot be written; nothing is left behind.
    """
    from friction.table_writer import file_image  # needs h5py, which reading does not

    path = Path(path)
    table.attributes["format_version"] = np.int32(FORMAT_VERSION)
    table.attributes["content_sha256"] = _digest(table)
    bounds = _bounds_digest(table, table.attributes["content_sha256"])
    table.attributes.pop("bounds_sha256", None)
    if bounds is not None:
        table.attributes["bounds_sha256"] = bounds
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=path.name, suffix=".partial")
    except OSError as error:
        raise TableError(path, f"cannot write here: {error.strerror or error}") from error
    try:
        with os.fdopen(handle, "wb") as written:
            written.write(file_image(table))
            written.flush()
            os.fsync(written.fileno())
        os.chmod(name, 0o644)
        os.replace(name, path)
    except OSError as error:
        raise TableError(path, f"cannot write: {error.strerror or error}") from error
    finally:
        Path(name).unlink(missing_ok=True)
    return str(table.attributes["content_sha256"])


def _group(parent: Any, name: str, path: Path) -> Any:
    if name not in parent.groups:
        raise TableError(path, f"group {name!r} is missing")
    return parent.groups[name]


def _array(group: Any, name: str, path: Path) -> Array:
    if name not in group.variables:
        raise TableError(path, f"variable {name!r} is missing in {group.path}")
    variable = group.variables[name]
    variable.set_auto_mask(False)
    values: Array = np.ascontiguousarray(variable[...], dtype=np.float64)
    if not np.all(np.isfinite(values)):
        raise TableError(path, f"variable {name!r} in {group.path} holds non-finite values")
    return values


def _read(root: Any, path: Path) -> Table:
    attributes = {key: root.getncattr(key) for key in root.ncattrs()}
    if "format_version" not in attributes or "content_sha256" not in attributes or "tolerance" not in attributes:
        raise TableError(path, "not a mumacro table: format_version, tolerance or content_sha256 is missing")
    version = attributes["format_version"]
    if int(version) != FORMAT_VERSION:
        raise TableError(path, f"format version {version}, this program reads {FORMAT_VERSION}")
    border_group = _group(root, "border", path)
    blocks_group = _group(border_group, "blocks", path)
    border, blocks = [], []
    for name, coordinate, _, _ in regions.BORDER_PIECES:
        group = _group(border_group, name, path)
        piece = BorderPiece(
            _array(group, coordinate, path), _array(group, "value", path), int(group.cells), float(group.max_rel_error)
        )
        if piece.values.shape != piece.nodes.shape or piece.cells < 1:
            raise TableError(path, f"{group.path}: shapes of nodes and values disagree")
        border.append(piece)
    for spec in regions.BLOCKS:
        group = _group(blocks_group, spec.name, path)
        block = Block(
            _array(group, spec.a_name, path),
            _array(group, spec.b_name, path),
            _array(group, "value", path),
            (int(group.cells[0]), int(group.cells[1])),
            float(group.quantity_error),
            float(group.verified_max_abs_error),
            float(group.verified_max_rel_error),
            _array(group, "power", path),
            _array(group, "stick", path) if spec.regime == regions.STICK_SLIP else np.empty(0),
            *(float(group.getncattr(n)) if n in group.ncattrs() else None for n in ("power_error", "stick_error")),
        )
        shapes = {block.values.shape, block.power.shape} | ({block.stick.shape} if block.stick.size else set())
        if shapes != {(block.a.size, block.b.size)} or min(block.cells) < 1:
            raise TableError(path, f"{group.path}: shapes of nodes and values disagree")
        blocks.append(block)
    names = ("v_tilde", "y_tilde", "mu_ratio", "stick_fraction", "error_estimate", "v_tilde_crit")
    plain = {name: _array(root, name, path) for name in names}
    return Table(border=border, blocks=blocks, attributes=attributes, **plain)


def read_table(path: str | Path) -> Table:
    """Read and check a table file.

    Raises
    ------
    TableError
        Missing, truncated or foreign file, another format version, a missing group or variable, non-finite values, a
        checksum that does not fit; the message names the file and the reason.
    """
    path = Path(path)
    if not path.is_file():
        raise TableError(path, "no such file")
    try:
        with netCDF4.Dataset(str(path), "r") as root:
            table = _read(root, path)
    except TableError:
        raise
    except (OSError, RuntimeError, ValueError, AttributeError, IndexError, TypeError, KeyError) as error:
        raise TableError(path, f"not a readable netCDF-4 table ({error})") from error
    if _digest(table) != table.attributes["content_sha256"]:
        raise TableError(path, "checksum does not match the content: the file is damaged or was edited")
    if _bounds_digest(table, table.attributes["content_sha256"]) != table.attributes.get("bounds_sha256"):
        raise TableError(path, "checksum does not match the bounds: the file is damaged or was edited")
    return table


def json_attributes(table: Table) -> dict[str, object]:
    """Root attributes as plain Python scalars and strings; ``builder_options`` parsed."""
    out: dict[str, object] = {}
    for key, value in table.attributes.items():
        out[key] = value.item() if isinstance(value, np.generic) else value
    if isinstance(out.get("builder_options"), str):
        out["builder_options"] = json.loads(str(out["builder_options"]))
    return out

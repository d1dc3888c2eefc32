"""Read and write the table file, format 2: netCDF-4 with CF-1.11 conventions; written atomically,
checked when read.

docs/table-format.md describes the layout: the plain grid at the root, the pieces of v~crit in
``border``, the blocks of each contact in a group with the contact's name.  The netCDF library
writes; it is not thread-safe, so a lock is held while it works.  For reading see
``mumacro.table.hdf5``.
"""

import hashlib
import json
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mumacro.errors import TableError
from mumacro.kernel.arrays import Array
from mumacro.table import atlas, hdf5
from mumacro.table.atomic import write_whole
from mumacro.table.blocks import (
    BY_NAME,
    INTERPOLATION_ERRORS,
    RATIOS,
    Block,
    BorderPiece,
    Table,
    TabulatedContact,
    quantity_names,
)
from mumacro.table.hdf5 import RefusedError
from mumacro.table.polynomials import nodes

FORMAT_VERSION = 2
# A larger file is refused before memory is used.  After each limit follows the figure of the
# largest table that the builder makes.
MOST_BYTES = 16 * 2**20  # bytes of a file: 425 kB
MOST_NUMBERS = 200_000  # numbers of a variable: 14,641
MOST_IN_ALL = 2_000_000  # numbers of a table: 171,000
MOST_NODES = 1024  # nodes along an axis: 91; preparing cells needs matrices of its square
MOST_CELLS = 1024  # cells along an axis: 156
MOST_PATCHES = 8192  # cells of a block: 1833; each needs 512 bytes for each quantity

_netcdf_lock = threading.Lock()

_PLAIN = {
    "v_tilde": ("dimensionless sliding speed, v0 k/(mu0 Fz omega)", ()),
    "y_tilde": ("dimensionless oscillation amplitude, y0 k/(mu0 Fz)", ()),
    "mu_ratio": (
        "macroscopic over Coulomb friction coefficient, mu_macro/mu0",
        ("v_tilde", "y_tilde"),
    ),
    "stick_fraction": (
        "share of the period during which the contact sticks",
        ("v_tilde", "y_tilde"),
    ),
    "error_estimate": ("estimated absolute error of mu_ratio", ("v_tilde", "y_tilde")),
    "v_tilde_crit": (
        "border of continuous sliding: smallest dimensionless speed without stick",
        ("y_tilde",),
    ),
}
#: attributes of ``mu_ratio`` apart from its name and unit
_OF_MU_RATIO = {
    "ancillary_variables": "error_estimate",
    "comment": "right at the nodes; interpolation between them errs as much as the attributes "
    "interpolation_error_* of the file say, mumacro itself answers from the blocks in /border",
}
#: attributes of every contact
_STATED = ("tolerance", "verified_max_abs_error", "verified_max_rel_error")
CELL_AXES = ("quantity", "cell", "derivative")
# a smaller number of values is stored unpacked, because a chunk's index takes 2 kB
LEAST_PACKED = 256


def _digest(table: Table) -> str:
    """Return the SHA-256 of every number that affects a value or its bound, of the geometry, and of
    the tolerance."""
    h = hashlib.sha256()

    def include(*parts: object) -> None:
        for part in parts:
            is_array = isinstance(part, np.ndarray)
            h.update(
                np.ascontiguousarray(part, dtype="<f8").tobytes()
                if is_array
                else repr(part).encode()
            )

    include("mumacro", FORMAT_VERSION)
    include(*(getattr(table, name) for name in _PLAIN))
    for geometry, piece in zip(atlas.BORDER_PIECES, table.border, strict=True):
        include(geometry, piece.cells, float(piece.max_rel_error), piece.nodes, piece.values)
    names = table.quantities
    for contact in table.contacts.values():
        include(contact.name, float(contact.attributes["tolerance"]))
        for chart, block in zip(contact.charts, contact.blocks, strict=True):
            largest = float(block.max_abs_error), float(block.max_rel_error)
            include(chart, tuple(block.cells), *largest)
            include(*(block.errors[name] for name in names), block.a, block.b)
            parts = block.nodes, block.cell_errors
            include(*(part[name] for part in parts for name in names if name in part))
    return h.hexdigest()


# --- writing --------------------------------------------------------------------------------------


def _add_variable(
    group: Any,
    name: str,
    data: Array,
    long_name: str,
    axes: tuple[str, ...] = (),
    **attributes: Any,
) -> None:
    """Add a float64 variable over ``axes``; without axes it is itself a coordinate."""
    if not axes:
        group.createDimension(name, data.size)
    filters = {"compression": "zlib", "complevel": 9, "shuffle": True, "chunksizes": data.shape}
    extra = filters if data.size > LEAST_PACKED else {"contiguous": True}
    variable = group.createVariable(name, "f8", axes or (name,), fill_value=False, **extra)
    variable.setncatts({"long_name": long_name, "units": "1", **attributes})
    variable[...] = data


def _write_cell_errors(group: Any, blocks: list[Block], names: Sequence[str]) -> None:
    """Write the errors in all cells, block after block, as one variable, because each variable and
    each dimension costs half a kilobyte."""

    def rows(block: Block, name: str) -> Array:
        return (
            block.cell_errors[name]
            if name in block.cell_errors
            else np.zeros((block.cells[0] * block.cells[1], 3))
        )

    errors = np.stack([np.concatenate([rows(block, name) for block in blocks]) for name in names])
    for axis, size in zip(CELL_AXES, errors.shape, strict=True):
        group.createDimension(axis, size)
    long_name = (
        "errors of what is tabulated, and of its derivatives along both coordinates, in "
        "all cells of all blocks"
    )
    _add_variable(group, "cell_errors", errors, long_name, CELL_AXES)


def _geometry(chart: atlas.Chart) -> dict[str, Any]:
    return {
        "regime": atlas.REGIMES[chart.regime],
        "quantity": chart.quantity,
        "range_of_a": np.array([chart.a.low, chart.a.high]),
        "range_of_b": np.array([chart.b.low, chart.b.high]),
    }


def _write(root: Any, table: Table) -> None:
    root.setncatts(table.attributes)
    for name, (long_name, axes) in _PLAIN.items():
        extra = _OF_MU_RATIO if name == "mu_ratio" else {}
        _add_variable(root, name, getattr(table, name), long_name, axes, **extra)
    border = root.createGroup("border")
    for (name, axis, meaning), piece in zip(atlas.BORDER_PIECES, table.border, strict=True):
        group = border.createGroup(name)
        _add_variable(group, axis.name, piece.nodes, atlas.COORDINATES[axis.name])
        _add_variable(group, "value", piece.values, meaning, (axis.name,))
        group.setncatts(
            {
                "cells": np.int32(piece.cells),
                "max_rel_error": piece.max_rel_error,
                "range": np.array([axis.low, axis.high]),
            }
        )
    # Contacts are inside the group of the border, because with a second group at the root the CF
    # checker looks for "time".
    for contact in table.contacts.values():
        _write_contact(border.createGroup(contact.name), table, contact)


def _write_contact(group: Any, table: Table, contact: TabulatedContact) -> None:
    """Write the blocks of a contact, the errors in every cell, and the statements about them."""
    group.setncatts(contact.attributes)
    _write_cell_errors(group, contact.blocks, table.quantities)
    for chart, block in zip(contact.charts, contact.blocks, strict=True):
        one = group.createGroup(chart.name)
        axes = (chart.a.name, chart.b.name)
        _add_variable(one, axes[0], block.a, atlas.COORDINATES[axes[0]])
        _add_variable(one, axes[1], block.b, atlas.COORDINATES[axes[1]])
        for quantity in table.quantities_of(chart):
            meaning = (
                chart.quantity
                if quantity.name == "mu_ratio"
                else f"{quantity.meaning}, scaled for this block"
            )
            _add_variable(one, quantity.variable, block.nodes[quantity.name], meaning, axes)
        # at most eight attributes: HDF5 keeps more of them in a separate structure of several
        # kilobytes per group
        one.setncatts(
            {
                **_geometry(chart),
                "cells": np.array(block.cells, dtype=np.int32),
                "errors": np.concatenate([block.errors[name] for name in table.quantities]),
                "verified_max_abs_error": block.max_abs_error,
                "verified_max_rel_error": block.max_rel_error,
            }
        )


def write_table(table: Table, path: str | Path) -> str:
    """Write ``table`` to ``path`` atomically (temporary file in the same folder, fsync, rename) and
    return its checksum.

    Raise TableError if the folder does not exist or cannot be written, or the disk is full; then
    nothing is left.
    """
    import tempfile  # only writing needs it: without the import a table is read sooner

    path = Path(path)
    table.attributes["format_version"] = np.int32(FORMAT_VERSION)
    table.attributes["content_sha256"] = _digest(table)
    try:
        image = _image(table)
    except (
        OSError,
        RuntimeError,
    ) as error:  # the netCDF library raises RuntimeError if it cannot write
        where = f"in the folder of temporary files, {tempfile.gettempdir()}"
        raise TableError(
            path, f"cannot be made {where}: {getattr(error, 'strerror', None) or error}"
        ) from error
    try:
        write_whole(path, image)
    except OSError as error:
        raise TableError(path, f"cannot be written: {error.strerror or error}") from error
    return str(table.attributes["content_sha256"])


def _image(table: Table) -> bytes:
    """Return the bytes of a file that holds ``table``.

    The file is temporary, because if the disk is full the netCDF library reports little and keeps
    the file open.  A file that this library makes in memory contains the time of day.
    """
    import tempfile  # only writing needs it: without the import a table is read sooner

    import netCDF4  # installed only to build tables

    with tempfile.TemporaryDirectory(prefix="mumacro-") as folder:
        path = Path(folder) / "table.nc"
        with _netcdf_lock, netCDF4.Dataset(str(path), "w", format="NETCDF4") as root:
            _write(root, table)
        return path.read_bytes()


# --- reading --------------------------------------------------------------------------------------


def _layout() -> hdf5.Part:
    """Return which parts of a file are read."""
    variables = tuple(quantity.variable for quantity in atlas.QUANTITIES)
    groups = {name: hdf5.Part((axis.name, "value")) for name, axis, _ in atlas.BORDER_PIECES}
    for name, charts in atlas.CHARTS.items():
        blocks = {
            chart.name: hdf5.Part((chart.a.name, chart.b.name, *variables)) for chart in charts
        }
        groups[name] = hdf5.Part(("cell_errors",), blocks)
    return hdf5.Part(tuple(_PLAIN), {"border": hdf5.Part(groups=groups)})


def _group(group: hdf5.Group, name: str) -> hdf5.Group:
    if name not in group.groups:
        raise RefusedError(f"group {name!r} is missing in {group.path}")
    return group.groups[name]


def _array(group: hdf5.Group, name: str, shape: tuple[int, ...] | None = None) -> Array:
    if name not in group.arrays:
        raise RefusedError(f"variable {name!r} is missing in {group.path}")
    values = group.arrays[name]
    if shape is not None and values.shape != shape:
        raise RefusedError(f"{group.path}: the shape of {name!r} is {values.shape}, not {shape}")
    return values


def _attribute(group: hdf5.Group, name: str) -> Any:
    if name not in group.attributes:
        raise RefusedError(f"attribute {name!r} of {group.path} is missing")
    return group.attributes[name]


def _numbers(group: hdf5.Group, name: str, count: int = 1) -> Array:
    """Return an attribute of ``count`` finite numbers."""
    values = np.atleast_1d(np.asarray(_attribute(group, name)))
    if values.dtype.kind not in "fi" or values.shape != (count,) or not np.all(np.isfinite(values)):
        raise RefusedError(f"attribute {name!r} of {group.path} is not {count} finite numbers")
    return values.astype(np.float64)


def _not_negative(group: hdf5.Group, name: str, errors: Array) -> Array:
    if np.any(errors < 0.0):
        raise RefusedError(f"{group.path}: an error in {name!r} is negative")
    return errors


def _error(group: hdf5.Group, name: str) -> float:
    return float(_not_negative(group, name, _numbers(group, name))[0])


def _axis_nodes(group: hdf5.Group, axis: atlas.Axis) -> Array:
    """Return the nodes of an axis; :func:`_check_nodes` compares them with the atlas of this
    version."""
    values = _array(group, axis.name)
    if values.ndim != 1 or not 2 <= values.size <= MOST_NODES:
        raise RefusedError(f"{group.path}: {axis.name!r} has not 2 to {MOST_NODES} nodes")
    return values


def _check_nodes(nodes_of: list[tuple[str, atlas.Axis, Array]]) -> None:
    """Refuse nodes, by the path of their group, that differ from the atlas of this version."""
    for path, axis, values in nodes_of:
        # the last digit of the cosine depends on the mathematical library
        deviation = np.abs(values - nodes(values.size, axis.low, axis.high))
        if np.any(deviation > 1e-15 * max(abs(axis.low), abs(axis.high))):
            raise RefusedError(
                f"{path}: the nodes of {axis.name!r} are not those of this program's chart"
            )


def _cells(group: hdf5.Group, count: int) -> list[int]:
    cells = _numbers(group, "cells", count)
    if not np.all((cells >= 1) & (cells <= MOST_CELLS) & (cells == np.round(cells))):
        raise RefusedError(f"{group.path}: cells must be whole numbers from 1 to {MOST_CELLS}")
    if np.prod(cells) > MOST_PATCHES:
        raise RefusedError(f"{group.path}: has more than {MOST_PATCHES} cells")
    return [int(n) for n in cells]


def _check_same(group: hdf5.Group, name: str, expected: Any) -> None:
    value = _attribute(group, name)
    if not np.array_equal(value, expected):
        printable = expected.tolist() if isinstance(expected, np.ndarray) else expected
        raise RefusedError(
            f"{group.path}: {name} is {value!r}, this program's atlas has {printable!r}"
        )


def _check_contact(group: hdf5.Group) -> None:
    """Refuse statements about a contact that the program could not use."""
    for name in _STATED:
        if not _numbers(group, name)[0] > 0.0:
            raise RefusedError(
                f"attribute {name!r} of {group.path} must be > 0, got {group.attributes[name]}"
            )
    names, shares = (_attribute(group, f"verified_{name}") for name in ("quantities", "quantiles"))
    if not isinstance(names, str):
        raise RefusedError(f"attribute 'verified_quantities' of {group.path} is no text")
    _numbers(group, "verified_quantiles", np.size(shares))
    for name, count in (("error_quantiles", np.size(shares)), ("bound_over_error", len(RATIOS))):
        if np.any(_numbers(group, f"verified_{name}", count * len(names.split())) < 0.0):
            raise RefusedError(f"attribute 'verified_{name}' of {group.path} has a negative number")


def _check_root(attributes: dict[str, Any]) -> list[str]:
    """Return the names of the tabulated quantities.  Refuse attributes of the root that the program
    could not use."""
    root = hdf5.Group("/", attributes)
    if not {"format_version", "content_sha256"} <= attributes.keys():
        raise RefusedError("not a mumacro table: format_version or content_sha256 is missing")
    version = attributes["format_version"]
    if not np.array_equal(version, FORMAT_VERSION):
        raise RefusedError(
            f"format version {version}, this program reads {FORMAT_VERSION}: build the table anew "
            "with python -m builder build, or open it with the release that wrote it"
        )
    if not isinstance(attributes["content_sha256"], str):
        raise RefusedError("attribute 'content_sha256' is no text")
    for name in INTERPOLATION_ERRORS:
        _error(root, name)
    try:
        json.loads(attributes.get("builder_options", "{}"))
    except (ValueError, TypeError, RecursionError) as error:
        raise RefusedError(f"attribute 'builder_options' is no JSON ({error})") from None
    names = quantity_names(attributes)
    if names[:1] != ["mu_ratio"] or len({*names}) != len(names) or not {*names} <= BY_NAME.keys():
        raise RefusedError(
            f"attribute 'quantities' is {names}, this program knows {', '.join(BY_NAME)}"
        )
    return names


def _border_piece(group: hdf5.Group, axis: atlas.Axis) -> BorderPiece:
    _check_same(group, "range", [axis.low, axis.high])
    axis_nodes = _axis_nodes(group, axis)
    (cells,) = _cells(group, 1)
    values = _array(group, "value", axis_nodes.shape)
    return BorderPiece(axis_nodes, values, cells, _error(group, "max_rel_error"))


def _block(
    group: hdf5.Group,
    chart: atlas.Chart,
    names: list[str],
    tabulated: list[atlas.TabulatedQuantity],
) -> Block:
    """Return a block of a table; ``names`` are the quantities of the table, ``tabulated`` are those
    of this block."""
    for name, expected in _geometry(chart).items():
        _check_same(group, name, expected)
    a, b = _axis_nodes(group, chart.a), _axis_nodes(group, chart.b)
    na, nb = _cells(group, 2)
    node_values = {
        quantity.name: _array(group, quantity.variable, (a.size, b.size)) for quantity in tabulated
    }
    block = Block(a, b, (na, nb), node_values)
    block.max_abs_error, block.max_rel_error = (
        _error(group, f"verified_max_{norm}_error") for norm in ("abs", "rel")
    )
    errors = _not_negative(group, "errors", _numbers(group, "errors", 3 * len(names)))
    block.errors.update(zip(names, errors.reshape(-1, 3), strict=True))
    return block


def _contact(group: hdf5.Group, name: str, names: list[str]) -> TabulatedContact:
    _check_contact(group)
    charts = atlas.CHARTS[name]
    tabulated = [[BY_NAME[q] for q in names if chart.holds(BY_NAME[q])] for chart in charts]
    blocks = [
        _block(_group(group, chart.name), chart, names, quantities)
        for chart, quantities in zip(charts, tabulated, strict=True)
    ]
    _add_cell_errors(group, blocks, names)
    axes = [
        (group.groups[chart.name].path, axis, values)
        for chart, block in zip(charts, blocks, strict=True)
        for axis, values in ((chart.a, block.a), (chart.b, block.b))
    ]
    _check_nodes(axes)
    return TabulatedContact(name, blocks, group.attributes)


def _add_cell_errors(group: hdf5.Group, blocks: list[Block], names: Sequence[str]) -> None:
    last = np.cumsum([block.cells[0] * block.cells[1] for block in blocks])
    numbers = _array(group, "cell_errors", (len(names), int(last[-1]), 3))
    for name, errors in zip(names, _not_negative(group, "cell_errors", numbers), strict=True):
        for block, part in zip(blocks, np.split(errors, last[:-1]), strict=True):
            if name in block.nodes:
                block.cell_errors[name] = part


def _read(file: hdf5.File) -> Table:
    names = _check_root(file.attributes())  # first, because another version may have other parts
    root = file.read(_layout())
    below = _group(root, "border")
    border = [_border_piece(_group(below, name), axis) for name, axis, _ in atlas.BORDER_PIECES]
    _check_nodes(
        [
            (below.groups[name].path, axis, piece.nodes)
            for (name, axis, _), piece in zip(atlas.BORDER_PIECES, border, strict=True)
        ]
    )
    contacts = {name: _contact(_group(below, name), name, names) for name in atlas.CHARTS}
    plain: dict[str, Array] = {}
    for name, (_, axes) in _PLAIN.items():  # the two axes come first
        shape = tuple(plain[axis].size for axis in axes) if axes else None
        plain[name] = _array(root, name, shape)
        if not axes and plain[name].ndim != 1:
            raise RefusedError(f"variable {name!r} in / is no axis")
    return Table(border=border, contacts=contacts, attributes=root.attributes, **plain)


def read_table(path: str | Path) -> Table:
    """Read and check a table file; several threads may do this at once.

    Raises
    ------
    TableError
        If the file is missing, truncated or of another program, has another format version or
        geometry, lacks a group or variable, has values that are not finite, or a checksum that does
        not fit.  The message names the file and the reason.
    """
    return parse_table(read_image(path), path)


def parse_table(image: bytes, path: str | Path) -> Table:
    """Read a table as :func:`read_table` does, from the bytes of the file; errors name ``path``."""
    try:
        table = _read(hdf5.File(image, MOST_NUMBERS, MOST_IN_ALL))
        digest = _digest(table)
    except RefusedError as refused:
        raise TableError(path, str(refused)) from refused.__cause__
    except Exception as error:  # h5py raises nearly any exception
        raise TableError(
            path, f"not a readable netCDF-4 table ({type(error).__name__}: {error})"
        ) from error
    if digest != table.attributes["content_sha256"]:
        raise TableError(
            path, "checksum does not match the content: the file is damaged or was edited"
        )
    return table


def read_image(path: str | Path) -> bytes:
    """Return the bytes of a table file.  Raise TableError if it is missing, unreadable, or larger
    than any table."""
    path = Path(path)
    try:
        if not path.is_file():
            raise TableError(path, "no such file")
        if path.stat().st_size > MOST_BYTES:
            raise TableError(
                path, f"has {path.stat().st_size} bytes, more than any table ({MOST_BYTES})"
            )
        return path.read_bytes()
    except OSError as error:
        raise TableError(path, f"cannot be read: {error.strerror or error}") from error


def json_attributes(table: Table) -> dict[str, object]:
    """Return root attributes as plain Python numbers, lists and strings, with ``builder_options``
    parsed."""
    out = {
        key: value.tolist() if isinstance(value, (np.generic, np.ndarray)) else value
        for key, value in table.attributes.items()
    }
    if "builder_options" in out:
        out["builder_options"] = json.loads(out["builder_options"])
    return out

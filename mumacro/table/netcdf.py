"""The table file, format 5: netCDF-4 with CF-1.11 conventions; written atomically, checked on
reading.

docs/table-format.md has the layout: the plain grid at the root, the pieces of v~crit in ``border``,
the blocks inside, those of a ball in ``border/ball``. The netCDF library writes, and is not
thread-safe: a lock is held while it works.
For reading see ``mumacro.table.hdf5``.
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
from mumacro.table.blocks import BY_NAME, Block, BorderPiece, Table, names_in
from mumacro.table.polynomials import nodes

FORMAT_VERSION = 5
# More is refused before memory is taken; of the largest table that the builder makes:
MOST_BYTES = 16 * 2**20  # of a file: 425 kB
MOST_NUMBERS = 200_000  # of a variable: 14,641
MOST_NODES = 1024  # along an axis: 91; preparing cells takes matrices of its square
MOST_CELLS = 1024  # along an axis: 156
MOST_PATCHES = 8192  # cells of a block: 1833, of 512 bytes each and quantity

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
BALL = "ball_"  # before the names of attributes at the root that tell of a ball
#: the statistics of bound over error in the attribute ``verified_bound_over_error``
RATIOS = ("least", "median", "largest")
#: of every contact; others may be missing
_STATED = ("tolerance", "verified_max_abs_error", "verified_max_rel_error")
CELL_AXES = ("quantity", "cell", "derivative")
FEW = 256  # numbers: fewer are stored as they are, since a chunk's index takes 2 kB


def _contacts(table: Table) -> list[tuple[Sequence[atlas.Chart], list[Block]]]:
    """The charts and blocks of every contact."""
    return [(atlas.CHARTS, table.blocks), (atlas.BALL_CHARTS, table.ball)]


def _digest(table: Table) -> str:
    """SHA-256 over every number that affects a value or its bound, the geometry, and the
    tolerance."""
    h = hashlib.sha256()

    def put(*parts: object) -> None:
        for part in parts:
            is_array = isinstance(part, np.ndarray)
            h.update(
                np.ascontiguousarray(part, dtype="<f8").tobytes()
                if is_array
                else repr(part).encode()
            )

    put("mumacro", FORMAT_VERSION, float(table.attributes["tolerance"]))
    put(*(getattr(table, name) for name in _PLAIN))
    for geometry, piece in zip(atlas.BORDER_PIECES, table.border, strict=True):
        put(geometry, piece.cells, float(piece.max_rel_error), piece.nodes, piece.values)
    for charts, blocks in _contacts(table):
        for chart, block in zip(charts, blocks, strict=True):
            put(chart, tuple(block.cells), float(block.max_abs_error), float(block.max_rel_error))
            put(*(block.errors[name] for name in table.quantities), block.a, block.b)
            put(
                *(
                    part[name]
                    for part in (block.nodes, block.cell_errors)
                    for name in table.quantities
                    if name in part
                )
            )
    return h.hexdigest()


# --- writing --------------------------------------------------------------------------------------


def _put(
    group: Any,
    name: str,
    data: Array,
    long_name: str,
    axes: tuple[str, ...] = (),
    **attributes: Any,
) -> None:
    """A float64 variable over ``axes``; without them it is a coordinate itself."""
    if not axes:
        group.createDimension(name, data.size)
    filters = {"compression": "zlib", "complevel": 9, "shuffle": True, "chunksizes": data.shape}
    extra = filters if data.size > FEW else {"contiguous": True}
    variable = group.createVariable(name, "f8", axes or (name,), fill_value=False, **extra)
    variable.setncatts({"long_name": long_name, "units": "1", **attributes})
    variable[...] = data


def _put_cell_errors(group: Any, blocks: list[Block], names: Sequence[str]) -> None:
    """The errors in all cells, block after block, as one variable: each costs half a kilobyte, and
    a dimension too."""

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
    _put(group, "cell_errors", errors, long_name, CELL_AXES)


def _geometry(chart: atlas.Chart) -> dict[str, Any]:
    return {
        "regime": atlas.REGIMES[chart.regime],
        "quantity": chart.quantity,
        "range_of_a": np.array([chart.a.low, chart.a.high]),
        "range_of_b": np.array([chart.b.low, chart.b.high]),
    }


def _fill(root: Any, table: Table) -> None:
    root.setncatts(table.attributes)
    for name, (long_name, axes) in _PLAIN.items():
        extra = {"ancillary_variables": "error_estimate"} if name == "mu_ratio" else {}
        _put(root, name, getattr(table, name), long_name, axes, **extra)
    border = root.createGroup("border")
    for (name, axis, tabulated), piece in zip(atlas.BORDER_PIECES, table.border, strict=True):
        group = border.createGroup(name)
        _put(group, axis.name, piece.nodes, atlas.COORDINATES[axis.name])
        _put(group, "value", piece.values, tabulated, (axis.name,))
        group.setncatts(
            {
                "cells": np.int32(piece.cells),
                "max_rel_error": piece.max_rel_error,
                "range": np.array([axis.low, axis.high]),
            }
        )
    # inside the border, which they are fitted to: with a second group at the root the CF checker
    # looks for "time"
    _fill_blocks(border.createGroup("blocks"), table, atlas.CHARTS, table.blocks)
    if table.ball:
        _fill_blocks(border.createGroup("ball"), table, atlas.BALL_CHARTS, table.ball)


def _fill_blocks(
    group: Any,
    table: Table,
    charts: Sequence[atlas.Chart],
    blocks: list[Block],
) -> None:
    """The blocks of a contact, with errors in every cell."""
    if any(block.cell_errors for block in blocks):
        _put_cell_errors(group, blocks, table.quantities)
    for chart, block in zip(charts, blocks, strict=True):
        one = group.createGroup(chart.name)
        axes = (chart.a.name, chart.b.name)
        _put(one, axes[0], block.a, atlas.COORDINATES[axes[0]])
        _put(one, axes[1], block.b, atlas.COORDINATES[axes[1]])
        for quantity in table.quantities_of(chart):
            meaning = (
                chart.quantity
                if quantity.name == "mu_ratio"
                else f"{quantity.meaning}, scaled for this block"
            )
            _put(one, quantity.variable, block.nodes[quantity.name], meaning, axes)
        # eight attributes: HDF5 keeps more in a structure of its own, of several kilobytes a group
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
    """Write ``table`` to ``path`` atomically (temporary file beside it, fsync, rename) and return
    its checksum.

    TableError where the folder does not exist or cannot be written, or the disk is full; nothing is
    left behind.
    """
    import tempfile  # only writing needs it: reading a table starts sooner without

    path = Path(path)
    table.attributes["format_version"] = np.int32(FORMAT_VERSION)
    table.attributes["content_sha256"] = _digest(table)
    try:
        image = _image(table)
    except (
        OSError,
        RuntimeError,
    ) as error:  # the netCDF library raises RuntimeError where it cannot write
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
    """The bytes of a file that holds ``table``.

    A temporary file: where the disk is full the netCDF library reports little and keeps the file
    open.  A file that it makes in memory contains the time of day.
    """
    import tempfile  # only writing needs it: reading a table starts sooner without

    import netCDF4  # installed only to build tables

    with tempfile.TemporaryDirectory(prefix="mumacro-") as folder:
        path = Path(folder) / "table.nc"
        with _netcdf_lock, netCDF4.Dataset(str(path), "w", format="NETCDF4") as root:
            _fill(root, table)
        return path.read_bytes()


# --- reading --------------------------------------------------------------------------------------


def _nodes(group: hdf5.Group, axis: atlas.Axis) -> Array:
    """The nodes of an axis, which must be those of the running atlas."""
    values = group.array(axis.name, MOST_NUMBERS)
    if values.ndim != 1 or not 2 <= values.size <= MOST_NODES:
        raise group.refuse(f"{group.path}: {axis.name!r} has not 2 to {MOST_NODES} nodes")
    # the cosine's last digit differs between mathematical libraries
    deviation = np.abs(values - nodes(values.size, axis.low, axis.high))
    if np.any(deviation > 1e-15 * max(abs(axis.low), abs(axis.high))):
        raise group.refuse(
            f"{group.path}: the nodes of {axis.name!r} are not those of this program's chart"
        )
    return values


def _cells(group: hdf5.Group, count: int) -> list[int]:
    cells = group.numbers("cells", count)
    if not np.all((cells >= 1) & (cells <= MOST_CELLS) & (cells == np.round(cells))):
        raise group.refuse(f"{group.path}: cells must be whole numbers from 1 to {MOST_CELLS}")
    if np.prod(cells) > MOST_PATCHES:
        raise group.refuse(f"{group.path}: has more than {MOST_PATCHES} cells")
    return [int(n) for n in cells]


def _errors(group: hdf5.Group, name: str, errors: Array) -> Array:
    if np.any(errors < 0.0):
        raise group.refuse(f"{group.path}: an error in {name!r} is negative")
    return errors


def _error(group: hdf5.Group, name: str) -> float:
    return float(_errors(group, name, group.numbers(name, 1))[0])


def _check_same(group: hdf5.Group, name: str, expected: Any) -> None:
    stored = group.attribute(name)
    if not np.array_equal(stored, expected):
        printable = expected.tolist() if isinstance(expected, np.ndarray) else expected
        raise group.refuse(
            f"{group.path}: {name} is {stored!r}, this program's atlas has {printable!r}"
        )


def _check_distribution(root: hdf5.Group, attributes: dict[str, Any], of: str) -> None:
    """Refuse a damaged distribution of errors; older tables have no distribution."""
    if f"{of}verified_quantities" not in attributes:
        return
    shares = root.attribute(f"{of}verified_quantiles")
    names = str(attributes[f"{of}verified_quantities"]).split()
    for name, count in (("error_quantiles", np.size(shares)), ("bound_over_error", len(RATIOS))):
        if np.any(root.numbers(f"{of}verified_{name}", count * len(names)) < 0.0):
            raise root.refuse(f"attribute '{of}verified_{name}' has a negative number")


def _attributes(root: hdf5.Group) -> dict[str, Any]:
    """The attributes of the root; those that the program uses are checked."""
    if not all(map(root.has, ("format_version", "content_sha256", "tolerance"))):
        raise root.refuse(
            "not a mumacro table: format_version, tolerance or content_sha256 is missing"
        )
    version = root.attribute("format_version")
    if not np.array_equal(version, FORMAT_VERSION):
        raise root.refuse(f"format version {version}, this program reads {FORMAT_VERSION}")
    attributes = root.attributes()
    for name in (
        *(f"{of}{name}" for of in ("", BALL) for name in _STATED),
        *(key for key in attributes if key.removeprefix(BALL).startswith("verified_max_")),
    ):
        if not root.numbers(name, 1)[0] > 0.0:
            raise root.refuse(f"attribute {name!r} must be > 0, got {attributes[name]!r}")
    for of in ("", BALL):
        _check_distribution(root, attributes, of)
    if not isinstance(attributes["content_sha256"], str):
        raise root.refuse("attribute 'content_sha256' is no text")
    try:
        json.loads(attributes.get("builder_options", "{}"))
    except (ValueError, TypeError, RecursionError) as error:
        raise root.refuse(f"attribute 'builder_options' is no JSON ({error})") from None
    names = names_in(attributes)
    if names[:1] != ["mu_ratio"] or len({*names}) != len(names) or not {*names} <= BY_NAME.keys():
        raise root.refuse(
            f"attribute 'quantities' is {names}, this program knows {', '.join(BY_NAME)}"
        )
    return attributes


def _border_piece(group: hdf5.Group, axis: atlas.Axis) -> BorderPiece:
    _check_same(group, "range", [axis.low, axis.high])
    axis_nodes = _nodes(group, axis)
    (cells,) = _cells(group, 1)
    return BorderPiece(
        axis_nodes,
        group.array("value", MOST_NUMBERS, axis_nodes.shape),
        cells,
        _error(group, "max_rel_error"),
    )


def _block(group: hdf5.Group, chart: atlas.Chart, names: list[str]) -> Block:
    for name, expected in _geometry(chart).items():
        _check_same(group, name, expected)
    a, b = _nodes(group, chart.a), _nodes(group, chart.b)
    quantities = [BY_NAME[name] for name in names if chart.holds(BY_NAME[name])]
    node_values = {
        quantity.name: group.array(quantity.variable, MOST_NUMBERS, (a.size, b.size))
        for quantity in quantities
    }
    na, nb = _cells(group, 2)
    block = Block(a, b, (na, nb), node_values)
    block.max_abs_error, block.max_rel_error = (
        _error(group, f"verified_max_{norm}_error") for norm in ("abs", "rel")
    )
    errors = _errors(group, "errors", group.numbers("errors", 3 * len(names)))
    block.errors.update(zip(names, errors.reshape(-1, 3), strict=True))
    return block


def _add_cell_errors(group: hdf5.Group, blocks: list[Block], names: Sequence[str]) -> None:
    last = np.cumsum([block.cells[0] * block.cells[1] for block in blocks])
    stored = group.array("cell_errors", MOST_NUMBERS, (len(names), int(last[-1]), 3))
    for name, errors in zip(names, _errors(group, "cell_errors", stored), strict=True):
        for block, part in zip(blocks, np.split(errors, last[:-1]), strict=True):
            if name in block.nodes:
                block.cell_errors[name] = part


def _read(root: hdf5.Group) -> Table:
    attributes = _attributes(root)
    names = names_in(attributes)
    below_border = root.group("border")
    below_blocks = below_border.group("blocks")
    border = [
        _border_piece(below_border.group(name), axis) for name, axis, _ in atlas.BORDER_PIECES
    ]
    blocks = [_block(below_blocks.group(chart.name), chart, names) for chart in atlas.CHARTS]
    _add_cell_errors(below_blocks, blocks, names)
    below_ball = below_border.group("ball")
    ball = [_block(below_ball.group(chart.name), chart, names) for chart in atlas.BALL_CHARTS]
    _add_cell_errors(below_ball, ball, names)
    plain: dict[str, Array] = {}
    for name, (_, axes) in _PLAIN.items():  # the two axes come first
        shape = tuple(plain[axis].size for axis in axes) if axes else None
        plain[name] = root.array(name, MOST_NUMBERS, shape)
        if not axes and plain[name].ndim != 1:
            raise root.refuse(f"variable {name!r} in / is no axis")
    return Table(border=border, blocks=blocks, attributes=attributes, ball=ball, **plain)


def read_table(path: str | Path) -> Table:
    """Read and check a table file; several threads may do so at once.

    Raises
    ------
    TableError
        Missing, truncated or foreign file, another format version, a missing group or variable,
        another geometry than the running atlas, non-finite values, a checksum that does not fit;
        the message names the file and the reason.
    """
    return parse_table(read_image(path), path)


def parse_table(image: bytes, path: str | Path) -> Table:
    """As :func:`read_table`, from the bytes of the file; ``path`` names it in errors."""
    try:
        table = _read(hdf5.open_image(image, lambda reason: TableError(path, reason)))
        digest = _digest(table)
    except TableError:
        raise
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
    """The bytes of a table file; TableError where it is missing, unreadable, or larger than any
    table."""
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


def error_distribution(table: Table, of: str = "") -> dict[str, dict[str, float]]:
    """By quantity: the error that a share of the verified points does not exceed ("0.5" to "1"),
    and the :data:`RATIOS` of bound over error; empty for a table that does not state them.

    ``of``: :data:`BALL` for those of a ball.
    """
    attributes = table.attributes
    names = str(attributes.get(f"{of}verified_quantities", "")).split()
    if not names:
        return {}
    heads = [f"{share:g}" for share in attributes[f"{of}verified_quantiles"]]
    errors = np.reshape(attributes[f"{of}verified_error_quantiles"], (len(names), -1)).tolist()
    ratios = np.reshape(attributes[f"{of}verified_bound_over_error"], (len(names), -1)).tolist()
    return {
        name: dict(zip(heads, error, strict=True)) | dict(zip(RATIOS, ratio, strict=True))
        for name, error, ratio in zip(names, errors, ratios, strict=True)
    }


def json_attributes(table: Table) -> dict[str, object]:
    """Root attributes as plain Python numbers, lists and strings; ``builder_options`` parsed."""
    out = {
        key: value.tolist() if isinstance(value, (np.generic, np.ndarray)) else value
        for key, value in table.attributes.items()
    }
    if "builder_options" in out:
        out["builder_options"] = json.loads(out["builder_options"])
    return out

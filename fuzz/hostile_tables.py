"""Files made to harm the program that opens them: memory, time, stack, other files, numbers of a wrong type."""

import functools
import shutil
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from benchmarks.measuring import ROOT
from mumacro.cells import nodes
from mumacro.charts import BORDER_PIECES
from mumacro.table import Table, read_table, write_table

SMALLEST = ROOT / "tables" / "mumacro-1e-4.nc"
Make = Callable[[Path], None]


def edited(change: Callable[[h5py.File], Any]) -> Make:
    """The smallest table, changed with the HDF5 library."""

    def make(path: Path) -> None:
        shutil.copy(SMALLEST, path)
        with h5py.File(path, "a") as file:
            change(file)

    return make


def signed(change: Callable[[Table], Any]) -> Make:
    """The smallest table with other numbers and a checksum that fits them."""

    def make(path: Path) -> None:
        table = read_table(SMALLEST)
        change(table)
        write_table(table, path)

    return make


def zeros(n: int) -> bytes:
    """``n`` zeros, a whole number of MiB, compressed: one compressed MiB repeated, and the checksum of all."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    block = packer.compress(bytes(2**20)) + packer.flush(zlib.Z_FULL_FLUSH)
    return b"\x78\xda" + block * (n >> 20) + packer.flush() + ((n % 65521 << 16) + 1).to_bytes(4, "big")


def replaced(file: h5py.File, name: str, packed: bytes, **options: Any) -> None:
    """Replace the variable of this name; its only chunk is written as the given bytes, if there are any."""
    del file[name]
    made = file.create_dataset(name, dtype="f8", **options)
    if packed:
        made.id.write_direct_chunk((0,) * made.ndim, packed)


def many_nodes(table: Table) -> None:
    axis = BORDER_PIECES[0][1]
    table.border[0].nodes = nodes(20_000, axis.low, axis.high)
    table.border[0].values = np.full(20_000, table.border[0].values[0])


def many_cells(table: Table) -> None:
    for block in table.blocks:
        block.cells, block.cell_errors = (1000, 1000), {}


def huge_numbers(table: Table) -> None:
    for block in table.blocks:
        block.nodes["mu_ratio"][...] = 1.7e308
        block.nodes["power"][...] = -1.7e308


def shuffled(table: Table) -> None:
    for block in table.blocks:
        block.nodes["mu_ratio"] = np.random.default_rng(1).normal(size=block.nodes["mu_ratio"].shape) * 1e100


def deep(file: h5py.File) -> None:
    group = file
    for _ in range(3000):
        group = group.create_group("g")


def links(file: h5py.File, link: Any) -> None:
    del file["border/blocks/corner"]
    file["border/blocks/corner"] = link


def attribute(name: str, value: Any, group: str = "/") -> Make:
    return edited(lambda file: file[group].attrs.__setitem__(name, value))


def variable(name: str, packed: Callable[[], bytes] = bytes, **options: Any) -> Make:
    return edited(lambda file: replaced(file, name, packed(), **options))


ZEROS, TEN = functools.partial(zeros, 2**31), {"shape": (10,), "chunks": (10,), "compression": "gzip"}
HOSTILE: dict[str, Make] = {
    "a group that contains itself": edited(lambda file: file.__setitem__("border/again", file["border"])),
    "a group that contains the root": edited(lambda file: file.__setitem__("border/blocks/root", file["/"])),
    "3,000 nested groups": edited(deep),
    "3,000 groups among the blocks": edited(
        lambda file: [file.create_group(f"border/blocks/g{i}") for i in range(3000)]),
    "2 GB of zeros in a chunk of 2 GB": variable("mu_ratio", ZEROS, **{**TEN, "maxshape": (None,), "chunks": (2**28,)}),
    "2 GB of zeros in a chunk of 80 bytes": variable("v_tilde", ZEROS, **TEN),
    "2 GB of zeros, compressed twice": variable("v_tilde", lambda: zlib.compress(ZEROS(), 9), **TEN),
    "a variable of 160 GB without stored data": variable(
        "mu_ratio", shape=(2_000_000_000, 10), chunks=(1000, 10), compression="gzip"),
    "a variable of 31 dimensions": variable("v_tilde", shape=(2,) * 31, chunks=(1,) * 31),
    "a variable in another file": variable("v_tilde", shape=(31,), external=[("/dev/zero", 0, 31 * 8)]),
    "a variable with another filter": variable("v_tilde", shape=(31,), chunks=(31,), compression="lzf"),
    "a grid of another shape": variable("mu_ratio", shape=(3, 3)),
    "a link to another file": edited(lambda file: links(file, h5py.ExternalLink(SMALLEST, "/border/blocks/corner"))),
    "a link to itself": edited(lambda file: links(file, h5py.SoftLink("/border/blocks/corner"))),
    "a variable in place of a group": edited(lambda file: links(file, np.zeros(3))),
    "a type in place of a group": edited(lambda file: links(file, np.dtype("f8"))),
    "60 kB of text in an attribute": edited(lambda file: file.attrs.create(
        "many", np.array(["x" * 1000] * 60, dtype=object), dtype=h5py.string_dtype())),
    "50 attributes of 60 kB": edited(lambda file: [file.attrs.__setitem__(f"a{i}", "x" * 60_000) for i in range(50)]),
    "5,000 attributes": edited(lambda file: [file.attrs.__setitem__(f"a{i}", i) for i in range(5000)]),
    "a tolerance that is text": attribute("tolerance", "1e-4"),
    "a tolerance of three numbers": attribute("tolerance", np.zeros(3)),
    "a tolerance that is not finite": attribute("tolerance", np.nan),
    "a checksum of three numbers": attribute("content_sha256", np.zeros(3)),
    "an error that is text": attribute("verified_max_abs_error", "small"),
    "options that are not JSON": attribute("builder_options", "{"),
    "options nested too deeply": attribute("builder_options", "[" * 60_000),
    "a version of two numbers": attribute("format_version", np.array([3, 3])),
    "cells of a compound type": attribute("cells", np.zeros(1, [("a", "i4")]), "border/blocks/corner"),
    "errors that are complex": attribute("errors", np.zeros(9, complex), "border/blocks/corner"),
    "text that is not UTF-8": attribute("title", np.bytes_(b"\xff\xfe")),
    "20,000 nodes, checksum right": signed(many_nodes),
    "12 million cells, checksum right": signed(many_cells),
    "numbers of 1.7e308, checksum right": signed(huge_numbers),
    "random numbers of 1e100, checksum right": signed(shuffled),
    "a border of 1e300, checksum right": signed(lambda table: table.border[1].values.fill(1e300)),
    "amplitudes of 1e300, checksum right": signed(lambda table: setattr(table, "y_tilde", table.y_tilde * 1e300)),
    "errors of 1e308, checksum right": signed(lambda table: table.blocks[0].errors["mu_ratio"].fill(1e308)),
}  # fmt: skip
#: a table with other numbers and a matching checksum is a different table; any answer is allowed
ANOTHER = {
    "numbers of 1.7e308, checksum right", "random numbers of 1e100, checksum right",
    "amplitudes of 1e300, checksum right", "errors of 1e308, checksum right",
}  # fmt: skip
#: what lies beside the parts that are read, is not read
HARMLESS = {
    "a group that contains itself", "a group that contains the root", "3,000 nested groups",
    "3,000 groups among the blocks",
}  # fmt: skip

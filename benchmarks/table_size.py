"""Where the bytes of a table file are: the tables in docs/table-format.md, "Size".

    python benchmarks/table_size.py [--write]

Each committed table is written again in other ways: by the netCDF library, all in two groups, and, built anew, without
rounding.
"""

from __future__ import annotations

import measuring  # isort: split

import argparse
import io
import tempfile
import zlib
from collections import Counter
from pathlib import Path
from typing import Any

import h5py
import netCDF4
import numpy as np
from numpy.typing import NDArray

from builder import rounding
from builder.assemble import build_table
from builder.sweep import Sweep
from friction.table import Table, read_table

PAGE = measuring.ROOT / "docs" / "table-format.md"
NO_ROUNDING = 2**80  # steps in a tolerance: finer than any float64 here


def arrays(table: Table) -> list[NDArray[np.float64]]:
    """All that a table holds, one array for each variable of its file."""
    found = [table.v_tilde, table.y_tilde, table.mu_ratio, table.stick_fraction, table.error_estimate]
    found.append(table.v_tilde_crit)
    for piece in table.border:
        found += [piece.nodes, piece.values]
    for block in table.blocks:
        found += [block.a, block.b, block.values, block.power, *([block.stick] if block.stick.size else [])]
    return found


def compressed(values: NDArray[np.float64]) -> int:
    """Bytes after shuffle and zlib, or without them if that is less."""
    planes = np.frombuffer(values.tobytes(), np.uint8).reshape(-1, 8).T
    return min(values.nbytes, len(zlib.compress(planes.tobytes(), 9)))


def parts(path: Path) -> Counter[str]:
    """Bytes of headers and of numbers, by kind of object; "rest" is the heap of references, links and gaps."""
    found: Counter[str] = Counter()
    with h5py.File(path) as root:

        def add(_: str, item: Any) -> None:
            kind = "groups" if isinstance(item, h5py.Group) else ("coordinates" if item.is_scale else "variables")
            found[kind] += h5py.h5o.get_info(item.id).hdr.space.total
            found[f"n {kind}"] += 1
            if kind != "groups":
                found["numbers"] += item.id.get_storage_size()

        add("/", root)
        root.visititems(add)
    told = sum(found[kind] for kind in ("groups", "coordinates", "variables", "numbers"))
    found["rest"] = path.stat().st_size - told
    return found


def by_netcdf(path: Path) -> int:
    """Bytes of the same variables, groups, attributes and filters as the netCDF library writes them."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "copy.nc"
        with netCDF4.Dataset(str(path)) as old, netCDF4.Dataset(str(out), "w") as new:
            _copy(old, new)
        return out.stat().st_size


def _copy(old: Any, new: Any) -> None:
    new.setncatts({name: old.getncattr(name) for name in old.ncattrs()})
    for name, dimension in old.dimensions.items():
        new.createDimension(name, len(dimension))
    for name, variable in old.variables.items():
        filtered = {"zlib": True, "shuffle": True, "complevel": 9, "chunksizes": variable.shape}
        # a chunk's index takes 2 kB there: the library is at its best when small variables go without
        extra = filtered if variable.size > 256 else {}
        made = new.createVariable(name, "f8", variable.dimensions, fill_value=False, **extra)
        made.setncatts({key: variable.getncattr(key) for key in variable.ncattrs()})
        made[...] = variable[...]
    for name, group in old.groups.items():
        _copy(group, new.createGroup(name))


def packed(path: Path, table: Table) -> int:
    """Bytes when the numbers of all blocks stand in a few long variables, at the root and in one group."""
    buffer = io.BytesIO()
    with h5py.File(buffer, "w", libver=("v110", "v110"), track_order=True) as root, netCDF4.Dataset(str(path)) as old:
        for name in old.ncattrs():
            value = old.getncattr(name)
            root.attrs.create(name, np.bytes_(value) if isinstance(value, str) else value)
        v, y = _long(root, "v_tilde", table.v_tilde), _long(root, "y_tilde", table.y_tilde)
        for name in ("mu_ratio", "stick_fraction", "error_estimate"):
            _long(root, name, getattr(table, name), v, y)
        _long(root, "v_tilde_crit", table.v_tilde_crit, y)
        group = root.create_group("blocks", track_order=True)
        node = _long(group, "node", np.concatenate([piece.nodes for piece in table.border]))
        _long(group, "border", np.concatenate([piece.values for piece in table.border]), node)
        _long(group, "axes", np.concatenate([axis for block in table.blocks for axis in (block.a, block.b)]))
        for name in ("values", "power", "stick"):
            together = np.concatenate([getattr(block, name).ravel() for block in table.blocks])
            _long(group, name, together, _long(group, f"{name}_index", np.arange(together.size, dtype=np.float64)))
        count = _long(group, "block", np.arange(len(table.blocks), dtype=np.float64))
        errors = [(b.quantity_error, b.max_abs_error, b.max_rel_error, *b.cells, *b.values.shape) for b in table.blocks]
        for i, column in enumerate(np.array(errors).T):
            _long(group, f"of_block_{i}", column, count)
    return len(buffer.getvalue())


def _long(group: Any, name: str, data: NDArray[np.float64], *axes: Any) -> Any:
    filters = {"chunks": data.shape, "compression": "gzip", "compression_opts": 9, "shuffle": True}
    variable = group.create_dataset(name, data=np.ascontiguousarray(data), fill_time="never", **filters)
    for key, value in (("units", "1"), ("long_name", "what a person wants to know of it")):
        variable.attrs.create(key, np.bytes_(value))
    for dimension, axis in zip(variable.dims, axes, strict=bool(axes)):
        dimension.attach_scale(axis)
    if not axes:
        variable.make_scale()
    return variable


def unrounded(tolerance: float) -> int:
    """Bytes of the table for ``tolerance`` with all the digits of the solver."""
    measuring.progress(f"building for {tolerance:.0e} without rounding")
    steps = rounding.STEPS
    rounding.STEPS = NO_ROUNDING
    try:
        with tempfile.TemporaryDirectory() as folder, Sweep(1) as sweep:
            out = Path(folder) / "table.nc"
            build_table(out, tolerance, sweep)
            return out.stat().st_size
    finally:
        rounding.STEPS = steps


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="put the tables into docs/table-format.md")
    given = parser.parse_args()
    loaded = [(path, read_table(path)) for path in (measuring.ROOT / "tables").glob("*.nc")]
    loaded.sort(key=lambda pair: -pair[1].attributes["tolerance"])
    sizes, inside = [], []
    for path, table in loaded:
        numbers = arrays(table)
        found = parts(path)
        row = (
            path.stat().st_size, unrounded(float(table.attributes["tolerance"])), by_netcdf(path), packed(path, table),
            sum(a.nbytes for a in numbers), sum(map(compressed, numbers)),
        )  # fmt: skip
        sizes.append([f"`{path.name}`", *(f"{n:,}" for n in row)])
        kinds = ("numbers", "variables", "coordinates", "groups", "rest")
        inside.append([f"`{path.name}`", *(f"{found[kind]:,}" for kind in kinds)])
    header = (
        "table", "bytes", "without rounding", "by the netCDF library", "in two groups", "numbers as float64",
        "numbers compressed",
    )  # fmt: skip
    headers = (f"headers of {found[f'n {kind}']} {kind}" for kind in kinds[1:4])
    titles = ("table", "numbers", *headers, "links, references, gaps")
    tables = measuring.markdown(header, sizes, 1), measuring.markdown(titles, inside, 1)
    text = "\n\n".join([tables[0], "Bytes by what they are for:", tables[1]])
    print(text)
    if given.write:
        measuring.write_section("table_size", text, PAGE)


if __name__ == "__main__":
    main()

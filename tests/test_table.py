"""The table file in detail: changed numbers, missing parts, failed writes."""

import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import netCDF4
import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from mumacro import InputError, Surrogate, TableError, charts
from mumacro.cells import nodes
from mumacro.charts import BORDER_PIECES, CHARTS, NAMES
from mumacro.table import MOST_BYTES, MOST_CELLS, Table, _digest, read_table, write_table

Array = NDArray[np.float64]
CORNER = NAMES.index("corner")
TABLE = Path(__file__).parent.parent / "tables" / "mumacro-1e-4.nc"


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    return Path(shutil.copy(TABLE, tmp_path / "copy.nc"))


@pytest.mark.slow
def test_a_byte_flipped_in_the_numbers_is_always_refused(copy: Path) -> None:
    whole, sound = TABLE.read_bytes(), read_table(TABLE)
    corner = sound.blocks[CORNER]
    for numbers in (sound.border[0].values.tobytes(), sound.border[0].nodes.tobytes(), corner.a.tobytes()):
        place = whole.find(numbers)
        assert place > 0  # a few numbers are stored uncompressed
        for offset in range(0, len(numbers), 7):
            changed = bytearray(whole)
            changed[place + offset] ^= 1 << (offset % 8)
            copy.unlink()  # HDF5 may keep a file open that it could not read; so make a new file
            copy.write_bytes(changed)
            with pytest.raises(TableError, match=r"checksum|non-finite|are not those of this program"):
                read_table(copy)


@pytest.mark.slow
def test_a_byte_flipped_anywhere_is_refused_or_changes_nothing(copy: Path) -> None:
    """Headers, heaps and compressed numbers: a file that still opens has the numbers of the intact table."""
    whole, sound = TABLE.read_bytes(), read_table(TABLE)
    refused = 0
    for offset in range(0, len(whole), 631):
        changed = bytearray(whole)
        changed[offset] ^= 1 << (offset % 8)
        copy.unlink()
        copy.write_bytes(changed)
        try:
            opened = read_table(copy)
        except TableError:
            refused += 1
        else:
            assert opened.attributes == sound.attributes
            _same_numbers(opened, sound)
    # unused bytes of the file change no number
    assert refused > 0.7 * len(whole) / 631


def _same_numbers(one: Table, two: Table) -> None:
    for name in ("v_tilde", "y_tilde", "mu_ratio", "stick_fraction", "error_estimate", "v_tilde_crit"):
        assert np.array_equal(getattr(one, name), getattr(two, name))
    for low, high in zip(one.border, two.border, strict=True):
        assert np.array_equal(low.nodes, high.nodes)
        assert np.array_equal(low.values, high.values)
        assert (low.cells, low.max_rel_error) == (high.cells, high.max_rel_error)
    for left, right in zip(one.blocks, two.blocks, strict=True):
        assert np.array_equal(left.a, right.a)
        assert np.array_equal(left.b, right.b)
        for part in ("nodes", "errors", "cell_errors"):
            ours, theirs = getattr(left, part), getattr(right, part)
            assert ours.keys() == theirs.keys()
            assert all(np.array_equal(ours[name], theirs[name]) for name in ours)
        for name in ("cells", "max_abs_error", "max_rel_error"):
            assert getattr(left, name) == getattr(right, name)


@pytest.mark.parametrize("name", [name for name, *_ in BORDER_PIECES] + [f"blocks/{name}" for name in NAMES])
def test_every_group_is_needed(copy: Path, name: str) -> None:
    with netCDF4.Dataset(str(copy), "a") as root:
        parent, _, last = f"border/{name}".rpartition("/")
        root[parent].renameGroup(last, "elsewhere")
    with pytest.raises(TableError, match=rf"group '{last}' is missing|block 'elsewhere' is unknown"):
        Surrogate.open(copy)


@pytest.mark.parametrize("name", ["v_tilde", "y_tilde", "mu_ratio", "stick_fraction", "error_estimate", "v_tilde_crit"])
def test_every_variable_of_the_plain_grid_is_needed(copy: Path, name: str) -> None:
    with netCDF4.Dataset(str(copy), "a") as root:
        root.renameVariable(name, "renamed")
    with pytest.raises(TableError, match=f"variable '{name}' (is missing in /|in / is no float64 array)"):
        Surrogate.open(copy)


@pytest.mark.parametrize(
    "name", ["mu_ratio", "border/mid/value", "border/blocks/corner/stick", "border/blocks/cell_errors"]
)
def test_infinity_is_refused(copy: Path, name: str) -> None:
    with netCDF4.Dataset(str(copy), "a") as root:
        variable = root[name]
        variable[(0,) * variable.ndim] = np.inf
    with pytest.raises(TableError, match="holds non-finite values"):
        Surrogate.open(copy)


@pytest.mark.parametrize("version", [np.int32(0), "one", np.array([1, 2])])
def test_a_version_that_is_none_is_refused(copy: Path, version: Any) -> None:
    with netCDF4.Dataset(str(copy), "a") as root:
        root.setncattr("format_version", version)
    with pytest.raises(TableError, match=r"copy\.nc"):
        Surrogate.open(copy)


@pytest.mark.parametrize("attribute", ["cells", "errors", "verified_max_abs_error", "verified_max_rel_error"])
def test_attributes_of_a_block_are_needed_and_covered_by_the_checksum(copy: Path, attribute: str) -> None:
    with netCDF4.Dataset(str(copy), "a") as root:
        block = root["border/blocks/corner"]
        block.setncattr(attribute, 2 * np.asarray(block.getncattr(attribute)))
    with pytest.raises(TableError, match=r"checksum does not match|the shape of 'cell_errors' is \(3, 40, 3\)"):
        Surrogate.open(copy)
    with netCDF4.Dataset(str(copy), "a") as root:
        root["border/blocks/corner"].delncattr(attribute)
    with pytest.raises(TableError, match=f"attribute '{attribute}' of /border/blocks/corner is missing"):
        Surrogate.open(copy)


# --- one atlas ----------------------------------------------------------------------------------------


def foreign(path: Path, change: Callable[[Table], None]) -> Path:
    """The intact table with a change, written to ``path`` with a matching checksum."""
    table = read_table(TABLE)
    change(table)
    write_table(table, path)
    return path


@pytest.mark.parametrize("index", range(len(CHARTS)), ids=NAMES)
@pytest.mark.parametrize("axis", ["a", "b"])
def test_nodes_of_another_chart_are_refused_whatever_the_checksum(tmp_path: Path, index: int, axis: str) -> None:
    def move(table: Table) -> None:
        # the last digit may be that of another mathematical library
        own = getattr(CHARTS[index], axis)
        getattr(table.blocks[index], axis)[0] += 2e-15 * max(abs(own.low), abs(own.high))

    path = foreign(tmp_path / "foreign.nc", move)
    name = getattr(CHARTS[index], axis).name
    with pytest.raises(TableError, match=f"{NAMES[index]}: the nodes of '{name}' are not those of this program's"):
        read_table(path)


@pytest.mark.parametrize("index", range(len(BORDER_PIECES)))
def test_nodes_of_another_border_are_refused_whatever_the_checksum(tmp_path: Path, index: int) -> None:
    def move(table: Table) -> None:
        table.border[index].nodes *= 1.0 + 2e-14

    path = foreign(tmp_path / "foreign.nc", move)
    with pytest.raises(TableError, match=r"the nodes of .* are not those of this program's chart"):
        read_table(path)


@pytest.mark.parametrize("change", ["moved seam", "another quantity", "another regime", "another name", "another axis"])
@pytest.mark.parametrize("block", ["continuous_mid_1", "stick_slip_mid", "corner"])
def test_another_atlas_is_refused_whatever_the_checksum(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: str, block: str
) -> None:
    """A release with other charts writes a table and its checksum; this one refuses it and names the difference."""
    index = NAMES.index(block)
    old = CHARTS[index]
    new, told = {
        "moved seam": (replace(old, a=replace(old.a, high=old.a.high * 1.25)), f"{block}: range_of_a is"),
        "another quantity": (replace(old, quantity="mu_ratio^2"), f"{block}: quantity is 'mu_ratio.2'"),
        "another regime": (
            replace(old, regime=1 - old.regime),
            f"{block}: regime is '{charts.REGIMES[1 - old.regime]}'",
        ),
        "another name": (replace(old, name="middle"), "block 'middle' is unknown"),
        "another axis": (replace(old, b=replace(old.b, name="inverse_y")), "variable .* is missing"),
    }[change]
    table = read_table(TABLE)
    part = table.blocks[index]
    for held in (part.nodes, part.cell_errors):  # the stick fraction, in stick-slip only
        some = held["power"]
        for about in charts.QUANTITIES:
            held[about.name] = held.get(about.name, some)
            if not new.holds(about):
                del held[about.name]
    part.a, part.b = (nodes(x.size, axis.low, axis.high) for x, axis in ((part.a, new.a), (part.b, new.b)))
    with monkeypatch.context() as other:
        other.setattr(charts, "CHARTS", (*CHARTS[:index], new, *CHARTS[index + 1 :]))
        other.setattr(charts, "NAMES", tuple(chart.name for chart in charts.CHARTS))
        checksum = write_table(table, tmp_path / "other.nc")
        assert read_table(tmp_path / "other.nc").attributes["content_sha256"] == checksum  # valid there
    with pytest.raises(TableError, match=told):
        read_table(tmp_path / "other.nc")


def test_a_border_of_another_range_is_refused_whatever_the_checksum(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = read_table(TABLE)
    name, axis, quantity = BORDER_PIECES[2]
    wider = replace(axis, high=2.0 * axis.high)
    table.border[2].nodes = nodes(table.border[2].nodes.size, wider.low, wider.high)
    with monkeypatch.context() as other:
        other.setattr(charts, "BORDER_PIECES", (*BORDER_PIECES[:2], (name, wider, quantity)))
        write_table(table, tmp_path / "other.nc")
        read_table(tmp_path / "other.nc")
    with pytest.raises(TableError, match="high: range is"):
        read_table(tmp_path / "other.nc")


def test_one_checksum_covers_every_number_that_takes_part(tmp_path: Path) -> None:
    sound = read_table(TABLE)
    seen = {write_table(sound, tmp_path / "sound.nc")}

    def shift(x: Array) -> None:
        x.flat[x.size // 2] = np.nextafter(x.flat[x.size // 2], np.inf)

    def changes() -> Iterator[Callable[[Table], None]]:
        for name in ("v_tilde", "y_tilde", "mu_ratio", "stick_fraction", "error_estimate", "v_tilde_crit"):
            yield lambda t, name=name: shift(getattr(t, name))
        yield lambda t: t.attributes.update(tolerance=2e-4)
        for i in range(len(BORDER_PIECES)):
            yield lambda t, i=i: shift(t.border[i].values)
            yield lambda t, i=i: setattr(t.border[i], "cells", t.border[i].cells + 1)
            yield lambda t, i=i: setattr(t.border[i], "max_rel_error", 1e-3)
        for i in range(len(CHARTS)):
            for name in sound.blocks[i].nodes:
                yield lambda t, i=i, name=name: shift(t.blocks[i].nodes[name])
                yield lambda t, i=i, name=name: shift(t.blocks[i].cell_errors[name])
            for name in sound.quantities:
                for k in range(3):
                    yield lambda t, i=i, name=name, k=k: t.blocks[i].errors[name].__setitem__(k, 0.123)
            yield lambda t, i=i: setattr(t.blocks[i], "cells", (t.blocks[i].cells[0], t.blocks[i].cells[1] + 1))
            yield lambda t, i=i: setattr(t.blocks[i], "max_abs_error", 0.5)
            yield lambda t, i=i: setattr(t.blocks[i], "max_rel_error", 0.5)

    count = 1
    for change in changes():
        table = deepcopy(sound)
        change(table)
        seen.add(_digest(table))
        count += 1
    assert len(seen) == count > 150


def older(table: Table) -> Table:
    """As written before quantities had names and cells errors: errors of slopes hold for a block, three together."""
    del table.attributes["quantities"]
    for block in table.blocks:
        for name, errors in block.cell_errors.items():
            block.errors[name][1:] = errors.max()
        block.cell_errors = {}
    return table


def test_a_table_without_names_of_quantities_and_errors_of_cells_opens(tmp_path: Path) -> None:
    write_table(older(read_table(TABLE)), tmp_path / "older.nc")
    with h5py.File(tmp_path / "older.nc") as root:
        assert "quantities" not in root.attrs
        assert "cell_errors" not in root["border/blocks"]
    opened, sound = Surrogate.open(tmp_path / "older.nc"), Surrogate.open(TABLE)
    assert opened.table.quantities == sound.table.quantities == ["mu_ratio", "power", "stick_fraction"]
    rng = np.random.default_rng(4)
    v, y = 10.0 ** rng.uniform(-6.0, 4.0, 3000), 10.0 ** rng.uniform(-4.0, 6.0, 3000)
    for name in opened.table.quantities:
        for ours, theirs in zip(opened.quantity(name, v, y), sound.quantity(name, v, y), strict=True):
            np.testing.assert_array_equal(ours, theirs)
        ours, theirs = (np.array(table.slopes(v, y, name, bounds=True)) for table in (opened, sound))
        np.testing.assert_array_equal(ours[:3], theirs[:3])
        # a bound that holds for a whole block is the larger one
        assert np.all(ours[3:] >= theirs[3:])


def test_a_table_may_hold_fewer_quantities(tmp_path: Path) -> None:
    table = read_table(TABLE)
    table.attributes["quantities"] = "mu_ratio stick_fraction"
    for block in table.blocks:
        del block.nodes["power"], block.cell_errors["power"]
    write_table(table, tmp_path / "fewer.nc")
    opened, sound = Surrogate.open(tmp_path / "fewer.nc"), Surrogate.open(TABLE)
    assert opened.table.quantities == ["mu_ratio", "stick_fraction"]
    v, y = np.geomspace(1e-3, 10.0, 200), np.geomspace(10.0, 1e-3, 200)
    for name in opened.table.quantities:
        for ours, theirs in zip(opened.quantity(name, v, y), sound.quantity(name, v, y), strict=True):
            np.testing.assert_array_equal(ours, theirs)
    with pytest.raises(TableError, match=r"fewer\.nc: holds no power: build it anew"):
        opened.power(0.1, 0.5)
    with pytest.raises(InputError, match="of must be one of mu_ratio, stick_fraction"):
        opened.slopes(0.1, 0.5, of="power")


@pytest.mark.parametrize("names", ["", "power mu_ratio", "mu_ratio mu_ratio", "mu_ratio warmth"])
def test_quantities_that_are_unknown_or_in_disorder_are_refused(copy: Path, names: str) -> None:
    with netCDF4.Dataset(str(copy), "a") as root:
        root.setncattr("quantities", names)
    with pytest.raises(TableError, match=r"attribute 'quantities' is .*this program knows mu_ratio, power"):
        Surrogate.open(copy)


def test_an_error_of_a_cell_below_zero_is_refused_whatever_the_checksum(tmp_path: Path) -> None:
    def change(table: Table) -> None:
        table.blocks[CORNER].cell_errors["power"][0, 1] = -1e-300

    with pytest.raises(TableError, match="an error in 'cell_errors' is negative"):
        read_table(foreign(tmp_path / "foreign.nc", change))


def test_titles_are_not_part_of_the_checksum(tmp_path: Path) -> None:
    table = read_table(TABLE)
    before = table.attributes["content_sha256"]
    table.attributes["title"] = "a corrected title"
    assert write_table(table, tmp_path / "again.nc") == before


# --- hostile files ------------------------------------------------------------------------------------


@pytest.mark.parametrize("cells", [0, -1, 5000, 10**9])
@pytest.mark.parametrize("place", ["border", "block"])
def test_a_hostile_number_of_cells_is_refused_whatever_the_checksum(tmp_path: Path, place: str, cells: int) -> None:
    def change(table: Table) -> None:
        if place == "border":
            table.border[1].cells = cells
        else:
            table.blocks[CORNER].cells = (table.blocks[CORNER].cells[0], cells)

    path = foreign(tmp_path / "foreign.nc", change)
    with pytest.raises(TableError, match=f"cells must be whole numbers from 1 to {MOST_CELLS}"):
        read_table(path)


@pytest.mark.parametrize("attribute", ["cells", "errors"])
@pytest.mark.parametrize("value", ["many", 1.5, [1.0, 2.0, 3.0], np.nan, -1.0])
def test_attributes_that_are_none_are_refused(copy: Path, attribute: str, value: Any) -> None:
    with netCDF4.Dataset(str(copy), "a") as root:
        root["border/blocks/corner"].setncattr(attribute, value)
    with pytest.raises(TableError, match=r"copy\.nc"):
        read_table(copy)


def test_a_file_larger_than_any_table_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "large.nc"
    with path.open("wb") as stream:
        stream.truncate(MOST_BYTES + 1)
    with pytest.raises(TableError, match="more than any table"):
        read_table(path)


def test_a_table_of_format_2_is_refused_by_its_version(tmp_path: Path) -> None:
    """As written by earlier releases: three errors a block, two checksums, no ranges."""
    path = tmp_path / "old.nc"
    with netCDF4.Dataset(str(path), "w") as root:
        root.setncatts({"format_version": np.int32(2), "content_sha256": "0" * 64, "bounds_sha256": "0" * 64,
                        "tolerance": 1e-4})  # fmt: skip
        for name, size in (("v_tilde", 3), ("y_tilde", 2)):
            root.createDimension(name, size)
            root.createVariable(name, "f8", (name,))[:] = np.arange(1.0, size + 1.0)
        root.createVariable("mu_ratio", "f8", ("v_tilde", "y_tilde"))[:] = 0.5
        block = root.createGroup("border/blocks/corner")
        block.setncatts({"quantity_error": 1e-5, "power_error": 1e-5, "stick_error": 1e-5})
    with pytest.raises(TableError, match=r"old\.nc: format version 2, this program reads 3"):
        Surrogate.open(path)


def test_folders_and_older_formats_are_no_tables(tmp_path: Path) -> None:
    with pytest.raises(TableError, match="no such file"):
        Surrogate.open(tmp_path)
    path = tmp_path / "classic.nc"
    with netCDF4.Dataset(str(path), "w", format="NETCDF3_CLASSIC") as root:
        root.title = "not ours"
    with pytest.raises(TableError, match=r"not a mumacro table|not a readable netCDF-4 table"):
        Surrogate.open(path)


# --- writing ------------------------------------------------------------------------------------------


def test_every_number_comes_back(tmp_path: Path) -> None:
    sound = read_table(TABLE)
    write_table(sound, tmp_path / "again.nc")
    again = read_table(tmp_path / "again.nc")
    assert again.attributes == sound.attributes
    _same_numbers(again, sound)
    assert (tmp_path / "again.nc").stat().st_mode & 0o777 == 0o644


def test_the_same_numbers_give_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one.nc", "two.nc"):
        write_table(read_table(TABLE), tmp_path / name)
    assert (tmp_path / "one.nc").read_bytes() == (tmp_path / "two.nc").read_bytes()


def test_a_write_that_fails_half_way_leaves_the_old_file_and_nothing_else(copy: Path) -> None:
    """A limit on file sizes simulates a full disk."""
    resource = pytest.importorskip("resource")
    sound, before = read_table(copy), copy.read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limits[1]))
    try:
        with pytest.raises(TableError, match=r"copy\.nc: cannot be (made|written)"):
            write_table(sound, copy)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert copy.read_bytes() == before
    assert list(copy.parent.iterdir()) == [copy]


def _small_disc(path: Path) -> bool:
    """Mount 64 kB of memory at ``path``; False if this user or machine does not allow it."""
    mount = shutil.which("mount")
    if mount is None:
        return False
    command = [mount, "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(path)]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


def test_a_full_disc_gives_an_error_and_leaves_nothing(tmp_path: Path) -> None:
    disc = tmp_path / "disc"
    disc.mkdir()
    if not _small_disc(disc):
        pytest.skip("mounting a small file system is not permitted here")
    try:
        (disc / "before.txt").write_text("kept")
        with pytest.raises(TableError, match=r"new\.nc: cannot be written: No space left on device"):
            write_table(read_table(TABLE), disc / "new.nc")
        assert [path.name for path in disc.iterdir()] == ["before.txt"]
        assert (disc / "before.txt").read_text() == "kept"
    finally:
        subprocess.run(["umount", str(disc)], check=True)


def test_a_write_that_is_interrupted_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", stop)
    with pytest.raises(KeyboardInterrupt):
        write_table(read_table(TABLE), tmp_path / "new.nc")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_as_output_is_refused(tmp_path: Path) -> None:
    (tmp_path / "taken.nc").mkdir()
    with pytest.raises(TableError, match="cannot be written"):
        write_table(read_table(TABLE), tmp_path / "taken.nc")
    assert [path.name for path in tmp_path.iterdir()] == ["taken.nc"]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="this user may write everywhere")
def test_a_folder_that_must_not_be_written_to(tmp_path: Path) -> None:
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    with pytest.raises(TableError, match="cannot be written: Permission denied"):
        write_table(read_table(TABLE), closed / "new.nc")


def test_every_variable_in_every_group_has_a_description() -> None:
    with xr.open_datatree(TABLE) as tree:
        assert tree.attrs["Conventions"] == "CF-1.11"
        assert tree.mu_ratio.attrs["ancillary_variables"] == "error_estimate"
        assert tree.attrs.keys() >= {
            "title", "summary", "history", "source", "references", "license", "product_version", "format_version",
            "tolerance", "verified_max_abs_error", "verified_max_rel_error", "n_solves", "builder_options",
            "content_sha256", "verified_max_stick_error", "verified_max_rel_power_error", "verified_max_slope_error",
        }  # fmt: skip
        seen = 0
        for node in tree.subtree:
            for variable in node.to_dataset(inherit=False).variables.values():
                assert variable.attrs["units"] == "1"
                assert variable.attrs["long_name"]
                assert "_FillValue" not in variable.encoding
                assert variable.dtype == np.float64
                seen += 1
        assert seen > 50

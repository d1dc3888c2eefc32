"""The table file in detail: numbers that change, parts that are gone, writes that fail half-way."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import xarray as xr

from friction import Surrogate, TableError
from friction.regions import BLOCKS, BORDER_PIECES
from friction.table import Table, read_table, write_table

TABLE = Path(__file__).parent.parent / "tables" / "mumacro-1e-4.nc"


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    return Path(shutil.copy(TABLE, tmp_path / "copy.nc"))


def test_a_byte_flipped_in_the_numbers_is_always_refused(copy: Path) -> None:
    whole, sound = TABLE.read_bytes(), read_table(TABLE)
    corner = next(block for spec, block in zip(BLOCKS, sound.blocks, strict=True) if spec.name == "corner")
    for numbers in (sound.border[0].values.tobytes(), sound.border[0].nodes.tobytes(), corner.a.tobytes()):
        place = whole.find(numbers)
        assert place > 0  # a handful of numbers is stored as it is
        for offset in range(0, len(numbers), 7):
            changed = bytearray(whole)
            changed[place + offset] ^= 1 << (offset % 8)
            copy.unlink()  # HDF5 may hold on to a file that it could not read; a new one is another file
            copy.write_bytes(changed)
            with pytest.raises(TableError, match=r"checksum|non-finite"):
                read_table(copy)


def test_a_byte_flipped_anywhere_is_refused_or_changes_nothing(copy: Path) -> None:
    """Headers, heaps and compressed numbers: what opens in spite of it holds the numbers of the sound table."""
    whole, sound = TABLE.read_bytes(), read_table(TABLE)
    refused = 0
    for offset in range(0, len(whole), 211):
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
    # a byte of slack and one that links variables to coordinates change no number
    assert refused > 0.8 * len(whole) / 211


def _same_numbers(one: Table, two: Table) -> None:
    for name in ("v_tilde", "y_tilde", "mu_ratio", "stick_fraction", "error_estimate", "v_tilde_crit"):
        assert np.array_equal(getattr(one, name), getattr(two, name))
    for low, high in zip(one.border, two.border, strict=True):
        assert np.array_equal(low.nodes, high.nodes)
        assert np.array_equal(low.values, high.values)
        assert (low.cells, low.max_rel_error) == (high.cells, high.max_rel_error)
    for left, right in zip(one.blocks, two.blocks, strict=True):
        for name in ("a", "b", "values", "power", "stick"):
            assert np.array_equal(getattr(left, name), getattr(right, name))
        for name in ("cells", "quantity_error", "max_abs_error", "max_rel_error", "power_error", "stick_error"):
            assert getattr(left, name) == getattr(right, name)


@pytest.mark.parametrize("name", [name for name, *_ in BORDER_PIECES] + [f"blocks/{spec.name}" for spec in BLOCKS])
def test_every_group_is_needed(copy: Path, name: str) -> None:
    with netCDF4.Dataset(str(copy), "a") as root:
        parent, _, last = f"border/{name}".rpartition("/")
        root[parent].renameGroup(last, "elsewhere")
    with pytest.raises(TableError, match=f"group '{last}' is missing"):
        Surrogate.open(copy)


@pytest.mark.parametrize("name", ["v_tilde", "y_tilde", "mu_ratio", "stick_fraction", "error_estimate", "v_tilde_crit"])
def test_every_variable_of_the_plain_grid_is_needed(copy: Path, name: str) -> None:
    with netCDF4.Dataset(str(copy), "a") as root:
        root.renameVariable(name, "renamed")
    with pytest.raises(TableError, match=f"variable '{name}' is missing in /"):
        Surrogate.open(copy)


@pytest.mark.parametrize("name", ["mu_ratio", "border/mid/value", "border/blocks/corner/stick"])
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


@pytest.mark.parametrize("attribute", ["cells", "quantity_error", "verified_max_abs_error"])
def test_attributes_of_a_block_are_needed_and_covered_by_the_checksum(copy: Path, attribute: str) -> None:
    with netCDF4.Dataset(str(copy), "a") as root:
        block = root["border/blocks/corner"]
        block.setncattr(attribute, 2 * np.asarray(block.getncattr(attribute)))
    with pytest.raises(TableError, match="checksum does not match"):
        Surrogate.open(copy)
    with netCDF4.Dataset(str(copy), "a") as root:
        root["border/blocks/corner"].delncattr(attribute)
    with pytest.raises(TableError, match="not a readable netCDF-4 table"):
        Surrogate.open(copy)


@pytest.mark.parametrize("attribute", ["power_error", "stick_error"])
def test_errors_of_the_companions_have_a_checksum_of_their_own(copy: Path, attribute: str) -> None:
    with netCDF4.Dataset(str(copy), "a") as root:
        block = root["border/blocks/corner"]
        block.setncattr(attribute, 2.0 * block.getncattr(attribute))
    with pytest.raises(TableError, match="checksum does not match the bounds"):
        Surrogate.open(copy)
    with netCDF4.Dataset(str(copy), "a") as root:
        root["border/blocks/corner"].delncattr(attribute)
    with pytest.raises(TableError, match="checksum does not match the bounds"):
        Surrogate.open(copy)


def test_a_table_without_bounds_of_power_and_stick_fraction_loads_and_has_none(tmp_path: Path) -> None:
    """As the builder wrote them before it measured these errors: the content and its checksum are the same."""
    old = read_table(TABLE)
    for block in old.blocks:
        block.power_error = block.stick_error = None
    for name in ("verified_max_stick_error", "verified_max_rel_power_error"):
        del old.attributes[name]
    path = tmp_path / TABLE.name
    write_table(old, path)
    with netCDF4.Dataset(str(path)) as root:
        assert "bounds_sha256" not in root.ncattrs()
        assert "power_error" not in root["border/blocks/corner"].ncattrs()
    one, two = Surrogate.open(path), Surrogate.open(TABLE)
    assert one.checksum == two.checksum == one.seal != two.seal
    assert one.power_with_bound(0.1, 0.5) == (two.power(0.1, 0.5), None)
    assert one.stick_fraction_with_bound(0.1, 0.5) == (two.stick_fraction(0.1, 0.5), None)
    values, bounds = one.power_with_bound(np.array([0.1, 2.0]), 0.5)
    assert values.shape == (2,)
    assert bounds is None
    one.warm_up()
    assert one.blocks[0]["power_error"] is None


def test_cells_must_be_there(tmp_path: Path) -> None:
    loaded = read_table(TABLE)
    loaded.border[1].cells = 0
    write_table(loaded, tmp_path / "none.nc")
    with pytest.raises(TableError, match="shapes of nodes and values disagree"):
        read_table(tmp_path / "none.nc")


def test_folders_and_older_formats_are_no_tables(tmp_path: Path) -> None:
    with pytest.raises(TableError, match="no such file"):
        Surrogate.open(tmp_path)
    path = tmp_path / "classic.nc"
    with netCDF4.Dataset(str(path), "w", format="NETCDF3_CLASSIC") as root:
        root.title = "not ours"
    with pytest.raises(TableError, match="not a mumacro table"):
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
    """A limit on the size of files stands in for a full disc."""
    resource = pytest.importorskip("resource")
    sound, before = read_table(copy), copy.read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limits[1]))
    try:
        with pytest.raises(TableError, match=r"copy\.nc: cannot write: File too large"):
            write_table(sound, copy)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert copy.read_bytes() == before
    assert list(copy.parent.iterdir()) == [copy]


def test_reading_does_without_the_library_that_writes() -> None:
    program = f"import sys, friction; friction.Surrogate.open({str(TABLE)!r}); print('h5py' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_a_write_that_is_interrupted_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", stop)
    with pytest.raises(KeyboardInterrupt):
        write_table(read_table(TABLE), tmp_path / "new.nc")
    assert list(tmp_path.iterdir()) == []


def test_where_a_folder_stands_no_table_is_written(tmp_path: Path) -> None:
    (tmp_path / "taken.nc").mkdir()
    with pytest.raises(TableError, match="cannot write"):
        write_table(read_table(TABLE), tmp_path / "taken.nc")
    assert [path.name for path in tmp_path.iterdir()] == ["taken.nc"]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="nothing is forbidden to this user")
def test_a_folder_that_must_not_be_written_to(tmp_path: Path) -> None:
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    with pytest.raises(TableError, match="cannot write here: Permission denied"):
        write_table(read_table(TABLE), closed / "new.nc")


def test_every_variable_in_every_group_says_what_it_is() -> None:
    with xr.open_datatree(TABLE) as tree:
        assert tree.attrs["Conventions"] == "CF-1.11"
        assert tree.mu_ratio.attrs["ancillary_variables"] == "error_estimate"
        assert tree.attrs.keys() >= {
            "title", "summary", "history", "source", "references", "license", "product_version", "format_version",
            "tolerance", "verified_max_abs_error", "verified_max_rel_error", "n_solves", "builder_options",
            "content_sha256", "bounds_sha256", "verified_max_stick_error", "verified_max_rel_power_error",
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

"""The table file: its contents, refused files, and killed builds."""

import os
import signal
import subprocess
import sys
import time

import netCDF4
import numpy as np
import pytest
import xarray as xr

from builder.assemble import build_table
from builder.rounding import STEPS
from builder.sweep import Sweep
from mumacro import Surrogate, TableError
from mumacro.table import read_table, write_table

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def source(repository):
    return repository / "tables" / "mumacro-1e-7.nc"


@pytest.fixture
def copy(source, tmp_path):
    path = tmp_path / "copy.nc"
    path.write_bytes(source.read_bytes())
    return path


def test_a_person_plots_it_in_one_line(source):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    with xr.open_dataset(source) as data:
        assert data.mu_ratio.dims == ("v_tilde", "y_tilde")
        data.mu_ratio.plot()
        for variable in data.variables.values():
            assert variable.attrs["units"] == "1"
            assert variable.attrs["long_name"]
            assert "_FillValue" not in variable.encoding
        ratio = data.v_tilde.values[1:] / data.v_tilde.values[:-1]
        assert np.allclose(ratio, ratio[0])
    with xr.open_datatree(source) as tree:
        assert "corner" in tree["border/blocks"].children
        assert {"low", "mid", "high"} < set(tree["border"].children)


def test_the_plain_grid_is_solved(source, sweep):
    with xr.open_dataset(source) as data:
        solved = sweep.solve("full", data.v_tilde.values[:, None], data.y_tilde.values[None, :])
        # to the digits stored in the file, with the error stated there
        np.testing.assert_allclose(data.mu_ratio.values, solved["mu_ratio"], rtol=data.tolerance / STEPS, atol=0.0)
        assert np.all(np.abs(data.mu_ratio.values - solved["mu_ratio"]) <= data.error_estimate.values)
        stick = solved["stick_fraction"]
        np.testing.assert_allclose(data.stick_fraction.values, stick, rtol=data.tolerance / STEPS, atol=1e-9)


def test_round_trip(source, tmp_path):
    table = read_table(source)
    before = table.attributes["content_sha256"]
    assert write_table(table, tmp_path / "again.nc") == before
    assert read_table(tmp_path / "again.nc").attributes["content_sha256"] == before


def _edit(path, change):
    with netCDF4.Dataset(str(path), "a") as root:
        change(root)


DAMAGES = {
    "another version": (
        lambda r: r.setncattr("format_version", np.int32(99)),
        "format version 99, this program reads 3",
    ),
    "a changed value": (lambda r: r["border/blocks/corner/value"].__setitem__((0, 0), 0.5), "checksum"),
    "a changed tolerance": (lambda r: r.setncattr("tolerance", 1e-15), "checksum"),
    "a non-finite value": (lambda r: r["border/low/value"].__setitem__(0, np.nan), "non-finite"),
    "no version": (lambda r: r.delncattr("format_version"), "not a mumacro table"),
    "a renamed group": (lambda r: r["border"].renameGroup("mid", "middle"), "group 'mid' is missing"),
    "a renamed variable": (lambda r: r["border/low"].renameVariable("value", "values"), "variable 'value' is missing"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_table_is_refused_by_name(copy, damage):
    change, reason = DAMAGES[damage]
    _edit(copy, change)
    with pytest.raises(TableError, match=reason) as caught:
        Surrogate.open(copy)
    assert str(copy) in str(caught.value)


@pytest.mark.parametrize("keep", [0, 100, 5_000, 50_000, 100_000])
def test_a_truncated_table_is_refused(copy, keep):
    copy.write_bytes(copy.read_bytes()[:keep])
    with pytest.raises(TableError, match=r"copy\.nc"):
        Surrogate.open(copy)


def test_foreign_files_are_refused(tmp_path):
    text = tmp_path / "text.nc"
    text.write_text("mu_macro,0.3\n")
    foreign = tmp_path / "foreign.nc"
    with netCDF4.Dataset(str(foreign), "w") as root:
        root.createDimension("x", 2)
    for path, reason in (
        (text, "not a readable"),
        (foreign, "not a mumacro table"),
        (tmp_path / "no.nc", "no such file"),
    ):
        with pytest.raises(TableError, match=reason):
            Surrogate.open(path)


def test_no_file_is_left_where_none_can_be_written(source, tmp_path):
    with pytest.raises(TableError, match="cannot be written"):
        write_table(read_table(source), tmp_path / "no" / "such" / "table.nc")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_workers_do_not_change_the_data(tmp_path):
    sums = []
    for workers in (1, 3):
        with Sweep(workers) as sweep:
            sums.append(build_table(tmp_path / f"{workers}.nc", 1e-3, sweep).checksum)
    assert sums[0] == sums[1]


@pytest.mark.slow
def test_a_killed_build_resumes_to_the_same_data(tmp_path, repository):
    out = tmp_path / "killed.nc"
    command = [sys.executable, "-m", "builder", "build", "--tolerance", "1e-3", "--out", str(out)]
    process = subprocess.Popen(command, cwd=repository, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    checkpoint = tmp_path / "killed.nc.checkpoint"
    deadline = time.monotonic() + 120
    while not (checkpoint.is_dir() and len(list(checkpoint.glob("*.npy"))) >= 3):
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.01)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert not out.exists()
    assert subprocess.run(command, cwd=repository, capture_output=True, check=False).returncode == 0
    with Sweep(2) as sweep:
        whole = build_table(tmp_path / "whole.nc", 1e-3, sweep)
    assert Surrogate.open(out).checksum == whole.checksum
    assert sorted(p.name for p in tmp_path.iterdir()) == ["killed.nc", "whole.nc"]

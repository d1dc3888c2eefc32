"""The committed tables as files: conventions, size, and plausible numbers."""

import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from builder.rounding import STEPS

TABLES = sorted((Path(__file__).parent.parent / "tables").glob("*.nc"))
#: format 3, written by the netCDF library
BYTES = {"mumacro-1e-4": 135_000, "mumacro-1e-7": 215_000, "mumacro-1e-10": 360_000, "mumacro-1e-12": 450_000}
SCRIPT = Path(sys.executable).parent / "compliance-checker"


@pytest.mark.slow
def test_tables_follow_the_cf_conventions() -> None:
    assert len(TABLES) >= 2
    # the checker brings its own table of standard names: no network
    done = subprocess.run([SCRIPT, "--test=cf:1.11", *TABLES], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("All tests passed!") == len(TABLES)
    assert "exceptions occurred" not in done.stdout + done.stderr


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_files_are_small(path: Path) -> None:
    assert path.stat().st_size <= BYTES[path.stem]
    with h5py.File(path) as root:
        variables: list[h5py.Dataset] = []
        root.visititems(lambda _, item: variables.append(item) if isinstance(item, h5py.Dataset) else None)
        numbers = sum(variable.id.get_storage_size() for variable in variables)
    # names, units, links, groups: contents other than numbers
    assert path.stat().st_size - numbers <= 2_300 * len(variables)


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_plain_grid_reads_like_the_surface(path: Path) -> None:
    with xr.open_dataset(path) as data:
        mu = data.mu_ratio.values
        assert np.all((mu > 0.0) & (mu <= 1.0))
        assert np.all(np.diff(mu, axis=0) >= -1e-15)  # along v~; in the static limit neighbours are equal to rounding
        assert np.all(np.diff(mu, axis=1) <= 1e-15)
        stick = data.stick_fraction.values
        sliding = data.v_tilde.values[:, None] >= data.v_tilde_crit.values
        assert np.all((stick >= 0.0) & (stick < 1.0))
        assert np.all((stick == 0.0) == sliding)
        error = data.error_estimate.values
        assert np.all((error > 0.0) & (error < 1e-14 + mu * data.tolerance / STEPS))
        assert np.all(np.diff(data.v_tilde_crit.values) > 0.0)
        assert float(data.attrs["tolerance"]) == float(path.stem.removeprefix("mumacro-"))
        assert data.mu_ratio.sel(v_tilde=1e-3, y_tilde=1e3, method="nearest") < 1e-5
        assert data.mu_ratio.sel(v_tilde=1e3, y_tilde=1e-3, method="nearest") > 1.0 - 1e-11

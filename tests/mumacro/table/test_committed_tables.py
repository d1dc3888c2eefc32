"""The committed tables: tolerance, bounds, seams and slopes against fresh solves and references;
size and contents."""

import csv
import json
import math
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr

from builder.solver.steady import solve
from builder.solver.sweep import Sweep
from builder.tables.contacts import spring
from builder.tables.draws import SEAMS
from builder.tables.quantities import ABS_TO_REL, STICK_NOISE, solver_noise
from builder.tables.rounding import STEPS, round_block
from builder.tables.verify import holds, monotony, seam_jumps, seam_slope_jumps, verify
from mumacro import Surrogate, TableError
from mumacro.inputs.fields import FIELDS
from mumacro.surrogate import KNOWN_CONTINUOUS, KNOWN_STICK_SLIP
from mumacro.table.atlas import CONTINUOUS, QUANTITY_NAMES, REGIME_OF_SOURCE, REGIMES
from mumacro.table.blocks import INTERPOLATIONS
from mumacro.table.netcdf import read_table
from tests.support.cases import Array, tables
from tests.support.comparing import close
from tests.support.nightly import nightly
from tests.support.places import ROOT
from tests.support.scripts import script

#: the most bytes of a file
BYTES = {
    "mumacro-1e-4": 263_000,
    "mumacro-1e-7": 422_000,
    "mumacro-1e-10": 691_000,
    "mumacro-1e-12": 781_000,
}
PATHS = [ROOT / "tables" / f"{name}.nc" for name in BYTES]
CHECK_VALUES = ROOT / "tests" / "data" / "check_values.csv"
table = tables()
fine = tables(1e-10)


# --- against fresh solves -------------------------------------------------------------------------


def compare(table: Surrogate, sweep: Sweep, v: Array, y: Array) -> Array:
    """Assert that fresh solves lie within tolerance and bounds; the bounds of the stick
    fraction."""
    solved = sweep.solve("full", v, y)
    for name in QUANTITY_NAMES:
        value, bound, source = table.quantity(name, v, y)
        error = np.abs(value - solved[name])
        assert np.all(
            error
            <= bound + solver_noise(name, v, y, solved, REGIME_OF_SOURCE[source] == CONTINUOUS)
        )
        if name == "mu_ratio":
            assert error.max() <= table.tolerance
            assert (error / solved[name]).max() <= ABS_TO_REL * table.tolerance
    return np.asarray(bound)


@pytest.mark.slow
@pytest.mark.parametrize("n", [8000, nightly(40_000)])
def test_fresh_solves_lie_within_tolerance_and_bounds(
    n: int, table: Surrogate, sweep: Sweep
) -> None:
    """Values and slopes of every quantity, at points of every kind.

    tests/builder/tables/test_verify.py tries the verifier itself.
    """
    report = verify(table, spring(sweep), n, seed=77)
    assert holds(report, table.tolerance)
    # the stated errors are those at other points: of slopes ten lie beyond 99 %, and the median is
    # where closed forms answer
    assert report["distribution"].keys() == table.error_distribution.keys()
    for name, part in report["distribution"].items():
        stated = table.error_distribution[name]
        for error, share in zip(part["error_quantiles"][1:3], ("0.95", "0.99"), strict=True):
            assert stated[share] / 2.5 - 1e-13 <= error <= 2.5 * stated[share] + 1e-13, name


def test_bounds_hold_on_the_border_in_the_corner_and_at_creeping_speeds(
    table: Surrogate, sweep: Sweep
) -> None:
    y = np.geomspace(1e-4, 1e12, 40)
    crit = table.v_tilde_crit(y)
    for distance in (0.0, 1e-15, 1e-13, 1e-10, 1e-7, 1e-4, 1e-2):
        for side in (-1.0, 1.0):
            of_stick = compare(table, sweep, crit * (1.0 + side * distance), y)
            assert (
                of_stick.max()
                <= 0.7 * math.sqrt(table.border.max_rel_error + 2e-15) + 30.0 * table.tolerance
            )
    assert table.quantity("stick_fraction", 2.0 * crit, y)[:2][1].max() == 0.0
    v = np.geomspace(1e-12, 1e-2, 30)[:, None]
    gaps = np.concatenate([-np.geomspace(1e-12, 0.2, 12), [0.0], np.geomspace(1e-12, 0.4, 12)])
    compare(table, sweep, *(a.ravel() for a in np.broadcast_arrays(v, 1.0 + gaps)))
    compare(
        table, sweep, *(a.ravel() for a in np.broadcast_arrays(v, np.geomspace(1e-2, 1e12, 30)))
    )
    # one digit of y~ changes mu~ by at most the root of two digits, also at the cusp
    assert (
        table.quantity("mu_ratio", np.geomspace(1e-300, 1e-9, 400), 1.0)[1].max()
        <= 1e-7 + table.tolerance
    )


def test_the_reference_lies_within_tolerance_and_bounds(table: Surrogate, reference: Any) -> None:
    """The independent solver, in quadruple precision."""
    mu, bound, source = table.quantity("mu_ratio", reference.v, reference.y)
    error = np.abs(mu - reference.mu_ratio)
    assert error.max() <= table.tolerance
    assert (error / reference.mu_ratio).max() <= ABS_TO_REL * table.tolerance
    assert np.all(error <= bound)
    wrong = np.array(REGIMES)[REGIME_OF_SOURCE[source]] != reference.regime
    # the label can be wrong only within the error of the stored border
    distance = np.abs(reference.v / table.v_tilde_crit(reference.y) - 1.0)
    assert np.all(distance[wrong] <= table.border.max_rel_error)
    stick, bound = table.quantity("stick_fraction", reference.v, reference.y)[:2]
    assert np.all(np.abs(stick - reference.stick_fraction) <= bound + STICK_NOISE)


def test_the_check_values_for_ports_are_made_by_their_script_of_references() -> None:
    pytest.importorskip("mpmath")
    assert CHECK_VALUES.read_text("utf-8") == script("benchmarks.check_values").text()


def test_a_table_meets_the_check_values_of_six_inputs_within_its_bounds(table: Surrogate) -> None:
    with CHECK_VALUES.open(newline="", encoding="utf-8") as stream:
        rows = [row for row in csv.DictReader(stream) if row["quantity"] == "mu_macro"]
    assert rows
    for row in rows:  # the others are the reference itself
        case = {name: math.inf if row[name] == "rigid" else float(row[name]) for name in FIELDS}
        answer = table.evaluate(case)
        assert abs(answer.mu_macro - float(row["value"])) <= answer.error_bound + float(
            row["tolerance"]
        ), row


def test_known_answers_are_the_models_and_a_wrong_table_does_not_meet_them() -> None:
    assert solve(0.1, 0.5).mu_ratio == close(KNOWN_STICK_SLIP, abs=2e-16)
    assert solve(2.0, 1.0).mu_ratio == close(KNOWN_CONTINUOUS, abs=2e-16)
    for path in PATHS:
        Surrogate.open(path).self_check()
    wrong = read_table(PATHS[1])
    for block in wrong.contacts["spring"].blocks:
        block.nodes["mu_ratio"] *= 1.001
    with pytest.raises(TableError, match="known answer"):
        Surrogate(wrong, PATHS[1]).self_check()


# --- seams, limits, slopes ------------------------------------------------------------------------


def test_seams_are_invisible_and_mu_rises_with_speed_and_falls_with_amplitude(
    table: Surrogate,
) -> None:
    assert seam_jumps(table) <= 2.0 * ABS_TO_REL * table.tolerance
    # along lines 1e-2.7 apart in the logarithm, across all seams; smaller steps are not resolved
    assert monotony(table) <= 1e-15 + (table.tolerance if table.tolerance > 1e-9 else 0.0)
    for y in SEAMS:  # one digit on either side
        v = np.array([1e-9, 1e-3, 0.1, 0.5, 3.0, 40.0, 1e4])
        mu = np.stack(
            [table.mu_ratio(v, b) for b in (math.nextafter(y, 0.0), y, math.nextafter(y, math.inf))]
        )
        assert np.all(
            np.ptp(mu, axis=0) <= 2.0 * ABS_TO_REL * table.tolerance * mu.max(axis=0) + 1e-14
        )


def test_slopes_go_on_across_seams_and_stay_bounded_down_to_the_border(fine: Surrogate) -> None:
    assert seam_slope_jumps(fine, n=20_000) <= 1e-7
    y = np.geomspace(1e-3, 1e4, 300)
    crit = fine.v_tilde_crit(y)
    above = np.array(fine.slopes(crit * (1.0 + 1e-12), y)[1:])
    for distance in (1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13, 1e-15):
        below = np.array(fine.slopes(crit * (1.0 - distance), y)[1:])
        assert np.abs(below - above).max() <= 3e-6 + 3.0 * distance


# --- the files ------------------------------------------------------------------------------------


def test_every_committed_file_is_tested() -> None:
    assert sorted((ROOT / "tables").glob("*.nc")) == sorted(PATHS)


def test_the_stated_shares_of_errors_end_at_the_largest(table: Surrogate) -> None:
    for contact in table.table.contacts.values():
        stated = contact.error_distribution
        largest = stated["mu_ratio"]["1"]
        assert largest == contact.attributes["verified_max_abs_error"] <= contact.tolerance
        for part in stated.values():
            assert part["0.5"] <= part["0.95"] <= part["0.99"] <= part["1"]
            assert 1.0 <= part["least"] < part["median"] < part["largest"]
    assert table.error_distribution["border"]["1"] <= table.border.max_rel_error


def test_a_ball_has_the_tolerance_of_the_table_but_no_tighter_one_than_1e_10(
    table: Surrogate,
) -> None:
    assert table.table.contacts["ball"].tolerance == max(table.tolerance, 1e-10)


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_who_opens_the_plain_grid_reads_its_errors_and_not_those_of_the_blocks(
    path: Path, sweep: Sweep
) -> None:
    """Interpolated by xarray as its users do, at points of which the builder knows nothing."""
    rng = np.random.default_rng(5)
    with xr.open_dataset(path) as data:
        assert not {name for name in data.attrs if "tolerance" in name or "verified" in name}
        grid = data.mu_ratio.assign_coords(
            v_tilde=np.log(data.v_tilde), y_tilde=np.log(data.y_tilde)
        )
        least, largest = math.log(1e-3), math.log(1e3)
        points = rng.uniform(least, largest, (2, 10_000))
        # next to the corner, where mu~ has a cusp between the nodes
        points[:, -600:] = np.stack([np.full(600, least), rng.uniform(-0.2, 0.4, 600)])
        v, y = (xr.DataArray(x, dims="case") for x in points)
        truth = sweep.solve("full", np.exp(v.values), np.exp(y.values))["mu_ratio"]
        for method in INTERPOLATIONS:
            error = np.abs(grid.interp(v_tilde=v, y_tilde=y, method=method).values - truth)
            stated = read_table(path).interpolation_errors[method]
            assert 0.9 * stated["1"] < error.max() < 1.02 * stated["1"]
            # xarray finds the coefficients of its bicubic spline by iteration, to 1e-6
            for share in ("0.5", "0.99") if method == "linear" else ("0.99",):
                found = np.quantile(error[:-600], float(share))
                assert stated[share] / 2.0 < found < 2.0 * stated[share]
            assert stated["1"] > 1e4 * Surrogate.open(path).max_abs_error or "1e-4" in path.stem


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_files_are_small(path: Path) -> None:
    variables: list[h5py.Dataset] = []
    with h5py.File(path) as root:
        root.visititems(
            lambda _, item: variables.append(item) if isinstance(item, h5py.Dataset) else None
        )
        numbers = sum(variable.id.get_storage_size() for variable in variables)
    assert path.stat().st_size <= BYTES[path.stem]
    # names, units, links, groups: contents other than numbers
    assert path.stat().st_size - numbers <= 2_300 * len(variables)


def test_nodes_are_rounded_to_what_their_block_was_built_for(table: Surrogate) -> None:
    targets = json.loads(table.table.attributes["builder_options"])["block_targets"]
    for contact in table.table.contacts.values():
        for block, target in zip(contact.blocks, targets[contact.name], strict=True):
            rounded = round_block(block, target)
            for name, nodes in block.nodes.items():
                assert np.array_equal(nodes, rounded.nodes[name])


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_the_plain_grid_is_solved_and_reads_like_the_surface(path: Path, sweep: Sweep) -> None:
    with xr.open_dataset(path) as data:
        mu, stick, error = (
            data.mu_ratio.values,
            data.stick_fraction.values,
            data.error_estimate.values,
        )
        assert np.all((mu > 0.0) & (mu <= 1.0))
        # along v~; in the static limit neighbours are equal to rounding
        assert np.all(np.diff(mu, axis=0) >= -1e-15)
        assert np.all(np.diff(mu, axis=1) <= 1e-15)
        sliding = data.v_tilde.values[:, None] >= data.v_tilde_crit.values
        assert np.all((stick >= 0.0) & (stick < 1.0))
        assert np.all((stick == 0.0) == sliding)
        tolerance = Surrogate.open(path).tolerance
        assert tolerance == float(path.stem.removeprefix("mumacro-"))
        assert np.all((error > 0.0) & (error < 1e-14 + mu * tolerance / STEPS))
        assert np.all(np.diff(data.v_tilde_crit.values) > 0.0)
        for axis in (data.v_tilde.values, data.y_tilde.values):
            assert axis == close(np.geomspace(1e-3, 1e3, axis.size), rel=1e-13)
        solved = sweep.solve("full", data.v_tilde.values[::7, None], data.y_tilde.values[None, ::7])
        # to the digits stored in the file, with the error stated there
        assert np.all(np.abs(mu[::7, ::7] - solved["mu_ratio"]) <= error[::7, ::7])
        np.testing.assert_allclose(
            stick[::7, ::7], solved["stick_fraction"], rtol=tolerance / STEPS, atol=1e-9
        )

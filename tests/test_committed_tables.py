"""The committed tables: tolerance, bounds, seams, monotony and slopes, compared with fresh solves and the reference."""

import math
import threading

import numpy as np
import pytest

from builder.assemble import ABS_TO_REL, build_table
from builder.quantities import SOLVER_NOISE, STICK_NOISE, solver_noise
from builder.sweep import Sweep
from builder.verify import CASES, draw, monotony, seam_jumps, seam_slope_jumps
from comparing import close
from mumacro import InputError, Surrogate, TableError
from mumacro.charts import (
    CONTINUOUS,
    REGIME_OF_SOURCE,
    REGIMES,
    SOURCES,
    Y_CONT,
    Y_HIGH,
    Y_MID,
    Y_STICK_LO,
    Y_TAIL,
)
from mumacro.surrogate import KNOWN_CONTINUOUS, KNOWN_STICK_SLIP
from mumacro.table import read_table

TOLERANCES = ("1e-4", "1e-7", "1e-10", "1e-12")


@pytest.fixture(scope="module", params=TOLERANCES)
def table(request, repository):
    return Surrogate.open(repository / "tables" / f"mumacro-{request.param}.nc")


@pytest.fixture(scope="module")
def fine(repository):
    return Surrogate.open(repository / "tables" / "mumacro-1e-10.nc")


def test_every_committed_table_is_tested(repository):
    assert sorted(p.stem for p in (repository / "tables").glob("*.nc")) == sorted(f"mumacro-{t}" for t in TOLERANCES)


def test_reference_points_lie_within_tolerance_and_bound(table, reference):
    mu, bound, source = table.ratio_with_bound(reference.v, reference.y)
    error = np.abs(mu - reference.mu_ratio)
    assert error.max() <= table.tolerance
    assert (error / reference.mu_ratio).max() <= ABS_TO_REL * table.tolerance
    assert np.all(error <= bound)
    regime = np.array(REGIMES)[REGIME_OF_SOURCE[source]]
    wrong = regime != reference.regime
    # the label can be wrong only within the error of the stored border
    distance = np.abs(reference.v / table.v_tilde_crit(reference.y) - 1.0)
    assert np.all(distance[wrong] <= table.border.max_rel_error)


@pytest.mark.slow
@pytest.mark.parametrize("case", [name for name, _, _ in CASES])
def test_fresh_solves_lie_within_tolerance_and_bound(table, sweep, case):
    v, y = draw(case, 3000, table, seed=77)
    truth = sweep.solve("full", v, y)["mu_ratio"]
    mu, bound, _ = table.ratio_with_bound(v, y)
    error = np.abs(mu - truth)
    assert error.max() <= table.tolerance
    assert (error / truth).max() <= ABS_TO_REL * table.tolerance
    assert np.all(error <= bound + SOLVER_NOISE * truth)


@pytest.mark.slow
def test_bounds_are_not_excessive(table, sweep):
    """In each block the bound is within a factor of 30 of the largest error there."""
    v, y = draw("random", 30_000, table, seed=5)
    truth = sweep.solve("full", v, y)["mu_ratio"]
    mu, bound, source = table.ratio_with_bound(v, y)
    ratios = []
    for code in np.unique(source):
        at = source == code
        if SOURCES[code] in {"tail_fast", "corner"} or at.sum() < 100:
            continue  # closed forms have rounding errors only; the corner's bound also covers the last digit of y~
        ratios.append(np.median(bound[at]) / max(np.abs(mu - truth)[at].max(), 1e-15))
    assert np.median(ratios) <= 30.0


def test_seams_are_invisible(table):
    assert seam_jumps(table) <= 2.0 * ABS_TO_REL * table.tolerance


def test_slopes_go_on_across_seams(fine):
    assert seam_slope_jumps(fine, n=20_000) <= 1e-7


def test_mu_rises_with_speed_and_falls_with_amplitude(table):
    # along lines 1e-2.7 apart in the logarithm, across all seams; smaller steps are not resolved
    assert monotony(table) <= 1e-15 + (table.tolerance if table.tolerance > 1e-9 else 0.0)


def test_range_and_exact_ends(table):
    rng = np.random.default_rng(2)
    v, y = 10.0 ** rng.uniform(-300, 300, 20_000), 10.0 ** rng.uniform(-300, 300, 20_000)
    mu = table.mu_ratio(v, y)
    assert np.all((mu >= 0.0) & (mu <= 1.0))
    assert np.all(table.mu_ratio(v, 0.0) == 1.0)
    assert table.mu_ratio(math.inf, 2.0) == 1.0
    assert table.mu_ratio(0.0, 0.6) == close(0.8, rel=1e-15)
    assert table.mu_ratio(0.0, 1.0) == table.mu_ratio(0.0, 3.0) == 0.0


def test_static_limit_is_reached(table):
    for y in (0.1, 0.5, 0.74, 0.76, 0.9, 0.999):
        expected = math.sqrt((1.0 - y) * (1.0 + y))
        assert table.mu_ratio(1e-290, y) == close(expected, abs=table.tolerance)
    assert table.mu_ratio(1e-250, 2.0) == close(1.74344269e-250, rel=max(1e-8, 10 * table.tolerance))


def test_corner_follows_its_cube_root(table):
    for v in (1e-30, 1e-18, 1e-12):
        assert table.mu_ratio(v, 1.0) == close((math.pi * v) ** (1 / 3), rel=1e-7 + 10 * table.tolerance)


def test_one_digit_on_either_side_of_every_region_line(table):
    for y in (Y_STICK_LO, Y_CONT, Y_MID, Y_HIGH, Y_TAIL):
        around = [math.nextafter(y, 0.0), y, math.nextafter(y, math.inf)]
        for v in (1e-9, 1e-3, 0.1, 0.5, 3.0, 40.0, 1e4):
            mu = [table.mu_ratio(v, b) for b in around]
            assert max(mu) - min(mu) <= 2.0 * ABS_TO_REL * table.tolerance * max(mu) + 1e-14


@pytest.mark.slow
def test_slopes_agree_with_differences_of_the_full_model(fine, sweep):
    v, y = draw("random", 2000, fine, seed=9)
    keep = np.abs(np.log(v / fine.v_tilde_crit(y))) > 2e-3  # the stencil must not straddle the border's kink
    keep &= np.hypot(y - 1.0, np.cbrt(v)) > 0.1
    v, y = v[keep], y[keep]
    _, along_v, along_y = fine.slopes(v, y)
    h = 3e-4

    def shifted(a, b):
        return sweep.solve("full", v * math.exp(a), y * math.exp(b))["mu_ratio"]

    for slope, step in ((along_v, (1, 0)), (along_y, (0, 1))):
        one, two = [
            shifted(n * h * step[0], n * h * step[1]) - shifted(-n * h * step[0], -n * h * step[1]) for n in (1, 2)
        ]
        assert np.abs(slope - (8.0 * one - two) / (12.0 * h)).max() <= 1e-7


def test_slopes_stay_bounded_down_to_the_border(fine):
    y = np.geomspace(1e-3, 1e4, 300)
    crit = fine.v_tilde_crit(y)
    _, v_above, y_above = fine.slopes(crit * (1.0 + 1e-12), y)
    for distance in (1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13, 1e-15):
        _, v_below, y_below = fine.slopes(crit * (1.0 - distance), y)
        assert np.abs(v_below - v_above).max() <= 3e-6 + 3.0 * distance
        assert np.abs(y_below - y_above).max() <= 3e-6 + 3.0 * distance


def test_gradient_is_the_slope_of_the_answer(fine):
    base = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
    found = fine.evaluate(**base, gradient=True)
    for name, value in base.items():
        h = 1e-5 * value
        up, down = (fine.evaluate(**{**base, name: value + s * h}).mu_macro for s in (1, -1))
        assert found.gradient[name] == close((up - down) / (2 * h), rel=1e-6, abs=1e-12)
    columns = fine.evaluate(**{**base, "v0": np.array([0.01, 0.1])}, gradient=True)
    assert columns.gradient["y0"][0] == found.gradient["y0"]
    assert fine.evaluate(**{**base, "k": None}, gradient=True).gradient["k"] == 0.0


def test_gradient_at_the_edges(fine):
    base = {"mu0": 0.5, "Fz": 2.0, "k": 1.0, "y0": 0.5, "omega": 1.0, "v0": 0.0}
    static = fine.evaluate(**base, gradient=True).gradient
    assert static["v0"] == close(0.5 * math.pi / (2 * (1 - 0.25)), rel=1e-14)
    assert math.isinf(fine.evaluate(**{**base, "y0": 1.0}, gradient=True).gradient["v0"])
    above = fine.evaluate(**{**base, "y0": 2.0}, gradient=True).gradient
    assert above["v0"] == close(0.5 * 1.74344269, rel=1e-8)
    still = fine.evaluate(**{**base, "y0": 0.0, "v0": 1.0}, gradient=True).gradient
    assert still == {"mu0": 1.0, "Fz": 0.0, "k": 0.0, "y0": 0.0, "omega": 0.0, "v0": 0.0}


@pytest.mark.slow
@pytest.mark.parametrize("case", ["random", "creep", "corner", "seams"])
def test_power_and_stick_fraction(fine, sweep, case):
    v, y = draw(case, 2000, fine, seed=3)
    solved = sweep.solve("full", v, y)
    assert np.abs(fine.power(v, y) / solved["power"] - 1.0).max() <= 1e-6
    assert np.abs(fine.stick_fraction(v, y) - solved["stick_fraction"]).max() <= 1e-6


def inside(table, sweep, v, y):
    """Whether fresh solves lie within the bounds of power and stick fraction; and the bounds."""
    solved = sweep.solve("full", v, y)
    power, of_power = table.power_with_bound(v, y)
    stick, of_stick = table.stick_fraction_with_bound(v, y)
    source = table.ratio_with_bound(v, y)[2]
    noise = solver_noise("power", v, y, solved, REGIME_OF_SOURCE[source] == CONTINUOUS)
    assert np.all(np.abs(power - solved["power"]) <= of_power + noise)
    assert np.all(np.abs(stick - solved["stick_fraction"]) <= of_stick + STICK_NOISE)
    return of_power / power, of_stick


@pytest.mark.slow
@pytest.mark.slow
@pytest.mark.parametrize("case", [name for name, _, _ in CASES])
def test_fresh_solves_lie_within_the_bounds_of_power_and_stick_fraction(table, sweep, case):
    v, y = draw(case, 4000, table, seed=78)
    at = (v > 0.0) & (y > 0.0)
    inside(table, sweep, v[at], y[at])


@pytest.mark.slow
def test_bounds_of_power_and_stick_fraction_hold_on_the_border(table, sweep):
    y = np.geomspace(1e-4, 1e12, 120)
    crit = table.v_tilde_crit(y)
    for distance in (0.0, 1e-15, 1e-14, 1e-13, 1e-12, 1e-10, 1e-8, 1e-7, 1e-6, 1e-4, 1e-2):
        for side in (-1.0, 1.0):
            _, of_stick = inside(table, sweep, crit * (1.0 + side * distance), y)
            assert of_stick.max() <= 0.7 * math.sqrt(table.border.max_rel_error + 2e-15) + 30.0 * table.tolerance
    # far above it the bound is zero
    assert table.stick_fraction_with_bound(2.0 * crit, y)[1].max() == 0.0


@pytest.mark.slow
def test_bounds_of_power_and_stick_fraction_hold_in_the_corner_and_at_creeping_speeds(table, sweep):
    v = np.geomspace(1e-12, 1e-2, 60)[:, None]
    gaps = np.concatenate([-np.geomspace(1e-12, 0.2, 25), [0.0], np.geomspace(1e-12, 0.4, 25)])
    inside(table, sweep, *(a.ravel() for a in np.broadcast_arrays(v, 1.0 + gaps)))
    inside(table, sweep, *(a.ravel() for a in np.broadcast_arrays(v, np.geomspace(1e-2, 1e12, 60))))


def test_stick_fraction_of_the_reference_lies_within_its_bound(table, reference):
    """The independent solver, in quadruple precision."""
    stick, bound = table.stick_fraction_with_bound(reference.v, reference.y)
    assert np.all(np.abs(stick - reference.stick_fraction) <= bound + STICK_NOISE)


@pytest.mark.slow
def test_bounds_of_power_and_stick_fraction_are_not_excessive(table, sweep):
    v, y = draw("random", 30_000, table, seed=6)
    solved = sweep.solve("full", v, y)
    power, of_power = table.power_with_bound(v, y)
    stick, of_stick = table.stick_fraction_with_bound(v, y)
    source = table.ratio_with_bound(v, y)[2]
    of_both = {"power": [], "stick": []}
    for code in np.unique(source):
        at = source == code
        if at.sum() < 100 or SOURCES[code] == "tail_fast":
            continue
        worst = (np.abs(power - solved["power"]) / power)[at].max()
        of_both["power"].append(np.median((of_power / power)[at]) / max(worst, 1e-15))
        worst = np.abs(stick - solved["stick_fraction"])[at].max()
        if worst > 0.0:
            of_both["stick"].append(np.median(of_stick[at]) / max(worst, 1e-15))
    assert np.median(of_both["power"]) <= 30.0
    assert np.median(of_both["stick"]) <= 30.0


@pytest.mark.slow
def test_known_answers_agree_with_the_model(sweep):
    solved = sweep.solve("full", np.array([0.1, 2.0]), np.array([0.5, 1.0]))["mu_ratio"]
    assert solved[0] == close(KNOWN_STICK_SLIP, abs=2e-16)
    assert solved[1] == close(KNOWN_CONTINUOUS, abs=2e-16)


def test_self_check_refuses_a_wrong_table(repository):
    sound = Surrogate.open(repository / "tables" / "mumacro-1e-7.nc")
    sound.self_check()
    table = read_table(sound.path)
    for block in table.blocks:
        block.nodes["mu_ratio"] *= 1.001
    wrong = Surrogate(table, sound.path)
    with pytest.raises(TableError, match="known answer"):
        wrong.self_check()


def test_scalars_and_arrays_agree(fine):
    v, y = draw("wide", 500, fine, seed=1)
    assert np.array_equal(
        fine.mu_ratio(v, y), [fine.mu_ratio(a, b) for a, b in zip(v.tolist(), y.tolist(), strict=True)]
    )
    grid = fine.mu_ratio(v[:20, None], y[None, :30])
    assert grid.shape == (20, 30)
    assert grid[3, 4] == fine.mu_ratio(float(v[3]), float(y[4]))


def test_illegal_points(fine):
    assert np.isnan(fine.mu_ratio(np.array([-1.0, math.nan, 1.0]), np.array([1.0, 1.0, -1.0]))).all()
    with pytest.raises(InputError, match=r"v_tilde must be >= 0, got -1\.0"):
        fine.mu_ratio(-1.0, 1.0)
    with pytest.raises(InputError, match="y_tilde"):
        fine.mu_ratio(1.0, math.inf)


def test_threads_may_share_one_table(fine):
    v, y = draw("random", 20_000, fine, seed=4)
    expected, found = fine.mu_ratio(v, y), {}
    threads = [threading.Thread(target=lambda i=i: found.update({i: fine.mu_ratio(v, y)})) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(found[i], expected) for i in range(8))


@pytest.mark.slow
def test_the_smallest_table_is_what_the_builder_makes(repository, tmp_path):
    committed = Surrogate.open(repository / "tables" / "mumacro-1e-4.nc")
    with Sweep(workers=2) as sweep:
        again = build_table(tmp_path / "again.nc", 1e-4, sweep)
    for old, new in zip(committed.table.blocks, again.table.blocks, strict=True):
        assert old.cells == new.cells
        # the last digits depend on the processor's instructions
        for name in old.nodes:
            np.testing.assert_allclose(new.nodes[name], old.nodes[name], rtol=1e-12, atol=1e-14)
            # of the differences between cells and model: 3 binary digits, rounded up
            np.testing.assert_allclose(new.cell_errors[name], old.cell_errors[name], rtol=0.26)

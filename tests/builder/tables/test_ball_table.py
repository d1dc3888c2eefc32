"""The table of a ball: its solver, its charts and its hidden corners."""

import dataclasses
import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.special import ellipe, ellipk

from builder.solver.ball import NAMES, Ball, Springs
from builder.solver.sweep import Sweep
from builder.tables.build import SOLVED_BY, BuildError
from builder.tables.contacts import BALL_NOISE, SolvedContact, ball, ratio_of
from builder.tables.draws import DRAWS
from builder.tables.measure import block_errors
from builder.tables.verify import Neighbours, seam_jumps
from mumacro import Surrogate, closed_forms
from mumacro.inputs.fields import BALL
from mumacro.kernel.binding import kernels
from mumacro.table import bundled
from mumacro.table.atlas import CHARTS, MIDDLE, QUANTITY_NAMES, SLOW, STEEPEST, STEEPEST_Y
from mumacro.table.netcdf import read_table, write_table
from tests.support.cases import Array, opened
from tests.support.comparing import close
from tests.support.places import TABLES

COARSE = 1e-7


@pytest.fixture(scope="module")
def springs() -> Springs:
    return Springs(opened(1e-12))


@pytest.fixture(scope="module")
def contact(springs: Springs) -> SolvedContact:
    return ball(springs)


def wide(n: int, seed: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    return 10.0 ** rng.uniform(-8, 4, n), 10.0 ** rng.uniform(-5, 5, n)


# --- its springs ----------------------------------------------------------------------------------


def test_the_springs_of_a_ball_are_those_of_the_finest_table(sweep: Sweep) -> None:
    points = wide(20, 2)
    finest, coarse = (
        SOLVED_BY["ball"](opened(tolerance).table, COARSE, sweep).solve(*points)
        for tolerance in (1e-12, 1e-4)
    )
    for name in finest:
        assert np.array_equal(finest[name], coarse[name]), name


def test_springs_that_the_solver_does_not_give_end_a_build_with_advice(
    sweep: Sweep, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fine = opened(1e-12)
    entry = fine.table.contacts["spring"]
    nodes = {name: x + 1e-9 for name, x in entry.blocks[0].nodes.items()}
    changed = [dataclasses.replace(entry.blocks[0], nodes=nodes), *entry.blocks[1:]]
    path = tmp_path / "mumacro-1e-12.nc"
    contacts = fine.table.contacts | {"spring": dataclasses.replace(entry, blocks=changed)}
    table = dataclasses.replace(fine.table, contacts=contacts)
    with pytest.raises(BuildError, match=r"this table is not what the solver gives now"):
        SOLVED_BY["ball"](table, COARSE, sweep)
    write_table(table, path)
    monkeypatch.setattr(bundled, "bundled_tables", lambda: [path])
    coarse = opened(1e-4).table
    with pytest.raises(BuildError, match=r"not what the solver gives now; .* --tolerance 1e-12"):
        SOLVED_BY["ball"](coarse, COARSE, sweep)
    for left in ([], [TABLES / "mumacro-1e-7.nc"]):
        monkeypatch.setattr(bundled, "bundled_tables", lambda left=left: left)
        with pytest.raises(BuildError, match=r"table.*; a ball .* first: .* --tolerance 1e-12"):
            SOLVED_BY["ball"](coarse, COARSE, sweep)


# --- the solver -----------------------------------------------------------------------------------


def test_twice_the_points_give_the_same(springs: Springs, contact: SolvedContact) -> None:
    v, y = wide(60, 1)
    few, many = Ball(springs).solve(v, y), Ball(springs, 146).solve(v, y)
    for name in NAMES:
        noise = BALL_NOISE if name == "deficit" else contact.noise(name, v, y, many, False)
        assert np.all(np.abs(few[name] - many[name]) <= noise), name
    # each of both has its own digits
    np.testing.assert_allclose(few["deficit"] + few["mu_ratio"], 1.0, rtol=0.0, atol=2e-12)


def test_springs_that_are_solved_one_by_one_give_the_same(springs: Springs, sweep: Sweep) -> None:
    """Gauss's rule in halves of halves towards what is not smooth: another quadrature over another
    source."""
    x, weight = np.polynomial.legendre.leggauss(24)
    share = np.concatenate([[0.0], 0.5 ** np.arange(24, -1, -1)])
    for v, y in ((0.05, 0.4), (0.25, 0.9), (1e-3, 0.98), (0.4, 2.0), (3.0, 1.0)):
        ratio = np.array([v / y])
        ends = [0.0, 1.0]
        if ratio[0] < STEEPEST:
            ends += [math.sqrt(max(1.0 - y / at[0], 0.0)) for at in Ball(springs).crossings(ratio)]
        ends = sorted({*ends, math.sqrt(max(1.0 - y, 0.0))})
        summed = dict.fromkeys(QUANTITY_NAMES, 0.0)
        for left, right in itertools.pairwise(ends):
            half = 0.5 * (right - left)
            edges = np.concatenate([left + half * share, (right - half * share)[::-1][1:]])
            wide = 0.5 * np.diff(edges)[:, None]
            xi = (edges[:-1, None] + wide * (1.0 + x)).ravel()
            s = np.maximum((1.0 - xi) * (1.0 + xi), 1e-9)
            solved = sweep.solve("full", v / s, y / s)
            for name in QUANTITY_NAMES:
                load = MIDDLE * s * (MIDDLE * s if name == "power" else 1.0)
                summed[name] += float(((wide * weight).ravel() * load * solved[name]).sum())
        ours = Ball(springs).solve(np.array([v]), np.array([y]))
        for name in QUANTITY_NAMES:
            assert ours[name][0] == close(summed[name], abs=2e-11), (v, y, name)


def test_at_rest_it_is_the_closed_form_and_slides_like_a_rigid_contact(springs: Springs) -> None:
    y = np.array([1e-3, 0.1, 0.5, 0.9, 0.999])
    m = (1.0 - y) / (1.0 + y)
    still = np.sqrt(1.0 + y) * (ellipe(m) - y * ellipk(m))
    solved = Ball(springs).solve(np.full(y.size, 1e-17), y)
    np.testing.assert_allclose(solved["mu_ratio"], still, rtol=0.0, atol=3e-13)
    v = np.array([1e6, 1e7])
    fast = Ball(springs).solve(v, 0.7 * v)["mu_ratio"]
    np.testing.assert_allclose(fast, closed_forms.outer(0.7), rtol=0.0, atol=3e-12)


def test_next_to_the_ridge_the_last_crossing_is_an_edge(springs: Springs) -> None:
    """A ray leaves stick-slip below y~ = 1.5 there; a quadrature that runs across errs by 5e-12."""
    y = 0.9508120035041991
    v = 0.3178542013643792 * np.exp(np.linspace(-2e-3, 2e-3, 41))
    few, many = (Ball(springs, n).solve(v, np.full(v.size, y)) for n in (73, 146))
    assert np.abs(few["mu_ratio"] - many["mu_ratio"]).max() <= BALL_NOISE


# --- charts ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("index", range(len(CHARTS["ball"])))
def test_file_and_evaluation_agree_on_coordinates(index: int) -> None:
    table, chart = opened(1e-12), CHARTS["ball"][index]  # whose border is that of the charts
    rng = np.random.default_rng(index)
    a, b = (
        axis.low + (axis.high - axis.low) * rng.uniform(0.02, 0.98, 2000)
        for axis in (chart.a, chart.b)
    )
    v, y, _ = chart.point(a, b, table.border)
    block, at_a, at_b = kernels[-1].places(table.tabulated.data("mu_ratio", BALL), v, y, 1)
    here = block == index
    assert here.mean() > (0.2 if chart.name == "corner" else 0.95)
    for axis, x, at in ((chart.a, a, at_a), (chart.b, b, at_b)):
        np.testing.assert_allclose(axis.to_file(at[here]), x[here], rtol=0.0, atol=2e-12)
        np.testing.assert_allclose(
            axis.to_evaluation(x),
            axis.to_evaluation(axis.to_file(axis.to_evaluation(x))),
            rtol=0.0,
            atol=1e-14,
        )


# --- hidden corners -------------------------------------------------------------------------------


def beside(at: float, n: int, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    return np.asarray(at * (1.0 + rng.choice([-1.0, 1.0], n) * 10.0 ** rng.uniform(-12, -1, n)))


def on_the_ray_below_the_ridge(n: int) -> tuple[Array, Array]:
    """Where border and steepest ray differ by the last digits of v~, whose root counts in y~."""
    y = STEEPEST_Y * (1.0 - 10.0 ** np.linspace(-11.0, -7.0, n))
    return STEEPEST * y * (1.0 + 2.0**-52 * (np.arange(n) % 13 - 9)), y


CORNERS: dict[str, Any] = {
    "on the ray below the ridge": on_the_ray_below_the_ridge,
    "ridge": lambda n: (beside(SLOW, n, 1), beside(STEEPEST_Y, n, 2)),
    "gross slip at rest": lambda n: (10.0 ** np.linspace(-20, -1, n), beside(1.0, n, 3)),
    "corner at creep": lambda n: (beside(1e-9, n, 4), 1.0 + beside(1e-6, n, 5)),
    "steepest ray": lambda n: (beside(STEEPEST * 0.3, n, 6), np.full(n, 0.3)),
    "border at y~ 1.5": lambda n: (beside(STEEPEST, n, 7), beside(1.0, n, 8)),
    "creep below the ridge": lambda n: (beside(0.0202, n, 9), beside(1.879 / MIDDLE, n, 10)),
    "small": lambda n: (10.0 ** np.linspace(-14, -3, n), 10.0 ** np.linspace(-7, -2, n)),
}


@pytest.mark.parametrize("name", QUANTITY_NAMES)
@pytest.mark.parametrize("corner", CORNERS)
@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-10, 1e-12])
def test_no_error_is_beyond_its_bound(
    contact: SolvedContact, tolerance: float, corner: str, name: str
) -> None:
    table = opened(tolerance)
    v, y = contact.as_asked(*CORNERS[corner](60))
    solved = contact.solve(v, y)
    value, bound, _ = contact.quantity(table, name, v, y)
    noise = contact.noise(name, v, y, solved, False)
    assert np.all(np.abs(value - solved[name]) <= bound + noise)
    if name == "mu_ratio":
        assert np.abs(value - solved[name]).max() <= contact.of(table).tolerance


@pytest.mark.parametrize(
    "corner",
    ["ridge", "corner at creep", "steepest ray", "border at y~ 1.5", "creep below the ridge"],
)
def test_no_slope_is_beyond_its_bound(contact: SolvedContact, corner: str) -> None:
    table = opened(COARSE)
    v, y = contact.as_asked(*CORNERS[corner](40))
    truth, noise = Neighbours(table, contact, v, y).slopes("mu_ratio")
    rows = contact.slopes(table, "mu_ratio", v, y)
    assert np.all(np.abs(rows[1:3] - truth) <= rows[3:5] + noise)
    # on the steepest ray itself slopes are those on either side of it
    v = STEEPEST * y * (1.0 + np.array([-1e-13, 0.0, 1e-13])[:, None])
    line = np.broadcast_to(y, v.shape)
    along = contact.slopes(table, "mu_ratio", v.ravel(), line.ravel())[1].reshape(v.shape)
    if corner == "steepest ray":
        assert np.ptp(along, axis=0).max() <= 1e-4


@pytest.mark.parametrize("tolerance", [1e-7, 1e-10])
def test_power_at_large_speeds_is_known_in_closed_form(tolerance: float) -> None:
    """A quadrature's own error is within the bounds: powers here differ by 1e-13 of their value."""
    v, y = (
        np.array([3.97134e4, 6.36416e4, 6.06508e4, 1e5]),
        np.array([2.9556e5, 7.8218e5, 6.7737e5, 3e5]),
    )
    power, bound, _ = opened(tolerance).quantity("power", v, y, contact="ball")
    m = -((y / v) ** 2)
    first = 2.0 / math.pi * v * (ellipe(m) - ellipk(m))
    # the second term is that of one spring at v~ of the middle, times the mean of s^2
    spring, _, _ = opened(1e-12).quantity("power", v, y)
    exact = first + (spring - first) * MIDDLE**2 * 24.0 / 35.0
    assert np.all(np.abs(power - exact) <= bound + 2e-14 * exact)
    assert np.all(bound <= tolerance * exact)


def test_a_slope_where_the_border_has_a_knot_is_within_its_bound(contact: SolvedContact) -> None:
    """The border's pieces meet at y~ = 1.5, within a block of the ball."""
    table = opened(COARSE)
    y = 1.5 + np.linspace(-0.05, 0.01, 121)
    v, y = contact.as_asked(np.full(y.size, 0.1742), y)
    truth, noise = Neighbours(table, contact, v, y).slopes("mu_ratio")
    rows = contact.slopes(table, "mu_ratio", v, y)
    assert np.all(np.abs(rows[1:3] - truth) <= rows[3:5] + noise)


def test_seams_are_invisible() -> None:
    table = opened(COARSE)
    assert seam_jumps(table, 500, kind=BALL) <= 20.0 * table.tolerance
    rise = np.geomspace(1e-9, 1e7, 3000)
    for fixed in (1e-3, 0.1, 1.0, STEEPEST_Y, 30.0):
        along = ratio_of(table, BALL, rise, np.full(rise.size, fixed))
        assert np.diff(along).min() >= -table.tolerance


@pytest.mark.slow
def test_the_errors_that_are_measured_are_those_that_the_table_states(
    contact: SolvedContact,
) -> None:
    table = opened(1e-4)
    entry = contact.of(table)
    for chart, block, measured in zip(
        CHARTS["ball"], entry.blocks, block_errors(table, contact, 300, seed=4), strict=True
    ):
        assert measured.cells.keys() == block.nodes.keys()
        for name in block.nodes:
            cells = measured.cells[name]
            if name != "mu_ratio":  # some points of cells are in another block
                cells = np.minimum(cells, measured.values[name])
            assert np.all(cells <= block.cell_errors[name]), (chart.name, name)
            assert measured.values[name] <= block.errors[name][0], (chart.name, name)
            # where a stick fraction's own noise is larger than what the cells err by, none is left
            assert measured.values[name] > 0.0 or name == "stick_fraction", (chart.name, name)
        assert measured.absolute <= entry.tolerance


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-10, 1e-12])
def test_half_of_the_bounds_are_below_150_errors(tolerance: float) -> None:
    """Of what verification met: one error a block was up to 440 times the error at most points."""
    stated = opened(tolerance).table.contacts["ball"].error_distribution
    assert [*stated][:3] == ["mu_ratio", "power", "stick_fraction"]
    for name, ratio in stated.items():
        assert ratio["least"] >= 1.0, name
        assert ratio["median"] <= 150.0, name


@pytest.mark.parametrize("name", ["power", "stick_fraction"])
def test_an_error_in_a_cell_widens_the_bounds_in_that_cell_alone(name: str) -> None:
    table = read_table(opened(1e-4).path)
    v, y = DRAWS["ball"].cases["ring"][1](np.random.default_rng(5), 400, opened(1e-4))
    index = [chart.name for chart in CHARTS["ball"]].index("partial_slip_ring")
    errors = table.contacts["ball"].blocks[index].cell_errors[name]
    before = opened(1e-4).quantity(name, v, y, contact="ball")
    cell = int(errors[:, 0].argmax())
    errors[cell, 0] *= 3.0
    after = Surrogate(table, "wider.nc").quantity(name, v, y, contact="ball")
    np.testing.assert_array_equal(after[0], before[0])
    wider = after[1] > before[1]
    assert wider.any()
    assert not wider.all()
    np.testing.assert_array_equal(after[1][~wider], before[1][~wider])


def test_an_error_of_a_block_is_found(contact: SolvedContact) -> None:
    table = read_table(opened(1e-4).path)
    index = [chart.name for chart in CHARTS["ball"]].index("partial_slip_ring")
    table.contacts["ball"].blocks[index].nodes["mu_ratio"][-3:] *= 1.01
    wrong = Surrogate(table, "wrong.nc")
    v, y = DRAWS["ball"].cases["ring"][1](np.random.default_rng(1), 400, wrong)
    v, y = contact.as_asked(v, y)
    value, bound, _ = contact.quantity(wrong, "mu_ratio", v, y)
    assert np.any(np.abs(value - contact.solve(v, y)["mu_ratio"]) > bound)


# --- plain numbers --------------------------------------------------------------------------------

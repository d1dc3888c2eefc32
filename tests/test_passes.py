"""Many points at once against one by one: the same bits, for all positions and numbers of points."""

import math
from pathlib import Path

import numpy as np
import pytest
from mumacro.arithmetic import log, square_plus
from mumacro.outer import QUICK_MAX, outer_expansion, outer_quick
from numpy.typing import NDArray

from comparing import close
from mumacro import Surrogate, batch, charts, evaluate
from mumacro.charts import CHARTS, RHO_MAX, SIGMA_CUT, Y_CONT, Y_HIGH, Y_MID, Y_STICK_LO, Y_TAIL

Array = NDArray[np.float64]
CHUNK = evaluate.CHUNK


@pytest.fixture(scope="module", params=["mumacro-1e-4", "mumacro-1e-12"])
def table(request: pytest.FixtureRequest, tables_dir: Path) -> Surrogate:
    return Surrogate.open(tables_dir / f"{request.param}.nc")


def one_by_one(table: Surrogate, v: Array, y: Array) -> tuple[Array, Array, Array]:
    """The answers of the function for single points, which does not use passes."""
    found = np.array([evaluate.answer(charts.MU, a, b, *table._data) for a, b in zip(v, y, strict=True)])
    return found[:, 0], found[:, 1], found[:, 2]


def around(x: Array) -> Array:
    """``x`` and its neighbours among the doubles."""
    return np.concatenate([x, np.nextafter(x, 0.0), np.nextafter(x, np.inf)])


def same(table: Surrogate, v: Array, y: Array) -> None:
    mu, bound, source = one_by_one(table, v, y)
    many = table.ratio_with_bound(v, y)
    np.testing.assert_array_equal(many[2], source)
    np.testing.assert_array_equal(many[0], mu)
    np.testing.assert_array_equal(many[1], bound)
    np.testing.assert_array_equal(table.mu_ratio(v, y), mu)
    for i in range(0, v.size, 37):
        assert table.mu_ratio(float(v[i]), float(y[i])) == mu[i]
    assert np.all((mu >= 0.0) & (mu <= 1.0))
    assert np.all(bound >= 0.0)


def test_over_the_whole_quadrant(table: Surrogate) -> None:
    rng = np.random.default_rng(5)
    v, y = 10.0 ** rng.uniform(-14.0, 10.0, 30_000), 10.0 ** rng.uniform(-10.0, 14.0, 30_000)
    same(table, v, y)
    v, y = 10.0 ** rng.uniform(-3.0, 3.0, 30_000), 10.0 ** rng.uniform(-3.0, 3.0, 30_000)
    same(table, v, y)
    assert np.unique(table.ratio_with_bound(v, y)[2]).size >= len(CHARTS) - 1


@pytest.mark.parametrize("quantity", [charts.POWER, charts.STICK])
def test_other_quantities(table: Surrogate, quantity: int) -> None:
    rng = np.random.default_rng(8)
    v, y = 10.0 ** rng.uniform(-8.0, 4.0, 10_000), 10.0 ** rng.uniform(-4.0, 8.0, 10_000)
    near = 10.0 ** rng.uniform(-8.0, -1.0, 3000), 1.0 + rng.uniform(-0.25, 0.5, 3000)
    v, y = np.concatenate([v, near[0]]), np.concatenate([y, near[1]])
    found = np.array([evaluate.answer(quantity, a, b, *table._data) for a, b in zip(v, y, strict=True)])
    value, bound, source = batch.quantity(quantity, table._data, v, y, 1)
    np.testing.assert_array_equal(source, found[:, 2])
    np.testing.assert_array_equal(value, found[:, 0])
    np.testing.assert_allclose(bound, found[:, 1], rtol=2.0**-52)  # its terms are added in another order
    corner = source == charts.CORNER
    assert np.count_nonzero(corner) > 1000
    np.testing.assert_array_equal(bound[corner], found[corner, 1])


def test_on_both_sides_of_every_seam(table: Surrogate) -> None:
    rng = np.random.default_rng(6)
    y = around(np.repeat([Y_STICK_LO, 1.0, Y_CONT, Y_MID, Y_HIGH, Y_TAIL], 50))
    same(table, 10.0 ** rng.uniform(-8.0, 6.0, y.size), y)
    y = 10.0 ** rng.uniform(-3.0, 6.0, 3000)
    for share in (1.0, 0.5, RHO_MAX, SIGMA_CUT**2):
        for v in np.split(around(table.v_tilde_crit(y) * share), 3):
            same(table, v, y)


def test_on_every_edge_of_every_cell(table: Surrogate) -> None:
    """Where rounding decides which of two cells is used."""
    _, blocks, _, pieces = table._data
    rng = np.random.default_rng(7)
    ends = []
    for row, chart, block in zip(blocks, CHARTS, table.table.blocks, strict=False):
        edges = (np.arange(block.cells[0] + 1) - row[charts.OFFSET_A]) / row[charts.STEP_A]
        if chart.a.name in ("y_squared", "ln_y", "y"):
            ends.append(charts.amplitude(chart.a, edges))
    for row, (_, axis, _), piece in zip(pieces, charts.BORDER_PIECES, table.table.border, strict=True):
        edges = (np.arange(piece.cells + 1) - row[charts.PIECE_OFFSET]) / row[charts.PIECE_STEP]
        ends.append(charts.amplitude(axis, edges[edges > 0.0]))
    y = around(np.concatenate(ends))
    y = y[y > 0.0]
    for _ in range(20):
        v = table.v_tilde_crit(y) * 10.0 ** rng.uniform(-3.0, 3.0, y.size)
        same(table, v, y)


def test_extremes_go_one_by_one(table: Surrogate) -> None:
    values = np.array([0.0, 5e-324, 1e-310, 1e-200, 1e-150, 1e-100, 1.0, 1e100, 1e150, 1e200, 1.7e308, math.inf])
    v, y = (x.ravel() for x in np.meshgrid(values, values[:-1]))
    same(table, v, y)


def test_what_is_outside_the_quadrant_is_nan_alone_in_its_chunk(table: Surrogate) -> None:
    bad = [
        (-1.0, 1.0),
        (1.0, -1.0),
        (math.nan, 1.0),
        (1.0, math.nan),
        (1.0, math.inf),
        (-math.inf, 1.0),
        (0.0, math.inf),
    ]
    v, y = np.full(600, 0.1), np.full(600, 0.5)
    places = [0, 1, 255, 256, 257, 511, 599]
    for place, (a, b) in zip(places, bad, strict=True):
        v[place], y[place] = a, b
    mu = table.mu_ratio(v, y)
    assert sorted(np.flatnonzero(np.isnan(mu))) == places
    keep = ~np.isnan(mu)
    assert set(mu[keep]) == {table.mu_ratio(0.1, 0.5)}


@pytest.mark.parametrize("n", [0, 1, 2, 7, 8, 9, CHUNK - 1, CHUNK, CHUNK + 1, 3 * CHUNK + 5])
def test_any_number_of_points(table: Surrogate, n: int) -> None:
    rng = np.random.default_rng(n)
    v, y = 10.0 ** rng.uniform(-3.0, 3.0, n), 10.0 ** rng.uniform(-3.0, 3.0, n)
    expected = np.array([table.mu_ratio(float(a), float(b)) for a, b in zip(v, y, strict=True)])
    np.testing.assert_array_equal(table.mu_ratio(v, y), expected)


def test_a_point_has_the_same_answer_at_every_position(table: Surrogate) -> None:
    rng = np.random.default_rng(8)
    v, y = 10.0 ** rng.uniform(-3.0, 3.0, 2000), 10.0 ** rng.uniform(-3.0, 3.0, 2000)
    mu = table.mu_ratio(v, y)
    order = rng.permutation(v.size)
    np.testing.assert_array_equal(table.mu_ratio(v[order], y[order]), mu[order])
    np.testing.assert_array_equal(table.mu_ratio(v[3:], y[3:]), mu[3:])


# --- the arithmetic behind it -------------------------------------------------------------------------


def test_logarithm_is_that_of_the_library() -> None:
    rng = np.random.default_rng(9)
    x = np.concatenate([10.0 ** rng.uniform(-307.0, 308.0, 20_000), rng.uniform(0.25, 4.0, 20_000)])
    x = np.concatenate([x, around(2.0 ** np.arange(-1000.0, 1000.0, 7.0))])
    found = np.array([log(a) for a in x])
    assert np.all(np.abs(found - np.log(x)) <= 4.5e-16 * np.maximum(1.0, np.abs(np.log(x))))
    assert log(1.0) == 0.0


def test_logarithm_never_falls_where_its_argument_rises() -> None:
    for start in (1.0, 2.0, 1.5, 3.0, 1e5):
        x = start * (1.0 + np.arange(-2000, 2000) * 1e-15)
        assert np.all(np.diff([log(a) for a in np.unique(x)]) >= -2.3e-16 * max(1.0, math.log(start)))


def test_fused_sum_is_rounded_once() -> None:
    x = 1.0 + 2.0**-30
    assert _fused(x, -(1.0 + 2.0**-29)) == 2.0**-60
    assert square_plus(3.0, 1.0) == 10.0


def _fused(x: float, c: float) -> float:
    from numba import njit

    @njit
    def run(a: float, b: float) -> float:
        out: float = square_plus(a, b)
        return out

    return float(run(x, c))


def test_quick_outer_expansion_is_the_closed_form() -> None:
    for t in np.concatenate([np.geomspace(1.0, QUICK_MAX * (1.0 - 1e-12), 3000), 1.0 + np.geomspace(1e-15, 1.0, 200)]):
        f, g, slope, _, _ = outer_expansion(math.sqrt(t - 1.0))
        first, rest = outer_quick(t)
        assert first == close(f, abs=1e-15)
        # taken times 1 / (1 + v~^2) < 1e-3, and not known better in closed form
        assert rest == close(g + 0.5 * slope, abs=1e-14)

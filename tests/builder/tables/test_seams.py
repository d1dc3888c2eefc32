"""Beside every seam of cells, on both sides: answers of every table, all quantities, slopes."""

from pathlib import Path

import numpy as np
import pytest

from builder.solver.ball import Springs
from builder.solver.sweep import Sweep
from builder.tables.build import build_table
from builder.tables.contacts import ball, slopes_of
from builder.tables.verify import BESIDE_BORDER
from mumacro import Surrogate
from mumacro.inputs.kind import BALL, SPRING, Kind
from mumacro.table.atlas import BALL_CHARTS, CHARTS_OF, MIDDLE, QUANTITIES, Quantity
from tests.support.cases import Array, opened
from tests.support.seams import beside_border_seams, beside_seams, slopes_across_rays

RING = [chart.name for chart in BALL_CHARTS].index("partial_slip_ring")


def drawn(table: Surrogate, kind: Kind, index: int, n: int) -> tuple[Array, Array]:
    """Beside the seams of a block; those of the border where there is no such block."""
    charts, rng = CHARTS_OF[kind.contact], np.random.default_rng([kind.contact, index])
    if index == len(charts):
        v, y = beside_border_seams(rng, table.table.border, table.border, n)
    else:
        block = (table.table.ball if kind == BALL else table.table.blocks)[index]
        v, y = beside_seams(rng, charts[index], block, table.border, n)
    return (MIDDLE * v / MIDDLE, MIDDLE * y / MIDDLE) if kind == BALL else (v, y)


def apart(table: Surrogate, quantity: Quantity, v: Array, y: Array) -> Array:
    """Where slopes are compared: of what is not smooth at the border, away from it."""
    if quantity.smooth_at_border:
        return np.full(v.shape, True)
    return np.asarray(np.abs(v / table.v_tilde_crit(y) - 1.0) > BESIDE_BORDER)


def assert_near_the_finest(table: Surrogate, kind: Kind, n: int) -> None:
    """Values and slopes are within their bounds of those of the finest table, which has digits to
    spare."""
    fine, scale = opened(1e-12), MIDDLE if kind == BALL else 1.0
    for index in range(len(CHARTS_OF[kind.contact]) + 1):
        v, y = drawn(table, kind, index, n)
        for quantity in QUANTITIES:
            name = quantity.name
            (value, bound, _), (true, unsure, _) = (
                s.quantity(name, scale * v, scale * y, **kind.names) for s in (table, fine)
            )
            assert np.all(np.abs(value - true) <= bound + unsure), (index, name)
            if kind == BALL and name != "mu_ratio":
                continue  # slopes that no table gives
            here, truth = (slopes_of(s, kind, name, v, y) for s in (table, fine))
            off = np.abs(here[1:3] - truth[1:3]) > here[3:5] + truth[3:5]
            assert not np.any(off & apart(table, quantity, v, y)), (index, name)


@pytest.mark.parametrize("kind", [SPRING, BALL], ids=["spring", "ball"])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-10])
def test_tables_are_within_their_bounds_of_the_finest(tolerance: float, kind: Kind) -> None:
    assert_near_the_finest(opened(tolerance), kind, 8000)


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [2e-9, 3e-5])
def test_a_table_of_an_odd_tolerance_keeps_its_bounds(
    tolerance: float, sweep: Sweep, tmp_path: Path
) -> None:
    """Its border has other cells than its blocks."""
    table = build_table(tmp_path / "odd.nc", tolerance, sweep)
    for kind in (SPRING, BALL):
        assert_near_the_finest(table, kind, 100_000)


@pytest.fixture(scope="module")
def springs() -> Springs:
    return Springs(opened(1e-12))


#: V, Y beside a seam and the steepest ray, at a seam next to it, and next to the ridge
HARD = (
    (0.1831568889210307, 0.5464632760800225),
    (0.32447345362176977, 0.9680925873409648),
    (0.648947093063553, 1.9361857288972757),
)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-10, 1e-12])
def test_slopes_of_a_ball_across_the_rays_are_those_of_fresh_quadratures(
    tolerance: float, springs: Springs
) -> None:
    table, of = opened(tolerance), ball(springs)
    v, y = drawn(table, BALL, RING, 400)
    near = np.random.default_rng(1).permutation(np.flatnonzero(y > 1e-3))[:60]
    hard_v, hard_y = (np.array(x) / MIDDLE for x in zip(*HARD, strict=True))
    v, y = of.as_asked(np.append(hard_v, v[near]), np.append(hard_y, y[near]))
    truth, noise = slopes_across_rays(of, v, y, table.v_tilde_crit(y))
    assert np.isfinite(noise[:, :2]).all()
    rows = of.slopes(table, "mu_ratio", v, y)
    assert np.all(np.abs(rows[1:3] - truth) <= rows[3:5] + noise)
    seen = np.abs(rows[1:3] - truth) > noise
    assert np.median((rows[3:5] / np.abs(rows[1:3] - truth))[seen]) <= 100.0

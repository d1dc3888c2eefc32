"""Beside every seam of cells, on both sides: answers of every table, all quantities, slopes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from builder.solver.ball import Springs
from builder.solver.sweep import Sweep
from builder.tables.blocks import build_border
from builder.tables.build import SAFETY, build_table
from builder.tables.contacts import ball, slopes_of, spring
from builder.tables.measure import border_errors
from mumacro import Surrogate
from mumacro.inputs.fields import BALL, SPRING, Kind
from mumacro.table.atlas import MIDDLE, QUANTITIES, QUANTITY_NAMES
from mumacro.table.polynomials import Border
from tests.support.cases import opened
from tests.support.nightly import nightly
from tests.support.seams import (
    beside_border_seams,
    beside_every_seam,
    by_its_values,
    off_the_lines,
    slopes_across_rays,
    true_slopes,
    with_slopes,
)

RING = "partial_slip_ring"


@pytest.fixture(scope="module")
def springs() -> Springs:
    return Springs(opened(1e-12))


def assert_near_the_finest(table: Surrogate, kind: Kind, n: int) -> None:
    """Values and slopes are within their bounds of those of the finest table, which has digits to
    spare."""
    fine, scale = opened(1e-12), MIDDLE if kind == BALL else 1.0
    for block, v, y in beside_every_seam(table, kind, n):
        for quantity in QUANTITIES:
            name = quantity.name
            (value, bound, _), (true, unsure, _) = (
                s.quantity(name, scale * v, scale * y, **kind.names) for s in (table, fine)
            )
            assert np.all(np.abs(value - true) <= bound + unsure), (block, name)
            if kind == BALL and name != "mu_ratio":
                continue  # slopes that no table gives
            here, truth = (slopes_of(s, kind, name, v, y) for s in (table, fine))
            off = np.abs(here[1:3] - truth[1:3]) > here[3:5] + truth[3:5]
            assert not np.any(off & with_slopes(table, quantity, v, y)), (block, name)


@pytest.mark.parametrize("kind", [SPRING, BALL], ids=["spring", "ball"])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-10, 1e-12])
def test_slopes_are_those_of_a_tables_own_values(
    tolerance: float, kind: Kind, springs: Springs, sweep: Sweep
) -> None:
    table = opened(tolerance)
    contact = by_its_values(table, ball(springs) if kind == BALL else spring(sweep))
    for block, v, y in beside_every_seam(table, kind, 1000):
        here = off_the_lines(table, v, y)
        v, y = v[here], y[here]
        for name, slopes, unsure in true_slopes(table, contact, contact.slope_names, v, y):
            rows = contact.slopes(table, name, v, y)
            off = np.abs(rows[1:3] - slopes) > rows[3:5] + unsure
            quantity = QUANTITIES[QUANTITY_NAMES.index(name)]
            assert not np.any(off & with_slopes(table, quantity, v, y)), (block, name)


@pytest.mark.parametrize("kind", [SPRING, BALL], ids=["spring", "ball"])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-10])
def test_tables_are_within_their_bounds_of_the_finest(tolerance: float, kind: Kind) -> None:
    assert_near_the_finest(opened(tolerance), kind, 8000)


@pytest.mark.slow
@pytest.mark.parametrize(("tolerance", "n"), [(3e-5, 20_000), nightly(2e-9, 100_000)])
def test_a_table_of_an_odd_tolerance_keeps_its_bounds(
    tolerance: float, n: int, sweep: Sweep, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The border of 2e-9 has a seam beside y~ = 3, where the slope of the border is off by 1e-9."""
    # the builder's last fresh solves find less than the points below
    monkeypatch.setattr("builder.tables.build.FINAL_POINTS", 500)
    table = build_table(tmp_path / "odd.nc", tolerance, sweep)
    for kind in (SPRING, BALL):
        assert_near_the_finest(table, kind, n)


@pytest.mark.parametrize("tolerance", [2e-8, 1e-9])
def test_the_slope_of_a_border_is_bounded_tightly_beside_its_seams(
    tolerance: float, sweep: Sweep
) -> None:
    """The border of one tolerance in the blocks of the finest table: what slopes along y~ are off
    by is the border's.  Below y~ = 0.3 its slope hardly counts."""
    rng, fine = np.random.default_rng(23), opened(1e-12)
    pieces = build_border(sweep, tolerance)
    largest = SAFETY * float(border_errors(Border(pieces), sweep, rng, 600).max())
    pieces = [replace(piece, max_rel_error=largest) for piece in pieces]
    table = Surrogate(replace(fine.table, border=pieces), fine.path)
    _, y = beside_border_seams(rng, pieces, table.border, 20_000)
    y = y[y > 0.3]
    v = rng.uniform(0.1, 0.9, y.size) * table.v_tilde_crit(y)
    for name in QUANTITY_NAMES[:2]:
        rows, truth = (np.array(s.slopes(v, y, name, bounds=True)) for s in (table, fine))
        share = np.abs(rows[2] - truth[2]) / (rows[4] + truth[4])
        assert 0.45 < share.max() <= 1.0


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
    table, contact = opened(tolerance), ball(springs)
    v, y = next((v, y) for name, v, y in beside_every_seam(table, BALL, 400) if name == RING)
    near = np.random.default_rng(1).permutation(np.flatnonzero(y > 1e-3))[:60]
    hard_v, hard_y = (np.array(x) / MIDDLE for x in zip(*HARD, strict=True))
    v, y = contact.as_asked(np.append(hard_v, v[near]), np.append(hard_y, y[near]))
    truth, noise = slopes_across_rays(contact, v, y, table.v_tilde_crit(y))
    assert np.isfinite(noise[:, :2]).all()
    rows = contact.slopes(table, "mu_ratio", v, y)
    assert np.all(np.abs(rows[1:3] - truth) <= rows[3:5] + noise)
    seen = np.abs(rows[1:3] - truth) > noise
    assert np.median((rows[3:5] / np.abs(rows[1:3] - truth))[seen]) <= 100.0

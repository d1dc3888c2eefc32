"""The atlas: point to place and place to point are inverse, in every block; values at its nodes."""

import numpy as np
import pytest

from mumacro import Surrogate
from mumacro.kernel.binding import kernels
from mumacro.table import atlas
from mumacro.table.atlas import BLOCK_NAMES, CHARTS, REGIME_OF_SOURCE, SOURCES
from tests.support.cases import tables
from tests.support.comparing import close

SPRING_CHARTS = CHARTS["spring"]
C_LOW, CORNER = BLOCK_NAMES.index("continuous_low"), BLOCK_NAMES.index("corner")
table = tables(1e-4, 1e-12)


@pytest.mark.parametrize("index", range(len(SPRING_CHARTS)), ids=BLOCK_NAMES)
def test_the_inverse_leads_back_to_the_point(table: Surrogate, index: int) -> None:
    rng = np.random.default_rng(index)
    v, y = 10.0 ** rng.uniform(-8.0, 6.0, 60_000), 10.0 ** rng.uniform(-3.0, 8.0, 60_000)
    near = rng.random(v.size) < 0.5
    y[near] = rng.uniform(0.7, 3.5, np.count_nonzero(near))
    block, a, b = kernels[-1].places(table.tabulated.data(), v, y)
    mine = block == index
    assert np.count_nonzero(mine) > 100
    chart = SPRING_CHARTS[index]
    again_v, again_y, eta = chart.point(
        chart.a.to_file(a[mine]), chart.b.to_file(b[mine]), table.border
    )
    # d ln v~ / d b is unbounded where b ends: in continuous_low at v~ -> 0 and at v~ -> infinity,
    # along s at v~ -> 0
    share = 1.0 + (v[mine] ** 2 + v[mine] ** -2 if index == C_LOW else 0.0)
    crit = table.v_tilde_crit(y[mine])
    low = 1.0 + (np.sqrt(crit / v[mine]) if chart.b.name == "s" else 0.0)
    assert np.all(
        np.abs(again_v / v[mine] - 1.0) <= 4e-14 * share * low + (1e-9 if index == CORNER else 0.0)
    )
    assert again_y == close(y[mine], rel=1e-13 if index != CORNER else 1e-12)
    assert eta == close(y[mine] - 1.0, abs=1e-13 * y[mine].max())


def test_every_point_has_one_block_and_its_coordinates_are_in_range(table: Surrogate) -> None:
    values = np.concatenate([10.0 ** np.arange(-320.0, 308.0, 4.0), [5e-324, 1.7e308]])
    v, y = (x.ravel() for x in np.meshgrid(values, values))
    block, a, b = kernels[-1].places(table.tabulated.data(), v, y)
    np.testing.assert_array_equal(block, table.quantity("mu_ratio", v, y)[2])
    assert np.all((block >= 0) & (block <= SOURCES.index("tail_fast")))
    for index, chart in enumerate(SPRING_CHARTS):
        mine = block == index
        for axis, result in ((chart.a, a[mine]), (chart.b, b[mine])):
            low, high = axis.to_evaluation(np.array([axis.low, axis.high]))
            slack = 1e-12 * max(abs(low), abs(high))
            assert np.all((result >= low - slack) & (result <= high + slack)), (
                chart.name,
                axis.name,
            )
    sliding = REGIME_OF_SOURCE[block] == atlas.CONTINUOUS
    np.testing.assert_array_equal(sliding, v >= table.v_tilde_crit(y))


@pytest.mark.parametrize("quantity", atlas.QUANTITIES, ids=atlas.QUANTITY_NAMES)
def test_the_form_of_a_value_is_the_value_at_the_nodes(
    table: Surrogate, quantity: atlas.TabulatedQuantity
) -> None:
    """value = base + factor q with q from the file: exact at nodes, to the table's error."""
    for index, (chart, part) in enumerate(
        zip(SPRING_CHARTS, table.table.contacts["spring"].blocks, strict=True)
    ):
        assert (quantity.name in part.nodes) == chart.holds(quantity)
        a, b = np.meshgrid(part.a, part.b, indexing="ij")
        v, y, eta = chart.point(a, b, table.border)
        keep = (table.quantity("mu_ratio", v, y)[2] == index) & (v > 1e-200)
        base, factor = kernels[-1].forms(
            atlas.QUANTITY_NAMES.index(quantity.name), index, v[keep], y[keep], eta[keep]
        )
        value, bound, _ = table.quantity(quantity.name, v[keep], y[keep])
        assert np.all((factor != 0.0) == chart.holds(quantity))
        expected = (
            base + factor * part.nodes[quantity.name][keep] if chart.holds(quantity) else 0.0 * base
        )
        assert np.all(np.abs(value - expected) <= 1.01 * bound + 4e-16), chart.name

"""From Chebyshev nodes to cells: exact for polynomials, close for smooth functions; and how the
kernel reads cells."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import chebyshev

from mumacro.kernel.binding import Kernel, kernels
from mumacro.table import atlas
from mumacro.table.atlas import BLOCK_NAMES, BORDER_PIECES, CHARTS, SQRT2, Axis, Chart
from mumacro.table.blocks import BorderPiece
from mumacro.table.polynomials import WIDTH, border_cells, cells_2d, nodes
from tests.support.cases import Array
from tests.support.comparing import close
from tests.support.made_cells import Cells

SPRING_CHARTS = CHARTS["spring"]
AXES = sorted({axis for chart in SPRING_CHARTS for axis in (chart.a, chart.b)}, key=repr)
ANGLE = Axis("angle", 0.0, 1.0)


def value(cell: Array, u: float, w: float) -> float:
    """The polynomial of one cell, rows and columns of falling powers of w and u."""
    return float(np.polynomial.polynomial.polyval2d(w, u, cell[::-1, ::-1]))


def at(coef: Array, cells: tuple[int, int], x: float, z: float) -> float:
    """Value at (x, z) in [0, 1]^2 of cells in the layout of :func:`cells_2d`."""
    i, j = min(int(x * cells[0]), cells[0] - 1), min(int(z * cells[1]), cells[1] - 1)
    return value(
        coef[i * cells[1] + j], 2.0 * (x * cells[0] - i) - 1.0, 2.0 * (z * cells[1] - j) - 1.0
    )


@pytest.mark.parametrize("cells", [1, 3, 8])
def test_cells_reproduce_a_polynomial_of_their_degree(cells: int) -> None:
    rng = np.random.default_rng(cells)
    c = rng.normal(size=WIDTH)
    values: Any = chebyshev.chebval(nodes(20, -1.0, 1.0), c)
    axis = BORDER_PIECES[0][1]  # of v~crit, in y~^2
    local, _ = border_cells([BorderPiece(nodes(20, axis.low, axis.high), values, cells)])
    assert local.shape == (cells, WIDTH)
    for x in np.linspace(0.0, 1.0, 57):
        i = min(int(x * cells), cells - 1)
        result = np.polyval(local[i], 2.0 * (x * cells - i) - 1.0)
        assert result == close(chebyshev.chebval(2.0 * x - 1.0, c), abs=1e-11)


# --- what the kernel reads ------------------------------------------------------------------------


@pytest.mark.parametrize("kernel", kernels, ids=lambda kernel: kernel.level)
def test_a_cell_is_a_polynomial_in_falling_powers(kernel: Kernel) -> None:
    """In stick_slip_mid the power is what is tabulated, 1 q."""
    index = BLOCK_NAMES.index("stick_slip_mid")
    rng = np.random.default_rng(8)
    table = Cells((1, 1))
    v, y = table.points(index, rng.random(200), rng.uniform(0.5, 0.99, 200))
    block, a, b = kernel.places(table.data, v, y)
    assert np.all(block == index)
    (low_a, high_a), (low_b, high_b) = SPRING_CHARTS[index].a.span, SPRING_CHARTS[index].b.span
    u, w = 2.0 * (a - low_a) / (high_a - low_a) - 1.0, 2.0 * (b - low_b) / (high_b - low_b) - 1.0
    for size in (1.0, 1e-3):
        cell = size * rng.random((WIDTH, WIDTH))
        cell[-1, -1] += 10.0  # below zero a power is cut off
        coef = np.zeros((len(SPRING_CHARTS), WIDTH, WIDTH))
        coef[index] = cell
        result = table.values(coef, v, y, kernel)
        expected = np.polynomial.polynomial.polyval2d(w, u, cell[::-1, ::-1])
        assert result == close(expected, rel=1e-14)


@pytest.mark.parametrize("index", range(len(SPRING_CHARTS)), ids=BLOCK_NAMES)
@pytest.mark.parametrize("cells", [(1, 1), (2, 7), (7, 2), (40, 1)])
def test_cells_are_counted_from_one_end_of_an_axis_to_the_other(
    index: int, cells: tuple[int, int]
) -> None:
    """A table whose cells hold their own numbers: none is skipped, neighbours follow one
    another."""
    table = Cells(cells)
    chart, n = SPRING_CHARTS[index], cells[0] * cells[1]
    number = np.zeros((n * len(SPRING_CHARTS), WIDTH, WIDTH))
    number[:, -1, -1] = np.tile(np.arange(n), len(SPRING_CHARTS))
    for axis, other in ((0, 0.37), (1, 0.73)):
        along = np.linspace(1e-6, 1.0 - 1e-6, 997)
        v, y = table.points(index, *((along, other) if axis == 0 else (other, along)))
        mine = kernels[-1].places(table.data, v, y)[0] == index
        if chart.regime == atlas.CONTINUOUS or axis == 1:
            assert np.count_nonzero(mine) > 200
        result = np.rint(table.tabulated(index, number, v[mine], y[mine])).astype(int)
        assert np.all((result >= 0) & (result < n))
        a, b = np.divmod(result, cells[1])
        moving, fixed = (a, b) if axis == 0 else (b, a)
        assert np.all(np.diff(moving) >= 0)
        assert np.all(np.diff(moving) <= 1)
        assert np.unique(fixed).size <= 1
        if mine.all():
            assert (moving[0], moving[-1]) == (0, cells[axis] - 1)


# --- the coordinates that evaluation uses ---------------------------------------------------------


@pytest.mark.parametrize("axis", AXES, ids=repr)
def test_both_coordinates_of_an_axis_are_inverse_and_rise_together(axis: Axis) -> None:
    x = np.linspace(axis.low, axis.high, 2001)
    there = axis.to_evaluation(x)
    assert np.all(np.diff(there) > 0.0)
    assert axis.to_file(there) == close(x, rel=4e-15, abs=4e-15 * (axis.high - axis.low))
    start, stop = axis.span
    assert start - 1e-15 <= there[0]
    assert there[-1] <= stop * (1.0 + 1e-15)
    at = np.linspace(start, stop, 2001)
    assert axis.to_evaluation(axis.to_file(at)) == close(at, rel=1e-14, abs=1e-15)


def test_the_corners_angle_is_taken_as_the_tangent_of_its_half() -> None:
    low, high = ANGLE.to_evaluation(np.array([0.0, 1.0]))
    v, eta = np.array([1e-9, 1e-3, 0.02, 1e-7]), np.array([1e-3, 0.0, -0.2, 0.4])
    y = 1.0 + eta
    _, radius, half = kernels[-1].places(Cells((1, 1)).data, v, y)
    phi = kernels[-1].normal_form_root(v, y - 1.0)
    s0 = np.sqrt(2.0 * math.pi * v / phi)
    assert np.all((low < half) & (half < high))
    assert phi**3 + 2.0 * (y - 1.0) * phi == close(math.pi * v, rel=1e-14)
    assert radius == close(np.hypot(s0 / SQRT2, SQRT2 * phi), rel=1e-15)
    assert ANGLE.to_file(half) == close(2.0 / math.pi * np.arctan2(2.0 * phi, s0), rel=1e-14)


@pytest.mark.parametrize("chart", SPRING_CHARTS, ids=BLOCK_NAMES)
@pytest.mark.parametrize("cells", [(4, 12), (7, 20)])
def test_cells_of_a_block_follow_a_smooth_function(chart: Chart, cells: tuple[int, int]) -> None:
    """Along s they have an edge at the knot; those below the lowest s of a block are never
    visited."""
    spans = chart.a.span, chart.b.span

    def smooth(a: Any, b: Any) -> Any:
        return np.exp(-a / chart.a.high) * np.cos(2.0 * b / chart.b.high)

    a, b = nodes(20, chart.a.low, chart.a.high), nodes(30, chart.b.low, chart.b.high)
    coef = cells_2d(chart.a, chart.b, smooth(a[:, None], b), cells)
    start, stop = spans[1]
    least = (float(chart.b.to_evaluation(np.array([chart.b.low]))[0]) - start) / (stop - start)
    rng = np.random.default_rng(2)
    for x, z in zip(rng.random(200), rng.uniform(least, 1.0, 200), strict=True):
        shares = zip((chart.a, chart.b), spans, (x, z), strict=True)
        place = [
            axis.to_file(np.array([low + (high - low) * share]))
            for axis, (low, high), share in shares
        ]
        assert at(coef, cells, x, z) == close(smooth(*place)[0], abs=2e-9)

"""From Chebyshev nodes to cells: exact for polynomials, close for smooth functions, the same in Python and compiled."""

import math

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from comparing import close
from mumacro import charts
from mumacro.cells import (
    WIDTH,
    block_rows,
    cell_positions,
    cells_1d,
    cells_2d,
    chebyshev_coefficients,
    interpolation_matrix,
    joined,
    nodes,
    patch_value,
)
from mumacro.charts import CHARTS, SQRT2, Axis, Chart
from mumacro.table import Block

Array = NDArray[np.float64]
PLAIN = Axis("y", 0.0, 1.0)
AXES = sorted({axis for chart in CHARTS for axis in (chart.a, chart.b)}, key=repr)
S = Axis("s", 0.0, 1.0)
ANGLE = Axis("angle", 0.0, 1.0)


@njit
def _value(coef: Array, p: int, u: float, w: float) -> float:
    out: float = patch_value(coef, p, u, w)
    return out


def at(coef: Array, cells: tuple[int, int], x: float, z: float) -> float:
    """Value at (x, z) in [0, 1]^2 of cells in the layout of :func:`cells_2d`."""
    i, j = min(int(x * cells[0]), cells[0] - 1), min(int(z * cells[1]), cells[1] - 1)
    return float(_value(coef, i * cells[1] + j, 2.0 * (x * cells[0] - i) - 1.0, 2.0 * (z * cells[1] - j) - 1.0))


@pytest.mark.parametrize("n", [1, 2, 7, 40])
def test_nodes_are_the_zeros_of_the_chebyshev_polynomial(n: int) -> None:
    x = nodes(n, -3.0, 5.0)
    assert x.shape == (n,)
    assert np.all(np.diff(x) > 0.0)
    assert x[0] > -3.0
    assert x[-1] < 5.0
    assert chebyshev.chebval((x - 1.0) / 4.0, [0] * n + [1]) == close(np.zeros(n), abs=1e-13)


@pytest.mark.parametrize("n", [1, 3, 8, 21])
def test_coefficients_interpolate(n: int) -> None:
    rng = np.random.default_rng(n)
    values = rng.normal(size=n)
    c = chebyshev_coefficients(values)
    assert chebyshev.chebval(nodes(n, -1.0, 1.0), c) == close(values, abs=1e-13)
    assert interpolation_matrix(n, nodes(n, -1.0, 1.0)) @ c == close(values, abs=1e-13)


def test_coefficients_of_a_plane_work_along_both_axes() -> None:
    rng = np.random.default_rng(4)
    expected = rng.normal(size=(5, 9))
    x, z = nodes(5, -1.0, 1.0), nodes(9, -1.0, 1.0)
    values = chebyshev.chebgrid2d(x, z, expected)
    assert chebyshev_coefficients(values) == close(expected, abs=1e-13)


@pytest.mark.parametrize("cells", [1, 3, 8])
def test_cells_reproduce_a_polynomial_of_their_degree(cells: int) -> None:
    rng = np.random.default_rng(cells)
    c = rng.normal(size=WIDTH)
    local = cells_1d(Axis("y", -1.0, 1.0), chebyshev.chebval(nodes(20, -1.0, 1.0), c), cells)
    assert local.shape == (cells, WIDTH)
    for x in np.linspace(0.0, 1.0, 57):
        i = min(int(x * cells), cells - 1)
        found = np.polyval(local[i], 2.0 * (x * cells - i) - 1.0)
        assert found == close(chebyshev.chebval(2.0 * x - 1.0, c), abs=1e-11)


@pytest.mark.parametrize("cells", [(1, 1), (2, 5), (4, 3)])
def test_cells_of_a_plane_reproduce_a_polynomial_of_their_degree(cells: tuple[int, int]) -> None:
    rng = np.random.default_rng(sum(cells))
    c = rng.normal(size=(WIDTH, WIDTH))
    values = chebyshev.chebgrid2d(nodes(12, -1.0, 1.0), nodes(15, -1.0, 1.0), c)
    coef = joined([cells_2d(PLAIN, PLAIN, values, cells)])
    assert coef.shape == (cells[0] * cells[1], WIDTH, WIDTH)
    assert coef.flags.c_contiguous
    for x, z in rng.random((80, 2)):
        assert at(coef, cells, x, z) == close(chebyshev.chebval2d(2 * x - 1, 2 * z - 1, c), abs=2e-10)


def test_error_of_the_cells_falls_with_the_eighth_power_of_their_size() -> None:
    values = np.exp(np.sin(3.0 * nodes(60, 0.0, 1.0)))
    errors = []
    for cells in (2, 4, 8):
        local = cells_1d(PLAIN, values, cells)
        x = np.linspace(0.0, 1.0, 500, endpoint=False)
        i = (x * cells).astype(int)
        found = np.array([np.polyval(local[k], 2.0 * (t * cells - k) - 1.0) for t, k in zip(x, i, strict=True)])
        errors.append(np.abs(found - np.exp(np.sin(3.0 * x))).max())
    assert math.log2(errors[0] / errors[1]) == close(WIDTH, abs=1.5)
    assert math.log2(errors[1] / errors[2]) == close(WIDTH, abs=1.0)


def test_neighbouring_cells_meet() -> None:
    x, z = nodes(40, 0.0, 1.0), nodes(40, 0.0, 1.0)
    values = np.exp(-x[:, None]) * np.cos(2.0 * z[None, :]) + x[:, None] * z[None, :] ** 2
    coef = joined([cells_2d(PLAIN, PLAIN, values, (6, 6))])
    for i in range(5):
        for t in np.linspace(-1.0, 1.0, 9):
            assert _value(coef, i * 6 + 2, 1.0, t) == close(_value(coef, (i + 1) * 6 + 2, -1.0, t), abs=2e-12)
            assert _value(coef, 12 + i, t, 1.0) == close(_value(coef, 13 + i, t, -1.0), abs=2e-12)


# --- the patch itself ---------------------------------------------------------------------------------


def test_patch_is_a_polynomial_in_falling_powers() -> None:
    coef = np.zeros((3, WIDTH, WIDTH))
    coef[1, 2, 5] = 3.0  # w^5 u^2
    coef[1, 7, 7] = -1.0
    for value in (patch_value, _value):
        assert value(coef, 1, 0.5, -0.7) == close(3.0 * (-0.7) ** 5 * 0.5**2 - 1.0, rel=1e-15)
        assert value(coef, 0, 0.5, -0.7) == 0.0
        assert value(coef, 2, 0.5, -0.7) == 0.0


def test_compiled_patch_equals_plain_python() -> None:
    rng = np.random.default_rng(8)
    coef = rng.normal(size=(50, WIDTH, WIDTH))
    for p in range(50):
        u, w = rng.uniform(-1.0, 1.0, 2)
        expected = np.polynomial.polynomial.polyval2d(w, u, coef[p, ::-1, ::-1])
        scale = np.abs(coef[p]).sum()
        assert patch_value(coef, p, u, w) == close(expected, abs=4e-16 * scale)
        assert _value(coef, p, u, w) == close(expected, abs=4e-16 * scale)


def test_a_patch_that_is_not_contiguous_is_refused_not_misread() -> None:
    with pytest.raises(TypingError, match="patch_value"):
        _value(np.zeros((3, WIDTH, 2 * WIDTH))[:, :, ::2], 1, 0.0, 0.0)


# --- the coordinates that evaluation uses --------------------------------------------------------------


@njit
def _cell(blocks: Array, patches: int, block: int, a: float, b: float) -> tuple[int, float, float]:
    found: tuple[int, float, float] = charts.cell(blocks, patches, block, a, b)
    return found


@pytest.mark.parametrize("index", range(len(CHARTS)), ids=charts.NAMES)
@pytest.mark.parametrize("cells", [(1, 1), (2, 7), (7, 2), (40, 1)])
def test_cells_are_counted_from_one_end_of_an_axis_to_the_other(index: int, cells: tuple[int, int]) -> None:
    """Numbering in the evaluation: the first cell contains the low end, the last the high end, none is skipped."""
    none = np.empty(0)
    blocks = block_rows([Block(none, none, none, cells, none)] * len(CHARTS))
    size = cells[0] * cells[1]
    spans = CHARTS[index].a.span, CHARTS[index].b.span
    for axis in (0, 1):
        start, stop = spans[axis]
        other = spans[1 - axis][0]
        ends = [start, np.nextafter(start, stop), 0.5 * (start + stop), np.nextafter(stop, start), stop]
        visited = set()
        for x in [*ends, *np.linspace(start, stop, 997)]:
            patch, *local = _cell(blocks, len(CHARTS) * size, index, *((x, other) if axis == 0 else (other, x)))
            patch -= index * size
            assert 0 <= patch < size
            assert -1.0 - 1e-9 <= local[axis] <= 1.0 + 1e-9
            assert local[1 - axis] == close(-1.0, abs=1e-9)
            visited.add(patch)
        assert visited == {i * cells[1] if axis == 0 else i for i in range(cells[axis])}
    last, u, w = _cell(blocks, len(CHARTS) * size, index, spans[0][1], spans[1][1])
    assert last == (index + 1) * size - 1
    assert (u, w) == (close(1.0, abs=1e-9), close(1.0, abs=1e-9))


def test_no_coordinate_makes_a_cell_of_another_table() -> None:
    """For any input, an existing patch is read."""
    none = np.empty(0)
    blocks = block_rows([Block(none, none, none, (3, 3), none)] * len(CHARTS))
    for index in range(charts.OTHER + 1):
        for a in (-1e300, -1.0, 0.0, 1e9, 1e300, math.inf, -math.inf, math.nan):
            for b in (-1e300, 1e300, math.inf, math.nan):
                assert 0 <= _cell(blocks, 9 * len(CHARTS), index, a, b)[0] < 9 * len(CHARTS)


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
    for v, eta in ((1e-9, 1e-3), (1e-3, 0.0), (0.02, -0.2), (1e-7, 0.4)):
        y = 1.0 + eta
        radius, half, phi = _corner(v, y)
        s0 = math.sqrt(2.0 * math.pi * v / phi)
        assert low < half < high
        assert phi**3 + 2.0 * (y - 1.0) * phi == close(math.pi * v, rel=1e-14)
        assert radius == close(math.hypot(s0 / SQRT2, SQRT2 * phi), rel=1e-15)
        angle = 2.0 / math.pi * math.atan2(2.0 * phi, s0)
        assert ANGLE.to_file(np.array([half]))[0] == close(angle, rel=1e-14)


@njit
def _corner(v: float, y: float) -> tuple[float, float, float]:
    found: tuple[float, float, float] = charts.corner(v, y)
    return found


def test_the_edge_coordinate_undoes_the_map_of_the_table() -> None:
    assert S.to_evaluation(np.array([0.0, 1.0])) == close([0.0, SQRT2], abs=1e-16)
    assert S.to_file(np.array([0.0, SQRT2])) == close([0.0, 1.0], abs=1e-15)
    rho = np.concatenate([np.geomspace(1e-30, 0.5, 50), 1.0 - np.geomspace(1e-12, 0.5, 50)])
    sigma = np.where(rho < 0.5, np.sqrt(rho), SQRT2 - np.sqrt(1.0 - rho))
    s = S.to_file(sigma)
    assert np.sin(0.5 * math.pi * s) ** 2 == close(rho, rel=1e-15)
    assert np.all((s >= 0.0) & (s <= 1.0))
    assert np.all(np.diff(S.to_file(np.linspace(0.0, SQRT2, 1001))) > 0.0)
    # continuous at its knot
    beside = S.to_evaluation(np.array([0.5 - 1e-15, 0.5, 0.5 + 1e-15]))
    assert beside == close(0.5 * SQRT2, abs=4e-15)


@pytest.mark.parametrize("chart", [chart for chart in CHARTS if chart.b.name == "s"], ids=lambda chart: chart.name)
def test_cells_along_s_are_on_the_nodes_axis_and_have_an_edge_at_the_knot(chart: Chart) -> None:
    cells = 8
    sigma, t = (x.reshape(cells, WIDTH) for x in cell_positions(chart.b, cells))
    assert np.all(np.diff(sigma.ravel()) > 0.0)
    low, high = chart.b.low, chart.b.high
    s = 0.5 * (low + high) + 0.5 * (high - low) * t
    assert s.max() < high
    edges = chart.b.to_file(SQRT2 * np.arange(cells + 1) / cells)
    assert edges[cells // 2] == close(0.5, abs=1e-15)  # rho = 1/2, where the map changes its branch
    for i in range(cells):
        if edges[i + 1] <= low:
            assert np.all(s[i] == close(low, abs=1e-15))  # never visited
        else:
            assert np.all((s[i] > edges[i]) & (s[i] < edges[i + 1]))
    x, t = cell_positions(chart.a, 3)
    assert x.shape == t.shape == (3 * WIDTH,)
    assert np.all(np.abs(t) < 1.0)


def test_cells_along_s_follow_a_smooth_function() -> None:
    chart = CHARTS[charts.S_LOW]
    a, s = nodes(20, chart.a.low, chart.a.high), nodes(30, chart.b.low, chart.b.high)
    values = np.exp(-a[:, None]) * np.cos(2.0 * s[None, :])
    coef = joined([cells_2d(chart.a, chart.b, values, (4, 12))])
    rng = np.random.default_rng(2)
    for x, sigma in zip(rng.random(200), SQRT2 * rng.random(200), strict=True):
        expected = math.exp(-x * chart.a.high) * math.cos(2.0 * float(chart.b.to_file(np.array([sigma]))[0]))
        assert at(coef, (4, 12), x, sigma / SQRT2) == close(expected, abs=2e-9)

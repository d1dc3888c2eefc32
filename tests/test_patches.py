"""From Chebyshev nodes to cells: exact for polynomials, close for smooth functions, the same in Python and compiled."""

import math

import numpy as np
import pytest
from numba import njit
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from friction import kernels
from friction.kernels import DEGREE, SQRT2, WIDTH, edge_coordinate, polar
from friction.patch_simd import patch_value
from friction.patches import (
    cell_positions,
    cells_1d,
    cells_2d,
    chebyshev_coefficients,
    evaluation_span,
    file_coordinate,
    interpolation_matrix,
    nodes,
    pace_of,
    s_of_sigma,
)
from friction.regions import BLOCKS, BlockSpec

Array = NDArray[np.float64]


def plain_block(a: tuple[float, float], b: tuple[float, float]) -> BlockSpec:
    return BlockSpec("plain", 0, "ln_y", "ln_kappa", a, b, "hypotenuse")


@njit
def _value(coef: Array, p: int, u: float, w: float) -> float:
    out: float = patch_value(coef, p, u, w)
    return out


def at(coef: Array, cells: tuple[int, int], x: float, z: float) -> float:
    """Value at (x, z) in [0, 1]^2 of cells as :func:`cells_2d` lays them out."""
    i, j = min(int(x * cells[0]), cells[0] - 1), min(int(z * cells[1]), cells[1] - 1)
    return float(_value(coef, i * cells[1] + j, 2.0 * (x * cells[0] - i) - 1.0, 2.0 * (z * cells[1] - j) - 1.0))


@pytest.mark.parametrize("n", [1, 2, 7, 40])
def test_nodes_are_the_zeros_of_the_chebyshev_polynomial(n: int) -> None:
    x = nodes(n, -3.0, 5.0)
    assert x.shape == (n,)
    assert np.all(np.diff(x) > 0.0)
    assert x[0] > -3.0
    assert x[-1] < 5.0
    assert chebyshev.chebval((x - 1.0) / 4.0, [0] * n + [1]) == pytest.approx(np.zeros(n), abs=1e-13)


@pytest.mark.parametrize("n", [1, 3, 8, 21])
def test_coefficients_interpolate(n: int) -> None:
    rng = np.random.default_rng(n)
    values = rng.normal(size=n)
    c = chebyshev_coefficients(values)
    assert chebyshev.chebval(nodes(n, -1.0, 1.0), c) == pytest.approx(values, abs=1e-13)
    assert interpolation_matrix(n, nodes(n, -1.0, 1.0)) @ c == pytest.approx(values, abs=1e-13)


def test_coefficients_of_a_plane_work_along_both_axes() -> None:
    rng = np.random.default_rng(4)
    expected = rng.normal(size=(5, 9))
    x, z = nodes(5, -1.0, 1.0), nodes(9, -1.0, 1.0)
    values = chebyshev.chebgrid2d(x, z, expected)
    assert chebyshev_coefficients(values) == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize("cells", [1, 3, 8])
def test_cells_reproduce_a_polynomial_of_their_degree(cells: int) -> None:
    rng = np.random.default_rng(cells)
    c = rng.normal(size=DEGREE + 1)
    local = cells_1d("y", (-1.0, 1.0), chebyshev.chebval(nodes(20, -1.0, 1.0), c), cells)
    assert local.shape == (cells, WIDTH)
    for x in np.linspace(0.0, 1.0, 57):
        i = min(int(x * cells), cells - 1)
        found = np.polyval(local[i], 2.0 * (x * cells - i) - 1.0)
        assert found == pytest.approx(chebyshev.chebval(2.0 * x - 1.0, c), abs=1e-11)


@pytest.mark.parametrize("cells", [(1, 1), (2, 5), (4, 3)])
def test_cells_of_a_plane_reproduce_a_polynomial_of_their_degree(cells: tuple[int, int]) -> None:
    rng = np.random.default_rng(sum(cells))
    c = rng.normal(size=(WIDTH, WIDTH))
    values = chebyshev.chebgrid2d(nodes(12, -1.0, 1.0), nodes(15, -1.0, 1.0), c)
    coef = cells_2d(plain_block((0.0, 1.0), (0.0, 1.0)), values, cells)
    assert coef.shape == (cells[0] * cells[1], WIDTH, WIDTH)
    assert coef.flags.c_contiguous
    for x, z in rng.random((80, 2)):
        assert at(coef, cells, x, z) == pytest.approx(chebyshev.chebval2d(2 * x - 1, 2 * z - 1, c), abs=2e-10)


def test_error_of_the_cells_falls_with_the_eighth_power_of_their_size() -> None:
    values = np.exp(np.sin(3.0 * nodes(60, 0.0, 1.0)))
    errors = []
    for cells in (2, 4, 8):
        local = cells_1d("y", (0.0, 1.0), values, cells)
        x = np.linspace(0.0, 1.0, 500, endpoint=False)
        i = (x * cells).astype(int)
        found = np.array([np.polyval(local[k], 2.0 * (t * cells - k) - 1.0) for t, k in zip(x, i, strict=True)])
        errors.append(np.abs(found - np.exp(np.sin(3.0 * x))).max())
    assert math.log2(errors[0] / errors[1]) == pytest.approx(WIDTH, abs=1.5)
    assert math.log2(errors[1] / errors[2]) == pytest.approx(WIDTH, abs=1.0)


def test_neighbouring_cells_meet() -> None:
    x, z = nodes(40, 0.0, 1.0), nodes(40, 0.0, 1.0)
    values = np.exp(-x[:, None]) * np.cos(2.0 * z[None, :]) + x[:, None] * z[None, :] ** 2
    coef = cells_2d(plain_block((0.0, 1.0), (0.0, 1.0)), values, (6, 6))
    for i in range(5):
        for t in np.linspace(-1.0, 1.0, 9):
            assert _value(coef, i * 6 + 2, 1.0, t) == pytest.approx(_value(coef, (i + 1) * 6 + 2, -1.0, t), abs=2e-12)
            assert _value(coef, 12 + i, t, 1.0) == pytest.approx(_value(coef, 13 + i, t, -1.0), abs=2e-12)


# --- the patch itself ---------------------------------------------------------------------------------


def test_patch_is_a_polynomial_in_falling_powers() -> None:
    coef = np.zeros((3, WIDTH, WIDTH))
    coef[1, 2, 5] = 3.0  # w^5 u^2
    coef[1, 7, 7] = -1.0
    for value in (patch_value, _value):
        assert value(coef, 1, 0.5, -0.7) == pytest.approx(3.0 * (-0.7) ** 5 * 0.5**2 - 1.0, rel=1e-15)
        assert value(coef, 0, 0.5, -0.7) == 0.0
        assert value(coef, 2, 0.5, -0.7) == 0.0


def test_compiled_patch_says_what_plain_python_says() -> None:
    rng = np.random.default_rng(8)
    coef = rng.normal(size=(50, WIDTH, WIDTH))
    for p in range(50):
        u, w = rng.uniform(-1.0, 1.0, 2)
        expected = np.polynomial.polynomial.polyval2d(w, u, coef[p, ::-1, ::-1])
        scale = np.abs(coef[p]).sum()
        assert patch_value(coef, p, u, w) == pytest.approx(expected, abs=4e-16 * scale)
        assert _value(coef, p, u, w) == pytest.approx(expected, abs=4e-16 * scale)


# --- the coordinate of stick-slip blocks --------------------------------------------------------------


@pytest.mark.parametrize("spec", BLOCKS, ids=lambda spec: spec.name)
@pytest.mark.parametrize("cells", [1, 2, 7, 40])
def test_cells_are_counted_from_one_end_of_an_axis_to_the_other(spec: BlockSpec, cells: int) -> None:
    for name, (low, high) in ((spec.a_name, spec.a), (spec.b_name, spec.b)):
        offset, pace = pace_of(name, low, high, cells)
        start, stop = evaluation_span(name, low, high)
        for x in (start, np.nextafter(start, stop), 0.5 * (start + stop), np.nextafter(stop, start), stop):
            assert 0 <= math.trunc(x * pace + offset) < cells
        assert math.trunc((start + 0.999999 * (stop - start)) * pace + offset) == cells - 1


def test_the_corners_angle_is_taken_as_the_tangent_of_its_half() -> None:
    low, high = evaluation_span("angle", 0.0, 1.0)
    for v, eta in ((1e-9, 1e-3), (1e-3, 0.0), (0.02, -0.2), (1e-7, 0.4)):
        phi, s0, radius, half = polar(v, eta)
        assert low < half < high
        assert radius == pytest.approx(math.hypot(s0 / SQRT2, SQRT2 * phi), rel=1e-15)
        angle = 2.0 / math.pi * math.atan2(2.0 * phi, s0)
        assert file_coordinate("angle", np.array([half]))[0] == pytest.approx(angle, rel=1e-14)


def test_edge_coordinate_undoes_the_map_of_the_table() -> None:
    assert edge_coordinate(0.0) == 0.0
    assert edge_coordinate(1.0) == SQRT2
    rho = np.concatenate([np.geomspace(1e-30, 0.5, 50), 1.0 - np.geomspace(1e-12, 0.5, 50)])
    sigma = np.array([edge_coordinate(r) for r in rho])
    s = s_of_sigma(sigma)
    assert np.sin(0.5 * math.pi * s) ** 2 == pytest.approx(rho, rel=1e-15, abs=0.0)
    assert np.all((s >= 0.0) & (s <= 1.0))
    rising = np.linspace(0.0, SQRT2, 1001)
    assert np.all(np.diff(s_of_sigma(rising)) > 0.0)
    assert s_of_sigma(np.array([0.0, SQRT2])) == pytest.approx([0.0, 1.0], abs=1e-15)


def test_edge_coordinate_is_continuous_at_its_knot() -> None:
    assert edge_coordinate(0.5 - 1e-15) == pytest.approx(edge_coordinate(0.5 + 1e-15), abs=4e-15)
    assert edge_coordinate(0.5) == pytest.approx(0.5 * SQRT2, abs=1e-15)


@pytest.mark.parametrize("spec", [spec for spec in BLOCKS if spec.b_name == "s"], ids=lambda spec: spec.name)
def test_cells_along_s_lie_on_the_nodes_axis_and_start_anew_at_the_knot(spec: BlockSpec) -> None:
    cells = 8
    sigma, t = (x.reshape(cells, WIDTH) for x in cell_positions("s", *spec.b, cells))
    assert np.all(np.diff(sigma.ravel()) > 0.0)
    low, high = spec.b
    s = 0.5 * (low + high) + 0.5 * (high - low) * t
    assert s.max() < high
    edges = s_of_sigma(SQRT2 * np.arange(cells + 1) / cells)
    assert edges[cells // 2] == pytest.approx(0.5, abs=1e-15)  # rho = 1/2, where the map changes its branch
    for i in range(cells):
        if edges[i + 1] <= low:
            assert np.all(s[i] == pytest.approx(low, abs=1e-15))  # never visited
        else:
            assert np.all((s[i] > edges[i]) & (s[i] < edges[i + 1]))
    x, t = cell_positions(spec.a_name, *spec.a, 3)
    assert x.shape == t.shape == (3 * WIDTH,)
    assert np.all(np.abs(t) < 1.0)


def test_cells_along_s_follow_a_smooth_function() -> None:
    spec = next(block for block in BLOCKS if block.name == "stick_slip_low")
    a, s = nodes(20, *spec.a), nodes(30, *spec.b)
    values = np.exp(-a[:, None]) * np.cos(2.0 * s[None, :])
    coef = cells_2d(spec, values, (4, 12))
    rng = np.random.default_rng(2)
    for x, sigma in zip(rng.random(200), SQRT2 * rng.random(200), strict=True):
        expected = math.exp(-x * spec.a[1]) * math.cos(2.0 * float(s_of_sigma(np.array([sigma]))[0]))
        assert at(coef, (4, 12), x, sigma / SQRT2) == pytest.approx(expected, abs=2e-9)


def test_kernel_constants_agree() -> None:
    assert kernels.WIDTH == DEGREE + 1 == 8
    assert math.sqrt(2.0) == SQRT2

"""The closed-form limits against mpmath and against the exact solver."""

import math

import mpmath
import numpy as np
import pytest

from builder.steady import border, solve
from friction import tails

R = [0.0, 1e-9, 1e-3, 0.3, 1.0, 7.0, 1e3, 1e8, 1e150]


@pytest.mark.parametrize("r", R)
def test_outer_is_the_complete_elliptic_integral(r: float) -> None:
    with mpmath.workdps(400):
        # K(i r) by its parameter m = (i r)^2
        expected = float(2 / mpmath.pi * mpmath.ellipk(-(mpmath.mpf(r) ** 2)))
    assert float(tails.outer(r)) == pytest.approx(expected, rel=5e-16)


@pytest.mark.parametrize("b", [1.0, 1.5, 1e3, 1e10, 1e300])
def test_agm(b: float) -> None:
    assert float(tails.agm(b)) == pytest.approx(float(mpmath.agm(1, b)), rel=5e-16)


def test_agm_and_outer_take_arrays() -> None:
    r = np.array([[0.1, 1.0], [10.0, 1e4]])
    assert tails.outer(r).shape == (2, 2)
    assert tails.outer(r).ravel().tolist() == [float(tails.outer(x)) for x in r.ravel()]
    assert tails.agm([1.0, 2.0]).shape == (2,)


@pytest.mark.parametrize("r", [0.01, 0.3, 1.0, 7.0, 100.0, 1e4])
def test_second_order_is_the_average_that_it_stands_for(r: float) -> None:
    with mpmath.workdps(30):

        def integrand(tau: mpmath.mpf) -> mpmath.mpf:
            c = mpmath.cos(tau) ** 2
            return (1 - c) * (mpmath.mpf(1) / 2 - r * r * c) * (1 + r * r * c) ** (-mpmath.mpf(7) / 2)

        knots = [0, mpmath.pi / 2 - min(1, 10 / r), mpmath.pi / 2 - min(mpmath.mpf(1) / 2, 1 / r), mpmath.pi / 2]
        expected = float(r * r * 2 / mpmath.pi * mpmath.quad(integrand, knots))
    assert float(tails.second_order(r)) == pytest.approx(expected, rel=1e-12, abs=2e-15)


def test_second_order_tends_to_a_quarter_of_the_square() -> None:
    assert float(tails.second_order(1e-3)) == pytest.approx(0.25e-6, rel=1e-5)
    assert float(tails.second_order(0.0)) == 0.0


@pytest.mark.parametrize("y", [0.0, 1e-200, 0.3, 0.999999, 1.0 - 2.0**-53, 1.0, 1.0 + 2.0**-52, 5.0, math.inf])
def test_static_limit(y: float) -> None:
    with mpmath.workdps(60):
        expected = float(mpmath.sqrt(1 - mpmath.mpf(y) ** 2)) if y < 1.0 else 0.0
    assert float(tails.static_limit(y)) == pytest.approx(expected, rel=4e-16, abs=0.0)


def test_static_limit_is_what_creep_tends_to() -> None:
    y = np.array([0.2, 0.9, 1.3, 50.0])
    crept = np.array([solve(1e-12, float(value)).mu_ratio for value in y])
    assert crept == pytest.approx(tails.static_limit(y), abs=4e-11)


def test_small_amplitude() -> None:
    v, y = np.array([0.5, 2.0, 50.0]), 1e-3
    solved = np.array([solve(float(value), y).deficit for value in v])
    assert 1.0 - tails.small_amplitude(v, y) == pytest.approx(solved, rel=2e-6, abs=2e-16)


def test_border_tails() -> None:
    for y in (1e-4, 1e-3, 1e-2):
        assert float(tails.border_small_amplitude(y)) == pytest.approx(border(y)[0], rel=y**4 + 1e-12)
    for y in (1e4, 1e6):
        assert float(tails.border_large_amplitude(y)) == pytest.approx(border(y)[0], rel=0.08 / y + 2e-7)


def test_the_blend_is_the_border_within_what_it_says() -> None:
    y = np.geomspace(1e-4, 1e6, 61)
    exact = np.array([border(float(value))[0] for value in y])
    assert tails.border_blend(y) == pytest.approx(exact, rel=0.006)
    assert tails.border_blend(1e-3) == pytest.approx(float(tails.border_small_amplitude(1e-3)), rel=1e-11)
    assert tails.border_blend(1e300) == pytest.approx(float(tails.border_large_amplitude(1e300)), rel=1e-12)


def test_one_formula_for_continuous_sliding() -> None:
    y = np.array([0.01, 0.3, 1.0, 3.0, 30.0, 1000.0])
    for factor in (1.0, 1.5, 4.0, 30.0):
        v = factor * np.array([border(float(value))[0] for value in y])
        exact = np.array([solve(float(a), float(b)).mu_ratio for a, b in zip(v, y, strict=True)])
        assert np.max(np.abs(tails.continuous(v, y) - exact)) < 0.041


@pytest.mark.parametrize("eta", [-0.25, -1e-3, -1e-12, 0.0, 1e-15, 1e-6, 0.6])
@pytest.mark.parametrize("v", [1e-300, 1e-30, 1e-12, 1e-4, 0.3])
def test_corner_root_solves_its_cubic(v: float, eta: float) -> None:
    with mpmath.workdps(700):
        roots = mpmath.polyroots([1, 0, 2 * mpmath.mpf(eta), -mpmath.pi * mpmath.mpf(v)], maxsteps=5000, extraprec=3000)
        expected = float(max(z.real for z in roots))
    assert float(tails.corner_root(v, eta)) == pytest.approx(expected, rel=2e-15)


def test_corner_root_broadcasts() -> None:
    root = tails.corner_root(np.array([[1e-3], [1e-5]]), np.array([-0.1, 0.0, 0.1]))
    assert root.shape == (2, 3)
    assert np.all(np.diff(root, axis=1) < 0.0)
    assert np.all(root[0] > root[1])

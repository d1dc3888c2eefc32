"""The closed-form limits against mpmath and against the exact solver."""

import math
from typing import Any

import mpmath
import numpy as np
import pytest

from builder.solver.steady import border, solve
from mumacro import closed_forms
from tests.support.comparing import close

LOW = (0.1, 0.3, 0.5, 0.7, 1.0)

R = [0.0, 1e-9, 1e-3, 0.3, 1.0, 7.0, 1e3, 1e8, 1e150]


@pytest.mark.parametrize("r", R)
def test_outer_is_the_complete_elliptic_integral(r: float) -> None:
    with mpmath.workdps(400):
        # K(i r) by its parameter m = (i r)^2
        expected = float(2 / mpmath.pi * mpmath.ellipk(-(mpmath.mpf(r) ** 2)))
    assert float(closed_forms.outer(r)) == close(expected, rel=5e-16)


@pytest.mark.parametrize("r", [1e-3, 0.01, 0.3, 1.0, 7.0, 100.0, 1e4])
def test_second_order_is_its_defining_average(r: float) -> None:
    with mpmath.workdps(30):

        def integrand(tau: mpmath.mpf) -> mpmath.mpf:
            c = mpmath.cos(tau) ** 2
            return (
                (1 - c) * (mpmath.mpf(1) / 2 - r * r * c) * (1 + r * r * c) ** (-mpmath.mpf(7) / 2)
            )

        knots = [
            0,
            mpmath.pi / 2 - min(1, 10 / r),
            mpmath.pi / 2 - min(mpmath.mpf(1) / 2, 1 / r),
            mpmath.pi / 2,
        ]
        expected = float(r * r * 2 / mpmath.pi * mpmath.quad(integrand, knots))
    assert float(closed_forms.second_order(r)) == close(expected, rel=1e-12, abs=2e-15)


@pytest.mark.parametrize(
    "y", [0.0, 1e-200, 0.3, 0.999999, 1.0 - 2.0**-53, 1.0, 1.0 + 2.0**-52, 5.0, math.inf]
)
def test_static_limit(y: float) -> None:
    with mpmath.workdps(60):
        expected = float(mpmath.sqrt(1 - mpmath.mpf(y) ** 2)) if y < 1.0 else 0.0
    assert float(closed_forms.static_limit(y)) == close(expected, rel=4e-16)


@pytest.mark.parametrize("eta", [-0.25, -1e-3, -1e-12, 0.0, 1e-15, 1e-6, 0.6])
@pytest.mark.parametrize("v", [1e-300, 1e-30, 1e-12, 1e-4, 0.3])
def test_corner_root_solves_its_cubic(v: float, eta: float) -> None:
    with mpmath.workdps(700):
        roots = mpmath.polyroots(
            [1, 0, 2 * mpmath.mpf(eta), -mpmath.pi * mpmath.mpf(v)], maxsteps=5000, extraprec=3000
        )
        expected = float(max(z.real for z in roots))
    assert float(closed_forms.corner_root(v, eta)) == close(expected, rel=2e-15)


def critical_of(y: float) -> float:
    return border(y)[1]


@pytest.mark.parametrize("name", ["23", "24", "26", "27", "large_amplitude", "blend"])
def test_a_formula_of_the_border_keeps_its_digits_at_both_ends(name: str) -> None:
    formula = getattr(closed_forms, f"border_{name}")
    y = np.array([0.0, 1e-150, 1e-9, 1e-3, 1.0, 1e3, 1e160, 1e300])
    result = formula(y)
    assert result.shape == y.shape
    assert result[0] == 0.0
    assert np.all(np.diff(result[1:]) > 0.0)
    assert np.all(np.isfinite(result))
    growth = 1e100 if name == "24" else 1e50  # the others grow like the square root
    assert float(formula(1e300)) == close(growth * float(formula(1e200)), rel=1e-14)
    # small y~: the formulas for large amplitudes grow like the square root here too, the others
    # like the square
    rise = 1e3 if name in ("26", "large_amplitude") else 1e12
    assert float(formula(1e-9)) == close(float(formula(1e-15)) * rise, rel=1e-13)


@pytest.mark.parametrize("y", [1e-8, 1e-3, 0.3, 1.0, 7.0, 1e6])
def test_equation_23_is_solved(y: float) -> None:
    v = float(closed_forms.border_23(y))
    root = math.hypot(1.0, v)
    assert 2.0 * v * root * root * (root + v) == close(y * y, rel=4e-15)


def test_the_small_angle_average_is_the_bessel_function() -> None:
    v = np.array([0.0, 0.3, 5.0])[:, None]
    y = np.array([0.0, 1e-3, 1.0, 6.0])
    expected = [
        [float(mpmath.besselj(0, float(b) / math.hypot(1.0, float(a)))) for b in y] for a in v[:, 0]
    ]
    assert closed_forms.small_angle(v, y) == close(np.array(expected), abs=3e-16)


@pytest.mark.parametrize(
    ("formula", "deviations"),
    [
        (lambda y: closed_forms.small_angle(border(y)[0], y), (6e-6, 5e-4, 3.7e-3, 1.35e-2, 0.048)),
        (
            lambda y: closed_forms.small_amplitude(border(y)[0], y),
            (8e-6, 6e-4, 4.7e-3, 1.8e-2, 0.063),
        ),
        (closed_forms.critical, (7.87e-6, 6.69e-4, 5.53e-3, 2.227e-2, 0.0922)),
        (closed_forms.critical_next, (3.6e-8, 2.3e-5, 3.5e-4, 1.37e-3, 2.42e-3)),
    ],
)
def test_a_formula_for_continuous_sliding_is_off_by_what_was_measured(
    formula: Any, deviations: Any
) -> None:
    for y, deviation in zip(LOW, deviations, strict=True):
        assert abs(float(formula(y)) / critical_of(y) - 1.0) == close(deviation, rel=0.1)


def normalised(y: float, x: np.ndarray) -> np.ndarray:
    """(mu~ - static) / (critical - static) of the full model at v~ = x v~crit."""
    crit, top = border(y)
    # from the deficits 1 - mu~, which keep their digits at small amplitudes
    loss = (
        1.0 - float(closed_forms.static_limit(y))
        if y > 1e-3
        else 0.5 * y * y * (1.0 + 0.25 * y * y)
    )
    deficit = np.array([solve(float(share) * crit, y).deficit for share in x])
    return (loss - deficit) / (
        loss - (1.0 - top if y > 1e-3 else solve(crit * (1.0 + 1e-15), y).deficit)
    )


def test_the_master_curve_tends_to_its_limit() -> None:
    x = np.linspace(0.02, 1.0, 50)
    exact = closed_forms.master_curve_limit(x)
    assert np.abs(normalised(1e-4, x) - exact).max() < 1e-8
    for y, deviation in ((0.1, 2.2e-4), (0.3, 1.56e-3), (0.5, 5.5e-3)):
        assert np.abs(normalised(y, x) - exact).max() == close(deviation, rel=0.05)


def test_equation_28_is_a_fit_to_the_limit() -> None:
    x = np.linspace(0.0, 1.0, 20_001)
    off = closed_forms.master_curve(x) - closed_forms.master_curve_limit(x)
    assert off.min() == close(-0.014362, abs=1e-6)
    assert x[np.argmin(off)] == close(0.1039, abs=2e-4)
    assert off.max() <= 1e-15


@pytest.mark.parametrize(
    "x", [pytest.param(1e-200, marks=pytest.mark.slow), 1e-12, 1e-4, 0.1, 0.5, 0.9, 1.0 - 1e-9]
)
def test_the_limit_of_the_master_curve_solves_its_equation(x: float) -> None:
    with mpmath.workdps(460 if x < 1e-100 else 60):
        a = mpmath.acos(x)
        # sin t2 - sin t1 = x (t2 - t1) in half the duration h of stick: sin h cos(h - a) falls
        # below h cos a
        low, high = a, +mpmath.pi
        for _ in range(int(3.4 * mpmath.mp.dps)):
            h = (low + high) / 2
            low, high = (
                (h, high) if mpmath.sin(h) * mpmath.cos(h - a) > h * mpmath.cos(a) else (low, h)
            )
        stick = 2 * h * mpmath.sin(-a) + 2 * x * h * h + mpmath.cos(2 * h - a) - mpmath.cos(a)
        expected = float(1 + stick / (2 * mpmath.pi))
    assert float(closed_forms.master_curve_limit(x)) == close(expected, rel=2e-14)


def test_the_master_curves_end_where_they_should() -> None:
    assert closed_forms.master_curve_limit([0.0, 1.0, 2.0, math.inf]) == close(
        [0.0, 1.0, 1.0, 1.0], rel=3e-16
    )
    np.testing.assert_array_equal(
        closed_forms.master_curve([0.0, 1.0, 1.5, math.inf]), [0.0, 1.0, math.nan, math.nan]
    )
    assert np.all(np.diff(closed_forms.master_curve_limit(np.linspace(0.0, 1.0, 1001))) > 0.0)

"""A ball: quadrature over springs against marched springs, adaptive quadrature, closed forms;
bounds."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from mumacro import Surrogate
from mumacro.table.atlas import QUANTITY_NAMES, SOURCES
from tests.support.cases import CASE, Case, tables
from tests.support.comparing import close
from tests.support.naive import march_ball

BALL: Case = {"contact": "ball"}
table = tables(1e-12)


def by_quad(
    table: Surrogate, name: str, v: float, y: float, direction: Any = "across", *cuts: float
) -> float:
    """The integral over springs of the same table, adaptively, split at ``cuts``, at the border and
    at y~ = 1."""

    def share(xi: float) -> float:
        s = 1.0 - xi * xi
        weight = 1.5 * s * (1.5 * s if name == "power" else 1.0)
        return float(
            weight * table.quantity(name, v / (1.5 * s), y / (1.5 * s), direction=direction)[0]
        )

    def beyond(xi: float) -> float:
        s = 1.0 - xi * xi
        return float(v / (1.5 * s) - table.v_tilde_crit(y / (1.5 * s), direction=direction))

    xi = 1.0 - np.geomspace(1.0, 1e-9, 4000)
    slides = np.array([beyond(x) >= 0.0 for x in xi])
    turns = np.flatnonzero(slides[1:] != slides[:-1])
    ends = [0.0, *cuts, *(brentq(beyond, xi[i], xi[i + 1], xtol=1e-15) for i in turns), 1.0 - 1e-12]
    if y < 1.5:
        ends.append(math.sqrt(1.0 - y / 1.5))
    return sum(
        quad(share, a, b, epsabs=1e-13, epsrel=1e-13, limit=400)[0]
        for a, b in itertools.pairwise(sorted(ends))
    )


@pytest.mark.slow
@pytest.mark.parametrize(("v", "y"), [(0.05, 0.4), (0.3, 2.5), (1.2, 1.0)])
def test_marched_springs(table: Surrogate, v: Any, y: Any) -> None:
    coarse, fine = (march_ball(v, y, 300, steps) for steps in (1500, 3000))
    assert table.quantity("mu_ratio", v, y, **BALL)[0] == close(2.0 * fine - coarse, abs=2e-5)
    assert table.quantity("mu_ratio", 0.05, 0.4, **BALL)[0] == close(0.94910928, abs=5e-9)


@pytest.mark.parametrize("name", QUANTITY_NAMES)
def test_adaptive_quadrature(table: Surrogate, name: str) -> None:
    rng = np.random.default_rng(5)
    for _ in range(8 if name == "mu_ratio" else 3):
        v, y = 10.0 ** rng.uniform(-3, 1), 10.0 ** rng.uniform(-1.5, 1.5)
        value, bound, _ = table.quantity(name, v, y, **BALL)
        assert value == close(
            by_quad(table, name, v, y), abs=1e-10 + (bound if name == "stick_fraction" else 0.0)
        )


def test_static_limit(table: Surrogate) -> None:
    for y in (1e-9, 1e-3, 0.1, 0.7, 1.3, 1.499999):
        e = y / 1.5
        m = (1.0 - e) / (1.0 + e)
        closed = math.sqrt(1.0 + e) * (ellipe(m) - e * ellipk(m))
        integral = (
            1.5
            * quad(
                lambda xi, e=e: math.sqrt(max((1 - xi * xi) ** 2 - e * e, 0.0)), 0, math.sqrt(1 - e)
            )[0]
        )
        mu, bound, source = table.quantity("mu_ratio", 0.0, y, **BALL)
        assert mu == close(closed, abs=bound)
        assert mu == close(integral, abs=1e-8)
        assert table.quantity("mu_ratio", 1e-16, y, **BALL)[0] == close(mu, abs=1e-11)
        assert SOURCES[source] == "static_limit"
    assert table.quantity("mu_ratio", 0.0, [1.5, 1.6, 1e9], **BALL)[0].tolist() == [0.0, 0.0, 0.0]


def test_border(table: Surrogate) -> None:
    assert table.v_tilde_crit(1.0, **BALL) == close(0.33517, abs=5e-6)
    for y in (0.01, 1.0, 1.9, 1.94, 5.0, 1e3):
        s = np.geomspace(1e-6, 1.0, 20001)
        assert table.v_tilde_crit(y, **BALL) == close(
            np.max(1.5 * s * table.v_tilde_crit(y / (1.5 * s))), rel=1e-6
        )
        crit = table.v_tilde_crit(y, **BALL)
        codes = [table.quantity("mu_ratio", crit * x, y, **BALL)[2] for x in (0.999, 1.001)]
        assert [SOURCES[code] for code in codes] == ["ball_partial_slip", "ball_continuous"]
        assert (
            table.stick_fraction(crit * 1.001, y, **BALL)
            == 0.0
            < table.stick_fraction(crit * 0.99, y, **BALL)
        )


def test_rigid_and_other_limits(table: Surrogate) -> None:
    for changes in (
        {"k": "rigid"},
        {"k": 1e300},
        {"y0": 0.0},
        {"omega": 0.0},
        {"v0": 0.0, "k": math.inf},
    ):
        ball, spring = (
            table.evaluate(**{**CASE, **changes}, contact=contact) for contact in ("ball", "spring")
        )
        assert ball.mu_macro == close(spring.mu_macro, abs=1e-15)
    # from rest the slope is infinite until all springs slip, then that of any small speed
    for y0, slope in (
        (2e-6, math.inf),
        (
            9e-6,
            close(
                table.evaluate(**{**CASE, "y0": 9e-6, "v0": 1e-9}, **BALL).mu_macro / 1e-9, rel=1e-4
            ),
        ),
    ):
        still = table.evaluate(**{**CASE, "y0": y0, "v0": 0.0}, **BALL, gradient=True)
        assert (still.regime, still.gradient["v0"]) == ("static", slope)


#: amplitudes at which blocks of a ball meet or its middle spring is at the corner
MIDDLE_SEAMS = (0.75, 1.0, 1.29079076185, 2.0, 131_072.0)


@pytest.mark.parametrize("name", QUANTITY_NAMES)
@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-10, 1e-12])
def test_one_digit_beside_a_seam_changes_an_answer_by_its_bounds_at_most(
    tolerance: float, name: str
) -> None:
    """Y = y~/1.5 rounds to a seam from both sides."""
    v = np.concatenate([[0.0], np.geomspace(1e-300, 1e300, 300), np.geomspace(1e-18, 1e3, 400)])
    steps = np.arange(-6, 7)
    y = 1.5 * np.array(MIDDLE_SEAMS)[:, None] * (1.0 + 2.3e-16 * steps)
    value, bound, source = Surrogate.open(tolerance).quantity(name, v, y[..., None], **BALL)
    assert np.isfinite(value).all()
    assert np.isfinite(bound).all()
    assert (source >= 0).all()
    allowed = bound[:, 1:] + bound[:, :-1] + 1e-14 * np.abs(value[:, 1:])
    assert np.all(np.abs(np.diff(value, axis=1)) <= allowed)

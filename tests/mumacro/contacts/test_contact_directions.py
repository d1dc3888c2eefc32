"""Oscillation along the sliding direction and of the normal force: against a play operator, closed
forms, limits."""

import math
from typing import Any

import mpmath
import numpy as np
import pytest

from mumacro import Surrogate
from mumacro.closed_forms import master_curve_limit, reverse_slip
from mumacro.table.atlas import QUANTITY_NAMES, SOURCES
from tests.mumacro.contacts.test_contact_ball import by_quad
from tests.mumacro.kernel.test_tight_bounds import play
from tests.support.cases import CASE, UNIT, Case, opened, tables, without
from tests.support.comparing import close

ALONG: Case = {"direction": "along"}
NORMAL: Case = {"direction": "normal"}
table = tables(1e-4)


def test_the_play_operator_marched_by_events(table: Surrogate) -> None:
    """At any amplitude, near the border and where reverse slip begins."""
    rng, n, cycles = np.random.default_rng(1), 250, set()
    a = 10.0 ** rng.uniform(-2, 3, n)
    x = np.where(
        rng.random(n) < 0.5, 10.0 ** rng.uniform(-5, 0, n), 1.0 - 10.0 ** rng.uniform(-6, 0, n)
    )
    corner = 1.0 + 10.0 ** rng.uniform(-6, -1, n) * rng.choice([-1.0, 1.0], n)
    for v, y in zip(
        np.append(a * x, x * 1e-2).tolist(), np.append(a, corner).tolist(), strict=True
    ):
        with mpmath.workdps(30):
            exact = [float(value) for value in play(mpmath.mpf(v), mpmath.mpf(y))]
        for name, expected in zip(("mu_ratio", "stick_fraction", "power"), exact, strict=True):
            value, bound, source = table.quantity(name, v, y, **ALONG)
            assert abs(value - expected) <= bound + 1e-16 * abs(expected), (name, v, y)
            assert bound <= (1e-7 if name == "stick_fraction" else 1e-9 * max(1.0, y))
        cycles.add(SOURCES[source])
    assert cycles == {"along_stick_slip", "along_reverse_slip"}


def test_any_amplitude_up_to_the_largest_number(table: Surrogate) -> None:
    """There mu~ is that of rigid contact, and the contact sticks until it has moved through both
    limits."""
    y = 10.0 ** np.random.default_rng(4).uniform(40, 305, 20_000)
    x = 10.0 ** np.random.default_rng(5).uniform(-12, -0.01, y.size)
    (mu, *_), (stick, bound, _) = (
        table.quantity(name, x * y, y, **ALONG) for name in ("mu_ratio", "stick_fraction")
    )
    assert mu == close(2.0 / math.pi * np.arcsin(x), abs=1e-15)
    assert stick == close(2.0 / math.pi / np.sqrt(y * np.sqrt((1.0 - x) * (1.0 + x))), rel=1e-12)
    assert np.all(bound < 1e-12)
    assert np.isfinite(table.quantity("stick_fraction", 1.0, 1.7e308, **ALONG)[1])


def test_creeping_speeds_keep_their_digits(table: Surrogate) -> None:
    """With reverse slip mu~ is proportional to v~."""
    for a in (1.01, 1.5, 10.0, 1e4):
        slope = table.quantity("mu_ratio", 1e-6, a, **ALONG)[0] / 1e-6
        for v in (1e-8, 1e-12, 1e-100):
            assert table.quantity("mu_ratio", v, a, **ALONG)[0] / v == close(
                slope, rel=1e-6 * max(a / (a - 1.0), 1.0) ** 2
            )


def test_static_and_continuous(table: Surrogate) -> None:
    for a in (0.0, 0.3, 1.0, 2.0):
        assert table.quantity("mu_ratio", 0.0, a, **ALONG)[0] == close(max(1.0 - a, 0.0), abs=1e-15)
        mu, bound, source = table.quantity("mu_ratio", a * (1 + 1e-9), a, **ALONG)
        assert (mu, bound) == (1.0, 0.0)
        assert SOURCES[source] == ("along_continuous" if a else "no_oscillation")
    assert table.v_tilde_crit([0.5, 2.0], **ALONG).tolist() == [0.5, 2.0]
    assert np.isnan(table.v_tilde_crit([-1.0, np.nan], **ALONG)).all()


@pytest.mark.parametrize("ratio", [0.1, 0.5, 0.99, 1.0, 2.0])
def test_rigid_contact_is_the_mean_direction_of_slip_and_the_limit_of_stiff_ones(
    table: Surrogate, ratio: Any
) -> None:
    case = {**CASE, "v0": ratio * CASE["y0"] * CASE["omega"]}
    rigid = table.evaluate(**{**case, "k": "rigid"}, **ALONG, gradient=True)
    if ratio != 1.0:
        stiff = table.evaluate(**{**case, "k": 1e18}, **ALONG)
        assert rigid.regime == stiff.regime == ("reverse_slip" if ratio < 1.0 else "continuous")
    assert rigid.mu_macro == close(0.3 * 2.0 / math.pi * math.asin(min(ratio, 1.0)), rel=1e-15)
    assert table.evaluate(**{**case, "k": 1e18}, **ALONG).mu_macro == close(
        rigid.mu_macro, abs=1e-6 if ratio < 1.0 else 1e-3
    )
    if ratio < 0.9:
        expected = 0.3 * 2.0 / math.pi / math.sqrt(1.0 - ratio**2) * ratio / case["v0"]
        assert rigid.gradient["v0"] == close(expected, rel=1e-12)


def test_normal_is_the_master_curve_and_a_marched_spring(table: Surrogate) -> None:
    """u <- min(u + v d tau, 1 + z cos tau)."""
    rng = np.random.default_rng(2)
    z, v = rng.uniform(0.0, 0.999, 300), 10.0 ** rng.uniform(-8, 0.5, 300)
    mu, bound, source = table.quantity("mu_ratio", v, z, **NORMAL)
    assert mu == close(1.0 - z * (1.0 - master_curve_limit(v / z)), abs=1e-14)
    assert bound.max() < 1e-13
    assert {SOURCES[code] for code in source} == {"normal_continuous", "normal_stick_slip"}
    case = {**without(CASE, "y0"), "Fz_amplitude": 4.0}
    assert table.evaluate(**{**case, "v0": 0.0}, **NORMAL).mu_macro == close(0.3 * 0.6, rel=1e-15)
    assert table.evaluate(**{**case, "k": "rigid"}, **NORMAL).mu_macro == 0.3
    speed, share, steps, u = 0.05, 0.6, 200_000, 1.0
    limit = 1.0 + share * np.cos(2.0 * np.pi * np.arange(1, steps + 1) / steps)
    rising = speed * 2.0 * np.pi / steps * np.arange(1, steps + 1)
    for _ in range(3):
        path = np.minimum.accumulate(np.concatenate([[u], limit - rising]))[1:] + rising
        u = path[-1]
    assert table.quantity("mu_ratio", speed, share, **NORMAL)[0] == close(path.mean(), abs=2e-5)


def test_where_reverse_slip_begins_the_slopes_jump_and_the_bound_says_so(table: Surrogate) -> None:
    a = float(reverse_slip(0.25))
    v = 0.25 * a
    below, at, above = (
        table.evaluate(**UNIT, y0=a * x, v0=v, **ALONG, gradient=True)
        for x in (1 - 1e-9, 1, 1 + 1e-9)
    )
    assert (below.regime, above.regime) == ("stick_slip", "reverse_slip")
    assert below.mu_macro == close(above.mu_macro, abs=1e-8)
    jump = abs(below.gradient["y0"] - above.gradient["y0"])
    assert jump > 0.02
    assert at.gradient_bound["y0"] > 0.5 * jump


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-12])
def test_a_ball_along_is_its_springs(tolerance: Any) -> None:
    s, rng = opened(tolerance), np.random.default_rng(8)
    for _ in range(12):
        a = 10.0 ** rng.uniform(-1, 1.5)
        v = a * rng.uniform(0.01, 1.0)
        travel = 2.0 * (math.sqrt(a * a - v * v) - v * math.acos(v / a))
        for name in QUANTITY_NAMES:
            value, bound, source = s.quantity(name, v, a, contact="ball", **ALONG)
            whole = by_quad(s, name, v, a, "along", math.sqrt(max(1.0 - travel / 3.0, 0.0)))
            assert value == close(whole, abs=1e-11 + bound)
            assert SOURCES[source] == "along_reverse_slip"
    assert s.quantity("mu_ratio", 1.0, 0.99, contact="ball", **ALONG)[0] == 1.0

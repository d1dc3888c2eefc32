"""Oscillation along the sliding direction and of the normal force: against a play operator marched by events."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from mumacro import InputError, Surrogate
from mumacro.charts import SOURCES
from mumacro.closed_forms import master_curve_limit
from tests.comparing import close

CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "omega": 1.3e5, "v0": 0.01}
ALONG, NORMAL = {"direction": "along"}, {"direction": "normal"}


@pytest.fixture(scope="module")
def table():
    return Surrogate.open(1e-4)  # closed forms need no table


def play(v: float, a: float) -> tuple[float, float, float]:
    """(mu~, share of stick, power) of u <- clip(u + dx, -1, 1), x = v tau + a sin tau, event by event over one period.

    The period starts where the upper point turns back: there u = 1.
    """

    def x(tau: float) -> float:
        return v * tau + a * math.sin(tau)

    def integrals(low: float, high: float, offset: float) -> tuple[float, float]:
        """Of u = x - offset, and of u a cos tau."""
        mean = 0.5 * v * (high**2 - low**2) - a * (math.cos(high) - math.cos(low)) - offset * (high - low)
        work = v * (high * math.sin(high) - low * math.sin(low) + math.cos(high) - math.cos(low))
        work += 0.5 * a * (math.sin(high) ** 2 - math.sin(low) ** 2) - offset * (math.sin(high) - math.sin(low))
        return mean, a * work

    back = math.pi - math.acos(v / a)
    forth, end = 2.0 * math.pi - back, back + 2.0 * math.pi
    tau, u, mean, stuck, power = back, 1.0, 0.0, 0.0, 0.0
    for turn, limit in ((forth, -1.0), (end, 1.0)):
        offset = x(tau) - u
        reaches = (x(turn) - offset - limit) * limit >= 0.0
        stop = brentq(lambda t, o=offset, m=limit: x(t) - o - m, tau, turn, xtol=1e-15, rtol=1e-15) if reaches else turn
        for value in integrals(tau, stop, offset)[:1]:
            mean += value
        power += integrals(tau, stop, offset)[1]
        stuck += stop - tau
        u = limit if reaches else x(turn) - offset
        mean += (turn - stop) * limit if reaches else 0.0
        power += a * limit * (math.sin(turn) - math.sin(stop)) if reaches else 0.0
        tau = turn
    assert u == 1.0
    return mean / (2.0 * math.pi), stuck / (2.0 * math.pi), power / (2.0 * math.pi)


def cases(count: int, seed: int) -> list[tuple[float, float]]:
    rng = np.random.default_rng(seed)
    a = 10.0 ** rng.uniform(-2, 3, count)
    x = np.where(rng.random(count) < 0.5, 10.0 ** rng.uniform(-5, 0, count), 1.0 - 10.0 ** rng.uniform(-6, 0, count))
    corner = 1.0 + 10.0 ** rng.uniform(-6, -1, count) * rng.choice([-1.0, 1.0], count)
    return [*zip((a * x).tolist(), a.tolist(), strict=True), *zip((x * 1e-2).tolist(), corner.tolist(), strict=True)]


def test_play_operator(table):
    seen = set()
    for v, a in cases(400, 1):
        mu, stick, power = play(v, a)
        value, bound, source = table.ratio_with_bound(v, a, **ALONG)
        assert value == close(mu, abs=1e-12 * max(1.0, 1e-3 * a))  # the marching adds up terms of the size of a
        assert bound < 1e-9
        assert table.stick_fraction(v, a, **ALONG) == close(stick, abs=1e-7 if abs(stick) < 1.0 else 1e-12)
        assert table.power(v, a, **ALONG) == close(power, abs=1e-11 * max(1.0, a))
        seen.add(SOURCES[source])
    assert seen == {"along_stick_slip", "along_reverse_slip"}


def test_creeping_speeds_keep_their_digits(table):
    """With reverse slip mu~ is proportional to v~."""
    for a in (1.01, 1.5, 10.0, 1e4):
        slope = table.ratio_with_bound(1e-6, a, **ALONG)[0] / 1e-6
        for v in (1e-8, 1e-12, 1e-100):
            assert table.ratio_with_bound(v, a, **ALONG)[0] / v == close(slope, rel=1e-6 * max(a / (a - 1.0), 1.0) ** 2)


def test_static_and_continuous(table):
    for a in (0.0, 0.3, 1.0, 2.0):
        assert table.ratio_with_bound(0.0, a, **ALONG)[0] == close(max(1.0 - a, 0.0), abs=1e-15)
        mu, bound, source = table.ratio_with_bound(a * (1 + 1e-9), a, **ALONG)
        assert (mu, bound) == (1.0, 0.0)
        assert SOURCES[source] == ("along_continuous" if a else "no_oscillation")
    assert table.v_tilde_crit([0.5, 2.0], **ALONG).tolist() == [0.5, 2.0]
    assert np.isnan(table.v_tilde_crit([-1.0, np.nan], **ALONG)).all()


def test_rigid(table):
    """The mean direction of slip; also the limit of large stiffness."""
    for ratio in (0.1, 0.5, 0.99, 1.0, 2.0):
        case = {**CASE, "y0": 2e-6, "v0": ratio * 2e-6 * CASE["omega"]}
        rigid = table.evaluate(**{**case, "k": None}, **ALONG, gradient=True)
        assert rigid.mu_macro == close(0.3 * 2.0 / math.pi * math.asin(min(ratio, 1.0)), rel=1e-15)
        stiff = table.evaluate(**{**case, "k": 1e18}, **ALONG)
        assert stiff.mu_macro == close(rigid.mu_macro, abs=1e-6 if ratio < 1.0 else 1e-3)
        if ratio < 0.9:
            expected = 0.3 * 2.0 / math.pi / math.sqrt(1.0 - ratio**2) * ratio / case["v0"]
            assert rigid.gradient["v0"] == close(expected, rel=1e-12)


def test_normal(table):
    rng = np.random.default_rng(2)
    z, x = rng.uniform(0.0, 1.0, 500), 10.0 ** rng.uniform(-12, 0.2, 500)
    value, bound, source = table.ratio_with_bound(z * x, z, **NORMAL)
    assert value == close(1.0 - z * (1.0 - master_curve_limit(x)), abs=1e-14)
    assert bound.max() < 1e-13
    assert {SOURCES[code] for code in source} == {"normal_continuous", "normal_stick_slip"}
    assert table.evaluate(**{**CASE, "v0": 0.0}, Fz_amplitude=4.0, **NORMAL).mu_macro == close(0.3 * 0.6, rel=1e-15)
    assert table.evaluate(**{**CASE, "k": None}, Fz_amplitude=4.0, **NORMAL).mu_macro == 0.3


def test_normal_by_steps():
    """u <- min(u + v d tau, 1 + z cos tau), marched."""
    v, z, steps = 0.05, 0.6, 200_000
    limit = 1.0 + z * np.cos(2.0 * np.pi * np.arange(1, steps + 1) / steps)
    rising = v * 2.0 * np.pi / steps * np.arange(1, steps + 1)
    u = 1.0
    for _ in range(3):
        path = np.minimum.accumulate(np.concatenate([[u], limit - rising]))[1:] + rising
        u = path[-1]
    assert Surrogate.open(1e-4).ratio_with_bound(v, z, **NORMAL)[0] == close(path.mean(), abs=2e-5)


@pytest.mark.parametrize("kind", [ALONG, NORMAL, {**ALONG, "contact": "ball"}], ids=str)
def test_gradient(table, kind):
    rng = np.random.default_rng(6)
    for _ in range(40):
        case = {name: x * 10.0 ** rng.uniform(-0.7, 0.7) for name, x in CASE.items()}
        if kind is NORMAL:
            case["Fz_amplitude"] = rng.uniform(0.05, 0.95) * case["Fz"]
        else:
            case["y0"] = 3e-6 * 10.0 ** rng.uniform(-0.7, 0.7)
        found = table.evaluate(**case, **kind, gradient=True)
        assert list(found.gradient) == [n for n in ("mu0", "Fz", "k", "y0", "Fz_amplitude", "omega", "v0") if n in case]
        for name, x in case.items():
            up, down = (table.evaluate(**{**case, name: x * (1.0 + h)}, **kind) for h in (1e-6, -1e-6))
            if {up.source_code, down.source_code} != {found.source_code}:
                continue
            difference = (up.mu_macro - down.mu_macro) / (2e-6 * x)
            noise = (up.error_bound + down.error_bound) / (2e-6 * x) + 1e-5 * case["mu0"] / x
            assert found.gradient[name] == close(difference, abs=noise + found.gradient_bound[name])


def test_where_reverse_slip_begins(table):
    """mu~ is continuous there, its slopes jump: the bound says so."""
    v = 0.5
    a = brentq(lambda a: 2.0 * (math.sqrt(a * a - v * v) - v * math.acos(v / a)) - 2.0, 1.0, 5.0, xtol=1e-15)
    below, above = (table.evaluate(mu0=1, Fz=1, k=1, y0=a * x, omega=1, v0=v, **ALONG, gradient=True)
                    for x in (1 - 1e-9, 1 + 1e-9))  # fmt: skip
    assert (below.regime, above.regime) == ("stick_slip", "reverse_slip")
    assert below.mu_macro == close(above.mu_macro, abs=1e-8)
    jump = abs(below.gradient["y0"] - above.gradient["y0"])
    at = table.evaluate(mu0=1, Fz=1, k=1, y0=a, omega=1, v0=v, **ALONG, gradient=True)
    assert jump > 0.05
    assert at.gradient_bound["y0"] > 0.5 * jump


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-12])
def test_ball_along(tolerance):
    s, rng = Surrogate.open(tolerance), np.random.default_rng(8)
    for _ in range(12):
        a = 10.0 ** rng.uniform(-1, 1.5)
        v = a * rng.uniform(0.01, 1.0)

        def share(xi, name, v=v, a=a):
            load = 1.0 - xi * xi
            weight = 1.5 * load * (1.5 * load if name == "power" else 1.0)
            return weight * s.quantity(name, v / (1.5 * load), a / (1.5 * load), **ALONG)[0]

        travel = 2.0 * (math.sqrt(a * a - v * v) - v * math.acos(v / a))
        cut = math.sqrt(max(1.0 - travel / 3.0, 0.0))
        for name in ("mu_ratio", "power", "stick_fraction"):
            whole = sum(quad(share, lo, hi, (name,), epsabs=1e-13, epsrel=1e-13, limit=300)[0]
                        for lo, hi in ((0.0, cut), (cut, 1.0 - 1e-10)))  # fmt: skip
            value, bound, source = s.quantity(name, v, a, contact="ball", **ALONG)
            assert value == close(whole, abs=1e-11 + bound)
            assert SOURCES[source] == "along_reverse_slip"
    assert s.ratio_with_bound(1.0, 0.99, contact="ball", **ALONG)[0] == 1.0


def test_any_groups(table):
    size = np.array([0.0, 5e-324, 1e-300, 1e-150, 1e-10, 0.5, 1.0, 1e10, 1e150, 1e281, 1.7e308])
    v, y = (a.ravel() for a in np.meshgrid(size, size))
    for kind in (ALONG, {**ALONG, "contact": "ball"}, NORMAL):
        mu, bound, source = table.ratio_with_bound(v, y, **kind)
        legal = y < 1.0 if kind is NORMAL else y < np.inf
        assert np.all((mu >= 0.0) & (mu <= 1.0) & (bound >= 0.0) & (source >= 0) | ~legal)
        assert np.all(np.isnan(mu[~legal]) & (source[~legal] == -1))


def test_refusals(table):
    for given, field, said in (
        ({"Fz_amplitude": 10.0}, "Fz_amplitude", "lifts off"), ({"Fz_amplitude": -1.0}, "Fz_amplitude", ">= 0"),
        ({}, "Fz_amplitude", "given"), ({"Fz_amplitude": 1.0, "y0": 1.0}, "y0", "left out"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=said) as caught:
            table.evaluate(**CASE, **given, **NORMAL)
        assert caught.value.field == field
    many = table.evaluate(**CASE, Fz_amplitude=[1.0, 10.0, 11.0], **NORMAL)
    assert many.source_code.tolist()[1:] == [-1, -1]
    with pytest.raises(InputError, match="Fz_amplitude at index 1"):
        table.evaluate(**CASE, Fz_amplitude=[1.0, 10.0, 11.0], illegal="raise", **NORMAL)
    with pytest.raises(InputError, match="not modelled"):
        table.power(0.1, 0.5, **NORMAL)
    with pytest.raises(InputError, match="< 1"):
        table.ratio_with_bound(0.1, 1.0, **NORMAL)

"""A ball: quadrature over springs against marched springs, adaptive quadrature, closed forms; bounds; arrays."""

import math
import pickle

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from mumacro import InputError, Surrogate
from mumacro.charts import SOURCES
from mumacro.contact import kind_of, rules
from tests.comparing import close
from tests.naive import march_ball

CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
BALL = {"contact": "ball"}


@pytest.fixture(scope="module")
def table():
    return Surrogate.open(1e-12)


def points(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Log-uniform, and around the corner, the border and the steepest ray."""
    rng = np.random.default_rng(seed)
    v = 10.0 ** rng.uniform(-6, 4, count)
    y = 10.0 ** rng.uniform(-4, 4, count)
    near = 1.5 * (1.0 + 10.0 ** rng.uniform(-7, 0, count) * rng.choice([-0.99, 1.0], count))
    steep = 0.33516779066085 * y * (1.0 + 10.0 ** rng.uniform(-9, -1, count) * rng.choice([-1.0, 1.0], count))
    return np.concatenate([v, 10.0 ** rng.uniform(-8, 0, count), steep]), np.concatenate([y, near, y])


def by_quad(table: Surrogate, name: str, v: float, y: float) -> float:
    """The integral over springs of the same table, adaptively, split where springs cross the border and y~ = 1."""

    def share(xi: float) -> float:
        s = 1.0 - xi * xi
        weight = 1.5 * s * (1.5 * s if name == "power" else 1.0)
        return weight * table.quantity(name, v / (1.5 * s), y / (1.5 * s))[0]

    def beyond(xi: float) -> float:
        s = 1.0 - xi * xi
        return v / (1.5 * s) - table.v_tilde_crit(y / (1.5 * s))

    xi = 1.0 - np.geomspace(1.0, 1e-9, 4000)
    slides = np.array([beyond(x) >= 0.0 for x in xi])
    turns = np.flatnonzero(slides[1:] != slides[:-1])
    cuts = [0.0, *(brentq(beyond, xi[i], xi[i + 1], xtol=1e-15) for i in turns), 1.0 - 1e-12]
    if y < 1.5:
        cuts.append(math.sqrt(1.0 - y / 1.5))
    return sum(
        quad(share, a, b, epsabs=1e-13, epsrel=1e-13, limit=400)[0]
        for a, b in zip(sorted(cuts), sorted(cuts)[1:], strict=False)
    )


@pytest.mark.parametrize(("v", "y"), [(0.05, 0.4), (0.3, 2.5), (1.2, 1.0)])
def test_marched_springs(table, v, y):
    coarse, fine = (march_ball(v, y, 300, steps) for steps in (1500, 3000))
    assert table.ratio_with_bound(v, y, **BALL)[0] == close(2.0 * fine - coarse, abs=2e-5)


def test_a_known_value(table):
    assert table.ratio_with_bound(0.05, 0.4, **BALL)[0] == close(0.94910928, abs=5e-9)


@pytest.mark.parametrize("name", ["mu_ratio", "power", "stick_fraction"])
def test_adaptive_quadrature(table, name):
    rng = np.random.default_rng(5)
    for _ in range(8 if name == "mu_ratio" else 3):
        v, y = 10.0 ** rng.uniform(-3, 1), 10.0 ** rng.uniform(-1.5, 1.5)
        value, bound, _ = table.quantity(name, v, y, **BALL)
        assert value == close(by_quad(table, name, v, y), abs=1e-10 + (bound if name == "stick_fraction" else 0.0))


def test_rules_against_those_of_the_tightest_table(table):
    """Nodes doubled and more: no error above what a rule states, and the worst near to it."""
    v, y = points(1500, 7)
    fine, error, _ = table.ratio_with_bound(v, y, **BALL)
    for tolerance in (1e-4, 1e-7, 1e-10):
        other = Surrogate.open(1e-12)
        other._data.put_rules(rules(tolerance))
        value, bound, _ = other.ratio_with_bound(v, y, **BALL)
        ratio = np.abs(value - fine) / (bound + error)
        assert 0.3 < ratio.max() <= 1.0


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-10])
def test_bounds_of_coarser_tables(table, tolerance):
    v, y = points(1000, 8)
    v[::9], y[::11] = 0.0, 1e-3 * y[::11]
    coarse = Surrogate.open(tolerance)
    for name in ("mu_ratio", "power", "stick_fraction"):
        (exact, small, _), (value, bound, _) = (s.quantity(name, v, y, **BALL) for s in (table, coarse))
        assert np.all(np.abs(value - exact) <= bound + small)
        assert name != "mu_ratio" or np.median(bound) < 2.0 * tolerance


def test_static_limit(table):
    for y in (1e-9, 1e-3, 0.1, 0.7, 1.3, 1.499999):
        e = y / 1.5
        m = (1.0 - e) / (1.0 + e)
        closed = math.sqrt(1.0 + e) * (ellipe(m) - e * ellipk(m))
        integral = 1.5 * quad(lambda xi, e=e: math.sqrt(max((1 - xi * xi) ** 2 - e * e, 0.0)), 0, math.sqrt(1 - e))[0]
        mu, bound, source = table.ratio_with_bound(0.0, y, **BALL)
        assert mu == close(closed, abs=bound)
        assert mu == close(integral, abs=1e-8)
        assert table.ratio_with_bound(1e-16, y, **BALL)[0] == close(mu, abs=1e-11)
        assert SOURCES[source] == "static_limit"
    assert table.ratio_with_bound(0.0, [1.5, 1.6, 1e9], **BALL)[0].tolist() == [0.0, 0.0, 0.0]


def test_border(table):
    assert table.v_tilde_crit(1.0, **BALL) == close(0.33517, abs=5e-6)
    for y in (0.01, 1.0, 1.9, 1.94, 5.0, 1e3):
        s = np.geomspace(1e-6, 1.0, 20001)
        assert table.v_tilde_crit(y, **BALL) == close(np.max(1.5 * s * table.v_tilde_crit(y / (1.5 * s))), rel=1e-6)
        crit = table.v_tilde_crit(y, **BALL)
        codes = [table.ratio_with_bound(crit * x, y, **BALL)[2] for x in (0.999, 1.001)]
        assert [SOURCES[code] for code in codes] == ["ball_partial_slip", "ball_continuous"]
        assert table.stick_fraction(crit * 1.001, y, **BALL) == 0.0 < table.stick_fraction(crit * 0.99, y, **BALL)


def test_rigid_and_other_limits(table):
    for changes in ({"k": None}, {"k": 1e300}, {"y0": 0.0}, {"omega": 0.0}, {"v0": 0.0, "k": math.inf}):
        ball, spring = (table.evaluate(**{**CASE, **changes}, contact=contact) for contact in ("ball", "spring"))
        assert ball.mu_macro == close(spring.mu_macro, abs=1e-15)
    still = table.evaluate(**{**CASE, "v0": 0.0}, **BALL, gradient=True)
    assert (still.regime, still.gradient["v0"]) == ("static", math.inf)


def test_any_groups():
    s = Surrogate.open(1e-4)
    size = np.array([0.0, 5e-324, 1e-300, 1e-150, 1e-10, 1.0, 1e10, 1e150, 1e281, 1.7e308])
    v, y = (a.ravel() for a in np.meshgrid(size, size))
    mu, bound, source = s.ratio_with_bound(v, y, **BALL)
    assert np.all((mu >= 0.0) & (mu <= 1.0) & (bound >= 0.0) & (source >= 0))
    for name in ("power", "stick_fraction"):
        value, bound, _ = s.quantity(name, v, y, **BALL)
        assert np.all((value >= 0.0) & (bound >= 0.0))
    assert np.isnan(s.ratio_with_bound([-1.0, 1.0, np.nan, 1.0], [1.0, -1.0, 1.0, np.inf], **BALL)[0]).all()


def test_gradient(table):
    rng = np.random.default_rng(3)
    for _ in range(30):
        case = {name: x * 10.0 ** rng.uniform(-1, 1) for name, x in CASE.items()}
        found = table.evaluate(**case, **BALL, gradient=True)
        for name, x in case.items():
            up, down = (table.evaluate(**{**case, name: x * (1.0 + h)}, **BALL).mu_macro for h in (1e-5, -1e-5))
            noise = 1e-4 * found.mu_macro / x * 1e-2 + 4e-11 / (2e-5 * x)
            assert found.gradient[name] == close((up - down) / (2e-5 * x), abs=noise + found.gradient_bound[name])
            assert found.gradient_bound[name] < 1e-2 * max(abs(found.gradient[name]), found.mu_macro / x)


def test_gradient_bounds(table):
    v, y = points(300, 9)
    columns = {"mu0": 1.0, "Fz": 1.0, "k": 1.0, "omega": 1.0, "v0": v, "y0": y}
    exact = table.evaluate(**columns, **BALL, gradient=True)
    for tolerance in (1e-7, 1e-10):
        found = Surrogate.open(tolerance).evaluate(**columns, **BALL, gradient=True)
        for name in found.gradient:
            error = np.abs(found.gradient[name] - exact.gradient[name])
            assert np.all(error <= found.gradient_bound[name] + exact.gradient_bound[name])


def test_arrays_are_scalars(table):
    v0 = np.geomspace(1e-6, 10.0, 400)
    many = table.evaluate(**{**CASE, "v0": v0}, **BALL, gradient=True)
    for i in range(0, 400, 37):
        one = table.evaluate(**{**CASE, "v0": v0[i]}, **BALL, gradient=True)
        assert (one.mu_macro, one.error_bound, one.source_code) == (
            many.mu_macro[i], many.error_bound[i], many.source_code[i],
        )  # fmt: skip
        assert list(one.gradient.values()) == [slope[i] for slope in many.gradient.values()]
        assert one.mu_macro == table.ratio_with_bound(one.v_tilde, one.y_tilde, **BALL)[0] * CASE["mu0"]


def test_threads_and_pickle():
    s = Surrogate.open(1e-7, threads=4)
    v, y = points(1000, 4)
    one, four = (x.ratio_with_bound(v, y, **BALL) for x in (s.on_one_thread(), s))
    again = pickle.loads(pickle.dumps(s)).ratio_with_bound(v, y, **BALL)  # noqa: S301 - made here
    for a, b, c in zip(one, four, again, strict=True):
        assert np.array_equal(a, b)
        assert np.array_equal(a, c)


def test_refusals(table):
    for given, field in (({"contact": "cube"}, "contact"), ({"contact": None}, "contact"),
                         ({"direction": "up"}, "direction"), ({"direction": "normal", **BALL}, "direction"),
                         ({"Fz_amplitude": 1.0, **BALL}, "Fz_amplitude"), ({"v0": -1.0, **BALL}, "v0")):  # fmt: skip
        with pytest.raises(InputError) as caught:
            table.evaluate(**{**CASE, **given})
        assert caught.value.field == field
    with pytest.raises(InputError, match="radius"):
        kind_of("ball", "normal")
    bad = table.evaluate(**{**CASE, "v0": [-1.0, 0.01]}, **BALL)
    assert bad.source_code.tolist() == [-1, SOURCES.index("ball_partial_slip")]
    with pytest.raises(InputError, match="index 0"):
        table.evaluate(**{**CASE, "v0": [-1.0, 0.01]}, **BALL, illegal="raise")


def test_labels(table):
    """Every contact and direction, and an interval, keep the labels and give the bits of arrays."""
    pd, xr = pytest.importorskip("pandas"), pytest.importorskip("xarray")
    v0 = np.array([0.01, 0.02, 0.05])
    plain = table.evaluate(**{**CASE, "v0": v0}, **BALL, gradient=True)
    series = table.evaluate(**{**CASE, "v0": pd.Series(v0, index=list("abc"))}, **BALL, gradient=True)
    assert series.mu_macro.index.tolist() == list("abc")
    assert series.mu_macro.tolist() == plain.mu_macro.tolist()
    assert series.regime_certain.tolist() == plain.regime_certain.tolist()
    frame = table.evaluate(pd.DataFrame({**CASE, "v0": v0}), **BALL)
    assert (frame.mu_macro.tolist(), set(frame.regime)) == (plain.mu_macro.tolist(), {"partial_slip"})
    case = {name: x for name, x in CASE.items() if name not in ("k", "y0")}
    force = xr.DataArray([1.0, 4.0], dims="force")
    found = table.evaluate(**case, k_range=(1e6, 2e6), Fz_amplitude=force, direction="normal", gradient=True)
    assert found.mu_macro_low.dims == ("force",)
    assert found.gradient["Fz_amplitude"].name == "d_mu_macro_d_Fz_amplitude"
    assert np.all(found.mu_macro_low <= found.mu_macro_high)

"""Every bound covers its error in the hardest cases: exact inputs, corner, border, ends of double precision."""

import math
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import ellipk, mp, mpf, pi, workdps
from numpy.typing import NDArray

from builder.differences import differences
from builder.quantities import SOLVER_NOISE
from builder.sweep import Sweep
from builder.verify import CASES, draw
from comparing import close
from mumacro import Surrogate
from mumacro.charts import CONTINUOUS, QUANTITY_NAMES, REGIME_OF_SOURCE
from mumacro.inputs import FIELDS

Array = NDArray[np.float64]
TABLES = sorted((Path(__file__).parent.parent / "tables").glob("*.nc"))
KINDS = [name for name, _, _ in CASES]


@pytest.fixture(scope="module", params=TABLES, ids=lambda path: path.stem)
def table(request: pytest.FixtureRequest) -> Surrogate:
    return Surrogate.open(request.param)


@pytest.fixture(scope="module")
def fine() -> Surrogate:
    return Surrogate.open()


def unit(v: Array, y: Array) -> dict[str, object]:
    """Inputs with these groups, to the last digit."""
    return {"mu0": 0.5, "Fz": 2.0, "k": 1.0, "y0": y, "omega": 1.0, "v0": v}


# --- inputs with groups that are not doubles ----------------------------------------------------------

AT_REST = {
    "mu0": 0.9972117790122037, "Fz": 33.00548924565685, "k": 232272.5189101842, "y0": 0.00014170192325057914,
    "omega": 100.0, "v0": 0.0,
}  # fmt: skip
CREEPING = {
    "mu0": 0.737138462777051, "Fz": 0.11880564828319028, "k": 16775.36546198662, "y0": 5.22052489068877e-06,
    "omega": 195.41466601147116, "v0": 1.2077222346116516e-28,
}  # fmt: skip


def exact_groups(case: dict[str, float]) -> tuple[Fraction, Fraction]:
    """(v~, y~ - 1) of the doubles, in rational arithmetic."""
    mu0, Fz, k, y0, omega, v0 = (Fraction(case[name]) for name in FIELDS)
    return v0 * k / (mu0 * Fz * omega), y0 * k / (mu0 * Fz) - 1


def corner_ratio(case: dict[str, float]) -> float:
    """mu~ next to the corner from exact groups: the root of mu~^3 + 2 (y~ - 1) mu~ = pi v~, off by O(mu~^3)."""
    v, eta = exact_groups(case)
    with workdps(60):
        p, q = 2 * mpf(eta.numerator) / eta.denominator, mp.pi * v.numerator / v.denominator
        return float(mp.findroot(lambda phi: phi**3 + p * phi - q, mp.cbrt(q) + mp.sqrt(max(-p, mpf(0)))))


def test_the_static_limit_covers_the_last_digit_of_the_amplitude(table: Surrogate) -> None:
    _, eta = exact_groups(AT_REST)
    with workdps(40):
        truth = float(mp.sqrt(max(-mpf((eta * (2 + eta)).numerator) / (eta * (2 + eta)).denominator, mpf(0))))
    assert truth == close(1.9e-8, rel=0.05)
    found = table.evaluate(AT_REST)
    assert abs(found.mu_ratio - truth) <= found.error_bound / AT_REST["mu0"]
    assert found.error_bound < 1e-7


def test_the_corner_covers_the_last_digit_of_the_amplitude(table: Surrogate) -> None:
    truth = corner_ratio(CREEPING)
    found = table.evaluate(CREEPING)
    assert abs(found.mu_ratio - truth) > 1e-9  # limit of double precision
    assert abs(found.mu_ratio - truth) <= found.error_bound / CREEPING["mu0"]
    assert found.error_bound < 1e-6


@pytest.mark.parametrize("still", [True, False])
def test_any_inputs_next_to_the_corner_are_covered(fine: Surrogate, still: bool) -> None:
    """y~ is 1 but for rounding of a product of four doubles; v~ from 0 to where mu~ is 1e-5."""
    rng = np.random.default_rng(31)
    worst = 0.0
    for _ in range(400):
        mu0, Fz, k = rng.uniform(0.1, 1.0), 10.0 ** rng.uniform(-2.0, 3.0), 10.0 ** rng.uniform(3.0, 8.0)
        y0 = mu0 * Fz / k * (1.0 + int(rng.integers(-4, 5)) * 2.0**-52)
        omega = 10.0 ** rng.uniform(0.0, 5.0)
        v0 = 0.0 if still else 10.0 ** rng.uniform(-40.0, -16.0) * mu0 * Fz * omega / k
        case = dict(zip(FIELDS, (mu0, Fz, k, y0, omega, v0), strict=True))
        if still:
            _, eta = exact_groups(case)
            truth = math.sqrt(max(float(-eta * (2 + eta)), 0.0))
        else:
            truth = corner_ratio(case)
        found = fine.evaluate(case)
        bound = found.error_bound / mu0
        assert abs(found.mu_ratio - truth) <= bound + truth**3
        worst = max(worst, abs(found.mu_ratio - truth) / bound if bound else 0.0)
    assert worst > 0.2  # such inputs exist, and the bound is not excessive


def test_a_ratio_below_the_normal_range_is_not_zero(table: Surrogate) -> None:
    mu, bound, _ = table.ratio_with_bound(1e-304, 1.4e5)
    assert 0.0 < mu == table.mu_ratio(1e-304, 1.4e5)
    assert abs(mu - 4.3e-309) <= 0.1 * 4.3e-309 + bound
    assert bound < 1e-305


@pytest.mark.parametrize("y0", [1e-6, 2.9e-6, 3.1e-6, 1e-5])
def test_the_slope_along_speed_is_not_lost_where_the_group_underflows(fine: Surrogate, y0: float) -> None:
    case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": y0, "omega": 1e300, "v0": 1e-30}
    found = fine.evaluate(case, gradient=True)
    assert found.v_tilde < 1e-320
    still = fine.evaluate({**case, "v0": 0.0}, gradient=True)
    slower = fine.evaluate({**case, "omega": 1e250}, gradient=True)  # there v~ is an ordinary number
    assert found.gradient["v0"] > 0.0
    for other, factor in ((still, 1.0), (slower, 1e-50)):
        expected = factor * other.gradient["v0"]
        slack = found.gradient_bound["v0"] + factor * other.gradient_bound["v0"]
        assert abs(found.gradient["v0"] - expected) <= slack + 1e-9 * expected
    zero = fine.evaluate({**case, "v0": 5e-324}, gradient=True)
    assert zero.v_tilde == 0.0
    assert zero.gradient["v0"] == still.gradient["v0"] > 0.0


def test_bounds_are_never_nan_negative_or_missing_at_the_ends_of_double_precision(table: Surrogate) -> None:
    values = np.concatenate([[0.0, 5e-324], 10.0 ** np.arange(-320.0, 305.0, 12.5), [1.7e308, math.inf]])
    v, y = (x.ravel() for x in np.meshgrid(values, values[:-1]))
    mu, bound, source = table.ratio_with_bound(v, y)
    assert np.all((source >= 0) & (mu >= 0.0) & (mu <= 1.0) & (bound >= 0.0) & np.isfinite(bound))
    for ask in (table.power_with_bound, table.stick_fraction_with_bound):
        value, of_value = ask(v, y)
        assert np.all((value >= 0.0) & (of_value >= 0.0)), ask
    for of in QUANTITY_NAMES:
        found = np.array(table.slopes(v, y, of, bounds=True))
        assert not np.isnan(found).any(), of
        assert np.all(found[3:] >= 0.0), of


# --- regime -------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_a_regime_that_is_certain_is_that_of_a_fresh_solve(table: Surrogate, sweep: Sweep, seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 4000
    y = 10.0 ** rng.uniform(-4.0, 6.0, n)
    crit = sweep.solve("border", np.ones_like(y), y)["deficit"]
    distance = 10.0 ** rng.uniform(-16.0, -2.0, n)
    v = crit * (1.0 + rng.choice([-1.0, 1.0], n) * distance)
    found = table.evaluate(unit(v, y), groups=True)
    np.testing.assert_array_equal(found.v_tilde, v)
    right = (found.regime_code == CONTINUOUS) == (v >= crit)
    assert np.all(right[found.regime_certain])
    far = distance > 2.0 * table.border.max_rel_error + 2e-14
    assert np.all(found.regime_certain[far])
    assert not found.regime_certain.all()  # next to the border it is reported as uncertain


def test_a_regime_is_certain_at_all_but_a_small_share_of_points(table: Surrogate) -> None:
    v, y = draw("random", 20_000, table, seed=8)
    certain = table.evaluate(unit(v, y), groups=True).regime_certain
    assert np.count_nonzero(~certain) <= 1e-3 * v.size
    for extreme in ({"v0": 0.0}, {"y0": 0.0}, {"omega": 0.0}, {"k": None}, {"k": 1e308, "Fz": 1e-308}):
        one = table.evaluate({**unit(0.1, 0.5), **extreme})
        assert one.regime_certain is True


# --- slopes -------------------------------------------------------------------------------------------


def covered(table: Surrogate, sweep: Sweep, name: str, v: Array, y: Array) -> tuple[Array, Array]:
    """Errors of both slopes beyond the error of the differences, and their bounds; whether errors are within them."""
    _, along_v, along_y, bound_v, bound_y = table.slopes(v, y, name, bounds=True)
    truth, noise = differences(table, sweep, name, v, y)
    error = np.maximum(np.abs(np.stack((along_v, along_y)) - truth) - noise, 0.0)
    bound = np.stack((bound_v, bound_y))
    missed = np.argwhere(error > bound)
    assert missed.size == 0, [(i, v[j], y[j], error[i, j], bound[i, j]) for i, j in missed[:3]]
    return error, bound


@pytest.mark.slow
@pytest.mark.parametrize("name", QUANTITY_NAMES)
@pytest.mark.parametrize("case", KINDS)
def test_slopes_lie_within_their_bounds(table: Surrogate, sweep: Sweep, case: str, name: str) -> None:
    v, y = draw(case, 400 if name == "mu_ratio" else 150, table, seed=41)
    if name == "stick_fraction":  # below the border it is a square root, above it zero
        keep = np.abs(v / table.v_tilde_crit(y) - 1.0) > 1e-3
        v, y = v[keep], y[keep]
    covered(table, sweep, name, v, y)


@pytest.mark.slow
@pytest.mark.parametrize("distance", [1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2])
def test_slopes_of_mu_lie_within_their_bounds_beside_the_border(
    table: Surrogate, sweep: Sweep, distance: float
) -> None:
    y = np.geomspace(1e-3, 1e5, 60)
    for side in (-1.0, 1.0):
        covered(table, sweep, "mu_ratio", table.v_tilde_crit(y) * (1.0 + side * distance), y)


def test_bounds_of_slopes_shrink_with_the_tolerance(table: Surrogate) -> None:
    v, y = draw("random", 3000, table, seed=43)
    assert np.median(table.slopes(v, y, bounds=True)[3:]) <= 10.0 * table.tolerance


# --- the gradient in the six inputs -------------------------------------------------------------------


def test_the_gradient_and_its_bound_follow_from_the_slopes(fine: Surrogate) -> None:
    rng = np.random.default_rng(17)
    n = 2000
    columns = {
        "mu0": rng.uniform(0.1, 1.0, n), "Fz": 10.0 ** rng.uniform(-2.0, 3.0, n), "k": 10.0 ** rng.uniform(3.0, 8.0, n),
        "y0": 10.0 ** rng.uniform(-8.0, -4.0, n), "omega": 10.0 ** rng.uniform(0.0, 6.0, n),
        "v0": 10.0 ** rng.uniform(-7.0, 1.0, n),
    }  # fmt: skip
    found = fine.evaluate(columns, gradient=True)
    mu, along_v, along_y, bound_v, bound_y = fine.slopes(found.v_tilde, found.y_tilde, bounds=True)
    mu0, both, errors = columns["mu0"], along_v + along_y, bound_v + bound_y
    # along mu0 the error of mu~ counts, too: that of the point's cell where it is the smaller one
    of_mu = found.gradient_bound["mu0"] - errors
    assert np.all((of_mu >= 0.0) & (of_mu <= found.error_bound / mu0 * (1.0 + 1e-9)))
    assert np.mean(of_mu < 0.5 * found.error_bound / mu0) > 0.2
    for name, slope, bound in (
        ("mu0", mu - both, of_mu + errors), ("Fz", -mu0 * both / columns["Fz"], mu0 * errors / columns["Fz"]),
        ("k", mu0 * both / columns["k"], mu0 * errors / columns["k"]),
        ("y0", mu0 * along_y / columns["y0"], mu0 * bound_y / columns["y0"]),
        ("omega", -mu0 * along_v / columns["omega"], mu0 * bound_v / columns["omega"]),
        ("v0", mu0 * along_v / columns["v0"], mu0 * bound_v / columns["v0"]),
    ):  # fmt: skip
        np.testing.assert_allclose(found.gradient[name], slope, rtol=1e-12, atol=1e-14 * np.abs(slope).max())
        np.testing.assert_allclose(found.gradient_bound[name], bound, rtol=1e-9)
        assert np.all(found.gradient_bound[name] >= 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("field", FIELDS)
def test_the_gradient_lies_within_its_bound_of_differences_of_the_full_model(
    table: Surrogate, sweep: Sweep, field: str
) -> None:
    rng = np.random.default_rng(19)
    n = 150
    columns = {
        "mu0": rng.uniform(0.1, 1.0, n), "Fz": rng.uniform(1.0, 30.0, n), "k": 10.0 ** rng.uniform(5.0, 7.0, n),
        "y0": 10.0 ** rng.uniform(-6.5, -4.5, n), "omega": 10.0 ** rng.uniform(3.0, 5.5, n),
        "v0": 10.0 ** rng.uniform(-4.0, 0.5, n),
    }  # fmt: skip
    found = table.evaluate(columns, gradient=True)
    keep = np.abs(np.log(found.v_tilde / table.v_tilde_crit(found.y_tilde))) > 0.02
    keep &= np.hypot(found.y_tilde - 1.0, np.cbrt(found.v_tilde)) > 0.2
    step, shifts = 1e-3, (-3, -2, -1, 1, 2, 3)
    values = []
    for shift in shifts:
        moved = {**columns, field: columns[field] * math.exp(shift * step)}
        force = moved["mu0"] * moved["Fz"]
        v, y = moved["v0"] * moved["k"] / (force * moved["omega"]), moved["y0"] * moved["k"] / force
        values.append(moved["mu0"][keep] * sweep.solve("full", v[keep], y[keep])["mu_ratio"])
    slope = np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) @ values / (60.0 * step)
    left_out = np.abs(slope - np.array([0.0, 1.0, -8.0, 8.0, -1.0, 0.0]) @ values / (12.0 * step))
    noise = 8.0 * SOLVER_NOISE / step + 0.2 * left_out
    scale = columns[field][keep]
    error = np.abs(found.gradient[field][keep] * scale - slope)
    assert np.all(error <= found.gradient_bound[field][keep] * scale + noise)


def test_the_gradient_of_rigid_contact_is_that_of_its_closed_form_by_every_input(fine: Surrogate) -> None:
    """mu_macro = mu0 (2/pi) K(i r), r = y0 omega/v0: differences of 40 digits, input by input."""
    rng = np.random.default_rng(4)
    for _ in range(40):
        case: dict[str, Any] = dict(zip(("mu0", "Fz", "y0", "omega", "v0"), 10.0 ** rng.uniform(-3, 3, 5), strict=True))
        found = fine.evaluate(**case, k=None, gradient=True)
        with workdps(40):

            def mu(name: str = "mu0", share: float = 1.0, case: dict[str, Any] = case) -> mpf:
                moved = {key: mpf(value) for key, value in case.items()}
                moved[name] *= share
                ratio = moved["y0"] * moved["omega"] / moved["v0"]
                return moved["mu0"] * 2 / pi * ellipk(-(ratio**2))

            h = mpf(10) ** -12
            for name, value in case.items():
                slope = float((mu(name, 1 + h) - mu(name, 1 - h)) / (2 * h * value))
                assert abs(found.gradient[name] - slope) <= found.gradient_bound[name] + 1e-20 * abs(slope), name
                assert found.gradient_bound[name] * value <= 1e-13 * found.mu_macro, name
        assert found.gradient["k"] == 0.0


def test_the_gradient_is_that_of_the_answer(fine: Surrogate) -> None:
    """Central differences of the answers, away from the edges of cells."""
    case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
    for place in ({}, {"v0": 0.3}, {"y0": 1e-5}, {"y0": 1e-5, "v0": 2.0}, {"v0": 1e-4}):
        base = {**case, **place}
        found = fine.evaluate(base, gradient=True)
        for name, value in base.items():
            h = 1e-4 * value
            two, one, minus, minus_two = (fine.evaluate({**base, name: value + s * h}).mu_macro for s in (2, 1, -1, -2))
            slope = (8.0 * (one - minus) - (two - minus_two)) / (12.0 * h)
            noise = 1e-15 / h + 1e-9 * abs(slope)
            assert abs(found.gradient[name] - slope) <= found.gradient_bound[name] + noise, (place, name)


def test_regimes_of_sources_are_those_of_the_answers(fine: Surrogate) -> None:
    v, y = draw("wide", 3000, fine, seed=2)
    found = fine.evaluate(unit(v, y))
    np.testing.assert_array_equal(found.regime_code, REGIME_OF_SOURCE[found.source_code])
    assert set(found.regime) == {"continuous", "stick_slip"}

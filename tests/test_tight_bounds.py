"""Bounds are tight: at the hardest points the worst error is a good part of its bound, which may not be halved."""

import math
from pathlib import Path

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

from builder.measure import fast_from
from builder.quantities import solver_noise
from builder.sweep import Sweep
from builder.verify import CASES, draw
from comparing import close
from mumacro import Surrogate
from mumacro.charts import CONTINUOUS, NAMES, QUANTITIES, QUANTITY_NAMES, REGIME_OF_SOURCE, SOURCES
from mumacro.inverse import solve_for
from mumacro.settling import settling

Array = NDArray[np.float64]
TABLES = Path(__file__).parent.parent / "tables"


@pytest.fixture(scope="module")
def table() -> Surrogate:
    """A table whose errors are far above the solver's."""
    return Surrogate.open(TABLES / "mumacro-1e-7.nc")


@pytest.mark.slow
@pytest.mark.parametrize("name", QUANTITY_NAMES)
def test_the_worst_error_of_every_block_is_about_half_its_bound(table: Surrogate, sweep: Sweep, name: str) -> None:
    """The builder doubles the largest error that it finds; a search at other points finds nearly as large ones."""
    worst: dict[str, float] = {}
    for kind, _, _ in CASES:
        v, y = draw(kind, 4000, table, seed=77)
        value, bound, source = table.quantity(name, v, y)
        solved = sweep.solve("full", v, y)
        sliding = REGIME_OF_SOURCE[source] == CONTINUOUS
        noise = solver_noise(name, v, y, solved, sliding)
        error = np.maximum(np.abs(value - solved[name]) - noise, 0.0)
        assert np.all(error <= bound)
        share = np.divide(error, bound, out=np.zeros_like(error), where=bound > 0.0)
        for code in np.unique(source[~sliding] if name == "stick_fraction" else source):
            where = SOURCES[code]
            worst[where] = max(worst.get(where, 0.0), float(share[source == code].max()))
    blocks = [worst[where] for where in NAMES if where in worst]
    assert min(blocks) > 0.3
    assert max(blocks) > 0.5
    if name == "power":
        assert worst["tail_fast"] > 0.5


@pytest.mark.parametrize("name", QUANTITY_NAMES)
@pytest.mark.parametrize("coarse", ["mumacro-1e-4", "mumacro-1e-7", "mumacro-1e-10"])
def test_bounds_of_slopes_may_not_be_halved_and_are_never_missed(coarse: str, name: str) -> None:
    """Compared with the finest table at every kind of point; what that leaves open itself is not counted."""
    ours, fine = Surrogate.open(TABLES / f"{coarse}.nc"), Surrogate.open(TABLES / "mumacro-1e-12.nc")
    worst = 0.0
    for kind, share, _ in CASES:
        v, y = draw(kind, int(share * 100_000), ours, seed=79)
        found, bound = (np.array(ours.slopes(v, y, name, bounds=True))[part] for part in (slice(1, 3), slice(3, 5)))
        truth, left = (np.array(fine.slopes(v, y, name, bounds=True))[part] for part in (slice(1, 3), slice(3, 5)))
        error = np.abs(found - truth)
        assert np.all(error <= bound + left), kind
        surely = np.maximum(error - left, 0.0)
        worst = max(worst, float(np.divide(surely, bound, out=np.zeros_like(bound), where=bound > 0.0).max()))
        if kind == "random" and name != "stick_fraction":
            some = error > 0.0
            assert np.median(bound[some] / error[some]) <= 50.0
    assert 0.5 < worst <= 1.0


@pytest.mark.parametrize("name", QUANTITY_NAMES)
@pytest.mark.parametrize("coarse", ["mumacro-1e-4", "mumacro-1e-7", "mumacro-1e-10"])
def test_bounds_of_slopes_hold_where_the_regime_is_uncertain_and_next_to_it(coarse: str, name: str) -> None:
    """Of two tables one may say stick-slip and the other continuous sliding; of a root the slope is then unbounded."""
    ours, fine = Surrogate.open(TABLES / f"{coarse}.nc"), Surrogate.open(TABLES / "mumacro-1e-12.nc")
    rng = np.random.default_rng(5)
    known_to = ours.border.max_rel_error
    for low, high in ((0.0, known_to), (known_to, 4.0 * known_to), (1e-13, 1e-2)):
        y = 10.0 ** rng.uniform(-4.0, 7.0, 20_000)
        v = ours.v_tilde_crit(y) * (1.0 + rng.choice([-1.0, 1.0], y.size) * rng.uniform(low, high, y.size))
        found, truth = (np.array(table.slopes(v, y, name, bounds=True)) for table in (ours, fine))
        assert np.all(np.abs(found[1:3] - truth[1:3]) <= found[3:] + truth[3:])
        smooth = QUANTITIES[QUANTITY_NAMES.index(name)].smooth_at_border
        if smooth:
            assert np.isfinite(found).all()
        if low > known_to:
            assert np.isfinite(found[3:]).mean() > 0.5
        if not smooth and high == known_to:
            assert np.isinf(found[3:]).all()


@pytest.mark.parametrize(("low", "high"), [(0.1, 1.88), (1.88, 1e4)])
def test_what_the_border_does_to_the_stick_fraction_is_bounded_tightly(
    table: Surrogate, sweep: Sweep, low: float, high: float
) -> None:
    """Between the border and the table's, where one says stick-slip and the other continuous sliding."""
    y = np.geomspace(low, high, 2000)
    exact, ours = sweep.solve("border", np.ones_like(y), y)["deficit"], table.v_tilde_crit(y)
    v = np.minimum(exact, ours)
    found, bound = table.stick_fraction_with_bound(v, y)
    error = np.abs(found - sweep.solve("full", v, y)["stick_fraction"])
    assert 0.5 < (error / bound).max() <= 1.0


def test_a_regime_is_uncertain_where_the_border_may_lie_within_its_bound(table: Surrogate) -> None:
    y = np.geomspace(1e-4, 1e6, 200)
    known_to = table.border.max_rel_error
    for share, certain in ((0.9, False), (1.1, True)):
        for side in (-1.0, 1.0):
            v = table.v_tilde_crit(y) * (1.0 + side * share * known_to)
            answer = table.evaluate(mu0=0.5, Fz=2.0, k=1.0, y0=y, omega=1.0, v0=v, groups=True)
            assert np.all(answer.regime_certain == certain)


def slow_manifold(v: float, y: float) -> mpmath.mpf:
    """mu~ of continuous sliding at large v~ in 24 digits: the angle lags by asin(its rate / speed), iterated.

    At equal times of half a period; the angle is antiperiodic, its rate that of its trigonometric interpolant.
    """
    m = 2 * int(21.0 / math.asinh(v / y)) + 8
    with mpmath.workdps(24):
        asin, atan, cos, sqrt = (np.frompyfunc(getattr(mpmath, name), 1, 1) for name in ("asin", "atan", "cos", "sqrt"))
        row = [mpmath.mpf(0), *((-1) ** j * mpmath.csc(mpmath.pi * j / m) for j in range(1, m))]
        rate_of = np.array([[row[i - j] if i >= j else -row[j - i] for j in range(m)] for i in range(m)])
        across = mpmath.mpf(y) * cos(mpmath.pi * np.arange(m) / m)
        speed, direction = sqrt(mpmath.mpf(v) ** 2 + across * across), atan(across / mpmath.mpf(v))
        angle, change = direction, 1.0
        while change > 1e-20:
            before, angle = angle, direction - asin(rate_of.dot(angle) / speed)
            change = max(abs(angle - before))
        return sum(cos(angle)) / m


@pytest.mark.slow
def test_the_closed_form_for_large_speed_is_bounded_tightly(table: Surrogate) -> None:
    """Where it takes over from the blocks: there it leaves out most, up to 6e-16 of mu~, as much as rounding."""
    y = np.geomspace(2.0, 1.2e4, 90)
    v = fast_from(table, y) * (1.0 + 1e-9)
    mu, bound, source = table.ratio_with_bound(v, y)
    assert {SOURCES[code] for code in source} == {"tail_fast"}
    with mpmath.workdps(24):
        truth = [slow_manifold(*point) for point in zip(v.tolist(), y.tolist(), strict=True)]
        share = [abs(m - t) / b for m, t, b in zip(mu.tolist(), truth, bound.tolist(), strict=True)]
    assert 0.5 < max(share) <= 1.0


@pytest.mark.parametrize("rigid", [True, False], ids=["rigid", "at rest"])
def test_closed_forms_of_six_inputs_are_bounded_tightly(table: Surrogate, rigid: bool) -> None:
    """Exact groups are no doubles: what rounding them costs is covered, and not by much more."""
    rng = np.random.default_rng(3)
    worst = 0.0
    for _ in range(500):
        mu0, Fz, omega, ratio = rng.uniform(0.1, 1.0), *10.0 ** rng.uniform((-2.0, 0.0, -2.0), (3.0, 5.0, 14.0))
        k, v0 = (math.inf, 0.01) if rigid else (10.0 ** rng.uniform(3.0, 8.0), 0.0)
        y0 = ratio * v0 / omega if rigid else mu0 * Fz / k * (1.0 - 0.01 / ratio)
        found = table.evaluate(mu0=mu0, Fz=Fz, k=k, y0=y0, omega=omega, v0=v0)
        with mpmath.workdps(40):
            exact = mpmath.mpf(y0) * (omega / mpmath.mpf(v0) if rigid else k / (mpmath.mpf(mu0) * Fz))
            truth = 2 / mpmath.pi * mpmath.ellipk(-(exact**2)) if rigid else mpmath.sqrt(1 - exact**2)
            worst = max(worst, float(abs(found.mu_macro - mu0 * truth) / found.error_bound))
    assert 0.5 < worst <= 1.0


@pytest.mark.parametrize(("v", "y"), [(0.3, 0.3), (0.02, 0.3), (0.05, 1.2), (2.0, 30.0), (1e-5, 3.0)])
def test_the_bound_of_settling_is_what_the_bounds_of_ratio_and_power_leave_open(v: float, y: float) -> None:
    coarse = Surrogate.open(TABLES / "mumacro-1e-4.nc")
    found = settling(coarse, mu0=0.5, Fz=2.0, k=1.0, y0=y, omega=1.0, v0=v)
    less = 2.0 * math.pi * (v * coarse.ratio_with_bound(v, y)[1] + coarse.power_with_bound(v, y)[1])
    assert found.error_bound == close(math.log(100.0) / (found.slip_path - less) - found.periods, rel=1e-9)


# --- what is made from mu~: a coarse table against the finest, at the points of every kind ------------

COARSE = ["mumacro-1e-4", "mumacro-1e-7"]
CASE = {"mu0": 0.5, "Fz": 2.0, "k": 1.0, "omega": 1.0}  # v~ = v0, y~ = y0


def two(coarse: str) -> tuple[Surrogate, Surrogate]:
    return Surrogate.open(TABLES / f"{coarse}.nc"), Surrogate.open(TABLES / "mumacro-1e-12.nc")


@pytest.mark.parametrize("name", QUANTITY_NAMES)
@pytest.mark.parametrize("coarse", COARSE)
def test_the_bound_of_a_value_may_not_be_halved(coarse: str, name: str) -> None:
    ours, fine = two(coarse)
    worst = 0.0
    for kind, _, _ in CASES:
        v, y = draw(kind, 50_000, ours, seed=8)
        (value, bound, _), (truth, left, _) = (s.quantity(name, v, y) for s in (ours, fine))
        error = np.abs(value - truth)
        assert np.all(error <= bound + left), kind
        share = np.maximum(error - left, 0.0) / np.maximum(bound, 1e-300)
        worst = max(worst, float(share[bound > 1e-12].max(initial=0.0)))
    assert 0.45 < worst <= 1.0


@pytest.mark.parametrize("coarse", COARSE)
def test_the_bound_of_the_border_may_not_be_halved(coarse: str) -> None:
    ours, fine = two(coarse)
    y = np.geomspace(1e-4, 1e8, 20_001)
    off = np.abs(ours.v_tilde_crit(y) / fine.v_tilde_crit(y) - 1.0)
    assert 0.45 < off.max() / ours.border.max_rel_error <= 1.0


@pytest.mark.parametrize("unknown", ["v0", "y0"])
@pytest.mark.parametrize("coarse", COARSE)
def test_an_enclosure_holds_the_true_root_and_may_not_be_halved(coarse: str, unknown: str) -> None:
    """The targets are true values where the table's errors are the largest shares of their bounds, seams included."""
    ours, fine = two(coarse)
    worst = 0.0
    for kind, _, _ in CASES:
        v, y = draw(kind, 20_000, ours, seed=5)
        (mu, bound, _), (truth, left, _) = (s.ratio_with_bound(v, y) for s in (ours, fine))
        share = np.maximum(np.abs(mu - truth) - left, 0.0) / np.maximum(bound, 1e-300)
        for i in np.argsort(share)[-20::4]:
            point = {"v0": float(v[i]), "y0": float(y[i])}
            target = float(fine.evaluate(**CASE, **point).mu_macro)
            true = point.pop(unknown)
            ((root,),) = solve_for(ours, unknown, target, {**CASE, **point}).roots
            far = 4e-15 * true  # the target is rounded, too
            assert root.low - far <= true <= root.high + far, (kind, true, root)
            end = root.high if true > root.value else root.low
            if end not in (0.0, root.value):
                worst = max(worst, math.log(true / root.value) / math.log(end / root.value))
    assert 0.45 < worst <= 1.0 + 0.02  # a straight end may be off by a hundredth of the bound


def test_an_enclosure_that_ends_at_the_border_has_the_bound_of_the_other_side() -> None:
    """mu~ of the table jumps there by more than the bound in stick-slip, and the true root lay in the jump."""
    ours, fine = two("mumacro-1e-4")
    case = {**CASE, "y0": 1.698960831811908}
    true = 0.5521812858302085  # beyond the table's border, not beyond the true one
    ((root,),) = solve_for(ours, "v0", float(fine.evaluate(**case, v0=true).mu_macro), case).roots
    assert root.regime == "stick_slip"
    assert root.low <= true <= root.high


@pytest.mark.parametrize("coarse", COARSE)
def test_the_bound_of_settling_may_not_be_halved(coarse: str) -> None:
    worst = 0.0
    for kind, _, _ in CASES:
        v, y = draw(kind, 20_000, Surrogate.open(TABLES / f"{coarse}.nc"), seed=5)
        ours, fine = (settling(s, **CASE, y0=y, v0=v) for s in two(coarse))
        known = np.isfinite(ours.error_bound) & (ours.error_bound > 100.0 * fine.error_bound)
        share = np.abs(ours.periods - fine.periods)[known] / (ours.error_bound + fine.error_bound)[known]
        worst = max(worst, float(share.max(initial=0.0)))
    assert 0.45 < worst <= 1.0


@pytest.mark.parametrize("name", ["v0", "y0", "mu0"])
def test_the_bound_of_the_standard_deviation_may_not_be_halved(client, name: str) -> None:
    ours, _ = two("mumacro-1e-4")
    worst = 0.0
    for kind, _, _ in CASES:
        v, y = draw(kind, 1500, ours, seed=6)
        columns = {**CASE, "y0": y.tolist(), "v0": v.tolist(), "include": ["std"], "std": {name: 1e-3}}
        found = []
        for tolerance in (1e-4, 1e-12):
            reply = client.post("/v1/mu-macro/batch", json={**columns, "tolerance": tolerance})
            assert reply.status_code == 200, reply.text
            answer = reply.json()
            found.append([np.array(answer[part], dtype=float) for part in ("std", "std_bound")])
        (std, bound), (truth, left) = found
        known = np.isfinite(bound) & (bound > 0.0)
        error = np.abs(std - truth)[known]
        assert np.all(error <= (bound + left)[known] * (1.0 + 1e-12))
        worst = max(worst, float((np.maximum(error - left[known], 0.0) / bound[known]).max(initial=0.0)))
    assert 0.3 < worst <= 1.0


def test_the_standard_deviation_adds_the_inputs_in_squares(client, case) -> None:
    """The part of every input alone, its bound too, then all together."""
    each = {"mu0": 0.01, "Fz": 0.5, "k": 2e5, "y0": 3e-7, "omega": 2e3, "v0": 1e-3}

    def asked(std: dict[str, float], **change: object) -> dict:
        body = {**case, **change, "include": ["std", "gradient"], "std": std}
        return client.post("/v1/mu-macro", json=body).json()

    alone = {name: asked({name: value}) for name, value in each.items()}
    together = asked(each)
    for name, found in alone.items():
        assert found["std"] == close(abs(found["gradient"][name]) * each[name], rel=1e-14)
        assert found["std_bound"] == close(found["gradient_bound"][name] * each[name], rel=1e-14)
        assert together["std_share"][name] == close((found["std"] / together["std"]) ** 2, rel=1e-13)
    for part in ("std", "std_bound"):
        assert together[part] == close(math.sqrt(sum(found[part] ** 2 for found in alone.values())), rel=1e-13)

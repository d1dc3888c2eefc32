"""Bounds are tight: at the hardest points the worst error is a good part of its bound, which may
not be halved."""

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any

import mpmath
import numpy as np
import pytest

from builder.solver.sweep import Sweep
from builder.tables.draws import DRAWS, fast_from
from builder.tables.quantities import solver_noise
from mumacro import Surrogate, solve_for
from mumacro.table.atlas import (
    BLOCK_NAMES,
    CONTINUOUS,
    QUANTITIES,
    QUANTITY_NAMES,
    REGIME_OF_SOURCE,
    ROUNDING,
    SOURCES,
)
from tests.support.cases import UNIT, Array, Case, flat, opened, tables
from tests.support.comparing import close
from tests.support.hard_points import NAMES as BALL_NAMES
from tests.support.hard_points import hard_points, rows_of
from tests.support.settling import settling

KINDS = list(DRAWS["spring"].cases)
Ask = Callable[[Surrogate, Array, Array], Any]  # values and bounds
table = tables(1e-7)


# --- every operation of a coarse table against the finest, at the points of every kind ------------


def shares(ask: Ask, coarse: Any, n: int, kinds: Sequence[str] = KINDS) -> tuple[float, float]:
    """The largest share of its bound that an error has, and the median of bound / error at random
    points.

    No error is larger than its bound; what the finest table leaves open itself is not counted.
    """
    ours, worst, medians = (opened(coarse) if isinstance(coarse, float) else coarse), 0.0, [1.0]
    for kind in kinds:
        v, y = DRAWS["spring"].draw(kind, n, ours, seed=8)
        (value, bound), (truth, fine_bound) = (
            np.array(ask(s, v, y)) for s in (ours, opened(1e-12))
        )
        error = np.abs(value - truth)
        assert np.all(error <= (bound + fine_bound) * (1.0 + 1e-12)), kind
        share = np.maximum(error - fine_bound, 0.0) / np.maximum(bound, 1e-300)
        worst = max(worst, float(share[np.isfinite(bound) & (bound > 1e-12)].max(initial=0.0)))
        if kind == "random":
            medians.append(float(np.median(bound[error > 0.0] / error[error > 0.0])))
    return worst, medians[-1]


def value_of(name: str) -> Ask:
    return lambda s, v, y: s.quantity(name, v, y)[:2]


def slopes_of(name: str) -> Ask:
    return lambda s, v, y: np.array(s.slopes(v, y, name, bounds=True))[1:].reshape(2, 2, -1)


def gradient(s: Surrogate, v: Array, y: Array) -> Any:
    answer = s.evaluate(**UNIT, y0=y, v0=v, gradient=True)
    inputs = {**UNIT, "y0": y, "v0": v}
    return [
        [part[name] * x for name, x in inputs.items()]
        for part in (answer.gradient, answer.gradient_bound)
    ]


def settled(s: Surrogate, v: Array, y: Array) -> Any:
    decay = settling(s, **UNIT, y0=y, v0=v)
    return decay.periods, decay.error_bound


def border(s: Surrogate, _: Array, y: Array) -> Any:
    return np.multiply.outer([1.0, s.border.max_rel_error], s.v_tilde_crit(y))


#: operation -> how it is asked, number of points of a kind, least share, largest median
OPERATIONS: dict[str, tuple[Ask, int, float, float]] = {
    **{name: (value_of(name), 50_000, 0.45, math.inf) for name in QUANTITY_NAMES},
    **{f"slopes of {name}": (slopes_of(name), 30_000, 0.5, 50.0) for name in QUANTITY_NAMES[:2]},
    "slopes of stick_fraction": (slopes_of("stick_fraction"), 30_000, 0.5, math.inf),
    "gradient": (gradient, 20_000, 0.45, 100.0),
    "settling": (settled, 20_000, 0.45, math.inf),
    "border": (border, 20_000, 0.45, math.inf),
}


@pytest.mark.parametrize("coarse", [1e-4, 1e-7])
@pytest.mark.parametrize("operation", OPERATIONS)
def test_a_bound_may_not_be_halved_and_is_never_missed(operation: str, coarse: float) -> None:
    ask, n, least, widest = OPERATIONS[operation]
    worst, median = shares(ask, coarse, n)
    assert least < worst <= 1.0
    assert median <= widest


@pytest.mark.parametrize("tolerance", [1e-4, pytest.param(1e-7, marks=pytest.mark.slow)])
def test_a_ball_is_never_beyond_its_bounds(tolerance: float) -> None:
    """Over all of the legal range, beside the finest table.  Its ball is the one of 1e-10, which
    test_ball_table.py compares with fresh quadratures."""
    v, y = hard_points(3000, along=False, seed=11)
    truths, largest = rows_of(opened(1e-12), v, y, "across"), {}
    rows = zip(BALL_NAMES, rows_of(opened(tolerance), v, y, "across"), truths, strict=True)
    for name, (value, bound), (truth, fine_bound) in rows:
        error, slope = np.abs(value - truth), name.startswith("slope")
        assert slope or not np.isnan(value).any()
        if slope:  # a gradient is a slope over y0, which underflows where y0 is huge
            error = np.where(y < 1e100, error, 0.0)
        assert np.all(
            (error <= (bound + fine_bound) * (1.0 + 1e-12)) | (slope & ~np.isfinite(error))
        ), name
        share = np.where(bound > 1e-290, (error - fine_bound) / np.maximum(bound, 1e-290), 0.0)
        largest[name] = float(np.nanmax(share))
    assert min(largest[name] for name in BALL_NAMES) > 0.25
    plain = (v > 1e-3) & (v < 1e2) & (y > 1e-2) & (y < 1e2)
    mu, bound = rows_of(opened(tolerance), v[plain], y[plain], "across")[0]
    error = np.abs(mu - truths[0][0][plain])
    assert np.median(bound[error > 0] / error[error > 0]) < 150.0


@pytest.mark.parametrize("name", ["v0", "y0", "mu0"])
def test_the_bound_of_the_standard_deviation_may_not_be_halved(name: str) -> None:
    def ask(s: Surrogate, v: Array, y: Array) -> Any:
        answer = s.evaluate(**UNIT, y0=y, v0=v, **flat({name: 1e-3}))
        return [answer["std"], answer["std_bound"]]

    assert 0.3 < shares(ask, 1e-4, 1500)[0] <= 1.0


@pytest.mark.slow
@pytest.mark.parametrize("name", QUANTITY_NAMES)
def test_the_worst_error_of_every_block_is_about_half_its_bound(
    table: Surrogate, sweep: Sweep, name: str
) -> None:
    """The builder doubles the largest error that it finds; a search at other points finds nearly as
    large ones."""
    worst: dict[str, float] = {}
    for kind in KINDS:
        v, y = DRAWS["spring"].draw(kind, 4000, table, seed=77)
        value, bound, source = table.quantity(name, v, y)
        solved = sweep.solve("full", v, y)
        sliding = REGIME_OF_SOURCE[source] == CONTINUOUS
        noise = solver_noise(name, v, y, solved, sliding)
        error = np.maximum(np.abs(value - solved[name]) - noise, 0.0)
        assert np.all(error <= bound)
        share = error / np.maximum(bound, 1e-300)
        for code in np.unique(source[~sliding] if name == "stick_fraction" else source):
            worst[SOURCES[code]] = max(
                worst.get(SOURCES[code], 0.0), float(share[source == code].max())
            )
    blocks = [worst[where] for where in BLOCK_NAMES if where in worst]
    assert min(blocks) > 0.3
    assert max(blocks) > 0.5
    assert name != "power" or worst["tail_fast"] > 0.5


# --- the border and the regime --------------------------------------------------------------------


@pytest.mark.parametrize("name", QUANTITY_NAMES)
@pytest.mark.parametrize("coarse", [1e-4, 1e-7, 1e-10])
def test_bounds_of_slopes_hold_where_the_regime_is_uncertain_and_next_to_it(
    coarse: float, name: str
) -> None:
    """Of two tables one may say stick-slip and the other continuous sliding; of a root the slope is
    then unbounded."""
    ours, fine = opened(coarse), opened(1e-12)
    rng, precision = np.random.default_rng(5), ours.border.max_rel_error
    smooth = QUANTITIES[QUANTITY_NAMES.index(name)].smooth_at_border
    for low, high in ((0.0, precision), (precision, 4.0 * precision), (1e-13, 1e-2)):
        y = 10.0 ** rng.uniform(-4.0, 7.0, 20_000)
        v = ours.v_tilde_crit(y) * (
            1.0 + rng.choice([-1.0, 1.0], y.size) * rng.uniform(low, high, y.size)
        )
        slopes, truth = (np.array(table.slopes(v, y, name, bounds=True)) for table in (ours, fine))
        assert np.all(np.abs(slopes[1:3] - truth[1:3]) <= slopes[3:] + truth[3:])
        assert not smooth or np.isfinite(slopes).all()
        assert low <= precision or np.isfinite(slopes[3:]).mean() > 0.5
        assert smooth or high != precision or np.isinf(slopes[3:]).all()


@pytest.mark.parametrize(("low", "high"), [(0.1, 1.88), (1.88, 1e4)])
def test_what_the_border_does_to_stick_is_well_bounded(
    table: Surrogate, sweep: Sweep, low: float, high: float
) -> None:
    """Between the border and the table's, where one says stick-slip and the other continuous
    sliding."""
    y = np.geomspace(low, high, 2000)
    v = np.minimum(sweep.solve("border", np.ones_like(y), y)["deficit"], table.v_tilde_crit(y))
    share, bound = table.quantity("stick_fraction", v, y)[:2]
    error = np.abs(share - sweep.solve("full", v, y)["stick_fraction"])
    assert 0.5 < (error / bound).max() <= 1.0


@pytest.mark.parametrize(("share", "certain"), [(0.9, False), (1.1, True)])
def test_a_regime_is_uncertain_within_the_bound_of_the_border(
    table: Surrogate, share: float, certain: bool
) -> None:
    y = np.geomspace(1e-4, 1e6, 200)
    for side in (-share, share):
        v = table.v_tilde_crit(y) * (1.0 + side * table.border.max_rel_error)
        assert np.all(
            table.evaluate(**UNIT, y0=y, v0=v, include="groups").regime_certain == certain
        )


# --- closed forms ---------------------------------------------------------------------------------


def slow_manifold(v: float, y: float) -> mpmath.mpf:
    """mu~ of continuous sliding at large v~ in 24 digits: the angle lags by asin(its rate / speed),
    iterated.

    At equal times of half a period; the angle is antiperiodic, its rate that of its trigonometric
    interpolant.
    """
    m = 2 * int(21.0 / math.asinh(v / y)) + 8
    with mpmath.workdps(24):
        asin, atan, cos, sqrt = (
            np.frompyfunc(getattr(mpmath, name), 1, 1) for name in ("asin", "atan", "cos", "sqrt")
        )
        row = [mpmath.mpf(0), *((-1) ** j * mpmath.csc(mpmath.pi * j / m) for j in range(1, m))]
        rate_of = np.array(
            [[row[i - j] if i >= j else -row[j - i] for j in range(m)] for i in range(m)]
        )
        across = mpmath.mpf(y) * cos(mpmath.pi * np.arange(m) / m)
        speed, direction = sqrt(mpmath.mpf(v) ** 2 + across * across), atan(across / mpmath.mpf(v))
        angle, change = direction, 1.0
        while change > 1e-20:
            before, angle = angle, direction - asin(rate_of.dot(angle) / speed)
            change = max(abs(angle - before))
        return sum(cos(angle)) / m


@pytest.mark.slow
def test_the_closed_form_for_large_speed_is_bounded_tightly(table: Surrogate) -> None:
    """Where it takes over from the blocks: there it leaves out most, up to 6e-16 of mu~, as much as
    rounding."""
    y = np.geomspace(2.0, 1.2e4, 90)
    v = fast_from(table, y) * (1.0 + 1e-9)
    mu, bound, source = table.quantity("mu_ratio", v, y)
    assert {SOURCES[code] for code in source} == {"tail_fast"}
    with mpmath.workdps(24):
        truth = [slow_manifold(*point) for point in zip(v.tolist(), y.tolist(), strict=True)]
        share = [abs(m - t) / b for m, t, b in zip(mu.tolist(), truth, bound.tolist(), strict=True)]
    assert 0.5 < max(share) <= 1.0


def play(v: Any, a: Any) -> tuple[Any, Any, Any]:
    """(mu~, share of stick, power) of u <- clip(u + dx, -1, 1), x = v tau + a sin tau, event by
    event over one period.

    In the digits of mpmath.  The period starts where the upper point turns back: there u = 1.
    """
    sin, cos, pi = mpmath.sin, mpmath.cos, mpmath.pi

    def x(tau: Any) -> Any:
        return v * tau + a * sin(tau)

    back = pi - mpmath.acos(v / a)
    tau, u, mean, stuck, work = back, 1, 0, 0, 0
    for turn, limit in ((2 * pi - back, -1), (back + 2 * pi, 1)):
        offset = x(tau) - u
        slips = (x(turn) - offset - limit) * limit >= 0
        crossed = functools.partial(lambda t, level: x(t) - level, level=offset + limit)
        stop = (
            mpmath.findroot(crossed, (tau, turn), solver="anderson", maxsteps=300, verify=False)
            if slips
            else turn
        )
        mean += v * (stop**2 - tau**2) / 2 - a * (cos(stop) - cos(tau)) - offset * (stop - tau)
        work += v * (stop * sin(stop) - tau * sin(tau) + cos(stop) - cos(tau))
        work += a * (sin(stop) ** 2 - sin(tau) ** 2) / 2 - offset * (sin(stop) - sin(tau))
        stuck += stop - tau
        if slips:
            mean += (turn - stop) * limit
            work += (sin(turn) - sin(stop)) * limit
        tau, u = turn, limit if slips else x(turn) - offset
    return mean / (2 * pi), stuck / (2 * pi), a * work / (2 * pi)


def exact(form: str, mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float) -> Any:
    """mu~ from exact groups; ``y0`` stands for the amplitude of the force where that oscillates."""
    v0, y0, force = mpmath.mpf(v0), mpmath.mpf(y0), mpmath.mpf(mu0) * Fz
    if form == "rigid":
        return 2 / mpmath.pi * mpmath.ellipk(-((y0 * omega / v0) ** 2))
    if form == "at rest":
        return mpmath.sqrt(1 - (y0 * k / force) ** 2)
    v, y = v0 * k / (force * omega), y0 / Fz if form == "normal" else y0 * k / force
    if form == "normal":  # the same function as along at small amplitudes
        return 1 - y * 100 * (1 - play(v / y / 100, mpmath.mpf(1) / 100)[0])
    return play(v, y)[0]


#: where rounding costs most of the bound, searched for over 200 s
CLOSEST = {
    "along": {
        "mu0": 0.23948973388926112,
        "Fz": 1.066615013050693,
        "k": 123381.1344061919,
        "y0": 1.788945141633365e-06,
        "omega": 141.0852242081385,
        "v0": 2.2279422761437278e-07,
    },
    "normal": {
        "mu0": 0.7940066701739672,
        "Fz": 9.008344442627124,
        "k": 1207.7751305095169,
        "y0": 8.746274845376698,
        "omega": 838.3213910319199,
        "v0": 0.08832794636355182,
    },
}


@pytest.mark.parametrize("form", ["along", "normal"])
def test_the_rounding_of_one_spring_along_and_normal_is_bounded_tightly(
    table: Surrogate, form: Any
) -> None:
    six = CLOSEST[form]
    name = "Fz_amplitude" if form == "normal" else "y0"
    case = {(name if key == "y0" else key): value for key, value in six.items()}
    answer = table.evaluate(case, direction=form)
    with mpmath.workdps(40):
        error = abs(answer.mu_macro - six["mu0"] * exact(form, **six))
    assert 0.45 < float(error) / answer.error_bound <= 1.0


@pytest.mark.parametrize("form", ["rigid", "at rest", "along", "normal"])
def test_closed_forms_of_six_inputs_are_bounded_tightly(table: Surrogate, form: str) -> None:
    """Exact groups are no doubles: what rounding them costs is covered, and not by much more."""
    rng, worst = np.random.default_rng(3), 0.0
    direction = form if form in ("along", "normal") else "across"
    kind: Any = direction
    for _ in range(700 if direction != "across" else 500):
        mu0, Fz, omega, ratio = (
            rng.uniform(0.1, 1.0),
            *10.0 ** rng.uniform((-2.0, 0.0, -2.0), (3.0, 5.0, 14.0)),
        )
        k, v0 = (math.inf, 0.01) if form == "rigid" else (10.0 ** rng.uniform(3.0, 8.0), 0.0)
        y0 = ratio * v0 / omega if form == "rigid" else mu0 * Fz / k * (1.0 - 0.01 / ratio)
        if direction != "across":
            y = rng.uniform(0.01, 0.99) if form == "normal" else 10.0 ** rng.uniform(-1.0, 3.0)
            y0, v0 = (
                y * Fz * (mu0 / k if form == "along" else 1.0),
                y * 10.0 ** rng.uniform(-4, 0) * mu0 * Fz / k * omega,
            )
        six = {"mu0": mu0, "Fz": Fz, "k": k, "y0": y0, "omega": omega, "v0": v0}
        case = {
            "Fz_amplitude" if name == "y0" and form == "normal" else name: x
            for name, x in six.items()
        }
        answer = table.evaluate(case, direction=kind)
        with mpmath.workdps(40):
            worst = max(
                worst, float(abs(answer.mu_macro - mu0 * exact(form, **six)) / answer.error_bound)
            )
    assert (0.5 if direction == "across" else 0.3) < worst <= 1.0


# --- roots, settling, standard deviations ---------------------------------------------------------


@pytest.mark.parametrize("unknown", ["v0", "y0"])
@pytest.mark.parametrize("coarse", [1e-4, 1e-7])
def test_an_enclosure_holds_the_true_root_and_may_not_be_halved(
    coarse: float, unknown: str
) -> None:
    """The targets are true values where the table's errors are the largest shares of their bounds,
    seams included."""
    ours, fine, worst = opened(coarse), opened(1e-12), 0.0
    for kind in KINDS:
        v, y = DRAWS["spring"].draw(kind, 20_000, ours, seed=5)
        (mu, bound, _), (truth, fine_bound, _) = (
            s.quantity("mu_ratio", v, y) for s in (ours, fine)
        )
        share = np.maximum(np.abs(mu - truth) - fine_bound, 0.0) / np.maximum(bound, 1e-300)
        for i in np.argsort(share)[-20::4]:
            point: Case = {"v0": float(v[i]), "y0": float(y[i])}
            target = float(fine.evaluate(**UNIT, **point).mu_macro)
            true = point.pop(unknown)
            ((root,),) = solve_for(ours, unknown, target, **{**UNIT, **point}).roots
            far = 4e-15 * true  # the target is rounded, too
            assert root.low - far <= true <= root.high + far, (kind, true, root)
            end = root.high if true > root.value else root.low
            if end not in (0.0, root.value):
                worst = max(worst, math.log(true / root.value) / math.log(end / root.value))
    assert 0.45 < worst <= 1.0 + 0.02  # a straight end may be off by a hundredth of the bound


def test_an_enclosure_that_ends_at_the_border_has_the_bound_of_the_other_side() -> None:
    """mu~ of the table jumps there by more than the bound in stick-slip, and the true root lay in
    the jump."""
    # beyond the table's border, not the true one
    case, true = {**UNIT, "y0": 1.698960831811908}, 0.5521812858302085
    ((root,),) = solve_for(
        opened(1e-4), "v0", float(opened(1e-12).evaluate(**case, v0=true).mu_macro), **case
    ).roots
    assert root.regime == "stick_slip"
    assert root.low <= true <= root.high


@pytest.mark.parametrize(("v", "y"), [(0.3, 0.3), (1.0, 0.5), (2.0, 1.2), (20.0, 30.0), (5.0, 3.0)])
def test_the_bound_of_settling_is_what_the_bounds_of_ratio_and_power_leave_open(
    v: float, y: float
) -> None:
    coarse = opened(1e-4)
    decay = settling(coarse, **UNIT, y0=y, v0=v)
    less = (
        2.0
        * math.pi
        * (v * coarse.quantity("mu_ratio", v, y)[1] + coarse.quantity("power", v, y)[:2][1])
    ) + 2.0 * ROUNDING * decay.slip_path
    assert decay.error_bound == close(
        math.log(100.0) / (decay.slip_path - less) - decay.periods, rel=1e-9
    )

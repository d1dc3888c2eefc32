"""From SI inputs to dimensionless groups: what is legal, what an illegal value is told, and every edge of the range."""

import math
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import ellipk, mpf, pi, workdps

from builder.steady import solve
from friction import InputError, Surrogate
from friction.nondim import (
    BOUNDS,
    FIELDS,
    POSITIVE,
    UNITS,
    amplitude_ratio,
    check_inputs,
    evaluate_block,
    find_faults,
    groups,
)

TABLE = Path(__file__).parent.parent / "tables" / "mumacro-1e-10.nc"
PLAIN = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
positive = st.floats(min_value=5e-324, max_value=1.7976931348623157e308, allow_nan=False, allow_infinity=False)


@pytest.fixture(scope="module")
def table() -> Surrogate:
    return Surrogate.open(TABLE)


def exactly(numerator: list[float], denominator: list[float]) -> float:
    """The quotient of two products in rational arithmetic, rounded once."""
    value = math.prod(map(Fraction, numerator)) / math.prod(map(Fraction, denominator))
    try:
        return float(value)
    except OverflowError:
        return math.inf


def close(found: float, expected: float) -> bool:
    """Equal to a few rounding errors, or to the last digit where numbers run out near zero, or both infinite."""
    if math.isinf(expected) or math.isinf(found):
        return min(found, expected) > 1.797e308
    return abs(found - expected) <= 8e-16 * expected + 5e-324


# --- the groups ---------------------------------------------------------------------------------------


@settings(max_examples=600, deadline=None)
@given(mu0=positive, Fz=positive, k=positive, y0=positive, omega=positive, v0=positive)
def test_groups_are_right_whatever_overflows_on_the_way(
    mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float
) -> None:
    v, y = groups(mu0, Fz, k, y0, omega, v0)
    assert close(v, exactly([v0, k], [mu0, Fz, omega]))
    assert close(y, exactly([y0, k], [mu0, Fz]))
    assert close(amplitude_ratio(y0, omega, v0), exactly([y0, omega], [v0]))


@pytest.mark.parametrize(
    ("inputs", "v", "y"),
    [
        ((1.0, 1e300, 1e300, 1e300, 1.0, 1e300), 1e300, 1e300),
        ((1e-300, 1e-300, 1e-300, 1e-300, 1.0, 1e-300), 1.0, 1.0),
        ((1e200, 1e200, 1e200, 1e200, 1.0, 1e200), 1.0, 1.0),
        ((1e-5, 1e-310, 1e-300, 1e-15, 1e-20, 1e-300), 1e-265, 1.0),
        ((0.5, 1.0, 1e-320, 1.0, 1.0, 1.0), 2e-320, 2e-320),
        ((0.5, 5e-324, 5e-324, 0.25, 1.0, 0.5), 1.0, 0.5),
        ((1e-200, 1e-200, 1e-200, 1e-200, 1e-200, 1e-200), 1e200, 1.0),
    ],
)
def test_groups_at_the_ends_of_double_precision(inputs: tuple[float, ...], v: float, y: float) -> None:
    found_v, found_y = groups(*inputs)
    exact_v = exactly([inputs[5], inputs[2]], [inputs[0], inputs[1], inputs[4]])
    exact_y = exactly([inputs[3], inputs[2]], [inputs[0], inputs[1]])
    assert exact_v == pytest.approx(v, rel=1e-3)  # denormal inputs have few digits of their own
    assert exact_y == pytest.approx(y, rel=1e-3)
    assert close(found_v, exact_v)
    assert close(found_y, exact_y)


# --- edge cases of the answer -------------------------------------------------------------------------


@pytest.mark.parametrize("stillness", [{"y0": 0.0}, {"omega": 0.0}, {"y0": 0.0, "omega": 0.0}, {"y0": 0.0, "v0": 0.0}])
@pytest.mark.parametrize("k", [1e6, None, 5e-324, 1e308])
def test_no_oscillation_is_coulomb_friction(table: Surrogate, stillness: dict[str, float], k: float | None) -> None:
    found = table.evaluate(**{**PLAIN, **stillness, "k": k})
    assert found.mu_macro == PLAIN["mu0"]
    assert found.mu_ratio == 1.0
    assert found.error_bound == 0.0
    assert found.source == "no_oscillation"


@pytest.mark.parametrize("y", [1e-300, 0.3, 0.6, 0.999, 1.0, 1.2, 1e5, 1e300])
def test_no_drive_is_the_static_limit(table: Surrogate, y: float) -> None:
    found = table.evaluate(mu0=0.5, Fz=2.0, k=1.0, y0=y, omega=7.0, v0=0.0)
    assert found.y_tilde == y
    assert found.v_tilde == 0.0
    assert found.mu_ratio == pytest.approx(math.sqrt((1.0 - y) * (1.0 + y)) if y < 1.0 else 0.0, rel=5e-16, abs=0.0)
    assert found.regime == "static"
    assert found.source == "static_limit"
    assert 0.0 <= found.error_bound < 1e-12


def test_no_drive_where_the_amplitude_overflows(table: Surrogate) -> None:
    found = table.evaluate(mu0=0.5, Fz=1e-300, k=1e300, y0=1.0, omega=1.0, v0=0.0)
    assert found.y_tilde == math.inf
    assert found.mu_macro == 0.0


@pytest.mark.parametrize(
    ("y0", "omega", "v0"), [(1e-6, 1e5, 0.01), (1e-3, 1e3, 50.0), (1e-200, 1e-200, 1e-300), (1.0, 1e300, 1.0)]
)
def test_rigid_contact_is_the_elliptic_integral(table: Surrogate, y0: float, omega: float, v0: float) -> None:
    found = table.evaluate(mu0=0.4, Fz=3.0, k=None, y0=y0, omega=omega, v0=v0)
    with workdps(700):
        expected = float(2 / pi * ellipk(-((mpf(y0) * mpf(omega) / mpf(v0)) ** 2)))
    assert found.mu_ratio == pytest.approx(expected, rel=1e-15)
    assert found.source == "rigid"
    assert found.length_scale == 0.0
    assert found.v_tilde == found.y_tilde == math.inf


def test_rigid_contact_is_what_ever_stiffer_springs_tend_to(table: Surrogate) -> None:
    rigid = table.evaluate(**{**PLAIN, "k": None}).mu_macro
    gaps = [abs(table.evaluate(**{**PLAIN, "k": k}).mu_macro - rigid) for k in (1e9, 1e10, 1e11, 1e200)]
    assert gaps[0] > gaps[1] > gaps[2]
    assert gaps[3] < 1e-15


def test_rigid_contact_without_drive_has_no_friction(table: Surrogate) -> None:
    found = table.evaluate(**{**PLAIN, "k": None, "v0": 0.0})
    assert found.mu_macro == 0.0
    assert found.regime == "static"


@pytest.mark.parametrize(
    ("inputs", "expected"),
    [
        # y~ underflows: nothing happens; y~ overflows while v~ overflows too: only their ratio counts
        ({"y0": 1e-300, "k": 1e-300, "Fz": 1e300}, 1.0),
        ({"y0": 1e200, "k": 1e200, "v0": 1e200, "omega": 1.0}, 0.8346268416740731),  # r = 1: 1/AGM(1, sqrt 2)
        ({"y0": 1e300, "k": 1e300, "v0": 1e-300, "omega": 1e300}, 0.0),
        ({"v0": 5e-324, "omega": 1e300, "y0": 1e-6}, 0.9428090415820634),  # v~ underflows: static limit at y~ = 1/3
        ({"v0": 1e300, "omega": 1e-300}, 1.0),
    ],
)
def test_groups_that_leave_double_precision_still_have_their_limit(
    table: Surrogate, inputs: dict[str, float], expected: float
) -> None:
    found = table.evaluate(**{**PLAIN, **inputs})
    assert abs(found.mu_ratio - expected) <= found.error_bound / PLAIN["mu0"] + 1e-15
    assert found.mu_ratio == pytest.approx(expected, rel=1e-12, abs=1e-280)


@settings(max_examples=400, deadline=None)
@given(mu0=positive, Fz=positive, k=positive, y0=positive, omega=positive, v0=positive)
def test_any_legal_input_has_a_finite_answer_with_a_bound(
    table: Surrogate, mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float
) -> None:
    found = table.evaluate(mu0, Fz, k, y0, omega, v0)
    assert 0.0 <= found.mu_ratio <= 1.0
    assert 0.0 <= found.mu_macro <= mu0
    assert 0.0 <= found.error_bound <= mu0  # a wider bound would say nothing
    assert not math.isnan(found.length_scale)
    whole = table.evaluate(np.array([mu0, mu0]), Fz, k, y0, omega, v0)
    assert whole.mu_ratio.tolist() == [found.mu_ratio] * 2
    assert whole.error_bound.tolist() == [found.error_bound] * 2


exponent = st.integers(min_value=-60, max_value=60)


@settings(max_examples=300, deadline=None)
@given(a=exponent, b=exponent, c=exponent, v=st.floats(1e-6, 1e6), y=st.floats(1e-6, 1e6))
def test_only_the_two_groups_matter(table: Surrogate, a: int, b: int, c: int, v: float, y: float) -> None:
    """Scaling the inputs by powers of two so that v~ and y~ stay leaves mu~ as it is, to the last digit."""
    plain = table.evaluate(mu0=0.5, Fz=2.0, k=1.0, y0=y, omega=1.0, v0=v)
    length, force, time = 2.0**a, 2.0**b, 2.0**c
    scaled = table.evaluate(
        mu0=0.5, Fz=2.0 * force, k=force / length, y0=y * length, omega=1.0 / time, v0=v * length / time
    )
    assert (scaled.v_tilde, scaled.y_tilde) == (plain.v_tilde, plain.y_tilde) == (v, y)
    assert scaled.mu_macro == plain.mu_macro
    assert scaled.source == plain.source
    assert scaled.length_scale == length * plain.length_scale
    swapped = table.evaluate(mu0=0.5 * force, Fz=2.0 / force, k=1.0, y0=y, omega=1.0, v0=v)
    assert swapped.mu_ratio == plain.mu_ratio


def test_answer_agrees_with_the_exact_solver(table: Surrogate) -> None:
    found = table.evaluate(**PLAIN)
    l0 = 0.3 * 10.0 / 1e6
    exact = 0.3 * solve(0.01 / (l0 * 1.3e5), 2e-6 / l0).mu_ratio
    assert abs(found.mu_macro - exact) <= found.error_bound
    assert found.length_scale == pytest.approx(l0, rel=1e-15)
    assert found.v_tilde == pytest.approx(0.01 / (l0 * 1.3e5), rel=1e-15)


# --- what is illegal, and what it is told -------------------------------------------------------------


def test_fields_bounds_and_units_name_the_same() -> None:
    assert tuple(BOUNDS) == tuple(UNITS) == FIELDS
    assert set(POSITIVE) < set(FIELDS)


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("bad", [-1.0, -5e-324, math.nan, math.inf, -math.inf])
def test_illegal_value_is_named_with_field_and_bound(table: Surrogate, field: str, bad: float) -> None:
    for given_inputs, index in (({**PLAIN, field: bad}, None), ({**PLAIN, field: [PLAIN[field], bad, bad]}, 1)):
        for check in (check_inputs, lambda columns: table.evaluate(**columns)):
            with pytest.raises(InputError) as caught:
                check(given_inputs)
            error = caught.value
            assert (error.field, error.index, error.bound) == (field, index, BOUNDS[field])
            assert repr(error.value) == repr(bad)
            where = "" if index is None else " at index 1"
            assert str(error) == f"{field}{where} must be {BOUNDS[field]}, got {bad!r}"
            assert isinstance(error, ValueError)


@pytest.mark.parametrize("field", FIELDS)
def test_zero_is_legal_only_where_it_says_so(table: Surrogate, field: str) -> None:
    if field in POSITIVE:
        with pytest.raises(InputError, match=f"^{field} must be finite and > 0, got 0.0$"):
            table.evaluate(**{**PLAIN, field: 0.0})
    else:
        assert math.isfinite(table.evaluate(**{**PLAIN, field: 0.0}).mu_macro)
        assert table.evaluate(**{**PLAIN, field: -0.0}).mu_macro == table.evaluate(**{**PLAIN, field: 0.0}).mu_macro


@pytest.mark.parametrize("bad", ["much", [1.0, "x"], {"a": 1}, object(), 1j, [[1.0], [1.0, 2.0]]])
def test_what_is_no_number_is_refused_by_name(table: Surrogate, bad: Any) -> None:
    with pytest.raises(InputError, match=r"^Fz must be a real number or an array of them, got") as caught:
        table.evaluate(**{**PLAIN, "Fz": bad})
    assert caught.value.field == "Fz"


def test_shapes_that_do_not_broadcast_are_refused(table: Surrogate) -> None:
    with pytest.raises(InputError, match="shapes broadcast together") as caught:
        table.evaluate(**{**PLAIN, "Fz": [1.0, 2.0], "v0": [1.0, 2.0, 3.0]})
    assert "(2,)" in str(caught.value)


def test_faults_of_a_batch_come_in_order_one_for_a_case() -> None:
    faults = find_faults(
        {
            "mu0": 0.3,
            "Fz": [1.0, -1.0, 1.0, 0.0, 1.0],
            "k": [1.0, math.nan, 1.0, 1.0, 1.0],
            "y0": 0.0,
            "omega": 1.0,
            "v0": [0.0, 0.0, 0.0, 0.0, math.inf],
        }
    )
    assert [(fault.index, fault.field) for fault in faults] == [(1, "Fz"), (3, "Fz"), (4, "v0")]
    assert [fault.value for fault in faults] == [-1.0, 0.0, math.inf]
    assert [fault.reason for fault in faults] == [
        "must be finite and > 0", "must be finite and > 0", "must be finite and >= 0",
    ]  # fmt: skip


def test_a_bad_scalar_spoils_every_case_of_a_batch() -> None:
    faults = find_faults({**PLAIN, "omega": -1.0, "v0": [1.0, 2.0, 3.0]})
    assert [(fault.index, fault.field) for fault in faults] == [(0, "omega"), (1, "omega"), (2, "omega")]


def test_faultless_batches_and_rigid_contacts() -> None:
    assert find_faults(PLAIN) == []
    assert find_faults({**PLAIN, "k": None}) == []
    without = {name: value for name, value in PLAIN.items() if name != "k"}
    assert find_faults(without) == []
    assert "k" not in check_inputs(without)
    assert check_inputs({**PLAIN, "v0": [1, 2]})["v0"].dtype == np.float64


@pytest.mark.parametrize("n", [1, 255, 256, 1000])
def test_a_block_on_one_thread_says_what_the_array_says(table: Surrogate, n: int) -> None:
    rng = np.random.default_rng(n)
    columns = [
        rng.uniform(0.1, 0.8, n), 10.0 ** rng.uniform(-1.0, 3.0, n), 10.0 ** rng.uniform(4.0, 8.0, n),
        10.0 ** rng.uniform(-8.0, -3.0, n), 10.0 ** rng.uniform(0.0, 6.0, n), 10.0 ** rng.uniform(-6.0, 1.0, n),
    ]  # fmt: skip
    for column in columns[3:]:
        column[:: max(2, n // 7)] = 0.0
    for fixed in (None, 0, 2, 5):
        given = [c[:1].copy() if i == fixed else c for i, c in enumerate(columns)]
        macro, mu, bound = np.empty(n), np.empty(n), np.empty(n)
        source = np.empty(n, dtype=np.int8)
        assert evaluate_block(*given, *table._data, macro, mu, bound, source) == 0
        expected = table.evaluate(*(c if c.size == n else np.full(n, c[0]) for c in given))
        np.testing.assert_array_equal(macro, expected.mu_macro)
        np.testing.assert_array_equal(mu, expected.mu_ratio)
        np.testing.assert_array_equal(bound, expected.error_bound)
        np.testing.assert_array_equal(source, expected.source_code)


def test_a_block_marks_illegal_cases_and_takes_infinite_stiffness_for_rigid(table: Surrogate) -> None:
    mu0 = np.array([0.3, -0.3, 0.3, 0.3, math.nan, 0.3])
    force = np.array([10.0, -10.0, 10.0, 0.0, 10.0, 10.0])
    k = np.array([1e6, 1e6, math.inf, 1e6, 1e6, -1e6])
    macro, mu, bound, source = np.empty(6), np.empty(6), np.empty(6), np.empty(6, dtype=np.int8)
    rest = (np.array([2e-6]), np.array([1.3e5]), np.array([0.01]))
    assert evaluate_block(mu0, force, k, *rest, *table._data, macro, mu, bound, source) == 4
    assert np.flatnonzero(source < 0).tolist() == [1, 3, 4, 5]
    assert np.isnan(macro[source < 0]).all()
    assert macro[2] == table.evaluate(0.3, 10.0, None, 2e-6, 1.3e5, 0.01).mu_macro

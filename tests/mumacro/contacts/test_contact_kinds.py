"""Ball, oscillation along and of the normal force, intervals of k: what holds for every contact and
direction."""

import itertools
import math
import pickle
from typing import Any

import numpy as np
import pandas as pd
import pytest

from mumacro import Surrogate
from mumacro.inputs.fields import kind_of
from mumacro.table.atlas import QUANTITY_NAMES, SOURCES
from tests.support.cases import (
    CASE,
    PAIRS,
    TOLERANCES,
    Array,
    Case,
    as_kind,
    every_pair,
    opened,
    tables,
    without,
)
from tests.support.comparing import close
from tests.support.refusals import refused

BALL: Case = {"contact": "ball"}
NORMAL: Case = {"direction": "normal"}
every_other_pair = pytest.mark.parametrize("pair", PAIRS[1:], ids=" ".join)
table = tables(1e-10)


@every_other_pair
def test_the_gradient_is_that_of_the_answers(table: Surrogate, pair: Any) -> None:
    rng = np.random.default_rng(6)
    for _ in range(40):
        words, fields, case = as_kind(
            {name: x * 10.0 ** rng.uniform(-0.7, 0.7) for name, x in CASE.items()}, pair
        )
        if pair[1] == "normal":
            case["Fz_amplitude"] = rng.uniform(0.05, 0.95) * case["Fz"]
        answer = table.evaluate(**case, **words, gradient=True)
        assert list(answer.gradient) == list(fields)
        for name, x in case.items():
            up, down = (
                table.evaluate(**{**case, name: x * (1.0 + h)}, **words) for h in (1e-6, -1e-6)
            )
            if {up.source_code, down.source_code} != {answer.source_code}:
                continue
            difference = (up.mu_macro - down.mu_macro) / (2e-6 * x)
            rounding = 1e-10 if pair[0] == "ball" else 1e-5
            noise = (
                min(up.error_bound + down.error_bound, 2e-12) / (2e-6 * x)
                + rounding * case["mu0"] / x
            )
            assert answer.gradient[name] == close(
                difference, abs=noise + answer.gradient_bound[name]
            )
            if pair == ("ball", "across"):
                assert answer.gradient_bound[name] < 1e-2 * max(
                    abs(answer.gradient[name]), answer.mu_macro / x
                )


@every_pair
def test_any_groups_have_an_answer_or_none(pair: Any) -> None:
    kind = kind_of(*pair)
    size = np.array([0.0, 5e-324, 1e-300, 1e-150, 1e-10, 0.5, 1.0, 1e10, 1e150, 1e281, 1.7e308])
    v, y = (a.ravel() for a in np.meshgrid(size, size))
    legal = y < 1.0 if kind.normal else y < np.inf
    for s, name in itertools.product(
        map(opened, TOLERANCES), QUANTITY_NAMES[: 1 if kind.direction else 3]
    ):
        value, bound, source = s.quantity(name, v, y, **kind.names)
        assert np.all(((value >= 0.0) & (bound >= 0.0) & (source >= 0))[legal])
        assert name != "mu_ratio" or np.all(((value <= 1.0) & np.isfinite(bound))[legal])
        assert np.all(np.isnan(value[~legal]) & (source[~legal] == -1))
        if pair == PAIRS[0]:
            slopes = np.array(s.slopes(v[legal], y[legal], name, bounds=True))
            assert not np.isnan(slopes).any()
            assert np.all(slopes[3:] >= 0.0)
    assert np.isnan(
        s.quantity("mu_ratio", [-1.0, 1.0, np.nan, 1.0], [0.5, -1.0, 0.5, np.inf], **kind.names)[0]
    ).all()


@every_pair
def test_what_is_illegal_in_an_array_has_neither_value_nor_bound(pair: Any) -> None:
    words, fields, case = as_kind(CASE, pair)
    table = opened(1e-4)
    v, y = np.array([(0.1, -1.0), (-1.0, 0.5), (np.nan, 0.5), (0.1, np.nan)]).T
    names = QUANTITY_NAMES if pair[1] != "normal" else ("mu_ratio", "stick_fraction")
    for name in names:
        value, bound, source = table.quantity(name, v, y, **words)
        assert np.isnan([value, bound]).all(), name
        assert np.all(source == -1), name
    for field, bad in itertools.product(fields, (-1.0, np.nan)):
        answer = table.evaluate(
            {**case, field: np.array([bad, case[field]])}, **words, gradient=True
        )
        rows = [answer.mu_macro, answer.mu_ratio, answer.error_bound, answer.length_scale]
        rows += [*answer.gradient.values(), *answer.gradient_bound.values()]
        assert np.isnan([row[0] for row in rows]).all(), field
        assert not np.isnan([row[1] for row in rows]).any(), field


@every_other_pair
def test_arrays_are_scalars_also_on_threads_and_from_a_pickle(table: Surrogate, pair: Any) -> None:
    words, _, case = as_kind(CASE, pair)
    v0 = np.geomspace(1e-6, 10.0, 400)
    many = table.evaluate(**{**case, "v0": v0}, **words, gradient=True)
    for i in range(0, 400, 37):
        one = table.evaluate(**{**case, "v0": v0[i]}, **words, gradient=True)
        for name in (
            "mu_macro",
            "error_bound",
            "source_code",
            "v_tilde",
            "y_tilde",
            "regime_certain",
        ):
            assert getattr(one, name) == getattr(many, name)[i], name
        assert [*one.gradient.values()] == [slope[i] for slope in many.gradient.values()]
        ratio, bound, _ = table.quantity("mu_ratio", one.v_tilde, one.y_tilde, **words)
        assert (one.mu_macro, one.error_bound) == (ratio * CASE["mu0"], bound * CASE["mu0"])
    threaded = Surrogate.open(1e-10, threads=4)
    for other in (threaded, pickle.loads(pickle.dumps(threaded))):  # noqa: S301 - made here
        answer = other.evaluate(**{**case, "v0": np.tile(v0, 5)}, **words, gradient=True)
        np.testing.assert_array_equal(answer.mu_macro, np.tile(many.mu_macro, 5))
        np.testing.assert_array_equal(answer.gradient["v0"], np.tile(many.gradient["v0"], 5))


REFUSED = [
    ({"contact": "cube"}, "contact"),
    ({"contact": None}, "contact"),
    ({"direction": "up"}, "direction"),
    ({**NORMAL, **BALL}, "direction"),
    ({"Fz_amplitude": 1.0, **BALL}, "Fz_amplitude"),
    ({"v0": -1.0, **BALL}, "v0"),
    ({"y0": None, "Fz_amplitude": 10.0, **NORMAL}, "Fz_amplitude"),
    ({"y0": None, "Fz_amplitude": -1.0, **NORMAL}, "Fz_amplitude"),
    ({"y0": None, **NORMAL}, "Fz_amplitude"),
    ({"Fz_amplitude": 1.0, **NORMAL}, "y0"),
    ({"v0": [-1.0, 0.01], "illegal": "raise", **BALL}, "v0[0]"),
    (
        {"y0": None, "Fz_amplitude": [1.0, 10.0], "illegal": "raise", **NORMAL},
        "Fz_amplitude[1]",
    ),
    ({"k_low": 1e6, "k_high": 2e6}, "k"),
    ({"k": None, "k_low": 2e6, "k_high": 1e6}, "k_low"),
    ({"k": None, "k_range": (1e6, 2e6)}, "k_range"),
    ({"k": None, "k_low": 0.0, "k_high": 1e6}, "k_low"),
    ({"k": None, "k_low": 1e6, "k_high": math.inf}, "k_high"),
    ({"k": None, "k_low": 1e6}, "k_high"),
    ({"k": None, "k_low": "a", "k_high": 1e6}, "k_low"),
]


@pytest.mark.parametrize(("changed", "place"), REFUSED)
def test_what_does_not_belong_is_named(table: Surrogate, changed: Any, place: str) -> None:
    inputs = {**CASE, **changed}
    absent = [name for name in ("k", "y0") if inputs[name] is None]
    with refused(place):
        table.evaluate(**without(inputs, *absent))


def test_an_illegal_case_of_an_array_is_alone_and_the_normal_force_has_no_power(
    table: Surrogate,
) -> None:
    bad = table.evaluate(**{**CASE, "v0": [-1.0, 0.01]}, **BALL)
    assert bad.source_code.tolist() == [-1, SOURCES.index("ball_partial_slip")]
    lifted = table.evaluate(**without(CASE, "y0"), Fz_amplitude=[1.0, 10.0, 11.0], **NORMAL)
    assert lifted.source_code.tolist()[1:] == [-1, -1]
    with refused("direction"):
        table.power(0.1, 0.5, **NORMAL)
    with refused("y_tilde"):
        table.quantity("mu_ratio", 0.1, 1.0, **NORMAL)


@pytest.mark.parametrize("end", ["1 ± 0.1 N/um", ["1 ± 0.1 N/um", "1 N/um"]], ids=str)
def test_an_end_of_an_interval_has_no_deviation(table: Surrogate, end: Any) -> None:
    with refused("k_low"):
        table.evaluate(**without(CASE, "k"), k_low=end, k_high="2 N/um")


def test_labels_are_kept(table: Surrogate) -> None:
    """Every contact and direction, and an interval, keep the labels and give the bits of arrays."""
    xr, v0 = pytest.importorskip("xarray"), np.array([0.01, 0.02, 0.05])
    plain = table.evaluate(**{**CASE, "v0": v0}, **BALL, gradient=True)
    series = table.evaluate(
        **{**CASE, "v0": pd.Series(v0, index=list("abc"))}, **BALL, gradient=True
    )
    assert series.index.tolist() == list("abc")
    for path in ("mu_macro", "gradient.k"):
        assert series[path].tolist() == plain[path].tolist()
    frame = table.evaluate(pd.DataFrame({**CASE, "v0": v0}), **BALL)
    assert (frame.mu_macro.tolist(), set(frame.regime)) == (
        plain.mu_macro.tolist(),
        {"partial_slip"},
    )
    force = {"Fz_amplitude": xr.DataArray([1.0, 4.0], dims="force"), "k_low": 1e6, "k_high": 2e6}
    answer = table.evaluate(**without(CASE, "k", "y0"), **force, **NORMAL, gradient=True)
    assert answer.mu_macro_low.dims == ("force",)
    assert answer["gradient.Fz_amplitude"].dims == ("force",)
    assert np.all(answer.mu_macro_low <= answer.mu_macro_high)


# --- an interval of k: the extremes of mu_macro over it, which may lie inside ---------------------

RAY: Case = {"mu0": 1.0, "Fz": 1.0, "y0": 20.0, "omega": 1.0, "v0": 1.0}


@every_pair
def test_the_extremes_are_those_of_a_dense_sampling(table: Surrogate, pair: Any) -> None:
    rng = np.random.default_rng(1)
    for _ in range(40 if pair == PAIRS[0] else 12):
        words, _, case = as_kind(
            {**CASE, "v0": 10.0 ** rng.uniform(-3, 0), "y0": 10.0 ** rng.uniform(-7, -4)}, pair
        )
        case, low = without(case, "k"), 10.0 ** rng.uniform(4, 8)
        high = low * 10.0 ** rng.uniform(0, 3)
        answer = table.evaluate(k_low=low, k_high=high, **case, **words)
        some = table.evaluate(k=np.geomspace(low, high, 3000), **case, **words)
        slack = answer.error_bound + some.error_bound.max()
        for end, sampled, sign in (
            (answer.mu_macro_low, some.mu_macro.min(), 1.0),
            (answer.mu_macro_high, some.mu_macro.max(), -1.0),
        ):
            assert sign * (sampled - end) >= -slack
            assert end == close(sampled, abs=slack + 1e-7)
        middle = table.evaluate(k=math.sqrt(low) * math.sqrt(high), **case, **words)
        assert (answer.mu_macro, answer.source, answer.v_tilde) == (
            middle.mu_macro,
            middle.source,
            middle.v_tilde,
        )


@every_pair
def test_an_answer_at_rest_says_that_it_is_the_static_limit(table: Surrogate, pair: Any) -> None:
    words, _, case = as_kind({**CASE, "v0": 0.0}, pair)
    one = table.evaluate(case, **words)
    many = table.evaluate({**case, "v0": np.array([0.0, 0.01])}, **words)
    assert one.source == many.source[0] == "static_limit" != many.source[1]


@every_pair
@pytest.mark.parametrize("factor", [3.0, 10.0, 30.0])
def test_the_bound_of_an_interval_covers_its_ends_and_its_middle(
    table: Surrogate, pair: Any, factor: float
) -> None:
    words, _, case = as_kind(CASE, pair)
    for middle in (0.1 * case["k"], case["k"]):
        k = np.array([middle / factor, middle, middle * factor])
        largest = table.evaluate(**{**case, "k": k}, **words).error_bound.max()
        rest = without(case, "k")
        one = table.evaluate(k_low=k[0], k_high=k[2], **rest, **words)
        many = table.evaluate(k_low=k[:1], k_high=k[2:], **rest, **words)
        # the middle is off by a digit, which may change its bound by a share
        assert one.error_bound >= (1.0 - 1e-4) * largest
        assert many.error_bound.tolist() == [one.error_bound]


@pytest.mark.parametrize("pair", PAIRS[:2], ids=" ".join)
@pytest.mark.parametrize("ratio", [10.5, 11.9, 12.1, 20.0, 300.0, 3e4])
def test_extremes_inside(table: Surrogate, pair: Any, ratio: Any) -> None:
    """mu~ rises with k between a smallest and a largest value, so both ends of the interval lie
    between them."""
    ray = {**RAY, "y0": ratio}
    kind, k = {"contact": pair[0]}, np.geomspace(1.0, 10.0 * ratio**2, 6001) / ratio
    slope = table.evaluate(k=k, **ray, **kind, gradient=True).gradient["k"]
    turns = k[1:][slope[1:] * slope[:-1] < 0.0]
    assert turns.size == 2
    ends = turns[0] / 1.5, turns[1] * 1.5
    answer = table.evaluate(k_low=ends[0], k_high=ends[1], **ray, **kind)
    least, most, *both = (table.evaluate(k=x, **ray, **kind).mu_macro for x in (*turns, *ends))
    only = table.evaluate(k_low=turns[0] / 1.1, k_high=turns[0] * 1.1, **ray, **kind)
    assert only.mu_macro_low == close(least, abs=1e-6)
    assert only.mu_macro_low < min(both[0], only.mu_macro_high)
    assert answer.mu_macro_low <= min(least, *both) + 1e-9
    assert answer.mu_macro_high >= max(most, *both) - 1e-9
    # however far away the other end is
    until = table.evaluate(k_low=1e-300, k_high=turns[1] / 1.1, **ray, **kind)
    since = table.evaluate(k_low=turns[0] * 1.1, k_high=1e300, **ray, **kind)
    assert until.mu_macro_low <= least + 1e-9
    assert until.mu_macro_low == close(least, rel=1e-4)
    assert since.mu_macro_high >= most - 1e-9
    assert since.mu_macro_high == close(most, rel=1e-4)


@pytest.mark.parametrize(
    ("contact", "ratio", "ends"),
    [
        *(("spring", ratio, np.geomspace(0.6, 0.74, 21)) for ratio in (9.725, 9.735, 9.75, 9.8)),
        ("ball", 10.44683, np.geomspace(0.791, 0.807, 21)),
    ],
)
def test_turns_closer_than_samples(
    table: Surrogate, contact: str, ratio: float, ends: Array
) -> None:
    """Where both turns have just begun, an interval that ends between them, or next to them."""
    ray = {**RAY, "y0": ratio, "contact": contact}
    for end in ends:
        answer = table.evaluate(k_low=end * np.exp(-0.31), k_high=end, **ray)
        some = table.evaluate(k=end * np.exp(np.linspace(-0.31, 0.0, 5001)), **ray).mu_macro
        assert answer.mu_macro_low <= some.min() + answer.error_bound
        assert answer.mu_macro_high >= some.max() - answer.error_bound


def test_intervals_in_arrays_columns_and_of_one_point(table: Any) -> None:
    case, low, high, v0 = (
        without(CASE, "k"),
        [2e5, 8e5, 1e6, np.nan, -1.0],
        1.2e6,
        np.array([[0.01], [0.1]]),
    )
    answer: Any = table.evaluate(
        k_low=np.array(low), k_high=high, **{**case, "v0": v0}, gradient=True
    )
    assert answer.mu_macro_low.shape == (2, 5)
    for i, j in np.ndindex(2, 3):
        one = table.evaluate(k_low=low[j], k_high=high, **{**case, "v0": v0[i, 0]}, gradient=True)
        assert (one.mu_macro, one.gradient["k"]) == (
            answer.mu_macro[i, j],
            answer.gradient["k"][i, j],
        )
        assert one.mu_macro_low == close(answer.mu_macro_low[i, j], abs=1e-12)
        assert one.mu_macro_high == close(answer.mu_macro_high[i, j], abs=1e-12)
    assert np.isnan(answer.mu_macro_low[:, 3:]).all()
    assert (answer.source_code[:, 3:] == -1).all()
    point = table.evaluate(k_low=1e6, k_high=1e6, **case)
    assert (
        point.mu_macro_low
        == point.mu_macro
        == point.mu_macro_high
        == table.evaluate(**CASE).mu_macro
    )
    frame = pd.DataFrame({**case, "k_low": [8e5, 1e6], "k_high": [1.2e6, 2e6]})
    answers: Any = table.evaluate(frame)
    widest = table.evaluate(k_low=5e-324, k_high=1.7e308, **case)  # a ratio beyond double range
    assert (
        widest.mu_macro_low < table.evaluate(k="rigid", **case).mu_macro
    )  # it falls below that of rigid contact first
    assert widest.mu_macro_high == close(CASE["mu0"], rel=1e-12)
    pairs = table.evaluate(k_low=frame.k_low.to_numpy(), k_high=frame.k_high.to_numpy(), **case)
    assert answers.mu_macro_low.tolist() == pairs.mu_macro_low.tolist()
    assert answers.mu_macro_high.tolist() == pairs.mu_macro_high.tolist()
    with refused("k"):
        table.evaluate(frame.assign(k=1e6))

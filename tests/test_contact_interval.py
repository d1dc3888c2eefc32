"""An interval of stiffnesses: the extremes of mu_macro over it, which may lie inside."""

import math

import numpy as np
import pandas as pd
import pytest

from mumacro import InputError, Surrogate
from tests.comparing import close

CASE = {"mu0": 0.3, "Fz": 10.0, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
KINDS = [{}, {"contact": "ball"}, {"direction": "along"}]


@pytest.fixture(scope="module")
def table():
    return Surrogate.open(1e-10)


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_extremes_of_a_dense_sampling(table, kind):
    rng = np.random.default_rng(1)
    for _ in range(40 if not kind else 12):
        case = {**CASE, "v0": 10.0 ** rng.uniform(-3, 0), "y0": 10.0 ** rng.uniform(-7, -4)}
        low = 10.0 ** rng.uniform(4, 8)
        high = low * 10.0 ** rng.uniform(0, 3)
        found = table.evaluate(k_range=(low, high), **case, **kind)
        some = table.evaluate(k=np.geomspace(low, high, 3000), **case, **kind)
        slack = found.error_bound + some.error_bound.max()
        assert found.mu_macro_low <= some.mu_macro.min() + slack
        assert found.mu_macro_high >= some.mu_macro.max() - slack
        assert found.mu_macro_low == close(some.mu_macro.min(), abs=slack + 1e-7)
        assert found.mu_macro_high == close(some.mu_macro.max(), abs=slack + 1e-7)
        middle = table.evaluate(k=math.sqrt(low) * math.sqrt(high), **case, **kind)
        assert (found.mu_macro, found.source, found.v_tilde) == (middle.mu_macro, middle.source, middle.v_tilde)


@pytest.mark.parametrize("kind", KINDS[:2], ids=str)
def test_extremes_inside(table, kind):
    """mu~ rises with k between a smallest and a largest value, so both ends of the interval lie between them."""
    ray = {"mu0": 1.0, "Fz": 1.0, "y0": 20.0, "omega": 1.0, "v0": 1.0}
    k = np.geomspace(1e-2, 1e4, 6001)
    slope = table.evaluate(k=k, **ray, **kind, gradient=True).gradient["k"]
    turns = k[1:][slope[1:] * slope[:-1] < 0.0]
    assert turns.size == 2
    ends = turns[0] / 1.5, turns[1] * 1.5
    found = table.evaluate(k_range=ends, **ray, **kind)
    least, most = (table.evaluate(k=x, **ray, **kind).mu_macro for x in turns)
    both = [table.evaluate(k=x, **ray, **kind).mu_macro for x in ends]
    only = table.evaluate(k_range=(turns[0] / 1.1, turns[0] * 1.1), **ray, **kind)
    assert only.mu_macro_low == close(least, abs=1e-6)
    assert only.mu_macro_low < min(both[0], only.mu_macro_high)
    assert found.mu_macro_low <= min(least, *both) + 1e-9
    assert found.mu_macro_high >= max(most, *both) - 1e-9


@pytest.mark.parametrize("ratio", [9.725, 9.735, 9.75, 9.8])
def test_turns_closer_than_samples(table, ratio):
    """Where both turns have just begun, an interval that ends between them, or next to them."""
    ray = {"mu0": 1.0, "Fz": 1.0, "y0": ratio, "omega": 1.0, "v0": 1.0}
    for end in np.exp(np.linspace(-0.5, -0.3, 21)):
        found = table.evaluate(k_range=(end * np.exp(-0.31), end), **ray)
        some = table.evaluate(k=end * np.exp(np.linspace(-0.31, 0.0, 5001)), **ray).mu_macro
        assert found.mu_macro_low <= some.min() + found.error_bound
        assert found.mu_macro_high >= some.max() - found.error_bound


def test_a_point_and_normal(table):
    found = table.evaluate(k_range=(1e6, 1e6), **CASE)
    assert found.mu_macro_low == found.mu_macro == found.mu_macro_high == table.evaluate(k=1e6, **CASE).mu_macro
    case = {name: x for name, x in CASE.items() if name != "y0"}
    found = table.evaluate(k_range=(1e5, 1e6), Fz_amplitude=4.0, direction="normal", **case)
    low, high = (
        table.evaluate(k=k, Fz_amplitude=4.0, direction="normal", **case).mu_macro for k in (1e5, 1e6)
    )  # rises with v~
    assert (found.mu_macro_low, found.mu_macro_high) == (low, high)


def test_arrays_are_scalars(table):
    low, high, v0 = np.array([2e5, 8e5, 1e6, np.nan, -1.0]), 1.2e6, np.array([[0.01], [0.1]])
    found = table.evaluate(k_range=(low, high), **{**CASE, "v0": v0}, gradient=True)
    assert found.mu_macro_low.shape == (2, 5)
    for i in range(2):
        for j in range(3):
            one = table.evaluate(k_range=(low[j], high), **{**CASE, "v0": v0[i, 0]}, gradient=True)
            assert one.mu_macro == found.mu_macro[i, j]
            assert one.gradient["k"] == found.gradient["k"][i, j]
            assert one.mu_macro_low == close(found.mu_macro_low[i, j], abs=1e-12)
            assert one.mu_macro_high == close(found.mu_macro_high[i, j], abs=1e-12)
    assert np.isnan(found.mu_macro_low[:, 3:]).all()
    assert (found.source_code[:, 3:] == -1).all()


def test_columns(table):
    frame = pd.DataFrame({**CASE, "k_low": [8e5, 1e6], "k_high": [1.2e6, 2e6]})
    answers = table.evaluate(frame)
    pairs = table.evaluate(k_range=(frame.k_low.to_numpy(), frame.k_high.to_numpy()), **CASE)
    assert answers.mu_macro_low.tolist() == pairs.mu_macro_low.tolist()
    assert answers.mu_macro_high.tolist() == pairs.mu_macro_high.tolist()
    with pytest.raises(InputError, match="k must be left out beside an interval of it"):
        table.evaluate(frame.assign(k=1e6))


@pytest.mark.parametrize(
    ("given", "field"),
    [({"k_range": (2e6, 1e6)}, "k_range"), ({"k_range": 1e6}, "k_range"), ({"k_range": (1e6, 2e6), "k": 1e6}, "k"),
     ({"k_range": (0.0, 1e6)}, "k_range"), ({"k_range": (1e6, math.inf)}, "k_range"), ({"k_low": 1e6}, "k_high"),
     ({"k_range": ("a", 1e6)}, "k_low")],
)  # fmt: skip
def test_refusals(table, given, field):
    with pytest.raises(InputError) as caught:
        table.evaluate(**CASE, **given)
    assert caught.value.field == field

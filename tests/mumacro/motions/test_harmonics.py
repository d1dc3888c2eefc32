"""Samples as harmonics: what is put together is taken apart again, and the motion is the same."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mumacro import InputError, harmonics, motion
from tests.support.cases import Array
from tests.support.comparing import close
from tests.support.refusals import refused

SCENE: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3, "v0": 0.02}
TERMS = [(1, 2e-6, 30.0), (2, 0.4e-6, -120.0), (7, 0.1e-6, 90.0)]


def sampled(terms: list[tuple[int, float, float]], n: int, periods: int = 1) -> Array:
    tau = 2.0 * math.pi * periods * np.arange(n) / n
    parts = (size * np.sin(order * tau + math.radians(phase)) for order, size, phase in terms)
    return np.asarray(sum(parts, np.zeros(n)))


@given(
    orders=st.sets(st.integers(1, 20), min_size=1),
    n=st.integers(41, 400),
    periods=st.integers(1, 5),
    mean=st.floats(-1e3, 1e3),
    seed=st.integers(0, 2**32 - 1),
)
def test_the_terms_of_a_sum_of_sines_are_found_again(
    orders: set[int], n: int, periods: int, mean: float, seed: int
) -> None:
    random = np.random.default_rng(seed)
    terms = [(o, random.uniform(0.1, 2.0), random.uniform(-179.0, 179.0)) for o in sorted(orders)]
    n = max(n, 40 * periods + 1)
    found = harmonics(sampled(terms, n, periods) + mean, periods)
    noise = 1e-13 * (abs(mean) + 2.0 * len(terms))
    assert found.mean == close(mean, abs=noise)
    assert found.rms < noise
    by_order = {order: (size, phase) for order, size, phase in found.terms if size > noise}
    assert by_order.keys() == orders
    for order, size, phase in terms:
        assert by_order[order][0] == close(size, abs=noise)
        assert by_order[order][1] == close(phase, abs=1e3 * noise)


def test_motion_takes_the_terms() -> None:
    found = harmonics(sampled(TERMS, 64))
    assert [order for order, _, _ in found.terms] == [1, 2, 7]
    assert motion(**SCENE, x=found.terms).mu_macro == close(
        motion(**SCENE, x=TERMS).mu_macro, abs=1e-9
    )
    assert harmonics(np.full(50, 7.0)).terms == ()
    assert motion(**SCENE, y=2e-6, normal=harmonics(np.full(50, 7.0)).terms).mu_macro > 0.0


def test_what_is_left_out_is_measured() -> None:
    noise = np.random.default_rng(3).normal(size=20_000)
    tau = 2.0 * math.pi * np.arange(20_000) / 20_000
    found = harmonics(3.0 + np.sin(tau + 0.1) + 0.5 * np.sin(30.0 * tau) + 0.01 * noise)
    assert found.rms == close(math.hypot(0.5 / math.sqrt(2.0), 0.01), rel=1e-3)
    assert found.terms[0] == close((1, 1.0, math.degrees(0.1)), rel=2e-3)


@pytest.mark.parametrize("periods", [1, 3])
def test_a_repeated_end_point_is_left_out_and_noted(periods: int) -> None:
    samples = sampled(TERMS, 60 * periods, periods)
    plain = harmonics(samples, periods, 9)
    assert plain.notes == ()
    closed = harmonics(np.append(samples, samples[0]), periods, 9)
    assert np.array(closed.terms) == close(np.array(plain.terms), rel=1e-12)
    (note,) = closed.notes
    assert "repeats the first" in note.text


def test_a_triangle_from_peak_to_peak_repeats_its_end_point() -> None:
    tau = 2.0 * math.pi * np.arange(101) / 100
    triangle = np.arcsin(np.cos(tau)) / (math.pi / 2.0)
    found = harmonics(triangle, most=3)
    assert found.notes
    assert found.terms[0][2] == close(90.0, rel=1e-12)
    assert np.array(found.terms) == close(
        np.array(harmonics(triangle[:-1], most=3).terms), rel=1e-12
    )


def test_a_symmetric_oscillation_that_begins_as_it_ends_keeps_all_its_samples() -> None:
    tau = 2.0 * math.pi * (np.arange(50) + 0.5) / 50
    found = harmonics(np.cos(tau) + 0.2 * np.cos(2.0 * tau))
    assert found.notes == ()
    assert [size for _, size, _ in found.terms] == close([1.0, 0.2], rel=1e-12)


@pytest.mark.parametrize(
    ("samples", "options", "field", "text"),
    [
        ([0.0, 1.0, math.nan, -1.0] * 20, {}, "samples", "finite"),
        ([0.0, 1.0, None, -1.0] * 20, {}, "samples", "real number"),
        ([0.0, 1.0, math.inf, -1.0] * 20, {}, "samples", "finite"),
        ([1.0, 2.0], {}, "samples", "3 numbers or more"),
        (3.0, {}, "samples", "3 numbers or more"),
        (np.zeros((4, 50)), {}, "samples", "3 numbers or more"),
        ([0.0, 1.0, 0.5, -1.0] * 10, {}, "most", "at most 19 here"),
        ([0.0, 1.0, 0.5, -1.0] * 10, {"periods": 4, "most": 5}, "most", "at most 4 here"),
        ([0.0, 1.0, 0.5], {"periods": 2, "most": 1}, "most", "give more samples"),
        ([0.0, 1.0, 0.5, -1.0] * 10, {"most": 0}, "most", "from 1 to 1000"),
        ([0.0, 1.0, 0.5, -1.0] * 10, {"most": 2.0}, "most", "whole number"),
        ([0.0, 1.0, 0.5, -1.0] * 10, {"periods": 0}, "periods", ">= 1"),
        ([0.0, 1.0, 0.5, -1.0] * 10, {"periods": True}, "periods", ">= 1"),
    ],
)
def test_what_are_no_samples_of_whole_periods_is_told(
    samples: Any, options: dict[str, Any], field: str, text: str
) -> None:
    with refused(f"{field}[*]") as caught:
        harmonics(samples, **options)
    assert text in str(caught.value)


def test_the_largest_harmonic_is_below_half_the_samples() -> None:
    samples = [0.0, 1.0, 0.5, -1.0] * 10
    assert harmonics(samples, most=19).terms
    with refused("most"):
        harmonics(samples, most=20)


def test_samples_at_the_ends_of_double_range_are_numbers_like_others() -> None:
    with np.errstate(all="raise"):
        for scale in (1e308, 1e-290):
            found = harmonics(scale * sampled([(1, 1.0, 30.0)], 50))
            assert found.terms[0] == close((1, scale, 30.0), rel=1e-12)


@pytest.mark.parametrize("name", ["x", "y", "normal"])
def test_samples_that_are_given_as_amplitudes_are_told_the_way_to_harmonics(
    name: str,
) -> None:
    samples = sampled([(1, 2e-6, 0.0)], 8)
    values: list[Any] = [samples, [(2, samples, 0.0)], samples.reshape(2, 4)]
    # at every length; a tuple of two is (amplitude, phase), and may have a negative phase
    for n in range(1, 9):
        short = [2e-6] * (n - 1) + [-1e-6]
        values += [np.array(short), short, *([tuple(short)] if n > 2 else [])]
    for value in values:
        with pytest.raises(InputError, match=r"mumacro\.harmonics") as caught:
            motion(**{**SCENE, name: value})
        assert caught.value.field == f"{name}, amplitude"
    pair: dict[str, Any] = {"y": (2e-6, -90.0)}
    assert motion(**SCENE, **pair).mu_macro > 0.0


def test_a_result_is_text_a_dict_and_a_frame() -> None:
    pytest.importorskip("pandas")
    found = harmonics(np.append(sampled(TERMS, 60), sampled(TERMS, 60)[0]))
    assert len(repr(found).splitlines()) <= 16
    assert "repeats" in repr(found)
    assert "<table>" in found._repr_html_()
    members = found.to_dict()
    assert members["terms"][0].keys() == {"harmonic", "amplitude", "phase"}
    assert motion(**SCENE, x=members["terms"]).mu_macro == motion(**SCENE, x=found.terms).mu_macro
    assert list(found.to_frame().columns) == ["harmonic", "amplitude", "phase"]
    assert repr(harmonics(np.zeros(50))) == "<Harmonics: 0, mean 0, rms left out 0>"

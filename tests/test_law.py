"""The approximations in a law, by equation number: their ranges and values."""

import math

import numpy as np
import pytest

from comparing import close
from mumacro import InputError, closed_forms
from mumacro.contact import kind_of
from mumacro.inputs import FIELDS
from mumacro.law import (
    APPROXIMATIONS,
    BORDERS,
    EQUATIONS,
    approximations,
    border_speeds,
    friction_law,
    sweep_values,
)

UNIT = {"mu0": 0.25, "Fz": 1.0, "k": 4.0, "omega": 3.0}  # l0 = 1/16 m
LENGTH = 0.0625


def columns(surrogate, y, v):
    """Law, approximations and borders (as v~) at the amplitude y~ over v~ = ``v``."""
    case = {**UNIT, "y0": y * LENGTH}
    law = friction_law(surrogate, "v0", np.asarray(v) * LENGTH * 3.0, case)
    borders = border_speeds(surrogate, law)
    return law, approximations(surrogate, law), {name: x / (LENGTH * 3.0) for name, x in borders.items()}


def test_every_equation_number_names_a_column() -> None:
    for number, name in EQUATIONS.items():
        text = {**BORDERS, **APPROXIMATIONS}[name]
        assert f"({number})" in text or name == f"eq_{number}"


@pytest.mark.parametrize("y", [1e-3, 0.1, 0.5, 0.99, 1.0])
def test_formulas_of_continuous_sliding_are_nan_in_stick_slip(surrogate, y) -> None:
    crit = float(surrogate.v_tilde_crit(y))
    law, found, _ = columns(surrogate, y, crit * np.geomspace(1e-6, 1e6, 241))
    sliding = law.answer.regime == "continuous"
    for name in ("small_amplitude", "continuous"):
        assert (np.isfinite(found[name]) == sliding).all()
    # within their ranges they have the stated accuracy
    assert np.nanmax(np.abs(found["continuous"] - law.answer.mu_macro)) < 0.0401 * UNIT["mu0"]
    assert np.nanmax(np.abs(found["small_amplitude"] - law.answer.mu_macro)) <= 0.08 * y**4 * UNIT["mu0"] + 1e-13


def test_the_papers_law_of_small_amplitudes(surrogate) -> None:
    y = 0.4
    law, found, borders = columns(surrogate, y, np.linspace(0.0, 0.2, 201))
    v = np.linspace(0.0, 0.2, 201)
    low, top = math.sqrt(1.0 - y * y), 1.0 - 0.25 * y * y
    crit = 0.47 * y**2.5 / (y * y + 0.94 * y**0.5 / (1.0 + y * y))
    x = v / crit
    printed = low + (top - low) * (1.0 - (0.75 * (x - 1.0) ** 2 + 0.25 * (x - 1.0) ** 4))
    inside = x <= 1.0
    assert found["master_curve"][inside] == close(0.25 * printed[inside], rel=1e-13)
    assert np.isnan(found["master_curve"][~inside]).all()
    assert found["critical"] == close(0.25 * top, rel=1e-15)
    assert found["static"] == close(0.25 * low, rel=1e-15)
    assert borders["eq_27"] == close(crit, rel=1e-13)
    # eq. (39) as it is printed, in metres and seconds
    l0, y0, omega = LENGTH, y * LENGTH, 3.0
    assert borders["eq_24"] * l0 * omega == close(0.5 * omega * (math.sqrt(l0 * l0 + 2.0 * y0 * y0) - l0), rel=1e-13)
    # the limit of the master curve is more accurate, and both agree with the law's ends
    miss = {
        name: np.nanmax(np.abs(found[name] - law.answer.mu_macro)) for name in ("master_curve", "master_curve_limit")
    }
    assert miss["master_curve_limit"] < 0.2 * miss["master_curve"]
    assert miss["master_curve"] < 3e-3 * 0.25


def test_every_formula_is_given_in_its_stated_range(surrogate) -> None:
    for y in (0.3, 1.0, 3.0):
        _, found, borders = columns(surrogate, y, np.geomspace(1e-3, 10.0, 31))
        assert found.keys() == APPROXIMATIONS.keys()
        assert borders.keys() == BORDERS.keys()
        for name in ("master_curve", "master_curve_limit", "critical", "small_amplitude"):
            assert np.isfinite(found[name]).any() == (y <= 1.0)
        for name in ("eq_23", "eq_24", "small_amplitude"):
            assert np.isfinite(borders[name]).all() == (y <= 1.0)
        for name in ("eq_26", "large_amplitude"):
            assert np.isfinite(borders[name]).all() == (y >= 1.0)
        for name in ("exact", "eq_27", "blend"):
            assert np.isfinite(borders[name]).all()


@pytest.mark.parametrize("along", FIELDS)
def test_extreme_inputs_give_numbers_or_nan_and_no_warning(surrogate, along) -> None:
    case = {"mu0": 0.3, "Fz": 1e-200, "k": 1e200, "y0": 1e-300, "omega": 1e150, "v0": 1e-150}
    values = sweep_values(along, 1e-300 if along != "v0" else 0.0, 1e300, 41, "log" if along != "v0" else "linear")
    others = {name: value for name, value in case.items() if name != along}
    law = friction_law(surrogate, along, values, others)
    for column in (*approximations(surrogate, law).values(), *border_speeds(surrogate, law).values()):
        assert column.shape == values.shape
    top = law.values if along == "mu0" else 0.3
    assert (law.answer.mu_macro <= top).all()


def test_rigid_contact_is_given_as_none_or_infinity(surrogate) -> None:
    values = sweep_values("v0", 1e-3, 10.0, 5, "log")
    r = 2e-6 * 1.3e5 / values
    for stiffness in (None, math.inf):
        case = {"mu0": 0.3, "Fz": 10.0, "k": stiffness, "y0": 2e-6, "omega": 1.3e5}
        law = friction_law(surrogate, "v0", values, case)
        assert (border_speeds(surrogate, law)["exact"] == 0.0).all()
        assert approximations(surrogate, law)["rigid"] == close(0.3 * closed_forms.outer(r), rel=1e-14)


# --- any contact and direction ------------------------------------------------------------------------

LINE = {"mu0": 0.3, "Fz": 10.0, "omega": 1.3e5, "y0": 4e-6}
PAIRS = [("spring", "across"), ("ball", "across"), ("spring", "along"), ("ball", "along"), ("spring", "normal")]
every_pair = pytest.mark.parametrize("pair", PAIRS, ids=" ".join)
SPEEDS = sweep_values("v0", 1e-4, 2.0, 25, "log")


def as_kind(pair, **more):
    kind = kind_of(*pair)
    return kind.names, {**kind.as_given({**LINE, "y0": 7.0} if kind.normal else LINE), **more}


@every_pair
@pytest.mark.parametrize("interval", [{"k_range": (0.8e6, 1.2e6)}, {"k_low": 0.8e6, "k_high": 1.2e6}])
def test_the_band_holds_every_stiffness_of_its_interval(surrogate, pair, interval) -> None:
    said, case = as_kind(pair, **interval)
    law = friction_law(surrogate, "v0", SPEEDS, case, **said)
    low, high = law.band
    assert law.case["k"] == close(math.sqrt(0.8e6 * 1.2e6), rel=1e-15)
    assert ((low <= law.answer.mu_macro) & (law.answer.mu_macro <= high)).all()
    single = {name: value for name, value in case.items() if name not in interval}
    inside = [surrogate.evaluate(**single, **said, k=k, v0=SPEEDS).mu_macro for k in np.geomspace(0.8e6, 1.2e6, 33)]
    slack = 2.0 * law.answer.error_bound
    assert (np.min(inside, axis=0) >= low - slack).all()
    assert (np.max(inside, axis=0) <= high + slack).all()
    # the true band: both ends are reached
    assert low == close(np.min(inside, axis=0), rel=1e-4, abs=1e-12)
    assert high == close(np.max(inside, axis=0), rel=1e-4, abs=1e-12)
    assert [*law.columns] == [
        "v0", "mu_macro", "mu_macro_low", "mu_macro_high", "regime", "error_bound", "source", "mu_static"
    ]  # fmt: skip
    middle = friction_law(surrogate, "v0", SPEEDS, {**single, "k": law.case["k"]}, **said)
    assert middle.band is None
    assert "mu_macro_low" not in middle.columns
    assert middle.border == law.border
    assert middle.answer.mu_macro == close(law.answer.mu_macro, rel=1e-14)


def test_k_range_is_a_keyword_too(surrogate) -> None:
    one, other = (
        friction_law(surrogate, "v0", SPEEDS, LINE, k_range=(0.8e6, 1.2e6)),
        friction_law(surrogate, "v0", SPEEDS, {**LINE, "k_range": (0.8e6, 1.2e6)}),
    )
    assert all((a == b).all() for a, b in zip(one.band, other.band, strict=True))
    approximate = approximations(surrogate, one)
    assert approximate["static"] == close(one.mu_static, rel=1e-14)


@every_pair
@pytest.mark.parametrize("scale", ["log", "linear"])
def test_a_refined_law_is_straight_between_its_values(surrogate, pair, scale) -> None:
    said, case = as_kind(pair, k=1e6)
    values = sweep_values("v0", 1e-4, 2.0, 25, scale)
    law = friction_law(surrogate, "v0", values, case, **said, refine=True)
    assert set(values) <= set(law.values)
    assert {mark.value for mark in law.border} <= set(law.values)
    assert (np.diff(law.values) > 0.0).all()
    middle = np.sqrt(law.values[1:] * law.values[:-1])
    mu = law.answer.mu_macro
    off = np.abs(surrogate.evaluate(**case, **said, v0=middle).mu_macro - 0.5 * (mu[1:] + mu[:-1]))
    assert off.max() <= 1.1e-3 * np.ptp(mu)
    plain = friction_law(surrogate, "v0", values, case, **said)
    assert (plain.values == values).all()
    assert law.values.size < 150


@pytest.mark.parametrize("pair", PAIRS[1:], ids=" ".join)
def test_the_articles_formulas_are_refused_for_another_contact(surrogate, pair) -> None:
    said, case = as_kind(pair, k=1e6)
    law = friction_law(surrogate, "v0", SPEEDS, case, **said)
    for formulas in (approximations, border_speeds):
        with pytest.raises(InputError, match="they are those of one spring, across"):
            formulas(surrogate, law)


@pytest.mark.parametrize(
    ("changed", "said"),
    [({"k": 1e6, "k_range": (1e6, 2e6)}, "k must be left out beside"), ({"k_range": (2e6, 1e6)}, "k_range must be"),
     ({"k_low": 1e6}, "k_high must be given"), ({"k": 1e6, "Fz_amplitude": 1.0}, "Fz_amplitude must be left out")],
)  # fmt: skip
def test_a_bad_interval_or_amplitude_is_named(surrogate, changed, said) -> None:
    with pytest.raises(InputError, match=said):
        friction_law(surrogate, "v0", SPEEDS, {**LINE, **changed})


def test_an_interval_of_the_swept_input_is_refused(surrogate) -> None:
    with pytest.raises(InputError, match="k_range must be left out where k is the swept input"):
        friction_law(surrogate, "k", np.array([1e5, 1e6]), {**LINE, "v0": 0.01, "k_range": (1e6, 2e6)})
    case = {"mu0": 0.3, "Fz": 10.0, "omega": 1e5, "k": 1e6, "v0": 0.01}
    with pytest.raises(InputError, match="Fz_amplitude at index 1 must be >= 0 and below Fz"):
        friction_law(surrogate, "Fz_amplitude", np.array([1.0, 10.0]), case, direction="normal")


@every_pair
def test_the_picture_shows_band_and_borders(surrogate, pair) -> None:
    pytest.importorskip("matplotlib").use("Agg")
    said, case = as_kind(pair, k_range=(0.8e6, 1.2e6))
    law = friction_law(surrogate, "v0", SPEEDS, case, **said, refine=True)
    axes = law.plot()
    (band,) = axes.collections
    corners = band.get_paths()[0].vertices
    for x, low, high in zip(law.values, *law.band, strict=True):
        drawn = corners[corners[:, 0] == x, 1]
        assert low in drawn
        assert high in drawn
    upright = [line.get_xdata()[0] for line in axes.lines if len({*line.get_xdata()}) == 1]
    assert upright == [mark.value for mark in law.border]
    told = axes.get_legend_handles_labels()[1]
    assert len(told) == len(set(told)) == 3 + len(law.border)
    other = friction_law(
        surrogate, "Fz_amplitude", np.array([1.0, 9.0]), {**LINE, "k": 1e6, "v0": 0.01, "y0": None}, direction="normal"
    )
    assert other.plot().get_xlabel().endswith("[N]")

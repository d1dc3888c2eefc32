"""The friction law over a range of one input; its approximations by equation number, their ranges
and values."""

import math
from typing import Any

import numpy as np
import pytest

from builder.approximations import (
    APPROXIMATIONS,
    BORDERS,
    approximations,
    border_speeds,
)
from mumacro import Surrogate, closed_forms, plotting
from mumacro.inputs.fields import FIELDS, kind_of
from mumacro.questions.law import law as friction_law
from tests.support.cases import CASE, PAIRS, Case, as_kind, every_pair, without
from tests.support.comparing import close, title_of
from tests.support.refusals import refused

INTERVAL: Case = {"k_low": 0.8e6, "k_high": 1.2e6}
LINE = without({**CASE, "y0": 4e-6}, "v0")
SPEEDS = np.geomspace(1e-4, 2.0, 25)


def law_of(
    surrogate: Surrogate, pair: Any, change: Any = (), values: Any = SPEEDS, **options: Any
) -> Any:
    """A law over v0, the keywords of its kind, and its other inputs."""
    words, _, case = as_kind(LINE, pair, 0.7)
    case = {**without(case, *("k" for name in change if name.startswith("k_"))), **dict(change)}
    return friction_law(surrogate, values=values, **case, **words, **options), words, case


# --- the range ------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", ["log", "linear"])
def test_a_law_goes_from_start_to_stop_in_even_steps(surrogate: Surrogate, scale: Any) -> None:
    def axis(start: float, stop: float, points: int) -> Any:
        ends = {"start": start, "stop": stop, "points": points, "scale": scale}
        return friction_law(surrogate, **ends, **LINE).values

    values = axis(1e-7, 0.3, 101)
    assert (values[0], values[-1], values.size) == (1e-7, 0.3, 101)
    steps = np.diff(np.log(values) if scale == "log" else values)
    assert steps == close(steps[0], rel=1e-9)
    assert np.all(np.diff(axis(1.0, math.nextafter(1.0, 2.0), 9)) >= 0.0)
    if scale == "log":
        assert axis(1e-4, 10.0, 6).tolist() == [1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0]
    law = friction_law(surrogate, start=1e-3, stop=1.0, points=7, scale=scale, **LINE)
    expected = friction_law(surrogate, values=law.values, **LINE).answer.mu_macro
    assert law.answer.mu_macro.tolist() == expected.tolist()


@pytest.mark.parametrize(
    ("field", "options"),
    [
        ("scale", {"start": 1.0, "stop": 2.0, "scale": "cubic"}),
        ("points", {"start": 1.0, "stop": 2.0, "points": 1}),
        ("points", {"start": 1.0, "stop": 2.0, "points": 2.5}),
        ("start", {"start": 0.0, "stop": 2.0}),
        ("start", {"start": math.nan, "stop": 1.0}),
        ("start", {"start": "slow", "stop": 1.0}),
        ("start", {"stop": 1.0}),
        ("stop", {"start": 1.0}),
        ("stop", {"start": 2.0, "stop": 2.0}),
        ("stop", {"start": 1.0, "stop": math.inf}),
        ("stop", {"start": 1.0, "stop": [2.0, 3.0]}),
        ("values", {"values": [1.0, 2.0], "start": 1.0}),
        ("values", {"values": [2.0, 1.0]}),
        ("values", {"values": 1.0}),
        ("values", {"values": []}),
        ("values", {"values": ["slow"]}),
    ],
)
def test_a_range_that_is_no_range_names_its_field(
    surrogate: Surrogate, field: str, options: Any
) -> None:
    with refused(field):
        friction_law(surrogate, **options, **LINE)


# --- any contact and direction --------------------------------------------------------------------


@every_pair
@pytest.mark.parametrize("place", range(6))
def test_a_law_is_the_surrogate_along_a_line(surrogate: Surrogate, pair: Any, place: Any) -> None:
    words, fields, case = as_kind(CASE, pair, 0.009)
    along = fields[place]
    values = case[along] * np.geomspace(0.01, 100.0, 41)
    law = friction_law(surrogate, along, values=values, **without(case, along), **words)
    assert law.kind.names == words
    moving, still = (
        surrogate.evaluate(**{**case, along: values, **v0}, **words)
        for v0 in ({}, {"v0": np.zeros(41)})
    )
    assert law.answer.mu_macro == close(moving.mu_macro, rel=1e-15)
    assert law.mu_static == close(still.mu_macro, rel=1e-9, abs=1e-15)
    assert np.count_nonzero(law.answer.regime[1:] != law.answer.regime[:-1]) == len(law.border)
    for name in ("mu_macro", "mu_ratio", "error_bound", "source_code"):
        np.testing.assert_array_equal(getattr(moving, name), getattr(law.answer, name))


@every_pair
@pytest.mark.parametrize(
    "interval", [INTERVAL, {"k_low": 0.8e6, "k_high": 1.2e6}], ids=["range", "ends"]
)
def test_the_band_holds_every_stiffness_of_its_interval(
    surrogate: Surrogate, pair: Any, interval: Any
) -> None:
    law, words, case = law_of(surrogate, pair, interval)
    low, high = law.band
    assert law.case["k"] == close(math.sqrt(0.8e6 * 1.2e6), rel=1e-15)
    assert ((low <= law.answer.mu_macro) & (law.answer.mu_macro <= high)).all()
    single = without(case, *interval)
    inside = [
        surrogate.evaluate(**single, **words, k=k, v0=SPEEDS).mu_macro
        for k in np.geomspace(0.8e6, 1.2e6, 33)
    ]
    slack = 2.0 * law.answer.error_bound
    for end, reached, sign in (
        (low, np.min(inside, axis=0), 1.0),
        (high, np.max(inside, axis=0), -1.0),
    ):
        assert (sign * (reached - end) >= -slack).all()
        assert end == close(reached, rel=1e-4, abs=1e-12)  # the true band: both ends are reached
    assert [*law.columns] == [
        "v0",
        "mu_macro",
        "mu_macro_low",
        "mu_macro_high",
        "regime",
        "error_bound",
        "source",
        "mu_static",
    ]
    middle, _, _ = law_of(surrogate, pair, {"k": law.case["k"]})
    assert middle.band is None
    assert "mu_macro_low" not in middle.columns
    assert middle.border == law.border
    assert middle.answer.mu_macro == close(law.answer.mu_macro, rel=1e-14)


@pytest.mark.parametrize("pair", PAIRS[1:], ids=" ".join)
def test_the_articles_formulas_are_of_one_spring_across(surrogate: Surrogate, pair: Any) -> None:
    for formulas in (approximations, border_speeds):
        with refused("approximations"):
            formulas(surrogate, law_of(surrogate, pair)[0])


@pytest.mark.parametrize(
    ("along", "case", "direction", "place"),
    [
        ("v0", {**LINE, **INTERVAL}, "across", "k"),
        ("v0", {**without(LINE, "k"), "k_low": 2e6, "k_high": 1e6}, "across", "k_low"),
        ("v0", {**without(LINE, "k"), "k_low": 1e6}, "across", "k_high"),
        ("v0", {**without(LINE, "k"), "k_low": "1 ± 0.1 N/um", "k_high": 2e6}, "across", "k_low"),
        ("v0", {**without(LINE, "k"), "k_low": [1e6, 1e6], "k_high": 2e6}, "across", "k_low"),
        ("v0", {**LINE, "step": 9}, "across", "step"),
        ("v0", {**LINE, "std_v0": 1e-3}, "across", "std_v0"),
        ("f", {**without(CASE, "omega"), "std_omega": 1.0}, "across", "std_omega"),
        ("v0", {**LINE, "k": "1 ± 0.1 N/um", "std_k": 1.0}, "across", "std_k"),
        ("v0", {**LINE, "Fz_amplitude": 1.0}, "across", "Fz_amplitude"),
        (
            "k",
            {**without(LINE, "k"), "v0": 0.01, **INTERVAL},
            "across",
            "k_low",
        ),
        (
            "Fz_amplitude",
            without(CASE, "y0"),
            "normal",
            "Fz_amplitude[1]",
        ),
    ],
)
def test_a_bad_interval_is_named(
    surrogate: Surrogate, along: Any, case: Case, direction: Any, place: str
) -> None:
    with refused(place):
        friction_law(surrogate, along, values=[1.0, 10.0], **case, direction=direction)


def test_the_ends_of_an_interval_may_stand_in_lists_of_one(surrogate: Surrogate) -> None:
    case = {**without(LINE, "k"), "k_low": [1e6], "k_high": [2e6]}
    assert friction_law(surrogate, values=SPEEDS, **case).k_ends == (1e6, 2e6)


@pytest.mark.parametrize(
    "uncertain",
    [{"k": "1 ± 0.1 N/um"}, {"k": 1e6, "std_k": 1e5}, {"k": 1e6, "mu0": "0.3 ± 0.02"}],
)
def test_a_deviation_is_that_of_each_case(surrogate: Surrogate, uncertain: Any) -> None:
    case = {**without(LINE, "k"), **uncertain}
    law: Any = friction_law(surrogate, values=SPEEDS, **case)
    each = surrogate.evaluate(**case, v0=law.values)
    assert law.std == close(each["std"], rel=1e-12)
    low, high = law.band
    assert (low < law.answer.mu_macro).all()
    assert (law.answer.mu_macro < high).all()
    assert [*law.columns][:5] == ["v0", "mu_macro", "std", "mu_macro_low", "mu_macro_high"]
    exact = friction_law(surrogate, values=SPEEDS, **{**LINE, "k": 1e6, "mu0": 0.3})
    assert law.answer.mu_macro.tolist() == exact.answer.mu_macro.tolist()
    assert exact.std is None
    assert exact.band is None
    assert law.to_dict()["std"] == law.columns["std"].tolist()


@every_pair
def test_the_band_of_one_deviation_is_between_what_friction_is_there(
    surrogate: Surrogate, pair: Any
) -> None:
    law, words, case = law_of(surrogate, pair, {"k": "1.5 ± 0.6 N/um"})
    ends = [
        surrogate.evaluate(**{**without(case, "k"), "k": k}, **words, v0=law.values).mu_macro
        for k in (0.9e6, 1.5e6, 2.1e6)
    ]
    low, high = law.band
    assert low == close(np.min(ends, axis=0), rel=1e-12, abs=1e-15)
    assert high == close(np.max(ends, axis=0), rel=1e-12)
    assert (high <= case["mu0"] * (1.0 + 1e-12)).all()


def test_small_deviations_make_a_band_of_twice_their_deviation(surrogate: Surrogate) -> None:
    law: Any = friction_law(surrogate, values=SPEEDS, **LINE, std_k=30.0, std_y0=1e-10, std_Fz=1e-4)
    assert law.band[1] - law.band[0] == close(2.0 * law.std, rel=1e-3)


def test_the_band_ends_where_an_input_cannot_go_further(surrogate: Surrogate) -> None:
    case = {**LINE, "k": 1e6}
    soft: Any = friction_law(
        surrogate, values=SPEEDS, **case, std_k=3e6
    )  # down to no stiffness at all
    assert soft.band[1] == close(np.full(SPEEDS.size, case["mu0"]), rel=1e-12)
    assert (soft.band[0] >= 0.0).all()
    load = {**without(case, "y0"), "Fz_amplitude": 9.0, "direction": "normal"}
    lifting: Any = friction_law(surrogate, values=SPEEDS, **load, std_Fz_amplitude=2.0)
    assert np.isfinite(lifting.band).all()  # 11 N of 10 N: the contact lifts off
    slope = surrogate.evaluate(**load, v0=SPEEDS, gradient=True).gradient["Fz_amplitude"]
    least = np.maximum(lifting.answer.mu_macro + 2.0 * slope, 0.0)
    assert lifting.band[0] == close(least, rel=1e-9, abs=1e-12)


def test_the_deviation_of_k_grows_with_k(surrogate: Surrogate) -> None:
    case = {**without(LINE, "k", "Fz"), "v0": 0.01, "contact": "ball"}
    loads = [1.0, 10.0, 1e3]
    law: Any = friction_law(surrogate, "Fz", values=loads, Fz=10.0, k="1 ± 0.1 N/um", **case)
    k = law.columns["k"]
    each = surrogate.evaluate(**case, Fz=law.values, k=k, std_k=0.1 * k)
    assert law.std == close(each["std"], rel=1e-9)


@every_pair
def test_the_picture_shows_band_and_borders(surrogate: Surrogate, pair: Any) -> None:
    pytest.importorskip("matplotlib").use("Agg")
    law, _, _ = law_of(surrogate, pair, INTERVAL)
    axes = law.plot()
    k_title = plotting.case_title({"k": law.k_ends})
    assert (" to " in k_title, k_title in title_of(axes)) == (True, True)
    (band,) = axes.collections
    corners = band.get_paths()[0].vertices
    for x, *ends in zip(law.values, *law.band, strict=True):
        assert {*ends} <= {*corners[corners[:, 0] == x, 1]}
    upright = [line.get_xdata()[0] for line in axes.lines if len({*line.get_xdata()}) == 1]
    assert upright == [mark.value for mark in law.border]
    labels = axes.get_legend_handles_labels()[1]
    assert len(labels) == len(set(labels)) == 3 + len(law.border)
    amplitudes = np.array([1.0, 9.0])
    other = friction_law(
        surrogate, "Fz_amplitude", values=amplitudes, **without(CASE, "y0"), direction="normal"
    )
    assert other.plot().get_xlabel().endswith("[N]")


# --- the approximations of one spring -------------------------------------------------------------

CONTACT: Case = {"mu0": 0.25, "Fz": 1.0, "k": 4.0, "omega": 3.0}  # l0 = 1/16 m
LENGTH = 0.0625


def columns(surrogate: Surrogate, y: Any, v: Any) -> Any:
    """Law, approximations over mu0 and borders as v~ at the amplitude y~ over v~ = ``v``."""
    law = friction_law(
        surrogate, values=np.asarray(v) * LENGTH * 3.0, **{**CONTACT, "y0": y * LENGTH}
    )
    borders = border_speeds(surrogate, law)
    result = {name: x / 0.25 for name, x in approximations(surrogate, law).items()}
    assert (list(result), list(borders)) == (list(APPROXIMATIONS), list(BORDERS))
    return law, result, {name: x / (LENGTH * 3.0) for name, x in borders.items()}


@pytest.mark.parametrize(
    ("name", "y", "ends", "off"),
    # what they leave out is of the order y~^4, v~^(3/2) beside creep, 1/v~^2 at large speed, mu~^3
    # in the corner
    [
        ("static", 0.5, (1e-12, 1e-9), 1e-8),
        ("small_amplitude", 0.01, (1e-3, 1e3), 1e-8),
        ("creep", 0.5, (1e-12, 1e-6), 1e-8),
        ("creep", 2.0, (1e-12, 1e-6), 1e-8),
        ("continuous", 0.01, (1e-3, 1e3), 1e-8),
        ("continuous", 1.0, (1e3, 1e6), 1e-6),
        ("rigid", 1.0, (1e3, 1e6), 1e-6),
        ("corner", 1.0, (1e-12, 1e-9), 1e-8),
    ],
)
def test_approximations_hold_where_they_should(
    surrogate: Surrogate, name: str, y: Any, ends: Any, off: Any
) -> None:
    law, result, _ = columns(surrogate, y, np.geomspace(ends[0], ends[1], 31))
    assert np.max(np.abs(result[name] - law.answer.mu_ratio)) < off


@pytest.mark.parametrize("y", [1e-3, 0.3, 0.45, 0.55, 0.999, 1.0, 1.45, 1.55, 3.0])
def test_every_formula_is_given_in_its_stated_range_and_nowhere_else(
    surrogate: Surrogate, y: Any
) -> None:
    crit = float(surrogate.v_tilde_crit(y))
    v = np.unique(
        np.concatenate([crit * np.geomspace(1e-6, 1e6, 241), np.geomspace(1e-4, 0.99, 200)])
    )
    law, result, borders = columns(surrogate, y, v)
    sliding, low = law.answer.regime == "continuous", y <= 1.0
    with np.errstate(over="ignore"):
        corner = (abs(y - 1.0) <= 0.5) & (v < 1.0) & (closed_forms.corner_root(v, y - 1.0) <= 0.7)
    inputs = {
        "static": True,
        "rigid": True,
        "continuous": sliding,
        "small_amplitude": sliding & low,
        "critical": low,
        "master_curve": low & (v <= closed_forms.border_27(y)),
        "master_curve_limit": low & (v <= crit),
        "corner": corner,
        "creep": np.isfinite(result["creep"]) & (result["creep"] <= 1.0) if y != 1.0 else False,
    }
    for name, where in inputs.items():
        near = np.abs(v / crit - 1.0) < 1e-9
        assert ((np.isfinite(result[name]) == where) | near).all(), name
    assert not corner.all()
    for name, where in {
        "eq_23": low,
        "eq_24": low,
        "small_amplitude": low,
        "eq_26": y >= 1.0,
        "large_amplitude": y >= 1.0,
        "exact": True,
        "eq_27": True,
        "blend": True,
    }.items():
        assert np.isfinite(borders[name]).all() == where, name
    # within their ranges they have the stated accuracy
    assert np.nanmax(np.abs(result["continuous"] - law.answer.mu_ratio)) < 0.0401
    if low:
        assert (
            np.nanmax(np.abs(result["small_amplitude"] - law.answer.mu_ratio))
            <= 0.08 * y**4 + 4e-13
        )


def test_the_papers_law_of_small_amplitudes(surrogate: Surrogate) -> None:
    y, v = 0.4, np.linspace(0.0, 0.2, 201)
    _, result, borders = columns(surrogate, y, v)
    low, top = math.sqrt(1.0 - y * y), 1.0 - 0.25 * y * y
    crit = 0.47 * y**2.5 / (y * y + 0.94 * y**0.5 / (1.0 + y * y))
    x = v / crit
    printed = low + (top - low) * (1.0 - (0.75 * (x - 1.0) ** 2 + 0.25 * (x - 1.0) ** 4))
    assert result["master_curve"][x <= 1.0] == close(printed[x <= 1.0], rel=1e-13)
    assert result["critical"] == close(top, rel=1e-15)
    assert result["static"] == close(low, rel=1e-15)
    assert borders["eq_27"] == close(crit, rel=1e-13)
    # eq. (39) as it is printed, in metres and seconds
    printed = 0.5 * 3.0 * (math.sqrt(LENGTH**2 + 2.0 * (y * LENGTH) ** 2) - LENGTH)
    assert borders["eq_24"] * LENGTH * 3.0 == close(printed, rel=1e-13)


@pytest.mark.parametrize("along", FIELDS)
def test_the_border_of_every_case_is_where_the_law_crosses_it(
    surrogate: Surrogate, along: Any
) -> None:
    values = CASE[along] * np.geomspace(0.1, 10.0, 31)
    law = friction_law(surrogate, along, values=values, **without(CASE, along))
    speeds = border_speeds(surrogate, law)
    v0 = values if along == "v0" else CASE["v0"]
    assert ((v0 >= speeds["exact"]) == (law.answer.regime == "continuous")).all()
    assert speeds["blend"] == close(speeds["exact"], rel=0.006)
    meant = ~np.isnan(speeds["small_amplitude"])
    assert (meant == (law.answer.y_tilde <= 1.0)).all()
    assert speeds["small_amplitude"][meant] == close(speeds["exact"][meant], rel=0.11)


@pytest.mark.parametrize("along", FIELDS)
def test_extreme_inputs_give_numbers_or_nan_and_no_warning(
    surrogate: Surrogate, along: Any
) -> None:
    case: Case = {"mu0": 0.3, "Fz": 1e-200, "k": 1e200, "y0": 1e-300, "omega": 1e150, "v0": 1e-150}
    values = np.linspace(0.0, 1e300, 41) if along == "v0" else np.geomspace(1e-300, 1e300, 41)
    law = friction_law(surrogate, along, values=values, **without(case, along))
    for column in (
        *approximations(surrogate, law).values(),
        *border_speeds(surrogate, law).values(),
    ):
        assert column.shape == values.shape
    assert (law.answer.mu_macro <= (law.values if along == "mu0" else 0.3)).all()


@pytest.mark.parametrize("contact", ["spring", "ball"])
def test_a_rigid_contact_along_has_its_border_at_the_peak_speed(
    surrogate: Surrogate, contact: str
) -> None:
    case = {**without(CASE, "v0"), "k": "rigid", "direction": "along", "contact": contact}
    peak = CASE["y0"] * CASE["omega"]
    [mark] = friction_law(surrogate, values=[0.5 * peak, 2.0 * peak], **case).border
    assert mark.value == close(peak, rel=1e-15)
    assert mark.mu_macro == CASE["mu0"]
    assert mark.regimes == ("reverse_slip", "continuous")


def test_what_never_sticks_has_no_border_and_rigid_contact_its_own_law(
    surrogate: Surrogate,
) -> None:
    values = np.geomspace(1e-3, 10.0, 5)
    for changed in ({"k": "rigid"}, {"k": math.inf}, {"y0": 0.0}, {"omega": 0.0}):
        law = friction_law(surrogate, values=values, **{**without(CASE, "v0"), **changed})
        assert all((column == 0.0).all() for column in border_speeds(surrogate, law).values())
        approximate = approximations(surrogate, law)
        if "k" in changed:
            assert approximate["rigid"] == close(
                0.3 * closed_forms.outer(2e-6 * 1.3e5 / values), rel=1e-14
            )
            assert all(
                np.isnan(approximate[name]).all()
                for name in ("creep", "continuous", "corner", "small_amplitude")
            )
        assert (law.mu_static == (0.0 if "k" in changed else 0.3)).all()


def test_the_static_column_of_a_band_is_that_of_its_middle(surrogate: Surrogate) -> None:
    law, _, _ = law_of(surrogate, PAIRS[0], INTERVAL)
    assert law.kind == kind_of()
    assert approximations(surrogate, law)["static"] == close(law.mu_static, rel=1e-14)

"""The inverse problem and the friction law: roots against the forward answer, folds, reach, border, approximations."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from comparing import close
from mumacro import InputError
from mumacro.contact import kind_of
from mumacro.inputs import FIELDS
from mumacro.inverse import border_crossings, solve_for
from mumacro.law import APPROXIMATIONS, BORDERS, approximations, border_speeds, friction_law, sweep_values

CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}


def others(case, name):
    return {field: value for field, value in case.items() if field != name}


#: every contact with every direction that it has
PAIRS = [("spring", "across"), ("ball", "across"), ("spring", "along"), ("ball", "along"), ("spring", "normal")]
every_pair = pytest.mark.parametrize("pair", PAIRS, ids=" ".join)


def as_kind(case, pair, share=0.4):
    """The keywords of a pair, its fields, and ``case`` with Fz_amplitude = ``share`` Fz where the pair has it."""
    kind = kind_of(*pair)
    return kind.names, kind.fields, kind.as_given({**case, "y0": share * case["Fz"]} if kind.normal else case)


def only_root(solution):
    ((root,),) = solution.roots
    return root


def decade(low, high):
    return st.floats(low, high).map(lambda x: 10.0**x)


cases = st.fixed_dictionaries(
    {"mu0": decade(-2, 0), "Fz": decade(-3, 4), "k": decade(3, 9), "y0": decade(-9, -3), "omega": decade(0, 7),
     "v0": decade(-6, 2)}
)  # fmt: skip


@every_pair
@settings(max_examples=60, deadline=None)
@given(case=cases, share=st.floats(0.001, 0.999), place=st.integers(0, 5))
def test_the_forward_answer_is_inverted(surrogate, pair, case, share, place):
    said, fields, case = as_kind(case, pair, share)
    unknown = fields[place]
    forward = surrogate.evaluate(**case, **said)
    solution = solve_for(surrogate, unknown, forward.mu_macro, others(case, unknown), **said)
    if solution.constant or not solution.roots[0]:
        # within the surrogate's error the input has no influence here, or its end equals the limit
        edge = min(abs(forward.mu_macro - solution.reach.mu_min), abs(forward.mu_macro - solution.reach.mu_max))
        assert edge <= 4.0 * forward.error_bound + 1e-9 * case["mu0"]
        return
    for root in solution.roots[0]:
        there = surrogate.evaluate(**{**case, unknown: root.value, **said})
        assert there.mu_macro == root.mu_macro
        assert root.mu_macro == close(forward.mu_macro, rel=1e-9, abs=2.0 * forward.error_bound)
        assert root.low <= root.value <= root.high
    value = min(max(case[unknown], solution.reach.low), solution.reach.high)
    assert any(root.low <= value <= root.high for root in solution.roots[0])


def test_a_root_is_enclosed_to_the_tables_error(surrogate):
    answer = surrogate.evaluate(**CASE, gradient=True)
    root = only_root(solve_for(surrogate, "v0", answer.mu_macro, others(CASE, "v0")))
    width = answer.error_bound / answer.gradient["v0"]
    assert root.high - 0.01 == close(width, rel=0.05)
    assert 0.01 - root.low == close(width, rel=0.05)


def test_an_enclosure_on_a_plateau_spans_it(surrogate):
    # y~ = 1, v~ = 1e5: mu~ = 1 - r^2/4 to the last digit, for any stiffness from a hundredth of this one on
    case = {"mu0": 1.0, "Fz": 0.01, "k": 1000.0, "y0": 1e-5, "omega": 1.0, "v0": 1.0}
    root = only_root(solve_for(surrogate, "k", surrogate.evaluate(**case).mu_macro, others(case, "k")))
    assert root.low < 10.0
    assert root.high > 1e9


def test_targets_are_solved_together_as_alone(surrogate):
    targets = np.linspace(0.23, 0.299, 57)
    together = solve_for(surrogate, "v0", targets, others(CASE, "v0"))
    values = [roots[0].value for roots in together.roots]
    assert values == sorted(values)
    for target, value in zip(targets, values, strict=True):
        assert only_root(solve_for(surrogate, "v0", target, others(CASE, "v0"))).value == close(value, rel=1e-9)


@pytest.mark.parametrize(
    ("unknown", "low", "high"),
    [("v0", 0.3 * math.sqrt(5.0) / 3.0, 0.3), ("y0", 0.0, 0.3), ("omega", 0.3 * math.sqrt(5.0) / 3.0, 0.3)],
)
def test_a_monotone_unknown_reports_its_reach(surrogate, unknown, low, high):
    targets = [0.999 * low, low + 0.5 * (high - low), 1.001 * high]
    solution = solve_for(surrogate, unknown, targets, others(CASE, unknown))
    assert [len(roots) for roots in solution.roots] == [0, 1, 0]
    assert solution.reach.mu_min == close(low, abs=1e-10)
    assert solution.reach.mu_max == high


def test_an_end_that_is_attained_is_a_root(surrogate):
    static = surrogate.evaluate(**{**CASE, "v0": 0.0}).mu_macro
    assert only_root(solve_for(surrogate, "v0", static, others(CASE, "v0"))).value == 0.0
    for unknown in ("y0", "omega"):
        assert only_root(solve_for(surrogate, unknown, 0.3, others(CASE, unknown))).value == 0.0
    # at rest friction vanishes from y0 = l0 on
    root = only_root(solve_for(surrogate, "y0", 0.0, {**others(CASE, "y0"), "v0": 0.0}))
    assert root.value == close(3e-6, rel=1e-12)


def test_an_end_that_is_only_approached_is_none(surrogate):
    for unknown, end in (("v0", 0.3), ("y0", 0.0)):
        solution = solve_for(surrogate, unknown, end, others(CASE, unknown))
        assert solution.roots == ((),)
        assert not solution.reach.holds(end)


@pytest.mark.parametrize("unknown", ["k", "Fz"])
def test_a_fold_has_three_roots(surrogate, unknown):
    case = {**CASE, "v0": 1e-4}  # r = 2600
    kappa = np.geomspace(1e-6, 1e10, 40_001)  # y~
    ratio = surrogate.mu_ratio(kappa / 2600.0, kappa)
    falling = np.diff(ratio) < 0.0
    (turns,) = np.nonzero(falling[1:] != falling[:-1])
    assert turns.size == 2  # a minimum, then a maximum, then down to rigid contact
    low, high = ratio[turns + 1]
    last = ratio[-1]
    for share, expected in ((-0.01, 2), (0.5, 3), (1.01, 1)):
        target = 0.3 * (last + share * (high - last))
        roots = solve_for(surrogate, unknown, target, others(case, unknown)).roots[0]
        assert len(roots) == expected
        assert [root.value for root in roots] == sorted(root.value for root in roots)
        for root in roots:
            assert root.mu_macro == close(target, rel=1e-12)
    below = solve_for(surrogate, unknown, 0.3 * 0.99 * low, others(case, unknown))
    assert below.roots == ((),)
    assert below.reach.mu_min == close(0.3 * low, rel=1e-6)


def test_a_range_keeps_its_roots_only(surrogate):
    case = others({**CASE, "v0": 1e-4}, "k")
    target = 0.3 * 0.0023
    every = solve_for(surrogate, "k", target, case)
    assert len(every.roots[0]) == 3
    first, second, third = (root.value for root in every.roots[0])
    middle = solve_for(surrogate, "k", target, case, within=(math.sqrt(first * second), math.sqrt(second * third)))
    assert only_root(middle).value == close(second, rel=1e-9)
    half = solve_for(surrogate, "v0", 0.25, others(CASE, "v0"), within=(0.0, 1e-3))
    assert half.roots == ((),)
    assert half.reach.max_included
    assert half.reach.mu_max == surrogate.evaluate(**{**CASE, "v0": 1e-3}).mu_macro


def test_friction_coefficients_are_found_far_out(surrogate):
    for target in (1e-9, 0.1, 1e7):
        root = only_root(solve_for(surrogate, "mu0", target, others(CASE, "mu0")))
        assert root.mu_macro == close(target, rel=1e-12)


@pytest.mark.parametrize(
    ("unknown", "changed"),
    [("v0", {"y0": 0.0}), ("v0", {"omega": 0.0}), ("k", {"y0": 0.0}), ("Fz", {"omega": 0.0}), ("y0", {"omega": 0.0}),
     ("omega", {"y0": 0.0}), ("Fz", {"k": None})],
)  # fmt: skip
def test_an_input_without_influence_is_reported(surrogate, unknown, changed):
    case = {**CASE, **changed}
    value = surrogate.evaluate(**case).mu_macro
    solution = solve_for(surrogate, unknown, [value, 0.9 * value], others(case, unknown))
    assert solution.constant
    assert solution.roots == ((), ())
    assert solution.reach.mu_min == solution.reach.mu_max == value


def test_at_rest_the_frequency_only_matters_by_being_there(surrogate):
    case = others({**CASE, "v0": 0.0}, "omega")
    solution = solve_for(surrogate, "omega", [0.3, 0.25], case)
    assert [[root.value for root in roots] for roots in solution.roots] == [[0.0], []]
    static = surrogate.evaluate(**CASE | {"v0": 0.0}).mu_macro
    root = only_root(solve_for(surrogate, "omega", static, case))
    assert (root.low, root.high) == (5e-324, 1.7976931348623157e308)


def test_rigid_contact_is_inverted(surrogate):
    for unknown in ("v0", "y0", "omega", "mu0"):
        case = {**CASE, "k": None}
        target = surrogate.evaluate(**case).mu_macro
        root = only_root(solve_for(surrogate, unknown, target, others(case, unknown)))
        assert root.value == close(CASE[unknown], rel=1e-9)


@pytest.mark.parametrize(
    ("field", "arguments"),
    [("unknown", ("w0", 0.1, CASE)), ("v0", ("v0", 0.1, CASE)), ("Fz", ("v0", 0.1, {"mu0": 0.3})),
     ("target", ("v0", -0.1, others(CASE, "v0"))), ("target", ("v0", [0.1, math.nan], others(CASE, "v0"))),
     ("mu0", ("v0", 0.1, {**others(CASE, "v0"), "mu0": 0.0})),
     ("range", ("v0", 0.1, others(CASE, "v0"), (1.0, 1.0))), ("range", ("k", 0.1, others(CASE, "k"), (0.0, 1.0))),
     ("range", ("v0", 0.1, others(CASE, "v0"), (0.0, math.inf))),
     ("f", ("v0", 0.1, {**others(others(CASE, "v0"), "omega"), "f": 1e308})),
     ("f", ("omega", 0.1, {**others(CASE, "omega"), "f": 1e3})),
     ("k", ("v0", 0.1, {**others(CASE, "v0"), "k": [1e6, 2e6]}))],
)  # fmt: skip
def test_a_bad_question_names_its_field(surrogate, field, arguments):
    with pytest.raises(InputError) as caught:
        solve_for(surrogate, *arguments)
    assert caught.value.field == field


@pytest.mark.parametrize("contact", ["spring", "ball"])
@pytest.mark.parametrize("unknown", ["k", "Fz"])
@settings(max_examples=15, deadline=None)
@given(v0=decade(-5, 0), share=st.floats(0.001, 0.999))
def test_no_root_is_missed_on_a_ray(surrogate, contact, unknown, v0, share):
    case, ray = {**CASE, "v0": v0}, CASE[unknown] * np.geomspace(1e-9, 1e9, 20_001)
    mu = surrogate.evaluate(**{**case, unknown: ray}, contact=contact).mu_macro
    target = float(mu[int(share * 20_000)])
    assume(mu.min() * (1.0 + 1e-9) < target < mu.max() * (1.0 - 1e-9))  # not on a plateau, where all are roots
    above = mu > target * (1.0 + 1e-12)
    found = solve_for(surrogate, unknown, target, others(case, unknown), (ray[0], ray[-1]), contact=contact).roots[0]
    assert len(found) >= np.count_nonzero(above[1:] != above[:-1])
    assert all(root.mu_macro == close(target, rel=1e-11) for root in found)
    values = [root.value for root in found]
    assert values == sorted(values)


@pytest.mark.parametrize("unknown", ["k", "Fz"])
def test_a_ball_folds_as_a_spring_does(surrogate, unknown):
    case = {**CASE, "v0": 1e-4}
    ray = CASE[unknown] * np.geomspace(*((1e-6, 1e8) if unknown == "k" else (1e-8, 1e6)), 141)
    mu = surrogate.evaluate(**{**case, unknown: ray}, contact="ball").mu_macro
    falling = np.diff(mu) < 0.0
    (turns,) = np.nonzero(falling[1:] != falling[:-1])
    assert turns.size == 2
    rigid = mu[-1] if unknown == "k" else mu[0]
    target = 0.5 * float(rigid + mu[turns + 1].max())
    assert len(solve_for(surrogate, unknown, target, others(case, unknown), contact="ball").roots[0]) == 3


@pytest.mark.parametrize("pair", [pair for pair in PAIRS if pair[1] != "across"], ids=" ".join)
@pytest.mark.parametrize("k", [1e6, None])
def test_along_and_normal_the_whole_friction_is_reached(surrogate, pair, k):
    said, _, case = as_kind({**CASE, "k": k}, pair)
    solution = solve_for(surrogate, "v0", 0.3, others(case, "v0"), **said)
    root = only_root(solution)
    # where the springs begin to slide all the time; the last digits before it are mu0, too
    z = case.get("Fz_amplitude", 0.0) / case["Fz"]
    begin = z * 3e-6 * CASE["omega"] if z and k else 5e-324 if z else CASE["y0"] * CASE["omega"]
    assert root.value == close(begin, rel=1e-5, abs=5e-324)
    assert root.low <= root.value <= begin * (1.0 + 1e-12)
    assert root.high == solution.reach.high
    assert solution.reach.max_included


def test_the_amplitude_of_the_force_stays_below_the_force(surrogate):
    said, _, case = as_kind(CASE, ("spring", "normal"))
    for unknown, within in (("Fz_amplitude", (0.1, 10.0)), ("Fz", (4.0, 100.0))):
        with pytest.raises(InputError, match=r"range must be two ascending.*Fz_amplitude below Fz"):
            solve_for(surrogate, unknown, 0.2, others(case, unknown), within, **said)
        reach = solve_for(surrogate, unknown, 0.2, others(case, unknown), **said).reach
        assert reach.high < 10.0 if unknown == "Fz_amplitude" else reach.low > 4.0
    with pytest.raises(InputError, match="Fz_amplitude must be >= 0 and below Fz"):
        solve_for(surrogate, "v0", 0.2, {**others(case, "v0"), "Fz_amplitude": 10.0}, **said)
    with pytest.raises(InputError, match="y0 must be left out for direction normal"):
        solve_for(surrogate, "v0", 0.2, {**others(case, "v0"), "y0": 1e-6}, **said)
    with pytest.raises(InputError, match="Fz_amplitude must be left out for direction across"):
        solve_for(surrogate, "v0", 0.2, {**others(CASE, "v0"), "Fz_amplitude": 1.0})
    with pytest.raises(InputError, match="unknown must be one of mu0, Fz, k, Fz_amplitude"):
        solve_for(surrogate, "y0", 0.2, others(case, "Fz_amplitude"), **said)


@pytest.mark.parametrize("interval", [{"k_range": (1e6, 2e6)}, {"k_low": 1e6, "k_high": 2e6}])
def test_an_interval_of_k_is_refused_with_the_reason(surrogate, interval):
    known = others(others(CASE, "v0"), "k") | interval
    with pytest.raises(InputError, match="a target has an interval of roots; solve for both ends"):
        solve_for(surrogate, "v0", 0.2, known)


# --- border -------------------------------------------------------------------------------------------


@every_pair
@pytest.mark.parametrize("place", range(6))
@pytest.mark.parametrize("speed", [0.01, 0.15])
def test_the_crossings_are_all_changes_of_the_regime(surrogate, pair, place, speed):
    said, fields, case = as_kind({**CASE, "v0": speed}, pair)
    along = fields[place]
    values = case[along] * np.geomspace(1e-3, 1e3, 3001)
    if said["direction"] == "normal" and along in ("Fz", "Fz_amplitude"):
        values = values[values > 4.0] if along == "Fz" else values[values < 10.0]
    regime = surrogate.evaluate(**{**case, along: values}, **said).regime
    (changes,) = np.nonzero(regime[1:] != regime[:-1])
    marks = border_crossings(surrogate, along, others(case, along), values[0], values[-1], **said)
    assert [mark.regimes for mark in marks] == [(regime[i], regime[i + 1]) for i in changes]
    for mark, i in zip(marks, changes, strict=True):
        assert values[i] < mark.value <= values[i + 1]
        there = surrogate.evaluate(**{**case, along: np.array([np.nextafter(mark.value, 0.0), mark.value])}, **said)
        assert tuple(there.regime) == mark.regimes
        assert mark.mu_macro == there.mu_macro[1]


@pytest.mark.parametrize(("along", "expected"), [("v0", 1), ("omega", 1), ("y0", 1), ("k", 2), ("Fz", 2), ("mu0", 2)])
def test_the_border_is_where_the_regime_changes(surrogate, along, expected):
    crossings = border_crossings(surrogate, along, others(CASE, along), 1e-12, 1e12)
    assert len(crossings) == expected
    for crossing in crossings:
        regimes = surrogate.evaluate(**{**CASE, along: crossing.value * np.array([1 - 1e-9, 1 + 1e-9])}).regime
        assert set(regimes) == {"continuous", "stick_slip"}
        answer = surrogate.evaluate(**{**CASE, along: crossing.value})
        assert answer.v_tilde == close(surrogate.v_tilde_crit(answer.y_tilde), rel=1e-9)
        assert crossing.mu_macro == answer.mu_macro


@pytest.mark.parametrize(("share", "expected"), [(1.0 + 1e-9, 2), (1.0 - 1e-9, 0)])
def test_a_ray_that_barely_touches_the_border_crosses_it_twice_or_never(surrogate, share, expected):
    closest = 1.290791
    ratio = share * closest / surrogate.v_tilde_crit(closest)  # y~ / v~
    case = {"mu0": 1.0, "Fz": 1.0, "y0": 1.0, "omega": ratio, "v0": 1.0}
    crossings = border_crossings(surrogate, "k", case, 1e-3, 1e3)
    assert len(crossings) == expected
    assert all(crossing.value == close(closest, rel=1e-3) for crossing in crossings)


def test_a_fold_just_above_its_first_ratio_is_found(surrogate):
    case = {"mu0": 1.0, "Fz": 1.0, "y0": 1.0, "omega": 10.0, "v0": 1.0}
    target = float(surrogate.mu_ratio(0.6626, 6.626))  # between minimum and maximum, which differ by a thousandth
    roots = solve_for(surrogate, "k", target, case).roots[0]
    assert len(roots) == 3
    assert roots[1].low <= 6.626 <= roots[1].high
    below = solve_for(surrogate, "k", target, {**case, "omega": 9.7})
    assert len(below.roots[0]) == 1


def test_outside_its_range_there_is_no_border(surrogate):
    assert border_crossings(surrogate, "v0", others(CASE, "v0"), 1e-12, 1e-3) == ()
    assert border_crossings(surrogate, "v0", {**others(CASE, "v0"), "k": None}, 0.0, 1e3) == ()
    assert border_crossings(surrogate, "k", {**others(CASE, "k"), "v0": 0.0}, 1e-3, 1e3) == ()


# --- law ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", ["log", "linear"])
def test_a_range_has_its_ends_exactly(scale):
    values = sweep_values("v0", 1e-7, 0.3, 101, scale)
    assert (values[0], values[-1], values.size) == (1e-7, 0.3, 101)
    if scale == "log":
        assert sweep_values("v0", 1e-4, 10.0, 6, "log").tolist() == [1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0]
    steps = np.diff(np.log(values) if scale == "log" else values)
    assert steps == close(steps[0], rel=1e-9)
    assert np.all(np.diff(sweep_values("v0", 1.0, math.nextafter(1.0, 2.0), 9, scale)) >= 0.0)


@every_pair
@pytest.mark.parametrize("place", range(6))
def test_a_law_is_the_surrogate_along_a_line(surrogate, pair, place):
    said, fields, case = as_kind(CASE, pair, 0.009)
    along = fields[place]
    values = sweep_values(along, 0.01 * case[along], 100.0 * case[along], 41, "log")
    law = friction_law(surrogate, along, values, others(case, along), **said)
    assert law.kind.names == said
    for i in (0, 17, 40):
        alone = surrogate.evaluate(**{**case, along: values[i], **said})
        assert law.answer.mu_macro[i] == close(alone.mu_macro, rel=1e-15)
        static = surrogate.evaluate(**{**case, along: values[i], "v0": 0.0, **said})
        assert law.mu_static[i] == close(static.mu_macro, rel=1e-9, abs=1e-15)
    changes = np.count_nonzero(law.answer.regime[1:] != law.answer.regime[:-1])
    assert changes == len(law.border)


def test_the_approximations_hold_where_they_should(surrogate):
    def compare(name, case, **ranges):
        values = sweep_values("v0", *ranges["v0"], 31, "log")
        law = friction_law(surrogate, "v0", values, others(case, "v0"))
        approximation = approximations(surrogate, law)[name]
        return np.max(np.abs(approximation - law.answer.mu_macro)) / case["mu0"]

    unit = {"mu0": 1.0, "Fz": 1.0, "k": 1.0, "omega": 1.0, "v0": 1.0}
    assert compare("static", {**unit, "y0": 0.5}, v0=(1e-12, 1e-9)) < 1e-8
    assert compare("small_amplitude", {**unit, "y0": 0.01}, v0=(1e-3, 1e3)) < 1e-8  # O(y~^4)
    assert compare("creep", {**unit, "y0": 0.5}, v0=(1e-12, 1e-6)) < 1e-8  # O(v~^(3/2))
    assert compare("creep", {**unit, "y0": 2.0}, v0=(1e-12, 1e-6)) < 1e-8
    assert compare("continuous", {**unit, "y0": 0.01}, v0=(1e-3, 1e3)) < 1e-8  # O(y~^4)
    assert compare("continuous", {**unit, "y0": 1.0}, v0=(1e3, 1e6)) < 1e-6  # O(1/v~^2)
    assert compare("rigid", {**unit, "y0": 1.0}, v0=(1e3, 1e6)) < 1e-6  # O(1/v~^2)
    assert compare("corner", {**unit, "y0": 1.0}, v0=(1e-12, 1e-9)) < 1e-8  # O(mu~^3)


def test_an_approximation_is_nan_outside_its_stated_range(surrogate):
    values = sweep_values("v0", 1e-3, 10.0, 11, "log")
    law = friction_law(surrogate, "v0", values, {**others(CASE, "v0"), "y0": 1e-5})  # y~ = 3.3
    found = approximations(surrogate, law)
    assert found.keys() == APPROXIMATIONS.keys()
    assert np.isnan(found["small_amplitude"]).all()
    assert np.isnan(found["corner"]).all()
    assert np.isfinite(found["rigid"]).all()
    rigid = friction_law(surrogate, "v0", values, {**others(CASE, "v0"), "k": None})
    found = approximations(surrogate, rigid)
    assert found["rigid"] == close(rigid.answer.mu_macro, rel=1e-14)
    assert np.isnan(found["creep"]).all()
    assert np.isnan(found["continuous"]).all()
    assert (rigid.mu_static == 0.0).all()
    still = friction_law(surrogate, "v0", values, {**others(CASE, "v0"), "y0": 0.0})
    assert (still.mu_static == 0.3).all()


@pytest.mark.parametrize("along", FIELDS)
def test_the_border_of_every_case_is_where_the_law_crosses_it(surrogate, along):
    values = sweep_values(along, 0.1 * CASE[along], 10.0 * CASE[along], 31, "log")
    law = friction_law(surrogate, along, values, others(CASE, along))
    speeds = border_speeds(surrogate, law)
    assert speeds.keys() == BORDERS.keys()
    v0 = values if along == "v0" else CASE["v0"]
    assert ((v0 >= speeds["exact"]) == (law.answer.regime == "continuous")).all()
    assert speeds["blend"] == close(speeds["exact"], rel=0.006)
    meant = ~np.isnan(speeds["small_amplitude"])
    assert (meant == (law.answer.y_tilde <= 1.0)).all()
    assert speeds["small_amplitude"][meant] == close(speeds["exact"][meant], rel=0.11)


def test_what_never_sticks_has_no_border(surrogate):
    values = sweep_values("v0", 1e-3, 10.0, 5, "log")
    for changed in ({"k": None}, {"y0": 0.0}, {"omega": 0.0}):
        case = {**others(CASE, "v0"), **changed}
        for column in border_speeds(surrogate, friction_law(surrogate, "v0", values, case)).values():
            assert (column == 0.0).all()


@pytest.mark.parametrize(
    ("field", "arguments"),
    [("along", ("x", 1.0, 2.0, 5, "log")), ("scale", ("v0", 1.0, 2.0, 5, "cubic")),
     ("points", ("v0", 1.0, 2.0, 1, "log")),
     ("start", ("v0", 0.0, 2.0, 5, "log")), ("start", ("k", 0.0, 2.0, 5, "linear")),
     ("stop", ("v0", 2.0, 2.0, 5, "log")),
     ("stop", ("v0", 1.0, math.inf, 5, "log")), ("start", ("v0", math.nan, 1.0, 5, "log"))],
)  # fmt: skip
def test_a_bad_range_names_its_field(field, arguments):
    with pytest.raises(InputError) as caught:
        sweep_values(*arguments)
    assert caught.value.field == field

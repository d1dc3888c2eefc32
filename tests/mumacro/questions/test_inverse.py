"""The inverse problem: roots against the forward answer, folds, reach, the border."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mumacro import Surrogate
from mumacro.questions.law import law
from mumacro.questions.solve_for import solve_for
from tests.support.cases import CASE, PAIRS, Case, as_kind, every_pair, without
from tests.support.comparing import close
from tests.support.refusals import refused


def only_root(solution: Any) -> Any:
    ((root,),) = solution.roots
    return root


def decade(low: float, high: float) -> Any:
    return st.floats(low, high).map(lambda x: 10.0**x)


cases = st.fixed_dictionaries(
    {
        "mu0": decade(-2, 0),
        "Fz": decade(-3, 4),
        "k": decade(3, 9),
        "y0": decade(-9, -3),
        "omega": decade(0, 7),
        "v0": decade(-6, 2),
    }
)


@every_pair
@settings(max_examples=60)
@given(case=cases, share=st.floats(0.001, 0.999), place=st.integers(0, 5))
def test_the_forward_answer_is_inverted(
    surrogate: Surrogate, pair: Any, case: Case, share: Any, place: Any
) -> None:
    words, fields, case = as_kind(case, pair, share)
    unknown = fields[place]
    forward: Any = surrogate.evaluate(**case, **words)
    solution = solve_for(surrogate, unknown, forward.mu_macro, **without(case, unknown), **words)
    if solution.constant or not solution.roots[0]:
        # within the surrogate's error the input has no influence here, or its end equals the limit
        edge = min(
            abs(forward.mu_macro - solution.reach.mu_min),
            abs(forward.mu_macro - solution.reach.mu_max),
        )
        assert edge <= 4.0 * forward.error_bound + 1e-9 * case["mu0"]
        return
    for root in solution.roots[0]:
        there = surrogate.evaluate(**{**case, unknown: root.value, **words})
        assert there.mu_macro == root.mu_macro
        assert root.mu_macro == close(forward.mu_macro, rel=1e-9, abs=2.0 * forward.error_bound)
        assert root.low <= root.value <= root.high
    value = min(max(case[unknown], solution.reach.low), solution.reach.high)
    assert any(root.low <= value <= root.high for root in solution.roots[0])


def test_an_enclosure_on_a_plateau_spans_it(surrogate: Surrogate) -> None:
    # y~ = 1, v~ = 1e5: mu~ = 1 - r^2/4 to the last digit, for any stiffness from a hundredth of
    # this one on
    case: Case = {"mu0": 1.0, "Fz": 0.01, "k": 1000.0, "y0": 1e-5, "omega": 1.0, "v0": 1.0}
    root = only_root(
        solve_for(surrogate, "k", surrogate.evaluate(**case).mu_macro, **without(case, "k"))
    )
    assert root.low < 10.0 < 1e9 < root.high


def test_targets_are_solved_together_as_alone(surrogate: Surrogate) -> None:
    targets = np.linspace(0.23, 0.299, 57)
    together = solve_for(surrogate, "v0", targets, **without(CASE, "v0"))
    values = [roots[0].value for roots in together.roots]
    assert values == sorted(values)
    for target, value in zip(targets, values, strict=True):
        assert only_root(solve_for(surrogate, "v0", target, **without(CASE, "v0"))).value == close(
            value, rel=1e-9
        )


@pytest.mark.parametrize(
    ("unknown", "low", "high"),
    [
        ("v0", 0.3 * math.sqrt(5.0) / 3.0, 0.3),
        ("y0", 0.0, 0.3),
        ("omega", 0.3 * math.sqrt(5.0) / 3.0, 0.3),
    ],
)
def test_a_monotone_unknown_reports_its_reach(
    surrogate: Surrogate, unknown: Any, low: Any, high: Any
) -> None:
    targets = [0.999 * low, low + 0.5 * (high - low), 1.001 * high]
    solution = solve_for(surrogate, unknown, targets, **without(CASE, unknown))
    assert [len(roots) for roots in solution.roots] == [0, 1, 0]
    assert solution.reach.mu_min == close(low, abs=1e-10)
    assert solution.reach.mu_max == high


def test_an_end_that_is_attained_is_a_root_and_one_that_is_only_approached_none(
    surrogate: Surrogate,
) -> None:
    static = surrogate.evaluate(**{**CASE, "v0": 0.0}).mu_macro
    for unknown, end in (("v0", static), ("y0", 0.3), ("omega", 0.3)):
        assert only_root(solve_for(surrogate, unknown, end, **without(CASE, unknown))).value == 0.0
    # at rest friction vanishes from y0 = l0 on
    root = only_root(solve_for(surrogate, "y0", 0.0, **{**without(CASE, "y0"), "v0": 0.0}))
    assert root.value == close(3e-6, rel=1e-12)
    for unknown, end in (("v0", 0.3), ("y0", 0.0)):
        solution = solve_for(surrogate, unknown, end, **without(CASE, unknown))
        assert solution.roots == ((),)
        assert not solution.reach.holds(end)


@pytest.mark.parametrize("unknown", ["k", "Fz"])
def test_a_fold_has_three_roots(surrogate: Surrogate, unknown: Any) -> None:
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
        roots = solve_for(surrogate, unknown, target, **without(case, unknown)).roots[0]
        assert len(roots) == expected
        assert [root.value for root in roots] == sorted(root.value for root in roots)
        for root in roots:
            assert root.mu_macro == close(target, rel=1e-12)
    below = solve_for(surrogate, unknown, 0.3 * 0.99 * low, **without(case, unknown))
    assert below.roots == ((),)
    assert below.reach.mu_min == close(0.3 * low, rel=1e-6)


def test_a_range_keeps_its_roots_only(surrogate: Surrogate) -> None:
    case = without({**CASE, "v0": 1e-4}, "k")
    target = 0.3 * 0.0023
    every = solve_for(surrogate, "k", target, **case)
    assert len(every.roots[0]) == 3
    first, second, third = (root.value for root in every.roots[0])
    middle = solve_for(
        surrogate,
        "k",
        target,
        **case,
        within=(math.sqrt(first * second), math.sqrt(second * third)),
    )
    assert only_root(middle).value == close(second, rel=1e-9)
    half = solve_for(surrogate, "v0", 0.25, **without(CASE, "v0"), within=(0.0, 1e-3))
    assert half.roots == ((),)
    assert half.reach.max_included
    assert half.reach.mu_max == surrogate.evaluate(**{**CASE, "v0": 1e-3}).mu_macro


@pytest.mark.parametrize(
    ("unknown", "changed"),
    [
        ("v0", {"y0": 0.0}),
        ("v0", {"omega": 0.0}),
        ("k", {"y0": 0.0}),
        ("Fz", {"omega": 0.0}),
        ("y0", {"omega": 0.0}),
        ("omega", {"y0": 0.0}),
        ("Fz", {"k": "rigid"}),
    ],
)
def test_an_input_without_influence_has_the_whole_range_as_root_or_none(
    surrogate: Surrogate, unknown: Any, changed: Any
) -> None:
    case = {**CASE, **changed}
    value = surrogate.evaluate(**case).mu_macro
    solution = solve_for(surrogate, unknown, [value, 0.9 * value], **without(case, unknown))
    assert solution.constant
    ((root,), none) = solution.roots
    reach = solution.reach
    assert (root.low, root.high, none) == (reach.low, reach.high, ())
    assert reach.mu_min == reach.mu_max == value
    assert solution.reason(0) == solution.reason(1)
    assert f"{unknown} has no influence here: mu_macro is {value:.6g}" in solution.reason()
    with refused("value") as error:
        _ = solve_for(surrogate, unknown, value, **without(case, unknown)).value
    assert "no influence" in str(error.value)


def test_at_rest_the_frequency_only_matters_by_being_there(surrogate: Surrogate) -> None:
    case = without({**CASE, "v0": 0.0}, "omega")
    solution = solve_for(surrogate, "omega", [0.3, 0.25], **case)
    assert [[root.value for root in roots] for roots in solution.roots] == [[0.0], []]
    static = surrogate.evaluate(**CASE | {"v0": 0.0}).mu_macro
    root = only_root(solve_for(surrogate, "omega", static, **case))
    assert (root.low, root.high) == (5e-324, 1.7976931348623157e308)


def test_rigid_contact_is_inverted_and_friction_coefficients_are_found_far_out(
    surrogate: Surrogate,
) -> None:
    for unknown in ("v0", "y0", "omega", "mu0"):
        case = {**CASE, "k": "rigid"}
        target = surrogate.evaluate(**case).mu_macro
        root = only_root(solve_for(surrogate, unknown, target, **without(case, unknown)))
        assert root.value == close(CASE[unknown], rel=1e-9)
    for target in (1e-9, 0.1, 1e7):
        root = only_root(solve_for(surrogate, "mu0", target, **without(CASE, "mu0")))
        assert root.mu_macro == close(target, rel=1e-12)


@pytest.mark.parametrize("contact", ["spring", pytest.param("ball", marks=pytest.mark.slow)])
@pytest.mark.parametrize("unknown", ["k", "Fz"])
@settings(max_examples=15)
@given(v0=decade(-5, 0), share=st.floats(0.001, 0.999))
def test_no_root_is_missed_on_a_ray(
    surrogate: Surrogate, contact: Any, unknown: Any, v0: Any, share: Any
) -> None:
    case, ray = {**CASE, "v0": v0}, CASE[unknown] * np.geomspace(1e-9, 1e9, 20_001)
    mu = surrogate.evaluate(**{**case, unknown: ray}, contact=contact).mu_macro
    target = float(mu[int(share * 20_000)])
    # not on a plateau, where all are roots
    assume(mu.min() * (1.0 + 1e-9) < target < mu.max() * (1.0 - 1e-9))
    above = mu > target * (1.0 + 1e-12)
    solution = solve_for(
        surrogate,
        unknown,
        target,
        **without(case, unknown),
        within=(ray[0], ray[-1]),
        contact=contact,
    ).roots[0]
    assert len(solution) >= np.count_nonzero(above[1:] != above[:-1])
    assert all(root.mu_macro == close(target, rel=1e-11) for root in solution)
    values = [root.value for root in solution]
    assert values == sorted(values)


@pytest.mark.parametrize("pair", [pair for pair in PAIRS if pair[1] != "across"], ids=" ".join)
@pytest.mark.parametrize("k", [1e6, "rigid"])
def test_along_and_normal_the_whole_friction_is_reached(
    surrogate: Surrogate, pair: Any, k: Any
) -> None:
    words, _, case = as_kind({**CASE, "k": k}, pair)
    solution = solve_for(surrogate, "v0", 0.3, **without(case, "v0"), **words)
    root = only_root(solution)
    # where the springs begin to slide all the time; the last digits before it are mu0, too
    z = case.get("Fz_amplitude", 0.0) / case["Fz"]
    begin = (
        z * 3e-6 * CASE["omega"]
        if z and k != "rigid"
        else 5e-324
        if z
        else CASE["y0"] * CASE["omega"]
    )
    assert root.value == close(begin, rel=1e-5, abs=5e-324)
    assert root.low <= root.value <= begin * (1.0 + 1e-12)
    assert root.high == solution.reach.high
    assert solution.reach.max_included


def test_the_amplitude_of_the_force_stays_below_the_force(surrogate: Surrogate) -> None:
    words, _, case = as_kind(CASE, ("spring", "normal"))
    for unknown, within in (("Fz_amplitude", (0.1, 10.0)), ("Fz", (4.0, 100.0))):
        with refused("range"):
            solve_for(surrogate, unknown, 0.2, **without(case, unknown), within=within, **words)
        reach = solve_for(surrogate, unknown, 0.2, **without(case, unknown), **words).reach
        assert reach.high < 10.0 if unknown == "Fz_amplitude" else reach.low > 4.0


ANY = 0.2  # a target
# direction, the first arguments, what is changed in the case, what is refused
REFUSED: list[tuple[str, Any, Case, str]] = [
    ("across", ("w0", ANY), {}, "unknown"),
    ("across", ("v0", ANY), {"v0": 1.0}, "v0"),
    ("across", ("v0", ANY), {"Fz": None}, "Fz"),
    ("across", ("v0", -0.1), {}, "target"),
    ("across", ("v0", [0.1, math.nan]), {}, "target[1]"),
    ("across", ("v0", ANY), {"mu0": 0.0}, "mu0"),
    ("across", ("v0", ANY, (1.0, 1.0)), {}, "range"),
    ("across", ("k", ANY, (0.0, 1.0)), {}, "range"),
    ("across", ("v0", ANY, (0.0, math.inf)), {}, "range"),
    ("across", ("v0", ANY, 1.0), {}, "range"),
    ("across", ("v0", "fast"), {}, "target"),
    ("across", ("v0", ANY), {"fz": 1.0}, "fz"),
    ("across", ("omega", ANY), {"f": 1e3}, "f"),
    ("across", ("v0", ANY), {"omega": None, "f": 1e308}, "f"),
    ("across", ("v0", ANY), {"k": [1e6, 2e6]}, "k"),
    ("normal", ("v0", ANY), {"Fz_amplitude": 10.0}, "Fz_amplitude"),
    ("normal", ("v0", ANY), {"y0": 1e-6}, "y0"),
    (
        "across",
        ("v0", ANY),
        {"Fz_amplitude": 1.0},
        "Fz_amplitude",
    ),
    ("normal", ("y0", ANY), {}, "unknown"),
]


@pytest.mark.parametrize(("direction", "question", "changed", "place"), REFUSED)
def test_a_bad_question_names_its_field(
    surrogate: Surrogate, direction: str, question: Any, changed: Case, place: str
) -> None:
    keywords, _, case = as_kind(CASE, ("spring", direction))
    unknown, target, *within = question
    inputs = {**without(case, unknown), **changed}
    gone = [name for name, value in changed.items() if value is None and name != "k"]
    with refused(place):
        solve_for(
            surrogate,
            unknown,
            target,
            within=within[0] if within else None,
            **without(inputs, *gone),
            **keywords,
        )


# --- border ---------------------------------------------------------------------------------------


@every_pair
@pytest.mark.parametrize("place", range(6))
@pytest.mark.parametrize("speed", [0.01, 0.15])
def test_the_crossings_are_all_changes_of_the_regime(
    surrogate: Surrogate, pair: Any, place: Any, speed: Any
) -> None:
    words, fields, case = as_kind({**CASE, "v0": speed}, pair)
    along = fields[place]
    values = case[along] * np.geomspace(1e-3, 1e3, 3001)
    if words["direction"] == "normal" and along in ("Fz", "Fz_amplitude"):
        values = values[values > 4.0] if along == "Fz" else values[values < 10.0]
    regime = surrogate.evaluate(**{**case, along: values}, **words).regime
    (changes,) = np.nonzero(regime[1:] != regime[:-1])
    ends = values[[0, -1]]
    marks = law(surrogate, along, values=ends, **without(case, along), **words).border
    assert [mark.regimes for mark in marks] == [(regime[i], regime[i + 1]) for i in changes]
    for mark, i in zip(marks, changes, strict=True):
        assert values[i] < mark.value <= values[i + 1]
        there = surrogate.evaluate(
            **{**case, along: np.array([np.nextafter(mark.value, 0.0), mark.value])}, **words
        )
        assert tuple(there.regime) == mark.regimes
        assert mark.mu_macro == there.mu_macro[1]


@pytest.mark.parametrize(("share", "expected"), [(1.0 + 1e-9, 2), (1.0 - 1e-9, 0)])
def test_a_ray_at_the_border_crosses_it_twice_or_never(
    surrogate: Surrogate, share: Any, expected: Any
) -> None:
    closest = 1.290791
    ratio = share * closest / surrogate.v_tilde_crit(closest)  # y~ / v~
    case = {"mu0": 1.0, "Fz": 1.0, "y0": 1.0, "omega": ratio, "v0": 1.0}
    crossings = law(surrogate, "k", values=[1e-3, 1e3], **case).border
    assert len(crossings) == expected
    assert all(crossing.value == close(closest, rel=1e-3) for crossing in crossings)


def test_a_fold_just_above_its_first_ratio_is_found(surrogate: Surrogate) -> None:
    case: Case = {"mu0": 1.0, "Fz": 1.0, "y0": 1.0, "omega": 10.0, "v0": 1.0}
    # between minimum and maximum, which differ by a thousandth
    target = float(surrogate.mu_ratio(0.6626, 6.626))
    roots = solve_for(surrogate, "k", target, **case).roots[0]
    assert len(roots) == 3
    assert roots[1].low <= 6.626 <= roots[1].high
    below = solve_for(surrogate, "k", target, **{**case, "omega": 9.7})
    assert len(below.roots[0]) == 1


def test_outside_its_range_there_is_no_border(surrogate: Surrogate) -> None:
    five = without(CASE, "v0")
    assert law(surrogate, "v0", values=[1e-12, 1e-3], **five).border == ()
    assert law(surrogate, "v0", values=[0.0, 1e3], **{**five, "k": "rigid"}).border == ()
    assert law(surrogate, "k", values=[1e-3, 1e3], **{**without(CASE, "k"), "v0": 0.0}).border == ()


def test_an_interval_of_k_is_solved_for_at_both_ends(surrogate: Surrogate) -> None:
    rest = without(CASE, "k", "y0")
    for ends in ({"k_low": 8e5, "k_high": 1.25e6}, {"k": "0.8..1.25 N/um"}):
        solution = solve_for(surrogate, "y0", [0.15, 0.4], **{**rest, **ends})
        assert solution.ends == tuple(
            solve_for(surrogate, "y0", [0.15, 0.4], **{**rest, "k": k}) for k in (8e5, 1.25e6)
        )
        assert solution.roots[0][0].value == close(
            solve_for(surrogate, "y0", 0.15, **{**rest, "k": 1e6}).roots[0][0].value, rel=1e-9
        )
    with refused("k_low"):
        solve_for(surrogate, "k", 0.15, **{**without(CASE, "k"), "k_low": 8e5, "k_high": 1.25e6})

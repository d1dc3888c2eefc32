"""A stiffness that grows with the load, k = k_given (Fz/Fz_given)^m: laws along Fz and targets
solved for it, in Python, on the command line and over HTTP."""

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from builder.approximations import approximations, border_speeds
from mumacro import Surrogate
from mumacro.cli.main import main
from mumacro.inputs.stiffening import Stiffening
from mumacro.questions.law import law as friction_law
from mumacro.questions.solve_for import solve_for
from mumacro.validity import load_notes
from tests.support.cases import CASE, PAIRS, Case, as_kind, without
from tests.support.comparing import close
from tests.support.refusals import refused

LOADS = np.geomspace(0.1, 1000.0, 41)  # N; k of CASE holds at its Fz
EXPONENTS = [0.2, 1.0 / 3.0, 0.5, 0.9]
SHAKEN = [pair for pair in PAIRS if pair[1] != "normal"]


def grown(case: Case, m: float, loads: Any) -> Case:
    """The case at other loads, each with its own k."""
    return {**case, "Fz": loads, "k": case["k"] * (loads / case["Fz"]) ** m}


@pytest.mark.parametrize("pair", PAIRS, ids=" ".join)
@pytest.mark.parametrize("m", [1.0 / 3.0, 0.7])
def test_a_law_is_that_of_each_load_with_its_own_stiffness(
    surrogate: Surrogate, pair: Any, m: float
) -> None:
    words, _, case = as_kind(CASE, pair)
    loads = LOADS[case.get("Fz_amplitude", 0.0) < LOADS]
    law = friction_law(surrogate, "Fz", values=loads, **words, stiffness_exponent=m, **case)
    each = grown(case, m, loads)
    expected = surrogate.evaluate(**each, **words)
    assert law.answer.mu_macro == close(expected.mu_macro, rel=1e-12)
    assert law.mu_static == close(
        surrogate.evaluate(**{**each, "v0": 0.0}, **words).mu_macro, rel=1e-12, abs=1e-12
    )
    assert law.columns["k"] == close(each["k"], rel=1e-14)
    assert law.stiffening == Stiffening(m, CASE["Fz"])
    # at the load at which k holds, the case itself
    one = friction_law(
        surrogate, "Fz", values=np.array([CASE["Fz"], 1e3]), **words, stiffness_exponent=m, **case
    )
    assert one.answer.mu_macro[0] == surrogate.evaluate(**case, **words).mu_macro


@pytest.mark.parametrize("pair", SHAKEN, ids=" ".join)
def test_in_proportion_to_the_load_friction_does_not_depend_on_it(
    surrogate: Surrogate, pair: Any
) -> None:
    words, _, case = as_kind(CASE, pair)
    loads = np.geomspace(1e-6, 1e6, 201)
    law = friction_law(surrogate, "Fz", values=loads, **words, stiffness_exponent=1.0, **case)
    mu = surrogate.evaluate(**case, **words).mu_macro
    assert law.answer.mu_macro == close(np.full(201, mu), rel=1e-13)
    assert not law.border
    solution = solve_for(surrogate, "Fz", [mu, 0.9 * mu], **words, stiffness_exponent=1.0, **case)
    assert solution.constant
    assert [len(roots) for roots in solution.roots] == [1, 0]
    # and with one k it does
    other = friction_law(surrogate, "Fz", values=loads, **words, **without(case, "Fz"))
    assert np.ptp(other.answer.mu_macro) > 0.1


def test_what_is_left_out_is_hertz_for_a_ball_and_constant_for_a_spring(
    surrogate: Surrogate,
) -> None:
    ball = friction_law(surrogate, "Fz", values=LOADS, contact="ball", **CASE)
    hertz = friction_law(
        surrogate, "Fz", values=LOADS, contact="ball", stiffness_exponent=1.0 / 3.0, **CASE
    )
    assert ball.answer.mu_macro.tolist() == hertz.answer.mu_macro.tolist()
    for contact in ("spring", "ball"):
        alone = friction_law(surrogate, "Fz", values=LOADS, contact=contact, **without(CASE, "Fz"))
        constant = friction_law(
            surrogate, "Fz", values=LOADS, contact=contact, stiffness_exponent=0.0, **CASE
        )
        one_k = surrogate.evaluate(**{**CASE, "Fz": LOADS}, contact=contact).mu_macro
        assert alone.stiffening is constant.stiffening is None
        assert alone.answer.mu_macro.tolist() == constant.answer.mu_macro.tolist()
        assert alone.answer.mu_macro.tolist() == one_k.tolist()
        assert "k" not in alone.columns
    solution = solve_for(surrogate, "Fz", 0.25, contact="ball", **CASE)
    assert solution.curve.stiffening == Stiffening(1.0 / 3.0, CASE["Fz"])


def test_an_interval_of_stiffness_grows_as_a_whole(surrogate: Surrogate) -> None:
    ends = (0.8e6, 1.3e6)
    case = {**without(CASE, "k"), "k_low": ends[0], "k_high": ends[1]}
    law = friction_law(surrogate, "Fz", values=LOADS, stiffness_exponent=0.5, **case)
    scale = (LOADS / CASE["Fz"]) ** 0.5
    assert law.band is not None
    for i in (0, 20, 40):
        one = surrogate.evaluate(
            **{**case, "Fz": LOADS[i], "k_low": ends[0] * scale[i], "k_high": ends[1] * scale[i]}
        )
        assert law.band[0][i] == close(one.mu_macro_low, rel=1e-12)
        assert law.band[1][i] == close(one.mu_macro_high, rel=1e-12)
    solution = solve_for(surrogate, "Fz", 0.25, stiffness_exponent=0.5, **case)
    assert solution.ends is not None
    for k, end in zip(ends, solution.ends, strict=True):
        alone = solve_for(surrogate, "Fz", 0.25, stiffness_exponent=0.5, **{**CASE, "k": k})
        assert end.roots == alone.roots


@pytest.mark.parametrize("pair", PAIRS, ids=" ".join)
@settings(max_examples=25)
@given(
    log_v0=st.floats(-5.0, 0.5),
    m=st.floats(0.05, 0.95),
    log_load=st.floats(-3.0, 3.0),
    log_force=st.floats(-2.0, 3.0),
)
def test_the_forward_answer_is_inverted(
    surrogate: Surrogate, pair: Any, log_v0: float, m: float, log_load: float, log_force: float
) -> None:
    words, _, case = as_kind({**CASE, "v0": 10.0**log_v0}, pair)
    force = CASE["Fz"] * 10.0**log_force
    assume(force > 1.01 * case.get("Fz_amplitude", 0.0))
    at = {**case, "Fz": CASE["Fz"] * 10.0**log_load}  # where k holds
    forward: Any = surrogate.evaluate(**grown(at, m, force), **words)
    solution = solve_for(surrogate, "Fz", forward.mu_macro, **words, stiffness_exponent=m, **at)
    if solution.constant or not solution.roots[0]:
        edge = min(
            abs(forward.mu_macro - end) for end in (solution.reach.mu_min, solution.reach.mu_max)
        )
        assert edge <= 4.0 * forward.error_bound + 1e-9 * case["mu0"]
        return
    for root in solution.roots[0]:
        there = surrogate.evaluate(**grown(at, m, root.value), **words).mu_macro
        assert there == close(root.mu_macro, rel=1e-11)
        assert root.mu_macro == close(forward.mu_macro, rel=1e-9, abs=2.0 * forward.error_bound)
        assert root.low <= root.value <= root.high
    assert any(
        root.low * (1.0 - 1e-9) <= force <= root.high * (1.0 + 1e-9) for root in solution.roots[0]
    )


@pytest.mark.parametrize("m", EXPONENTS)
def test_a_fold_has_its_three_roots_stretched(surrogate: Surrogate, m: float) -> None:
    case = {**CASE, "v0": 1e-4}  # r = 2600
    for share in (0.002200, 0.002300, 0.5, 0.9):
        target = 0.3 * share
        plain = solve_for(surrogate, "Fz", target, **without(case, "Fz")).roots[0]
        stretched = solve_for(surrogate, "Fz", target, stiffness_exponent=m, **case).roots[0]
        assert len(plain) == len(stretched)
        # k/Fz is the same where Fz_given (Fz/Fz_given)^(1-m) is that of constant k
        for one, other in zip(plain, stretched, strict=True):
            same = case["Fz"] * (one.value / case["Fz"]) ** (1.0 / (1.0 - m))
            assert other.value == close(same, rel=1e-6)
    folded = solve_for(surrogate, "Fz", 0.3 * 0.0023, stiffness_exponent=m, **case)
    assert len(folded.roots[0]) == 3


@pytest.mark.parametrize("pair", PAIRS, ids=" ".join)
@pytest.mark.parametrize("v0", [1e-3, 0.05, 0.3])
def test_the_border_is_where_the_regime_changes(surrogate: Surrogate, pair: Any, v0: float) -> None:
    words, _, case = as_kind({**CASE, "v0": v0}, pair)
    loads = np.geomspace(max(1e-4, 1.001 * case.get("Fz_amplitude", 0.0)), 1e5, 5001)
    law = friction_law(surrogate, "Fz", values=loads, **words, stiffness_exponent=0.5, **case)
    regime = law.answer.regime
    changes = sum(
        np.count_nonzero((regime == name)[1:] != (regime == name)[:-1])
        for name in ("continuous", "reverse_slip")
    )
    assert len(law.border) == changes
    for mark in law.border:
        i = int(np.searchsorted(loads, mark.value))
        assert {regime[i - 1], regime[min(i, 5000)]} >= set(mark.regimes)


def test_approximations_follow_the_growing_stiffness(surrogate: Surrogate) -> None:
    law = friction_law(surrogate, "Fz", values=LOADS, stiffness_exponent=0.5, **CASE)
    approximate, speeds = approximations(surrogate, law), border_speeds(surrogate, law)
    inputs = {name: np.broadcast_to(x, LOADS.shape) for name, x in law.inputs.items()}
    for i in (3, 20, 33):
        five: Case = {name: float(x[i]) for name, x in inputs.items() if name != "v0"}
        one = friction_law(surrogate, "v0", values=np.array([CASE["v0"], 1.0]), **five)
        for name, column in approximations(surrogate, one).items():
            np.testing.assert_allclose(approximate[name][i], column[0], rtol=1e-9, err_msg=name)
        assert speeds["exact"][i] == close(border_speeds(surrogate, one)["exact"][0], rel=1e-9)


def test_a_rigid_contact_stays_rigid(surrogate: Surrogate) -> None:
    for k in ("rigid", math.inf):
        law = friction_law(
            surrogate, "Fz", values=LOADS, stiffness_exponent=0.5, **{**CASE, "k": k}
        )
        assert law.stiffening is None
        assert np.ptp(law.answer.mu_macro) == 0.0
        assert solve_for(surrogate, "Fz", 0.2, stiffness_exponent=0.5, **{**CASE, "k": k}).constant


@pytest.mark.parametrize("question", ["law", "solve_for"])
@pytest.mark.parametrize(
    ("along", "case", "options", "place"),
    [
        ("Fz", CASE, {}, "Fz"),
        ("Fz", without(CASE, "Fz"), {"stiffness_exponent": 0.5}, "Fz"),
        ("v0", without(CASE, "v0"), {"stiffness_exponent": 0.5}, "stiffness_exponent"),
        ("Fz", CASE, {"stiffness_exponent": 1.1}, "stiffness_exponent"),
        ("Fz", CASE, {"stiffness_exponent": "120 %"}, "stiffness_exponent"),
        ("Fz", CASE, {"stiffness_exponent": True}, "stiffness_exponent"),
        ("Fz", CASE, {"stiffness_exponent": -0.1}, "stiffness_exponent"),
        ("Fz", CASE, {"stiffness_exponent": math.nan}, "stiffness_exponent"),
        ("Fz", CASE, {"stiffness_exponent": "1/3"}, "stiffness_exponent"),
        ("Fz", CASE, {"stiffness_exponent": [0.5]}, "stiffness_exponent"),
        ("Fz", {**CASE, "Fz": 0.0}, {"stiffness_exponent": 0.5}, "Fz"),
        ("Fz", {**CASE, "Fz": [1.0, 2.0]}, {"stiffness_exponent": 0.5}, "Fz"),
    ],
)
def test_what_cannot_be_names_its_field(
    surrogate: Surrogate, question: str, along: str, case: Case, options: Any, place: str
) -> None:
    request: Any = friction_law if question == "law" else solve_for
    two = {"values" if question == "law" else "target": [0.1, 0.2]}
    with refused(place):
        request(surrogate, along, **two, **options, **case)


def test_a_stiffness_beyond_all_numbers_names_its_load(surrogate: Surrogate) -> None:
    far = {**CASE, "k": 1e300}
    with refused("Fz[1]"):
        friction_law(surrogate, "Fz", values=np.array([1.0, 1e200]), stiffness_exponent=0.9, **far)
    # and is not met in a search over all loads
    reach = solve_for(surrogate, "Fz", 0.2, stiffness_exponent=0.9, **far).reach
    assert 0.0 < reach.low < reach.high < math.inf


def test_borders_of_proportional_growth_are_none(surrogate: Surrogate) -> None:
    five = without({**CASE, "v0": 0.0710}, "Fz")
    law = friction_law(surrogate, "Fz", values=[1e-3, 1e3], stiffness_exponent=1.0, **five, Fz=10.0)
    assert law.border == ()


# --- what is said, command line, HTTP -------------------------------------------------------------


def test_the_model_line_says_whether_k_grows() -> None:
    five = without(CASE, "Fz")
    (row,) = load_notes("Fz", five)
    assert "constant over Fz" in row.text
    assert "and a stiffness exponent" in row.text
    (row,) = load_notes("Fz", five, "ball")
    assert "stiffness exponent" not in row.text
    (row,) = load_notes("Fz", five, "ball", Stiffening(1.0 / 3.0, 10.0))
    assert row.text == "k grows as Fz^0.333 from its value at Fz = 10 N"
    assert load_notes("v0", without(CASE, "v0")) == []
    assert (
        load_notes("Fz", {**five, "k": "rigid"}) == load_notes("Fz", {**five, "k": math.inf}) == []
    )


WORDS = "mu0=0.3 Fz=10N k=1N/um y0=2um omega=1.3e5 v0=1cm/s"
LAW = ("--along", "Fz", "0.1kN", "1kN", "--points", "3")


def run(capsys: Any, code: int, *words: str) -> str:
    assert main(words) == code
    printed = capsys.readouterr()
    return str(printed.err if code else printed.out)


def test_the_command_takes_the_load_at_which_k_holds(surrogate: Surrogate, capsys: Any) -> None:
    grows = ("--stiffness-exponent", "0.5")
    output = json.loads(run(capsys, 0, "law", WORDS, *LAW, *grows, "--json"))
    assert output["k"] == [close(1e6 * math.sqrt(x / 10.0), rel=1e-14) for x in output["values"]]
    law = friction_law(
        surrogate, "Fz", values=np.array(output["values"]), stiffness_exponent=0.5, **CASE
    )
    assert output["mu_macro"] == [close(x, rel=1e-13) for x in law.answer.mu_macro]
    assert "k grows as Fz^0.5" in output["model"][0]["text"]
    text = run(capsys, 0, "law", WORDS, *LAW, "--contact", "ball")
    assert "k [N/um]" in text
    assert text.splitlines()[-1].endswith("k grows as Fz^0.333 from its value at Fz = 10 N")
    constant = run(capsys, 0, "law", WORDS.replace("Fz=10N ", ""), *LAW)
    assert "constant over Fz" in constant
    assert "k [N" not in constant
    ask = ("solve-for", "Fz", WORDS, "--target", "0.25", *grows)
    (root,) = json.loads(run(capsys, 0, *ask, "--json"))["results"][0]["roots"]
    solution = solve_for(surrogate, "Fz", 0.25, stiffness_exponent=0.5, **CASE)
    assert root["value"] == close(solution.roots[0][0].value, rel=1e-12)
    assert "k grows as Fz^0.5" in run(capsys, 0, *ask)


def test_an_exponent_is_read_as_other_values_are(surrogate: Surrogate) -> None:
    exponents: list[Any] = ["50 %", 0.5]
    typed, number = (
        friction_law(surrogate, "Fz", values=LOADS, stiffness_exponent=m, **CASE).answer.mu_macro
        for m in exponents
    )
    assert (typed == number).all()

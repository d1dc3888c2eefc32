"""From SI inputs to dimensionless groups: legal values, messages for illegal values, and the ends
of the range."""

import inspect
import itertools
import math
import re
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mumacro import InputError, Surrogate, fit, law, solve_for
from mumacro.inputs.cases import DEVIATIONS
from mumacro.inputs.fields import BOUNDS, FIELDS, POSITIVE, STIFFNESS
from tests.support.cases import CASE, Case, log_uniform, tables, without
from tests.support.comparing import close
from tests.support.refusals import refused
from tests.support.settling import settling

positive = st.floats(
    min_value=5e-324, max_value=1.7976931348623157e308, allow_nan=False, allow_infinity=False
)
any_inputs = st.fixed_dictionaries(dict.fromkeys(FIELDS, positive))
table = tables(1e-10)


def exactly(numerator: list[float], denominator: list[float]) -> float:
    """The quotient of two products in rational arithmetic, rounded once."""
    value = math.prod(map(Fraction, numerator)) / math.prod(map(Fraction, denominator))
    try:
        return float(value)
    except OverflowError:
        return math.inf


def same_digits(value: Any, expected: float) -> bool:
    """Equal to a few rounding errors, or to the last digit of denormal numbers, or both
    infinite."""
    number = float(value)
    if math.isinf(expected) or math.isinf(number):
        return min(number, expected) > 1.797e308
    return abs(number - expected) <= 8e-16 * expected + 5e-324


# --- the groups -----------------------------------------------------------------------------------


@settings(max_examples=600)
@given(case=any_inputs)
@example(case=dict(zip(FIELDS, (1.0, 1e300, 1e300, 1e300, 1.0, 1e300), strict=True)))
@example(case=dict(zip(FIELDS, (1e-300, 1e-300, 1e-300, 1e-300, 1.0, 1e-300), strict=True)))
@example(case=dict(zip(FIELDS, (1e-5, 1e-310, 1e-300, 1e-15, 1e-20, 1e-300), strict=True)))
@example(case=dict(zip(FIELDS, (0.5, 1.0, 1e-320, 1.0, 1.0, 1.0), strict=True)))
@example(case=dict(zip(FIELDS, (0.5, 5e-324, 5e-324, 0.25, 1.0, 0.5), strict=True)))
@example(case=dict.fromkeys(FIELDS, 1e-200))
def test_groups_are_right_whatever_overflows_and_the_answer_is_finite(
    table: Surrogate, case: Case
) -> None:
    mu0, Fz, k, y0, omega, v0 = (case[name] for name in FIELDS)
    answer = table.evaluate(case)
    assert same_digits(answer.v_tilde, exactly([v0, k], [mu0, Fz, omega]))
    assert same_digits(answer.y_tilde, exactly([y0, k], [mu0, Fz]))
    assert same_digits(answer.length_scale, exactly([mu0, Fz], [k]))
    assert 0.0 <= answer.mu_ratio <= 1.0
    assert 0.0 <= answer.mu_macro <= mu0
    assert 0.0 <= answer.error_bound <= mu0  # a larger bound would be useless
    for columns in ({**case, "mu0": [mu0]}, {name: np.array([x]) for name, x in case.items()}):
        many = table.evaluate(columns, include="groups")
        for name in ("v_tilde", "y_tilde", "length_scale", "mu_ratio", "error_bound"):
            assert getattr(many, name)[0] == getattr(answer, name)


# --- edge cases of the answer ---------------------------------------------------------------------


@pytest.mark.parametrize(
    "stillness", [{"y0": 0.0}, {"omega": 0.0}, {"y0": 0.0, "omega": 0.0}, {"y0": 0.0, "v0": 0.0}]
)
@pytest.mark.parametrize("k", [1e6, "rigid", 5e-324, 1e308])
def test_no_oscillation_is_coulomb_friction(table: Surrogate, stillness: Case, k: Any) -> None:
    coulomb = table.evaluate(**{**CASE, **stillness, "k": k})
    answer = coulomb.mu_macro, coulomb.mu_ratio, coulomb.error_bound, coulomb.source
    assert answer == (CASE["mu0"], 1.0, 0.0, "no_oscillation")


@pytest.mark.parametrize("y", [1e-300, 0.3, 0.6, 0.999, 1.0, 1.2, 1e5, 1e300])
def test_no_drive_is_the_static_limit(table: Surrogate, y: float) -> None:
    answer = table.evaluate(mu0=0.5, Fz=2.0, k=1.0, y0=y, omega=7.0, v0=0.0)
    assert (answer.v_tilde, answer.y_tilde, answer.regime, answer.source) == (
        0.0,
        y,
        "static",
        "static_limit",
    )
    assert answer.mu_ratio == close(math.sqrt((1.0 - y) * (1.0 + y)) if y < 1.0 else 0.0, rel=5e-16)
    # the last digit of y~ = y0 k/(mu0 Fz) enters by its root only at the edge of the static limit
    assert 0.0 <= answer.error_bound < (1e-7 if y == 1.0 else 1e-12)


@pytest.mark.parametrize(
    ("inputs", "expected"),
    [
        # y~ underflows: no effect of the oscillation; y~ and v~ both overflow: only their ratio
        # matters
        ({"y0": 1e-300, "k": 1e-300, "Fz": 1e300}, 1.0),
        # r = 1: 1/AGM(1, sqrt 2)
        ({"y0": 1e200, "k": 1e200, "v0": 1e200, "omega": 1.0}, 0.8346268416740731),
        ({"y0": 1e300, "k": 1e300, "v0": 1e-300, "omega": 1e300}, 0.0),
        # v~ underflows: static limit at y~ = 1/3
        ({"v0": 5e-324, "omega": 1e300, "y0": 1e-6}, 0.9428090415820634),
        ({"v0": 1e300, "omega": 1e-300}, 1.0),
        # at rest: y~ overflows, or the contact is rigid
        ({"v0": 0.0, "Fz": 1e-300, "k": 1e300, "y0": 1.0}, 0.0),
        ({"v0": 0.0, "k": "rigid"}, 0.0),
    ],
)
def test_groups_that_leave_double_precision_have_their_limit(
    table: Surrogate, inputs: Case, expected: float
) -> None:
    answer = table.evaluate(**{**CASE, **inputs})
    assert abs(answer.mu_ratio - expected) <= answer.error_bound / CASE["mu0"] + 1e-15
    assert answer.mu_ratio == close(expected, rel=1e-12, abs=1e-280)
    assert answer.regime != "static" or expected in (0.0, 0.9428090415820634)


exponent = st.integers(min_value=-60, max_value=60)


@settings(max_examples=300)
@given(a=exponent, b=exponent, c=exponent, v=st.floats(1e-6, 1e6), y=st.floats(1e-6, 1e6))
def test_only_the_two_groups_matter(
    table: Surrogate, a: int, b: int, c: int, v: float, y: float
) -> None:
    """Scaling the inputs by powers of two at constant v~ and y~ does not change mu~, to the last
    digit."""
    plain = table.evaluate(mu0=0.5, Fz=2.0, k=1.0, y0=y, omega=1.0, v0=v)
    length, force, time = 2.0**a, 2.0**b, 2.0**c
    scaled = table.evaluate(
        mu0=0.5,
        Fz=2.0 * force,
        k=force / length,
        y0=y * length,
        omega=1.0 / time,
        v0=v * length / time,
    )
    assert (scaled.v_tilde, scaled.y_tilde) == (plain.v_tilde, plain.y_tilde) == (v, y)
    assert (scaled.mu_macro, scaled.source) == (plain.mu_macro, plain.source)
    assert scaled.length_scale == length * plain.length_scale
    swapped = table.evaluate(mu0=0.5 * force, Fz=2.0 / force, k=1.0, y0=y, omega=1.0, v0=v)
    assert swapped.mu_ratio == plain.mu_ratio


# --- illegal values and their messages ------------------------------------------------------------

BAD = [
    (field, bad)
    for field in FIELDS
    for bad in (-1.0, -5e-324, math.nan, math.inf, -math.inf)
    if (field, bad) != ("k", math.inf)
]


@pytest.mark.parametrize(("field", "bad"), BAD)
def test_illegal_value_is_named_with_field_and_bound(
    table: Surrogate, field: str, bad: float
) -> None:
    for case, index in (
        ({**CASE, field: bad}, None),
        ({**CASE, field: [CASE[field], bad, bad]}, 1),
    ):
        with pytest.raises(InputError) as caught:
            table.evaluate(case, gradient=True, illegal="raise")
        error = caught.value
        bound = STIFFNESS if field == "k" and math.isnan(bad) else BOUNDS[field]
        assert (error.field, error.index, error.bound) == (field, index, bound)
        assert repr(error.value) == repr(bad)
        where = "" if index is None else " at index 1"
        assert str(error) == f"{field}{where} must be {bound}, got {bad!r}"
        assert isinstance(error, ValueError)


@pytest.mark.parametrize(("field", "bad"), BAD)
@pytest.mark.parametrize("options", [{}, {"include": "groups"}, {"gradient": True}], ids=str)
def test_an_illegal_value_of_an_array_spoils_its_case(
    table: Surrogate, field: str, bad: float, options: Case
) -> None:
    column = [CASE[field], bad, CASE[field]]
    answer = table.evaluate(**{**CASE, field: column}, **options)
    sound = table.evaluate(**CASE, gradient=True)
    for name, none in (("source_code", -1), ("regime_code", -1), ("source", ""), ("regime", "")):
        assert getattr(answer, name).tolist() == [getattr(sound, name), none, getattr(sound, name)]
    numbers = [answer.mu_macro, answer.mu_ratio, answer.error_bound]
    if options:
        numbers += [answer.v_tilde, answer.y_tilde, answer.length_scale]
        assert answer.regime_certain.tolist() == [True, False, True]
    if "gradient" in options:
        numbers += [*answer.gradient.values(), *answer.gradient_bound.values()]
    for values in numbers:
        assert np.isnan(values).tolist() == [False, True, False]
        assert values[0] == values[2]
    # an illegal scalar together with an array makes every case illegal
    other = next(name for name in FIELDS if name != field)
    spoilt = table.evaluate(**{**CASE, field: bad, other: [CASE[other]] * 2}, **options)
    assert spoilt.source_code.tolist() == [-1, -1]


@pytest.mark.parametrize("field", FIELDS)
def test_zero_is_legal_only_where_documented(table: Surrogate, field: str) -> None:
    if field in POSITIVE:
        with pytest.raises(InputError, match=f"^{field} must be {BOUNDS[field]}, got 0.0$"):
            table.evaluate(**{**CASE, field: 0.0})
    else:
        zero, minus = (table.evaluate(**{**CASE, field: x}).mu_macro for x in (0.0, -0.0))
        assert math.isfinite(zero)
        assert zero == minus


# --- required inputs ------------------------------------------------------------------------------


@pytest.mark.parametrize("field", FIELDS)
def test_every_input_must_be_given(table: Surrogate, field: str) -> None:
    rest = without(CASE, field)
    remedy = {"omega": r", or f \[Hz\]", "k": ': .*"rigid" or math.inf'}.get(field, "")
    for cases, keywords in (((), rest), ((rest,), {})):
        with pytest.raises(InputError, match=f"^{field} must be given{remedy}"):
            table.evaluate(*cases, **keywords)


def test_all_that_is_missing_is_named_at_once(table: Surrogate) -> None:
    with pytest.raises(InputError) as caught:
        table.evaluate(mu0=0.3, v0=0.01)
    assert str(caught.value) == (
        "Fz must be given [N]; so must k [N/m], y0 [m], omega [rad/s] or f [Hz]"
    )
    with pytest.raises(InputError, match=r"^k must be given: .*; so must y0 \[m\]$"):
        table.evaluate(mu0=0.3, Fz=10.0, f=2e4, v0=0.01)


def test_the_frequency_is_given_once_as_omega_or_f(table: Surrogate) -> None:
    rest, frequency = without(CASE, "omega"), 2e4
    expected = table.evaluate(**rest, omega=2.0 * math.pi * frequency)
    assert table.evaluate(**rest, f=frequency).mu_macro == expected.mu_macro
    whole = table.evaluate(**rest, f=[frequency, -1.0, math.nan])
    assert whole.source_code.tolist() == [expected.source_code, -1, -1]
    assert whole.mu_macro[0] == expected.mu_macro
    with pytest.raises(InputError, match="not both"):
        table.evaluate(**CASE, f=frequency)
    with refused("omega"):
        table.evaluate(**rest, f=None, omega=None)
    for bad, index in ((x, i) for x in (-2e4, math.nan, math.inf) for i in (None, 1)):
        with pytest.raises(InputError) as caught:
            table.evaluate(**rest, f=[2e4, bad] if index else bad, illegal="raise")
        assert (caught.value.field, caught.value.index, repr(caught.value.value)) == (
            "f",
            index,
            repr(bad),
        )


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.int16, int])
def test_a_frequency_of_few_digits_is_taken_as_it_stands(table: Surrogate, kind: Any) -> None:
    """omega = 2 pi f is a double whatever the type of f, alone as in an array."""
    rest, frequency = without(CASE, "omega"), kind(20_000)
    alone = table.evaluate(**rest, f=frequency)
    assert alone.mu_macro == table.evaluate(**rest, f=float(frequency)).mu_macro
    assert alone.mu_macro == table.evaluate(**rest, f=np.array([frequency])).mu_macro[0]


def test_the_index_of_an_illegal_value_is_that_of_its_case(table: Surrogate) -> None:
    force = np.array([[10.0], [-1.0]])
    for v0, case in (([0.01, 0.02, 0.03], 3), (0.01, 1)):
        with pytest.raises(InputError) as caught:
            table.evaluate(**{**CASE, "Fz": force, "v0": v0}, illegal="raise")
        assert (caught.value.field, caught.value.value, caught.value.index) == ("Fz", -1.0, case)


def test_every_input_is_named_in_the_signature(table: Surrogate) -> None:
    named = inspect.signature(table.evaluate).parameters
    for name in (*FIELDS, "f", "Fz_amplitude", "k_low", "k_high", *DEVIATIONS):
        assert named[name].kind is inspect.Parameter.KEYWORD_ONLY
        assert repr(named[name].default) == "left out"


@pytest.mark.parametrize(
    ("former", "now"),
    [
        ({"k_range": (8e5, 1.2e6)}, "k_low and k_high"),
        ({"std": {"k": 1e5}}, "std_k"),
        ({"groups": True}, 'include="groups"'),
    ],
)
def test_a_former_name_is_told_the_new_one(table: Surrogate, former: Case, now: str) -> None:
    [name] = former
    for ask in (lambda: table.evaluate(**CASE, **former), lambda: table.evaluate(CASE | former)):
        with pytest.raises(InputError, match=re.escape(now)) as caught:
            ask()
        assert caught.value.field == name


def test_cases_and_keywords_go_together_without_overlap(table: Surrogate) -> None:
    rest: Any = without(CASE, "v0")
    expected = table.evaluate(**CASE).mu_macro
    with refused("note"):
        table.evaluate({**CASE, "note": "dry"})
    assert table.evaluate(rest, v0=CASE["v0"]).mu_macro == expected
    with refused("v0"):
        table.evaluate(CASE, v0=1.0)
    with refused("speed"):
        table.evaluate(**CASE, speed=1.0)  # type: ignore[call-overload]
    for bad in ([1.0], 3.0, "cases", object()):
        with refused("cases"):
            table.evaluate(bad)


@pytest.mark.parametrize("contact", ["spring", "ball"])
def test_arrays_by_keyword_and_in_a_mapping_have_the_same_bits(
    table: Surrogate, contact: str
) -> None:
    """Keywords take a shorter path than a mapping; numbers and arrays at both ends of the range
    are among them."""
    ends = (0.0, -0.0, -1.0, 5e-324, 1e-300, 1e300, 1.7e308, math.inf, math.nan)
    for name, other in itertools.permutations(CASE, 2):
        for array in ([CASE[name]], [CASE[name], 3.0 * CASE[name]], ends):
            for number in (CASE[other], 7, ends[0], *ends[-3:]):
                case = {**CASE, name: np.array(array), other: number}
                short = table.evaluate(**case, contact=contact)
                long = table.evaluate({**case, "contact": contact})
                for path in ("mu_macro", "mu_ratio", "error_bound", "source_code"):
                    assert getattr(short, path).tobytes() == getattr(long, path).tobytes()
                assert repr(short.cases) == repr(long.cases)


OPTIONS: dict[str, list[Any]] = {
    "gradient": ["yes", "", None, 1, [], np.ones(2)],
    "illegal": ["ignore", None, True, np.array(["nan", "raise"])],
    "include": [3, [None], ["power", 3], ["power", "Groups"], "groups,x"],
    "contact": [3, b"ball", np.ones(2), "cylinder"],
    "direction": [None, "down"],
}


@pytest.mark.parametrize(("name", "bad"), [(n, x) for n, xs in OPTIONS.items() for x in xs])
def test_a_bad_option_is_named(table: Surrogate, name: str, bad: Any) -> None:
    for k in (CASE["k"], np.array([1e6, 2e6])):
        with refused(name):
            table.evaluate(**{**CASE, "k": k, name: bad})


def test_rigid_is_given_as_the_word_or_infinity_in_numbers_and_in_arrays(table: Surrogate) -> None:
    expected = table.evaluate(**{**CASE, "k": "rigid"})
    assert expected.source == "rigid"
    assert table.evaluate(**{**CASE, "k": math.inf}).mu_macro == expected.mu_macro
    elastic = table.evaluate(**CASE)
    mixed = table.evaluate(**{**CASE, "k": [math.inf, CASE["k"], -1.0, math.inf]}, gradient=True)
    assert mixed.source.tolist() == ["rigid", elastic.source, "", "rigid"]
    assert mixed.mu_macro[[0, 1, 3]].tolist() == [
        expected.mu_macro,
        elastic.mu_macro,
        expected.mu_macro,
    ]
    assert mixed.length_scale[0] == 0.0
    assert mixed.gradient["k"][0] == 0.0
    assert table.evaluate(**{**CASE, "k": "rigid"}).mu_macro == expected.mu_macro
    worded = table.evaluate(**{**CASE, "k": ["Rigid", CASE["k"], math.nan]})
    assert worded.source.tolist() == ["rigid", elastic.source, ""]


@pytest.mark.parametrize("gap", [None, math.nan, "", "much"])
def test_a_gap_is_no_rigid_contact_and_the_remedy_is_told(table: Surrogate, gap: Any) -> None:
    message = "^k must be a number .*rigid"
    rest = without(CASE, "k", "v0")
    calls: list[Callable[[], Any]] = [
        lambda: table.evaluate(**{**CASE, "k": gap}),
        lambda: table.evaluate({**CASE, "k": gap}),
        lambda: settling(table, **{**CASE, "k": gap}),
        lambda: law(table, start=1e-3, stop=1e-2, **{**rest, "k": gap}),
        lambda: solve_for(table, "v0", 0.2, **{**rest, "k": gap}),
        lambda: fit(
            {"v0": [0.01, 0.02], "mu_macro": [0.2, 0.2]}, "mu0", k=gap, **without(rest, "mu0")
        ),
    ]
    for ask in calls:
        with pytest.raises(InputError, match=message):
            ask()
    series = pd.Series([0.01, 0.02])
    if gap is None:
        with pytest.raises(InputError, match=message):
            table.evaluate(**{**CASE, "k": gap, "v0": series})


# --- single cases without checks ----------------------------------------------------------


@pytest.mark.parametrize("n", [1, 255, 256, 1000])
def test_single_cases_equal_the_array(table: Surrogate, n: int) -> None:
    """Illegal cases too, and an infinite stiffness, which is a rigid contact."""
    rng = np.random.default_rng(n)
    ranges = ((0.1, 0.8), (0.1, 1e3), (1e4, 1e8), (1e-8, 1e-3), (1.0, 1e6), (1e-6, 10.0))
    columns = [log_uniform(rng, *ends, n) for ends in ranges]
    for column in columns[3:]:
        column[:: max(2, n // 7)] = 0.0
    columns[0][5::50], columns[1][6::50], columns[5][7::50], columns[2][8::50] = (
        -0.3,
        0.0,
        math.nan,
        math.inf,
    )
    for fixed in (None, 0, 2, 5):
        some: list[Any] = [c[:1].copy() if i == fixed else c for i, c in enumerate(columns)]
        answer = table.evaluate(dict(zip(FIELDS, some, strict=True)))
        macro, mu, bound, source = (
            answer.mu_macro,
            answer.mu_ratio,
            answer.error_bound,
            answer.source_code,
        )
        for i in range(0, n, 17):
            case = [float(c[i if c.size == n else 0]) for c in some]
            row = table.tabulated.one(case)
            np.testing.assert_array_equal(
                (row.mu_macro, row.mu_ratio, row.error_bound, row.source),
                (macro[i], mu[i], bound[i], source[i]),
            )


@pytest.mark.parametrize(
    ("name", "field", "words"),
    [
        ("y0", "y0", {}),
        ("f", "f", {}),
        ("Fz_amplitude", "Fz_amplitude", {"direction": "normal"}),
    ],
)
def test_a_contact_that_is_not_shaken_is_told(
    table: Surrogate, name: str, field: str, words: Any
) -> None:
    case: Any = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3, "v0": 0.01, **words}
    case["Fz_amplitude" if words else "y0"] = 1e-6
    [remark] = table.evaluate(**{**case, name: 0.0}).remarks
    assert (remark["row"], remark["field"], remark["cases"]) == ("model", field, 1)
    assert remark["text"] == f"{name} = 0: the contact is not shaken, mu_macro is mu0"
    swing = np.array([0.0, case[name], 0.0, -1.0])
    [remark] = table.evaluate(**{**case, name: swing}).remarks
    assert (remark["row"], remark["cases"]) == ("model", 2)


def test_an_output_that_was_not_asked_for_says_how_to_ask(table: Surrogate) -> None:
    case: Any = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3, "v0": 0.01, "y0": 1e-6}
    for v0 in (0.01, np.array([0.01, 0.02])):
        answer = table.evaluate(**{**case, "v0": v0})
        for name in ("power", "stick_fraction", "settling", "limits", "std"):
            with pytest.raises(AttributeError, match=rf'include=\("{name}",\)'):
                getattr(answer, name)
        assert not hasattr(answer, "friction")
        asked = table.evaluate(**{**case, "v0": v0}, include="power")
        with pytest.raises(AttributeError, match=r'an output is answer\["power"\]'):
            _ = asked.power

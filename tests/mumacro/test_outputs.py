"""Outputs by name: the same numbers for one case and for many, for one kind and for several, from
every entrance; deviations; what a kind does not have."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest

from mumacro import InputError, Surrogate, solve_for
from mumacro.inputs.cases import Cases, named
from mumacro.inputs.fields import KINDS, Kind
from mumacro.motions.element import Element
from mumacro.motions.motion import motion
from mumacro.outputs import MEMBERS, OUTPUTS
from mumacro.outputs.answer import TEXTS
from mumacro.outputs.evaluation import chosen
from tests.support.cases import CASE, Case, as_kind, every_pair, flat, tables, without
from tests.support.comparing import close
from tests.support.refusals import refused

table = tables(1e-10)
STD: Case = {"mu0": 0.01, "Fz": 0.5, "k": 5e4, "omega": 1e3, "v0": 1e-3}
N = 40


def names_for(kind: Kind) -> list[str]:
    """The outputs that a kind has, without std."""
    words = kind.names.values()
    return [
        name
        for name, output in OUTPUTS.items()
        if name != "std" and not any(word in output.lacks for word in words)
    ]


def draw(kind: Kind, n: int = N) -> Case:
    """Cases of a kind in columns: of every regime, rigid and at rest among them."""
    rng = np.random.default_rng(7)
    _, _, case = as_kind(CASE, (kind.names["contact"], kind.names["direction"]))
    columns = {name: np.full(n, x) for name, x in case.items()}
    columns["v0"] = 10.0 ** rng.uniform(-4.0, 1.0, n)
    columns["k"] *= 10.0 ** rng.uniform(-1.0, 1.0, n)
    columns["k"][::7] = math.inf
    columns["v0"][::11] = 0.0
    columns["omega"][::13] = 0.0
    return columns


def same(one: Any, other: Any) -> bool:
    return bool(one == other or (one != one and other != other))


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: " ".join(kind.names.values()))
def test_one_case_has_the_outputs_that_it_has_among_many(table: Surrogate, kind: Kind) -> None:
    columns, include = draw(kind), names_for(kind)
    many = table.evaluate(columns, **kind.names, include=include, std_mu0=0.01, std_v0=1e-3)
    assert set(many.outputs) <= {*MEMBERS}
    for i in range(0, N, 3):
        case = {name: float(x[i]) for name, x in columns.items()}
        one = table.evaluate(case, **kind.names, include=include, std_mu0=0.01, std_v0=1e-3)
        assert one.paths == many.paths
        for path in one.paths:
            assert type(one[path]) is (str if path in TEXTS else float), path
            assert same(one[path], many[path][i]) or one[path] == close(
                many[path][i], rel=1e-12, abs=1e-300
            ), (path, i)
        listed = many.to_dict()
        assert one.to_dict()["mu_macro"] == listed["mu_macro"][i]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: " ".join(kind.names.values()))
def test_one_interval_is_answered_in_plain_numbers(table: Surrogate, kind: Kind) -> None:
    _, _, case = as_kind(CASE, (kind.names["contact"], kind.names["direction"]))
    k = case.pop("k")
    interval = {"k_low": 0.8 * k, "k_high": 1.2 * k}
    answer = table.evaluate(case, **kind.names, **interval, include=names_for(kind))
    assert "mu_macro_low" in answer.paths
    for path in answer.paths:
        assert type(answer[path]) is (str if path in TEXTS else float), path


COLUMNS: dict[str, Callable[[list[Any]], Any]] = {
    "list": list,
    "array": np.array,
    "series": pd.Series,
    "categories": lambda words: pd.Series(pd.Categorical(words)),
    "arrow": lambda words: pytest.importorskip("pyarrow").array(words),
}


@pytest.mark.parametrize("form", COLUMNS)
def test_a_call_has_one_contact_and_one_direction(table: Surrogate, form: str) -> None:
    column, v0 = COLUMNS[form], COLUMNS[form]([0.01, 0.02])
    for name, words in (("contact", ["spring", "ball"]), ("direction", ["across", "along"])):
        one = table.evaluate({**CASE, "v0": v0, name: column(words[1:] * 2)})
        assert np.array_equal(
            one["mu_macro"], table.evaluate({**CASE, "v0": v0, name: words[1]})["mu_macro"]
        )
        policies: list[dict[str, Any]] = [{}, {"illegal": "raise"}]
        for more in policies:
            with pytest.raises(InputError, match="groupby") as caught:
                table.evaluate({**CASE, "v0": v0, name: column(words)}, **more)
            assert caught.value.field == name


def test_a_frame_of_several_contacts_is_split_as_it_is_told(table: Surrogate) -> None:
    frame = pd.DataFrame({**CASE, "contact": ["ball", "spring", "ball"]})
    frame["direction"], frame["Fz_amplitude"] = ["across", "normal", "along"], [math.nan, 3.0, None]
    frame.loc[1, "y0"] = math.nan
    parts = [
        table.evaluate(part)["mu_macro"] for _, part in frame.groupby(["contact", "direction"])
    ]
    for i, mu in pd.concat(parts).items():
        row = {name: x for name, x in frame.loc[i].items() if not pd.isna(x)}
        assert mu == table.evaluate(row).mu_macro


def test_the_amplitude_of_another_direction_has_no_value(
    table: Surrogate,
) -> None:
    frame = pd.DataFrame({**CASE, "Fz_amplitude": [math.nan, 3.0]})
    for cases in ({**CASE, "Fz_amplitude": 3.0}, frame):
        with refused("Fz_amplitude"):
            table.evaluate(cases)


def test_a_part_of_cases_is_answered_as_the_whole(table: Surrogate) -> None:
    columns = {**draw(KINDS[0]), "contact": "ball", "std_k": np.full(N, 1e5)}
    columns["v0"][5] = -1.0
    cases = Cases.of(named(None, columns))
    whole = table.answer(cases, (OUTPUTS["std"], OUTPUTS["power"]))
    for part in (slice(0, 7), slice(7, N)):
        answer = table.answer(cases.part(part), (OUTPUTS["std"], OUTPUTS["power"]))
        for path in whole.paths:
            np.testing.assert_array_equal(answer[path], whole[path][part])
    assert cases.reason(5).field == cases.part(slice(5, 6)).reason(0).field == "v0"


def test_a_part_of_cases_names_the_frequency_of_its_own_case() -> None:
    f = np.array([2e4, 3e4, -1.0, 4e4, -2.0])
    cases = Cases.of(named(None, {**without(CASE, "omega"), "f": f}))
    for i in (2, 4):
        error = cases.part(slice(i, i + 1)).reason(0)
        assert (error.field, error.value) == ("f", f[i])


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: " ".join(kind.names.values()))
@pytest.mark.parametrize("v0", [1e-4, 0.02, 5.0])
def test_limits_are_where_the_regime_changes_and_power_is_that_of_the_groups(
    table: Surrogate, kind: Kind, v0: float
) -> None:
    words = kind.names
    _, _, case = as_kind({**CASE, "v0": v0}, (words["contact"], words["direction"]))
    answer: Any = table.evaluate(case, **words, include=names_for(kind))
    for mark, speed in (("mu_static", 0.0), ("mu_crit", answer["limits.v0_crit"])):
        there = table.evaluate({**case, "v0": speed}, **words).mu_macro
        assert answer[f"limits.{mark}"] == close(there, rel=1e-14)
    for factor in (0.99, 1.01):
        beside = table.evaluate({**case, "v0": factor * answer["limits.v0_crit"]}, **words)
        assert (beside.regime == "continuous") == (factor > 1.0)
    if words["direction"] == "along":  # there the contact begins to slide backwards
        assert answer["limits.v0_crit"] == case["y0"] * case["omega"]
    if "power" in names_for(kind):
        groups, way = (answer.v_tilde, answer.y_tilde), case["Fz"] * v0
        unit = case["mu0"] * case["Fz"] * answer.length_scale * case["omega"]
        power, bound, _ = table.quantity("power", *groups, **words)
        assert answer["power.oscillation"] == close(power * unit, rel=1e-13, abs=1e-300)
        assert answer["power.saved"] == close((case["mu0"] - answer.mu_macro) * way, rel=1e-13)
        # a product that underflows is no bound of 0
        smallest = 2.0 * math.ulp(0.0)
        of_shaker = answer["power_bound.oscillation"]
        assert of_shaker == close(bound * unit, rel=1e-13, abs=smallest)
        of_drive = answer["power_bound.saved"]
        assert of_drive == close(answer.error_bound * way, rel=1e-2, abs=1e-14)


@pytest.mark.parametrize(
    ("change", "limits", "power"),
    [
        *(
            ({name: 0.0, **rest}, (0.3, 0.0, 0.3), 0.0)
            for name in ("y0", "omega")
            for rest in ({}, {"k": "rigid"})
        ),
        ({"k": "rigid", "v0": 0.0}, (0.0, 0.0, 0.0), 2.0 / math.pi * 3.0 * 2e-6 * 1.3e5),
    ],
)
def test_nothing_sticks_without_oscillation_or_k(
    table: Surrogate, change: Any, limits: Any, power: float
) -> None:
    answer = table.evaluate({**CASE, **change}, include="limits,power,stick_fraction")
    assert tuple(answer["limits"].values()) == limits
    assert (answer.mu_macro == 0.3) == (limits[0] == 0.3)
    assert answer["power.oscillation"] == close(power, rel=1e-14)
    assert answer["stick_fraction"] == answer["stick_fraction_bound"] == 0.0


@pytest.mark.parametrize("speed", [0.0, 1e-300, 1e-5, 0.1, 0.3, 0.999, 1.001, 30.0, 1e12, 1e200])
@pytest.mark.parametrize("contact", ["spring", "ball"])
@pytest.mark.parametrize("direction", ["across", "along"])
def test_the_power_of_a_rigid_contact_is_that_of_its_slip_and_the_limit_of_stiff_ones(
    table: Surrogate, direction: str, contact: str, speed: float
) -> None:
    peak = CASE["y0"] * CASE["omega"]
    case = {**CASE, "v0": speed * peak, "direction": direction, "contact": contact}
    rigid = table.evaluate({**case, "k": "rigid"}, include="power")
    velocity = np.cos(2.0 * math.pi * (np.arange(200_000) + 0.5) / 200_000)
    slip = np.hypot(velocity, speed) if direction == "across" else np.abs(velocity + speed)
    force = velocity if direction == "across" else velocity + speed
    mean = 3.0 * peak * np.mean(velocity * force / slip)
    assert rigid["power.oscillation"] == close(mean, rel=1e-6, abs=1e-4)
    assert rigid["power_bound.oscillation"] <= 1e-12 * rigid["power.oscillation"] + 1e-300
    stiff = table.evaluate({**case, "k": 1e14}, include="power")
    assert rigid["power.oscillation"] == close(stiff["power.oscillation"], rel=1e-4, abs=1e-4)
    assert table.evaluate({**case, "k": [math.inf]}, include="power")["power"] == {
        name: [value] for name, value in rigid["power"].items()
    }


@pytest.mark.parametrize("direction", ["across", "along"])
def test_the_power_of_a_rigid_contact_is_right_at_the_ends_of_double_range(
    table: Surrogate, direction: str
) -> None:
    rng = np.random.default_rng(3)
    ends = {"mu0": 300, "Fz": 300, "y0": 307, "omega": 307, "v0": 307}
    exponents = {name: rng.uniform(-end, end, 4000) for name, end in ends.items()}
    cases: dict[str, Any] = {name: 10.0**x for name, x in exponents.items()}
    cases["v0"][::5] = 0.0
    power = table.evaluate(cases, k=math.inf, direction=direction, include="power")
    mean, bound = power["power.oscillation"], power["power_bound.oscillation"]
    assert not np.isnan(mean).any()
    assert not np.isnan(bound).any()
    # where the drag is slow the force has the full size all the time
    whole: Any = sum(x for name, x in exponents.items() if name != "v0") + math.log10(2.0 / math.pi)
    slow = exponents["y0"] + exponents["omega"] - exponents["v0"] > 9.0
    there = (slow | (cases["v0"] == 0.0)) & (np.abs(whole) < 300.0)
    assert there.sum() > 500
    assert np.log10(mean[there]) == close(whole[there], abs=1e-9)
    assert (mean[slow & (whole < -330.0)] == 0.0).all()


# --- names ----------------------------------------------------------------------------------------


def test_outputs_are_found_by_their_path_or_as_a_whole(table: Surrogate) -> None:
    answer = table.evaluate(**CASE, include=("power", "groups"))
    assert answer["power"] == {
        "oscillation": answer["power.oscillation"],
        "saved": answer["power.saved"],
    }
    assert answer["mu_macro"] == answer.mu_macro
    assert answer["groups.l0"] == answer.length_scale
    with pytest.raises(KeyError, match="include"):
        answer["settling.periods"]
    assert (
        [*answer.to_frame()]
        == answer.paths
        == [*table.evaluate({**CASE, "v0": [0.01]}, include="groups, power").to_frame()]
    )


def test_a_choice_of_outputs_is_kept_once_however_often_their_names_are_said() -> None:
    one = Cases.of(CASE)
    kept = chosen(("power", "limits"), one)
    assert [output.name for output in kept] == ["limits", "power"]
    assert chosen(["limits", *["power"] * 1000], one) is kept


@pytest.mark.parametrize("include", [(), "groups", "power"])
def test_a_frequency_that_is_refused_is_named_with_every_output(
    table: Surrogate, include: Any
) -> None:
    for f in (-2e4, math.inf):
        with refused("f") as caught:
            table.evaluate(**{**without(CASE, "omega"), "f": f}, include=include)
        assert caught.value.value == f


def test_an_output_that_no_case_has_is_not_included(table: Surrogate) -> None:
    for v0 in (0.01, [0.01, 0.02]):
        with refused("include"):
            table.evaluate({**CASE, "v0": v0}, direction="along", include=["settling"])


@pytest.mark.parametrize("k", [math.inf, "rigid", [math.inf, math.inf]])
def test_rigid_contact_has_no_slope_along_k_however_it_is_asked_for(
    table: Surrogate, k: Any
) -> None:
    asked: list[Any] = [{"gradient": True}, {"include": "gradient"}, {"include": "gradient,power"}]
    for more in asked:
        answer: Any = table.evaluate(**{**CASE, "k": k}, **more)
        assert np.isnan(answer["gradient.k"]).all()
        assert np.isnan(answer["gradient_bound.k"]).all()
        assert np.isfinite(answer["gradient.v0"]).all()


# --- deviations -----------------------------------------------------------------------------------


@pytest.mark.parametrize("k", [CASE["k"], "rigid"])
def test_a_deviation_implies_std_to_first_order_with_shares(table: Surrogate, k: Any) -> None:
    answer = table.evaluate(**{**CASE, "k": k}, **flat(STD), gradient=True)
    parts = {
        name: 0.0 if (name, k) == ("k", "rigid") else answer.gradient[name] * x
        for name, x in STD.items()
    }
    assert answer["std"] == close(math.hypot(*parts.values()), rel=1e-12)
    bounds = (answer.gradient_bound[name] * x for name, x in STD.items())
    assert answer["std_bound"] == close(math.hypot(*bounds), rel=1e-12)
    for name, part in parts.items():
        assert answer[f"std_share.{name}"] == close((part / answer["std"]) ** 2, rel=1e-12)
    assert math.fsum(answer["std_share"].values()) == close(1.0, rel=1e-12)


def test_deviations_come_in_every_form(table: Surrogate) -> None:
    expected = table.evaluate(**CASE, std_k=1e5)["std"]
    case = without(CASE, "k")
    assert table.evaluate(k="1 ± 0.1 N/um", **case)["std"] == close(expected, rel=1e-12)
    assert table.evaluate({**CASE, "std_k": "0.1 N/um"})["std"] == expected
    frame = pd.DataFrame({**CASE, "std_k": [1e5, 0.0]})
    assert table.evaluate(frame)["std"].tolist() == [expected, 0.0]
    assert table.evaluate(frame.iloc[0])["std"] == expected
    by_f = table.evaluate(**CASE, std_f=1e3 / (2.0 * math.pi))
    assert by_f["std"] == close(table.evaluate(**CASE, std_omega=1e3)["std"], rel=1e-12)
    assert table.evaluate(**CASE, std_k=0.0)["std"] == 0.0


@pytest.mark.parametrize(
    ("std", "field"),
    [
        ({"std_k": -1.0}, "std_k"),
        ({"std_k": math.nan}, "std_k"),
        ({"std_k": "1 m"}, "std_k"),
        ({"std_speed": 1.0}, "std_speed"),
        ({"std_Fz_amplitude": 1.0}, "std_Fz_amplitude"),
        ({"std_omega": 1.0, "std_f": 1.0}, "std_f"),
    ],
)
def test_a_bad_deviation_is_named(table: Surrogate, std: Any, field: str) -> None:
    with refused(field):
        table.evaluate(**CASE, **std)


@pytest.mark.parametrize(
    "deviation", [{"std_mu0": 0.01}, {"mu0": "0.3 ± 0.01"}, {"f": "20 ± 1 kHz"}, {"std_f": [9.0]}]
)
@pytest.mark.parametrize("k", [{"k": "0.8..1.2 N/um"}, {"k_low": [8e5], "k_high": [1.2e6]}])
def test_a_deviation_beside_an_interval_of_k_is_told_by_its_own_name(
    table: Surrogate, deviation: Any, k: Case
) -> None:
    case = {**without(CASE, "k", "omega"), "f": 20e3, **deviation, **k}
    with refused(next(iter(deviation))):
        table.evaluate(**case)


def test_a_bad_deviation_spoils_its_case_alone(table: Surrogate) -> None:
    answer = table.evaluate({**CASE, "std_k": [1e5, -1.0, math.nan, 0.0]})
    assert np.isnan(answer["std"]).tolist() == [False, True, True, False]
    assert answer.source_code.tolist()[1:3] == [-1, -1]
    assert answer.cases.reason(1).field == "std_k"


def test_where_first_order_is_not_enough_is_told_for_one_case(table: Surrogate) -> None:
    straight = table.evaluate(**CASE, std_k=1e4)
    assert straight.remarks == []
    bent = table.evaluate(**CASE, std_k=6e5, std_mu0=0.01)
    [remark] = [remark for remark in bent.remarks if remark["row"] == "std"]
    assert (remark["field"], remark["cases"]) == ("k", 1)
    up, down = (table.evaluate(**{**CASE, "k": k}).mu_macro for k in (1.6e6, 4e5))
    slope = table.evaluate(**CASE, gradient=True).gradient["k"] * 6e5
    off = max(abs(up - bent.mu_macro - slope), abs(down - bent.mu_macro + slope))
    assert off > 0.2 * bent["std"]
    alone: Any = table.evaluate(**CASE, std_k=6e5)
    assert [alone.mu_macro_low, alone.mu_macro_high] == close(sorted((up, down)), rel=1e-12)
    [below] = table.evaluate(**CASE, std_v0=0.02).remarks  # v0 one deviation down is negative
    assert (below["row"], below["field"]) == ("std", "v0")
    load: Case = {**without(CASE, "y0"), "Fz_amplitude": 9.5, "direction": "normal"}
    for name in ("Fz", "Fz_amplitude"):
        [lifted] = table.evaluate({**load, f"std_{name}": 1.0}).remarks
        assert (lifted["row"], lifted["field"]) == ("std", name)
        assert "lifts off" in lifted["text"]


@every_pair
def test_the_band_of_columns_is_that_of_each_case(table: Surrogate, pair: Any) -> None:
    words, _, case = as_kind(CASE, pair)
    spreads = {f"std_{name}": np.array([0.0, 1e-3, 0.3, 2.0]) * x for name, x in case.items()}
    columns: Any = table.evaluate(**case, **words, **spreads)
    low, high = columns["mu_macro_low"], columns.mu_macro_high
    for i in range(low.size):
        one: Any = table.evaluate(**case, **words, **{name: x[i] for name, x in spreads.items()})
        assert (one.mu_macro_low, one.mu_macro_high) == close((low[i], high[i]), rel=1e-12)
    assert (low[0], high[0]) == (columns.mu_macro[0], columns.mu_macro[0])
    assert high[1] - low[1] == close(2.0 * columns["std"][1], rel=2e-2)
    assert (np.diff(low) <= 0.0).all()
    assert (np.diff(high) >= 0.0).all()
    assert (low >= 0.0).all()


@pytest.mark.parametrize(
    ("case", "name", "std"),
    [({**CASE, "v0": 0.2}, "v0", 0.16), ({**CASE, "v0": 0.05}, "omega", 0.4 * CASE["omega"])],
)
def test_where_the_curve_bends_on_one_side_alone_is_told(
    table: Surrogate, case: Case, name: str, std: float
) -> None:
    answer: Any = table.evaluate({**case, f"std_{name}": std}, gradient=True)
    up, down = (
        abs(table.evaluate(**{**case, name: case[name] + step}).mu_macro - answer.mu_macro - change)
        for step, change in ((x, x * answer.gradient[name]) for x in (std, -std))
    )
    assert up < 0.15 * answer["std"]
    assert down > 0.25 * answer["std"]
    assert [one["field"] for one in answer.remarks if one["row"] == "std"] == [name]


def test_what_computes_no_deviation_names_one(table: Surrogate) -> None:
    five, doubt = without(CASE, "v0", "mu0"), "0.3 ± 0.1"
    calls: list[tuple[str, Any]] = [
        ("mu0", lambda: solve_for(table, "v0", 0.2, mu0=doubt, **five)),
        ("mu0", lambda: motion(mu0=doubt, v0=0.01, y=2e-6, **without(five, "y0"))),
        ("mu0", lambda: Element(doubt, 10.0, 1e6)),
        ("std_mu0", lambda: solve_for(table, "v0", 0.2, mu0=0.3, std_mu0=0.1, **five)),
    ]
    for field, ask in calls:
        with refused(field):
            ask()

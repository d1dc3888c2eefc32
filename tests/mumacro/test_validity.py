"""What an answer says about the model: rows of docs/validity.md, effects, digits."""

import contextlib
import io
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mumacro import Surrogate
from mumacro.cli.main import main
from mumacro.inputs.cases import Cases
from mumacro.validity import ROWS, digits, effect_of, notes_of, rows_of
from tests.support.cases import Case
from tests.support.comparing import close
from tests.support.refusals import refused

CASE: Case = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "f": 20e3, "v0": 0.01}


def rows(surrogate: Surrogate, contact: str = "spring", **changed: Any) -> Any:
    """Text and effect by row."""
    rows_of_model = rows_of(surrogate.evaluate({**CASE, **changed}, contact=contact))
    assert [one["row"] for one in rows_of_model] == sorted(
        {one["row"] for one in rows_of_model}, key=ROWS.index
    )
    return {one["row"]: (one["text"], one["effect"]) for one in rows_of_model}


def test_rows_are_those_of_the_document(repository: Path) -> None:
    text = (repository / "docs" / "validity.md").read_text("utf-8")
    section = text.partition("\n## What it assumes\n")[2].partition("\n## ")[0]
    assert {*ROWS} <= {*re.findall(r"^\| ([^|]+?) \|", section, re.MULTILINE)}


def test_an_uncertain_stiffness_is_told_with_its_effect(surrogate: Surrogate) -> None:
    mu = surrogate.evaluate(**CASE).mu_macro
    off = [
        abs(surrogate.evaluate(**{**CASE, "k": 1e6 * x}).mu_macro / mu - 1.0)
        for x in (1.1, 1.0 / 1.1)
    ]
    text, effect = rows(surrogate)["k is known"]
    assert effect == close(max(off), rel=1e-9)
    assert f"{100.0 * effect:.2g} %" in text
    assert effect_of(surrogate.evaluate(CASE), uncertainty=1e-4) == close(
        1e-4 * abs(surrogate.evaluate(**CASE, gradient=True).gradient["k"]) * 1e6 / mu, rel=1e-3
    )
    # at a maximum over k the slope is zero, and the effect is not
    v0 = 2e-6 * 0.57 / 10.9 * 2.0 * math.pi * 20e3
    k = np.geomspace(5e6, 3e8, 20_001)
    top = float(k[surrogate.evaluate(**{**CASE, "v0": v0, "k": k}).mu_macro[5000:].argmax() + 5000])
    assert effect_of(surrogate.evaluate({**CASE, "v0": v0, "k": top})) > 1e-5
    assert effect_of(surrogate.evaluate({**CASE, "k": "rigid"})) == 0.0
    # mu_macro = 0 for every such k
    assert effect_of(surrogate.evaluate({**CASE, "y0": 20e-6, "v0": 0.0})) == 0.0
    # 0, and not 0 for a softer contact
    assert effect_of(surrogate.evaluate({**CASE, "y0": 3.1e-6, "v0": 0.0})) == math.inf


def test_amplitudes_beyond_those_of_contacts_ask_for_the_unit(surrogate: Surrogate) -> None:
    result = rows(surrogate, y0=2.0)
    assert list(result) == ["units"]
    assert "y0 = 2 m, usual is" in result["units"][0]
    assert "is k = 1e+12 in N/m?" in rows(surrogate, k=1e12)["units"][0]
    assert "is Fz = 1e-05 in N?" in rows(surrogate, Fz=1e-5)["units"][0]
    assert "units" not in rows(surrogate, y0=2e-2)  # y~ = 6667


TYPED = {
    ("f", "20000 kHz"): "is f = 20000 kHz right?",
    ("k", "0.001 N/mm"): "is k = 0.001 N/mm right?",
    ("v0", "1000000 mm/s"): "v0 = 1000000 mm/s, usual is up to 300 m/s: is it right?",
    ("mu0", "400 %"): "mu0 = 400 %, usual is 0.1 % to 200 %: is it right?",
    ("f", "2e7"): "is f = 20000000 in Hz?",
    ("y0", "2"): "y0 = 2 m, usual is 1 pm to 20 mm: is it in metres?",
}


@pytest.mark.parametrize(("name", "text"), TYPED)
def test_a_value_is_doubted_as_it_was_typed(surrogate: Surrogate, name: str, text: str) -> None:
    [remark] = surrogate.evaluate(**{**CASE, name: text}).remarks
    assert remark["field"] == name
    assert remark["text"].endswith(TYPED[name, text])
    words = printed({**CASE, name: text.replace(" ", "")})
    assert f"{name}: {remark['text']}" in words


def printed(case: Case, *options: str) -> str:
    """What the command prints of a case."""
    with contextlib.redirect_stdout(io.StringIO()) as output:
        assert main([" ".join(f"{name}={value}" for name, value in case.items()), *options]) == 0
    return output.getvalue()


@pytest.mark.parametrize("contact", ["spring", "ball"])
def test_an_assumption_is_called_by_its_contact(surrogate: Surrogate, contact: str) -> None:
    words = printed(CASE, "--contact", contact)
    shown = repr(surrogate.evaluate(**CASE, contact=contact)._repr_html_())
    for text in (words, shown):
        assert ("one spring: a ball on a flat" in text) is (contact == "spring")
        assert ("a ball: a flat contact" in text) is (contact == "ball")


def test_large_numbers_in_a_sentence_have_no_power_of_ten(surrogate: Surrogate) -> None:
    told = rows(surrogate, f=20e6)  # 41200 periods
    assert re.search(r"within \d{5} periods", told["steady cycle"][0])
    assert "contact turns 3000 W" in rows(surrogate, v0=1e3)["no wear, no heating"][0]


def test_creeping_and_rest_are_told(surrogate: Surrogate) -> None:
    text, _ = rows(surrogate, v0=1e-6)["steady cycle"]
    periods, seconds = (float(x) for x in re.findall(r"([\d.e+]+) (?:periods|s$)", text))
    assert periods == close(20e3 * seconds, rel=0.01)
    # l0 over the way of a period, times 2 ln 100
    assert periods == close(2.0 * math.log(100.0) * 3e-6 / (1e-6 / 20e3), rel=0.6)
    assert "largest force" in rows(surrogate, v0=0.0)["steady cycle"][0]
    assert "steady cycle" not in rows(surrogate, v0=0.1)


def test_slip_path_tilt_and_heat_have_their_sizes(surrogate: Surrogate) -> None:
    result = rows(surrogate, k=1.3e7, y0=5e-6, v0=0.01)
    way = 1e-6 * float(re.findall(r"contact slips ([\d.]+) um a", result["Coulomb friction"][0])[0])
    # the foot follows the motion but for l0 = 0.23 um at each turn
    assert way == close(4.0 * 5e-6, rel=0.1)
    assert result["Coulomb friction"][1] == close(0.01 * math.log(100.0) / 0.3, rel=1e-12)
    assert result["constant normal force"][1] == close(
        1.21 * 0.3 * 0.01 * 5e-6 / (3.0 / 1.3e7), rel=1e-12
    )
    watts = float(re.findall(r"turns ([\d.]+) W", result["no wear, no heating"][0])[0])
    assert watts == close(3.0 * way * 20e3, rel=0.1)
    assert "constant normal force" not in rows(surrogate)


@pytest.mark.parametrize("case", [{"y0": 0.0}, {"f": 0.0}, {"k": "rigid"}, {"k": math.inf}])
def test_nothing_is_said_where_nothing_oscillates_or_gives_way(
    surrogate: Surrogate, case: Case
) -> None:
    assert rows_of(surrogate.evaluate({**CASE, **case})) == []


def test_the_other_contact_is_told_with_the_difference(surrogate: Surrogate) -> None:
    case: Case = {"k": 1.307e7, "y0": 0.2e-6, "v0": 0.005}
    text, effect = rows(surrogate, **case)["one spring"]
    assert effect == close(0.2551 / 0.2477 - 1.0, abs=5e-4)
    assert "ball" in text
    assert rows(surrogate, "ball", **case)["one spring"][1] == close(
        0.2477 / 0.2551 - 1.0, abs=5e-4
    )


def test_digits_are_those_that_the_uncertainty_leaves() -> None:
    assert [digits(x) for x in (math.inf, 0.5, 0.06, 1e-3, 3e-4, 3e-5, 1e-9, 0.0)] == [
        4,
        4,
        4,
        4,
        5,
        6,
        6,
        6,
    ]
    assert digits(1e-9, most=12) == 10
    assert all(digits(x) >= digits(2.0 * x) for x in np.geomspace(1e-9, 1.0, 50))
    with refused("uncertainty"):
        digits(math.nan)


def test_what_is_said_of_one_case_is_not_said_of_several(surrogate: Surrogate) -> None:
    several = surrogate.evaluate({**CASE, "k": [1e6, 2e6]}, include="groups")
    for function in (rows_of, notes_of, effect_of):
        with refused("answer"):
            function(several)
    one = surrogate.evaluate({**CASE, "k": 2e6})
    assert effect_of(several, place=1) == effect_of(one)
    with refused("uncertainty"):
        effect_of(one, uncertainty=0.0)


@pytest.mark.parametrize("k", ["1 N/um ± 10 %", "0.9..1.1 N/um"])
def test_a_stiffness_with_its_uncertainty_is_not_asked_for(surrogate: Surrogate, k: str) -> None:
    answer: Any = surrogate.evaluate(**{**CASE, "k": k})
    known: Any = surrogate.evaluate(CASE)
    assert "k is known" not in {row["row"] for row in rows_of(answer)}
    assert "k is known" in {row["row"] for row in rows_of(known)}
    for text in (printed({**CASE, "k": k.replace(" ", "")}), answer._repr_html_()):
        assert "k is known" not in text
        assert "one spring" in text


@pytest.mark.parametrize("words", [{}, {"contact": "ball"}, {"direction": "along"}])
def test_what_is_said_of_an_evaluated_case_takes_no_second_evaluation(
    surrogate: Surrogate, monkeypatch: pytest.MonkeyPatch, words: Any
) -> None:
    evaluated = surrogate.evaluate(CASE, **words)
    expected = rows_of(evaluated), effect_of(evaluated)
    for name in ("evaluate", "answer"):
        monkeypatch.delattr(Surrogate, name)
    monkeypatch.delattr(Cases, "of")
    assert (rows_of(evaluated), effect_of(evaluated)) == expected
    assert evaluated._repr_html_()


@pytest.mark.parametrize("direction", ["along", "normal"])
def test_a_cycle_across_is_not_said_of_another_direction(
    surrogate: Surrogate, direction: str
) -> None:
    case = {**CASE, "v0": 1e-6, "k": 1.3e7, "y0": 5e-6}
    words = {"direction": direction}
    if direction == "normal":
        case = {name: x for name, x in case.items() if name != "y0"} | {"Fz_amplitude": 3.0}
    told = {row["row"] for row in rows_of(surrogate.evaluate({**case, **words}))}
    assert not told & {"steady cycle", "Coulomb friction", "no wear, no heating"}

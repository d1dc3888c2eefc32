"""``include=inputs``: what was understood of a request, beside its answer or its faults."""

import json
from typing import Any

import pytest

from tests.support.comparing import close
from tests.support.serving import CASE

TYPED = {**CASE, "k": "1 N/um", "y0": "2,5 µm", "include": ["inputs"]}


def without(*names: str, **more: Any) -> dict[str, Any]:
    return {name: x for name, x in TYPED.items() if name not in names} | more


QUESTIONS: dict[str, tuple[str, dict[str, Any], dict[str, Any]]] = {
    "case": ("mu-macro", TYPED, {"y0": 2.5e-6}),
    "law": (
        "law",
        without("v0", start="1 mm/s", stop="1 m/s", points=3),
        {"y0": 2.5e-6, "start": 1e-3, "stop": 1.0},
    ),
    "target": ("solve-for", without("y0", unknown="y0", target="15 %"), {"target": 0.15}),
    "target of a motion": (
        "solve-for",
        without("y0", "v0", unknown="v0", y="2um", target="15 %"),
        {"target": 0.15, "y": 2e-6},
    ),
    "motion": ("motion", without("y0", x="1um@90deg", y=["2 um", 30]), {"x": 1e-6, "y": 2e-6}),
}


@pytest.mark.parametrize("question", QUESTIONS)
def test_an_answer_says_what_was_understood(client: Any, question: str) -> None:
    path, body, numbers = QUESTIONS[question]
    answer = client.post(f"/v1/{path}", json=body)
    assert answer.status_code == 200, answer.text
    inputs = answer.json()["inputs"]
    for name, number in {**numbers, "k": 1e6}.items():
        text = body[name] if isinstance(body[name], str) else None
        assert (inputs[name]["text"], inputs[name]["value"]) == (text, close(number, rel=1e-15))
    assert inputs["k"]["unit"] == "N/um"


@pytest.mark.parametrize("question", QUESTIONS)
@pytest.mark.parametrize(
    "fault",
    [
        {"k": "1 N"},  # of one value
        {"omega": 1.0, "f": 20e3},  # of a relation, which the library finds
        {"speed": 1.0},  # of a name
    ],
)
def test_it_stands_beside_faults_too(client: Any, question: str, fault: dict[str, Any]) -> None:
    path, body, numbers = QUESTIONS[question]
    answer = client.post(f"/v1/{path}", json={**body, **fault})
    assert answer.status_code == 422, answer.text
    inputs = answer.json()["inputs"]
    assert ("k" in inputs) is ("k" not in fault)
    for name, number in numbers.items():
        assert inputs[name]["value"] == close(number, rel=1e-15)


def test_a_motion_shows_its_harmonics(client: Any) -> None:
    body = without("y0", x="2um, 3:0.5um@90deg", y=[{"amplitude": "1um", "phase": "30 deg"}])
    inputs = client.post("/v1/motion", json=body).json()["inputs"]
    assert inputs["x"]["harmonics"] == [
        {"harmonic": 1, "amplitude": 2e-6, "phase": 0.0},
        {"harmonic": 3, "amplitude": 5e-7, "phase": 90.0},
    ]
    assert inputs["y"]["harmonics"] == [{"harmonic": 1, "amplitude": 1e-6, "phase": 30.0}]


def test_an_interval_is_a_text_or_both_ends(client: Any) -> None:
    body = without("k", k_low="0.8 N/um", k_high=1.2e6)
    answer = client.post("/v1/mu-macro", json=body).json()
    right = client.post("/v1/mu-macro", json=without(k="0.8..1.2 N/um")).json()
    assert answer["mu_macro_low"] == right["mu_macro_low"] < answer["mu_macro"]
    assert (answer["inputs"]["k_low"]["value"], answer["inputs"]["k_low"]["unit"]) == (8e5, "N/um")
    ends = right["inputs"]["k"]["low"], right["inputs"]["k"]["high"]
    assert ends == close((0.8e6, 1.2e6), rel=1e-15)


@pytest.mark.parametrize("rows", [False, True])
def test_a_batch_is_not_told_what_was_understood(client: Any, rows: bool) -> None:
    query = "?include=inputs" if rows else ""
    sent = json.dumps([CASE] if rows else {**CASE, "include": ["inputs"]})
    answer = client.post(f"/v1/mu-macro/batch{query}", content=sent, headers=JSON)
    assert answer.status_code == 422
    assert [fault["field"] for fault in answer.json()["errors"]] == ["include"]


JSON = {"Content-Type": "application/json"}

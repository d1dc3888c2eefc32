"""Balls, other directions and intervals of k over HTTP: every form gives the library's answer, bit
for bit."""

import math
from typing import Any

import numpy as np
import pytest

from mumacro import Surrogate
from mumacro.outputs import OUTPUTS
from mumacro.stiffness import ARGUMENTS, GEOMETRIES
from mumacro.validity import digits, effect_of, rows_of
from tests.support.cases import Case

PATH, BATCH = "/v1/mu-macro", "/v1/mu-macro/batch"
V0 = [0.0, 1e-3, 0.02, 0.26, 3.0]
RIG: Case = {"mu0": 0.3, "Fz": 10.0, "omega": 1.3e5}
NORMAL = {"k": 1e6, "Fz_amplitude": 4.0}
ACROSS = {"k": 1e6, "y0": 2e-6}
ENDS = {"k_low": 0.8e6, "k_high": 1.3e6}
BALL = {"contact": "ball"}
CASES: dict[str, tuple[Case, Case]] = {
    "spring": ({}, ACROSS),
    "ball": (BALL, ACROSS),
    "rigid ball": (BALL, {"k": "rigid", "y0": 2e-6}),
    "along": ({"direction": "along"}, ACROSS),
    "ball along": ({**BALL, "direction": "along"}, ACROSS),
    "normal": ({"direction": "normal"}, NORMAL),
    "interval": ({}, {**ENDS, "y0": 2e-6}),
    "interval of a ball": (BALL, {**ENDS, "y0": 2e-6}),
    "interval, normal": ({"direction": "normal"}, {**ENDS, "Fz_amplitude": 4.0}),
}


@pytest.mark.parametrize("name", CASES)
def test_every_form_gives_the_librarys_answer(client: Any, surrogate: Surrogate, name: str) -> None:
    options, inputs = CASES[name]
    inputs = {**RIG, **inputs}
    case = {**inputs, "k": np.inf} if inputs.get("k") == "rigid" else inputs
    own = surrogate.evaluate(**case, v0=np.array(V0), **options)
    ends = ("mu_macro_low", "mu_macro_high") if "k_low" in inputs else ()
    names = ("mu_macro", "mu_ratio", "regime", "error_bound", "source", *ends)
    columns = {name: list(getattr(own, name)) for name in names}
    expected = [dict(zip(names, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    rows = [{**inputs, "v0": v0} for v0 in V0]

    answer = client.post(BATCH, json={**inputs, "v0": V0, **options}).json()
    assert {name: column for name, column in answer.items() if name in names} == columns
    answer = client.post(BATCH, json=rows, params=options).json()
    assert answer["results"] == expected

    one, of_query = {**rows[2], **options}, {**rows[2], **options}
    if ends:
        low, high = one["k_low"], one["k_high"]
        of_query = {name: x for name, x in of_query.items() if name not in ENDS} | {
            "k": f"{low}..{high}"
        }
    of_one = surrogate.evaluate(**{**case, "v0": V0[2]}, **options)
    alone = of_one.to_dict() | {"table": answer["table"], "api_version": "1"}
    assert {name: alone[name] for name in names} == {name: getattr(of_one, name) for name in names}
    assert client.post(PATH, json=one).json() == client.get(PATH, params=of_query).json() == alone
    assert float(client.get(f"{PATH}.txt", params=of_query).text) == of_one.mu_macro


#: beside those of every kind: at rest, without oscillation, at both ends of double range
PLACES: tuple[Case, ...] = (
    {"v0": 0.0},
    {"v0": 1e-4},
    {"v0": 5.0},
    {"y0": 0.0},
    {"omega": 0.0},
    {"v0": 5e-324, "y0": 1e-300},
    {"v0": 1e-9, "y0": 3e-6},  # the corner
)


def leaves_of(document: Case, path: str = "") -> Case:
    """Leaves of nested objects by their paths; JSON has no number that is not finite, and says
    null."""
    leaves: Case = {}
    for name, value in document.items():
        if isinstance(value, dict):
            leaves |= leaves_of(value, f"{path}{name}.")
        else:
            finite = not isinstance(value, float) or math.isfinite(value)
            leaves[path + name] = value if finite else None
    return leaves


@pytest.mark.parametrize("place", PLACES, ids=str)
@pytest.mark.parametrize("name", CASES)
def test_what_include_adds_is_the_librarys_in_every_form(
    client: Any, surrogate: Surrogate, name: str, place: Case
) -> None:
    options, inputs = CASES[name]
    of_kind = {word for word in ("y0", "Fz_amplitude") if word in inputs}
    case = {**RIG, "v0": 0.02, **inputs, **place}
    case = {key: x for key, x in case.items() if key not in {"y0", "Fz_amplitude"} - of_kind}
    include = [output for output, one in OUTPUTS.items() if not one.lacks.keys() & options.values()]
    if "k_low" in inputs:
        include.remove("std")
    std = {} if "std" not in include else {"std_v0": 1e-3, "std_mu0": 0.01}
    more = {**options, "include": include, **std}
    one = leaves_of(client.post(PATH, json={**case, **more}).json())
    own = leaves_of(surrogate.evaluate(**case, **more).to_dict())
    names = [path for path in own if not path.startswith("remarks")]
    assert len(names) > 15
    assert {path: one[path] for path in names} == {path: own[path] for path in names}
    query = {**options, "include": ",".join(include), **std}
    columns = client.post(BATCH, json={**case, "v0": [case["v0"]], **more}).json()
    listed = {path: value for path, value in leaves_of(columns).items() if path in names}
    assert listed == {path: [own[path]] for path in names}
    rows = client.post(BATCH, params=query, json=[case]).json()["results"]
    assert leaves_of(rows[0]) == {path: own[path] for path in names}


def test_bad_rows_spoil_only_themselves(client: Any) -> None:
    body = {
        **RIG,
        "y0": 2e-6,
        "v0": 0.01,
        "k_low": [8e5, None, 2e6, 1e6],
        "k_high": [1e6, 1e6, 1e6, "rigid"],
    }
    answer = client.post(BATCH, json=body).json()
    assert [mu is None for mu in answer["mu_macro_low"]] == [False, True, True, True]
    assert [fault["field"] for fault in answer["errors"]] == ["k_low", "k_low", "k_high"]
    body = {**RIG, "k": 1e6, "v0": 0.01, "Fz_amplitude": [3.0, 10.0], "direction": "normal"}
    answer = client.post(BATCH, json=body).json()
    assert answer["mu_macro"][0] is not None
    (fault,) = answer["errors"]
    assert (fault["index"], fault["field"]) == (1, "Fz_amplitude")
    assert "lifts off" in fault["reason"]


def test_what_the_model_leaves_out(client: Any, surrogate: Surrogate) -> None:
    case = {**RIG, **ACROSS, "v0": 0.02}
    answer = client.post(PATH, json={**case, "contact": "ball", "include": ["model"]}).json()
    evaluated = surrogate.evaluate(case, contact="ball")
    assert answer["model"] == rows_of(evaluated)
    assert answer["digits"] == digits(effect_of(evaluated))
    body = {**RIG, "y0": 2e-6, "k_low": 8e5, "k_high": 1.2e6, "v0": 0.02, "include": ["model"]}
    assert "k is known" not in [row["row"] for row in client.post(PATH, json=body).json()["model"]]


def test_a_law_has_a_band_and_an_inverse_its_contact(client: Any, surrogate: Surrogate) -> None:
    rig = {**RIG, "y0": 2e-6, "contact": "ball"}
    sweep = {"start": 1e-3, "stop": 1.0, "points": 5}
    law = client.post("/v1/law", json={**rig, "k_low": 8e5, "k_high": 1.2e6, **sweep}).json()
    own = surrogate.evaluate(**rig, k_low=8e5, k_high=1.2e6, v0=np.array(law["values"]))
    assert law["mu_macro_low"] == own.mu_macro_low.tolist()
    assert law["mu_macro_high"] == own.mu_macro_high.tolist()
    answer = client.post(
        "/v1/solve-for", json={**rig, "k": 1e6, "unknown": "v0", "target": 0.26}
    ).json()
    (root,) = answer["results"][0]["roots"]
    assert surrogate.evaluate(**rig, k=1e6, v0=root["value"]).mu_macro == root["mu_macro"]
    normal = {
        **RIG,
        "k": 1e6,
        "v0": 0.01,
        "direction": "normal",
        "along": "Fz_amplitude",
        "start": 0.1,
        "stop": 9.0,
    }
    law = client.post("/v1/law", json={**normal, "points": 3}).json()
    assert (law["unit"], len(law["mu_macro"])) == ("N", 3)


def test_the_service_takes_every_geometry_of_the_library(client: Any) -> None:
    schemas = client.get("/openapi.json").json()["components"]["schemas"]
    properties = schemas["StiffnessRequest"]["properties"]
    assert properties["geometry"]["enum"] == [*GEOMETRIES]
    assert {"geometry", "include", *ARGUMENTS} == properties.keys()


def test_a_diameter_stands_for_the_radius_and_a_large_length_is_doubted(
    client: Any, problem: Any
) -> None:
    body = {"geometry": "ball", "Fz": 10, "E": "210 GPa", "nu": 0.3}
    plain = client.post("/v1/stiffness", json={**body, "radius": "5 mm"}).json()
    assert client.post("/v1/stiffness", json={**body, "diameter": "10 mm"}).json() == plain
    assert not {"remarks", "inputs"} & plain.keys()
    large = {**body, "diameter": "10", "include": ["inputs"]}
    answer = client.post("/v1/stiffness", json=large).json()
    assert "is it 10 mm?" in answer["remarks"][0]["text"]
    assert answer["remarks"][0]["field"] == "diameter"
    assert answer["inputs"]["diameter"] == {"text": "10", "value": 10.0, "unit": "m"}
    assert answer["inputs"]["E"]["value"] == 210e9
    both = {**body, "radius": "5 mm", "diameter": "10 mm"}
    refusal = problem(client.post("/v1/stiffness", json=both), 422)
    assert [one["field"] for one in refusal["errors"]] == ["diameter"]
    refusal = problem(client.post("/v1/stiffness", json={**large, "diameter": "1 um"}), 422)
    assert "twice a radius" in refusal["detail"]
    assert refusal["inputs"]["diameter"]["value"] == 1e-6

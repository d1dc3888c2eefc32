"""Gradient and standard deviation: against finite differences, in every form, and how they are refused."""

import math

import pytest

PATH = "/v1/mu-macro"
STD = {"mu0": 0.01, "Fz": 0.5, "k": 5e4, "y0": 1e-7, "omega": 1e3, "v0": 1e-3}


def ask(client, case, **options):
    response = client.post(PATH, json={**case, **options})
    assert response.status_code == 200, response.text
    return response.json()


@pytest.mark.parametrize("v0", [1e-4, 0.01, 0.3, 5.0])
def test_the_gradient_is_the_slope_of_the_answer(client, case, v0):
    at = {**case, "v0": v0}
    gradient = ask(client, at, include=["gradient"])["gradient"]
    for name, value in at.items():
        step = 1e-5 * value
        above, below = (ask(client, {**at, name: value + s})["mu_macro"] for s in (step, -step))
        assert gradient[name] == pytest.approx((above - below) / (2 * step), rel=1e-5, abs=1e-7 / value)


def test_the_standard_deviation_is_the_root_of_squares(client, case):
    answer = ask(client, case, include=["gradient", "std"], std=STD)
    expected = math.sqrt(sum((answer["gradient"][name] * STD[name]) ** 2 for name in STD))
    assert answer["std"] == pytest.approx(expected, rel=1e-12)
    only = ask(client, case, include=["std"], std={"mu0": 0.01})
    assert "gradient" not in only
    assert only["std"] == pytest.approx(0.01 * abs(answer["gradient"]["mu0"]), rel=1e-12)
    assert ask(client, case, include=["std"], std={})["std"] == 0.0


def test_all_forms_give_the_same(client, case):
    options = {"include": ["gradient", "std"], "std": STD}
    single = ask(client, case, **options)
    query = {**case, "include": "gradient,std", **{f"std_{name}": value for name, value in STD.items()}}
    assert client.get(PATH, params=query).json() == single
    columns = client.post(f"{PATH}/batch", json={**case, "v0": [case["v0"], -1], **options}).json()
    assert columns["std"] == [pytest.approx(single["std"], rel=1e-12), None]
    for name, slope in single["gradient"].items():
        assert columns["gradient"][name] == [pytest.approx(slope, rel=1e-12), None]
    asked = {name: value for name, value in query.items() if name not in case}
    (row,) = client.post(f"{PATH}/batch", params=asked, json=[case]).json()["results"]
    assert row["std"] == pytest.approx(single["std"], rel=1e-12)


def test_rigid_contact_has_no_slope_in_k(client, case):
    rigid = {**case, "k": None}
    answer = ask(client, rigid, include=["gradient", "std"], std=STD)
    assert answer["gradient"]["k"] is None
    expected = math.sqrt(sum((answer["gradient"][name] * STD[name]) ** 2 for name in STD if name != "k"))
    assert answer["std"] == pytest.approx(expected, rel=1e-12)
    both = client.post(f"{PATH}/batch", json={**case, "k": [None, 1e6], "include": ["gradient"]}).json()
    assert [slope is None for slope in both["gradient"]["k"]] == [True, False]


def test_an_entity_tag_follows_the_standard_deviations(client, case):
    query = {**case, "include": "std", "std_mu0": 0.01}
    tags = {client.get(PATH, params={**query, "std_mu0": value}).headers["etag"] for value in (0.01, 0.02)}
    assert len(tags) == 2


@pytest.mark.parametrize(
    ("options", "pointer"),
    [
        ({"include": ["std"]}, "#/std"),
        ({"std": STD}, "#/std"),
        ({"include": ["groups"], "std": {}}, "#/std"),
        ({"include": ["std"], "std": {"mu0": -1}}, "#/std/mu0"),
        ({"include": ["std"], "std": {"mu0": "0.1"}}, "#/std/mu0"),
        ({"include": ["std"], "std": {"speed": 1}}, "#/std/speed"),
        ({"include": ["std"], "std": [1, 2]}, "#/std"),
    ],
)
def test_standard_deviations_go_with_the_wish_for_them(client, case, problem, options, pointer):
    (fault,) = problem(client.post(PATH, json={**case, **options}), 422)["errors"]
    assert fault["pointer"] == pointer
    problem(client.post(f"{PATH}/batch", json={**case, "v0": [0.1, 0.2], **options}), 422)


@pytest.mark.parametrize(
    ("query", "parameter"),
    [({"include": "std"}, "std_mu0"), ({"std_v0": 1}, "std_mu0"), ({"include": "std", "std_v0": -1}, "std_v0")],
)
def test_a_query_is_held_to_the_same(client, case, problem, query, parameter):
    (fault,) = problem(client.get(PATH, params={**case, **query}), 422)["errors"]
    assert fault["parameter"] == parameter
    problem(client.post(f"{PATH}/batch", params=query, json=[case]), 422)

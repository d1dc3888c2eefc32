"""``/v1/solve-for``, ``/v1/law`` and ``/v1/law.csv`` over HTTP: values, formats, and refusals."""

import csv
import io
import json
import math

import pytest

from comparing import close
from mumacro.law import APPROXIMATIONS, BORDERS

CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
SOLVE = {"unknown": "y0", "target": 0.15, **{name: value for name, value in CASE.items() if name != "y0"}}
LAW = {"start": 1e-4, "stop": 10.0, "points": 33, **{name: value for name, value in CASE.items() if name != "v0"}}


def law_query(**changed):
    return {name: repr(value) if isinstance(value, float) else value for name, value in {**LAW, **changed}.items()}


def test_a_root_gives_its_target_back(client):
    answer = client.post("/v1/solve-for", json=SOLVE).json()
    assert answer.keys() == {"unknown", "unit", "quantity", "range", "reachable", "results", "table", "api_version"}
    assert (answer["unknown"], answer["unit"], answer["api_version"]) == ("y0", "m", "1")
    ((root,),) = [result["roots"] for result in answer["results"]]
    assert root.keys() == {"value", "low", "high", "mu_macro", "regime"}
    forward = client.post("/v1/mu-macro", json={**CASE, "y0": root["value"]}).json()
    assert forward["mu_macro"] == root["mu_macro"]
    assert root["mu_macro"] == close(0.15, rel=1e-14)
    assert forward["regime"] == root["regime"]
    assert root["low"] < root["value"] < root["high"] < (1.0 + 1e-9) * root["low"]


def test_targets_keep_their_order_and_unreachable_ones_have_a_reason(client):
    targets = [0.25, 0.1, 0.29, 0.4]
    request = {**SOLVE, "unknown": "v0", "target": targets, "y0": CASE["y0"], "v0": None}
    answer = client.post("/v1/solve-for", json=request).json()
    assert [result["target"] for result in answer["results"]] == targets
    assert [len(result["roots"]) for result in answer["results"]] == [1, 0, 1, 0]
    reach = answer["reachable"]
    assert reach["min"] == close(0.3 * math.sqrt(5) / 3, rel=1e-9)
    assert (reach["max"], reach["min_included"], reach["max_included"]) == (0.3, True, False)
    assert "reason" not in answer["results"][0]
    for i in (1, 3):
        assert str(reach["min"]) in answer["results"][i]["reason"]
        assert "reachable" in answer["results"][i]["reason"]


def test_an_input_without_influence_is_reported(client):
    request = {**SOLVE, "unknown": "v0", "y0": 0.0, "v0": None}
    (result,) = client.post("/v1/solve-for", json=request).json()["results"]
    assert result["roots"] == []
    assert "no influence" in result["reason"]


def test_folded_roots_are_all_returned_within_the_range(client):
    request = {**SOLVE, "unknown": "k", "target": 0.3 * 0.0023, "v0": 1e-4, "y0": CASE["y0"], "k": None}
    roots = client.post("/v1/solve-for", json=request).json()["results"][0]["roots"]
    assert len(roots) == 3
    values = [root["value"] for root in roots]
    answer = client.post("/v1/solve-for", json={**request, "range": [0.5 * values[0], 2.0 * values[0]]}).json()
    assert [root["value"] for root in answer["results"][0]["roots"]] == [close(values[0], rel=1e-9)]
    assert answer["range"] == [0.5 * values[0], 2.0 * values[0]]


def test_a_tolerance_picks_the_table(client, app):
    for table in app.state.tables.loaded:
        for path, body in (("/v1/solve-for", SOLVE), ("/v1/law", LAW)):
            answer = client.post(path, json={**body, "tolerance": table.surrogate.tolerance}).json()
            assert answer["table"]["tolerance"] == table.surrogate.tolerance


@pytest.mark.parametrize(
    ("changed", "field"),
    [({"unknown": "w0"}, "unknown"), ({"unknown": None}, "unknown"), ({"y0": 1e-6}, "y0"), ({"mu0": None}, "mu0"),
     ({"target": -0.1}, "target"), ({"target": []}, "target"), ({"target": "0.1"}, "target"),
     ({"target": True}, "target"),
     ({"target": [0.1, "x"]}, "target"), ({"target": [0.1] * 10_001}, "target"),
     ({"Fz": 0}, "Fz"), ({"Fz": "10"}, "Fz"),
     ({"range": [1]}, "range"), ({"range": [2, 1]}, "range"), ({"range": [0, -1]}, "range"), ({"extra": 1}, "extra"),
     ({"tolerance": 1e-30}, "tolerance"), ({"omega": -1}, "omega")],
)  # fmt: skip
def test_a_bad_question_is_refused_by_field(client, problem, changed, field):
    document = problem(client.post("/v1/solve-for", json={**SOLVE, **changed}), 422)
    assert document["errors"][0]["field"] == field
    assert document["errors"][0]["pointer"].startswith(f"#/{field}")
    assert document["errors"][0]["reason"]


@pytest.mark.parametrize("path", ["/v1/solve-for", "/v1/law"])
def test_a_body_with_wrong_fields_is_refused(client, problem, path):
    for body, status in ((b"", 400), (b"{", 400), (b"[]", 422), (b"3", 422), (b"{}", 422)):
        problem(client.post(path, content=body), status)
    problem(client.post(path, content=b'{"target": NaN, "start": NaN}'), 422)
    problem(client.post(path, content=b"{}", headers={"Content-Type": "text/plain"}), 415)
    problem(client.post(f"{path}?mu0=1", json=SOLVE), 422)


def test_every_fault_is_listed_once(client, problem):
    document = problem(client.post("/v1/solve-for", json={**SOLVE, "Fz": -1, "mu0": "x", "target": "y"}), 422)
    assert sorted(error["field"] for error in document["errors"]) == ["Fz", "mu0", "target"]


def test_a_law_is_single_answers_in_a_row(client):
    law = client.post("/v1/law", json=LAW).json()
    assert law["along"] == "v0"
    assert law["unit"] == "m/s"
    assert (law["values"][0], law["values"][-1], len(law["values"])) == (1e-4, 10.0, 33)
    for i in (0, 16, 32):
        alone = client.post("/v1/mu-macro", json={**CASE, "v0": law["values"][i]}).json()
        for name in ("mu_macro", "mu_ratio", "regime", "error_bound", "source"):
            expected = close(alone[name], rel=1e-14) if name.startswith("mu") else alone[name]
            assert law[name][i] == expected
    limits = client.post("/v1/mu-macro", json={**CASE, "include": ["limits"]}).json()["limits"]
    (border,) = law["border"]
    assert border["value"] == close(limits["v0_crit"], rel=1e-9)
    assert border["mu_macro"] == close(limits["mu_crit"], rel=1e-9)
    assert law["mu_static"] == [close(limits["mu_static"], rel=1e-14)] * 33
    assert "approximations" not in law


def test_an_integer_may_be_written_with_a_decimal_point(client, problem):
    body = json.dumps({**LAW, "points": 5}).replace('"points": 5', '"points": 5.0')
    assert len(client.post("/v1/law", content=body).json()["values"]) == 5
    for bad in (5.5, True, "5", 1e30):
        problem(client.post("/v1/law", json={**LAW, "points": bad}), 422)


@pytest.mark.parametrize("along", ["mu0", "Fz", "k", "y0", "omega"])
def test_a_law_goes_along_any_input(client, along):
    request = {
        **CASE,
        "along": along,
        "start": 0.1 * CASE[along],
        "stop": 10 * CASE[along],
        "scale": "linear",
        along: None,
    }
    law = client.post("/v1/law", json={**request, "include": ["approximations"]}).json()
    assert len(law["values"]) == 201
    assert law["approximations"].keys() == set(APPROXIMATIONS)
    assert law["border_speeds"].keys() == set(BORDERS)
    assert all(len(column) == 201 for column in law["approximations"].values())
    middle = client.post("/v1/mu-macro", json={**CASE, along: law["values"][77]}).json()
    assert law["mu_macro"][77] == close(middle["mu_macro"], rel=1e-14)


def test_an_approximation_outside_its_range_is_null(client):
    text = client.post("/v1/law", json={**LAW, "y0": 1e-5, "include": ["approximations"]}).text
    law = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))
    assert set(law["approximations"]["small_amplitude"]) == {None}


def test_the_table_for_spreadsheets_is_the_law(client):
    law = client.post("/v1/law", json={**LAW, "include": ["approximations"]}).json()
    response = client.get("/v1/law.csv", params=law_query(include="approximations"))
    assert response.headers["content-type"].startswith("text/csv")
    assert 'filename="friction-law-v0.csv"' in response.headers["content-disposition"]
    header, *rows = csv.reader(io.StringIO(response.text))
    assert header == [
        "v0 [m/s]", "mu_macro [-]", "mu_ratio [-]", "error_bound [-]", "mu_static [-]",
        *(f"{name} [-]" for name in APPROXIMATIONS), *(f"border_{name} [m/s]" for name in BORDERS), "regime", "source",
    ]  # fmt: skip
    assert [float(row[0]) for row in rows] == law["values"]
    assert [float(row[1]) for row in rows] == law["mu_macro"]
    assert [row[-2] for row in rows] == law["regime"]
    expected = ["" if value is None else repr(value) for value in law["approximations"]["corner"]]
    assert [row[header.index("corner [-]")] for row in rows] == expected
    assert [float(row[header.index("border_exact [m/s]")]) for row in rows] == law["border_speeds"]["exact"]
    assert response.text.count("\r\n") == 34


def test_the_table_for_spreadsheets_has_what_is_included(client):
    law = client.post("/v1/law", json={**LAW, "include": ["power"]}).json()
    header, *rows = csv.reader(io.StringIO(client.get("/v1/law.csv", params=law_query(include="power")).text))
    assert [float(row[header.index("power.saved [W]")]) for row in rows] == law["power"]["saved"]


def test_a_head_of_the_table_has_no_body(client):
    response = client.head("/v1/law.csv", params=law_query())
    assert (response.status_code, response.content) == (200, b"")


@pytest.mark.parametrize(
    ("changed", "field"),
    [({"along": "x"}, "along"), ({"start": 0.0}, "start"), ({"start": 20.0}, "stop"), ({"stop": 0.0}, "stop"),
     ({"points": 1}, "points"), ({"points": 10_002}, "points"), ({"scale": "cubic"}, "scale"), ({"v0": 0.01}, "v0"),
     ({"mu0": -1.0}, "mu0"), ({"include": ["curvature"]}, "include"), ({"extra": 1.0}, "extra")],
)  # fmt: skip
def test_a_bad_law_is_refused_by_field(client, problem, changed, field):
    document = problem(client.post("/v1/law", json={**LAW, **changed}), 422)
    assert document["errors"][0]["pointer"].startswith(f"#/{field}")
    query = law_query(
        **{name: ",".join(value) if isinstance(value, list) else value for name, value in changed.items()}
    )
    document = problem(client.get("/v1/law.csv", params=query), 422)
    assert document["errors"][0]["parameter"] == field


def test_a_query_has_each_parameter_once_and_as_a_number(client, problem):
    pairs = [*law_query().items(), ("mu0", "0.4")]
    assert problem(client.get("/v1/law.csv", params=pairs), 422)["errors"][0]["parameter"] == "mu0"
    for bad in ("", "ten", "nan", "inf", "1e999", "0x10", "1_000"):
        assert problem(client.get("/v1/law.csv", params=law_query(Fz=bad)), 422)["errors"][0]["parameter"] == "Fz"
    missing = {name: value for name, value in law_query().items() if name != "omega"}
    assert problem(client.get("/v1/law.csv", params=missing), 422)["errors"][0]["parameter"] == "omega"

"""One case over HTTP: values, includes, limits, caching, and refusals."""

import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from comparing import close

DEFAULT = {"mu_macro", "mu_ratio", "regime", "error_bound", "source", "table", "api_version"}
PATH = "/v1/mu-macro"

positive = st.floats(min_value=1e-300, max_value=1e300)
not_negative = st.just(0.0) | positive
cases = st.fixed_dictionaries(
    {"mu0": positive, "Fz": positive, "k": positive | st.none(), "y0": not_negative, "omega": not_negative,
     "v0": not_negative}
)  # fmt: skip


def finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def test_a_default_answer_has_only_the_requested_fields(client, case, surrogate):
    answer = client.post(PATH, json=case).json()
    assert answer.keys() == DEFAULT
    assert answer["table"] == {"id": surrogate.id, "tolerance": surrogate.tolerance}
    assert answer["api_version"] == "1"
    assert answer["regime"] in ("continuous", "stick_slip", "static")


def test_get_and_post_agree(client, case):
    assert client.get(PATH, params=case).json() == client.post(PATH, json=case).json()


@settings(max_examples=300, deadline=None)
@given(given_case=cases)
def test_the_answer_is_the_surrogates(client, surrogate, given_case):
    response = client.post(PATH, json=given_case)
    assert response.status_code == 200, response.text
    answer = response.json()
    expected = surrogate.evaluate(**given_case)
    for name in ("mu_macro", "mu_ratio", "error_bound"):
        assert answer[name] == finite(getattr(expected, name))
    assert (answer["regime"], answer["source"]) == (expected.regime, expected.source)
    assert 0.0 <= answer["mu_ratio"] <= 1.0
    query = {name: "rigid" if value is None else repr(value) for name, value in given_case.items()}
    assert client.get(PATH, params=query).json() == answer


@settings(max_examples=200, deadline=None)
@given(given_case=cases)
def test_everything_included_is_json(client, given_case):
    response = client.post(PATH, json={**given_case, "include": ["groups", "limits"]})
    assert response.status_code == 200, response.text
    answer = json.loads(response.text, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))
    assert answer.keys() == DEFAULT | {"groups", "limits"}
    assert answer["groups"].keys() == {"v_tilde", "y_tilde", "l0"}
    assert answer["limits"].keys() == {"mu_static", "v0_crit", "mu_crit"}


@pytest.mark.parametrize("at_rest", [{"y0": 0}, {"omega": 0}, {"y0": 0, "k": None}, {"omega": 0, "k": None}])
def test_without_oscillation_friction_is_coulombs(client, case, at_rest):
    answer = client.post(PATH, json={**case, **at_rest, "include": ["limits"]}).json()
    assert answer["mu_macro"] == case["mu0"]
    assert answer["limits"] == {"mu_static": case["mu0"], "v0_crit": 0.0, "mu_crit": case["mu0"]}


@pytest.mark.parametrize(("y0", "expected"), [(2e-6, 0.3 * math.sqrt(1 - 4 / 9)), (4e-6, 0.0)])
def test_the_static_limit_is_what_v0_zero_gives(client, case, y0, expected):
    answer = client.post(PATH, json={**case, "y0": y0, "v0": 0, "include": ["limits"]}).json()
    assert answer["mu_macro"] == close(expected, rel=1e-12, abs=1e-300)
    assert answer["limits"]["mu_static"] == close(expected, rel=1e-12, abs=1e-300)
    assert answer["regime"] == "static"


@pytest.mark.parametrize("y0", [3e-8, 2e-6, 3e-6, 3e-5, 3e-3])
def test_the_border_lies_on_the_friction_law(client, case, y0):
    asked = {**case, "y0": y0}
    limits = client.post(PATH, json={**asked, "include": ["limits"]}).json()["limits"]
    there = client.post(PATH, json={**asked, "v0": limits["v0_crit"]}).json()
    assert there["mu_macro"] == close(limits["mu_crit"], rel=1e-9)
    assert limits["mu_static"] <= limits["mu_crit"] <= case["mu0"]
    for factor, regime in ((0.99, "stick_slip"), (1.01, "continuous")):
        assert client.post(PATH, json={**asked, "v0": factor * limits["v0_crit"]}).json()["regime"] == regime


def test_groups_are_the_dimensionless_inputs(client, case):
    groups = client.post(PATH, json={**case, "include": ["groups"]}).json()["groups"]
    l0 = 0.3 * 10 / 1e6
    assert groups["l0"] == close(l0, rel=1e-14)
    assert groups["y_tilde"] == close(2e-6 / l0, rel=1e-14)
    assert groups["v_tilde"] == close(0.01 / (l0 * 1.3e5), rel=1e-14)


def test_rigid_contact_is_stated_and_never_assumed(client, case, problem):
    null = client.post(PATH, json={**case, "k": None}).json()
    assert client.post(PATH, json={**case, "k": "rigid"}).json() == null
    assert client.get(PATH, params={**case, "k": "rigid"}).json() == null
    absent = {name: value for name, value in case.items() if name != "k"}
    for response in (client.post(PATH, json=absent), client.get(PATH, params=absent)):
        (fault,) = problem(response, 422)["errors"]
        assert (fault["field"], "rigid" in fault["reason"]) == ("k", True)
    absent["k"] = None
    stiff = client.post(PATH, json={**case, "k": 1e18}).json()
    assert stiff["mu_macro"] == close(null["mu_macro"], rel=1e-5)
    limits = client.post(PATH, json={**absent, "include": ["limits"]}).json()["limits"]
    assert limits == {"mu_static": 0.0, "v0_crit": 0.0, "mu_crit": 0.0}


@pytest.mark.parametrize(
    "extreme",
    [{"y0": 1e300, "k": 1e300}, {"y0": 1e-300, "k": 1e-300}, {"mu0": 1e300, "Fz": 1e300}, {"mu0": 1e-300, "Fz": 1e-300},
     {"omega": 1e300, "mu0": 1e300}, {"v0": 1e308, "omega": 1e-300}, {"v0": 5e-324}, {"omega": 5e-324}],
)  # fmt: skip
def test_products_beyond_double_range_are_answered(client, case, extreme):
    answer = client.post(PATH, json={**case, **extreme, "include": ["groups", "limits"]})
    assert answer.status_code == 200, answer.text
    assert 0.0 <= answer.json()["mu_ratio"] <= 1.0


@pytest.mark.parametrize("include", ["groups,limits", "limits, groups", "groups,groups,limits"])
def test_a_query_includes_by_commas(client, case, include):
    answer = client.get(PATH, params={**case, "include": include}).json()
    assert answer.keys() == DEFAULT | {"groups", "limits"}
    repeated = client.get(PATH, params=[*case.items(), ("include", "groups"), ("include", "limits")])
    assert repeated.json() == answer


@pytest.mark.parametrize("name", ["curvature", "Groups", "x", ""])
def test_an_unknown_include_is_refused_with_the_known_ones(client, case, problem, name):
    for response in (
        client.post(PATH, json={**case, "include": [name]}),
        client.get(PATH, params={**case, "include": name}),
    ):
        (fault,) = problem(response, 422)["errors"]
        assert fault["field"] == "include"
        assert "groups, limits" in fault["reason"]
        assert fault["value"] == name


@pytest.mark.parametrize("include", ["groups", 3, {"groups": True}, [1]])
def test_include_is_a_list_of_names(client, case, problem, include):
    problem(client.post(PATH, json={**case, "include": include}), 422)


@pytest.mark.parametrize("name", ["mu0", "Fz", "k", "y0", "omega", "v0"])
@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("NaN", "NaN"),
        ("Infinity", "Infinity"),
        ("-Infinity", "-Infinity"),
        ("1e999", "Infinity"),
        ("-1e999", "-Infinity"),
        ("-1", -1),
        ("-1e-300", -1e-300),
        ("1" + "0" * 400, "an integer beyond double range"),
    ],
)
def test_a_number_out_of_bounds_is_named(client, case, problem, name, text, shown):
    body = json.dumps({**case, name: "@"}).replace('"@"', text)
    (fault,) = problem(client.post(PATH, content=body), 422)["errors"]
    assert fault["pointer"] == f"#/{name}"
    assert fault["field"] == name
    assert fault["value"] == shown
    assert fault["bound"] == f"finite and {'>' if name in ('mu0', 'Fz', 'k') else '>='} 0"
    (fault,) = problem(client.get(PATH, params={**case, name: text}), 422)["errors"]
    assert (fault["parameter"], fault["field"]) == (name, name)


@pytest.mark.parametrize("name", ["mu0", "Fz", "k"])
def test_zero_is_out_of_bounds_where_it_divides(client, case, problem, name):
    for zero in (0, -0.0, 0.0):
        problem(client.post(PATH, json={**case, name: zero}), 422)
    problem(client.get(PATH, params={**case, name: "0"}), 422)


@pytest.mark.parametrize("value", ["0.3", True, [0.3], {"value": 0.3}, ""])
@pytest.mark.parametrize("name", ["mu0", "k", "v0", "tolerance"])
def test_json_numbers_are_strict(client, case, problem, name, value):
    (fault,) = problem(client.post(PATH, json={**case, name: value}), 422)["errors"]
    assert fault["field"] == name
    assert fault["reason"].startswith("must be a number")


@pytest.mark.parametrize("text", ["abc", "", " ", "1_000", "0x10", "１", "1e", "1,5", "--1", "1 2", "null"])
def test_query_numbers_are_strict(client, case, problem, text):
    (fault,) = problem(client.get(PATH, params={**case, "k": text}), 422)["errors"]
    assert (fault["parameter"], fault["value"]) == ("k", text)
    assert fault["reason"].startswith("must be a number")


def test_an_unescaped_plus_of_an_exponent_is_understood(client, case):
    query = "&".join(f"{name}={value}" for name, value in {**case, "k": "1e+6"}.items())
    assert client.get(f"{PATH}?{query}").json() == client.post(PATH, json=case).json()


def test_all_faults_are_reported_at_once(client, problem):
    body = {"mu0": -1, "Fz": "10", "amplitude": 3, "omega": None}
    faults = problem(client.post(PATH, json=body), 422)["errors"]
    assert {fault["field"] for fault in faults} == {"mu0", "Fz", "k", "y0", "omega", "v0", "amplitude"}
    faults = problem(client.get(PATH, params=body), 422)["errors"]
    assert {fault["field"] for fault in faults} == {"mu0", "k", "y0", "omega", "v0", "amplitude"}


def test_a_frequency_is_given_once_in_either_unit(client, case, problem):
    by_omega = client.post(PATH, json=case).json()
    named = {name: value for name, value in case.items() if name != "omega"}
    f = case["omega"] / (2 * math.pi)
    assert client.post(PATH, json={**named, "f": f}).json()["mu_macro"] == close(by_omega["mu_macro"], rel=1e-13)
    assert client.get(PATH, params={**named, "f": f}).json() == client.post(PATH, json={**named, "f": f}).json()
    for sender in ({"json": named}, {"json": {**case, "f": f}}):
        assert "omega" in problem(client.post(PATH, **sender), 422)["errors"][0]["reason"]


@pytest.mark.parametrize(
    ("change", "advice"),
    [({"y0": "2um"}, "give metres, 2e-06"), ({"v0": "5 mm/s"}, "give metres per second, 0.005"), ({"K": 1}, "mean k?"),
     ({"stiffness": 1}, "mean k?"), ({"frequency": 1}, "mean f?"), ({"k": ""}, "rigid"), ({"v0": "0,01"}, "0.01")],
)  # fmt: skip
def test_a_refusal_suggests_the_right_field(client, case, problem, change, advice):
    (fault,) = problem(client.get(PATH, params={**case, **change}), 422)["errors"]
    assert advice in fault["reason"]


def test_one_value_is_returned_as_text(client, case, problem):
    answer = client.post(PATH, json={**case, "include": ["power"]}).json()
    plain = client.get(f"{PATH}.txt", params=case)
    assert (float(plain.text), plain.headers["content-type"]) == (answer["mu_macro"], "text/plain; charset=utf-8")
    asked = {**case, "include": "power", "value": "power.saved"}
    assert float(client.get(f"{PATH}.txt", params=asked).text) == answer["power"]["saved"]
    assert client.get(f"{PATH}.txt", params={**case, "value": "regime"}).text == "stick_slip"
    (fault,) = problem(client.get(f"{PATH}.txt", params={**case, "value": "power"}), 422)["errors"]
    assert fault["parameter"] == "value"


def test_unknown_and_repeated_fields_are_refused(client, case, problem):
    (fault,) = problem(client.post(PATH, json={**case, "f/~z": 1}), 422)["errors"]
    assert fault["pointer"] == "#/f~1~0z"
    assert (
        "mu0, Fz, k, y0, omega, f, v0, Fz_amplitude, k_range, k_low, k_high, contact, direction, tolerance"
        in fault["reason"]
    )
    (fault,) = problem(client.get(PATH, params={**case, "fz": 1}), 422)["errors"]
    assert fault["parameter"] == "fz"
    (fault,) = problem(client.get(PATH, params=[*case.items(), ("v0", 1)]), 422)["errors"]
    assert fault["reason"] == "is given more than once"
    (fault,) = problem(client.post(f"{PATH}?v0=1", json=case), 422)["errors"]
    assert fault["parameter"] == "v0"
    problem(client.get(PATH + "?" + "&".join(f"a{i}=1" for i in range(200))), 422)


def test_the_list_of_faults_is_bounded(client, problem):
    document = problem(client.post(PATH, json={f"x{i}": i for i in range(5000)}), 422)
    assert len(document["errors"]) == 100
    assert document["n_errors"] == 5006


@pytest.mark.parametrize("body", ["[]", "3", "null", '"text"', "[1, 2]"])
def test_json_that_is_no_object_is_refused(client, problem, body):
    (fault,) = problem(client.post(PATH, content=body), 422)["errors"]
    assert (fault["pointer"], fault["reason"]) == ("#", "must be a JSON object")


@pytest.mark.parametrize("body", [b"", b" ", b"{", b"{'mu0': 1}", b"\xff\xfe", b"{} {}", b"[" * 50_000, b"nonsense"])
def test_a_body_that_is_not_json_is_malformed(client, problem, body):
    problem(client.post(PATH, content=body), 400)


@pytest.mark.parametrize("digits", ["1" + "0" * 400, "1" + "0" * 5000, "1e400", "-1e400", "1." + "0" * 5000 + "e999"])
def test_a_number_that_no_double_holds_is_refused_by_name_whatever_its_digits(client, case, problem, digits):
    body = json.dumps({**case, "v0": "@"}).replace('"@"', digits)
    (fault,) = problem(client.post(PATH, content=body), 422)["errors"]
    assert fault["field"] == "v0"
    listed = json.dumps({**case, "v0": [0.1, "@"]}).replace('"@"', digits)
    for batch in (listed, f"[{json.dumps(case)}, {body}]"):
        found = client.post(f"{PATH}/batch", content=batch).json()
        assert [(error["index"], error["field"]) for error in found["errors"]] == [(1, "v0")]


@pytest.mark.parametrize(
    "content_type", ["text/plain", "application/x-www-form-urlencoded", "application/json; charset=utf-16"]
)
def test_other_media_types_are_refused(client, problem, content_type):
    document = problem(client.post(PATH, content="{}", headers={"Content-Type": content_type}), 415)
    assert "application/json" in document["detail"]


@pytest.mark.parametrize(
    "content_type", ["application/json", "Application/JSON; charset=UTF-8", 'application/json; charset="utf-8"']
)
def test_json_is_read_whatever_the_case_of_its_type(client, case, content_type):
    assert client.post(PATH, content=json.dumps(case), headers={"Content-Type": content_type}).status_code == 200


def test_a_body_without_a_type_is_json(client, case):
    # Some clients send none; the framework alone would refuse such a body.
    request = client.build_request("POST", PATH, content=json.dumps(case))
    assert "content-type" not in request.headers
    assert client.send(request).json() == client.post(PATH, json=case).json()


def test_a_compressed_body_is_refused(client, problem):
    problem(client.post(PATH, content=b"\x1f\x8b", headers={"Content-Encoding": "gzip"}), 415)


def test_a_tolerance_that_no_table_meets_is_refused(client, case, problem, surrogate):
    for place, response in (
        ("pointer", client.post(PATH, json={**case, "tolerance": 1e-30})),
        ("parameter", client.get(PATH, params={**case, "tolerance": 1e-30})),
    ):
        document = problem(response, 422)
        assert document["tightest_available"] == surrogate.tolerance
        assert document["errors"][0]["field"] == "tolerance"
        assert place in document["errors"][0]
    assert client.post(PATH, json={**case, "tolerance": surrogate.tolerance}).status_code == 200


@pytest.mark.parametrize("tolerance", [0, -1, "1e-8"])
def test_a_tolerance_is_a_positive_number(client, case, problem, tolerance):
    (fault,) = problem(client.post(PATH, json={**case, "tolerance": tolerance}), 422)["errors"]
    assert fault["field"] == "tolerance"


def test_head_is_get_without_the_body(client, case):
    head, get = client.head(PATH, params=case), client.get(PATH, params=case)
    assert (head.status_code, head.content, head.headers["content-length"]) == (200, b"", str(len(get.content)))


def test_two_frequencies_in_the_deviations_of_a_query_are_reported_by_name(client, case, problem):
    query = {**case, "include": "std", "std_omega": 1.0, "std_f": 1.0}
    (fault,) = problem(client.get(PATH, params=query), 422)["errors"]
    assert fault["parameter"] == "std_f"
    assert "not of both" in fault["reason"]


def test_two_frequencies_in_the_case_and_in_its_deviations_are_both_reported(client, case, problem):
    body = {**case, "f": 1.0, "include": ["std"], "std": {"omega": 1.0, "f": 1.0}}
    faults = problem(client.post(PATH, json=body), 422)["errors"]
    assert len(faults) == 2
    assert all("not of both" in fault["reason"] or "exactly one" in fault["reason"] for fault in faults)

"""What is refused, by its place and with a reason: one table for all questions; bodies that cannot
be read."""

import json
from typing import Any
from urllib.parse import urlencode

import pytest

from tests.support.serving import CASE

SINGLE, BATCH = "/v1/mu-macro", "/v1/mu-macro/batch"
FIVE = {name: value for name, value in CASE.items() if name != "v0"}
BALL = {"geometry": "ball", "radius": 5e-3, "Fz": 10.0, "E": 210e9, "nu": 0.3}
POINTS = {
    "v0": [0.01, 0.1, 0.3],
    "mu_macro": [0.2, 0.25, 0.29],
    "Fz": 10.0,
    "y0": 2e-6,
    "omega": 1.3e5,
}
NORMAL = {"y0": ..., "Fz_amplitude": 1.0, "direction": "normal"}
RANGE = {"k": ..., "k_low": 1e6, "k_high": 2e6}
#: a question that is answered, by its path; the table changes it
QUESTIONS = {
    "mu-macro": CASE,
    "mu-macro.txt": CASE,
    "mu-macro/batch": {**CASE, "v0": [0.1, 0.2]},
    "stiffness": BALL,
    "law": {**FIVE, "start": 1e-4, "stop": 10.0},
    "law.csv": {**FIVE, "start": 1e-4, "stop": 10.0},
    "fit": POINTS,
    "solve-for": {**FIVE, "y0": ..., "v0": 0.01, "unknown": "y0", "target": 0.15},
    "table": {},
    "table.nc": {},
}
#: request, what is changed (...: left out), and where the fault is (# in the body, ? in the query)
REFUSED = [
    # names
    ("POST mu-macro", {"k": ...}, "#/k"),
    ("GET mu-macro", {"k": ...}, "?k"),
    *((f"POST {path}", {"k": None}, "#/k") for path in ("mu-macro", "law", "solve-for")),
    ("POST fit", {"k": None, "unknowns": ["mu0"]}, "#/k"),
    ("POST mu-macro", {"v0": ...}, "#/v0"),
    ("POST mu-macro", {"omega": ...}, "#/omega"),
    ("POST mu-macro", {"f": 1.0}, "#/omega"),
    ("POST mu-macro", {"f/~z": 1}, "#/f~1~0z"),
    ("POST mu-macro", {"\ud800": 1}, "#"),
    ("POST mu-macro?v0=1", {}, "?v0"),
    *(("GET mu-macro", {name: 1}, f"?{name}") for name in ("fz", "K", "stiffness", "frequency")),
    ("GET mu-macro?v0=1", {}, "?v0"),
    ("GET mu-macro.txt", {"value": "power"}, "?value"),
    ("GET table", {"id": "../x"}, "?id"),
    ("GET table?tolerance=1", {"tolerance": 1}, "?tolerance"),
    ("GET table.nc", {"tolerance": "x"}, "?tolerance"),
    # numbers
    *(
        ("POST mu-macro", {name: value}, f"#/{name}")
        for name in ("mu0", "tolerance")
        for value in ("0.3 kN", True, [0.3], {"value": 0.3}, "")
    ),
    *(("GET mu-macro", {"k": text}, "?k") for text in ("abc", "", "null", "1,500", "0")),
    *(
        (f"POST {path}", {name: zero}, f"#/{name}")
        for path in ("mu-macro", "mu-macro/batch")
        for name in ("mu0", "Fz", "k", "tolerance")
        for zero in (0, -0.0)
    ),
    *(
        (f"POST {path}", {"tolerance": 1e-30}, "#/tolerance")
        for path in ("mu-macro", "mu-macro/batch", "law", "solve-for", "fit")
    ),
    *(
        (f"GET {path}", {"tolerance": 1e-30}, "?tolerance")
        for path in ("mu-macro", "law.csv", "table", "table.nc")
    ),
    ("POST mu-macro/batch?tolerance=1e-30", {}, "?tolerance"),
    # include and std
    *(("POST mu-macro", {"include": [name]}, "#/include/0") for name in ("curvature", "Groups", 1)),
    *(("POST mu-macro", {"include": value}, "#/include") for value in (3, {"groups": 1})),
    *(("GET mu-macro", {"include": name}, "?include") for name in ("curvature", "")),
    *(
        (f"POST {path}", {"include": ["std"]}, "#/include")
        for path in ("mu-macro", "mu-macro/batch")
    ),
    *(
        ("POST mu-macro", {"include": ["std"], f"std_{name}": value}, f"#/std_{name}")
        for name, value in (("mu0", -1), ("mu0", "0.1 mm"), ("speed", 1))
    ),
    ("POST mu-macro", {"include": ["std"], "std": {"k": 1.0}}, "#/std"),
    ("POST mu-macro", {"include": ["std"], "std_k": [1, 2]}, "#/std_k"),
    ("POST mu-macro", {"include": ["std"], "std_omega": 1.0, "std_f": 1.0}, "#/std_f"),
    ("GET mu-macro", {"include": "std"}, "?include"),
    ("GET mu-macro", {"include": "std", "std_v0": -1}, "?std_v0"),
    ("GET mu-macro", {"include": "std", "std_omega": 1.0, "std_f": 1.0}, "?std_f"),
    ("POST mu-macro/batch?include=std", {}, "#/include"),
    # contact, direction, interval
    *(
        ("POST mu-macro", changed, f"#/{place}")
        for changed, place in (
            ({"contact": "cone"}, "contact"),
            ({"direction": "up"}, "direction"),
            ({"contact": "ball", "direction": "normal"}, "direction"),
            ({"direction": "normal"}, "y0"),
            ({"Fz_amplitude": 1.0}, "Fz_amplitude"),
            ({**NORMAL, "Fz_amplitude": 10.0}, "Fz_amplitude"),
            ({"k_low": 1e6, "k_high": 2e6}, "k"),
            ({"k_low": 1e6}, "k_high"),
            ({"k": ..., "k_low": 1e6}, "k_high"),
            ({**RANGE, "k_low": 2e6, "k_high": 1e6}, "k_low"),
            ({**RANGE, "k_range": [1e6, 2e6]}, "k_range"),
            ({**RANGE, "k_low": 1e6, "k_high": "rigid"}, "k_high"),
            ({**NORMAL, "include": ["power"]}, "include"),
            ({"direction": "along", "include": ["settling"]}, "include"),
            ({**RANGE, "include": ["std"], "std_v0": 1e-3}, "std_v0"),
            ({**NORMAL, "std_y0": 1e-6}, "std_y0"),
        )
    ),
    # columns
    *(
        ("POST mu-macro/batch", changed, f"#/{place}")
        for changed, place in (
            ({"v0": [1, 2, 3], "y0": [1e-6, 2e-6]}, "v0"),
            ({"y0": [1e-6]}, "v0"),
            ({"y0": []}, "v0"),
            ({"Fz": ...}, "Fz"),
            *(({name: None}, name) for name in ("k", "y0", "omega")),
            ({"speed": [1]}, "speed"),
            ({"y0": {}}, "y0"),
            ({"include": ["model"]}, "include"),
            ({"cases": [CASE]}, "cases"),
            ({"k_low": [1e5, 1e5], "k_high": [2e5, 2e5]}, "k"),
            ({"std": {"mu0": 0.05}}, "std"),
            ({"std_nothing": 0.05}, "std_nothing"),
        )
    ),
    ("POST mu-macro/batch?nonsense=1", {}, "?nonsense"),
    ("POST mu-macro/batch?mu0=1", {}, "?mu0"),
    ("POST mu-macro/batch?include=limits", {"include": ["groups"]}, "#/include"),
    # law
    *(
        (request, {name: value}, place + name)
        for request, place in (("POST law", "#/"), ("GET law.csv", "?"))
        for name, value in (
            ("along", "x"),
            ("start", 0.0),
            ("stop", 0.0),
            ("stop", 1e-5),
            ("points", 1),
            ("points", 10_002),
            ("scale", "cubic"),
            ("v0", 0.01),
            ("mu0", -1.0),
            ("extra", 1.0),
        )
    ),
    *(("POST law", {"points": value}, "#/points") for value in (5.5, True, "5", 1e30)),
    *(("POST law", {"include": [name]}, "#/include/0") for name in ("curvature", "approximations")),
    *(
        ("GET law.csv", {"include": names}, "?include")
        for names in ("curvature", "power,approximations")
    ),
    *((f"{call}", {"include": ["model"]}, "#/include") for call in ("POST law", "POST solve-for")),
    *(
        ("POST law", {"along": "Fz", "v0": 0.01, "start": 1.0, "stop": 9.0, **change}, f"#/{place}")
        for change, place in (
            ({}, "Fz"),
            ({"Fz": ..., "stiffness_exponent": 0.5}, "Fz"),
            ({"stiffness_exponent": 1.5}, "stiffness_exponent"),
        )
    ),
    ("POST law", {"stiffness_exponent": 0.5}, "#/stiffness_exponent"),
    ("GET law.csv?mu0=0.4", {}, "?mu0"),
    ("GET law.csv", {"omega": ...}, "?omega"),
    ("GET law.csv", {"Fz": "ten"}, "?Fz"),
    ("POST law?mu0=1", {}, "?mu0"),
    # solve-for
    *(
        ("POST solve-for", {name: value}, f"#/{name}")
        for name, value in (
            ("unknown", "w0"),
            ("unknown", None),
            ("y0", 1e-6),
            ("mu0", ...),
            ("target", []),
            ("target", [0.1] * 10_001),
            ("Fz", 0),
            ("Fz", "10 mm"),
            ("range", [1]),
            ("range", [2, 1]),
            ("extra", 1),
            ("omega", -1),
        )
    ),
    ("POST solve-for", {"target": -0.1}, "#/target/0"),
    *(("POST solve-for", {"target": [0.1, value]}, "#/target/1") for value in ("ten", True, -0.1)),
    ("POST solve-for", {"range": [0, -1]}, "#/range/1"),
    # stiffness and fit
    *(
        ("POST stiffness", {name: value}, f"#/{name}")
        for name, value in (
            ("radius", -1.0),
            ("nu", 0.7),
            ("E", "210 mm"),
            ("a", 1),
            ("Fz", None),
            ("geometry", "cone"),
            ("geometry", 3),
        )
    ),
    *(
        ("POST fit", {name: value}, f"#/{place}")
        for name, value, place in (
            ("mu_macro", [0.2], "data"),
            ("y0", "2 kN", "y0"),
            ("include", ["power"], "include"),
            ("v0", [0.1, 0.2, None], "v0/2"),
            ("contact", "cone", "contact"),
            ("mu0", 0.3, "mu0"),
            ("v0", [0.1] * 1001, "v0"),
        )
    ),
]


def faults_of(client: Any, problem: Any, request_line: str, changed: Any) -> dict[str, Any]:
    """The faults of a refused request, by their places."""
    method, _, path = request_line.partition(" ")
    path, _, query = path.partition("?")
    question = {
        name: value for name, value in {**QUESTIONS[path], **changed}.items() if value is not ...
    }
    body, query = (
        ("", f"{urlencode(question)}&{query}") if method == "GET" else (json.dumps(question), query)
    )
    document = problem(client.request(method, f"/v1/{path}?{query}", content=body), 422)
    first = document["errors"][0]
    assert document["detail"].startswith(f"{first['field']}")
    assert document["n_errors"] == len(document["errors"])
    loose = ("tolerance" in changed and changed["tolerance"] == 1e-30) or "=1e-30" in request_line
    assert ("tightest_available" in document) == loose
    return {
        fault.get("pointer", f"?{fault.get('parameter')}"): fault for fault in document["errors"]
    }


@pytest.mark.parametrize(("request_line", "changed", "place"), REFUSED)
def test_a_fault_has_its_place_its_field_and_a_reason(
    client: Any, problem: Any, request_line: Any, changed: Any, place: Any
) -> None:
    faults = faults_of(client, problem, request_line, changed)
    assert place in faults, faults
    name = place.lstrip("#/?").split("/")[-1]
    if name.isalpha():
        assert faults[place]["field"] == name
    assert faults[place]["reason"]


BEYOND = {
    "NaN": "NaN",
    "Infinity": "Infinity",
    "-Infinity": "-Infinity",
    "1e999": "Infinity",
    "-1e999": "-Infinity",
    "-1": -1,
    "-1e-300": -1e-300,
    "1" + "0" * 400: "an integer of many digits",
    "1" + "0" * 5000: "Infinity",
    "1." + "0" * 5000 + "e999": "Infinity",
}


@pytest.mark.parametrize("text", BEYOND, ids=lambda text: text[:12])
@pytest.mark.parametrize("name", CASE)
def test_a_number_out_of_bounds_is_shown_with_its_bound(
    client: Any, problem: Any, name: str, text: str
) -> None:
    body = json.dumps({**CASE, name: "@"}).replace('"@"', text)
    bound = f"finite and {'>' if name in ('mu0', 'Fz', 'k') else '>='} 0"
    reason = f"must be {bound}{', or rigid' if name == 'k' else ''}"
    if (name, text) == ("k", "NaN"):
        reason = "is missing; write rigid or a number"
    (fault,) = problem(client.post(SINGLE, content=body), 422)["errors"]
    expected = {"pointer": f"#/{name}", "field": name, "value": BEYOND[text], "reason": reason}
    assert fault == {**expected, "bound": bound}
    if (name, text) == ("k", "Infinity"):  # a text may have it: the contact is rigid
        answer = client.get(SINGLE, params={**CASE, name: text})
        assert answer.json()["source"] == "rigid"
    elif len(text) < 500:
        (fault,) = problem(client.get(SINGLE, params={**CASE, name: text}), 422)["errors"]
        assert (fault["parameter"], fault["field"]) == (name, name)
    listed = json.dumps({**CASE, name: [CASE[name], "@"]}).replace('"@"', text)
    for batch in (listed, f"[{json.dumps(CASE)}, {body}]"):
        answer = client.post(BATCH, content=batch).json()
        assert answer["errors"] == [{"index": 1, "field": name, "reason": reason}]
    other = "Fz" if name == "v0" else "v0"
    scalar = json.dumps({**CASE, name: "@", other: [CASE[other]] * 2}).replace('"@"', text)
    (fault,) = problem(client.post(BATCH, content=scalar), 422)["errors"]
    assert (fault["pointer"], fault["bound"]) == (f"#/{name}", bound)


def test_all_faults_are_reported_at_once_and_their_list_is_bounded(
    client: Any, problem: Any
) -> None:
    body = {"mu0": -1, "Fz": "10 mm", "amplitude": 3, "omega": None}
    for response in (client.post(SINGLE, json=body), client.get(SINGLE, params=body)):
        fields = sorted(fault["field"] for fault in problem(response, 422)["errors"])
        assert fields == ["Fz", "amplitude", "k", "mu0", "omega", "v0", "y0"]
    both = {**CASE, "f": 1.0, "include": ["std"], "std_omega": 1.0, "std_f": 1.0}
    assert len(problem(client.post(SINGLE, json=both), 422)["errors"]) == 1  # relations: the first
    many = {f"x{i}": "y" * 100 if i == 0 else i for i in range(4000)}
    some = dict(list(many.items())[:150])
    document = problem(client.post(SINGLE, json=some), 422)
    assert (len(document["errors"]), document["n_errors"]) == (100, 156)
    (long,) = (fault["value"] for fault in document["errors"] if fault["field"] == "x0")
    assert len(long) == 80
    for route in (SINGLE, "/v1/law"):
        faults = problem(client.post(route, json=many), 422)["errors"]
        assert [fault["pointer"] for fault in faults] == ["#"]
    query = "&".join(f"a{i}=1" for i in range(200))
    problem(client.get(f"{SINGLE}?{query}"), 422)
    document = problem(client.post(f"{SINGLE}?{query}", json=CASE), 422)
    assert (len(document["errors"]), document["n_errors"]) == (100, 200)


TWICE = (
    '{"mu0":0.3,"Fz":10,"k":1e6,"y0":2e-6,"omega":1e5,"v0":%s,"mu0":0.2}',
    '{"mu0":0.3,"Fz":10,"k":null,"y0":2e-6,"f":1e4,"v0":%s,"\\u006du0":0.2}',
    '{"mu0":0.3,"mu0":0.3,"Fz":10,"k":"rigid","y0":2e-6,"omega":1e5,"f":null,"v0":%s}',
    '{"mu0":-1,"mu0":0.3,"Fz":10,"k":1e6,"y0":2e-6,"omega":1e5,"v0":%s}',
)


@pytest.mark.parametrize("text", TWICE)
def test_one_case_has_each_name_once(client: Any, problem: Any, text: str) -> None:
    """A batch takes the last one."""
    (fault,) = problem(client.post(SINGLE, content=text % "0.1"), 422)["errors"]
    assert (fault["field"], fault["reason"]) == ("mu0", "is given more than once")
    options = json.dumps({**CASE, "include": ["std"]})[:-1] + ',"std_mu0":0.1,"std_mu0":0.2}'
    (fault,) = problem(client.post(SINGLE, content=options), 422)["errors"]
    assert "more than once" in fault["reason"]


def test_a_frequency_whose_omega_is_beyond_double_range_is_at_fault_by_its_own_name(
    client: Any, problem: Any
) -> None:
    case = {**CASE, "f": 1.7e308}
    del case["omega"]
    for answer in (
        client.post(SINGLE, json=case),
        client.get(SINGLE, params=case),
        client.post(BATCH, json={**case, "v0": [0.1, 0.2]}),
    ):
        assert problem(answer, 422)["errors"][0]["field"] == "f"
    for body in ([case, {**case, "f": 1.0}], {**case, "f": [1.7e308, 1.0]}):
        (fault,) = client.post(BATCH, json=body).json()["errors"]
        assert (fault["index"], fault["field"]) == (0, "f")
    rest = {name: value for name, value in case.items() if name != "v0"}
    for path, more in (
        ("law", {"start": 0.1, "stop": 1.0}),
        ("solve-for", {"unknown": "v0", "target": 0.1}),
    ):
        assert (
            problem(client.post(f"/v1/{path}", json={**rest, **more}), 422)["errors"][0]["field"]
            == "f"
        )


CASES = "must be an object of columns or a list of rows"


@pytest.mark.parametrize(
    "path", ["mu-macro", "mu-macro/batch", "solve-for", "law", "stiffness", "fit"]
)
@pytest.mark.parametrize("body", ["[]", "3", "null", '"text"', "true"])
def test_json_of_another_kind_is_told_what_it_must_be(
    client: Any, problem: Any, path: Any, body: Any
) -> None:
    response = client.post(f"/v1/{path}", content=body)
    if path == "mu-macro/batch" and body == "[]":  # no rows
        assert response.json()["results"] == []
        return
    (fault,) = problem(response, 422)["errors"]
    assert (fault["pointer"], fault["field"]) == ("#", "body")
    assert fault["reason"] == (CASES if path == "mu-macro/batch" else "must be a JSON object")


NO_JSON = (
    b"",
    b" ",
    b"{",
    b"[1,]",
    b"{'mu0': 1}",
    b"\xff\xfe",
    b"{} {}",
    b"[,",
    b"[[",
    b"[{",
    b"[ ] [",
    b"[" * 50_000,
    b"\xff" * 60_000,
)


@pytest.mark.parametrize("path", ["mu-macro", "mu-macro/batch", "solve-for", "law"])
@pytest.mark.parametrize("body", NO_JSON, ids=range(len(NO_JSON)))
def test_a_body_that_is_not_json_is_malformed(
    client: Any, problem: Any, path: Any, body: Any
) -> None:
    assert problem(client.post(f"/v1/{path}", content=body), 400)["type"].endswith("malformed-body")


@pytest.mark.parametrize("path", ["mu-macro", "mu-macro/batch", "solve-for", "law"])
def test_plain_json_is_the_only_media_type(client: Any, problem: Any, path: Any) -> None:
    for kind in (
        "text/plain",
        "text/csv",
        "application/x-ndjson",
        "application/vnd.apache.arrow.stream",
        "application/x-www-form-urlencoded",
        "application/json; charset=utf-16",
    ):
        response = client.post(f"/v1/{path}", content="{}", headers={"Content-Type": kind})
        assert "application/json" in problem(response, 415)["detail"]
        assert response.headers["accept-post"] == "application/json"
    response = client.post(f"/v1/{path}", content=b"\x1f\x8b", headers={"Content-Encoding": "gzip"})
    assert "without Content-Encoding" in problem(response, 415)["detail"]


@pytest.mark.parametrize(
    "kind", ["Application/JSON; charset=UTF-8", 'application/json; charset="utf-8"', None]
)
def test_json_is_read_whatever_the_case_of_its_type_and_without_one(client: Any, kind: Any) -> None:
    headers = {} if kind is None else {"Content-Type": kind}
    response = client.post(SINGLE, content=json.dumps(CASE), headers=headers)
    assert response.request.headers.get("content-type") == kind
    assert response.json() == client.post(SINGLE, json=CASE).json()


@pytest.fixture(scope="module")
def few(started: Any) -> Any:
    with started(max_batch=3) as client:
        yield client


FORMS: dict[str, Any] = {
    "rows": json.dumps,
    "rows with words": lambda rows: json.dumps([{**row, "k": "Rigid"} for row in rows]),
    "columns": lambda rows: json.dumps({**CASE, "v0": [0.1] * len(rows)}),
}


@pytest.mark.parametrize("name", FORMS)
def test_a_batch_has_the_same_limit_in_every_form(few: Any, problem: Any, name: str) -> None:
    fine, over = (few.post(BATCH, content=FORMS[name]([CASE] * many)) for many in (3, 4))
    assert (fine.status_code, b"max_batch" in fine.content) == (200, False)
    assert problem(over, 413)["max_batch"] == 3


def test_values_are_counted_before_they_are_made(few: Any, problem: Any) -> None:
    for body in ("[" + "0," * 20_000 + "0]", "[" + "[]," * 400 + "0]"):
        problem(few.post(BATCH, content=body), 413)
    members = ",".join(f'"a{i}":1' for i in range(200))
    assert "more members" in problem(few.post(BATCH, content=f"{{{members}}}"), 422)["detail"]


@pytest.mark.parametrize(
    ("path", "body", "bound"),
    [
        ("/v1/law", {"start": 1e-4, "stop": 1.0, "points": 1}, ">= 2"),
        (
            "/v1/stiffness",
            {"geometry": "ball", "radius": 5e-3, "Fz": 1.0, "E": 2e11, "nu": -1},
            "> -1",
        ),
    ],
)
def test_a_number_below_its_bound_is_told_this_bound(
    client: Any, path: str, body: Any, bound: str
) -> None:
    (fault,) = client.post(path, json=body).json()["errors"]
    assert fault["reason"].endswith(bound)

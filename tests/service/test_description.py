"""The description agrees with the service: where null is accepted, and what may be left out.  It is
complete, and the documents name all of its paths."""

import json
import re
import subprocess
import sys
from typing import Any

import pytest

from mumacro.inputs.fields import INPUTS, described
from mumacro.outputs import MEMBERS, OUTPUTS
from tests.support.places import ROOT
from tests.support.serving import CASE

LAW = {name: x for name, x in CASE.items() if name != "v0"} | {
    "start": 1e-3,
    "stop": 1.0,
    "points": 3,
}
TARGET = {name: x for name, x in CASE.items() if name != "y0"} | {"unknown": "y0", "target": 0.15}
POINTS = {"v0": [0.001, 0.005, 0.02, 0.1], "mu_macro": [0.069, 0.174, 0.247, 0.289]}
#: by model: the path, and a body that is answered
BODIES: dict[str, tuple[str, dict[str, Any]]] = {
    "CaseRequest": ("mu-macro", CASE),
    "Case": ("mu-macro/batch", CASE),
    "CaseColumns": ("mu-macro/batch", {**CASE, "v0": [0.01, 0.1]}),
    "LawRequest": ("law", LAW),
    "SolveForRequest": ("solve-for", TARGET),
    "MotionRequest": ("motion", {n: x for n, x in CASE.items() if n != "y0"} | {"y": 2e-6}),
    "StiffnessRequest": (
        "stiffness",
        {"geometry": "ball", "radius": 5e-3, "Fz": 10.0, "E": 210e9, "nu": 0.3},
    ),
    "FitRequest": ("fit", {**POINTS, "Fz": 10.0, "y0": 4e-7, "f": 20e3}),
}
#: null is accepted where the input is the unknown one, which no schema of a member says
OF_RELATIONS = {("LawRequest", "k"), ("SolveForRequest", "k"), ("FitRequest", "k")}


@pytest.fixture(scope="module")
def schemas(client: Any) -> dict[str, Any]:
    described: dict[str, Any] = client.get("/openapi.json").json()
    return described["components"]["schemas"]  # type: ignore[no-any-return]


def _asked(client: Any, model: str, body: dict[str, Any]) -> tuple[int, Any]:
    path = BODIES[model][0]
    answer = client.post(f"/v1/{path}", json=[body] if model == "Case" else body)
    document = answer.json()
    if model == "Case" and document["errors"]:
        return 422, document
    return answer.status_code, document


#: a new process, because a description that is made once leaves parts that the next one takes
AT_ONCE = """
from concurrent.futures import ThreadPoolExecutor
from service.app import create_app
from service.settings import Settings

apps = [create_app(Settings()) for _ in range(2)]
with ThreadPoolExecutor(4) as pool:
    made = [*pool.map(lambda app: app.openapi(), [*apps, *apps])]
assert made[0]["paths"] and all(one == made[0] for one in made)
"""


def test_descriptions_that_are_asked_for_at_once_are_the_same() -> None:
    """The start makes one in a thread, and a request may ask for it meanwhile."""
    subprocess.run([sys.executable, "-c", AT_ONCE], cwd=ROOT, check=True)


@pytest.mark.parametrize("model", BODIES)
def test_null_is_accepted_where_the_description_has_it(
    client: Any, schemas: dict[str, Any], model: str
) -> None:
    body = BODIES[model][1]
    status, right = _asked(client, model, body)
    assert status == 200, right
    assert body.keys() <= schemas[model]["properties"].keys()
    for name, schema in schemas[model]["properties"].items():
        if (model, name) in OF_RELATIONS:
            continue
        nullable = {"type": "null"} in schema.get("anyOf", ())
        with_null = {**body, name: None}
        status, answer = _asked(client, model, with_null)
        if not nullable:
            assert status == 422, name
        elif name in body:  # the same as left out, which may be refused for what is missing
            rest = {member: x for member, x in body.items() if member != name}
            again, same = _asked(client, model, rest)
            assert status == again, name
            assert status != 200 or answer == same, name
        else:
            assert (status, answer) == (200, right), name


def test_members_that_may_be_left_out_have_no_default_in_the_description(
    schemas: dict[str, Any],
) -> None:
    """Clients that are made from it would require them."""
    for name, schema in schemas.items():
        for member, of_member in schema.get("properties", {}).items():
            assert "default" not in of_member, f"{name}.{member}"
    contact = schemas["CaseRequest"]["properties"]["contact"]
    assert contact["description"].endswith("left out: spring")
    assert "contact" not in schemas["CaseRequest"]["required"]


def _members(schemas: dict[str, Any], name: str) -> dict[str, str]:
    """What is said of the members of an object, by their paths."""
    found: dict[str, str] = {}
    for member, schema in schemas[name]["properties"].items():
        found[member] = schema.get("description", "")
        for one in (schema, *schema.get("anyOf", ())):
            if part := one.get("$ref", "").rpartition("/")[2]:
                inner = _members(schemas, part)
                found |= {f"{member}.{path}": text for path, text in inner.items()}
    return found


@pytest.mark.parametrize("answer", ["CaseAnswer", "Result", "ColumnsAnswer", "LawAnswer", "Root"])
def test_every_value_of_every_output_is_described_as_in_the_list(
    schemas: dict[str, Any], answer: str
) -> None:
    described = _members(schemas, answer)
    wanted = {path: f"{one.meaning} [{one.unit}]" for path, one in MEMBERS.items()}
    if answer == "Root":  # it has no default answer but mu_macro, which stands at the root
        wanted = {path: wanted[path] for output in OUTPUTS.values() for path in output.members}
    told = {path: described.get(path) for path in wanted}
    assert told == wanted


@pytest.mark.parametrize("answer", ["CaseAnswer", "ColumnsAnswer"])
def test_every_group_of_values_is_described(schemas: dict[str, Any], answer: str) -> None:
    for output in OUTPUTS.values():
        groups = {path.partition(".")[0] for path in output.members if "." in path}
        assert groups == output.parts.keys()
        for group in groups:
            refs = [one for one in schemas[answer]["properties"][group]["anyOf"] if "$ref" in one]
            about = schemas[refs[0]["$ref"].rpartition("/")[2]]["description"]
            assert about == f"{output.parts[group].replace('NaN', 'null')}."


def test_every_body_of_the_description_is_asked_here(client: Any) -> None:
    paths = client.get("/openapi.json").json()["paths"].values()
    bodies = json.dumps([path["post"]["requestBody"] for path in paths if "post" in path])
    assert {*re.findall(r"#/components/schemas/(\w+)", bodies)} == BODIES.keys()


def test_every_path_is_in_the_documents(client: Any) -> None:
    pages = ("http.md", "operations.md")
    text = "".join((ROOT / "docs" / page).read_text("utf-8") for page in pages)
    paths = client.get("/openapi.json").json()["paths"]
    assert [path for path in paths if not re.search(rf"{re.escape(path)}(?![\w./-])", text)] == []


def test_no_parameter_of_a_query_is_null(client: Any) -> None:
    for path, operations in client.get("/openapi.json").json()["paths"].items():
        for parameter in operations.get("get", {}).get("parameters", ()):
            assert {"type": "null"} not in parameter["schema"].get("anyOf", ()), path


def test_an_input_is_described_by_the_list_of_inputs(client: Any) -> None:
    document = client.get("/openapi.json").json()
    places = [
        (name, member["description"], model)
        for model, schema in document["components"]["schemas"].items()
        if model in BODIES
        for name, member in schema["properties"].items()
        if name in INPUTS
    ]
    places += [
        (
            parameter["name"],
            parameter.get("description", parameter["schema"].get("description")),
            path,
        )
        for path, operations in document["paths"].items()
        for parameter in operations.get("get", {}).get("parameters", ())
        if parameter["name"] in INPUTS
    ]
    assert len(places) > 60
    for name, text, place in places:
        assert text.startswith(described(name)), (place, text)

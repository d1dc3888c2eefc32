"""Common to all requests: errors, request ids, keys, body limits, the interface's description."""

import json
import logging

import pytest
from starlette.testclient import TestClient

from service.app import create_app
from service.observe import HEALTH_PATHS, JsonFormatter
from service.routes.docs import ASSETS
from service.routes.page import ASSETS as PAGE_ASSETS
from service.settings import Settings

PATHS = {
    "/v1/mu-macro": "GET, HEAD, POST",
    "/v1/mu-macro/batch": "POST",
    "/v1/solve-for": "POST",
    "/v1/mu-macro.txt": "GET, HEAD",
    "/v1/law": "POST",
    "/v1/law.csv": "GET, HEAD",
    "/v1/stiffness": "POST",
    "/v1/fit": "POST",
    "/v1/table": "GET, HEAD",
    "/v1/table.nc": "GET, HEAD",
    "/livez": "GET, HEAD",
    "/readyz": "GET, HEAD",
    "/healthz": "GET, HEAD",
    "/metrics": "GET, HEAD",
    "/docs": "GET, HEAD",
    "/openapi.json": "GET, HEAD",
}


@pytest.mark.parametrize(
    "path", ["/nowhere", "/static/page/", "/v1", "/v1/mu-macro/", "/v2/mu-macro", "/static/../settings.py", "/%00"]
)
def test_an_unknown_path_is_not_found(client, problem, path):
    problem(client.get(path), 404)


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("method", ["PUT", "DELETE", "PATCH", "OPTIONS"])
def test_a_wrong_method_is_answered_with_the_right_ones(client, problem, path, method):
    response = client.request(method, path)
    problem(response, 405)
    assert response.headers["allow"] == PATHS[path]


def test_every_path_is_in_the_table_above(client):
    assert set(client.get("/openapi.json").json()["paths"]) <= set(PATHS)


@pytest.mark.parametrize("offered", ["abc-123", "A.b_c:9", "x" * 128])
def test_a_request_id_is_taken_over(client, offered):
    assert client.get("/livez", headers={"X-Request-ID": offered}).headers["x-request-id"] == offered


@pytest.mark.parametrize("offered", ["", "x" * 129, "a b", "a;b", 'a"b', "ä"])
def test_an_ill_formed_request_id_is_replaced(client, offered):
    given = client.get("/livez", headers={"X-Request-ID": offered.encode("latin-1")}).headers["x-request-id"]
    assert len(given) == 32
    assert int(given, 16) >= 0


def test_requests_are_logged_as_json_lines(client, case, caplog):
    with caplog.at_level(logging.INFO, logger="mumacro"):
        client.get("/v1/mu-macro", params=case, headers={"X-Request-ID": "mine"})
        client.get("/livez")
    (record,) = [record for record in caplog.records if record.name == "mumacro.access"]
    assert record.fields["status"] == 200
    assert record.fields["path"] == "/v1/mu-macro"
    forged = logging.LogRecord("mumacro", logging.INFO, "", 0, 'one\n{"level": "forged"}', (), None)
    line = JsonFormatter().format(forged)
    assert "\n" not in line
    assert json.loads(line)["message"].startswith("one\n")


def test_an_unexpected_error_is_logged_and_not_shown(client, case, problem, caplog, monkeypatch):
    def fail(*_args):
        raise RuntimeError("secret detail")

    monkeypatch.setattr("service.routes.case.answer_case", fail)
    for response in (client.post("/v1/mu-macro", json=case), client.get("/v1/mu-macro", params=case)):
        assert problem(response, 500)["request_id"] == response.headers["x-request-id"]
        assert "secret" not in response.text
    assert [record.fields["status"] for record in caplog.records if record.name == "mumacro.access"] == [500, 500]
    told = [record for record in caplog.records if record.name == "mumacro.error"]
    assert ["secret detail" in JsonFormatter().format(record) for record in told] == [True, True]


@pytest.fixture
def closed(tables_dir):
    """A client of an application with an API key."""
    with TestClient(create_app(Settings(tables=(tables_dir,), api_key="s3cret-key"))) as started:
        yield started


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"X-API-Key": "wrong"},
        {"X-API-Key": ""},
        {"X-API-Key": b"s3cret-key\xe4"},
        {"Authorization": "Bearer wrong"},
        {"Authorization": "Basic s3cret-key"},
        {"Authorization": "s3cret-key"},
    ],
)
def test_without_the_key_there_is_no_answer(closed, case, problem, headers):
    for response in (
        closed.get("/v1/mu-macro", params=case, headers=headers),
        closed.post("/v1/mu-macro/batch", json=[case], headers=headers),
        closed.get("/v1/table.nc", headers=headers),
        closed.get("/openapi.json", headers=headers),
        closed.get("/nowhere", headers=headers),
    ):
        assert "s3cret" not in response.text
        problem(response, 401)
        assert response.headers["www-authenticate"] == "Bearer"


@pytest.mark.slow
def test_every_route_but_the_pages_and_the_probes_needs_the_key(closed):
    open_to_all = {"/livez", "/readyz", "/healthz", "/", "/docs", "/static/page/names.json"}
    open_to_all |= {f"/static/page/{name}" for name in PAGE_ASSETS} | {f"/static/swagger-ui/{name}" for name in ASSETS}
    described = closed.get("/openapi.json", headers={"X-API-Key": "s3cret-key"}).json()["paths"]
    routes = {*PATHS, *described, "/static/page/map.json", "/nowhere"} | open_to_all
    assert len(routes - open_to_all) >= 9
    for path in routes:
        for method in ("GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS"):
            response = closed.request(method, path)
            assert (response.status_code != 401) == (path in open_to_all), f"{method} {path}: {response.status_code}"
            assert closed.request(method, path, headers={"X-API-Key": "s3cret-key"}).status_code != 401
    for path in ("/livez/", "/docs/../v1/table", "/static/page/../../v1/table", "/V1/TABLE", "/%2fv1/table"):
        assert closed.get(path).status_code == 401


@pytest.mark.parametrize("headers", [{"X-API-Key": "s3cret-key"}, {"Authorization": "bearer s3cret-key"}])
def test_the_key_gives_access(closed, case, headers):
    response = closed.get("/v1/mu-macro", params=case, headers=headers)
    assert response.status_code == 200
    assert response.headers["cache-control"] == "private, max-age=3600"
    assert response.headers["vary"] == "X-API-Key, Authorization"


def test_a_key_given_twice_is_refused(closed, case, problem):
    twice = [("X-API-Key", "s3cret-key"), ("X-API-Key", "wrong")]
    problem(closed.get("/v1/mu-macro", params=case, headers=twice), 400)


def test_an_upgrade_with_a_body_is_refused(client, case, problem):
    response = client.post("/v1/mu-macro", json=case, headers={"Upgrade": "websocket", "Connection": "Upgrade"})
    assert problem(response, 400)
    assert response.headers["connection"] == "close"


def test_too_little_memory_is_overload_and_no_fault(client, case, problem, monkeypatch):
    def fail(*_args):
        raise MemoryError

    monkeypatch.setattr("service.routes.case.answer_case", fail)
    assert problem(client.post("/v1/mu-macro", json=case), 503)["type"].endswith("out-of-memory")


@pytest.mark.parametrize("path", sorted(HEALTH_PATHS))
def test_health_needs_no_key(closed, path):
    assert closed.get(path).status_code == 200


@pytest.fixture
def narrow(tables_dir):
    """A client of an application that reads bodies up to 1024 bytes."""
    with TestClient(create_app(Settings(tables=(tables_dir,), max_body_bytes=1024))) as started:
        yield started


def test_a_large_body_is_refused_before_reading(narrow, case, problem):
    body = json.dumps(case).encode()
    assert narrow.post("/v1/mu-macro", content=body.ljust(1024)).status_code == 200
    response = narrow.post("/v1/mu-macro", content=body.ljust(1025))
    assert problem(response, 413)["max_bytes"] == 1024
    problem(narrow.post("/v1/mu-macro/batch", content=b"x" * 100_000), 413)


def test_a_large_body_without_a_length_is_refused_while_reading(narrow, problem):
    read = []

    def pieces():
        for index in range(10_000):
            read.append(index)
            yield b" " * 100

    response = narrow.post("/v1/mu-macro", content=pieces())
    problem(response, 413)
    assert "content-length" not in response.request.headers


def references(node):
    if isinstance(node, dict):
        for key, value in node.items():
            if key == "$ref":
                yield value
            yield from references(value)
    elif isinstance(node, list):
        for value in node:
            yield from references(value)


def test_the_description_is_whole(client):
    document = client.get("/openapi.json").json()
    schemas = document["components"]["schemas"]
    found = set(references(document))
    assert {reference.removeprefix("#/components/schemas/") for reference in found} <= set(schemas)
    assert set(schemas["Case"]["properties"]) == {
        "mu0",
        "Fz",
        "k",
        "y0",
        "omega",
        "f",
        "v0",
        "Fz_amplitude",
        "k_low",
        "k_high",
        "k_range",
    }
    assert set(schemas["Case"]["required"]) == {"mu0", "Fz", "v0"}
    assert set(schemas["CaseColumns"]["properties"]) == set(schemas["CaseRequest"]["properties"])
    for name, unit in {"mu0": "[-]", "Fz": "[N]", "k": "[N/m]", "y0": "[m]", "omega": "[rad/s]", "v0": "[m/s]"}.items():
        assert unit in schemas["Case"]["properties"][name]["description"]
    parameters = document["paths"]["/v1/mu-macro"]["get"]["parameters"]
    assert {parameter["name"]: parameter["required"] for parameter in parameters} == {
        "mu0": True, "Fz": True, "k": False, "y0": False, "omega": False, "f": False, "v0": True, "include": False,
        "tolerance": False, "contact": False, "direction": False, "Fz_amplitude": False, "k_low": False,
        "k_high": False,
        **{f"std_{name}": False for name in ("mu0", "Fz", "k", "y0", "omega", "f", "v0", "Fz_amplitude")},
    }  # fmt: skip


def described_examples(document):
    """(method, path, arguments) for every example of the description; operations without input count as examples."""
    schemas = document["components"]["schemas"]
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            bodies = operation.get("requestBody", {}).get("content", {})
            if not bodies:
                given = {
                    each["name"]: each["schema"]["examples"][0]
                    for each in operation.get("parameters", [])
                    if "examples" in each["schema"]
                }
                yield method, path, {"params": given}
            for media_type, content in bodies.items():
                found = [each["value"] for each in content.get("examples", {}).values()]
                found += [content["example"]] if "example" in content else []
                name = content["schema"].get("$ref", "").rpartition("/")[2]
                found += schemas[name].get("examples", []) if name else []
                assert found or "arrow" in media_type, f"{method} {path} {media_type} has no example"
                for example in found:
                    yield (
                        method,
                        path,
                        {
                            "content": example if isinstance(example, str) else json.dumps(example),
                            "headers": {"Content-Type": media_type},
                        },
                    )


def test_the_described_examples_are_answered(client):
    document = client.get("/openapi.json").json()
    tried = set()
    for method, path, asked in described_examples(document):
        answer = client.request(method, path, **asked)
        assert answer.status_code == 200, f"{method} {path}: {answer.text}"
        assert b"urn:problem-type" not in answer.content
        tried.add((method, path))
    assert tried == {(method, path) for path, methods in document["paths"].items() for method in methods}
    assert len(tried) >= 12


def test_the_page_loads_nothing_from_elsewhere(client):
    page = client.get("/docs")
    assert page.headers["content-type"].startswith("text/html")
    assert "default-src 'none'" in page.headers["content-security-policy"]
    assert "//" not in page.text
    for name, media_type in ASSETS.items():
        assert f"static/swagger-ui/{name}" in page.text
        asset = client.get(f"/static/swagger-ui/{name}")
        assert asset.status_code == 200
        assert asset.headers["content-type"].startswith(media_type)


def test_every_answer_forbids_guessing_its_type(client):
    for path in ("/livez", "/nowhere", "/docs", "/v1/table"):
        assert client.get(path).headers["x-content-type-options"] == "nosniff"


def test_a_page_that_the_client_has_is_not_sent_again(client):
    pages = ["/", "/docs", "/v1/table.nc", *(f"/static/swagger-ui/{name}" for name in ASSETS)]
    pages += [f"/static/page/{name}" for name in PAGE_ASSETS]
    for path in pages:
        first = client.get(path)
        tag = first.headers["etag"]
        for offered in (tag, f"W/{tag}", f'"other", {tag}', "*"):
            again = client.get(path, headers={"If-None-Match": offered})
            assert (again.status_code, again.content) == (304, b""), path
            assert again.headers["etag"] == tag
            for name in ("cache-control", "content-security-policy"):
                assert again.headers.get(name) == first.headers.get(name)
        assert client.get(path, headers={"If-None-Match": '"other"'}).content == first.content
        assert client.head(path, headers={"If-None-Match": tag}).status_code == 304


@pytest.mark.parametrize(
    ("given", "status"),
    [
        ("bytes=99999999-", 416), ("bytes=-0", 416), ("bytes=0-1,99999999-", 416), ("bytes=5-2", 400),
        ("lines=1-2", 400), ("nonsense", 400), ("bytes=", 400), ("bytes=a-b", 400), ("bytes=\xff-", 400),
    ],
)  # fmt: skip
@pytest.mark.parametrize("path", ["/v1/table.nc", "/", "/static/page/main.js"])
def test_a_range_that_the_file_has_not_is_a_problem_document(client, problem, path, given, status):
    response = client.get(path, headers={"Range": given.encode("latin-1")})
    problem(response, status)
    size = client.get(path).headers["content-length"]
    assert response.headers.get("content-range") == (f"bytes */{size}" if status == 416 else None)


def test_every_answer_has_the_security_headers(client, case):
    policies = {}
    for path in ("/", "/docs"):
        policy = client.get(path).headers["content-security-policy"]
        policies[path] = dict(part.strip().split(" ", 1) for part in policy.split(";"))
        assert client.get(path).headers["referrer-policy"] == "no-referrer"
    for policy in policies.values():
        assert policy["default-src"] == policy["frame-ancestors"] == policy["base-uri"] == "'none'"
        assert policy["script-src"] == policy["connect-src"] == "'self'"
    assert "unsafe" not in str(policies["/"])
    for response in (
        client.get("/v1/mu-macro", params=case), client.post("/v1/mu-macro/batch", json=[case]), client.get("/nowhere"),
        client.post("/v1/mu-macro", content=b"{"), client.put("/livez"), client.get("/v1/table.nc"),
    ):  # fmt: skip
        assert response.headers["x-content-type-options"] == "nosniff"
        assert "access-control-allow-origin" not in response.headers
        assert "server" not in response.headers
        assert "set-cookie" not in response.headers
    assert client.get("/nowhere").headers["cache-control"] == "no-store"

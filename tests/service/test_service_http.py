"""Common to all requests: errors, request ids, keys, body limits, headers, files, the interface's
description."""

import asyncio
import itertools
import json
import re
import time
from pathlib import Path
from typing import Any, cast
from unittest.mock import AsyncMock, Mock
from urllib.parse import urljoin

import pytest
from fastapi import APIRouter, Depends, Request
from starlette.exceptions import HTTPException
from starlette.websockets import WebSocketDisconnect

from mumacro.errors import InputError, TableError
from mumacro.inputs.cases import DEVIATIONS
from mumacro.inputs.fields import FIELDS, SI
from service.bodies import DirectRoute
from service.models.inputs import EXAMPLE
from service.models.options import CaseRequest
from service.problems import ProblemKind, meaning
from tests.support.cases import Case
from tests.support.places import ROOT

STATIC = ROOT / "service" / "static"
FILES = {
    f"/static/{folder.name}/{path.name}": {".js": "text/javascript", ".css": "text/css"}[
        path.suffix
    ]
    for folder in (STATIC / "page", STATIC / "lib", STATIC / "swagger-ui")
    for path in folder.iterdir()
    if path.suffix in (".js", ".css")
}
PATHS = {
    **dict.fromkeys(
        (
            "/v1/mu-macro/batch",
            "/v1/solve-for",
            "/v1/law",
            "/v1/motion",
            "/v1/stiffness",
            "/v1/fit",
        ),
        "POST",
    ),
    **dict.fromkeys(
        (
            "/v1/mu-macro.txt",
            "/v1/law.csv",
            "/v1/table",
            "/v1/table.nc",
            "/livez",
            "/readyz",
            "/healthz",
            "/metrics",
            "/docs",
            "/openapi.json",
        ),
        "GET, HEAD",
    ),
    "/v1/mu-macro": "GET, HEAD, POST",
}
UNITS = {name: SI[name][0] for name in FIELDS}
KEY = {"X-API-Key": "s3cret-key"}


@pytest.mark.parametrize(
    "path",
    [
        *("/nowhere", "/v1", "/v1/mu-macro/", "/v2/mu-macro", "/v1/mu_macro", "/V1/Law"),
        *("/readyz/", "/static/page/", "/static/../settings.py", "/%00"),
    ],
)
def test_an_unknown_path_is_told_where_all_are(client: Any, problem: Any, path: str) -> None:
    detail = problem(client.get(path), 404)["detail"]
    assert detail == "no such path; /docs describes all of them"


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("method", ["PUT", "DELETE", "PATCH", "OPTIONS"])
def test_a_wrong_method_is_answered_with_the_right_ones(
    client: Any, problem: Any, path: Any, method: Any
) -> None:
    response = client.request(method, path)
    problem(response, 405)
    assert response.headers["allow"] == PATHS[path]


@pytest.mark.parametrize(
    "offered", ["abc-123", "A.b_c:9", "x" * 128, "", "x" * 129, "a b", "a;b", 'a"b', "ä"]
)
def test_an_ill_formed_request_id_is_replaced(client: Any, offered: Any) -> None:
    request_id = client.get("/livez", headers={"X-Request-ID": offered.encode("latin-1")}).headers[
        "x-request-id"
    ]
    if offered in ("abc-123", "A.b_c:9", "x" * 128):
        assert request_id == offered
    else:
        assert len(request_id) == 32
        assert int(request_id, 16) >= 0


def test_an_unexpected_error_is_logged_and_not_shown(
    client: Any,
    case: Case,
    problem: Any,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for error, status, kind, wait in (
        (RuntimeError, 500, "unexpected", None),
        (MemoryError, 503, "out-of-memory", "1"),
    ):
        monkeypatch.setattr("mumacro.Surrogate.evaluate", Mock(side_effect=error("secret detail")))
        for response in (
            client.post("/v1/mu-macro", json=case),
            client.get("/v1/mu-macro", params=case),
        ):
            assert problem(response, status)["type"].endswith(kind)
            assert response.headers.get("retry-after") == wait
            assert "secret" not in response.text
    assert caplog.text.count("RuntimeError: secret detail") == 2
    assert "MemoryError: secret" not in caplog.text  # too little memory is no fault


def test_every_exception_is_the_kind_of_problem_that_the_table_names() -> None:
    scope = {"type": "http", "path": "/", "method": "GET", "headers": []}
    errors = {
        InputError: InputError("k", None, "a number"),
        TableError: TableError(Path("a.nc"), "missing"),
        MemoryError: MemoryError("secret"),
        Exception: LookupError("secret"),
    }
    kinds = {kind: errors[kind.exception] for kind in ProblemKind if kind.exception}
    assert len(kinds) == len(errors)
    for kind, error in kinds.items():
        told = meaning(error, scope)
        assert (told.kind, "secret" in told.detail, "{" in told.detail) == (kind, False, False)


@pytest.mark.parametrize(
    ("error", "logged"),
    [
        (HTTPException(400, cast("str", {"a set"})), "not JSON serializable"),
        (HTTPException(400, headers={"X-Why": "\u03bc"}), "latin-1"),
        (HTTPException(418, "a secret"), "a secret"),
    ],
)
@pytest.mark.parametrize("method", ["GET", "HEAD"])
def test_an_error_that_cannot_be_told_is_an_unexpected_one(
    started: Any,
    problem: Any,
    caplog: pytest.LogCaptureFixture,
    error: Any,
    logged: str,
    method: str,
) -> None:
    client = started()

    def fail() -> None:
        raise error

    client.app.add_api_route("/new", fail)
    with client:
        response = client.request(method, "/new")
    assert response.status_code == 500
    if method == "GET":
        assert "secret" not in problem(response, 500)["detail"]
    assert caplog.text.count("unexpected error") == 1
    assert logged in caplog.text


def test_a_path_that_is_no_text_is_not_there(client: Any) -> None:
    sent = []

    async def send(message: Any) -> None:
        sent.append(message)

    scope: dict[str, Any] = {
        "type": "http",
        "method": "GET",
        "path": "/\udcff",
        "query_string": b"",
    }
    scope |= {"http_version": "1.1", "headers": [(b"host", b"x")], "client": None}
    asyncio.run(client.app(scope, AsyncMock(), send))
    assert sent[0]["status"] == 404
    assert json.loads(sent[1]["body"])["instance"] == "/?"


@pytest.fixture(scope="module")
def closed(started: Any) -> Any:
    with started(api_key=KEY["X-API-Key"]) as client:
        yield client


NO_KEY = [
    {},
    {"X-API-Key": "wrong"},
    {"X-API-Key": ""},
    {"X-API-Key": b"s3cret-key\xe4"},
    {"Authorization": "Bearer wrong"},
    {"Authorization": "Basic s3cret-key"},
    {"Authorization": "s3cret-key"},
]


def test_every_route_but_the_pages_and_the_probes_needs_the_key(closed: Any, problem: Any) -> None:
    open_to_all = {"/livez", "/readyz", "/healthz", "/", "/docs", "/static/page/names.json", *FILES}
    described = closed.get("/openapi.json", headers=KEY).json()
    assert described["security"] == [{"key": []}, {"bearer": []}]
    assert set(described["paths"]) <= set(PATHS)
    for path in {*PATHS, "/static/page/map.json", "/nowhere"} | open_to_all:
        for method in ("GET", "HEAD", "POST", "PUT"):
            response = closed.request(method, path)
            assert (response.status_code != 401) == (path in open_to_all), (
                f"{method} {path}: {response.status_code}"
            )
            assert closed.request(method, path, headers=KEY).status_code != 401
    for path in (
        "/livez/",
        "/docs/../v1/table",
        "/static/page/../../v1/table",
        "/V1/TABLE",
        "/%2fv1/table",
    ):
        assert closed.get(path).status_code == 401
    for headers in NO_KEY:
        for method, path in (
            ("GET", "/v1/mu-macro"),
            ("POST", "/v1/mu-macro/batch"),
            ("GET", "/nowhere"),
        ):
            response = closed.request(method, path, headers=headers)
            problem(response, 401)
            assert "s3cret" not in response.text
            assert response.headers["www-authenticate"] == "Bearer"


def test_a_route_that_nobody_thought_of_needs_the_key(started: Any) -> None:
    client = started(api_key=KEY["X-API-Key"])
    client.app.add_api_route("/new", lambda: "open")
    with client:
        assert client.get("/new").status_code == 401
        assert client.get("/new", headers=KEY).json() == "open"


@pytest.mark.parametrize("path", ["/v1/mu-macro?mu0=-1", "/v1/table.nc?x=1", "/nowhere", "/docs"])
def test_an_answer_to_head_has_the_head_of_get_and_no_body(started: Any, path: str) -> None:
    with started() as client:
        one, other = client.head(path), client.get(path)
    assert (one.status_code, one.content) == (other.status_code, b"")
    assert one.headers["content-type"] == other.headers["content-type"]


def test_what_fails_at_the_start_is_told_as_it_is(started: Any) -> None:
    client = started()
    client.app.state.tables.load = Mock(side_effect=RuntimeError("no disk"))
    with pytest.raises(RuntimeError, match="no disk"), client:
        pass


def test_a_direct_route_has_no_dependency_that_it_would_not_solve() -> None:
    router = APIRouter(route_class=DirectRoute)

    async def answer(request: Request, case: CaseRequest) -> None: ...

    with pytest.raises(TypeError, match="does not solve"):
        router.post("/x", dependencies=[Depends(lambda: None)])(answer)


@pytest.mark.parametrize("headers", [KEY, {"Authorization": "bearer s3cret-key"}])
def test_the_key_gives_access(closed: Any, case: Case, headers: Any) -> None:
    response = closed.get("/v1/mu-macro", params=case, headers=headers)
    assert response.status_code == 200
    assert response.headers["cache-control"] == "private, max-age=3600"
    assert response.headers["vary"] == "X-API-Key, Authorization"


def test_a_key_is_given_once_and_may_have_blanks_around_it(
    closed: Any, case: Case, problem: Any
) -> None:
    for name, value in (("X-API-Key", "s3cret-key"), ("Authorization", "Bearer s3cret-key")):
        problem(
            closed.get("/v1/mu-macro", params=case, headers=[(name, value), (name, "wrong")]), 400
        )
        spaced = {name: f"{value} \t"}
        assert closed.get("/v1/mu-macro", params=case, headers=spaced).status_code == 200


@pytest.mark.parametrize(
    ("path", "members"),
    [
        ("/v1/mu-macro", {}),
        ("/v1/mu-macro", {"std_k": None}),
        ("/v1/law", {"start": 1e-3, "stop": 1.0}),
        ("/v1/solve-for", {"unknown": "v0", "target": 0.1}),
        ("/v1/motion", {"x": None}),
        ("/v1/mu-macro/batch", {}),
    ],
)
def test_time_to_refuse_grows_no_faster_than_the_body(
    client: Any, case: Case, path: str, members: dict[str, Any]
) -> None:
    """Unknown names, one name again and again, long texts, and what is nested deeply."""
    within = next((name for name, value in members.items() if value is None), None)

    def bodies(size: int) -> list[str]:
        start = json.dumps({**case, **members})[:-1].replace("null", "{")
        end = "}}" if within else "}"
        start = start if within else f"{start},"
        names = [f'"{i:04x}":0' for i in range(size // 9)]
        texts = [",".join(names), ",".join([*names, names[0]]), f'"a":"{"x" * size}"']
        return [start + text + end for text in texts] + ['{"a":' + "[" * size]

    def seconds(body: str) -> float:
        times = []
        for _ in range(5):
            begun = time.process_time()
            assert client.post(path, content=body).status_code in (400, 422)
            times.append(time.process_time() - begun)
        return min(times)

    for short, long in zip(bodies(4_000 - 300), bodies(64_000 - 300), strict=True):
        assert seconds(long) / seconds(short) < 64.0, short[:300]


def test_a_body_has_a_limit_with_and_without_a_length(
    started: Any, case: Case, problem: Any
) -> None:
    body = json.dumps(case).encode()
    with started(max_body_bytes=1024) as narrow:
        assert narrow.post("/v1/mu-macro", content=body.ljust(1024)).status_code == 200
        for path in ("/v1/mu-macro", "/v1/mu-macro/batch"):
            for content in (body.ljust(1025), b"x" * 100_000, iter([b" " * 100] * 10_000)):
                response = narrow.post(path, content=content)
                assert problem(response, 413)["max_bytes"] == 1024
                assert response.headers["connection"] == "close"


def test_the_description_is_whole(client: Any) -> None:
    document = client.get("/openapi.json").json()
    schemas = document["components"]["schemas"]
    inputs = {*UNITS, "f", "Fz_amplitude"}
    words = {"contact", "direction", "k_low", "k_high", *DEVIATIONS}
    assert set(schemas["Case"]["properties"]) == {*inputs, *words}
    assert set(schemas["CaseColumns"]["properties"]) == set(schemas["CaseRequest"]["properties"])
    assert all(
        f"[{UNITS[name]}]" in schemas["Case"]["properties"][name]["description"] for name in UNITS
    )
    parameters = {
        one["name"]: one["required"]
        for one in document["paths"]["/v1/mu-macro"]["get"]["parameters"]
    }
    options = {
        "k_low",
        "k_high",
        "include",
        "tolerance",
        "contact",
        "direction",
        *(f"std_{name}" for name in inputs),
    }
    assert parameters.keys() == inputs | options
    required = {name for name, needed in parameters.items() if needed}
    assert required == set(schemas["Case"]["required"]) == {"mu0", "Fz", "v0"}


def allows(schema: Any, members: set[str]) -> bool:
    """Whether a schema allows an object of these members, as far as their names go."""
    return (
        members >= set(schema.get("required", ()))
        and all(allows(part, members) for part in schema.get("allOf", ()))
        and ("anyOf" not in schema or any(allows(part, members) for part in schema["anyOf"]))
        and ("oneOf" not in schema or sum(allows(one, members) for one in schema["oneOf"]) == 1)
        and all(
            members >= set(others)
            for name, others in schema.get("dependentRequired", {}).items()
            if name in members
        )
        and not ("not" in schema and allows(schema["not"], members))
    )


_INTERVAL = {"k_low": 1e6, "k_high": 2e6}


@pytest.mark.parametrize(
    ("name", "path", "fixed", "varied", "exact"),
    [
        ("CaseRequest", "/v1/mu-macro", {}, ("k", *_INTERVAL, "y0", "omega", "f"), True),
        ("CaseColumns", "/v1/mu-macro/batch", {}, ("k", *_INTERVAL, "y0", "omega", "f"), True),
        ("MotionRequest", "/v1/motion", {"k": 1e6}, ("x", "omega", "f"), True),
        (
            "LawRequest",
            "/v1/law",
            {"start": 0.01, "stop": 1.0, "points": 2},
            ("k", *_INTERVAL, "y0", "omega", "f", "v0"),
            False,
        ),
        (
            "SolveForRequest",
            "/v1/solve-for",
            {"unknown": "k", "target": 0.2},
            ("k", "y0", "omega", "f"),
            False,
        ),
    ],
)
def test_the_description_has_the_alternatives(
    client: Any, name: str, path: str, fixed: Any, varied: Any, exact: bool
) -> None:
    """A body is answered if, and where nothing is left out only if, its schema allows it."""
    schema = client.get("/openapi.json").json()["components"]["schemas"][name]
    values = {**EXAMPLE, **_INTERVAL, "omega": 1.3e5, "x": 1e-6, "y": 2e-6, "normal": 1.0}
    required = {one: values[one] for one in ("mu0", "Fz", "v0") if one not in varied}
    allowed = set()
    for n in range(len(varied) + 1):
        for names in itertools.combinations(varied, n):
            body = required | fixed | {one: values[one] for one in names}
            status = client.post(path, json=body).status_code
            assert status in (200, 422)
            allowed.add(allows(schema, set(body)))
            if exact or status == 200:
                assert allows(schema, set(body)) == (status == 200), names
    assert allowed == {True, False}


def test_every_default_of_the_description_may_be_sent(client: Any) -> None:
    """A client that sends every default must be answered: null in k never is."""
    schemas = client.get("/openapi.json").json()["components"]["schemas"]
    for name in ("Case", "CaseRequest", "CaseColumns", "LawRequest", "MotionRequest"):
        assert None not in [one.get("default", 0) for one in schemas[name]["properties"].values()]


def examples_of(operation: Any, schemas: Any) -> Any:
    """Arguments of the requests that an operation shows; one without input has the empty one."""
    bodies = operation.get("requestBody", {}).get("content", {})
    for media_type, content in bodies.items():
        schema = schemas.get(content["schema"].get("$ref", "").rpartition("/")[2], {})
        examples = [
            *schema.get("examples", []),
            *([content["example"]] if "example" in content else []),
        ]
        assert examples, f"{media_type} has no example"
        for example in examples:
            text = example if isinstance(example, str) else json.dumps(example)
            yield {"content": text, "headers": {"Content-Type": media_type}}
    if not bodies:
        kinds = {each["name"]: each["schema"] for each in operation.get("parameters", [])}
        yield {
            "params": {
                name: kind["examples"][0] for name, kind in kinds.items() if "examples" in kind
            }
        }


def test_the_described_examples_are_answered(client: Any) -> None:
    document = client.get("/openapi.json").json()
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            examples = list(examples_of(operation, document["components"]["schemas"]))
            assert examples
            for example in examples:
                answer = client.request(method, path, **example)
                assert answer.status_code == 200, f"{method} {path}: {answer.text}"
                assert b"urn:problem-type" not in answer.content


def test_the_page_loads_nothing_from_elsewhere(client: Any) -> None:
    for path in ("/", "/docs"):
        page = client.get(path)
        assert page.headers["content-type"].startswith("text/html")
        loaded = re.sub(r'<a [^>]*href="https://[^"]*"', "", page.text)  # a link loads nothing
        assert not re.search(r"<script(?![^>]*src=)|<style|style=|\son\w+=|https?:|//", loaded)
    for path, media_type in FILES.items():
        assert path[1:] in page.text or "swagger" not in path
        asset = client.get(path)
        assert (asset.status_code, asset.headers["content-type"].split(";")[0]) == (200, media_type)
        if path.startswith("/static/page/"):  # every part is served; a name of XML is no address
            assert "://" not in asset.text.replace("http://www.w3.org/2000/svg", "")
            assert {
                urljoin(path, name) for name in re.findall(r'from "(\.\.?/[^"]+)"', asset.text)
            } <= FILES.keys()


@pytest.mark.parametrize("path", ["/", "/docs", "/v1/table.nc", *FILES])
def test_a_page_that_the_client_has_is_not_sent_again(client: Any, path: Any) -> None:
    first = client.get(path)
    tag = first.headers["etag"]
    for offered in (tag, f"W/{tag}", f'"other", {tag}', "*"):
        again = client.get(path, headers={"If-None-Match": offered})
        assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", tag)
        for name in ("cache-control", "content-security-policy"):
            assert again.headers.get(name) == first.headers.get(name)
    assert client.get(path, headers={"If-None-Match": '"other"'}).content == first.content
    assert client.head(path, headers={"If-None-Match": tag}).status_code == 304


@pytest.mark.parametrize(
    ("byte_range", "status"),
    [
        ("bytes=99999999-", 416),
        ("bytes=-0", 416),
        ("bytes=0-1,99999999-", 416),
        ("bytes=5-2", 400),
        ("lines=1-2", 400),
        ("nonsense", 400),
        ("bytes=", 400),
        ("bytes=a-b", 400),
        ("bytes=\xff-", 400),
    ],
)
@pytest.mark.parametrize("path", ["/v1/table.nc", "/", "/static/page/main.js"])
def test_a_range_beyond_the_file_is_a_problem(
    client: Any, problem: Any, path: Any, byte_range: Any, status: Any
) -> None:
    response = client.get(path, headers={"Range": byte_range.encode("latin-1")})
    problem(response, status)
    size = client.get(path).headers["content-length"]
    assert response.headers.get("content-range") == (f"bytes */{size}" if status == 416 else None)


def test_every_answer_has_the_security_headers(client: Any, case: Case) -> None:
    for path in ("/", "/docs"):
        page = client.get(path)
        policy = page.headers["content-security-policy"]
        assert page.headers["referrer-policy"] == "no-referrer"
        assert all(
            f"{name} 'none'" in policy for name in ("default-src", "frame-ancestors", "base-uri")
        )
        assert all(f"{name} 'self'" in policy for name in ("script-src", "connect-src"))
        assert "unsafe" not in policy or path == "/docs"
    for response in (
        client.get("/v1/mu-macro", params=case),
        client.post("/v1/mu-macro/batch", json=[case]),
        client.get("/nowhere"),
        client.post("/v1/mu-macro", content=b"{"),
        client.put("/livez"),
        client.get("/v1/table.nc"),
        client.get("/docs"),
    ):
        assert response.headers["x-content-type-options"] == "nosniff"
        assert not {"access-control-allow-origin", "server", "set-cookie"} & response.headers.keys()
    assert client.get("/nowhere").headers["cache-control"] == "no-store"


def test_pages_of_other_hosts_are_answered_only_where_a_setting_allows_them(started: Any) -> None:
    preflight = {"Origin": "https://tool.example", "Access-Control-Request-Method": "POST"}
    with started(cors_origins=("https://tool.example",)) as client:
        allowed, answer = (
            client.options("/v1/mu-macro", headers=preflight),
            client.get("/livez", headers=preflight),
        )
        for response in (allowed, answer):
            assert response.headers["access-control-allow-origin"] == "https://tool.example"
        assert allowed.headers["access-control-allow-methods"] == "GET, HEAD, POST"
        refused = client.options(
            "/v1/mu-macro", headers={**preflight, "Origin": "https://other.example"}
        )
        assert "access-control-allow-origin" not in refused.headers


@pytest.mark.parametrize("path", ["/v1/mu-macro", "/v1/mu-macro/batch", "/v1/law", "/nowhere"])
def test_a_websocket_is_closed_and_harms_nobody(client: Any, path: str) -> None:
    with pytest.raises(WebSocketDisconnect), client.websocket_connect(path):
        pass
    assert client.get("/livez").status_code == 200


def test_a_preflight_has_an_id_a_line_and_a_counter(started: Any) -> None:
    asked = {"Origin": "https://tool.example", "Access-Control-Request-Method": "POST"}
    with started(cors_origins=("https://tool.example",)) as client:
        answer = client.options("/v1/law", headers=asked | {"X-Request-ID": "mine"})
        assert (answer.status_code, answer.headers["x-request-id"]) == (200, "mine")
        assert answer.headers["access-control-allow-origin"] == "https://tool.example"
        counter = 'mumacro_requests_total{method="other",route="/v1/law",status="200"} 1.0'
        assert counter in client.get("/metrics").text
        refused = client.post("/v1/law", json={}, headers={"Origin": "https://tool.example"})
        assert refused.status_code == 422
        assert refused.headers["access-control-allow-origin"] == "https://tool.example"

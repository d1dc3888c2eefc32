"""Clients and servers that speak more than HTTP/1.1: their requests are answered like any other."""

import asyncio
import json
import shutil
import subprocess
from typing import Any

import pytest

from service.app import create_app
from service.settings import Settings
from tests.support.places import ROOT, TABLES
from tests.support.serving import CASE, chunk, connect, to_end

SINGLE = "/v1/mu-macro"
BODY = json.dumps(CASE).encode()
UPGRADE = (
    b"Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\n"
    b"HTTP2-Settings: AAEAAEAAAAIAAAABAAMAAABkAAQBAAAAAAUAAEAA\r\n"
)
POST = b"POST /v1/mu-macro HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
GET = b"GET /livez HTTP/1.1\r\nHost: x\r\n"


@pytest.fixture(scope="module")
def plain(live_server: Any) -> bytes:
    """The body of the answer to a request that asks for nothing else."""
    status, _, body = live_server.ask("POST", SINGLE, BODY)
    assert status == 200
    return bytes(body)


@pytest.mark.parametrize("step", [1, 50, 10_000])
@pytest.mark.parametrize(
    "framed",
    [
        b"Content-Length: %d\r\n\r\n" % len(BODY) + BODY,
        b"Transfer-Encoding: chunked\r\n\r\n" + chunk(BODY[:9]) + chunk(BODY[9:]) + chunk(b""),
    ],
    ids=["length", "chunks"],
)
def test_a_request_to_upgrade_is_answered_with_its_body(
    live_server: Any, plain: bytes, framed: bytes, step: int
) -> None:
    """And so is the request that follows on the same connection."""
    text = POST + UPGRADE + framed
    with connect(live_server) as raw:
        for _ in range(2):
            for start in range(0, len(text), step):
                raw.sendall(text[start : start + step])
            received = b""
            while not received.endswith(plain):
                piece = raw.recv(65536)
                assert piece, received
                received += piece
            assert received.startswith(b"HTTP/1.1 200 ")
        raw.sendall(GET + b"Connection: close, Upgrade\r\nUpgrade: websocket\r\n\r\n")
        assert to_end(raw).startswith(b"HTTP/1.1 200 ")


@pytest.mark.parametrize("body", [b"", BODY], ids=["no body", "a body"])
def test_limits_hold_for_a_request_to_upgrade(live_server: Any, body: bytes) -> None:
    for more, status in (
        (b"a: b\r\n" * 99, b" 431 "),
        (b"A: " + b"b" * 66_000 + b"\r\n", b" 431 "),
    ):
        with connect(live_server) as raw:
            raw.sendall(POST + UPGRADE + more + b"Content-Length: %d\r\n\r\n" % len(body) + body)
            assert status in to_end(raw)[:20]


def test_a_head_of_http_2_without_its_framing_is_bad(live_server: Any) -> None:
    for text in (b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", b"GET /livez HTTP/2.0\r\nHost: x\r\n\r\n"):
        with connect(live_server) as raw:
            raw.sendall(text)
            assert to_end(raw).startswith(b"HTTP/1.1 400 ")


async def asked(
    app: Any,
    version: str,
    host: bool,
    method: str,
    path: str,
    body: bytes = b"",
    stops: bool = False,
) -> tuple[int, bytes]:
    """As another server calls the application; ``stops``: the rest of the body never comes."""
    headers = [(b"content-type", b"application/json"), *([(b"host", b"x")] if host else [])]
    scope: dict[str, Any] = {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": version,
    }
    scope |= {"method": method, "path": path, "raw_path": path.encode(), "query_string": b""}
    scope |= {"root_path": "", "scheme": "https", "headers": headers}
    scope |= {"client": ("127.0.0.1", 1), "server": ("127.0.0.1", 2)}
    sent: list[Any] = []
    pieces = iter([{"type": "http.request", "body": body, "more_body": stops}])

    async def receive() -> Any:
        if (piece := next(pieces, None)) is None:
            await asyncio.Event().wait()
        return piece

    async def send(message: Any) -> None:
        sent.append(message)

    await app(scope, receive, send)
    return sent[0]["status"], b"".join(message.get("body", b"") for message in sent)


def test_an_application_answers_requests_of_other_versions() -> None:
    """As servers that speak HTTP/2 call it, with and without a Host."""
    app = create_app(Settings(tables=(TABLES,)))

    async def all_of_them() -> None:
        async with app.router.lifespan_context(app):
            for as_sent in (("2", False), ("2", True), ("3", False)):
                assert (await asked(app, *as_sent, "GET", "/readyz"))[0] == 200
                status, answer = await asked(app, *as_sent, "POST", SINGLE, BODY)
                assert (status, json.loads(answer)["regime"]) == (200, "stick_slip")
            assert (await asked(app, "1.1", False, "GET", "/readyz"))[0] == 400

    asyncio.run(all_of_them())


@pytest.mark.parametrize("path", [SINGLE, f"{SINGLE}/batch", "/v1/motion"])
def test_under_another_server_a_body_that_stops_is_given_up(path: str) -> None:
    """Our own server limits the wait for a small body; another one does not."""
    app = create_app(Settings(tables=(TABLES,), client_timeout_s=1))

    async def stopped() -> tuple[int, bytes]:
        async with app.router.lifespan_context(app):
            asking = asked(app, "1.1", True, "POST", path, BODY[:9], stops=True)
            return await asyncio.wait_for(asking, 20.0)

    status, text = asyncio.run(stopped())
    assert (status, json.loads(text)["title"]) == (408, "The request did not come in time")


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("java") is None, reason="java is not installed")
def test_the_client_of_java_is_answered(live_server: Any, plain: bytes) -> None:
    program = ROOT / "tests" / "support" / "Client.java"
    words = ["java", str(program), f"{live_server.url}{SINGLE}", BODY.decode()]
    done = subprocess.run(words, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [f"200 {plain.decode()}"] * 2


@pytest.mark.skipif(shutil.which("curl") is None, reason="curl is not installed")
def test_curl_is_answered_when_it_asks_for_http_2(live_server: Any, plain: bytes) -> None:
    words = ["curl", "-sS", "--http2", "-H", "Content-Type: application/json"]
    words += ["-d", BODY.decode(), "-w", "\n%{http_version} %{http_code}"]
    done = subprocess.run([*words, f"{live_server.url}{SINGLE}"], capture_output=True, check=False)
    assert (done.returncode, done.stdout) == (0, plain + b"\n1.1 200")

"""HTTP/1.1 as bytes on a socket: the responses and their order, for any division of the bytes."""

import asyncio
import http.client
import json
import socket
from types import SimpleNamespace

import pytest

from service.connection import Connection

pytestmark = pytest.mark.slow

SINGLE, BATCH = "/v1/mu-macro", "/v1/mu-macro/batch"
GET = b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n"
LAST = b"GET /livez HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"


@pytest.fixture
def raw(live_server):
    host, _, port = live_server.url.removeprefix("http://").rpartition(":")
    with socket.create_connection((host, int(port)), timeout=30) as made:
        yield made


def rest(raw):
    """All bytes until the service closes."""
    received = b""
    while piece := raw.recv(65536):
        received += piece
    return received


def post(path, body, extra=""):
    fields = f"Host: x\r\nContent-Type: application/json\r\nContent-Length: {len(body)}\r\n{extra}\r\n"
    return f"POST {path} HTTP/1.1\r\n{fields}".encode() + body


def chunked(path, pieces):
    fields = "Host: x\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
    body = b"".join(b"%x\r\n%b\r\n" % (len(piece), piece) for piece in pieces)
    return f"POST {path} HTTP/1.1\r\n{fields}".encode() + body + b"0\r\n\r\n"


@pytest.mark.parametrize("size", [1, 2, 7, 64, 1000])
def test_the_answers_do_not_depend_on_how_the_bytes_come(raw, case, size):
    body = json.dumps(case).encode()
    text = post(SINGLE, body) + GET + chunked(SINGLE, [body[:40], body[40:]]) + b"\r\n" + post(BATCH, b"[]") + LAST
    for start in range(0, len(text), size):
        raw.sendall(text[start : start + size])
    received = rest(raw)
    assert received.count(b"HTTP/1.1 200 OK\r\n") == 5
    assert received.count(b'"mu_macro":0.24001211754819618') == 2
    assert received.rstrip().endswith(b"}")
    assert received.count(b"connection: close") == 1


@pytest.mark.parametrize("many", [2, 600, 5000])
def test_pipelined_requests_are_answered_in_order(raw, many):
    wanted = [b"/livez" if i % 2 else b"/nothing%d" % i for i in range(many)]
    received = bytearray()
    for start in range(0, many, 500):
        part = wanted[start : start + 500]
        raw.sendall(b"".join(b"GET %b HTTP/1.1\r\nHost: x\r\n\r\n" % path for path in part))
        while received.count(b"HTTP/1.1 ") < start + len(part) or not received.endswith(b"}"):
            received += raw.recv(65536)
    statuses = [int(part[:3]) for part in bytes(received).split(b"HTTP/1.1 ")[1:]]
    assert statuses == [200 if path == b"/livez" else 404 for path in wanted]


def test_a_half_closed_client_gets_the_whole_answer(raw, case):
    raw.sendall(post(BATCH, json.dumps({**case, "v0": [1e-6 * i for i in range(1, 50_001)]}).encode()))
    raw.shutdown(socket.SHUT_WR)
    received = rest(raw)
    assert b'"n_errors":0' in received[-2000:]
    assert received.endswith(b"0\r\n\r\n")


@pytest.mark.parametrize("path", [SINGLE, BATCH])
@pytest.mark.parametrize("before", [b"", GET])
def test_a_client_that_ends_within_a_body_is_disconnected_at_once(raw, path, before):
    raw.settimeout(10)  # less than the timeout for a slow client
    raw.sendall(before + f"POST {path} HTTP/1.1\r\nHost: x\r\nContent-Length: 100\r\n\r\n".encode() + b"{")
    raw.shutdown(socket.SHUT_WR)
    received = rest(raw)
    assert received.count(b" 200 ") == (1 if before else 0)


def served(app, request, *, stopping=False):
    """The bytes that the connection sends with this application, perhaps after the server has begun to stop."""

    async def talk():
        state = SimpleNamespace(connections=set(), tasks=set(), total_requests=0, default_headers=[(b"date", b"now")])
        config = SimpleNamespace(
            loaded=True, loaded_app=app, asgi_version="3.0", root_path="", timeout_keep_alive=5, limit_concurrency=None
        )
        loop = asyncio.get_running_loop()
        server = await loop.create_server(lambda: Connection(config, state, {}), "127.0.0.1", 0)
        reader, writer = await asyncio.open_connection(*server.sockets[0].getsockname())
        if stopping:
            while not state.connections:
                await asyncio.sleep(0.0)
            next(iter(state.connections)).shutdown()
        writer.write(request)
        received = await asyncio.wait_for(reader.read(), 10)
        writer.close()
        await writer.wait_closed()
        while state.connections:
            await asyncio.sleep(0.01)
        server.close()
        await server.wait_closed()
        return received

    return asyncio.run(talk())


def test_an_answer_without_fields_is_whole():
    answer = b"HTTP/1.1 204 No Content\r\ndate: now\r\n"
    assert served(empty, GET + LAST) == answer + b"\r\n" + answer + b"connection: close\r\n\r\n"


async def empty(_scope, _receive, send):
    await send({"type": "http.response.start", "status": 204, "headers": []})
    await send({"type": "http.response.body"})


def test_large_bodies_and_the_requests_behind_them_are_kept_apart():
    bodies = [bytes([97 + i]) * size for i, size in enumerate((0, 300_000, 5, 16_384, 70_000, 1, 65_536, 600_000))]
    received = served(echo, b"".join(post("/", body) for body in bodies) + LAST)
    head = b"HTTP/1.1 200 OK\r\ndate: now\r\ncontent-length: %d\r\n"
    wanted = [head % len(body) + b"\r\n" + body for body in bodies]
    assert received == b"".join(wanted) + head % 0 + b"connection: close\r\n\r\n"


async def echo(_scope, receive, send):
    body, more = b"", True
    while more:
        message = await receive()
        body, more = body + message["body"], message["more_body"]
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"%d" % len(body))]})
    await send({"type": "http.response.body", "body": body})


def test_a_request_that_was_on_its_way_when_the_server_stopped_is_answered():
    answer = b"HTTP/1.1 204 No Content\r\ndate: now\r\nconnection: close\r\n\r\n"
    assert served(empty, GET, stopping=True) == answer
    assert served(empty, b"", stopping=True) == b""


@pytest.mark.parametrize("behind", [b"", GET])
def test_an_application_that_ends_without_an_answer_is_reported(behind):
    async def silent(_scope, _receive, _send):
        pass

    received = served(silent, GET + behind)
    assert received.startswith(b"HTTP/1.1 500 ")
    assert received.count(b"HTTP/1.1") == 1


@pytest.mark.parametrize("field", [(b"x-a", b"1\r\nx-b: 2"), (b"x-a\n", b"1"), (b"x-a", b"\0")])
def test_a_field_that_would_break_the_head_is_not_written(field):
    async def broken(_scope, _receive, send):
        await send({"type": "http.response.start", "status": 200, "headers": [field]})

    assert served(broken, GET).startswith(b"HTTP/1.1 500 ")


@pytest.mark.parametrize("try_number", range(10))
def test_a_client_that_sends_too_much_can_read_the_reason(live_server, try_number):
    del try_number  # a reset would occur in about half of the tries
    host, _, port = live_server.url.removeprefix("http://").rpartition(":")
    connection = http.client.HTTPConnection(host, int(port), timeout=30)
    connection.request("POST", SINGLE, b" " * 3_000_000, {"Content-Type": "application/json"})
    response = connection.getresponse()
    assert response.status == 413
    assert json.loads(response.read())["status"] == 413
    connection.close()


@pytest.mark.parametrize(
    "text",
    [
        b"POST /v1/mu-macro HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\nContent-Length: 6\r\n\r\nhello",
        b"POST /v1/mu-macro HTTP/1.1\r\nHost: x\r\nContent-Length: -5\r\n\r\nhello",
        b"POST /v1/mu-macro HTTP/1.1\r\nHost: x\r\nContent-Length: 0x5\r\n\r\nhello",
        b"POST /v1/mu-macro HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\nContent-Length: 5\r\n\r\nhello",
        b"GET /livez HTTP/1.1\r\nHost: x\r\nX-A: a\0b\r\n\r\n",
        b"GET /livez HTTP/1.1\r\nHost: x\r\n folded\r\n\r\n",
        b"GET /livez HTTP/1.1\r\nX A: b\r\n\r\n",
        b"GET /livez HTTP/1.1\r\n\r\n",
        b"GET /livez HTTP/1.1\r\nHost: x\r\nHost: x\r\n\r\n",
        b"GET /livez\r\n\r\n",
        b"GET /livez HTTP/2.0\r\nHost: x\r\n\r\n",
        b"POST /v1/mu-macro HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: gzip, chunked\r\n\r\n0\r\n\r\n",
        b"GET \xff HTTP/1.1\r\nHost: x\r\n\r\n",
        b"nonsense\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
    ],
)
def test_a_request_that_is_not_http_is_refused_and_closed(raw, text):
    raw.sendall(GET)
    first = raw.recv(65536)
    raw.sendall(text)
    received = rest(raw)
    assert first.startswith(b"HTTP/1.1 200")
    assert received.startswith(b"HTTP/1.1 400")
    assert received.count(b"HTTP/1.1 ") == 1


def test_good_requests_are_answered_before_a_malformed_one(raw, case):
    raw.sendall(post(SINGLE, json.dumps(case).encode()) + GET + b"nonsense\r\n\r\n")
    received = rest(raw)
    assert received.count(b"HTTP/1.1 200") == 2
    assert b"connection: close" in received


def test_http_1_0_is_answered_and_closed(raw):
    raw.sendall(b"GET /livez HTTP/1.0\r\n\r\n")
    assert rest(raw).startswith(b"HTTP/1.1 200")


def test_a_client_that_expects_100_continue_gets_it(raw, case):
    body = json.dumps(case).encode()
    whole = post(SINGLE, body, "Expect: 100-continue\r\nConnection: close\r\n")
    raw.sendall(whole[: -len(body)])
    assert raw.recv(65536) == b"HTTP/1.1 100 Continue\r\n\r\n"
    raw.sendall(body)
    assert rest(raw).startswith(b"HTTP/1.1 200")


def test_head_has_the_head_of_get_and_no_body(raw):
    raw.sendall(b"HEAD /livez HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
    received = rest(raw)
    assert received.endswith(b"\r\n\r\n")
    assert b"content-length: 62\r\n" in received


def test_fields_behind_a_body_are_read_and_dropped(raw, case):
    text = chunked(SINGLE, [json.dumps(case).encode()]).removesuffix(b"\r\n") + b"x-request-id: stray\r\n\r\n"
    raw.sendall(text + LAST)
    received = rest(raw)
    assert received.count(b"HTTP/1.1 200") == 2
    assert b"stray" not in received

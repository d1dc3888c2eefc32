"""HTTP/1.1 as bytes on a socket: the limits of a connection, and that one client cannot keep others out."""

import contextlib
import http.client
import json
import socket
import threading
import time

import pytest

SINGLE, BATCH = "/v1/mu-macro", "/v1/mu-macro/batch"
GET = b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n"
LAST = b"GET /livez HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"
WAIT_S = 1  # the client timeout of the strict service
FULL = 6  # its connections


@pytest.fixture(scope="module")
def strict(serving, surrogate):
    """A service with short times and few connections."""
    with serving(
        surrogate.path, MUMACRO_CLIENT_TIMEOUT_S=str(WAIT_S), MUMACRO_TIME_LIMIT_S="4", MUMACRO_KEEP_ALIVE_S="60",
        MUMACRO_MAX_CONNECTIONS=str(FULL), MUMACRO_MAX_BATCHES="2",
    ) as server:  # fmt: skip
        yield server


def connect(port):
    return socket.create_connection(("127.0.0.1", port), timeout=30)


@pytest.fixture
def raw(live_server):
    with connect(int(live_server.url.rpartition(":")[2])) as made:
        yield made


def rest(raw):
    """All bytes until the service closes."""
    received = b""
    with contextlib.suppress(ConnectionResetError):
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


def answer(raw):
    """One answer."""
    response = http.client.HTTPResponse(raw)
    response.begin()
    return response.status, response.read()


@pytest.mark.parametrize("size", [1, 7, 64, 1000])
def test_the_answers_do_not_depend_on_how_the_bytes_come(raw, case, size):
    body = json.dumps(case).encode()
    requests = [post(SINGLE, body), GET, chunked(SINGLE, [body[:40], body[40:]]), post(BATCH, b"[]"), LAST]
    for text in requests:
        for start in range(0, len(text), size):
            raw.sendall(text[start : start + size])
        status, content = answer(raw)
        assert status == 200
        assert b"mu_macro" in content or text in (GET, LAST, requests[3])
    assert rest(raw) == b""


def test_a_second_request_before_the_answer_is_dropped_and_the_connection_closes(raw):
    raw.sendall(post(SINGLE, b"{}") + GET * 5000)
    received = rest(raw)
    assert received.count(b"HTTP/1.1 ") == 1
    assert received.startswith(b"HTTP/1.1 422 ")
    assert b"connection: close" in received


def test_a_half_closed_client_gets_the_whole_answer(raw, case):
    raw.sendall(post(BATCH, json.dumps({**case, "v0": [1e-6 * i for i in range(1, 50_001)]}).encode()))
    raw.shutdown(socket.SHUT_WR)
    received = rest(raw)
    assert b'"n_errors":0' in received[-2000:]
    assert received.endswith(b"0\r\n\r\n")


@pytest.mark.parametrize(
    ("text", "status"),
    [
        (b"GET /livez HTTP/1.1\r\n\r\n", 400),
        (b"GET /livez HTTP/1.1\r\nHost: x\r\nHost: y\r\n\r\n", 400),
        (b"nonsense\r\n\r\n", 400),
        (b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 4\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 400),
        (b"GET /livez HTTP/1.1\r\nHost: x\r\n" + b"a: b\r\n" * 99 + b"\r\n", 200),
        (b"GET /livez HTTP/1.1\r\nHost: x\r\n" + b"a: b\r\n" * 100 + b"\r\n", 431),
        (b"GET /livez HTTP/1.1\r\nHost: x\r\nA: " + b"b" * 65_000 + b"\r\n\r\n", 200),
        (b"GET /livez HTTP/1.1\r\nHost: x\r\nA: " + b"b" * 66_000 + b"\r\n\r\n", 431),
        (b"GET /" + b"b" * 66_000 + b" HTTP/1.1\r\nHost: x\r\n\r\n", 431),
    ],
)
def test_a_head_is_refused_with_its_status(raw, text, status):
    raw.sendall(text)
    found, content = answer(raw)
    assert found == status
    if status != 200:
        assert json.loads(content)["status"] == status


def test_a_head_without_an_end_is_cut_at_its_limit(raw):
    with contextlib.suppress(OSError):
        raw.sendall(b"GET /livez HTTP/1.1\r\nHost: x\r\nA: ")
        for _ in range(100):
            raw.sendall(b"b" * 100_000)
    assert not rest(raw).startswith(b"HTTP/1.1 200")


SLOW = {
    "silent": (b"", b""),
    "a head without an end": (b"GET /livez HTTP/1.1\r\nHost: x\r\nA: ", b" 408 "),
    "a body that stops": (post(SINGLE, b"x" * 90)[:-89], b" 408 "),
    "a batch that stops": (post(BATCH, b"x" * 90)[:-89], b" 408 "),
    "empty lines": (b"\r\n", b""),
}


@pytest.mark.parametrize("name", SLOW)
def test_a_client_that_stops_is_disconnected(strict, name):
    text, expected = SLOW[name]
    with connect(strict.port) as raw:
        raw.sendall(text)
        raw.settimeout(20 * WAIT_S)
        assert expected in rest(raw)


@pytest.mark.parametrize("drop", [b"A: b\r\n", b"\r\n"])
def test_a_client_that_drips_is_disconnected(strict, drop):
    with connect(strict.port) as raw:
        raw.sendall(b"GET /livez HTTP/1.1\r\nHost: x\r\n" if drop != b"\r\n" else b"")
        with pytest.raises(OSError, match=r"."):  # noqa: PT012
            for _ in range(200):
                raw.sendall(drop)
                time.sleep(0.1)


def test_a_client_that_does_not_read_is_disconnected(strict, case):
    body = json.dumps({**case, "v0": [1e-6 * i for i in range(1, 100_001)]}).encode()
    with socket.socket() as raw:
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        raw.settimeout(30)
        raw.connect(("127.0.0.1", strict.port))
        raw.sendall(post(BATCH, body))
        time.sleep(6 * WAIT_S)
        assert b'"n_errors"' not in rest(raw)


def test_a_stream_ends_at_the_deadline_however_busy(strict, case):
    line = json.dumps({**case, "v0": [0.1] * 10}).encode() + b"\n"
    head = (
        f"POST {BATCH} HTTP/1.1\r\nHost: x\r\nContent-Type: application/x-ndjson\r\nTransfer-Encoding: chunked\r\n\r\n"
    )
    with connect(strict.port) as raw:
        raw.sendall(head.encode())
        reader = threading.Thread(target=rest, args=(raw,))
        reader.start()
        with pytest.raises(OSError, match=r"."):  # noqa: PT012
            for _ in range(300):
                raw.sendall(b"%x\r\n%b\r\n" % (len(line), line))
                time.sleep(0.1)
        reader.join()


def test_streams_without_a_line_take_no_slot_and_questions_have_their_own(strict, case):
    head = (
        f"POST {BATCH} HTTP/1.1\r\nHost: x\r\nContent-Type: application/x-ndjson\r\nTransfer-Encoding: chunked\r\n\r\n"
    )
    large = json.dumps({**case, "v0": [0.1] * 20_000})
    law = json.dumps({**{name: case[name] for name in case if name != "v0"}, "start": 1e-3, "stop": 1.0})
    line = json.dumps(case).encode() + b"\n"
    with contextlib.ExitStack() as held:
        idle = [held.enter_context(connect(strict.port)) for _ in range(3)]
        for raw in idle:
            raw.sendall(head.encode())
        assert strict.ask("POST", BATCH, large)[0] == 200
        for raw in idle[:2]:  # now they have a slot each
            raw.sendall(b"%x\r\n%b\r\n" % (len(line), line))
            while b"mu_macro" not in raw.recv(65536):
                pass
        assert strict.ask("POST", BATCH, large)[0] == 503
        assert strict.ask("POST", "/v1/law", law)[0] == 200
        assert strict.ask("POST", BATCH, json.dumps([case]))[0] == 200  # a small one needs no slot


def test_health_is_answered_when_all_connections_are_open(strict, case):
    with contextlib.ExitStack() as held:
        for _ in range(3 * FULL):  # silent ones: the oldest gives way
            held.enter_context(connect(strict.port))
        assert strict.ask("GET", SINGLE + "?" + "&".join(f"{k}={v}" for k, v in case.items()))[0] == 200
    with contextlib.ExitStack() as held:
        for _ in range(FULL):  # busy ones
            raw = held.enter_context(connect(strict.port))
            raw.sendall(post(SINGLE, b"x" * 90)[:-89])
        time.sleep(0.2)
        assert strict.ask("GET", "/livez")[0] == 200
        assert strict.ask("GET", "/readyz")[0] == 200
        assert strict.ask("GET", "/v1/table")[0] == 503
    time.sleep(2 * WAIT_S)
    assert strict.ask("GET", "/v1/table")[0] == 200


def test_a_refused_body_is_read_for_a_while_so_that_its_sender_gets_the_reason(strict):
    status, headers, content = strict.ask("POST", SINGLE, b"x" * 3_000_000)
    assert status == 413
    assert headers["connection"] == "close"
    assert json.loads(content)["max_bytes"] == 65536

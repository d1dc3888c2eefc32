"""HTTP/1.1 as bytes on a socket: the limits of a connection, and that one client cannot keep others
out."""

import http.client
import json
import socket
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest

from mumacro import Surrogate
from tests.support.serving import CASE, chunk, connect, head, to_end

SINGLE, BATCH = "/v1/mu-macro", "/v1/mu-macro/batch"
GET = b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n"
LAST = b"GET /livez HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"
WAIT_S = 1  # the client timeout of the strict service
FULL = 40  # its connections
PATIENCE_S = 60  # longest wait in a test
END = chunk(b"")


def columns(n: int, **more: Any) -> Any:
    return json.dumps({**CASE, "v0": [1e-6 * i for i in range(1, n + 1)], **more}).encode()


@pytest.fixture(scope="module")
def strict(serving: Any, surrogate: Surrogate) -> Any:
    """A service with short times, few connections, and two long computations at a time."""
    with serving(
        surrogate.path,
        MUMACRO_CLIENT_TIMEOUT_S=str(WAIT_S),
        MUMACRO_TIME_LIMIT_S="4",
        MUMACRO_KEEP_ALIVE_S="60",
        MUMACRO_MAX_CONNECTIONS=str(FULL),
        MUMACRO_MAX_COMPUTATIONS="4",
    ) as server:
        yield server


@pytest.fixture
def raw(live_server: Any) -> Any:
    with connect(live_server) as connection:
        yield connection


def answer(raw: Any) -> Any:
    response = http.client.HTTPResponse(raw, method="POST")
    response.begin()
    return response.status, response.read()


def posted(path: Any, body: Any) -> Any:
    return head(path, len(body)) + body


def test_a_connection_is_kept_over_errors_and_ends_when_asked(raw: Any) -> None:
    for text, status in (
        (GET, 200),
        (b"GET /x HTTP/1.1\r\nHost: x\r\n\r\n", 404),
        (posted(SINGLE, b"{"), 400),
        (posted(BATCH, b"[]"), 200),
        (LAST, 200),
    ):
        raw.sendall(text)
        assert answer(raw)[0] == status
    assert to_end(raw) == b""


def test_a_head_is_complete_when_its_client_has_it(raw: Any) -> None:
    for _ in range(20):
        raw.sendall(b"HEAD /v1/table.nc HTTP/1.1\r\nHost: x\r\n\r\n")
        response = http.client.HTTPResponse(raw, method="HEAD")
        response.begin()
        assert int(response.headers["content-length"]) > 0
        raw.sendall(GET)
        assert answer(raw)[0] == 200


def test_a_second_request_before_the_answer_is_dropped_and_the_connection_closes(raw: Any) -> None:
    raw.sendall(posted(SINGLE, b"{}") + GET * 5000)
    received = to_end(raw)
    assert received.count(b"HTTP/1.1 ") == 1
    assert received.startswith(b"HTTP/1.1 422 ")
    assert b"connection: close" in received


def test_a_half_closed_client_gets_the_whole_answer(raw: Any) -> None:
    raw.sendall(posted(BATCH, columns(50_000)))
    raw.shutdown(socket.SHUT_WR)
    received = to_end(raw)
    assert b'"n_errors":0' in received[-2000:]
    assert received.endswith(END)


TWO_LENGTHS = (
    b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 4\r\nTransfer-Encoding: chunked\r\n\r\n" + END
)
HEADS = [
    (b"GET /livez HTTP/1.1\r\n\r\n", 400),
    (GET[:-2] + b"Host: y\r\n\r\n", 400),
    (b"nonsense\r\n\r\n", 400),
    (TWO_LENGTHS, 400),
    (GET[:-2] + b"a: b\r\n" * 99 + b"\r\n", 200),
    (GET[:-2] + b"a: b\r\n" * 100 + b"\r\n", 431),
    (GET[:-2] + b"A: " + b"b" * 65_000 + b"\r\n\r\n", 200),
    (GET[:-2] + b"A: " + b"b" * 66_000 + b"\r\n\r\n", 431),
    (b"GET /" + b"b" * 66_000 + b" HTTP/1.1\r\nHost: x\r\n\r\n", 431),
    (head(SINGLE, 300_000_000), 413),
    (head(BATCH, 300_000_000), 413),
    (b"GET /livez\r\n\r\n", 400),
    (GET[:-2] + b"Transfer-Encoding: gzip, chunked\r\n\r\n" + END, 400),
    (posted(SINGLE, b"{}").replace(b": 2\r\n", b": 2\t\r\n"), 422),
]


@pytest.mark.parametrize(("text", "status"), HEADS, ids=range(len(HEADS)))
def test_a_head_has_its_status(raw: Any, text: bytes, status: Any) -> None:
    raw.sendall(text)
    code, content = answer(raw)
    assert code == status
    assert status == 200 or json.loads(content)["status"] == status


#: what a client sends, what it sends again and again, and what is in the answer before the
#: connection ends
SLOW = {
    "silent": (b"", b"", b""),
    "empty lines": (b"\r\n", b"\r\n", b""),
    "a head without an end": (GET[:-4] + b"\r\nA: ", b"", b" 408 "),
    "a head, byte by byte": (GET[:-4] + b"\r\nA: ", b"x", b""),
    "a head after an answer": (GET + GET[:9], b"x", b" 200 "),
    "a body that stops": (head(SINGLE, 90) + b"x", b"", b" 408 "),
    "a batch that stops": (head(BATCH, 90) + b"x", b"", b" 408 "),
    "a body, byte by byte": (head(SINGLE, 5000), b" ", b""),
    "a batch, byte by byte": (head(BATCH, 60_000), b" ", b""),
    "chunks": (head(SINGLE, None), chunk(b" "), b""),
    "a batch in chunks": (head(BATCH, None), chunk(b" "), b""),
}


def until_closed(server: Any, text: bytes, drop: Any) -> Any:
    """All that a client gets until it is disconnected."""
    received, until = b"", time.monotonic() + PATIENCE_S
    with connect(server) as raw, suppress(ConnectionError):
        raw.settimeout(0.1)
        raw.sendall(text)
        while time.monotonic() < until:
            with suppress(TimeoutError):
                if not (piece := raw.recv(65536)):
                    return received
                received += piece
            time.sleep(0.05)
            raw.sendall(drop)
        pytest.fail("the connection was never closed")
    return received


def test_a_client_that_stops_or_drips_is_given_up(strict: Any) -> None:
    with ThreadPoolExecutor(len(SLOW)) as pool:
        texts = pool.map(lambda slow: until_closed(strict, *slow[:2]), SLOW.values())
        assert strict.ask("GET", "/livez")[0] == 200
        received = dict(zip(SLOW, texts, strict=True))
    assert {name: text for name, text in received.items() if SLOW[name][2] not in text} == {}


def test_a_client_that_does_not_read_is_disconnected_and_takes_little_memory(strict: Any) -> None:
    with connect(strict, receive_buffer=4096) as raw:
        raw.sendall(posted(BATCH, columns(100_000, include=["groups", "limits"])))
        time.sleep(3 * WAIT_S)
        received = to_end(raw)
    assert received.startswith(b"HTTP/1.1 200")
    assert not received.endswith(END)  # the answer, of some 20 MB, was not finished
    assert len(received) < 8_000_000


def test_a_client_that_leaves_within_a_body_frees_its_place(strict: Any) -> None:
    for sent in (300_000, 3_000_000, 3_000_000):  # one more than the batches allowed
        with connect(strict) as raw:
            raw.sendall(head(BATCH, 5_000_000) + b"[" + b" " * sent)
    deadline = time.monotonic() + PATIENCE_S
    while strict.ask("POST", BATCH, columns(20_000))[0] != 200:
        assert time.monotonic() < deadline


def test_a_body_that_is_too_large_is_read_for_a_while_so_that_its_sender_gets_the_reason(
    strict: Any,
) -> None:
    status, headers, content = strict.ask("POST", SINGLE, b"x" * 3_000_000)
    assert (status, headers["connection"]) == (413, "close")
    assert json.loads(content)["max_bytes"] == 65536


def test_a_limit_is_told_at_once_and_the_sender_may_go_on_sending(strict: Any) -> None:
    """A sender that pauses within its body must not be reset when it goes on."""
    with connect(strict) as raw:
        raw.sendall(head(SINGLE, 3_000_000))
        refusal = raw.recv(65536)
        assert refusal.startswith(b"HTTP/1.1 413")
        for _ in range(30):
            raw.sendall(b" " * 100_000)
        _, _, content = (refusal + to_end(raw)).partition(b"\r\n\r\n")
    assert json.loads(content)["max_bytes"] == 65536


def test_a_bad_head_lets_its_sender_go_on_sending(strict: Any) -> None:
    twice = "X-API-Key: a\r\nX-API-Key: b\r\n"
    with connect(strict) as raw:
        raw.sendall(head(SINGLE, 3_000_000, extra=twice).replace(b"POST", b"HEAD"))
        refusal = raw.recv(65536)
        assert refusal.startswith(b"HTTP/1.1 400")
        for _ in range(30):
            raw.sendall(b" " * 100_000)
            time.sleep(0.01)
        _, _, content = (refusal + to_end(raw)).partition(b"\r\n\r\n")
    assert content == b""


@pytest.mark.parametrize("path", [SINGLE, BATCH, "/v1/fit"])
def test_the_bytes_of_all_bodies_together_are_limited(
    serving: Any, surrogate: Surrogate, path: str
) -> None:
    with serving(surrogate.path, MUMACRO_MAX_HELD_BYTES="100000") as server:
        with connect(server) as first, connect(server) as second:
            first.sendall(head(path, 60_000) + b" " * 59_999)
            time.sleep(0.3)
            second.sendall(head(path, 60_000) + b" " * 30_000)
            refused = to_end(second)
            assert refused.startswith(b"HTTP/1.1 503")
            assert b"retry-after: " in refused
            assert server.ask("POST", SINGLE, json.dumps(CASE))[0] == 200
            first.sendall(b" ")
            assert answer(first)[0] == 400
        for _ in range(3):  # what the first one held is free again
            with connect(server) as third:
                third.sendall(posted(path, b" " * 60_000))
                assert answer(third)[0] == 400


def test_health_is_answered_when_all_connections_are_open(strict: Any) -> None:
    query = "&".join(f"{name}={value}" for name, value in CASE.items())
    with ExitStack() as connections:
        for _ in range(3 * FULL):  # silent ones: the oldest gives way
            connections.enter_context(connect(strict))
        assert strict.ask("GET", f"{SINGLE}?{query}")[0] == 200
    with ExitStack() as connections:
        for _ in range(FULL):  # busy ones
            connections.enter_context(connect(strict)).sendall(head(SINGLE, 90) + b"x")
        time.sleep(0.2)
        assert [strict.ask("GET", path)[0] for path in ("/livez", "/readyz", "/v1/table")] == [
            200,
            200,
            503,
        ]
    time.sleep(2 * WAIT_S)
    assert strict.ask("GET", "/v1/table")[0] == 200


@pytest.mark.parametrize("step", [1000, 300_000])
def test_a_body_is_read_in_any_pieces_after_100_continue(
    live_server: Any, raw: Any, step: int
) -> None:
    body = columns(20_000)
    raw.sendall(head(BATCH, len(body), extra="Expect: 100-continue\r\n"))
    interim = b""
    while not interim.endswith(b"\r\n\r\n"):
        interim += raw.recv(4096)
    assert interim.startswith(b"HTTP/1.1 100 ")  # and nothing else before the body
    assert interim.count(b"HTTP/1.1") == 1
    for start in range(0, len(body), step):
        raw.sendall(body[start : start + step])
    status, received = answer(raw)
    assert status == 200
    assert received.strip() == live_server.ask("POST", BATCH, body)[2]


def test_an_answer_over_http_1_0_is_one_piece(live_server: Any, raw: Any) -> None:
    body = columns(20_000)
    raw.sendall(posted(BATCH, body).replace(b" HTTP/1.1\r\n", b" HTTP/1.0\r\n"))
    response = http.client.HTTPResponse(raw, method="POST")
    response.begin()
    assert response.status == 200
    assert response.getheader("Transfer-Encoding") is None
    whole = live_server.ask("POST", BATCH, body)[2]
    assert int(response.getheader("Content-Length", "0")) == len(whole)
    assert response.read() == whole


def niceness_of_threads(process: int) -> set[int]:
    values = set[int]()
    for task in Path(f"/proc/{process}/task").iterdir():
        with suppress(OSError):  # it has ended
            values.add(int((task / "stat").read_text().rpartition(")")[2].split()[16]))
    return values


@pytest.mark.slow
def test_short_requests_are_answered_while_a_large_batch_is(
    serving: Any, surrogate: Surrogate
) -> None:
    n = 1_000_000
    body = json.dumps(
        {**{name: [value] * n for name, value in CASE.items()}, "v0": [1e-7 * i for i in range(n)]}
    )
    with (
        serving(
            surrogate.path,
            MUMACRO_MAX_BATCH=str(n),
            MUMACRO_MAX_BODY_BYTES="200000000",
            MUMACRO_MAX_HELD_BYTES="400000000",
        ) as server,
        ThreadPoolExecutor(1) as pool,
    ):
        large = pool.submit(server.ask, "POST", BATCH, body)
        between, niceness = 0, {0}
        while not large.done():
            assert server.ask("GET", "/livez")[0] == 200
            assert server.ask("POST", SINGLE, json.dumps(CASE))[0] == 200
            niceness |= niceness_of_threads(server.process.pid)
            between += 1
        assert between >= 10
        status, _, received = large.result()
        assert (status, len(json.loads(received)["mu_macro"])) == (200, n)
        assert {0} < niceness  # threads of batches have a lower priority


@pytest.mark.slow
def test_many_large_batches_at_once_take_little_more_memory_than_their_bodies(
    serving: Any, surrogate: Surrogate
) -> None:
    places, n = 6, 100_000
    rows = json.dumps([{**CASE, "v0": 1e-7 * i} for i in range(1, n + 1)]).encode()
    assert len(rows) > 8_000_000
    with (
        serving(
            surrogate.path, MUMACRO_MAX_COMPUTATIONS="16", MUMACRO_MAX_HELD_BYTES="100000000"
        ) as server,
        ThreadPoolExecutor(places) as pool,
    ):
        base = server.memory("VmHWM")
        for _ in range(2):  # the second time heaps have holes
            answers = list(pool.map(lambda _: server.ask("POST", BATCH, rows), range(places)))
            assert [status for status, _, _ in answers] == [200] * places
            assert len({body for _, _, body in answers}) == 1
        # A case takes 90 bytes of text, 56 while it is evaluated, 33 until its answer is sent; the
        # slice whose answer is written up to 4 MB, and all are computed at the same time.
        each = len(rows) + 90 * n + 4_000_000
        # One body at a time is read whole: 31 MB as objects.  If all were, it would be 155 MB more.
        whole = 32_000_000
        assert 2**20 * (server.memory("VmHWM") - base) < places * each + whole
        # what is free is soon the system's again
        until = time.monotonic() + PATIENCE_S
        while 2**20 * (server.memory() - base) > 3 * len(rows):
            assert time.monotonic() < until, "memory stays"
            time.sleep(0.1)


@pytest.mark.parametrize("pieces", [1, 2, 99])
def test_fields_behind_a_body_are_no_headers(
    serving: Any, surrogate: Surrogate, pieces: int
) -> None:
    fields = b"X-API-Key: secret\r\nX-Forwarded-For: 10.9.8.7\r\nX-Request-ID: mine\r\n"
    text = head(SINGLE, None) + chunk(json.dumps(CASE).encode()) + b"0\r\n" + fields + b"\r\n"
    with serving(surrogate.path, MUMACRO_API_KEY="secret") as server, connect(server) as raw:
        size = -(-len(text) // pieces)
        for i in range(0, len(text), size):
            raw.sendall(text[i : i + size])
            time.sleep(0.3 / pieces)
        raw.settimeout(PATIENCE_S)
        received = raw.recv(65536)
        assert received.startswith(b"HTTP/1.1 401")
        assert b"mine" not in received
        server.stop()
    assert not any("10.9.8.7" in line for line in server.lines)

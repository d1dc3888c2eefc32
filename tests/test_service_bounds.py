"""Limits that protect other clients from one faulty client: on a live server."""

import http.client
import json
import socket
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

BATCH = "/v1/mu-macro/batch"
LIMIT_S = 2  # client timeout in these tests
PATIENCE_S = 60  # longest wait in a test


@pytest.fixture(scope="module")
def server(serving, surrogate):
    """A server with a short client timeout, for two batches at a time."""
    settings = {
        "CLIENT_TIMEOUT_S": str(LIMIT_S),
        "MAX_BATCHES": "2",
        "MAX_BATCH": "1000000",
        "MAX_BODY_BYTES": "200000000",
    }
    with serving(surrogate.path, **{f"MUMACRO_{name}": value for name, value in settings.items()}) as started:
        yield started


def connect(server, receive_buffer=None):
    raw = socket.socket()
    if receive_buffer is not None:
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
    raw.settimeout(PATIENCE_S)
    raw.connect(("127.0.0.1", server.port))
    return raw


def head(path, length=None, kind="application/json", extra=""):
    size = "Transfer-Encoding: chunked" if length is None else f"Content-Length: {length}"
    return f"POST {path} HTTP/1.1\r\nHost: x\r\nContent-Type: {kind}\r\n{size}\r\n{extra}\r\n".encode()


def read_to_end(raw):
    """All bytes until the server closes; fails the test if it never does."""
    received = b""
    try:
        while piece := raw.recv(65536):
            received += piece
    except ConnectionResetError:
        pass
    return received


def drip(raw, byte=b" "):
    """Send single bytes until the connection is closed; fails the test if it never is."""
    deadline = time.monotonic() + PATIENCE_S
    raw.settimeout(0.2)
    while time.monotonic() < deadline:
        try:
            raw.sendall(byte)
            if raw.recv(4096) == b"":
                return
        except TimeoutError:
            continue
        except OSError:
            return
    pytest.fail("the connection was never closed")


@pytest.mark.parametrize("path", ["/v1/mu-macro", BATCH])
@pytest.mark.parametrize("length", [150, 5000, 100_000, None])
def test_a_body_that_never_ends_is_given_up(server, path, length):
    with connect(server) as raw:
        raw.sendall(head(path, length))
        drip(raw, b"1\r\n \r\n" if length is None else b" ")
    assert server.ask("GET", "/livez")[0] == 200


@pytest.mark.parametrize("start", [b"", b"G", b"GET /livez HTTP/1.1\r\nX-Slow: "])
def test_a_head_that_never_ends_is_given_up(server, start):
    with connect(server) as raw:
        raw.sendall(start)
        if start:
            drip(raw, b"x")
        else:
            assert read_to_end(raw) == b""


def test_a_head_that_stops_after_an_answer_is_given_up(server):
    with connect(server) as raw:
        raw.sendall(b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n")
        assert raw.recv(4096).startswith(b"HTTP/1.1 200")
        raw.sendall(b"GET /livez")
        drip(raw, b"x")


def test_a_line_that_never_ends_is_given_up(server, case):
    with connect(server) as raw:
        line = json.dumps(case).encode() + b"\n"
        raw.sendall(head(BATCH, None, "application/x-ndjson") + b"%x\r\n%b\r\n" % (len(line), line))
        assert raw.recv(65536).startswith(b"HTTP/1.1 200")
        drip(raw, b"1\r\n \r\n")


def test_a_client_that_does_not_read_is_disconnected_and_takes_little_memory(server, case):
    body = json.dumps({**case, "v0": [1e-6 * i for i in range(1, 300_001)]}).encode()
    with connect(server, receive_buffer=4096) as raw:
        raw.sendall(head(BATCH, len(body)) + body)
        time.sleep(3 * LIMIT_S)
        received = read_to_end(raw)
    assert received.startswith(b"HTTP/1.1 200")
    assert not received.endswith(b"0\r\n\r\n")  # the answer, of some 20 MB, was not finished
    assert len(received) < 8_000_000


def memory(server):
    with open(f"/proc/{server.process.pid}/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmRSS")) * 1024


def stream(server, line, count):
    """Send the line this number of times while another thread reads; return the lines and the largest memory."""
    raw = connect(server)
    block = b"%x\r\n%b\r\n" % (len(line), line)
    sizes, received = [], [0, b""]

    def read():
        while piece := raw.recv(1 << 20):
            received[0] += piece.count(b"mu_macro")
            received[1] = piece[-5:]
            if received[1] == b"0\r\n\r\n":
                return

    reader = threading.Thread(target=read)
    reader.start()
    raw.sendall(head(BATCH, None, "application/x-ndjson"))
    for index in range(count):
        raw.sendall(block)
        if index % 50 == 0:
            sizes.append(memory(server))
    raw.sendall(b"0\r\n\r\n")
    reader.join(PATIENCE_S)
    raw.close()
    return received[0], max(sizes)


def test_the_memory_of_a_stream_does_not_grow_with_its_length(server, case):
    line = json.dumps({**case, "v0": [1e-4 * i for i in range(1, 1001)]}).encode() + b"\n"
    stream(server, line, 50)
    lines, short = stream(server, line, 1000)  # long enough to fill all buffers
    assert lines == 1000
    lines, long = stream(server, line, 4000)
    assert lines == 4000
    assert long < short + 8e6  # the answers alone are 300 MB


def test_answers_come_while_the_request_is_still_being_sent(server, case):
    line = json.dumps(case).encode() + b"\n"
    with connect(server) as raw:
        raw.sendall(head(BATCH, None, "application/x-ndjson"))
        for _ in range(3):
            raw.sendall(b"%x\r\n%b\r\n" % (len(line), line))
            received = b""
            while b'"mu_macro"' not in received:
                received += raw.recv(65536)
        raw.sendall(b"0\r\n\r\n")


@pytest.mark.parametrize("kind", ["application/x-ndjson", "application/json"])
def test_expect_100_continue_is_answered(server, case, kind):
    body = json.dumps({**case, "v0": [0.01] * 5000}).encode()
    with connect(server) as raw:
        raw.sendall(head(BATCH, len(body), kind).replace(b"\r\n\r\n", b"\r\nExpect: 100-continue\r\n\r\n"))
        said = b""
        while not said.endswith(b"\r\n\r\n"):
            said += raw.recv(4096)
        assert said.startswith(b"HTTP/1.1 100 ")  # and nothing else before the body
        assert said.count(b"HTTP/1.1") == 1
        raw.sendall(body)
        reply = http.client.HTTPResponse(raw, method="POST")
        reply.begin()
        assert (reply.status, len(json.loads(reply.read())["mu_macro"])) == (200, 5000)


def test_the_answer_to_a_stream_begins_before_its_first_line(server, case):
    with connect(server) as raw:
        raw.sendall(head(BATCH, None, "application/x-ndjson"))
        assert raw.recv(65536).startswith(b"HTTP/1.1 200 ")
        line = json.dumps(case).encode() + b"\n"
        raw.sendall(b"%x\r\n%b\r\n0\r\n\r\n" % (len(line), line))
        assert b'"mu_macro"' in raw.recv(65536)


def test_no_piece_of_a_stream_is_lost(server, case):
    # Lines end inside pieces and between pieces, and both directions are busy at the same time.
    lines = b"".join(json.dumps({**case, "v0": 1e-5 * i}).encode() + b"\n" for i in range(1, 3001))
    answers = []
    with connect(server) as raw:

        def read():
            reply = http.client.HTTPResponse(raw, method="POST")
            reply.begin()
            answers.extend(json.loads(line)["mu_macro"] for line in reply.read().splitlines())

        reader = threading.Thread(target=read)
        reader.start()
        raw.sendall(head(BATCH, None, "application/x-ndjson"))
        for start in range(0, len(lines), 777):
            piece = lines[start : start + 777]
            raw.sendall(b"%x\r\n%b\r\n" % (len(piece), piece))
        raw.sendall(b"0\r\n\r\n")
        reader.join(PATIENCE_S)
    assert len(answers) == 3000
    assert answers == sorted(answers)


def test_short_requests_are_answered_while_a_large_batch_is(server, case):
    v0 = [1e-7 * i for i in range(1, 1_000_001)]
    body = json.dumps({**{name: [value] * len(v0) for name, value in case.items()}, "v0": v0}).encode()
    done = threading.Event()
    result = []

    def ask():
        result.append(server.ask("POST", BATCH, body, {"Content-Type": "application/json"}))
        done.set()

    worker = threading.Thread(target=ask)
    worker.start()
    between = 0
    while not done.is_set():
        assert server.ask("GET", "/livez")[0] == 200
        assert server.ask("POST", "/v1/mu-macro", json.dumps(case), {"Content-Type": "application/json"})[0] == 200
        between += 1
    worker.join()
    assert between >= 10
    status, _, answer = result[0]
    assert (status, len(json.loads(answer)["mu_macro"])) == (200, 1_000_000)


def peak(server):
    with open(f"/proc/{server.process.pid}/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmHWM")) * 1024


def test_many_large_batches_at_once_take_little_more_memory_than_their_bodies(serving, surrogate, case):
    places, n = 6, 100_000
    rows = json.dumps([{**case, "v0": 1e-7 * i} for i in range(1, n + 1)]).encode()
    assert len(rows) > 8_000_000
    with serving(surrogate.path, MUMACRO_MAX_BATCHES=str(places)) as server:
        base = peak(server)
        statuses = []

        def ask():
            statuses.append(server.ask("POST", BATCH, rows, {"Content-Type": "application/json"})[0])

        askers = [threading.Thread(target=ask) for _ in range(places)]
        for asker in askers:
            asker.start()
        for asker in askers:
            asker.join()
        assert statuses == [200] * places
        # A case takes 90 bytes of text, 56 while it is evaluated, 33 until its answer is sent.
        assert peak(server) - base < places * (len(rows) + 90 * n) + 20_000_000


@pytest.mark.parametrize("step", [1000, 65_536, 300_000])
def test_a_body_is_read_in_pieces_of_any_size_and_after_100_continue(server, case, step):
    n = 20_000
    body = json.dumps({**case, "v0": [1e-6 * i for i in range(1, n + 1)]}).encode()
    _, _, expected = server.ask("POST", BATCH, body, {"Content-Type": "application/json"})
    with connect(server) as raw:
        raw.sendall(head(BATCH, len(body), extra="Expect: 100-continue\r\n"))
        assert raw.recv(65536).startswith(b"HTTP/1.1 100")
        for start in range(0, len(body), step):
            raw.sendall(body[start : start + step])
        reply = http.client.HTTPResponse(raw, method="POST")
        reply.begin()
        assert (reply.status, reply.read()) == (200, expected)


def test_threads_for_batches_have_a_lower_priority(server, case):
    body = json.dumps({**case, "v0": [1e-6 * i for i in range(1, 50_001)]})
    assert server.ask("POST", BATCH, body, {"Content-Type": "application/json"})[0] == 200
    found = {}
    for task in Path(f"/proc/{server.process.pid}/task").iterdir():
        found[int(task.name)] = int((task / "stat").read_text().rpartition(")")[2].split()[16])
    loop = found.pop(server.process.pid)
    assert loop < max(found.values())


@pytest.mark.parametrize("sent", [300_000, 3_000_000])
def test_a_client_that_leaves_within_a_body_frees_its_place(server, case, sent):
    for _ in range(3):  # one more than the batches allowed
        with connect(server) as raw:
            raw.sendall(head(BATCH, 5_000_000) + b"[" + b" " * sent)
    body = json.dumps({**case, "v0": [1e-6 * i for i in range(1, 20_001)]})
    deadline = time.monotonic() + PATIENCE_S
    while server.ask("POST", BATCH, body, {"Content-Type": "application/json"})[0] != 200:
        assert time.monotonic() < deadline


def test_a_third_batch_is_refused_unread(server, case):
    deadline = time.monotonic() + PATIENCE_S
    answer = b""
    while not answer.startswith(b"HTTP/1.1 503"):  # once the service has read the heads of the first two
        assert time.monotonic() < deadline
        with connect(server) as first, connect(server) as second, connect(server) as third:
            for raw in (first, second):
                raw.sendall(head(BATCH, 100_000) + b"[")
            time.sleep(LIMIT_S / 4)
            third.settimeout(LIMIT_S / 4)
            third.sendall(head(BATCH, 100_000_000))
            with suppress(TimeoutError):
                answer = third.recv(65536)
    assert b"retry-after: 1\r\n" in answer.lower()
    assert b"application/problem+json" in answer
    assert server.ask("POST", BATCH, json.dumps([case]), {"Content-Type": "application/json"})[0] == 200


def test_a_declared_length_over_the_limit_is_a_problem_document(server):
    for path in ("/v1/mu-macro", BATCH):
        with connect(server) as raw:
            raw.sendall(head(path, 300_000_000))
            answer = read_to_end(raw)
        assert answer.startswith(b"HTTP/1.1 413")
        assert b"content-type: application/problem+json" in answer

"""One request must not bring the service down: each attack on a live server, with requests to /livez in parallel.

Memory is the peak of the process; the manifests in deploy/ allow 768 MiB.
"""

import http.client
import json
import signal
import socket
import threading
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

MOST_MIB = 768
LONGEST_S = 5.0  # longest time for /livez in these tests; a busy machine is slow, a blocked service is much slower
CASE = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}
SINGLE, BATCH = "/v1/mu-macro", "/v1/mu-macro/batch"


@pytest.fixture(scope="module")
def server(serving, surrogate):
    """A server with default settings; its memory is measured."""
    with serving(surrogate.path) as started:
        yield started


@pytest.fixture
def watched(server, record_property):
    """The server, with requests to /livez during the attack; afterwards its memory is checked.

    fuzz/load.py reads the values recorded here.
    """
    waits, over = [], threading.Event()

    def ask():
        while not over.is_set():
            started = time.monotonic()
            try:
                assert server.ask("GET", "/livez")[0] == 200
            finally:
                waits.append(time.monotonic() - started)
            time.sleep(0.02)

    asking = threading.Thread(target=ask)
    asking.start()
    yield server
    over.set()
    asking.join()
    status = Path(f"/proc/{server.process.pid}/status").read_text()
    peak = int(next(line for line in status.splitlines() if line.startswith("VmHWM")).split()[1]) / 1024
    record_property("livez_s", f"{max(waits):.4f}")
    record_property("peak_mib", f"{peak:.0f}")
    assert max(waits) < LONGEST_S
    assert peak < MOST_MIB
    assert server.ask("POST", SINGLE, json.dumps(CASE), {"Content-Type": "application/json"})[0] == 200


def connect(server):
    raw = socket.create_connection(("127.0.0.1", server.port), timeout=60)
    raw.settimeout(60)
    return raw


def send_until_cut(raw, piece, most):
    """Send up to this number of bytes; returns the number sent when the server closed the connection."""
    sent = 0
    try:
        while sent < most:
            raw.sendall(piece)
            sent += len(piece)
    except OSError:
        pass
    return sent


def answer_of(raw):
    received = b""
    try:
        while piece := raw.recv(65536):
            received += piece
    except OSError:
        pass
    return received


@pytest.mark.parametrize("piece", [b"x-field: " + b"a" * 1000 + b"\r\n", b"a" * 1000], ids=["fields", "one field"])
def test_a_head_has_a_limit(watched, piece):
    with connect(watched) as raw:
        raw.sendall(b"GET /livez HTTP/1.1\r\nHost: x\r\nx-first: ")
        assert send_until_cut(raw, piece * 100, 200_000_000) < 50_000_000


def test_pipelined_requests_do_not_queue_without_limit(watched):
    request = b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n"
    with connect(watched) as raw:
        raw.settimeout(3)
        sent = send_until_cut(raw, request * 1000, 40_000_000)
    assert sent < 40_000_000


@pytest.mark.parametrize(
    "body",
    [
        json.dumps({**CASE, "include": [1] * 2_000_000}),
        "{" + ",".join(f'"n{i}":1' for i in range(1_000_000)) + "}",
        '{"' + "a" * 16_000_000 + '":1}',
    ],
    ids=["include", "names", "one name"],
)
@pytest.mark.parametrize("path", [SINGLE, "/v1/law", "/v1/solve-for", "/Evaluate", BATCH])
def test_a_large_body_of_nonsense_costs_little(watched, path, body):
    connection = http.client.HTTPConnection("127.0.0.1", watched.port, timeout=60)
    try:
        connection.request("POST", path, body, {"Content-Type": "application/json"})
        assert connection.getresponse().status in (400, 413, 422)
    except OSError:
        pass  # refused before it was read
    finally:
        connection.close()


HEADER = "mu0,Fz,k,y0,omega,v0\n"
CSV = {
    "digits": HEADER + "1" * 130_000 + "x,1,1,1,1,1\n",
    "blanks in the header": f"mu0 ({' ' * 130_000},Fz,k,y0,omega,v0\n1,1,1,1,1,1\n",
    "more blanks in the header": f"mu0{' ' * 130_000}x,Fz,k,y0,omega,v0\n1,1,1,1,1,1\n",
    "columns": "a," * 5_000_000 + "\n",
}


@pytest.mark.parametrize("name", CSV)
def test_csv_that_a_pattern_could_read_in_many_ways_costs_little(watched, name):
    status, _, _ = watched.ask("POST", BATCH, CSV[name], {"Content-Type": "text/csv"})
    assert status == (200 if name == "digits" else 422)


@pytest.mark.parametrize("path", [SINGLE, "/v1/mu-macro.txt", "/v1/law.csv", "/v1/table"])
@pytest.mark.parametrize(
    "query", ["mu0=" + "1" * 60_000 + "x", "&".join(f"a{i}=" for i in range(9000)), "include=" + "a," * 30_000],
    ids=["digits", "names", "include"],
)  # fmt: skip
def test_a_long_query_costs_little(watched, path, query):
    assert watched.ask("GET", f"{path}?{query}")[0] == 422


def test_brackets_are_counted_before_they_are_read(watched):
    status, _, _ = watched.ask(
        "POST", BATCH, json.dumps({**CASE, "v0": "@"}).replace('"@"', "[" + "[]," * 5_000_000 + "1]")
    )
    assert status == 413


def test_blank_lines_are_read_once(watched):
    started = time.monotonic()
    status, _, body = watched.ask("POST", BATCH, b"\n" * 262_144, {"Content-Type": "application/x-ndjson"})
    assert (status, body) == (200, b"")
    assert time.monotonic() - started < 20


def test_unfinished_bodies_take_little_memory(watched):
    head = f"POST {SINGLE} HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: 16000000\r\n\r\n"
    raws = [connect(watched) for _ in range(100)]
    for raw in raws:
        raw.sendall(head.encode() + b" " * 50_000)
    for raw in raws:
        assert answer_of(raw).startswith(b"HTTP/1.1 413")
        raw.close()


def test_idle_streams_take_little_memory(watched):
    head = f"POST {BATCH} HTTP/1.1\r\nHost: x\r\nContent-Type: application/x-ndjson\r\nContent-Length: 1\r\n\r\n"
    raws = [connect(watched) for _ in range(300)]
    for raw in raws:
        raw.sendall(head.encode())
    time.sleep(1)
    for raw in raws:
        raw.close()


def test_an_upgrade_is_refused_and_bytes_after_it_are_not_a_request(watched):
    body = json.dumps(CASE).encode()
    fields = f"Host: x\r\nConnection: Upgrade\r\nUpgrade: h2c\r\nContent-Length: {len(body)}\r\n\r\n"
    head = f"POST {SINGLE} HTTP/1.1\r\n{fields}"
    with connect(watched) as raw:
        raw.sendall(head.encode())
        time.sleep(0.2)
        raw.sendall(b"GET /v1/table HTTP/1.1\r\nHost: x\r\n\r\n")
        received = answer_of(raw)
    assert received.startswith(b"HTTP/1.1 400")
    assert received.count(b"HTTP/1.1") == 1


def test_a_compressed_arrow_stream_is_refused_unread(watched):
    pa = pytest.importorskip("pyarrow")
    sink = pa.BufferOutputStream()
    batch = pa.record_batch({name: pa.nulls(5_000_000, pa.float64()).fill_null(1.0) for name in CASE})
    options = pa.ipc.IpcWriteOptions(compression="zstd")
    with pa.ipc.new_stream(sink, batch.schema, options=options) as writer:
        writer.write_batch(batch)
    body = sink.getvalue().to_pybytes()
    assert len(body) < 1_000_000
    status, _, answer = watched.ask("POST", BATCH, body, {"Content-Type": "application/vnd.apache.arrow.stream"})
    assert status == 400
    assert b"compressed" in answer


def test_a_key_given_twice_is_refused(serving, surrogate):
    with serving(surrogate.path, MUMACRO_API_KEYS="alice=one,bob=two") as server, connect(server) as raw:
        raw.sendall(b"GET /v1/table HTTP/1.1\r\nHost: x\r\nX-API-Key: one\r\nX-API-Key: wrong\r\n\r\n")
        assert answer_of(raw).startswith(b"HTTP/1.1 400")
        assert server.ask("GET", "/v1/table", headers={"X-API-Key": "two"})[0] == 200
        assert server.stop() == 0
    assert any('"key": "bob"' in line for line in server.lines)
    assert not any("two" in line for line in server.lines)


def test_many_single_lines_are_answered_when_all_are_sent_before_reading(watched):
    line = json.dumps(CASE).encode() + b"\n"
    status, _, body = watched.ask("POST", BATCH, line * 150_000, {"Content-Type": "application/x-ndjson"})
    assert (status, body.count(b"\n")) == (200, 150_000)


def test_a_stop_loses_no_request_of_busy_clients(serving, surrogate):
    body = json.dumps(CASE)
    lost, over = [], threading.Event()
    with serving(surrogate.path, MUMACRO_DRAIN_S="2") as server:

        def ask():
            connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=30)
            while not over.is_set():
                if connection.sock is None:
                    try:
                        connection.connect()
                    except OSError:
                        return  # the port is closed
                try:
                    connection.request("POST", SINGLE, body, {"Content-Type": "application/json"})
                    response = connection.getresponse()
                    response.read()
                    if response.getheader("connection") == "close":
                        connection.close()
                        if server.process.poll() is not None or draining.is_set():
                            return
                except (OSError, http.client.HTTPException) as error:
                    lost.append(error)
                    return

        draining = threading.Event()
        callers = [threading.Thread(target=ask) for _ in range(8)]
        for caller in callers:
            caller.start()
        time.sleep(1)
        server.process.send_signal(signal.SIGTERM)
        draining.set()
        for caller in callers:
            caller.join(30)
        over.set()
        assert server.wait() == 0
    assert lost == []

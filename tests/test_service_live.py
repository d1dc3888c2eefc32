"""The service as a process: a real server on a loopback port, real sockets, real signals."""

import http.client
import json
import os
import signal
import socket
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

pytestmark = pytest.mark.slow

START_S = 180


@pytest.fixture(scope="module")
def server(serving, surrogate):
    """One server for all tests that do not stop it."""
    with serving(surrogate.path, MUMACRO_MAX_BODY_BYTES="4096") as started:
        yield started


def test_it_answers(server, case, client):
    query = "&".join(f"{name}={value}" for name, value in case.items())
    status, headers, body = server.ask("GET", f"/v1/mu-macro?{query}", headers={"X-Request-ID": "live-1"})
    assert (status, headers["x-request-id"]) == (200, "live-1")
    assert json.loads(body)["mu_macro"] == client.get("/v1/mu-macro", params=case).json()["mu_macro"]
    assert "server" not in headers


def test_it_is_checked_by_its_own_command(server, repository):
    def check(port):
        command = [sys.executable, "-m", "service", "healthcheck", "--port", str(port)]
        return subprocess.run(
            command, cwd=repository, check=False, env={**os.environ, "http_proxy": "http://[::1]:9"}
        ).returncode

    assert check(server.port) == 0
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        assert check(unused.getsockname()[1]) == 1


def test_the_file_arrives_complete(server, surrogate):
    status, headers, body = server.ask("GET", "/v1/table.nc")
    assert (status, body) == (200, surrogate.path.read_bytes())
    assert headers["content-length"] == str(len(body))


def test_a_body_over_the_limit_is_refused_with_and_without_a_length(server):
    kinds = {"Content-Type": "application/json"}
    status, headers, body = server.ask("POST", "/v1/mu-macro/batch", b" " * 5000, kinds)
    assert (status, headers["content-type"]) == (413, "application/problem+json")
    chunks = iter([b" " * 1000] * 5)
    status, headers, body = server.ask("POST", "/v1/mu-macro/batch", chunks, kinds, encode_chunked=True)
    assert (status, json.loads(body)["max_bytes"]) == (413, 4096)
    assert headers["connection"] == "close"


def test_a_small_batch_is_counted_once(serving, surrogate, case):
    with serving(surrogate.path) as server:
        body = json.dumps({**case, "v0": [0.01] * 1000 + [-1]}).encode()
        kinds = {"Content-Type": "application/json", "Accept-Encoding": "gzip"}
        for text, kind in ((body, kinds), (json.dumps({**case, "v0": [0.01, 0.02]}).encode(), kinds)):
            assert server.ask("POST", "/v1/mu-macro/batch", text, kind)[0] == 200
        lines = server.ask("GET", "/metrics")[2].decode().splitlines()
        found = {line.rpartition(" ")[0]: float(line.rpartition(" ")[2]) for line in lines if not line.startswith("#")}
        assert sum(value for name, value in found.items() if name.startswith("mumacro_cases_total")) == 1002
        asked = [value for name, value in found.items() if "requests_total" in name and "mu-macro/batch" in name]
        assert sum(asked) == 2


def test_a_connection_is_kept_over_errors(server, case):
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
    statuses = []
    for method, path, body in (("GET", "/nowhere", None), ("POST", "/v1/mu-macro", b"{"), ("PUT", "/livez", b"x")):
        connection.request(method, path, body)
        response = connection.getresponse()
        response.read()
        statuses.append(response.status)
    connection.request("POST", "/v1/mu-macro", json.dumps(case))
    assert connection.getresponse().status == 200
    connection.close()
    assert statuses == [404, 400, 405]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_requested_stop_is_a_success(serving, surrogate, number):
    with serving(surrogate.path) as server:
        assert server.ask("GET", "/readyz")[0] == 200
        server.ask("GET", "/nowhere", headers={"X-Request-ID": "the-last"})
        assert server.stop(number) == 0
    lines = [json.loads(line) for line in server.lines]
    assert all({"time", "level", "logger", "message"} <= line.keys() for line in lines)
    access = [line for line in lines if line["logger"] == "mumacro.access"][-1]
    assert (access["request_id"], access["status"], access["path"]) == ("the-last", 404, "/nowhere")


def test_several_workers_serve_and_stop(serving, surrogate):
    with serving(surrogate.path, "--workers", "2", MUMACRO_API_KEY="k3y") as server:
        server.wait_for_tables(2)
        assert server.ask("GET", "/readyz")[0] == 200
        assert server.ask("GET", "/v1/table")[0] == 401
        assert server.ask("GET", "/v1/table", headers={"X-API-Key": "k3y"})[0] == 200
        assert server.stop() == 0
    assert all(json.loads(line) for line in server.lines)


def test_batches_at_once_are_all_answered(serving, surrogate, case):
    body = json.dumps([{**case, "v0": 1e-4 * index} for index in range(2000)])
    with serving(surrogate.path, MUMACRO_MAX_BATCHES="8") as server:
        with ThreadPoolExecutor(8) as pool:
            answers = list(pool.map(lambda _: server.ask("POST", "/v1/mu-macro/batch", body), range(60)))
        assert {status for status, _, _ in answers} == {200}
        assert len({body for _, _, body in answers}) == 1
        assert server.stop() == 0


def test_a_damaged_table_starts_alive_and_not_ready(serving, tmp_path):
    (tmp_path / "damaged.nc").write_bytes(b"damaged")
    with serving(tmp_path) as server:
        assert server.ask("GET", "/livez")[0] == 200
        status, headers, body = server.ask("GET", "/readyz")
        assert (status, headers["retry-after"]) == (503, "5")
        assert "damaged.nc" in json.loads(body)["detail"]
        assert server.stop() == 0


def test_a_port_that_is_taken_is_a_failure(repository, surrogate):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        command = [sys.executable, "-m", "service", "--tables", str(surrogate.path), "--port", port]
        process = subprocess.run(command, cwd=repository, capture_output=True, text=True, check=False, timeout=START_S)
    assert process.returncode == 1
    assert "Traceback" not in process.stdout + process.stderr

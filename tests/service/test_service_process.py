"""The service as a process: its start and end, its health check, and its log, which no client and
no reader harms."""

import errno
import http.client
import json
import logging
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from mumacro import Surrogate
from service.observe import LogLines
from tests.support.cases import Case
from tests.support.places import ROOT
from tests.support.serving import CASE, connect, head, to_end

SINGLE, BATCH = "/v1/mu-macro", "/v1/mu-macro/batch"
#: texts that a client behind a proxy can send in place of its address
NO_ADDRESS = [
    'a"b',
    "a\\",
    '1.2.3.4" "level": "error',
    "\t1.2.3.4",
    "{}",
    "\u00e9\u00ff",
    "a" * 64 + "b" * 5000,
]
NO_PATH = ("/%0a%7B%22level%22%3A%22error%22%7D", "/%22", "/%00", "/%ff", "/%E2%80%A8", "/a%0d%0ab")


def fields_of(lines: Any) -> Any:
    """Every line as an object; a line that is not JSON, or has a name twice, fails the test."""

    def once(pairs: Any) -> Any:
        names = [name for name, _ in pairs]
        assert len(names) == len(set(names)), names
        return dict(pairs)

    records = [json.loads(line, object_pairs_hook=once) for line in lines]
    assert all({"time", "level", "logger", "message"} <= line.keys() for line in records)
    return records


def accesses(lines: Any) -> Any:
    return [line for line in fields_of(lines) if line["logger"] == "mumacro.access"]


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_requested_stop_is_a_success(
    serving: Any, surrogate: Surrogate, case: Case, number: Any
) -> None:
    with serving(surrogate.path, MUMACRO_ROOT_PATH="/friction") as server:
        status, headers, _ = server.ask(
            "POST", SINGLE, json.dumps(case), {"X-Request-ID": "the-last"}
        )
        assert (status, headers["x-request-id"]) == (200, "the-last")
        assert "server" not in headers
        assert server.stop(number) == 0
    (line,) = accesses(server.lines)  # probes of health are not logged
    assert line.pop("duration_ms") > 0.0
    del line["time"]
    assert line == {
        "level": "info",
        "logger": "mumacro.access",
        "message": "request",
        "request_id": "the-last",
        "method": "POST",
        "path": SINGLE,
        "status": 200,
        "client": "127.0.0.1",
    }


#: run before the service: sends a signal to the own process when the module of this name is about
#: to be imported; an exception would become another one, as it does while pydantic builds a model
STOPPED_AT = """
import os, sys


class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == os.environ["STOPPED_AT"]:
            try:
                os.kill(os.getpid(), int(os.environ["STOPPED_BY"]))
            except BaseException as error:
                raise RuntimeError(f"not built: {error!r}") from None


sys.meta_path.insert(0, Finder())
"""


def begun(repository: Path, surrogate: Surrogate, **variables: str) -> Any:
    """A service that has only been started."""
    words = [sys.executable, "-m", "service", "--port", "0", "--tables", str(surrogate.path)]
    return subprocess.Popen(
        words,
        cwd=repository,
        env={**os.environ, **variables},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "workers"),
    [
        ("argparse", "1"),
        ("pydantic", "1"),
        ("uvicorn", "1"),
        ("uvicorn", "2"),
        ("service.observe", "2"),
        ("service.app", "1"),
        ("service.models.answers", "1"),
        ("service.server", "1"),
    ],
)
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_stop_at_an_import_of_the_start_is_a_success(
    repository: Path, surrogate: Surrogate, tmp_path: Path, module: str, workers: str, number: int
) -> None:
    (tmp_path / "sitecustomize.py").write_text(STOPPED_AT)
    path = os.pathsep.join([str(tmp_path), os.getcwd()])
    variables = {"STOPPED_AT": module, "STOPPED_BY": str(int(number)), "MUMACRO_WORKERS": workers}
    variables["PYTHONPATH"] = path
    with begun(repository, surrogate, **variables) as process:
        log = process.communicate(timeout=60)[0].decode()
    assert process.returncode == 0, log
    assert "Traceback" not in log


@pytest.mark.slow
@pytest.mark.parametrize("workers", ["1", "2"])
@pytest.mark.parametrize("after", [0.05, 0.2, 0.5, 1.0])
def test_a_stop_soon_after_the_start_is_a_success(
    repository: Path, surrogate: Surrogate, after: float, workers: str
) -> None:
    with begun(repository, surrogate, MUMACRO_WORKERS=workers) as process:
        status, caught = Path(f"/proc/{process.pid}/status"), 0
        # before, it is not yet the service, but Python, that starts
        while not caught >> (signal.SIGTERM - 1) & 1:
            caught = int(re.findall(r"^SigCgt:\s*(\w+)$", status.read_text(), re.MULTILINE)[0], 16)
        time.sleep(after)
        process.terminate()
        log = process.communicate(timeout=60)[0].decode()
    assert process.returncode == 0, log
    assert "Traceback" not in log


@pytest.mark.slow
def test_without_a_table_it_starts_and_says_so(serving: Any, tmp_path: Path, case: Case) -> None:
    (tmp_path / "damaged.nc").write_bytes(b"damaged")
    with serving(tmp_path) as server:
        assert server.ask("GET", "/livez")[0] == 200
        status, _, body = server.ask("GET", "/readyz")
        assert (status, "damaged.nc" in json.loads(body)["detail"]) == (503, True)
        assert server.ask("POST", BATCH, json.dumps([case]))[0] == 503
        assert server.stop() == 0


def command(repository: Path, *arguments: Any) -> Any:
    return subprocess.run(
        [sys.executable, "-m", "service", *arguments],
        cwd=repository,
        capture_output=True,
        text=True,
        check=False,
        timeout=180,
        env={**os.environ, "http_proxy": "http://[::1]:9"},
    )


@pytest.mark.slow
def test_the_health_check_and_a_port_that_is_taken(
    live_server: Any, repository: Path, surrogate: Surrogate
) -> None:
    check = command(repository, "healthcheck", "--port", str(live_server.port))
    assert check.returncode == 0, check.stderr
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        assert (
            command(repository, "healthcheck", "--port", str(unused.getsockname()[1])).returncode
            == 1
        )
    failed = command(repository, "--tables", str(surrogate.path), "--port", str(live_server.port))
    assert failed.returncode == 1
    assert "Traceback" not in failed.stdout + failed.stderr
    assert f"port {live_server.port} is taken by another program" in failed.stderr
    assert f"--port {live_server.port + 1}" in failed.stderr


def test_no_client_can_forge_a_log_line_and_no_key_is_logged_or_shown(
    serving: Any, surrogate: Surrogate, case: dict[str, Any]
) -> None:
    alice, bob, wrong = "k3y-of-alice", "k3y-of-bob", "wr0ng-key"
    body, answers = json.dumps(case), []
    query = "&".join(f"{name}={value}" for name, value in case.items())
    with serving(
        surrogate.path, "--log-level", "debug", MUMACRO_API_KEYS=f"alice={alice},bob={bob}"
    ) as server:
        for text in NO_ADDRESS:
            forged = {"X-API-Key": alice, "X-Forwarded-For": text.encode("latin-1")}
            assert server.ask("POST", SINGLE, body, forged)[0] == 200
            assert server.ask("GET", f"{SINGLE}?{query}", headers=forged)[0] == 200
            assert server.ask("POST", BATCH, f"[{body}]", forged)[0] == 200
            assert server.ask("GET", "/nowhere", headers=forged)[0] == 404
        for path in NO_PATH:
            assert server.ask("GET", path, headers={"X-API-Key": alice})[0] == 404
        requests = [
            ("POST", SINGLE, body),
            ("POST", BATCH, f"[{body}]"),
            ("POST", SINGLE, "{"),
            ("GET", "/metrics", None),
        ]
        for headers in (
            {"X-API-Key": alice},
            {"X-API-Key": wrong},
            *({"Authorization": text} for text in (f"Bearer {bob}", f"Basic {wrong}", bob)),
        ):
            answers += [
                str(server.ask(*request, headers))
                for request in (*requests, ("GET", "/openapi.json", None))
            ]
        assert server.stop() == 0
    for text in (alice, bob, wrong):
        assert text not in "".join(server.lines)
        assert text not in "".join(answers)
    lines = accesses(server.lines)
    assert {line.get("key") for line in lines} == {None, "alice", "bob"}
    shown = [line["client"] for line in lines if line["path"] == "/nowhere"]
    assert shown == [text.strip()[:64] for text in NO_ADDRESS]
    assert all(len(line["client"]) <= 64 for line in lines)
    assert {line["level"] for line in fields_of(server.lines)} <= {"debug", "info", "warning"}


@contextmanager
def unread(repository: Path, surrogate: Surrogate) -> Any:
    """A service whose standard output is read up to the line with its port only: process, port,
    lines."""
    words = [sys.executable, "-m", "service", "--port", "0", "--tables", str(surrogate.path)]
    variables = {
        name: value for name, value in os.environ.items() if not name.startswith("MUMACRO_")
    }
    process = subprocess.Popen(
        words, cwd=repository, env=variables, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    assert process.stdout is not None
    try:
        lines: list[bytes] = []
        while not (
            address := re.search(rb"running on http://[^ ]+:(\d+) ", lines[-1] if lines else b"")
        ):
            lines.append(process.stdout.readline())
            assert lines[-1], b"".join(lines)
        yield process, int(address[1]), lines
        process.terminate()
        assert process.wait(60) == 0
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def statuses(port: Any, path: Any, many: Any) -> Any:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    codes = []
    for _ in range(many):
        connection.request("GET", path)
        response = connection.getresponse()
        response.read()
        codes.append(response.status)
    connection.close()
    return codes


@pytest.mark.slow
@pytest.mark.parametrize("then", ["reads", "stays", "leaves"])
def test_a_log_reader_that_stalls_delays_no_request(
    repository: Path, surrogate: Surrogate, case: Case, then: Any
) -> None:
    query = f"{SINGLE}?" + "&".join(f"{name}={value}" for name, value in case.items())
    many = 3000 if then == "reads" else 500
    with unread(repository, surrogate) as (process, port, lines):
        if then == "leaves":
            process.stdout.close()
        # Some 250 bytes a line: a pipe holds 64 kB, and the service a megabyte.
        with ThreadPoolExecutor(4) as pool:
            answered = [
                pool.submit(statuses, port, *question)
                for question in 4 * [(query, many), ("/x", 500)]
            ]
        assert [one.result() for one in answered] == 4 * [many * [200], 500 * [404]]
        if then != "reads":
            return
        reader = threading.Thread(target=lambda: lines.extend(process.stdout))
        reader.start()
        process.terminate()
        assert process.wait(60) == 0
        reader.join(60)
    drops = [line for line in fields_of(lines) if "were dropped" in line["message"]]
    assert {line["level"] for line in drops} == {"warning"}
    lost = sum(int(line["message"].split()[0]) for line in drops)
    assert lost > 0
    assert lost + len(accesses(lines)) >= 14_000


@pytest.mark.slow
@pytest.mark.parametrize("words", [("mumacro", "serve"), ("service",)])
def test_at_a_terminal_it_speaks_to_a_person(repository: Path, words: tuple[str, ...]) -> None:
    import pty

    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    reader, writer = pty.openpty()
    command = [sys.executable, "-m", *words, "--port", str(port)]
    with subprocess.Popen(command, cwd=repository, stdout=writer, stderr=writer) as process:
        os.close(writer)
        shown, until = b"", time.monotonic() + 180.0
        try:
            while b"Open http" not in shown and time.monotonic() < until:
                shown += os.read(reader, 65536)
            address = f"http://127.0.0.1:{port}"
            assert f"Open {address} ".encode() in shown
            with urllib.request.urlopen(f"{address}/v1/table", timeout=30):
                pass
            while b"/v1/table" not in shown and time.monotonic() < until:
                shown += os.read(reader, 65536)
        finally:
            process.terminate()
            while True:  # a terminal that nobody reads would hold the process
                try:
                    shown += os.read(reader, 65536)
                except OSError:
                    break
    os.close(reader)
    assert re.search(rb"\d\d:\d\d:\d\d  GET /v1/table 200 [\d.]+ ms\r\n", shown)
    assert b"{" not in shown


def test_a_line_for_people_moves_no_cursor_and_forges_no_line(
    monkeypatch: pytest.MonkeyPatch, capfd: Any
) -> None:
    monkeypatch.setattr(os, "isatty", lambda _: True)
    lines, now = LogLines(), datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
    line = {"time": now, "level": "warning", "logger": "x", "message": "a\x1b[2J\nb µ", "n": 1}
    lines.put(line)
    lines.flush()
    LogLines.running = None
    assert capfd.readouterr().out == "03:04:05  warning: a\\x1b[2J\\x0ab µ n=1\n"


@pytest.mark.parametrize(
    ("text", "status", "path"),
    [
        (b"nonsense\r\n\r\n", 400, ""),
        (b"GET /v1/table HTTP/2.0\r\nHost: x\r\n\r\n", 400, "/v1/table"),
        (b"GET /v1/table HTTP/1.1\r\nHost: x\r\n" + b"a: b\r\n" * 101, 431, "/v1/table"),
        (b"GET /v1/table HTTP/1.1\r\nHost: x\r\nA: ", 408, "/v1/table"),
        (b"POST /v1/mu-macro HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n\r\n{", 408, SINGLE),
        (
            b"POST /v1/mu-macro HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\nx",
            400,
            SINGLE,
        ),
    ],
)
def test_an_answer_to_what_is_no_whole_request_has_an_id_a_line_and_a_counter(
    strict_server: Any, text: bytes, status: int, path: str
) -> None:
    with connect(strict_server) as raw:
        raw.sendall(text)
        received = to_end(raw)
    head, _, body = received.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 %d " % status)
    identity = json.loads(body)["request_id"]
    assert f"\r\nx-request-id: {identity}".encode() in head
    deadline = time.monotonic() + 60
    while not (lines := [x for x in accesses(strict_server.lines) if x["request_id"] == identity]):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert [(line["status"], line["path"]) for line in lines] == [(status, path)]
    counters = strict_server.ask("GET", "/metrics")[2].decode()
    assert re.search(rf'mumacro_requests_total{{[^}}]*status="{status}"}}', counters)
    assert "Traceback" not in strict_server.log.read_text("utf-8")


@pytest.fixture(scope="module")
def strict_server(serving: Any, surrogate: Surrogate) -> Any:
    with serving(surrogate.path, MUMACRO_CLIENT_TIMEOUT_S="1") as server:
        yield server


def test_a_client_that_does_not_read_its_answer_is_no_error_of_the_service(
    strict_server: Any,
) -> None:
    body = json.dumps({**CASE, "v0": [1e-6 * i for i in range(1, 100_001)], "include": ["limits"]})
    with connect(strict_server, receive_buffer=4096) as raw:
        raw.sendall(head(BATCH, len(body)) + body.encode())
        deadline = time.monotonic() + 60
        while not [x for x in accesses(strict_server.lines) if x["path"] == BATCH]:
            assert time.monotonic() < deadline
            time.sleep(0.1)
    lines = fields_of(strict_server.lines)
    of_batch = [line for line in lines if line.get("path") == BATCH]
    assert [line.get("status") for line in of_batch] == [None, 408]
    assert of_batch[0]["message"] == "a long request begins"
    assert not [line for line in lines if line["level"] == "error"]


def test_the_log_goes_on_after_a_line_that_cannot_be_written(capfd: Any) -> None:
    lines = LogLines()
    for value in ("\ud800", {1: 2}, object()):
        lines.put({"time": datetime.now(UTC), "level": "info", "logger": "x", "message": value})
        lines.flush()
    lines.put({"time": datetime.now(UTC), "level": "info", "logger": "x", "message": "the last"})
    lines.flush()
    LogLines.running = None
    time.sleep(0.2)
    written = capfd.readouterr().out.splitlines()
    assert len(written) == 4
    assert "the last" in written[-1]


def test_lines_that_cannot_be_written_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    lines, real = LogLines(), os.write

    def full(number: int, data: Any) -> int:
        if number == 1:
            raise OSError(errno.ENOSPC, "no space left on device")
        return real(number, data)

    monkeypatch.setattr(os, "write", full)
    for i in range(3):
        lines.put({"time": datetime.now(UTC), "level": "info", "logger": "x", "message": str(i)})
    lines.flush()
    assert lines.lost == 3
    LogLines.running = None


def test_a_trace_is_in_the_line_of_its_request(strict_server: Any) -> None:
    trace = f"00-{'ab' * 16}-{'cd' * 8}-01"
    values = {"trace-1": trace, "trace-2": "00-no-trace", "trace-3": trace.upper()}
    for name, value in values.items():
        headers = {"traceparent": value, "X-Request-ID": name}
        strict_server.ask("GET", "/v1/table", headers=headers)
    until, told = time.monotonic() + 60, dict[str, Any]()
    while len(told) < len(values):
        assert time.monotonic() < until
        time.sleep(0.1)
        lines = (line for line in accesses(strict_server.lines) if line["request_id"] in values)
        told = {line["request_id"]: line.get("traceparent") for line in lines}
    assert told == {"trace-1": trace, "trace-2": None, "trace-3": None}


def test_a_service_without_standard_output_serves_and_writes_to_nobody(
    surrogate: Surrogate,
) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = f"exec {sys.executable} -m service --port {port} --tables {surrogate.path} >&- 2>&-"
    variables = {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(["sh", "-c", command], cwd=ROOT, env=variables)

    def ready() -> bytes:
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
        try:
            connection.request("GET", "/readyz")
            return connection.getresponse().read()
        finally:
            connection.close()

    try:
        until, answer = time.monotonic() + 120, b""
        while not answer.startswith(b'{"status":"ready"'):
            assert process.poll() is None
            assert time.monotonic() < until
            time.sleep(0.1)
            with suppress(OSError):
                answer = ready()
        process.terminate()
        assert process.wait(60) == 0
    finally:
        process.kill()


def test_only_a_probe_that_fails_is_told_in_the_log(
    started: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: Any
) -> None:
    caplog.set_level(logging.INFO, "mumacro")
    monkeypatch.setattr(LogLines, "running", kept := Mock())
    with started(tables=(tmp_path,)) as client:
        for path, status in (("/livez", 200), ("/readyz", 503)):
            assert client.get(path).status_code == status
    lines = [call.args[0] for call in kept.put.call_args_list]
    assert [(line["path"], line["status"], line["level"]) for line in lines] == [
        ("/readyz", 503, "info")
    ]

"""The service's log: complete lines of JSON for any request, no secrets, and no waiting for the reader of the log."""

import http.client
import json
import os
import re
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest

pytestmark = pytest.mark.slow

SINGLE, BATCH = "/v1/mu-macro", "/v1/mu-macro/batch"
JSON = {"Content-Type": "application/json"}
#: texts that a client behind a proxy can send in place of its address
NO_ADDRESS = ['a"b', "a\\", '1.2.3.4" "level": "error', "\t1.2.3.4", "{}", "\u00e9\u00ff", "a" * 5000]


def fields_of(lines):
    """Every line as an object; a line that is not JSON, or has a name twice, fails the test."""

    def once(pairs):
        names = [name for name, _ in pairs]
        assert len(names) == len(set(names)), names
        return dict(pairs)

    return [json.loads(line, object_pairs_hook=once) for line in lines]


def test_a_forwarded_address_cannot_forge_a_log_line(serving, surrogate, case):
    known = "&".join(f"{name}={value}" for name, value in case.items())
    with serving(surrogate.path) as server:
        for text in NO_ADDRESS:
            said = {**JSON, "X-Forwarded-For": text.encode("latin-1")}
            assert server.ask("POST", SINGLE, json.dumps(case), said)[0] == 200
            assert server.ask("GET", f"{SINGLE}?{known}", headers=said)[0] == 200
            assert server.ask("POST", BATCH, json.dumps([case]), said)[0] == 200
            assert server.ask("GET", "/nowhere", headers=said)[0] == 404
        assert server.stop() == 0
    access = [line for line in fields_of(server.lines) if line["logger"] == "mumacro.access"]
    shown = [line["client"] for line in access if line["status"] == 404]
    assert shown == [text.strip()[:64] for text in NO_ADDRESS]
    assert len(access) >= 4 * len(NO_ADDRESS)
    assert all(len(line["client"]) <= 64 and line["level"] == "info" for line in access)


def test_paths_and_names_of_clients_cannot_forge_a_log_line(serving, surrogate):
    with serving(surrogate.path) as server:
        for path in ("/%0a%7B%22level%22%3A%22error%22%7D", "/%22", "/%00", "/%ff", "/%E2%80%A8", "/a%0d%0ab"):
            assert server.ask("GET", path)[0] == 404
        for name in ("a%0ab", "%22"):
            assert server.ask("GET", f"/v1/table?id={name}")[0] in (404, 422)
        assert server.stop() == 0
    assert not [line for line in fields_of(server.lines) if line["level"] not in ("info", "warning")]


def test_no_key_is_logged_or_shown(serving, surrogate, case):
    keys = {"alice": "k3y-of-alice", "bob": "k3y-of-bob"}
    told = []
    settings = ",".join(f"{name}={key}" for name, key in keys.items())
    with serving(surrogate.path, "--log-level", "debug", MUMACRO_API_KEYS=settings) as server:
        body = json.dumps(case)
        for headers in (
            {"X-API-Key": keys["alice"]}, {"Authorization": f"Bearer {keys['bob']}"}, {"X-API-Key": "wr0ng-key"},
            {"Authorization": "Basic wr0ng-key"}, {"Authorization": f"{keys['bob']}"},
        ):  # fmt: skip
            for method, path, sent in (("POST", SINGLE, body), ("POST", BATCH, f"[{body}]"), ("POST", SINGLE, "{")):
                status, answered, content = server.ask(method, path, sent, {**JSON, **headers})
                told.append(f"{status} {answered} {content!r}")
            told.append(str(server.ask("GET", "/metrics", headers=headers)))
            told.append(str(server.ask("GET", "/openapi.json", headers=headers)))
        assert server.stop() == 0
    for text in (*keys.values(), "wr0ng-key"):
        assert text not in "".join(server.lines)
        assert text not in "".join(told)
    assert {line.get("key") for line in fields_of(server.lines)} == {None, "alice", "bob"}


@contextmanager
def started(repository, surrogate):
    """A service whose standard output is read up to the line with its port only."""
    command = [sys.executable, "-m", "service", "--port", "0", "--tables", str(surrogate.path)]
    variables = {name: value for name, value in os.environ.items() if not name.startswith("MUMACRO_")}
    process = subprocess.Popen(command, cwd=repository, env=variables, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    try:
        read = []
        while not (found := re.search(rb"running on http://[^ ]+:(\d+) ", read[-1] if read else b"")):
            read.append(process.stdout.readline())
            assert read[-1], b"".join(read)
        yield process, int(found[1]), read
        process.terminate()
        assert process.wait(60) == 0
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def statuses(port, path, many=1):
    """Responses to the same request on one connection."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    found = []
    for _ in range(many):
        connection.request("GET", path)
        response = connection.getresponse()
        response.read()
        found.append(response.status)
    connection.close()
    return found


def test_a_log_reader_that_stalls_delays_no_request(repository, surrogate, case):
    query = f"{SINGLE}?" + "&".join(f"{name}={value}" for name, value in case.items())
    with started(repository, surrogate) as (process, port, lines):
        deadline = time.monotonic() + 180
        while statuses(port, "/readyz") != [200]:
            assert time.monotonic() < deadline
            time.sleep(0.1)
        # Some 250 bytes a line: a pipe holds 64 kB, and the service a megabyte.
        with ThreadPoolExecutor(4) as pool:
            answered = [pool.submit(statuses, port, *asked) for asked in 4 * [(query, 3000)] + 4 * [("/x", 500)]]
        assert [one.result() for one in answered] == 4 * [3000 * [200]] + 4 * [500 * [404]]
        reader = threading.Thread(target=lambda: lines.extend(process.stdout))
        reader.start()
        assert statuses(port, "/y") == [404]
        process.terminate()
        assert process.wait(60) == 0
        reader.join(60)
    found = fields_of(lines)
    (dropped,) = {line["logger"] for line in found if "were dropped" in line["message"]}
    assert dropped == "service.observe"
    lost = sum(int(line["message"].split()[0]) for line in found if "were dropped" in line["message"])
    access = [line for line in found if line["logger"] == "mumacro.access"]
    assert lost > 0
    assert lost + len(access) >= 14_000


def test_a_log_reader_that_stays_stalled_does_not_prevent_the_end(repository, surrogate):
    with started(repository, surrogate) as (_, port, _):
        assert statuses(port, "/nowhere", 2000) == 2000 * [404]


def test_a_log_reader_that_leaves_does_not_end_the_service(repository, surrogate):
    with started(repository, surrogate) as (process, port, _):
        process.stdout.close()
        for _ in range(20):
            assert statuses(port, "/nowhere") == [404]

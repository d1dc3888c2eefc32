"""Counters: their values, over all code paths and all workers."""

import _thread
import asyncio
import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
from prometheus_client.parser import text_string_to_metric_families

from mumacro import Surrogate
from service.admission import threads_end
from service.metrics import NOW, Metrics
from tests.support.cases import CASE, Case

PATH = "/v1/mu-macro"


def samples(text: str) -> Any:
    return {
        (sample.name, *sorted(sample.labels.values())): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


@pytest.fixture
def fresh(started: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr("service.app._LOOK_EVERY_S", 0.01)
    with started() as client:
        yield client


def scrape(fresh: Any) -> Any:
    response = fresh.get("/metrics")
    assert response.status_code == 200
    assert response.headers["content-type"] == "text/plain; version=1.0.0; charset=utf-8"
    assert response.headers["cache-control"] == "no-store"
    return samples(response.text)


def test_requests_are_counted_by_route_method_and_status(fresh: Any, case: Case) -> None:
    for _ in range(3):
        fresh.post(PATH, json=case)
    fresh.get(PATH, params=case)
    fresh.post(PATH, json={**case, "mu0": -1})
    fresh.post(f"{PATH}/batch", json=[case])
    fresh.get("/nowhere/at/all")
    fresh.request("BREW", "/livez")
    counters = scrape(fresh)
    for route, method, status, number in (
        (PATH, "POST", "200", 3),
        (PATH, "GET", "200", 1),
        (PATH, "POST", "422", 1),
        (f"{PATH}/batch", "POST", "200", 1),
        ("other", "GET", "404", 1),
        ("/livez", "other", "405", 1),
    ):
        assert counters["mumacro_requests_total", *sorted((route, method, status))] == number
    assert counters["mumacro_request_duration_seconds_count", PATH] == 5
    assert counters["mumacro_request_duration_seconds_bucket", *sorted((PATH, "+Inf"))] == 5
    assert counters["mumacro_request_duration_seconds_sum", PATH] > 0
    for path in fresh.get("/openapi.json").json()["paths"]:
        fresh.put(path)
    counters = scrape(fresh)
    for path in fresh.get("/openapi.json").json()["paths"]:  # by its own name
        assert counters["mumacro_requests_total", *sorted((path, "other", "405"))] >= 1


def test_clients_cannot_add_labels(fresh: Any, case: Case) -> None:
    """The number of series does not depend on the paths, methods and names that clients send."""

    def ask(i: Any) -> None:
        fresh.get(f"/nowhere/{i}")
        fresh.request(f"BREW{i}", f"/v1/{i}")
        fresh.get("/v1/table", params={"id": f"t{i}"})
        fresh.post(PATH, json=case, headers={"X-Request-ID": f"id{i}", "User-Agent": f"agent{i}"})

    ask(0)
    scrape(fresh)
    before = scrape(fresh).keys()  # now it counts the first request to /metrics, too
    for i in range(1, 200):
        ask(i)
    assert scrape(fresh).keys() == before


def test_cases_are_counted_by_source_and_regime(
    fresh: Any, case: Case, surrogate: Surrogate
) -> None:
    rows = [{**case, "v0": v0} for v0 in (0, 1e-4, 0.01, 0.1, 10.0)] + [{**case, "v0": -1}] * 4
    answers = [fresh.post(PATH, json=row).json() for row in rows[:5]]
    fresh.post(f"{PATH}/batch", json=rows)
    fresh.get(PATH, params=rows[1])
    fresh.post(PATH, json={**rows[2], "include": ["limits"]})
    fresh.post(f"{PATH}/batch", json={**case, "v0": [rows[4]["v0"]] * 1000})
    counters = scrape(fresh)
    expected: dict[tuple[str, ...], int] = {}
    for answer in [*answers * 2, answers[1], answers[2], *[answers[4]] * 1000]:
        key = ("mumacro_cases_total", *sorted((surrogate.id, answer["source"], answer["regime"])))
        expected[key] = expected.get(key, 0) + 1
    assert {
        key: value for key, value in counters.items() if key[0] == "mumacro_cases_total"
    } == expected
    assert counters["mumacro_bad_cases_total", surrogate.id] == 4
    assert counters["mumacro_table_info", *sorted((surrogate.id, f"{surrogate.tolerance:g}"))] == 1


@pytest.mark.slow
def test_several_workers_behind_a_key_count_together_and_stop(
    serving: Any, surrogate: Surrogate, case: Case
) -> None:
    body, requests, key = json.dumps(case), 40, {"X-API-Key": "k3y"}
    with serving(surrogate.path, "--workers", "2", MUMACRO_API_KEY="k3y") as server:
        server.wait_until_ready(2)
        assert server.ask("GET", "/metrics")[0] == 401
        for _ in range(requests):
            assert server.ask("POST", PATH, body, key)[0] == 200
        counted = ("mumacro_requests_total", *sorted((PATH, "POST", "200")))
        deadline = time.monotonic() + 60
        in_a_row = 0
        while in_a_row < 20:  # more scrapes than one worker would get by chance
            counters = samples(server.ask("GET", "/metrics", headers=key)[2].decode())
            assert counters.get(counted, 0) <= requests
            in_a_row = in_a_row + 1 if counters.get(counted) == requests else 0
            assert time.monotonic() < deadline
        assert server.stop() == 0
    assert all(json.loads(line) for line in server.lines)


def test_without_room_for_shared_counters_a_worker_has_its_own(
    surrogate: Surrogate, repository: Path, tmp_path: Path
) -> None:
    """Files that cannot be reserved; a page of one without room would end the process."""
    program = (
        "import sys; from pathlib import Path; from service.app import create_app;"
        "from service.settings import Settings;"
        "app = create_app(Settings(tables=(Path(sys.argv[1]),))); app.state.tables.load();"
        "metrics = app.state.metrics; metrics.start(app.state.tables);"
        "metrics.request('/livez', 'GET', 200, 0.1); sys.stdout.buffer.write(metrics.text())"
    )
    killed = subprocess.Popen(["true"])
    killed.wait()
    left = tmp_path / f"gauge_livesum_{killed.pid}.db"  # by a worker, which holds nothing any more
    left.write_bytes(bytes(100))
    for folder in (tmp_path / "is not there", tmp_path):
        done = subprocess.run(
            [sys.executable, "-c", program, str(surrogate.path)],
            cwd=repository,
            env={**os.environ, "PROMETHEUS_MULTIPROC_DIR": str(folder)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert ("no room for shared counters" in done.stderr) == (folder != tmp_path)
        counted = 'mumacro_requests_total{method="GET",route="/livez",status="200"} 1.0'
        assert counted in done.stdout.splitlines()
    files = [path.name for path in tmp_path.iterdir()]
    assert (len(files), left.name in files) == (4, False), files


def test_a_worker_goes_on_with_the_counts_of_an_earlier_one_of_its_number(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PROMETHEUS_MULTIPROC_DIR", str(tmp_path))
    earlier = tmp_path / f"counter_{os.getpid()}.db"
    earlier.write_bytes(b"counts")
    Metrics(())
    assert earlier.read_bytes() == b"counts"
    assert len([*tmp_path.iterdir()]) == 4


def test_a_slot_is_given_back_when_its_thread_cannot_start_and_counters_need_none(
    fresh: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    law = {**CASE, "start": 1e-3, "stop": 1.0}
    del law["v0"]

    with monkeypatch.context() as without_threads:
        refuse = Mock(side_effect=RuntimeError("can't start new thread"))
        without_threads.setattr(_thread, "start_new_thread", refuse)
        for _ in range(20):
            assert fresh.post("/v1/law", json=law).status_code == 503
    assert fresh.app.state.admission.slots == 0
    assert asyncio.run(threads_end(60.0))  # a stop waits for none of them
    assert fresh.post("/v1/law", json=law).status_code == 200
    monkeypatch.setattr(type(fresh.app.state.admission), "slots", 8)
    assert fresh.post("/v1/law", json=law).status_code == 503
    assert [fresh.get(path).status_code for path in ("/metrics", "/livez", "/readyz")] == [200] * 3


def shows(fresh: Any, name: str, value: float) -> bool:
    """Whether a present value is shown, at once or after the next look."""
    until = time.monotonic() + 60
    while scrape(fresh).get((name,)) != value and time.monotonic() < until:
        time.sleep(0.01)
    return bool(scrape(fresh).get((name,)) == value)


def test_what_is_held_now_is_shown(fresh: Any) -> None:
    assert shows(fresh, "mumacro_slots", 8)
    values = {name: x for (name, *labels), x in scrape(fresh).items() if not labels}
    assert {f"mumacro_{name}" for name in NOW} <= values.keys()
    assert values["process_resident_memory_bytes"] > 1e7
    admission = fresh.app.state.admission
    admission.hold("a", 1000)
    assert shows(fresh, "mumacro_held_bytes", 1000)
    admission.hold("a", -1000)


def test_every_alert_asks_for_metrics_that_there_are(fresh: Any, repository: Path) -> None:
    text = (repository / "deploy" / "alerts.yaml").read_text()
    assert shows(fresh, "mumacro_slots", 8)
    fresh.post(PATH, json=CASE)
    names = {name for name, *_ in scrape(fresh)}
    asked = {*re.findall(r"\b(?:mumacro|process)_[a-z_]+\b", text)}
    assert asked <= names, asked - names

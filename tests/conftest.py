"""Shared by the tests: the committed tables, a service with its client, reference values, solvers, the builder."""

import csv
import http.client
import importlib
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, Queue
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray

from builder.sweep import Sweep
from mumacro import Surrogate

if TYPE_CHECKING:  # tests of the library need neither the service nor its dependencies
    from starlette.testclient import TestClient

    from service.app import Application

START_S = 180
REPOSITORY = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def repository() -> Path:
    """The root of the source tree."""
    return REPOSITORY


@pytest.fixture(scope="session")
def tables_dir(repository: Path) -> Path:
    """The committed tables."""
    return repository / "tables"


@pytest.fixture(scope="session")
def app(tables_dir: Path) -> "Application":
    """An application on the committed tables, with default settings."""
    from service.app import create_app
    from service.settings import Settings

    return create_app(Settings(tables=(tables_dir,)))


@pytest.fixture(scope="session")
def client(app: "Application") -> "Iterator[TestClient]":
    """A client of that application, after its start."""
    from starlette.testclient import TestClient

    with TestClient(app) as started:
        yield started


@pytest.fixture(scope="session")
def surrogate() -> Surrogate:
    """The tightest committed table, which is also the default of the service."""
    return Surrogate.open()


@pytest.fixture
def case() -> dict[str, Any]:
    """One ordinary case, SI."""
    return {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "y0": 2e-6, "omega": 1.3e5, "v0": 0.01}


@pytest.fixture(scope="session")
def problem() -> Callable[..., dict[str, Any]]:
    """A check that a response is a problem document of RFC 9457; returns the document."""

    def check(response: Any, status: int) -> dict[str, Any]:
        assert response.status_code == status, response.text
        assert response.headers["content-type"] == "application/problem+json"
        document: dict[str, Any] = response.json()
        assert {"type", "title", "status", "detail", "instance"} <= document.keys()
        assert document["status"] == status
        assert document["instance"] == response.request.url.path
        assert document["request_id"] == response.headers["x-request-id"]
        assert "Traceback" not in response.text
        return document

    return check


@dataclass(frozen=True)
class LiveServer:
    """A service process on a loopback port."""

    url: str
    log: Path


@pytest.fixture(scope="session")
def live_server(
    surrogate: Surrogate, repository: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[LiveServer]:
    """One service on the committed tables for all tests that use a real socket and do not stop it."""
    log = tmp_path_factory.mktemp("live") / "log.jsonl"
    variables = {name: value for name, value in os.environ.items() if not name.startswith("MUMACRO_")}
    command = [sys.executable, "-m", "service", "--port", "0", "--tables", str(surrogate.path.parent)]
    with log.open("wb") as sink:
        process = subprocess.Popen(command, cwd=repository, env=variables, stdout=sink, stderr=subprocess.STDOUT)
    try:
        deadline = time.monotonic() + START_S
        while (found := re.search(r"running on (http://[^ ]+:\d+) ", log.read_text("utf-8"))) is None:
            assert process.poll() is None, log.read_text("utf-8")
            assert time.monotonic() < deadline, log.read_text("utf-8")
            time.sleep(0.05)
        wait_until_ready(found[1])
        yield LiveServer(found[1], log)
    finally:
        process.terminate()
        process.wait(timeout=60)


def wait_until_ready(url: str) -> None:
    """Wait until the service at the URL reports that it is ready; it listens earlier."""
    deadline = time.monotonic() + START_S
    while True:
        try:
            with urllib.request.urlopen(f"{url}/readyz", timeout=60):
                return
        except OSError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)


@pytest.fixture(scope="session")
def bridge(repository: Path) -> Iterator[str]:
    """The address of the example server for UM-Bridge."""
    pytest.importorskip("umbridge", reason="the PyPI package umbridge is not installed")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    process = subprocess.Popen([sys.executable, "examples/umbridge_server.py", str(port)], cwd=repository,
                               env={**os.environ, "PYTHONPATH": str(repository)}, stdout=-3, stderr=-3)  # fmt: skip
    try:
        deadline = time.monotonic() + 60
        while True:
            try:
                socket.create_connection(("127.0.0.1", port), timeout=1).close()
                break
            except OSError:
                assert process.poll() is None
                assert time.monotonic() < deadline
                time.sleep(0.1)
        yield f"http://127.0.0.1:{port}"
    finally:
        process.terminate()
        process.wait(timeout=30)


class Server:
    """A service process for one test, and its log."""

    def __init__(self, repository, tables, arguments, environment):
        command = [sys.executable, "-m", "service", "--port", "0", "--tables", str(tables), *arguments]
        variables = {name: value for name, value in os.environ.items() if not name.startswith("MUMACRO_")}
        self.process = subprocess.Popen(
            command,
            cwd=repository,
            env={**variables, **environment},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.lines = []
        self._ports = Queue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        try:
            self.port = self._ports.get(timeout=START_S)
        except Empty:
            self.port = None

    def _read(self):
        for line in self.process.stdout:
            self.lines.append(line)
            found = re.search(r"running on http://[^ ]+:(\d+) ", line)
            if found:
                self._ports.put(int(found[1]))
        self._ports.put(None)

    def ask(self, method, path, body=None, headers=None, **options):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        try:
            connection.request(method, path, body, headers or {}, **options)
            response = connection.getresponse()
            return response.status, dict(response.getheaders()), response.read()
        finally:
            connection.close()

    def wait_for_workers(self):
        """Wait until the port is open: with several workers it is known earlier."""
        deadline = time.monotonic() + START_S
        while True:
            try:
                return self.ask("GET", "/livez")
            except ConnectionRefusedError:
                assert time.monotonic() < deadline, "".join(self.lines)
                time.sleep(0.1)

    def wait_until_ready(self):
        """Wait until requests are answered, or refused permanently because of the tables."""
        deadline = time.monotonic() + START_S
        while True:
            self.wait_for_workers()
            status, _, body = self.ask("GET", "/readyz")
            if status == 200 or b"not loaded yet" not in body:
                return
            assert time.monotonic() < deadline, "".join(self.lines)
            time.sleep(0.05)

    def wait_for_tables(self, workers):
        """Wait until this number of workers have logged that their tables are loaded."""
        deadline = time.monotonic() + START_S
        while sum("tables are loaded" in line for line in list(self.lines)) < workers:
            assert time.monotonic() < deadline, "".join(self.lines)
            time.sleep(0.05)
        self.wait_until_ready()

    def stop(self, number=signal.SIGTERM):
        self.process.send_signal(number)
        return self.wait()

    def wait(self):
        code = self.process.wait(timeout=60)
        self._reader.join(timeout=60)
        self.process.stdout.close()
        return code


@pytest.fixture(scope="session")
def serving(repository: Path) -> Callable[..., AbstractContextManager[Server]]:
    """A separate service process, until the context ends."""

    @contextmanager
    def serve(tables: Path, *arguments: str, ready: bool = True, **environment: str) -> Iterator[Server]:
        server = Server(repository, tables, arguments, environment)
        try:
            assert server.port, "".join(server.lines)
            if ready:
                server.wait_until_ready()
            yield server
        finally:
            if server.process.poll() is None:
                server.stop(signal.SIGKILL)

    return serve


@pytest.fixture(scope="session")
def open_page(live_server: LiveServer, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., Any]]:
    """Opens the page in a headless Chromium (tests/browser.py), if installed."""
    module = importlib.import_module("browser")
    try:
        browser = module.start(tmp_path_factory.mktemp("browser"))
    except LookupError as error:
        pytest.skip(str(error))
    yield module.Opened(browser, live_server.url)
    browser.quit()


# --- shared by the numerical tests ---------------------------------------------------------------------


@dataclass(frozen=True)
class Reference:
    """The 496 points of an independent quadruple-precision solver, tests/data/points.csv; columns as arrays (496,)."""

    case: NDArray[np.str_]
    v: NDArray[np.float64]
    y: NDArray[np.float64]
    mu_ratio: NDArray[np.float64]
    regime: NDArray[np.str_]
    stick_fraction: NDArray[np.float64]


@pytest.fixture(scope="session")
def reference(repository: Path) -> Reference:
    """All reference points."""
    with (repository / "tests" / "data" / "points.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    text = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return Reference(
        text["case"], text["v"].astype(float), text["y"].astype(float), text["mu_ratio"].astype(float),
        text["regime"], text["stick_fraction"].astype(float),
    )  # fmt: skip


@pytest.fixture(scope="session")
def reference_border(repository: Path) -> NDArray[np.float64]:
    """The border of the same solver, tests/data/border.csv: rows of y~, v~crit, mu~ there, shape (17, 3)."""
    return np.loadtxt(repository / "tests" / "data" / "border.csv", delimiter=",", skiprows=1)


@pytest.fixture(scope="session")
def sweep() -> Iterator[Sweep]:
    """Compiled solving of many points at once."""
    with Sweep(workers=2) as started:
        yield started


@pytest.fixture(scope="session")
def naive() -> ModuleType:
    """The naive solver."""
    return importlib.import_module("naive")


@pytest.fixture(scope="session")
def compilers() -> ModuleType:
    """The compilers that are installed."""
    return importlib.import_module("compilers")


@pytest.fixture(scope="session")
def run_builder(repository: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """``python -m builder ARGUMENTS`` as a user starts it; returns the finished process."""

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        words = [sys.executable, "-m", "builder", *map(str, arguments)]
        return subprocess.run(words, cwd=repository, capture_output=True, text=True, timeout=300, check=False)

    return run

"""Shared by the tests: the committed tables, a service with its client, reference values, solvers,
the builder."""

import gc
import os
import re
import socket
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

from builder.solver.sweep import Sweep
from mumacro import Surrogate
from tests.support import browser as browsing
from tests.support import serving as servers
from tests.support.cases import CASE, Array, Case
from tests.support.nightly import COLLECTED
from tests.support.serving import Server

if TYPE_CHECKING:  # tests of the library need neither the service nor its dependencies
    from starlette.testclient import TestClient

TESTS = Path(__file__).resolve().parent
REPOSITORY = TESTS.parent

# a test that is stated for all examples states nothing about their time: a busy machine may take
# any
settings.register_profile(
    "any time", settings.default, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("any time")


@pytest.fixture(scope="session")
def repository() -> Path:
    """The root of the source tree."""
    return REPOSITORY


@pytest.fixture(scope="session")
def tables_dir(repository: Path) -> Path:
    """The committed tables."""
    return repository / "tables"


@pytest.fixture(scope="session")
def started(tables_dir: Path) -> "Callable[..., TestClient]":
    """A client of an application on the committed tables with these settings; as a context it
    starts and ends it."""
    from starlette.testclient import TestClient

    from service.app import create_app
    from service.settings import Settings

    return lambda **settings: TestClient(
        create_app(Settings(**{"tables": (tables_dir,), "guide": None, **settings}))
    )


@pytest.fixture(scope="session")
def client(started: "Callable[..., TestClient]") -> "Iterator[TestClient]":
    """A client of one with default settings, after its start."""
    with started() as one:
        yield one


@pytest.fixture(scope="session")
def surrogate() -> Surrogate:
    """The tightest committed table, which is also the default of the service."""
    return Surrogate.open()


@pytest.fixture
def case() -> Case:
    """One ordinary case, SI."""
    return {**CASE}


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


@pytest.fixture(scope="session")
def live_server(surrogate: Surrogate) -> Iterator[Server]:
    """One service on the committed tables for all tests that use a real socket and do not stop
    it."""
    with servers.serving(surrogate.path.parent) as server:
        yield server


@pytest.fixture(scope="session")
def serving() -> Callable[..., AbstractContextManager[Server]]:
    """A separate service process, until the context ends."""
    return servers.serving


@pytest.fixture(scope="session")
def bridge(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of the example server for UM-Bridge."""
    pytest.importorskip("umbridge", reason="umbridge of requirements/peers.txt is not installed")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "examples/umbridge_server.py", str(port)]
    with servers.running(command, tmp_path_factory.mktemp("bridge") / "log") as server:
        yield server.url


@pytest.fixture(scope="session")
def open_page(
    live_server: Server, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Callable[..., Any]]:
    """Opens the page in a headless Chromium (tests/support/browser.py), if installed."""
    try:
        browser = browsing.start(tmp_path_factory.mktemp("browser"))
    except LookupError as error:
        pytest.skip(str(error))
    yield browsing.Opened(browser, live_server.url)
    browser.quit()


# --- shared by the numerical tests ----------------------------------------------------------------


@pytest.fixture(scope="session")
def reference(repository: Path) -> Any:
    """The 496 points of an independent quadruple-precision solver: columns of
    tests/data/points.csv, (496,) each."""
    points = repository / "tests" / "data" / "points.csv"
    return np.genfromtxt(points, delimiter=",", names=True, dtype=None, encoding="utf-8").view(
        np.recarray
    )


@pytest.fixture(scope="session")
def reference_border(repository: Path) -> Array:
    """The border of the same solver, tests/data/border.csv: rows of y~, v~crit, mu~ there, shape
    (17, 3)."""
    return np.loadtxt(repository / "tests" / "data" / "border.csv", delimiter=",", skiprows=1)


@pytest.fixture(scope="session")
def sweep() -> Iterator[Sweep]:
    """Compiled solving of many points at once."""
    with Sweep(workers=2) as started:
        yield started


@pytest.fixture(scope="session")
def run_builder(repository: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """``python -m builder ARGUMENTS`` as a user starts it; returns the finished process."""

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        words = [sys.executable, "-m", "builder", *map(str, arguments)]
        return subprocess.run(
            words, cwd=repository, capture_output=True, text=True, timeout=300, check=False
        )

    return run


# --- tests of programs that this one works with ---------------------------------------------------

#: fixtures that need a package of requirements/peers.txt
PEERS = {"bridge", "fmpy", "open_page"}


#: files of minutes, in the order of their time: they come first, so that none of them is left to
#: one processor at the end (dev.py keeps this order)
LONGEST = (
    "test_service_fuzz.py",
    "test_guide.py",
    "test_kernel_safety.py",
    "test_c_header.py",
    "test_processors.py",
    "test_builder_cli.py",
    "test_reliability.py",
    "test_packaging.py",
    "test_wheel.py",
    "test_export.py",
    "test_committed_tables.py",
    "test_fitting.py",
    "test_verify.py",
    "test_benchmarks.py",
    "test_files_run.py",
)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, Any, Any]:
    """Thousands of tests and all modules are found, and stay: nothing of them is looked through for
    garbage, now or between the tests."""
    gc.disable()
    found = yield
    gc.freeze()
    gc.enable()
    return found


@pytest.hookimpl(tryfirst=True)  # before the expression of -m is applied
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """A test with such a fixture is marked peer; nightly ones are told apart; the longest files
    come first."""
    collected: dict[bool, set[tuple[str, str]]] = {False: set(), True: set()}
    config.stash[COLLECTED] = collected
    for item in items:
        if PEERS & {*getattr(item, "fixturenames", ())}:
            item.add_marker("peer")
        file, function = item.path.relative_to(TESTS).as_posix(), getattr(item, "originalname", "")
        collected[item.get_closest_marker("nightly") is not None].add((file, function))
    place = {name: i for i, name in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.path.name, len(place)))


# --- nothing is skipped silently ------------------------------------------------------------------

#: reasons of skips that a run with CI=true may have: what no package index offers there, other
#: users, other systems
EXPECTED_SKIPS = (
    r"soffice is not installed",
    r"curl [\d.]+ has no --json",
    r"mounting a small file system",
    r"only root may run",
    r"another user cannot run",
    r"this user may write everywhere",
    r"Python 3\.\d+ is neither on the PATH nor in pyenv",
    r"the amplitude is not small compared with the speed",
    r"no x86 processor",
)


def unexpected_skips(config: pytest.Config) -> list[str]:
    """Reasons of skips that are neither above nor about a program that .ci/run could not
    install."""
    if os.environ.get("CI") != "true" or hasattr(config, "workerinput"):
        return []
    missing = os.environ.get("CI_MISSING", "").split()
    expected = re.compile("|".join([*EXPECTED_SKIPS, *map(re.escape, missing)]))
    reports = getattr(config.pluginmanager.get_plugin("terminalreporter"), "stats", {}).get(
        "skipped", []
    )
    reasons = {
        str(report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr)
        for report in reports
    }
    return sorted(reason for reason in reasons if not expected.search(reason))


def pytest_sessionfinish(session: pytest.Session) -> None:
    """A skip that nobody expected fails the run."""
    if unexpected_skips(session.config) and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """Such skips at the end of the output."""
    for reason in unexpected_skips(config):
        terminalreporter.write_line(f"FAILED: an unexpected skip: {reason}", red=True)

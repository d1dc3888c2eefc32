"""What the tests of the service share: the committed tables, an application, a client, and the form of errors."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from friction import Surrogate
from service.app import create_app
from service.settings import Settings

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
def app(tables_dir: Path) -> FastAPI:
    """An application on the committed tables, with default settings."""
    return create_app(Settings(tables=(tables_dir,)))


@pytest.fixture(scope="session")
def client(app: FastAPI) -> Iterator[TestClient]:
    """A client of that application, after its start."""
    with TestClient(app) as started:
        yield started


@pytest.fixture(scope="session")
def surrogate(client: TestClient, app: FastAPI) -> Surrogate:
    """The table that answers by default."""
    assert client.get("/readyz").status_code == 200
    found: Surrogate = app.state.shelf.tables[0].surrogate
    return found


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

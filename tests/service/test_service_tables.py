"""Tables behind the service: metadata, the file, choice by tolerance, health with and without
them."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from mumacro import Surrogate, TableError
from tests.support.cases import Case

HEALTH = ("/readyz", "/healthz")


@pytest.fixture
def table_copy(surrogate: Surrogate, tmp_path: Path) -> Any:
    return Path(shutil.copy(surrogate.path, tmp_path / surrogate.path.name))


def test_the_table_describes_itself(client: Any, surrogate: Surrogate) -> None:
    answer = client.get("/v1/table").json()
    label = {name: getattr(surrogate, name) for name in ("id", "tolerance")}
    expected = {
        name: getattr(surrogate, name)
        for name in ("checksum", "max_abs_error", "max_rel_error", "error_distribution")
    }
    expected |= {
        **label,
        "table": label,
        "file": surrogate.path.name,
        "size_bytes": surrogate.path.stat().st_size,
    }
    assert {name: answer[name] for name in expected} == expected
    assert all(answer[name] for name in ("attributes", "blocks"))
    assert label in answer["loaded"]


@pytest.mark.parametrize(
    ("tolerance", "name"),
    [
        (None, "1e-12"),
        (1e-12, "1e-12"),
        (9e-11, "1e-12"),
        (1e-10, "1e-10"),
        (2e-8, "1e-10"),
        (1e-7, "1e-7"),
        (1, "1e-4"),
    ],
)
def test_the_smallest_table_that_is_tight_enough_is_picked(
    client: Any, case: Case, tolerance: Any, name: str
) -> None:
    picked = client.get(
        "/v1/table", params={} if tolerance is None else {"tolerance": tolerance}
    ).json()
    assert picked["id"] == f"mumacro-{name}"
    for path, more in (
        ("mu-macro", {}),
        ("law", {"v0": None, "start": 0.1, "stop": 1.0}),
        ("solve-for", {"v0": None, "unknown": "v0", "target": 0.1}),
    ):
        answer = client.post(f"/v1/{path}", json={**case, **more, "tolerance": tolerance}).json()
        assert answer["table"] == picked["table"]
    assert [label["tolerance"] for label in picked["loaded"]] == [1e-12, 1e-10, 1e-7, 1e-4]


def test_the_file_is_the_table(client: Any, surrogate: Surrogate) -> None:
    response = client.get("/v1/table.nc")
    assert response.content == surrogate.path.read_bytes()
    assert response.headers["content-type"] == "application/x-netcdf"
    assert response.headers["etag"] == f'"{surrogate.checksum}"'
    assert surrogate.path.name in response.headers["content-disposition"]
    part = client.get("/v1/table.nc", headers={"Range": "bytes=4-9"})
    assert (part.status_code, part.content) == (206, response.content[4:10])
    assert client.head("/v1/table.nc").headers["content-length"] == str(len(response.content))


@pytest.mark.parametrize("path", HEALTH)
def test_ready_means_loaded(client: Any, surrogate: Surrogate, path: str) -> None:
    response = client.get(path)
    assert (response.status_code, response.json()["status"], client.head(path).status_code) == (
        200,
        "ready",
        200,
    )
    assert {"id": surrogate.id, "tolerance": surrogate.tolerance} in response.json()["tables"]
    assert response.headers["cache-control"] == "no-store"


SPOILT: dict[str, Callable[[bytes], bytes]] = {
    "missing": lambda _: b"",
    "empty": lambda _: b"",
    "truncated": lambda whole: whole[: len(whole) // 2],
    "foreign": lambda _: b"not a table " * 1000,
    "with one wrong bit": lambda whole: (
        whole[:50_000] + bytes([whole[50_000] ^ 1]) + whole[50_001:]
    ),
}


@pytest.mark.parametrize("kind", SPOILT)
def test_an_unusable_table_is_not_ready(
    started: Any, table_copy: Any, case: Case, problem: Any, kind: Any
) -> None:
    table_copy.write_bytes(SPOILT[kind](table_copy.read_bytes()))
    if kind == "missing":
        table_copy.unlink()
    with started(tables=(table_copy,)) as client:
        alive = client.get("/livez")
        assert (alive.status_code, alive.json()["status"]) == (200, "alive")
        for path in (*HEALTH, "/v1/table", "/v1/table.nc"):
            response = client.get(path)
            assert table_copy.name in problem(response, 503)["detail"]
            assert response.headers["retry-after"] == "5"
        problem(client.get("/v1/mu-macro", params=case), 503)
        problem(client.post("/v1/mu-macro", json=case), 503)
        problem(client.post("/v1/mu-macro/batch", json=[case]), 503)


def test_a_file_that_goes_or_changes_after_loading_is_noticed(
    started: Any, table_copy: Any, case: Case, problem: Any
) -> None:
    with started(tables=(table_copy,)) as client:
        assert client.get("/readyz").status_code == 200
        table_copy.write_bytes(table_copy.read_bytes() + b"\0")
        assert "changed" in problem(client.get("/readyz"), 503)["detail"]
        problem(client.get("/v1/table.nc"), 503)
        table_copy.unlink()
        assert "gone" in problem(client.get("/readyz"), 503)["detail"]
        assert client.get("/v1/mu-macro", params=case).status_code == 200


def test_a_wrong_known_answer_is_not_ready(
    started: Any, surrogate: Surrogate, problem: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    wrong = TableError(Path("x.nc"), "the known answer is wrong")
    for error, words in ((wrong, "known answer"), (RuntimeError("secret"), "the log has")):
        monkeypatch.setattr("mumacro.Surrogate.self_check", Mock(side_effect=error))
        client = started(tables=(surrogate.path,))
        assert "not loaded yet" in problem(client.get("/readyz"), 503)["detail"]  # before the start
        with client:
            detail = problem(client.get("/readyz"), 503)["detail"]
        assert words in detail
        assert "secret" not in detail


def test_tables_are_found(
    started: Any, tmp_path: Path, table_copy: Any, surrogate: Surrogate, problem: Any
) -> None:
    for name in (".hidden.nc", "notes.txt"):
        (tmp_path / name).write_bytes(b"")
    other = tmp_path / "other"
    for path, word in ((tmp_path / "nowhere", "nowhere"), (other, "other")):
        with started(tables=(path,)) as client:  # missing; empty
            assert word in problem(client.get("/readyz"), 503)["detail"]
        other.mkdir(exist_ok=True)
    second = Path(shutil.copy(surrogate.path, other / "second.nc"))
    with started(tables=(tmp_path, other)) as client:
        names = [label["id"] for label in client.get("/v1/table").json()["loaded"]]
        assert names == sorted([table_copy.stem, "second"])
    second.rename(other / table_copy.name)
    with started(tables=(table_copy, other)) as client:
        assert "same name" in problem(client.get("/readyz"), 503)["detail"]
    (tmp_path / "zzz.nc").write_bytes(b"")
    with started(tables=(tmp_path,)) as client:  # one bad table among good ones
        assert "zzz.nc" in problem(client.get("/readyz"), 503)["detail"]

"""Tables behind the service: metadata, the file, choice by tolerance, health with and without them."""

import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest
from starlette.testclient import TestClient

from mumacro import TableError
from service.app import create_app
from service.problems import Kind, RequestError
from service.settings import Settings
from service.tables import LoadedTable, Tables, table_files

HEALTH = ("/readyz", "/healthz")


@pytest.fixture
def table_copy(surrogate, tmp_path):
    """A copy of a table that a test may damage."""
    return Path(shutil.copy(surrogate.path, tmp_path / surrogate.path.name))


def started(*paths):
    return TestClient(create_app(Settings(tables=paths)))


def test_the_table_describes_itself(client, surrogate):
    answer = client.get("/v1/table").json()
    assert answer["id"] == surrogate.id
    assert answer["table"] == {"id": surrogate.id, "tolerance": surrogate.tolerance}
    assert answer["checksum"] == surrogate.checksum
    assert answer["file"] == surrogate.path.name
    assert answer["size_bytes"] == surrogate.path.stat().st_size
    assert answer["attributes"]
    assert answer["blocks"]
    assert answer["table"] in answer["loaded"]
    chosen = client.get("/v1/table", params={"tolerance": surrogate.tolerance}).json()
    assert chosen["tolerance"] == surrogate.tolerance


def test_the_file_is_the_table(client, surrogate):
    response = client.get("/v1/table.nc")
    assert response.content == surrogate.path.read_bytes()
    assert response.headers["content-type"] == "application/x-netcdf"
    assert surrogate.path.name in response.headers["content-disposition"]
    part = client.get("/v1/table.nc", headers={"Range": "bytes=4-9"})
    assert (part.status_code, part.content) == (206, response.content[4:10])
    again = client.get("/v1/table.nc", headers={"If-None-Match": response.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    head = client.head("/v1/table.nc")
    assert head.headers["content-length"] == str(len(response.content))


@pytest.mark.parametrize("path", ["/v1/table", "/v1/table.nc"])
@pytest.mark.parametrize(
    ("query", "parameter"),
    [("id=../x", "id"), ("tolerance=1e-30", "tolerance"), ("tolerance=x", "tolerance"), ("name=x", "name"),
     ("tolerance=1&tolerance=1", "tolerance")],
)  # fmt: skip
def test_a_table_that_is_not_there_is_refused(client, problem, path, query, parameter):
    (fault,) = problem(client.get(f"{path}?{query}"), 422)["errors"]
    assert fault["parameter"] == parameter


@pytest.mark.parametrize("path", HEALTH)
def test_ready_means_loaded(client, surrogate, path):
    response = client.get(path)
    assert response.status_code == 200
    assert response.json()["status"] == "ready"
    assert {"id": surrogate.id, "tolerance": surrogate.tolerance} in response.json()["tables"]
    assert response.headers["cache-control"] == "no-store"
    assert client.head(path).status_code == 200


def test_alive_means_answering(client):
    assert client.get("/livez").json()["status"] == "alive"


def unusable(kind, path):
    if kind == "missing":
        path.unlink()
    elif kind == "truncated":
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    elif kind == "empty":
        path.write_bytes(b"")
    else:
        path.write_bytes(b"not a table " * 1000)


@pytest.mark.parametrize("kind", ["missing", "truncated", "empty", "foreign"])
def test_an_unusable_table_leaves_the_process_alive_and_not_ready(table_copy, case, problem, kind):
    unusable(kind, table_copy)
    with started(table_copy) as client:
        assert client.get("/livez").status_code == 200
        for path in (*HEALTH, "/v1/table", "/v1/table.nc"):
            response = client.get(path)
            assert table_copy.name in problem(response, 503)["detail"]
            assert int(response.headers["retry-after"]) > 0
        problem(client.get("/v1/mu-macro", params=case), 503)
        problem(client.post("/v1/mu-macro", json=case), 503)
        problem(client.post("/v1/mu-macro/batch", json=[case]), 503)


def test_one_flipped_bit_is_noticed(table_copy, problem):
    content = bytearray(table_copy.read_bytes())
    content[len(content) * 2 // 3] ^= 1
    table_copy.write_bytes(content)
    with started(table_copy) as client:
        assert client.get("/livez").status_code == 200
        # The bit may lie in unused space of the file, where it changes no data: then the table is still valid.
        response = client.get("/readyz")
        if response.status_code != 200:
            assert table_copy.name in problem(response, 503)["detail"]


def test_an_empty_directory_and_a_missing_one_are_named(tmp_path, problem):
    for path in (tmp_path, tmp_path / "nowhere"):
        with started(path) as client:
            assert path.name in problem(client.get("/readyz"), 503)["detail"]


def test_one_bad_table_among_good_ones_is_not_ignored(table_copy, problem):
    (table_copy.parent / "zzz.nc").write_bytes(b"")
    with started(table_copy.parent) as client:
        assert "zzz.nc" in problem(client.get("/readyz"), 503)["detail"]


def test_a_file_that_goes_or_changes_after_loading_is_noticed(table_copy, case, problem):
    with started(table_copy) as client:
        assert client.get("/readyz").status_code == 200
        table_copy.write_bytes(table_copy.read_bytes() + b"\0")
        assert "changed" in problem(client.get("/readyz"), 503)["detail"]
        problem(client.get("/v1/table.nc"), 503)
        table_copy.unlink()
        assert "gone" in problem(client.get("/readyz"), 503)["detail"]
        assert client.get("/v1/mu-macro", params=case).status_code == 200


def test_before_the_start_nothing_is_ready(tables_dir, case, problem):
    client = TestClient(create_app(Settings(tables=(tables_dir,))))
    problem(client.get("/readyz"), 503)
    problem(client.post("/v1/mu-macro", json=case), 503)


def test_a_wrong_known_answer_is_not_ready(surrogate, problem, monkeypatch):
    def wrong(self):
        raise TableError(self.path, "the known answer is wrong")

    monkeypatch.setattr(type(surrogate), "self_check", wrong)
    with started(surrogate.path) as client:
        assert "known answer" in problem(client.get("/readyz"), 503)["detail"]


def test_an_unexpected_error_while_loading_is_not_shown(surrogate, problem, monkeypatch):
    def broken(_self):
        raise RuntimeError("secret")

    monkeypatch.setattr("mumacro.Surrogate.self_check", broken)
    with started(surrogate.path) as client:
        assert "secret" not in problem(client.get("/readyz"), 503)["detail"]


def test_tables_are_found_by_file_and_by_directory(tmp_path, table_copy, surrogate):
    (tmp_path / ".hidden.nc").write_bytes(b"")
    (tmp_path / "notes.txt").write_bytes(b"")
    assert table_files([tmp_path]) == [table_copy]
    other = tmp_path / "other"
    other.mkdir()
    shutil.copy(surrogate.path, other / "second.nc")
    with started(table_copy, other) as client:
        names = [label["id"] for label in client.get("/v1/table").json()["loaded"]]
        assert sorted(names) == sorted([table_copy.stem, "second"])


def test_two_tables_of_one_name_are_refused(tmp_path, table_copy, surrogate, problem):
    other = tmp_path / "other"
    other.mkdir()
    shutil.copy(surrogate.path, other / table_copy.name)
    with started(table_copy, other) as client:
        assert "same name" in problem(client.get("/readyz"), 503)["detail"]


@pytest.fixture
def tables():
    """Three tables: a tighter one is larger, except one that is tight and small."""

    def table(name, tolerance, size):
        return LoadedTable(SimpleNamespace(id=name, tolerance=tolerance), (size, 0, 0))

    filled = Tables(())
    filled.loaded = (table("c", 1e-12, 9000), table("b", 1e-10, 100), table("a", 1e-8, 500))
    filled.fault, filled.ready = None, True
    return filled


@pytest.mark.parametrize(("tolerance", "name"), [(None, "c"), (1e-12, "c"), (9e-11, "c"), (1e-10, "b"), (1, "b")])
def test_the_smallest_table_that_is_tight_enough_is_picked(tables, tolerance, name):
    assert tables.pick(tolerance).surrogate.id == name


def test_no_table_is_tight_enough(tables):
    with pytest.raises(RequestError) as caught:
        tables.pick(1e-13)
    assert caught.value.kind is Kind.INVALID_VALUE
    assert caught.value.members == {"tightest_available": 1e-12}


def test_an_unloaded_tables_picks_nothing():
    with pytest.raises(RequestError) as caught:
        Tables(()).pick()
    assert caught.value.kind is Kind.NOT_READY

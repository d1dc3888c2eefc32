"""Threads, processes and pickles: the same bits everywhere, no blocking, no state that a fork
loses."""

import multiprocessing
import operator
import os
import pickle
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mumacro import InputError, Surrogate, TableError
from mumacro.kernel.threads import processors
from mumacro.table.netcdf import read_table
from tests.support.cases import CASE, UNIT, Array
from tests.support.comparing import close
from tests.support.places import TABLES

pytestmark = pytest.mark.slow

FILES = sorted(TABLES.glob("*.nc"))
N = 200_000


@pytest.fixture(scope="module")
def table() -> Surrogate:
    return Surrogate.open(1e-7, threads=4)


def points(n: int, seed: int = 1) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    return 10.0 ** rng.uniform(-3.0, 3.0, n), 10.0 ** rng.uniform(-3.0, 3.0, n)


def everything(table: Surrogate, n: int = N, seed: int = 1) -> bytes:
    """The bits of all quantities of a table at some points."""
    v, y = points(n, seed)
    answer = table.evaluate(**UNIT, y0=y, v0=v, gradient=True)
    parts = [
        table.mu_ratio(v, y),
        *table.quantity("power", v, y)[:2],
        *table.quantity("stick_fraction", v, y)[:2],
    ]
    parts += [
        *table.slopes(v, y, "power", bounds=True),
        answer.mu_macro,
        answer.error_bound,
        answer.source_code,
    ]
    parts += [*(answer.gradient or {}).values(), *(answer.gradient_bound or {}).values()]
    return b"".join(np.ascontiguousarray(part).tobytes() for part in parts)


# --- threads --------------------------------------------------------------------------------------


@pytest.mark.parametrize("threads", [1, 2, 3, 7])
def test_the_number_of_threads_changes_nothing_but_the_time(table: Surrogate, threads: int) -> None:
    other = Surrogate.open(table.path, threads=threads)
    assert other.threads == threads
    assert everything(other) == everything(table)


def test_one_thread_means_that_none_is_started(
    table: Surrogate, monkeypatch: pytest.MonkeyPatch
) -> None:
    alone = Surrogate.open(table.path, threads=1)

    def refuse(*_: Any, **__: Any) -> None:
        raise AssertionError("a thread was started")

    expected = everything(table)
    monkeypatch.setattr(threading.Thread, "start", refuse)
    assert everything(alone) == expected
    assert everything(table.on_threads(1)) == expected
    with pytest.raises(AssertionError, match="a thread was started"):
        table.mu_ratio(*points(N))


def test_no_thread_outlives_its_call(table: Surrogate) -> None:
    before = set(threading.enumerate())
    everything(table)
    assert set(threading.enumerate()) == before


def workers() -> Iterator[Any]:
    """Ways to hand a call to a worker, by name: each calls a function with an argument and returns
    its result."""

    def executor(pool: Any) -> Callable[..., Any]:
        def call(function: Any, argument: Any) -> Any:
            with pool() as started:
                return started.submit(function, argument).result(timeout=60)

        return call

    def joblib(function: Any, argument: Any) -> Any:
        parallel = pytest.importorskip("joblib")
        return parallel.Parallel(2, backend="loky")([parallel.delayed(function)(argument)] * 2)[0]

    yield pytest.param(executor(lambda: ThreadPoolExecutor(1)), id="threads")
    for method in ("fork", "spawn") if hasattr(os, "fork") else ("spawn",):
        context = multiprocessing.get_context(method)
        yield pytest.param(
            executor(lambda c=context: ProcessPoolExecutor(1, mp_context=c)), id=method
        )
    yield pytest.param(joblib, id="joblib")


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("call", workers())
def test_workers_start_no_threads_by_default(call: Callable[..., Any]) -> None:
    unasked = Surrogate.open(1e-4)
    assert unasked.threads == processors()
    assert call(operator.attrgetter("threads"), unasked) == 1


def test_eight_threads_may_evaluate_at_once(table: Surrogate) -> None:
    expected = everything(table, 70_000)
    fresh = Surrogate.open(table.path, threads=2)  # power and stick fraction are not prepared yet
    with ThreadPoolExecutor(8) as pool:
        for result in pool.map(lambda _: everything(fresh, 70_000), range(8)):
            assert result == expected


def test_tables_are_read_by_many_threads_at_once() -> None:
    expected = {path: read_table(path).attributes["content_sha256"] for path in FILES}
    start = threading.Barrier(8)

    def work(i: int) -> dict[Path, str]:
        start.wait()
        return {
            path: str(read_table(path).attributes["content_sha256"])
            for path in FILES[i % 4 :] + FILES[: i % 4]
        }

    with ThreadPoolExecutor(8) as pool:
        assert all(result == expected for result in pool.map(work, range(8)))


def test_a_small_call_does_not_wait_for_a_large_one(table: Surrogate) -> None:
    v, y = (np.tile(x, 10) for x in points(2_000_000))
    begun, ended = threading.Event(), threading.Event()

    def large() -> None:
        begun.set()
        table.mu_ratio(v, y)
        ended.set()

    small_v, small_y = points(100)
    expected = table.mu_ratio(small_v, small_y)
    table.evaluate(**CASE)  # kernels are loaded
    worker = threading.Thread(target=large)
    worker.start()
    begun.wait()
    answered = 0
    while not ended.is_set() and answered < 50:
        assert np.array_equal(table.mu_ratio(small_v, small_y), expected)
        assert table.evaluate(**CASE).mu_macro > 0.0
        answered += not ended.is_set()
    worker.join()
    assert answered >= 10


# --- processes ------------------------------------------------------------------------------------


_here: Surrogate | None = None  # for a forked child


def _ask(seed: int) -> bytes:
    assert _here is not None
    return everything(_here, N, seed)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
@pytest.mark.filterwarnings("ignore:.*fork.*")
def test_forked_workers_give_the_same_bits_and_so_does_the_parent_afterwards(
    table: Surrogate,
) -> None:
    global _here
    _here, context = table, multiprocessing.get_context("fork")
    expected = [everything(table, N, seed) for seed in range(4)]  # large calls before the fork
    with ProcessPoolExecutor(2, mp_context=context) as executor:
        assert list(executor.map(_ask, range(4), timeout=120)) == expected
    assert everything(table) == expected[1]


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_errors_come_out_of_a_pickle_as_they_went_in(protocol: int) -> None:
    for error in (InputError("Fz", -1.0, "finite and > 0", 7), TableError("a.nc", "no such file")):
        again = pickle.loads(pickle.dumps(error, protocol))  # noqa: S301 (our own bytes)
        assert type(again) is type(error)
        assert (str(again), vars(again)) == (str(error), vars(error))


# --- pickles --------------------------------------------------------------------------------------


def in_another_process(data: bytes, folder: Path, repository: Path) -> str:
    program = (
        "import pickle, sys; s = pickle.load(sys.stdin.buffer);"
        "print(s.threads, s.checksum, float(s.mu_ratio(0.1, 0.5)).hex())"
    )
    environment = {**os.environ, "PYTHONPATH": str(repository)}
    done = subprocess.run(
        [sys.executable, "-c", program],
        input=data,
        cwd=folder,
        env=environment,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout.decode().strip()


def summary(table: Surrogate) -> str:
    return f"{table.threads} {table.checksum} {table.mu_ratio(0.1, 0.5).hex()}"


def test_a_bundled_table_is_pickled_by_name_and_checksum(tmp_path: Path, repository: Path) -> None:
    opened = Surrogate.open(1e-10, threads=3)
    data = pickle.dumps(opened)
    assert len(data) < 500
    assert str(opened.path.parent).encode() not in data  # its path may differ in the other process
    assert opened.checksum.encode() in data
    assert in_another_process(data, tmp_path, repository) == summary(opened)


def test_another_table_carries_its_bytes(
    tmp_path: Path, repository: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine").mkdir()
    shutil.copy(FILES[-2], tmp_path / "mine" / "own.nc")
    monkeypatch.chdir(tmp_path / "mine")
    opened = Surrogate.open("own.nc", threads=2)
    data = pickle.dumps(opened)
    assert len(data) > FILES[-2].stat().st_size
    monkeypatch.chdir(tmp_path)
    shutil.rmtree(tmp_path / "mine")
    assert in_another_process(data, tmp_path, repository) == summary(opened)
    again = pickle.loads(data)  # noqa: S301 (our own bytes)
    assert everything(again, 1000) == everything(opened, 1000)
    assert len(pickle.dumps(again)) == close(len(data), rel=0.01)


def test_a_table_replaced_after_it_was_opened_is_pickled_as_it_was_opened(tmp_path: Path) -> None:
    path = tmp_path / "mine.nc"
    shutil.copy(FILES[0], path)
    opened = Surrogate.open(path)
    shutil.copy(FILES[1], path)
    again = pickle.loads(pickle.dumps(opened))  # noqa: S301 (our own bytes)
    assert again.checksum == opened.checksum


def test_a_bundled_table_of_another_release_is_told() -> None:
    opened = Surrogate.open(1e-4)
    data = pickle.dumps(opened).replace(opened.checksum.encode(), b"0" * 64)
    with pytest.raises(TableError, match="install the same release on both sides"):
        pickle.loads(data)  # noqa: S301 (our own bytes)


def test_a_worker_that_gets_a_table_twice_prepares_it_once() -> None:
    data = pickle.dumps(Surrogate.open(1e-4, threads=5))
    assert pickle.loads(data) is pickle.loads(data)  # noqa: S301 (our own bytes)

"""Count requests and cases with prometheus_client.  Several workers share its counters through its
multiprocess mode, in a private folder that is made at the start."""

import logging
import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from prometheus_client import (
    CollectorRegistry,
    Counter,
    Gauge,
    Histogram,
    PlatformCollector,
    ProcessCollector,
    disable_created_metrics,
    generate_latest,
    values,
)
from prometheus_client.multiprocess import MultiProcessCollector

from mumacro.table.atlas import REGIME_OF_SOURCE, REGIMES, SOURCES

from .tables import LoadedTable, Tables

_SHARED = "PROMETHEUS_MULTIPROC_DIR"  # prometheus_client reads it when it is imported
# the files of prometheus_client for one worker, and their size with the labels below
_FILES = ("counter", "histogram", "gauge_mostrecent", "gauge_livesum")
_FILE_BYTES = 2**19
_METHODS = frozenset({"GET", "HEAD", "POST"})
_log = logging.getLogger("mumacro.metrics")
_BUCKETS_S = (
    1e-4, 2.5e-4, 5e-4, 1e-3, 2.5e-3, 5e-3, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0,
)  # fmt: skip


@contextmanager
def shared_counters(workers: int) -> Iterator[None]:
    """Yield a private, empty folder for the counters of all workers, in memory if possible; remove
    it at the end.

    If there is no room for a folder, every worker reports its own counters.
    """
    memory = "/dev/shm"  # noqa: S108  (a folder of its own is made there)
    with ExitStack() as stack:
        for place in (memory, None):
            with suppress(OSError):
                folder = tempfile.TemporaryDirectory(
                    prefix="mumacro-metrics-", dir=place, ignore_cleanup_errors=True
                )
                name = stack.enter_context(folder)
                probe = Path(name, "room")
                probe.write_bytes(bytes(workers * len(_FILES) * _FILE_BYTES))
                probe.unlink()
                os.environ[_SHARED] = name
                break
        yield


def _reserve() -> None:
    """Reserve the room of this worker's files before prometheus_client maps them into memory,
    because writing to a mapped page for which there is no room ends the process (SIGBUS).

    If there is no room, this worker counts for itself.
    """
    if _SHARED not in os.environ:
        return
    files = [Path(os.environ[_SHARED], f"{kind}_{os.getpid()}.db") for kind in _FILES]
    try:
        for file in files:
            # a file of an earlier process with the same number: continue its counts
            if not file.exists():
                file.write_bytes(bytes(_FILE_BYTES))
    except OSError as error:
        for file in files:
            file.unlink(missing_ok=True)
        del os.environ[_SHARED]
        values.ValueClass = values.MutexValue
        _log.warning("no room for shared counters, this worker has its own: %s", error)


def forget_the_dead() -> None:
    """Remove the values of workers that were killed."""
    for file in Path(os.environ[_SHARED]).glob("gauge_livesum_*.db"):
        number = file.stem.rpartition("_")[2]
        if not Path("/proc", number).exists() and Path("/proc/self").exists():
            file.unlink(missing_ok=True)


#: present values, as gauges: names and meanings
NOW = {
    "connections": "Open connections",
    "slots_in_use": "Computations that have a slot",
    "slots": "Slots of computations",
    "waiting": "Requests that wait for a slot",
    "held_bytes": "Bytes of bodies that are held",
    "overloaded": "Requests that were refused since the start because too much was at hand",
    "log_lines_lost": "Lines of the log that could not be written since the start",
}


class Metrics:
    """Count requests and cases."""

    def __init__(self, paths: Iterable[str]) -> None:
        _reserve()
        disable_created_metrics()  # type: ignore[no-untyped-call]
        self._paths = frozenset(paths)
        self.registry = registry = CollectorRegistry()
        requests = Counter(
            "mumacro_requests",
            "Finished requests",
            ["route", "method", "status"],
            registry=registry,
        )
        meaning = "From the head of a request to the end of its answer"
        seconds = Histogram(
            "mumacro_request_duration_seconds",
            meaning,
            ["route"],
            buckets=_BUCKETS_S,
            registry=registry,
        )
        cases = Counter(
            "mumacro_cases", "Answered cases", ["table", "source", "regime"], registry=registry
        )
        bad = Counter(
            "mumacro_bad_cases", "Cases of batches that were refused", ["table"], registry=registry
        )
        # present values, by name: set each time the loop measures, and before they are shown
        self._now = {
            name: Gauge(f"mumacro_{name}", meaning, registry=registry, multiprocess_mode="livesum")
            for name, meaning in NOW.items()
        }
        PlatformCollector(registry=registry)
        ProcessCollector(registry=registry)
        labels = ["id", "tolerance"]
        self._info = Gauge(
            "mumacro_table_info",
            "Loaded tables",
            labels,
            registry=registry,
            multiprocess_mode="mostrecent",
        )
        # looking up labels takes longer than counting
        self._of_request = cache(
            lambda *labels: (requests.labels(*labels).inc, seconds.labels(labels[0]).observe)
        )
        self._of_source = cache(
            lambda table, code: (
                bad.labels(table)
                if code < 0
                else cases.labels(table, SOURCES[code], REGIMES[REGIME_OF_SOURCE[code]])
            )
        )

    def start(self, tables: Tables) -> None:
        """Set the names of the loaded tables."""
        for table in tables.loaded:
            self._info.labels(table.id, format(table.surrogate.tolerance, "g")).set(1)
            self._of_source(table.id, -1)

    def request(self, path: str, method: str, status: int, seconds: float) -> None:
        """Count one request."""
        path, method = (
            path if path in self._paths else "other",
            method if method in _METHODS else "other",
        )
        count, observe = self._of_request(path, method, status)
        count()
        observe(seconds)

    def case(self, table: LoadedTable, source: int) -> None:
        """Count one answered case by its source code."""
        self._of_source(table.id, source).inc()

    def cases(self, table: LoadedTable, source: Any) -> None:
        """Count the cases of a batch by their source codes, including bad ones."""
        for code, number in enumerate(np.bincount(source + 1).tolist()):
            if number:
                self._of_source(table.id, code - 1).inc(number)

    def now(self, **values: float) -> None:
        """Set present values, by the names of :data:`NOW`."""
        for name, value in values.items():
            self._now[name].set(value)

    def text(self) -> bytes:
        """Return the counters in the text format of Prometheus; with several workers, the sum over
        all."""
        registry = self.registry
        if _SHARED in os.environ:
            registry = CollectorRegistry()
            forget_the_dead()
            MultiProcessCollector(registry)  # type: ignore[no-untyped-call]
        return generate_latest(registry)

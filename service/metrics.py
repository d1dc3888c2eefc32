"""Counters of one worker process, and their sum over all workers for ``/metrics``.

The counters are a list of numbers.  Several workers write copies of their lists to a folder that the parent process
made.  The worker that answers ``/metrics`` adds them.  The copy of a worker that has ended stays, so that no counter
decreases.
"""

import asyncio
import os
from array import array
from bisect import bisect_left
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .kernel import REGIME_NAMES, SOURCES
from .shared import FOLDER_VARIABLE

__all__ = ["CONTENT_TYPE", "Metrics", "first_cell"]

CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"

ROUTES = (
    "/v1/mu-macro", "/v1/mu-macro.txt",
    "/v1/mu-macro/batch", "/v1/mu-macro/batch/columns", "/v1/mu-macro/batch/rows",
    "/v1/mu-macro/batch/lines", "/v1/mu-macro/batch/csv", "/v1/mu-macro/batch/arrow",
    "/v1/solve-for", "/v1/law", "/v1/law.csv", "/v1/table", "/v1/table.nc",
    "/Info", "/ModelInfo", "/InputSizes", "/OutputSizes", "/Evaluate", "/Gradient", "/ApplyJacobian", "/ApplyHessian",
    "/livez", "/readyz", "/healthz", "/metrics", "/", "/docs", "/openapi.json", "other",
)  # fmt: skip
METHODS = ("GET", "HEAD", "POST", "other")
STATUSES = (200, 206, 304, 400, 401, 404, 405, 408, 413, 415, 416, 422, 499, 500, 503, 0)
BUCKETS_S = (1e-4, 2.5e-4, 5e-4, 1e-3, 2.5e-3, 5e-3, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0)

_ROUTE = {name: index for index, name in enumerate(ROUTES)}
_METHOD = {name: index for index, name in enumerate(METHODS)}
_STATUS = {code: index for index, code in enumerate(STATUSES)}
_REQUESTS = 0
_DURATIONS = _REQUESTS + len(ROUTES) * len(METHODS) * len(STATUSES)
_WIDTH = len(BUCKETS_S) + 2  # of one histogram: buckets, the rest, the sum
_CASES = _DURATIONS + len(ROUTES) * _WIDTH
_PER_TABLE = len(SOURCES) + 1  # by source; bad cases
_SHARE_EVERY_S = 0.25

#: (route, method, status) -> index of the counter of requests, and of the histogram of durations
_PLACES = {
    (route, method, status): (_REQUESTS + (r * len(METHODS) + m) * len(STATUSES) + s, _DURATIONS + r * _WIDTH)
    for route, r in _ROUTE.items()
    for method, m in _METHOD.items()
    for status, s in _STATUS.items()
}


def first_cell(table: int) -> int:
    """Index of the counter of a table's first source; the other sources follow, bad cases are last."""
    return _CASES + table * _PER_TABLE


class Metrics:
    """Counters of one worker process."""

    def __init__(self) -> None:
        self.cells: list[float] = [0.0] * _CASES
        self._file: Path | None = None
        self._saved: list[float] = []
        self._tables: list[dict[str, Any]] = []

    def start(self, tables: list[dict[str, Any]]) -> None:
        """Add counters for each table; find the shared folder.  Every worker has the same tables."""
        self._tables = tables
        self.cells.extend([0.0] * (_CASES + len(tables) * _PER_TABLE - len(self.cells)))
        folder = os.environ.get(FOLDER_VARIABLE)
        if folder is not None:
            self._file = Path(folder) / f"{os.getpid()}-{os.urandom(4).hex()}"

    def count(self, route: str, method: str, status: int, seconds: float) -> None:
        """Count one request."""
        cells = self.cells
        place = _PLACES.get((route, method, status))
        if place is None:
            known = route if route in _ROUTE else ROUTES[-1], method if method in _METHOD else METHODS[-1]
            place = _PLACES[*known, status if status in _STATUS else STATUSES[-1]]
        request, durations = place
        cells[request] += 1.0
        cells[durations + bisect_left(BUCKETS_S, seconds)] += 1.0
        cells[durations + _WIDTH - 1] += seconds

    def count_cases(self, first: int, source: NDArray[np.int8], bad: int) -> None:
        """Count the cases of a batch by their source codes; ``first`` is the first_cell of the table."""
        for index, number in enumerate(np.bincount(source + 1, minlength=_PER_TABLE).tolist()[1:]):
            self.cells[first + index] += number
        self.cells[first + _PER_TABLE - 1] += bad

    async def share(self) -> None:
        """Write a copy to the shared folder, if there is one, every quarter of a second."""
        while True:
            self.save()
            await asyncio.sleep(_SHARE_EVERY_S)

    def save(self) -> None:
        """Write a copy to the shared folder.  The file is replaced in one step, so no reader sees half a copy."""
        if self._file is None or self.cells == self._saved:
            return
        self._saved = self.cells.copy()
        draft = self._file.with_suffix(".draft")
        try:
            draft.write_bytes(array("d", self._saved).tobytes())
            draft.replace(self._file)
        except OSError:
            self._saved = []  # the folder is gone or full; the next call tries again

    def total(self) -> list[float]:
        """Sum over all workers; the copies of the others are at most a quarter of a second old."""
        cells = self.cells.copy()
        if self._file is None:
            return cells
        try:
            others = [path for path in self._file.parent.iterdir() if path != self._file and not path.suffix]
        except OSError:
            return cells
        for path in others:
            values = array("d")
            try:
                values.frombytes(path.read_bytes())
            except (OSError, ValueError):
                continue
            if len(values) == len(cells):
                cells = [mine + theirs for mine, theirs in zip(cells, values, strict=True)]
        return cells

    def collect(self) -> Iterator[Any]:
        """Yield the families of metrics, in the form that a registry of prometheus_client needs."""
        from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily

        cells = self.total()
        requests = CounterMetricFamily("mumacro_requests", "Finished requests", labels=("route", "method", "status"))
        durations = HistogramMetricFamily(
            "mumacro_request_duration_seconds", "From the head of a request to the end of its answer", labels=("route",)
        )
        for r, route in enumerate(ROUTES):
            for m, method in enumerate(METHODS):
                for s, status in enumerate(STATUSES):
                    number = cells[_REQUESTS + (r * len(METHODS) + m) * len(STATUSES) + s]
                    if number:
                        requests.add_metric((route, method, str(status) if status else "other"), number)
            first = _DURATIONS + r * _WIDTH
            buckets, running = [], 0.0
            for index, bound in enumerate((*map(str, BUCKETS_S), "+Inf")):
                running += cells[first + index]
                buckets.append((bound, running))
            if running:
                durations.add_metric((route,), buckets, cells[first + _WIDTH - 1])
        yield requests
        yield durations
        cases = CounterMetricFamily("mumacro_cases", "Answered cases", labels=("table", "source", "regime"))
        bad = CounterMetricFamily("mumacro_bad_cases", "Cases of batches that were refused", labels=("table",))
        info = GaugeMetricFamily("mumacro_table_info", "Loaded tables", labels=("id", "tolerance"))
        for index, table in enumerate(self._tables):
            first = first_cell(index)
            for code, source in enumerate(SOURCES):
                if cells[first + code]:
                    cases.add_metric((table["id"], source, REGIME_NAMES[code]), cells[first + code])
            bad.add_metric((table["id"],), cells[first + _PER_TABLE - 1])
            info.add_metric((table["id"], format(table["tolerance"], "g")), 1)
        yield cases
        yield bad
        yield info

    def text(self) -> bytes:
        """The exposition format of Prometheus."""
        from prometheus_client import CollectorRegistry, generate_latest

        registry = CollectorRegistry(auto_describe=False)
        registry.register(self)
        return generate_latest(registry)

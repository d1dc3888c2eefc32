"""Cut arrays into slices and evaluate them, one after another or on several threads; let another
thread end a computation.

The kernel releases the interpreter's lock, so several threads can work at once.  They end with the
call, so that a process can be forked and no call waits for another.  A computation checks a flag
between its pieces of work, and the kernel checks it at every step of a motion.

>>> stop = Stop()
>>> with stop.of_this_thread():
...     look()
...     stop.set()
...     look()
Traceback (most recent call last):
mumacro.kernel.threads.StopError: the computation was ended
"""

import functools
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar

import numpy as np

from mumacro.errors import MumacroError
from mumacro.kernel.arrays import Array, Codes
from mumacro.kernel.binding import CaseRows, Data, Detail, ExtremeRows, SlopeRows, kernels

SLICE = 16_384  # points in a slice, so that its arrays stay in the second-level cache
ONE_THREAD = 65_536  # points that one thread evaluates while a second thread starts
# approximate time of a ball that is shaken along, divided by that of a spring that is shaken across
ALONG_COST = 64
# approximate time of a case with an interval of k, divided by that of a case with one k
INTERVAL = 64
_KERNEL = kernels[-1]


# --- the end of a computation ---------------------------------------------------------------------


class StopError(MumacroError):
    """Report that another thread ended the computation."""


class Stop:
    """Hold a flag; once it is set, every computation that checks it ends."""

    def __init__(self) -> None:
        self.flag = np.zeros(1, np.int32)  # the kernel reads it, too

    def set(self) -> None:
        """Ask the computations that check this flag to end."""
        self.flag[0] = 1

    def look(self) -> None:
        """Raise StopError if the flag is set."""
        if self.flag[0]:
            raise StopError("the computation was ended")

    @contextmanager
    def of_this_thread(self) -> Iterator[None]:
        """Let the computations of this thread check the flag, until the context ends."""
        token = STOP.set(self)
        try:
            yield
        finally:
            STOP.reset(token)


#: the flag that computations of this thread check
STOP = ContextVar("mumacro.stop", default=Stop())  # noqa: B039  (never set)


def look() -> None:
    """Raise StopError if the computation of this thread must end."""
    STOP.get().look()


# --- slices ---------------------------------------------------------------------------------------


def _cost(kind: tuple[int, int]) -> int:
    """Return the approximate time of a point, divided by that of a spring that is shaken across."""
    contact, direction = kind
    return ALONG_COST if direction else 1 + contact


@functools.cache
def processors() -> int:
    """Return how many processors this process may use, including the limit of a container if the
    system reports it."""
    count = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    with suppress(OSError, ValueError):
        with open("/sys/fs/cgroup/cpu.max", encoding="ascii") as limit:
            quota, period = limit.read().split()
        count = min(count, max(1, -(-int(quota) // int(period))))
    return count


def default_threads() -> int:
    """Return the default number of threads of a call.

    In the main thread of a program it is the number of processors.  In any other thread and in a
    child process it is one, because what started them (Dask, joblib, multiprocessing, a pool of
    threads) already divides the work.
    """
    import multiprocessing  # only arrays need it: without the import one case starts sooner

    if (
        threading.current_thread() is not threading.main_thread()
        or multiprocessing.parent_process() is not None
    ):
        return 1
    return processors()


def share_out(n: int, threads: int | None, work: Callable[[slice], None], cost: int = 1) -> None:
    """Call ``work`` with every slice of n points.  A point takes about ``cost`` times as long as a
    point of one spring.  The default of ``threads`` is :func:`default_threads`."""
    length, stop = SLICE // cost, STOP.get()
    stop.look()
    if n <= length:
        work(slice(0, n))
        return

    def work_or_stop(part: slice) -> None:
        stop.look()
        work(part)

    parts = [slice(low, min(low + length, n)) for low in range(0, n, length)]
    workers = 1 if n < ONE_THREAD // cost else threads or default_threads()
    if workers == 1:
        for part in parts:
            work_or_stop(part)
        return
    from concurrent.futures import ThreadPoolExecutor  # without the import one case starts sooner

    with ThreadPoolExecutor(min(workers, len(parts)), thread_name_prefix="mumacro") as pool:
        for _ in pool.map(work_or_stop, parts):
            pass


def values(
    quantity: int,
    data: Data,
    v: Array,
    y: Array,
    threads: int | None,
    kind: tuple[int, int] = (0, 0),
) -> tuple[Array, Array, Codes]:
    """Return a quantity at (n,) points with its bound and source; NaN and -1 where a point is
    illegal."""
    value, bound, source = np.empty(v.size), np.empty(v.size), np.empty(v.size, np.int8)

    def work(part: slice) -> None:
        _KERNEL.values(
            data, quantity, v[part], y[part], value[part], bound[part], source[part], kind
        )

    share_out(v.size, threads, work, _cost(kind))
    return value, bound, source


def values_without_bounds(
    quantity: int, data: Data, v: Array, y: Array, threads: int | None
) -> Array:
    """Return a quantity of one spring at (n,) points; NaN where a point is illegal."""
    value = np.empty(v.size)
    share_out(
        v.size,
        threads,
        lambda part: _KERNEL.values(data, quantity, v[part], y[part], value[part], None, None),
    )
    return value


def slopes(
    quantity: int, data: Data, v: Array, y: Array, threads: int | None, contact: int = 0
) -> SlopeRows:
    """Return any quantity at (n,) points with its derivatives and their bounds."""
    rows = SlopeRows.empty(v.size)
    share_out(
        v.size,
        threads,
        lambda part: _KERNEL.slopes(data, quantity, v[part], y[part], rows, part.start, contact),
    )
    return rows


def cases(
    data: Data,
    columns: Sequence[Array | float],
    shape: tuple[int, ...],
    threads: int | None,
    detail: Detail,
    kind: tuple[int, int] = (0, 0),
) -> CaseRows:
    """Return answers to cases of a shape, see :meth:`mumacro.kernel.binding.Kernel.cases`."""
    answers = CaseRows(shape, detail)
    share_out(
        answers.source.size,
        threads,
        lambda part: _KERNEL.cases(data, columns, answers, part, kind),
        _cost(kind),
    )
    return answers


def intervals(
    data: Data,
    columns: Sequence[Array | float],
    high: Array,
    threads: int | None,
    kind: tuple[int, int] = (0, 0),
) -> ExtremeRows:
    """Return the smallest and largest mu_macro of cases whose k extends from its column to
    ``high``, see :meth:`mumacro.kernel.binding.Kernel.intervals`."""
    rows = ExtremeRows.empty(high.size)

    share_out(
        high.size,
        threads,
        lambda part: _KERNEL.intervals(data, columns, high, rows, part, kind),
        INTERVAL * _cost(kind),
    )
    return rows

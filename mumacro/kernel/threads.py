"""How many processors there are for this process, and how many threads a call may start by
default."""

import functools
import os
import threading
from contextlib import suppress


@functools.cache
def processors() -> int:
    """How many processors this process may use; the limit of a container counts, if the system
    gives it."""
    found = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    with suppress(OSError, ValueError):
        with open("/sys/fs/cgroup/cpu.max", encoding="ascii") as limit:
            quota, period = limit.read().split()
        found = min(found, max(1, -(-int(quota) // int(period))))
    return found


def default_threads() -> int:
    """The default number of threads of a call.

    All processors in the main thread of a program.  One in any other thread and in a child process:
    what started them (Dask, joblib, multiprocessing, a pool of threads) already divides the work.
    """
    import multiprocessing  # only arrays ask: one case starts sooner without

    if (
        threading.current_thread() is not threading.main_thread()
        or multiprocessing.parent_process() is not None
    ):
        return 1
    return processors()

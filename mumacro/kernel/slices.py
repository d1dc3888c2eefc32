"""Arrays: cut into slices, one after another or on several threads.

The kernel releases the interpreter's lock, so several threads can work at once.  They end with the
call, so that a forked process works and no call waits for another.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from mumacro.kernel.arrays import Array, Codes
from mumacro.kernel.binding import Data, kernels

SLICE = 16_384  # points of a slice: its arrays stay in the second cache
FEW = 65_536  # points that one thread evaluates before a second one has started
COST = 64  # of a ball that is shaken along, about, in springs
INTERVAL = 64  # of an interval of k, about, in cases
_KERNEL = kernels[-1]


def _cost(kind: tuple[int, int]) -> int:
    """Of a point of a kind, about, in springs that are shaken across."""
    contact, direction = kind
    return COST if direction else 1 + contact


def share_out(n: int, threads: int, work: Callable[[slice], None], cost: int = 1) -> None:
    """Call ``work`` with every slice of n points, which cost about ``cost`` times as much as those
    of one spring."""
    length = SLICE // cost
    if n <= length:
        work(slice(0, n))
        return
    parts = [slice(low, min(low + length, n)) for low in range(0, n, length)]
    if threads <= 1 or n < FEW // cost:
        for part in parts:
            work(part)
        return
    with ThreadPoolExecutor(min(threads, len(parts)), thread_name_prefix="mumacro") as pool:
        for _ in pool.map(work, parts):
            pass


def _slice(columns: Sequence[Array | float], part: slice) -> list[Array | float]:
    return [column if isinstance(column, float) else column[part] for column in columns]


def values(
    quantity: int, data: Data, v: Array, y: Array, threads: int, kind: tuple[int, int] = (0, 0)
) -> tuple[Array, Array, Codes]:
    """A quantity at (n,) points with its bound and source; NaN and -1 where illegal."""
    value, bound, source = np.empty(v.size), np.empty(v.size), np.empty(v.size, np.int8)

    def work(part: slice) -> None:
        _KERNEL.values(
            data, quantity, v[part], y[part], value[part], bound[part], source[part], kind
        )

    share_out(v.size, threads, work, _cost(kind))
    return value, bound, source


def alone(quantity: int, data: Data, v: Array, y: Array, threads: int) -> Array:
    """A quantity at (n,) points without its bound; NaN where illegal."""
    value = np.empty(v.size)
    share_out(
        v.size,
        threads,
        lambda part: _KERNEL.values(data, quantity, v[part], y[part], value[part], None, None),
    )
    return value


def slopes(quantity: int, data: Data, v: Array, y: Array, threads: int, contact: int = 0) -> Array:
    """Value, both logarithmic slopes and their bounds, rows (5, n), of any quantity."""
    rows = np.empty((5, v.size))
    share_out(
        v.size,
        threads,
        lambda part: _KERNEL.slopes(data, quantity, v[part], y[part], rows, part.start, contact),
    )
    return rows


def cases(
    data: Data,
    columns: Sequence[Array | float],
    n: int,
    threads: int,
    rows: int,
    kind: tuple[int, int] = (0, 0),
) -> tuple[Array, Codes]:
    """Answers to n cases, see :meth:`mumacro.kernel.binding.Kernel.cases`: rows (3, 5 or 17, n),
    and sources (n,)."""
    out, source = np.empty((rows, n)), np.empty(n, np.int8)
    cost = _cost(kind)
    if n <= SLICE // cost:  # most calls; the shorter way
        _KERNEL.cases(data, n, columns, out, source, 0, kind)
        return out, source

    def work(part: slice) -> None:
        six = _slice(columns, part)
        _KERNEL.cases(data, part.stop - part.start, six, out, source[part], part.start, kind)

    share_out(n, threads, work, cost)
    return out, source


def intervals(
    data: Data,
    columns: Sequence[Array | float],
    high: Array,
    threads: int,
    kind: tuple[int, int] = (0, 0),
) -> Array:
    """Extremes of cases whose k reaches from its column to ``high``, see
    :meth:`mumacro.library.Kernel.intervals`: rows (3, n)."""
    out = np.empty((3, high.size))

    def work(part: slice) -> None:
        six = _slice(columns, part)
        _KERNEL.intervals(data, part.stop - part.start, six, high[part], out, part.start, kind)

    share_out(high.size, threads, work, INTERVAL * _cost(kind))
    return out

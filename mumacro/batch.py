"""Arrays: cut into slices, one after another or on several threads.

Kernels release the interpreter's lock, so several threads can work at once.  They end with the call, so that a
forked process works and no call waits for another.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mumacro import charts, dimensional, evaluate

__all__ = ["SLICE", "Data", "cases", "gradients", "quantity", "ratios", "share_out", "slopes"]

Array = NDArray[np.float64]
Codes = NDArray[np.int8]
Data = tuple[Array, Array, Array, Array]

SLICE = 16_384  # points a kernel is given at a time: its arrays stay in the second cache
FEW = 65_536  # points that one thread evaluates before a second one has started
_NONE: Array = np.empty(0)


def share_out(n: int, threads: int, work: Callable[[slice], None]) -> None:
    """Call ``work`` with every slice of n points."""
    parts = [slice(low, min(low + SLICE, n)) for low in range(0, n, SLICE)]
    if threads <= 1 or n < FEW:
        for part in parts:
            work(part)
        return
    with ThreadPoolExecutor(min(threads, len(parts)), thread_name_prefix="mumacro") as pool:
        for _ in pool.map(work, parts):
            pass


def ratios(data: Data, v: Array, y: Array, threads: int, bounds: bool) -> tuple[Array, Array, Codes]:
    """mu~, its bound (empty unless ``bounds``) and the source at (n,) points; NaN and -1 where illegal."""
    n = v.size
    mu, bound, source = np.empty(n), np.empty(n if bounds else 0), np.empty(n, np.int8)

    def work(part: slice) -> None:
        given = v[part], y[part], *data, mu[part], bound[part] if bounds else _NONE, source[part]
        if evaluate.common_ratios(*given):
            evaluate.others(charts.MU, *given)

    share_out(n, threads, work)
    return mu, bound, source


def cases(
    data: Data, columns: Sequence[Array], n: int, threads: int, groups: bool
) -> tuple[Array, Array, Array, Codes, Array, Array]:
    """mu_macro, mu~, the bound of mu_macro, the source, and with ``groups`` v~ and y~, from columns (n,) or (1,)."""
    macro, mu, bound, source = np.empty(n), np.empty(n), np.empty(n), np.empty(n, np.int8)
    v_all, y_all = (np.empty(n), np.empty(n)) if groups else (_NONE, _NONE)
    # a value that holds for all cases is written out once, for one slice
    rows = [c if c.size == n else np.full(min(n, SLICE), c[0]) for c in columns]

    def work(part: slice) -> None:
        m = part.stop - part.start
        six: Any = [row[part] if c.size == n else row[:m] for row, c in zip(rows, columns, strict=True)]
        v, y = (v_all[part], y_all[part]) if groups else (np.empty(m), np.empty(m))
        odd = dimensional.group_columns(six[0], six[1], six[2], six[3], six[4], six[5], v, y)
        answers: Any = mu[part], bound[part], source[part]
        if evaluate.common_ratios(v, y, *data, *answers):
            evaluate.others(charts.MU, v, y, *data, *answers)
        if odd:
            given: Any = (*six, *data, v, y, *answers)
            dimensional.other_cases(*given)
        with np.errstate(all="ignore"):  # the calling code may have set numpy to raise at underflow or NaN
            np.multiply(mu[part], six[0], out=macro[part])
            bound[part] *= six[0]

    share_out(n, threads, work)
    return macro, mu, bound, source, v_all, y_all


def gradients(
    data: Data, columns: Sequence[Array], mu: Array, bound: Array, source: Codes, v: Array, y: Array, threads: int
) -> Array:
    """d mu_macro / d input and the bounds, (n, 2, 6), of what :func:`cases` found; ``bound`` is that of mu~."""
    out = np.empty((mu.size, 2, 6))

    def work(part: slice) -> None:
        six: Any = [np.ascontiguousarray(np.broadcast_to(c, mu.shape)[part]) for c in columns]
        for column in six:  # all or none: a kernel is compiled anew for every mix
            column.flags.writeable = False
        found: Any = (*six, mu[part], bound[part], source[part], v[part], y[part], *data, out[part])
        dimensional.gradients(*found)

    share_out(mu.size, threads, work)
    return out


def quantity(which: int, data: Data, v: Array, y: Array, threads: int) -> tuple[Array, Array, Codes]:
    """Value, bound and source of any quantity at (n,) points."""
    if which == charts.MU:
        return ratios(data, v, y, threads, bounds=True)
    value, bound, source = np.empty(v.size), np.empty(v.size), np.empty(v.size, np.int8)

    def work(part: slice) -> None:
        given = which, v[part], y[part], *data, value[part], bound[part], source[part]
        if evaluate.common_others(*given):
            evaluate.others(*given)

    share_out(v.size, threads, work)
    return value, bound, source


def slopes(which: int, data: Data, v: Array, y: Array, threads: int) -> Array:
    """Value, both logarithmic slopes and their bounds, rows (5, n), of any quantity."""
    out = np.empty((5, v.size))

    def work(part: slice) -> None:
        rows = np.empty((5, part.stop - part.start))
        evaluate.slopes(which, v[part], y[part], *data, rows)
        out[:, part] = rows

    share_out(v.size, threads, work)
    return out

"""Solve nodes in parallel.

Work is cut into chunks of points.  A chunk is a pure function of its inputs, so the values do not
depend on the number of workers.
"""

from concurrent.futures import ThreadPoolExecutor
from typing import Self

import numpy as np

from mumacro.errors import MumacroError
from mumacro.kernel.arrays import Array

from . import steady
from .compiled import solver_kernel
from .slip import OK

CHUNK = 128  # points; about 10 ms of work
#: the steady state; the continuous orbit whether or not lam stays positive, analytic across the
#: border; the border, where the column deficit holds v~crit
KINDS = {"full": 0, "continuous": 1, "border": 2}
_RESULTS = steady.REGIME
COLUMNS = (*steady.RESULTS[:_RESULTS], "error_estimate", "status")
_MU, _DEFICIT, _ERROR, _STATUS = map(
    COLUMNS.index, ("mu_ratio", "deficit", "error_estimate", "status")
)


class SolveError(MumacroError):
    """Report a node that could not be solved; the message says which one and what to do."""


@solver_kernel
def _solve_rows(kind: int, points: Array, out: Array) -> None:
    """Solve ``points`` (n, 3) into rows of COLUMNS; ``kind`` as in KINDS."""
    w, end, orbit, res = steady.workspace()
    for i in range(points.shape[0]):
        v, y, eta = points[i]
        if kind == 2:
            res[_DEFICIT], res[_MU], status = steady.border_raw(y, w, end)
            error = steady.RELATIVE_ERROR * res[_MU]
        else:
            if kind == 0:
                status = steady.solve_raw(v, y, eta, w, end, orbit, res)
            else:
                status = steady.continuous(v, y, w, end)
                steady.sliding(v, y, end, res)
            error = steady.error_estimate(res[_MU], res[_DEFICIT])
        out[i, :_RESULTS], out[i, _ERROR], out[i, _STATUS] = res[:_RESULTS], error, status


def solve_chunk(kind: str, points: Array) -> Array:
    """Solve ``points`` (n, 3) of v~, y~, y~ - 1 as one of :data:`KINDS`; return rows of
    :data:`COLUMNS`."""
    out = np.empty((points.shape[0], len(COLUMNS)))
    _solve_rows(KINDS[kind], np.ascontiguousarray(points), out)
    return out


class Sweep:
    """Solve arrays of points in several threads (the solver releases the interpreter lock), and
    count them."""

    def __init__(self, workers: int = 1) -> None:
        self.n_solves = 0
        self.workers = workers
        self._pool = ThreadPoolExecutor(max_workers=workers)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def solve(self, kind: str, v: Array, y: Array, eta: Array | None = None) -> dict[str, Array]:
        """Solve at every (v~, y~); return arrays of the broadcast shape by name of :data:`COLUMNS`.

        Give ``eta`` = y~ - 1 if it is known better than ``y``.

        Raises
        ------
        InputError
            If a point is outside the solver's range, :mod:`.steady`.
        SolveError
            If any point fails, because a table must have no missing node.
        """
        v, y = np.broadcast_arrays(np.asarray(v, dtype=np.float64), np.asarray(y, dtype=np.float64))
        eta = (
            y - 1.0 if eta is None else np.broadcast_to(np.asarray(eta, dtype=np.float64), y.shape)
        )
        steady.check_range(v, y, eta)
        points = np.stack([v.ravel(), y.ravel(), eta.ravel()], axis=1)
        chunks = [points[i : i + CHUNK] for i in range(0, points.shape[0], CHUNK)]
        results = self._pool.map(lambda chunk: solve_chunk(kind, chunk), chunks)
        out = np.concatenate([np.empty((0, len(COLUMNS))), *results])
        self.n_solves += points.shape[0]
        failures = np.flatnonzero(out[:, _STATUS] != OK)
        if failures.size:
            (v_bad, y_bad, _), status = points[failures[0]].tolist(), int(out[failures[0], _STATUS])
            text = (
                f"{failures.size} of {points.shape[0]} points failed, first v~={v_bad!r}, "
                f"y~={y_bad!r}: "
            )
            raise SolveError(text + steady.ADVICE[status])
        return {name: out[:, i].reshape(v.shape) for i, name in enumerate(COLUMNS)}

"""Nodes to solved values: in parallel and resumable.

Work is cut into chunks of points; a chunk is a pure function of its inputs, so the values do not depend on how many
workers there are or on whether a build was interrupted.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mumacro.errors import MumacroError
from mumacro.writing import write_whole

from . import steady
from .compiled import solver_kernel, source_digest
from .limits import check_range
from .model import OK

__all__ = ["COLUMNS", "CheckpointError", "SolveError", "Sweep", "solve_chunk"]

Array = NDArray[np.float64]
CHUNK = 128  # points; about 10 ms of work
_RESULTS = steady.REGIME
COLUMNS = (*steady.RESULTS[:_RESULTS], "error_estimate", "status")
_MU, _DEFICIT, _ERROR, _STATUS = map(COLUMNS.index, ("mu_ratio", "deficit", "error_estimate", "status"))


class SolveError(ArithmeticError):
    """A node could not be solved; the message states which and what to do."""


class CheckpointError(MumacroError):
    """Finished work cannot be stored."""


@solver_kernel
def _full(v: Array, y: Array, eta: Array, out: Array) -> None:
    """Steady states at (n,) points into rows of COLUMNS."""
    w, end, orbit, res = steady.workspace()
    for i in range(v.size):
        status = steady.solve_raw(v[i], y[i], eta[i], w, end, orbit, res)
        out[i, :_RESULTS] = res[:_RESULTS]
        out[i, _ERROR] = steady.error_estimate(out[i, _MU], out[i, _DEFICIT])
        out[i, _STATUS] = status


@solver_kernel
def _continuous(v: Array, y: Array, _eta: Array, out: Array) -> None:
    """The continuous orbit whether or not lam stays positive: it is analytic across the border."""
    w, end, _, res = steady.workspace()
    for i in range(v.size):
        status = steady.continuous(v[i], y[i], w, end)
        steady.sliding(v[i], y[i], end, res)
        out[i, :_RESULTS] = res[:_RESULTS]
        out[i, _ERROR] = steady.error_estimate(out[i, _MU], out[i, _DEFICIT])
        out[i, _STATUS] = status


@solver_kernel
def _border(_v: Array, y: Array, _eta: Array, out: Array) -> None:
    """v~crit at (n,) amplitudes into column 1, mu~ there into column 0."""
    w, end, _, _ = steady.workspace()
    for i in range(y.size):
        crit, mu, status = steady.border_raw(y[i], w, end)
        out[i] = 0.0
        out[i, _MU], out[i, _DEFICIT], out[i, _ERROR] = mu, crit, steady.RELATIVE_ERROR * mu
        out[i, _STATUS] = status


_KINDS: dict[str, Callable[[Array, Array, Array, Array], None]] = {
    "full": _full,
    "continuous": _continuous,
    "border": _border,
}


def solve_chunk(kind: str, points: Array) -> Array:
    """Solve ``points`` (n, 3) of v~, y~, y~ - 1; rows of :data:`COLUMNS` (for kind "border" v~crit is column 1)."""
    out = np.empty((points.shape[0], len(COLUMNS)))
    v, y, eta = (np.ascontiguousarray(points[:, i]) for i in range(3))
    _KINDS[kind](v, y, eta, out)
    return out


class Sweep:
    """Solves arrays of points and counts them.

    Parameters
    ----------
    workers : int
        Threads on this machine (the solver releases the interpreter lock).
    checkpoint : Path, optional
        Folder for finished sweeps; a later build with the same nodes reads them instead of solving again.
    """

    def __init__(self, workers: int = 1, checkpoint: Path | None = None) -> None:
        self.n_solves = 0
        self.checkpoint = checkpoint
        self._pool = ThreadPoolExecutor(max_workers=workers)

    def __enter__(self) -> Sweep:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def solve(self, kind: str, v: Array, y: Array, eta: Array | None = None) -> dict[str, Array]:
        """Solve at every (v~, y~); returns arrays of the broadcast shape by name of :data:`COLUMNS`.

        ``eta`` = y~ - 1 may be given where it is known better than ``y``.

        Raises
        ------
        InputError
            A point outside the solver's range, :mod:`.limits`.
        SolveError
            When any point fails: a table must have no missing node.
        """
        v, y = np.broadcast_arrays(np.asarray(v, dtype=np.float64), np.asarray(y, dtype=np.float64))
        eta = y - 1.0 if eta is None else np.broadcast_to(np.asarray(eta, dtype=np.float64), y.shape)
        check_range(v, y, eta)
        points = np.stack([v.ravel(), y.ravel(), eta.ravel()], axis=1)
        out = self._load(kind, points)
        if out is None:
            out = self._run(kind, points)
            self._save(kind, points, out)
        self.n_solves += points.shape[0]
        failed = np.flatnonzero(out[:, _STATUS] != OK)
        if failed.size:
            i = failed[0]
            v_bad, y_bad = points[i, :2].tolist()
            raise SolveError(
                f"{failed.size} of {points.shape[0]} points failed, first v~={v_bad!r}, y~={y_bad!r}: "
                + steady.ADVICE[int(out[i, _STATUS])]
            )
        return {name: out[:, i].reshape(v.shape) for i, name in enumerate(COLUMNS)}

    def _run(self, kind: str, points: Array) -> Array:
        chunks = [points[i : i + CHUNK] for i in range(0, points.shape[0], CHUNK)]
        done = self._pool.map(lambda c: solve_chunk(kind, c), chunks)
        return np.concatenate([np.empty((0, len(COLUMNS))), *done])

    def _file(self, kind: str, points: Array) -> Path | None:
        if self.checkpoint is None:
            return None
        # the digest of the sources: results of another version of the solver are not reused
        digest = hashlib.sha256(
            (source_digest() + kind).encode() + np.ascontiguousarray(points, dtype="<f8").tobytes()
        ).hexdigest()
        return self.checkpoint / f"{kind}-{digest[:32]}.npy"

    def _load(self, kind: str, points: Array) -> Array | None:
        file = self._file(kind, points)
        if file is None or not file.exists():
            return None
        try:
            out: Array = np.load(file, allow_pickle=False)
        except (OSError, ValueError, EOFError):
            return None  # a damaged checkpoint is solved again
        return out if out.shape == (points.shape[0], len(COLUMNS)) else None

    def _save(self, kind: str, points: Array, out: Array) -> None:
        file = self._file(kind, points)
        if file is None:
            return
        content = io.BytesIO()
        np.save(content, out)
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            write_whole(file, content.getvalue())
        except OSError as error:
            raise CheckpointError(
                f"{file.parent}: finished work cannot be stored: {error.strerror or error}; repair that and give "
                "the same command again: it resumes"
            ) from error

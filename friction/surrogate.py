"""The surrogate: blocks inside, closed-form tails outside; value, regime, source and an honest error bound."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from friction import kernels, lanes, nondim, regions
from friction.border import Border
from friction.companions import bounds_array, companions_array
from friction.errors import InputError, TableError
from friction.patches import aligned, cells_2d, pace_of
from friction.slopes import slopes_array
from friction.table import Table, json_attributes, read_table

__all__ = ["REGIME_OF_SOURCE", "Answer", "Surrogate"]

# One parallel loop at a time: numba's fallback threading layer (no OpenMP, no TBB) aborts the process when two threads
# enter one, and a loop uses every core anyway.
_ONE_LOOP = threading.Lock()
FEW = 4096  # points that one thread answers before a second one has started

Array = NDArray[np.float64]


@contextmanager
def _loop(points: int, threads: int | None) -> Iterator[None]:
    """The right to run a parallel loop, on ``threads`` threads (None: as many as numba is set to, all cores)."""
    with _ONE_LOOP:
        before = numba.get_num_threads()
        if points < FEW:
            numba.set_num_threads(1)
        elif threads is not None:
            numba.set_num_threads(threads)
        try:
            yield
        finally:
            numba.set_num_threads(before)


#: regime code of every source code
REGIME_OF_SOURCE = np.array(
    [b.regime for b in regions.BLOCKS] + [regions.CONTINUOUS, regions.CONTINUOUS, regions.STATIC, regions.CONTINUOUS],
    dtype=np.int8,
)
_REGIMES = np.array(regions.REGIMES)
_SOURCES = np.array(regions.SOURCES)


class Answer:
    """What the surrogate says; floats and strings for a scalar call, arrays of the broadcast shape otherwise.

    Attributes
    ----------
    mu_macro : float or ndarray
        Macroscopic friction coefficient [-].
    mu_ratio : float or ndarray
        mu_macro / mu0 [-].
    error_bound : float or ndarray
        Bound of the absolute error of ``mu_macro`` [-].
    source_code : int or ndarray of int8
        Block or tail that answered, index into :data:`friction.regions.SOURCES`.
    v_tilde, y_tilde : float or ndarray
        Dimensionless speed and amplitude [-]; of arrays only where groups or gradient were asked for.
    length_scale : float or ndarray
        l0 = mu0 Fz / k [m], eq. (5); 0 for rigid contact; as v_tilde.
    gradient : dict of str to float or ndarray, or None
        d mu_macro / d input by field name, where it was asked for; infinite for v0 at v0 = 0 on y~ = 1.
    """

    __slots__ = (
        "_length_scale", "_v_tilde", "_y_tilde", "error_bound", "gradient", "mu_macro", "mu_ratio", "source_code",
    )  # fmt: skip

    def __init__(
        self,
        mu_macro: Any,
        mu_ratio: Any,
        error_bound: Any,
        source_code: Any,
        v_tilde: Any,
        y_tilde: Any,
        length_scale: Any,
        gradient: dict[str, Any] | None = None,
    ) -> None:
        self.mu_macro = mu_macro
        self.mu_ratio = mu_ratio
        self.error_bound = error_bound
        self.source_code = source_code
        self._v_tilde = v_tilde
        self._y_tilde = y_tilde
        self._length_scale = length_scale
        self.gradient = gradient

    def _group(self, value: Any, name: str) -> Any:
        if value is None:
            raise AttributeError(f"{name} was not asked for: evaluate(..., groups=True)")
        return value

    @property
    def v_tilde(self) -> Any:
        """Dimensionless speed v0 k/(mu0 Fz omega) [-]."""
        return self._group(self._v_tilde, "v_tilde")

    @property
    def y_tilde(self) -> Any:
        """Dimensionless amplitude y0 k/(mu0 Fz) [-]."""
        return self._group(self._y_tilde, "y_tilde")

    @property
    def length_scale(self) -> Any:
        """l0 = mu0 Fz / k [m], eq. (5); 0 for rigid contact."""
        return self._group(self._length_scale, "length_scale")

    @property
    def regime(self) -> Any:
        """``"continuous"``, ``"stick_slip"`` or ``"static"`` (v0 = 0): str or ndarray of str, made when asked for."""
        names = _REGIMES[REGIME_OF_SOURCE[self.source_code]]
        return names if isinstance(self.source_code, np.ndarray) else str(names)

    @property
    def source(self) -> Any:
        """Name of the block or tail that answered: str or ndarray of str, made when asked for."""
        names = _SOURCES[self.source_code]
        return names if isinstance(self.source_code, np.ndarray) else str(names)

    def __repr__(self) -> str:
        shown = (
            "mu_macro",
            "mu_ratio",
            "error_bound",
            "regime",
            "source",
            "gradient",
        )
        groups = ("v_tilde", "y_tilde", "length_scale") if self._v_tilde is not None else ()
        return f"Answer({', '.join(f'{name}={getattr(self, name)!r}' for name in (*shown, *groups))})"


class Surrogate:
    """mu~(v~, y~) from one table; open it once, share it between threads.

    >>> s = Surrogate.open("tables/mumacro-1e-10.nc")                           # doctest: +SKIP
    >>> s.evaluate(mu0=0.3, Fz=10, k=1e6, y0=2e-6, omega=1.3e5, v0=0.01).regime  # doctest: +SKIP
    'stick_slip'
    """

    def __init__(self, table: Table, path: str | Path, threads: int | None = None) -> None:
        most = int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]
        if threads is not None and not (type(threads) is int and 1 <= threads <= most):
            raise InputError("threads", threads, f"None or a whole number from 1 to {most}")
        self.threads = threads
        self.path = Path(path)
        self.table = table
        self.attributes = json_attributes(table)
        self.tolerance = float(table.attributes["tolerance"])
        self.checksum = str(table.attributes.get("content_sha256", ""))
        self.max_abs_error = float(table.attributes.get("verified_max_abs_error", math.nan))
        self.max_rel_error = float(table.attributes.get("verified_max_rel_error", math.nan))
        self.border = Border(table.border)
        patches, rows, first = [], [], 0
        for spec, block in zip(regions.BLOCKS, table.blocks, strict=True):
            patches.append(cells_2d(spec, block.values, block.cells))
            na, nb = block.cells
            paces = (*pace_of(spec.a_name, *spec.a, na), *pace_of(spec.b_name, *spec.b, nb))
            rows.append([first, na, nb, *paces, block.quantity_error + kernels.rounding_of(spec)])
            first += na * nb
        self._data = (_joined(patches), np.array(rows), *self.border.arrays)
        self._companion_data: tuple[Array, Array] | None = None
        self._companion_errors: tuple[Array, Array, float] | None = None
        errors = [(block.power_error, block.stick_error) for block in table.blocks]
        if all(power is not None for power, _ in errors):
            measured = np.array([(power, stick or 0.0) for power, stick in errors], dtype=np.float64)
            border_error = max(piece.max_rel_error for piece in table.border)
            self._companion_errors = (measured[:, 0].copy(), measured[:, 1].copy(), border_error)

    @classmethod
    def open(cls, path: str | Path, threads: int | None = None) -> Surrogate:
        """Read, check and prepare the table at ``path``.

        Parameters
        ----------
        path : str or Path
            The table file.
        threads : int, optional
            Threads that arrays are shared out to; all cores by default.  Scalars need one.

        Raises
        ------
        TableError
            When the file is missing, damaged or of another format.
        InputError
            When ``threads`` is not a whole number from 1 to the number that numba was started with.
        """
        return cls(read_table(path), path, threads)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle small: by path and checksum; the file must say the same where it is opened again."""
        return _reopen, (str(self.path.resolve()), self.seal, self.threads)

    @property
    def seal(self) -> str:
        """Checksum of all that answers depend on: of the bounds too, which covers the content, where there are any."""
        return str(self.attributes.get("bounds_sha256", self.checksum))

    @property
    def id(self) -> str:
        """Name of the table: the file's stem."""
        return self.path.stem

    @property
    def blocks(self) -> list[dict[str, object]]:
        """JSON-able description of the blocks."""
        return [
            {
                "name": spec.name,
                "regime": regions.REGIMES[spec.regime],
                "coordinates": [spec.a_name, spec.b_name],
                "ranges": [list(spec.a), list(spec.b)],
                "shape": list(block.values.shape),
                "cells": list(block.cells),
                "quantity": spec.quantity,
                "verified_max_abs_error": block.max_abs_error,
                "verified_max_rel_error": block.max_rel_error,
                "power_error": block.power_error,
                "stick_error": block.stick_error,
            }
            for spec, block in zip(regions.BLOCKS, self.table.blocks, strict=True)
        ]

    def _companions(self, v_tilde: ArrayLike, y_tilde: ArrayLike) -> tuple[Array, Array, tuple[int, ...]]:
        (v_all, y_all), shape = _columns(v_tilde, y_tilde)
        with _loop(v_all.size, self.threads):
            if self._companion_data is None:
                stick, power = [], []
                for spec, block in zip(regions.BLOCKS, self.table.blocks, strict=True):
                    power.append(cells_2d(spec, block.power, block.cells))
                    none = np.zeros_like(power[-1])
                    stick.append(cells_2d(spec, block.stick, block.cells) if block.stick.size else none)
                self._companion_data = (_joined(power), _joined(stick))
            power_out, stick_out = np.empty(v_all.size), np.empty(v_all.size)
            companions_array(v_all, y_all, *self._companion_data, *self._data[1:], power_out, stick_out)
        return power_out, stick_out, shape

    def _companion_bounds(self, v_tilde: ArrayLike, y_tilde: ArrayLike, power: Array) -> tuple[Array, Array] | None:
        """Bounds of power and stick fraction, flat; None when the table does not have them."""
        if self._companion_errors is None:
            return None
        (v_all, y_all), _ = _columns(v_tilde, y_tilde)
        of_power, of_stick = np.empty(v_all.size), np.empty(v_all.size)
        with _loop(v_all.size, self.threads):
            bounds_array(v_all, y_all, power, *self._companion_errors, *self._data[2:], of_power, of_stick)
        return of_power, of_stick

    def power_with_bound(self, v_tilde: ArrayLike, y_tilde: ArrayLike) -> tuple[Any, Any]:
        """:meth:`power` and the bound of its absolute error; scalars in, floats out.

        The bound is None from a table that was built before power and stick fraction were verified.
        """
        power, _, shape = self._companions(v_tilde, y_tilde)
        bounds = self._companion_bounds(v_tilde, y_tilde, power)
        return _shaped(power, shape), None if bounds is None else _shaped(bounds[0], shape)

    def stick_fraction_with_bound(self, v_tilde: ArrayLike, y_tilde: ArrayLike) -> tuple[Any, Any]:
        """:meth:`stick_fraction` and the bound of its absolute error; as :meth:`power_with_bound`.

        At the border the bound is larger than elsewhere, on both sides: there the fraction is a square root of the
        distance to v~crit, and v~crit is known to some digits only.
        """
        power, stick, shape = self._companions(v_tilde, y_tilde)
        bounds = self._companion_bounds(v_tilde, y_tilde, power)
        return _shaped(stick, shape), None if bounds is None else _shaped(bounds[1], shape)

    def power(self, v_tilde: ArrayLike, y_tilde: ArrayLike) -> Any:
        """Mean power of the shaker <y~ cos tau u_y> [-], in units of mu0 Fz l0 omega; scalar in, float out.

        The slip dissipates v~ mu~ plus this power.  Tabulated at the nodes of mu~; the cells are prepared on first use.
        """
        power, _, shape = self._companions(v_tilde, y_tilde)
        return _shaped(power, shape)

    def stick_fraction(self, v_tilde: ArrayLike, y_tilde: ArrayLike) -> Any:
        """Share of the period during which the contact sticks [-]; legal inputs, scalar in, float out."""
        _, stick, shape = self._companions(v_tilde, y_tilde)
        return _shaped(stick, shape)

    @property
    def memory(self) -> int:
        """Bytes of the cells that the kernel walks through."""
        return sum(array.nbytes for array in self._data)

    def warm_up(self) -> None:
        """Load or compile every kernel: scalar and array paths, border and dimensional inputs."""
        self.mu_ratio(0.1, 0.5)
        self.mu_ratio(np.array([0.1, 0.1]), 0.5)
        self.ratio_with_bound(np.array([0.1, 0.1]), 0.5)
        for mu0 in (0.3, np.array([0.3, 0.3])):
            self.evaluate(mu0, 10.0, 1e6, 2e-6, 1.3e5, 0.01, gradient=True)
        self.v_tilde_crit(np.array([0.5]))
        self.power_with_bound(0.1, 0.5)

    def self_check(self) -> None:
        """Compare known answers with the table; raises :class:`TableError` when one is off by more than its bound."""
        known = ((0.1, 0.5, KNOWN_STICK_SLIP), (2.0, 1.0, KNOWN_CONTINUOUS))
        for v, y, expected in known:
            mu, bound, _ = kernels.ratio(v, y, *self._data)
            if not abs(mu - expected) <= bound + 1e-15:
                raise TableError(self.path, f"known answer at v~={v}, y~={y} is {expected!r}, the table says {mu!r}")

    def v_tilde_crit(self, y_tilde: ArrayLike) -> Any:
        """Border of continuous sliding v~crit [-] at amplitude ``y_tilde`` [-] >= 0; scalar in, float out."""
        return self.border(y_tilde)

    def mu_ratio(self, v_tilde: Any, y_tilde: Any) -> Any:
        """mu~ [-] at v~, y~ [-]: the fast path.

        Parameters
        ----------
        v_tilde, y_tilde : float or array_like
            Dimensionless speed and amplitude, broadcast together.

        Returns
        -------
        float or ndarray of float64
            NaN in an array where a value is negative or NaN, or both are infinite.

        Raises
        ------
        InputError
            For such a value in a scalar call.
        """
        if isinstance(v_tilde, (float, int)) and isinstance(y_tilde, (float, int)):
            v, y = float(v_tilde), float(y_tilde)
            if v >= 0.0 and 0.0 <= y < math.inf:
                return kernels.ratio(v, y, *self._data)[0]
            if not v >= 0.0:
                raise InputError("v_tilde", v_tilde, ">= 0")
            raise InputError("y_tilde", y_tilde, "finite and >= 0")
        (v_all, y_all), shape = _columns(v_tilde, y_tilde)
        out = np.empty(v_all.size)
        with _loop(v_all.size, self.threads):
            lanes.value_array(v_all, y_all, *self._data, out)
        return out.reshape(shape) if shape else float(out[0])

    def slopes(self, v_tilde: ArrayLike, y_tilde: ArrayLike) -> tuple[Array, Array, Array]:
        """mu~, v~ d mu~/d v~ and y~ d mu~/d y~ [-] of the broadcast shape; inputs must be legal and y~ finite."""
        (v_all, y_all), shape = _columns(v_tilde, y_tilde)
        mu, along_v, along_y = (np.empty(v_all.size) for _ in range(3))
        with _loop(v_all.size, self.threads):
            slopes_array(v_all, y_all, *self._data, mu, along_v, along_y)
        return mu.reshape(shape), along_v.reshape(shape), along_y.reshape(shape)

    def ratio_with_bound(self, v_tilde: ArrayLike, y_tilde: ArrayLike) -> tuple[Array, Array, NDArray[np.int8]]:
        """mu~, the bound of its absolute error and the source code, of the broadcast shape; inputs must be legal."""
        (v_all, y_all), shape = _columns(v_tilde, y_tilde)
        mu, bound, source = np.empty(v_all.size), np.empty(v_all.size), np.empty(v_all.size, dtype=np.int8)
        with _loop(v_all.size, self.threads):
            lanes.ratio_array(v_all, y_all, *self._data, mu, bound, source)
        return mu.reshape(shape), bound.reshape(shape), source.reshape(shape)

    def evaluate(
        self,
        mu0: ArrayLike,
        Fz: ArrayLike,
        k: ArrayLike | None,
        y0: ArrayLike,
        omega: ArrayLike,
        v0: ArrayLike,
        *,
        gradient: bool = False,
        groups: bool = False,
    ) -> Answer:
        """Macroscopic friction from dimensional inputs, scalars or arrays that broadcast together.

        Parameters
        ----------
        mu0 : array_like
            Coulomb friction coefficient [-], > 0.
        Fz : array_like
            Normal force [N], > 0.
        k : array_like or None
            Tangential stiffness [N/m], > 0; None is rigid contact, eq. (37).
        y0 : array_like
            Amplitude of the transverse oscillation [m], >= 0.
        omega : array_like
            Angular frequency [rad/s], >= 0.
        v0 : array_like
            Sliding speed [m/s], >= 0.
        gradient : bool
            Also differentiate with respect to every input that was given.
        groups : bool
            Also keep v~, y~ and l0 of arrays, which takes a quarter of the time again; scalars and gradients have them.

        Raises
        ------
        InputError
            At the first value out of bounds or inputs whose shapes do not broadcast.

        Notes
        -----
        y0 = 0 or omega = 0 gives mu0.  v0 = 0 with y0, omega > 0 gives the static limit, eq. (16).
        """
        given: tuple[Any, ...] = (mu0, Fz, math.inf if k is None else k, y0, omega, v0)
        if _plain(given) and (k is None or given[2] < math.inf):
            a, b, c, d, e, f = given
            return self._scalar(a, b, c, d, e, f, gradient)
        named = {"mu0": mu0, "Fz": Fz, "k": k, "y0": y0, "omega": omega, "v0": v0}
        columns = nondim.as_columns(named)
        columns.setdefault("k", np.asarray(math.inf))
        ordered = [columns[name] for name in nondim.FIELDS]
        try:
            shape = np.broadcast_shapes(*(c.shape for c in ordered))
        except ValueError as error:
            shapes = {name: columns[name].shape for name in nondim.FIELDS}
            raise InputError("inputs", shapes, "arrays whose shapes broadcast together") from error
        if shape == ():
            nondim.check_inputs(named)
            m, n_force, stiffness, amplitude, frequency, speed = (float(c) for c in ordered)
            return self._scalar(m, n_force, stiffness, amplitude, frequency, speed, gradient)
        n = math.prod(shape)
        # a value that holds for all cases stays one value, unless slopes or groups are asked for
        every = gradient or groups
        flat = [_flat(c, shape) if every or c.size != 1 else _flat(c.reshape(-1), (1,)) for c in ordered]
        macro, mu, bound = (np.empty(n) for _ in range(3))
        source = np.empty(n, dtype=np.int8)
        with _loop(n, self.threads):
            a, b, c, d, e, f = flat
            illegal = nondim.evaluate_array(a, b, c, d, e, f, *self._data, k is None, macro, mu, bound, source)
            if illegal or n == 0:  # no case counts the faults of a value that would hold for all
                nondim.check_inputs(named)
            v, y = np.empty(n if every else 0), np.empty(n if every else 0)
            slopes = np.empty((n if gradient else 0, 6))
            if every:
                nondim.groups_array(a, b, c, d, e, f, v, y)
            if gradient:
                nondim.gradient_array(a, b, c, d, e, f, mu, source, v, y, *self._data, slopes)
        with np.errstate(over="ignore", under="ignore"):
            length = np.broadcast_to(ordered[0] * (ordered[1] / ordered[2]), shape) if every else None
        return Answer(
            mu_macro=macro.reshape(shape),
            mu_ratio=mu.reshape(shape),
            error_bound=bound.reshape(shape),
            source_code=source.reshape(shape),
            v_tilde=v.reshape(shape) if every else None,
            y_tilde=y.reshape(shape) if every else None,
            length_scale=length,
            gradient=None if not gradient else self._named(slopes.T.reshape(6, *shape), k is None),
        )

    @staticmethod
    def _named(slopes: Array, rigid: bool) -> dict[str, Any]:
        return {name: slopes[i] for i, name in enumerate(nondim.FIELDS) if not (rigid and name == "k")}

    def _scalar(self, mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float, gradient: bool) -> Answer:
        mu, bound, source, v, y = nondim.dimensional(mu0, Fz, k, y0, omega, v0, *self._data)
        named = None
        if gradient:
            slopes = np.empty(6)
            nondim.gradient(mu0, Fz, k, y0, omega, v0, mu, source, v, y, *self._data, slopes)
            named = {name: float(slope) for name, slope in self._named(slopes, k == math.inf).items()}
        return Answer(
            mu_macro=mu0 * mu,
            mu_ratio=mu,
            error_bound=mu0 * bound,
            source_code=source,
            v_tilde=v,
            y_tilde=y,
            length_scale=mu0 * (Fz / k),
            gradient=named,
        )


# mu~ at (v~, y~) = (0.1, 0.5) and (2, 1), from the full model to all digits (tests/test_surrogate.py solves them anew)
KNOWN_STICK_SLIP = 0.9420042895137095
KNOWN_CONTINUOUS = 0.9545954718694023


def _plain(values: tuple[Any, ...]) -> bool:
    """Six legal plain floats, which need no arrays; anything else, and anything illegal, takes the careful way."""
    a, b, c, d, e, f = values
    return (
        type(a) is type(b) is type(c) is type(d) is type(e) is type(f) is float
        and 0.0 < a < math.inf and 0.0 < b < math.inf and c > 0.0
        and (0.0 <= d < math.inf and 0.0 <= e < math.inf and 0.0 <= f < math.inf)
    )  # fmt: skip


def _joined(patches: list[Array]) -> Array:
    out = aligned(sum(p.shape[0] for p in patches), *patches[0].shape[1:])
    return np.concatenate(patches, out=out)


def _shaped(flat: Array, shape: tuple[int, ...]) -> Any:
    return flat.reshape(shape) if shape else float(flat[0])


def _columns(*values: ArrayLike) -> tuple[list[Array], tuple[int, ...]]:
    """The values broadcast together, flat, contiguous and writable (one numba signature), and their shape."""
    arrays = [np.asarray(value, dtype=np.float64) for value in values]
    shape = np.broadcast_shapes(*(a.shape for a in arrays))
    return [_flat(a, shape) for a in arrays], shape


def _flat(a: Array, shape: tuple[int, ...]) -> Array:
    """``a`` broadcast to ``shape``, flat, contiguous and writable."""
    if a.shape == shape and a.flags.c_contiguous and a.flags.writeable:
        return a.reshape(-1)
    full = np.empty(shape)
    full[...] = a
    return full.reshape(-1)


def _reopen(path: str, checksum: str, threads: int | None = None) -> Surrogate:
    surrogate = Surrogate.open(path, threads)
    if checksum and surrogate.seal != checksum:
        raise TableError(path, f"holds {surrogate.seal[:12]}, the pickled surrogate was made from {checksum[:12]}")
    return surrogate

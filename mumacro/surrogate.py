"""The surrogate for users.  Value, regime, source, gradient, power and stick fraction, each with
its bound."""

import functools
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal, Self, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mumacro import closed_forms, plotting
from mumacro.answer import Answer, AnswerWithGradient, IntervalAnswer, single
from mumacro.contacts.quadrature import put_driven
from mumacro.errors import InputError, TableError
from mumacro.frames import evaluate_labelled
from mumacro.inputs.cases import (
    ABSENT,
    NUMBERS,
    NUMBERS_AND_ARRAYS,
    Cases,
    by_name,
    has_labels,
    real,
)
from mumacro.inputs.fields import FIELDS, RAD_PER_CYCLE
from mumacro.inputs.kind import (
    BALL,
    SPRING,
    ContactName,
    DirectionName,
    Kind,
    kind_of,
)
from mumacro.kernel import threads as shared_out
from mumacro.kernel.arrays import Array, common_shape, flat
from mumacro.kernel.binding import Data, Detail, kernels
from mumacro.kernel.threads import default_threads
from mumacro.table import atlas
from mumacro.table.blocks import BorderPiece, Table
from mumacro.table.bundled import bundled_tables
from mumacro.table.netcdf import BALL as BALL_ATTRIBUTES
from mumacro.table.netcdf import error_distribution, json_attributes, parse_table, read_image
from mumacro.table.polynomials import Border, block_rows, outer_cells, quantity_cells

_KERNEL = kernels[-1]
_SCALAR_KERNEL = kernels[:2][
    -1
]  # a single point does not fill the widest registers; the bits are the same
_RATIO = _SCALAR_KERNEL.ratio
_CODES = {name: code for code, name in enumerate(atlas.QUANTITY_NAMES)}
_FLOAT = np.dtype(np.float64)
#: effects of an illegal value in an array
ILLEGAL = ("nan", "raise")


class Surrogate:
    """mu~(v~, y~) from one table; open it once, share it between threads and processes.

    One policy for all methods: a scalar that is out of bounds raises :class:`InputError`; in an
    array it gives NaN, with the source code -1.  What is no real number raises in either case.

    Examples
    --------
    >>> s = Surrogate.open()
    >>> answer = s.evaluate(mu0=0.3, Fz=10, k=1e6, y0=2e-6, f=20e3, v0=0.01)
    >>> round(answer.mu_macro, 6), answer.regime
    (0.240467, 'stick_slip')
    """

    def __init__(self, table: Table, path: str | Path, threads: int | None = None) -> None:
        if threads is not None and not (type(threads) is int and 1 <= threads <= 1024):
            raise InputError("threads", threads, "None or a whole number from 1 to 1024")
        self._thread_limit = threads
        self._image: bytes | None = None
        self.path = Path(path)
        self.table = table
        self.attributes = json_attributes(table)
        self.tolerance = float(table.attributes["tolerance"])
        self.checksum = str(table.attributes.get("content_sha256", ""))
        self.max_abs_error = float(table.attributes.get("verified_max_abs_error", math.nan))
        self.max_rel_error = float(table.attributes.get("verified_max_rel_error", math.nan))
        self.border = Border(table.border)
        _check_border(table.border, self.path)
        self._data = Data(*self.border.arrays, block_rows(table.blocks), outer_cells())
        self._data.put(atlas.MU, *quantity_cells(table.blocks, atlas.MU))
        #: what the kernel reads of a ball that is shaken across; made on first use
        self._ball: Data | None = None
        self._pointer = self._data.pointer

    @classmethod
    def open(cls, table: str | Path | float | None = None, threads: int | None = None) -> Self:
        """Read, check and prepare a table.

        Parameters
        ----------
        table : str, Path, float or None
            A table file; or a tolerance of mu~ [-], for the smallest bundled table that meets it;
            or None for the tightest bundled table.
        threads : int, optional
            Threads that large arrays are divided among; 1 never starts one.  Left out: all
            processors when called from the main thread of a program; one in other threads and in
            child processes, where work is already divided.

        Raises
        ------
        TableError
            The file is missing, damaged or of another format.
        InputError
            No bundled table meets the tolerance; ``threads`` is not a whole number from 1 to 1024.

        Examples
        --------
        >>> Surrogate.open(1e-8).id
        'mumacro-1e-10'
        """
        path = Path(table) if isinstance(table, (str, Path)) else _bundled_table(table)
        return cls._of_image(read_image(path), path, threads)

    @classmethod
    def _of_image(cls, image: bytes, path: Path, threads: int | None) -> Self:
        surrogate = cls(parse_table(image, path), path, threads)
        surrogate._image = image
        return surrogate

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle small: a bundled table by name and checksum, valid on another machine, too;
        another with its bytes."""
        bundled = self.path.resolve() in (path.resolve() for path in bundled_tables())
        path, image = (
            (self.path.name, None)
            if bundled
            else (str(self.path), self._image or read_image(self.path))
        )
        return _reopen, (path, self.checksum, self._thread_limit, image)

    def __repr__(self) -> str:
        return (
            f"<Surrogate {self.id}: tolerance {self.tolerance:g}, error of mu~ at most "
            f"{self.max_abs_error:.1e}>"
        )

    def plot(
        self,
        axes: Any = None,
        *,
        point: tuple[float, float] | None = None,
        contact: str = "spring",
        direction: str = "across",
    ) -> Any:
        """The map of mu~ with a ``point`` (v~, y~), see ``mumacro.plotting.plot_map``; needs
        matplotlib."""
        kind = kind_of(contact, direction)
        ratio, border = self.map_of(kind, 281, 201)
        title = rf"$\mu_\mathrm{{macro}} / \mu_0$: {contact}, {direction}"
        return plotting.plot_map(
            ratio,
            border,
            axes,
            point=point,
            normal=kind.normal,
            areas=self.regimes_on_map(kind),
            title=title,
        )

    def map_of(self, kind: Kind, width: int, height: int) -> tuple[Array, Array]:
        """mu~ (height, width) on the map of a kind of contact, rows from its foot, and v~crit of
        each row (height,)."""
        v, y = plotting.speeds(width), plotting.amplitudes(height, kind.normal)
        ratio = self.quantity("mu_ratio", v, y[:, None], **kind.names)[0]
        return ratio, self.v_tilde_crit(y, **kind.names)

    def regimes_on_map(self, kind: Kind) -> list[str]:
        """The regimes at ``plotting.AREAS`` of the map of a kind of contact."""
        v, y = zip(*(plotting.place(*at, kind.normal) for at in plotting.AREAS), strict=True)
        swing = {"Fz_amplitude" if kind.normal else "y0": np.array(y)}
        # v~ = v0 and y~ = y0
        cases = {"mu0": 1.0, "Fz": 1.0, "k": 1.0, "omega": 1.0, "v0": np.array(v), **swing}
        return [str(name) for name in self.evaluate(cases, **kind.names).regime]

    def on_one_thread(self) -> Self:
        """The same table, whose calls start no thread."""
        copy = object.__new__(type(self))
        copy.__dict__.update(self.__dict__, _thread_limit=1)
        return copy

    @property
    def threads(self) -> int:
        """Threads that a call from here divides a large array among."""
        return default_threads() if self._thread_limit is None else self._thread_limit

    @property
    def id(self) -> str:
        """Name of the table: the file's stem."""
        return self.path.stem

    @property
    def blocks(self) -> list[dict[str, object]]:
        """JSON-able description of the blocks."""
        return [
            {
                "name": chart.name,
                "regime": atlas.REGIMES[chart.regime],
                "coordinates": [chart.a.name, chart.b.name],
                "ranges": [[chart.a.low, chart.a.high], [chart.b.low, chart.b.high]],
                "shape": [block.a.size, block.b.size],
                "cells": list(block.cells),
                "quantity": chart.quantity,
                "verified_max_abs_error": block.max_abs_error,
                "verified_max_rel_error": block.max_rel_error,
                "errors": {name: block.errors[name].tolist() for name in self.table.quantities},
            }
            for chart, block in zip(atlas.CHARTS, self.table.blocks, strict=True)
        ]

    @property
    def error_distribution(self) -> dict[str, dict[str, float]]:
        """Of the verified errors of every quantity: those that shares of the points do not exceed,
        "0.5" to "1", and bound over error, ``least``, ``median`` and ``largest``; empty for a
        table that does not state them.

        >>> errors = Surrogate.open(1e-7).error_distribution["mu_ratio"]
        >>> errors["0.5"] < errors["0.95"] < errors["0.99"] < errors["1"] < 1e-7
        True
        """
        return error_distribution(self.table)

    @property
    def ball_tolerance(self) -> float:
        """The tolerance of mu~ of a ball that is shaken across [-]."""
        return float(self.table.attributes[f"{BALL_ATTRIBUTES}tolerance"])

    @property
    def ball_error_distribution(self) -> dict[str, dict[str, float]]:
        """The same of a ball that is shaken across, without the border."""
        return error_distribution(self.table, BALL_ATTRIBUTES)

    @property
    def memory(self) -> int:
        """Bytes of the cells that an evaluation of mu~ of one spring reads."""
        data = self._data
        return sum(
            array.nbytes
            for array in (data.border, data.pieces, data.blocks, *data.quantities[atlas.MU])
        )

    def self_check(self) -> None:
        """Compare known answers with the table; raises :class:`TableError` when one is off by more
        than its bound."""
        for v, y, expected in ((0.1, 0.5, KNOWN_STICK_SLIP), (2.0, 1.0, KNOWN_CONTINUOUS)):
            mu, bound, _ = self.ratio_with_bound(v, y)
            if not abs(mu - expected) <= bound + 1e-15:
                raise TableError(
                    self.path,
                    f"known answer at v~={v}, y~={y} is {expected!r}, the table gives {mu!r}",
                )

    # --- dimensionless ----------------------------------------------------------------------------

    def mu_ratio(self, v_tilde: Any, y_tilde: Any) -> Any:
        """mu~ = mu_macro/mu0 [-] of one spring that is shaken across, eq. (15): the fast path.

        Of a ball: ``quantity("mu_ratio", v_tilde, y_tilde, contact="ball")``, with its bound.

        Parameters
        ----------
        v_tilde, y_tilde : float or array_like
            Dimensionless speed [-], >= 0, and amplitude [-], finite and >= 0, broadcast together.

        Returns
        -------
        float or ndarray of float64
            Of the broadcast shape; NaN where a value of an array is out of bounds.

        Raises
        ------
        InputError
            A scalar out of bounds, something that is no real number, shapes that do not broadcast.

        Examples
        --------
        >>> s = Surrogate.open()
        >>> round(s.mu_ratio(0.1, 0.5), 9)
        0.94200429
        """
        if type(v_tilde) is float is type(y_tilde) or (
            type(v_tilde) in NUMBERS and type(y_tilde) in NUMBERS
        ):
            try:
                mu: float = _RATIO(self._pointer, v_tilde, y_tilde)
            except OverflowError:  # a whole number beyond double range
                mu = math.nan
            if mu == mu:
                return mu
        v, y, shape = _flat_groups(v_tilde, y_tilde)
        values = shared_out.alone(atlas.MU, self._data, v, y, self._thread_limit)
        if not shape and math.isnan(values[0]):
            raise _illegal(v, y)
        return _reshape(values, shape)

    def ratio_with_bound(
        self, v_tilde: ArrayLike, y_tilde: ArrayLike, **kind: str
    ) -> tuple[Any, Any, Any]:
        """:meth:`quantity` of mu~: the value, the bound of its absolute error, and the source
        code."""
        return self.quantity("mu_ratio", v_tilde, y_tilde, **kind)

    def v_tilde_crit(
        self, y_tilde: ArrayLike, *, contact: str = "spring", direction: str = "across"
    ) -> Any:
        """Border of continuous sliding v~crit [-], eqs. (21) to (24), at amplitude ``y_tilde`` [-]
        >= 0.

        Infinite for infinite amplitude.  Relative error below ``border.max_rel_error``.  For a ball
        all springs slide from there on; along and normal it is the amplitude itself, for normal
        below 1.

        Examples
        --------
        >>> round(Surrogate.open().v_tilde_crit(1.0), 7)
        0.3251783
        """
        kind = kind_of(contact, direction)
        if type(y_tilde) is float and y_tilde >= 0.0 and kind == SPRING:
            return float(self.border(np.array((y_tilde,)))[0])
        _, y, shape = _flat_groups(0.0, y_tilde)
        crit = _KERNEL.border(self._data, y, kind)
        if not shape and math.isnan(crit[0]):
            raise InputError("y_tilde", float(y[0]), ">= 0 and < 1" if kind.normal else ">= 0")
        return _reshape(crit, shape)

    def power(self, v_tilde: ArrayLike, y_tilde: ArrayLike, **kind: str) -> Any:
        """Mean power of the shaker <y~ cos tau u_y> [-], in units of mu0 Fz l0 omega:
        :meth:`quantity` without bound.

        Slip turns v~ mu~ plus this power into heat.  An infinite amplitude gives infinite power.
        """
        return self.power_with_bound(v_tilde, y_tilde, **kind)[0]

    def stick_fraction(self, v_tilde: ArrayLike, y_tilde: ArrayLike, **kind: str) -> Any:
        """Share of the period during which the contact sticks [-], 0 to 1: :meth:`quantity` without
        bound."""
        return self.stick_fraction_with_bound(v_tilde, y_tilde, **kind)[0]

    def power_with_bound(
        self, v_tilde: ArrayLike, y_tilde: ArrayLike, **kind: str
    ) -> tuple[Any, Any]:
        """:meth:`power` and the bound of its absolute error."""
        return self.quantity("power", v_tilde, y_tilde, **kind)[:2]

    def stick_fraction_with_bound(
        self, v_tilde: ArrayLike, y_tilde: ArrayLike, **kind: str
    ) -> tuple[Any, Any]:
        """:meth:`stick_fraction` and the bound of its absolute error.

        At the border the bound is larger than elsewhere, on both sides: there the fraction is a
        square root of the distance to v~crit, and v~crit is known to some digits only.
        """
        return self.quantity("stick_fraction", v_tilde, y_tilde, **kind)[:2]

    def slopes(
        self, v_tilde: ArrayLike, y_tilde: ArrayLike, of: str = "mu_ratio", *, bounds: bool = False
    ) -> tuple[Any, ...]:
        """The quantity ``of`` a name as in :meth:`quantity`, and its slopes v~ d/d v~ and y~ d/d y~
        [-].

        With ``bounds`` also those of the two slopes' absolute errors.  Arguments, shapes and errors
        as in :meth:`mu_ratio`.

        Examples
        --------
        >>> mu, along_v, along_y = Surrogate.open().slopes(2.0, 0.01)
        >>> f"{along_y:.3e}"     # eq. (31): -y~^2 / (2 (1 + v~^2))
        '-1.000e-05'
        """
        data, (v, y, shape) = self._with(of, "of"), _flat_groups(v_tilde, y_tilde)
        rows = shared_out.slopes(_CODES[of], data, v, y, self._thread_limit)
        if not shape and math.isnan(rows.value[0]):
            raise _illegal(v, y)
        return tuple(_reshape(row, shape) for row in rows[: 5 if bounds else 3])

    def _with(self, quantity: str, argument: str = "name") -> Data:
        """The data that the kernel reads, with the cells of a quantity; made on first use."""
        code = _CODES[quantity] if quantity in atlas.QUANTITY_NAMES else None
        if code not in self._data.quantities:
            if code is None or quantity not in self.table.quantities:
                raise InputError(
                    argument,
                    quantity,
                    f"one of {', '.join(self.table.quantities)}, which the table has",
                )
            self._data.put(code, *quantity_cells(self.table.blocks, code))
        return self._data

    def quantity(
        self,
        name: str,
        v_tilde: ArrayLike,
        y_tilde: ArrayLike,
        *,
        contact: str = "spring",
        direction: str = "across",
    ) -> tuple[Any, Any, Any]:
        """A tabulated quantity, the bound of its absolute error, and the source code (index into
        SOURCES).

        ``name`` is "mu_ratio", "power" or "stick_fraction"; other arguments, shapes and errors as
        in :meth:`mu_ratio`. Of a ball the stick fraction is a share of the load, too.  For
        direction "normal" ``y_tilde`` is Fz_amplitude/Fz [-], below 1; it has no power, because the
        model does not know how far the load moves.

        Examples
        --------
        >>> power, bound, source = Surrogate.open().quantity("power", 0.1, 0.5)
        >>> round(power, 6), bound < 1e-12, int(source)
        (0.012142, True, 5)
        """
        data, kind = self._with(name), kind_of(contact, direction)
        if not kind.direction and type(v_tilde) in NUMBERS and type(y_tilde) in NUMBERS:
            code = _CODES[name]
            if kind.contact:
                data = self._data_of(kind, code)
            try:
                scalar = _SCALAR_KERNEL.value(
                    data,
                    code,
                    v_tilde,  # type: ignore[arg-type]
                    y_tilde,  # type: ignore[arg-type]
                    kind.contact,
                )
                if scalar[2] >= 0:
                    return scalar
            except OverflowError:  # a whole number beyond double range
                pass
        if kind.normal and name == "power":
            raise InputError(
                "direction",
                direction,
                "across or along for the power: the load's path is not modelled",
            )
        v, y, shape = _flat_groups(v_tilde, y_tilde)
        value, bound, source = shared_out.values(
            _CODES[name], self._data_of(kind, _CODES[name]), v, y, self._thread_limit, kind
        )
        if not shape and source[0] == -1:
            finite = "finite and >= 0" if name == "mu_ratio" or kind.direction else ">= 0"
            raise _illegal(v, y, ">= 0 and < 1" if kind.normal else finite)
        return _reshape(value, shape), _reshape(bound, shape), _reshape(source, shape)

    # --- dimensional ------------------------------------------------------------------------------

    @overload
    def evaluate(
        self,
        cases: None = ...,
        /,
        *,
        mu0: float,
        Fz: float,
        k: float | Literal["rigid"],
        y0: float = ...,
        Fz_amplitude: float = ...,
        omega: float = ...,
        f: float = ...,
        v0: float,
        contact: ContactName = ...,
        direction: DirectionName = ...,
        gradient: Literal[True],
        groups: bool = ...,
        illegal: Literal["nan", "raise"] = ...,
    ) -> AnswerWithGradient[float]: ...

    @overload
    def evaluate(
        self,
        cases: None = ...,
        /,
        *,
        mu0: float,
        Fz: float,
        k: float | Literal["rigid"],
        y0: float = ...,
        Fz_amplitude: float = ...,
        omega: float = ...,
        f: float = ...,
        v0: float,
        contact: ContactName = ...,
        direction: DirectionName = ...,
        gradient: Literal[False] = ...,
        groups: bool = ...,
        illegal: Literal["nan", "raise"] = ...,
    ) -> Answer[float]: ...

    @overload
    def evaluate(
        self,
        cases: None = ...,
        /,
        *,
        mu0: float,
        Fz: float,
        k_range: tuple[float, float],
        y0: float = ...,
        Fz_amplitude: float = ...,
        omega: float = ...,
        f: float = ...,
        v0: float,
        contact: ContactName = ...,
        direction: DirectionName = ...,
        gradient: bool = ...,
        groups: bool = ...,
        illegal: Literal["nan", "raise"] = ...,
    ) -> IntervalAnswer[float]: ...

    @overload
    def evaluate(
        self,
        cases: Mapping[str, Any] = ...,
        /,
        *,
        mu0: ArrayLike = ...,
        Fz: ArrayLike = ...,
        k: ArrayLike = ...,
        k_range: ArrayLike = ...,
        k_low: ArrayLike = ...,
        k_high: ArrayLike = ...,
        y0: ArrayLike = ...,
        Fz_amplitude: ArrayLike = ...,
        omega: ArrayLike | None = ...,
        f: ArrayLike | None = ...,
        v0: ArrayLike = ...,
        contact: ContactName = ...,
        direction: DirectionName = ...,
        gradient: Literal[True],
        groups: bool = ...,
        illegal: Literal["nan", "raise"] = ...,
    ) -> AnswerWithGradient[Array]: ...

    @overload
    def evaluate(
        self,
        cases: Mapping[str, Any] = ...,
        /,
        *,
        mu0: ArrayLike = ...,
        Fz: ArrayLike = ...,
        k: ArrayLike = ...,
        k_range: ArrayLike = ...,
        k_low: ArrayLike = ...,
        k_high: ArrayLike = ...,
        y0: ArrayLike = ...,
        Fz_amplitude: ArrayLike = ...,
        omega: ArrayLike | None = ...,
        f: ArrayLike | None = ...,
        v0: ArrayLike = ...,
        contact: ContactName = ...,
        direction: DirectionName = ...,
        gradient: Literal[False] = ...,
        groups: bool = ...,
        illegal: Literal["nan", "raise"] = ...,
    ) -> Answer[Array]: ...

    @overload
    def evaluate(
        self,
        cases: Any = ...,
        /,
        *,
        mu0: Any = ...,
        Fz: Any = ...,
        k: Any = ...,
        k_range: Any = ...,
        k_low: Any = ...,
        k_high: Any = ...,
        y0: Any = ...,
        Fz_amplitude: Any = ...,
        omega: Any = ...,
        f: Any = ...,
        v0: Any = ...,
        contact: str = ...,
        direction: str = ...,
        gradient: bool = ...,
        groups: bool = ...,
        illegal: str = ...,
    ) -> Any: ...

    def evaluate(
        self,
        cases: Any = None,
        /,
        *,
        mu0: Any = ABSENT,
        Fz: Any = ABSENT,
        k: Any = ABSENT,
        k_range: Any = ABSENT,
        k_low: Any = ABSENT,
        k_high: Any = ABSENT,
        y0: Any = ABSENT,
        Fz_amplitude: Any = ABSENT,
        omega: Any = ABSENT,
        f: Any = ABSENT,
        v0: Any = ABSENT,
        contact: str = "spring",
        direction: str = "across",
        gradient: bool = False,
        groups: bool = False,
        illegal: str = "nan",
        **unknown: Any,
    ) -> Any:
        """Macroscopic friction from dimensional inputs, scalars or arrays that broadcast together.

        Parameters
        ----------
        cases : mapping, DataFrame (pandas, Dask, Polars), pyarrow.Table or xarray.Dataset, optional
            The inputs by name, in place of keywords or beside them; other columns are ignored.
        mu0 : array_like
            Coulomb friction coefficient [-], > 0.
        Fz : array_like
            Normal force [N], > 0.
        k : array_like or "rigid"
            Tangential stiffness [N/m], > 0; "rigid" or infinity is rigid contact, eq. (37).  It
            must always be given, here or as an interval: None is refused.
        k_range : pair of array_like
            Lowest and highest stiffness [N/m] in place of k.
        k_low, k_high : array_like
            The same as two columns.
        y0 : array_like
            Amplitude of the oscillation [m], half of peak to peak, >= 0, across or along the
            sliding direction.
        Fz_amplitude : array_like
            Amplitude of the normal force [N], >= 0 and below Fz, in place of y0 where the direction
            is "normal".
        omega : array_like
            Angular frequency [rad/s], >= 0; or
        f : array_like
            frequency [Hz], >= 0, in its place.
        v0 : array_like
            Sliding speed [m/s], >= 0.
        contact : str
            "spring", one spring; or "ball", a sphere on a flat (Hertz) whose stiffness before slip
            is k = 8 a G*.
        direction : str
            "across" the sliding direction; "along" it, y0 is the amplitude there; or "normal": the
            force is Fz + Fz_amplitude cos(omega t), for a spring only.
        gradient : bool
            Also differentiate with respect to every input, with bounds.
        groups : bool
            Also keep v~, y~ and l0 of arrays, which takes a quarter of the time again; scalars and
            gradients have them.
        illegal : str
            Effect of an illegal value in an array: "nan" gives NaN and the source -1 for its case,
            "raise" raises.
        **unknown
            Other names are refused.

        Returns
        -------
        Answer
            With ``mu_macro_low`` and ``mu_macro_high`` for an interval of k.  Or the container of
            the inputs: pandas objects give a DataFrame, xarray objects a Dataset, Dask stays lazy
            (:mod:`mumacro.frames`).

        Raises
        ------
        InputError
            A scalar out of bounds; an input that is missing, unknown, given twice or not a number;
            shapes that do not broadcast.

        Notes
        -----
        y0 = 0 or omega = 0 gives mu0.  v0 = 0 with y0, omega > 0 gives the static limit, eq. (16).

        Examples
        --------
        >>> s = Surrogate.open()
        >>> a = s.evaluate(mu0=0.3, Fz=10, k=1e6, y0=[0.0, 2e-6, -1.0], f=20e3, v0=0.01)
        >>> a.source_code.tolist()
        [13, 5, -1]
        >>> case = dict(mu0=0.3, Fz=10, y0=2e-6, f=20e3, v0=0.01)
        >>> s.evaluate(k=1e6, contact="ball", **case).regime
        'partial_slip'
        >>> a = s.evaluate(k_range=(0.8e6, 1.2e6), **case)
        >>> a.mu_macro_low < a.mu_macro < a.mu_macro_high
        True
        """
        inputs: dict[str, Any] = {}
        if (
            cases is None
            and k_range is k_low is k_high is Fz_amplitude is ABSENT
            and (f is ABSENT or omega is ABSENT)
            and contact in ("spring", "ball")
            and direction == "across"
            and illegal in ILLEGAL
            and not unknown
        ):
            # Contacts across in plain numbers and arrays take this short way, which saves most of
            # the time of a call.  Illegal inputs go the long way, which has the messages.
            short = SPRING if contact == "spring" else BALL
            rate, rate_name = (omega, "omega") if f is ABSENT else (f, "f")
            types = {*map(type, (mu0, Fz, k, y0, rate, v0))}
            if types <= NUMBERS:
                with suppress(OverflowError):  # a whole number beyond double range
                    angular = omega if f is ABSENT else RAD_PER_CYCLE * float(f)
                    answer = self._scalar_answer((mu0, Fz, k, y0, angular, v0), gradient, short)
                    if answer.source_code >= 0:
                        return answer
            elif types <= NUMBERS_AND_ARRAYS:
                inputs = {"mu0": mu0, "Fz": Fz, "k": k, "y0": y0, rate_name: rate, "v0": v0}
        kind = kind_of(contact, direction)
        if illegal not in ILLEGAL:
            raise InputError("illegal", illegal, '"nan" or "raise"')
        if unknown:
            name = min(unknown)
            raise InputError(name, unknown[name], f"one of {', '.join(kind.fields)} or f")
        if not inputs:
            keywords = {
                "mu0": mu0,
                "Fz": Fz,
                "k": k,
                "k_range": k_range,
                "k_low": k_low,
                "k_high": k_high,
                "y0": y0,
                "Fz_amplitude": Fz_amplitude,
                "omega": omega,
                "f": f,
                "v0": v0,
            }
            inputs = by_name(
                cases, {name: x for name, x in keywords.items() if x is not ABSENT}, kind
            )
            if has_labels(cases, inputs):
                options = {"gradient": gradient, "groups": groups, "illegal": illegal, **kind.names}
                return evaluate_labelled(
                    self.evaluate,
                    self.on_one_thread().evaluate,
                    functools.partial(self._certain, kind=kind),
                    cases,
                    inputs,
                    kind,
                    "k_low" in inputs,
                    options,
                )
        return self.answer(Cases.of(inputs, kind, illegal == "raise"), gradient, groups)

    def answer(self, cases: Cases, gradient: bool = False, groups: bool = False) -> Answer[Any]:
        """:meth:`evaluate` of cases in their one form."""
        kind, columns, shape = cases.kind, cases.columns, cases.shape or (1,)
        if not cases.shape and not kind.direction and cases.ends is None:
            return self._scalar_answer([*columns.values()], gradient, kind)
        groups = groups or gradient or not cases.shape
        detail: Detail = "gradient" if gradient else "groups" if groups else "values"
        six, data = [*columns.values()], self._data_of(kind)
        rows = shared_out.cases(data, six, shape, self._thread_limit, detail, kind)
        answer: Answer[Any]
        if cases.ends is not None:
            low, high = cases.ends
            six = [*{**columns, "k": low}.values()]
            extremes = shared_out.intervals(data, six, high, self._thread_limit, kind)
            answer = IntervalAnswer(
                rows.mu_macro,
                rows.mu_ratio,
                np.maximum(rows.error_bound, extremes.error_bound.reshape(shape)),
                rows.source,
            )
            answer.mu_macro_low = np.minimum(rows.mu_macro, extremes.low.reshape(shape))
            answer.mu_macro_high = np.maximum(rows.mu_macro, extremes.high.reshape(shape))
        else:
            answer = (AnswerWithGradient if gradient else Answer)(
                rows.mu_macro, rows.mu_ratio, rows.error_bound, rows.source
            )
        if groups:
            answer._groups = rows.v_tilde, rows.y_tilde, rows.length_scale
            answer._certain = (
                self._certain if kind == SPRING else functools.partial(self._certain, kind=kind)
            )
            answer._border = functools.partial(self.v_tilde_crit, **kind.names)
        if gradient:
            answer.gradient = dict(zip(kind.fields, rows.gradient, strict=True))
            answer.gradient_bound = dict(zip(kind.fields, rows.gradient_bound, strict=True))
        return answer if cases.shape else single(answer)

    def _scalar_answer(
        self, six: Sequence[Any], gradient: bool, kind: Kind = SPRING
    ) -> Answer[float]:
        """The answer to one case across; NaN where it is illegal."""
        certain, border, pointer = self._certain, self.v_tilde_crit, self._pointer
        if kind.contact:
            certain = functools.partial(self._certain, kind=kind)
            border = functools.partial(self.v_tilde_crit, **kind.names)
            pointer = self._data_of(kind).pointer
        row = _SCALAR_KERNEL.one(pointer, six, gradient, kind.contact)
        groups = (row.v_tilde, row.y_tilde, row.length_scale)
        answer: Answer[float] = (AnswerWithGradient if gradient else Answer)(
            row.mu_macro, row.mu_ratio, row.error_bound, row.source, groups, certain
        )
        answer._border = border
        if gradient:
            answer.gradient = dict(zip(FIELDS, row.gradient, strict=True))
            answer.gradient_bound = dict(zip(FIELDS, row.gradient_bound, strict=True))
        return answer

    def evaluate_case(
        self, mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float
    ) -> tuple[float, float, float, int]:
        """(mu_macro, mu~, bound of mu_macro, source code) of one case in plain floats; NaN and -1
        if illegal."""
        row = _SCALAR_KERNEL.one(self._pointer, (mu0, Fz, k, y0, omega, v0), False)
        return row.mu_macro, row.mu_ratio, row.error_bound, row.source

    def cells(self, name: str, kind: Kind = SPRING) -> Data:
        """What the kernel reads of a quantity of a kind, for callers of the kernel itself."""
        return self._data_of(kind, _CODES[name]) if kind.contact else self._with(name)

    def _data_of(self, kind: Kind, quantity: int = atlas.MU) -> Data:
        """What the kernel reads of a kind; cells are cut on first use."""
        if kind != BALL:
            if kind.contact:
                put_driven(self._data)
            return self._data
        data = self._ball
        if data is None:
            rows = block_rows(self.table.ball, atlas.BALL_CHARTS)
            data = self._ball = Data(*self.border.arrays, rows, outer_cells())
        if quantity not in data.quantities:
            cells = quantity_cells(self.table.ball, quantity, atlas.BALL_CHARTS)
            data.put(quantity, *cells)
        return data

    def _certain(self, v_tilde: Any, y_tilde: Any, kind: Kind = SPRING) -> Any:
        """Whether v~ is further from v~crit than the error of v~crit and the rounding of v~ and y~
        together."""
        v, y = np.asarray(v_tilde), np.asarray(y_tilde)
        crit = _KERNEL.border(
            self._data, np.atleast_1d(np.asarray(y, dtype=np.float64)), kind
        ).reshape(y.shape)
        margin = self.border.max_rel_error + 4.0 * atlas.ROUNDING
        with np.errstate(all="ignore"):
            # groups beyond double range are not near the border, or it cannot be decided
            extreme = (y == 0.0) | ~np.isfinite(y) | ~np.isfinite(v) | (v == 0.0)
            certain = np.where(extreme, ~np.isnan(v), np.abs(v - crit) > margin * crit)
        return certain if certain.ndim else bool(certain)


# mu~ at (v~, y~) = (0.1, 0.5) and (2, 1), from the full model to all digits
# (tests/mumacro/test_surrogate.py solves them anew)
KNOWN_STICK_SLIP = 0.9420042895137095
KNOWN_CONTINUOUS = 0.9545954718694023


def _check_border(pieces: Sequence[BorderPiece], path: Path) -> None:
    """Refuse a stored border whose nodes are not near the formula for every y~, since it selects
    the block of a case."""
    for index, ((name, axis, _), piece) in enumerate(zip(atlas.BORDER_PIECES, pieces, strict=True)):
        y = axis.amplitude(piece.nodes)
        crit = piece.values * _KERNEL.border_scales(index, y)[0]
        if not np.all(np.abs(crit / closed_forms.border_blend(y) - 1.0) < 0.01):
            raise TableError(path, f"the nodes of border/{name} are not v~crit(y~)")


def _bundled_table(tolerance: float | None) -> Path:
    """The tightest bundled table, or the smallest that meets ``tolerance``."""
    tables = {float(path.stem.removeprefix("mumacro-")): path for path in bundled_tables()}
    if not tables:
        raise TableError("mumacro-*.nc", "no table is bundled with this installation; name a file")
    if tolerance is None:
        return tables[min(tables)]
    if (
        isinstance(tolerance, bool)
        or not isinstance(tolerance, (int, float))
        or not tolerance > 0.0
    ):
        raise InputError("tolerance", tolerance, "a path, a tolerance > 0, or None")
    sufficient = [candidate for candidate in tables if candidate <= tolerance]
    if not sufficient:
        raise InputError(
            "tolerance",
            tolerance,
            f">= {min(tables):g}, the tightest bundled table, or the path of another",
        )
    return tables[max(sufficient)]


@functools.cache  # a worker gets the same surrogate with every task
def _reopen(path: str, checksum: str, threads: int | None, image: bytes | None) -> Surrogate:
    """Unpickle: from the bytes, or from the bundled table of that name."""
    if image is not None:
        return Surrogate._of_image(image, Path(path), threads)
    surrogate = Surrogate.open(
        next((table for table in bundled_tables() if table.name == path), path), threads
    )
    if surrogate.checksum != checksum:
        mismatch = (
            f"holds {surrogate.checksum[:12]}, the pickled surrogate was made from {checksum[:12]}"
        )
        raise TableError(surrogate.path, f"{mismatch}: install the same release on both sides")
    return surrogate


def _illegal(v: Array, y: Array, bound: str = "finite and >= 0") -> InputError:
    """The error of a single point; ``bound`` is that of y~."""
    return (
        InputError("y_tilde", float(y[0]), bound)
        if v[0] >= 0.0
        else InputError("v_tilde", float(v[0]), ">= 0")
    )


def _reshape(values: NDArray[Any], shape: tuple[int, ...]) -> Any:
    return values.reshape(shape) if shape else values[0].item()


def _flat_groups(v_tilde: Any, y_tilde: Any) -> tuple[Array, Array, tuple[int, ...]]:
    """Both broadcast together, flat and contiguous, and their shape."""
    if type(v_tilde) is np.ndarray is type(y_tilde) and v_tilde.dtype == y_tilde.dtype == _FLOAT:
        v, y = v_tilde, y_tilde
    else:
        v, y = real("v_tilde", v_tilde), real("y_tilde", y_tilde)
    try:
        shape = common_shape((v, y))
    except ValueError as error:
        raise InputError(
            "y_tilde", y.shape, f"of a shape that broadcasts with that of v_tilde, {v.shape}"
        ) from error
    return flat(v, shape), flat(y, shape), shape

"""The surrogate for users.  Value, regime, source, gradient, power and stick fraction, each with
its bound."""

import functools
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NoReturn, Self, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mumacro import closed_forms, plotting
from mumacro.answer import Answer, AnswerWithGradient, IntervalAnswer, single
from mumacro.contacts.quadrature import put_rules
from mumacro.errors import InputError, MumacroError, TableError
from mumacro.frames import evaluate_labelled
from mumacro.inputs.fields import (
    FIELDS,
    RAD_PER_CYCLE,
    as_columns,
    check_inputs,
    length_scale,
    picked,
    real,
)
from mumacro.inputs.k_range import ENDS, as_ends, middle
from mumacro.inputs.kind import (
    AMPLITUDE,
    SPRING,
    ContactName,
    DirectionName,
    Kind,
    kind_of,
)
from mumacro.kernel import slices
from mumacro.kernel.arrays import Array
from mumacro.kernel.binding import Data, kernels
from mumacro.kernel.threads import default_threads
from mumacro.table import atlas
from mumacro.table.blocks import BorderPiece, Table
from mumacro.table.bundled import bundled_tables
from mumacro.table.netcdf import error_distribution, json_attributes, parse_table, read_image
from mumacro.table.polynomials import Border, block_rows, outer_cells, quantity_cells

_KERNEL = kernels[-1]
_ONE = kernels[:2][-1]  # a single point does not fill the widest registers; the bits are the same
_RATIO = _ONE.ratio
_CODES = {name: code for code, name in enumerate(atlas.QUANTITY_NAMES)}
#: types of one real number, which take the short way
_NUMBERS = frozenset(
    (float, int, bool, np.bool_, *(np.dtype(kind).type for kind in "efdbhilqBHILQ"))
)
_NUMBERS_OR_ARRAY, _FLOAT = _NUMBERS | {np.ndarray}, np.dtype(np.float64)


class Surrogate:
    """mu~(v~, y~) from one table; open it once, share it between threads and processes.

    One policy for all methods: a scalar that is out of bounds raises :class:`InputError`; in an
    array it gives NaN, with the source code -1.  What is no real number raises in either case.

    Examples
    --------
    >>> s = Surrogate.open()
    >>> answer = s.evaluate(mu0=0.3, Fz=10, k=1e6, y0=2e-6, omega=1.3e5, v0=0.01)
    >>> round(answer.mu_macro, 6), answer.regime
    (0.240012, 'stick_slip')
    """

    def __init__(self, table: Table, path: str | Path, threads: int | None = None) -> None:
        if threads is not None and not (type(threads) is int and 1 <= threads <= 1024):
            raise InputError("threads", threads, "None or a whole number from 1 to 1024")
        self._asked_threads = threads
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
        path = Path(table) if isinstance(table, (str, Path)) else _bundled(table)
        return cls._of_image(read_image(path), path, threads)

    @classmethod
    def _of_image(cls, image: bytes, path: Path, threads: int | None) -> Self:
        found = cls(parse_table(image, path), path, threads)
        found._image = image
        return found

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle small: a bundled table by name and checksum, valid on another machine, too;
        another with its bytes."""
        bundled = self.path.resolve() in (path.resolve() for path in bundled_tables())
        path, image = (
            (self.path.name, None)
            if bundled
            else (str(self.path), self._image or read_image(self.path))
        )
        return _reopen, (path, self.checksum, self._asked_threads, image)

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
        v = np.geomspace(*plotting.V_RANGE, 281)
        y = np.geomspace(*plotting.y_range(kind.normal), 201)
        ratio = self.quantity("mu_ratio", v, y[:, None], **kind.names)[0]
        border = self.v_tilde_crit(y, **kind.names)
        return plotting.plot_map(v, y, ratio, border, axes, point=point, normal=kind.normal)

    def on_one_thread(self) -> Self:
        """The same table, whose calls start no thread."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__, _asked_threads=1)
        return other

    @property
    def threads(self) -> int:
        """Threads that a call from here divides a large array among."""
        return default_threads() if self._asked_threads is None else self._asked_threads

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

        >>> found = Surrogate.open(1e-7).error_distribution["mu_ratio"]
        >>> found["0.5"] < found["0.95"] < found["0.99"] < found["1"] < 1e-7
        True
        """
        return error_distribution(self.table)

    @property
    def memory(self) -> int:
        """Bytes of the cells that an evaluation of mu~ reads."""
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
        """mu~ = mu_macro/mu0 [-], eq. (15): the fast path.

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
            type(v_tilde) in _NUMBERS and type(y_tilde) in _NUMBERS
        ):
            try:
                mu: float = _RATIO(self._pointer, v_tilde, y_tilde)
            except OverflowError:  # a whole number beyond double range
                mu = math.nan
            if mu == mu:
                return mu
        v, y, shape = _points(v_tilde, y_tilde)
        found = slices.alone(atlas.MU, self._data, v, y, self.threads)
        if not shape and math.isnan(found[0]):
            raise _illegal(v, y)
        return _shaped(found, shape)

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
        _, y, shape = _points(0.0, y_tilde)
        found = _KERNEL.border(self._data, y, kind)
        if not shape and math.isnan(found[0]):
            raise InputError("y_tilde", float(y[0]), ">= 0 and < 1" if kind.normal else ">= 0")
        return _shaped(found, shape)

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
        data, (v, y, shape) = self._with(of, "of"), _points(v_tilde, y_tilde)
        rows = slices.slopes(_CODES[of], data, v, y, self.threads)
        if not shape and math.isnan(rows[0, 0]):
            raise _illegal(v, y)
        return tuple(_shaped(row, shape) for row in rows[: 5 if bounds else 3])

    def _with(self, quantity: str, argument: str = "name") -> Data:
        """What the kernel reads, with the cells of a quantity; they are cut on first use."""
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

    def derivatives(self, *_: object, **__: object) -> NoReturn:
        """Gone; the error names what replaces it."""
        raise MumacroError(
            "Surrogate.derivatives is gone: slopes(v_tilde, y_tilde, of) gives v~ d/dv~ and y~ "
            "d/dy~, evaluate(..., gradient=True) the slopes by the six inputs"
        )

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
        if kind == SPRING and type(v_tilde) in _NUMBERS and type(y_tilde) in _NUMBERS:
            try:
                one = _ONE.value(data, _CODES[name], v_tilde, y_tilde)  # type: ignore[arg-type]
                if one[2] >= 0:
                    return one
            except OverflowError:  # a whole number beyond double range
                pass
        if kind.normal and name == "power":
            raise InputError(
                "direction",
                direction,
                "across or along for the power: the load's path is not modelled",
            )
        v, y, shape = _points(v_tilde, y_tilde)
        value, bound, source = slices.values(
            _CODES[name], self._data_of(kind), v, y, self.threads, kind
        )
        if not shape and source[0] == -1:
            finite = "finite and >= 0" if name == "mu_ratio" or kind.direction else ">= 0"
            raise _illegal(v, y, ">= 0 and < 1" if kind.normal else finite)
        return _shaped(value, shape), _shaped(bound, shape), _shaped(source, shape)

    # --- dimensional ------------------------------------------------------------------------------

    @overload
    def evaluate(
        self,
        *,
        mu0: float,
        Fz: float,
        k: float | Literal["rigid"],
        y0: float,
        v0: float,
        omega: float = ...,
        f: float = ...,
        gradient: Literal[True],
        groups: bool = ...,
        illegal: str = ...,
        contact: ContactName = ...,
        direction: DirectionName = ...,
    ) -> AnswerWithGradient[float]: ...

    @overload
    def evaluate(
        self,
        *,
        mu0: float,
        Fz: float,
        k: float | Literal["rigid"],
        y0: float,
        v0: float,
        omega: float = ...,
        f: float = ...,
        gradient: Literal[False] = ...,
        groups: bool = ...,
        illegal: str = ...,
        contact: ContactName = ...,
        direction: DirectionName = ...,
    ) -> Answer[float]: ...

    @overload
    def evaluate(
        self,
        *,
        mu0: float,
        Fz: float,
        k_range: tuple[float, float],
        y0: float,
        v0: float,
        omega: float = ...,
        f: float = ...,
        gradient: bool = ...,
        groups: bool = ...,
        illegal: str = ...,
        contact: ContactName = ...,
        direction: DirectionName = ...,
    ) -> IntervalAnswer[float]: ...

    @overload
    def evaluate(
        self,
        cases: Mapping[str, Any] = ...,
        /,
        *,
        gradient: Literal[True],
        groups: bool = ...,
        illegal: str = ...,
        contact: ContactName = ...,
        direction: DirectionName = ...,
        **inputs: ArrayLike | None,
    ) -> AnswerWithGradient[Array]: ...

    @overload
    def evaluate(
        self,
        cases: Mapping[str, Any] = ...,
        /,
        *,
        gradient: Literal[False] = ...,
        groups: bool = ...,
        illegal: str = ...,
        contact: ContactName = ...,
        direction: DirectionName = ...,
        **inputs: ArrayLike | None,
    ) -> Answer[Array]: ...

    @overload
    def evaluate(
        self,
        cases: Any = ...,
        /,
        *,
        gradient: bool = ...,
        groups: bool = ...,
        illegal: str = ...,
        contact: ContactName = ...,
        direction: DirectionName = ...,
        **inputs: Any,
    ) -> Any: ...

    def evaluate(  # type: ignore[misc]  # mypy does not match named inputs with **inputs
        self,
        cases: Any = None,
        /,
        *,
        gradient: bool = False,
        groups: bool = False,
        illegal: str = "nan",
        contact: str = "spring",
        direction: str = "across",
        **inputs: Any,
    ) -> Any:
        """Macroscopic friction from dimensional inputs, scalars or arrays that broadcast together.

        Parameters
        ----------
        cases : mapping, DataFrame (pandas, Dask, Polars), pyarrow.Table or xarray.Dataset, optional
            The inputs by name, in place of keywords; other columns are ignored.
        mu0 : array_like
            Coulomb friction coefficient [-], > 0.
        Fz : array_like
            Normal force [N], > 0.
        k : array_like
            Tangential stiffness [N/m], > 0; "rigid" or infinity is rigid contact, eq. (37).  It
            must always be given.
        y0 : array_like
            Amplitude of the transverse oscillation [m], >= 0.
        omega : array_like
            Angular frequency [rad/s], >= 0; or
        f : array_like
            frequency [Hz], >= 0, in its place.
        v0 : array_like
            Sliding speed [m/s], >= 0.
        gradient : bool
            Also differentiate with respect to every input, with bounds.
        groups : bool
            Also keep v~, y~ and l0 of arrays, which takes a quarter of the time again; scalars and
            gradients have them.
        illegal : str
            Effect of an illegal value in an array: "nan" gives NaN and the source -1 for its case,
            "raise" raises.
        contact : str
            "spring", one spring; or "ball", a sphere on a flat (Hertz) whose stiffness before slip
            is k = 8 a G*.
        direction : str
            "across" the sliding direction; "along" it, y0 is the amplitude there; or "normal": the
            force is Fz + Fz_amplitude cos(omega t), for a spring only.
        Fz_amplitude : array_like
            Amplitude of the normal force [N], >= 0 and below Fz, in place of y0 where the direction
            is "normal".
        k_range : pair of array_like
            Lowest and highest stiffness [N/m] in place of k; or two columns, ``k_low`` and
            ``k_high``.

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
        if contact != "spring" or direction != "across":
            return self._evaluate(
                cases, inputs, gradient, groups, illegal, kind_of(contact, direction)
            )
        six = _six(inputs) if cases is None and len(inputs) == 6 else None
        if six is not None and illegal in ("nan", "raise"):
            kinds = set(map(type, six))
            if kinds <= _NUMBERS:
                answer: Any = self._one(six, gradient)
                if answer is not None:
                    return answer
            elif illegal == "nan" and kinds <= _NUMBERS_OR_ARRAY:
                arrays = [x for x in six if type(x) is np.ndarray]
                if (
                    len({x.shape for x in arrays}) == 1
                    and arrays[0].ndim
                    and {x.dtype for x in arrays} == {_FLOAT}
                ):
                    return self._arrays(six, arrays[0].shape, gradient, gradient or groups)
        return self._evaluate(cases, inputs, gradient, groups, illegal)

    def _one(self, six: tuple[float, ...], gradient: bool) -> Answer[float] | None:
        """The answer to one case; None where it is illegal."""
        try:
            found = _ONE.one(self._pointer, six, 19 if gradient else 7)
        except OverflowError:  # a whole number beyond double range
            return None
        if found[6] < 0.0:
            return None
        kind: type[Answer[float]] = AnswerWithGradient if gradient else Answer
        answer = kind(
            found[0],
            found[1],
            found[2],
            int(found[6]),
            (found[3], found[4], found[5]),
            self._certain,
        )
        if gradient:
            answer.gradient = dict(zip(FIELDS, found[7:13], strict=True))
            answer.gradient_bound = dict(zip(FIELDS, found[13:], strict=True))
        return answer

    def evaluate_case(
        self, mu0: float, Fz: float, k: float, y0: float, omega: float, v0: float
    ) -> tuple[float, float, float, int]:
        """(mu_macro, mu~, bound of mu_macro, source code) of one case in plain floats; NaN and -1
        if illegal."""
        mu_macro, mu_ratio, bound, _, _, _, source = _ONE.one(
            self._pointer, (mu0, Fz, k, y0, omega, v0), 7
        )
        return mu_macro, mu_ratio, bound, int(source)

    def _evaluate(
        self,
        cases: Any,
        inputs: dict[str, Any],
        gradient: bool,
        groups: bool,
        illegal: str,
        kind: Kind = SPRING,
    ) -> Any:
        if illegal not in ("nan", "raise"):
            raise InputError("illegal", illegal, '"nan" or "raise"')
        unknown = inputs.keys() - {*FIELDS, "f", AMPLITUDE, "k_range", *ENDS}
        if unknown:
            raise InputError(
                min(unknown), inputs[min(unknown)], f"one of {', '.join(kind.fields)} or f"
            )
        if cases is not None:
            found = picked("cases", cases, (*kind.columns, *ENDS))
            if twice := found.keys() & inputs.keys():
                raise InputError(
                    min(twice), inputs[min(twice)], "given once: in the cases or as a keyword"
                )
            inputs = {**found, **inputs}
        inputs = kind.as_six({name: _from_arrow(x) for name, x in inputs.items()})
        interval = not inputs.keys().isdisjoint(("k_range", *ENDS))
        if interval:
            inputs = as_ends(inputs)
        if _labelled(inputs, cases):
            options = {"gradient": gradient, "groups": groups, "illegal": illegal, **kind.names}
            return evaluate_labelled(
                self.evaluate,
                self.on_one_thread().evaluate,
                functools.partial(self._certain, kind=kind),
                cases,
                kind.as_given(inputs),
                kind,
                interval,
                options,
            )
        try:
            return self._plain(inputs, gradient, groups, illegal, kind, interval)
        except InputError as error:
            raise kind.refused(error) from error.__cause__

    def _plain(
        self,
        inputs: dict[str, Any],
        gradient: bool,
        groups: bool,
        illegal: str,
        kind: Kind,
        interval: bool,
    ) -> Answer[Any]:
        """The answer to inputs without labels, the amplitude by the name y0."""
        ends = None
        if interval:
            *ends, between = middle(inputs, illegal)
            inputs = {name: x for name, x in inputs.items() if name not in ENDS} | {"k": between}
        columns = as_columns(inputs)
        try:
            shape = _common_shape([*columns.values()])
        except ValueError as error:
            shapes = {name: column.shape for name, column in columns.items()}
            raise InputError("inputs", shapes, "arrays whose shapes broadcast together") from error
        if not shape or illegal == "raise":
            check_inputs(columns, inputs.get("f"))
            if kind.normal:
                kind.check_lift_off(columns["y0"], columns["Fz"])
        if not shape and kind == SPRING and ends is None:
            one: Any = self._one(tuple(float(column) for column in columns.values()), gradient)
            return one  # type: ignore[no-any-return]  # legal, so it is no None
        answer = self._arrays(
            [*columns.values()], shape or (1,), gradient, gradient or groups or not shape, kind
        )
        if ends is not None:
            answer = self._with_extremes(answer, columns, ends, kind)
        return answer if shape else single(answer)

    def _arrays(
        self,
        columns: Sequence[Any],
        shape: tuple[int, ...],
        gradient: bool,
        groups: bool,
        kind: Kind = SPRING,
    ) -> Answer[Array]:
        found, source = slices.cases(
            self._data_of(kind),
            [_flat_or_one(column, shape) for column in columns],
            math.prod(shape),
            self.threads,
            17 if gradient else 5 if groups else 3,
            kind,
        )
        rows = found.reshape(len(found), *shape)
        answer: Answer[Array] = (AnswerWithGradient if gradient else Answer)(
            rows[0], rows[1], rows[2], source.reshape(shape)
        )
        if groups:
            length = np.where(answer.source_code == -1, np.nan, length_scale(*columns[:3]))
            answer._groups = rows[3], rows[4], length
            answer._certain = (
                self._certain if kind == SPRING else functools.partial(self._certain, kind=kind)
            )
        if gradient:
            answer.gradient = dict(zip(kind.fields, rows[5:11], strict=True))
            answer.gradient_bound = dict(zip(kind.fields, rows[11:], strict=True))
        return answer

    def _with_extremes(
        self, answer: Answer[Array], columns: dict[str, Array], ends: Sequence[Array], kind: Kind
    ) -> IntervalAnswer[Array]:
        """``answer`` for the middle of an interval of k, and the extremes over it."""
        shape = answer.mu_macro.shape
        first, last = ends
        low, high, bound = slices.intervals(
            self._data_of(kind),
            [_flat_or_one(column, shape) for column in {**columns, "k": first}.values()],
            _flat(last, shape),
            self.threads,
            kind,
        )
        out: IntervalAnswer[Array] = IntervalAnswer(
            answer.mu_macro,
            answer.mu_ratio,
            np.maximum(answer.error_bound, bound.reshape(shape)),
            answer.source_code,
            answer._groups,
            answer._certain,
        )
        if answer.gradient is not None and answer.gradient_bound is not None:
            out.gradient, out.gradient_bound = answer.gradient, answer.gradient_bound
        legal = answer.source_code != -1
        out.mu_macro_low = np.where(legal, np.minimum(low.reshape(shape), answer.mu_macro), np.nan)
        out.mu_macro_high = np.where(
            legal, np.maximum(high.reshape(shape), answer.mu_macro), np.nan
        )
        return out

    def _data_of(self, kind: Kind) -> Data:
        """What the kernel reads; a ball needs rules of quadrature."""
        if kind.contact:
            put_rules(self._data, self.tolerance)
        return self._data

    def _certain(self, v_tilde: Any, y_tilde: Any, kind: Kind = SPRING) -> Any:
        """Whether v~ is further from v~crit than that is known, and than rounding may move v~ and
        y~."""
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
# (tests/test_surrogate.py solves them anew)
KNOWN_STICK_SLIP = 0.9420042895137095
KNOWN_CONTINUOUS = 0.9545954718694023


def _check_border(pieces: Sequence[BorderPiece], path: Path) -> None:
    """Refuse a stored border whose nodes are not near the formula for every y~: blocks are found
    with it."""
    for index, ((name, axis, _), piece) in enumerate(zip(atlas.BORDER_PIECES, pieces, strict=True)):
        y = axis.amplitude(piece.nodes)
        crit = piece.values * _KERNEL.border_scales(index, y)[0]
        if not np.all(np.abs(crit / closed_forms.border_blend(y) - 1.0) < 0.01):
            raise TableError(path, f"the nodes of border/{name} are not v~crit(y~)")


def _bundled(tolerance: float | None) -> Path:
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
    fit = [found for found in tables if found <= tolerance]
    if not fit:
        raise InputError(
            "tolerance",
            tolerance,
            f">= {min(tables):g}, the tightest bundled table, or the path of another",
        )
    return tables[max(fit)]


@functools.cache  # a worker gets the same surrogate with every task
def _reopen(path: str, checksum: str, threads: int | None, image: bytes | None) -> Surrogate:
    """Unpickle: from the bytes, or from the bundled table of that name."""
    if image is not None:
        return Surrogate._of_image(image, Path(path), threads)
    found = Surrogate.open(
        next((table for table in bundled_tables() if table.name == path), path), threads
    )
    if found.checksum != checksum:
        told = f"holds {found.checksum[:12]}, the pickled surrogate was made from {checksum[:12]}"
        raise TableError(found.path, f"{told}: install the same release on both sides")
    return found


def _six(inputs: Mapping[str, Any]) -> tuple[Any, ...] | None:
    """The six inputs by name, omega from f; None where one of them is missing."""
    try:
        return (
            inputs["mu0"],
            inputs["Fz"],
            inputs["k"],
            inputs["y0"],
            inputs["omega"] if "omega" in inputs else inputs["f"] * RAD_PER_CYCLE,
            inputs["v0"],
        )
    except (KeyError, TypeError, OverflowError):
        return None


_PLAIN = _NUMBERS | {np.ndarray, list, tuple, type(None), dict}


def _labelled(inputs: Mapping[str, Any], cases: Any) -> bool:
    """Whether labels or chunks are to be kept."""
    return any(_labels(x) for x in (cases, *inputs.values()) if type(x) not in _PLAIN)


def _labels(x: Any) -> bool:
    return type(x).__module__.partition(".")[0] in ("pandas", "xarray", "dask")


def _from_arrow(x: Any) -> Any:
    """A column of Arrow, Polars or another library with Arrow's interface as an array, NaN where it
    is null."""
    arrow = hasattr(type(x), "__arrow_c_stream__") or hasattr(type(x), "__arrow_c_array__")
    return np.asarray(x) if arrow and not _labels(x) else x


def _illegal(v: Array, y: Array, bound: str = "finite and >= 0") -> InputError:
    """The error of a single point; ``bound`` is that of y~."""
    return (
        InputError("y_tilde", float(y[0]), bound)
        if v[0] >= 0.0
        else InputError("v_tilde", float(v[0]), ">= 0")
    )


def _shaped(flat: NDArray[Any], shape: tuple[int, ...]) -> Any:
    return flat.reshape(shape) if shape else flat[0].item()


def _points(v_tilde: Any, y_tilde: Any) -> tuple[Array, Array, tuple[int, ...]]:
    """Both broadcast together, flat and contiguous, and their shape."""
    if type(v_tilde) is np.ndarray is type(y_tilde) and v_tilde.dtype == y_tilde.dtype == _FLOAT:
        v, y = v_tilde, y_tilde
    else:
        v, y = real("v_tilde", v_tilde), real("y_tilde", y_tilde)
    try:
        shape = _common_shape((v, y))
    except ValueError as error:
        raise InputError(
            "y_tilde", y.shape, f"of a shape that broadcasts with that of v_tilde, {v.shape}"
        ) from error
    return _flat(v, shape), _flat(y, shape), shape


def _common_shape(arrays: Sequence[Array]) -> tuple[int, ...]:
    """The shape to which arrays broadcast; ValueError where they do not."""
    shapes = {array.shape for array in arrays} - {()}
    return np.broadcast_shapes(*shapes) if len(shapes) > 1 else shapes.pop() if shapes else ()


def _contiguous(a: Array) -> Array:
    """``a`` as the kernel wants it: contiguous, aligned float64."""
    return a if a.flags.carray and a.dtype == np.float64 else np.require(a, np.float64, ["C", "A"])


def _flat_or_one(a: Any, shape: tuple[int, ...]) -> Array | float:
    """As :func:`_flat`; a value that holds for all cases stays one value."""
    if type(a) is not np.ndarray:
        return float(a)
    return float(a.item()) if a.size == 1 else _flat(a, shape)


def _flat(a: Array, shape: tuple[int, ...]) -> Array:
    """``a`` broadcast to ``shape``, flat and contiguous."""
    return _contiguous(a if a.shape == shape else np.broadcast_to(a, shape)).reshape(-1)

"""Hold a table, and answer cases and points (v~, y~): this is the object that users have."""

import functools
import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self, Unpack, overload

import numpy as np
from numpy.typing import NDArray

from mumacro import closed_forms, plotting
from mumacro.errors import InputError, TableError
from mumacro.frames import evaluate_labelled, frame_of_cases
from mumacro.inputs.case import NUMBERS, read
from mumacro.inputs.cases import (
    ABSENT,
    COLUMNS,
    Absent,
    Cases,
    angular,
    has_labels,
    named,
    no_such_input,
)
from mumacro.inputs.columns import is_column, read_column
from mumacro.inputs.fields import (
    BALL,
    FIELDS,
    RAD_PER_CYCLE,
    RIGID,
    SPRING,
    AnyCases,
    Kind,
    ManyCases,
    Numbers,
    OneCase,
    OneInterval,
    kind_of,
)
from mumacro.kernel import threads as slices
from mumacro.kernel.arrays import Array, common_shape, flat
from mumacro.outputs import evaluation
from mumacro.outputs.answer import Answer
from mumacro.outputs.entry import Output
from mumacro.outputs.evaluation import chosen, names_in
from mumacro.outputs.tabulated import SCALAR_KERNEL, Tabulated
from mumacro.results import Rows
from mumacro.table import atlas
from mumacro.table.blocks import Table
from mumacro.table.bundled import bundled_table, bundled_tables
from mumacro.table.netcdf import json_attributes, parse_table, read_image

if TYPE_CHECKING:
    from mumacro.outputs.answer import AnswerWithGradient, IntervalAnswer

_RATIO = SCALAR_KERNEL.ratio
_FLOAT = np.dtype(np.float64)
#: effects of an illegal value in an array
ILLEGAL = ("nan", "raise")
_WORDS = (Absent, str)
_NUMBERS_OR_ARRAYS = NUMBERS | {np.ndarray}
_SIMPLE = _NUMBERS_OR_ARRAYS | {str}
_SIX_WITH_F = tuple("f" if name == "omega" else name for name in FIELDS)
_OPTIONS: dict[str, Any] = {"include": (), "gradient": False, "illegal": "nan"}
_ACROSS = (ABSENT, "across")
_SHORT: dict[Any, Kind] = {ABSENT: SPRING, "spring": SPRING, "ball": BALL}
_SLOPES = tuple(f"{name}.{field}" for name in ("gradient", "gradient_bound") for field in FIELDS)


class Surrogate:
    """Evaluate mu~(v~, y~) from one table; open it once, and share it between threads and
    processes.

    All methods have the same policy.  A scalar that is out of bounds raises :class:`InputError`; in
    an array it gives NaN, with the source code -1.  A value that is not a real number always
    raises.

    Examples
    --------
    >>> s = Surrogate.open()
    >>> answer = s.evaluate(mu0=0.3, Fz=10, k=1e6, y0=2e-6, f=20e3, v0=0.01)
    >>> round(answer.mu_macro, 6), answer.regime
    (0.240467, 'stick_slip')
    """

    def __init__(self, table: Table, path: str | Path) -> None:
        self._image: bytes | None = None
        self.path = Path(path)
        self.table = table
        self.attributes = json_attributes(table)
        #: for one spring; ``Table.contacts`` has the others
        self.tolerance = table.contacts["spring"].tolerance
        self.checksum = str(table.attributes.get("content_sha256", ""))
        attributes = table.contacts["spring"].attributes
        self.max_abs_error = float(attributes.get("verified_max_abs_error", math.nan))
        self.max_rel_error = float(attributes.get("verified_max_rel_error", math.nan))
        #: the table as the kernel reads it
        self.tabulated = Tabulated(table, self.path)
        self.border = self.tabulated.border
        self._pointer = self.tabulated.pointer

    @classmethod
    def open(cls, table: str | Path | float | None = None, threads: int | None = None) -> Self:
        """Read, check and prepare a table.

        Parameters
        ----------
        table : str, Path, float or None
            A table file; or a tolerance of mu~ [-], for the smallest bundled table that meets it;
            or None for the tightest bundled table.  A bundled table is read once in a process,
            unless its path is given.
        threads : int, optional
            Number of threads for large arrays; 1 never starts a thread.  Default: all processors in
            a call from the main thread of a program; one in other threads and in child processes,
            where work is already divided.

        Raises
        ------
        TableError
            If the file is missing, damaged or of another format.
        InputError
            If no bundled table meets the tolerance, or ``threads`` is not a whole number from 1 to
            1024.

        Examples
        --------
        >>> Surrogate.open(1e-8).id
        'mumacro-1e-10'
        """
        if isinstance(table, (str, Path)):
            return cls._of_file(Path(table)).on_threads(threads)
        return cls._of_bundled(bundled_table(table)).on_threads(threads)

    @classmethod
    @functools.cache
    def _of_bundled(cls, path: Path) -> Self:
        return cls._of_file(path)

    @classmethod
    def _of_file(cls, path: Path, image: bytes | None = None) -> Self:
        """Return the table of a file, whose bytes ``image`` are read if they are not given."""
        image = read_image(path) if image is None else image
        surrogate = cls(parse_table(image, path), path)
        surrogate._image = image
        return surrogate

    def __reduce__(self) -> tuple[Any, ...]:
        """Make a small pickle: a bundled table by name and checksum, which is also valid on another
        machine; any other table by its bytes."""
        bundled = self.path.resolve() in (path.resolve() for path in bundled_tables())
        path, image = (
            (self.path.name, None)
            if bundled
            else (str(self.path), self._image or read_image(self.path))
        )
        return _reopen, (path, self.checksum, self.tabulated.threads, image)

    def __repr__(self) -> str:
        return (
            f"<Surrogate {self.id}: tolerance {self.tolerance:g}, error of mu~ at most "
            f"{self.max_abs_error:.1e}>"
        )

    def plot(self, ax: Any = None, *, contact: str = "spring", direction: str = "across") -> Any:
        """Draw the map of mu~.  ``ax`` are matplotlib axes, or None for new ones.  They are
        returned; see ``mumacro.plotting.plot_map``."""
        return self.draw_map(ax, kind_of(contact, direction), f"{contact}, {direction}")

    def draw_map(self, ax: Any, kind: Kind, title: str, **cases: Any) -> Any:
        """Draw the map of a contact and direction with cases, as ``mumacro.plotting.plot_map``
        takes them."""
        ratio, border = self.map_of(kind, 281, 201)
        return plotting.plot_map(
            ratio,
            border,
            ax,
            direction=kind.names["direction"],
            areas=self.regimes_on_map(kind),
            reverse=self.reverse_slip_on_map(kind, 281),
            title=title,
            **cases,
        )

    def map_of(self, kind: Kind, width: int, height: int) -> tuple[Array, Array]:
        """Return mu~ (height, width) on the map of a contact and direction, rows from the bottom,
        and v~crit of each row (height,)."""
        v, y = plotting.speeds(width), plotting.amplitudes(height, kind.normal)
        ratio = self.quantity("mu_ratio", v, y[:, None], **kind.names)[0]
        return ratio, self.v_tilde_crit(y, **kind.names)

    def regimes_on_map(self, kind: Kind) -> dict[str, tuple[float, float]]:
        """Return the regimes on the map of a contact and direction, each with the place of its
        name: one of ``plotting.AREAS``."""
        v, y = np.array([plotting.place(*area, kind.normal) for area in plotting.AREAS]).T
        # v~ = v0 and y~ = y0
        cases = {"mu0": 1.0, "Fz": 1.0, "k": 1.0, "omega": 1.0, "v0": v, kind.amplitude: y}
        regimes = self.evaluate(cases, **kind.names).regime
        return dict(reversed([*zip(map(str, regimes), plotting.AREAS, strict=True)]))

    def reverse_slip_on_map(self, kind: Kind, width: int) -> tuple[Array, Array] | None:
        """Return (v~, y~) of the border between stick-slip and reverse slip on the map, (width,)
        each; None for a contact and direction without it."""
        if not {"stick_slip", "reverse_slip"} <= self.regimes_on_map(kind).keys():
            return None
        # v~ over y~ - v~, from the left of the map to y~ = 997, just below its top
        odds = np.geomspace(plotting.V_RANGE[0], 95.0, width)
        ray = odds / (1.0 + odds)
        y = closed_forms.reverse_slip(ray)
        return ray * y, y

    def on_threads(self, threads: int | None) -> Self:
        """Return the same table, whose calls use so many threads, see :meth:`open`."""
        if threads is None and self.tabulated.threads is None:
            return self
        if threads is not None and not (type(threads) is int and 1 <= threads <= 1024):
            raise InputError("threads", threads, "None or a whole number from 1 to 1024")
        other = object.__new__(type(self))  # copy.copy would read the file again, see __reduce__
        other.__dict__ |= self.__dict__
        other.tabulated = self.tabulated.on_threads(threads)
        return other

    @property
    def threads(self) -> int:
        """Return how many threads a call from here uses for a large array."""
        limit = self.tabulated.threads
        return slices.default_threads() if limit is None else limit

    @property
    def id(self) -> str:
        """Return the name of the table: the file's stem."""
        return self.path.stem

    @property
    def blocks(self) -> list[dict[str, object]]:
        """Return a description of the blocks of every contact, for JSON."""
        return [
            {
                "contact": contact.name,
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
            for contact in self.table.contacts.values()
            for chart, block in zip(contact.charts, contact.blocks, strict=True)
        ]

    @property
    def error_distribution(self) -> dict[str, dict[str, float]]:
        """Return the distribution of the verified errors of every quantity of one spring: the
        errors that fractions of the points ("0.5" to "1") do not exceed, and bound over error,
        ``least``, ``median`` and ``largest``.  For a ball see
        ``table.contacts["ball"].error_distribution``.

        >>> errors = Surrogate.open(1e-7).error_distribution["mu_ratio"]
        >>> errors["0.5"] < errors["0.95"] < errors["0.99"] < errors["1"] < 1e-7
        True
        """
        return self.table.contacts["spring"].error_distribution

    @property
    def memory(self) -> int:
        """Return the bytes of the cells that an evaluation of mu~ of one spring reads."""
        data = self.tabulated.data()
        return sum(
            array.nbytes
            for array in (data.border, data.pieces, data.blocks, *data.quantities[atlas.MU])
        )

    def self_check(self) -> None:
        """Compare known answers with the table.  Raise :class:`TableError` if one is off by more
        than its bound."""
        for v, y, expected in ((0.1, 0.5, KNOWN_STICK_SLIP), (2.0, 1.0, KNOWN_CONTINUOUS)):
            mu, bound, _ = self.quantity("mu_ratio", v, y)
            if not abs(mu - expected) <= bound + 1e-15:
                raise TableError(
                    self.path,
                    f"known answer at v~={v}, y~={y} is {expected!r}, the table gives {mu!r}",
                )

    # --- dimensionless ----------------------------------------------------------------------------

    def mu_ratio(self, v_tilde: Any, y_tilde: Any) -> Any:
        """Return mu~ = mu_macro/mu0 [-] of one spring that is shaken across, eq. (15), in the
        fastest way.

        For a ball use ``quantity("mu_ratio", v_tilde, y_tilde, contact="ball")``, which has the
        bound.

        Parameters
        ----------
        v_tilde, y_tilde : float or array_like
            Dimensionless speed [-], >= 0, and amplitude [-], finite and >= 0, broadcast together.

        Returns
        -------
        float or ndarray of float64
            In the broadcast shape; NaN where a value of an array is out of bounds.

        Raises
        ------
        InputError
            If a scalar is out of bounds, a value is not a real number, or shapes do not broadcast.

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
        values = self.tabulated.ratios(v, y)
        if not shape and math.isnan(values[0]):
            raise _illegal(v, y)
        return _reshape(values, shape)

    def v_tilde_crit(
        self, y_tilde: Numbers, *, contact: str = "spring", direction: str = "across"
    ) -> Any:
        """Return the border of continuous sliding v~crit [-], eqs. (21) to (24), at amplitude
        ``y_tilde`` [-] >= 0.

        It is infinite for an infinite amplitude.  The relative error is below
        ``border.max_rel_error``.  For a ball it is the speed from which all springs slide.  For
        along and normal it is the amplitude itself, for normal below 1.

        Examples
        --------
        >>> round(Surrogate.open().v_tilde_crit(1.0), 7)
        0.3251783
        """
        kind = kind_of(contact, direction)
        if type(y_tilde) is float and y_tilde >= 0.0 and kind == SPRING:
            return float(self.border(np.array((y_tilde,)))[0])
        _, y, shape = _flat_groups(0.0, y_tilde)
        crit = self.tabulated.crit(y, kind)
        if not shape and math.isnan(crit[0]):
            raise InputError("y_tilde", float(y[0]), ">= 0 and < 1" if kind.normal else ">= 0")
        return _reshape(crit, shape)

    def power(self, v_tilde: Numbers, y_tilde: Numbers, **kind: str) -> Any:
        """Return the mean power of the shaker <y~ cos tau u_y> [-], in units of mu0 Fz l0 omega.
        This is :meth:`quantity` without the bound.

        Slip turns v~ mu~ plus this power into heat.  An infinite amplitude gives infinite power.
        """
        return self.quantity("power", v_tilde, y_tilde, **kind)[0]

    def stick_fraction(self, v_tilde: Numbers, y_tilde: Numbers, **kind: str) -> Any:
        """Return the fraction of the period during which the contact sticks [-], 0 to 1.  This is
        :meth:`quantity` without the bound."""
        return self.quantity("stick_fraction", v_tilde, y_tilde, **kind)[0]

    def slopes(
        self, v_tilde: Numbers, y_tilde: Numbers, of: str = "mu_ratio", *, bounds: bool = False
    ) -> tuple[Any, ...]:
        """Return the quantity with the name ``of``, see :meth:`quantity`, and its derivatives v~
        d/d v~ and y~ d/d y~ [-].

        With ``bounds`` also return the bounds of the absolute errors of the two derivatives.
        Arguments, shapes and errors are as in :meth:`mu_ratio`.

        Examples
        --------
        >>> mu, along_v, along_y = Surrogate.open().slopes(2.0, 0.01)
        >>> f"{along_y:.3e}"     # eq. (31): -y~^2 / (2 (1 + v~^2))
        '-1.000e-05'
        """
        name = self._quantity("of", of)
        v, y, shape = _flat_groups(v_tilde, y_tilde)
        rows = self.tabulated.slopes(name, v, y)
        if not shape and math.isnan(rows.value[0]):
            raise _illegal(v, y)
        return tuple(_reshape(row, shape) for row in rows[: 5 if bounds else 3])

    def quantity(
        self,
        name: str,
        v_tilde: Numbers,
        y_tilde: Numbers,
        *,
        contact: str = "spring",
        direction: str = "across",
    ) -> tuple[Any, Any, Any]:
        """Return a tabulated quantity, the bound of its absolute error, and the source code (index
        into SOURCES).

        ``name`` is "mu_ratio", "power" or "stick_fraction"; other arguments, shapes and errors are
        as in :meth:`mu_ratio`.  The stick fraction of a ball is weighted with the load.  At the
        border its bound is larger than elsewhere, because there it is a square root of the distance
        to v~crit.  For direction "normal" ``y_tilde`` is Fz_amplitude/Fz [-], below 1; it has no
        power, because the model does not know how far the load moves.

        Examples
        --------
        >>> power, bound, source = Surrogate.open().quantity("power", 0.1, 0.5)
        >>> round(power, 6), bound < 1e-12, int(source)
        (0.012142, True, 5)
        """
        name, kind = self._quantity("name", name), kind_of(contact, direction)
        if not kind.direction and type(v_tilde) in NUMBERS and type(y_tilde) in NUMBERS:
            with suppress(OverflowError):  # a whole number beyond double range
                one = self.tabulated.value(name, v_tilde, y_tilde, kind)  # type: ignore[arg-type]
                if one[2] >= 0:
                    return one
        if kind.normal and name == "power":
            bound = "across or along for the power: the load's path is not modelled"
            raise InputError("direction", direction, bound)
        v, y, shape = _flat_groups(v_tilde, y_tilde)
        value, bound_, source = self.tabulated.values(name, v, y, kind)
        if not shape and source[0] == -1:
            finite = "finite and >= 0" if name == "mu_ratio" or kind.direction else ">= 0"
            raise _illegal(v, y, ">= 0 and < 1" if kind.normal else finite)
        return _reshape(value, shape), _reshape(bound_, shape), _reshape(source, shape)

    def _quantity(self, argument: str, name: Any) -> str:
        """Return the name of a quantity that the table has."""
        if not isinstance(name, str) or name not in self.table.quantities:
            bound = f"one of {', '.join(self.table.quantities)}, which the table has"
            raise InputError(argument, name, bound)
        return name

    # --- dimensional ------------------------------------------------------------------------------

    @overload
    def evaluate(  # type: ignore[overload-overlap]
        self, cases: None = ..., /, *, gradient: Literal[True], **case: Unpack[OneCase]
    ) -> "AnswerWithGradient[float]": ...

    @overload
    def evaluate(  # type: ignore[overload-overlap]
        self, cases: None = ..., /, *, gradient: Literal[False] = ..., **case: Unpack[OneCase]
    ) -> Answer[float]: ...

    @overload
    def evaluate(  # type: ignore[overload-overlap]
        self, cases: None = ..., /, *, gradient: bool = ..., **case: Unpack[OneInterval]
    ) -> "IntervalAnswer[float]": ...

    @overload
    def evaluate(
        self,
        cases: Mapping[str, Any] | None = ...,
        /,
        *,
        gradient: Literal[True],
        **columns: Unpack[ManyCases],
    ) -> "AnswerWithGradient[Array]": ...

    @overload
    def evaluate(
        self,
        cases: Mapping[str, Any] | None = ...,
        /,
        *,
        gradient: Literal[False] = ...,
        **columns: Unpack[ManyCases],
    ) -> Answer[Array]: ...

    @overload
    def evaluate(self, cases: Any = ..., /, **inputs: Unpack[AnyCases]) -> Any: ...

    def evaluate(
        self,
        cases: Any = None,
        /,
        *,
        mu0: Any = ABSENT,
        Fz: Any = ABSENT,
        k: Any = ABSENT,
        k_low: Any = ABSENT,
        k_high: Any = ABSENT,
        y0: Any = ABSENT,
        Fz_amplitude: Any = ABSENT,
        omega: Any = ABSENT,
        f: Any = ABSENT,
        v0: Any = ABSENT,
        std_mu0: Any = ABSENT,
        std_Fz: Any = ABSENT,
        std_k: Any = ABSENT,
        std_y0: Any = ABSENT,
        std_Fz_amplitude: Any = ABSENT,
        std_omega: Any = ABSENT,
        std_f: Any = ABSENT,
        std_v0: Any = ABSENT,
        contact: Any = ABSENT,
        direction: Any = ABSENT,
        include: Iterable[str] | str = (),
        gradient: bool = False,
        illegal: str = "nan",
        **unknown_names: Any,
    ) -> Any:
        """Return macroscopic friction from dimensional inputs, scalars or arrays that broadcast
        together.

        Parameters
        ----------
        cases : mapping, DataFrame (pandas, Dask, Polars), pyarrow.Table or xarray.Dataset, optional
            Inputs and options by name, instead of keywords or together with them.  An unknown name
            is refused in a mapping; other columns of a frame, a table or a Dataset are ignored.
            One row of a frame, a Series, is one case.
        mu0 : array_like
            Coulomb friction coefficient of the contact [-], > 0.
        Fz : array_like
            Normal force [N], > 0.
        k : array_like or "rigid"
            Tangential stiffness of the contact [N/m], > 0; "rigid" or infinity is rigid contact,
            eq. (37).  It must always be given, here or as an interval: None is refused.
        k_low, k_high : array_like
            Lowest and highest stiffness [N/m]; they replace k.
        y0 : array_like
            Amplitude of the oscillation, half of peak to peak [m], >= 0, across or along the
            sliding direction.
        Fz_amplitude : array_like
            Amplitude of the normal force, half of peak to peak, below Fz [N], >= 0; it replaces y0
            if the direction is "normal".
        omega : array_like
            Angular frequency of the oscillation [rad/s], >= 0.
        f : array_like
            Frequency of the oscillation [Hz], >= 0; it replaces omega.
        v0 : array_like
            Sliding speed [m/s], >= 0.
        contact : str
            "spring", one spring; or "ball", a sphere on a flat (Hertz) whose stiffness before slip
            is k = 8 a G*.  A call has one contact and one direction; a column of equal values
            counts as one value.
        direction : str
            "across" or "along" the sliding direction, with the amplitude y0; or "normal": the
            normal force is Fz + Fz_amplitude cos(omega t), for a spring only.
        include : sequence of str
            More outputs than mu_macro, by name: groups, limits, gradient, std,
            stick_fraction, power, settling (``mumacro.outputs.OUTPUTS``).  Each is in the
            answer by its path, such as ``answer["power.saved"]``, with its bound.
        std_mu0, std_Fz, std_k, std_y0, std_Fz_amplitude, std_omega, std_f, std_v0 : array_like
            Standard deviations of the inputs, in their units; errors are independent.  They imply
            the output std.
        gradient : bool
            The same as this name in ``include``: the derivatives with respect to every input,
            with bounds.
        illegal : str
            Effect of an illegal value in an array: "nan" gives NaN and the source -1 for its case,
            "raise" raises.

        Returns
        -------
        Answer
            For an interval of k with ``mu_macro_low`` and ``mu_macro_high``.  A frame, a table or a
            Dataset gives a result of the same type, with a column for each output by its path;
            Series give a DataFrame, DataArrays a Dataset, arrays of Dask a dict of lazy arrays.

        Raises
        ------
        InputError
            If a scalar is out of bounds; if an input is missing, unknown, given twice or not a
            number; if shapes do not broadcast; if no case has an output that was asked for.

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
        >>> a = s.evaluate(k_low=0.8e6, k_high=1.2e6, **case)
        >>> f"{a.mu_macro_low:.4f} {a.mu_macro:.4f} {a.mu_macro_high:.4f}"
        '0.2095 0.2432 0.2640'
        >>> a = s.evaluate(k=1e6, include=("power",), std_k=1e5, std_v0=1e-3, **case)
        >>> f"{a['power.saved']:.6f} {a['std']:.4f} {a['std_share.k']:.2f}"
        '0.005953 0.0136 0.99'
        """
        if (
            cases is None
            and k_low is k_high is Fz_amplitude is ABSENT
            and std_mu0 is std_Fz is std_k is std_y0 is std_Fz_amplitude is ABSENT
            and std_omega is std_f is std_v0 is ABSENT
            and type(contact) in _WORDS
            and contact in _SHORT
            and type(direction) in _WORDS
            and direction in _ACROSS
            and (f is ABSENT or omega is ABSENT)
            and not unknown_names
            and type(gradient) is bool
            and type(illegal) is str
            and illegal == "nan"
        ):
            # Plain numbers take this short path in a third of the time; arrays of doubles take it,
            # too.  Cases that it cannot answer take the long path, which has the messages.
            names = FIELDS if f is ABSENT else _SIX_WITH_F
            if type(k) is str and k == RIGID:
                k = math.inf
            six = (mu0, Fz, k, y0, omega if f is ABSENT else f, v0)
            types = {*map(type, six)}
            if types <= NUMBERS and not (gradient and k == math.inf):
                with suppress(OverflowError):  # a whole number beyond double range
                    if include:
                        one = Cases.of_numbers(names, six, _SHORT[contact])
                        return self.answer(one, chosen(include, one, gradient))
                    answer = self._one(names, six, gradient, _SHORT[contact])
                    if answer.source_code >= 0:
                        return answer
            if types <= _NUMBERS_OR_ARRAYS and not include and not gradient:
                with suppress(OverflowError):
                    if (shape := _shape_of_doubles(six)) is not None:
                        return self._many(names, six, shape, _SHORT[contact])
            if types <= _SIMPLE:  # no other type has to be looked for
                of_six = Cases.of(dict(zip(names, six, strict=True)), _SHORT[contact])
                return self.answer(of_six, chosen(include, of_six, gradient))
        for name, value in unknown_names.items():
            raise no_such_input(name, value)
        arguments = locals()
        values = {name: x for name in COLUMNS if (x := arguments[name]) is not ABSENT}
        types = {*map(type, values.values())}
        are_words = type(contact) in _WORDS and type(direction) in _WORDS
        if cases is None and types <= _SIMPLE and are_words:
            is_labelled = False
        else:
            values |= {
                name: x for name, usual in _OPTIONS.items() if (x := arguments[name]) is not usual
            }
            values = named(cases, values)
            include, gradient, illegal = (values.pop(name, x) for name, x in _OPTIONS.items())
            is_labelled = has_labels(values.values()) or bool(
                cases is not None and frame_of_cases(cases)
            )
        if not (type(illegal) is str and illegal in ILLEGAL):
            raise InputError("illegal", illegal, '"nan" or "raise"')
        if not isinstance(gradient, (bool, np.bool_)):
            raise InputError("gradient", gradient, "True or False")
        strict = illegal == "raise"
        if is_labelled:
            included = [*names_in(include), *["gradient"] * bool(gradient)]
            return evaluate_labelled(self, cases, values, included, strict)
        of_values = Cases.of(values, strict=strict)
        return self.answer(of_values, chosen(include, of_values, gradient))

    def answer(
        self, cases: Cases, outputs: tuple[Output, ...] = (), groups: bool = False
    ) -> Answer[Any]:
        """Return :meth:`evaluate` of cases in their one form, with outputs of
        ``mumacro.outputs.evaluation.chosen``; ``groups`` adds v~, y~ and l0."""
        answer = evaluation.evaluate_cases(self.tabulated, cases, outputs, groups)
        answer._surrogate = self
        return answer

    @staticmethod
    def in_words(answer: Answer[float]) -> tuple[Rows, Rows, str]:
        """Return the answer to one case as the command prints it and a notebook shows it."""
        from mumacro.validity import in_words  # loaded only if an answer is shown

        return in_words(answer)

    def _many(
        self, names: tuple[str, ...], six: tuple[Any, ...], shape: tuple[int, ...], kind: Kind
    ) -> Answer[Array]:
        """Return the answer to cases across in numbers and arrays (n,), NaN at an illegal case."""
        columns = [x if type(x) is np.ndarray else float(x) for x in six]
        if names is _SIX_WITH_F:
            columns[4] = angular(columns[4])
        tabulated = self.tabulated
        data = tabulated.data(kind=kind)
        rows = slices.cases(data, columns, shape, tabulated.threads, "values", kind)
        numbers = rows.mu_macro, rows.mu_ratio, rows.error_bound
        answer = Answer(*numbers, rows.source, None, None, self)
        answer._plain = kind, names, six
        return answer

    def _one(
        self, names: tuple[str, ...], six: tuple[Any, ...], gradient: bool, kind: Kind
    ) -> Answer[float]:
        """Return the answer to one case across in plain numbers, NaN if it is illegal."""
        fields = six
        if names is _SIX_WITH_F:
            fields = (*six[:4], RAD_PER_CYCLE * float(six[4]), six[5])
        row = self.tabulated.one(fields, gradient, kind.contact)
        answer: Answer[float] = Answer(
            row.mu_macro,
            row.mu_ratio,
            row.error_bound,
            row.source,
            (row.v_tilde, row.y_tilde, row.length_scale),
            None,
            self,
        )
        answer._plain = kind, names, six
        if gradient:
            slopes, bounds = tuple(row.gradient), tuple(row.gradient_bound)
            answer.gradient = dict(zip(FIELDS, slopes, strict=True))
            answer.gradient_bound = dict(zip(FIELDS, bounds, strict=True))
            answer.outputs = dict(zip(_SLOPES, slopes + bounds, strict=True))
        return answer


# mu~ at (v~, y~) = (0.1, 0.5) and (2, 1), from the full model to all digits
# (tests/mumacro/test_surrogate.py solves them again)
KNOWN_STICK_SLIP = 0.9420042895137095
KNOWN_CONTINUOUS = 0.9545954718694023


@functools.cache  # a worker gets the same surrogate with every task
def _reopen(path: str, checksum: str, threads: int | None, image: bytes | None) -> Surrogate:
    """Unpickle a surrogate: from the bytes, or from the bundled table of this name."""
    if image is not None:
        return Surrogate._of_file(Path(path), image).on_threads(threads)
    here = next((table for table in bundled_tables() if table.name == path), Path(path))
    surrogate = Surrogate._of_bundled(here).on_threads(threads)
    if surrogate.checksum != checksum:
        mismatch = (
            f"holds {surrogate.checksum[:12]}, the pickled surrogate was made from {checksum[:12]}"
        )
        raise TableError(surrogate.path, f"{mismatch}: install the same release on both sides")
    return surrogate


def _shape_of_doubles(six: tuple[Any, ...]) -> tuple[int, ...] | None:
    """Return the shape (n,) of the arrays of doubles among the inputs; None where they have several
    shapes, another type or another layout."""
    shape: tuple[int, ...] = ()
    for x in six:
        if type(x) is np.ndarray:
            if x.ndim != 1 or x.dtype is not _FLOAT or not x.flags.carray:
                return None
            if x.shape != (shape or x.shape):
                return None
            shape = x.shape
    return shape if shape > (0,) else None


def _illegal(v: Array, y: Array, bound: str = "finite and >= 0") -> InputError:
    """Return the error of a single point; ``bound`` is the bound of y~."""
    return (
        InputError("y_tilde", float(y[0]), bound)
        if v[0] >= 0.0
        else InputError("v_tilde", float(v[0]), ">= 0")
    )


def _reshape(values: NDArray[Any], shape: tuple[int, ...]) -> Any:
    return values.reshape(shape) if shape else values[0].item()


def _flat_groups(v_tilde: Any, y_tilde: Any) -> tuple[Array, Array, tuple[int, ...]]:
    """Return both broadcast together, flat and contiguous, and their shape."""
    if type(v_tilde) is np.ndarray is type(y_tilde) and v_tilde.dtype == y_tilde.dtype == _FLOAT:
        v, y = v_tilde, y_tilde
    else:
        v, y = (
            read_column(name, x).si if is_column(x) else np.asarray(read(name, x).si)
            for name, x in (("v_tilde", v_tilde), ("y_tilde", y_tilde))
        )
    try:
        shape = common_shape((v, y))
    except ValueError as error:
        raise InputError(
            "y_tilde", y.shape, f"of a shape that broadcasts with that of v_tilde, {v.shape}"
        ) from error
    return flat(v, shape), flat(y, shape), shape

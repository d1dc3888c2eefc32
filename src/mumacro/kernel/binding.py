"""Call the compiled kernel: ``mumacro/kernel/*.c`` as a shared object.  Only this module calls it.

The kernel does not use Python. :mod:`cffi` opens it with the declarations of ``kernel/data.h``,
``records.h`` and ``library.h``, which hatch_build.py has parsed into ``_declarations.py``.  A call
releases the interpreter's lock.  There is a kernel for every instruction set of the processor; the
best one is used.  The ones with fused multiply-add (AVX2, AVX-512, NEON) give the same bits.
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self

import numpy as np

from mumacro.kernel.arrays import Array, Codes

ROOM = 200_000  # largest number of steps in a period of a motion
# largest number of steps in the search for the steady cycle of a motion: 2 to 6 s; a step counts
# (harmonics + 1) times
MOST_STEPS = 50_000_000

_HERE = Path(__file__).resolve().parent.parent
_SHARED_OBJECT = _HERE / ("_kernel.dll" if sys.platform == "win32" else "_kernel.so")


def _opened() -> tuple[Any, Any]:
    """Return the shared object, and cffi with its declarations."""
    try:
        from mumacro.kernel._declarations import ffi

        return ffi, ffi.dlopen(str(_SHARED_OBJECT))
    except (ImportError, OSError) as error:
        if isinstance(error, ImportError) and error.name != "mumacro.kernel._declarations":
            raise
        raise ImportError(_why_unopened(error)) from None


def _why_unopened(error: Exception) -> str:
    """Return one line that says which folder was imported and what to do about it."""
    if not _SHARED_OBJECT.exists() and (_HERE / "kernel" / "kernel.c").exists():
        return (
            f"mumacro: the compiled kernel {_SHARED_OBJECT.name} is missing: Python imported the "
            f"sources in {_HERE}, which hide an installed mumacro: start Python in another folder, "
            "or compile these sources with a C compiler or the package ziglang: pip install -e ."
        )
    return (
        f"mumacro: the compiled kernel {_SHARED_OBJECT} is missing or does not fit this machine "
        f"({error}): install a wheel for this platform, or build one with a C compiler or the "
        "package ziglang: pip install ."
    )


_FFI, _LIBRARY = _opened()
_NUMBERS, _CODES, _CASE = map(_FFI.typeof, ("double[]", "int8_t[]", "mumacro_case *"))
_POINT, _CODE = map(_FFI.typeof, ("double[4]", "int8_t[1]"))
_FLAG = _FFI.typeof("int32_t[]")
_COLUMNS = _FFI.typeof("mumacro_columns *")
_NOTHING: Any = _FFI.NULL
_new, _from_buffer = _FFI.new, _FFI.from_buffer


def _numbers(array: Array | None) -> Any:
    return _NOTHING if array is None else _from_buffer(_NUMBERS, array)


def _harmonics(orders: Sequence[Sequence[int]]) -> tuple[Any, Any]:
    """Return the numbers of harmonics of x, y and the normal force, and the list of all of them."""
    all_orders = [float(order) for part in orders for order in part]
    return _FFI.new("int32_t[3]", [len(part) for part in orders]), _FFI.new(
        "double[]", all_orders or [0.0]
    )


def _out(rows: Sequence[Array], start: int) -> tuple[Any, int]:
    """Return a pointer to the place where the kernel writes rows of an array, from column ``start``
    on, and the stride of the rows."""
    whole = np.asarray(rows[0].base)
    return _numbers(whole) + start, whole.shape[1]


def _columns_of(columns: Sequence[Array | float], start: int) -> Any:
    """Return a ``mumacro_columns`` that points to six columns, (n,) or one number each, from
    ``start`` on.  It is valid as long as the columns exist."""
    of_kernel = _new(_COLUMNS)
    arrays, constants = of_kernel.array, of_kernel.constant
    for i, column in enumerate(columns):
        if isinstance(column, float):
            constants[i] = column
        else:
            pointer = _from_buffer(_NUMBERS, column)
            arrays[i] = pointer + start if start else pointer
    return of_kernel


def _record(enum: str, prefix: str, end: str) -> np.dtype[np.void]:
    """Return the type of a row of doubles that have the names of an enum; ``end`` is the enum's
    count of columns."""
    places = dict(_FFI.typeof(f"enum {enum}").relements)
    columns = places.pop(end)
    return np.dtype(
        {
            "names": [name.removeprefix(prefix).lower() for name in places],
            "formats": [np.float64] * len(places),
            "offsets": [8 * place for place in places.values()],
            "itemsize": 8 * columns,
        }
    )


#: types of the rows in the blocks and the border pieces of :class:`Data`, see ``kernel/data.h``
BLOCK_ROW = _record("mumacro_block_column", "MU_", "MU_BLOCK_COLUMNS")
PIECE_ROW = _record("mumacro_piece_column", "MU_PIECE_", "MU_PIECE_COLUMNS")

_ROW = _FFI.typeof("enum mumacro_row").relements
_SLOPE_ROWS = _FFI.typeof("enum mumacro_slope_row").relements["MU_SLOPE_ROWS"]
_EXTREME_ROWS = _FFI.typeof("enum mumacro_extreme_row").relements["MU_EXTREME_ROWS"]
#: the detail of an answer, and the first row that is not filled for it
Detail = Literal["values", "groups", "gradient"]
_END: dict[Detail, int] = {
    "values": _ROW["MU_ROW_V_TILDE"],
    "groups": _ROW["MU_ROW_GRADIENT"],
    "gradient": _ROW["MU_ROWS"],
}


class _Rows:
    """Give access to a row of :class:`CaseRows` by its name in ``mumacro_row``, or to all rows up
    to another."""

    def __init__(self, name: str, end: str = "") -> None:
        self._place = slice(_ROW[name], _ROW[end]) if end else _ROW[name]

    def __get__(self, answers: "CaseRows", _owner: type) -> Array:
        rows: Array = answers.numbers[self._place]
        return rows


class CaseRows:
    """Hold the answers to cases of one shape; :meth:`Kernel.cases` fills them in.

    ``v_tilde``, ``y_tilde`` and ``length_scale`` exist for the details "groups" and "gradient";
    ``gradient`` and ``gradient_bound``, six rows each, for "gradient". ``source`` holds codes; an
    illegal case has -1, and its numbers are NaN.
    """

    __slots__ = ("numbers", "source")

    #: friction coefficient [-]
    mu_macro = _Rows("MU_ROW_MU_MACRO")
    #: mu_macro / mu0 [-]
    mu_ratio = _Rows("MU_ROW_MU_RATIO")
    #: bound of the absolute error of mu_macro [-]
    error_bound = _Rows("MU_ROW_ERROR_BOUND")
    #: dimensionless speed [-]
    v_tilde = _Rows("MU_ROW_V_TILDE")
    #: dimensionless amplitude [-]
    y_tilde = _Rows("MU_ROW_Y_TILDE")
    #: l0 = mu0 Fz / k [m], eq. (5); 0 for rigid contact
    length_scale = _Rows("MU_ROW_LENGTH_SCALE")
    #: d mu_macro / d input
    gradient = _Rows("MU_ROW_GRADIENT", "MU_ROW_GRADIENT_BOUND")
    #: bounds of the absolute errors of the gradient
    gradient_bound = _Rows("MU_ROW_GRADIENT_BOUND", "MU_ROWS")

    def __init__(self, shape: tuple[int, ...], detail: Detail = "values") -> None:
        self.numbers, self.source = np.empty((_END[detail], *shape)), np.empty(shape, np.int8)


class SlopeRows(NamedTuple):
    """Hold a quantity, its derivatives v~ d/d v~ and y~ d/d y~, and the bounds of these two, (n,)
    each, in the order of ``mumacro_slope_row``."""

    value: Array
    along_v: Array
    along_y: Array
    along_v_bound: Array
    along_y_bound: Array

    @classmethod
    def empty(cls, n: int) -> Self:
        """Return empty arrays for n points."""
        return cls(*np.empty((_SLOPE_ROWS, n)))


class ExtremeRows(NamedTuple):
    """Hold the smallest and largest mu_macro over intervals of k, and the largest bound in the
    interval, (n,) each, in the order of ``mumacro_extreme_row``."""

    low: Array
    high: Array
    error_bound: Array

    @classmethod
    def empty(cls, n: int) -> Self:
        """Return empty arrays for n intervals."""
        return cls(*np.empty((_EXTREME_ROWS, n)))


class Data:
    """Hold a table as the kernel reads it.

    ``border``: polynomials of v~crit (cells, 8), highest power first.  ``pieces`` (3, columns):
    rows of ``PIECE_ROW``.  ``blocks`` (sources + 1, columns): rows of ``BLOCK_ROW``, zero if the
    block has no cells.  ``outer``: the two terms of large speed, (cells, 2, 8).
    """

    def __init__(self, border: Array, pieces: Array, blocks: Array, outer: Array) -> None:
        self.pointer = _FFI.new("mumacro_data *")
        self._pointers: list[Any] = []
        #: polynomials (cells, 8, 8), errors (sources + 1, 2), and errors in each cell (cells, 3),
        #: by code of the quantity
        self.quantities: dict[int, tuple[Array, Array, Array]] = {}
        self.border, self.pieces, self.blocks, self.outer = (
            self._keep(self.pointer, name, array)
            for name, array in (
                ("border", border),
                ("pieces", pieces),
                ("blocks", blocks),
                ("outer", outer),
            )
        )
        self.pointer.border_cells = self.border.shape[0]

    def add_quantity(
        self, quantity: int, polynomials: Array, errors: Array, cell_errors: Array
    ) -> None:
        """Add the cells of a quantity, see :attr:`quantities`."""
        place = self.pointer.quantities[quantity]
        place.cells = polynomials.shape[0]
        self.quantities[quantity] = (
            self._keep(place, "polynomials", polynomials),
            self._keep(place, "errors", errors),
            self._keep(place, "cell_errors", cell_errors),
        )

    def add_driven_rule(self, points: Array) -> None:
        """Add the quadrature rule for a ball that is shaken along, see ``mumacro_driven_rule``."""
        self._keep(self.pointer.driven, "points", points)
        self.pointer.driven.nodes = points.shape[0]

    def _keep(self, place: Any, name: str, array: Array) -> Array:
        """Set the pointer ``place.name`` to the numbers of an array, and keep the array alive as
        long as this object."""
        array = np.require(array, np.float64, ["C", "A"])
        pointer = _numbers(array)
        setattr(place, name, pointer)
        self._pointers.append(pointer)
        return array


class Kernel:
    """Call the functions of one instruction set.  Arrays are contiguous float64 (sources: int8), of
    one length.

    Illegal points and cases give NaN and the source -1.  See ``kernel/library.h``.
    """

    def __init__(self, functions: Any) -> None:
        self._functions = functions
        self.level: str = _FFI.string(functions.level).decode()
        self.atlas = functions.atlas
        self.ratio = functions.ratio  # (data.pointer, v~, y~) -> mu~
        self._values, self._one, self._cases = functions.values, functions.one, functions.cases

    def text(self, pointer: Any) -> str:
        """Return a text of the kernel as a Python string."""
        return str(_FFI.string(pointer).decode())

    def chart(self, contact: int, place: int) -> Any:
        """Return a block of a contact; null after the last one."""
        return self._functions.chart(contact, place)

    def source(self, code: int) -> Any:
        """Return the source of an answer by its code; its name is null after the last one."""
        return self._functions.source(code)

    def quantity(self, code: int) -> Any:
        """Return the record of a quantity; null after the last one."""
        return self._functions.quantity(code)

    def values(
        self,
        data: Data,
        quantity: int,
        v: Array,
        y: Array,
        value: Array,
        bound: Array | None,
        source: Codes | None,
        kind: tuple[int, int] = (0, 0),
    ) -> None:
        """Evaluate a quantity at points (n,): fill ``value``, and ``bound`` and ``source`` if they
        are not None.

        For another ``kind``, see :meth:`cases`, fill all three.
        """
        codes = _NOTHING if source is None else _from_buffer(_CODES, source)
        arrays = _numbers(v), _numbers(y), _numbers(value), _numbers(bound), codes
        self._values(data.pointer, *kind, quantity, v.size, *arrays)

    def value(
        self, data: Data, quantity: int, v: float, y: float, contact: int = 0
    ) -> tuple[float, float, int]:
        """Return a quantity at one point as plain numbers: value, bound and source."""
        point, code = _new(_POINT, (v, y)), _new(_CODE)
        pointers = point, point + 1, point + 2, point + 3
        self._values(data.pointer, contact, 0, quantity, 1, *pointers, code)
        return point[2], point[3], code[0]

    def slopes(
        self,
        data: Data,
        quantity: int,
        v: Array,
        y: Array,
        rows: SlopeRows,
        start: int = 0,
        contact: int = 0,
    ) -> None:
        """Evaluate a quantity and its slopes at points (n,): fill ``rows`` from ``start`` on."""
        points = _numbers(v), _numbers(y)
        self._functions.slopes(data.pointer, contact, quantity, v.size, *points, *_out(rows, start))

    def cases(
        self,
        data: Data,
        columns: Sequence[Array | float],
        answers: CaseRows,
        part: slice,
        kind: tuple[int, int] = (0, 0),
    ) -> None:
        """Evaluate a part of n cases and fill ``answers`` there.

        ``columns`` are the six inputs, (n,) or one number each.  ``kind`` is another contact and
        direction, see :class:`mumacro.inputs.fields.Kind`.
        """
        start, n = part.start, part.stop - part.start
        numbers, codes = answers.numbers, answers.source
        out, sources = _numbers(numbers) + start, _from_buffer(_CODES, codes) + start
        six, rows, stride = _columns_of(columns, start), len(numbers), codes.size
        self._cases(data.pointer, *kind, n, six, rows, out, stride, sources)

    def intervals(
        self,
        data: Data,
        columns: Sequence[Array | float],
        high: Array,
        rows: ExtremeRows,
        part: slice,
        kind: tuple[int, int] = (0, 0),
    ) -> None:
        """Evaluate intervals of k, from its column to ``high`` (n,), in the way of
        :meth:`cases`."""
        start, n = part.start, part.stop - part.start
        six, ends = _columns_of(columns, start), _numbers(high) + start
        self._functions.intervals(data.pointer, *kind, n, six, ends, *_out(rows, start))

    def one(self, pointer: Any, six: Sequence[float], with_gradient: bool, contact: int = 0) -> Any:
        """Return one case as plain numbers: a ``mumacro_case``; its gradient is filled only if
        asked for."""
        # named arguments: a call with *six takes longer
        answer, (mu0, Fz, k, y0, omega, v0) = _new(_CASE), six
        self._one(pointer, contact, mu0, Fz, k, y0, omega, v0, with_gradient, answer)
        return answer

    def border(self, data: Data, y: Array, kind: tuple[int, int] = (0, 0)) -> Array:
        """Return v~crit at ``y`` (n,): 0 at 0, infinite at infinity, NaN if ``y`` is not an
        amplitude."""
        out = np.empty(y.size)
        self._functions.border_as(data.pointer, *kind, y.size, _numbers(y), _numbers(out))
        return out

    def places(
        self, data: Data, v: Array, y: Array, contact: int = 0
    ) -> tuple[Codes, Array, Array]:
        """Return the blocks of points (n,) with 0 < v~, y~ < infinity, and the coordinates in the
        blocks as the evaluation computes them.  For a ball they belong to its middle spring."""
        block, a, b = np.empty(v.size, np.int8), np.empty(v.size), np.empty(v.size)
        codes = _from_buffer(_CODES, block)
        arrays = _numbers(v), _numbers(y), codes, _numbers(a), _numbers(b)
        self._functions.places(data.pointer, contact, v.size, *arrays)
        return block, a, b

    def element_steps(
        self,
        before: Array,
        after: Array,
        k: Array,
        dx: Array,
        dy: Array,
        forces: Array,
        sums: Array,
    ) -> None:
        """Move contacts (n,) by (dx, dy), while their limits change from ``before`` to ``after``.
        Change ``forces`` (n, springs, 2) in place and fill ``sums`` (n, 2)."""
        arrays = map(_numbers, (before, after, k, dx, dy, forces, sums))
        self._functions.element_steps(before.size, forces.shape[1], *arrays)

    def motions(
        self,
        contact: int,
        orders: Sequence[Sequence[int]],
        cases: Array,
        tolerance: float,
        out: Array,
        stop: Any,
        most: int = MOST_STEPS,
    ) -> None:
        """Compute steady cycles of motions: fill ``out`` (n, 7) from ``cases`` (n, 1 + terms), see
        ``kernel/library.h``.  ``orders`` are the harmonics of x, y and the normal force.  Stop
        early if another thread sets the flag ``stop``."""
        counts, all_orders = _harmonics(orders)
        self._functions.motions(
            contact,
            cases.shape[0],
            counts,
            all_orders,
            _numbers(cases),
            tolerance,
            ROOM,
            _numbers(np.empty(2 * ROOM)),
            most,
            _from_buffer(_FLAG, stop),
            _numbers(out),
        )

    def motion_cycle(
        self,
        orders: Sequence[Sequence[int]],
        case: Array,
        shares: Array,
        weights: Array,
        tolerance: float,
        n: int,
        stop: Any,
    ) -> Array:
        """Return the forces (n + 1, 2) of one cycle of a case at equally spaced times, summed over
        springs."""
        forces, (counts, all_orders) = np.empty((n + 1, 2)), _harmonics(orders)
        self._functions.motion_cycle(
            counts,
            all_orders,
            _numbers(case),
            shares.size,
            *map(_numbers, (shares, weights)),
            tolerance,
            ROOM,
            _numbers(np.empty(2 * ROOM)),
            MOST_STEPS,
            _from_buffer(_FLAG, stop),
            n,
            _numbers(forces),
        )
        return forces

    def loop_forces(
        self, contact: int, p: Array, x: Array, Fz: Array, before: int = 0, start: float = 0.0
    ) -> tuple[Array, Array]:
        """Return forces divided by mu0, and their derivatives with respect to ln p, (m, n) each,
        for each p = k / mu0 (m,).  The samples have the displacement ``x`` (n,) and the load ``Fz``
        (n,).  See ``kernel/loop.c``."""
        force, slope = np.empty((p.size, x.size)), np.empty((p.size, x.size))
        room = np.empty(3 * (x.size + before))
        ends = map(_numbers, (room, force, slope))
        numbers = x.size, before, _numbers(x), _numbers(Fz), start
        self._functions.loop_forces(contact, p.size, _numbers(p), *numbers, *ends)
        return force, slope

    # --- for the builder --------------------------------------------------------------------------

    def tabulated(self, data: Data, quantity: int, block: int, a: Array, b: Array) -> Array:
        """Return the tabulated function of ``block`` at its coordinates (n,), as :meth:`places`
        returns them."""
        q = np.empty(a.size)
        self._functions.tabulated(data.pointer, quantity, block, a.size, *map(_numbers, (a, b, q)))
        return q

    def turns_in_stick(self, v: Array, y: Array, stick: Array, bound: Array) -> tuple[Array, Array]:
        """Return 1 - cos of the angle by which the force of one spring turns while it sticks, and
        the bound of its error.  Points (n,) have their stick fraction and its bound."""
        turn, error = np.empty(v.size), np.empty(v.size)
        arrays = map(_numbers, (v, y, stick, bound, turn, error))
        self._functions.turns_in_stick(v.size, *arrays)
        return turn, error

    def forms(
        self, quantity: int, block: int, v: Array, y: Array, eta: Array, contact: int = 0
    ) -> tuple[Array, Array]:
        """Return (base, factor) of value = base + factor q in ``block``, for arrays of any shape.
        ``eta`` = y~ - 1 is used in the corner."""
        base, factor = np.empty(v.shape), np.empty(v.shape)
        v, y, eta = (np.ascontiguousarray(x, np.float64) for x in (v, y, eta))
        numbers = map(_numbers, (v, y, eta, base, factor))
        self._functions.forms(contact, quantity, block, v.size, *numbers)
        return base, factor

    def border_scales(self, piece: int, y: Array) -> tuple[Array, Array]:
        """Return the factors (n,) that give v~crit from the node values of a piece of the border,
        and from its cells."""
        of_nodes, of_cells = np.empty(y.size), np.empty(y.size)
        self._functions.border_scales(
            piece, y.size, *map(_numbers, (np.ascontiguousarray(y), of_nodes, of_cells))
        )
        return of_nodes, of_cells

    def cell_shares(self, w: Array) -> tuple[Array, Array]:
        """Return the error of derivatives at ``w``, (n,), relative to the largest error of a cell:
        inside a block, and in the last cell below the border."""
        inside, at_border = np.empty(w.size), np.empty(w.size)
        self._functions.cell_shares(
            w.size, *map(_numbers, (np.ascontiguousarray(w), inside, at_border))
        )
        return inside, at_border

    def entries(self, t: Array) -> Array:
        """Return y~ at which the ray v~/y~ = t times the steepest one enters stick-slip, for arrays
        of any shape, 0 < t <= 1."""
        t = np.ascontiguousarray(t, np.float64)
        out = np.empty(t.shape)
        self._functions.entries(t.size, _numbers(t), _numbers(out))
        return out

    def normal_form_root(self, v: Array, eta: Array) -> Array:
        """Return the positive root of phi^3 + 2 eta phi = pi v~, (n,)."""
        out = np.empty(v.size)
        self._functions.normal_form_root(v.size, *map(_numbers, (v, eta, out)))
        return out

    def outer_expansion(self, r: Array) -> Array:
        """Return f, g, r f', r g', r (r f')' of mu~ = f(r) + g(r)/v~^2 + ... at r = y~/v~, shape
        (n, 5)."""
        out = np.empty((r.size, 5))
        self._functions.outer_expansion(r.size, _numbers(r), _numbers(out))
        return out


#: the kernels that this processor can run; the best one is the last
kernels = [Kernel(one) for one in map(_LIBRARY.mumacro_kernel_at, range(3)) if one != _NOTHING]

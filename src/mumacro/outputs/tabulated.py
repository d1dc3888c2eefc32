"""Evaluate the quantities of one table at points and for cases: everything that calls the kernel
for them.

Large arrays are cut into slices, on several threads if that is faster
(:mod:`mumacro.kernel.threads`).  Nothing here checks a value: an illegal one gives NaN and the
source code -1.
"""

import copy
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, Self

import numpy as np

from mumacro import closed_forms
from mumacro.errors import TableError
from mumacro.inputs.cases import Cases
from mumacro.inputs.fields import CONTACTS, SPRING, Kind
from mumacro.kernel import threads as slices
from mumacro.kernel.arrays import Array, Bools, Codes
from mumacro.kernel.binding import CaseRows, Data, Detail, ExtremeRows, SlopeRows, kernels
from mumacro.kernel.quadrature import prepare_driven
from mumacro.table import atlas
from mumacro.table.blocks import BorderPiece, Table
from mumacro.table.polynomials import Border, block_rows, outer_cells, quantity_cells

_KERNEL = kernels[-1]
#: for one point, which does not fill the widest registers; the result has the same bits
SCALAR_KERNEL: Final = kernels[min(1, len(kernels) - 1)]
CODES = {name: code for code, name in enumerate(atlas.QUANTITY_NAMES)}


class Tabulated:
    """Hold a table, its cells as the kernel reads them, and the number of threads that a call may
    use."""

    def __init__(self, table: Table, path: Path) -> None:
        self.table = table
        #: the most threads of a call; None for the number that suits the caller
        self.threads: int | None = None
        self.border = Border(table.border)
        _check_border(table.border, path)
        #: by code of the contact, each with at least the cells of mu~; computed on first use
        self._across: dict[int, Data] = {}
        self._springs = self.data()
        #: for one spring, with the cells of mu~
        self.pointer = self._springs.pointer

    def on_threads(self, threads: int | None) -> Self:
        """Return the same table, whose calls use so many threads."""
        other = copy.copy(self)
        other.threads = threads
        return other

    def data(self, name: str = "mu_ratio", kind: Kind = SPRING) -> Data:
        """Return the data that the kernel reads for a quantity, a contact and a direction.  Its
        cells are computed on first use.

        A table has cells for every contact that is shaken across.  Other directions come from
        closed forms of one spring; for a ball from a quadrature over springs.
        """
        code = SPRING.contact if kind.direction else kind.contact
        data = self._across.get(code)
        if data is None:
            data = self._across[code] = self._cells_of(code)
        quantity = CODES[name]
        if quantity not in data.quantities:
            contact = self.table.contacts[CONTACTS[code]]
            data.add_quantity(quantity, *quantity_cells(contact, quantity))
        if kind.direction and kind.contact:
            prepare_driven(data)
        return data

    def _cells_of(self, code: int) -> Data:
        """Return the data of a contact with the cells of mu~."""
        contact = self.table.contacts[CONTACTS[code]]
        data = Data(*self.border.arrays, block_rows(contact), outer_cells())
        data.add_quantity(atlas.MU, *quantity_cells(contact, atlas.MU))
        return data

    # --- points (v~, y~) --------------------------------------------------------------------------

    def ratios(self, v: Array, y: Array) -> Array:
        """Return mu~ of one spring across at points (n,), without its bound."""
        return slices.values_without_bounds(atlas.MU, self._springs, v, y, self.threads)

    def values(
        self, name: str, v: Array, y: Array, kind: Kind = SPRING
    ) -> tuple[Array, Array, Codes]:
        """Return a quantity at points (n,), its bound, and the source codes."""
        return slices.values(CODES[name], self.data(name, kind), v, y, self.threads, kind)

    def value(self, name: str, v: float, y: float, kind: Kind = SPRING) -> tuple[float, float, int]:
        """Return the same at one point."""
        if kind.direction:
            value, bound, source = self.values(name, np.array([v]), np.array([y]), kind)
            return float(value[0]), float(bound[0]), int(source[0])
        return SCALAR_KERNEL.value(self.data(name, kind), CODES[name], v, y, kind.contact)

    def slopes(self, name: str, v: Array, y: Array, kind: Kind = SPRING) -> SlopeRows:
        """Return a quantity across at points (n,), with its derivatives and their bounds."""
        return slices.slopes(CODES[name], self.data(name, kind), v, y, self.threads, kind.contact)

    def crit(self, y: Array, kind: Kind = SPRING) -> Array:
        """Return v~crit at amplitudes (n,)."""
        return _KERNEL.border(self._springs, y, kind)

    def certain(self, v_tilde: Any, y_tilde: Any, kind: Kind = SPRING) -> Bools:
        """Return whether v~ differs from v~crit by more than the error of v~crit and the rounding
        errors of v~ and y~ together, in the shape of both."""
        v, y = np.asarray(v_tilde), np.asarray(y_tilde)
        crit = self.crit(np.ravel(y).astype(np.float64), kind).reshape(y.shape)
        margin = self.border.max_rel_error + 4.0 * atlas.ROUNDING
        with np.errstate(all="ignore"):
            # beyond double range a point is not near the border, or it cannot be decided
            extreme = (y == 0.0) | ~np.isfinite(y) | ~np.isfinite(v) | (v == 0.0)
            return np.asarray(np.where(extreme, ~np.isnan(v), np.abs(v - crit) > margin * crit))

    # --- cases ------------------------------------------------------------------------------------

    def one(self, six: Sequence[Any], gradient: bool = False, contact: int = 0) -> Any:
        """Return one case across as plain numbers: a ``mumacro_case``, see ``kernel/data.h``."""
        data = self._across.get(contact) or self.data(kind=Kind(contact, SPRING.direction))
        return SCALAR_KERNEL.one(data.pointer, six, gradient, contact)

    def rows(self, cases: Cases, detail: Detail = "values") -> CaseRows:
        """Return the answers to cases of one contact and direction, in their shape, (1,) for one
        case."""
        six, kind = [*cases.columns.values()], cases.kind
        shape = cases.shape or (1,)
        return slices.cases(self.data(kind=kind), six, shape, self.threads, detail, kind)

    def extremes(self, cases: Cases) -> ExtremeRows:
        """Return the smallest and largest mu_macro over intervals of k, (n,) each."""
        if cases.ends is None:
            raise TypeError("the cases have one k each")
        low, high = cases.ends
        six, kind = [*{**cases.columns, "k": low}.values()], cases.kind
        of_all = high if isinstance(high, np.ndarray) else np.full(cases.size, high)
        return slices.intervals(self.data(kind=kind), six, of_all, self.threads, kind)


def _check_border(pieces: Sequence[BorderPiece], path: Path) -> None:
    """Refuse a stored border whose nodes differ much from the formula for every y~, because the
    border selects the block of a case."""
    for index, ((name, axis, _), piece) in enumerate(zip(atlas.BORDER_PIECES, pieces, strict=True)):
        y = axis.amplitude(piece.nodes)
        crit = piece.values * _KERNEL.border_scales(index, y)[0]
        if not np.all(np.abs(crit / closed_forms.border_blend(y) - 1.0) < 0.01):
            raise TableError(path, f"the nodes of border/{name} are not v~crit(y~)")

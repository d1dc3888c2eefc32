"""The content of a table: the pieces of the border, the blocks, and a plain grid for people.

Nodes and errors as a table file stores them; ``netcdf.py`` reads and writes them,
``polynomials.py`` turns nodes into cells for evaluation.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mumacro.kernel.arrays import Array
from mumacro.table import atlas

BY_NAME = {quantity.name: quantity for quantity in atlas.QUANTITIES}


@dataclass
class BorderPiece:
    """One piece of v~crit: Chebyshev ``nodes`` (n,) of its coordinate, ``values`` (n,), cells for
    evaluation."""

    nodes: Array
    values: Array
    cells: int
    max_rel_error: float = 0.0


@dataclass
class Block:
    """One block: Chebyshev nodes ``a`` (m,), ``b`` (n,), cells for evaluation, and what is
    tabulated."""

    a: Array
    b: Array
    cells: tuple[int, int]
    #: node values (m, n) by quantity, scaled as in ``kernel/records.c``; no entry where a quantity
    #: is zero
    nodes: dict[str, Array] = field(default_factory=dict)
    #: by quantity (3,): bounds of the errors of what is tabulated and of its derivatives along a
    #: and b, in all cells
    errors: dict[str, Array] = field(
        default_factory=lambda: {name: np.zeros(3) for name in atlas.QUANTITY_NAMES}
    )
    #: the same for every cell (cells, 3), in the order of the cells; derivatives of a ball's power
    #: and stick fraction, whose slopes a table does not give, have 0
    cell_errors: dict[str, Array] = field(default_factory=dict)
    max_abs_error: float = 0.0  #: the largest errors of mu~ that verification met
    max_rel_error: float = 0.0


@dataclass
class Table:
    """Everything that a table file holds."""

    border: list[BorderPiece]
    blocks: list[Block]
    v_tilde: Array
    y_tilde: Array
    mu_ratio: Array
    stick_fraction: Array
    error_estimate: Array
    v_tilde_crit: Array
    attributes: dict[str, Any] = field(default_factory=dict)
    #: the blocks of a ball in the order of ``atlas.BALL_CHARTS``; none before they are built
    ball: list[Block] = field(default_factory=list)

    @property
    def quantities(self) -> list[str]:
        """The names of the tabulated quantities, mu_ratio first."""
        return names_in(self.attributes)

    def quantities_of(self, chart: atlas.Chart) -> list[atlas.Quantity]:
        """The quantities that the block of ``chart`` tabulates."""
        return [BY_NAME[name] for name in self.quantities if chart.holds(BY_NAME[name])]


def names_in(attributes: dict[str, Any]) -> list[str]:
    """The names of the tabulated quantities in the attributes of a table."""
    return str(attributes.get("quantities")).split()

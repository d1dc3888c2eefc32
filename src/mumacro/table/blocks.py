"""Hold the content of a table: the border's pieces, the blocks of each contact, and a plain grid.

Nodes and errors are as a table file stores them.  ``netcdf.py`` reads and writes them,
``polynomials.py`` turns nodes into cells for the evaluation.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mumacro.kernel.arrays import Array
from mumacro.table import atlas

BY_NAME = {quantity.name: quantity for quantity in atlas.QUANTITIES}


@dataclass
class BorderPiece:
    """Hold one piece of v~crit: Chebyshev ``nodes`` (n,) of its coordinate, ``values`` (n,), cells
    for the evaluation."""

    nodes: Array
    values: Array
    cells: int
    max_rel_error: float = 0.0


@dataclass
class Block:
    """Hold one block: Chebyshev nodes ``a`` (m,), ``b`` (n,), cells for the evaluation, and the
    node values."""

    a: Array
    b: Array
    cells: tuple[int, int]
    #: node values (m, n) by quantity, scaled as in ``kernel/records.c``; a quantity that is zero
    #: has no entry
    nodes: dict[str, Array] = field(default_factory=dict)
    #: by quantity (3,): bounds of the errors of the tabulated function, and of its derivatives
    #: along a and b, over all cells
    errors: dict[str, Array] = field(
        default_factory=lambda: {name: np.zeros(3) for name in atlas.QUANTITY_NAMES}
    )
    #: the same for every cell (cells, 3), in the order of the cells; a table gives no derivatives
    #: of a ball's power and stick fraction, so these have 0
    cell_errors: dict[str, Array] = field(default_factory=dict)
    max_abs_error: float = 0.0  #: the largest error of mu~ in the verification
    max_rel_error: float = 0.0


#: the statistics of bound over error in the attribute ``verified_bound_over_error``
RATIOS = ("least", "median", "largest")


#: how tools interpolate the plain grid, over ln v~ and ln y~ -> the statistics of the error, as the
#: attributes of the root and an error distribution name them
INTERPOLATIONS = ("linear", "cubic")
INTERPOLATION_STATISTICS = {"median": "0.5", "99_percent": "0.99", "largest": "1"}


def interpolation_error(method: str, statistic: str) -> str:
    """Return the name of the root's attribute with an error of interpolating the plain grid."""
    return f"interpolation_error_{method}_{statistic}"


INTERPOLATION_ERRORS = tuple(
    interpolation_error(method, statistic)
    for method in INTERPOLATIONS
    for statistic in INTERPOLATION_STATISTICS
)


@dataclass
class TabulatedContact:
    """Hold one contact of a table: its blocks, and what the table states about them."""

    name: str  #: as in ``atlas.CHARTS``
    blocks: list[Block]  #: in the order of the charts
    #: the tolerance of mu~ and the results of the verification; ``docs/table-format.md`` lists them
    attributes: dict[str, Any] = field(default_factory=dict)

    @property
    def charts(self) -> tuple[atlas.Chart, ...]:
        """Return the geometry of the blocks."""
        return atlas.CHARTS[self.name]

    @property
    def tolerance(self) -> float:
        """Return the largest absolute error of mu~ that the build allowed [-]."""
        return float(self.attributes["tolerance"])

    @property
    def error_distribution(self) -> dict[str, dict[str, float]]:
        """Return by quantity: the error that a fraction of the verified points ("0.5" to "1") does
        not exceed, and the :data:`RATIOS` of bound over error."""
        names = self.attributes["verified_quantities"].split()
        heads = [f"{share:g}" for share in self.attributes["verified_quantiles"]]
        errors, ratios = (
            np.reshape(self.attributes[f"verified_{name}"], (len(names), -1)).tolist()
            for name in ("error_quantiles", "bound_over_error")
        )
        return {
            name: dict(zip(heads, error, strict=True)) | dict(zip(RATIOS, ratio, strict=True))
            for name, error, ratio in zip(names, errors, ratios, strict=True)
        }


@dataclass
class Table:
    """Hold everything that is in a table file."""

    border: list[BorderPiece]
    #: by name, in the order of ``atlas.CHARTS``; contacts that are not built yet are missing
    contacts: dict[str, TabulatedContact]
    v_tilde: Array
    y_tilde: Array
    mu_ratio: Array
    stick_fraction: Array
    error_estimate: Array
    v_tilde_crit: Array
    attributes: dict[str, Any] = field(default_factory=dict)  #: attributes of the root

    @property
    def quantities(self) -> list[str]:
        """Return the names of the tabulated quantities, mu_ratio first."""
        return quantity_names(self.attributes)

    @property
    def interpolation_errors(self) -> dict[str, dict[str, float]]:
        """Return the error of tools that interpolate the plain grid, by method: the absolute error
        of mu~ that a fraction of the points ("0.5", "0.99" and "1") does not exceed."""
        return {
            method: {
                share: float(self.attributes[interpolation_error(method, statistic)])
                for statistic, share in INTERPOLATION_STATISTICS.items()
            }
            for method in INTERPOLATIONS
        }

    def quantities_of(self, chart: atlas.Chart) -> list[atlas.TabulatedQuantity]:
        """Return the quantities that the block of ``chart`` tabulates."""
        return [BY_NAME[name] for name in self.quantities if chart.holds(BY_NAME[name])]


def quantity_names(attributes: dict[str, Any]) -> list[str]:
    """Return the names of the tabulated quantities from the attributes of a table."""
    return str(attributes.get("quantities")).split()

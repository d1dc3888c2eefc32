"""The rules of quadrature over the springs of a ball; they grow with the table's tolerance.

The integrals are in ``kernel/contact.c`` (across) and ``kernel/directions.c`` (along).
"""

import numpy as np
from numpy.polynomial import Polynomial

from mumacro.kernel.arrays import Array
from mumacro.kernel.binding import Data

# Gauss's rules after t -> xi with d xi proportional to t^(p - 1) (1 - t)^(q - 1): what ends in a
# root becomes smooth.
_POWERS = ((1, 2), (2, 4), (2, 1), (2, 2), (1, 2))
#: tolerance of a table -> for each piece of the integral (kernel/contact.c) the number of nodes;
#: the largest errors at any legal v~ and y~ that a search found, absolute and relative, see
#: mumacro_rule in kernel/data.h, doubled. ``python benchmarks/contacts.py --only errors`` prints
#: these rows.
_RULES: dict[float, tuple[tuple[int, tuple[float, ...], tuple[float, ...]], ...]] = {
    0.0001: (
        (8, (1.7e-06, 2.1e-07, 0, 3.2e-06, 4.5e-06), (0.72, 2, 0, 0.35, 2)),
        (10, (3.1e-06, 2.1e-07, 4.6e-05, 5.3e-06, 0.00024), (0.49, 1.5, 0.00016, 0.0006, 2)),
        (8, (5.1e-05, 2.6e-06, 0.00021, 0.00014, 0.0022), ()),
        (
            8,
            (1.3e-05, 3.5e-06, 2.7e-05, 2.8e-05, 0.0002),
            (0.0004, 7.9e-06, 7.6e-05, 0.00039, 0.003),
        ),
        (8, (5.5e-06, 2.2e-05, 0, 3.2e-05, 5.3e-05), (2.3e-05, 8.6e-05, 0, 0.00013, 0.00018)),
    ),
    1e-07: (
        (14, (3.1e-08, 1e-09, 0, 7.2e-08, 9.4e-08), (0.31, 1.4, 0, 0.28, 1.4)),
        (16, (5.9e-08, 2e-09, 2.1e-06, 1.4e-07, 4.6e-05), (0.62, 0.98, 8.1e-06, 6.3e-05, 1.5)),
        (16, (4.9e-07, 6.9e-09, 2.3e-05, 2e-06, 0.00023), ()),
        (
            14,
            (6.8e-08, 7.3e-09, 8.5e-07, 7.5e-08, 1.3e-06),
            (8.1e-07, 1.4e-08, 1.9e-06, 8.1e-07, 4.6e-06),
        ),
        (12, (4.1e-08, 1.7e-07, 0, 3.5e-07, 6.2e-07), (1.7e-07, 6.5e-07, 0, 1.5e-06, 2.1e-06)),
    ),
    1e-10: (
        (26, (2.8e-10, 1.1e-12, 0, 6.8e-10, 8.5e-10), (0.15, 0.89, 0, 0.21, 0.89)),
        (28, (2.5e-10, 2.6e-12, 3.4e-08, 7.1e-10, 5.6e-06), (0.32, 0.53, 1.3e-07, 3.9e-06, 0.94)),
        (28, (4.3e-09, 1.3e-11, 3.2e-06, 2.2e-08, 3e-05), ()),
        (
            22,
            (1.7e-10, 8.1e-12, 6e-08, 2e-10, 3.7e-08),
            (2.3e-09, 1.5e-11, 6.6e-08, 2.3e-09, 7.2e-09),
        ),
        (18, (4.7e-11, 2.7e-10, 0, 6.1e-10, 9.5e-10), (2e-10, 1.1e-09, 0, 2.6e-09, 3.2e-09)),
    ),
    1e-12: (
        (40, (9.7e-12, 8e-15, 0, 2.7e-11, 2.9e-11), (0.087, 0.62, 0, 0.16, 0.62)),
        (
            40,
            (5.2e-12, 2.1e-14, 2.3e-09, 1.6e-11, 1.4e-06),
            (2.7e-07, 0.31, 8.5e-09, 6.6e-07, 0.68),
        ),
        (40, (1.3e-10, 8.6e-14, 8.1e-07, 7.7e-10, 5.1e-06), ()),
        (28, (2.4e-12, 0, 1.4e-08, 8.7e-12, 5.8e-09), (7.3e-11, 0, 1.1e-08, 1.5e-10, 1.5e-10)),
        (22, (1.7e-12, 2.2e-12, 0, 2.6e-11, 4.3e-11), (7e-12, 8.5e-12, 0, 3.1e-10, 1.5e-10)),
    ),
}


#: of the rule of oscillation along, for every table: its error is near rounding, and is estimated
#: at the point
DRIVEN_NODES = 28
_DRIVEN_PIECE = 3  # whose powers it has


def rules(tolerance: float) -> list[tuple[Array, Array]]:
    """Points (nodes, 2) and errors (2, 5) of every piece, for a table of this tolerance."""
    table_rules = _RULES[max((t for t in _RULES if t <= 1.01 * tolerance), default=min(_RULES))]
    pieces = []
    for piece, (nodes, *error_rows) in enumerate(table_rules):
        errors = np.zeros((2, 5))
        for row, numbers in zip(errors, error_rows, strict=True):
            row[: len(numbers)] = numbers
        pieces.append((piece_rule(piece, nodes), errors))
    return pieces


def piece_rule(piece: int, nodes: int) -> Array:
    """The rule of a piece, (nodes, 2): the share of the piece beyond a node, and its weight."""
    p, q = _POWERS[piece]
    x, weight = np.polynomial.legendre.leggauss(nodes)
    t = 0.5 * (1.0 + x)
    # the share beyond is a polynomial in 1 - t, exact where it is small
    slope = Polynomial([0.0, 1.0]) ** (q - 1) * Polynomial([1.0, -1.0]) ** (p - 1)
    beyond = slope.integ() / slope.integ()(1.0)
    return np.ascontiguousarray(
        np.stack([beyond(1.0 - t), 0.5 * weight * beyond.deriv()(1.0 - t)], axis=1)
    )


def driven_rule() -> Array:
    """The rule of oscillation along, (nodes, 5): as :func:`points`, and three null rules on the
    same nodes.

    A null rule gives the coefficient of one Legendre polynomial in the integrand, of degree nodes -
    3 to nodes - 1 (Laurie; Berntsen and Espelid): what the rule integrates exactly, and the last
    that it can tell apart.
    """
    x, _ = np.polynomial.legendre.leggauss(DRIVEN_NODES)
    degrees = np.arange(DRIVEN_NODES - 3, DRIVEN_NODES)
    nulls = np.polynomial.legendre.legvander(x, DRIVEN_NODES)[:, degrees] * (2 * degrees + 1)
    return np.ascontiguousarray(
        np.concatenate([piece_rule(_DRIVEN_PIECE, DRIVEN_NODES), nulls], axis=1)
    )


def put_rules(data: Data, tolerance: float) -> None:
    """Give the kernel its rules, once."""
    if not data.rules:
        data.put_rules(rules(tolerance), driven_rule())

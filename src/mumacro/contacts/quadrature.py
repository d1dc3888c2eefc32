"""The rule of quadrature over the springs of a ball that slip backwards under oscillation along.

The integral is in ``kernel/contact.c``.  Its error is near rounding, and is estimated at the point.
"""

import numpy as np
from numpy.polynomial import Polynomial

from mumacro.kernel.arrays import Array
from mumacro.kernel.binding import Data

DRIVEN_NODES = 28


def piece_rule(nodes: int) -> Array:
    """Points (nodes, 2): the share of the radius beyond a node, and its weight.

    Gauss's rule in t, where xi(t) has a slope proportional to t (1 - t): a function of xi that ends
    in a square root is smooth in t.
    """
    x, weight = np.polynomial.legendre.leggauss(nodes)
    t = 0.5 * (1.0 + x)
    # the share beyond is a polynomial in 1 - t, exact where it is small
    slope = Polynomial([0.0, 1.0, -1.0])
    beyond = slope.integ() / slope.integ()(1.0)
    return np.ascontiguousarray(
        np.stack([beyond(1.0 - t), 0.5 * weight * beyond.deriv()(1.0 - t)], axis=1)
    )


def driven_rule() -> Array:
    """The rule of oscillation along, (nodes, 5): as :func:`piece_rule`, and three null rules on the
    same nodes.

    A null rule gives the coefficient of one Legendre polynomial in the integrand, of degree nodes -
    3 to nodes - 1 (Laurie; Berntsen and Espelid): what the rule integrates exactly, and the last
    that it can tell apart.
    """
    x, _ = np.polynomial.legendre.leggauss(DRIVEN_NODES)
    degrees = np.arange(DRIVEN_NODES - 3, DRIVEN_NODES)
    nulls = np.polynomial.legendre.legvander(x, DRIVEN_NODES)[:, degrees] * (2 * degrees + 1)
    return np.ascontiguousarray(np.concatenate([piece_rule(DRIVEN_NODES), nulls], axis=1))


def prepare_driven(data: Data) -> None:
    """Give the kernel the rule of oscillation along, once."""
    if not data.pointer.driven.nodes:
        data.add_driven_rule(driven_rule())

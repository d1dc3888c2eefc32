"""Compute the quadrature rule over the springs of a ball that slip backwards when it oscillates
along.

The integral is in ``kernel/contact.c``.  Its error is close to rounding, and is estimated for each
point.
"""

import numpy as np
from numpy.polynomial import Polynomial

from mumacro.kernel.arrays import Array
from mumacro.kernel.binding import Data

DRIVEN_NODES = 28
#: degrees of the null rules, in three bands whose starts are six apart
DEGREES = np.array([13, 14, 15, 19, 20, 21, 25, 26, 27])


def piece_rule(nodes: int) -> Array:
    """Return points (nodes, 2): the part of the radius beyond a node, and the weight of the node.

    The rule is Gauss's in t.  The derivative of xi(t) is proportional to t (1 - t), so a function
    of xi that ends in a square root is smooth in t.
    """
    x, weight = np.polynomial.legendre.leggauss(nodes)
    t = 0.5 * (1.0 + x)
    # the part beyond is a polynomial in 1 - t, which is exact where it is small
    slope = Polynomial([0.0, 1.0, -1.0])
    beyond = slope.integ() / slope.integ()(1.0)
    return np.ascontiguousarray(
        np.stack([beyond(1.0 - t), 0.5 * weight * beyond.deriv()(1.0 - t)], axis=1)
    )


def driven_rule() -> Array:
    """Return the rule for oscillation along, (nodes, 11): :func:`piece_rule`, and nine null rules
    on the same nodes.

    A null rule gives the coefficient of one Legendre polynomial in the integrand (Laurie; Berntsen
    and Espelid).  There are three bands of :data:`DEGREES`: the last has the highest degrees that
    the nodes can resolve, and the others show how fast the coefficients fall.
    """
    x, _ = np.polynomial.legendre.leggauss(DRIVEN_NODES)
    nulls = np.polynomial.legendre.legvander(x, DRIVEN_NODES)[:, DEGREES] * (2 * DEGREES + 1)
    return np.ascontiguousarray(np.concatenate([piece_rule(DRIVEN_NODES), nulls], axis=1))


def prepare_driven(data: Data) -> None:
    """Give the kernel the rule for oscillation along, if it does not have it yet."""
    if not data.pointer.driven.nodes:
        data.add_driven_rule(driven_rule())

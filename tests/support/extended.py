"""Oscillation along and of the normal force in extended precision: the reference for bounds of the
kernel.

The formulas are those of ``mumacro/kernel/directions.c``, checked against a play operator in
``tests/mumacro/contacts/test_contact_directions.py``; here they are evaluated with the 64 bits of
``numpy.longdouble`` (x86), by bisection and Newton's method to the last digit, and a ball by rules
of many nodes.
Arrays broadcast; rows come in the order of :data:`ROWS`.
"""

import math
from copy import copy
from typing import Any

import numpy as np

from mumacro.kernel.quadrature import piece_rule

Long = np.longdouble
#: mu~, power, stick fraction, slopes along ln v~ and ln y~
ROWS = ("mu_ratio", "power", "stick_fraction", "slope along v~", "slope along y~")
#: whether this machine has more digits than a double
HAS_EXTENDED = bool(np.finfo(Long).eps < 1e-18)

PI = Long(math.pi) + Long(1.2246467991473532e-16)
TERMS = 16


def exact(numerator: int, denominator: int) -> Any:
    """A fraction as an extended number."""
    return Long(numerator) / Long(denominator)


# (1 - sin m / m) / m^2 and (sin m - m cos m) / m^3, by powers of m^2
LAG = [exact((-1) ** i, 1) / Long(math.factorial(2 * i + 3)) for i in range(TERMS)]
BENT = [Long(2 * i + 2) * term for i, term in enumerate(LAG)]
# (s^2/2 - 1 + cos s) / s^4
DIP = [exact((-1) ** i, 1) / Long(math.factorial(2 * i + 4)) for i in range(TERMS)]


def series(terms: list[Any], q: Any) -> Any:
    """A polynomial, its lowest power first."""
    total = np.zeros_like(q)
    for term in reversed(terms):
        total = total * q + term
    return total


class Arc:
    """sin m, cos m, 1 - cos m, m - sin m, sin m - m cos m, m - sin m cos m without loss of
    digits."""

    def __init__(self, m: Any) -> None:
        near = m <= 2.0
        q = np.where(near, m * m, 0.0).astype(Long)
        self.sine = np.where(m > 2.0, np.sin(PI - m), np.sin(m))
        self.cosine = np.cos(m)
        half = np.sin(0.5 * m)
        self.versed = 2.0 * half * half
        self.lag = np.where(near, m * q * series(LAG, q), m - self.sine)
        self.bent = np.where(near, m * q * series(BENT, q), self.sine - m * self.cosine)
        self.rest = np.where(near, self.lag + self.sine * self.versed, m - self.sine * self.cosine)


class Turning:
    """x = v~/a, sin c, c = arccos x, b = arcsin x, D/a = 2 (sin c - c cos c)."""

    def __init__(self, v: Any, a: Any) -> None:
        gap = (a - v) / a
        self.x = v / a
        self.sine = np.sqrt(gap * (1.0 + self.x))
        self.c = 2.0 * np.arcsin(np.sqrt(0.5 * gap))
        self.b = np.where(self.x < 0.5, np.arcsin(self.x), 0.5 * PI - self.c)
        self.travel = 2.0 * Arc(self.c).bent

    def of(self, chosen: Any) -> "Turning":
        """Those with these numbers."""
        some = copy(self)
        vars(some).update({name: x[chosen] for name, x in vars(self).items()})
        return some


def half_stick(at: Turning) -> tuple[Any, Any]:
    """h and pi - h of a spring that does not slip backwards, by bisection in the logarithm of the
    nearer one."""
    # the equation (h - sin h cos h) cos c = sin^2 h sin c has one root; its left side less its
    # right one rises with h
    small = at.x > 0.3
    low, high = np.full(at.x.shape, Long(1e-30)), np.full(at.x.shape, PI)
    low = np.where(small, np.minimum(at.c, 1.0), Long(1e-30) * at.x + Long(1e-25))
    high = np.where(small, 2.2, PI - 0.1)
    for _ in range(90):
        middle = np.sqrt(low * high)
        h = np.where(small, middle, PI - middle)
        rest = np.where(small, Arc(h).rest, PI - middle + np.sin(middle) * np.cos(middle))
        sine = np.where(small, Arc(h).sine, np.sin(middle))
        above = rest * at.x > sine * sine * at.sine
        lower = above == small
        high, low = np.where(lower, middle, high), np.where(lower, low, middle)
    middle = np.sqrt(low * high)
    return np.where(small, middle, PI - middle), np.where(small, PI - middle, middle)


def deficit(h: Any, rest_of_pi: Any) -> Any:
    """1 - N0 for half the duration of stick."""
    arc = Arc(h)
    sine = np.where(h > 2.0, np.sin(rest_of_pi), arc.sine)
    bent = np.where(h > 2.0, sine - h * arc.cosine, arc.bent)
    rest = np.where(h > 2.0, h - sine * arc.cosine, arc.rest)
    return bent * bent / (PI * np.sqrt(rest * rest + sine**4))


def of_reverse(at: Turning, m: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
    """p, 1 - m cot m, F(m), its slope, whether m is legal."""
    arc = Arc(m)
    more = arc.lag / arc.sine
    cosine = at.x * (1.0 + more)
    legal = (arc.sine > 0.0) & (cosine <= 1.0)
    root = np.sqrt(np.maximum((1.0 - cosine) * (1.0 + cosine), 0.0))
    apart = at.x * more * (at.x + cosine) / (at.sine + root)
    p = np.arcsin(np.clip(at.x * (more * at.sine + apart), -1.0, 1.0))
    rest = apart + arc.versed * root - p * at.x
    turn = at.x * (arc.versed - arc.cosine * more)
    slope = arc.sine * root - turn * turn / (arc.sine * root)
    inside = m + p < 2.0 * at.c
    return p, arc.bent / arc.sine, rest, slope, legal, inside


def reverse_root(at: Turning, a: Any) -> Any:
    """m with F(m) = 2/a by safeguarded Newton steps."""
    m = 2.0 * np.arcsin(np.minimum(1.0 / np.sqrt(a), 1.0))
    low, high, going = np.zeros_like(m), np.full(m.shape, PI), np.arange(m.size)
    for _ in range(100):
        before, below, beyond = m[going], low[going], high[going]
        _, _, rest, slope, legal, inside = of_reverse(at.of(going), before)
        off = np.where(legal, rest - 2.0 / a[going], np.inf)
        slope = np.where(legal & inside, slope, np.where(legal, 0.0, np.nan))
        upper = (off > 0.0) | ~(slope > 0.0)
        beyond, below = np.where(upper, before, beyond), np.where(upper, below, before)
        after = before - off / slope
        after = np.where((after >= below) & (after <= beyond), after, 0.5 * (below + beyond))
        m[going], low[going], high[going] = after, below, beyond
        # a point that has ended costs nothing any more
        going = going[np.abs(after - before) > 1e-19 * before]
    return m


def way_in_stick(at: Turning, a: Any, s: Any, way: float) -> Any:
    """a times the integral of the way since the turn over the stick s after it."""
    arc, q = Arc(np.abs(s)), s * s
    lag = np.sign(s) * arc.lag
    dip = np.where(
        np.abs(s) < 2.0,
        q * q * series(DIP, np.where(np.abs(s) < 2.0, q, 0.0).astype(Long)),
        0.5 * q - arc.versed,
    )
    return a * (at.sine * lag - way * at.x * dip)


def spring(v: Any, a: Any, reverses: bool = True, at: Turning | None = None) -> Any:
    """The rows of springs, shape (5, n), for 0 <= v~ < a; ``reverses`` False: direction normal."""
    v, a = np.broadcast_arrays(np.asarray(v, Long), np.asarray(a, Long))
    with np.errstate(all="ignore"):
        at = at or Turning(v, a)
        h, rest_of_pi = half_stick(at)
        h, rest_of_pi = np.where(at.x == 0.0, PI, h), np.where(at.x == 0.0, 0.0, rest_of_pi)
        lack = a * deficit(h, rest_of_pi)
        along_v = v * h * h / PI
        out = np.array([1.0 - lack, v * lack, h / PI, along_v, -(lack + along_v)])
        backwards = reverses & (a * at.travel > 2.0)
        if backwards.any():
            some = Turning(v[backwards], a[backwards])
            out[:, backwards] = reversing(some, v[backwards], a[backwards])
    return out


def reversing(at: Turning, v: Any, a: Any) -> Any:
    """The rows of springs that slip backwards, too."""
    m = reverse_root(at, a)
    p, bent, *_ = of_reverse(at, m)
    both = m * m + p * p
    of_slow = a * (at.x * (both - 2.0 * bent) - 2.0 * p * at.sine)
    layers = np.where(
        at.x < 0.5, of_slow, way_in_stick(at, a, m - p, -1.0) - way_in_stick(at, a, m + p, 1.0)
    )
    layers = np.where(a > 1e100, 0.0, layers)
    mu = np.clip(2.0 / PI * (at.b + p) + layers / (2.0 * PI), 0.0, 1.0)
    along_v = v * both / (2.0 * PI)
    power = v * (1.0 - mu) + (a * at.travel - 2.0) / PI
    return np.array([mu, power, m / PI, along_v, layers / (2.0 * PI) - along_v])


def shares(nodes: int, panels: int) -> Any:
    """The rule over the springs that slip backwards: in panels that halve towards the last one, (n,
    2)."""
    rule = piece_rule(nodes).astype(Long)
    parts = [(Long(0.0), Long(0.5))] + [
        (1.0 - Long(0.5) ** k, Long(0.5) ** (k + 1)) for k in range(1, panels)
    ]
    parts = (
        [*parts, (1.0 - Long(0.5) ** panels, Long(0.5) ** panels)]
        if panels
        else [(Long(0.0), Long(1.0))]
    )
    return np.concatenate(
        [np.stack([start + size * rule[:, 0], size * rule[:, 1]], axis=1) for start, size in parts]
    )


def ball(v: Any, y: Any, nodes: int = 64, panels: int = 0) -> Any:
    """The rows of balls, shape (5, n), for 0 <= v~ < y~; more panels where mu~ falls steeply,
    beside y~ = 1.5."""
    v, y = np.broadcast_arrays(np.asarray(v, Long), np.asarray(y, Long))
    with np.errstate(all="ignore"):
        at = Turning(v, y)
        load = 0.5 * at.travel * y / Long(1.5)  # s of the last spring without reverse slip
        edge = np.where(load < 1.0, load / (1.0 + np.sqrt(np.maximum(1.0 - load, 0.0))), Long(1.0))
        still = 1.0 - edge
        h, rest_of_pi = half_stick(at)
        h, rest_of_pi = np.where(at.x == 0.0, PI, h), np.where(at.x == 0.0, 0.0, rest_of_pi)
        carried = Long(1.5) * still * (1.0 - still * still / 3.0)
        lack = y * deficit(h, rest_of_pi) * still
        along_v = v * h * h / PI * still
        out = np.array([carried - lack, 0.0 * v, carried * h / PI, along_v, -(lack + along_v)])
        beyond, weight = shares(nodes, panels).T[:, :, None]
        rest = edge * beyond  # of every node and point
        s = np.maximum(rest * (2.0 - rest), np.maximum(np.maximum(v, y), 1.0) / Long(1e300))
        share = Long(1.5) * s * edge * weight
        every = at.of(np.tile(np.arange(v.size), len(s)))
        rows = reversing(every, (v / (Long(1.5) * s)).ravel(), (y / (Long(1.5) * s)).ravel())
        out += np.where(edge > 0.0, share * rows.reshape(5, *s.shape), 0.0).sum(axis=1)
        out[0] = np.clip(out[0], 0.0, 1.0)
        # 3/2 int s (y~ D/y~ - 3 s) / pi over the springs that slip backwards
        of_load, of_square = edge**2 - edge**3 / 3.0, 4.0 * edge**3 / 3.0 - edge**4 + edge**5 / 5.0
        out[1] = Long(1.5) * (y * at.travel * of_load - 3.0 * of_square) / PI + v * (1.0 - out[0])
    return out

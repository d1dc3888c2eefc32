"""Define the atlas: how the quadrant v~, y~ >= 0 is divided into blocks, and the coordinates of
each block.

``kernel/atlas.c`` lists the blocks and the pieces of the border, ``kernel/records.c`` the
quantities; this module reads these lists.  It also defines the coordinates of a table file, and
converts between (v~, y~) and a chart.

The power p = <y~ cos tau u_y> is the mean power of the shaker in units of mu0 Fz l0 omega; the
power of the drive is v~ mu~.  The stick fraction f is the part of the period during which the
contact sticks.
"""

import functools
import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mumacro.kernel.arrays import Array
from mumacro.kernel.binding import kernels

_ATLAS = kernels[-1].atlas
_text = kernels[-1].text

Y_STICK_LO, Y_STICK_HI, Y_CONT = _ATLAS.y_stick_lo, _ATLAS.y_stick_hi, _ATLAS.y_cont
Y_MID, Y_HIGH, Y_TAIL = _ATLAS.y_mid, _ATLAS.y_high, _ATLAS.y_tail
S_CUT, SIGMA_CUT = _ATLAS.s_cut, _ATLAS.sigma_cut
RHO_MAX, FAST_KAPPA = _ATLAS.rho_max, _ATLAS.fast_kappa
ROUNDING = _ATLAS.rounding  # of coordinates and sums, relative to the scale of the value
SQRT2 = math.sqrt(2.0)
#: load of a ball's middle spring over the mean load; the steepest ray v~/y~ that touches the
#: border, and y~ and v~ of the point where it touches
MIDDLE, STEEPEST, STEEPEST_Y = _ATLAS.middle, _ATLAS.steepest, _ATLAS.steepest_y
SLOW = _ATLAS.slow
_KNOT, _SCALE = _ATLAS.fold_knot, _ATLAS.fold_scale
REGIMES = tuple(_text(_ATLAS.regime_name[i]) for i in range(_ATLAS.regimes))
CONTINUOUS, STICK_SLIP, STATIC = (
    REGIMES.index(name) for name in ("continuous", "stick_slip", "static")
)

#: coordinate of a table file -> its meaning
COORDINATES = {
    "y_squared": "square of the dimensionless amplitude",
    "v_squared_share": "v_tilde^2/(1 + v_tilde^2)",
    "ln_y": "natural logarithm of y_tilde",
    "ln_rho": "natural logarithm of v_tilde/v_tilde_crit",
    "ln_kappa": "natural logarithm of v_tilde/sqrt(y_tilde)",
    "inverse_y": "1/y_tilde",
    "s": "s with v_tilde = v_tilde_crit sin^2(pi s/2)",
    "y": "dimensionless amplitude y_tilde",
    "radius": "distance R from the corner y_tilde = 1, v_tilde = 0 in normal-form coordinates",
    "angle": "polar angle of the normal form, 2 psi/pi",
    "y_root": "sixth root of y_tilde",
    "v_root": "sixth root of v_tilde over its largest value here, 0.43263",
    "ray_squared": "(0.33517 y_tilde/v_tilde)^2",
    "ray_root": "x with v_tilde/y_tilde = 0.33517 sin^2(pi x^3/2)",
    "way_root": "x with y_tilde = sin^2(pi x^3/2) times that at which the ray enters stick-slip",
    "s_root": "x with v_tilde = v_tilde_crit sin^2(pi x^3/2)",
    "angle_root": "x with 1 - x^3 = 2 psi/pi, the polar angle of the normal form",
}
#: coordinates whose cells have an edge in the middle, where the formula of the evaluation changes
_FOLDED = ("ray_root", "way_root", "s_root")


@dataclass(frozen=True)
class Axis:
    """Define one coordinate of a chart: its name in :data:`COORDINATES` and its range in the table
    file.

    The evaluation uses another coordinate than the file where that is faster: sigma instead of s,
    and tan(psi/2) instead of the angle. sigma is sqrt(rho) up to rho = v~/v~crit = 1/2, and sqrt 2
    - sqrt(1 - rho) above.  Both square-root edges become smooth at the cost of one square root; the
    knot between the halves is an edge of cells.  A folded coordinate has the sixth root instead of
    the square root at its lower end, and its second half has the length of the first.
    """

    name: str
    low: float
    high: float

    @functools.cached_property
    def knotted(self) -> bool:
        """Return whether the middle must be an edge of cells."""
        return self.name == "s" or self.name in _FOLDED

    @functools.cached_property
    def edge(self) -> tuple[float, float]:
        """Return (end, scale) of the evaluation's coordinate: near x = 1 it is end - scale sqrt(1 -
        x)."""
        return (2.0 * _KNOT, _SCALE) if self.name in _FOLDED else (SQRT2, 1.0)

    @functools.cached_property
    def span(self) -> tuple[float, float]:
        """Return the range of the evaluation's coordinate; along s the cells cover all of [0, sqrt
        2]."""
        return (0.0, self.edge[0]) if self.knotted else (self.low, self.high)

    def to_file(self, x: Array) -> Array:
        """Return the table file's coordinate at the evaluation's ``x`` (n,)."""
        if self.name == "angle":
            return np.asarray(4.0 / np.pi * np.arctan(x), dtype=np.float64)
        if self.name == "angle_root":
            return np.asarray(np.cbrt(4.0 / np.pi * np.arctan(x**3)), dtype=np.float64)
        if self.name in _FOLDED:
            low = np.arcsin(np.minimum(x, _KNOT) ** 3)
            rest = np.clip((2.0 * _KNOT - x) / _SCALE, 0.0, math.sqrt(0.5))
            s = 2.0 / math.pi * np.where(x <= _KNOT, low, 0.5 * math.pi - np.arcsin(rest))
            return np.asarray(np.cbrt(s), dtype=np.float64)
        if self.name != "s":
            return x
        low = np.arcsin(np.minimum(x, math.sqrt(0.5)))
        high = 0.5 * math.pi - np.arcsin(np.clip(SQRT2 - x, 0.0, math.sqrt(0.5)))
        return np.asarray(2.0 / math.pi * np.where(x <= math.sqrt(0.5), low, high))

    def cell_positions(self, cells: int, local: Array) -> tuple[Array, Array]:
        """Return the points ``local`` (m,), from -1 to 1, of each cell of this axis, (cells m,): as
        the evaluation's coordinate, and as positions in [-1, 1] on the nodes of the table file.

        Along s, points below the block are never evaluated; cells that lie completely below it
        repeat its edge.
        """
        start, stop = self.span
        edge = np.arange(cells)[:, None]
        x = (start + (stop - start) * (0.5 * (2.0 * edge + 1.0 + local[None, :]) / cells)).ravel()
        position = self.to_file(x)
        if self.name == "s":
            below = self.to_file(SQRT2 * (np.arange(cells) + 1.0) / cells) <= self.low
            position.reshape(cells, local.size)[below] = self.low
        return x, (2.0 * position - self.low - self.high) / (self.high - self.low)

    def to_evaluation(self, x: Array) -> Array:
        """Return the evaluation's coordinate at the table file's ``x`` (n,)."""
        if self.name == "angle":
            return np.asarray(np.tan(0.25 * np.pi * x), dtype=np.float64)
        if self.name == "angle_root":
            return np.asarray(np.cbrt(np.tan(0.25 * np.pi * x**3)), dtype=np.float64)
        if self.name in _FOLDED:
            angle = 0.5 * np.pi * x**3
            high = 2.0 * _KNOT - _SCALE * np.cos(angle)
            return np.where(angle <= 0.25 * np.pi, np.cbrt(np.sin(angle)), high)
        if self.name != "s":
            return x
        return np.where(x <= 0.5, np.sin(0.5 * np.pi * x), SQRT2 - np.cos(0.5 * np.pi * x))

    def amplitude(self, x: Array) -> Array:
        """Return y~ at the table file's coordinate ``x``, if this is an axis of amplitudes."""
        if self.name == "y_squared":
            return np.asarray(np.sqrt(x), dtype=np.float64)
        if self.name == "ln_y":
            return np.asarray(np.exp(x), dtype=np.float64)
        if self.name == "y_root":
            return np.asarray(x**6, dtype=np.float64)
        return np.asarray(1.0 / x if self.name == "inverse_y" else x.copy(), dtype=np.float64)


def _cosine(share: Array, rest: Array, name: str) -> Array:
    """Return cos(pi/2 share), or the sine of the rest if the rest is known."""
    return np.asarray(
        np.cos(0.5 * math.pi * share) if name == "angle" else np.sin(0.5 * math.pi * rest)
    )


@dataclass(frozen=True)
class TabulatedQuantity:
    """Describe one tabulated quantity: name, variable in a block of a table file, meaning.

    ``while_sliding``: whether it is not zero in continuous sliding.  ``smooth_at_border``: whether
    it has no root and no jump there.
    """

    name: str
    variable: str
    meaning: str
    while_sliding: bool
    smooth_at_border: bool


@dataclass(frozen=True)
class Chart:
    """Describe one block: name, regime, coordinates with their ranges, and what its nodes hold for
    mu~.

    ``floor`` and ``rounding`` are the allowance for rounding in the bound of mu~: absolute, and
    relative to the factor.  The checksum of a table covers the repr of its charts, so the names of
    the other fields here and in :class:`Axis` belong to the file's format.
    """

    name: str
    regime: int
    a: Axis
    b: Axis
    quantity: str
    floor: float = field(repr=False)
    rounding: float = field(repr=False)

    def point(
        self, a: Array, b: Array, border_of: Callable[[Array], Array]
    ) -> tuple[Array, Array, Array]:
        """Return (v~, y~, eta = y~ - 1) at the table file's coordinates ``a``, ``b`` (broadcast
        together).

        eta is exact in the corner, where rounding y~ to double would cost 1e-16/mu~.  ``border_of``
        gives v~crit(y~): the stored curve, so that nodes and evaluation use the same one.
        """
        a, b = np.broadcast_arrays(a, b)
        if self.a.name == "radius":
            share = b if self.b.name == "angle" else 1.0 - b**3
            rest = 1.0 - b if self.b.name == "angle" else b**3
            phi = a * np.sin(0.5 * math.pi * share) / SQRT2
            # the sine of the rest keeps its digits near the static limit
            s0 = SQRT2 * a * _cosine(share, rest, self.b.name)
            eta = 0.25 * s0 * s0 - 0.5 * phi * phi
            return phi * s0 * s0 / (2.0 * math.pi), 1.0 + eta, eta
        if self.a.name == "v_root":
            v = SLOW * a**6
            y = np.sqrt(b) * v / STEEPEST
            return v, y, y - 1.0
        if self.a.name == "ray_root":
            ray = np.sin(0.5 * math.pi * a**3) ** 2
            y = kernels[-1].entries(ray) * np.sin(0.5 * math.pi * b**3) ** 2
            return STEEPEST * ray * y, y, y - 1.0
        y = self.a.amplitude(a)
        if self.b.name == "v_squared_share":
            v = np.sqrt(b / (1.0 - b))
        elif self.b.name == "ln_rho":
            v = np.exp(b) * border_of(y)
        elif self.b.name == "ln_kappa":
            v = np.exp(b) * np.sqrt(y)
        elif self.b.name == "s_root":
            v = border_of(y) * np.sin(0.5 * math.pi * b**3) ** 2
        else:
            v = border_of(y) * np.sin(0.5 * math.pi * b) ** 2
        return v, y, y - 1.0

    def holds(self, quantity: TabulatedQuantity) -> bool:
        """Return whether the block tabulates a quantity; if not, the quantity is zero there."""
        return self.regime != CONTINUOUS or quantity.while_sliding


def _axis(axis: Any) -> Axis:
    return Axis(_text(axis.name), axis.low, axis.high)


def _quantity(q: Any) -> TabulatedQuantity:
    texts = _text(q.name), _text(q.variable), _text(q.meaning)
    return TabulatedQuantity(*texts, bool(q.while_sliding), bool(q.smooth_at_border))


def _listed(entry: Callable[[int], Any]) -> Iterator[Any]:
    """Yield the entries of a list of the kernel; its end is a null entry."""
    return itertools.takewhile(bool, map(entry, itertools.count()))


def _charts(contact: int) -> tuple[Chart, ...]:
    return tuple(
        Chart(
            _text(c.name), c.regime, _axis(c.a), _axis(c.b), _text(c.tabulated), c.floor, c.rounding
        )
        for c in _listed(functools.partial(kernels[-1].chart, contact))
    )


#: the blocks of each contact that is shaken across, in the order of the kernel's codes of contacts;
#: the blocks of a ball are over v~/1.5 and y~/1.5
CHARTS: dict[str, tuple[Chart, ...]] = {
    name: _charts(contact) for contact, name in enumerate(("spring", "ball"))
}
#: blocks of a spring; the index of a block in this list is the source code of its values
BLOCK_NAMES = tuple(chart.name for chart in CHARTS["spring"])
#: pieces of v~crit: name, coordinate, what its nodes hold
BORDER_PIECES = tuple(
    (_text(p.name), _axis(p.axis), _text(p.tabulated))
    for p in (_ATLAS.piece[i] for i in range(_ATLAS.pieces))
)
QUANTITIES = tuple(map(_quantity, _listed(kernels[-1].quantity)))
QUANTITY_NAMES = tuple(quantity.name for quantity in QUANTITIES)
MU, POWER, STICK = map(QUANTITY_NAMES.index, ("mu_ratio", "power", "stick_fraction"))
_SOURCES = tuple(itertools.takewhile(lambda s: s.name, map(kernels[-1].source, itertools.count())))
#: source of an answer: a block, or a limit in closed form
SOURCES = tuple(_text(source.name) for source in _SOURCES)
#: regime code of every source code
REGIME_OF_SOURCE = np.array([source.regime for source in _SOURCES], dtype=np.int8)

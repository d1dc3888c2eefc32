"""Choose where a contact is tested: points of every type, and points next to the lines where its
blocks meet.

``v`` and ``y`` belong to the charts: v~ and y~ of one spring; for a ball those of its middle
spring.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from mumacro import Surrogate
from mumacro.kernel.arrays import Array
from mumacro.table import atlas
from mumacro.table.atlas import STEEPEST, STEEPEST_Y

Draw = Callable[[np.random.Generator, int, Surrogate], tuple[Array, Array]]
#: pairs of points (v, v, y, y) on the two sides of lines
Pairs = Iterator[tuple[Array, Array, Array, Array]]


class Draws(NamedTuple):
    """Describe where one contact is tested."""

    #: name of a case -> its part of the points, and how they are drawn
    cases: dict[str, tuple[float, Draw]]
    #: points next to the lines where two blocks, or a block and a tail, meet
    near_seams: Draw
    #: n pairs on the two sides of each such line, for a seed
    sides: Callable[[Surrogate, int, int], Pairs]
    #: distance of points in ln v from lines near the border where derivatives have a step
    off_steps: Callable[[Array, Array], Array]

    def draw(self, case: str, n: int, surrogate: Surrogate, seed: int) -> tuple[Array, Array]:
        """Return ``n`` points of one entry of :attr:`cases`."""
        return self.cases[case][1](np.random.default_rng(seed), n, surrogate)


def log_uniform(rng: np.random.Generator, low: float, high: float, n: int) -> Array:
    """Return ``n`` random numbers from ``low`` to ``high``, uniform in their logarithm, (n,)."""
    return 10.0 ** rng.uniform(math.log10(low), math.log10(high), n)


def fast_from(s: Surrogate, y: Array) -> Array:
    """Return v~ from which the closed form for large speed answers, y~ > Y_CONT."""
    below = atlas.RHO_MAX * s.v_tilde_crit(y)
    return np.asarray(np.where(y <= atlas.Y_TAIL, below, atlas.FAST_KAPPA * np.sqrt(y)))


# --- one spring -----------------------------------------------------------------------------------

#: amplitudes at which blocks meet
SEAMS = (atlas.Y_STICK_LO, atlas.Y_CONT, atlas.Y_MID, atlas.Y_HIGH, atlas.Y_TAIL)


def _near_seams(rng: np.random.Generator, n: int, s: Surrogate) -> tuple[Array, Array]:
    y, v = log_uniform(rng, 1e-3, 1e6, n), log_uniform(rng, 1e-6, 1e4, n)
    off = 1.0 + rng.choice([-1.0, 1.0], n) * log_uniform(rng, 1e-12, 1e-3, n)
    place = rng.integers(0, 4, n)
    y = np.where(place < 2, rng.choice(SEAMS, n) * off, y)
    cut, fast = place == 2, place == 3
    y[cut] = rng.uniform(atlas.Y_STICK_LO, atlas.Y_STICK_HI, int(cut.sum()))
    v[cut] = s.v_tilde_crit(y[cut]) * atlas.SIGMA_CUT**2 * off[cut]
    y[fast] = log_uniform(rng, atlas.Y_CONT, 1e6, int(fast.sum()))
    v[fast] = fast_from(s, y[fast]) * off[fast]
    return v, y


def _corner(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    radius, psi = log_uniform(rng, 1e-6, 1.3, n), rng.uniform(0.0, 0.5 * math.pi, n)
    phi, s0 = radius * np.sin(psi) / math.sqrt(2.0), math.sqrt(2.0) * radius * np.cos(psi)
    return phi * s0 * s0 / (2.0 * math.pi), 1.0 + 0.25 * s0 * s0 - 0.5 * phi * phi


def _border(rng: np.random.Generator, n: int, s: Surrogate) -> tuple[Array, Array]:
    y = log_uniform(rng, 1e-4, 1e6, n)
    return s.v_tilde_crit(y) * (
        1.0 + rng.choice([-1.0, 1.0], n) * log_uniform(rng, 1e-12, 0.1, n)
    ), y


def _tails(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Return points of large amplitude at every speed, of large speed at every amplitude, and of
    small amplitude."""
    place = rng.integers(0, 3, n)
    v, y = log_uniform(rng, 1e-6, 1e8, n), log_uniform(rng, 1e5, 1e12, n)
    v = np.where(place == 1, log_uniform(rng, 1e3, 1e8, n), v)
    y = np.where(place == 1, log_uniform(rng, 1e-3, 1e8, n), y)
    return v, np.where(place == 2, log_uniform(rng, 1e-9, 1e-3, n), y)


_CASES: dict[str, tuple[float, Draw]] = {
    "random": (
        0.30,
        lambda rng, n, _: (log_uniform(rng, 1e-3, 1e3, n), log_uniform(rng, 1e-3, 1e3, n)),
    ),
    "wide": (
        0.20,
        lambda rng, n, _: (log_uniform(rng, 1e-12, 1e8, n), log_uniform(rng, 1e-8, 1e8, n)),
    ),
    "border": (0.12, _border),
    "corner": (0.12, lambda rng, n, _: _corner(rng, n)),
    "seams": (0.10, _near_seams),
    "creep": (
        0.08,
        lambda rng, n, _: (log_uniform(rng, 1e-12, 1e-4, n), log_uniform(rng, 1e-2, 1e3, n)),
    ),
    "tails": (0.08, lambda rng, n, _: _tails(rng, n)),
}


#: factors to either side of a line
SIDES = (1 - 1e-13, 1 + 1e-13)


def _common_sides(
    surrogate: Surrogate, rng: np.random.Generator, n: int, seams: Sequence[float], end: float
) -> Pairs:
    """Return pairs (v, v, y, y) of points 2e-13 apart, on either side of seams, the border, and the
    edge of the corner up to y = ``end``."""
    low, high = SIDES
    for seam in seams:
        v = log_uniform(rng, 1e-9, 1e5, n)
        yield v, v, np.full(n, seam * low), np.full(n, seam * high)
    y = log_uniform(rng, 1e-3, 1e7, n)
    yield (v := surrogate.v_tilde_crit(y)) * low, v * high, y, y
    y = rng.uniform(atlas.Y_STICK_LO, end, n)
    yield (v := surrogate.v_tilde_crit(y) * atlas.SIGMA_CUT**2) * low, v * high, y, y


def _sides(surrogate: Surrogate, n: int, seed: int) -> Pairs:
    """Return the pairs of every contact, and pairs at the edge of the closed form."""
    rng, (low, high) = np.random.default_rng(seed), SIDES
    yield from _common_sides(surrogate, rng, n, SEAMS, atlas.Y_STICK_HI)
    y = log_uniform(rng, atlas.Y_CONT, 1e8, n)
    yield (v := fast_from(surrogate, y)) * low, v * high, y, y


# --- a ball ---------------------------------------------------------------------------------------

_BALL_SEAMS = (atlas.Y_STICK_LO, STEEPEST_Y, atlas.Y_MID, atlas.Y_HIGH, atlas.Y_TAIL)


def _near_ball_seams(rng: np.random.Generator, n: int, s: Surrogate) -> tuple[Array, Array]:
    y, v = log_uniform(rng, 1e-3, 1e6, n), log_uniform(rng, 1e-6, 1e4, n)
    off = 1.0 + rng.choice([-1.0, 1.0], n) * log_uniform(rng, 1e-12, 1e-3, n)
    place = rng.integers(0, 8, n)
    y = np.where(place < 2, rng.choice(_BALL_SEAMS, n) * off, y)
    cut, fast, ray, slow, border, ridge = (place == i for i in range(2, 8))
    y[cut] = rng.uniform(atlas.Y_STICK_LO, STEEPEST_Y, int(cut.sum()))
    v[cut] = s.v_tilde_crit(y[cut]) * atlas.SIGMA_CUT**2 * off[cut]
    y[fast] = log_uniform(rng, STEEPEST_Y, 1e6, int(fast.sum()))
    v[fast] = atlas.RHO_MAX * s.v_tilde_crit(y[fast]) * off[fast]
    y[ray] = log_uniform(rng, 1e-6, STEEPEST_Y, int(ray.sum()))
    v[ray] = STEEPEST * y[ray] * off[ray]
    y[slow] = log_uniform(rng, 1e-3, STEEPEST_Y, int(slow.sum()))
    v[slow] = atlas.SLOW * off[slow]
    v[border] = s.v_tilde_crit(y[border]) * off[border]
    # the ridge, where the steepest ray touches the border
    other = 1.0 + rng.choice([-1.0, 1.0], n) * log_uniform(rng, 1e-12, 0.2, n)
    y[ridge] = STEEPEST_Y * other[ridge]
    v[ridge] = atlas.SLOW * (1.0 + rng.uniform(-2.0, 2.0, n) * (other - 1.0))[ridge]
    return v, y


def _ring(rng: np.random.Generator, n: int, s: Surrogate) -> tuple[Array, Array]:
    """Return points between the steepest ray and the border, and next to both, below and above the
    ridge where they meet."""
    y = np.where(
        rng.random(n) < 0.5, log_uniform(rng, 1e-6, STEEPEST_Y, n), log_uniform(rng, 1.0, 1.7, n)
    )
    crit, top = s.v_tilde_crit(y), STEEPEST * y
    within = crit * (top / crit) ** rng.random(n)
    off = 1.0 + rng.choice([-1.0, 1.0], n) * log_uniform(rng, 1e-12, 0.1, n)
    place = rng.integers(0, 3, n)
    return np.where(place == 0, within, np.where(place == 1, crit, top) * off), y


_BALL_CASES: dict[str, tuple[float, Draw]] = {
    **{name: (share, draw) for name, (share, draw) in _CASES.items() if name != "seams"},
    "random": (0.22, _CASES["random"][1]),
    "ring": (0.08, _ring),
    "seams": (0.10, _near_ball_seams),
}


def _ball_sides(surrogate: Surrogate, n: int, seed: int) -> Pairs:
    """Return the pairs of every contact, and pairs at the steepest ray."""
    rng, (low, high) = np.random.default_rng(seed), SIDES
    yield from _common_sides(surrogate, rng, n, _BALL_SEAMS, STEEPEST_Y)
    y = log_uniform(rng, 1e-6, STEEPEST_Y, n)
    yield (v := STEEPEST * y) * low, v * high, y, y
    yield (v := np.full(n, atlas.SLOW)) * low, v * high, y, y
    y = log_uniform(rng, STEEPEST_Y, 1e8, n)
    yield (v := atlas.RHO_MAX * surrogate.v_tilde_crit(y)) * low, v * high, y, y


def _off_steepest_ray(v: Array, y: Array) -> Array:
    return np.where(y < 1.1 * STEEPEST_Y, np.abs(np.log(v / (STEEPEST * y))), np.inf)


# --- all ------------------------------------------------------------------------------------------

#: by contact
DRAWS = {
    "spring": Draws(_CASES, _near_seams, _sides, lambda v, _: np.full(v.shape, np.inf)),
    "ball": Draws(_BALL_CASES, _near_ball_seams, _ball_sides, _off_steepest_ray),
}

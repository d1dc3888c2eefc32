"""Points of a ball where its rules and tables err most, and the answers there with their bounds."""

from typing import Any

import numpy as np

from mumacro import Surrogate
from mumacro.table.atlas import STEEPEST
from tests.support.cases import Array, opened

NAMES = ("mu_ratio", "power", "stick_fraction", "slope along v~", "slope along y~")


def hard_points(count: int, along: bool, seed: int = 3) -> tuple[Array, Array]:
    """Log-uniform over all of the legal range, and where rules err most: borders, corners, the
    steepest ray."""
    rng = np.random.default_rng(seed)

    def decades(low: float, high: float) -> Array:
        return 10.0 ** rng.uniform(low, high, count)

    def beside(low: float, high: float) -> Array:
        return np.asarray(1.0 + decades(low, high) * rng.choice([-0.99, 1.0], count))

    y = decades(-12, 6)
    pairs = [(y * decades(-25, 0), y)]
    if along:
        y = decades(-300, 279)
        x = np.where(rng.random(count) < 0.5, decades(-12, -0.01), 1.0 - decades(-12, -0.01))
        # reverse slip begins
        first = 1.5 / (np.sqrt((1.0 - x) * (1.0 + x)) - x * np.arccos(x)) * beside(-12, 0)
        pairs += [
            (y * decades(-25, 0), y),
            (x * first, first),
            (first * (1.0 - decades(-15, 0)), first),
        ]
        pairs += [(near * decades(-25, 0), near) for near in (beside(-15, 0), 1.5 * beside(-15, 0))]
    else:
        border = opened(1e-12).v_tilde_crit
        small, wide, high = decades(-6, 0.5), decades(-6, 6), decades(-1, 6)
        pairs += [(decades(-25, 6), decades(-12, 6)), (decades(-300, 279), decades(-300, 279))]
        pairs += [
            (small * small * decades(-5, 2), small),
            (decades(-25, 0.3), 1.5 * beside(-15, 0)),
        ]
        pairs += [(STEEPEST * wide * beside(-12, -0.5), wide)]
        pairs += [(1.5 * border(high / 1.5) * beside(-12, -0.5), high)]
        # the steepest ray enters where the ball begins to slide as a whole
        near = decades(-0.2, 0.6)
        pairs += [
            (STEEPEST * near * beside(-9, -0.5), near),
            (decades(-3, 0.2), 1.5 * decades(0.0, 0.25)),
        ]
    v, y = (np.concatenate(column) for column in zip(*pairs, strict=True))
    return v, y


def rows_of(s: Surrogate, v: Array, y: Array, direction: str) -> list[Array]:
    """Rows (values, bounds) of :data:`NAMES` for a ball."""
    kind: Any = {"contact": "ball", "direction": direction}
    values = [np.array(s.quantity(name, v, y, **kind)[:2]) for name in NAMES[:3]]
    answer = s.evaluate(mu0=1.0, Fz=1.0, k=1.0, omega=1.0, v0=v, y0=y, gradient=True, **kind)
    with np.errstate(all="ignore"):
        slopes = (
            (answer.gradient[name] * x, answer.gradient_bound[name] * x)
            for name, x in (("v0", v), ("y0", y))
        )
        return values + list(map(np.array, slopes))

"""Oscillation along and of the normal force: points to try, and what the library states there."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mumacro import Surrogate
from tests.support import extended
from tests.support.hard_points import hard_points

Array = NDArray[np.float64]
# v~ = v0 and y~ = y0, to the last digit
UNIT: dict[str, Any] = {"mu0": 0.5, "Fz": 2.0, "k": 1.0, "omega": 1.0}


def answered(s: Surrogate, v: Array, y: Array, contact: str, direction: str) -> Any:
    """Values and bounds of the rows of extended.ROWS, (5, 2, n); the power of direction normal is
    NaN."""
    kind: Any = {"contact": contact, "direction": direction}
    rows = [
        np.array(s.quantity(name, v, y, **kind)[:2])
        for name in extended.ROWS[:3]
        if direction != "normal"
    ]
    if direction == "normal":
        ratio, stick = (
            np.array(s.quantity(name, v, y, **kind)[:2]) for name in ("mu_ratio", "stick_fraction")
        )
        rows = [ratio, np.full_like(ratio, np.nan), stick]
    # UNIT has Fz = 2
    amplitude, scale = ("Fz_amplitude", 2.0) if direction == "normal" else ("y0", 1.0)
    case: Any = {**UNIT, "v0": v, amplitude: scale * y, **kind}
    answer = s.evaluate(**case, gradient=True)
    for name, x in (("v0", v), (amplitude, scale * y)):
        rows.append(
            np.array([answer.gradient[name] * x, answer.gradient_bound[name] * x]) / UNIT["mu0"]
        )
    return np.array(rows)


def ordinary(n: int, seed: int, normal: bool = False) -> tuple[Array, Array]:
    """Log-uniform points of those with v~ < y~, some of them close to v~ = y~."""
    rng = np.random.default_rng(seed)
    v, y = (
        10.0 ** rng.uniform(-6.0, 4.0, 3 * n),
        10.0 ** rng.uniform(-4.0, 0.0 if normal else 4.0, 3 * n),
    )
    v = np.where(rng.random(v.size) < 0.1, y * (1.0 - 10.0 ** rng.uniform(-12.0, 0.0, v.size)), v)
    below = v < y
    return v[below][:n], y[below][:n]


def beside_lines(n: int, seed: int, contact: str, normal: bool) -> tuple[Array, Array]:
    """Beside the lines where a formula ends: v~ = y~, and along that from which a spring slips
    backwards, of a ball its middle one."""
    rng = np.random.default_rng(seed)
    apart = 10.0 ** rng.uniform(-13.0, -1.0, n)
    y = 10.0 ** rng.uniform(-4.0, 0.0 if normal else 4.0, n)
    v = y * (1.0 - apart)
    if not normal:
        x = np.where(rng.random(n) < 0.5, 10.0 ** rng.uniform(-6.0, 0.0, n), rng.random(n))
        back = np.sqrt((1.0 - x) * (1.0 + x)) - x * np.arccos(x)
        line = (1.5 if contact == "ball" else 1.0) / np.maximum(back, 1e-9)
        reversing = rng.random(n) < 0.7
        y = np.where(reversing, line * (1.0 + rng.choice([-1.0, 1.0], n) * apart), y)
        v = np.where(reversing, x * y, v)
    below = (v < y) & (y < (1.0 if normal else 1e9))
    return v[below], y[below]


def hard(n: int, seed: int) -> tuple[Array, Array]:
    """The points at which such rules err most, where the reference has digits to spare."""
    v, y = hard_points(n, along=True, seed=seed)
    plain = (v > 1e-150) & (v < y) & (y < 1e150)
    return v[plain], y[plain]

"""Dahl and LuGre elements beside one spring and a ball: what one k gives for each.

python benchmarks/friction_models.py [--only SECTION]

All are driven along: x = v~ t + y~ sin t in units of l0 = Fc/sigma0.  A Dahl element, which is a
LuGre element without sigma1, sigma2 and the Stribeck effect, has u = F/Fc with du = (1 - u) dx
forwards and du = (1 + u) dx backwards.  Between reversals u is an exponential, so a period is a
linear map of u, and the steady cycle its fixed point.
"""

from tests.support.measuring import main, markdown, sections  # isort: split

from functools import cache

import numpy as np
from numpy.typing import NDArray

from mumacro import Surrogate

Array = NDArray[np.float64]
_STEPS = 20_000
_SPEEDS, _AMPLITUDES = (0.001, 0.01, 0.1, 1.0), (0.1, 0.3, 1.0, 3.0, 10.0)


@cache
def table() -> Surrogate:
    return Surrogate.open()


def dahl(v_tilde: float, y_tilde: float) -> float:
    """Mean force of a Dahl element over Fc, in its steady cycle."""
    t = np.linspace(0.0, 2.0 * np.pi, _STEPS + 1)
    dx = np.diff(v_tilde * t + y_tilde * np.sin(t))
    sign, decay = np.sign(dx), np.exp(-np.abs(dx))
    # u -> sign + (u - sign) decay, as a function of the first u: slope and value for u = 0
    slope, value = 1.0, 0.0
    for s, d in zip(sign.tolist(), decay.tolist(), strict=True):
        slope, value = slope * d, s + (value - s) * d
    u = value / (1.0 - slope)
    forces = []
    for s, d in zip(sign.tolist(), decay.tolist(), strict=True):
        after = s + (u - s) * d
        forces.append(0.5 * (u + after))
        u = after
    return float(np.mean(forces))


def elements() -> str:
    """Mean force over Fc of one spring, a ball and a Dahl element, along."""
    rows = []
    for y in _AMPLITUDES:
        for v in _SPEEDS:
            spring, ball = (
                table()
                .evaluate(
                    mu0=1.0, Fz=1.0, k=1.0, omega=1.0, y0=y, v0=v, contact=c, direction="along"
                )
                .mu_macro
                for c in ("spring", "ball")
            )
            rows.append([f"{y:g}", f"{v:g}", f"{spring:.3f}", f"{ball:.3f}", f"{dahl(v, y):.3f}"])
    return markdown(
        ("y0/l0", "v0/(l0 omega)", "one spring (Jenkins)", "ball", "Dahl, LuGre"), rows, 0
    )


SECTIONS = sections(elements)

if __name__ == "__main__":
    main(__doc__, SECTIONS)

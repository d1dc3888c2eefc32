"""The pictures of the tutorial and of the guide on fits, each from the numbers of its page.

python benchmarks/guide_pictures.py [FOLDER]      (default: docs/img)
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import mumacro
from mumacro.plotting import BLUE, OF_FIT, RED, head, save
from mumacro.stiffness import Material, ball_on_flat
from tests.support.measuring import IMAGES

SHAKEN: dict[str, Any] = {"mu0": 0.3, "Fz": 10.0, "k": 1e6, "f": 20e3, "v0": 0.05}
AMPLITUDES = (0.5, 5.0)  # over l0
#: of docs/how-to/fit.md
POINTS = {
    "v0": [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2],
    "mu_macro": [0.069, 0.097, 0.174, 0.221, 0.247, 0.274, 0.289, 0.305],
}


def tutorial_law(path: Path) -> None:
    """Draw the friction law of the tutorial's ball."""
    steel = Material("steel")
    ball = ball_on_flat(radius=5e-3, Fz=10.0, first=steel, second=steel)
    case = {**ball, "mu0": 0.3, "Fz": 10.0, "y0": 0.2e-6, "f": 20e3}
    law = mumacro.law(mumacro.open(), along="v0", start=1e-4, stop=1.0, **case)
    save(path, law.plot, dpi=100)


def small_and_large(path: Path) -> None:
    """Draw the forces over a period at an amplitude below and one above l0."""
    l0 = SHAKEN["mu0"] * SHAKEN["Fz"] / SHAKEN["k"]

    def draw(every: Any) -> None:
        for axes, amplitude in zip(every, AMPLITUDES, strict=True):
            moved = mumacro.motion(**SHAKEN, y=amplitude * l0)
            cycle = moved.cycle()
            time, slip = np.asarray(cycle.t) * SHAKEN["f"], SHAKEN["mu0"] * SHAKEN["Fz"]
            mean = moved.mu_macro / SHAKEN["mu0"]
            axes.plot(time, np.asarray(cycle.Fx) / slip, label="drag force")
            axes.axhline(mean, color=BLUE, ls=":", label=f"its mean, {mean:.2f}")
            axes.plot(time, np.asarray(cycle.Fy) / slip, color=RED, ls="--", label="force across")
            axes.set(xlabel="time [periods]", xlim=(0.0, 1.0), ylim=(-1.09, 1.09))
            size = "below" if amplitude < 1.0 else "above"
            head(axes, f"$y_0$ = {amplitude:g} $l_0$, {size} $l_0$")
        every[0].set_ylabel(r"force / ($\mu_0 F_z$)")

    save(path, draw, dpi=100, ncols=2, figsize=(9.0, 3.4))


def fit(path: Path) -> None:
    """Draw the fit of the guide on fits."""
    save(path, mumacro.fit(POINTS, Fz=10.0, y0=0.4e-6, f=20e3).plot, dpi=100, **OF_FIT)


PICTURES: dict[str, Callable[[Path], None]] = {
    "tutorial-law": tutorial_law,
    "small-and-large": small_and_large,
    "fit": fit,
}

if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES
    for name, draw_picture in PICTURES.items():
        draw_picture(folder / f"{name}.png")

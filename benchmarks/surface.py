"""The picture of the tabulated function: mu~ over speed and amplitude, with the border of
continuous sliding.

python benchmarks/surface.py [OUT]      (default: docs/img/surface.png)
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from benchmarks.measuring import IMAGES
from mumacro import Surrogate

# position of the label of each level: on the line v~ y~ = this
LABELS = {
    0.001: 3.0,
    0.003: 3.0,
    0.01: 3.0,
    0.03: 3.0,
    0.1: 100.0,
    0.2: 900.0,
    0.4: 1500.0,
    0.6: 250.0,
    0.8: 1500.0,
    0.9: 200.0,
    0.95: 30.0,
    0.98: 300.0,
    0.99: 30.0,
    0.999: 3.0,
}
LEVELS = sorted({*LABELS, 0.3, 0.5, 0.7})
INK, RED = "#222222", "#c1272d"


def place(surrogate: Surrogate, level: float, product: float) -> tuple[float, float]:
    """Where mu~ = ``level`` crosses the line v~ y~ = ``product``, along which mu~ rises with v~."""
    v = np.geomspace(product / 1e3, 1e3, 4001)
    at = float(np.exp(np.interp(level, surrogate.mu_ratio(v, product / v), np.log(v))))
    return at, product / at


def draw(surrogate: Surrogate, out: Path) -> None:
    """Write the picture, 900 x 640 pixels."""
    axis, halo = np.geomspace(1e-3, 1e3, 501), [withStroke(linewidth=3.0, foreground="white")]
    mu = surrogate.mu_ratio(axis, axis[:, None])
    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    axes = figure.add_subplot(xscale="log", yscale="log")
    axes.set_xlabel(r"dimensionless speed  $\tilde v = v_0 k / (\mu_0 F_z \omega)$", fontsize=12)
    axes.set_ylabel(r"dimensionless amplitude  $\tilde y = y_0 k / (\mu_0 F_z)$", fontsize=12)
    shades = LinearSegmentedColormap.from_list(
        "pale", ["#3f87b5", "#7fb9d3", "#c4e0e6", "#f2f2e2", "#fdf3d4"]
    )
    filled = axes.contourf(axis, axis, mu, levels=np.linspace(0.0, 1.0, 51), cmap=shades)
    bar = figure.colorbar(filled, ax=axes, ticks=np.linspace(0.0, 1.0, 11), pad=0.02)
    bar.set_label(r"$\tilde\mu = \mu_\mathrm{macro} / \mu_0$", fontsize=12)
    lines = axes.contour(axis, axis, mu, levels=LEVELS, colors=INK, linewidths=0.7)
    figure.draw_without_rendering()  # labels are turned along the lines as they are then
    places = [place(surrogate, *entry) for entry in LABELS.items()]
    for text in axes.clabel(
        lines, levels=list(LABELS), manual=places, fmt="%g", fontsize=10.5, inline_spacing=3
    ):
        text.set_path_effects([*halo])
    axes.plot(surrogate.v_tilde_crit(axis), axis, color=RED, lw=2.6)
    for x, y, told, turn in (
        (0.0013, 330.0, "stick and slip", 0),
        (3.0, 0.02, "continuous sliding", 0),
        (0.0062, 0.071, r"border $\tilde v_\mathrm{crit}(\tilde y)$", 24),
    ):
        axes.text(x, y, told, color=RED, fontsize=14, rotation=turn, path_effects=[*halo])
    figure.savefig(out, dpi=100)


if __name__ == "__main__":
    draw(Surrogate.open(1e-10), Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "surface.png")

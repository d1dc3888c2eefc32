"""The picture of the tabulated function: mu~ over speed and amplitude, with the border of continuous sliding.

python benchmarks/surface.py [OUT]      (default: docs/img/surface.png)
"""

import sys
from pathlib import Path

import matplotlib
import numpy as np

from benchmarks.measuring import IMAGES
from mumacro import Surrogate

matplotlib.use("Agg")
import matplotlib.patheffects as effects
import matplotlib.pyplot as plt
from matplotlib.colors import LinearSegmentedColormap

LEVELS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 0.999)
# position of the label of each level: on the line v~ y~ = this
LABELS = {0.001: 3.0, 0.003: 3.0, 0.01: 3.0, 0.03: 3.0, 0.1: 100.0, 0.2: 900.0, 0.4: 1500.0, 0.6: 250.0,
          0.8: 1500.0, 0.9: 200.0, 0.95: 30.0, 0.98: 300.0, 0.99: 30.0, 0.999: 3.0}  # fmt: skip
INK, RED = "#222222", "#c1272d"
NODES = 501


def _place(surrogate: Surrogate, level: float, product: float) -> tuple[float, float]:
    """Where mu~ = ``level`` crosses the line v~ y~ = ``product``, along which mu~ rises with v~."""
    v = np.geomspace(product / 1e3, 1e3, 4001)
    at = float(np.exp(np.interp(level, surrogate.mu_ratio(v, product / v), np.log(v))))
    return at, product / at


def draw(surrogate: Surrogate, out: Path) -> None:
    """Write the picture, 900 x 640 pixels."""
    axis = np.geomspace(1e-3, 1e3, NODES)
    mu = surrogate.mu_ratio(axis[:, None], axis[None, :])
    plt.rcParams.update({"font.size": 12, "axes.edgecolor": INK, "axes.labelcolor": INK})
    figure, axes = plt.subplots(figsize=(9.0, 6.4))
    shades = LinearSegmentedColormap.from_list("pale", ["#3f87b5", "#7fb9d3", "#c4e0e6", "#f2f2e2", "#fdf3d4"])
    filled = axes.contourf(axis, axis, mu.T, levels=np.linspace(0.0, 1.0, 51), cmap=shades)
    lines = axes.contour(axis, axis, mu.T, levels=LEVELS, colors=INK, linewidths=0.7)
    axes.set_xscale("log")
    axes.set_yscale("log")
    halo: list[effects.AbstractPathEffect] = [effects.withStroke(linewidth=2.5, foreground="white")]
    places = [_place(surrogate, level, product) for level, product in LABELS.items()]
    axes.set_xlim(1e-3, 1e3)
    axes.set_ylim(1e-3, 1e3)
    for text in axes.clabel(lines, levels=list(LABELS), manual=places, fmt="%g", fontsize=10.5, inline_spacing=3):
        text.set_path_effects(halo)
    axes.plot(surrogate.v_tilde_crit(axis), axis, color=RED, lw=2.6)
    frame = [effects.withStroke(linewidth=3.0, foreground="white")]
    axes.text(0.0013, 330.0, "stick and slip", color=RED, fontsize=14, weight="bold", path_effects=frame)
    label = r"border $\tilde v_\mathrm{crit}(\tilde y)$"
    axes.text(0.0062, 0.071, label, color=RED, fontsize=12, rotation=24, path_effects=frame)
    axes.text(3.0, 0.02, "continuous sliding", color=RED, fontsize=14, weight="bold", path_effects=frame)
    axes.set_xlabel(r"dimensionless speed  $\tilde v = v_0 k / (\mu_0 F_z \omega)$")
    axes.set_ylabel(r"dimensionless amplitude  $\tilde y = y_0 k / (\mu_0 F_z)$")
    bar = figure.colorbar(filled, ax=axes, ticks=np.linspace(0.0, 1.0, 11), pad=0.02)
    bar.set_label(r"$\tilde\mu = \mu_\mathrm{macro} / \mu_0$")
    figure.tight_layout()
    figure.savefig(out, dpi=100)
    plt.close(figure)


if __name__ == "__main__":
    draw(Surrogate.open(1e-10), Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES / "surface.png")
